"""A whole run: every stage computed, written, drawn and reported in one folder."""

from __future__ import annotations

import hashlib
import os
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps, fingerprint
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, FemgearError, StorageError, nvh_library
from femgear.exchange.dynamic_model import DynamicModel, StiffnessTable
from femgear.exchange.formats import (
    SCALES,
    Signal,
    write_functions,
    write_matlab,
    write_modes,
    write_wav,
    write_workbook,
)
from femgear.exchange.sampling import Sampling
from femgear.findings import Finding, as_text, once, remark, tell
from femgear.housing.sound import sound_quality
from femgear.second_process import second_core, shared
from femgear.stages.protocol import (
    Drawn,
    Progress,
    Stage,
    StageResult,
    joint_verdict,
    one_blas_thread,
    silent,
)
from femgear.storage.contents import Contents, Datasets, as_dataset
from femgear.storage.files import (
    append_dataset,
    checked_name,
    checksum,
    own_files,
    read_dataset,
    read_result,
    replaced_file,
    write_attribute,
    write_csv,
    write_dataset,
    write_result,
    write_text,
)
from femgear.storage.results import (
    KEPT,
    MANIFEST,
    Manifest,
    Results,
    additions,
    discard,
    folder_lock,
    read_manifest,
    record,
    tables_of,
    versions,
    write_csv_tables,
)
from femgear.trains.live import Live
from femgear.trains.reading import open_results, read_case
from femgear.trains.registry import check_case, stages_of, train_of
from femgear.trains.shown import Shown, summary

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.planetary import Case
    from femgear.case.text import ReadCase


def grid_cache() -> Path:
    """Find the folder of generated grids: FEMGEAR_MESHES, meshes/ of a source tree, or the user's cache."""
    if given := os.environ.get("FEMGEAR_MESHES"):
        return Path(given)
    beside = Path(__file__).parents[1] / "meshes"
    if beside.is_dir() and (beside.parent / "pyproject.toml").is_file():
        return beside
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "femgear" / "meshes"


class Solution(dict[str, Any], Shown):
    """Results of the computed stages by name, in order, and the ``case`` that they are of.

    ``plot(name)`` draws a figure; in a notebook it shows what page one of a report says.
    """

    def __init__(self, case: Any) -> None:
        super().__init__()
        self.case = case

    def __repr__(self) -> str:
        return f"<Solution: {', '.join(self) or 'no stage'}>"

    def _repr_html_(self) -> str:
        return summary(self)._repr_html_()

    def __missing__(self, name: str):
        raise KeyError(f"{name!r} was not computed: there are {', '.join(self) or 'no stages'}")


def solve(case: ReadCase, only: str | None = None, *, progress: Progress = silent) -> Solution:
    """Compute the stages of a case in memory: transmission error, modes, vibration, whatever its train has.

    Parameters
    ----------
    case : Case
        From `femgear.read_case`.
    only : str, optional
        Last stage that is wanted, with what it needs; all stages when not given.
    progress : callable
        Called with (stage, done, total).

    Returns
    -------
    Solution
        Results by the name of the stage, in order; ``dataset()`` of each has its numbers with units.

    Raises
    ------
    CaseError, GeometryError
        Before anything is computed: what the stages cannot represent; no such stage (E-STAGE).
    """
    case, stages = _asked(case, only)
    results, steps = Solution(case), Steps()
    with one_blas_thread():
        for stage in stages:
            progress(stage.name, 0, 1)
            taken = map(results.get, stage.takes)
            results[stage.name] = stage.solve(case, *taken, **_options(stage, progress, steps))
            progress(stage.name, 1, 1)
    return results


def live(case: ReadCase, *, progress: Progress = silent) -> Live:
    """Make a handle of a case that answers again after changes, and keeps what they leave as it was.

    ``handle = live("case.toml")``, and then ``handle.change({"operation.torque": "90 N m"}).housing``: see
    `femgear.trains.live.Live`. The case is one from `femgear.read_case`, or what that reads.
    """
    return Live(case, cache=grid_cache(), progress=progress)


