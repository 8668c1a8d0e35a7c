"""Examples on the pages of docs, and what they print when they are run."""

import contextlib
import io
import re
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
