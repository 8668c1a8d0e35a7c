"""The scripts: their help, what they write, and that bad input ends in a message, not in a traceback."""

import csv
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from script_runs import run_script as run

from femgear.stages.static import solve_static
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = (
    "mesh_stiffness.py",
    "load_sharing.py",
    "housing_modulation.py",
    "lead_design.py",
    "pin_error_load_sharing.py",
    "drivetrain.py",
    "gyroscopic.py",
    "side_bands.py",
)
# of published sets, without a case file
SET_SCRIPTS = (
    "campbell.py",
    "gravity_wedging.py",
    "bearing_clearance.py",
    "bearing_stiffness.py",
    "planet_phasing.py",
    "multistage.py",
    "stiff_surroundings.py",
)
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
PAIR = ROOT / "cases" / "spur_pair.toml"
OF_SETS = (
    "load_sharing",
    "pin_error_load_sharing",
    "housing_modulation",
    "gyroscopic",
    "lead_design",
)


def table(path):
    """Columns of a CSV file by name: numbers as arrays, texts as lists."""
    with open(path, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    columns = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        columns[name] = np.array(values, float) if name != "mesh" else np.array(values)
    return columns


def is_png(path):
    return path.read_bytes().startswith(b"\x89PNG\r\n") and path.stat().st_size > 5000


@pytest.fixture(scope="module")
def quick_case(tmp_path_factory):
    """The reference set on a coarse grid with few positions."""
    text = CASE.read_text(encoding="utf-8")
    text = text.replace("positions = 64", "positions = 16\nflank_elements = 8")
    path = tmp_path_factory.mktemp("case") / "quick.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_script_is_a_command_of_its_own(tmp_path):
    command = [sys.executable, str(ROOT / "scripts" / "mesh_stiffness.py"), "--torque", "20 mm"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and "not a unit of torque" in done.stderr


@pytest.mark.parametrize("name", SCRIPTS + SET_SCRIPTS)
def test_help(name, tmp_path):
    done = run(name, "--help", folder=tmp_path)
    assert done.returncode == 0
    assert "--output" in done.stdout and ("CASE" in done.stdout) == (name in SCRIPTS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "arguments", "code", "message"),
    [
        ("mesh_stiffness.py", ["no_such_case.toml"], 2, "no_such_case.toml"),
        ("mesh_stiffness.py", ["--torque", "20 mm"], 2, "not a unit of torque"),
        ("mesh_stiffness.py", ["--colour", "blue"], 2, "--colour"),
        ("load_sharing.py", ["--planet", "7"], 2, "1 to 3"),
        ("load_sharing.py", ["--gap=-1 um"], 2, "cannot be negative"),
        ("load_sharing.py", ["--gap", "3"], 2, "needs its unit"),
        ("housing_modulation.py", ["--harmonic", "0"], 2, "1 or more"),
        ("housing_modulation.py", ["--speed", "5 Hz"], 2, "not a unit of speed"),
        ("housing_modulation.py", ["-o", "/dev/null/x"], 4, "E-STORAGE"),
        ("pin_error_load_sharing.py", ["--samples", "0"], 2, "1 to 1000000"),
        ("pin_error_load_sharing.py", ["--tangential=-1 um"], 2, "negative"),
        ("pin_error_load_sharing.py", ["--tolerance", "10 mm"], 2, "allowed: 0 to 300 um"),
        ("pin_error_load_sharing.py", ["--tolerance", "301 um"], 2, "E-RANGE"),
        ("pin_error_load_sharing.py", ["--radial", "101 um"], 2, "allowed: 0 to 100 um"),
        ("pin_error_load_sharing.py", ["--tolerance", "-9 um"], 2, "cannot be negative"),
        ("pin_error_load_sharing.py", ["--position", "2"], 2, "0 to 1"),
        ("pin_error_load_sharing.py", ["--support", "soft"], 2, "soft"),
        ("campbell.py", ["--speeds", "2"], 2, "5 speeds or more"),
        ("campbell.py", ["--train", "C"], 2, "--train"),
        ("gyroscopic.py", ["--highest", "50 Hz"], 2, "not a unit of speed"),
        ("gyroscopic.py", ["--speeds", "2"], 2, "3 speeds or more"),
        ("gravity_wedging.py", ["--backlash", "3"], 2, "needs its unit"),
        ("gravity_wedging.py", ["--lowest", "90", "--highest", "30"], 2, "lowest < highest"),
        ("bearing_clearance.py", ["--clearance=-1 um"], 2, "clearances of 0 or more"),
        ("bearing_clearance.py", ["--points", "1"], 2, "two frequencies"),
        ("bearing_stiffness.py", ["--load", "0"], 2, "above 0 N"),
        ("stiff_surroundings.py", ["--lowest", "9000 rpm", "--highest", "3000 rpm"], 2, "the lowest above 0"),
        ("planet_phasing.py", ["--points", "1"], 2, "2 frequencies"),
        ("planet_phasing.py", ["--angle", "0", "--angle", "100"], 2, "100.800000"),
        ("planet_phasing.py", ["--distance", "50"], 2, "0 to 30"),
        ("planet_phasing.py", ["--convention", "other"], 2, "--convention"),
        *((f"{name}.py", [PAIR], 2, "E-MODEL") for name in OF_SETS),
    ],
)
def test_bad_input_ends_in_a_message(name, arguments, code, message, tmp_path):
    done = run(name, *arguments, folder=tmp_path)
    assert done.returncode == code
    assert message in done.stderr + done.stdout
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("bearing_clearance.py", "tooth_contact.png"),
        ("campbell.py", "campbell.csv"),
        ("drivetrain.py", "forces.csv"),
        ("drivetrain.py", "transient_forces.png"),
        ("gravity_wedging.py", "carrier_orbit.png"),
        ("gyroscopic.py", "gyroscopic.png"),
        ("housing_modulation.py", "ring_deflection.vtu"),
        ("impacts.py", "spectrum.png"),
        ("load_sharing.py", "tooth_loads.csv"),
        ("mesh_stiffness.py", "mesh_stiffness.png"),
        ("multistage.py", "published.csv"),
        ("pin_error_load_sharing.py", "load_sharing_samples.csv"),
        ("planet_phasing.py", "phases.png"),
        ("side_bands.py", "side_bands.png"),
    ],
)
def test_files_of_others_are_refused_before_anything_is_computed(name, file, tmp_path):
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text("theirs")
    start = time.monotonic()
    done = run(name, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 4 and re.search("E-OUTPUT|E-JOURNAL", done.stderr), done.stderr
    assert file.split("/")[0] in done.stderr and "remedy" in done.stderr
    assert (tmp_path / file).read_text() == "theirs" and time.monotonic() < start + 30
    left = [path for path in tmp_path.rglob("*") if path.is_file() and not path.name.startswith(".")]
    # the search opens two journals before it computes
    assert {path.name for path in left} - {"journal_fine.jsonl"} == {Path(file).name} - {"journal_fine.jsonl"}
    assert all(path.read_bytes().count(b"\n") <= 1 for path in left)


def test_a_script_replaces_its_own_files_until_they_are_changed(tmp_path):
    arguments = ("campbell.py", "--speeds", "5", "-o", tmp_path)
    for _ in range(2):
        done = run(*arguments, folder=tmp_path)
        assert done.returncode == 0, done.stderr
    with open(tmp_path / "campbell.csv", "a", encoding="utf-8") as stream:
        stream.write("by hand\n")
    done = run(*arguments, folder=tmp_path)
    assert done.returncode == 4 and "changed since" in done.stderr
    assert (tmp_path / "campbell.csv").read_text().endswith("by hand\n")


def test_mesh_stiffness_of_two_torques(quick_case, tmp_path):
    arguments = (
        "--torque",
        "50 N m",
        "--torque",
        "100 N m",
        "--positions",
        "14",
        "--contact",
        "line_of_action",
    )
    done = run("mesh_stiffness.py", quick_case, *arguments, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "line_of_action; 14 positions" in done.stdout
    folder = tmp_path / "out" / "mesh_stiffness"
    assert is_png(folder / "mesh_stiffness.png")
    data = table(folder / "mesh_stiffness.csv")
    assert len(data["mesh"]) == 2 * 6 * 14
    # torque over base radius and planets: 50 N m / (19.0273 mm * 3)
    half = data["torque [N m]"] == 50
    base_radius = 0.5 * 27 * 1.5e-3 * np.cos(np.radians(20))
    np.testing.assert_allclose(data["force [N]"][half], 50 / (3 * base_radius), rtol=1e-7)
    np.testing.assert_allclose(
        data["force [N]"],
        data["secant stiffness [N/m]"] * data["transmission error [m]"],
        rtol=1e-7,
    )
    # a contact stiffens under load
    assert np.all(data["tangent stiffness [N/m]"] > data["secant stiffness [N/m]"])


def test_load_sharing_with_gaps(quick_case, tmp_path):
    arguments = ("--gap", "0 um", "--gap", "1 um", "--gap", "40 um", "--planet", "2")
    done = run("load_sharing.py", quick_case, *arguments, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "gap 40 um: planet 2 carries nothing over 100 % of the cycle" in done.stdout
    assert is_png(tmp_path / "load_sharing.png") and is_png(tmp_path / "tooth_loads.png")
    data = table(tmp_path / "load_sharing.csv")

    def mean_share(gap, planet):
        return data["share [1]"][(data["gap [m]"] == gap) & (data["planet"] == planet)].mean()

    assert mean_share(0.0, 2) == pytest.approx(1 / 3, rel=1e-6)
    assert mean_share(40e-6, 2) == 0
    assert mean_share(40e-6, 1) == pytest.approx(0.5, rel=2e-3)
    # springs in parallel, 1/k = 1/498 + 1/686 um/N: the planet loses (2/3) k g of 1752 N
    loss = (1 / 3 - mean_share(1e-6, 2)) * 3
    assert loss == pytest.approx(2 / 3 / (1 / 498 + 1 / 686) / 1752, rel=0.06)
    teeth = table(tmp_path / "tooth_loads.csv")
    chosen = (teeth["mesh"] == "sun-planet 1") & (teeth["gap [m]"] == 0) & (teeth["position [periods]"] == 0)
    assert teeth["tooth load [N]"][chosen].sum() == pytest.approx(1751.733, rel=1e-5)


@pytest.mark.slow
def test_load_sharing_under_negative_torque_keeps_the_planet_numbers(quick_case, tmp_path):
    case = tmp_path / "negative.toml"
    case.write_text(quick_case.read_text().replace('"100 N m"', '"-100 N m"'))
    done = run("load_sharing.py", case, "--gap", "3 um", "--planet", "2", "-o", tmp_path / "o", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    data = table(tmp_path / "o" / "load_sharing.csv")
    shares = [data["share [1]"][data["planet"] == n].mean() for n in (1, 2, 3)]
    assert shares[1] < 0.27 and shares[0] == pytest.approx(shares[2], rel=1e-6)


@pytest.mark.slow
def test_housing_modulation(quick_case, tmp_path, monkeypatch):
    import pyvista as pv

    from femgear.trains.elastic import stages

    solve_housing, solved = stages.solve_housing, []

    def kept(*arguments):
        solved.append(solve_housing(*arguments))
        return solved[-1]

    monkeypatch.setattr(stages, "solve_housing", kept)
    done = run("housing_modulation.py", quick_case, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    # the paper reports lines at 108 -+ 3 and six lobes, the window model shows three
    assert "exact: 6 lobes" in done.stdout and "Hanning: 3 lobes" in done.stdout
    lines = table(tmp_path / "lines.csv")
    strongest = lines["carrier order"][np.argsort(-lines["exact [m/s^2]"])[:2]]
    assert set(strongest) == {105, 111}
    # identical planets: nothing where the order is no multiple of their number
    others = lines["carrier order"] % 3 != 0
    (housing,) = solved
    assert not lines["exact [m/s^2]"][others].any() and not (housing.exact.order % 3).any()
    for name in ("order_spectrum.png", "envelope.png", "modulation.png"):
        assert is_png(tmp_path / name)
    surface = pv.read(tmp_path / "ring_deflection.vtu")
    np.testing.assert_allclose(np.hypot(*surface.points[:, :2].T), 0.1, rtol=1e-6)
    # the ring turns against its foundation: torque over k R^2 (2 pi R b), on average
    along = np.column_stack([-surface.points[:, 1], surface.points[:, 0]]) / 0.1
    twist = np.einsum("ij,ij->i", surface.point_data["static"][:, :2], along)[:-2].mean()
    assert abs(twist) == pytest.approx(400 / (1e10 * 0.1**2 * 2 * np.pi * 0.1 * 0.025) * 0.1, rel=0.01)
    curve = pv.read(tmp_path / "modulation.vtp")
    assert "envelope [m/s^2]" in curve.point_data


def test_pin_error_load_sharing(quick_case, tmp_path):
    arguments = ("--samples", "400", "--tolerance", "9 um", "--seed", "5", "--support", "fixed", "floating")
    done = run("pin_error_load_sharing.py", quick_case, *arguments, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "400 samples, seed 5; standard deviations 3 um radial" in done.stdout
    assert is_png(tmp_path / "load_sharing_histogram.png")
    data = table(tmp_path / "load_sharing_samples.csv")
    assert data["tangential error of pin 2 [m]"].std() == pytest.approx(3e-6, rel=0.15)
    fixed = np.array([data[f"share of planet {n}, fixed [1]"] for n in (1, 2, 3)])
    np.testing.assert_allclose(fixed.sum(axis=0), 1.0, rtol=1e-7)
    np.testing.assert_allclose(data["load sharing factor, fixed [1]"], 3 * fixed.max(axis=0), rtol=1e-8)
    np.testing.assert_allclose(data["load sharing factor, floating [1]"], 1.0, rtol=1e-8)
    # statics: more load on planets whose pins stand back against the torque
    errors = np.array([data[f"tangential error of pin {n} [m]"] for n in (1, 2, 3)])
    late = errors - errors.mean(axis=0)
    assert np.corrcoef(late.ravel(), fixed.ravel())[0, 1] < -0.9


@pytest.fixture(scope="module")
def helical_case(tmp_path_factory):
    """A helical set in few slices on a coarse grid."""
    text = CASE.with_name("helical_23_24_73.toml").read_text(encoding="utf-8")
    text = text.replace("positions = 64\nslices = 25", "positions = 8\nflank_elements = 6\nslices = 9")
    path = tmp_path_factory.mktemp("case") / "helical.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
def test_load_sharing_of_a_helical_set(helical_case, tmp_path):
    """Without gap that of a run; a gap takes from its planet what the others get."""
    done = run("load_sharing.py", helical_case, "--gap", "0 um", "--gap", "2 um", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    cycle = solve_static(read_case(helical_case)).cycle
    share = table(tmp_path / "load_sharing.csv")["share [1]"].reshape(2, 3, -1)
    np.testing.assert_allclose(share[0], cycle.load_share, rtol=1e-8)
    mean = share[1].mean(axis=1)
    assert mean[0] < 0.31 < 0.34 < mean[1] and mean.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_pin_errors_of_a_helical_set(helical_case, tmp_path):
    arguments = ("--samples", "4", "--support", "fixed", "--tolerance", "6 um", "-o", tmp_path)
    done = run("pin_error_load_sharing.py", helical_case, *arguments, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    data = table(tmp_path / "load_sharing_samples.csv")
    shares = np.array([data[f"share of planet {n}, fixed [1]"] for n in (1, 2, 3)])
    errors = np.array([data[f"tangential error of pin {n} [m]"] for n in (1, 2, 3)])
    # one pin takes as much from its planet as the two others give: shares follow from linear sensitivities
    own, other = (float(value) for value in re.search(r"all members fixed +(\S+) +\S+ +(\S+)", _last(done)).groups())
    assert own == pytest.approx(-2.0 * other, rel=1e-3)
    linear = 1e-2 * own * 1e6 * (errors - errors.mean(axis=0)) * 1.5
    np.testing.assert_allclose(shares - 1 / 3, linear, atol=0.15 * np.abs(linear).max())


def _last(done) -> str:
    """What a script printed of its last table."""
    return done.stdout[done.stdout.rindex("Linear sensitivity") :]


def text_table(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_campbell(tmp_path):
    done = run("campbell.py", "--speeds", "7", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert is_png(tmp_path / "campbell.png")
    data = table(tmp_path / "campbell.csv")
    still = data["frequency [Hz]"][data["carrier speed [rpm]"] == 0]
    np.testing.assert_allclose(still[[0, 2, 3, 5]], [40.761, 69.563, 156.869, 302.710], rtol=1e-5)
    # the second mesh harmonic meets the rotational mode: 69.563 Hz = 136 times 30.69 rpm
    assert "30.69" in done.stdout


def test_gyroscopic(quick_case, tmp_path):
    done = run("gyroscopic.py", quick_case, "--speeds", "4", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert is_png(tmp_path / "gyroscopic.png")
    assert "14 of 22 modes change by less than 1 %" in done.stdout
    rows = text_table(tmp_path / "gyroscopic.csv")
    last = [row for row in rows if float(row["carrier speed [rad/s]"]) == 120.0]
    change = np.array([abs(float(row["change [1]"])) for row in last])
    assert len(change) == 22 and 0.017 < change.max() < 0.018
    # what only turns does not move at all
    assert max(c for c, row in zip(change, last) if row["kind"] == "rotational") < 1e-3
    # ring alone, n = 2: 2 times 120 / 2 pi over 1794.8 Hz
    assert re.search(r"2 +1794\.\d\d +1756\.\d\d +1833\.\d\d +± 2\.12", done.stdout)


@pytest.mark.slow
def test_gravity_wedging(tmp_path):
    arguments = ("--backlash", "482 um", "--harmonics", "3", "--no-stability", "--highest", "70")
    sweep = ("--sweep", "2", "--steps", "200")
    done = run("gravity_wedging.py", *arguments, *sweep, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    names = ("gravity_wedging", "carrier_orbit", "planet_bearings", "tooth_contact")
    assert all(is_png(tmp_path / f"{name}.png") for name in names)
    rows = text_table(tmp_path / "branches.csv")
    hertz = np.array([float(row["frequency [Hz]"]) for row in rows])
    # the branch turns back twice between its ends
    assert hertz[0] == 25.0 and hertz[-1] == 70.0 and np.sum(np.diff(np.sign(np.diff(hertz))) != 0) == 2
    assert {row["stable"] for row in rows} == {"not computed"}
    for row in text_table(tmp_path / "sweeps.csv"):
        sizes = [float(row[f"{way}, carrier x r.m.s. [m]"]) for way in ("integration", "harmonic balance")]
        assert row["settled"] == "yes" and sizes[0] == pytest.approx(sizes[1], rel=1e-3)


@pytest.mark.slow
def test_bearing_clearance(tmp_path):
    arguments = ("--clearance", "100 um", "--harmonics", "1", "--frequencies", "2", "--points", "3")
    done = run("bearing_clearance.py", *arguments, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert is_png(tmp_path / "ring_resonance.png") and is_png(tmp_path / "tooth_contact.png")
    rows = text_table(tmp_path / "ring_resonance.csv")
    peaks = {}
    for row in rows:
        size, hertz = float(row["ring x r.m.s. [m]"]), float(row["frequency [Hz]"])
        peaks[row["clearance"]] = max(peaks.get(row["clearance"], (0.0, 0.0)), (size, hertz))
    assert peaks["no bearing"][1] == pytest.approx(28.2, rel=0.03)
    assert peaks["clearance 100 um"][1] == pytest.approx(87.4, rel=0.03)
    back = table(tmp_path / "tooth_contact.csv")
    # 0.6, 1.2 and 1.8 times the play: only the last one wedges
    np.testing.assert_array_equal(back["back flanks in contact [1]"] > 0, [False, False, True] * 2)


def test_planet_phasing(tmp_path):
    done = run("planet_phasing.py", "--points", "300", "--distance", "1", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "30/20/70, 4 planets at 0, 90, 180, 270 deg" in done.stdout
    for name in ("phases.png", "resultants.png", "mesh_forces.png"):
        assert is_png(tmp_path / name)
    with open(tmp_path / "phasing.csv", newline="", encoding="utf-8") as stream:
        kinds = [row["phasing"] for row in csv.DictReader(stream)]
    assert kinds == ["counter-phased", "in-phase"] * 3
    with open(tmp_path / "mesh_forces.csv", newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["set"].startswith("counter-phased")]
    force = np.array([[float(row[f"harmonic {h} [N]"]) for h in (1, 3)] for row in rows])
    hertz = np.array([float(row["frequency [Hz]"]) for row in rows])
    # Kahraman (1994), case C: first and third harmonic peak at the planet mode of 9840 Hz, 5 % damping
    assert hertz[force.argmax(axis=0)] == pytest.approx([9840, 9840], abs=100)


@pytest.mark.slow
def test_planet_phasing_of_unequal_planets(tmp_path):
    angles = [word for value in (0, 75.6, 180, 255.6) for word in ("--angle", str(value))]
    teeth = ("--sun", "29", "--planet", "21", "--ring", "71", "--points", "20", "--harmonics", "2")
    done = run("planet_phasing.py", *teeth, *angles, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    # two opposite pairs with an odd sun: no torque at odd harmonics, no lateral force at even ones
    with open(tmp_path / "phasing.csv", newline="", encoding="utf-8") as stream:
        first, second = csv.DictReader(stream)
    assert first["torque, thrust"] == second["lateral force, tilting"] == "0.0000"
    assert float(first["lateral force, tilting"]) > 0.5 and float(second["torque, thrust"]) > 0.01


@pytest.mark.slow
def test_multistage_lists_the_readings_of_the_published_table(tmp_path):
    done = run("multistage.py", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert is_png(tmp_path / "published.png")
    assert re.search(r"N/m, 3 planets +last carrier free +1 +298\.1 +2771\.9 +7 of 16", done.stdout)
    rows = text_table(tmp_path / "published.csv")
    assert len(rows) == 2 * (17 + 16 + 21 + 20)


@pytest.mark.slow
def test_drivetrain_writes_spectra_and_pictures(tmp_path):
    settings = ["--duration", "3 s", "--rate", "4 kHz", "--balanced", "--no-sensitivity"]
    done = run("drivetrain.py", *settings, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"forces.csv", "transient_forces.png", "mesh_force_spectrum.png", "backlash.png"}
    assert "ratio of the radii 34.654" in done.stdout
    forces = table(tmp_path / "forces.csv")
    assert len(forces["time [s]"]) == 3001 and np.ptp(forces["rotor speed [rad/s]"]) < 1e-2


@pytest.mark.slow
def test_drivetrain_takes_a_case_of_its_own(tmp_path):
    own = ROOT / "cases" / "own_chain.toml"
    done = run("drivetrain.py", own, "--duration", "0.2 s", "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "pinion-wheel" in done.stdout and "ratio of the radii" not in done.stdout
    assert "contact loss: pinion-wheel parts first" in done.stdout and (tmp_path / "backlash.png").exists()
    done = run("drivetrain.py", CASE, "-o", tmp_path / "none", folder=tmp_path)
    assert done.returncode == 2 and "E-MODEL" in done.stderr and not (tmp_path / "none").exists()
