"""What a train is to the run, the report and the command line: stages, their results, figures and words."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from femgear.case.dependencies import Entries, every_entry
from femgear.errors import FemgearError
from femgear.findings import by_severity, once
from femgear.moved import former_keywords
from femgear.report.tables import Block, listed
from femgear.stages.judgements import Judgement, describe_judgements, joined_sentence
from femgear.storage.contents import Contents, as_dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from threadpoolctl import ThreadpoolController

    from femgear.case.text import ReadCase
    from femgear.exchange.dynamic_model import DynamicModel
    from femgear.exchange.formats import Shapes, Signal, Spectrum
    from femgear.exchange.sampling import Sampling
    from femgear.findings import Finding
    from femgear.measured.heard_set import HeardSet
    from femgear.report.space import SpaceBody
    from femgear.stages.key_figures import KeyFigure
    from femgear.stages.wear import MeshingTeeth
    from femgear.storage.results import Results

Progress = Callable[[str, float, float], None]
"""Called with (stage, done, total)."""


def silent(stage: str, done: float, total: float) -> None:
    """Tell nobody how far a stage has come."""


def counting_on(progress: Progress, stage: str) -> Callable[[float, float], None]:
    """Count the steps of rounds that follow one another on, so that a stage does not seem to begin anew.

    Parameters
    ----------
    progress : callable
        Called with (stage, steps of all rounds so far, and those with all steps of this round).
    stage : str

    Returns
    -------
    callable
        ``(done, total)`` of the round; one begins where nothing is done, which is told with its first step.
    """
    earlier_rounds = largest_done = 0.0

    def tell(done: float, total: float) -> None:
        nonlocal earlier_rounds, largest_done
        if done == 0:
            earlier_rounds, largest_done = earlier_rounds + largest_done, 0.0
            return
        largest_done = max(largest_done, done)
        progress(stage, earlier_rounds + largest_done, earlier_rounds + total)

    return tell


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """Find the libraries that have threads: milliseconds, spent again once more modules are loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit a block of code, or as ``@one_blas_thread()`` a function, to one BLAS thread.

    Several threads gain nothing on matrices of a few hundred rows, and wait for one another for many times
    the work as soon as other processes want the same cores.
    """
    solves = (np.linalg.solve, scipy.linalg.solve_triangular)  # SciPy brings a BLAS of its own
    with _libraries(len(sys.modules)).limit(limits=1):
        # OpenBLAS keeps the buffers that it takes now; where memory is short later, it would try without end
        for solve in solves:
            solve(np.eye(2), np.ones(2))
        yield


@contextmanager
def blaming_start(case: Any, key: str) -> Iterator[None]:
    """Let a start that cannot be used (E-START) in a block of code name an entry of the case."""
    try:
        yield
    except FemgearError as error:
        if error.code == "E-START":
            error.key, error.file = key, case.location(key)
        raise


_SHOWN = 6
"""Parts of a result that its short text names."""


class StageResult:
    """What the result of every stage has beside its numbers; base of their dataclasses.

    A class overrides what it knows better: results of direct solutions converge, and have no residual.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Keep the short text of results, in place of which a dataclass would print megabytes of numbers."""
        super().__init_subclass__(**options)
        cls.__repr__ = StageResult.__repr__

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join(list(vars(self))[:_SHOWN])}; {self.message}>"

    def _repr_html_(self) -> str:
        """Tables of the result, for notebooks."""
        return self.dataset()._repr_html_()

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return True

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions, NaN of what is not iterated."""
        return math.nan

    @property
    def message(self) -> str:
        """How the solutions were found, in words."""
        return "solved directly, without iteration"

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """What the result says against itself, each once."""
        return once(self.warnings(self.contents()))

    @staticmethod
    def warnings(data: object) -> Iterable[Finding]:
        """List what the contents of the stage's file, or a dataset of them, say against themselves."""
        return ()

    def contents(self) -> Contents | xr.Dataset:
        """Collect the contents of the stage's file; a class has these, or `dataset` where it needs xarray."""
        if type(self).dataset is StageResult.dataset:
            raise NotImplementedError
        return self.dataset()

    def dataset(self) -> xr.Dataset:
        """Collect the contents of the stage's file as dataset, with units."""
        return as_dataset(self.contents())


@dataclass(frozen=True)
class Drawn:
    """What pictures are made of.

    Parameters
    ----------
    case : case of the train
        The case that was run.
    data : mapping of str to Dataset
        Contents of the stages' files by stage, as far as computed.
    results : mapping of str to result
        Of the same stages; empty where the files alone are there.
    cache : path, optional
        Folder of generated grids.
    """

    case: Any
    data: Mapping[str, xr.Dataset]
    results: Mapping[str, Any] = field(default_factory=dict)
    cache: Path | None = None


