"""Sliders of the window: each is one value with its entry of the case file, from whichever side that is changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from nicegui import events, ui

from femgear.app.document import entry_of
from femgear.app.fields import form_of_model, form_within, label_of
from femgear.app.form import Entry, Slider, Table, keys_of, shown_value, slider_of, usual_keys


class Sliders:
    """Sliders of chosen entries, at first of those that are dragged most.

    Parameters
    ----------
    change : callable
        ``(key, value)``, called while a slider is dragged.
    """

    def __init__(self, change: Callable[[str, Any], None]) -> None:
        self._change = change
        self._place = ui.grid(columns="minmax(8rem, auto) 1fr minmax(6rem, auto) auto")
        self._place.classes("w-full items-center gap-x-3 gap-y-0 q-px-sm")
        self.begin()

    def begin(self) -> None:
        """Forget the sliders of the former case."""
        # keys of entries that are wanted, None until some are offered; one of them may be left out of the file a while
        self._pinned: list[str] | None = None
        self._sliders, self._widgets = dict[str, Slider](), dict[str, tuple[Any, Any]]()
        self._place.clear()

    def show(self, tables: Any) -> None:
        """Show the values of a case file, in the sliders that are there where they are those of the same entries.

        A slider keeps its range where that still reaches.
        """
        if self._pinned is None:
            self._pinned = self._usual(tables) or None
        sliders = {key: slider for key in self._pinned or () if (slider := self._slider(key, tables)) is not None}
        self._sliders.update(sliders)
        if list(sliders) != list(self._widgets):
            self._draw(list(sliders))
        for key, slider in sliders.items():
            self._follow(slider, *self._widgets[key])

    def pin(self, key: str, tables: Any) -> bool:
        """Show an entry as a slider, of a list every value; tells whether it is a number that can be dragged."""
        value = entry_of(tables, key)
        keys = [f"{key}[{number}]" for number in range(len(value))] if isinstance(value, list) else [key]
        pinned = [of_value for of_value in keys if self._slider(of_value, tables) is not None]
        self._pinned = list(dict.fromkeys([*(self._pinned or ()), *pinned]))
        self.show(tables)
        return bool(pinned)

    def _usual(self, tables: Any) -> list[str]:
        """Keys of the entries of a case file that are dragged most."""
        keys = list(keys_of(form_of_model(tables.get("model")), tables, embedded=form_within))
        for key in list(keys):
            value = entry_of(tables, key)
            if isinstance(value, list):
                keys += [f"{key}[{number}]" for number in range(len(value))]
            elif isinstance(value, dict):  # as the torques of a load case, by their loads
                keys += [f"{key}.{name}" for name in value if not {".", "[", "]"} & {*name}]
        return usual_keys(key for key in keys if self._slider(key, tables) is not None)

    def _slider(self, key: str, tables: Any) -> Slider | None:
        """Slider of an entry of the tables of the case; in its former range, where that still reaches."""
        part: Any = form_of_model(tables.get("model"))
        value: Any = tables
        for name in key.replace("]", "").replace("[", ".").split("."):
            value = entry_of(value, f"[{name}]" if name.isdigit() else name)
            if not name.isdigit() and isinstance(part, Table):
                part = part.part(name)
                part = part if isinstance(part, Table) else form_within(value) or part
        slider = slider_of(key, entry_of(tables, key), part if isinstance(part, Entry) else None)
        former = self._sliders.get(key)
        if slider is None or former is None or former.unit != slider.unit:
            return slider
        return replace(former, value=slider.value) if former.low <= slider.value <= former.high else slider

    def _draw(self, keys: list[str]) -> None:
        """Draw sliders with their names and values."""
        self._place.clear()
        self._widgets = {}
        with self._place:
            for key in keys:
                slider = self._sliders[key]
                ui.label(label_of(key)).classes("text-sm").tooltip(key)
                moved = ui.slider(min=slider.low, max=slider.high, step=slider.step, value=slider.value)
                moved.props(f'dense aria-label="{key}" data-slider="{key}"')
                moved.on_value_change(partial(self._drag, key))
                self._widgets[key] = moved, ui.label().classes("text-sm")
                remove = ui.button(icon="close", on_click=partial(self._drop, key))
                remove.props(f'flat dense round size=xs aria-label="Remove {key}"')

    @staticmethod
    def _follow(slider: Slider, moved: Any, shown: Any) -> None:
        """Move a slider to the value of its entry."""
        if (moved.props["min"], moved.props["max"]) != (slider.low, slider.high):
            moved.props["min"], moved.props["max"], moved.props["step"] = slider.low, slider.high, slider.step
        # where one drags it is there, but for digits that the file does not have
        if slider.entry_value(float(moved.value)) != slider.entry_value(slider.value):
            moved.value = slider.value
        shown.text = shown_value(slider.entry_value(slider.value))

    def _drag(self, key: str, event: events.ValueChangeEventArguments) -> None:
        """Take the place of a slider as the value of its entry."""
        slider = self._sliders[key]
        value = slider.entry_value(float(event.value))
        if value != slider.entry_value(slider.value):  # else it follows its entry
            self._change(key, value)

    def _drop(self, key: str) -> None:
        """Take a slider away."""
        self._pinned = [pinned for pinned in self._pinned or () if pinned != key]
        self._draw([shown for shown in self._widgets if shown != key])
        for shown, widgets in self._widgets.items():
            self._follow(self._sliders[shown], *widgets)
