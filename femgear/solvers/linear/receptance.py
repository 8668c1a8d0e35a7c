"""Receptances: as sums over modes, and reduced to the deflections of the elements.

Forces excite a linear system (`modal_response`). Of a problem with nonlinear elements one
reduction to modes serves any number of frequencies (`reduce_problem`), ``T(omega) = W^T Z^-1 [W, loads]`` of
``Z = K' + i omega (C + speed G) - omega^2 M`` and ``K' = K + W diag(reference) W^T``, as a sum over poles.
At few frequencies solving Z at each is cheaper than complex modes (`reduce_directly`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import (
    pseudo_solve,
    rigid_basis,
    state_matrix,
    total_stiffness,
    undamped_modes,
)
from femgear.system.system import MechanicalSystem, Modes, NonlinearSystem

# Distance to an undamped pole, relative to it, below which the response is infinite.
_RESONANT = 1e-12
# Modal damping off the diagonal, relative to the largest entry, above which the modes are coupled.
_COUPLED = 1e-9
# Size of a pole, relative to the largest one, that is none: a motion without stiffness.
_STILL = 1e-9
# Error of the sum over complex modes, relative, that is accepted.
_POLES = 1e-8
# Frequencies up to which solving the equations at each is cheaper than complex modes: measured with 6 to 500
# degrees of freedom, the modes cost as much as 33 to 311 of them.
FEW_FREQUENCIES = 30
# Condition of the equations at a frequency, rows and columns scaled, beyond which the poles answer: they know
# an undamped resonance. Share of the smallest stiffness in the largest below which a motion may be rigid.
_ILL, _HELD = 1e10, 1e-8


@dataclass(frozen=True)
class MeshErrorResponse:
    """Response to transmission errors on harmonics of the mesh frequency.

    Parameters
    ----------
    mesh_frequency : (F,) array
        [Hz]
    harmonics : (H,) int array
        Multiples of the mesh frequency.
    deflection : (F, H, n_meshes) complex array
        ``W^T q`` [m]: the dynamic transmission error of every mesh.
    force : (F, H, n_meshes) complex array
        Dynamic mesh force ``k (W^T q - e)`` [N].
    """

    mesh_frequency: np.ndarray
    harmonics: np.ndarray
    deflection: np.ndarray
    force: np.ndarray


def modal_response(system: MechanicalSystem, modes: Modes, frequency, inputs, outputs) -> np.ndarray:
    """Compute receptances ``L (K' + i omega C - omega^2 M)^-1 B`` [m/N] by modes and their static rest.

    ``sum (L phi) (phi^T B) / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega) + R``, R = ``L K^+ B`` less the
    static part of the sum (D. J. Ewins, Modal Testing, 2nd ed., 2000, section 2.4; Geradin and Rixen,
    Mechanical Vibrations, 3rd ed., 2.9). Exact with all modes; without some, good below their frequencies.

    Parameters
    ----------
    modes : Modes
        Of that system.
    frequency : (F,) array
        [Hz], positive or zero.
    inputs : (n, n_inputs) array
        ``B``, one column a force.
    outputs : (n_outputs, n) array
        ``L``.

    Returns
    -------
    (F, n_outputs, n_inputs) complex array
        Receptances [m/N and the like].

    Raises
    ------
    CaseError
        Arrays that do not fit (E-SHAPE), frequencies that are none (E-RANGE).
    ConvergenceError
        An undamped resonance (E-RESONANCE).
    """
    omega, inputs, outputs = _checked(frequency, inputs, outputs, len(system.M))
    left, right = outputs @ modes.shape, modes.shape.T @ inputs
    gain = _gain(modes, slice(None), omega)
    result = (gain @ _pairs(left, right)).reshape(len(omega), len(left), -1)
    natural = 2.0 * np.pi * modes.frequency
    if len(natural) < len(system.M):
        elastic = natural > 0.0
        static = outputs @ pseudo_solve(*rigid_basis(system, modes), inputs)
        result += static - (left[:, elastic] / natural[elastic] ** 2) @ right[elastic]
    return result


def modal_error_response(modes: Modes, mesh_frequency, error, *, harmonics=None) -> MeshErrorResponse:
    """Compute mesh deflections [m] and forces [N] by errors ``e_j = Re sum_h error_jh exp(i h omega_m t)``.

    ``q = sum phi (phi^T W k e) / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)``, with the static
    flexibility of modes that were left out (Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 2.9;
    A. Kahraman, J. Mech. Des. 116, 1994, 713-720, sums all modes). Many cases share one gain. A transmission
    error does no work on rigid motions, so that these stay at rest.

    Parameters
    ----------
    modes : Modes
        ``modes.mesh_stiffness`` are the stiffnesses ``k`` of the columns of ``W``.
    mesh_frequency : (F,) array
        [Hz]
    error : (n_columns, H) or (n_cases, n_columns, H) complex array
        [m]; of one case the result has a first axis of length one. For phases phi_j as fractions of the mesh
        period, ``k_j(tau) = k(tau + phi_j)``, it is ``e_h exp(2 pi i h phi_j)``.
    harmonics : (H,) int array, optional
        Whole numbers from 1; 1 to H when not given.

    Returns
    -------
    MeshErrorResponse
        With a first axis of the cases, (n_cases, F, H, n_columns).

    Raises
    ------
    CaseError
        Errors that do not fit (E-SHAPE), harmonics or frequencies that are none (E-HARMONICS, E-RANGE).
    ConvergenceError
        An undamped resonance (E-RESONANCE).
    """
    k, error = modes.mesh_stiffness, np.asarray(error, complex)
    error = error[None] if error.ndim == 2 else error
    harmonics = np.arange(1, error.shape[-1] + 1) if harmonics is None else np.atleast_1d(harmonics)
    if harmonics.ndim != 1 or harmonics.dtype.kind not in "iu" or np.any(harmonics < 1):
        raise CaseError(
            f"harmonics {harmonics.tolist()} of the mesh frequency",
            code="E-HARMONICS",
            key="harmonics",
            limit="whole numbers from 1",
            remedy="the mean of a transmission error is a static load",
        )
    if error.shape[1:] != (len(k), len(harmonics)) or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape}",
            code="E-SHAPE",
            limit=f"(cases, {len(k)} meshes, {len(harmonics)} harmonics), finite",
        )
    frequency = np.atleast_1d(np.asarray(mesh_frequency, float))
    elastic = np.flatnonzero(modes.frequency > 0.0)
    left = modes.mesh_deflection[:, elastic]
    push = k[:, None] * error
    modal = np.einsum("jm,cjh->chm", left, push)
    # all modes leave nothing out but rounding
    rest = modes.residual if modes.shape.shape[1] < len(modes.shape) else np.zeros_like(modes.residual)
    static = np.einsum("oj,cjh->cho", rest, push)
    deflection = np.empty((len(error), len(frequency), len(harmonics), len(k)), complex)
    for place, harmonic in enumerate(harmonics):
        gain = _gain(modes, elastic, _angular(harmonic * frequency))
        deflection[:, :, place] = (gain * modal[:, None, place]) @ left.T + static[:, None, place]
    force = k * (deflection - error.transpose(0, 2, 1)[:, None])
    return MeshErrorResponse(frequency, harmonics, deflection, force)


@dataclass(frozen=True)
class Reduction:
    """``[W^T; L] Z^-1 [W, loads]`` as ``sum_k left_k right_k h_k(omega)`` over all modes.

    Real modes have ``h = 1 / (omega_k^2 - omega^2 + i omega d_k)``; complex ones, of the state form,
    ``h = 1 / (i omega - lambda_k)``. Both are ``1 / (constant + i omega linear - square omega^2)``.

    Parameters
    ----------
    reference : (n_columns,) array
        Stiffness of the columns that Z contains [N/m].
    constant, linear : (m or p,) arrays
        ``omega_k^2`` [1/s^2] and ``d_k`` [1/s], or ``-lambda_k`` [1/s] and one.
    square : float
        One for real modes, zero for complex ones.
    inputs : (m or p, n_columns + n_loads) array
        ``right_k``.
    pairs : (m or p, n_columns (n_columns + n_loads)) array
        ``left_k right_k`` of the columns.
    static : (n_columns, n_columns + n_loads) array
        Flexibility without the rigid motions [m/N].
    modes : Modes
        Undamped, of the system whose ``W`` holds columns and loads.
    shape : (n, m or p) array
        Displacements of the poles; rigid motions of complex modes are in `drift`.
    drift : (n, p) array or None
        Velocities of rigid motions.
    """

    reference: np.ndarray
    constant: np.ndarray
    linear: np.ndarray
    square: float
    inputs: np.ndarray
    pairs: np.ndarray
    static: np.ndarray
    modes: Modes
    shape: np.ndarray
    drift: np.ndarray | None = None

    def gain(self, omega) -> tuple[np.ndarray, np.ndarray]:
        """Compute ``h`` and ``dh/domega`` (..., m) at the angular frequencies omega (...) [rad/s].

        Motions without stiffness do not answer at frequency zero: their mean position is free.

        ConvergenceError at the undamped resonance of a mode.
        """
        omega = np.asarray(omega, float)[..., None]
        size = np.abs(self.constant)
        below = self.constant - self.square * omega * omega + 1j * omega * self.linear
        change = 2.0 * self.square * omega - 1j * self.linear
        still = (omega == 0.0) & (size <= (0.0 if self.square else _STILL * size.max()))
        if np.any(bad := (np.abs(below) <= _RESONANT * size) & ~still):
            mode = int(np.argwhere(bad)[0][-1])
            natural = np.sqrt(size[mode]) if self.square else size[mode]
            raise _resonance(
                f"of mode {mode + 1} at {natural / (2.0 * np.pi):.6g} Hz",
                "give the mode some damping, or move the frequency or the reference",
            )
        gain = np.where(still, 0.0, 1.0 / np.where(still, 1.0, below))
        return gain, change * gain * gain

    def value(self, omega) -> np.ndarray:
        """Compute ``W^T Z^-1 [W, loads]`` (..., n_columns, n_columns + n_loads) [m/N] at omega [rad/s]."""
        return self.at(omega)[0]

    def outputs(self, outputs, omega, inputs) -> np.ndarray:
        """Compute the outputs ``L Z^-1 [W, loads] inputs`` (n_outputs, L); see `respond`."""
        gain, _ = self.gain(omega)
        coordinates = (self.inputs @ inputs) * gain.T
        out = (outputs @ self.shape) @ coordinates
        if self.drift is not None:
            still = omega == 0.0
            out += (outputs @ self.drift) @ (coordinates / np.where(still, np.inf, 1j * omega))
            out[:, still] = _static(self.modes, outputs) @ inputs[:, still]
        return out

    def at(self, omega) -> tuple[np.ndarray, np.ndarray]:
        """Compute ``W^T Z^-1 [W, loads]`` (..., n_columns, n_columns + n_loads) [m/N] and its derivative.

        At the angular frequencies omega (...) [rad/s], by which the derivative is.
        """
        omega = np.asarray(omega, float)
        gain, change = self.gain(omega)
        shape = (*omega.shape, *self.static.shape)
        value = _times(gain, self.pairs).reshape(shape)
        slope = _times(change, self.pairs).reshape(shape)
        return np.where((omega == 0.0)[..., None, None], self.static, value), slope


@dataclass(frozen=True, eq=False)
class DirectReduction:
    """The answers of a `Reduction` for few frequencies: ``Z X = [W, loads]`` solved anew at each, no modes.

    Equations and unknowns are divided by the root of their own stiffness. What so many unknowns make
    inaccurate, as an undamped resonance, the poles answer (or refuse).

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    reference : (n_columns,) array
        Stiffness of the columns that Z contains [N/m].
    scale : (n,) array
        One over the root of the stiffness of every degree of freedom.
    mass, damping, stiffness : (n, n) arrays
        Of Z, scaled.
    loads : (n, n_columns + n_loads) array
        ``[W, loads]``, scaled.
    static : (n_columns, n_columns + n_loads) array
        Flexibility [m/N].
    """

    problem: NonlinearSystem
    reference: np.ndarray
    scale: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    loads: np.ndarray
    static: np.ndarray

    @cached_property
    def poles(self) -> Reduction:
        """The same reduction as sum over the modes."""
        return reduce_problem(self.problem)

    @cached_property
    def _latest(self) -> dict[bytes, tuple[np.ndarray, bool]]:
        """Solutions at the frequencies asked last, which one motion asks for several times."""
        return {}

    def value(self, omega) -> np.ndarray:
        """Compute ``W^T Z^-1 [W, loads]`` (..., n_columns, n_columns + n_loads) [m/N] at omega [rad/s]."""
        omega = np.asarray(omega, float)
        motions, resolved = self._motions(omega.ravel())
        if not resolved:
            return self.poles.value(omega)
        columns = self.loads[:, : len(self.reference)]
        return (columns.T @ motions).reshape(*omega.shape, *self.static.shape)

    def at(self, omega) -> tuple[np.ndarray, np.ndarray]:
        """Compute `value` and its derivative ``-W^T Z^-1 (i C - 2 omega M) Z^-1 [W, loads]`` by omega.

        Both are (..., n_columns, n_columns + n_loads) [m/N, m s/N] at angular frequencies (...) [rad/s].
        """
        omega = np.asarray(omega, float)
        motions, resolved = self._motions(omega.ravel())
        if not resolved:
            return self.poles.at(omega)
        columns, flat = self.loads[:, : len(self.reference)], omega.ravel()[:, None, None]
        left = np.linalg.solve(self._equations(omega.ravel()).transpose(0, 2, 1), columns.astype(complex))
        slope = -left.transpose(0, 2, 1) @ ((1j * self.damping - 2.0 * flat * self.mass) @ motions)
        return self.value(omega), slope.reshape(*omega.shape, *self.static.shape)

    def outputs(self, outputs, omega, inputs) -> np.ndarray:
        """Compute the outputs ``L Z^-1 [W, loads] inputs`` (n_outputs, L); see `respond`."""
        motions, resolved = self._motions(np.asarray(omega, float))
        if not resolved:
            return self.poles.outputs(outputs, omega, inputs)
        return (outputs * self.scale) @ np.einsum("lni,il->nl", motions, inputs)

    def _equations(self, omega: np.ndarray) -> np.ndarray:
        """``Z`` (L, n, n) scaled, at omega (L,) [rad/s]."""
        omega = omega[:, None, None]
        return self.stiffness - omega**2 * self.mass + 1j * omega * self.damping

    def _motions(self, omega: np.ndarray) -> tuple[np.ndarray, bool]:
        """``Z^-1 [W, loads]`` (L, n, n_columns + n_loads) scaled, and whether its digits are good."""
        key = omega.tobytes()
        if key not in self._latest:
            equations = self._equations(omega)
            try:
                motions = np.linalg.solve(equations, self.loads.astype(complex))
            except np.linalg.LinAlgError:
                motions = np.full((len(omega), *self.loads.shape), np.nan)
            # at least the condition of the equations, in the largest absolute sum of a row
            growth = np.abs(motions).max(axis=1) / np.abs(self.loads).max(axis=0).clip(min=1e-300)
            size = np.abs(equations).sum(axis=2).max(axis=1)
            self._latest.clear()
            self._latest[key] = motions, bool(np.all(growth * size[:, None] <= _ILL))
        return self._latest[key]


def reduce_directly(problem: NonlinearSystem) -> DirectReduction | None:
    """Reduce a problem for few frequencies without modes; None where modes are cheaper or needed.

    They are cheaper where damping leaves the real ones uncoupled (T. K. Caughey and M. E. J. O'Kelly, J.
    Appl. Mech. 32 (1965) 583: ``C M^-1 K`` is symmetric), and needed where a motion is rigid, or refused. The
    springs are the elements' own reference. CaseError: matrices that do not fit.
    """
    system, reference = problem.system, np.abs(problem.reference)
    if system.flexibility is not None:
        return None
    stiffness = total_stiffness(system, reference)
    diagonal = np.diag(stiffness)
    if not np.all(diagonal > 0.0):
        return None
    scale = 1.0 / np.sqrt(diagonal)
    mass, damping, stiffness = (scale[:, None] * a * scale for a in (system.M, problem.damping, stiffness))
    try:
        factor, inertia = linalg.cho_factor(stiffness), linalg.cho_factor(mass)
    except linalg.LinAlgError:
        return None
    coupling = damping @ linalg.cho_solve(inertia, stiffness)
    uncoupled = np.abs(coupling - coupling.T).max() <= _COUPLED * np.abs(coupling).max()
    if uncoupled or np.abs(np.diag(factor[0])).min() ** 2 < _HELD:
        return None
    steady = [np.real(force.force) for force in problem.forces if not any(force.orders)]
    loads = [system.load + sum(steady)]
    for force in problem.forces:
        loads += [np.real(force.force), np.imag(force.force)]
    loads = scale[:, None] * np.column_stack([system.W, *loads])
    static = loads[:, : len(reference)].T @ linalg.cho_solve(factor, loads)
    return DirectReduction(problem, reference, scale, mass, damping, stiffness, loads, static)


def reduce_problem(problem: NonlinearSystem, *, reference=None) -> Reduction:
    """Reduce the linear part of a problem to all its modes, with the elements replaced by springs.

    Damping that the real modes make diagonal keeps them; any other damping and gyroscopic terms give complex
    modes of the state form of the real modes (Ewins, Modal Testing, 2nd ed., sections 2.7 and 2.8).

    CaseError: matrices that do not fit, a constant load that no support takes up. ConvergenceError: a rigid
    motion that strains a column, negative stiffness, a defective state matrix.

    Parameters
    ----------
    problem : NonlinearSystem
        Symmetric M and K. Rigid motions that strain no column and on which the constant load does no work
        are allowed.
    reference : (n_columns,) array, optional
        Spring of every column [N/m], any that are not negative; the size of the elements' own reference
        when not given. It moves nothing but the convergence of iterations.
    """
    reference = np.abs(problem.reference) if reference is None else np.asarray(reference, float)
    modes = _modes_with_loads(problem, reference)
    columns, rows = len(reference), modes.mesh_deflection
    common = {"reference": reference, "static": _static(modes, problem.system.W.T), "modes": modes}
    modal = modes.shape.T @ problem.damping @ modes.shape
    off = np.abs(modal - np.diag(np.diag(modal))).max(initial=0.0)
    if off > _COUPLED * np.abs(modal).max(initial=0.0):
        return _complex_modes(modal, modes, common)
    return Reduction(
        **common,
        constant=(2.0 * np.pi * modes.frequency) ** 2,
        linear=np.diag(modal).copy(),
        square=1.0,
        inputs=np.ascontiguousarray(rows.T),
        pairs=_pairs(rows[:columns], rows.T),
        shape=modes.shape,
    )


def _modes_with_loads(problem: NonlinearSystem, reference: np.ndarray) -> Modes:
    """Modes of the undamped system, with the loads as further columns of ``W``."""
    steady = [np.real(force.force) for force in problem.forces if not any(force.orders)]
    bare = replace(
        problem.system,
        C=np.zeros_like(problem.system.C),
        gyroscopic=None,
        load=problem.system.load + sum(steady),
    )
    try:
        modes = undamped_modes(bare, reference, damping_ratio=0.0)
    except ConvergenceError as error:
        if error.code != "E-STIFFNESS" or problem.system.gyroscopic is None:
            raise
        raise ConvergenceError(
            error.message + ", in a system that turns",
            code=error.code,
            remedy="where K holds centripetal terms (-speed^2) the speed is above a critical one: lower the "
            "speed or leave those terms out; else check the signs of supports, couplings and mesh directions",
        ) from error
    loads = [bare.load]
    for force in problem.forces:
        loads += [np.real(force.force), np.imag(force.force)]
    rows = np.column_stack([bare.W, *loads]).T @ modes.shape
    # columns and constant load leave rigid motions alone, undamped_modes has made sure
    rows[: len(reference) + 1, modes.frequency == 0.0] = 0.0
    stiffness = np.concatenate([reference, np.zeros(len(loads))])
    return replace(modes, mesh_stiffness=stiffness, mesh_deflection=rows)


def respond(reduction: Reduction | DirectReduction, outputs, omega, inputs) -> np.ndarray:
    """Compute the outputs ``L Z^-1 [W, loads] inputs`` (n_outputs, L) [m per unit of L] at every line.

    ``outputs`` (n_outputs, n) are ``L``, ``omega`` (L,) [rad/s]; ``inputs`` (n_columns + n_loads, L) are
    complex forces on the columns [N] and amplitudes of the loads.
    """
    return reduction.outputs(outputs, omega, inputs)


def _static(modes: Modes, outputs) -> np.ndarray:
    """Static flexibility of the modes from columns and loads to the outputs; rigid motions stay out."""
    square = np.where(modes.frequency > 0.0, 2.0 * np.pi * modes.frequency, np.inf) ** 2
    return ((outputs @ modes.shape) / square) @ modes.mesh_deflection.T


def _pairs(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Products ``left_ok right_ki`` of every mode k, (m, n_left n_right)."""
    return (left.T[:, :, None] * right[:, None, :]).reshape(len(right), -1)


