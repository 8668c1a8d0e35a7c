"""Files and tables of the response of a gearbox, and what they say against themselves."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from casings import RPM, pair_in_a_casing, response
from planet_gearboxes import COUNTED, in_casing, responded, simple_set

from femgear.findings import DOUBT, NOTE
from femgear.housing.sound import a_weighting
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.gearbox.response_results import (
    GearboxResponseResult,
    describe_gearbox_response,
    gearbox_response_warnings,
    line_origin,
    main_way,
    response_tables,
)

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture
def data():
    return GearboxResponseResult(response(), whole=True, longer=response()).dataset()


def codes(data) -> list[str]:
    return [finding.code for finding in gearbox_response_warnings(data)]


def test_the_file_has_levels_lines_and_forces(data):
    assert dict(data.sizes) == {
        "speed": 2,
        "stage": 1,
        "kind": 2,
        "line": 7,
        "sensor": 3,
        "bearing": 4,
        "mesh": 1,
        "axis": 3,
        "foot": 4,
    }
    assert data["stage_of_mesh"].values.tolist() == ["stage"]
    assert data["speed"].values == pytest.approx([1000.0, 2500.0])
    lines = np.hypot(data["lines_real"], data["lines_imag"]).values
    assert data["level"].values == pytest.approx(np.sqrt(0.5 * (lines**2).sum(axis=2)))
    assert data["level_of_stage"].values[..., 0] == pytest.approx(data["level"].values)
    hertz = data["order"].values * data["speed"].values[:, None] / 60.0
    power = 0.5 * ((lines * a_weighting(hertz)[:, None]) ** 2).sum(axis=2)
    assert data["weighted_level"].values == pytest.approx(10.0 * np.log10(power) + 120.0, abs=1e-6)
    force = np.hypot(data["bearing_force_real"], data["bearing_force_imag"]).values
    assert data["bearing_force_rms"].values == pytest.approx(np.sqrt(0.5 * (force**2).sum(axis=3)))
    assert all(array.attrs["units"] for array in data.data_vars.values())


def test_lines_of_bearings_are_left_out_of_a_run_up():
    data = GearboxResponseResult(response(), whole=False).dataset()
    assert "bearing_force_real" not in data
    assert "bearing_force_rms" in data


def test_result_tells_how_it_was_found():
    result = GearboxResponseResult(response(), whole=True)
    assert result.residual < 1e-8
    assert "GMRES" in result.message


def test_tables_name_stages_sensors_and_the_origin_of_lines(data):
    block = describe_gearbox_response(data)
    assert block.rows[0][0] == "stage"
    titles = [table.title for table in response_tables(data)]
    assert titles[0].startswith("Levels at 2500 rpm")
    assert [title for title in titles if title.startswith("Largest lines")] == [
        f"Largest lines at {name}" for name in "xyz"
    ]
    assert line_origin(data, 0) == "stage, mesh harmonic 1"


def test_side_bands_are_turns_of_the_carrier(data):
    data["side_band"].values[0] = -3
    assert line_origin(data, 0) == "stage, mesh harmonic 1, side band -3"
    data["harmonic"].values[0] = 0
    data["side_band"].values[0] = 3
    assert line_origin(data, 0) == "stage, 3 x carrier"


def test_nothing_is_said_of_a_quiet_response(data):
    assert codes(data) == []


def test_flanks_that_would_part_are_told(data):
    data["lowest_force"].values[1, 0, 0] = -1.0
    (finding,) = gearbox_response_warnings(data)
    assert finding.code == "W-PULL"
    assert "2500 rpm" in finding.text


def test_side_bands_and_an_excitation_that_end_too_early_are_told(data):
    data["outer"].values[0, 0] = 0.1
    change = xr.DataArray([[np.nan] * 3, [0.1, 0.1, -0.7]], dims=("speed", "sensor"))
    data = data.assign(level_change=change).assign_attrs(compared_to=6e3)
    assert codes(data) == ["W-TAIL", "W-EXCITATION"]
    text = list(gearbox_response_warnings(data))[1].text
    assert text == "excitation to 6 kHz in place of 3 kHz changes the level of z at 2500 rpm by -0.7 dB"


def test_levels_at_the_outermost_side_bands_are_told(data):
    assert not data["outer_level"].values.any()
    found = response()
    stage = found.stages[0]
    found = replace(found, stages=(replace(stage, side_band=np.where(stage.harmonic == 1, 4, 0)),))
    data = GearboxResponseResult(found, whole=True).dataset()
    power = data["lines_real"].values ** 2 + data["lines_imag"].values ** 2
    share = power[..., data["harmonic"].values == 1].sum(axis=2) / power.sum(axis=2)
    assert data["outer_level"].values[..., 0] == pytest.approx(share)
    (finding,) = (one for one in gearbox_response_warnings(data) if one.key == "dynamics.side_bands")
    assert finding.code == "W-TAIL" and f"{share.max():.2g} of the power" in finding.text


def test_stages_that_change_one_another_are_told(data):
    cross = xr.DataArray(np.array([[[0.0]], [[0.2]]]), dims=("speed", "stage", "other_stage"))
    (finding,) = gearbox_response_warnings(data.assign(cross_excitation=cross))
    assert finding.code == "W-CROSS"
    part = 0.2 * float((data["mesh_force_rms"] / data["mean_force"]).values[1, 0, 0])
    assert "20 %" in finding.text and f"{part:.2g} of its mean force, 0.2 of the level at" in finding.text
    assert finding.severity == DOUBT
    # what is left out of a stage that makes nothing of the level, and hardly a force, is a note
    small = data.assign(
        cross_excitation=cross, mesh_force_rms=1e-4 * data["mean_force"], level_of_stage=0.04 * data["level_of_stage"]
    )
    (finding,) = gearbox_response_warnings(small)
    assert (finding.code, finding.severity) == ("W-CROSS", NOTE)
    for name, value in (("mesh_force_rms", 0.006 * data["mean_force"]), ("level_of_stage", data["level_of_stage"])):
        (finding,) = gearbox_response_warnings(small.assign({name: value}))
        assert finding.severity == DOUBT


def test_peaks_between_the_speeds_of_a_run_up_are_told(data):
    assert data.attrs["unresolved_resonances"] == 0
    data.attrs["unresolved_resonances"] = 3
    (finding,) = gearbox_response_warnings(data)
    assert (finding.code, finding.key) == ("W-STEPS", "runup.count")
    assert "3 resonances" in finding.text


def test_stages_without_teeth_are_told(data):
    data.attrs["missing"] = "second stage"
    (finding,) = gearbox_response_warnings(data)
    assert finding.code == "W-EXCITATION"
    assert "second stage" in finding.text


def test_bodies_that_are_elastic_in_modes_alone_are_told(data):
    assert data.attrs["rigid"] == ""
    data.attrs["rigid"] = "ring of second stage"
    assert codes(data) == ["W-RIGID"]


def test_a_response_of_few_harmonics_tells_what_a_longer_excitation_does():
    found = pair_in_a_casing()
    dynamics = found.model.case.dynamics.model_copy(update={"mesh_harmonics": 2})
    case = found.model.case.model_copy(update={"dynamics": dynamics})
    found = replace(found, model=replace(found.model, case=case))
    longer = solve_gearbox_response(pair_in_a_casing(), [1000.0 * RPM])
    data = GearboxResponseResult(solve_gearbox_response(found, [1000.0 * RPM]), whole=True, longer=longer).dataset()
    assert data["harmonic"].values.tolist() == [1, 2]
    whole = GearboxResponseResult(longer, whole=True).dataset()
    change = 20.0 * np.log10(whole["level"].values[0] / data["level"].values[0])
    assert data["level_change"].values[0] == pytest.approx(change)
    assert data["longer_dynamic_factor"].values[0, 0, 0] == whole["dynamic_factor"].values[0, 0, 0]
    (finding,) = [one for one in gearbox_response_warnings(data) if one.code == "W-EXCITATION"]
    assert finding.key == "dynamics.mesh_harmonics" and "at most 2 mesh harmonics" in finding.text


def small_response(**changes):
    """Two speeds of one stage at one sensor, whose level comes by two ways."""
    values = {
        "dynamic_factor": (("speed", "stage", "kind"), [[[1.5, np.nan]], [[1.02, np.nan]]]),
        "longer_dynamic_factor": (("speed", "stage", "kind"), [[[1.8, np.nan]], [[np.nan, np.nan]]]),
        "outer": (("speed", "stage"), [[0.0], [0.0]]),
        "lowest_force": (("speed", "stage", "kind"), [[[10.0, np.nan]], [[10.0, np.nan]]]),
        "path_share": (("speed", "path", "sensor"), [[[0.7], [0.3]], [[0.7], [0.3]]]),
    }
    coordinates = {"speed": [1000.0, 2000.0], "stage": ["first"], "path": ["bearing A", "bearing B"], "sensor": ["top"]}
    attributes = {"up_to": 2e4, "compared_to": 4e4, "rigid": "", "missing": ""}
    return xr.Dataset(values | changes, coordinates, attributes)


def test_forces_that_a_longer_excitation_changes_are_told():
    (finding,) = gearbox_response_warnings(small_response())
    assert (finding.code, finding.key) == ("W-TAIL", "dynamics.up_to")
    assert finding.text == ("excitation to 40 kHz in place of 20 kHz changes K_v of first at 1000 rpm from 1.5 to 1.8")
    small = (("speed", "stage", "kind"), [[[1.55, np.nan]], [[np.nan, np.nan]]])
    assert not [*gearbox_response_warnings(small_response(longer_dynamic_factor=small))]
    former = small_response().drop_vars("longer_dynamic_factor")
    (unsolved,) = gearbox_response_warnings(former.assign_attrs(compared_to=np.nan))
    assert unsolved.code == "W-TAIL" and unsolved.text.endswith("it did not converge")
    del former.attrs["compared_to"]
    assert not [*gearbox_response_warnings(former)]


def test_ways_that_cancel_have_no_share():
    assert main_way(small_response(), 0) == "bearing A (70 % of the power)"
    opposed = (("speed", "path", "sensor"), [[[-0.2], [1.2]]] * 2)
    assert main_way(small_response(path_share=opposed), 0) == "bearing B (more than all of the power)"
    cancelling = (("speed", "path", "sensor"), [[[-11.0], [12.0]]] * 2)
    assert main_way(small_response(path_share=cancelling), 0) == "bearing B, but bearing A takes most of that away"


@pytest.mark.parametrize("fixed", ["carrier", "ring"])
def test_a_carrier_that_stands_is_said_to_make_no_side_bands(fixed):
    tables = simple_set(teeth=(28, 38, 104), mesh=COUNTED, motions="plane", fixed=fixed)
    data = GearboxResponseResult(responded(in_casing(tables, harmonics=2)), whole=True).dataset()
    stands = fixed == "carrier"
    assert data.attrs["standing"] == ("carrier" if stands else "")
    assert ("no side bands" in " ".join(describe_gearbox_response(data).notes)) is stands
    # lines beside mesh harmonics
    harmonics = data["order"].values / data["order"].values[data["harmonic"].values == 1].min()
    assert bool(np.allclose(harmonics, np.rint(harmonics))) is stands


def test_of_stages_that_change_one_another_the_change_that_one_reads_is_told():
    """30 % of the force of a stage that hardly moves beside 8 % of one whose force varies by a fifth of its mean."""
    cross = np.zeros((1, 3, 3))
    cross[0, 2, 0], cross[0, 0, 1] = 0.3, 0.08
    forces = ("speed", "stage", "kind")
    data = xr.Dataset(
        {
            "lowest_force": (forces, np.ones((1, 3, 1))),
            "outer": (("speed", "stage"), np.zeros((1, 3))),
            "cross_excitation": (("speed", "stage", "other_stage"), cross),
            "mesh_force_rms": (forces, [[[0.2], [0.1], [1e-5]]]),
            "mean_force": (forces, np.ones((1, 3, 1))),
        },
        coords={"speed": [1500.0], "stage": ["first", "second", "third"], "other_stage": ["first", "second", "third"]},
        attrs={"missing": "", "rigid": "", "up_to": 2e4},
    )
    (finding,) = gearbox_response_warnings(data)
    assert finding.severity == DOUBT and "stiffness of first on the motion by second makes 8 %" in finding.text
    assert "0.016 of its mean force" in finding.text
    cross[0, 0, 1] = 0.0
    (finding,) = gearbox_response_warnings(data.assign(cross_excitation=(("speed", "stage", "other_stage"), cross)))
    assert finding.severity == NOTE and "stiffness of third on the motion by first makes 30 %" in finding.text
