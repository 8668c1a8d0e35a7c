"""Motion by the adaptive integrators of SciPy, from one contact change to the next.

The integrators (E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, II) lose
their order where the forces have a corner. With ``events`` every contact change and every break of a step
series is an instant at which the integration stops and starts again with the other law.

An element that is piecewise linear is a sum of positive parts ``max(u, 0)`` of switches u, linear in its
deflections. Frozen, with the pieces that hold taken as given, each part is u where it is closed and zero
where it is open, whatever the sign of u: smooth across the change.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import mass_error, state_matrix
from femgear.system.force_laws import Element, coefficients_of, has_corners, with_coefficients
from femgear.system.fourier import StepSeries, constant, phase_of
from femgear.system.system import NonlinearSystem, element_forces

METHODS = ("DOP853", "Radau", "LSODA")
# Instants inside a step at which contact changes are looked for.
_SAMPLES = 8
# Contact changes within this share of the reference time belong together.
_TOGETHER = 1e-13
# Contact changes without progress in time that end the integration.
_CHATTER = 200


@dataclass(frozen=True)
class Flow:
    """First-order form ``y = (q, v / rate)`` of a problem at given base frequencies, with tangents or not.

    Parameters
    ----------
    problem : NonlinearSystem
        What moves.
    frequency : (n_bases,) array
        [rad/s].
    rate : float
        Typical angular frequency, which makes the two halves of y alike [rad/s].
    matrix : (2n, 2n) array
        Linear part.
    columns : (n, n_c) array
        ``M^-1 W / rate``.
    loads : (1 + n_forces, n) complex array
        ``M^-1`` of the constant load and the harmonic forces, over rate.
    phases : (n_forces,) array
        Angular frequencies of the harmonic forces [rad/s].
    rows : (n_c, n) array
        ``W^T``.
    variational : bool
        Carry the derivatives of the state by the state at the start along.
    """

    problem: NonlinearSystem
    frequency: np.ndarray
    rate: float
    matrix: np.ndarray
    columns: np.ndarray
    loads: np.ndarray
    phases: np.ndarray
    rows: np.ndarray
    variational: bool = False

    @property
    def size(self) -> int:
        """Degrees of freedom n."""
        return len(self.problem.system.M)

    def state(self, q, v) -> np.ndarray:
        """Make the state of a start q (n,) [m] and v (n,) [m/s]; the derivatives are the unit matrix."""
        y = np.concatenate([np.asarray(q, float), np.asarray(v, float) / self.rate])
        return np.column_stack([y, np.eye(len(y))]).ravel() if self.variational else y

    def split(self, y):
        """Split states y (size, ...) into displacement [m], velocity [m/s] and deflection [m]."""
        width = 2 * self.size + 1 if self.variational else 1
        y = y.reshape(2 * self.size, width, *y.shape[1:])[:, 0]
        q = y[: self.size]
        return q, y[self.size :] * self.rate, np.tensordot(self.rows, q, 1)

    def tangents(self, y) -> np.ndarray:
        """Take the derivatives (2n, 2n) of the scaled state by that at the start out of a state y."""
        return y.reshape(2 * self.size, -1)[:, 1:]

    def derivative(self, law: Contacts):
        """Make ``dy/dt`` as a function of time [s] and state, with the contact state of ``law``."""
        n, constant, harmonic = self.size, self.loads[0].real, self.loads[1:]

        def motion(t, y):
            table = y.reshape(2 * n, -1)
            force, tangent = law.forces(self.rows @ table[:n, 0], t * self.frequency)
            out = self.matrix @ table
            out[n:, 0] += constant - self.columns @ force
            if len(self.phases):
                out[n:, 0] += (np.exp(1j * self.phases * t) @ harmonic).real
            out[n:, 1:] -= self.columns @ (tangent @ (self.rows @ table[:n, 1:]))
            return out.ravel()

        return motion

    def jacobian(self, law: Contacts):
        """Make the derivative (2n, 2n) [1/s] of the motion by the state as a function of time and state."""
        n = self.size

        def slope(t, y):
            _, tangent = law.forces(self.rows @ y[:n], t * self.frequency)
            out = self.matrix.copy()
            out[n:, :n] -= self.columns @ (tangent @ self.rows)
            return out

        return slope


def flow(problem: NonlinearSystem, frequency, *, variational=False) -> Flow:
    """Make the first-order form of a problem at base frequencies (n_bases,) [rad/s]; factorises M once."""
    system, n = problem.system, len(problem.system.M)
    frequency = np.atleast_1d(np.asarray(frequency, float))
    loads = np.stack([system.load.astype(complex), *(f.force for f in problem.forces)])
    try:
        factor = linalg.cho_factor(system.M)
    except linalg.LinAlgError as error:
        raise mass_error() from error
    rate = float(np.sqrt(np.abs(np.trace(linalg.cho_solve(factor, problem.stiffness))) / n))
    rate = rate or float(np.abs(frequency).max(initial=0.0)) or 1.0
    stiffness, damping = linalg.cho_solve(factor, system.K), linalg.cho_solve(factor, problem.damping)
    matrix = state_matrix(stiffness, damping, rate)
    return Flow(
        problem,
        frequency,
        rate,
        matrix,
        linalg.cho_solve(factor, system.W) / rate,
        linalg.cho_solve(factor, loads.T).T / rate,
        np.array([float(phase_of(frequency, f.orders)) for f in problem.forces]),
        np.ascontiguousarray(system.W.T),
        variational,
    )


def trajectory(
    motion: Flow,
    start,
    begin: float,
    end: float,
    *,
    method="DOP853",
    tolerance=1e-10,
    scale=None,
    events=False,
    max_steps=1_000_000,
) -> Iterator[tuple]:
    """Integrate the motion from a state; yields accepted steps (from, to [s], interpolation of y).

    ConvergenceError: the integrator gives up, contact chatters, too many steps.

    Parameters
    ----------
    start : (n,) array
        State, of ``Flow.state``.
    begin, end : float
        [s].
    method : str
        One of `METHODS`; with tangents only "DOP853".
    tolerance : float
        Relative local error, and absolute of ``scale``, the size of the motion [m].
    events : bool
        Stop at every contact change and at every break of a step series.
    """
    steps = _stepped(motion.problem, motion.frequency) if events else []
    y, t, taken = np.asarray(start, float), begin, 0
    q, v, x = motion.split(y)
    scale = scale or motion_scale(motion, (q, v)) or 1.0
    atol = tolerance * np.full(len(y), scale)
    if motion.variational:
        # derivatives of the scaled state are numbers of order one
        atol.reshape(2 * motion.size, -1)[:, 1:] = tolerance
    small = _TOGETHER * max(abs(begin), abs(end), 1.0 / motion.rate)
    while t < end:
        stop = min(_next_break(steps, t), end)
        stop = end if end - stop <= small else stop
        if stop - t <= small:
            t = stop
            continue
        middle = 0.5 * (t + stop) * motion.frequency
        piece = replace(motion, problem=_held(motion.problem, middle)) if steps else motion
        q, v, x = motion.split(y)
        law = _contacts(piece.problem, x, t * motion.frequency, motion.rows @ v, events=events)
        for t0, t1, dense in _smooth_pieces(piece, law, y, t, stop, small, method, tolerance, atol):
            taken += 1
            if taken > max_steps:
                raise ConvergenceError(
                    f"more than {max_steps} steps up to {t1:.6g} s of {end:.6g} s",
                    code="E-INTEGRATION",
                    remedy="loosen the tolerance, shorten the time or take method Radau",
                )
            yield t0, t1, dense
        t, y = stop, dense(stop)


def sampled(pieces, times, start) -> tuple[np.ndarray, int]:
    """Sample an adaptive integration: states (n_times, size) at times (n_times,) [s], number of its steps.

    Times ascend; ``pieces`` comes from `trajectory`; instants before its first step have the
    state ``start``.
    """
    states, filled, steps = np.empty((len(times), len(start))), 0, 0
    for begin, end, dense in pieces:
        early = int(np.searchsorted(times, begin, side="right")) if not steps else filled
        states[filled:early] = start
        last = int(np.searchsorted(times, end, side="right"))
        if last > early:
            states[early:last] = dense(times[early:last]).T
        filled, steps = max(last, early), steps + 1
    if filled < len(times):
        # the end of the last step, but for rounding
        states[filled:] = dense(times[filled:]).T if steps else start
    return states, steps


def checked_start(problem: NonlinearSystem, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Check displacement (n,) [m] and velocity (n,) [m/s] of a start; rest when none is given.

    CaseError: not a pair of n finite numbers each (E-START).
    """
    n = len(problem.system.M)
    if start is None:
        return np.zeros(n), np.zeros(n)
    try:
        q, v = (np.array(part, float) for part in start)
    except (TypeError, ValueError):
        shown = "no pair of lists of numbers"
    else:
        finite = np.all(np.isfinite(q)) and np.all(np.isfinite(v))
        if q.shape == v.shape == (n,) and finite:
            return q, v
        shown = f"shapes {q.shape} and {v.shape}" + ("" if finite else ", not all finite")
    raise CaseError(
        f"a start of {shown} for {n} degrees of freedom",
        code="E-START",
        key="start",
        limit=f"finite displacements [m] and velocities [m/s], each of shape ({n},)",
        remedy="give start=(displacement, velocity), one number a degree of freedom in each",
    )


