"""The verdict of a gearbox: worst numbers with their place, levels with the line, the way and the mode behind them."""

from collections import ChainMap
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


def test_teeth_in_line_have_no_misalignment_in_the_verdict(results):
    name, data = "largest misalignment over the width", results.deflection
    (block,) = gearbox_verdict(results)
    largest = 1e6 * np.abs(data["mesh_misalignment"].values).max()
    assert abs(float(dict(block.rows)[name].split()[0])) == pytest.approx(largest, rel=1e-2)
    aligned = SimpleNamespace(**vars(results))
    values = 1e-6 * data["mesh_misalignment"].values
    aligned.deflection = data.assign(mesh_misalignment=(("load_case", "mesh"), values))
    (block,) = gearbox_verdict(aligned)
    assert name not in dict(block.rows)


def test_of_many_stages_side_by_side_those_with_the_smallest_and_the_largest_share_are_named(results):
    wide, shares = SimpleNamespace(**vars(results)), np.array([[0.31, 0.35, 0.33, 0.33, 0.34, 0.32]])
    names = np.array(
        ["planet 1-ring", "planet 2-ring", "sun-planet 1", "sun-planet 2", "sun-planet 3", "planet 3-ring"]
    )
    for count, text in ((6, "from 31.0 % (planet 1-ring) to 35.0 % (planet 2-ring)"), (2, "planet 1-ring 31.0 %, ")):
        of_stages = {"stage": names[:count], "torque_share": shares[:, :count]}
        of_stages = {name: SimpleNamespace(values=values) for name, values in of_stages.items()}
        wide.deflection = ChainMap(of_stages, results.deflection)
        (block,) = gearbox_verdict(wide)
        assert dict(block.rows)["torque of stages side by side"].startswith(text)


def test_decibels_are_those_of_iso_1683():
    assert level_text(1.0) == "1 m/s² (120.0 dB re 1 µm/s²)" and level_text(0.0) == "silent"
