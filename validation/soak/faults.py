"""Systems that fail: programs end with a documented exit code and one message, and the next one works."""

from __future__ import annotations

import builtins
import errno
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from femgear.stages.protocol import one_blas_thread
from validation.soak.programs import (
    COMMANDS,
    Ended,
    contents,
    differences,
    left_over,
    start,
    trial_workspace,
    undisturbed,
    workspace,
)
from validation.soak.trials import Outcome

PIECE = 20
# a user without rights where the tests run as root, whom no permission stops
_NOBODY = 65534


@dataclass(frozen=True)
class Fault:
    """What a program meets.

    Parameters
    ----------
    before : callable, optional
        In its process, before it begins.
    codes : tuple of int
        Exit codes that are right; with 0 the fault need not matter.
    commands : tuple of str
        By turns.
    fresh : bool
        The program has an interpreter of its own (which `before` cannot change functions of).
    ends : tuple of int
        Exit codes of libraries that end the process themselves, as a kill would: nothing may be lost.
    """

    before: Callable[[], object] | None = None
    codes: tuple[int, ...] = (0, 4)
    environment: Mapping[str, str | None] = field(default_factory=dict)
    commands: tuple[str, ...] = ("run", "run over old results", "sweep of gears", "optimise", "sweep")
    fresh: bool = False
    ends: tuple[int, ...] = ()


def file_size(rng: random.Random) -> Fault:
    """Files that cannot grow beyond some size (``ulimit -f``), which the messages do not reach."""
    size = int(10 ** rng.uniform(3.5, 6.5))
    return Fault(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)), fresh=rng.random() < 0.3)


def full_disk(rng: random.Random) -> Fault:
    """A disk that says that it is nearly full."""
    free = rng.choice((0, 900_000, 1_000_100, 1_100_000))
    usage = shutil.disk_usage(".")._replace(free=free)
    return Fault(lambda: setattr(shutil, "disk_usage", lambda _: usage))


def failing_call(rng: random.Random) -> Fault:
    """The disk fails at some call: no space left, input/output error, no permission."""
    number = rng.choice((errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS, errno.EDQUOT, errno.EMFILE))
    name, left = rng.choice(("fsync", "replace", "mkdir", "open", "unlink", "write")), rng.randrange(12)

    def fail():
        if name == "write":
            _count_opened(left, number)
            return
        counter, real = [left], getattr(os, name)

        def failing(*arguments, **options):
            counter[0] -= 1
            if counter[0] == -1:
                raise OSError(number, os.strerror(number), str(arguments[0]))
            return real(*arguments, **options)

        setattr(os, name, failing)

    return Fault(fail)


def _count_opened(left: int, number: int) -> None:
    """Let the opening of a file for writing fail after some that succeed."""
    counter, real = [left], builtins.open

    def opening(file, mode="r", *arguments, **options):
        if not isinstance(file, int) and set(mode) & set("wxa+"):
            counter[0] -= 1
            if counter[0] == -1:
                raise OSError(number, os.strerror(number), str(file))
        return real(file, mode, *arguments, **options)

    builtins.open = opening


def read_only(rng: random.Random) -> Fault:
    """Folders that belong to somebody else."""
    if os.getuid():
        return Fault(lambda: [path.chmod(0o500) for path in (Path("out"), Path()) if path.exists()], codes=(4,))
    return Fault(_become_nobody, codes=(4,))


def no_home(rng: random.Random) -> Fault:
    """No home folder, and a user whom the system does not know."""
    names: dict[str, str | None] = dict.fromkeys("HOME XDG_CACHE_HOME XDG_CONFIG_HOME USER LOGNAME".split())
    if rng.random() < 0.5:
        names["FEMGEAR_MESHES"] = None
    return Fault(codes=(0,), environment=names, commands=("run", "run with pictures"), fresh=True)


def no_folder_for_temporary_files(rng: random.Random) -> Fault:
    """TMPDIR that is not there; or no folder at all for temporary files."""
    if rng.random() < 0.5:
        return Fault(codes=(0,), environment={"TMPDIR": "/nowhere"}, commands=("run", "sweep"))

    def nowhere():
        setattr(tempfile, "_candidate_tempdir_list", lambda: [])  # noqa: B010

    return Fault(nowhere, codes=(0, 3, 4), commands=("run of a set with grids", "sweep"))


