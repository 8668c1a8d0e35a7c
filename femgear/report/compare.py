"""Runs beside one another: what differs in cases and numbers, curves over each other, modes matched, sounds."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from html import escape
from itertools import chain, product
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.findings import percent
from femgear.report.page import chart_figure, document, folded, part_of, shown_data, table
from femgear.report.tables import MARKS, WARNINGS, Block, is_bound, merged_names, unmarked

if TYPE_CHECKING:
    from femgear.stages.judgements import Judgement
    from femgear.stages.protocol import Train
    from femgear.storage.results import Results

ANSWERS = "Page one of all"
"""Title of the table of what page one answers."""
MODES = "Modes matched by shape"
"""Title of the table of modes."""
OPERATION = "What they do"
"""Title of the table of torques and speeds."""
OPEN = OPERATION, ANSWERS, "Key figures", "Cases", "Verdict"
"""Titles of the tables that are not folded away."""
_MOST_ROWS = 10
"""Rows that a terminal shows of a table."""
_LEFT_OUT = "published"
"""Part of the names of entries that only name what results are set beside."""
_NUMBERS = ("first", "second", "third")
"""Names of runs where nothing else tells them apart."""
_MEETING = ("operating [rpm]", "mode", "kind", "mesh harmonic")
"""Columns that tell which resonance a row is."""
_EXCITED = "excited up to"
"""Column of where the excitation ends, on which levels depend."""
NO_CHANGE = "-"
"""Change of a number of which only a bound is known."""
_LEAST_CHANGE = 1e-3
"""Change of the key figure of a part from which on it is listed."""
_FADED = 0.55
"""Opacity of the curves of the second run; those of the third have that of the second, and so on."""
_DASHES = ("dash", "dot", "dashdot", "longdash")
"""Of the curves of the second run and of those after it."""
_EQUAL = 1e-6
"""Relative distance of natural frequencies within which their modes are one space."""
_LEAST_ALIKE = 0.5
"""MAC from which on a mode is found again."""
_MODES_SHOWN = 24
_CHARTS_FIRST = 3
"""Charts before the tables that are folded away."""


def names_of(runs: Sequence[Results]) -> list[str]:
    """Name runs by their folders, or by numbers where two folders are called alike."""
    names = [run.folder.resolve().name for run in runs]
    return names if len({*names}) == len(names) else [_name(number) for number in range(len(names))]


def compared(train: Train, *runs: Results) -> tuple[Block, ...]:
    """Tabulate runs of one train: what they do, what page one answers of all, then entries and numbers that differ.

    Changes are those against the first run.
    """
    names = names_of(runs)
    rows = tuple(_entries(*((run.case.source, run.case.model_dump(by_alias=True)) for run in runs)))
    blocks = [*_operation(train, runs, names, rows), *_answers(train, runs, names), *_key_figures(train, runs, names)]
    blocks.append(_differing_entries(rows, names))
    described = [{block.title: block for block in train.verdict(run)} | train.describe_stages(run) for run in runs]
    for title in described[0]:
        if all(title in tables for tables in described):
            blocks.append(_differences(*(tables[title] for tables in described), names=names))
    return (*blocks, *_matched_modes(runs, names), _findings(runs, names))


def in_brief(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """Choose what a terminal shows of the tables of `compared`: those that are not folded away, of few rows each."""
    shown = [
        replace(block, rows=block.rows[:_MOST_ROWS], notes=_with_rest(block)) for block in blocks if block.title in OPEN
    ]
    others = [block.title for block in blocks if block.title not in OPEN and block.rows]
    more = f"by --verbose and on the page: {', '.join(others)}" if others else ""
    return (*shown, Block("More that differs", notes=(more,))) if more else tuple(shown)


def _with_rest(block: Block) -> tuple[str, ...]:
    """Notes of a table, and how many rows of it a terminal does not show."""
    rest = len(block.rows) - _MOST_ROWS
    return (*block.notes, f"{rest} more rows by --verbose and on the page") if rest > 0 else block.notes


def _operation(
    train: Train, runs: Sequence[Results], names: Sequence[str], entries: Sequence[tuple[str, ...]]
) -> Iterator[Block]:
    """Tabulate torques, speeds and powers of runs that do not do the same; ``entries`` are those that differ."""
    duties = [train.duty(run.case) for run in runs]
    loads = [key for key, *_ in entries if _is_load(key)]
    if loads or len({*duties}) > 1:
        note = f"{merged_names(loads)} differ: forces, levels and lives do by that alone" if loads else ""
        yield Block(OPERATION, ("", *names), (("operation", *duties),), (note,) if note else ())


def _is_load(key: str) -> bool:
    """Tell whether an entry is a torque or a speed of operation, by the section and the end of its name."""
    return key.startswith("operation.") and any(part in key for part in (".torque", ".speed", ".power"))


def _differing_entries(rows: Sequence[tuple[str, ...]], names: Sequence[str]) -> Block:
    """Tabulate entries that differ, those of the operation first and the title last."""
    kept = [row for row in rows if _LEFT_OUT not in row[0]]
    kept.sort(key=lambda row: (row[0] == "title", not row[0].startswith("operation.")))
    notes = [f"{len(rows) - len(kept)} entries of published values that differ are left out"] * (len(kept) < len(rows))
    return Block("Cases", ("entry", *names) if kept else (), tuple(kept), tuple(notes if rows else ["the same"]))


def _name(number: int) -> str:
    return _NUMBERS[number] if number < len(_NUMBERS) else f"{number + 1}th"


def _answers(train: Train, runs: Sequence[Results], names: Sequence[str]) -> Iterator[Block]:
    """Tabulate what page one answers of all runs, question by question."""
    answers = [{judgement.question: judgement for judgement in train.summary(run)[1]} for run in runs]
    rows = tuple(
        (question, *(_answer(of_run[question]) if question in of_run else "-" for of_run in answers))
        for question in dict.fromkeys(chain.from_iterable(answers))
    )
    if rows:
        yield Block(ANSWERS, ("", *names), rows)


def _answer(judgement: Judgement) -> str:
    return f"{judgement.words}: {judgement.answer}"


def _key_figures(train: Train, runs: Sequence[Results], names: Sequence[str]) -> Iterator[Block]:
    """Tabulate the key figures of all runs, those of the whole and of parts that change: the largest changes first."""
    of_runs = [{figure.name: figure for figure in train.key_figures(run.case)} for run in runs]
    if not any(of_runs):
        return
    rows, same = [], 0
    for name, figure in of_runs[0].items():
        there = all(name in of_run for of_run in of_runs) and all(figure.stage in run.stages for run in runs)
        if not there:
            continue
        first, *others = (figure.read(run[figure.stage]) for run in runs)
        alike = [math.isclose(first, x, rel_tol=_LEAST_CHANGE) or (math.isnan(first) and math.isnan(x)) for x in others]
        if not figure.whole and all(alike):
            same += 1
            continue
        changes = ["" if equal else figure.change(first, x) for x, equal in zip(others, alike, strict=True)]
        shown = chain.from_iterable(zip(map(figure.show, others), changes, strict=True))
        unit = f" [{figure.dimension.shown}]".replace(" [1]", "")
        size = max(figure.relative_change(first, x) for x in others)
        rows.append((not figure.whole, -size, (f"{name}{unit}", figure.show(first), *shown)))
    notes = (f"{same} figures of parts change by less than {percent(_LEAST_CHANGE, 1)}",) if same else ()
    if rows or same:
        rows.sort(key=lambda row: row[:2])
        yield Block("Key figures", ("figure", *_with_changes(names)), tuple(row[-1] for row in rows), notes)


def _with_changes(names: Sequence[str]) -> tuple[str, ...]:
    """Header of the numbers of all runs, with the changes of those after the first."""
    return names[0], *chain.from_iterable((name, "change") for name in names[1:])


def _matched_modes(runs: Sequence[Results], names: Sequence[str]) -> Iterator[Block]:
    """Tabulate which modes of the other runs have the shapes of those of the first one."""
    data = [run["modes"] for run in runs if "modes" in run.stages]
    if len(data) < len(runs) or any(_shapes(modes) is None for modes in data):
        return
    first, *others = data
    matches = [match_modes(first, modes) for modes in others]
    rows = []
    for mode in np.flatnonzero(first["frequency"].values > 0.0)[:_MODES_SHOWN]:
        row = [_mode(first, mode), _hertz(first, mode)]
        for modes, again in zip(others, matches, strict=True):
            number, alike = again.get(int(mode), (None, 0.0))
            row += ("-", "-", "") if number is None else (_mode(modes, number), _hertz(modes, number), f"{alike:.2f}")
        rows.append(tuple(row))
    header = ("mode", f"{names[0]} [Hz]", *chain.from_iterable(("mode", f"{n} [Hz]", "MAC") for n in names[1:]))
    note = f"MAC: 1 for equal shapes; below {_LEAST_ALIKE:g} none is taken as found again"
    if rows:
        yield Block(MODES, header, tuple(rows), (note,))


def _mode(modes: Any, number: int) -> str:
    """Number of a mode, as its run counts them."""
    return str(int(modes["mode"].values[number]) + (1 if int(modes["mode"].values[0]) == 0 else 0))


def _hertz(modes: Any, number: int) -> str:
    return f"{float(modes['frequency'].values[number]):.5g}"


def _shapes(modes: Any) -> dict[str, np.ndarray] | None:
    """Motions (mode,) by the names of the coordinates; None where modes.nc has none."""
    shape = next((modes[name] for name in ("shape", "motion") if name in modes), None)
    if shape is None:
        return None
    others = [dim for dim in shape.dims if dim != "mode"]
    if any(dim not in modes.coords for dim in others):
        return None
    values = shape.transpose(*others, "mode").values.reshape(-1, shape.sizes["mode"])
    names = product(*(map(str, modes[dim].values) for dim in others))
    return {" ".join(name): row for name, row in zip(names, values, strict=True)}


def match_modes(first: Any, second: Any) -> dict[int, tuple[int, float]]:
    """Match modes by the shapes of the motions that both runs have.

    The modal assurance criterion is that of R. J. Allemang and D. L. Brown, A correlation coefficient for modal
    vector analysis (1982), |a b|^2/(a a)(b b), of modes of one frequency its mean over their space. Motions of several
    units count alike. Pairs are taken from the largest one down, each mode once.

    Parameters
    ----------
    first, second : Dataset
        Of modes.nc, with ``frequency`` (mode,) [Hz], and ``shape`` (dof, mode) or ``motion`` (station, way, mode).

    Returns
    -------
    dict of int to (int, float)
        Place of the mode of the second run and MAC, by the place of that of the first one, where it is found again.
    """
    shapes = [_shapes(modes) or {} for modes in (first, second)]
    shared = [name for name in shapes[0] if name in shapes[1]]
    if not shared or 2 * len(shared) < max(map(len, shapes)):
        return {}
    spaces = [
        _mode_spaces(modes["frequency"].values, np.array([of_run[name] for name in shared]))
        for modes, of_run in zip((first, second), shapes, strict=True)
    ]
    alike = np.array(
        [[np.sum((a.T @ b) ** 2) / max(a.shape[1], b.shape[1]) for _, b in spaces[1]] for _, a in spaces[0]]
    )
    matched, free = dict[int, tuple[int, float]](), np.ones(alike.shape, bool)
    for place in np.argsort(-alike, axis=None) if alike.size else ():
        i, j = np.unravel_index(place, alike.shape)
        if alike[i, j] >= _LEAST_ALIKE and free[i, j]:
            matched |= {a: (b, float(alike[i, j])) for a, b in zip(spaces[0][i][0], spaces[1][j][0])}
            free[i], free[:, j] = False, False
    return matched


def _mode_spaces(hertz: np.ndarray, shape: np.ndarray) -> list[tuple[list[int], np.ndarray]]:
    """Modes of one frequency each, with an orthonormal basis of their shapes (dof, modes of it)."""
    shape = shape / np.maximum(np.sqrt(np.mean(shape**2, axis=1, keepdims=True)), 1e-300)
    together = list[list[int]]()
    for mode in map(int, np.flatnonzero(hertz > 0.0)):
        if together and hertz[mode] - hertz[together[-1][-1]] <= _EQUAL * hertz[mode]:
            together[-1].append(mode)
        else:
            together.append([mode])
    return [(numbers, np.linalg.qr(shape[:, numbers])[0]) for numbers in together]


def _findings(runs: Sequence[Results], names: Sequence[str]) -> Block:
    """Tabulate the warnings that some of the runs have, by code and stage."""
    of_runs = [{(finding.code, finding.stage): finding for finding in run.findings} for run in runs]
    every = {key: finding for of_run in of_runs for key, finding in of_run.items()}
    rows = tuple(
        (
            f"{finding.severity} {finding.code}",
            finding.stage or "the case",
            *("yes" if key in of_run else "-" for of_run in of_runs),
        )
        for key, finding in every.items()
        if not all(key in of_run for of_run in of_runs)
    )
    return Block(WARNINGS, ("", "of", *names) if rows else (), rows, () if rows else ("the same",))


def _entries(*cases: tuple[str, Any]) -> Iterator[tuple[str, ...]]:
    """Entries of cases, texts and values, of which the values differ: "120 N m" is "120 Nm"."""
    given = [dict(_flat(tomllib.loads(text))) for text, _ in cases]
    for key in sorted({key for entries in given for key in entries}):
        first, *others = (entries.get(key) for entries in given)
        value, *values = (_value(case, key) for _, case in cases)
        if any(first != text and not _alike(value, x) for text, x in zip(others, values, strict=True)):
            yield key, *(str(entries.get(key, "not given")) for entries in given)


def _value(case: Any, key: str) -> Any:
    """Value of an entry; of one inside what is read as a whole, such as a range of speeds, that whole."""
    for part in re.findall(r"[^.\[\]]+", key):
        inner = case.get(part) if isinstance(case, dict) else None
        if isinstance(case, list | tuple) and part.isdigit() and int(part) < len(case):
            inner = case[int(part)]
        if inner is None:
            return None if isinstance(case, dict) else case
        case = inner
    return case


def _alike(x: object, y: object) -> bool:
    """Whether two values agree but for the rounding of their units."""
    if isinstance(x, float) and isinstance(y, float):
        return math.isclose(x, y, rel_tol=1e-12)
    if isinstance(x, list | tuple) and isinstance(y, list | tuple):
        return len(x) == len(y) and all(map(_alike, x, y))
    return x == y


def _flat(entries: object, path: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of a case file with their whole names."""
    if isinstance(entries, dict):
        for key, value in entries.items():
            yield from _flat(value, f"{path}.{key}" if path else key)
    elif isinstance(entries, list) and any(isinstance(entry, dict) for entry in entries):
        for i, value in enumerate(entries):
            yield from _flat(value, f"{path}[{i}]")
    else:
        yield path, entries


