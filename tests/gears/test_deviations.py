"""Errors of the members of a set: closed forms, tooth numbers, periods, wedging."""

import math
from dataclasses import replace

import numpy as np
import pytest
from deviation_sets import ALPHA, PLAY, SET, UM, make_set
from hypothesis import given, settings
from hypothesis import strategies as st

from femgear.contact.flank_pairs import tooth_numbers
from femgear.errors import GeometryError
from femgear.gears.deviations import (
    Ovality,
    Runout,
    body_separation,
    check_deviations,
    common_period,
    least_play,
    no_deviations,
    profile_separation,
    tooth_displacements,
    tooth_separation,
)
from femgear.gears.kinematics import mesh_normals, orientations
from femgear.gears.modifications import FlankForm, ProfileSlope, TipRelief
from femgear.gears.pair import GearPair


def test_profiles_of_both_flanks_add_up():
    """Each mesh takes the loaded flanks; what one mesh loads of a planet is the back of the other."""
    s, zero = SET, np.zeros(2)
    slopes = {"sun": 2, "planet_sun_side": 4, "planet_ring_side": 6, "ring": 8}
    forms = {name: FlankForm((ProfileSlope(-amount * UM),)) for name, amount in slopes.items()}
    d = replace(no_deviations(s), **forms)
    # beyond both ends of the flanks the values are half the slope, positive at the tip
    tip = {"sun": 1.0, "planet": 1.0, "ring": 0.0}
    assert profile_separation(d, s, 0, zero + tip["sun"], zero) == pytest.approx([(1 - 2) * UM] * 2)
    assert profile_separation(d, s, 0, zero, zero + tip["planet"]) == pytest.approx([(2 - 1) * UM] * 2)
    assert profile_separation(d, s, 1, zero + tip["planet"], zero) == pytest.approx([(3 + 4) * UM] * 2)
    assert profile_separation(d, s, 0, zero, 1.0, back=True) == pytest.approx([(3 - 1) * UM] * 2)
    assert profile_separation(d, s, 1, 1.0, 1.0, back=True) == pytest.approx((2 - 4) * UM)


# --- closed forms ------------------------------------------------------------------------------------


def test_tangential_pin_error_counts_in_both_meshes():
    """Bodas and Kahraman (2004): a tangential error e of a pin is e cos(alpha) in each mesh."""
    d = replace(no_deviations(SET), pin_errors=np.array([[0, 0], [0, 20 * UM], [0, 0]]))
    got = body_separation(d, SET, [0.0, 0.6])
    alpha = SET.working_pressure_angle_sun_planet, SET.working_pressure_angle_planet_ring
    assert got[1] == pytest.approx(20 * UM * math.cos(alpha[0]), rel=1e-12)
    assert got[4] == pytest.approx(20 * UM * math.cos(alpha[1]), rel=1e-12)
    assert not np.delete(got, (1, 4), axis=0).any()


def test_radial_pin_error_counts_with_the_difference_of_the_sines():
    d = replace(no_deviations(SET), pin_errors=np.array([[20 * UM, 0], [0, 0], [0, 0]]))
    got = body_separation(d, SET, 0.0)[:, 0]
    alpha = SET.working_pressure_angle_sun_planet, SET.working_pressure_angle_planet_ring
    assert got[0] == pytest.approx(20 * UM * math.sin(alpha[0]), rel=1e-12)
    assert got[3] == pytest.approx(-20 * UM * math.sin(alpha[1]), rel=1e-12)


def test_a_displaced_set_is_a_rotated_view():
    """All bodies displaced alike separate nothing."""
    s = SET
    turned = -orientations(s).ring, -orientations(s).sun
    d = replace(
        no_deviations(s),
        sun_runout=Runout(7 * UM, turned[1] + 0.4),
        ring_runout=Runout(7 * UM, turned[0] + 0.4),
        carrier_runout=Runout(7 * UM, 0.4),
    )
    assert np.abs(body_separation(d, s, 0.0)).max() < 1e-19


