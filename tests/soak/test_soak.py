"""Short forms of the soak tests, and the harness itself: it goes on, repeats a trial and lists what fails."""

import gc
import json
import mmap
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from femgear.errors import CaseError
from validation.soak import __main__ as program
from validation.soak import case_text, damage, faults, kills, page, programs, state, supply, trials

pytestmark = pytest.mark.usefixtures("pictures_undrawn")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One folder for all: commands run without disturbance once."""
    return tmp_path_factory.mktemp("soak")


def passed(tally: trials.Tally) -> trials.Tally:
    """The tally, asserted to be without failures."""
    assert not tally.failed, "\n".join(tally.failures)
    return tally


def fill(memory: mmap.mmap) -> int:
    """Write to all of some memory that nothing else had before, and count it."""
    return sum(memory.write(b"x" * 1_000_000) for _ in range(len(memory) // 1_000_000))


@pytest.mark.parametrize("count", [300, pytest.param(2000, marks=pytest.mark.slow)])
def test_mutated_case_files(folder, count):
    tally = passed(trials.run_trials("case_text", case_text.short(count), folder))
    assert tally.said["described"] > count / 40 and len(tally.said) > 12


def test_a_case_file_of_ten_megabytes_is_refused(tmp_path):
    path = tmp_path / "large.toml"
    path.write_bytes(b"[[a]]\n" * 1_700_000)
    with pytest.raises(CaseError, match="too long"):
        case_text.read_case(path)


# one of every kind of file; of the long ones the results of one are read by a program too
@pytest.mark.parametrize(
    "numbers", [[6, 11, 12, 15, 16, 17, 19, 20, 23], pytest.param([*range(28), 52], marks=pytest.mark.slow)]
)
def test_damaged_files(numbers, folder):
    tally = passed(trials.run_trials("damage", numbers, folder))
    assert 2 * sum(count for said, count in tally.said.items() if "refused" in said) > len(numbers)


@pytest.mark.slow
def test_killed_programs_go_on(folder):
    tally = passed(trials.run_trials("kills", kills.SHORT, folder))
    assert tally.counts["kills"] >= 3


@pytest.mark.slow
def test_faults(folder):
    tally = passed(trials.run_trials("faults", faults.SHORT, folder))
    assert any(said.endswith(": 4") for said in tally.said)


# --- the harness ------------------------------------------------------------------------------------------


def test_a_mutant_follows_from_its_number_and_every_case_is_cut_everywhere():
    assert [case_text.mutant(n) for n in range(40)] == [case_text.mutant(n) for n in range(40)]
    text = "a = 1\nb = 2\n"
    cuts = {case_text._cut_file(text, None, turn) for turn in range(len(text) + 1)}
    assert cuts == {text[:n] for n in range(len(text) + 1)}


@pytest.mark.parametrize(
    ("happens", "words"),
    [
        (lambda path: [][0], "IndexError"),
        (lambda path: [None for _ in iter(int, 1)], "does not end within"),
        (lambda path: fill(mmap.mmap(-1, 80_000_000)) and "described", "MB, described"),
    ],
)
def test_what_must_not_come_out_of_a_case_file_is_a_failure(happens, words, folder, monkeypatch):
    monkeypatch.setattr(case_text, "_STOP", 0.5)
    monkeypatch.setattr(case_text, "MEGABYTES", 50.0)
    number = 4  # a mutant of a case without teeth, which is read at once
    case_text._warm(folder, number)
    monkeypatch.setattr(case_text, "_described", happens)
    gc.freeze()  # memory that is freed meanwhile would hide what is taken
    tally = trials.run_trials("case_text", [number], folder)
    assert tally.failed == 1 and words in tally.failures[0]
    assert tally.failures[0].startswith(f"python validation/soak case_text {number}: ")


def test_a_reader_that_crashes_or_has_a_traceback_is_seen():
    import os

    assert damage.in_process(lambda: os.kill(os.getpid(), signal.SIGSEGV))[0] == "crashed"
    assert damage.in_process(lambda: {}["x"]) == ("traceback", "KeyError: 'x' ()")
    assert damage.in_process(lambda: 5) == ("read", 5)


def test_other_numbers_are_a_failure():
    assert damage._difference({"a": 1, "b": 2}, {"a": 1, "b": 2}) == ""
    assert "b" in damage._difference({"a": 1, "b": 3}, {"a": 1, "b": 2})
    assert "b" in damage._difference({"a": 1}, {"a": 1, "b": 2})


def test_left_overs_and_changed_files_are_named(tmp_path):
    assert programs.differences({"a": "1", "b": "2", ".tmp": ""}, {"a": "1", "b": "3", "c": "4"}) == (
        "differ: b; missing: c; left over: .tmp"
    )


def test_records_are_kept_and_pieces_go_on(tmp_path):
    path = tmp_path / "state.jsonl"
    known = state.State(path)
    tally = trials.Tally("case_text")
    tally.add(3, trials.Outcome("described", seconds=0.5, megabytes=12.0))
    tally.add(4, trials.Outcome("stopped", "too slow", counts={"kills": 2}))
    record = {"kind": "case_text", "commit": "abc", "machine": "m", "seconds": 60.0, "ended": 0}
    for index in (0, 2):
        known.add(record | {"index": index, "tally": tally.record()})
    with open(path, "a") as stream:
        stream.write('{"kind": "case_te')  # a call that was killed
    again = state.State(path)
    assert again.next_index("case_text", set()) == 1 and again.next_index("case_text", {1}) == 3
    again.add(record | {"index": 1, "tally": tally.record()})
    records, total = state.State(path).of("case_text", "abc")
    assert len(records) == 3 and total.trials == 6 and total.failed == 3
    assert total.worst_seconds == [0.5, 3] and total.counts["kills"] == 6
    page.write_page(again, tmp_path / "page.md", tmp_path / "absent.md")
    text = (tmp_path / "page.md").read_text()
    assert page.page(again, "# Mutants\n\n| **all** | 7 |\n\n## Survivors\n\nNone.\n").count("\n### Survivors") == 1
    assert "`python validation/soak case_text 4: too slow`" in text and "| Case files | 3 | 6 | 3 | 0.50 (3) |" in text


def test_the_program_runs_pieces_and_repeats_a_trial(tmp_path, capsys, monkeypatch):
    """With a kind whose module is a stand-in, in processes that print what such a piece prints."""
    made = trials.Tally("sets")
    made.add(9, trials.Outcome("in phase", "no equilibrium"))
    stand_in = tmp_path / "soak"
    stand_in.write_text(f"print({json.dumps(json.dumps(made.record()))})\n")
    monkeypatch.setattr(program, "ROOT", tmp_path)
    (tmp_path / "validation").mkdir()
    stand_in.rename(tmp_path / "validation" / "soak")
    where = ["--folder", str(tmp_path / "out")]
    assert program.main(["sets", "--minutes", "0.01", *where, "--page", str(tmp_path / "page.md")]) == 1
    said = capsys.readouterr().out
    assert "sets 0: 1 trials, 1 failures" in said and "python validation/soak sets 9: no equilibrium" in said
    assert "no equilibrium" in (tmp_path / "page.md").read_text()
    (tmp_path / "validation" / "soak").write_text("import os\nos.abort()\n")
    assert program.main(["sets", "--minutes", "0.001", "--processes", "1", *where]) == 1
    assert "ended with -6" in capsys.readouterr().out
    monkeypatch.setattr(program, "run_trials", lambda *_: made)
    assert program.main(["sets", "9"]) == 1 and "no equilibrium" in capsys.readouterr().out


def test_licences_of_all_that_is_needed_are_stated():
    names = supply.requirements()
    assert {"numpy", "scipy", "gmsh", "h5py"} <= {name.lower() for name in names}
    assert not [name for name in names if supply.licence(name) == "not stated"]


@pytest.mark.parametrize(
    ("out", "err", "words"),
    [
        ("", "ConnectionError: no network", "known holes: not looked up, ConnectionError: no network"),
        ("", "No module named pip_audit", "known holes: not looked up, No module named pip_audit"),
        (
            '{"dependencies": [{"name": "a", "version": "1", "vulns": [{"id": "X"}]}, {"skip_reason": ""}]}',
            "",
            "known holes of 1 packages: 1; 1 others could not be looked up\n  a 1: X",
        ),
    ],
)
def test_what_pip_audit_says_and_that_it_says_nothing(out, err, words, monkeypatch):
    done = subprocess.CompletedProcess([], 1, out, err)
    monkeypatch.setattr(supply.subprocess, "run", lambda *_, **__: done)
    assert supply.known_holes() == words


def test_the_page_of_the_repository_is_one_that_the_harness_writes():
    text = (Path(__file__).resolve().parents[2] / "docs" / "reliability.md").read_text(encoding="utf-8")
    assert text.startswith(page.HEAD) and page.KNOWN in text and "## Failures" in text
    assert sys.executable not in text
