"""Entries of the case file on which a result depends: the one place that knows.

No stage takes the result of another case (`check_entries`), and what many cases have in common is computed
once (`Steps`): of equal entries a result is the same to the last digit.
"""

from __future__ import annotations

import hashlib
import json
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Set
from dataclasses import is_dataclass
from itertools import accumulate
from typing import TYPE_CHECKING, Any, TypeVar

from femgear.errors import CaseError
from femgear.remembered import remembered

if TYPE_CHECKING:
    from pydantic import BaseModel

    from femgear.case.planetary import Case
    from femgear.case.text import ReadCase

Entries = Mapping[str, object]
"""Values by dotted key."""
Result = TypeVar("Result")
_KEPT, _ROOM = 4, 256e6
"""Results of every step, and their size beyond which the oldest go [bytes]; the latest one stays."""
FLANK_ENTRIES = frozenset({"modifications", "errors", "individual", "pin_errors"})
"""Entries that do nothing but separate flanks: no grid knows them, and derivatives reach them."""

_GEARS = ("sun", "planet", "ring", "gear_1", "gear_2")
_LIMITS = {
    f"{of}material.{name}"
    for of in ("", *(f"{gear}." for gear in _GEARS))
    for name in ("root_stress_limit", "contact_stress_limit", "treatment", "grade", "hardness")
}
_OIL = {"lubricant", "losses"}
SPECTRUM_ENTRIES = {"operation.load_case", "operation.required_hours"}
_PLANET_RATINGS = {"planet.dynamic_rating", "planet.bearing_kind", "planet.bearing_pitch_diameter"}
"""Of lives and losses alone."""
_WORDS = {"format", "title", "housing", "runup", "strength", *_OIL, *_LIMITS, *SPECTRUM_ENTRIES, *_PLANET_RATINGS}
"""No stage before housing and run-up depends on them."""
_SUPPORTS = {"support_stiffness", "support_shaft", "bearing_stiffness", "bearing_clearance"}
_WIDTH = {"tilt_stiffness", "misalignment", "torque_end", "torsion_diameter"}
"""Of sun and planets in slices over the width: no grid knows them."""
_FOUNDATION = {"ring.foundation_radial", "ring.foundation_tangential"}
"""As the supports, without effect on the static solution while all members are fixed."""
_MACHINES = {"dynamics", "motor", "brake", "planar", "operation"}
_DYNAMIC = _WORDS | {"static.stresses", "static.members"}
"""What decides neither modes nor response."""
_COMPARED = {
    *("housing.published", "housing.measured", "housing.assumptions"),
    *("housing.level_limit", "housing.microphone.level_limit"),
}
"""What results are compared with, and whether others are computed to compare."""
_SOLUTION = {
    f"static.{name}" for name in ("positions", "peaks", "contact", "back_flanks", "stresses", "longest_record")
}
"""How the contact is solved, whatever the grids."""
_BESIDE = {
    "deflection": {"modes", "dynamics", "runup", "balance", "transient"},
    "stress": {"modes", "dynamics", "runup", "balance", "transient"},
    "modes": {"dynamics", "runup", "balance", "transient"},
    "dynamics": {"modes", "runup", "balance", "transient"},
    "runup": {"modes", "balance", "transient"},
    "balance": {"modes", "dynamics", "runup", "transient"},
    "transient": {"modes", "dynamics", "runup", "balance"},
}
"""Tables of a gearbox that are those of other stages, by stage."""
_HELIX = {"helical.helix_angle"}
"""All that the transverse section of helical gears depends on."""


def friction_entries(case: Any) -> Entries:
    """List the entries that decide the friction that acts on the gears; none where none does."""
    of_friction = _rubbing_entries(case)
    speed = {"operation.speeds": f"{case.operation.speeds[0]:.9g} rad/s of the input"} if of_friction else {}
    return {**of_friction, **speed}


def _rubbing_entries(case: Any) -> Entries:
    """Entries of oil and losses that decide the friction that acts; none where none does."""
    if getattr(case, "losses", None) is None or not case.losses.excites:
        return {}
    of_friction = {key: value for key, value in every_entry(case).items() if key.split(".")[0] in _OIL}
    for name in ("bearings", "torque_shares", "speed_shares"):
        of_friction.pop(f"losses.{name}", None)
    return of_friction


def static_entries(case: Any) -> Entries:
    """List the entries that decide the static solution; supports only where members move."""
    left_out, parts = _WORDS | _MACHINES | {"static.stresses", "helical"}, {"mass", "inertia", "density"}
    if case.static.members == "fixed":
        left_out, parts = left_out | _FOUNDATION, parts | _SUPPORTS
    # whatever member the torque is given for: the flanks see that of the sun
    sun = case.torque_on_first_gear()
    kept = _HELIX | ({"helical.hand"} if case.static.slices > 1 else set())
    torque = {"operation.torque": f"{sun:.9g} N m on the sun", **friction_entries(case)}
    return {**torque, **_entries(case, left_out, parts, kept=kept)}