def test_ovality_with_one_diameter_is_runout_and_with_two_repeats_after_half_a_turn():
    s, position = SET, np.linspace(0, 110, 300)
    runout = replace(no_deviations(s), ring_runout=Runout(9 * UM, 0.8))
    oval = replace(no_deviations(s), ovality=Ovality(1, 9 * UM, 0.8, inextensional=True))
    assert np.allclose(body_separation(runout, s, position), body_separation(oval, s, position), atol=1e-18)
    oval = replace(no_deviations(s), ovality=Ovality(2, 9 * UM, 0.8))
    got = body_separation(oval, s, position)
    assert not got[:3].any()
    most = 9 * UM * math.sin(s.working_pressure_angle_planet_ring)
    assert got[3:].max() == pytest.approx(most, rel=1e-3)
    assert np.allclose(got, body_separation(oval, s, position + 54), atol=1e-18)
    # 120 deg further on the oval stands turned by 240 deg of its wave
    wave = np.exp(2j * np.pi * position * 2 / 108)
    lines = [2 * (got[3 + n, :-1] * wave[:-1]).mean() for n in range(3)]
    assert np.abs(lines) == pytest.approx([most] * 3, rel=0.1)


def test_ring_crest_at_a_planet_opens_its_mesh():
    s = SET
    crest = Ovality(3, 10 * UM, s.planet_angles[1] - orientations(s).ring)
    got = body_separation(replace(no_deviations(s), ovality=crest), s, 0.0)[:, 0]
    assert got[3:] == pytest.approx([10 * UM * math.sin(s.working_pressure_angle_planet_ring)] * 3, rel=1e-9)


def test_thickness_of_planets_counts_by_its_differences():
    s = PLAY
    d = replace(
        no_deviations(s),
        planet_thickness=np.array([8, 8, 14.0]) * UM,
        sun_thickness=4 * UM,
        ring_thickness=2 * UM,
    )
    half = 3 * UM * math.cos(ALPHA)
    assert body_separation(d, s, 0.0)[:, 0] == pytest.approx([0, 0, half, 0, 0, half], abs=1e-18)
    # both sides together take all of the thickness that both gears lost
    both = body_separation(d, s, 0.0)[:, 0] + body_separation(d, s, 0.0, back=True)[:, 0]
    assert both / UM / math.cos(ALPHA) == pytest.approx([12, 12, 18, 10, 10, 16], rel=1e-9)
    alike = replace(no_deviations(s), planet_thickness=np.full(3, 8 * UM))
    assert alike.ideal and not body_separation(alike, s, 0.0).any()


def test_single_pitches_add_up_and_tooth_zero_stays():
    gear = SET.sun
    single = np.zeros(27)
    single[[3, 10]] = 5 * UM, -5 * UM
    along = tooth_displacements(gear, single=single) / math.cos(ALPHA)
    want = np.where((np.arange(27) >= 3) & (np.arange(27) < 10), 5 * UM, 0.0)
    assert along == pytest.approx(want, abs=1e-18)
    first = np.zeros(27)
    first[[0, 1]] = 5 * UM, -5 * UM  # tooth 0 stands too far from the last, so all others are behind it
    along = tooth_displacements(gear, single=first) / math.cos(ALPHA)
    assert along == pytest.approx(np.where(np.arange(27) > 0, -5 * UM, 0.0), abs=1e-18)
    assert not tooth_displacements(gear).any()


def test_tooth_numbers_are_taken_around_the_gear():
    d = replace(no_deviations(SET), sun_pitch=np.arange(27) * UM, ring_pitch=np.arange(108) * UM)
    got = tooth_separation(d, 1, np.array([[-1, 27], [28, 5]]), 0)
    np.testing.assert_allclose(got, np.array([[26, 0], [1, 5]]) * UM, rtol=1e-12)
    np.testing.assert_allclose(tooth_separation(d, 5, 0, np.array([109, -2])), np.array([1, 106]) * UM, rtol=1e-12)
    assert tooth_separation(d, 0, 2, 2, back=True) == pytest.approx(-2 * UM)


