"""Elastic rings in a gearbox: modes and response of the reference set on its foundation, and in a casing that moves."""

from dataclasses import replace

import numpy as np
import pytest
from gearbox_equivalents import elastic_set_tables

from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.housing.two_way.running_planets import ring_lines, solve_running
from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.trains.elastic.outputs import mesh_and_ring_outputs
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.elastic_ring import elastic_ring, with_rings
from femgear.trains.gearbox.modes import linear_system, solve_gearbox_modes
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.gearbox.response_results import GearboxResponseResult
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

FEW = {"static.positions": 16, "static.flank_elements": 8, "static.stresses": False, "dynamics.up_to": "4 kHz"}


@pytest.fixture(scope="module")
def both():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    teeth = tables["planetary"][0]["teeth"]
    for key, value in FEW.items():
        section, entry = key.split(".")
        teeth.setdefault(section, {})[entry] = value
    case = read_case(tables | {"modes": {"up_to": "200 kHz"}})
    reference = solve(with_values(read_case("cases/planetary_27_40_108.toml"), FEW), only="modes")["modes"]
    return reference, solve_gearbox_modes(solve_deflection(case))


def test_modes_are_those_of_the_set_on_its_foundation(both):
    reference, found = both
    expected = np.sort(reference.modes.frequency)
    ours = np.sort(found.modes.frequency)[: len(expected)]
    assert found.motion.shape[1] >= len(expected)
    # rounding: a part in 1e15 of the square of the highest natural frequency
    rounding = 1e-15 * found.modes.frequency.max() ** 2 / np.maximum(expected, 1.0) ** 2
    elastic = expected > 1.0
    assert rounding[expected > 1e3].max() < 1e-9
    assert (np.abs(ours / np.where(elastic, expected, 1.0) - 1.0)[elastic] < np.maximum(1e-9, rounding[elastic])).all()


def test_the_ring_has_its_share_of_the_energies(both):
    _, found = both
    assert "ring of set" in found.members and "ring of set" in found.parts
    elastic = found.modes.frequency > 0.0
    assert found.kinetic.sum(axis=0) == pytest.approx(np.ones(len(elastic)), rel=1e-9)
    assert found.strain.sum(axis=0)[elastic] == pytest.approx(np.ones(elastic.sum()), rel=1e-6)
    assert "ring" in found.modes.kind


SENSORS = [
    {"name": "top", "ring": "set", "angle": "90 deg"},
    {"name": "beside", "ring": "set", "angle": "20 deg", "direction": [-0.34202014332566871, 0.93969262078590843, 0.0]},
]
CASING = {
    "mass": "30 kg",
    "centre": ["10 mm", "-20 mm", "0 mm"],
    "inertia": ["0.5 kg m^2", "0.5 kg m^2", "0.6 kg m^2"],
    "foot": [
        {"position": ["-150 mm", "-120 mm", "0 mm"], "stiffness": ["2e7 N/m", "5e7 N/m", "3e7 N/m"]},
        {"position": ["150 mm", "-120 mm", "0 mm"], "stiffness": ["2e7 N/m", "9e7 N/m", "3e7 N/m"]},
    ],
}


def without_loss(stage):
    none = replace(stage, loss=0.0 * stage.loss, structure_loss=0.0, gyroscopic=0.0 * stage.gyroscopic)
    return replace(none, ring=replace(stage.ring, loss=0.0))


def of_few_elements(more):
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    for key, value in FEW.items():
        section, entry = key.split(".")
        tables["planetary"][0]["teeth"].setdefault(section, {})[entry] = value
    return solve_deflection(read_case(tables | more))


