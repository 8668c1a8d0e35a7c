"""Sizes of the gears of a stage, from teeth or as given, and rolling bearings of sections that have their geometry."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.gears.planetary import equal_planet_angles
from femgear.gears.profile import base_helix_angle
from femgear.system.rolling_bearings import BallBearing, Bearing, RollerBearing
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxBearingSection,
    BoxPlanetarySection,
    GearboxCase,
    PairGearsSection,
    PairSection,
    SetGearsSection,
    teeth_of,
)

DISTANCE_TOLERANCE = 1e-5
"""Distance by which places that should be one may differ [m]."""
# Ratios of radii and teeth that differ by more belong to no gears.
_RATIO_TOLERANCE = 0.01


@dataclass(frozen=True)
class StageSizes:
    """Sizes of the gears of a stage.

    Parameters
    ----------
    teeth : tuple of int
        Of gear 1 and 2, or of sun, planet and ring.
    base_radii : tuple of float
        As many [m].
    centre_distance : float
        Of both axes, of sun and planet [m].
    pressure_angles : tuple of float
        Working ones in the transverse section: of the pair, or of sun-planet and planet-ring [rad].
    base_helix : float
        Base helix angle [rad], positive of a right-handed gear 1 or sun.
    internal : bool
        Whether gear 2 of a pair is internal.
    face_widths : tuple of float
        Of the gears [m]; zeros where not given.
    planet_angles : tuple of float
        Of a planetary set [rad], from its first planet.
    """

    teeth: tuple[int, ...]
    base_radii: tuple[float, ...]
    centre_distance: float
    pressure_angles: tuple[float, ...]
    base_helix: float = 0.0
    internal: bool = False
    face_widths: tuple[float, ...] = (0.0, 0.0)
    planet_angles: tuple[float, ...] = ()


def facing_gears(
    case: GearboxCase, stage: PairSection | BoxPlanetarySection
) -> Iterator[tuple[str, tuple[float, float], tuple[float, float]]]:
    """List the gears in mesh whose places are known: entry of a place, z of both middles and both face widths [m].

    Planets are where the carrier is. Where that is the casing, sun and ring face each other over the planets.
    """
    if isinstance(stage, PairSection):
        positions, widths = stage.positions or (0.0, 0.0), pair_sizes(stage).face_widths
        starts = [case.shaft_named(name).start for name in stage.shafts]
        yield "positions", (starts[0] + positions[0], starts[1] + positions[1]), (widths[0], widths[1])
        return
    width: dict[str, float] = dict(zip(("sun", "carrier", "ring"), set_sizes(stage).face_widths, strict=True))
    place = {
        name: case.shaft_named(shaft).start + (getattr(stage, f"{name}_position") or 0.0)
        for name in width
        if (shaft := getattr(stage, name)) != CASING
    }
    meshes = ("sun", "carrier"), ("ring", "carrier")
    for first, second in meshes if "carrier" in place else (("sun", "ring"),):
        if first in place and second in place:
            yield f"{first}_position", (place[first], place[second]), (width[first], width[second])


def pair_sizes(stage: PairSection) -> StageSizes:
    """Compute the sizes of the two gears of a stage.

    FemgearError: teeth that make no gears; sizes given in several ways (E-CHOICE), or unlike the teeth (E-TEETH).
    """
    teeth = teeth_of(stage)
    if teeth is not None:
        gears: Any = planetary_set(teeth)
        return StageSizes(
            tuple(gear.teeth for gear in gears.gears),
            tuple(gear.base_radius for gear in gears.gears),
            gears.centre_distance,
            (gears.working_pressure_angle,),
            _base_helix(teeth),
            gears.gear_2.internal,
            tuple(gear.face_width for gear in gears.gears),
        )
    given = stage.gears
    assert given is not None
    radii = _base_radii(given)
    _check_ratio(radii[1] / radii[0], given.teeth[1] / given.teeth[0])
    if given.internal and not radii[0] < radii[1]:
        raise CaseError(
            "the pinion does not fit into the internal gear",
            code="E-TEETH",
            key="teeth",
            value=list(given.teeth),
            limit="gear 2 is the internal one and has more teeth than gear 1",
            remedy="name the pinion first, in shafts, positions and teeth",
        )
    sign = -1.0 if given.internal else 1.0
    distance = abs(radii[0] + sign * radii[1]) / math.cos(given.pressure_angle)
    helix = math.atan(math.tan(given.helix_angle) * math.cos(given.pressure_angle))
    width = given.face_width or 0.0
    angle = (given.pressure_angle,)
    return StageSizes(tuple(given.teeth), radii, distance, angle, helix, given.internal, (width, width))


def _base_radii(given: PairGearsSection) -> tuple[float, float]:
    ways = given.given("module", "radii", "base_radii")
    if len(ways) != 1:
        raise CaseError(
            "the sizes of the gears are needed once",
            code="E-CHOICE",
            key=ways[0] if ways else "module",
            limit="module, radii or base_radii",
        )
    if given.base_radii is not None:
        return given.base_radii[0], given.base_radii[1]
    cosine = math.cos(given.pressure_angle)
    if given.radii is not None:
        return given.radii[0] * cosine, given.radii[1] * cosine
    first, second = (0.5 * (given.module or 0.0) * teeth * cosine for teeth in given.teeth)
    return first, second


def set_sizes(stage: BoxPlanetarySection) -> StageSizes:
    """Compute the sizes of sun, planets and ring of a stage.

    FemgearError: as `pair_sizes`; radii and distance that leave no working pressure angle (E-CENTRE-DISTANCE).
    """
    teeth = teeth_of(stage)
    if teeth is not None:
        gears: Any = planetary_set(teeth)
        return StageSizes(
            tuple(gear.teeth for gear in gears.gears),
            tuple(gear.base_radius for gear in gears.gears),
            gears.centre_distance,
            (gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring),
            _base_helix(teeth),
            False,
            tuple(gear.face_width for gear in gears.gears),
            gears.planet_angles,
        )
    given = stage.gears
    assert given is not None
    return _given_set(given)


def _given_set(given: SetGearsSection) -> StageSizes:
    ways = given.given("module", "base_radii")
    if len(ways) != 1:
        limit = "module, or base_radii"
        raise CaseError("the sizes of the gears are needed once", code="E-CHOICE", key="module", limit=limit)
    angles = given.pressure_angles or (math.radians(20.0), math.radians(20.0))
    if given.base_radii is not None:
        sun, planet, ring = given.base_radii
        _check_ratio(ring / sun, given.teeth[2] / given.teeth[0])
        _check_ratio(planet / sun, given.teeth[1] / given.teeth[0])
    else:
        half = 0.5 * (given.module or 0.0) * math.cos(angles[0])
        sun, planet, ring = (half * teeth for teeth in given.teeth)
    distance = given.centre_distance or (sun + planet) / math.cos(angles[0])
    shares = (sun + planet) / distance, (ring - planet) / distance
    if given.pressure_angles is None or given.centre_distance is not None:
        if not all(0.5 < share <= 1.0 for share in shares):
            raise CaseError(
                "at this distance of the axes sun, planet and ring do not mesh",
                code="E-CENTRE-DISTANCE",
                key="centre_distance",
                value=f"{1e3 * distance:.6g} mm",
                limit=f"above {1e3 * max(sun + planet, ring - planet):.6g} mm",
            )
        angles = math.acos(shares[0]), math.acos(shares[1])
    helix = math.atan(math.tan(given.helix_angle) * math.cos(angles[0]))
    psi = given.planet_angles or equal_planet_angles(given.planets)
    width = given.face_width or 0.0
    return StageSizes(tuple(given.teeth), (sun, planet, ring), distance, tuple(angles), helix, False, (width,) * 3, psi)


def carriers(case: GearboxCase) -> dict[str, str]:
    """Name the carrier of every shaft that is a planet: beside the axis of the carrier that its pairs name."""
    shafts = {shaft.name: shaft.axis for shaft in case.shaft}
    return {
        shaft: stage.carrier
        for stage in case.pair
        if stage.carrier in shafts
        for shaft in stage.shafts
        if shaft in shafts and math.dist(shafts[shaft], shafts[stage.carrier]) > DISTANCE_TOLERANCE
    }


def planet_radius(sizes: StageSizes) -> float:
    """Compute the pitch radius of planets in mesh with the sun [m]."""
    sun, planet, _ = sizes.base_radii
    return sizes.centre_distance * planet / (sun + planet)


def planet_distance(sizes: StageSizes) -> float:
    """Compute the distance of the axes of the nearest neighbouring planets [m]."""
    angles = sorted(angle % (2.0 * math.pi) for angle in sizes.planet_angles)
    apart = min(b - a for a, b in pairwise((*angles, angles[0] + 2.0 * math.pi)))
    return 2.0 * sizes.centre_distance * math.sin(0.5 * min(apart, math.pi))


def _check_ratio(radii: float, teeth: float) -> None:
    if abs(radii / teeth - 1.0) > _RATIO_TOLERANCE:
        raise CaseError(
            f"the teeth have the ratio {teeth:.6g}, the radii {radii:.6g}",
            code="E-TEETH",
            key="teeth",
            limit=f"ratios within {percent(_RATIO_TOLERANCE, 1)} of one another",
            remedy="correct the teeth or the radii, or give module in place of the radii",
        )


def _base_helix(teeth: Any) -> float:
    return base_helix_angle(teeth.pressure_angle, teeth.helix_angle or 0.0)


def rolling_bearing(section: BoxBearingSection) -> Bearing:
    """Make the rolling bearing of a section that has a kind.

    CaseError: numbers that no bearing can have (E-BEARING).
    """
    count, size = section.rolling_elements, section.element_diameter
    assert count is not None and size is not None and section.pitch_diameter is not None
    common = {
        "contact_angle": section.contact_angle,
        "clearance": section.clearance,
        "axial_preload": section.preload,
        "rows": section.rows,
        "row_distance": section.row_distance,
    }
    if section.kind == "ball":
        return BallBearing(
            count,
            size,
            section.pitch_diameter,
            inner_osculation=section.inner_osculation,
            outer_osculation=section.outer_osculation,
            **common,
        )
    assert section.kind is not None and section.effective_length is not None
    return RollerBearing(section.kind, count, section.effective_length, section.pitch_diameter, size, **common)
