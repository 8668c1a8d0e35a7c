"""Mistakes of a case file in the words of its author.

`translate` turns the validation errors of pydantic into errors of femgear with the nearest valid key,
`combine` makes one of several, with the lines of the file. `in_terms_of_the_case` lets a refusal of the gears
name what the file gives. `added_material` and `notices` are remarks on what is accepted.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError

from femgear.case import text as case_text
from femgear.case.load_spectrum import spectrum_notices, without_line
from femgear.case.lubrication import oil_doubts
from femgear.case.planetary import Case
from femgear.case.quantities import ANGLE, LENGTH, wrong_length
from femgear.case.sections import RackSection, gear_material
from femgear.case.tooth_measures import MEASURES
from femgear.errors import CaseError, GeometryError, several
from femgear.findings import Finding, remark
from femgear.gears.phasing import coaxial_teeth

_DIMENSIONS = {
    "centre_distance": LENGTH,
    "bore_radius": LENGTH,
    "outer_radius": LENGTH,
    "tip_diameter": LENGTH,
    "root_diameter": LENGTH,
    "over_balls": LENGTH,
    "ball_diameter": LENGTH,
    "module": LENGTH,
    "pressure_angle": ANGLE,
}
"""Of entries whose values the refusals of gears give as SI numbers."""
_WANTED = dict.fromkeys(("tuple_type", "list_type"), "a list")
_WANTED |= {"bool_type": "true or false", "string_type": "a text"}
"""What pydantic needed, by the kind of its error."""
_MOST = 100


def translate(error: ValidationError, model: type[BaseModel], prefix: str = "") -> list[CaseError]:
    """Make a `CaseError` of each mistake that pydantic found.

    The field names of ``model`` are the valid keys, ``prefix`` is the key of the table that was validated.
    Of very many mistakes it is the first hundred.
    """
    problems = []
    details: Any = error.errors(include_url=False)
    # a list whose entries are refused has too few left
    short = [item["loc"] for item in details[:_MOST] if item["type"] == "too_short"]
    inside = {
        loc
        for loc in short
        if any(len(other["loc"]) > len(loc) and other["loc"][: len(loc)] == loc for other in details)
    }
    for item in details[:_MOST]:
        if item["type"] == "too_short" and item["loc"] in inside:
            continue
        key = case_text.dotted(item["loc"], prefix)
        nested = item.get("ctx", {}).get("error")
        if isinstance(nested, ValidationError):
            problems += translate(nested, model, key)
        elif isinstance(nested, CaseError):
            nested.key = key
            problems.append(nested)
        else:
            problems.append(_problem(item, key, model))
    return problems


def _problem(item: dict, key: str, model: type[BaseModel]) -> CaseError:
    """One error of pydantic's list."""
    kind, context, value = item["type"], item.get("ctx", {}), item.get("input")
    if kind == "missing":
        section = _section(model, item["loc"])
        remedy = f"add it: {_description(model, item['loc'])}".removesuffix(": ")
        if section is not None:
            needed = [name for name, field in section.model_fields.items() if field.is_required()]
            remedy = f"add the section with {', '.join(needed)}"
        return CaseError("missing", code="E-KEY-MISSING", key=key, remedy=remedy)
    if kind == "extra_forbidden":
        return _unknown_key(item["loc"], key, model)
    if kind == "literal_error":
        limit = context["expected"]
        near = difflib.get_close_matches(str(value).lower(), re.findall("'(.+?)'", limit), n=1)
        remedy = f"did you mean {near[0]!r}?" if near else None
        return CaseError("not one of the choices", code="E-CHOICE", key=key, value=value, limit=limit, remedy=remedy)
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        message = f"a table is needed, not {case_text.described(value)}"
        section = f"[[{key.partition('[')[0]}]]" if key.endswith("]") else f"[{key}]"
        return CaseError(message, code="E-TYPE", key=key, value=value, remedy=f"write the section {section}")
    if kind in _WANTED:
        words = _WANTED[kind]
        message = f"{words} is needed, not {case_text.described(value)}"
        remedy = "write it in quotation marks" if words == "a text" else f"write {words}, without quotation marks"
        if words == "a list":
            remedy = f"write [[{key}]]" if _section(model, item["loc"]) else "write it in brackets: [...]"
        return CaseError(message, code="E-TYPE", key=key, value=value, remedy=remedy)
    if kind in ("too_long", "too_short"):
        many = kind == "too_long"
        limit = f"at most {context['max_length']}" if many else f"{context['min_length']} or more"
        error = wrong_length(context["actual_length"], limit, many=many)
        error.key = key
        return error
    return CaseError(f"not what is needed here: {item['msg'].lower()}", key=key, value=value)


