"""Losses of pairs and sets by the loads of their teeth."""

import numpy as np
import pytest

from femgear.case.dependencies import Steps, loss_entries, modal_entries, static_entries
from femgear.errors import CaseError
from femgear.gears.power_losses import planetary_efficiency
from femgear.run import run_case
from femgear.stages.losses import check_loss_entries, computed_loss_factor, solve_losses
from femgear.stages.static import solve_static
from femgear.storage.results import run_folder
from femgear.study.objectives import named_quantity
from femgear.trains.live import Answer
from femgear.trains.reading import open_results, read_case, with_values
from femgear.trains.registry import stages_of, train_of
from validation.losses import computed_case, computed_loads

pytestmark = pytest.mark.usefixtures("coarse_states")

COARSE = {"static.positions": 16, "static.flank_elements": 6, "static.stresses": False}
CONSTANT = {"losses": {"friction": "constant", "coefficient": 0.05}}


def solved(name, **changes):
    case = with_values(read_case(f"cases/{name}.toml"), COARSE | CONSTANT | changes)
    static = solve_static(case)
    return case, static, solve_losses(case, static)


@pytest.mark.slow
def test_rows_of_computed_loads_pass():
    assert {row.verdict for row in computed_loads()} == {"passes", "information"}


def test_a_set_has_the_efficiency_of_its_meshes_and_shares_losses_among_them():
    _, static, result = solved("planetary_27_40_108")
    data = result.dataset()
    factor = computed_loss_factor(static.cycle, static.planetary_set)
    basic = (1.0 - 0.05 * factor[0]) * (1.0 - 0.05 * factor[3])
    assert data["stage_efficiency"].values == pytest.approx(basic, rel=1e-12)
    assert data["efficiency"].values == pytest.approx(planetary_efficiency(basic, 4.0), rel=1e-12)
    assert data["mesh_loss"].sum("mesh").values == pytest.approx(data["loss"].values)
    assert np.abs(data["power_imbalance"].values).max() < 1e-12
    # 250 and 3100 rpm: with a constant coefficient losses go with the speed
    assert float(data["loss"][1] / data["loss"][0]) == pytest.approx(12.4, rel=1e-9)
    assert "bearings" in data.attrs["missing"]
    assert [finding.code for finding in result.findings] == ["W-LOSSES"]


def test_loss_factors_of_computed_loads_lie_near_those_of_equal_ones():
    result, factor = computed_case()
    assert factor == pytest.approx(float(result.dataset()["rigid_loss_factor"][0]), rel=0.05)


def test_a_set_whose_torque_turns_round_has_the_other_direction():
    _, _, result = solved("planetary_27_40_108", **{"operation.torque": "-100 N m", "operation.speeds": ["250 rpm"]})
    flow = result.points[0].flow
    assert flow.first_drives == {"set": False} and flow.torque["carrier"] > 0.0 > flow.torque["sun"]
    assert 0.98 < flow.efficiency < 1.0


def test_the_map_has_the_efficiency_of_operation_where_both_shares_are_one():
    losses = {"friction": "niemann", "roughness": "0.4 um", "torque_shares": [0.5, 1.0], "speed_shares": [0.5, 1.0]}
    data = solved("spur_pair", losses=losses, lubricant={"viscosity": "15 mm^2/s"})[2].dataset()
    values = data["efficiency_map"].values
    assert values[1, 1] == pytest.approx(float(data["efficiency"][-1]), rel=1e-12)
    assert values[1, 0] < values[1, 1] and values[1, 1] < values[0, 1]


def test_helical_teeth_in_slices_have_losses_of_their_slices():
    case = with_values(
        read_case("cases/spur_pair.toml"),
        COARSE | CONSTANT | {"set.helix_angle": "15 deg", "static.slices": 9, "gear_2.profile_shift": 0.1}
        | {"gear_1.tip_diameter": None, "gear_2.tip_diameter": None, "set.centre_distance": None},
    )  # fmt: skip
    static = solve_static(case)
    data = solve_losses(case, static).dataset()
    assert float(data["loss_factor"][0, 0]) == pytest.approx(float(data["rigid_loss_factor"][0]), rel=0.08)
    assert data.attrs["missing"] == ""


