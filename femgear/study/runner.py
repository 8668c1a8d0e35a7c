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
from functools import cache, lru_cache
from itertools import count, islice
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from femgear import __version__
from femgear.errors import CaseError, FemgearError, checked_count
from femgear.stages.protocol import one_blas_thread

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_TIMEOUT, _PERIOD = 20.0, 5.0
"""How long a scheduler may take to answer, and how often its workers are counted [s]."""
_TASK = "femgear-task-"
"""In the keys of all tasks."""
_one_task = threading.Lock()


class Runner(AbstractContextManager):
    """Runs tasks in this process, one after the other; see `open_runner`."""

    workers: int = 1
    """Tasks that run at the same time."""

    def __init__(self):
        self._waiting: deque[tuple[int, Any]] = deque()
        self._told: set[tuple] = set()

    def __exit__(self, *_):
        self._drop()

    def map(
        self, function: Callable[[Any], Any], items: Iterable, window: int | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Call a function with every item; give number and outcome of each as they come, every warning once.

        The function is that of an importable module, and sent to every worker once. The outcome is what it
        returns, or a `FemgearError` (E-WORKER) where it ends two workers. At most ``window`` tasks, by
        default twice the workers, are given out and have not come back; items beyond are not taken yet.

        FemgearError: no worker starts, or takes the function (E-WORKER); E-CLUSTER; what the function raises.
        """
        source, pending, suspects, tried = enumerate(items), {}, deque(), set()
        self._take(function)
        try:
            while True:
                for index, item in islice(source, max((window or 2 * self.workers) - len(pending), 0)):
                    pending[index] = item
                    self._give(index, item)
                if suspects and not pending:
                    index, item = suspects.popleft()
                    pending[index] = item
                    self._give(index, item)
                if not pending:
                    return
                index, reply = self._next()
                item = pending.pop(index)
                if reply is None and index not in tried:
                    # Dask cannot tell which task a worker died of: once more at the end, alone
                    tried.add(index)
                    suspects.append((index, item))
                    continue
                outcome, raised = reply or (_deadly(), ())
                for warning_told in {*raised} - self._told:
                    self._told.add(warning_told)
                    warnings.warn_explicit(*warning_told)
                yield index, outcome
        finally:
            self._drop()

    def _take(self, function: Callable) -> None:
        """Take the function of the tasks that follow."""
        self._function: Any = function

    def _give(self, index: int, item: object) -> None:
        """Give out a task."""
        self._waiting.append((index, item))

    def _next(self) -> tuple[int, Any]:
        """Number of a task that comes back, and what `_call` returned; None where it ended its worker."""
        index, item = self._waiting.popleft()
        return index, _call(self._function, item)

    def _drop(self) -> None:
        """Forget the tasks that have not come back."""
        self._waiting.clear()


def _call(function: Callable, item: object) -> tuple[Any, list[tuple]]:
    """Value of a task, and its warnings."""
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        value = function(item)
    return value, [
        (str(warning_told.message), warning_told.category, warning_told.filename, warning_told.lineno)
        for warning_told in raised
    ]


def _deadly() -> FemgearError:
    remedy = "compute it alone, without workers, and look at what it says; give it more memory"
    return FemgearError("it ends its worker, twice", code="E-WORKER", remedy=remedy)


def _packed(value: object) -> bytes:
    """A function or an item as `_call_packed` takes it."""
    try:
        return pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise CaseError(
            f"a function cannot be sent to workers: {error}",
            code="E-WORKER",
            limit="functions of importable modules",
            remedy="compute without workers",
        ) from None


@lru_cache(maxsize=1)
def _unpacked(function: bytes) -> Callable:
    """The function of a worker, which keeps it, and what it has made, from task to task."""
    return pickle.loads(function)


def _call_packed(version: str, function: bytes, item: bytes) -> tuple[Any, list[tuple]]:
    """As `_call`, in a worker: one task at a time, whatever threads it has."""
    if version != __version__:
        message = "a worker has another version of femgear"
        raise FemgearError(message, code="E-CLUSTER", value=__version__, limit=version)
    with _one_task:
        _limited()
        return _call(_unpacked(function), pickle.loads(item))


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
        self._sent: dict[Any, bytes] = {}

    def __exit__(self, *_):
        self._drop()
        for connection in [*self._processes]:
            self._end(connection)

    def _feed(self) -> None:
        """Send tasks that wait to processes that have none."""
        while self._waiting and len(self._busy) < self.workers:
            index, item = self._waiting.popleft()
            task = _packed(item)
            idle = self._processes.keys() - self._busy.keys()
            connection = idle.pop() if idle else self._start()
            self._busy[connection] = index
            new = self._sent.get(connection) is not self._function
            self._sent[connection] = self._function
            with suppress(OSError):  # of a dead one the end is read
                connection.send((__version__, self._function if new else None, task))

    def _take(self, function: Callable) -> None:
        self._function = _packed(function)

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

    def _end(self, connection: Connection) -> int:
        """End a process, whatever it is at; the number of its task, -1 for none."""
        process, _ = self._processes.pop(connection), self._sent.pop(connection, None)
        connection.close()
        process.kill()
        process.join()
        return self._busy.pop(connection, -1)


def _serve(connection: Connection) -> None:
    """Run the tasks that come over a connection, until it or the process that started this one ends."""
    parent: Any = multiprocessing.parent_process()
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(EOFError, OSError):
        connection.send(None)
        function = b""
        while True:
            version, new, item = connection.recv()
            function = new or function
            try:
                reply = _call_packed(version, function, item)
            except Exception as error:
                reply = error
            connection.send(reply)


def _one_death() -> Any:
    """Plugin of a scheduler: tasks of femgear are given up with their worker, and nothing is kept of them."""
    from dask.utils import key_split
    from distributed import SchedulerPlugin

    class OneDeath(SchedulerPlugin):
        name = "femgear"

        async def start(self, scheduler):
            self.scheduler = scheduler

        def transition(self, key, start, finish, *args, **kwargs):
            if finish == "processing" and _TASK in str(key):
                self.scheduler.tasks[key].suspicious = self.scheduler.allowed_failures or 0

        def update_graph(self, scheduler, *, keys=(), tasks=(), **kwargs):
            # a scheduler remembers 100 000 names of tasks, and for good that each was submitted
            if any(_TASK in str(key) for key in keys):
                key_split.cache_clear()
                spans = scheduler.extensions["spans"].spans
                for group in {scheduler.tasks[key].group for key in tasks}:
                    spans[group.span_id].metadata["collections"].clear()

    return OneDeath()  # of a class that is sent whole: schedulers need no femgear


class Dask(Runner):
    """Runs tasks on the workers of a Dask scheduler that the user has started, given its address."""

    def __init__(self, address: str):
        super().__init__()
        self._address, self._counted, self._threads = address, -_PERIOD, 0
        self._name, self._number = f"{_TASK}{uuid4()}", count()
        self._given: dict[Any, int] = {}
        self._done: queue.Queue = queue.Queue()
        try:
            from distributed import Client, Security
            from distributed.comm.addressing import get_address_host_port

            get_address_host_port(address, strict=True)  # a client of no address would wait for 40 s at its end
            if address.startswith("tls") and not Security().get_connection_args("client").get("ssl_context"):
                raise ValueError("no certificates are configured")  # it would wait for 40 s at its end
            # what it has to say of a lost connection is said by E-CLUSTER
            for name in ("distributed", "distributed.client"):
                logging.getLogger(name).setLevel(logging.CRITICAL)
            self._client: Any = Client(address, timeout=_TIMEOUT, set_as_default=False)
            self._client.register_plugin(_one_death())
        except (ImportError, OSError, RuntimeError, TypeError, ValueError) as error:
            raise self._lost(error) from None

    def __exit__(self, *_):
        self._drop()
        self._client.close(timeout=2)

    def _lost(self, error: object) -> FemgearError:
        return FemgearError(
            f"no scheduler answers: {error}",
            code="E-CLUSTER",
            key="--cluster",
            value=self._address,
            limit="tcp://host:port, or tls://host:port with certificates in the configuration of Dask",
            remedy='dask scheduler; where Dask is missing, pip install "femgear[cluster]"',
        )

    @property
    def workers(self) -> int:
        """Threads of all workers that there are."""
        if time.monotonic() > self._counted + _PERIOD:
            self._counted, self._threads = time.monotonic(), sum(self._client.nthreads().values())
        return max(self._threads, 1)

    def _take(self, function: Callable) -> None:
        import dask.config

        # a task of its own: where its value is lost with a worker, the scheduler makes it again
        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 TB"}):
            self._function = self._client.submit(bytes, _packed(function), pure=False)

    def _give(self, index: int, item: object) -> None:
        # schedulers keep every group of tasks for good: all of a client are one
        key, task = (self._name, next(self._number)), (__version__, self._function, _packed(item))
        future = self._client.submit(_call_packed, *task, key=key, pure=False)
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
        self._function = None


def open_runner(workers: int = 1, cluster: str | None = None) -> Runner:
    """Open the runner of so many processes, or of a Dask scheduler at an address, as a context.

    FemgearError: E-ARGUMENTS (workers and a cluster), E-RANGE (workers of nothing), E-CLUSTER (no scheduler
    answers).
    """
    number = checked_count(workers, "--workers", code="E-RANGE")
    scheme = cluster.partition("://")[0] if cluster and "://" in cluster else ""
    if scheme == "inproc":
        raise CaseError(
            "a scheduler within another process cannot be reached",
            code="E-ARGUMENTS",
            key="--cluster",
            value=cluster,
            limit="tcp://host:port or tls://host:port",
            remedy="dask scheduler starts one",
        )
    if cluster is None:
        return Processes(number) if number > 1 else Runner()
    if number > 1:
        message, remedy = "a cluster has workers of its own", "leave --workers out"
        raise CaseError(message, code="E-ARGUMENTS", key="--workers", value=number, remedy=remedy)
    return Dask(cluster)


def check_complete(keys: Collection[str], stored: Collection[str]) -> None:
    """Refuse (FemgearError, E-INCOMPLETE) a study of which keys are not among those stored or failed."""
    if lost := [key for key in keys if key not in stored]:
        message, remedy = f"{len(lost)} of {len(keys)} tasks have no outcome", "give the same command again"
        raise FemgearError(message, code="E-INCOMPLETE", value=lost[0], remedy=remedy)
