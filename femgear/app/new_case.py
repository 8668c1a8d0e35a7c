"""A new case from what was typed into a few fields: its text, or what is wrong in each of them, all at once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from femgear.app.form import sentence_of
from femgear.errors import CaseError, FemgearError, one_line
from femgear.trains.drafts import KINDS, NamedSteel, ToothForm, new_case
from femgear.trains.planets_draft import PLANET_KINDS
from femgear.trains.reading import parse_case
from femgear.trains.registry import check_case

LABELS = {
    "kind": "Kind",
    "name": "Name of the file",
    "teeth": "Teeth",
    "planets": "Number of planets",
    "module": "Module",
    "face_width": "Face width",
    "torque": "Torque of sun or pinion",
    "speed": "Speed of sun or pinion",
    "helix": "Helix angle",
    "treatment": "Material, for its safeties",
    "hardness": "Hardness of the surface, HV or HBW",
}
"""Fields that a new case is asked for, and their words in the window."""
_ENTRIES = {
    "teeth": r"\w+\.teeth|teeth",
    "planets": r"set\.planets",
    "module": r"\w+\.module",
    "face_width": r"\w+\.face_width|face-width",
    "torque": r"operation\..*torque.*",
    "speed": r"operation\..*speed.*",
    "helix": r".*helix.*",
    "hardness": r"(.*\.)?material\..*",
}
"""Options of `new_case` and entries of a case that the fields give."""
_OPTION = re.compile(r"--([a-z][a-z-]*)")


def asked_fields(kind: str) -> list[str]:
    """List the fields that a kind of case is asked for."""
    absent = {"planets"} if len(KINDS[kind]) == 2 else set[str]()
    absent |= {"helix"} if kind == "planar" or kind in PLANET_KINDS else set()
    return [field for field in LABELS if field not in absent]


def drafted_case(kind: str, typed: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Draft a case of what was typed into the fields.

    Parameters
    ----------
    kind : str
        Of `femgear.trains.drafts.KINDS`.
    typed : mapping of str to str
        By the name of the field, of `LABELS`; what is empty is estimated.

    Returns
    -------
    text : str
        Of the case file; empty where something is wrong.
    problems : dict of str to str
        What is wrong, in words of the window, by the name of the field; under "" what no field alone can mend.
    """
    given, problems = dict[str, Any](), dict[str, str]()
    for field in asked_fields(kind):
        if field in ("kind", "name") or not (written := typed.get(field, "").strip()):
            continue
        try:
            value = _read(kind, field, written)
            # one at a time, with estimates for the others, so that every refusal is that of its field
            with_teeth = {"teeth": given["teeth"]} if field == "planets" and "teeth" in given else {}
            if field != "planets" or "teeth" not in problems:
                _draft(kind, with_teeth | {field: value})
            given[field] = value
        except FemgearError as error:
            problems[field] = _in_words(error)
    if "treatment" in given and "hardness" not in given and "hardness" not in problems:
        problems["hardness"] = "a material has a hardness; leave the material empty where it is not known"
    text = ""
    if not problems:
        try:
            text = _draft(kind, given)
            _check_hardness(text)
        except FemgearError as error:
            problems[_field_of(error)] = _in_words(error)
    elif {"treatment", "hardness"} <= {*given}:
        try:
            _check_hardness(_draft(kind, {name: given[name] for name in ("treatment", "hardness")}))
        except FemgearError as error:
            problems["hardness"] = _in_words(error)
    return "" if problems else text, problems


def _read(kind: str, field: str, written: str) -> Any:
    """Read what was typed into a field, as `new_case` takes it (CaseError, E-TYPE)."""
    examples = {"teeth": " ".join(map(str, KINDS[kind])), "planets": "3", "hardness": "720"}
    if field not in examples:
        return written
    number = float if field == "hardness" else int
    parts = re.split(r"[\s,;/]+", written) if field == "teeth" else [written]
    what = "number" if number is float else "whole number"
    numbers = []
    for part in parts:
        try:
            numbers.append(number(part))
        except ValueError as error:
            text, remedy = f"a {what} is needed, not {one_line(part)}", f"write it as in {examples[field]}"
            raise CaseError(text, code="E-TYPE", limit=f"{what}s", remedy=remedy) from error
    if field == "teeth":
        return tuple(numbers)
    value = numbers[0]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _draft(kind: str, given: Mapping[str, Any]) -> str:
    """Draft a case of numbers by the names of their fields."""
    options = {name: value for name, value in given.items() if name not in ("helix", "treatment", "hardness")}
    rated = {"treatment", "hardness"} <= {*given}
    steel = NamedSteel(given["treatment"], given["hardness"]) if rated else None
    return new_case(kind, **options, form=ToothForm(helix=given.get("helix")), steel=steel)


def _check_hardness(text: str) -> None:
    """Refuse a hardness that the material of a case cannot have; what else a run refuses is said in the form."""
    case = parse_case(text)
    try:
        check_case(case)
    except FemgearError as error:
        if _field_of(error) == "hardness":
            raise


def _field_of(error: FemgearError) -> str:
    """Field that gives the option or entry that is refused first; empty where there is none."""
    plain = (error.problems[0].key or "").removeprefix("--")
    return next((field for field, pattern in _ENTRIES.items() if plain == field or re.fullmatch(pattern, plain)), "")


def _in_words(error: FemgearError) -> str:
    """Write a refusal in one line, with the words of the window in place of options of the command line."""

    def label(match: re.Match[str]) -> str:
        field = match[1].replace("-", "_")
        return f"“{LABELS[field]}”" if field in LABELS else field.replace("_", " ")

    error = error.problems[0]
    said = {"text": error.message, "limit": error.limit or "", "remedy": error.remedy or "", "code": error.code}
    return _OPTION.sub(label, sentence_of(said))
