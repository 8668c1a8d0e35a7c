"""Tasks shared with a copy of this process, where there is a core for it."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from femgear.errors import FemgearError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_BYTES = 4
"""Of the number of a task in the queue, which a pipe holds as a whole."""


def shared(tasks: Sequence[Callable[[], object]], beside: Callable[[], object] | None = None) -> list[Any]:
    """Values of up to 10,000 tasks; a second process begins with the last one, this one after ``beside()``.

    Values, errors and warnings of the other process come here through pickle. A task alone is done here.
    """
    if len(tasks) + (beside is not None) < 2:
        return [task() for task in tasks]
    beside = beside or (lambda: None)
    waiting, numbers = os.pipe()
    os.write(numbers, b"".join(number.to_bytes(_BYTES) for number in reversed(range(len(tasks)))))
    os.close(numbers)
    with open(waiting, "rb", buffering=0) as queue:

        def take() -> dict[int, Any]:
            numbers = map(int.from_bytes, iter(partial(queue.read, _BYTES), b""))
            return {number: tasks[number]() for number in numbers}

        with _second_process(take) as others:
            beside()
            values = take() | others()
    return [values[number] for number in range(len(tasks))]


@contextmanager
def _second_process(work: Callable[[], dict]) -> Iterator[Callable[[], dict]]:
    """Do some work in a copy of this process during a block of code, which is given what waits for the value.

    The copy ends with the block, or with this process. Without a second core the value is empty.
    """
    if not second_core():
        yield dict
        return
    context: Any = multiprocessing.get_context("fork")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(work, theirs, os.getpid()), daemon=True)
    # an interrupt is meant for this process, and waits until the other one can be ended
    before, value = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM]), dict
    try:
        with suppress(OSError), warnings.catch_warnings(action="ignore", category=DeprecationWarning):
            process.start()
            value = partial(_received, mine)
        theirs.close()
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        yield value
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if process.pid is not None:
            process.kill()
            process.join()
        mine.close()


def second_core() -> bool:
    """Tell whether a copy of this process would have a core of its own; workers have none, and no copies."""
    alone = not multiprocessing.current_process().daemon
    return alone and sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


def _send(work: Callable[[], object], connection: Connection, parent: int) -> None:
    """Send the value of some work, or its error, and warnings; end with the parent, whose locks it has."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        return
    with warnings.catch_warnings(record=True) as raised:
        try:
            value = work()
        except Exception as error:
            value = error
    connection.send(
        (value, [(str(warning.message), warning.category, warning.filename, warning.lineno) for warning in raised])
    )


def _received(connection: Connection) -> dict:
    """Receive what `_send` sends: value or error, and warnings."""
    try:
        value, raised = connection.recv()
    except EOFError:
        message, remedy = "the second process, which draws or solves, was ended", "give it more memory"
        raise FemgearError(message, code="E-WORKER", remedy=remedy) from None
    for warning in raised:
        warnings.warn_explicit(*warning)
    if isinstance(value, BaseException):
        raise value
    return value
