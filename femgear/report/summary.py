"""What an engineer wants to read first: the gears of a case, and the numbers of a run.

Every warning of a case and of its results, for terminal and report.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.tables import Block
from femgear.trains.drivetrain.results import (
    describe_drivetrain,
    describe_drivetrain_modes,
    describe_spectrum,
    describe_transient,
    drivetrain_warnings,
    transient_warnings,
)
from femgear.trains.drivetrain.section import DrivetrainCase
from femgear.trains.elastic.results import _dynamics, _housing, _modes
from femgear.trains.helical.results import describe_helical_static
from femgear.trains.planar.results import describe_branch, describe_response, planar_verdicts
from femgear.trains.static.description import describe_case, warnings_of
from femgear.trains.static.results import _static, describe_stress

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.sections import Case
    from femgear.storage.results import Results


def describe(case: Case | DrivetrainCase) -> tuple[Block, ...]:
    """Blocks of any kind of case: its title first, its warnings last."""
    if isinstance(case, DrivetrainCase):
        return describe_drivetrain(case)
    from femgear.case.case import planetary_set

    return describe_case(case, planetary_set(case))


def describe_results(results: Results) -> tuple[Block, ...]:
    """The numbers of a run, one block a stage.

    Parameters
    ----------
    results : Results

    Returns
    -------
    tuple of Block
    """
    describe = {
        "static": _static,
        "stress": describe_stress,
        "modes": _modes,
        "dynamics": _dynamics,
        "housing": _housing,
        "branch": describe_branch,
        "response": describe_response,
        "transient": describe_transient,
        "spectrum": describe_spectrum,
    }
    if isinstance(results.case, DrivetrainCase):
        describe["modes"] = describe_drivetrain_modes
    elif results.case.helical is not None:
        modes = results.modes if "modes" in results.stages else None
        describe["static"] = lambda data: describe_helical_static(data, modes)
    blocks = [describe[stage](getattr(results, stage)) for stage in results.stages]
    timings = ((stage, f"{seconds:.2f}") for stage, seconds in results.manifest.timings.items())
    return (*blocks, Block("Time", ("stage", "[s]"), tuple(timings)))


_SHOWN = 8


def case_warnings(case: Case | DrivetrainCase) -> tuple[str, ...]:
    """What a case of any kind is allowed to be but deserves a look: sentences that begin with ``[W-...]``.

    Raises
    ------
    FemgearError
        What cannot be computed at all.
    """
    if isinstance(case, DrivetrainCase):
        found = drivetrain_warnings(case)
    else:
        from femgear.case.case import planetary_set

        found = warnings_of(case, planetary_set(case))
    return tuple(dict.fromkeys(found))


def result_warnings(results: Results) -> tuple[str, ...]:
    """What the solvers say against their own results, in sentences."""
    branch, response = (
        getattr(results, stage) if stage in results.stages else None for stage in ("branch", "response")
    )
    found = list(planar_verdicts(branch, response))
    if "transient" in results.stages:
        found += transient_warnings(results.transient)
    if "dynamics" in results.stages:
        found += _of_dynamics(results.dynamics)
    return tuple(dict.fromkeys(found))


def _of_dynamics(data: xr.Dataset) -> Iterator[str]:
    if warnings := str(data.attrs.get("warnings", "")):
        yield from (f"[{text.strip()}" for text in warnings.split("[") if text)
    speed = data["speed"].values
    for bad, text in (
        (~data["converged"].values.astype(bool), "the periodic solution did not converge at"),
        (~data["stable"].values.astype(bool), "the periodic solution is unstable at"),
    ):
        if bad.any():
            shown = ", ".join(f"{value:.6g}" for value in speed[bad][:_SHOWN])
            rest = np.count_nonzero(bad) - _SHOWN
            yield f"{text} {shown} rpm{f' and {rest} more speeds' if rest > 0 else ''}"