def dynamic_model(case: Any, *, progress: Progress = silent) -> DynamicModel:
    """Compute the vibration of a case as a model for other programs, with all stages that it takes.

    Parameters
    ----------
    case : Case
        A planetary set, a pair, or a gearbox whose planets do not run around.
    progress : callable
        Called with (stage, done, total).

    Raises
    ------
    CaseError
        A kind of case without such a model, or without speeds (E-MODEL).
    """
    make = train_of(case).dynamic_model
    if make is None or not getattr(case.operation, "speeds", True):
        raise CaseError(
            "this case has no linear model for other programs" if make is None else "a model needs a speed",
            code="E-MODEL",
            value=train_of(case).words,
            limit="planetary sets, pairs and gearboxes, with operation.speeds",
            remedy="give operation.speeds" if make else "take a case of one of its stages",
        )
    train_of(case).check_model(case)
    return make(case, solve(case, "modes", progress=progress))


def run_harmonics(results: Results) -> dict[float, int]:
    """Count the mesh harmonics that excite a run, by its first and last speed of operation [rpm].

    Nothing of runs without a response, and of those that dynamics.nc has no end of the excitation of.
    """
    if "dynamics" not in results.stages or "excitation_limit" not in (data := results.dynamics):
        return {}
    if "mesh_frequency" not in data or data["mesh_frequency"].dims != ("speed",):
        return {}
    speeds, count = data["speed"].values, np.round(data["excitation_limit"].values / data["mesh_frequency"].values)
    return {float(speeds[at]): int(count[at]) for at in (0, -1)}


def stiffness_table(source: Any, *, progress: Progress = silent) -> StiffnessTable:
    """Collect k(theta) of all meshes of a set or a pair over the angle of its first gear, both ends included.

    Parameters
    ----------
    source : Case or Results
        Of results the stage that has the curves is read.
    progress : callable
        Called with (stage, done, total).

    Raises
    ------
    CaseError
        A kind of case that has no mesh stiffness over the position (E-STAGE).
    """
    case = source.case if isinstance(source, Results) else source
    stage, stiffness, deflection = train_of(case).stiffness_curves
    if isinstance(source, Results) and stage in source.stages:
        data = source[stage]
    elif train_of(case).stage(stage) is None:
        raise no_stiffness_curves(stage)
    else:
        data = solve(case, stage, progress=progress)[stage].dataset()
    if stiffness not in data or "position" not in data[stiffness].dims:
        raise no_stiffness_curves(stage)
    k, error = (data[name].values for name in (stiffness, deflection))
    k, error = (np.column_stack([values, values[:, 0]]) for values in (k, error))
    position, teeth = data["position"].values, planetary_set(case).gears[0].teeth
    # equidistant, over whole mesh periods
    end = position[0] + len(position) * (position[1] - position[0])
    angle = 2.0 * np.pi / teeth * np.append(position, end)
    return StiffnessTable(angle, tuple(str(name) for name in data["mesh"].values), k, error)


def mesh_stiffness(case: Any, torques: Sequence[float] | None = None) -> xr.DataArray:
    """Compute the mesh stiffness k(theta) of all meshes of a set or a pair, at several torques.

    Parameters
    ----------
    case : Case, or what `femgear.read_case` takes
    torques : sequence of float, optional
        On the input [N m]; by default that of the case.

    Returns
    -------
    DataArray
        ``(torque, mesh, position)`` [N/m], over the position in mesh periods.

    Raises
    ------
    CaseError
        E-STAGE: a kind of case that has no mesh stiffness over the position; torques that cannot be.
    """
    import xarray as xr

    handle = Live(case)
    stage, name, _ = train_of(handle.case).stiffness_curves
    if stage not in handle.answer or not hasattr(handle.case.operation, "torque"):
        raise no_stiffness_curves(stage)
    given = [float(handle.case.operation.torque)] if torques is None else [float(torque) for torque in torques]
    curves = []
    for torque in given:
        data = handle.change({"operation.torque": f"{torque!r} N m"})[stage].dataset()
        if name not in data:
            raise no_stiffness_curves(stage)
        curves.append(data[name])
    joined: Any = xr.concat(curves, "torque", combine_attrs="override")
    words = {"units": "N m", "long_name": "torque of the input"}
    return joined.assign_coords(torque=("torque", np.array(given), words))


def no_stiffness_curves(stage: str) -> CaseError:
    """Make the refusal of a kind of case that has no mesh stiffness over the position."""
    return CaseError("this kind of case has no mesh stiffness over the position", code="E-STAGE", key=stage)


