"""As-built machines of a command: key figures of cases whose entries are drawn from their tolerances.

Every sample is a case of its own, solved as a run solves it, and kept in a journal. Distributions are told by
percentiles; which tolerance makes them by the rank correlation of Spearman (C. Spearman, Am. J. Psychol. 15, 1904).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from femgear.errors import CaseError
from femgear.report.style import BLUE, VERMILION, label, legend_below, new_figure, save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread
from femgear.storage.files import own_files, resumable, write_csv, write_text
from femgear.study.designs import Failure, open_designs
from femgear.study.entry_tolerances import DrawnEntry, draw_entries, entry_shares, read_entry_tolerances
from femgear.study.faults import all_faults
from femgear.study.objectives import StudyQuantity, default_quantities, named_quantity, with_run_up
from femgear.study.runner import Runner
from femgear.study.samples import checked
from femgear.trains.reading import to_toml, with_values

PERCENTILES = 5.0, 50.0, 95.0
ENTRY_SAMPLES = 100
"""By default."""
_MOST = 100_000
_FILES, _JOURNAL = ("samples.csv", "percentiles.csv", "samples.png", "worst.toml"), "samples.jsonl"
_PANELS = 9
"""Quantities that are drawn, at most."""
_TOLD = 3
"""Tolerances that are named for a quantity, at most."""
_ROUNDING = 1e-9
"""Spread of a quantity over its size that is none."""
_ENOUGH = 20
"""Samples from which correlations are told."""


@dataclass(frozen=True)
class EntryRequest:
    """What samples are drawn, and what is computed of them.

    Parameters
    ----------
    of : sequence of str
        Key figures by name; by default all that stand for the whole.
    speeds : (str, str), optional
        First and last speed of the run-up, with their units; by default those of the case.
    count : int
        Number of samples.
    seed : int
        Sample i of a seed is the same whatever the number of samples.
    index : int, optional
        The only sample that is wanted, as a case file.
    """

    of: Sequence[str] = ()
    speeds: tuple[str, str] | None = None
    count: int = ENTRY_SAMPLES
    seed: int = 1
    index: int | None = None


@dataclass(frozen=True)
class EntrySamples:
    """Key figures of drawn cases.

    Parameters
    ----------
    keys : tuple of str
        Entries that are drawn.
    points : tuple of tuple
        Values of every sample, as the case file holds them.
    quantities : tuple of StudyQuantity
    nominal : (quantities,) array
        Of the case itself [SI].
    values : (samples, quantities) array
        [SI]; NaN where a sample cannot be computed.
    errors : tuple of str
        Why, one a sample; empty where it can.
    findings : tuple of str
        Codes of the findings that make its numbers doubtful, one a sample.
    drawn : (samples, laws) array
        Places of the draws in their laws, as ranks.
    computed : int
        Samples computed now; a journal held the others.
    """

    keys: tuple[str, ...]
    points: tuple[tuple[object, ...], ...]
    quantities: tuple[StudyQuantity, ...]
    nominal: np.ndarray
    values: np.ndarray
    errors: tuple[str, ...]
    findings: tuple[str, ...]
    drawn: np.ndarray
    computed: int

    @property
    def whole(self) -> np.ndarray:
        """Numbers (n,) of the samples that can be computed."""
        return np.flatnonzero(~np.isnan(self.values).any(axis=1))

    @property
    def worst(self) -> int:
        """Number of the sample with the largest first quantity."""
        return int(self.whole[self.values[self.whole, 0].argmax()])

    def correlation(self) -> np.ndarray:
        """Compute Spearman's rank correlation of quantities and laws (quantities, laws); 0 where nothing changes."""
        values = self.values[self.whole]
        same = (values == values[:1]).all(axis=0)  # endless lives among them
        with np.errstate(invalid="ignore"):
            alike = same | (np.ptp(values, axis=0) <= _ROUNDING * np.abs(values).max(axis=0))
        ranks = [_ranks(part) for part in (np.where(alike, 0.0, values), self.drawn[self.whole])]
        centred = [rank - rank.mean(axis=0) for rank in ranks]
        sizes = [np.sqrt((part**2).sum(axis=0)) for part in centred]
        product = centred[0].T @ centred[1]
        scale = sizes[0][:, None] * sizes[1]
        return np.divide(product, scale, out=np.zeros_like(product), where=scale > 0.0)


