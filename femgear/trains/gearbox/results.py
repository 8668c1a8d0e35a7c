"""Results of a gearbox case: deflection.nc and modes.nc, and the tables of case and numbers."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.load_spectrum import running_shares
from femgear.case.messages import estimated_materials
from femgear.case.quantities import LENGTH, RPM
from femgear.case.teeth import case_overlap
from femgear.errors import GeometryError
from femgear.findings import DOUBT, FAULT, Finding, percent
from femgear.gears.checks import check_meshes
from femgear.gears.planetary import assembly_positions, feasible_angles
from femgear.report.tables import Block, describe_modes, tabulate
from femgear.stages.life_results import describe_damage, describe_life, life_findings
from femgear.stages.planet_bearings import describe_planet_bearings, planet_bearing_findings
from femgear.stages.protocol import StageResult
from femgear.stages.strength import with_rim_doubts
from femgear.stages.tooth_faults import left_out_of_faults
from femgear.storage.contents import Contents
from femgear.storage.results import coordinates, mode_entries
from femgear.system.assembly import MOTIONS
from femgear.trains.gearbox.case_file import GearboxCase, PairSection, named_load_case, teeth_of
from femgear.trains.gearbox.casing_file import casing_notices
from femgear.trains.gearbox.casing_results import (
    casing_coordinates,
    casing_variables,
    describe_feet,
)
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.geometry import StageSizes, planet_distance, planet_radius, set_sizes
from femgear.trains.gearbox.life import bearing_life_findings, describe_load_cases, life_text, life_variables
from femgear.trains.gearbox.model import (
    GearboxModel,
    StageModel,
    bearing_motions,
    bearing_places,
    member_of_stations,
    seats_of_stations,
)
from femgear.trains.gearbox.modes import GearboxModes
from femgear.trains.gearbox.overlaps import common_faces, overlaps
from femgear.trains.gearbox.planet_shafts import standing_planets
from femgear.trains.gearbox.play import beyond_play, play_findings, slack_bearings
from femgear.trains.gearbox.power import port_shafts
from femgear.trains.gearbox.sensors import (
    describe_sensors,
    modal_sensor_variables,
    sensor_coordinates,
    sensor_notices,
    static_sensor_variables,
)
from femgear.trains.gearbox.silence import idle_entries
from femgear.trains.gearbox.strength import describe_strength, strength_contents
from femgear.trains.gearbox.tooth_life import tooth_life_contents
from femgear.trains.gearbox.transient_checks import transient_notices

if TYPE_CHECKING:
    import xarray as xr


ESTIMATES = 0.5, 2.0
"""Factors on the stiffness of estimated bearings between which results are shown."""
# Force of a mesh over the largest one of its set up to which it is none.
_IDLE = 1e-9
# Way beyond the play of teeth that is rounding [m].
_LEAST_WAY = 1e-12
# Line loads whose sum over the slices is rounding [N/m].
_LEAST_LOAD = 1e-3
# Tilt up to which motions are small [rad].
_LARGEST_TILT = 5e-3
# Approach of flanks over their base pitch that no teeth bear, and how far beyond it nothing real does.
_LARGEST_APPROACH, _FAR = 0.05, 10.0
# Spread of K_Hbeta by estimated bearings that is told.
_SPREAD = 0.02


@dataclass(frozen=True, eq=False)
class DeflectionResult(StageResult):
    """Loaded states of all load cases.

    ``states`` stand in the order of the ``case``, ``chosen`` is the number of the one that modes start from.
    ``estimates`` are its states with the factors `ESTIMATES` on the stiffness of bearings that are estimated.
    """

    case: GearboxCase
    states: tuple[Deflection, ...]
    chosen: int
    estimates: tuple[Deflection, ...] = ()

    def of(self, case: GearboxCase) -> DeflectionResult:
        """Give the same states to a case that differs in entries of later stages alone."""
        if case is self.case:
            return self
        states, estimates = (
            tuple(replace(solved, model=replace(solved.model, case=case)) for solved in every)
            for every in (self.states, self.estimates)
        )
        return replace(self, case=case, states=states, estimates=estimates)

    @property
    def state(self) -> Deflection:
        """The state that modes start from."""
        return self.states[self.chosen]

    @property
    def converged(self) -> bool:
        """Whether forces balance and slopes have settled in all load cases."""
        return all(state.settled for state in self.states)

    @property
    def residual(self) -> float:
        """Largest force out of balance over the largest force of its load case."""
        return max(state.residual for state in self.states)

    @property
    def message(self) -> str:
        """How the states were found."""
        passes = max(len(state.slopes) for state in self.states) - 1
        words = f"teeth and system in turn, {passes} passes" if passes else "meshes as linear springs"
        return f"Newton's method on all bearings; {words}"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what deflection.nc says against itself, see `deflection_warnings`."""
        return deflection_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of deflection.nc."""
        case, state, every = self.case, self.state, self.states
        assembly, load_case, mesh = state.model.assembly, "load_case", "load_case mesh"
        shown = state.model.places
        slopes, widths = np.array([solved.mesh_slope for solved in every]), _mesh_widths(state)
        face, settled = np.array([_face_factors(solved) for solved in every]), [solved.settled for solved in every]
        variables = {
            "speed": ("load_case shaft", _speeds(every, case) / RPM, "rpm", "speed of the shaft"),
            "torque": ("load_case port", _torques(every), "N m", "torque from outside, reactions of outputs too"),
            "mesh_frequency": ("load_case stage", _of_stages(every, "mesh_frequency"), "Hz", "mesh frequency"),
            "planet_load_factor": (
                "load_case stage",
                [[_planet_factor(solved, stage) for stage in solved.model.stages] for solved in every],
                "1",
                "K_gamma: largest load of the planets over their mean; NaN of pairs without planets",
            ),
            "beyond_play": (
                "load_case stage",
                np.array([beyond_play(solved) for solved in every]),
                "m",
                "way by which errors take teeth of branches of planets without load beyond their play; NaN of others",
            ),
            "share": (load_case, running_shares(case.operation.load_case), "1", "share of the running time"),
            "mesh_force": (mesh, [solved.mesh_force for solved in every], "N", "force along the normal of the flanks"),
            "mesh_slope": (mesh, slopes, "rad", "slope of the approach along the width, closer at z > 0 positive"),
            "mesh_misalignment": (
                mesh,
                slopes * widths,
                "m",
                "misalignment over the common width, closer at z > 0 positive",
            ),
            "face_load_factor": (mesh, face, "1", "K_Hbeta of the contact; NaN where teeth are not given"),
            "mesh_stiffness": (mesh, _mesh_stiffness(every), "N/m", "mean mesh stiffness along the normal"),
            "relative_approach": (
                mesh,
                _approaches(every),
                "1",
                "approach of the flanks under load over the base pitch",
            ),
            "transmission_error": (mesh, _errors(every), "m", "peak to peak of the static transmission error"),
            "displacement": (
                "load_case station motion",
                np.array([solved.motion.reshape(-1, 6)[shown] for solved in every]),
                "m",
                "motion of the station: x, y, z (m), tilts and rotation (rad)",
            ),
            "place": ("station axis", assembly.places[shown], "m", "place of the station"),
            "passes": (load_case, [len(solved.slopes) - 1 for solved in every], "1", "passes of contact and system"),
            "settled": (load_case, settled, "1", "whether slopes and mesh forces have settled"),
            "out_of_balance": (load_case, [solved.residual for solved in every], "1", "force out of balance, relative"),
        }
        variables |= _of_bearings(every, state) | _distribution(state) | _of_estimates(self.estimates)
        variables |= casing_variables(every) | static_sensor_variables(every) | _shares_side_by_side(every)
        coords = {
            "load_case": _names("load_case", [section.name for section in case.operation.load_case], "load case"),
            "shaft": _names("shaft", [shaft.name for shaft in case.shaft], "shaft"),
            "port": _names("port", [*state.model.flow.port_torque], "load"),
            "stage": _names("stage", [stage.name for stage in state.model.stages], "stage"),
            "mesh": _names("mesh", [contact.name for contact in assembly.contacts], "gear mesh"),
            "bearing": _names("bearing", state.model.bearing_names, "bearing"),
            "motion": _names("motion", MOTIONS, "motion"),
            "other_motion": _names("other_motion", MOTIONS, "motion"),
            "axis": _names("axis", "xyz", "coordinate"),
        }
        coords |= _of_stations(state.model, shown)
        coords |= casing_coordinates(state) | sensor_coordinates(state.model)
        rated, gears, editions = strength_contents(every)
        lives, teeth, required = tooth_life_contents(every)
        attrs = {"title": "system deflection", "load_case": self.chosen} | editions | required
        return Contents(variables | rated | lives, coords | gears | teeth, attrs)


def _of_stations(model: GearboxModel, shown: np.ndarray) -> dict[str, tuple]:
    """Coordinates of some stations: their names, members and seats."""
    member, seat = (np.array(names(model))[shown].tolist() for names in (member_of_stations, seats_of_stations))
    return {
        "station": _names("station", [model.assembly.names[i] for i in shown], "station of a shaft, or planet"),
        "member": (("station",), member, "1", "shaft or planets of the station"),
        "seat": (("station",), seat, "1", "gears and bearings at the station"),
    }


def _names(dim: str, names: Iterable[str], words: str) -> tuple:
    return ((dim,), list(names), "1", words)


def _speeds(states, case: GearboxCase) -> np.ndarray:
    return np.array([[state.model.flow.speed[shaft.name] for shaft in case.shaft] for state in states])


def _torques(states) -> np.ndarray:
    ports = [*states[0].model.flow.port_torque]
    return np.array([[state.model.flow.port_torque.get(port, 0.0) for port in ports] for state in states])


def _of_stages(states, name: str) -> np.ndarray:
    return np.array(
        [[getattr(state.model.flow, name)[stage.name] for stage in state.model.stages] for state in states]
    ).reshape(len(states), -1)


def _mesh_stiffness(states) -> np.ndarray:
    return np.array([[contact.stiffness.sum() for contact in state.model.assembly.contacts] for state in states])


def _mesh_widths(state: Deflection) -> np.ndarray:
    widths = np.zeros(len(state.model.assembly.contacts))
    for stage in state.model.stages:
        widths[list(stage.meshes)] = stage.width
    return widths


def _per_mesh(state: Deflection, value) -> np.ndarray:
    """Values of every mesh (M,); NaN where teeth are not computed."""
    per_mesh = np.full(len(state.model.assembly.contacts), np.nan)
    for stage in state.model.stages:
        if stage.name in state.contacts:
            per_mesh[list(stage.meshes)] = value(state.contacts[stage.name])
    return per_mesh


def _face_factors(state: Deflection) -> np.ndarray:
    return _per_mesh(state, lambda contact: contact.face_load_factor)


def _approaches(states) -> np.ndarray:
    """Approach of the flanks of every mesh under its load, over the base pitch of its stage."""
    pitch = np.ones(len(states[0].model.assembly.contacts))
    for stage in states[0].model.stages:
        pitch[list(stage.meshes)] = 2.0 * math.pi * stage.sizes.base_radii[0] / stage.sizes.teeth[0]
    return np.array([state.mesh_force for state in states]) / _mesh_stiffness(states) / pitch


def _planet_factor(state: Deflection, stage: StageModel) -> float:
    """K_gamma of a planetary set by its meshes with the sun, of pairs on a carrier by their torques; else NaN."""
    flow = state.model.flow
    beside = next((names for names in flow.side_by_side if stage.name in names), ())
    shares = [share for name, share in flow.torque_shares.items() if name in beside]
    if shares and isinstance(stage.section, PairSection) and stage.section.carrier is not None:
        return len(shares) * max(shares)
    if not flow.first_torque(stage.section):
        return math.nan  # idle: what planets weigh is no load to share
    force = state.mesh_force[list(stage.meshes)[: len(stage.planets)]]
    return float(force.max() / force.mean()) if len(force) and force.any() else math.nan


def _errors(states) -> np.ndarray:
    """Peak to peak of the static transmission error of every mesh of all load cases [m]."""

    def spread(contact):
        return np.ptp(contact.result.cycle.deflection, axis=1)

    return np.array([_per_mesh(state, spread) for state in states])


def _of_bearings(every: Sequence[Deflection], state: Deflection) -> dict[str, tuple]:
    """Forces, motions, stiffness and lives of all bearings in all load cases."""
    bearing, count = "load_case bearing", len(state.model.case.bearing)
    forces = np.array([solved.bearing_force for solved in every]).reshape(len(every), count, 6)
    return {
        "bearing_force": (f"{bearing} motion", forces, "N", "force on the shaft (N), moments about x, y, z (N m)"),
        "radial_force": (bearing, np.hypot(forces[..., 0], forces[..., 1]), "N", "radial bearing force"),
        "axial_force": (bearing, forces[..., 2], "N", "force of the bearing on the shaft along z"),
        "bearing_stiffness": (
            "bearing motion other_motion",
            np.where(np.isfinite(state.bearing_stiffness), state.bearing_stiffness, np.inf),
            "N/m",
            "tangent of the bearing at the load, also in N and N m/rad; infinite of rigid ones",
        ),
        "bearing_displacement": (
            "load_case bearing axis",
            np.array([bearing_motions(solved.model, solved.motion) for solved in every]),
            "m",
            "motion of the shaft at the bearing",
        ),
        "bearing_place": ("bearing axis", bearing_places(state.model), "m", "place of the bearing"),
        "slack": (
            f"{bearing} motion",
            np.array([slack_bearings(solved) for solved in every]).reshape(len(every), count, 6).astype(float),
            "1",
            "1 where the bearing holds no such motion for want of load and its shaft is free; else 0",
        ),
        **life_variables(every, running_shares(state.model.case.operation.load_case)),
    }


def _of_estimates(states: Sequence[Deflection]) -> dict[str, tuple]:
    """What other stiffnesses of estimated bearings make of the chosen load case."""
    if not states:
        return {}
    misaligned = np.array([state.mesh_slope * _mesh_widths(state) for state in states])
    face = np.array([_face_factors(state) for state in states])
    return {
        "estimate_factor": ("estimate", list(ESTIMATES), "1", "factor on the stiffness of estimated bearings"),
        "estimate_misalignment": ("estimate mesh", misaligned, "m", "misalignment with that factor"),
        "estimate_face_load_factor": ("estimate mesh", face, "1", "K_Hbeta with that factor"),
    }


def _distribution(state: Deflection) -> dict[str, tuple]:
    """Load of the slices of all meshes over the width, the largest number of slices for all."""
    assembly = state.model.assembly
    most = max([len(contact.heights) for contact in assembly.contacts], default=0)
    if most < 2:
        return {}
    heights, load = np.full((2, len(assembly.contacts), most), np.nan)
    widths = _mesh_widths(state)
    for number, (contact, part) in enumerate(zip(assembly.contacts, assembly.slices, strict=True)):
        count = len(contact.heights)
        if count > 1:
            heights[number, :count] = contact.heights
            load[number, :count] = state.slice_force[part] * count / widths[number]
    return {
        "slice_height": ("mesh slice", heights, "m", "place of the slice above the middle of the width"),
        "line_load": ("mesh slice", load, "N/m", "load per width of the mesh, mean over a mesh period"),
    }


@dataclass(frozen=True, eq=False)
class GearboxModesResult(StageResult):
    """Modes of the whole gearbox, ``gearbox_modes``, about the loaded state of one load case."""

    gearbox_modes: GearboxModes

    @property
    def found(self) -> GearboxModes:
        """Former name of `gearbox_modes`, until the next minor release."""
        warnings.warn("found is called gearbox_modes now", DeprecationWarning, stacklevel=2)
        return self.gearbox_modes

    @property
    def modes(self):
        """The modes themselves."""
        return self.gearbox_modes.modes

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "modes about the loaded state"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what modes.nc says against itself, see `gearbox_modes_warnings`."""
        return gearbox_modes_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of modes.nc."""
        solved = self.gearbox_modes
        modes, model, campbell = solved.modes, solved.deflection.model, solved.campbell
        critical, shown, names = campbell.critical, model.places, [stage.name for stage in model.stages]
        variables = mode_entries(modes) | {
            "energy": ("member mode", solved.kinetic, "1", "share of the member in the kinetic energy"),
            "strain": ("part mode", solved.strain, "1", "share of the part in the strain energy"),
            "main_member": ("mode", _largest(solved.members, solved.kinetic), "1", "member with most kinetic energy"),
            "main_part": ("mode", _largest(solved.parts, solved.strain), "1", "part with most strain energy"),
            "motion": (
                "station way mode",
                solved.motion.reshape(len(model.assembly.names), 6, -1)[shown],
                "kg^-1/2",
                "mode shape of unit mass; tilts and rotations in kg^-1/2 m^-1",
            ),
            "planet_kind": ("mode", list(solved.stages.kinds), "1", "class of the mode by what planets and shafts do"),
            "stage_energy": ("stage mode", solved.stages.energy, "1", "share of the stage in the kinetic energy"),
            "main_stage": ("mode", _largest(names, solved.stages.energy), "1", "stage with most kinetic energy"),
            "place": ("station axis", model.assembly.places[shown], "m", "place of the station"),
            "order": ("line", list(solved.orders.values()), "1", f"over the turn of {solved.reference}"),
            "campbell_frequency": (
                "campbell_speed branch",
                campbell.frequency,
                "Hz",
                "natural frequency over the speed",
            ),
            "critical_speed": (
                "crossing",
                [crossing.speed / RPM for crossing in critical],
                "rpm",
                "speed of a line on a branch",
            ),
            "critical_frequency": ("crossing", [crossing.frequency for crossing in critical], "Hz", "frequency there"),
        }
        variables |= modal_sensor_variables(model, solved.at_sensors)
        coords = {
            **coordinates(mode=np.arange(1, len(modes.frequency) + 1)),
            "member": _names("member", solved.members, "shaft, or planets of a stage"),
            "part": _names("part", solved.parts, "part that is strained"),
            "stage": _names("stage", names, "stage"),
            "station": _names(
                "station", np.array(model.assembly.names)[shown].tolist(), "station of a shaft, or planet"
            ),
            "way": _names("way", MOTIONS, "motion"),
            "axis": _names("axis", "xyz", "coordinate"),
            "line": _names("line", solved.orders, "excitation"),
            "campbell_speed": (("campbell_speed",), campbell.speed / RPM, "rpm", f"speed of {solved.reference}"),
            **sensor_coordinates(model),
        }
        speed = abs(model.flow.speed[solved.reference]) / RPM
        attrs = {"title": "modes of the gearbox", "reference": solved.reference, "speed": speed}
        return Contents(variables, coords, attrs | {"ways": len(model.turns)})


def _largest(names, shares: np.ndarray) -> list[str]:
    return [names[int(column.argmax())] if column.any() else "" for column in shares.T]


def describe_deflection(data: xr.Dataset) -> tuple[Block, ...]:
    """Tabulate meshes and bearings of deflection.nc at the chosen load case."""
    at = int(data.attrs["load_case"])
    load_case = data.isel(load_case=at)
    count = data.sizes["load_case"]
    name = f" in {named_load_case(str(data['load_case'].values[at]))}" if count > 1 else ""
    meshes = {
        "mesh": lambda i: str(data["mesh"].values[i]),
        "force [N]": lambda i: f"{float(load_case['mesh_force'].values[i]):.5g}",
        "misaligned [um]": lambda i: (
            f"{1e6 * float(load_case['mesh_misalignment'].values[i]):+.3f}"
            + _range(load_case, "misalignment", i, "+.2f", 1e6)
        ),
        "K_Hbeta": lambda i: (
            life_text(load_case["face_load_factor"].values[i], ".3f") + _range(load_case, "face_load_factor", i, ".3f")
        ),
        "k [N/um]": lambda i: f"{1e-6 * float(load_case['mesh_stiffness'].values[i]):.4g}",
        "STE p-p [um]": lambda i: life_text(1e6 * load_case["transmission_error"].values[i], ".3f"),
    }
    bearings = {
        "bearing": lambda i: str(data["bearing"].values[i]),
        "radial [N]": lambda i: f"{float(load_case['radial_force'].values[i]):.5g}",
        "axial [N]": lambda i: f"{float(load_case['axial_force'].values[i]):+.5g}",
        "L10 [h]": lambda i: life_text(load_case["rating_life"].values[i]),
        "L10r [h]": lambda i: life_text(load_case["reference_life"].values[i]),
    }
    if np.isfinite(load_case["modified_life"].values).any():
        bearings["a_ISO L10r [h]"] = lambda i: life_text(load_case["modified_life"].values[i])
    brackets = ""
    if "estimate_factor" in data:
        brackets = ", in brackets with half and twice the stiffness of estimated bearings"
    passes = int(load_case["passes"])
    note = f"forces balance to {float(load_case['out_of_balance']):.1g}" + (
        f", settled in {passes} passes" if passes else ""
    )
    return (
        tabulate(f"Meshes{name}{brackets}", range(data.sizes["mesh"]), meshes, (note,)),
        tabulate(f"Bearings{name}", range(data.sizes["bearing"]), bearings),
        *describe_strength(data, at, name),
        *describe_feet(data, at, name),
        *describe_sensors(data, at, name),
        *describe_load_cases(data),
        *describe_life(data),
        *describe_damage(data),
        *describe_planet_bearings(data),
    )


def _range(data: Any, name: str, mesh: int, how: str, factor: float = 1.0) -> str:
    """Write the range of a value of a mesh with all stiffnesses of estimated bearings, nothing without estimates."""
    if f"estimate_{name}" not in data:
        return ""
    of_meshes = data["mesh_misalignment" if name == "misalignment" else name].values[mesh]
    values = factor * np.sort([of_meshes, *data[f"estimate_{name}"].values[:, mesh]])
    return "" if np.isnan(values).any() else f" ({values[0]:{how}} to {values[-1]:{how}})"


def _shares_side_by_side(states: Sequence[Deflection]) -> dict[str, tuple]:
    """Shares (load cases, stages) in the torque of stages side by side, where there are such."""
    if not any(state.model.flow.side_by_side for state in states):
        return {}
    names = [stage.name for stage in states[0].model.stages]
    shares = [[state.model.flow.torque_shares.get(name, math.nan) for name in names] for state in states]
    text = "share of the stage in what it and those side by side with it pass on; NaN of a stage alone"
    return {"torque_share": ("load_case stage", shares, "1", text)}


def deflection_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what deflection.nc says against itself: states that have not settled, edges that carry nothing."""
    names = [str(name) for name in data["load_case"].values]
    open_cases = [name for name, settled in zip(names, data["settled"].values, strict=True) if not settled]
    if open_cases:
        text = f"the misalignment of the meshes has not settled in {named_load_case(', '.join(open_cases[:5]))}"
        yield Finding("W-PASSES", "deflection.passes", text, remedy="allow more passes")
    if "displacement" in data:
        yield from _large(data)
    if "slack" in data:
        yield from play_findings(data)
    if "planet_load_factor" in data:
        yield from _idle_planets(data)
    yield from life_findings(data)
    yield from bearing_life_findings(data)
    yield from planet_bearing_findings(data)
    if "estimate_face_load_factor" in data:
        spread = np.ptp(data["estimate_face_load_factor"].values, axis=0)
        worst = int(np.nan_to_num(spread).argmax()) if len(spread) else 0
        if len(spread) and spread[worst] > _SPREAD:
            low, high = np.sort(data["estimate_face_load_factor"].values[:, worst])[[0, -1]]
            text = (
                f"with half and twice the stiffness of the estimated bearings K_Hbeta of {data['mesh'].values[worst]} "
                f"goes from {low:.2f} to {high:.2f}"
            )
            yield Finding("W-STIFFNESS", "bearing", text, remedy="give stiffness or catalogue numbers of the bearings")
    if "line_load" in data:
        load = data["line_load"].values
        idle = np.nansum(load <= 0.0, axis=1) / np.maximum(np.sum(np.isfinite(load), axis=1), 1)
        idle = np.where(np.nansum(np.abs(load), axis=1) > _LEAST_LOAD, idle, 0.0)
        if idle.max(initial=0.0) > 0.0:
            worst = int(idle.argmax())
            text = f"{data['mesh'].values[worst]} carries on {percent(1.0 - idle[worst])} of its width alone"
            yield Finding("W-FACE-LOAD", "", text, remedy="stiffer shafts or bearings, or a lead modification")


