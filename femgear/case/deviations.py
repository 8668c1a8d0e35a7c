"""Sections of a case file that hold deviations: modifications of flanks and errors of members."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from femgear.case.fields import Count, Number, Quantity, Section
from femgear.case.units import ANGLE, LENGTH
from femgear.errors import CaseError

LARGEST_DEVIATION = 0.2
"""Largest plausible amount of any modification or error, in modules."""
MOST_POINTS = 2000
"""Points of a measured profile; machines write some hundreds."""
ROUNDING = 0.05e-6
"""What the sum of the pitch deviations may miss zero by for every tooth [m]: tenths of micrometres."""

Deviation = Annotated[float, Quantity(LENGTH, -0.02, 0.02)]
Amplitude = Annotated[float, Quantity(LENGTH, 0.0, 0.02)]
Phase = Annotated[float, Quantity(ANGLE, -2 * math.pi, 2 * math.pi)]
Diameter = Annotated[float, Quantity(LENGTH, 1e-4, 20.0)]
RollAngle = Annotated[float, Quantity(ANGLE, 0.0, 4 * math.pi)]
RollLength = Annotated[float, Quantity(LENGTH, 0.0, 10.0)]
Points = Field(max_length=MOST_POINTS)

_MEASURED = ("file", "roll_angles", "diameters", "deviations")
_PLACES = ("diameter", "roll_angle", "roll_length")


class ModificationSection(Section):
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
    power: Annotated[float, Number(0.1, 20.0)] | None = None
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
            raise CaseError(f"a {self.kind} has no {' and no '.join(unused)}", code="E-MODIFICATION")
        if measured:
            _check_points(self)
        elif self.amount is None:
            raise CaseError(
                f"a {self.kind} needs its amount", code="E-KEY-MISSING", remedy='amount = "10 um"'
            )
        elif relief and not any(getattr(self, f"start_{place}") is not None for place in _PLACES):
            starts = "start_diameter, start_roll_angle or start_roll_length"
            raise CaseError(f"a {self.kind} needs its start", code="E-KEY-MISSING", remedy=f"give {starts}")
        for end in ("start", "end"):
            given = [f"{end}_{place}" for place in _PLACES if getattr(self, f"{end}_{place}") is not None]
            if len(given) > 1:
                raise CaseError(f"{' and '.join(given)} say the same", code="E-DUPLICATE", remedy="keep one")
        if self.shape is not None and self.power is not None:
            raise CaseError("shape and power say the same", code="E-DUPLICATE", remedy="keep one of them")
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
    columns = [name for name in ("roll_angles", "diameters") if getattr(section, name) is not None]
    if len(columns) != 1 or section.deviations is None or section.file is not None:
        raise CaseError(
            "a measured profile is a file, or deviations over either roll_angles or diameters",
            code="E-MODIFICATION",
            remedy='file = "profile.csv"',
        )
    count, places = len(section.deviations), getattr(section, columns[0])
    if count != len(places) or count < 2:
        message = f"{count} deviations over {len(places)} {columns[0]}"
        raise CaseError(message, code="E-COUNT", limit="two or more, and as many of both")
    rising = {b > a for a, b in pairwise(places) if a != b}
    if len(rising) > 1 or len(set(places)) < count:
        raise CaseError(f"{columns[0]} are neither ascending nor descending", code="E-RANGE")


class CarrierErrors(Section):
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
            raise CaseError("pitch and cumulative_pitch say the same", code="E-DUPLICATE", remedy="keep one")
        return self


class IndividualPlanet(GearErrors):
    """Errors of one planet, in place of those that all planets have."""

    planet: Annotated[int, Count(1, 1000)]


class OvalitySection(Section):
    """Out-of-roundness of the ring, ``amplitude cos(nodal_diameter (angle - phase))`` outwards."""

    nodal_diameter: Annotated[int, Count(1, 1000)]
    amplitude: Amplitude
    phase: Phase = 0.0
    inextensional: StrictBool = False


class RingErrors(GearErrors):
    """Errors of the ring."""

    ovality: OvalitySection | None = None


class PinError(Section):
    """Displacement of the axis of one planet: radial outwards, tangential counter-clockwise positive."""

    planet: Annotated[int, Count(1, 1000)]
    radial: Deviation = 0.0
    tangential: Deviation = 0.0
