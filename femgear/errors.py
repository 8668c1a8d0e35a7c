"""The exceptions of femgear: every refusal says what was wrong, where, what is allowed and what to do."""

from __future__ import annotations


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
