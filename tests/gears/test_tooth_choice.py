"""Neighbouring tooth numbers against loops over single sets."""

import math

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.phasing import (
    KINDS,
    MeshPhasing,
    check_teeth,
    mesh_phasing,
    neighbouring_teeth,
    phasing_table,
)
from femgear.gears.planetary import equal_planet_angles, feasible_angles
from validation.reference.gear_limits import neighbour_limit


@pytest.mark.parametrize(("wanted", "planets"), [((30, 20, 70), 4), ((27, 40, 108), 3), ((29, 16, 61), 5)])
def test_every_choice_agrees_with_its_own_phasing(wanted, planets):
    found = neighbouring_teeth(*wanted, planets, distance=2, ratio_tolerance=0.051, fitting=False)
    expected = [
        (s, p, r)
        for s in range(wanted[0] - 2, wanted[0] + 3)
        for p in range(wanted[1] - 2, wanted[1] + 3)
        for r in range(wanted[2] - 2, wanted[2] + 3)
        if abs(r - s - 2 * p) <= 1 and abs((1 + r / s) / (1 + wanted[2] / wanted[0]) - 1) < 0.051
    ]
    assert sorted(map(tuple, found.teeth.tolist())) == sorted(expected)
    for i, (sun, planet, ring) in enumerate(found.teeth.tolist()):
        psi = feasible_angles(sun + ring, equal_planet_angles(planets))
        phasing = mesh_phasing(sun, ring, psi)
        table = phasing_table(phasing, range(1, 5))
        assert phasing.equally_spaced == found.equally_spaced[i] == ((sun + ring) % planets == 0)
        assert tuple(found.positions[i]) == phasing.positions
        assert tuple(found.kind_names[i]) == table.kind
        assert np.array_equal(found.cyclic[i], table.cyclic)
        assert found.sums[i] == pytest.approx(table.members[:, 0, :2], abs=1e-12)
        meets = math.lcm(sun, planet) == sun * planet and math.lcm(planet, ring) == planet * ring
        assert found.hunting[i] == meets
        assert found.spacing_error[i] == pytest.approx(
            max(abs(a - b) for a, b in zip(psi, equal_planet_angles(planets))), abs=1e-12
        )


def test_nearest_ratio_comes_first():
    found = neighbouring_teeth(30, 20, 70, 4)
    assert tuple(found.teeth[0]) == (30, 20, 70) and found.ratio_change[0] == 0
    assert np.all(np.diff(np.abs(found.ratio_change)) > -1e-12)
    assert found.ratio == pytest.approx(1 + found.teeth[:, 2] / found.teeth[:, 0])
    assert np.abs(found.ratio_change).max() <= 0.03 + 1e-12


@pytest.mark.parametrize("planets", range(3, 9))
def test_overlapping_planets_are_left_out(planets):
    """Against the closed form pi / asin((z_p + 2) / (z_s + z_p))."""
    found = neighbouring_teeth(30, 18, 66, planets, distance=6, ratio_tolerance=1, closure=0, fitting=False)
    equal = found.only(found.equally_spaced)
    limit = np.array([neighbour_limit(s, p) for s, p, _ in equal.teeth.tolist()])
    assert np.array_equal(equal.room > 0, planets < limit)
    kept = neighbouring_teeth(30, 18, 66, planets, distance=6, ratio_tolerance=1, closure=0)
    assert len(kept) == np.count_nonzero(found.room > 0)


def test_room_between_planets_far_apart_is_measured_on_the_near_side():
    """Two opposite planets: twice the centre distance less a tip diameter; one planet: no limit."""
    found = neighbouring_teeth(30, 20, 70, 2, distance=0)
    assert found.room == pytest.approx([50 - 22])
    assert np.isinf(neighbouring_teeth(30, 20, 70, 1, distance=0).room).all()


def test_chosen_by_phasing():
    """29/19/67 is the nearest ratio to 30/20/70 that turns the first harmonic into lateral forces."""
    found = neighbouring_teeth(30, 20, 70, 4)
    even = found.only(found.equally_spaced)
    chosen = even.only(even.kind[:, 0] == KINDS.index("sequentially phased"))
    assert tuple(chosen.teeth[0]) == (31, 21, 73) and tuple(chosen.teeth[1]) == (29, 19, 67)


def test_numbers_out_of_range_are_refused():
    for change in (
        dict(distance=-1),
        dict(distance=31),
        dict(closure=11),
        dict(harmonics=0),
        dict(ratio_tolerance=-0.1),
        dict(ratio_tolerance=math.nan),
        dict(sun_teeth=4),
        dict(sun_teeth=30.0),
        dict(ring_teeth=20),
        dict(planets=0),
    ):
        arguments = dict(sun_teeth=30, planet_teeth=20, ring_teeth=70, planets=4) | change
        with pytest.raises(GeometryError, match=r"E-CHOICE|E-RANGE"):
            neighbouring_teeth(**arguments)


def test_closure_is_what_profile_shifts_must_take_up():
    """At standard centre distances the meshes of 30/20/71 are half a module apart: z_r - z_s - 2 z_p = 1."""
    found = neighbouring_teeth(30, 20, 70, 4, distance=2, closure=3, ratio_tolerance=1)
    sun, planet, ring = found.teeth.T
    apart = (ring - planet) / 2 - (sun + planet) / 2
    assert np.array_equal(found.closure, 2 * apart)
    assert {-3, 0, 3} <= set(found.closure.tolist())


def test_nothing_near_is_an_empty_list():
    assert len(neighbouring_teeth(30, 20, 90, 4, distance=1)) == 0


def test_teeth_that_make_no_set_are_refused_and_rough_ones_remarked_on():
    four = mesh_phasing(30, 70, equal_planet_angles(4))
    assert check_teeth(four, 20) == () == check_teeth(mesh_phasing(27, 108, equal_planet_angles(3)), 40)
    (said,) = check_teeth(four, 19)
    assert "z_r - z_s - 2 z_p = 2" in said
    with pytest.raises(GeometryError, match="E-CHOICE") as info:
        check_teeth(four, 5)
    assert "20 teeth close" in info.value.remedy
    # seven planets of 20 teeth need 2 (50 / 2) sin(pi / 7) = 21.7 modules, their tips take 22
    near = MeshPhasing(30, 70, tuple(round(n * 100 / 7) for n in range(7)))
    (said,) = check_teeth(near, 20)
    assert "overlap by" in said
    with pytest.raises(GeometryError, match="E-NEIGHBOURS"):
        check_teeth(MeshPhasing(30, 70, tuple(range(0, 100, 10))), 20)


def test_without_a_tolerance_the_same_ratio_alone_is_found():
    found = neighbouring_teeth(30, 20, 70, 4, distance=3, ratio_tolerance=0.0, fitting=False)
    assert [30, 20, 70] in found.teeth.tolist() and not np.any(found.ratio - (1.0 + 70.0 / 30.0))
