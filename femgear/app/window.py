"""The window of the app: form, text, sliders and answers of one case, and the runs of a folder."""

from __future__ import annotations

import asyncio
import shlex
import sys
import tempfile
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from nicegui import events, ui

from femgear.app.answers_panel import ANSWERS_SCRIPT, AnswersPanel
from femgear.app.dialogs import ask_import, ask_name, ask_new, file_name
from femgear.app.document import tables_of_text
from femgear.app.fields import Form, form_of_model
from femgear.app.form import in_window, sentence_of
from femgear.app.new_case import drafted_case
from femgear.app.runs import serve_runs
from femgear.app.runs_panel import RunsPanel
from femgear.app.session import SUFFIX, Session, case_files, first_shown
from femgear.app.sliders import Sliders
from femgear.app.worker import Worker, WorkerError, serve_bench
from femgear.assistant import MOST_TEXT
from femgear.case import text as case_text
from femgear.errors import FemgearError
from femgear.trains.gearbox_of_case import case_in_casing, gearbox_of_case
from femgear.trains.reading import parse_case

_ENDED = Path(__file__).parent / "web" / "ended.js"
_CSS = """
.nicegui-content { padding: 0; gap: 0; }
.q-header .q-field__label { color: #fff; opacity: 1; }
.hint { font-size: 0.75rem; opacity: 0.7; }
.absent > .q-expansion-item__container > .q-item { opacity: 0.6; }
.fold { font-weight: 600; padding-left: 4px; }
.more { font-size: 0.8rem; }
.elsewhere { border: 2px solid #8a4b00; border-radius: 4px; }
.explained { font-size: 0.8rem; max-width: 26rem; }
.said { font-size: 0.8rem; white-space: pre-wrap; overflow-wrap: anywhere; }
iframe { border: 0; width: 100%; flex: 1 1 auto; }
.q-field__messages { white-space: normal; line-height: 1.2; }
.q-field__bottom--animated { position: static; transform: none; }
.q-field--with-bottom { padding-bottom: 2px; }
.q-notification__actions { color: inherit; }
#popup { display: none; }
dialog.ended { margin: auto; max-width: 36rem; padding: 1.5rem; border: 0; border-radius: 4px; }
dialog.ended h2 { font-size: 1.25rem; line-height: 1.5; font-weight: 600; margin: 0; }
dialog.ended ol { list-style: decimal; padding-left: 1.5rem; }
dialog.ended p, dialog.ended li { margin: 0.5rem 0; overflow-wrap: anywhere; }
dialog.ended code { user-select: all; background: #8883; padding: 0.1em 0.3em; }
"""
_KEPT_EVERY = 0.7
"""Between two looks after what is not saved, as what sliders change is not at once [s]."""
_BEGINS_AFTER = 0.2
"""From the connection of a window to its first case [s]."""


