"""Motion in time of a system with nonlinear elements: one call for steps and for adaptive integration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, checked_numbers, checked_tolerance
from femgear.solvers.time import adaptive
from femgear.solvers.time.adaptive import checked_start, motion_scale
from femgear.solvers.time.steps import (
    RULES,
    ModalScheme,
    RuleScheme,
    Scheme,
    StepRule,
    generalised_alpha,
    highest_frequency,
    march_times,
    stability_limit,
)
from femgear.system.system import (
    NonlinearSystem,
    checked_bases,
    drift_note,
    element_forces,
    freeze,
    tabulated_law,
)

# Steps in the shortest natural period when no step is given: average acceleration errs by 0.2 % of it.
_STEPS_A_PERIOD = 40
# Largest local error of a step, relative to the motion, that goes without a word.
_COARSE = 1e-3
# Local error of a step, relative to the motion, above which there is no solution.
_WRONG = 1.0
# Phases at which the largest mesh stiffness is looked for.
_PHASES = 256
# Largest residual of the column equations in a step, local error of the adaptive methods, Newton iterations.
_COLUMNS, _LOCAL, _ITERATIONS = 1e-10, 1e-9, 30
METHODS = (*RULES, "newmark", "generalised alpha", "modal", *adaptive.METHODS)


@dataclass(frozen=True)
class TransientResponse:
    """Motion at the instants asked for.

    Parameters
    ----------
    time : (n_times,) array
        [s].
    displacement, velocity : (n_times, n) arrays
        [m, m/s]; not a number after a step that did not converge.
    deflection, force : (n_times, n_columns) arrays
        ``W^T q`` [m] and the forces of the elements [N].
    method : str
        Rule of the steps, or method of the adaptive integrator.
    converged : bool
        Every step converged, and none errs by more than the whole motion (``error`` up to 1). A free system
        whose load is not balanced converges too: the message says that its mean drifts.
    residual : float
        Largest violation of the column equations relative to the deflections; zero for explicit methods.
    error : float
        Largest estimated local error of a step relative to the amplitude of the motion, in the norm of the
        mass matrix; the tolerance for adaptive methods.
    steps : int
        Steps taken.
    iterations : int
        Newton iterations of all steps, zero for adaptive methods.
    factorisations : int
        Matrices factorised on the way.
    message : str
        How the integration ended, and whether the mean of the motion drifts.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    method: str
    converged: bool
    residual: float
    error: float
    steps: int
    iterations: int
    factorisations: int
    message: str

    def __post_init__(self):
        freeze(self)


def solve_transient(
    problem: NonlinearSystem,
    frequency,
    times,
    *,
    start=None,
    method: str = "average acceleration",
    step: float | None = None,
    tolerance: float | None = None,
    events: bool = False,
    **parameters,
) -> TransientResponse:
    """Integrate the motion in time from ``times[0]`` on.

    Parameters
    ----------
    frequency : float or (n_bases,) array
        Base frequencies of the elements and forces [rad/s]; the phases are zero at time zero.
    times : (n_times,) array
        Ascending instants at which the motion is wanted [s]; the first is the start.
    start : pair of (n,) arrays, optional
        Displacement [m] and velocity [m/s] at the start; at rest without deflection when not given.
    method : str
        "average acceleration", "linear acceleration", "Fox-Goodwin", "central difference", "newmark",
        "generalised alpha", "modal" (exact linear part), see `steps`, or SciPy's "DOP853", "Radau", "LSODA".
    step : float, optional
        Of the fixed-step methods [s], shortened to divide the time evenly; a 40th of the shortest natural
        period when not given. Between steps a cubic of displacements and velocities is used.
    tolerance : float, optional
        Relative: of the column equations in a step (1e-10 when not given) or of the local error (1e-9).
    events : bool
        Adaptive methods stop at contact changes, see `adaptive`.
    parameters
        Of a fixed-step method: ``gamma``, ``beta``, ``radius``, ``count``, see `step_scheme`.

    Raises
    ------
    CaseError
        A step beyond the stability limit, instants that do not ascend, unknown methods, a start that
        does not fit (E-START), more base frequencies than the problem has (E-RANGE).
    ConvergenceError
        A mass matrix that is not positive definite, an adaptive integrator that gives up.
    """
    times = checked_numbers(times, "times", code="E-RANGE", unit="s").copy()
    if times.ndim != 1 or len(times) < 2 or not np.all(np.isfinite(times)) or np.any(np.diff(times) <= 0.0):
        raise CaseError("instants must be finite and ascend", code="E-RANGE", key="times", limit="two instants or more")
    if tolerance is not None:
        tolerance = checked_tolerance(tolerance)
    start = checked_start(problem, start)
    frequency = checked_bases(problem, frequency)
    if method in adaptive.METHODS:
        if parameters:
            raise CaseError(f"method {method} has no {', '.join(parameters)}", code="E-CHOICE", key="method")
        return _adaptive(problem, frequency, times, start, method, tolerance or _LOCAL, events)
    if events:
        raise CaseError(
            f"method {method} steps over contact changes",
            code="E-CHOICE",
            key="events",
            limit=", ".join(adaptive.METHODS),
            remedy="take an adaptive method",
        )
    scheme, number = step_scheme(problem, frequency, method, times[-1] - times[0], step, **parameters)
    return _stepped(problem, scheme, frequency, times, start, number, method, tolerance or _COLUMNS)


