"""Journals and tables of searches and sweeps: what is damaged is computed again and said, never believed."""

import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from script_runs import wait_for_lines

from femgear import cli
from femgear.errors import ContactError, StorageError
from femgear.storage import files
from femgear.study import search
from femgear.study.designs import Failure, _check, _sealed, _unsealed, evaluations
from femgear.study.objectives import NUMBER, StudyQuantity
from femgear.study.problem import Problem, Variable
from femgear.study.search import signals
from femgear.study.sweep import sweep_into
from femgear.trains.reading import read_case, to_toml, with_value, with_values
from validation.soak import programs

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
PLACES = [[x] for x in (0.1, 0.25, 0.4, 0.55, 0.7, 0.9)]
MUTANTS, SEED = (int(os.environ.get(name, least)) for name, least in (("MUTANTS", 250), ("SEED", 0)))
KEY = "dynamics.damping_ratio"


def second_of(variant) -> float:
    ratio = variant.case.dynamics.damping_ratio
    if ratio > 0.8:
        raise ContactError("too much damping", code="E-CONTACT", key=KEY)
    return ratio**2 / 3


FIRST = StudyQuantity("first", NUMBER, "gears", lambda v: v.case.dynamics.damping_ratio / 7)
SECOND = StudyQuantity("second", NUMBER, "gears", second_of)


@pytest.fixture(scope="module", autouse=True)
def quick_derivatives():
    """No contact problem behind derivatives, (n, K, P) with one variable."""
    with pytest.MonkeyPatch.context() as patch:
        lines = np.array([2.0, 3.0, 5.0])
        answer = lambda run, x: (np.outer([1.0, x[0]], lines), x[0] / 3 * np.ones((1, 2, 3)))  # noqa: E731
        patch.setattr(search, "_linearised", answer)
        yield


@pytest.fixture(scope="module")
def problem():
    return Problem(read_case(CASE), [Variable(KEY, 0.05, 0.95)], FIRST)


def work(problem, path):
    """Numbers and refusals that a search sees, how many designs it computes, and what it says."""
    found = []
    with warnings.catch_warnings(record=True) as said, evaluations(problem, journal=path) as run:
        warnings.simplefilter("always")
        for x in PLACES:
            found.append(run.values(x, [FIRST])["first"])
            try:
                found.append(run.values(x, [SECOND])["second"])
            except Failure as failure:
                found.append((failure.error["code"], str(failure)))
                assert failure.error["key"] in (KEY, None)
        for x in PLACES[:2]:
            found += [lines.tolist() for lines in signals(run, x)]
        assert len(run.designs.failures) == 1
        return found, run.designs.computed, [str(one.message) for one in said]


@pytest.fixture(scope="module")
def whole(problem, tmp_path_factory):
    """What is right, and the journal that holds it: a header, two lines a place, two of derivatives."""
    path = tmp_path_factory.mktemp("journal") / "whole.jsonl"
    found, computed, said = work(problem, path)
    assert (computed, said) == (len(PLACES), [])
    return found, path.read_bytes()


def lines_of(text):
    return re.findall(rb"[^\n]*\n|[^\n]+$", text)


def edited(*edits):
    """Lines by their number, from 1, replaced by what a function makes of them."""

    def change(text):
        header, *_ = lines = lines_of(text)
        for number, edit in edits:
            lines[number - 1] = edit(lines[number - 1], header)
        return b"".join(lines)

    return change


def swapped(text):
    lines = lines_of(text)
    lines[2], lines[4] = lines[4], lines[2]
    return b"".join(lines)


def sealed(place, /, **changes):
    """A line with other entries and the right checksum for them."""
    return place, lambda line, header: _sealed(_unsealed(line.strip(), header) | changes, header)


def forged(text):
    """A line of any text with the checksum for it."""
    return lambda _, header: text[:-1] + b', "checksum": "' + _check(header + text[:-1]) + b'"}\n'


def not_finite(line, header):
    text = re.sub(rb"0\.014\d+", b"NaN", line[: line.rindex(b', "checksum"')])
    return forged(text + b"}")(line, header)


