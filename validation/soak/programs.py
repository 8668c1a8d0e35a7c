"""The programs of femgear as processes that can be watched, killed and starved; what they leave."""

from __future__ import annotations

import contextlib
import faulthandler
import hashlib
import importlib
import json
import os
import re
import resource
import runpy
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NoReturn

from femgear import cli
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).resolve().parents[2]
# what an undisturbed command may take [s]; loaded machines take longer than idle ones
_LIMIT = 120.0
_SLOW = tuple("femgear. h5netcdf h5py matplotlib numpy pandas rich scipy xarray tomllib pint".split())
"""Packages that this process imports for those that it starts."""
# what any run imports: without it the first command would run twice
_RUN_IMPORTS = (
    *("femgear.report.page", "femgear.run", "femgear.trains.gearbox.stages", "h5py", "rich.progress"),
    *("scipy.integrate", "scipy.optimize", "scipy.signal", "xarray.backends.h5netcdf_"),
)
_FEW = 30
_CRASH = 70
"""Exit code of a program that an exception ended; Python itself has 1."""


@dataclass(frozen=True)
class Ended:
    """How a program ended: with an exit code, or by a signal (then -signal is the code)."""

    code: int
    out: str
    err: str
    seconds: float
    megabytes: float

    @property
    def messages(self) -> list[str]:
        """First lines of the errors that it printed."""
        return re.findall(r"^\[E-[A-Z0-9-]+\].*|^interrupted$", self.err, re.MULTILINE)

    @property
    def crash(self) -> str:
        """What no program may print or do, empty where it did not."""
        for word in ("Traceback (most recent", "Exception ignored", "Fatal Python error", "HDF5-DIAG"):
            if word in self.err or word in self.out:
                return f"{word}: {self.err[-600:]}"
        if self.code in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE, _CRASH):
            return f"ended with {self.code}: {self.err[-600:]}"
        return ""


class Program:
    """A process that runs ``femgear`` or a script with its output in files beside its folder."""

    def __init__(self, pid: int, folder: Path):
        self.pid, self._folder, self._start = pid, folder, time.perf_counter()

    def kill(self, number: int) -> None:
        """Send a signal: Ctrl-C goes to the program and to what it started, others to it alone."""
        try:
            (os.killpg if number == signal.SIGINT else os.kill)(self.pid, number)
        except ProcessLookupError:  # it has not made its group yet
            os.kill(self.pid, number)

    def wait(self, limit: float = _LIMIT) -> Ended:
        """Wait until it ends; what does not end in time is killed, and an error."""
        while True:
            pid, status, used = os.wait4(self.pid, os.WNOHANG)
            seconds = time.perf_counter() - self._start
            if pid:
                break
            if seconds > limit:
                os.killpg(self.pid, signal.SIGKILL)
                os.wait4(self.pid, 0)
                raise TimeoutError(f"the program did not end within {limit:g} s")
            time.sleep(0.002)
        out, err = ((self._folder / name).read_text("utf-8", "replace") for name in ("stdout", "stderr"))
        return Ended(os.waitstatus_to_exitcode(status), out, err, seconds, used.ru_maxrss / 1024)


def start(
    arguments: Sequence[object],
    folder: Path,
    *,
    before: Callable[[], object] | None = None,
    fresh: bool = False,
    environment: Mapping[str, str | None] | None = None,
    note_modules: bool = False,
) -> Program:
    """Start ``femgear ARGUMENTS``, or a script where its path comes first.

    Parameters
    ----------
    folder : path
        Working directory, see `workspace`.
    before : callable, optional
        Called in the new process before the program: limits, changed functions, closed files.
    fresh : bool
        A new interpreter; else the new process has all that this one has imported, and starts at once.
    environment : mapping
        Variables to set, or with None to remove.
    note_modules : bool
        Write the names of all modules that the program imported into the file "modules".
    """
    words = [str(word) for word in arguments]
    given = {"TMPDIR": str(folder / "tmp"), "FEMGEAR_MESHES": str(folder / "meshes"), **(environment or {})}
    given |= {"PYTHONPATH": str(ROOT), "COLUMNS": "120"}
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return Program(pid, folder)
    code = _CRASH
    try:
        _become(folder, given)
        if before is not None:
            before()
        if fresh:
            prefix = ["-m", "femgear.cli"] if not words[0].endswith(".py") else []
            os.execv(sys.executable, [sys.executable, *prefix, *words])
        code = _call(words)
        if note_modules:
            Path("modules").write_text("\n".join(sys.modules))
    except BaseException:
        traceback.print_exc()
    finally:
        _leave(code)