def step_scheme(
    problem: NonlinearSystem,
    frequency,
    method: str,
    span: float,
    step: float | None = None,
    *,
    gamma: float = 0.5,
    beta: float = 0.25,
    radius: float = 0.8,
    count: int | None = None,
) -> tuple[Scheme, int]:
    """Make the scheme of a fixed-step method, factorised, and count its steps in a span [s].

    CaseError: an unknown method (E-CHOICE), a step that is not positive or beyond the stability limit
    (E-RANGE).

    Parameters
    ----------
    problem, frequency, method, step
        As for `solve_transient`.
    span : float
        Time that the steps divide evenly [s].
    gamma, beta : float
        Of "newmark".
    radius : float
        Spectral radius at infinite frequency of "generalised alpha".
    count : int, optional
        Modes of "modal"; all when not given.
    """
    made = {"newmark": lambda: StepRule(gamma, beta), "generalised alpha": lambda: generalised_alpha(radius)}
    if method not in RULES and method not in made and method != "modal":
        raise CaseError(f"no method {method}", code="E-CHOICE", key="method", limit=", ".join(METHODS))
    rule = made[method]() if method in made else RULES.get(method)
    number, step = _steps(problem, np.atleast_1d(frequency), rule, span, step)
    if rule is None:
        return ModalScheme(problem, step, count=count), number
    return RuleScheme(problem, rule, step), number


def _column_stiffness(problem: NonlinearSystem, frequency) -> np.ndarray:
    """Largest stiffness (n_columns,) [N/m] of every column over the phases of the base frequencies.

    Elements count with what they call steepest, meshes with the top of k(t), others as their reference.
    """
    turns = np.random.default_rng(0).random((_PHASES, len(np.atleast_1d(frequency))))
    turns[:, 0] = np.arange(_PHASES) / _PHASES
    total = np.zeros(problem.system.W.shape[1])
    for element in problem.elements:
        steepest = getattr(element, "steepest", lambda _, element=element: element.reference)
        np.add.at(total, element.columns, steepest(2.0 * np.pi * turns))
    return total


def _steps(problem, frequency, rule, span, step) -> tuple[int, float]:
    """Number and length of the steps; refuses a length beyond the stability limit of the rule."""
    highest = highest_frequency(problem, _column_stiffness(problem, frequency))
    period = 2.0 * np.pi / highest if highest else np.inf
    if step is None:
        fastest = max(highest, np.abs(frequency).max(initial=0.0))
        step = 2.0 * np.pi / fastest / _STEPS_A_PERIOD if fastest else span / 100.0
    step = checked_numbers(step, "step", code="E-RANGE", unit="s").item()
    if not (np.isfinite(step) and step > 0.0):
        raise CaseError(f"a time step of {step} s", code="E-RANGE", key="step", limit="above 0 s")
    number = max(1, int(np.ceil(span / step * (1.0 - 1e-12))))
    step = span / number
    limit = np.inf if rule is None else stability_limit(rule)
    if step > limit * period:
        raise CaseError(
            f"a step of {step:.6g} s is {step / period:.4g} of the shortest natural period, {period:.6g} s",
            code="E-RANGE",
            key="step",
            limit=f"h / T up to {limit:.4g}, {limit * period:.6g} s",
            remedy="shorten the step, or take average acceleration, which is stable for any",
        )
    return number, step


