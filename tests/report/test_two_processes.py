"""Figures drawn in two processes: values, errors, warnings, and the second never outlives the first."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import pytest

from femgear.errors import CaseError, FemgearError
from femgear.report import page, style
from femgear.trains.protocol import Drawn, Figures, Stage, Train

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="one process elsewhere")


@pytest.fixture(autouse=True)
def two_processes(monkeypatch):
    monkeypatch.setattr(page, "second_core", lambda: True)
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
    found = page._shared(tasks, until_taken(taken))
    assert [value for value, _ in found] == [0, 1, 2, 3]
    # the other one begins with the last
    assert found[3][1] != os.getpid()


def test_without_a_second_core_everything_is_done_here(monkeypatch, taken):
    monkeypatch.setattr(page, "second_core", lambda: False)
    beside = []
    found = page._shared([told(taken, value) for value in range(3)], lambda: beside.append(taken.is_set()))
    assert found == [(value, os.getpid()) for value in range(3)] and beside == [False]


def test_without_room_for_a_process_everything_is_done_here(monkeypatch, taken):
    def full(self):
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr(multiprocessing.context.ForkProcess, "start", full)
    assert page._shared([told(taken, 7)], lambda: None) == [(7, os.getpid())]


def test_an_error_of_the_other_process_is_raised_here(taken):
    def wrong():
        taken.set()
        raise CaseError("no such picture", code="E-CHOICE", key="pictures")

    with pytest.raises(CaseError, match="no such picture") as caught:
        page._shared([wrong], until_taken(taken))
    assert caught.value.code == "E-CHOICE" and caught.value.key == "pictures"


def test_a_process_that_is_killed_is_said(taken):
    def killed():
        taken.set()
        os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(FemgearError, match="was ended") as caught:
        page._shared([killed], until_taken(taken))
    assert caught.value.code == "E-WORKER"


def test_warnings_of_the_other_process_are_given_here(taken):
    def warned():
        taken.set()
        warnings.warn("thin rim", stacklevel=1)

    with pytest.warns(UserWarning, match="thin rim"):
        page._shared([warned], until_taken(taken))


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
        page._shared([long], interrupted)
    assert time.monotonic() < start + 10.0


PARENT = """
import os, signal, sys, time
from femgear.report import page
page.second_core = lambda: True
def child():
    print(os.getpid(), flush=True)
    time.sleep(60.0)
def beside():
    sys.stdin.readline()
    os.kill(os.getpid(), signal.SIGKILL)
page._shared([child], beside)
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


def test_figures_are_the_same_bytes(tmp_path):
    def drawn_by(stage):
        figure, (ax,) = style.new_figure()
        ax.plot([0, 1], [stage, 2.0])
        style.label(ax, "time [s]", "force [N]", "a line")
        return {f"picture_{stage}": figure}

    stages = tuple(Stage(str(n), "", *[None] * 3) for n in range(3))
    figures = {str(n): Figures({}, draw=lambda _, n=n: drawn_by(n)) for n in range(3)}
    train = Train("sample", "a sample", stages, lambda case: (), lambda case: (), figures)
    drawn = Drawn(None, {str(n): None for n in range(3)})
    begun = threading.active_count()
    names = page.write_figures(tmp_path, train, drawn)
    assert (
        names == [*(f"picture_{n}.png" for n in range(3)), "charts.json"]
        and threading.active_count() == begun
    )
    for n in range(3):
        assert (tmp_path / names[n]).read_bytes() == style.png_bytes(drawn_by(n)[f"picture_{n}"])
