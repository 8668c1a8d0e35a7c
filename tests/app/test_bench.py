"""What the app computes: the same as a run, part after part, and nothing twice."""

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from femgear.app.bench import DRAFT_POSITIONS, Bench, Superseded
from femgear.errors import CaseError
from femgear.run import solve
from femgear.stages.static import solve_static
from femgear.trains.reading import parse_case, with_values
from femgear.trains.registry import train_of

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[2] / "cases"
CACHE = Path(__file__).parents[2] / "meshes"
COARSE = """
[static]
flank_elements = 4
positions = 8

[dynamics]
up_to = "6 kHz"
"""
PAIR = """model = "pair"
title = "Pair"

[set]
module = "3 mm"
pressure_angle = "20 deg"
face_width = "30 mm"

[material]
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
density = "7850 kg/m^3"

[gear_1]
teeth = 20
profile_shift = 0.0
bore_radius = "15 mm"

[gear_2]
teeth = 30
profile_shift = 0.0
bore_radius = "15 mm"

[operation]
torque = "100 N m"
speeds = ["1000 rpm"]
"""
TEXT = PAIR + COARSE


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path, cache=CACHE)


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("bench"), cache=CACHE)
    seen = bench.look(TEXT, "a.toml")
    stages = [stage["name"] for stage in seen["stages"]]
    return bench, seen, list(bench.answer(TEXT, "a.toml", ["static_transmission_error", "contact_pressure"], stages))


def test_what_is_wrong_is_told_by_entry(bench):
    wrong = TEXT.replace('"100 N m"', '"100 mm"').replace("teeth = 30", "teeth = 2")
    seen = bench.look(wrong, "a.toml")
    assert {problem["key"] for problem in seen["problems"]} >= {"operation.torque", "gear_2.teeth"}
    assert seen["model"] == "pair" and all(problem["code"].startswith("E-") for problem in seen["problems"])


@pytest.mark.parametrize("text", ("a = ", "", "model = 3\n", 'model = "none"\n', "[" * 3000))
def test_any_text_is_looked_at(bench, text):
    assert bench.look(text, "a.toml")["problems"]


def test_a_case_is_described(answered):
    _, seen, _ = answered
    assert seen["train"] == "pair" and seen["problems"] == [] and seen["values"]["operation.torque"] == 100.0
    assert "estimated" in next(one["text"] for one in seen["findings"] if one["code"] == "W-ESTIMATED")
    assert [stage["name"] for stage in seen["stages"]] == ["static", "stress", "modes", "dynamics", "runup"]


def test_answers_are_those_of_a_run(answered):
    _, _, parts = answered
    case = parse_case(TEXT)
    result = solve(case)
    train = train_of(case)
    sentence = parts[-1]["sentence"]
    assert {part["stage"] for part in parts} == {*result}
    charts = {name: chart for part in parts for name, chart in part["charts"].items()}
    drawn = charts["static_transmission_error"]["panels"][0]["traces"][0]["y"]
    expected = 1e6 * result["static"].dataset()["ste"].values[0]
    assert np.abs(np.subtract.outer(drawn, expected)).min(axis=0).max() < 1e-4, "between them it is denser"
    assert charts["contact_pressure"]["png"], "what is no chart is a picture"
    assert sentence and [one["question"] for one in parts[-1]["judgements"]]
    assert train.name == "pair"


def test_what_did_not_change_is_neither_computed_nor_drawn_again(answered):
    bench, looked, parts = answered
    stages = [stage["name"] for stage in looked["stages"]]
    shown = ["static_transmission_error", "contact_pressure"]
    seen = {part["stage"]: part["number"] for part in parts}
    same = list(bench.answer(TEXT + "# a remark\n", "a.toml", shown, stages, seen))
    assert len(same) == len(stages) and all(part["same"] and not part["charts"] for part in same)
    drawn = list(bench.answer(TEXT, "a.toml", shown, stages))
    assert {name for part in drawn for name in part["charts"]} == {*shown}, "who has seen nothing gets all"
    damped = TEXT.replace("[dynamics]\n", "[dynamics]\ndamping_ratio = 0.03\n")
    parts = {part["stage"]: part for part in bench.answer(damped, "a.toml", shown, stages, seen)}
    assert parts["static"]["same"] and not parts["dynamics"]["same"]
    assert next(iter(parts)) == "static", "what others go on from comes first"
    again = next(bench.answer(damped, "a.toml", ["mesh_stiffness"], ["static"]))
    assert [*again["charts"]] == ["mesh_stiffness"], "another chart is drawn of what is known"


