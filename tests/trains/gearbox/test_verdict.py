"""The verdict of a gearbox: worst numbers with their place, levels with the line, the way and the mode behind them."""

from types import SimpleNamespace

import numpy as np
import pytest
from casings import answer_in_a_casing

from femgear.findings import DOUBT, Finding
from femgear.trains.gearbox.mode_words import nearest_mode
from femgear.trains.gearbox.verdict import gearbox_verdict, level_text

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def results():
    answer = answer_in_a_casing()
    data = {name: answer[name].contents() for name in answer}
    return SimpleNamespace(stages=tuple(data), findings=(), case=answer.case, **data)


def test_levels_come_with_line_way_and_mode(results):
    (block,) = gearbox_verdict(results)
    rows = dict(block.rows)
    data, size = results.dynamics, np.hypot(*(results.dynamics[f"lines_{part}"].values for part in ("real", "imag")))
    at = int(size[0, 0].argmax())
    hertz = data["order"].values[at] * data["speed"].values[0] / 60.0
    assert rows["level at top"].startswith(level_text(float(data["level"].values[0, 0])))
    main = rows["main line at top"]
    assert main.startswith(f"{hertz:,.1f} Hz, stage, mesh harmonic {data['harmonic'].values[at]:g}")
    assert main.endswith(nearest_mode(results.modes, hertz))
    way = data["path"].values[int(data["path_share"].values[0, :, 0].argmax())]
    assert rows["most of it at top comes by"].startswith(str(way))
    loudest = results.runup["speed"].values[int(results.runup["level"].values[:, 0].argmax())]
    assert f"at {loudest:,.5g} rpm, by stage" in rows["loudest of the run-up at top"]


def test_doubtful_numbers_are_marked(results):
    marked = SimpleNamespace(**vars(results))
    doubts = {"deflection": "W-PASSES", "dynamics": "W-PULL"}
    marked.findings = tuple(
        Finding(code, "", "it is so", severity=DOUBT, stage=stage) for stage, code in doubts.items()
    )
    (block,) = gearbox_verdict(marked)
    (plain,) = gearbox_verdict(results)
    assert [note.split()[1].rstrip(",") for note in block.notes] == [*doubts.values()]
    changed = {name for (name, text), (_, before) in zip(block.rows, plain.rows, strict=True) if text != before}
    assert {"level at top", "largest face load factor K_Hβ", "largest bearing force"} <= changed
    assert "loudest of the run-up at top" not in changed


def test_decibels_are_those_of_iso_1683():
    assert level_text(1.0) == "1 m/s² (120.0 dB re 1 µm/s²)" and level_text(0.0) == "silent"
