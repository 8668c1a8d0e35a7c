"""One motion by three routes: harmonic balance, shooting and adaptive integration until it has settled.

The lines of the deflections of all elements are compared, relative to the largest one that fluctuates. The
routes share the equations of motion and nothing of each other: shooting and integration begin at rest or at
the start given. Only the short integration of the planetary train begins on the balanced motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from published.planetary_sets import lin_parker_set

from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.shooting import ShootingSolution, solve_shooting
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.time.transient import solve_transient
from femgear.stages.lumped_set import gear_set_problem, phased_series
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, harmonics_of
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import PlanarTorque
from femgear.system.system import NonlinearSystem
from validation.nonlinear import duffing, one_harmonic, oscillator, shooting_motion
from validation.rows import Row, at_most, counted, information

GATE = 1e-5
INSTANTS = 512
# mesh frequency of the planetary train [Hz]: the meshes with the ring part
MESH_FREQUENCY = 7400.0


@dataclass(frozen=True)
class Settled:
    """Lines (n_columns, H + 1) of the last period of an integration, and what they changed by in it."""

    lines: np.ndarray
    change: float
    periods: int
    tolerance: float
    steps: int


@dataclass(frozen=True)
class Motion:
    """A motion by harmonic balance and shooting, with its verdict.

    Parameters
    ----------
    problem : NonlinearSystem
    frequency : float
        [rad/s]
    samples : int
        Of harmonic balance.
    balance : PeriodicSolution
    shooting : ShootingSolution
    verdict : FloquetVerdict
    """

    problem: NonlinearSystem
    frequency: float
    samples: int
    balance: PeriodicSolution
    shooting: ShootingSolution
    verdict: FloquetVerdict

    @property
    def harmonics(self) -> int:
        """Harmonics of the balance."""
        return len(self.balance.orders) - 1


def state_of(problem, balance: PeriodicSolution) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of a balanced motion at time zero."""
    lines = displacements(problem, balance)
    return lines.sum(axis=1).real, (1j * balance.line_frequency * lines).sum(axis=1).real


