"""Mean loads that no element can carry: a contact that they pull apart, with nothing else to hold it.

A periodic motion needs a mean acceleration of zero, so on motions that supports leave free the mean forces
of the elements balance the constant load (Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems,
2019, section 2.3: line zero of the harmonic equations). A one-sided contact pushes only; where the load asks
it to pull, its mean deflection grows without end, and so does everything that is measured by it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femgear.solvers.harmonic_equations import HarmonicBalance

# Mean deflection, over the typical one and over the lengths of the elements, beyond which it is far away.
_FAR, _LENGTHS = 1e6, 10.0
# Share of the static deflection by which the mean may be out of balance.
_BALANCED = 1e-3
# Stiffness relative to the largest, strain of a column and force beyond reach that count as none.
_FREE, _UNSTRAINED, _BEYOND = 1e-11, 1e-9, 1e-6
# Degrees of freedom up to which the free motions are computed to name the cause.
_MANY = 1500


def far(balance: HarmonicBalance) -> float:
    """Mean deflection [m] beyond which no element takes up more: a size that cannot run away."""
    return max(_FAR * balance.scale, _LENGTHS * balance.longest)


def relative_residual(balance: HarmonicBalance, error, y) -> float:
    """Largest violation relative to the largest deflection, of which the mean counts up to `far` only.

    Parameters
    ----------
    balance : HarmonicBalance
    error, y : (n_y,) arrays
        Residual [m] and unknowns.
    """
    table = np.abs(np.reshape(y, (len(balance.reduction.reference), -1)))
    mean = min(float(table[:, 0].max()), far(balance))
    size = max(mean, float(table[:, 1:].max(initial=0.0)), 1e-9 * balance.scale)
    # numbers that are not finite must not count as a large deflection
    return float(np.abs(error).max() / size) if np.all(np.isfinite(y)) else np.inf


def uncarried_note(balance: HarmonicBalance, lines, residual, converged: bool) -> str:
    """Which column's mean load nothing carries; empty where there is no such column.

    Parameters
    ----------
    balance : HarmonicBalance
    lines : (n_columns, L) complex array
        Deflections [m].
    residual : callable
        Without arguments: violation (n_columns, L) of the harmonic equations at the lines [m].
    converged : bool
        Converged lines are doubted only where their mean is far away and out of balance.
    """
    mean = np.abs(lines[:, 0])
    finite = bool(np.all(np.isfinite(lines)))
    away = not finite or mean.max() > max(far(balance), 10.0 * np.abs(lines[:, 1:]).max(initial=0.0))
    if converged and not away:
        return ""
    # first by the forces alone: so far away the residual is the rounding of two large numbers
    found = _beyond_reach(balance)
    if found is not None:
        column, wanted, low, high = found
        bound = f"no less than {low:.4g} N" if wanted < low else f"no more than {high:.4g} N"
        why = f"it needs {wanted:.4g} N, the elements there give {bound}"
    elif away and finite and np.abs(residual()[:, 0]).max() > _BALANCED * balance.scale:
        column = int(np.argmax(mean))
        why = f"its mean deflection runs away, {lines[column, 0].real:.3g} m"
    else:
        return ""
    return (
        f"nothing carries the mean load of column {column + 1}{_named(balance, column)}: {why}; turn the "
        "load round, give the contact a back side (backlash) or add a support"
    )


def _named(balance: HarmonicBalance, column: int) -> str:
    from femgear.solvers.harmonic_equations import element_name

    name = element_name(balance.problem, column)
    return f" ({name})" if not name.startswith("column") else ""


def _beyond_reach(balance: HarmonicBalance) -> tuple[int, float, float, float] | None:
    """Column, mean force wanted of it, lowest and highest mean force that its elements have [N].

    None where some forces within the reach of all elements balance the load on the free motions: a linear
    programme that minimises what is left over. Of several columns the least forces are the wanted ones.
    """
    from scipy import optimize

    strain, load = _free_balance(balance)
    columns = np.flatnonzero(np.abs(strain).max(axis=0, initial=0.0) > _UNSTRAINED)
    if not len(columns) or not np.any(load):
        return None
    wanted = np.linalg.lstsq(strain[:, columns], load, rcond=None)[0]
    size = np.abs(wanted).max() or 1.0
    reach = np.array([_reach(balance, int(column)) for column in columns])
    rows, eye = strain[:, columns], np.eye(len(load))
    bounds = np.clip(reach / size, -_FAR, _FAR).tolist() + [(0.0, None)] * (2 * len(load))
    cost = np.concatenate([np.zeros(len(columns)), np.ones(2 * len(load))])
    left = optimize.linprog(cost, A_eq=np.hstack([rows, eye, -eye]), b_eq=load / size, bounds=bounds)
    if not left.success or left.fun <= _BEYOND * np.abs(load / size).max():
        return None
    worst = int(np.argmax(np.maximum(reach[:, 0] - wanted, wanted - reach[:, 1])))
    return int(columns[worst]), float(wanted[worst]), *reach[worst].tolist()


def _free_balance(balance: HarmonicBalance) -> tuple[np.ndarray, np.ndarray]:
    """Strain (r, n_columns) of the columns by motions that only elements hold, and the load (r,) on them.

    Rows have unit size; none for systems so large that the motions are not looked for.
    """
    from scipy import linalg

    system, reference = balance.problem.system, balance.reduction.reference
    if len(system.M) > _MANY:
        return np.zeros((0, len(reference))), np.zeros(0)
    square, shape = linalg.eigh(0.5 * (system.K + system.K.T), system.M)
    whole = np.diag(system.K) + np.einsum("ij,j,ij->i", system.W, reference, system.W)
    free = shape[:, np.abs(square) <= _FREE * np.abs(whole / np.diag(system.M)).max()]
    steady = sum(force.force.real for force in balance.problem.forces if not any(force.orders))
    strain, load = free.T @ system.W, free.T @ (system.load + steady)
    size = np.abs(strain).max(axis=1, initial=0.0)
    # motions that strain no column carry no load either: the reduction has made sure
    held = size > _UNSTRAINED * size.max(initial=0.0)
    return strain[held] / size[held, None], load[held] / size[held]


def _reach(balance: HarmonicBalance, column: int) -> tuple[float, float]:
    """Lowest and highest mean force [N] of a column between far apart and far together."""
    values = []
    for sign in (-1.0, 1.0):
        lines = np.zeros((len(balance.reduction.reference), len(balance.orders)), complex)
        lines[column, 0] = sign * far(balance)
        beyond = balance.forces(lines).lines[column, 0].real
        values.append(float(beyond + balance.reduction.reference[column] * lines[column, 0].real))
    low, high = sorted(values)
    # what is left of two large numbers is their rounding
    rounding = 1e-12 * balance.reduction.reference[column] * far(balance)
    return (0.0 if abs(low) <= rounding else low), (0.0 if abs(high) <= rounding else high)
