#!/usr/bin/env python3
"""Write docs/errors.md: every error code, what it means, the refusals that carry it, and all warnings.

Meanings are those of `femgear.errors.CODES`; messages, limits and remedies are read from the source::

    python validation/tools/error_page.py -o docs/errors.md
"""

from __future__ import annotations

import argparse
import ast
import gc
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from femgear.findings import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"\b[EW]-[A-Z]|Error\b")
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

| code | severity | meaning | what to do where it names nothing else |
|---|---|---|---|
{meanings}

| code | entry | message | remedy |
|---|---|---|---|"""


class Source:
    """A file of the package: its syntax tree with its functions and calls, the outer ones first."""

    def __init__(self, path: Path):
        text = path.read_text(encoding="utf-8")
        self.path, self.tree = path, ast.parse(text)
        self.functions, self.calls, self.texts = [], [], []
        of = {ast.FunctionDef: self.functions, ast.Call: self.calls, ast.Constant: self.texts}
        for node in ast.walk(self.tree):
            if (nodes := of.get(type(node))) is not None:
                nodes.append(node)

    def calls_in(self, function: ast.FunctionDef) -> list[ast.Call]:
        """Calls between the first and the last line of a function."""
        return [call for call in self.calls if _holds(function, call)]


@cache
def sources(folder: Path) -> tuple[Source, ...]:
    """Files of a folder that name an error or a warning, in the order of their names."""
    named = (path for path in sorted(folder.rglob("*.py")) if NAMED.search(path.read_text(encoding="utf-8")))
    return tuple(map(Source, named))


def refusals(folder: Path = ROOT / "femgear") -> dict[str, list[tuple[str, str, str]]]:
    """Messages, limits and remedies of all refusals by their code, in the order of the source."""
    by_code = defaultdict(list)
    for source in sources(folder):
        for call in source.calls:
            words = {word.arg: word.value for word in call.keywords if word.arg}
            parts = [call.args[0] if call.args else None, words.get("limit"), words.get("remedy")]
            for code in _codes(words.get("code")):
                within = [function for function in source.functions if _holds(function, call)]
                values = [_values(part, call, within[-1] if within else source.tree) for part in parts]
                for cells in zip(*(column * (len(max(values, key=len)) // len(column)) for column in values)):
                    entry = tuple(_text(cell) for cell in cells)
                    if entry not in by_code[code]:
                        by_code[code].append(entry)
    return dict(by_code)


def _holds(function: ast.FunctionDef, call: ast.Call) -> bool:
    return function.lineno <= call.lineno <= (function.end_lineno or 0)


def _values(node: ast.expr | None, use: ast.Call, scope: ast.AST) -> Sequence[ast.expr | None]:
    """Values that a name has from the statements last before its use, alone or as one of several names."""
    if not isinstance(node, ast.Name):
        return [node]
    for statement in _before(scope, use):
        if values := [value for name, value in _assignments(statement) if name == node.id]:
            return values
    return [node]


@cache
def _assignments(statement: ast.stmt) -> list[tuple[str, ast.expr]]:
    """Names and values of all assignments within a statement, in the order of the source."""
    calls = []
    for part in ast.walk(statement):
        if isinstance(part, ast.Assign):
            target, value = part.targets[0], part.value
            both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            pairs = zip(target.elts, value.elts) if both else [(target, value)]
            calls += [(part.lineno, _name(t), v) for t, v in pairs]
    return [(name, value) for _, name, value in sorted(calls, key=lambda entry: entry[0])]


def _before(scope: ast.AST, use: ast.Call) -> Iterator[ast.stmt]:
    """Statements before a call, from the last one of its own block to the first one of the function."""
    for block in (getattr(scope, name, None) for name in ("body", "orelse", "finalbody", "handlers")):
        for i, statement in enumerate(block if isinstance(block, list) else ()):
            if statement.lineno <= use.lineno <= (statement.end_lineno or 0):
                yield from _before(statement, use)
                yield from reversed(block[:i])


def warnings(folder: Path = ROOT / "femgear") -> list[tuple[str, str, str, str]]:
    """Codes, entries of the case, messages and remedies of all warnings, by code."""
    texts = set()
    for source in sources(folder):
        for function in source.functions:
            for call in source.calls_in(function):
                if call.args and _name(call.func) == "Finding" and _text(call.args[0])[:2] == "W-":
                    remedy = next((word.value for word in call.keywords if word.arg == "remedy"), None)
                    cells = [*call.args[:3], call.args[3] if len(call.args) > 3 else remedy]
                    texts.add(tuple(_text(_assigned(cell, call, function)) for cell in cells))
    return sorted(texts)


def _assigned(node: ast.expr | None, use: ast.Call, function: ast.FunctionDef) -> ast.expr | None:
    """Value that a name has had in a function before its use."""
    if not isinstance(node, ast.Name):
        return node
    values = [
        assignment
        for assignment in ast.walk(function)
        if isinstance(assignment, ast.Assign)
        and ast.unparse(assignment.targets[0]) == node.id
        and assignment.lineno < use.lineno
    ]
    return max(values, key=lambda assignment: assignment.lineno).value if values else node


def named_codes(folder: Path = ROOT / "femgear") -> set[str]:
    """Codes that stand in the source as texts, docstrings left out."""
    named = (source for source in sources(folder) if source.path.name != "errors.py")
    values = {str(node.value) for source in named for node in source.texts}
    return {value for value in values if CODE.fullmatch(value)}


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else ""


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
    by_code, parts = refusals(), [HEAD]
    for code in sorted(meanings):
        parts.append(f"## {code}\n\n{meanings[code]}\n")
        rows = [row for row in by_code.get(code, []) if row[0].strip("… :")]
        if rows:
            cells = (" | ".join(_cell(text) for text in row) for row in rows)
            table = "\n".join(f"| {row} |" for row in cells)
            parts.append(f"| message | allowed | remedy |\n|---|---|---|\n{table}\n")
    rows = "\n".join(f"| {' | '.join(map(_cell, row))} |" for row in warnings())
    warning_rows = "\n".join(
        f"| {code} | {meaning.severity} | {_cell(meaning.sentence)} | {_cell(meaning.advice)} |"
        for code, meaning in CATALOGUE.items()
    )
    return "\n".join([*parts, f"{WARNINGS.format(meanings=warning_rows)}\n{rows}\n"])


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split()).replace("<", "&lt;")


def main() -> None:
    """Write the page."""
    from femgear.errors import CODES

    # nothing of the trees goes before the end
    gc.disable()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.parse_args().output.write_text(page(CODES), encoding="utf-8")


if __name__ == "__main__":
    main()