@dataclass(frozen=True)
class Figures:
    """Pictures of a stage and what is said under them.

    Parameters
    ----------
    captions : mapping of str to str
        By the beginning of the file name, in the order of the page; " ({})" takes up the rest of the name.
    draw : callable
        ``(Drawn) -> {file name: Figure}``.
    write : tuple of callables
        ``(Drawn, folder) -> file names`` of pictures and fields that are no figures.
    """

    captions: Mapping[str, str]
    draw: Callable[[Drawn], Mapping[str, Figure]] = lambda drawn: {}
    write: tuple[Callable[[Drawn, Path], list[str]], ...] = ()


class FiguresOf(Mapping[str, Figures]):
    """Figures by stage of a module that is imported when they are asked for: not to compute."""

    def __init__(self, place: str):
        self._place = place

    @cached_property
    def _figures(self) -> Mapping[str, Figures]:
        return resolve_name(self._place)

    def __getitem__(self, name: str) -> Figures:
        return self._figures[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._figures)

    def __len__(self) -> int:
        return len(self._figures)


@dataclass(frozen=True)
class Stage:
    """One stage of a run.

    Parameters
    ----------
    name, title : str
        Of the file, and of its section on the page.
    solve : callable
        ``(case, *results of the stages in `takes`, **options) -> result``; the result of a stage that was
        not computed is None. The result is a `StageResult`.
    verdict : callable
        ``(result) -> dict``: what the manifest says of it beside `convergence`.
    describe : callable
        ``(Results) -> Block``: the numbers of the stage, read from its folder.
    parts : callable, optional
        Called as `solve`, gives pairs of a case with some of the speeds alone and its result, one after the
        other, so that any number of speeds needs little memory. Stages after it that take its result alone
        are solved for every part.
    takes : tuple of str
        Stages whose results it goes on from.
    options : tuple of str
        Of ``"cache"``, the folder of generated grids, ``"progress"``, whom to tell how far it has come, and
        ``"steps"``, what other cases have left (`femgear.case.dependencies.Steps`).
    wanted : callable
        ``(case) -> bool``: whether a run without ``only`` computes it.
    unavailable : callable
        ``(case) -> str``: why the case cannot have the stage, empty where it can.
    needs : callable, optional
        ``(case) -> tuple of str``: stages that must come before, where they are not those of `takes`.
    case_if_requested : callable
        ``(case) -> case``: the case as it is computed where the stage is the last one by name.
    check : callable, optional
        ``(case)``: refuses, before a run, what the stage cannot represent.
    tables : callable
        ``(Results) -> blocks`` that the page shows beside the numbers.
    warnings : callable
        ``(Dataset) -> findings``: what the solver says against the contents of the stage's file, the
        `StageResult.warnings` of its results.
    decided_by : callable
        ``(case) -> entries``: all of the case that decides the result; of equal ones it is the same.
    concerned_by : mapping of str to tuple of str
        Codes of findings of stages before, under "" those of the case, that concern numbers of this one too:
        its file carries them beside its own.
    """

    name: str
    title: str
    solve: Callable[..., Any]
    verdict: Callable[[Any], dict]
    describe: Callable[[Results], Block]
    parts: Callable[..., Iterator[tuple[Any, Any]]] | None = None
    takes: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    wanted: Callable[[Any], bool] = lambda case: True
    unavailable: Callable[[Any], str] = lambda case: ""
    needs: Callable[[Any], tuple[str, ...]] | None = None
    case_if_requested: Callable[[Any], Any] = lambda case: case
    check: Callable[[Any], object] | None = None
    tables: Callable[[Results], Iterable[Block]] = lambda results: ()
    warnings: Callable[[xr.Dataset], Iterable[Finding]] = lambda data: ()
    decided_by: Callable[[Any], Entries] = every_entry
    concerned_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def before(self, case: ReadCase) -> tuple[str, ...]:
        """List the stages that must come before this one."""
        return self.takes if self.needs is None else self.needs(case)

    def convergence(self, result: StageResult) -> dict[str, Any]:
        """Tell how a result was found, and what its verdict is, for the manifest."""
        stage_result = result if isinstance(result, StageResult) else StageResult()  # of trains without the base
        told_of_run = {
            "converged": stage_result.converged,
            "residual": stage_result.residual,
            "message": stage_result.message,
        }
        return told_of_run | self.verdict(result)

    def findings(self, data: Any) -> tuple[Finding, ...]:
        """List what the contents of the stage's file say against themselves, each once."""
        return once(self.warnings(data), self.name)

    def carried(self, findings: Mapping[str, Iterable[Finding]]) -> tuple[Finding, ...]:
        """List what the file of the stage carries: its own findings, and those that concern its numbers too.

        ``findings`` are those of all stages so far by name, under "" those of the case.
        """
        before = (
            finding
            for name, codes in self.concerned_by.items()
            for finding in findings.get(name, ())
            if finding.code in codes
        )
        return once((*findings[self.name], *before))


