"""Entries of gears that are measured on a drawing, and the profile shift and thickness of teeth that follow from them.

A gear may give its span, its dimension over balls or its tooth thickness. Without a profile shift they give it; with
one they give what the teeth are thinner. Allowances of the thickness stand for the backlash of the set: the gear is
computed in the middle between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
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

_MOST_THINNED = 0.2
"""What teeth are thinner than their profile shift has them, at most, where no allowance tells it [modules]."""


def _measure(value: object) -> float | tuple[float, float]:
    """A length [m], or the two limits of one in ascending order."""
    if not isinstance(value, list | tuple):
        return to_si(value, LENGTH, low=_SHORTEST, high=_LONGEST)
    if len(value) != 2:
        message, remedy = f"{len(value)} limits of a measure", 'write ["32.52 mm", "32.56 mm"]'
        raise CaseError(message, code="E-COUNT", value=value, limit="a length, or its two limits", remedy=remedy)
    low, high = sorted(to_si(entry, LENGTH, low=_SHORTEST, high=_LONGEST) for entry in value)
    return low, high


_SHORTEST, _LONGEST = 1e-5, 20.0
_LENGTHS: dict[str, Any] = {
    "anyOf": [
        {"type": "string", "description": f"a length with its unit, {LENGTH.window(_SHORTEST, _LONGEST)}"},
        {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2, "description": "its two limits"},
    ]
}
Measure = Annotated[float | tuple[float, float], BeforeValidator(_measure), WithJsonSchema(_LENGTHS)]


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
    and the lower one, or their name. A measure may have two limits in place of a value.
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

    Parameters
    ----------
    key : str
    ends : (float, float)
        Its limits in ascending order [m], equal where it has one value.
    half_angle : callable
        Half-thickness angle at the base circle [rad] of a value [m].
    of : callable
        Value of a gear [m].
    """

    key: str
    ends: tuple[float, float]
    half_angle: Callable[[float], float]
    of: Callable[[Gear], float]

    @property
    def value(self) -> float:
        """Middle of the limits [m]."""
        return 0.5 * sum(self.ends) if self.ends[0] < self.ends[1] else self.ends[0]

    @property
    def has_limits(self) -> bool:
        """Whether it has two limits."""
        return self.ends[0] < self.ends[1]

    @property
    def thickest(self) -> float:
        """Half-thickness angle [rad] of the thickest tooth within the limits."""
        return max(map(self.half_angle, self.ends))

    @property
    def text(self) -> str:
        """What the case has, in mm."""
        return " to ".join(f"{1e3 * value:.4f}" for value in dict.fromkeys(self.ends)) + " mm"


def shift_open(section: Any) -> bool:
    """Tell whether a section of a gear leaves its profile shift to be found from the mates."""
    return section.profile_shift is None and not section.given(*MEASURES)


def gear_allowances(case: Any, name: str) -> tuple[float, float] | None:
    """Find the upper and lower allowance of the tooth thickness of a gear of a case [m]; None where it has none.

    GeometryError: a diameter that DIN 3967 does not have (E-RANGE).
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


def gear_limits(case: Any, gear: Gear) -> tuple[float, float] | None:
    """Find the upper and lower allowance of the tooth thickness of a made gear [m], by names, numbers or limits.

    They are those of the normal section, from the thickness that the profile shift makes.
    """
    section, helix = getattr(case, gear.name), case.helix_angle or 0.0
    if section.tooth_thickness_allowance is not None:
        return gear_allowances(case, gear.name)
    measure = next(_measures(section, gear, helix), None)
    if measure is None or not measure.has_limits:
        return None
    angles = sorted(map(measure.half_angle, measure.ends), reverse=True)
    upper, lower = (0.0 - allowance_of_half_angle(gear, angle) * math.cos(helix) for angle in angles)
    return min(upper, 0.0), lower


def check_allowances(case: Any) -> Iterator[CaseError]:
    """Refuse what thins the teeth twice: allowances, limits of a measure, backlash of the set."""
    for name in case.gear_names:
        section = getattr(case, name)
        given = {key: getattr(section, key) for key in ("tooth_thickness_allowance", *section.given(*MEASURES)[:1])}
        limits = {key: _shown(value) for key, value in given.items() if isinstance(value, str | tuple)}
        if case.set.backlash:
            limits["set.backlash"] = f"{1e6 * case.set.backlash:.6g} um"
        if len(limits) > 1:
            (key, value), *others = limits.items()
            yield CaseError(
                "the teeth are thinned twice",
                code="E-DUPLICATE",
                key=f"{name}.{key}",
                value="; ".join([value, *(f"{other} = {text}" for other, text in others)]),
                limit="one of allowances, limits of a measure, and the backlash of the set",
                remedy=f"keep one, and leave {' and '.join(key for key, _ in others)} out",
            )


def _shown(value: str | tuple[float, float]) -> str:
    """Name of allowances, two allowances in um, or two limits of a measure in mm."""
    if isinstance(value, str):
        return value
    allowances = min(value) < 0.0 or max(value) <= 0.0
    scale, unit = (1e6, "um") if allowances else (1e3, "mm")
    return ", ".join(f"{scale * entry:.6g} {unit}" for entry in value)


def measured_gear(case: Any, section: Any, gear: Gear) -> Gear:
    """Give a gear of a case the profile shift and the thickness that its measures tell.

    The ``gear`` has the profile shift of the case, zero where it gives none, and its allowance. Of a measure with
    limits the profile shift is that of the thickest tooth, and the gear lies in the middle.

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
        made = replace(gear, profile_shift=shift_of_half_angle(gear, first.thickest))
        if first.has_limits:
            made = replace(made, thickness_allowance=_allowance(made, first))
    else:
        # what cannot be measured at all is no contradiction
        _check_tools(section, gear, helix)
        made = _thinned_to(case, section, gear, first)
    for other in measures[1:]:
        value = other.of(made)
        if not other.ends[0] - AGREED <= value <= other.ends[1] + AGREED:
            raise _contradiction(gear, other, f"{gear.name}.{first.key} = {first.text}", value)
    _check_tools(section, made, helix)
    return made


