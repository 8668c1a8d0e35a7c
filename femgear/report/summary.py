"""What an engineer wants to read first: the numbers of a run, and every warning of a case and its results."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from femgear.report.tables import Block

if TYPE_CHECKING:
    from femgear.errors import Finding
    from femgear.storage.results import Results
    from femgear.trains.protocol import Train


def describe_case(train: Train, case) -> tuple[Block, ...]:
    """Tabulate a case: its title, what its train says about it, and its warnings."""
    warnings = tuple(map(str, train.warnings(case)))
    return Block(case.title), *train.describe(case), Block("Warnings", notes=warnings or ("none",))


def describe_results(train: Train, results: Results) -> tuple[Block, ...]:
    """Tabulate the numbers of a run, one block a stage, and the time that each took.

    Parameters
    ----------
    train : Train
        Of the case.
    results : Results

    """
    blocks = [stage.describe(results) for stage in train.stages if stage.name in results.stages]
    timings = ((stage, f"{seconds:.2f}") for stage, seconds in results.manifest.timings.items())
    return (*blocks, Block("Time", ("stage", "[s]"), tuple(timings)))


def case_warnings(train: Train, case) -> tuple[Finding, ...]:
    """What a case is allowed to be but deserves a look, each once.

    Raises
    ------
    FemgearError
        What cannot be computed at all.
    """
    return tuple(dict.fromkeys(train.warnings(case)))


def result_warnings(train: Train, results: Results) -> tuple[Finding, ...]:
    """What the solvers say against their own results, each once."""
    found = (stage.warnings(results[stage.name]) for stage in train.stages if stage.name in results.stages)
    return tuple(dict.fromkeys(chain.from_iterable(found)))
