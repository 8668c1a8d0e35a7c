"""Results of the response of a gearbox: dynamics.nc and runup.nc, their tables and findings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import NOTE, Finding, percent
from femgear.housing.sound import REFERENCE_ACCELERATION, a_weighting
from femgear.report.tables import Block, in_decibels, tabulate
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.trains.gearbox.case_file import CASING
from femgear.trains.gearbox.model import GearboxModel
from femgear.trains.gearbox.resonance_table import resonance_variables
from femgear.trains.gearbox.response import GearboxResponse, StageLines, accelerations, by_order, level
from femgear.trains.gearbox.run_up_speeds import GearboxResonances
from femgear.trains.gearbox.sensors import gearbox_sensors

if TYPE_CHECKING:
    import xarray as xr

LINES_SHOWN = 12
"""Lines of a sensor in the table."""
SENSORS_JUDGED = 3
"""Sensors that page one judges, at most: the loudest ones."""
OF_BOX_RESPONSE = "W-PULL", "W-TAIL", "W-CROSS", "W-STEPS", "W-RIGID"
"""Codes of the findings that concern levels and forces at all speeds of a response."""
_CHANGE = 0.5
"""Change of a level by a longer excitation that is told [dB]."""
_FORCE_CHANGE = 0.05
"""Relative change of the largest mesh force by a longer excitation that is told."""
_CROSS = 0.05
"""Force by the stiffness of a stage on the motion of another one, over its dynamic force, that is told."""
_CROSS_READ, _CROSS_HEARD = 1e-3, 0.01
"""Shares of the mean mesh force and of the level that it makes up to which it is a note: the third digit, 0.1 dB."""
_TAIL = 0.05
"""Share of mesh forces at the outer side bands that is told."""
_CANCELS = 1.5
"""Share of one way in the power of a level beyond which others cancel it."""
_KINDS = ("sun", "ring")


@dataclass(frozen=True, eq=False)
class GearboxResponseResult(StageResult):
    """Response of a gearbox at some speeds.

    ``response`` is the response; ``whole`` keeps the lines of bearings too; ``unresolved`` counts the resonances of a
    run-up whose peaks its speeds miss, ``resonances`` are all of them. ``frictionless`` is the response without the
    friction of the teeth, where that acts. ``longer`` is the response with a longer excitation at some of the speeds.
    """

    response: GearboxResponse
    whole: bool
    unresolved: int = 0
    resonances: GearboxResonances | None = None
    frictionless: GearboxResponse | None = None
    longer: GearboxResponse | None = None

    @property
    def residual(self) -> float:
        """Largest residual of the equations of all stages."""
        return max((float(stage.residual.max()) for stage in self.response.stages), default=math.nan)

    @property
    def message(self) -> str:
        """How the solutions were found."""
        products = max((int(stage.products.max()) for stage in self.response.stages), default=0)
        return f"every stage in the structure of all the rest, GMRES with at most {products} products"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what the file says against itself, see `gearbox_response_warnings`."""
        return gearbox_response_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of dynamics.nc or runup.nc."""
        response = self.response
        model = response.deflection.model
        sensors, bearings = len(gearbox_sensors(model.case)), len(model.bearings)
        forces = slice(sensors, sensors + 3 * bearings)
        variables = _of_stages(response) | _of_lines(response)
        moved = accelerations(response, sensors)
        variables |= _at_sensors(response, moved) if sensors else {}
        variables |= {} if self.longer is None else _by_longer(response, self.longer, moved)
        variables |= {} if self.resonances is None else resonance_variables(response, self.resonances, moved)
        of_bearings = {stage.name: stage.motion[:, forces] for stage in response.stages}
        size = (len(response.speed), bearings, 3)
        rms = level(response, of_bearings).reshape(size)
        text = "root mean square of the bearing force about its mean; NaN of rigid bearings"
        variables["bearing_force_rms"] = ("speed bearing axis", rms, "N", text)
        of_feet = {stage.name: stage.motion[:, forces.stop :] for stage in response.stages}
        feet = () if model.casing is None else model.casing.feet
        if feet:
            size = (len(response.speed), len(feet), 3)
            text = "root mean square of the force of the foot about its mean; NaN of rigid feet"
            variables["foot_force_rms"] = ("speed foot axis", level(response, of_feet).reshape(size), "N", text)
        if self.whole:
            text = "force of the bearing on the shaft, amplitude of the line"
            lines = np.concatenate(list(of_bearings.values()), axis=2)
            lines = lines.reshape(len(response.speed), bearings, 3, -1)
            variables |= _complex("bearing_force", "speed bearing axis line", lines, "N", text)
        variables |= {} if self.frictionless is None else _by_friction(response, self.frictionless, sensors, bearings)
        variables |= _of_several(response)
        text = "exciting stage that the mesh is of; empty of others"
        variables["stage_of_mesh"] = ("mesh", _stages_of_meshes(response), "1", text)
        names = [stage.name for stage in response.stages]
        coords: dict[str, Any] = {
            "speed": (("speed",), response.speed / RPM, "rpm", f"speed of {response.reference}"),
            "stage": (("stage",), names, "1", "stage that excites"),
            "other_stage": (("other_stage",), names, "1", "stage that excites"),
            "kind": (("kind",), list(_KINDS), "1", "kind of mesh; of a pair the first one"),
            "bearing": (("bearing",), list(model.bearing_names), "1", "bearing"),
            "mesh": (("mesh",), [contact.name for contact in model.assembly.contacts], "1", "gear mesh"),
            "axis": (("axis",), list("xyz"), "1", "coordinate"),
        }
        if sensors:
            coords["sensor"] = (("sensor",), [sensor.name for sensor in gearbox_sensors(model.case)], "1", "sensor")
        if response.paths:
            coords["path"] = (("path",), list(response.paths), "1", "way into the casing")
        if feet:
            coords["foot"] = (("foot",), [foot.name for foot in feet], "1", "foot of the casing")
        attrs = {
            "title": "response of the gearbox to its stages",
            "up_to": response.up_to,
            "compared_to": math.nan if self.longer is None else self.longer.up_to,
            "most_harmonics": model.case.dynamics.mesh_harmonics or 0,
            "reference": response.reference,
            "missing": ", ".join(response.missing),
            "rigid": ", ".join(_rigid_bodies(response)),
            "standing": ", ".join(_standing_carriers(model)),
            "unresolved_resonances": self.unresolved,
        }
        used = {dim for entry in variables.values() for dim in entry[0].split()}
        return Contents(variables, {name: entry for name, entry in coords.items() if name in used}, attrs)


def _standing_carriers(model: GearboxModel) -> list[str]:
    """Name the carriers that stand: those of the casing by their stage."""
    named = {
        f"the carrier of {stage.name}" if stage.carrier == CASING else stage.carrier: stage.carrier
        for stage in (*model.case.planetary, *model.case.pair)
        if stage.carrier is not None
    }
    return [name for name, carrier in named.items() if carrier == CASING or not model.flow.speed[carrier]]


def _at_sensors(response: GearboxResponse, moved: dict[str, np.ndarray]) -> dict[str, tuple]:
    """Levels, shares of stages and ways, and lines at the sensors, of accelerations by stage."""
    lines = np.concatenate([moved[stage.name] for stage in response.stages], axis=2)
    by_stage = np.stack([_rms(moved[stage.name]) for stage in response.stages], axis=2)
    return {
        "level": ("speed sensor", level(response, moved), "m/s^2", "root mean square of the acceleration"),
        "level_of_stage": ("speed sensor stage", by_stage, "m/s^2", "the same by the lines of one stage"),
        "weighted_level": ("speed sensor", _weighted_level(response, moved), "dB", "A-weighted level re 1 um/s^2"),
        "outer_level": (
            "speed sensor stage",
            _outer_levels(response, moved),
            "1",
            "share of the power of the level at the outermost side bands of a stage, of sensors off its ring",
        ),
        **_of_paths(response, moved),
        **_complex("lines", "speed sensor line", lines, "m/s^2", "acceleration, amplitude of the line"),
    }


def _weighted_level(response: GearboxResponse, moved: dict[str, np.ndarray]) -> np.ndarray:
    """A-weighted levels (v, s) of the acceleration at the sensors [dB re 1 um/s^2]."""
    as_the_ear = {
        stage.name: moved[stage.name] * a_weighting(stage.order * response.speed[:, None] / (2.0 * np.pi))[:, None]
        for stage in response.stages
    }
    with np.errstate(divide="ignore"):
        return 20.0 * np.log10(level(response, as_the_ear) / REFERENCE_ACCELERATION)


def _outer_levels(response: GearboxResponse, moved: dict[str, np.ndarray]) -> np.ndarray:
    """Share (v, s, stages) of the power of levels at the outermost side bands of mesh forces, and beyond these.

    Zero of sensors on the ring of the stage: planets that pass make side bands there, however few the forces have.
    """
    case = response.deflection.model.case
    sensors, whole = gearbox_sensors(case), level(response, moved)
    shares = np.zeros((*whole.shape, len(response.stages)))
    for number, stage in enumerate(response.stages):
        off = [i for i, sensor in enumerate(sensors) if sensor.ring != stage.name]
        outer = _rms(moved[stage.name][..., np.abs(stage.side_band) >= case.dynamics.side_bands])
        shares[:, off, number] = ((outer / np.where(whole > 0.0, whole, 1.0)) ** 2)[:, off]
    return shares


def _by_friction(rubbing: GearboxResponse, without: GearboxResponse, sensors: int, bearings: int) -> dict[str, tuple]:
    """Change by friction of the levels at sensors, without any of bearing forces, on rigid bearings of meshes [dB]."""
    every, forces = (rubbing, without), slice(sensors, sensors + 3 * bearings)
    if not sensors:
        each = (
            level(response, {stage.name: stage.motion[:, forces] for stage in response.stages}) for response in every
        )
        change = _decibels(*(np.sqrt((size.reshape(-1, bearings, 3) ** 2).sum(axis=2)) for size in each))
        if np.isfinite(change).any():
            text = "added by friction to the fluctuation of the bearing force; NaN of rigid bearings"
            return {"friction_change": ("speed bearing", change, "dB", text)}
        change = _decibels(*(np.nanmax(response.dynamic_forces, axis=2) for response in every))
        return {
            "friction_change": ("speed stage", change, "dB", "added by friction to the fluctuation of the mesh force")
        }
    moved = [accelerations(response, sensors) for response in every]
    sizes = (level(response, lines) for response, lines in zip(every, moved, strict=True))
    quiet = {
        (stage.name, harmonic, band): np.abs(moved[1][stage.name][..., at])
        for stage in without.stages
        for at, (harmonic, band) in enumerate(zip(stage.harmonic, stage.side_band, strict=True))
    }
    none = np.zeros((len(rubbing.speed), sensors))
    lines = [
        quiet.get((stage.name, harmonic, band), none)
        for stage in rubbing.stages
        for harmonic, band in zip(stage.harmonic, stage.side_band, strict=True)
    ]
    text = "amplitude of the line without friction"
    return {
        "friction_change": ("speed sensor", _decibels(*sizes), "dB", "added by friction to the level"),
        "line_without_friction": ("speed sensor line", np.stack(lines, axis=-1), "m/s^2", text),
    }


def _decibels(level_with: np.ndarray, level_without: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return 20.0 * np.log10(level_with / level_without)


def _stages_of_meshes(response: GearboxResponse) -> list[str]:
    """Names of the exciting stages of all meshes."""
    names = {mesh: stage.name for stage in response.stages for mesh in stage.meshes}
    return [names.get(mesh, "") for mesh in range(len(response.deflection.model.assembly.contacts))]


def _of_several(response: GearboxResponse) -> dict[str, tuple]:
    """Forces that stages make in the meshes of one another."""
    if len(response.stages) < 2:
        return {}
    by_stage = "root mean square of the force of the mesh about its mean by the excitation of the stage"
    cross = "force of k(t) of the stage on the motion by another one, over the dynamic force of its meshes"
    return {
        "mesh_force_by_stage": ("speed mesh stage", response.mesh_forces, "N", by_stage),
        "cross_excitation": ("speed stage other_stage", response.cross_excitation, "1", cross),
    }


def _of_paths(response: GearboxResponse, moved: dict[str, np.ndarray]) -> dict[str, tuple]:
    """Shares (v, s, P) of the ways into the casing in the power of the acceleration at all sensors."""
    if not response.paths:
        return {}
    stages = [stage for stage in response.stages if stage.paths is not None]
    parts = {
        stage.name: -((stage.order * response.speed[:, None])[:, None, None] ** 2) * stage.paths
        for stage in stages
        if stage.paths is not None
    }
    size = (len(response.speed), len(response.paths), next(iter(moved.values())).shape[1])
    flat = {name: part.reshape(size[0], -1, part.shape[-1]) for name, part in parts.items()}
    whole, each = by_order(response, moved), by_order(response, flat)
    each = each.reshape(*size, -1)
    power = np.real(each * whole[:, None].conj()).sum(axis=-1)
    total = np.maximum((np.abs(whole) ** 2).sum(axis=-1), np.finfo(float).tiny)
    share = power / total[:, None]
    # what a ring does beyond its seat comes by none of these paths
    share[..., [bool(sensor.ring) for sensor in gearbox_sensors(response.deflection.model.case)]] = np.nan
    text = "share of the path in the power of the acceleration; negative where it quietens others, NaN on a ring"
    return {"path_share": ("speed path sensor", share, "1", text)}


def _rigid_bodies(response: GearboxResponse) -> list[str]:
    """Name the carriers whose own modes the modes of the gearbox have, and the response has not."""
    stages = response.deflection.model.stages
    return [stage.elastic_carrier.name for stage in stages if stage.elastic_carrier is not None]


def _complex(name: str, dims: str, values: np.ndarray, unit: str, text: str) -> dict[str, tuple]:
    return {f"{name}_real": (dims, np.real(values), unit, text), f"{name}_imag": (dims, np.imag(values), unit, text)}


def _rms(lines: np.ndarray) -> np.ndarray:
    return np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=-1))


def _by_kind(response: GearboxResponse, values: Callable[[StageLines], np.ndarray]) -> np.ndarray:
    """Values (v, stages, 2) of the kinds of meshes of all stages; NaN where a pair has no second mesh."""
    whole = np.full((len(response.speed), len(response.stages), 2), np.nan)
    for number, stage in enumerate(response.stages):
        of_stage = values(stage)
        whole[:, number, : of_stage.shape[1]] = of_stage
    return whole


def _factors(response: GearboxResponse) -> np.ndarray:
    """Largest mesh forces over their means (v, stages, 2)."""
    return _by_kind(response, lambda stage: stage.force[..., 1] / stage.force[..., 0])


def _of_stages(response: GearboxResponse) -> dict[str, tuple]:
    """Mesh forces and figures of the solutions, stage by stage."""

    def figures(name: str) -> np.ndarray:
        return np.stack([getattr(stage, name) for stage in response.stages], axis=1)

    return {
        "dynamic_factor": (
            "speed stage kind",
            _factors(response),
            "1",
            "largest mesh force over its mean; NaN where a pair has no second mesh",
        ),
        "lowest_force": (
            "speed stage kind",
            _by_kind(response, lambda stage: stage.force[..., 2]),
            "N",
            "smallest mesh force along the normal; below zero real flanks part",
        ),
        "mean_force": (
            "speed stage kind",
            _by_kind(response, lambda stage: stage.force[..., 0]),
            "N",
            "mean mesh force along the normal",
        ),
        "mesh_force_rms": (
            "speed stage kind",
            _by_kind(response, lambda stage: stage.dynamic_force),
            "N",
            "root mean square of the mesh force about its mean",
        ),
        "mesh_harmonics": ("speed stage", figures("harmonics"), "1", "mesh harmonics of the stage"),
        "tail": ("speed stage", figures("tail"), "1", "share of the mesh forces in the upper half of the harmonics"),
        "outer": ("speed stage", figures("outer"), "1", "share of the mesh forces at the outermost side bands"),
        "residual": ("speed stage", figures("residual"), "1", "relative residual of the equations"),
        "spectral_radius": ("speed stage", figures("radius"), "1", "spectral radius of the fixed point"),
        "products": ("speed stage", figures("products"), "1", "products with the fluctuating stiffness"),
    }


def _of_lines(response: GearboxResponse) -> dict[str, tuple]:
    """Origin and order of all lines."""

    def joined(values) -> np.ndarray:
        return np.concatenate([values(stage) for stage in response.stages])

    return {
        "order": ("line", joined(lambda stage: stage.order), "1", f"frequency over that of {response.reference}"),
        "origin": (
            "line",
            [stage.name for stage in response.stages for _ in stage.order],
            "1",
            "stage that makes the line",
        ),
        "harmonic": ("line", joined(lambda stage: stage.harmonic), "1", "multiple of the mesh frequency"),
        "side_band": ("line", joined(lambda stage: stage.side_band), "1", "turns of the carrier beside the harmonic"),
    }


def _by_longer(response: GearboxResponse, longer: GearboxResponse, moved: dict[str, np.ndarray]) -> dict[str, tuple]:
    """Largest mesh forces with a longer excitation, and the change of levels by it; NaN where it was not solved."""
    places = np.searchsorted(response.speed, longer.speed)
    factor = np.full((len(response.speed), len(response.stages), 2), np.nan)
    factor[places] = _factors(longer)
    text = "dynamic_factor with excitation up to the frequency compared_to; NaN at speeds that were not looked at"
    variables: dict[str, tuple] = {"longer_dynamic_factor": ("speed stage kind", factor, "1", text)}
    if not (sensors := len(gearbox_sensors(response.deflection.model.case))):
        return variables
    change = np.full((len(response.speed), sensors), np.nan)
    change[places] = _decibels(level(longer, accelerations(longer, sensors)), level(response, moved)[places])
    text = "change of the level with excitation up to the frequency compared_to; NaN at speeds that were not looked at"
    return variables | {"level_change": ("speed sensor", change, "dB", text)}


def _end_of_excitation(data: xr.Dataset) -> tuple[str, str]:
    """Entry that ends the excitation, and what to do about it."""
    few = bool(data.attrs.get("most_harmonics"))
    if not few:
        return "dynamics.up_to", "take a higher frequency"
    # of four stages without teeth K_v still grows from 200 mesh harmonics to 400
    jumps = "stages without teeth have a stiffness that jumps, for which no number may be enough: give their teeth"
    return "dynamics.mesh_harmonics", f"take more of them; {jumps}"


def _short_excitation(data: xr.Dataset, number: int, stage: str) -> Iterator[Finding]:
    """Tell the speed at which a longer excitation changes K_v of a stage most (W-TAIL).

    Files of former versions are compared to nothing.
    """
    if "longer_dynamic_factor" not in data:
        if math.isnan(data.attrs.get("compared_to", 0.0)):
            key, remedy = _end_of_excitation(data)
            text = f"what a longer excitation than to {_reach(data)} changes is not known: it did not converge"
            yield Finding("W-TAIL", key, text, remedy=remedy)
        return
    factor, longer = (data[name].values[:, number] for name in ("dynamic_factor", "longer_dynamic_factor"))
    change = np.nan_to_num(np.abs(longer / factor - 1.0))
    at, kind = np.unravel_index(int(change.argmax()), change.shape)
    if change[at, kind] > _FORCE_CHANGE:
        key, remedy = _end_of_excitation(data)
        text = (
            f"excitation to {_compared_to(data)} in place of {_reach(data)} changes K_v of {stage} at "
            f"{data['speed'].values[at]:.5g} rpm from {factor[at, kind]:.3g} to {longer[at, kind]:.3g}"
        )
        yield Finding("W-TAIL", key, text, remedy=remedy)


def _level_excitation(data: xr.Dataset) -> Iterator[Finding]:
    """Tell the sensor and speed at which a longer excitation changes the level most (W-EXCITATION)."""
    if "level_change" not in data or "compared_to" not in data.attrs:
        return
    change = np.nan_to_num(data["level_change"].values, posinf=0.0, neginf=0.0)
    at, sensor = np.unravel_index(int(np.abs(change).argmax()), change.shape)
    if abs(change[at, sensor]) > _CHANGE:
        key, remedy = _end_of_excitation(data)
        text = (
            f"excitation to {_compared_to(data)} in place of {_reach(data)} changes the level of "
            f"{data['sensor'].values[sensor]} at {data['speed'].values[at]:.5g} rpm "
            f"by {in_decibels(change[at, sensor])}"
        )
        yield Finding("W-EXCITATION", key, text, remedy=remedy)


def gearbox_response_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what dynamics.nc or runup.nc says against itself."""
    stages, speeds = [str(name) for name in data["stage"].values], data["speed"].values
    lowest = data["lowest_force"].values
    for number, stage in enumerate(stages):
        pulling = np.nanmin(lowest[:, number], axis=1) < 0.0
        if pulling.any():
            text = f"flanks of {stage} would part at {_of_speeds(speeds, pulling)}: the model holds them together"
            yield Finding("W-PULL", "operation.load_case", text, remedy="more torque, smaller errors, more damping")
        outer = data["outer"].values[:, number]
        if outer.max() > _TAIL:
            text = f"{outer.max():.2g} of the mesh forces of {stage} are at the outermost side bands"
            yield Finding("W-TAIL", "dynamics.side_bands", text, remedy="take more of them")
        elif "outer_level" in data and (share := data["outer_level"].values[..., number]).max() > _TAIL:
            name = data["sensor"].values[np.unravel_index(int(share.argmax()), share.shape)[1]]
            text = f"{share.max():.2g} of the power at {name} are at the outermost side bands of {stage}"
            yield Finding("W-TAIL", "dynamics.side_bands", text, remedy="take more of them")
        yield from _short_excitation(data, number, stage)
    yield from _level_excitation(data)
    if "cross_excitation" in data and data["cross_excitation"].max() > _CROSS:
        yield _cross_finding(data)
    if missed := int(data.attrs.get("unresolved_resonances", 0)):
        text = f"run-up: peaks of {missed} resonances are too narrow for its speeds: levels there may be higher"
        yield Finding("W-STEPS", "runup.count", text, remedy="take more speeds, or a narrower range")
    if data.attrs["rigid"]:
        text = f"{data.attrs['rigid']}: elastic in the modes, without modes of their own in the response"
        yield Finding("W-RIGID", "", text, remedy="look at their modes near the lines that matter")
    if data.attrs["missing"]:
        text = f"{data.attrs['missing']} excite nothing, without teeth or contact ratio, or without torque"
        yield Finding("W-EXCITATION", "", text, remedy="give teeth or contact_ratio, and torque, of these stages")


