"""What a form shows of a case file: its tables and entries, from the JSON schema of its kind, and their sliders."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

Kind = Literal["quantity", "integer", "number", "choice", "switch", "text", "list", "other"]
STEPS = 200
"""Of a slider, at least."""
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_USUAL = (
    r"operation\.torque",
    r"operation\.speeds(\[\d+\])?",
    r"operation\.load_case\[0\]\.(torque|speed)\.?.*",
    r"\w+\.modifications\[\d+\]\.amount",
    r"set\.pin_errors\[\d+\]\.(radial|tangential)",
    r"\w+\.damping_ratio",
)
"""Keys of what is dragged most, in that order."""
_MOST = 6
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN: dict[str, Kind] = {"integer": "integer", "number": "number", "boolean": "switch", "string": "text"}


@dataclass(frozen=True)
class Entry:
    """An entry of a table.

    Parameters
    ----------
    name : str
    kind : str
        What it holds; of kind "other" it is written as in the file.
    choices : tuple of str
        Of kind "choice".
    hint : str
        What is allowed.
    default : object
        None where there is none.
    needed : bool
        Whether the table must have it.
    unit : str
        Of a quantity, in which it is shown.
    scale : float
        SI value of that unit.
    window : (float, float), optional
        Smallest and largest value that is plausible, in that unit.
    """

    name: str
    kind: Kind
    choices: tuple[str, ...] = ()
    hint: str = ""
    default: Any = None
    needed: bool = False
    unit: str = ""
    scale: float = 1.0
    window: tuple[float, float] | None = None


@dataclass(frozen=True)
class Table:
    """A table of a case file.

    Parameters
    ----------
    name : str
    hint : str
        What the table is.
    listed : bool
        Whether there may be several of it.
    needed : bool
        Whether the table above must have it.
    schema, definitions : mapping
        JSON schema of the table, and what it refers to.
    """

    name: str
    hint: str
    listed: bool
    needed: bool
    schema: Mapping[str, Any]
    definitions: Mapping[str, Any]

    @cached_property
    def parts(self) -> tuple[Entry | Table, ...]:
        """Entries and tables of it, in the order of the schema."""
        needed = self.schema.get("required", ())
        return tuple(
            _part(name, schema, name in needed, self.definitions)
            for name, schema in self.schema.get("properties", {}).items()
        )

    def part(self, name: str) -> Entry | Table | None:
        """Find an entry or table by its name, None where there is none."""
        return next((part for part in self.parts if part.name == name), None)


def table_of_schema(schema: Mapping[str, Any]) -> Table:
    """Read the JSON schema of a kind of case, as of `femgear.trains.reading.case_schema`."""
    return Table("", schema.get("description", ""), False, True, schema, schema.get("$defs", {}))


def _part(name: str, schema: Mapping[str, Any], needed: bool, definitions: Mapping[str, Any]) -> Entry | Table:
    """Read what a table says of one entry: a table, a list of tables, or a value."""
    forms = [form for form in schema.get("anyOf", [schema]) if form.get("type") != "null"]
    resolved = [_resolved(form, definitions) for form in forms]
    hint = schema.get("description", "")
    for form in resolved:
        if "properties" in form:
            return Table(name, hint or form.get("description", ""), False, needed, form, definitions)
        rows = _resolved(form.get("items", {}), definitions)
        if "properties" in rows:
            return Table(name, hint or rows.get("description", ""), True, needed, rows, definitions)
    return _entry(name, resolved, schema, needed)


def _resolved(schema: Any, definitions: Mapping[str, Any]) -> Mapping[str, Any]:
    """Follow a reference to a definition."""
    if not isinstance(schema, Mapping):
        return {}
    reference = schema.get("$ref")
    return definitions.get(reference.rpartition("/")[2], {}) if reference else schema


def _entry(name: str, forms: list[Mapping[str, Any]], schema: Mapping[str, Any], needed: bool) -> Entry:
    """Read what a value may be."""
    hints = [text for form in [schema, *forms] if (text := form.get("description"))]
    hint, default = "; ".join(dict.fromkeys(hints)), schema.get("default")
    words_of = (form.get("enum", [form["const"]] if "const" in form else ()) for form in forms)
    choices = tuple(str(word) for words in words_of for word in words)
    given = {"hint": hint, "default": default, "needed": needed}
    if len(forms) != 1:
        return Entry(name, "other", **given)
    (form,) = forms
    if choices and all(isinstance(word, str) for word in form.get("enum", [form.get("const")])):
        return Entry(name, "choice", choices, **given)
    if "x-unit" in form:
        low, high = form["x-window"]
        return Entry(name, "quantity", **given, unit=form["x-unit"], scale=form["x-scale"], window=(low, high))
    if form.get("type") == "array":
        return Entry(name, "list", **given)
    kind = _PLAIN.get(form.get("type", ""), "other") if isinstance(form.get("type"), str) else "other"
    bounds = form.get("minimum", form.get("exclusiveMinimum")), form.get("maximum", form.get("exclusiveMaximum"))
    window = None if None in bounds else (float(bounds[0]), float(bounds[1]))
    if window and not hint:
        given["hint"] = f"{window[0]:g} to {window[1]:g}"
    return Entry(name, kind, **given, window=window)


def shown_value(value: Any) -> str:
    """Write the value of an entry as a form shows it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list) and not any(isinstance(part, (list, dict)) for part in value):
        return ", ".join(map(shown_value, value))
    if isinstance(value, list):
        return f"[{', '.join(shown_inner(part) for part in value)}]"
    return shown_inner(value) if isinstance(value, dict) else str(value)


