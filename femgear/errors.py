"""The exceptions of femgear: every refusal says what was wrong, where, what is allowed and what to do.

`checked_numbers`, `checked_tolerance` and `checked_count` refuse by name what is no number, tolerance or
count. What is allowed but deserves a look is a `femgear.findings.Finding`.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

CODES = {
    "E-ALLOWANCE": "The play takes more from a tooth than it has.",
    "E-ARGUMENTS": "The command line cannot be understood.",
    "E-ASSEMBLY": "Tooth numbers, centre distance and planet angles do not fit each other.",
    "E-BACKLASH": "Flanks overlap, or have less play than what is asked of them needs.",
    "E-BEARING": "A bearing has values or springs that no model can have.",
    "E-CAD": "OpenCASCADE made no solids of gears.",
    "E-CASE": "The case file has several mistakes, or one that has no code of its own.",
    "E-CENTRE-DISTANCE": "The centre distance leaves no line of action.",
    "E-CHOICE": "The value is none of the choices.",
    "E-CLEARANCE": "The tip of a gear runs into the root of its mate.",
    "E-CLUSTER": "The scheduler or a worker of a cluster cannot be used.",
    "E-COAXIAL": "Sun, planet and ring have no common centre distance.",
    "E-CONTACT": "The contact problem has no trustworthy solution.",
    "E-CONTACT-COMPLIANCE": "A compliance is not that of an elastic body.",
    "E-CONTACT-OPEN": "A mesh carries no load where the method needs one.",
    "E-CONTACT-RATIO": "The contact ratio of a mesh is below one.",
    "E-CONVERGENCE": "An iteration did not reach its tolerance.",
    "E-COUNT": "A list has not as many entries as it must have.",
    "E-CUTTER": "The tool of a gear cannot make it.",
    "E-DAMPING": "A damping is negative, is given twice, or has a form that the method cannot carry.",
    "E-DISK-FULL": "The disk has no room for the results.",
    "E-DIVERGED": "The motion grows beyond all bounds.",
    "E-DRIVETRAIN": "The bodies, shafts and stages of a drivetrain make no chain.",
    "E-DUPLICATE": "The same thing is given twice.",
    "E-FAULT": "A fault that the tooth cannot have, or that a method does not know.",
    "E-FEMGEAR": "A refusal that has no code of its own.",
    "E-FILE": "A file cannot be read: missing, no regular file, too long, or not of its form.",
    "E-FILE-ENC": "A file is not UTF-8.",
    "E-FILLET": "A tip runs into the root fillet of its mate.",
    "E-FINITE": "A number is not finite.",
    "E-FIXED-MEMBER": "The model needs another member to be fixed.",
    "E-FORMAT": "A file has a format that this version of femgear does not read, or is no results file.",
    "E-GEOMETRY": "A gear cannot have this value, or differs from its mates where it must not.",
    "E-GRID": "An outline cannot be meshed, or a grid is not usable.",
    "E-GRID-FILE": "A grid cannot be read or written.",
    "E-GRID-FREE": "Nothing holds the body, or a part of it.",
    "E-GRID-GMSH": "Gmsh failed, was stopped, or cannot be loaded.",
    "E-HARMONICS": "Harmonics, lines or samples do not fit each other.",
    "E-INCOMPLETE": "Tasks of a study have neither a result nor an error.",
    "E-INFEASIBLE": "No design can be computed and lies within the limits.",
    "E-INTEGRATION": "A time integration stopped before its end, or missed a balance.",
    "E-INTERFERENCE": "Tips strike flanks outside the mesh.",
    "E-ISO1328": "ISO 1328-1 has no flank tolerances for this gear.",
    "E-ISO6336": "The formula of ISO 6336 does not cover this gear pair.",
    "E-JOURNAL": "The journal of a search or sweep is broken, or belongs to another one.",
    "E-KEY-MISSING": "A needed entry of the case file is missing.",
    "E-KEY-UNKNOWN": "The case file has a key that nobody reads.",
    "E-LIBRARY": "A library that femgear needs cannot be loaded: not installed, or no memory for it.",
    "E-LOAD-BALANCE": "Constant loads do work on a motion that nothing holds.",
    "E-LOCKED": "Another run is writing into the folder.",
    "E-MASS": "A modal mass is missing, or a mass matrix is not positive definite.",
    "E-MECHANISM": "Something moves freely that must be held, or is held that must move.",
    "E-MEMORY": "The computation needs more memory than there is.",
    "E-MODEL": "There is no such model, or the model of the case has not what is asked for.",
    "E-MODES": "The modes that are asked for do not exist.",
    "E-MODIFICATION": "A modification or an error of the flanks that they cannot have.",
    "E-MOTION": "Displacements are too large for a model of small displacements.",
    "E-NEIGHBOURS": "Neighbouring planets overlap.",
    "E-NO-LOAD": "Without torque no tooth carries load.",
    "E-OBJECTIVE": "There is no such quantity, or no such limit of one.",
    "E-OTHER-CASE": "A result is that of another case.",
    "E-OUTPUT": "The folder of the results cannot be used, or holds something else.",
    "E-PERIODS": "The errors span more mesh periods than the method takes.",
    "E-POINTED": "A tooth is pointed below its tip.",
    "E-PUBLISHED": "A published or measured line cannot be compared: its speed or harmonic is not computed.",
    "E-RANGE": "A value lies outside what is allowed.",
    "E-RATE": "The steps are too few to follow the motion.",
    "E-RESIDUAL": "A solution misses its equations, or truncated modes leave too much behind.",
    "E-RESONANCE": "An undamped resonance has an infinite response.",
    "E-RESULTS-CHANGED": "A results file is not the one that the run wrote.",
    "E-RESULTS-INCOMPLETE": "The run was interrupted.",
    "E-RESULTS-MISSING": "There are no such results.",
    "E-REXS": "A REXS file contradicts itself, or holds no stage that femgear can compute.",
    "E-RIGID-MODE": "Nothing holds a motion that strains an element.",
    "E-RIM": "A rim is too thin, or lies on the wrong side of the teeth.",
    "E-ROOT-RADIUS": "The root radius of the tool does not fit its profile.",
    "E-SHAFT": "The parts make no shaft.",
    "E-SHAPE": "Arrays do not have the shapes that belong together.",
    "E-SHIFT": "A profile shift is not possible, or cannot be found.",
    "E-FRICTION": "Friction of the teeth cannot act in this model, or not with another entry.",
    "E-SLICES": "Slices over the face width are missing, or do not go with something else.",
    "E-SOLVE": "A system of linear equations has no trustworthy solution.",
    "E-SPECTRUM": "No spectrum can be made of this record.",
    "E-SPEED": "Speeds, frequencies and directions do not fit each other, or a speed is critical.",
    "E-STAGE": "The case has no such stage.",
    "E-START": "The start of an iteration or of a motion cannot be used.",
    "E-STIFFNESS": "A stiffness is negative where it must not be, or too far from the others.",
    "E-STORAGE": "Results cannot be written or read.",
    "E-SUPPORT": "A support has values that no model can have.",
    "E-SYMMETRY": "A matrix or an arrangement lacks the symmetry that the method needs.",
    "E-SYSTEM-LIBRARY": "A library or package that a picture needs is not installed.",
    "E-TEETH": "Tooth numbers that no gear or set can have.",
    "E-TIP": "The tip of a gear is too high or too low, or an entry of it is no length.",
    "E-TOML": "The file is not TOML.",
    "E-TORQUE": "A torque or a history of torques that the method cannot take.",
    "E-TURNING": "Planets of this stage do not allow turning mesh directions.",
    "E-TYPE": "The value is not of the kind that is needed.",
    "E-UNIT": "A quantity lacks its unit, or has a unit of another kind.",
    "E-UNITS": "A file is in another system of units than is said.",
    "E-VARIABLE": "There is no such variable, or it has no such values.",
    "E-WORKER": "A task ends its worker, or cannot be given to one.",
}
"""Meaning of every code; docs/errors.md lists the messages that carry it."""
SURROUNDINGS = frozenset({"E-CLUSTER", "E-LIBRARY", "E-SYSTEM-LIBRARY"})
"""Codes of what is missing or fails around femgear, whatever the case: they end the command line with 5."""
SURROUNDINGS_EXIT = 5
LESS_TORQUE = "reduce operation.torque"
"""Remedy of contacts that the load makes too large; what has its load elsewhere puts its own in its place."""
MOST_SHOWN = 10
"""Mistakes of a case file that one message lists."""


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
    remedy : str or sequence of str, optional
        What to do about it; of several remedies each does alone.
    file : str, optional
        The file that holds the entry.
    gear : str, optional
        The gear that is refused ("sun"), where the key is one of several gears.
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
        remedy: str | Sequence[str] | None = None,
        file: str | None = None,
        gear: str | None = None,
    ):
        super().__init__(message)
        self.message = message
        self.code = code or self.default_code
        self.key = key
        self.value = value
        self.limit = limit
        self.remedies = () if remedy is None else (remedy,) if isinstance(remedy, str) else tuple(remedy)
        self.file = file
        self.gear = gear
        if self.code in SURROUNDINGS:
            self.exit_code = SURROUNDINGS_EXIT
        # the mistakes of a case file one by one, where there are several
        self.problems: tuple[FemgearError, ...] = (self,)

    @property
    def remedy(self) -> str | None:
        """What to do about it."""
        return ", or ".join(self.remedies) or None

    @remedy.setter
    def remedy(self, text: str | None) -> None:
        self.remedies = () if text is None else (text,)

    def __str__(self) -> str:
        lines = [f"[{self.code}] {': '.join(part for part in (self.file, self.key, self.message) if part)}"]
        if self.value is not None:
            lines.append(f"  found:   {one_line(self.value)}")
        if self.limit:
            lines.append(f"  allowed: {self.limit}")
        if self.remedy:
            lines.append(f"  remedy:  {self.remedy}")
        several = self.problems[:MOST_SHOWN] if len(self.problems) > 1 else ()
        return "\n".join([*map(printable, lines), *map(str, several)])


_Refusal = TypeVar("_Refusal", bound=FemgearError)


def refused_at(problem: FemgearError, key: str) -> CaseError:
    """Copy a refusal as that of another entry of a case."""
    return CaseError(
        problem.message,
        code=problem.code,
        key=key,
        value=problem.value,
        limit=problem.limit,
        remedy=problem.remedies or None,
        file=problem.file,
        gear=problem.gear,
    )


def printable(text: str) -> str:
    """Write every control character of ``text`` as an escape: it then fits one line of a message."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text)


