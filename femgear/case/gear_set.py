"""Gears, deviations and shafts that a case describes; cases are read by `femgear.trains.reading`.

`planetary_set` and `set_deviations` make gears and deviations of any `femgear.case.teeth.GearCase` once for a case,
`support_stiffness` finds what holds members that stand on a shaft. Refusals name the entries of the case file, with
file and line.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Any, overload

from femgear.case.messages import in_terms_of_the_case, rack_at
from femgear.case.planetary import Case
from femgear.case.quantities import LENGTH
from femgear.case.sections import SunSection, gear_material
from femgear.case.teeth import GearCase
from femgear.errors import CaseError, FemgearError, GeometryError
from femgear.fe.elasticity import Material
from femgear.fe.shaft import ShaftStep, check_shaft, shaft_support_stiffness, timoshenko_flexibility
from femgear.gears.deviations import (
    SetDeviations,
    body_separation,
    check_deviations,
)
from femgear.gears.gear import largest_allowance
from femgear.gears.planetary import PlanetarySet
from femgear.remembered import remembered

if TYPE_CHECKING:
    from femgear.case.sections import CarrierSection, MaterialSection

_PLAY = 1e-9
"""Play below which there is no back side [m]: what rounding leaves of none."""
_ON_SHAFTS = ("sun", "carrier")
"""Members that may stand on a shaft."""


def need_set(case: Any) -> None:
    """Refuse a case without a planetary set of its own (E-MODEL)."""
    _need(Case, case)


def _need(kind: type, case: Any) -> None:
    """Refuse a case of another kind (E-MODEL)."""
    if not isinstance(case, kind):
        raise CaseError(
            f"a {case.model} has no planetary set of its own",
            code="E-MODEL",
            key="model",
            value=case.model,
            remedy="use femgear check and femgear run, or a case without model",
            file=case.location("model"),
        )


@overload
def planetary_set(case: Case) -> PlanetarySet:
    """Make the gears of a planetary set."""


@overload
def planetary_set(case: GearCase) -> Any:
    """Make the gears of a pair, or of a set with planets of any kind."""


@remembered(latest=16)
def planetary_set(case: Any) -> Any:
    """Make the gears of a case, closed on their centre distance [m] and checked.

    Profile shifts, or the centre distance, that the case leaves out are found. Gears of a helical case are
    those of its transverse section.

    GeometryError, with file and line: what cannot be made, assembled or run (see
    `femgear.gears.checks.check_set`), and members that float without being held (E-MECHANISM).
    """
    _need(GearCase, case)
    try:
        return case.closed_gears()
    except GeometryError as error:
        in_terms_of_the_case(error, case)
        if (error.key or "").endswith("rack.root_radius"):
            _name_root_radius(error, case)
        if getattr(getattr(case, "set", None), "backlash", 0.0):
            _name_backlash(error, case)
        raise


def _refusal(case: Case) -> str:
    """Code of what is wrong with the gears of a case; empty where nothing is."""
    try:
        case.closed_gears()
    except GeometryError as error:
        return error.code
    return ""


def _name_backlash(error: GeometryError, case: Case) -> None:
    """Let a refusal of teeth that the backlash thins too far name it, and what leaves every gear a tip, in um."""

    def with_backlash(backlash: float) -> Case:
        return case.model_copy(update={"set": case.set.model_copy(update={"backlash": backlash})})

    try:
        thinnest = min(map(largest_allowance, with_backlash(0.0).closed_gears().gears))
    except GeometryError as refused:
        if refused.code == error.code:
            return
        thinnest = 0.0
    error.key, error.value, error.limit = "set.backlash", LENGTH.show(case.set.backlash), None
    error.remedy, error.file = "reduce the backlash, or check its unit", case.location("set.backlash")
    most = 1e-6 * (math.ceil(2e6 * thinnest) - 1)
    if most >= 0.0 and not _refusal(with_backlash(most)):
        error.limit = f"up to {LENGTH.show(most)} for these gears, each of which takes half of it"


def _name_root_radius(error: GeometryError, case: Case) -> None:
    """Let a refusal of the tool's rounding name the largest root radius that can be typed in its place.

    The limit of one gear is not that of the others, and that of a gear whose profile shift is found only
    shows with that shift.
    """
    key = error.key or ""
    most = _largest_root_radius(case, key, ("E-ROOT-RADIUS", "E-FILLET"))
    if error.code == "E-FILLET":
        if most is not None:
            error.remedies = (f"reduce root_radius to {most:.4f} or less", *error.remedies[1:])
        return
    if most is None:
        most = _largest_root_radius(case, key, ("E-ROOT-RADIUS",))
    if most is None:
        error.limit, error.remedy = None, "reduce the dedendum: no root_radius fits"
    else:
        # also where none fits with the one cutter that the gear has then: a smaller rounding may have another
        error.limit = f"<= {most:.4f} modules for the gears of this rack"
        error.remedy = "reduce root_radius"


def _largest_root_radius(case: Case, key: str, codes: tuple[str, ...]) -> float | None:
    """Largest root radius [modules] of four decimals that is not refused with one of the codes, if any."""

    def refused(steps: int) -> bool:
        rack = rack_at(case, key).model_copy(update={"root_radius": steps / 1e4})
        gear = key.partition(".")[0]
        owner = {} if gear == "rack" else {gear: getattr(case, gear).model_copy(update={"rack": rack})}
        return _refusal(case.model_copy(update=owner or {"rack": rack})) in codes

    first = bisect_left(range(round(1e4 * rack_at(case, key).root_radius)), True, key=refused)
    return (first - 1) / 1e4 if first else None


@remembered(latest=16)
def set_deviations(case: Any) -> SetDeviations:
    """Turn modifications and errors of a case into separations of the loaded flanks [m].

    GeometryError: modifications that the flanks cannot have (E-MODIFICATION), with file and line, and what
    `planetary_set` refuses.
    """
    s = planetary_set(case)
    deviations = case.made_deviations(s)
    try:
        check_deviations(deviations, s)
    except GeometryError as error:
        error.file = case.location(error.key or "")
        raise
    return deviations


def line_play(case: GearCase) -> float:
    """Compute the play of a pair along the line of action [m] with thickness errors; zero for rounding."""
    gears = planetary_set(case)
    play = gears.backlash + body_separation(set_deviations(case), gears, 0.0, back=True)[0, 0]
    return float(play) if play > _PLAY else 0.0


def check_shafts(case: Case) -> None:
    """Refuse parts that make no shaft (GeometryError E-SHAFT, with file and line); no element is made for it."""
    for name in _ON_SHAFTS:
        if getattr(case, name).support_shaft:
            with _of_shaft(case, name):
                check_shaft(_steps(getattr(case, name)))


def support_stiffness(case: Any, member: str, section: Any = None) -> Any:
    """Find the radial stiffness [N/m] that holds a member: the entry of its section, or that of its shaft.

    The member stands on the free end of a stepped cantilever, its face rigidly coupled to the axis, which may
    tilt: ``K = F/X``, see `femgear.fe.shaft.shaft_support_stiffness`. The shaft of the sun is of its
    material, that of the carrier of the section ``material``. The section is by default that of the member.
    None where nothing holds it.
    """
    section = getattr(case, member) if section is None else section
    if not getattr(section, "support_shaft", ()):
        return section.support_stiffness
    with _of_shaft(case, member):
        return _stiffness(_steps(section), _shaft_material(case, member))


@contextmanager
def _of_shaft(case: Case, member: str) -> Iterator[None]:
    """Let a refusal name the shaft of a member, file and line."""
    try:
        yield
    except FemgearError as error:
        error.key = f"{member}.support_shaft"
        error.file = case.location(error.key)
        raise


def shaft_lines(case: Case) -> tuple[str, ...]:
    """Write the support stiffness [N/um] of every shaft in a sentence, that of Timoshenko's beam.

    That of finite elements is computed by the first stage that needs it, see `support_stiffness`.
    """
    lines = []
    for name in _ON_SHAFTS:
        section = getattr(case, name)
        if section.support_shaft:
            beam = 1.0 / timoshenko_flexibility(_steps(section), _shaft_material(case, name))[0, 0]
            lines.append(
                f"support of the {name} from its shaft: {beam * 1e-6:.4g} N/um as a beam; stages take it from "
                "finite elements"
            )
    return tuple(lines)


def support_text(case: Any, member: str, section: Any = None) -> str:
    """Write the radial stiffness [N/m] that holds a member for a table, without computing that of a shaft."""
    section = getattr(case, member) if section is None else section
    return "its shaft" if getattr(section, "support_shaft", ()) else f"{section.support_stiffness:.6g}"


def materials_of(case: GearCase) -> tuple[Material, ...]:
    """Take the materials of the gears of a case in the order of its set: elasticity and density."""
    return tuple(material_of(case, name) for name in case.gear_names)


def material_of(case: Any, gear: str) -> Material:
    """Take the material of a gear of a case: elasticity [Pa] and density [kg/m^3]."""
    return _elastic(gear_material(case, gear))


def _shaft_material(case: Case, member: str) -> Material:
    """Material of the shaft of a member: that of a gear, or for the carrier that of the case."""
    return _elastic(gear_material(case, member) if member in case.gear_names else case.material)


def _elastic(section: MaterialSection) -> Material:
    return Material(section.youngs_modulus, section.poisson_ratio, section.density)


def _steps(section: SunSection | CarrierSection) -> tuple[ShaftStep, ...]:
    return tuple(ShaftStep(*part.model_dump().values()) for part in section.support_shaft)


_stiffness = lru_cache(maxsize=64)(shaft_support_stiffness)
"""Support stiffness of a shaft [N/m], computed once for equal shafts."""
