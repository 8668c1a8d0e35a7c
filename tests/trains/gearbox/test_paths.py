"""Transfer paths into the casing: what comes by each adds up to what the sensor hears."""

import numpy as np
import pytest
from casings import RPM, casing_tables, pair_in_a_casing
from small_gearbox import pair_tables, set_on_shafts

from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.paths import RIGID, casing_paths
from femgear.trains.gearbox.response import GearboxResponse, solve_gearbox_response
from femgear.trains.gearbox.response_results import GearboxResponseResult
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def by_path(found: Deflection) -> GearboxResponse:
    return solve_gearbox_response(found, [1000.0 * RPM], by_path=True)


def error(response: GearboxResponse) -> float:
    """Largest difference of the sum of the paths from what sensors hear, over the largest line."""
    worst = 0.0
    for stage in response.stages:
        heard = stage.motion[:, : stage.paths.shape[2]]
        worst = max(worst, np.abs(stage.paths.sum(axis=1) - heard).max() / np.abs(heard).max())
    return worst


def set_in_a_casing(**entries) -> Deflection:
    tables = set_on_shafts() | {"dynamics": {"up_to": "4 kHz"}} | entries
    tables["casing"] = {
        "mass": "8 kg",
        "inertia": ["0.05 kg m^2", "0.06 kg m^2", "0.08 kg m^2"],
        "centre": ["5 mm", "-4 mm", "3 mm"],
        "foot": [
            {"name": str(number), "position": [f"{x} mm", "-90 mm", f"{z} mm"], "stiffness": [f"{k} N/m"] * 3}
            for number, (x, z, k) in enumerate(((-80, -30, 1e8), (80, -30, 2e8), (-80, 40, 3e8), (80, 40, 1e8)))
        ],
    }
    tables["sensor"] = [{"name": "top", "position": ["10 mm", "80 mm", "0 mm"], "direction": "y"}]
    return solve_deflection(read_case(tables))


def test_paths_of_a_pair_add_up():
    response = by_path(pair_in_a_casing())
    assert response.paths == ("bearing A", "bearing B", "bearing C", "bearing D")
    assert error(response) < 1e-7
    shares = GearboxResponseResult(response, whole=True).dataset()["path_share"].values
    assert shares.sum(axis=1) == pytest.approx(np.ones((1, 3)), abs=1e-7)


@pytest.mark.slow
def test_the_ring_of_a_set_is_a_path_of_its_own():
    response = by_path(set_in_a_casing())
    assert "meshes of set" in response.paths
    assert error(response) < 1e-7
    ring = response.stages[0].paths[:, response.paths.index("meshes of set")]
    assert np.abs(ring).max() > 0.0


@pytest.mark.parametrize("teeth", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_rigid_bearings_are_one_path_with_the_rest(teeth):
    tables = pair_tables(teeth=teeth) | {"dynamics": {"up_to": "2 kHz"}}
    if not teeth:
        tables["pair"][0]["mesh"]["contact_ratio"] = 1.6
    tables |= {"casing": casing_tables(), "sensor": [{"name": "x", "position": ["0 mm"] * 3, "direction": "x"}]}
    tables["bearing"][0] |= {"radial": "rigid"}
    response = by_path(solve_deflection(read_case(tables)))
    assert response.paths[-1] == RIGID
    assert error(response) < 1e-7
    assert np.abs(response.stages[0].paths[:, -1]).max() > 0.0


def test_without_sensors_nothing_is_heard():
    assert casing_paths(solve_deflection(read_case(pair_tables()))) is None
