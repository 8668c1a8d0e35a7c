"""Case files that femgear writes: new ones from a few numbers, and those that are read from other files.

What is not known is estimated from the gears, and every line that holds an estimate or assumption says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from textwrap import wrap
from typing import Annotated, Any, get_args

from femgear.case import text as case_text
from femgear.case.estimates import (
    Estimate,
    cylinder,
    estimates,
    usual_rim,
    usual_torque,
)
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import (
    ANGLE,
    FREE,
    INERTIA,
    LENGTH,
    MASS,
    Quantity,
)
from femgear.case.sections import LARGEST_HELIX, FaceWidth, Module
from femgear.errors import CaseError, GeometryError
from femgear.gears.checks import planet_room
from femgear.gears.phasing import coaxial_teeth, neighbouring_teeth
from femgear.gears.planetary import PlanetarySet, equal_planet_angles, feasible_angles, virtual_set
from femgear.gears.profile import BasicRack, overlap_ratio, transverse_rack, transverse_tool
from femgear.gears.shifts import SharedShifts, share_shifts
from femgear.gears.tips import SEEN, typed_diameter
from femgear.trains.gearbox_draft import pair_in_gearbox
from femgear.trains.planets_draft import PLANET_KINDS, planets_case
from femgear.trains.reading import parse_case
from femgear.trains.registry import train_of


def draft_text(tables: Mapping[str, Any], remarks: Mapping[str, str], *, word: str, head: Iterable[str] = ()) -> str:
    """Write the text of a case from tables, with estimates of what they leave out.

    Parameters
    ----------
    tables : mapping
        As `femgear.read_case` takes them.
    remarks : mapping of str to str
        By dotted key, written behind the entries.
    word : str
        Before each estimate: "estimated" or "assumed".
    head : iterable of str
        Paragraphs before the first entry.

    Raises
    ------
    CaseError, GeometryError
        Tables that make no case.
    """
    tables, notes = deepcopy(dict(tables)), dict(remarks)
    case = parse_case(case_text.write(tables))
    for key, estimate in (estimates(case) if hasattr(case, "gear_names") else {}).items():
        section, last = key.rpartition(".")[::2]
        model = _section(case, section)
        # rigid rings have no foundation
        if model is None or last not in type(model).model_fields or (section == "ring" and case.rigid):
            continue
        table = tables
        for part in section.split("."):
            table = table.setdefault(part, {})
        if last not in table:
            table[last] = str(estimate)
            notes[key] = f"{word}: {estimate.how}{f'; {notes[key]}' if key in notes else ''}"
    ordered = {name: tables[name] for name in type(case).model_fields if name in tables}
    lines = [f"# {line}".rstrip() for remark in head for line in wrap(remark, 105) or [""]]
    return "\n".join([*lines, case_text.write(ordered, notes)])


def _section(case: Any, key: str) -> Any:
    """Section of a dotted key, None where the case has none."""
    for part in key.split("."):
        case = getattr(case, part, None)
    return case


KINDS = {
    "planetary": (27, 40, 108),
    "pair": (24, 36),
    "planar": (27, 40, 108),
    "helical": (30, 20, 70),
    "drivetrain": (23, 71),
    "gearbox": (24, 36),
    **PLANET_KINDS,
}
"""Kinds of cases that `new_case` writes, with the teeth of their gears."""
ADDENDA = (1.0, 1.1, 1.2, 0.9, 0.8)
"""Addenda [modules] that are tried until teeth leave nothing to warn of, where none is given."""
BACKLASH = 0.04
"""Backlash of new cases on the reference circles [normal modules]."""
Angle = Annotated[float, Quantity(ANGLE, -LARGEST_HELIX, LARGEST_HELIX)]
CentreDistance = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]
_HEAD = "Written by femgear new {}. What is estimated says so: give what is known instead."
_STANDS = " The casing stands still: [casing] and its feet let it move (docs/gearbox.md)."
_LEAVE = " Masses and inertias stay when teeth change: delete their lines to have them estimated anew."
_STRENGTH = (
    'For safeties and lives give [material] a treatment and a hardness, such as "case hardened steel" and 700 (HV).'
)
_USUAL = {
    "W-BACKLASH": "the same backlash in all meshes",
    "W-CLEARANCE": "a tip clearance of 0.1 modules",
    "W-CONTACT-RATIO": "a transverse contact ratio of 1.2",
    "W-FILLET": "tips that are free of all fillets",
    "W-TIP-THIN": "tips of usual thickness",
    "W-UNDERCUT": "flanks without undercut",
}
"""What teeth have that are not warned of, by the code of the warning."""
_STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}


@dataclass(frozen=True)
class ToothForm:
    """What a new case may be given of its teeth.

    Parameters
    ----------
    shifts : tuple of float
        Of sun and planet, perhaps of the ring (positive outwards), or of both gears.
    centre_distance : str, optional
        With its unit, as ``"91.5 mm"``; by default it follows from teeth and shifts.
    helix : str, optional
        Helix angle of planetary sets, pairs, gearboxes and helical cases, of these by default 20 deg.
    addendum : float, optional
        Of the basic rack [modules], by default the first of `ADDENDA` that leaves nothing to warn of; the
        dedendum is a quarter more.
    """

    shifts: tuple[float, ...] = ()
    centre_distance: str | None = None
    helix: str | None = None
    addendum: float | None = None


@dataclass(frozen=True)
class NamedSteel:
    """Steel of all gears of a new case, from whose limits its safeties follow.

    Parameters
    ----------
    treatment : str
        Of `femgear.gears.gear_steels.Treatment`.
    hardness : float
        Of its surface, HV or HBW as the treatment has it.
    """

    treatment: str
    hardness: float


def new_case(
    kind: str,
    *,
    teeth: tuple[int, ...] = (),
    module: str | None = None,
    torque: str | None = None,
    speed: str | None = None,
    planets: int | None = None,
    face_width: str | None = None,
    form: ToothForm | None = None,
    steel: NamedSteel | None = None,
) -> str:
    """Write a commented case from a few numbers.

    Shifts that are not given are those of `femgear.gears.shifts.share_shifts`; tips run free of their mates.

    Parameters
    ----------
    kind : str
        Of `KINDS`.
    teeth : tuple of int
        Of sun, planet and ring, which may be negative as in ISO 21771, or of both gears.
    module : str, optional
        By default 2 mm.
    torque : str, optional
        On sun or pinion; by default for a K factor of 1 N/mm^2, see `femgear.case.estimates.usual_torque`.
    speed : str, optional
        By default 1000 rpm.
    planets : int, optional
        By default the first of 3, 4 and 5 that equal spacing allows and that have a module of room between
        their tips; else three as near to it as they assemble, or fewer.
    face_width : str, optional
        By default twelve modules.
    form : ToothForm, optional
        Shifts, centre distance, helix and addendum, where they are given.
    steel : NamedSteel, optional
        Of all gears; without it a case says what its safeties need.

    Raises
    ------
    CaseError, GeometryError
        Another kind (E-CHOICE), other numbers of teeth or shifts (E-COUNT), options that it has not
        (E-ARGUMENTS), planets that equal spacing does not allow (E-ASSEMBLY), teeth that no shifts close
        (E-COAXIAL), and what makes no case.
    """
    given = {"teeth": teeth, "module": module, "planets": planets, "face-width": face_width}
    given |= {"torque": torque, "speed": speed}
    teeth, form = _teeth(kind, teeth), form or ToothForm()
    _check_options(kind, teeth, planets, form)
    of_set, notes = len(teeth) == 3, _usual_notes(given)
    module, speed = "2 mm" if module is None else module, "1000 rpm" if speed is None else speed
    if kind in PLANET_KINDS:
        return _planets_text(kind, teeth, module, given | {"speed": speed}, steel)
    size, beta = _read(Module, module, "--module"), math.radians(20.0) if kind == "helical" else 0.0
    beta = beta if form.helix is None else _read(Angle, form.helix, "--helix")
    width = 12.0 * size if face_width is None else _read(FaceWidth, face_width, "--face-width")
    gears, of_all, lacks = _gears(teeth, size, beta, form, notes, planets)
    of_all["set"] |= {"backlash": _millimetres(BACKLASH * size), "face_width": LENGTH.show(width)}
    tables: dict[str, Any] = {"format": 1, "title": f"{kind.capitalize()} {'/'.join(map(str, teeth))}"}
    tables |= {**of_all, "material": _STEEL, **_sections(gears, of_all, size, beta, notes)}
    tables["operation"] = {"torque": "1 N m" if torque is None else torque, "speeds": [speed]}
    tables |= _of_kind(kind, beta, _slices(width, size, beta), notes)
    of_all["set"] |= {"helix_angle": ANGLE.show(beta)} if beta and kind != "helical" else {}
    shared, count = {"module": module, "pressure_angle": "20 deg"}, 1
    if of_set:
        tables["sun"] = {"teeth": teeth[0], **shared, **tables["sun"]}
        tables["operation"] = {"input": "sun", "fixed": "ring", **tables["operation"]}
        made = _with_tips(tables | {"set": {"planets": planets or 1, **tables["set"]}}, notes)
        count, angles = _planets(made) if planets is None else (planets, {})
        tables["set"] = {"planets": count, **angles, **tables["set"]}
    else:
        tables |= {"model": "pair", "set": {**shared, **tables["set"]}}
        _with_tips(tables, notes)
    load = f"{usual_torque(teeth[0], teeth[1], size, width, count):.3g} N m" if torque is None else torque
    tables["operation"]["torque"] = load
    if kind == "helical" and not _has_normal_section(tables, beta):
        tables["helical"]["section"] = "transverse"
    taken = {"teeth": " ".join(map(str, teeth)), "module": f'"{module}"', "planets": count}
    taken |= {"face-width": f'"{LENGTH.show(width)}"', "torque": f'"{load}"', "speed": f'"{speed}"'}
    left = [f"--{key} {value}" for key, value in taken.items() if not given[key] and (of_set or key != "planets")]
    shape = {"drivetrain": _in_time, "gearbox": pair_in_gearbox}.get(kind)
    tables = tables if shape is None else shape(tables, notes)
    head = _head(kind, left, lacks, form, rated=steel is not None)
    return draft_text(_of_steel(tables, steel), notes, word="estimated", head=head)


def _of_steel(tables: Any, steel: NamedSteel | None) -> Any:
    """Give tables whose materials, of a gearbox those within its pairs, are of a steel; as they are without one."""
    if steel is None or not isinstance(tables, (dict, list)):
        return tables
    if isinstance(tables, list):
        return [_of_steel(table, steel) for table in tables]
    changed = {name: _of_steel(table, steel) for name, table in tables.items()}
    if "material" in changed:
        named = {name: value for name, value in changed["material"].items() if name != "estimated"}
        changed["material"] = named | {"treatment": steel.treatment, "hardness": steel.hardness}
    return changed


def _planets_text(
    kind: str, teeth: tuple[int, ...], module: str, given: Mapping[str, Any], steel: NamedSteel | None
) -> str:
    """Write a gearbox with planets around a carrier."""
    size, notes = _read(Module, module, "--module"), dict[str, str]()
    width = 12.0 * size if given["face-width"] is None else _read(FaceWidth, given["face-width"], "--face-width")
    shown = {
        "module": size,
        "width": width,
        "planets": given["planets"],
        "torque": given["torque"],
        "speed": given["speed"],
    }
    tables, planets, faults = planets_case(kind, teeth, **shown, notes=notes)
    taken = {"teeth": " ".join(map(str, teeth)), "module": f'"{module}"', "planets": planets}
    load = tables["operation"]["load_case"][0]["torque"]["motor"]
    taken |= {"face-width": f'"{LENGTH.show(width)}"', "torque": f'"{load}"', "speed": f'"{given["speed"]}"'}
    if given["torque"] is None:
        notes["operation.load_case[0].torque"] = "estimated: K factor of 1 N/mm^2"
    head = [_HEAD.format(kind) + _STANDS, "Assumed: " + " ".join(f"--{key} {value}" for key, value in taken.items())]
    head.append("Every planet is a shaft on the carrier, every mesh a pair; gears have no profile shift.")
    return draft_text(_of_steel(tables, steel), notes, word="estimated", head=[*head, *faults])


def _of_kind(kind: str, beta: float, slices: int, notes: dict[str, str]) -> dict[str, Any]:
    """Sections that a kind of cases has beside those of all."""
    if kind == "helical":
        return {"helical": {"helix_angle": ANGLE.show(beta)}}
    if kind == "planar":
        notes["dynamics.response_harmonics"] = "estimated: twice the default, so that the last ones are small"
        return {"dynamics": {"response_harmonics": 36}, "planar": {"response": {}}}
    return {"static": {"slices": slices}} if beta else {}


def _has_normal_section(tables: dict[str, object], beta: float) -> bool:
    """Whether the virtual gears of the normal section of a helical set can be made."""
    gears: Any = planetary_set(parse_case(case_text.write(tables)))
    try:
        virtual_set(gears, beta)
    except GeometryError:
        return False
    return True


def _head(kind: str, left: list[str], lacks: tuple[str, ...], form: ToothForm, *, rated: bool) -> list[str]:
    """Paragraphs before the first entry: what is assumed or missing, and what teeth lack whatever their shifts."""
    head = [_HEAD.format(kind) + {"drivetrain": _STANDS, "gearbox": _STANDS}.get(kind, _LEAVE)]
    head += [] if rated else [_STRENGTH]
    head += [f"Assumed: {' '.join(left)}"] if left else []
    if lacks:
        place = "" if form.centre_distance is None else " at this centre distance"
        addenda = f" with addenda of {min(ADDENDA):g} to {max(ADDENDA):g} modules"
        racks = addenda if form.addendum is None else ""
        missing = " and ".join(_USUAL.get(code, code) for code in lacks)
        head.append(f"No profile shifts{racks}{place} were found that give these teeth {missing}: femgear check warns")
    return head


def _usual_notes(given: Mapping[str, object]) -> dict[str, str]:
    """Remarks on entries that every new case has, and on those whose option is not given."""
    notes = {f"material.{key}": "estimated: steel" for key in _STEEL}
    notes |= {f"{key}.pressure_angle": "estimated: ISO 53" for key in ("sun", "set")}
    notes |= {"set.planets": "estimated: as equal spacing allows"} if given["planets"] is None else {}
    notes |= {} if given["face-width"] else {"set.face_width": "estimated: 12 modules"}
    notes |= {} if given["torque"] else {"operation.torque": "estimated: K factor of 1 N/mm^2"}
    return notes | {
        "set.backlash": f"estimated: {BACKLASH:g} modules",
        "set.planet_angles": "estimated: nearest to equal spacing, which these teeth do not allow",
        "static.slices": "estimated: helical teeth need slices over the face width",
        "helical.section": "estimated: the normal section has no gears that close; the teeth are too stiff",
    }


def _check_options(kind: str, teeth: tuple[int, ...], planets: int | None, form: ToothForm) -> None:
    """Refuse planets and a helix where there are none, and planets that equal spacing does not allow."""
    of_set = len(teeth) == 3
    if kind in PLANET_KINDS:
        for option, value in vars(form).items():
            if value not in ((), None):
                raise _no_such(kind, f"--{option.replace('_', '-')}", "spur gears without profile shift")
        return
    if planets is not None and not of_set:
        raise _no_such(kind, "--planets", "no planets")
    if planets and planets > 0 and sum(teeth[::2]) % planets:
        raise _unequal(teeth, planets)
    if form.helix is not None and kind == "planar":
        raise _no_such(kind, "--helix", "spur teeth, or a helix_angle of its own tables")


def _teeth(kind: str, teeth: tuple[int, ...]) -> tuple[int, ...]:
    """Settle the teeth of a kind of cases."""
    if kind not in KINDS:
        limit = ", ".join(KINDS)
        raise CaseError("there is no such kind of case", code="E-CHOICE", key="kind", value=kind, limit=limit)
    usual, teeth = KINDS[kind], teeth or KINDS[kind]
    if len(usual) == 3 == len(teeth):
        teeth = (*teeth[:2], abs(teeth[2]))
    if kind in PLANET_KINDS and len(usual) == len(teeth):
        rings = (2, 4) if kind == "wolfrom" else (len(teeth) - 1,)
        teeth = tuple(abs(z) if number in rings else z for number, z in enumerate(teeth))
    if len(usual) == 2 == len(teeth) and min(teeth) < 0:
        external = [abs(z) for z in teeth]
        raise CaseError(
            f"a {kind} case is drafted with external gears",
            code="E-COUNT",
            key="--teeth",
            value=teeth,
            limit="positive numbers",
            remedy=f"write --teeth {external[0]} {external[1]}, then make gear 2 internal in the case: "
            "gear_2.outer_radius in place of its bore_radius"
            if kind == "pair"
            else "leave the sign out",
        )
    if len(teeth) != len(usual) or min(teeth) < 5 or max(teeth) > 5000:
        raise CaseError(
            f"a {kind} case needs {len(usual)} numbers of teeth",
            code="E-COUNT",
            key="--teeth",
            value=teeth,
            limit=f"5 to 5000 each, as in --teeth {' '.join(map(str, usual))}",
        )
    return teeth


def _no_such(kind: str, option: str, words: str) -> CaseError:
    message = f"a {kind} case has {words}"
    return CaseError(message, code="E-ARGUMENTS", key=option, remedy="leave it out")


def _gears(
    teeth: tuple[int, ...], size: float, beta: float, form: ToothForm, notes: dict[str, str], planets: int | None
) -> tuple[list[dict[str, Any]], dict[str, Any], tuple[str, ...]]:
    """Teeth, shift (that for the rim too) and rack of every gear, tables of all of them, what they lack."""
    names = ("sun", "planet", "ring") if len(teeth) == 3 else ("gear_1", "gear_2")
    gears: list[dict[str, Any]] = [{"name": n, "teeth": z} for n, z in zip(names, teeth, strict=True)]
    of_all: dict[str, Any] = {"set": {}}
    if form.addendum is not None:
        check_rack({"addendum": form.addendum})
    distance = None
    if form.centre_distance is not None:
        distance = _read(CentreDistance, form.centre_distance, "--centre-distance")
        of_all["set"]["centre_distance"] = form.centre_distance
    if form.shifts:
        if len(form.shifts) not in (len(teeth), 2):
            raise CaseError(
                f"{len(form.shifts)} profile shifts of {len(teeth)} gears",
                code="E-COUNT",
                key="--shifts",
                limit="those of sun and planet, or of all three gears" if len(teeth) == 3 else "two",
            )
        for gear, shift in zip(gears, form.shifts, strict=False):
            gear["profile_shift"] = shift
        return gears, of_all | _rack_table(form.addendum, notes), ()
    module, alpha = transverse_tool(size, math.radians(20.0), beta)
    step = 10.0 ** (math.floor(math.log10(1e3 * size)) - 5) / module
    try:
        addendum, shared = _shared_shifts(
            teeth, alpha, beta, form, step=step, distance=None if distance is None else distance / module
        )
    except GeometryError as error:
        if distance is None and len(teeth) == 3 and abs(teeth[2] - teeth[0] - 2 * teeth[1]) > 1:
            raise _not_coaxial(teeth, planets) from error
        raise
    if form.addendum is not None or addendum != ADDENDA[0]:
        of_all |= _rack_table(addendum, notes)
    if form.addendum is None:
        notes["rack.addendum"] = f"estimated: {ADDENDA[0]:g} leaves undercut or too little contact"
    shifts = [round(shift / math.cos(beta), 4) + 0.0 for shift in shared.shifts]
    for gear, shift in zip(gears, shifts, strict=True):
        gear["rim_shift"] = shift
    rounding = shared.gears.gears[-1].rack.root_radius / math.cos(beta)
    if rounding < 0.25 - 1e-9:
        gears[-1]["rack"] = {"addendum": addendum, "dedendum": _dedendum(addendum)}
        gears[-1]["rack"]["root_radius"] = round(rounding, 4)
        notes[f"{names[-1]}.rack.root_radius"] = "estimated: what its pinion cutter has room for"
    if not any(shifts) and distance is None:
        for gear in gears:
            gear["profile_shift"] = 0.0
        return gears, of_all, shared.lacks
    # the other shifts are found, so that the set closes to the last digit
    first = 1 if len(teeth) == 3 else 0
    gears[first]["profile_shift"] = shifts[first]
    others = ", ".join(f"{n} {x:g}" for n, x in zip(names, shifts, strict=True) if n != names[first])
    notes[f"{names[first]}.profile_shift"] = (
        f"estimated: specific sliding of {names[0]} and {names[1]} as equal as undercut, tips and contact "
        f"ratios allow; found with it: {others}"
    )
    if distance is None:
        of_all["set"]["centre_distance"] = _millimetres(shared.centre_distance * module)
        notes["set.centre_distance"] = "estimated: with these shifts the gears close"
    return gears, of_all, shared.lacks


def _shared_shifts(
    teeth: tuple[int, ...], alpha: float, beta: float, form: ToothForm, *, step: float, distance: float | None
) -> tuple[float, SharedShifts]:
    """Addendum and shifts of which the gears are warned least; GeometryError where none closes."""
    best, addendum, fault = None, ADDENDA[0], None
    for tried in ADDENDA if form.addendum is None else (form.addendum,):
        rack = BasicRack(tried, _dedendum(tried), 0.25)
        try:
            shared = share_shifts(
                teeth,
                alpha,
                transverse_rack(rack, beta),
                backlash=BACKLASH * math.cos(beta),
                step=step,
                centre_distance=distance,
            )
        except GeometryError as error:
            fault = fault or error
            continue
        if best is None or len(shared.lacks) < len(best.lacks):
            best, addendum = shared, tried
        if not best.lacks:
            break
    if best is None:
        assert fault is not None
        raise fault
    return addendum, best


def _rack_table(addendum: float | None, notes: dict[str, str]) -> dict[str, Any]:
    """Table of the basic rack with an addendum; none of the usual one."""
    if addendum is None:
        return {}
    notes["rack.root_radius"] = "estimated: a quarter of a module"
    notes["rack.dedendum"] = "estimated: a quarter of a module below the mate's tips"
    return {"rack": {"addendum": addendum, "dedendum": _dedendum(addendum), "root_radius": 0.25}}


def _dedendum(addendum: float) -> float:
    """Dedendum of a basic rack [modules]: a quarter of a module below the mate's tips."""
    return round(addendum + 0.25, 12)


