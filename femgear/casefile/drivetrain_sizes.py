"""Sizes of the gears of a drivetrain case: radii, teeth, places of the planets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from femgear.casefile.drivetrain import DrivetrainCase, PlanetarySection
from femgear.errors import CaseError

# Ratios of radii and teeth that differ by more belong to no gears; profile shifts explain the rest.
RATIO_TOLERANCE = 0.01
# Teeth of a planet that profile shifts may add or take.
_SHIFTED = 2


def check_sizes(case: DrivetrainCase) -> Iterator[CaseError]:
    """Radii against teeth, and whether planets assemble beside one another."""
    for i, stage in enumerate(case.parallel):
        key, given = f"parallel[{i}]", given_of(stage, ("radii", "base_radii", "module"))
        if len(given) != 1:
            yield _one_of(f"{key}.{given[0] if given else 'radii'}", "radii, base_radii or module")
            continue
        radii = stage.radii or stage.base_radii
        if radii and (problem := _mismatch(radii[1] / radii[0], stage.teeth[1] / stage.teeth[0])):
            yield _unfit(f"{key}.teeth", problem)
    for i, stage in enumerate(case.planetary):
        yield from _planetary_sizes(stage, f"planetary[{i}]")


def _planetary_sizes(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    pitch = given_of(stage, ("sun_radius", "planet_radius"))
    base = given_of(stage, ("sun_base_radius", "planet_base_radius"))
    ways = [pitch, base, given_of(stage, ("module",))]
    if [len(way) for way in ways] not in ([2, 0, 0], [0, 2, 0], [0, 0, 1]):
        words = "sun_radius and planet_radius, sun_base_radius and planet_base_radius, or module"
        yield _one_of(f"{key}.{next((way[0] for way in ways if way), 'sun_radius')}", words)
    elif pitch or base:
        sun, planet = (getattr(stage, name) for name in (pitch or base))
        pairs = [("ring_teeth", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)]
        if stage.planet_teeth is not None:
            pairs.append(("planet_teeth", planet / sun, stage.planet_teeth / stage.sun_teeth))
        for name, radii, teeth in pairs:
            if problem := _mismatch(radii, teeth):
                yield _unfit(f"{key}.{name}", problem)
    elif stage.planet_teeth is not None:
        between = 0.5 * (stage.ring_teeth - stage.sun_teeth)
        if abs(stage.planet_teeth - between) > _SHIFTED:
            yield CaseError(
                "the planet has other teeth than fit between sun and ring", code="E-TEETH",
                key=f"{key}.planet_teeth", value=stage.planet_teeth,
                limit=f"{between:g}, or up to {_SHIFTED} more or less with profile shift",
            )  # fmt: skip
    if not stage.sun_teeth < stage.ring_teeth:
        yield CaseError(
            "the ring has no more teeth than the sun",
            code="E-TEETH",
            key=f"{key}.ring_teeth",
            value=stage.ring_teeth,
            limit=f"more than {stage.sun_teeth}",
        )
    yield from _assembly(stage, key)


def _assembly(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    both, angles = stage.ring_teeth + stage.sun_teeth, stage.planet_angles
    if angles is None:
        if both % stage.planets:
            yield CaseError(
                f"{stage.planets} equally spaced planets do not assemble",
                code="E-ASSEMBLY",
                key=f"{key}.planets",
                value=stage.planets,
                limit=f"a divisor of ring_teeth + sun_teeth = {both}",
            )
        yield from _neighbours(stage, key, 2.0 * math.pi / stage.planets)
        return
    if any(b <= a for a, b in pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi - 1e-9:
        yield CaseError(
            "the planet angles do not ascend within one turn", code="E-RANGE", key=f"{key}.planet_angles"
        )
    yield from _neighbours(stage, key, min(b - a for a, b in pairwise((*angles, angles[0] + 2.0 * math.pi))))
    steps = [(angle - angles[0]) * both / (2.0 * math.pi) for angle in angles]
    if any(abs(step - round(step)) > 1e-3 for step in steps):
        yield CaseError(
            "the planets do not assemble at these angles",
            code="E-ASSEMBLY",
            key=f"{key}.planet_angles",
            limit=f"whole multiples of 360 deg / {both} from one another",
        )


def _neighbours(stage: PlanetarySection, key: str, apart: float) -> Iterator[CaseError]:
    """Pitch circles of neighbouring planets must not overlap; sizes by the teeth."""
    share = (stage.ring_teeth - stage.sun_teeth) / (stage.ring_teeth + stage.sun_teeth)
    if share > 0.0 and math.sin(0.5 * min(apart, math.pi)) <= share:
        most = math.degrees(2.0 * math.asin(share))
        yield CaseError(
            "neighbouring planets overlap",
            code="E-NEIGHBOURS",
            key=f"{key}.{'planets' if stage.planet_angles is None else 'planet_angles'}",
            value=f"{math.degrees(apart):.4g} deg from one to the next",
            limit=f"more than {most:.4g} deg",
            remedy="take fewer planets, or smaller ones",
        )


def given_of(section, names) -> list[str]:
    """Those of the names that a section gives."""
    return [name for name in names if getattr(section, name) is not None]


def _one_of(key: str, words: str) -> CaseError:
    return CaseError("the sizes of the gears are needed once", code="E-CHOICE", key=key, limit=words)


def _mismatch(radii: float, teeth: float) -> str:
    if abs(teeth / radii - 1.0) <= RATIO_TOLERANCE:
        return ""
    return f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}"


def _unfit(key: str, message: str) -> CaseError:
    return CaseError(
        message,
        code="E-TEETH",
        key=key,
        limit=f"ratios within {RATIO_TOLERANCE:.0%} of one another",
        remedy="correct the teeth or the radii, or give module in place of the radii",
    )
