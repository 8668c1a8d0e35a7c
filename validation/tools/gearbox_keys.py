#!/usr/bin/env python3
"""Write the tables of all keys of a gearbox case in docs/gearbox.md, from the sections that read them::

    python validation/tools/gearbox_keys.py

What a key means is written by hand on the page, and stays there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from femgear.case import quantities
from femgear.case.quantities import Dimension
from femgear.trains.gearbox import case_file
from femgear.trains.gearbox.case_file import GearboxCase

PAGE = Path(__file__).resolve().parents[2] / "docs" / "gearbox.md"
BEGIN, END = "<!-- keys of a gearbox case: validation/tools/gearbox_keys.py -->", "<!-- end of the keys -->"
DIMENSIONS = {
    value.name: value
    for module in (quantities, case_file)
    for value in vars(module).values()
    if isinstance(value, Dimension)
}


def meanings_on(text: str) -> dict[tuple[str, str], str]:
    """Read what the page says that keys mean, by table and key."""
    meanings, path = dict[tuple[str, str], str](), ""
    for line in text.split(BEGIN)[1].split(END)[0].splitlines():
        if title := re.fullmatch(r"\*\*`\[+([\w.]+)\]+`\*\*", line):
            path = title[1]
        elif row := re.fullmatch(r"\| `(\w+)` \| (.*?) ?\| .* \| .* \|", line):
            meanings[path, row[1]] = row[2]
    return meanings


def tables(meanings: Mapping[tuple[str, str], str]) -> str:
    """Make the tables as Markdown, one a section: key, meaning, value, default."""
    schema = GearboxCase.model_json_schema()
    lines = ["At the top:"]
    for path, section in _sections(schema, schema, ""):
        lines += [f"**{path}**"] if path else []
        lines += ["", "| key | meaning | value | default |", "|---|---|---|---|"]
        required = section.get("required", ())
        for key, entry in section["properties"].items():
            plain = _plain(entry)
            default = "needed" if key in required else _default(plain, entry.get("default"))
            cells = f"`{key}`", meanings.get((path.strip("`[]"), key), ""), _value(plain), default
            lines.append(f"| {' | '.join(cells)} |".replace("|  |", "| |"))
        lines.append("")
    return "\n".join(lines)


def page_with_tables(text: str) -> str:
    """Put the tables between their marks on the page."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n\n{tables(meanings_on(text))}\n{END}{rest.split(END)[1]}"


def _sections(schema: Mapping[str, Any], section: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    """Tables of the file with their place, each before those within it."""
    yield path, section
    for key, entry in section["properties"].items():
        plain = _plain(entry)
        listed = plain.get("items", plain)
        if "$ref" in listed:
            inner = schema["$defs"][listed["$ref"].rpartition("/")[2]]
            name = f"{path.strip('`[]')}.{key}" if path else key
            yield from _sections(schema, inner, f"`[[{name}]]`" if "items" in plain else f"`[{name}]`")


def _plain(entry: Mapping[str, Any]) -> Mapping[str, Any]:
    """What an entry is where it is given."""
    choices = [choice for choice in entry.get("anyOf", [entry]) if choice.get("type") != "null"]
    return choices[0] if len(choices) == 1 else {"choices": choices}


def _value(entry: Mapping[str, Any]) -> str:
    """Say what stands there."""
    if "choices" in entry:
        return " or ".join(dict.fromkeys(_value(choice) for choice in entry["choices"]))
    if "$ref" in entry or "$ref" in entry.get("items", {}):
        return "list of tables" if "items" in entry else "table"
    if "description" in entry:
        return entry["description"].removeprefix("a ").removeprefix("an ").replace(" with its unit", "")
    if "enum" in entry or "const" in entry:
        return ", ".join(f"`{_written(choice)}`" for choice in entry.get("enum", [entry.get("const")]))
    kind, low, high = entry.get("type"), entry.get("minimum"), entry.get("maximum")
    low, high = entry.get("exclusiveMinimum", low), entry.get("exclusiveMaximum", high)
    if kind == "array":
        fewest, most = entry.get("minItems"), entry.get("maxItems")
        return f"list of {fewest} values" if fewest and fewest == most else "list of values"
    if isinstance(kind, list):
        return " or ".join(_value({"type": one_kind}) for one_kind in kind)
    words = {"integer": "whole number", "number": "number", "boolean": "`true`, `false`", "object": "table"}
    if low is not None and low == high:
        return f"{low:g}"
    limits = f", {low:g} to {high:g}" if low is not None and high is not None and high < 1e29 else ""
    return words.get(str(kind), "text") + limits


def _default(entry: Mapping[str, Any], value: object) -> str:
    """Write the default in the unit of messages."""
    if value is None or value in ((), [], {}):
        return "none"
    if isinstance(value, dict):
        return "its defaults"
    if isinstance(value, float):
        words = entry.get("description", "")
        names = [name for name in DIMENSIONS if words.startswith((f"{name} ", f"{name},"))]
        if math.isinf(value):
            return '`"rigid"`'
        return DIMENSIONS[max(names, key=len)].show(value) if names and value else f"{value:g}"
    if isinstance(value, list | tuple):
        return ", ".join(_default({}, entry_value) for entry_value in value)
    return f"`{_written(value)}`"


def _written(value: object) -> str:
    """Write a value as TOML has it."""
    return f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)


if __name__ == "__main__":
    PAGE.write_text(page_with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
