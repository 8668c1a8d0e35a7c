"""Rolling bearings: printed numbers of another program, integrals of Hertz and Sjoevall, invariances, refusals."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from femgear.errors import CaseError
from femgear.system.rolling_bearings import (
    BallBearing,
    RollerBearing,
    bearing_state,
    point_contact,
    sliding_state,
    solve_motion,
)

DEEP = BallBearing(7, 11.5e-3, 43.5e-3)
LOOSE = replace(DEEP, clearance=10e-6)
ANGULAR = BallBearing(12, 10e-3, 60e-3, contact_angle=math.radians(25.0))
PAIR = replace(ANGULAR, rows=2, row_distance=20e-3, axial_preload=5e-6)
CYLINDRICAL = RollerBearing("cylindrical", 18, 20e-3, 100e-3, 12e-3)
TAPERED = RollerBearing("tapered", 17, 16e-3, 62e-3, 9e-3, contact_angle=math.radians(14.0))
SPHERICAL = RollerBearing(
    "spherical", 15, 14e-3, 75e-3, 13e-3, contact_angle=math.radians(11.0), rows=2, row_distance=-25e-3
)
ALL = {
    "deep groove": LOOSE,
    "angular contact": ANGULAR,
    "pair": PAIR,
    "cylindrical": CYLINDRICAL,
    "needle": RollerBearing("needle", 20, 15e-3, 30e-3, 3e-3, clearance=8e-6),
    "tapered": TAPERED,
    "tapered, O": replace(TAPERED, rows=2, row_distance=30e-3, axial_preload=3e-6),
    "tapered, X": replace(TAPERED, rows=2, row_distance=-30e-3, clearance=4e-6),
    "spherical": SPHERICAL,
}
# motions that load every kind, one of them barely
MOTIONS = np.array(
    [
        [20e-6, 5e-6, 12e-6, 2e-4, -3e-4, 0.1],
        [-30e-6, 11e-6, 40e-6, -1e-3, 4e-4, 0.0],
        [8e-6, -6e-6, 2e-6, 0.0, 1e-4, 0.0],
    ]
)


# public tests of the repository minzhun/ISO16281, numbers of MASTA: E 210 GPa, groove radii 0.52 and 0.53
@pytest.mark.parametrize(
    "bearing, load, printed",
    [
        (DEEP, (1000, 0, 0, 0), (15.1101e-6, 0, 0)),
        (DEEP, (0, 0, 1000, 0), (0, 133.5381e-6, 0)),
        (LOOSE, (1000, 0, 0, 0), (21.223e-6, 0, 0)),
        (LOOSE, (0, 0, 1000, 0), (0, 149.1717e-6, 0)),
        (LOOSE, (1000, 0, 1000, 0), (19.5923e-6, 146.4603e-6, 2.6872e-3)),
        (DEEP, (0, 0, 0, 1), (None, 0, 3.6957e-3)),
        (LOOSE, (1000, 0, 1000, 1), (19.7144e-6, 146.3084e-6, 2.7239e-3)),
    ],
)
def test_motions_under_load_are_those_of_another_program(bearing, load, printed):
    motion = solve_motion(bearing, (*load, 0, 0)).motion
    ours = (math.hypot(*motion[:2]), motion[2], math.hypot(*motion[3:5]))
    for value, wanted in zip(ours, printed):
        if wanted is not None:
            assert value == pytest.approx(wanted, rel=1e-4, abs=1e-12)


def test_point_contact_is_that_of_the_integrals_of_hertz():
    """Both curvatures, pressure and approach from the potential of an ellipsoid of pressure (Johnson, 1985, 3.6)."""
    contact, load = point_contact(DEEP), 700.0
    ball, gamma = DEEP.ball_diameter / 2.0, DEEP.ball_diameter / DEEP.pitch_diameter
    plane = 0.5 * DEEP.youngs_modulus / (1.0 - DEEP.poisson_ratio**2)
    deflection, pressures = 0.0, []
    for ratio, sign, groove in zip(contact.axis_ratios, (1.0, -1.0), (0.52, 0.53)):
        across = 1.0 / ball + sign / (0.5 * DEEP.pitch_diameter * (1.0 - sign * gamma))
        along = 1.0 / ball - 1.0 / (groove * DEEP.ball_diameter)

        def integral(cosines, power, ratio=ratio):
            def integrand(t):
                return math.cos(t) ** cosines / (ratio**2 * math.cos(t) ** 2 + math.sin(t) ** 2) ** power

            return ratio * quad(integrand, 0.0, math.pi / 2.0)[0]

        assert integral(2, 1.5) / integral(2, 0.5) == pytest.approx(along / across, rel=1e-9)
        smaller = integral(2, 0.5)
        pressure = (3.0 * load * (plane * across) ** 2 / (8.0 * math.pi * ratio * smaller**2)) ** (1.0 / 3.0)
        pressures.append(pressure)
        deflection += pressure / plane * integral(0, 0.5) * 2.0 * pressure * smaller / (plane * across)
    assert contact.stiffness * deflection**1.5 == pytest.approx(load, rel=1e-9)
    assert contact.pressure * load ** (1.0 / 3.0) == pytest.approx(max(pressures), rel=1e-9)


def sjoevall(exponent, power):
    """Mean over the circle of cos^exponent on the loaded half, to a power of the cosine more."""
    return quad(lambda t: math.cos(t) ** (exponent + power), -math.pi / 2, math.pi / 2)[0] / (2.0 * math.pi)


def test_roller_bearing_under_a_radial_load():
    """Motion, stiffness and largest load by Sjoevall's integral."""
    bearing = replace(CYLINDRICAL, profile="none")
    assert sjoevall(10.0 / 9.0, 1) == pytest.approx(0.2447986, abs=5e-8)
    tight = solve_motion(bearing, (50e3, 0, 0, 0, 0, 0))
    assert tight.motion[0] == pytest.approx(32.249e-6, abs=5e-10)
    assert tight.stiffness[0, 0] == pytest.approx(10.0 / 9.0 * 50e3 / tight.motion[0], rel=1e-9)
    assert tight.stiffness[0, 0] == pytest.approx(1722.72e6, rel=1e-5)
    assert tight.load.max() == pytest.approx(50e3 / 18.0 / sjoevall(10.0 / 9.0, 1), rel=2e-4)
    loose = solve_motion(replace(bearing, clearance=20e-6), (50e3, 0, 0, 0, 0, 0))
    assert loose.motion[0] == pytest.approx(44.684e-6, abs=1e-9)
    assert loose.stiffness[0, 0] == pytest.approx(1704.36e6, rel=1e-5)


