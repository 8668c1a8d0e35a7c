"""Speeds and torques against energy balance, published ratios and rolling without slip."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations, speeds, torques
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles

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
