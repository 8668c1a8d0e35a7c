"""Largest levels allowed: one for all speeds, or curves over the speed."""

import numpy as np
import pytest
from pydantic import TypeAdapter

from femgear.case.level_limits import LevelLimit, SoundLimit, limit_at
from femgear.errors import CaseError
from femgear.trains.reading import read_case, with_values

CURVE = [{"speed": "1000 rpm", "level": "10 m/s^2"}, {"speed": "3000 rpm", "level": "30 m/s^2"}]


def test_one_level_holds_at_all_speeds():
    points = TypeAdapter(LevelLimit).validate_python("2 m/s^2")
    assert limit_at(points, np.array([0.0, 5e4])).tolist() == [2.0, 2.0]
    assert limit_at(TypeAdapter(SoundLimit).validate_python(70), np.array([1.0])).tolist() == [70.0]


def test_a_curve_is_straight_between_its_points_and_level_beyond_them():
    points = TypeAdapter(LevelLimit).validate_python(CURVE)
    np.testing.assert_allclose(limit_at(points, np.array([500.0, 1500.0, 4000.0])), [10.0, 15.0, 30.0], rtol=1e-12)


@pytest.mark.parametrize(
    ("curve", "code"),
    [
        ([CURVE[1], CURVE[0]], "E-SPEED"),
        ([CURVE[0], CURVE[0]], "E-SPEED"),
        ([CURVE[0], {"level": "1 m/s^2"}], "E-KEY-MISSING"),
        ("0 m/s^2", "E-RANGE"),
        ("10 dB", "E-UNIT"),
    ],
)
def test_refused_curves(curve, code):
    case = read_case("cases/planetary_27_40_108.toml")
    with pytest.raises(CaseError) as refused:
        with_values(case, {"housing.level_limit": curve})
    assert refused.value.code == code and "housing.level_limit" in str(refused.value)
