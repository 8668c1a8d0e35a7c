"""Response of a gearbox to the excitation of every stage, over the speed.

Each stage is solved with its own stiffness k(t) in the structure of all the rest, where the other meshes have their
mean stiffness (`femgear.trains.gearbox.stage_structure`). Lines of all stages add at sensors, feet and bearings. What
that leaves out, k(t) of one stage on the motion that another one makes, is estimated (`cross_excitation`).

Friction of the teeth, where it acts, is a source of every stage (`femgear.trains.gearbox.friction`).

Damping is structural: springs and structure have the loss factor ``2 zeta``, with which a mode has the damping ratio
zeta at its own frequency, wherever its energy lies (L. Cremer, M. Heckl, B. Petersson, Structure-Borne Sound, 2005).
Torques and loads are those of one load case at all speeds; speeds are in proportion to one another. Gyroscopic terms
of shafts are left out, those of the running planets are in.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from femgear.case.dependencies import Steps
from femgear.housing.two_way.running_planets import RunningResponse, ring_lines, solve_excitations
from femgear.report.tables import merged_names
from femgear.stages.protocol import Progress, silent
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.case_file import CASING
from femgear.trains.gearbox.deflection import Deflection, spread_rows
from femgear.trains.gearbox.elastic_ring import ElasticRing, elastic_rings
from femgear.trains.gearbox.excitation import excitation_of, exciting_stages
from femgear.trains.gearbox.model import GearboxModel, StageModel, reference_shaft
from femgear.trains.gearbox.paths import CasingPaths, casing_paths, forces_on_casing
from femgear.trains.gearbox.planet_branches import running_sets
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.running_branches import BranchForces, branch_kinds, kinds_together
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows
from femgear.trains.gearbox.stage_structure import StructuredStage, running_stage

_MOST = 2000
"""Mesh harmonics at most."""
_TOGETHER = 16
"""Speeds whose levels are computed at once."""
_MANY = 64
"""Speeds beyond which lines are kept in single precision: those of a run-up of a large gearbox fill a gigabyte."""
_INSTANTS, _TURNS = 256, 16
"""Instants of a mesh period, and angles of the carrier, at which mesh forces are looked at."""


@dataclass(frozen=True)
class StageLines:
    """Lines that one stage makes at all speeds, of amplitudes ``Re sum u exp(i frequency t)``.

    Parameters
    ----------
    name : str
        Of the stage.
    harmonic, side_band : (L,) arrays
        Multiple of the mesh frequency of every line, broken where teeth repeat after several mesh periods, and the
        turns of the carrier beside it.
    order : (L,) array
        Frequency over that of the reference shaft [1].
    motion : (v, k, L) complex array
        Displacements of the outputs [m], see `output_rows`; NaN-free, zero beyond the harmonics of a speed. Of many
        speeds in single precision.
    force : (v, kinds, 3) array
        Mean, largest and smallest force of a mesh of every kind (with the sun, with the ring) [N].
    mean_stiffness, spread : (kinds,) arrays
        Mean mesh stiffness, and r.m.s. of what fluctuates in it [N/m].
    dynamic_force : (v, kinds) array
        R.m.s. of the mesh force about its mean [N].
    approach : (v, M) array
        R.m.s. of the approach of all meshes of the gearbox by this stage [m]; NaN of its own.
    residual, radius, tail, outer : (v,) arrays
        Residual of the equations, spectral radius without GMRES, share of the mesh forces in the upper half of the
        harmonics, and in the outermost side bands [1].
    products : (v,) int array
        Products with the fluctuating stiffness.
    harmonics : (v,) int array
        Mesh harmonics.
    meshes : tuple of int
        Numbers of the meshes of the stage, kind by kind.
    varying : tuple of int
        Numbers of the meshes whose k(t) acts on the motion.
    paths : (v, P, s, L) complex array, optional
        Displacements of the sensors by every path into the casing [m], see `CasingPaths`.
    """

    name: str
    harmonic: np.ndarray
    side_band: np.ndarray
    order: np.ndarray
    motion: np.ndarray
    force: np.ndarray
    mean_stiffness: np.ndarray
    spread: np.ndarray
    dynamic_force: np.ndarray
    approach: np.ndarray
    residual: np.ndarray
    radius: np.ndarray
    tail: np.ndarray
    outer: np.ndarray
    products: np.ndarray
    harmonics: np.ndarray
    meshes: tuple[int, ...]
    varying: tuple[int, ...]
    paths: np.ndarray | None = None


@dataclass(frozen=True)
class GearboxResponse:
    """Response of a gearbox at speeds in proportion to those of a load case.

    Parameters
    ----------
    deflection : Deflection
        Loaded state about which the gearbox vibrates.
    reference : str
        Shaft whose speed counts.
    speed : (v,) array
        Of the reference shaft [rad/s], positive.
    stages : tuple of StageLines
        Of all stages that excite.
    missing : tuple of str
        Stages without teeth or contact ratio, or without torque, which excite nothing.
    up_to : float
        Frequency up to which stages excite [Hz].
    paths : tuple of str
        Ways into the casing whose displacements the stages have; none where they were not asked for.
    """

    deflection: Deflection
    reference: str
    speed: np.ndarray
    stages: tuple[StageLines, ...]
    missing: tuple[str, ...]
    up_to: float
    paths: tuple[str, ...] = ()

    @property
    def cross_excitation(self) -> np.ndarray:
        """Force (v, stages, stages) of k(t) of a stage (first) on the motion by another one, over its dynamic force.

        R.m.s. values, the latter by all stages; zero of a stage itself.
        """
        shares = np.zeros((len(self.speed), len(self.stages), len(self.stages)))
        every = self.dynamic_forces
        for a, excited in enumerate(self.stages):
            count = len(excited.meshes) // len(excited.spread)
            for b, other in enumerate(self.stages):
                if a == b or not {*other.varying}.isdisjoint(excited.meshes):
                    continue
                moved = other.approach[:, list(excited.meshes)].reshape(len(self.speed), -1, count).max(axis=2)
                whole = np.maximum(every[:, a, : len(excited.spread)], np.finfo(float).tiny)
                shares[:, a, b] = (excited.spread * moved / whole).max(axis=1)
        return shares

    @property
    def dynamic_forces(self) -> np.ndarray:
        """R.m.s. force (v, stages, 2) of the meshes of every stage and kind about its mean by all stages [N].

        That of the planet with the largest one; NaN where a pair has no second mesh.
        """
        every = np.sqrt((self.mesh_forces**2).sum(axis=2))
        forces = np.full((len(self.speed), len(self.stages), 2), np.nan)
        for number, stage in enumerate(self.stages):
            kinds = len(stage.spread)
            of_stage = every[:, list(stage.meshes)].reshape(len(every), kinds, -1)
            forces[:, number, :kinds] = of_stage.max(axis=2)
        return forces

    @property
    def mesh_forces(self) -> np.ndarray:
        """R.m.s. force (v, M, stages) of all meshes about their means by each stage [N]; own ones of planet 1."""
        model = self.deflection.model
        loss = abs(1.0 + 2j * model.case.modes.damping_ratio)
        stiffness = loss * np.array([contact.stiffness.sum() for contact in model.assembly.contacts])
        forces = np.stack([stage.approach * stiffness for stage in self.stages], axis=2)
        for number, stage in enumerate(self.stages):
            of_stage = np.repeat(stage.dynamic_force, len(stage.meshes) // stage.dynamic_force.shape[1], axis=1)
            forces[:, list(stage.meshes), number] = of_stage
        return forces


def output_rows(state: Deflection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make rows of all motions for sensors (s, 6n), bearings (3b, 6n) and feet (3f, 6n).

    Those of sensors give displacements [1, m]. Those of bearings and feet give, by stiffness and damping, forces on the
    shaft and on the casing along x, y, z [N/m, N]; NaN where they are rigid.
    """
    model = state.model
    assembly, loss = model.assembly, 2.0 * model.case.modes.damping_ratio
    bearings = np.zeros((len(model.bearings), 3, assembly.count), complex)
    for row, springs, tangent in zip(bearings, model.bearings, state.bearing_stiffness, strict=True):
        finite = np.where(np.isfinite(tangent[:3]), tangent[:3], 0.0)
        row[:] = -(1.0 + 1j * loss) * finite @ spread_rows(springs, assembly)
        row[np.isinf(tangent[:3]).any(axis=1)] = np.nan
    casing = model.casing
    feet = np.zeros((0, assembly.count), complex)
    if casing is not None:
        feet = np.zeros((len(casing.feet), 3, assembly.count), complex)
        for row, springs, stiffness in zip(feet, casing.feet, casing.foot_stiffness, strict=True):
            finite = np.where(np.isfinite(stiffness[:3]), stiffness[:3], 0.0)
            row[:] = -(1.0 + 1j * loss) * finite[:, None] * spread_rows(springs, assembly)[:3]
            row[np.isinf(stiffness[:3])] = np.nan
    return sensor_rows(model), bearings.reshape(-1, assembly.count), feet.reshape(-1, assembly.count)