def _differences(*blocks: Block, names: Sequence[str] = ()) -> Block:
    """Cells of tables that differ, with the change against the first where both are numbers."""
    names = names or [_name(number) for number in range(len(blocks))]
    title = blocks[0].title
    headers = [block.header for block in blocks]
    if any(header != headers[0] for header in headers):  # as of a set with supports and one without
        common = tuple(name for name in headers[0] if all(name in header for header in headers))
        blocks = tuple(_shared(block, common) for block in blocks)
    header = blocks[0].header
    meeting = [name for name in _MEETING if "mesh harmonic" in header and name in header]
    key_columns = [header.index(name) for name in meeting] or [0]
    tables = [{tuple(row[i] for i in key_columns): row for row in block.rows} for block in blocks]
    keys = dict.fromkeys(chain.from_iterable(tables))
    alone = {key for key in keys if not all(key in table_of_run for table_of_run in tables)}
    whole = all(len(rows_of) == len(block.rows) for rows_of, block in zip(tables, blocks, strict=True))
    if any(block.header != header for block in blocks) or not whole or len(alone) == len(keys) > 0:
        return Block(title, notes=("the tables have other rows; see the reports",))
    if not meeting:
        keys = {key: None for key in keys if key not in alone}
    rows, columns = [], header or [""] * max(map(len, blocks[0].rows), default=0)
    for key in keys:
        what = ", ".join(f"{columns[i]} {text}".strip() for i, text in zip(key_columns, key))
        if key in alone:
            listed = ["listed" if key in table_of_run else "-" for table_of_run in tables]
            rows.append((what, "", listed[0], *chain.from_iterable((text, "") for text in listed[1:])))
            continue
        for i, cells in enumerate(zip(*(table_of_run[key] for table_of_run in tables))):
            if i not in key_columns and any(cell != cells[0] for cell in cells):
                decibels = "dB" in f"{title} {what} {columns[i]}"
                others = ((cell, _change(cells[0], cell, decibels=decibels)) for cell in cells[1:])
                rows.append((what, columns[i], cells[0], *chain.from_iterable(others)))
    shown_header = ("row", "column", *_with_changes(names)) if rows else ()
    other_rows = [", ".join(key) for key in alone] if not meeting else []
    return Block(title, shown_header, tuple(rows), tuple(_notes(rows, blocks, names, other_rows)))