def test_line_pressure_is_that_of_a_cylinder_on_the_inner_ring():
    state = bearing_state(replace(CYLINDRICAL, profile="none"), (20e-6, 0, 0, 0, 0, 0))
    inner = 0.5 * (CYLINDRICAL.pitch_diameter - CYLINDRICAL.roller_diameter)
    curvature = 2.0 / CYLINDRICAL.roller_diameter + 1.0 / inner
    modulus = 0.5 * 2.1e11 / 0.91
    wanted = math.sqrt(state.load.max() / CYLINDRICAL.effective_length * modulus * curvature / math.pi)
    assert state.pressure == pytest.approx(wanted, rel=1e-12)


def test_tapered_bearing_with_half_of_its_rollers_loaded():
    """Without axial motion F_a = F_r tan(a) J_a / J_r; the 1.260 of a catalogue (NSK E728g, 5.1) has exponent 1.1."""
    many = replace(TAPERED, rollers=21, profile="none", pitch_diameter=80e-3)
    force = bearing_state(many, (25e-6, 0, 0, 0, 0, 0)).force
    ratio = sjoevall(10.0 / 9.0, 0) / sjoevall(10.0 / 9.0, 1)
    assert sjoevall(1.1, 0) / sjoevall(1.1, 1) == pytest.approx(1.260, abs=6e-4)
    assert force[2] / force[0] / math.tan(many.contact_angle) == pytest.approx(ratio, rel=2e-3)


