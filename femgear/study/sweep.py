"""Sweeps: quantities over all combinations of values of some entries of the case file, resumable.

`sweep` computes them; `sweep_into` takes the words of a command line and writes journal, table and figure.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from femgear.case.planetary import Case
from femgear.errors import CaseError
from femgear.findings import CATALOGUE, Finding, tell
from femgear.report.style import label, legend_below, line_style, new_figure, save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread
from femgear.storage.files import own_files, resumable, write_csv
from femgear.study.designs import Failure, open_designs
from femgear.study.faults import all_faults
from femgear.study.objectives import StudyQuantity, has_figures, named_quantity, need_elastic_ring, with_run_up
from femgear.study.problem import Variable, split
from femgear.study.runner import Runner
from femgear.trains.reading import with_values

_LARGEST, _MANY, _TIMED = 100_000, 1000, 3
"""Combinations at most, those from which their time is estimated and said, and those that it is made from."""
_SHOWN = 12
"""Rows of the printed table from either end."""
_JOURNAL, _TABLE, _FIGURE = "sweep.jsonl", "sweep.csv", "sweep.png"
"""Files of a sweep."""
_WITHOUT_EFFECT = {"title", "format"}
Over = Mapping[Any, Sequence[Any]]
"""Values by key, or tuples of values by tuples of keys that go together."""
_RANGE = re.compile(r"(.+?)\.\.(.+?)/\s*(\d{1,18})\s*", re.DOTALL)


@dataclass(frozen=True)
class Sweep:
    """Quantities of all combinations.

    Parameters
    ----------
    keys : tuple of str
        Entries of the case that are varied, one a number of a point.
    points : tuple of tuple
        Values as the case file holds them; the last key runs fastest.
    quantities : tuple of StudyQuantity
        What is computed of every case.
    values : (points, quantities) array
        [SI]; NaN where a case cannot be computed.
    errors : tuple of str
        Why, one a point; empty where it can.
    doubts : tuple of dict
        Codes of the findings that make a quantity doubtful, by its name, one a point.
    computed : int
        Cases computed now; a journal held the others.
    """

    keys: tuple[str, ...]
    points: tuple[tuple[object, ...], ...]
    quantities: tuple[StudyQuantity, ...]
    values: np.ndarray
    errors: tuple[str, ...]
    computed: int
    doubts: tuple[Mapping[str, Sequence[str]], ...] = ()

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns of `records`, units of quantities in brackets."""
        return (*self.keys, *(f"{q.name} [{q.dimension.si}]" for q in self.quantities), "findings", "error")

    def codes(self, point: int) -> str:
        """Write the codes of the findings that make numbers of a point doubtful."""
        doubts = self.doubts[point].values() if self.doubts else ()
        return " ".join(dict.fromkeys(code for codes in doubts for code in codes))

    def records(self) -> Iterator[tuple[object, ...]]:
        """Give the rows of a table, quantities in SI units."""
        rows = zip(self.points, self.values, self.errors, strict=True)
        for i, (point, values, error) in enumerate(rows):
            yield (*point, *(float(value) for value in values), self.codes(i), error)


