"""Stability of periodic solutions: Floquet multipliers from the monodromy matrix or by Hill's method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.entries import checked_numbers, checked_tolerance
from femgear.solvers.floquet import monodromy
from femgear.solvers.nonlinear import NonlinearSystem, element_forces
from femgear.solvers.periodic import PeriodicSolution
from femgear.solvers.tangent_jumps import tangent_jumps
from femgear.solvers.variational import Frame, frame_of, passage
from femgear.solvers.verdict import FloquetVerdict, loss_of, open_verdict, verdict_of

__all__ = [
    "FloquetVerdict",
    "floquet_verdict",
    "floquet_verdicts",
    "hill_exponents",
    "judged",
    "loss_of",
    "require_period",
    "tangents_of",
    "verdict_of",
]

# States treated together, and instants of a piece at which tangents are compared.
_BATCH = 32
_INSIDE = 7
# Steps of the first sequence over one period beyond which a verdict is not sought, and the most entries of
# stiffness matrices at these steps that are held at once.
_MOST_STEPS = 20_000
_MOST_ENTRIES = 4_000_000


def floquet_verdict(
    problem: NonlinearSystem,
    solution: PeriodicSolution,
    *,
    method: str = "monodromy",
    tolerance: float = 1e-7,
    harmonics: int | None = None,
    modes: int = 100,
) -> FloquetVerdict:
    """Stability of one periodic solution; see :func:`floquet_verdicts`."""
    return floquet_verdicts(
        problem, [solution], method=method, tolerance=tolerance, harmonics=harmonics, modes=modes
    )[0]


def floquet_verdicts(
    problem: NonlinearSystem,
    solutions: Sequence[PeriodicSolution],
    *,
    method: str = "monodromy",
    tolerance: float = 1e-7,
    harmonics: int | None = None,
    modes: int = 100,
) -> tuple[FloquetVerdict, ...]:
    """Stability of periodic solutions of one problem.

    Parameters
    ----------
    problem : NonlinearSystem
    solutions : sequence of PeriodicSolution
        All with the same lines. With two base frequencies or the frequency zero the verdict is "not
        covered"; "not determined" where the fastest mode would need more than 20000 steps in a period.
    method : str
        ``"monodromy"``: exact exponentials where the tangents are constant in pieces, otherwise a splitting,
        with steps that end where contacts open or close. ``"hill"``: eigenvalues of the harmonic operator.
    tolerance : float
        Relative error of the monodromy matrix.
    harmonics : int, optional
        Of Hill's method; by default twice those of the solution.
    modes : int
        Largest number of modes followed; the others count as static flexibility.

    Raises
    ------
    CaseError
        An unknown method, a tolerance that is not between 0 and 1 (E-TOLERANCE).
    ConvergenceError
        Modes left out that are too flexible.

    Notes
    -----
    The position of a free motion (rotation of a free train) has the multiplier one and is left out; so is
    its velocity where no damping feels it. Where one does, its multiplier ``exp(-c period)`` counts.
    """
    if method not in ("monodromy", "hill"):
        raise CaseError(
            f"stability by {method!r}", code="E-METHOD", key="method", limit='"monodromy" or "hill"'
        )
    tolerance = checked_tolerance(tolerance)
    frame = frame_of(problem, modes=modes)
    out = [_not_covered(solution) or _too_long(frame, solution) for solution in solutions]
    covered = [i for i, verdict in enumerate(out) if verdict is None]
    for first in range(0, len(covered), _BATCH):
        part = covered[first : first + _BATCH]
        chosen = [solutions[i] for i in part]
        if method == "hill":
            found = [_by_hill(frame, problem, solution, harmonics) for solution in chosen]
        else:
            found = _by_monodromy(frame, problem, chosen, tolerance)
        for i, verdict in zip(part, found):
            out[i] = verdict
    return tuple(out)


def judged(
    problem: NonlinearSystem, solutions: Sequence[PeriodicSolution], **options
) -> tuple[PeriodicSolution, ...]:
    """The solutions with their verdicts; options as for :func:`floquet_verdicts`.

    Where the modes kept do not carry the motion the verdict says "not determined".
    """
    try:
        verdicts = floquet_verdicts(problem, solutions, **options)
    except ConvergenceError as error:
        verdicts = (open_verdict(f"not determined: {error.message}"),) * len(solutions)
    return tuple(replace(solution, verdict=verdict) for solution, verdict in zip(solutions, verdicts))


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


def require_period(frequency) -> None:
    """Refuse the single base frequency zero, which has no period to judge stability over.

    Parameters
    ----------
    frequency : float or (n_bases,) array
        [rad/s]; several ones are let through, their verdict is "not covered".

    Raises
    ------
    CaseError
        The only base frequency is zero (E-FREQUENCY).
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    if frequency.size == 1 and frequency.ravel()[0] == 0.0:
        raise CaseError(
            "stability needs a period, and the base frequency is zero", code="E-FREQUENCY", key="frequency",
            value=0.0, limit="> 0 rad/s",
            remedy="give a positive frequency, or solve without stability: solve_harmonic_balance, "
            "stability=False of a curve",
        )  # fmt: skip


