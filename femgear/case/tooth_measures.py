"""Entries of gears that are measured on a drawing, and the profile shift and thickness of teeth that follow from them.

A gear may give its span, its dimension over balls or its tooth thickness. Without a profile shift they give it; with
one they give what the teeth are thinner. Allowances of the thickness stand for the backlash of the set: the gear is
computed in the middle between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema, model_validator

from femgear.case.quantities import LENGTH, Count, Quantity, Section, to_si
from femgear.case.text import described
from femgear.errors import CaseError, GeometryError
from femgear.gears.allowances import fit_series, thickness_allowances
from femgear.gears.drawing import (
    allowance_of_half_angle,
    check_ball,
    check_span,
    half_angle_of_balls,
    half_angle_of_span,
    half_angle_of_thickness,
    normal_thickness,
    over_balls,
    shift_of_half_angle,
    span,
)

if TYPE_CHECKING:
    from femgear.gears.gear import Gear

MEASURES = ("span", "over_balls", "tooth_thickness")
"""Entries that tell how thick teeth are, the first of those given counts."""
AGREED = 1e-6
"""Difference [m] of a measure and what other entries make of it, from which they contradict one another."""
_LARGEST_ALLOWANCE = 0.01
_EXAMPLE = '["-70 um", "-110 um"]'

Measure = Annotated[float, Quantity(LENGTH, 1e-5, 20.0)]


def _allowances(value: object) -> str | tuple[float, float]:
    """Name of DIN 3967, or the upper and the lower allowance [m]."""
    if isinstance(value, str):
        try:
            allowance, tolerance = fit_series(value)
        except GeometryError as error:
            limit, remedy = error.limit, error.remedy
            raise CaseError(error.message, code=error.code, value=value, limit=limit, remedy=remedy) from None
        return f"{allowance} {tolerance}"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise CaseError(
            f"two allowances, or a name of DIN 3967, are needed, not {described(value)}",
            code="E-TYPE",
            value=value,
            remedy=f'write {_EXAMPLE} or "cd 25"',
        )
    upper, lower = (
        to_si(entry, LENGTH, low=-_LARGEST_ALLOWANCE, high=0.0, remedy="allowances thin the teeth: 0 or below")
        for entry in value
    )
    if lower > upper:
        raise CaseError(
            "the allowances are the wrong way round",
            code="E-RANGE",
            value=f"{value[0]}, {value[1]}",
            limit=f"the upper one first, the lower one {LENGTH.show(upper)} or below",
            remedy=f'write ["{value[1]}", "{value[0]}"]',
        )
    return upper, lower


_SCHEMA: dict[str, Any] = {
    "anyOf": [
        {"type": "string", "description": 'allowance series a to h and tolerance series 21 to 30 of DIN 3967, "cd 25"'},
        {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2},
    ]
}
Allowances = Annotated[str | tuple[float, float], BeforeValidator(_allowances), WithJsonSchema(_SCHEMA)]


class ToothMeasures(Section):
    """What a drawing tells of the teeth of a gear, in the normal section.

    ``span`` goes over ``span_teeth`` teeth, ``over_balls`` with two balls of ``ball_diameter``, of internal gears
    between them. ``tooth_thickness`` is the arc of the reference circle; its ``tooth_thickness_allowance`` is the upper
    and the lower one, or their name.
    """

    span: Measure | None = None
    span_teeth: Annotated[int, Count(1, 2500)] | None = None
    over_balls: Measure | None = None
    ball_diameter: Annotated[float, Quantity(LENGTH, 1e-5, 1.0)] | None = None
    tooth_thickness: Measure | None = None
    tooth_thickness_allowance: Allowances | None = None

    @model_validator(mode="after")
    def _measure_is_whole(self):
        for measure, other, example in (
            ("span", "span_teeth", "span_teeth = 4"),
            ("over_balls", "ball_diameter", 'ball_diameter = "3.5 mm"'),
        ):
            if getattr(self, measure) is not None and getattr(self, other) is None:
                raise CaseError(f"{measure} needs {other}", code="E-KEY-MISSING", remedy=f"add {example}")
        return self


@dataclass(frozen=True)
class _Measured:
    """A measure of a case.

    Its ``key``, the ``half_angle`` of its teeth at the base circle [rad], its ``value`` [m], and what it is ``of`` a
    gear [m].
    """

    key: str
    half_angle: float
    value: float
    of: Any


def shift_open(section: Any) -> bool:
    """Tell whether a section of a gear leaves its profile shift to be found from the mates."""
    return section.profile_shift is None and not section.given(*MEASURES)


def gear_allowances(case: Any, name: str) -> tuple[float, float] | None:
    """Find the upper and lower allowance of the tooth thickness of a gear of a case [m]; None where it has none.

    CaseError: a diameter that DIN 3967 does not have (E-ALLOWANCE).
    """
    section = getattr(case, name)
    given = section.tooth_thickness_allowance
    if given is None or not isinstance(given, str):
        return given
    diameter = section.teeth * case.module / math.cos(case.helix_angle or 0.0)
    try:
        return thickness_allowances(given, diameter)
    except GeometryError as error:
        error.key = f"{name}.tooth_thickness_allowance"
        raise


def check_allowances(case: Any) -> Iterator[CaseError]:
    """Refuse allowances of gears beside a backlash of the set, which is half of it from every gear."""
    for name in case.gear_names:
        given = getattr(case, name).tooth_thickness_allowance
        if given is None or not case.set.backlash:
            continue
        shown = given if isinstance(given, str) else ", ".join(f"{1e6 * value:.6g} um" for value in given)
        yield CaseError(
            "the teeth are thinned twice, by their allowances and by the backlash of the set",
            code="E-DUPLICATE",
            key=f"{name}.tooth_thickness_allowance",
            value=f"{shown}; set.backlash = {1e6 * case.set.backlash:.6g} um",
            limit="one of both",
            remedy="leave set.backlash out and give every gear its allowances",
        )


def measured_gear(case: Any, section: Any, gear: Gear) -> Gear:
    """Give a gear of a case the profile shift and the thickness that its measures tell.

    The ``gear`` has the profile shift of the case, zero where it gives none, and its allowance.

    Raises
    ------
    GeometryError
        Measures that cannot be taken (E-CHOICE, E-RANGE), that contradict one another or the profile shift
        (E-DUPLICATE), with both values.
    """
    helix = case.helix_angle or 0.0
    if section.given("span", "span_teeth") and gear.internal:
        check_span(gear, 1, helix)
    measures = list(_measures(section, gear, helix))
    if not measures:
        return gear
    first = measures[0]
    if section.profile_shift is None or "profile_shift" not in section.model_fields_set:
        made = replace(gear, profile_shift=shift_of_half_angle(gear, first.half_angle))
    else:
        if section.span is not None:
            check_span(gear, section.span_teeth, helix)
        made = _thinned_to(case, section, gear, first)
    for other in measures[1:]:
        if abs(other.of(made) - other.value) > AGREED:
            raise _contradiction(gear, other, f"{gear.name}.{first.key} = {LENGTH.show(first.value)}", other.of(made))
    if section.span is not None:
        check_span(made, section.span_teeth, helix)
    if section.over_balls is not None:
        check_ball(made, section.ball_diameter, helix)
    return made


def _measures(section: Any, gear: Gear, helix: float) -> Iterator[_Measured]:
    """Measures that a section gives."""
    if section.span is not None:
        teeth, length = section.span_teeth, section.span
        half_angle = half_angle_of_span(gear, teeth, length, helix)
        yield _Measured("span", half_angle, length, lambda made: span(made, teeth, helix))
    if section.over_balls is not None:
        ball, length = section.ball_diameter, section.over_balls
        half_angle = half_angle_of_balls(gear, ball, length, helix)
        yield _Measured("over_balls", half_angle, length, lambda made: over_balls(made, ball, helix))
    if section.tooth_thickness is not None:
        length = section.tooth_thickness
        half_angle = half_angle_of_thickness(gear, length, helix)
        yield _Measured("tooth_thickness", half_angle, length, lambda made: normal_thickness(made, helix))


def _thinned_to(case: Any, section: Any, gear: Gear, measure: _Measured) -> Gear:
    """Gear of a given profile shift whose teeth are as thin as a measure has them, within its allowances."""
    allowances = gear_allowances(case, gear.name)
    thinner = allowance_of_half_angle(gear, measure.half_angle)
    if allowances is not None:
        least, most = (-value / math.cos(case.helix_angle or 0.0) for value in allowances)
    elif case.set.backlash:
        least = most = gear.thickness_allowance
    else:
        least, most = 0.0, gear.module
    ends = [measure.of(replace(gear, thickness_allowance=amount, tip_open=True)) for amount in (least, most)]
    if min(ends) - AGREED <= measure.value <= max(ends) + AGREED:
        return replace(gear, thickness_allowance=max(thinner, 0.0))
    shift = f"{gear.name}.profile_shift = {section.profile_shift:g}{_thinning(case, allowances)}"
    thinned = allowances is not None or case.set.backlash
    raise _contradiction(gear, measure, shift, *(sorted(ends) if thinned else ends[:1]))


def _thinning(case: Any, allowances: tuple[float, float] | None) -> str:
    """What thins the teeth of a gear, in words."""
    if allowances is not None:
        return f" with allowances of {1e6 * allowances[0]:.6g} and {1e6 * allowances[1]:.6g} um"
    return f" with set.backlash = {1e6 * case.set.backlash:.6g} um" if case.set.backlash else ""


def _contradiction(gear: Gear, measure: _Measured, other: str, *values: float) -> GeometryError:
    """Make the refusal of a measure that other entries contradict; ``values`` is what these make of it [m]."""
    shown = " to ".join(f"{1e3 * value:.4f}" for value in dict.fromkeys(values))
    word = {"over_balls": "dimension over balls"}.get(measure.key, measure.key.replace("_", " "))
    return GeometryError(
        f"{gear.name}: the {word} of {1e3 * measure.value:.4f} mm contradicts {other}, which makes it {shown} mm",
        code="E-DUPLICATE",
        key=f"{gear.name}.{measure.key}",
        value=f"{1e3 * measure.value:.4f} mm",
        limit=f"{shown} mm",
        remedy=f"leave one of both out: {measure.key} alone gives the profile shift",
    )
