"""Allowances of the tooth thickness by their names in DIN 3967."""

from itertools import pairwise

import pytest

from femgear.errors import GeometryError
from femgear.gears.allowances import (
    _TOLERANCES,
    _UPPER,
    ALLOWANCE_SERIES,
    LARGEST_DIAMETERS,
    TOLERANCE_SERIES,
    fit_series,
    thickness_allowances,
)


@pytest.mark.parametrize(
    ("name", "diameter", "upper", "lower"),
    [
        ("27cd", 0.1, -70, -170),  # example of DIN 3967, section 3.1
        ("cd 25", 0.04, -54, -84),
        ("cd25", 0.082, -70, -110),
        ("a 30", 0.010, -100, -300),  # "over .. to" of the rows
        ("a 30", 0.010001, -135, -435),
        ("h 21", 10.0, 0, -40),
    ],
)
def test_allowances_follow_from_name_and_reference_diameter(name, diameter, upper, lower):
    assert thickness_allowances(name, diameter) == pytest.approx((1e-6 * upper, 1e-6 * lower), rel=1e-12)


def test_both_tables_rise_with_the_diameter_and_along_their_series():
    assert len(_UPPER) == len(_TOLERANCES) == len(LARGEST_DIAMETERS)
    for table, width in ((_UPPER, len(ALLOWANCE_SERIES)), (_TOLERANCES, len(TOLERANCE_SERIES))):
        assert {len(row) for row in table} == {width}
        for above, below in pairwise(table):
            assert all(small <= large for small, large in zip(above, below, strict=True))
    assert all(list(row) == sorted(row, reverse=True) for row in _UPPER)
    assert all(list(row) == sorted(row) for row in _TOLERANCES)


@pytest.mark.parametrize("name", ["x 25", "cd 20", "cd 31", "ha 25", "25", "cd", "", "25cd25"])
def test_other_names_are_refused(name):
    with pytest.raises(GeometryError, match="E-CHOICE"):
        fit_series(name)


def test_a_diameter_beyond_the_tables_is_refused():
    with pytest.raises(GeometryError, match="E-RANGE") as refusal:
        thickness_allowances("c 25", 10.001)
    assert refusal.value.limit == "up to 10000 mm"