def ascii_output(rng: random.Random) -> Fault:
    """Standard output in an encoding that has few letters."""
    encoding = rng.choice(("ascii", "latin-1", "cp1252", "cp437", "utf-16"))
    environment = {"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"}
    return Fault(codes=(0,), environment=environment, fresh=True, commands=("run", "optimise", "run with pictures"))


def closed_pipe(rng: random.Random) -> Fault:
    """Standard output into a pipe that nobody reads."""

    def close():
        read, write = os.pipe()
        os.close(read)
        os.dup2(write, 1)

    return Fault(close, codes=(0, 141), fresh=True, commands=("run", "sweep"))


def no_output(rng: random.Random) -> Fault:
    """Standard output or standard error closed, or a disk that is full."""
    number, full = rng.choice((1, 2)), rng.random() < 0.5

    def close():
        if full:
            os.dup2(os.open("/dev/full", os.O_WRONLY), number)
        else:
            os.close(number)

    return Fault(close, codes=(0, 4) if full else (0,), fresh=True, commands=("run", "sweep"))


def little_memory(rng: random.Random) -> Fault:
    """A limit of the address space or of the data segment (``ulimit -v``, ``ulimit -d``) from the start."""
    kind, size = rng.choice((resource.RLIMIT_AS, resource.RLIMIT_DATA)), int(10 ** rng.uniform(7.5, 9.3))
    commands = ("run", "run of a set with grids", "run over old results", "sweep of gears", "sweep")
    return Fault(lambda: resource.setrlimit(kind, (size, size)), codes=(0, 3), fresh=True, commands=commands)


def less_memory(rng: random.Random) -> Fault:
    """Memory that is short from some moment on, behind the begin of the computation."""
    moment, more = rng.uniform(0.0, 1.0), int(10 ** rng.uniform(7.3, 8.5))

    def start():
        with one_blas_thread():
            threading.Timer(moment, limit).start()

    def limit():
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        size = pages * resource.getpagesize() + more
        resource.setrlimit(resource.RLIMIT_AS, (size, size))

    commands = ("run", "run over old results", "sweep of gears", "sweep")
    ends = (1, -signal.SIGSEGV, -signal.SIGABRT)  # BLAS and HDF5 do not always ask what they were given
    return Fault(start, codes=(0, 3, 4), commands=commands, ends=ends)


def few_files(rng: random.Random) -> Fault:
    """So many files may be open at once (``ulimit -n``)."""
    count = rng.randint(5, 40)
    return Fault(lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (count, count)), codes=(0, 2, 4))


def clock_jumps(rng: random.Random) -> Fault:
    """A clock that jumps, mostly back."""
    generator = random.Random(rng.random())

    def jumping(real):
        return lambda: real() - generator.choice((0.0, 0.0, 3600.0, 1e9, -1e9))

    def jump():
        for name in ("time", "perf_counter", "monotonic"):
            setattr(time, name, jumping(getattr(time, name)))

    return Fault(jump, codes=(0,))


FAULTS = (
    *(file_size, full_disk, failing_call, read_only, no_home, no_folder_for_temporary_files, ascii_output),
    *(closed_pipe, no_output, little_memory, few_files, clock_jumps, failing_call, less_memory, file_size),
)
# one turn of all faults and one of two processes
_TURN = len(FAULTS) + 1
SHORT = (1, 2, 12)
"""Trials of the tests: those that need no interpreter of their own."""


def trial(number: int, folder: Path) -> Outcome:
    """Run a command under the fault with a number, then without."""
    turn, kind = divmod(number, _TURN)
    rng = random.Random(f"fault {number}")
    if kind == len(FAULTS):
        return _two_processes(number, rng, folder)
    fault = FAULTS[kind](rng)
    name = fault.commands[turn % len(fault.commands)]
    reference, place = undisturbed(name, folder), trial_workspace(name, folder, f"fault {number}")
    before = contents(place / "out") if COMMANDS[name].old else {}
    program = start(
        COMMANDS[name].arguments(place),
        place,
        before=fault.before,
        fresh=fault.fresh,
        environment=fault.environment,
    )
    ended = program.wait()
    failure = _wrong_end(ended, fault) or _wrong_results(ended, fault, place, before, reference.contents, name)
    failure = failure or _next_run(name, place, reference.contents)
    label = FAULTS[kind].__name__.replace("_", " ")
    if not failure:
        _remove(place)
    return Outcome(f"{label}: {ended.code}", failure and f"{label}, {name}: {failure}", megabytes=ended.megabytes)