def _ranks(values: np.ndarray) -> np.ndarray:
    """Ranks of the rows in every column; equal values share the mean of theirs."""
    from scipy.stats import rankdata

    return rankdata(values, axis=0)


@one_blas_thread()
def sample_entries(
    case: Any,
    entries: Sequence[DrawnEntry],
    quantities: Sequence[StudyQuantity],
    *,
    count: int = ENTRY_SAMPLES,
    seed: int = 1,
    journal: str | Path | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> EntrySamples:
    """Compute quantities of samples 0 to ``count - 1`` of a case.

    Parameters
    ----------
    case : case of a train with key figures
    entries : sequence of DrawnEntry
        From `read_entry_tolerances`.
    quantities : sequence of StudyQuantity
    count, seed : int
        Sample i of a seed is the same whatever the number of samples.
    journal, cache, progress, runner
        As for `femgear.study.sweep.sweep`.

    Raises
    ------
    CaseError
        E-RANGE: counts of nothing. E-INFEASIBLE: no sample can be computed.
    """
    checked(count, "--number", 1, _MOST)
    checked(seed, "--seed", 0, 2**32)
    keys = tuple(key for entry in entries for key in entry.variable.keys)
    points = tuple(draw_entries(entries, seed, 0, count))
    values, errors, codes = np.full((count, len(quantities)), np.nan), list[str](), list[str]()
    options = {"journal": journal, "cache": cache, "runner": runner, "telling": True}
    with open_designs(case, [(key,) for key in keys], **options) as designs:
        nominal = designs.values((), quantities)
        for done in designs.ahead(points, quantities):
            if progress is not None:
                progress("samples", done, count)
        for i, point in enumerate(points):
            try:
                numbers = designs.values(point, quantities)
                values[i] = [numbers[quantity.name] for quantity in quantities]
                errors.append("")
            except Failure as failure:
                errors.append(f"[{failure.error['code']}] {failure}")
            doubts = {} if errors[-1] else designs.doubts(point, quantities)
            codes.append(" ".join(dict.fromkeys(code for part in doubts.values() for code in part)))
        computed = designs.computed
    if np.isnan(values).any(axis=1).all():
        raise CaseError("no sample can be computed", code="E-INFEASIBLE", value=errors[0], remedy="smaller tolerances")
    shares = entry_shares(entries, seed, 0, count)
    before = np.array([nominal[quantity.name] for quantity in quantities])
    return EntrySamples(keys, points, tuple(quantities), before, values, tuple(errors), tuple(codes), shares, computed)


def entry_samples_into(
    case: Any,
    folder: Path,
    tolerances: str | Path,
    request: EntryRequest,
    *,
    cache: Path | None = None,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> tuple[list[Block], list[str]]:
    """Compute samples of a case, or what is left of them, and write tables, a figure and the worst as a case file.

    With an index that sample is written as a case, sample_INDEX.toml, and none is computed. The result is what there
    is to say, and the names of the files.

    CaseError: everything that is wrong with tolerances and quantities; nothing is written then.
    """
    entries, quantities = (), list[StudyQuantity]()
    with all_faults() as part:
        with part("--tolerances"):
            entries, _ = read_entry_tolerances(tolerances, case)
        with part("--speeds"):
            case = with_run_up(case, request.speeds)
        for words in request.of or default_quantities(case):
            with part("--of"):
                quantities.append(named_quantity(words, case=case))
    keys = tuple(key for entry in entries for key in entry.variable.keys)
    if request.index is not None:
        name = f"sample_{request.index}.toml"
        own_files(folder, [name])
        (point,) = draw_entries(entries, request.seed, request.index, 1)
        write_text(to_toml(with_values(case, dict(zip(keys, point, strict=True)))), folder / name)
        return [], [name]
    own_files(folder, _FILES)
    options = {"journal": folder / _JOURNAL, "cache": cache, "progress": progress, "runner": runner}
    with resumable(folder):
        drawn = sample_entries(case, entries, quantities, count=request.count, seed=request.seed, **options)
        write_csv(folder / _FILES[0], _header(drawn), _records(drawn))
        header = ("quantity", "unit", "case", "mean", "standard deviation", *(f"{p:g} %" for p in PERCENTILES))
        write_csv(folder / _FILES[1], header, ([name, unit, *row] for name, unit, row in _statistics(drawn)))
        _draw(drawn, folder / _FILES[2])
        worst = dict(zip(keys, drawn.points[drawn.worst], strict=True))
        write_text(to_toml(with_values(case, worst)), folder / _FILES[3])
    return describe_entry_samples(drawn, entries), [*_FILES, _JOURNAL]


def _header(drawn: EntrySamples) -> tuple[str, ...]:
    names = (f"{quantity.name} [{quantity.dimension.si}]" for quantity in drawn.quantities)
    return ("sample", *drawn.keys, *names, "findings", "error")


def _records(drawn: EntrySamples) -> Iterator[tuple[object, ...]]:
    rows = zip(drawn.points, drawn.values, drawn.findings, drawn.errors, strict=True)
    for i, (point, values, codes, error) in enumerate(rows):
        yield (i, *point, *(float(value) for value in values), codes, error)


def _statistics(drawn: EntrySamples) -> Iterator[tuple[str, str, list[float]]]:
    """Rows of name, unit, value of the case, mean, standard deviation and percentiles [SI]."""
    values = drawn.values[drawn.whole]
    with np.errstate(invalid="ignore"):  # of lives without end
        spread = values.std(axis=0, ddof=1) if len(values) > 1 else np.zeros(len(drawn.quantities))
        between = np.percentile(values, PERCENTILES, axis=0)
    at = np.where(np.isnan(between), np.percentile(values, PERCENTILES, axis=0, method="inverted_cdf"), between)
    for number, quantity in enumerate(drawn.quantities):
        numbers = drawn.nominal[number], values[:, number].mean(), spread[number], *at[:, number]
        yield quantity.name, quantity.dimension.si, [float(number) for number in numbers]


def describe_entry_samples(drawn: EntrySamples, entries: Sequence[DrawnEntry]) -> list[Block]:
    """Tabulate the distribution of every quantity, and the tolerances that make it."""
    rows = []
    for quantity, (name, _, numbers) in zip(drawn.quantities, _statistics(drawn), strict=True):
        unit = quantity.dimension
        rows.append((f"{name} [{unit.shown}]", *(f"{value / unit.scale:.5g}" for value in numbers)))
    whole, count = len(drawn.whole), len(drawn.points)
    notes = [f"{whole} samples" if whole == count else f"{whole} of {count} samples; the others cannot be computed"]
    notes += list(dict.fromkeys(error for error in drawn.errors if error))[:_TOLD]
    if codes := [code for code in drawn.findings if code]:
        names = ", ".join(dict.fromkeys(" ".join(codes).split()))
        notes.append(f"{names} in {len(codes)} samples (column findings of samples.csv)")
    header = ("quantity", "case", "mean", "deviation", *(f"{p:g} %" for p in PERCENTILES))
    blocks = [Block("Samples", header, tuple(rows), tuple(notes))]
    if whole < _ENOUGH:
        return blocks
    names, made = [entry.variable.name for entry in entries], []
    for quantity, row in zip(drawn.quantities, drawn.correlation(), strict=True):
        first = np.argsort(-np.abs(row), kind="stable")[:_TOLD]
        made.append((quantity.name, ", ".join(f"{names[i]} ({row[i]:+.2f})" for i in first)))
    note = f"rank correlations; chance alone makes up to {2.0 / np.sqrt(whole - 1):.2f} in 19 of 20 cases"
    return [*blocks, Block("What makes it", ("quantity", "tolerances"), tuple(made), (note,))]


def _draw(drawn: EntrySamples, path: Path) -> None:
    """Draw the cumulative distribution of the first quantities, with the case as it is."""
    shown = drawn.quantities[:_PANELS]
    columns = min(len(shown), 3)
    rows = -(-len(shown) // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=4.4 * columns + 0.6, height=3.4 * rows + 0.6)
    values = drawn.values[drawn.whole]
    share = (np.arange(len(values)) + 0.5) / len(values)
    for number, (quantity, ax) in enumerate(zip(shown, axes, strict=False)):
        scale = quantity.dimension.scale
        ax.plot(np.sort(values[:, number]) / scale, 100.0 * share, color=BLUE, linewidth=1.8, label="samples")
        if np.isfinite(drawn.nominal[number]):
            ax.axvline(drawn.nominal[number] / scale, color=VERMILION, linewidth=1.4, linestyle="--", label="case")
        title = f"{quantity.name} [{quantity.dimension.shown}]".replace("[um]", "[µm]")
        label(ax, fill(title, 36), "samples below [%]" if number % columns == 0 else "")
    for ax in axes[len(shown) :]:
        ax.remove()
    legend_below(figure)
    save_figure(figure, path)
