"""Dask clusters of processes of their own, as users start them: same bits, kills, a full disk, memory."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import dask
import numpy as np
import psutil
import pytest
import small_tasks
from script_runs import wait_for_lines

from femgear.run import grid_cache
from femgear.storage.files import read_dataset
from femgear.study.objectives import transmission_error
from femgear.study.problem import Problem, Variable
from femgear.study.runner import Dask, Processes, Runner
from femgear.study.sample_results import samples_into
from femgear.study.samples import prepared
from femgear.study.search import SearchOptions, minimise
from femgear.study.sweep import sweep
from femgear.trains.reading import read_case, to_toml, with_values
from validation.soak import programs

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]
CASE, TOLERANCES = ROOT / "cases" / "planetary_27_40_108.toml", ROOT / "cases" / "tolerances" / "3um.toml"
CASES = 60


@dataclass(frozen=True)
class Cluster:
    """Address of a scheduler, its process and that of its workers, and what the environment says of it."""

    address: str
    scheduler: subprocess.Popen
    workers: subprocess.Popen
    environment: dict


@contextmanager
def started(folder, secret=None, workers=2):
    """A scheduler and workers, started by the commands of docs/cluster.md."""
    environment = os.environ | (secret or {}) | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    options = {"env": environment, "cwd": folder, "stderr": subprocess.PIPE, "text": True}
    protocol, command = "tls" if secret else "tcp", [sys.executable, "-m", "dask"]
    place = ["--host", "127.0.0.1", "--no-dashboard"]
    scheduler = subprocess.Popen([*command, "scheduler", "--protocol", protocol, "--port", "0", *place], **options)
    found = (re.search(rf"{protocol}://127\.0\.0\.1:\d+", line) for line in scheduler.stderr)
    address = next(filter(None, found))[0]
    options["stderr"] = subprocess.DEVNULL
    number = ["--nworkers", str(workers), "--nthreads", "1"]
    nannies = subprocess.Popen([*command, "worker", address, *number, *place], **options)
    # a pipe that nobody reads stops who writes into it
    threading.Thread(target=scheduler.stderr.read, daemon=True).start()
    try:
        yield Cluster(address, scheduler, nannies, secret or {})
    finally:
        for process in (nannies, scheduler):
            process.terminate()
            process.wait(timeout=30)


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """Variables of the environment that name certificates for scheduler, workers and client."""
    folder = tmp_path_factory.mktemp("certificates")
    subject = ["-subj", "/CN=femgear", "-days", "2", "-nodes", "-newkey", "rsa:2048"]
    request = ["openssl", "req", "-x509", *subject, "-keyout", "key.pem", "-out", "ca.pem"]
    subprocess.run(request, cwd=folder, check=True, capture_output=True)
    files = {"CA_FILE": "ca.pem"}
    files |= {
        f"{who}__{what}": file
        for who in ("SCHEDULER", "WORKER", "CLIENT")
        for what, file in (("CERT", "ca.pem"), ("KEY", "key.pem"))
    }
    return {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(folder / file) for name, file in files.items()}


@pytest.fixture(scope="module")
def secure(certificates, tmp_path_factory):
    with started(tmp_path_factory.mktemp("tls"), certificates) as found:
        yield found


@pytest.fixture(scope="module")
def runners(secure):
    """Two processes, two workers of a scheduler of this process, and those of one with certificates."""
    from distributed import LocalCluster

    options = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": ":0"}
    names = (name.removeprefix("DASK_").lower() for name in secure.environment)
    settings = dict(zip((name.replace("__", ".") for name in names), secure.environment.values()))
    with (
        LocalCluster(**options, silence_logs=50) as local,
        Processes(2) as processes,
        Dask(local.scheduler_address) as near,
        dask.config.set(settings),
        Dask(secure.address) as far,
    ):
        yield processes, near, far


@pytest.fixture
def words(tmp_path):
    """A sweep of quick cases, without its folder."""
    free = with_values(read_case(CASE), {"sun.profile_shift": None, "ring.profile_shift": None})
    (tmp_path / "case.toml").write_text(to_toml(free), encoding="utf-8")
    over = ["--over", f"planet.profile_shift=0..0.1/{CASES}", "--of", "tip thickness planet"]
    return ["sweep", "case.toml", *over, "-o", "out"]


def keys_of(journal):
    return [json.loads(line)["key"] for line in journal.read_bytes().splitlines()[1:]]


def assert_resumes(words, folder, lines, cluster):
    """The same command computes what the journal lacks, and nothing twice."""
    more = ["--cluster", cluster.address]
    last = programs.start([*words, *more], folder, fresh=True, environment=cluster.environment).wait()
    assert re.search(rf"{CASES} cases, {CASES - lines} computed now, 0 cannot", last.out), last
    assert "warning" not in last.err
    keys = keys_of(folder / "out" / "sweep.jsonl")
    assert len(keys) == len(set(keys)) == CASES


def test_three_hundred_cases_have_the_same_bits(runners):
    coarse = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False}
    case = with_values(read_case(CASE), coarse)
    over = {"operation.torque": [f"{20 + n} N m" for n in range(100)], "sun.mass": ["1 kg", "2 kg", "3 kg"]}
    found = [
        sweep(case, over, [transmission_error()], cache=grid_cache(), runner=runner) for runner in (Runner(), *runners)
    ]
    assert np.isfinite(found[0].values).all() and len(np.unique(found[0].values)) == 100
    for one in found:
        assert one.values.tobytes() == found[0].values.tobytes() and one.computed == 300


@pytest.mark.parametrize("method", ["spring", "exact"])
def test_two_thousand_samples_have_the_same_bits(runners, method, tmp_path):
    case, count = read_case(CASE), 2000
    basis, found = prepared(case, TOLERANCES, cache=grid_cache()), []
    for runner in (Runner(), *runners):
        samples_into(case, tmp_path, basis, count=count, exact=method == "exact", force=True, runner=runner)
        found.append(read_dataset(tmp_path / "samples.nc"))
    assert found[0].sizes["sample"] == count
    assert all(one.identical(found[0]) for one in found)


def test_an_optimisation_has_the_same_bits(runners):
    coarse = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False}
    crowned = {"sun.modifications": [{"kind": "profile crowning", "amount": "1 um"}]}
    case = with_values(read_case(CASE), coarse | crowned)
    amount = Variable("sun.modifications[0].amount", "0 um", "12 um", "1 um")
    torque = Variable("operation.torque", "40 N m", "90 N m", "5 N m")
    problem = Problem(case, [amount, torque], transmission_error("sun-planet"))
    options = {"method": "global", "options": SearchOptions(samples=8, generations=3), "sensitivity": False}
    found = [minimise(problem, **options, cache=grid_cache(), runner=one) for one in (Runner(), *runners)]
    assert found[0].designs > 20 and found[0].gain() > 0.1
    for one in found[1:]:
        assert one.x.tobytes() == found[0].x.tobytes() and one.message == found[0].message
        np.testing.assert_equal(
            (one.after, one.course, one.all_off),
            tuple(getattr(found[0], name) for name in ("after", "course", "all_off")),
        )


def test_without_certificates_none_gets_in(words, secure, tmp_path):
    assert_resumes(words, tmp_path, 0, secure)
    for address in (secure.address, secure.address.replace("tls", "tcp")):
        refused = programs.start([*words, "--cluster", address], tmp_path, fresh=True).wait()
        assert refused.code == 5 and "E-CLUSTER" in refused.err and not refused.crash


@pytest.mark.parametrize("who", ["client", "worker", "scheduler"])
def test_what_is_killed_loses_nothing(words, tmp_path, who):
    """With kill -9 in the middle; the client keeps what came before the scheduler was lost."""
    journal = tmp_path / "out" / "sweep.jsonl"
    with started(tmp_path) as cluster:
        run = programs.start([*words, "--cluster", cluster.address], tmp_path, fresh=True)
        wait_for_lines(journal, 8, run)
        if who == "client":
            run.kill(signal.SIGKILL)
        elif who == "scheduler":
            cluster.scheduler.kill()
        else:
            children = psutil.Process(cluster.workers.pid).children()
            spawned = [one for one in children if any("spawn_main" in word for word in one.cmdline())]
            assert len(spawned) == 2
            spawned[0].kill()
        ended = run.wait()
        assert not ended.crash and "Traceback" not in ended.err
        lines = len(keys_of(journal))
        if who == "worker":
            assert ended.code == 0 and f"{CASES} computed now, 0 cannot" in ended.out
            assert lines == len(set(keys_of(journal))) == CASES
        else:
            assert ended.code == {"client": -9, "scheduler": 3}[who] and 7 <= lines < CASES
            assert who == "client" or "E-CLUSTER" in ended.err
        if who == "client":
            assert_resumes(words, tmp_path, lines, cluster)
    if who == "scheduler":
        with started(tmp_path) as another:
            assert_resumes(words, tmp_path, lines, another)


def test_a_full_disk_of_the_client_leaves_a_good_journal(words, secure, tmp_path):
    """A limit on the size of files, which the system meets in the middle of a line as it does a full disk."""
    limit = (3000, resource.getrlimit(resource.RLIMIT_FSIZE)[1])
    full = programs.start(
        [*words, "--cluster", secure.address],
        tmp_path,
        fresh=True,
        environment=secure.environment,
        before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
    ).wait()
    journal = tmp_path / "out" / "sweep.jsonl"
    assert full.code == 4 and not full.crash and "sweep.jsonl" in full.err
    lines = len(keys_of(journal))
    assert 0 < lines < CASES and journal.read_bytes().endswith(b"\n")
    assert_resumes(words, tmp_path, lines, secure)


def test_a_task_that_ends_workers_is_tried_twice_whatever_the_scheduler_allows(tmp_path, monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "9")
    with started(tmp_path) as cluster, Dask(cluster.address) as runner:
        found = dict(runner.map(small_tasks.poisoned, [(str(tmp_path), x) for x in range(20)]))
    assert found.pop(13).code == "E-WORKER" and found == {x: x * x for x in range(20) if x != 13}
    assert len((tmp_path / "13").read_text().split()) == 2


def test_memory_does_not_grow_with_the_number_of_tasks(tmp_path, capsys):
    """Of client and scheduler, over 1000, 10 000 and 30 000 tasks of a millisecond, each computed once.

    The client is a process of its own, as users have it: that of the tests hardly collects garbage.
    """
    (folder := tmp_path / "marks").mkdir()
    with started(tmp_path) as cluster, ProcessPoolExecutor(1, get_context("spawn")) as client:
        task = cluster.address, cluster.scheduler.pid, folder
        sizes = client.submit(small_tasks.memory_of_client_and_scheduler, *task).result()
    with capsys.disabled():
        print("".join(f"\n{client:.1f} MB of client, {scheduler:.1f} MB of scheduler" for client, scheduler in sizes))
    assert small_tasks.marks(folder) == [*range(30_000)]
    client, scheduler = np.subtract(sizes[2], sizes[1])
    assert client < 3.0 and scheduler < 10.0
