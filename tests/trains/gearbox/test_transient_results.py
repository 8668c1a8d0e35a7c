"""transient.nc and spectrum.nc: names, what rows and files say, findings; runs of shipped cases."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.run import report_again, run_case
from femgear.storage.results import run_folder
from femgear.trains.gearbox.spectrum import solve_box_transient
from femgear.trains.gearbox.stages import GEARBOX, solve_deflections
from femgear.trains.gearbox.transient_results import chosen_meshes, describe_transient, symbols
from femgear.trains.reading import open_results, read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states", "pictures_undrawn")

CASES = Path(__file__).parents[3] / "cases"
SHORT = {"transient.settle": "0.05 s", "transient.duration": "0.2 s", "transient.rate": "20 kHz"}


@pytest.fixture(scope="module")
def own():
    return with_values(read_case(CASES / "own_chain.toml"), SHORT)


@pytest.fixture(scope="module")
def results(tmp_path_factory, own):
    folder = tmp_path_factory.mktemp("in time") / "out"
    with run_folder(folder) as out:
        run_case(own, out)
    return open_results(folder)


@pytest.mark.parametrize(
    "name", [pytest.param("wind_turbine_drivetrain", marks=pytest.mark.slow), "grc_like_drivetrain"]
)
def test_shipped_cases_run(name, tmp_path):
    entries = {"settle": "0.02 s", "duration": "0.12 s", "rate": "10 kHz", "record": "2 kHz"}
    case = read_case(CASES / f"{name}.toml")
    case = with_values(case, {f"transient.{key}": value for key, value in entries.items()})
    with run_folder(tmp_path / "out") as folder:
        run_case(case, folder, pictures=False)
    data = open_results(tmp_path / "out")
    assert data.stages == ("deflection", "modes", "dynamics", "transient", "spectrum")
    assert np.isfinite(data.transient["mesh_force"].values).all() and data.transient.sizes["time"] == 241
    assert float(data.transient["energy_error"].max()) < 1e-9
    variants = ["all motions", "torsional"] if name.startswith("wind") else ["all motions"]
    assert list(data.spectrum["variant"].values) == variants
    assert [str(data.spectrum["mesh"].values[i]) for i in chosen_meshes(data.spectrum)][-1].endswith("planet 1-ring")
    assert len(chosen_meshes(data.spectrum)) == 4
    assert symbols(data.spectrum) == ["f1", "f2", "t", "f3"]


def test_files_figures_and_report(results, own):
    names = set(results.manifest.files)
    figures = {"campbell", "transient_speeds", "transient_deviations", "transient_forces", "mesh_force_spectrum"}
    assert names >= {f"{name}.png" for name in figures}
    assert results.manifest.complete and results.manifest.convergence["transient"]["energy"] < 1e-9
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    for text in ("Motion in time", "Spectrum", "pinion-wheel", "Other pictures"):
        assert (text in page) == (text != "Other pictures")
    (results.folder / "report.html").unlink()
    report_again(results.folder)
    assert (results.folder / "report.html").read_text(encoding="utf-8") == page
    # the case of the results needs no other file
    assert read_case(results.folder / "case.toml") == own


def test_speeds_forces_and_angles(results, own):
    data = results.transient
    time, ratio = data["time"].values, data["ratio"].values
    angle = data["spin"].values[0][:, None] * ratio + data["deviation"].values[0]
    moved = np.trapezoid(data["speed"].values[0], time, axis=0)
    assert np.abs(angle[-1] - angle[0] - moved).max() < 1e-4 * np.abs(moved).min()
    # 60 N m on a base circle of 34.5 mm cos 20 deg
    force = data["mesh_force"].values[0, :, 0]
    assert force.mean() == pytest.approx(60.0 / (34.5e-3 * math.cos(math.radians(20.0))), rel=0.02)
    case = with_values(own, {"transient.record": "20 kHz"})
    full = solve_box_transient(case, solve_deflections(case)).first.run.force[:, 0]
    extremes = (float(data["least_force"][0, 0]), float(data["largest_force"][0, 0]))
    assert extremes == pytest.approx((full.min(), full.max())) and extremes[0] < force.min()
    settled = full[round(float(data.attrs["settle"]) / data.attrs["step"]) :].min()
    assert float(data["settled_force"][0, 0]) == pytest.approx(settled) and settled > extremes[0]
    assert float(data["pulling"][0, 0]) == pytest.approx(np.mean(full < 0.0), abs=1e-3)
    assert data.attrs["every"] == 4 and data.attrs["steps"] == 4000
    torque, loads = data["torque"].values, data["load"].values.tolist()
    on_loads = ratio[[data["shaft"].values.tolist().index(load) for load in loads]]
    assert np.abs(torque @ on_loads).max() < 1e-9


def test_tables_show_extremes_of_steps_and_of_records(results):
    """Records are low-passed: both are said, and with what damping they were found."""
    data = results.transient
    block = describe_transient(data)
    row = dict(zip(block.header, block.rows[0], strict=True))
    force = data["mesh_force"].values[0, :, 0]
    for text, value in (
        ("least [kN]", data["least_force"][0, 0]),
        ("largest [kN]", data["largest_force"][0, 0]),
        ("least recorded [kN]", force.min()),
        ("largest recorded [kN]", force.max()),
    ):
        assert row[text] == f"{1e-3 * float(value):.4f}"
    assert row["least [kN]"] != row["least recorded [kN]"]
    assert "damping 3 % of critical in all modes" in block.notes


def test_coarse_steps_are_found_in_the_results(results):
    # the mode of the mesh near 1425 Hz at 20 kHz
    codes = [one.code for one in GEARBOX.stage("transient").findings(results.transient)]
    assert "W-RATE" in codes and float(results.transient.attrs["mesh_mode"]) == pytest.approx(1425.0, abs=25.0)
