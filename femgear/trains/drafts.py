"""Case files that femgear writes: new ones from a few numbers, and those that are read from other files.

What is not known is estimated from the gears, and every line that holds an estimate or assumption says so.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from copy import deepcopy
from textwrap import wrap
from typing import Any

from femgear.case import text as case_text
from femgear.case.estimates import estimates
from femgear.errors import GeometryError
from femgear.trains.reading import parse_case

_SHORTEST = 0.7
"""Addendum in modules below which tips are not shortened further."""


def draft_text(
    tables: Mapping[str, Any], remarks: Mapping[str, str], *, word: str, head: Iterable[str] = ()
) -> str:
    """Write the text of a case from tables, with estimates of what they leave out.

    Parameters
    ----------
    tables : mapping
        As `femgear.read_case` takes them.
    remarks : mapping of str to str
        By dotted key, written behind the entries.
    word : str
        Before each estimate: "estimated" or "assumed".
    head : iterable of str
        Paragraphs before the first entry.

    Raises
    ------
    CaseError, GeometryError
        Tables that make no case.
    """
    tables, notes = deepcopy(dict(tables)), dict(remarks)
    case = _case_of(tables, notes, word)
    for key, one in estimates(case).items():
        section, last = key.rpartition(".")[::2]
        model = _section(case, section)
        # rigid rings have no foundation
        if model is None or last not in type(model).model_fields or (section == "ring" and case.rigid):
            continue
        table = tables
        for part in section.split("."):
            table = table.setdefault(part, {})
        if last not in table:
            table[last] = str(one)
            notes[key] = f"{word}: {one.how}{f'; {notes[key]}' if key in notes else ''}"
    ordered = {name: tables[name] for name in type(case).model_fields if name in tables}
    lines = [f"# {line}".rstrip() for one in head for line in wrap(one, 105) or [""]]
    return "\n".join([*lines, case_text.write(ordered, notes)])


def _case_of(tables: dict[str, Any], notes: dict[str, str], word: str) -> Any:
    """Read tables as a case; tips whose height nothing gives are shortened until they run free."""
    while True:
        try:
            return parse_case(case_text.write(tables))
        except GeometryError as error:
            tip = re.search(r"the (\w+)'s tip|and (\w+) \(\d+\) strike", error.message)
            name = (tip[1] or tip[2]) if tip else ""
            if error.code not in ("E-FILLET", "E-INTERFERENCE") or not name:
                raise
            where = f"{name}.rack" if "rack" in tables[name] else "rack"
            rack = dict(tables[name].get("rack", tables.get("rack", {})))
            addendum = rack.get("addendum", 1.0)
            given = "addendum" in rack and not notes.get(f"{where}.addendum", "").startswith(word)
            if given or "tip_diameter" in tables[name] or addendum < _SHORTEST:
                raise
            tables[name]["rack"] = {**rack, "addendum": round(addendum - 0.05, 2)}
            notes |= {
                f"{name}.rack.{key}": notes[f"{where}.{key}"] for key in rack if f"{where}.{key}" in notes
            }
            notes[f"{name}.rack.addendum"] = f"{word}: tips as long as run free of their mates"


def _section(case: Any, key: str) -> Any:
    """Section of a dotted key, None where the case has none."""
    for part in key.split("."):
        case = getattr(case, part, None)
    return case