def motion_scale(motion: Flow, start) -> float | None:
    """Estimate the size of the motion [m] to which a tolerance refers; None leaves it to the integrator.

    The start, and the static answer to loads and element forces at rest, held by the stiffness there plus
    inertia. That is singular at an unstable rest such as the top between two wells: inertia alone holds then.
    """
    q, v = start
    system, rate = motion.problem.system, motion.rate
    at_rest, _ = element_forces(motion.problem, np.zeros(system.W.shape[1]), np.zeros(motion.problem.bases))
    pushes = [system.load, system.W @ at_rest, *(np.abs(f.force) for f in motion.problem.forces)]
    carrying = motion.problem.stiffness + rate * rate * system.M
    try:
        held = [np.abs(np.linalg.solve(carrying, push)).max() for push in pushes]
    except np.linalg.LinAlgError:
        held = [np.abs(motion.loads).max() / rate]
    return float(max(np.abs(q).max(), np.abs(v).max() / rate, *held)) or None


def _smooth_pieces(motion: Flow, law: Contacts, y, t, stop, small, method, tolerance, atol):
    """Steps up to ``stop``, the contact state changed wherever a switch crosses zero."""
    has_switches = sum(map(len, law.closed)) > 0
    first, stuck = None, 0
    while stop - t > small:
        solver = _solver(motion, law, t, y, stop, method, tolerance, atol, first)
        changed = False
        while solver.status == "running" and not changed:
            message = solver.step()
            if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
                raise ConvergenceError(
                    f"{method} stopped at {solver.t:.6g} s: {message or 'numbers overflow'}",
                    code="E-INTEGRATION",
                    remedy="loosen the tolerance, smooth the contact or use events",
                )
            dense, t0, t1 = solver.dense_output(), solver.t_old, solver.t
            if has_switches:
                t1, which = _first_change(motion, law, dense, t0, t1, small)
                changed = which is not None
            if t1 > t0:
                yield t0, t1, dense
            if changed:
                first, stuck = max(solver.t - t1, 0.1 * (solver.t - t0)), 0 if t1 - t > small else stuck + 1
                t, y, law = t1, dense(t1), law.flipped(which)
        if stuck > _CHATTER:
            raise ConvergenceError(
                f"contact opens and closes without end at {t:.9g} s",
                code="E-INTEGRATION",
                remedy="integrate without events or with a smoothing length",
            )
        if not changed:
            return