def _reach(data: xr.Dataset) -> str:
    """Words for the reach of the excitation."""
    most = int(data.attrs.get("most_harmonics", 0))
    return f"{1e-3 * data.attrs['up_to']:g} kHz" + (f", at most {most} mesh harmonics" if most else "")


def _compared_to(data: xr.Dataset) -> str:
    """Words for the end of the longer excitation."""
    most = 2 * int(data.attrs.get("most_harmonics", 0))
    return f"{1e-3 * data.attrs['compared_to']:.3g} kHz" + (f", at most {most} mesh harmonics," if most else "")


def _cross_finding(data: xr.Dataset) -> Finding:
    """Tell what a stage after the other leaves out most, and what that is of mesh forces and levels (W-CROSS).

    Where it changes a force or a level by what one reads, the place where it changes them most; elsewhere a note of
    the largest share of a dynamic force.
    """
    cross, names = data["cross_excitation"].values, data["stage"].values
    with np.errstate(divide="ignore", invalid="ignore"):
        dynamic = np.nan_to_num((data["mesh_force_rms"] / data["mean_force"]).values).max(axis=2)  # (speed, stage)
        share = np.zeros((len(cross), 1, len(names)))  # (speed, sensor, stage)
        if "level_of_stage" in data:
            share = np.nan_to_num(data["level_of_stage"].values / data["level"].values[:, :, None])
    effect = np.maximum(dynamic / _CROSS_READ, share.max(axis=1, initial=0.0) / _CROSS_HEARD)
    change = np.where(cross > _CROSS, cross, 0.0) * effect[:, :, None]
    severity = "" if change.max() > 1.0 else NOTE
    most = cross if severity else change
    speed, stage, other = np.unravel_index(int(most.argmax()), most.shape)
    largest = cross[speed, stage, other]
    text = (
        f"the stiffness of {names[stage]} on the motion by {names[other]} makes {percent(largest)} of its dynamic "
        f"force at {data['speed'].values[speed]:.5g} rpm, and is left out: {largest * dynamic[speed, stage]:.2g} of "
        "its mean force"
    )
    if "level_of_stage" in data:
        sensor = int(share[speed, :, stage].argmax())
        text += f", {largest * share[speed, sensor, stage]:.2g} of the level at {data['sensor'].values[sensor]}"
    return Finding("W-CROSS", "", text, limit=percent(_CROSS), severity=severity)