@pytest.mark.parametrize("name", ALL)
def test_stiffness_is_symmetric_and_the_slope_of_the_force(name):
    bearing = ALL[name]
    for motion in MOTIONS:
        state = bearing_state(bearing, motion, first_angle=0.1)
        assert (state.stiffness == state.stiffness.T).all()
        for axis, step in enumerate((1e-10, 1e-10, 1e-10, 1e-8, 1e-8, 1e-3)):
            shift = step * np.eye(6)[axis]
            above, below = (bearing_state(bearing, motion + s, first_angle=0.1).force for s in (shift, -shift))
            slope, size = (above - below) / (2.0 * step), np.abs(state.stiffness[:, axis]).max()
            np.testing.assert_allclose(state.stiffness[:, axis], slope, rtol=1e-6, atol=max(1e-6 * size, 1e-3))
    assert not state.stiffness[5].any()


@pytest.mark.parametrize("name", ALL)
def test_turning_by_one_element_or_any_angle_turns_the_state(name):
    bearing = ALL[name]
    for angle, first in ((2.0 * math.pi / bearing.elements, 0.0), (0.7, 0.7)):
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        whole = np.eye(6)
        whole[:2, :2] = whole[3:5, 3:5] = turn
        state, turned = (
            bearing_state(bearing, MOTIONS[0]),
            bearing_state(bearing, whole @ MOTIONS[0], first_angle=first),
        )
        size = np.abs(state.force).max()
        np.testing.assert_allclose(turned.force, whole @ state.force, rtol=0, atol=1e-10 * size)
        wanted = whole @ state.stiffness @ whole.T
        np.testing.assert_allclose(turned.stiffness, wanted, rtol=0, atol=1e-10 * np.abs(wanted).max())


@pytest.mark.parametrize("name", ALL)
def test_mirrored_motions_have_mirrored_forces(name):
    """Across the plane of x and z; along the axis with the sense of the contact angle reversed."""
    bearing = ALL[name]
    motion, force = MOTIONS[1], bearing_state(bearing, MOTIONS[1]).force
    size = np.abs(force).max()
    side = np.array([1, -1, 1, -1, 1, -1])
    mirrored = bearing_state(bearing, side * motion).force
    np.testing.assert_allclose(mirrored, side * force, rtol=0, atol=1e-10 * size)
    flat, other = np.array([1, 1, -1, -1, -1, 1]), replace(bearing, contact_angle=-bearing.contact_angle)
    mirrored = bearing_state(other, flat * motion).force
    np.testing.assert_allclose(mirrored, flat * force, rtol=0, atol=1e-10 * size)


def test_a_contact_angle_above_zero_carries_along_z():
    for bearing in (ANGULAR, TAPERED):
        pushed = bearing_state(bearing, (0, 0, 10e-6, 0, 0, 0))
        assert pushed.force[2] > 100.0 and (pushed.angle > 0.0).all()
        assert bearing_state(bearing, (0, 0, -10e-6, 0, 0, 0)).force[2] == 0.0
        reversed_sense = replace(bearing, contact_angle=-bearing.contact_angle)
        assert bearing_state(reversed_sense, (0, 0, -10e-6, 0, 0, 0)).force[2] == -pushed.force[2]
    both = bearing_state(DEEP, (0, 0, 100e-6, 0, 0, 0)).force[2]
    assert both > 100.0 and bearing_state(DEEP, (0, 0, -100e-6, 0, 0, 0)).force[2] == -both


@pytest.mark.slow
def test_force_is_continuous_through_loss_of_contact():
    for bearing in ALL.values():
        path = np.linspace(1.0, -0.6, 4001)[:, None] * MOTIONS[0]
        forces = np.array([bearing_state(bearing, motion).force for motion in path])
        jumps = np.abs(np.diff(forces, axis=0)).max(axis=0)
        assert (jumps <= 3e-3 * np.abs(forces).max(axis=0) + 1e-12).all()


