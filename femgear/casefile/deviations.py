"""The sections of a case file that hold deviations: modifications of flanks and errors of members."""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, model_validator

from femgear.casefile.fields import Count, Number, Quantity, refuse
from femgear.casefile.units import ANGLE, LENGTH
from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.casefile.sections import Case

LARGEST_DEVIATION = 0.2
"""Largest plausible amount of any modification or error, in modules."""

MOST_POINTS = 2000
"""Points of a measured profile; machines write some hundreds."""

Deviation = Quantity(LENGTH, -0.02, 0.02)
Amplitude = Quantity(LENGTH, 0.0, 0.02)
Phase = Quantity(ANGLE, -2 * math.pi, 2 * math.pi)
Diameter = Quantity(LENGTH, 1e-4, 20.0)
RollAngle = Quantity(ANGLE, 0.0, 4 * math.pi)
RollLength = Quantity(LENGTH, 0.0, 10.0)
Points = Field(max_length=MOST_POINTS)

_MEASURED = ("file", "roll_angles", "diameters", "deviations")
_PLACES = ("diameter", "roll_angle", "roll_length")


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ModificationSection(_Section):
    """One modification of the flanks of a gear; several add up.

    Reliefs and crowning take their positive amount off the flank. The amount of a profile slope and the
    deviations of a measured profile are positive where there is more material, as measuring machines draw.
    """

    kind: Literal["tip relief", "root relief", "profile slope", "profile crowning", "measured profile"]
    amount: Deviation | None = None
    start_diameter: Diameter | None = None
    start_roll_angle: RollAngle | None = None
    start_roll_length: RollLength | None = None
    end_diameter: Diameter | None = None
    end_roll_angle: RollAngle | None = None
    end_roll_length: RollLength | None = None
    shape: Literal["linear", "parabolic"] | None = None
    power: Number(0.1, 20.0) | None = None
    file: Annotated[str, Field(max_length=1000)] | None = None
    roll_angles: Annotated[tuple[RollAngle, ...], Points] | None = None
    diameters: Annotated[tuple[Diameter, ...], Points] | None = None
    deviations: Annotated[tuple[Deviation, ...], Points] | None = None

    @model_validator(mode="after")
    def _belongs_together(self):
        measured = self.kind == "measured profile"
        relief = self.kind.endswith("relief")
        unused = [name for name in _MEASURED if not measured and getattr(self, name) is not None]
        laws = ("amount", *(f"{end}_{place}" for end in ("start", "end") for place in _PLACES))
        unused += [name for name in laws if measured and getattr(self, name) is not None]
        unused += [name for name in ("shape", "power") if not relief and getattr(self, name) is not None]
        if unused:
            raise refuse(f"a {self.kind} has no {' and no '.join(unused)}", code="E-MODIFICATION")
        if measured:
            _check_points(self)
        elif self.amount is None:
            raise refuse(f"a {self.kind} needs its amount", code="E-KEY-MISSING", remedy='amount = "10 um"')
        elif relief and not any(getattr(self, f"start_{place}") is not None for place in _PLACES):
            starts = "start_diameter, start_roll_angle or start_roll_length"
            raise refuse(f"a {self.kind} needs its start", code="E-KEY-MISSING", remedy=f"give {starts}")
        for end in ("start", "end"):
            given = [f"{end}_{place}" for place in _PLACES if getattr(self, f"{end}_{place}") is not None]
            if len(given) > 1:
                raise refuse(f"{' and '.join(given)} say the same", code="E-DUPLICATE", remedy="keep one")
        if self.shape is not None and self.power is not None:
            raise refuse("shape and power say the same", code="E-DUPLICATE", remedy="keep one of them")
        return self

    @property
    def exponent(self) -> float:
        """Power of a relief: as given, or 1 of a linear and 2 of a parabolic one."""
        return self.power if self.power is not None else 2.0 if self.shape == "parabolic" else 1.0


