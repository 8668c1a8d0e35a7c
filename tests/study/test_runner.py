"""Serial, processes and Dask: the same bits, a bounded window, and what kills workers and programs."""

import contextlib
import json
import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np
import psutil
import pytest
import small_tasks
from script_runs import wait_for_lines

from femgear import cli
from femgear.errors import CaseError, ContactError, FemgearError
from femgear.study.designs import open_designs
from femgear.study.objectives import named_quantity, tip_thickness
from femgear.study.problem import Limit, Problem, Variable
from femgear.study.runner import Dask, Processes, Runner, check_complete, open_runner
from femgear.study.search import SearchOptions, minimise
from femgear.study.sweep import sweep
from femgear.trains.reading import read_case, to_toml, with_values
from validation.soak import programs

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
RATIO = "dynamics.damping_ratio"


@contextlib.contextmanager
def dask_cluster(**options):
    """A scheduler with two workers of this machine, and with Dask's own count of allowed failures."""
    from distributed import LocalCluster

    options |= {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": ":0"}
    with LocalCluster(**options, silence_logs=50) as cluster, Dask(cluster.scheduler_address) as runner:
        yield runner


@pytest.fixture(scope="module")
def processes():
    with Processes(2) as runner:
        yield runner


@pytest.fixture(scope="module")
def dask_runner():
    """Workers are threads here: to start processes takes ten seconds."""
    with dask_cluster(processes=False, protocol="tcp://") as runner:
        yield runner


@pytest.fixture(scope="module")
def dask_processes():
    with dask_cluster() as runner:
        yield runner


@pytest.fixture
def dask_victims():
    """A cluster whose workers a test may end."""
    with dask_cluster() as runner:
        yield runner


@pytest.fixture(params=["serial", "processes", "dask_runner", pytest.param("dask_processes", marks=pytest.mark.slow)])
def runner(request):
    return Runner() if request.param == "serial" else request.getfixturevalue(request.param)


@pytest.fixture(params=["processes", "dask_runner", pytest.param("dask_processes", marks=pytest.mark.slow)])
def remote(request):
    return request.getfixturevalue(request.param)


# Dask begins its workers anew, which takes seconds
kills = pytest.mark.parametrize(
    "remote", ["processes", pytest.param("dask_victims", marks=pytest.mark.slow)], indirect=True
)


@pytest.fixture(scope="module")
def case():
    return read_case(CASE)


def keys_of(journal):
    return [json.loads(line)["key"] for line in journal.read_bytes().splitlines()[1:]]


def test_every_item_has_one_outcome(runner):
    found = [*runner.map(small_tasks.square, range(300))]
    assert sorted(found) == [(x, x * x) for x in range(300)]
    assert [*runner.map(small_tasks.square, ())] == []


@pytest.mark.parametrize("window", [1, 3, 7])
def test_no_more_tasks_than_the_window_are_out(runner, window):
    taken, back, most = 0, 0, 0

    def items():
        nonlocal taken, most
        for x in range(60):
            taken += 1
            most = max(most, taken - back)
            yield x

    for _ in runner.map(small_tasks.square, items(), window):
        back += 1
    assert taken == back == 60 and most == window


def test_the_default_window_follows_the_workers(remote):
    assert remote.workers == 2
    source = iter(range(100))
    results = remote.map(small_tasks.square, source)
    next(results)
    results.close()
    assert next(source) == 4
    # what was out is forgotten
    assert sorted(remote.map(small_tasks.square, [5, 6])) == [(0, 25), (1, 36)]


@kills
def test_what_kills_workers_is_given_up_after_the_second(remote, tmp_path):
    found = dict(remote.map(small_tasks.poisoned, [(str(tmp_path), x) for x in range(20)]))
    lost = found.pop(13)
    assert isinstance(lost, FemgearError) and lost.code == "E-WORKER" and "ends its worker, twice" in str(lost)
    assert found == {x: x * x for x in range(20) if x != 13}
    tries = {x: len((tmp_path / f"{x}").read_text().split()) for x in range(20)}
    assert tries[13] == 2 and tries[17] == 2
    if isinstance(remote, Processes):  # Dask takes everything from a worker that dies
        assert all(tries[x] == 1 for x in range(20) if x not in (13, 17))


def test_a_worker_has_one_thread_of_blas(remote):
    found = dict(remote.map(small_tasks.threads, range(4)))
    assert all(counts and set(counts) == {1} for counts in found.values())


def test_a_warning_of_many_tasks_is_said_once(processes, dask_runner):
    for runner in (Runner(), processes, dask_runner):
        runner._told.clear()
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            assert len([*runner.map(small_tasks.warned, range(8))]) == 8
        (one,) = [one for one in said if "task says this" in str(one.message)]
        assert one.category is UserWarning and one.filename == small_tasks.__file__


def test_an_error_of_a_task_is_raised_here(runner):
    with pytest.raises(ContactError, match="no such contact") as error:
        [*runner.map(small_tasks.refused, [1, 2, 3])]
    assert error.value.code == "E-CONTACT" and error.value.key == "sun.mass"
    assert [*runner.map(small_tasks.square, [4])] == [(0, 16)]


def test_what_cannot_be_sent_is_refused(remote):
    with pytest.raises(CaseError, match="importable modules"):
        [*remote.map(lambda x: x, [1])]


def test_refusals(capsys):
    for arguments, code in (
        ({"workers": 0}, "E-RANGE"),
        ({"workers": 2, "cluster": "tcp://127.0.0.1:1"}, "E-ARGUMENTS"),
        ({"cluster": "inproc://10.0.0.1/5/1"}, "E-ARGUMENTS"),
    ):
        with pytest.raises(CaseError) as error:
            open_runner(**arguments)
        assert error.value.code == code
    assert type(open_runner(1)) is Runner and open_runner(3).workers == 3
    words = ["sweep", str(CASE), "-o", "out", "--over", "carrier.mass=1 kg,2 kg", "--cluster", "udp:nowhere"]
    assert cli.main(words) == 5 and "E-CLUSTER" in capsys.readouterr().err
    start = time.perf_counter()
    assert cli.main([*words[:-1], "somewhere"]) == 5 and "E-CLUSTER" in capsys.readouterr().err
    assert time.perf_counter() - start < 20.0  # no client is opened, whose end would wait for 40 s


def test_keys_without_an_outcome_are_an_error(case, tmp_path):
    check_complete(["a", "b"], {"b", "a", "c"})
    with pytest.raises(FemgearError, match=r"E-INCOMPLETE.*2 of 3"):
        check_complete(["a", "b", "c"], {"b"})

    class Forgetful(Runner):
        def map(self, function, items, window=None):
            # a case is lost: the second iterator has given it away
            return (one for _, one in zip(range(3), super().map(function, items, window)))

    values = {RATIO: [0.1, 0.2, 0.3, 0.4]}
    with pytest.raises(FemgearError, match=r"E-INCOMPLETE.*1 of 4"):
        sweep(case, values, [small_tasks.VALLEY], journal=tmp_path / "j", runner=Forgetful())
    assert sweep(case, values, [small_tasks.VALLEY], journal=tmp_path / "j").computed == 1


# --- sweeps and searches ---------------------------------------------------------------------------


def test_a_sweep_has_the_same_bits_whoever_computes(case, processes, dask_runner, tmp_path_factory):
    """Cases that share grids, compliances and static solutions, and gears that cannot be made."""
    coarse = {"static.flank_elements": 4, "static.positions": 14, "static.stresses": False}
    grids = tmp_path_factory.mktemp("grids")
    over = {"planet.profile_shift": [0.0, 2.5], "operation.torque": ["50 N m", "90 N m"]}
    over["sun.mass"] = ["1 kg", "2 kg"]
    free = with_values(case, coarse | {"sun.profile_shift": None, "ring.profile_shift": None})
    quantities = [named_quantity("ste"), named_quantity("contact pressure"), tip_thickness("planet")]
    whole, *others = (
        sweep(free, over, quantities, cache=grids, runner=runner) for runner in (Runner(), processes, dask_runner)
    )
    assert np.isfinite(whole.values).any() and any(whole.errors) and not all(whole.errors)
    for other in others:
        assert other.values.tobytes() == whole.values.tobytes()
        assert (other.errors, other.points, other.computed) == (whole.errors, whole.points, 8)


@pytest.mark.parametrize("most", [pytest.param(None, marks=pytest.mark.slow), 23])
def test_a_search_has_the_same_bits_whoever_computes(case, processes, dask_runner, most, tmp_path):
    variables = [Variable(RATIO, 0.05, 0.95, "5 %"), Variable("carrier.mass", "0.1 kg", "3 kg", "0.1 kg")]
    limits = [Limit(small_tasks.VALLEY, high=9.0)]
    problem = Problem(case, variables, small_tasks.VALLEY, limits=limits)
    options = {"options": SearchOptions(samples=8, generations=3, max_designs=most), "method": "global"}
    runs = []
    for number, runner in enumerate((Runner(), processes, dask_runner)):
        journal = tmp_path / f"{number}"
        found = minimise(problem, **options, journal=journal, runner=runner)
        keys = keys_of(journal)
        assert len(keys) == len(set(keys)) == found.designs == found.computed
        runs.append((found.x.tobytes(), found.after, found.course, found.message, found.all_off, sorted(keys)))
    # outside the limit there is no course
    assert runs[0][2] != runs[0][2] or len(runs[0][2]) > 9
    np.testing.assert_equal(runs[1], runs[0])
    np.testing.assert_equal(runs[2], runs[0])


@pytest.mark.slow
@kills
def test_a_design_that_kills_workers_is_a_failure_of_the_sweep(case, remote, tmp_path):
    values = {RATIO: [0.1, 0.2, small_tasks.POISON, 0.7, 0.8]}
    for computed in (5, 0):
        found = sweep(case, values, [small_tasks.DEADLY], journal=tmp_path / "j", runner=remote)
        assert found.computed == computed
        assert [error[:10] for error in found.errors] == ["", "", "[E-WORKER]", "", ""]
        np.testing.assert_array_equal(found.values[[0, 1, 3, 4], 0], np.array([0.1, 0.2, 0.7, 0.8]) / 7.0)
    assert len(keys_of(tmp_path / "j")) == 5


def test_designs_that_a_journal_holds_are_not_sent(case, tmp_path):
    class Counting(Runner):
        sent = 0

        def _give(self, *task):
            self.sent += 1
            super()._give(*task)

    keys, points, runner = [(RATIO,)], [(0.1 * n,) for n in range(1, 6)], Counting()
    with open_designs(case, keys, journal=tmp_path / "j", runner=runner) as designs:
        assert [*designs.ahead(points[:3], (small_tasks.VALLEY,))] == [0, 1, 2, 3]
        assert [*designs.ahead(points, (small_tasks.VALLEY,))] == [3, 4, 5]
    assert runner.sent == 5


@pytest.fixture
def words(case, tmp_path):
    """A sweep of 60 quick cases by two processes, without its folder."""
    free = with_values(case, {"sun.profile_shift": None, "ring.profile_shift": None})
    (tmp_path / "case.toml").write_text(to_toml(free), encoding="utf-8")
    over = ["--over", "planet.profile_shift=0..0.1/60", "--of", "tip thickness planet"]
    return ["sweep", "case.toml", *over, "-o", "out"]


def children(pid):
    """Processes that a process has started, but for the tracker of multiprocessing."""
    started = psutil.Process(pid).children()
    return [one.pid for one in started if any("spawn_main" in word for word in one.cmdline())]


@pytest.mark.slow
def test_what_is_killed_loses_nothing(words, tmp_path):
    """Ctrl-C, then kill -9 of the program that goes on, then of a worker of the next one, which ends well."""
    journal, lines, workers = tmp_path / "out" / "sweep.jsonl", 0, []
    for way in (signal.SIGINT, signal.SIGKILL, "worker"):
        run = programs.start([*words, "--workers", "2"], tmp_path)
        wait_for_lines(journal, lines + 8, run)
        own = children(run.pid)
        assert len(own) == 2
        workers += own
        if way == "worker":
            os.kill(own[0], signal.SIGKILL)
        else:
            run.kill(way)
        start, before = time.monotonic(), lines
        ended = run.wait()
        lines = len(keys_of(journal))
        assert not ended.crash and "Traceback" not in ended.err and "warning" not in ended.err
        if way == "worker":
            assert ended.code == 0 and f"60 cases, {60 - before} computed now, 0 cannot" in ended.out
        else:
            assert ended.code == (130 if way == signal.SIGINT else -9) and time.monotonic() - start < 3.0
            assert before + 7 <= lines < 60
    keys = keys_of(journal)
    assert len(keys) == len(set(keys)) == 60
    until = time.monotonic() + 5.0
    while any(Path(f"/proc/{pid}").exists() for pid in workers):
        assert time.monotonic() < until, "a worker has outlived its program"
        time.sleep(0.05)


@pytest.mark.slow
@pytest.mark.parametrize("runner", ["serial", "processes", "dask_processes"], indirect=True)
def test_ten_thousand_tasks_of_a_millisecond(runner, tmp_path):
    """Nothing is lost, nothing is computed twice."""
    found = [*runner.map(small_tasks.marked, ((str(tmp_path), x) for x in range(10_000)))]
    assert sorted(index for index, _ in found) == small_tasks.marks(tmp_path) == [*range(10_000)]
    assert len({pid for _, pid in found}) == runner.workers
