"""femgear.measured.requests: what no search can be."""

import pytest

from femgear.errors import CaseError
from femgear.measured.requests import LineSearch


@pytest.mark.parametrize("threshold", [0.0, 3.0, -201.0, float("nan")])
def test_thresholds_lie_below_the_strongest_line(threshold):
    with pytest.raises(CaseError, match="no such level"):
        LineSearch(threshold=threshold)
    assert LineSearch(threshold=-60.0).threshold == -60.0
