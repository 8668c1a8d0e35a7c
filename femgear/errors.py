"""The exceptions of femgear: every refusal says what was wrong, where, what is allowed and what to do.

`checked_numbers`, `checked_tolerance` and `checked_count` refuse by name what is no number, tolerance or
count.
"""

from __future__ import annotations

import numpy as np


class FemgearError(Exception):
    """Base of all errors that femgear raises on purpose.

    Parameters
    ----------
    message : str
        What is wrong, in one sentence, with the numbers.
    code : str
        Stable identifier such as ``"E-UNIT"``; scripts may test it.
    key : str, optional
        Dotted path of the offending entry of the case file (``"sun.module"``).
    value : object, optional
        The value found there.
    limit : str, optional
        What is allowed.
    remedy : str, optional
        What to do about it.
    file : str, optional
        The file that holds the entry.
    """

    exit_code = 3
    default_code = "E-FEMGEAR"

    def __init__(
        self,
        message: str,
        *,
        code: str | None = None,
        key: str | None = None,
        value: object = None,
        limit: str | None = None,
        remedy: str | None = None,
        file: str | None = None,
    ):
        super().__init__(message)
        self.message = message
        self.code = code or self.default_code
        self.key = key
        self.value = value
        self.limit = limit
        self.remedy = remedy
        self.file = file

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.file, self.key) if part)
        lines = [f"[{self.code}] {where + ': ' if where else ''}{self.message}"]
        if self.value is not None:
            lines.append(f"  found:   {_one_line(self.value)}")
        if self.limit:
            lines.append(f"  allowed: {self.limit}")
        if self.remedy:
            lines.append(f"  remedy:  {self.remedy}")
        return "\n".join(lines)


def _one_line(value: object, limit: int = 120) -> str:
    text = ascii(value) if isinstance(value, str) else str(value)
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 3] + "..."


class CaseError(FemgearError):
    """The case file cannot be used as it stands."""

    exit_code = 2
    default_code = "E-CASE"


class GeometryError(FemgearError):
    """The gears of the case cannot be made, assembled or run."""

    exit_code = 2
    default_code = "E-GEOMETRY"


class GridError(FemgearError):
    """An outline cannot be meshed, or the finite-element grid is not usable."""

    default_code = "E-GRID"


class ContactError(FemgearError):
    """The contact problem has no trustworthy solution."""

    default_code = "E-CONTACT"


class ConvergenceError(FemgearError):
    """A numerical method did not reach its tolerance."""

    default_code = "E-CONVERGENCE"


class StorageError(FemgearError):
    """Results cannot be written or read."""

    exit_code = 4
    default_code = "E-STORAGE"


def checked_numbers(
    value, key: str, *, code: str, unit: str, kind: type[float] | type[complex] = float
) -> np.ndarray:
    """The value as an array of numbers.

    Parameters
    ----------
    value : number or nested sequence
    key : str
        What it is, in the words of the caller.
    code : str
        Of the error.
    unit : str
        "rad/s", or "" for plain numbers.
    kind : type
        ``float`` or ``complex``.

    Raises
    ------
    CaseError
        Text, nothing, rows of different lengths or objects in place of numbers.
    """
    try:
        # numpy reads text such as "7" as a number, and nothing as nan; neither is one here
        if value is None or np.asarray(value).dtype.kind in "OSUmM":
            raise TypeError
        if kind is float and np.iscomplexobj(value):
            raise TypeError
        return np.asarray(value, kind)
    except (TypeError, ValueError):
        pass
    measured = f" in {unit}" if unit else ""
    raise CaseError(
        f"{key} is not made of {'real ' if kind is float else ''}numbers", code=code, key=key,
        value=repr(value), limit=f"numbers{measured}, rows of one length",
        remedy=f"give plain numbers{measured}, without text" + (" or units" if unit else ""),
    )  # fmt: skip


def checked_tolerance(value, key: str = "tolerance") -> float:
    """A tolerance between 0 and 1, both excluded.

    Raises
    ------
    CaseError
        Not a number, or one out of that range (E-TOLERANCE).
    """
    number = checked_numbers(value, key, code="E-TOLERANCE", unit="")
    if number.ndim or not 0.0 < number < 1.0:
        raise CaseError(
            f"a {key} of {number.tolist()}", code="E-TOLERANCE", key=key, limit="between 0 and 1",
            remedy="1e-6 to 1e-12 is usual",
        )  # fmt: skip
    return float(number)


def checked_count(value, key: str, *, code: str, least: int = 1) -> int:
    """A whole number that is not below ``least``.

    Raises
    ------
    CaseError
        Not a whole number, or one below the least.
    """
    number = checked_numbers(value, key, code=code, unit="")
    if number.ndim or not np.isfinite(number) or number != np.floor(number) or number < least:
        raise CaseError(
            f"{number.tolist()} is not a possible number of {key}", code=code, key=key, value=number.tolist(),
            limit=f"a whole number, {least} or more", remedy="give a whole number",
        )  # fmt: skip
    return int(number)
