"""Tips of the teeth: how far they may reach into their mates, and the tip circles that a case leaves open.

Tips that no diameter is given for are those of the basic rack, shortened where profile shifts ask for it
(`clearance_shortening`), and where they would otherwise strike a mate. `settled_tips` finds them.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import (
    USUAL_LAND,
    Gear,
    combined_fault,
    half_thickness_angle,
    tip_radius_at_land,
    working_half_angles,
)
from femgear.gears.pair import AnySet, GearPair, GearSet
from femgear.gears.profile import inv, pressure_angle_at

FILLET_TOLERANCE = 0.005
"""Overlap of a tip corner with a root fillet [modules], or the backlash if that is more, that is allowed."""
SEEN = 1e-9
"""Overlap or shortening [m] below which there is nothing to say."""
_STEP = 1e-7
"""Tip diameters that are found are multiples of it [m], so that messages show what is computed."""
_PASSING_RANGE = 2.0
"""What a ring's teeth are shortened at most so that its tips pass those of the planets [modules]."""


def clearance_shortening(pair: GearPair) -> float:
    """Compute what both tips of an external pair are shortened [m] to keep the clearance of the rack.

    ``-k m = m ((z1 + z2)/2 + x1 + x2) - a`` (ISO 21771, section 5.3; DIN 3960), where that is positive.
    Profile shifts make the clearances of internal pairs larger: none.
    """
    gear_1, gear_2 = pair.gears
    if gear_2.internal:
        return 0.0
    shifts = (gear_1.profile_shift + gear_2.profile_shift) * gear_1.module
    missing = gear_1.reference_radius + gear_2.reference_radius + shifts - pair.centre_distance
    return missing if missing > SEEN else 0.0


def active_limits(pair: GearPair):
    """Find gear, partner and roll length [m] on the gear's flank that the partner's tip reaches, twice."""
    (gear_1, gear_2), length = pair.gears, pair.centre_distance * math.sin(pair.working_pressure_angle)
    if gear_2.internal:
        return (gear_1, gear_2, gear_2.tip_roll - length), (gear_2, gear_1, gear_1.tip_roll + length)
    return (gear_1, gear_2, length - gear_2.tip_roll), (gear_2, gear_1, length - gear_1.tip_roll)


def allowed_overlap(pair: GearPair) -> float:
    """Compute the overlap of a tip with a root fillet that is allowed [m], see `FILLET_TOLERANCE`.

    Teeth that such an overlap pushes ahead of their mates still have room behind them.
    """
    return max(FILLET_TOLERANCE * pair.gear_1.module, pair.backlash)


def largest_tip(gear: Gear, partner: Gear, reach: float) -> float:
    """Compute the tip radius [m] of the partner that just reaches the end of the gear's involute.

    ``reach`` is what it reaches now, see `active_limits`. Of an internal partner it is the smallest one.
    """
    missing = (reach - gear.form_roll) * (-1.0 if gear.internal or partner.internal else 1.0)
    return math.hypot(partner.base_radius, max(partner.tip_roll + missing, 0.0))


def typed_diameter(gear: Gear, radius: float) -> float:
    """Round a limit of the tip radius [m] to a diameter [m] in steps of 0.1 um, to the free side."""
    steps = 2.0 * radius / _STEP
    return _STEP * (math.ceil(steps - 1e-6) if gear.internal else math.floor(steps + 1e-6))


def fillet_overlap(gear: Gear, partner: Gear, centre_distance: float) -> float:
    """Compute the depth [m] to which the partner's tip corner enters the gear's fillet, as an arc.

    The corner is followed through the mesh from pitch-point contact of the loaded flanks, seen from the gear,
    and compared with the half-thickness angle of the generated fillet at its radius. Negative (or minus
    infinity, when it does not get there) without overlap. The centre distance is in m.
    """
    internal = gear.internal or partner.internal
    base = abs(partner.base_radius - gear.base_radius) if internal else partner.base_radius + gear.base_radius
    eta_gear, eta_partner = working_half_angles(gear, partner, math.acos(base / centre_distance))
    tip = float(half_thickness_angle(partner, partner.tip_radius))
    # pitch point on the x axis; the gear's left flank touches there
    centre = -centre_distance if partner.internal else centre_distance
    corner = eta_partner - tip if internal else math.pi - eta_partner + tip
    ratio = (1.0 if internal else -1.0) * gear.teeth / partner.teeth
    radius, angle = gear.tool.fillet_point(np.linspace(0.0, gear.fillet_end, 4001))
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


def tip_margin(planet: Gear, ring: Gear, centre_distance: float) -> float:
    """Compute the angle [rad] at the ring by which the tip corners of a planet in a ring miss each other.

    ``z1/z2 (phi1 + inv(aa1) - inv(aw)) + inv(aw) - inv(aa2) - phi2`` with the angles phi1, phi2 of the
    crossing of both tip circles at the two centres (Colbourne, The Geometry of Involute Gears, ch. 8):
    negative means that the teeth strike each other outside the path of contact. ``inf`` when the tip
    circles do not cross. The centre distance is in m.
    """
    a, tip_1, tip_2 = centre_distance, planet.tip_radius, ring.tip_radius
    cos_1 = (tip_2**2 - tip_1**2 - a**2) / (2.0 * a * tip_1)
    cos_2 = (tip_2**2 - tip_1**2 + a**2) / (2.0 * a * tip_2)
    if abs(cos_1) >= 1.0 or abs(cos_2) >= 1.0:
        return math.inf
    working = inv(pressure_angle_at(a, ring.base_radius - planet.base_radius))
    angle_1 = math.acos(cos_1) + inv(pressure_angle_at(tip_1, planet.base_radius)) - working
    angle_2 = math.acos(cos_2) + inv(pressure_angle_at(tip_2, ring.base_radius)) - working
    return angle_1 * planet.teeth / ring.teeth - angle_2


