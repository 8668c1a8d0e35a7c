"""Receptance of the element deflections: one reduction to modes, then any number of frequencies.

``T(omega) = W^T Z^-1 [W, loads]`` with ``Z = K' + i omega (C + speed G) - omega^2 M`` and
``K' = K + W diag(reference) W^T``, as a sum over poles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import residual_output, solve_modes
from femgear.system.system import MechanicalSystem, Modes, NonlinearSystem

# Modal damping off the diagonal, relative to the largest entry, above which the modes are coupled.
_COUPLED = 1e-9
# Distance to an undamped resonance, relative to the eigenvalue, below which the response is infinite.
_RESONANT = 1e-12
# Error of the sum over complex modes, relative, that is accepted.
_POLES = 1e-8


@dataclass(frozen=True)
class Reduction:
    """``[W^T; L] Z^-1 [W, loads]`` as ``sum_k left_k right_k h_k(omega) + residual``.

    Real modes have ``h = 1 / (omega_k^2 - omega^2 + i omega d_k)``; complex ones, of the state form,
    ``h = 1 / (i omega - lambda_k)``.

    Parameters
    ----------
    reference : (n_columns,) array
        Stiffness of the columns that Z contains [N/m].
    squared, damping : (m,) arrays, or poles : (p,) complex array
        ``omega_k^2`` [1/s^2] and ``d_k`` [1/s], or ``lambda_k`` [1/s].
    inputs : (m or p, n_columns + n_loads) array
        ``right_k``.
    pairs : (m or p, n_columns (n_columns + n_loads)) array
        ``left_k right_k`` of the columns.
    static, residual : (n_columns, n_columns + n_loads) arrays
        Flexibility of all modes and of those left out [m/N].
    system : MechanicalSystem
        Its ``W`` holds columns and loads.
    modes : Modes
        Undamped modes of that system.
    shape : (n, m or p) array
        Displacements of the poles; rigid motions of complex modes are in `drift`.
    drift : (n, p) array or None
        Velocities of rigid motions.
    """

    reference: np.ndarray
    inputs: np.ndarray
    pairs: np.ndarray
    static: np.ndarray
    residual: np.ndarray
    system: MechanicalSystem
    modes: Modes
    shape: np.ndarray
    squared: np.ndarray | None = None
    damping: np.ndarray | None = None
    poles: np.ndarray | None = None
    drift: np.ndarray | None = None

    def gain(self, omega) -> tuple[np.ndarray, np.ndarray]:
        """``h`` and ``dh/domega`` (..., m) at the angular frequencies omega (...) [rad/s].

        Motions without stiffness do not answer at frequency zero: their mean position is free.

        Raises
        ------
        ConvergenceError
            At the undamped resonance of a mode.
        """
        omega = np.asarray(omega, float)[..., None]
        if self.poles is None:
            size, below = self.squared, self.squared - omega * omega + 1j * omega * self.damping
            change = 2.0 * omega - 1j * self.damping
        else:
            size, below = np.abs(self.poles), 1j * omega - self.poles
            change = -1j
        still = (omega == 0.0) & (size <= (0.0 if self.poles is None else 1e-9 * size.max()))
        if np.any(bad := (np.abs(below) <= _RESONANT * size) & ~still):
            _refuse_resonance(self, int(np.argwhere(bad)[0][-1]))
        gain = np.where(still, 0.0, 1.0 / np.where(still, 1.0, below))
        return gain, change * gain * gain

    def at(self, omega) -> tuple[np.ndarray, np.ndarray]:
        """``W^T Z^-1 [W, loads]`` (..., n_columns, n_columns + n_loads) [m/N] and its derivative."""
        omega = np.asarray(omega, float)
        gain, change = self.gain(omega)
        shape = (*omega.shape, *self.static.shape)
        value = _times(gain, self.pairs).reshape(shape) + self.residual
        slope = _times(change, self.pairs).reshape(shape)
        return np.where((omega == 0.0)[..., None, None], self.static, value), slope


def reduce_problem(
    problem: NonlinearSystem,
    *,
    reference=None,
    count: int | None = None,
    max_frequency: float | None = None,
) -> Reduction:
    """Modes of the linear part, with the elements replaced by springs.

    Damping that the real modes make diagonal keeps them; any other damping and gyroscopic terms give complex
    modes of the state form of the kept real modes (Ewins, Modal Testing, 2nd ed., sections 2.7 and 2.8). The
    modes left out keep their static flexibility (Geradin and Rixen, Mechanical Vibrations, 3rd ed., 2.9).

    Parameters
    ----------
    problem : NonlinearSystem
        Symmetric M and K. Rigid motions that strain no column and on which the constant load does no work
        are allowed.
    reference : (n_columns,) array, optional
        Spring of every column [N/m], any that are not negative; the size of the elements' own reference
        when not given. It moves nothing but the convergence of iterations.
    count, max_frequency : int, float, optional
        Real modes to keep, see `solve_modes`; all when neither is given.

    Raises
    ------
    CaseError
        Matrices that do not fit, a constant load that no support takes up.
    ConvergenceError
        A rigid motion that strains a column, negative stiffness, a defective state matrix.
    """
    reference = np.abs(problem.reference) if reference is None else np.asarray(reference, float)
    system, modes = _modes_with_loads(problem, reference, count, max_frequency)
    columns, rows = len(reference), modes.mesh_deflection
    residual = _residual(system, modes, problem.system.W.T)
    static = _static(modes, problem.system.W.T) + residual
    common = {
        "reference": reference, "static": static, "residual": residual, "system": system, "modes": modes,
    }  # fmt: skip
    modal = modes.shape.T @ problem.damping @ modes.shape
    off = np.abs(modal - np.diag(np.diag(modal))).max(initial=0.0)
    if off > _COUPLED * np.abs(modal).max(initial=0.0):
        return _complex_modes(modal, modes, common)
    return Reduction(
        **common, inputs=np.ascontiguousarray(rows.T), pairs=_pairs(rows[:columns], rows.T),
        shape=modes.shape, squared=(2.0 * np.pi * modes.frequency) ** 2, damping=np.diag(modal).copy(),
    )  # fmt: skip


def _modes_with_loads(problem, reference, count, max_frequency) -> tuple[MechanicalSystem, Modes]:
    """The undamped system and its modes, with the loads as further columns of ``W``."""
    steady = [force.force.real for force in problem.forces if not any(force.orders)]
    bare = replace(
        problem.system, C=np.zeros_like(problem.system.C), gyroscopic=None,
        load=problem.system.load + sum(steady),
    )  # fmt: skip
    try:
        modes = solve_modes(bare, reference, damping_ratio=0.0, count=count, max_frequency=max_frequency)
    except ConvergenceError as error:
        _tell_of_the_speed(problem, error)
        raise
    loads = [bare.load]
    for force in problem.forces:
        loads += [force.force.real, force.force.imag]
    system = replace(bare, W=np.column_stack([bare.W, *loads]))
    rows = system.W.T @ modes.shape
    # columns and constant load leave rigid motions alone, solve_modes has made sure
    rows[: len(reference) + 1, modes.frequency == 0.0] = 0.0
    stiffness = np.concatenate([reference, np.zeros(len(loads))])
    return system, replace(modes, mesh_stiffness=stiffness, mesh_deflection=rows)


def _tell_of_the_speed(problem: NonlinearSystem, error: ConvergenceError) -> None:
    """Raise a negative stiffness again with a remedy for systems that turn: K may hold centripetal terms."""
    if error.code != "E-STIFFNESS" or problem.system.gyroscopic is None:
        return
    raise ConvergenceError(
        error.message + ", in a system that turns", code=error.code,
        remedy="where K holds centripetal terms (-speed^2) the speed is above a critical one: lower the "
        "speed or leave those terms out; else check the signs of supports, couplings and mesh directions",
    ) from error  # fmt: skip


def respond(reduction: Reduction, outputs, omega, inputs) -> np.ndarray:
    """``L Z^-1 [W, loads] inputs`` at every line.

    Parameters
    ----------
    reduction : Reduction
    outputs : (n_outputs, n) array
        ``L``.
    omega : (L,) array
        [rad/s].
    inputs : (n_columns + n_loads, L) complex array
        Forces on the columns [N] and amplitudes of the loads.

    Returns
    -------
    (n_outputs, L) complex array
    """
    gain, _ = reduction.gain(omega)
    coordinates = (reduction.inputs @ inputs) * gain.T
    out = (outputs @ reduction.shape) @ coordinates
    if reduction.drift is not None:
        still = omega == 0.0
        out += (outputs @ reduction.drift) @ (coordinates / np.where(still, np.inf, 1j * omega))
        out[:, still] = _static(reduction.modes, outputs) @ inputs[:, still]
    return out + _residual(reduction.system, reduction.modes, outputs) @ inputs


def _static(modes: Modes, outputs) -> np.ndarray:
    """Static flexibility of the modes from columns and loads to the outputs; rigid motions stay out."""
    square = np.where(modes.frequency > 0.0, 2.0 * np.pi * modes.frequency, np.inf) ** 2
    return ((outputs @ modes.shape) / square) @ modes.mesh_deflection.T


def _residual(system: MechanicalSystem, modes: Modes, outputs) -> np.ndarray:
    """Static flexibility of the modes left out; zero when all are there."""
    if len(modes.frequency) == len(system.M):
        return np.zeros((len(outputs), system.W.shape[1]))
    return residual_output(system, modes, outputs)


def _pairs(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return (left.T[:, :, None] * right[:, None, :]).reshape(len(right), -1)


def _complex_modes(modal, modes: Modes, common) -> Reduction:
    """Poles and residues of the state ``(eta, eta', v)``: elastic modes and velocities of rigid ones.

    Rigid motions enter by their velocity alone, so that free rotation makes no double pole at zero.
    """
    natural = 2.0 * np.pi * modes.frequency
    elastic, rigid = np.flatnonzero(natural > 0.0), np.flatnonzero(natural == 0.0)
    m, order = len(elastic), np.concatenate([elastic, rigid])
    state = np.zeros((2 * m + len(rigid),) * 2)
    # speeds scaled by a mean frequency keep the state matrix balanced
    scale = np.exp(np.mean(np.log(natural[elastic])))
    state[:m, m : 2 * m] = scale * np.eye(m)
    state[m : 2 * m, :m] = -np.diag(natural[elastic] ** 2) / scale
    state[m:, m:] = -modal[np.ix_(order, order)]
    rows = modes.mesh_deflection
    drive = np.zeros((len(state), len(rows)))
    drive[m:] = rows[:, order].T / scale
    poles, vectors = np.linalg.eig(state)
    inputs = np.linalg.solve(vectors, drive.astype(complex))
    columns = len(common["reference"])
    reduction = Reduction(
        **common, inputs=inputs, pairs=_pairs(rows[:columns, elastic] @ vectors[:m], inputs), poles=poles,
        shape=modes.shape[:, elastic] @ vectors[:m], drift=modes.shape[:, rigid] @ vectors[2 * m :] * scale,
    )  # fmt: skip
    _check_poles(reduction, modal, natural, scale)
    return reduction


def _check_poles(reduction: Reduction, modal, natural, omega: float) -> None:
    """Compare the sum over complex modes with the equations solved directly at one frequency."""
    rows = reduction.modes.mesh_deflection
    stiffness = np.diag(natural**2 - omega**2) + 1j * omega * modal
    direct = rows[: len(reduction.reference)] @ np.linalg.solve(stiffness, rows.T.astype(complex))
    error = np.abs(reduction.at(omega)[0] - reduction.residual - direct).max()
    if not error <= _POLES * np.abs(direct).max(initial=np.finfo(float).tiny):
        raise ConvergenceError(
            f"the complex modes give a receptance that is wrong by {error:.2e} of {np.abs(direct).max():.2e}",
            code="E-DEFECTIVE", remedy="modes are critically damped together: change the damping a little",
        )  # fmt: skip


def _refuse_resonance(reduction: Reduction, mode: int):
    if reduction.poles is None:
        frequency = np.sqrt(reduction.squared[mode]) / (2.0 * np.pi)
    else:
        frequency = np.abs(reduction.poles[mode]) / (2.0 * np.pi)
    raise ConvergenceError(
        f"undamped resonance of mode {mode + 1} at {frequency:.6g} Hz: infinite response",
        code="E-RESONANCE", remedy="give the mode some damping, or move the frequency or the reference",
    )  # fmt: skip


def _times(gain: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """``gain @ pairs``; two real products where the pairs are real."""
    if np.iscomplexobj(pairs):
        return gain @ pairs
    return gain.real @ pairs + 1j * (gain.imag @ pairs)


def source_columns(problem: NonlinearSystem, orders: np.ndarray) -> np.ndarray:
    """Amplitudes (1 + 2 n_forces, L) of the load columns of a reduction on the lines ``orders``.

    The first column holds the constant load with the forces of order zero.

    Raises
    ------
    CaseError
        A harmonic force on a line that is not there.
    """
    out = np.zeros((1 + 2 * len(problem.forces), len(orders)), complex)
    out[0, 0] = 1.0
    bases = orders.shape[1]
    for number, force in enumerate(problem.forces):
        if not any(force.orders):
            continue
        given = np.array([*force.orders, *[0] * bases])
        same, mirror = (np.flatnonzero(np.all(orders == sign * given[:bases], axis=1)) for sign in (1, -1))
        if np.any(given[bases:]) or not len(same) + len(mirror):
            raise CaseError(
                f"harmonic force {number + 1} has the orders {tuple(force.orders)}, which no line has",
                code="E-LINES", remedy="add that line",
            )  # fmt: skip
        line, sign = (same[0], 1.0) if len(same) else (mirror[0], -1.0)
        out[1 + 2 * number : 3 + 2 * number, line] = 1.0, 1j * sign
    return out
