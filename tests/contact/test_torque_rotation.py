"""Torque and rotation of whole gears: flanks, loads, and the stiffness of the compliance route."""

import numpy as np
import pytest

from femgear.errors import ContactError
from femgear.fe.elasticity import Material
from femgear.fe.meshing import check_outline
from femgear.gears.tooth import half_sector
from validation.planetary import reference_set
from validation.reference.flank_mortar import PlacedFlank, flank_contact, opposite, smallest_separation
from validation.reference.graded_teeth import flank_curve, graded_sector
from validation.reference.torque_balance import balanced_loads
from validation.reference.torque_rotation import GearPair, torque_rotation
from validation.torque_rotation import SUN_PLANET, by_compliance, depth_compliance

STEEL = Material(206e9, 0.3, 7850.0)
SET = reference_set()


def line(start, end, edges):
    return np.linspace(start, end, 2 * edges + 1)


def circle(radius, centre, angles):
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])


@pytest.fixture(scope="module")
def pair():
    angle = SET.working_pressure_angle_sun_planet
    return GearPair(SET.sun, SET.planet, SET.centre_distance, angle, STEEL)


@pytest.fixture(scope="module")
def single(pair):
    """One tooth pair carries, coarse grids; both kinds of rim."""
    torque, options = 100.0 / 3.0, {"edges": 6, "refine": 0.4}
    return {rim: torque_rotation(pair, torque, [0.25], rim=rim, **options) for rim in ("held", "sliding")}


def test_flat_surfaces_share_the_load_as_it_is():
    # slave below, body on the left of an edge that runs to the left; master above, shifted
    slave = PlacedFlank(line([0.3, 0.0], [-0.7, 0.0], 5), 0.0, np.zeros(2))
    master = PlacedFlank(line([-1.0, 0.25], [1.0, 0.25], 7), 0.0, np.zeros(2))
    assert smallest_separation(slave, master)[0] == pytest.approx(0.25, abs=1e-14)
    found = flank_contact(slave, master, (0, 4), drives=True, base_radius=0.5)
    np.testing.assert_allclose(found.gap, 0.25, rtol=1e-12)
    assert found.goes_on == (False, False)
    assert found.width.sum() == pytest.approx(1.0, rel=1e-12)
    # a unit force of every hat arrives on both surfaces, opposite, at the same place
    for load, way in ((found.slave_load, -1), (found.master_load, 1)):
        np.testing.assert_allclose(load.sum(axis=0), np.outer([0, way], np.ones(6)), atol=1e-12)
    moments = [
        np.einsum("n,nm->m", flank.points[:, 0], load[:, 1])
        for flank, load in ((slave, found.slave_load), (master, found.master_load))
    ]
    np.testing.assert_allclose(moments[0], -moments[1], atol=1e-12)
    part = flank_contact(slave, master, (1, 3), drives=True, base_radius=0.5)
    assert part.goes_on == (True, True)
    # turning about the origin lifts the slave by x: the arm is the place of the hat over the base radius
    np.testing.assert_allclose(found.arm, -moments[0] / 0.5, atol=1e-12)


def test_separation_of_a_circle_and_a_turned_line():
    angles = np.linspace(np.pi / 3, 2 * np.pi / 3, 61)
    slave = PlacedFlank(circle(1.0, np.zeros(2), angles), 0.3, np.array([0.2, -0.1]))
    master = PlacedFlank(line([-2.0, 1.01], [2.0, 1.01], 3), 0.3, np.array([0.2, -0.1]))
    gap, edge = smallest_separation(slave, master)
    assert gap == pytest.approx(0.01, abs=1e-7)
    assert abs(edge - 14.5) <= 1


def test_points_without_counterpart_are_known():
    points = line([0.0, 1.0], [1.0, 1.0], 4)
    x = np.array([[-0.2, 0.0], [0.6, 0.0], [1.2, 0.0]])
    edge, t, meets = opposite(points, x, np.tile([0.0, 1.0], (3, 1)))
    np.testing.assert_array_equal(meets, [False, True, False])
    assert (edge[1] + t[1]) / 4 == pytest.approx(0.6, abs=1e-12)


