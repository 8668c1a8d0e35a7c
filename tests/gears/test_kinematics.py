"""Speeds and torques against energy balance, published ratios and rolling without slip."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.kinematics import mesh_normals, orientations, speeds, torques, unheld_members, willis_weights
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from validation.planetary import reference_set

ALPHA = math.radians(20.0)
RPM = math.pi / 30.0
SET = PlanetarySet(
    Gear(27, 1.5e-3, ALPHA, 0.52681, 25e-3, 9e-3),
    Gear(40, 1.5e-3, ALPHA, 0.0, 25e-3, 18e-3),
    Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, 0.1, internal=True),
    51e-3,
    equal_planet_angles(3),
)
MEMBERS = ("sun", "carrier", "ring")


def test_mesh_frequency_of_the_modulation_paper():
    for rpm, frequency in ((250, 90.0), (3100, 1116.0)):
        found = speeds(SET, input="sun", fixed="ring", speed=rpm * RPM)
        assert found.mesh_frequency == pytest.approx(frequency, rel=1e-14)
        assert found.carrier == pytest.approx(rpm * RPM / 5.0, rel=1e-14)  # 1 + 108/27
        assert found.ring == 0.0
        # the ring's teeth pass the planets at the same frequency
        assert found.carrier * 108 / (2 * math.pi) == pytest.approx(frequency, rel=1e-14)


@pytest.mark.parametrize(
    ("sizes", "speeds_of"),
    [
        ((27, 108), (5.0, 0.0, 1.0)),  # sun, held ring, carrier: 1 + 108/27
        ((20, 40), (1.0, 0.0, 1.0 / 3.0)),  # two gears in mesh, the second at rest: the arm of 20 + 40 turns by 20/60
        ((30, -90), (-2.0, 0.0, 1.0)),  # a planet in a held ring: 1 - 90/30
        ((30, -60), (2.0, 1.5, 1.0)),  # double planets: (w_s - w_c) over (w_r - w_c) is 60/30
    ],
)
def test_weights_of_willis_are_those_of_tooth_numbers(sizes, speeds_of):
    assert np.dot(willis_weights(*sizes), speeds_of) == pytest.approx(0.0, abs=1e-13)
    assert sum(willis_weights(*sizes)) == 0


@pytest.mark.parametrize("driven", MEMBERS)
@pytest.mark.parametrize("held", MEMBERS)
def test_teeth_roll_without_slip_and_power_balances(driven, held):
    if driven == held:
        with pytest.raises(GeometryError) as caught:
            speeds(SET, input=driven, fixed=held, speed=1.0)
        assert (caught.value.code, caught.value.key) == ("E-MECHANISM", "operation.fixed")
        return
    s = speeds(SET, input=driven, fixed=held, speed=-7.0)
    assert getattr(s, driven) == -7.0 and getattr(s, held) == 0.0
    # pitch-point velocities in the carrier frame, times the number of teeth
    sun, planet, ring = (w - s.carrier for w in (s.sun, s.planet, s.ring))
    assert 27 * sun == pytest.approx(-40 * planet, rel=1e-13)
    assert 40 * planet == pytest.approx(108 * ring, rel=1e-13)
    assert s.mesh_frequency == pytest.approx(abs(108 * ring) / (2 * math.pi), rel=1e-13)
    t = torques(SET, member=driven, torque=11.0)
    assert getattr(t, driven) == pytest.approx(11.0)
    assert t.sun + t.ring + t.carrier == pytest.approx(0.0, abs=1e-12)
    assert t.sun * s.sun + t.ring * s.ring + t.carrier * s.carrier == pytest.approx(0.0, abs=1e-10)


def test_orientations_turn_as_the_speeds_say():
    """One mesh period takes 1/f; the angles turned in the carrier frame are the relative speeds over f."""
    s = speeds(SET, input="sun", fixed="ring", speed=100.0)
    before, after = orientations(SET, 0.2), orientations(SET, 1.2)
    period = 1.0 / s.mesh_frequency
    assert after.sun - before.sun == pytest.approx((s.sun - s.carrier) * period)
    assert after.ring - before.ring == pytest.approx((s.ring - s.carrier) * period)
    for one, two in zip(before.planets, after.planets, strict=True):
        assert two - one == pytest.approx((s.planet - s.carrier) * period)


def test_a_set_at_rest_has_mesh_frequency_zero():
    assert speeds(SET, input="sun", fixed="ring", speed=0.0).mesh_frequency == 0.0


def test_unequal_numbers_of_teeth_between_meshes_do_not_matter():
    """Kinematics follows the tooth numbers, also where 27 + 2 * 40 is not 108."""
    closed = close_set(
        Gear(24, 1e-3, ALPHA, 0.0, 1e-2, 5e-3),
        Gear(36, 1e-3, ALPHA, 0.0, 1e-2, 5e-3),
        Gear(96, 1e-3, ALPHA, 0.0, 1e-2, 0.06, internal=True),
        planet_angles=(0.0,),
    )
    assert speeds(closed, input="ring", fixed="sun", speed=5.0).carrier == pytest.approx(4.0, rel=1e-14)


# Which members the planets hold without a support, beside closed forms of statics.


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def with_planets(gears, *degrees):
    """Planets anywhere: what holds a member asks neither for assembly nor for clearance."""
    loose = object.__new__(type(gears))
    loose.__dict__.update(gears.__dict__)
    loose.__dict__["planet_angles"] = tuple(math.radians(angle) for angle in degrees)
    assert loose.n_planets == len(degrees)
    return loose


@pytest.mark.parametrize("member", MEMBERS)
def test_one_member_is_held_where_the_planets_stand_around_it(gears, member):
    """Forces of planets turn with them: they balance where no gap between planets exceeds 180 deg."""
    rng = np.random.default_rng(3)
    answers = []
    for n in (1, 2, 3, 3, 3, 4, 4, 5, 6) * 6:
        angles = np.sort(rng.uniform(0, 360, n))
        gap = np.diff(angles, append=angles[0] + 360).max()
        found = unheld_members(with_planets(gears, *angles), [member])
        assert found == ((member,) if gap > 180 else ())
        answers.append(bool(found))
    assert 10 < sum(answers) < 44


@pytest.mark.parametrize("member", MEMBERS)
def test_two_opposite_planets_leave_a_member_free_to_slide(gears, member):
    """Their forces balance, but nothing resists motion across them; a third planet does."""
    assert unheld_members(with_planets(gears, 0, 180), [member]) == (member,)
    assert unheld_members(with_planets(gears, 0, 90, 180), [member]) == ()


def test_nothing_that_floats_needs_nothing(gears):
    assert unheld_members(with_planets(gears, 0), []) == ()


@pytest.mark.parametrize("both", [False, True])
def test_several_members_beside_linear_programming(gears, both):
    """Forces of all flanks with planets, sun and members in equilibrium, found by another method."""
    rng = np.random.default_rng(5)
    answers = []
    for n in (2, 3, 4, 5) * 5:
        s = with_planets(gears, *np.sort(rng.uniform(0, 360, n)))
        if any(unheld_members(s, [name], both_flanks=both) for name in ("sun", "carrier")):
            continue
        torque, planets, forces = [], [], []
        for back in (False, True)[: 1 + both]:
            sign, normals = -1.0 if back else 1.0, mesh_normals(s, back=back)
            torque += [sign] * n + [0.0] * n
            planets.append(sign * np.hstack([np.eye(n), -np.eye(n)]))
            on_sun, on_ring = -normals[:n].T, normals[n:].T
            on_carrier = np.hstack([normals[:n].T, -on_ring])
            forces.append(np.vstack([np.hstack([on_sun, 0 * on_ring]), on_carrier]))
        A = np.vstack([torque, np.hstack(planets), np.hstack(forces)])
        b = np.zeros(len(A))
        b[0] = 1.0
        possible = linprog(np.ones(A.shape[1]), A_eq=A, b_eq=b).status == 0
        assert (unheld_members(s, ["sun", "carrier"], both_flanks=both) == ()) is possible
        answers.append(possible)
    assert len(answers) > 4


def test_the_mirror_image_is_held_alike(gears):
    for angles in ((0, 120, 240), (10, 50, 170), (0, 90, 181), (5, 185)):
        mirrored = sorted(360 - a for a in angles)
        for member in MEMBERS:
            one, two = (unheld_members(with_planets(gears, *a), [member]) for a in (angles, mirrored))
            assert one == two


def test_angles_of_the_reference_set_hold_every_member(gears):
    four = replace(gears, planet_angles=tuple(np.radians(np.array([0, 34, 67, 101]) * 360 / 135)))
    for s in (gears, four):
        assert all(unheld_members(s, [name]) == () for name in MEMBERS)
        assert unheld_members(s, ["sun", "carrier"]) == ()
