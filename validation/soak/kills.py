"""Programs killed at random moments: the same command then goes on, and gives what it gives undisturbed."""

from __future__ import annotations

import json
import random
import shutil
import signal
import time
from pathlib import Path

from femgear.errors import FemgearError
from femgear.storage.results import KEPT
from femgear.trains.reading import open_results
from femgear.trains.registry import TRAINS
from validation.soak.programs import (
    COMMANDS,
    QUICK,
    Undisturbed,
    contents,
    differences,
    journal_records,
    left_over,
    start,
    trial_workspace,
    undisturbed,
)
from validation.soak.trials import Outcome

PIECE = 12
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
SHORT = (0, 8, 6, 3, 7, 11)
"""Trials of the tests: run, sweep of gears and search, every signal."""


def trial(number: int, folder: Path) -> Outcome:
    """Kill the command with a number at a random moment, run it again and compare."""
    rng = random.Random(f"kill {number}")
    # the first trials, which the tests run, take the quick commands
    names = QUICK if number < 12 else tuple(COMMANDS)
    name, number_of_signal = names[number % len(names)], SIGNALS[number // len(names) % len(SIGNALS)]
    reference = undisturbed(name, folder)
    place = trial_workspace(name, folder, f"kill {number}")
    # a few with an interpreter of their own: killed while it loads, or cleans up
    fresh = number >= 12 and rng.random() < 0.2
    moment = rng.uniform(0.0, reference.seconds + (1.5 if fresh else 0.0))
    program = start(COMMANDS[name].arguments(place), place, fresh=fresh)
    time.sleep(moment)
    program.kill(number_of_signal)
    killed = program.wait()
    failure = _wrong_end(killed, number_of_signal) or _unreadable(place / "out", name, reference, folder)
    done = _finished(place / "out")
    twice = 0
    if not failure:
        failure, twice = _go_on(name, place, reference, done)
    said = f"{name}, {signal.Signals(number_of_signal).name}: " + ("ended before" if killed.code == 0 else "killed")
    if failure:
        failure = f"{said} after {moment:.3f} s: {failure}"
    else:
        shutil.rmtree(place)
    if twice and not failure:
        failure = f"{said} after {moment:.3f} s: {twice} computed twice"
    return Outcome(said, failure, counts={"kills": killed.code != 0, "computed twice": twice})


def _wrong_end(killed, number: int) -> str:
    """What is wrong with the end of a program that was sent a signal."""
    # shells say 130 for the end by SIGINT, too, which Python chooses where a class was being made
    expected = (-signal.SIGKILL,) if number == signal.SIGKILL else (130, -number, -signal.SIGINT)
    if killed.code == 0 or killed.code in expected:
        # a program that has not begun has no handler, and nothing to lose
        return killed.crash if killed.code == 130 or killed.code == 0 else ""
    return f"ended with {killed.code}: {killed.err[-500:]}"


def _unreadable(out: Path, name: str, reference: Undisturbed, folder: Path) -> str:
    """What is wrong with the results as a reader finds them after the kill."""
    if not name.startswith("run") or not (out / "manifest.json").is_file():
        return ""
    wholes = [reference.folder, undisturbed("old", folder).folder] if COMMANDS[name].old else [reference.folder]
    try:
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            results = open_results(out)
            stored = {stage: results[stage] for stage in results.stages}
    except FemgearError:
        return ""
    for whole in wholes:
        expected = open_results(whole / "out")
        if all(data.identical(expected[stage]) for stage, data in stored.items()):
            return ""
    return "the results after the kill are neither the old nor the new ones"


def _finished(out: Path) -> set[str]:
    """Stages that a killed run had written down for one that goes on, once they took ten seconds."""
    stages = set()
    for manifest in (out / "manifest.json", out / ".running" / "manifest.json"):
        if manifest.is_file():
            table = json.loads(manifest.read_bytes())
            if table["complete"]:
                continue  # old results, or new ones that the same command replaces once more
            stages |= {Path(file).stem for file in table["files"] if file.startswith(f"{KEPT}/")}
    return stages


def _go_on(name: str, place: Path, reference: Undisturbed, done: set[str]) -> tuple[str, int]:
    """Run the command again: what is wrong with what it leaves, and how much it computed twice."""
    trace = place / "trace"
    again = start(COMMANDS[name].arguments(place), place, before=lambda: trace_stages(trace)).wait()
    # the results were complete: they are compared below
    refused = again.code == 4 and "--force" in again.err
    if again.crash or (again.code and not refused):
        return f"again: ended with {again.code}: {again.crash or again.err[-500:]}", 0
    if wrong := differences(contents(place / "out"), reference.contents):
        return f"again: {wrong}", 0
    if rest := left_over(place):
        return f"left over: {', '.join(rest)}", 0
    computed = trace.read_text().split() if trace.exists() else []
    twice = sum(stage in done for stage in computed) if name.startswith("run") else 0
    for journal in (place / "out").glob("*.jsonl"):
        whole = journal_records(reference.folder / "out" / journal.name)
        twice += max(len(journal_records(journal)) - len(whole), 0)
    return "", twice


def trace_stages(path: Path) -> None:
    """Write the name of every stage that this process computes to a file."""

    def traced(name, solve):
        def solved(*arguments, **options):
            with open(path, "a") as stream:
                stream.write(f"{name}\n")
            return solve(*arguments, **options)

        return solved

    for train in TRAINS:
        for stage in train.train.stages:
            object.__setattr__(stage, "solve", traced(stage.name, stage.solve))
            if stage.parts is not None:
                object.__setattr__(stage, "parts", traced(stage.name, stage.parts))
