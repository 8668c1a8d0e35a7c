"""Judgements of a gear pair with play."""

from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr

from femgear.stages.judgements import QUIET, SMOOTH, STRONG, SURE
from femgear.trains.impacts.judgements import impact_duty, impact_judgements
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


@pytest.mark.parametrize(
    ("free", "back", "state", "words"),
    (
        ([0.0, 0.0], [0.0, 0.0], "good", "Teeth stay in contact"),
        ([0.0, 0.2], [0.0, 0.0], "look", "teeth part between 0.8 and 0.8 of the natural frequency"),
        (
            [0.1, 0.2],
            [0.0, 0.1],
            "look",
            "teeth part between 0.7 and 0.8 of the natural frequency of 1,000 Hz, 2,100 to 2,400 rpm of gear 1, and",
        ),
    ),
)
def test_teeth_part_where_they_are_free(free, back, state, words):
    data = {"amplitude": ("point", [1.0, 3.84]), "free_share": ("point", free), "back_share": ("point", back)}
    # 30 um are half of the backlash; 20 teeth mesh at 1000 Hz at 3000 rpm
    attributes = {"half_backlash": 3e-5, "natural_frequency": 1000.0}
    response = xr.Dataset(data, {"ratio": ("point", [0.7, 0.8])}, attributes)
    case = read_case(CASES / "gear_pair.toml")
    manifest = SimpleNamespace(complete=True)
    results = SimpleNamespace(case=case, stages=("response",), findings=(), response=response, manifest=manifest)
    strong, smooth, quiet, sure = impact_judgements(results)
    assert (smooth.question, smooth.state, sure.question) == (SMOOTH, state, SURE)
    assert smooth.sentence.startswith(words) and "115 µm, 3.84 half backlashes" in smooth.answer
    assert (strong.question, strong.state, strong.answer) == (STRONG, "absent", "not rated")
    assert strong.sentence == "Its strength is not rated: the case gives no tooth shapes"
    assert (quiet.question, quiet.state) == (QUIET, "absent")


def test_a_pair_with_play_says_its_torques_and_backlash():
    """432 N m on 20 teeth are 648 N m on 30."""
    duty = impact_duty(read_case(CASES / "gear_pair.toml"))
    assert duty == "432 N m (gear 1) make 648 N m (gear 2): 20 and 30 teeth, backlash 60 µm."
