"""Runs of drivetrain cases: stages, files, figures, report, and numbers against other ways to them."""

import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from pydantic import BaseModel
from scipy.linalg import eigh

from femgear import cli
from femgear.errors import CaseError, ConvergenceError
from femgear.run import report_again, run_case
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.storage.results import run_folder
from femgear.trains.drivetrain.case_file import DrivetrainCase
from femgear.trains.drivetrain.checks import check_spectrum
from femgear.trains.drivetrain.figures import spectrum_figures
from femgear.trains.drivetrain.model import (
    BENDING,
    TORSIONAL,
    balanced_torque,
    case_model,
    drivetrain_problem,
)
from femgear.trains.drivetrain.results import MeshLine, describe_drivetrain, describe_transient
from femgear.trains.drivetrain.simulation import Decimator
from femgear.trains.drivetrain.stages import (
    DRIVETRAIN,
    _check_sense,
    line_amplitudes,
    mesh_lines,
    resolved_lines,
    solve_drivetrain_modes,
    solve_spectrum,
    solve_transient_run,
)
from femgear.trains.reading import open_results, parse_case, read_case, with_value, with_values
from femgear.trains.registry import stages_of as stages_of_case

ROOT = Path(__file__).parents[3]
NAMES = ("wind_turbine_drivetrain", "grc_like_drivetrain", "own_chain")


def stages_of(case, only=None):
    return tuple(stage.name for stage in stages_of_case(case, only))


def shipped(name, **changes):
    case = read_case(ROOT / "cases" / f"{name}.toml")
    for key, value in changes.items():
        case = with_value(case, f"simulation.{key}", value)
    return case


@pytest.fixture(scope="module")
def own():
    return shipped("own_chain", settle="0.05 s", duration="0.2 s", rate="20 kHz", modes=1)


@pytest.fixture(scope="module")
def results(tmp_path_factory, own):
    folder = tmp_path_factory.mktemp("drivetrain") / "out"
    with run_folder(folder) as out:
        run_case(own, out)
    return open_results(folder)


@pytest.mark.parametrize("name", NAMES)
def test_shipped_cases_run(name, tmp_path):
    case = shipped(name, settle="0.02 s", duration="0.12 s", rate="10 kHz", record="2 kHz")
    with run_folder(tmp_path / "out") as folder:
        run_case(case, folder, pictures=False)
    data = open_results(tmp_path / "out")
    assert data.stages == ("modes", "transient", "spectrum")
    assert np.isfinite(data.transient["mesh_force"].values).all() and data.transient.sizes["time"] == 241
    assert float(data.transient["energy_error"].max()) < 1e-9
    variants = [BENDING, TORSIONAL] if name.startswith("wind") else [BENDING]
    assert list(data.spectrum["variant"].values) == variants


def test_files_figures_and_report(results, own):
    names = set(results.manifest.files)
    figures = {"stiffness_series", "campbell", "transient_speeds", "transient_deviations", "transient_forces"}
    assert names >= {f"{name}.png" for name in (*figures, "mesh_force_spectrum", "drivetrain_mode_2")}
    assert results.manifest.complete and results.manifest.convergence["transient"]["energy"] < 1e-9
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    for text in ("Gear stages", "Transient", "Spectrum", "pinion-wheel", "Other pictures"):
        assert (text in page) == (text != "Other pictures")
    (results.folder / "report.html").unlink()
    report_again(results.folder)
    assert (results.folder / "report.html").read_text(encoding="utf-8") == page
    # the case of the results needs no other file
    assert read_case(results.folder / "case.toml") == own


def test_side_bands_are_drawn_where_there_are_planets():
    case = shipped("wind_turbine_drivetrain", torsional=False)
    for key, value in (("settle", "1 s"), ("duration", "25 s"), ("rate", "1 kHz"), ("record", "500 Hz")):
        case = with_value(case, f"simulation.{key}", value)
    figures = spectrum_figures(solve_spectrum(case, solve_transient_run(case)).dataset())
    assert {"mesh_force_spectrum", "side_bands_carrier-sun", "side_bands_gear_1-gear_2"} <= set(figures)
    (ax,) = figures["side_bands_carrier-sun"].axes
    order, _ = ax.get_lines()[0].get_data()
    assert order[0] < 184.0 < order[-1] and len(ax.texts) == 7


