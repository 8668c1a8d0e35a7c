"""What an engineer wants to read first: the numbers of a run, and every warning of a case and its results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femgear.report.tables import Block

if TYPE_CHECKING:
    from femgear.errors import Finding
    from femgear.storage.results import Results
    from femgear.trains.protocol import Train


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
    return tuple(dict.fromkeys(train.result_warnings(results)))