def _idle_planets(data: xr.Dataset) -> Iterator[Finding]:
    """Name planets that carry nothing where others of their set do (W-OPEN)."""
    meshes, force = [str(name) for name in data["mesh"].values], data["mesh_force"].values
    for stage, factor in zip(data["stage"].values, data["planet_load_factor"].values.T, strict=True):
        of_stage = [number for number, name in enumerate(meshes) if name.startswith(f"{stage} sun-planet ")]
        for case in np.flatnonzero(np.isfinite(factor)):
            idle = [meshes[number] for number in of_stage if force[case, number] <= _IDLE * force[case, of_stage].max()]
            if idle:
                text = f"{', '.join(idle)} carry nothing in {named_load_case(str(data['load_case'].values[case]))}"
                remedy = "smaller errors of the pins, or members that give way"
                yield Finding("W-OPEN", "operation.load_case", text, remedy=remedy)
    if "torque_share" in data:
        for case, shares in enumerate(data["torque_share"].values):
            idle = [str(name) for name, share in zip(data["stage"].values, shares, strict=True) if share <= _IDLE]
            if idle and np.nansum(shares) > 0.0:
                text = f"{', '.join(idle)} carry nothing in {named_load_case(str(data['load_case'].values[case]))}"
                remedy = "smaller errors of pins and timing, or members that give way"
                yield Finding("W-OPEN", "operation.load_case", text, remedy=remedy)
    yield from _wedged(data, "smaller errors of pins and timing, or more backlash")