@pytest.mark.parametrize("s", [SET, make_set((24, 30, 84), 4)], ids=["3", "4"])
def test_numbers_of_the_contact_problem_count_the_drawn_teeth(s):
    """Tooth k stands k pitches counter-clockwise of tooth 0; its loaded flank is at the pitch point."""
    N, psi = s.n_planets, np.asarray(s.planet_angles)
    index = np.tile(np.arange(-3, 4), (2 * N, 1))
    one, two = tooth_numbers(s, index)
    for mesh in range(2 * N):
        for i, k, m in zip(index[mesh], one[mesh], two[mesh]):
            state = orientations(s, -(s.mesh_phases[mesh] + i))
            planet = state.planets[mesh % N] + (k if mesh >= N else m) * s.planet.pitch_angle
            other = state.sun + k * s.sun.pitch_angle if mesh < N else state.ring + m * s.ring.pitch_angle
            facing = psi[mesh % N] + (np.pi if mesh < N else 0.0)
            gear = s.sun if mesh < N else s.ring
            # the pitch point lies on the left flank of sun and ring, of the planet on that of the mesh
            for angle, point, pitch in (
                (other, psi[mesh % N], gear.pitch_angle),
                (planet, facing, (1 if mesh < N else -1) * s.planet.pitch_angle),
            ):
                off = (point - angle + np.pi) % (2 * np.pi) - np.pi
                assert 0.15 < off / pitch < 0.35


# --- periods ------------------------------------------------------------------------------------------


def with_sun(**change):
    return replace(no_deviations(SET), **change)


def test_what_turns_with_no_body_keeps_one_period():
    d = with_sun(
        sun=FlankForm((TipRelief(1e-5, 6e-3),)),
        pin_errors=np.full((3, 2), 5 * UM),
        carrier_runout=Runout(5 * UM, 0.3),
        planet_thickness=np.array([1.0, 2.0, 3.0]) * UM,
        sun_pitch=np.full(27, 3 * UM),
        ovality=Ovality(108, 2 * UM),
    )
    assert common_period(d, SET)[0] == 1
    position = np.linspace(0, 1, 7)
    assert np.allclose(body_separation(d, SET, position), body_separation(d, SET, position + 1), atol=1e-18)
    assert common_period(no_deviations(SET), SET) == (1, "one mesh period: no deviation turns with a body")


@pytest.mark.parametrize(
    ("change", "periods"),
    [
        ({"sun_runout": Runout(1e-6)}, 27),
        ({"ring_runout": Runout(1e-6)}, 108),
        ({"sun_runout": Runout(1e-6), "ring_runout": Runout(1e-6)}, 108),
        ({"planet_runout": (Runout(), Runout(1e-6), Runout())}, 40),
        ({"sun_pitch": np.eye(1, 27, 4)[0] * 1e-6}, 27),
        ({"sun_pitch": np.tile([0.0, 1e-6, 2e-6], 9)}, 3),
        ({"ovality": Ovality(2, 1e-6)}, 54),
        ({"ovality": Ovality(5, 1e-6)}, 108),
        ({"ovality": Ovality(3, 1e-6), "planet_pitch": np.tile([0.0, 1e-6], (3, 20))}, 36),
    ],
)
def test_periods(change, periods):
    d = with_sun(**change)
    found, message = common_period(d, SET)
    assert found == periods and str(periods) in message
    position = np.linspace(0, 1, 5)
    body = body_separation(d, SET, position), body_separation(d, SET, position + periods)
    assert np.allclose(*body, atol=1e-17)
    k = np.arange(-5, 5)
    # over the period every body goes on by as many teeth: sun forwards, planets and ring backwards
    for mesh in range(6):
        first, second = (periods, -periods) if mesh < 3 else (-periods, -periods)
        for back in (False, True):
            here = tooth_separation(d, mesh, k, 2 * k, back=back)
            assert np.array_equal(here, tooth_separation(d, mesh, k + first, 2 * k + second, back=back))


def test_hunting_is_capped_and_said():
    d = with_sun(sun_runout=Runout(1e-6), planet_runout=(Runout(1e-6),) * 3)
    assert common_period(d, SET, limit=1080)[0] == 1080
    periods, message = common_period(d, SET)
    assert periods == 108
    assert "one turn of the carrier" in message and "1080" in message and "does not close" in message
    periods, message = common_period(d, SET, limit=50)
    assert periods == 50 and "1080" in message and "limit of 50" in message


