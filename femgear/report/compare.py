"""Two runs beside one another: what differs in cases and numbers, curves over each other, both sounds."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any

from femgear.report.page import chart_figure, document, folded, part_of, shown_data, table
from femgear.report.tables import MARKS, WARNINGS, Block, is_bound, unmarked

if TYPE_CHECKING:
    from femgear.stages.judgements import Judgement
    from femgear.stages.protocol import Train
    from femgear.storage.results import Results

ANSWERS = "Page one of both"
"""Title of the table of what page one answers."""
OPEN = ANSWERS, "Key figures", "Cases"
"""Titles of the tables that are not folded away."""
_MEETING = ("operating [rpm]", "mode", "kind", "mesh harmonic")
"""Columns that tell which resonance a row is."""
_EXCITED = "excited up to"
"""Column of where the excitation ends, on which levels depend."""
NO_CHANGE = "-"
"""Change of a number of which only a bound is known."""
_LEAST_CHANGE = 1e-3
"""Change of the key figure of a part from which on it is listed."""
_FADED = 0.55
"""Opacity of the curves of the second run."""


def compared(train: Train, first: Results, second: Results) -> tuple[Block, ...]:
    """Tabulate two runs of one train: what page one answers of both, then entries and numbers that differ."""
    cases = [(run.case.source, run.case.model_dump(by_alias=True)) for run in (first, second)]
    rows = tuple(_entries(*cases))
    entries = Block("Cases", ("entry", "first", "second") if rows else (), rows, () if rows else ("the same",))
    blocks = [*_answers(train, first, second), entries, *_key_figures(train, first, second)]
    others = train.describe_stages(second)
    verdicts = {block.title: block for block in train.verdict(second)}
    for block in train.verdict(first):
        if block.title in verdicts:
            blocks.append(_differences(block, verdicts[block.title]))
    for title, block in train.describe_stages(first).items():
        if title in others:
            blocks.append(_differences(block, others[title]))
    return (*blocks, _findings(first, second))


def _answers(train: Train, first: Results, second: Results) -> Iterator[Block]:
    """Tabulate what page one answers of both runs, question by question."""
    both = [{judgement.question: judgement for judgement in train.summary(run)[1]} for run in (first, second)]
    questions = dict.fromkeys([*both[0], *both[1]])
    rows = tuple(
        (question, *(_answer(of_run[question]) if question in of_run else "-" for of_run in both))
        for question in questions
    )
    if rows:
        yield Block(ANSWERS, ("", "first", "second"), rows)


def _answer(judgement: Judgement) -> str:
    return f"{judgement.words}: {judgement.answer}"


def _key_figures(train: Train, first: Results, second: Results) -> Iterator[Block]:
    """Tabulate the key figures of both runs with their changes: of the whole, and of parts that change."""
    runs = [first, second]
    both = [{figure.name: figure for figure in train.key_figures(run.case)} for run in runs]
    if not any(both):
        return
    rows, same = [], 0
    for name, figure in both[0].items():
        if name not in both[1] or not all(figure.stage in run.stages for run in runs):
            continue
        x, y = (figure.read(run[figure.stage]) for run in runs)
        alike = math.isclose(x, y, rel_tol=_LEAST_CHANGE) or (math.isnan(x) and math.isnan(y))
        if not figure.whole and alike:
            same += 1
            continue
        unit = f" [{figure.dimension.shown}]".replace(" [1]", "")
        rows.append((f"{name}{unit}", figure.show(x), figure.show(y), "" if alike else figure.change(x, y)))
    notes = (f"{same} figures of parts change by less than {_LEAST_CHANGE:.1%}",) if same else ()
    if rows or same:
        yield Block("Key figures", ("figure", "first", "second", "change"), tuple(rows), notes)


def _findings(first: Results, second: Results) -> Block:
    """Tabulate the warnings that one of two runs alone has, by code and stage."""
    a, b = ({(finding.code, finding.stage): finding for finding in run.findings} for run in (first, second))
    rows = tuple(
        (f"{value.severity} {value.code}", value.stage or "the case", *(("yes", "-") if key in a else ("-", "yes")))
        for key, value in (a | b).items()
        if (key in a) != (key in b)
    )
    return Block(WARNINGS, ("", "of", "first", "second") if rows else (), rows, () if rows else ("the same",))


def _entries(*cases: tuple[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Entries of two cases, texts and values, of which the values differ: "120 N m" is "120 Nm"."""
    a, b = (dict(_flat(tomllib.loads(text))) for text, _ in cases)
    for key in sorted(a.keys() | b.keys()):
        if a.get(key) != b.get(key) and not _alike(*(_value(case, key) for _, case in cases)):
            yield key, str(a.get(key, "not given")), str(b.get(key, "not given"))


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


