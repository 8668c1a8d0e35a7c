"""Motion by the adaptive integrators of SciPy, from one contact change to the next.

The integrators (E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, II) lose
their order where the forces have a corner. With ``events`` every contact change and every break of a step
series is an instant at which the integration stops and starts again with the other law.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.series import phase_of
from femgear.solvers.switching import Contacts, contacts, held, next_break, stepped

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
        """State at the start; the derivatives are the unit matrix."""
        y = np.concatenate([np.asarray(q, float), np.asarray(v, float) / self.rate])
        return np.column_stack([y, np.eye(len(y))]).ravel() if self.variational else y

    def split(self, y):
        """Displacement, velocity and deflection of states y (size, ...)."""
        width = 2 * self.size + 1 if self.variational else 1
        y = y.reshape(2 * self.size, width, *y.shape[1:])[:, 0]
        q = y[: self.size]
        return q, y[self.size :] * self.rate, np.tensordot(self.rows, q, 1)

    def tangents(self, y) -> np.ndarray:
        """Derivatives (2n, 2n) of the scaled state by the scaled state at the start."""
        return y.reshape(2 * self.size, -1)[:, 1:]

    def derivative(self, law: Contacts):
        """``dy/dt`` as a function of time and state, with the contact state of ``law``."""
        n, frequency = self.size, self.frequency
        matrix, columns, rows, loads = self.matrix, self.columns, self.rows, self.loads
        constant, harmonic, phases = loads[0].real, loads[1:], self.phases

        def motion(t, y):
            force, _ = law.forces(rows @ y[:n], t * frequency)
            out = matrix @ y
            out[n:] += constant - columns @ force
            if len(phases):
                out[n:] += (np.exp(1j * phases * t) @ harmonic).real
            return out

        def both(t, y):
            table = y.reshape(2 * n, -1)
            force, tangent = law.forces(rows @ table[:n, 0], t * frequency)
            out = matrix @ table
            out[n:, 0] += constant - columns @ force
            if len(phases):
                out[n:, 0] += (np.exp(1j * phases * t) @ harmonic).real
            out[n:, 1:] -= columns @ (tangent @ (rows @ table[:n, 1:]))
            return out.ravel()

        return both if self.variational else motion

    def jacobian(self, law: Contacts):
        """Derivative of the motion by the state, (2n, 2n)."""
        n = self.size

        def slope(t, y):
            _, tangent = law.forces(self.rows @ y[:n], t * self.frequency)
            out = self.matrix.copy()
            out[n:, :n] -= self.columns @ (tangent @ self.rows)
            return out

        return slope


def flow(problem: NonlinearSystem, frequency, *, variational=False) -> Flow:
    """First-order form of a problem; M is factorised once."""
    from scipy import linalg

    system, n = problem.system, len(problem.system.M)
    frequency = np.atleast_1d(np.asarray(frequency, float))
    loads = np.stack([system.load.astype(complex), *(f.force for f in problem.forces)])
    try:
        factor = linalg.cho_factor(system.M)
    except linalg.LinAlgError as error:
        raise ConvergenceError(
            "the mass matrix is not positive definite", code="E-MASS",
            remedy="give every degree of freedom some mass or condense it",
        ) from error  # fmt: skip
    stiffness = system.K + (system.W * problem.reference) @ system.W.T
    rate = float(np.sqrt(np.abs(np.trace(linalg.cho_solve(factor, stiffness))) / n))
    rate = rate or float(np.abs(frequency).max(initial=0.0)) or 1.0
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = rate * np.eye(n)
    matrix[n:, :n] = -linalg.cho_solve(factor, system.K) / rate
    matrix[n:, n:] = -linalg.cho_solve(factor, problem.damping)
    return Flow(
        problem, frequency, rate, matrix, linalg.cho_solve(factor, system.W) / rate,
        linalg.cho_solve(factor, loads.T).T / rate,
        np.array([float(phase_of(frequency, f.orders)) for f in problem.forces]),
        np.ascontiguousarray(system.W.T), variational,
    )  # fmt: skip


def typical_deflection(problem: NonlinearSystem, q, v, rate: float) -> float:
    """Size of the motion: the start, and the static answer to loads and element forces at rest [m]."""
    system = problem.system
    theta = np.zeros(problem.bases)
    at_rest, _ = Contacts(problem.elements, system.W.shape[1]).forces(np.zeros(system.W.shape[1]), theta)
    pushes = [system.load, system.W @ at_rest, *(np.abs(f.force) for f in problem.forces)]
    stiffness = system.K + (system.W * problem.reference) @ system.W.T
    weight = rate * rate * system.M
    static = [np.abs(np.linalg.solve(stiffness + weight, p)).max() for p in pushes]
    return max(np.abs(q).max(), np.abs(v).max() / rate, *static)


def trajectory(
    motion: Flow, start, begin: float, end: float, *, method="DOP853", tolerance=1e-10, scale=None,
    events=False, max_steps=1_000_000,
) -> Iterator[tuple]:  # fmt: skip
    """Accepted steps of the integrator: yields (from, to, interpolation of y).

    Parameters
    ----------
    motion : Flow
    start : (size,) array
        From ``Flow.state``.
    begin, end : float
        [s].
    method : str
        One of `METHODS`; with tangents only "DOP853".
    tolerance : float
        Relative local error, and absolute of ``scale``.
    scale : float, optional
        Size of the motion [m].
    events : bool
        Stop at every contact change and at every break of a step series.
    max_steps : int

    Raises
    ------
    ConvergenceError
        The integrator gives up, contact chatters, too many steps.
    """
    steps = stepped(motion.problem, motion.frequency) if events else []
    y, t, taken = np.asarray(start, float), begin, 0
    q, v, x = motion.split(y)
    scale = scale or typical_deflection(motion.problem, q, v, motion.rate) or 1.0
    atol = tolerance * np.full(len(y), scale)
    if motion.variational:
        # derivatives of the scaled state are numbers of order one
        atol.reshape(2 * motion.size, -1)[:, 1:] = tolerance
    small = _TOGETHER * max(abs(begin), abs(end), 1.0 / motion.rate)
    while t < end:
        stop = min(next_break(steps, t), end)
        stop = end if end - stop <= small else stop
        if stop - t <= small:
            t = stop
            continue
        middle = 0.5 * (t + stop) * motion.frequency
        piece = replace(motion, problem=held(motion.problem, middle)) if steps else motion
        q, v, x = motion.split(y)
        law = contacts(piece.problem, x, t * motion.frequency, motion.rows @ v, events=events)
        for t0, t1, dense in _smooth_pieces(piece, law, y, t, stop, small, method, tolerance, atol):
            taken += 1
            if taken > max_steps:
                raise ConvergenceError(
                    f"more than {max_steps} steps up to {t1:.6g} s of {end:.6g} s", code="E-STEPS",
                    remedy="loosen the tolerance, shorten the time or take method Radau",
                )  # fmt: skip
            yield t0, t1, dense
        t, y = stop, dense(stop)


def _smooth_pieces(motion: Flow, law: Contacts, y, t, stop, small, method, tolerance, atol):
    """Steps up to ``stop``, the contact state changed wherever a switch crosses zero."""
    has_switches = law.closed is not None and sum(map(len, law.closed)) > 0
    first, stuck = None, 0
    while stop - t > small:
        solver = _solver(motion, law, t, y, stop, method, tolerance, atol, first)
        changed = False
        while solver.status == "running" and not changed:
            message = solver.step()
            if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
                raise ConvergenceError(
                    f"{method} stopped at {solver.t:.6g} s: {message or 'numbers overflow'}",
                    code="E-INTEGRATION", remedy="loosen the tolerance, smooth the contact or use events",
                )  # fmt: skip
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
                f"contact opens and closes without end at {t:.9g} s", code="E-CHATTER",
                remedy="integrate without events or with a smoothing length",
            )  # fmt: skip
        if not changed:
            return


def _solver(motion, law, t, y, stop, method, tolerance, atol, first):
    from scipy import integrate

    if method not in METHODS or (motion.variational and method != "DOP853"):
        raise CaseError(f"no integrator {method}", code="E-METHOD", limit=", ".join(METHODS))
    options = {"rtol": max(tolerance, 3e-14), "atol": atol}
    if first is not None:
        options["first_step"] = min(first, stop - t)
    if method != "DOP853":
        options["jac"] = motion.jacobian(law)
    return getattr(integrate, method)(motion.derivative(law), t, y, stop, **options)


def _first_change(motion: Flow, law: Contacts, dense, t0, t1, small):
    """Instant of the first contact change in a step and the switches that change, or the end and None."""
    from scipy.optimize import brentq

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
        instants[j] = brentq(gap, times[k], times[k + 1], xtol=1e-300, rtol=4.0 * np.finfo(float).eps)
    return float(instants.min()), instants <= instants.min() + small


def _gaps(motion: Flow, law: Contacts, dense, times):
    return law.gaps(motion.split(dense(times))[2].T, times[:, None] * motion.frequency)
