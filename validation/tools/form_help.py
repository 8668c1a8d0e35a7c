"""Write femgear/app/help.json, what the form of the app says of entries.

From the tables of docs/case_file.md, and for entries of a gearbox from its table of keys in docs/gearbox.md.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Container, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from validation.tools.gearbox_keys import meanings_on  # noqa: E402  of this checkout

SOURCE, TARGET = ROOT / "docs" / "case_file.md", ROOT / "femgear" / "app" / "help.json"
GEARBOX = ROOT / "docs" / "gearbox.md"
_LISTS = {"modifications": "modifications", "errors": "errors", "load": "load_case"}
"""Entries whose tables have a heading of their own, by the first word of that."""


def help_texts(text: str) -> Iterator[tuple[str, str]]:
    """Read names of entries, with their tables where a heading names these, and what is said of them."""
    tables: list[str] = []
    header: list[str] = []
    for line in text.splitlines():
        if heading := re.match(r"#+ ([^:]+)", line):
            names = [name.strip() for name in heading[1].split(",")]
            first = names[0].split()[0].lower()
            tables = [_LISTS[first]] if first in _LISTS else [n for n in names if re.fullmatch(r"[a-z_0-9]+", n)]
        elif line.startswith("|"):
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
            if cells[0].split(" ")[0] == "key":
                header, of = cells, re.findall(r"`\[(\w+)\]`", cells[0])
                tables = of or tables
            elif header and not set(cells[0]) <= set("-: "):
                choices = plain(cells[header.index("value")]) if "value" in header else ""
                default = plain(cells[header.index("default")]) if "default" in header else ""
                words = f"{choices}{'. Default: ' if choices and default else 'Default: ' if default else ''}{default}"
                within = cells[header.index("of")] if "of" in header else "all"
                for name in re.findall(r"`([a-z_0-9.]+)`", cells[0]) if words else ():
                    for table in tables or [""]:
                        if (table in within) != within.startswith("all"):
                            yield f"{table}.{name}".lstrip("."), words
        else:
            header = header if line.strip() else []


def gearbox_texts(text: str, written: Container[str]) -> Iterator[tuple[str, str]]:
    """Read what the tables of keys say of entries of a gearbox, but for those that are ``known`` by their last names.

    Names have three parts at most, as many as the form looks for.
    """
    for (path, key), meaning in meanings_on(text).items():
        parts = f"{path}.{key}".split(".")
        if path and ".".join(parts[-2:]) not in written:
            yield ".".join(parts[-3:]), plain(meaning)


def plain(cell: str) -> str:
    """Take the marks of Markdown out of a cell."""
    text = re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", cell)
    return re.sub(r"\s+", " ", text.replace("`", "").replace("\\|", "|").replace("**", "")).strip()


def main() -> None:
    """Write the file."""
    texts = dict(sorted(help_texts(SOURCE.read_text("utf-8")), reverse=True))
    texts |= dict(gearbox_texts(GEARBOX.read_text("utf-8"), texts))
    TARGET.write_text(json.dumps(dict(sorted(texts.items())), ensure_ascii=False, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
