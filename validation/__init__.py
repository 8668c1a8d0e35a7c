"""Validation: what femgear computes beside closed forms, standards and published numbers."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

FAILED = 3


def validate(
    output: str | os.PathLike | None,
    *,
    theme: str | None = None,
    quick: bool = False,
    progress: Callable[[str, float, float], None] | None = None,
) -> int:
    """Compute the validation tables, write rows and page, and print which rows fail.

    Parameters
    ----------
    output : path or None
        Page, the rows beside it with the ending ``.csv``; None writes none.
    theme : str, optional
        Compute this theme alone, by its name or title, and print each of its rows.
    quick : bool
        Leave out what takes long.
    progress : callable, optional
        Called as ``progress(theme, done, total)``.

    Returns
    -------
    int
        Exit code: 0, or 3 when a row fails its gate.

    Raises
    ------
    CaseError
        No theme has this name (E-THEME).
    StorageError
        When the file cannot be written.
    """
    import scipy.linalg  # noqa: F401  its BLAS is limited only if it is loaded before

    from femgear.stages.protocol import one_blas_thread
    from validation.page import row_line, summary, write_page
    from validation.run import run_validation
    from validation.themes import THEMES

    name = None if theme is None else theme.casefold()
    chosen = tuple(
        listed_theme
        for listed_theme in THEMES
        if name in (None, listed_theme.name.casefold(), listed_theme.title.casefold())
    )
    if not chosen:
        raise _unknown_theme(theme, [known_theme.name for known_theme in THEMES])
    with one_blas_thread():  # sums of several threads differ in the last digits
        validation = run_validation(chosen, quick=quick, progress=progress)
    if output is not None:
        write_page(validation, output)
    if theme is not None:
        print("\n".join(row_line(row) for row in validation.rows if row.verdict != "FAILS"))
    print(summary(validation))
    if output is not None:
        print(f"written: {os.fspath(output)}, {os.fspath(Path(output).with_suffix('.csv'))}")
    return FAILED if validation.failures else 0


def _unknown_theme(theme, names):
    from femgear.errors import CaseError

    return CaseError(
        "there is no such theme of the validation",
        code="E-THEME",
        key="--theme",
        value=theme,
        limit=", ".join(names),
        remedy="name one of these, or leave --theme out for all",
    )
