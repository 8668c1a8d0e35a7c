"""Periodic solutions by shooting: the start is sought from which the motion returns to itself.

R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., sections 7.1 to 7.4. The derivatives of the
motion by its start are integrated with it; over one period they are the monodromy matrix, which gives the
verdict. Contact forces are continuous, so the derivatives are too at every contact change: no jump has to be
added (R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, section 7.2:
the saltation matrix is the unit matrix).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import linalg

from femgear.errors import CaseError, checked_count, checked_tolerance
from femgear.solvers.periodic.solution import PeriodicSolution, of_solution, open_verdict, verdict_of
from femgear.solvers.time.adaptive import Flow, checked_start, flow, motion_scale, sampled, trajectory
from femgear.solvers.time.stroboscopic import strobe_period
from femgear.solvers.time.transient import solve_transient
from femgear.system.fourier import harmonics_of, line_tail
from femgear.system.system import NonlinearSystem, checked_bases, element_forces

# Stiffness and damping of a motion, relative to the largest, that count as none.
_FREE = 1e-11
# Directions that the map changes by less than this share of the strongest one are left as they are.
SINGULAR = 1e-11
# So are those that it changes by less than this many tolerances of the integrator: rounding, not stiffness.
_ROUNDING = 100.0
# Steps of the integrator in one period, more of which a motion of interest does not need.
_MOST_STEPS = 50_000


@dataclass(frozen=True)
class ShootingSolution:
    """A periodic motion, its start and its multipliers.

    Parameters
    ----------
    solution : PeriodicSolution
        Lines of the deflections and forces; ``residual`` is the relative distance of start and end. No fixed
        point is iterated, so that there is no spectral radius.
    period : float
        [s].
    displacement, velocity : (n,) arrays
        At the start of the period [m, m/s].
    monodromy : (2n, 2n) array
        Derivatives of (q, v / rate) after the period by those at its start.
    multipliers : (2n,) complex array
        Its eigenvalues, the largest modulus first; those of free motions are among them.
    time : (n_samples,) array
        Equidistant instants of one period [s].
    motion : (n_samples, n) array
        Displacements there [m].
    """

    solution: PeriodicSolution
    period: float
    displacement: np.ndarray
    velocity: np.ndarray
    monodromy: np.ndarray
    multipliers: np.ndarray
    time: np.ndarray
    motion: np.ndarray

    verdict = of_solution("verdict", "From the monodromy matrix here.")
    stable = of_solution("stable", "No multiplier lies outside the unit circle; None where not converged.")


@dataclass(frozen=True)
class ShootingOptions:
    """Accuracy of shooting and what its result holds.

    Parameters
    ----------
    harmonics : int
        Lines of the result, of the period.
    samples : int
        Instants from which the lines are computed.
    integration : float
        Tolerance of the integrator, which stops at contact changes.
    tolerance : float
        Of the distance between start and end, relative to the size of the motion.
    max_iterations : int
        Newton iterations at most.
    """

    harmonics: int = 20
    samples: int = 2048
    integration: float = 1e-11
    tolerance: float = 1e-9
    max_iterations: int = 30

    def __post_init__(self):
        for name in ("tolerance", "integration"):
            object.__setattr__(self, name, checked_tolerance(getattr(self, name), name))
        most = checked_count(self.max_iterations, "max_iterations", code="E-RANGE")
        object.__setattr__(self, "max_iterations", most)
        if self.harmonics < 1 or self.samples < 4 * self.harmonics:
            raise CaseError(
                f"{self.harmonics} harmonics, {self.samples} samples",
                code="E-RANGE",
                limit="a harmonic or more, four samples a harmonic or more",
            )

    def integrator(self, moving: Flow, start) -> dict[str, Any]:
        """Make the options of `trajectory` for motions of the size of a start, (n,) [m] and (n,) [m/s]."""
        scale = motion_scale(moving, start)
        return {"tolerance": self.integration, "events": True, "max_steps": _MOST_STEPS, "scale": scale}


def solve_shooting(
    problem: NonlinearSystem, frequency, *, start=None, periods: int = 1, settle: int = 20, **options
) -> ShootingSolution:
    """Find a forced periodic motion by Newton iterations on its displacement [m] and velocity [m/s].

    Parameters
    ----------
    frequency : float or (n_bases,) array
        Base frequencies [rad/s]; all must be multiples of the first over ``periods``.
    start : pair of (n,) arrays, optional
        First guess [m, m/s]; without one the motion ``settle`` periods after rest.
    periods : int
        Periods of the first base frequency that make one period of the motion.
    options
        Fields of `ShootingOptions`.

    Returns
    -------
    ShootingSolution
        ``solution.converged`` is false, and its message says so, where the iterations end without success.
        Rigid motions stay where the first guess has them. No solution exists where ``monodromy - 1`` is
        singular to the accuracy of the integrator and does not reach the defect: an undamped linear resonance
        or a free system out of balance (Seydel, section 7.2); the iterations end there.

    Raises
    ------
    CaseError
        Frequencies without the common period or more of them than the problem has (E-RANGE), numbers
        out of range (tolerances: E-RANGE), a start that does not fit (E-START).
    """
    frequency, chosen = checked_bases(problem, frequency), ShootingOptions(**options)
    period = strobe_period(frequency, periods)
    start = checked_start(problem, _settled(problem, frequency, period, settle) if start is None else start)
    moving = flow(problem, frequency, variational=True)
    y = replace(moving, variational=False).state(*start)
    integrator = chosen.integrator(moving, start)
    history, stuck = [], False
    while True:
        end, monodromy = shoot(moving, y, period, integrator)
        defect = end - y
        size = max(float(np.abs(y).max()), np.finfo(float).tiny)
        history.append(float(np.abs(defect).max() / size))
        if history[-1] <= chosen.tolerance or len(history) > chosen.max_iterations:
            break
        update, out_of_reach = _update(monodromy, defect, _ROUNDING * chosen.integration)
        stuck = out_of_reach > 0.5 and bool(np.abs(update).max() <= chosen.tolerance * size)
        if stuck:
            break
        y = _improved(moving, y, update, np.abs(defect).max(), period, integrator)
    result = _result(moving, y, monodromy, period, chosen, integrator, history, stuck=stuck)
    return _judged(moving, result, chosen)


def _without_free_motions(problem: NonlinearSystem, monodromy: np.ndarray) -> tuple[np.ndarray, int]:
    """The monodromy matrix on the motions that are orthogonal in mass to those that nothing feels.

    With it the number of free motions left in it, whose velocities damping feels.
    """
    system, n = problem.system, len(problem.system.M)
    root = np.linalg.cholesky(system.M)

    def carried(rows):
        # in coordinates of unit mass, over its own size: stiffness, damping and columns count alike
        rows = linalg.solve_triangular(root, rows.T, lower=True).T
        return rows / (np.abs(rows).max(initial=0.0) or 1.0)

    held = np.vstack([carried(rows) for rows in (system.K, system.W.T)])
    damped = [carried(rows) for rows in (system.K.T, problem.damping, problem.damping.T)]
    _, size, right = np.linalg.svd(np.vstack([held, *damped]))
    rank = int(np.sum(size > _FREE * size[0])) if len(size) else 0
    size = np.linalg.svd(held, compute_uv=False)
    positions = rank - int(np.sum(size > _FREE * size.max(initial=0.0)))
    if rank == n:
        return monodromy, positions
    moving = right[:rank]
    # q = L^-T z and z = L^T q with M = L L^T; the moving part of z is closed in itself
    back = linalg.solve_triangular(root, moving.T, lower=True, trans=1)
    there, here = np.kron(np.eye(2), moving @ root.T), np.kron(np.eye(2), back)
    return there @ monodromy @ here, positions


def _settled(problem, frequency, period, settle):
    """Motion ``settle`` periods after rest at the static deflection, by average acceleration."""
    system = problem.system
    rest = np.linalg.lstsq(problem.stiffness, system.load, rcond=1e-12)[0], np.zeros(len(system.M))
    if not settle:
        return rest
    times = np.array([0.0, settle * period])
    motion = solve_transient(problem, frequency, times, start=rest, step=period / 200.0)
    return motion.displacement[-1], motion.velocity[-1]


def shoot(moving: Flow, y, period: float, options) -> tuple[np.ndarray, np.ndarray | None]:
    """Integrate a period [s] from the state y (2n,): its end (2n,), and derivatives (2n, 2n) if followed."""
    state = np.column_stack([y, np.eye(len(y))]).ravel() if moving.variational else y
    times = np.array([period])
    end = sampled(trajectory(moving, state, 0.0, period, **options), times, state)[0][0]
    return end.reshape(len(y), -1)[:, 0], moving.tangents(end) if moving.variational else None


def _update(monodromy, defect, rounding: float) -> tuple[np.ndarray, float]:
    """Newton step (2n,), ``(monodromy - 1) step = -defect``, and the share of the defect left over."""
    matrix = monodromy - np.eye(len(defect))
    left, value, right = np.linalg.svd(matrix)
    # lstsq has no absolute bound, and here the whole matrix may be rounding
    kept = value > max(SINGULAR * value[0], rounding)
    step = -right[kept].T @ ((left[:, kept].T @ defect) / value[kept])
    wanted = np.linalg.norm(defect)
    return step, float(np.linalg.norm(matrix @ step + defect) / wanted) if wanted else 0.0


def _improved(moving: Flow, y, update, before, period, options):
    """The Newton step, halved until the defect gets smaller; integrated without derivatives."""
    plain, share = replace(moving, variational=False), 1.0
    for _ in range(8):
        tried = y + share * update
        if np.abs(shoot(plain, tried, period, options)[0] - tried).max() < before:
            return tried
        share *= 0.5
    return y + update


def _result(
    moving: Flow, y, monodromy, period: float, chosen: ShootingOptions, integrator, history, *, stuck=False
) -> ShootingSolution:
    """Lines of the motion from the state ``y`` (2n,) on."""
    plain, samples = replace(moving, variational=False), chosen.samples
    # the period of the frequency that the solution names
    omega = 2.0 * np.pi / period
    period = 2.0 * np.pi / omega
    times = period * np.arange(samples) / samples
    states, _ = sampled(trajectory(plain, y, 0.0, period, **integrator), times, y)
    q, v, x = (part.T for part in plain.split(states.T))
    force = element_forces(moving.problem, x, times[:, None] * moving.frequency)[0]
    deflection, forces = harmonics_of(x.T, chosen.harmonics), harmonics_of(force.T, chosen.harmonics)
    converged = history[-1] <= chosen.tolerance
    message = (
        "the motion returns to its start"
        if converged
        else (
            f"after {len(history) - 1} iterations start and end differ by {history[-1]:.2g} of the motion: "
            "give a better start"
        )
    )
    if stuck and not converged:
        message = (
            f"no start returns: a period changes the motion by {history[-1]:.2g} of it where "
            "monodromy - 1 is singular; give some damping, balance free loads or move the frequency"
        )
    orders = np.arange(chosen.harmonics + 1)[:, None]
    solution = PeriodicSolution(
        frequency=np.array([omega]),
        orders=orders,
        deflection=deflection,
        force=forces,
        converged=converged,
        residual=history[-1],
        iterations=len(history) - 1,
        factorisations=len(history) - 1 + stuck,
        message=message,
        tail=line_tail(deflection, orders, rounding=10.0 * chosen.tolerance),
        history=tuple(history),
    )
    values = np.linalg.eigvals(monodromy)
    return ShootingSolution(solution, period, q[0], v[0], monodromy, values[np.argsort(-np.abs(values))], times, q)


def _judged(moving: Flow, result: ShootingSolution, chosen: ShootingOptions, *, trivial: int = 0) -> ShootingSolution:
    """The motion with the verdict of its monodromy matrix, without ``trivial`` multipliers one.

    Free motions that neither stiffness, damping nor a column feels have a double multiplier one, which
    rounding splits; they are left out (as `floquet.floquet_verdicts` does). Of those that damping feels the
    position has the multiplier one and is left out, the velocity counts.
    """
    verdict = open_verdict("not covered: the solution did not converge")
    if result.solution.converged:
        matrix, positions = _without_free_motions(moving.problem, result.monodromy)
        verdict = verdict_of(
            np.linalg.eigvals(matrix),
            result.period,
            "shooting",
            chosen.integration,
            np.inf,
            positions=trivial + positions,
            velocities=positions,
        )
    return replace(result, solution=replace(result.solution, verdict=verdict))