def _asked(case: ReadCase, only: str | None) -> tuple[Any, tuple[Stage, ...]]:
    """The case as it is computed up to its last stage, and the stages; refuses what they cannot represent."""
    check_case(case, only)
    stages = stages_of(case, only)
    return (case if only is None else stages[-1].case_if_requested(case)), tuple(stages)


def _options(stage: Stage, progress: Progress, steps: Steps) -> dict[str, Any]:
    """Options of a stage: folder of grids, whom to tell how far it has come, and what stages before it have left."""
    options = {"cache": grid_cache(), "progress": progress, "steps": steps}
    return {name: options[name] for name in stage.options if name in options}


_RECORDED = "wav", "uff", "quality"
_LIBRARIES = {
    "xlsx": ("spreadsheets", "openpyxl"),
    "uff": ("universal files", "pyuff"),
    "quality": ("loudness and tones", "mosqito"),
}
"""Libraries of formats that need one of the extra ``nvh``."""
"""Formats of what a test bench would record."""
_WORTH_KEEPING = 10.0
"""Seconds of stages after which their files are written, and what a killed run goes on from.

Less is computed again as soon, and its verdict comes before the files are written.
"""
_SHORT = 5.0
"""Seconds of all stages so far, below which the next one is short, too."""
_LOSS = -0.1
"""Change of the level that is told when a rate leaves lines out [dB]."""


@dataclass
class _Run:
    """What a run has written into its ``folder``.

    Parameters
    ----------
    files : dict
        Checksums of the files by name.
    timings : dict
        Seconds that every stage took.
    convergence : dict
        Verdict of every stage on its solutions.
    data : dict
        Contents of the file of every stage.
    findings : dict
        Findings of every stage, under "" those of the case.
    pending : dict
        Results that a run could go on from and that are not written yet.
    unwritten : dict
        Contents of stages, by name, whose files are not written yet.
    ahead : dict
        Result, or the error instead of it, and seconds of stages, by name, that were solved before their turn.
    steps : Steps
        What its stages have in common, such as the excitation of dynamics and run-up.
    """

    folder: Path
    files: dict[str, str] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    convergence: dict[str, Any] = field(default_factory=dict)
    data: dict[str, Contents | xr.Dataset] = field(default_factory=dict)
    findings: dict[str, tuple[Finding, ...]] = field(default_factory=dict)
    pending: dict[str, Any] = field(default_factory=dict)
    unwritten: dict[str, Contents | xr.Dataset] = field(default_factory=dict)
    ahead: dict[str, tuple[Any, float]] = field(default_factory=dict)
    steps: Steps = field(default_factory=Steps)

    def keep(self, case: ReadCase, *, least: float = 0.0) -> None:
        """Write files and pending results of the stages of a case, those of ``least`` seconds or more."""
        if not self.pending or sum(self.timings[name] for name in self.pending) < least:
            return
        self.write()
        for name, result in self.pending.items():
            write_result(result, self.folder / _kept_name(name), fingerprint=_fingerprint(case))
        self.record(*map(_kept_name, self.pending))
        self.pending.clear()

    def write(self) -> None:
        """Write the files of the stages that are not written yet."""
        if not self.unwritten:
            return
        for name, data in self.unwritten.items():
            write_dataset(data, self.folder / f"{name}.nc")
        names = [f"{name}.nc" for name in self.unwritten]
        self.unwritten.clear()
        self.record(*names)

    def all_findings(self) -> tuple[Finding, ...]:
        """What deserves a look so far, each once."""
        return once(finding for stage in self.findings.values() for finding in stage)

    def record(self, *names: str, complete: bool = False) -> Manifest:
        """Write the manifest with some more files."""
        others = {name: digest for name, digest in self.files.items() if name not in names}
        entries = {"timings": self.timings, "convergence": self.convergence, "checksums": others}
        entries["findings"] = self.all_findings()
        manifest = record(self.folder, list({**self.files, **dict.fromkeys(names)}), **entries, complete=complete)
        self.files = dict(manifest.files)
        return manifest


