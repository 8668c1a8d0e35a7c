"""Periodic solutions by shooting: the start is sought from which the motion returns to itself.

R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., sections 7.1 to 7.4. The derivatives of the
motion by its start are integrated with it; over one period they are the monodromy matrix, which gives the
verdict. Contact forces are continuous, so the derivatives are too at every contact change: no jump has to be
added (R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, section 7.2:
the saltation matrix is the unit matrix). The fixed point of the harmonic equations has its radius at the
lines of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import linalg

from femgear.errors import CaseError, FemgearError, checked_count, checked_tolerance
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution, open_verdict, verdict_of
from femgear.solvers.time.adaptive import (
    Flow,
    checked_start,
    flow,
    motion_scale,
    sampled,
    trajectory,
)
from femgear.solvers.time.stroboscopic import common_period
from femgear.solvers.time.transient import solve_transient
from femgear.system.elements import Element
from femgear.system.fourier import harmonics_of, line_tail
from femgear.system.system import HarmonicForce, NonlinearSystem, checked_bases, element_forces

# Stiffness and damping of a motion, relative to the largest, that count as none.
_FREE = 1e-11
# Directions that the map changes by less than this share of the strongest one are left as they are.
_SINGULAR = 1e-11
# So are those that it changes by less than this many tolerances of the integrator: rounding, not stiffness.
_ROUNDING = 100.0
# Steps of the integrator in one segment, more of which a motion of interest does not need.
_MOST_STEPS = 50_000


@dataclass(frozen=True)
class ShootingSolution:
    """A periodic motion, its start and its multipliers.

    Parameters
    ----------
    solution : PeriodicSolution
        Lines of the deflections and forces; ``residual`` is the relative distance of start and end, the
        spectral radius of the fixed point is that of the lines. Where the system has no such fixed point
        (nothing holds it at its reference stiffness) the radius is nan and the message says so.
    period : float
        [s].
    displacement, velocity : (n,) arrays
        At the start of the period.
    monodromy : (2n, 2n) array
        Derivatives of (q, v / rate) after the period by those at its start.
    multipliers : (2n,) complex array
        Its eigenvalues, the largest modulus first; those of free motions are among them.
    time : (n_samples,) array
        Equidistant instants of one period.
    motion : (n_samples, n) array
        Displacements there.
    """

    solution: PeriodicSolution
    period: float
    displacement: np.ndarray
    velocity: np.ndarray
    monodromy: np.ndarray
    multipliers: np.ndarray
    time: np.ndarray
    motion: np.ndarray

    @property
    def verdict(self) -> FloquetVerdict:
        """That of the solution, from the monodromy matrix here."""
        return self.solution.verdict

    @property
    def stable(self) -> bool | None:
        """No multiplier lies outside the unit circle by more than 1e-6; None for a motion not converged."""
        return self.solution.stable


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
    radius : bool
        Whether the spectral radius of the fixed point is computed; the verdict always is.
    """

    harmonics: int = 20
    samples: int = 2048
    integration: float = 1e-11
    tolerance: float = 1e-9
    max_iterations: int = 30
    radius: bool = True

    def __post_init__(self):
        for name in ("tolerance", "integration"):
            object.__setattr__(self, name, checked_tolerance(getattr(self, name), name))
        most = checked_count(self.max_iterations, "max_iterations", code="E-RANGE")
        object.__setattr__(self, "max_iterations", most)
        if self.harmonics < 1 or self.samples < 4 * self.harmonics:
            raise CaseError(
                f"{self.harmonics} harmonics, {self.samples} samples", code="E-RANGE",
                limit="a harmonic or more, four samples a harmonic or more",
            )  # fmt: skip

    def integrator(self, moving: Flow, start) -> dict[str, Any]:
        """Options of `trajectory` for motions of the size of a start."""
        scale = motion_scale(moving, start)
        return {"tolerance": self.integration, "events": True, "max_steps": _MOST_STEPS, "scale": scale}