def check_rack(rack: Mapping[str, float]) -> None:
    """Refuse an addendum that no rack has (E-RANGE), under the name of its option."""
    if not 0.5 <= rack["addendum"] <= 1.5:
        raise CaseError(
            "no usual addendum",
            code="E-RANGE",
            key="--addendum",
            value=rack["addendum"],
            limit="0.5 to 1.5 modules",
        )


_MODULES = {3.0: "three", 4.0: "four"}


def _sections(
    gears: list[dict[str, Any]], of_all: dict[str, Any], size: float, beta: float, notes: dict[str, str]
) -> dict[str, dict[str, Any]]:
    """Sections of all gears, with rims and tips that run free."""
    sections = {}
    for gear in gears:
        section = dict(gear)
        name, internal = section.pop("name"), gear["name"] == "ring"
        rack = of_all.get("rack", {})
        dedendum, addendum = rack.get("dedendum", 1.25), rack.get("addendum", 1.0)
        shift = section.pop("rim_shift", section.get("profile_shift", 0.0))
        radius, root = usual_rim(gear["teeth"], size, dedendum, shift, internal=internal, helix=beta, addendum=addendum)
        key = "outer_radius" if internal else "bore_radius"
        rim = round(abs(radius - root) / size, 9)
        notes[f"{name}.{key}"] = f"estimated: a rim of {_MODULES.get(rim, f'{rim:.4g}')} modules"
        sections[name] = {**section, key: LENGTH.show(radius), "tip_diameter": FREE}
    return sections


