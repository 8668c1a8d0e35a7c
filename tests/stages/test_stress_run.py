"""stress.nc of a run: written, read, drawn and reported as the library computes it."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from femgear.report.page import page, write_figures
from femgear.run import run_case
from femgear.stages.protocol import Drawn
from femgear.stages.static import solve_static, solve_stress
from femgear.storage.results import run_folder
from femgear.trains.elastic.stages import ELASTIC
from femgear.trains.reading import open_results, read_case, with_value
from femgear.trains.registry import stages_of

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).parents[2]
ONLY_LONG = {"tooth_root_maximum", "tooth_root_minimum"}
ONLY_SHORT = {f"pressure_{name}" for name in ("distribution", "offset", "centre", "path")}
ONLY_SHORT |= {"planet_root_stress"}
ONLY_SLICES = {"root_over_width", "root_face_factor", "iso_face_factor"}


def coarse(**changes):
    case = read_case(ROOT / "cases" / "planetary_27_40_108.toml")
    settings = {"dynamics.mesh_harmonics": 3, "static.positions": 8, "static.flank_elements": 8}
    for key, value in (settings | changes).items():
        case = with_value(case, key, value)
    return case


def run(folder, case, *, only=None):
    with run_folder(folder) as out:
        run_case(case, out, only=only, pictures=False)
    return open_results(folder)


@pytest.fixture(scope="module")
def case():
    return coarse()


@pytest.fixture(scope="module")
def results(tmp_path_factory, case):
    return run(tmp_path_factory.mktemp("stress") / "out", case)


@pytest.fixture(scope="module")
def library(case):
    static = solve_static(case)
    return static, solve_stress(case, static)


def test_a_run_has_the_stage_between_static_and_modes(results):
    assert results.stages == ("static", "stress", "modes", "runup", "dynamics", "housing")
    assert list(results.manifest.timings)[:3] == ["static", "stress", "modes"]
    assert results.manifest.convergence["stress"]["root_points"] > 100


def test_the_file_holds_what_the_library_computes(results, library):
    _, result = library
    stored, expected = results.stress, result.dataset()
    assert set(stored.variables) == set(expected.variables)
    for name, variable in expected.variables.items():
        assert stored[name].attrs["units"] and stored[name].attrs["long_name"], name
        if variable.dtype.kind == "f":
            scale = np.nanmax(np.abs(variable.values), initial=0.0)
            assert stored[name].values == pytest.approx(variable.values, abs=1e-9 * scale, nan_ok=True), name
    assert stored.attrs["sun_torque"] == 100.0 and stored.attrs["repeats"] == 1


def test_variables_belong_together(results, library):
    static, result = library
    stress = results.stress
    assert (stress["contact_pressure"].values == results.static["max_pressure"].values).all()
    # the record follows one tooth at equidistant positions, the largest may lie between
    shown = stress["root_tension"].max("step") / stress["root_worst"]
    assert 0.9 < shown.min() and shown.max() < 1.0 + 1e-9
    along = stress["root_profile"].sel(root="loaded").max("point")
    assert stress["root_worst"].values == pytest.approx(along.values)
    for root in result.roots:
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        place = np.abs(row["root_arc"].values - float(row["root_worst_arc"])) < 1e-12
        assert row["root_profile"].sel(root="loaded").values[place] == pytest.approx(float(row["root_worst"]))
        assert (row["root_slope"].values[place] == float(row["root_worst_slope"])).all()
        assert float(row["root_range_maximum"]) <= float(row["root_worst"]) * (1 + 1e-12)
    # the pressures of a pair carry its load: cells of equal width over the face width
    cell = np.diff(stress["pressure_offset"].values, axis=1)
    assert np.ptp(cell, axis=1).max() < 1e-9 * cell.max()
    force = stress["pressure_distribution"].sum(("pair", "cell")).values * cell[:, :1] * 0.025
    assert force == pytest.approx(static.cycle.force, rel=1e-6)
    # tip corners are sharp edges; elsewhere the distribution holds the largest pressure
    smooth = ~static.cycle.edge_contact
    largest = stress["pressure_distribution"].max(("pair", "cell")).values
    assert largest[smooth] == pytest.approx(static.cycle.max_pressure[smooth], rel=1e-9)
    assert stress["turn"].values[0] == -0.25 and stress.sizes["turn"] == 40 * 8


def test_stages_with_and_without_the_key(case):
    without, others = coarse(**{"static.stresses": False}), ("modes", "runup", "dynamics", "housing")
    assert case.static.stresses and not without.static.stresses

    def names(*given):
        return tuple(stage.name for stage in stages_of(*given))

    assert names(case, None) == ("static", "stress", *others) and names(case, "static") == ("static",)
    assert names(coarse(**{"static.stresses": True}), None) == ("static", "stress", *others)
    assert names(without, None) == ("static", *others) and names(without, "modes") == ("static", "modes")


def test_only_static_has_none(tmp_path):
    case = coarse(**{"set.planets": 1, "operation.torque": "0 N m"})
    assert run(tmp_path / "out", case, only="static").stages == ("static",)


@pytest.mark.slow
def test_only_stress_of_no_torque_is_a_valid_run(tmp_path, recwarn):
    """Asked for by name it is computed whatever the key says; without torque all is zero."""
    case = coarse(**{"operation.torque": "0 N m", "set.planets": 1, "static.stresses": False})
    assert not case.static.stresses
    results = run(tmp_path / "out", case, only="stress")
    assert results.stages == ("static", "stress") and "pressure_distribution" in results.stress
    assert not results.stress["root_worst"].values.any()
    blocks = {block.title: block for block in ELASTIC.describe_results(results)}
    assert len(blocks["Stresses"].rows) == 6
    names = write_figures(tmp_path, ELASTIC, Drawn(case, {"stress": results.stress}))
    assert len(names) == 6 and names[-1] == "charts.json"
    assert [str(w.message) for w in recwarn if issubclass(w.category, RuntimeWarning)] == []


def test_table_of_the_summary(results):
    block = next(block for block in ELASTIC.describe_results(results) if block.title == "Stresses")
    assert all(len(row) == len(block.header) for row in block.rows)
    assert [row[0].split()[0] for row in block.rows] == ["contact"] * 2 + ["root"] * 4
    for row, name in zip(block.rows[:2], ("sun-planet", "planet-ring"), strict=True):
        meshes = [m for m in results.stress["mesh"].values if ("ring" in m) == (name == "planet-ring")]
        largest = float(results.stress["largest_pressure"].sel(mesh=meshes).max()) * 1e-6
        assert float(row[1]) == pytest.approx(largest, abs=0.051)
    sun = block.rows[2]
    assert float(sun[1]) == pytest.approx(float(results.stress["root_worst"][:3, 0].max()) * 1e-6, abs=0.051)
    assert float(sun[3]) == pytest.approx(float(sun[1]) / float(sun[2]), abs=0.006)
    # a planet is bent both ways, and its teeth are loaded once a turn on each flank
    low, high = (float(x) for x in block.rows[3][7].split(" to "))
    assert low < -0.5 * high < 0 and [row[-1] for row in block.rows[2:]] == ["3", "1", "1", "3"]


@pytest.mark.slow
def test_report_has_the_section_with_its_figures(tmp_path, case, library, results):
    _, result = library
    figures = write_figures(tmp_path, ELASTIC, Drawn(case, {"stress": result.dataset()}))
    assert figures.pop() == "charts.json"
    assert set(figures) == {
        f"{name}.png" for name in ("root_stress", "root_profile", "contact_pressure", "load_spectrum", "planet_bending")
    }
    from femgear.report.page import caption_of

    assert {caption_of(ELASTIC, name.removesuffix(".png"))[1] for name in figures} == {"Stresses"}
    text = page(ELASTIC, results)
    assert '<details id="stress' in text and "FE/ISO" in text
    assert text.index('<details id="static') < text.index('<details id="stress') < text.index('<details id="modes')


def test_documentation_names_every_variable(results):
    section = (ROOT / "docs" / "results.md").read_text(encoding="utf-8").split("## stress.nc")[1]
    section = section.split("\n## ")[0]
    rows = re.findall(r"^\|([^|]*)\|([^|]*)\|([^|]*)\|", section, flags=re.MULTILINE)[2:]
    table = {name: (dims.strip(), unit.strip()) for cell, dims, unit in rows for name in re.findall(r"`(\w+)`", cell)}
    data = results.stress
    assert table.keys() == set(data.data_vars) | ONLY_LONG | ONLY_SLICES and ONLY_SHORT <= set(data.data_vars)
    for name, variable in data.data_vars.items():
        assert table[name] == (", ".join(variable.dims), variable.attrs["units"]), name
    assert set(data.attrs) - {"title", "findings", "femgear_format", "femgear_version"} <= set(
        re.findall(r"`(\w+)`", section)
    )
    assert set(data.coords) <= set(re.findall(r"`(\w+)`", section))


def test_plain_xarray_reads_the_file(results):
    with xr.open_dataset(results.folder / "stress.nc", engine="h5netcdf") as data:
        assert data["root_tension"].sel(mesh="sun-planet 1", gear="first").attrs["units"] == "Pa"
