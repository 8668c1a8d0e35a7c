"""Members that float or rest on springs: equilibrium, equal sharing, limits, directions."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.supports import RIGID, Supports, moving_members
from femgear.errors import ContactError
from femgear.fe.elasticity import Material
from femgear.gears.kinematics import mesh_normals
from femgear.gears.planetary import equal_planet_angles
from validation.planetary import reference_set

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0
GAPS = [3e-6, 0.0, 1e-6]


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


def walk(gears, bodies, *, planet_gaps=None, supports=RIGID):
    options = CycleOptions(planet_gaps=planet_gaps)
    return walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8, supports=supports, options=options)


def test_a_floating_sun_shares_equally_among_three_planets_whatever_the_gaps(gears, bodies):
    """Statics: three lines of action at 120 deg, no radial support, so the three forces are equal."""
    rigid = walk(gears, bodies, planet_gaps=GAPS)
    floating = walk(gears, bodies, planet_gaps=GAPS, supports=Supports(sun=0.0))
    assert np.abs(rigid.load_share - 1 / 3).max() > 0.03
    assert np.abs(floating.load_share - 1 / 3).max() < 1e-9
    assert floating.residual.max() < 1e-9
    # the sun moves away from the planets without gap, by some micrometres
    assert 0.5e-6 < np.hypot(*floating.member_motion).max() < 5e-6
    assert floating.member_names == ("sun: x", "sun: y")


def test_sprung_sun_lies_between_rigid_and_floating(gears, bodies):
    shares = [
        walk(gears, bodies, planet_gaps=GAPS, supports=Supports(sun=k)).load_share[0]
        for k in (1e15, 1e9, 1e8, 1e7, 1e3)
    ]
    rigid = walk(gears, bodies, planet_gaps=GAPS).load_share[0]
    assert shares[0] == pytest.approx(rigid, abs=1e-6)
    assert np.all(np.diff(np.array(shares), axis=0) > -1e-12)
    assert shares[-1] == pytest.approx(1 / 3, abs=1e-5)


def test_springs_carry_what_the_meshes_leave(gears, bodies):
    """Force of every spring against the vector sum of the mesh forces on its member."""
    stiffness = {"sun": 5e7, "carrier": 2e8, "ring": 1e9, "planet": 3e8}
    cycle = walk(gears, bodies, planet_gaps=GAPS, supports=Supports(**stiffness))
    on_planet, on_ring = np.split(mesh_normals(gears), 2)
    sun_planet, planet_ring = cycle.force[:3], cycle.force[3:]
    expected = {
        "sun": -(on_planet.T @ sun_planet),
        "ring": on_ring.T @ planet_ring,
        "carrier": on_planet.T @ sun_planet - on_ring.T @ planet_ring,
    }
    for n in range(3):
        expected[f"planet {n + 1}"] = np.outer(on_planet[n], sun_planet[n]) - np.outer(on_ring[n], planet_ring[n])
    for i, name in enumerate(cycle.member_names):
        member, axis = name.split(": ")
        force = stiffness[member.split()[0]] * cycle.member_motion[i]
        assert force == pytest.approx(expected[member]["xy".index(axis)], abs=1e-8 * TORQUE / 0.02)


def test_bearings_lengthen_the_path_by_their_own_deflection(gears, bodies):
    """The pins move by F/k; the approach of the flanks and the equal sharing stay."""
    stiff = walk(gears, bodies)
    k = 3e8
    soft = walk(gears, bodies, supports=Supports(planet=k))
    on_planet, on_ring = np.split(mesh_normals(gears), 2)
    # work of both mesh forces on the pin: (n1 - n2) F / k, projected on n1 - n2
    extra = stiff.force[0] * ((on_planet[0] - on_ring[0]) ** 2).sum() / k
    flanks = soft.deflection - stiff.deflection
    assert soft.load_share == pytest.approx(1 / 3, abs=1e-9)
    assert soft.force == pytest.approx(stiff.force, rel=1e-9)
    # the flanks themselves approach as before: the bearing is outside the mesh
    assert np.abs(flanks).max() < 1e-12
    # and the sun turns further by what the pins give way
    assert soft.sun_arc - stiff.sun_arc == pytest.approx(extra, rel=1e-9)
    moved = soft.member_motion.reshape(3, 2, -1)[0]
    path = -(on_ring[0] - on_planet[0]) @ moved
    assert path == pytest.approx(extra, rel=1e-9)


def test_stiffness_of_the_meshes_does_not_contain_the_supports(gears, bodies):
    rigid = walk(gears, bodies)
    sprung = walk(gears, bodies, supports=Supports(sun=5e7, carrier=2e8, planet=3e8, ring=1e9))
    assert sprung.stiffness == pytest.approx(rigid.stiffness, rel=1e-9)


def test_four_planets_on_a_floating_sun_share_in_opposite_pairs(gears, bodies):
    """N = 4: two equilibrium conditions leave one pattern of unequal loads, opposite planets alike."""
    step = 2 * np.pi / 135
    angles = (0.0, 34 * step, 67 * step, 101 * step)
    four = replace(gears, planet_angles=angles)
    cycle = walk(four, bodies, planet_gaps=[4e-6, 0.0, 0.0, 0.0], supports=Supports(sun=0.0))
    assert cycle.residual.max() < 1e-9
    on_planet, _ = np.split(mesh_normals(four), 2)
    assert np.abs(on_planet.T @ cycle.force[:4]).max() < 1e-9 * cycle.force.max()
    assert np.abs(cycle.load_share - 0.25).max() > 0.005


def test_motions_follow_the_rotation_of_the_set(gears):
    """Turning all planets by one angle turns the effect of every motion."""
    turned = replace(gears, planet_angles=tuple(np.array(equal_planet_angles(3)) + 0.4))
    supports = Supports(sun=1.0, carrier=1.0, ring=1.0, planet=1.0)
    a, b = (moving_members(s, supports) for s in (gears, turned))
    turn = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])
    pairs = a.approach.reshape(6, -1, 2)
    assert b.approach.reshape(6, -1, 2) == pytest.approx(pairs @ turn, abs=1e-12)
    # moving everything together brings no flanks nearer
    together = a.approach.reshape(6, -1, 2)[:, :3].sum(axis=1)
    assert np.abs(together).max() < 1e-12


@pytest.mark.parametrize("floating", ["sun", "carrier", "ring"])
def test_a_floating_member_needs_planets_around_it(gears, bodies, floating):
    """Two planets 178.7 deg apart: their forces cannot balance, said before the contact is searched."""
    two = replace(gears, planet_angles=(0.0, 67 * 2 * np.pi / 135))
    with pytest.raises(ContactError, match=f"2 planets cannot hold a floating {floating}") as info:
        walk(two, bodies, supports=Supports(**{floating: 0.0}))
    assert info.value.code == "E-MECHANISM" and f"Supports.{floating}" in info.value.remedy
    assert walk(two, bodies, supports=Supports(**{floating: 1e6})).force.min() > 0.0
