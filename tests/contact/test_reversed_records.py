"""Negative torques with records that do not close: the mirror image stands where the original does."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.supports import Supports
from femgear.fe.elasticity import Material
from femgear.gears.deviations import Runout, common_period, mirrored_deviations, no_deviations
from femgear.gears.planetary import mirrored_set
from validation.planetary import reference_set

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0
POSITIONS = 2
N = 3
ORDER = [0, 2, 1, 3, 5, 4]
NAMES = ("deflection", "force", "stiffness", "max_pressure")


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


@pytest.fixture(scope="module")
def errors(gears):
    """Errors of the sun alone: all repeats after its 27 teeth. No tooth, no place is like another."""
    pitch = 2e-6 * np.random.default_rng(3).standard_normal(27)
    pins = np.array([[1e-6, 2e-6], [0.0, -1e-6], [2e-6, 0.0]])
    found = replace(no_deviations(gears), sun_pitch=pitch, sun_runout=Runout(3e-6, 0.7), pin_errors=pins)
    assert common_period(found, gears)[0] == 27
    return found


@pytest.fixture(scope="module")
def mirrored(gears, errors):
    """The set and its errors seen from behind."""
    image, order = mirrored_set(gears)
    return image, mirrored_deviations(errors, gears, image, order)


@pytest.fixture(scope="module")
def closed(gears, bodies, errors):
    return walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=POSITIONS, deviations=errors, periods=27)


def reversed_walk(bodies, mirrored, periods, **options):
    image, errors = mirrored
    return walk_mesh_cycle(
        image,
        bodies,
        sun_torque=-TORQUE,
        positions=POSITIONS,
        deviations=errors,
        periods=periods,
        **options,
    )


@pytest.mark.parametrize("periods", [1, 5, 27])
def test_reversed_mirror_image_is_the_original(closed, bodies, mirrored, periods):
    """Position p of -T on the mirrored set is position -p of +T, however long the record is."""
    capped = reversed_walk(bodies, mirrored, periods)
    count = periods * POSITIONS
    place = -np.arange(count) % (27 * POSITIONS)
    assert capped.position == pytest.approx(np.arange(count) / POSITIONS)
    for name in NAMES:
        ours, original = getattr(capped, name)[ORDER], getattr(closed, name)[:, place]
        assert ours == pytest.approx(original, rel=1e-9, abs=1e-9 * original.max()), name
    assert capped.sun_arc == pytest.approx(closed.sun_arc[place], rel=1e-9)
    # the errors are seen: no other part of the record would do
    shifted = closed.force[:, (place + 1) % (27 * POSITIONS)]
    assert np.abs(capped.force[ORDER] - shifted).max() > 1e-2 * closed.force.max()


def test_short_records_are_the_beginning_of_long_ones(bodies, mirrored):
    long, short = (reversed_walk(bodies, mirrored, periods) for periods in (6, 3))
    for name in NAMES:
        beginning = getattr(long, name)[:, : 3 * POSITIONS]
        assert getattr(short, name) == pytest.approx(beginning, rel=1e-9, abs=1e-9 * beginning.max())


def test_reversing_twice_gives_the_original_vectors(gears, bodies, errors, mirrored, closed):
    """Motions and bearing forces of a capped record, planets in their places."""
    held = Supports(sun=5e7, planet=3e8)
    one = walk_mesh_cycle(
        gears,
        bodies,
        sun_torque=TORQUE,
        positions=np.arange(1 - 3 * POSITIONS, 1) / POSITIONS,
        deviations=errors,
        supports=held,
        periods=3,
    )
    two = reversed_walk(bodies, mirrored, 3, supports=held)
    flip = np.array([1.0, -1.0])[:, None]
    mirror = two.bearing_force[[0, 2, 1]][:, :, ::-1] * flip
    assert mirror == pytest.approx(one.bearing_force, rel=1e-9, abs=1e-6)
    moved = two.member_motion.reshape(4, 2, -1)[[0, 1, 3, 2]][:, :, ::-1] * flip
    assert moved == pytest.approx(one.member_motion.reshape(4, 2, -1), rel=1e-8, abs=1e-14)
    assert one.position == pytest.approx(np.arange(1 - 3 * POSITIONS, 1) / POSITIONS)


def test_negative_positions_are_those_at_the_end_of_a_closed_record(gears, bodies, errors, closed):
    before = walk_mesh_cycle(
        gears,
        bodies,
        sun_torque=TORQUE,
        positions=np.arange(-2 * POSITIONS, 0) / POSITIONS,
        deviations=errors,
        periods=2,
    )
    for name in NAMES:
        assert getattr(before, name) == pytest.approx(getattr(closed, name)[:, -2 * POSITIONS :], rel=1e-9)


@pytest.mark.parametrize("periods", [1, 2])
def test_teeth_are_followed_through_reversed_records(gears, bodies, periods):
    """A tooth pair goes on by 1 / P of a base pitch from position to position and into the next slot.

    Its load at every place is that of the mirrored set under the positive torque at the mirrored place.
    """
    P, pitch = 4, gears.sun.base_pitch
    image, order = mirrored_set(gears)
    options = {"positions": P, "periods": periods}
    options["options"] = CycleOptions(both_flanks=True, pressures=True)
    # pins pushed inwards wedge the teeth of all planets
    pins = np.array([[-5e-6, 0.0], [-4e-6, 2e-6], [-6e-6, 1e-6]])
    errors = replace(no_deviations(gears), pin_errors=pins)
    seen = mirrored_deviations(errors, gears, image, order)
    found = walk_mesh_cycle(gears, bodies, sun_torque=-TORQUE, deviations=errors, **options)
    behind = walk_mesh_cycle(image, bodies, sun_torque=TORQUE, deviations=seen, **options)
    assert found.wedged.any()
    count = periods * P
    for side, sign in (("", 1), ("back_", -1)):
        load, path, tooth = (getattr(found, f"{side}{name}") for name in ("tooth_load", "path", "tooth"))
        there, place, number = (getattr(behind, f"{side}{name}") for name in ("tooth_load", "path", "tooth"))
        slots = load.shape[1]
        # within a slot and from its end into the next slot: 1 / P of a base pitch, no jump
        assert np.diff(path.reshape(2 * N, slots, periods, P)) == pytest.approx(sign * pitch / P, rel=1e-9)
        ends, begins = (path[:, :, P - 1], path[:, :, 0])
        ends, begins = (ends[:, :-1], begins[:, 1:]) if sign > 0 else (ends[:, 1:], begins[:, :-1])
        assert begins - ends == pytest.approx(sign * pitch / P, rel=1e-9)
        # neighbouring slots hold neighbouring teeth
        assert np.abs(np.diff(tooth, axis=2)) == pytest.approx(1)
        for mesh in range(2 * N):
            other = int(np.flatnonzero(order == mesh % N)[0]) + (mesh // N) * N
            for p in range(count):
                q = -p % count  # position -p of the mirror image
                met = np.flatnonzero(load[mesh, :, p])
                assert len(met) == np.count_nonzero(there[other, :, q])
                for slot in met:
                    apart = np.abs(place[other, :, q] + path[mesh, slot, p])
                    twin = int(apart.argmin())
                    assert apart[twin] < 1e-9 * pitch
                    assert load[mesh, slot, p] == pytest.approx(there[other, twin, q], rel=1e-7, abs=1e-6)
                    # the same tooth: it moves on by one with every period, on planets and ring the other way
                    for gear, step in ((0, 1 if mesh < N else -1), (1, -1)):
                        here = tooth[gear, mesh, slot] - step * (p // P)
                        seen_there = number[gear, other, twin] - step * ((q - count * (p > 0)) // P)
                        assert here == -seen_there, (side, mesh, gear, p)
                    if not side:
                        ours, theirs = (
                            found.pressure[mesh, slot, ::-1, p],
                            behind.pressure[other, twin, :, q],
                        )
                        assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-6 * theirs.max())