def _notes(
    rows: Sequence[tuple[str, ...]], blocks: Sequence[Block], names: Sequence[str], other_rows: Sequence[str]
) -> Iterator[str]:
    """Say under a table of differences what its numbers cannot; ``other_rows`` are those that not all runs have."""
    if not rows:
        yield "the same"
    if other_rows:
        yield f"rows that not all runs have: {', '.join(sorted(other_rows))}"
    ends = [list(map(float, row[2:3] + row[3::2])) for row in rows if row[1].startswith(_EXCITED)]
    if any(max(values) - min(values) > 0.05 * values[0] for values in ends):
        yield (
            "NO LIKE LEVELS: their excitation ends at different frequencies; give the cases the same "
            "dynamics.up_to or dynamics.mesh_harmonics"
        )
    if any(NO_CHANGE in row[4::2] for row in rows if row[1]):
        yield f"{NO_CHANGE}: one of both is a bound (>), of which nothing tells how far it is away"
    for number, (name, block) in enumerate(zip(names, blocks, strict=True)):
        shown = "".join(row[2 if not number else 2 * number + 1] for row in rows)
        yield from (f"{name}: {note}" for note in block.notes if note[0] in MARKS and note[0] in shown)


def _shared(block: Block, header: tuple[str, ...]) -> Block:
    """The columns of a table that stand in another header too."""
    kept = [i for i, name in enumerate(block.header) if name in header]
    rows = tuple(tuple(row[i] for i in kept) for row in block.rows)
    return replace(block, header=tuple(block.header[i] for i in kept), rows=rows)


