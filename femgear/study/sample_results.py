"""As-built sets of a command: samples in blocks, what is told of all of them, and files.

The numbers of all samples stand in a file (`Columns`) beside the journal of the blocks that are
computed; memory holds a block of them, or one number of all. The results are written from there.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.planetary import Case
from femgear.errors import CaseError, FemgearError, StorageError
from femgear.findings import Finding, as_text, findings_in, percent, tell
from femgear.report.style import BLUE, VERMILION, label, legend_below, new_figure, save_figure
from femgear.report.tables import Block, Marks
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.stages.static_results import HELD, LARGEST_PEAK_DOUBT, SERIES
from femgear.storage.disk_errors import storage_errors
from femgear.storage.files import (
    append_dataset,
    own_files,
    replaced_file,
    resumable,
    write_text,
)
from femgear.storage.results import dataset
from femgear.study.designs import Journal, open_journal, text_checksum
from femgear.study.runner import Runner, check_complete
from femgear.study.samples import (
    MOST_SAMPLES,
    NUMBERS,
    SampleModel,
    between_positions,
    checked,
    exact_numbers,
    joined,
    over_a_turn,
    sample_block,
    sample_case,
)
from femgear.trains.reading import to_toml

if TYPE_CHECKING:
    import xarray as xr

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_BLOCKS, _SLICED_BLOCKS = {"spring": 512, "exact": 64}, {"spring": 256, "exact": 5}
"""Samples of a task, and of one in slices of the face width."""
_CHECKED, _SLICED_CHECKED = 8, 3
"""Samples from the least to the largest transmission error that are solved again in every way."""
_MOST_AGAIN, _SHARE_AGAIN = 1000, 100
"""Samples drawn at random that are solved again exactly: at most so many, and one in so many."""
_DRAWN, _BINS, _FINE = 100_000, 80, 640
"""Samples that are drawn point by point; bins of their distributions, and of a grid that stands for more."""
_ROWS = 2**16
"""Samples that are read at once."""
SHOWN = tuple(NUMBERS)[:4]
"""What is told of all samples."""
_EVERY_WAY = "in every way "
"""Beginning of the keys of samples that are solved again in every way."""
FILES, _JOURNAL, _COLUMNS = ("samples.nc", "samples.png", "worst.toml"), "samples.jsonl", ".samples.part"
"""What a command writes, and what it goes on from: a journal of the blocks, and their numbers."""


@one_blas_thread()
def samples_into(
    case: Case,
    folder: Path,
    basis: tuple[SampleModel, str],
    *,
    count: int = 1000,
    seed: int = 1,
    exact: bool | None = None,
    force: bool = False,
    progress: Progress = silent,
    runner: Runner | None = None,
) -> tuple[list[Block], list[str]]:
    """Compute samples 0 to ``count - 1``; write numbers, a figure and the worst of them as a case file.

    The worst has the largest transmission error. ``basis`` is what `prepared` gives. What there is to say
    comes back with the names of the files; what keeps samples from being computed is raised (`Runner.map`).
    Blocks of samples are kept until the end, their numbers in a file beside a journal: an interrupted command
    goes on from them. Complete results are refused (StorageError, E-OUTPUT), or replaced with ``force``.

    Left out, ``exact`` is what the model needs.

    Of samples as springs one in a hundred, at most a thousand, drawn at random, is also solved exactly.
    """
    model, text = basis
    checked(count, "--number", 1)
    if exact is False and model.walked:
        raise CaseError(
            "helical teeth, back flanks and bearings with clearance have no springs for their tooth pairs",
            code="E-CHOICE",
            key="--method",
            value="spring",
            limit="exact",
            remedy="take --method exact, or leave --method out",
        )
    exact = model.walked if exact is None else exact
    again = 0 if exact else min(count // _SHARE_AGAIN, _MOST_AGAIN)
    own_files(folder, FILES)
    if (folder / FILES[0]).exists() and not (force or (folder / _JOURNAL).exists()):
        raise StorageError(
            "the folder holds results already",
            code="E-OUTPUT",
            file=str(folder),
            remedy="name a new folder, or replace them with --force",
        )
    method = "exact" if exact else "spring"
    more = {"tolerances": text_checksum(text), "seed": seed, "method": method, "positions": len(model.position)}
    widths = {n: model.basis.gears.n_planets * ("planet" in dims) for n, (dims, *_) in NUMBERS.items()}
    with (
        resumable(folder),
        open_journal(folder / _JOURNAL, case, more, _is_block) as journal,
        open_columns(folder / _COLUMNS, widths) as columns,
    ):
        tasks = _Tasks(model, seed, journal, columns, progress, runner or Runner())
        tasks.compute(count, method)
        data, ideal = _checked_again(case, model, text, tasks, count, again, more)
        missed = _missed_peaks(data)
        for finding in _findings_of_peaks(data, missed):
            tell(finding)
            data.attrs["findings"] = as_text([finding])
        _write(data, columns, folder / FILES[0])
        save_figure(figure(data, columns), folder / FILES[1])
        write_text(to_toml(sample_case(case, model, seed, data.attrs["worst"])), folder / FILES[2])
    for name in (_JOURNAL, _COLUMNS):
        (folder / name).unlink(missing_ok=True)
    return _described(data, ideal, _limits(case, model)), list(FILES)


def _ratios(larger: np.ndarray, smaller: np.ndarray) -> tuple[float, float]:
    """Smallest and largest ratio of numbers (n,) to others; one where the others are zero."""
    ratio = np.divide(larger, smaller, out=np.ones(len(larger)), where=smaller > 0.0)
    return float(ratio.min()), float(ratio.max())


def _missed_peaks(data: xr.Dataset) -> dict[str, float]:
    """Find the share of every number that the positions of the samples miss at most, by name."""
    return {
        name: 1.0 - 1.0 / _ratios(data[f"{name}_between"].values, data[f"{name}_exact"].values)[1]
        for name in SHOWN
        if f"{name}_between" in data
    }


def _findings_of_peaks(data: xr.Dataset, missed: Mapping[str, float]) -> Iterator[Finding]:
    """Say (W-POSITIONS) where positions miss much of what lies between them: shares of `_missed_peaks`."""
    name = max(missed, key=missed.__getitem__)
    if missed[name] > LARGEST_PEAK_DOUBT:
        text = (
            f"{data.attrs['positions']} positions of a mesh period miss up to {percent(missed[name])} of the "
            f"{name.replace('_', ' ')} of the samples that were solved again"
        )
        yield Finding("W-POSITIONS", "--positions", text, remedy="take more positions")


def _limits(case: Case, model: SampleModel) -> Iterator[str]:
    """Say what the numbers of all samples assume."""
    elastic = '; static.members = "elastic" lets them move on their supports and bearings' * (not case.rigid)
    yield f"stiffness {SERIES}" if case.static.members == "elastic" else f"{HELD}{elastic}"
    if model.walked:
        yield "every sample is solved as femgear run solves it: no springs stand for its tooth pairs"
    elif model.level(*model.windows).tilts is not None:
        yield "profile slopes do not move the windows here (some tenths of a per cent)"


class _Tasks:
    """Blocks of samples that workers compute, and those that a journal and its columns have already."""

    def __init__(self, model, seed: int, journal: Journal, columns: Columns, progress, runner: Runner):
        self.model, self.seed, self.columns = model, seed, columns
        self._journal, self._progress, self._runner = journal, progress, runner
        self._sizes = _SLICED_BLOCKS if model.basis.over or model.walked else _BLOCKS

    def compute(self, count: int, method: str) -> None:
        """Compute all samples that are missing, and put them into the columns."""
        size = self._sizes[method]
        blocks = {f"{first}-{min(first + size, count)}": first for first in range(0, count, size)}

        def kept(key: str) -> bool:
            first, end = map(int, key.split("-"))
            return key in self._journal and self.columns.holds(first, end, self._journal[key]["checksum"])

        def keep(key: str, numbers: dict[str, np.ndarray]) -> dict:
            return {"checksum": self.columns.write(blocks[key], numbers)}

        items = [tuple(map(int, key.split("-"))) for key in blocks]
        self._map(partial(_block, self.model, self.seed, method == "exact"), [*blocks], items, "samples", kept, keep)

    def exactly(self, chosen: np.ndarray) -> dict[str, np.ndarray]:
        """Numbers of some samples (n,), solved exactly."""
        size = self._sizes["exact"]
        items = [tuple(map(int, part)) for part in np.split(chosen, range(size, len(chosen), size))]
        keys = [f"exact {text_checksum(str(item))[:16]} {len(item)}" for item in items]

        def keep(key: str, numbers: dict[str, np.ndarray]) -> dict:
            return {name: part.tolist() for name, part in numbers.items()}

        kept = self._journal.__contains__
        self._map(partial(_exact_block, self.model, self.seed), keys, items, "samples again, exactly", kept, keep)
        return joined([{name: np.array(part) for name, part in self._journal[key].items()} for key in keys])

    def in_every_way(self, chosen: np.ndarray) -> tuple[dict[str, np.ndarray], list[dict[str, np.ndarray]]]:
        """Numbers of some samples (n,), solved exactly; and over a turn and between positions."""
        keys = [f"{_EVERY_WAY}{index}" for index in chosen.tolist()]

        def keep(key: str, numbers: tuple[dict[str, np.ndarray], list]) -> dict:
            return {"exact": {name: part.tolist() for name, part in numbers[0].items()}, "ways": numbers[1]}

        kept = self._journal.__contains__
        solve = partial(_every_way, self.model, self.seed)
        self._map(solve, keys, chosen.tolist(), "samples again, in every way", kept, keep)
        records = [self._journal[key] for key in keys]
        exact = joined([{name: np.array(part) for name, part in record["exact"].items()} for record in records])
        ways = np.array([record["ways"] for record in records])
        return exact, [dict(zip(SHOWN, ways[:, way].T)) for way in (0, 1)]

    def _map(self, function, keys: list[str], items: list, stage: str, kept, keep) -> None:
        """Compute the items of keys that are not kept."""
        left = [i for i, key in enumerate(keys) if not kept(key)]
        outcomes = self._runner.map(function, [items[i] for i in left])
        for done, (index, outcome) in enumerate(outcomes, len(keys) - len(left) + 1):
            if isinstance(outcome, FemgearError):
                raise outcome
            key = keys[left[index]]
            self._journal.add(key, keep(key, outcome))
            self._progress(stage, done, len(keys))
        check_complete(keys, self._journal)


def _is_block(key: str, record: dict) -> bool:
    """Tell whether a record of a journal belongs to a block of samples, or has the numbers of exact ones."""
    if key.startswith(_EVERY_WAY):
        numbers = [*record["exact"].values(), *record["ways"]]
        return record["exact"].keys() == NUMBERS.keys() and all(np.isfinite(part).all() for part in numbers)
    if not key.startswith("exact "):
        first, end = map(int, key.split("-"))
        return first < end and type(record["checksum"]) is str
    parts = [np.array(record[name], float) for name in NUMBERS]
    return all(len(part) == int(key.split()[-1]) and np.isfinite(part).all() for part in parts)


def _checked_again(
    case: Case, model: SampleModel, text: str, tasks: _Tasks, count: int, again: int, more: dict
) -> tuple[xr.Dataset, dict]:
    """Numbers of samples that are solved exactly beside all others; those of the set without errors."""
    seed, columns = more["seed"], tasks.columns
    order = np.argsort(columns.column("transmission_error", count), kind="stable")
    largest, worst = columns.column("largest_share", count).argmax(), int(order[-1])
    checks = min(_SLICED_CHECKED if model.basis.over or model.walked else _CHECKED, count)
    chosen = np.unique(np.append(order[np.linspace(0, count - 1, checks).astype(int)], largest))
    del order
    exact, (turn, between) = tasks.in_every_way(chosen)
    ideal = exact_numbers(model, np.zeros((1, model.size)))
    # those of a run of the case
    ideal |= dict(zip(SHOWN, np.transpose([between_positions(model, np.zeros(model.size))])))
    attrs = {"seed": seed, "tolerances": text, "case": to_toml(case), "worst": worst, "samples": count}
    attrs |= {"method": more["method"], "largest": int(largest), "positions": len(model.position)}
    attrs |= {"equidistant": model.equidistant, "mesh_periods": 1, "turn": model.basis.gears.ring.teeth}
    entries = _checks(columns, chosen, exact, {"turn": turn, "between": between})
    coords = {
        "planet": ("planet", np.arange(model.basis.gears.n_planets) + 1, "1", "planet"),
        "quantile": ("quantile", QUANTILES, "1", "share of the samples below"),
        "check": ("check", chosen, "1", "sample of the seed that was solved again"),
    }
    if again:
        # drawn by a number that no sample has
        drawn = np.sort(np.random.default_rng([seed, MOST_SAMPLES]).choice(count, again, replace=False))
        entries |= _differences(columns, drawn, tasks.exactly(drawn))
        words = "sample of the seed that was drawn to be solved exactly"
        coords["drawn"] = ("drawn", drawn, "1", words)
    entries |= _of_all(columns, count)
    return dataset(entries, coords, attrs), ideal


def _at(columns: Columns, name: str, chosen: np.ndarray) -> np.ndarray:
    """Number of some samples."""
    return np.array([columns.rows(i, i + 1)[name][0] for i in chosen.tolist()])


def _checks(columns: Columns, chosen: np.ndarray, exact, more: dict[str, dict]) -> dict[str, tuple]:
    """Entries of the samples that are solved again, also over a ``turn``, and ``between`` positions."""
    entries: dict[str, tuple] = {}
    for name in SHOWN:
        _, unit, words = NUMBERS[name]
        error = np.abs(_at(columns, name, chosen) - exact[name]).max() / np.abs(exact[name]).max()
        entries[f"{name}_exact"] = ("check", exact[name], unit, f"{words}, whole contact problem")
        entries[f"{name}_error"] = ("", error, "1", f"{words}: largest error of the checked samples")
        for where, where_in_words in (("turn", "over a turn of the carrier"), ("between", "with the peaks between")):
            if name in more[where]:
                entries[f"{name}_{where}"] = ("check", more[where][name], unit, f"{words}, {where_in_words}")
    return entries


def _differences(columns: Columns, drawn: np.ndarray, exact: dict[str, np.ndarray]) -> dict[str, tuple]:
    """Entries of the samples that were drawn to be solved exactly, and what springs miss of them."""
    entries: dict[str, tuple] = {}
    for name in SHOWN:
        _, unit, words = NUMBERS[name]
        difference = _at(columns, name, drawn) / exact[name] - 1.0
        entries[f"{name}_drawn"] = ("drawn", exact[name], unit, f"{words}, whole contact problem")
        meaning = f"{words}: what springs are above the whole contact problem, over it"
        entries[f"{name}_difference"] = ("drawn", difference, "1", meaning)
        quantiles = np.quantile(difference, QUANTILES)
        entries[f"{name}_difference_quantile"] = ("quantile", quantiles, "1", f"{meaning}, quantiles")
    return entries


def _of_all(columns: Columns, count: int) -> dict[str, tuple]:
    """Entries of quantiles and of the largest of all samples, and of the share in which planets open."""
    entries: dict[str, tuple] = {}
    for name in SHOWN:
        _, unit, words = NUMBERS[name]
        values = columns.column(name, count)
        entries[f"{name}_quantile"] = (
            "quantile",
            np.quantile(values, QUANTILES),
            unit,
            f"{words}, quantiles",
        )
        entries[f"{name}_largest"] = ("", values.max(), unit, f"{words}, largest of all samples")
    opens = sum(int((rows["opens"] > 0.0).any(axis=1).sum()) for _, rows in columns.blocks(count))
    words = "share of the samples in which a planet loses its load"
    return entries | {"share_that_opens": ("", opens / count, "1", words)}


def _write(data: xr.Dataset, columns: Columns, path: Path) -> None:
    """Write a dataset with the numbers of all its samples, some samples at a time."""
    count, row = (
        data.attrs["samples"],
        8 * sum(max(len(data.planet) * ("planet" in d), 1) for d, *_ in NUMBERS.values()),
    )
    with replaced_file(path, size=data.nbytes + count * row) as temporary:
        for first, rows in columns.blocks(count):
            numbers = {n: (dims, rows[n], unit, words) for n, (dims, unit, words) in NUMBERS.items()}
            opens = rows["opens"] > 0.0
            numbers["opens"] = (numbers["opens"][0], opens, *numbers["opens"][2:])
            sample = np.arange(first, first + len(opens)), "1", "sample of the seed"
            block = data.assign(dataset(numbers, {"sample": ("sample", *sample)}, {}))
            append_dataset(block, temporary, "sample")


def _block(model: SampleModel, seed: int, exact: bool, ends: tuple[int, int]) -> dict[str, np.ndarray]:
    return sample_block(model, seed, ends[0], ends[1] - ends[0], exact=exact)


def _every_way(model: SampleModel, seed: int, index: int) -> tuple[dict[str, np.ndarray], list]:
    """Numbers of a sample solved exactly; the first of them over a turn, and with the peaks between."""
    errors = model.draw(seed, index, 1)
    return exact_numbers(model, errors), [over_a_turn(model, errors[0]), between_positions(model, errors[0])]


def _exact_block(model: SampleModel, seed: int, chosen: tuple[int, ...]) -> dict[str, np.ndarray]:
    return exact_numbers(model, np.concatenate([model.draw(seed, i, 1) for i in chosen]))


def figure(data: xr.Dataset, columns: Columns):
    """Draw transmission error against largest share of all samples, and the distributions of both."""
    count = data.attrs["samples"]
    # beyond so many, points of a fine grid that weigh as many samples as lie there
    share, ste, weight = (_points if count <= _DRAWN else _grid)(columns, count)
    figure_, axes = new_figure(columns=3, width=12.0, height=4.2)
    names = "transmission error, peak to peak [µm]", "largest share of a planet [1]"
    # points of tens of thousands of samples would hide one another
    cells = {"gridsize": 50, "bins": "log", "mincnt": 1, "cmap": "cividis", "linewidths": 0.2}
    counts = axes[0].hexbin(share, ste, C=weight, reduce_C_function=np.sum, **cells)
    figure_.colorbar(counts, ax=axes[0], label="samples in a cell", pad=0.02, format="%d").minorticks_off()
    worst = int(data.attrs["worst"])
    at = columns.rows(worst, worst + 1)
    point = at["largest_share"][0], 1e6 * at["transmission_error"][0]
    axes[0].plot(*point, "D", color=VERMILION, label=f"worst: sample {worst}")
    label(axes[0], names[1], names[0], f"{count} samples, seed {data.attrs['seed']}")
    quantiles = 1e6 * data.transmission_error_quantile, data.largest_share_quantile
    for ax, name, values, of_all in zip(axes[1:], names, (ste, share), quantiles, strict=True):
        # limits below rounding leave samples that differ by less than bins can
        middle, spread = float(np.mean(values)), float(np.ptp(values))
        reach = max(0.5 * spread, 1e-6 * abs(middle), 1e-12) if spread < 1e-6 * abs(middle) else None
        ends = None if reach is None else (middle - reach, middle + reach)
        ax.hist(values, _BINS, range=ends, weights=100.0 / count * weight, color=BLUE)
        for part, dash in ((0.5, "-"), (0.95, "--"), (0.99, ":")):
            at = float(of_all.sel(quantile=part))
            ax.axvline(at, color=VERMILION, linestyle=dash, label=f"{percent(part)} of the samples below")
        label(ax, name, "samples [%]")
    legend_below(figure_, columns=4)
    return figure_


def _points(columns: Columns, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Largest share, transmission error [um] and weight of all samples."""
    share, ste = (columns.column(name, count) for name in ("largest_share", "transmission_error"))
    return share, 1e6 * ste, np.ones(count)


