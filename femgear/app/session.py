"""What a window of the app edits: the text of one case file of a folder, with all of its changes."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from itertools import count
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
_DRAFT = re.compile(r"\.(?P<name>.+\.toml)(\.\d+)?\.draft")


class Session:
    """A case file that is edited in a window.

    What is not saved yet is kept in a file beside it, so that nothing is lost where the window or its process ends. Of
    windows that edit the same file each keeps its own.

    Parameters
    ----------
    folder : path
        Of case files and results.
    sessions : list of Session, optional
        Those of all windows of a server, to which this one is added.

    Attributes
    ----------
    name : str
        Of the file in the folder.
    text : str
        As it is edited.
    """

    def __init__(self, folder: Path, sessions: list[Session] | None = None) -> None:
        self._sessions = [] if sessions is None else sessions
        self._sessions.append(self)
        self.folder = folder.resolve()
        self.name, self.text = "", ""
        self._saved: str | None = None
        self._begun_from: str | None = None  # text of the file when editing began, which may be in an earlier process
        # file of what this session has not saved, and what it wrote there: programs may take one another's
        self._draft: Path | None = None
        self._kept = ""
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

        What another window edits of it stays with that window.

        Raises
        ------
        CaseError
            E-FILE: no case file of the folder. E-ENCODING: no text.
        """
        path = _case_file(self.folder, name)
        saved = _read(path) if path.is_file() else None
        self.name, self._saved, self._before, self._after = name, saved, [], []
        self._draft, self._begun_from, self.text = None, saved, saved or ""
        if left := self._left_drafts():
            self._take_draft(left[-1])
        if not self.unsaved:
            self._drop_draft()
        return self.unsaved

    def leave(self) -> None:
        """Be no open window any more, as far as others see; what is not saved is kept for the next one."""
        if self in self._sessions:
            self._sessions.remove(self)
            self.keep()

    def come_back(self) -> None:
        """Be an open window again; what another one has taken meanwhile is its own."""
        if self not in self._sessions:
            if self._draft in {session._draft for session in self._sessions}:
                self._draft = None
            self._sessions.append(self)

    def _left_drafts(self) -> list[Path]:
        """Files of what was not saved of the case file, by no window of this server; the latest is the last."""
        of_windows = {session._draft for session in self._sessions}
        drafts = [draft for draft, name in _all_drafts(self.folder) if name == self.name and draft not in of_windows]
        return sorted(drafts, key=os.path.getmtime)

    def _take_draft(self, draft: Path) -> None:
        """Go on with what was not saved and is nobody's."""
        base = _base(draft)
        self._draft, self._kept = draft, _read(draft)
        self._begun_from = _read(base) if base.is_file() else self._saved
        self.text = self._kept

    def _rival(self) -> Session | None:
        """Session of another window that has the same file with another text that is not saved."""
        rivals = (session for session in self._sessions if session is not self and session.name == self.name)
        return next((session for session in rivals if session.unsaved and session.text != self.text), None)

    @property
    def changed_elsewhere(self) -> bool:
        """Whether there are other changes of the same file that are not saved: of another window, or left by one."""
        if not self.name:
            return False
        return self._rival() is not None or any(_read(draft) != self.text for draft in self._left_drafts())

    def take_changes(self) -> None:
        """Take the changes that another window has not saved, in place of those here; undo brings these back."""
        if (rival := self._rival()) is not None:
            self.replace(rival.text)
        elif left := self._left_drafts():
            before = [*self._before, self.text]
            self._drop_draft()
            self._take_draft(left[-1])
            self._before, self._after = before[-_MOST_STEPS:], []

    @property
    def saved_elsewhere(self) -> bool:
        """Whether the file was saved, or changed by another program, since it was read here."""
        return bool(self.name) and self._there() not in (self._begun_from, self.text)

    def _there(self) -> str | None:
        """Text of the file as it is now, None where there is none."""
        return _read(self.path) if self.path.is_file() else None

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
        self.keep()
        self.name, self.text, self._saved, self._before, self._after = name, text, None, [], []
        self._begun_from = self._draft = None
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
        if not self.name:
            return
        if not self.unsaved:
            self._drop_draft()
            return
        if self._draft is not None and self._draft.is_file() and self._kept == self.text == _read(self._draft):
            return
        if self._draft is None or not self._holds_own(self._draft):
            self._draft = next(draft for draft in _draft_names(self.path) if not draft.exists())
        files.write_text(self.text, self._draft)
        self._kept = self.text
        if self._begun_from is not None:
            files.write_text(self._begun_from, _base(self._draft))

    def _holds_own(self, draft: Path) -> bool:
        """Whether a file holds what this session wrote, and not another program since."""
        return not draft.is_file() or _read(draft) in (self._kept, self.text)

    def _drop_draft(self) -> None:
        """Remove what this session has kept; that of others stays."""
        if self._draft is not None and self._holds_own(self._draft):
            self._draft.unlink(missing_ok=True)
            _base(self._draft).unlink(missing_ok=True)
        self._draft = None

    def save(self) -> None:
        """Write the case file.

        Raises
        ------
        StorageError
            E-STORAGE: another window or program changed the file since it was read, or it cannot be written.
        """
        if self.saved_elsewhere:
            remedy = "save under another name, or take the file back and change it anew"
            text = "the file was changed or removed by another window or program"
            raise StorageError(text, code="E-STORAGE", file=self.name, remedy=remedy)
        files.write_text(self.text, self.path)
        self._saved = self._begun_from = self.text
        self._drop_draft()

    def save_as(self, name: str) -> None:
        """Write the text as a new case file, which is edited from now on; the former file stays as it is saved."""
        self.check_new(name)
        text = self.text
        self._drop_draft()
        self.name, self.text, self._saved, self._before, self._after = name, text, None, [], []
        self._begun_from = None
        self.save()

    def discard(self) -> None:
        """Go back to the text of the file."""
        if self.path.is_file():
            self._saved = self._begun_from = _read(self.path)
            self.replace(self._saved)
            self.keep()


def case_files(folder: Path) -> list[str]:
    """List the case files of a folder, with those that were begun and never saved."""
    names = {path.name for path in folder.glob(f"*{SUFFIX}") if path.is_file()}
    return sorted(names | {name for _, name in _all_drafts(folder)})


def first_shown(folder: Path) -> str | None:
    """Name of the case file that a window begins with: the one edited last and not saved, else the first; or None."""
    drafts = {os.path.getmtime(path): name for path, name in _all_drafts(folder)}
    return drafts[max(drafts)] if drafts else next(iter(case_files(folder)), None)


def _all_drafts(folder: Path) -> Iterator[tuple[Path, str]]:
    """Files of what is not saved in a folder, each with the name of its case file."""
    for path in folder.glob(f".*{SUFFIX}*.draft"):
        if match := _DRAFT.fullmatch(path.name):
            yield path, match["name"]


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


def _draft_names(path: Path) -> Iterator[Path]:
    """Files beside a case file of what windows have not saved, the first one without a number."""
    yield from (path.with_name(f".{path.name}{f'.{number}' if number > 1 else ''}.draft") for number in count(1))


def _base(draft: Path) -> Path:
    """File beside what is not saved, of the text from which that was begun."""
    return draft.with_suffix(".base")


def _read(path: Path) -> str:
    """Read a text as the reader of cases does; of a file that is not there, nothing."""
    return read_text(path) if path.is_file() else ""