def one_line(value: object, limit: int = 120) -> str:
    """Write a value in one line of a message, cut where it is longer than ``limit`` characters."""
    text = repr(value) if isinstance(value, str) else " ".join(str(value).split())
    text = text.lower() if isinstance(value, bool) else text
    return text if len(text) <= limit else text[: limit - 3] + "..."


@contextmanager
def nvh_library(words: str, extra: str = "nvh") -> Iterator[None]:
    """Say how the libraries of an extra of the package are installed where the block lacks one (E-LIBRARY)."""
    try:
        yield
    except ImportError as error:
        python = (sys.executable or "python").removeprefix(os.path.join(os.getcwd(), ""))
        python = f'"{python}"' if " " in python else python
        raise FemgearError(
            f"{words} need a library that is not installed: {error}",
            code="E-LIBRARY",
            remedy=f'{python} -m pip install "femgear[{extra}]"',
        ) from error


class CaseError(FemgearError, ValueError):
    """The case file cannot be used as it stands; a `ValueError`, so that pydantic collects it."""

    exit_code = 2
    default_code = "E-CASE"


def several(problems: Sequence[_Refusal], count: int = 0) -> _Refusal:
    """Make one error that lists all problems (at least one, of one class) and has them in its ``problems``.

    ``count`` is how many there are where some were left out.
    """
    if len(problems) == 1:
        combined = problems[0]
    else:
        count = max(count, len(problems))
        first = f", the first {MOST_SHOWN} of them" if count > MOST_SHOWN else ""
        combined = type(problems[0])(f"{count} problems{first}")
        combined.code = problems[0].code if len({problem.code for problem in problems}) == 1 else combined.default_code
    combined.problems = tuple(problems)
    return combined


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


