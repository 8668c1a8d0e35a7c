"""What a window of the app edits: the text of one case file of a folder, with all of its changes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from femgear.app.document import with_entry
from femgear.assistant import MOST_TEXT, place_in
from femgear.case.text import read_text
from femgear.errors import CaseError, StorageError
from femgear.storage import files

_MOST_STEPS = 200
"""Changes that can be taken back."""
SUFFIX = ".toml"


class Session:
    """A case file that is edited in a window.

    What is not saved yet is kept in a file beside it, so that nothing is lost where the window or its process ends.

    Parameters
    ----------
    folder : path
        Of case files and results.

    Attributes
    ----------
    name : str
        Of the file in the folder.
    text : str
        As it is edited.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.name, self.text = "", ""
        self._saved: str | None = None
        self._begun_from: str | None = None  # text of the file when editing began, which may be in an earlier process
        self._kept: str | None = None  # in the draft, by this session: other windows have the same file for theirs
        self._before: list[str] = []
        self._after: list[str] = []

    @property
    def path(self) -> Path:
        """Of the case file."""
        return place_in(self.folder, self.name)

    @property
    def unsaved(self) -> bool:
        """Whether the text is not that of the file."""
        return (self._saved or "") != self.text

    def open(self, name: str) -> bool:
        """Read a case file, or what was edited of it and not saved; tells whether it is the latter.

        Raises
        ------
        CaseError
            E-FILE: no case file of the folder. E-ENCODING: no text.
        """
        path = _case_file(self.folder, name)
        saved, draft = _read(path) if path.is_file() else None, _draft(path)
        self.name, self._saved, self._before, self._after = name, saved, [], []
        self._kept = _read(draft) if draft.is_file() else None
        base = _base(path)
        self._begun_from = saved if self._kept is None or not base.is_file() else _read(base)
        self.text = (saved or "") if self._kept is None else self._kept
        if not self.unsaved:
            self._drop_draft()
        return self.unsaved

    def check_new(self, name: str) -> None:
        """Refuse the name of a new case file.

        Raises
        ------
        CaseError
            E-FILE: a name that no case file can have. E-OUTPUT: there is such a file.
        """
        if _case_file(self.folder, name).exists():
            raise CaseError("there is such a file", code="E-OUTPUT", key="name", value=name, remedy="take another name")

    def begin(self, name: str, text: str) -> None:
        """Begin a new case file, which is there once it is saved.

        Raises
        ------
        CaseError
            As of `check_new`.
        """
        self.check_new(name)
        self.name, self.text, self._saved, self._before, self._after = name, text, None, [], []
        self._begun_from = None
        self.keep()

    def change(self, key: str, value: Any) -> None:
        """Change an entry, or take it out where the value is None; see `femgear.app.document.with_entry`."""
        self.replace(with_entry(self.text, key, value))

    def replace(self, text: str) -> None:
        """Take another text.

        Raises
        ------
        CaseError
            E-FILE: it is too long.
        """
        if len(text) > MOST_TEXT:
            limit = f"up to {MOST_TEXT} characters"
            raise CaseError("the case file is too long", code="E-FILE", value=f"{len(text)} characters", limit=limit)
        if text != self.text:
            self._before = [*self._before, self.text][-_MOST_STEPS:]
            self.text, self._after = text, []

    def undo(self) -> bool:
        """Take the last change back; tells whether there was one."""
        if not self._before:
            return False
        self._after.append(self.text)
        self.text = self._before.pop()
        return True

    def redo(self) -> bool:
        """Make a change again that was taken back; tells whether there was one."""
        if not self._after:
            return False
        self._before.append(self.text)
        self.text = self._after.pop()
        return True

    def keep(self) -> None:
        """Write what is not saved beside the file."""
        if self.name:
            if self.unsaved:
                files.write_text(self.text, _draft(self.path))
                self._kept = self.text
                if self._begun_from is not None:
                    files.write_text(self._begun_from, _base(self.path))
            else:
                self._drop_draft()

    def _drop_draft(self) -> None:
        """Remove the draft, where it is that of this session and not of another window."""
        draft = _draft(self.path)
        if draft.is_file() and _read(draft) in (self._kept, self.text):
            draft.unlink(missing_ok=True)
            _base(self.path).unlink(missing_ok=True)

    def save(self) -> None:
        """Write the case file.

        Raises
        ------
        StorageError
            E-CHANGED: another program changed the file since it was read; E-STORAGE: it cannot be written.
        """
        there = _read(self.path) if self.path.is_file() else None
        if there != self._begun_from and there != self.text:
            remedy = "save under another name, or discard the changes made here"
            raise StorageError(
                "the file was changed by another program", code="E-STORAGE", file=self.name, remedy=remedy
            )
        files.write_text(self.text, self.path)
        self._saved = self._begun_from = self.text
        self._drop_draft()

    def save_as(self, name: str) -> None:
        """Write the text as a new case file, which is edited from now on; the former file stays as it is saved."""
        former, text = self.path, self.text
        self.begin(name, text)
        self.save()
        for beside in (_draft(former), _base(former)):
            beside.unlink(missing_ok=True)

    def discard(self) -> None:
        """Go back to the text of the file."""
        if self.path.is_file():
            self._saved = self._begun_from = _read(self.path)
            self.replace(self._saved)
            self.keep()


def case_files(folder: Path) -> list[str]:
    """List the case files of a folder, with those that were begun and never saved."""
    names = {path.name for path in folder.glob(f"*{SUFFIX}") if path.is_file()}
    drafts = {path.name[1:].removesuffix(".draft") for path in folder.glob(f".*{SUFFIX}.draft")}
    return sorted(names | drafts)


def first_shown(folder: Path) -> str | None:
    """Name of the case file that a window begins with: the one edited last and not saved, else the first; or None."""
    drafts = {os.path.getmtime(path): path for path in folder.glob(f".*{SUFFIX}.draft")}
    if drafts:
        return drafts[max(drafts)].name[1:].removesuffix(".draft")
    return next(iter(case_files(folder)), None)


def result_folders(folder: Path) -> list[str]:
    """List the folders of results in a folder, the newest first."""
    manifests = [(os.path.getmtime(path), path.parent.name) for path in folder.glob("*/manifest.json")]
    return [name for _, name in sorted(manifests, reverse=True)]


def _case_file(folder: Path, name: str) -> Path:
    """Path of a case file by its name, which ends in .toml."""
    path = place_in(folder, name)
    if path.suffix != SUFFIX or path.parent != folder.resolve():
        raise CaseError("case files stand in the folder and end in .toml", code="E-FILE", key="name", value=name[:100])
    return path


def _draft(path: Path) -> Path:
    """File beside a case file, of what is not saved."""
    return path.with_name(f".{path.name}.draft")


def _base(path: Path) -> Path:
    """File beside a case file, of the text from which what is not saved was begun."""
    return path.with_name(f".{path.name}.base")


def _read(path: Path) -> str:
    """Read a text as the reader of cases does; of a file that is not there, nothing."""
    return read_text(path) if path.is_file() else ""
