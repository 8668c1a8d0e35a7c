"""What the app computes of a case while one types and drags: reading, gears in space, stages, charts, sound.

It works in a process of its own (`femgear.app.worker`), which gives up an answer as soon as a newer text waits.
"""

from __future__ import annotations

import base64
import gc
import io
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from femgear.app.document import tables_of_text
from femgear.case.dependencies import Steps
from femgear.case.sections import StaticSection
from femgear.errors import CaseError, FemgearError, StorageError
from femgear.exchange.sampling import Sampling
from femgear.findings import as_data, by_severity
from femgear.report.charts import chart
from femgear.report.space import space
from femgear.report.style import png_bytes
from femgear.stages.protocol import Drawn, Stage, Train, one_blas_thread
from femgear.storage.results import Results
from femgear.trains.live import Answer
from femgear.trains.reading import parse_comparable
from femgear.trains.registry import check_case, stages_of, train_of
from femgear.trains.shown import results_in_memory

LISTENED = 2.0
"""Duration of the sound [s], whose end goes on with its beginning as well as whole turns let it."""
DRAFT_POSITIONS = 24
"""Positions of a mesh period, at most, of an answer that the next one may replace at once."""
_HEADROOM = 4.0
"""Full scale of the sound over the largest sample of the first one: later ones may be louder."""


_TOLD_EVERY = 0.3
"""Between two words on the progress of a step [s]."""


class Superseded(Exception):
    """A newer text waits: the answer to this one is not wanted any more."""


