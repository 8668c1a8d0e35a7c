#!/usr/bin/env python3
"""Write docs/errors.md: every error code, what it means, the refusals that carry it, and all warnings.

Meanings are those of `femgear.errors.CODES`; messages, limits and remedies are read from the source::

    python validation/tools/error_page.py -o docs/errors.md
"""

from __future__ import annotations

import argparse
import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from femgear.findings import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]
CODE = re.compile(r"E-[A-Z0-9]+(?:-[A-Z0-9]+)*")
HEAD = """# Errors

Every refusal names the file and the key where there are any, the value found, what is allowed and what to do.
Its code is stable: scripts may test the `code` of a `femgear.errors.FemgearError`. Exit codes of the command
line are 2 for input that cannot be used, 3 for computations without trustworthy result, 4 for results that
cannot be written or read, 5 for libraries, packages with trains and schedulers of clusters that fail.

Below are all codes with the messages that carry them; `…` stands for numbers and names. Warnings, which end
nothing, follow [at the end](#warnings). This page is written by
`python validation/tools/error_page.py -o docs/errors.md`.
"""
WARNINGS = """## Warnings

What a case or a result deserves to be doubted for: one list, on standard error, in the terminal, on the page
and in the results (`open_results(OUT).findings`); `femgear check` tells those that the case alone decides. It
ends no run: the exit code stays 0. Severities: `note`, worth knowing; `doubt`, a number may be wrong;
`fault`, nothing real carries that. Those below are the usual ones; a finding may have another.

| code | severity | meaning |
|---|---|---|
{meanings}

| code | entry | message | remedy |
|---|---|---|---|"""


def refusals(folder: Path = ROOT / "femgear") -> dict[str, list[tuple[str, str, str]]]:
    """Messages, limits and remedies of all refusals by their code, in the order of the source."""
    found = defaultdict(list)
    for path in sorted(folder.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            words = {word.arg: word.value for word in call.keywords if word.arg}
            told = [call.args[0] if call.args else None, words.get("limit"), words.get("remedy")]
            for code in _codes(words.get("code")):
                within = [f for f in functions if f.lineno <= call.lineno <= (f.end_lineno or 0)]
                values = [_values(one, call, within[-1] if within else tree) for one in told]
                for cells in zip(*(one * (len(max(values, key=len)) // len(one)) for one in values)):
                    entry = tuple(_text(cell) for cell in cells)
                    if entry not in found[code]:
                        found[code].append(entry)
    return dict(found)


def _values(node: ast.expr | None, use: ast.Call, scope: ast.AST) -> list[ast.expr | None]:
    """Values that a name has from the statements last before its use, alone or as one of several names."""
    if not isinstance(node, ast.Name):
        return [node]
    for statement in _before(scope, use):
        found = []
        for one in ast.walk(statement):
            if isinstance(one, ast.Assign):
                target, value = one.targets[0], one.value
                both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
                pairs = zip(target.elts, value.elts) if both else [(target, value)]
                found += [(one.lineno, v) for t, v in pairs if ast.unparse(t) == node.id]
        if found:
            return [value for _, value in sorted(found, key=lambda pair: pair[0])]
    return [node]


def _before(scope: ast.AST, use: ast.Call) -> Iterator[ast.stmt]:
    """Statements before a call, from the last one of its own block to the first one of the function."""
    for block in (getattr(scope, name, None) for name in ("body", "orelse", "finalbody", "handlers")):
        for i, statement in enumerate(block if isinstance(block, list) else ()):
            if statement.lineno <= use.lineno <= (statement.end_lineno or 0):
                yield from _before(statement, use)
                yield from reversed(block[:i])


def warnings(folder: Path = ROOT / "femgear") -> list[tuple[str, str, str, str]]:
    """Codes, entries of the case, messages and remedies of all warnings, by code."""
    found = set()
    for path in folder.rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
                for call in calls:
                    if call.args and ast.unparse(call.func) == "Finding" and _text(call.args[0])[:2] == "W-":
                        remedy = next((word.value for word in call.keywords if word.arg == "remedy"), None)
                        cells = [*call.args[:3], call.args[3] if len(call.args) > 3 else remedy]
                        found.add(tuple(_text(_assigned(cell, call, function)) for cell in cells))
    return sorted(found)


def _assigned(node: ast.expr | None, use: ast.Call, function: ast.FunctionDef) -> ast.expr | None:
    """Value that a name has had in a function before its use."""
    if not isinstance(node, ast.Name):
        return node
    values = [
        one
        for one in ast.walk(function)
        if isinstance(one, ast.Assign) and ast.unparse(one.targets[0]) == node.id and one.lineno < use.lineno
    ]
    return max(values, key=lambda one: one.lineno).value if values else node


def named_codes(folder: Path = ROOT / "femgear") -> set[str]:
    """Codes that stand in the source as texts, docstrings left out."""
    found = set()
    for path in folder.rglob("*.py"):
        if path.name != "errors.py":
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Constant) and CODE.fullmatch(str(node.value)):
                    found.add(node.value)
    return found


def _codes(node: ast.expr | None) -> set[str]:
    """Codes in an expression: of a condition both."""
    texts = {n.value for n in ast.walk(node) if isinstance(n, ast.Constant)} if node else set()
    return {text for text in texts if isinstance(text, str) and CODE.fullmatch(text)}


def _text(node: ast.expr | None) -> str:
    """Text of an expression, with an ellipsis for what is only known when it runs."""
    if node is None:
        return ""
    if isinstance(node, ast.Constant):
        return str(node.value) if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join("…" if isinstance(part, ast.FormattedValue) else part.value for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _text(node.left) + _text(node.right)
    if isinstance(node, ast.Tuple):
        return ", or ".join(map(_text, node.elts))
    if isinstance(node, ast.IfExp):
        return " / ".join(text for text in (_text(node.body), _text(node.orelse)) if text)
    return "…"


def page(meanings: dict[str, str]) -> str:
    """Text of docs/errors.md."""
    found, parts = refusals(), [HEAD]
    for code in sorted(meanings):
        parts.append(f"## {code}\n\n{meanings[code]}\n")
        rows = [row for row in found.get(code, []) if row[0].strip("… :")]
        if rows:
            cells = (" | ".join(_cell(text) for text in row) for row in rows)
            table = "\n".join(f"| {row} |" for row in cells)
            parts.append(f"| message | allowed | remedy |\n|---|---|---|\n{table}\n")
    rows = "\n".join(f"| {' | '.join(map(_cell, row))} |" for row in warnings())
    known = "\n".join(f"| {code} | {severity} | {_cell(text)} |" for code, (severity, text) in CATALOGUE.items())
    return "\n".join([*parts, f"{WARNINGS.format(meanings=known)}\n{rows}\n"])


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split()).replace("<", "&lt;")


def main() -> None:
    """Write the page."""
    from femgear.errors import CODES

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.parse_args().output.write_text(page(CODES), encoding="utf-8")


if __name__ == "__main__":
    main()
