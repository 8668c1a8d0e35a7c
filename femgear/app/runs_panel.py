"""Runs of the cases of a folder: which one is shown, how far one that is computed has come, comparisons, exports."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from itertools import count

from nicegui import ui

from femgear.app.dialogs import ask_name
from femgear.app.fields import words
from femgear.app.session import SUFFIX, Session, result_folders
from femgear.app.worker import Worker, WorkerError, WorkerStopped

_FORMATS = {
    "csv": "tables, CSV",
    "xlsx": "tables, a workbook",
    "mat": "tables, MATLAB",
    "wav": "signals, WAV",
    "uff": "signals and modes, UFF",
}
"""Formats of an export, and what they are."""


class RunsPanel:
    """Choice of a run, comparison of several, progress of the one that is computed, and the report.

    Parameters
    ----------
    session : Session
        Whose case is computed.
    runs : Worker
        That computes, of `femgear.app.runs.serve_runs`.
    notify : callable
        ``(text, kind)``, shows a message.
    show : callable
        Called before a run is computed, to have this panel seen.
    """

    def __init__(self, session: Session, runs: Worker, notify: Callable[..., None], show: Callable[[], None]) -> None:
        self._session, self._runs, self._notify, self._show = session, runs, notify, show
        self._closed = False
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
            ui.button("Cancel", icon="cancel", on_click=self._runs.stop).props("flat dense no-caps")
        self._progress_row.visible = False
        self._none_yet = ui.label("No run yet: the button Run computes everything, with pictures and a report.")
        self._none_yet.classes("hint q-pa-md")
        self._report = ui.element("iframe").classes("report").props('title="Report"')

    def list_runs(self) -> None:
        """Offer the runs that the folder holds now."""
        runs = result_folders(self._session.folder)
        self._none_yet.visible = not runs
        self._run.set_options(runs, value=self._run.value if self._run.value in runs else None)
        self._other.set_options(runs, value=[name for name in self._other.value or () if name in runs])

    def ask_run(self) -> None:
        """Ask where the results of a run go, and compute it."""
        if self._session.name:
            stem, taken = self._session.name.removesuffix(SUFFIX), set(result_folders(self._session.folder))
            free = next(name for number in count(1) if (name := f"{stem}_{number}") not in taken)
            title = "Compute everything, with pictures and report"
            ask_name(title, "Folder of the results", free, "Run", self._compute)

    async def _compute(self, output: str) -> None:
        """Run the case, show how far it is, and then its report."""
        if self._progress_row.visible:
            self._notify("a run is being computed: wait for it, or cancel it", "negative")
            return
        self._show()
        self._progress_row.visible, self._progress.value, self._progress_text.text = True, 0.0, "begins"
        try:
            async for progress in self._runs.ask("run", self._session.text, self._session.name, output, True):
                if "done" in progress:
                    share = progress["done"] / progress["total"] if progress["total"] else 0.0
                    self._progress.value, self._progress_text.text = share, f"{words(progress['stage'])}"
                else:
                    self.list_runs()
                    self._run.value = output
        except WorkerStopped:
            print(f"femgear app: the run into {output} was cancelled", file=sys.stderr, flush=True)
            if self._closed:
                return
            self._notify("The run was cancelled. Run goes on from what is computed, in the same folder.")
        except WorkerError as error:
            self._notify(str(error), "negative")
        self._progress_row.visible = False

    def stop(self) -> None:
        """End what is computed, as the window is closed."""
        self._closed = True
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
