"""Can the set be assembled, and does it run: refusals with numbers, and warnings.

`check_set` looks at assembly, neighbours, play, contact ratios and clearances, and at contact that a mesh
must not have: below the involute, on root fillets, between passing tips.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from femgear.errors import GeometryError
from femgear.findings import DOUBT, Finding
from femgear.gears.gear import USUAL_LAND, Gear, GeometryWarning, combined_fault, tooth_thickness
from femgear.gears.iso6336_root import rim_factor_of
from femgear.gears.pair import GearPair, GearSet, zero_backlash_distance, zero_backlash_shift
from femgear.gears.planetary import (
    BACKLASH_TOLERANCE,
    SIGN_TOLERANCE,
    PlanetarySet,
    assembly_positions,
    feasible_angles,
    sign_remark,
)
from femgear.gears.profile import undercut_shift
from femgear.gears.tips import (
    SEEN,
    active_limits,
    allowed_overlap,
    clearance_shortening,
    fillet_overlap,
    largest_tip,
    settled_tips,
    tip_margin,
    typed_diameter,
)

DOUBTFUL_OVERLAP = 1e-4
"""Overlap of a tip corner with a root fillet [modules] from which numbers are in doubt."""
FEW_TEETH = 17
"""Teeth below which the basic rack undercuts an external gear without profile shift (at 20 deg)."""
_OF_TIPS = ("E-FILLET", "E-INTERFERENCE", "E-CLEARANCE")
# backlash of one kind of mesh beyond that of the other, in modules, from which profile shifts do not suit
_UNEVEN = 0.05


def check_set(planetary: PlanetarySet, *, overlap: float = 0.0) -> tuple[Finding, ...]:
    """Check the assembly and the meshes of a planetary set, and list what deserves a warning.

    ``overlap`` is the overlap ratio of helical teeth whose contact is solved over the face width: with it
    transverse contact ratios below one are a doubt (ISO 21771: the total one has to exceed one).

    Returns
    -------
    tuple of Finding
        W-PLANETS (one or two planets), W-NEIGHBOURS, W-BACKLASH, W-FILLET, W-CONTACT-RATIO, W-CLEARANCE,
        W-TIP, W-UNDERCUT, W-TIP-THIN, W-RIM.

    Raises
    ------
    GeometryError
        E-ASSEMBLY, E-NEIGHBOURS, E-BACKLASH, E-INTERFERENCE, E-FILLET, E-CLEARANCE,
        E-CONTACT-RATIO: code and key of the first fault, the message has all.
    """
    findings = [*_planets(planetary), *_neighbours(planetary)]
    _assembly(planetary)
    return *findings, *check_meshes(planetary, overlap=overlap)


def check_meshes(planetary: GearSet, *, overlap: float = 0.0) -> tuple[Finding, ...]:
    """Check the meshes and gears of a set or a pair; see `check_set`, from W-BACKLASH and E-BACKLASH on."""
    problems = list(_meshes(planetary, overlap))
    if faults := [problem for problem in problems if isinstance(problem, GeometryError)]:
        error = combined_fault(faults)
        if any(fault.code in _OF_TIPS for fault in faults) and (tips := _free_tips(planetary)):
            error.remedy = f"{error.remedy}; {tips}"
        raise error
    return tuple(problem for problem in problems if isinstance(problem, Finding))


def _meshes(s: GearSet, overlap: float = 0.0) -> Iterator[GeometryError | Finding]:
    """Faults and warnings of the meshes and gears."""
    yield from _backlash(s)
    yield from _interference(s)
    yield from _clearances(s)
    yield from _contact_ratios(s, overlap)
    yield from _shortened_tips(s)
    yield from _single_gears(s)


def _free_tips(s: GearSet) -> str:
    """Tip diameters with which all gears run free of each other, of those that would change; or nothing."""
    opened = [replace(gear, tip_diameter=None, tip_shortening=0.0, tip_open=True) for gear in s.gears]
    try:
        freed = settled_tips(s.with_gears(opened), free=[gear.name for gear in s.gears])
    except GeometryError:
        return ""
    if any(isinstance(problem, GeometryError) for problem in _meshes(freed)):
        return ""
    diameters = [
        f"{new.name}.tip_diameter = {typed_diameter(new, new.tip_radius) * 1e3:.4f} mm"
        for new, old in zip(freed.gears, s.gears, strict=True)
        if abs(new.tip_radius - old.tip_radius) > SEEN
    ]
    return f'free of all mates: {", ".join(diameters)}; or tip_diameter = "free"' if diameters else ""


def tip_clearances(planetary: GearSet) -> dict[str, float]:
    """Compute the radial clearances [m] between tip and root circles, by the gears of tip and root."""
    clearances = {}
    for pair in planetary.kinds:
        (gear_1, gear_2), a = pair.gears, pair.centre_distance
        inner, outer = f"{gear_1.name} tip to {gear_2.name} root", f"{gear_2.name} tip to {gear_1.name} root"
        sense = -1.0 if gear_2.internal else 1.0
        clearances[inner] = sense * (a - gear_2.root_radius) - gear_1.tip_radius
        clearances[outer] = sense * (a - gear_2.tip_radius) - gear_1.root_radius
    return clearances


def _planets(s: PlanetarySet):
    """Warn of sets with one or two planets."""
    if s.n_planets < 3:
        yield GeometryWarning(
            "W-PLANETS",
            "set.planets",
            f"{s.n_planets} planet{'s' * (s.n_planets > 1)} leave{'s' * (s.n_planets == 1)} the radial mesh "
            "forces on sun and ring to their bearings; a floating member cannot balance the load",
            ">= 3",
        )


def _neighbours(s: PlanetarySet):
    """Refuse planets that overlap, and warn where little room is left between them."""
    if s.n_planets == 1:
        return
    room, gap, pair = planet_room(s, s.planet_angles)
    if room <= 0.0:
        least = math.asin(min(s.planet.tip_radius / s.centre_distance, 1.0))
        most = math.ceil(math.pi / least) - 1
        uneven = s.n_planets <= most and s.rotations < s.n_planets
        raise GeometryError(
            f"neighbouring planets overlap by {-room * 1e3:.4f} mm: {pair} "
            f"(tip radius {s.planet.tip_radius * 1e3:.4f} mm at {s.centre_distance * 1e3:.4f} mm)",
            code="E-NEIGHBOURS",
            key="set.planet_angles" if uneven else "set.planets",
            value=f"{math.degrees(gap):.4f} deg" if uneven else s.n_planets,
            limit=f"more than {math.degrees(2.0 * least):.4f} deg between neighbours"
            if uneven
            else f"at most {most} equally spaced planets",
            remedy="use fewer planets, or fewer teeth on the planets",
        )
    if room < s.planet.module:
        yield GeometryWarning(
            "W-NEIGHBOURS",
            "set.planets",
            f"only {room * 1e3:.4f} mm are left between neighbouring tips: {pair}",
            ">= one module",
        )


def planet_room(s: PlanetarySet, angles: tuple[float, ...]) -> tuple[float, float, str]:
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
        room, _, pair = planet_room(s, feasible_angles(sun + ring, s.planet_angles))
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
        gear = next(gear for gear, number in zip(pair.gears, numbers, strict=True) if not s.repeated[number])
        if value < -BACKLASH_TOLERANCE * module:
            yield GeometryError(
                f"{mesh}: the flanks overlap by {-value * 1e6:.3f} um along the line of action at the centre "
                f"distance of {s.centre_distance * 1e3:.5f} mm (negative backlash){other_sign(s)}",
                code="E-BACKLASH",
                key=f"{gear.name}.profile_shift",
                value=gear.profile_shift,
                limit=f"normal backlash >= -{BACKLASH_TOLERANCE * module * 1e6:.3g} um",
                remedy=f"let the {gear.name}'s profile shift be found, or give a thickness allowance",
            )
        elif value - _asked_play(pair) > least + _UNEVEN * module:
            yield GeometryWarning(
                "W-BACKLASH",
                "set.centre_distance",
                f"{mesh}: normal backlash of {value * 1e3:.4f} mm; {_closing(pair)}{other_sign(s)}",
                f"that of the other meshes within {_UNEVEN:g} modules",
            )
        elif value > 0.3 * module:
            yield GeometryWarning(
                "W-BACKLASH",
                f"{gear.name}.profile_shift",
                f"{mesh}: normal backlash of {value * 1e3:.4f} mm",
                "< 0.3 modules",
            )


def _asked_play(pair: GearPair) -> float:
    """Normal play [m] that the thickness allowances of both gears make."""
    return sum(gear.thickness_allowance * math.cos(gear.pressure_angle) for gear in pair.gears)


def _closing(pair: GearPair) -> str:
    """Centre distance that suits the profile shifts of a mesh, and profile shifts that suit its own."""
    (gear_1, gear_2), a = pair.gears, pair.centre_distance
    shifts = f"x_{gear_2.name} - x_{gear_1.name}" if gear_2.internal else f"x_{gear_1.name} + x_{gear_2.name}"
    needed = f"{shifts} = {zero_backlash_shift(gear_1, gear_2, a):.4f} in modules of {gear_1.module * 1e3:.6g} mm"
    try:
        suits = f"a centre distance of {zero_backlash_distance(gear_1, gear_2) * 1e3:.3f} mm"
    except GeometryError:
        suits = "no centre distance"
    return f"the profile shifts suit {suits}; {a * 1e3:.6g} mm needs {needed}"


def _clearances(s: GearSet):
    """Refuse tips that run into roots, and warn of small clearances."""
    for name, value in tip_clearances(s).items():
        gear = next(gear for gear in s.gears if gear.name == name.split()[0])
        if value < 0.0:
            yield GeometryError(
                f"negative tip clearance, {name}: {value * 1e3:.4f} mm",
                code="E-CLEARANCE",
                key=f"{gear.name}.tip_diameter",
                value=2.0 * gear.tip_radius,
                limit="clearance >= 0",
                remedy=f"shorten the tips of the {gear.name} (tip_diameter) or deepen the rack's dedendum",
            )
        elif value < 0.1 * gear.module:
            yield GeometryWarning(
                "W-CLEARANCE",
                f"{gear.name}.tip_diameter",
                f"tip clearance, {name}, of {value * 1e3:.4f} mm",
                ">= 0.1 modules",
            )


def _longer_contact(pair: GearPair) -> str:
    """Say what lengthens the path of contact of a pair whose contact ratio is below one."""
    given = [f"{gear.name}.tip_diameter" for gear in pair.gears if gear.tip_diameter is not None]
    few = [
        f"{gear.name} ({gear.teeth})"
        for gear in pair.gears
        if gear.undercut or (gear.teeth < FEW_TEETH and not gear.internal)
    ]
    remedies = [f"leave {' and '.join(given)} out: tips are then as long as can be"] if given else []
    if few:
        remedies.append(f"take more teeth, or a larger profile shift where undercut cuts the flank: {', '.join(few)}")
    return "; ".join([*remedies, "lengthen the tips or reduce the working pressure angle"])


def _contact_ratios(s: GearSet, overlap: float):
    """Refuse total contact ratios below one, and warn of transverse ones below 1.2."""
    for pair in s.kinds:
        mesh, value = f"{pair.gear_1.name}-{pair.gear_2.name}", pair.contact_ratio
        if value < 1.0 < value + overlap:
            yield GeometryWarning(
                "W-CONTACT-RATIO",
                "set.centre_distance",
                f"{mesh}: transverse contact ratio {value:.4f}; the overlap ratio of {overlap:.4f} alone "
                "keeps teeth in contact",
                ">= 1",
                severity=DOUBT,
            )
        elif value < 1.0:
            yield GeometryError(
                f"{mesh}: contact ratio {value:.4f}, so contact is lost between teeth",
                code="E-CONTACT-RATIO",
                key="set.centre_distance",
                value=f"contact ratio {value:.4f}",
                limit="contact ratio >= 1",
                remedy=_longer_contact(pair),
            )
        elif value < 1.2:
            yield GeometryWarning(
                "W-CONTACT-RATIO",
                "set.centre_distance",
                f"{mesh}: contact ratio {value:.4f}",
                ">= 1.2",
            )


def _single_gears(s: GearSet):
    """Warn of undercut, thin tips and thin rims."""
    for gear in s.gears:
        if gear.undercut:
            yield GeometryWarning(
                "W-UNDERCUT",
                f"{gear.name}.profile_shift",
                f"{gear.teeth} teeth are undercut: the involute ends at {gear.form_radius * 1e3:.4f} mm; "
                f"this tool needs x >= {gear.undercut_shift:.4f} (a tool flank one module deep: "
                f"{undercut_shift(gear.teeth, gear.pressure_angle):.4f})",
                f">= {gear.undercut_shift:.4f}",
            )
        land = float(tooth_thickness(gear, gear.tip_radius))
        if land < USUAL_LAND * gear.module:
            yield GeometryWarning(
                "W-TIP-THIN",
                f"{gear.name}.profile_shift",
                f"the teeth of the {gear.name} are {land * 1e3:.4f} mm thick at the tip",
                f">= {USUAL_LAND:g} modules",
            )
        rim = abs(gear.root_radius - gear.rim_radius)
        height = abs(gear.tip_radius - gear.root_radius)
        if rim < 1.2 * height:
            yield GeometryWarning(
                "W-RIM",
                f"{gear.name}.{'outer_radius' if gear.internal else 'bore_radius'}",
                f"the {gear.name}'s rim is {rim * 1e3:.4f} mm thick under teeth of {height * 1e3:.4f} mm; "
                + _rim_held(gear),
                ">= 1.2 tooth heights",
            )


def _rim_held(gear: Gear) -> str:
    """Say how finite elements hold a thin rim, and by which factor ISO 6336-3 has its influence in S_F."""
    factor = f"; S_F has the influence of the rim by the factor Y_B = {rim_factor_of(gear):.2f} of ISO 6336-3"
    if gear.internal:
        return (
            'with static.members = "fixed" its outer surface is held rigid and the mesh gets stiffer as it '
            f'thins; with "elastic" it bends on its foundation{factor}'
        )
    return (
        "finite elements hold its bore rigid, as a solid shaft does, so that the mesh gets stiffer as the rim thins. "
        f"On a bearing or a hub that yields the mesh is softer and the root stress of finite elements higher{factor}"
    )


def _interference(s: GearSet):
    """Involute and fillet interference of all meshes, and passing tips of internal ones."""
    for pair, (gear, partner, reach) in ((p, limit) for p in s.kinds for limit in active_limits(p)):
        if reach < 0.0 and partner.internal:
            allowed = math.hypot(partner.base_radius, partner.tip_roll - reach)
            yield GeometryError(
                f"involute interference: the {partner.name}'s tip meets the {gear.name} "
                f"{-reach * 1e3:.4f} mm beyond the end of the line of action, inside the {gear.name}'s base "
                "circle",
                code="E-INTERFERENCE",
                key=f"{partner.name}.tip_diameter",
                value=2.0 * partner.tip_radius,
                limit=f"tip diameter {_tip_limit(partner, allowed)} mm",
                remedy=f"give that tip_diameter, more teeth to the {gear.name}, or profile shifts",
            )
            continue
        excess = reach - gear.form_roll if gear.internal else gear.form_roll - reach
        # undercut has removed the flank that a partner's tip would reach: the path of contact is shorter
        if excess > 0.0 and not gear.undercut:
            yield from _fillet_contact(gear, partner, reach, pair)
    for pair in s.kinds:
        if pair.gear_2.internal:
            yield from _passing_faults(*pair.gears, pair.centre_distance)


def _fillet_contact(gear: Gear, partner: Gear, reach: float, pair: GearPair):
    """Contact of the partner's tip with the gear's root fillet."""
    overlap, allowed = fillet_overlap(gear, partner, pair.centre_distance), allowed_overlap(pair)
    if overlap <= SEEN:
        return
    where = math.hypot(gear.base_radius, max(reach, 0.0))
    below = "" if reach >= 0.0 else f" and {-reach * 1e3:.4f} mm beyond the end of the line of action"
    message = (
        f"the {partner.name}'s tip runs into the {gear.name}'s root fillet: it reaches radius "
        f"{where * 1e3:.4f} mm{below}; the involute {'ends' if gear.internal else 'begins'} at "
        f"{gear.form_radius * 1e3:.4f} mm (overlap {overlap * 1e6:.3f} um)"
    )
    limit = _tip_limit(partner, largest_tip(gear, partner, reach))
    if overlap > allowed:
        yield GeometryError(
            message,
            code="E-FILLET",
            key="rack.root_radius",
            value=round(gear.tool.rounding / gear.module, 9),
            limit=f"overlap <= {allowed * 1e6:.3f} um, or active profile {'up' if gear.internal else 'down'} "
            f"to {gear.form_radius * 1e3:.4f} mm",
            remedy=("reduce root_radius", f"give the {partner.name} a tip_diameter {limit} mm"),
            gear=gear.name,
        )
    else:
        yield GeometryWarning(
            "W-FILLET",
            f"{partner.name}.tip_diameter",
            f"{message}; contact is computed on the involutes alone, which this corner would part by as much",
            f"{limit} mm",
            severity=DOUBT if overlap > DOUBTFUL_OVERLAP * gear.module else "",
            concerns=gear.name,
        )


def _tip_limit(partner: Gear, radius: float) -> str:
    """Allowed tip diameters in mm, to be typed as they stand: above that of a ring, below that of others."""
    return f"{'>=' if partner.internal else '<='} {typed_diameter(partner, radius) * 1e3:.4f}"


def _shortened_tips(s: GearSet):
    """Say which tips are shorter than those of the basic rack, and why."""
    for gear in s.gears:
        if gear.tip_diameter is not None or gear.tip_shortening <= SEEN:
            continue
        clearance = max(clearance_shortening(pair) for pair in s.kinds if gear in pair.gears)
        further = gear.tip_shortening - clearance
        why = [f"k = {-clearance / gear.module:.4f} keeps the clearance of the rack (ISO 21771)"]
        why = why if clearance > SEEN else []
        if further > SEEN:
            why += [f"{further * 1e3:.4f} mm let them run free of their mates"]
        yield Finding(
            "W-TIP",
            f"{gear.name}.tip_diameter",
            f"the tips of the {gear.name} are {gear.tip_shortening * 1e3:.4f} mm shorter than those of the "
            f"rack, at a diameter of {2e3 * gear.tip_radius:.4f} mm: {' and '.join(why)}",
            remedy="give tip_diameter where the drawing has another one",
        )


def other_sign(s: GearSet) -> str:
    """Remark that an internal gear's profile shift has the sign of ISO 21771, where that closes the set."""
    pair, ring = s.kinds[-1], s.gears[-1]
    if not ring.internal or ring.profile_shift == 0.0:
        return ""
    needed = zero_backlash_shift(pair.gear_1, ring, pair.centre_distance) + pair.gear_1.profile_shift
    return sign_remark(ring) if abs(needed + ring.profile_shift) < SIGN_TOLERANCE else ""


def check_passing_tips(planet: Gear, ring: Gear, centre_distance: float) -> None:
    """Refuse tips that strike each other outside the path of contact (E-INTERFERENCE).

    The centre distance is in m, as for `tips.tip_margin`.
    """
    for fault in _passing_faults(planet, ring, centre_distance):
        raise fault


def _passing_faults(planet: Gear, ring: Gear, centre_distance: float) -> Iterator[GeometryError]:
    """Tips of an internal mesh that strike each other in passing."""
    margin = tip_margin(planet, ring, centre_distance)
    if margin < 0.0:
        yield GeometryError(
            f"the tips of {planet.name} ({planet.teeth} teeth) and {ring.name} ({ring.teeth}) strike each "
            "other outside the path of contact: "
            f"the corners overlap by {-margin * ring.tip_radius * 1e3:.4f} mm",
            code="E-INTERFERENCE",
            key=f"{ring.name}.teeth",
            value=ring.teeth,
            limit="corners of the tips pass each other",
            remedy="increase the difference of the tooth numbers, or shorten the tips (tip_diameter)",
        )
