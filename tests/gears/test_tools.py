"""Tools that cut teeth: what no tool of a catalogue shows."""

import math
from dataclasses import replace

import pytest

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, PinionCutter, half_thickness_angle
from femgear.gears.profile import CutterTip, inv, pressure_angle_at

TIP = CutterTip(
    pitch_radius=0.05,
    cutter_pitch_radius=0.02,
    cutter_base_radius=0.0188,
    centre_distance=0.03,
    centre_radius=0.0221,
    centre_angle=0.01,
    rounding=3e-4,
    gap_angle=0.02,
    end_angle=0.4,
)


def test_a_cutter_whose_rounding_lies_within_its_base_circle_has_no_room():
    assert TIP.room == pytest.approx(0.01)
    assert replace(TIP, centre_radius=0.0187).room < 0.0
    assert replace(TIP, centre_radius=0.0188).room < 0.0


@pytest.mark.parametrize(
    ("change", "code", "value"),
    [
        ({"tip_diameter": 38e-3}, "E-TIP", 38e-3),
        ({"profile_shift": 2.5}, "E-POINTED", 2.5),
        ({"cutter": PinionCutter(teeth=105)}, "E-CUTTER", 105),
    ],
)
def test_a_refusal_shows_the_value_that_it_refuses(change, code, value):
    gear = Gear(27, 1.5e-3, math.radians(20.0), 0.0, 0.02, 9e-3)
    if "cutter" in change:
        gear = Gear(108, 1.5e-3, math.radians(20.0), 0.0, 0.02, 0.1, internal=True)
    with pytest.raises(GeometryError) as caught:
        replace(gear, **change)
    assert caught.value.code == code and caught.value.value == pytest.approx(value)


def test_a_cutter_runs_without_play_in_the_gap_that_it_cuts():
    """On the pitch circles its tooth, from the offset of its rounding, is as wide as the gap of the gear."""
    for allowance in (0.0, 30e-6):
        alpha = math.radians(20.0)
        gear = Gear(60, 1e-3, alpha, 0.2, 1e-2, 0.04, internal=True, thickness_allowance=allowance)
        tool = gear.tool
        assert isinstance(tool, CutterTip)
        base, working = tool.cutter_base_radius, 0.5 * math.pi - tool.end_angle
        offset = tool.rounding / base + inv(pressure_angle_at(tool.centre_radius, base))
        tooth = tool.centre_angle + offset - inv(working)
        gap = math.pi / gear.teeth - half_thickness_angle(gear, tool.pitch_radius)
        assert tool.cutter_pitch_radius * tooth == pytest.approx(tool.pitch_radius * gap, rel=1e-12)
