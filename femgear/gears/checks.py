"""Can the set be assembled, and does it run: refusals with numbers, and warnings.

`check_set` looks at assembly, neighbours, play, contact ratios and clearances, and at contact that a mesh
must not have: below the involute, on root fillets, between passing tips.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import (
    Gear,
    GeometryWarning,
    half_thickness_angle,
    tooth_thickness,
    working_half_angles,
)
from femgear.gears.pair import EACH, GearPair, zero_backlash_distance, zero_backlash_shift
from femgear.gears.planetary import (
    BACKLASH_TOLERANCE,
    GearSet,
    PlanetarySet,
    assembly_positions,
    feasible_angles,
)
from femgear.gears.profile import inv, pressure_angle_at, undercut_shift

FILLET_TOLERANCE = 1e-4
"""Overlap of a tip corner with a root fillet, in modules, that is warned about instead of refused."""
# backlash of one kind of mesh beyond that of the other, in modules, from which profile shifts do not suit
_UNEVEN = 0.05
# overlap [m] below which there is nothing to warn of
_SEEN = 1e-9


def check_set(planetary: PlanetarySet) -> tuple[GeometryWarning, ...]:
    """Check the assembly and the meshes of a planetary set, and list what deserves a warning.

    Returns
    -------
    tuple of GeometryWarning
        W-PLANETS (one or two planets), W-NEIGHBOURS, W-BACKLASH, W-FILLET, W-CONTACT-RATIO, W-CLEARANCE,
        W-UNDERCUT, W-TIP-THIN, W-RIM.

    Raises
    ------
    GeometryError
        E-ASSEMBLY, E-NEIGHBOURS, E-BACKLASH, E-INTERFERENCE, E-FILLET, E-CLEARANCE,
        E-CONTACT-RATIO.
    """
    found = [*_planets(planetary), *_neighbours(planetary)]
    _assembly(planetary)
    return *found, *check_meshes(planetary)


def check_meshes(planetary: GearSet) -> tuple[GeometryWarning, ...]:
    """Check the meshes and gears of a set or a pair; see `check_set`, from W-BACKLASH and E-BACKLASH on."""
    return (
        *_backlash(planetary),
        *_interference(planetary),
        *_clearances(planetary),
        *_contact_ratios(planetary),
        *_single_gears(planetary),
    )


def tip_clearances(planetary: GearSet) -> dict[str, float]:
    """Compute the radial clearances [m] between tip and root circles, by the gears of tip and root."""
    found = {}
    for pair in planetary.kinds:
        (one, two), a = pair.gears, pair.centre_distance
        inner, outer = f"{one.name} tip to {two.name} root", f"{two.name} tip to {one.name} root"
        sense = -1.0 if two.internal else 1.0
        found[inner] = sense * (a - two.root_radius) - one.tip_radius
        found[outer] = sense * (a - two.tip_radius) - one.root_radius
    return found


def _planets(s: PlanetarySet):
    """Warn of sets with one or two planets."""
    if s.n_planets < 3:
        yield GeometryWarning(
            "W-PLANETS", "set.planets",
            f"{s.n_planets} planet{'s' * (s.n_planets > 1)} leave{'s' * (s.n_planets == 1)} the radial mesh "
            "forces on sun and ring to their bearings; a floating member cannot balance the load", ">= 3",
        )  # fmt: skip


def _neighbours(s: PlanetarySet):
    """Refuse planets that overlap, and warn where little room is left between them."""
    if s.n_planets == 1:
        return
    room, gap, pair = _closest(s, s.planet_angles)
    if room <= 0.0:
        least = math.asin(min(s.planet.tip_radius / s.centre_distance, 1.0))
        most = math.ceil(math.pi / least) - 1
        uneven = s.n_planets <= most and s.rotations < s.n_planets
        raise GeometryError(
            f"neighbouring planets overlap by {-room * 1e3:.4f} mm: {pair} "
            f"(tip radius {s.planet.tip_radius * 1e3:.4f} mm at {s.centre_distance * 1e3:.4f} mm)",
            code="E-NEIGHBOURS", key="set.planet_angles" if uneven else "set.planets",
            value=f"{math.degrees(gap):.4f} deg" if uneven else s.n_planets,
            limit=f"more than {math.degrees(2.0 * least):.4f} deg between neighbours" if uneven
            else f"at most {most} equally spaced planets",
            remedy="use fewer planets, or fewer teeth on the planets",
        )  # fmt: skip
    if room < s.planet.module:
        yield GeometryWarning(
            "W-NEIGHBOURS", "set.planets",
            f"only {room * 1e3:.4f} mm are left between neighbouring tips: {pair}", ">= one module",
        )  # fmt: skip


def _closest(s: PlanetarySet, angles: tuple[float, ...]) -> tuple[float, float, str]:
    """Room between the tips of the nearest two planets [m] at some angles, their angle [rad], and words."""
    around = pairwise((*angles, angles[0] + 2.0 * math.pi))
    gap, n = min((round(b - a, 12), n) for n, (a, b) in enumerate(around, start=1))
    room = 2.0 * s.centre_distance * math.sin(0.5 * min(gap, math.pi)) - 2.0 * s.planet.tip_radius
    return room, gap, f"planets {n} and {n % len(angles) + 1}, {math.degrees(gap):.4f} deg apart"


def _assembly(s: PlanetarySet) -> None:
    """Refuse planets that do not assemble; the angles that the refusal offers leave room between them."""
    sun, ring = s.sun.teeth, s.ring.teeth
    try:
        assembly_positions(sun, ring, s.planet_angles)
    except GeometryError as error:
        room, _, pair = _closest(s, feasible_angles(sun + ring, s.planet_angles))
        if room <= 0.0:
            error.remedy = (
                f"use fewer planets, or z_s + z_r a multiple of {s.n_planets}: the nearest angles that "
                f"assemble overlap by {-room * 1e3:.4f} mm, {pair}"
            )
        raise


def _backlash(s: GearSet):
    """Refuse flanks that overlap, and warn of much play, or of more in one kind of mesh than in another."""
    module = s.gears[0].module
    least = min(pair.backlash - _asked_play(pair) for pair in s.kinds)
    for pair, numbers in zip(s.kinds, s.mates, strict=True):
        mesh, value = f"{pair.gear_1.name}-{pair.gear_2.name}", pair.backlash
        gear = next(gear for gear, number in zip(pair.gears, numbers, strict=True) if number != EACH)
        if value < -BACKLASH_TOLERANCE * module:
            raise GeometryError(
                f"{mesh}: the flanks overlap by {-value * 1e6:.3f} um along the line of action at the centre "
                f"distance of {s.centre_distance * 1e3:.5f} mm (negative backlash)", code="E-BACKLASH",
                key=f"{gear.name}.profile_shift", value=gear.profile_shift,
                limit=f"normal backlash >= -{BACKLASH_TOLERANCE * module * 1e6:.3g} um",
                remedy=f"let the {gear.name}'s profile shift be found, or give a thickness allowance",
            )  # fmt: skip
        if value - _asked_play(pair) > least + _UNEVEN * module:
            yield GeometryWarning(
                "W-BACKLASH", "set.centre_distance",
                f"{mesh}: normal backlash of {value * 1e3:.4f} mm; {_closing(pair)}",
                f"that of the other meshes within {_UNEVEN:g} modules",
            )  # fmt: skip
        elif value > 0.3 * module:
            yield GeometryWarning(
                "W-BACKLASH", f"{gear.name}.profile_shift",
                f"{mesh}: normal backlash of {value * 1e3:.4f} mm", "< 0.3 modules",
            )  # fmt: skip


def _asked_play(pair: GearPair) -> float:
    """Normal play [m] that the thickness allowances of both gears make."""
    return sum(gear.thickness_allowance * math.cos(gear.pressure_angle) for gear in pair.gears)


def _closing(pair: GearPair) -> str:
    """Centre distance that suits the profile shifts of a mesh, and profile shifts that suit its own."""
    (one, two), a = pair.gears, pair.centre_distance
    shifts = f"x_{two.name} - x_{one.name}" if two.internal else f"x_{one.name} + x_{two.name}"
    needed = f"{shifts} = {zero_backlash_shift(one, two, a):.4f} in modules of {one.module * 1e3:.6g} mm"
    try:
        suits = f"a centre distance of {zero_backlash_distance(one, two) * 1e3:.3f} mm"
    except GeometryError:
        suits = "no centre distance"
    return f"the profile shifts suit {suits}; {a * 1e3:.6g} mm needs {needed}"


def _clearances(s: GearSet):
    """Refuse tips that run into roots, and warn of small clearances."""
    for name, value in tip_clearances(s).items():
        gear = next(gear for gear in s.gears if gear.name == name.split()[0])
        if value < 0.0:
            raise GeometryError(
                f"negative tip clearance, {name}: {value * 1e3:.4f} mm", code="E-CLEARANCE",
                key=f"{gear.name}.tip_diameter", value=2.0 * gear.tip_radius, limit="clearance >= 0",
                remedy=f"shorten the tips of the {gear.name} (tip_diameter) or deepen the rack's dedendum",
            )  # fmt: skip
        if value < 0.1 * gear.module:
            yield GeometryWarning(
                "W-CLEARANCE", f"{gear.name}.tip_diameter", f"tip clearance, {name}, of {value * 1e3:.4f} mm",
                ">= 0.1 modules",
            )  # fmt: skip


def _contact_ratios(s: GearSet):
    """Refuse contact ratios below one, and warn of those below 1.2."""
    for pair in s.kinds:
        mesh, value = f"{pair.gear_1.name}-{pair.gear_2.name}", pair.contact_ratio
        if value < 1.0:
            raise GeometryError(
                f"{mesh}: contact ratio {value:.4f}, so contact is lost between teeth",
                code="E-CONTACT-RATIO", key="set.centre_distance", value=f"contact ratio {value:.4f}",
                limit="contact ratio >= 1",
                remedy="lengthen the tips, reduce the working pressure angle or avoid undercut",
            )  # fmt: skip
        if value < 1.2:
            yield GeometryWarning(
                "W-CONTACT-RATIO", "set.centre_distance", f"{mesh}: contact ratio {value:.4f}", ">= 1.2",
            )  # fmt: skip


def _single_gears(s: GearSet):
    """Warn of undercut, thin tips and thin rims."""
    for gear in s.gears:
        if gear.undercut:
            yield GeometryWarning(
                "W-UNDERCUT", f"{gear.name}.profile_shift",
                f"{gear.teeth} teeth are undercut: the involute ends at {gear.form_radius * 1e3:.4f} mm; "
                f"this tool needs x >= {gear.undercut_shift:.4f} (a tool flank one module deep: "
                f"{undercut_shift(gear.teeth, gear.pressure_angle):.4f})", f">= {gear.undercut_shift:.4f}",
            )  # fmt: skip
        land = float(tooth_thickness(gear, gear.tip_radius))
        if land < 0.2 * gear.module:
            yield GeometryWarning(
                "W-TIP-THIN", f"{gear.name}.profile_shift",
                f"the teeth of the {gear.name} are {land * 1e3:.4f} mm thick at the tip", ">= 0.2 modules",
            )  # fmt: skip
        rim = abs(gear.root_radius - gear.rim_radius)
        height = abs(gear.tip_radius - gear.root_radius)
        if rim < 1.2 * height:
            yield GeometryWarning(
                "W-RIM", f"{gear.name}.{'outer_radius' if gear.internal else 'bore_radius'}",
                f"the {gear.name}'s rim is {rim * 1e3:.4f} mm thick under teeth of {height * 1e3:.4f} mm; "
                + _rim_held(gear),
                ">= 1.2 tooth heights (below, ISO 6336-3 raises the root stress by a rim factor)",
            )  # fmt: skip


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


def _interference(s: GearSet):
    """Involute and fillet interference of all meshes, and passing tips of internal ones."""
    for gear, partner, reach in (limit for pair in s.kinds for limit in _active_limits(pair)):
        if reach < 0.0 and partner.internal:
            allowed = math.hypot(partner.base_radius, partner.tip_roll - reach)
            raise GeometryError(
                f"involute interference: the {partner.name}'s tip meets the {gear.name} "
                f"{-reach * 1e3:.4f} mm beyond the end of the line of action, inside the {gear.name}'s base "
                "circle", code="E-INTERFERENCE", key=f"{partner.name}.tip_diameter",
                value=2.0 * partner.tip_radius, limit=f"tip diameter {_tip_limit(partner, allowed)} mm",
                remedy=f"give that tip_diameter, more teeth to the {gear.name}, or profile shifts",
            )  # fmt: skip
        excess = reach - gear.form_roll if gear.internal else gear.form_roll - reach
        # undercut has removed the flank that a partner's tip would reach: the path of contact is shorter
        if excess > 0.0 and not gear.undercut:
            yield from _fillet_contact(gear, partner, reach, s.kinds[0].centre_distance)
    for pair in s.kinds:
        if pair.gear_2.internal:
            check_passing_tips(*pair.gears, pair.centre_distance)


def _active_limits(pair: GearPair):
    """Gear, partner and roll length [m] on the gear's flank that the partner's tip reaches, twice."""
    (one, two), length = pair.gears, pair.centre_distance * math.sin(pair.working_pressure_angle)
    if two.internal:
        return (one, two, two.tip_roll - length), (two, one, one.tip_roll + length)
    return (one, two, length - two.tip_roll), (two, one, length - one.tip_roll)


def _fillet_contact(gear: Gear, partner: Gear, reach: float, centre_distance: float):
    """Contact of the partner's tip with the gear's root fillet."""
    overlap = _fillet_overlap(gear, partner, centre_distance)
    if overlap <= _SEEN:
        return
    where = math.hypot(gear.base_radius, max(reach, 0.0))
    below = "" if reach >= 0.0 else f" and {-reach * 1e3:.4f} mm beyond the end of the line of action"
    message = (
        f"the {partner.name}'s tip runs into the {gear.name}'s root fillet: it reaches radius "
        f"{where * 1e3:.4f} mm{below}; the involute {'ends' if gear.internal else 'begins'} at "
        f"{gear.form_radius * 1e3:.4f} mm (overlap {overlap * 1e6:.3f} um)"
    )
    # the partner's tip then reaches just the end of the gear's involute
    missing = (reach - gear.form_roll) * (-1.0 if gear.internal or partner.internal else 1.0)
    limit = _tip_limit(partner, math.hypot(partner.base_radius, partner.tip_roll + missing))
    if overlap > FILLET_TOLERANCE * gear.module:
        raise GeometryError(
            message, code="E-FILLET", key="rack.root_radius",
            value=round(gear.tool.rounding / gear.module, 9),
            limit=f"active profile {'up' if gear.internal else 'down'} to {gear.form_radius * 1e3:.4f} mm",
            remedy=f"reduce root_radius, or give the {partner.name} a tip_diameter {limit} mm",
        )  # fmt: skip
    yield GeometryWarning("W-FILLET", f"{partner.name}.tip_diameter", message, f"{limit} mm")


def _tip_limit(partner: Gear, radius: float) -> str:
    """Allowed tip diameters in mm, to be typed as they stand: above that of a ring, below that of others."""
    if partner.internal:
        return f">= {math.ceil(2e7 * radius) / 1e4:.4f}"
    return f"<= {math.floor(2e7 * radius) / 1e4:.4f}"


def _fillet_overlap(gear: Gear, partner: Gear, centre_distance: float) -> float:
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


def check_passing_tips(planet: Gear, ring: Gear, centre_distance: float) -> None:
    """Refuse tips that strike each other outside the path of contact (E-INTERFERENCE).

    The centre distance is in m, as for `tip_margin`.
    """
    margin = tip_margin(planet, ring, centre_distance)
    if margin < 0.0:
        raise GeometryError(
            f"the tips of {planet.name} ({planet.teeth} teeth) and {ring.name} ({ring.teeth}) strike each "
            "other outside the path of contact: "
            f"the corners overlap by {-margin * ring.tip_radius * 1e3:.4f} mm",
            code="E-INTERFERENCE", key=f"{ring.name}.teeth", value=ring.teeth,
            limit="corners of the tips pass each other",
            remedy="increase the difference of the tooth numbers, or shorten the tips (tip_diameter)",
        )  # fmt: skip