def _solver(motion, law, t, y, stop, method, tolerance, atol, first):
    from scipy import integrate

    options = {"rtol": max(tolerance, 3e-14), "atol": atol}
    if first is not None:
        options["first_step"] = min(first, stop - t)
    if method != "DOP853":
        options["jac"] = motion.jacobian(law)
    return getattr(integrate, method)(motion.derivative(law), t, y, stop, **options)


def _first_change(motion: Flow, law: Contacts, dense, t0, t1, small):
    """Instant of the first contact change in a step and the switches that change, or the end and None."""
    from scipy.optimize import root_scalar

    times = np.linspace(t0, t1, _SAMPLES + 1)
    gaps = _gaps(motion, law, dense, times)
    wrong = gaps[1:] < 0.0
    if not wrong.any():
        return t1, None
    k = int(np.argmax(wrong.any(axis=1)))
    instants = np.full(gaps.shape[1], np.inf)
    for j in np.flatnonzero(wrong[k]):

        def gap(t, j=j):
            return _gaps(motion, law, dense, np.array([t]))[0, j]

        if gap(times[k]) <= 0.0:
            instants[j] = times[k]
            continue
        bracket = times[k], times[k + 1]
        instants[j] = root_scalar(
            gap, bracket=bracket, method="brentq", xtol=1e-300, rtol=4.0 * np.finfo(float).eps
        ).root
    return float(instants.min()), instants <= instants.min() + small


