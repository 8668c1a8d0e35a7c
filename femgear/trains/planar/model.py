"""The lumped planetary set of a case in its plane, and what it does in a periodic solution.

`planar_model` makes the set of a case with its elements and forces; `weight_curve` and `judged_branch` follow
its response to the weight; `motion_lines` and what follows it give orbits, forces and contact of its flanks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.dependencies import check_entries, static_entries
from femgear.case.gear_set import support_stiffness
from femgear.case.planetary import pin_errors
from femgear.case.tooth_friction import friction_acts
from femgear.errors import CaseError
from femgear.exchange.dynamic_model import DynamicModel
from femgear.solvers.continuation.branches import Branch, frequency_response_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.receptance import Reduction, reduce_problem
from femgear.solvers.periodic.harmonic_balance import displacements
from femgear.solvers.periodic.phase_grid import equidistant_phases
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.stability.floquet import floquet_verdicts
from femgear.stages.lumped_model import lumped_dynamic_model
from femgear.stages.lumped_set import (
    Bearings,
    Gravity,
    MemberBearing,
    driving_torque,
    gear_set_modes,
    gear_set_problem,
    member_speeds,
    mesh_stiffnesses,
    mode_ratios,
    needed,
    rotation_sense,
    torsional_support,
    working_springs,
)
from femgear.stages.static import mesh_backlash
from femgear.stages.static_results import StaticResult
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import constant, fluctuation, harmonics_of, line_tail, orders_of
from femgear.system.mesh_directions import free_motions, gear_set_system, mesh_elements, pin_directions
from femgear.system.rigid_bodies import CENTRAL, PlanarBody, PlanarSet, planar_from_set
from femgear.system.system import (
    HarmonicForce,
    MechanicalSystem,
    MeshExcitation,
    NonlinearSystem,
    element_forces,
)

if TYPE_CHECKING:
    from femgear.contact.cycle import MeshCycle
    from femgear.gears.planetary import PlanetarySet
    from femgear.trains.planar.section import PlanarCase

TAIL_LIMIT = 0.05
"""Share of the amplitude in the upper half of the lines beyond which what they add up to is wrong."""
# limit points closer than this, relative to the frequency, are one: corners of contact split them
_SAME_FOLD = 2e-3
# deflection [m] that counts as much as the whole range of frequencies along a branch
_SCALE = 2e-3
# instants of a period; with two base frequencies of either phase
_SAMPLES = 2880
_GRID = (256, 48)
# relative errors of the monodromy matrices, and solutions judged together
_COARSE, _FINE, _BATCH = 1e-3, 1e-6, 32
# fluctuation of a force, relative to its mean, below which there is none: residual of the equations
_STILL = 1e-6


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A lumped set ready to be solved, and where its elements act.

    ``data`` are its rigid bodies and stiffnesses, ``problem`` its equations of motion, ``bearings`` its bearings with
    clearance. ``back_flanks`` tells whether these flanks have columns of their own.
    """

    data: PlanarSet
    problem: NonlinearSystem
    back_flanks: bool
    bearings: Bearings

    @cached_property
    def springs(self) -> np.ndarray:
        """Springs (n_columns,) [N/m] near which the set works."""
        return working_springs(self.problem, self.bearings.members)

    @cached_property
    def reduction(self) -> Reduction:
        """Reduction with these springs."""
        return reduce_problem(self.problem, reference=self.springs)

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Places of the columns (n,) or (g, 2), see `Bearings.columns`."""
        return self.bearings.columns(self.data, back_flanks=self.back_flanks)


def planar_data(case: PlanarCase, gears: PlanetarySet, static: StaticResult | None = None) -> PlanarSet:
    """Make the lumped set of a case: bodies and supports of its entries, radii and angles of its gears.

    Parameters
    ----------
    case : PlanarCase
        Masses [kg], inertias [kg m^2], stiffnesses [N/m].
    gears : PlanetarySet
        Of `femgear.planetary_set`.
    static : StaticResult, optional
        Whose mean mesh stiffnesses are taken where the case gives none.

    Raises
    ------
    CaseError
        Neither a mesh stiffness nor a static solution, or a support without stiffness (E-KEY-MISSING).
    """
    planar, bodies = case.planar, {}
    for name, section in (("carrier", case.carrier), ("ring", planar.ring), ("sun", case.sun)):
        torsional = torsional_support(case, name, getattr(planar.torsion, name))
        support = needed(support_stiffness(case, name, section), f"{name}.support_stiffness")
        bodies[name] = PlanarBody(section.mass, section.inertia, support, torsional)
    given = planar.mesh_stiffness
    mean = needed(static, "static").cycle.mean() if given is None else None
    return planar_from_set(
        gears,
        **bodies,
        planet=PlanarBody(case.planet.mass, case.planet.inertia),
        **mesh_stiffnesses(given, mean),
        planet_bearing=case.planet.bearing_stiffness,
    )


def planar_model(
    case: PlanarCase,
    gears: PlanetarySet,
    static: StaticResult | None = None,
    *,
    mesh_frequency: bool = False,
    carrier_speed: float = 0.0,
) -> PlanarModel:
    """Make the lumped set of a case with its elements, forces and damping.

    Parameters
    ----------
    static : StaticResult, optional
        Needed where the case gives no mesh stiffness.
    mesh_frequency : bool
        The base frequencies are those of carrier and mesh, and the mesh stiffness of a static result varies;
        otherwise the only base frequency is that of the weight, and mesh stiffnesses are constant.
    carrier_speed : float
        Of the gyroscopic terms [rad/s].
    """
    if static is not None:
        check_entries(static, StaticResult, static_entries(case), "static solution")
    planar, torque = case.planar, driving_torque(case, reacts=case.planar.reaction == "output")
    data, bearing = planar_data(case, gears, static), planar.carrier_bearing
    # positions of the record run with the sun against the carrier
    orders = (0, rotation_sense(case, gears))
    members = (MemberBearing(bearing.stiffness, bearing.clearance, "carrier", bearing.on),) if bearing else ()
    bearings = Bearings(case.planet.bearing_clearance or None, members)
    problem = gear_set_problem(
        data,
        meshes=_meshes(case, gears, data, static, mesh_frequency, orders),
        back_flanks=planar.back_flanks,
        torque=torque,
        bearings=bearings,
        gravity=_gravity(case, gears, mesh_frequency),
        pin_errors=pin_errors(case, gears) if planar.mesh_stiffness else None,
        carrier_speed=carrier_speed,
        damping=planar_ratios(case),
    )
    if static is not None and static.cycle.friction_force is not None:
        count = case.mesh_harmonics if mesh_frequency else 0
        problem = _rubbing(problem, gear_set_system(data, torque=torque, friction=True), static.cycle, count, orders)
    return PlanarModel(data, problem, planar.back_flanks, bearings)


def planar_dynamic_model(case: PlanarCase, gears: PlanetarySet, static: StaticResult | None) -> DynamicModel:
    """Make the model of a set whose drive flanks alone carry, for other programs.

    CaseError: what no linear model has: weight, back flanks on lines of their own, clearances, pin errors beside a
    given mesh stiffness, friction, gyroscopic terms (E-MODEL).
    """
    planar = case.planar
    beyond = {"planar.gravity": planar.gravity, "planar.back_flanks": planar.back_flanks}
    beyond |= {"planar.carrier_bearing": planar.carrier_bearing, "planar.gyroscopic": planar.gyroscopic}
    beyond |= {"planet.bearing_clearance": case.planet.bearing_clearance, "losses.excites": friction_acts(case)}
    beyond |= {"set.pin_errors": planar.mesh_stiffness and case.set.pin_errors}
    for key in (key for key, given in beyond.items() if given):
        text = "a linear model of the set for other programs has none of this"
        raise CaseError(text, code="E-MODEL", key=key, remedy="leave it out", file=case.location(key))
    data, torque = planar_data(case, gears, static), driving_torque(case, reacts=planar.reaction == "output")
    if planar.mesh_stiffness is None:
        cycle = needed(static, "static").cycle
        record = np.stack([cycle.stiffness, cycle.deflection, cycle.force])
        # positions run with the sun against the carrier
        record = record if rotation_sense(case, gears) > 0 else np.roll(record[..., ::-1], 1, axis=-1)
    else:
        record = np.zeros((3, 2 * gears.n_planets, 3))
        record[0] = data.mesh_stiffness[:, None]
    excitation, system = (
        MeshExcitation(*record, backlash=np.zeros(2 * gears.n_planets)),
        gear_set_system(data, torque=torque),
    )
    modes = gear_set_modes(data, system=system, mesh_stiffness=excitation.stiffness.mean(axis=1))
    modes = replace(modes, damping_ratio=mode_ratios(modes.frequency, planar_ratios(case)))
    return lumped_dynamic_model(case, gears, data, system, modes, excitation, torque)


def _rubbing(
    problem: NonlinearSystem, rubbed: MechanicalSystem, cycle: MeshCycle, count: int, orders: tuple[int, ...]
) -> NonlinearSystem:
    """Add the friction of the drive flanks at rest as loads: its mean, and so many mesh harmonics.

    The output takes what is lost, which turns the whole set else.

    Parameters
    ----------
    problem : NonlinearSystem
        Of the set.
    rubbed : MechanicalSystem
        The same coordinates with sources, see `femgear.system.mesh_directions.gear_set_system`.
    cycle : MeshCycle
        Of the statics with friction.
    count : int
        Mesh harmonics.
    orders : tuple of int
        Of the mesh frequency.
    """
    assert cycle.friction_force is not None and cycle.friction_moment is not None and rubbed.sources is not None
    record = -np.concatenate([cycle.friction_force, cycle.friction_moment])
    acting = rubbed.sources[:, :-1] @ harmonics_of(record, count)
    modes = undamped_modes(replace(rubbed, gyroscopic=None, sources=None), cycle.stiffness.mean(axis=1))
    turning, mean = modes.shape[:, modes.frequency == 0.0].T, np.real(acting[:, 0])
    if len(turning):
        taken = np.linalg.lstsq(turning @ rubbed.sources[:, -1:], turning @ mean, rcond=None)[0]
        mean = mean - rubbed.sources[:, -1] * taken[0]
    forces = [HarmonicForce(acting[:, h], tuple(h * order for order in orders)) for h in range(1, count + 1)]
    system = replace(problem.system, load=problem.system.load + mean)
    return replace(problem, system=system, forces=(*problem.forces, *forces))


def carrier_sense(case: PlanarCase, gears: PlanetarySet) -> int:
    """Tell the sense of the carrier: 1 where it turns counter-clockwise, -1 clockwise, 0 where it stands."""
    return int(np.sign(member_speeds(case, gears).carrier))


def planar_ratios(case: PlanarCase) -> float | tuple[float, ...]:
    """Read the damping ratios of a case: of all modes, or see `femgear.stages.lumped_set.mode_ratios`."""
    return case.planar.damping_ratios or case.dynamics.damping_ratio


def _meshes(case, gears, data, static, varying: bool, orders: tuple[int, ...]) -> GearMeshes:
    """Mesh elements: constant, or along the static record over the mesh phase."""
    planar, N = case.planar, gears.n_planets
    backlash = planar.line_backlash
    if backlash is None:
        play = mesh_backlash(gears)
        backlash = np.where(play > 0.0, play, np.inf)
    options = {"backlash": backlash, "smoothing": planar.smoothing}
    if planar.mesh_stiffness is not None:
        return mesh_elements(data, **options)
    cycle = needed(static, "static").cycle
    if not varying:
        stiffness, deflection, force = (
            getattr(cycle, name).mean(axis=1) for name in ("stiffness", "deflection", "force")
        )
        unloaded = constant(deflection - force / stiffness)
        return GearMeshes(np.arange(2 * N), constant(stiffness), unloaded, **options)
    record = MeshExcitation(cycle.stiffness, cycle.deflection, cycle.force, np.zeros(2 * N))
    return mesh_elements(data, stiffness=record, harmonics=case.mesh_harmonics, orders=orders, **options)


def _gravity(case: PlanarCase, gears: PlanetarySet, mesh_frequency: bool) -> Gravity | None:
    given, sense = case.planar.gravity, carrier_sense(case, gears)
    if given is None:
        return None
    orders = orders_of(0, 1 + mesh_frequency, sense) if sense else None
    return Gravity(given.acceleration, given.direction, orders)


MOTIONS = {
    "force_tail": (
        "",
        "1",
        "share of the fluctuating force in the upper half of the lines, of the kind of mesh with more of it",
    ),
    "motion": ("", "m", "farthest that a member's centre moves from its place"),
    "rms": ("member axis", "m", "displacement about its mean, r.m.s."),
    "displacement": ("member axis line", "m", "displacement in the carrier frame"),
    "mesh_force": ("mesh line", "N", "mesh force along the line of the drive flanks"),
    "back_force": ("mesh line", "N", "force of the back flanks on their own line"),
    "planet_bearing_force": ("planet direction line", "N", "force of the pin on the planet"),
    "carrier_bearing_force": ("axis line", "N", "force of the carrier bearing on the carrier"),
    "drive_contact": (
        "mesh",
        "1",
        "share of the time in which the drive flanks touch: 1 in contact, 0 not",
    ),
    "back_contact": ("mesh", "1", "share of the time in which the back flanks touch: 1 in contact, 0 not"),
}
"""Of `MotionLines`, under the names of branch.nc and response.nc: dimensions, unit, and what they are."""


@dataclass(frozen=True, kw_only=True)
class MotionLines:
    """Motions, forces and contact of a solution; the members are carrier, ring and sun.

    `MOTIONS` gives their dimensions, units and meaning in the files of results. Of L lines the arrays hold complex
    amplitudes; the axes are x and y of the carrier frame, the directions at a planet radially outwards and tangential.

    Parameters
    ----------
    force_tail : float
        `femgear.system.fourier.line_tail` of the mesh forces, of drive and back flanks together [1].
    motion : float
        Farthest that the centre of a member moves from its place [m].
    rms : (3, 2) array
        Displacement of the members about its mean, r.m.s. [m].
    displacement : (3, 2, L) array
        Of the members [m].
    mesh_force, back_force : (2N, L) arrays
        Force of the drive flanks and of the back flanks of every mesh, each along its own line of action [N].
    planet_bearing_force : (N, 2, L) array
        Force of the pin on the planet [N].
    carrier_bearing_force : (2, L) array
        Force of the bearing on the carrier [N]; zero where there is none.
    drive_contact, back_contact : (2N,) arrays
        Shares of the time in which these flanks touch [1].
    approach : float
        Largest deflection of a mesh [m].
    """

    force_tail: float
    motion: float
    rms: np.ndarray
    displacement: np.ndarray
    mesh_force: np.ndarray
    back_force: np.ndarray
    planet_bearing_force: np.ndarray
    carrier_bearing_force: np.ndarray
    drive_contact: np.ndarray
    back_contact: np.ndarray
    approach: float


def weight_curve(
    problem: NonlinearSystem,
    limits: tuple[float, float],
    *,
    reduction: Reduction,
    harmonics: int = 9,
    stability: bool = False,
    radius: bool = False,
    largest: float = 0.1,
    max_points: int = 600,
) -> Branch:
    """Follow periodic responses over the frequency of the weight in the carrier frame.

    Parameters
    ----------
    problem : NonlinearSystem
        With the weight as the only base frequency.
    limits : (first, last)
        [Hz]
    reduction : Reduction
        With back flanks open, as `PlanarModel.reduction`.
    harmonics, stability, radius
        As for `frequency_response_curve`.
    largest : float
        Longest step, see `StepOptions`.
    """
    return frequency_response_curve(
        problem,
        (2.0 * np.pi * limits[0], 2.0 * np.pi * limits[1]),
        harmonics=harmonics,
        stability=stability,
        radius=radius,
        tolerance=1e-5,
        samples=max(1024, 128 * harmonics),
        reduction=reduction,
        scale=_SCALE,
        options=StepOptions(largest=largest, max_points=max_points),
    )


def judged_branch(
    problem: NonlinearSystem, branch: Branch, progress: Callable[[int, int], None] = lambda done, total: None
) -> Branch:
    """Judge a branch by Floquet multipliers: coarse first, fine where open or near the unit circle.

    The branch was followed without stability; ``progress`` is called with (done, total).
    """
    solutions = branch.solutions
    verdicts_so_far = []
    for first in range(0, len(solutions), _BATCH):
        part = solutions[first : first + _BATCH]
        verdicts = list(floquet_verdicts(problem, part, tolerance=_COARSE))
        close = [i for i, verdict in enumerate(verdicts) if _open(verdict)]
        fine = floquet_verdicts(problem, [part[i] for i in close], tolerance=_FINE) if close else ()
        for i, verdict in zip(close, fine):
            verdicts[i] = verdict
        verdicts_so_far += verdicts
        progress(len(verdicts_so_far), len(solutions))
    judged = tuple(replace(solution, verdict=verdict) for solution, verdict in zip(solutions, verdicts_so_far))
    return replace(branch, solutions=judged, stability=True)


def _open(verdict: FloquetVerdict) -> bool:
    if verdict.stable is None or not len(verdict.multipliers):
        return verdict.stable is None
    return abs(abs(verdict.multipliers[0]) - 1.0) < 100.0 * verdict.error + _COARSE


def motion_lines(model: PlanarModel, solution: PeriodicSolution) -> MotionLines:
    """Compute the lines of all that is looked at in a solution."""
    data, groups, N = model.data, model.groups, model.data.n_planets
    pins = (free_motions(data).T @ pin_directions(data).reshape(-1, 2 * N)).T
    members = [3 * row + axis for row in range(len(CENTRAL)) for axis in range(2)]
    rows = np.vstack([free_motions(data)[members], pins])
    x = displacements(model.problem, solution, rows, reduction=model.reduction)
    if len(groups["planets"]):
        pin_force = -solution.force[groups["planets"]]
    else:
        pin_force = -data.pin_stiffness[..., None] * x[6:].reshape(N, 2, -1)
    back = np.zeros((2 * N, x.shape[1]), complex)
    if model.back_flanks:
        back = solution.force[groups["back flanks"]]
    bearing = np.zeros((2, x.shape[1]), complex)
    if len(groups["members"]):
        bearing = -solution.force[groups["members"][0]]
    member, mesh = x[:6].reshape(3, 2, -1), solution.force[groups["meshes"]]
    wave = np.exp(1j * (_phases(solution.orders) @ solution.orders.T))
    path = np.real(member @ wave.T)
    deflection = np.real(wave @ solution.deflection[groups["meshes"]].T)
    kinds = (np.vstack([mesh[part], back[part]]) for part in (slice(0, N), slice(N, 2 * N)))
    pressed, pulled = column_contact(model.problem, solution)
    behind = pressed[groups["back flanks"]] if model.back_flanks else pulled[groups["meshes"]]
    return MotionLines(
        force_tail=max(line_tail(forces, solution.orders, rounding=_STILL) for forces in kinds),
        motion=float(np.hypot(path[:, 0], path[:, 1]).max()),
        rms=fluctuation(member),
        displacement=member,
        mesh_force=mesh,
        back_force=back,
        planet_bearing_force=pin_force,
        carrier_bearing_force=bearing,
        drive_contact=pressed[groups["meshes"]],
        back_contact=behind,
        approach=float(deflection.max()),
    )


def flank_forces(model: PlanarModel, solution: PeriodicSolution, theta) -> tuple[np.ndarray, np.ndarray]:
    """Compute the forces (n, 2N) [N] of drive flanks, and of back flanks on their own lines, by their laws.

    At phases theta (n, n_bases) [rad], with the deflections of the solution. Its force lines, cut at the last
    one, would ring beside a short contact; the law of a one-sided contact does not.
    """
    x = np.real(np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T)
    force, groups = element_forces(model.problem, x, theta)[0], model.groups
    drive = force[:, groups["meshes"]]
    return drive, force[:, groups["back flanks"]] if model.back_flanks else np.zeros_like(drive)


def column_contact(problem: NonlinearSystem, solution: PeriodicSolution) -> np.ndarray:
    """Compute the share of the time (2, n_columns) in which the flanks of every column press, and pull.

    Columns without a mesh are nan. A mesh with play on one line of action pulls where its back flanks touch.
    A smoothed contact counts as closed beyond half its force scale, the force at the corner itself.
    """
    theta = _phases(solution.orders)
    x = np.real(np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T)
    force = element_forces(problem, x, theta)[0]
    out = np.full((2, x.shape[1]), np.nan)
    for element in problem.elements:
        if isinstance(element, GearMeshes):
            place = element.columns[:, 0]
            least = 0.5 * element.smoothing * element.stiffness.mean
            out[0, place] = (force[:, place] > least).mean(axis=0)
            out[1, place] = (force[:, place] < -least).mean(axis=0)
    return out


def _phases(orders: np.ndarray) -> np.ndarray:
    """Instants (n, bases) [rad] that fill the phases evenly; one phase of a base that no line has."""
    used = np.any(orders != 0, axis=0)
    return equidistant_phases(np.where(used, _GRID[: len(used)] if used.sum() > 1 else _SAMPLES, 1).tolist())


def shown_points(rms: np.ndarray, back: np.ndarray, stable: np.ndarray) -> list[tuple[int, str]]:
    """Choose points of a branch to draw over the phase, in order, with what they are; the last is the top.

    Along the branch are ``rms`` (p,), the amplitude, ``back`` (p,), the share of the cycle in which back flanks touch,
    and ``stable`` (p,): 1 where known to be stable, 0 where known not to be, -1 where not known.
    """
    sure = stable == 1
    top, words = int(np.argmax(rms)), "largest response"
    if sure.any():
        top, words = int(np.argmax(np.where(sure, rms, -1.0))), "largest stable response"
    points = [(0, "start")] if top else []
    if back[top] > 0.0:
        free = np.flatnonzero(back[:top] == 0.0)
        points += [(int(free[-1]), "before back flanks touch")] if len(free) and free[-1] else []
    return [*points, (top, words)]


def merged_folds(frequency: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Find the limit points of a branch, neighbours at one frequency as one: the outermost of them.

    From the frequencies (p,) along the branch, and whether each point is a fold (p,): numbers (f,) of points.
    """
    groups: list[list[int]] = []
    for point in np.flatnonzero(fold):
        if groups and abs(frequency[point] / frequency[groups[-1][0]] - 1.0) < _SAME_FOLD:
            groups[-1].append(int(point))
        else:
            groups.append([int(point)])
    # the branch runs towards a fold: the outermost point lies farthest in that sense
    sense = [1.0 if frequency[group[0]] >= frequency[max(group[0] - 1, 0)] else -1.0 for group in groups]
    return np.array([max(group, key=lambda i: s * frequency[i]) for group, s in zip(groups, sense)], int)