ERROR = {"values": {"first": 0.9 / 7}}
FIVE = {"code": 5, "key": None, "message": "too much"}
SHAPE = {"value": [[2.0, 3.0], [0.2, 0.3]], "slopes": [[[0.1, 0.2, 0.3], [0.1, 0.2, 0.3]]]}
POINT = '["0.1", "0.2"]'
DAMAGED = {
    "a digit": (edited((3, lambda line, *_: line.replace(b"0.0142857", b"0.0152857"))), [3]),
    "a digit of a key": (edited((3, lambda line, *_: line.replace(b'"[0.1]"', b'"[0.2]"'))), [3]),
    "a digit of a time": (edited((3, lambda line, *_: re.sub(rb'"seconds": 0', b'"seconds": 9', line))), [3]),
    "a digit of a number": (edited((3, lambda line, *_: line.replace(b'"number": 2', b'"number": 9'))), [3]),
    "a digit of a checksum": (edited((3, lambda line, *_: line[:-4] + b'x"}\n')), [3]),
    "not a number": (edited((3, lambda line, *_: re.sub(rb"0\.014\d+", b"NaN", line))), [3]),
    "a text": (edited((3, lambda line, *_: re.sub(rb"0\.014\d+", b'"abc"', line))), [3]),
    "no values": (edited((3, lambda line, *_: re.sub(rb'"values": \{.*?\}', b'"values": 5', line))), [3]),
    "no checksum": (edited((3, lambda line, *_: re.sub(rb', "checksum".*', b"}", line))), [3]),
    "cut in the middle": (edited((5, lambda line, *_: line[:40] + b"\n")), [5]),
    "without its end": (edited((5, lambda line, *_: line[:-1])), [5]),
    "copied": (edited((5, lambda line, *_: line + line)), [6]),
    "swapped": (swapped, [4, 5]),
    "an empty line": (edited((5, lambda line, *_: line + b"\n")), [6]),
    "binary": (edited((5, lambda line, *_: b"\x00\xff\xfe\r\x85" * 40 + b"\n")), [5]),
    "zeros": (edited((5, lambda line, *_: bytes(len(line) - 1) + b"\n")), [5]),
    "not UTF-8": (edited((5, lambda line, *_: line.replace(b"number", b"n\xfcmber"))), [5]),
    "two lines": (edited((3, lambda line, *_: line[9:]), (7, lambda line, *_: b"{}\n")), [3, 7]),
    "the error": (edited((13, lambda line, *_: line.replace(b"too much", b"too many"))), [13]),
    "a slope": (edited((14, lambda line, *_: line.replace(b"0.0333", b"0.0334"))), [14]),
    "a second header": (lambda text: text + lines_of(text)[0], [16]),
    "an old line": (lambda text: text + b'{"key": "[0.1]", "record": {"values": {"first": 7.0}}}\n', [16]),
    "sealed: a text": (edited(sealed(3, record={"values": {"first": "abc"}})), [3]),
    "sealed: a truth value": (edited(sealed(3, record={"values": {"first": True}})), [3]),
    "sealed: a whole number": (edited(sealed(3, record={"values": {"first": 10**400}})), [3]),
    "sealed: no values": (edited(sealed(3, record={"values": 5})), [3]),
    "sealed: no record": (edited(sealed(3, record=[1.0])), [3]),
    "sealed: no number": (edited(sealed(3, number="2")), [3]),
    "sealed: no key": (edited(sealed(3, key="[0.1")), [3]),
    "sealed: a key too long": (edited(sealed(3, key=POINT)), [3]),
    "sealed: a key too deep": (edited(sealed(3, key="[" * 9000)), [3]),
    "sealed: an error of text": (edited(sealed(13, record=ERROR | {"error": "E-CONTACT"})), [13]),
    "sealed: an error without words": (edited(sealed(13, record=ERROR | {"error": {"code": "E"}})), [13]),
    "sealed: an error of a number": (edited(sealed(13, record=ERROR | {"error": FIVE})), [13]),
    "sealed: shapes": (edited(sealed(14, record=SHAPE)), [14]),
    "sealed: ragged": (edited(sealed(14, record={"value": [[1.0], [1.0, 2.0]], "slopes": [[[1.0]]]})), [14]),
    "sealed: texts": (edited(sealed(14, record={"value": [["1"]], "slopes": [[["1"]]]})), [14]),
    "sealed: no slopes": (edited(sealed(14, record={"value": [[1.0]]})), [14]),
    "sealed: a list": (edited((3, forged(b'["number", 2]'))), [3]),
    "sealed: too deep": (edited((3, forged(b'{"number":' + b"[" * 99_999 + b"}"))), [3]),
    "sealed: not finite": (edited((3, not_finite)), [3]),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_what_is_damaged_is_computed_again_and_said(problem, whole, tmp_path, name):
    (damage, places), (right, text) = DAMAGED[name], whole
    path = tmp_path / "j.jsonl"
    path.write_bytes(damaged := damage(text))
    assert damaged != text
    for again in (False, True):
        found, computed, said = work(problem, path)
        assert found == right and (computed == 0 or not again)
        (words,) = said
        assert "[W-JOURNAL]" in words and str(path) in words and "computed again" in words
        assert re.search(rf"\blines? {', '.join(map(str, places))};", words)
        # what was there stays there, what was lost is appended
        assert path.read_bytes().startswith(damaged)


def test_lines_of_another_case_are_not_taken(problem, whole, tmp_path):
    right, text = whole
    other = replace(problem, case=with_value(problem.case, "carrier.mass", "7 kg"))
    work(other, tmp_path / "other.jsonl")
    theirs, ours = (lines_of(one) for one in ((tmp_path / "other.jsonl").read_bytes(), text))
    (tmp_path / "j.jsonl").write_bytes(b"".join([*ours[:5], *theirs[5:]]))
    found, computed, (words,) = work(problem, tmp_path / "j.jsonl")
    assert found == right and computed == len(PLACES) - 2
    assert f"lines {', '.join(str(n) for n in range(6, 15))} and 1 more;" in words


def test_lines_that_are_missing_are_computed_again_and_said(problem, whole, tmp_path):
    right, text = whole
    lines = lines_of(text)
    (tmp_path / "j").write_bytes(b"".join([*lines[:3], *lines[5:]]))
    found, computed, (words,) = work(problem, tmp_path / "j")
    assert found == right and computed and "changed or damaged since it was written: 2 missing;" in words


def test_many_damaged_lines_are_one_warning(problem, whole, tmp_path):
    right, text = whole
    (tmp_path / "j").write_bytes(lines_of(text)[0] + b"\n" * 20)
    found, computed, (words,) = work(problem, tmp_path / "j")
    assert found == right and computed == len(PLACES) and "lines 2, 3, 4, 5, 6, 7, 8, 9, 10 and 11 more;" in words


REFUSED = {
    "a digit of the case": lambda text: re.sub(rb'"case": "(.)', b'"case": "x', text, count=1),
    "a digit of the checksum": edited((1, lambda line, *_: line[:-4] + b'x"}\n')),
    "another format": edited((1, lambda line, *_: _sealed({"format": 3, "femgear": "9.9"}))),
    "a format of text": edited((1, lambda line, *_: line.replace(b"2", b'"2"', 1))),
    "the first format": edited((1, lambda line, *_: re.sub(rb', "checksum".*', b"}", line.replace(b"2", b"1", 1)))),
    "more in the header": edited((1, lambda line, *_: _sealed({"more": 1}))),
    "no header": lambda text: b"".join(lines_of(text)[1:]),
    "a header below": lambda text: b"".join([*lines_of(text)[1:], lines_of(text)[0]]),
    "a mark before it": lambda text: b"\xef\xbb\xbf" + text,
    "ends of lines of Windows": lambda text: text.replace(b"\n", b"\r\n"),
    "notes": lambda text: b"some notes\n",
    "a note": lambda text: b"some notes",
    "zeros": lambda text: bytes(999),
    "nesting": lambda text: b"[" * 99_999 + b"\n",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_without_the_header_is_refused_and_left_as_it_is(problem, whole, tmp_path, name):
    path = tmp_path / "j.jsonl"
    path.write_bytes(damaged := REFUSED[name](whole[1]))
    with pytest.raises(StorageError, match="move this file away") as refused:
        work(problem, path)
    assert refused.value.code == "E-JOURNAL" and refused.value.file == str(path)
    assert path.read_bytes() == damaged != whole[1]


def test_only_a_regular_file_is_a_journal(problem, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "link").symlink_to(tmp_path / "empty")
    for name in ("pipe", "folder", "link"):
        with pytest.raises(StorageError, match="no regular file"):
            work(problem, tmp_path / name)
    assert (tmp_path / "empty").read_bytes() == b""


@pytest.mark.parametrize("kept", [0, 1, 40, 400, 1500, -1, -20])
def test_what_a_killed_process_left_half_written_is_nothing_to_say(problem, whole, tmp_path, kept):
    right, text = whole
    path = tmp_path / "j.jsonl"
    path.write_bytes(text[:kept])
    found, _, said = work(problem, path)
    assert found == right and said == []
    assert work(problem, path) == (right, 0, [])
    header, *lines = lines_of(path.read_bytes())
    assert header == lines_of(text)[0] and all(_unsealed(line.strip(), header) for line in lines)


def mutant(text, random):
    """A journal with one to three changes of bytes, lines, or entries whose checksum is made to fit."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        place, end = sorted(random.randrange(len(text) + 1) for _ in range(2))
        short = text[place : place + random.randrange(1, 30)]
        lines = lines_of(text)
        one, other = (random.randrange(len(lines)) for _ in range(2))
        kind = random.randrange(12)
        if kind == 0:
            text = text[:place] + bytes([random.randrange(256)]) + text[place + 1 :]
        elif kind == 1:
            text = text[:place] + text[place + len(short) :]
        elif kind == 2:
            text = text[:place] + random.randbytes(random.randrange(1, 20)) + text[place:]
        elif kind == 3:
            text = text[:place] + random.choice((b"NaN", b'"abc"', b"5", b"-Infinity", b"\n", b"null")) + text[place:]
        elif kind == 4:
            digits = [match.start() for match in re.finditer(rb"\d", text)]
            place = random.choice(digits or [0])
            text = text[:place] + b"%d" % random.randrange(10) + text[place + 1 :]
        elif kind == 5:
            text = text[:end]
        elif kind == 6:
            text = b"".join([*lines[:one], lines[other], *lines[one:]])
        elif kind == 7:
            lines[one], lines[other] = lines[other], lines[one]
            text = b"".join(lines)
        elif kind == 8:
            text = b"".join([*lines[:one], *lines[one + 1 :]])
        elif kind == 9:
            text = text[:place] + text[end:]
        elif table := _unsealed(lines[one].strip(), b"" if one == 0 else lines[0]):
            name = random.choice([*table])
            table[name] = other_kind(table[name], random)
            lines[one] = _sealed(table, b"" if one == 0 else lines[0])
            text = b"".join(lines)
        if not text:
            return text
    return text


def other_kind(value, random):
    """What is of another kind than a value, or a table of which an entry is."""
    if isinstance(value, dict) and value and random.random() < 0.8:
        name = random.choice([*value])
        return value | {name: other_kind(value[name], random)}
    others = (None, True, "abc", 5, [], [[]], {}, {"values": 5}, "[", "[1, 2, 3]", 10**30)
    return random.choice([one for one in others if type(one) is not type(value)])


@pytest.mark.slow
def test_no_mutant_of_a_journal_gives_a_wrong_number(problem, whole, tmp_path):
    """Of 250; with MUTANTS and SEED in the environment of more, and of others."""
    right, text = whole
    known, chance, refused = set(lines_of(text)), random.Random(SEED), 0
    for number in range(MUTANTS):
        path = tmp_path / f"{number}.jsonl"
        path.write_bytes(damaged := mutant(text, chance))
        try:
            found, _, said = work(problem, path)
        except StorageError as error:
            assert error.code == "E-JOURNAL" and path.read_bytes() == damaged, (SEED, number)
            refused += 1
            continue
        assert found == right, (SEED, number)
        changed = [line for line in lines_of(damaged) if line.endswith(b"\n") and line not in known]
        # of lines with the right checksum some entries are never read
        assert said or all(_unsealed(line.strip(), lines_of(text)[0]) for line in changed), (SEED, number)
        path.unlink()
    assert refused < 0.6 * MUTANTS


# --- the disk --------------------------------------------------------------------------------------


def test_a_disk_that_is_full_leaves_a_good_journal(problem, whole, tmp_path):
    """A limit on the size of files, which the system meets in the middle of a line as it does a full disk."""
    right, text = whole
    path = tmp_path / "j.jsonl"
    path.write_bytes(b"".join(lines_of(text)[:4]))
    before, limits = path.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 30, limits[1]))
    try:
        with pytest.raises(StorageError) as full:
            work(problem, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert full.value.code in ("E-STORAGE", "E-DISK-FULL") and full.value.file == str(path)
    assert path.read_bytes() == before
    found, computed, said = work(problem, path)
    assert (found, said) == (right, []) and computed == len(PLACES) - 1


# --- files of others -------------------------------------------------------------------------------

OVER = ["planet.profile_shift=0..0.1/3", "carrier.mass=1 kg,2 kg"]
OF = ["tip thickness planet"]


@pytest.fixture(scope="module")
def free():
    return with_values(read_case(CASE), {"sun.profile_shift": None, "ring.profile_shift": None})


@pytest.mark.parametrize("name", ["sweep.csv", "sweep.png"])
def test_a_sweep_replaces_its_own_table_and_figure_alone(free, tmp_path, name, monkeypatch):
    theirs = tmp_path / name
    theirs.write_text("theirs")

    def refused():
        with monkeypatch.context() as patch, pytest.raises(StorageError, match="move it away") as error:
            patch.setattr(sys.modules["femgear.study.sweep"], "sweep", lambda *_, **__: pytest.fail("computed"))
            sweep_into(free, tmp_path, over=OVER, of=OF)
        assert error.value.code == "E-OUTPUT" and error.value.file == str(theirs)

    refused()
    assert [*tmp_path.iterdir()] == [theirs] and theirs.read_text() == "theirs"
    theirs.unlink()
    first, _ = sweep_into(free, tmp_path, over=OVER, of=OF)
    mine = theirs.read_bytes()
    # its own is replaced, also by another
    sweep_into(free, tmp_path, over=OVER, of=["contact ratio sun-planet"])
    assert theirs.read_bytes() != mine
    again, _ = sweep_into(free, tmp_path, over=OVER, of=OF)
    assert theirs.read_bytes() == mine and again.computed == 0
    np.testing.assert_array_equal(again.values, first.values)
    # changed since
    theirs.write_bytes(mine + b"\n")
    refused()
    assert theirs.read_bytes() == mine + b"\n"
    theirs.unlink()
    theirs.symlink_to(CASE)
    refused()
    theirs.unlink()
    theirs.symlink_to(tmp_path / "nowhere")
    refused()
    theirs.unlink()
    theirs.mkdir()
    refused()


def test_a_sweep_keeps_out_of_the_results_of_a_run(free, tmp_path):
    (tmp_path / "manifest.json").write_text("{}")
    with pytest.raises(StorageError, match=r"E-OUTPUT.*the results of a run"):
        sweep_into(free, tmp_path, over=OVER, of=OF)
    assert len([*tmp_path.iterdir()]) == 1


def test_a_file_that_comes_while_a_sweep_computes_is_not_replaced(free, tmp_path):
    def progress(*_):
        (tmp_path / "sweep.csv").write_text("theirs")

    with pytest.raises(StorageError, match="E-OUTPUT"):
        sweep_into(free, tmp_path, over=OVER, of=OF, progress=progress)
    assert (tmp_path / "sweep.csv").read_text() == "theirs"
    (tmp_path / "sweep.csv").unlink()
    assert sweep_into(free, tmp_path, over=OVER, of=OF)[0].computed == 0


def test_another_process_may_replace_its_file_meanwhile(tmp_path, monkeypatch):
    def checksum(path, once=[]):  # noqa: B006
        if not once:
            once.append(path)
            files.write_text("new", tmp_path / "sweep.csv")
        return original(path)

    files.own_files(tmp_path, ["sweep.csv"])
    files.write_text("old", tmp_path / "sweep.csv")
    original = files.checksum
    monkeypatch.setattr(files, "checksum", checksum)
    files.own_files(tmp_path, ["sweep.csv"])
    assert (tmp_path / "sweep.csv").read_text() == "new"


def test_the_list_of_what_was_written_may_be_damaged_and_half_written(free, tmp_path):
    sweep_into(free, tmp_path, over=OVER, of=OF)
    written = tmp_path / ".written"
    checked = subprocess.run(["sha256sum", "-c", ".written"], cwd=tmp_path, capture_output=True, check=False)
    assert checked.returncode == 0 and checked.stdout.count(b"OK") == 2
    whole = written.read_bytes()
    # killed while it listed another table
    written.write_bytes(whole + whole[:30])
    for name in ("contact ratio sun-planet", *OF):
        sweep_into(free, tmp_path, over=OVER, of=[name])
    for bad in (b"", b"\xff\x00" * 99, whole.replace(b"csv", b"txt")):
        written.write_bytes(bad)
        with pytest.raises(StorageError, match="E-OUTPUT"):
            sweep_into(free, tmp_path, over=OVER, of=OF)
    written.unlink()
    written.symlink_to(CASE)
    before = CASE.read_bytes()
    for name in ("sweep.csv", "sweep.png"):
        (tmp_path / name).unlink()
    with pytest.raises(StorageError, match=r"(?s)\.written: .*move it away"):
        sweep_into(free, tmp_path, over=OVER, of=OF)
    assert CASE.read_bytes() == before


def test_a_refused_sweep_leaves_no_list(free, tmp_path):
    (tmp_path / "sweep.jsonl").write_text("theirs")
    with pytest.raises(StorageError, match="E-JOURNAL"):
        sweep_into(free, tmp_path, over=OVER, of=OF)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.jsonl"]


@pytest.mark.parametrize("name", ["a\0b", "a\0b/c", "a\ud800b"])
def test_a_folder_with_an_impossible_name_is_refused(free, tmp_path, name, capsys):
    with pytest.raises(StorageError, match="no file can have this name") as info:
        sweep_into(free, tmp_path / name, over=OVER, of=OF)
    assert info.value.limit and info.value.remedy
    words = ["sweep", str(CASE), "-o", str(tmp_path / name), "--over", "operation.torque=50 N m"]
    assert cli.main(words) == 4 and "no file can have this name" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_sweep_without_a_value_replaces_the_figure_of_one_with_values(free, tmp_path):
    sweep_into(free, tmp_path, over=OVER, of=OF)
    before = (tmp_path / "sweep.png").read_bytes()
    (tmp_path / "sweep.jsonl").unlink()
    found, names = sweep_into(free, tmp_path, over=["sun.profile_shift=2.5,3.5"], of=OF)
    assert np.isnan(found.values).all() and "sweep.png" in names
    after = (tmp_path / "sweep.png").read_bytes()
    assert after.startswith(b"\x89PNG") and after != before


HALF_WRITTEN = """
import os, signal, sys
from pathlib import Path
from femgear.storage.files import own_files, replaced_file
own_files(Path(sys.argv[1]), ["sweep.csv"])
with replaced_file(Path(sys.argv[1]) / "sweep.csv") as new:
    new.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_half_written_is_removed_by_the_next_sweep(free, tmp_path):
    killed = subprocess.run([sys.executable, "-c", HALF_WRITTEN, str(tmp_path)], check=False)
    assert killed.returncode == -9 and len(list(tmp_path.iterdir())) == 1
    with files.replaced_file(tmp_path / "of another process") as living:
        sweep_into(free, tmp_path, over=OVER, of=OF)
        assert living.exists()
    expected = {"sweep.csv", "sweep.png", "sweep.jsonl", ".written", "of another process"}
    assert {path.name for path in tmp_path.iterdir()} == expected


# --- kills -----------------------------------------------------------------------------------------

POINTS = 60


@pytest.mark.slow
def test_a_sweep_that_is_killed_goes_on_with_the_same_command(free, tmp_path):
    """By Ctrl-C, SIGTERM and kill -9 in turn, at random lines: the same table, nothing computed twice."""
    chance = random.Random(SEED)
    (tmp_path / "case.toml").write_text(to_toml(free), encoding="utf-8")
    words = ["sweep", "case.toml", "--over", f"planet.profile_shift=0..0.1/{POINTS}", "--of", *OF, "-o"]
    alone = programs.start([*words, "alone"], tmp_path).wait()
    assert f"{POINTS} computed now" in alone.out
    folder, lines = tmp_path / "killed", 1
    journal = folder / "sweep.jsonl"
    for way in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        lines += chance.randrange(2, 10)
        run = programs.start([*words, "killed"], tmp_path)
        wait_for_lines(journal, lines, run)
        run.kill(way)
        ended = run.wait()
        if way == signal.SIGKILL:
            assert ended.code == -9
        else:
            assert ended.code == 130 and "interrupted; the same command goes on" in ended.err
        assert not ended.crash and not (folder / "sweep.csv").exists()
        lines = journal.read_bytes().count(b"\n")
    last = programs.start([*words, "killed"], tmp_path).wait()
    assert last.code == 0 and f"{POINTS + 1 - lines} computed now" in last.out and "warning" not in last.err
    for name in ("sweep.csv", "sweep.png"):
        assert (folder / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    keys = [json.loads(line)["key"] for line in journal.read_bytes().splitlines()[1:]]
    assert len(keys) == len(set(keys)) == POINTS
    assert {path.name for path in folder.iterdir()} == {"sweep.csv", "sweep.png", "sweep.jsonl", ".written"}
