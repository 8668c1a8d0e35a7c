"""Spectra of mesh forces: amplitudes, orders through run-ups, named lines, stages of a run."""

import math
from pathlib import Path

import numpy as np
import pytest
from two_wheels import INERTIAS, RADII, STIFFNESS

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.spectrum import (
    angle_spectrum,
    averaged_spectrum,
    line_amplitudes,
    mesh_lines,
    mesh_mode,
    resolved_lines,
    solve_box_spectrum,
    solve_box_transient,
)
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.gearbox.transient import gearbox_in_time
from femgear.trains.gearbox.transient_results import MeshLine
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import stages_of

CASES = Path(__file__).parents[3] / "cases"


def near(spectrum, frequency, width):
    """Largest amplitude within ``frequency +- width``."""
    return spectrum.amplitude[np.abs(spectrum.frequency - frequency) <= width].max()


def test_spectrum_shows_amplitudes():
    times = np.arange(0, 20, 1e-3)
    signal = 3.0 + 2.0 * np.sin(2 * np.pi * 50 * times) + 0.1 * np.sin(2 * np.pi * 120 * times)
    found = averaged_spectrum(signal, 1e-3, resolution=0.5)
    assert near(found, 50.0, 0.3) == pytest.approx(2.0, rel=1e-6)
    assert near(found, 120.0, 0.3) == pytest.approx(0.1, rel=1e-6)
    assert found.bandwidth == pytest.approx(0.5 * 1.5, rel=2e-3)
    assert found.segments == 19 and found.resolution == pytest.approx(0.5)


def test_order_tracking_through_a_run_up():
    times = np.arange(0.0, 10.0, 1e-3)
    angle = 2 * np.pi * (1.0 * times + 0.2 * times**2)
    signal = np.cos(7.0 * angle)
    tracked = angle_spectrum(signal, angle, resolution=0.25, per_turn=64)
    assert near(tracked, 7.0, 0.01) == pytest.approx(1.0, rel=1e-4)
    assert averaged_spectrum(signal, 1e-3, resolution=0.25).amplitude.max() < 0.5


def test_lines_of_a_run_up():
    """Amplitudes at their orders while the speed rises by half."""
    time = np.arange(0.0, 40.0, 1e-3)
    speed = 2.0 * np.pi * (1.0 + 0.0125 * time)
    angle = 2.0 * np.pi * (time + 0.00625 * time**2)
    signal = 5.0 + 2.0 * np.cos(30.0 * angle + 0.4) + 0.3 * np.sin(31.0 * angle)
    lines = [MeshLine(str(order), (order,), float(order)) for order in (30, 31, 35, 900)]
    found = line_amplitudes(signal[:, None], angle, speed, lines, record_rate=1e3)[:, 0]
    assert found[:2] == pytest.approx([2.0, 0.3], rel=1e-4)
    assert found[2] < 1e-3 and np.isnan(found[3])


def test_named_lines_of_the_wind_turbine_follow_its_teeth():
    case = read_case(CASES / "wind_turbine_drivetrain.toml")
    model = gearbox_in_time(solve_deflection(case), case.transient)
    lines = {line.name: line for line in mesh_lines(model)}
    hertz = {name: 0.1 * line.order for name, line in lines.items()}
    sun = 1.0 + 184.0 / 47.0
    assert hertz["carrier-sun mesh"] == pytest.approx(18.4)
    assert hertz["carrier-sun mesh - 1 turn"] == pytest.approx(18.3)
    assert hertz["gear 1-gear 2 mesh"] == pytest.approx(12.8 * sun)
    assert hertz["gear 2-gear 3 mesh"] == pytest.approx(8.6 * sun * 128.0 / 42.0)
    assert lines["carrier-sun carrier turn"].order == pytest.approx(1.0)
    for line in lines.values():
        assert line.order == pytest.approx(abs(np.dot(line.orders, model.base_ratio)))
    # 7 f_p stands 0.2 orders beside f_23
    parted = dict(zip(lines, resolved_lines(model, list(lines.values()), 0.5), strict=True))
    assert not parted["gear 2-gear 3 mesh"] and parted["gear 1-gear 2 mesh"]


def test_lines_against_harmonic_balance():
    """Integration, low pass, projection: the mesh harmonics that harmonic balance finds."""
    entries = {"rate": "100 kHz", "settle": "1.0 s", "duration": "1.2 s", "record": "5 kHz"}
    torques = [{"load": "motor", "torque": "120 N m"}, {"load": "fan", "share": 1.0}]
    case = with_values(read_case(CASES / "own_chain.toml"), {"transient": entries | {"torque": torques}})
    found = solve_box_spectrum(case, solve_box_transient(case, solve_deflections(case)))
    model = found.transient.first.model
    settled = solve_harmonic_balance(model.box.problem, model.box.frequency, harmonics=45, stability=False)
    mean = model.torques[0].values[0] / case.load_case.torque["motor"]
    assert settled.converged
    assert found.amplitudes["all motions"][:, 0] == pytest.approx(mean * np.abs(settled.force[0, 1:4]), rel=8e-3)


def test_the_mode_that_the_mesh_drives():
    """The elastic coordinate of two wheels on held axes."""
    tables = {
        "model": "gearbox",
        "title": "two wheels",
        "motions": "rotation",
        "shaft": [{"name": "a"}, {"name": "b", "axis": [f"{sum(RADII) / math.cos(math.radians(20.0))!r} m", "0 mm"]}],
        "mass": [
            {"shaft": name, "mass": "10 kg", "inertia": f"{inertia} kg m^2"}
            for name, inertia in zip("ab", INERTIAS, strict=True)
        ],
        "pair": [
            {
                "name": "a-b",
                "shafts": ["a", "b"],
                "gears": {"teeth": [20, 40], "base_radii": [f"{radius} m" for radius in RADII]},
                "mesh": {"stiffness": f"{STIFFNESS} N/m"},
            }
        ],
        "operation": {"output": ["b"], "load_case": [{"torque": {"a": "10 N m"}, "speed": {"a": "10 rpm"}}]},
        "transient": {"duration": "1 s"},
    }
    case = read_case(tables)
    model = gearbox_in_time(solve_deflection(case), case.transient)
    hertz = math.sqrt(STIFFNESS * np.sum(np.square(RADII) / INERTIAS)) / (2.0 * math.pi)
    assert mesh_mode(model, 1.01 * hertz) == pytest.approx(hertz, rel=1e-9)
    assert mesh_mode(model, 0.99 * hertz) == 0.0


def test_stages_of_a_run_and_those_before_the_spectrum():
    case = read_case(CASES / "own_chain.toml")
    names = [stage.name for stage in stages_of(case)]
    assert names == ["deflection", "modes", "dynamics", "transient", "spectrum"]
    assert [stage.name for stage in stages_of(case, "spectrum")] == ["deflection", "transient", "spectrum"]
    with pytest.raises(CaseError, match="no \\[transient\\]"):
        stages_of(with_values(case, {"transient": None}), "transient")
