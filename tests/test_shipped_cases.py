"""Every case file of cases/, by the command as users have it: nothing is patched, every run is a process of its own."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from femgear.storage.files import read_dataset

CASES = sorted((Path(__file__).parents[1] / "cases").glob("*.toml"))
ENVIRONMENT = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def femgear(*words):
    command = [sys.executable, "-m", "femgear.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=1200)


QUICK = ("spur_pair", "published_four_stages")
LONGER = ("helical_30_20_70", "own_chain")
"""Cases whose run takes few seconds without pictures, and those that take more."""
SCREEN = 45
"""Lines of 80 columns that a run without --verbose has at most."""


def lines_on_a_terminal(case, out, *options):
    """What a run leaves on a terminal of 80 columns."""
    words = ("run", case, "-o", out, *options)
    command = [sys.executable, "-m", "femgear.cli", *map(str, words)]
    terminal = {"TTY_COMPATIBLE": "1", "TTY_INTERACTIVE": "0", "COLUMNS": "80", "NO_COLOR": "1"}
    said = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT | terminal, timeout=1200)
    assert said.returncode == 0, said.stderr
    return re.sub("\x1b\\[[^a-zA-Z]*[a-zA-Z]", "", said.stdout + said.stderr).splitlines()


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in LONGER)])
def test_a_run_is_told_on_one_screen(name, tmp_path):
    case = CASES[0].parent / f"{name}.toml"
    lines = lines_on_a_terminal(case, tmp_path / "run", "--no-pictures")
    text = "".join(lines)
    assert len(lines) <= SCREEN and max(map(len, lines)) <= 80 + len(str(tmp_path)), lines
    assert "Can the numbers be relied on?" in text and "results: " in text


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.stem)
def test_runs_as_a_user_runs_it(case, tmp_path):
    """To the end, with all pictures and the page; what `check` lets through, no fault, and numbers everywhere."""
    said = femgear("check", case)
    assert said.returncode == 0, said.stderr
    said = femgear("run", case, "-o", tmp_path / "run")
    assert said.returncode == 0, said.stderr
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["complete"] and (tmp_path / "run" / "report.html").stat().st_size > 100_000
    assert [one for one in manifest["findings"] if one["severity"] == "fault"] == []
    for stage in manifest["timings"].keys() - {"pictures"}:
        with read_dataset(tmp_path / "run" / f"{stage}.nc") as data:
            numbers = [name for name, one in data.data_vars.items() if one.dtype.kind == "f"]
            # lives of what no load harms have no end, and say so
            ended = [name for name in numbers if "infinite" not in data[name].attrs.get("long_name", "")]
            assert ended and [name for name in ended if np.isinf(data[name]).any()] == []
    again = femgear("report", tmp_path / "run")
    assert again.returncode == 0, again.stderr