@one_blas_thread()
def run_case(
    case: Case,
    folder: Path,
    *,
    only: str | None = None,
    pictures: bool = True,
    progress: Progress = silent,
    computed: Callable[[Results], None] | None = None,
) -> Mapping[str, xr.Dataset]:
    """Compute a case and write its results; goes on from the stages of an interrupted run of the same case.

    Into a folder from `femgear.storage.results.run_folder`, whose manifest says what is there: stages are
    written after `_WORTH_KEEPING` seconds, when all are done, or when an error ends the run. Stages go up to
    ``only``, whatever the case says of it; ``pictures`` are figures, fields and report. ``progress`` is called
    with (stage, done, total), ``computed`` with the results of all stages, before these are written and drawn.
    Returns the contents of the files, by stage, those that were written part by part only where they were
    drawn or told.
    """
    requested, stages = _asked(case, only)
    run, results = _resumed(folder, requested, stages)
    if results:
        tell(remark(f"{', '.join(results)}: as the run that was interrupted left them"), stacklevel=3)
    write_text(case.source, folder / "case.toml")
    run.findings[""] = train_of(case).case_warnings(case)
    run.record("case.toml")
    own_files(folder / KEPT, ["*"])
    try:
        for stage, follower in zip(stages, (*stages[1:], None)):
            if stage.name not in run.timings:
                _solve_together(run, requested, stage, follower, results, progress)
                _compute(run, requested, stage, stages, results, progress)
                run.keep(requested, least=_WORTH_KEEPING)
        if pictures or computed is not None:
            files = (stage.name for stage in stages if stage.name not in run.data)
            run.data |= {name: read_dataset(folder / f"{name}.nc") for name in files}
        if computed is not None:
            computed(_results_so_far(run))
        run.write()
        if pictures:
            _draw(run, case, {name: result for name, result in results.items() if result is not None}, progress)
    except BaseException:
        with suppress(StorageError):  # what ended the run is what is said
            run.keep(requested)
        raise
    run.files = _without_kept(run.files)
    run.record(complete=True)
    return Datasets(run.data)


def _results_so_far(run: _Run, *names: str) -> Results:
    """Results of the stages that are computed, with some more files, as those of a complete run."""
    if names:
        run.record(*names)
    files = _without_kept(run.files) | {f"{name}.nc": "" for name in run.unwritten}
    shown = Manifest(True, files, dict(run.timings), dict(run.convergence), versions(), run.all_findings())
    return Results(run.folder, shown, read_case).with_known(run.data)


def _draw(run: _Run, case: Case, results: dict[str, object], progress: Progress) -> None:
    """Write the page with its charts, then the pictures, and the page with these."""
    from femgear.report.page import page, write_pictures

    start, train = time.perf_counter(), train_of(case)
    data = {name: as_dataset(contents) for name, contents in run.data.items()}
    run.data |= data
    write_text(page(train, _results_so_far(run)), run.folder / "report.html")
    drawn = Drawn(case, data, results, grid_cache())
    names = write_pictures(run.folder, train, drawn, progress=progress)
    run.timings["pictures"] = time.perf_counter() - start
    write_text(page(train, _results_so_far(run, *names)), run.folder / "report.html")
    run.record("report.html")


def _without_kept(files: Mapping[str, str]) -> dict[str, str]:
    """Files of a run, but for those that only an interrupted one goes on from."""
    return {name: digest for name, digest in files.items() if not name.startswith(KEPT)}


def _solve_together(
    run: _Run, case: Any, stage: Stage, follower: Stage | None, results: dict[str, Any], progress: Progress
) -> None:
    """Solve a stage in a second process while this one solves the stage after it, where neither needs the other.

    What a stage leaves in the steps of the run would be lost with the process, and with an interrupt its
    result: so only where all stages before were short.
    """
    if not 0.0 < sum(run.timings.values()) < _SHORT:
        return
    if follower is None or stage.name in follower.takes or "steps" in stage.options or run.ahead:
        return
    if stage.parts or follower.parts or follower.name in run.timings or not second_core():
        return

    def solved(member: Stage, shown: Progress) -> tuple[Any, float]:
        """Result of a stage, or its error, which is raised in its turn, and seconds."""
        start = time.perf_counter()
        try:
            result = member.solve(case, *map(results.get, member.takes), **_options(member, shown, run.steps))
        except Exception as error:
            result = error
        return result, time.perf_counter() - start

    def solve_follower() -> None:
        run.ahead[follower.name] = solved(follower, progress)

    progress(follower.name, 0, 1)
    run.ahead[stage.name] = shared([partial(solved, stage, silent)], solve_follower)[0]


