"""The form of a case file in the window: a fold for every table, a field for every entry."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from nicegui import ui

from femgear.app.document import entry_of
from femgear.app.form import Entry, Table, sentence_of, shape_of, shown_value, slider_of, table_of_schema, typed_value
from femgear.errors import FemgearError
from femgear.trains.reading import case_schema

_HELP = Path(__file__).with_name("help.json")
_EMPTY = ""
_DEBOUNCE = 80
"""Wait of a field for more keys, before its text is sent and kept [ms]."""


@cache
def _help() -> dict[str, str]:
    """What docs/case_file.md says of entries, by table and entry."""
    return json.loads(_HELP.read_text("utf-8"))


def help_of(key: str) -> str:
    """Explain an entry by its key, nothing where the documentation has no line of its own."""
    parts = [part.split("[")[0] for part in key.split(".")]
    names = (".".join(parts[-count:]) for count in (3, 2, 1) if count <= len(parts))
    return next((text for name in names if (text := _help().get(name))), "")


def words(name: str) -> str:
    """Write the name of an entry as words."""
    return name.replace("_", " ")


def label_of(key: str) -> str:
    """Write the key of an entry as words: "sun modifications 1 amount"."""
    numbered = re.sub(r"\[(\d+)\]", lambda match: f" {int(match[1]) + 1}", key)
    return words(numbered.replace(".", " "))


@cache
def form_of_model(model: str | None) -> Table:
    """Form of the files of a model, of planetary sets where it is None; FemgearError where there is no such model."""
    return table_of_schema(case_schema(model))


def form_within(value: Any) -> Table | None:
    """Form of a case within a case, as the teeth of a stage; None of any other value."""
    if not isinstance(value, dict) or not isinstance(value.get("set"), dict):
        return None
    try:
        return form_of_model(value.get("model"))
    except (FemgearError, TypeError):
        return None


class Form:
    """Fields of a case file, which follow its text and what is said of it.

    Parameters
    ----------
    change : callable
        ``(key, value)``, called when a field was changed.
    change_rows : callable
        The same, called when a list of tables has one more or one less.
    pin : callable
        ``(key)``, called when an entry is wanted as a slider.
    """

    def __init__(
        self,
        change: Callable[[str, Any], None],
        change_rows: Callable[[str, Any], None],
        pin: Callable[[str], None],
    ) -> None:
        self._change, self._change_rows, self._pin = change, change_rows, pin
        self._fields = dict[str, tuple[Entry, Any, Any]]()
        self._folds = dict[str, Any]()
        self._open = set[str]()
        self._table: Table | None = None
        self._tables: Any = {}
        self._values: Mapping[str, Any] = {}
        self._said = dict[str, tuple[str, str]]()
        self._place = ui.column().classes("w-full gap-0")

    def show(self, table: Table, tables: Any) -> None:
        """Draw the form of a kind of case anew, with what its file gives."""
        self._table, self._tables = table, tables
        self._fields.clear()
        self._folds.clear()
        self._place.clear()
        with self._place:
            self._entries(table, "", tables)
            for part in table.parts:
                if isinstance(part, Table):
                    self._fold(part, part.name, tables.get(part.name))
        self._mark_folds()

    def follow(self, table: Table, tables: Any) -> None:
        """Show changed values, in the fields that are there where the file has the same entries as before.

        The field in which one types keeps what was typed.
        """
        if table is not self._table or shape_of(tables) != shape_of(self._tables):
            self.show(table, tables)
            return
        self.take(tables)

    def take(self, tables: Any) -> None:
        """Show changed values in the fields that are there, without further ones."""
        self._tables = tables
        for key, (entry, field, pin) in self._fields.items():
            value = entry_of(tables, key)
            if typed_value(entry, str(field.value or "")) != value:
                self._fill(entry, field, value)
            if pin is not None:
                pin.visible = _draggable(value)

    @staticmethod
    def _fill(entry: Entry, field: Any, value: Any) -> None:
        """Write the value of an entry into its field."""
        text = shown_value(value)
        if entry.kind in ("choice", "switch") and text not in field.options:
            field.set_options([*field.options, text], value=text)
        else:
            field.value = text

    def say(
        self, problems: Iterable[Mapping[str, str]], findings: Iterable[Mapping[str, str]], values: Mapping
    ) -> None:
        """Show what is said of the entries beside their fields, and what was estimated for those left out."""
        self._values = values
        self._said = {finding["key"]: ("look", sentence_of(finding)) for finding in findings if finding["key"]}
        self._said |= {problem["key"]: ("bad", sentence_of(problem)) for problem in problems if problem["key"]}
        for key, (entry, field, _) in self._fields.items():
            self._mark(key, entry, field)
        self._mark_folds()

    def refuse(self, key: str, text: str) -> bool:
        """Say beside a field that what was typed is not taken; tells whether there is such a field."""
        if key not in self._fields:
            return False
        self._fields[key][1].error = text
        return True

    def _mark_folds(self) -> None:
        """Show in which folds something is said of an entry."""
        for key, fold in self._folds.items():
            states = {
                state for at, (state, _) in self._said.items() if at == key or at.startswith((f"{key}.", f"{key}["))
            }
            icon = "error" if "bad" in states else "warning" if "look" in states else ""
            fold.props(f'icon="{icon}"') if icon else fold.props(remove="icon")

    def _fold(self, table: Table, key: str, value: Any) -> None:
        """Draw the fold of a table, whose fields are made when it is opened."""
        given = value not in (None, [], {})
        title = f"{words(table.name)}" + (f" ({len(value)})" if table.listed and given else "")
        fold = (
            ui.expansion(title, value=key in self._open).classes("w-full").props("dense dense-toggle header-class=fold")
        )
        if not given:
            fold.classes("absent")
        self._folds[key] = fold
        with fold:
            content = ui.column().classes("w-full gap-1 pl-2")

        def fill() -> None:
            content.clear()
            with content:
                self._filled(table, key)

        def toggled(event: Any) -> None:
            (self._open.add if event.value else self._open.discard)(key)
            if event.value:
                fill()

        fold.on_value_change(toggled)
        if key in self._open:
            fill()

    def _filled(self, table: Table, key: str) -> None:
        """Draw the fields of a table, or the tables of a list with a button for one more."""
        value = entry_of(self._tables, key)
        if table.hint:
            ui.label(table.hint.replace("`", "")).classes("hint")
        if not table.listed:
            self._inside(table, key, value if isinstance(value, dict) else {})
            return
        rows = value if isinstance(value, list) else []
        for number, row in enumerate(rows):
            with ui.row().classes("w-full items-center no-wrap"):
                ui.label(f"{words(table.name)} {number + 1}").classes("grow font-bold")
                removed = f"{key}[{number}]"
                button = ui.button(icon="delete", on_click=partial(self._change_rows, removed, None))
                button.props(f'flat dense round size=sm aria-label="Remove {words(table.name)} {number + 1}"')
            self._inside(table, f"{key}[{number}]", row if isinstance(row, dict) else {})
        needed = [part for part in table.parts if isinstance(part, Entry) and part.needed]
        with ui.row():
            button = ui.button(f"Add {words(table.name)}", icon="add")
            button.props("flat dense no-caps").on_click(lambda: self._add(table, key, len(rows), needed))

    def _inside(self, table: Table, key: str, value: Any) -> None:
        """Draw entries, then tables, of a table."""
        self._entries(table, f"{key}.", value)
        for part in table.parts:
            if isinstance(part, Table):
                self._fold(part, f"{key}.{part.name}", value.get(part.name))

    def _entries(self, table: Table, prefix: str, value: Any) -> None:
        """Draw the fields of a table: those that the file gives or needs, the others under "more"."""
        entries = [part for part in table.parts if isinstance(part, Entry)]
        shown = [entry for entry in entries if entry.needed or entry.name in value]
        others = [entry for entry in entries if entry not in shown]
        for entry in shown:
            inner = form_within(value.get(entry.name))
            if inner is not None:
                # what its schema says beyond the first sentence is about files and programs
                within = replace(inner, name=entry.name, hint=f"{inner.hint.partition('.')[0]}.")
                self._fold(within, prefix + entry.name, value.get(entry.name))
            else:
                self._field(entry, prefix + entry.name, value.get(entry.name))
        if not others:
            return
        key = f"{prefix}*"
        more = ui.expansion(f"more ({len(others)})", value=key in self._open).classes("w-full more").props("dense")
        with more:
            content = ui.column().classes("w-full gap-1")

        def fill() -> None:
            content.clear()
            with content:
                for entry in others:
                    self._field(entry, prefix + entry.name, entry_of(self._tables, prefix + entry.name))

        def toggled(event: Any) -> None:
            (self._open.add if event.value else self._open.discard)(key)
            if event.value:
                fill()

        more.on_value_change(toggled)
        if key in self._open:
            fill()

    def _field(self, entry: Entry, key: str, value: Any) -> None:
        """Draw the field of an entry."""
        text = shown_value(value)

        def changed(event: Any) -> None:
            typed = typed_value(entry, str(event.value or ""))
            if typed != entry_of(self._tables, key):  # else it is the form that filled it
                self._change(key, typed)

        with ui.row().classes("w-full items-start no-wrap gap-0"):
            if entry.kind in ("choice", "switch"):
                choices = entry.choices if entry.kind == "choice" else ("true", "false")
                options = list(dict.fromkeys([_EMPTY, *choices, text]))
                field: Any = ui.select(options, value=text, label=words(entry.name), on_change=changed)
            else:
                field = ui.input(words(entry.name), value=text, on_change=changed).props(
                    f"debounce={_DEBOUNCE} autocomplete=off"
                )
            field.classes("grow").props(f'dense stack-label data-key="{key}"')
            pin = None
            if entry.kind in ("quantity", "number", "list"):
                pin = ui.button(icon="tune", on_click=lambda: self._pin(key))
                pin.props(f'flat dense round size=sm tabindex=-1 aria-label="Slider of {words(entry.name)}"')
                pin.visible = _draggable(value)
            explained = ". ".join(text for text in (help_of(key), entry.hint) if text)
            if explained:
                with field:
                    ui.tooltip(explained).classes("explained").props("delay=500")
        self._fields[key] = entry, field, pin
        self._mark(key, entry, field)

    def _mark(self, key: str, entry: Entry, field: Any) -> None:
        """Show what is said of an entry, and what holds where it is left out."""
        state, text = self._said.get(key, ("", ""))
        field.error = text if state == "bad" else None
        field.props(f"hint={json.dumps(text)}") if state == "look" else field.props(remove="hint")
        held = self._values.get(key)
        if isinstance(held, (int, float)) and not isinstance(held, bool):
            held = f"{held / entry.scale:.6g} {entry.unit}".strip()
        shown = held if held is not None else entry.default
        field.props(f"placeholder={json.dumps(shown_value(shown))}")

    def _add(self, table: Table, key: str, number: int, needed: list[Entry]) -> None:
        """Add a table to a list, with its first entry that must be there."""
        first = needed[0] if needed else next(part for part in table.parts if isinstance(part, Entry))
        value = first.choices[0] if first.choices else 1 if first.kind in ("integer", "number") else _EMPTY
        self._open.add(key)
        self._change_rows(f"{key}[{number}].{first.name}", value)


def _draggable(value: Any) -> bool:
    """Whether a slider can be made of the value of an entry, or of one of its list."""
    return any(slider_of("", part, None) is not None for part in (value if isinstance(value, list) else [value]))
