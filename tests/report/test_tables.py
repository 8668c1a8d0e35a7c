"""Tables: marks of doubtful numbers, bounds, digits of small numbers, rows."""

import pytest

from femgear.findings import CATALOGUE, Finding
from femgear.report.tables import Marks, in_decibels, lower_bound, merged_names, significant, tabulate, unmarked


def test_a_doubtful_number_is_marked_where_it_stands_and_a_note_is_not():
    marks = Marks([Finding("W-PRESSURE", "", "too much"), Finding("W-OPEN", "", "a planet is unloaded")])
    columns = {"p": lambda p: marks(p, "W-PRESSURE", "W-OPEN"), "k": lambda p: marks(p, "W-DEFLECTION")}
    block = tabulate("Static", ["4573.4", "-"], columns, ("said before",), marks)
    assert block.rows == (("4573.4†", "4573.4"), ("-", "-"))
    assert block.notes == ("said before", f"† W-PRESSURE, fault: {CATALOGUE['W-PRESSURE'].sentence}")
    assert float(unmarked(block.rows[0][0])) == 4573.4


def test_every_finding_of_a_table_has_a_mark_of_its_own():
    codes = list(CATALOGUE)[:20]
    marks = Marks(Finding(code, "", "text", severity="doubt") for code in codes)
    found = [marks("1", code) for code in codes]
    assert len(set(found)) == 20 and all(unmarked(one) == "1" for one in found)
    assert found == [marks("1", code) for code in codes] and len(marks.notes) == 20


def test_a_mark_stands_for_the_same_in_all_texts_of_the_same_findings():
    findings = [Finding(code, "", "text", severity="doubt") for code in ("W-FACE-LOAD", "W-TAIL", "W-CROSS")]
    sentence, table = Marks(findings), Marks(findings)
    assert sentence("4.2", "W-CROSS", "W-TAIL") == "4.2‡§" and sentence.words == (
        "‡ too few harmonics",
        "§ stages shake one another",
    )
    assert [table("1", finding.code) for finding in findings] == ["1†", "1‡", "1§"]
    assert [note[0] for note in table.notes] == ["†", "‡", "§"]


def test_a_table_of_a_stage_has_the_marks_of_its_run():
    run = [Finding(code, "", "text", severity="doubt") for code in ("W-FACE-LOAD", "W-TAIL", "W-CROSS")]
    stage = Marks([run[2], Finding("W-OPEN", "", "a note")], run)
    assert stage("1", "W-TAIL", "W-CROSS") == "1§" and [note[0] for note in stage.notes] == ["§"]
    # raised by another stage alone
    assert not stage.raised("W-TAIL") and stage.raised("W-CROSS")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0053, "> 0.005"),
        (5.2, "> 5"),
        (0.001, "> 0.001"),
        (0.0, "> 0"),
        (24.6, "> 20"),
        (31234.0, "> 30000"),
    ],
)
def test_a_bound_is_never_above_what_it_bounds(value, text):
    assert lower_bound(value) == text and float(unmarked(text)) <= value


def test_small_numbers_keep_four_digits():
    assert [significant(one, 3) for one in (0.0, 12.3456, 0.0456, 4.2e-5)] == [
        "0.000",
        "12.346",
        "0.046",
        "4.2e-05",
    ]
    assert significant(0.00312, 3) == "0.00312"


def test_a_level_that_hardly_changes_has_no_sign():
    assert [in_decibels(one) for one in (-0.04, 0.0, 0.2, -3.0)] == ["below 0.05 dB"] * 2 + [
        "+0.2 dB",
        "-3.0 dB",
    ]


def test_names_that_differ_in_a_number_alone_stand_once_in_the_order_of_their_first():
    names = ["sun-planet 1", "planet 1-ring", "sun-planet 2", "planet 2-ring", "counter", "planet 4-ring"]
    assert merged_names(names) == "sun-planet 1..2, planet 1..2-ring, planet 4-ring, counter"
    assert merged_names([f"short {n}-long {n}" for n in (1, 2, 3)]) == "short 1..3-long 1..3"
    assert merged_names(["set 2 pair 1", "set 2 pair 2"]) == "set 2 pair 1..2"
