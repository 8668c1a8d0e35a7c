"""Computing the validation tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from femgear.errors import FemgearError
from femgear.validation.rows import Row

Progress = Callable[[str], None]


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
    """All tables of one validation."""

    themes: tuple[Table, ...]

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows of all tables."""
        return tuple(row for theme in self.themes for row in theme.rows)

    @property
    def failures(self) -> tuple[Row, ...]:
        """The rows that fail their gate without an explanation."""
        return tuple(row for row in self.rows if row.verdict == "FAILS")


def run_validation(
    themes: tuple[Theme, ...], *, quick: bool = False, progress: Progress | None = None
) -> Validation:
    """Compute the rows of the themes.

    Parameters
    ----------
    themes : tuple of Theme
    quick : bool
        Leave out the parts that take long.
    progress : callable, optional
        Called with the name of every part before it is computed.

    Returns
    -------
    Validation
        A part that femgear refuses to compute becomes a row that fails, with the refusal as its note.
    """
    tables = []
    for theme in themes:
        rows: list[Row] = []
        for part in theme.parts if quick else theme.parts + theme.slow_parts:
            if progress is not None:
                progress(f"{theme.name}: {part.__name__.replace('_', ' ')}")
            rows.extend(_rows_of(theme, part))
        tables.append(Table(theme.title, theme.introduction, tuple(rows)))
    return Validation(tuple(tables))


def _rows_of(theme, part):
    try:
        return tuple(part())
    except FemgearError as error:
        name = part.__name__.replace("_", " ")
        note = " ".join(str(error).split())
        return (
            Row(theme.name, "", f"{name} could not be computed", None, float("nan"), 0.0, False, "", note),
        )