def _differences(first: Block, second: Block) -> Block:
    """Cells of two tables that differ, with the change where both are numbers."""
    if first.header != second.header:  # as of a set with supports and one without
        first, second = _shared(first, second.header), _shared(second, first.header)
    names = [name for name in _MEETING if "mesh harmonic" in first.header and name in first.header]
    key_columns = [first.header.index(name) for name in names] or [0]
    a, b = ({tuple(row[i] for i in key_columns): row for row in block.rows} for block in (first, second))
    alone = [key for key in [*a, *b] if (key in a) != (key in b)]
    whole = (len(a), len(b)) == (len(first.rows), len(second.rows))
    if first.header != second.header or not whole or (alone and not names):
        return Block(first.title, notes=("the tables have other rows; see the reports",))
    rows, columns = [], first.header or [""] * max(map(len, first.rows), default=0)
    for key in dict.fromkeys([*a, *b]):
        what = ", ".join(f"{columns[i]} {text}".strip() for i, text in zip(key_columns, key))
        if key in alone:
            rows.append((what, "", *(("listed", "-") if key in a else ("-", "listed")), ""))
            continue
        for i, (x, y) in enumerate(zip(a[key], b[key])):
            if x != y and i not in key_columns:
                unit = f"{first.title} {what} {columns[i]}"
                rows.append((what, columns[i], x, y, _change(x, y, decibels="dB" in unit)))
    header = ("row", "column", "first", "second", "change") if rows else ()
    notes = () if rows else ("the same",)
    ends = [(float(x), float(y)) for _, column, x, y, _ in rows if column.startswith(_EXCITED)]
    if any(abs(y - x) > 0.05 * x for x, y in ends):
        notes = (
            "NO LIKE LEVELS: their excitation ends at different frequencies; give both cases the same "
            "dynamics.up_to or dynamics.mesh_harmonics",
        )
    if any(change == NO_CHANGE for *_, change in rows):
        notes += (f"{NO_CHANGE}: one of both is a bound (>), of which nothing tells how far it is away",)
    for which, block, column in (("first", first, 2), ("second", second, 3)):
        shown = "".join(row[column] for row in rows)
        notes += tuple(f"{which}: {note}" for note in block.notes if note[0] in MARKS and note[0] in shown)
    return Block(first.title, header, tuple(rows), notes)


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


def compare_page(train: Train, first: Results, second: Results) -> str:
    """Make the page of two runs as HTML text; see `compared`."""
    data = [shown_data(run) for run in (first, second)]
    charts = {
        name: both
        for name, value in data[0].get("charts", {}).items()
        if name in data[1].get("charts", {}) and (both := _overlaid(value, data[1]["charts"][name])) is not None
    }
    title = f"{first.folder.name} and {second.folder.name}"
    runs = {f"runup {i}": run_data["runup"] for i, run_data in enumerate(data, 1) if "runup" in run_data}
    main = [f"<h1>{escape(title)}</h1>\n"]
    for number, block in enumerate(compared(train, first, second)):
        content = f'<div class="compare">{table(block, heading=False)}</div>'
        main.append(folded(f"difference-{number}", block.title, content, block.title in OPEN))
    for run, key in zip((first, second), runs):
        place = part_of("runup").replace('data-run="runup"', f'data-run="{key}"')
        main.append(f"<h2>Run-up of {escape(run.folder.name)}</h2>\n{place}")
    main.append('<h2>Curves</h2>\n<p class="note">Pale: the second run.</p>\n')
    main += [chart_figure(name, name.replace("_", " ")) for name in charts]
    return document(title, "".join(main), {"charts": charts} | runs)


def _overlaid(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any] | None:
    """Draw the curves of two charts over each other; None where their panels differ, or have areas in place of them."""
    if len(first["panels"]) != len(second["panels"]):
        return None
    panels = []
    for panel, other in zip(first["panels"], second["panels"]):
        if any(trace.get("type") == "heatmap" for trace in panel["traces"]):
            return None
        faded = [
            trace | {"name": f"{trace['name']}, second" if trace.get("name") else "", "opacity": _FADED}
            for trace in other["traces"]
            if trace.get("hoverinfo") != "skip"
        ]
        if not faded:
            return None
        ranges = {axis: panel[axis] | _joint(panel[axis], other[axis]) for axis in ("x", "y")}
        panels.append(panel | ranges | {"traces": [*panel["traces"], *faded], "words": []})
    return first | {"panels": panels}


def _joint(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Limits that hold both axes."""
    if "range" not in first or "range" not in second:
        return {}
    ends = [*first["range"], *second["range"]]
    return {"range": [min(ends), max(ends)]}