def test_speeds_forces_and_angles(results, own):
    data, model = results.transient, case_model(own)
    time = data["time"].values
    ratio = np.array([model.ratio[name] for name in data["body"].values])
    angle = data["spin"].values[0][:, None] * ratio + data["deviation"].values[0]
    moved = np.trapezoid(data["speed"].values[0], time, axis=0)
    assert np.abs(angle[-1] - angle[0] - moved).max() < 1e-4 * np.abs(moved).min()
    # 60 N m on a base circle of 34.5 mm cos 20 deg
    force = data["mesh_force"].values[0, :, 0]
    assert force.mean() == pytest.approx(60.0 / (34.5e-3 * math.cos(math.radians(20.0))), rel=0.02)
    full = solve_transient_run(with_value(own, "simulation.record", "20 kHz")).runs[BENDING].force[:, 0]
    extremes = (float(data["least_force"][0, 0]), float(data["largest_force"][0, 0]))
    assert extremes == pytest.approx((full.min(), full.max())) and extremes[0] < force.min()
    assert float(data["pulling"][0, 0]) == pytest.approx(np.mean(full < 0.0))
    assert data.attrs["every"] == 4 and data.attrs["steps"] == 4000
    torque = data["torque"].values
    assert np.abs(torque @ ratio).max() < 1e-9


def test_tables_show_extremes_of_steps_and_of_records(results, own):
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
    damping = "damping 3 % of critical in all modes"
    assert damping in block.notes and any("a low pass that ends at" in note for note in block.notes)
    operation = next(one for one in describe_drivetrain(own) if one.title == "Operation")
    assert damping in operation.notes


def test_every_shipped_chain_has_its_damping_written_down():
    for path in sorted((ROOT / "cases").glob("*.toml")):
        if 'model = "drivetrain"' in (text := path.read_text(encoding="utf-8")):
            assert re.search(r"^damping_ratio = 0\.0[1-9]", text, re.MULTILINE), path.name
            assert not any(warning.code == "W-DAMPING" for warning in DRIVETRAIN.warnings(read_case(path)))


