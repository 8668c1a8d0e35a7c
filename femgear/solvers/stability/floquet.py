"""Stability of periodic motions: Floquet multipliers from the monodromy matrix.

Periodic solutions of nonlinear problems are judged one by one or many of one problem (`floquet_verdicts`).
Small motions about a periodic state are followed through one period in modes with the tangents of the
elements (`frame_of`, `passage`),

``M z'' + (C + speed G) z' + K z + W k(t) W^T z = 0`` in the modes of ``K + W diag(reference) W^T``, for many
states at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import linalg
from scipy.linalg import expm

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.linear.modal import state_matrix
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution, open_verdict, verdict_of
from femgear.system.force_laws import tangent_jumps
from femgear.system.system import Modes, NonlinearSystem, element_forces

# Angle [rad] that the fastest mode turns in a step of the first sequence, and sequences of halved steps.
_STEP_ANGLE = 0.7
_LEVELS = 7
# Steps in a period beyond which they are not halved again.
_MOST_HALVED = 320_000
# Eigenvalues this small relative to the largest one, and rows relative to theirs, are zero.
_RIGID = 1e-11
_UNMOVED = 1e-9
# Damping of a free motion, relative to the largest entry, that is rounding.
_UNDAMPED = 1e-10
# Distances of the Gauss points from the middle of a step of unit length.
_GAUSS = 0.5 / np.sqrt(3.0)
# States treated together, rows of their motions, and instants of a piece at which tangents are compared.
_STATES_TOGETHER = 32
_ROWS_TOGETHER = 256
_INSIDE = 7
# Steps of the first sequence over one period beyond which a verdict is not sought, and the most entries of
# stiffness matrices at these steps that are held at once.
_MOST_STEPS = 20_000
_MOST_ENTRIES = 4_000_000


def monodromy(matrices, durations) -> np.ndarray:
    """Compute the transition matrix over one period of ``x' = A x``, A constant in pieces, by exponentials.

    Parameters
    ----------
    matrices : (..., n_pieces, n, n) array
        ``A`` in order of time [1/s].
    durations : (..., n_pieces) array
        [s], positive.

    Returns
    -------
    (..., n, n) array
        ``expm(A_last dt_last) ... expm(A_0 dt_0)``; its eigenvalues are the Floquet multipliers.
    """
    matrices, durations = np.asarray(matrices, dtype=float), np.asarray(durations, dtype=float)
    if matrices.ndim < 3 or durations.shape != matrices.shape[:-2] or np.any(durations <= 0.0):
        raise CaseError("every matrix needs one positive duration", code="E-SHAPE", key="durations")
    out = np.eye(matrices.shape[-1])
    for step in np.moveaxis(expm(matrices * durations[..., None, None]), -3, 0):
        out = step @ out
    return out


def stiffness_in_series(change: np.ndarray, flexibility: np.ndarray) -> np.ndarray:
    """Put a flexibility T (n_c, n_c) [m/N] in series with stiffnesses k (..., n_c, n_c) [N/m].

    ``k (1 + T k)^-1`` (..., n_c, n_c) [N/m].

    ConvergenceError: elements so much softer than their reference that the flexibility cannot carry them
    (E-RESIDUAL).
    """
    carried = np.eye(len(flexibility)) + flexibility @ change
    if np.linalg.eigvals(carried).real.min() <= 0.0:
        raise ConvergenceError(
            "the modes left out are more flexible than the meshes or elements at their lowest stiffness",
            code="E-RESIDUAL",
            remedy="keep more modes",
        )
    return change @ np.linalg.inv(carried)


@dataclass(frozen=True)
class Frame:
    """Modal coordinates of small motions.

    Parameters
    ----------
    square : (n,) array
        Squares of the natural angular frequencies [1/s^2]; negative ones are possible.
    damping : (n, n) array
        Modal damping matrix [1/s].
    rows : (n_c, n) array
        Deflections of the columns, ``W^T Phi`` [1/sqrt(kg)].
    reference : (n_c,) array
        Stiffness of the columns that the modes contain [N/m].
    residual : (n_c, n_c) array
        Static flexibility of the modes left out [m/N].
    positions : int
        Modes kept whose position nothing feels, their velocity a damping that couples them to others; each
        has one multiplier one.
    drift : (r,) array
        Decay of the velocities of free motions left out that a damping of their own slows down, or drives
        where it is negative [1/s].
    """

    square: np.ndarray
    damping: np.ndarray
    rows: np.ndarray
    reference: np.ndarray
    residual: np.ndarray
    positions: int = 0
    drift: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def diagonal(self) -> bool:
        """Whether the damping leaves the modes uncoupled."""
        off = self.damping - np.diag(np.diag(self.damping))
        return not np.any(np.abs(off) > 1e-12 * max(np.abs(self.damping).max(initial=0.0), 1e-300))

    def steps(self, period):
        """Count the steps of the first sequence over periods (...) [s], as floats: they may be unbounded."""
        return np.ceil(np.maximum(8.0, self.fastest * np.asarray(period, float) / _STEP_ANGLE))

    @property
    def fastest(self) -> float:
        """Largest natural angular frequency [rad/s]."""
        return float(np.sqrt(np.abs(self.square).max(initial=0.0)))

    def kappa(self, tangent: np.ndarray) -> np.ndarray:
        """Compute the change (..., n_c, n_c) [N/m] of stiffness of tangents (..., n_c, n_c) [N/m].

        The modes left out are in series.
        """
        change = tangent - np.diag(self.reference)
        return stiffness_in_series(change, self.residual) if np.any(self.residual) else change

    def state_matrices(self, kappa: np.ndarray) -> np.ndarray:
        """Make ``A`` (..., 2 n, 2 n) of ``(eta, eta')' = A (eta, eta')`` with kappa (..., n_c, n_c) [N/m]."""
        return state_matrix(np.diag(self.square) + self.rows.T @ kappa @ self.rows, self.damping, 1.0)

    def exact_monodromy(self, tangents: np.ndarray, durations) -> np.ndarray:
        """Compute monodromy matrices (..., 2 n, 2 n) of tangents (..., pieces, n_c, n_c) [N/m].

        They are constant over the durations (..., pieces) [s].
        """
        n = len(self.square)
        both = np.concatenate([np.ones(n), np.full(n, self.fastest or 1.0)])
        return monodromy(self.state_matrices(self.kappa(tangents)) * both / both[:, None], durations)

    def verdict(self, multipliers, period: float, method: str, error: float, tolerance: float) -> FloquetVerdict:
        """Judge multipliers (m,) of a period [s] as `verdict_of`, which has to know of free motions."""
        free = {"positions": self.positions, "velocities": self.positions, "drift": self.drift}
        return verdict_of(multipliers, period, method, error, tolerance, **free)


def frame_of(problem: NonlinearSystem, *, modes: int = 100) -> Frame:
    """Compute the modal coordinates of small motions about the reference stiffness of a problem.

    Free motions that no column and no coupling of the damping feels are left out: the multipliers of their
    positions are one, those of their velocities follow from `Frame.drift`. Modes left out leave their static
    flexibility. At most so many ``modes`` are kept, lowest first; all where there are no more.
    """
    system, reference = problem.system, np.maximum(problem.reference, 0.0)
    stiffness = system.K + (system.W * reference) @ system.W.T
    count = min(int(modes), len(stiffness))
    if count < 1:
        raise CaseError("no mode is kept", code="E-MODES", key="modes", value=modes, limit=">= 1")
    all_modes = count == len(stiffness)
    square, shape = linalg.eigh(
        0.5 * (stiffness + stiffness.T), system.M, subset_by_index=None if all_modes else (0, count - 1)
    )
    rows, damping = system.W.T @ shape, shape.T @ problem.damping @ shape
    square = np.where(np.abs(square) <= _RIGID * np.abs(square).max(), 0.0, square)
    felt = np.abs(rows).max(axis=0, initial=0.0) > _UNMOVED * np.abs(rows).max(initial=0.0)
    shared = np.abs(damping - np.diag(np.diag(damping))).max(axis=0)
    # the rounding of a free motion is no damping
    coupled = shared > np.where((square != 0.0) | felt, 1e-12, _UNDAMPED) * np.abs(damping).max()
    moving = (square != 0.0) | felt | coupled
    positions = int(np.count_nonzero(coupled & (square == 0.0) & ~felt))
    rates = np.diag(damping)
    drift = rates[~moving & (np.abs(rates) > _UNDAMPED * np.abs(damping).max())]
    square, rows, damping = square[moving], rows[:, moving], damping[np.ix_(moving, moving)]
    residual = np.zeros((len(rows), len(rows)))
    if not all_modes:
        residual = _residual(problem, stiffness, shape[:, ~moving], rows, square)
    return Frame(square, damping, rows, reference, residual, positions, drift)


def frame_of_modes(modes: Modes) -> Frame:
    """Make the modal coordinates of small motions from the moving modes of a basis with their damping."""
    moving = modes.frequency > 0.0
    omega = 2.0 * np.pi * modes.frequency[moving]
    damping = np.diag(2.0 * modes.damping_ratio[moving] * omega)
    residual = modes.residual
    size = np.abs((modes.mesh_deflection[:, moving] / omega**2) @ modes.mesh_deflection[:, moving].T).max()
    if np.abs(residual).max(initial=0.0) <= 1e-12 * size:
        residual = np.zeros_like(residual)  # rounding of a complete basis
    return Frame(omega**2, damping, modes.mesh_deflection[:, moving], modes.mesh_stiffness, residual)


def passage(
    frame: Frame, period, tangents: Callable, breaks: list[np.ndarray], *, tolerance: float = 1e-7
) -> tuple[np.ndarray, np.ndarray]:
    """Integrate small motions over one period, by a splitting of fourth order with Richardson extrapolation.

    Algorithm 4B of Chin (Phys. Lett. A 226, 1997; for forces that depend on time Chin and Chen, J. Chem.
    Phys. 117, 2002): damped modes move exactly between kicks of the elements at the Gauss points of every
    step, ``kappa - (2 - sqrt 3) / 12 dt^2 kappa R R^T kappa``. It is symmetric, so the errors have even
    powers and halved steps extrapolate to orders 6, 8, ... Steps end where the tangents jump.

    Parameters
    ----------
    period : (p,) array
        [s]
    tangents : callable
        ``(fraction (m, s), states (m,)) -> (m, s, n_c, n_c)`` tangents [N/m] at fractions of the period.
    breaks : list of p arrays
        Ascending fractions inside the period where tangents jump.
    tolerance : float
        Relative error of the matrix at which halving ends, after at most 7 sequences, fewer where a
        period takes thousands of steps.

    Returns
    -------
    (p, 2 n, 2 n), (p,) arrays
        Monodromy matrices in coordinates ``(eta, eta' / s)`` with a scale s of every mode, and their
        estimated errors relative to their norms.
    """
    period = np.asarray(period, float)
    size, n = len(period), len(frame.square)
    matrix, errors = np.empty((size, 2 * n, 2 * n)), np.full(size, np.inf)
    open_states, table = np.arange(size), None
    base = int(frame.steps(period.max(initial=0.0)))
    for level in range(_LEVELS):
        start, duration = _steps([breaks[i] for i in open_states], base, level)
        matrices = _through(frame, period[open_states], start, duration, tangents, open_states)
        table, error = _extrapolated(table, matrices)
        matrix[open_states], errors[open_states] = table[-1], error
        rest = error > tolerance
        open_states, table = open_states[rest], [entry[rest] for entry in table]
        if not len(open_states) or (level and base << (level + 1) > _MOST_HALVED):
            break
    return matrix, errors


def _residual(problem, stiffness, rigid, rows, square) -> np.ndarray:
    """``W^T K^+ W`` without the part of the modes kept; rigid motions that no column feels are held."""
    system = problem.system
    carried = system.M @ rigid
    weight = np.trace(stiffness) / np.trace(system.M)
    flexible = linalg.solve(stiffness + weight * (carried @ carried.T), system.W, assume_a="sym")
    if np.any(square <= 0.0):
        raise ConvergenceError(
            "a motion without stiffness moves an element: static flexibilities do not exist",
            code="E-RESIDUAL",
            remedy="keep all modes",
        )
    out = system.W.T @ flexible - (rows / square) @ rows.T
    return 0.5 * (out + out.T)


def _extrapolated(table, matrices):
    """Next row of Romberg's table for errors of orders 4, 6, 8, ..., and the error of its last entry."""
    row = [matrices]
    for column, before in enumerate(table or []):
        row.append(row[-1] + (row[-1] - before) / (2.0 ** (4 + 2 * column) - 1.0))
    if len(row) == 1:
        return row, np.full(len(matrices), np.inf)
    size = np.maximum(np.linalg.norm(row[-1], axis=(1, 2)), 1.0)
    return row, np.linalg.norm(row[-1] - row[-2], axis=(1, 2)) / size


def _steps(breaks: list[np.ndarray], base: int, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts and durations (p, s), over the period, of ``base 2^level`` steps or more that end at breaks."""
    rows = []
    for inner in breaks:
        ends = np.concatenate([[0.0], inner, [1.0]])
        length = np.diff(ends)
        each = np.maximum(np.ceil(length * base).astype(int), 1) << level
        duration = np.repeat(length / each, each)
        number = np.concatenate([np.arange(m) for m in each])
        rows.append((np.repeat(ends[:-1], each) + duration * number, duration))
    longest = max(len(duration) for _, duration in rows)
    # rows that have fewer are filled up with steps of no duration
    out = np.zeros((2, len(rows), longest))
    out[0] = 1.0
    for i, (start, duration) in enumerate(rows):
        out[:, i, : len(start)] = start, duration
    return out[0], out[1]


def _through(frame: Frame, period, start, duration, tangents, states) -> np.ndarray:
    """Monodromy matrices (m, 2 n, 2 n) with the given steps."""
    m, n = len(period), len(frame.square)
    dt = duration * period[:, None]
    fractions = start[..., None] + duration[..., None] * (0.5 + _GAUSS * np.array([-1.0, 1.0]))
    square = (len(frame.rows), len(frame.rows))
    kappa = frame.kappa(tangents(fractions.reshape(m, -1), states)).reshape(m, -1, 2, *square)
    gyration = frame.rows @ frame.rows.T
    weight = (2.0 - np.sqrt(3.0)) / 12.0 * dt[..., None, None, None] ** 2
    kicks = 0.5 * dt[..., None, None, None] * (kappa - weight * (kappa @ gyration @ kappa))
    # modal velocities over it have the size of the motions
    natural = np.sqrt(np.abs(frame.square))
    scale = np.where(natural > 1e-6 * natural.max(), natural, natural.max() or 1.0)
    back = (frame.rows / scale).T
    drift = _modal_drift if frame.diagonal else _coupled_drift
    outer, inner = dt * (0.5 - _GAUSS), dt * (2.0 * _GAUSS)
    between = outer.copy()
    between[:, 1:] += outer[:, :-1]
    moves, kicks = np.stack([between, inner], axis=-1).reshape(m, -1), kicks.reshape(m, -1, *square)
    # few modes pass through many pieces of the period at once, all filled up to equal length
    pieces = 1 << max(min(moves.shape[1] // 2, _ROWS_TOGETHER // (m * max(n, 1))), 1).bit_length() - 1
    short = -moves.shape[1] % pieces
    moves = np.hstack([moves, np.zeros((m, short))]).reshape(m * pieces, -1)
    kicks = np.hstack([kicks, np.zeros((m, short, *square))]).reshape(m * pieces, -1, *square)
    move, state = drift(frame, scale, moves), np.tile(np.eye(2 * n), (m * pieces, 1, 1))
    for step, kick in enumerate(np.moveaxis(kicks, 1, 0)):
        state = move(step, state)
        state[:, n:] -= back @ (kick @ (frame.rows @ state[:, :n]))
    while len(state) > m:
        state = state[1::2] @ state[::2]
    return drift(frame, scale, outer[:, -1:])(0, state)


def _modal_drift(frame: Frame, scale, durations):
    """Exact motion of uncoupled damped modes over the durations (m, steps): a function (step, state)."""
    half = 0.5 * np.diag(frame.damping)
    root = np.sqrt((frame.square - half**2).astype(complex))

    def move(step: int, state: np.ndarray) -> np.ndarray:
        h = durations[:, step, None]
        sine, cosine = (np.sinc(root * h / np.pi) * h).real, np.cos(root * h).real
        decay = np.exp(-half * h)
        q, u = np.split(state, 2, axis=1)
        stay, turn = decay * (cosine + half * sine), decay * sine * scale
        fall, keep = -decay * sine * frame.square / scale, decay * (cosine - half * sine)
        return np.concatenate(
            [stay[..., None] * q + turn[..., None] * u, fall[..., None] * q + keep[..., None] * u], axis=1
        )

    return move


def _coupled_drift(frame: Frame, scale, durations):
    """As :func:`_modal_drift` for damping and gyroscopic terms that couple the modes."""
    both = np.concatenate([np.ones_like(scale), scale])
    matrix = frame.state_matrices(np.zeros((len(frame.rows),) * 2)) * both / both[:, None]
    values, where = np.unique(durations, return_inverse=True)
    steps, where = expm(matrix * values[:, None, None]), where.reshape(durations.shape)

    def move(step: int, state: np.ndarray) -> np.ndarray:
        return steps[where[:, step]] @ state

    return move


def floquet_verdicts(
    problem: NonlinearSystem,
    solutions: Sequence[PeriodicSolution],
    *,
    tolerance: float = 1e-7,
    modes: int = 100,
) -> tuple[FloquetVerdict, ...]:
    """Judge the stability of periodic solutions of one problem by their Floquet multipliers.

    By exact exponentials where the tangents are constant in pieces, otherwise by a splitting, with steps that
    end where contacts open or close.

    CaseError: a tolerance that is not between 0 and 1 (E-RANGE). ConvergenceError: modes left out that are
    too flexible.

    Parameters
    ----------
    solutions : sequence of PeriodicSolution
        All with the same lines. With two base frequencies or the frequency zero the verdict is "not
        covered"; "not determined" where the fastest mode would need more than 20000 steps in a period.
    tolerance : float
        Relative error of the monodromy matrix.
    modes : int
        Largest number of modes followed; the others count as static flexibility.

    Notes
    -----
    The position of a free motion (rotation of a free train) has the multiplier one and is left out; so is
    its velocity where no damping feels it. Where one does, its multiplier ``exp(-c period)`` counts.
    """
    tolerance = checked_tolerance(tolerance)
    frame = frame_of(problem, modes=modes)
    early = {i: _not_covered(solution) or _too_long(frame, solution) for i, solution in enumerate(solutions)}
    out = {i: verdict for i, verdict in early.items() if verdict is not None}
    covered = [i for i in early if i not in out]
    for first in range(0, len(covered), _STATES_TOGETHER):
        part = covered[first : first + _STATES_TOGETHER]
        out |= zip(part, _by_monodromy(frame, problem, [solutions[i] for i in part], tolerance))
    return tuple(out[i] for i in range(len(solutions)))


def floquet_verdict(problem: NonlinearSystem, solution: PeriodicSolution, **options) -> FloquetVerdict:
    """Judge the stability of one periodic solution by its Floquet multipliers.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    solution : PeriodicSolution
        One of its solutions.
    options
        ``tolerance`` [1] and ``modes`` of `floquet_verdicts`, which refuses and raises the same.
    """
    return floquet_verdicts(problem, [solution], **options)[0]


def judged(problem: NonlinearSystem, solutions: Sequence[PeriodicSolution], **options) -> tuple[PeriodicSolution, ...]:
    """Join solutions with their verdicts; options as for :func:`floquet_verdicts`.

    Where the modes kept do not carry the motion the verdict says "not determined".
    """
    try:
        verdicts = floquet_verdicts(problem, solutions, **options)
    except ConvergenceError as error:
        verdicts = (open_verdict(f"not determined: {error.message}"),) * len(solutions)
    return tuple(replace(solution, verdict=verdict) for solution, verdict in zip(solutions, verdicts))


def require_period(frequency) -> None:
    """Refuse the single base frequency zero, which has no period to judge stability over (E-RANGE)."""
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    if frequency.size == 1 and frequency.ravel()[0] == 0.0:
        raise CaseError(
            "stability needs a period, and the base frequency is zero",
            code="E-RANGE",
            key="frequency",
            value=0.0,
            limit="> 0 rad/s",
            remedy="give a positive frequency, or solve without stability: solve_harmonic_balance, "
            "stability=False of a curve",
        )


def tangents_of(problem: NonlinearSystem, solutions: Sequence[PeriodicSolution]):
    """Make a function ``(fraction (m, s), states (m,)) -> tangents (m, s, n_c, n_c)`` [N/m] of solutions."""
    lines = np.stack([solution.deflection for solution in solutions])
    orders = solutions[0].orders[:, 0]

    def tangents(fraction, states):
        phase = 2.0 * np.pi * fraction
        wave = np.exp(1j * phase)[..., None] ** orders
        x = (wave @ np.swapaxes(lines[states], 1, 2)).real
        return element_forces(problem, x, phase[..., None])[1]

    return tangents


def _not_covered(solution: PeriodicSolution) -> FloquetVerdict | None:
    if solution.orders.shape[1] > 1:
        reason = "not covered: a solution with several base frequencies is not periodic"
    elif not solution.converged:
        reason = "not covered: the solution did not converge"
    elif solution.frequency[0] == 0.0:
        reason = "not covered: the frequency zero has no period"
    else:
        return None
    return open_verdict(reason)


def _too_long(frame: Frame, solution: PeriodicSolution) -> FloquetVerdict | None:
    with np.errstate(over="ignore"):
        steps = float(frame.steps(2.0 * np.pi / np.abs(solution.frequency[0])))
    if steps <= _MOST_STEPS:
        return None
    return open_verdict(
        f"not determined: {steps:.3g} steps in a period at {solution.frequency[0]:.3g} rad/s, "
        f"at most {_MOST_STEPS}: raise the frequency or keep fewer modes"
    )


def _by_monodromy(frame: Frame, problem, solutions, tolerance: float) -> list[FloquetVerdict]:
    period = np.array([2.0 * np.pi / abs(solution.frequency[0]) for solution in solutions])
    tangents = tangents_of(problem, solutions)
    breaks = tangent_jumps(tangents, np.arange(len(solutions)))
    exact = [_constant_pieces(tangents, i, inner) for i, inner in enumerate(breaks)]
    out = {
        i: _exact_verdict(frame, float(period[i]), breaks[i], pieces)
        for i, pieces in enumerate(exact)
        if pieces is not None
    }
    open_states = np.array([i for i, pieces in enumerate(exact) if pieces is None], int)
    for rest in _portions(frame, period, open_states):
        matrix, errors = passage(
            frame,
            period[rest],
            lambda f, states, rest=rest: tangents(f, rest[states]),
            [breaks[i] for i in rest],
            tolerance=tolerance,
        )
        values = np.linalg.eigvals(matrix)
        for i, multipliers, error in zip(rest, values, errors):
            out[i] = frame.verdict(multipliers, float(period[i]), "splitting", float(error), tolerance)
    return [out[i] for i in range(len(solutions))]


def _portions(frame: Frame, period, states: np.ndarray) -> list[np.ndarray]:
    """The states in portions whose stiffness matrices are held at once; long periods stand together."""
    states = states[np.argsort(period[states], kind="stable")]
    out, first = [], 0
    entries = 2 * max(len(frame.rows), 1) ** 2 * frame.steps(period[states])
    for last in range(1, len(states) + 1):
        if last == len(states) or entries[last] * (last + 1 - first) > _MOST_ENTRIES:
            out.append(states[first:last])
            first = last
    return out


def _constant_pieces(tangents, state: int, inner: np.ndarray) -> np.ndarray | None:
    """Tangents (pieces, n_c, n_c) of a state whose tangents are constant between the breaks."""
    ends = np.concatenate([[0.0], inner, [1.0]])
    inside = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(_INSIDE) + 0.5) / _INSIDE
    values = tangents(inside.reshape(1, -1), np.array([state]))[0]
    values = values.reshape(*inside.shape, *values.shape[1:])
    spread = np.abs(values - values[:, :1]).max(initial=0.0)
    return values[:, 0] if spread <= 1e-13 * np.abs(values).max(initial=0.0) else None


def _exact_verdict(frame: Frame, period: float, inner, pieces) -> FloquetVerdict:
    durations = np.diff(np.concatenate([[0.0], inner, [1.0]])) * period
    multipliers = np.linalg.eigvals(frame.exact_monodromy(pieces, durations))
    return frame.verdict(multipliers, period, "exact exponentials", 0.0, np.inf)