def _grid(columns: Columns, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points as `_points` gives them, but the middles of the cells of a grid in which samples lie."""
    names = "largest_share", "transmission_error"
    ends = [(values.min(), values.max()) for values in (columns.column(name, count) for name in names)]
    number, edges = np.zeros((_FINE, _FINE)), []
    for _, rows in columns.blocks(count):
        part, *edges = np.histogram2d(*(rows[name] for name in names), bins=_FINE, range=ends)
        number += part
    share, ste = (0.5 * (edge[1:] + edge[:-1]) for edge in edges)
    cells = np.nonzero(number)
    return share[cells[0]], 1e6 * ste[cells[1]], number[cells]


def _described(data: xr.Dataset, ideal: dict[str, np.ndarray], limits: Iterable[str]) -> list[Block]:
    """Quantiles of all numbers, marked where doubtful, and how far to trust them; what they assume."""
    of_peaks, marks = _missed_peaks(data), Marks(findings_in(data.attrs))
    scales = {"m": (1e6, " [um]"), "N/m": (1e-6, " [N/um]"), "1": (1.0, "")}
    rows, errors, turns, between, missed = [], [], [], [], []
    for name in SHOWN:
        _, unit, words = NUMBERS[name]
        scale, shown = scales[unit]
        values = [*data[f"{name}_quantile"].values, float(data[f"{name}_largest"])]
        codes = ["W-POSITIONS"] if of_peaks.get(name, 0.0) > LARGEST_PEAK_DOUBT else []
        texts = (marks(f"{scale * value:.5g}", *codes) for value in values)
        rows.append((f"{words}{shown}", f"{scale * ideal[name][0]:.5g}", *texts))
        errors.append(f"{float(data[f'{name}_error']):.1e} ({name.replace('_', ' ')})")
        for where, lines in (("turn", turns), ("between", between)):
            if (compared := data.get(f"{name}_{where}")) is not None:
                low, high = _ratios(compared.values, data[f"{name}_exact"].values)
                lines.append(f"{low:.3g} to {high:.3g} times the {name.replace('_', ' ')}")
        if (difference := data.get(f"{name}_difference")) is not None:
            of_drawn = [*data[f"{name}_difference_quantile"].values, np.abs(difference.values).max()]
            missed.append((words, *(f"{100.0 * value:.2g}" for value in of_drawn)))
    worst, check = int(data.attrs["worst"]), data.check.values
    of_worst = 1e6 * float(data.transmission_error_between.values[check == worst][0])
    notes = (
        f"method {data.attrs['method']}; {len(check)} samples solved again exactly differ by at most "
        f"{', '.join(errors)} of the largest",
        f"{data.attrs['positions']} positions of one mesh period: {data.attrs['equidistant']} equidistant, "
        "others where the set without drawn errors has its peaks, and the end; over the "
        f"{data.attrs['turn']} of a turn of the carrier these samples have {' and '.join(turns)}",
        f"with the peaks of the samples themselves, as femgear run has them, {' and '.join(between)}",
        f"a planet loses its load in {percent(float(data.share_that_opens), 2)} of the samples",
        f"worst.toml (femgear run --only static): sample {worst}, STE {of_worst:.6g} um; "
        f"largest share: sample {data.attrs['largest']}",
        *limits,
        *marks.notes,
    )
    shares = tuple(percent(q) for q in QUANTILES)
    title = f"{data.attrs['samples']} samples, seed {data.attrs['seed']}"
    blocks = [Block(title, ("number", "ideal", *shares, "largest"), tuple(rows), notes)]
    if missed:
        title = f"Springs above the whole contact problem in {len(data.drawn)} samples drawn at random [%]"
        blocks.append(Block(title, ("number", *shares, "largest, either way"), tuple(missed)))
    return blocks


class Columns:
    """A file with a row of numbers for every sample; use `open_columns`.

    Parameters
    ----------
    widths : dict
        How many values a sample has of each number, by name: 0 of one that is a single value.
    """

    def __init__(self, path: Path, stream, widths: Mapping[str, int]):
        self._path, self._stream, self._widths = path, stream, dict(widths)
        self._ends = np.cumsum([max(width, 1) for width in self._widths.values()])
        self._bytes = 8 * int(self._ends[-1])

    def write(self, first: int, numbers: Mapping[str, np.ndarray]) -> str:
        """Write numbers (n,) or (n, width) of samples from ``first`` on, and force them out; give their checksum."""
        parts = [np.asarray(numbers[name], float) for name in self._widths]
        data = np.column_stack(parts).tobytes()
        with storage_errors(self._path):
            self._stream.seek(first * self._bytes)
            rest = memoryview(data)
            while rest:
                rest = rest[self._stream.write(rest) or 0 :]
            os.fsync(self._stream.fileno())
        return _checksum(data)

    def holds(self, first: int, end: int, checksum: str) -> bool:
        """Tell whether the file has samples ``first`` to ``end - 1`` as they were written."""
        return _checksum(self._read(first, end)) == checksum

    def rows(self, first: int, end: int) -> dict[str, np.ndarray]:
        """Read numbers (end - first,) or (end - first, width) of samples ``first`` to ``end - 1``, by their names."""
        table = np.frombuffer(self._read(first, end)).reshape(end - first, -1)
        parts = np.split(table, self._ends[:-1], axis=1)
        named = zip(self._widths.items(), parts, strict=True)
        return {name: part if width else part[:, 0] for (name, width), part in named}

    def blocks(self, count: int) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """Give the number of the first of some samples at a time, of ``count`` in all, and their `rows` (n, ...)."""
        for first in range(0, count, _ROWS):
            yield first, self.rows(first, min(first + _ROWS, count))

    def column(self, name: str, count: int) -> np.ndarray:
        """Read one number (count,) or (count, width) of the first ``count`` samples."""
        width = self._widths[name]
        column_ = np.empty((count, width) if width else count)
        for first, rows in self.blocks(count):
            column_[first : first + _ROWS] = rows[name]
        return column_

    def _read(self, first: int, end: int) -> bytes:
        with storage_errors(self._path):
            self._stream.seek(first * self._bytes)
            data = bytearray()
            # a read may give less than is asked for
            while part := self._stream.read((end - first) * self._bytes - len(data)):
                data += part
        return bytes(data)


@contextmanager
def open_columns(path: Path, widths: Mapping[str, int]) -> Iterator[Columns]:
    """Open the numbers of samples, those that a file of an interrupted command has among them."""
    with storage_errors(path):
        if os.path.lexists(path) and not stat.S_ISREG(path.lstat().st_mode):
            raise StorageError("no regular file", file=str(path), remedy="move it away")
        # unbuffered, so that what could not be written is not written later
        path.touch()
        stream = open(path, "r+b", buffering=0)
    with stream:
        yield Columns(path, stream, widths)


def _checksum(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
