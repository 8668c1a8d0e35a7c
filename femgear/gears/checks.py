"""Can the set be assembled, and does it run: refusals with numbers, and warnings."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from femgear.errors import GeometryError
from femgear.gears import involute
from femgear.gears.gear import tooth_thickness
from femgear.gears.interference import check_interference
from femgear.gears.limits import GeometryWarning

if TYPE_CHECKING:
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

BACKLASH_TOLERANCE = 1e-4
"""Normal backlash, in modules, that counts as none: what four decimals of profile shifts leave open."""

ASSEMBLY_TOLERANCE = 1e-6
"""Part of a tooth pitch by which planet angles may miss an assembly position."""


def check_set(planetary: PlanetarySet) -> tuple[GeometryWarning, ...]:
    """Refuse a set that cannot be assembled or run, and list what deserves a warning.

    Parameters
    ----------
    planetary : PlanetarySet

    Returns
    -------
    tuple of GeometryWarning
        W-PLANETS (one or two planets), W-NEIGHBOURS, W-BACKLASH, W-FILLET, W-CONTACT-RATIO, W-CLEARANCE,
        W-UNDERCUT, W-TIP-THIN, W-RIM.

    Raises
    ------
    GeometryError
        E-ASSEMBLY, E-NEIGHBOURS, E-BACKLASH, E-INTERFERENCE, E-FILLET, E-TROCHOID, E-CLEARANCE,
        E-CONTACT-RATIO.
    """
    return (
        *_planets(planetary),
        *_neighbours(planetary),
        *_assembly(planetary),
        *_backlash(planetary),
        *check_interference(planetary),
        *_clearances(planetary),
        *_contact_ratios(planetary),
        *_single_gears(planetary),
    )


def feasible_angles(teeth_sum: int, angles: tuple[float, ...]) -> tuple[float, ...]:
    """Assembly positions [rad] nearest to wanted planet angles, counted from the first planet.

    Planets fit at multiples of ``2 pi / (z_s + z_r)`` from each other (Mueller, Epicyclic Drive Trains);
    ``teeth_sum`` is z_s + z_r.
    """
    step = 2.0 * math.pi / teeth_sum
    return tuple(angles[0] + math.floor((a - angles[0]) / step + 0.5 + 1e-9) * step for a in angles)


def neighbour_limit(sun_teeth: int, planet_teeth: int) -> float:
    """Number of equal planets, unshifted, whose tip circles would just touch.

    ``pi / asin((z_p + 2)/(z_s + z_p))``; infinite where the ratio exceeds one it is 1: not even two fit.
    """
    ratio = (planet_teeth + 2) / (sun_teeth + planet_teeth)
    return math.pi / math.asin(ratio) if ratio < 1.0 else 1.0


def tip_clearances(planetary: PlanetarySet) -> dict[str, float]:
    """Radial clearances [m] between tip and root circles, named by the gear whose tip it is and the mesh."""
    s, a = planetary, planetary.centre_distance
    return {
        "sun tip to planet root": a - s.sun.tip_radius - s.planet.root_radius,
        "planet tip to sun root": a - s.planet.tip_radius - s.sun.root_radius,
        "planet tip to ring root": s.ring.root_radius - a - s.planet.tip_radius,
        "ring tip to planet root": s.ring.tip_radius - a - s.planet.root_radius,
    }


def _planets(s: PlanetarySet):
    if s.n_planets < 3:
        yield GeometryWarning(
            "W-PLANETS",
            "set.planets",
            f"{s.n_planets} planet{'s' * (s.n_planets > 1)} leave{'s' * (s.n_planets == 1)} the radial mesh "
            "forces on sun and ring to their bearings; a floating member cannot balance the load",
            s.n_planets,
            ">= 3",
        )


def _assembly(s: PlanetarySet):
    total = s.sun.teeth + s.ring.teeth
    turns = [(a - s.planet_angles[0]) * total / (2.0 * math.pi) for a in s.planet_angles]
    worst = max(abs(t - round(t)) for t in turns)
    if worst > ASSEMBLY_TOLERANCE:
        wanted = feasible_angles(total, s.planet_angles)
        listing = ", ".join(f"{math.degrees(a):.6f}" for a in wanted[:24])
        raise GeometryError(
            f"{s.n_planets} planets do not assemble at these angles: {s.sun.teeth} + {s.ring.teeth} teeth "
            f"times the angle over one turn must be whole, one planet misses by {worst:.4f} teeth "
            f"((z_s + z_r)/N = {total / s.n_planets:.6g})",
            code="E-ASSEMBLY",
            key="set.planet_angles",
            value=f"{total / s.n_planets:.6g} teeth a planet",
            limit=f"multiples of {360.0 / total:.6f} deg from the first planet",
            remedy=f"nearest planet_angles that assemble: {listing} deg",
        )
    return ()


def _neighbours(s: PlanetarySet):
    if s.n_planets == 1:
        return
    angles = (*s.planet_angles, s.planet_angles[0] + 2.0 * math.pi)
    gaps = [b - a for a, b in pairwise(angles)]
    closest = min(gaps)
    room = 2.0 * s.centre_distance * math.sin(0.5 * min(closest, math.pi)) - 2.0 * s.planet.tip_radius
    if room <= 0.0:
        reach = s.planet.tip_radius / s.centre_distance
        most = math.ceil(math.pi / math.asin(reach)) - 1 if reach < 1.0 else 1
        raise GeometryError(
            f"neighbouring planets {math.degrees(closest):.4f} deg apart overlap by {-room * 1e3:.4f} mm "
            f"(tip radius {s.planet.tip_radius * 1e3:.4f} mm at {s.centre_distance * 1e3:.4f} mm)",
            code="E-NEIGHBOURS",
            key="set.planets",
            value=s.n_planets,
            limit=f"at most {most} equally spaced planets",
            remedy="use fewer planets, or fewer teeth on the planets",
        )
    if room < s.planet.module:
        yield GeometryWarning(
            "W-NEIGHBOURS",
            "set.planets",
            f"only {room * 1e3:.4f} mm are left between the tips of neighbouring planets",
            room,
            ">= one module",
        )


def _backlash(s: PlanetarySet):
    module = s.sun.module
    for mesh, value, gear in (
        ("sun-planet", s.backlash_sun_planet, s.sun),
        ("planet-ring", s.backlash_planet_ring, s.ring),
    ):
        if value < -BACKLASH_TOLERANCE * module:
            raise GeometryError(
                f"{mesh}: the flanks overlap by {-value * 1e6:.3f} um along the line of action at the centre "
                f"distance of {s.centre_distance * 1e3:.5f} mm (negative backlash)",
                code="E-BACKLASH",
                key=f"{gear.name}.profile_shift",
                value=gear.profile_shift,
                limit=f"normal backlash >= -{BACKLASH_TOLERANCE * module * 1e6:.3g} um",
                remedy=f"let the {gear.name}'s profile shift be found, or give a thickness allowance",
            )
        if value > 0.3 * module:
            yield GeometryWarning(
                "W-BACKLASH",
                f"{gear.name}.profile_shift",
                f"{mesh}: normal backlash of {value * 1e3:.4f} mm",
                value,
                "< 0.3 modules",
            )


def _clearances(s: PlanetarySet):
    for name, value in tip_clearances(s).items():
        gear = name.split()[0]
        if value < 0.0:
            raise GeometryError(
                f"negative tip clearance, {name}: {value * 1e3:.4f} mm",
                code="E-CLEARANCE",
                key=f"{gear}.tip_diameter",
                value=2.0 * getattr(s, gear).tip_radius,
                limit="clearance >= 0",
                remedy=f"shorten the tips of the {gear} (tip_diameter) or deepen the rack's dedendum",
            )
        if value < 0.1 * s.sun.module:
            yield GeometryWarning(
                "W-CLEARANCE",
                f"{gear}.tip_diameter",
                f"tip clearance, {name}, of {value * 1e3:.4f} mm",
                value,
                ">= 0.1 modules",
            )


def _contact_ratios(s: PlanetarySet):
    for mesh, value in (
        ("sun-planet", s.contact_ratio_sun_planet),
        ("planet-ring", s.contact_ratio_planet_ring),
    ):
        if value < 1.0:
            raise GeometryError(
                f"{mesh}: contact ratio {value:.4f}, so contact is lost between teeth",
                code="E-CONTACT-RATIO",
                key="set.centre_distance",
                value=f"contact ratio {value:.4f}",
                limit="contact ratio >= 1",
                remedy="lengthen the tips, reduce the working pressure angle or avoid undercut",
            )
        if value < 1.2:
            yield GeometryWarning(
                "W-CONTACT-RATIO",
                "set.centre_distance",
                f"{mesh}: contact ratio {value:.4f}",
                value,
                ">= 1.2",
            )


def _single_gears(s: PlanetarySet):
    for gear in (s.sun, s.planet, s.ring):
        if gear.undercut:
            yield GeometryWarning(
                "W-UNDERCUT",
                f"{gear.name}.profile_shift",
                f"{gear.teeth} teeth are undercut: the involute ends at {gear.form_radius * 1e3:.4f} mm; "
                f"this tool needs x >= {gear.undercut_shift:.4f} (a tool flank one module deep: "
                f"{involute.undercut_shift(gear.teeth, gear.pressure_angle):.4f})",
                gear.profile_shift,
                f">= {gear.undercut_shift:.4f}",
            )
        land = float(tooth_thickness(gear, gear.tip_radius))
        if land < 0.2 * gear.module:
            yield GeometryWarning(
                "W-TIP-THIN",
                f"{gear.name}.profile_shift",
                f"the teeth of the {gear.name} are {land * 1e3:.4f} mm thick at the tip",
                land,
                ">= 0.2 modules",
            )
        rim = abs(gear.root_radius - gear.rim_radius)
        height = abs(gear.tip_radius - gear.root_radius)
        if rim < 1.2 * height:
            yield GeometryWarning(
                "W-RIM",
                f"{gear.name}.{'outer_radius' if gear.internal else 'bore_radius'}",
                f"the {gear.name}'s rim is {rim * 1e3:.4f} mm thick under teeth of {height * 1e3:.4f} mm; "
                + _rim_held(gear),
                rim,
                ">= 1.2 tooth heights (below, ISO 6336-3 raises the root stress by a rim factor)",
            )


def _rim_held(gear: Gear) -> str:
    """How a thin rim is held, and what that does to its mesh stiffness and root stress."""
    if gear.internal:
        return (
            'with static.members = "fixed" its outer surface is held rigid and the mesh gets stiffer as it '
            'thins; with "elastic" it bends on its foundation'
        )
    return (
        "its bore is held rigid, so that it cannot bend and the mesh gets stiffer as it thins, where a rim "
        "on a bearing or hub that yields gets softer and its root stress rises: neither is computed"
    )
