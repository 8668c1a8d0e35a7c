"""What the window asks for: the first numbers of a new case, a file to import, a name."""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, get_args

from nicegui import events, ui

from femgear.app.session import SUFFIX
from femgear.gears.gear_steels import Treatment
from femgear.trains.drafts import KINDS

_LARGEST_FILE = 20_000_000
"""Of what is imported [bytes]."""
_OF_PAIRS = ("pair", "drivetrain", "gearbox")
_PAIR = "17 40"
"""Teeth of a pair."""
_STEEL, _HARDNESS = "case hardened steel", "720"


@dataclass(frozen=True)
class NewCase:
    """What a new case begins with.

    Parameters
    ----------
    kind : str
        Of `femgear.trains.drafts.KINDS`.
    name : str
        Of its file.
    teeth : tuple of int
        Of sun, planet and ring, or of both gears.
    numbers : dict of str to str
        Further options of `femgear.trains.drafts.new_case`, those that are given.
    rating : dict of str to object
        Entries that its safeties need, by their keys.
    """

    kind: str
    name: str
    teeth: tuple[int, ...]
    numbers: dict[str, Any]
    rating: dict[str, Any]


def ask_new(free_name: Callable[[str], str], make: Callable[[NewCase], Awaitable[bool]]) -> None:
    """Ask for the few numbers that a case begins with.

    Parameters
    ----------
    free_name : callable
        ``(stem) -> name`` of a file that is not there yet.
    make : callable
        Makes the case; tells whether that was possible.
    """
    with ui.dialog(value=True) as dialog, ui.card().classes("w-96"):
        ui.label("New case").classes("text-lg")
        kind = ui.select(list(KINDS), value="planetary", label="Kind").classes("w-full")
        name = _input("Name of the file", free_name("planetary"))
        teeth = _input("Teeth", " ".join(map(str, KINDS["planetary"])), "sun planet ring, or both gears")

        def changed() -> None:
            usual = _PAIR if kind.value in _OF_PAIRS else " ".join(map(str, KINDS[str(kind.value)]))
            name.value, teeth.value = free_name(str(kind.value)), usual

        kind.on_value_change(changed)
        numbers = {
            "module": _input("Module", "2 mm"),
            "face_width": _input("Face width", hint="twelve modules"),
            "torque": _input("Torque of sun or pinion", hint="usual for this size"),
            "speed": _input("Speed of sun or pinion", "1000 rpm"),
            "helix": _input("Helix angle", hint="0 deg"),
        }
        steels = ["", *map(str, get_args(Treatment))]
        steel = ui.select(steels, value=_STEEL, label="Material, for its safeties").classes("w-full")
        hardness = _input("Hardness of the surface, HV or HBW", _HARDNESS)

        async def begin() -> None:
            try:
                counts = tuple(int(part) for part in _text(teeth).replace(",", " ").replace("/", " ").split())
                rating = {"material.treatment": steel.value, "material.hardness": float(_text(hardness))}
            except ValueError:
                ui.notify("teeth and hardness are numbers", type="negative")
                return
            given = {key: _text(field) for key, field in numbers.items() if _text(field)}
            case = NewCase(str(kind.value), file_name(_text(name)), counts, given, rating if steel.value else {})
            if await make(case):
                dialog.close()

        _buttons(dialog, "Begin", begin)


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
        Takes the name, perhaps in the background; False leaves the dialog open.
    """
    with ui.dialog(value=True) as dialog, ui.card().classes("w-96"):
        ui.label(title).classes("text-lg")
        name = _input(label, value)

        async def take() -> None:
            answer = done(_text(name))
            if inspect.isawaitable(answer):
                dialog.close()
                await answer
            elif answer is not False:
                dialog.close()

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
