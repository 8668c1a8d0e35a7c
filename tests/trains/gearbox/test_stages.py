"""A whole run of a gearbox: files, tables, pictures, findings."""

import re

import numpy as np
import pytest
from casings import casing_tables
from small_gearbox import pair_tables

from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.exchange.sampling import Sampling
from femgear.run import export_results, run_case
from femgear.storage.results import run_folder
from femgear.trains.drafts import new_case
from femgear.trains.gearbox.results import describe_deflection, describe_gearbox_modes
from femgear.trains.gearbox.stages import describe_gearbox
from femgear.trains.gearbox.verdict import gearbox_verdict
from femgear.trains.live import Answer, Live
from femgear.trains.reading import open_results, parse_case, read_case
from femgear.trains.registry import stages_of, train_of

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    tables = pair_tables(teeth=True)
    first = tables["operation"]["load_case"][0]
    tables["operation"]["load_case"] = [
        first | {"name": "full", "share": 0.3},
        first | {"name": "back", "share": 0.7, "torque": {"motor": "-60 N m"}},
    ]
    folder = tmp_path_factory.mktemp("box") / "run"
    with run_folder(folder) as place:
        run_case(read_case(tables), place)
    return open_results(folder)


def test_a_stage_of_other_trains_is_refused_with_the_one_that_has_its_results():
    case = read_case(pair_tables(teeth=True))
    for wanted, stands_in in (("life", "deflection"), ("housing", "dynamics")):
        with pytest.raises(CaseError, match="no stage of a gearbox") as refused:
            stages_of(case, wanted)
        assert refused.value.remedies == (f"--only {stands_in} computes it here",)
    with pytest.raises(CaseError) as refused:
        stages_of(case, "branch")
    assert refused.value.remedies == ()


def test_both_load_cases_are_in_the_file(results):
    data = results.deflection
    assert data["load_case"].values.tolist() == ["full", "back"]
    assert data["mesh_force"].values[:, 0] == pytest.approx(
        np.array([100.0, 60.0]) / (0.036 * np.cos(np.radians(20.0))), rel=1e-9
    )
    assert (data["face_load_factor"].values > 1.0).all()
    assert data["settled"].values.all()
    assert data["speed"].values[0] == pytest.approx([1000.0, -2000.0 / 3.0])
    # reversed load, reversed bearing forces across
    force = data["bearing_force"].values
    assert np.sign(force[0, :, 1]) == pytest.approx(-np.sign(force[1, :, 1]))


def test_tables_tell_meshes_bearings_and_modes(results):
    meshes, bearings, load_cases = describe_deflection(results.deflection)
    assert [row[0] for row in load_cases.rows] == ["full", "back"]
    assert [row[0] for row in meshes.rows] == ["stage"]
    assert [row[0] for row in bearings.rows] == ["A", "B", "C", "D"]
    assert "settled in" in meshes.notes[0]
    assert len(describe_gearbox_modes(results.modes).rows) > 5
    case = read_case(results.case.source)
    assert [block.title for block in describe_gearbox(case)] == [
        "Power flow, full",
        "Stages, full",
        "Power flow, back",
        "Stages, back",
        "Drawing, stage",
        "Play of the meshes, stage",
    ]


def test_pictures_are_there(results):
    names = {path.name for path in results.folder.iterdir()}
    assert {"deflected_shafts.png", "load_patterns.png", "campbell.png", "mode_energy.png", "report.html"} <= names
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert "<caption>Meshes in load case full</caption>" in page and "<caption>Modes</caption>" in page


