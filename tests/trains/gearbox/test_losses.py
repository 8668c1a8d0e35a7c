"""Losses of a gearbox: teeth, bearings, balance of powers, what is left out."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from small_gearbox import pair_tables, set_on_shafts

from femgear.case.lubrication import oil_at
from femgear.errors import CaseError
from femgear.gears.power_losses import planetary_efficiency
from femgear.report.tables import Marks
from femgear.stages.judgements import judge_heat
from femgear.stages.key_figures import figure_of
from femgear.stages.losses import check_loss_entries
from femgear.stages.losses_results import describe_losses, efficiency_rows, loss_tables
from femgear.stages.planet_bearings import planet_friction
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.key_figures import gearbox_key_figures
from femgear.trains.gearbox.losses import (
    bearing_torque,
    idle_loss_entries,
    loss_point,
    solve_box_heat,
    solve_box_losses,
    unknown_mesh_losses,
)
from femgear.trains.gearbox.results import DeflectionResult
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

BALLS = {
    "kind": "ball",
    "rolling_elements": 9,
    "element_diameter": "9.5 mm",
    "pitch_diameter": "46 mm",
    "static_rating": "11.2 kN",
}
LOSSES = {"friction": "constant", "coefficient": 0.05}
OIL = {"viscosity": "20 mm^2/s"}


def geared(losses=LOSSES, oil=OIL, *, teeth=True, **bearing):
    """Gearbox of a pair, with teeth or a given mesh, whose bearings A and C have balls."""
    tables = pair_tables(teeth=teeth) | {"losses": losses, "deflection": {"slices": 3, "passes": 3}}
    tables |= {"lubricant": oil} if oil else {}
    for number in (0, 2):
        section = tables["bearing"][number]
        tables["bearing"][number] = {name: section[name] for name in ("name", "shaft", "position")}
        tables["bearing"][number] |= {name: value for name, value in (BALLS | bearing).items() if value is not None}
    return read_case(tables)


def solved(case):
    states = tuple(solve_deflection(case, load_case) for load_case in case.operation.load_case)
    return DeflectionResult(case, states, case.operation.first - 1)


@pytest.fixture(scope="module")
def loaded():
    return solved(geared())


@pytest.fixture(scope="module")
def result(loaded):
    return solve_box_losses(loaded.case, loaded)


def test_powers_balance_and_losses_are_those_of_teeth_and_bearings(result):
    data = result.dataset()
    flow = result.points[0].flow
    assert abs(float(data["power_imbalance"][0])) < 1e-9
    assert float(data["loss"][0]) == pytest.approx(float(data["mesh_loss"].sum() + data["bearing_loss"].sum()))
    assert float(data["input_power"][0]) == pytest.approx(100.0 * 1000.0 * math.pi / 30.0)
    assert 148.0 < flow.torque["output"] < 150.0
    passed = 1.0 - 0.05 * float(data["loss_factor"][0, 0])
    assert float(data["stage_efficiency"][0, 0]) == pytest.approx(passed)


def test_bearings_without_a_kind_are_left_out_and_that_is_said(result):
    lost = dict(zip(result.dataset()["bearing"].values, result.dataset()["bearing_loss"].values[0], strict=True))
    assert math.isnan(lost["B"]) and math.isnan(lost["D"]) and lost["A"] > lost["C"] > 0.0
    assert [finding.code for finding in result.findings] == ["W-LOSSES"] and "B, D" in result.findings[0].text


@pytest.mark.slow
def test_entries_of_a_bearing_go_before_the_factors_of_its_kind(loaded):
    state = loaded.state
    force = state.bearing_force[0]
    own = solved(geared(load_friction=2e-3, lubricant_friction=0.0)).state
    assert bearing_torque(own, 0) == pytest.approx(2e-3 * math.hypot(force[0], force[1]) * 46e-3, rel=1e-6)
    assert bearing_torque(state, 0, 0.5) < bearing_torque(state, 0)
    assert math.isnan(bearing_torque(solved(geared(static_rating=None)).state, 0))


def test_without_oil_bearings_lose_by_their_load_alone(loaded, result):
    dry = geared(oil=None)
    point = loss_point(loaded.of(dry).state, dry.load_case)
    assert 0.0 < point.bearing_loss["A"] < result.points[0].bearing_loss["A"]
    none = geared(losses=LOSSES | {"bearings": False})
    alone = loss_point(loaded.of(none).state, none.load_case)
    assert alone.bearing_loss == {} and alone.flow.efficiency == pytest.approx(alone.friction["stage"].passed[0])


def test_seals_and_planets_lose_beside_bearings(loaded):
    sealed = geared(losses=LOSSES | {"seal": [{"shaft": "input", "diameter": "30 mm"}]})
    point = loss_point(loaded.of(sealed).state, sealed.load_case)
    assert point.seal_loss == pytest.approx({"seal 1 on input": 7.69e-6 * 30.0**2 * 1000.0})
    assert abs(point.flow.imbalance) < 1e-12
    wrong = geared(losses=LOSSES | {"seal": [{"shaft": "motor", "diameter": "30 mm"}]})
    with pytest.raises(CaseError, match="no such shaft"):
        check_loss_entries(wrong)


@pytest.mark.slow
def test_planets_of_a_set_lose_by_their_bearings():
    tables = set_on_shafts(slices=9) | {"losses": LOSSES, "lubricant": OIL}
    tables["planetary"][0]["teeth"]["planet"] |= {"bearing_pitch_diameter": "16 mm", "bearing_kind": "needle"}
    case = read_case(tables)
    state = solved(case).state
    point, contact = loss_point(state, case.load_case), state.contacts["set"]
    frequency = state.model.flow.mesh_frequency["set"]
    torque = planet_friction(
        contact.case,
        contact.result.planetary_set,
        contact.result.cycle,
        carrier_speed=state.model.flow.speed["output"],
        mesh_frequency=frequency,
        viscosity=oil_at(case) / case.lubricant.density,
    )
    sun = contact.result.planetary_set.gears[0].teeth
    assert point.bearing_loss["set planets"] == pytest.approx(torque * 2.0 * math.pi * abs(frequency) / sun)
    assert abs(point.flow.imbalance) < 1e-9


def test_key_figures_are_those_of_the_file(loaded, result):
    figures, data = gearbox_key_figures(loaded.case), result.contents()
    for name, variable in (("efficiency", "efficiency"), ("losses", "loss"), ("efficiency stage", "stage_efficiency")):
        figure = figure_of(figures, name)
        assert figure is not None and figure.stage == "losses"
        assert figure.read(data) == pytest.approx(float(np.asarray(data[variable].values).ravel()[0]))


def test_temperatures_are_those_of_the_teeth_of_every_stage(loaded):
    oil = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "80 degC", "fzg_stage": 10}
    case = geared(losses=LOSSES | {"roughness": "0.4 um"}, oil=oil)
    state = loaded.of(case)
    heat = solve_box_heat(case, state, solve_box_losses(case, state)).dataset()
    assert list(heat["mesh_kind"].values) == ["stage"] and heat["flash_temperature"].shape == (1, 1, 101)
    assert 80.0 < float(heat["bulk_temperature"].min()) < float(heat["highest_temperature"].max()) < 200.0
    assert float(heat["scuffing_safety"].min()) > 1.0


@pytest.mark.slow
def test_a_load_case_without_torque_has_zeros_in_place_of_its_stages():
    oil = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "80 degC"}
    tables = pair_tables(teeth=True) | {"losses": LOSSES | {"roughness": "0.4 um"}, "lubricant": oil}
    tables["deflection"] = {"slices": 3, "passes": 3}
    load_case = tables["operation"]["load_case"][0]
    idle = {"name": "idle", "torque": {"motor": "0 N m"}, "share": 0.5}
    tables["operation"]["load_case"] = [load_case | idle, load_case | {"share": 0.5}]
    state = solved(read_case(tables))
    losses = solve_box_losses(state.case, state)
    data = losses.dataset()
    assert data["mesh_loss"].values[0] == 0.0 and data["mesh_loss"].values[1] > 0.0
    heat = solve_box_heat(state.case, state, losses).dataset()
    assert heat["highest_temperature"].values[0] == pytest.approx(80.0) and not heat["path_load"].values[0].any()
    assert heat["highest_temperature"].values[1] > 80.0


def test_tables_of_losses_in_teeth_have_no_effect_and_that_is_said():
    tables = pair_tables(teeth=True)
    tables["pair"][0]["teeth"]["losses"] = LOSSES
    assert [finding.key for finding in idle_loss_entries(read_case(tables))] == ["pair[0].teeth.losses"]


@pytest.mark.slow
def test_a_planetary_stage_has_the_efficiency_of_its_closed_form():
    case = read_case(set_on_shafts(slices=7) | {"losses": LOSSES})
    loaded = solved(case)
    point = loss_point(loaded.state, case.load_case)
    (friction,) = point.friction.values()
    basic = friction.passed[0] * friction.passed[1]
    assert point.flow.efficiency == pytest.approx(planetary_efficiency(basic, 73 / 23), rel=1e-9)


def test_without_losses_of_given_meshes_no_efficiency_is_known_and_losses_of_bearings_stay():
    """A gearbox whose stage has a given mesh: its bearings A and C have friction, its teeth none that is known."""
    case = geared(LOSSES | {"torque_shares": [1.0], "speed_shares": [1.0]}, teeth=False)
    (finding,) = unknown_mesh_losses(case)
    assert (finding.code, finding.key) == ("W-LOSSES", "pair[0].teeth") and "stage" in finding.text
    assert not [*unknown_mesh_losses(geared())] and not [*unknown_mesh_losses(read_case(pair_tables()))]
    result = solve_box_losses(case, solved(case))
    data = result.dataset()
    assert all(np.isnan(data[name].values).all() for name in ("efficiency", "efficiency_map", "loss", "output_power"))
    assert float(data["bearing_loss"].sel(bearing="A")[0]) > 0.0 and data.sizes["mesh"] == 0
    block = describe_losses(data)
    assert block.rows[0][block.header.index("efficiency")] == "-"
    assert float(block.rows[0][block.header.index("bearings [W]")]) > 0.0
    assert any("teeth" in note for note in block.notes) and [*loss_tables(data)][-1].rows == (("1", "-"),)
    results = SimpleNamespace(stages=("losses",), losses=data)
    (judgement,) = judge_heat(results)
    assert judgement.state == "open" and "efficiency not known" in judgement.answer
    assert [row for _, row in efficiency_rows(results, Marks(()))] == [
        "not known: nothing tells what the meshes of stage lose"
    ]