def _of_speeds(speeds: np.ndarray, chosen: np.ndarray) -> str:
    """Words for some of the speeds [rpm]."""
    shown = speeds[chosen]
    return (
        f"{shown[0]:.5g} rpm" if len(shown) == 1 else f"{len(shown)} speeds, {shown.min():.5g} to {shown.max():.5g} rpm"
    )


def describe_gearbox_response(data: xr.Dataset, title: str = "Response of the stages") -> Block:
    """Tabulate mesh forces of all stages, at the speed with the largest factor of each."""
    factor = np.nan_to_num(data["dynamic_factor"].values)

    def worst(stage: int) -> int:
        return int(factor[:, stage].max(axis=1).argmax())

    columns = {
        "stage": lambda i: str(data["stage"].values[i]),
        "speed [rpm]": lambda i: f"{float(data['speed'].values[worst(i)]):.5g}",
        "largest force over mean": lambda i: f"{factor[worst(i), i].max():.4f}",
        "smallest force [N]": lambda i: f"{np.nanmin(data['lowest_force'].values[worst(i), i]):.5g}",
        "mesh harmonics": lambda i: f"{int(data['mesh_harmonics'].values[worst(i), i])}",
    }
    note = f"excitation up to {_reach(data)}; speeds are those of {data.attrs['reference']}"
    notes = [note]
    if standing := data.attrs.get("standing", ""):
        notes.append(f"{standing}: stands, its planets make no side bands")
    return tabulate(title, range(data.sizes["stage"]), columns, tuple(notes))


