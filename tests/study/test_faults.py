"""All that is wrong with a command is told at once."""

from script_runs import run_femgear
from study.test_optimise import CASE, run


def test_all_faults_are_told_at_once(tmp_path):
    wrong = ("--goal", "noise", "--of", "smell", "--vary", "sun", "--limit", "3", "--samples", "0", "--positions", "4")
    done = run(CASE, *wrong, "--torque", "3 um", "-o", "out", folder=tmp_path)
    assert done.returncode == 2 and "7 problems" in done.stderr
    for key in ("--goal", "--of", "--vary", "--limit", "--samples", "--positions", "operation.torque"):
        assert f"{key}: " in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_all_faults_of_a_sweep_are_told_at_once(tmp_path):
    words = ("--over", "sun.teeth,planet.teeth=27,30", "--over", "sun.mass", "--of", "noise", "-o", "out")
    done = run_femgear("sweep", CASE, *words, folder=tmp_path)
    assert done.returncode == 2 and "3 problems" in done.stderr and done.stderr.count("remedy") == 3
    words = ("--over", "sun.teeth,sun.module=27/1 mm,30/1 kg", "--over", "sun.teeth=27,27", "-o", "out")
    done = run_femgear("sweep", CASE, *words, folder=tmp_path)
    assert done.returncode == 2
    for part in ("a key is given twice", "not a unit of length", "a value is given twice"):
        assert part in done.stderr
    assert list(tmp_path.iterdir()) == []
