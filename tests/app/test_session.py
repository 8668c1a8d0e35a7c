"""A session edits one file of a folder, and loses nothing."""

import pytest

from femgear.app.session import Session, case_files, result_folders
from femgear.errors import CaseError, StorageError

TEXT = 'title = "a"  # of it\n'


@pytest.fixture
def session(tmp_path):
    (tmp_path / "a.toml").write_text(TEXT)
    begun = Session(tmp_path)
    assert not begun.open("a.toml")
    return begun


def test_a_change_is_kept_beside_the_file_until_it_is_saved(session, tmp_path):
    session.change("title", "b")
    assert session.unsaved and (tmp_path / "a.toml").read_text() == TEXT
    session.keep()
    again = Session(tmp_path)
    assert again.open("a.toml") and again.text == 'title = "b"  # of it\n'
    again.save()
    assert (tmp_path / "a.toml").read_text() == 'title = "b"  # of it\n' and not again.unsaved
    assert [path.name for path in tmp_path.iterdir()] == ["a.toml"]


def test_changes_are_taken_back_and_made_again(session):
    session.change("title", "b")
    session.replace('title = "c"\nformat = 1\n')
    assert session.undo() and '"b"' in session.text and session.undo() and session.text == TEXT
    assert not session.undo() and not session.unsaved
    assert session.redo() and session.redo() and not session.redo() and "format = 1" in session.text
    session.change("title", "d")
    assert not session.redo()


def test_what_was_changed_back_needs_no_file(session, tmp_path):
    session.change("title", "b")
    session.keep()
    session.discard()
    assert session.text == TEXT and [path.name for path in tmp_path.iterdir()] == ["a.toml"]


def test_a_file_that_another_program_changed_is_not_replaced(session, tmp_path):
    session.change("title", "b")
    (tmp_path / "a.toml").write_text("other = 1\n")
    with pytest.raises(StorageError, match="another program"):
        session.save()
    assert (tmp_path / "a.toml").read_text() == "other = 1\n"
    session.save_as("b.toml")
    assert (tmp_path / "b.toml").read_text() == 'title = "b"  # of it\n' and session.name == "b.toml"


def test_a_new_file_is_there_once_it_is_saved(tmp_path):
    session = Session(tmp_path)
    session.begin("new.toml", TEXT)
    assert case_files(tmp_path) == ["new.toml"] and not (tmp_path / "new.toml").exists()
    assert Session(tmp_path).open("new.toml")
    session.save()
    assert (tmp_path / "new.toml").read_text() == TEXT
    with pytest.raises(CaseError, match="there is such a file"):
        session.begin("new.toml", "")


def test_what_was_begun_and_never_saved_is_saved_after_it_is_opened_again(tmp_path):
    Session(tmp_path).begin("new.toml", "a = 1\n")
    again = Session(tmp_path)
    assert again.open("new.toml") and again.text == "a = 1\n" and case_files(tmp_path) == ["new.toml"]
    again.save()
    assert (tmp_path / "new.toml").read_text() == "a = 1\n" and not (tmp_path / ".new.toml.draft").exists()


def test_the_draft_of_another_window_stays(tmp_path):
    (tmp_path / "a.toml").write_text("a = 1\n")
    first, second = Session(tmp_path), Session(tmp_path)
    for session, text in ((second, "a = 2\n"), (first, "a = 3\n")):
        session.open("a.toml")
        session.replace(text)
    second.keep()
    first.keep()
    second.save()
    assert (tmp_path / ".a.toml.draft").read_text() == "a = 3\n"
    assert Session(tmp_path).open("a.toml")


def test_a_save_of_another_window_is_not_overwritten_after_a_restart(tmp_path):
    """What was kept remembers the file from which it was begun."""
    (tmp_path / "a.toml").write_text("a = 1\n")
    first, second = Session(tmp_path), Session(tmp_path)
    first.open("a.toml")
    second.open("a.toml")
    first.replace("a = 1\nb = 5\n")
    first.keep()
    second.replace("a = 2\n")
    second.save()
    again = Session(tmp_path)  # the server was killed and started again
    assert again.open("a.toml") and again.text == "a = 1\nb = 5\n"
    again.replace("a = 1\nb = 6\n")
    with pytest.raises(StorageError, match="changed by another program"):
        again.save()
    assert (tmp_path / "a.toml").read_text() == "a = 2\n"
    again.discard()
    assert again.text == "a = 2\n" and not again.unsaved
    again.replace("a = 3\n")
    again.keep()
    again.save()
    assert (tmp_path / "a.toml").read_text() == "a = 3\n"
    assert not [*tmp_path.glob(".a.toml.*")]


@pytest.mark.parametrize(
    "name", ("../a.toml", "/etc/a.toml", "a.txt", "sub/a.toml", "", ".a.toml", "a\x00.toml", 300 * "a" + ".toml")
)
def test_files_elsewhere_are_not_opened(session, name):
    for act in (session.open, lambda name: session.begin(name, TEXT), session.save_as):
        with pytest.raises(CaseError):
            act(name)
    assert session.name == "a.toml"


def test_a_text_that_is_too_long_is_refused(session):
    with pytest.raises(CaseError, match="too long"):
        session.replace("#" * 300_000)
    assert session.text == TEXT


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CaseError):
        Session(tmp_path).open("a.toml")


def test_folders_of_results_are_listed(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    (tmp_path / "two" / "manifest.json").write_text("{}")
    assert result_folders(tmp_path) == ["two"]
