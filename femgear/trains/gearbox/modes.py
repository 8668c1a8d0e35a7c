"""Modes of a whole gearbox about its loaded state, where their energy lies, and the Campbell diagram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from femgear.case.dependencies import Steps
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.tracking import CampbellData, campbell_data
from femgear.system.assembly import Assembly, Beam
from femgear.system.mode_kinds import SetMotions, class_energies, named_kinds
from femgear.system.system import MechanicalSystem, Modes
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection
from femgear.trains.gearbox.casing import called
from femgear.trains.gearbox.deflection import Deflection, laws_of
from femgear.trains.gearbox.elastic_carrier import with_carriers
from femgear.trains.gearbox.elastic_ring import elastic_rings, with_rings
from femgear.trains.gearbox.entry_checks import check_shafts_have_mass
from femgear.trains.gearbox.mode_words import MESH_LINES
from femgear.trains.gearbox.model import GearboxModel, StageModel, member_of_stations
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows

# Share of the kinetic energy from which a mode is of one kind.
_PURE = 0.8
# Modes of the Campbell diagram at most.
_MOST_BRANCHES = 40
# Modes that are kept at least.
_LEAST = 20
# Modes at rest on which one of the Campbell diagram is followed.
_BASIS = 2
# Reach of the inner modes of elastic carriers, over that of the modes.
_REACH = 2.0
# Share of the largest slice force below which a slice carries nothing but rounding.
_IDLE = 1e-9
KINDS = ("torsional", "bending", "axial", "casing", "ring", "carrier")
"""Of modes by their kinetic energy: shafts' rotation, motions across the axes and tilts, along them; casing; elastic
rings and carriers."""
_MOTIONS = ((5,), (0, 1, 3, 4), (2,))
_ROTATIONAL, _TRANSLATIONAL = (2, 5), (0, 1, 3, 4)
"""Motions of bodies on the axis by class: along it and about it; across it and tilts."""


@dataclass(frozen=True)
class StageMotions:
    """In which stages of a gearbox its modes live, and what the planets do.

    With equal planets at equal angles the classes of one planetary set survive where several are joined on one axis:
    rotational and translational modes reach over all of them, a planet mode stays in one and has the frequency that it
    has there alone (D. R. Kiracofe and R. G. Parker, J. Vib. Acoust. 129, 2007, 1-16).

    Parameters
    ----------
    energy : (S, m) array
        Share of every stage in the kinetic energy: its planets, and the shafts of its gears; of a shaft with gears of
        several stages an equal part.
    kinds : tuple of str
        ``rigid``; ``rotational``, ``translational`` or ``planet`` where 99 % of the kinetic energy of the whole gearbox
        are of that class: shafts turn or move along their axes, and planets move alike; shafts move across and tilt,
        and planets as a wave around the axis; planets alone move, in no such pattern. Else ``mixed``; all empty
        without a planetary stage.
    """

    energy: np.ndarray
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class GearboxModes:
    """Modes at rest with the stiffnesses of the loaded state, and over the speed.

    Parameters
    ----------
    deflection : Deflection
        The loaded state that gives bearings and meshes their stiffness.
    modes : Modes
        ``kind`` is that of `KINDS` with 80 % of the kinetic energy, ``"mixed"``, or ``"rigid"``.
    motion : (6n, m) array
        Mode shapes in all motions of all stations [kg^-1/2], rotations in kg^-1/2 m^-1.
    members : tuple of str
        Shafts, planets, elastic rings and carriers of the stages.
    kinetic : (members, m) array
        Share of every member in the kinetic energy.
    parts : tuple of str
        Shafts, bearings, couplings and pins, meshes, elastic rings and carriers of the stages.
    strain : (parts, m) array
        Share of every part in the strain energy; zero of rigid motions.
    campbell : CampbellData
        Modes and critical speeds over the speed of ``reference``.
    reference : str
        Shaft whose speed counts: the first one that is given.
    orders : mapping of str to float
        Lines of excitation by name, over the turn of the reference shaft.
    stages : StageMotions
        Shares of the stages in the kinetic energy, and what the planets do.
    at_sensors : (s, m) array
        Displacements of all sensors along their directions [kg^-1/2].
    """

    deflection: Deflection
    modes: Modes
    motion: np.ndarray
    members: tuple[str, ...]
    kinetic: np.ndarray
    parts: tuple[str, ...]
    strain: np.ndarray
    campbell: CampbellData
    reference: str
    orders: dict[str, float]
    stages: StageMotions
    at_sensors: np.ndarray


def linear_system(state: Deflection) -> tuple[Assembly, MechanicalSystem, np.ndarray]:
    """Linearise a gearbox about its loaded state: assembly with bearings, system, stiffness (s,) of slices [N/m].

    Slices that carry nothing have no stiffness. CaseError: a shaft without mass (E-MASS).
    """
    model = state.model
    check_shafts_have_mass(model.case)
    bearings = []
    for number, law, springs in laws_of(model, model.estimate):
        tangent = law.share(state.bearing_stiffness[number])
        bearings.append(Beam(springs.stations, springs.rows.T @ tangent @ springs.rows))
    assembly = replace(model.assembly, beams=(*model.assembly.beams, *bearings))
    return assembly, assembly.system(), _pressed_stiffness(state)


def _pressed_stiffness(state: Deflection) -> np.ndarray:
    """Stiffness (g,) of the slices: those that carry share that of their mesh; an idle mesh keeps its own [N/m]."""
    stiffness = state.model.assembly.slice_stiffness.copy()
    if not np.any(state.model.load):
        return stiffness
    # the forces of an idle mesh are rounding, and would choose its slices by chance
    least = _IDLE * state.slice_force.max(initial=0.0)
    for part in state.model.assembly.slices:
        carrying = state.slice_force[part] > least
        if carrying.any() and not carrying.all():
            total = stiffness[part].sum()
            stiffness[part] = np.where(carrying, total / carrying.sum(), 0.0)
    return stiffness


def solve_gearbox_modes(state: Deflection, *, steps: Steps | None = None) -> GearboxModes:
    """Solve for the modes of a gearbox about its loaded state, and follow them over the speed."""
    model, case = state.model, state.model.case
    assembly, system, stiffness = linear_system(state)
    frequencies = [hertz for hertz in model.flow.mesh_frequency.values() if hertz]
    top = case.modes.up_to or (MESH_LINES * max(frequencies) if frequencies else None)
    rings = elastic_rings(model, steps=steps)
    system, stiffness = with_rings(system, stiffness, assembly, dict(enumerate(assembly.slices)), rings)
    carriers = [stage.elastic_carrier for stage in model.stages if stage.elastic_carrier is not None]
    carriers = [carrier.below(math.inf if top is None else _REACH * top) for carrier in carriers]
    system = with_carriers(system, assembly, carriers)
    still = replace(system, gyroscopic=None, load=np.zeros(len(system.dofs)))
    kept = count_modes(still, stiffness, top)
    modes = undamped_modes(still, stiffness, damping_ratio=case.modes.damping_ratio, count=kept)
    count = assembly.motions.shape[1]
    motion, waves = assembly.motions @ modes.shape[:count], modes.shape[count:]
    squares = {ring.name: ring.stiffness for ring in rings} | {
        carrier.name: carrier.frequency**2 for carrier in carriers
    }
    inner = _inner_energies(squares, waves * (system.M @ modes.shape)[count:])
    moved = assembly.mass @ motion
    for ring, part in zip(rings, _parts(squares), strict=False):
        moved += ring.mass_coupling(assembly).T @ waves[part]
    for carrier, part in zip(carriers, _parts(squares)[len(rings) :], strict=True):
        moved += carrier.on_all_motions(assembly.count) @ waves[part]
    named = [ring.name for ring in rings], [carrier.name for carrier in carriers]
    members, kinetic, kinds = _kinetic(model, motion, moved, modes, inner, named)
    inner = _inner_energies(squares, waves**2 * np.concatenate([np.zeros(0), *squares.values()])[:, None])
    parts, strain = _strain(state, assembly, motion, _mesh_energies(system, stiffness, modes), modes, inner)
    reference = model.flow.independent[0] if model.flow.independent else case.shaft[0].name
    speed = abs(model.flow.speed[reference])
    orders = excitation_orders(model, reference)
    speeds = np.linspace(0.0, case.modes.highest_speed * max(speed, 1.0), case.modes.speeds)
    count = int(np.clip(np.count_nonzero(modes.frequency > 0.0), 1, _MOST_BRANCHES))
    turning = _in_modes(still, stiffness, system.gyroscopic, speed, count)
    followed = campbell_data(lambda _: turning, speeds, np.zeros(0), orders=tuple(orders.values()), count=count)
    stages = stage_motions(model, motion, moved, modes.frequency)
    sensors, at_sensors = gearbox_sensors(case), sensor_rows(model) @ motion
    for ring, part in zip(rings, _parts(squares), strict=False):
        at_sensors += ring.sensor_rows(sensors) @ waves[part]
    named = reference, orders, stages, at_sensors
    return GearboxModes(state, replace(modes, kind=kinds), motion, members, kinetic, parts, strain, followed, *named)


def _parts(inner: Mapping[str, np.ndarray]) -> list[slice]:
    """Coordinates of every elastic ring and carrier behind those of the stations."""
    ends = np.cumsum([0, *(len(squares) for squares in inner.values())]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def _inner_energies(inner: Mapping[str, np.ndarray], energy: np.ndarray) -> dict[str, np.ndarray]:
    """Energy (m,) of every elastic ring and carrier in all modes, from that of its coordinates (n, m)."""
    return {name: energy[part].sum(axis=0) for name, part in zip(inner, _parts(inner), strict=True)}


def _mesh_energies(system: MechanicalSystem, stiffness: np.ndarray, modes: Modes) -> np.ndarray:
    """Energy (g, m) of all slices in all modes, with what bodies give way between them."""
    return spring_forces(system, stiffness, modes.shape) * (system.W.T @ modes.shape)


def spring_forces(system: MechanicalSystem, stiffness: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Compute forces (g, m) of all slices by motions (n, m), with what bodies give way between them.

    ``stiffness`` (g,) is that of the slices [N/m].
    """
    approach = system.W.T @ shape
    if system.flexibility is None:
        return stiffness[:, None] * approach
    carrying, force = np.flatnonzero(stiffness > 0.0), np.zeros_like(approach)
    compliance = np.diag(1.0 / stiffness[carrying]) + system.flexibility[np.ix_(carrying, carrying)]
    force[carrying] = np.linalg.solve(compliance, approach[carrying])
    return force


