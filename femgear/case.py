"""The case file: every entry checked, every unit converted, every mistake reported at once."""

from __future__ import annotations

import os
from typing import Any

from pydantic import ValidationError

from femgear.casefile import tomlfile
from femgear.casefile.problems import combine, translate
from femgear.casefile.sections import FORMAT, Case, cross_check
from femgear.errors import CaseError

__all__ = ["Case", "case_schema", "parse_case", "read_case", "to_toml", "with_value"]


def read_case(path: str | os.PathLike) -> Case:
    """Case of a TOML file.

    Parameters
    ----------
    path : path-like
        A regular UTF-8 file of at most 1 MB.

    Returns
    -------
    Case
        Checked, frozen, in SI units and radians.

    Raises
    ------
    CaseError
        Everything that is wrong with the file, at once; ``problems`` holds one `CaseError` for each.
    """
    return parse_case(tomlfile.read_text(path), name=tomlfile.printable(os.fsdecode(path)))


def parse_case(text: str, *, name: str = "") -> Case:
    """Case of a TOML text; see `read_case`.

    Parameters
    ----------
    text : str
    name : str
        File name for messages.
    """
    return _build(tomlfile.parse(text, name), text, name)


def with_value(case: Case, key: str, value: object) -> Case:
    """The case with one entry changed, checked again as a whole.

    Parameters
    ----------
    case : Case
    key : str
        Dotted key such as ``"operation.torque"``.
    value : object
        As the file would hold it: ``"50 N m"``, 0.3, 27.

    Returns
    -------
    Case

    Raises
    ------
    CaseError
        As `read_case`; unknown keys are refused with the nearest valid one.
    """
    data = tomlfile.parse(case.source, case.name)
    *tables, last = key.split(".")
    table = data
    for part in tables:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise CaseError(f"{part} is not a table", code="E-KEY", key=key, file=case.name)
    table[last] = value
    return _build(data, tomlfile.write(data), case.name, numbered=False)


def to_toml(case: Case) -> str:
    """TOML text that gives this case when read; the text of its file as long as nothing was changed."""
    return case.source


def case_schema() -> dict[str, Any]:
    """JSON schema of the case file, for editors."""
    return Case.model_json_schema()


def _build(data: dict, text: str, name: str, *, numbered: bool = True) -> Case:
    version = data.get("format", FORMAT)
    if type(version) is int and version > FORMAT:
        raise CaseError(
            "the file is written for a newer femgear",
            code="E-FORMAT",
            key="format",
            value=tomlfile.shown(version),
            limit=f"up to {FORMAT}",
            remedy="update femgear",
            file=name,
        )
    lines = text if numbered else ""
    try:
        case = Case.model_validate(data)
    except ValidationError as error:
        raise combine(translate(error, Case), lines, name) from None
    problems = cross_check(case)
    if problems:
        raise combine(problems, lines, name)
    case._source, case._name, case._notices = text, name, _notices(data)
    return case


def _notices(data: dict) -> tuple[str, ...]:
    teeth = data["ring"]["teeth"]
    if teeth > 0:
        return ()
    return (
        f"ring.teeth = {teeth} is read as an internal gear with {-teeth} teeth; ring.profile_shift keeps "
        "femgear's sign (positive moves the flank outwards, the opposite of ISO 21771)",
    )