def _complex_modes(modal, modes: Modes, common) -> Reduction:
    """Poles and residues of the state ``(eta, eta', v)``: elastic modes and velocities of rigid ones."""
    natural = 2.0 * np.pi * modes.frequency
    elastic, rigid = np.flatnonzero(natural > 0.0), np.flatnonzero(natural == 0.0)
    m, order = len(elastic), np.concatenate([elastic, rigid])
    scale = np.exp(np.mean(np.log(natural[elastic])))
    state = state_matrix(np.diag(natural[elastic] ** 2), modal[np.ix_(order, order)], scale)
    rows = modes.mesh_deflection
    drive = np.zeros((len(state), len(rows)))
    drive[m:] = rows[:, order].T / scale
    poles, vectors = np.linalg.eig(state)
    inputs = np.linalg.solve(vectors, drive.astype(complex))
    columns = len(common["reference"])
    reduction = Reduction(
        **common,
        constant=-poles,
        linear=np.ones(len(poles)),
        square=0.0,
        inputs=inputs,
        pairs=_pairs(rows[:columns, elastic] @ vectors[:m], inputs),
        shape=modes.shape[:, elastic] @ vectors[:m],
        drift=modes.shape[:, rigid] @ vectors[2 * m :] * scale,
    )
    _check_poles(reduction, modal, natural, scale)
    return reduction