def _in_modes(still: MechanicalSystem, stiffness, gyroscopic, speed: float, count: int) -> MechanicalSystem:
    """System on its lowest modes at rest, `_BASIS` for each that is followed; gyroscopic terms couple them."""
    kept = min(len(still.dofs), _BASIS * count + _LEAST)
    basis = undamped_modes(still, stiffness, damping_ratio=0.0, count=kept)
    size = len(basis.frequency)
    coupling = (
        basis.shape.T @ np.asarray(gyroscopic) @ basis.shape / speed if speed and gyroscopic is not None else None
    )
    return MechanicalSystem(
        M=np.eye(size),
        C=np.zeros((size, size)),
        K=np.diag((2.0 * np.pi * basis.frequency) ** 2),
        W=np.zeros((size, 0)),
        load=np.zeros(size),
        dofs=tuple(f"mode {i + 1}" for i in range(size)),
        gyroscopic=coupling,
    )


def count_modes(system: MechanicalSystem, stiffness: np.ndarray, top: float | None) -> int:
    """Count modes up to a frequency [Hz], `_LEAST` or more; all without one. Columns have ``stiffness`` (c,) [N/m]."""
    if top is None:
        return len(system.dofs)
    whole = undamped_modes(system, stiffness, damping_ratio=0.0)
    return int(np.clip(np.count_nonzero(whole.frequency <= top), min(_LEAST, len(system.dofs)), len(system.dofs)))