@dataclass(frozen=True)
class Recorded:
    """What a test bench would record of a run.

    ``signals``, ``spectra`` and ``shapes`` take results and give those of every sensor: sampled signals, lines at
    every speed, and modes at points (None where there are none).

    ``needs`` are the stages that each format takes, of "wav", "uff" and "quality" those that there are, the
    first one that of the signals, of which every speed and the run-up have ``each(results)``. ``cuts`` takes
    results and a form of `femgear.housing.sound.LEVELS`, and gives header and rows of a table; ``tables`` gives
    names, headers and rows of further ones;
    ``extent`` takes results and a rate [Hz], and gives by unit the largest sum of the amplitudes of a speed,
    and the largest level that lines at half the rate and above have, with that of all lines, r.m.s.
    """

    signals: Callable[[Results, Sampling], Iterator[Signal]]
    extent: Callable[[Results, float], Mapping[str, tuple[float, float, float]]]
    needs: Mapping[str, tuple[str, ...]]
    each: Callable[[Results], int]
    spectra: Callable[[Results], Iterator[Spectrum]] = lambda results: iter(())
    shapes: Callable[[Results], Shapes] | None = None
    cuts: Callable[[Results, str], tuple[Sequence[str], Iterable[Sequence[float]]]] | None = None
    tables: Callable[[Results], Iterable[tuple[str, Sequence[str], Iterable[Sequence[object]]]]] = lambda results: ()