def shown_inner(value: Any) -> str:
    """Write a value within a list or table as TOML does."""
    if isinstance(value, dict):
        names = (key if _BARE.fullmatch(key) else shown_inner(key) for key in value)
        parts = (f"{name} = {shown_inner(part)}" for name, part in zip(names, value.values(), strict=True))
        return "{ " + ", ".join(parts) + " }"
    if isinstance(value, list):
        return f"[{', '.join(map(shown_inner, value))}]"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    return shown_value(value)


def shape_of(value: Any) -> Any:
    """Tables, lists of tables and names of entries of a case file without their values: what its form consists of."""
    if isinstance(value, dict):
        return {name: shape_of(part) for name, part in value.items()}
    if isinstance(value, list) and any(isinstance(part, dict) for part in value):
        return [shape_of(part) for part in value]
    return None


def sentence_of(said: Mapping[str, str]) -> str:
    """Write in one line what is said of an entry: its text, what is allowed, a remedy and the code."""
    limit = f" (allowed: {said['limit']})" if said.get("limit") else ""
    remedy = f"; {said['remedy']}" if said.get("remedy") else ""
    code = f" [{said['code']}]" if said.get("code") else ""
    return f"{said['text']}{limit}{remedy}{code}"


_IN_WINDOW = {
    "casing": "“Gearbox › In a casing”",
    "gearbox": "“Gearbox › As a gearbox”",
    "run": "“Run”",
    "compare": "“Results › Compare”",
    "export": "“Results › Export”",
    "import": "“Import”",
    "new": "“New”",
}
"""What one does in the window in place of a command."""
_COMMAND = re.compile(rf"`?\bfemgear ({'|'.join(_IN_WINDOW)})\b(?: (?:CASE|FILE)\b)?`?(?! -)")

_WORDLESS = re.compile(r"(<(?:script|style|pre|code)\b.*?</(?:script|style|pre|code)>)", re.DOTALL)
"""What of a page is not read as words."""
_WORDS = re.compile(r">[^<]+<")


def in_window(said: Any) -> Any:
    """Name what one does in the window in place of commands, in a text or in all of those of a list or table."""
    if isinstance(said, str):
        return _COMMAND.sub(lambda match: _IN_WINDOW[match[1]], said)
    if isinstance(said, Mapping):
        return {name: in_window(part) for name, part in said.items()}
    return [in_window(part) for part in said] if isinstance(said, (list, tuple)) else said


def page_in_window(page: str) -> str:
    """Name what one does in the window in place of commands, in the words of a page but not in its scripts."""
    parts = _WORDLESS.split(page)
    return "".join(part if number % 2 else _WORDS.sub(_spoken, part) for number, part in enumerate(parts))


