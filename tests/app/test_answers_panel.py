"""Answers that nobody waits for any more."""

import asyncio
import gc
from importlib.util import find_spec

import pytest

# it is loaded where a test needs it: by one of the workers of pytest
pytestmark = pytest.mark.skipif(find_spec("nicegui") is None, reason="an extra of the package")


class Bench:
    """A process that looks at a text at once, and answers until it is stopped."""

    def __init__(self):
        self.stopped, self.asked = False, []

    async def ask(self, name, *arguments):
        from femgear.app.worker import WorkerStopped

        self.asked.append(name)
        if name == "look":
            yield {"problems": [], "findings": [], "values": {}, "stages": [], "front": []}
        if name == "answer":
            while not self.stopped:
                await asyncio.sleep(0.001)
            raise WorkerStopped("it was stopped")


@pytest.fixture
def window():
    from empty_window import empty_window

    with empty_window() as client:
        yield client


@pytest.mark.parametrize("order", ("window first", "process first"))
def test_a_closed_window_leaves_no_error_that_nobody_took(tmp_path, window, order):
    from femgear.app.answers_panel import AnswersPanel
    from femgear.app.session import Session

    gc.freeze()  # what libraries hold need not be walked for what the window leaves
    session, bench, seen, failures = Session(tmp_path), Bench(), [], []
    session.begin("set.toml", "a = 1\n")

    async def open_and_close():
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: failures.append(context))
        with window:
            panel = AnswersPanel(session, bench, seen.append)
        task = asyncio.create_task(panel._work())
        panel.ask()
        while "answer" not in bench.asked:
            await asyncio.sleep(0.001)
        if order == "window first":
            task.cancel()
        bench.stopped = True
        await asyncio.sleep(0.01)
        task.cancel()
        await asyncio.wait({task})

    asyncio.run(open_and_close())
    gc.collect()
    assert len(seen) == 1 and failures == []
