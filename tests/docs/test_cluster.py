"""The Slurm script of docs/cluster.md asks for workers, and a sweep is computed by them."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest
from page_examples import read_page

ROOT = Path(__file__).resolve().parents[2]
SBATCH = """#!/bin/bash
cp "$1" "{folder}/job.sh"
setsid bash "{folder}/job.sh" >"{folder}/job.log" 2>&1 &
echo $! >"{folder}/job.pid"
echo "Submitted batch job 1"
"""
SCANCEL = """#!/bin/bash
echo "$1" >"{folder}/cancelled"
kill -- "-$(cat "{folder}/job.pid")"
"""


@pytest.mark.slow
def test_a_sweep_by_workers_that_slurm_starts(tmp_path):
    """sbatch and scancel are stand-ins that start the job on this machine and end it."""
    pytest.importorskip("dask_jobqueue")
    script = next(one for one in read_page("cluster.md")[1] if "SLURMCluster" in one)
    for large, small in (("cores=32, processes=32", "cores=2, processes=2"), ("jobs=4", "jobs=1")):
        assert script.count(large) == 1
        script = script.replace(large, small)
    (tmp_path / "script.py").write_text(script, encoding="utf-8")
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    (tmp_path / "bin").mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        program = tmp_path / "bin" / name
        program.write_text(text.replace("{folder}", str(tmp_path)), encoding="utf-8")
        program.chmod(0o755)
    programs = (str(tmp_path / "bin"), str(Path(sys.executable).parent), os.environ["PATH"])
    environment = os.environ | {"PATH": os.pathsep.join(programs), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "script.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    job = (tmp_path / "job.sh").read_text(encoding="utf-8")
    assert done.returncode == 0, done.stderr + (tmp_path / "job.log").read_text(encoding="utf-8")
    assert "#SBATCH --cpus-per-task=2" in job and "--nworkers 2 " in job
    assert "2 cases, 2 computed now, 0 cannot be computed" in done.stdout
    with open(tmp_path / "out" / "sweep" / "sweep.csv", encoding="utf-8") as file:
        assert len(list(csv.reader(file))) == 3
    assert (tmp_path / "cancelled").read_text(encoding="utf-8").strip() == "1"