def test_low_pass_keeps_what_it_should():
    """Constants and ramps exactly, a tone in the pass band to 1e-4; one beyond half the rate leaves 1e-4."""
    every, count, rate = 20, 12_000, 20_000.0
    time = np.arange(count + 1) / rate
    columns = [np.ones_like(time), 3.0 * time - 1.0]
    columns += [np.sin(2.0 * np.pi * f * time) for f in (50.0, 390.0, 510.0, 9000.0)]
    table = np.stack(columns, axis=1)
    runs = []
    for block in (count + 1, 4096, 333):
        decimator = Decimator(every, count)
        runs.append(np.vstack([decimator.push(table[i : i + block]) for i in range(0, count + 1, block)]))
    assert runs[0].shape == (count // every + 1, 6)
    assert all(np.abs(run - runs[0]).max() < 1e-12 for run in runs[1:])
    error = np.abs(runs[0] - table[::every])
    inside = slice(60, -60)
    assert error[:, :2].max() < 1e-12 and error[inside, 2:4].max() < 2e-4
    assert np.abs(runs[0][inside, 4:]).max() < 2e-4
    # thinned out without a low pass, 510 Hz would stand at 490 Hz with its whole amplitude
    assert np.abs(table[::every][inside, 4]).max() > 0.9


def test_records_do_not_fold_back(own):
    """The second mesh harmonic lies beyond the records of 2 kHz: it must not appear in them."""
    slow = with_value(with_value(own, "simulation.record", "2 kHz"), "simulation.duration", "0.4 s")
    fast = with_value(with_value(own, "simulation.record", "20 kHz"), "simulation.duration", "0.4 s")
    force = {}
    for name, case in (("slow", slow), ("fast", fast)):
        run = solve_transient_run(case).runs[BENDING]
        late = run.time >= 0.2
        force[name] = run.time[late], run.force[late, 0]

    def line(name, frequency):
        time, values = force[name]
        window = np.hanning(len(time))
        return 2.0 * abs((window * (values - values.mean())) @ np.exp(-2j * np.pi * frequency * time)) / window.sum()

    mesh = 23 * 1480.0 / 60.0
    assert line("slow", mesh) == pytest.approx(line("fast", mesh), rel=1e-3)
    assert line("fast", 2 * mesh) > 100.0
    assert line("slow", 2000.0 - 2 * mesh) < 1e-2 * line("fast", 2 * mesh)


def test_lines_against_harmonic_balance():
    """Integration, low pass, projection: the mesh harmonics that harmonic balance finds."""
    case = shipped("own_chain", rate="100 kHz", settle="1.0 s", duration="1.2 s")
    constant = [{"body": "motor", "torque": "120 N m"}, {"body": "fan", "share": 1.0}]
    case = with_value(case, "operation.torque", constant)
    found = solve_spectrum(case, solve_transient_run(case))
    model, speed = case_model(case), case.operation.speed
    torques = balanced_torque(model, "motor", 120.0, "fan")
    problem = drivetrain_problem(model, torques=torques, speed=speed)
    settled = solve_harmonic_balance(problem, model.frequencies(speed), harmonics=45, stability=False)
    wanted = np.abs(settled.force[0, 1:4])
    assert settled.converged
    assert found.amplitudes[BENDING][:, 0] == pytest.approx(wanted, rel=8e-3)


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


def test_named_lines_of_the_paper():
    model = case_model(shipped("wind_turbine_drivetrain"))
    lines = {line.name: line for line in mesh_lines(model)}
    hertz = {name: line.order * 0.1 for name, line in lines.items()}
    assert hertz["carrier-sun mesh"] == pytest.approx(18.4)
    assert hertz["carrier-sun mesh - 1 turn"] == pytest.approx(18.3)
    assert hertz["gear 2-gear 3 mesh - gear 1-gear 2 mesh"] == pytest.approx(128.8766 - 62.8364, abs=1e-3)
    for line in lines.values():
        assert line.order == pytest.approx(abs(np.dot(line.orders, model.base_ratio)))
    # 7 f_p stands 0.77 orders beside f_23
    parted = dict(zip(lines, resolved_lines(model, list(lines.values()), 0.5)))
    assert not parted["gear 2-gear 3 mesh"] and parted["gear 1-gear 2 mesh"]


def test_modes_and_campbell(results, own):
    data, found = results.modes, solve_drivetrain_modes(own)
    assert str(data["kind"].values[0]) == "rigid" and str(data["kind"].values[1]) == "torsional"
    np.testing.assert_allclose(data["energy"].values.sum(axis=0), 1.0)
    # four rotors: coupling, mesh and the steel shaft of 70 mm in torsion
    second = math.pi * 0.07**4 / 64.0
    shaft = 2.06e11 / 2.6 * 2.0 * second / 0.6
    polar = 7850.0 * 2.0 * second * 0.6
    base = [r * math.cos(math.radians(20.0)) for r in (34.5e-3, 106.5e-3)]
    K = np.zeros((4, 4))
    K[:2, :2] += 12e3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[1:3, 1:3] += 3e8 * np.outer(base, base)
    K[2:, 2:] += shaft * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M = np.diag([0.25, 0.012, 0.6 + polar / 3.0, 18.0 + polar / 3.0])
    M[2, 3] = M[3, 2] = polar / 6.0
    rotors = np.sqrt(eigh(K, M, eigvals_only=True)[1:2]) / (2.0 * math.pi)
    held = [{"body": body.name, "radial": "rigid", "tilt": "rigid"} for body in own.body]
    stiff = solve_drivetrain_modes(with_value(own, "bearing", held))
    assert stiff.modes.frequency[1] == pytest.approx(rotors[0], rel=1e-4)
    # bearings that give way are in series with the mesh
    assert data["frequency"].values[1] < rotors[0]
    still = found.campbell.frequency[0]
    assert np.abs(np.sort(still) - found.modes.frequency[1 : 1 + len(still)]).max() < 1e-6 * still.max()
    assert float(data["mesh_frequency"][0]) == pytest.approx(23 * 1480 / 60)


def test_stages(own):
    assert stages_of(own) == ("modes", "transient", "spectrum")
    assert stages_of(own, "modes") == ("modes",)
    assert stages_of(own, "spectrum") == ("transient", "spectrum")
    with pytest.raises(CaseError, match="E-STAGE"):
        stages_of(own, "housing")


def test_a_shaft_without_gears_has_no_spectrum(own, tmp_path):
    text = """
        model = "drivetrain"
        title = "two discs"
        body = [{name = "a", inertia = "1 kg m^2", mass = "10 kg", tilts = false},
                {name = "b", inertia = "2 kg m^2", mass = "10 kg", tilts = false}]
        shaft = [{between = ["a", "b"], length = "0.5 m", outer_diameter = "50 mm"}]
        bearing = [{body = "a", radial = "1e8 N/m"}, {body = "b", radial = "rigid"}]
        operation = {speed = "100 rpm", torque = [{body = "a", torque = "30 N m"}]}
        simulation = {duration = "0.2 s", modes = 0}
    """
    with run_folder(tmp_path / "out") as folder:
        run_case(parse_case(text), folder)
    data = open_results(tmp_path / "out")
    assert data.stages == ("modes", "transient") and "transient_speeds.png" in data.manifest.files
    speed = data.transient["speed"].values[0]
    # 30 N m on 3 kg m^2 for 0.2 s
    assert (speed[-1] - speed[0]).mean() == pytest.approx(2.0, rel=0.05)
    with pytest.raises(CaseError, match="no gears"):
        stages_of(parse_case(text), "spectrum")


def test_command_line(tmp_path, capsys, own):
    path = ROOT / "cases" / "own_chain.toml"
    assert cli.main(["check", str(path)]) == 0
    assert "567.3333" in capsys.readouterr().out
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out"), "--only", "modes", "--no-pictures"]) == 0
    assert open_results(tmp_path / "out").stages == ("modes",)
    assert cli.main(["run", str(path), "-o", str(tmp_path / "none"), "--only", "housing"]) == 2
    assert not (tmp_path / "none").exists()
    assert cli.main(["schema", "--model", "drivetrain"]) == 0 and "ring_teeth" in capsys.readouterr().out


def example():
    """The case of the page."""
    (text,) = re.findall(
        r"^```toml\n(.*?)^```", section_of("drivetrain.md", "## Case file"), flags=re.MULTILINE | re.DOTALL
    )
    return parse_case(text)


@pytest.fixture(scope="module")
def resonant():
    """The example of the page in its parametric resonance, without damping."""
    case = with_value(example(), "operation.speed", "992.338 rpm")
    changes = {"damping_ratio": 0.0, "duration": "4 s", "torsional": True, "record": "5 kHz"}
    for key, value in changes.items():
        case = with_value(case, f"simulation.{key}", value)
    return case


def test_a_motion_that_grows_without_end_is_refused(resonant):
    with pytest.raises(ConvergenceError, match="E-DIVERGED") as caught:
        solve_transient_run(resonant)
    text = str(caught.value)
    for part in ("damping_ratio", "with bending", "motor-fan", "parametric resonance", "contact_loss"):
        assert part in text


def test_a_motion_beyond_sense_is_refused_though_its_books_are_exact(resonant):
    with pytest.raises(ConvergenceError, match="E-DIVERGED") as caught:
        solve_transient_run(with_value(resonant, "simulation.duration", "0.2 s"))
    error = caught.value
    assert "torsional: motor vibrates with" in error.message and "100 times the speed" in error.limit
    assert error.key == "simulation.damping_ratio" and "contact_loss" in error.remedy


def test_impacts_that_the_steps_blow_up_are_refused():
    """Finer steps keep this motion at some 40 kN; coarse ones feed its impacts with energy."""
    run = SimpleNamespace(
        contact_loss=True,
        gain=1e9,
        spin_speed=np.full(3, 10.0),
        velocity=np.array([[0.0, 5.0], [1.0, 9e4]]),
        outputs=("motor: rotation", "fan: rotation"),
    )
    with pytest.raises(ConvergenceError, match="fan vibrates with 9e") as caught:
        _check_sense(run, "with bending", [1.0, 0.25])
    assert caught.value.code == "E-DIVERGED" and "simulation.rate" in caught.value.remedy
    _check_sense(SimpleNamespace(**vars(run) | {"gain": 10.0}), "with bending", [1.0, 0.25])


def test_growth_and_contact_loss_in_the_results(resonant):
    short = with_value(resonant, "simulation.duration", "0.1 s")
    linear = solve_transient_run(short).dataset()
    assert linear.attrs["contact"] == "linear" and float(linear["lost"].max()) == 0.0
    # grown at most as the exponent of the second says
    assert 10.0 < float(linear["gain"][1]) < math.exp(1.2 * 0.1 * float(linear["growth"][1]))
    assert np.all(linear["growth"].values[1:] > 10.0) and linear["growth"].attrs["units"] == "1/s"
    longer = with_value(resonant, "simulation.duration", "0.5 s")
    apart = solve_transient_run(with_value(longer, "simulation.contact_loss", True)).dataset()
    assert apart.attrs["contact"] == "separating"
    assert np.all(apart["lost"].values[1] > 0.01) and float(apart["least_force"][1].min()) >= 0.0
    assert float(apart["energy_error"].max()) < 1e-6 and float(apart["momentum_error"].max()) < 1e-6


def test_a_chain_that_turns_back_has_no_orders(own):
    brake = [{"body": "motor", "torque": "-900 N m"}]
    case = with_value(with_value(own, "operation.torque", brake), "simulation.duration", "0.6 s")
    with pytest.raises(CaseError, match="nearly stops or turns back") as caught:
        solve_spectrum(case, solve_transient_run(case))
    # known from the torques alone, with the same numbers
    with pytest.raises(CaseError) as before:
        check_spectrum(case, case_model(case))
    assert before.value.message == caught.value.message and before.value.code == "E-SPECTRUM"
    run = solve_transient_run(case).runs[BENDING]
    late = run.time >= case.simulation.settle
    rpm = [float(number) for number in re.findall(r"(\S+) rpm", before.value.message)]
    wanted = np.array([run.spin_speed[late].min(), run.spin_speed[late].mean()]) * 30.0 / math.pi
    assert rpm == pytest.approx(wanted, abs=2.0)


def keys_of(model) -> set[str]:
    found, pending = set(), [model]
    while pending:
        for name, field in pending.pop().model_fields.items():
            found.add(field.alias or name)
            pending += [t for t in parts_of(field.annotation) if isinstance(t, type) and issubclass(t, BaseModel)]
    return found


def parts_of(annotation):
    yield annotation
    for part in get_args(annotation):
        yield from parts_of(part)


def section_of(page: str, heading: str) -> str:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.split(r"^#{2,3} ", text.split(f"{heading}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


def test_page_names_every_key_and_its_example_runs():
    text = section_of("drivetrain.md", "## Case file")
    cells = re.findall(r"^\|([^|]*)\|", text, flags=re.MULTILINE)
    named = {name for cell in cells for name in re.findall(r"`(\w+)`", cell)}
    assert named == keys_of(DrivetrainCase)
    case = example()
    assert solve_spectrum(case, solve_transient_run(with_value(case, "simulation.rate", "5 kHz"))).lines


@pytest.mark.parametrize(
    ("heading", "stage"),
    [
        ("### Modes of drivetrains", "modes"),
        ("### Motion of drivetrains: transient.nc", "transient"),
        ("### Spectra of drivetrains: spectrum.nc", "spectrum"),
    ],
)
def test_results_page_names_every_attribute(results, heading, stage):
    section, data = section_of("results.md", heading), results[stage]
    for attribute in set(data.attrs) - {"title", "unknowns", "findings", "femgear_format", "femgear_version"}:
        assert f"`{attribute}`" in section, attribute


def test_progress_within_a_motion(own):
    """Blocks of its steps, torsional variant included."""
    told = []
    case = with_values(own, {"simulation.duration": "0.3 s", "simulation.torsional": True})
    solve_transient_run(case, progress=lambda *one: told.append(one))
    shares = [done for _, done, _ in told]
    assert {(stage, total) for stage, _, total in told} == {("transient", 2)}
    assert shares == sorted(shares) and shares[-1] == 2.0 and 1.0 in shares
    assert any(0.0 < share < 1.0 for share in shares) and any(1.0 < share < 2.0 for share in shares)
