"""Flank tolerances of ISO 1328-1:2013."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.tolerances import flank_tolerances

GEAR = {"diameter": 0.12, "normal_module": 3e-3, "face_width": 0.03}


def test_tolerances_of_a_class_six_gear():
    """8.94, 28.80, 9.40 and 7.52 um before rounding."""
    ours = flank_tolerances(6, **GEAR)
    assert [1e6 * ours.pitch, 1e6 * ours.cumulative_pitch, 1e6 * ours.profile_form] == pytest.approx([9.0, 29.0, 9.5])
    assert 1e6 * ours.profile == pytest.approx(12.0)  # hypot(9.40, 7.52) = 12.04
    assert ours.base_pitch(math.radians(20.0)) == pytest.approx(9e-6 * math.cos(math.radians(20.0)))


def test_two_classes_double_the_tolerance():
    """sqrt(2) a class, before rounding to 0.1, 0.5 and 1 um."""
    fine, coarse = (flank_tolerances(number, diameter=1.0, normal_module=20e-3, face_width=0.2) for number in (6, 10))
    for name in vars(fine):
        assert getattr(coarse, name) / getattr(fine, name) == pytest.approx(4.0, rel=0.05), name
    assert 1e6 * flank_tolerances(1, **GEAR).pitch == pytest.approx(1.6)  # 6.32/4 = 1.58


@pytest.mark.parametrize(
    "wrong", [{"tolerance_class": 0}, {"tolerance_class": 12}, {"face_width": 2e-3}, {"diameter": 20.0}]
)
def test_sizes_outside_the_standard_are_refused(wrong):
    with pytest.raises(GeometryError) as caught:
        flank_tolerances(**({"tolerance_class": 6} | GEAR | wrong))
    assert caught.value.code == "E-ISO1328" and caught.value.remedy
