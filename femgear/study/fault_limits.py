"""From which size on faults of teeth stand out of what healthy sets with drawn errors do.

A fault is told by lines that no healthy set has, where the strongest of them exceeds those of all healthy ones and the
noise; or by the level of the normal lines of a mesh harmonic, where that lies outside of what all healthy ones have.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.quantities import SPEED
from femgear.errors import CaseError, FemgearError
from femgear.report.style import label, legend_below, line_style, new_figure, save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.storage.files import own_files, resumable, write_csv
from femgear.study.designs import open_journal
from femgear.study.fault_records import FaultPlan, machine_case, solved_lines
from femgear.study.fault_sizes import HEALTHY, SIZED, FaultPlace, carrying_flanks, fault_entries
from femgear.study.runner import Runner
from femgear.trains.reading import with_values

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from femgear.housing.sensor import SensorLines

LIMIT_FILES, _JOURNAL = ("limits.csv", "limits.png"), "limits.jsonl"
HEALTHY_SETS = 12
"""Sets with drawn errors that faults must stand out of."""
_OUT_OF_NOISE = 14.0
"""Level of a line over the noise at the same resolution from which on it counts, as for recordings [dB]."""
_MARGIN = 1.0
"""Level by which normal lines must differ from those of all healthy sets [dB]."""
_WEAK = 40.0
"""Level of mesh harmonics under all lines together below which they tell nothing [dB]."""
_WHOLE = 1e-6
NEW_LINES = ("whole orders", "between whole orders")
"""Lines that no healthy set of equal planets has, by where they lie."""
_TOOTH = 3
_MARKS = (
    {"marker": "o", "markersize": 12.0, "fillstyle": "none", "linewidth": 3.5},
    {"marker": "s", "markersize": 8.0, "fillstyle": "none", "linewidth": 2.0},
    {"marker": "^", "markersize": 4.5, "linewidth": 1.0},
)
"""Marks and lines of the gears: those that are drawn later leave the earlier ones to be seen around them."""


@dataclass(frozen=True)
class FaultLimit:
    """How far a kind of fault stands out, over its size.

    Parameters
    ----------
    kind, gear : str
        Of the fault.
    size : (n,) array
        [m], ascending; zero of kinds without one.
    excess : (n,) array
        Level over what tells it from healthy sets [dB]; NaN where it cannot be computed.
    by : tuple of str
        What tells it best, one a size.
    """

    kind: str
    gear: str
    size: np.ndarray
    excess: np.ndarray
    by: tuple[str, ...]

    @property
    def least(self) -> float:
        """Smallest size from which on all stand out [m]; NaN where the largest does not."""
        below = np.flatnonzero(~(self.excess > 0.0))
        first = below[-1] + 1 if len(below) else 0
        return float(self.size[first]) if first < len(self.size) else np.nan


def line_levels(lines: SensorLines, gears: Any, noise: float) -> dict[str, float]:
    """Compute levels of the lines of the first speed over all of them together [dB], by what they are.

    Of the normal lines of every mesh harmonic, ``"mesh 1"`` and so on, and of the strongest of all others: at whole
    orders, where unequal planets have lines too, and between these. Levels of these two are not below what stands out
    of the noise (amplitude of a line over all together).
    """
    amplitude, order = np.abs(lines.acceleration[0]), np.asarray(lines.order, float)
    amplitude = np.where(order > 0.0, amplitude, 0.0)
    together = float(np.sqrt((amplitude**2).sum()))
    normal = np.abs(order / gears.rotations - np.rint(order / gears.rotations)) < _WHOLE
    harmonic = np.rint(order / gears.ring.teeth).astype(int)
    squares = np.bincount(harmonic[normal], weights=amplitude[normal] ** 2)
    levels = {f"mesh {h}": _decibel(np.sqrt(squares[h]) / together) for h in range(1, len(squares))}
    whole = np.abs(order - np.rint(order)) < _WHOLE
    for name, lines_there in zip(NEW_LINES, (whole & ~normal, ~whole), strict=True):
        strongest = float(amplitude[lines_there].max(initial=0.0)) / together
        levels[name] = max(_decibel(strongest), _decibel(noise))
    return levels


def _decibel(ratio: float) -> float:
    return float(20.0 * np.log10(max(ratio, 1e-10)))


def standing_out(levels: Mapping[str, float], healthy: Sequence[Mapping[str, float]]) -> tuple[float, str]:
    """Find the level by which a set stands out of healthy ones [dB], negative where it does not, and by what."""
    best = max((levels[name] - max(levels_there[name] for levels_there in healthy), name) for name in NEW_LINES)
    for name, level in levels.items():
        others = [levels_there.get(name, -np.inf) for levels_there in healthy]
        if name not in NEW_LINES and max(level, *others) >= -_WEAK:
            best = max(best, (max(level - max(others), min(others) - level) - _MARGIN, name))
    return best


@one_blas_thread()
def _levels_of(plan: FaultPlan, item: tuple[int, FaultPlace]) -> dict[str, float] | str:
    """Levels of a machine with a fault in place of its own, at torque and largest speed of the case; or why not."""
    machine, fault = item
    case, gears = plan.case, planetary_set(plan.case)
    noise = plan.noise * np.sqrt(2.0 / plan.samples) * 10.0 ** (_OUT_OF_NOISE / 20.0)
    if fault.kind == HEALTHY:
        case = machine_case(plan, machine)[0]
    fastest = max(plan.case.operation.speeds, key=abs)
    values = {
        **{f"{name}.fault": None for name in ("sun", "planet", "ring") if getattr(case, name).fault},
        "operation.torque": f"{plan.case.operation.torque:.9g} N m",
        "operation.speeds": [f"{fastest / SPEED.scale:.9g} rpm"],
        **fault_entries(fault, gears),
    }
    try:
        return line_levels(solved_lines(with_values(case, values), cache=plan.cache, steps=plan.steps), gears, noise)
    except FemgearError as error:
        return f"[{error.code}] {error}"


def limit_faults(plan: FaultPlan, count: int) -> list[FaultPlace]:
    """List faults of all kinds and gears of a plan, of so many sizes each, in equal ratios."""
    gears, back, places = planetary_set(plan.case), plan.case.torque_on_first_gear() < 0.0, []
    for kind in plan.kinds:
        for gear in plan.gears if kind != HEALTHY else ():
            low, high = plan.sizes.get(kind, (0.0, 0.0))
            sizes = np.geomspace(low, high, count) if kind in SIZED else [0.0]
            flank = carrying_flanks(gears, gear, back=back)[0] if kind in ("crack", "spall", "wear") else ""
            tooth = -1 if kind == "wear" else _TOOTH
            planet = int(gear == "planet")
            places += [FaultPlace(kind, gear, planet, tooth, flank, float(f"{size:.6g}")) for size in sizes]
    return places


def fault_limits_into(
    plan: FaultPlan, folder: Path, count: int, *, progress: Progress = silent, runner: Runner | None = None
) -> tuple[list[Block], list[str]]:
    """Compute from which size on faults stand out, or what is left of it; write a table and a figure.

    Healthy sets have the drawn errors of the plan; faults are those of the case itself. CaseError: a plan without
    drawn errors (E-KEY-MISSING).
    """
    if plan.model is None:
        remedy = "name a file by --tolerances, as cases/tolerances/still.toml"
        message = "without drawn errors all healthy sets are alike, and any fault stands out"
        raise CaseError(message, code="E-KEY-MISSING", key="--tolerances", remedy=remedy)
    own_files(folder, LIMIT_FILES)
    items = [(machine, FaultPlace(HEALTHY)) for machine in range(HEALTHY_SETS)]
    items += [(0, fault) for fault in limit_faults(plan, count)]
    keys = [f"{machine} {fault}" for machine, fault in items]
    with (
        resumable(folder),
        open_journal(folder / _JOURNAL, plan.case, {"plan": plan.fingerprint}, lambda key, record: True) as journal,
    ):
        left = [number for number, key in enumerate(keys) if key not in journal]
        outcomes = (runner or Runner()).map(partial(_levels_of, plan), [items[number] for number in left])
        for done, (index, outcome) in enumerate(outcomes, len(keys) - len(left) + 1):
            if isinstance(outcome, FemgearError):
                raise outcome
            made = {"error": outcome} if isinstance(outcome, str) else {"levels": outcome}
            journal.add(keys[left[index]], made)
            progress("sets", done, len(keys))
        healthy = [journal[key]["levels"] for key in keys[:HEALTHY_SETS] if "levels" in journal[key]]
        limits = [*_limits(items[HEALTHY_SETS:], [journal[key] for key in keys[HEALTHY_SETS:]], healthy)]
    header = ("kind", "gear", "size [m]", "stands out [dB]", "by")
    rows = ((limit.kind, limit.gear, *row) for limit in limits for row in zip(limit.size, limit.excess, limit.by))
    write_csv(folder / LIMIT_FILES[0], header, rows)
    save_figure(draw_limits(limits), folder / LIMIT_FILES[1])
    return [describe_limits(limits)], [*LIMIT_FILES, _JOURNAL]


def _limits(
    items: Sequence[tuple[int, FaultPlace]],
    records: Sequence[Mapping[str, Any]],
    healthy: Sequence[Mapping[str, float]],
) -> Iterator[FaultLimit]:
    """Gather sizes of every kind and gear."""
    groups = dict[tuple[str, str], list[tuple[float, float, str]]]()
    for (_, fault), record in zip(items, records, strict=True):
        excess, by = (np.nan, record["error"]) if "error" in record else standing_out(record["levels"], healthy)
        groups.setdefault((fault.kind, fault.gear), []).append((fault.size, excess, by))
    for (kind, gear), rows in groups.items():
        size, excess, by = zip(*rows, strict=True)
        yield FaultLimit(kind, gear, np.array(size), np.array(excess), by)


def describe_limits(limits: Sequence[FaultLimit]) -> Block:
    """Tabulate the sizes from which on faults stand out."""
    rows = []
    for limit in limits:
        sizes = "-" if limit.kind not in SIZED else f"{1e3 * limit.size[0]:.4g} to {1e3 * limit.size[-1]:.4g}"
        least = "whole tooth" if limit.kind not in SIZED else f"{1e3 * limit.least:.2g}"
        least = least if np.isfinite(limit.least) else "none of these"
        last = f"{limit.excess[-1]:.1f}" if np.isfinite(limit.excess[-1]) else "-"
        by = limit.by[-1] if limit.excess[-1] > 0.0 or np.isnan(limit.excess[-1]) else "nothing"
        rows.append((limit.kind, limit.gear, sizes, least, last, by))
    notes = (
        f"out of {HEALTHY_SETS} healthy sets with drawn errors, at torque and largest speed of the case",
        f"lines that healthy sets have not count from {_OUT_OF_NOISE:g} dB over the noise of a record on, normal ones "
        f"of a mesh harmonic from {_MARGIN:g} dB outside of what healthy ones have",
    )
    header = ("fault", "gear", "sizes [mm]", "stands out from [mm]", "largest: by [dB]", "it is told by")
    return Block("Sizes from which on faults stand out", header, tuple(rows), notes)


def draw_limits(limits: Sequence[FaultLimit]) -> Figure:
    """Draw the level by which faults stand out over their size, a panel for every kind that has one."""
    kinds = [kind for kind in dict.fromkeys(limit.kind for limit in limits) if kind in SIZED]
    figure, axes = new_figure(columns=max(len(kinds), 1), width=3.4 * max(len(kinds), 1) + 1.0, height=4.2)
    for number, (kind, ax) in enumerate(zip(kinds, axes, strict=False)):
        ax.axhline(0.0, color="black", linewidth=0.8)
        for i, limit in enumerate(limit for limit in limits if limit.kind == kind):
            ax.plot(1e3 * limit.size, limit.excess, label=limit.gear, **_MARKS[i % len(_MARKS)], **line_style(i))
        # a fault that never stands out is a line at zero, not an axis of nothing
        levels = np.concatenate([[0.0, 1.0], *(limit.excess for limit in limits if limit.kind == kind)])
        low, high = float(np.nanmin(levels)), float(np.nanmax(levels))
        if high <= 1.0:
            ax.annotate("none of these stands out", (0.5, 0.5), xycoords="axes fraction", ha="center")
        ax.set_ylim(low - 0.05 * (high - low), high + 0.1 * (high - low))
        ax.set_xscale("log")
        sizes = sorted({1e3 * float(size) for limit in limits if limit.kind == kind for size in limit.size})
        ax.set_xticks(sizes, [f"{size:.2g}" for size in sizes])
        ax.minorticks_off()
        label(ax, f"{SIZED[kind]} [mm]", "stands out by [dB]" if number == 0 else "", kind)
    legend_below(figure)
    return figure
