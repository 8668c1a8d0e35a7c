"""Entries of a case file are changed in its text, and nothing else is."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from femgear.app.document import entry_of, tables_of_text, with_entry
from femgear.errors import CaseError

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))
TEXT = """# what it is
title = "a"  # the title

[sun]   # driven
teeth = 27  # of them
rack = { root_radius = 0.3 }

[[sun.modifications]]
kind = "tip relief"   # at the tip

# the operation
[operation]
speeds = ["250 rpm", "3100 rpm"]   # of the input
"""


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_shipped_case_keeps_its_text(path):
    text = path.read_text("utf-8")
    title = tables_of_text(text)["title"]
    assert with_entry(text, "title", title) == text
    changed = with_entry(text, "title", "another")
    lines = [(a, b) for a, b in zip(text.splitlines(), changed.splitlines(), strict=True) if a != b]
    assert len(lines) == 1 and '"another"' in lines[0][1]


@pytest.mark.parametrize(
    ("key", "value", "line"),
    (
        ("sun.teeth", 30, "teeth = 30  # of them"),
        ("sun.rack.root_radius", 0.25, "rack = { root_radius = 0.25 }"),
        ("sun.modifications[0].kind", "root relief", 'kind = "root relief"   # at the tip'),
        ("operation.speeds[1]", "3000 rpm", 'speeds = ["250 rpm", "3000 rpm"]   # of the input'),
        ("operation.torque", "5 N m", 'torque = "5 N m"'),
        ("sun.modifications[0].amount", "5 um", 'amount = "5 um"'),
    ),
)
def test_one_line_is_changed_or_added(key, value, line):
    changed = with_entry(TEXT, key, value)
    assert line in changed.splitlines()
    assert entry_of(tomllib.loads(changed), key) == value
    others = [text for text in TEXT.splitlines() if text.split("=")[0].strip() != line.split("=")[0].strip()]
    assert [text for text in changed.splitlines() if text in others] == others
    assert with_entry(with_entry(changed, key, value), key, value) == changed


def test_tables_and_lists_are_made_where_they_are_missing():
    changed = with_entry(TEXT, "set.pin_errors[0].planet", 2)
    changed = with_entry(changed, "set.pin_errors[1].planet", 3)
    changed = with_entry(changed, "strength.quality", 6)
    tables = tomllib.loads(changed)
    assert tables["set"]["pin_errors"] == [{"planet": 2}, {"planet": 3}] and tables["strength"] == {"quality": 6}
    assert "\n\n[strength]\nquality = 6" in changed, "headers stand after an empty line"
    for number in (1, 0):
        changed = with_entry(changed, f"set.pin_errors[{number}]", None)
    assert "pin_errors" not in tomllib.loads(changed).get("set", {})


def test_an_entry_is_taken_out():
    changed = with_entry(TEXT, "sun.rack", None)
    assert "rack" not in tomllib.loads(changed)["sun"] and "# driven" in changed
    assert with_entry(changed, "sun.rack", None) == changed
    assert with_entry(changed, "ring.teeth", None).strip().startswith("# what it is")


@pytest.mark.parametrize("key", ("title.a", "sun.teeth.of", "sun.modifications[4].kind", "sun[0].teeth", "sun.rack[0]"))
def test_there_is_no_place_for_it(key):
    with pytest.raises(CaseError) as refused:
        with_entry(TEXT, key, 1)
    assert refused.value.code == "E-TYPE" and refused.value.key == key


@pytest.mark.parametrize("text", ("a = ", "[a", "a = 1\na = 2", "a = " + 2000 * "["))
def test_what_is_no_toml_is_refused(text):
    with pytest.raises(CaseError, match="no TOML"):
        with_entry(text, "a", 1)


@given(st.text(max_size=60))
def test_any_text_can_be_a_value(value):
    assert tomllib.loads(with_entry(TEXT, "title", value))["title"] == value


@pytest.mark.parametrize(
    ("key", "value"), (("sun.modifications[0].kind", "tip relief"), ("sun.modifications[1].kind", None), ("a.b", None))
)
def test_entries_are_found(key, value):
    assert entry_of(tomllib.loads(TEXT), key) == value
