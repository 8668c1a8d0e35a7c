"""Every case file of cases/, by the command as users have it: nothing is patched, every run is a process of its own."""

import json
import os
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