def _stepped(problem, scheme: Scheme, frequency, times, start, number, method, tolerance) -> TransientResponse:
    """March with a fixed step and interpolate at the instants."""
    begin, step = times[0], scheme.step
    first = begin * frequency[None]
    state, g = scheme.start(start[0], start[1], first, tabulated_law(problem, first))
    # where each instant lies: in which step, and where in it
    place = np.clip((times - begin) / step, 0.0, number)
    near = np.rint(place)
    place = np.where(np.abs(place - near) < 1e-9 * np.maximum(near, 1.0), near, place)
    index = np.minimum(place.astype(int), number - 1)
    q, v = (np.full((len(times), len(start[0])), np.nan) for _ in range(2))
    x = np.full((len(times), len(g)), np.nan)
    steps = iterations = 0
    residual = error = size = 0.0
    for done, block, theta in march_times(
        problem,
        scheme,
        frequency,
        state,
        g,
        begin=begin,
        step=step,
        count=number,
        tolerance=tolerance,
        max_iterations=_ITERATIONS,
    ):
        computed = slice(0, block.steps + 1)
        states, excess, theta = block.states[computed], block.excess[computed], theta[computed]
        inside = (index >= done) & (index < done + block.steps)
        if np.any(inside):
            motion = scheme.motion(states, excess, theta)
            at = place[inside] - done
            q[inside], v[inside] = _between(at, motion, step)
            x[inside] = _columns(problem, scheme, states, excess, theta, at, q[inside])
        if block.steps:
            error = max(error, float(scheme.local_error(states, excess).max()))
            # the instants asked for may all lie at one phase: the size is that of all steps
            size = max(size, _amplitude(problem, scheme.motion(states, excess, theta)[0]))
        steps, iterations = steps + block.steps, iterations + block.iterations
        residual = max(residual, block.residual)
    theta = times[:, None] * frequency
    force = element_forces(problem, x, theta)[0]
    relative = error / size if size else 0.0
    converged, message = _verdict(steps, number, begin + steps * step, relative, step)
    message += drift_note(problem) if converged else ""
    return TransientResponse(
        times,
        q,
        v,
        x,
        force,
        method,
        converged,
        residual,
        relative,
        steps,
        iterations,
        scheme.factorisations,
        message,
    )


def _between(at, motion, step) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity at fractional steps, cubic in q and v; in v and a where a is known."""
    q, v, a = motion
    k = np.minimum(at.astype(int), len(q) - 2)
    s = (at - k)[:, None]

    def cubic(value, slope):
        rise = value[k + 1] - value[k]
        left, right = step * slope[k], step * slope[k + 1]
        inner = s * (1.0 - s) * ((1.0 - s) * (left - rise) + s * (rise - right))
        return np.where(s == 1.0, value[k + 1], value[k] + s * rise + inner)

    if a is not None:
        return cubic(q, v), cubic(v, a)
    return cubic(q, v), (1.0 - s) * v[k] + s * v[k + 1]


def _columns(problem, scheme, states, excess, theta, at, q) -> np.ndarray:
    """Deflections at fractional steps; at the steps themselves those that the rule has solved for."""
    on_step = at == np.rint(at)
    x = q @ problem.system.W
    if np.any(on_step):
        k = at[on_step].astype(int)
        x[on_step] = scheme.columns(states[k], excess[k], theta[k])
    return x


def _amplitude(problem, q) -> float:
    """Largest distance from the mean displacement, in the norm of the mass matrix."""
    q = q[np.all(np.isfinite(q), axis=1)]
    if not len(q):
        return 0.0
    away = q - q.mean(axis=0)
    return float(np.sqrt(np.einsum("ti,ij,tj->t", away, problem.system.M, away, optimize=True).max()))


def _verdict(steps, number, time, error, step) -> tuple[bool, str]:
    """Whether a motion counts as converged, and what happened."""
    message = "every step converged"
    errs = f"a step errs by {error:.2g} of the motion"
    if steps < number:
        message = (
            f"the column equations did not converge in the step after {time:.6g} s: shorten the step of "
            f"{step:.3g} s or smooth the contact"
        )
    elif not error <= _WRONG:
        message = f"too coarse: {errs}; shorten the step of {step:.3g} s"
    elif error > _COARSE:
        message = f"coarse: {errs}; a shorter step than {step:.3g} s is better"
    return steps == number and error <= _WRONG, message


def _adaptive(problem, frequency, times, start, method, tolerance, events) -> TransientResponse:
    motion = adaptive.flow(problem, frequency)
    y = motion.state(*start)
    options = {"tolerance": tolerance, "events": events, "scale": motion_scale(motion, start)}
    pieces = adaptive.trajectory(motion, y, times[0], times[-1], method=method, **options)
    states, steps = adaptive.sampled(pieces, times, y)
    q, v, x = (part.T for part in motion.split(states.T))
    force = element_forces(problem, x, times[:, None] * frequency)[0]
    return TransientResponse(
        times,
        q,
        v,
        x,
        force,
        method,
        True,
        0.0,
        tolerance,
        steps,
        0,
        1,
        f"{method} with a relative tolerance of {tolerance:.3g}" + drift_note(problem),
    )
