"""Contact that a mesh must not have: below the involute, on root fillets, between passing tips."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import GeometryError
from femgear.gears import involute
from femgear.gears.fillet import fillet_point
from femgear.gears.gear import half_thickness_angle, working_half_angles
from femgear.gears.limits import GeometryWarning

if TYPE_CHECKING:
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

FILLET_TOLERANCE = 1e-4
"""Overlap of a tip corner with a root fillet, in modules, that is warned about instead of refused."""
# overlap [m] below which there is nothing to warn of
_SEEN = 1e-9


def check_interference(planetary: PlanetarySet) -> tuple[GeometryWarning, ...]:
    """Refuse involute, fillet and trochoid interference of a set; see `checks.check_set`."""
    warnings = []
    for gear, partner, reach in active_limits(planetary):
        if reach < 0.0 and partner.internal:
            _involute_interference(gear, partner, reach)
        excess = reach - gear.form_roll if gear.internal else gear.form_roll - reach
        # undercut has removed the flank that a partner's tip would reach: the path of contact is shorter
        if excess > 0.0 and not gear.undercut:
            overlap = fillet_overlap(gear, partner, planetary.centre_distance)
            if overlap > FILLET_TOLERANCE * gear.module:
                _fillet_interference(gear, partner, reach, overlap)
            if overlap > _SEEN:
                warnings.append(_fillet_warning(gear, partner, reach, overlap))
    check_passing_tips(planetary.planet, planetary.ring, planetary.centre_distance)
    return tuple(warnings)


def active_limits(planetary: PlanetarySet):
    """Gear, partner and roll length [m] on the gear's flank that the partner's tip reaches, four times."""
    s = planetary
    sun_planet = s.centre_distance * math.sin(s.working_pressure_angle_sun_planet)
    planet_ring = s.centre_distance * math.sin(s.working_pressure_angle_planet_ring)
    return (
        (s.sun, s.planet, sun_planet - s.planet.tip_roll),
        (s.planet, s.sun, sun_planet - s.sun.tip_roll),
        (s.planet, s.ring, s.ring.tip_roll - planet_ring),
        (s.ring, s.planet, s.planet.tip_roll + planet_ring),
    )


def fillet_overlap(gear: Gear, partner: Gear, centre_distance: float) -> float:
    """Depth [m] to which the partner's tip corner enters the gear's fillet, as an arc.

    The corner is followed through the mesh from pitch-point contact of the loaded flanks, seen from the gear,
    and compared with the half-thickness angle of the generated fillet at its radius. Negative (or minus
    infinity, when it does not get there) without overlap.
    """
    internal = gear.internal or partner.internal
    base = abs(partner.base_radius - gear.base_radius) if internal else partner.base_radius + gear.base_radius
    eta_gear, eta_partner = working_half_angles(gear, partner, math.acos(base / centre_distance))
    tip = float(half_thickness_angle(partner, partner.tip_radius))
    # pitch point on the x axis; the gear's left flank touches there
    centre = -centre_distance if partner.internal else centre_distance
    corner = eta_partner - tip if internal else math.pi - eta_partner + tip
    ratio = (1.0 if internal else -1.0) * gear.teeth / partner.teeth
    radius, angle = fillet_point(gear.tool, np.linspace(0.0, gear.fillet_end, 4001))
    order = np.argsort(radius)

    def depth(turn):
        path = centre + partner.tip_radius * np.exp(1j * (corner + ratio * turn))
        r, polar = np.abs(path), np.angle(path) - turn + eta_gear
        arc = r * (np.interp(r, radius[order], angle[order]) - polar)
        return np.where((r > radius.min()) & (r < radius.max()) & (polar > 0.0), arc, -np.inf), r

    turn, step = np.linspace(-2.0 * gear.pitch_angle, 2.0 * gear.pitch_angle, 4001, retstep=True)
    for _ in range(3):
        arc, r = depth(turn)
        deepest = np.argmax(r) if gear.internal else np.argmin(r)
        best = turn[np.argmax(arc) if np.any(np.isfinite(arc)) else deepest]
        turn, step = np.linspace(best - 2.0 * step, best + 2.0 * step, 401, retstep=True)
    return float(np.max(arc))


def _rounded_up(radius: float) -> str:
    """Diameter in mm of the smallest tip circle [m] that is allowed, to be typed as it stands."""
    return f"{math.ceil(2e7 * radius) / 1e4:.4f}"


def _rounded_down(radius: float) -> str:
    """The same of the largest one."""
    return f"{math.floor(2e7 * radius) / 1e4:.4f}"


def _tip_limit(partner: Gear, allowed: float) -> str:
    """Allowed tip diameters in mm: above that of a ring, below that of the others."""
    return f">= {_rounded_up(allowed)}" if partner.internal else f"<= {_rounded_down(allowed)}"


def _involute_interference(gear: Gear, partner: Gear, reach: float):
    allowed = math.hypot(partner.base_radius, partner.tip_roll - reach)
    raise GeometryError(
        f"involute interference: the {partner.name}'s tip meets the {gear.name} {-reach * 1e3:.4f} mm beyond "
        f"the end of the line of action, inside the {gear.name}'s base circle",
        code="E-INTERFERENCE",
        key=f"{partner.name}.tip_diameter",
        value=2.0 * partner.tip_radius,
        limit=f"tip diameter >= {_rounded_up(allowed)} mm",
        remedy=f"give that tip_diameter, more teeth to the {gear.name}, or profile shifts",
    )


def _fillet_message(gear: Gear, reach: float, partner: Gear, overlap: float) -> str:
    where = math.hypot(gear.base_radius, max(reach, 0.0))
    below = "" if reach >= 0.0 else f" and {-reach * 1e3:.4f} mm beyond the end of the line of action"
    return (
        f"the {partner.name}'s tip runs into the {gear.name}'s root fillet: it reaches radius "
        f"{where * 1e3:.4f} mm{below}; the involute {'ends' if gear.internal else 'begins'} at "
        f"{gear.form_radius * 1e3:.4f} mm (overlap {overlap * 1e6:.3f} um)"
    )


def allowed_tip_radius(gear: Gear, partner: Gear, reach: float) -> float:
    """Tip radius [m] of the partner that reaches just the end of the gear's involute."""
    missing = reach - gear.form_roll
    roll = (
        partner.tip_roll + missing if not (gear.internal or partner.internal) else partner.tip_roll - missing
    )
    return math.hypot(partner.base_radius, roll)


