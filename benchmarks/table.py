"""Benchmark results as a Markdown page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BASELINE = "baseline"

HEAD = """# Benchmarks

Time and peak memory of every stage of the reference case (`cases/planetary_27_40_108.toml`), with one BLAS
thread. Times are medians. Where there is a second core, stages and run-ups share contact in slices, compliances
and speeds between two processes. Rows that count the processor's time have one process.

* *Ratio*: seconds depend on the machine and its load, so this column divides them by those of fixed work in the
  same run. That work factors a Laplacian of 160 x 160 points with SciPy's `splu` and solves for
  8 right-hand sides ({baseline:.1f} ms here).
* *Peak*: the resident memory of a fresh process at its highest during the stage. *Added*: how much of it came with the
  stage. Both contain the libraries that the stage loads.
* *Limit*: the time that the project promises.
* *Growth*: the exponent of the time over the size, fitted to the rows up to that one.

`benchmarks/planet_train.py` has the groups on the 18-dof set. `make bench ARGS="--page docs/benchmarks.md"` writes
this page; rows of ROSS need `pip install "femgear[bench]"`.

"""

MISSED = """## What misses its limit, and why

* **Static and modal stage in 25 slices**. Waves across the width are condensed once for both stages, and gear by gear
  for variants. Sharing positions between two processes brings nothing (3.06 s either way): 281 positions come in six
  walks, each as short as copying the process.
* **Five planets in 25 slices** take 1.9 times as long as six at 16 positions, 1.8 times at 64; the aim is 1.3. Ten
  meshes are one system of some 450 loaded slices, six planets in phase one of 100.
* **Helical teeth out of phase**. Blocks of 25 to 400 tooth pairs take 3.06 to 3.55 s for the static stage. Two
  processes with two positions a task take 0.75 of the time.
* **Whole computation**. A second process for the three gears brings 0.84 to 0.77 s.
* **Run without pictures, first line, script**. Imports are a quarter of the time. The first line comes before the
  files, in a new folder; the fixed piece of work took 89 ms with this row.
* **Answers after a change**. All positions of a loaded period, some 280, take more than 0.1 s in any way.
* **Sliders**. Planets that are not alike have three times as many positions to solve, 0.3 s with a pin error. Its draft
  of 24 positions takes 0.13 to 0.16 s. The fixed piece of work took 121 ms with these rows.
* **Run with pictures**. Layout of the axes is a quarter of the time.
* **Drivetrain, 60 s at 20 kHz**. Mesh matrices differ at every instant, and their product with two rows of 96 is what
  remains.

A million as-built sets of `cases/tolerances/3um.toml` took 400 s in two processes with 0.47 GB; the aim is 240 s.
Sets in 25 slices, with leads of the sun as tolerances, took 56 s for 10,000, with 0.73 GB; the aim is 60 s.
"""


@dataclass(frozen=True)
class Row:
    """One benchmark: its group, title, median time [s], and what it noted."""

    group: str
    title: str
    median: float
    info: dict


def rows_of(benchmarks) -> list[Row]:
    """Rows of the benchmarks of a pytest-benchmark session."""
    return [
        Row(b.group or "", b.extra_info.get("title", b.name), b.stats.median, dict(b.extra_info))
        for b in benchmarks
        if b.stats.rounds
    ]


def growth(benchmark, rows: dict, group: str, size: float) -> str:
    """Note of a row of growing work: exponent of the time over the size, fitted to the rows of the group."""
    # without measurement (--benchmark-disable) there is nothing to compare
    if benchmark.stats is None:
        return ""
    found = rows.setdefault(group, [])
    found.append(np.log([size, benchmark.stats.stats.median]))
    return f"; growth {np.polyfit(*np.transpose(found), 1)[0]:.2f}" if len(found) > 1 else ""


def page(rows: list[Row]) -> str:
    """Markdown page with one table a group."""
    base = next((row.median for row in rows if row.group == BASELINE), None)
    text = HEAD.format(baseline=1e3 * base) if base else "# Benchmarks\n\n"
    # the stages, which have unknowns, come first
    for group in dict.fromkeys(row.group for row in sorted(rows, key=lambda row: "unknowns" not in row.info)):
        chosen = [row for row in rows if row.group == group]
        if group == BASELINE:
            continue
        text += f"## {group}\n\n" + (_stages(chosen, base) if "unknowns" in chosen[0].info else _plain(chosen, base))
        text += "\n"
    return text.rstrip() + "\n\n" + MISSED


def _stages(rows, base) -> str:
    lines = [
        "| stage | unknowns | time [ms] | ratio | limit [ms] | peak [MB] | added [MB] |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        info = row.info
        unknowns = f"{info['unknowns']:,}".replace(",", " ") if info["unknowns"] else ""
        limit = f"{1e3 * info['limit']:.0f}" if info.get("limit") else ""
        memory = [f"{info[key]:.0f}" if key in info else "" for key in ("peak", "added")]
        lines.append(
            f"| {row.title} | {unknowns} | {_ms(row.median)} | {_ratio(row.median, base)} | {limit} | "
            f"{memory[0]} | {memory[1]} |"
        )
    return "\n".join(lines) + "\n"


def _plain(rows, base) -> str:
    promised = any(row.info.get("limit") for row in rows)
    lines = ["| route | time [ms] | ratio | note |", "|---|---:|---:|---|"]
    if promised:
        lines = ["| route | time [ms] | ratio | limit [ms] | note |", "|---|---:|---:|---:|---|"]
    for row in rows:
        note, limit = row.info.get("note", ""), row.info.get("limit")
        cells = [row.title, _ms(row.median), _ratio(row.median, base), note]
        if promised:
            cells.insert(3, f"{1e3 * limit:.0f}" if limit else "")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g}" if seconds < 1 else f"{1e3 * seconds:.0f}"


def _ratio(seconds: float, base: float | None) -> str:
    return f"{seconds / base:.3g}" if base else ""
