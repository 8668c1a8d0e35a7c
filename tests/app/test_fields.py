"""Fields of the form and entries of a case file are one value, whichever of them is changed."""

import tomllib
from importlib.util import find_spec

import pytest

from femgear.app.document import entry_of, with_entry

# it is loaded where a test needs it: by one of the workers of pytest
pytestmark = pytest.mark.skipif(find_spec("nicegui") is None, reason="an extra of the package")
TEXT = """
[operation]
torque = "100 N m"
input = "sun"
[[sun.modifications]]
kind = "tip relief"
amount = "4 um"
"""


class Filled:
    """A case file in a form of which some folds are open."""

    def __init__(self, *opened: str) -> None:
        from femgear.app.fields import Form, form_of_model

        self.text, self.changes, self.pinned, self.table = TEXT, [], [], form_of_model(None)
        self.form = Form(self.change, self.change_rows, self.pinned.append)
        self.form.follow(self.table, self.tables)
        for name in opened:
            self.fold(name).value = True

    @property
    def tables(self):
        return tomllib.loads(self.text)

    def change(self, key, value):
        """What was typed into a field, as a window takes it."""
        self.changes.append(key)
        self.text = with_entry(self.text, key, value)
        self.form.take(self.tables)

    def change_rows(self, key, value):
        self.change(key, value)
        self.form.show(self.table, self.tables)

    def edit(self, key, value):
        """A change from elsewhere."""
        self.text = with_entry(self.text, key, value)
        self.form.follow(self.table, self.tables)

    def field(self, key):
        from nicegui import ElementFilter

        return next((e for e in ElementFilter() if e.props.get("data-key") == key), None)

    def fold(self, name):
        from nicegui import ElementFilter, ui

        return next(fold for fold in ElementFilter(kind=ui.expansion) if fold.text.startswith(name))

    def button(self, name):
        from nicegui import ElementFilter, ui

        return next(e for e in ElementFilter(kind=ui.button) if e.props.get("aria-label") == name)


@pytest.fixture
def filled():
    from empty_window import empty_window

    with empty_window():
        yield Filled("operation", "sun", "modifications")


def test_a_field_follows_what_is_changed_elsewhere(filled):
    torque = filled.field("operation.torque")
    filled.edit("operation.torque", "150 N m")
    filled.edit("operation.input", "ring")
    assert filled.field("operation.torque") is torque and torque.value == "150 N m", "it is not drawn anew"
    assert filled.field("operation.input").value == "ring" and filled.changes == []
    filled.edit("sun.modifications[0].amount", "7 um")
    assert filled.field("sun.modifications[0].amount").value == "7 um"


def test_an_entry_follows_its_field_back_to_where_it_was(filled):
    torque = filled.field("operation.torque")
    for typed in ("15", "150 N m", "100 N m"):
        torque.value = typed
        assert entry_of(filled.tables, "operation.torque") == typed
    assert filled.changes == ["operation.torque"] * 3


def test_a_field_in_which_one_types_keeps_its_blanks(filled):
    torque = filled.field("operation.torque")
    torque.value = "150 "
    assert entry_of(filled.tables, "operation.torque") == "150" and torque.value == "150 "


def test_an_entry_that_is_taken_out_and_given_again_has_its_button_of_a_slider(filled):
    button = filled.button("Slider of torque")
    assert button.visible
    filled.field("operation.torque").value = ""
    assert entry_of(filled.tables, "operation.torque") is None and not button.visible
    filled.field("operation.torque").value = "9 N m"
    assert button.visible


@pytest.mark.parametrize("typed", ("", "none", "a, b"))
def test_what_is_no_number_has_no_button_of_a_slider(filled, typed):
    filled.field("operation.torque").value = typed
    assert not filled.button("Slider of torque").visible


def test_a_row_is_added_where_the_file_has_one_more(filled):
    assert filled.field("sun.modifications[1].kind") is None
    filled.edit("sun.modifications[1].kind", "tip relief")
    assert filled.field("sun.modifications[1].kind").value == "tip relief"


def test_what_is_said_stands_beside_the_fields(filled):
    problem = {"key": "operation.torque", "text": "no torque", "code": "E-UNIT", "limit": "", "remedy": "give one"}
    finding = {"key": "operation.input", "text": "look", "code": "W-X", "limit": "a", "remedy": ""}
    filled.form.say([problem], [finding], {})
    assert filled.field("operation.torque").error == "no torque; give one [E-UNIT]"
    assert filled.field("operation.input").props["hint"] == "look (allowed: a) [W-X]"
    assert filled.fold("operation").props["icon"] == "error"
    filled.form.say([], [finding], {})
    assert filled.field("operation.torque").error is None and filled.fold("operation").props["icon"] == "warning"
    filled.form.say([], [], {})
    assert "icon" not in filled.fold("operation").props and "hint" not in filled.field("operation.input").props


def test_teeth_within_a_gearbox_are_explained_to_users(filled):
    """Not to programmers, as the schema of a case of their own does in its further sentences."""
    from nicegui import ElementFilter, ui

    from femgear.app.fields import Form, form_of_model, form_within
    from femgear.trains.drafts import new_case

    tables = tomllib.loads(new_case("gearbox"))
    assert "source" in form_within(tables["pair"][0]["teeth"]).hint
    form = Form(filled.change, filled.change_rows, filled.pinned.append)
    form.show(form_of_model("gearbox"), tables)
    for name in ("pair", "teeth"):
        filled.fold(name).value = True
    hints = [label.text for label in ElementFilter(kind=ui.label) if "hint" in label.classes]
    assert any(text.startswith("Two gears") for text in hints) and not any("source" in text for text in hints)
