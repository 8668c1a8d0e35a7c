"""Small motions about a periodic state: modes with the tangents of the elements, followed through one period.

``M z'' + (C + speed G) z' + K z + W k(t) W^T z = 0`` in the modes of ``K + W diag(reference) W^T``, for many
states at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.system import Modes

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
        """Steps of the first sequence over a period [s], as floats: they may be beyond all bounds."""
        return np.ceil(np.maximum(8.0, self.fastest * np.asarray(period, float) / _STEP_ANGLE))

    @property
    def fastest(self) -> float:
        """Largest natural angular frequency [rad/s]."""
        return float(np.sqrt(np.abs(self.square).max(initial=0.0)))

    def kappa(self, tangent: np.ndarray) -> np.ndarray:
        """Change of stiffness (..., n_c, n_c) with the modes left out in series, ``k (1 + T_res k)^-1``."""
        change = tangent - np.diag(self.reference)
        if not np.any(self.residual):
            return change
        carried = np.eye(len(self.residual)) + self.residual @ change
        if np.linalg.eigvals(carried).real.min() <= 0.0:
            raise ConvergenceError(
                "the modes left out are more flexible than the elements at their lowest stiffness",
                code="E-RESIDUAL", remedy="keep more modes",
            )  # fmt: skip
        return change @ np.linalg.inv(carried)

    def state_matrices(self, kappa: np.ndarray) -> np.ndarray:
        """``A`` (..., 2 n, 2 n) of ``(eta, eta')' = A (eta, eta')`` with kappa (..., n_c, n_c)."""
        n = len(self.square)
        out = np.zeros((*kappa.shape[:-2], 2 * n, 2 * n))
        out[..., range(n), range(n, 2 * n)] = 1.0
        out[..., n:, :n] = -np.diag(self.square) - self.rows.T @ kappa @ self.rows
        out[..., n:, n:] = -self.damping
        return out


def frame_of(problem: NonlinearSystem, *, modes: int = 100) -> Frame:
    """Modes of a problem about its reference stiffness, lowest first.

    Free motions that no column and no coupling of the damping feels are left out: the multipliers of their
    positions are one, those of their velocities follow from `Frame.drift`.

    Parameters
    ----------
    problem : NonlinearSystem
    modes : int
        Largest number of modes kept; the others leave their static flexibility.
    """
    from scipy import linalg

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


def _residual(problem, stiffness, rigid, rows, square) -> np.ndarray:
    """``W^T K^+ W`` without the part of the modes kept; rigid motions that no column feels are held."""
    from scipy import linalg

    system = problem.system
    carried = system.M @ rigid
    weight = np.trace(stiffness) / np.trace(system.M)
    flexible = linalg.solve(stiffness + weight * (carried @ carried.T), system.W, assume_a="sym")
    if np.any(square <= 0.0):
        raise ConvergenceError(
            "a motion without stiffness moves an element: static flexibilities do not exist",
            code="E-RESIDUAL", remedy="keep all modes",
        )  # fmt: skip
    out = system.W.T @ flexible - (rows / square) @ rows.T
    return 0.5 * (out + out.T)


def frame_of_modes(modes: Modes) -> Frame:
    """The moving modes of a modal basis with their damping ratios."""
    moving = modes.frequency > 0.0
    omega = 2.0 * np.pi * modes.frequency[moving]
    damping = np.diag(2.0 * modes.damping_ratio[moving] * omega)
    residual = modes.residual
    size = np.abs((modes.mesh_deflection[:, moving] / omega**2) @ modes.mesh_deflection[:, moving].T).max()
    if np.abs(residual).max(initial=0.0) <= 1e-12 * size:
        residual = np.zeros_like(residual)  # rounding of a complete basis
    return Frame(omega**2, damping, modes.mesh_deflection[:, moving], modes.mesh_stiffness, residual)


@dataclass(frozen=True)
class Passage:
    """Monodromy matrices of several states.

    Parameters
    ----------
    matrix : (p, 2 n, 2 n) array
        In coordinates ``(eta, eta' / s)`` with a scale s of every mode.
    error : (p,) array
        Estimated error of the matrix relative to its norm.
    steps : (p,) int array
        Steps of the finest sequence; zero for exact exponentials.
    """

    matrix: np.ndarray
    error: np.ndarray
    steps: np.ndarray


def passage(
    frame: Frame, period, tangents: Callable, breaks: list[np.ndarray], *, tolerance: float = 1e-7
) -> Passage:
    """Monodromy matrices over one period by a splitting of fourth order with Richardson extrapolation.

    Algorithm 4B of Chin (Phys. Lett. A 226, 1997; for forces that depend on time Chin and Chen, J. Chem.
    Phys. 117, 2002): damped modes move exactly between kicks of the elements at the Gauss points of every
    step, ``kappa - (2 - sqrt 3) / 12 dt^2 kappa R R^T kappa``. It is symmetric, so the errors have even
    powers and halved steps extrapolate to orders 6, 8, ... Steps end where the tangents jump.

    Parameters
    ----------
    frame : Frame
    period : (p,) array
        [s].
    tangents : callable
        ``(fraction (m, s), states (m,)) -> (m, s, n_c, n_c)`` tangents [N/m] at fractions of the period.
    breaks : list of p arrays
        Ascending fractions inside the period where tangents jump.
    tolerance : float
        Relative error of the matrix at which halving ends, after at most 7 sequences, fewer where a
        period takes thousands of steps.
    """
    period = np.asarray(period, float)
    size, n = len(period), len(frame.square)
    out = Passage(np.empty((size, 2 * n, 2 * n)), np.full(size, np.inf), np.zeros(size, int))
    open_states, table = np.arange(size), None
    base = int(frame.steps(period.max(initial=0.0)))
    for level in range(_LEVELS):
        start, duration = _steps([breaks[i] for i in open_states], base, level)
        found = _through(frame, period[open_states], start, duration, tangents, open_states)
        table, error = _extrapolated(table, found)
        out.matrix[open_states], out.error[open_states] = table[-1], error
        out.steps[open_states] = start.shape[1]
        rest = error > tolerance
        open_states, table = open_states[rest], [entry[rest] for entry in table]
        if not len(open_states) or (level and base << (level + 1) > _MOST_HALVED):
            break
    return out


def _extrapolated(table, found):
    """Next row of Romberg's table for errors of orders 4, 6, 8, ..., and the error of its last entry."""
    row = [found]
    for column, before in enumerate(table or []):
        row.append(row[-1] + (row[-1] - before) / (2.0 ** (4 + 2 * column) - 1.0))
    if len(row) == 1:
        return row, np.full(len(found), np.inf)
    size = np.maximum(np.linalg.norm(row[-1], axis=(1, 2)), 1.0)
    return row, np.linalg.norm(row[-1] - row[-2], axis=(1, 2)) / size


def _steps(breaks: list[np.ndarray], base: int, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts and durations (p, s) of steps, in parts of the period, that end at the breaks.

    Every piece between breaks has its share of ``base`` steps, each halved ``level`` times; rows that have
    fewer are filled up with steps of no duration.
    """
    rows = []
    for inner in breaks:
        ends = np.concatenate([[0.0], inner, [1.0]])
        length = np.diff(ends)
        each = np.maximum(np.ceil(length * base).astype(int), 1) << level
        duration = np.repeat(length / each, each)
        number = np.concatenate([np.arange(m) for m in each])
        rows.append((np.repeat(ends[:-1], each) + duration * number, duration))
    longest = max(len(duration) for _, duration in rows)
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
    scale = _scales(frame)
    back = (frame.rows / scale).T
    drift = _modal_drift if frame.diagonal else _coupled_drift
    outer, inner = dt * (0.5 - _GAUSS), dt * (2.0 * _GAUSS)
    between = outer.copy()
    between[:, 1:] += outer[:, :-1]
    move = drift(frame, scale, np.stack([between, inner], axis=-1).reshape(m, -1))
    state = np.tile(np.eye(2 * n), (m, 1, 1))
    for step, kick in enumerate(np.moveaxis(kicks.reshape(m, -1, *square), 1, 0)):
        state = move(step, state)
        state[:, n:] -= back @ (kick @ (frame.rows @ state[:, :n]))
    return drift(frame, scale, outer[:, -1:])(0, state)


def _scales(frame: Frame) -> np.ndarray:
    """Angular frequencies (n,) that bring modal velocities to the size of the motions."""
    natural = np.sqrt(np.abs(frame.square))
    return np.where(natural > 1e-6 * natural.max(), natural, natural.max() or 1.0)


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
    from scipy.linalg import expm

    both = np.concatenate([np.ones_like(scale), scale])
    matrix = frame.state_matrices(np.zeros((len(frame.rows),) * 2)) * both / both[:, None]
    values, where = np.unique(durations, return_inverse=True)
    steps, where = expm(matrix * values[:, None, None]), where.reshape(durations.shape)

    def move(step: int, state: np.ndarray) -> np.ndarray:
        return steps[where[:, step]] @ state

    return move
