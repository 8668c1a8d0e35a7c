"""Parametric stability of linear systems with a periodic stiffness: at many speeds, charts, boundaries.

``M q'' + C q' + K q + W k(t) W^T q = 0`` is stable where no Floquet multiplier lies outside the unit circle.
Gear meshes are judged beside a periodic response at all its speeds (`stability`); a chart over frequency and
depth of the stiffness shows the resonances (`stability_chart`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.periodic.solution import CIRCLE, loss_of
from femgear.solvers.stability.floquet import Frame, frame_of, frame_of_modes, passage, stiffness_in_series
from femgear.system.force_laws import tangent_jumps
from femgear.system.fourier import FourierSeries, StepSeries, sample, series_of
from femgear.system.system import MeshExcitation, Modes, NonlinearSystem, mesh_harmonics

# Angle [rad] that the fastest mode turns in one step, and steps in a period of the highest harmonic.
_STEP_ANGLE, _STEPS_PER_HARMONIC = 1.0, 8
# Modes that exchange less than this share of their stiffness move independently.
_UNCOUPLED = 1e-9
# Combinations of meshes that move a group of modes less than this, relative to the largest, do not.
_RANK = 1e-10
# Damping ratio up to which modes are followed as turning ones, and the error of the others.
_TURNING, _CREEPING = 0.999, 1e-9
# Speeds, and cells of a chart, treated together.
_SPEEDS_TOGETHER, _CELLS_TOGETHER = 128, 64


@dataclass(frozen=True)
class Stability:
    """Floquet verdict beside a periodic response; it does not depend on the load, only on k(t).

    Parameters
    ----------
    mesh_frequency : (n_speeds,) array
        [Hz].
    multiplier : (n_speeds,) complex array
        Multiplier of largest modulus over one period of the excitation record, rigid modes left out.
    modes_kept : (n_speeds,) int array
        Modes that were followed in time; the others counted as static flexibility.
    steps : (n_speeds,) int array
        Time steps a period.
    """

    mesh_frequency: np.ndarray
    multiplier: np.ndarray
    modes_kept: np.ndarray
    steps: np.ndarray

    @property
    def modulus(self) -> np.ndarray:
        """Largest modulus of the multipliers (n_speeds,)."""
        return np.abs(self.multiplier)

    @property
    def stable(self) -> np.ndarray:
        """(n_speeds,) bool: no perturbation grows (largest modulus at most 1 within 1e-6)."""
        return self.modulus <= 1.0 + CIRCLE


def stability(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int = 6,
    steps: int | None = None,
    frequency_ratio: float = 2.0,
) -> Stability:
    """Judge the stability of the linear system with mesh stiffnesses k(t) at many speeds, by its multipliers.

    CaseError: frequencies that are not positive, data that cannot be used, too few steps. ConvergenceError: a
    mesh stiffness so negative that the static flexibility cannot carry it.

    Parameters
    ----------
    modes, excitation
        As given to ``solve_spectral``.
    mesh_frequency : float or (n_speeds,) array
        [Hz], positive.
    excitation_harmonics : int
        Mesh harmonics of the stiffness that are kept.
    steps : int, optional
        Time steps a period. By default 8 in a period of the highest harmonic and one for every radian of
        the fastest mode that is followed.
    frequency_ratio : float
        Modes above this many times the highest excitation frequency are counted as static flexibility:
        parametric resonances need ``h f = f_i + f_j``, their first order a ratio of one, their second order
        two. Their own multipliers ``exp(-zeta omega T)`` still count. The static flexibility costs up to
        1e-3 of a modulus below one and less of a growing one; a ratio of 5 or 20 follows nearly every mode.

    Notes
    -----
    ``q'' + 2 zeta w q' + w^2 q + R^T kappa(t) R q = 0`` with ``kappa = k~ (I + T_res k~)^-1``. Between
    the kicks that the meshes give, a matrix of rank n_meshes, the damped modes move exactly: algorithm 4A of
    Chin (Phys. Lett. A 226, 1997), fourth order with positive steps; its corrected kick
    ``kappa - dt^2/24 kappa R R^T kappa`` holds with damping too, because ``[B, [A, B]]`` does not contain the
    damping. Modes that no stiffness couples are separate eigenvalue problems.
    """
    frequency = np.atleast_1d(np.array(mesh_frequency, dtype=float))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)) or np.any(frequency <= 0.0):
        raise CaseError(
            "a period needs finite, positive mesh frequencies",
            code="E-RANGE",
            key="mesh_frequency",
            value=frequency.tolist(),
            limit="> 0 Hz",
        )
    if not frequency_ratio >= 1.0:
        raise CaseError(
            "modes up to the highest excitation frequency must be followed",
            code="E-MODES",
            key="frequency_ratio",
            value=frequency_ratio,
            limit=">= 1",
        )
    stiffness = mesh_harmonics(excitation, excitation_harmonics)[0]
    stiffness[:, 0] -= modes.mesh_stiffness
    lines = excitation_harmonics * excitation.periods
    cut = frequency * excitation_harmonics * frequency_ratio
    kept = np.searchsorted(modes.frequency, cut, side="right")
    multiplier = np.empty(len(frequency), dtype=complex)
    taken = np.empty(len(frequency), dtype=int)
    for number in np.unique(kept):
        chosen = np.flatnonzero(kept == number)
        for part in np.array_split(chosen, -(-len(chosen) // _SPEEDS_TOGETHER)):
            period = excitation.periods / frequency[part]
            fastest = 2.0 * np.pi * modes.frequency[:number].max(initial=0.0) * period.max()
            taken[part] = steps or int(np.ceil(max(fastest / _STEP_ANGLE, _STEPS_PER_HARMONIC * lines)))
            multiplier[part] = _largest_at_speeds(modes, stiffness, number, period, int(taken[part[0]]))
    moving = kept - np.searchsorted(modes.frequency, 0.0, side="right")
    return Stability(frequency, multiplier, np.maximum(moving, 0), taken)


def decisive_harmonics(modes: Modes, excitation: MeshExcitation, kept: int) -> int:
    """Find the highest mesh harmonic of the stiffness that could by itself make the response unstable.

    ``q'' + 2 zeta w q' + w^2 (1 + eps cos 2 w t) q = 0`` is stable below ``eps = 4 zeta`` (Nayfeh and Mook,
    Nonlinear Oscillations, 1979, section 5.3), and a mode whose strain is all in the mesh has
    ``eps = |k_h|/k_0``; half of that is taken. Six or more of the harmonics ``kept`` by the response, as far
    as there are so many; at most 64: the amplitudes fall as one over the harmonic.
    """
    most = min(kept, 64)
    stiffness = np.abs(mesh_harmonics(excitation, most)[0])
    damped = modes.damping_ratio[modes.frequency > 0.0].min(initial=1.0)
    large = np.flatnonzero((stiffness[:, 1:] > 2.0 * damped * stiffness[:, :1]).any(axis=0))
    # lines of a record of several periods
    highest = 0 if not len(large) else -(-(int(large[-1]) + 1) // excitation.periods)
    return min(most, max(6, highest))


@dataclass(frozen=True)
class StabilityChart:
    """Largest Floquet multipliers over frequency and depth.

    Parameters
    ----------
    frequency : (n_f,) array
        Base frequency of the stiffness [rad/s].
    depth : (n_d,) array
        Factor of the fluctuation about the mean.
    multiplier : (n_f, n_d) complex array
        Multiplier of largest modulus over one period.
    loss : (n_f, n_d) str array
        ``""`` where stable, otherwise ``"fold"``, ``"flip"`` or ``"Neimark-Sacker"`` (combination resonance).
    error : (n_f, n_d) array
        Estimated relative error of the monodromy matrices.
    """

    frequency: np.ndarray
    depth: np.ndarray
    multiplier: np.ndarray
    loss: np.ndarray
    error: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """(n_f, n_d) bool: no perturbation grows (modulus at most 1 within 1e-6)."""
        return np.abs(self.multiplier) <= 1.0 + CIRCLE


def stability_chart(
    system: Modes | NonlinearSystem,
    stiffness: FourierSeries | StepSeries | MeshExcitation,
    frequency,
    depth,
    *,
    harmonics: int = 6,
    tolerance: float = 1e-8,
) -> StabilityChart:
    """Judge the stability of ``M q'' + C q' + K q + W (mean + depth (k(t) - mean)) W^T q = 0`` on a grid.

    Parameters
    ----------
    system : Modes or NonlinearSystem
        Of the latter the linear part; the stiffness stands for its elements.
    stiffness : FourierSeries, StepSeries or MeshExcitation
        ``k`` of every column [N/m]. Of an excitation the stiffness, cut to ``harmonics`` mesh harmonics; its
        base frequency is the mesh frequency over ``periods``.
    frequency : (n_f,) array
        Base frequencies [rad/s], positive.
    depth : (n_d,) array
        Factors of the fluctuation, 1 for the stiffness as given.
    tolerance : float
        Relative error of the monodromy matrices.

    Raises
    ------
    CaseError
        Frequencies that are not positive, a stiffness that does not fit the columns.
    ConvergenceError
        Modes left out of a modal basis are too flexible.
    """
    tolerance = checked_tolerance(tolerance)
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    depth = np.atleast_1d(checked_numbers(depth, "depth", code="E-RANGE", unit=""))
    frame, series, breaks = _prepared(system, stiffness, harmonics)
    f, d = (grid.ravel() for grid in np.meshgrid(frequency, depth, indexing="ij"))
    multiplier, error = _largest_of_cells(frame, series, breaks, f, d, tolerance)
    shape = (len(frequency), len(depth))
    loss = [loss_of(value) if abs(value) > 1.0 + CIRCLE else "" for value in multiplier]
    return StabilityChart(
        frequency, depth, multiplier.reshape(shape), np.array(loss).reshape(shape), error.reshape(shape)
    )


def _prepared(system, stiffness, harmonics: int) -> tuple[Frame, FourierSeries | StepSeries, np.ndarray]:
    """Modes, the stiffness as a series, and the fractions of the period at which it jumps."""
    frame = frame_of_modes(system) if isinstance(system, Modes) else frame_of(system)
    if isinstance(stiffness, MeshExcitation):
        stiffness = series_of(stiffness.stiffness, harmonics * stiffness.periods)
    if len(stiffness.mean) != len(frame.rows):
        raise CaseError(
            f"stiffness of {len(stiffness.mean)} meshes for {len(frame.rows)} columns",
            code="E-SHAPE",
            limit="one series a column",
        )
    breaks = np.zeros(0)
    if isinstance(stiffness, StepSeries):
        fluctuation, eye = _fluctuation(stiffness), np.eye(len(frame.rows))
        breaks = tangent_jumps(lambda f, states: fluctuation(f)[..., None] * eye, np.arange(1))[0]
    return frame, stiffness, breaks


def _largest_of_cells(
    frame: Frame, series, breaks, frequency, depth, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Multiplier of largest modulus and error (p,) of pairs of frequency and depth."""
    if not np.all(np.isfinite(depth)) or not np.all(np.isfinite(frequency)) or np.any(frequency <= 0.0):
        raise CaseError("a chart needs positive frequencies and finite depths", code="E-RANGE", limit="> 0 rad/s")
    eye, mean, fluctuation = np.eye(len(frame.rows)), series.mean, _fluctuation(series)
    multiplier, error = np.empty(len(frequency), complex), np.zeros(len(frequency))
    # cells of similar period take similar steps
    order = np.argsort(frequency, kind="stable")
    for part in np.array_split(order, -(-len(order) // _CELLS_TOGETHER)):

        def tangents(f, states, part=part):
            k = mean + depth[part[states], None, None] * fluctuation(f)
            return k[..., None] * eye

        period = 2.0 * np.pi / frequency[part]
        if isinstance(series, StepSeries):
            ends = np.concatenate([[0.0], breaks, [1.0]])
            middle = np.broadcast_to(0.5 * (ends[1:] + ends[:-1]), (len(period), len(ends) - 1))
            pieces = tangents(middle, np.arange(len(period)))
            matrix = frame.exact_monodromy(pieces, period[:, None] * np.diff(ends))
        else:
            matrix, error[part] = passage(frame, period, tangents, [breaks] * len(part), tolerance=tolerance)
        values = np.linalg.eigvals(matrix)
        multiplier[part] = values[np.arange(len(part)), np.abs(values).argmax(axis=1)]
    if np.any(error > 1e3 * tolerance):
        raise ConvergenceError(
            f"the monodromy matrix has an error of {error.max():.1e}, aimed at {tolerance:.1e}",
            code="E-CONVERGENCE",
            remedy="take a looser tolerance or fewer harmonics",
        )
    return multiplier, error


def _fluctuation(series):
    """Function: fluctuation (..., n_c) of the stiffness about its mean at fractions (...) of the period."""
    return lambda fraction: series.at(2.0 * np.pi * np.asarray(fraction)[..., None]) - series.mean


def _largest_at_speeds(modes: Modes, stiffness, number: int, period: np.ndarray, steps: int) -> np.ndarray:
    """Multiplier of largest modulus (n_speeds,) with the first `number` modes followed in time."""
    natural = 2.0 * np.pi * modes.frequency
    static = natural > 0.0
    static[:number] = False
    rows = modes.mesh_deflection
    flexibility = modes.residual + (rows[:, static] / natural[static] ** 2) @ rows[:, static].T
    kicks = _kicks(stiffness, flexibility, steps)
    moving = np.flatnonzero(natural[:number] > 0.0)
    best = np.zeros(len(period), dtype=complex)
    for group in _coupled(rows[:, moving] / natural[moving], kicks):
        index = moving[group]
        ratio = modes.damping_ratio[index]
        if ratio.max() < _TURNING:
            largest = _multipliers(natural[index], ratio, rows[:, index], kicks, period)
        else:
            damping = np.diag(2.0 * ratio * natural[index])
            frame = Frame(natural[index] ** 2, damping, rows[:, index], np.zeros(len(rows)), flexibility)
            cells = 2.0 * np.pi / period, np.ones(len(period))
            largest, _ = _largest_of_cells(frame, FourierSeries(stiffness), np.zeros(0), *cells, _CREEPING)
        best = np.where(np.abs(largest) > np.abs(best), largest, best)
    if np.any(static):
        slowest = np.exp(-np.min(modes.damping_ratio[static] * natural[static]) * period)
        best = np.where(slowest > np.abs(best), slowest, best)
    return best


def _kicks(stiffness: np.ndarray, flexibility: np.ndarray, steps: int) -> np.ndarray:
    """``kappa = k~ (I + T_res k~)^-1`` (2 steps, n, n) at the ends and middles of the steps [N/m]."""
    change = sample(stiffness, 2 * steps).T
    return stiffness_in_series(change[:, :, None] * np.eye(len(stiffness)), flexibility)


def _coupled(rows: np.ndarray, kicks: np.ndarray) -> list[np.ndarray]:
    """Groups of modes that the kicks couple, from the rows (n_meshes, m) divided by the frequencies."""
    if not rows.shape[1]:
        return []
    strength = np.abs(rows.T @ kicks @ rows).max(axis=0)
    number, label = connected_components(strength > _UNCOUPLED, directed=False)
    return [np.flatnonzero(label == g) for g in range(number)]


def _multipliers(natural, damping_ratio, rows, kicks, period) -> np.ndarray:
    """Largest multiplier (n_speeds,) of one group of modes, followed through one period.

    Of every mode ``z = (q' + zeta w q) / w_d + i q``, which turns freely by ``exp((-zeta w + i w_d) t)``.
    Modes that deflect no mesh, as gears that move across the line of action, do so over the whole period.
    """
    speeds, m, steps = len(period), len(natural), len(kicks) // 2
    dt, damped = period / steps, natural * np.sqrt(1.0 - damping_ratio**2)
    free = -damping_ratio * natural + 1j * damped
    if not rows.any():
        return np.exp(free[(damping_ratio * natural).argmin()] * period)
    # the forces of fewer combinations of meshes than there are: equal meshes in phase move the group as one
    left, size, _ = np.linalg.svd(rows, full_matrices=False)
    joint = left[:, size > _RANK * size.max()]
    rows, kicks = joint.T @ rows, joint.T @ kicks @ joint
    back = -(rows / damped).T
    first, middle = kicks[::2], kicks[1::2]
    corrected = np.concatenate([middle / 1.5, middle @ (rows @ rows.T) @ middle / -36.0], axis=-1)
    turn = np.exp(free[:, None, None] * (0.5 * dt))
    # one column for each unknown, speeds last
    state: Any = np.zeros((m, 2 * m, speeds), complex)
    state[range(m), range(m)], state[range(m), range(m, 2 * m)] = 1.0, 1.0j
    motion, forces = np.empty((m, 2 * m * speeds)), np.empty((2, len(rows), 2 * m, speeds))
    for pair in zip(back @ first / 3.0, back @ corrected):
        for kick in pair:
            motion.reshape(state.shape)[...] = state.imag
            np.matmul(rows, motion, out=forces[0].reshape(len(rows), -1))
            forces[0] *= dt
            np.multiply(forces[0], dt * dt, out=forces[1])
            np.matmul(kick, forces.reshape(2 * len(rows), -1)[: kick.shape[1]], out=motion)
            state.real += motion.reshape(state.shape)
            state *= turn
    values = np.linalg.eigvals(np.concatenate([state.real, state.imag]).transpose(2, 0, 1))
    return values[np.arange(speeds), np.abs(values).argmax(axis=1)]
