"""One function over many items: in this process, in processes of this machine, or on a Dask cluster.

Which `Runner` computes, and in which order tasks complete, changes no result.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import pickle
import queue
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, suppress
from functools import cache
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from typing import Any

from femgear import __version__
from femgear.errors import CaseError, FemgearError, checked_count
from femgear.trains.protocol import one_blas_thread

_TIMEOUT, _PERIOD = 20.0, 5.0
"""How long a scheduler may take to answer, and how often its workers are counted [s]."""
_one_task = threading.Lock()


class Runner(AbstractContextManager):
    """Runs tasks in this process, one after the other; see `open_runner`."""

    workers: int = 1
    """Tasks that run at the same time."""

    def __init__(self):
        self._waiting: deque[tuple[int, Callable, Any]] = deque()
        self._told: set[tuple] = set()

    def __exit__(self, *_):
        self._drop()

    def map(
        self, function: Callable[[Any], Any], items: Iterable, window: int | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Call a function with every item; give number and outcome of each as they come, every warning once.

        The function is that of an importable module, and sent with every task. The outcome is what it
        returns, or a `FemgearError` (E-WORKER) where it ends two workers. At most ``window`` tasks, by
        default twice the workers, are given out and have not come back; items beyond are not taken yet.

        FemgearError: no worker starts, or takes the function (E-WORKER); E-CLUSTER; what the function raises.
        """
        source, pending, suspects, tried = enumerate(items), {}, deque(), set()
        try:
            while True:
                for index, item in islice(source, max((window or 2 * self.workers) - len(pending), 0)):
                    pending[index] = item
                    self._give(index, function, item)
                if suspects and not pending:
                    index, item = suspects.popleft()
                    pending[index] = item
                    self._give(index, function, item)
                if not pending:
                    return
                index, reply = self._next()
                item = pending.pop(index)
                if reply is None and index not in tried:
                    # Dask cannot tell which task a worker died of: once more at the end, alone
                    tried.add(index)
                    suspects.append((index, item))
                    continue
                outcome, said = reply or (_deadly(), ())
                for one in {*said} - self._told:
                    self._told.add(one)
                    warnings.warn_explicit(*one)
                yield index, outcome
        finally:
            self._drop()

    def _give(self, index: int, function: Callable, item: Any) -> None:
        """Give out a task."""
        self._waiting.append((index, function, item))

    def _next(self) -> tuple[int, Any]:
        """Number of a task that comes back, and what `_call` returned; None where it ended its worker."""
        index, function, item = self._waiting.popleft()
        return index, _call(function, item)

    def _drop(self) -> None:
        """Forget the tasks that have not come back."""
        self._waiting.clear()


