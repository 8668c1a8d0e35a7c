"""Runs of planetary stages in series: stages, files, figures, report, and numbers against other ways."""

import json

import numpy as np
import pytest
from page_examples import undocumented_keys
from published.multistage_example import CASES, four_stage_case

from femgear import cli, open_results
from femgear.errors import CaseError
from femgear.trains.multistage.case_file import multistage_of
from femgear.trains.multistage.model import multistage_system, train_speeds
from femgear.trains.reading import case_schema, read_case, to_toml, with_values
from femgear.trains.registry import stages_of


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The reducer at few speeds, two of them by harmonic balance too."""
    case = with_values(four_stage_case(), {"response.points": 18, "response.balance_points": 2})
    folder = tmp_path_factory.mktemp("run")
    path = folder / "reducer.toml"
    path.write_text(to_toml(case), encoding="utf-8")
    assert cli.main(["run", str(path), "-o", str(folder / "out")]) == 0
    return open_results(folder / "out")


def test_stages_and_figures_of_a_run(results):
    assert results.stages == ("modes", "response", "balance") and results.manifest.complete
    pictures = {name for name in results.manifest.files if name.endswith(".png")}
    assert pictures == {"stage_energy.png", "mesh_orders.png", "stage_forces.png"}
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 3 and "Other pictures" not in page
    for words in ("by the stage whose meshes excite", "ratio 538.597", '<h2 id="harmonic-balance">'):
        assert words in page


def test_modes_solve_the_eigenvalue_problem(results):
    modes = results.modes
    train_system = multistage_system(multistage_of(results.case))
    K = train_system.K + (train_system.W * modes["mesh_stiffness"].values) @ train_system.W.T
    shape, omega = modes["shape"].values, 2.0 * np.pi * modes["frequency"].values
    left, right = K @ shape, train_system.M @ shape * omega**2
    assert np.abs(left - right).max() < 1e-8 * np.abs(left).max()
    assert modes["energy"].sum("stage").values == pytest.approx(1.0)
    assert modes["dof"].values.tolist() == list(train_system.dofs)
    assert modes["kind"].values.tolist().count("planet") == 6


def test_forces_are_sums_of_their_lines(results):
    data = results.response
    force = np.hypot(data["mesh_force_real"], data["mesh_force_imag"])
    first = [f"stage {n} sun-planet 1" for n in range(1, 5)]
    rms = np.sqrt(0.5 * (force.sel(mesh=first) ** 2).sum("harmonic"))
    np.testing.assert_allclose(data["first_force"].values, rms.values, rtol=1e-12)
    total = np.sqrt((data["first_force"] ** 2).sum("excited_by"))
    np.testing.assert_allclose(data["total_force"].values, total.values, rtol=1e-12)
    mesh = train_speeds(multistage_of(results.case), 1.0).mesh_frequency
    speed = data["speed"].values * np.pi / 30.0
    np.testing.assert_allclose(data["mesh_frequency"].values, np.outer(mesh, speed), rtol=1e-12)


def test_harmonic_balance_is_near_the_modal_summation(results):
    """Transmission errors stand for k(t): within some per cent where nothing is resonant."""
    found = results.balance
    assert found["converged"].values.all() and found.sizes["line"] == len(np.unique(found["orders"], axis=0))
    near = results.response["total_force"].interp(speed=found["speed"])
    ratio = found["total_force"].values / near.values
    assert np.all((ratio > 0.5) & (ratio < 2.0))


def test_case_page_names_every_key():
    assert undocumented_keys("multistage.md", case_schema("multistage")) <= {"sun_planet", "planet_ring"}


def test_stages_of_cases_without_gears_or_operation(tmp_path, capsys):
    path = CASES / "published_four_stages.toml"
    assert [stage.name for stage in stages_of(read_case(path))] == ["modes"]
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out"), "--no-pictures"]) == 0
    assert open_results(tmp_path / "out").modes["frequency"].values[1] == pytest.approx(9426.9, abs=0.05)
    assert cli.main(["run", str(path), "-o", str(tmp_path / "no"), "--only", "response"]) == 2
    assert "operation and response" in capsys.readouterr().err and not (tmp_path / "no").exists()
    with pytest.raises(CaseError, match="balance_points is 0"):
        stages_of(four_stage_case(), "balance")
    assert cli.main(["schema", "--model", "multistage"]) == 0
    assert "StageSection" in json.loads(capsys.readouterr().out)["$defs"]
