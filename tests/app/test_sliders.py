"""Sliders of entries: where they begin and end, and what they write."""

import pytest

from femgear.app.form import Entry
from femgear.app.sliders import slider_of, usual_keys

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