def _call(function: Callable, item: Any) -> tuple[Any, list[tuple]]:
    """Value of a task, and its warnings."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        value = function(item)
    return value, [(str(one.message), one.category, one.filename, one.lineno) for one in said]


def _deadly() -> FemgearError:
    remedy = "compute it alone, without workers, and look at what it says; give it more memory"
    return FemgearError("it ends its worker, twice", code="E-WORKER", remedy=remedy)


def _packed(function: Callable, item: Any) -> tuple[str, bytes]:
    """A task as `_call_packed` takes it."""
    try:
        return __version__, pickle.dumps((function, item))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise CaseError(
            f"a function cannot be sent to workers: {error}", code="E-WORKER",
            limit="functions of importable modules", remedy="compute without workers",
        ) from None  # fmt: skip


def _call_packed(version: str, task: bytes) -> tuple[Any, list[tuple]]:
    """As `_call`, in a worker: one task at a time, whatever threads it has."""
    if version != __version__:
        message = "a worker has another version of femgear"
        raise FemgearError(message, code="E-CLUSTER", value=__version__, limit=version)
    with _one_task:
        _limited()
        return _call(*pickle.loads(task))


@cache
def _limited() -> Any:
    """Limit a worker to one BLAS thread, which takes as long as a small task, once."""
    limit = one_blas_thread()
    limit.__enter__()
    return limit  # at its end the limit would be lifted


class Processes(Runner):
    """Runs tasks in processes of this machine; one that dies loses nothing but the task that it was at."""

    def __init__(self, workers: int):
        super().__init__()
        self.workers, self._begun = workers, False
        # by the connections to them
        self._processes: dict[Any, Any] = {}
        self._busy: dict[Any, int] = {}

    def __exit__(self, *_):
        self._drop()
        for connection in [*self._processes]:
            self._end(connection)

    def _feed(self) -> None:
        """Send tasks that wait to processes that have none."""
        while self._waiting and len(self._busy) < self.workers:
            index, function, item = self._waiting.popleft()
            task = _packed(function, item)
            idle = self._processes.keys() - self._busy.keys()
            connection = idle.pop() if idle else self._start()
            self._busy[connection] = index
            with suppress(OSError):  # of a dead one the end is read
                connection.send(task)

    def _start(self) -> Any:
        """Start a process that Ctrl-C does not reach: it is meant for this one."""
        context = multiprocessing.get_context("spawn")
        mine, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs,), daemon=True)
        mask = getattr(signal, "pthread_sigmask", lambda *_: ())  # Windows has none
        if hasattr(signal, "pthread_sigmask"):
            resource_tracker.ensure_running()  # its start would lift the block
        before = mask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            process.start()
        finally:
            mask(signal.SIG_SETMASK, before)
        theirs.close()
        self._processes[mine] = process
        return mine

    def _next(self) -> tuple[int, Any]:
        while True:
            self._feed()
            connection: Any = wait([*self._busy])[0]
            try:
                reply = connection.recv()
            except (EOFError, OSError):
                if not self._begun:
                    remedy = "look at what they say; a script starts them under if __name__ == '__main__'"
                    message = "worker processes end before they begin"
                    raise FemgearError(message, code="E-WORKER", remedy=remedy) from None
                return self._end(connection), None
            if reply is None:
                self._begun = True
                continue
            index = self._busy.pop(connection)
            if isinstance(reply, BaseException):
                raise reply
            self._feed()
            return index, reply

    def _drop(self) -> None:
        super()._drop()
        for connection in [*self._busy]:
            self._end(connection)

    def _end(self, connection: Any) -> int:
        """End a process, whatever it is at; the number of its task, -1 for none."""
        process = self._processes.pop(connection)
        connection.close()
        process.kill()
        process.join()
        return self._busy.pop(connection, -1)


def _serve(connection: Any) -> None:
    """Run the tasks that come over a connection, until it or the process that started this one ends."""
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        connection.send(None)
        while True:
            task = connection.recv()
            try:
                reply = _call_packed(*task)
            except Exception as error:
                reply = error
            connection.send(reply)


class Dask(Runner):
    """Runs tasks on the workers of a Dask scheduler that the user has started, given its address."""

    def __init__(self, address: str):
        super().__init__()
        self._address, self._counted, self._threads = address, -_PERIOD, 0
        self._given: dict[Any, int] = {}
        self._done: queue.Queue = queue.Queue()
        try:
            from distributed import Client

            # what it has to say of a lost connection is said by E-CLUSTER
            logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
            self._client: Any = Client(address, timeout=_TIMEOUT, set_as_default=False)
        except (ImportError, OSError, RuntimeError, TypeError, ValueError) as error:
            raise self._lost(error) from None

    def __exit__(self, *_):
        self._drop()
        self._client.close(timeout=2)

    def _lost(self, error: object) -> FemgearError:
        return FemgearError(
            f"no scheduler answers: {error}", code="E-CLUSTER", key="--cluster", value=self._address,
            limit="tcp://host:port, or tls://host:port with certificates in the configuration of Dask",
            remedy='dask scheduler; where Dask is missing, pip install "femgear[cluster]"',
        )  # fmt: skip

    @property
    def workers(self) -> int:
        """Threads of all workers that there are."""
        if time.monotonic() > self._counted + _PERIOD:
            self._counted, self._threads = time.monotonic(), sum(self._client.nthreads().values())
        return max(self._threads, 1)

    def _give(self, index: int, function: Callable, item: Any) -> None:
        future = self._client.submit(_call_packed, *_packed(function, item), pure=False)
        self._given[future] = index
        future.add_done_callback(self._done.put)

    def _next(self) -> tuple[int, Any]:
        from distributed import KilledWorker

        while (future := self._done.get()) not in self._given:
            pass  # it was dropped
        index, error = self._given.pop(future), future.exception()
        if future.status == "cancelled":
            raise self._lost("the connection is lost")
        if error is not None and not isinstance(error, KilledWorker):
            raise error
        return index, None if error else future.result()

    def _drop(self) -> None:
        self._client.cancel([*self._given])
        self._given.clear()


def open_runner(workers: int = 1, cluster: str | None = None) -> Runner:
    """Open the runner of so many processes, or of a Dask scheduler at an address, as a context.

    FemgearError: E-ARGUMENTS (workers and a cluster), E-RANGE (workers of nothing), E-CLUSTER (no scheduler
    answers).
    """
    count = checked_count(workers, "--workers", code="E-RANGE")
    if cluster is None:
        return Processes(count) if count > 1 else Runner()
    if count > 1:
        message, remedy = "a cluster has workers of its own", "leave --workers out"
        raise CaseError(message, code="E-ARGUMENTS", key="--workers", value=count, remedy=remedy)
    return Dask(cluster)


def check_complete(keys: Collection[str], stored: Collection[str]) -> None:
    """Refuse (FemgearError, E-INCOMPLETE) a study of which keys are not among those stored or failed."""
    if lost := [key for key in keys if key not in stored]:
        message, remedy = f"{len(lost)} of {len(keys)} tasks have no outcome", "give the same command again"
        raise FemgearError(message, code="E-INCOMPLETE", value=lost[0], remedy=remedy)