def excitation_orders(model: GearboxModel, reference: str) -> dict[str, float]:
    """List turns of shafts and `MESH_LINES` mesh lines of stages over the turn of a shaft, equal ones once."""
    speed = abs(model.flow.speed[reference])
    orders: dict[str, float] = {}
    if not speed:
        return orders
    lines = [(f"{name} turn", abs(value) / speed) for name, value in model.flow.speed.items()]
    for name, hertz in model.flow.mesh_frequency.items():
        order = 2.0 * np.pi * hertz / speed
        lines += [(f"{name} mesh", order)]
        lines += [(f"harmonic {h} of {name} mesh", h * order) for h in range(2, MESH_LINES + 1)]
    for name, order in lines:
        if order > 0.0 and all(abs(order - other) > 1e-9 * order for other in orders.values()):
            orders[name] = order
    return orders


def _kinetic(
    model, motion, moved, modes: Modes, inner: dict[str, np.ndarray], named: tuple[Sequence[str], Sequence[str]]
) -> tuple[tuple[str, ...], np.ndarray, tuple[str, ...]]:
    """Shares of members in the kinetic energy, and the kind of every mode, of motions and momenta (6n, m).

    ``inner`` are the energies of elastic rings and carriers, which are ``named`` kind by kind.
    """
    owner = member_of_stations(model)
    per_motion = (motion * moved).reshape(len(owner), 6, -1)
    members = tuple(dict.fromkeys((*owner, *inner)))
    kinetic = np.zeros((len(members), motion.shape[1]))
    np.add.at(kinetic, np.array([members.index(name) for name in owner]), per_motion.sum(axis=1))
    for name, energy in inner.items():
        kinetic[members.index(name)] += energy
    total = np.maximum(kinetic.sum(axis=0), 1e-300)
    in_casing = np.array([name == CASING for name in owner])
    of_shafts = [per_motion[~in_casing][:, list(ways)].sum(axis=(0, 1)) for ways in _MOTIONS]
    elastic = [sum((inner[name] for name in names), 0.0 * total) for names in named]
    by_kind = np.array([*of_shafts, per_motion[in_casing].sum(axis=(0, 1)), *elastic]) / total
    kinds = [
        "rigid" if hertz == 0.0 else KINDS[int(share.argmax())] if share.max() >= _PURE else "mixed"
        for hertz, share in zip(modes.frequency, by_kind.T, strict=True)
    ]
    return members, kinetic / total, tuple(kinds)


