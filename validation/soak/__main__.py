"""Soak tests for as long as one likes, or one trial again.

``python validation/soak --minutes 60`` goes on from the last piece and writes docs/reliability.md at its end;
``python validation/soak KIND NUMBER`` repeats one trial.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "scripts")]
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from validation.soak.page import write_page  # noqa: E402
from validation.soak.programs import commit  # noqa: E402
from validation.soak.state import State, machine  # noqa: E402
from validation.soak.trials import KINDS, Tally, module, run_trials  # noqa: E402

FOLDER = ROOT / "out" / "soak"
# shares of the time
_WEIGHTS = {"case_text": 30, "damage": 15, "kills": 25, "faults": 15, "sets": 10, "determinism": 5}
# minutes after which a piece counts as hanging
_HANGS = 20.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run pieces for some time, or the trial that is named; exit code 0, 1 (failures), 130 (interrupted)."""
    parser = argparse.ArgumentParser(prog="python validation/soak", description=__doc__)
    parser.add_argument("kind", nargs="?", choices=KINDS, help="of the trial to repeat, or to soak alone")
    parser.add_argument("number", nargs="?", type=int, help="of the trial to repeat")
    parser.add_argument("--piece", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--minutes", type=float, help="time after which no further piece is begun")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the state and of workspaces")
    parser.add_argument("--page", type=Path, help="write the page of what has been done here")
    given = parser.parse_args(arguments)
    if given.kind and given.piece is not None:
        size = module(given.kind).PIECE
        numbers = range(given.piece * size, (given.piece + 1) * size)
        tally = run_trials(given.kind, numbers, given.folder / "trials" / f"{given.kind} {given.piece}")
        print(json.dumps(tally.record()))
        return 0
    if given.kind and given.number is not None:
        tally = run_trials(given.kind, [given.number], given.folder / "trials" / "again")
        print(*tally.said, *tally.failures, sep="\n")
        return int(tally.failed > 0)
    state, code = State(given.folder / "state.jsonl"), 0
    if given.minutes:
        code = soak(state, given.folder, given.minutes, given.processes, (given.kind,) if given.kind else KINDS)
    if given.page:
        write_page(state, given.page, ROOT / "out" / "mutants" / "report.md")
    return code


@dataclass
class Piece:
    """A piece that runs in a process of its own."""

    kind: str
    index: int
    folder: Path

    def __post_init__(self):
        self.start = time.monotonic()
        words = (sys.executable, str(ROOT / "validation" / "soak"), self.kind, "--piece", str(self.index))
        words += ("--folder", str(self.folder))
        self.log = self.folder / f"{self.kind} {self.index}.err"
        self.folder.mkdir(parents=True, exist_ok=True)
        with open(self.log, "w") as log:
            self.process = subprocess.Popen(
                words, stdout=subprocess.PIPE, stderr=log, text=True, start_new_session=True
            )

    @property
    def seconds(self) -> float:
        """Time since its begin."""
        return time.monotonic() - self.start

    def stop(self) -> None:
        """End it with all that it started in its group."""
        os.killpg(self.process.pid, signal.SIGKILL)

    def tally(self) -> Tally:
        """Read what it found; a piece that crashed or hung is a failure."""
        out, _ = self.process.communicate()
        said, command = (
            self.log.read_text(errors="replace"),
            f"python validation/soak {self.kind} --piece {self.index}",
        )
        self.log.unlink()
        try:
            tally = Tally(**json.loads(out.splitlines()[-1]))
        except (IndexError, ValueError):
            tally = Tally(self.kind)
            tally.fail(command, f"ended with {self.process.returncode}: {said[-500:]}")
        work = self.folder / "trials" / f"{self.kind} {self.index}"
        shutil.rmtree(work, ignore_errors=True)
        return tally


def soak(state: State, folder: Path, minutes: float, processes: int, kinds: Sequence[str]) -> int:
    """Run pieces in so many processes until the time is over; the next call repeats interrupted ones."""
    now, here = commit(), machine()
    spent = {kind: state.seconds(kind, now) for kind in kinds}
    # from here on: what Git and a long state take on a loaded machine would leave no time for a piece
    end, running, failed = time.monotonic() + 60.0 * minutes, [], 0
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # no piece is left behind
    try:
        while running or time.monotonic() < end:
            while len(running) < processes and time.monotonic() < end:
                kind = min(kinds, key=lambda kind: spent[kind] / _WEIGHTS[kind])
                index = state.next_index(kind, {piece.index for piece in running if piece.kind == kind})
                # its time counts when it ends; until then it counts as a usual one
                spent[kind] += 60.0
                running.append(Piece(kind, index, folder))
            time.sleep(0.2)
            for piece in [piece for piece in running if piece.process.poll() is not None]:
                running.remove(piece)
                spent[piece.kind] += piece.seconds - 60.0
                tally, seconds = piece.tally(), round(piece.seconds, 1)
                record = {"kind": piece.kind, "index": piece.index, "commit": now, "machine": here}
                state.add(record | {"seconds": seconds, "ended": int(time.time()), "tally": tally.record()})
                failed += tally.failed
                print(f"{piece.kind} {piece.index}: {tally.trials} trials, {tally.failed} failures, {seconds} s")
                print(*tally.failures, sep="\n", end="\n" * bool(tally.failures), flush=True)
            for piece in running:
                if piece.seconds > 60.0 * _HANGS:
                    piece.stop()
    except KeyboardInterrupt:
        print("interrupted; the same command goes on", file=sys.stderr)
        return 130
    finally:
        for piece in running:
            piece.stop()
            piece.process.wait()
        signal.signal(signal.SIGTERM, before)
    return int(failed > 0)


if __name__ == "__main__":
    raise SystemExit(main())