def _gaps(motion: Flow, law: Contacts, dense, times):
    return law.gaps(motion.split(dense(times))[2].T, times[:, None] * motion.frequency)


def _switches(element: Element, x, theta) -> np.ndarray:
    """Arguments (..., m) of the positive parts of an element at deflections x (..., g, d); none if smooth."""
    if has_corners(element):
        return element.switches(np.asarray(x, float), theta)
    return np.zeros((*np.shape(x)[:-2], 0))


@dataclass(frozen=True)
class Contacts:
    """Elements of a problem with the contact state between two changes.

    ``elements`` are those of the problem, ``columns`` is the number of columns of ``W``. ``closed``: one bool array an
    element; none where the elements are evaluated as they are.
    """

    elements: tuple[Element, ...]
    columns: int
    closed: tuple[np.ndarray, ...] = ()

    def forces(self, x, theta):
        """Compute forces (n_c,) [N] and tangents (n_c, n_c) [N/m] of one instant, x (n_c,) in m."""
        total, tangent = np.zeros(self.columns), np.zeros((self.columns, self.columns))
        for number, element in enumerate(self.elements):
            closing = x[element.columns]
            if self.closed and len(self.closed[number]) and has_corners(element):
                force, slope = element.frozen(closing, theta, self.closed[number])
            else:
                force, slope = element.evaluate(closing, theta)
            columns = element.columns
            np.add.at(total, columns, force)
            np.add.at(tangent, (columns[:, :, None], columns[:, None, :]), slope)
        return total, tangent

    def gaps(self, x, theta) -> np.ndarray:
        """Compute all switches (..., m) at deflections x (..., n_c) [m], positive on their side.

        Closed switches are ``u``, open ones ``-u``: a negative value says that the state has to change.
        """
        sides = [_switches(e, x[..., e.columns], theta) for e in self.elements]
        return np.concatenate(sides, axis=-1) * np.where(np.concatenate(self.closed), 1.0, -1.0)

    def flipped(self, which) -> Contacts:
        """Change the switches ``which`` (m,) bool."""
        state = np.concatenate(self.closed) ^ which
        parts = np.split(state, np.cumsum([len(c) for c in self.closed])[:-1])
        return replace(self, closed=tuple(parts))


def _contacts(problem: NonlinearSystem, x, theta, rate, *, events: bool) -> Contacts:
    """Contact state at deflections x (n_c,) and phases theta (n_bases,), tending as the rate of x.

    A switch at zero within rounding is closed when its deflection rate opens the next instant so.
    """
    elements, columns = problem.elements, problem.system.W.shape[1]
    if not events:
        return Contacts(elements, columns)
    size = np.abs(x).max(initial=0.0)
    ahead = x + 1e-9 * (size or 1.0) * rate / (np.abs(rate).max(initial=0.0) or 1.0)
    closed = tuple(_switches(e, ahead[e.columns], theta) > 0.0 for e in elements)
    return Contacts(elements, columns, closed)


def _stepped(problem: NonlinearSystem, frequency) -> list[tuple[np.ndarray, float]]:
    """Breaks (fractions) and repetition rate [1/s] of every step series of the elements."""
    series_and_rates = []
    for element in problem.elements:
        for series in coefficients_of(element).values():
            if isinstance(series, StepSeries) and len(series.breaks) > 1:
                rate = float(phase_of(frequency, series.orders)) / (2.0 * np.pi)
                if rate < 0.0:
                    raise CaseError("a step series runs backwards", code="E-RANGE", limit="rates above 0")
                if rate:
                    series_and_rates.append((series.breaks, rate))
    return series_and_rates


def _next_break(steps, time: float) -> float:
    """First instant after ``time`` at which a step series changes; infinite when none does."""
    best = np.inf
    for breaks, rate in steps:
        turn = time * rate
        later = breaks + np.floor(turn) - turn
        later = np.where(later <= 1e-12 * max(1.0, abs(turn)), later + 1.0, later)
        best = min(best, time + float(later.min()) / rate)
    return best


def _held(problem: NonlinearSystem, theta) -> NonlinearSystem:
    """The problem with its step series at their values at the phases ``theta``, constant."""

    def at_theta(series):
        return constant(series.at(theta)) if isinstance(series, StepSeries) else series

    return replace(problem, elements=tuple(with_coefficients(element, at_theta) for element in problem.elements))
