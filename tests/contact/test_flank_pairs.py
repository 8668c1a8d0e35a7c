"""Separations against brute-force distances between exact tooth flanks."""

import numpy as np
import pytest

from femgear.contact.flank_pairs import admissible_arcs, flank_pair, separation
from femgear.contact.windows import windows
from femgear.gears.gear import Gear

ALPHA = np.deg2rad(20)


def make(teeth, internal=False, shift=0.0, module=2e-3):
    rim = module * (teeth / 2 + 5) if internal else module * (teeth / 2 - 4)
    return Gear(
        teeth=teeth,
        module=module,
        pressure_angle=ALPHA,
        profile_shift=shift,
        face_width=0.02,
        rim_radius=rim,
        internal=internal,
    )


@pytest.fixture(params=["external", "internal"])
def pair(request):
    if request.param == "external":
        gears, a = (make(24), make(37)), 2e-3 * 61 / 2
    else:
        gears, a = (make(24), make(75, internal=True)), 2e-3 * 51 / 2
    return flank_pair(*gears, a, ALPHA)


def test_conjugate_flanks_touch_on_the_line_of_action(pair):
    begin, end = pair.path
    zeta = np.linspace(begin, end, 23)
    gap, foot = separation(pair, zeta, pair.pitch_roll_1 + zeta)
    assert np.abs(gap).max() < 1e-15
    assert np.abs(foot - (pair.pitch_roll_2 - pair.sign * zeta)).max() < 1e-15


def test_separation_is_parabolic_near_the_contact(pair):
    """x^2 / (2 R) with Hertz's relative radius of the two involutes."""
    zeta = 0.3 * pair.path[1]
    rho_1, rho_2 = pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - pair.sign * zeta
    radius = 1.0 / (1.0 / rho_1 + pair.sign / rho_2)
    x = np.array([-2e-5, -1e-5, 1e-5, 2e-5])
    arc = rho_1**2 / (2 * pair.base_radius_1) + x
    gap, _ = separation(pair, zeta, np.sqrt(2 * pair.base_radius_1 * arc))
    over = gap / (x**2 / (2 * radius)) - 1
    # both curvatures change along the flanks: an odd part with x and an even one with its square
    odd, even = 0.5 * (over[2:] - over[1::-1]), 0.5 * (over[2:] + over[1::-1])
    assert odd[1] == pytest.approx(2 * odd[0], rel=1e-3) and abs(odd[0]) < 2e-3
    assert even[1] == pytest.approx(4 * even[0], rel=1e-2) and abs(even[0]) < 3e-6


def flank_2(pair, zeta, roll):
    """Points of flank 2 in the frame of gear 1, from the definition of the involute alone."""
    rb, sign = pair.base_radius_2, pair.sign
    contact = pair.pitch_roll_2 - sign * zeta
    # pitch-point conditions fix the turn of the flank: normal along the line of action at the contact
    turn = contact / rb - pair.pressure_angle - (roll / rb - np.arctan2(roll, rb))
    radius = np.hypot(rb, roll)
    if sign > 0:
        return np.array([pair.centre_distance - radius * np.cos(turn), -radius * np.sin(turn)])
    return np.array([-pair.centre_distance + radius * np.cos(turn), radius * np.sin(turn)])


@pytest.mark.parametrize("outside", [-0.25, -0.1, 0.0, 0.1, 0.25])
def test_separation_is_the_distance_to_the_flank_also_off_the_path(pair, outside):
    begin, end = pair.path
    zeta = (begin if outside < 0 else end) + outside * (end - begin)
    low, high = admissible_arcs(pair, np.array(zeta))
    arc = np.linspace(low, high, 40)[5:-5]
    roll = np.sqrt(2 * pair.base_radius_1 * arc)
    gap, foot = separation(pair, zeta, roll)
    origin = (pair.pitch_roll_1 + zeta) / pair.base_radius_1 - pair.pressure_angle
    turn = origin - (roll / pair.base_radius_1 - np.arctan2(roll, pair.base_radius_1))
    points = np.hypot(pair.base_radius_1, roll) * np.array([np.cos(turn), np.sin(turn)])
    distance = np.linalg.norm(points - flank_2(pair, zeta, foot), axis=0)
    assert distance == pytest.approx(np.abs(gap), abs=1e-12)
    # no other point of the flank is nearer
    fine = flank_2(pair, zeta, np.linspace(*pair.limits_2, 4001))
    nearest = np.linalg.norm(points[:, :, None] - fine[:, None, :], axis=0).min(axis=1)
    assert np.all(nearest > distance - 1e-12)
    assert nearest == pytest.approx(distance, abs=1e-7)
    assert np.all(gap > -1e-15)


def test_admissible_range_ends_where_a_flank_ends(pair):
    zeta = np.linspace(pair.path[0] - 1e-3, pair.path[1] + 1e-3, 31)
    low, high = admissible_arcs(pair, zeta)
    for arc in (low, high):
        roll = np.sqrt(2 * pair.base_radius_1 * arc)
        foot = separation(pair, zeta, roll)[1]
        ends = [np.abs(roll - e) for e in pair.limits_1] + [np.abs(foot - e) for e in pair.limits_2]
        assert np.min(ends, axis=0).max() < 1e-10


def test_windows_on_the_line_of_action_are_those_of_rigid_gears(pair):
    begin, end = pair.path
    zeta = np.linspace(begin - 5e-4, end + 5e-4, 101)
    found = windows(pair, zeta, width=3e-4, cells=20, nearest=1e-5, line_of_action=True)
    assert np.array_equal(found.near, (zeta >= begin) & (zeta <= end))
    profile = windows(pair, zeta, width=3e-4, cells=20, nearest=1e-5, line_of_action=False)
    assert np.all(profile.near >= found.near) and profile.near.sum() > found.near.sum()
    low, high = admissible_arcs(pair, zeta)
    contact = (pair.pitch_roll_1 + zeta) ** 2 / (2 * pair.base_radius_1)
    inside = (contact > low + 1.6e-4) & (contact < high - 1.6e-4)
    assert inside.sum() > 50
    assert not (profile.at_edge.any(axis=0))[inside].any()
    assert (profile.at_edge.any(axis=0))[~inside].all()