@one_blas_thread()
def sweep(
    case: Case,
    over: Over,
    quantities: Sequence[StudyQuantity],
    *,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> Sweep:
    """Compute quantities of a case over values of entries of its file.

    Parameters
    ----------
    case : Case
        From `femgear.read_case`; what is not varied stays.
    over : mapping of str or of tuple of str to sequence
        Values of dotted keys, as the case file would hold them; all combinations are computed. Entries that
        go together are a tuple of keys, whose values are tuples.
    quantities : sequence of StudyQuantity
        What is computed of every case, such as `transmission_error`.
    journal : path-like, optional
        File that keeps every case; an interrupted sweep goes on from it.
    cache, progress
        As for `search.minimise`.
    runner : Runner, optional
        Who computes the cases, see `runner.open_runner`; the result is the same.

    Raises
    ------
    CaseError
        E-VARIABLE: nothing to compute, or too much; values that the case file refuses.
    """
    axes, quantities = _axes(over), tuple(quantities)
    keys = tuple(key for entries in axes for key in entries)
    count = _check_sweep(case, axes, quantities)
    points = tuple(tuple(itertools.chain(*point)) for point in itertools.product(*axes.values()))
    table, errors, doubts = np.full((count, len(quantities)), np.nan), list[str](), list[dict]()
    keyed, warned = [(key,) for key in keys], count < _MANY
    with open_designs(case, keyed, journal=journal, cache=cache, runner=runner, telling=True) as designs:
        for done in designs.ahead(points, quantities):
            if progress is not None:
                progress("cases", done, count)
            if designs.computed == _TIMED and done < count and not warned:
                warned = True
                _warn_of_time(count - done, designs.seconds / _TIMED, designs.runner.workers)
        for i, point in enumerate(points):
            try:
                values_there = designs.values(point, quantities)
                table[i] = [values_there[quantity.name] for quantity in quantities]
                errors.append("")
            except Failure as failure:
                errors.append(f"[{failure.error['code']}] {failure}")
            doubts.append({} if errors[-1] else designs.doubts(point, quantities))
        values_there = Sweep(keys, points, quantities, table, tuple(errors), designs.computed, tuple(doubts))
    _tell_of_doubts(values_there)
    return values_there


def _tell_of_doubts(swept: Sweep) -> None:
    """Tell once each finding that makes numbers of a sweep doubtful: which quantities, how many cases."""
    concerned = dict[str, dict[str, set[int]]]()
    for point, doubts in enumerate(swept.doubts):
        for name, codes in doubts.items():
            for code in codes:
                concerned.setdefault(code, {}).setdefault(name, set()).add(point)
    for code, quantities in concerned.items():
        cases = len(set.union(*quantities.values()))
        text = (
            f"{cases} of {len(swept.points)} cases (column findings), {' and '.join(quantities)}: "
            f"{CATALOGUE[code].sentence[:1].lower()}{CATALOGUE[code].sentence[1:].rstrip('.')}"
        )
        tell(Finding(code, "", text, remedy="femgear run of such a case says more"), stacklevel=3)


def _axes(over: Over) -> dict[tuple[str, ...], list[tuple[object, ...]]]:
    """Give every axis of a sweep as a tuple of keys with tuples of values, one for each key."""
    return {
        (key,) if isinstance(key, str) else tuple(key): [(value,) for value in values]
        if isinstance(key, str)
        else [tuple(value) for value in values]  # type: ignore[arg-type]
        for key, values in over.items()
    }


def _check_sweep(
    case: Case, axes: Mapping[tuple[str, ...], Sequence[tuple[object, ...]]], quantities: Sequence[StudyQuantity]
) -> int:
    """Number of cases; what `sweep` refuses is refused, all at once."""
    count = math.prod(len(values) for values in axes.values()) if axes else 0
    if not (0 < count <= _LARGEST and quantities):
        raise CaseError(
            f"{count} cases with {len(quantities)} quantities",
            code="E-VARIABLE",
            limit=f"1 to {_LARGEST} cases, at least one quantity",
        )
    keys = [key for entries in axes for key in entries]
    with all_faults() as part:
        for entries, values in axes.items():
            for key in entries:
                with part():
                    _check_effect(key, keys.count(key))
            for value in values:
                with part():
                    with_values(case, dict(zip(entries, value, strict=True)))
            with part():
                _check_different(entries, values)
        with part():
            _check_stages(case, quantities, keys)
    return count


def _check_effect(key: str, times: int) -> None:
    """Refuse (E-VARIABLE) an entry that no quantity depends on, or that is varied several times."""
    if key.split(".")[0] in _WITHOUT_EFFECT:
        raise CaseError(
            f"{key} changes no quantity",
            code="E-VARIABLE",
            key="--over",
            value=key,
            limit="entries that the computation uses",
            remedy="leave it out",
        )
    if times > 1:
        raise CaseError(
            "a key is given twice",
            code="E-VARIABLE",
            key="--over",
            value=key,
            remedy="give all its values in one --over",
        )


def _check_different(entries: Sequence[str], values: Sequence[tuple[object, ...]]) -> None:
    """Refuse (E-DUPLICATE) values that are given twice."""
    if len(set(map(repr, values))) < len(values):  # some are lists
        raise CaseError(
            "a value is given twice",
            code="E-DUPLICATE",
            key="--over",
            value=f"{','.join(entries)}={', '.join(map(_joined, values))}",
            remedy="give every value once",
        )


def _joined(values: Sequence[object]) -> str:
    """Write values of entries that go together."""
    return "/".join(map(str, values))


def _check_stages(case: Case, quantities: Sequence[StudyQuantity], keys: Iterable[str] = ()) -> None:
    """Refuse quantities that the case can never have: without torque, or without an elastic ring."""
    if has_figures(case):
        return
    stages = {quantity.stage for quantity in quantities}
    elastic = [quantity.name for quantity in quantities if quantity.stage in ("modes", "dynamics", "housing")]
    if elastic:
        need_elastic_ring(case, f"{elastic[0]} needs")
    # transmission errors may name a torque of their own
    loaded = any(key.startswith("operation") for key in keys) or any("N m" in q.name for q in quantities)
    if stages - {"gears"} and case.operation.torque == 0.0 and not loaded:
        raise CaseError(
            "without torque no tooth carries load",
            code="E-NO-LOAD",
            key="operation.torque",
            limit="not zero for transmission errors, forces and stresses",
            remedy="give a torque",
        )


def _warn_of_time(left: int, seconds: float, workers: int) -> None:
    """Warn of how long the cases left will take so many workers, at so many seconds each."""
    total = left * seconds / workers
    shown = f"{total / 3600.0:.1f} h" if total > 5400.0 else f"{total / 60.0:.1f} min"
    text = f"{left} more cases of about {seconds:.2g} s each: {shown}"
    finding = Finding("W-SWEEP", "", text, remedy="an interrupted sweep goes on where it was")
    tell(finding, stacklevel=3)


def parse_over(text: str) -> tuple[str | tuple[str, ...], Sequence[object]]:
    """Read key and values of ``KEY=V1, V2, V3`` or ``KEY=LOW..HIGH/COUNT``; E-VARIABLE for others.

    Entries that go together are ``KEY1, KEY2=V1/W1, V2/W2``: keys and values are tuples then; in a range all
    have the same value.
    """
    key, equals, values = (part.strip() for part in text.partition("="))
    keys = tuple(part.strip() for part in key.split(","))
    if not (all(keys) and equals and values):
        raise _not_over(text)
    if match := _RANGE.fullmatch(values):
        values_given = _spread(keys[0], match, text)
        return (key, values_given) if len(keys) == 1 else (keys, [(value,) * len(keys) for value in values_given])
    if len(keys) > 1:
        return keys, [_together(part, keys) for part in values.split(",")]
    values_given = [_value(part) for part in values.split(",")]
    if any(value == "" for value in values_given):
        raise _not_over(text)
    return key, values_given


def _spread(key: str, match: re.Match[str], text: str) -> list[object]:
    """Values of an entry that are equally far apart, ``LOW..HIGH/COUNT``."""
    low, high = (_value(part) for part in match.groups()[:2])
    count = int(match[3])
    if not 2 <= count <= _LARGEST:
        raise _not_over(text)
    whole = isinstance(low, int) and isinstance(high, int) and (high - low) % (count - 1) == 0
    variable = Variable(key, low, high, integer=whole)
    return [variable.text(float(x)) for x in np.linspace(*variable.bounds, count)]


def _together(text: str, keys: Sequence[str]) -> tuple[object, ...]:
    """Read values of entries that go together, ``27/40/108``; units have strokes, too: ``1e8 N/m/2e8 N/m``."""
    for stroke in (r"/(?=\s*[-+.\d])", r"/"):
        values = tuple(map(_value, re.split(stroke, text)))
        if len(values) == len(keys) and "" not in (*values, *keys):
            return values
    raise CaseError(
        f"{len(keys)} entries go together, and each of their values has {len(keys)} parts",
        code="E-VARIABLE",
        key="--over",
        value=text.strip(),
        limit=f"KEY1,KEY2=V1/W1,V2/W2; here {'/'.join(keys)}",
        remedy='--over "sun.teeth,planet.teeth,ring.teeth=27/40/108,30/40/111"',
    )


def _value(text: str) -> str | float | bool:
    """A value of the command line as the case file holds it: whole number, number, truth value or text."""
    text = text.strip()
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip("\"'")


def _not_over(text: str) -> CaseError:
    return CaseError(
        "not a key with values",
        code="E-VARIABLE",
        key="--over",
        value=text,
        limit=f"KEY=V1,V2,V3 or KEY=LOW..HIGH/COUNT with a count of 2 to {_LARGEST}",
        remedy='--over "operation.torque=50 N m, 100 N m" --over "sun.modifications[0].amount=0 um..12 um/7"',
    )


def sweep_into(
    case: Case,
    folder: Path,
    *,
    over: Sequence[str],
    of: Sequence[str] = ("ste",),
    speeds: tuple[str, str] | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> tuple[Sweep, list[str]]:
    """Compute a sweep, or what is left of it, and write its table and figure.

    CaseError: E-VARIABLE, E-OBJECTIVE: what cannot be computed; nothing is written then. StorageError:
    E-OUTPUT: a table or figure that is not that of a sweep, as `own_files`; E-JOURNAL.

    Parameters
    ----------
    case, folder : Case, path
        The folder is created where it does not exist; the names of the files come with the sweep.
    over, of : sequences of str
        As `parse_over` takes them; quantities, see `objectives.NAMES`.
    speeds : (str, str), optional
        First and last speed of the input, for mesh forces and housing levels.
    cache, progress, runner
        As for `sweep`.
    """
    parsed, quantities = list[tuple[Any, Sequence[object]]](), list[StudyQuantity]()
    with all_faults() as part:
        with part("--speeds"):
            case = with_run_up(case, speeds)
        for text in over:
            with part("--over"):
                parsed.append(parse_over(text))
        for words in of:
            with part("--of"):
                quantities.append(named_quantity(words, speeds=speeds, case=case))
    values = dict(parsed)
    if len(values) < len(parsed):
        twice = next(key for key, _ in parsed if [name for name, _ in parsed].count(key) > 1)
        _check_effect(twice if isinstance(twice, str) else ",".join(twice), 2)
    axes = _axes(values)
    _check_sweep(case, axes, quantities)
    own_files(folder, (_TABLE, _FIGURE))
    options = {"journal": folder / _JOURNAL, "cache": cache, "progress": progress, "runner": runner}
    with resumable(folder):
        swept = sweep(case, values, quantities, **options)
        write_csv(folder / _TABLE, swept.header, swept.records())
        _draw(swept, axes, folder / _FIGURE)
    return swept, [_TABLE, _JOURNAL, _FIGURE]


def describe_sweep(swept: Sweep) -> Block:
    """Tabulate a sweep in the units of messages; of many cases the first and the last ones."""
    units = [quantity.dimension for quantity in swept.quantities]
    header = (*swept.keys, *(f"{q.name} [{q.dimension.shown}]" for q in swept.quantities))
    rows = [
        (*map(str, point), *(f"{value / unit.scale:.5g}" for value, unit in zip(values, units)))
        for point, values in zip(swept.points, swept.values)
    ]
    if any(map(swept.codes, range(len(rows)))):
        header, rows = (*header, "findings"), [(*row, swept.codes(i) or "-") for i, row in enumerate(rows)]
    if len(rows) > 2 * _SHOWN:
        gap = ("...", *("" for _ in header[1:]))
        rows = [*rows[:_SHOWN], gap, *rows[-_SHOWN:]]
    notes = tuple(dict.fromkeys(f"cannot be computed: {error}" for error in swept.errors if error))
    return Block("Sweep", header, tuple(rows), notes[:_SHOWN])


def _draw(swept: Sweep, axes_of: Mapping[tuple[str, ...], Sequence[tuple[object, ...]]], path: Path) -> None:
    """Curves over the last axis, one panel a quantity, one curve for every combination of the others.

    Of at most twelve combinations; a case that cannot be computed leaves a gap.
    """
    keys, along = list(axes_of.items())[-1]
    last, count = len(along), len(swept.quantities)
    scale = np.array([quantity.dimension.scale for quantity in swept.quantities])
    curves = (swept.values / scale).reshape(-1, last, count)
    x, unit = _axis([value[0] if len(keys) == 1 else _joined(value) for value in along])
    name_of_axis = ", ".join(keys)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=4.4 * columns + 0.6, height=3.6 * rows + 0.6)
    for q, quantity in enumerate(swept.quantities):
        for k, (point, curve) in enumerate(zip(swept.points[::last], curves[:12])):
            name = ", ".join(f"{key} = {value}" for key, value in zip(swept.keys, point[: -len(keys)], strict=False))
            legend = {"label": name} if name else {}
            axes[q].plot(x, curve[:, q], marker="o", markersize=4, **line_style(k), **legend)
        if not np.isfinite(curves[..., q]).any():
            axes[q].text(0.5, 0.5, "no case can be computed", transform=axes[q].transAxes, ha="center")
        title = f"{quantity.name} [{quantity.dimension.shown}]".replace("[um]", "[µm]")
        label(axes[q], f"{name_of_axis} [{unit}]" if unit else name_of_axis, fill(title, 36))
    for ax in axes[count:]:
        ax.remove()
    legend_below(figure)
    save_figure(figure, path)


def _axis(values: Sequence[object]) -> tuple[Sequence[object], str]:
    """Numbers and their unit where all values are numbers in one unit, else their texts."""
    try:
        parts = [split(value, "value") for value in values]
    except CaseError:
        parts = []
    units = {unit for _, unit in parts}
    if len(units) != 1:
        return [str(value) for value in values], ""
    return [number for number, _ in parts], units.pop()
