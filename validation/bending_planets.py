"""Stepped planets that bend between their gears as they run around, in time and in axes at rest."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from casings import casing_tables
from planet_gearboxes import loaded, pair

from femgear.housing.two_way.running_planets import RunningStage
from femgear.system.assembly import GROUND, Assembly
from femgear.system.system import MechanicalSystem
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.planet_branches import RunningSet, running_sets
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.running_branches import branch_stage
from femgear.trains.gearbox.stage_structure import structure_apart
from femgear.trains.reading import read_case
from validation.gearbox_in_time import ANGLE, BY_MASS, BY_STIFFNESS, IN_TIME, apart_in_time
from validation.reference.running_in_time import TurningSystem
from validation.rows import Row, at_most

TEETH = (11, 16, 8, 35)
"""Sun, both gears of a planet, ring: 70 meshes of the sun and 35 of the ring in a turn of the carrier."""
MODULE, LENGTH = 2e-3, 40e-3
"""Transverse module, and length of a planet between its gears [m]."""
TIME_CONSTANT = 1e-6
"""Viscous damping of the bearings of planets over their stiffness [s]."""
CENTRAL = {
    "sun": ("2 kg", "2e-3 kg m^2", "1e8 N/m"),
    "carrier": ("8 kg", "3e-2 kg m^2", "5e8 N/m"),
    "ring": ("4 kg", "2e-2 kg m^2", "6e8 N/m"),
}
"""Mass, inertia and radial stiffness."""


def bending_set(angle: float, *, back: bool) -> dict[str, Any]:
    """Tables of stepped planets, each a shaft of two stations with a helical gear and a bearing on the carrier at both.

    In a casing on uneven feet; the first planet stands at an angle [rad].
    """
    tables: dict[str, Any] = {"shaft": [], "mass": [], "bearing": [], "pair": []}
    for name, (mass, inertia, radial) in CENTRAL.items():
        held = {"radial": radial, "axial": "2e8 N/m", "tilt": "1e6 N m/rad", "torsional": "2e5 N m/rad"}
        tables["shaft"].append({"name": name})
        tables["mass"].append({"shaft": name, "mass": mass, "inertia": inertia, "transverse_inertia": inertia})
        tables["bearing"].append({"shaft": name, **held})
    distance, ends = 0.5e3 * MODULE * (TEETH[0] + TEETH[1]), (0.0, 1e3 * LENGTH)
    for number in range(3):
        name, psi = f"p{number}", angle + 2.0 * math.pi * number / 3.0
        shaft: dict[str, Any] = {"name": name, "start": f"{-0.5 * ends[1]!r} mm", "longest_element": "1 m"}
        shaft["axis"] = [f"{distance * math.cos(psi)!r} mm", f"{distance * math.sin(psi)!r} mm"]
        shaft["part"] = [{"length": f"{ends[1]!r} mm", "outer_diameter": "10 mm"}]
        tables["shaft"].append(shaft)
        for end, radial in zip(ends, ("2e8 N/m", "1.5e8 N/m"), strict=True):
            inertia = {"inertia": "5e-5 kg m^2", "transverse_inertia": "6e-5 kg m^2"}
            tables["mass"].append({"shaft": name, "position": f"{end!r} mm", "mass": "0.3 kg", **inertia})
            seat = {
                "position": f"{end!r} mm",
                "outer_shaft": "carrier",
                "outer_position": f"{end - 0.5 * ends[1]!r} mm",
            }
            held = {"radial": radial, "axial": "5e7 N/m", "tilt": "3e4 N m/rad"}
            tables["bearing"].append({"name": f"pin {number} at {end:g}", "shaft": name, **seat, **held})
    places = {"sun": -0.5 * ends[1], "ring": 0.5 * ends[1]}
    for mate, teeth, end in (("sun", TEETH[:2], ends[0]), ("ring", TEETH[2:], ends[1])):
        for number in range(3):
            shafts = ("sun", f"p{number}") if mate == "sun" else (f"p{number}", "ring")
            positions = [f"{places[name] if name in places else end!r} mm" for name in shafts]
            mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6, "low_share": 0.7}
            sizes = pair(f"{mate} {number}", shafts, teeth, MODULE, internal=mate == "ring", mesh=mesh)
            sizes["gears"] |= {"face_width": "20 mm", "helix_angle": "15 deg"}
            tables["pair"].append(sizes | {"positions": positions})
    speed = -12000.0 if back else 12000.0
    return loaded(tables, 100.0, speed, "carrier", ("ring",)) | {
        "deflection": {"slices": 1},
        "casing": casing_tables(),
    }


@dataclass(frozen=True)
class _AtRest:
    """The set in axes at rest: coordinates of the structure, then the motions of all planets.

    Parameters
    ----------
    found : Deflection
        Loaded state.
    running : RunningSet
        Its planets.
    structure : MechanicalSystem
        Without planets and their meshes.
    motions : (6n, k) array
        Of all stations by all coordinates.
    own : int
        Number of coordinates of the structure.
    """

    found: Deflection
    running: RunningSet
    structure: MechanicalSystem
    motions: np.ndarray
    own: int

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, damping and stiffness (k, k) of structure and planets without their meshes and bearings."""
        assembly, planets = self.found.model.assembly, planet_stations(self.found, self.running)
        mass, damping, stiffness = np.zeros((3, assembly.count, assembly.count))
        for inertia in assembly.inertias:
            if planets.issuperset(inertia.stations):
                at = _motions_of(inertia.stations)
                mass[np.ix_(at, at)] += inertia.mass
                damping[np.ix_(at, at)] += inertia.gyroscopic
        for beam in assembly.beams:
            if planets.issuperset(beam.stations):
                at = _motions_of(beam.stations)
                stiffness[np.ix_(at, at)] += beam.stiffness
        mass, damping, stiffness = (self.motions.T @ matrix @ self.motions for matrix in (mass, damping, stiffness))
        inner = np.s_[: self.own, : self.own]
        mass[inner] += self.structure.M
        damping[inner] += BY_MASS * self.structure.M + BY_STIFFNESS * self.structure.K
        stiffness[inner] += self.structure.K
        return mass, damping, stiffness