def _with_tips(tables: dict[str, Any], notes: dict[str, str]) -> Any:
    """Write the diameters of free tips into tables, where they are not those of the rack; gives the gears."""
    case = parse_case(case_text.write(tables))
    gears: Any = planetary_set(case)
    for gear in gears.gears:
        del tables[gear.name]["tip_diameter"]
        if gear.tip_shortening > SEEN:
            diameter = typed_diameter(gear, gear.tip_radius)
            tables[gear.name]["tip_diameter"] = _millimetres(diameter)
            less = gear.tip_shortening / case.module
            notes[f"{gear.name}.tip_diameter"] = (
                f"estimated: {less:.4f} modules shorter than of the rack, for clearance and free fillets"
            )
    return gears


def _millimetres(length: float) -> str:
    """Length [m] as text in mm, to 0.1 um."""
    return f"{round(1e3 * length, 4):.10g} mm"


def _slices(width: float, size: float, beta: float) -> int:
    """Slices over the face width that helical teeth need."""
    most = int(4.0 * width * math.cos(beta) / size)
    return max(min(25, most), math.ceil(6.0 * overlap_ratio(width, size, beta)) + 1)


def _planets(gears: PlanetarySet) -> tuple[int, dict[str, list[str]]]:
    """Number of planets with room between them, and their angles where equal spacing does not go."""
    total = gears.sun.teeth + gears.ring.teeth
    for count, equal in ((3, True), (4, True), (5, True), (3, False), (2, True), (2, False)):
        angles = equal_planet_angles(count) if equal else feasible_angles(total, equal_planet_angles(count))
        room = planet_room(gears, angles)[0]
        if (total % count and equal) or room < gears.planet.module:
            continue
        around = {"planet_angles": [f"{math.degrees(angle):.10g} deg" for angle in angles]}
        return count, {} if equal else around
    return 1, {}