def solve_gearbox_response(
    state: Deflection,
    speed: Sequence[float] | np.ndarray,
    *,
    steps: Steps | None = None,
    progress: Progress = silent,
    stage: str = "dynamics",
    by_path: bool = False,
    friction: bool = True,
) -> GearboxResponse:
    """Solve for the response of a gearbox to all its stages.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    speed : (v,) sequence of float
        Of the reference shaft [rad/s], positive.
    steps : Steps, optional
        What other computations have left: excitations are kept in it.
    progress : callable
        Called with (stage, done, total).
    stage : str
        Name for it.
    by_path : bool
        Find what sensors hear by every way into the casing.
    friction : bool
        Whether friction of the teeth acts where the case asks for it.

    Raises
    ------
    FemgearError
        A mesh that opens (E-CONTACT-OPEN), equations that are nearly singular (E-RESONANCE).
    """
    model, steps = state.model, steps or Steps()
    rings = elastic_rings(model, steps=steps, friction=friction)
    case, reference = model.case, reference_shaft(model)
    nominal, speeds = abs(model.flow.speed[reference]), np.asarray(speed, float)
    up_to = case.dynamics.up_to
    rows, sensors = np.vstack(output_rows(state)), gearbox_sensors(case)
    paths = casing_paths(state) if by_path else None
    lines, staged, phases = list[StageLines](), exciting_stages(state), pair_phases(case, model.flow)
    excitations = {stage.name: excitation_of(state, stage, rings, steps=steps, friction=friction) for stage in staged}
    parts = [*_exciting_parts(state, staged, excitations, phases, rings)]
    for done, together in enumerate(parts, start=1):
        outputs = [_outputs(model, part, rows, len(sensors)) for part in together]
        lines += _stage_lines(state, together, outputs, speeds / nominal, paths)
        progress(stage, done, len(parts))
    missing = tuple(stage.name for stage in model.stages if stage not in staged)
    # what runs around has the phases of its teeth
    alone = {part.name: phases.get(part.name, 0.0) for (part, *_) in parts if part.forces is None}
    lines = _in_phase(lines, alone)
    names = () if paths is None else paths.names
    return GearboxResponse(state, reference, speeds, tuple(lines), missing, up_to, names)