def _change(first: str, second: str, *, decibels: bool) -> str:
    """Change in per cent, of levels in dB, nothing where a cell is no number, `NO_CHANGE` of a bound."""
    try:
        x, y = (float(unmarked(text)) for text in (first, second))
    except ValueError:
        return ""
    if is_bound(first) or is_bound(second):
        return NO_CHANGE
    if decibels:
        return f"{y - x:+.3g} dB"
    return f"{100.0 * (y / x - 1.0):+.3g} %" if x else ""


def compare_page(train: Train, *runs: Results) -> str:
    """Make the page of some runs as HTML text; see `compared`."""
    names, data = names_of(runs), [shown_data(run) for run in runs]
    drawn = [of_run.get("charts", {}) for of_run in data]
    charts = {
        name: overlaid
        for name in drawn[0]
        if all(name in of_run for of_run in drawn)
        and (overlaid := _overlaid(*(of_run[name] for of_run in drawn), names=names)) is not None
    }
    first = [name for name, _ in train.front if name in charts]
    charts = {name: charts[name] for name in dict.fromkeys([*first, *charts])}
    main = [f"<h1>{escape(' and '.join(names))}</h1>\n"]
    tables = compared(train, *runs)
    shown = sum(block.title in OPEN for block in tables)
    for number, block in enumerate(tables):
        if number == shown:
            main += _curves([*charts][:_CHARTS_FIRST])
        content = f'<div class="compare">{table(block, heading=False)}</div>'
        main.append(folded(f"difference-{number}", block.title, content, block.title in OPEN))
    runups = {f"runup {i}": of_run["runup"] for i, of_run in enumerate(data, 1) if "runup" in of_run}
    for name, key in zip((name for name, of_run in zip(names, data) if "runup" in of_run), runups, strict=True):
        place = part_of("runup").replace('data-run="runup"', f'data-run="{key}"')
        main.append(f"<h2>Run-up of {escape(name)}</h2>\n{place}")
    main += _curves([*charts][_CHARTS_FIRST:])
    return document(" and ".join(names), "".join(main), {"charts": charts} | runups)


