"""Steps in time: a linear system marched exactly or by a rule, its nonlinear columns by Newton iterations.

Every rule is a linear map of the state and of the column forces: ``x_1 = x_free - A g_1`` with x the
deflections of the columns at the end of the step, ``g = f - c x`` their forces beyond the reference stiffness
and ``A`` a matrix of n_columns rows that does not change. Only these few equations are iterated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dgesv

from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.tabulated import Law, tabulated_law

# Numbers held in the states of one block of steps.
_BLOCK_NUMBERS = 2_000_000


class Scheme(Protocol):
    """A rule for one step of a given length.

    ``flexibility`` (n_c, n_c): ``A``. ``start(q, v, theta, law)``: first state and g. ``table(theta)``: from
    phases (n + 1, n_bases) what the loads do in n steps, first axis n. ``free(state, g, load)``: state after
    the step without ``g_1``, ``deflection(state, load)`` its columns, ``finish(state, g_1)`` state with it.
    ``columns(states, g, theta)`` (..., n_c), ``motion(states, g, theta)``: displacements, velocities and,
    where the rule knows them, accelerations (n + 1, n). ``local_error(states, g)`` (n,): estimated error of
    the displacements in the steps, in the norm of the mass matrix.
    """

    flexibility: np.ndarray

    def start(self, q, v, theta, law): ...

    def table(self, theta): ...

    def free(self, state, g, load): ...

    def deflection(self, state, load): ...

    def finish(self, state, g): ...

    def columns(self, states, g, theta): ...

    def motion(self, states, g, theta): ...

    def local_error(self, states, g): ...


@dataclass
class Marched:
    """States of a block of steps, the one before the first included.

    ``states`` (n + 1, ...), ``excess`` (n + 1, n_c) column forces beyond the reference, ``steps`` done,
    ``residual`` the largest violation of the column equations relative to the deflections, ``iterations``.
    """

    states: np.ndarray
    excess: np.ndarray
    steps: int
    residual: float
    iterations: int


def block_length(state) -> int:
    """Steps that are kept in memory together."""
    return int(np.clip(_BLOCK_NUMBERS // state.size, 64, 8192))


def march(scheme, law: Law, loads, state, g, count, *, tolerance, max_iterations, size=0.0) -> Marched:
    """Take ``count`` steps; stops early where the columns do not converge or the numbers overflow.

    Parameters
    ----------
    scheme : Scheme
    law : callable
        Of the instants 0 .. count, from `tabulated_law`; instant 0 is the start.
    loads : (count, ...) array
        From ``scheme.table``.
    state, g : arrays
        At the start.
    count : int
    tolerance : float
        Of the column equations, relative to the largest free deflection so far.
    max_iterations : int
        Newton iterations a step.
    size : float
        Square of the largest free deflection before this block.
    """
    states, excess = np.empty((count + 1, *state.shape)), np.empty((count + 1, len(g)))
    states[0], excess[0] = state, g
    flexibility, unit, worst, total = scheme.flexibility, np.eye(len(g)), 0.0, 0
    free, deflection, finish = scheme.free, scheme.deflection, scheme.finish
    options = tolerance * tolerance, max_iterations
    for i in range(count):
        state = free(state, g, loads[i])
        aim = deflection(state, loads[i])
        size = max(size, float(aim @ aim))
        g, share, size, iterations = _solve_columns(law, i + 1, flexibility, unit, aim, g, size, options)
        total += iterations
        if not share <= options[0]:
            return Marched(states[: i + 1], excess[: i + 1], i, np.inf, total)
        worst = max(worst, share)
        state = finish(state, g)
        states[i + 1], excess[i + 1] = state, g
    return Marched(states, excess, count, float(np.sqrt(worst)), total)


def _solve_columns(law, i, flexibility, unit, aim, g, size, options):
    """Solve ``x + A g(x) = aim`` by Newton iterations that are shortened where they do not help.

    Returns g, the square of the violation relative to ``size``, that size (square of the largest deflection),
    and the number of iterations.
    """
    tolerance, most = options
    x = last = aim - flexibility @ g
    before = np.inf
    for iteration in range(most + 1):
        g, slope = law(i, x)
        error = aim - x - flexibility @ g
        square = float(error @ error)
        if not square < before:
            x, g, slope = _shortened(law, i, flexibility, aim, x, last, before)
            error = aim - x - flexibility @ g
            square = float(error @ error)
        scale = max(size, float(x @ x))
        if square <= tolerance * scale or iteration == most:
            break
        before, last = square, x
        matrix = flexibility * slope if slope.ndim == 1 else flexibility @ slope
        x = x + dgesv(matrix + unit, error)[2]
    return g, square / scale if scale else square, scale, iteration


def _shortened(law, i, flexibility, aim, x, last, before):
    """Half the Newton step until the column equations get better; the last try when none does."""
    for _ in range(30):
        x = 0.5 * (x + last)
        g, slope = law(i, x)
        error = aim - x - flexibility @ g
        if float(error @ error) < before:
            break
    return x, g, slope


def march_times(problem: NonlinearSystem, scheme, frequency, state, g, *, begin, step, count, **options):
    """Blocks of at most `block_length` steps from ``begin`` [s] on: yields (first step, Marched, phases)."""
    frequency = np.atleast_1d(np.asarray(frequency, float))
    done, size = 0, 0.0
    while done < count:
        number = min(block_length(state), count - done)
        theta = (begin + step * np.arange(done, done + number + 1))[:, None] * frequency
        block = march(
            scheme, tabulated_law(problem, theta), scheme.table(theta), state, g, number, size=size, **options
        )
        yield done, block, theta
        if block.steps < number:
            return
        state, g, done = block.states[-1], block.excess[-1], done + number
        size = max(size, largest_square(scheme.columns(block.states, block.excess, theta)))


def largest_square(x) -> float:
    """Largest ``|x|^2`` over the instants of x (n, n_c)."""
    return float(np.square(x).sum(axis=1).max(initial=0.0))
