"""Case files that femgear writes: new ones from a few numbers, and those that are read from other files.

What is not known is estimated from the gears, and every line that holds an estimate or assumption says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from copy import deepcopy
from textwrap import wrap
from typing import Any, get_args

from femgear.case import text as case_text
from femgear.case.estimates import (
    Estimate,
    cylinder,
    estimates,
    mesh_stiffness,
    usual_rim,
    usual_torque,
)
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import ANGLE, INERTIA, LENGTH, MASS, STIFFNESS, TORSION
from femgear.case.sections import FaceWidth, Module
from femgear.errors import CaseError
from femgear.gears.phasing import neighbouring_teeth
from femgear.trains.reading import parse_case


def draft_text(
    tables: Mapping[str, Any], remarks: Mapping[str, str], *, word: str, head: Iterable[str] = ()
) -> str:
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
    for key, one in (estimates(case) if hasattr(case, "gear_names") else {}).items():
        section, last = key.rpartition(".")[::2]
        model = _section(case, section)
        # rigid rings have no foundation
        if model is None or last not in type(model).model_fields or (section == "ring" and case.rigid):
            continue
        table = tables
        for part in section.split("."):
            table = table.setdefault(part, {})
        if last not in table:
            table[last] = str(one)
            notes[key] = f"{word}: {one.how}{f'; {notes[key]}' if key in notes else ''}"
    ordered = {name: tables[name] for name in type(case).model_fields if name in tables}
    lines = [f"# {line}".rstrip() for one in head for line in wrap(one, 105) or [""]]
    return "\n".join([*lines, case_text.write(ordered, notes)])


def _section(case: Any, key: str) -> Any:
    """Section of a dotted key, None where the case has none."""
    for part in key.split("."):
        case = getattr(case, part, None)
    return case


KINDS = {
    "planetary": (27, 40, 108), "pair": (24, 36), "planar": (27, 40, 108), "helical": (30, 20, 70),
    "drivetrain": (23, 71),
}  # fmt: skip
"""Kinds of cases that `new_case` writes, with the teeth of their gears."""
_HEAD = "Written by femgear new {}. What is estimated says so: give what is known instead."
_LEAVE = " Masses and inertias stay when teeth change: delete their lines to have them estimated anew."
_STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}


def new_case(
    kind: str, *, teeth: tuple[int, ...] = (), module: str | None = None, torque: str | None = None,
    speed: str | None = None, planets: int | None = None, face_width: str | None = None,
) -> str:  # fmt: skip
    """Write a commented case from a few numbers.

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
        By default the first of 3, 4, 5 and 2 that equal spacing allows.
    face_width : str, optional
        By default twelve modules.

    Raises
    ------
    CaseError, GeometryError
        Another kind (E-CHOICE), other numbers of teeth (E-COUNT), planets of two gears
        (E-ARGUMENTS), planets that equal spacing does not allow (E-ASSEMBLY), and what makes no case.
    """
    given = {"teeth": teeth, "module": module, "planets": planets, "face-width": face_width}
    given |= {"torque": torque, "speed": speed}
    teeth, count = _teeth_and_planets(kind, teeth, planets)
    module, speed = "2 mm" if module is None else module, "1000 rpm" if speed is None else speed
    size, of_set = _read(Module, module, "--module"), len(teeth) == 3
    width = 12.0 * size if face_width is None else _read(FaceWidth, face_width, "--face-width")
    load = f"{usual_torque(teeth[0], teeth[1], size, width, count):.3g} N m" if torque is None else torque
    taken = {"teeth": " ".join(map(str, teeth)), "module": f'"{module}"', "planets": count}
    taken |= {"face-width": f'"{LENGTH.show(width)}"', "torque": f'"{load}"', "speed": f'"{speed}"'}
    left = [f"--{key} {one}" for key, one in taken.items() if not given[key] and (of_set or key != "planets")]
    head = [_HEAD.format(kind) + ("" if kind == "drivetrain" else _LEAVE)]
    head += [f"Assumed: {' '.join(left)}"] if left else []
    helix = math.radians(20.0) if kind == "helical" else 0.0
    shared = {"module": module, "pressure_angle": "20 deg"}
    notes = {f"material.{key}": "estimated: steel" for key in _STEEL}
    notes |= {f"{key}.pressure_angle": "estimated: ISO 53" for key in ("sun", "set", "parallel[0]")}
    notes |= {"set.planets": "estimated: as equal spacing allows"} if planets is None and of_set else {}
    notes |= {} if face_width else {"set.face_width": "estimated: 12 modules"}
    notes |= {} if torque else {"operation.torque": "estimated: K factor of 1 N/mm^2"}
    gears: dict[str, dict[str, Any]] = {}
    for name, z in zip(("sun", "planet", "ring") if of_set else ("gear_1", "gear_2"), teeth, strict=True):
        radius, key = usual_rim(z, size, 1.25, internal=name == "ring", helix=helix)[0], "bore_radius"
        key = "outer_radius" if name == "ring" else key
        notes[f"{name}.{key}"] = f"estimated: a rim of {'four' if name == 'ring' else 'three'} modules"
        gears[name] = {"teeth": z, "profile_shift": 0.0, key: LENGTH.show(radius)}
    tables: dict[str, Any] = {"format": 1, "title": f"{kind.capitalize()} {'/'.join(map(str, teeth))}"}
    tables |= {"set": {"face_width": LENGTH.show(width)}, "material": _STEEL, **gears}
    tables["operation"] = {"torque": load, "speeds": [speed]}
    if not of_set:
        tables |= {"model": "pair", "set": {**shared, **tables["set"]}}
        if kind == "drivetrain":
            tables = _chain(tables, notes)
        return draft_text(tables, notes, word="estimated", head=head)
    gears["sun"] = {"teeth": teeth[0], **shared, **gears["sun"]}
    tables |= {"sun": gears["sun"], "set": {"planets": count, **tables["set"]}}
    tables["operation"] = {"input": "sun", "fixed": "ring", **tables["operation"]}
    # with the other shift the set closes: of the sun where the ring has teeth left over
    del gears["sun" if teeth[2] >= teeth[0] + 2 * teeth[1] else "ring"]["profile_shift"]
    more = {"planar": {"response": {}}, "helical": {"helix_angle": ANGLE.show(helix)}}
    tables |= {kind: more[kind]} if kind in more else {}
    return draft_text(tables, notes, word="estimated", head=head)


def _teeth_and_planets(kind: str, teeth: tuple[int, ...], planets: int | None) -> tuple[tuple[int, ...], int]:
    """Settle the teeth of a kind of cases and the number of planets, of two gears 1."""
    if kind not in KINDS:
        limit = ", ".join(KINDS)
        raise CaseError("there is no such kind of case", code="E-CHOICE", key="kind", value=kind, limit=limit)
    usual, teeth = KINDS[kind], teeth or KINDS[kind]
    if len(usual) == 3 == len(teeth):
        teeth = (*teeth[:2], abs(teeth[2]))
    if len(teeth) != len(usual) or min(teeth) < 5 or max(teeth) > 5000:
        raise CaseError(
            f"a {kind} case needs {len(usual)} numbers of teeth", code="E-COUNT", key="--teeth",
            value=teeth, limit=f"5 to 5000 each, as in --teeth {' '.join(map(str, usual))}",
        )  # fmt: skip
    of_set, total = len(usual) == 3, sum(teeth[::2])
    if planets is not None and not of_set:
        remedy = "leave it out"
        raise CaseError(f"a {kind} case has no planets", code="E-ARGUMENTS", key="--planets", remedy=remedy)
    if planets is None:
        planets = next((n for n in (3, 4, 5, 2) if total % n == 0), 3) if of_set else 1
    if of_set and planets > 0 and total % planets:
        raise _unequal(teeth, planets)
    return teeth, planets


def _unequal(teeth: tuple[int, ...], planets: int) -> CaseError:
    """Refuse planets that equal spacing does not allow, with the numbers near them that it does."""
    (sun, planet, ring), total = teeth, teeth[0] + teeth[2]
    even = [n for n in range(2, 13) if total % n == 0]
    counts = [n for n in even if len(neighbouring_teeth(sun, planet, ring, n, distance=0, closure=10))]
    near = neighbouring_teeth(sun, planet, ring, planets)
    others = [" ".join(map(str, one)) for one in near.only(near.equally_spaced).teeth[:3]]
    remedies = [f"with these teeth --planets {' or '.join(map(str, counts))}"] if counts else []
    remedies += [f"with {planets} planets --teeth {' or '.join(others)}"] if others else []
    return CaseError(
        f"{planets} planets cannot be equally spaced: (z_s + z_r)/N = {total / planets:.6g} is not whole",
        code="E-ASSEMBLY", key="--planets", value=planets, limit=f"divisors of z_s + z_r = {total}",
        remedy="; ".join(remedies) or "fewer planets, or other teeth",
    )  # fmt: skip


def _read(kind: Any, text: str, key: str) -> float:
    """Read a quantity as the entry of a case file that has the kind."""
    try:
        return get_args(kind)[1].read(text)
    except CaseError as error:
        error.key = key
        raise


def _chain(pair: dict[str, Any], notes: dict[str, str]) -> dict[str, Any]:
    """Tables of a drivetrain: motor, shaft, the pair, shaft and load."""
    case = parse_case(case_text.write(pair))
    gears: Any = planetary_set(case)
    known, width = estimates(case), planetary_set(case).mesh_widths[0]
    bearing, ratio = known["gear_1.bearing_stiffness"], gears.gear_2.teeth / gears.gear_1.teeth
    tilt = Estimate(
        0.75 * bearing.value * width**2, TORSION, "the bearing's stiffness over three face widths"
    )
    how = "cylinder of the wheel's radius and four face widths"
    rotor = cylinder(0.0, gears.gear_2.reference_radius, 4.0 * width, case.material.density)
    rotors = [Estimate(value, one, how) for value, one in zip(rotor, (MASS, INERTIA, INERTIA), strict=True)]
    modulus = case.material.youngs_modulus
    mesh = mesh_stiffness(modulus, modulus, width)
    stiffness = Estimate(mesh, STIFFNESS, "20 N/(mm um) times the face width")
    tables: dict[str, Any] = {"format": 1, "model": "drivetrain", "title": pair["title"]}
    tables |= {"body": [], "shaft": [], "parallel": [], "bearing": []}

    def add(table: str, given: dict[str, Any], **estimated: Estimate) -> None:
        for key, one in estimated.items():
            notes[f"{table}[{len(tables[table])}].{key}"] = f"estimated: {one.how}"
        tables[table].append(given | {key: str(one) for key, one in estimated.items()})

    for name, gear in (("motor", ""), ("pinion", "gear_1"), ("wheel", "gear_2"), ("load", "")):
        keys = f"{gear}.mass", f"{gear}.inertia", f"helical.{gear}.diametral_inertia"
        mass, inertia, transverse = [known[key] for key in keys] if gear else rotors
        add("body", {"name": name}, mass=mass, inertia=inertia, transverse_inertia=transverse)
        add("bearing", {"body": name}, radial=bearing, tilt=tilt)
    for ends, torque in ((["motor", "pinion"], 1.0), (["wheel", "load"], ratio)):
        diameter = (16.0 * abs(torque * case.operation.torque) / (math.pi * 25e6)) ** (1.0 / 3.0)
        outer = Estimate(diameter, LENGTH, "25 N/mm^2 of torsional stress")
        length = Estimate(5.0 * diameter, LENGTH, "five diameters")
        add("shaft", {"between": ends}, length=length, outer_diameter=outer)
    mesh = {"stiffness": str(stiffness), "contact_ratio": round(gears.contact_ratio, 4)}
    stage = {"between": ["pinion", "wheel"], "teeth": [gears.gear_1.teeth, gears.gear_2.teeth]}
    add("parallel", stage | {key: pair["set"][key] for key in ("module", "pressure_angle")} | {"mesh": mesh})
    notes["parallel[0].mesh.stiffness"] = f"estimated: {stiffness.how}"
    notes["operation.torque[0].torque"] = notes.pop("operation.torque", "")
    torques = [{"body": "motor", "torque": pair["operation"]["torque"]}, {"body": "load", "share": 1.0}]
    tables["operation"] = {"speed": pair["operation"]["speeds"][0], "torque": torques}
    return tables | {"simulation": {"duration": "1 s", "damping_ratio": 0.03}}