def test_the_verdict_names_the_worst_of_all_load_cases(results):
    (verdict,) = gearbox_verdict(results)
    rows = dict(verdict.rows)
    misaligned = results.deflection["mesh_misalignment"].values
    worst = "full" if abs(misaligned[0, 0]) > abs(misaligned[1, 0]) else "back"
    assert rows["largest misalignment over the width"].endswith(f"stage, {worst}")
    assert f"{np.nanmax(results.deflection['face_load_factor'].values):.3f}" in rows["largest face load factor K_Hβ"]
    nearest = rows["mesh line up to harmonic 3 nearest to a mode"]
    assert re.fullmatch(
        r"(harmonic [23] of )?stage mesh, [\d,]+ Hz, \S+ % (above|below) mode \d+ at [\d,]+ Hz .*", nearest
    )


@pytest.mark.slow
def test_a_run_on_feet_has_pictures_tables_and_signals_of_its_response(tmp_path):
    tables = pair_tables(teeth=True) | {"casing": casing_tables(), "dynamics": {"up_to": "2 kHz"}}
    tables["sensor"] = [{"name": "top", "position": ["90 mm", "80 mm", "40 mm"], "direction": "y"}]
    tables["runup"] = {"from": "900 rpm", "to": "1100 rpm", "count": 2}
    with run_folder(tmp_path / "run") as place:
        run_case(read_case(tables), place)
    results = open_results(tmp_path / "run")
    names = {path.name for path in results.folder.iterdir()}
    assert {"sensor_spectra.png", "run_up_levels.png", "run_up_forces.png"} <= names
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("Largest lines at top") == 2
    (tmp_path / "exported").mkdir()
    files = export_results(results, tmp_path / "exported", ["wav", "uff"], Sampling(duration=0.1, run_up=0.1))
    assert files == ["signals.uff", "modes.uff", "sensor_top_1000_rpm.wav", "sensor_top_run_up.wav"]
    assert {path.name for path in (tmp_path / "exported").iterdir()} == {*files}


@pytest.mark.decisive
def test_changes_leave_the_stages_that_they_do_not_decide():
    tables = pair_tables() | {"casing": casing_tables(), "dynamics": {"up_to": "2 kHz"}}
    tables["sensor"] = [{"name": "top", "position": ["90 mm", "80 mm", "40 mm"], "direction": "y"}]
    tables["pair"][0]["mesh"]["contact_ratio"] = 1.6
    tables["runup"] = {"from": "900 rpm", "to": "1100 rpm", "count": 2}
    handle = Live(read_case(tables))
    deflection, dynamics = handle.answer.deflection, handle.answer.dynamics
    assert handle.change({"title": "another", "runup.count": 3}).dynamics is dynamics
    damped = handle.change({"modes.damping_ratio": 0.06, "modes.up_to": "1 kHz"})
    assert handle.changed == {"deflection": False, "modes": True, "dynamics": True, "runup": True}
    assert damped.deflection is deflection
    alone = Answer(damped.case, Steps()).dynamics.contents()
    for name in ("level", "mesh_force_rms", "path_share"):
        assert damped.dynamics.contents()[name].values == pytest.approx(alone[name].values, rel=1e-12, nan_ok=True)
    assert (damped.dynamics.contents()["level"].values < dynamics.contents()["level"].values).all()
    assert damped.modes.contents()["damping_ratio"].values[-1] == pytest.approx(0.06)
    handle.change({"bearing[0].radial": "1e8 N/m"})
    assert all(handle.changed.values())


def test_a_load_case_is_solved_once_whatever_the_others_are():
    tables = pair_tables()
    first = tables["operation"]["load_case"][0]
    back = first | {"name": "back", "torque": {"motor": "-60 N m"}, "share": 0.5}
    tables["operation"]["load_case"] = [first | {"share": 0.5}, back]
    handle = Live(read_case(tables))
    before = handle.answer.deflection
    after = handle.change(
        {"operation.load_case[1].torque.motor": "-50 N m", "operation.load_case[1].share": 0.6}
        | {"operation.load_case[0].share": 0.4}
    )
    states, alone = after.deflection.states, Answer(after.case, Steps()).deflection.contents()
    assert states[0].motion is before.states[0].motion and states[1].motion is not before.states[1].motion
    assert all(state.model.case is after.case for state in states)
    contents = after.deflection.contents()
    for name in ("mesh_force", "share", "speed", "torque", "bearing_force"):
        assert contents[name].values == pytest.approx(alone[name].values, rel=1e-12, nan_ok=True)
    # what holds shafts decides all of them
    stiff = handle.change({"bearing[0].radial": "1e8 N/m"}).deflection
    assert stiff.states[0].motion is not states[0].motion


