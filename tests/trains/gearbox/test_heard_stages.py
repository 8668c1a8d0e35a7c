"""Planetary stages of gearboxes as recordings tell them."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case import text as case_text
from femgear.errors import CaseError
from femgear.measured.heard_set import heard_set
from femgear.trains.gearbox.heard_stages import heard_stages
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import parse_case, read_case
from femgear.trains.registry import heard_in

CASES = Path(__file__).parents[3] / "cases"


@pytest.fixture(scope="module")
def reducer():
    return read_case(CASES / "four_stage_reducer.toml")


def test_stages_have_their_teeth_and_the_turns_of_their_carriers(reducer):
    stages = heard_stages(reducer)
    assert list(stages) == [f"stage {number}" for number in (1, 2, 3, 4)]
    first, second = stages["stage 1"], stages["stage 2"]
    assert first.teeth == (105, 21, 42)
    assert np.degrees(first.angles) == pytest.approx([0.0, 120.0, 240.0])
    # Willis: a carrier makes z_s/(z_s + z_r) turns in one of its sun
    for stage in stages.values():
        assert stage.carrier_per_turn["sun"] == pytest.approx(stage.sun / (stage.sun + stage.ring))
    both = first.carrier_per_turn["sun"] * second.carrier_per_turn["sun"]
    assert second.carrier_per_turn["stage 1 sun"] == pytest.approx(both)


def test_a_set_written_as_a_gearbox_is_the_same_set():
    case = read_case(CASES / "planetary_27_40_108.toml")
    box = parse_case(case_text.write(gearbox_of_case(case).tables), name="box.toml")
    alone, stage = heard_set(case), heard_in(box)
    assert stage.teeth == alone.teeth
    assert stage.carrier_per_turn["sun"] == pytest.approx(alone.carrier_per_turn["sun"])
    assert stage.carrier_per_turn[stage.input] == pytest.approx(alone.carrier_per_turn[alone.input])


def test_one_of_several_stages_must_be_named(reducer):
    for stage in (None, "stage 5"):
        with pytest.raises(CaseError) as caught:
            heard_in(reducer, stage)
        assert caught.value.code == "E-CHOICE"
        assert '"stage 2"' in str(caught.value)
    assert heard_in(reducer, "stage 3").ring == heard_stages(reducer)["stage 3"].ring


def test_a_set_of_its_own_has_no_stages():
    case = read_case(CASES / "planetary_27_40_108.toml")
    assert heard_in(case).teeth == (108, 27, 40)
    with pytest.raises(CaseError) as caught:
        heard_in(case, "set")
    assert caught.value.key == "--stage"
