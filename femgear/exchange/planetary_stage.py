"""A planetary stage of a REXS file as the tables of a case, and the other way round.

Stages are found by their relations, not by names: the planetary stage holds cylindrical stages, each of which
joins two gears; the ring gear is a component of its own type, planets mesh with it, the sun with the planets.
The ring's profile shift has the sign of ISO 21771, the opposite of femgear's; its teeth and diameters are
positive, negative ones are understood. Centre distances are positive, of internal pairs too. Attributes are
those of the REXS specifications 1.0 to 2.0 (www.rexs.info), units are read from the file.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from femgear.case.estimates import USUAL_STIFFNESS, estimates, usual_rim, usual_torque
from femgear.case.flank_sections import OVER_WIDTH
from femgear.case.gear_set import planetary_set, support_stiffness
from femgear.case.load_spectrum import running_shares
from femgear.case.planetary import Case
from femgear.case.quantities import (
    ANGLE,
    DENSITY,
    LENGTH,
    MODULUS,
    SPEED,
    STIFFNESS,
    STRESS,
    TORQUE,
    Dimension,
    to_si,
)
from femgear.case.sections import gear_material
from femgear.errors import CaseError, FemgearError
from femgear.exchange.flank_modifications import Flank, flank_modifications, written_modifications
from femgear.exchange.gear_strength import add_treatments, strength_table, written_strength, written_treatment
from femgear.exchange.gear_unit import gears_of, loads_on, stage_components, unit_flow, with_load_case
from femgear.exchange.rexs import Component, Model, Relation
from femgear.exchange.unit_spectrum import load_case_shares, load_duration, spectrum_tables, tell_life_left_out
from femgear.findings import NOTE
from femgear.gears.iso6336_stiffness import STEEL
from femgear.gears.kinematics import MEMBERS, torque_ratios

if TYPE_CHECKING:
    pass

_GEARS = ("sun", "planet", "ring")
_RACK = {"addendum": 1.0, "dedendum": 1.25, "root_radius": 0.25}
_SOFT = 1e15
"""Stiffness up to which a bearing is a spring, the largest of a case [N/m]."""
RIGID = 10_000
"""Stiffness of a rigid bearing over that of a mesh."""


@dataclass(frozen=True)
class _Stage:
    """Components of a planetary stage or of a gear pair.

    Parameters
    ----------
    model : Model
        What the file holds.
    stage : Component
        The stage; of a pair its mesh.
    meshes, sun_meshes : list of Component
        All meshes, and of a planetary stage those with the sun.
    gears, flanks, shafts : dict of list of Component
        By member, ``"sun"``, ``"planet"`` and so on; those of planets together. Shafts have the carrier besides.
    """

    model: Model
    stage: Component
    meshes: list[Component]
    sun_meshes: list[Component]
    gears: dict[str, list[Component]]
    flanks: dict[str, list[Component]]
    shafts: dict[str, list[Component]]

    def common(
        self, of: Iterable[Component], attribute: str, kind: Dimension | None = None, *, sign: bool = True
    ) -> float | None:
        """Value in SI units of all that give it, None where none does; without ``sign`` of rings positive."""
        first_of_value: dict[float, Component] = {}
        for component in of:
            if (value := self.model.number(component, attribute, kind)) is not None:
                first_of_value.setdefault(value if sign or component.type != "ring_gear" else abs(value), component)
        if first_of_value and max(first_of_value) - min(first_of_value) > 1e-9 * max(map(abs, first_of_value)):
            least, most = first_of_value[min(first_of_value)], first_of_value[max(first_of_value)]
            self.model.refuse(
                f"{min(first_of_value):.9g} here, {max(first_of_value):.9g} of {most} (SI units)",
                f"{least}, {attribute}",
                limit="one value for all",
                remedy="femgear needs equal planets, and gears that match",
            )
        return next(iter(first_of_value), None)

    def needed(self, of: list[Component], attribute: str, kind: Dimension | None = None) -> float:
        """Value that all components have; tooth numbers of ring gears without their sign."""
        if (value := self.common(of, attribute, kind, sign=attribute != "number_of_teeth")) is None:
            self.model.refuse("the attribute is missing", f"{of[0]}, {attribute}", "give it in the gear unit")
        return value


def case_tables(
    model: Model, wanted: str | None = None, load_case: int | None = None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Read a planetary stage as tables of a case, with remarks by key on what is assumed.

    The id of the stage that is ``wanted`` is needed where there are several. Without the number of a load
    case, from 1, it is the first; further ones with its torque give further speeds. `Model.findings` holds
    what the case has not.

    CaseError: E-CHOICE: several stages, or not that one; no such load case. E-REXS: no planetary stage, or
    one of another form. E-UNIT.
    """
    s, remarks = _stage(model, _chosen(model, wanted)), dict[str, str]()
    title = "".join(c for c in s.stage.name or str(s.stage) if c.isprintable())
    tables = {"format": 1, "title": title[:200]} | gear_tables(s, remarks)
    _supports(s, tables, remarks)
    tables["operation"] = _operation(s, tables, remarks, load_case)
    operation = tables["operation"]
    ratios = torque_ratios(tables["sun"]["teeth"], tables["ring"]["teeth"])
    forwards = to_si(operation["torque"], TORQUE) * ratios[operation["input"]] > 0.0
    add_modifications(s, tables, remarks, {"sun": forwards, "ring": not forwards})
    if tables.get("static", {}).get("slices", 0) > 1:
        _one_width(tables, remarks)
    if left := [name for name in ("sun", "ring") if "profile_shift" not in tables[name]]:
        of = f"hence the profile shift of {' and '.join(left)}"
        remarks["set.centre_distance"] = f"assumed: no play at the distance of the file, {of}"
    return tables, remarks


def gear_tables(s: _Stage, remarks: dict[str, str]) -> dict[str, Any]:
    """Tables of what the gears of a stage share, of their material, and of each, without modifications."""
    tables: dict[str, Any] = {"set": _set(s, remarks), "material": {}}
    tables |= {name: _gear(s, name, remarks) for name in s.gears}
    _widths(s, tables, remarks)
    _materials(s, tables, remarks)
    _racks(s, tables, remarks)
    for name in s.gears:
        _rim(s, name, tables, remarks)
    if strength := strength_table(s.model, s.meshes, [gear for gears in s.gears.values() for gear in gears]):
        tables["strength"] = strength
    return tables


