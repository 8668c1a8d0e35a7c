"""The shipped cases on bolts and in a casing: what they are beside the reference case, and that they are heard."""

from pathlib import Path

import numpy as np
import pytest

from femgear.run import solve
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[3] / "cases"
FEW = {
    "static.positions": 16,
    "static.flank_elements": 8,
    "static.stresses": False,
    "dynamics.up_to": "3 kHz",
    "operation.speeds": ["3100 rpm"],
    "runup.count": 0,
}


def test_they_are_the_reference_set_but_for_its_housing():
    own = ("title", "housing", "dynamics")
    reference = read_case(CASES / "planetary_27_40_108.toml").model_dump()
    for name in ("on_six_bolts", "in_a_casing"):
        case = read_case(CASES / f"{name}.toml").model_dump()
        assert {key: case[key] for key in case if key not in own} == {
            key: reference[key] for key in reference if key not in own
        }


@pytest.mark.parametrize(
    ("name", "heard", "forces"),
    [
        pytest.param("on_six_bolts", ["between two bolts", "above a bolt, along the rim"], 12, marks=pytest.mark.slow),
        ("in_a_casing", [f"sensor {i}" for i in range(1, 241)], 0),
    ],
)
def test_named_sensors_and_bolts_are_in_the_lines(name, heard, forces):
    data = solve(with_values(read_case(CASES / f"{name}.toml"), FEW))["housing"].dataset()
    assert set(heard) <= set(data["sensor"].values.tolist())
    assert data.sizes.get("force", 0) == forces
    for kind in ["sensor", "force"][: 2 if forces else 1]:
        assert (np.abs(data[f"{kind}_lines_real"]).max("order") > 0.0).all()
    assert float(data["one_way_level"][0]) > 0.0 and np.isfinite(data["turn_multiplier"].values).all()


@pytest.mark.slow
def test_factors_in_the_fixed_housing_are_those_of_its_run_up():
    few = FEW | {"operation.speeds": ["2900 rpm", "3100 rpm"], "runup.count": 2}
    few |= {"runup.from": "2900 rpm", "runup.to": "3100 rpm"}
    results = solve(with_values(read_case(CASES / "on_six_bolts.toml"), few))
    runup, housing = results["runup"].dataset(), results["housing"].dataset()
    assert housing["dynamic_factor"].dims == ("speed", "mesh_kind")
    at = [int(np.abs(runup["speed"].values - speed).argmin()) for speed in housing["speed"].values]
    assert housing["dynamic_factor"].values == pytest.approx(runup["dynamic_factor"].values[at], rel=1e-6)
    # the foundation alone has others
    force = results["dynamics"].dataset()
    assert "dynamic_factor" not in force
