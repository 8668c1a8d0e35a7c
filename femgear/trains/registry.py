"""The trains that femgear knows, and the stages of a case."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, cast

from femgear.case.text import CaseFile, described
from femgear.errors import CaseError, FemgearError
from femgear.findings import Finding, tell

if TYPE_CHECKING:
    from femgear.measured.heard_set import HeardSet
    from femgear.stages.protocol import Stage, Train
    from femgear.storage.results import Results


@dataclass(frozen=True)
class Known:
    """A train by its ``name``; what `reads` its cases, and what `solves` them, is imported when a case is one of it.

    ``key`` is the table of the case file that makes a planetary set one of it, and the field of the model;
    ``"model"`` where a file of its own names it there, ``""`` for sets without such a table.
    """

    name: str
    key: str
    reads: str
    solves: str

    file = property(lambda self: cast(CaseFile, resolve_name(self.reads)))
    train = property(lambda self: cast("Train", resolve_name(self.solves)))


FORMER = {
    "multistage": (
        "femgear.trains.gearbox.multistage_cases:MultistageFile",
        "femgear.trains.gearbox.multistage_cases:gearbox_of_multistage",
    ),
    "drivetrain": (
        "femgear.trains.gearbox.drivetrain_cases:DrivetrainFile",
        "femgear.trains.gearbox.drivetrain_cases:gearbox_of_drivetrain",
        "femgear.trains.gearbox.drivetrain_cases:embed_drivetrain",
    ),
}
"""Models of files whose train is no more, each with the section that reads its tables, what makes those of today and
the findings on what these have not of it, and what puts tables in the place of files that it names."""
GROUP = "femgear.trains"
"""Entry points of other packages; the name is that of the train, the value a module with FILE and TRAIN."""

TRAINS = tuple(
    Known(name, key, f"femgear.{reads}:FILE", f"femgear.trains.{folder}.stages:{name.upper()}")
    for name, key, folder, reads in (
        ("gear_pair", "model", "impacts", "trains.impacts.case_file"),
        ("pair", "model", "pair", "trains.pair.case_file"),
        ("gearbox", "model", "gearbox", "trains.gearbox.checks"),
        ("helical", "helical", "helical", "trains.helical.section"),
        ("planar", "planar", "planar", "trains.planar.section"),
        ("elastic", "", "elastic", "case.planetary"),
    )
)


@dataclass(frozen=True)
class Installed(Known):
    """A train of another ``package``, by an entry point of the group `GROUP`."""

    package: str

    file = property(lambda self: self._loaded(self.reads, lambda file: file.model.train))
    train = property(lambda self: self._loaded(self.solves, lambda train: train.name))

    def _loaded(self, place: str, name_of: Callable[[object], str]) -> Any:
        """Load what stands at a place; a package that fails or names it otherwise is refused (E-LIBRARY)."""
        try:
            loaded = resolve_name(place)
            if (name := name_of(loaded)) != self.name:
                raise ValueError(f"{place} is of {name}")
        except (Exception, SystemExit) as error:
            raise FemgearError(
                f"the train {self.name} of the package {self.package} cannot be loaded: "
                f"{type(error).__name__}: {' '.join(str(error).split())}",
                code="E-LIBRARY",
                remedy=f"update {self.package} or remove it",
            ) from error
        return loaded


def trains() -> tuple[Known, ...]:
    """List the trains of femgear and those of other installed packages, none of which is loaded for it.

    Of two of one name the first is kept, femgear's own before all others; the other one is told (W-PLUGIN).
    """
    trains_of_names = {train.name: train for train in TRAINS}
    for installed in _installed():
        first = trains_of_names.setdefault(installed.name, installed)
        if first is not installed:
            _tell_taken(installed, getattr(first, "package", "femgear"))
    return tuple(trains_of_names.values())


@cache
def _tell_taken(installed: Installed, first: str) -> None:
    """Tell once that a package has a train of a name that is taken."""
    text = f"the package {installed.package} has a train {installed.name}, and so has {first}, whose is taken"
    remedy = f"remove {installed.package}, or rename its train"
    tell(Finding("W-PLUGIN", "", text, remedy=remedy), stacklevel=3)


def stage_names() -> list[str]:
    """List the names of the stages of all trains, but of those that cannot be loaded."""
    names = dict[str, None]()
    for train in trains():
        with suppress(FemgearError):
            names |= dict.fromkeys(stage.name for stage in train.train.stages)
    return list(names)


@cache
def _installed() -> tuple[Installed, ...]:
    """Trains of other packages: each entry point of the group is a module with FILE and TRAIN."""
    from importlib.metadata import entry_points

    return tuple(
        Installed(
            entry_point.name,
            "model",
            f"{entry_point.module}:FILE",
            f"{entry_point.module}:TRAIN",
            entry_point.dist.name if entry_point.dist else "",
        )
        for entry_point in sorted(entry_points(group=GROUP))
    )


def train_of(case) -> Train:
    """Find the train that a case is one of; other things are refused (E-TYPE)."""
    for train in trains():
        if train.name == getattr(case, "train", None):
            return train.train
    raise CaseError(f"a case is needed, not {described(case)}", code="E-TYPE", remedy="femgear.read_case reads one")


def same_train(runs: Sequence[Results]) -> Train:
    """Find the train that all runs are of.

    Raises
    ------
    CaseError
        E-CHOICE: they are of several.
    """
    first, *others = runs
    train = train_of(first.case)
    for run in others:
        if (other := train_of(run.case)).name != train.name:
            message = f"{first.folder} is {train.words}, {run.folder} {other.words}"
            raise CaseError(message, code="E-CHOICE", remedy="compare runs of cases of one kind")
    return train


def stages_of(case, only: str | None = None) -> tuple[Stage, ...]:
    """List the stages to compute, in order.

    Parameters
    ----------
    only : str, optional
        Last stage; it is computed with what it needs, whatever the case says of it.

    Raises
    ------
    CaseError
        E-STAGE: the case has no such stage.
    """
    train = train_of(case)
    if only is None:
        return tuple(stage for stage in train.stages if stage.wanted(case) and not stage.unavailable(case))
    last = train.stage(only)
    why = f"it is no stage of {train.words}" if last is None else last.unavailable(case)
    if why:
        allowed = [stage.name for stage in train.stages if not stage.unavailable(case)]
        stands_in = train.stands_in.get(only) if last is None else None
        raise CaseError(
            f"no stage {only}: {why}",
            code="E-STAGE",
            key="only",
            value=only,
            limit=", ".join(allowed),
            remedy=f"--only {stands_in} computes it here" if stands_in else None,
        )
    needs, needed = {stage.name: stage.before(case) for stage in train.stages}, {only}
    while more := {stage for name in needed for stage in needs[name]} - needed:
        needed |= more
    return tuple(stage for stage in train.stages if stage.name in needed)


def check_case(case, only: str | None = None) -> None:
    """Refuse what the stages of a run cannot represent, before anything is computed.

    Raises
    ------
    CaseError, GeometryError
        They name the file of the case, and the line of the entry.
    """
    for check in dict.fromkeys(stage.check for stage in stages_of(case, only)):
        if check is not None:
            try:
                check(case)
            except FemgearError as error:
                for problem in (error, *error.problems):
                    problem.file = problem.file or case.location(problem.key or "")
                raise


def heard_in(case: Any, stage: str | None = None) -> HeardSet:
    """Choose what the lines on a housing depend on: a set, or a planetary stage of a gearbox by its name.

    CaseError: a stage that there is not, or several of which none is named (E-CHOICE), and those of `heard_set`.
    """
    from femgear.measured.heard_set import heard_set

    stages_of_case = train_of(case).recorded_stages
    if stages_of_case is None:
        if stage is not None:
            message, remedy = "a set of its own has no stages", "leave it out"
            raise CaseError(message, code="E-ARGUMENTS", key="--stage", value=stage, remedy=remedy)
        return heard_set(case)
    stages = stages_of_case(case)
    if not stages:
        message = "no planetary stage of the gearbox has a ring that stands still and a carrier that turns"
        raise CaseError(message, code="E-MODEL", key="planetary", remedy="give speeds to the load case")
    name = next(iter(stages)) if stage is None and len(stages) == 1 else stage
    if name is None or name not in stages:
        names = ", ".join(f'"{known_name}"' for known_name in stages)
        message = "the gearbox has several planetary stages" if name is None else f"there is no planetary stage {name}"
        raise CaseError(message, code="E-CHOICE", key="--stage", value=stage, limit=names, remedy="name one by --stage")
    return stages[name]