def _curves(names: Iterable[str]) -> list[str]:
    """Places of charts."""
    places = [chart_figure(name, name.replace("_", " ")) for name in names]
    return ['<p class="note">Dashed and pale: the runs after the first.</p>\n', *places] if places else []


def _overlaid(*charts: dict[str, Any], names: Sequence[str] = ()) -> dict[str, Any] | None:
    """Draw the curves of charts over each other; None where their panels differ, or have areas in place of them."""
    names = names or [_name(number) for number in range(len(charts))]
    first, *others = charts
    if any(len(other["panels"]) != len(first["panels"]) for other in others):
        return None
    panels = []
    for panel, *same in zip(*(chart["panels"] for chart in charts)):
        if any(trace.get("type") == "heatmap" for each in (panel, *same) for trace in each["traces"]):
            return None
        later = enumerate(zip(same, names[1:], strict=True))
        faded = [_faded(trace, name, number) for number, (other, name) in later for trace in _drawn(other)]
        if not faded:
            return None
        ranges = {axis: panel[axis] | _joint(*(each[axis] for each in (panel, *same))) for axis in ("x", "y")}
        traces = [_named(trace, names[0]) for trace in panel["traces"]]
        panels.append(panel | ranges | {"traces": [*traces, *faded], "words": []})
    return first | {"panels": panels}


def _drawn(panel: dict[str, Any]) -> list[dict[str, Any]]:
    """Curves of a panel."""
    return [trace for trace in panel["traces"] if trace.get("hoverinfo") != "skip"]


def _named(trace: dict[str, Any], name: str) -> dict[str, Any]:
    """Curve of the first run, named after it where it has no name."""
    return trace if trace.get("name") or trace.get("hoverinfo") == "skip" else trace | {"name": name}


def _faded(trace: dict[str, Any], name: str, number: int) -> dict[str, Any]:
    """Curve of a run after the first: pale, dashed and named after its run."""
    line = {"line": trace["line"] | {"dash": _DASHES[number % len(_DASHES)]}} if "line" in trace else {}
    label = f"{trace['name']}, {name}" if trace.get("name") else name
    return trace | line | {"name": label, "opacity": _FADED}


def _joint(*axes: dict[str, Any]) -> dict[str, Any]:
    """Limits that hold all axes."""
    if any("range" not in axis for axis in axes):
        return {}
    ends = [end for axis in axes for end in axis["range"]]
    return {"range": [min(ends), max(ends)]}
