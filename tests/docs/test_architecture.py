"""Tables of types: docs/architecture.md names every field of the types, docs/two_way.md what exists in the code."""

import dataclasses
import importlib
import pkgutil
import re
from pathlib import Path
from pkgutil import resolve_name

import pytest

import femgear.housing.two_way as package

DOCS = Path(__file__).resolve().parents[2] / "docs"
SECTIONS = re.findall(
    r"(?ms)^### (\w+)\n\n`(femgear[\w.]+)`(.*?)(?=^##)", (DOCS / "architecture.md").read_text(encoding="utf-8")
)


def test_the_types_are_those_of_the_chain():
    names = [name for name, _, _ in SECTIONS]
    assert names == ["MeshCycle", "LoadedPeriod", "MeshExcitation", "Modes", "Response", "SensorLines"]


@pytest.mark.parametrize(("name", "path", "text"), SECTIONS, ids=[section[0] for section in SECTIONS])
def test_a_table_names_every_field(name, path, text):
    kind = resolve_name(path)
    fields = {field.name for field in dataclasses.fields(kind)}
    cells = re.findall(r"(?m)^\| (`[^|]*) \|", text)
    named = [word for cell in cells for word in re.findall(r"`(\w+)`", cell.split(" (")[0])]
    assert kind.__name__ == name and sorted(named) == sorted(fields)


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