def test_tilt_springs_of_two_rows():
    """Back to back the lines of contact meet the axis far apart: stiffer against tilt, equal along the axis."""
    plain = replace(ALL["tapered, O"], profile="none")
    back, face = (replace(plain, row_distance=distance) for distance in (30e-3, -30e-3))
    stiff, soft = (bearing_state(bearing, np.zeros(6)).stiffness for bearing in (back, face))
    assert stiff[2, 2] == pytest.approx(soft[2, 2], rel=1e-12)
    cosine, sine = math.cos(plain.contact_angle), math.sin(plain.contact_angle)
    long, short = (15e-3 * cosine + sign * 31e-3 * sine for sign in (1.0, -1.0))
    roller = plain.effective_length**2 / 12.0 * (1.0 - plain.laminae**-2.0)
    assert stiff[4, 4] / soft[4, 4] == pytest.approx((long**2 + roller) / (short**2 + roller), rel=1e-12)
    assert np.abs(bearing_state(back, np.zeros(6)).force).max() < 1e-9
    balls = [bearing_state(replace(PAIR, row_distance=d), np.zeros(6)).stiffness[4, 4] for d in (20e-3, -20e-3)]
    assert balls[0] > 10.0 * balls[1]


def test_preload_removes_clearance_and_stiffens():
    stiffness = [bearing_state(replace(PAIR, axial_preload=p), np.zeros(6)).stiffness[0, 0] for p in (2e-6, 8e-6)]
    # a point contact: the square root of the deflection, a little more by the contact angle
    assert 1.98 < stiffness[1] / stiffness[0] < 2.05
    tight = bearing_state(replace(CYLINDRICAL, clearance=-4e-6), np.zeros(6))
    assert (tight.load > 0.0).all() and np.abs(tight.force).max() < 1e-6


def test_self_aligning_and_plain_roller_bearings_leave_motions_free():
    spherical = bearing_state(SPHERICAL, MOTIONS[0])
    assert not spherical.force[3:].any() and not spherical.stiffness[3:].any() and spherical.force[2] > 0.0
    cylindrical = bearing_state(CYLINDRICAL, MOTIONS[0])
    assert cylindrical.force[2] == 0.0 and not cylindrical.stiffness[2].any() and cylindrical.force[3:5].any()


def test_logarithmic_profile_keeps_load_off_the_ends():
    tilted = (20e-6, 0, 0, 0, 5e-4, 0)
    plain, crowned = (bearing_state(replace(CYLINDRICAL, profile=p), tilted) for p in ("none", "logarithmic"))
    loaded = plain.load[0].argmax()
    assert crowned.lamina_load[0, loaded, [0, -1]].max() < 0.6 * plain.lamina_load[0, loaded, [0, -1]].max()
    assert crowned.lamina_load.sum(axis=2) == pytest.approx(crowned.load)


def test_long_rollers_are_straight_in_the_middle():
    long = replace(CYLINDRICAL, effective_length=40e-3, laminae=41)
    flat, tilted = bearing_state(long, (20e-6, 0, 0, 0, 0, 0)), 0.5 * (40e-3 - 2.5 * 12e-3)
    places = (np.arange(41) - 20) * 40e-3 / 41
    load = flat.lamina_load[0, 0]
    middle = np.abs(places) <= tilted
    assert np.ptp(load[middle]) <= 1e-12 * load.max() and load[0] < load[20]


@pytest.mark.parametrize("name", ALL)
def test_loads_made_by_a_motion_are_solved_for_it(name):
    bearing = ALL[name]
    wanted = bearing_state(bearing, MOTIONS[0], first_angle=0.2)
    state = solve_motion(bearing, wanted.force, first_angle=0.2)
    scale = np.abs(wanted.force[:3]).max()
    np.testing.assert_allclose(state.force, wanted.force, rtol=0, atol=1e-9 * scale)
    held = np.abs(wanted.stiffness).max(axis=0) > 0.0
    np.testing.assert_allclose(state.motion[held], MOTIONS[0][held], rtol=1e-6, atol=1e-11)


def test_variable_compliance_of_rollers_that_pass():
    bearing = replace(CYLINDRICAL, profile="none", clearance=20e-6)
    angles = np.linspace(0.0, 2.0 * math.pi / 18.0, 24, endpoint=False)
    slopes = [solve_motion(bearing, (50e3, 0, 0, 0, 0, 0), first_angle=angle).stiffness[0, 0] for angle in angles]
    assert np.ptp(slopes) / np.mean(slopes) == pytest.approx(0.010, abs=5e-4)


