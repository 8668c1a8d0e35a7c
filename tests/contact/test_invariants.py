"""Properties that hold for any errors: permutation, rotation, scaling, superposition, monotony."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from femgear.contact.assembly import assemble_contact
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.solve import solve_contact
from femgear.contact.supports import Supports, bearing_springs, moving_members
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import mirrored_deviations, no_deviations
from femgear.gears.planetary import mirrored_set
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0
micrometres = st.floats(-4.0, 4.0)
pins = st.lists(st.tuples(micrometres, micrometres), min_size=3, max_size=3)
supports = st.sampled_from([Supports(), Supports(sun=0.0), Supports(sun=5e7, carrier=2e8, planet=3e8)])
few = settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
# bodies of their own for every example
fewer = settings(few, max_examples=4)


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


def errors_of(gears, values):
    return replace(no_deviations(gears), pin_errors=1e-6 * np.array(values))


def walk(gears, bodies, values, held, *, torque=TORQUE, positions=2):
    return walk_mesh_cycle(
        gears,
        bodies,
        sun_torque=torque,
        positions=positions,
        deviations=errors_of(gears, values),
        supports=held,
    )


@few
@given(pins, supports)
def test_every_solution_is_in_equilibrium(gears, bodies, values, held):
    cycle = walk(gears, bodies, values, held)
    total = TORQUE / gears.sun.base_radius
    assert np.abs(cycle.force[:3].sum(axis=0) / total - 1).max() < 1e-9
    assert np.abs(cycle.force[:3] - cycle.force[3:]).max() < 1e-9 * total
    assert cycle.force.min() >= 0.0
    assert cycle.residual.max() < 1e-9


@few
@given(pins, supports)
def test_passing_the_errors_on_to_the_next_planet_passes_the_loads_on(gears, bodies, values, held):
    """Three equal planets in phase: a rotation of the set by 120 deg, and a permutation of the planets.

    Other permutations change which planets are neighbours through the elastic sun and ring.
    """
    one = walk(gears, bodies, values, held)
    two = walk(gears, bodies, values[1:] + values[:1], held)
    assert two.force[:3] == pytest.approx(one.force[[1, 2, 0]], rel=1e-6, abs=1e-6 * one.force.max())
    assert two.sun_arc == pytest.approx(one.sun_arc, rel=1e-8)


@fewer
@given(pins, supports, st.floats(0.1, 10.0))
def test_lengths_scale(gears, bodies, values, held, scale):
    """All lengths times s, E fixed: torque s^3, errors s, forces s^2, deflections s."""
    large = replace(
        gears,
        centre_distance=scale * gears.centre_distance,
        **{
            name: replace(
                gear,
                module=scale * gear.module,
                rim_radius=scale * gear.rim_radius,
                face_width=scale * gear.face_width,
            )
            for name, gear in (("sun", gears.sun), ("planet", gears.planet), ("ring", gears.ring))
        },
    )
    grown = make_bodies(make_sectors(large, STEEL, flank_elements=8), STEEL)
    softer = Supports(
        **{
            name: None if (k := getattr(held, name)) is None else k * scale
            for name in ("sun", "carrier", "planet", "ring")
        }
    )
    one = walk(gears, bodies, values, held)
    two = walk(large, grown, [(scale * a, scale * b) for a, b in values], softer, torque=scale**3 * TORQUE)
    assert two.force == pytest.approx(scale**2 * one.force, rel=1e-6, abs=1e-6 * scale**2 * one.force.max())
    assert two.sun_arc == pytest.approx(scale * one.sun_arc, rel=1e-6)


@fewer
@given(pins, st.floats(0.2, 5.0))
def test_modulus_and_torque_scale_together(gears, bodies, values, factor):
    """E and torque times f: the same deflections under the same errors."""
    material = Material(206e9 * factor, 0.3, 7850.0)
    stiff = make_bodies(make_sectors(gears, material, flank_elements=8), material)
    one = walk(gears, bodies, values, Supports())
    two = walk(gears, stiff, values, Supports(), torque=factor * TORQUE)
    assert two.sun_arc == pytest.approx(one.sun_arc, rel=1e-6)
    assert two.stiffness == pytest.approx(factor * one.stiffness, rel=1e-6)


@few
@given(pins, supports, st.floats(1.05, 3.0))
def test_more_torque_turns_the_sun_further_and_stiffens_the_path(gears, bodies, values, held, factor):
    """Contact only stiffens: the sun turns further, but by less for each further newton metre."""
    turns = [walk(gears, bodies, values, held, torque=t * TORQUE).sun_arc for t in (1.0, factor, 2 * factor - 1)]
    assert np.all(turns[1] > turns[0])
    assert np.all(turns[2] - turns[1] <= (turns[1] - turns[0]) * (1 + 1e-6))


@few
@given(st.tuples(micrometres, micrometres))
def test_the_same_error_everywhere_changes_no_load(gears, bodies, value):
    plain = walk(gears, bodies, [(0.0, 0.0)] * 3, Supports())
    moved = walk(gears, bodies, [value] * 3, Supports())
    assert moved.force == pytest.approx(plain.force, rel=1e-6)


LOOSE = Supports(sun=5e7, planet=3e8, planet_clearance=15e-6)


def solved(gears, bodies, values, held, position, torque, gaps):
    """Loads [N] and motions [nm] at one of two positions, and the cells and springs that carry.

    The windows do not depend on the torque.
    """
    members = moving_members(gears, held)
    setup = mesh_windows(
        gears,
        bodies,
        share=TORQUE / gears.sun.base_radius / 2,
        positions=2,
        cells=36,
        nearest=40e-6,
        contact="profile",
        deviations=errors_of(gears, values),
    ).with_planet_gaps(gaps)
    problem = assemble_contact(setup, bodies, position, members)
    springs, load = bearing_springs(gears, held, members), np.zeros(problem.G.shape[1])
    load[3] = torque / gears.sun.base_radius
    arrays = problem.compliance, problem.gap, problem.G
    state = solve_contact(*(arrays if springs is None else springs.joined(*arrays)), load)
    return np.concatenate([state.loads[: len(problem.gap)], 1e9 * state.motions]), state.active


@few
@given(
    pins,
    st.sampled_from([Supports(), Supports(sun=0.0), Supports(sun=5e7, carrier=2e8, planet=3e8), LOOSE]),
    st.integers(0, 1),
    st.floats(0.1, 1.0),
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
)
def test_changes_superpose_while_the_same_cells_touch(gears, bodies, values, held, position, turn, shift):
    """Loads and motions are affine in the torque and in the gaps of the planets."""
    for size in (1e-2, 1e-3, 1e-4, 1e-5):
        torques = TORQUE * np.array([1.0, 1.0 + size * turn, 1.0, 1.0 + size * turn, 1.0 + 2 * size * turn])
        gaps = 1e-6 * size * np.array(shift) * np.array([0.0, 0.0, 1.0, 1.0, 2.0])[:, None]
        found = [solved(gears, bodies, values, held, position, *one) for one in zip(torques, gaps)]
        if all(np.array_equal(active, found[0][1]) for _, active in found):
            break
    else:
        pytest.fail("the active set changes with every small change")
    start, turned, moved, both, twice = (solution for solution, _ in found)
    rounding = 1e-6 * np.abs(both - start).max() + 1e-11 * np.abs(start).max()
    assert np.abs((turned - start) + (moved - start) - (both - start)).max() < rounding
    assert np.abs(twice - start - 2 * (both - start)).max() < rounding
    assert np.abs(both - start).max() > 100 * rounding


@few
@given(pins, supports)
def test_the_mirror_image_under_the_reversed_torque_is_the_mirrored_result(gears, bodies, values, held):
    mirrored, order = mirrored_set(gears)
    errors = errors_of(gears, values)
    one = walk(gears, bodies, values, held)
    two = walk_mesh_cycle(
        mirrored,
        bodies,
        sun_torque=-TORQUE,
        positions=2,
        deviations=mirrored_deviations(errors, gears, mirrored, order),
        supports=held,
    )
    places = np.concatenate([order, np.asarray(order) + 3])
    expected = one.force[places]
    assert two.force == pytest.approx(expected, rel=1e-9, abs=1e-9 * one.force.max())
    assert two.stiffness == pytest.approx(one.stiffness[places], rel=1e-9)