def _wrong_end(ended: Ended, fault: Fault) -> str:
    """What is wrong with exit code and messages."""
    if ended.code in fault.ends and "Traceback" not in ended.err:
        return ""
    if ended.crash:
        return ended.crash
    if ended.code not in fault.codes:
        return f"ended with {ended.code}: {ended.err[-400:]}"
    visible = fault.before is None or "close" not in fault.before.__qualname__
    wanted = int(ended.code in (2, 3, 4) and visible)
    if len(ended.messages) != wanted and visible:
        return f"ended with {ended.code} and {len(ended.messages)} messages: {ended.err[-400:]}"
    return ""


def _wrong_results(ended: Ended, fault: Fault, place: Path, old: Mapping, new: Mapping, name: str) -> str:
    """What is wrong with the results: they are the new ones, whole, or the old ones as they were."""
    files = contents(place / "out") if (place / "out").is_dir() else {}
    if ended.code == 0:
        wrong = differences(files, new)
        return f"ended with 0, {wrong}" if wrong and wrong != "missing: sweep.png" else ""
    if ended.code in fault.ends:  # ended by a library, as by a kill: what it had begun is there beside the old results
        files = {file: content for file, content in files.items() if not file.startswith(".")}
    if old and files != old and files != new:
        return f"ended with {ended.code}, old results: {differences(files, old)}"
    return ""


def _next_run(name: str, place: Path, expected: Mapping) -> str:
    """What is wrong with the same command without the fault."""
    ended = start(COMMANDS[name].arguments(place), place).wait()
    files = contents(place / "out") if (place / "out").is_dir() else {}
    whole = ended.code == 4 and "--force" in ended.err
    if ended.crash or (ended.code and not whole):
        return f"the next run ended with {ended.code}: {ended.err[-400:]}"
    if wrong := differences(files, expected):
        return f"after the next run: {wrong}"
    if rest := left_over(place):
        return f"left over: {', '.join(rest)}"
    return ""


def _two_processes(number: int, rng: random.Random, folder: Path) -> Outcome:
    """Two processes with one folder: the one writes, the other is refused, and the results are whole."""
    name = rng.choice(("run", "run over old results", "sweep", "optimise", "sweep of gears"))
    reference, place = undisturbed(name, folder), trial_workspace(name, folder, f"fault {number}")
    other = workspace(folder / f"fault {number} other")
    words = COMMANDS[name].arguments(place)
    process = start(words, place)
    time.sleep(rng.uniform(0.0, reference.seconds))
    two = start(words, other)
    ends = [process.wait(), two.wait()]
    # the second may begin when the first has ended
    codes = sorted(end.code for end in ends)
    failure = next((end.crash for end in ends if end.crash), "")
    refusals = [end for end in ends if end.code]
    if not failure and (codes not in ([0, 0], [0, 4]) or any(len(end.messages) != 1 for end in refusals)):
        failure = f"ended with {codes}: {[end.err[-300:] for end in ends]}"
    failure = (
        failure
        or differences(contents(place / "out"), reference.contents)
        or _next_run(name, place, reference.contents)
    )
    if not failure:
        _remove(place)
        _remove(other)
    return Outcome(f"two processes: {codes[0]} and {codes[1]}", failure and f"two processes, {name}: {failure}")


def _become_nobody() -> None:
    os.setgid(_NOBODY)
    os.setuid(_NOBODY)
    sys.stdout.flush()


def _remove(place: Path) -> None:
    """Remove a workspace, whatever its permissions."""
    for path in (place, place / "out"):
        if path.exists():
            path.chmod(0o755)
    shutil.rmtree(place)
