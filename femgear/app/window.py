"""The window of the app: form, text, sliders and answers of one case, and the runs of a folder."""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import count
from pathlib import Path
from typing import Any

from nicegui import background_tasks, events, ui

from femgear.app.dialogs import NewCase, ask_import, ask_name, ask_new, file_name
from femgear.app.document import entry_of, tables_of_text
from femgear.app.fields import Form, label_of, words
from femgear.app.form import Entry, Slider, Table, keys_of, shown_value, slider_of, table_of_schema, usual_keys
from femgear.app.runs import serve_runs
from femgear.app.session import SUFFIX, Session, case_files, result_folders
from femgear.app.worker import Worker, WorkerError, serve_bench
from femgear.errors import FemgearError
from femgear.trains.reading import case_schema

_CSS = """
.nicegui-content { padding: 0; gap: 0; }
.q-header .q-field__label { color: #fff; opacity: 1; }
.hint { font-size: 0.75rem; opacity: 0.7; }
.absent > .q-expansion-item__container > .q-item { opacity: 0.6; }
.fold { font-weight: 600; padding-left: 4px; }
.more { font-size: 0.8rem; }
.explained { font-size: 0.8rem; max-width: 26rem; }
.said { font-size: 0.8rem; white-space: pre-wrap; overflow-wrap: anywhere; }
iframe { border: 0; width: 100%; flex: 1 1 auto; }
.q-field__messages { white-space: normal; line-height: 1.2; }
"""
_SCRIPT = """
<script>
window.femgearSend = (messages) => {
  const frame = document.querySelector("iframe.answers");
  if (frame) messages.forEach((message) => frame.contentWindow.postMessage(message, location.origin));
};
addEventListener("message", (event) => {
  if (event.origin === location.origin && event.data.femgear === "ready") emitEvent("femgear-ready");
});
</script>
"""
_KEPT_EVERY = 0.7
"""Between two looks after what is not saved [s]."""
_DRAGGED = 0.3
"""While one drags, an answer may take so long before the next one begins [s]."""
_LONGEST = 3.0
"""So long where nothing of it could be shown yet [s]."""
_LOOK = 0.05
"""Between two looks whether something changed [s]."""
_CHARTS_AT_FIRST = (
    *("static_transmission_error", "load_sharing", "contact_pattern", "order_spectrum", "sensor_spectra"),
    *("dynamic_spectrum", "campbell", "run_up_levels", "load_patterns", "mode_shapes", "spatial_mode_shapes"),
)
"""What is drawn before anybody chose: the first ones that there are."""
_MOST_AT_FIRST = 5
_FORMATS = {
    "csv": "tables, CSV",
    "xlsx": "tables, a workbook",
    "mat": "tables, MATLAB",
    "wav": "signals, WAV",
    "uff": "signals and modes, UFF",
}
"""Formats of an export, and what they are."""


@cache
def _form_table(model: str | None) -> Table:
    """Form of the files of a model, of planetary sets where it is None."""
    return table_of_schema(case_schema(model))


def _embedded(value: Any) -> Table | None:
    """Form of a case within a case, as the teeth of a stage; None of any other value."""
    if not isinstance(value, dict) or not isinstance(value.get("set"), dict):
        return None
    try:
        return _form_table(value.get("model"))
    except (FemgearError, TypeError):
        return None


