"""Periodic solutions by shooting: the start is sought from which the motion returns to itself.

R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., sections 7.1 to 7.4; M. Peeters et al.,
Mech. Syst. Signal Process. 23 (2009) 195-216, for free vibrations. The derivatives of the motion by its start
are integrated with it; over one period they are the monodromy matrix, which gives the verdict. Contact forces
are continuous, so the derivatives are too at every contact change: no jump has to be added (R. I. Leine and
H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, section 7.2: the saltation matrix is
the unit matrix). The fixed point of the harmonic equations has its radius at the lines of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, FemgearError, checked_count, checked_numbers, checked_tolerance
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution, open_verdict, verdict_of
from femgear.solvers.time.adaptive import Contacts, Flow, checked_start, flow, motion_scale, trajectory
from femgear.solvers.time.stroboscopic import common_period
from femgear.solvers.time.transient import sampled, solve_transient
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


def solve_shooting(
    problem: NonlinearSystem,
    frequency,
    *,
    start=None,
    periods: int = 1,
    segments: int = 1,
    settle: int = 20,
    harmonics: int = 20,
    samples: int = 2048,
    events: bool = True,
    integration: float = 1e-11,
    tolerance: float = 1e-9,
    max_iterations: int = 30,
    radius: bool = True,
) -> ShootingSolution:
    """Forced periodic motion by Newton iterations on its start.

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
    harmonics : int
        Lines of the result, of the period.
    samples : int
        Instants from which the lines are computed.
    events : bool
        Stop at contact changes, see `adaptive`.
    integration : float
        Tolerance of the integrator.
    tolerance : float
        Of the distance between start and end, relative to the size of the motion.
    max_iterations : int
    radius : bool
        Whether the spectral radius of the fixed point is computed; the verdict always is.

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
        Frequencies without the common period or more of them than the problem has (E-FREQUENCY), numbers
        out of range (tolerances: E-TOLERANCE), a start that does not fit (E-START).
    """
    frequency = checked_bases(problem, frequency)
    tolerance, integration = checked_tolerance(tolerance), checked_tolerance(integration, "integration")
    max_iterations = checked_count(max_iterations, "max_iterations", code="E-TOLERANCE")
    period = common_period(frequency, periods)
    segments = checked_count(segments, "segments", code="E-SHOOTING")
    if harmonics < 1 or samples < 4 * harmonics:
        limit = "a harmonic or more, four samples a harmonic or more"
        raise CaseError(f"{harmonics} harmonics, {samples} samples", code="E-SHOOTING", limit=limit)
    start = checked_start(problem, _settled(problem, frequency, period, settle) if start is None else start)
    moving = flow(problem, frequency, variational=True)
    unknowns = _guess(moving, start, period, segments, integration, events)
    options = _options(moving, start, integration, events)
    history, factorisations, stuck = [], 0, False
    for _ in range(max_iterations + 1):
        ends, maps = _shoot(moving, unknowns, period, options)
        defect = ends - np.roll(unknowns, -1, axis=0)
        size = max(_size(unknowns), np.finfo(float).tiny)
        history.append(float(np.abs(defect).max() / size))
        if history[-1] <= tolerance or len(history) > max_iterations:
            break
        update, out_of_reach = _update(maps, defect, _ROUNDING * integration)
        factorisations += 1
        stuck = out_of_reach > 0.5 and np.abs(update).max() <= tolerance * size
        if stuck:
            break
        unknowns = _improved(moving, unknowns, update, np.abs(defect).max(), period, options)
    whole = np.linalg.multi_dot(maps[::-1]) if segments > 1 else maps[0]
    lines = 2.0 * np.pi / period, harmonics, samples
    found = _result(
        problem, moving, unknowns[0], whole, lines, options, history, tolerance, factorisations, stuck
    )
    return _told(problem, found, moving.frequency, integration, radius)


def solve_free_vibration(
    problem: NonlinearSystem,
    start,
    period: float,
    *,
    fixed: int = 0,
    conservative: bool = True,
    harmonics: int = 20,
    samples: int = 2048,
    events: bool = True,
    integration: float = 1e-12,
    tolerance: float = 1e-10,
    max_iterations: int = 30,
    radius: bool = True,
) -> ShootingSolution:
    """Periodic motion of a system that nothing drives: its period is unknown too.

    Parameters
    ----------
    problem : NonlinearSystem
        Without harmonic forces and without coefficients that change in time.
    start : pair of (n,) arrays
        First guess; the degree of freedom ``fixed`` keeps zero velocity there, which sets the phase.
    period : float
        First guess [s].
    fixed : int
    conservative : bool
        The displacement of ``fixed`` is kept as the amplitude. A limit cycle, which has its own amplitude,
        needs ``False``.
    harmonics, samples, events, integration, tolerance, max_iterations, radius
        As for `solve_shooting`.

    Raises
    ------
    CaseError
        Forces, a period or a ``fixed`` out of range (E-SHOOTING), a start that does not fit (E-START).
    """
    tolerance, integration = checked_tolerance(tolerance), checked_tolerance(integration, "integration")
    period = checked_numbers(period, "period", code="E-SHOOTING", unit="s").item()
    if problem.forces or not (np.isfinite(period) and period > 0.0):
        raise CaseError(
            f"free vibration with {len(problem.forces)} harmonic forces and a period of {period} s",
            code="E-SHOOTING", limit="no forces and a period above 0 s",
        )  # fmt: skip
    n = len(problem.system.M)
    if not 0 <= fixed < n:
        told = f"degree of freedom {fixed} fixed"
        raise CaseError(told, code="E-SHOOTING", key="fixed", limit=f"0 to {n - 1}")
    if start is None:
        raise CaseError(
            "a free vibration without a start", code="E-START", key="start",
            limit=f"displacements and velocities of shape ({n},)", remedy="give a first guess of the motion",
        )  # fmt: skip
    start = checked_start(problem, start)
    moving = flow(problem, 0.0, variational=True)
    y = flow(problem, 0.0).state(*start)
    y[n + fixed] = 0.0
    free = np.setdiff1d(np.arange(2 * n), [n + fixed, fixed] if conservative else [n + fixed])
    options, history = _options(moving, start, integration, events), []
    for _ in range(max_iterations + 1):
        ends, maps = _shoot(moving, y[None], period, options)
        defect = ends[0] - y
        history.append(float(np.abs(defect).max() / _size(y)))
        if history[-1] <= tolerance or len(history) > max_iterations:
            break
        slope = _derivative(moving, ends[0], period)
        matrix = np.column_stack([(maps[0] - np.eye(2 * n))[:, free], slope / moving.rate])
        update = np.linalg.lstsq(matrix, -defect, rcond=_SINGULAR)[0]
        y, period = _closer(moving, y, period, free, update, np.abs(defect).max(), options)
    lines = 2.0 * np.pi / period, harmonics, samples
    found = _result(problem, moving, y, maps[0], lines, options, history, tolerance, len(history) - 1)
    # the phase is free, and so is the amplitude of a conservative system
    return _told(problem, found, moving.frequency, integration, radius, trivial=2 if conservative else 1)


def verdict_of_monodromy(
    problem: NonlinearSystem, monodromy: np.ndarray, period: float, *, error: float, trivial: int = 0
) -> FloquetVerdict:
    """Verdict of a monodromy matrix in (q, v / rate).

    Free motions that neither stiffness, damping nor a column feels have a double multiplier one, which
    rounding splits; they are left out (as `floquet.floquet_verdicts` does). Of those that damping feels the
    position has the multiplier one and is left out, the velocity counts.

    Parameters
    ----------
    problem : NonlinearSystem
    monodromy : (2n, 2n) array
    period : float
        [s]
    error : float
        Relative error of the matrix.
    trivial : int
        Multipliers one of a free vibration, its phase and its amplitude, which are left out too.
    """
    matrix, positions = _without_free_motions(problem, monodromy)
    values = np.linalg.eigvals(matrix)
    found = verdict_of(
        values, period, "shooting", error, np.inf, positions=trivial + positions, velocities=positions
    )
    if trivial:
        note = f", without {trivial} of phase{' and amplitude' if trivial > 1 else ''} that are one"
        found = replace(found, message=found.message + note)
    return found


def radius_of_lines(problem: NonlinearSystem, turns, omega: float, lines: np.ndarray) -> tuple[float, str]:
    """Spectral radius of the fixed point at the lines of a periodic motion; nan and the reason without one.

    Parameters
    ----------
    problem : NonlinearSystem
    turns : (n_bases,) int array
        See `on_one_base`.
    omega : float
        Angular frequency of the motion [rad/s].
    lines : (n_columns, L) complex array
        Mean and harmonics of the deflections [m].
    """
    try:
        balance = harmonic_balance(on_one_base(problem, turns), orders=np.arange(lines.shape[1])[:, None])
        return balance.spectral_radius(balance.unknowns(lines), [omega]), ""
    except FemgearError as error:
        return np.nan, f"; no spectral radius of a fixed point: {error.message}"


def on_one_base(problem: NonlinearSystem, turns) -> NonlinearSystem:
    """The problem over one base frequency of which the given ones are multiples.

    Parameters
    ----------
    problem : NonlinearSystem
    turns : (n_bases,) int array
        The base frequencies over the single one.
    """
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
    from scipy import linalg

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
    back = linalg.solve_triangular(root, moving.T, lower=True, trans="T")
    there, here = np.kron(np.eye(2), moving @ root.T), np.kron(np.eye(2), back)
    return there @ monodromy @ here, positions


def _options(moving: Flow, start, integration, events) -> dict:
    """Options of the integrator; a scale is set only where the integrator has none of its own."""
    options = {"tolerance": integration, "events": events, "max_steps": _MOST_STEPS}
    return options | {"scale": motion_scale(moving, start)}


def _settled(problem, frequency, period, settle):
    """Motion ``settle`` periods after rest at the static deflection, by average acceleration."""
    system = problem.system
    rest = np.linalg.lstsq(problem.stiffness, system.load, rcond=1e-12)[0], np.zeros(len(system.M))
    if not settle:
        return rest
    times = np.array([0.0, settle * period])
    found = solve_transient(problem, frequency, times, start=rest, step=period / 200.0)
    return found.displacement[-1], found.velocity[-1]


def _guess(moving: Flow, start, period, segments, integration, events):
    """States (segments, 2n) at the starts of the segments, along the motion from the first one."""
    plain = replace(moving, variational=False)
    y = plain.state(*start)
    scale, out = motion_scale(plain, start), [y]
    for k in range(segments - 1):
        span = period * k / segments, period * (k + 1) / segments
        steps = trajectory(plain, y, *span, tolerance=max(integration, 1e-8), events=events, scale=scale)
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


def _closer(moving: Flow, y, period, free, update, before, options):
    """The Newton step in state and period, halved until the defect gets smaller."""
    plain = replace(moving, variational=False)
    # a change of the period by half would shoot at another motion
    share = min(1.0, 0.3 * period * moving.rate / max(abs(update[-1]), 1e-300))
    for _ in range(8):
        tried, longer = y.copy(), period + share * update[-1] / moving.rate
        tried[free] += share * update[:-1]
        ends, _ = _shoot(plain, tried[None], longer, options)
        if np.abs(ends[0] - tried).max() < before:
            break
        share *= 0.5
    return tried, longer


def _size(state) -> float:
    return float(np.abs(state).max())


def _derivative(moving: Flow, y, time):
    """``dy/dt`` of the state without derivatives."""
    law = Contacts(moving.problem.elements, moving.problem.system.W.shape[1])
    return replace(moving, variational=False).derivative(law)(time, y)


def _result(
    problem, moving, y, monodromy, lines, options, history, tolerance, factorisations, stuck=False
):  # fmt: skip
    """Lines of the motion from ``y`` on."""
    omega, harmonics, samples = lines
    period, plain = 2.0 * np.pi / omega, replace(moving, variational=False)
    times = period * np.arange(samples) / samples
    found, _ = sampled(trajectory(plain, y, 0.0, period, **options), times, y)
    q, v, x = (part.T for part in plain.split(found.T))
    force = element_forces(problem, x, times[:, None] * moving.frequency)[0]
    deflection, forces = harmonics_of(x.T, harmonics), harmonics_of(force.T, harmonics)
    converged = history[-1] <= tolerance
    message = "the motion returns to its start" if converged else (
        f"after {len(history) - 1} iterations start and end differ by {history[-1]:.2g} of the motion: "
        "give a better start, or more segments"
    )  # fmt: skip
    if stuck and not converged:
        message = (
            f"no start returns: a period changes the motion by {history[-1]:.2g} of it where "
            "monodromy - 1 is singular; give some damping, balance free loads or move the frequency"
        )
    orders = np.arange(harmonics + 1)[:, None]
    solution = PeriodicSolution(
        frequency=[omega], orders=orders, deflection=deflection, force=forces,
        converged=converged, residual=history[-1], iterations=len(history) - 1,
        factorisations=factorisations, message=message,
        tail=line_tail(deflection, orders, rounding=10.0 * tolerance),
        history=tuple(history),
    )  # fmt: skip
    values = np.linalg.eigvals(monodromy)
    return ShootingSolution(
        solution, period, q[0], v[0], monodromy, values[np.argsort(-np.abs(values))], times, q
    )


def _told(
    problem, found: ShootingSolution, frequency, integration: float, radius: bool, *, trivial: int = 0
) -> ShootingSolution:
    """The motion with its verdict and the spectral radius of the fixed point at its lines."""
    solution = found.solution
    told = {"verdict": open_verdict("not covered: the solution did not converge")}
    if solution.converged:
        told["verdict"] = verdict_of_monodromy(
            problem, found.monodromy, found.period, error=integration, trivial=trivial
        )
    if radius:
        omega = float(solution.frequency[0])
        turns = np.rint(frequency / omega).astype(int)
        value, note = radius_of_lines(problem, turns, omega, solution.deflection)
        told |= {"spectral_radius": value, "message": solution.message + note}
    return replace(found, solution=replace(solution, **told))