def _spoken(match: re.Match[str]) -> str:
    return in_window(match[0])


def typed_value(entry: Entry, text: str) -> Any:
    """Turn what was typed into a field into the value of the entry; None of an empty field.

    What cannot be read as its kind stays text, which the reader of the case refuses in its own words.
    """
    text = text.strip()
    if not text:
        return None
    if entry.kind in ("quantity", "text", "choice"):
        return text
    if entry.kind == "switch":
        return {"true": True, "false": False}.get(text, text)
    if entry.kind == "list":
        if text[0] in "[{":
            return _as_toml(text)
        return [_number(part.strip()) for part in text.split(",") if part.strip()]
    return _as_toml(text) if text[0] in "[{" else _number(text)


def _number(text: str) -> int | float | str:
    """Read a number, or leave the text as it is."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _as_toml(text: str) -> Any:
    """Read a list or table as the file writes it, or leave the text as it is."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):  # no TOML, or an integer of thousands of digits
        return text


Embedded = Callable[[Any], "Table | None"]
"""Gives the form of a case within a case, as the teeth of a stage; None of any other value."""


def keys_of(table: Table, tables: Any, key: str = "", embedded: Embedded = lambda value: None) -> Iterator[str]:
    """List the keys of all entries that a case file gives, by a form of its kind."""
    for name, value in tables.items() if isinstance(tables, dict) else ():
        inner, part = f"{key}.{name}".lstrip("."), table.part(name)
        if isinstance(part, Table) and part.listed and isinstance(value, list):
            for number, row in enumerate(value):
                yield from keys_of(part, row, f"{inner}[{number}]", embedded)
        elif isinstance(part, Table) or (part := embedded(value)) is not None:
            yield from keys_of(part, value, inner, embedded)
        else:
            yield inner


@dataclass(frozen=True)
class Slider:
    """A slider of an entry.

    Parameters
    ----------
    key : str
        Of the entry, or of one value of a list.
    value : float
        In the unit of the file.
    unit : str
        As the file writes it; empty of a pure number.
    low, high : float
        In that unit.
    whole : bool
        Whether only whole numbers are allowed.
    """

    key: str
    value: float
    unit: str
    low: float
    high: float
    whole: bool = False

    @property
    def step(self) -> float:
        """From one place to the next, a round number."""
        if self.whole:
            return 1.0
        largest = (self.high - self.low) / STEPS
        power = math.floor(math.log10(largest))
        return max(step for digit in (1, 2, 5) if (step := float(f"{digit}e{power}")) <= largest * (1.0 + 1e-9))

    def entry_value(self, place: float) -> Any:
        """Value of the entry at a place of the slider, as the file holds it."""
        if self.whole:
            return round(place)
        number = float(f"{place:.6g}")
        return f"{number:g} {self.unit}" if self.unit else number


def slider_of(key: str, value: Any, entry: Entry | None) -> Slider | None:
    """Make the slider of a value as the file holds it: from nothing to twice of it; None of what is no number.

    It stays in the window of the entry.
    """
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    if match is None and (isinstance(value, bool) or not isinstance(value, (int, float))):
        return None
    number, unit = (float(match[1]), match[2]) if match else (float(value), "")
    if not math.isfinite(number):
        return None
    whole = isinstance(value, int) and (entry is None or entry.kind == "integer")
    window = entry.window if entry is not None and (unit == entry.unit or not match) else None
    size = abs(number) or (0.01 * max(map(abs, window)) if window else 1.0)
    low, high = (0.0 if number else -size), 2.0 * size
    low, high = (low, high) if number >= 0 else (-high, -low)
    if window:
        low, high = max(low, window[0]), min(high, window[1])
    return Slider(key, number, unit, low, high, whole) if low < high else None


def usual_keys(keys: Iterable[str]) -> list[str]:
    """Choose of the keys of a case file those that are dragged most."""
    given = list(keys)
    chosen = [key for pattern in _USUAL for key in given if re.fullmatch(pattern, key)]
    return chosen[:_MOST]
