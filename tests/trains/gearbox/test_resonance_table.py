"""Resonances of a run-up in its file: speed, stage, harmonic, mode and level."""

import numpy as np
import pytest
from casings import RPM, pair_in_a_casing

from femgear.storage.contents import as_dataset
from femgear.trains.gearbox.resonance_table import describe_resonances, loudest_resonance
from femgear.trains.gearbox.response import accelerations, solve_gearbox_response
from femgear.trains.gearbox.response_results import GearboxResponseResult
from femgear.trains.gearbox.run_up_speeds import gearbox_resonances, run_up_speeds

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def solved():
    state = pair_in_a_casing()
    resonances = gearbox_resonances(state, 900.0 * RPM, 1200.0 * RPM)
    speeds, missed = run_up_speeds(np.linspace(900.0, 1200.0, 4) * RPM, resonances)
    found = solve_gearbox_response(state, speeds)
    result = GearboxResponseResult(found, whole=False, unresolved=missed, resonances=resonances)
    return found, resonances, as_dataset(result.contents())


def test_a_harmonic_of_a_stage_has_the_frequency_of_its_mode(solved):
    found, resonances, data = solved
    flow = found.deflection.model.flow
    turns = flow.mesh_frequency["stage"] / abs(flow.speed[found.reference])
    frequency = data["resonance_harmonic"] * turns * data["resonance_speed"] * RPM
    assert frequency.values == pytest.approx(data["resonance_frequency"].values, rel=1e-9)
    assert data.sizes["resonance"] == min(len(resonances.speed), 100)
    assert (np.diff(data["resonance_speed"]) >= 0.0).all()


def test_levels_are_those_of_the_lines_of_the_harmonic(solved):
    found, _, data = solved
    (stage,), moved = found.stages, accelerations(found, data.sizes["sensor"])
    for i in range(0, data.sizes["resonance"], 7):
        place = int(np.abs(found.speed / RPM - float(data["resonance_nearest"][i])).argmin())
        lines = moved[stage.name][place][:, stage.harmonic == int(data["resonance_harmonic"][i])]
        expected = np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=1))
        assert data["resonance_level"].values[i] == pytest.approx(expected, rel=1e-12)
    # harmonics together are all that is heard
    assert (data["resonance_level"].max("resonance") <= data["level"].max("speed") * (1.0 + 1e-9)).all()


def test_the_table_begins_with_the_loudest(solved):
    data = solved[2]
    (block,) = describe_resonances(data)
    loudest = data["resonance_level"].values.max(axis=1)
    assert float(block.rows[0][4]) == pytest.approx(loudest.max(), rel=1e-3)
    speed = loudest_resonance((), data)
    assert float(block.rows[0][0]) == pytest.approx(speed / RPM, rel=1e-4)
    assert np.isnan(loudest_resonance(("none",), data)) and loudest_resonance(("stage",), data) == speed
