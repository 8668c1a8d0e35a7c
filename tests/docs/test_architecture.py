"""Tables of types: docs/architecture.md has those of the chain, docs/two_way.md what exists in the code."""

import ast
import dataclasses
import importlib
import pkgutil
import re
from pathlib import Path
from pkgutil import resolve_name

import pytest

import femgear.housing.two_way as package

DOCS = Path(__file__).resolve().parents[2] / "docs"
TYPES = re.findall(
    r"(?m)^### (\w+)\n[^#]*?^```\{fields\} (femgear[\w.]+)\n```$",
    (DOCS / "architecture.md").read_text(encoding="utf-8"),
)


def test_the_types_are_those_of_the_chain():
    names = [name for name, _ in TYPES]
    assert names == ["MeshCycle", "LoadedPeriod", "MeshExcitation", "Modes", "Response", "SensorLines"]
    assert [resolve_name(path).__name__ for _, path in TYPES] == names


@pytest.mark.parametrize("path", [path for _, path in TYPES])
def test_a_docstring_has_an_entry_with_a_shape_for_every_field(path):
    kind = resolve_name(path)
    entries = re.findall(r"(?m)^    (\w[\w, ]*?) : ", kind.__doc__.split("Parameters\n    ----------\n")[1])
    named = [name for entry in entries for name in entry.split(", ")]
    assert sorted(named) == sorted(field.name for field in dataclasses.fields(kind))


def test_the_notation_names_what_the_code_has():
    modules = [importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)]
    known = {name: value for module in modules for name, value in vars(module).items()}
    rows = re.findall(r"(?m)^\|.*\| ([^|]+) \|$", (DOCS / "two_way.md").read_text(encoding="utf-8"))
    names = {name for cell in rows for name in re.findall(r"`([\w.]+)`", cell)}
    assert len(names) > 25
    for name in sorted(names):
        kind, _, field = name.partition(".")
        assert kind in known, name
        fields = {*vars(known[kind]), *getattr(known[kind], "__dataclass_fields__", {})}
        assert not field or field in fields, name


def test_every_folder_says_what_it_holds():
    """The page lists the first lines of the docstrings of all packages."""
    for path in (DOCS.parent / "femgear").rglob("__init__.py"):
        words = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        assert len(words.split("\n")[0].split()) >= 4, path
