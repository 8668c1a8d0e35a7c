"""Judgements of a gearbox: the loudest sensor with line, mode and way, and safeties over all load cases."""

from types import SimpleNamespace

import numpy as np
import pytest
from casings import answer_in_a_casing

from femgear.case.level_limits import LevelPoint
from femgear.stages.judgements import QUIET, SMOOTH, STRONG, SURE
from femgear.trains.gearbox.judgements import gearbox_judgements
from femgear.trains.gearbox.mode_words import near_mode


class Files(SimpleNamespace):
    def __getitem__(self, name):
        return getattr(self, name)


@pytest.fixture(scope="module")
def results():
    answer = answer_in_a_casing()
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
    assert f"mesh harmonic {data['harmonic'].values[line]} at {hertz:,.0f} Hz" in sentence
    mode = near_mode(results.modes, hertz)
    near = f" near {mode}," if mode else ""
    assert f"{near} makes {power:.0%} of the power" in sentence
    way = data["path"].values[int(data["path_share"].values[0, :, sensor].argmax())]
    assert f"most of it comes by {way} (" in sentence and "Loudest of the run-up: " in sentence


def test_a_silent_gearbox_is_said_to_be_silent(results):
    silent = Files(**vars(results))
    levels = np.zeros_like(results.dynamics["level"].values)
    silent.dynamics = _with(results.dynamics, level=levels)
    judged = {judgement.question: judgement for judgement in gearbox_judgements(silent)}
    assert judged[QUIET].answer.startswith("silence") and judged[QUIET].limit == "nothing excites it"


def test_the_worst_sensor_is_judged_by_its_limit(results):
    sensor = str(results.dynamics["sensor"].values[0])
    level = results.dynamics["level"].values[:, 0]
    limited = Files(**vars(results))
    for factor, state in ((2.0, "good"), (0.5, "bad")):
        highest = factor * max(float(level.max()), float(results.runup["level"].values[:, 0].max()))
        limited.case = SimpleNamespace(
            **{
                entry: getattr(results.case, entry)
                for entry in ("strength", "pair", "planetary", "operation", "losses")
            },
            sensor=(SimpleNamespace(name=sensor, level_limit=(LevelPoint(level=f"{highest:.17g} m/s^2"),)),),
        )
        noise = {judgement.question: judgement for judgement in gearbox_judgements(limited)}[QUIET]
        assert noise.state == state
        assert f"6.0 dB {'below' if state == 'good' else 'over'} the limit at {sensor}" in noise.limit


def _with(data, **values):
    """Contents with other values of some variables."""

    class Other:
        attrs, sizes = data.attrs, data.sizes

        def __contains__(self, name):
            return name in data

        def __getitem__(self, name):
            return SimpleNamespace(values=values[name]) if name in values else data[name]

    return Other()
