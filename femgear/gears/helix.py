"""Helical teeth as spur teeth of two sections: the transverse one, and virtual gears of the normal one."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from femgear.gears.fillet import BasicRack
from femgear.gears.gear import Gear
from femgear.gears.involute import transverse_angle
from femgear.gears.planetary import close_set

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet


def transverse_rack(rack: BasicRack, helix_angle: float) -> BasicRack:
    """Basic rack in transverse modules of one in normal modules: coefficients times cos(beta).

    Heights are the same lengths in both sections (ISO 21771, section 4.2). The tool's tip is an ellipse in
    the transverse section; the circle in its place keeps the radius of the normal section.
    """
    factor = math.cos(helix_angle)
    return BasicRack(
        addendum=rack.addendum * factor,
        dedendum=rack.dedendum * factor,
        root_radius=rack.root_radius * factor,
    )


def transverse_tool(module: float, pressure_angle: float, helix_angle: float) -> tuple[float, float]:
    """Transverse module [m] and pressure angle [rad] of normal ones.

    ``m_t = m_n / cos(beta)``, ``tan(alpha_t) = tan(alpha_n) / cos(beta)`` (ISO 21771, section 4.2).
    """
    return module / math.cos(helix_angle), transverse_angle(pressure_angle, helix_angle)


def virtual_teeth(gears: PlanetarySet, helix_angle: float) -> tuple[int, int, int]:
    """Whole tooth numbers next to ``z / cos^3(beta)`` of sun, planet and ring."""
    cube = math.cos(helix_angle) ** 3
    return tuple(round(gear.teeth / cube) for gear in (gears.sun, gears.planet, gears.ring))


def virtual_set(gears: PlanetarySet, helix_angle: float) -> PlanetarySet:
    """Spur gears of the normal section: one planet, whole tooth numbers next to ``z / cos^3(beta)``.

    The normal section cuts the reference cylinder in an ellipse with the radius of curvature
    ``r / cos^2(beta)`` at the tooth (G. Niemann and H. Winter, Maschinenelemente, vol. 2, section 21.3).
    Rims keep their thickness beside the roots. The ring's profile shift is found, which takes up that the
    tooth numbers were rounded.

    Parameters
    ----------
    gears : PlanetarySet
        Of the transverse section.
    helix_angle : float
        [rad]

    Returns
    -------
    PlanetarySet

    Raises
    ------
    GeometryError
        Where virtual gears cannot be made.
    """
    teeth = virtual_teeth(gears, helix_angle)
    made = (_virtual(gear, z, helix_angle) for gear, z in zip((gears.sun, gears.planet, gears.ring), teeth))
    return close_set(*made, planet_angles=(0.0,), find=("ring",))


def _virtual(gear: Gear, teeth: int, helix_angle: float) -> Gear:
    factor = math.cos(helix_angle)
    rack, module = gear.rack, gear.module * factor
    radius = 0.5 * module * teeth
    made = Gear(
        teeth=teeth,
        module=module,
        pressure_angle=math.atan(math.tan(gear.pressure_angle) * factor),
        profile_shift=gear.profile_shift / factor,
        face_width=gear.face_width,
        # replaced below, once the root circle is known
        rim_radius=2.0 * radius if gear.internal else 0.2 * radius,
        internal=gear.internal,
        rack=BasicRack(
            addendum=rack.addendum / factor,
            dedendum=rack.dedendum / factor,
            root_radius=rack.root_radius / factor,
        ),
        tip_diameter=_moved(gear.tip_diameter, gear, radius),
        root_diameter=_moved(gear.root_diameter, gear, radius),
        thickness_allowance=gear.thickness_allowance * factor,
        name=gear.name,
    )
    return replace(made, rim_radius=made.root_radius + gear.rim_radius - gear.root_radius)


def _moved(diameter: float | None, gear: Gear, radius: float) -> float | None:
    """A given diameter as far from the virtual reference circle as it was from the true one."""
    return None if diameter is None else diameter + 2.0 * (radius - gear.reference_radius)
