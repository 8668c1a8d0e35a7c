"""The half sector: a simple closed polygon of exact points with the promised labels."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, flank_points, half_thickness_angle
from femgear.gears.profile import BasicRack, PinionCutter
from femgear.gears.tooth import SHORTEST_ROOT, half_sector, root_notches

ALPHA = math.radians(20.0)
GEARS = {
    "sun": Gear(27, 1.5e-3, ALPHA, 0.52681, 25e-3, 9e-3),
    "planet": Gear(40, 1.5e-3, ALPHA, 0.0, 25e-3, 18e-3),
    "ring": Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, 0.1, internal=True),
    "undercut": Gear(10, 1e-3, ALPHA, 0.0, 1e-2, 2e-3),
    "limit of undercut": Gear(17, 1.5e-3, ALPHA, 0.09, 25e-3, 3e-3),
    "full radius": Gear(30, 1e-3, ALPHA, 0.1, 1e-2, 5e-3, rack=BasicRack(1.0, 1.25, 0.4719)),
    "thin rim": Gear(60, 1e-3, ALPHA, 0.0, 1e-2, 32.2e-3, internal=True),
    "large": Gear(300, 5e-3, ALPHA, 0.0, 0.1, 0.5),
    "45 deg": Gear(40, 1e-3, math.radians(40), 0.0, 1e-2, 5e-3, rack=BasicRack(0.6, 0.7, 0.1)),
}
every_gear = pytest.mark.parametrize("name", GEARS)


def boundary(sector):
    return np.vstack([points[:-1] for _, points in sector.curves])


def crosses(vertices):
    """Whether any two edges of the closed polygon that do not share a vertex intersect."""
    a, b = vertices, np.roll(vertices, -1, axis=0)

    def side(p, q, r):
        return np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    i, j = np.triu_indices(len(a), 2)
    keep = ~((i == 0) & (j == len(a) - 1))
    i, j = i[keep], j[keep]
    return bool(
        np.any(
            (side(a[i], b[i], a[j]) * side(a[i], b[i], b[j]) < 0)
            & (side(a[j], b[j], a[i]) * side(a[j], b[j], b[i]) < 0)
        )
    )


@every_gear
def test_boundary_is_closed_simple_and_counter_clockwise(name):
    sector = half_sector(GEARS[name])
    ends = [points for _, points in sector.curves]
    for one, two in pairwise([*ends, ends[0]]):
        assert np.array_equal(one[-1], two[0])
    assert all(len(points) % 2 == 1 for points in ends)
    x, y = boundary(sector).T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0
    assert not crosses(boundary(sector)[::2] if len(x) % 2 == 0 else boundary(sector))
    edges = np.linalg.norm(np.diff(np.vstack([boundary(sector)[::2], boundary(sector)[:1]]), axis=0), axis=1)
    assert np.min(edges) > 0.003 * GEARS[name].module


@every_gear
def test_area_is_that_of_the_exact_tooth(name):
    """Polar integral of the half angle: root disc sector, fillet and flank, with fine trapezoids."""
    gear = GEARS[name]
    rolls = np.linspace(gear.form_roll, gear.tip_roll, 20001)
    r_flank = np.hypot(gear.base_radius, rolls)
    r_fillet, a_fillet = gear.tool.fillet_point(np.linspace(0.0, gear.fillet_end, 20001))
    area = np.trapezoid(half_thickness_angle(gear, r_flank) * r_flank, r_flank)
    area += np.trapezoid(a_fillet * r_fillet, r_fillet)
    area += 0.5 * math.pi / gear.teeth * (gear.root_radius**2 - gear.rim_radius**2)
    x, y = boundary(half_sector(gear, refine=4.0)).T
    polygon = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert polygon == pytest.approx(abs(area), rel=2e-5)


@every_gear
def test_points_lie_on_their_curves(name):
    gear, sector = GEARS[name], half_sector(GEARS[name])
    scale = 1e-14 * gear.reference_radius
    for curve, points in sector.curves:
        radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
        if curve in ("tip", "root", "rim"):
            expected = {"tip": gear.tip_radius, "root": gear.root_radius, "rim": gear.rim_radius}[curve]
            np.testing.assert_allclose(radius, expected, rtol=1e-14)
        elif curve == "cut":
            assert np.allclose(angle, math.pi / gear.teeth, rtol=0, atol=1e-14)
        elif curve == "symmetry":
            assert np.array_equal(points[:, 1], np.zeros(len(points)))
        elif curve == "flank":
            assert np.allclose(points, flank_points(gear, sector.flank_roll), rtol=0, atol=scale)
    base = sector.interfaces[0][1]
    assert np.ptp(np.hypot(*base.T)) < 10 * scale


@every_gear
def test_flank_stations_are_uniform_in_roll_and_end_at_tip_and_fillet(name):
    gear, sector = GEARS[name], half_sector(GEARS[name], flank_elements=16)
    assert len(sector.flank_roll) == 33 == len(sector.curve("flank"))
    assert np.ptp(np.diff(sector.flank_roll)) < 1e-12 * gear.tip_roll
    ends = sorted(sector.flank_roll[[0, -1]])
    assert gear.tip_roll in ends
    other = ends[1] if gear.internal else ends[0]
    radius = math.hypot(gear.base_radius, other)
    assert radius == pytest.approx(gear.form_radius, rel=1e-3 if "undercut" in name else 1e-14)


@every_gear
def test_fillet_points_lie_on_the_generated_curve(name):
    gear, points = GEARS[name], half_sector(GEARS[name]).curve("fillet")
    radius, angle = gear.tool.fillet_point(np.linspace(0.0, gear.fillet_end, 200_001))
    dense = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    tangent = np.gradient(dense, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    on_root = np.abs(np.hypot(*points.T) - gear.root_radius) < 1e-13
    on_involute = np.hypot(*points.T) > gear.form_radius
    for point in points[~on_root & ~on_involute]:
        row = np.argmin(np.linalg.norm(dense - point, axis=1))
        away = point - dense[row]
        assert abs(away[0] * tangent[row, 1] - away[1] * tangent[row, 0]) < 1e-9 * gear.module
    assert np.sum(on_root) <= (1 if gear.tool.rounding < 0.4 * gear.module else 3)


@every_gear
def test_interface_ends_are_vertices_of_the_boundary(name):
    sector = half_sector(GEARS[name])
    base = sector.interfaces[0][1]
    assert sector.interfaces[0][0] == "tooth_base"
    assert np.any(np.all(sector.curve("symmetry")[::2] == base[0], axis=1))
    assert np.any(np.all(sector.curve("fillet")[::2] == base[-1], axis=1))


@every_gear
def test_region_points_are_on_their_sides_of_the_tooth_base(name):
    gear, sector = GEARS[name], half_sector(GEARS[name])
    base = math.hypot(*sector.interfaces[0][1][0])
    regions = dict(sector.regions)
    for region, point in regions.items():
        angle = math.atan2(point[1], point[0])
        assert 0.0 < angle < math.pi / gear.teeth
        outside = math.hypot(*point) > base
        assert outside is ((region == "tooth") is not gear.internal)


def test_names_and_order():
    names = [name for name, _ in half_sector(GEARS["sun"]).curves]
    assert names == ["symmetry", "tip", "flank", "fillet", "root", "cut", "rim"]
    names = [name for name, _ in half_sector(GEARS["ring"]).curves]
    assert names == ["rim", "cut", "root", "fillet", "flank", "tip", "symmetry"]
    names = [name for name, _ in half_sector(GEARS["full radius"]).curves]
    assert names == ["symmetry", "tip", "flank", "fillet", "cut", "rim"]


def test_refine_divides_every_spacing():
    coarse, fine = half_sector(GEARS["sun"]), half_sector(GEARS["sun"], refine=2.0)
    for (name, one), (_, two) in zip(coarse.curves, fine.curves, strict=True):
        assert 1.7 * len(one) - 5 < len(two) < 2.3 * len(one) + 5, name
    assert len(fine.flank_roll) == 97


def test_arrays_are_read_only():
    sector = half_sector(GEARS["sun"])
    with pytest.raises(ValueError):
        sector.curves[0][1][0, 0] = 1.0
    with pytest.raises(ValueError):
        sector.flank_roll[0] = 1.0


def ring(outer_radius):
    return Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, outer_radius, internal=True, name="ring")


def test_cut_of_a_thick_ring_grows_with_the_logarithm_of_its_radius():
    count = [len(half_sector(ring(r)).curve("cut")) for r in (0.25, 0.5, 1.0, 2.0)]
    # edges of half the sector's width: ln 2 / (pi / 108) of them, each with its mid point
    assert np.diff(count) == pytest.approx(2 * math.log(2) / (math.pi / 108), abs=4)


def test_edges_grow_only_far_from_the_teeth():
    thin, thick = (half_sector(ring(r)).curve("cut")[::-1] for r in (0.1, 0.3))
    one, two = (np.linalg.norm(np.diff(points[::2], axis=0), axis=1) / 1.5e-3 for points in (thin, thick))
    near = np.hypot(*thick[2::2].T) < 82.875e-3 + 11 * 1.5e-3
    assert two[near].max() < 0.505
    assert abs(len(one) - near.sum()) <= 4
    assert two[~near].max() == pytest.approx(math.pi / 108 * 200, rel=0.05)


def test_a_body_too_deep_for_its_sector_is_refused():
    with pytest.raises(GeometryError) as caught:
        half_sector(ring(10.0))
    error = caught.value
    assert (error.code, error.key, error.exit_code) == ("E-GRID", "ring.outer_radius", 2)
    assert "smaller outer radius" in error.remedy and "400 nodes" in error.limit
    with pytest.raises(GeometryError) as caught:
        half_sector(Gear(400, 1.5e-3, ALPHA, 0.0, 25e-3, 5e-3, name="sun"))
    assert (caught.value.code, caught.value.key) == ("E-GRID", "sun.bore_radius")


def test_elements_are_smaller_where_a_fillet_turns_sharply():
    gear = Gear(
        61,
        4e-3,
        ALPHA,
        0.0,
        0.05,
        0.14,
        internal=True,
        rack=BasicRack(0.9, 1.25, 0.0),
        cutter=PinionCutter(45),
    )
    fillet = half_sector(gear).curve("fillet")[::2]
    step = np.diff(fillet @ np.array([1.0, 1j]))
    # by the chord of an arc, an element turns by its length over the radius
    assert np.abs(np.angle(step[1:] / step[:-1])).max() < math.radians(12.0)
    # nothing else changes: those of an ordinary tool have one size along most of their length
    ordinary = half_sector(GEARS["sun"]).curve("fillet")[::2]
    assert np.linalg.norm(np.diff(ordinary, axis=0), axis=1).min() > 0.03 * GEARS["sun"].module


def test_corners_of_roots_are_found():
    """Where a sharp cutter ends its flank at the pitch point the fillet has no length."""
    corner = Gear(
        80,
        2e-3,
        ALPHA,
        0.5,
        0.02,
        0.16,
        internal=True,
        rack=BasicRack(root_radius=0.0),
        cutter=PinionCutter(60),
    )
    notches, radius = root_notches(corner)
    assert radius < 0.003 * 2e-3
    assert np.abs(np.hypot(*notches.T) - corner.root_radius).max() < 0.003 * 2e-3
    # its outline has the root arc in the place of the fillet, to the cut, and a vertex in the corner
    curves = dict(half_sector(corner).curves)
    assert "root" not in curves
    x, y = curves["fillet"][[0, -1]].T
    assert np.hypot(x, y) == pytest.approx(corner.root_radius, rel=1e-8)
    assert math.atan2(y[0], x[0]) == pytest.approx(math.pi / 80)
    assert math.dist((x[1], y[1]), notches[0]) < 0.003 * 2e-3
    for name, gear in GEARS.items():
        notches, radius = root_notches(gear)
        # undercut flanks end in a ridge, which carries nothing
        assert not len(notches), name
        if name in ("sun", "planet", "ring"):
            assert radius == pytest.approx(0.25 * gear.module, rel=0.2)


@pytest.mark.parametrize("name", list(GEARS))
def test_a_similar_gear_has_the_similar_outline(name):
    """All lengths 1.7 times as large, with a rounding of their own: points and roll lengths to rounding."""
    gear, factor = GEARS[name], 1.7
    lengths = ("module", "face_width", "rim_radius", "tip_diameter", "root_diameter", "tip_shortening")
    larger = {key: factor * value for key in lengths if (value := getattr(gear, key)) is not None}
    shift = gear.profile_shift * (1.0 + 1e-15)
    one, two = half_sector(gear), half_sector(replace(gear, **larger, profile_shift=shift))
    for (kind, points), (_, others) in zip(one.curves + one.interfaces, two.curves + two.interfaces, strict=True):
        assert others == pytest.approx(factor * points, rel=1e-13, abs=1e-13 * gear.module), kind
    assert two.flank_roll == pytest.approx(factor * one.flank_roll, rel=1e-13)


# A root arc too short for an edge of its own belongs to the fillet.


@pytest.mark.parametrize("rounding", [0.4719, 0.466, 0.462])
def test_the_fillet_ends_on_the_root_circle_at_the_cut(rounding):
    """Towards the cut its points turn on, outside the root circle or on it."""
    gear = Gear(30, 1e-3, math.radians(20.0), 0.1, 1e-2, 5e-3, rack=BasicRack(1.0, 1.25, rounding))
    corner = float(gear.tool.fillet_point(0.0)[1])
    assert 0.0 <= (math.pi / gear.teeth - corner) * gear.root_radius < SHORTEST_ROOT * gear.module
    points = dict(half_sector(gear, flank_elements=8).curves)["fillet"]
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    end = np.array([gear.root_radius, math.pi / gear.teeth])
    assert sorted([(radius[0], angle[0]), (radius[-1], angle[-1])])[0] == pytest.approx(tuple(end), rel=1e-12)
    assert radius.min() > gear.root_radius * (1 - 1e-6) and angle.max() <= end[1] * (1 + 1e-12)
    assert np.all(np.diff(angle) > 0) or np.all(np.diff(angle) < 0)
