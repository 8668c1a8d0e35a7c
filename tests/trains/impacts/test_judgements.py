"""Judgements of a gear pair with play."""

from types import SimpleNamespace

import pytest
import xarray as xr

from femgear.stages.judgements import SMOOTH, SURE
from femgear.trains.impacts.judgements import impact_judgements


@pytest.mark.parametrize(
    ("free", "back", "state", "words"),
    (
        ([0.0, 0.0], [0.0, 0.0], "good", "Teeth stay in contact"),
        ([0.0, 0.2], [0.0, 0.0], "look", "teeth part between 0.8 and 0.8 of the natural frequency"),
        ([0.1, 0.2], [0.0, 0.1], "look", "teeth part between 0.7 and 0.8 of the natural frequency, and strike the"),
    ),
)
def test_teeth_part_where_they_are_free(free, back, state, words):
    data = {"amplitude": ("point", [1.0, 3.84]), "free_share": ("point", free), "back_share": ("point", back)}
    response = xr.Dataset(data, {"ratio": ("point", [0.7, 0.8])})
    manifest = SimpleNamespace(complete=True)
    results = SimpleNamespace(stages=("response",), findings=(), response=response, manifest=manifest)
    smooth, sure = impact_judgements(results)
    assert (smooth.question, smooth.state, sure.question) == (SMOOTH, state, SURE)
    assert smooth.sentence.startswith(words) and "3.84 half backlashes" in smooth.answer
