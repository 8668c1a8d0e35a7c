"""Stage "assumptions": the level with half and twice of what is assumed about damping, bearings and supports.

Nobody knows the damping of a gearbox before it is built, and stiffnesses of bearings and supports are often estimated.
The same case is solved again with each of them halved and doubled, from its loaded state on: what the level gains and
loses by that is what it rests on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear import second_process
from femgear.case.quantities import RPM
from femgear.report.style import BLUE, VERMILION, label, legend_below, new_figure
from femgear.report.tables import Block, Marks, tabulate
from femgear.stages.protocol import Drawn, Figures, Progress, StageResult, one_blas_thread, silent
from femgear.storage.contents import Contents
from femgear.storage.results import as_written, declared

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

FACTORS = (0.5, 2.0)
"""Of what is assumed, over what the case has."""
_FULL = 1.0
"""Damping ratio from which on nothing vibrates."""
_DAMPING = "damping_ratio"
_VARIABLES = {
    "assumed_level": ("speed", "m/s^2", "level of the housing as in housing.nc, root mean square of the acceleration"),
    "changed_level": ("speed assumption factor", "m/s^2", "this level with half and twice of what is assumed"),
}
"""Variables of assumptions.nc: dimensions, unit and text."""


@dataclass(frozen=True)
class Assumption:
    """Entries of a case that are halved and doubled together.

    Parameters
    ----------
    name : str
        What they are, in words.
    keys : tuple of str
        Dotted keys.
    """

    name: str
    keys: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class AssumptionsResult(StageResult):
    """Levels with half and twice of what is assumed.

    Parameters
    ----------
    assumptions : tuple of Assumption
        n of them.
    input_speed : (speeds,) array
        [rad/s]
    level : (speeds,) array
        Of the case itself [m/s^2].
    changed : (speeds, n, 2) array
        With the `FACTORS` of every assumption [m/s^2].
    """

    assumptions: tuple[Assumption, ...]
    input_speed: np.ndarray
    level: np.ndarray
    changed: np.ndarray

    @property
    def message(self) -> str:
        """How the levels were found."""
        return "solved again for every change"

    def contents(self) -> Contents:
        """Collect the contents of assumptions.nc."""
        coords = {
            "speed": ("speed", as_written(self.input_speed / RPM), "rpm", "speed of the input"),
            "assumption": ("assumption", [assumption.name for assumption in self.assumptions], "1", "what is assumed"),
            "factor": ("factor", np.array(FACTORS), "1", "what is assumed over what the case has"),
        }
        values = {"assumed_level": self.level, "changed_level": self.changed}
        title = "level with half and twice of what is assumed"
        keys = [", ".join(assumption.keys) for assumption in self.assumptions]
        return Contents(declared(_VARIABLES, values), coords, {"title": title, "keys": "; ".join(keys)})


def assumed(case: Any, candidates: Sequence[Assumption]) -> tuple[Assumption, ...]:
    """List what of some assumptions a case has: entries that are positive and finite, damping that may be doubled."""
    had = [
        (assumption, tuple(key for key in assumption.keys if _may_change(_entry(case, key), key)))
        for assumption in candidates
    ]
    return tuple(Assumption(assumption.name, keys) for assumption, keys in had if keys)


def _may_change(value: float | None, key: str) -> bool:
    """Whether half and twice of an entry are entries too."""
    highest = _FULL / FACTORS[-1] if key.endswith(_DAMPING) else math.inf
    return value is not None and 0.0 < value < highest


def _entry(case: Any, key: str) -> float | None:
    section, _, name = key.rpartition(".")
    return getattr(getattr(case, section), name)


def scaled(case: Any, assumption: Assumption, factor: float) -> Any:
    """Give the case with the entries of an assumption times a factor."""
    sections: dict[str, dict[str, float]] = {}
    for key in assumption.keys:
        section, _, name = key.rpartition(".")
        value = _entry(case, key)
        assert value is not None
        sections.setdefault(section, {})[name] = factor * value
    changes = {section: getattr(case, section).model_copy(update=values) for section, values in sections.items()}
    return case.model_copy(update=changes)


@one_blas_thread()
def solve_assumptions(
    case: Any,
    candidates: Sequence[Assumption],
    level: Callable[[Any], np.ndarray],
    input_speed: np.ndarray,
    *,
    progress: Progress = silent,
) -> AssumptionsResult:
    """Compute levels with half and twice of what a case assumes.

    Parameters
    ----------
    case : case of a train
    candidates : sequence of Assumption
        Those that the train knows; what the case lacks is left out.
    level : callable
        ``(case) -> (speeds,)`` levels [m/s^2].
    input_speed : (speeds,) array
        [rad/s]
    progress : callable
        Called with (stage, done, total).
    """
    chosen = assumed(case, candidates)
    cases = [scaled(case, assumption, factor) for assumption in chosen for factor in FACTORS]
    # first alone: what the changed cases have in common with it is known in both processes
    unchanged = level(case)

    def solved(number: int) -> np.ndarray:
        progress("assumptions", float(len(cases) - 1 - number), float(len(cases)))
        return level(cases[number])

    others = second_process.shared([partial(solved, number) for number in range(len(cases))])
    changed = np.array(others).reshape(len(chosen), len(FACTORS), len(input_speed))
    return AssumptionsResult(chosen, input_speed, unchanged, np.moveaxis(changed, 2, 0))


def level_change(data: xr.Dataset) -> np.ndarray:
    """Changes (speeds, n, 2) of the level by half and twice of what is assumed [dB], from assumptions.nc."""
    return 20.0 * np.log10(data["changed_level"].values / data["assumed_level"].values[:, None, None])


def _loudest(data: xr.Dataset) -> int:
    """Number of the loudest of the speeds of assumptions.nc."""
    return int(data["assumed_level"].values.argmax())


def describe_assumptions(data: xr.Dataset) -> Block:
    """Tabulate what half and twice of every assumption make of the level, at all speeds of assumptions.nc."""
    change, names = level_change(data), [str(name) for name in data["assumption"].values]
    keys = str(data.attrs["keys"]).split("; ")
    speeds = data["speed"].values
    columns: dict[str, Callable[[int], str]] = {"assumed": lambda n: names[n], "entry": lambda n: keys[n]}
    for at, speed in enumerate(speeds):
        for which, words in enumerate(("half", "twice")):
            columns[f"{words} at {speed:.6g} rpm [dB]"] = partial(_decibels, change[at, :, which])
    note = "change of the level of the housing with half and twice of the entry, all others as they are"
    return tabulate("What the level rests on", range(len(names)), columns, (note,))


def _decibels(change: np.ndarray, number: int) -> str:
    return f"{np.round(change[number], 1) + 0.0:+.1f}"


def most_decisive(results: Any, marks: Marks | None = None) -> str:
    """Write the two assumptions that the level at the loudest speed rests on most; empty without assumptions.nc."""
    if "assumptions" not in results.stages or not results.assumptions.sizes["assumption"]:
        return ""
    data = results.assumptions
    change = level_change(data)[_loudest(data)]
    order = np.argsort(-np.abs(change).max(axis=1), kind="stable")[:2]
    text = "; ".join(
        f"{data['assumption'].values[n]} {_decibels(change[:, 0], n)} and {_decibels(change[:, 1], n)} dB"
        for n in order
    )
    return marks(text, "W-DAMPING") if marks else text


def assumption_rows(results: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    """Write the row of a verdict on what the level rests on; none without assumptions.nc."""
    if text := most_decisive(results, marks):
        yield "level with half and twice of what is assumed", text


def draw_assumptions(data: xr.Dataset) -> Figure:
    """Draw the change of the level by half and twice of every assumption, at the loudest speed of assumptions.nc."""
    at = _loudest(data)
    change, names = level_change(data)[at], [str(name) for name in data["assumption"].values]
    order = np.argsort(np.abs(change).max(axis=1), kind="stable")
    figure, (axes,) = new_figure(height=1.4 + 0.5 * len(names))
    for which, (words, color) in enumerate((("half", BLUE), ("twice", VERMILION))):
        place = np.arange(len(names)) + (0.2 if which == 0 else -0.2)
        axes.barh(place, change[order, which], height=0.36, color=color, label=words)
    axes.axvline(0.0, color="0.5", linewidth=0.8)
    axes.set_yticks(np.arange(len(names)), [names[n] for n in order])
    label(axes, "change of the level [dB]", title=f"{data['speed'].values[at]:.6g} rpm")
    legend_below(figure)
    return figure


def _assumption_figures(drawn: Drawn) -> Mapping[str, Figure]:
    data = drawn.data["assumptions"]
    return {"assumptions": draw_assumptions(data)} if data.sizes["assumption"] else {}


ASSUMPTION_FIGURES = Figures(
    {
        "assumptions": (
            "What the level rests on, at the loudest of the speeds: its change with half and twice of what the case "
            "assumes, one after the other."
        ),
    },
    draw=_assumption_figures,
)
"""The picture of the stage."""