def solve_shooting(
    problem: NonlinearSystem,
    frequency,
    *,
    start=None,
    periods: int = 1,
    segments: int = 1,
    settle: int = 20,
    **options,
) -> ShootingSolution:
    """Find a forced periodic motion by Newton iterations on its start.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float or (n_bases,) array
        Base frequencies [rad/s]; all must be multiples of the first over ``periods``.
    start : pair of (n,) arrays, optional
        First guess; without one the motion ``settle`` periods after rest.
    periods : int
        Periods of the first base frequency that make one period of the motion.
    segments : int
        Pieces of the period whose starts are all unknown: multiple shooting, for motions that grow fast.
    settle : int
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
    period = common_period(frequency, periods)
    segments = checked_count(segments, "segments", code="E-RANGE")
    start = checked_start(problem, _settled(problem, frequency, period, settle) if start is None else start)
    moving = flow(problem, frequency, variational=True)
    unknowns = _guess(moving, start, period, segments, chosen.integration)
    integrator = chosen.integrator(moving, start)
    history, stuck = [], False
    while True:
        ends, maps = _shoot(moving, unknowns, period, integrator)
        defect = ends - np.roll(unknowns, -1, axis=0)
        size = max(_size(unknowns), np.finfo(float).tiny)
        history.append(float(np.abs(defect).max() / size))
        if history[-1] <= chosen.tolerance or len(history) > chosen.max_iterations:
            break
        update, out_of_reach = _update(maps, defect, _ROUNDING * chosen.integration)
        stuck = out_of_reach > 0.5 and bool(np.abs(update).max() <= chosen.tolerance * size)
        if stuck:
            break
        unknowns = _improved(moving, unknowns, update, np.abs(defect).max(), period, integrator)
    whole = np.linalg.multi_dot(maps[::-1]) if segments > 1 else maps[0]
    found = _result(moving, unknowns[0], whole, period, chosen, integrator, history, stuck=stuck)
    return _judged(moving, found, chosen)


def _verdict(
    problem: NonlinearSystem, found: ShootingSolution, *, error: float, trivial: int
) -> FloquetVerdict:
    """Verdict of the monodromy matrix, of relative error ``error``, without ``trivial`` multipliers one.

    Free motions that neither stiffness, damping nor a column feels have a double multiplier one, which
    rounding splits; they are left out (as `floquet.floquet_verdicts` does). Of those that damping feels the
    position has the multiplier one and is left out, the velocity counts.
    """
    matrix, positions = _without_free_motions(problem, found.monodromy)
    return verdict_of(
        np.linalg.eigvals(matrix), found.period, "shooting", error, np.inf, positions=trivial + positions,
        velocities=positions,
    )  # fmt: skip


def _radius(problem: NonlinearSystem, turns, omega: float, lines: np.ndarray) -> tuple[float, str]:
    """Spectral radius of the fixed point at lines (n_columns, L) [m] of a motion of ``omega`` [rad/s]; nan
    and the reason where there is none. Base frequencies are ``turns`` (n_bases,) times that of the motion.
    """
    try:
        balance = harmonic_balance(_on_one_base(problem, turns), orders=np.arange(lines.shape[1])[:, None])
        return balance.spectral_radius(balance.unknowns(lines), [omega]), ""
    except FemgearError as error:
        return np.nan, f"; no spectral radius of a fixed point: {error.message}"


def _on_one_base(problem: NonlinearSystem, turns) -> NonlinearSystem:
    """The problem over one base frequency of which the given ones are the multiples ``turns`` (n_bases,)."""
    turns = tuple(int(turn) for turn in turns)
    if turns == (1,):
        return problem
    forces = tuple(
        HarmonicForce(force.force, (sum(o * turn for o, turn in zip(force.orders, turns)),))
        for force in problem.forces
    )
    return replace(
        problem, elements=tuple(_Turned(element, turns) for element in problem.elements), forces=forces
    )


@dataclass(frozen=True)
class _Turned:
    """An element whose base phases are multiples ``turns`` of a single one."""

    element: Element
    turns: tuple[int, ...]

    @property
    def columns(self) -> np.ndarray:
        return self.element.columns

    @property
    def reference(self) -> np.ndarray:
        return self.element.reference

    def evaluate(self, x, theta):
        return self.element.evaluate(x, np.asarray(theta, float) * np.array(self.turns, float))


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
    found = solve_transient(problem, frequency, times, start=rest, step=period / 200.0)
    return found.displacement[-1], found.velocity[-1]


def _guess(moving: Flow, start, period, segments, integration) -> np.ndarray:
    """States (segments, 2n) at the starts of the segments, along the motion from the first one."""
    plain = replace(moving, variational=False)
    y = plain.state(*start)
    scale, out = motion_scale(plain, start), [y]
    for k in range(segments - 1):
        span = period * k / segments, period * (k + 1) / segments
        steps = trajectory(plain, y, *span, tolerance=max(integration, 1e-8), events=True, scale=scale)
        y = sampled(steps, np.array(span[1:]), y)[0][0]
        out.append(y)
    return np.array(out)


def _shoot(moving: Flow, unknowns, period, options):
    """Ends (segments, 2n) of the segments and their derivatives (segments, 2n, 2n)."""
    count, size = unknowns.shape
    ends, maps = [], []
    for k, y in enumerate(unknowns):
        state = np.column_stack([y, np.eye(size)]).ravel() if moving.variational else y
        span = period * k / count, period * (k + 1) / count
        end, _ = sampled(trajectory(moving, state, *span, **options), np.array(span[1:]), state)
        end = end[0]
        ends.append(end.reshape(size, -1)[:, 0])
        maps.append(moving.tangents(end) if moving.variational else None)
    return np.array(ends), maps


def _update(maps, defect, rounding):
    """Newton step (segments, 2n): ``maps[k] d_k - d_{k+1} = -defect_k``, cyclic; the share it leaves over."""
    count, size = defect.shape
    matrix = np.zeros((count * size, count * size))
    for k, part in enumerate(maps):
        rows, following = slice(k * size, (k + 1) * size), (k + 1) % count
        matrix[rows, rows] += part
        matrix[rows, following * size : (following + 1) * size] -= np.eye(size)
    left, value, right = np.linalg.svd(matrix)
    # lstsq has no absolute bound, and here the whole matrix may be rounding
    kept = value > max(_SINGULAR * value[0], rounding)
    step = -right[kept].T @ ((left[:, kept].T @ defect.ravel()) / value[kept])
    wanted = np.linalg.norm(defect)
    over = np.linalg.norm(matrix @ step + defect.ravel()) / wanted if wanted else 0.0
    return step.reshape(count, size), float(over)


def _improved(moving: Flow, unknowns, update, before, period, options):
    """The Newton step, halved until the defect gets smaller; integrated without derivatives."""
    plain, share = replace(moving, variational=False), 1.0
    for _ in range(8):
        tried = unknowns + share * update
        ends, _ = _shoot(plain, tried, period, options)
        if np.abs(ends - np.roll(tried, -1, axis=0)).max() < before:
            return tried
        share *= 0.5
    return unknowns + update


def _size(state) -> float:
    return float(np.abs(state).max())


def _result(
    moving: Flow, y, monodromy, period: float, chosen: ShootingOptions, integrator, history, *, stuck=False
) -> ShootingSolution:
    """Lines of the motion from the state ``y`` (2n,) on."""
    plain, samples = replace(moving, variational=False), chosen.samples
    # the period of the frequency that the solution names
    omega = 2.0 * np.pi / period
    period = 2.0 * np.pi / omega
    times = period * np.arange(samples) / samples
    found, _ = sampled(trajectory(plain, y, 0.0, period, **integrator), times, y)
    q, v, x = (part.T for part in plain.split(found.T))
    force = element_forces(moving.problem, x, times[:, None] * moving.frequency)[0]
    deflection, forces = harmonics_of(x.T, chosen.harmonics), harmonics_of(force.T, chosen.harmonics)
    converged = history[-1] <= chosen.tolerance
    message = "the motion returns to its start" if converged else (
        f"after {len(history) - 1} iterations start and end differ by {history[-1]:.2g} of the motion: "
        "give a better start, or more segments"
    )  # fmt: skip
    if stuck and not converged:
        message = (
            f"no start returns: a period changes the motion by {history[-1]:.2g} of it where "
            "monodromy - 1 is singular; give some damping, balance free loads or move the frequency"
        )
    orders = np.arange(chosen.harmonics + 1)[:, None]
    solution = PeriodicSolution(
        frequency=np.array([omega]), orders=orders, deflection=deflection, force=forces,
        converged=converged, residual=history[-1], iterations=len(history) - 1,
        factorisations=len(history) - 1 + stuck, message=message,
        tail=line_tail(deflection, orders, rounding=10.0 * chosen.tolerance), history=tuple(history),
    )  # fmt: skip
    values = np.linalg.eigvals(monodromy)
    return ShootingSolution(
        solution, period, q[0], v[0], monodromy, values[np.argsort(-np.abs(values))], times, q
    )


def _judged(
    moving: Flow, found: ShootingSolution, chosen: ShootingOptions, *, trivial: int = 0
) -> ShootingSolution:
    """The motion with its verdict, without ``trivial`` multipliers, and the radius at its lines."""
    solution, problem = found.solution, moving.problem
    told: dict[str, Any] = {"verdict": open_verdict("not covered: the solution did not converge")}
    if solution.converged:
        told["verdict"] = _verdict(problem, found, error=chosen.integration, trivial=trivial)
    if chosen.radius:
        omega = float(solution.frequency[0])
        turns = np.rint(moving.frequency / omega).astype(int)
        value, note = _radius(problem, turns, omega, solution.deflection)
        told |= {"spectral_radius": value, "message": solution.message + note}
    return replace(found, solution=replace(solution, **told))
