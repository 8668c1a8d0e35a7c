"""Gear geometry against closed forms and published gears."""

from __future__ import annotations

import math
from dataclasses import replace

from femgear.gears import profile
from femgear.gears.gear import Gear
from femgear.gears.pair import working_pressure_angle, zero_backlash_distance
from femgear.gears.profile import BasicRack
from validation.reference import gear_limits
from validation.rows import REPEATED, Row, counted, printed

TWENTY = math.radians(20.0)


def involute_function() -> tuple[Row, ...]:
    """D1: the involute function and its inverse."""
    source = "tan(alpha) - alpha in extended precision"
    rows = [
        printed("D1", source, f"inv {degrees} deg [rad]", value, profile.inv(math.radians(float(degrees))))
        for degrees, value in (
            ("20", ".014904383867336446"),
            ("25", ".0299753451564162"),
            ("22.5", ".021514480674370895"),
        )
    ]
    inverse = math.degrees(profile.arcinv(0.02))
    return (*rows, printed("D1", source, "arcinv 0.02 [deg]", "21.981101788115", inverse))


def _pair(teeth, shifts, degrees, *, internal=False, module=1.0, truncated=False):
    """Working angle [rad], centre distance and contact ratio of a pair with addendum one module."""
    alpha = math.radians(degrees)
    cosine = math.cos(alpha)
    rack = BasicRack(root_radius=0.1)
    first, two = (Gear(z, 1e-3 * module, alpha, x, 0.02, 1e-3, rack=rack) for z, x in zip(teeth, shifts))
    if internal:
        two = replace(two, internal=True, rim_radius=1.0)
    distance = 1e3 * zero_backlash_distance(first, two)
    working = working_pressure_angle(first, two, 1e-3 * distance)
    reference = 0.5 * module * (teeth[1] - teeth[0] if internal else sum(teeth))
    cut = sum(shifts) - (distance - reference) / module if truncated else 0.0
    base_1, base_2 = (0.5 * module * z * cosine for z in teeth)
    tip_1 = module * (teeth[0] / 2 + 1 + shifts[0] - cut)
    tip_2 = module * (teeth[1] / 2 + (-1 if internal else 1) * (1 - cut) + shifts[1])
    ratio = gear_limits.contact_ratio_internal if internal else gear_limits.contact_ratio_external
    return working, distance, ratio(tip_1, base_1, tip_2, base_2, distance, math.pi * module * cosine)


def external_pairs() -> tuple[Row, ...]:
    """D2: contact ratios of external pairs."""
    source = f"path of contact over base pitch (ISO 21771), evaluated independently ({REPEATED})"
    rows = [
        printed(
            "D2",
            source,
            f"contact ratio {z1}/{z2}, {degrees} deg",
            value,
            _pair((z1, z2), (0, 0), degrees)[2],
        )
        for z1, z2, degrees, value in (
            (20, 40, 20, "1.6351859635714576"),
            (17, 17, 20, "1.5148004453923"),
            (20, 20, 25, "1.4102352118360"),
        )
    ]
    rows.append(
        printed(
            "D2",
            source,
            "limit, two racks, 20 deg",
            "1.98080909704540",
            gear_limits.limiting_contact_ratio(TWENTY),
        )
    )
    working, distance, ratio = _pair((20, 40), (0.3, 0.2), 20, module=3.0)
    name = "m 3, 20/40, x 0.3/0.2: "
    truncated = _pair((20, 40), (0.3, 0.2), 20, module=3.0, truncated=True)[2]
    return (
        *rows,
        printed("D2", source, name + "working angle [deg]", "22.3167069", math.degrees(working)),
        printed("D2", source, name + "centre distance [mm]", "91.4197646", distance),
        printed("D2", source, name + "contact ratio, full tips", "1.5291423", ratio),
        printed("D2", source, name + "contact ratio, shortened tips", "1.4931623", truncated),
    )


