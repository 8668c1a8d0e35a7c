"""Runs of planar cases: stages, files, figures, report, and numbers against other ways to them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from published.wind_turbine import bearing_problem_a, gravity_problem_b
from published.wind_turbine_response import member_rms, weight_branch

from femgear import cli
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, ConvergenceError
from femgear.run import run_case
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.solution import open_verdict
from femgear.solvers.stability.floquet import floquet_verdicts
from femgear.solvers.time.transient import solve_transient
from femgear.stages.static import solve_static
from femgear.storage.results import run_folder
from femgear.system.mesh_directions import gear_set_system
from femgear.system.rigid_bodies import PlanarTorque
from femgear.trains.planar.figures import (
    branch_figures,
    contact_over_branch,
    response_mesh_forces,
)
from femgear.trains.planar.model import (
    TAIL_LIMIT,
    judged_branch,
    merged_folds,
    motion_lines,
    planar_model,
    shown_points,
)
from femgear.trains.planar.results import branch_warnings, doubts, tail_warnings
from femgear.trains.planar.stages import PLANAR, solve_branch, solve_planar_modes, solve_planar_response
from femgear.trains.reading import open_results, read_case, to_toml, with_value
from femgear.trains.registry import stages_of as stages_of_case

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

ROOT = Path(__file__).parents[3]
FIGURES = ("weight_response", "carrier_orbit", "planet_bearing_forces", "tooth_contact", "wedged_teeth")


def stages_of(case, only=None):
    return tuple(stage.name for stage in stages_of_case(case, only))


def changed(case, **changes):
    for key, value in changes.items():
        case = with_value(case, key.replace("__", "."), value)
    return case


@pytest.fixture(scope="module")
def pgb():
    case = read_case(ROOT / "cases" / "nrel_pgb.toml")
    return changed(case, planar__branch={"from": "36 Hz", "to": "37.2 Hz", "harmonics": 3})


@pytest.fixture(scope="module")
def coarse():
    case = read_case(ROOT / "cases" / "nrel_pgb_static.toml")
    return changed(case, static__positions=12, static__flank_elements=8, planar__branch=None)


@pytest.fixture(scope="module")
def static(coarse):
    return solve_static(coarse)


@pytest.fixture(scope="module")
def results(tmp_path_factory, pgb):
    folder = tmp_path_factory.mktemp("planar") / "out"
    with run_folder(folder) as out:
        run_case(pgb, out)
    return open_results(folder)


def test_a_run_computes_modes_branch_and_response(results):
    assert results.stages == ("modes", "branch", "response")
    assert results.manifest.complete and results.manifest.convergence["branch"]["converged"]
    assert results["modes"].equals(results.modes)


def test_natural_frequencies_of_set_b(results):
    data = results.modes
    kinds = [str(kind) for kind in data["kind"].values[:6]]
    assert kinds == ["translational"] * 2 + ["rotational"] + ["translational"] * 2 + ["rotational"]
    computed = [40.761, 40.761, 69.563, 156.869, 156.869, 302.710]
    np.testing.assert_allclose(data["frequency"].values[:6], computed, rtol=1e-5)
    damping = [0.0548, 0.0548, 0.0526, 0.0743, 0.0743, 0.0519, 0.0519]
    np.testing.assert_allclose(data["damping_ratio"].values[:7], damping)


def test_shapes_are_those_of_the_model_in_x_y_and_rotation(results, pgb):
    found = solve_planar_modes(pgb)
    shape, model = results.modes["shape"].values, found.modes.shape
    names = [str(name) for name in results.modes["dof"].values]
    radial, psi = found.modes.dofs.index("planet 2: radial"), 2 * np.pi / 3
    x, y = shape[names.index("planet 2: x")], shape[names.index("planet 2: y")]
    np.testing.assert_allclose(x * np.cos(psi) + y * np.sin(psi), model[radial], atol=1e-12)
    turn = shape[names.index("carrier: rotation")] * found.data.centre_distance
    np.testing.assert_allclose(turn, model[found.modes.dofs.index("carrier: u")], atol=1e-12)


def test_the_branch_is_that_of_the_script(results):
    data = results.branch
    problem = gravity_problem_b()
    other = weight_branch(problem, (36.0, 37.2), harmonics=3)
    rms = member_rms(problem, other.solutions, "carrier")[:, 0]
    hertz = data["weight_frequency"].values
    ours = data["rms"].sel(member="carrier", axis="x").values
    # between the points of the other curve
    near = np.interp(hertz, other.parameter / (2 * np.pi), rms)
    np.testing.assert_allclose(ours, near, rtol=2e-3)
    np.testing.assert_allclose(data["carrier_speed"].values, 2 * np.pi * hertz)
    assert data["back_contact"].values[0].max() == 0.0 < data["back_contact"].values[-1].max()
    assert np.all(data["drive_contact"].values == 1.0) and np.all(data["spectral_radius"].values >= 0.0)


def test_mean_forces_balance_the_torque(results, pgb):
    data, gears = results.branch, planetary_set(pgb)
    tangential = data["planet_bearing_force_real"].sel(direction="tangential", harmonic=0).values
    # the carrier is driven: its pins push the planets forwards
    np.testing.assert_allclose(tangential.sum(axis=1), 180e3 / gears.centre_distance, rtol=1e-6)
    sun = data["mesh_force_real"].sel(harmonic=0).values[0, :3].sum() * gears.sun.base_radius
    # smoothing lets the open back flanks carry s^2 k / 4 b, 0.2 N
    assert sun == pytest.approx(180e3 / (1 + 68 / 16), rel=1e-5)
    np.testing.assert_array_equal(data["carrier_bearing_force_real"].values, 0.0)


@pytest.mark.slow
def test_verdicts_agree_with_fine_ones(pgb):
    found = solve_branch(pgb).branch
    chosen = found.solutions[:: max(len(found.solutions) // 3, 1)]
    fine = floquet_verdicts(gravity_problem_b(), chosen, tolerance=1e-7)
    for one, sure in zip(chosen, fine):
        assert one.verdict.stable == sure.stable
        assert abs(one.verdict.multipliers[0]) == pytest.approx(abs(sure.multipliers[0]), rel=1e-2)
    assert len({one.verdict.stable for one in found.solutions}) == 2
    seen = []
    judged_branch(
        gravity_problem_b(), replace(found, solutions=found.solutions[:3]), progress=lambda *n: seen.append(n)
    )
    assert seen == [(3, 3)]


def test_verdicts_near_the_unit_circle_are_judged_again(pgb, monkeypatch):
    """Within 1e-3 and 100 times the error of the coarse one, inside as outside, and where there is none."""
    coarse = [
        (1.0009, 0.0),
        (0.9991, 0.0),
        (1.0011, 0.0),
        (0.9989, 0.0),
        (1.05, 6e-4),
        (1.05, 4e-4),
        (-0.95, 6e-4),
        (-0.95, 4e-4),
        (2.0, 1e-6),
    ]
    close = [0, 1, 4, 6, 9]
    tolerances = []

    def judged(_, solutions, *, tolerance):
        tolerances.append((len(solutions), tolerance))
        if tolerance < 1e-4:
            return [replace(known, error=-1.0)] * len(solutions)
        made = [replace(known, multipliers=np.array([mu, 0.1]), error=error) for mu, error in coarse]
        return [*made, open_verdict("too many steps")]

    found = solve_branch(changed(pgb, planar__branch__stability=False)).branch
    problem = gravity_problem_b()
    known = next(iter(floquet_verdicts(problem, found.solutions[:1], tolerance=1e-3)))
    monkeypatch.setattr("femgear.trains.planar.model.floquet_verdicts", judged)
    solutions = tuple(found.solutions[i % len(found.solutions)] for i in range(10))
    branch = judged_branch(problem, replace(found, solutions=solutions))
    assert [i for i, one in enumerate(branch.solutions) if one.verdict.error == -1.0] == close
    assert tolerances == [(10, 1e-3), (5, 1e-6)] and branch.stability


def test_points_shown_are_the_start_the_first_back_flanks_and_the_largest_stable_response():
    metres = 1e-5 * np.array([1.0, 2.0, 4.0, 3.0, 5.0, 2.0])
    back = np.array([0.0, 0.0, 0.0, 0.2, 0.3, 0.1])
    known = np.array([1, 1, 0, 1, -1, 1])
    largest = shown_points(metres, back, known)
    assert largest == [(0, "start"), (2, "before back flanks touch"), (3, "largest stable response")]
    unknown = shown_points(metres, back, np.array([0, -1, 0, -1, 0, 0]))
    assert unknown == [(0, "start"), (2, "before back flanks touch"), (4, "largest response")]
    assert shown_points(metres[::-1], 0 * back, known) == [(0, "start"), (1, "largest stable response")]
    assert shown_points(metres[:1], back[:1], known[:1]) == [(0, "largest stable response")]


def test_neighbouring_limit_points_are_one_the_outermost():
    hertz = np.array([40.0, 50.0, 50.02, 50.01, 45.0, 44.0, 44.5])
    fold = np.array([False, True, True, False, False, True, False])
    assert merged_folds(hertz, fold).tolist() == [2, 5]
    assert merged_folds(hertz, fold & False).tolist() == []


def test_report_shows_every_figure_with_its_comparison(results):
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == len([n for n in results.manifest.files if n.endswith(".png")])
    assert {f"{name}.png" for name in FIGURES} <= results.manifest.files.keys()
    for words in ("1 in contact all the time", "Published natural frequencies", "40.75", "Beside NREL"):
        assert words in page
    for section in ("response-to-the-weight", "weight-and-mesh-frequency"):
        assert f'<details id="{section}"' in page
    before = page
    assert cli.main(["report", str(results.folder)]) == 0
    assert (results.folder / "report.html").read_text(encoding="utf-8") == before


def test_results_page_names_the_coordinates(results):
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    for name, data in (("branch", results.branch), ("response", results.response)):
        section = text.split(f"## {name}.nc")[1].split("\n## ")[0]
        assert all(f"`{coordinate}`" in section for coordinate in data.coords)


def test_only_one_stage_and_stages_that_are_none(tmp_path, pgb, capsys):
    path = tmp_path / "case.toml"
    path.write_text(to_toml(pgb), encoding="utf-8")
    out = tmp_path / "out"
    assert cli.main(["run", str(path), "-o", str(out), "--only", "modes", "--no-pictures"]) == 0
    assert open_results(out).stages == ("modes",)
    assert cli.main(["report", str(out)]) == 0 and (out / "mode_shapes.png").is_file()
    assert cli.main(["run", str(path), "-o", str(tmp_path / "no"), "--only", "housing"]) == 2
    assert "[E-STAGE]" in capsys.readouterr().err and not (tmp_path / "no").exists()
    reference = str(ROOT / "cases" / "planetary_27_40_108.toml")
    assert cli.main(["run", reference, "-o", str(tmp_path / "no"), "--only", "branch"]) == 2
    assert "no stage of a case with an elastic ring" in capsys.readouterr().err


def test_stages_of_every_kind_of_case(pgb, coarse):
    assert stages_of(pgb) == ("modes", "branch", "response")
    assert stages_of(pgb, "static") == ("static",) and stages_of(pgb, "stress") == ("static", "stress")
    assert stages_of(coarse) == ("static", "modes", "response")
    assert stages_of(with_value(coarse, "static.stresses", True))[:2] == ("static", "stress")
    assert stages_of(coarse, "response") == ("static", "modes", "response")
    with pytest.raises(CaseError, match=r"no section planar\.branch"):
        stages_of(coarse, "branch")


def test_an_interrupted_run_keeps_its_finished_stages(tmp_path, pgb, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    stages = [replace(one, solve=interrupt) if one.name == "branch" else one for one in PLANAR.stages]
    monkeypatch.setattr("femgear.trains.planar.stages.PLANAR", replace(PLANAR, stages=tuple(stages)))
    with pytest.raises(KeyboardInterrupt), run_folder(tmp_path / "out") as out:
        run_case(pgb, out, pictures=False)
    with pytest.warns(UserWarning, match="interrupted after: modes"):
        assert open_results(tmp_path / "out").modes.sizes["mode"] == 18


def test_a_negative_torque_is_the_mirror_image_against_the_turning(pgb):
    case = changed(pgb, operation__torque="-180000 N m", planar__branch__stability=False)
    found = solve_branch(case)
    problem = gravity_problem_b(driven=False)
    other = weight_branch(problem, (36.0, 37.2), harmonics=3)
    for index in (0, -1):
        ours = member_rms(gravity_problem_b(torque=-180e3), [found.branch.solutions[index]], "carrier")[0, 0]
        theirs = member_rms(problem, [other.solutions[index]], "carrier")[0, 0]
        assert ours == pytest.approx(theirs, rel=1e-5)


def test_ring_swings_against_a_carrier_bearing_that_closes_for_a_part_of_the_time():
    clearance, limits = 20e-6, (110.0, 118.0)
    case = read_case(ROOT / "cases" / "nrel_pga.toml")
    case = changed(
        case,
        planar__back_flanks=False,
        planar__carrier_bearing__clearance="20 um",
        planar__branch={"from": "110 Hz", "to": "118 Hz", "stability": False, "harmonics": 3},
    )
    data = solve_branch(case).dataset()
    problem = bearing_problem_a(clearance)
    other = weight_branch(problem, limits, harmonics=3)
    theirs = member_rms(problem, other.solutions, "ring")[:, 0]
    rms = np.interp(data["weight_frequency"].values, other.parameter / (2 * np.pi), theirs)
    np.testing.assert_allclose(data["rms"].sel(member="ring", axis="x").values, rms, rtol=2e-3)
    force, moved = (
        data[f"{name}_real"].values + 1j * data[f"{name}_imag"].values
        for name in ("carrier_bearing_force", "displacement")
    )
    # the bearing pushes the carrier back towards the ring, by less than its stiffness without clearance
    members = data["member"].values.tolist()
    away = moved[:, members.index("carrier")] - moved[:, members.index("ring")]
    spring = (force * away.conj()).real.sum(axis=(1, 2)) / (np.abs(away) ** 2).sum(axis=(1, 2))
    assert np.all(spring < -0.1 * 3.2e9) and np.all(spring > -3.2e9)


def test_mesh_stiffness_of_the_static_solution_goes_into_modes_and_branch(coarse, static):
    found = solve_planar_modes(coarse, static)
    np.testing.assert_allclose(found.modes.mesh_stiffness[:6], static.cycle.stiffness.mean(axis=1))
    model = planar_model(coarse, planetary_set(coarse), static)
    # deflection at which the mean line of a mesh carries its mean force
    mesh, cycle = model.problem.elements[0], static.cycle
    force, _ = mesh.evaluate(cycle.deflection.mean(axis=1)[:, None], np.zeros((1, 1)))
    np.testing.assert_allclose(force.ravel(), cycle.force.mean(axis=1), rtol=1e-3)


@pytest.mark.parametrize(("fixed", "sense"), [("ring", 1), ("sun", -1)])
def test_slow_turning_stiffly_held_gears_follow_their_static_solution(coarse, static, fixed, sense):
    stiff = changed(
        coarse,
        planar__gravity=None,
        planar__back_flanks=False,
        planar__smoothing="0 um",
        sun__support_stiffness="1e14 N/m",
        carrier__support_stiffness="1e14 N/m",
        planet__bearing_stiffness="1e14 N/m",
        planar__ring__support_stiffness="1e14 N/m",
        planar__torsion={"sun": "1e12 N m/rad", "ring": "1e14 N m/rad"},
        operation__fixed=fixed,
        operation__speeds=["0.01 rpm"],
        dynamics__mesh_harmonics=5,
        dynamics__response_harmonics=10,
    )
    found = solve_planar_response(stiff, static).dataset().isel(speed=0)
    lines = (found["mesh_force_real"] + 1j * found["mesh_force_imag"]).values
    # against a sun that stands the carrier runs through the record from its end
    wave = np.exp(2j * np.pi * sense * static.cycle.position[:, None] * found["mesh_order"].values)
    force = (lines @ wave.T).real
    expected = static.cycle.force
    # the static solution shares the load between planets at every position; 5 harmonics of 12 positions
    share = np.ptp(expected, axis=1).max()
    assert share > 0.01 * expected.mean()
    np.testing.assert_allclose(force, expected, atol=0.1 * share)


def test_weight_alone_in_a_turning_frame_is_the_linear_response(pgb):
    case = changed(
        pgb,
        planar__branch=None,
        planar__back_flanks=False,
        planar__gyroscopic=True,
        planar__smoothing="0 um",
        planar__reaction="supports",
        operation__speeds=["900 rpm"],
    )
    found = solve_planar_response(case).dataset().isel(speed=0)
    model = planar_model(case, planetary_set(case), mesh_frequency=True)
    omega = 900 * np.pi / 30
    torque = PlanarTorque(180e3, "carrier", None)
    system = gear_set_system(model.data, torque=torque, carrier_speed=omega)
    K = system.K + (system.W * model.data.mesh_stiffness) @ system.W.T
    C = model.problem.system.C + omega * system.gyroscopic
    dynamic = K - omega**2 * system.M + 1j * omega * C
    q = np.linalg.solve(dynamic, model.problem.forces[0].force)
    line = int(np.flatnonzero(found["carrier_order"].values == 1)[0])
    x = (found["displacement_real"] + 1j * found["displacement_imag"]).values[0, :, line]
    np.testing.assert_allclose(x, q[:2], rtol=1e-6)
    still = np.linalg.solve(dynamic - 1j * omega**2 * system.gyroscopic, model.problem.forces[0].force)
    assert abs(still[0] / q[0] - 1) > 1e-3


def test_clearance_of_the_planet_bearings_acts_in_the_response(pgb):
    case = changed(pgb, planar__branch=None, planet__bearing_clearance="20 um")
    tight = solve_planar_response(with_value(case, "planet.bearing_clearance", None)).dataset()
    loose = solve_planar_response(case).dataset()
    force = [np.abs(one["planet_bearing_force_real"].values[0, :, 1, 0]).sum() for one in (tight, loose)]
    assert force[1] == pytest.approx(force[0], rel=1e-6) and force[0] == pytest.approx(180e3 / 0.294, rel=1e-6)
    model = planar_model(case, planetary_set(case), mesh_frequency=True)
    assert model.groups["planets"].shape == (3, 2)
    solution = solve_planar_response(case).solutions[0]
    pins = motion_lines(model, solution).planet_bearing_force
    # the force of the bearing needs more than its clearance
    apart = np.hypot(*solution.deflection[model.groups["planets"]][0, :, 0].real)
    assert 20e-6 < apart < 20e-6 + 3 * np.hypot(*pins[0, :, 0].real) / 5.3e9


@pytest.mark.slow
def test_weight_and_meshing_together_agree_with_integration(coarse, static):
    # without back flanks on lines of their own modal damping stays modal, as the quick integration needs
    case = changed(coarse, planar__back_flanks=False, operation__speeds=["30 rpm"])
    found = solve_planar_response(case, static).solutions[0]
    model = planar_model(case, planetary_set(case), static, mesh_frequency=True)
    turns, teeth = 0.5, planetary_set(case).ring.teeth
    frequency = 2 * np.pi * turns * np.array([1.0, teeth])
    np.testing.assert_allclose(found.frequency, frequency, rtol=1e-12)
    times = np.append(0.0, np.linspace(1.0, 1.5, teeth * 16, endpoint=False) / turns)
    step = 1.0 / (turns * teeth * 400)
    moved = solve_transient(model.problem, frequency, times, method="modal", step=step)
    wave = np.exp(1j * times[1:, None] * found.line_frequency)
    error = moved.force[1:] - (wave @ found.force.T).real
    # what is left is the integration's, of second order: 0.6 % with these steps, 0.1 % with 1000 a period
    assert np.sqrt((error**2).mean(axis=0)).max() < 0.01 * moved.force[1:].std(axis=0).max()


def test_an_undamped_resonance_is_refused(pgb):
    bare = changed(pgb, planar__damping_ratios=[0.0], planar__back_flanks=False)
    over = changed(bare, planar__branch={"from": "35 Hz", "to": "60 Hz", "harmonics": 3, "stability": False})
    with pytest.raises(CaseError, match=r"40\.76.* Hz has no damping") as info:
        solve_branch(over)
    assert info.value.code == "E-RESONANCE" and info.value.exit_code == 2
    # beside it the response is that of the undamped set
    beside = changed(bare, planar__branch={"from": "30 Hz", "to": "32 Hz", "harmonics": 3, "stability": False})
    assert solve_branch(beside).branch.complete
    with pytest.raises(CaseError, match="E-RESONANCE"):
        solve_planar_response(changed(bare, operation__speeds=["2445.665 rpm"]))


def test_a_branch_ends_before_motions_that_are_not_small(pgb):
    faint = changed(
        pgb,
        planar__damping_ratios=[1e-4],
        planar__back_flanks=False,
        planar__branch={"from": "39 Hz", "to": "45 Hz", "harmonics": 2, "stability": False, "points": 40},
    )
    found = solve_branch(faint)
    data, module = found.dataset(), 14e-3
    assert not data.attrs["complete"] and "more than 28 mm (2 modules)" in data.attrs["message"]
    assert 20e-3 < data["motion"].values.max() <= 2 * module
    assert 39.0 < data["weight_frequency"].values[-1] < 40.761
    # farthest that a member's centre moves, of its lines over one turn
    lines = (data["displacement_real"].values + 1j * data["displacement_imag"].values)[-1]
    turn = np.exp(2j * np.pi * np.outer(np.arange(lines.shape[-1]), np.arange(720) / 720))
    path = (lines @ turn).real
    assert data["motion"].values[-1] == pytest.approx(np.hypot(path[:, 0], path[:, 1]).max(), rel=1e-4)
    assert data["motion"].values.argmax() == len(data["motion"]) - 1
    with pytest.raises(ConvergenceError, match="E-MOTION") as info:
        solve_planar_response(changed(faint, operation__speeds=["2445.6 rpm"]))
    assert info.value.exit_code == 3


def test_a_response_that_does_not_converge_is_a_numerical_failure(pgb, monkeypatch, tmp_path, capsys):
    def lost(*arguments, **options):
        found = solve_harmonic_balance(*arguments, **options)
        return replace(found, converged=False, message="it wandered off.")

    monkeypatch.setattr("femgear.trains.planar.stages.solve_harmonic_balance", lost)
    path = tmp_path / "case.toml"
    path.write_text(to_toml(pgb), encoding="utf-8")
    out = tmp_path / "out"
    assert cli.main(["run", str(path), "-o", str(out), "--only", "response", "--no-pictures"]) == 3
    said = capsys.readouterr().err
    assert "no response at 1 of 1 speeds: 30 rpm" in said and "wandered off" in said
    with pytest.warns(UserWarning):
        assert "response" not in open_results(out).stages


def test_truncation_is_said(results):
    """Three harmonics do not carry the forces of teeth that wedge."""
    data = results.branch
    force = data["back_force_real"].values + 1j * data["back_force_imag"].values
    drive = data["mesh_force_real"].values + 1j * data["mesh_force_imag"].values
    # of the last point: energy of harmonics 2 and 3 in that of 1 to 3, planet-ring meshes
    energy = (np.abs(force[-1, 3:]) ** 2 + np.abs(drive[-1, 3:]) ** 2).sum(axis=0)
    assert data["force_tail"].values[-1] >= np.sqrt(energy[2:].sum() / energy[1:].sum()) * (1 - 1e-9)
    assert data["force_tail"].values.max() > 0.05
    (finding,) = (one for one in branch_warnings(data) if one.code == "W-TAIL")
    assert "not to be trusted, raise planar.branch.harmonics" in finding.text
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert page.count("[W-TAIL]") == 1
    assert results.manifest.convergence["branch"]["force_tail"] == data["force_tail"].values.max()
    assert "came to the end of its range, 37.2 Hz" in data.attrs["message"]
    few = data.assign(tail=0.0 * data["tail"] + 2e-3, force_tail=0.0 * data["tail"])
    assert ["4e-06 of the energy" in note.text for note in tail_warnings(few, "key")] == [True]
    assert tail_warnings(few.assign(tail=0.4 * few["tail"]), "key") == ()


def test_forces_in_time_are_those_of_one_sided_contact(results, pgb):
    data = results.branch
    assert data["flank_force"].values.min() >= 0.0 and data["drive_force"].values.min() >= 0.0
    assert data["shown_as"].values.tolist()[0] == "start"
    point = int(data["shown_point"].values[-1])
    # low lines of the forces in time are the lines of the solution
    for time, lines in (("drive_force", "mesh_force"), ("flank_force", "back_force")):
        wave = np.fft.rfft(data[time].values[-1, :, :-1], axis=1)[:, :4] / 720 * [1, 2, 2, 2]
        known = (data[f"{lines}_real"] + 1j * data[f"{lines}_imag"]).values[point]
        np.testing.assert_allclose(wave, known, atol=2e-3 * np.abs(known).max())


def test_figures_mark_what_too_few_harmonics_make_doubtful(results):
    """Contact and forces by the tail of forces, displacements by their own; nothing without a tail."""
    branch = results.branch.copy(deep=True)
    count, top = branch.sizes["point"], int(branch["shown_point"].values[-1])

    def marked(figure):
        texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
        texts += [ax.get_title(loc="left") for ax in figure.axes]
        return any("W-TAIL" in text for text in texts)

    def figures():
        return {name: marked(figure) for name, figure in branch_figures(branch).items()}

    branch["tail"].values[:] = branch["force_tail"].values[:] = 0.01
    assert not any(figures().values())
    branch["force_tail"].values[top:] = 0.3
    assert figures() == {name: name not in ("weight_response", "carrier_orbit") for name in FIGURES}
    # along the curve the mark is where the tail is
    lines = contact_over_branch(branch).axes[0].get_lines()
    marks = [one for one in lines if "W-TAIL" in one.get_label()]
    assert marks
    for mark in marks:
        assert np.flatnonzero(np.isfinite(mark.get_ydata())).tolist() == list(range(top, count))
    branch["tail"].values[:] = 0.3
    assert all(figures().values())


def test_captions_say_that_lines_are_too_few(results):
    """Three harmonics: more than 5 % of the forces lie in the upper half of the lines."""
    assert float(results.branch["force_tail"].max()) > TAIL_LIMIT > float(results.branch["tail"].max())
    for stem in ("tooth_contact", "wedged_teeth", "planet_bearing_forces"):
        assert "W-TAIL" in " ".join(doubts(results, stem))
    for stem in ("weight_response", "carrier_orbit", "mode_shapes"):
        assert not list(doubts(results, stem))


def test_equal_forces_are_drawn_once(results):
    figure = response_mesh_forces(results.response, 0)
    assert len(figure.axes) == 1
    # one curve needs no legend
    assert not figure.legends
    assert figure.axes[0].get_title(loc="left").endswith(", sun-planet 1 and planet 1-ring: equal")
    # as they are
    lines = results.response["mesh_force_real"].values[0] + 1j * results.response["mesh_force_imag"].values[0]
    assert np.abs(lines[3] - lines[0])[1:].sum() < 5e-3 * np.abs(lines[0])[1:].sum()
    apart = results.response.copy(deep=True)
    apart["mesh_force_real"].values[0, 3, 1] *= 1.1
    assert len(response_mesh_forces(apart, 0).legends[0].get_texts()) == 2