def solution_entries(case: Any) -> Entries:
    """List all that decides the last digit of static solution and stresses: the torque as it is given too."""
    given = {key: value for key, value in every_entry(case).items() if key.startswith("operation.")}
    for name in ("operation.speeds", *SPECTRUM_ENTRIES):
        given.pop(name, None)
    return {**static_entries(case), **given, "static.stresses": case.static.stresses}


def stress_entries(case: Any) -> Entries:
    """List all that decides stresses: that of the static solution, and by what the nominal ones are rated."""
    return {**solution_entries(case), "strength": repr(case.strength)}


def loss_entries(case: ReadCase) -> Entries:
    """List all that decides losses beside the loads of the teeth: everything, as these go into torques and speeds."""
    return _entries(case, {"format", "title", "housing", "runup", "dynamics", "balance", "modes", "sensor"})


def state_entries(case: Case) -> Entries:
    """List the entries that decide the loaded state on the supports: neither masses nor what turns fast."""
    left_out = _DYNAMIC | {"operation.speeds", "dynamics", "motor", "brake"}
    return {**_entries(case, left_out, {"mass", "inertia", "density"}), **friction_entries(case)}


def modal_entries(case: Any) -> Entries:
    """List the entries that decide the modal basis: all but speeds, harmonics, tolerance and sensor."""
    kept = {"dynamics.damping_ratio", "dynamics.up_to"}
    return {**_entries(case, _DYNAMIC | {"operation.speeds", "dynamics"}, kept=kept), **friction_entries(case)}


def dynamic_entries(case: Case) -> Entries:
    """List the entries that decide the periodic response: all but the sensor of the level and microphone."""
    # a casing is known by the checksum of its files
    sensor_entries = ("form", "points", "sensor_angle", "microphone", "structure.file", "structure.nodes")
    left_out = (_DYNAMIC - {"housing"}) | {f"housing.{name}" for name in sensor_entries} | _COMPARED
    return {**friction_entries(case), **_entries(case, left_out)}


def response_entries(case: Case) -> Entries:
    """List the entries that decide the last digit of the response and of the level that it is judged by."""
    return {**dynamic_entries(case), "housing.sensor_angle": case.housing.sensor_angle}


def heard_entries(case: Case) -> Entries:
    """List the entries that decide what the housing's sensors and microphone hear: not what they are compared with."""
    return {**friction_entries(case), **_entries(case, (_DYNAMIC - {"housing"}) | _COMPARED)}


def runup_entries(case: Case) -> Entries:
    """List the entries that decide the run-up: those of what is heard, and its own."""
    return {**friction_entries(case), **_entries(case, (_DYNAMIC - {"housing", "runup"}) | _COMPARED)}


def box_entries(stage: str, case: ReadCase) -> Entries:
    """List the entries of a gearbox that decide a stage, which goes on from the deflection alone."""
    kept = {"modes.damping_ratio"} if stage in ("dynamics", "runup", "balance", "transient") else frozenset()
    rubbing = _rubbing_entries(case) if stage in ("modes", "dynamics", "runup", "balance") else {}
    entries = dict(_entries(case, {"format", "title"} | _OIL | _BESIDE[stage], kept=kept))
    # limits are compared with what sensors hear
    sensors: Any = entries["sensor"]
    entries["sensor"] = tuple({key: sensor[key] for key in sensor if key != "level_limit"} for sensor in sensors)
    return {**entries, **rubbing}


def load_case_entries(case: ReadCase, load_case: BaseModel) -> Entries:
    """List the entries of a gearbox that decide its state under one load case: not the others, nor its share."""
    others = _BESIDE["deflection"] | _OIL | {"format", "title", "sensor", "operation.first", *SPECTRUM_ENTRIES}
    of_load_case = load_case.model_dump(exclude={"name", "share", "hours"})
    return {**_entries(case, others), **{f"load case.{key}": value for key, value in _flat(of_load_case)}}


def every_entry(case: ReadCase) -> Entries:
    """List all entries, of which a stage that names none may take any."""
    return {key: value for key, value, *_ in _entries_of(case)}


def compliance_entries(case: Case) -> Entries:
    """List the entries that decide grids and flank compliances: shapes, material, a ring that moves."""
    fixed = case.static.members == "fixed"
    return {key: value for key, value in ring_entries(case).items() if not (fixed and key in _FOUNDATION)}


