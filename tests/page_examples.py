"""Examples on the pages of docs, and what they print when they are run."""

import contextlib
import io
import re
from collections.abc import Collection
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def read_page(name: str) -> tuple[str, list[str], list[str]]:
    """Text of a page, its examples in Python and what it says that they print."""
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    flags = re.MULTILINE | re.DOTALL
    blocks = (re.findall(rf"^```{kind}\n(.*?)^```", text, flags) for kind in ("python", "text"))
    return text, *blocks


def run_examples(name: str, examples: list[str]) -> list[str]:
    """What the examples print, run one after the other as on the page."""
    names, found = {"__name__": "__main__"}, []
    for number, example in enumerate(examples):
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            exec(compile(example, f"docs/{name}, example {number + 1}", "exec"), names)
        found.append(output.getvalue())
    return found


def documented_variables(heading: str) -> dict[str, tuple[str, str]]:
    """Dimensions and unit of every variable in the table under a heading of docs/results.md."""
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    section = text.split(heading + "\n")[1].split("\n#")[0]
    rows = re.findall(r"^\|([^|]*)\|([^|]*)\|([^|]*)\|", section, flags=re.MULTILINE)[2:]
    return {v: (d.strip(), u.strip()) for cell, d, u in rows for v in re.findall(r"`(\w+)`", cell)}


def check_documented(data, heading: str, *, others: Collection[str] = ()) -> None:
    """Assert that the page names the variables of a dataset, and others, with dimensions and units."""
    table = documented_variables(heading)
    assert set(data.data_vars) | set(others) == table.keys()
    for name, variable in data.data_vars.items():
        assert table[name][0] == ", ".join(variable.dims), name
        assert (table[name][1] or "1") == variable.attrs["units"] and variable.attrs["long_name"]


def undocumented_keys(page: str, schema: dict) -> set[str]:
    """Keys of a case file that no first column of the tables on its page names."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8").split("## Case file")[1]
    keys = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\|([^|]*)\|", text, flags=re.MULTILINE))))
    return {k for part in (schema, *schema["$defs"].values()) for k in part.get("properties", {})} - keys