def _unequal(teeth: tuple[int, ...], planets: int) -> CaseError:
    """Refuse planets that equal spacing does not allow, with the numbers near them that it does."""
    (sun, planet, ring), total = teeth, teeth[0] + teeth[2]
    even = [n for n in range(2, 13) if total % n == 0]
    counts = [n for n in even if len(neighbouring_teeth(sun, planet, ring, n, distance=0, closure=10))]
    near = neighbouring_teeth(sun, planet, ring, planets)
    others = [" ".join(map(str, teeth_there)) for teeth_there in near.only(near.equally_spaced).teeth[:3]]
    remedies = [f"with these teeth --planets {' or '.join(map(str, counts))}"] if counts else []
    remedies += [f"with {planets} planets --teeth {' or '.join(others)}"] if others else []
    return CaseError(
        f"{planets} planets cannot be equally spaced: (z_s + z_r)/N = {total / planets:.6g} is not whole",
        code="E-ASSEMBLY",
        key="--planets",
        value=planets,
        limit=f"divisors of z_s + z_r = {total}",
        remedy="; ".join(remedies) or "fewer planets, or other teeth",
    )


def _not_coaxial(teeth: tuple[int, ...], planets: int | None) -> CaseError:
    """Refuse teeth of a set that no profile shifts close, with the numbers near them that close without any."""
    sun, planet, ring = teeth
    counts = (3, 2) if planets is None else (planets,)
    count, near = next(((n, near) for n in counts if (near := coaxial_teeth(sun, planet, ring, n))), (0, []))
    offered = " or ".join(" ".join(map(str, close)) for close in near[:3])
    misfit = ring - sun - 2 * planet
    return CaseError(
        f"no profile shifts give sun, planet and ring of {sun}/{planet}/{ring} teeth one centre distance: "
        f"z_r - z_s - 2 z_p = {misfit}",
        code="E-COAXIAL",
        key="--teeth",
        value=teeth,
        limit="about z_r = z_s + 2 z_p",
        remedy=f"with {count} planets --teeth {offered}" if near else "fewer planets, or other teeth",
    )


