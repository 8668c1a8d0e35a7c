"""What soak tests have done so far: one JSON line a piece, so that the next call goes on."""

from __future__ import annotations

import json
import os
import platform
from collections import Counter
from pathlib import Path

from validation.soak.trials import Tally


class State:
    """Records of pieces in a file: kind, index, commit, machine, seconds, the tally of their trials."""

    def __init__(self, path: Path):
        self.path = path
        self.records: list[dict] = []
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                try:
                    self.records.append(json.loads(line))
                except ValueError:
                    continue  # half a line of a call that was killed: its piece is run again

    def add(self, record: dict) -> None:
        """Append the record of a piece and force it out."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with open(self.path, "a+b") as stream:
            if stream.tell():
                stream.seek(-1, os.SEEK_END)
                if stream.read(1) != b"\n":
                    stream.write(b"\n")
            stream.write(json.dumps(record, ensure_ascii=True).encode() + b"\n")
            stream.flush()
            os.fsync(stream.fileno())
        self.records.append(record)

    def next_index(self, kind: str, running: set[int]) -> int:
        """Find the first piece of a kind that is neither done nor running."""
        done = {record["index"] for record in self.records if record["kind"] == kind} | running
        return next(index for index in range(len(done) + 1) if index not in done)

    def seconds(self, kind: str, commit: str) -> float:
        """Sum the seconds that a kind has had with a commit."""
        return sum(r["seconds"] for r in self.records if r["kind"] == kind and r["commit"] == commit)

    def of(self, kind: str, commit: str) -> tuple[list[dict], Tally]:
        """Give the records of a kind with a commit, and the sum of their tallies."""
        records = [r for r in self.records if r["kind"] == kind and r["commit"] == commit]
        return records, summed(kind, [r["tally"] for r in records])


def summed(kind: str, tallies: list[dict]) -> Tally:
    """Sum tallies as they stand in records."""
    total = Tally(kind)
    for tally in tallies:
        total.trials += tally["trials"]
        total.failed += tally["failed"]
        total.failures += tally["failures"]
        total.said += Counter(tally["said"])
        total.counts += Counter(tally["counts"])
        total.worst_seconds = max(total.worst_seconds, tally["worst_seconds"])
        total.worst_megabytes = max(total.worst_megabytes, tally["worst_megabytes"])
    return total


def machine() -> str:
    """Say in a line on what the pieces ran."""
    cores = os.cpu_count()
    return f"{platform.system()} {platform.machine()}, {cores} cores, Python {platform.python_version()}"
