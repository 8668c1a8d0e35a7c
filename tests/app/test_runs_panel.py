"""Runs of a window: computed, cancelled, and what the log of the server says."""

import asyncio
from importlib.util import find_spec

import pytest

# it is loaded where a test needs it: by one of the workers of pytest
pytestmark = pytest.mark.skipif(find_spec("nicegui") is None, reason="an extra of the package")


class Runs:
    """A process that tells its progress, and then ends as it is told."""

    def __init__(self, end=None):
        self.end, self.asked, self.stopped = end, [], 0

    async def ask(self, name, *arguments):
        self.asked.append((name, *arguments))
        yield {"stage": "static", "done": 1.0, "total": 4.0}
        if self.end is not None:
            raise self.end
        yield {"complete": True}

    def stop(self):
        self.stopped += 1


@pytest.fixture
def panel(tmp_path):
    from empty_window import empty_window

    from femgear.app.runs_panel import RunsPanel
    from femgear.app.session import Session

    session, said, shown = Session(tmp_path), [], []
    session.begin("set.toml", "a = 1\n")

    def make(runs):
        return RunsPanel(session, runs, lambda *words: said.append(words), lambda: shown.append(True)), said, shown

    with empty_window():
        yield make


def compute(panel, output="set_1"):
    asyncio.run(panel._compute(output))


def test_a_run_is_that_of_the_text_and_is_shown(panel, tmp_path):
    runs = Runs()
    shown, said, seen = panel(runs)
    (tmp_path / "set_1").mkdir()
    (tmp_path / "set_1" / "manifest.json").write_text("{}")
    compute(shown)
    assert runs.asked == [("run", "a = 1\n", "set.toml", "set_1", True)] and seen == [True] and said == []
    assert shown._report.props["src"] == "/results/set_1/report.html" and not shown._progress_row.visible


def test_a_cancelled_run_is_one_line_of_the_log(panel, capsys):
    from femgear.app.worker import WorkerStopped

    cancelled, said, _ = panel(Runs(WorkerStopped("it was stopped")))
    compute(cancelled)
    assert capsys.readouterr().err == "femgear app: the run into set_1 was cancelled\n"
    assert len(said) == 1 and "goes on" in said[0][0] and not cancelled._progress_row.visible


def test_nobody_is_told_where_the_window_is_closed(panel, capsys):
    from femgear.app.worker import WorkerStopped

    closed, said, _ = panel(Runs(WorkerStopped("it was stopped")))
    closed.stop()
    compute(closed)
    assert capsys.readouterr().err.count("\n") == 1 and said == []


def test_a_run_that_fails_says_why(panel, capsys):
    from femgear.app.worker import WorkerError

    failed, said, _ = panel(Runs(WorkerError("[E-SOLVE] no")))
    compute(failed)
    assert said == [("[E-SOLVE] no", "negative")] and capsys.readouterr().err == ""


def test_a_folder_without_runs_says_what_makes_one(panel, tmp_path):
    empty, _, _ = panel(Runs())
    empty.list_runs()
    assert empty._none_yet.visible
    (tmp_path / "set_1").mkdir()
    (tmp_path / "set_1" / "manifest.json").write_text("{}")
    empty.list_runs()
    assert not empty._none_yet.visible and empty._run.options == ["set_1"]


def test_a_comparison_needs_two_runs(panel):
    runs = Runs()
    alone, said, _ = panel(runs)
    asyncio.run(alone._compare())
    assert runs.asked == [] and len(said) == 1