def _outputs(model: GearboxModel, part: _ExcitingPart, rows: np.ndarray, sensors: int) -> np.ndarray:
    """Outputs (k, m) per unit of a mode of the structure of a part, the last ones approaches of meshes.

    ``rows`` (k, 6n) are those of `output_rows`, the first ones of so many sensors.
    """
    outputs = np.vstack([rows, mesh_rows(model, part.running_meshes)])
    outputs[sensors + part.running_rows] = 0.0
    at_sensors = part.structured.at_sensors(rows[:sensors], gearbox_sensors(model.case))
    return np.vstack([at_sensors, outputs[sensors:] @ part.structured.motion])


def _in_phase(lines: Sequence[StageLines], phases: Mapping[str, float]) -> list[StageLines]:
    """Lines of stages that begin with the phases of their teeth [mesh periods]; those of planetary sets stay."""
    turned = list[StageLines]()
    for stage in lines:
        factor = np.exp(2j * math.pi * phases.get(stage.name, 0.0) * stage.harmonic).astype(stage.motion.dtype)
        paths = None if stage.paths is None else stage.paths * factor
        turned.append(replace(stage, motion=stage.motion * factor, paths=paths) if phases.get(stage.name) else stage)
    return turned


@dataclass(frozen=True)
class _ExcitingPart:
    """What excites a gearbox at once: a stage, or one kind of the meshes of planets that are shafts.

    Parameters
    ----------
    name : str
        Of it.
    stages : tuple of StageModel
        Its stages, several of planets that are shafts.
    structured : StructuredStage
        As it runs in the structure of the rest.
    forces : BranchForces, optional
        Of planets that are shafts.
    """

    name: str
    stages: tuple[StageModel, ...]
    structured: StructuredStage
    forces: BranchForces | None = None

    @property
    def meshes(self) -> tuple[int, ...]:
        """Numbers of its meshes, kind by kind."""
        return tuple(mesh for stage in self.stages for mesh in stage.meshes)

    @property
    def running_meshes(self) -> Collection[int]:
        """Numbers of the meshes that are no motions of the structure: its own, of planets all on their carrier."""
        return self.meshes if self.forces is None else self.forces.meshes.keys()

    @property
    def running_rows(self) -> np.ndarray:
        """Rows of all bearing forces that are those of its pins."""
        pins = [] if self.forces is None else list(self.forces.pins)
        return (3 * np.array(pins, int)[:, None] + np.arange(3)).ravel()

    @property
    def exciting_kinds(self) -> slice:
        """Kinds of meshes of the running stage that excite."""
        return slice(None) if self.forces is None else self.forces.exciting_kinds