_ATTRIBUTES = {
    "teeth": "number_of_teeth",
    "module": "normal_module",
    "pressure_angle": "normal_pressure_angle",
    "profile_shift": "addendum_modification_coefficient",
    "centre_distance": "center_distance",
    "youngs_modulus": "elastic_modulus",
    "torque": "torque_around_u_axis",
}
"""Names in REXS of entries of a case that have another one there."""


@contextmanager
def named(model: Model, wanted: str | None = None) -> Iterator[None]:
    """Let refusals of the case of a stage name the file, and component and attribute where these are sure."""
    try:
        yield
    except FemgearError as error:
        mesh = model.components.get(wanted or "")
        s = (
            pair_stage(model, mesh)
            if mesh and mesh.type == "cylindrical_stage"
            else _stage(model, _chosen(model, wanted))
        )
        names = {"gear_1": "sun", "gear_2": [*s.gears][-1]}
        for problem in {error, *error.problems}:
            path = [names.get(part, part) for part in (problem.key or "").split(".")]
            problem.file, attribute = model.name, _ATTRIBUTES.get(path[-1], path[-1])
            near = [*s.gears.get(path[0], ()), *s.flanks.get(path[0], ())] or model.components.values()
            read = [m for m in near if attribute in m.attributes and (m.type, attribute) in model.used]
            if len({member.attributes[attribute] for member in read}) == 1:
                problem.key = f"{read[0]}, {attribute} ({problem.key})"
            _suspect_ring(s, problem)
        raise


def _suspect_ring(s: _Stage, error: FemgearError) -> None:
    """Let a refusal of the set name the teeth of the ring, where they are not those that sun and planets ask for."""
    if "planet" not in s.gears or error.code not in ("E-ASSEMBLY", "E-CENTRE-DISTANCE", "E-NEIGHBOURS"):
        return
    counts = {name: s.model.number(gears[0], "number_of_teeth") for name, gears in s.gears.items()}
    sun, planet, ring = (abs(counts[name] or 0.0) for name in _GEARS)
    suiting = sun + 2.0 * planet
    # profile shifts move it by a tooth or two
    if abs(ring - suiting) > 0.0 and (error.code == "E-ASSEMBLY" or abs(ring - suiting) > 2.0):
        error.remedies = (
            f"check number_of_teeth of {s.gears['ring'][0]}: {ring:g}, where a sun of {sun:g} and planets of "
            f"{planet:g} teeth without profile shift ask for {suiting:g}",
            *error.remedies,
        )


def _chosen(model: Model, wanted: str | None) -> Component:
    """Planetary stage of an id, or the only one."""
    stages = [component for component in model.components.values() if component.type == "planetary_stage"]
    if not stages:
        kinds = sorted({component.type for component in model.components.values() if component.type.endswith("_stage")})
        model.refuse(
            "the file has no planetary stage",
            "components",
            limit=f"planetary_stage, not {', '.join(kinds)}",
            remedy="femgear imports planetary and cylindrical stages",
        )
    chosen = [stage for stage in stages if stage.id == wanted or (wanted is None and len(stages) == 1)]
    if not chosen:
        raise CaseError(
            f"the file has {len(stages)} planetary stages" if wanted is None else "no such planetary stage",
            code="E-CHOICE",
            key="--stage",
            value=wanted,
            file=model.name,
            limit=", ".join(f"{stage.id} ({stage.name})" for stage in stages[:20]),
            remedy=f"choose one by its id: --stage {stages[0].id}",
        )
    return chosen[0]


def _stage(model: Model, stage: Component) -> _Stage:
    """Gears, flanks and shafts of a stage, by its relations."""
    meshes: list[tuple[Component, list[Component]]] = []
    mates: dict[str, list[Component]] = {}
    for mesh in model.related("assembly", "part", assembly=stage.id):
        pair = [gear for role in ("gear_1", "gear_2") for gear in model.related("stage", role, stage=mesh.id)]
        if mesh.type == "cylindrical_stage" and len(pair) == 2:
            meshes.append((mesh, pair))
            for gear, mate in (pair, pair[::-1]):
                mates.setdefault(gear.id, []).append(mate)
    rings = [model.components[id] for id in mates if model.components[id].type == "ring_gear"]
    planets = {mate.id: mate for ring in rings for mate in mates[ring.id]}
    suns = {mate.id: mate for planet in planets for mate in mates[planet] if mate.type != "ring_gear"}
    # every planet meshes with the one sun and the one ring, and with nothing else
    if len(rings) != 1 or len(suns) != 1 or planets.keys() & suns or len(meshes) != 2 * len(planets):
        model.refuse(
            f"{len(meshes)} meshes join {len(rings)} ring gears, {len(planets)} planets, {len(suns)} suns",
            str(stage),
            limit="one sun, one ring gear, and planets that mesh with both and with nothing else",
            remedy="femgear computes simple sets: no pairs of planets, no stepped ones, no second sun",
        )
    gears = {"sun": [*suns.values()], "planet": [*planets.values()], "ring": rings}

    def of_all(kind: str, to: tuple[str, ...], role: str) -> dict[str, list[Component]]:
        return {
            name: [
                related for component in ones for t in to for related in model.related(kind, t, **{role: component.id})
            ]
            for name, ones in gears.items()
        }

    shafts = of_all("assembly", ("assembly",), "part")
    shafts["carrier"] = model.related("planet_carrier_shaft", "shaft", planetary_stage=stage.id)
    sun_meshes = [mesh for mesh, pair in meshes if suns.keys() & {gear.id for gear in pair}]
    flanks = of_all("flank", ("left", "right"), "gear")
    return _Stage(model, stage, [mesh for mesh, _ in meshes], sun_meshes, gears, flanks, shafts)


def pair_stage(model: Model, mesh: Component) -> _Stage:
    """Find gears, flanks and shafts of two gears: gear 1 as "sun", gear 2 as "planet", internal as "ring".

    CaseError: other numbers of gears (E-REXS).
    """
    pair = gears_of(model, mesh)
    if len(pair) != 2 or pair[0].type == "ring_gear":
        kinds = ", ".join(map(str, pair)) or "none"
        model.refuse("a stage of two gears is needed", str(mesh), limit=f"an external gear and its mate, not {kinds}")
    wheel = "ring" if pair[1].type == "ring_gear" else "planet"
    gears = {"sun": [pair[0]], wheel: [pair[1]]}
    flanks = {
        name: [flank for side in ("left", "right") for flank in model.related("flank", side, gear=gear.id)]
        for name, (gear,) in gears.items()
    }
    shafts = {name: model.related("assembly", "assembly", part=gear.id) for name, (gear,) in gears.items()}
    return _Stage(model, mesh, [mesh], [], gears, flanks, shafts)


