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
    with pytest.raises(StorageError, match="another window or program"):
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


@pytest.fixture
def windows(tmp_path):
    """Two windows of one server with the same file."""
    (tmp_path / "a.toml").write_text("a = 1\n")
    sessions = []
    both = Session(tmp_path, sessions), Session(tmp_path, sessions)
    for session in both:
        session.open("a.toml")
    return both


def test_windows_keep_their_own_changes_and_know_of_the_other(windows, tmp_path):
    first, second = windows
    assert not first.changed_elsewhere and not second.changed_elsewhere
    first.replace("a = 3\n")
    first.keep()
    assert second.changed_elsewhere and not first.changed_elsewhere and second.text == "a = 1\n"
    second.replace("a = 2\n")
    second.keep()
    assert first.changed_elsewhere and first.text == "a = 3\n"
    second.save()
    assert (tmp_path / "a.toml").read_text() == "a = 2\n" and first.saved_elsewhere and not second.saved_elsewhere
    with pytest.raises(StorageError, match="another window"):
        first.save()
    assert (tmp_path / "a.toml").read_text() == "a = 2\n" and first.text == "a = 3\n"
    first.discard()
    assert first.text == "a = 2\n" and not first.saved_elsewhere and not second.changed_elsewhere
    assert first.undo() and first.text == "a = 3\n"


def test_changes_of_another_window_are_taken_and_come_back_with_undo(windows, tmp_path):
    first, second = windows
    first.replace("a = 3\n")
    second.replace("a = 2\n")
    second.take_changes()
    assert second.text == "a = 3\n" and not second.changed_elsewhere
    assert second.undo() and second.text == "a = 2\n" and second.changed_elsewhere
    second.save_as("b.toml")
    first.keep()
    assert (tmp_path / "b.toml").read_text() == "a = 2\n" and not first.saved_elsewhere
    assert sorted(path.name for path in tmp_path.glob(".*")) == [".a.toml.base", ".a.toml.draft"]


def test_a_window_opened_later_has_the_saved_file_and_one_after_a_restart_all_changes(windows, tmp_path):
    first, second = windows
    for session, text in ((first, "a = 3\n"), (second, "a = 2\n")):
        session.replace(text)
        session.keep()
    third = Session(tmp_path, first._sessions)
    assert not third.open("a.toml") and third.text == "a = 1\n" and third.changed_elsewhere
    third.leave()
    again, texts = Session(tmp_path), set()  # of another server
    assert again.open("a.toml") and case_files(tmp_path) == ["a.toml"]
    texts.add(again.text)
    assert again.changed_elsewhere
    again.take_changes()
    texts.add(again.text)
    assert texts == {"a = 2\n", "a = 3\n"}
    again.save()
    assert not again.changed_elsewhere and not [*tmp_path.glob(".*")]


def test_a_window_that_is_loaded_again_goes_on(windows):
    first, second = windows
    second.leave()
    first.replace("a = 3\n")
    first.leave()
    loaded = Session(first.folder, first._sessions)
    assert loaded.open("a.toml") and loaded.text == "a = 3\n" and not loaded.changed_elsewhere
    # the former one comes back: both know, and neither writes over the other
    first.come_back()
    first.replace("a = 4\n")
    loaded.replace("a = 5\n")
    first.keep()
    loaded.keep()
    assert first.changed_elsewhere and loaded.changed_elsewhere
    kept = {path.read_text() for path in first.folder.glob(".*.draft")}
    assert kept == {"a = 4\n", "a = 5\n"}


def test_what_another_program_keeps_in_the_same_place_stays(session, tmp_path):
    session.change("title", "b")
    session.keep()
    (tmp_path / ".a.toml.draft").write_text("of = 2\n")
    session.change("title", "c")
    session.keep()
    assert (tmp_path / ".a.toml.draft").read_text() == "of = 2\n" and session.changed_elsewhere
    session.save()
    assert (tmp_path / ".a.toml.draft").read_text() == "of = 2\n"


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
    with pytest.raises(StorageError, match="another window or program"):
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
