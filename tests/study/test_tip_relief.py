"""femgear relief: what it writes is the case whose run shows the numbers that it prints."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from script_runs import run_femgear

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.gears.modifications import form_deviation
from femgear.stages.static import relief_kinks, solve_static
from femgear.study.relief import with_tip_relief
from femgear.study.tip_relief import with_relief_tables
from femgear.trains.reading import parse_case, read_case, with_value

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"


def relief(*arguments, folder):
    return run_femgear("relief", *arguments, folder=folder)


@pytest.fixture(scope="module")
def quick_case(tmp_path_factory):
    """The reference set on a coarse grid with few positions."""
    text = CASE.read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("case") / "quick.toml"
    path.write_text(text.replace("positions = 64", "positions = 8\nflank_elements = 8"), encoding="utf-8")
    return path


def printed_errors(text: str) -> np.ndarray:
    """Peaks to peaks of the optimum [um]: rows sun-planet, planet-ring, sun to ring; before and with the relief."""
    rows = re.findall(r"^ +(?:sun-planet|planet-ring|sun to ring) +([\d.]+) +([\d.]+)", text, flags=re.MULTILINE)
    return np.array(rows, float)


@pytest.mark.slow
def test_the_optimum_that_is_printed_is_that_of_a_run(quick_case, tmp_path):
    """The largest of all meshes of a kind, of the case that is written."""
    arguments = ("--points", "3", "--also", "60 N m", "--largest", "6 um", "--torque", "90 N m")
    done = relief(quick_case, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "tip_relief.png").stat().st_size > 5000
    with open(tmp_path / "out" / "tip_relief.csv", newline="", encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == 2 * 3 * 3
    written = read_case(tmp_path / "out" / "relief.toml")
    before = with_value(read_case(quick_case), "operation.torque", "90 N m")
    assert written.operation.torque == 90.0 and relief_kinks(written) == (False, False)
    runs = [solve_static(case).cycle for case in (before, written)]
    expected = [[*run.peak_to_peak().reshape(2, -1).max(axis=1), run.peak_to_peak("sun_arc")] for run in runs]
    assert printed_errors(done.stdout) == pytest.approx(1e6 * np.transpose(expected), abs=5.1e-5)
    # the tables that are shown are those of the case
    shown = re.findall(r"^ {2}(\S+) = (.+)$", done.stdout, flags=re.MULTILINE)
    assert dict(shown)["amount"] in (tmp_path / "out" / "relief.toml").read_text(encoding="utf-8")
    again = relief(quick_case, *arguments, "-o", "out", folder=tmp_path)
    assert again.stdout == done.stdout


def test_the_numbers_of_the_search_are_those_of_its_case(quick_case):
    """Of the written case to 1e-12; it rounds amounts to a nanometre and diameters to ten."""
    from femgear.study.relief import design_basis, harris_map, sun_torque

    case = read_case(quick_case)
    gears = planetary_set(case)
    relieved, _ = with_relief_tables(case, gears, amount=4.1e-6, length=0.9, shape="parabolic", back=False)
    basis, torque = design_basis(relieved), sun_torque(relieved, gears)
    map_ = harris_map(basis, torques=[torque], deviations=[basis.deviations])
    run = solve_static(relieved).cycle
    assert map_.peak_to_peak[0, :, 0] == pytest.approx(run.peak_to_peak().reshape(2, -1).max(axis=1), rel=1e-12)
    ideal = design_basis(case)
    of_form = [with_tip_relief(ideal.deviations, gears, amount=4.1e-6, length=0.9, power=2.0)]
    near = harris_map(ideal, torques=[torque], deviations=of_form)
    assert near.peak_to_peak == pytest.approx(map_.peak_to_peak, rel=1e-5)


@pytest.mark.slow
def test_a_helical_set_has_a_relief(tmp_path):
    """In slices, its numbers those of a run of the case that is written."""
    case = ROOT / "cases" / "helical_23_24_73.toml"
    text = case.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^slices = \d+", "slices = 9\nflank_elements = 6", text)
    (tmp_path / "case.toml").write_text(re.sub(r"(?m)^positions = \d+", "positions = 8", text), encoding="utf-8")
    arguments = ("--points", "3", "--largest", "3 um", "--also", "500 N m")
    done = relief("case.toml", *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    cycle = solve_static(read_case(tmp_path / "out" / "relief.toml")).cycle
    peaks = [*cycle.peak_to_peak().reshape(2, -1).max(axis=1), cycle.peak_to_peak("sun_arc")]
    assert printed_errors(done.stdout)[:, 1] == pytest.approx(1e6 * np.array(peaks), abs=5.1e-5)


@pytest.mark.slow
def test_the_optimum_of_a_coarse_map_has_no_way_down(quick_case, tmp_path):
    """The smallest amount of this map is 2.7 um, on which the simplex collapses; the valley is at 3.0 um."""
    arguments = ("--points", "3", "--positions", "32", "--largest", "8 um", "--also", "150 N m", "--shape", "linear")
    done = relief(quick_case, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    slopes = re.findall(r"([+-][0-9.]+) um per", done.stdout)
    assert len(slopes) == 4 and min(map(float, slopes)) >= 0
    assert "NOT A MINIMUM" not in done.stdout
    # as with twice and four times the positions
    before, after = printed_errors(done.stdout)[0]
    assert after / before == pytest.approx(0.142, rel=0.016)


@pytest.mark.slow
def test_a_relief_at_the_end_of_its_range_is_no_minimum(quick_case, tmp_path):
    arguments = ("--points", "3", "--largest", "1 um", "--also", "100 N m")
    done = relief(quick_case, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    assert "NOT A MINIMUM: amount" in text and "end of the range searched to more" in text


def test_the_tables_mean_the_same_relief():
    case = read_case(CASE)
    gears = planetary_set(case)
    made, tables = with_relief_tables(case, gears, amount=4e-6, length=0.9, shape="parabolic", back=False)
    pasted = parse_case(CASE.read_text(encoding="utf-8") + "\n" + tables)
    expected = with_tip_relief(None, gears, amount=4e-6, length=0.9, power=2.0)
    for read in (set_deviations(made), set_deviations(pasted)):
        for name, gear in (("sun", gears.sun), ("planet_sun_side", gears.planet)):
            roll = np.linspace(gear.form_roll, gear.tip_roll, 50)
            removed = [form_deviation(getattr(d, name), gear, roll) for d in (read, expected)]
            np.testing.assert_allclose(*removed, atol=1e-10)
            assert removed[0].max() == pytest.approx(4e-6, rel=1e-6)
        assert not read.planet_ring_side.modifications
    assert planetary_set(made) == gears


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--points", "1"], "3 to 100"),
        (["--largest", "2 mm"], "not a plausible relief"),
        (["--also=-50 N m"], "both signs"),
        (["--torque", "-100 N m", "--also", "50 N m"], "both signs"),
        (["--points", "1", "--largest", "2 mm", "--also", "3 um", "--positions", "2"], "4 problems"),
    ],
)
def test_bad_input_ends_in_a_message(arguments, message, tmp_path):
    done = relief(CASE, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 2 and message in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_pair_has_a_relief(tmp_path):
    words = ("--points", "3", "--positions", "8", "--largest", "30 um", "--also", "100 N m", "-o", "out")
    done = relief(ROOT / "cases" / "spur_pair.toml", *words, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    written = read_case(tmp_path / "out" / "relief.toml")
    (row,) = re.findall(r"^ +gear 1-gear 2 +([\d.]+) +([\d.]+)", done.stdout, flags=re.MULTILINE)
    assert float(row[1]) == pytest.approx(1e6 * solve_static(written).cycle.peak_to_peak()[0], abs=5.1e-5)
    assert float(row[1]) < 0.5 * float(row[0])
    done = relief(ROOT / "cases" / "own_chain.toml", *words, folder=tmp_path)
    assert done.returncode == 2 and "E-MODEL" in done.stderr and "remedy" in done.stderr