def _wedged(data: xr.Dataset, remedy: str) -> Iterator[Finding]:
    """Name branches of planets whose errors are larger than the play of their teeth (W-WEDGING)."""
    for case, beyond in enumerate(data["beyond_play"].values):
        wedged = beyond > _LEAST_WAY
        if wedged.any():
            names = ", ".join(map(str, data["stage"].values[wedged]))
            text = (
                f"{names} would press on their back flanks in {named_load_case(str(data['load_case'].values[case]))}: "
                f"errors take them {1e6 * beyond[wedged].max():.3g} um beyond their play, and no force here knows"
            )
            limit = "play of 0 um or more"
            yield Finding("W-WEDGING", "operation.load_case", text, remedy=remedy, limit=limit, severity=FAULT)


def _large(data: xr.Dataset) -> Iterator[Finding]:
    """Tell tilts and approaches of flanks beyond which motions are not small (W-DEFLECTION)."""
    tilts, approach = np.abs(data["displacement"].values[..., 3:5]), data["relative_approach"].values
    if (largest := np.nan_to_num(approach).max(initial=0.0)) > _LARGEST_APPROACH:
        case, mesh = np.unravel_index(int(np.nan_to_num(approach).argmax()), approach.shape)
        text = (
            f"the flanks of {data['mesh'].values[mesh]} approach by {largest:.3g} of their base pitch in "
            f"{named_load_case(str(data['load_case'].values[case]))}: no teeth carry that"
        )
        limit = f"{_LARGEST_APPROACH:g} of it"
        severity = FAULT if largest > _FAR * _LARGEST_APPROACH else DOUBT
        remedy = "less torque, or a larger stiffness"
        yield Finding("W-DEFLECTION", "operation.load_case", text, remedy=remedy, limit=limit, severity=severity)
    if tilts.max(initial=0.0) > _LARGEST_TILT:
        case, station, _ = np.unravel_index(int(tilts.argmax()), tilts.shape)
        text = (
            f"{_place_in_words(data, int(station))} tilts by {1e3 * tilts.max():.3g} mrad in "
            f"{named_load_case(str(data['load_case'].values[case]))}: the model is one of small motions"
        )
        remedy = "less torque, or stiffer shafts and bearings"
        severity, limit = FAULT if tilts.max() > _FAR * _LARGEST_TILT else DOUBT, f"{1e3 * _LARGEST_TILT:g} mrad"
        yield Finding("W-DEFLECTION", "operation.load_case", text, remedy=remedy, limit=limit, severity=severity)


