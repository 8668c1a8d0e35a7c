"""Answers to the case as it stands: charts and cards that follow while one types and drags, and what is heard."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Sequence
from typing import Any

from nicegui import background_tasks, ui

from femgear.app.fields import words
from femgear.app.form import in_window
from femgear.app.session import Session
from femgear.app.worker import Worker, WorkerError

ANSWERS_SCRIPT = """
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
"""Of the window: passes messages to the page of answers."""
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


class AnswersPanel:
    """Choice of charts, switch of the sound, and the page on which answers appear.

    Parameters
    ----------
    session : Session
        Whose text is answered.
    bench : Worker
        That computes the answers, of `femgear.app.worker.serve_bench`.
    seen : callable
        Called with what `femgear.app.bench.Bench.look` says of a text.
    """

    def __init__(self, session: Session, bench: Worker, seen: Callable[[dict[str, Any]], None]) -> None:
        self._session, self._bench, self._tell_seen = session, bench, seen
        self._client = ui.context.client
        self._changed, self._ready = asyncio.Event(), False
        self._outbox: list[dict[str, Any]] = []
        # whether a slider made the latest change
        self._dragged = False
        # when what is answered was asked for; charts that are chosen meanwhile ask for no other answer
        self._asked_at: float | None = None
        with ui.row().classes("w-full items-center gap-2 q-px-sm"):
            self._charts = ui.select([], label="Charts", multiple=True, on_change=self._chosen_charts)
            self._charts.props("dense options-dense use-chips").classes("grow")
            self._listen = ui.switch("Listen", on_change=lambda: self._changed.set())
        self._sound = ui.row().classes("w-full items-center gap-2 q-px-sm")
        self._forget()

    def _forget(self) -> None:
        """Forget all that is known of the former case."""
        self._seen, self._gears = dict[str, Any](), ""
        # charts that each stage can draw, those that the user chose, and those that were chosen for him
        self._drawable, self._charts_chosen = dict[str, list[str]](), list[str]()
        self._charts_offered = list[str]()
        # numbers of the results whose charts are drawn, by stage
        self._drawn = dict[str, int]()

    def frame(self) -> None:
        """Put the page of answers here, and begin to answer."""
        ui.on("femgear-ready", self._answers_ready)
        ui.element("iframe").classes("answers").props('src="/answers" title="Answers"')
        self._task = background_tasks.create(self._work(), name="answers")

    def begin(self) -> None:
        """Begin with another case."""
        self._forget()
        self._send([{"what": "clear"}])

    def ask(self, *, dragged: bool = False) -> None:
        """Ask for an answer to a changed text, which a slider may have changed."""
        self._dragged = dragged
        self._asked_at = time.perf_counter()
        self._changed.set()

    def stop(self) -> None:
        """End to answer."""
        self._task.cancel()

    def _send(self, messages: list[dict[str, Any]]) -> None:
        """Send messages to the page of answers, which may not be there yet."""
        if self._ready:
            self._client.run_javascript(f"femgearSend({json.dumps(messages)})")
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
        with self._client:
            while True:
                await self._changed.wait()
                self._changed.clear()
                text, name = self._session.text, self._session.name
                dragged, self._dragged = self._dragged, False
                if not name:
                    continue
                try:
                    await self._answer(text, name, dragged)
                except WorkerError as error:
                    self._drawn.clear()  # another process numbers its results anew
                    self._end(text=str(error))

    async def _answer(self, text: str, name: str, dragged: bool) -> None:
        """Look at a text, and compute what it can answer: of one that a slider makes first a draft."""
        start = time.perf_counter()
        asked_at = self._asked_at = start if self._asked_at is None else self._asked_at
        if not self._seen:
            self._send([{"what": "begin", "text": "reading the case"}])
        async for seen in self._bench.ask("look", text, name):
            if name == self._session.name:
                self._seen = seen | {name: in_window(seen[name]) for name in ("problems", "findings")}
                self._tell_seen(self._seen)
                if not seen["problems"]:
                    self._offer_charts()
        if name != self._session.name or not self._seen:
            return
        if self._seen["problems"]:
            self._end(text="The case is refused: see what is wrong below the form.")
            return
        self._send([{"what": "begin", "since": time.perf_counter() - asked_at}])
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
            if name != self._session.name:
                return
            if self._show_step(part):
                continue
            self._show_part(part)
            drawn = drawn or not part["same"]
        if self._changed.is_set():
            return
        self._end(seconds=time.perf_counter() - asked_at)
        await self._rest(text, name)

    async def _draft(self, text: str, name: str, shown: Sequence[str]) -> bool:
        """Show what few positions say, which counts until the whole answer is there; tells whether there was need."""
        drafted = False
        async for part in self._bench.ask("draft", text, name, shown, dict(self._drawn)):
            if name != self._session.name:
                return True
            if self._show_step(part):
                continue
            self._show_part(part)
            self._send([{"what": "draft", "positions": part["positions"]}])
            drafted = True
        return drafted

    def _end(self, **said: float | str) -> None:
        """Say that an answer is at its end, and why or how long it took since it was asked for."""
        self._asked_at = None
        self._send([{"what": "end", **said}])

    async def _rest(self, text: str, name: str) -> None:
        """Let the case be heard and describe it, once all numbers are there."""
        await self._show_gears(text, name)
        async for blocks in self._bench.ask("tables", text, name):
            self._send([{"what": "tables", "blocks": in_window(blocks)}])
        if self._listen.value and not self._changed.is_set():
            async for sound in self._bench.ask("sound", text, name):
                self._show_sound(sound)
        elif not self._listen.value:
            self._sound.clear()

    async def _show_gears(self, text: str, name: str) -> None:
        """Show the gears in space where they have changed."""
        async for model in self._bench.ask("gears", text, name):
            if name == self._session.name and (drawing := json.dumps(model)) != self._gears:
                self._gears = drawing
                self._send([{"what": "space", "model": model}])

    async def _next(self, parts: Any, superseded: Callable[[], bool]) -> dict[str, Any] | None:
        """Next part of an answer; None at its end, and where it is superseded."""
        waiting = asyncio.ensure_future(anext(parts, None))
        try:
            while not waiting.done():
                await asyncio.wait({waiting}, timeout=_LOOK)
                if not waiting.done() and superseded():
                    return None
            return None if superseded() else waiting.result()
        finally:
            # an answer that nobody waits for any more fails in silence
            waiting.cancel()
            waiting.add_done_callback(lambda ended: ended.cancelled() or ended.exception())

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

    def _show_step(self, part: dict[str, Any]) -> bool:
        """Show which step is computed, where a part of an answer says that alone; tells whether it does."""
        if "computing" not in part:
            return False
        share = f", {part['done']:.0f} of {part['total']:.0f}" if part["total"] > 1.0 else ""
        self._send([{"what": "step", "text": f"computing: {words(part['computing']).lower()}{share}"}])
        return True

    def _show_part(self, part: dict[str, Any]) -> None:
        """Show what became known with a stage."""
        messages: list[dict[str, Any]] = [{"what": "fresh", "stage": part["stage"]}]
        if part["sentence"] is not None:
            judged = {name: part[name] for name in ("duty", "sentence", "judgements")}
            messages.append({"what": "judge"} | in_window(judged))
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
                hint = "This kind of case has nothing to hear: femgear casing gives it a casing with sensors."
                ui.label(in_window(hint)).classes("hint")
                return
            ui.label(f"{words(sound['name'])}, largest {sound['largest']:.3g} {sound['unit']}").classes("hint")
            ui.audio(f"data:audio/wav;base64,{sound['wav']}", autoplay=True, loop=True).classes("h-8")