def tangents_of(problem: NonlinearSystem, solutions: Sequence[PeriodicSolution]):
    """Function ``(fraction (m, s), states (m,)) -> tangents (m, s, n_c, n_c)`` [N/m] along the solutions."""
    lines = np.stack([solution.deflection for solution in solutions])
    orders = solutions[0].orders[:, 0]

    def tangents(fraction, states):
        phase = 2.0 * np.pi * fraction
        wave = np.exp(1j * phase)[..., None] ** orders
        x = (wave @ np.swapaxes(lines[states], 1, 2)).real
        return element_forces(problem, x, phase[..., None])[1]

    return tangents


def _by_monodromy(frame: Frame, problem, solutions, tolerance: float) -> list[FloquetVerdict]:
    period = np.array([2.0 * np.pi / abs(solution.frequency[0]) for solution in solutions])
    tangents = tangents_of(problem, solutions)
    breaks = tangent_jumps(tangents, np.arange(len(solutions)))
    exact = [_constant_pieces(tangents, i, inner) for i, inner in enumerate(breaks)]
    out = [
        None if pieces is None else _exact_verdict(frame, T, inner, pieces)
        for T, inner, pieces in zip(period, breaks, exact)
    ]
    open_states = np.array([i for i, pieces in enumerate(exact) if pieces is None], int)
    for rest in _portions(frame, period, open_states):
        moved = passage(
            frame, period[rest], lambda f, states, rest=rest: tangents(f, rest[states]),
            [breaks[i] for i in rest], tolerance=tolerance,
        )  # fmt: skip
        values = np.linalg.eigvals(moved.matrix)
        for i, multipliers, error in zip(rest, values, moved.error):
            out[i] = verdict_of(multipliers, period[i], "splitting", float(error), tolerance, **_free(frame))
    return out


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
    unit = frame.fastest or 1.0
    both = np.concatenate([np.ones(len(frame.square)), np.full(len(frame.square), unit)])
    matrices = frame.state_matrices(frame.kappa(pieces)) * both / both[:, None]
    multipliers = np.linalg.eigvals(monodromy(matrices, durations))
    return verdict_of(multipliers, period, "exact exponentials", 0.0, np.inf, **_free(frame))


def _by_hill(frame: Frame, problem, solution: PeriodicSolution, harmonics: int | None) -> FloquetVerdict:
    count = 2 * int(np.abs(solution.orders).max()) if harmonics is None else int(harmonics)
    if count < 1:
        raise CaseError("Hill's method needs a harmonic", code="E-HARMONICS", value=count, limit=">= 1")
    omega = abs(float(solution.frequency[0]))
    samples = max(512, 16 * count)
    fraction = np.arange(samples)[None] / samples
    kappa = frame.kappa(tangents_of(problem, [solution])(fraction, np.array([0]))[0])
    exponents = hill_exponents(frame, kappa, omega, harmonics=count)
    period = 2.0 * np.pi / omega
    return verdict_of(np.exp(exponents * period), period, "Hill", np.nan, np.inf, **_free(frame))


def _free(frame: Frame) -> dict:
    """What the verdict has to know of free motions."""
    return {"positions": frame.positions, "velocities": frame.positions, "drift": frame.drift}


def hill_exponents(frame: Frame, kappa: np.ndarray, omega: float, *, harmonics: int) -> np.ndarray:
    """Floquet exponents (2 n,) [1/s] by Hill's method.

    ``z = exp(lambda t) sum_h z_h exp(i h omega t)`` in the first-order form gives the eigenvalues of the
    block Toeplitz matrix ``A_(h - m) - i h omega``. Of every exponent it holds copies ``lambda + i k omega``;
    those with the most symmetric eigenvectors are the converged ones (Moore, SIAM J. Numer. Anal. 42, 2005):
    the smallest distance of the centre ``sum h |z_h|^2 / sum |z_h|^2`` from zero, one copy of each.

    Parameters
    ----------
    frame : Frame
    kappa : (samples, n_c, n_c) array
        Change of stiffness from the reference over one period [N/m].
    omega : float
        Base frequency [rad/s].
    harmonics : int
    """
    n, orders = len(frame.square), np.arange(-harmonics, harmonics + 1)
    lines = np.fft.fft(kappa, axis=0) / len(kappa)
    both = np.concatenate([np.ones(n), np.full(n, omega)])
    change = np.zeros((4 * harmonics + 1, 2 * n, 2 * n), complex)
    for number in range(-2 * harmonics, 2 * harmonics + 1):
        change[number, n:, :n] = -frame.rows.T @ lines[number] @ frame.rows
    change[0] += frame.state_matrices(np.zeros_like(lines[0].real))
    change *= both / both[:, None]
    size = 2 * n * len(orders)
    matrix = change[orders[:, None] - orders].swapaxes(1, 2).reshape(size, size)
    matrix[range(size), range(size)] -= 1j * omega * np.repeat(orders, 2 * n)
    values, vectors = np.linalg.eig(matrix)
    weight = (np.abs(vectors.reshape(len(orders), 2 * n, -1)) ** 2).sum(axis=1)
    centre = np.abs(orders @ weight) / weight.sum(axis=0)
    return _one_copy_each(values[np.argsort(centre, kind="stable")], omega, 2 * n)


def _one_copy_each(values: np.ndarray, omega: float, count: int) -> np.ndarray:
    """The first ``count`` values of which none is another one shifted by a multiple of ``i omega``."""
    chosen: list[complex] = []
    for value in values:
        shift = (value - np.array(chosen)) / (1j * omega)
        turns = np.round(shift.real)
        if not np.any((np.abs(shift - turns) < 1e-4) & (turns != 0)):
            chosen.append(value)
        if len(chosen) == count:
            break
    return np.array(chosen)
