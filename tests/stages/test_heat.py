"""Temperatures and oil film of pairs and sets by the loads of their teeth."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.stages.heat import load_over_path, solve_heat
from femgear.stages.losses import check_loss_entries, solve_losses
from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import stages_of, train_of
from validation.heat import whole_run

OIL = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "80 degC"}
COARSE = {"static.positions": 32, "static.flank_elements": 6, "static.stresses": False}
LOSSES = {"friction": "schlenk", "roughness": "0.4 um"}


def heated(name, oil=OIL, losses=LOSSES, **changes):
    case = with_values(read_case(f"cases/{name}.toml"), COARSE | {"losses": losses, "lubricant": oil} | changes)
    static = solve_static(case)
    return case, static, solve_heat(case, static, solve_losses(case, static))


@pytest.fixture(scope="module")
def pair():
    return heated("spur_pair", oil=OIL | {"fzg_stage": 12, "permissible_film": 0.3})


@pytest.mark.slow
def test_rows_of_a_test_gear_pass():
    assert {row.verdict for row in whole_run()} == {"passes", "information"}


def test_the_contact_is_coolest_at_the_pitch_point_and_hotter_than_the_teeth(pair):
    data = pair[2].dataset()
    place, flash = data["path_place"].values[0], data["flash_temperature"].values[0, 0]
    middle = np.abs(place).argmin()
    assert flash[middle] < 0.05 * flash.max() and flash.argmax() in (*range(15), *range(86, 101))
    assert 80.0 < data["bulk_temperature"].values.min() < float(data["highest_temperature"].min())
    assert data["specific_sliding"].values[0, :, middle] == pytest.approx([0.0, 0.0], abs=0.05)


def test_safeties_are_those_of_their_definitions(pair):
    data = pair[2].dataset()
    safety = (float(data["scuffing_temperature"]) - 80.0) / (float(data["highest_temperature"][0, 0]) - 80.0)
    assert float(data["scuffing_safety"][0, 0]) == pytest.approx(safety)
    assert float(data["film_safety"][0, 0]) == pytest.approx(float(data["smallest_film_ratio"][0, 0]) / 0.3)
    low = [finding.code for finding in pair[2].findings]
    assert ("W-HEAT" in low) == (min(safety, float(data["film_safety"][0, 0])) < 1.0)


def test_a_negative_torque_loads_the_mirror_image_alike(pair):
    _, static, _ = heated("spur_pair", **{"operation.torque": "-200 N m"})
    path = np.linspace(*static.planetary_set.kinds[0].path, 41)
    assert load_over_path(static, 0, path) == pytest.approx(load_over_path(pair[1], 0, path), rel=0.02)


def test_faster_teeth_have_a_thicker_film(pair):
    _, _, result = heated("spur_pair", **{"operation.speeds": ["1500 rpm", "6000 rpm"]})
    films = result.dataset()["smallest_film_ratio"].values[:, 0]
    assert films[0] == pytest.approx(pair[2].points[0][0].smallest_film) and films[1] > films[0]


def test_a_set_has_both_kinds_of_mesh_and_tables_of_its_file():
    case, _, result = heated("planetary_27_40_108", losses={"friction": "constant", "coefficient": 0.05}
                             | {"roughness": "0.4 um"})  # fmt: skip
    data = result.contents()
    assert list(data["mesh_kind"].values) == ["sun-planet", "planet-ring"]
    assert data["heat_friction"].values == pytest.approx(0.05)
    assert [stage.name for stage in stages_of(case) if stage.name in ("losses", "heat")] == ["losses", "heat"]


@pytest.mark.parametrize(
    "oil, losses, key",
    [
        ({"viscosity": "20 mm^2/s", "fzg_stage": 12}, LOSSES, "lubricant.temperature"),
        (OIL | {"fzg_stage": 12}, {"friction": "constant", "coefficient": 0.05}, "losses.roughness"),
        (
            {"viscosity": "20 mm^2/s", "temperature": "80 degC", "permissible_film": 0.3},
            LOSSES,
            "lubricant.viscosity_40",
        ),
    ],
)
def test_limits_without_what_they_are_compared_with_are_refused(oil, losses, key):
    case = with_values(read_case("cases/spur_pair.toml"), {"lubricant": oil, "losses": losses})
    with pytest.raises(CaseError) as refused:
        check_loss_entries(case)
    assert (refused.value.code, refused.value.key) == ("E-KEY-MISSING", key)


def test_without_a_temperature_of_the_oil_there_is_no_stage_and_a_reason():
    case = with_values(read_case("cases/spur_pair.toml"), {"lubricant": {"viscosity": "20 mm^2/s"}, "losses": LOSSES})
    assert "heat" not in [stage.name for stage in stages_of(case)]
    with pytest.raises(CaseError, match=r"lubricant\.temperature"):
        stages_of(case, "heat")


def test_check_has_the_specific_sliding_of_both_gears(pair):
    (block,) = (block for block in train_of(pair[0]).describe_case(pair[0]) if block.title == "Meshes")
    rows = {row[0]: row[1] for row in block.rows}
    sliding = pair[2].points[0][0].specific_sliding
    for gear, values in zip(("first", "second"), sliding, strict=True):
        assert rows[f"specific sliding, {gear} gear"] == f"{values[0]:.3f} to {values[-1]:.3f}"