def checked_numbers(value, key: str, *, code: str, unit: str, kind: type[float] | type[complex] = float) -> np.ndarray:
    """Convert a value to an array (...) of numbers, of its shape.

    Parameters
    ----------
    value : number or nested sequence (...)
        What the caller was given.
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
    import numpy as np  # noqa: PLC0415  femgear --help needs errors, but no numbers

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
        f"{key} is not made of {'real ' if kind is float else ''}numbers",
        code=code,
        key=key,
        value=repr(value),
        limit=f"numbers{measured}, rows of one length",
        remedy=f"give plain numbers{measured}, without text" + (" or units" if unit else ""),
    )


def checked_tolerance(value, key: str = "tolerance") -> float:
    """Check a relative tolerance: it lies between 0 and 1, both excluded.

    Raises
    ------
    CaseError
        Not a number, or one out of that range (E-RANGE).
    """
    number = checked_numbers(value, key, code="E-RANGE", unit="")
    if number.ndim or not 0.0 < number < 1.0:
        raise CaseError(
            f"a {key} of {number.tolist()}",
            code="E-RANGE",
            key=key,
            limit="between 0 and 1",
            remedy="1e-6 to 1e-12 is usual",
        )
    return float(number)


def checked_count(value, key: str, *, code: str, least: int = 1) -> int:
    """Check a whole number: it is not below ``least``.

    Raises
    ------
    CaseError
        Not a whole number, or one below the least.
    """
    number = checked_numbers(value, key, code=code, unit="")
    if number.ndim or not math.isfinite(number) or number != math.floor(number) or number < least:
        raise CaseError(
            f"{number.tolist()} is not a possible number of {key}",
            code=code,
            key=key,
            value=number.tolist(),
            limit=f"a whole number, {least} or more",
            remedy="give a whole number",
        )
    return int(number)