@dataclass(frozen=True)
class Train:
    """A kind of case and what is computed of it.

    Parameters
    ----------
    name, words : str
        ``"planar"``, ``"a planar case"``.
    stages : tuple of Stage
        In order.
    describe : callable
        ``(case) -> blocks`` between its title and its warnings.
    warnings : callable
        ``(case) -> findings``: what is allowed but deserves a look.
    figures : mapping of str to Figures
        By stage; ``""`` are those of the case, whatever is computed of it.
    remarks : callable
        ``(Results, name of a picture) -> sentences`` that this case adds to a caption.
    recorded : Recorded, optional
        Signals, spectra and modes of its runs; None where there are none.
    verdict : callable
        ``(Results) -> blocks``: what decides, before everything else.
    key_figures : callable
        ``(case) -> figures`` by which cases are compared, none of trains whose studies have quantities of their own.
    judgements : callable
        ``(Results) -> judgements``: the questions that page one answers, in their order.
    bodies : callable, optional
        ``(case) -> bodies`` of it in space, as `femgear.report.space.SpaceBody`; None of trains whose gears have no
        teeth.
    draft_casing : callable, optional
        ``(case) -> text, findings``: the tables of an estimated casing for a case without one.
    dynamic_model : callable, optional
        ``(case, results by stage) -> DynamicModel``: its vibration for other programs, of the stages up to ``modes``;
        None of trains that have no linear model in a frame of their own.
    stiffness_curves : tuple of str
        Stage that has the mesh stiffness over the position, and its variables of stiffness and transmission error.
    front : tuple of (str, int)
        Charts of page one, the first two of which are there: name of the figure, and number of its panel.
    recorded_stages : callable, optional
        ``(case) -> stages``: planetary stages that recordings tell, by name; None of trains that are no gearbox.
    stands_in : mapping of str to str
        Stages of other trains, with the stage of this one that has their results.
    duty : callable
        ``(case) -> sentence`` that says what the train does, empty of trains without a power flow.
    check_model : callable
        ``(case)``: refuses a case that has no model for other programs (E-MODEL), before anything is computed for it.
    meshing_teeth : callable, optional
        ``(case, speed of the input or None, cache=, steps=) -> MeshingTeeth`` of all stages, from which flanks wear;
        None of trains that solve no contact of teeth.
    """

    name: str
    words: str
    stages: tuple[Stage, ...]
    describe: Callable[[Any], tuple[Block, ...]]
    warnings: Callable[[Any], Iterable[Finding]]
    figures: Mapping[str, Figures] = field(default_factory=dict)
    remarks: Callable[[Results, str], Iterable[str]] = lambda results, stem: ()
    recorded: Recorded | None = None
    verdict: Callable[[Results], Iterable[Block]] = lambda results: ()
    key_figures: Callable[[Any], tuple[KeyFigure, ...]] = lambda case: ()
    judgements: Callable[[Results], Iterable[Judgement]] = lambda results: ()
    bodies: Callable[[Any], Iterable[SpaceBody]] | None = None
    draft_casing: Callable[[Any], tuple[str, tuple[Finding, ...]]] | None = None
    dynamic_model: Callable[[Any, Mapping[str, Any]], DynamicModel] | None = None
    stiffness_curves: tuple[str, str, str] = ("static", "mesh_stiffness", "ste")
    front: tuple[tuple[str, int], ...] = ()
    recorded_stages: Callable[[Any], Mapping[str, HeardSet]] | None = None
    stands_in: Mapping[str, str] = field(default_factory=dict)
    duty: Callable[[Any], str] = lambda case: ""
    check_model: Callable[[Any], None] = lambda case: None
    meshing_teeth: Callable[..., Sequence[MeshingTeeth]] | None = None

    def stage(self, name: str) -> Stage | None:
        """Find the stage of a name, None where the train has none of it."""
        return next((stage for stage in self.stages if stage.name == name), None)

    def describe_case(self, case: Any) -> tuple[Block, ...]:
        """Tabulate a case: its title, what it is, and its warnings."""
        warnings = tuple(map(str, by_severity(self.case_warnings(case))))
        return Block(case.title), *self.describe(case), Block("Warnings", notes=warnings or ("none",))

    def describe_results(self, results: Results) -> tuple[Block, ...]:
        """Tabulate the numbers of a run: its verdict, all tables of its stages, and the time that each took."""
        blocks = [block for stage in self._in(results) for block in (stage.describe(results), *stage.tables(results))]
        timings = ((stage, f"{seconds:.2f}") for stage, seconds in results.manifest.timings.items())
        time = Block("Time", ("stage", "[s]"), tuple(timings))
        return (*self.verdict(results), *blocks, *listed(results.findings), time)

    def summary(self, results: Results) -> tuple[str, tuple[Judgement, ...]]:
        """Answer the questions of page one, and join the answers to one text."""
        judgements = tuple(self.judgements(results))
        return joined_sentence(judgements), judgements

    def describe_briefly(self, results: Results, only: str | None = None) -> tuple[Block, ...]:
        """Tabulate what page one answers, and the verdict of a run or one stage if that was asked for.

        Trains without judgements have all their tables.
        """
        sentence, judgements = self.summary(results)
        if not judgements:
            return self.describe_results(results)
        stage = None if only is None else self.stage(only)
        numbers = () if stage is None or stage.name not in results.stages else (stage.describe(results),)
        verdict = next(iter(self.verdict(results)), None)
        decided = () if verdict is None else (verdict,)
        return (
            *describe_judgements(f"{self.duty(results.case)} {sentence}".strip(), judgements),
            *(numbers or decided),
        )

    def describe_stages(self, results: Results) -> dict[str, Block]:
        """Tabulate the numbers of the stages of a run, by the titles of the stages."""
        return {stage.title: stage.describe(results) for stage in self._in(results)}

    def case_warnings(self, case: Any) -> tuple[Finding, ...]:
        """List what a case is allowed to be but deserves a look, each once.

        Raises
        ------
        FemgearError
            What cannot be computed at all.
        """
        return once(self.warnings(case))

    def result_warnings(self, results: Results) -> tuple[Finding, ...]:
        """List what the solvers say against their own results, each once."""
        return tuple(finding for finding in results.findings if finding.stage)

    def _in(self, results: Results) -> list[Stage]:
        """Stages whose results there are."""
        return [stage for stage in self.stages if stage.name in results.stages]


def modes_verdict(result: Any) -> dict:
    """Count the modes and coordinates of any result with modes, for the manifest."""
    return {"modes": len(result.modes.frequency), "degrees_of_freedom": len(result.modes.shape)}


def joint_verdict(verdicts: Sequence[dict]) -> dict:
    """Join the verdicts of the parts of a stage: all of them, the largest number, the latest text."""
    joins = {bool: all, float: lambda values: float(np.fmax.reduce(values)), int: max}
    joined = {}
    for name, latest in verdicts[-1].items():
        values = [verdict[name] for verdict in verdicts]
        joined[name] = joins.get(type(latest), lambda values: values[-1])(values)
    return joined


def response_verdict(result: Any) -> dict:
    """Tell the stability of any result with a periodic response, for the manifest."""
    return {"stable": bool(np.all(result.stability.stable))}


former_keywords(asked="case_if_requested")(Stage)
former_keywords(heard="recorded_stages")(Train)
