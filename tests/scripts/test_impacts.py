"""scripts/impacts.py: what it writes, and that bad input ends in a message."""

import csv

import pytest
from script_runs import run_script

pytestmark = pytest.mark.usefixtures("pictures_undrawn")


def run(*arguments, folder):
    return run_script("impacts.py", *arguments, folder=folder)


@pytest.mark.slow
def test_quick_studies(tmp_path):
    options = ("--study", "chaos", "--study", "eccentricity", "--ratios", 3, "--points", 10)
    done = run(*options, "--frequencies", 2, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    for name in ("chaos", "sections", "eccentricity", "sun_path", "spectrum"):
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    with open(tmp_path / "chaos.csv", newline="", encoding="utf-8") as stream:
        rows = {float(row["frequency ratio [1]"]): row for row in csv.DictReader(stream)}
    assert sorted(rows) == pytest.approx([1.0, 1.6, 2.2])
    assert float(rows[1.6]["largest exponent [omega_n]"]) > 0.05
    # complex multipliers: half the trace of the damping, -zeta omega_n
    assert float(rows[2.2]["largest exponent [omega_n]"]) == pytest.approx(-0.05, abs=0.01)
    with open(tmp_path / "eccentricity.csv", newline="", encoding="utf-8") as stream:
        size = {(r["case"], float(r["mesh frequency [Hz]"])): float(r["amplitude [N]"]) for r in csv.DictReader(stream)}
    assert size["held sun, E = 15 µm", 400.0] > 10.0 * size["floating sun, E = 15 µm", 400.0]


@pytest.mark.parametrize("arguments", [("--study", "tides"), ("--ratios", 2), ("--harmonics", 0)])
def test_wrong_options_end_in_a_message(tmp_path, arguments):
    done = run(*arguments, "-o", tmp_path, folder=tmp_path)
    assert done.returncode == 2 and "E-RANGE" in done.stderr and "Traceback" not in done.stderr
