"""femgear optimise: what it writes, how it goes on, and what it refuses."""

import csv
import random
import re
import signal
from pathlib import Path

import pytest
from script_runs import run_femgear, wait_for_lines
from small_gearbox import pair_tables

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.stages.static import relief_kinks, solve_static, solve_stress
from femgear.study.problem import tip_reliefs
from femgear.trains.live import Answer
from femgear.trains.reading import read_case
from validation.soak import programs

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"


def run(*arguments, folder):
    return run_femgear("optimise", *arguments, folder=folder)


@pytest.fixture
def gears(tmp_path):
    """A search over the planet's shift, which needs no finite elements; the limit stops it."""
    text = CASE.read_text(encoding="utf-8").replace("profile_shift = 0.52681\n", "")
    lines = [line for line in text.splitlines() if not line.startswith("profile_shift = 0.0         #")]
    lines = [line for line in lines if not line.startswith("tip_diameter")]
    case = tmp_path / "case.toml"
    case.write_text("\n".join(lines), encoding="utf-8")
    return [
        case,
        *("--vary", "planet.profile_shift=-0.05..0.25 +- 0.01", "--goal", "tip thickness planet"),
        *("--limit", "tip thickness planet >= 0.74", "--no-check", "--of", "contact ratio sun-planet"),
    ]


def test_a_search_of_the_gears_and_its_continuation(gears, tmp_path):
    arguments = [*gears, "--method", "simplex", "-o", tmp_path / "out"]
    done = run(*arguments, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "optimum.csv", newline="", encoding="utf-8") as stream:
        rows = {row["quantity"]: row for row in csv.DictReader(stream)}
    thickness = float(rows["tip thickness over module, planet"]["optimum"])
    assert 0.74 <= thickness < 0.7402 and "contact ratio, sun-planet" in rows
    best = read_case(tmp_path / "out" / "optimum.toml")
    assert 0.15 < best.planet.profile_shift < 0.25 and best.static.positions == 64
    assert (tmp_path / "out" / "tolerances.png").stat().st_size > 5000
    again = run(*arguments, folder=tmp_path)
    assert again.returncode == 0 and ", 0 computed now" in again.stdout
    other = run(*arguments, "--torque", "50 N m", folder=tmp_path)
    assert other.returncode == 4 and "E-JOURNAL" in other.stderr


