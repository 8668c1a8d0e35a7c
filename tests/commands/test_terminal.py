"""femgear/commands/terminal.py: tables that fit, progress that is never silent."""

import ast
import re
import time
from pathlib import Path

import pytest
from command_stand_ins import Narrow
from rich.console import Console

from femgear.commands import terminal
from femgear.findings import Finding
from femgear.report.tables import Block, merged


@pytest.mark.parametrize("width", [60, 80, 120])
def test_no_number_of_a_table_breaks_in_a_narrow_terminal(width, capsys, monkeypatch):
    """Names break between words, and what is still too wide goes below with the first column again."""
    header = "speed [rpm]", *(f"a long name of column {i} [m/s²]" for i in range(9)), "kind"
    rows = tuple((f"{100 * i}", *(f"{i}.2345{j}" for j in range(9)), "ring, rotational") for i in range(3))

    class Terminal(Console):
        def __init__(self, **options):
            super().__init__(width=width, force_terminal=True, **options)

    monkeypatch.setattr("rich.console.Console", Terminal)
    terminal.print_blocks([Block("Table", header, rows)])
    text = re.sub("\x1b[^m]*m", "", capsys.readouterr().out)
    assert max(map(len, text.splitlines())) <= width
    for cell in (cell for row in rows for cell in row[:-1]):
        assert re.search(rf"(?<![\d.]){re.escape(cell)}(?![\d.])", text)
    assert text.count("speed") == {60: 3, 80: 2, 120: 1}[width]


@pytest.mark.parametrize(("columns", "width"), [("72", 72), ("", 120), ("wide", 120)])
def test_a_file_has_the_columns_that_are_asked_for(columns, width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    terminal.print_blocks([Block("Table", (), (("name", "many words " * 40),))])
    lines = capsys.readouterr().out.splitlines()
    assert width - 12 < max(map(len, lines)) <= width


def test_equal_rows_that_follow_one_another_are_one(capsys):
    rows = (
        *(("sun-planet 1", "4.02"), ("sun-planet 2", "4.02"), ("sun-planet 3", "4.02")),
        *(("planet 1-ring", "2.7"), ("planet 2-ring", "2.7"), ("planet 3-ring", "2.8")),
        *(("12", "1"), ("14", "1"), ("250.5", "1"), ("x", "1"), ("x", "1"), ("", "1")),
    )
    assert [row[0] for row in merged(rows)] == [
        "sun-planet 1..3",
        "planet 1..2-ring",
        "planet 3-ring",
        "12",
        "14",
        "250.5",
        "x",
        "x",
        "",
    ]
    assert len({row[1] for row in merged(rows)}) == 4
    terminal.print_blocks([Block("Static", ("mesh", "STE [um]"), rows[:3])])
    out = capsys.readouterr().out
    assert out.count("4.02") == 1 and "sun-planet 1..3" in out


def test_progress_tells_per_cent_count_and_time_left(monkeypatch, capsys):
    monkeypatch.setattr("rich.console.Console", Narrow)
    with terminal.Progress() as progress:
        progress("sound", 0, 40)
        progress("sound", 10, 40)
    shown = re.sub("\x1b\\[[^a-zA-Z]*[a-zA-Z]", "", capsys.readouterr().err)
    last = [line for line in re.split("[\r\n]+", shown) if "sound" in line][-1]
    assert "25 %" in last and "10/40" in last and last.count(":") >= 2 and len(last.rstrip()) <= 80


def test_progress_of_a_short_command_leaves_nothing_in_a_file(capsys):
    with terminal.Progress() as progress:
        for done in range(3):
            progress("pictures", done, 2)
        progress("sound", 0, 1)
    assert capsys.readouterr().err == ""


def test_progress_is_never_silent_for_long_in_a_file(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "SILENCE", 0.05)
    with terminal.Progress() as progress:
        progress("pictures", 3, 11)
        time.sleep(0.5)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 2
    assert all(line.startswith("pictures, 3 of 11, ") and line.endswith(" s") for line in lines)
    assert not any("left" in line for line in lines)


def test_progress_in_a_file_says_how_long_it_will_take(monkeypatch, capsys):
    """From the pace since the first step of the stage that was seen: a command may go on where another was stopped."""
    monkeypatch.setattr(terminal, "SILENCE", 3600.0)
    now = 1000.0
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now)
    with terminal.Progress() as progress:
        progress("machines", 10, 50)
        now += 60.0
        progress("machines", 20, 50)
        assert progress._time_words() == "machines, 20 of 50, 60 s, about 180 s left"


