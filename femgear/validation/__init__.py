"""Validation: what femgear computes beside closed forms, standards and published numbers."""

from __future__ import annotations

import os
from collections.abc import Callable

__all__ = ["validate"]

FAILED = 3


def validate(
    output: str | os.PathLike,
    *,
    quick: bool = False,
    progress: Callable[[str, float, float], None] | None = None,
) -> int:
    """Compute the validation tables, write them as Markdown and print which rows fail.

    Parameters
    ----------
    output : path
        Markdown file.
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
    StorageError
        When the file cannot be written.
    """
    from femgear.validation.page import summary, write_page
    from femgear.validation.run import run_validation
    from femgear.validation.themes import THEMES

    validation = run_validation(THEMES, quick=quick, progress=progress)
    write_page(validation, output)
    print(summary(validation))
    print(f"written: {os.fspath(output)}")
    return FAILED if validation.failures else 0
