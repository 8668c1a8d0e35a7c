"""docs/case_file.md: defaults that it prints are those of the sections."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from femgear.trains.reading import every_section

PAGE = (Path(__file__).parents[2] / "docs" / "case_file.md").read_text(encoding="utf-8")
SECTIONS = ("rack", "material", "strength", "lubricant", "losses", "static", "dynamics", "housing", "runup")


def printed_defaults() -> Iterator[tuple[str, str, str]]:
    """Section, key and default of every row whose section its table names."""
    section = ""
    for line in PAGE.splitlines():
        if heading := re.match(r"#+ (\w+)", line):
            section = heading[1] if heading[1] in SECTIONS else ""
        cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
        if line.startswith("| key of"):
            section = re.findall(r"`\[(\w+)\]`", cells[0])[0]
        keys = re.findall(r"`(\w+)`", cells[0]) if line.startswith("| `") else []
        named = (
            cells[1] if len(cells) == 4 and cells[1] in ("planar", "helical") else section if len(cells) == 3 else ""
        )
        defaults = cells[-1].split(", ") if len(keys) > 1 else [cells[-1]]
        if named and len(keys) == len(defaults):
            yield from ((named, key, default) for key, default in zip(keys, defaults, strict=True))


@cache
def schema() -> dict[str, Any]:
    """JSON schema of a planetary set."""
    return every_section().model_json_schema()


def plain_default(section: str, key: str) -> str | None:
    """Write the default of a section as the page does; None where it is none, a table, or has a unit."""
    reference = re.findall(r"#/\$defs/(\w+)", str(schema()["properties"][section]))[0]
    entry = schema()["$defs"][reference]["properties"].get(key, {})
    value = entry.get("default")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value
    with_unit = "with its unit" in str(entry.get("description", ""))
    return f"{value:g}" if isinstance(value, int | float) and not with_unit else None


def has_default(cell: str, value: str) -> bool:
    """Whether a cell of the page holds a default, as a word or as a number."""
    numbers = re.findall(r"-?\d[\d.]*(?:e-?\d+)?", cell)
    words = {*re.findall(r"\w+", cell), *cell.split('"')}
    return value in words or any(f"{float(number):g}" == value for number in numbers)


def test_the_page_prints_the_defaults_of_the_sections():
    rows = [(*row, value) for row in printed_defaults() if (value := plain_default(*row[:2])) is not None]
    assert len(rows) > 35
    assert {section for section, *_ in rows} >= {"rack", "strength", "static", "dynamics", "planar", "helical"}
    assert [row for row in rows if not has_default(row[2], row[3])] == []