def _check_points(section: ModificationSection) -> None:
    """Refuse a measured profile without its columns; a file has been read into them before."""
    columns = [name for name in ("roll_angles", "diameters") if getattr(section, name) is not None]
    if len(columns) != 1 or section.deviations is None or section.file is not None:
        raise refuse(
            "a measured profile is a file, or deviations over either roll_angles or diameters",
            code="E-MODIFICATION",
            remedy='file = "profile.csv"',
        )
    count, places = len(section.deviations), getattr(section, columns[0])
    if count != len(places) or count < 2:
        message = f"{count} deviations over {len(places)} {columns[0]}"
        raise refuse(message, code="E-COUNT", limit="two or more, and as many of both")
    rising = {b > a for a, b in pairwise(places) if a != b}
    if len(rising) > 1 or len(set(places)) < count:
        raise refuse(f"{columns[0]} are neither ascending nor descending", code="E-RANGE")


class PlanetModificationSection(ModificationSection):
    """A modification of the planets' flanks: of those that touch the sun, the ring, or of both."""

    flank: Literal["sun side", "ring side", "both"] = "both"


class CarrierErrors(_Section):
    """Eccentricity of the circle of the planet pins."""

    runout_amplitude: Amplitude | None = None
    runout_phase: Phase | None = None


class GearErrors(CarrierErrors):
    """Errors of a gear: pitch, runout and tooth thickness; teeth are numbered counter-clockwise from 0.

    ``cumulative_pitch`` holds the displacement of every tooth along the reference circle, counter-clockwise
    positive, ``pitch`` the deviations of the pitches between tooth i - 1 and tooth i, which add up to zero.
    """

    pitch: Annotated[tuple[Deviation, ...], Field(max_length=5000)] | None = None
    cumulative_pitch: Annotated[tuple[Deviation, ...], Field(max_length=5000)] | None = None
    thickness_reduction: Deviation | None = None

    @model_validator(mode="after")
    def _pitch_once(self):
        if self.pitch is not None and self.cumulative_pitch is not None:
            raise refuse("pitch and cumulative_pitch say the same", code="E-DUPLICATE", remedy="keep one")
        return self


class IndividualPlanet(GearErrors):
    """Errors of one planet, in place of those that all planets have."""

    planet: Count(1, 1000)


class OvalitySection(_Section):
    """Out-of-roundness of the ring, ``amplitude cos(nodal_diameter (angle - phase))`` outwards."""

    nodal_diameter: Count(1, 1000)
    amplitude: Amplitude
    phase: Phase = 0.0
    inextensional: StrictBool = False


class RingErrors(GearErrors):
    """Errors of the ring."""

    ovality: OvalitySection | None = None


class PinError(_Section):
    """Displacement of the axis of one planet: radial outwards, tangential counter-clockwise positive."""

    planet: Count(1, 1000)
    radial: Deviation = 0.0
    tangential: Deviation = 0.0


def check_deviation_sections(case: Case):
    """What no entry shows alone: amounts against the module, numbers of teeth and planets."""
    most = LARGEST_DEVIATION * case.sun.module
    yield from _check_planets(case)
    for name in ("sun", "planet", "ring"):
        gear = getattr(case, name)
        tables = [] if gear.errors is None else [(f"{name}.errors", gear.errors)]
        if name == "planet":
            tables += [(f"planet.individual[{i}]", one) for i, one in enumerate(gear.individual)]
        for key, table in tables:
            yield from _check_pitch(key, table, gear.teeth, most)
    for key, value in _amounts(case):
        if abs(value) > most:
            yield CaseError(
                f"a deviation of {value * 1e6:.6g} um is not plausible",
                code="E-RANGE",
                key=key,
                limit=f"{LARGEST_DEVIATION} modules, {most * 1e6:.6g} um",
                remedy="check the unit",
            )


