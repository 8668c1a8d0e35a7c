"""What docstrings must hold: every field of a dataclass by its name, and shapes of arrays."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "femgear"


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def statements(block: ast.AST) -> Iterator[ast.stmt]:
    """All statements within a module or another one, the expressions aside."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for statement in getattr(block, name, ()):
            yield statement
            yield from statements(statement)


@cache
def dataclasses(path: Path) -> list[ast.ClassDef]:
    """All dataclasses of a module, public and private, wherever they stand."""
    classes = [node for node in statements(tree(path)) if isinstance(node, ast.ClassDef)]
    return [node for node in classes if any("dataclass" in ast.unparse(one) for one in node.decorator_list)]


def fields(node: ast.ClassDef) -> list[str]:
    """Names of the annotated fields of a class, without its constants and the mark of keywords."""
    annotated = [one for one in node.body if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name)]
    return [one.target.id for one in annotated if not re.search("ClassVar|KW_ONLY", ast.unparse(one.annotation))]


def named(docstring: str) -> set[str]:
    """Names in a docstring: between backticks, or before the colon of an entry."""
    quoted = " ".join(re.findall(r"``?([^`]+)``?", docstring))
    entries = " ".join(re.findall(r"^((?:\w+, )*\w+)(?: : |$)", docstring, re.MULTILINE))
    return set(re.findall(r"\w+", f"{quoted} {entries}"))


def test_every_field_of_a_dataclass_stands_in_its_docstring():
    count, missing = 0, []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in dataclasses(path):
            names = named(ast.get_docstring(node) or "")
            count += len(fields(node))
            missing += [f"{path.relative_to(PACKAGE)}: {node.name}.{one}" for one in fields(node) if one not in names]
    assert count > 1500  # the walk found them
    assert missing == []


ARRAYS = re.compile(r"ndarray|NDArray")
SHAPE = re.compile(r"\((?:\.\.\.|.*,.*|\d+)\)|shape")
"""A shape in brackets, or words that say where shapes stand."""


def public_functions(path: Path) -> list[tuple[str, ast.FunctionDef]]:
    """All functions of a module, and all methods of its classes, that have no private name."""
    body = tree(path).body
    functions = [(node.name, node) for node in body if isinstance(node, ast.FunctionDef)]
    for owner in (node for node in body if isinstance(node, ast.ClassDef) and not node.name.startswith("_")):
        functions += [(f"{owner.name}.{node.name}", node) for node in owner.body if isinstance(node, ast.FunctionDef)]
    return [(name, node) for name, node in functions if not node.name.startswith("_")]


def described_functions() -> Iterator[tuple[str, str, list[str]]]:
    """Walk over all public functions with a docstring: names, docstrings, annotations of what goes in and out."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for name, node in public_functions(path):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            kinds = [*(argument.annotation for argument in arguments), node.returns]
            if (docstring := ast.get_docstring(node)) is not None:
                annotations = [ast.unparse(kind) for kind in kinds if kind is not None]
                yield f"{path.relative_to(PACKAGE)}: {name}", docstring, annotations


def test_public_functions_of_arrays_tell_a_shape():
    """Those without a docstring are described by their protocol or base class."""
    count, without = 0, []
    for name, docstring, kinds in described_functions():
        if any(map(ARRAYS.search, kinds)):
            count += 1
            if not SHAPE.search(docstring):
                without.append(name)
    assert count > 700  # the walk found them
    assert without == []


ARRAY = re.compile(r"(?:np\.ndarray|NDArray(?:\[.*\])?|Vector)(?: \| None)?")
"""Annotation of an array alone, not of a tuple or mapping of some."""
SHARED = re.compile(r"(?m)^((?:\w+, )*\w+)(?: : |\n    )(?=.*(?:\(|[Aa]s |see))")
"""Names of parameters that have one entry, and with it one shape."""


def test_public_functions_tell_as_many_shapes_as_they_have_arrays():
    """Of parameters and what is returned; a reference to another docstring counts as a shape."""
    count, without = 0, []
    for name, docstring, kinds in described_functions():
        arrays = sum(bool(ARRAY.fullmatch(kind)) for kind in kinds)
        if not arrays or "All arrays are (" in docstring:
            continue
        count += 1
        shapes = re.findall(
            r"\((?:\.\.\.|[^()]*,[^()]*|\d+)\)|\((?=\d+ \()|shape|\b[Aa]s (?:of |those of )?`|see `", docstring
        )
        shared = sum(names.count(",") for names in SHARED.findall(docstring))
        if len(shapes) + shared < arrays:
            without.append(name)
    assert count > 700  # the walk found them
    assert without == []


def words_on(name: str, docstring: str) -> str:
    """Entry of a name in a docstring, and the sentences that hold it between backticks."""
    entries = re.findall(r"(?m)^((?:\w+, )*\w+)(?: : |\n(?=    ))(.*(?:\n    .*)*)", docstring)
    entry = [text for names, text in entries if name in names.split(", ")]
    sentences = re.split(r"(?<=[.;:])\s", " ".join(docstring.split()))
    return " ".join(entry + [sentence for sentence in sentences if f"`{name}`" in sentence])


def test_arrays_of_public_dataclasses_tell_their_own_shape():
    """In their entry or sentence, or by naming what they are shaped as."""
    shaped = re.compile(SHAPE.pattern + "|(?:[Aa]s|see|of|for) `")
    count, without = 0, []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in dataclasses(path):
            arrays = [
                one.target.id
                for one in node.body
                if isinstance(one, ast.AnnAssign) and re.match(r"np\.ndarray|NDArray", ast.unparse(one.annotation))
            ]
            if node.name.startswith("_"):
                continue
            docstring = ast.get_docstring(node) or ""
            count += len(arrays)
            names = [name for name in arrays if not shaped.search(words_on(name, docstring))]
            without += [f"{path.relative_to(PACKAGE)}: {node.name}.{name}" for name in names]
    assert count > 700  # the walk found them
    assert without == []
