"""Mutants of a module: what one changed operator, number or call makes of it."""

from __future__ import annotations

import ast
import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
CORE = (
    "gears/profile gears/gear gears/tooth gears/planetary gears/phasing contact fe/compliance fe/reduction "
    "fe/elasticity system solvers/periodic solvers/stability solvers/time solvers/linear housing storage "
    "case/quantities case/text"
).split()
OPPOSITE = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
EDGE = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
EXTREME = {"min": "max", "minimum": "maximum", "argmin": "argmax", "fmin": "fmax", "any": "all"}
EXTREME |= {value: key for key, value in EXTREME.items()}
DROPPED = {"abs", "absolute", "fabs", "conj", "conjugate"}
# smaller numbers are tolerances: twice of them is as good
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Mutant:
    """One changed expression: `number` counts all that a module has."""

    module: str
    number: int
    kind: str
    line: int
    lines: tuple[int, int]
    function: str
    before: str
    after: str

    @property
    def place(self) -> str:
        return f"{self.module}:{self.line}"

    @property
    def name(self) -> tuple[str, str, str, str]:
        """What it is called wherever its line may go."""
        return self.module, self.function, self.before, self.after

    @property
    def change(self) -> str:
        return f"{self.before}  ->  {self.after}"


def replacements(node: Any, place: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Kinds and replacements of one node.

    `place` is "index" within brackets, "axis" for that argument, "size" for those of ``reshape``.
    """
    match node:
        case ast.UnaryOp(ast.USub(), ast.Constant(1)) if place == "size":
            return  # any negative length of an array is inferred
        case ast.BinOp(left, op, right) if type(op) in OPPOSITE and not (_is_text(left) or _is_text(right)):
            sign = isinstance(op, ast.Add | ast.Sub)
            yield "sign" if sign else "factor", ast.BinOp(left, OPPOSITE[type(op)](), right)
        case ast.AugAssign(target, op, value) if type(op) in OPPOSITE and not _is_text(value):
            sign = isinstance(op, ast.Add | ast.Sub)
            yield "sign" if sign else "factor", ast.AugAssign(target, OPPOSITE[type(op)](), value)
        case ast.UnaryOp(ast.USub(), operand) if not place:
            yield "sign", operand
        case ast.UnaryOp(ast.USub(), ast.Constant(int(value))):
            yield (
                place,
                ast.Constant(0) if place == "axis" else ast.UnaryOp(ast.USub(), ast.Constant(value + 1)),
            )
        case ast.UnaryOp(ast.Not(), operand):
            yield "logic", operand
        case ast.Constant(bool() | str() | bytes()):
            return
        case ast.Constant(int(value)) if place:
            yield place, ast.Constant(int(not value) if place == "axis" else value + 1)
        case ast.Constant(int() | float() | complex() as value) if abs(value) > TOLERANCE or value == 0:
            yield "constant", ast.Constant(value + 1 if value in (0, 1) else 2 * value)
        case ast.Compare(left, [op], [right]):
            yield "comparison", ast.Compare(left, [OPPOSITE[type(op)]()], [right])
            if type(op) in EDGE and any(_is_integer(compared) for compared in (left, right)):
                yield "comparison", ast.Compare(left, [EDGE[type(op)]()], [right])
        case ast.Compare(left, ops, right):
            for i, op in enumerate(ops):
                yield "comparison", ast.Compare(left, [*ops[:i], OPPOSITE[type(op)](), *ops[i + 1 :]], right)
        case ast.BoolOp(op, values):
            yield "logic", ast.BoolOp(OPPOSITE[type(op)](), values)
        case ast.IfExp(test, body, orelse):
            yield "branch", ast.IfExp(test, orelse, body)
        case ast.Raise():
            yield "raise", ast.Pass()
        case ast.Call():
            yield from _calls(node)


def _calls(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    func, args = node.func, node.args
    name = getattr(func, "attr", getattr(func, "id", ""))
    if name in EXTREME:
        other = ast.Name(EXTREME[name], ast.Load())
        if isinstance(func, ast.Attribute):
            other = ast.Attribute(func.value, EXTREME[name], ast.Load())
        yield "extreme", ast.Call(other, args, node.keywords)
    elif name in DROPPED and args:
        yield "dropped", args[0]
    elif name in DROPPED and isinstance(func, ast.Attribute):
        yield "dropped", func.value
    elif name == "where" and len(args) == 3:
        yield "branch", ast.Call(func, [args[0], args[2], args[1]], node.keywords)


def _is_text(node: ast.AST) -> bool:
    """Whether the operand is text or a list: nothing to calculate with."""
    return isinstance(node, ast.JoinedStr | ast.List | ast.Tuple) or isinstance(getattr(node, "value", None), str)


def _is_integer(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) is int


@dataclass(frozen=True)
class _Site:
    """Where a replacement goes: attribute `field` of `parent`, at `position` if that is a list."""

    parent: ast.AST
    field: str
    position: int | None
    node: Any
    kind: str
    new: ast.AST
    statement: ast.stmt
    function: str


# what a message says, what a type is, and what decorates a function is no arithmetic
LEFT_OUT = {
    ("arg", "annotation"),
    ("AnnAssign", "annotation"),
    ("FunctionDef", "returns"),
    ("FunctionDef", "decorator_list"),
    ("ClassDef", "decorator_list"),
    ("ClassDef", "bases"),
}


def sites(tree: ast.Module) -> Iterator[_Site]:
    """All replacements of a module, in the order of its source."""
    yield from _below(tree, "", None, "")


def _below(parent: ast.AST, function: str, statement: ast.stmt | None, place: str) -> Iterator[_Site]:
    for field, value in ast.iter_fields(parent):
        if (type(parent).__name__, field) in LEFT_OUT:
            continue
        for position, node in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if not isinstance(node, ast.AST) or isinstance(node, ast.JoinedStr | ast.Assert):
                continue
            within = node if isinstance(node, ast.stmt) else statement
            where = _place(parent, field, place)
            if within is not None:
                for kind, new in replacements(node, where):
                    new = ast.fix_missing_locations(ast.copy_location(new, node))
                    yield _Site(parent, field, position, node, kind, new, within, function)
            named = isinstance(node, ast.FunctionDef | ast.ClassDef)
            inner = ".".join(filter(None, (function, node.name))) if named else function
            if isinstance(node, ast.Raise) or inner.endswith("__repr__"):
                continue
            # the number beneath a minus in brackets was changed with it
            if not (where and isinstance(node, ast.UnaryOp)):
                yield from _below(node, inner, within, where)


def _place(parent: ast.AST, field: str, place: str) -> str:
    if isinstance(parent, ast.Subscript) and field == "slice":
        return "index"
    if isinstance(parent, ast.keyword) and parent.arg == "axis":
        return "axis"
    if isinstance(parent, ast.Call) and field == "args" and getattr(parent.func, "attr", "") == "reshape":
        return "size"
    return place if isinstance(parent, ast.Tuple | ast.Slice) else ""


def mutants(module: str, source: str) -> list[Mutant]:
    """All mutants of a module, at most two of a kind on a line."""
    drawn_sites, seen = [], defaultdict(int)
    for number, site in enumerate(sites(ast.parse(source))):
        line = site.node.lineno
        seen[line, site.kind] += 1
        if seen[line, site.kind] <= 2:
            before, after = (" ".join(ast.unparse(tree).split()) for tree in (site.node, site.new))
            lines = (site.statement.lineno, site.node.end_lineno)
            drawn_sites.append(Mutant(module, number, site.kind, line, lines, site.function, before, after))
    return drawn_sites


def mutated(source: str, number: int) -> ast.Module:
    """The module with one expression changed."""
    tree = ast.parse(source)
    site = next(islice(sites(tree), number, None))
    if site.position is None:
        setattr(site.parent, site.field, site.new)
    else:
        getattr(site.parent, site.field)[site.position] = site.new
    return tree


def drawn(mutants_of_module: Sequence[Mutant], count: int, seed: int) -> list[Mutant]:
    """The first mutants of a random order, a third of them signs: more of them begin with the same ones."""
    module = mutants_of_module[0].module if mutants_of_module else ""
    order = sorted(mutants_of_module, key=lambda mutant: mutant.number)
    random.Random(f"{seed} {module}").shuffle(order)
    signs = [mutant for mutant in order if mutant.kind == "sign"]
    others = [mutant for mutant in order if mutant.kind != "sign"]
    picked = []
    while len(picked) < min(count, len(mutants_of_module)):
        picked += signs[:1] + others[:2]
        signs, others = signs[1:], others[2:]
    return picked[:count]


def modules(names: Sequence[str]) -> list[str]:
    """Modules of the package by names of files or folders, relative to it."""
    package, module_names = ROOT / "femgear", []
    for name in names:
        path = package / name.removesuffix(".py")
        below = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
        if not below or not below[0].exists():
            raise SystemExit(f"--modules {name}: femgear has no such module or folder")
        module_names += [str(module.relative_to(package)) for module in below if module.name != "__init__.py"]
    return list(dict.fromkeys(module_names))