def _check_tools(section: Any, gear: Gear, helix: float) -> None:
    """Refuse spans and balls of measures that the flanks of a gear do not have."""
    if section.span is not None:
        check_span(gear, section.span_teeth, helix)
    if section.over_balls is not None:
        check_ball(gear, section.ball_diameter, helix)


def _allowance(gear: Gear, measure: _Measured) -> float:
    """What teeth are thinner in the middle between the limits of a measure [m]."""
    angle = 0.5 * sum(map(measure.half_angle, measure.ends))
    return max(allowance_of_half_angle(gear, angle), 0.0)


def _measures(section: Any, gear: Gear, helix: float) -> Iterator[_Measured]:
    """Measures that a section gives."""

    def ends(value: float | tuple[float, float]) -> tuple[float, float]:
        return value if isinstance(value, tuple) else (value, value)

    if section.span is not None:
        teeth = section.span_teeth
        yield _Measured(
            "span",
            ends(section.span),
            lambda length: half_angle_of_span(gear, teeth, length, helix),
            lambda made: span(made, teeth, helix),
        )
    if section.over_balls is not None:
        ball = section.ball_diameter
        yield _Measured(
            "over_balls",
            ends(section.over_balls),
            lambda length: half_angle_of_balls(gear, ball, length, helix),
            lambda made: over_balls(made, ball, helix),
        )
    if section.tooth_thickness is not None:
        yield _Measured(
            "tooth_thickness",
            ends(section.tooth_thickness),
            lambda length: half_angle_of_thickness(gear, length, helix),
            lambda made: normal_thickness(made, helix),
        )


def _thinned_to(case: Any, section: Any, gear: Gear, measure: _Measured) -> Gear:
    """Gear of a given profile shift whose teeth are as thin as a measure has them, within its allowances."""
    allowances = gear_allowances(case, gear.name)
    if allowances is not None:
        least, most = (-value / math.cos(case.helix_angle or 0.0) for value in allowances)
    elif case.set.backlash:
        least = most = gear.thickness_allowance
    else:
        least, most = 0.0, _MOST_THINNED * gear.module
    ends = sorted(measure.of(replace(gear, thickness_allowance=amount, tip_open=True)) for amount in (least, most))
    if ends[0] - AGREED <= measure.ends[0] and measure.ends[1] <= ends[1] + AGREED:
        return replace(gear, thickness_allowance=_allowance(gear, measure))
    shift = f"{gear.name}.profile_shift = {section.profile_shift:g}{_thinning(case, allowances)}"
    raise _contradiction(gear, measure, shift, *ends)


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
        f"{gear.name}: the {word} of {measure.text} contradicts {other}, which makes it {shown} mm",
        code="E-DUPLICATE",
        key=f"{gear.name}.{measure.key}",
        value=measure.text,
        limit=f"{shown} mm",
        remedy=f"leave one of both out: {measure.key} alone gives the profile shift",
    )
