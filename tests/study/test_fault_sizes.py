"""Kinds and sizes of faults of a data set, and that a case takes each of them."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import CaseError
from femgear.study.fault_sizes import (
    GEARS,
    KINDS,
    SIZED,
    carrying_flanks,
    chosen_words,
    drawn_fault,
    fault_entries,
    size_ranges,
)
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(scope="module")
def case():
    return read_case(CASES / "planetary_27_40_108.toml")


def test_sizes_are_read_by_kind():
    ranges = size_ranges(("crack=0.5 mm..2 mm, wear = 3 um",), 1.5e-3)
    assert ranges["crack"] == (0.0005, 0.002)
    assert ranges["wear"] == pytest.approx((3e-6, 3e-6))
    assert ranges["spall"][0] < ranges["spall"][1]


@pytest.mark.parametrize(
    ("text", "code"),
    [("missing=1 mm", "E-CHOICE"), ("1 mm", "E-CHOICE"), ("crack=2 mm..1 mm", "E-RANGE"), ("crack=2 s", "E-UNIT")],
)
def test_wrong_sizes_are_refused(text, code):
    with pytest.raises(CaseError) as caught:
        size_ranges((text,), 1.5e-3)
    assert caught.value.code == code
    assert caught.value.key == "--sizes"


def test_words_are_chosen_once_and_in_their_order():
    assert chosen_words(("crack, spall", "crack"), KINDS, "--kinds") == ("crack", "spall")
    assert chosen_words((), KINDS, "--kinds") == KINDS
    with pytest.raises(CaseError) as caught:
        chosen_words(("creak",), KINDS, "--kinds")
    assert "crack" in str(caught.value)


def test_flanks_are_those_that_carry(case):
    gears = planetary_set(case)
    assert carrying_flanks(gears, "planet", back=False) == ("sun side", "ring side")
    forward, back = (carrying_flanks(gears, "sun", back=back) for back in (False, True))
    assert forward == ("left",)
    assert back == ("right",)


@pytest.mark.parametrize("share", [0.0, 0.999])
@pytest.mark.parametrize("kind", KINDS)
def test_a_case_takes_every_fault_that_is_drawn(case, kind, share):
    gears = planetary_set(case)
    for gear in GEARS:
        ranges = size_ranges((), gears.sun.module)
        fault = drawn_fault(kind, gears, (gear,), ranges, np.full(5, share), back=False)
        faulty = with_values(case, fault_entries(fault, gears))
        made = set_deviations(faulty).faults
        assert len(made) == (kind != "healthy")
        assert (fault.size > 0.0) == (kind in SIZED)
        if kind == "wear":
            assert made[0].tooth is None
