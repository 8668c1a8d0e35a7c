"""Tools that cut teeth: what no tool of a catalogue shows."""

from dataclasses import replace

import pytest

from femgear.gears.profile import CutterTip

TIP = CutterTip(
    pitch_radius=0.05, cutter_pitch_radius=0.02, cutter_base_radius=0.0188, centre_distance=0.03,
    centre_radius=0.0221, centre_angle=0.01, rounding=3e-4, gap_angle=0.02, end_angle=0.4,
)  # fmt: skip


def test_a_cutter_whose_rounding_lies_within_its_base_circle_has_no_room():
    assert TIP.room == pytest.approx(0.01)
    assert replace(TIP, centre_radius=0.0187).room < 0.0
    assert replace(TIP, centre_radius=0.0188).room < 0.0
