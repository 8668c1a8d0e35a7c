"""The rows of the validation as CSV, and the page about them: the same whenever the numbers are."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from femgear.storage.disk_errors import storage_errors
from femgear.storage.files import write_text
from validation.rows import ROUNDING, Row
from validation.run import Validation

FAR_BELOW = 0.01  # of its gate: an error below is not shown in figures
ROOM = 1e-6  # gates up to here leave room for rounding: nothing within is shown in figures
UNCERTAIN = 1e-9  # without a gate
SMALL = {"femgear", "scipy", "daqp", "ross-rotordynamics", "pi", "cos", "sin", "tan", "exp", "sqrt", "sinc"}

FIELDS = ("theme", "case", "quantity", "reference", "femgear", "error", "gate", "verdict", "source", "reason")
"""Columns of the CSV file; a reason stands only where a row differs."""
VERDICTS = ("passes", "FAILS", "differs", "information")

INTRODUCTION = """\
# Validation

The column *femgear* is computed by the program when the rows are written. The column *reference* comes from
the source named in the row: a closed form, a standard, a published table or an independent method.

* The *error* is relative, in percent of the reference, or absolute where it carries the mark "abs."; an
  absolute one below {rounding:g} is rounding.
* The *gate* is the largest error that passes. A reference of which only printed digits are known has half a
  unit of its last digit as gate. Gates of 1e-6 and below leave room for rounding on other machines.
* An error below a hundredth of its gate is shown by that bound, one within a gate of 1e-6 or less by the
  gate. The rows are then the same on every machine.