def _fillet_interference(gear: Gear, partner: Gear, reach: float, overlap: float):
    allowed = allowed_tip_radius(gear, partner, reach)
    raise GeometryError(
        _fillet_message(gear, reach, partner, overlap),
        code="E-FILLET",
        key="rack.root_radius",
        value=round(gear.tool.rounding / gear.module, 9),
        limit=f"active profile {'up' if gear.internal else 'down'} to {gear.form_radius * 1e3:.4f} mm",
        remedy=f"reduce root_radius, or give the {partner.name} a tip_diameter "
        f"{_tip_limit(partner, allowed)} mm",
    )


def _fillet_warning(gear: Gear, partner: Gear, reach: float, overlap: float) -> GeometryWarning:
    allowed = allowed_tip_radius(gear, partner, reach)
    return GeometryWarning(
        "W-FILLET",
        f"{partner.name}.tip_diameter",
        _fillet_message(gear, reach, partner, overlap),
        2.0 * partner.tip_radius,
        f"{_tip_limit(partner, allowed)} mm",
    )


def check_passing_tips(planet: Gear, ring: Gear, centre_distance: float) -> None:
    """Refuse an internal pair whose tips strike each other outside the path of contact (E-TROCHOID)."""
    margin = involute.trochoid_interference(
        planet.teeth,
        ring.teeth,
        planet.tip_radius,
        ring.tip_radius,
        planet.base_radius,
        ring.base_radius,
        centre_distance,
    )
    if margin < 0.0:
        raise GeometryError(
            f"the tips of planet ({planet.teeth} teeth) and ring ({ring.teeth}) strike each other outside "
            f"the path of contact: the corners overlap by {-margin * ring.tip_radius * 1e3:.4f} mm",
            code="E-TROCHOID",
            key="ring.teeth",
            value=ring.teeth,
            limit="corners of the tips pass each other",
            remedy="increase the difference of the tooth numbers, or shorten the tips (tip_diameter)",
        )
