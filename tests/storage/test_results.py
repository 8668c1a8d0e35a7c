"""Results folders into which somebody has put links, pipes, folders and files: nothing foreign is lost."""

import os
import stat
import threading

import pytest
from edited_manifests import edit_manifest, finish

from femgear.errors import StorageError
from femgear.storage import files
from femgear.storage.files import checksum, exclusive_lock, list_own, own_files, replaced_file, write_text
from femgear.storage.results import (
    MANIFEST,
    additions,
    folder_lock,
    prepare_output,
    read_manifest,
    record,
    run_folder,
)
from femgear.trains.reading import open_results

PRECIOUS = "years of work"


@pytest.fixture
def elsewhere(tmp_path):
    """A folder with a file that nobody may touch."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "thesis.txt").write_text(PRECIOUS)
    yield folder
    assert [path.name for path in folder.iterdir()] == ["thesis.txt"]
    assert (folder / "thesis.txt").read_text() == PRECIOUS


@pytest.fixture
def results(tmp_path):
    """Complete results of a case file and one stage."""
    return complete(prepare_output(tmp_path / "out"))


def complete(folder, text="old", names=("case.toml", "static.nc")):
    for name in names:
        write_text(f"{text} {name}", folder / name)
    finish(folder, list(names), timings={}, convergence={})
    return folder


def contents(folder):
    """Every file below a folder with what it holds; links and pipes as such."""

    def what(path):
        mode = path.lstat().st_mode
        return path.read_text() if stat.S_ISREG(mode) else stat.filemode(mode)[0]

    return {path.relative_to(folder).as_posix(): what(path) for path in sorted(folder.rglob("*"))}


def replaced(folder):
    with run_folder(folder, force=True) as new:
        complete(new, "new")


def refused(act, code="E-OUTPUT"):
    with pytest.raises(StorageError) as info:
        act()
    assert info.value.code == code and info.value.exit_code == 4
    assert info.value.remedy
    return info.value


# --- names -----------------------------------------------------------------------------------------


def test_temporary_names_cannot_be_foretold_and_what_is_there_is_not_written_into(tmp_path, elsewhere, monkeypatch):
    seen = []
    for _ in range(2):
        with replaced_file(tmp_path / "a.txt") as path:
            seen.append((path.name, path.stat().st_size))
    assert seen[0] != seen[1] and all(size == 0 for _, size in seen)
    monkeypatch.setattr(files.secrets, "token_hex", lambda n: "0" * 2 * n)
    trap = tmp_path / f".femgear-{'0' * 16}.a.txt"
    trap.symlink_to(elsewhere / "thesis.txt")
    with pytest.raises(StorageError, match="File exists"):
        write_text("mine", tmp_path / "a.txt")
    assert trap.is_symlink() or not trap.exists()


def test_a_link_where_a_result_belongs_is_not_followed(tmp_path, elsewhere):
    (tmp_path / "a.txt").symlink_to(elsewhere / "thesis.txt")
    write_text("mine", tmp_path / "a.txt")
    assert (tmp_path / "a.txt").read_text() == "mine" and not (tmp_path / "a.txt").is_symlink()


# --- left-overs ------------------------------------------------------------------------------------


def test_temporary_files_of_dead_runs_are_removed_and_nothing_like_them(results, elsewhere):
    dead = [f".femgear-0123456789abcdef.{name}" for name in ("static.nc", "manifest.json", "x")]
    alive = [
        ".ANYNAME.1.tmp.2",
        ".static.4711.tmp.nc",
        ".static.0123456789abcdef.tmp.nc",
        ".notes",
        ".femgear-0123.static.nc",
        "femgear-0123456789abcdef.static.nc",
    ]
    for name in dead + alive:
        (results / name).write_text("half")
    link, folder = (f".femgear-0123456789abcde{digit}.static.nc" for digit in "01")
    (results / link).symlink_to(elsewhere / "thesis.txt")
    (results / folder).mkdir()
    with folder_lock(results):
        pass
    there = contents(results).keys()
    assert not there & set(dead)
    assert {*alive, link, folder} <= there


def test_a_run_killed_while_it_wrote_its_first_manifest_may_be_repeated(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / ".femgear-0123456789abcdef.manifest.json").write_text("{")
    with run_folder(folder) as working:
        complete(working)
    assert contents(folder).keys() == {"case.toml", "static.nc", MANIFEST}


# --- planted .running ------------------------------------------------------------------------------


def _link(path, elsewhere):
    path.symlink_to(elsewhere, target_is_directory=True)


def _file(path, elsewhere):
    path.write_text("mine")


def _pipe(path, elsewhere):
    os.mkfifo(path)


def _notes(path, elsewhere):
    path.mkdir()
    (path / "static.nc").write_text("half")
    (path / "notes.txt").write_text("mine")


def _notes_below(path, elsewhere):
    (path / "thesis").mkdir(parents=True)
    (path / "thesis" / "chapter.tex").write_text("mine")


def _link_below(path, elsewhere):
    path.mkdir()
    (path / "static.nc").symlink_to(elsewhere / "thesis.txt")


def _pipe_below(path, elsewhere):
    path.mkdir()
    os.mkfifo(path / "static.nc")


def _link_to_exported(path, elsewhere):
    path.mkdir()
    (path / "exported").symlink_to(elsewhere, target_is_directory=True)


def _files_like_ours(path, elsewhere):
    path.mkdir()
    for name in ("photo.png", "notes.csv", "modes.nc", "case.toml", "static.npz"):
        (path / name).write_text("mine")


def _temporary_name(path, elsewhere):
    path.mkdir()
    (path / ".ANYNAME.1.tmp.2").write_text("mine")


def _list(path, elsewhere):
    path.mkdir()
    (path / ".written").write_text(PRECIOUS)


def _picture_in_ours(path, elsewhere):
    list_own(path)
    write_text("half", path / "static.nc")
    (path / "photo.png").write_text("mine")


def _ours_changed(path, elsewhere):
    list_own(path)
    write_text("half", path / "notes.csv")
    (path / "notes.csv").write_text("mine")


PLANTED = [_link, _file, _pipe, _notes, _notes_below, _link_below, _pipe_below, _link_to_exported]
PLANTED += [_files_like_ours, _temporary_name, _list, _picture_in_ours, _ours_changed]


@pytest.mark.parametrize("name", [".running", ".added", ".stages"])
@pytest.mark.parametrize("plant", PLANTED)
def test_what_no_run_left_is_refused_and_kept(results, elsewhere, name, plant):
    plant(results / name, elsewhere)
    before = contents(results)
    acts = [lambda: replaced(results), lambda: add(results, report="one")]
    for act in acts[: 1 if name == ".running" else 2]:
        error = refused(act)
        assert name in error.file and "move" in error.remedy
        assert contents(results) == before


@pytest.mark.parametrize("name", ["notes.txt", "photo.png", "notes.csv"])
def test_what_somebody_puts_into_the_folder_of_a_running_run_is_kept(results, name):
    def run():
        with run_folder(results, force=True) as working:
            (working / name).write_text("mine")
            complete(working, "new")

    assert refused(run).file == str(results / ".running" / name)
    assert (results / "case.toml").read_text() == "new case.toml"
    assert contents(results / ".running").keys() == {".written", name}
    assert (results / ".running" / name).read_text() == "mine"


def test_what_a_run_has_written_is_removed_with_its_folder(results):
    """And with the folders below, whatever the names."""
    for folder in (results / ".added", results / ".added" / "exported"):
        list_own(folder)
        for name in ("static.nc", "photo.jpeg", "a"):
            write_text("half", folder / name)
        (folder / ".femgear-0123456789abcdef.a.csv").write_text("ha")
    before = contents(results / ".added")
    assert len(before) == 11 and ".written" in before
    with folder_lock(results):
        pass
    assert not (results / ".added").exists()


def test_a_folder_of_stages_that_somebody_made_is_refused_before_a_run(tmp_path):
    folder = prepare_output(tmp_path / "out")
    (folder / ".stages").mkdir()
    (folder / ".stages" / "static.npz").write_text("mine")
    error = refused(lambda: own_files(folder / ".stages", ["*"]))
    assert error.file == str(folder / ".stages" / "static.npz")
    assert contents(folder / ".stages") == {"static.npz": "mine"}


@pytest.mark.skipif(os.name == "nt", reason="no open file can be removed there")
def test_what_a_living_process_writes_is_not_removed(results):
    with replaced_file(results / "modes.nc") as new:
        new.write_text("whole")
        with folder_lock(results):
            pass
        list_own(results.parent)
        assert new.read_text() == "whole"
    assert (results / "modes.nc").read_text() == "whole"


# --- planted results that have not yet their places --------------------------------------------------


def finished(results, names=("case.toml", "static.nc", "modes.nc"), text="new"):
    """What a run leaves that is killed before its results have their places."""
    (results / ".running").mkdir()
    return complete(results / ".running", text, names)


def test_a_finished_run_is_brought_to_its_end_by_whoever_locks_the_folder(results):
    finished(results)
    with folder_lock(results):
        assert contents(results).keys() >= {"case.toml", "static.nc", "modes.nc", MANIFEST}
        assert (results / "modes.nc").read_text() == "new modes.nc"
    assert not (results / ".running").exists() and "modes.nc" in read_manifest(results).files


@pytest.mark.parametrize("name", ["modes.nc", "static.nc", "report.html"])
def test_a_file_of_the_user_is_not_overwritten_by_a_finished_run(results, name):
    finished(results, ("case.toml", "static.nc", "modes.nc", "report.html"))
    (results / name).write_text("mine")
    before = contents(results)
    error = refused(lambda: replaced(results))
    assert error.file == str(results / name) and "move it away" in error.remedy
    assert contents(results) == before
    (results / name).rename(results.parent / "moved")
    with folder_lock(results):
        assert (results / name).read_text() == f"new {name}"
    assert (results.parent / "moved").read_text() == "mine"


def test_a_publication_that_was_interrupted_goes_on(results):
    source = finished(results)
    os.replace(source / "case.toml", results / "case.toml")
    with folder_lock(results):
        pass
    assert contents(results)["case.toml"] == "new case.toml" and not source.exists()


def test_a_finished_run_whose_files_differ_from_its_manifest_is_refused(results):
    source = finished(results)
    (source / "modes.nc").write_text("other")
    before = contents(results)
    assert refused(lambda: replaced(results)).file == str(source / "modes.nc")
    assert contents(results) == before


@pytest.mark.parametrize("text", ["", "{}", '{"femgear_format": 4, "complete": true, "files": {"../x": "0"}}'])
def test_a_finished_run_without_a_valid_manifest_is_refused(results, text):
    (finished(results) / MANIFEST).write_text(text)
    before = contents(results)
    with pytest.raises(StorageError):
        replaced(results)
    assert contents(results) == before


@pytest.mark.parametrize("name", [".running", ".added"])
def test_a_run_that_is_not_complete_is_not_published(results, name):
    source = results / name
    source.mkdir()
    write_text("new", source / "case.toml")
    record(source, ["case.toml"], timings={}, convergence={})
    before = contents(results)
    refused(lambda: replaced(results))
    assert contents(results) == before


def test_a_manifest_with_folders_leads_nowhere_through_a_link(results, elsewhere):
    source = finished(results)
    (source / "sub").mkdir()
    (results / "sub").symlink_to(elsewhere, target_is_directory=True)
    for name in ("thesis.txt", "new.txt"):
        (source / "sub" / name).write_text("new")
        edit_manifest(source, files={f"sub/{name}": checksum(source / "sub" / name)})
        refused(lambda: replaced(results))


def test_nothing_is_removed_through_a_link(results, elsewhere):
    listed = {"sub/thesis.txt": checksum(elsewhere / "thesis.txt")}
    edit_manifest(results, files={**read_manifest(results).files, **listed})
    (results / "sub").symlink_to(elsewhere, target_is_directory=True)
    refused(lambda: replaced(results))
    edit_manifest(results, complete=False)
    refused(lambda: prepare_output(results))


def test_a_link_in_place_of_a_result_counts_as_changed(results, tmp_path):
    os.replace(results / "static.nc", tmp_path / "static.nc")
    (results / "static.nc").symlink_to(tmp_path / "static.nc")
    assert "static.nc changed" in refused(lambda: replaced(results)).message


# --- additions -------------------------------------------------------------------------------------


def add(folder, **given):
    with folder_lock(folder), additions(folder) as new:
        for name, text in given.items():
            write_text(text, new / f"{name}.html")


def test_additions_are_listed_and_replaced_while_they_are_unchanged(results):
    add(results, report="one")
    assert read_manifest(results).files["report.html"] == checksum(results / "report.html")
    before = read_manifest(results)
    add(results, report="two")
    after = read_manifest(results)
    assert (results / "report.html").read_text() == "two" and before.versions == after.versions
    assert {name for name in after.files if after.files[name] != before.files[name]} == {"report.html"}
    (results / "report.html").write_text("mine")
    assert "report.html changed" in refused(lambda: add(results, report="three")).message
    assert (results / "report.html").read_text() == "mine" and read_manifest(results) == after


def test_an_addition_replaces_nothing_foreign(results, elsewhere):
    (results / "report.html").write_text("mine")
    before = contents(results)
    assert refused(lambda: add(results, report="one")).file == str(results / "report.html")
    assert contents(results) == before
    (results / "report.html").unlink()
    (results / "report.html").symlink_to(elsewhere / "nothing")
    refused(lambda: add(results, report="one"))
    (results / "report.html").unlink()
    # what was written before a kill but not listed
    (results / "report.html").write_text("one")
    add(results, report="one")
    assert "report.html" in read_manifest(results).files


@pytest.mark.parametrize("last", ["report.html", MANIFEST, f".added/{MANIFEST}"])
def test_an_addition_that_is_killed_goes_on_with_the_next(results, monkeypatch, last):
    add(results, report="one")
    replace = os.replace

    def killed(source, target):
        if os.path.relpath(target, results) == last:
            raise KeyboardInterrupt
        replace(source, target)

    monkeypatch.setattr(os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        add(results, report="two")
    monkeypatch.undo()
    with folder_lock(results):
        pass
    there = contents(results)
    assert there["report.html"] == ("one" if last.startswith(".") else "two")
    assert read_manifest(results).files["report.html"] == checksum(results / "report.html")
    assert not any(name.startswith(".") for name in there)


def test_an_addition_to_results_that_are_not_complete(results):
    edit_manifest(results, complete=False)
    add(results, report="one")
    assert "report.html" in read_manifest(results).files and not read_manifest(results).complete


def test_an_addition_to_changed_results_is_refused(results):
    (results / "static.nc").write_text("mine")
    before = contents(results)
    assert "static.nc changed" in refused(lambda: add(results, report="one")).message
    assert contents(results) == before


@pytest.mark.parametrize("what", ["pipe", "device"])
def test_a_pipe_or_device_in_place_of_a_result_is_not_waited_for(results, what):
    (results / "static.nc").unlink()
    if what == "pipe":
        os.mkfifo(results / "static.nc")
    else:
        (results / "static.nc").symlink_to("/dev/zero")
    with pytest.raises(StorageError, match="not a regular file"):
        _ = open_results(results).static
    assert "static.nc changed" in refused(lambda: replaced(results)).message


# --- the lock --------------------------------------------------------------------------------------


def test_a_lock_is_taken_through_no_link(results, elsewhere):
    (results / ".lock").symlink_to(elsewhere / "thesis.txt")
    with pytest.raises(StorageError) as info:
        replaced(results)
    assert info.value.exit_code == 4
    (results / ".lock").unlink()
    (results / ".lock").symlink_to(elsewhere / "new")
    with pytest.raises(StorageError):
        replaced(results)


def test_a_pipe_or_a_file_in_place_of_the_lock_stays(results):
    os.mkfifo(results / ".lock")
    replaced(results)
    assert contents(results)[".lock"] == "p"
    (results / ".lock").unlink()
    (results / ".lock").write_text("mine")
    replaced(results)
    assert contents(results)[".lock"] == "mine"


def test_many_threads_hold_a_lock_one_after_the_other(tmp_path):
    inside, most, done = [], [], []

    def work():
        while len(done) < 200:
            try:
                with exclusive_lock(tmp_path / ".lock"):
                    inside.append(1)
                    most.append(len(inside))
                    done.append(1)
                    inside.pop()
            except StorageError as error:
                assert error.code == "E-LOCKED"

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert max(most) == 1 and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [".running", ".added"])
def test_results_elsewhere_are_not_published_through_a_link(results, tmp_path, name):
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    complete(theirs, "theirs")
    (results / name).symlink_to(theirs, target_is_directory=True)
    before = contents(tmp_path)
    refused(lambda: replaced(results))
    assert contents(tmp_path) == before


def test_results_are_replaced_in_a_folder_that_a_link_leads_to(results, tmp_path):
    (tmp_path / "link").symlink_to(results, target_is_directory=True)
    replaced(tmp_path / "link")
    assert contents(results)["case.toml"] == "new case.toml"


def test_a_complete_run_that_was_killed_takes_its_place_whoever_locks_the_folder(results):
    list_own(results / ".running")
    complete(results / ".running", "new")
    with folder_lock(results):
        pass
    assert contents(results)["case.toml"] == "new case.toml" and not (results / ".running").exists()


def test_a_folder_of_another_name_is_left_alone(results):
    for path in (results / ".finished", results / ".mine"):
        _files_like_ours(path, None)
    before = contents(results)
    replaced(results)
    add(results, report="one")
    assert all(contents(results)[name] == before[name] for name in before if name.startswith("."))


def test_an_interrupt_before_the_first_manifest_is_told_as_such(results, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("femgear.storage.results.list_own", interrupt)
    with pytest.raises(KeyboardInterrupt), run_folder(results, case="new", force=True):
        pass
    assert contents(results).keys() == {"case.toml", "static.nc", MANIFEST}


def test_no_folder_is_left_behind(results):
    replaced(results)
    assert contents(results).keys() == {"case.toml", "static.nc", MANIFEST}


GOOD = b"0" * 64 + b"  modes.nc\n"


@pytest.mark.parametrize("foreign", [b"years of work\n", b"0" * 63 + b"  a.csv\n", b"0" * 64 + b" a.csv\n"])
@pytest.mark.parametrize("text", [b"%s", GOOD + b"%s", b"%s" + GOOD, GOOD + b"%s" + GOOD])
def test_one_line_that_is_no_entry_makes_a_list_foreign(tmp_path, text, foreign):
    """Of whatever place; an empty list and one that ends in half an entry are our own."""
    path = tmp_path / ".written"
    path.write_bytes(text % foreign)
    with pytest.raises(StorageError, match="femgear has not written this here"):
        list_own(tmp_path)
    assert path.read_bytes() == text % foreign
    path.write_bytes(text % b"")
    list_own(tmp_path)
    path.write_bytes(text % b"" + GOOD[:30])
    list_own(tmp_path)
