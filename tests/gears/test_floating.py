"""Which members the planets hold without a support, beside closed forms of statics."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from femgear.gears.kinematics import mesh_normals, unheld_members
from validation.planetary import reference_set

MEMBERS = ("sun", "carrier", "ring")


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def with_planets(gears, *degrees):
    """Planets anywhere: what holds a member asks neither for assembly nor for clearance."""
    loose = object.__new__(type(gears))
    loose.__dict__.update(gears.__dict__)
    loose.__dict__["planet_angles"] = tuple(math.radians(angle) for angle in degrees)
    assert loose.n_planets == len(degrees)
    return loose


@pytest.mark.parametrize("member", MEMBERS)
def test_one_member_is_held_where_the_planets_stand_around_it(gears, member):
    """Forces of planets turn with them: they balance where no gap between planets exceeds 180 deg."""
    rng = np.random.default_rng(3)
    answers = []
    for n in (1, 2, 3, 3, 3, 4, 4, 5, 6) * 6:
        angles = np.sort(rng.uniform(0, 360, n))
        gap = np.diff(angles, append=angles[0] + 360).max()
        found = unheld_members(with_planets(gears, *angles), [member])
        assert found == ((member,) if gap > 180 else ())
        answers.append(bool(found))
    assert 10 < sum(answers) < 44


@pytest.mark.parametrize("member", MEMBERS)
def test_two_opposite_planets_leave_a_member_free_to_slide(gears, member):
    """Their forces balance, but nothing resists motion across them; a third planet does."""
    assert unheld_members(with_planets(gears, 0, 180), [member]) == (member,)
    assert unheld_members(with_planets(gears, 0, 90, 180), [member]) == ()


def test_nothing_that_floats_needs_nothing(gears):
    assert unheld_members(with_planets(gears, 0), []) == ()


@pytest.mark.parametrize("both", [False, True])
def test_several_members_beside_linear_programming(gears, both):
    """Forces of all flanks with planets, sun and members in equilibrium, found by another method."""
    rng = np.random.default_rng(5)
    answers = []
    for n in (2, 3, 4, 5) * 5:
        s = with_planets(gears, *np.sort(rng.uniform(0, 360, n)))
        if any(unheld_members(s, [name], both_flanks=both) for name in ("sun", "carrier")):
            continue
        torque, planets, forces = [], [], []
        for back in (False, True)[: 1 + both]:
            sign, normals = -1.0 if back else 1.0, mesh_normals(s, back=back)
            torque += [sign] * n + [0.0] * n
            planets.append(sign * np.hstack([np.eye(n), -np.eye(n)]))
            on_sun, on_ring = -normals[:n].T, normals[n:].T
            on_carrier = np.hstack([normals[:n].T, -on_ring])
            forces.append(np.vstack([np.hstack([on_sun, 0 * on_ring]), on_carrier]))
        A = np.vstack([torque, np.hstack(planets), np.hstack(forces)])
        b = np.zeros(len(A))
        b[0] = 1.0
        possible = linprog(np.ones(A.shape[1]), A_eq=A, b_eq=b).status == 0
        assert (unheld_members(s, ["sun", "carrier"], both_flanks=both) == ()) is possible
        answers.append(possible)
    assert len(answers) > 4


def test_the_mirror_image_is_held_alike(gears):
    for angles in ((0, 120, 240), (10, 50, 170), (0, 90, 181), (5, 185)):
        mirrored = sorted(360 - a for a in angles)
        for member in MEMBERS:
            one, two = (unheld_members(with_planets(gears, *a), [member]) for a in (angles, mirrored))
            assert one == two


def test_angles_of_the_reference_set_hold_every_member(gears):
    four = replace(gears, planet_angles=tuple(np.radians(np.array([0, 34, 67, 101]) * 360 / 135)))
    for s in (gears, four):
        assert all(unheld_members(s, [name]) == () for name in MEMBERS)
        assert unheld_members(s, ["sun", "carrier"]) == ()
