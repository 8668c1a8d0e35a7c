"""The case file: every entry checked, every unit converted, every mistake reported at once."""

from __future__ import annotations

import os
from typing import Any

from pydantic import ValidationError

from femgear.casefile import tomlfile
from femgear.casefile.problems import combine, translate
from femgear.casefile.sections import FORMAT, Case, PlanetSection, RingSection, SunSection, cross_check
from femgear.errors import CaseError, GeometryError
from femgear.gears import (
    BasicRack,
    Gear,
    PinionCutter,
    PlanetarySet,
    check_set,
    close_set,
    equal_planet_angles,
)

__all__ = ["Case", "case_schema", "parse_case", "planetary_set", "read_case", "to_toml", "with_value"]


def read_case(path: str | os.PathLike) -> Case:
    """Case of a TOML file.

    Parameters
    ----------
    path : path-like
        A regular UTF-8 file of at most 1 MB.

    Returns
    -------
    Case
        Checked, frozen, in SI units and radians.

    Raises
    ------
    CaseError
        Everything that is wrong with the file, at once; ``problems`` holds one `CaseError` for each.
    """
    return parse_case(tomlfile.read_text(path), name=tomlfile.printable(os.fsdecode(path)))


def parse_case(text: str, *, name: str = "") -> Case:
    """Case of a TOML text; see `read_case`.

    Parameters
    ----------
    text : str
    name : str
        File name for messages.
    """
    return _build(tomlfile.parse(text, name), text, name)


def with_value(case: Case, key: str, value: object) -> Case:
    """The case with one entry changed, checked again as a whole.

    Parameters
    ----------
    case : Case
    key : str
        Dotted key such as ``"operation.torque"``.
    value : object
        As the file would hold it: ``"50 N m"``, 0.3, 27, a list or table of such; None leaves the entry out.

    Returns
    -------
    Case

    Raises
    ------
    CaseError
        As `read_case`; unknown keys are refused with the nearest valid one.
    """
    data = tomlfile.parse(case.source, case.name)
    *tables, last = key.split(".")
    table = data
    for part in tables:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise CaseError(f"{part} is not a table", code="E-KEY", key=key, file=case.name or None)
    if value is None:
        table.pop(last, None)
    else:
        table[last] = value.tolist() if hasattr(value, "tolist") else value
    try:
        text = tomlfile.write(data)
    except CaseError as error:
        error.key, error.file = key, case.name or None
        raise
    return _build(tomlfile.parse(text, case.name), text, case.name, numbered=False)


def to_toml(case: Case) -> str:
    """TOML text that gives this case when read; the text of its file as long as nothing was changed."""
    return case.source


def case_schema() -> dict[str, Any]:
    """JSON schema of the case file, for editors."""
    return Case.model_json_schema()


def planetary_set(case: Case) -> PlanetarySet:
    """Gears of a case, closed on their centre distance and checked.

    Parameters
    ----------
    case : Case

    Returns
    -------
    PlanetarySet
        With the profile shifts, or the centre distance, that the case leaves to be found.

    Raises
    ------
    GeometryError
        What cannot be made, assembled or run (see `femgear.gears.checks.check_set`), with file and line.
    """
    ring = case.ring
    cutter = None
    if ring.cutter_teeth is not None:
        cutter = PinionCutter(teeth=ring.cutter_teeth, profile_shift=ring.cutter_profile_shift)
    left_open = (("sun", case.sun.profile_shift), ("ring", ring.profile_shift))
    try:
        closed = close_set(
            _gear(case, case.sun, "sun", case.sun.bore_radius),
            _gear(case, case.planet, "planet", case.planet.bore_radius),
            _gear(case, ring, "ring", ring.outer_radius, cutter),
            planet_angles=case.set.planet_angles or equal_planet_angles(case.set.planets),
            centre_distance=case.set.centre_distance,
            find=tuple(name for name, shift in left_open if shift is None),
        )
        check_set(closed)
    except GeometryError as error:
        error.file = case.location(error.key or "")
        raise
    return closed


def _gear(
    case: Case,
    section: SunSection | PlanetSection | RingSection,
    name: str,
    rim: float,
    cutter: PinionCutter | None = None,
) -> Gear:
    rack = section.rack or case.rack
    return Gear(
        teeth=section.teeth,
        module=case.sun.module,
        pressure_angle=case.sun.pressure_angle,
        profile_shift=section.profile_shift or 0.0,
        face_width=case.set.face_width,
        rim_radius=rim,
        internal=name == "ring",
        rack=BasicRack(addendum=rack.addendum, dedendum=rack.dedendum, root_radius=rack.root_radius),
        cutter=cutter,
        tip_diameter=section.tip_diameter,
        root_diameter=section.root_diameter,
        thickness_allowance=0.5 * case.set.backlash,
        name=name,
    )


def _build(data: dict, text: str, name: str, *, numbered: bool = True) -> Case:
    version = data.get("format", FORMAT)
    if type(version) is int and version > FORMAT:
        raise CaseError(
            "the file is written for a newer femgear",
            code="E-FORMAT",
            key="format",
            value=tomlfile.shown(version),
            limit=f"up to {FORMAT}",
            remedy="update femgear",
            file=name,
        )
    lines = text if numbered else ""
    try:
        case = Case.model_validate(data)
    except ValidationError as error:
        raise combine(translate(error, Case), lines, name) from None
    problems = cross_check(case)
    if problems:
        raise combine(problems, lines, name)
    case._source, case._lines, case._name, case._notices = text, lines, name, _notices(data)
    return case


def _notices(data: dict) -> tuple[str, ...]:
    teeth = data["ring"]["teeth"]
    if teeth > 0:
        return ()
    return (
        f"ring.teeth = {teeth} is read as an internal gear with {-teeth} teeth; ring.profile_shift keeps "
        "femgear's sign (positive moves the flank outwards, the opposite of ISO 21771)",
    )
