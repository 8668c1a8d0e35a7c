"""Key figures of a gearbox: one for everything of its files that has a name, and the same numbers as there."""

import numpy as np
import pytest
from casings import answer_in_a_casing
from small_gearbox import planetary_tables

from femgear.case.dependencies import Steps
from femgear.trains.gearbox.key_figures import gearbox_key_figures, stage_meshes
from femgear.trains.live import Answer
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def answer():
    return answer_in_a_casing()


@pytest.fixture(scope="module")
def data(answer):
    return {name: answer[name].contents() for name in answer}


def test_every_figure_is_a_number_of_the_file(answer, data):
    figures = {figure.name: figure for figure in gearbox_key_figures(answer.case)}
    values = {name: figure.read(data[figure.stage]) for name, figure in figures.items()}
    assert {figure.stage for figure in figures.values()} == {*data}
    assert np.isfinite([*values.values()]).all()
    deflection, dynamics, runup = data["deflection"], data["dynamics"], data["runup"]
    expected = {
        "K_Hbeta": deflection["face_load_factor"].values.max(),
        "STE stage": deflection["transmission_error"].values.max(),
        "misalignment": np.abs(deflection["mesh_misalignment"].values).max(),
        "bearing force C": np.hypot(*(deflection[f"{way}_force"].values[0, 2] for way in ("radial", "axial"))),
        "level top": dynamics["level"].values[0, 0],
        "level dB": 20.0 * np.log10(dynamics["level"].values[0, 0] / 1e-6),
        "run-up level top": runup["level"].values.max(),
        "run-up force factor stage": np.nanmax(runup["dynamic_factor"].values),
        "resonance speed": np.pi
        / 30.0
        * runup["resonance_speed"].values[runup["resonance_level"].values[:, 0].argmax()],
        "loudest speed": np.pi / 30.0 * runup["speed"].values[runup["level"].values[:, 0].argmax()],
    }
    assert {name: values[name] for name in expected} == pytest.approx(expected, rel=1e-12)


def test_parts_are_named_as_in_the_file(answer, data):
    names = [figure.name for figure in gearbox_key_figures(answer.case)]
    assert len(set(names)) == len(names)
    for bearing in data["deflection"]["bearing"].values:
        assert f"bearing force {bearing}" in names
    # without catalogue numbers there is no life
    assert "bearing life" not in names


def test_meshes_of_a_set_without_teeth():
    case = read_case(planetary_tables())
    state = Answer(case, Steps()).deflection.contents()
    assert [*stage_meshes(case.planetary[0])] == state["mesh"].values.tolist()
    figures = {figure.name: figure for figure in gearbox_key_figures(case)}
    assert not {"K_Hbeta", "STE", "level", "force factor"} & figures.keys()
    assert figures["K_gamma set"].read(state) == pytest.approx(1.0, abs=1e-9)
    assert figures["mesh force set planet 2-ring"].read(state) == pytest.approx(state["mesh_force"].values[0, 4])
