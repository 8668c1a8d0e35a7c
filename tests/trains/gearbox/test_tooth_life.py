"""Lives of the teeth of the stages of a gearbox from its loaded states."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.stages.strength import rate_case
from femgear.trains.gearbox.key_figures import gearbox_key_figures
from femgear.trains.gearbox.life import bearing_life_findings
from femgear.trains.gearbox.shared_gears import SharedGear
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.gearbox.tooth_life import (
    pitting_problems,
    stage_spectra,
    stages_without_life,
    tooth_life_contents,
)
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

STEEL = {"treatment": "case hardened steel", "hardness": 720}


def tables_of(*cases, **operation):
    """Tables of a pair with teeth and load cases of name, torque, speed and share."""
    tables = pair_tables(teeth=True) | {"deflection": {"slices": 3}}
    tables["pair"][0]["teeth"]["material"] |= STEEL
    tables["operation"] |= operation | {
        "load_case": [
            {"name": name, "torque": {"motor": torque}, "speed": {"input": speed}, "share": share}
            for name, torque, speed, share in cases
        ]
    }
    return tables


@pytest.fixture(scope="module")
def result():
    cases = (
        ("start", "400 N m", "500 rpm", 0.1),
        ("run", "100 N m", "2000 rpm", 0.6),
        ("back", "-60 N m", "900 rpm", 0.3),
    )
    return solve_deflections(read_case(tables_of(*cases, required_hours=20000)))


def test_spectra_are_those_of_the_loaded_states(result):
    spectra = {(rated.kind, rated.name): rated for rated in stage_spectra(result.states)}
    assert list(spectra)[:2] == [("root", "gear 1 of stage"), ("root", "gear 2 of stage")]
    assert ("flank", "gear 2 of stage, back flank") in spectra
    root = spectra["root", "gear 2 of stage"]
    assert root.spectrum.cycles == pytest.approx(60.0 * np.array([50.0, 1200.0, 270.0]) * 24 / 36, rel=1e-12)
    for number, (state, torque) in enumerate(zip(result.states, (400.0, 100.0, 60.0), strict=True)):
        contact = state.contacts["stage"]
        flank = rate_case(contact.case, torque=torque, face=contact.face_load_factor).flanks[1]
        # both directions: the root alternates
        assert root.spectrum.ratio[number] == pytest.approx(1.0 / flank.root_safety / 0.7, rel=1e-12)


def test_the_file_has_lives_and_the_life_that_is_asked_for(result):
    variables, coords, attrs = tooth_life_contents(result.states)
    data = result.dataset()
    assert attrs == {"required_hours": 20000.0, "without_life": ""} and data.attrs["required_hours"] == 20000.0
    assert data["root_life"].values == pytest.approx(variables["root_life"][1])
    assert list(data["flank"].values) == coords["flank"][1]
    assert not list(bearing_life_findings(data))  # bearings without ratings
    data["spectrum_reference_life"][:] = [1e6, 3e3, 5e3, 1e7]
    (finding,) = bearing_life_findings(data)
    assert finding.code == "W-LIFE" and "B 3000 h, C 5000 h" in finding.text


def test_stages_and_gears_that_carry_without_a_life_are_named(result):
    of_gear_1 = [rated for rated in stage_spectra(result.states) if "gear 2" not in rated.name]
    assert [*stages_without_life(result.states, of_gear_1)] == ["gear 2 of stage"]
    assert [*stages_without_life(result.states, [])] == ["stage"]


def test_a_gear_with_several_mates_has_its_life_under_a_name_with_commas(result, monkeypatch):
    shared = SharedGear("input", 24, (("stage", 0), ("other", 0)))
    spectra = [
        replace(rated, name=rated.name.replace("gear 1 of stage", shared.name))
        for rated in stage_spectra(result.states)
    ]
    monkeypatch.setattr("femgear.trains.gearbox.tooth_life.shared_gears", lambda case: (shared,))
    assert "," in shared.name and not [*stages_without_life(result.states, spectra)]


def test_lives_are_key_figures_of_the_gearbox(result):
    figures = {figure.name: figure for figure in gearbox_key_figures(result.case)}
    data = result.contents()
    assert figures["root life"].read(data) == data["root_life"].values.min()
    assert figures["S_H over life"].read(data) == data["flank_spectrum_safety"].values.min()
    tables = tables_of(("run", "100 N m", "1000 rpm", 1.0))
    assert "S_F over life" not in {figure.name for figure in gearbox_key_figures(read_case(tables))}
    del tables["pair"][0]["teeth"]["material"]["treatment"]
    assert "flank life" not in {figure.name for figure in gearbox_key_figures(read_case(tables))}


@pytest.mark.slow
def test_two_halves_of_a_load_case_are_the_whole():
    whole = solve_deflections(read_case(tables_of(("run", "400 N m", "2000 rpm", 1.0))))
    parts = tables_of(("run", "400 N m", "2000 rpm", 0.5), ("more", "400 N m", "2000 rpm", 0.5))
    halves = stage_spectra(solve_deflections(read_case(parts)).states)
    for one, two in zip(stage_spectra(whole.states), halves, strict=True):
        assert two.spectrum.hours == pytest.approx(one.spectrum.hours, rel=1e-12)


def test_pitting_of_a_gearbox_is_refused_by_its_entry():
    tables = tables_of(("run", "100 N m", "1000 rpm", 1.0)) | {"strength": {"pitting": "limited"}}
    case = read_case(tables)
    assert not list(pitting_problems(case, case.pair))
    nitrided = copy.deepcopy(tables)
    nitrided["pair"][0]["teeth"]["strength"] = {"edition": 2006}
    nitrided["pair"][0]["teeth"]["material"] |= {"treatment": "nitrided steel", "hardness": 700}
    case = read_case(nitrided)  # teeth with a section of their own do not take that of the gearbox
    assert not list(pitting_problems(case, case.pair))