def _exciting_parts(
    state: Deflection,
    staged: Sequence[StageModel],
    excitations: Mapping[str, MeshExcitation],
    phases: Mapping[str, float],
    rings: Sequence[ElasticRing],
) -> Iterator[list[_ExcitingPart]]:
    """Take what excites a gearbox out of it; parts that differ in their excitation alone stand together."""
    stages, done = {stage.name: stage for stage in staged}, set[str]()
    for running in running_sets(state.model.case):
        left = [kind for kind, names in enumerate(running.kinds) if not stages.keys().isdisjoint(names)]
        while left:
            together = kinds_together(state.model, running, left[0])
            kinds = [kind for kind in left if kind in together]
            left = [kind for kind in left if kind not in together]
            for group in branch_kinds(state, running, kinds, excitations, phases, rings):
                names = [running.kinds[together[forces.exciting_kinds.start]] for _, forces in group]
                yield [_kind_part(state.model, of_kind, *made) for of_kind, made in zip(names, group, strict=True)]
            done |= {name for kind in kinds for name in running.kinds[kind]}
    for stage in staged:
        if stage.name not in done:
            structured = running_stage(state, stage, excitations[stage.name], rings)
            yield [_ExcitingPart(stage.name, (stage,), structured)]


def _kind_part(
    model: GearboxModel, names: Collection[str], structured: StructuredStage, forces: BranchForces
) -> _ExcitingPart:
    """One kind of meshes, of these names, of planets that are shafts."""
    members = tuple(stage for stage in model.stages if stage.name in names)
    return _ExcitingPart(merged_names([*names]), members, structured, forces)


def mesh_rows(model: GearboxModel, meshes: Collection[int]) -> np.ndarray:
    """Rows (M, 6n) of the approach of the flanks of all meshes in the middle of their slices; zero of these ones."""
    assembly = model.assembly
    rows = np.zeros((len(assembly.contacts), assembly.count))
    for number, part in enumerate(assembly.slices):
        if number not in meshes:
            rows[number] = assembly.columns[:, part].mean(axis=1)
    return rows