def with_unit(value: float, dimension: Dimension) -> str:
    return f"{float(f'{value / dimension.scale:.12g}')!r} {dimension.shown}".replace(".0 ", " ")


def _set(s: _Stage, remarks: dict[str, str]) -> dict[str, Any]:
    """Section of what the gears share; planet angles where planets are not equally spaced."""
    set_table: dict[str, Any] = {"planets": len(s.gears["planet"])} if s.sun_meshes else {}
    if (distance := s.common(s.meshes, "center_distance", LENGTH)) is not None:
        set_table["centre_distance"] = with_unit(distance, LENGTH)
    given = [s.common(s.gears[name], "face_width", LENGTH) for name in s.gears]
    given += [s.model.number(mesh, "common_face_width", LENGTH) for mesh in s.meshes]
    widths = [value for value in given if value is not None]
    width = min(widths) if widths else s.needed(s.gears["sun"], "face_width", LENGTH)
    set_table["face_width"] = with_unit(width, LENGTH)
    turned = [s.model.number(mesh, "rotating_angle_around_neg_u_axis", ANGLE) for mesh in s.sun_meshes]
    angles = sorted(angle % math.tau for angle in turned if angle is not None)
    if len(angles) < len(turned):
        remarks["set.planets"] = "assumed: equally spaced"
    elif s.sun_meshes:
        steps = [b - a for a, b in pairwise((*angles, angles[0] + math.tau))]
        if max(steps) - min(steps) > 1e-6:
            set_table["planet_angles"] = [with_unit(angle - angles[0], ANGLE) for angle in angles]
    helix = "helix_angle_reference_diameter"
    sun, *others = (s.common(s.gears[name], helix, ANGLE) or 0.0 for name in s.gears)
    # an internal gear has the hand of its mate
    hand = -1.0 if [*s.gears] == ["sun", "ring"] else 1.0
    if max(abs(sun + hand * other) for other in others) > 1e-9:
        limit = "equal ones, that of the sun with the other sign"
        s.model.refuse("helix angles do not match", f"{s.gears['sun'][0]}, {helix}", limit=limit)
    if sun:
        set_table["helix_angle"] = with_unit(sun, ANGLE)
        remarks["set.helix_angle"] = "assumed: a positive one is right-handed"
    return set_table