@pytest.mark.parametrize("gear, side", [(SET.sun, "left"), (SET.ring, "right")])
def test_graded_sector_keeps_the_cuts(gear, side):
    roll = 0.5 * (gear.form_roll + gear.tip_roll)
    outline = graded_sector(gear, side, roll, 60e-6, edges=6, refine=0.6)
    check_outline(outline)
    curves, half = dict(outline.curves), half_sector(gear, refine=0.6)
    for name, way in (("cut_left", 1), ("cut_right", -1)):
        found = np.sort(np.hypot(*curves[name].T))
        np.testing.assert_array_equal(found, np.sort(np.hypot(*half.curve("cut").T)))
        assert np.all(np.sign(curves[name][:, 1]) == way)
    flank = curves["contact"]
    assert np.all(np.sign(flank[:, 1]) == (1 if side == "left" else -1))
    step = np.hypot(*np.diff(flank[::2], axis=0).T)
    assert step.min() == pytest.approx(10e-6, rel=0.1)
    even = np.hypot(*np.diff(flank_curve(gear, side, refine=0.6)[::2], axis=0).T)
    assert step.max() < 1.1 * even.max()


def test_two_springs_with_a_gap():
    H, gap, arm = np.diag([1e-9, 2e-9]), np.array([0.0, 1e-6]), np.array([1.0, 0.8])
    loads, motion, residual = balanced_loads(H, gap, arm, 500.0)
    np.testing.assert_allclose([*loads, motion], [500.0, 0.0, 0.5e-6], rtol=1e-12)
    # p1 = q / 1e-9, p2 = (0.8 q - 1e-6) / 2e-9, p1 + 0.8 p2 = 3000
    loads, motion, residual = balanced_loads(H, gap, arm, 3000.0)
    expected = (3000.0 + 0.8 * 1e-6 / 2e-9) / (1e9 + 0.64 / 2e-9)
    np.testing.assert_allclose([motion, *loads], [expected, expected * 1e9, (0.8 * expected - 1e-6) / 2e-9])
    assert residual < 1e-12


def test_single_pair_has_the_stiffness_of_the_compliance_route(single):
    ours = by_compliance(SUN_PLANET, (16,))
    found = single["held"]
    assert found.pair_force[0].keys() == {0}
    assert found.pair_force[0][0] == pytest.approx(found.force, rel=2e-3)
    assert found.secant[0] == pytest.approx(ours.secant[0], rel=0.01)
    assert found.tangent[0] == pytest.approx(ours.tangent[0], rel=0.015)
    assert found.residual < 1e-9


def test_whole_base_pitches_only_change_the_number_of_the_pair(pair, single):
    found = torque_rotation(pair, 100.0 / 3.0, [2.25], edges=6, refine=0.4)
    assert found.pair_force[0].keys() == {-2}
    assert found.deflection[0] == pytest.approx(single["held"].deflection[0], rel=1e-6)


def test_torque_as_tangential_forces_is_softer(single):
    ratio = single["sliding"].secant[0] / single["held"].secant[0]
    assert 0.94 < ratio < 0.99


def test_same_displacements_under_the_flanks():
    assert depth_compliance() < 1e-11


def test_what_cannot_be_turned_is_refused(pair):
    with pytest.raises(ContactError) as error:
        torque_rotation(pair, 0.0, [0.0])
    assert error.value.code == "E-TORQUE"
    far = GearPair(SET.sun, SET.planet, SET.centre_distance + 5e-3, pair.pressure_angle, STEEL)
    with pytest.raises(ContactError) as error:
        torque_rotation(far, 30.0, [0.0], edges=4, refine=0.4)
    assert error.value.code == "E-CONTACT"