def _check_poles(reduction: Reduction, modal, natural, omega: float) -> None:
    """Compare the sum over complex modes with the equations solved directly at one frequency."""
    rows = reduction.modes.mesh_deflection
    stiffness = np.diag(natural**2 - omega**2) + 1j * omega * modal
    direct = rows[: len(reduction.reference)] @ np.linalg.solve(stiffness, rows.T.astype(complex))
    error = np.abs(reduction.at(omega)[0] - direct).max()
    if not error <= _POLES * np.abs(direct).max(initial=np.finfo(float).tiny):
        raise ConvergenceError(
            f"the complex modes give a receptance that is wrong by {error:.2e} of {np.abs(direct).max():.2e}",
            code="E-SOLVE",
            remedy="modes are critically damped together: change the damping a little",
        )


def _times(gain: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """``gain @ pairs``; two real products where the pairs are real."""
    if np.iscomplexobj(pairs):
        return gain @ pairs
    return np.real(gain) @ pairs + 1j * (np.imag(gain) @ pairs)


def source_columns(problem: NonlinearSystem, orders: np.ndarray) -> np.ndarray:
    """Make the amplitudes (1 + 2 n_forces, L) of a reduction's load columns on lines (L, n_bases).

    Factors without unit; the first column holds the constant load with the forces of order zero. A harmonic
    force on a line that is not there is refused (E-HARMONICS).
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
                code="E-HARMONICS",
                remedy="add that line",
            )
        line, sign = (same[0], 1.0) if len(same) else (mirror[0], -1.0)
        out[1 + 2 * number : 3 + 2 * number, line] = 1.0, 1j * sign
    return out


def _checked(frequency, inputs, outputs, n: int):
    """Angular frequencies, and inputs and outputs as matrices that fit."""
    inputs, outputs = np.asarray(inputs), np.atleast_2d(np.asarray(outputs))
    inputs = inputs[:, None] if inputs.ndim == 1 else inputs
    if inputs.ndim != 2 or len(inputs) != n or outputs.ndim != 2 or outputs.shape[1] != n:
        raise CaseError(
            f"inputs of shape {inputs.shape} and outputs of shape {outputs.shape}",
            code="E-SHAPE",
            limit=f"({n}, inputs) and (outputs, {n})",
        )
    return _angular(frequency), inputs, outputs


def _angular(frequency) -> np.ndarray:
    """Angular frequencies (F,) [rad/s] of frequencies [Hz] that must be finite and not negative."""
    frequency = np.atleast_1d(np.asarray(frequency, float))
    finite = np.all(np.isfinite(frequency)) and np.all(frequency >= 0.0)
    if frequency.ndim != 1 or not len(frequency) or not finite:
        raise CaseError(
            f"frequencies of shape {frequency.shape} must be finite and not negative",
            code="E-RANGE",
            key="frequency",
            limit="a list of one or more numbers >= 0 Hz",
            remedy="list the frequencies of the response",
        )
    return 2.0 * np.pi * frequency


def _gain(modes: Modes, kept: np.ndarray | slice, omega: np.ndarray) -> np.ndarray:
    """``1 / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)`` (F, m) [s^2] of the modes kept."""
    natural, w = 2.0 * np.pi * modes.frequency[kept], omega[:, None]
    below = natural**2 - w**2 + 2j * modes.damping_ratio[kept] * natural * w
    bad = np.abs(below) <= _RESONANT * np.maximum(natural**2, w**2)
    if np.any(bad):
        mode = int(np.arange(len(modes.frequency))[kept][np.argwhere(bad)[0, 1]])
        raise _resonance(f"of mode {mode + 1} at {modes.frequency[mode]:.6g} Hz")
    return 1.0 / below


def _resonance(where: str, remedy: str = "give the motion some damping or move the frequency") -> ConvergenceError:
    return ConvergenceError(f"undamped resonance {where}: infinite response", code="E-RESONANCE", remedy=remedy)