def _compute(
    run: _Run, case: Any, stage: Stage, stages: Sequence[Stage], results: dict[str, Any], progress: Progress
) -> None:
    """Solve a stage and write its file, part after part with those stages that take its result alone."""
    following = () if stage.parts is None else (later for later in stages if later.takes == (stage.name,))
    members, verdicts, files = [stage, *following], defaultdict(list), dict[str, Path]()
    taken, options = map(results.get, stage.takes), _options(stage, progress, run.steps)
    seconds, start = defaultdict(float), time.perf_counter()
    progress(stage.name, 0, 1)
    if stage.name in run.ahead:
        result, seconds[stage.name] = run.ahead.pop(stage.name)
        if isinstance(result, Exception):
            raise result
        parts = iter([(case, result)])
    elif stage.parts is None:
        parts = iter([(case, stage.solve(case, *taken, **options))])
    else:
        parts = stage.parts(case, *taken, **options)
    with ExitStack() as opened:
        for part, first in parts:
            for member in members:
                computed = (
                    first if member is stage else member.solve(part, first, **_options(member, progress, run.steps))
                )
                data = _contents(computed)
                if part is case:
                    run.findings[member.name] = member.findings(data)
                    data.attrs["findings"] = as_text(member.carried(run.findings))
                    run.data[member.name] = run.unwritten[member.name] = data
                else:
                    if member.name not in files:
                        share = len(part.operation.speeds) / len(case.operation.speeds)
                        path, size = run.folder / f"{member.name}.nc", data.nbytes / share
                        files[member.name] = opened.enter_context(replaced_file(path, size=size))
                    append_dataset(data, files[member.name], "speed")
                results[member.name] = computed if part is case else None
                verdicts[member.name].append(member.convergence(computed))
                seconds[member.name] += time.perf_counter() - start
                start = time.perf_counter()
        for member in members:
            if member.name in files:
                with read_dataset(files[member.name]) as data:
                    run.findings[member.name] = member.findings(data)
                write_attribute(files[member.name], "findings", as_text(member.carried(run.findings)))
    for member in members:
        run.timings[member.name] = seconds[member.name]
        codes = [finding.code for finding in run.findings[member.name] if finding.code]
        run.convergence[member.name] = joint_verdict(verdicts[member.name]) | {"findings": codes}
        run.pending[member.name] = results[member.name]
        progress(member.name, 1, 1)
    if files:
        run.write()
        run.record(*(f"{name}.nc" for name in files))


def _contents(result: Any) -> Contents | xr.Dataset:
    """Contents of the file of a stage, of results of trains without `StageResult` as a dataset."""
    return result.contents() if isinstance(result, StageResult) else result.dataset()


def _kept_name(stage: str) -> str:
    """Name the file of a stage that a run goes on from when it was interrupted."""
    return f"{KEPT}/{stage}.npz"


def _resumed(folder: Path, case: ReadCase, stages: Sequence[Stage]) -> tuple[_Run, dict[str, Any]]:
    """What an interrupted run of the same case left: its record, and the results of its first stages."""
    results = dict[str, Any]()
    manifest = read_manifest(folder) if (folder / MANIFEST).is_file() else Manifest(complete=False)
    files = {name: digest for name, digest in manifest.files.items() if name == "case.toml"}
    for stage in stages:
        names = f"{stage.name}.nc", _kept_name(stage.name)
        if not {*names} <= manifest.files.keys() or stage.name not in manifest.timings:
            break
        try:
            if any(checksum(folder / name) != manifest.files[name] for name in names):
                break
            results[stage.name] = read_result(folder / names[1], fingerprint=_fingerprint(case))
        except StorageError:
            break
        files |= {name: manifest.files[name] for name in names}
    discard(folder, {name: digest for name, digest in manifest.files.items() if name not in files})
    # in the order of the run, whatever of it is there already
    run = _Run(folder, files, findings={name: () for name in ("", *(stage.name for stage in stages))})
    for name in results:
        run.timings[name], run.convergence[name] = manifest.timings[name], manifest.convergence.get(name)
        run.findings[name] = tuple(finding for finding in manifest.findings if finding.stage == name)
    return run, results


def _fingerprint(case: ReadCase) -> str:
    """SHA-256 of all that the results depend on: the case, femgear as it stands here, the libraries."""
    return fingerprint({"case": case.model_dump(), "source": _source_checksum(), **versions()})


