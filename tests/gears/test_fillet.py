"""Fillets against a brute-force simulation of the cutting: the tool is moved, the gear must just touch it.

The tool's geometry and motion are built here from the definitions of rack and cutter, not from the code: the
distance of a gear point from every position of the tool is minimised numerically. It must be zero on flank
and fillet (the tool has cut them) and never negative (the tool has not cut deeper).
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.gears.gear import Gear, cutter_of, flank_points
from femgear.gears.profile import BasicRack, PinionCutter, arcinv, inv

ALPHA = math.radians(20.0)
EXTERNAL = {
    "sun": Gear(27, 1.5e-3, ALPHA, 0.52681, 25e-3, 9e-3),
    "planet": Gear(40, 1.5e-3, ALPHA, 0.0, 25e-3, 18e-3),
    "undercut": Gear(10, 1e-3, ALPHA, 0.0, 1e-2, 2e-3),
    "slight undercut": Gear(17, 1e-3, ALPHA, 0.0, 1e-2, 2e-3),
    "negative shift": Gear(24, 2e-3, ALPHA, -0.4, 1e-2, 9e-3),
    "high shift": Gear(14, 1e-3, ALPHA, 0.6, 1e-2, 2e-3, tip_diameter=16.6e-3),
    "full radius": Gear(30, 1e-3, ALPHA, 0.1, 1e-2, 5e-3, rack=BasicRack(1.0, 1.25, 0.4719)),
    "allowance": Gear(30, 1e-3, ALPHA, 0.1, 1e-2, 5e-3, thickness_allowance=40e-6),
    "deep root": Gear(30, 1e-3, math.radians(18), 0.1, 1e-2, 5e-3, root_diameter=27.4e-3),
    "sharp tool": Gear(30, 1e-3, ALPHA, 0.0, 1e-2, 5e-3, rack=BasicRack(1.0, 1.25, 0.0)),
}
INTERNAL = {
    "ring": Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, 0.1, internal=True, cutter=PinionCutter(30)),
    "shifted": Gear(81, 2e-3, ALPHA, 0.3, 25e-3, 0.1, internal=True, cutter=PinionCutter(20, 0.1)),
    "small rounding": Gear(93, 21e-3, ALPHA, -0.1171, 0.5, 1.2, internal=True, cutter=PinionCutter(25, tip_radius=0.1)),
    "allowance": Gear(60, 1e-3, ALPHA, 0.0, 1e-2, 0.04, internal=True, thickness_allowance=30e-6),
}


def cut_points(gear, count=6):
    """Points of the fillet and of the flank (root to tip)."""
    radius, angle = gear.tool.fillet_point(np.linspace(0.0, gear.fillet_end, count))
    fillet = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return fillet, flank_points(gear, np.linspace(gear.form_roll, gear.tip_roll, count))


def rack_distance(gear, point, travel):
    """Signed distance of a gear point from the rack tooth, whose centreline has moved by ``travel`` (n,)."""
    r0, m = gear.reference_radius, gear.module
    alpha, rho = gear.pressure_angle, gear.rack.root_radius * m
    # rack tooth: centreline at `travel`; the gear's gap centre (at pi/z) faces it after rolling
    turn = travel / r0 - math.pi / gear.teeth
    x = point[0] * np.cos(turn) - point[1] * np.sin(turn)
    y = np.abs(point[0] * np.sin(turn) + point[1] * np.cos(turn) - travel)  # symmetric tooth
    depth = r0 + gear.profile_shift * m - x  # below the datum line
    tool_depth = r0 + gear.profile_shift * m - gear.root_radius
    half = math.pi * m / 4 + gear.thickness_allowance / 2
    # offset of the polygon by -rho, then distance to it minus rho
    corner_depth = tool_depth - rho
    corner = half - tool_depth * math.tan(alpha) - rho * (1 - math.sin(alpha)) / math.cos(alpha)
    dy, dd = y - corner, depth - corner_depth
    flank = dy * math.cos(alpha) + dd * math.sin(alpha)
    along = dy * math.sin(alpha) - dd * math.cos(alpha)
    beyond = np.hypot(dy, dd)
    outside = np.minimum(np.where(along > 0, np.abs(flank), beyond), np.where(dy < 0, np.abs(dd), beyond))
    return np.where((flank < 0) & (dd < 0), -outside, outside) - rho


def cutter_profile(gear):
    """Rounding and left flank (dense points) of a cutter tooth on the x axis, and its centre distance."""
    cutter, m, alpha = cutter_of(gear), gear.module, gear.pressure_angle
    rho = m * (gear.rack.root_radius if cutter.tip_radius is None else cutter.tip_radius)
    base = m * cutter.teeth * math.cos(alpha) / 2
    # play-free engagement of cutter and gap: tooth of the cutter = gap of the gear on the rolling circles
    shift = gear.profile_shift + gear.thickness_allowance / (2 * m * math.tan(alpha)) - cutter.profile_shift
    angle = arcinv(inv(alpha) + 2 * math.tan(alpha) * shift / (gear.teeth - cutter.teeth))
    distance = m * (gear.teeth - cutter.teeth) * math.cos(alpha) / math.cos(angle) / 2
    tip = gear.root_radius - distance
    half = math.pi / (2 * cutter.teeth) + 2 * cutter.profile_shift * math.tan(alpha) / cutter.teeth + inv(alpha)
    rolls = np.linspace(0.0, math.sqrt(tip**2 - base**2), 40001)
    polar = half - rolls / base + np.arctan2(rolls, base)
    flank = np.column_stack([np.hypot(base, rolls) * np.cos(polar), np.hypot(base, rolls) * np.sin(polar)])
    low, high = 0.0, float(np.interp(tip - rho, np.hypot(*flank.T), polar))
    for _ in range(80):  # circle of radius rho inside the tip circle, just touching the flank
        middle = 0.5 * (low + high)
        centre = (tip - rho) * np.array([math.cos(middle), math.sin(middle)])
        gap = np.min(np.linalg.norm(flank - centre, axis=1)) - rho
        low, high = (middle, high) if gap > 0 else (low, middle)
    touch = int(np.argmin(np.linalg.norm(flank - centre, axis=1)))
    return centre, rho, flank[: touch + 1], distance


def test_rack_touches_flank_and_fillet_and_cuts_no_deeper():
    for name, gear in EXTERNAL.items():
        span = 2.5 * math.pi * gear.module
        for points in cut_points(gear):
            for point in points:
                travel, width = np.linspace(-span, span, 4001), span
                for _ in range(6):
                    distance = rack_distance(gear, point, travel)
                    best = travel[np.argmin(distance)]
                    width /= 400.0
                    travel = best + np.linspace(-width, width, 1001)
                assert abs(np.min(distance)) < 1e-12 * gear.module + 1e-15, (name, point, np.min(distance))


def test_rack_removes_the_involute_that_undercut_leaves_out():
    gear = EXTERNAL["undercut"]
    lost = flank_points(gear, np.linspace(0.1, 0.95, 5) * gear.form_roll)
    travel = np.linspace(-3e-3, 3e-3, 20001)
    for point in lost:
        assert np.min(rack_distance(gear, point, travel)) < -1e-7 * gear.module


@pytest.mark.parametrize("name", INTERNAL)
def test_cutter_touches_flank_and_fillet_and_cuts_no_deeper(name):
    gear = INTERNAL[name]
    centre, rho, flank, distance = cutter_profile(gear)
    ratio = cutter_of(gear).teeth / gear.teeth

    edge = np.hypot(*flank.T)

    def separation(point, cutter_angle):
        """Distances of a gear point from tip rounding and flank of the cutter tooth at angles (n,)."""
        seen = complex(*point) * np.exp(1j * (cutter_angle * ratio - math.pi / gear.teeth)) - distance
        local = np.conj(seen * np.exp(-1j * cutter_angle))  # our tooth faces the cutter's right side
        rounding = np.abs(local - complex(*centre)) - rho
        row = np.clip(np.searchsorted(edge, np.abs(local)), 1, len(flank) - 1)
        chord = flank[row] - flank[row - 1]
        x, y = local.real - flank[row - 1, 0], local.imag - flank[row - 1, 1]
        side = (chord[:, 0] * y - chord[:, 1] * x) / np.hypot(*chord.T)
        return rounding, np.where(np.abs(local) <= edge[-1], side, np.inf)

    fillet, sides = cut_points(gear)
    for points, which in ((fillet, 0), (sides, 1)):
        for point in points:
            angles, width = np.linspace(-0.9, 0.9, 1201), 0.9
            for _ in range(4):
                values = separation(point, angles)[which]
                best = angles[np.argmin(np.abs(values) if which else values)]
                width /= 300.0
                angles = best + np.linspace(-width, width, 301)
            assert abs(np.min(np.abs(values))) < 1e-8 * gear.module, (which, point)
            assert which or np.min(values) > -1e-8 * gear.module


@pytest.mark.parametrize("gear", [*EXTERNAL.values(), *INTERNAL.values()], ids=[*EXTERNAL, *INTERNAL])
def test_fillet_meets_root_circle_and_flank(gear):
    radius, angle = gear.tool.fillet_point(np.array([0.0, gear.fillet_end]))
    assert radius[0] == pytest.approx(gear.root_radius, rel=1e-14)
    end = flank_points(gear, np.array([gear.form_roll]))[0]
    meeting = radius[1] * np.array([math.cos(angle[1]), math.sin(angle[1])])
    assert np.allclose(meeting, end, rtol=0, atol=1e-13 * gear.reference_radius)


@pytest.mark.parametrize("gear", [*EXTERNAL.values(), *INTERNAL.values()], ids=[*EXTERNAL, *INTERNAL])
def test_tangent_is_continuous_where_the_tooth_is_not_undercut(gear):
    step = 1e-6
    radius, angle = gear.tool.fillet_point(gear.fillet_end - step * np.array([1.0, 0.0]))
    fillet = np.diff(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), axis=0)[0]
    flank = np.diff(flank_points(gear, gear.form_roll + gear.module * np.array([0.0, 1e-6])), axis=0)[0]
    if gear.internal:
        flank = np.diff(flank_points(gear, gear.form_roll - gear.module * np.array([0.0, 1e-6])), axis=0)[0]
    turn = abs(math.remainder(math.atan2(fillet[1], fillet[0]) - math.atan2(flank[1], flank[0]), 2 * math.pi))
    if gear.undercut:
        assert turn > 1e-3
    elif gear.rack.root_radius > 0.0:
        assert turn < 1e-4


def test_default_cutter_is_named_in_the_gear():
    ring = INTERNAL["ring"]
    assert replace(ring, cutter=None).form_radius == ring.form_radius
    assert cutter_of(replace(ring, teeth=40, rim_radius=0.06, cutter=None)).teeth == 28


def test_fillets_begin_where_their_flanks_end():
    """Thinned teeth too: the tool's tip ends on the same point of the involute, at the form radius."""
    for gear in (*EXTERNAL.values(), *INTERNAL.values()):
        radius, angle = gear.tool.fillet_point(gear.fillet_end)
        x, y = flank_points(gear, np.array([gear.form_roll]))[0]
        apart = complex(x, y) - float(radius) * np.exp(1j * float(angle))
        assert abs(apart) < 1e-9 * gear.module
