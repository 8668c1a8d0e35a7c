"""Sliders and entries of a case file are one value, whichever of them is changed."""

import tomllib
from importlib.util import find_spec

import pytest

from femgear.app.document import entry_of, with_entry

# it is loaded where a test needs it: by one of the workers of pytest
pytestmark = pytest.mark.skipif(find_spec("nicegui") is None, reason="an extra of the package")
TEXT = '[operation]\ntorque = "100 N m"\nspeeds = ["1000 rpm", "2000 rpm"]\n[dynamics]\ndamping_ratio = 0.05\n'


class Dragged:
    """A case file whose entries sliders change."""

    def __init__(self) -> None:
        from femgear.app.sliders import Sliders

        self.text, self.changes = TEXT, []
        self.sliders = Sliders(self.change)
        self.sliders.show(self.tables)

    @property
    def tables(self):
        return tomllib.loads(self.text)

    def change(self, key, value):
        self.changes.append(key)
        self.type(key, value)

    def type(self, key, value):
        self.text = with_entry(self.text, key, value)
        self.sliders.show(self.tables)

    def widgets(self):
        from nicegui import ElementFilter, ui

        return {slider.props["data-slider"]: slider for slider in ElementFilter(kind=ui.slider)}


@pytest.fixture
def dragged():
    from empty_window import empty_window

    with empty_window():
        yield Dragged()


def test_what_is_dragged_most_has_a_slider_at_first(dragged):
    keys = ["operation.torque", "operation.speeds[0]", "operation.speeds[1]", "dynamics.damping_ratio"]
    assert list(dragged.widgets()) == keys
    assert [slider.value for slider in dragged.widgets().values()] == [100.0, 1000.0, 2000.0, 0.05]


@pytest.mark.parametrize(
    ("key", "typed", "place"),
    (
        ("operation.torque", "150 N m", 150.0),
        ("operation.speeds[1]", "2500 rpm", 2500.0),
        ("dynamics.damping_ratio", 0.07, 0.07),
        ("operation.torque", "0.9 kN m", 0.9),
    ),
)
def test_a_slider_follows_what_is_typed(dragged, key, typed, place):
    before = dragged.widgets()
    dragged.type(key, typed)
    slider = dragged.widgets()[key]
    assert slider.value == place and slider.props["min"] <= place <= slider.props["max"]
    assert dragged.changes == [], "a slider that follows changes nothing"
    assert dragged.widgets() == before, "it is not drawn anew, so that it can be dragged on"


def test_load_cases_of_a_gearbox_are_dragged(dragged):
    from femgear.app.new_case import drafted_case

    dragged.text = drafted_case("gearbox", {"torque": "20 N m", "speed": "900 rpm"})[0]
    dragged.sliders.begin()
    dragged.sliders.show(dragged.tables)
    torque, speed = "operation.load_case[0].torque.motor", "operation.load_case[0].speed.input"
    assert {key: slider.value for key, slider in dragged.widgets().items()} == {torque: 20.0, speed: 900.0}
    dragged.widgets()[torque].value = 25.0
    assert entry_of(dragged.tables, torque) == "25 N m" and dragged.changes == [torque]


def test_a_slider_keeps_its_range_until_a_value_leaves_it(dragged):
    slider = dragged.widgets()["operation.torque"]
    dragged.type("operation.torque", "180 N m")
    assert (slider.props["min"], slider.props["max"]) == (0.0, 200.0)
    dragged.type("operation.torque", "300 N m")
    assert (slider.props["min"], slider.props["max"]) == (0.0, 600.0)


def test_an_entry_follows_its_slider_and_no_other_is_changed(dragged):
    dragged.widgets()["operation.speeds[0]"].value = 1234.5678901
    assert entry_of(dragged.tables, "operation.speeds") == ["1234.57 rpm", "2000 rpm"]
    assert dragged.changes == ["operation.speeds[0]"]
    assert entry_of(dragged.tables, "operation.torque") == "100 N m"


def test_a_slider_is_back_with_its_entry(dragged):
    dragged.type("operation.torque", None)
    assert "operation.torque" not in dragged.widgets()
    dragged.type("operation.torque", "80 N m")
    assert dragged.widgets()["operation.torque"].value == 80.0


def test_sliders_are_chosen(dragged):
    dragged.type("static.positions", 32)
    assert dragged.sliders.pin("static.positions", dragged.tables) and dragged.sliders.pin(
        "operation.speeds", dragged.tables
    )
    assert list(dragged.widgets())[-1] == "static.positions"
    dragged.type("title", "a")
    assert not dragged.sliders.pin("title", dragged.tables)
    dragged.widgets()["static.positions"].value = 40.2
    assert entry_of(dragged.tables, "static.positions") == 40
    dragged.sliders.begin()
    assert not dragged.widgets()