@cache
def _source_checksum() -> str:
    """SHA-256 of femgear's own files."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@one_blas_thread()
def report_again(folder: Path, *, static: bool = False) -> None:
    """Write report.html of a complete run anew, with figures where it drew none; update the manifest.

    ``static`` is that of `femgear.report.page.page`.
    """
    from femgear.report.page import page, write_pictures

    with folder_lock(folder):
        results = open_results(folder, partial=False)
        train = train_of(results.case)
        if not any(name.endswith(".png") for name in results.manifest.files):
            data = {stage: results[stage] for stage in results.stages}
            with additions(results.folder) as new:
                write_pictures(new, train, Drawn(results.case, data), progress=silent)
            results = open_results(folder)
        with additions(results.folder) as new:
            write_text(page(train, results, static=static), new / "report.html")


def export_results(
    results: Results, folder: Path, formats: Collection[str], how: Sampling, *, progress: Progress = silent
) -> list[str]:
    """Write a run in formats of "csv", "xlsx", "mat", "uff", "wav" and "quality", what is heard of its sound.

    The folder was made ready by `own_files` or `list_own`. Returns the names of the files. FemgearError: the
    run has no signals or modes (E-STAGE), the library of a format is not installed (E-LIBRARY).
    """
    for refusal in refused_formats(results, formats).values():
        raise refusal
    recorded, files = train_of(results.case).recorded, list[str]()
    needs = {} if recorded is None else recorded.needs
    if "csv" in formats:
        for number, stage in enumerate(results):
            progress("csv", number, len(results.stages))
            files += write_csv_tables(results[stage], folder, stage)
        if recorded is not None and recorded.cuts and {"runup", "housing"} <= {*results.stages}:
            header, rows = recorded.cuts(results, how.level)
            write_csv(folder / "order_cuts.csv", header, ([float(x) for x in row] for row in rows))
            files.append("order_cuts.csv")
        for name, header, rows in recorded.tables(results) if recorded is not None else ():
            write_csv(folder / f"{name}.csv", header, rows)
            files.append(f"{name}.csv")
        progress("csv", len(results.stages), len(results.stages))
    if "xlsx" in formats:
        if long := write_workbook(_tables_of_stages(results, progress), folder / "results.xlsx"):
            text = f"tables that no sheet can hold are left out: {', '.join(long)}"
            tell(Finding("W-ROWS", "", text, remedy="export them with --csv"))
        files.append("results.xlsx")
    if "mat" in formats:
        progress("mat", 0, 1)
        write_matlab({stage: results[stage] for stage in results}, folder / "results.mat")
        files.append("results.mat")
        progress("mat", 1, 1)
    if recorded is not None and {"wav", "uff", "quality"} & {*formats}:
        how = _scaled(how, recorded.extent(results, how.rate))
        steps = recorded.each(results) * (results[needs["wav"][0]].sizes["speed"] + ("runup" in results.stages))
        sound = _SoundFiles(folder, formats, how)
        # every signal is sampled once, whatever it is written as
        signals = sound.written(_told(recorded.signals(results, how), progress, steps))
        if recorded.shapes and "uff" in formats:
            steady = (signal for signal in signals if signal.steady)
            write_functions(steady, recorded.spectra(results), folder / "signals.uff")
            write_modes(recorded.shapes(results), folder / "modes.uff")
            files += ["signals.uff", "modes.uff"]
        for _ in signals:
            pass
        files += sound.end()
    return files


def _tables_of_stages(results: Results, progress: Progress) -> Iterator[tuple[str, Any]]:
    """Tables of all stages of a run for a workbook, with the stages that are done told as its progress."""
    for number, stage in enumerate(results):
        progress("xlsx", number, len(results.stages))
        yield from tables_of(results[stage], stage)
    progress("xlsx", len(results.stages), len(results.stages))


def refused_formats(results: Results, formats: Collection[str]) -> dict[str, FemgearError]:
    """Find which formats of `export_results` cannot be written of a run, each with its refusal.

    The run has no signals or modes (E-STAGE), or the library of a format is not installed (E-LIBRARY).
    """
    recorded = train_of(results.case).recorded
    needs, refused = {} if recorded is None else recorded.needs, dict[str, FemgearError]()
    possible = "; ".join(f"--{form} with the stages {', '.join(stages)}" for form, stages in needs.items())
    for form in formats:
        if form in _RECORDED and not (form in needs and {*needs[form]} <= {*results.stages}):
            refused[form] = CaseError(
                "the run has nothing that this format holds",
                code="E-STAGE",
                value=f"--{form}",
                limit=possible or "runs with an elastic ring, --wav of pairs and gearboxes",
                remedy="export tables, or run such a case without --only",
            )
            continue
        try:
            _need_library(form)
        except FemgearError as error:
            refused[form] = error
    return refused


def _need_library(form: str) -> None:
    """Refuse a format whose library is not installed (E-LIBRARY)."""
    if form in _LIBRARIES:
        words, library = _LIBRARIES[form]
        with nvh_library(words):
            if find_spec(library) is None:
                raise ImportError(f"No module named {library!r}")


def _told(signals: Iterable[Signal], progress: Progress, steps: int) -> Iterator[Signal]:
    """Give signals, and tell how many of them have been used up."""
    progress("sound", 0, steps)
    for done, signal in enumerate(signals, 1):
        yield signal
        progress("sound", done, steps)


def _scaled(sampling: Sampling, extent: Mapping[str, tuple[float, float, float]]) -> Sampling:
    """Give WAV files full scales that nothing exceeds, and warn of lines that the rate leaves out."""
    for unit, (most, lost, level) in extent.items():
        name = SCALES[unit]
        if getattr(sampling, name) is None:
            sampling = replace(sampling, **{name: float(f"{1.05 * most or 1.0:.1e}")})
        left = 10.0 * np.log10(max(1.0 - (lost / (level or 1.0)) ** 2, 1e-20))
        if left < _LOSS:
            text = (
                f"lines at {sampling.rate / 2:g} Hz and above are left out: up to {lost:.3g} {unit} r.m.s. "
                f"of {level:.3g}, {left:+.2g} dB of the level"
            )
            tell(Finding("W-RATE", "", text, remedy="raise --rate to hear them"), stacklevel=4)
    return sampling


class _SoundFiles:
    """WAV files of signals, and what is heard of those of microphones as a table.

    Parameters
    ----------
    folder : path
    formats : collection of str
        "wav" and "quality" are those that it writes.
    sampling : Sampling
        With full scales of the WAV files.
    """

    def __init__(self, folder: Path, formats: Collection[str], sampling: Sampling) -> None:
        self._folder, self._formats = folder, formats
        self._scales = {unit: getattr(sampling, name) or 1.0 for unit, name in SCALES.items()}
        self._files, self._rows, self._peaks = list[str](), list[list](), dict[str, float]()

    def written(self, signals: Iterable[Signal]) -> Iterator[Signal]:
        """Give signals on, each as soon as it is written."""
        for signal in signals:
            if "wav" in self._formats:
                self._peaks[signal.unit] = max(self._peaks.get(signal.unit, 0.0), float(np.abs(signal.values).max()))
                self._files.append(checked_name(f"{signal.name}.wav"))
                write_wav(signal, self._folder / self._files[-1], full_scale=self._scales[signal.unit])
            if "quality" in self._formats and signal.unit == "Pa" and signal.steady:
                quality = sound_quality(signal.values, signal.rate)
                tones = " ".join(f"{tone:g}" for tone in quality.tones)
                self._rows.append([signal.name, quality.loudness, quality.tone_to_noise, quality.prominence, tones])
            yield signal

    def end(self) -> list[str]:
        """Write the table and warn of samples beyond the full scale; returns the names of all files."""
        for unit in [unit for unit, peak in self._peaks.items() if peak > self._scales[unit]]:
            text = (
                f"samples reach {self._peaks[unit]:.4g} {unit}, the full scale is {self._scales[unit]:g}: "
                "most players clip"
            )
            remedy = f"raise --{SCALES[unit].replace('_', '-')} to hear it"
            tell(Finding("W-CLIPPING", "", text, remedy=remedy), stacklevel=4)
        if self._rows:
            header = (
                "signal",
                "loudness [sone]",
                "tone-to-noise ratio [dB]",
                "prominence ratio [dB]",
                "tones [Hz]",
            )
            write_csv(self._folder / "sound_quality.csv", header, self._rows)
            self._files.append("sound_quality.csv")
        return self._files