* *differs* marks a disagreement that is understood: [its reason](#rows-that-differ). *information* has no
  gate.

References that femgear could not compute itself come from modules of `validation` that the row names. They
take nothing from the models that they check; `python validation --theme "lumped set"` repeats one theme.
Printed numbers beside which `tests/validation/test_printed_references.py` is named are computed again by that
file, which imports nothing of femgear.

`python validation` writes this page and the rows, [validation.csv](validation.csv); `python validation --page`
writes the page alone from the rows that are there. `--theme NAME` prints one theme with its published tables; a
name that does not exist lists all. The same rows are tests.
"""
ALL_ROWS = """## All rows

```{validation-rows}
```
"""


def records(validation: Validation) -> list[dict[str, str]]:
    """Rows of a validation as they stand in the CSV file, one dictionary of `FIELDS` a row."""
    return [_record(theme.title, row) for theme in validation.themes for row in theme.rows]


def _record(theme: str, row: Row) -> dict[str, str]:
    source = " ".join(_sentence(part) for part in (row.source, row.note) if part)
    reason = _sentence(row.explanation) if row.verdict == "differs" else ""
    numbers = _reference(row), _ours(row), _error(row), _gate(row)
    cells = theme, row.case, row.quantity, *numbers, row.verdict, source, reason
    return dict(zip(FIELDS, (" ".join(cell.split()) for cell in cells)))


def page(rows: Sequence[Mapping[str, str]], introductions: Mapping[str, str], *, quick: bool = False) -> str:
    """Text of the page, made from the rows alone.

    Parameters
    ----------
    rows : sequence of mappings
        As `records` makes them and `read_rows` reads them.
    introductions : mapping of str to str
        Introductions of the themes by their titles, in their order.
    quick : bool
        Say that what takes long was left out.

    Returns
    -------
    str
        Markdown: summary, rows that differ, themes. No date, path or machine name, so that it is reproducible.
    """
    parts = [INTRODUCTION.format(rounding=ROUNDING), f"{len(rows)} rows: {_tally(rows)}.\n"]
    if quick:
        parts.append("Quick validation: what takes long was left out.\n")
    for verdict, title in (("FAILS", "Rows that fail"), ("differs", "Rows that differ")):
        groups: dict[tuple[str, ...], list[Mapping[str, str]]] = {}
        for row in rows:
            if row["verdict"] == verdict:
                groups.setdefault((row["theme"], row["case"], row["reason"]), []).append(row)
        if groups:
            parts.append(f"## {title}\n")
            parts += [_group(*key, group) for key, group in groups.items()]
    parts.append("## Themes\n")
    for title, text in introductions.items():
        of_theme = [row for row in rows if row["theme"] == title]
        parts.append(f"### {title}\n")
        parts.append(f"{text} {len(of_theme)} rows: {_tally(of_theme)}.".lstrip() + "\n")
    return "\n".join([*parts, ALL_ROWS])


def _tally(rows: Sequence[Mapping[str, str]]) -> str:
    verdicts = Counter(row["verdict"] for row in rows)
    return ", ".join(f"{verdicts[name]} {name}" for name in VERDICTS if verdicts[name])


def _group(theme: str, case: str, reason: str, rows: Sequence[Mapping[str, str]]) -> str:
    """Prose about rows of one case with one reason."""
    sources = list(dict.fromkeys(row["source"] for row in rows))
    common = sources[0] if len(sources) == 1 else ""
    title = theme if case == theme else f"{theme}, {case}"
    lines = [" ".join(part for part in (f"**{title}.**", reason, common and f"Reference: {common}") if part), ""]
    for row in rows:
        error = ", ".join(text for text in (row["error"], row["gate"] and f"gate {row['gate']}") if text)
        numbers = f"{row['femgear']} beside {row['reference']} ({error})"
        lines.append(f"* {row['quantity']}: {numbers}" + ("" if common else f". {row['source']}"))
    return "\n".join(lines) + "\n"


def read_rows(path: str | os.PathLike) -> list[dict[str, str]]:
    """Read the rows of a CSV file that `write_page` wrote."""
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def summary(validation: Validation) -> str:
    """Rows that fail, or one line that none does, for the terminal."""
    verdicts = Counter(row.verdict for row in validation.rows)
    lines = [f"{row_line(row)}. {row.note}".rstrip() for row in validation.failures]
    counted = ", ".join(f"{count} {verdict}" for verdict, count in sorted(verdicts.items()))
    return "\n".join([*lines, f"{len(validation.rows)} rows: {counted}"])


def row_line(row: Row) -> str:
    """One row as one line of text, with its verdict first."""
    parts = (
        ("reference", _reference(row)),
        ("femgear", _ours(row)),
        ("error", _error(row)),
        ("gate", _gate(row)),
    )
    shown = ", ".join(f"{name} {text}" for name, text in parts if text)
    return f"{row.verdict} {row.case}: {row.quantity}: {shown}"


def write_page(validation: Validation, path: str | os.PathLike) -> None:
    """Write the page, and beside it the rows as a CSV file, each whole or not at all.

    Parameters
    ----------
    validation : Validation
    path : path
        Markdown file to write, the rows beside it with the ending ``.csv``; its folder is made when missing.

    Raises
    ------
    StorageError
        When a file cannot be written; an older one stays as it was.
    """
    rows, text = records(validation), io.StringIO()
    writer = csv.DictWriter(text, FIELDS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with storage_errors(path):
        Path(path).parent.mkdir(parents=True, exist_ok=True)
    write_text(text.getvalue(), Path(path).with_suffix(".csv"))
    introductions = {theme.title: theme.introduction for theme in validation.themes}
    write_text(page(rows, introductions, quick=validation.quick), path)


def write_page_of_rows(path: str | os.PathLike, introductions: Mapping[str, str]) -> None:
    """Write the page anew from the CSV file beside it, without computing; see `write_page`."""
    write_text(page(read_rows(Path(path).with_suffix(".csv")), introductions), path)


def _sentence(text: str) -> str:
    """A remark as a sentence; symbols and names, such as ``k_n`` and ``femgear``, keep small letters."""
    first = text.split()[0].rstrip(",.:;")
    if re.fullmatch(r"a|[a-z][a-z-]+", first) and first not in SMALL:
        text = text[0].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else text + "."


def _digits(row: Row) -> int:
    """Significant digits of a computed number: as many as its gate asks for, six to eight."""
    if not row.gate or not row.reference:
        return 6
    relative = row.gate if row.relative else row.gate / abs(row.reference)
    return min(max(round(-math.log10(relative)), 6), 8)


def _bound(gate: float | None) -> float:
    """Size below which digits may be those of the machine, so that this bound stands for them."""
    if gate is None:
        return UNCERTAIN
    return gate if gate <= ROOM else FAR_BELOW * gate


def _size(value: float) -> str:
    """A quantity that should vanish: small ones by a bound."""
    if abs(value) >= 1e-3:
        return f"{value:.2g}"
    decade = math.floor(math.log10(abs(value)))
    if abs(value) < 1e-5:
        return f"< 1e{decade + 1}"
    return f"< {next(step for step in (2, 5, 10) if abs(value) < step * 10.0**decade) * 10.0**decade:.0e}"


def _decimals(row: Row) -> int | None:
    """Decimals of a reference printed without exponent."""
    if row.shown and "e" not in row.shown.lower() and "." in row.shown:
        return min(len(row.shown.split(".")[1]), 12)
    return None


def _reference(row: Row) -> str:
    if row.reference is None:
        return "0"
    # sources leave the zero before the point away
    return re.sub(r"^(-?)\.", r"\g<1>0.", row.shown) or f"{row.reference:.{8 if row.gate else 6}g}"


def _ours(row: Row) -> str:
    if not math.isfinite(row.ours):
        return "none"
    bound = _bound(row.gate)
    if row.ours == 0 and (row.reference or not bound or isinstance(row.ours, int)):
        return "0"
    if not row.reference and abs(row.ours) < bound:
        return f"< {bound:g}"
    if row.reference is None:
        return _size(row.ours)
    decimals = _decimals(row)
    return f"{row.ours:.{_digits(row)}g}" if decimals is None else f"{row.ours:.{decimals}f}"


def _error(row: Row) -> str:
    if row.reference is None:
        return ""
    if not math.isfinite(row.error):
        return "none"
    absolute = not row.relative or not row.reference
    if isinstance(row.reference, int):
        return "0" if row.error == 0 else f"{row.error:+g}"
    if absolute:
        scale = max(1.0, abs(row.reference))
        return f"< {ROUNDING:g}" if abs(row.error) < ROUNDING * scale else f"{row.error:+.1e} abs."
    bound = _bound(row.gate)
    return f"< {100 * bound:.2g} %" if abs(row.error) < bound else f"{100 * row.error:+.2g} %"


def _gate(row: Row) -> str:
    if row.gate is None:
        return ""
    if isinstance(row.reference, int):
        return "exact"
    if row.reference is None:
        return f"<= {row.gate:g}"
    if row.relative and row.reference:
        return f"{100 * row.gate:.2g} %"
    return f"{row.gate:.1e} abs."