def test_progress_before_the_first_stage_has_a_name(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "SILENCE", 0.05)
    with terminal.Progress():
        time.sleep(0.2)
    assert set(capsys.readouterr().err.splitlines()) == {"working, 0 s"}


def test_a_command_without_stages_says_what_it_does_when_it_is_long(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "SILENCE", 0.05)

    @terminal.says_when_long("solids")
    def slow(seconds: float, *, code: int = 0) -> int:
        time.sleep(seconds)
        return code

    assert slow(0.3, code=4) == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) > 2 and set(lines) == {"solids, 0 s"}
    slow(0.0)
    time.sleep(0.2)
    assert capsys.readouterr().err == ""


def test_every_command_that_may_be_long_says_something():
    """Servers, and commands that print what is stored, have nothing to wait for."""
    silent, count = set[str](), 0
    for path in Path(terminal.__file__).parent.glob("*.py"):
        for function in ast.parse(path.read_text("utf-8")).body:
            decorators = map(ast.unparse, getattr(function, "decorator_list", ()))
            if any(text.startswith("app.command") for text in decorators):
                text, count = ast.unparse(function), count + 1
                silent |= set() if "says_when_long(" in text or "Progress()" in text else {function.name}
    assert silent == {"explain", "schema", "skill", "mcp", "open_app"} and count > 20


def test_a_run_is_told_in_few_lines_of_80_columns(monkeypatch, capsys):
    """The last rows of the longest table go; a note tells how many, before the other notes."""

    class Narrow(Console):
        is_terminal = True

        def __init__(self, **options):
            super().__init__(**options, width=80)

    monkeypatch.setattr("rich.console.Console", Narrow)
    answers = tuple((f"question {i}", f"a long answer {i * i} " * 6) for i in range(5))
    numbers = tuple((f"row {i}", f"number {i * i} of a run with its place, " * 3) for i in range(30))
    blocks = [Block("answers", rows=answers), Block("numbers", rows=numbers, notes=("a note",))]
    terminal.print_briefly(blocks)
    printed = capsys.readouterr().out.splitlines()
    # three more say where the results are
    assert len(printed) <= 42 and max(map(len, printed)) <= 80
    left = sum("row " in line for line in printed)
    at = next(i for i, line in enumerate(printed) if "more by --verbose" in line)
    assert 1 < left < 30 and printed[at] == f"  {30 - left} more by --verbose" and "a note" in printed[at + 1]
    assert "question 4" in "".join(printed)
    # warnings take lines of the tables; the answers stay, and the last notes go
    terminal.print_briefly(blocks, warned=25)
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) <= 42 - 25 and "question 4" in printed and "a note" not in printed
    assert "29 more and 1 note by --verbose" in printed
    terminal.print_briefly([Block("numbers", rows=numbers[:3])])
    assert "--verbose" not in capsys.readouterr().out


def test_warnings_of_a_run_are_few_lines_on_a_terminal_and_whole_elsewhere(monkeypatch, capsys):
    """Of a note, four doubts and a fault the most severe stand there, each in two lines."""
    long = "the excitation ends below what levels need " * 6
    codes = "W-TIP", "W-TAIL", "W-PULL", "W-KINK", "W-LIFE", "W-EDGE"
    findings = [Finding(code, "entry", long) for code in codes]
    whole = terminal.warning_lines(findings)
    assert whole == tuple(f"warning: {finding}" for finding in findings)
    terminal.print_warnings(whole)
    assert capsys.readouterr().err.splitlines() == list(whole) and terminal.room_of_warnings(whole) == 0

    class Narrow(Console):
        is_terminal = True

        def __init__(self, **options):
            super().__init__(**options, width=80)

    monkeypatch.setattr("rich.console.Console", Narrow)
    lines = terminal.warning_lines(findings)
    assert len(lines) == 7 and max(map(len, lines)) <= 80
    starts = [line for line in lines if line.startswith("warning: [")]
    assert [line[10:].partition("]")[0] for line in starts] == ["W-LIFE", "W-TAIL", "W-PULL"]
    assert lines[-1] == "warning: 3 more (W-KINK, W-EDGE, W-TIP), in full by --verbose and on the page"
    assert terminal.warning_lines(findings, whole=True) == whole and terminal.room_of_warnings(lines) == 7