class Bench:
    """A case that answers texts; what a change leaves as it was is kept.

    Parameters
    ----------
    folder : path
        Of the case file, in which files are that it names.
    cache : path, optional
        Folder of generated grids.
    waiting : callable
        Whether a newer text waits, which ends the answer that is being computed.
    tell : callable
        Called with ``{"computing", "done", "total"}`` while an answer is computed: title of the stage, or name of a
        step of it, and steps.
    """

    def __init__(
        self,
        folder: Path,
        *,
        cache: Path | None = None,
        waiting: Callable[[], bool] = lambda: False,
        tell: Callable[[dict[str, Any]], None] = lambda progress: None,
    ) -> None:
        self.folder, self._cache, self._waiting, self._tell = folder, cache, waiting, tell
        self._last_told, self._titles = ("", 0.0), dict[str, str]()
        self._steps, self._seconds = Steps(), dict[str, float]()
        self._read: tuple[tuple[str, str], Any] | None = None
        self._latest = dict[str, tuple[Any, int]]()
        self._full_scale = 0.0

    def look(self, text: str, name: str) -> dict[str, Any]:
        """Read a text, and say what is wrong with it or worth a look, by entry.

        Parameters
        ----------
        text : str
            Of a case file.
        name : str
            Of the file, for messages.

        Returns
        -------
        dict
            ``train`` and ``words`` of the case, its ``model`` if its files name one, ``title``, ``problems`` and
            ``findings`` as tables of text, ``values`` in SI units by the key of the entry, ``stages`` of a whole run,
            each with the names of its ``charts``, and ``front``, the names of those of page one.
        """
        seen: dict[str, Any] = {
            **{"train": "", "words": "", "model": _model_of(text), "title": ""},
            **{"problems": [], "findings": [], "values": {}, "stages": [], "front": []},
        }
        try:
            case = self._case(text, name)
        except (FemgearError, OSError) as error:
            return seen | {"problems": _problems(error)}
        train = train_of(case)
        seen |= {"train": train.name, "words": train.words, "title": case.title}
        seen["values"] = dict(_values(case.model_dump()))
        try:
            check_case(case)
            seen["findings"] = as_data(by_severity(train.case_warnings(case)))
            seen["front"] = [name for name, _ in train.front]
            captions = {name: list(figures.captions) for name, figures in train.figures.items()}
            seen["stages"] = [
                {"name": stage.name, "title": stage.title, "charts": captions.get(stage.name, [])}
                for stage in stages_of(case)
            ]
        except FemgearError as error:
            seen["problems"] = _problems(error)
        return seen

    def _computing(self, step: str, done: float = 0.0, total: float = 1.0) -> None:
        """Tell what is computed where that is another step, and how far it is now and then; or give up."""
        self._go_on()
        step = self._titles.get(step, step)
        former, at = self._last_told
        if step != former or time.perf_counter() - at > _TOLD_EVERY:
            self._last_told = step, time.perf_counter()
            self._tell({"computing": step, "done": float(done), "total": float(total)})

    def tables(self, text: str, name: str) -> list[dict[str, Any]]:
        """Describe a case in tables, as ``femgear check`` does."""
        case = self._case(text, name)
        return [asdict(block) for block in train_of(case).describe(case)]

    def gears(self, text: str, name: str) -> dict[str, Any] | None:
        """Draw the bodies of a case in space, as `femgear.report.space` does; None where there is nothing to draw."""
        case = self._case(text, name)
        bodies = train_of(case).bodies
        drawn = [] if bodies is None else list(bodies(case))
        if not drawn:
            return None
        members = [body.member for body in drawn]
        place = np.array([[*body.axis, 0.5 * sum(body.ends)] for body in drawn])
        return space(drawn, members, place, ())

    def answer(
        self, text: str, name: str, shown: Sequence[str], stages: Sequence[str], seen: Mapping[str, int] = {}
    ) -> Iterator[dict[str, Any]]:
        """Compute stages of a case, the quickest ones first, and yield what is known after each.

        Parameters
        ----------
        text, name : str
            Of the case file.
        shown : sequence of str
            Charts that are wanted, by the beginning of their names.
        stages : sequence of str
            Names of the stages that are wanted.
        seen : mapping of str to int
            Numbers of the results whose charts are there already, by stage: they are not drawn again.

        Yields
        ------
        dict
            ``stage``, ``number`` of its result, ``same``, whether that is there already, ``seconds`` that it took,
            ``charts`` and ``captions`` by name, ``names`` of all that it has, None where that is not known,
            ``duty``, ``sentence`` and ``judgements`` of page one as far as they are known, no sentence where others
            follow one that is the ``same``, and ``findings``.

        Raises
        ------
        FemgearError
            A case that is refused, or cannot be computed.
        Superseded
            A newer text waits.
        """
        yield from self._parts(self._case(text, name), shown, stages, seen)

    def draft(self, text: str, name: str, shown: Sequence[str], seen: Mapping[str, int] = {}) -> Iterator[dict]:
        """Compute the static solution of a case at few positions, for the time until the whole answer is there.

        Nothing where the whole solution is known, or the case has none. Arguments, parts and errors are those of
        `answer`; every part has the number of ``positions`` besides.
        """
        case = self._case(text, name)
        static = getattr(case, "static", None)
        if not isinstance(static, StaticSection) or not Answer(case, self._steps).unknown().get("static"):
            return
        few = {"positions": min(static.positions, DRAFT_POSITIONS), "peaks": False}
        coarse = case.model_copy(update={"static": static.model_copy(update=few)})
        for part in self._parts(coarse, shown, ["static"], seen):
            yield part | {"positions": few["positions"]}

    def _parts(
        self, case: Any, shown: Sequence[str], stages: Sequence[str], seen: Mapping[str, int]
    ) -> Iterator[dict[str, Any]]:
        """Parts of an `answer` to a case."""
        check_case(case)
        train, of_run = train_of(case), {stage.name: stage for stage in stages_of(case)}
        answer = Answer(case, self._steps, cache=self._cache, progress=self._computing)
        self._titles = {stage.name: stage.title for stage in train.stages}
        computed = dict[str, Any]()
        wanted = [of_run[key] for key in of_run if key in stages]
        taken = {name for stage in wanted for name in stage.before(case)}
        # first what others go on from, then the quickest
        seconds = {stage.name: 0.0 if stage.name in taken else self._seconds.get(stage.name, 1.0) for stage in wanted}
        with _uncollected():
            for stage in (ordered := sorted(wanted, key=lambda stage: seconds[stage.name])):
                self._computing(stage.title)
                start = time.perf_counter()
                computed[stage.name] = answer[stage.name]
                results = results_in_memory(case, computed, self.folder)
                number = self._number(stage.name, computed[stage.name])
                same = seen.get(stage.name) == number
                drawings = self._drawings(train, stage, results, computed, () if same else shown)
                # what is there already is judged once, with the last stage
                judged = not same or stage is ordered[-1]
                sentence, judgements = train.summary(results) if judged else (None, ())
                self._seconds[stage.name] = max(self._seconds.get(stage.name, 0.0), time.perf_counter() - start)
                yield {
                    "stage": stage.name,
                    "seconds": time.perf_counter() - start,
                    "number": number,
                    "same": same,
                    **drawings,
                    "duty": train.duty(case),
                    "sentence": sentence,
                    "judgements": [asdict(judgement) | {"words": judgement.words} for judgement in judgements],
                    "findings": as_data(by_severity(results.findings)),
                }

    def sound(self, text: str, file: str) -> dict[str, Any] | None:
        """Sample what the first sensor of a case hears at its first speed; None where there is nothing to hear.

        Returns
        -------
        dict
            ``name`` and ``unit`` of the signal, its ``largest`` value, and ``wav``, whose full scale stays that of the
            first sound, so that louder is heard as louder.
        """
        from scipy.io import wavfile

        case = self._case(text, file)
        train = train_of(case)
        if train.recorded is None:
            return None
        answer, computed = Answer(case, self._steps, cache=self._cache, progress=self._go_on), dict[str, Any]()
        with one_blas_thread():
            for name in train.recorded.needs["wav"]:
                stage = train.stage(name)
                if stage is None or stage.unavailable(case):
                    return None
                computed[name] = answer[name]
        results = results_in_memory(case, computed, self.folder)
        signal = next((s for s in train.recorded.signals(results, Sampling(duration=LISTENED)) if s.steady), None)
        if signal is None:
            return None
        largest = float(np.abs(signal.values).max(initial=0.0))
        self._full_scale = self._full_scale or _HEADROOM * largest or 1.0
        stream = io.BytesIO()
        share = np.clip(signal.values / self._full_scale, -1.0, 1.0)
        wavfile.write(stream, signal.rate, np.round(32767 * share).astype(np.int16))
        wav = base64.b64encode(stream.getvalue()).decode("ascii")
        return {"name": signal.name, "unit": signal.unit, "largest": largest, "wav": wav}

    def _case(self, text: str, name: str) -> Any:
        """Read a case, which several questions are asked about."""
        if self._read is None or self._read[0] != (text, name):
            # a speed that is dragged away from a published line is answered, without the line
            self._read = (text, name), parse_comparable(text, name=str(self.folder / name))
        return self._read[1]

    def _number(self, stage: str, result: Any) -> int:
        """Number of a result of a stage, another one for every other result."""
        latest, number = self._latest.get(stage, (None, 0))
        if result is not latest:
            number += 1
            self._latest[stage] = result, number
        return number

    def _go_on(self, *_: object) -> None:
        """Give up where a newer text waits."""
        if self._waiting():
            raise Superseded

    def _drawings(
        self, train: Train, stage: Stage, results: Results, computed: Mapping[str, Any], shown: Sequence[str]
    ) -> dict[str, Any]:
        """Draw the charts of a stage that are wanted, and name all of them."""
        from femgear.report.page import caption_of

        figures = train.figures.get(stage.name)
        if figures is None:
            return {"charts": {}, "names": None, "captions": {}}
        names = list(figures.captions)
        wanted = [name for name in names if name in shown]
        if not wanted:
            return {"charts": {}, "names": None, "captions": {}}
        data = {key: results[key] for key in computed}
        drawn = figures.draw(Drawn(results.case, data, computed, self._cache))
        chosen = [key for key in drawn if any(key == name or key.startswith(f"{name}_") for name in wanted)]
        figures_of = {key: drawn[key] for key in chosen}
        # what a browser's chart cannot hold is a picture
        charts = {key: chart(figure) or {"png": _picture(figure)} for key, figure in figures_of.items()}
        there = [name for name in names if any(key == name or key.startswith(f"{name}_") for key in drawn)]
        return {"charts": charts, "names": there, "captions": {key: caption_of(train, key)[2] for key in charts}}