def _stage_lines(
    state: Deflection,
    parts: Sequence[_ExcitingPart],
    outputs: Sequence[np.ndarray],
    factors: np.ndarray,
    paths: CasingPaths | None,
) -> list[StageLines]:
    """Lines at all speeds of parts that differ in their excitation alone.

    Of outputs (k, m) of each per unit of a mode of the structure, the last ones approaches of meshes.
    """
    model, first = state.model, parts[0]
    stage, dynamics = first.stages[0], model.case.dynamics
    mesh = 2.0 * math.pi * model.flow.mesh_frequency[stage.name]
    turns = first.structured.orbit is not None
    carrier, bands = (_carrier_speed(model, stage), dynamics.side_bands) if turns else (0.0, 0)
    most = dynamics.mesh_harmonics or _MOST
    highest = np.floor(2.0 * math.pi * dynamics.up_to / (mesh * factors) * (1.0 + 1e-12))
    counts = np.clip(highest, 1, most).astype(int)
    stages, longest = [part.structured.running for part in parts], int(counts.argmax())

    def solve(i: int) -> list[RunningResponse]:
        options = {"harmonics": (int(counts[i]),) * 2, "side_bands": bands, "tolerance": dynamics.tolerance}
        return solve_excitations(stages, mesh * factors[i], carrier * factors[i], **options)

    most_lines = solve(longest)
    of_parts = [
        _PartLines(state, part, rows, len(factors), response, paths)
        for part, rows, response in zip(parts, outputs, most_lines, strict=True)
    ]

    def keep(i: int) -> None:
        for lines, response in zip(of_parts, most_lines if i == longest else solve(i), strict=True):
            lines.keep(i, response)

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(keep, range(len(factors))))
    nominal = abs(model.flow.speed[reference_shaft(model)])
    return [lines.collected(mesh / nominal, carrier / nominal, counts) for lines in of_parts]


class _PartLines:
    """Lines of one part at all speeds, kept speed by speed.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    part : _ExcitingPart
        What excites.
    outputs : (k, m) array
        Per unit of a mode of the structure, the last ones approaches of meshes.
    speeds : int
        Their number.
    longest : RunningResponse
        That with the most harmonics.
    paths : CasingPaths or None
        Into the casing.
    """

    def __init__(
        self,
        state: Deflection,
        part: _ExcitingPart,
        outputs: np.ndarray,
        speeds: int,
        longest: RunningResponse,
        paths: CasingPaths | None,
    ):
        self.state, self.part, self.outputs, self.casing_paths = state, part, outputs, paths
        running, sensors = part.structured.running, gearbox_sensors(state.model.case)
        self.on_own_ring = [number for number, sensor in enumerate(sensors) if sensor.ring == part.name]
        on_ring = [sensors[i] for i in self.on_own_ring]
        self.places = np.array([sensor.angle for sensor in on_ring]), np.array([sensor.on_ring for sensor in on_ring])
        at_ring = ring_lines(running, longest, *self.places)
        self.line, self.band, self.at = _line_numbers(
            longest, running.paths.symmetry, at_ring, on_pins=part.forces is not None
        )
        self.periods = longest.orders.periods
        self.measured = len(outputs) - len(state.model.assembly.contacts)
        precision = np.complex64 if speeds > _MANY else np.complex128
        self.motion = np.zeros((speeds, self.measured, len(self.line)), precision)
        count = len(running.paths.planet_angles)
        self.mean_force = running.excitation.force.mean(axis=1).reshape(-1, count)[part.exciting_kinds].mean(axis=1)
        kinds = len(self.mean_force)
        self.force, self.dynamic_force = np.zeros((speeds, kinds, 3)), np.zeros((speeds, kinds))
        self.approach = np.full((speeds, len(outputs) - self.measured), np.nan)
        self.figures = np.zeros((5, speeds))
        self.by_path = None
        if paths is not None:
            self.by_path = np.zeros((speeds, len(paths.names), len(paths.sensors), len(self.line)), complex)

    def keep(self, i: int, response: RunningResponse) -> None:
        """Keep the lines at a speed."""
        part, model, running = self.part, self.state.model, self.part.structured.running
        few = self.line < len(response.modal)
        there = self.line[few], self.at[few]
        amplitude = response.lines(self.outputs.T)[there]
        amplitude[:, self.on_own_ring] += ring_lines(running, response, *self.places)[there]
        self.motion[i][:, few] = amplitude[:, : self.measured].T
        self.approach[i] = np.sqrt(0.5 * (np.abs(amplitude[:, self.measured :]) ** 2).sum(axis=0))
        if self.casing_paths is not None and self.by_path is not None:
            paths, motion = self.casing_paths, part.structured.motion
            forces = forces_on_casing(paths, self.state, part.name, part.structured, response)
            forces = np.moveaxis(response.one_sided(forces)[there], 0, -1)
            moved = response.lines(motion[paths.places].T)[there].T
            self.by_path[i][..., few] = paths.heard(forces, moved, response.frequency[there])
        if part.forces is not None:
            self.motion[i][:, few] += _on_pins(part.forces, model, response, self.measured, there).T
            _add_branch_meshes(self.approach[i], part.forces, model, response)
        low, high, self.dynamic_force[i] = _extremes(response, part.exciting_kinds)
        self.force[i] = np.stack([self.mean_force, self.mean_force + high, self.mean_force + low], axis=1)
        self.figures[:, i] = response.residual, response.radius, *response.tail, response.products

    def collected(self, mesh_order: float, carrier_order: float, counts: np.ndarray) -> StageLines:
        """Collect the lines of all speeds by the orders of mesh and carrier, and the harmonics (v,) of each."""
        part, running = self.part, self.part.structured.running
        self.approach[:, list(part.meshes)] = np.nan
        harmonic = self.line / self.periods
        order = harmonic * mesh_order + self.band * carrier_order
        count = len(running.paths.planet_angles)
        stiffness = running.excitation.stiffness.reshape(running.kinds, count, -1)[part.exciting_kinds]
        residual, radius, tail, outer, products = self.figures
        lines = part.name, harmonic, self.band, order, self.motion, self.force
        means = stiffness.mean(axis=(1, 2)), stiffness.std(axis=2).max(axis=1), self.dynamic_force, self.approach
        solved = residual, radius, tail, outer, products.astype(int), counts
        return StageLines(*lines, *means, *solved, part.meshes, _varying(part), self.by_path)


