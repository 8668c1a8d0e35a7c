"""Runs of gear pairs: stages, files, figures, report, and numbers against other ways to them."""

import numpy as np
import pytest
from page_examples import undocumented_keys
from published.multistage_example import CASES

from femgear import cli, open_results
from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.trains.impacts.case_file import pair_of, scales_of
from femgear.trains.impacts.stages import solve_sweep
from femgear.trains.reading import case_schema, read_case, to_toml, with_values
from femgear.trains.registry import stages_of

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

QUICK = {
    "response.from": 1.05,
    "response.to": 0.65,
    "response.harmonics": 6,
    "response.largest_step": 0.3,
    "sweep": {"ranges": [{"from": 0.6, "to": 1.0, "count": 4}], "steps": 60, "most_periods": 60},
    "chaos": {"from": 2.2, "to": 1.8, "count": 2, "points": 8, "skip": 30, "steps": 60, "sections": [2.2]},
}


@pytest.fixture(scope="module")
def case():
    return read_case(CASES / "gear_pair.toml")


@pytest.fixture(scope="module")
def results(case, tmp_path_factory):
    """A short branch through the limit points, a coarse sweep, two exponents."""
    folder = tmp_path_factory.mktemp("run")
    path = folder / "pair.toml"
    path.write_text(to_toml(with_values(case, QUICK)), encoding="utf-8")
    assert cli.main(["run", str(path), "-o", str(folder / "out")]) == 0
    return open_results(folder / "out")


def test_stages_and_figures_of_a_run(results):
    assert results.stages == ("response", "sweep", "chaos") and results.manifest.complete
    pictures = {name for name in results.manifest.files if name.endswith(".png")}
    names = ("amplitude_and_mean", "contact_states", "chaos", "sections")
    assert pictures == {f"{name}.png" for name in names}
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 4 and "Other pictures" not in page
    for words in ("settled motions of the sweeps", "once a tooth period", "two-sided impact"):
        assert words in page


def test_branch_passes_two_limit_points_and_its_points_solve_the_equations(results, case):
    data, pair = results.response, pair_of(case)
    folds = data["ratio"].values[data["fold"].values]
    assert sorted(folds) == pytest.approx([0.695, 0.743], abs=0.004) and data.attrs["complete"]
    lines = data["deflection_real"].values + 1j * data["deflection_imag"].values
    for point in (0, data.sizes["point"] // 2):
        found = solve_harmonic_balance(
            pair.problem(float(data["ratio"][point])),
            1.0,
            harmonics=6,
            samples=1024,
            start=lines[point][None],
            stability=False,
        )
        assert np.abs(found.deflection[0] - lines[point]).max() < 1e-6
    shares = data["drive_share"] + data["free_share"] + data["back_share"]
    assert shares.values == pytest.approx(1.0)
    low, high, states = data["lowest"].values, data["highest"].values, data["state"].values
    assert np.array_equal(states == "two-sided impact", (low < -1.0) & (high > 1.0))
    assert np.array_equal(states == "normal", low >= 1.0)


def test_speeds_and_units(results, case):
    data, scales = results.response, scales_of(case)
    hertz = data["speed"].values / 60.0 * 20
    np.testing.assert_allclose(hertz / data.attrs["natural_frequency"], data["ratio"].values)
    assert data.attrs["half_backlash"] == scales.length and data.attrs["unit_force"] == scales.force


def test_sweeps_are_on_the_branch_where_there_is_one_answer(results):
    branch, sweep = results.response, results.sweep
    assert sweep["direction"].values.tolist() == ["up", "down"]
    last = sweep.isel(ratio=-1)
    assert last["amplitude"].values == pytest.approx(float(last["amplitude"][0]), rel=1e-3)
    falling = branch.isel(point=slice(0, int(np.argmax(branch["ratio"].values < 0.9))))
    near = np.interp(1.0, falling["ratio"].values[::-1], falling["amplitude"].values[::-1])
    assert float(last["amplitude"][0]) == pytest.approx(near, rel=0.02)


def test_sections_that_repeat_are_points(results):
    data = results.chaos
    assert data["ratio"].values.tolist() == [2.2, 1.8] and data["section_ratio"].values.tolist() == [2.2]
    assert data["section_deflection"].values.std() < 0.05 and set(data["chaotic"].values) <= {
        "no",
        "not told",
    }


def test_case_page_names_every_key():
    assert undocumented_keys("impacts.md", case_schema("gear_pair")) <= {
        "gears",
        "mesh",
        "operation",
        "response",
    }


def test_stages_that_a_case_does_not_ask_for(case, tmp_path, capsys):
    assert [stage.name for stage in stages_of(case)] == ["response", "sweep"]
    with pytest.raises(CaseError, match="no section chaos"):
        stages_of(case, "chaos")
    path = CASES / "gear_pair.toml"
    assert cli.main(["run", str(path), "-o", str(tmp_path / "no"), "--only", "chaos"]) == 2
    assert "no section chaos" in capsys.readouterr().err and not (tmp_path / "no").exists()


def test_an_eccentric_gear_repeats_after_its_turn(case):
    """Far below resonance without play in reach: E (ratio / z)^2 moves the pair at the shaft frequency."""
    values = {
        "gears.teeth": [4, 5],
        "gears.eccentricity": ["300 um", "0 um"],
        "mesh.error": [],
        "mesh.stiffness_waves": [],
        "sweep": {"ranges": [{"from": 0.4, "to": 0.5, "count": 2}], "steps": 100, "most_periods": 60},
    }
    eccentric = with_values(case, values)
    assert [stage.name for stage in stages_of(eccentric)] == ["sweep"]
    found = solve_sweep(eccentric).up
    shaft = found.frequency / 4
    gain = shaft**2 / np.abs(1.0 - shaft**2 + 2j * 0.09 * shaft)
    assert found.settled.all() and found.amplitude[:, 0] == pytest.approx(10.0 * gain, rel=1e-3)


@pytest.mark.slow
def test_motions_that_do_not_repeat_have_neither_amplitude_nor_mean(case):
    """At a damping ratio of 0.09 the period doubles between the ratios 1.4 and 2.0."""
    ranges = [{"from": 1.2, "to": 2.4, "count": 5}]
    data = solve_sweep(with_values(case, {"sweep": {"ranges": ranges, "most_periods": 100}})).dataset()
    settled = data["settled"].values
    assert settled.any() and not settled.all()
    for name in ("amplitude", "mean"):
        assert np.array_equal(np.isfinite(data[name].values), settled)
    assert np.isfinite(data["lowest"].values).all()