def _strain(
    state: Deflection, assembly: Assembly, motion, of_meshes, modes: Modes, inner: dict[str, np.ndarray]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Shares of shafts, bearings, joints, meshes, rings and carriers in the strain energy; none of rigid motions."""
    model = state.model
    energies: dict[str, np.ndarray] = {}

    def add(name: str, stations: Sequence[int], matrix: np.ndarray) -> None:
        kept = np.repeat(np.array(stations) >= 0, 6)
        at = np.concatenate([6 * s + np.arange(6) for s in stations])[kept]
        moved = motion[at]
        energy = np.einsum("im,ij,jm->m", moved, matrix[np.ix_(kept, kept)], moved)
        energies[name] = energies.get(name, 0.0) + energy

    beams = model.assembly.beams
    for shaft, beam in zip(model.beams, beams, strict=False):
        add(called("shaft", shaft), beam.stations, beam.stiffness)
    for beam in beams[len(model.beams) :]:
        add(CASING, beam.stations, beam.stiffness)
    for number, springs in enumerate(model.bearings):
        finite = np.where(np.isfinite(state.bearing_stiffness[number]), state.bearing_stiffness[number], 0.0)
        add(called("bearing", springs.name), springs.stations, springs.rows.T @ finite @ springs.rows)
    for number, springs in enumerate(model.joints):
        finite = np.where(np.isfinite(springs.stiffness), springs.stiffness, 0.0)
        label = called("coupling", springs.name) if number < len(model.case.coupling) else springs.name
        add(label, springs.stations, (springs.rows.T * finite) @ springs.rows)
    if model.casing is not None:
        for springs, values in zip(model.casing.feet, model.casing.foot_stiffness, strict=True):
            finite = np.where(np.isfinite(values), values, 0.0)
            add(called("foot", springs.name), springs.stations, (springs.rows.T * finite) @ springs.rows)
    for stage in model.stages:
        name = f"meshes of {stage.name}"
        energies[name] = np.sum([of_meshes[assembly.slices[mesh]].sum(axis=0) for mesh in stage.meshes], axis=0)
    for name, energy in inner.items():
        energies[name] = energies.get(name, 0.0) + energy
    table = np.array(list(energies.values())).reshape(len(energies), -1)
    total = table.sum(axis=0)
    elastic = modes.frequency > 0.0
    return tuple(energies), np.where(elastic, table / np.where(elastic, total, 1.0), 0.0)


def stage_motions(model: GearboxModel, motion: np.ndarray, moved: np.ndarray, frequency: np.ndarray) -> StageMotions:
    """Find the shares of the stages in modes, and the kinds of these by their planets.

    Parameters
    ----------
    model : GearboxModel
    motion, moved : (6n, m) arrays
        Motions of all stations in the modes, and their momenta by unit of time [kg^-1/2], [kg^1/2].
    frequency : (m,) array
        Zero of rigid modes [Hz].
    """
    owner = np.array(member_of_stations(model))
    energy = (motion * moved).reshape(len(owner), 6, -1)
    total = np.maximum(energy.sum(axis=(0, 1)), np.finfo(float).tiny)
    shafts = {stage.name: _shafts(stage) for stage in model.stages}
    shared = [name for names in shafts.values() for name in names]
    share = np.zeros((len(model.stages), motion.shape[1]))
    for row, stage in zip(share, model.stages, strict=True):
        row += energy[list(stage.planets)].sum(axis=(0, 1))
        for name in shafts[stage.name]:
            row += energy[owner == name].sum(axis=(0, 1)) / shared.count(name)
    sets = [stage for stage in model.stages if stage.planets]
    if not sets:
        return StageMotions(share / total, ("",) * motion.shape[1])
    on_axis = energy[np.isin(owner, [shaft.name for shaft in model.case.shaft])].sum(axis=0)
    classes = np.zeros((3, motion.shape[1]))
    classes[0], classes[1] = on_axis[list(_ROTATIONAL)].sum(axis=0), on_axis[list(_TRANSLATIONAL)].sum(axis=0)
    classes += np.sum([class_energies(_planet_motions(model, stage, motion)) for stage in sets], axis=0)
    return StageMotions(share / total, named_kinds(classes / total, frequency))


def _shafts(stage: StageModel) -> set[str]:
    """Names of the shafts of a stage."""
    section = stage.section
    planetary = isinstance(section, BoxPlanetarySection)
    names = (section.sun, section.carrier, section.ring) if planetary else section.shafts
    return {*names} - {CASING}


def _planet_motions(model: GearboxModel, stage: StageModel, motion: np.ndarray) -> SetMotions:
    """Motions of the planets of a stage along their radial and tangential axes and z, and about these."""
    of_stations, mass = motion.reshape(-1, 6, motion.shape[1]), np.diag(model.assembly.mass).reshape(-1, 6)
    local = [
        np.kron(np.eye(2), pin_axes(psi)) @ of_stations[planet]
        for planet, psi in zip(stage.planets, stage.angles, strict=True)
    ]
    central = np.zeros((0, 3, motion.shape[1]))
    planets = list(stage.planets)
    return SetMotions(central, np.zeros((0, 3)), np.array(local), mass[planets], np.asarray(stage.angles))
