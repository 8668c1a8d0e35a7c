"""Load cases of a case of teeth and what they are of its life: shares of the running time, or hours.

Trains that rate teeth share these entries and their refusals: those of a gearbox stand in its own section of load
cases, with a torque of every load and the speeds of its shafts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.iso6336_life import PITTING

SHARES_SUM = 1e-3
"""By how much shares may miss the whole, as those of rounded per cents do; they count by their sum."""


def load_case_names(load_cases: Sequence[Any]) -> list[str]:
    """List the names of load cases: as given, else by their numbers."""
    return [load_case.name or f"load case {number}" for number, load_case in enumerate(load_cases, 1)]


def running_shares(load_cases: Sequence[Any]) -> np.ndarray:
    """Find the shares (c,) of the running time, which add up to 1, of checked load cases."""
    parts = np.array([load_case.share if load_case.hours is None else load_case.hours for load_case in load_cases])
    return parts / math.fsum(parts)


def required_life(operation: Any) -> float | None:
    """Find the life that an operation asks for [h]: as given, else all hours of its load cases; None of neither."""
    if operation.required_hours is not None:
        return operation.required_hours
    hours = [load_case.hours for load_case in operation.load_case]
    return math.fsum(hours) if hours and None not in hours else None


def check_running_shares(operation: Any) -> Iterator[CaseError]:
    """Refuse load cases whose shares or hours do not go together, names given twice, and hours without load cases."""
    load_cases = operation.load_case
    if operation.required_hours is not None and not load_cases:
        yield CaseError(
            "a life is that of load cases, and there are none",
            code="E-KEY-MISSING",
            key="operation.required_hours",
            value=operation.required_hours,
            remedy="give [[operation.load_case]] with torque, speed and share, or leave required_hours out",
        )
    by_hours = [load_case.hours is not None for load_case in load_cases]
    for number, load_case in enumerate(load_cases):
        key = f"operation.load_case[{number}]"
        if any(by_hours) and not by_hours[number]:
            yield CaseError(
                "other load cases have hours, and this one has none",
                code="E-KEY-MISSING",
                key=f"{key}.hours",
                limit="hours of all load cases, or shares of all",
                remedy="give its hours, or the share of every load case",
            )
        if by_hours[number] and "share" in load_case.model_fields_set:
            remedy = "keep one of them"
            yield CaseError("hours and share say the same", code="E-DUPLICATE", key=f"{key}.hours", remedy=remedy)
    if load_cases and not any(by_hours):
        yield from _shares_of_the_whole(load_cases)


def _shares_of_the_whole(load_cases: Sequence[Any]) -> Iterator[CaseError]:
    """Shares that add up to the running time."""
    total = math.fsum(load_case.share for load_case in load_cases)
    if abs(total - 1.0) <= SHARES_SUM:
        return
    missing = [n for n, load_case in enumerate(load_cases) if "share" not in load_case.model_fields_set]
    what = "without a share of its own a load case has the whole time; " if missing else ""
    yield CaseError(
        f"{what}the shares of the load cases are not the running time in all",
        code="E-RANGE",
        key=f"operation.load_case[{missing[0] if missing else 0}].share",
        value=f"{total:.6g} in all",
        limit="1 in all",
        remedy="give every load case its share of the time in which the gears run, or its hours",
    )


def check_load_spectrum(case: Any) -> Iterator[CaseError]:
    """Refuse load cases of a set or a pair that do not go together, and pitting that materials have no line of."""
    yield from check_running_shares(case.operation)
    seen: dict[str, int] = {}
    for number, name in enumerate(load_case_names(case.operation.load_case)):
        if name in seen:
            yield CaseError(
                f"the name is that of operation.load_case[{seen[name]}] already",
                code="E-DUPLICATE",
                key=f"operation.load_case[{number}].name",
                value=name,
                remedy="give every load case a name of its own",
            )
        seen.setdefault(name, number)
    yield from check_pitting(case)


def without_line(case: Any) -> list[str]:
    """List the gears of a case that have no treatment, and with it no line of life."""
    return [name for name in case.gear_names if _treatment(case, name) is None]


def has_rated_bearings(case: Any) -> bool:
    """Tell whether the bearings of the planets of a case have a rating."""
    return getattr(getattr(case, "planet", None), "dynamic_rating", None) is not None


def spectrum_notices(case: Any) -> Iterator[Finding]:
    """List gears whose lives load cases do not give for want of a treatment or a torque (W-UNUSED)."""
    if not case.operation.load_case:
        return
    if not any(load_case.torque for load_case in case.operation.load_case):
        remedy = 'give one of them a torque, as in torque = "300 N m"'
        yield Finding("W-UNUSED", "operation.load_case", "have no effect on teeth: none has a torque", remedy=remedy)
    lacking = without_line(case)
    if len(lacking) == len(case.gear_names) and has_rated_bearings(case):
        return
    every = len(lacking) == len(case.gear_names)
    if lacking:
        gears = ", ".join(name.replace("_", " ") for name in lacking)
        text = (
            "have no effect: no material has a treatment, whose line lives follow" if every else f"give {gears} no life"
        )
        keys = "material.treatment" if every else ", ".join(f"{name}.material.treatment" for name in lacking)
        yield Finding(
            "W-UNUSED", "operation.load_case", text, remedy=f'give {keys} = "case hardened steel" or the like'
        )


def check_pitting(case: Any) -> Iterator[CaseError]:
    """Refuse limited pitting of materials for which ISO 6336-2 has no such line."""
    if case.strength.pitting != "limited":
        return
    treatments = {name: _treatment(case, name) for name in case.gear_names}
    wrong = {name: treatment for name, treatment in treatments.items() if treatment and treatment not in PITTING}
    if wrong:
        name, treatment = next(iter(wrong.items()))
        yield CaseError(
            f"ISO 6336-2 has no line of {treatment} that pits to a limited extent ({name.replace('_', ' ')})",
            code="E-CHOICE",
            key="strength.pitting",
            value="limited",
            limit="'none' of this material",
            remedy='write pitting = "none"',
        )


def _treatment(case: Any, gear: str) -> str | None:
    """Treatment of a gear, whether or not its hardness has limits."""
    section = getattr(case, gear).material
    given = None if section is None else section.treatment
    return given or case.material.treatment