@contextmanager
def _uncollected() -> Iterator[None]:
    """Leave garbage where it is: looking for it takes a quarter of an answer, as figures are full of cycles."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _picture(figure: Any) -> str:
    """Draw a figure as PNG, in base64."""
    return base64.b64encode(png_bytes(figure)).decode("ascii")


def _model_of(text: str) -> str | None:
    """Model that a text names, whatever else is wrong with it; None of planetary sets, and where it is no TOML."""
    try:
        model = tables_of_text(text).get("model")
    except CaseError:
        return None
    return model if isinstance(model, str) else None


def _problems(error: Exception) -> list[dict[str, str]]:
    """Tables of text of all that a case is refused for."""
    parts = getattr(error, "problems", ()) or (error,)
    return [
        {
            "key": str(getattr(part, "key", None) or ""),
            "code": str(getattr(part, "code", StorageError.default_code)),
            "text": str(getattr(part, "message", part)),
            "limit": str(getattr(part, "limit", None) or ""),
            "remedy": str(getattr(part, "remedy", None) or ""),
        }
        for part in parts
    ]


def _values(section: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and words of a case by the keys of their entries, in SI units."""
    if isinstance(section, Mapping):
        for name, value in section.items():
            yield from _values(value, f"{key}.{name}".lstrip("."))
    elif isinstance(section, (bool, str)) or (isinstance(section, (int, float)) and math.isfinite(section)):
        yield key, section
    elif isinstance(section, (tuple, list)):
        for number, value in enumerate(section):
            if isinstance(value, Mapping):
                yield from _values(value, f"{key}[{number}]")