def no_such(what: str, key: str, name: str, names: Sequence[str], otherwise: str, *, limit: str) -> CaseError:
    """Make the refusal of a name that nothing has, E-CHOICE, with the nearest of the names that are there.

    Parameters
    ----------
    what : str
        Kind of what is named, as "body".
    key, name : str
        Entry that names it, and the name there.
    names : sequence of str
        Names that are there; capitals do not count in the likeness.
    otherwise : str
        Remedy where no name is near.
    limit : str
        What is allowed.
    """
    spelt = {known_name.lower(): known_name for known_name in names}
    near = difflib.get_close_matches(name.lower(), spelt, n=1, cutoff=0.6)
    remedy = f"did you mean {spelt[near[0]]}?" if near else otherwise
    return CaseError(f"there is no such {what}", code="E-CHOICE", key=key, value=name, limit=limit, remedy=remedy)


def _unknown_key(location: tuple, key: str, model: type[BaseModel]) -> CaseError:
    """Refusal of a key that nobody reads, with where it may belong."""
    parent = _section(model, location[:-1])
    valid = _keys(parent) if parent else []
    last = str(location[-1])
    near = difflib.get_close_matches(last, valid, n=1, cutoff=0.6)
    homes = [name for name in model.model_fields if last in _keys(_section(model, (name,)))]
    if near:
        remedy = f"did you mean {near[0]}?"
    elif homes:
        remedy = f"{last} belongs in [{'] or ['.join(homes)}]"
    else:
        remedy = None
    return CaseError("unknown key", code="E-KEY-UNKNOWN", key=key, limit=", ".join(valid) or None, remedy=remedy)


def _description(model: type[BaseModel], location: tuple) -> str:
    """What the schema says about the entry."""
    section = _section(model, location[:-1]) or model
    schema = _properties(section).get(str(location[-1]), {})
    choices = " or ".join(str(choice) for choice in schema.get("enum", ()))
    kind = str(schema.get("type", ""))
    return str(schema.get("description") or choices or {"string": "a text", "array": "a list"}.get(kind, kind))


@cache
def _properties(section: type[BaseModel]) -> dict[str, dict]:
    return section.model_json_schema()["properties"]


def _keys(section: type[BaseModel] | None) -> list[str]:
    """Names of its entries as the file gives them."""
    return [field.alias or name for name, field in section.model_fields.items()] if section else []


def _section(model: type[BaseModel], location: tuple) -> type[BaseModel] | None:
    """Model of the table at ``location``, None where that is no table."""
    current: type[BaseModel] | None = model
    for part in location:
        if isinstance(part, int):
            continue
        field = current.model_fields.get(str(part)) if current else None
        candidates = (field.annotation, *getattr(field.annotation, "__args__", ())) if field else ()
        current = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
    return current


def combine(problems: list[CaseError], text: str, name: str, count: int = 0) -> CaseError:
    """Make one error that lists all (at least one); its ``problems`` holds them one by one.

    ``count`` is their number where `translate` left some out.
    ``text`` is the file, for line numbers (empty where the text is not the user's), ``name`` its name.
    """
    for problem in problems:
        line = case_text.line_of(text, problem.key) if problem.key and name else None
        if problem.file in (None, name):  # or that of another file
            problem.file = f"{name}:{line}" if line else name
    combined = several(problems, count if count > _MOST else 0)
    if len(problems) > 1:
        combined.file = name
    return combined


def in_terms_of_the_case(error: GeometryError, case: Case) -> None:
    """Let a refusal of the gears name the entries that the case gives, with their values and keys that exist.

    The fields of the error are changed, ``file`` (with the line) among them; of its values lengths [m] are
    shown in mm, angles [rad] in degrees.
    """
    if error.code == "E-BACKLASH":
        gear = (error.key or "").partition(".")[0]
        error.remedy = (
            f"leave {gear}.profile_shift out so that it is found, give set.backlash, or another set.centre_distance"
        )
    if error.code == "E-ASSEMBLY":
        _assembly(error, case)
    if error.code == "E-COAXIAL":
        error.remedies = (*error.remedies, *_coaxial_teeth_of(case))
    if error.key == "rack.root_radius":
        if getattr(getattr(case, error.gear or "", None), "rack", None) is not None:
            error.key = f"{error.gear}.rack.root_radius"
        error.value = rack_at(case, error.key).root_radius
    _shift_left_out(error, case)
    _allowance(error, case)
    _in_transverse_section(error, case)
    dimension = _DIMENSIONS.get((error.key or "").rpartition(".")[2])
    if dimension is not None and isinstance(error.value, float):
        error.value = dimension.show(error.value)
    error.file = case.location(error.key or "")


