"""Outlines of sectors with a crack: where it starts, how deep it may be, and that the outline is that of the gear."""

import math

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.fe.meshing import check_outline
from femgear.gears.cracked_tooth import BESIDE, SECTION, check_crack, cracked_sector
from femgear.gears.faults import Crack
from femgear.gears.tooth import half_sector
from validation.planetary import reference_set

ANGLE = math.radians(60.0)


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_sector_is_the_half_and_its_image_with_a_line_through_it(gears, number):
    gear = gears.gears[number]
    half, sector = half_sector(gear, flank_elements=6), cracked_sector(gear, angle=ANGLE, depth=1e-3, flank_elements=6)
    curves = dict(sector.curves)
    cut = half.curve("cut")
    assert np.array_equal(curves["cut_left"], cut)
    assert np.array_equal(curves["cut_right"][::-1], cut * [1.0, -1.0])
    assert np.array_equal(curves["flank_right"][::-1], half.curve("flank") * [1.0, -1.0])
    assert set(check_outline(sector).faces) == set(BESIDE)
    ((name, section),) = sector.interfaces
    assert name == SECTION and np.array_equal(section[: len(sector.crack)], sector.crack)


def test_a_crack_is_as_long_and_as_steep_as_asked_for(gears):
    for gear in gears.gears:
        crack = cracked_sector(gear, angle=ANGLE, depth=1e-3, flank_elements=6).crack
        along = crack[-1] - crack[0]
        assert np.hypot(*along) == pytest.approx(1e-3, rel=1e-12)
        inwards = 1.0 if gear.internal else -1.0
        assert along == pytest.approx([inwards * 1e-3 * math.cos(ANGLE), -1e-3 * math.sin(ANGLE)], rel=1e-9)
        assert np.linalg.norm(crack[-1] - crack[-3]) < 0.02e-3


def test_it_starts_where_the_critical_section_is_or_where_it_is_told(gears):
    sun = gears.sun
    fillet = half_sector(sun).curve("fillet")[0::2]
    mouth = cracked_sector(sun, angle=ANGLE, depth=1e-3).crack[0]
    at = int(np.argmin(np.linalg.norm(fillet - mouth, axis=1)))
    tangent = fillet[at + 1] - fillet[at - 1]
    # as near to 30 degrees as corners are to one another
    assert math.degrees(math.atan2(abs(tangent[1]), abs(tangent[0]))) == pytest.approx(30.0, abs=8.0)
    start = float(np.hypot(*fillet[-4]))
    told = cracked_sector(sun, angle=ANGLE, depth=1e-3, start=start).crack[0]
    assert np.hypot(*told) == pytest.approx(start, abs=0.05e-3)


@pytest.mark.parametrize(
    ("entries", "key"),
    [
        ({"depth": 5e-3}, "depth"),
        ({"depth": 1e-6}, "depth"),
        ({"start": 22e-3}, "diameter"),
        ({"angle": math.radians(-100.0)}, "angle"),
    ],
)
def test_cracks_that_no_tooth_has_are_refused(gears, entries, key):
    given = {"angle": ANGLE, "depth": 1e-3, "start": None} | entries
    with pytest.raises(GeometryError) as refused:
        check_crack(gears.sun, Crack(0, 0, 0, 0, given["start"], given["angle"], given["depth"]))
    assert (refused.value.code, refused.value.key) == ("E-FAULT", key)
