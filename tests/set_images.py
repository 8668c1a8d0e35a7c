"""Planetary sets whose solution follows from that of another: larger, stiffer, mirrored, turned, renumbered.

Each function makes a case from a case of `random_sets`, whose entries are texts with a unit.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.case.planetary import Case
from femgear.gears.planetary import equal_planet_angles
from femgear.trains.reading import parse_case, with_values

# powers of length, and of mass at equal times, in the units of a case
POWERS = {
    "m": (1, 0),
    "mm": (1, 0),
    "um": (1, 0),
    "Pa": (0, 1),
    "kg/m^3": (0, 1),
    "kg": (3, 1),
    "kg m^2": (5, 1),
    "N/m": (1, 1),
    "N/m^3": (-1, 1),
    "N m": (3, 1),
    "N m/rad": (3, 1),
    "rpm": (-1, 0),
    "Hz": (-1, 0),
    "deg": (0, 0),
    "rad": (0, 0),
}


def larger(case: Case, factor: float) -> Case:
    """All lengths so many times as large, of the same materials and under the same stresses.

    Forces then grow with the square of the factor, torques, masses and torsional stiffnesses with its third
    power, moments of inertia with its fifth, stiffnesses with the first, foundations per area with its
    inverse, as frequencies. Tips that femgear shortens are at multiples of 0.1 um, whatever the size of the
    set: the larger one is given those of the smaller.
    """
    set_of_case = planetary_set(case)
    gears = zip(case.gear_names, set_of_case.gears, strict=True)
    tips = {name: 2.0 * factor * gear.tip_radius for name, gear in gears if gear.tip_shortening > 0.0}
    changed = {f"{name}.tip_diameter": f"{diameter!r} m" for name, diameter in tips.items()}
    return with_values(_scaled(case, lambda unit: factor ** POWERS[unit][0]), changed)


def stiffer(case: Case, factor: float) -> Case:
    """Moduli, densities, masses, stiffnesses and torques so many times as large: nothing moves otherwise."""
    return _scaled(case, lambda unit: factor ** POWERS[unit][1])


def mirrored(case: Case) -> Case:
    """The set in a mirror through x and the axis, its statics: torque, angles and hand are the other ones.

    Its planets stand in the order of `mirrored_planets`.
    """
    order = mirrored_planets(case.set.planets)
    changed = _planets_at(case, [-angle for angle in _angles(case)], order)
    changed["operation.torque"] = f"{-case.operation.torque!r} N m"
    if case.set.helix_angle:
        changed["set.helix_angle"] = f"{-case.set.helix_angle!r} rad"
    if (askew := case.sun.misalignment) is not None:
        changed["sun.misalignment"] = {"x": f"{askew.x!r} rad", "y": f"{-askew.y!r} rad"}
    for i, one in enumerate(case.planet.misalignment):
        changed[f"planet.misalignment[{i}].tangential"] = f"{-one.tangential!r} rad"
    return with_values(case, changed)


def mirrored_planets(planets: int) -> list[int]:
    """Numbers (from 0) in the original of the planets of its mirror image: the first is the first."""
    return [0, *range(planets - 1, 0, -1)]


def renumbered(case: Case, by: int) -> Case:
    """The same set, its planets counted from another one; planet `by` (from 0) is the first."""
    order = [(by + n) % case.set.planets for n in range(case.set.planets)]
    return with_values(case, _planets_at(case, _angles(case), order))


def turned(case: Case, angle: float) -> Case:
    """The whole set, with sensor and supports, turned by an angle [rad]."""
    changed = _planets_at(case, [one + angle for one in _angles(case)], range(case.set.planets))
    changed["housing.sensor_angle"] = _degrees(case.housing.sensor_angle + angle)
    if (askew := case.sun.misalignment) is not None:
        x = askew.x * math.cos(angle) - askew.y * math.sin(angle)
        y = askew.x * math.sin(angle) + askew.y * math.cos(angle)
        changed["sun.misalignment"] = {"x": f"{x!r} rad", "y": f"{y!r} rad"}
    for i, one in enumerate(case.housing.support):
        changed[f"housing.support[{i}].angle"] = _degrees(one.angle + angle)
    return with_values(case, changed)


def _angles(case: Case) -> tuple[float, ...]:
    """Angles of the planets [rad]."""
    return tuple(case.set.planet_angles or equal_planet_angles(case.set.planets))


def _planets_at(case: Case, angles: Sequence[float], order: Sequence[int]) -> dict[str, object]:
    """Entries of planets at angles (N,) [rad], counted in another order, and of their axes.

    Angles of a case ascend, within one turn of the first and within two of zero.
    """
    first = -(-angles[order[0]] % (2.0 * math.pi))
    ascending = [first + (angles[n] - angles[order[0]]) % (2.0 * math.pi) for n in order]
    changed: dict[str, object] = {"set.planet_angles": [f"{math.degrees(one)!r} deg" for one in ascending]}
    for i, one in enumerate(case.planet.misalignment):
        changed[f"planet.misalignment[{i}].planet"] = list(order).index(one.planet - 1) + 1
    return changed


def _degrees(angle: float) -> str:
    """Text of an angle [rad], within half a turn."""
    return f"{math.degrees(math.remainder(angle, 2 * math.pi))!r} deg"


def _scaled(case: Case, factor: Callable[[str], float]) -> Case:
    """The case with all its entries times the factor of their unit."""

    def scaled(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: value[name] if name == "title" else scaled(value[name]) for name in value}
        if isinstance(value, list):
            return [scaled(one) for one in value]
        number, _, unit = value.partition(" ") if isinstance(value, str) else ("", "", "")
        return f"{float(number) * factor(unit)!r} {unit}" if unit in POWERS else value

    return parse_case(case_text.write(scaled(case_text.parse(case.source, case.name))), name=case.name)