def _become(folder: Path, environment: Mapping[str, str | None]) -> None:
    """Make this process one with a group, an environment, a folder and output files of its own."""
    os.setsid()
    faulthandler.disable()
    os.chdir(folder)
    for name, value in environment.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
    for number, name in ((1, "stdout"), (2, "stderr")):
        descriptor = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(descriptor, number)
        os.close(descriptor)
    sys.stdout, sys.stderr = (open(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    tempfile.tempdir = None


def _call(words: list[str]) -> int:
    """Run a program in this process."""
    if not words[0].endswith(".py"):
        return cli.main(words)
    sys.argv = words
    try:
        runpy.run_path(words[0], run_name="__main__")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def _leave(code: int) -> NoReturn:
    """End this process without the cleaning up of the one that it was forked from."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


@dataclass(frozen=True)
class Command:
    """A command on a small case: which case, and its words, of which "OUT" and "CASE" are replaced.

    ``old`` says that the folder holds results of another torque before.
    """

    case: str
    words: tuple[str, ...]
    old: bool = False

    def arguments(self, folder: Path) -> list[str]:
        """Words of the command line in a workspace."""
        places = {"OUT": str(folder / "out"), "CASE": str(folder / f"{self.case}.toml")}
        return [places.get(word, word) for word in self.words]


_RUN = ("run", "CASE", "-o", "OUT", "--no-pictures")
_TORQUES = "operation.torque=50 N m,100 N m,150 N m,200 N m,250 N m"
_SWEEP = ("sweep", "CASE", "-o", "OUT", "--of", "ste", "--of", "contact ratio sun-planet", "--over", _TORQUES)
_GEARS = (
    *("sweep", "CASE", "-o", "OUT", "--of", "contact ratio sun-planet", "--of", "tip thickness planet"),
    *("--over", "planet.profile_shift=0..0.2/20"),
)
_OPTIMISE = (
    *("optimise", "CASE", "-o", "OUT", "--method", "simplex", "--no-check"),
    *("--vary", "planet.profile_shift=-0.05..0.25 +- 0.01", "--goal", "tip thickness planet"),
    *("--limit", "tip thickness planet >= 0.72", "--of", "contact ratio sun-planet"),
)
COMMANDS = {
    "run": Command("chain", _RUN),
    "run over old results": Command("chain", (*_RUN, "--force"), old=True),
    "sweep of gears": Command("shifts", _GEARS),
    "optimise": Command("shifts", _OPTIMISE),
    "sweep": Command("set", _SWEEP),
    "run with pictures": Command("stages", ("run", "CASE", "-o", "OUT")),
    "run of a set": Command("set", _RUN),
    "run of a set with grids": Command("grids", _RUN),
}
QUICK = ("run", "run over old results", "sweep of gears", "optimise")


@cache
def case_texts() -> dict[str, str]:
    """Small cases by name: a drivetrain, a planetary set, one whose shifts are free, stages in series."""
    cases = ROOT / "cases"
    reference = read_case(cases / "planetary_27_40_108.toml")
    small = {"static.flank_elements": 5, "static.positions": 8, "static.stresses": False}
    small |= {"operation.speeds": ["1000 rpm", "2000 rpm"], "housing.published": None}
    quick = with_values(reference, small)
    free = re.sub(r"(?m)^profile_shift = .*\n", "", quick.source)
    short = {"transient.duration": "0.05 s", "transient.settle": "0.01 s", "transient.rate": "10 kHz"}
    chain = with_values(read_case(cases / "own_chain.toml"), short)
    return {
        "chain": chain.source,
        "other chain": with_values(chain, {"modes.damping_ratio": 0.05}).source,
        "set": quick.source,
        "grids": with_values(quick, {"static.flank_elements": 6}).source,
        "shifts": free,
        "stages": (cases / "published_four_stages.toml").read_text(encoding="utf-8"),
    }


def workspace(folder: Path, command: Command | None = None, *, grids: Path | None = None) -> Path:
    """Make an empty folder with the small cases, room for temporary files and a copy of known grids."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "tmp").mkdir(parents=True)
    for name, text in case_texts().items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    if grids is not None and grids.is_dir():
        shutil.copytree(grids, folder / "meshes")
    if command is not None and command.old:
        shutil.copytree(undisturbed("old", folder.parent).folder / "out", folder / "out")
    return folder


@dataclass(frozen=True)
class Undisturbed:
    """What a command leaves where nothing disturbs it: its workspace, contents of its files, seconds."""

    folder: Path
    contents: dict[str, str]
    seconds: float


@cache
def undisturbed(name: str, folder: Path) -> Undisturbed:
    """Run a command once, in ``folder``; "old" is the run whose results the others find."""
    command = Command("other chain", _RUN) if name == "old" else COMMANDS[name]
    place = folder / f"undisturbed {name}"
    for module in _RUN_IMPORTS:
        importlib.import_module(module)
    for _ in range(2):
        shutil.rmtree(place, ignore_errors=True)
        workspace(place, command, grids=_grids(name, folder))
        ended = start(command.arguments(place), place, before=stop_clock, note_modules=True).wait()
        if ended.code or ended.crash:
            raise AssertionError(f"{name} without disturbance ended with {ended.code}: {ended.err}")
        if _load(place / "modules") < _FEW:
            break
    return Undisturbed(place, contents(place / "out"), ended.seconds)


def stop_clock() -> None:
    """Make every stage and design take no time, so that the files that hold times are the same every time."""
    time.perf_counter = lambda: 0.0


def _load(names: Path) -> int:
    """Import the modules that a program had imported: the next one starts with them; how many there were."""
    missing = [name for name in names.read_text().split() if name not in sys.modules and name.startswith(_SLOW)]
    for name in missing:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    return len(missing)


def _grids(name: str, folder: Path) -> Path | None:
    """Grids that a command finds in its cache: none where it shall make them."""
    return set_grids(folder) if name in ("sweep", "run of a set") else None


@cache
def set_grids(folder: Path) -> Path:
    """Make the grids of the small planetary set once."""
    place = workspace(folder / "grids of a set")
    words = ("run", place / "set.toml", "-o", place / "out", "--no-pictures", "--only", "static")
    ended = start(words, place).wait()
    assert ended.code == 0, ended.err
    return place / "meshes"


def trial_workspace(name: str, folder: Path, label: str) -> Path:
    """Make the workspace in which a command is tried."""
    return workspace(folder / label, COMMANDS[name], grids=_grids(name, folder))


def contents(folder: Path) -> dict[str, str]:
    """Hash every file of a folder by its path, without times; journals by line."""
    return {str(path.relative_to(folder)): _content(path) for path in sorted(folder.rglob("*")) if not path.is_dir()}


def _content(path: Path) -> str:
    data = path.read_bytes()
    if path.name == "manifest.json":
        table = json.loads(data)
        table.pop("timings")
        table["files"].pop("report.html", None)
        # a checksum of the manifest itself covers its times
        table.pop("checksum", None)
        data = json.dumps(table, sort_keys=True).encode()
    elif path.suffix == ".jsonl":
        data = "\n".join(json.dumps(record) for record in journal_records(path)).encode()
    elif path.name == ".written":  # checksums of all that was ever written here, some of it with times
        data = b"\n".join(sorted({line.split()[-1] for line in data.splitlines()}))
    elif path.name == "report.html":
        data = re.sub(rb"(?s)<caption>Time</caption>.*?</table>", b"", data)
    return hashlib.sha256(data).hexdigest()[:16]


def journal_records(path: Path) -> list:
    """Give the whole lines of a journal without times and checksums, each line as JSON."""
    text = path.read_bytes()
    return [_plain(json.loads(line)) for line in text[: text.rfind(b"\n") + 1].splitlines()]


def _plain(value):
    """A value of JSON without what differs from run to run."""
    if isinstance(value, dict):
        timeless = {key: _plain(item) for key, item in value.items()}
        return {key: item for key, item in timeless.items() if key not in ("seconds", "checksum", "sha256", "crc")}
    return [_plain(item) for item in value] if isinstance(value, list) else value


def differences(values: Mapping[str, str], expected: Mapping[str, str]) -> str:
    """Name the files that differ, are missing or are too many."""
    parts = {
        "differ": [name for name in values if name in expected and values[name] != expected[name]],
        "missing": [name for name in expected if name not in values],
        "left over": [name for name in values if name not in expected],
    }
    return "; ".join(f"{words}: {', '.join(names)}" for words, names in parts.items() if names)


def left_over(place: Path) -> list[str]:
    """Temporary files and folders that a workspace still holds, outside the results."""
    grids = place / "meshes"
    hidden = [path.name for path in grids.glob(".*")] if grids.is_dir() else []
    return [path.name for path in (place / "tmp").iterdir()] + hidden


def commit() -> str:
    """Name the last commit that changed what is tested, with a plus where there are changes that it lacks.

    "unknown" outside of git.
    """

    def git(*words: str) -> str:
        done = subprocess.run(("git", *words), cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    tested = ("--", "femgear", "scripts")
    last = git("log", "-1", "--format=%h", *tested) or "unknown"
    return last + "+" * bool(git("status", "--short", *tested))