def response_tables(data: xr.Dataset) -> Iterator[Block]:
    """Tabulate levels and largest lines of the sensors, and forces of bearings and feet, at the loudest speed."""
    at = 0
    if "level" in data:
        at = int(data["level"].values.max(axis=1).argmax())
        yield _levels(data, at)
        if "lines_real" in data:
            yield from (_lines(data, at, sensor) for sensor in range(data.sizes["sensor"]))
        if "path_share" in data:
            yield _paths(data, at)
    speed = f"{float(data['speed'].values[at]):.5g} rpm"
    for name, dim in (("bearing", "bearing"), ("foot", "foot")):
        if f"{name}_force_rms" in data:
            forces = data[f"{name}_force_rms"].values[at]
            columns = {name: lambda i, dim=dim: str(data[dim].values[i])} | {
                f"{axis} [N]": lambda i, way=way, forces=forces: _number(forces[i, way])
                for way, axis in enumerate("xyz")
            }
            title = f"Fluctuating forces of the {'bearings' if name == 'bearing' else 'feet'}, r.m.s., {speed}"
            yield tabulate(title, range(data.sizes[dim]), columns)


def _number(value: float) -> str:
    return "rigid" if math.isnan(value) else f"{value:.4g}"


def _levels(data: xr.Dataset, at: int) -> Block:
    """Levels of all sensors at a speed, with the share of every stage."""
    whole, parts = data["level"].values[at], data["level_of_stage"].values[at]
    columns = {
        "sensor": lambda i: str(data["sensor"].values[i]),
        "level [m/s^2]": lambda i: f"{whole[i]:.4g}",
    } | {
        f"{name}": lambda i, stage=stage: percent((parts[i, stage] / max(whole[i], 1e-300)) ** 2, 1)
        for stage, name in enumerate(data["stage"].values.tolist())
    }
    speed = float(data["speed"].values[at])
    return tabulate(f"Levels at {speed:.5g} rpm, and shares of the stages in their power", range(len(whole)), columns)