def settled_tips(gears: AnySet, *, free: Collection[str] = ()) -> AnySet:
    """Find the tips of a set or pair that are left open (`Gear.tip_open`), and check those gears.

    Tips that have a diameter keep it.

    A tip is that of the basic rack, shortened to keep its clearance (`clearance_shortening`). It is further
    shortened, to run free of its mates, where it would be refused: tips that reach below the base circle of a
    planet, overlap a fillet by more than `allowed_overlap`, strike passing tips, or belong to a pointed
    tooth, which keeps `USUAL_LAND`. Tips of internal gears are settled first, those of gear 1 last.

    Parameters
    ----------
    free : collection of str
        Names of gears that are to run free of their mates with no overlap at all.

    Raises
    ------
    GeometryError
        A gear that no tip makes whole, see `Gear`.
    """
    made, shortening, faults = list(gears.gears), [0.0] * len(gears.gears), []
    for pair, numbers in zip(gears.kinds, gears.mates, strict=True):
        for number in numbers:
            shortening[number] = max(shortening[number], clearance_shortening(pair))
    for number, gear in enumerate(gears.gears):
        try:
            if gear.tip_open and gear.tip_diameter is not None:
                made[number] = replace(gear, tip_open=False)
        except GeometryError as error:
            faults.append(error)
        if gear.tip_open and gear.tip_diameter is None:
            made[number] = replace(gear, tip_shortening=shortening[number])
    if faults:
        raise combined_fault(faults)
    gears = gears.with_gears(made)
    for number in sorted(range(len(made)), key=lambda n: (not gears.gears[n].internal, -n)):
        gear = gears.gears[number]
        if gear.tip_open:
            made[number] = _settled(gear, number, gears, run_free=gear.name in free)
            gears = gears.with_gears(made)
    return gears


def _settled(gear: Gear, number: int, gears: GearSet, *, run_free: bool) -> Gear:
    """Gear with its tip settled, and checked."""
    sense = -1.0 if gear.internal else 1.0
    rack_tip, radius = gear.tip_radius, gear.tip_radius
    if half_thickness_angle(gear, max(radius, gear.base_radius)) <= 0.0:
        radius = tip_radius_at_land(gear, USUAL_LAND * gear.module)
    gear = _with_tip(gear, radius)
    for pair, numbers in zip(gears.kinds, gears.mates, strict=True):
        if number not in numbers:
            continue
        place = numbers.index(number)
        other = pair.gears[1 - place]
        together = GearPair(*((gear, other) if place == 0 else (other, gear)), pair.centre_distance)
        mate, _, reach = active_limits(together)[1 - place]
        if _is_struck(mate, gear, reach, together, run_free=run_free):
            gear = _with_tip(gear, 0.5 * typed_diameter(gear, largest_tip(mate, gear, reach)))
        if gear.internal:
            gear = _passing(other, gear, pair.centre_distance)
    shortening = sense * (rack_tip - gear.tip_radius) + gear.tip_shortening
    whole = replace(gear, tip_diameter=None, tip_shortening=max(_own_shortening(gear, shortening), 0.0))
    return replace(whole, tip_open=False)


def _own_shortening(gear: Gear, shortening: float) -> float:
    """Shortening without what rounding adds to none."""
    return 0.0 if shortening < 1e-12 * gear.module else shortening


def _with_tip(gear: Gear, radius: float) -> Gear:
    """Open gear with the tip at a radius [m] for the time being."""
    return replace(gear, tip_diameter=2.0 * radius)


def _is_struck(gear: Gear, partner: Gear, reach: float, pair: GearPair, *, run_free: bool) -> bool:
    """Whether the partner's tip reaches further than it may on the gear, see `settled_tips`."""
    excess = reach - gear.form_roll if gear.internal else gear.form_roll - reach
    if partner.internal and reach < 0.0:
        return True
    # undercut has removed the flank that the tip would reach
    if excess <= 0.0 or (gear.undercut and not (run_free and partner.internal)):
        return False
    overlap = fillet_overlap(gear, partner, pair.centre_distance)
    return overlap > (SEEN if run_free else allowed_overlap(pair))


def _passing(planet: Gear, ring: Gear, centre_distance: float) -> Gear:
    """Ring whose tips pass those of the planet, as it is where they do or cannot be made to."""
    low, high = ring.tip_radius, ring.tip_radius + _PASSING_RANGE * ring.module
    if tip_margin(planet, ring, centre_distance) >= 0.0:
        return ring
    if tip_margin(planet, _with_tip(ring, high), centre_distance) < 0.0:
        return ring
    for _ in range(50):
        middle = 0.5 * (low + high)
        strikes = tip_margin(planet, _with_tip(ring, middle), centre_distance) < 0.0
        low, high = (middle, high) if strikes else (low, middle)
    return _with_tip(ring, 0.5 * typed_diameter(ring, high))