def _place_in_words(data: xr.Dataset, station: int) -> str:
    """Shaft of a station, where on it, and what sits there: "planet 1, 30 mm from its left end (sun-planet 1)"."""
    member, seat, along = str(data["member"].values[station]), data["seat"].values[station], data["place"].values[:, 2]
    of_shaft = along[data["member"].values == member]
    words = member
    if np.ptp(of_shaft) > 0.0:
        words += f", {LENGTH.show(along[station] - of_shaft.min())} from its left end"
    return f"{words} ({seat})" if seat else words


def gearbox_modes_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what modes.nc says against itself: motions without stiffness beside those of the turning shafts."""
    rigid = data["kind"].values == "rigid"
    count, ways = int(rigid.sum()), int(data.attrs.get("ways", len(rigid)))
    if count <= ways:
        return
    members = dict.fromkeys(str(name) for name in data["main_member"].values[rigid])
    text = f"{count} modes have no stiffness, where the gearbox turns in {ways}; they move {', '.join(members)}"
    remedy = (
        "bearings that carry, and feet above the rounding of the stiffest part, some 1e-12 of its frequency squared"
    )
    yield Finding("W-FREE", "", text, remedy=remedy)


def describe_gearbox_modes(data: xr.Dataset) -> Block:
    """Tabulate the first modes of modes.nc with the parts that hold most of their energy."""
    columns = {
        "moves most": lambda mode: f"{mode.main_member.item()} ({100.0 * float(mode.energy.max()):.0f} %)",
        "strained most": lambda mode: (
            f"{mode.main_part.item()} ({100.0 * float(mode.strain.max()):.0f} %)" if mode.main_part.item() else "-"
        ),
    }
    if data.sizes["stage"] > 1:
        columns["stage"] = lambda mode: f"{mode.main_stage.item()} ({100.0 * float(mode.stage_energy.max()):.0f} %)"
    if data["planet_kind"].values.any():
        columns["planets"] = lambda mode: mode.planet_kind.item()
    return describe_modes(data, columns, note="; with most of the kinetic and of the strain energy")


def gearbox_warnings(case: GearboxCase) -> Iterator[Finding]:
    """List what of a gearbox case deserves a look: how it was read, entries without effect, bodies that overlap."""
    yield from case.notices
    if not any(any(load_case.torque.values()) for load_case in case.operation.load_case):
        text, end = "no load case has a torque: no teeth carry any", next(iter(port_shafts(case)), "motor")
        remedy = f'give one, as in torque = {{ "{end}" = "35 N m" }}'
        yield Finding("W-LOAD", "operation.load_case", text, remedy=remedy)
    if not case.deflection.contact and any(stage.teeth is not None for stage in (*case.pair, *case.planetary)):
        text = "without contact meshes have the stiffness of ISO 6336-1, and no K_Hbeta"
        yield Finding("W-STIFFNESS", "deflection.contact", text, remedy="leave it out")
    if case.modes.damping_ratio == 0.0 and case.transient is None:
        text = "0, no damping at all: near resonances levels and forces have no limit, and mean nothing"
        remedy = "gear trains are commonly computed with 0.02 to 0.05"
        yield Finding("W-DAMPING", "modes.damping_ratio", text, remedy=remedy)
    yield from _given_planets(case)
    yield from casing_notices(case)
    yield from sensor_notices(case)
    yield from idle_entries(case)
    yield from overlaps(case)
    yield from common_faces(case)
    yield from standing_planets(case)
    yield from transient_notices(case)
    for kind in ("pair", "planetary"):
        for i, stage in enumerate(getattr(case, kind)):
            given = _without_effect(stage.teeth or {}, elastic_ring=kind == "planetary" and stage.elastic_ring)
            if given:
                text = f"{', '.join(given)} of these teeth have no effect: shafts and bearings of the gearbox hold them"
                yield Finding("W-UNUSED", f"{kind}[{i}].teeth", text)
    yield from _of_teeth(case)


def _of_teeth(case: GearboxCase) -> Iterator[Finding]:
    """What the teeth of stages are warned of; what several have alike is told once, of the first one."""
    first, count = dict[tuple[str, str, str], Finding](), Counter[tuple[str, str, str]]()
    for kind in ("pair", "planetary"):
        for i, stage in enumerate(getattr(case, kind)):
            if (teeth := teeth_of(stage)) is None:
                continue
            gears = planetary_set(teeth)
            meshes = check_meshes(gears, overlap=case_overlap(teeth, gears))
            rims = [finding for finding in meshes if finding.code in ("W-RIM", "W-CONTACT-RATIO")]
            for finding in (*estimated_materials(teeth), *with_rim_doubts(rims, teeth), *left_out_of_faults(teeth)):
                alike = finding.code, finding.key, finding.text
                first.setdefault(alike, replace(finding, key=f"{kind}[{i}].teeth.{finding.key}"))
                count[alike] += 1
    for alike, finding in first.items():
        of_all = f"{finding.text} ({count[alike]} stages)"
        yield replace(finding, text=of_all) if count[alike] > 1 else finding


def _given_planets(case: GearboxCase) -> Iterator[Finding]:
    """Planets of given sizes that do not assemble, or whose tips, of an addendum of one module, come close.

    Published sets without teeth have planets that do not assemble, or overlap: they are told, those with teeth refused.
    """
    for i, stage in enumerate(case.planetary):
        if stage.gears is None:
            continue
        sizes = set_sizes(stage)
        try:
            assembly_positions(sizes.teeth[0], sizes.teeth[2], sizes.planet_angles)
        except GeometryError as error:
            limit, remedy, key = error.limit or "", _assembly_remedy(sizes), f"planetary[{i}].gears"
            yield Finding("W-TEETH", key, error.message, limit=limit, remedy=remedy, severity=DOUBT)
        room, module = planet_distance(sizes), 2.0 * planet_radius(sizes) / sizes.teeth[1]
        left = room - 2.0 * (planet_radius(sizes) + module)
        if len(sizes.planet_angles) > 1 and left < module:
            how = "overlap" if left < 0.0 else f"are {1e3 * left:.4g} mm apart"
            text = f"tips of neighbouring planets with an addendum of one module {how}"
            severity, remedy = DOUBT if left < 0.0 else "", ""
            if room <= 2.0 * planet_radius(sizes):
                text, severity = "neighbouring planets overlap by their pitch circles", FAULT
                remedy = "take fewer planets, or smaller ones"
            options = {"limit": ">= one module", "severity": severity, "remedy": remedy}
            yield Finding("W-NEIGHBOURS", f"planetary[{i}].gears", text, **options)


def _assembly_remedy(sizes: StageSizes) -> str:
    """Say how many planets assemble equally spaced beside one another, and at which angles those that are given do."""
    total, module = sizes.teeth[0] + sizes.teeth[2], 2.0 * planet_radius(sizes) / sizes.teeth[1]
    least = 2.0 * planet_radius(sizes) + 3.0 * module
    counts = [n for n in range(3, 13) if total % n == 0 and 2.0 * sizes.centre_distance * math.sin(math.pi / n) > least]
    equal = f"take planets = {' or '.join(map(str, counts))}, which are equally spaced, or " if counts else ""
    angles = ", ".join(f'"{math.degrees(angle):.10g} deg"' for angle in feasible_angles(total, sizes.planet_angles))
    return f"{equal}give planet_angles = [{angles}], the nearest that fit; [balance] takes equal spacing alone"


_HOLDS = ("support_stiffness", "bearing_stiffness", "tilt_stiffness", "foundation_radial", "foundation_tangential")
_WITHOUT_EFFECT = (
    ("static", "members"),
    ("planet", "bearing_clearance"),
    ("operation", "load_case"),
    ("operation", "required_hours"),
)


def _without_effect(tables: dict, *, elastic_ring: bool) -> list[str]:
    entries = [f"{section}.{key}" for section, key in _WITHOUT_EFFECT if key in tables.get(section, {})]
    for gear in ("gear_1", "gear_2", "sun", "ring", "carrier"):
        section = tables.get(gear)
        holds = [key for key in _HOLDS if not (gear == "ring" and elastic_ring and key.startswith("foundation"))]
        entries += [f"{gear}.{key}" for key in holds if isinstance(section, dict) and key in section]
    return entries
