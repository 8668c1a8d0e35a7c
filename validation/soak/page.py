"""docs/reliability.md: what soak tests did with the last commit, and all that failed."""

from __future__ import annotations

import time
from pathlib import Path

from validation.soak.programs import ROOT
from validation.soak.state import State
from validation.soak.trials import KINDS, Tally

HEAD = """# Reliability

What femgear does with hostile case files, damaged results, killed processes and failing systems. Short
forms run with `make test`. `make soak MINUTES=60` goes on for that many minutes from where it was, and
writes this page. `python validation/soak KIND NUMBER` repeats a trial by its kind and number.
"""
WORDS = {
    "case_text": (
        "Case files",
        """Case files of the repository with changed numbers, units, texts and keys. Some are cut at any byte,
have lines missing, repeated or exchanged, are nested, or have up to 10 MB. Each is described or
refused within 1 s of CPU time and 500 MB.""",
    ),
    "damage": (
        "Damaged files",
        """Results, manifests, cases as run, journals of sweeps and cached grids with changed, missing or
foreign contents. The numbers are the same as before, or refused, and no reader crashes. In trials
of "own checksums" the manifest fits the damage: numbers may differ there, but nothing may crash.""",
    ),
    "kills": (
        "Kills",
        """Runs, runs over old results, sweeps and searches, ended by SIGKILL, SIGTERM or SIGINT at a random
moment. The same command then goes on and ends with the same bits as one that nothing disturbed. It
computes no finished stage or design again and leaves no other files behind.""",
    ),
    "faults": (
        "Faults",
        """Disks that are full, read-only or fail; no home and no folder for temporary files. Standard output
that is closed, full or takes ASCII only. Limits of memory, file size and open files, clocks that
jump, two processes in one folder. The number behind the colon is the exit code. Each trial ends
with a documented code and one message, and leaves old results whole. The same command works
afterwards.""",
    ),
    "sets": (
        "Random planetary sets",
        """Valid sets beyond those of the tests: equilibrium, symmetry between planets, orders of the housing,
static limit of the dynamics.""",
    ),
    "determinism": (
        "Bits",
        """The same files, bit for bit, with one or two BLAS threads, and with known or new grids. Locale, hash
seed, time zone, level of optimisation and folder do not matter either. Times are left out: they
stand in the manifest, the journals and the report.""",
    ),
}
KNOWN = """## What may differ or fail, and why

* Times differ from run to run. They stand in `manifest.json` (`timings`), in the `seconds` of journals and in
  the table "Time" of the report, and nowhere else.
* Other versions of NumPy, SciPy or Gmsh, and other processors, may round differently; the manifest names the
  versions.
* With a limit below 600 MB (`ulimit -v`, `-d`) femgear does not begin: loading its libraries would end or
  stop the process. Scripts import NumPy first, whose own message then comes. Where memory ends later,
  E-MEMORY says so. Within compiled libraries (BLAS, HDF5) that may also end the process. Results on disk
  are whole then, as after a kill.
"""
# results of a kind that are listed
_MOST = 40


def write_page(state: State, path: Path, mutants: Path) -> None:
    """Write the page of the last commit of a state, with the report of ``make mutants`` if there is one."""
    report = mutants.read_text(encoding="utf-8") if mutants.exists() else ""
    path.write_text(page(state, report), encoding="utf-8")


def page(state: State, mutants: str = "") -> str:
    """Make the text of the page, with the report of mutants as its last section but one."""
    if not state.records:
        return f"{HEAD}\nNothing has run yet.\n\n{KNOWN}"
    last = state.records[-1]["commit"]
    trials = {kind: state.of(kind, last) for kind in KINDS}
    parts = [HEAD, _summary(state, last, trials)]
    for kind, (records, tally) in trials.items():
        if records:
            parts.append(_section(kind, tally))
    failures = [failure for _, tally in trials.values() for failure in tally.failures]
    count = sum(tally.failed for _, tally in trials.values())
    parts.append("## Failures\n")
    if count > len(failures):
        parts.append(f"{count} in all, of which {len(failures)} are listed.\n")
    parts.append("\n".join(map(_item, failures)) + "\n" if failures else "None.\n")
    if mutants:
        parts.append(mutants.replace("\n## ", "\n### ").replace("# Mutants", "## Mutants of the core"))
    return "\n".join([*parts, KNOWN])


def _worst(trials: list, digits: int) -> str:
    """The largest value with the number of its trial, nothing where none was measured."""
    return f"{trials[0]:.{digits}f} ({trials[1]})" if trials[1] >= 0 else ""


def _item(failure: str) -> str:
    """A failure as an item of a list, on one line, without the place of the clone."""
    plain = failure.replace("`", "'").replace(f"{ROOT}/", "")
    return f"* `{' '.join(plain.split())[:300]}`"


def _summary(state: State, last: str, trials_of_kind: dict[str, tuple[list[dict], Tally]]) -> str:
    """Say what ran, and give a line for every kind."""
    records = [record for those, _ in trials_of_kind.values() for record in those]
    hours = sum(record["seconds"] for record in records) / 3600.0
    day = time.strftime("%Y-%m-%d", time.gmtime(max(record["ended"] for record in records)))
    before = [record for record in state.records if record["commit"] != last]
    lines = [
        f"Commit {last} until {day}, without later changes of femgear/ and scripts/:",
        f"{60 * hours:.0f} minutes of processes on {records[-1]['machine']}.",
        "",
        "| | pieces | trials | failures | most CPU time [s] | most memory [MB] | minutes |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for kind, (those, tally) in trials_of_kind.items():
        minutes = sum(record["seconds"] for record in those) / 60.0
        slow, large = _worst(tally.worst_seconds, 2), _worst(tally.worst_megabytes, 0)
        cells = (WORDS[kind][0], len(those), tally.trials, tally.failed, slow, large, f"{minutes:.0f}")
        lines.append(f"| {' | '.join(map(str, cells))} |")
    lines += ["", "Behind times and memory stands the number of their trial."]
    if before:
        trials = sum(record["tally"]["trials"] for record in before)
        lines.append(f"Earlier commits had {trials} trials of other numbers.")
    return "\n".join(lines) + "\n"


def _section(kind: str, tally: Tally) -> str:
    """Describe a kind and count how its trials ended."""
    title, words = WORDS[kind]
    common = tally.said.most_common()
    rows = [f"| {said} | {count} |" for said, count in common[:_MOST]]
    if rest := sum(count for _, count in common[_MOST:]):
        rows.append(f"| others | {rest} |")
    rows += [f"| **{name}, altogether** | {count} |" for name, count in sorted(tally.counts.items())]
    return "\n".join([f"## {title}\n\n{words}\n", "| outcome | trials |", "|---|---:|", *rows]) + "\n"
