"""What the window asks for: the first numbers of a new case, a file to import, a name."""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, get_args

from nicegui import events, ui

from femgear.app.form import sentence_of
from femgear.app.new_case import LABELS, asked_fields
from femgear.app.session import SUFFIX
from femgear.errors import FemgearError
from femgear.gears.gear_steels import Treatment
from femgear.trains.drafts import KINDS

_LARGEST_FILE = 20_000_000
"""Of what is imported [bytes]."""
_FIRST = {"module": "2 mm", "speed": "1000 rpm", "treatment": "case hardened steel", "hardness": "720"}
"""What stands in the fields of a new case at first."""
_TEETH = {"planetary": "17 37 91", "pair": "17 40", "drivetrain": "17 40", "gearbox": "17 40"}
"""Teeth that are offered, by kind, where they are not those of `KINDS`."""
_KIND_WORDS = {
    "planetary": "planetary set: elastic ring, safeties and sound",
    "pair": "pair of gears",
    "planar": "planetary set of rigid bodies in the plane",
    "helical": "helical planetary set of rigid bodies in space",
    "drivetrain": "gearbox of a pair, followed in time",
    "gearbox": "gearbox of a pair: shafts and bearings",
    "stepped": "gearbox with stepped planets",
    "double": "gearbox with pairs of planets",
    "ravigneaux": "gearbox of a Ravigneaux set",
    "wolfrom": "gearbox of a Wolfrom set (3K)",
}
"""Kinds of cases, in words."""
_ORDER = {
    "stepped": "sun, first and second gear of the planets, ring",
    "double": "sun, inner and outer planets, ring",
    "ravigneaux": "small and large sun, short and long planets, ring",
    "wolfrom": "sun, first gear of the planets, its ring, second gear, its ring",
}
"""Order of the teeth of a kind of sets."""
_OF_SET, _OF_PAIR = "sun, planet, ring", "pinion, wheel"
_HELICAL = {"helical": "20 deg"}
"""Helix angle where none is given, by kind."""
_HINTS = {
    "planets": "as equal spacing allows",
    "face_width": "twelve modules",
    "torque": "usual for this size",
    "helix": "0 deg",
}
"""What holds where a field stays empty."""


def ask_new(
    free_name: Callable[[str], str], make: Callable[[str, Mapping[str, str]], Awaitable[Mapping[str, str]]]
) -> None:
    """Ask for the few numbers that a case begins with.

    Parameters
    ----------
    free_name : callable
        ``(stem) -> name`` of a file that is not there yet.
    make : callable
        ``(kind, typed) -> problems``: makes the case of what was typed into the fields of
        `femgear.app.new_case.LABELS`, or says what is wrong, by the name of the field.
    """
    fields = dict[str, Any]()
    with ui.dialog(value=True) as dialog, ui.card().classes("w-[36rem] max-w-full"):
        ui.label("New case").classes("text-lg")
        with ui.grid(columns=2).classes("w-full gap-x-4 gap-y-1 items-start"):
            for name, label in LABELS.items():
                fields[name] = _field_of_new(name, label)
        beside = ui.label().classes("text-negative said")
        beside.visible = False

        def changed() -> None:
            kind = str(fields["kind"].value)
            fields["name"].value = free_name(kind)
            fields["teeth"].value = _TEETH.get(kind, " ".join(map(str, KINDS[kind])))
            order = _ORDER.get(kind, _OF_PAIR if len(KINDS[kind]) == 2 else _OF_SET)
            fields["teeth"].props(f'hint="{order}"')
            fields["helix"].props(f'placeholder="{_HELICAL.get(kind, _HINTS["helix"])}"')
            for name, field in fields.items():
                field.visible = name in asked_fields(kind)

        async def begin() -> None:
            kind = str(fields["kind"].value)
            problems = await make(kind, {name: _text(fields[name]) for name in asked_fields(kind)})
            for name, field in fields.items():
                field.error = problems.get(name)
            others = [text for name, text in problems.items() if name not in fields]
            beside.text, beside.visible = "\n".join(others), bool(others)
            if not problems:
                dialog.close()

        changed()
        fields["kind"].on_value_change(changed)
        _buttons(dialog, "Begin", begin)


def _field_of_new(name: str, label: str) -> Any:
    """Draw a field of a new case, whose mistake is forgotten as soon as it is changed."""
    if name == "kind":
        words = {kind: _KIND_WORDS[kind] for kind in KINDS}
        return ui.select(words, value="planetary", label=label).classes("w-full col-span-2")
    if name == "treatment":
        field: Any = ui.select(["", *map(str, get_args(Treatment))], value=_FIRST[name], label=label).classes("w-full")
    else:
        field = _input(label, _FIRST.get(name, ""), _HINTS.get(name, ""))
    field.on_value_change(lambda: setattr(field, "error", None))
    return field


def ask_import(take: Callable[[events.UploadEventArguments], Awaitable[bool]]) -> None:
    """Ask for a REXS file; ``take`` makes cases of it, and tells whether that was possible."""
    with ui.dialog(value=True) as dialog, ui.card():
        ui.label("Gearbox of a REXS file").classes("text-lg")

        async def taken(event: events.UploadEventArguments) -> None:
            if await take(event):
                dialog.close()

        upload = ui.upload(on_upload=taken, auto_upload=True, max_file_size=_LARGEST_FILE, max_files=1)
        upload.props('accept=".rexs,.xml,.rexsj,.rexsz,.zip"').classes("w-96")


def ask_name(title: str, label: str, value: str, button: str, done: Callable[[str], Any]) -> None:
    """Ask for a name of a file or folder.

    Parameters
    ----------
    title, label, button : str
        Words of the dialog.
    value : str
        Name that is offered.
    done : callable
        Takes the name, perhaps in the background; what it raises is said beside the name.
    """
    with ui.dialog(value=True) as dialog, ui.card().classes("w-96"):
        ui.label(title).classes("text-lg")
        name: Any = _input(label, value)
        name.on_value_change(lambda: setattr(name, "error", None))

        async def take() -> None:
            try:
                answer = done(_text(name))
            except FemgearError as error:
                said = {"text": error.message, "limit": error.limit, "remedy": error.remedy, "code": error.code}
                name.error = sentence_of({part: words or "" for part, words in said.items()})
                return
            except OSError as error:
                name.error = str(error)
                return
            dialog.close()
            if inspect.isawaitable(answer):
                await answer

        _buttons(dialog, button, take)


def file_name(name: str) -> str:
    """Name of a case file, with its suffix."""
    return name if name.endswith(SUFFIX) else f"{name}{SUFFIX}"


def _input(label: str, value: str = "", hint: str = "") -> ui.input:
    return ui.input(label, value=value, placeholder=hint).classes("w-full").props("stack-label")


def _text(field: ui.input) -> str:
    return str(field.value or "").strip()


def _buttons(dialog: ui.dialog, text: str, act: Callable[[], Any]) -> None:
    with ui.row().classes("w-full justify-end"):
        ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
        ui.button(text, on_click=act).props("no-caps")
