"""Makes the modules that several tests share, and those of scripts, importable by name; shared fixtures."""

import contextlib
import gc
import importlib.util
import io
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

# before NumPy is loaded, as the Makefile has it: threads of BLAS and workers of pytest would share the cores
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# every full collection walks all that hundreds of test modules hold
gc.set_threshold(100_000, 20, 100)

# the default of 1e-12 is as large as many a compliance in m/N: an expected zero states its own tolerance
type(pytest.approx(1.0)).DEFAULT_ABSOLUTE_TOLERANCE = 0.0
if pytest.approx(1e-20) == 2e-20:
    raise pytest.UsageError(
        "this pytest keeps the absolute tolerance of approx elsewhere: see tests/conftest.py"
    )

TESTS = Path(__file__).parent

sys.path[:0] = [str(TESTS), str(TESTS.parent / "scripts")]

from small_systems import chain_excitation, geared_chain, planet_excitation, planet_set  # noqa: E402, F401


@pytest.fixture(scope="session", autouse=True)
def gmsh_is_loaded_once():
    """The worker of Gmsh runs within the tests: to start a process takes ten times as long as a grid.

    tests/fe/test_meshing.py has the process back.
    """
    from femgear.fe import meshing

    spec = importlib.util.spec_from_file_location("gmsh_worker", meshing.WORKER)
    worker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(worker)
    # Gmsh has one global model
    one_at_a_time = threading.Lock()

    class Within:
        TimeoutExpired, DEVNULL = subprocess.TimeoutExpired, subprocess.DEVNULL

        @staticmethod
        def run(command, **_):
            said = io.StringIO()
            with one_at_a_time, contextlib.redirect_stderr(said):
                code = worker.main(*command[-2:])
                if hasattr(signal, "alarm"):
                    signal.alarm(0)
            return subprocess.CompletedProcess(command, code, "", said.getvalue())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshing, "subprocess", Within)
        yield
