"""Numbers that decide about a case: declared once by its train, asked for by name by all that compares cases.

Sweeps, samples, searches and the comparison of two runs know a train by its `KeyFigure` list alone. Each is read from
the contents of the file of one stage, so that a run on disk and an answer in memory give the same number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from femgear.case.quantities import Dimension
from femgear.findings import NOTE, Finding

NUMBER = Dimension("a number", "1", "1", 1.0)
DECIBEL = Dimension("a level", "dB", "dB", 1.0)
"""Of accelerations, re 1e-6 m/s^2 (ISO 1683)."""
MICROMETRES = Dimension("a length", "m", "um", 1e-6)
HOURS = Dimension("a life", "h", "h", 1.0)
STRESS = Dimension("a stress", "Pa", "MPa", 1e6)
REFERENCE_ACCELERATION = 1e-6
"""Of levels in dB [m/s^2]."""
Pick = Literal["largest", "smallest", "size"]


@dataclass(frozen=True)
class Stored:
    """Reads one number from the contents of a file: the extreme one of a variable.

    Parameters
    ----------
    variable : str
        Name of the variable.
    dim : str
        Dimension along which ``labels`` choose; empty for all of it.
    labels : tuple of str
        Names along it.
    pick : {"largest", "smallest", "size"}
        Extreme one that is taken; "size" is that of the largest magnitude. NaN does not count.
    factor : float
        Of the stored number, by which it is in SI units.
    decibel : bool
        Whether the level of the number re 1e-6 m/s^2 is meant.
    """

    variable: str
    dim: str = ""
    labels: tuple[str, ...] = ()
    pick: Pick = "largest"
    factor: float = 1.0
    decibel: bool = False

    def __call__(self, data: Any) -> float:
        """Read the number from contents or a dataset; NaN where there is none."""
        if self.variable not in data:
            return math.nan
        variable = data[self.variable]
        values = np.asarray(variable.values, float)
        if self.dim:
            places = [place for place, label in enumerate(data[self.dim].values) if str(label) in self.labels]
            values = np.take(values, places, axis=list(variable.dims).index(self.dim))
        values = values[~np.isnan(values)]
        if not values.size:
            return math.nan
        number = self.factor * float(np.abs(values).max() if self.pick == "size" else self._extreme(values))
        if not self.decibel:
            return number
        return 20.0 * math.log10(number / REFERENCE_ACCELERATION) if number > 0.0 else math.nan

    def _extreme(self, values: np.ndarray) -> float:
        return values.min() if self.pick == "smallest" else values.max()


@dataclass(frozen=True)
class KeyFigure:
    """A number that decides about a case of a train.

    Parameters
    ----------
    name : str
        By which commands ask for it.
    dimension : Dimension
        Its units on disk (SI) and in tables.
    stage : str
        Stage from whose file it is read.
    read : callable
        ``(contents) -> float`` in SI units, NaN where the file has none; a function of a module, or a `Stored`.
    codes : tuple of str
        Codes of the findings of the stage that concern it; all doubts and faults where none is given.
    whole : bool
        Whether it stands for all parts.
    """

    name: str
    dimension: Dimension
    stage: str
    read: Callable[[Any], float]
    codes: tuple[str, ...] = ()
    whole: bool = False

    def concerned(self, findings: Iterable[Finding]) -> Iterable[Finding]:
        """Choose the findings of the stage that make the number doubtful."""
        return (
            finding
            for finding in findings
            if finding.severity != NOTE and (not self.codes or finding.code in self.codes)
        )

    def show(self, value: float) -> str:
        """Write a value [SI] in the unit of tables, without it."""
        return f"{value / self.dimension.scale:.5g}"

    def change(self, first: float, second: float) -> str:
        """Write how far the second value [SI] is from the first: levels in dB, others in per cent."""
        if self.dimension.si == DECIBEL.si:
            return f"{second - first:+.2f} dB"
        return f"{100.0 * (second / first - 1.0):+.3g} %" if first and math.isfinite(second / first) else ""

    def relative_change(self, first: float, second: float) -> float:
        """Size of the change from the first value to the second [SI] over the first, of levels of their amplitudes."""
        if self.dimension.si == DECIBEL.si:
            first, second = 1.0, 10.0 ** ((second - first) / 20.0)
        return abs(second / first - 1.0) if first and math.isfinite(second / first) else 0.0


def figure_of(figures: Iterable[KeyFigure], words: str) -> KeyFigure | None:
    """Find a figure by its name: as it is written, else whatever letters are large; None where there is none."""
    name = " ".join(words.split())
    listed = list(figures)
    by_name: Mapping[str, KeyFigure] = {figure.name: figure for figure in listed}
    return by_name.get(name) or {figure.name.casefold(): figure for figure in reversed(listed)}.get(name.casefold())