def test_loads_that_no_bearing_carries_are_refused():
    for bearing, load in (
        (ANGULAR, (0, 0, -100, 0, 0, 0)),
        (TAPERED, (1000, 0, 0, 0, 0, 0)),
        (CYLINDRICAL, (1000, 0, 50, 0, 0, 0)),
        (SPHERICAL, (1000, 0, 0, 0, 5, 0)),
    ):
        with pytest.raises(CaseError) as caught:
            solve_motion(bearing, load)
        assert caught.value.code == "E-BEARING" and caught.value.remedy
    with pytest.raises(CaseError, match="load of a bearing"):
        solve_motion(DEEP, (1000, 0, 0, 0, 0, 1))
    with pytest.raises(CaseError, match="motion of a bearing"):
        bearing_state(DEEP, np.zeros(5))
    assert not solve_motion(LOOSE, np.zeros(6)).motion.any()


@pytest.mark.parametrize(
    "bearing, change, key",
    [
        (DEEP, {"balls": 2}, "balls"),
        (DEEP, {"balls": 12}, "pitch_diameter"),
        (DEEP, {"ball_diameter": 0.0}, "ball_diameter"),
        (DEEP, {"pitch_diameter": math.nan}, "pitch_diameter"),
        (DEEP, {"inner_osculation": 0.5}, "inner_osculation"),
        (DEEP, {"poisson_ratio": 0.5}, "youngs_modulus"),
        (DEEP, {"clearance": 2e-3}, "clearance"),
        (DEEP, {"contact_angle": 2.0}, "contact_angle"),
        (DEEP, {"rows": 3}, "rows"),
        (DEEP, {"row_distance": 1e-3}, "row_distance"),
        (CYLINDRICAL, {"kind": "ball"}, "kind"),
        (CYLINDRICAL, {"profile": "crowned"}, "profile"),
        (CYLINDRICAL, {"effective_length": 0.0}, "effective_length"),
        (CYLINDRICAL, {"laminae": 1}, "laminae"),
        (CYLINDRICAL, {"contact_angle": 0.1}, "contact_angle"),
        (CYLINDRICAL, {"axial_preload": 1e-6}, "axial_preload"),
    ],
)
def test_bearings_that_cannot_be_are_refused_by_name(bearing, change, key):
    with pytest.raises(CaseError) as caught:
        replace(bearing, **change)
    assert caught.value.key == key and caught.value.code in ("E-BEARING", "E-CHOICE")


def test_a_state_takes_less_than_a_millisecond():
    for bearing in (PAIR, CYLINDRICAL):
        seconds = []
        for _ in range(50):
            start = time.process_time()
            bearing_state(bearing, MOTIONS[0])
            seconds.append(time.process_time() - start)
        assert min(seconds) < 1e-3


@pytest.mark.parametrize("sense", [1, -1, 0])
def test_a_sliding_ring_carries_no_thrust_and_its_stiffness_is_the_derivative(sense):
    motion = np.array([12e-6, -3e-6, -20e-6 if sense != -1 else 20e-6, 2e-4, -1e-4, 0.0])
    state = sliding_state(DEEP, motion, sense)
    assert abs(state.force[2]) == 0.0
    assert np.abs(bearing_state(DEEP, state.motion).force[2]) < 1e-9 * np.abs(state.force).max()
    assert state.stiffness == pytest.approx(state.stiffness.T, rel=1e-9, abs=1e-6)
    step = 1e-9
    for k in range(5):
        ends = [sliding_state(DEEP, motion + sign * step * np.eye(6)[k], sense).force for sign in (1, -1)]
        scale = np.abs(state.stiffness).max()
        assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(state.stiffness[:, k], abs=2e-5 * scale)


def test_a_ring_at_its_shoulder_carries_thrust_one_way():
    pushed = np.array([5e-6, 0.0, 60e-6, 0.0, 0.0, 0.0])
    assert sliding_state(DEEP, pushed, 1).force == pytest.approx(bearing_state(DEEP, pushed).force, rel=1e-12)
    assert sliding_state(DEEP, pushed, -1).force[2] == 0.0