def _widths(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Face widths of gears that are wider than what all meshes have in common."""
    common, second = to_si(tables["set"]["face_width"], LENGTH), [*s.gears][1]
    widths = {name: s.common(s.gears[name], "face_width", LENGTH) or common for name in s.gears}
    if min(min(pair) for pair in pairwise(widths.values())) > (1.0 + 1e-9) * common:
        whole, widths[second] = with_unit(widths[second], LENGTH), common
        remarks[f"{second}.face_width"] = f"assumed: what the meshes have in common; the gear has {whole}"
        tables[second]["face_width"] = with_unit(common, LENGTH)
    for name, width in widths.items():
        if abs(width - common) > 1e-9 * common:
            tables[name]["face_width"] = with_unit(width, LENGTH)


def _one_width(tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Make planets as narrow as the narrower one of their meshes, where slices take one width for both."""
    common = tables["set"]["face_width"]
    widths = [to_si(tables[name].get("face_width", common), LENGTH) for name in _GEARS]
    meshes = [min(pair) for pair in pairwise(widths)]
    if max(meshes) > (1.0 + 1e-9) * min(meshes):
        tables["planet"]["face_width"] = with_unit(min(meshes), LENGTH)
        remarks["planet.face_width"] = (
            f"assumed: slices take one width for both meshes; planets have {with_unit(widths[1], LENGTH)}"
        )


def _materials(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Material of the sun for all gears, and what those of others have different."""
    made = {name: _made_of(s.model, ones[0]) for name, ones in s.gears.items()}
    for name in [name for name, ones in made.items() if not ones]:
        made[name] = _made_of(s.model, *s.shafts.get(name, ())[:1])
        if made[name]:
            text = f"{s.gears[name][0]} has no material: that of its shaft is taken"
            s.model.remark(f"{name}.material", text, severity=NOTE)
    for key, attribute, dimension, usual in (
        ("youngs_modulus", "elastic_modulus", MODULUS, STEEL),
        ("poisson_ratio", "poisson_ratio", None, 0.3),
        ("density", "density", DENSITY, 7850.0),
    ):
        values = {
            name: s.model.number(component, attribute, dimension)
            for name, ones in made.items()
            for component in ones[:1]
        }
        given = {name: value for name, value in values.items() if value is not None}
        value = next(iter(given.values()), usual)
        tables["material"][key] = with_unit(value, dimension) if dimension else value
        if missing := [name for name in s.gears if name not in given]:
            what = f"of the {' and the '.join(missing)} too" if given else "steel"
            remarks[f"material.{key}"] = f"assumed: {what}"
        _differing(tables, key, dimension, value, given)
    for key, attribute in (("root", "endurance_limit_root"), ("contact", "endurance_limit_flank")):
        values = {n: s.common((s.gears[n][0], *made[n][:1]), attribute, STRESS) for n in s.gears}
        given = {name: value for name, value in values.items() if value is not None}
        common = None
        if len(given) == len(values):
            common = next(iter(given.values()))
            tables["material"][f"{key}_stress_limit"] = with_unit(common, STRESS)
        _differing(tables, f"{key}_stress_limit", STRESS, common, given)
    add_treatments(s.model, tables, {name: parts[0] for name, parts in s.gears.items()}, made)
    for section in ("material", *s.gears):
        material = tables["material"] if section == "material" else tables[section].get("material", {})
        if material.get("estimated"):
            key = "material" if section == "material" else f"{section}.material"
            remarks[f"{key}.treatment"] = "assumed: by the tensile strength of the file"
            remarks[f"{key}.hardness"] = "assumed"


def _made_of(model: Model, *parts: Component) -> list[Component]:
    """Materials that components refer to."""
    referred = (material for part in parts for material in model.related("reference", "referenced", origin=part.id))
    return [material for material in referred if material.type == "material"]


def _differing(
    tables: dict[str, Any],
    key: str,
    dimension: Dimension | None,
    common: float | None,
    given: dict[str, float],
) -> None:
    """Give the materials of gears an entry that is another one than the common one, if there is one."""
    for name, value in given.items():
        if common is None or abs(value - common) > 1e-9 * abs(common):
            material = tables[name].setdefault("material", {})
            material[key] = with_unit(value, dimension) if dimension else value


def _gear(s: _Stage, name: str, remarks: dict[str, str]) -> dict[str, Any]:
    """Section of a gear without rack and rim."""
    gears, every = s.gears[name], [component for ones in s.gears.values() for component in ones]
    teeth = s.needed(gears, "number_of_teeth")
    if not teeth or teeth != round(teeth):
        s.model.refuse(f"{teeth:g} is no number of teeth", f"{gears[0]}, number_of_teeth")
    section: dict[str, Any] = {"teeth": round(teeth)}
    if name == "sun":
        section["module"] = with_unit(s.needed(every, "normal_module", LENGTH), LENGTH)
        angle = s.common((flank for ones in s.flanks.values() for flank in ones), "normal_pressure_angle", ANGLE)
        section["pressure_angle"] = with_unit(math.radians(20.0) if angle is None else angle, ANGLE)
        remarks |= {"sun.pressure_angle": "assumed"} if angle is None else {}
    shift = s.common(s.flanks[name], "addendum_modification_coefficient")
    if shift is not None:
        section["profile_shift"] = 0.0 - shift if name == "ring" else shift
    elif name == "planet":
        section["profile_shift"], remarks["planet.profile_shift"] = 0.0, "assumed"
    for key in ("tip_diameter", "root_diameter"):
        if (diameter := s.common(gears, key, LENGTH, sign=False)) is None:
            continue
        module = s.common(every, "normal_module", LENGTH)
        # no gear has tips this deep inside its reference circle
        if key == "tip_diameter" and name != "ring" and module and diameter < module * (section["teeth"] - 3.0):
            text = f"the tip diameter {1e3 * diameter:.4g} mm of {gears[0]} lies inside its teeth: it is left out"
            s.model.remark(f"{name}.tip_diameter", text, remedy="correct it in the file, or give it in the case")
            continue
        section[key] = with_unit(diameter, LENGTH)
    return section


def _racks(s: _Stage, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Basic racks from flanks and tools: that of the sun for all, of others where they differ."""
    module, number = to_si(tables["sun"]["module"], LENGTH), s.model.number
    for name in s.gears:
        common_entries = {"addendum": s.common(s.flanks[name], "addendum_coefficient_basic_profile")}
        for tool in _tools(s, name)[:1]:
            radius = number(tool, "tip_radius", LENGTH)
            common_entries["dedendum"] = number(tool, "addendum_coefficient_reference_profile")
            common_entries["root_radius"] = radius / module if radius else number(tool, "tip_radius_factor")
            if tool.type == "cutter_wheel_tool" and (teeth := number(tool, "number_of_teeth")):
                tables[name]["cutter_teeth"] = round(teeth)
                if shift := number(tool, "addendum_modification_coefficient"):
                    tables[name]["cutter_profile_shift"] = shift
        rack = _RACK | {key: value for key, value in common_entries.items() if value is not None}
        if name == "sun" or rack != tables["rack"]:
            (tables if name == "sun" else tables[name])["rack"] = rack
            where = "rack" if name == "sun" else f"{name}.rack"
            missing = [key for key in rack if common_entries.get(key) is None]
            remarks |= {f"{where}.{key}": "assumed: ISO 53 profile C" for key in missing}


def _tools(s: _Stage, name: str) -> list[Component]:
    """Tools that relations join with a gear, and since version 1.4 with its flanks."""
    steps = [(flank, "manufacturing_step", "workpiece", "tool") for flank in s.flanks[name]]
    for kind in ("reference", "ordered_reference"):
        steps += [(gear, kind, "origin", "referenced") for gear in s.gears[name]]
    tools = (t for component, kind, role, to in steps for t in s.model.related(kind, to, **{role: component.id}))
    return [tool for tool in tools if tool.type in ("rack_shaped_tool", "cutter_wheel_tool")]


def _rim(s: _Stage, name: str, tables: dict[str, Any], remarks: dict[str, str]) -> None:
    """Bore or outer radius: of the gear, of the shaft where it stands, or assumed."""
    gear, section, internal = s.gears[name][0], tables[name], name == "ring"
    module, helix = to_si(tables["sun"]["module"], LENGTH), tables["set"].get("helix_angle", "0 deg")
    usual, root = usual_rim(
        section["teeth"],
        module,
        section.get("rack", tables["rack"])["dedendum"],
        section.get("profile_shift", 0.0),
        internal=internal,
        helix=to_si(helix, ANGLE),
    )
    given = None if internal else s.model.number(gear, "inner_diameter", LENGTH)
    place = s.model.number(gear, "u_coordinate_on_shaft", LENGTH) or 0.0
    for shaft in s.shafts[name][:1] if given is None else ():
        given = _diameter(s.model, shaft, place)
    radius, key = 0.5 * (given or 0.0), f"{name}.{'outer' if internal else 'bore'}_radius"
    fits = radius > root if internal else 0.0 < radius < root
    section[key.partition(".")[2]] = with_unit(radius if fits else usual, LENGTH)
    if not fits:
        why = f"; {with_unit(given, LENGTH)} of its shaft do not fit its root circle" if given else ""
        remarks[key] = f"assumed: a rim of {'four' if internal else 'three'} modules{why}"


def _diameter(model: Model, shaft: Component, place: float) -> float | None:
    """Outer diameter [m] of a shaft at a place along it [m]."""
    for part in model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id):
        if part.type == "shaft_section":
            keys = ("u_coordinate_on_shaft", "length", "outer_diameter_begin", "outer_diameter_end")
            start, length, begin, end = (model.number(part, key, LENGTH) or 0.0 for key in keys)
            if length and begin and end and -1e-9 <= place - start <= length + 1e-9:
                return begin + (end - begin) * (place - start) / length
    return None


def _supports(s: _Stage, tables: dict[str, object], remarks: dict[str, str]) -> None:
    """Radial stiffness of the bearings of a planet on its pin, of sun and carrier in the casing.

    A rigid bearing becomes a spring of `RIGID` mesh stiffnesses: members of a case have springs.
    """
    tables["carrier"] = {}
    bearings = {"planet": bearings_between(s.model, s.shafts["planet"][:1], "outer_part", "shaft")}
    for name in ("sun", "carrier"):
        bearings[name] = bearings_between(s.model, s.shafts[name], "inner_part", "gear_casing")
    for name, bearings_there in bearings.items():
        key = "bearing_stiffness" if name == "planet" else "support_stiffness"
        add_bearings(s, tables, remarks, name, key, bearings_there)


def add_bearings(
    s: _Stage, tables: dict[str, Any], remarks: dict[str, str], name: str, key: str, bearings_there: list[Component]
) -> None:
    """Add the radial stiffness of bearings to a member; rigid ones are `RIGID` mesh stiffnesses."""
    width, modulus = to_si(tables["set"]["face_width"], LENGTH), tables["material"]["youngs_modulus"]
    rigid = min(RIGID * USUAL_STIFFNESS * to_si(modulus, MODULUS) / STEEL * width, _SOFT)
    springs = [bearing for bearing in bearings_there if is_bearing(bearing)]
    values = [k for spring in springs if (k := _radial_stiffness(s.model, spring, f"{name}.{key}")) and k > 0.0]
    if max(values, default=0.0) > _SOFT:
        many = Counter(f"{value:.3g} N/m" for value in values).items()
        what = ", ".join(f"{n} bearing{'s' * (n > 1)} of {stiffness}" for stiffness, n in many)
        tables[name][key] = f"{rigid:.3g} N/m"
        remarks[f"{name}.{key}"] = f"rigid: {what} in the file"
        s.model.remark(
            f"{name}.{key}",
            f"{what}: rigid, taken as {rigid:.3g} N/m, {RIGID:,} mesh stiffnesses, which changes natural "
            "frequencies by less than 0.1 %; real bearings are softer, and move them by more",
            remedy="give the stiffness of the bearings",
            severity=NOTE,
        )
    elif values:
        tables[name][key] = with_unit(sum(values), STIFFNESS)
    elif springs:
        text = f"{len(springs)} bearings without radial_stiffness, such as {springs[0]}: it is estimated"
        s.model.remark(f"{name}.{key}", text, remedy="give it in the case")


def _radial_stiffness(model: Model, bearing: Component, key: str) -> float | None:
    """Radial stiffness of a bearing [N/m]; None of one without it, or whose it cannot be read, which is told."""
    try:
        return model.number(bearing, "radial_stiffness", STIFFNESS)
    except CaseError as error:
        text = f"{bearing}, radial_stiffness {error.value}: {error.message}: not taken"
        model.remark(key, text, remedy="correct it in the file, or give the stiffness in the case")
        return None


def is_bearing(part: Component) -> bool:
    """Tell whether a component is a bearing of any type, such as rolling_bearing_with_catalog_geometry."""
    return "bearing" in part.type


def bearings_between(model: Model, shafts: list[Component], role: str, mate: str) -> list[Component]:
    """Bearings and couplings that join shafts, in a role, with a component of a type."""
    other = "inner_part" if role == "outer_part" else "outer_part"
    joints = (joint for shaft in shafts for joint in model.related("side", "assembly", **{role: shaft.id}))
    return [joint for joint in joints if any(m.type == mate for m in model.related("side", other, assembly=joint.id))]


def add_modifications(s: _Stage, tables: dict[str, Any], remarks: dict[str, str], forwards: Mapping[str, bool]) -> None:
    """Add the modifications of the flanks of all gears, and findings on those that no case has.

    Looked at from the end z > 0, tooth upwards, the left flank leads a sun that turns counter-clockwise. Left
    flanks touch left ones, of internal gears too (ISO 21771-1): of planets they are those towards the sun
    under a positive torque, and right flanks those towards the ring. ``forwards`` tells of gears with one
    mate whether their left flanks carry; planets have both.
    """
    model = s.model
    for name in s.gears:
        flanks = [_flanks_of(s, tables, name, gear) for gear in s.gears[name]]
        sides = flanks[0]
        if any(flank != sides for flank in flanks):
            first = s.gears[name][0]
            model.remark(f"{name}.modifications", f"planets have different modifications: all get those of {first}")
        for problem in dict.fromkeys(
            p for flanks_of_side in flanks for flank in flanks_of_side.values() for p in flank.left_out
        ):
            model.remark(f"{name}.modifications", f"not taken: {problem}")
        left, right = (sides[side].tables if side in sides else [] for side in ("left", "right"))
        sections_of_flanks = left
        if left != right and name not in forwards:
            sections_of_flanks = [{"flank": "sun side", **section} for section in left]
            sections_of_flanks += [{"flank": "ring side", **section} for section in right]
        elif left != right:
            sections_of_flanks = left if forwards[name] else right
            model.remark(
                f"{name}.modifications",
                f"the flanks of {s.gears[name][0]} differ: taken are those that carry under the torque of "
                "the case; its back flanks, and flanks under the other sense of torque, get the same",
            )
        if sections_of_flanks:
            tables[name]["modifications"] = sections_of_flanks
        if any(flank.signs for flank in sides.values()):
            model.remark(
                f"{name}.modifications",
                "slopes and twist are taken with the sign of ISO 1328-1, more material at the tip or at the "
                "non-datum face; REXS does not define it",
                remedy="compare with the drawing",
            )

    sections = (tables[name] for name in s.gears)
    leads = (
        modification["kind"] in OVER_WIDTH for section in sections for modification in section.get("modifications", ())
    )
    if "helix_angle" in tables["set"] or any(leads):
        tables["static"], remarks["static.slices"] = {"slices": 25}, "assumed"
    _chamfers(s, tables)


def _chamfers(s: _Stage, tables: dict[str, Any]) -> None:
    """End the flanks of gears with chamfers of the tips where these begin, with findings.

    Taken as the radial height h_K of ISO 21771, which leaves a flank up to the diameter d_a - 2 h_K.
    """
    for name, gears in s.gears.items():
        sizes = [s.model.number(flank, "tooth_tip_chamfer", LENGTH) or 0.0 for flank in s.flanks[name]]
        if not (height := max(sizes, default=0.0)) > 0.0:
            continue
        table, module = tables[name], to_si(tables["sun"]["module"], LENGTH)
        if (tip := table.get("tip_diameter")) is not None:
            inwards = -1.0 if gears[0].type == "ring_gear" else 1.0
            table["tip_diameter"] = with_unit(to_si(tip, LENGTH) - inwards * 2.0 * height, LENGTH)
            key, entry = "tip_diameter", f"tip_diameter = {table['tip_diameter']}"
        else:
            rack = table.get("rack", tables["rack"])
            table["rack"] = rack | {"addendum": float(f"{rack['addendum'] - height / module:.12g}")}
            key, entry = "rack.addendum", f"an addendum of {table['rack']['addendum']:g} modules"
        s.model.remark(
            f"{name}.{key}",
            f"tooth_tip_chamfer of {with_unit(height, LENGTH)} is taken as its radial height, hence {entry}: flanks "
            "end where it begins; transmission error hangs on it",
            remedy="compare with the drawing",
        )


def _flanks_of(s: _Stage, tables: dict[str, Any], name: str, gear: Component) -> dict[str, Flank]:
    """Modifications of the flanks of a gear by side, "left" and "right" as seen from the end z > 0."""
    module, teeth = to_si(tables["sun"]["module"], LENGTH), tables[name]["teeth"]
    helix = to_si(tables["set"].get("helix_angle", "0 deg"), ANGLE)
    angle = math.atan(math.tan(to_si(tables["sun"]["pressure_angle"], ANGLE)) / math.cos(helix))
    tip = tables[name].get("tip_diameter")
    up = s.model.text(gear, "datum_face_orientation") != "positive"
    given = {
        "width": _width(s, tables, name),
        "base_radius": 0.5 * teeth * module / math.cos(helix) * math.cos(angle),
        "tip_diameter": None if tip is None else to_si(tip, LENGTH),
        "internal": name == "ring",
        "up": up,
    }
    # ISO 1328-1 looks at the datum face, from z < 0 where it lies there
    seen = {"left": "right", "right": "left"} if up else {"left": "left", "right": "right"}
    return {
        seen[role]: flank_modifications(s.model, flank, **given)
        for role in ("left", "right")
        for flank in s.model.related("flank", role, gear=gear.id)[:1]
    }


def _width(s: _Stage, tables: dict[str, Any], name: str) -> float:
    """Face width of a gear [m], that of the set where the case gives it none of its own."""
    return to_si(tables[name].get("face_width", tables["set"]["face_width"]), LENGTH)


def _operation(s: _Stage, tables: dict[str, Any], remarks: dict[str, str], wanted: int | None) -> dict[str, Any]:
    """Input, fixed member, torque and speeds of the input."""
    coupled = {name: bearings_between(s.model, s.shafts[name], "inner_part", "gear_casing") for name in MEMBERS}
    held = [name for name in MEMBERS if any(coupling.type.endswith("coupling") for coupling in coupled[name])]
    fixed = held[0] if len(held) == 1 else "ring"
    remarks |= {} if len(held) == 1 else {"operation.fixed": "assumed"}
    number, given = s.model.chosen_case(wanted)
    state_list = [_state(s, fixed, given), *(_state(s, fixed, load_case) for load_case in s.model.load_cases)]
    stands, idle = (0.0 in values.values() for values in state_list[0])
    states = [tuple({name: v for name, v in state.items() if v} for state in pair) for pair in state_list]
    turning, loaded = states[0]
    usual = "carrier" if fixed == "sun" else "sun"
    member = next(iter([*(name for name in turning if name in loaded), *turning, *loaded]), usual)
    ratios = torque_ratios(tables["sun"]["teeth"], tables["ring"]["teeth"])
    torques, speeds_of_all = zip(*(_of_member(member, ratios, *state) for state in states), strict=True)
    torque = torques[0]
    if torque is None:
        width, module = to_si(tables["set"]["face_width"], LENGTH), to_si(tables["sun"]["module"], LENGTH)
        teeth = tables["sun"]["teeth"], tables["planet"]["teeth"]
        on_sun = usual_torque(*teeth, module, width, tables["set"]["planets"])
        torque = float(f"{on_sun * abs(ratios[member]):.3g}")
        remarks["operation.torque"] = f"assumed: K factor of 1 N/mm^2{'; that of the file is 0' * idle}"
    shares = load_case_shares(s.model.load_cases)
    speeds = speeds_of_cases(s.model, number, torques, speeds_of_all, shares, alone=wanted is not None)
    remarks |= {} if turning or loaded else {"operation.input": "assumed"}
    remarks |= {} if speeds else {"operation.speeds": f"assumed{'; that of the file is 0' * stands}"}
    texts = dict.fromkeys(with_unit(speed, SPEED) for speed in speeds or [1000.0 * SPEED.scale])
    operation = {"input": member, "fixed": fixed, "torque": with_unit(torque, TORQUE), "speeds": [*texts]}
    spectrum = spectrum_tables(s.model, torques[1:], speeds_of_all[1:], shares)
    return operation | ({"load_case": spectrum} if spectrum else {})


def speeds_of_cases(
    model: Model,
    number: int,
    torques: Sequence[float | None],
    speeds: Sequence[float],
    shares: Sequence[float | None],
    *,
    alone: bool,
) -> list[float]:
    """List the speeds of the load case of a number [rad/s], and of those with its torque unless ``alone``.

    Torques [N m] and speeds are those of this load case, then of all, with their shares. A finding lists the cases left
    out; beside one of no duration those of the life are none of them.
    """
    taken, others, first = [speeds[0]], [], torques[0]
    of_life = bool(shares) and shares[number - 1] == 0.0
    for i, (torque, speed) in enumerate(zip(torques[1:], speeds[1:], strict=True), start=1):
        if of_life and shares[i - 1] != 0.0:
            continue
        alike = torque == first or (torque and first and abs(torque - first) <= 1e-6 * abs(first))
        if i != number and alike and not alone:
            taken.append(speed)
        elif i != number:
            others.append(model.case_in_words(i, speed, torque))
    if others:
        count = len(model.load_cases)
        model.remark(
            "operation",
            f"load case {number} of {count} is taken; others have torques and speeds of their own: "
            f"{'; '.join(others[:10])}{' ...' * (len(others) > 10)}",
            remedy=f"--load-case 1 to {count} takes another",
        )
    return list(dict.fromkeys(taken_speed for taken_speed in taken if taken_speed))


def _of_member(
    member: str, ratios: Mapping[str, float], turns: Mapping[str, float], loads: Mapping[str, float]
) -> tuple[float | None, float]:
    """Torque [N m] and positive speed [rad/s] of a member; the torques of all members follow from one."""
    speed = turns.get(member, 0.0)
    for by in (member, *loads):
        if by in loads:
            return math.copysign(1.0, speed) * loads[by] * ratios[member] / ratios[by], abs(speed)
    return None, abs(speed)


def _state(s: _Stage, fixed: str, given: Mapping[str, Mapping]) -> tuple[dict[str, float], dict[str, float]]:
    """Speeds [rad/s] and torques [N m] of members in a load case; powers give torques at their speed.

    Where the shafts of the stage say nothing of one of them, it is what flows through the unit.
    """
    model, turns, loads = s.model, {}, {}
    for name, shaft in ((m, component) for m in MEMBERS if m != fixed for component in s.shafts[m]):
        speed = model.number(with_load_case(shaft, given), "rotational_speed", SPEED)
        turns |= {} if speed is None else {name: turns.get(name) or speed}
        for torque in loads_on(model, shaft, given):
            loads |= {} if torque is None else {name: loads.get(name, 0.0) + torque}
    if len(stage_components(model)) > 1:
        flow = unit_flow(model, given)
        if not turns:
            members = ((name, component.id) for name in MEMBERS if name != fixed for component in s.shafts[name][:1])
            turns = {name: flow.speed[id] for name, id in members if id in flow.speed}
        # what acts on a shaft is shared where another stage sits on it, too
        if s.stage.id in flow.torque and (not loads or s.stage.id in flow.joined):
            loads = {"sun": -flow.torque[s.stage.id]}
    return turns, loads


class ModelWriter:
    """Components and relations of a new model."""

    def __init__(self):
        self.components: dict[str, Component] = {}
        self.relations: list[Relation] = []

    def add(self, type: str, name: str = "", **attributes: tuple[str, str] | None) -> str:
        """Add a component with those attributes that are given, and return its id."""
        id = str(len(self.components) + 1)
        given = {key: attribute for key, attribute in attributes.items() if attribute is not None}
        self.components[id] = Component(id, type, name, given)
        return id

    def relate(self, type: str, **roles: str) -> None:
        """Add a relation with an id in each role."""
        self.relations.append(Relation(type, tuple(roles.items())))


_UNITS = {
    "mm": 1e-3,
    "deg": math.pi / 180,
    "1 / min": SPEED.scale,
    "N / mm^2": 1e6,
    "kg / dm^3": 1e3,
    "N m": 1.0,
    "N / m": 1.0,
    "N mm / rad": 1e-3,
    "N": 1.0,
    "kN": 1e3,
    "mum": 1e-6,
    "m / s^2": 1.0,
    "%": 1e-2,
    "h": 3600.0,
    "none": 1.0,
}
"""SI values of units as REXS spells them."""


def rexs_attribute(value: float | None, unit: str = "none") -> tuple[str, str] | None:
    """SI value, or none, in a unit of REXS."""
    return None if value is None else (f"{value / _UNITS[unit]:.15g}", unit)


def stage_model(case: Case, name: str) -> Model:
    """Write gears, material, bearings and operation of a planetary set as a REXS model of version 1.4.

    Masses, estimated stiffnesses, play, errors of teeth, dynamics and housing are left out. `Model.findings`
    holds modifications that REXS has no form for.
    """
    gears, w = planetary_set(case), ModelWriter()
    unit, casing = w.add("gear_unit", case.title), w.add("gear_casing", "casing")
    stage, carrier = w.add("planetary_stage", case.title), w.add("planet_carrier", "carrier")
    for whole, part in ((unit, casing), (unit, stage), (stage, carrier)):
        w.relate("assembly", assembly=whole, part=part)
    model = Model(name, "1.4", w.components, (), ())
    (sun, sun_shaft), (ring, ring_shaft) = (
        add_gear(w, case, gear.name, gear, model) for gear in (gears.sun, gears.ring)
    )
    shafts = {"sun": sun_shaft, "ring": ring_shaft, "carrier": w.add("shaft", "carrier shaft")}
    w.relate("planet_carrier_shaft", planetary_stage=stage, shaft=shafts["carrier"])
    for shaft in (sun_shaft, ring_shaft):
        w.relate("central_shaft", planetary_stage=stage, shaft=shaft)
    bearing = {"radial_stiffness": _stiffness(case, "planet", "bearing_stiffness")}
    add_planets(w, case, model, stage, (sun, ring), gears.planet_angles, bearing)
    load_cases = _add_operation(w, case, shafts, casing, unit)
    tell_life_left_out(case.operation, model.remark)
    return replace(model, relations=tuple(w.relations), load_cases=load_cases)


def add_planets(
    w: ModelWriter,
    case: Any,
    model: Model,
    stage: str,
    central: tuple[str, str],
    turned: Iterable[float],
    bearing: Mapping[str, tuple[str, str] | None],
) -> None:
    """Add planets on bearings on pins, and their meshes with the sun and ring of these ids.

    ``turned`` are the angles of the planets around the negative u axis [rad], ``bearing`` the attributes of theirs.
    """
    rated = written_strength(case.strength)
    gears, (sun, ring), a = planetary_set(case), central, rexs_attribute
    for number, angle in enumerate(turned, start=1):
        planet, shaft = add_gear(w, case, f"planet {number}", gears.planet, model)
        pin = w.add("shaft", f"pin {number}")
        w.relate("planet_shaft", planetary_stage=stage, shaft=shaft)
        w.relate("planet_pin", planetary_stage=stage, shaft=pin)
        held = w.add("concept_bearing", f"bearing of planet {number}", **bearing)
        w.relate("side", assembly=held, outer_part=shaft, inner_part=pin)
        for pair, direction in (((sun, planet), angle), ((planet, ring), angle + math.pi)):
            mesh = w.add(
                "cylindrical_stage",
                center_distance=a(gears.centre_distance, "mm"),
                rotating_angle_around_neg_u_axis=a(direction % math.tau, "deg"),
                application_factor_iso_6336_2019=rated.get("application_factor_iso_6336_2019"),
            )
            w.relate("assembly", assembly=stage, part=mesh)
            w.relate("stage", stage=mesh, gear_1=pair[0], gear_2=pair[1])


def add_gear(
    w: ModelWriter, case: Any, name: str, gear: Any, model: Model, shaft: str | None = None, place: float = 0.0
) -> tuple[str, str]:
    """Add a gear with flanks, tool and material, at a place [m] on a shaft, else on one of its own; ids of both.

    On a shaft of its own a ring has a section of its outer diameter, elsewhere REXS has no place for it.
    """
    a, section, internal = rexs_attribute, getattr(case, gear.name), gear.internal
    tip = 2.0 * gear.tip_radius if section.tip_diameter or gear.tip_shortening else None
    rack, helix, material = section.rack or case.rack, case.helix_angle or 0.0, gear_material(case, gear.name)
    rim = a(2.0 * gear.rim_radius, "mm")
    # gears on one axis have one hand, mates of external gears the other
    hand = 1.0 if gear.name in ("sun", "gear_1") or (gear.name == "gear_2" and internal) else -1.0
    id = w.add(
        "ring_gear" if internal else "cylindrical_gear",
        name,
        number_of_teeth=a(gear.teeth),
        normal_module=a(case.module, "mm"),
        face_width=a(gear.face_width, "mm"),
        helix_angle_reference_diameter=a(hand * helix, "deg"),
        tip_diameter=a(tip, "mm"),
        root_diameter=a(section.root_diameter, "mm"),
        u_coordinate_on_shaft=a(place, "mm"),
        inner_diameter=None if internal else rim,
        global_tolerance_class_iso_1328_2013=written_strength(case.strength).get(
            "global_tolerance_class_iso_1328_2013"
        ),
    )
    parts = [id]
    if internal and shaft is None:
        parts += [
            w.add(
                "shaft_section",
                u_coordinate_on_shaft=a(0.0, "mm"),
                length=a(gear.face_width, "mm"),
                outer_diameter_begin=rim,
                outer_diameter_end=rim,
            )
        ]
    shaft = shaft or w.add("shaft", f"{name} shaft")
    for part in parts:
        w.relate("assembly", assembly=shaft, part=part)
    made = _add_material(w, material, lambda text: model.remark(f"{gear.name}.material.grade", text))
    w.relate("reference", origin=id, referenced=made)
    cutter = getattr(section, "cutter_teeth", None)
    tool = w.add(
        "rack_shaped_tool" if cutter is None else "cutter_wheel_tool",
        tip_radius_factor=a(rack.root_radius),
        addendum_coefficient_reference_profile=a(rack.dedendum),
        number_of_teeth=a(cutter),
        addendum_modification_coefficient=None if cutter is None else a(section.cutter_profile_shift),
    )
    settings = w.add("cylindrical_gear_manufacturing_settings")
    shift = gear.profile_shift / math.cos(helix) * (-1.0 if internal else 1.0)
    flanks = {
        side: w.add(
            "cylindrical_gear_flank",
            addendum_modification_coefficient=a(shift),
            normal_pressure_angle=a(case.pressure_angle, "deg"),
            addendum_coefficient_basic_profile=a(rack.addendum),
        )
        for side in ("left", "right")
    }
    w.relate("flank", gear=id, **flanks)
    for flank in flanks.values():
        w.relate("manufacturing_step", workpiece=flank, tool=tool, manufacturing_settings=settings)
    _add_modifications(w, case, gear, flanks, model)
    return id, shaft


def _add_material(w: ModelWriter, material: Any, tell: Callable[[str], None]) -> str:
    """Add the material of a gear with its limits and its treatment; its id."""
    a, treated = rexs_attribute, written_treatment(material, tell)
    return w.add(
        "material",
        elastic_modulus=a(material.youngs_modulus, "N / mm^2"),
        density=a(material.density, "kg / dm^3"),
        poisson_ratio=a(material.poisson_ratio),
        endurance_limit_root=a(material.root_stress_limit, "N / mm^2"),
        endurance_limit_flank=a(material.contact_stress_limit, "N / mm^2"),
        heat_treated_material_type_iso_6336_2019=treated.get("heat_treated_material_type_iso_6336_2019"),
        surface_hardness_vickers=treated.get("surface_hardness_vickers"),
        surface_hardness_brinell=treated.get("surface_hardness_brinell"),
    )


def _add_modifications(w: ModelWriter, case: Case, gear: Any, flanks: Mapping[str, str], model: Model) -> None:
    """Add the modifications of both flanks; the datum face is the end z < 0, as where REXS says nothing."""
    # looked at from z < 0 the flank towards the sun is the right one, see `_modifications`
    sides = {"right": "sun side", "left": "ring side"} if gear.name == "planet" else {}
    components: dict[str, str] = {}
    for role, flank in flanks.items():
        parts, left_out = written_modifications(case, gear, sides.get(role, "both"))
        for kind, attributes in parts:
            key = f"{kind} {attributes}"
            if key not in components:
                components[key] = w.add(kind, "", **attributes)
            w.relate("reference", origin=flank, referenced=components[key])
        for kind in left_out:
            model.remark(f"{gear.name}.modifications", f"REXS has no {kind}: left out")


def _stiffness(case: Case, member: str, key: str) -> tuple[str, str] | None:
    """Stiffness of a bearing, none where it is the estimate to its four digits."""
    given = support_stiffness(case, member) if key == "support_stiffness" else getattr(getattr(case, member), key)
    value, estimate = given, estimates(case)[f"{member}.{key}"].value
    return None if f"{value or 0.0:.4g}" == f"{estimate:.4g}" else rexs_attribute(value, "N / m")


def _add_operation(w: ModelWriter, case: Case, shafts: dict[str, str], casing: str, unit: str) -> tuple[dict, ...]:
    """Add load, coupling of the fixed member, bearings of sun and carrier; load cases of several speeds or of a life.

    Speeds of operation beside load cases of the life have no duration.
    """
    operation, a = case.operation, rexs_attribute
    joints = {operation.fixed: [w.add("coupling", f"{operation.fixed} held")]}
    for member in ("sun", "carrier"):
        if stiffness := _stiffness(case, member, "support_stiffness"):
            bearing = w.add("concept_bearing", f"{member} bearing", radial_stiffness=stiffness)
            joints.setdefault(member, []).append(bearing)
    for member, joint in ((member, component) for member, ones in joints.items() for component in ones):
        w.relate("side", assembly=joint, outer_part=casing, inner_part=shafts[member])
    torque, shaft = a(operation.torque, "N m"), shafts[operation.input]
    load = w.add("external_load", defines_torque=("true", "none"), torque_around_u_axis=torque)
    w.relate("assembly", assembly=shaft, part=load)
    speeds = [{"rotational_speed": (repr(speed / SPEED.scale), "1 / min")} for speed in operation.speeds]
    turning = speeds[0] | {"defines_speed": ("true", "none")}
    w.components[shaft] = replace(w.components[shaft], attributes=turning)
    if not operation.load_case:
        return tuple({shaft: speed} for speed in speeds) if len(speeds) > 1 else ()
    by_hours = operation.load_case[0].hours is not None
    none = {"load_duration": ("0", "h")} if by_hours else {"load_duration_fraction": ("0", "%")}
    points = [{unit: none, shaft: speed, load: {"torque_around_u_axis": torque}} for speed in speeds]
    for load_case, share in zip(operation.load_case, running_shares(operation.load_case).tolist(), strict=True):
        duration = {name: a(*value) for name, value in load_duration(load_case, share).items()}
        speed = {"rotational_speed": (repr(load_case.speed / SPEED.scale), "1 / min")}
        points.append({unit: duration, shaft: speed, load: {"torque_around_u_axis": a(load_case.torque, "N m")}})
    return tuple(points)