@pytest.mark.slow
def test_a_search_that_is_killed_goes_on_with_the_same_command(gears, tmp_path):
    """By SIGTERM and kill -9 at random lines: the same files, nothing computed twice."""
    words = ["optimise", *gears, "--method", "global", "--samples", "20"]
    words += ["--max-designs", "60", "-o"]
    alone = programs.start([*words, "alone"], tmp_path).wait()
    assert alone.code == 0, alone.err
    folder, lines, chance = tmp_path / "killed", 1, random.Random(0)
    journal = folder / "journal.jsonl"
    for way in (signal.SIGTERM, signal.SIGKILL):
        lines += chance.randrange(5, 20)
        run = programs.start([*words, "killed"], tmp_path)
        wait_for_lines(journal, lines, run)
        run.kill(way)
        ended = run.wait()
        assert ended.code == (-9 if way == signal.SIGKILL else 130) and not ended.crash
        assert ("the same command goes on" in ended.err) == (way == signal.SIGTERM)
        lines = journal.read_bytes().count(b"\n")
    last = programs.start([*words, "killed"], tmp_path).wait()
    assert last.code == 0 and "warning" not in last.err
    whole = (tmp_path / "alone" / "journal.jsonl").read_bytes().count(b"\n")
    assert int(re.search(r"search: .*?(\d+) computed now", last.out)[1]) <= whole - lines
    for name in ("optimum.toml", "optimum.csv", "tolerances.png"):
        assert (folder / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    for name in ("journal.jsonl", "journal_fine.jsonl"):
        texts = [(one / name).read_text() for one in (folder, tmp_path / "alone")]
        # what each design took is no result
        first, second = (re.sub(r', "seconds".*', "", text) for text in texts)
        assert first == second


@pytest.mark.slow
def test_the_optimum_that_is_printed_is_that_of_a_run(tmp_path):
    """Errors, pressure and root stress of optimum.csv are those of a run of optimum.toml."""
    text = CASE.read_text(encoding="utf-8").replace("positions = 64", "positions = 12\nflank_elements = 6")
    case = tmp_path / "case.toml"
    tables = '\n[[sun.modifications]]\nkind = "tip relief"\namount = "1 um"\nstart_diameter = "42.4 mm"\n'
    case.write_text(text + tables + 'shape = "parabolic"\n', encoding="utf-8")
    of = "ste overall", "ste planet-ring", "contact pressure", "root stress sun", "root stress planet"
    done = run(
        case,
        "--vary",
        "sun.modifications[0].amount=0 um..8 um +- 1 um",
        "--goal",
        "ste sun-planet",
        *(word for name in of for word in ("--of", name)),
        "--samples",
        "2",
        "--max-designs",
        "4",
        "--positions",
        "8",
        "--flank-elements",
        "4",
        "--no-check",
        "-o",
        tmp_path / "out",
        folder=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "optimum.csv", newline="", encoding="utf-8") as stream:
        printed = [float(row["optimum"]) for row in csv.DictReader(stream)]
    best = read_case(tmp_path / "out" / "optimum.toml")
    static = solve_static(best)
    errors, stress = static.dataset(), solve_stress(best, static).dataset()
    kinds = errors["ste_peak_to_peak"].values.reshape(2, -1).max(axis=1)
    root = stress["root_worst"].values.reshape(2, -1, 2).max(axis=1)
    expected = [
        kinds[0],
        errors["ste_overall_peak_to_peak"].values.max(),
        kinds[1],
        stress["largest_pressure"].values.max(),
        root[0, 0],
        max(root[0, 1], root[1, 0]),
    ]
    assert printed == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--vary", "sun.module"], "not a design variable"),
        (["--vary", "sun.modul=1 mm..2 mm"], "sun.modul"),
        (["--vary", "sun.mass=1 mm..2 mm"], "not a unit of mass"),
        (["--goal", "noise"], "no such quantity"),
        (["--limit", "root stress sun < 3"], "not a limit"),
        (["--method", "magic"], "magic"),
        (["--speeds", "3500 rpm", "1000 rpm"], "not a range of speeds"),
        (["--positions", "4"], "static.positions"),
        (["--samples", "0"], "--samples"),
        (["--torque", "0 N m"], "without torque"),
        ([str(ROOT / "cases" / "nrel_pgb.toml")], "planar.mesh_stiffness"),
    ],
)
def test_bad_input_ends_in_a_message(arguments, message, tmp_path):
    case = () if str(arguments[0]).endswith(".toml") else (CASE,)
    done = run(*case, *arguments, "-o", "out", folder=tmp_path)
    assert done.returncode == 2 and message in done.stderr and "remedy" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_reliefs_have_the_shape_that_the_verdict_advises(tmp_path):
    case, _ = tip_reliefs(read_case(CASE))
    kinked, _ = tip_reliefs(read_case(CASE), shape="linear")
    assert relief_kinks(case) == (False, False) and relief_kinks(kinked) == (True, True)


@pytest.mark.slow
def test_a_gearbox_is_searched_among_its_key_figures_and_checked_by_runs(tmp_path):
    case, out = tmp_path / "box.toml", tmp_path / "out"
    case.write_text(case_text.write(pair_tables()), encoding="utf-8")
    # the nearer bearing A is to the gear at 30 mm, the less is left for B
    arguments = [case, "--vary", "bearing[0].position=5 mm..20 mm +- 0.5 mm", "--goal", "bearing force B", "-o", out]
    done = run(*arguments, "--of", "natural frequency 2", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    best = read_case(out / "optimum.toml")
    assert best.bearing[0].position == pytest.approx(20e-3, rel=2e-3)
    with open(out / "check.csv", newline="", encoding="utf-8") as stream:
        rows = {row["quantity"]: row for row in csv.DictReader(stream)}
    force = Answer(best, Steps()).deflection.contents()["radial_force"].values[0, 1]
    assert float(rows["bearing force B"]["optimum"]) == pytest.approx(force, rel=1e-6)
    assert force < 0.6 * float(rows["bearing force B"]["before"])
    again = run(*arguments, "--of", "natural frequency 2", folder=tmp_path)
    assert again.returncode == 0 and ", 0 computed now" in again.stdout
    none = run(case, "--torque", "3 N m", "-o", tmp_path / "none", folder=tmp_path)
    assert none.returncode == 2 and {"--goal", "--vary", "--torque"} <= {*re.findall(r"--\w+", none.stderr)}
