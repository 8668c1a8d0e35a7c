"""Root stresses and contact pressures of the teeth of all stages, under the contact of the loaded gearbox.

Every stage by the same finite elements as a set or a pair alone (`femgear.stages.static`), with the misalignment and
the unequal loads that shafts, bearings and carriers give its teeth in the load case that pictures are of.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.findings import Finding
from femgear.report.tables import Block, merged_names
from femgear.stages.protocol import Progress, StageResult, silent
from femgear.stages.static import solve_stress
from femgear.stages.static_results import describe_stress, stress_warnings
from femgear.stages.stress_reasons import reason_row
from femgear.storage.contents import Contents
from femgear.trains.gearbox.case_file import BoxPlanetarySection, GearboxCase, PairSection
from femgear.trains.gearbox.deflection import Deflection

if TYPE_CHECKING:
    import xarray as xr

_ATTRIBUTES = "module", "sun_torque", "repeats", "nominal_load", "iso_contact_helix_factor", "iso", "iso_edition"
"""Of stress.nc of a set or a pair, which its table and its findings need."""


@dataclass(frozen=True)
class StageStress:
    """Stresses of the teeth of one stage.

    Parameters
    ----------
    name : str
        Of the stage.
    key : str
        Entry of the case under which its teeth are.
    meshes : tuple of str
        Names of its M meshes in the gearbox.
    inside : tuple of str
        Their names in the stage.
    values : mapping of str to array
        Of stress.nc of a set or a pair what has one value for each mesh (M,), or each gear of it (M, 2).
    words : mapping of str to (str, str)
        Unit and text of each of them.
    attributes : mapping of str
        Of that file, those that its table and its findings need.
    """

    name: str
    key: str
    meshes: tuple[str, ...]
    inside: tuple[str, ...]
    values: Mapping[str, np.ndarray]
    words: Mapping[str, tuple[str, str]]
    attributes: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class GearboxStressResult(StageResult):
    """Stresses of the teeth of all stages that are computed: ``stages``."""

    stages: tuple[StageStress, ...]

    @property
    def message(self) -> str:
        """What the stresses rest on."""
        return "linear, from the contact of the loaded gearbox"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterator[Finding]:
        """List what the file says against itself, see `box_stress_warnings`."""
        return box_stress_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of stress.nc."""
        words = {name: text for stage in self.stages for name, text in stage.words.items()}
        variables: dict[str, tuple] = {}
        for name, (unit, text) in words.items():
            shape = next(stage.values[name].shape[1:] for stage in self.stages if name in stage.values)
            parts = [
                stage.values[name] if name in stage.values else np.full((len(stage.meshes), *shape), math.nan)
                for stage in self.stages
            ]
            variables[name] = "mesh gear" if shape else "mesh", np.concatenate(parts), unit, text
        places = [number for number, stage in enumerate(self.stages) for _ in stage.meshes]
        variables["stage_of_mesh"] = "mesh", np.array(places), "1", "number of the stage of the mesh"
        coords = {
            "mesh": (("mesh",), [name for stage in self.stages for name in stage.meshes], "1", "gear mesh"),
            "gear": (("gear",), ["first", "second"], "1", "gear of the mesh"),
        }
        reasons = [
            {"name": stage.name, "key": stage.key, "meshes": stage.inside, "attributes": dict(stage.attributes)}
            for stage in self.stages
        ]
        attributes = {"title": "root stresses and contact pressures of the stages", "stages": json.dumps(reasons)}
        return Contents(variables, coords, attributes)


def solve_box_stress(case: GearboxCase, deflection: Any, *, progress: Progress = silent) -> GearboxStressResult:
    """Find root stresses and contact pressures of the teeth of all stages in the load case that pictures are of.

    Parameters
    ----------
    case : GearboxCase
    deflection : DeflectionResult
        Loaded states.
    progress : callable
        Called with ("stress", done, total).
    """
    state: Deflection = deflection.of(case).state
    stages = [stage for stage in state.model.stages if stage.name in state.contacts and stresses_wanted(stage.section)]
    names = state.model.assembly.contacts
    solved, of_contact = list[StageStress](), dict[int, StageStress]()
    for number, stage in enumerate(stages):
        progress("stress", number, len(stages))
        kind = "planetary" if stage.planets else "pair"
        key = f"{kind}[{getattr(case, kind).index(stage.section)}].teeth"
        meshes = tuple(names[mesh].name for mesh in stage.meshes)
        # equal branches of planets have one contact, and one state of stress
        contact = id(state.contacts[stage.name])
        if contact not in of_contact:
            of_contact[contact] = _stage_stress(state, stage.name, key, meshes)
        solved.append(replace(of_contact[contact], name=stage.name, key=key, meshes=meshes))
    return GearboxStressResult(tuple(solved))


