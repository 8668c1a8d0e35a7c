"""Files that commands write: new ones, under names that every file system takes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from femgear.commands.terminal import say
from femgear.errors import CaseError, StorageError


def results_folder(case: Path) -> Path:
    """Name the folder of the results of a case file, beside it."""
    return case.with_name(f"{case.stem}_results")


def write_case_file(text: str, path: Path, *, force: bool) -> None:
    """Write a file that no other one is lost for, under a name whose results femgear run can write."""
    from femgear.storage.files import write_text

    need_new_files([path], force=force)
    write_text(text, path)
    say(f"written: {path}")


def need_new_files(paths: Sequence[Path], *, force: bool) -> None:
    """Refuse files that are there already, and names under which femgear run could write no results."""
    from femgear.storage.files import checked_name

    for path in paths:
        for name in (path.name, results_folder(path).name):
            try:
                checked_name(name)
            except StorageError as error:
                # a name that was typed is no matter of the disk
                raise CaseError(
                    error.message,
                    code="E-CHOICE",
                    key="--output",
                    value=name,
                    limit=error.limit,
                    remedy=error.remedy,
                ) from None
        if path.exists() and not force:
            raise CaseError(
                "the file is there already",
                code="E-OUTPUT",
                file=str(path),
                limit="a new file",
                remedy="name another one with -o, or add --force",
            )
