"""Bodies in space for the page: one tooth of a gear, and the arrays of bodies and motions."""

import base64
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.report.space import Motion, SpaceBody, space, tooth_section
from femgear.trains.reading import read_case

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"


@pytest.mark.parametrize("number", range(3))
def test_one_tooth_spans_one_pitch_between_tip_and_root(number):
    gear = planetary_set(read_case(CASE)).gears[number]
    section = tooth_section(gear)
    angle, radius = np.arctan2(section[:, 1], section[:, 0]), np.hypot(*section.T)
    assert angle[[0, -1]] == pytest.approx([-np.pi / gear.teeth, np.pi / gear.teeth])
    assert (np.diff(angle) > -1e-12).all()
    assert section == pytest.approx(section[::-1] * [1.0, -1.0])
    low, high = sorted((gear.tip_radius, gear.root_radius))
    assert radius.min() == pytest.approx(low, rel=1e-3) and radius.max() == pytest.approx(high, rel=1e-3)
    # the tooth stands on the x axis
    assert abs(radius[len(radius) // 2] - gear.tip_radius) < 1e-9


def unpacked(data):
    return np.frombuffer(base64.b64decode(data["values"]), "<i2").astype(float) * data["unit"]


def test_motions_are_those_of_the_stations_in_mm_and_rad():
    place = np.array([[0.0, 0.0, 0.2], [0.0, 0.0, 0.1], [0.05, 0.0, 0.0]])
    values = np.arange(18.0).reshape(3, 6) * 1e-6
    body = SpaceBody("shaft a", "shaft", "a", (0.0, 0.0), (0.1, 0.2), ((0.0, 0.01), (0.0, 0.02)))
    model = space([body], ["a", "a", "b"], place, [Motion("mode 1", values)])
    (drawn,) = model["bodies"]
    assert (drawn["ends"], drawn["radii"]) == ([100.0, 200.0], [0.0, 10.0, 0.0, 20.0])
    # stations of a member stand in the order of z
    assert model["members"]["a"] == {"rows": [1, 0], "place": [0.0, 0.0, 100.0, 0.0, 0.0, 200.0]}
    (motion,) = model["motions"]
    assert unpacked(motion["moved"]) == pytest.approx(1e3 * values[:, :3].ravel(), abs=1e-6)
    assert unpacked(motion["turned"]) == pytest.approx(values[:, 3:].ravel(), abs=1e-9)
    assert motion["swings"] and "casing" not in model
    corners = np.array([-0.1, 0.0, 0.2]), np.array([0.1, 0.2, 0.3])
    boxed = space([body], ["a", "seat", "seat"], place, [], corners, ["seat", "seat"])
    assert boxed["casing"] == [[-100.0, 0.0, 200.0], [100.0, 200.0, 300.0]]
    assert boxed["casing_members"] == ["seat"] and boxed["members"]["seat"]["rows"] == [2, 1]


def test_marked_teeth_have_their_words():
    section = np.array([[0.01, -0.001], [0.011, 0.0], [0.01, 0.001]])
    body = SpaceBody("sun", "gear", "a", (0.0, 0.0), (0.0, 0.01), ((0.0, 0.01), (0.0, 0.01)), section, 20)
    drawn = space([replace(body, marked=((3, "crack"),)), body], ["a"], np.zeros((1, 3)), [])["bodies"]
    assert drawn[0]["marked"] == [[3, "crack"]] and "marked" not in drawn[1]
