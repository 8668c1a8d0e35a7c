"""The form of a case: from its schema, with the values of its file."""

import tomllib
from pathlib import Path

import pytest

from femgear.app.document import entry_of
from femgear.app.form import (
    Entry,
    Table,
    in_window,
    keys_of,
    page_in_window,
    shown_value,
    slider_of,
    table_of_schema,
    typed_value,
    usual_keys,
)
from femgear.trains.reading import case_schema

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))
SET = table_of_schema(case_schema())


def part(key: str):
    found = SET
    for name in key.split("."):
        found = found.part(name)
    return found


@pytest.mark.parametrize(
    ("key", "kind"),
    (
        ("sun.teeth", "integer"),
        ("sun.module", "quantity"),
        ("sun.profile_shift", "number"),
        ("operation.input", "choice"),
        ("static.stresses", "switch"),
        ("title", "text"),
        ("set.planet_angles", "list"),
        ("sun.span", "other"),
    ),
)
def test_entries_have_their_kinds(key, kind):
    assert part(key).kind == kind


def test_a_quantity_has_unit_and_window():
    face_width = part("set.face_width")
    assert (face_width.unit, face_width.scale, face_width.window) == ("mm", 1e-3, (0.1, 5000.0))
    assert part("operation").needed and part("sun.teeth").needed and not part("strength").needed
    assert part("operation.input").choices == ("sun", "ring", "carrier")


def test_lists_of_tables_are_tables():
    assert part("sun.modifications").listed and isinstance(part("sun.modifications").part("kind"), Entry)
    assert isinstance(part("sun.rack"), Table) and not part("sun.rack").listed
    assert part("nothing") is None


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_every_entry_of_a_shipped_case_has_a_field_that_gives_it_back(path):
    tables = tomllib.loads(path.read_text("utf-8"))
    form = table_of_schema(case_schema(tables.get("model"))) if tables.get("model") not in FORMER else None
    if form is None:
        pytest.skip("a file of a former model is read as another one")
    keys = list(keys_of(form, tables))
    assert keys
    for key in keys:
        entry = form
        for name in key.replace("]", "").replace("[", ".").split("."):
            entry = entry if name.isdigit() else entry.part(name)
        assert isinstance(entry, Entry), key
        value = entry_of(tables, key)
        assert typed_value(entry, shown_value(value)) == value, key


FORMER = ("drivetrain", "multistage")


@pytest.mark.parametrize(
    ("key", "typed", "value"),
    (
        ("sun.teeth", "27", 27),
        ("sun.teeth", "many", "many"),
        ("sun.profile_shift", "0.5", 0.5),
        ("sun.profile_shift", " ", None),
        ("static.stresses", "true", True),
        ("set.planet_angles", "0 deg, 120 deg", ["0 deg", "120 deg"]),
        ("set.planet_angles", '["0 deg"]', ["0 deg"]),
        ("set.planet_angles", "[broken", "[broken"),
        ("operation.torque", "5 N m", "5 N m"),
        ("sun.tooth_thickness_allowance", "cd 25", "cd 25"),
    ),
)
def test_what_is_typed_is_read(key, typed, value):
    assert typed_value(part(key), typed) == value


@pytest.mark.parametrize(
    ("value", "text"),
    (
        (None, ""),
        (True, "true"),
        ([1, 2], "1, 2"),
        ([[1.0, 2.0]], "[[1.0, 2.0]]"),
        ({"from": "1 rpm"}, '{ from = "1 rpm" }'),
    ),
)
def test_values_are_shown_as_they_are_typed(value, text):
    assert shown_value(value) == text


TORQUE = Entry("torque", "quantity", unit="N m", window=(-1e9, 1e9))
TEETH = Entry("teeth", "integer", window=(4.0, 5000.0))
SHIFT = Entry("profile_shift", "number", window=(-5.0, 5.0))