@pytest.mark.slow
def test_the_response_is_that_of_the_set_on_its_foundation():
    """At a carrier that stands still: the set leaves out the terms of the turning frame."""
    reference = solve(with_values(read_case("cases/planetary_27_40_108.toml"), FEW), only="modes")["modes"]
    found = of_few_elements({"sensor": SENSORS})
    stage = found.model.stages[0]
    ring = elastic_ring(found.model, stage)
    running = without_loss(running_stage(found, stage, ring.excitation, [ring]).running)
    modes = undamped_modes(reference.model.system, reference.excitation.stiffness.mean(axis=1), damping_ratio=0.0)
    whole = replace(reference, modes=modes)
    theta, n = np.array([sensor.angle for sensor in gearbox_sensors(found.model.case)]), np.arange(-26, 27)
    directions = np.array([sensor.on_ring for sensor in gearbox_sensors(found.model.case)])
    assert np.abs(directions - np.eye(2)).max() < 1e-12
    for hertz in (300.0, 1500.0, 2300.0):
        known = {"excitation_harmonics": 8, "response_harmonics": 12, "method": "direct"}
        wanted = solve_spectral(modes, reference.excitation, np.array([hertz]), **known)
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(8, 12), side_bands=0, tolerance=1e-13)
        forces = wanted.force[0][[0, len(stage.planets)], 1:]
        assert np.abs(2.0 * response.force[0, :2, 1:, 0] - forces).max() < 1e-8 * np.abs(forces).max()
        heard = ring_lines(running, response, theta, directions).sum(axis=1)[1:]
        fields = (mesh_and_ring_outputs(whole, wanted, output)[1][0, 1:] for output in (0, 1))
        expected = np.stack([field @ np.exp(1j * n * at) for field, at in zip(fields, theta, strict=True)], axis=1)
        assert np.abs(heard - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.fixture(scope="module")
def in_casing():
    found = of_few_elements({"sensor": SENSORS, "casing": CASING, "deflection": {"contact": True}})
    return found, elastic_ring(found.model, found.model.stages[0])


@pytest.mark.slow
def test_a_ring_in_a_casing_vibrates_as_all_coordinates_of_both(in_casing):
    """Planets that run around at speed zero, and the assembled gearbox with all coordinates of the ring."""
    found, ring = in_casing
    stage = found.model.stages[0]
    structured = running_stage(found, stage, ring.excitation, [ring])
    running = without_loss(structured.running)
    assembly, system, stiffness = linear_system(found)
    system, _ = with_rings(system, stiffness, assembly, dict(enumerate(assembly.slices)), [ring])
    drive = ring.excitation
    about = {name: getattr(drive, name) for name in ("deflection", "force")}
    about = {name: signal - signal.mean(axis=1, keepdims=True) for name, signal in about.items()}
    mean = drive.stiffness.mean(axis=1)
    modes = undamped_modes(replace(system, gyroscopic=None), mean, damping_ratio=0.0)
    sensors, count = gearbox_sensors(found.model.case), assembly.motions.shape[1]
    rows = sensor_rows(found.model) @ assembly.motions @ modes.shape[:count]
    rows += ring.sensor_rows(sensors) @ modes.shape[count:]
    places = np.array([sensor.angle for sensor in sensors]), np.array([sensor.on_ring for sensor in sensors])
    outputs = structured.at_sensors(sensor_rows(found.model), sensors)
    for hertz in (300.0, 700.0, 1700.0):
        known = {"excitation_harmonics": 6, "response_harmonics": 9, "method": "direct"}
        modal = solve_spectral(modes, replace(drive, **about), hertz, **known).modal[0]
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 9), side_bands=14, tolerance=1e-13)
        heard = (response.lines(outputs.T) + ring_lines(running, response, *places)).sum(axis=1)
        expected = (rows @ modal).T
        assert np.abs(heard - expected)[1:].max() < 1e-8 * np.abs(expected[1:]).max()


def test_the_mass_of_a_ring_pushes_its_modes_where_its_seat_is_accelerated(in_casing):
    _, ring = in_casing
    mass, inertia = (ring.participation[:, :2] ** 2).sum(axis=0), (ring.participation[:, 2] ** 2).sum()
    # a steel ring of 27/40/108, m 1.5: from the tips of its teeth to its outer surface
    assert mass == pytest.approx([2.1134912] * 2, rel=1e-6)
    assert 0.0078 < inertia / mass[0] < 0.01
    assert ring.moves and set(ring.with_structure.diameter) == {0, 1}


@pytest.mark.slow
def test_shares_of_paths_add_up_on_the_casing_and_none_are_given_on_the_ring():
    on_casing = {"name": "foot", "position": ["150 mm", "-120 mm", "0 mm"], "direction": "y"}
    tables = {"sensor": [on_casing, *SENSORS], "casing": CASING, "deflection": {"contact": True}}
    tables["dynamics"] = {"up_to": "4 kHz"}
    loaded = of_few_elements(tables)
    response = solve_gearbox_response(loaded, [60.0], by_path=True)
    data = GearboxResponseResult(response, whole=True).contents().variables
    share = data["path_share"].values[0]
    assert share[:, 0].sum() == pytest.approx(1.0, abs=1e-9)
    assert np.isnan(share[:, 1:]).all()
    assert (data["level"].values > 0.0).all()


def test_the_set_of_a_ring_is_solved_once(in_casing, monkeypatch):
    found, ring = in_casing
    steps = Steps()
    first = elastic_ring(found.model, found.model.stages[0], steps=steps)
    monkeypatch.setattr("femgear.trains.gearbox.elastic_ring.train_of", None)
    again = elastic_ring(found.model, found.model.stages[0], steps=steps)
    assert np.array_equal(again.excitation.stiffness, first.excitation.stiffness)
    assert np.array_equal(again.approach, ring.approach)


def test_a_ring_without_a_grid_is_refused():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    tables["shaft"].append({"name": "ring"})
    tables["planetary"][0]["ring"] = "ring"
    with pytest.raises(CaseError, match="elastic_ring"):
        read_case(tables)