def _varying(part: _ExcitingPart) -> tuple[int, ...]:
    """Numbers of the meshes whose k(t) acts on the motion: of branches those of all kinds of one mesh frequency."""
    if part.forces is None:
        return part.meshes
    kinds = range(part.structured.running.kinds)
    return tuple(mesh for mesh, (_, point) in part.forces.meshes.items() if point in kinds)


def _carrier_speed(model: GearboxModel, stage: StageModel) -> float:
    """Speed of the carrier of a stage, without sign [rad/s]."""
    carrier = stage.section.carrier
    return 0.0 if carrier is None or carrier == CASING else abs(model.flow.speed[carrier])


def _on_pins(
    forces: BranchForces, model: GearboxModel, response: RunningResponse, outputs: int, lines: tuple[np.ndarray, ...]
) -> np.ndarray:
    """Lines (L, outputs) of the forces of bearings on pins on their planets, along the axes of the planet [N].

    ``lines`` are their numbers and places of the side bands of the structure.
    """
    lines_of_pins, sensors = np.zeros((len(lines[0]), outputs), complex), len(gearbox_sensors(model.case))
    places = response.orders.place(response.band[lines[1]])
    there = places < len(response.orders.bands)
    for bearing, (branch, points, ways) in forces.pins.items():
        group, turn = response.leaders[branch]
        pushed = np.einsum("cbr,cw->brw", response.force[group, points], ways)
        whole = response.orders.base[:, None] + response.orders.bands
        N = response.orders.paths.symmetry
        pushed = pushed * np.exp(2j * math.pi * (response.orders.sense * turn * (whole % N) % N) / N)[..., None]
        at = sensors + 3 * bearing + np.arange(3)
        lines_of_pins[np.ix_(there, at)] = 2.0 * pushed[lines[0][there], places[there]]
    return lines_of_pins