def ring_entries(case: Case) -> Entries:
    """List the entries that decide modes and compliances of the ring, but for their number."""
    left_out = _WORDS | _SOLUTION | _MACHINES | {"carrier", "helical"}
    return _entries(case, left_out, FLANK_ENTRIES | _SUPPORTS | _WIDTH | {"mass", "inertia"}, kept=_HELIX)


def _entries(case: Any, left_out: Set[str], parts: Set[str] = frozenset(), *, kept: Set[str] = frozenset()) -> Entries:
    """Entries without tables and keys that are left out, but for those kept, and without parts of keys."""
    return {
        key: value
        for key, value, within, parts_of_key in _entries_of(case)
        if (key in kept or left_out.isdisjoint(within)) and parts.isdisjoint(parts_of_key)
    }


@remembered(latest=16)
def _entries_of(case: ReadCase) -> list[tuple[str, object, list[str], list[str]]]:
    """Dotted keys and values, with the keys of the tables around each and its own, and its parts."""
    entries = []
    for key, value in _flat(case.model_dump()):
        parts = key.split(".")
        entries.append((key, value, [*accumulate(parts, "{}.{}".format)], parts))
    return entries


def check_entries(result: Any, kind: type, case_entries: Entries, words: str) -> None:
    """Refuse a result of another case, or what is no such result; the words name it: ``"static solution"``.

    The result has the ``entries`` of the case that it belongs to; those of the case at hand are the same.
    CaseError: another kind of result, or its dataset (E-TYPE); E-OTHER-CASE, naming the entries that differ.
    """
    if not isinstance(result, kind):
        raise CaseError(
            f"a {words} is needed, not a {type(result).__name__}",
            code="E-TYPE",
            limit=f"a {kind.__name__}",
            remedy="compute the stage: files of results hold numbers alone, from which no stage goes on",
        )
    entries: Entries = result.entries
    keys = sorted(entries.keys() | case_entries.keys())
    differ = [key for key in keys if entries.get(key) != case_entries.get(key)]
    if not differ:
        return
    shown = ", ".join(f"{key} ({_show(entries.get(key))})" for key in differ[:4])
    more = f" and {len(differ) - 4} more" if len(differ) > 4 else ""
    raise CaseError(
        f"the {words} is that of another case, which differs in {shown}{more}",
        code="E-OTHER-CASE",
        key=differ[0],
        value=_show(case_entries.get(differ[0])),
        limit=f"{_show(entries.get(differ[0]))}, with which the {words} was computed",
        remedy=f"compute the {words} of this case, or take the case that it belongs to",
    )


class Steps:
    """Results of steps that several cases share: the latest few of each, by the entries they depend on."""

    def __init__(self):
        self._found: dict[str, OrderedDict[str, tuple[Any, float]]] = {}

    def kept(self, step: str, entries: Entries) -> Any:
        """Give the result of a step for these entries, all that decide it; None where it is not kept."""
        key, results = fingerprint(entries), self._found.setdefault(step, OrderedDict())
        if key not in results:
            return None
        results.move_to_end(key)
        return results[key][0]

    def keep(self, step: str, entries: Entries, result: Result) -> Result:
        """Keep the result of a step for these entries, and return it."""
        key, results = fingerprint(entries), self._found.setdefault(step, OrderedDict())
        # a result that is kept again has its size still
        size = results[key][1] if key in results and results[key][0] is result else _size(result)
        results[key] = result, size
        results.move_to_end(key)
        while len(results) > 1 and (len(results) > _KEPT or sum(size for _, size in results.values()) > _ROOM):
            results.popitem(last=False)
        return result


def _size(result: object) -> float:
    """Memory of the arrays of a result [bytes], roughly."""
    if isinstance(result, float | int | str):  # most of what long tuples hold
        return 0
    if isinstance(result, tuple | list):
        return sum(map(_size, result))
    if is_dataclass(result):
        return sum(_size(value) for value in vars(result).values())
    return getattr(result, "nbytes", 0)


def fingerprint(entries: Entries) -> str:
    """Compute the SHA-256 of entries, whatever their order, as hexadecimal text."""
    return hashlib.sha256(json.dumps(dict(entries), sort_keys=True, default=str).encode()).hexdigest()


def _flat(value: object, name: str = "") -> Iterator[tuple[str, object]]:
    """Dotted keys and values of nested tables, without entries that are left out."""
    if isinstance(value, dict) and (value or not name):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}" if name else str(key))
    elif value is not None:
        yield name, value


def _show(value: object) -> str:
    """A value in a message, of at most 60 characters."""
    text = "not given" if value is None else f"{value:.12g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