class Window:
    """One window, of one browser: what it edits and computes is its own.

    Parameters
    ----------
    folder : path
        Of case files and results.
    cache : path, optional
        Folder of generated grids.
    """

    def __init__(self, folder: Path, cache: Path | None) -> None:
        self.session = Session(folder)
        self._bench = Worker(serve_bench, self.session.folder, cache)
        self._runs = Worker(serve_runs, self.session.folder)
        self._changed = asyncio.Event()
        self._shown_form: tuple[str | None, Any] | None = None
        self._seen: dict[str, Any] = {}
        self._gears: str = ""
        self._pins = dict[str, Slider]()
        # charts that each stage can draw, those that the user chose, and those that were chosen for him
        self._drawable = dict[str, list[str]]()
        # numbers of the results whose charts are drawn, by stage
        self._drawn = dict[str, int]()
        self._charts_chosen = list[str]()
        self._charts_offered = list[str]()
        # whether a slider made the latest change
        self._dragged = False
        self._ready = False
        self._outbox: list[dict[str, Any]] = []

    # what the window is made of

    async def build(self) -> None:
        """Build the page, and begin to answer."""
        ui.add_css(_CSS)
        ui.colors(primary="#005a9c", accent="#8a4b00", negative="#b00020", warning="#8a4b00")
        ui.add_head_html(_SCRIPT)
        ui.on("femgear-ready", self._answers_ready)
        self._head()
        with ui.splitter(value=30).classes("w-full").style("height: calc(100vh - 60px)") as splitter:
            with splitter.before, ui.column().classes("w-full h-full no-wrap gap-0"):
                self._editor()
            with splitter.after, ui.column().classes("w-full h-full no-wrap gap-0"):
                self._right()
        ui.timer(_KEPT_EVERY, self._keep)
        client = ui.context.client
        client.on_delete(self._close)
        self._task = background_tasks.create(self._work(), name="answers")
        files = case_files(self.session.folder)
        if files:
            self._open(files[0])
        else:
            self._new()

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
            ui.button("Run", icon="play_arrow", on_click=self._run_all).props("unelevated dense no-caps color=accent")

    def _editor(self) -> None:
        """The left side: form and text of the case, and what is wrong with it."""
        with ui.tabs().props("dense no-caps align=left") as tabs:
            form, text = ui.tab("Form"), ui.tab("Text")
        with ui.tab_panels(tabs, value=form).classes("w-full grow") as panels:
            panels.props("keep-alive")
            with ui.tab_panel(form).classes("p-2"):
                self._form = Form(self._change_entry, self._pin, _embedded)
            with ui.tab_panel(text).classes("p-0 h-full"):
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
                with ui.row().classes("w-full items-center gap-2 q-px-sm"):
                    self._charts = ui.select([], label="Charts", multiple=True, on_change=self._chosen_charts)
                    self._charts.props("dense options-dense use-chips").classes("grow")
                    self._listen = ui.switch("Listen", on_change=lambda: self._changed.set())
                self._sound = ui.row().classes("w-full items-center gap-2 q-px-sm")
                self._slider_place = ui.grid(columns="minmax(8rem, auto) 1fr minmax(6rem, auto) auto")
                self._slider_place.classes("w-full items-center gap-x-3 gap-y-0 q-px-sm")
                ui.element("iframe").classes("answers").props('src="/answers" title="Answers"')
            with ui.tab_panel(results).classes("p-0 h-full"), ui.column().classes("w-full h-full no-wrap gap-0"):
                self._results_bar()
        self._panels = panels

    def _results_bar(self) -> None:
        """Choice of a run, comparison of two, and progress of the one that is computed."""
        with ui.row().classes("w-full items-center gap-2 q-px-sm"):
            self._run = ui.select([], label="Run", on_change=lambda event: self._show_run(event.value))
            self._run.props("dense options-dense").classes("min-w-48")
            self._other = ui.select([], label="Compared with", multiple=True).props("dense options-dense use-chips")
            self._other.classes("min-w-48")
            ui.button("Compare", on_click=self._compare).props("flat dense no-caps")
            with ui.button("Export", icon="download").props("flat dense no-caps"), ui.menu():
                for form, words_of_form in _FORMATS.items():
                    ui.menu_item(words_of_form, on_click=partial(self._export, form))
        with ui.row().classes("w-full items-center gap-2 q-px-sm") as self._progress_row:
            self._progress_text = ui.label()
            self._progress = ui.linear_progress(value=0.0, show_value=False).classes("grow").props("instant-feedback")
            ui.button("Cancel", icon="cancel", on_click=self._cancel).props("flat dense no-caps")
        self._progress_row.visible = False
        self._report = ui.element("iframe").classes("report").props('title="Report"')

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
        self._begin(f"{name}: changes that were not saved are back" if unsaved else "")

    def _begin(self, said: str) -> None:
        """Show another case from its beginning."""
        self._shown_form, self._gears, self._pins = None, "", dict[str, Slider]()
        self._drawable, self._drawn, self._charts_chosen = {}, {}, list[str]()
        self._send([{"what": "clear"}])
        self._list_files()
        self._text_changed()
        if said:
            self._notify(said)

    def _list_files(self) -> None:
        names = case_files(self.session.folder)
        names = sorted({*names, self.session.name} - {""})
        self._files.set_options(names, value=self.session.name or None)
        runs = result_folders(self.session.folder)
        self._run.set_options(runs, value=self._run.value if self._run.value in runs else None)
        self._other.set_options(runs, value=[name for name in self._other.value or () if name in runs])

    def _change_entry(self, key: str, value: Any) -> None:
        """Take a change from a field or a slider."""
        try:
            self.session.change(key, value)
        except FemgearError as error:
            self._notify(str(error), "negative")
            return
        self._text_changed(by_form=not key.endswith("]") and not _in_list(key, self._shown_form))

    def _typed(self, event: events.ValueChangeEventArguments) -> None:
        """Take a change from the text."""
        if event.value == self.session.text or event.value is None:
            return
        try:
            self.session.replace(event.value)
        except FemgearError as error:
            self._notify(str(error), "negative")
            return
        self._text_changed(by_text=True)

    def _text_changed(self, *, by_form: bool = False, by_text: bool = False) -> None:
        """Show a changed text everywhere but where it was changed, and ask for an answer to it."""
        if not by_text:
            self._text.value = self.session.text
        if not by_form:
            self._show_form()
        self._show_state()
        self._changed.set()

    def _show_form(self) -> None:
        """Draw the form of the text as it stands, where it can be read."""
        try:
            tables = tables_of_text(self.session.text)
        except FemgearError:
            return  # what is wrong is said once the text was looked at
        model = tables.get("model") if isinstance(tables.get("model"), str) else None
        try:
            table = _form_table(model)
        except FemgearError:
            return
        if self._shown_form == (model, tables):
            return
        self._shown_form = (model, tables)
        self._form.show(table, tables)
        self._form.say(self._seen.get("problems", ()), self._seen.get("findings", ()), self._seen.get("values", {}))
        self._show_sliders(tables)

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
        self._text_changed()

    def _save(self) -> None:
        try:
            self.session.save()
        except FemgearError as error:
            self._notify(str(error), "negative")
        self._list_files()
        self._show_state()

    def _keep(self) -> None:
        """Write what is not saved beside the file, so that nothing is lost."""
        try:
            self.session.keep()
        except (FemgearError, OSError) as error:
            self._state.text = f"not kept: {error}"

    # sliders

    def _slider(self, key: str, tables: Any) -> Slider | None:
        """Slider of an entry of the tables of the case; as it was, where it still reaches."""
        part: Any = _form_table(tables.get("model"))
        value: Any = tables
        for name in key.replace("]", "").replace("[", ".").split("."):
            value = entry_of(value, f"[{name}]" if name.isdigit() else name)
            if not name.isdigit() and isinstance(part, Table):
                part = part.part(name)
                part = part if isinstance(part, Table) else _embedded(value) or part
        slider = slider_of(key, entry_of(tables, key), part if isinstance(part, Entry) else None)
        former = self._pins.get(key)
        if slider is None or former is None or former.unit != slider.unit:
            return slider
        return replace(former, value=slider.value) if former.low <= slider.value <= former.high else slider

    def _pin(self, key: str) -> None:
        """Show an entry as a slider."""
        tables = tables_of_text(self.session.text)
        value = entry_of(tables, key)
        keys = [f"{key}[{number}]" for number in range(len(value))] if isinstance(value, list) else [key]
        sliders = {of_value: slider for of_value in keys if (slider := self._slider(of_value, tables)) is not None}
        if not sliders:
            self._notify("only a single number can be dragged")
        self._pins |= sliders
        self._show_sliders(tables)

    def _show_sliders(self, tables: Any) -> None:
        """Draw the sliders anew, those of the usual entries where there are none."""
        if not self._pins:
            keys = list(keys_of(_form_table(tables.get("model")), tables, embedded=_embedded))
            listed = {key: row for key in keys if isinstance(row := entry_of(tables, key), list)}
            keys += [f"{key}[{number}]" for key, row in listed.items() for number in range(len(row))]
            self._pins = {key: slider for key in usual_keys(keys) if (slider := self._slider(key, tables)) is not None}
        self._pins = {key: slider for key in self._pins if (slider := self._slider(key, tables)) is not None}
        self._slider_place.clear()
        with self._slider_place:
            for slider in self._pins.values():
                self._draw_slider(slider)

    def _draw_slider(self, slider: Slider) -> None:
        """Draw a slider with its name and its value."""
        ui.label(label_of(slider.key)).classes("text-sm").tooltip(slider.key)
        moved = ui.slider(min=slider.low, max=slider.high, step=slider.step, value=slider.value)
        moved.props(f'dense aria-label="{slider.key}" data-slider="{slider.key}"')
        shown = ui.label(shown_value(slider.entry_value(slider.value))).classes("text-sm")

        def drag(event: events.GenericEventArguments) -> None:
            value = slider.entry_value(float(event.args))
            shown.text = shown_value(value)
            self._dragged = True
            self._change_entry(slider.key, value)

        moved.on("update:model-value", drag, throttle=0.05, leading_events=True)
        moved.on("change", self._show_form)

        def drop() -> None:
            del self._pins[slider.key]
            self._show_sliders(tables_of_text(self.session.text))

        ui.button(icon="close", on_click=drop).props(f'flat dense round size=xs aria-label="Remove {slider.key}"')

    # answers

    def _send(self, messages: list[dict[str, Any]]) -> None:
        """Send messages to the page of answers, which may not be there yet."""
        if self._ready:
            ui.run_javascript(f"femgearSend({json.dumps(messages)})") if ui.context.slot_stack else None
        else:
            self._outbox += messages

    def _answers_ready(self) -> None:
        self._ready = True
        messages, self._outbox = self._outbox, []
        if messages:
            self._send(messages)

    def _chosen_charts(self) -> None:
        """Draw the charts that were chosen, by the user or at first."""
        chosen: list[str] = list(self._charts.value or ())
        if chosen != self._charts_offered:
            self._charts_chosen = chosen
        self._drawn.clear()
        self._send([{"what": "keep", "names": chosen}])
        self._changed.set()

    async def _work(self) -> None:
        """Answer after every change, until the window is closed."""
        with self._slider_place.client:
            while True:
                await self._changed.wait()
                self._changed.clear()
                text, name = self.session.text, self.session.name
                dragged, self._dragged = self._dragged, False
                if not name:
                    continue
                try:
                    await self._answer(text, name, dragged)
                except WorkerError as error:
                    self._drawn.clear()  # another process numbers its results anew
                    self._send([{"what": "end", "text": str(error)}])

    async def _answer(self, text: str, name: str, dragged: bool) -> None:
        """Look at a text, and compute what it can answer: of one that a slider makes first a draft."""
        start = time.perf_counter()
        async for seen in self._bench.ask("look", text, name):
            if name == self.session.name:
                self._show_seen(seen)
        if name != self.session.name:
            return
        if self._seen["problems"]:
            self._send([{"what": "end", "text": "The case is refused: see what is wrong below the form."}])
            return
        self._send([{"what": "begin"}])
        if not self._gears:
            await self._show_gears(text, name)
        shown, stages = list(self._charts.value or ()), [stage["name"] for stage in self._seen["stages"]]
        drafted = dragged and await self._draft(text, name, shown)
        if self._changed.is_set() and drafted:
            return
        parts = self._bench.ask("answer", text, name, shown, stages, dict(self._drawn))
        drawn = False

        def superseded() -> bool:
            """Whether something changed, and this answer has had its time."""
            patience = 0.0 if drafted else _DRAGGED if drawn else _LONGEST
            return self._changed.is_set() and time.perf_counter() - start > patience

        while (part := await self._next(parts, superseded)) is not None:
            if name != self.session.name:
                return
            self._show_part(part)
            drawn = drawn or not part["same"]
        if self._changed.is_set():
            return
        await self._rest(text, name, start)

    async def _draft(self, text: str, name: str, shown: Sequence[str]) -> bool:
        """Show what few positions say, which counts until the whole answer is there; tells whether there was need."""
        drafted = False
        async for part in self._bench.ask("draft", text, name, shown, dict(self._drawn)):
            if name != self.session.name:
                return True
            self._show_part(part)
            self._send([{"what": "draft", "positions": part["positions"]}])
            drafted = True
        return drafted

    async def _rest(self, text: str, name: str, start: float) -> None:
        """Let the case be heard and describe it, once all numbers are there."""
        self._send([{"what": "end", "seconds": time.perf_counter() - start}])
        await self._show_gears(text, name)
        async for blocks in self._bench.ask("tables", text, name):
            self._send([{"what": "tables", "blocks": blocks}])
        if self._listen.value and not self._changed.is_set():
            async for sound in self._bench.ask("sound", text, name):
                self._show_sound(sound)
        elif not self._listen.value:
            self._sound.clear()

    async def _show_gears(self, text: str, name: str) -> None:
        """Show the gears in space where they have changed."""
        async for model in self._bench.ask("gears", text, name):
            if name == self.session.name and (drawing := json.dumps(model)) != self._gears:
                self._gears = drawing
                self._send([{"what": "space", "model": model}])

    async def _next(self, parts: Any, superseded: Callable[[], bool]) -> dict[str, Any] | None:
        """Next part of an answer; None at its end, and where it is superseded."""
        waiting = asyncio.ensure_future(anext(parts, None))
        while not waiting.done():
            await asyncio.wait({waiting}, timeout=_LOOK)
            if not waiting.done() and superseded():
                waiting.cancel()
                return None
        return None if superseded() else waiting.result()

    def _show_seen(self, seen: dict[str, Any]) -> None:
        """Show what is said of a text, beside its fields and below."""
        self._seen = seen
        self._form.say(seen["problems"], seen["findings"], seen["values"])
        self._said.clear()
        with self._said:
            for problem in seen["problems"]:
                self._line("error", "negative", problem)
            for finding in seen["findings"]:
                self._line("warning", "warning", finding)
        if seen["problems"]:
            return
        self._offer_charts()

    def _offer_charts(self) -> None:
        """Offer the charts of all stages, and choose some where nobody has chosen."""
        stages = self._seen["stages"]
        names = [name for stage in stages for name in self._drawable.get(stage["name"]) or stage["charts"]]
        usual = [name for name in (*_CHARTS_AT_FIRST, *self._seen["front"]) if name in names]
        kept = [name for name in self._charts_chosen if name in names]
        chosen = kept or list(dict.fromkeys(usual))[:_MOST_AT_FIRST]
        options = {name: words(name) for name in names}
        if self._charts.options != options or self._charts.value != chosen:
            self._charts_offered = chosen
            self._charts.set_options(options, value=chosen)

    def _line(self, icon: str, colour: str, said: Mapping[str, str]) -> None:
        with ui.row().classes("items-start no-wrap gap-1"):
            ui.icon(icon, color=colour).classes("text-base")
            limit = f"\nallowed: {said['limit']}" if said.get("limit") else ""
            remedy = f"\nremedy: {said['remedy']}" if said.get("remedy") else ""
            code = f" [{said['code']}]" if said.get("code") else ""
            key = f"{said['key']}: " if said.get("key") else ""
            ui.label(f"{key}{said['text']}{code}{limit}{remedy}").classes("said")

    def _show_part(self, part: dict[str, Any]) -> None:
        """Show what became known with a stage."""
        messages: list[dict[str, Any]] = [{"what": "fresh", "stage": part["stage"]}]
        if part["sentence"] is not None:
            messages.append({"what": "judge", "sentence": part["sentence"], "judgements": part["judgements"]})
        if part["charts"]:
            given = {name: part[name] for name in ("stage", "charts", "captions")}
            messages.append({"what": "draw"} | given)
        self._send(messages)
        self._drawn[part["stage"]] = part["number"]
        if part["names"] is not None and self._drawable.get(part["stage"]) != part["names"]:
            self._drawable[part["stage"]] = part["names"]
            self._offer_charts()

    def _show_sound(self, sound: dict[str, Any] | None) -> None:
        self._sound.clear()
        with self._sound:
            if sound is None:
                ui.label("This kind of case has nothing to hear; femgear gearbox makes a gearbox of it.").classes(
                    "hint"
                )
                return
            ui.label(f"{words(sound['name'])}, largest {sound['largest']:.3g} {sound['unit']}").classes("hint")
            ui.audio(f"data:audio/wav;base64,{sound['wav']}", autoplay=True, loop=True).classes("h-8")

    def _notify(self, text: str, kind: Any = "info") -> None:
        ui.notify(text, type=kind, multi_line=True, classes="said", timeout=6000, close_button="Close")

    # new cases, runs

    def _new(self) -> None:
        ask_new(self._free_name, self._make)

    async def _make(self, case: NewCase) -> bool:
        """Make a new case and show it; tells whether that was possible."""
        try:
            async for text in self._runs.ask("new", case.kind, case.numbers | {"teeth": case.teeth}):
                self.session.begin(case.name, text)
                self.session.change_all(case.rating)
        except (WorkerError, FemgearError) as error:
            self._notify(str(error), "negative")
            return False
        self._begin("")
        return True

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

    def _saved_as(self, name: str) -> bool:
        """Save under another name; tells whether that was possible."""
        try:
            self.session.save_as(file_name(name))
        except (FemgearError, OSError) as error:
            self._notify(str(error), "negative")
            return False
        self._list_files()
        self._show_state()
        return True

    def _run_all(self) -> None:
        """Ask where the results of a run go, and compute it."""
        if self.session.name:
            stem, taken = self.session.name.removesuffix(SUFFIX), set(result_folders(self.session.folder))
            free = next(name for number in count(1) if (name := f"{stem}_{number}") not in taken)
            title = "Compute everything, with pictures and report"
            ask_name(title, "Folder of the results", free, "Run", self._compute)

    async def _compute(self, output: str) -> None:
        """Run the case, show how far it is, and then its report."""
        if self._progress_row.visible:
            self._notify("a run is being computed: wait for it, or cancel it", "negative")
            return
        self._tabs.value = "Results"
        self._progress_row.visible, self._progress.value, self._progress_text.text = True, 0.0, "begins"
        try:
            async for progress in self._runs.ask("run", self.session.text, self.session.name, output, True):
                if "done" in progress:
                    share = progress["done"] / progress["total"] if progress["total"] else 0.0
                    self._progress.value, self._progress_text.text = share, f"{words(progress['stage'])}"
                else:
                    self._list_files()
                    self._run.value = output
        except WorkerError as error:
            self._notify(str(error), "negative")
        self._progress_row.visible = False

    def _cancel(self) -> None:
        """End a run; what it has computed so far is taken up by the next run of the same case."""
        self._runs.stop()

    def _show_run(self, name: str | None) -> None:
        if name:
            self._report.props(f'src="/results/{name}/report.html"')

    async def _compare(self) -> None:
        """Show some runs beside one another."""
        others = [name for name in self._other.value or () if name != self._run.value]
        if not self._run.value or not others:
            self._notify("choose a run, and others that it is compared with")
            return
        try:
            async for page in self._runs.ask("compare", *others, self._run.value):
                self._report.props(f'src="/results/{page}"')
        except WorkerError as error:
            self._notify(str(error), "negative")

    async def _export(self, form: str) -> None:
        """Write the run that is shown as files of a format."""
        if not self._run.value:
            self._notify("choose a run")
            return
        try:
            async for written in self._runs.ask("export", self._run.value, [form]):
                if isinstance(written, list):
                    self._notify(f"in {self._run.value}/exported: {', '.join(written)[:400]}")
        except WorkerError as error:
            self._notify(str(error), "negative")

    def _close(self) -> None:
        """End what the window has begun."""
        self._task.cancel()
        try:
            self.session.keep()
        finally:
            self._bench.stop()
            self._runs.stop()


def _in_list(key: str, form: Any) -> bool:
    """Whether the change of an entry adds a table to a list, which the form has to draw."""
    if form is None or "]" not in key:
        return False
    return entry_of(form[1], key.rpartition("]")[0] + "]") is None
