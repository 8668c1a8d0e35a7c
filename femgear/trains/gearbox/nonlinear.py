"""A gearbox whose teeth part and touch their back flanks, as one system for harmonic balance and time integration.

Its coordinates are those of the gearbox about its loaded state: shafts, bearings by their tangents, casing, planets
with their pins and, of a set whose carrier turns, the waves of the planets (`femgear.system.turning_meshes`), with
which everything but the directions of the meshes stands still. Meshes of the chosen stages are elements along their
normals: ``max(F + k(t) (approach - deflection), 0)`` of the drive flank with k, F and deflection of its contact, and
the same on the back flank, whose normal has the tangential and the axial part reversed, beyond the backlash (Y. Guo
and R. G. Parker, Eur. J. Mech. A 29, 2010, 1022-1033). Slopes along the width are held by a constant spring, apart or
not. Meshes of other stages are springs of their mean stiffness. Bearings with play that are given by their stiffness
are elements too: rings of one-sided springs, whose columns are the motions of the inner ring along x and y against the
outer one (`femgear.system.force_laws.RadialBearings`).

Motions are those from the unloaded gearbox, loads are torques, forces and weight: a mesh carries what all of them give
it at every angle. Of a turning planet the Coriolis terms count, and the centrifugal ones with the pull of its pin,
which turns with the carrier: a carrier that turns or tilts as a whole feels nothing of them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case.gear_set import line_play, planetary_set
from femgear.gears.profile import base_helix_angle
from femgear.report.tables import merged_names
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.static import mesh_backlash
from femgear.system.assembly import GROUND, Assembly, Contact, assemble, point_approach
from femgear.system.force_laws import Element, GearMeshes, RadialBearings, turning_wave
from femgear.system.fourier import FourierSeries, harmonics_of, orders_of, sample
from femgear.system.system import HarmonicForce, MechanicalSystem, MeshExcitation, NonlinearSystem
from femgear.system.turning_meshes import (
    TurningDirections,
    TurningMeshes,
    independent_directions,
)
from femgear.trains.gearbox.case_file import CASING, PairSection, teeth_of
from femgear.trains.gearbox.deflection import Deflection, laws_of, spread_rows
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.running_branches import ahead, kinds_in_time
from femgear.trains.gearbox.stage_structure import equal_planets, in_time, rubbing_rows
from femgear.trains.gearbox.turning_planets import (
    TurningPlanets,
    pin_changes,
    turning_planets,
    turning_rows,
    turning_terms,
)


@dataclass(frozen=True)
class NonlinearStage:
    """A stage whose flanks part.

    Parameters
    ----------
    name : str
        Of the stage.
    meshes : tuple of str
        Names of its M meshes: of a set those of the sun, then of the ring.
    excitation : MeshExcitation
        As time goes on; deflections are approaches of the flanks from the unloaded gearbox, backlash is along the
        normals, zero without back flanks.
    drive, back, slope : TurningDirections
        Approach (M, n) of drive flanks and back flanks, and slope (M', n) of that of the drive flanks along the width
        of the M' meshes that have one, per unit of the coordinates [1, m].
    slope_stiffness, slope_moment, slope_start : (M',) arrays
        Stiffness against slopes [N m/rad], and moment [N m] and slope [rad] of the loaded state.
    mesh_base, turn_base : int
        Numbers of the base frequencies of mesh and carrier; -1 for a carrier that stands still.
    sense : int
        Of the carrier, 1 or -1.
    """

    name: str
    meshes: tuple[str, ...]
    excitation: MeshExcitation
    drive: TurningDirections
    back: TurningDirections
    slope: TurningDirections
    slope_stiffness: np.ndarray
    slope_moment: np.ndarray
    slope_start: np.ndarray
    mesh_base: int
    turn_base: int
    sense: int

    @property
    def turns(self) -> bool:
        """Whether the directions of its meshes turn with a carrier."""
        return self.turn_base >= 0

    @property
    def back_flanks(self) -> np.ndarray:
        """Numbers (k,) of the meshes that have back flanks."""
        return np.flatnonzero((self.excitation.backlash > 0.0) & np.isfinite(self.excitation.backlash))


@dataclass(frozen=True)
class NonlinearGearbox:
    """A gearbox ready for harmonic balance and time integration.

    Parameters
    ----------
    deflection : Deflection
        Loaded state about which bearings and other stages are linear.
    problem : NonlinearSystem
        Of coordinates n; of every stage drive flanks, back flanks where there are some, and slopes, as elements.
    motion : (6s, n) array
        Motions of all stations per unit of the coordinates; those of planets where their carrier stood.
    bases : tuple of str
        Names of the base frequencies.
    frequency : (b,) array
        These at the speeds of the load case [rad/s].
    stages : tuple of NonlinearStage
        Whose flanks part.
    flanks : tuple of two-tuples of Element
        By stage the elements of drive flanks and back flanks; None without these.
    bearings : mapping of str to RadialBearings
        By name the bearings that are elements, the last ones of the problem.
    """

    deflection: Deflection
    problem: NonlinearSystem
    motion: np.ndarray
    bases: tuple[str, ...]
    frequency: np.ndarray
    stages: tuple[NonlinearStage, ...]
    flanks: tuple[tuple[Element, Element | None], ...]
    bearings: Mapping[str, RadialBearings]


def nonlinear_gearbox(  # noqa: PLR0913
    state: Deflection,
    excitations: Mapping[str, MeshExcitation],
    *,
    harmonics: int,
    separates: bool = True,
    back_flanks: bool = True,
    gyroscopic: bool = True,
    turning: bool = True,
    damping_ratio: float | None = None,
    mean_damping: bool = True,
    together: Sequence[Collection[str]] = (),
) -> NonlinearGearbox:
    """Assemble a gearbox with the meshes of some stages as elements.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    excitations : mapping of str to MeshExcitation
        Of the stages whose flanks part, by name, see `femgear.trains.gearbox.stage_structure.stage_excitation`. A
        backlash that is zero is that of the teeth.
    harmonics : int
        Mesh harmonics of the excitation.
    separates : bool
        Whether flanks part; without it they are springs that may pull.
    back_flanks : bool
        Teeth that part touch their back flanks beyond the backlash.
    gyroscopic : bool
        With the gyroscopic moments of shafts and planets.
    turning : bool
        Directions of meshes go round with the carriers; without it they are those at the angle where these stand.
    damping_ratio : float, optional
        Of all modes, viscous; by default that of the case.
    mean_damping : bool
        Modes are those with the mean of the meshes over the turn of their carriers, which no angle of theirs prefers;
        without it those with the planets where they stand.
    together : sequence of collections of str
        Names of pairs on one carrier whose meshes are one stage here, with the mesh frequency of the first one.

    Raises
    ------
    CaseError
        Planets that are not equally spaced, or two, on a carrier that turns (E-TURNING).
    """
    model = state.model
    chosen = [stage for stage in model.stages if stage.name in excitations]
    around = turning_planets(model, chosen) if turning else {}
    carriers = {planets.name: planets for planets in around.values()}
    assembly, stiffness, load = _structure(state, chosen, carriers.values())
    T = assembly.motions
    rings = _rings(state, assembly)
    bases, alone = _alone(state, chosen, excitations, around, together, back=separates and back_flanks)
    staged = _joined(alone, together)
    coriolis, centrifugal = turning_terms(assembly, carriers.values(), gyroscopic=gyroscopic)
    system = assemble(
        assembly.mass, stiffness + centrifugal, np.zeros((len(T), 0)), load, motions=T, dofs=assembly.free_names
    )
    ratio = model.case.modes.damping_ratio if damping_ratio is None else damping_ratio
    closed = sum(ring.stiffness * across @ across.T for ring, across in rings.values())
    damped = replace(system, K=T.T @ stiffness @ T + closed)
    damping, free = _damping(damped, staged, ratio, over_the_turn=mean_damping)
    # torques that radii beside their tooth numbers leave out of balance speed the gearbox up as a whole
    balanced = system.load - system.M @ (free @ (free.T @ system.load))
    columns, elements, flanks = _elements(system.M, staged, harmonics, len(bases), separates=separates)
    bearings = dict[str, RadialBearings]()
    for name, (ring, across) in rings.items():
        place = columns.shape[1] + np.array([[0, 1]])
        columns, bearings[name] = np.hstack([columns, across]), replace(ring, columns=place)
    system = replace(system, C=damping + T.T @ coriolis @ T, W=columns, load=balanced)
    forces = [
        force
        for stage, made in zip(chosen, alone, strict=True)
        for force in _friction_forces(state, stage, made, T, harmonics, len(bases))
    ]
    problem = NonlinearSystem(system, (*elements, *bearings.values()), tuple(forces))
    frequency = np.array([*bases.values()])
    return NonlinearGearbox(state, problem, T, tuple(bases), frequency, tuple(staged), flanks, bearings)


def _alone(
    state: Deflection,
    chosen: Sequence[StageModel],
    excitations: Mapping[str, MeshExcitation],
    around: Mapping[str, TurningPlanets],
    together: Sequence[Collection[str]],
    *,
    back: bool,
) -> tuple[dict[str, float], list[NonlinearStage]]:
    """Make every stage alone; and the base frequencies [rad/s] of all of them by name."""
    flow, bases, made = state.model.flow, dict[str, float](), list[NonlinearStage]()
    phases = pair_phases(state.model.case, flow)
    joint = {name: next(iter(names)) for names in together for name in names}
    for stage in chosen:
        planets, base = around.get(stage.name), f"{joint.get(stage.name, stage.name)} mesh"
        if planets is not None:
            bases.setdefault(planets.name, abs(planets.speed))
        record = _in_time(state, stage, excitations, planets, phases)
        mesh_frequency = 2.0 * math.pi * flow.mesh_frequency[joint.get(stage.name, stage.name)]
        bases.setdefault(base, mesh_frequency / record.periods)
        numbers = [*bases].index(base), [*bases].index(planets.name) if planets is not None else -1
        made.append(_stage(state, stage, record, planets, numbers, back=back))
    return bases, made


def _joined(stages: Sequence[NonlinearStage], together: Sequence[Collection[str]]) -> list[NonlinearStage]:
    """Make one stage of those whose meshes are one, in the place of the first of them."""
    joined = list[NonlinearStage]()
    for stage in stages:
        names = next((names for names in together if stage.name in names), None)
        if names is None:
            joined.append(stage)
        elif stage.name == next(other.name for other in stages if other.name in names):
            joined.append(_one_of([other for other in stages if other.name in names]))
    return joined


def _one_of(stages: Sequence[NonlinearStage]) -> NonlinearStage:
    """One stage of all meshes of several, without what their friction does."""
    count = max(stage.excitation.stiffness.shape[1] for stage in stages)

    def positions(values: np.ndarray) -> np.ndarray:
        return values if values.shape[1] == count else sample(harmonics_of(values, (values.shape[1] - 1) // 2), count)

    def stacked(name: str) -> np.ndarray:
        return np.concatenate([getattr(stage, name) for stage in stages])

    arrays = {
        name: np.concatenate([positions(getattr(stage.excitation, name)) for stage in stages])
        for name in ("stiffness", "deflection", "force")
    }
    directions = {
        name: TurningDirections(*map(np.vstack, zip(*(_parts(getattr(stage, name)) for stage in stages), strict=True)))
        for name in ("drive", "back", "slope")
    }
    backlash = np.concatenate([stage.excitation.backlash for stage in stages])
    return replace(
        stages[0],
        name=merged_names(stage.name for stage in stages),
        meshes=tuple(mesh for stage in stages for mesh in stage.meshes),
        excitation=MeshExcitation(**arrays, backlash=backlash, periods=stages[0].excitation.periods),
        **directions,
        slope_stiffness=stacked("slope_stiffness"),
        slope_moment=stacked("slope_moment"),
        slope_start=stacked("slope_start"),
    )


def _friction_forces(
    state: Deflection, stage: StageModel, made: NonlinearStage, T: np.ndarray, harmonics: int, bases: int
) -> Iterator[HarmonicForce]:
    """Friction of a pair about its mean, as with flanks in contact, by motions (6n, m) per unit of the coordinates."""
    if made.excitation.source is None or stage.planets or made.turns:
        return
    columns = np.zeros((len(T), len(made.excitation.source)))
    for column, row in zip(columns.T, rubbing_rows(state, stage)[0], strict=True):
        for station, effect in row:
            column[6 * station : 6 * station + 6] += effect
    lines = harmonics_of(made.excitation.source, harmonics * made.excitation.periods)
    for harmonic in range(1, lines.shape[1]):
        yield HarmonicForce(T.T @ columns @ lines[:, harmonic], orders_of(made.mesh_base, bases, harmonic))


def _rings(state: Deflection, assembly: Assembly) -> dict[str, tuple[RadialBearings, np.ndarray]]:
    """Bearings with play by name, with their motions across the axis (n, 2) per unit of the coordinates."""
    rings = {}
    for _, law, springs in laws_of(state.model, state.model.estimate):
        across = (spread_rows(springs, assembly) @ assembly.motions)[:2].T
        if law.section.gapped and across.any():
            rings[springs.name] = law.ring(np.array([[0, 1]])), across
    return rings


def _structure(
    state: Deflection, chosen: Sequence[StageModel], around: Iterable[TurningPlanets]
) -> tuple[Assembly, np.ndarray, np.ndarray]:
    """Gearbox with its stiffness (6s, 6s) and load (6s,), the meshes of the chosen stages left out.

    The load has what nonlinear bearings and meshes carry at the loaded state beyond what their tangents would.
    Bearings with play are left out; what else a law of them holds stays. Those of planets that go round have the mean
    of all branches.
    """
    model = state.model
    assembly, _, tangents = linear_system(state)
    stiffness, load, motion = assembly.stiffness, model.load.copy(), state.motion
    for number, law, springs in laws_of(model, model.estimate):
        rows, tangent = spread_rows(springs, assembly), law.share(state.bearing_stiffness[number])
        force = law.force(rows @ motion)[0]
        if law.section.gapped:
            stiffness = stiffness - rows[:2].T @ tangent[:2, :2] @ rows[:2]
            force[:2], tangent[:2, :2] = 0.0, 0.0
        load += rows.T @ (tangent @ (rows @ motion) - force)
    for number, change in (pair for planets in around for pair in pin_changes(state, planets).items()):
        rows = spread_rows(model.bearings[number], assembly)
        stiffness = stiffness + rows.T @ change @ rows
        load += rows.T @ (change @ (rows @ motion))
    gone = {mesh for stage in chosen for mesh in stage.meshes}
    for mesh, part in enumerate(assembly.slices):
        if mesh not in gone:
            W, k = assembly.columns[:, part], tangents[part]
            stiffness = stiffness + (W * k) @ W.T
            load -= W @ (state.slice_force[part] - k * (W.T @ motion))
    return assembly, stiffness, load


def _in_time(
    state: Deflection,
    stage: StageModel,
    excitations: Mapping[str, MeshExcitation],
    planets: TurningPlanets | None,
    phases: Mapping[str, float],
) -> MeshExcitation:
    """Excitation of all meshes of the kinds of a stage as time goes on, with approaches from the unloaded gearbox.

    Of a pair on a carrier that turns those of all its branches.
    """
    if planets is None or planets.branches is None:
        excitation, _, _ = in_time(state.model, stage, excitations[stage.name])
        excitation = ahead(excitation, phases.get(stage.name, 0.0)) if not stage.planets else excitation
        contacts, count = [state.contacts.get(stage.name)], max(len(stage.planets), 1)
    else:
        kind = next(n for n, names in enumerate(planets.branches.kinds) if stage.name in names)
        stages = {other.name: other for other in state.model.stages}
        alike = [stages[name] for name in planets.branches.kinds[kind]]
        excitation, _, _ = kinds_in_time(state, planets.branches, [alike], kind, excitations, phases)
        contacts, count = [state.contacts.get(other.name) for other in alike], len(alike)
    if any(contact is None for contact in contacts):
        return excitation
    approach = np.concatenate([contact.approach for contact in contacts if contact is not None])
    apart = (approach - excitation.deflection.mean(axis=1)).reshape(-1, count).mean(axis=1).repeat(count)
    return replace(excitation, deflection=excitation.deflection + apart[:, None])


def _stage(
    state: Deflection,
    stage: StageModel,
    excitation: MeshExcitation,
    planets: TurningPlanets | None,
    bases: tuple[int, int],
    *,
    back: bool,
) -> NonlinearStage:
    """Take a stage with the approaches of its flanks per unit of the coordinates, and its excitation.

    The excitation and directions are made of all meshes of its kinds, of which a pair among branches has its own.
    ``bases`` are the numbers of the base frequencies of its mesh and of its carrier.
    """
    assembly, _, tangents = linear_system(state)
    meshes, count = stage.meshes, max(len(stage.planets), 1)
    if planets is not None and planets.branches is not None:
        meshes = planets.kind_of(stage.meshes[0])
        count = len(meshes)
    tangents = equal_planets(assembly, meshes, count, tangents)
    play = excitation.backlash[: len(stage.meshes)]
    play = play if np.any(play) else normal_backlash(stage)
    drive, behind, slope, springs = list[np.ndarray](), list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    sloping = list[int]()
    for number, mesh in enumerate(meshes):
        contact, part = assembly.contacts[mesh], assembly.slices[mesh]
        k, force = tangents[part], state.slice_force[part]
        weight = k / k.sum()
        drive.append(np.einsum("s,gsm->gm", weight, contact.approach))
        behind.append(np.einsum("s,gsm->gm", weight, _back_approach(contact, _radial(state.model, mesh, number))))
        height = contact.heights - weight @ contact.heights
        if float(k @ height**2) > 0.0:
            sloping.append(number)
            effect = contact.approach[:, -1] - contact.approach[:, 0]
            slope.append(effect / (contact.heights[-1] - contact.heights[0]))
            springs.append(np.array([k @ height**2, force @ height, 0.0]))
    at = range(len(meshes))
    turning = [_directions(assembly, planets, meshes, at, rows) for rows in (drive, behind)]
    sloped = _directions(assembly, planets, meshes, sloping, slope)
    table = np.array(springs).reshape(-1, 3).T
    table[2] = sloped.at(0.0) @ state.motion
    if count > 1 and table.size:
        # as planets that only the gearbox loads unequally are taken: each as the mean of all
        table = table.reshape(3, -1, count).mean(axis=2).repeat(count, axis=1)
    of_stage = [number for number, mesh in enumerate(meshes) if mesh in stage.meshes]
    of_slope = [place for place, number in enumerate(sloping) if number in of_stage]
    arrays = {name: getattr(excitation, name)[of_stage] for name in ("stiffness", "deflection", "force")}
    source = excitation.source if len(of_stage) == len(meshes) else None
    excitation = replace(excitation, **arrays, backlash=play if back else np.zeros_like(play), source=source)
    names = tuple(assembly.contacts[mesh].name for mesh in stage.meshes)
    chosen = ((turning[0], of_stage), (turning[1], of_stage), (sloped, of_slope))
    parts = [TurningDirections(*(part[of] for part in _parts(rows))).along(assembly.motions) for rows, of in chosen]
    sense = -1 if planets is not None and planets.speed < 0.0 else 1
    stiffness, moment, start = table[:, of_slope]
    return NonlinearStage(
        stage.name, names, excitation, parts[0], parts[1], parts[2], stiffness, moment, start, *bases, sense
    )


def normal_backlash(stage: StageModel) -> np.ndarray:
    """Find the play (M,) of the meshes of a stage along their normals [m]; zero where it is not known."""
    section, case = stage.section, teeth_of(stage.section)
    if case is None:
        meshes = (section.mesh,) if isinstance(section, PairSection) else (section.sun_mesh, section.ring_mesh)
        play = [0.0 if mesh is None else mesh.backlash or 0.0 for mesh in meshes]
        return math.cos(stage.sizes.base_helix) * np.repeat(play, len(stage.meshes) // len(meshes))
    cosine = math.cos(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    gears: Any = planetary_set(case)
    play = np.array([line_play(case)]) if isinstance(stage.section, PairSection) else mesh_backlash(gears)
    return cosine * np.maximum(play, 0.0)


def _radial(model: GearboxModel, mesh: int, number: int) -> np.ndarray:
    """Direction (3,) from axis to axis of both gears of a mesh, which has this number in its stage."""
    stage = next(stage for stage in model.stages if mesh in stage.meshes)
    if stage.planets:
        angle = stage.angles[number % len(stage.planets)]
        return np.array([math.cos(angle), math.sin(angle), 0.0])
    assert isinstance(stage.section, PairSection)
    first, second = (
        np.array(_axis(model, shaft, other))
        for shaft, other in zip(stage.section.shafts, reversed(stage.section.shafts), strict=True)
    )
    return np.append((second - first) / np.linalg.norm(second - first), 0.0)


def _axis(model: GearboxModel, shaft: str, other: str) -> tuple[float, ...]:
    """Place of the axis of a shaft [m]; of the casing that of the other gear."""
    return model.case.shaft_named(other if shaft == CASING else shaft).axis


def _back_approach(contact: Contact, radial: np.ndarray) -> np.ndarray:
    """Approach (2, S, 6) of the back flanks of a mesh: the tangential and the axial part of the normal reversed."""
    first, second = (
        point_approach(2.0 * (normal @ radial) * radial - normal, points)
        for normal, points in zip(contact.normals, contact.points, strict=True)
    )
    return np.stack([first, -second])


def _directions(
    assembly: Assembly,
    planets: TurningPlanets | None,
    meshes: Sequence[int],
    numbers: Sequence[int],
    rows: Sequence[np.ndarray],
) -> TurningDirections:
    """Spread approaches (2, 6) of both gears of some of the meshes over all motions (6s,)."""
    chosen = [meshes[number] for number in numbers]
    if planets is not None:
        return turning_rows(assembly, planets, chosen, rows)
    fixed = np.zeros((len(rows), assembly.count))
    for approach, mesh, row in zip(fixed, chosen, rows, strict=True):
        for station, effect in zip(assembly.contacts[mesh].stations, row, strict=True):
            if station != GROUND:
                approach[6 * station : 6 * station + 6] += effect
    return TurningDirections(fixed, np.zeros_like(fixed), np.zeros_like(fixed))


def _damping(
    system: MechanicalSystem, stages: Sequence[NonlinearStage], ratio: float, *, over_the_turn: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Viscous damping (n, n) of all modes with the meshes at their means, and free motions.

    Planets are where they stand, or with the mean ``S_0^T k S_0 + (S_c^T k S_c + S_s^T k S_s) / 2`` over the turn of
    their carriers. Free motions (n, r) have a modal mass of one.
    """
    stiffness = system.K.copy()
    for stage in stages:
        for directions, k in (
            (stage.drive, stage.excitation.stiffness.mean(axis=1)),
            (stage.slope, stage.slope_stiffness),
        ):
            if over_the_turn and stage.turns:
                S, mean = directions.stacked, np.concatenate([k, 0.5 * k, 0.5 * k])
            else:
                S, mean = directions.at(0.0), k
            stiffness += (S.T * mean) @ S
    unloaded = replace(system, K=stiffness, W=np.zeros((len(stiffness), 0)), load=0.0 * system.load)
    modes = undamped_modes(unloaded, np.zeros(0), damping_ratio=ratio)
    carried = system.M @ modes.shape
    damping = (carried * (4.0 * np.pi * modes.damping_ratio * modes.frequency)) @ carried.T
    return damping, modes.shape[:, modes.frequency == 0.0]


def _elements(
    mass: np.ndarray, stages: Sequence[NonlinearStage], harmonics: int, bases: int, *, separates: bool
) -> tuple[np.ndarray, tuple[Element, ...], tuple[tuple[Element, Element | None], ...]]:
    """Columns (n, c), all elements, and of every stage those of drive flanks and back flanks."""
    columns, elements, flanks, count = [np.zeros((len(mass), 0))], list[Element](), [], 0
    for stage in stages:
        behind = stage.back_flanks
        groups = [(stage.drive, np.arange(len(stage.meshes))), (stage.back, behind)]
        stacked = [stage.drive.stacked, np.vstack([part[behind] for part in _parts(stage.back)]), stage.slope.stacked]
        if stage.turns:
            basic = independent_directions(np.vstack(stacked), mass)
            at = np.arange(basic.shape[1])
        else:
            basic = np.vstack([stage.drive.fixed, stage.back.fixed[behind], stage.slope.fixed]).T
            at = np.arange(basic.shape[1])
        made: list[Element | None] = []
        place, step = count, int(not stage.turns)
        for directions, chosen in groups:
            series = _flank_series(stage, chosen, harmonics, bases, back=directions is stage.back)
            of_chosen = TurningDirections(*(part[chosen] for part in _parts(directions)))
            made.append(_element(stage, of_chosen, basic, place, series, bases, separates=separates))
            place += step * len(chosen)
        slope = {
            name: FourierSeries(getattr(stage, key)[:, None])
            for name, key in (
                ("stiffness", "slope_stiffness"),
                ("force", "slope_moment"),
                ("deflection", "slope_start"),
            )
            if len(stage.slope_stiffness)
        }
        made.append(_element(stage, stage.slope, basic, place, slope, bases, separates=False))
        elements += [element for element in made if element is not None]
        assert made[0] is not None
        flanks.append((made[0], made[1]))
        columns.append(basic)
        count += len(at)
    # without any stage a column that nothing acts on
    return np.hstack(columns) if stages else np.zeros((len(mass), 1)), tuple(elements), tuple(flanks)


def _parts(directions: TurningDirections) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return directions.fixed, directions.even, directions.odd


def _flank_series(
    stage: NonlinearStage, chosen: np.ndarray, harmonics: int, bases: int, *, back: bool
) -> dict[str, FourierSeries]:
    """Series of stiffness, deflection and force of drive flanks, or of back flanks, of so many mesh harmonics."""
    if not len(chosen):
        return {}
    excitation, orders = stage.excitation, orders_of(stage.mesh_base, bases)
    lines = {
        name: harmonics_of(getattr(excitation, name)[chosen], harmonics * excitation.periods)
        for name in ("stiffness", "deflection", "force")
    }
    if back:
        # the gap behind closes as flanks in front part: the line of the drive flank, mirrored beyond the backlash
        lines["force"], lines["deflection"] = -lines["force"], -lines["deflection"]
        lines["deflection"][:, 0] += excitation.backlash[chosen]
    return {name: FourierSeries(values, orders) for name, values in lines.items()}


def _element(
    stage: NonlinearStage,
    directions: TurningDirections,
    basic: np.ndarray,
    first: int,
    series: dict[str, Any],
    bases: int,
    *,
    separates: bool,
) -> Element | None:
    """Element of flanks, or of slopes, whose columns begin at the ``first`` or that turn on basic columns (n, d)."""
    count = len(directions.fixed)
    if not count:
        return None
    if not stage.turns:
        return GearMeshes(first + np.arange(count), **series, separates=separates)
    on = directions.on(basic)
    columns = np.tile(first + np.arange(basic.shape[1]), (count, 1))
    wave = turning_wave(orders_of(stage.turn_base, bases, stage.sense))
    return TurningMeshes(columns, *_parts(on), wave, **series, separates=separates)