def planet_stations(found: Deflection, running: RunningSet) -> set[int]:
    """Stations of all planets, two of each."""
    first = (found.model.first[planet] for branch in running.branches for planet in branch.planets)
    return {start + end for start in first for end in (0, 1)}


def _motions_of(stations: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([6 * station + np.arange(6) for station in stations])


def set_at_rest(*, back: bool) -> _AtRest:
    """Solve the set for its loaded state and take its planets out of the structure."""
    found = solve_deflection(read_case(bending_set(ANGLE, back=back)))
    (running,) = running_sets(found.model.case)
    planets, assembly = planet_stations(found, running), found.model.assembly
    rest, structure, _ = structure_apart(
        found, planets, {mesh for stage in found.model.stages for mesh in stage.meshes}
    )
    moving = _motions_of(tuple(sorted(planets)))
    motions = np.zeros((assembly.count, rest.motions.shape[1] + len(moving)))
    motions[:, : -len(moving)] = rest.motions
    motions[moving, -len(moving) + np.arange(len(moving))] = 1.0
    return _AtRest(found, running, structure, motions, rest.motions.shape[1])


def _turning_rows(at_rest: _AtRest, first: str, sense: int, *, back: bool) -> Callable[[float], np.ndarray]:
    """Approaches of the meshes with a member, then of all others, then of bearings, where the carrier has turned."""
    running, model = at_rest.running, at_rest.found.model
    meshes = [
        stage.meshes[0] for stage in sorted(model.stages, key=lambda stage: (first not in stage.name, stage.name))
    ]

    def rows(turn: float) -> np.ndarray:
        there = solve_deflection(read_case(bending_set(ANGLE + sense * turn, back=back))).model
        assembly: Assembly = there.assembly
        listed = [assembly.columns[:, assembly.slices[mesh]].T for mesh in meshes]
        for psi, numbers in zip(running.angles, running.pins, strict=True):
            # dampers turn with the carrier, so springs do: outwards, around, along the axis
            turned = np.kron(np.eye(2), pin_axes(psi + sense * turn))
            for number in numbers:
                springs, moved = there.bearings[number], np.zeros((6, assembly.count))
                for place, station in enumerate(springs.stations):
                    assert station != GROUND
                    moved[:, 6 * station : 6 * station + 6] += springs.rows[:, 6 * place : 6 * place + 6]
                listed.append(turned @ moved)
        return np.vstack(listed) @ at_rest.motions

    return rows


def turning_set(member: str, *, back: bool) -> tuple[TurningSystem, RunningStage, np.ndarray]:
    """Planets whose meshes with a member excite, in axes at rest and as the response takes them.

    And the modes (m, k) of the structure by its coordinates.
    """
    at_rest = set_at_rest(back=back)
    found, running, model = at_rest.found, at_rest.running, at_rest.found.model
    kind = next(number for number, names in enumerate(running.kinds) if member in names[0])
    excitations = {stage.name: pair_count_excitation(model, stage) for stage in model.stages}
    structured, _ = branch_stage(found, running, kind, excitations, pair_phases(model.case, model.flow))
    stage, frequency = structured.running, structured.running.natural_frequency
    # the excited meshes, the others, then bearings
    viscous = np.where(np.arange(len(stage.stiffness)) < 2, 0.0, TIME_CONSTANT * stage.stiffness)
    ratio = 0.5 * (BY_MASS / frequency + BY_STIFFNESS * frequency)
    undamped = {"loss": 0.0 * stage.loss, "structure_loss": 0.0}
    stage = replace(stage, damping_ratio=ratio, viscous=viscous, **undamped)
    bearings = np.concatenate([np.diag(found.bearing_stiffness[n]) for numbers in running.pins for n in numbers])
    springs = np.append(np.full(3, stage.stiffness[1]), bearings)
    dampers = TIME_CONSTANT * np.append(np.zeros(3), bearings)
    speed = abs(model.flow.speed["carrier"])
    teeth = round(2.0 * math.pi * model.flow.mesh_frequency[f"{member} 0"] / speed)
    rows, drive = _turning_rows(at_rest, member, stage.sense, back=back), stage.excitation
    turning = TurningSystem(rows, *at_rest.matrices(), springs, dampers, drive, teeth, speed, 2)
    shape = np.linalg.lstsq(at_rest.motions[:, : at_rest.own], structured.motion, rcond=None)[0]
    return turning, stage, shape.T


def bending_planets() -> list[Row]:
    """Lines of stepped planets of two gears and two bearings, with tilts, gyroscopic moments and side bands."""
    rows = list[Row]()
    for member, back in (("sun", False), ("ring", True)):
        apart = apart_in_time(*turning_set(member, back=back))
        name = f"stepped 11/16/8/35 that bends, meshes of the {member} excite{', backwards' if back else ''}"
        text = "lines of six motions of sun, carrier, ring and casing, largest difference over the largest line"
        rows.append(at_most(name, IN_TIME, text, 1e-6, apart))
    return rows