def test_a_slider_has_a_draft_of_few_positions_before_the_whole_answer(tmp_path):
    bench, shown = Bench(tmp_path, cache=CACHE), ["static_transmission_error"]
    text = TEXT.replace("positions = 8", "positions = 40")
    (draft,) = bench.draft(text, "a.toml", shown)
    assert draft["stage"] == "static" and draft["positions"] == DRAFT_POSITIONS

    def errors(part):
        return part["charts"]["static_transmission_error"]["panels"][0]["traces"][0]["y"]

    few = solve_static(with_values(parse_case(text), {"static.positions": DRAFT_POSITIONS, "static.peaks": False}))
    assert errors(draft)[:DRAFT_POSITIONS] == pytest.approx(1e6 * few.cycle.deflection[0], abs=1e-4)
    (whole,) = bench.answer(text, "a.toml", shown, ["static"], {"static": draft["number"]})
    fresh = solve_static(parse_case(text)).cycle
    assert not whole["same"] and len(errors(whole)) == 40 + len(fresh.between.position) + 1
    assert bench._latest["static"][0].cycle.peak_to_peak() == pytest.approx(fresh.peak_to_peak(), rel=1e-12)
    assert [*bench.draft(text + "# a remark\n", "a.toml", shown)] == [], "what is known needs no draft"
    faster = text.replace("1000 rpm", "1100 rpm")
    assert [*bench.draft(faster, "a.toml", shown)] == [], "a speed leaves the contact as it is"


def test_a_newer_text_ends_an_answer(tmp_path):
    waiting = [False]
    bench = Bench(tmp_path, cache=CACHE, waiting=lambda: waiting[0])
    parts = bench.answer(TEXT, "a.toml", [], ["static", "modes"])
    assert next(parts)["stage"] == "static"
    waiting[0] = True
    with pytest.raises(Superseded):
        next(parts)


def test_what_is_computed_is_told_with_the_title_of_its_stage(tmp_path):
    told = []
    bench = Bench(tmp_path, cache=CACHE, tell=told.append)
    stages = [stage["name"] for stage in bench.look(TEXT, "pair.toml")["stages"]]
    answered = [part["stage"] for part in bench.answer(TEXT, "pair.toml", (), stages)]
    steps = list(dict.fromkeys(step["computing"] for step in told))
    titles = {stage.name: stage.title for stage in train_of(parse_case(TEXT)).stages}
    assert [step for step in steps if step in titles.values()] == [titles[name] for name in answered]
    assert steps[:3] == [titles["static"], "grids", "contact"]
    assert all(0.0 <= step["done"] <= step["total"] for step in told)


def test_gears_are_drawn_in_space(answered):
    bench, _, _ = answered
    model = bench.gears(TEXT, "a.toml")
    assert [body["name"] for body in model["bodies"]] == ["gear 1", "gear 2"]
    assert [body["turns"] for body in model["bodies"]] == pytest.approx([1.0, -20 / 30])
    assert bench.tables(TEXT, "a.toml")[0]["title"]


def test_sounds_keep_the_scale_of_the_first_one(answered):
    bench, _, _ = answered

    def heard(text):
        sound = bench.sound(text, "a.toml")
        rate, samples = wavfile.read(io.BytesIO(base64.b64decode(sound["wav"])))
        return sound, rate, np.abs(samples.astype(float)).max() / 32767

    first, rate, largest = heard(TEXT)
    assert rate == 48000 and largest == pytest.approx(0.25, rel=1e-3) and first["unit"]
    other, _, share = heard(TEXT.replace('"100 N m"', '"200 N m"'))
    assert share / largest == pytest.approx(other["largest"] / first["largest"], rel=1e-3) and share != largest


def test_what_is_refused_is_refused(bench):
    with pytest.raises(CaseError):
        next(bench.answer(TEXT.replace("teeth = 20", "teeth = 2"), "a.toml", [], ["static"]))


def test_what_is_the_same_is_judged_once_with_the_last_stage(answered):
    bench, looked, _ = answered
    stages = [stage["name"] for stage in looked["stages"]]
    parts = list(bench.answer(TEXT, "a.toml", [], stages))
    seen = {part["stage"]: part["number"] for part in parts}
    again = list(bench.answer(TEXT, "a.toml", [], stages, seen))
    assert all(part["same"] for part in again) and len(again) == len(parts) > 1
    assert [part["sentence"] for part in again[:-1]] == [None] * (len(again) - 1)
    assert again[-1]["sentence"] == parts[-1]["sentence"] and again[-1]["judgements"] == parts[-1]["judgements"]
    assert all(part["sentence"] is not None for part in parts)


def test_a_speed_that_leaves_a_published_line_is_answered_without_the_line(bench):
    text = (CASES / "planetary_27_40_108.toml").read_text(encoding="utf-8")
    seen = bench.look(text.replace('"3100 rpm"', '"3090 rpm"', 1), "a.toml")
    assert seen["problems"] == [] and seen["stages"]
    assert any("housing.published are left out" in finding["text"] for finding in seen["findings"])
    assert not any("left out: their speed" in finding["text"] for finding in bench.look(text, "a.toml")["findings"])
    wrong = text.replace('"3100 rpm"', '"3090 rpm"', 1).replace("teeth = 40", "teeth = 2")
    assert "E-PUBLISHED" not in {problem["code"] for problem in bench.look(wrong, "a.toml")["problems"][:1]}
