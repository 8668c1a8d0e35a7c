"""A process beside the window: answers in order, ended when it is not wanted."""

import asyncio
import os
import socket
from multiprocessing import Pipe
from pathlib import Path

import pytest

from femgear.app.bench import Superseded
from femgear.app.worker import END, Requests, Worker, WorkerError, serve_bench
from femgear.errors import CaseError

CASES = Path(__file__).parents[2] / "cases"


async def all_of(worker, name, *arguments):
    return [value async for value in worker.ask(name, *arguments)]


def test_a_process_answers_in_order_and_ends_when_it_is_told(tmp_path):
    text = (CASES / "planetary_27_40_108.toml").read_text("utf-8")

    async def talk(worker):
        (seen,) = await all_of(worker, "look", text, "a.toml")
        assert seen["train"] == "elastic" and worker.alive
        with pytest.raises(WorkerError, match="KeyError"):
            await all_of(worker, "nothing")
        with pytest.raises(WorkerError, match="E-TOML"):
            await all_of(worker, "gears", "a = ", "a.toml")
        # an answer that is being computed gives way to the next request, and what it sent does not come with that
        waiting = asyncio.create_task(all_of(worker, "answer", text, "a.toml", [], ["static", "stress", "modes"]))
        await asyncio.sleep(0.2)
        (gears,) = await all_of(worker, "gears", text, "a.toml")
        assert len(gears["bodies"]) == 5 and sum("stage" in part for part in await waiting) < 3
        # what is stopped ends at once, and begins anew when it is asked again
        waiting = asyncio.create_task(all_of(worker, "answer", text, "a.toml", [], ["static", "stress", "modes"]))
        await asyncio.sleep(0.2)
        worker.stop()
        assert not worker.alive
        with pytest.raises(WorkerError):
            await waiting
        assert (await all_of(worker, "look", "a = ", "a.toml"))[0]["problems"] and worker.alive

    async def whole():
        worker = Worker(serve_bench, tmp_path, CASES.parent / "meshes")
        try:
            await talk(worker)
        finally:
            worker.stop()

    asyncio.run(whole())


def test_requests_tell_what_they_know_on_the_way():
    mine, theirs = Pipe()
    requests = Requests(theirs)

    def tells():
        requests.tell("begins")
        return "ends"

    def gives_up():
        yield 1
        raise Superseded

    def refuses():
        raise CaseError("it cannot be", code="E-CASE", key="a.b", remedy="do this")

    for number, name in enumerate(("tells", "gives_up", "refuses"), start=1):
        mine.send((number, name, ()))
    # nothing more will be asked, and answers can still be read
    with socket.socket(fileno=os.dup(mine.fileno())) as asking:
        asking.shutdown(socket.SHUT_WR)
    with pytest.raises(EOFError):
        requests.answer({"tells": tells, "gives_up": gives_up, "refuses": refuses})
    assert [mine.recv() for _ in range(3)] == [(1, "value", "begins"), (1, "value", "ends"), (1, END, None)]
    assert [mine.recv() for _ in range(2)] == [(2, "value", 1), (2, END, None)]
    number, kind, words = mine.recv()
    assert (number, kind) == (3, "failed") and "E-CASE" in words and "do this" in words
