"""Judgements of a gearbox: the loudest sensor with line, mode and way, and safeties over all load cases."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from casings import answer_in_a_casing

from femgear.case.level_limits import LevelPoint
from femgear.findings import DOUBT, Finding, percent
from femgear.stages.judgements import QUIET, SMOOTH, STRONG, SURE
from femgear.trains.gearbox import judgements
from femgear.trains.gearbox.judgements import gearbox_judgements
from femgear.trains.gearbox.mode_words import near_mode, nearest_mesh_words

pytestmark = pytest.mark.usefixtures("coarse_states")


class Files(SimpleNamespace):
    def __getitem__(self, name):
        return getattr(self, name)


@pytest.fixture(scope="module")
def results():
    answer = answer_in_a_casing(stresses=True)
    data = {name: answer[name].contents() for name in answer}
    manifest = SimpleNamespace(complete=True)
    return Files(stages=tuple(data), findings=(), case=answer.case, manifest=manifest, **data)


def test_the_questions_of_a_gearbox_in_a_casing(results):
    judged = {judgement.question: judgement for judgement in gearbox_judgements(results)}
    assert [question for question in judged if question in (STRONG, SMOOTH, QUIET, SURE)] == [
        STRONG,
        SMOOTH,
        QUIET,
        SURE,
    ]
    assert judged[STRONG].state == "open" and judged[SURE].state == "good"
    assert judged[STRONG].limit == "give treatment and hardness in the material of the teeth of stage"
    data = results.dynamics
    size = np.hypot(data["lines_real"].values, data["lines_imag"].values)
    sensor = int(data["level"].values[0].argmax())
    line = int(size[0, sensor].argmax())
    hertz = data["order"].values[line] * data["speed"].values[0] / 60.0
    power = 0.5 * (size[0, sensor, line] / data["level"].values[0, sensor]) ** 2
    sentence = judged[QUIET].sentence
    assert f"mesh harmonic {data['harmonic'].values[line]:g} at {hertz:,.0f} Hz" in sentence
    mode = near_mode(results.modes, hertz)
    near = f" near {mode}," if mode else ""
    assert f"{near} makes {percent(power)} of the power" in sentence
    way = data["path"].values[int(data["path_share"].values[0, :, sensor].argmax())]
    assert f"the largest part comes by {way} (" in sentence and "Largest of the run-up: " in sentence


def test_a_gearbox_whose_main_line_is_beside_a_mode_deserves_a_look(results):
    data, beside = results.dynamics, Files(**vars(results))
    size = np.hypot(data["lines_real"].values[0], data["lines_imag"].values[0])
    sensor = int(data["level"].values[0].argmax())
    line = int(size[sensor].argmax())
    hertz = float(data["order"].values[line] * data["speed"].values[0] / 60.0)
    assert 0.5 * (size[sensor, line] / data["level"].values[0, sensor]) ** 2 > 0.25
    for factor, state, words in (
        (1.01, "look", f" at {hertz:,.0f} Hz, 1.0 % below mode "),
        (1.5, "open", "level_limit"),
    ):
        count = results.modes.sizes["mode"]
        beside.modes = _with(results.modes, frequency=np.r_[factor * hertz, np.full(count - 1, 9.0 * hertz)])
        judged = {judgement.question: judgement for judgement in gearbox_judgements(beside)}[QUIET]
        assert judged.state == state and words in judged.limit


def test_a_silent_gearbox_is_said_to_be_silent(results):
    silent = Files(**vars(results))
    levels = np.zeros_like(results.dynamics["level"].values)
    silent.dynamics = _with(results.dynamics, level=levels)
    judged = {judgement.question: judgement for judgement in gearbox_judgements(silent)}
    assert judged[QUIET].answer.startswith("silence") and judged[QUIET].limit == "nothing excites it"


def with_limit(results, factor: float, change: float = 0.0, findings=()):
    """Answer to how loud it is, the limit being so many times the loudest level, which a longer excitation changes."""
    sensor = str(results.dynamics["sensor"].values[0])
    # without modes there is no resonance, which deserves a look below a limit too
    limited = Files(**vars(results) | {"stages": ("dynamics", "runup")})
    highest = factor * max(float(data["level"].values[:, 0].max()) for data in (results.dynamics, results.runup))
    entries = ("strength", "pair", "planetary", "operation", "load_case", "losses")
    limited.case = SimpleNamespace(
        **{entry: getattr(results.case, entry) for entry in entries},
        sensor=(SimpleNamespace(name=sensor, level_limit=(LevelPoint(level=f"{highest:.17g} m/s^2"),)),),
    )
    for name in ("dynamics", "runup"):
        data = results[name]
        setattr(limited, name, _with(data, level_change=np.full(data["level"].values.shape, change)))
    limited.findings = findings
    return {judgement.question: judgement for judgement in gearbox_judgements(limited)}[QUIET]


def test_the_worst_sensor_is_judged_by_its_limit(results):
    for factor, state in ((2.0, "good"), (0.5, "bad")):
        noise = with_limit(results, factor)
        assert noise.state == state
        assert f"6.0 dB {'below' if state == 'good' else 'over'} the limit of the case at top, " in noise.limit


def test_a_level_below_its_limit_deserves_a_look_where_its_excitation_ends_short(results):
    short = Finding("W-EXCITATION", "dynamics.up_to", "it ends short", severity=DOUBT, stage="dynamics")
    noise = with_limit(results, 2.0, -2.0, (short,))
    assert noise.state == "look" and "6.0 dB below the limit of the case at top" in noise.limit
    assert noise.limit.endswith("; doubt: † excitation falls short")
    # the level of the other stage has no mark
    assert " m/s²† r.m.s. at top" in noise.answer and noise.sentence.count("†") == 1
    assert with_limit(results, 2.0, 0.0, (replace(short, stage="deflection"),)).state == "good"


def test_a_level_that_a_longer_excitation_takes_over_its_limit_does_not_hold(results):
    noise = with_limit(results, 2.0, 7.0)
    assert noise.state == "bad" and noise.limit.startswith(
        "1.0 dB over the limit of the case at top with a longer excitation, "
    )


def test_the_loudest_sensor_of_the_run_up_is_named_where_it_is_another_one(results):
    def sentence(names) -> str:
        two = Files(**vars(results))
        level = results.runup["level"].values
        two.runup = _with(results.runup, level=np.hstack([level, 3.0 * level]), sensor=np.array(names))
        two.case = results.case.model_copy(update={"sensor": ()})
        return {judgement.question: judgement for judgement in gearbox_judgements(two)}[QUIET].sentence

    assert " at sensor foot, 9" in sentence(["top", "foot"])
    assert "Largest of the run-up" in sentence(["foot", "top"]) and sentence(["foot", "top"]).count("sensor") == 1


def test_sensors_of_a_gearbox_without_torque_are_told_why_they_hear_nothing(results):
    idle = Files(**vars(results))
    idle.stages = ("deflection", "modes")
    load = results.case.operation.load_case[0]
    still = load.model_copy(update={"torque": dict.fromkeys(load.torque, 0.0)})
    operation = results.case.operation.model_copy(update={"load_case": (still,)})
    idle.case = results.case.model_copy(update={"operation": operation})
    noise = {judgement.question: judgement for judgement in gearbox_judgements(idle)}[QUIET]
    assert noise.answer == "no level at its sensors" and noise.words == "○ not computed"
    remedy = "give a torque that is not zero in the load case of operation.first"
    assert noise.limit == f"no stage that excites it carries a torque: {remedy}"
    idle.case = results.case
    noise = {judgement.question: judgement for judgement in gearbox_judgements(idle)}[QUIET]
    assert noise.limit == "a run of all stages computes it"
    idle.case = results.case.model_copy(update={"sensor": ()})
    noise = {judgement.question: judgement for judgement in gearbox_judgements(idle)}[QUIET]
    assert noise.answer == "no sensor in this run"


def test_teeth_that_were_looked_at_by_balance_alone_have_their_largest_force(results):
    rattling = Files(**vars(results))
    rattling.stages = ("modes", "balance")
    forces = {"mean_force": [100.0, 50.0, 0.01], "largest_force": [120.0, 75.0, 90.0]}
    rattling.balance = xr.Dataset({name: ("mesh", values) for name, values in forces.items()})
    smooth = {judgement.question: judgement for judgement in gearbox_judgements(rattling)}[SMOOTH]
    assert smooth.answer == "largest mesh force 1.500 of its mean" and smooth.limit == "teeth stay in contact"


@pytest.mark.parametrize(("factor", "near"), [(1.1, False), (1.5, True)])
def test_a_gearbox_without_sensors_says_which_mesh_line_is_nearest_to_a_mode_where_forces_are_large(
    results, factor, near
):
    silent, response = Files(**vars(results)), results.dynamics
    silent.stages = ("deflection", "modes", "dynamics")
    silent.case = results.case.model_copy(update={"sensor": ()})
    factors = np.full(response["dynamic_factor"].shape, factor)
    silent.dynamics = _with(response, dynamic_factor=factors)
    silent.dynamics.sizes = {"sensor": 0, "speed": 1}
    sentence = {judgement.question: judgement for judgement in gearbox_judgements(silent)}[QUIET].sentence
    assert sentence.startswith(f"Its mesh forces reach {factor:.2f} times their mean (stage at ")
    assert sentence.endswith(f"; nearest to a mode is the {nearest_mesh_words(results.modes)}") == near


def _with(data, **values):
    """Contents with other values of some variables."""

    class Other:
        attrs, sizes = data.attrs, data.sizes

        def __contains__(self, name):
            return name in data

        def __getitem__(self, name):
            return SimpleNamespace(values=values[name]) if name in values else data[name]

    return Other()


@pytest.mark.parametrize(
    ("level", "words"),
    [(0.0, "silence"), (16.7, "16.7 m/s²"), (0.152, "0.152 m/s²"), (1.8e-5, "18 µm/s²"), (2e-9, "0.002 µm/s²")],
)
def test_levels_are_in_the_unit_of_their_size(level, words):
    assert judgements._level(level) == words


def test_each_number_of_the_motion_names_its_load_case_and_neighbours_of_one_case_once(results):
    """The error is largest in the first of two load cases, K_Hbeta in the second, the response is of the first."""
    two = Files(**vars(results))
    cases = tuple(SimpleNamespace(name=name) for name in ("full", "coast"))
    two.case = SimpleNamespace(operation=SimpleNamespace(load_case=cases), load_case=cases[0])
    two.deflection = xr.Dataset(
        {
            "transmission_error": (("load_case", "mesh"), [[2e-6, 1e-6], [1e-6, 1e-6]]),
            "face_load_factor": (("load_case", "mesh"), [[1.1, 1.1], [1.2, 1.3]]),
        }
    )
    text = judgements._motion(two)
    assert text.startswith("transmission error 2 µm (full), face load factor K_Hβ 1.3 (coast), dynamic factor K_v ")
    assert text.endswith(" (full)")
    two.deflection["face_load_factor"][0, 0] = 1.4
    assert judgements._motion(two).startswith("transmission error 2 µm, face load factor K_Hβ 1.4, dynamic factor")
    two.stages = ()
    assert judgements._motion(two) == ""
