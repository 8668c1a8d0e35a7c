"""Life of bearings: printed lives, factors of ISO 281 as others print them, identities, orders of a known bearing."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.bearing_life import (
    basic_rating_life,
    equivalent_load,
    life_factor,
    load_factors,
    oil_viscosity,
    passing_orders,
    reference_load,
    reference_rating_life,
    reference_viscosity,
)
from femgear.system.rolling_bearings import BallBearing, RollerBearing, bearing_state, solve_motion

DEEP = BallBearing(7, 11.5e-3, 43.5e-3)
LOOSE = replace(DEEP, clearance=10e-6)
ANGULAR = BallBearing(12, 10e-3, 60e-3, contact_angle=math.radians(40.0))
CYLINDRICAL = RollerBearing("cylindrical", 18, 20e-3, 100e-3, 12e-3)
TAPERED = RollerBearing("tapered", 17, 16e-3, 62e-3, 9e-3, contact_angle=math.radians(14.0))


def balls(degrees, rows=1):
    return replace(ANGULAR, contact_angle=math.radians(degrees), rows=rows, row_distance=0.02 * (rows - 1))


# public tests of the repository minzhun/ISO16281, numbers of MASTA, C 23.4 kN
@pytest.mark.parametrize(
    "bearing, load, printed",
    [
        (DEEP, (1000, 0, 0, 0, 0, 0), 13163.019),
        (DEEP, (0, 0, 1000, 0, 0, 0), 2222.7318),
        (LOOSE, (1000, 0, 0, 0, 0, 0), 10795.7948),
        (LOOSE, (0, 0, 1000, 0, 0, 0), 3115.8781),
        (LOOSE, (1000, 0, 1000, 0, 0, 0), 1630.5367),
        (DEEP, (0, 0, 0, 1, 0, 0), 785144.7521),
        (LOOSE, (1000, 0, 1000, 1, 0, 0), 1627.7479),
    ],
)
def test_reference_lives_are_those_of_another_program(bearing, load, printed):
    assert reference_rating_life(solve_motion(bearing, load), 23400.0) == pytest.approx(printed, rel=5e-4)


def test_two_rows_share_the_load_as_their_rating_says():
    """C of two rows is 2^0.7 that of one with balls, 2^(7/9) with rollers: half the load each has the same life."""
    for single, exponent in ((DEEP, 0.7), (CYLINDRICAL, 7.0 / 9.0)):
        state = bearing_state(single, (20e-6, 0, 0, 0, 0, 0))
        both = bearing_state(replace(single, rows=2), (20e-6, 0, 0, 0, 0, 0))
        force, power = state.force[0], 3.0 if single is DEEP else 4.0
        alone = reference_rating_life(state, 1e4)
        assert both.force[0] == pytest.approx(2.0 * force, rel=1e-14)
        ratio = reference_rating_life(both, 1e4 * 2.0**exponent) / alone
        # two rows in series of failures: Weibull slopes 10/9 and 9/8
        assert ratio == pytest.approx(2.0 ** (-0.9 if power == 3.0 else -8.0 / 9.0), rel=1e-12)


def test_life_of_a_turn_is_that_of_its_states():
    state = solve_motion(LOOSE, (1000, 0, 0, 0, 0, 0))
    assert reference_rating_life([state, state], 2e4) == pytest.approx(reference_rating_life(state, 2e4), rel=1e-14)
    states = [solve_motion(LOOSE, (1000, 0, 0, 0, 0, 0), first_angle=a) for a in np.linspace(0, 2 * np.pi / 7, 6)[:-1]]
    lives = [reference_rating_life(part, 2e4) for part in states]
    assert min(lives) <= reference_rating_life(states, 2e4) <= max(lives)
    assert reference_rating_life(states, 2e4, rotating="outer") != reference_rating_life(states, 2e4)


def test_equal_loads_make_the_rotating_ring_irrelevant():
    state = solve_motion(DEEP, (0, 0, 500, 0, 0, 0))
    lives = [reference_rating_life(state, 2e4, rotating=ring) for ring in ("inner", "outer")]
    assert lives[0] == pytest.approx(lives[1], rel=1e-9)


def test_reference_load_has_the_reference_life():
    for bearing in (DEEP, CYLINDRICAL):
        life = reference_rating_life(bearing_state(bearing, (20e-6, 0, 0, 0, 0, 0)), 2e4)
        load = reference_load(bearing, life, 2e4)
        assert basic_rating_life(bearing, load, 0.0, 2e4) == pytest.approx(life, rel=1e-12)
    assert reference_load(DEEP, math.inf, 2e4) == 0.0


def test_without_load_a_bearing_lives_for_ever():
    assert reference_rating_life(bearing_state(LOOSE, np.zeros(6)), 2e4) == math.inf
    assert basic_rating_life(DEEP, 0.0, 0.0, 2e4) == math.inf


def test_a_clean_radial_load_without_clearance_has_about_the_basic_life():
    """ISO/TS 16281 is calibrated there: a few per cent for balls, for rollers what edge loads take from the rating."""
    state = solve_motion(DEEP, (1000, 0, 0, 0, 0, 0))
    ratio = reference_rating_life(state, 23400.0) / basic_rating_life(DEEP, 1000.0, 0.0, 23400.0)
    assert 1.0 < ratio < 1.05


def test_factors_of_catalogues():
    """One row of 40 degrees: e 1.14, 0.35, 0.57 (SKF 7206 BE); deep groove and others by ISO 281, Table 3."""
    angular = load_factors(balls(40.0), 2000.0)
    assert (angular.limit, angular.below, angular.above) == (1.14, (1.0, 0.0), (0.35, 0.57))
    pair = load_factors(balls(40.0, 2), 2000.0)
    assert (pair.limit, pair.below, pair.above) == (1.14, (1.0, 0.55), (0.57, 0.93))
    axial = 1.38e6 * DEEP.balls * DEEP.ball_diameter**2
    deep = load_factors(DEEP, axial)
    assert (deep.limit, *deep.above) == pytest.approx((0.30, 0.56, 1.45), rel=1e-12)
    five = load_factors(balls(5.0), 1.38e6 * 12 * 1e-4)
    assert (five.limit, *five.above) == pytest.approx((0.30, 0.56, 1.45), rel=1e-12)
    fifteen = load_factors(balls(15.0, 2), 1.38e6 * 12 * 1e-4)
    assert (fifteen.limit, *fifteen.below, *fifteen.above) == pytest.approx((0.47, 1.0, 1.34, 0.72, 1.93), rel=1e-12)
    between = load_factors(balls(22.5), 0.0)
    assert (between.limit, *between.above) == pytest.approx((0.625, 0.42, 0.935), rel=1e-12)
    tapered = load_factors(TAPERED, 0.0)
    tangent = math.tan(TAPERED.contact_angle)
    assert (tapered.limit, *tapered.above) == pytest.approx((1.5 * tangent, 0.4, 0.4 / tangent), rel=1e-12)
    assert load_factors(CYLINDRICAL, 100.0).limit == math.inf


def test_factors_of_thrust_bearings():
    """ISO 281, Table 5: at 45 degrees e 1.25, X 1.18 and Y 0.59 up to it, X 0.66 and Y 1 beyond it."""
    steep = balls(45.0 + 1e-7, 2)
    factors = load_factors(steep, 100.0)
    assert (factors.limit, *factors.below, *factors.above) == pytest.approx((1.25, 1.18, 0.59, 0.66, 1.0), abs=5e-3)
    assert equivalent_load(balls(90.0), 0.0, 700.0) == 700.0
    rollers = load_factors(replace(TAPERED, contact_angle=math.radians(60.0)), 100.0)
    assert rollers.above == pytest.approx((math.tan(math.radians(60.0)), 1.0))


def test_equivalent_load_and_basic_life():
    assert equivalent_load(balls(40.0), 1000.0, 1000.0) == 1000.0
    assert equivalent_load(balls(40.0), 1000.0, 2000.0) == pytest.approx(0.35 * 1000.0 + 0.57 * 2000.0)
    assert basic_rating_life(balls(40.0), 1000.0, 0.0, 1e4) == pytest.approx(1000.0)
    assert basic_rating_life(CYLINDRICAL, 1000.0, 0.0, 8e3) == pytest.approx(8.0 ** (10.0 / 3.0))


def test_life_factor_joins_its_ranges_and_keeps_its_ends():
    for bearing in (DEEP, CYLINDRICAL):
        for edge in (0.4, 1.0):
            below, above = (life_factor(bearing, edge + shift, 0.5, 0.2) for shift in (-1e-9, 1e-9))
            assert below == pytest.approx(above, rel=2e-3)
        assert life_factor(bearing, 0.1, 0.5, 0.2) == pytest.approx(0.1, rel=0.02)
        assert life_factor(bearing, 2.0, 0.0, 0.2) == pytest.approx(0.1, rel=1e-12)
        assert life_factor(bearing, 4.0, 1.0, 5.0) == 50.0
        assert life_factor(bearing, 9.0, 0.5, 0.1) == life_factor(bearing, 4.0, 0.5, 0.1)
        assert life_factor(bearing, 3.0, 0.5, 0.1) < life_factor(bearing, 3.5, 0.5, 0.1)


@pytest.mark.parametrize(
    "kappa, ratio, chart", [(4.0, 0.005, 0.38), (4.0, 0.02, 0.95), (4.0, 0.05, 2.5), (4.0, 0.1, 7.0)]
)
def test_life_factor_of_a_published_chart(kappa, ratio, chart):
    """Radial ball bearings, read from the chart of a maker (SKF) by another program: to the width of a line."""
    assert life_factor(DEEP, 4.0, 1.0, ratio) == pytest.approx(chart, rel=0.05)


def test_thrust_bearings_feel_a_third_of_the_load_ratio():
    thrust = balls(90.0)
    assert life_factor(thrust, 2.0, 0.5, 0.6) == pytest.approx(life_factor(DEEP, 2.0, 0.5, 0.2), rel=1e-12)
    rollers = replace(TAPERED, contact_angle=math.radians(60.0))
    assert life_factor(rollers, 2.0, 0.5, 0.5) == pytest.approx(life_factor(TAPERED, 2.0, 0.5, 0.2), rel=1e-12)


def test_passing_orders_of_a_bearing_that_everybody_measures():
    """SKF 6205-2RS of the bearing data center of Case Western Reserve University, printed there per turn."""
    orders = passing_orders(BallBearing(9, 0.3126 * 25.4e-3, 1.537 * 25.4e-3))
    printed = (0.39828, 3.5848, 5.4152, 4.7135)
    ours = (orders.cage, orders.outer, orders.inner, 2.0 * orders.spin)
    # diameters with four digits
    assert ours == pytest.approx(printed, rel=2e-4)


def test_orders_of_rings_that_both_turn():
    orders = passing_orders(TAPERED)
    assert orders.inner + orders.outer == pytest.approx(TAPERED.rollers, rel=1e-14)
    together = orders.frequencies(10.0, 10.0)
    assert together == {"cage": 10.0, "outer": 0.0, "inner": 0.0, "spin": 0.0}
    assert orders.cage_speed(20.0) == pytest.approx(20.0 * orders.cage)
    still = orders.frequencies(0.0, 20.0)
    # the inner ring stands: elements pass it with the cage
    assert still["inner"] == pytest.approx(TAPERED.rollers * still["cage"], rel=1e-12)
    assert orders.cage_speed(-5.0, 5.0) == pytest.approx(5.0 - 10.0 * orders.cage)


def test_numbers_out_of_range_are_refused():
    state = bearing_state(DEEP, (20e-6, 0, 0, 0, 0, 0))
    for call, code in (
        (lambda: basic_rating_life(DEEP, -1.0, 0.0, 1e4), "E-RANGE"),
        (lambda: basic_rating_life(DEEP, 1.0, 0.0, 0.0), "E-RANGE"),
        (lambda: reference_rating_life(state, math.nan), "E-RANGE"),
        (lambda: reference_rating_life([], 1e4), "E-COUNT"),
        (lambda: reference_rating_life([state, bearing_state(LOOSE, np.zeros(6))], 1e4), "E-COUNT"),
        (lambda: reference_rating_life(state, 1e4, rotating="both"), "E-CHOICE"),
        (lambda: life_factor(DEEP, 0.05, 0.5, 0.1), "E-RANGE"),
        (lambda: life_factor(DEEP, 1.0, 1.5, 0.1), "E-RANGE"),
        (lambda: life_factor(DEEP, 1.0, 0.5, -0.1), "E-RANGE"),
        (lambda: life_factor(DEEP, math.nan, 0.5, 0.1), "E-RANGE"),
    ):
        with pytest.raises(CaseError) as caught:
            call()
        assert caught.value.code == code


def test_the_viscosity_that_a_bearing_needs_joins_at_1000_rpm():
    below, above = (reference_viscosity(0.07, turns * math.pi / 30.0) for turns in (999.999, 1000.0))
    # 45000 n^-0.83 and 4500 n^-0.5 meet within their rounding: 10^0.01
    assert below == pytest.approx(above, rel=0.025)
    assert reference_viscosity(0.07, 1500.0 * math.pi / 30.0) == pytest.approx(4500e-6 / math.sqrt(1500.0 * 70.0))
    with pytest.raises(CaseError, match="E-RANGE"):
        reference_viscosity(0.07, 0.0)


def test_the_viscosity_of_an_oil_goes_through_its_points():
    for temperature, value in ((40.0, 100.0), (100.0, 11.0)):
        assert 1e6 * oil_viscosity(100e-6, 11e-6, temperature) == pytest.approx(value, rel=1e-12)
    # ISO VG 100 with a viscosity index of 95 at 70 degrees: charts have 27 to 28 mm^2/s
    assert 1e6 * oil_viscosity(100e-6, 11e-6, 70.0) == pytest.approx(27.5, rel=0.03)
    with pytest.raises(CaseError, match="E-RANGE"):
        oil_viscosity(11e-6, 100e-6, 70.0)