def _check_planets(case: Case):
    for key, tables in (
        ("planet.individual", case.planet.individual),
        ("set.pin_errors", case.set.pin_errors),
    ):
        seen = set()
        for i, table in enumerate(tables):
            if table.planet > case.set.planets:
                yield CaseError(
                    f"there is no planet {table.planet}",
                    code="E-RANGE",
                    key=f"{key}[{i}].planet",
                    value=table.planet,
                    limit=f"1 to {case.set.planets}",
                )
            if table.planet in seen:
                yield CaseError(
                    f"planet {table.planet} is given twice", code="E-DUPLICATE", key=f"{key}[{i}].planet"
                )
            seen.add(table.planet)


ROUNDING = 0.05e-6
"""What the sum of the pitch deviations may miss zero by for every tooth [m]: tenths of micrometres."""


def _check_pitch(key: str, table: GearErrors, teeth: int, most: float):
    for name in ("pitch", "cumulative_pitch"):
        values = getattr(table, name)
        if values is not None and len(values) != teeth:
            yield CaseError(
                f"{len(values)} pitch deviations for {teeth} teeth",
                code="E-COUNT",
                key=f"{key}.{name}",
                limit=f"{teeth} deviations",
            )
    total = math.fsum(table.pitch or ())
    if abs(total) > ROUNDING * teeth:
        yield CaseError(
            f"the pitch deviations add up to {total * 1e6:.6g} um; around the gear they must add up to zero",
            code="E-RANGE",
            key=f"{key}.pitch",
            limit=f"{ROUNDING * teeth * 1e6:.6g} um from rounding",
            remedy="subtract their mean, or give cumulative_pitch",
        )
    elif table.pitch:
        yield from _check_cumulative(f"{key}.pitch", table.pitch, most)


def _check_cumulative(key: str, pitch: tuple[float, ...], most: float):
    """Single pitches, each of them plausible, may still carry a tooth far away."""
    mean = math.fsum(pitch) / len(pitch)
    cumulative = list(accumulate(value - mean for value in pitch[1:]))
    largest = _largest(tuple(cumulative))
    if abs(largest) > most:
        yield CaseError(
            f"the single pitch deviations add up to {largest * 1e6:.6g} um at tooth "
            f"{cumulative.index(largest) + 1}",
            code="E-RANGE",
            key=key,
            limit=f"cumulative deviations of at most {LARGEST_DEVIATION} modules, {most * 1e6:.6g} um",
            remedy="check signs, order and unit of the list; it holds deviations from tooth to tooth",
        )


def _amounts(case: Case):
    """Keys and values [m] of all deviations."""
    for name in ("sun", "planet", "ring"):
        gear = getattr(case, name)
        for i, one in enumerate(gear.modifications):
            for entry in ("amount", "deviations"):
                yield f"{name}.modifications[{i}].{entry}", _largest(getattr(one, entry))
        yield from _error_amounts(f"{name}.errors", gear.errors)
    for i, one in enumerate(case.planet.individual):
        yield from _error_amounts(f"planet.individual[{i}]", one)
    yield from _error_amounts("carrier.errors", case.carrier.errors)
    if case.ring.errors is not None and case.ring.errors.ovality is not None:
        yield "ring.errors.ovality", case.ring.errors.ovality.amplitude
    for i, pin in enumerate(case.set.pin_errors):
        yield f"set.pin_errors[{i}].radial", pin.radial
        yield f"set.pin_errors[{i}].tangential", pin.tangential


def _error_amounts(key: str, table: CarrierErrors | None):
    for name in ("pitch", "cumulative_pitch", "thickness_reduction", "runout_amplitude"):
        yield f"{key}.{name}", _largest(getattr(table, name, None))


def _largest(value: float | tuple[float, ...] | None) -> float:
    """The value, or of several the one that is largest in size; 0 for none."""
    values = value if isinstance(value, tuple) else (value or 0.0,)
    return max(values, key=abs, default=0.0)
