"""What scripts/planet_phasing.py refuses and remarks on."""

import pytest
from script_runs import run_script


def run(folder, *arguments):
    return run_script("planet_phasing.py", *arguments, folder=folder)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--sun", "70", "--ring", "30"), "E-RANGE"),
        (("--planet", "5"), "20 teeth close this set"),
        (("--planets", "100"), "overlap by"),
        (("--harmonics", "1000000"), "1 to 100 harmonics"),
    ],
)
def test_impossible_sets_end_in_a_message(tmp_path, arguments, words):
    done = run(tmp_path, *arguments)
    assert done.returncode == 2 and words in done.stderr + done.stdout
    assert "Traceback" not in done.stderr and list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_sets_that_need_shifts_are_remarked_on_above_the_tables(tmp_path):
    done = run(tmp_path, "--planet", "19", "--points", "20", "--distance", "1", "-o", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert done.stdout.index("remark: z_r - z_s - 2 z_p = 2") < done.stdout.index("30/19/70, 4 planets")
