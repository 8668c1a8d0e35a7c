"""femgear harris: what it writes, that its numbers are those of a run, and what it refuses."""

import csv
from pathlib import Path

import numpy as np
import pytest
from script_runs import run_femgear

from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
PAIR = ROOT / "cases" / "spur_pair.toml"


def harris(*arguments, folder):
    return run_femgear("harris", *arguments, folder=folder)


def table(path):
    """Columns of a CSV file by name."""
    with open(path, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


@pytest.fixture(scope="module")
def quick_case(tmp_path_factory):
    """The reference set on a coarse grid with few positions."""
    text = CASE.read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("case") / "quick.toml"
    path.write_text(text.replace("positions = 64", "positions = 16\nflank_elements = 8"), encoding="utf-8")
    return path


def test_a_relief_is_best_near_its_torque(quick_case, tmp_path):
    arguments = ("--relief", "0 um", "--relief", "4 um", "--length", "0.9", "--shape", "linear")
    torques = [word for value in (50, 100, 200) for word in ("--torque", f"{value} N m")]
    done = harris(quick_case, *arguments, *torques, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "harris_map.png").stat().st_size > 5000
    curve = table(tmp_path / "out" / "harris_map.csv")["sun-planet STE peak to peak [m]"].reshape(2, 3)
    # a relief for 100 N m: less there than at half and at twice the torque, and than without it
    assert curve[1].argmin() == 1 and np.all(np.diff(curve[0]) > 0)
    assert curve[1, 1] < 0.35 * curve[0, 1]


@pytest.mark.slow
def test_one_negative_torque(quick_case, tmp_path):
    arguments = ("--relief", "0 um", "--relief", "4 um", "--positions", "8")
    peaks = []
    for number, torques in enumerate((("-100 N m", "-100 N m"), ("100 N m",))):
        words = [word for torque in torques for word in ("--torque", torque)]
        done = harris(quick_case, *arguments, *words, "-o", f"out{number}", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        (header,) = (line for line in done.stdout.splitlines() if "relief [um]" in line)
        assert header.count("N m") == 1 and torques[0] in header
        peaks.append(table(tmp_path / f"out{number}" / "harris_map.csv")["sun-planet STE peak to peak [m]"])
    np.testing.assert_allclose(*peaks, rtol=1e-9)


@pytest.mark.parametrize(
    "values",
    [
        {"static.members": "elastic", "planet.bearing_clearance": "2 um"},
        pytest.param({"set.helix_angle": "10 deg", "static.slices": 9}, marks=pytest.mark.slow),
        pytest.param(
            {"static.back_flanks": True, "sun.errors": {"runout_amplitude": "3 um"}, "static.longest_record": 2},
            marks=pytest.mark.slow,
        ),
        pytest.param({"static.slices": 9, "static.members": "elastic"}, marks=pytest.mark.slow),
    ],
    ids=["bearing clearance", "helical", "back flanks and runout", "slices"],
)
def test_without_relief_the_numbers_are_those_of_a_run(values, quick_case, tmp_path):
    """At every kind of contact that a run solves."""
    helical = "set.helix_angle" in values
    source = ROOT / "cases" / "helical_23_24_73.toml" if helical else quick_case
    more = {"static.slices": 12, "static.positions": 8, "static.flank_elements": 6} if helical else values
    case = with_values(read_case(source), {"static.positions": 8, **more})
    path = tmp_path / "case.toml"
    path.write_text(case.source, encoding="utf-8")
    torque = f"{case.operation.torque!r} N m"
    done = harris(path, "--relief", "0 um", "--torque", torque, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    run = solve_static(case).cycle
    found = table(tmp_path / "out" / "harris_map.csv")
    kinds = run.peak_to_peak().reshape(2, -1).max(axis=1)
    for name, expected in zip(("sun-planet", "planet-ring"), kinds, strict=True):
        assert found[f"{name} STE peak to peak [m]"][0] == pytest.approx(expected, rel=1e-8)
    assert found["sun-ring STE peak to peak [m]"][0] == pytest.approx(run.peak_to_peak("sun_arc"), rel=1e-8)


@pytest.mark.slow
def test_a_map_goes_on_from_its_journal(quick_case, tmp_path):
    arguments = ("--relief", "0 um", "--relief", "4 um", "--torque", "100 N m", "--positions", "8", "-o", "out")
    first = harris(quick_case, *arguments, folder=tmp_path)
    journal = tmp_path / "out" / "harris.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-1]) + lines[-1][:40])
    again = harris(quick_case, *arguments, folder=tmp_path)
    assert (first.returncode, again.returncode) == (0, 0) and again.stdout == first.stdout
    assert journal.read_bytes() == b"".join(lines)
    other = harris(quick_case, *arguments[:-4], "--positions", "9", "-o", "out", folder=tmp_path)
    assert other.returncode == 4 and "E-JOURNAL" in other.stderr


def test_pairs_have_maps(tmp_path):
    words = ("--relief", "0 um", "--torque", "200 N m", "--positions", "8", "-o", "out")
    assert harris(PAIR, *words, folder=tmp_path).returncode == 0
    assert len(table(tmp_path / "out" / "harris_map.csv")) == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--relief=-1 um"], "not a plausible relief"),
        (["--relief", "1 um", "--relief", "0.001 mm"], "given twice"),
        (["--torque", "0 N m"], "without torque"),
        (["--length", "3"], "0.05 to 2.816"),
        (["--torque", "-100 N m", "--torque", "50 N m"], "both signs"),
        (["--positions", "2"], "--positions"),
        (["--relief", "4", "--length", "3", "--torque", "3 um", "--positions", "2"], "4 problems"),
    ],
)
def test_bad_input_ends_in_a_message(arguments, message, tmp_path):
    done = harris(CASE, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 2 and message in done.stderr and "remedy" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_files_of_others_are_left_alone(tmp_path):
    (tmp_path / "harris_map.csv").write_text("theirs")
    done = harris(CASE, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 4 and "E-OUTPUT" in done.stderr
    assert (tmp_path / "harris_map.csv").read_text() == "theirs"
