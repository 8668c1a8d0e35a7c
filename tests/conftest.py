"""Makes the modules that several tests share, and those of scripts, importable by name; shared fixtures."""

import contextlib
import gc
import importlib.util
import io
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

# before NumPy is loaded, as the Makefile has it: threads of BLAS and workers of pytest would share the cores
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# workers of pytest have one for their own lines; tables of tests are as wide as in a file
os.environ.pop("COLUMNS", None)

# a shell starts what goes on in the background deaf to Ctrl-C, which many tests send
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# every full collection walks all that hundreds of test modules hold
gc.set_threshold(100_000, 20, 100)

# the default of 1e-12 is as large as many a compliance in m/N: an expected zero states its own tolerance
type(pytest.approx(1.0)).DEFAULT_ABSOLUTE_TOLERANCE = 0.0
if pytest.approx(1e-20) == 2e-20:
    raise pytest.UsageError("this pytest keeps the absolute tolerance of approx elsewhere: see tests/conftest.py")

TESTS = Path(__file__).parent


def _draw_from_no_source():
    """Let tests draw numbers from the ranges that they name, and read no source for the numbers in it.

    Hypothesis parses all modules of the package and of the tests, for which each worker needs five seconds in a new
    clone. `make validate` draws from them too.
    """
    from hypothesis.internal.conjecture import providers

    if not callable(getattr(providers, "is_local_module_file", None)):
        raise pytest.UsageError("this Hypothesis looks for numbers of modules elsewhere: see tests/conftest.py")
    providers.is_local_module_file = lambda path: False


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items, config):
    """Mark tests slow whose lines quicker ones run too, by the list of validation/tools/slow_tests.py."""
    if "hypothesis" in sys.modules and config.option.markexpr.startswith("not slow"):
        _draw_from_no_source()
    listed = set((TESTS / "slow_tests.txt").read_text(encoding="utf-8").split("\n"))
    for item in items:
        if item.nodeid in listed and not item.get_closest_marker("decisive"):
            item.add_marker("slow")


def pytest_collection_finish():
    """Test modules stay: no collection need walk them again."""
    gc.freeze()


ROOT = TESTS.parent
sys.path[:0] = [str(TESTS), str(ROOT / "scripts"), str(ROOT)]

from computed_once import kept  # noqa: E402
from small_systems import chain_excitation, geared_chain, planet_excitation, planet_set  # noqa: E402, F401


@pytest.fixture(scope="session")
def folder_of_both_workers(tmp_path_factory):
    """Folder of what the workers of one session compute once for both, or None in a session of one process.

    Nothing is shared there, so that validation/tools/mutation.py sees which test runs which line.
    """
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return None
    # the folder of a worker stands in that of the session
    folder = tmp_path_factory.getbasetemp().parent / "computed_once"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """Some hundred megabytes for each of the sessions whose folders pytest keeps would be left."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        base = session.config._tmp_path_factory.getbasetemp()
        shutil.rmtree(base / "computed_once", ignore_errors=True)
    # pytest collects five times more, for what finalizers say: the first one has all of it
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def bodies_are_computed_once(folder_of_both_workers):
    """A third of these are computed for several tests. What a test itself imports is as it is."""
    from femgear.contact import bodies, width_waves
    from femgear.stages import static as stages

    with pytest.MonkeyPatch.context() as patch:
        for module, name in (
            (bodies, "stiffness"),
            (bodies, "flank_compliance"),
            (width_waves, "condensed_waves"),
            (stages, "root_stress_influence"),
            (stages, "root_waves"),
        ):
            patch.setattr(module, name, kept(getattr(module, name), folder_of_both_workers))
        yield


@pytest.fixture(scope="session", autouse=True)
def gmsh_is_loaded_once(folder_of_both_workers):
    """The worker of Gmsh runs within the tests: to start a process takes ten times as long as a grid.

    tests/fe/test_meshing.py has the process back.
    """
    from femgear.fe import meshing

    spec = importlib.util.spec_from_file_location("gmsh_worker", meshing.WORKER)
    worker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(worker)
    # Gmsh has one global model
    one_at_a_time = threading.Lock()

    def answer(words):
        said, output = io.StringIO(), io.BytesIO()
        with one_at_a_time, contextlib.redirect_stderr(said):
            code = worker.answer(io.BytesIO(words), output)
            if hasattr(signal, "alarm"):
                signal.alarm(0)
        return code, output.getvalue(), said.getvalue().encode()

    answer = kept(answer, folder_of_both_workers)

    class Within:
        TimeoutExpired = subprocess.TimeoutExpired

        @staticmethod
        def run(command, *, input, **_):
            return subprocess.CompletedProcess(command, *answer(input))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(meshing, "subprocess", Within)
        yield


@pytest.fixture(scope="session", autouse=True)
def everything_is_done_here():
    """Workers of pytest take all cores, and what a copy of the process does is not seen to have run."""
    from femgear import second_process

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(second_process, "second_core", lambda: False)
        yield


@pytest.fixture(scope="module")
def pictures_undrawn():
    """Figures are made, and their files written, but nothing is drawn, for files whose tests look at no picture."""
    from PIL import Image

    from femgear.report import page, style

    stream = io.BytesIO()
    Image.new("L", (1, 1)).save(stream, "png")
    with pytest.MonkeyPatch.context() as patch:
        for module in (style, page):
            patch.setattr(module, "png_bytes", lambda figure: stream.getvalue())
        yield


@pytest.fixture(scope="module")
def coarse_states():
    """Loaded states of few positions without a search for peaks between them.

    For files whose tests compare runs, whatever the numbers.
    """
    from femgear.contact import cycle, loaded_period

    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("SHORTEST", 0.02), ("SMOOTHEST", 0.05), ("STEEP", 0.2), ("MISSED", 0.05)):
            patch.setattr(loaded_period, name, value)
        for name, value in (("FEWEST", 1), ("MOST_ROUNDS", 0)):
            patch.setattr(cycle, name, value)
        yield