@settings(max_examples=40, deadline=None)
@given(step=st.sampled_from([1, 3, 9, 27]), seed=st.integers(0, 10**6), tau=st.floats(-50, 50))
def test_everything_repeats_after_the_common_period(step, seed, tau):
    rng = np.random.default_rng(seed)
    d = with_sun(
        sun_pitch=np.tile(rng.normal(size=step), 27 // step) * UM,
        ring_runout=Runout(UM * rng.integers(0, 2), rng.normal()),
        ovality=Ovality(int(rng.integers(1, 7)), UM * rng.integers(0, 2), rng.normal(), bool(rng.integers(0, 2))),
    )
    periods, _ = common_period(d, SET)
    assert np.allclose(body_separation(d, SET, tau), body_separation(d, SET, tau + periods), rtol=0, atol=1e-16)
    k = np.arange(27)
    assert np.array_equal(tooth_separation(d, 0, k, 0), tooth_separation(d, 0, k + periods, 0))


# --- refusals and warnings ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"ring": FlankForm((ProfileSlope(1.0),))}, "goes on beyond its end"),
    ],
)
def test_refusals(change, text):
    with pytest.raises(GeometryError, match=text) as info:
        check_deviations(with_sun(**change), SET)
    assert info.value.exit_code == 2


def test_arrays_cannot_be_changed_and_mesh_normals_are_unit_vectors():
    d = no_deviations(SET)
    with pytest.raises(ValueError, match="read-only"):
        d.sun_pitch[0] = 1.0
    assert np.linalg.norm(mesh_normals(SET), axis=1) == pytest.approx(1.0, rel=1e-14)


def test_play_left_and_wedging():  # bad input 50
    tight, loose = no_deviations(PLAY), PLAY.backlash_sun_planet
    assert check_deviations(tight, PLAY) == ()
    single, whole = least_play(tight, PLAY)
    assert single == pytest.approx(min(loose, PLAY.backlash_planet_ring), rel=1e-12)
    assert whole == pytest.approx(loose + PLAY.backlash_planet_ring, rel=1e-12)
    # the back flanks of planet 1 meet when its pin lags by the play of both meshes
    cosines = math.cos(PLAY.working_pressure_angle_sun_planet) + math.cos(PLAY.working_pressure_angle_planet_ring)
    limit = (loose + PLAY.backlash_planet_ring) / cosines
    for sign in (1.0, -1.0):
        below, above = (
            replace(tight, pin_errors=np.array([[0, sign * f * limit], [0, 0], [0, 0]])) for f in (0.99, 1.01)
        )
        assert check_deviations(below, PLAY) == ()
        (warning,) = check_deviations(above, PLAY)
        assert warning.code == "W-WEDGING"
        assert min(least_play(above, PLAY)) == pytest.approx(-0.01 * limit * cosines, rel=1e-6)
        assert "between different planets" in str(warning)
    # a planet pushed towards the sun jams in that mesh
    deep = replace(tight, pin_errors=np.array([[-0.1e-3, 0], [0, 0], [0, 0]]))
    assert "in one mesh" in str(check_deviations(deep, PLAY)[0])
    thin = replace(deep, sun_thickness=50 * UM)
    assert check_deviations(thin, PLAY) == ()
    assert "pin errors may exceed" in str(check_deviations(deep, PLAY)[0])


def test_a_pair_has_no_pins_that_use_up_its_play():
    pair = GearPair(PLAY.sun, PLAY.planet, PLAY.centre_distance)
    pitch = np.zeros(PLAY.sun.teeth)
    pitch[0] = 1.01 * pair.backlash
    (warning,) = check_deviations(replace(no_deviations(pair), sun_pitch=pitch), pair)
    assert warning.code == "W-WEDGING" and "pin" not in str(warning)


def test_pitch_and_material_use_up_play():
    pitch = np.zeros(27)
    pitch[0] = 1.01 * PLAY.backlash_sun_planet
    high = replace(no_deviations(PLAY), sun_pitch=pitch)
    assert least_play(high, PLAY)[0] < 0
    thick = replace(no_deviations(PLAY), sun=FlankForm((ProfileSlope(2.02 * PLAY.backlash_sun_planet),)))
    assert least_play(thick, PLAY)[0] < 0
    assert least_play(replace(thick, sun=FlankForm()), PLAY)[0] > 0
