"""The case file with ``model = "gear_pair"``: two gears, their mesh, and what is computed."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from femgear.case.quantities import (
    LENGTH,
    PAIR,
    STIFFNESS,
    TORQUE,
    Count,
    Number,
    Quantity,
    Section,
    Title,
    Values,
)
from femgear.case.sections import FORMAT, Angle, DampingRatio, Inertia, Mass, Radius, Stiffness, Teeth
from femgear.case.text import CaseFile, ReadCase
from femgear.errors import CaseError
from femgear.trains.impacts.model import ImpactPair, PairBearings

Ratio = Annotated[float, Number(1e-3, 100.0)]
Steps = Annotated[int, Count(20, 10_000)]
_MOST_WAVES = 50


class GearsSection(Section):
    """The driving and the driven gear: two entries of each."""

    teeth: Annotated[tuple[Teeth, ...], PAIR]
    inertia: Annotated[tuple[Inertia, ...], PAIR]
    base_radii: Annotated[tuple[Radius, ...], PAIR]
    eccentricity: Annotated[tuple[Annotated[float, Quantity(LENGTH, 0.0, 0.01)], ...], PAIR] = (0.0, 0.0)
    eccentricity_angles: Annotated[tuple[Angle, ...], PAIR] = (0.0, 0.0)
    mass: Annotated[tuple[Mass, ...], PAIR] | None = None
    bearing_stiffness: Annotated[tuple[Stiffness, ...], PAIR] | None = None
    bearing_damping_ratio: DampingRatio = 0.0


class ImpactMeshSection(Section):
    """Mesh stiffness, backlash, damping, tooth error; waves are harmonics of the tooth frequency, from 1."""

    stiffness: Annotated[float, Quantity(STIFFNESS, 1e3, 1e13)]
    stiffness_waves: Annotated[tuple[Annotated[float, Number(-1.0, 1.0)], ...], Values(max_length=_MOST_WAVES)] = ()
    stiffness_angles: Annotated[tuple[Angle, ...], Values(max_length=_MOST_WAVES)] = ()
    backlash: Annotated[float, Quantity(LENGTH, 1e-7, 0.05)]
    damping_ratio: DampingRatio
    error: Annotated[tuple[Annotated[float, Quantity(LENGTH, -1e-3, 1e-3)], ...], Values(max_length=_MOST_WAVES)] = ()
    error_angles: Annotated[tuple[Angle, ...], Values(max_length=_MOST_WAVES)] = ()


class ImpactOperationSection(Section):
    """Torque on the driving gear; a positive one presses the drive flanks together."""

    torque: Annotated[float, Quantity(TORQUE, -1e9, 1e9)]


class ImpactResponseSection(Section):
    """Periodic motions over the frequency ratio by harmonic balance, from one end to the other."""

    start: Ratio = Field(default=3.5, alias="from")
    to: Ratio = 0.1
    harmonics: Annotated[int, Count(1, 100)] = 12
    largest_step: Annotated[float, Number(1e-4, 1.0)] = 0.02


class RatioRange(Section):
    """Equally spaced frequency ratios, both ends among them."""

    start: Ratio = Field(alias="from")
    to: Ratio
    count: Annotated[int, Count(2, 10_000)]


class SweepSection(Section):
    """Integration in time over ascending ratios and back, at each until the motion repeats."""

    ranges: Annotated[tuple[RatioRange, ...], Field(min_length=1, max_length=20)]
    steps: Steps = 100
    most_periods: Annotated[int, Count(5, 100_000)] = 300


class ChaosSection(RatioRange):
    """Lyapunov exponents over the ratio, each from the end of the motion before, and sections."""

    points: Annotated[int, Count(8, 100_000)] = 100
    skip: Annotated[int, Count(0, 100_000)] = 60
    steps: Steps = 100
    sections: Annotated[tuple[Ratio, ...], Values(max_length=6)] = ()


class GearPairCase(Section, ReadCase):
    """A gear pair with backlash, its load and what is computed of it, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case.
    """

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    train: ClassVar[str] = "gear_pair"
    model: Literal["gear_pair"]
    title: Title
    gears: GearsSection
    mesh: ImpactMeshSection
    operation: ImpactOperationSection
    response: ImpactResponseSection = ImpactResponseSection()
    sweep: SweepSection | None = None
    chaos: ChaosSection | None = None


def check_impact_entries(case: GearPairCase) -> Iterator[CaseError]:
    """Refuse what no entry shows alone."""
    mesh, gears = case.mesh, case.gears
    for wave, angles in (("stiffness_waves", "stiffness_angles"), ("error", "error_angles")):
        count, given = len(getattr(mesh, wave)), len(getattr(mesh, angles))
        if given not in (0, count):
            yield CaseError(
                f"{given} angles of {count} harmonics",
                code="E-COUNT",
                key=f"mesh.{angles}",
                limit=f"none, or {count}, one for each entry of mesh.{wave}",
            )
    # k(t) of no sign change whatever the angles are
    if (size := sum(abs(amplitude) for amplitude in mesh.stiffness_waves)) >= 1.0:
        yield CaseError(
            "the mesh stiffness may turn negative",
            code="E-RANGE",
            key="mesh.stiffness_waves",
            value=f"{size:.4g} in sum",
            limit="a sum of the amplitudes below 1, the mean",
        )
    if (gears.mass is None) != (gears.bearing_stiffness is None):
        yield CaseError(
            "bearings need the masses of both gears and both stiffnesses",
            code="E-KEY-MISSING",
            key="gears.mass" if gears.mass is None else "gears.bearing_stiffness",
            remedy="add it, or leave both out: axes that are held",
        )
    if all(gears.eccentricity) and gears.teeth[0] == gears.teeth[1]:
        yield CaseError(
            "both gears are eccentric and turn with one frequency",
            code="E-RANGE",
            key="gears.eccentricity",
            value=", ".join(LENGTH.show(length) for length in gears.eccentricity),
            limit="one of them, or other teeth",
            remedy="give the sum of both to one gear",
        )
    if any(gears.eccentricity) and case.sweep is None and case.chaos is None:
        yield CaseError(
            "an eccentric gear leaves the stage response out, and nothing is computed",
            code="E-KEY-MISSING",
            key="sweep",
            remedy="add the section sweep, or chaos",
        )
    for key in ("response", "chaos"):
        range_ = getattr(case, key)
        if range_ is not None and range_.start == range_.to:
            yield CaseError(
                "a range of one ratio",
                code="E-RANGE",
                key=f"{key}.to",
                value=range_.to,
                limit="another ratio than from",
            )


@dataclass(frozen=True)
class PairScales:
    """Units of the equations without dimension: what counts as one.

    ``length`` is half the backlash b [m], ``frequency`` the natural angular frequency
    omega_n [rad/s], ``force`` k b [N].
    """

    length: float
    frequency: float
    force: float


def scales_of(case: GearPairCase) -> PairScales:
    """Find half backlash [m], natural angular frequency [rad/s] and force [N] that count as one."""
    gears, mesh = case.gears, case.mesh
    mass = 1.0 / sum(r * r / i for r, i in zip(gears.base_radii, gears.inertia))
    return PairScales(0.5 * mesh.backlash, math.sqrt(mesh.stiffness / mass), 0.5 * mesh.stiffness * mesh.backlash)


def pair_of(case: GearPairCase) -> ImpactPair:
    """Make the dimensionless pair of a case."""
    gears, mesh, scales = case.gears, case.mesh, scales_of(case)
    bearings = None
    if gears.mass is not None and gears.bearing_stiffness is not None:
        equivalent = mesh.stiffness / scales.frequency**2
        bearings = PairBearings(
            mass=tuple(mass / equivalent for mass in gears.mass),
            stiffness=tuple(stiffness / mesh.stiffness for stiffness in gears.bearing_stiffness),
            damping_ratio=gears.bearing_damping_ratio,
        )
    error = [length / scales.length for length in mesh.error]
    eccentricity = [length / scales.length for length in gears.eccentricity]
    first, second = _waves(eccentricity, gears.eccentricity_angles)
    return ImpactPair(
        damping_ratio=mesh.damping_ratio,
        load=case.operation.torque / gears.base_radii[0] / scales.force,
        stiffness=_waves(mesh.stiffness_waves, mesh.stiffness_angles),
        tooth_error=_waves(error, mesh.error_angles),
        eccentricity=(first, second),
        teeth=gears.teeth,
        bearings=bearings,
    )


def _waves(amplitudes, angles) -> tuple[complex, ...]:
    """Complex amplitudes; without angles all are cosines."""
    return tuple(a * cmath.exp(1j * angle) for a, angle in zip(amplitudes, angles or [0.0] * len(amplitudes)))


FILE = CaseFile(GearPairCase, check_impact_entries)