def _paths(data: xr.Dataset, at: int) -> Block:
    """Shares of the ways into the casing in the power at all sensors."""
    share = data["path_share"].values[at]
    columns = {"path": lambda i: str(data["path"].values[i])} | {
        str(name): lambda i, sensor=sensor: (
            "-" if np.isnan(share[i, sensor]) else percent(share[i, sensor], 1, signed=True)
        )
        for sensor, name in enumerate(data["sensor"].values.tolist())
    }
    order = np.argsort(-np.nan_to_num(np.abs(share)).max(axis=1), kind="stable").tolist()
    note = "shares in the power of the acceleration add up to 100 %; a negative one quietens what comes by others"
    return tabulate(f"Which way it comes, {float(data['speed'].values[at]):.5g} rpm", order, columns, (note,))


def _lines(data: xr.Dataset, at: int, sensor: int) -> Block:
    """Largest lines of a sensor at a speed, each with its origin."""
    size = np.hypot(data["lines_real"].values[at, sensor], data["lines_imag"].values[at, sensor])
    hertz = data["order"].values * float(data["speed"].values[at]) / 60.0
    chosen = [int(i) for i in np.argsort(-size, kind="stable")[:LINES_SHOWN] if size[i] > 0.0]
    columns = {
        "frequency [Hz]": lambda i: f"{hertz[i]:.2f}",
        "order": lambda i: f"{float(data['order'].values[i]):.5g}",
        "amplitude [m/s^2]": lambda i: f"{size[i]:.4g}",
        "origin": lambda i: line_origin(data, i),
    }
    if "line_without_friction" in data:
        quiet = data["line_without_friction"].values[at, sensor]
        columns["without friction [m/s^2]"] = lambda i: f"{quiet[i]:.4g}"
    return tabulate(f"Largest lines at {data['sensor'].values[sensor]}", chosen, columns)


def main_way(data: xr.Dataset, sensor: int) -> str:
    """Name the way by which most of the level at a sensor comes at the first speed, with its share of the power.

    Of ways that cancel one another shares say nothing.
    """
    share = data["path_share"].values[0, :, sensor]
    way, name = int(share.argmax()), str(data["path"].values[int(share.argmax())])
    if share[way] > _CANCELS:
        return f"{name}, but {data['path'].values[int(share.argmin())]} takes most of that away"
    part = percent(share[way]) if share[way] <= 1.0 else "more than all"
    return f"{name} ({part} of the power)"


def line_origin(data: xr.Dataset, line: int) -> str:
    """Write where a line comes from: stage, mesh harmonic, side band by turns of the carrier beside it."""
    harmonic, band = float(data["harmonic"].values[line]), int(data["side_band"].values[line])
    side = f", side band {band:+d}" if band else ""
    return (
        f"{data['origin'].values[line]}, mesh harmonic {harmonic:g}{side}"
        if harmonic
        else (f"{data['origin'].values[line]}, {band} x carrier")
    )