def difference(first: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of the lines that both have, relative to the largest one that fluctuates."""
    count = min(first.shape[1], other.shape[1])
    return float(np.abs(first[:, :count] - other[:, :count]).max() / np.abs(first[:, 1:count]).max())


def settled(problem, frequency: float, *, periods: int, tolerance: float, harmonics: int, start=None) -> Settled:
    """Integrate with contact events and keep the last of ``periods``; from rest when no start is given."""
    first = np.arange(2 * INSTANTS) / INSTANTS + periods - 2
    times = np.concatenate([[0.0], first if periods > 2 else first[1:]]) * 2.0 * np.pi / frequency
    run = solve_transient(problem, frequency, times, start=start, method="DOP853", events=True, tolerance=tolerance)
    before, last = run.deflection[-2 * INSTANTS : -INSTANTS], run.deflection[-INSTANTS:]
    lines = [harmonics_of(part.T, harmonics) for part in (before, last)]
    return Settled(lines[1], difference(lines[1], lines[0]), periods, tolerance, run.steps)


def motion(problem, frequency: float, shooting: ShootingSolution, *, harmonics, samples, start=None) -> Motion:
    """Balance and verdict beside a motion found by shooting."""
    solution = solve_harmonic_balance(problem, frequency, harmonics=harmonics, samples=samples, start=start)
    return Motion(problem, frequency, samples, solution, shooting, solution.verdict)


@cache
def duffing_motion() -> tuple[Motion, Settled]:
    """(a) Upper motion of the Duffing oscillator of `nonlinear` at 1.2 rad/s."""
    amplitude = 2.5091975811
    line = one_harmonic(amplitude, 1.2)
    start = np.zeros((1, 16), complex)
    start[0, 1] = line
    computed = motion(duffing(), 1.2, shooting_motion(amplitude), harmonics=15, samples=256, start=start)
    begin = ([line.real], [-1.2 * line.imag])
    return computed, settled(duffing(), 1.2, periods=120, tolerance=1e-9, harmonics=15, start=begin)


def gear_pair(depth: float, backlash: float) -> NonlinearSystem:
    """Unit mass on one mesh of mean stiffness 1 with k(t) and play, damping 0.1, load 0.1."""
    wave = FourierSeries([[1.0, depth, 0.3 * depth]])
    return oscillator(GearMeshes([0], wave, backlash=backlash), damping=0.1, load=0.1)


@cache
def pair_motion(back: bool) -> tuple[Motion, Settled]:
    """(b) Gear pair whose teeth part, or part and strike their back flanks too."""
    problem, omega = (gear_pair(0.5, 0.1), 0.9) if back else (gear_pair(0.3, 1.0), 0.92)
    shot = solve_shooting(problem, omega, settle=40, harmonics=32, samples=8192)
    computed = motion(problem, omega, shot, harmonics=24, samples=8192)
    return computed, settled(problem, omega, periods=50, tolerance=1e-9, harmonics=24)


def planetary_train(damping: float = 0.05, backlash: float = 20e-6) -> NonlinearSystem:
    """Set of Lin and Parker with 3 planets, 18 degrees of freedom, 300 N m, k(t) of three harmonics."""
    data = lin_parker_set(3)
    late = np.array([0.0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
    wave = np.array([0.25, 0.075, 0.0375])
    stiffness = phased_series(wave, wave, -late, mean=data.mesh_stiffness)
    meshes = mesh_elements(data, stiffness=stiffness, backlash=backlash)
    return gear_set_problem(data, meshes=meshes, torque=PlanarTorque(300.0), damping=damping)


@cache
def train_motion(backlash: float = 20e-6) -> Motion:
    """(c) Planetary train; shooting begins from the steps of average acceleration."""
    problem, omega = planetary_train(backlash=backlash), 2.0 * np.pi * MESH_FREQUENCY
    shot = solve_shooting(problem, omega, settle=60, harmonics=32, samples=4096, integration=1e-10, tolerance=1e-8)
    return motion(problem, omega, shot, harmonics=16, samples=2048)


@cache
def train_settled(long: bool) -> Settled:
    """(c) Integrated: 40 periods from the motion balanced with 32 harmonics, or 900 from rest."""
    computed = train_motion()
    problem, omega = computed.problem, computed.frequency
    options = {"tolerance": 1e-9, "harmonics": computed.harmonics}
    if long:
        return settled(problem, omega, periods=900, **options)
    # the velocities of a motion with corners need more lines than its deflections
    fine = solve_harmonic_balance(problem, omega, harmonics=32, samples=4096, start=computed.balance)
    return settled(problem, omega, periods=40, start=state_of(problem, fine), **options)


def rows_of(name: str, computed: Motion, run: Settled, *, change: float) -> tuple[Row, ...]:
    """Differences of the routes, the verdict, and whether teeth part and the integration has settled."""
    balance, shot, case = computed.balance.deflection, computed.shooting.solution, "routes"
    integration = f"DOP853 with contact events, {run.periods} periods, tolerance {run.tolerance:g}"
    lines = f"{name}: harmonic balance ({computed.harmonics} harmonics, {computed.samples} samples)"
    both = computed.balance.converged and shot.converged
    largest = abs(computed.verdict.multipliers[0])
    gaps = [
        difference(motion_of_route, other)
        for motion_of_route, other in (
            (shot.deflection, balance),
            (run.lines, balance),
            (run.lines, shot.deflection),
        )
    ]
    return (
        at_most(case, "shooting", f"{lines} against shooting", GATE, gaps[0]),
        at_most(case, integration, f"{lines} against integration", GATE, gaps[1]),
        at_most(case, integration, f"{name}: shooting against integration", GATE, gaps[2]),
        at_most(case, integration, f"{name}: change of the lines in the last period", change, run.change),
        counted(case, "solvers", f"{name}: balance and shooting converged (1 yes)", 1, both),
        counted(case, "Floquet verdict", f"{name}: stable (1 yes)", 1, computed.verdict.stable is True),
        information(case, "Floquet verdict", f"{name}: largest multiplier", None, largest),
    )


def open_share(computed: Motion) -> tuple[float, float]:
    """Shares of the period in which some drive flank is open, and in which some back flank touches."""
    mesh = computed.problem.elements[0]
    x = computed.balance.at(np.arange(2000) / 2000 * 2.0 * np.pi / computed.frequency)[:, mesh.columns[:, 0]]
    return float((x < 0.0).any(axis=1).mean()), float((x < -mesh.backlash).any(axis=1).mean())


def parting(name: str, computed: Motion) -> tuple[Row, ...]:
    """Shares of the period without contact and on the back flanks."""
    apart, back = open_share(computed)
    return (
        counted("routes", "motion", f"{name}: teeth part (1 yes)", 1, apart > 0.0),
        information("routes", "motion", f"{name}: share of the period with a mesh apart", None, apart),
        information("routes", "motion", f"{name}: share of the period on a back flank", None, back),
    )


def duffing_routes() -> tuple[Row, ...]:
    """(a) Duffing oscillator."""
    return rows_of("(a) Duffing, Omega = 1.2", *duffing_motion(), change=1e-7)


def pair_routes() -> tuple[Row, ...]:
    """(b) One mesh with backlash whose drive flanks part."""
    name, (computed, run) = "(b) gear pair, drive flanks", pair_motion(False)
    return rows_of(name, computed, run, change=1e-6) + parting(name, computed)


def pair_routes_on_both_flanks() -> tuple[Row, ...]:
    """(b) One mesh with less backlash, which strikes its back flanks."""
    name, (computed, run) = "(b) gear pair, both flanks", pair_motion(True)
    return rows_of(name, computed, run, change=1e-6) + parting(name, computed)


def train_routes() -> tuple[Row, ...]:
    """(c) Planetary train, integration from the balanced motion, and fewer harmonics."""
    name, computed = "(c) train of 18 dof, 7400 Hz", train_motion()
    rows = rows_of(name, computed, train_settled(False), change=1e-6) + parting(name, computed)
    for count in (8, 12):
        fewer = solve_harmonic_balance(computed.problem, computed.frequency, harmonics=count, samples=2048)
        error = difference(computed.shooting.solution.deflection, fewer.deflection)
        quantity = f"{name}: harmonic balance ({count} harmonics, 2048 samples) against shooting"
        rows += (at_most("routes", "shooting", quantity, GATE, error),)
    size = len(computed.problem.system.M)
    return (*rows, counted("routes", "3 (N + 3)", f"{name}: degrees of freedom", 18, size))


def train_from_rest() -> tuple[Row, ...]:
    """(c) Planetary train, integration from rest until it has settled."""
    return rows_of(
        "(c) train of 18 dof, 7400 Hz, integrated from rest", train_motion(), train_settled(True), change=1e-6
    )