CHANGES = (
    {"title": "another"},
    {"balance.harmonics": 2},
    {"balance.harmonics": 3},
    {"modes.damping_ratio": 0.05},
    {"modes.up_to": "3 kHz"},
    {"modes.speeds": 5},
    {"dynamics.up_to": "3 kHz"},
    {"dynamics.mesh_harmonics": 4},
    {"runup.count": 3},
    {"runup.to": "1200 rpm"},
    {"sensor": [{"name": "side", "position": ["180 mm", "0 mm", "40 mm"], "direction": "x"}]},
    {"operation.load_case[1].share": 0.3},
    {"operation.load_case[1].name": "reverse"},
    {"operation.load_case[0].speed.input": "1100 rpm"},
    {"operation.first": 2},
    {"operation.load_case[0].torque.motor": "70 N m"},
    {"thermal.casing_rise": "20 K"},
    {"gravity": {"acceleration": "9.81 m/s^2"}},
    {"bearing[2].axial": "2e8 N/m"},
    {"casing.foot[0].stiffness[1]": "1e8 N/m"},
    {"pair[0].mesh.contact_ratio": 1.5},
    {"shaft[1].axis[1]": "1 mm"},
    {"motions": "plane", "sensor": None, "thermal": None, "gravity": None},
)


@pytest.mark.slow
def test_answers_after_changes_are_those_of_fresh_cases():
    tables = pair_tables() | {"casing": casing_tables(), "dynamics": {"up_to": "2 kHz"}}
    tables["sensor"] = [{"name": "top", "position": ["90 mm", "80 mm", "40 mm"], "direction": "y"}]
    tables["pair"][0]["mesh"]["contact_ratio"] = 1.6
    tables["runup"] = {"from": "900 rpm", "to": "1100 rpm", "count": 2}
    first = tables["operation"]["load_case"][0]
    back = first | {"name": "back", "torque": {"motor": "-60 N m"}, "share": 0.5}
    tables["operation"]["load_case"] = [first | {"share": 0.5}, back]
    handle = Live(read_case(tables))
    for changes in CHANGES:
        answer = handle.change(changes)
        fresh = Answer(answer.case, Steps())
        assert [*answer] == [*fresh]
        for stage in fresh:
            there, alone = answer[stage].dataset(), fresh[stage].dataset()
            assert {*there.variables} == {*alone.variables}, (changes, stage)
            for name in alone.variables:
                values, expected = there[name].values, alone[name].values
                if expected.dtype.kind in "fc":
                    assert values == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True), (changes, stage, name)
                else:
                    assert values.tolist() == expected.tolist(), (changes, stage, name)


def test_teeth_that_several_stages_have_are_drawn_once():
    case = parse_case(new_case("stepped"))
    titles = [block.title for block in describe_gearbox(case)]
    assert [title for title in titles if title.startswith(("Drawing", "Play"))] == [
        "Drawing, sun-planet 1..3",
        "Play of the meshes, sun-planet 1..3, planet 1..3-ring",
        "Drawing, planet 1..3-ring",
    ]


def test_all_tables_of_a_run_have_those_of_every_stage(results):
    """Lives, load cases and strength of a gearbox stand behind the first table of its deflection."""
    titles = [block.title for block in train_of(results.case).describe_results(results)]
    of_stage = [block.title for block in describe_deflection(results.deflection)]
    assert len(of_stage) > 1 and {*of_stage} <= {*titles}
