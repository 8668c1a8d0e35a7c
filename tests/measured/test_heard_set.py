"""femgear.measured.heard_set: what a case says of the lines on its housing."""

from pathlib import Path

import numpy as np
import pytest

from femgear import read_case
from femgear.errors import CaseError
from femgear.measured.heard_set import heard_set, lines_near_mesh
from femgear.trains.reading import with_values

CASES = Path(__file__).parents[2] / "cases"


def test_the_reference_set():
    heard = heard_set(read_case(CASES / "planetary_27_40_108.toml"))
    assert heard.teeth == (108, 27, 40) and np.allclose(np.degrees(heard.angles), [0, 120, 240])
    assert heard.input == "sun" and heard.carrier_per_turn == pytest.approx({"sun": 0.2, "carrier": 1.0})
    assert heard.whole_orders(106.5).tolist() == [102, 103, 104, 105, 106, 102, 105]
    assert heard.symmetric_orders(2).tolist() == [102, 105, 108, 111, 114, 210, 213, 216, 219, 222]


@pytest.mark.parametrize(("factor", "order"), [(1.0, 1.0), (2.0, 2.0), (0.5, 0.5), (5.0, 5.0), (1.0, 0.7)])
def test_lines_off_the_mesh_tell_the_factor_that_brings_them_there(factor, order):
    """Of counts that are taken for one another; nothing explains 0.7."""
    heard = heard_set(read_case(CASES / "planetary_27_40_108.toml"))
    places = order * np.array([105.0, 111.0, 213.0, 219.0, 321.0, 327.0])
    found = lines_near_mesh(heard, places, np.array([0.3, 0.2, 0.5, 0.4, 1.0, 0.9]), 0.02)
    assert found.factor == pytest.approx(factor)
    assert found.share < 0.02 if order in (0.5, 0.7) else found.share <= 1.0
    assert order != 1.0 or found.share == 1.0
    assert lines_near_mesh(heard, np.zeros(0), np.zeros(0), 0.02).share == 1.0


def test_other_cases_are_refused():
    case = read_case(CASES / "planetary_27_40_108.toml")
    with pytest.raises(CaseError, match="ring stands still"):
        heard_set(with_values(case, {"operation.fixed": "carrier"}))
    with pytest.raises(CaseError, match="no planetary set"):
        heard_set(read_case(CASES / "spur_pair.toml"))
