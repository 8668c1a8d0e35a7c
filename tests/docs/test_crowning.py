"""The table of docs/crowning.md is what the script computes, and the script on a small case."""

import csv
import re
import runpy
from pathlib import Path

import pytest
from script_runs import run_script

from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).parents[2]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
PAGE = (ROOT / "docs" / "crowning.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in re.findall(r"(?m)^\| −.*$", PAGE)]


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "scripts"))
        yield runpy.run_path(str(ROOT / "scripts" / "lead_design.py"))


@pytest.mark.slow
def test_rows_of_the_table(script):
    """The load is least between neighbours of the best crowning, and the rule of ISO is hardly worse."""
    state = script["in_slices"](with_values(read_case(CASE), {"static.slices": 25}), 8)

    def factor(slope, crowning):
        return state(100.0, slope, crowning)[0]

    for row in ROWS[:3]:
        found = max(factor(slope, float(row[2])) for slope in (-10.0, 10.0))
        assert found == pytest.approx(float(row[3]), abs=2e-3)
    least, rule = float(ROWS[2][3]), float(ROWS[1][3])
    assert min(factor(10.0, crowning) for crowning in (3.0, 6.0)) > least
    assert rule == pytest.approx(least, rel=5e-3)


@pytest.mark.slow
def test_the_script_on_a_small_case(tmp_path):
    text = CASE.read_text(encoding="utf-8").replace("positions = 64", "positions = 16\nflank_elements = 8")
    (tmp_path / "small.toml").write_text(text, encoding="utf-8")
    options = "--points", 3, "--positions", 4, "--slices", 9, "--misalignment", -8, 8
    done = run_script("lead_design.py", "small.toml", *options, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "lead_design.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 4 * 3 * 3
    table = re.findall(r"(?m)^ +(unmodified|ISO 6336-1|crowning.*?) {2,}([\d.]+) +([\d.]+) +([\d.]+)", done.stdout)
    (plain, rule, alone, both) = (float(row[3]) for row in table)
    assert both <= alone <= rule < 0.8 * plain
    amount = re.search(r'amount = "([\d.]+) um"', (tmp_path / "out" / "lead.toml").read_text())
    assert float(amount[1]) == pytest.approx(float(table[3][1]), abs=0.006)
    bad = run_script("lead_design.py", "small.toml", "--misalignment", 8, -8, folder=tmp_path)
    assert bad.returncode == 2 and "E-RANGE" in bad.stderr
