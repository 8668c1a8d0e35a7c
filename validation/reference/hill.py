"""Floquet multipliers by Hill's method: eigenvalues of the harmonic operator, without integration in time."""

from __future__ import annotations

import numpy as np

from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.stability.floquet import Frame, frame_of, tangents_of
from femgear.system.system import NonlinearSystem


def hill_verdict(
    problem: NonlinearSystem, solution: PeriodicSolution, *, harmonics: int | None = None
) -> FloquetVerdict:
    """Judge a periodic solution; by default with twice its harmonics.

    Harmonics of a stiffness that jumps fall slowly, and the error is not known (nan).
    """
    count = 2 * int(np.abs(solution.orders).max()) if harmonics is None else harmonics
    frame, omega = frame_of(problem), abs(float(solution.frequency[0]))
    samples = max(512, 16 * count)
    fraction = np.arange(samples)[None] / samples
    kappa = frame.kappa(tangents_of(problem, [solution])(fraction, np.array([0]))[0])
    exponents, period = _exponents(frame, kappa, omega, count), 2.0 * np.pi / omega
    return frame.verdict(np.exp(exponents * period), period, "Hill", np.nan, np.inf)


def _exponents(frame: Frame, kappa: np.ndarray, omega: float, harmonics: int) -> np.ndarray:
    """Floquet exponents (2 n,) [1/s] from the stiffness changes kappa (samples, n_c, n_c) [N/m].

    ``z = exp(lambda t) sum_h z_h exp(i h omega t)`` in the first-order form gives the eigenvalues of the
    block Toeplitz matrix ``A_(h - m) - i h omega``. Of every exponent it holds copies ``lambda + i k omega``;
    those with the most symmetric eigenvectors are the converged ones (Moore, SIAM J. Numer. Anal. 42, 2005):
    the smallest distance of the centre ``sum h |z_h|^2 / sum |z_h|^2`` from zero, one copy of each.
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