def _add_branch_meshes(
    approach: np.ndarray, forces: BranchForces, model: GearboxModel, response: RunningResponse
) -> None:
    """Add the r.m.s. approaches of the meshes on the carrier, by their forces, to those (M,) of the structure [m]."""
    loss = abs(1.0 + 2j * model.case.modes.damping_ratio)
    for mesh, (branch, point) in forces.meshes.items():
        force = response.force[response.leaders[branch][0], point]
        energy = 2.0 * (np.abs(force) ** 2).sum() - (np.abs(force[0]) ** 2).sum()
        approach[mesh] = math.sqrt(energy) / (loss * model.assembly.contacts[mesh].stiffness.sum())


def _line_numbers(
    response: RunningResponse, symmetry: int, on_ring: np.ndarray, *, on_pins: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Line and side band (L,) of what moves structure, ring and pins, and the places of these bands."""
    moved = (np.abs(response.modal).max(axis=2) > 0.0) | (np.abs(on_ring).max(axis=2, initial=0.0) > 0.0)
    if symmetry > 1:
        moved[0, response.band % symmetry != 0] = False
    if on_pins:
        moved |= np.abs(response.band) <= response.orders.bands[-1]
    moved[0, response.band <= 0] = False
    line, at = np.nonzero(moved)
    return line, response.band[at], at


def _extremes(response: RunningResponse, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smallest and largest force (kinds,) of the leading meshes of own kinds beyond their mean, and its r.m.s. [N].

    Over a mesh period and a turn of the carrier, which are seldom in a small ratio.
    """
    force = response.force[:, : response.kinds][:, rows]
    leaders, kinds, lines, bands = force.shape
    points = max(_INSTANTS, 4 * lines)
    spectrum = np.zeros((leaders, kinds, points, bands), complex)
    spectrum[:, :, :lines] = 2.0 * force
    spectrum[:, :, 0] *= 0.5
    in_time = np.fft.ifft(spectrum, axis=2, norm="forward")
    turn = np.arange(_TURNS if bands > 1 and response.carrier_speed else 1) / _TURNS
    wave = np.exp(2j * np.pi * np.outer(np.arange(bands) - bands // 2, turn))
    values = np.real(in_time @ wave)
    energy = 2.0 * (np.abs(force) ** 2).sum(axis=(2, 3)) - (np.abs(force[:, :, 0]) ** 2).sum(axis=2)
    return values.min(axis=(0, 2, 3)), values.max(axis=(0, 2, 3)), np.sqrt(energy.max(axis=0))


def by_order(response: GearboxResponse, lines: Mapping[str, np.ndarray]) -> np.ndarray:
    """Add lines (v, k, L) of all stages by name that have one order, with their phase: (v, k, orders)."""
    order = np.concatenate([stage.order for stage in response.stages])
    whole = np.concatenate([lines[stage.name] for stage in response.stages], axis=2)
    rounded = np.round(order / order.max(initial=1.0), 9)
    ascending = np.argsort(rounded, kind="stable")
    first = np.flatnonzero(np.diff(rounded[ascending], prepend=-1.0))
    return np.add.reduceat(whole[..., ascending], first, axis=2)


def level(response: GearboxResponse, lines: Mapping[str, np.ndarray]) -> np.ndarray:
    """R.m.s. (v, k) over the lines (v, k, L) of all stages by name; lines at one order add with their phase."""
    speeds = len(response.speed)
    # some speeds after the others: lines of all outputs in order would be twice what the response itself fills
    parts = [
        0.5 * (np.abs(by_order(response, {name: values[block] for name, values in lines.items()})) ** 2).sum(axis=2)
        for block in np.array_split(np.arange(speeds), math.ceil(speeds / _TOGETHER))
    ]
    return np.sqrt(np.concatenate(parts))


def accelerations(response: GearboxResponse, count: int) -> dict[str, np.ndarray]:
    """Accelerations (v, s, L) of the sensors, the first ``count`` outputs, by every stage [m/s^2]."""
    moved = {stage.name: stage.motion[:, :count] for stage in response.stages}
    squares = {stage.name: -((stage.order * response.speed[:, None])[:, None] ** 2) for stage in response.stages}
    # of their precision
    return {name: squares[name].astype(np.finfo(lines.dtype).dtype) * lines for name, lines in moved.items()}
