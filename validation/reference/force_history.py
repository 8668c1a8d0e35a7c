"""Linear systems under force histories, by three routes that can be compared: full, modal and condensed.

Exact steps for forces that are linear between the instants.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping, residual_output, undamped_modes
from femgear.solvers.time.steps import step_matrices
from femgear.system.system import MechanicalSystem
from validation.reference.guyan import choose_masters, condense

ROUTES = ("full", "modal", "guyan")


@dataclass(frozen=True)
class ForceResponse:
    """Motion of a linear system at the instants of its force history.

    Parameters
    ----------
    time : (n_times,) array
        [s].
    displacement, velocity : (n_times, n) arrays
        All degrees of freedom, whatever the route.
    deflection : (n_times, n_columns) array
        ``W^T q`` [m].
    route : str
    unknowns : int
        Modes or degrees of freedom that were integrated.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray
    route: str
    unknowns: int

    def __post_init__(self):
        for name in ("time", "displacement", "velocity", "deflection"):
            array = np.array(getattr(self, name), float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def solve_force_history(
    system: MechanicalSystem,
    times,
    force,
    *,
    route: str = "modal",
    mesh_stiffness=None,
    damping_ratio=None,
    start=None,
    count: int | None = None,
    max_frequency: float | None = None,
    masters=None,
) -> ForceResponse:
    """``M q'' + C q' + (K + W k W^T) q = load + force(t)``, exact for forces linear between the instants.

    Parameters
    ----------
    system : MechanicalSystem
    times : (n_times,) array
        Equidistant [s].
    force : (n_times, n) array
        Force history [N, N m], added to the constant load of the system.
    route : str
        "full": all degrees of freedom, any damping; "modal": superposition of the modes with the static
        answer of those left out; "guyan": on masters, see `guyan`, the others following statically.
    mesh_stiffness : (n_columns,) array, optional
        Of the columns [N/m]; zero when not given.
    damping_ratio : float or (n_modes,) array, optional
        Of the modes, instead of the damping matrix, for all routes the same.
    start : pair of (n,) arrays, optional
        Displacement and velocity at the first instant; at rest when not given.
    count, max_frequency : optional
        Modes kept, as in `undamped_modes`; with "guyan", ``count`` is a number of masters to be chosen.
    masters : (n_masters,) int array, optional
        For "guyan".

    Raises
    ------
    CaseError
        Instants that are not equidistant, shapes that do not fit, an unknown route, what `undamped_modes`,
        `condense` refuse.
    """
    step = equidistant(times)
    n, columns = system.W.shape
    force = np.asarray(force, float)
    if force.shape != (len(times), n) or not np.all(np.isfinite(force)):
        raise CaseError(
            f"a force history of shape {force.shape}",
            code="E-SHAPE",
            key="force",
            limit=f"finite numbers ({len(times)}, {n})",
        )
    stiffness = np.zeros(columns) if mesh_stiffness is None else np.asarray(mesh_stiffness, float)
    start = np.zeros((2, n)) if start is None else np.array(start, float)
    total = force + system.load
    if route == "modal":
        keep = {"damping_ratio": damping_ratio, "count": count, "max_frequency": max_frequency}
        q, v, unknowns = _modal(system, stiffness, step, total, start, keep)
    elif route in ROUTES:
        if damping_ratio is not None:
            system = replace(system, C=modal_damping(system, stiffness, damping_ratio))
        if route == "full":
            q, v = _direct(system, stiffness, step, total, start)
            unknowns = n
        else:
            chosen = choose_masters(system, count or n, mesh_stiffness=stiffness) if masters is None else masters
            q, v, unknowns = _condensed(system, stiffness, step, total, start, chosen)
    else:
        raise CaseError(f"no route {route}", code="E-CHOICE", key="route", limit=", ".join(ROUTES))
    return ForceResponse(times, q, v, q @ system.W, route, unknowns)


def _direct(system, stiffness, step, force, start):
    total = system.K + (system.W * stiffness) @ system.W.T
    return state_history(system.M, system.C, total, step, force, start=start)


def _modal(system, stiffness, step, force, start, keep):
    """The meshes are springs here, and the load is in the force history: rigid motions may be driven."""
    n = len(system.M)
    total = system.K + (system.W * stiffness) @ system.W.T
    linear = replace(system, K=total, W=np.zeros((n, 0)), load=np.zeros(n), gyroscopic=None)
    modes = undamped_modes(linear, np.zeros(0), **keep)
    natural, shape = 2.0 * np.pi * modes.frequency, modes.shape
    begin = start @ (system.M @ shape)
    y, v = modal_history(natural, modes.damping_ratio, step, force @ shape, start=begin)
    q = y @ shape.T
    if shape.shape[1] < n:
        q += _left_out(linear, modes, force)
    return q, v @ shape.T, shape.shape[1]


def _left_out(system, modes, force):
    """Static displacement (n_times, n) of the modes left out."""
    n = len(system.M)
    # a column for every degree of freedom: the residual of the columns is that of all motions
    columns = replace(system, W=np.eye(n))
    free_modes = replace(modes, mesh_stiffness=np.zeros(n), mesh_deflection=modes.shape)
    return force @ residual_output(columns, free_modes, np.eye(n)).T


def _condensed(system, stiffness, step, force, start, masters):
    reduction = condense(system, masters, mesh_stiffness=stiffness)
    back = reduction.transformation
    q, v = _direct(reduction.system, stiffness, step, force @ back, start[:, reduction.masters])
    return q @ back.T, v @ back.T, len(reduction.masters)


def modal_history(natural, damping_ratio, step, force, *, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Motion of uncoupled modes under forces that are linear between equidistant instants, exact there.

    Parameters
    ----------
    natural, damping_ratio : (m,) arrays
        As for `step_matrices`.
    step : float
        Distance of the instants [s].
    force : (n_times, m) array
        Modal forces ``phi^T p`` of mass-normalised modes.
    start : pair of (m,) arrays, optional
        Modal displacement and velocity at the first instant; at rest when not given.

    Returns
    -------
    two (n_times, m) arrays
        Modal displacements and velocities.
    """
    force = np.asarray(force, float)
    transition, first, last = step_matrices(natural, damping_ratio, step)
    states = np.zeros((len(force), force.shape[1], 2))
    if start is not None:
        states[0] = np.stack(start, axis=1)
    push = force[:-1, :, None] * first + force[1:, :, None] * last
    _scan(transition, states, push)
    return states[..., 0], states[..., 1]


def _scan(transition, states, push) -> None:
    """``states[i + 1] = P states[i] + push[i]``, in blocks that advance side by side.

    Blocks of about sqrt(n) steps start from zero together; then the state at the start of every block is
    added with the powers of P. Twice sqrt(n) array operations replace n.
    """
    count = len(push)
    if not count:
        return
    length = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // length)
    padded = np.zeros((blocks * length, *push.shape[1:]))
    padded[:count] = push
    padded = padded.reshape(blocks, length, *push.shape[1:])
    powers = np.empty((length, *transition.shape))
    power, state = transition, np.zeros((blocks, *push.shape[1:]))
    for j in range(length):
        powers[j] = power
        power = transition @ power
        state = np.einsum("mij,bmj->bmi", transition, state) + padded[:, j]
        padded[:, j] = state
    carry = states[0]
    for block in padded:
        block += np.einsum("kmij,mj->kmi", powers, carry)
        carry = block[-1].copy()
    states[1:] = padded.reshape(-1, *push.shape[1:])[:count]


def state_step(mass, damping, stiffness, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Exact step of ``M q'' + C q' + K q = p`` with p linear in the step, any C: state ``(q, h v)``.

    Returns
    -------
    (2n, 2n), (2n, n), (2n, n) arrays
        ``state_1 = P state_0 + start p_0 + end p_1``.
    """
    from scipy import linalg

    n = len(mass)
    solved = linalg.solve(mass, np.hstack([stiffness, damping, np.eye(n)]), assume_a="pos")
    matrix = np.zeros((4 * n, 4 * n))
    identity = np.eye(n)
    matrix[:n, n : 2 * n], matrix[2 * n : 3 * n, 3 * n :] = identity, identity
    matrix[n : 2 * n, :n] = -step * step * solved[:, :n]
    matrix[n : 2 * n, n : 2 * n] = -step * solved[:, n : 2 * n]
    matrix[n : 2 * n, 2 * n : 3 * n] = step * step * solved[:, 2 * n :]
    exact = linalg.expm(matrix)[: 2 * n]
    constant, ramp = exact[:, 2 * n : 3 * n], exact[:, 3 * n :]
    return exact[:, : 2 * n], constant - ramp, ramp


def state_history(mass, damping, stiffness, step, force, *, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Motion (n_times, n) and velocity of a system with any damping; arguments as for `modal_history`."""
    force = np.asarray(force, float)
    transition, first, last = state_step(mass, damping, stiffness, step)
    n = len(mass)
    states = np.zeros((len(force), 2 * n))
    if start is not None:
        states[0] = np.concatenate([start[0], step * np.asarray(start[1], float)])
    push = force[:-1] @ first.T + force[1:] @ last.T
    for i, row in enumerate(push):
        states[i + 1] = transition @ states[i] + row
    return states[:, :n], states[:, n:] / step


def equidistant(times) -> float:
    """Distance of ascending instants that must be equidistant [s]."""
    times = np.asarray(times, float)
    distance = np.diff(times)
    if times.ndim != 1 or len(times) < 2 or not np.all(np.isfinite(times)) or np.any(distance <= 0.0):
        raise CaseError("two ascending instants or more are needed", code="E-RANGE", key="times")
    step = (times[-1] - times[0]) / (len(times) - 1)
    error = np.abs(distance - step).max()
    if error > 1e-6 * step:
        raise CaseError(
            f"instants {error:.3g} s off an equidistant grid of {step:.6g} s",
            code="E-RANGE",
            key="times",
            limit="equidistant instants",
            remedy="interpolate the forces on a grid first",
        )
    return float(step)
