"""Tasks in two processes: values, errors, warnings, and the second never outlives the first."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
import warnings
from functools import partial
from pathlib import Path

import pytest

from femgear import second_process
from femgear.errors import CaseError, FemgearError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="one process elsewhere")

SECOND_CORE = second_process.second_core


@pytest.fixture(autouse=True)
def two_processes(monkeypatch):
    monkeypatch.setattr(second_process, "second_core", lambda: True)
    yield
    assert multiprocessing.active_children() == []


def until_taken(taken):
    """What this process does beside the tasks: it waits until the other one has taken one."""
    return lambda: taken.wait(20.0) or pytest.fail("no second process")


def told(taken, value):
    """A task that says that it was begun, and tells where."""

    def task():
        taken.set()
        return value, os.getpid()

    return task


@pytest.fixture
def taken():
    return multiprocessing.get_context("fork").Event()


def test_values_come_in_order_from_both(taken):
    tasks = [told(taken, value) for value in range(4)]
    found = second_process.shared(tasks, until_taken(taken))
    assert [value for value, _ in found] == [0, 1, 2, 3]
    # the other one begins with the last
    assert found[3][1] != os.getpid()


def test_without_a_second_core_everything_is_done_here(monkeypatch, taken):
    monkeypatch.setattr(second_process, "second_core", lambda: False)
    beside = []
    found = second_process.shared([told(taken, value) for value in range(3)], lambda: beside.append(taken.is_set()))
    assert found == [(value, os.getpid()) for value in range(3)] and beside == [False]


def test_without_room_for_a_process_everything_is_done_here(monkeypatch, taken):
    def full(self):
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(multiprocessing.context.ForkProcess, "start", full)
    assert second_process.shared([told(taken, 7)], lambda: None) == [(7, os.getpid())]


def test_an_error_of_the_other_process_is_raised_here(taken):
    def wrong():
        taken.set()
        raise CaseError("no such picture", code="E-CHOICE", key="pictures")

    with pytest.raises(CaseError, match="no such picture") as caught:
        second_process.shared([wrong], until_taken(taken))
    assert caught.value.code == "E-CHOICE" and caught.value.key == "pictures"


def test_a_process_that_is_killed_is_said(taken):
    def killed():
        taken.set()
        os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(FemgearError, match="was ended") as caught:
        second_process.shared([killed], until_taken(taken))
    assert caught.value.code == "E-WORKER"


def test_warnings_of_the_other_process_are_given_here(taken):
    def warned():
        taken.set()
        warnings.warn("thin rim", stacklevel=1)

    with pytest.warns(UserWarning, match="thin rim"):
        second_process.shared([warned], until_taken(taken))


def test_an_interrupt_ends_both(taken):
    def long():
        taken.set()
        time.sleep(60.0)

    def interrupted():
        until_taken(taken)()
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(10.0)

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        second_process.shared([long], interrupted)
    assert time.monotonic() < start + 10.0


PARENT = """
import os, signal, sys, time
from femgear import second_process
second_process.second_core = lambda: True
def child():
    print(os.getpid(), flush=True)
    time.sleep(60.0)
def beside():
    sys.stdin.readline()
    os.kill(os.getpid(), signal.SIGKILL)
second_process.shared([child], beside)
"""


def test_the_other_process_ends_with_a_parent_that_is_killed():
    done = subprocess.Popen([sys.executable, "-c", PARENT], stdin=-1, stdout=-1, text=True)
    other = int(done.stdout.readline())
    done.communicate("now\n", timeout=60)
    assert done.returncode == -signal.SIGKILL
    until = time.monotonic() + 10.0
    while Path(f"/proc/{other}").exists() and time.monotonic() < until:
        time.sleep(0.01)
    assert not Path(f"/proc/{other}").exists()


def test_many_tasks_are_done_once_each():
    assert second_process.shared([partial(int, value) for value in range(1000)]) == list(range(1000))


def test_a_worker_makes_no_copies_of_itself(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    assert SECOND_CORE()
    monkeypatch.setattr(multiprocessing.current_process(), "_config", {"daemon": True})
    assert not SECOND_CORE()
