"""Judgements of a set with an elastic ring: its level, main line and resonance."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.findings import DOUBT, Finding
from femgear.stages.judgements import CLEAR, QUIET
from femgear.trains.drafts import new_case
from femgear.trains.elastic.checks import case_warnings
from femgear.trains.elastic.judgements import set_with_ring_judgements
from femgear.trains.reading import parse_case, read_case, with_values

CASE = Path(__file__).parents[3] / "cases" / "planetary_27_40_108.toml"
CARRIER = 2.0 * np.pi * 10.0
CURVE = [{"speed": "2000 rpm", "level": "20 m/s^2"}, {"speed": "4000 rpm", "level": "4.5 m/s^2"}]


@pytest.fixture
def results():
    """Two lines at 600 rpm of the carrier: order 108 has the larger displacement, order 216 the larger acceleration."""
    order = np.array([0.0, 108.0, 216.0])
    moved = np.array([[0.0, 2.0, 1.0]]) / (108.0 * CARRIER) ** 2
    level = np.sqrt(0.5 * (2.0**2 + 4.0**2))
    housing = xr.Dataset(
        {
            "lines_real": (("speed", "order"), moved),
            "lines_imag": (("speed", "order"), 0.0 * moved),
            "level": ("speed", [level]),
            "carrier_speed": ("speed", [CARRIER]),
        },
        {"speed": [3000.0], "order": order},
    )
    runup = xr.Dataset(
        {
            "level": ("speed", [1.0, level, 9.0]),
            "operating_alone": ("resonance", [0.4 * level, 0.8 * level]),
            "distance": ("resonance", [0.1, -1.6]),
            "operating_speed": ("resonance", [3000.0, 3000.0]),
            "mode": ("resonance", [2, 7]),
            "mesh_harmonic": ("resonance", [1, 2]),
        },
        {"speed": [1000.0, 3000.0, 4000.0]},
    )
    frequency = [500.0, 2200.0, 6e3, 7e3, 8e3, 9e3, 9.5e3]
    kinds = ["rotational", "ring", *["translational"] * 4, "ring, rotational"]
    modes = xr.Dataset({"frequency": ("mode", frequency), "kind": ("mode", kinds)})
    return SimpleNamespace(
        case=read_case(CASE),
        findings=(),
        stages=("housing", "runup", "modes"),
        manifest=SimpleNamespace(complete=True),
        housing=housing,
        runup=runup,
        modes=modes,
    )


def judged(results):
    class Files(SimpleNamespace):
        def __getitem__(self, name):
            return getattr(self, name)

    found = {judgement.question: judgement for judgement in set_with_ring_judgements(Files(**vars(results)))}
    return found[QUIET]


def test_the_main_line_is_that_of_the_acceleration_with_its_mode(results):
    results.runup["distance"].values[1] = 12.0  # no resonance makes the level
    noise = judged(results)
    assert "its largest line, 2,160 Hz (mesh harmonic 2, near mode 2: ring), makes 80 % of" in noise.sentence
    assert noise.sentence.endswith("Largest of the run-up: 9 m/s² at 4,000 rpm, the end of its range")
    assert noise.answer == "3.16 m/s² r.m.s. at 3,000 rpm"


def test_levels_that_a_longer_excitation_raises_are_bounds_and_do_not_hold_their_limit(results):
    results.case = with_values(results.case, {"housing.level_limit": "10 m/s^2"})
    results.runup["distance"].values[1] = 12.0
    assert judged(results).state == "good"
    results.stages += ("dynamics",)
    steady = (("speed", "mesh", "harmonic"), [[[100.0, 1.0], [100.0, 1.0]]])
    calm = {name: ("speed", [True]) for name in ("converged", "stable")}
    forces = {"mesh_force_real": steady, "mesh_force_imag": (steady[0], np.zeros((1, 2, 2)))}
    results.dynamics = xr.Dataset({"level_change": ("speed", [12.0]), **calm, **forces}, {"speed": [3000.0]})
    results.findings = (Finding("W-EXCITATION", "", "the level rises", severity=DOUBT, stage="dynamics"),)
    noise = judged(results)
    assert noise.state == "bad" and noise.answer == "> 3 m/s² r.m.s. at 3,000 rpm"
    assert noise.limit.startswith("2.0 dB over the limit of the case at the sensor with a longer excitation, 3,000 rpm")
    results.dynamics["level_change"].values[0] = 2.0
    noise = judged(results)
    assert noise.state == "look" and noise.limit.endswith(
        "below the limit of the case at the sensor, 4,000 rpm; doubt: excitation falls short"
    )
    results.dynamics["level_change"].values[0] = -2.0
    noise = judged(results)
    assert noise.state == "look" and noise.answer == "3.16† m/s² r.m.s. at 3,000 rpm"
    assert noise.limit.endswith("doubt: † excitation falls short")


def test_a_resonance_that_makes_the_level_deserves_a_look(results):
    assert judged(results).state == "look"
    # 3000 rpm less 1.6 %
    meeting = "mesh harmonic 2 meets mode 7 at 2,952 rpm"
    limit = "no limit: give housing.level_limit"
    assert judged(results).limit == f"{meeting}: 64 % of the power"
    alone = results.runup["operating_alone"].values
    alone[1] *= 2.0  # lines of other resonances cancel part of it
    assert "rpm: as loud as all lines together" in judged(results).limit
    results.runup["distance"].values[1] = 12.0
    assert judged(results).state == "open" and judged(results).limit == f"{CLEAR}; {limit}"
    results.housing["pressure_level"] = ("speed", [63.5])
    assert judged(results).limit.endswith("no limit: give housing.microphone.level_limit")


def test_sentence_and_card_name_one_cause_of_the_level(results):
    """The resonance of the loudest speed; one of another speed is named by the card, with that speed."""
    noise = judged(results)
    cause = "mesh harmonic 2 at 2,160 Hz excites mode 7 (ring, rotational), which makes 64 % of the power."
    assert f"At 3,000 rpm the housing has 3.16 m/s² r.m.s.: {cause}" in noise.sentence
    assert "largest line" not in noise.sentence and noise.limit.startswith("mesh harmonic 2 meets mode 7 at ")
    # a resonance of a speed that is less loud does not make the level of the sentence
    results.runup["operating_speed"].values[:] = [3000.0, 1000.0]
    results.runup["operating_alone"].values[:] = [0.8 * 3.162, 0.9]
    both = judged(results)
    assert both.limit.startswith("mesh harmonic 1 meets mode 2 at 3,003 rpm: ")
    results.runup["operating_alone"].values[0] = 0.1
    quieter = judged(results)
    assert quieter.limit.startswith("mesh harmonic 2 meets mode 7 at 984 rpm: ") and quieter.limit.endswith(
        " at 1,000 rpm"
    )
    assert "its largest line, 2,160 Hz (mesh harmonic 2, near mode 2: ring)" in quieter.sentence


def test_a_set_without_a_run_up_is_judged_by_its_largest_line(results):
    results.stages = tuple(stage for stage in results.stages if stage != "runup")
    hertz = 2160.0
    mode = int(np.abs(results.modes["frequency"].values - hertz).argmin())
    results.modes["frequency"].values[mode] = 1.02 * hertz
    apart = f"2.0 % below mode {mode + 1} at 2,203 Hz"
    words = f"mesh harmonic 2 at 2,160 Hz, {apart}, makes 80 % of the power"
    assert judged(results).state == "look" and judged(results).limit.startswith(words)


@pytest.mark.parametrize(
    ("limit", "state", "words"),
    [
        ("10 m/s^2", "look", "mesh harmonic 2 meets mode 7"),
        (
            [{"speed": "2000 rpm", "level": "20 m/s^2"}, {"speed": "4000 rpm", "level": "4.5 m/s^2"}],
            "bad",
            "6.0 dB over",
        ),
    ],
)
def test_limits_of_the_sensor_hold_in_operation_and_run_up(results, limit, state, words):
    results.case = with_values(results.case, {"housing.level_limit": limit})
    noise = judged(results)
    assert noise.state == state and noise.limit.startswith(words)
    if state == "bad":
        assert noise.limit.endswith("at the sensor, 4,000 rpm")


def test_a_limit_of_the_microphone_holds_in_operation(results):
    results.case = with_values(results.case, {"housing.microphone": {"level_limit": 60}})
    results.housing["pressure_level"] = ("speed", [63.5])
    assert judged(results).limit == "3.5 dB over the limit of the case at the microphone, 3,000 rpm"


def test_no_line_stands_out_of_many_and_a_far_mode_is_not_named(results):
    results.housing["level"][:] = 12.0
    results.modes["frequency"].values[1] = 2500.0
    results.runup["distance"].values[1] = 12.0
    sentence = judged(results).sentence
    assert "no line stands out, the largest line, 2,160 Hz (mesh harmonic 2), makes 6 % of" in sentence


@pytest.mark.parametrize(
    ("given", "assumed"),
    [
        ("", ["damping (0.05)", "housing (the ring alone)", "microphone distance (1 m)"]),
        ("[dynamics]\ndamping_ratio = 0.03\n", ["housing (the ring alone)", "microphone distance (1 m)"]),
        ('[housing]\nsensor_angle = "30 deg"\n', ["damping (0.05)", "microphone distance (1 m)"]),
        ('[dynamics]\ndamping_ratio = 0.03\n[housing.microphone]\ndistance = "2 m"\n', []),
    ],
)
def test_a_level_says_what_was_assumed_where_the_case_gives_none(results, given, assumed):
    results.case = parse_case(new_case("planetary") + "\n" + given)
    results.findings = tuple(case_warnings(results.case))
    assert [finding.concerns for finding in results.findings if finding.code == "W-ESTIMATED"] == assumed
    limit = judged(results).limit
    assert all(words in limit for words in assumed) and ("rests on estimated" in limit) == bool(assumed)


def test_a_published_set_assumes_its_microphone_alone():
    assumed = [finding for finding in case_warnings(read_case(CASE)) if finding.code == "W-ESTIMATED"]
    assert [finding.key for finding in assumed] == ["housing.microphone.distance"]