class Window:
    """One window, of one browser: what it edits and computes is its own.

    Parameters
    ----------
    folder : path
        Of case files and results.
    cache : path, optional
        Folder of generated grids.
    sessions : list of Session
        Those of all windows of the server.
    """

    def __init__(self, folder: Path, cache: Path | None, sessions: list[Session]) -> None:
        self.session = Session(folder, sessions)
        self._bench = Worker(serve_bench, self.session.folder, cache)
        self._runs = Worker(serve_runs, self.session.folder)

    # what the window is made of

    async def build(self) -> None:
        """Build the page, and begin to answer."""
        ui.add_css(_CSS)
        ui.colors(primary="#005a9c", accent="#8a4b00", negative="#b00020", warning="#8a4b00")
        ui.add_head_html(ANSWERS_SCRIPT + _ended_script(self.session.folder))
        self._head()
        with ui.splitter(value=30).classes("w-full").style("height: calc(100vh - 60px)") as splitter:
            with splitter.before, ui.column().classes("w-full h-full no-wrap gap-0"):
                self._editor()
            with splitter.after, ui.column().classes("w-full h-full no-wrap gap-0"):
                self._right()
        ui.on("femgear-too-long", self._too_long)
        ui.timer(_KEPT_EVERY, self._keep)
        client = ui.context.client
        client.on_delete(self._close)
        client.on_disconnect(self._leave)
        client.on_connect(self.session.come_back)
        # a page that is loaded again is another window: by now the former one is gone
        ui.timer(_BEGINS_AFTER, self._first, once=True)

    def _first(self) -> None:
        """Begin with the case edited last, or with a new one."""
        if name := first_shown(self.session.folder):
            self._open(name)
        else:
            self._new()

    def _leave(self) -> None:
        """Leave what is not saved to the next window, as this one has no connection."""
        try:
            self.session.leave()
        except (FemgearError, OSError) as error:
            print(f"femgear app: not kept: {error}", file=sys.stderr, flush=True)

    def _head(self) -> None:
        """The bar above: which case, and what can be done with it."""
        with ui.header().classes("items-center no-wrap q-py-none gap-2").style("height: 60px"):
            ui.label("femgear").classes("text-lg font-bold")
            self._files = ui.select([], label="Case", on_change=lambda event: self._open(event.value))
            self._files.props("dense dark options-dense outlined").classes("min-w-60")
            for text, icon, act in (
                ("New", "add", self._new),
                ("Import", "file_upload", lambda: ask_import(self._import)),
                ("Save", "save", self._save),
                ("Save as", "save_as", self._save_as),
            ):
                ui.button(text, icon=icon, on_click=act).props("flat dense no-caps color=white")
            with ui.button("Gearbox", icon="settings").props("flat dense no-caps color=white"), ui.menu():
                ui.menu_item("As a gearbox", lambda: self._make_gearbox("gearbox"))
                ui.menu_item("In a casing", lambda: self._make_gearbox("in_casing"))
            for text, icon, act in (
                ("Undo", "undo", self._undo),
                ("Redo", "redo", self._redo),
                ("Back to the file", "history", self._discard),
            ):
                ui.button(icon=icon, on_click=act).props(f'flat dense round color=white aria-label="{text}"').tooltip(
                    text
                )
            self._state = ui.label().classes("text-sm")
            ui.space()
            run = ui.button("Run", icon="play_arrow", on_click=lambda: self._runs_panel.ask_run())
            run.props("unelevated dense no-caps color=accent")

    def _editor(self) -> None:
        """The left side: what other windows do with the case, its form and text, and what is wrong with it."""
        with ui.column().classes("elsewhere w-full gap-1 p-2").props('role="alert"') as self._elsewhere:
            self._elsewhere_text = ui.label().classes("said")
            with ui.row().classes("gap-1"):
                self._take = ui.button("Take these changes", on_click=self._take_changes)
                self._stay = ui.button(on_click=self._stay_here)
                self._back = ui.button("Take the saved file", on_click=self._discard)
                for button in (self._take, self._stay, self._back):
                    button.props("dense no-caps outline")
        self._elsewhere.visible, self._stays = False, False
        with ui.tabs().props("dense no-caps align=left") as tabs:
            form, text = ui.tab("Form"), ui.tab("Text")
        with ui.tab_panels(tabs, value=form).classes("w-full grow") as panels:
            panels.props("keep-alive")
            with ui.tab_panel(form).classes("p-2"):
                self._form = Form(self._change_field, self._change_rows, self._pin)
            with ui.tab_panel(text).classes("p-0 h-full"):
                self._refused = ui.label().classes("text-negative said p-2").props('role="alert"')
                self._refused.visible = False
                self._text = ui.codemirror(language="TOML", on_change=self._typed, line_wrapping=True)
                self._text.classes("w-full h-full")
        self._said = ui.column().classes("w-full gap-1 p-2").style("max-height: 30%; overflow: auto; flex: none")

    def _right(self) -> None:
        """The right side: answers to the case as it stands, and results of runs."""
        with ui.tabs().props("dense no-caps align=left") as self._tabs:
            answers, results = ui.tab("Answers"), ui.tab("Results")
        with ui.tab_panels(self._tabs, value=answers).classes("w-full grow") as panels:
            panels.props("keep-alive")
            with ui.tab_panel(answers).classes("p-0 h-full"), ui.column().classes("w-full h-full no-wrap gap-0"):
                self._answers = AnswersPanel(self.session, self._bench, self._show_seen)
                self._sliders = Sliders(self._drag)
                self._answers.frame()
            with ui.tab_panel(results).classes("p-0 h-full"), ui.column().classes("w-full h-full no-wrap gap-0"):
                self._runs_panel = RunsPanel(self.session, self._runs, self._notify, self._show_results)

    def _show_results(self) -> None:
        self._tabs.value = "Results"

    # changes of the case

    def _open(self, name: str | None) -> None:
        """Open a case file of the folder."""
        if not name or name == self.session.name:
            return
        self.session.keep()
        try:
            unsaved = self.session.open(name)
        except (FemgearError, OSError, UnicodeError) as error:
            self._notify(str(error), "negative")
            self._list_files()
            return
        if unsaved:
            self._begin(f"{name}: changes that were not saved are back")
        elif not self.session.path.is_file() and self.session.changed_elsewhere:
            self.session.take_changes()
            self._begin(f"{name} is not saved yet: this window begins with the changes of the other one")
        else:
            self._begin("")

    def _begin(self, said: str) -> None:
        """Show another case from its beginning."""
        self._stays = False
        self._show_elsewhere()
        self._sliders.begin()
        self._answers.begin()
        self._list_files()
        self._text_changed()
        if said:
            self._notify(said)

    def _list_files(self) -> None:
        names = case_files(self.session.folder)
        names = sorted({*names, self.session.name} - {""})
        self._files.set_options(names, value=self.session.name or None)
        self._runs_panel.list_runs()

    def _change_field(self, key: str, value: Any) -> None:
        """Take a change from a field."""
        if self._change(key, value):
            self._text_changed(by_form=True)

    def _change_rows(self, key: str, value: Any) -> None:
        """Take a change of a list of tables, which the form has to draw."""
        if self._change(key, value):
            self._text_changed()

    def _drag(self, key: str, value: Any) -> None:
        """Take a change from a slider."""
        if self._change(key, value):
            self._text_changed(dragged=True)

    def _change(self, key: str, value: Any) -> bool:
        """Change an entry; tells whether that was possible."""
        try:
            self.session.change(key, value)
        except FemgearError as error:
            self._notify(str(error), "negative")
            return False
        return True

    def _pin(self, key: str) -> None:
        """Show an entry as a slider."""
        if not self._sliders.pin(key, tables_of_text(self.session.text)):
            self._notify("only a single number can be dragged")

    def _typed(self, event: events.ValueChangeEventArguments) -> None:
        """Take a change from the text."""
        if event.value == self.session.text or event.value is None:
            return
        try:
            self.session.replace(event.value)
        except FemgearError as error:
            self._text.value = self.session.text
            self._refused.text, self._refused.visible = str(error), True
            return
        self._refused.visible = False
        self._text_changed(by_text=True)

    def _too_long(self, event: events.GenericEventArguments) -> None:
        """Say beside its field that a text was not taken, as the connection carries none of millions of characters."""
        said = f"{event.args['length']} characters were not taken: a case file has up to {MOST_TEXT}"
        if not self._form.refuse(event.args["key"], said):
            self._refused.text, self._refused.visible = said, True

    def _text_changed(self, *, by_form: bool = False, by_text: bool = False, dragged: bool = False) -> None:
        """Show a changed text everywhere but where it was changed, and ask for an answer to it."""
        if not dragged:  # before all else, as the process may end at any time
            self._keep()
        if not by_text:
            self._text.value = self.session.text
        self._show_values(by_form=by_form)
        self._show_state()
        self._answers.ask(dragged=dragged)

    def _show_values(self, *, by_form: bool = False) -> None:
        """Show the text as it stands in form and sliders, where it can be read; what is wrong is said later."""
        try:
            tables = tables_of_text(self.session.text)
            table = form_of_model(tables.get("model") if isinstance(tables.get("model"), str) else None)
        except FemgearError:
            return
        if by_form:
            self._form.take(tables)
        else:
            self._form.follow(table, tables)
        self._sliders.show(tables)

    def _show_state(self) -> None:
        self._state.text = "not saved" if self.session.unsaved else "saved"

    def _undo(self) -> None:
        if self.session.undo():
            self._text_changed()

    def _redo(self) -> None:
        if self.session.redo():
            self._text_changed()

    def _discard(self) -> None:
        """Go back to what is saved; undo brings the changes back."""
        self.session.discard()
        self._show_elsewhere()
        self._text_changed()

    def _save(self) -> None:
        try:
            self.session.save()
        except FemgearError as error:
            self._notify(str(error), "negative")
        self._list_files()
        self._show_state()

    def _keep(self) -> None:
        """Write what is not saved beside the file, so that nothing is lost, and look what other windows do."""
        try:
            self.session.keep()
            self._show_elsewhere()
        except (FemgearError, OSError) as error:
            self._state.text = f"not kept: {error}"

    def _show_elsewhere(self) -> None:
        """Say that another window has changed or saved the same file, and offer what it has."""
        saved, changed = self.session.saved_elsewhere, self.session.changed_elsewhere
        if not changed:
            self._stays = False
        self._elsewhere.visible = saved or (changed and not self._stays)
        name = self.session.name
        if saved:
            text = f"{name} was saved or removed by another window or program since it was read here."
            text += " Save it under another name, or take the saved file: it is not overwritten."
        else:
            text = f"{name} is open in another window, with changes that are not saved there."
        self._elsewhere_text.text = text if self._elsewhere.visible else ""
        self._take.visible, self._stay.visible, self._back.visible = changed, changed and not saved, saved
        self._stay.text = "Keep what is here" if self.session.unsaved else "Stay with the saved file"

    def _take_changes(self) -> None:
        """Go on with what another window has not saved; undo brings back what was here."""
        self.session.take_changes()
        self._show_elsewhere()
        self._text_changed()

    def _stay_here(self) -> None:
        """Go on with what is here; what the other window has stays there."""
        self._stays = True
        self._show_elsewhere()

    # what is said of it

    def _show_seen(self, seen: dict[str, Any]) -> None:
        """Show what is said of a text, beside its fields and below."""
        self._form.say(seen["problems"], seen["findings"], seen["values"])
        self._said.clear()
        with self._said:
            for problem in seen["problems"]:
                self._line("error", "negative", problem)
            for finding in seen["findings"]:
                self._line("warning", "warning", finding)

    def _line(self, icon: str, colour: str, said: Mapping[str, str]) -> None:
        with ui.row().classes("items-start no-wrap gap-1"):
            ui.icon(icon, color=colour).classes("text-base")
            limit = f"\nallowed: {said['limit']}" if said.get("limit") else ""
            remedy = f"\nremedy: {said['remedy']}" if said.get("remedy") else ""
            code = f" [{said['code']}]" if said.get("code") else ""
            key = f"{said['key']}: " if said.get("key") else ""
            ui.label(f"{key}{said['text']}{code}{limit}{remedy}").classes("said")

    def _notify(self, text: str, kind: Any = "info") -> None:
        ui.notify(in_window(text), type=kind, multi_line=True, classes="said", timeout=6000, close_button="Close")

    # new cases, runs

    def _new(self) -> None:
        ask_new(self._free_name, self._make)

    async def _make(self, kind: str, typed: Mapping[str, str]) -> Mapping[str, str]:
        """Make a new case and show it; says what is wrong where that is not possible, by the name of the field."""
        name, problems = file_name(typed["name"]), dict[str, str]()
        try:
            self.session.check_new(name)
        except FemgearError as error:
            problems["name"] = sentence_of({"text": error.message, "remedy": error.remedy or "", "code": error.code})
        # in a thread: the process of the runs may be busy for long
        text, of_fields = await asyncio.to_thread(drafted_case, kind, typed)
        problems |= of_fields
        if not problems:
            self.session.begin(name, text)
            self._begin("")
        return problems

    async def _make_gearbox(self, shape: str) -> None:
        """Make a new case of this one: a gearbox, or one in a casing with sensors, so that it is heard."""
        text, name = self.session.text, self.session.name
        if not name:
            return
        try:
            made, findings = await asyncio.to_thread(_as_gearbox, text, str(self.session.path), shape == "in_casing")
            self.session.begin(self._free_name(f"{name.removesuffix(SUFFIX)}_{shape}"), made)
        except (FemgearError, OSError) as error:
            self._notify(str(error), "negative")
            return
        self._begin("; ".join(findings)[:600])

    def _free_name(self, stem: str) -> str:
        """Name of a case file that is not there yet."""
        taken, number = set(case_files(self.session.folder)), 1
        while (name := f"{stem}{'' if number == 1 else f'_{number}'}{SUFFIX}") in taken:
            number += 1
        return name

    async def _import(self, event: events.UploadEventArguments) -> bool:
        """Make cases of a REXS file, and open the first one; tells whether that was possible."""
        given = Path(event.file.name)
        stem = "".join(letter if letter.isalnum() or letter in "_-" else "_" for letter in given.stem)
        stem, said = self._free_name(stem or "imported").removesuffix(SUFFIX), list[str]()
        with tempfile.TemporaryDirectory() as place:
            path = Path(place) / f"model{given.suffix.lower()}"
            await event.file.save(path)
            try:
                async for drafts in self._runs.ask("imported", str(path), stem):
                    for draft in reversed(drafts):
                        self.session.begin(draft["name"], draft["text"])
                    said = [finding["text"] for finding in drafts[0]["findings"]]
            except (WorkerError, FemgearError) as error:
                self._notify(str(error), "negative")
                return False
        self._begin("; ".join(said)[:600])
        return True

    def _save_as(self) -> None:
        offered = self._free_name(self.session.name.removesuffix(SUFFIX))
        ask_name("Save under another name", "Name of the file", offered, "Save", self._saved_as)

    def _saved_as(self, name: str) -> None:
        """Save under another name."""
        self.session.save_as(file_name(name))
        self._list_files()
        self._show_state()

    def _close(self) -> None:
        """End what the window has begun."""
        self._answers.stop()
        try:
            self.session.leave()
        finally:
            self._bench.stop()
            self._runs_panel.stop()


def _as_gearbox(text: str, name: str, in_casing: bool) -> tuple[str, list[str]]:
    """Write the text of a case as that of a gearbox, perhaps in a casing; what is left out and estimated, in words."""
    case = parse_case(text, name=name)
    if in_casing:
        text, findings = case_in_casing(case, text, name)
    else:
        written = gearbox_of_case(case)
        text, findings = case_text.write(written.tables), written.findings
        parse_case(text, name=name)
    return text, [finding.text for finding in findings]


def _ended_script(folder: Path) -> str:
    """Script that takes no text too long, and says what to do where the server of a folder has ended."""
    command = escape(f"femgear app {shlex.quote(str(folder))}")
    data = f'data-command="{command}" data-longest="{MOST_TEXT}"'
    return f"<script {data}>\n{_ENDED.read_text('utf-8')}</script>"
