"""A train is one folder and one line in the registry: an oscillator with its own case file."""

import json
import os
import subprocess
import sys

import pytest
from oscillator.stages import OSCILLATOR

from femgear import cli, open_results, read_case, solve, with_value
from femgear.errors import CaseError
from femgear.trains import registry

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

TEXT = """model = "oscillator"
title = "A mass on a spring"

[oscillator]
mass = "2 kg"
stiffness = "0.8 N/um"
"""


@pytest.fixture
def path(tmp_path, monkeypatch):
    oscillator = registry.Known("oscillator", "model", "oscillator.section:FILE", "oscillator.stages:OSCILLATOR")
    monkeypatch.setattr(registry, "TRAINS", (oscillator, *registry.TRAINS))
    path = tmp_path / "oscillator.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_case_is_read_changed_and_checked(path, capsys):
    case = read_case(path)
    assert case.oscillator.stiffness == 8e5 and registry.train_of(case) is OSCILLATOR
    assert with_value(case, "oscillator.mass", "3 kg").oscillator.mass == 3.0
    assert cli.main(["check", str(path)]) == 0
    assert "A mass on a spring" in capsys.readouterr().out
    path.write_text(TEXT.replace("mass =", "mas ="), encoding="utf-8")
    assert cli.main(["check", str(path)]) == 2
    assert "oscillator.toml:5: oscillator.mas" in (said := capsys.readouterr().err) and "did you mean mass?" in said


def test_schema_is_that_of_its_model(path, capsys):
    assert cli.main(["schema", "--model", "oscillator"]) == 0
    assert "OscillatorSection" in json.loads(capsys.readouterr().out)["$defs"]
    assert cli.main(["schema", "--model", "pendulum"]) == 2
    assert "oscillator" in capsys.readouterr().err


def test_run_writes_stages_figure_and_page(path, tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["run", str(path), "-o", str(out)]) == 0
    assert "100.658" in capsys.readouterr().out
    results = open_results(out)
    assert results.stages == ("modes", "receptance") and results.case.title == "A mass on a spring"
    # 1 / (2 zeta k) at resonance
    assert float(results["receptance"]["receptance"].max()) == pytest.approx(1 / (0.04 * 8e5), rel=1e-3)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert '<details id="receptance"' in page and "Displacement of the mass for a unit force." in page
    assert "receptance.png" in results.manifest.files
    assert cli.main(["run", str(path), "-o", str(tmp_path / "one"), "--only", "receptance"]) == 0
    assert cli.main(["run", str(path), "-o", str(tmp_path / "no"), "--only", "housing"]) == 2
    assert "no stage of an oscillator" in capsys.readouterr().err


def test_stages_are_solved_in_memory(path):
    said = []
    results = solve(read_case(path), progress=lambda *one: said.append(one))
    assert list(results) == ["modes", "receptance"] and said[-1] == ("receptance", 1, 1)
    assert results["receptance"].dataset()["receptance"].max() == pytest.approx(1 / (0.04 * 8e5), rel=1e-3)
    assert repr(results) == "<Solution: modes, receptance>"
    with pytest.raises(KeyError, match="'housing' was not computed: there are modes, receptance"):
        results["housing"]
    with pytest.raises(CaseError, match="a case is needed, not a text"):
        solve(str(path))
    assert list(solve(read_case(path), "modes")) == ["modes"]
    with pytest.raises(CaseError, match="no stage of an oscillator"):
        solve(read_case(path), "housing")


def test_rounds_of_a_stage_are_counted_on():
    from femgear.stages.protocol import counting_on

    seen = []
    tell = counting_on(lambda *step: seen.append(step), "modes")
    # a second process takes parts from the end; a round may be given up before its end
    for done, total in [(0, 9), (3, 9), (9, 9), (6, 9), (0, 4), (1, 4), (0, 4), (4, 4)]:
        tell(done, total)
    assert seen == [("modes", *step) for step in [(3, 9), (9, 9), (9, 9), (10, 13), (14, 14)]]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc for the memory in use")
def test_blas_that_finds_no_more_memory_does_not_hang():
    program = """
import resource
import numpy as np
from scipy.linalg import solve_triangular
from femgear.stages.protocol import one_blas_thread
with one_blas_thread():
    used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**24, resource.RLIM_INFINITY))
    print(solve_triangular(np.eye(200), np.ones((200, 3))).sum(), (np.eye(200) @ np.eye(200)).sum())
"""
    options = {"capture_output": True, "text": True, "timeout": 20, "check": True}
    done = subprocess.run([sys.executable, "-c", program], **options)
    assert done.stdout.split() == ["600.0", "200.0"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads a copy of the BLAS by its name")
def test_libraries_that_are_loaded_later_have_one_thread_too(tmp_path):
    """SciPy's BLAS comes with the first limit; a module that comes later may bring another."""
    program = """
import ctypes, shutil, sys
from threadpoolctl import threadpool_info
from femgear.stages.protocol import one_blas_thread

def libraries():
    found = [one for one in threadpool_info() if one["user_api"] == "blas"]
    print(*(one["num_threads"] for one in found))
    return [one["filepath"] for one in found]

with one_blas_thread():
    path, *_ = libraries()
sys.modules["late"] = ctypes.CDLL(shutil.copy(path, sys.argv[1]))
with one_blas_thread():
    libraries()
with one_blas_thread():
    libraries()
libraries()
"""
    options = {"capture_output": True, "text": True, "timeout": 20, "check": True}
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    command = [sys.executable, "-c", program, str(tmp_path)]
    first, *limited, free = subprocess.run(command, env=environment, **options).stdout.splitlines()
    # one of NumPy, one of SciPy
    assert first == "1 1" and limited == ["1 1 1"] * 2
    assert free.split() == [str(min(2, os.cpu_count() or 1))] * 3
