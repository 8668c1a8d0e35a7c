"""Entries of the case file on which a result depends, so that no stage takes the result of another case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.case.sections import Case

Entries = Mapping[str, object]
"""Values by dotted key."""

_WORDS = {"format", "title", "housing"}
"""No stage before the housing depends on them."""
_INERT = {"mass", "inertia", "density"}
"""Nothing static depends on them."""
_SUPPORTS = {"support_stiffness", "support_shaft", "bearing_stiffness", "bearing_clearance"}
_FOUNDATION = {"ring.foundation_radial", "ring.foundation_tangential"}
"""As the supports, without effect on the static solution while all members are fixed."""


def static_entries(case: Case) -> Entries:
    """Entries that decide the static solution: flanks, bodies, loads; supports only where members move."""
    from femgear.case.case import planetary_set
    from femgear.gears.kinematics import torques

    left_out = _WORDS | {"dynamics", "motor", "brake", "planar", "operation", "static.stresses"}
    fixed = case.static.members == "fixed"
    # whatever member the torque is given for: the flanks see that of the sun
    sun = torques(planetary_set(case), member=case.operation.input, torque=case.operation.torque).sun
    return {"operation.torque": f"{sun:.9g} N m on the sun"} | {
        key: value
        for key, value in _flat(case.model_dump())
        if not _begins(key, left_out)
        and not (key.startswith("helical.") and key != "helical.helix_angle")
        and key.split(".")[-1] not in _INERT
        and not (fixed and (key in _FOUNDATION or key.split(".")[-1] in _SUPPORTS))
    }


def modal_entries(case: Case) -> Entries:
    """Entries that decide the modal basis: all but speeds, number of harmonics, tolerance and sensor."""
    left_out = _WORDS | {"operation.speeds", "static.stresses", "static.members"}
    kept = {"dynamics.damping_ratio", "dynamics.up_to"}
    return {
        key: value
        for key, value in _flat(case.model_dump())
        if not _begins(key, left_out) and (key in kept or not key.startswith("dynamics."))
    }


def dynamic_entries(case: Case) -> Entries:
    """Entries that decide the periodic response: all but the sensor."""
    left_out = _WORDS | {"static.stresses", "static.members"}
    return {key: value for key, value in _flat(case.model_dump()) if not _begins(key, left_out)}


def check_entries(entries: Entries, case_entries: Entries, result: str) -> None:
    """Refuse a result of another case.

    Parameters
    ----------
    entries : mapping
        Of the case that the result belongs to.
    case_entries : mapping
        The same entries of the case at hand.
    result : str
        What the result is, such as ``"static solution"``.

    Raises
    ------
    CaseError
        E-OTHER-CASE, naming the entries that differ.
    """
    keys = sorted(entries.keys() | case_entries.keys())
    differ = [key for key in keys if entries.get(key) != case_entries.get(key)]
    if not differ:
        return
    shown = ", ".join(f"{key} ({_show(entries.get(key))})" for key in differ[:4])
    more = f" and {len(differ) - 4} more" if len(differ) > 4 else ""
    raise CaseError(
        f"the {result} is that of another case, which differs in {shown}{more}",
        code="E-OTHER-CASE",
        key=differ[0],
        value=_show(case_entries.get(differ[0])),
        limit=f"{_show(entries.get(differ[0]))}, with which the {result} was computed",
        remedy=f"compute the {result} of this case, or take the case that it belongs to",
    )


def _flat(value: object, name: str = "") -> Iterator[tuple[str, object]]:
    """Dotted keys and values of nested tables, without entries that are left out."""
    if isinstance(value, dict) and (value or not name):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}" if name else str(key))
    elif value is not None:
        yield name, value


def _begins(key: str, names: set[str]) -> bool:
    """Whether a key is one of the names or lies below one."""
    return any(key == name or key.startswith(f"{name}.") for name in names)


def _show(value: object) -> str:
    """A value in a message, of at most 60 characters."""
    text = "not given" if value is None else f"{value:.12g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
