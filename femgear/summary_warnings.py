"""Every warning of a case and of its results, for terminal and report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.casefile.drivetrain import DrivetrainCase
from femgear.summary import warnings_of
from femgear.summary_drivetrain import drivetrain_warnings
from femgear.summary_planar import planar_verdicts
from femgear.summary_transient import transient_warnings

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case import Case
    from femgear.storage import Results

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
        from femgear.case import planetary_set

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
