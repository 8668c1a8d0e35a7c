"""Reading of the other kind of case, ``model = "drivetrain"``."""

from __future__ import annotations

import difflib

from pydantic import ValidationError

from femgear.casefile.drivetrain import MODEL, DrivetrainCase
from femgear.casefile.drivetrain_checks import cross_check
from femgear.casefile.drivetrain_notices import notices
from femgear.casefile.fields import described
from femgear.casefile.origin import text_with_points
from femgear.casefile.problems import combine, translate
from femgear.casefile.torque_series import embed_torques
from femgear.errors import CaseError


def build_drivetrain(data: dict, text: str, name: str, *, numbered: bool = True) -> DrivetrainCase:
    """Case of the tables of a TOML text that names a model.

    Parameters
    ----------
    data : dict
        Modified: torque series of files take the place of the files.
    text, name : str
        Of the file.
    numbered : bool
        Whether messages may name lines.

    Raises
    ------
    CaseError
        Everything that is wrong, at once.
    """
    lines = text if numbered else ""
    if data.get("model") != MODEL:
        raise combine([_unknown_model(data.get("model"))], lines, name)
    files = embed_torques(data, name)
    if files:
        text = text_with_points(data, name, points="torque series", remedy="give them at fewer points")
    try:
        case = DrivetrainCase.model_validate(data)
    except ValidationError as error:
        raise combine(translate(error, DrivetrainCase), lines, name) from None
    if problems := cross_check(case):
        raise combine(problems, lines, name)
    case._source, case._lines, case._name, case._profile_files = text, lines, name, files
    case._notices = notices(case)
    return case


def is_drivetrain(data: dict) -> bool:
    """Whether tables name a model, or have bodies, of which planetary sets have none."""
    return "model" in data or isinstance(data.get("body"), list)


def _unknown_model(value: object) -> CaseError:
    if value is None:
        remedy = f'write model = "{MODEL}" before the first table'
        return CaseError(
            "a file with bodies needs its model", code="E-KEY-MISSING", key="model", remedy=remedy
        )
    if not isinstance(value, str):
        return CaseError(f"a text is needed, not {described(value)}", code="E-TYPE", key="model", value=value)
    near = difflib.get_close_matches(value.lower(), [MODEL], n=1, cutoff=0.6)
    return CaseError(
        "there is no such model",
        code="E-CHOICE",
        key="model",
        value=value,
        limit=f'"{MODEL}"; planetary sets have no entry model',
        remedy=f"did you mean {near[0]}?" if near else "leave it out",
    )


def refuse_drivetrain(case: object) -> None:
    """Refuse a drivetrain where one planetary set is wanted (E-MODEL)."""
    if isinstance(case, DrivetrainCase):
        raise CaseError(
            "a drivetrain has no planetary set of its own",
            code="E-MODEL",
            key="model",
            value=case.model,
            remedy="use femgear check and femgear run, or a case without model",
            file=case.location("model"),
        )


def need_drivetrain(case: object) -> DrivetrainCase:
    """The case, refused where it is no drivetrain (E-MODEL)."""
    if not isinstance(case, DrivetrainCase):
        raise CaseError(
            "this is no drivetrain",
            code="E-MODEL",
            key="model",
            limit=f'model = "{MODEL}"',
            remedy="name a case file of a drivetrain",
            file=getattr(case, "name", None) or None,
        )
    return case
