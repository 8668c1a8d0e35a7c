"""Sections of flanks: modifications, errors of gears and planets, axes askew.

Every entry has its type and its plausible window, as in `femgear.case.sections`.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, fields
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femgear.case.quantities import ANGLE, LENGTH, Count, Number, Quantity, Section, Values
from femgear.errors import CaseError
from femgear.gears.modifications import LeadModification, Modification

MOST_POINTS = 2000
"""Points of a measured profile; machines write some hundreds."""
Deviation = Annotated[float, Quantity(LENGTH, -0.02, 0.02)]
Amplitude = Annotated[float, Quantity(LENGTH, 0.0, 0.02)]
Angle = Annotated[float, Quantity(ANGLE, -2 * math.pi, 2 * math.pi)]
Diameter = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]
RollAngle = Annotated[float, Quantity(ANGLE, 0.0, 4 * math.pi)]
RollLength = Annotated[float, Quantity(LENGTH, 0.0, 10.0)]
Place = Annotated[float, Quantity(LENGTH, -2.5, 2.5)]
"""Over the face width, from its middle."""
Points, Pitches = (Values(max_length=most) for most in (MOST_POINTS, 5000))
_MEASURED = ("file", "roll_angles", "diameters", "places", "deviations")
_PLACES = ("diameter", "roll_angle", "roll_length")
LARGEST_SLOPE = 0.02
Slope = Annotated[float, Quantity(ANGLE, -LARGEST_SLOPE, LARGEST_SLOPE)]
OVER_WIDTH = tuple(kind for kind, law in Modification.kinds.items() if issubclass(law, LeadModification))


class ModificationSection(Section):
    """One modification of the flanks of a gear; several add up.

    Reliefs and crowning take their positive amount off the flank. The amount of a profile slope and the
    deviations of a measured profile are positive where there is more material, as measuring machines draw.
    """

    kind: Literal[
        "tip relief",
        "root relief",
        "profile slope",
        "profile crowning",
        "measured profile",
        "lead slope",
        "lead crowning",
        "end relief",
        "flank twist",
        "measured lead",
    ]
    amount: Deviation | None = None
    length: Annotated[float, Quantity(LENGTH, 1e-5, 2.5)] | None = None
    start_diameter: Diameter | None = None
    start_roll_angle: RollAngle | None = None
    start_roll_length: RollLength | None = None
    end_diameter: Diameter | None = None
    end_roll_angle: RollAngle | None = None
    end_roll_length: RollLength | None = None
    shape: Literal["linear", "parabolic"] | None = None
    power: Annotated[float, Number(0.1, 20.0)] | None = None
    file: Annotated[str, Field(max_length=1000)] | None = None
    roll_angles: Annotated[tuple[RollAngle, ...], Points] | None = None
    diameters: Annotated[tuple[Diameter, ...], Points] | None = None
    places: Annotated[tuple[Place, ...], Points] | None = None
    deviations: Annotated[tuple[Deviation, ...], Points] | None = None

    @model_validator(mode="after")
    def _belongs_together(self):
        law: Any = Modification.kinds[self.kind]
        # the fields of the law, and whether each must be given
        entries = {field.name: field.default is MISSING for field in fields(law)}
        starts, ends = ([f"{end}_{place}" for place in _PLACES] for end in ("start", "end"))
        unused = self.given("amount", *starts, *ends) if law.measured else self.given(*_MEASURED)
        unused += [] if law.measured or "start" in entries else self.given(*starts, *ends)
        unused += [] if "power" in entries else self.given("shape", "power")
        unused += [] if "length" in entries else self.given("length")
        if unused:
            message = f"{self.kind} has no {' and no '.join(unused)}"
            raise CaseError(message, code="E-MODIFICATION", remedy=f"leave out {', '.join(unused)}")
        if law.measured:
            _check_points(self)
        elif self.amount is None:
            raise CaseError(f"{self.kind}: the amount is missing", code="E-KEY-MISSING", remedy='amount = "10 um"')
        elif "length" in entries and self.length is None:
            raise CaseError(f"{self.kind}: the length is missing", code="E-KEY-MISSING", remedy='length = "3 mm"')
        elif entries.get("start") and not self.given(*starts):
            remedy = "give start_diameter, start_roll_angle or start_roll_length"
            raise CaseError(f"{self.kind}: the start is missing", code="E-KEY-MISSING", remedy=remedy)
        for names in (starts, ends, ("shape", "power")):
            if len(given := self.given(*names)) > 1:
                raise CaseError(f"{' and '.join(given)} say the same", code="E-DUPLICATE", remedy="keep one")
        return self

    @property
    def exponent(self) -> float:
        """Power of a relief: as given, or 1 of a linear and 2 of a parabolic one."""
        return self.power if self.power is not None else 2.0 if self.shape == "parabolic" else 1.0


class PlanetModificationSection(ModificationSection):
    """A modification of the planets' flanks: of those that touch the sun, the ring, or of both."""

    flank: Literal["sun side", "ring side", "both"] = "both"


