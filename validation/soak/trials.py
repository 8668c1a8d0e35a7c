"""Trials: what one of them found, and the sum of many; each is repeated by its kind and number."""

from __future__ import annotations

import contextlib
import gc
import importlib
import signal
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import femgear

KINDS = ("case_text", "damage", "kills", "faults", "sets", "determinism")
"""Modules of this folder that have trials."""
# failures of a piece that are kept word by word; further ones are counted
_MOST_SHOWN = 20


@dataclass(frozen=True)
class Outcome:
    """What a trial found.

    Parameters
    ----------
    said : str
        The result in a word or two, such as "refused E-TOML"; the page counts them.
    failure : str
        What must not be, empty where all is well.
    counts : mapping of str to int
        What else is summed over the trials, such as "computed twice".
    seconds, megabytes : float
        CPU time and memory of what was tried, where the trial measures them itself.
    """

    said: str
    failure: str = ""
    counts: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    megabytes: float = 0.0


@dataclass
class Tally:
    """Sum of many trials of a kind.

    Parameters
    ----------
    worst_seconds, worst_megabytes : [float, int]
        Largest value and the number of its trial.
    failures : list of str
        Each begins with the command that repeats it.
    """

    kind: str
    trials: int = 0
    said: Counter = field(default_factory=Counter)
    counts: Counter = field(default_factory=Counter)
    failed: int = 0
    failures: list[str] = field(default_factory=list)
    worst_seconds: list = field(default_factory=lambda: [0.0, -1])
    worst_megabytes: list = field(default_factory=lambda: [0.0, -1])

    def add(self, number: int, outcome: Outcome) -> None:
        """Add the outcome of the trial with a number."""
        self.trials += 1
        self.said[outcome.said] += 1
        self.counts.update(outcome.counts)
        if outcome.seconds > self.worst_seconds[0]:
            self.worst_seconds = [round(outcome.seconds, 3), number]
        if outcome.megabytes > self.worst_megabytes[0]:
            self.worst_megabytes = [round(outcome.megabytes, 1), number]
        if outcome.failure:
            self.fail(f"python validation/soak {self.kind} {number}", outcome.failure)

    def fail(self, command: str, what: str) -> None:
        """Note a failure with the command that repeats it."""
        self.failed += 1
        if len(self.failures) < _MOST_SHOWN:
            self.failures.append(f"{command}: {what}")

    def record(self) -> dict:
        """Give the contents as a table of JSON."""
        return vars(self) | {"said": dict(self.said), "counts": dict(self.counts)}


def module(kind: str):
    """Import the module of a kind."""
    return importlib.import_module(f"validation.soak.{kind}")


def run_trials(kind: str, numbers: Iterable[int], folder: Path) -> Tally:
    """Run trials of a kind; an exception that a trial does not expect is its failure.

    Parameters
    ----------
    folder : path
        Emptied by nobody: trials make folders of their own names in it and remove them where all was well.
    """
    trial, tally = module(kind).trial, Tally(kind)
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        try:
            outcome = trial(number, folder)
        except Exception:
            outcome = Outcome("broken trial", failure=traceback.format_exc(limit=-6))
        tally.add(number, outcome)
    return tally


class TooSlow(BaseException):
    """A trial was stopped; no `Exception`, so that nothing that is tried catches it."""


class Meter:
    """CPU time [s] and additional memory [MB] of a block, see `metered`."""

    seconds = megabytes = 0.0


@contextlib.contextmanager
def metered(limit: float) -> Iterator[Meter]:
    """Measure a block; `TooSlow` is raised in it after so many seconds of CPU time.

    What other code has left in memory is not collected within it.
    """

    def stop(*_):
        raise TooSlow

    gc.freeze()
    meter, before = Meter(), signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    resident, start = _status("VmRSS"), time.process_time()
    try:
        yield meter
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
        meter.seconds = time.process_time() - start
        gc.unfreeze()
        meter.megabytes = max(_status("VmHWM") - resident, 0.0)


def _status(name: str) -> float:
    """Memory of this process [MB]: what it has (VmRSS), or its peak (VmHWM)."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(f"{name}:"))
    return float(line.split()[1]) / 1000


def place_in_package(error: BaseException) -> str:
    """File and line of femgear where an exception was last seen, empty where it never was there."""
    package = Path(femgear.__file__).parent
    frames = traceback.extract_tb(error.__traceback__)
    of_package = [frame for frame in frames if Path(frame.filename).is_relative_to(package)]
    return f"{Path(of_package[-1].filename).name}:{of_package[-1].lineno}" if of_package else ""