def test_bearings_of_planets_and_seals_lose_beside_the_teeth():
    """By hand: M_0 + M_1 of every planet at its speed against the carrier, 7.69e-6 d^2 n of a seal."""
    seals = [{"shaft": "sun", "diameter": "20 mm"}, {"shaft": "carrier", "diameter": "50 mm"}]
    oil = {"lubricant": {"viscosity": "20 mm^2/s"}, "losses": CONSTANT["losses"] | {"seal": seals}}
    bearing = {
        "planet.bearing_pitch_diameter": "27 mm",
        "planet.bearing_kind": "needle",
        "operation.speeds": ["3100 rpm"],
    }
    case, static, result = solved("planetary_27_40_108", **oil, **bearing)
    check_loss_entries(case)
    data = result.dataset()
    assert data["seal_loss"].values[0] == pytest.approx([7.69e-6 * 20**2 * 3100, 7.69e-6 * 50**2 * 620], rel=1e-12)
    turns = (3100.0 - 620.0) * 27 / 40
    held = 0.355 * 0.051 * (620.0 * np.pi / 30.0) ** 2  # inwards; mesh forces are tangential on the whole
    force = np.hypot(static.cycle.bearing_force[0, 0].mean() - held, static.cycle.bearing_force[0, 1].mean())
    moment = 1e-7 * 12.0 * (20.0 * turns) ** (2 / 3) * 27.0**3 + 1e-3 * force * 27.0
    loss = 3 * 1e-3 * moment * turns * np.pi / 30.0
    assert data["bearing_loss"].values[0] == pytest.approx([loss], rel=2e-3)
    whole = sum(float(data[f"{part}_loss"].sum()) for part in ("mesh", "bearing", "seal"))
    assert float(data["loss"][0]) == pytest.approx(whole, rel=1e-12)
    assert abs(float(data["power_imbalance"][0])) < 1e-12 and not result.findings
    assert data.attrs["contains"] == "teeth, bearings, seals"
    # without bearings, and with a seal on a shaft that stands still
    seals = [{"shaft": "ring", "diameter": "50 mm"}]
    changes = {"losses": CONSTANT["losses"] | {"bearings": False, "seal": seals}}
    alone = solve_losses(with_values(case, changes), static).dataset()
    assert float(alone["loss"][0]) == pytest.approx(float(alone["mesh_loss"].sum()))
    assert alone.attrs["contains"] == "teeth"


def test_seals_are_on_shafts_that_there_are():
    changes = {"losses": CONSTANT["losses"] | {"seal": [{"shaft": "gear_3", "diameter": "20 mm"}]}}
    with pytest.raises(CaseError, match="no such shaft") as refused:
        check_loss_entries(with_values(read_case("cases/spur_pair.toml"), changes))
    assert refused.value.key == "losses.seal[0].shaft" and "gear_1, gear_2" in str(refused.value.limit)


def test_sections_of_losses_decide_losses_alone():
    plain = read_case("cases/planetary_27_40_108.toml")
    case = with_values(plain, CONSTANT | {"lubricant": {"viscosity": "20 mm^2/s"}})
    assert static_entries(case) == static_entries(plain) and modal_entries(case) == modal_entries(plain)
    assert loss_entries(case) != loss_entries(plain)
    names = [stage.name for stage in stages_of(plain)], [stage.name for stage in stages_of(case)]
    assert "losses" not in names[0] and "losses" in names[1]
    with pytest.raises(CaseError, match="losses"):
        stages_of(plain, "losses")


def test_a_map_of_one_side_alone_is_refused():
    case = with_values(read_case("cases/spur_pair.toml"), {"losses": CONSTANT["losses"] | {"torque_shares": [1.0]}})
    with pytest.raises(CaseError) as refused:
        check_loss_entries(case)
    assert refused.value.key == "losses.speed_shares"


def test_a_run_has_its_file_table_and_row_of_the_verdict(tmp_path):
    case = with_values(read_case("cases/spur_pair.toml"), COARSE | CONSTANT)
    with run_folder(tmp_path / "run") as out:
        run_case(case, out, only="losses", pictures=False)
    results = open_results(tmp_path / "run")
    data = results.losses
    assert float(data["efficiency"][0]) == pytest.approx(0.9925, abs=1e-3)
    blocks = train_of(case).describe_results(results)
    rows = {name: text for block in blocks if block.title == "Verdict" for name, text in block.rows}
    assert rows["efficiency"].startswith(f"{100.0 * float(data['efficiency'][0]):.3f} %")


def test_studies_ask_for_efficiency_by_name():
    losses = CONSTANT["losses"] | {"roughness": "0.4 um"}
    oil = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "80 degC", "fzg_stage": 12}
    case = with_values(read_case("cases/planetary_27_40_108.toml"), COARSE | {"losses": losses, "lubricant": oil})
    answer = Answer(case, Steps())
    values = {name: named_quantity(name, case=case).compute(answer) for name in ("efficiency", "scuffing safety")}
    assert values["efficiency"] == min(point.flow.efficiency for point in answer["losses"].points)
    assert values["scuffing safety"] > 1.0
    assert named_quantity("losses", case=case).show(250.0) == "250 W"