def stresses_wanted(section: PairSection | BoxPlanetarySection) -> bool:
    """Whether the tables of a stage have teeth, and leave stresses in."""
    return section.teeth is not None and section.teeth.get("static", {}).get("stresses", True)


def why_no_stress(case: GearboxCase) -> str:
    """Say why a gearbox has no stresses; empty where it has."""
    if not case.deflection.contact:
        return "deflection.contact is false: no load of teeth is computed"
    if not any(map(stresses_wanted, (*case.pair, *case.planetary))):
        return "no stage has teeth whose stresses are wanted"
    if not any(case.load_case.torque.values()):
        others = "; operation.first takes another load case" if case.operation.load_case[1:] else ""
        return f"load case {case.load_case.name} has no torque{others}"
    return ""


def _stage_stress(state: Deflection, name: str, key: str, meshes: tuple[str, ...]) -> StageStress:
    """Find the stresses of the teeth of a stage under the contact of the loaded state."""
    contact = state.contacts[name]
    data = solve_stress(contact.case, contact.result).dataset()
    data["largest_pressure"] = _largest_pressure(data)
    if "slice" in data.sizes:  # slices have the pressure of Hertz, kinks or not
        data["relief_kink"] = 0 * data["relief_kink"]
    whole = {("mesh",), ("mesh", "gear")}
    kept = {str(name): data[name] for name in data.data_vars if data[name].dims in whole}
    return StageStress(
        name,
        key,
        meshes,
        tuple(map(str, data["mesh"].values)),
        {name: variable.values for name, variable in kept.items()},
        {
            name: (variable.attrs.get("units", "1"), variable.attrs.get("long_name", ""))
            for name, variable in kept.items()
        },
        {name: _plain(data.attrs[name]) for name in _ATTRIBUTES if name in data.attrs},
    )


def _largest_pressure(data: xr.Dataset) -> Any:
    """Largest contact pressure of every mesh over its period."""
    from xarray import DataArray

    pressure = data["contact_pressure"].values.max(axis=-1)
    if "largest_pressure" in data:
        pressure = data["largest_pressure"].values
    return DataArray(pressure, dims="mesh", attrs={"units": "Pa", "long_name": "largest contact pressure of the mesh"})


def _plain(value: Any) -> Any:
    """Give an attribute as JSON has it."""
    return value.item() if hasattr(value, "item") else value


def stage_parts(data: xr.Dataset) -> Iterator[tuple[str, str, xr.Dataset]]:
    """Give name, entry of the case and stresses of every stage of stress.nc, as a set or a pair alone has them."""
    for number, stage in enumerate(json.loads(data.attrs["stages"])):
        part = data.isel(mesh=np.flatnonzero(data["stage_of_mesh"].values == number))
        part = part.assign_coords(mesh=stage["meshes"])
        part.attrs = stage["attributes"]
        yield stage["name"], stage["key"], part.drop_vars([name for name in part if _unknown(part[name])])


def _unknown(values: xr.DataArray) -> bool:
    """Whether a variable is one that other stages alone have."""
    return values.dtype.kind == "f" and bool(np.isnan(values.values).all())


def box_stress_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List which stresses of stress.nc stand at a kink or at an end of what was searched, stage by stage."""
    for name, key, part in stage_parts(data):
        for finding in stress_warnings(part):
            where = f"{key}.{finding.key}" if finding.key else key
            yield replace(finding, key=where, text=f"{name}: {finding.text}", concerns=f"{name} {finding.concerns}")


def describe_box_stress(data: xr.Dataset, findings: Sequence[Finding] = ()) -> Iterator[Block]:
    """Tabulate stresses of the teeth beside those of ISO 6336, stage by stage."""
    parts = list(stage_parts(data))
    for name, _, part in parts:
        of_stage = [
            replace(finding, concerns=finding.concerns.removeprefix(f"{name} "))
            for finding in findings
            if finding.concerns.startswith(f"{name} ")
        ]
        block = describe_stress(part, of_stage, findings)
        yield replace(block, title=f"Stresses, {name}") if len(parts) > 1 else block


def box_reason_rows(data: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Write the rows of a verdict that say which stresses differ from those of ISO 6336, and why, stage by stage."""
    parts = list(stage_parts(data))
    stages = dict[tuple[str, str], list[str]]()
    for name, _, part in parts:
        for row in reason_row(part):
            stages.setdefault(row, []).append(name)
    for (title, text), names in stages.items():
        yield (f"{title}, {merged_names(names)}" if len(parts) > 1 else title), text
