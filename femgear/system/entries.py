"""Numbers that callers give: text in their place is refused by name, and so are tolerances out of range."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError


def checked_numbers(value, key: str, *, code: str, unit: str, kind: type = float) -> np.ndarray:
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