def internal_pairs() -> tuple[Row, ...]:
    """D3: contact ratios of internal pairs."""
    source = f"path of contact over base pitch, evaluated independently ({REPEATED})"
    return tuple(
        printed(
            "D3",
            source,
            f"contact ratio {teeth[0]}/{teeth[1]} internal, {degrees} deg, x {shifts[0]}/{shifts[1]}",
            value,
            _pair(teeth, shifts, degrees, internal=True)[2],
        )
        for teeth, shifts, degrees, value in (
            ((20, 80), (0.0, 0.0), 20, "1.88968133"),
            ((40, 100), (0.0, 0.0), 25, "1.62987813"),
            ((17, 81), (0.2, 0.2), 20, "1.74362843"),
        )
    )


def limits() -> tuple[Row, ...]:
    """D4: undercut, pointed tips, tip thickness."""
    source = f"closed forms, 20 deg, addendum 1, evaluated independently ({REPEATED})"
    base = 10.0 * math.cos(TWENTY)
    pointed = base / math.cos(gear_limits.pointed_tip_angle(20, 0.0, TWENTY))
    tip = profile.inv(gear_limits.pointed_tip_angle(20, 0.0, TWENTY)) - profile.inv(
        profile.pressure_angle_at(11.0, base)
    )
    return (
        printed("D4", source, "teeth without undercut", "17.0972643", gear_limits.undercut_teeth(TWENTY)),
        printed("D4", source, "least shift, 10 teeth", ".4151111", profile.undercut_shift(10, TWENTY)),
        printed("D4", source, "least shift, 12 teeth", ".2981333", profile.undercut_shift(12, TWENTY)),
        printed(
            "D4",
            source,
            "shift of a pointed tip, 12 teeth",
            ".8202039",
            gear_limits.pointed_tip_shift(12, TWENTY),
        ),
        printed(
            "D4",
            source,
            "shift of a pointed tip, 20 teeth",
            "1.2223485",
            gear_limits.pointed_tip_shift(20, TWENTY),
        ),
        printed("D4", source, "tip thickness, 20 teeth [modules]", ".6948800", 2 * 11.0 * tip),
        printed("D4", source, "pointed radius, 20 teeth [modules]", "11.5383374", pointed),
    )


def internal_interference() -> tuple[Row, ...]:
    """D4: smallest internal gear that a standard pinion runs in."""
    source = "tip of the internal gear at the pinion's base tangent point, 20 deg, addendum 1"
    return tuple(
        counted("D4", source, f"least ring teeth for {planet} planet teeth", ring, _least_ring(planet))
        for planet, ring in ((20, 64), (24, 40), (30, 38), (18, 161))
    )


def _least_ring(planet):
    cosine = math.cos(TWENTY)
    for ring in range(planet + 8, 400):
        tip, base = ring / 2 - 1, (planet * cosine / 2, ring * cosine / 2)
        # an internal gear whose tip circle lies inside its base circle has no involute there
        if tip >= base[1] and gear_limits.internal_interference(tip, *base, (ring - planet) / 2) >= 0:
            return ring
    return 0


def helical() -> tuple[Row, ...]:
    """D5: a helical pair."""
    source = f"closed forms, m_n 3, beta 15 deg, 20/40, b 40; evaluated independently ({REPEATED})"
    beta = math.radians(15.0)
    alpha = profile.transverse_angle(TWENTY, beta)
    scale = 3.0 / (2 * math.cos(beta))
    radii = [(z * scale + 3.0, z * scale * math.cos(alpha)) for z in (20, 40)]
    pitch = 2 * math.pi * scale * math.cos(alpha)
    ratio = gear_limits.contact_ratio_external(*radii[0], *radii[1], 60 * scale, pitch)
    base_helix = math.degrees(profile.base_helix_angle(TWENTY, beta))
    return (
        printed("D5", source, "transverse pressure angle [deg]", "20.6468965", math.degrees(alpha)),
        printed("D5", source, "base helix angle [deg]", "14.0760954", base_helix),
        printed("D5", source, "transverse contact ratio", "1.5609328", ratio),
        printed("D5", source, "overlap ratio", "1.0984621", profile.overlap_ratio(40.0, 3.0, beta)),
    )
