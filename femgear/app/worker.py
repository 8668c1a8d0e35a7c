"""A process of its own for what takes long, so that a window stays quick and whatever it computes can be ended.

The window sends a number, the name of a function and its arguments through a pipe; the process sends back what the
function yields or returns, each with the number. It looks for newer requests while it computes.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from femgear.app.bench import Bench, Superseded
from femgear.errors import FemgearError

END = "end"
_POLL = 0.01
"""Longest wait for an answer before the window looks after others [s]."""


class WorkerError(Exception):
    """What was asked for could not be computed, in the words of the process that tried."""


class WorkerStopped(WorkerError):
    """What was asked for was stopped on purpose."""


class Worker:
    """A process that answers one request after the other.

    Parameters
    ----------
    serve : callable
        ``(Connection, *arguments)``, run in the process until it ends; picklable.
    *arguments : object
        Of it, picklable.
    """

    def __init__(self, serve: Callable[..., None], *arguments: Any) -> None:
        self._serve, self._arguments = serve, arguments
        self._lock, self._number = asyncio.Lock(), 0
        self._process: Any = None
        self._pipe: Any = None

    def start(self) -> None:
        """Start the process, where there is none."""
        if self._process is not None and self._process.is_alive():
            return
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_served, args=(self._serve, theirs, *self._arguments), daemon=True)
        self._process.start()
        theirs.close()

    def stop(self) -> None:
        """End the process at once, whatever it does."""
        if self._process is not None:
            self._process.kill()
            self._process.join(5.0)
            self._pipe.close()
        self._process = self._pipe = None

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.is_alive()

    async def ask(self, name: str, *arguments: Any) -> AsyncIterator[Any]:
        """Yield what a function of the process yields or returns.

        Raises
        ------
        WorkerError
            It failed, or the process ended; WorkerStopped where `stop` ended it.
        """
        self._number += 1
        number = self._number
        self.start()
        try:
            self._pipe.send((number, name, arguments))
        except OSError as error:
            raise WorkerError("the process that computes has ended") from error
        async with self._lock:
            async for kind, value in self._received(number):
                if kind == "failed":
                    raise WorkerError(value)
                yield value

    async def _received(self, number: int) -> AsyncIterator[tuple[str, Any]]:
        """What comes back with a number, up to its end; what is left of former requests is dropped."""
        while True:
            pipe = self._pipe
            if pipe is None:
                raise WorkerStopped("it was stopped")
            try:
                if not pipe.poll():
                    if not self.alive:
                        raise EOFError
                    await asyncio.sleep(_POLL)
                    continue
                of, kind, value = pipe.recv()
            except (EOFError, OSError) as error:
                raise WorkerError("the process that computes has ended") from error
            if of > number:
                raise WorkerError("an answer was lost")
            if of < number:
                continue
            if kind == END:
                return
            yield kind, value


def _served(serve: Callable[..., None], pipe: Connection, *arguments: Any) -> None:
    """Serve in the process until the window is gone; an interrupt is meant for the window."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with suppress(EOFError, OSError):
        serve(pipe, *arguments)


class Requests:
    """The requests that come through a pipe to the process.

    Parameters
    ----------
    pipe : Connection
    """

    def __init__(self, pipe: Connection) -> None:
        self._pipe, self._number = pipe, 0

    def tell(self, value: Any) -> None:
        """Send something that is known before the function returns, as if it had yielded it."""
        self._pipe.send((self._number, "value", value))

    def answer(self, functions: Mapping[str, Callable[..., Any]]) -> None:
        """Answer one after the other until the pipe is closed; each function returns a value, or yields several."""
        while True:
            self._number, name, arguments = self._pipe.recv()
            try:
                values = functions[name](*arguments)
                for value in values if isinstance(values, Iterator) else [values]:
                    self.tell(value)
            except Superseded:
                pass
            except FemgearError as error:
                self._pipe.send((self._number, "failed", str(error)))
            except Exception as error:  # a window stays open whatever happens
                text = f"this should not happen: {type(error).__name__}: {error}"
                self._pipe.send((self._number, "failed", text))
            self._pipe.send((self._number, END, None))


def serve_bench(pipe: Connection, folder: Path, cache: Path | None) -> None:
    """Answer for a case in a folder: `Bench.look`, `tables`, `gears`, `draft`, `answer` and `sound`."""
    requests = Requests(pipe)
    bench = Bench(folder, cache=cache, waiting=pipe.poll, tell=requests.tell)
    names = "look", "tables", "gears", "draft", "answer", "sound"
    requests.answer({name: getattr(bench, name) for name in names})
