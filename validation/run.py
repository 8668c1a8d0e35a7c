"""Computing the validation tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from femgear.errors import FemgearError
from validation.rows import Row

Progress = Callable[[str, float, float], None]


@dataclass(frozen=True)
class Theme:
    """A table to compute.

    Parameters
    ----------
    name : str
        Short name, such as ``"geometry"``.
    title : str
        Heading of the table.
    introduction : str
        What the table is about; may be empty.
    parts : tuple of callables
        Each takes no argument and returns a sequence of `Row`.
    slow_parts : tuple of callables
        The same, left out of a quick validation.
    """

    name: str
    title: str
    introduction: str
    parts: tuple[Callable[[], tuple[Row, ...]], ...]
    slow_parts: tuple[Callable[[], tuple[Row, ...]], ...] = ()


@dataclass(frozen=True)
class Table:
    """A table that has been computed: title, introduction and rows."""

    title: str
    introduction: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Validation:
    """All tables of one validation, and whether what takes long was left out."""

    themes: tuple[Table, ...]
    quick: bool = False

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows of all tables."""
        return tuple(row for theme in self.themes for row in theme.rows)

    @property
    def failures(self) -> tuple[Row, ...]:
        """The rows that fail their gate without an explanation."""
        return tuple(row for row in self.rows if row.verdict == "FAILS")


def run_validation(themes: tuple[Theme, ...], *, quick: bool = False, progress: Progress | None = None) -> Validation:
    """Compute the rows of the themes.

    Parameters
    ----------
    themes : tuple of Theme
    quick : bool
        Leave out the parts that take long.
    progress : callable, optional
        Called as ``progress(theme, done, total)`` before and after every part.

    Returns
    -------
    Validation
        A part that femgear refuses to compute becomes a row that fails, with the refusal as its note.
    """
    tables = []
    for theme in themes:
        parts = theme.parts if quick else theme.parts + theme.slow_parts
        rows: list[Row] = []
        for done, part in enumerate(parts):
            if progress is not None:
                progress(theme.name, done, len(parts))
            rows.extend(_rows_of(theme, part))
        if progress is not None:
            progress(theme.name, len(parts), len(parts))
        tables.append(Table(theme.title, theme.introduction, tuple(rows)))
    return Validation(tuple(tables), quick)


def _rows_of(theme, part):
    try:
        return tuple(part())
    except FemgearError as error:
        name = part.__name__.replace("_", " ")
        note = " ".join(str(error).split())
        return (Row(theme.name, "", f"{name} could not be computed", None, float("nan"), 0.0, False, "", note),)
