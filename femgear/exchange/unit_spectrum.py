"""Load spectrum of a REXS unit: shares of the time of its load cases, and load cases of the life of a stage.

Written load cases of no duration are the points of operation of a case beside its life.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from femgear.case.quantities import RPM
from femgear.exchange.rexs import Model
from femgear.findings import NOTE

LoadCase = Mapping[str, Mapping[str, tuple[str, str | None]]]
"""Attributes, with their units, of the components of a load case by their ids."""
_FRACTIONS: Mapping[str | None, float] = {"%": 0.01}
_HOURS: Mapping[str | None, float] = {"h": 1.0, "min": 1.0 / 60.0, "s": 1.0 / 3600.0, "d": 24.0}
_WHOLE = 1e-6


def load_case_shares(cases: Sequence[LoadCase]) -> list[float | None]:
    """Find the shares of the time of load cases: their fractions, else their durations where all have one.

    None of a load case that says neither.
    """
    shares = [_first(given, "load_duration_fraction", _FRACTIONS) for given in cases]
    if any(share is not None for share in shares):
        return shares
    hours = [_first(given, "load_duration", _HOURS) for given in cases]
    given = [value for value in hours if value is not None]
    return [value / sum(given) for value in given] if len(given) == len(cases) and any(given) else shares


def load_duration(load_case: Any, share: float) -> dict[str, tuple[float, str]]:
    """Attribute of REXS, SI value and unit, that says for how long a load case runs: its hours, else its share [1]."""
    if load_case.hours is not None:
        return {"load_duration": (3600.0 * load_case.hours, "h")}
    return {"load_duration_fraction": (share, "%")}


def tell_life_left_out(operation: Any, tell: Callable[..., None]) -> None:
    """Tell what of load cases REXS has no form for, or gives back otherwise; ``tell`` is that of a unit."""
    load_cases = operation.load_case
    if operation.required_hours is not None:
        remedy = "give it again after import"
        tell("operation.required_hours", "REXS has no life that is asked for: left out", remedy=remedy)
    if any(load_case.hours is not None for load_case in load_cases):
        text = "hours come back as shares of the running time"
        tell("operation.load_case", text, severity=NOTE, remedy="give operation.required_hours after import")


def _first(given: LoadCase, name: str, units: Mapping[str | None, float]) -> float | None:
    """First value of an attribute in a load case, by the size of its unit."""
    values = (attributes.get(name) for attributes in given.values())
    return next((float(value) * units.get(unit, 1.0) for value, unit in filter(None, values)), None)


def share_time(load_cases: Sequence[dict[str, Any]], model: Model) -> None:
    """Give load cases without shares equal ones, and bring shares of more or less than the whole time to it."""
    given = [load_case["share"] for load_case in load_cases if "share" in load_case]
    if len(load_cases) > 1 and len(given) < len(load_cases):
        left = max(1.0 - sum(given), 0.0) / (len(load_cases) - len(given))
        for load_case in load_cases:
            load_case.setdefault("share", float(f"{left or 1.0 / len(load_cases):.12g}"))
        model.remark("operation", "the file does not tell the shares of all load cases: equal ones are assumed")
    total = sum(load_case.get("share", 1.0) for load_case in load_cases)
    if load_cases and abs(total - 1.0) > _WHOLE:
        for load_case in load_cases:
            load_case["share"] = float(f"{load_case['share'] / total:.12g}")
        model.remark("operation", f"the shares of the load cases are {total:.4g} in all: they are divided by it")


def spectrum_tables(
    model: Model, torques: Sequence[float | None], speeds: Sequence[float], shares: Sequence[float | None]
) -> list[dict[str, Any]]:
    """Make the load cases of the life of a stage: none of fewer than two, nor of those that differ in the speed alone.

    Parameters
    ----------
    model : Model
        The unit, whose findings say which load cases are left out.
    torques : sequence of float or None
        Of the input of the stage in every load case [N m].
    speeds : sequence of float
        [rad/s]
    shares : sequence of float or None
        Of the time.
    """
    alike = not any(share is not None for share in shares) and len({*torques}) < 2
    if len(model.load_cases) < 2 or alike:
        return []
    tables, beside = [], shares.count(0.0)  # load cases without duration are points of operation
    for number, (torque, speed, share) in enumerate(zip(torques, speeds, shares, strict=True), start=1):
        if share == 0.0:
            continue
        if torque is None or not speed:
            what = "torque" if torque is None else "speed"
            model.remark("operation", f"load case {number} has no {what} in this stage: its life is without it")
            continue
        table = {"name": f"load case {number - beside}", "torque": f"{torque:.12g} N m"}
        table["speed"] = f"{speed / RPM:.12g} rpm"
        tables.append(table | ({} if share is None else {"share": float(f"{share:.12g}")}))
    if len(tables) < (1 if beside else 2):
        return []
    share_time(tables, model)
    return tables