def _check_points(section: ModificationSection) -> None:
    """Refuse a measured profile without its columns; a file has been read into them before."""
    columns, lead = section.given("roll_angles", "diameters", "places"), section.kind == "measured lead"
    deviations = section.deviations or ()
    wrong = len(columns) != 1 or section.deviations is None or section.file is not None
    if lead and (wrong or columns != ["places"]):
        raise CaseError(
            "a measured lead is a file, or deviations over places",
            code="E-MODIFICATION",
            remedy='places = ["-9 mm", "9 mm"] from the middle of the width, deviations = ["0 um", "3 um"]',
        )
    if wrong or (columns == ["places"]) != lead:
        raise CaseError(
            "a measured profile is a file, or deviations over either roll_angles or diameters",
            code="E-MODIFICATION",
            remedy='file = "profile.csv"',
        )
    count, places = len(deviations), getattr(section, columns[0])
    if count != len(places) or count < 2:
        message = f"{count} deviations over {len(places)} {columns[0]}"
        raise CaseError(message, code="E-COUNT", limit="two or more, and as many of both")
    rising = {b > a for a, b in pairwise(places) if a != b}
    if len(rising) > 1 or len(set(places)) < count:
        message = f"{columns[0]} are neither ascending nor descending"
        raise CaseError(message, code="E-RANGE", remedy="sort the points, and keep one of every place")


class CarrierErrors(Section):
    """Eccentricity of the circle of the planet pins."""

    runout_amplitude: Amplitude | None = None
    runout_phase: Angle | None = None


class GearErrors(CarrierErrors):
    """Errors of a gear: pitch, runout and tooth thickness; teeth are numbered counter-clockwise from 0.

    ``cumulative_pitch`` holds the displacement of every tooth along the reference circle, counter-clockwise
    positive, ``pitch`` the deviations of the pitches between tooth i - 1 and tooth i, which add up to zero.
    """

    pitch: Annotated[tuple[Deviation, ...], Pitches] | None = None
    cumulative_pitch: Annotated[tuple[Deviation, ...], Pitches] | None = None
    thickness_reduction: Deviation | None = None

    @model_validator(mode="after")
    def _pitch_once(self):
        if self.pitch is not None and self.cumulative_pitch is not None:
            raise CaseError("pitch and cumulative_pitch say the same", code="E-DUPLICATE", remedy="keep one")
        return self


class IndividualPlanet(GearErrors):
    """Errors of one planet, in place of those that all planets have."""

    planet: Annotated[int, Count(1, 1000)]


class OvalitySection(Section):
    """Out-of-roundness of the ring, ``amplitude cos(nodal_diameter (angle - phase))`` outwards."""

    nodal_diameter: Annotated[int, Count(1, 1000)]
    amplitude: Amplitude
    phase: Angle = 0.0
    inextensional: StrictBool = False


class RingErrors(GearErrors):
    """Errors of the ring."""

    ovality: OvalitySection | None = None


class PinError(Section):
    """Displacement of the axis of one planet: radial outwards, tangential counter-clockwise positive."""

    planet: Annotated[int, Count(1, 1000)]
    radial: Deviation = 0.0
    tangential: Deviation = 0.0


class Misalignment(Section):
    """Slopes of the axis of sun or carrier along x and y of the carrier frame, in which they stand still.

    They are the rise of the axis along z; those of the carrier take its planets along.
    """

    x: Slope = 0.0
    y: Slope = 0.0


class PlanetMisalignment(Section):
    """Slope of the axis of one planet: radial outwards, tangential counter-clockwise, towards z > 0."""

    planet: Annotated[int, Count(1, 1000)]
    radial: Slope = 0.0
    tangential: Slope = 0.0