def rack_at(case: Case, key: str) -> RackSection:
    """Find the rack section of a key, that of all gears or of one."""
    gear = key.partition(".")[0]
    return case.rack if gear == "rack" else getattr(case, gear).rack


def _assembly(error: GeometryError, case: Case) -> None:
    """Planets that cannot be assembled: the angles given, or the number of equally spaced planets."""
    angles = case.set.planet_angles
    if angles is None:
        error.key, error.value = "set.planets", case.set.planets
        return
    error.value = ", ".join(f"{math.degrees(angle):.6g}" for angle in angles[:24]) + " deg"


def _coaxial_teeth_of(case: Case) -> Iterator[str]:
    """Offer the teeth next to those of a case that close without profile shifts."""
    teeth = case.sun.teeth, case.planet.teeth, case.ring.teeth
    near = coaxial_teeth(*teeth, case.set.planets)
    if near:
        shifted = any(getattr(case, gear).profile_shift for gear in case.gear_names)
        offered = " or ".join("/".join(map(str, close)) for close in near[:3])
        yield f"{'without profile shifts ' if shifted else ''}take {offered} teeth of sun, planet and ring"


_OF_MEASURES = {
    "span": "check span and span_teeth, the teeth that it is over",
    "over_balls": "check over_balls and ball_diameter",
    "tooth_thickness": "check tooth_thickness, at the reference circle",
}
"""What to do about a measure from which no gear follows."""


def _shift_left_out(error: GeometryError, case: Case) -> None:
    """A shift that was found is no entry to change: name the one that it follows from."""
    others = {"sun": "ring", "ring": "sun", "gear_1": "gear_2", "gear_2": "gear_1"}
    sections = {name: getattr(case, name) for name in case.gear_names if name in others}
    gear, _, entry = (error.key or "").partition(".")
    if gear in case.gear_names and entry == "profile_shift":
        section = getattr(case, gear)
        measures = section.given(*MEASURES)
        if measures and (section.profile_shift is None or entry not in section.model_fields_set):
            error.message += f" (the {gear}'s {measures[0]} makes its profile shift {error.value})"
            given = getattr(section, measures[0])
            shown = ", ".join(map(LENGTH.show, given if isinstance(given, tuple) else (given,)))
            error.key, error.value = f"{gear}.{measures[0]}", shown
            error.remedies = (_OF_MEASURES[measures[0]],)
            return
    if gear not in sections or entry != "profile_shift" or sections[gear].profile_shift is not None:
        return
    if case.set.centre_distance is not None:
        error.key, given = "set.centre_distance", f"{1e3 * case.set.centre_distance:.6g} mm"
        remedy = "change the centre distance or the tooth numbers"
    else:
        other = others[gear]
        error.key, given = f"{other}.profile_shift", sections[other].profile_shift
        remedy = f"change the {other}'s profile shift or the tooth numbers"
    shift = f"{error.value:.5g}" if isinstance(error.value, float) else error.value
    error.message += f" (the {gear}'s profile shift of {shift} is what closes the set)"
    if error.code == "E-SHIFT":
        error.limit = f"such that the {gear}'s shift is {error.limit}"
    error.value, error.remedy = given, remedy


def _allowance(error: GeometryError, case: Case) -> None:
    """A thickness allowance is no entry: name the allowances of the drawing, or the backlash that it is half of."""
    gear, _, entry = (error.key or "").partition(".")
    if entry != "thickness_allowance" or gear not in case.gear_names:
        return
    given, most = getattr(case, gear).tooth_thickness_allowance, LENGTH.show(case.module)
    if given is None:
        error.key, error.value = "set.backlash", LENGTH.show(case.set.backlash)
        error.limit, error.remedy = f"below twice the module, {most}", "check its unit"
        return
    error.key = f"{gear}.tooth_thickness_allowance"
    error.value = given if isinstance(given, str) else ", ".join(f"{1e6 * value:.6g} um" for value in given)
    error.limit, error.remedy = f"less than a module, {most}, in their middle", "check their unit"