@pytest.mark.parametrize(
    ("value", "entry", "low", "high", "written"),
    (
        ("100 N m", TORQUE, 0.0, 200.0, "150 N m"),
        ("-100 N m", TORQUE, -200.0, 0.0, "-150 N m"),
        ("2 kN m", TORQUE, 0.0, 4.0, "3 kN m"),
        (27, TEETH, 4.0, 54.0, 40),
        (0.4, SHIFT, 0.0, 0.8, 0.6),
        (4.0, SHIFT, 0.0, 5.0, 3.0),
        (0.0, SHIFT, -0.05, 0.1, 0.05),
    ),
)
def test_from_nothing_to_twice_within_the_window(value, entry, low, high, written):
    slider = slider_of("key", value, entry)
    assert (slider.low, slider.high) == pytest.approx((low, high))
    place = float(str(written).split()[0])
    assert slider.entry_value(place) == written and type(slider.entry_value(place)) is type(written)
    assert slider.low <= slider.value <= slider.high and slider.step > 0.0


@pytest.mark.parametrize("value", ("free", True, None, ["1 rpm"], {"a": 1}, "1e999 N m"))
def test_what_is_no_number_has_none(value):
    assert slider_of("key", value, None) is None


def test_what_is_dragged_most_comes_first():
    keys = [
        "sun.teeth",
        "dynamics.damping_ratio",
        "operation.speeds[0]",
        "operation.torque",
        "ring.modifications[1].amount",
    ]
    assert usual_keys(keys) == [keys[3], keys[2], keys[4], keys[1]]
    assert len(usual_keys(f"ring.modifications[{i}].amount" for i in range(20))) == 6


def test_cases_within_a_case_have_forms_of_their_own():
    tables = tomllib.loads((CASES[0].parent / "e_axle.toml").read_text("utf-8"))
    box = table_of_schema(case_schema("gearbox"))
    pair = table_of_schema(case_schema("pair"))

    def embedded(value):
        return pair if isinstance(value, dict) and value.get("model") == "pair" else None

    keys = [*keys_of(box, tables, embedded=embedded)]
    assert "pair[0].teeth.gear_1.teeth" in keys and "pair[0].teeth" not in keys
    assert "pair[0].teeth" in [*keys_of(box, tables)]


@pytest.mark.parametrize(
    ("value", "step", "moved"),
    [("9.73 N m", 0.05, "10.25 N m"), ("100 N m", 1.0, "101 N m"), ("3 um", 0.02, "3.14 um"), (0.05, 0.0005, 0.0525)],
)
def test_places_of_a_slider_are_round_numbers(value, step, moved):
    slider = slider_of("a", value, None)
    assert slider.step == step and (slider.high - slider.low) / step >= 200 - 1e-6
    number = moved if isinstance(moved, float) else float(moved.split()[0])
    assert abs(number / step - round(number / step)) < 1e-6 and slider.entry_value(number) == moved


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("femgear casing CASE makes a gearbox of it", "“Gearbox › In a casing” makes a gearbox of it"),
        ("write it as a gearbox: femgear gearbox CASE", "write it as a gearbox: “Gearbox › As a gearbox”"),
        ("femgear compare with a run", "“Results › Compare” with a run"),
        ("femgear run --only static computes", "femgear run --only static computes"),
        ("femgear runs on", "femgear runs on"),
        ("femgear measured tells", "femgear measured tells"),
    ],
)
def test_commands_are_what_one_does_in_the_window(said, words):
    assert in_window([{"text": said, "number": 1.0}]) == [{"text": words, "number": 1.0}]


def test_words_of_a_page_name_the_window_and_its_scripts_stay():
    page = (
        '<p class="limit">femgear casing CASE gives it one</p><script>"femgear run";</script><code>femgear run</code>'
    )
    told = page_in_window(page)
    assert '<p class="limit">“Gearbox › In a casing” gives it one</p>' in told
    assert told.endswith('<script>"femgear run";</script><code>femgear run</code>')


@pytest.mark.parametrize("kind", ["number", "list", "integer"])
def test_a_list_with_a_number_of_many_digits_stays_text(kind):
    typed = f"[{'7' * 100_000}]"
    assert typed_value(Entry("entry", kind), typed) == typed
