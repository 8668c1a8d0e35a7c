"""femgear.measured.heard_set: what a case says of the lines on its housing."""

from pathlib import Path

import numpy as np
import pytest

from femgear import read_case
from femgear.errors import CaseError
from femgear.measured.heard_set import HeardSet, heard_set
from femgear.trains.reading import with_values

CASES = Path(__file__).parents[2] / "cases"


def test_the_reference_set():
    heard = heard_set(read_case(CASES / "planetary_27_40_108.toml"))
    assert heard.teeth == (108, 27, 40) and np.allclose(np.degrees(heard.angles), [0, 120, 240])
    assert heard.input == "sun" and heard.carrier_per_turn == pytest.approx({"sun": 0.2, "carrier": 1.0})
    assert heard.whole_orders(106.5).tolist() == [102, 103, 104, 105, 106, 102, 105]
    assert heard.symmetric_orders(2).tolist() == [102, 105, 108, 111, 114, 210, 213, 216, 219, 222]


def test_faults_of_parts_have_lines_at_turns_of_theirs():
    """Planets of 40 teeth make 2.7 turns in one of the carrier; five of the sun beside multiples of three are whole."""
    heard = heard_set(read_case(CASES / "planetary_27_40_108.toml"))
    of_sun, of_planet = heard.part_places(2.0, 0.02)
    assert of_sun == pytest.approx([0, 1, 2])
    assert of_planet == pytest.approx(np.arange(30) / 10)
    assert len(heard.part_places(2.0, 0.05)) == 1
    # a sun of 28 teeth makes 32/7 turns, and with four planets lines at multiples of 4/7
    equal = HeardSet(100, 28, None, np.arange(4) * np.pi / 2)
    assert equal.part_places(3.0, 0.02)[0] == pytest.approx(np.arange(7) * 4 / 7)


def test_other_cases_are_refused():
    case = read_case(CASES / "planetary_27_40_108.toml")
    with pytest.raises(CaseError, match="ring stands still"):
        heard_set(with_values(case, {"operation.fixed": "carrier"}))
    with pytest.raises(CaseError, match="no planetary set"):
        heard_set(read_case(CASES / "spur_pair.toml"))
