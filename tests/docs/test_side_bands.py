"""docs/side_bands.md: its examples print what it says."""

import csv
import re
import shlex

import pytest
from page_examples import ROOT, read_page, run_examples
from script_runs import run_script

from femgear import read_case
from femgear.case.gear_set import planetary_set
from femgear.gears.kinematics import speeds

PAGE, EXAMPLES, PRINTED = read_page("side_bands.md")


def test_example_prints_what_the_page_says():
    assert run_examples("side_bands.md", EXAMPLES[:1]) == PRINTED[:1]


def test_command_gives_the_table_of_the_page(tmp_path):
    (command,) = re.findall(r"^scripts/(side_bands\.py .+)$", PAGE, flags=re.MULTILINE)
    name, *words = shlex.split(command)
    words = [str(ROOT / word) if word.startswith("cases/") else word for word in words]
    done = run_script(name, *words, "-o", tmp_path / "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "lines.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    made = [
        f"| {float(row['order']):g} | {float(row['level [dB]']):.1f} | {float(row['array factor']):.3f} | "
        f"{row['verdict']} | {row['why']} |".replace("|  |", "| |")
        for row in rows
    ]
    shown = PAGE.split("| verdict | why |\n")[1].split("\n\n")[0].splitlines()[1:]
    assert shown == made
    assert "by chance in 28 % of cases at most" in done.stdout


@pytest.mark.slow
def test_errors_that_turn_make_the_orders_that_the_page_says():
    assert len(EXAMPLES) == 3 and run_examples("side_bands.md", EXAMPLES) == PRINTED


def test_orders_of_the_table_are_those_of_the_reference_set():
    """Turns in space of sun and planets, ring fixed, by the kinematics of the set."""
    gears = planetary_set(read_case(ROOT / "cases" / "planetary_27_40_108.toml"))
    one = speeds(gears, input="carrier", fixed="ring", speed=1.0)
    assert one.sun == pytest.approx(5.0) and abs(one.planet - one.carrier) == pytest.approx(2.7)