def _read(kind: object, text: str, key: str) -> float:
    """Read a quantity as the entry of a case file that has the kind."""
    try:
        return get_args(kind)[1].read(text)
    except CaseError as error:
        error.key = key
        raise


def _follows(tables: dict[str, object]) -> bool:
    """Whether the steps of an integration follow the meshes, so that no rate is refused or warned of."""
    case = parse_case(case_text.write(tables))
    try:
        codes = [finding.code for finding in train_of(case).case_warnings(case)]
    except CaseError as error:
        codes = [error.code]
    return not {"E-RATE", "W-RATE"} & set(codes)


def _in_time(pair: dict[str, Any], notes: dict[str, str]) -> dict[str, Any]:
    """Tables of a gearbox that is integrated in time: the pair on shafts, with rotors at motor and load."""
    case = parse_case(case_text.write(pair))
    gears: Any = planetary_set(case)
    width = gears.mesh_widths[0]
    rotor = cylinder(0.0, gears.gear_2.reference_radius, 4.0 * width, case.material.density)
    tables = pair_in_gearbox(pair, notes)
    tables["mass"] = [
        {"name": f"rotor of {load['name']}", "shaft": load["shaft"], "position": load["position"]}
        | {
            name: str(Estimate(value, dimension, ""))
            for name, value, dimension in zip(("mass", "inertia"), rotor, (MASS, INERTIA), strict=False)
        }
        for load in tables["load"]
    ]
    for number in range(2):
        for name in ("mass", "inertia"):
            how = "cylinder of the wheel's radius and four face widths"
            notes[f"mass[{number}].{name}"] = f"estimated: {how}"
    tables["transient"] = {"duration": "1 s"}
    for rate in ("50 kHz", "100 kHz", "200 kHz", "500 kHz", "1 MHz", "2 MHz", "5 MHz", "10 MHz"):
        if _follows(tables):
            break
        tables["transient"]["rate"] = rate
        notes["transient.rate"] = "estimated: steps that follow the meshes"
    return tables