def _in_transverse_section(error: GeometryError, case: Case) -> None:
    """Gears of a helical case are refused in their transverse section, the file gives the normal one."""
    if case.helix_angle is None:
        return
    error.message += " (in the transverse section of the helical gears"
    factor = math.cos(case.helix_angle)
    if factor < 0.999 and ((error.key or "").endswith("profile_shift") or "rack." in (error.key or "")):
        error.message += f", whose coefficients are {factor:.6g} times those of the file"
    error.message += ")"


def added_material(case: Any) -> Iterator[Finding]:
    """Find reliefs and crownings with a negative amount [m]: most are slips of the sign."""
    for gear in case.gear_names:
        for i, modification in enumerate(getattr(case, gear).modifications):
            if modification.kind in ("tip relief", "root relief", "profile crowning") and modification.amount < 0.0:
                yield Finding(
                    "W-RELIEF-SIGN",
                    f"{gear}.modifications[{i}].amount",
                    f"a {modification.kind} of {modification.amount * 1e6:.6g} um adds material",
                    remedy="a positive amount takes it off (usual: 0 um or above)",
                )


def idle_materials_and_oil(case: Any) -> Iterator[Finding]:
    """List grades, hardnesses and estimates without a treatment, and an oil whose losses nobody asks for (W-UNUSED)."""
    sections = {f"{gear}.material": getattr(case, gear).material for gear in without_line(case)}
    if len(sections) == len(case.gear_names):
        sections = {"material": case.material} | sections
    for key, section in sections.items():
        for name in ("grade", "hardness", "estimated"):
            if section is not None and name in section.model_fields_set:
                text = "has no effect: limits follow from it where the material has a treatment"
                remedy = f'give {key}.treatment = "case hardened steel" or the like'
                yield Finding("W-UNUSED", f"{key}.{name}", text, remedy=remedy)
    yield from oil_notices(case)


def estimated_materials(case: Any) -> Iterator[Finding]:
    """Tell gears whose limits rest on an estimated treatment (W-MATERIAL)."""
    keys = set[str]()
    for gear in case.gear_names:
        material, section = gear_material(case, gear), getattr(case, gear).material
        given = section is not None and section.treatment is not None
        key = f"{gear}.material.treatment" if given else "material.treatment"
        if material.estimated and material.treatment is not None and key not in keys:
            keys.add(key)
            text = f"safeties and lives rest on an estimate: {material.treatment}, hardness {material.hardness:g}"
            remedy = "give treatment, grade and hardness of the drawing, and leave estimated out"
            yield Finding("W-MATERIAL", key, text, remedy=remedy)


def oil_notices(case: Any) -> Iterator[Finding]:
    """Tell an oil without losses and coefficients beside a formula (W-UNUSED), and an oil extrapolated (W-OIL)."""
    losses = case.losses
    for name, kind in (("coefficient", "constant"), ("table", "table")):
        if losses is not None and getattr(losses, name) is not None and losses.friction != kind:
            text = f'has no effect: losses.friction is "{losses.friction}"'
            yield Finding("W-UNUSED", f"losses.{name}", text, remedy=f'write friction = "{kind}", or leave it out')
    if case.lubricant is not None and case.losses is None:
        remedy = 'give [losses] with friction = "schlenk" or the like'
        yield Finding("W-UNUSED", "lubricant", "has no effect: losses are not asked for", remedy=remedy)
    else:
        yield from oil_doubts(case)


def notices(data: dict, case: Case) -> Iterator[Finding]:
    """Remark on what a case file, its tables checked, gives in a way that deserves to be said."""
    if (teeth := data["ring"]["teeth"]) < 0:
        yield remark(
            f"ring.teeth = {teeth} is read as an internal gear with {-teeth} teeth; ring.profile_shift keeps "
            "femgear's sign (positive moves the flank outwards, the opposite of ISO 21771)"
        )
    yield from spectrum_notices(case)
    yield from idle_materials_and_oil(case)
    yield from estimated_materials(case)
    if not case.rigid and "bearing_clearance" in data["planet"] and case.static.members == "fixed":
        text = 'has no effect while static.members is "fixed"'
        remedy = 'write static.members = "elastic"'
        yield Finding("W-UNUSED", "planet.bearing_clearance", text, remedy=remedy)
