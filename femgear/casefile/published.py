"""Published lines: they are compared only where the case computes their speed and harmonic."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from femgear.casefile.units import SPEED
from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.casefile.sections import Case

CODE = "E-PUBLISHED"


def check_published(case: Case) -> Iterator[CaseError]:
    """Refusals of published lines that nothing could be compared with."""
    for i, entry in enumerate(case.housing.published):
        key = f"housing.published[{i}]"
        if not any(math.isclose(entry.speed, speed, rel_tol=1e-9) for speed in case.operation.speeds):
            yield CaseError(
                "this speed is not computed",
                code=CODE,
                key=f"{key}.speed",
                value=SPEED.show(entry.speed),
                limit=_speeds(case),
                remedy="add it to operation.speeds, or leave the published lines out",
            )
        computed = case.response_harmonics
        if computed is not None and entry.harmonic > computed:
            yield CaseError(
                "this mesh harmonic is not computed",
                code=CODE,
                key=f"{key}.harmonic",
                value=entry.harmonic,
                limit=f"1 to {computed}, the harmonics of the response",
                remedy="raise dynamics.response_harmonics, or leave the published lines out",
            )


def _speeds(case: Case) -> str:
    shown = [SPEED.show(speed) for speed in case.operation.speeds[:6]]
    more = len(case.operation.speeds) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def without_uncomputed(data: dict, error: CaseError) -> str | None:
    """Take those published lines out of the tables of a case to which alone an error objects.

    Parameters
    ----------
    data : dict
        Tables of a case file; modified.
    error : CaseError
        Of the check of the case.

    Returns
    -------
    str or None
        What was left out, in words; None where the error is about other things too.
    """
    problems = getattr(error, "problems", ())
    if not problems or any(problem.code != CODE for problem in problems):
        return None
    numbers = {int(problem.key.split("[")[1].split("]")[0]) for problem in problems}
    published = data["housing"]["published"]
    data["housing"]["published"] = [e for i, e in enumerate(published) if i not in numbers]
    return (
        f"{len(numbers)} of {len(published)} entries housing.published are left out: their speed or harmonic "
        "is not computed"
    )
