"""All positions at once against one position at a time: loads, motions and stiffness of random sets."""

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from random_sets import random_set

from femgear.case.gear_set import material_of, planetary_set
from femgear.contact import batch, cycle
from femgear.contact.assembly import contact_candidates
from femgear.contact.batch import ContactTangents, solve_batch
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, loaded_image, walk_mesh_cycle
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.solve import solve_contact
from femgear.contact.supports import Supports, bearing_springs, moving_members
from femgear.contact.width_waves import width_waves
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import FlankForm, Runout, no_deviations
from femgear.gears.modifications import FlankTwist, LeadCrowning, LeadSlope, ProfileSlope
from validation.planetary import reference_set
from validation.reference.tangent import mesh_tangent_matrix, tangent_stiffness

STEEL = Material(206e9, 0.3, 7850.0)
SPRUNG = Supports(sun=5e7, carrier=2e8, planet=3e8)
LOOSE = Supports(sun=5e7, planet=3e8, planet_clearance=15e-6)
# three, four and five planets: in phase, out of phase and unequally spaced
SEEDS = (3, 4, 5, 6, 7, 8, 9, 10, 11)
QUICK = ((3, 1.0), (6, -1.0))
_solved = {}


def random_bodies(seed):
    """A random set with its bodies, and the torque on a sun whose teeth are pressed as usual."""
    if seed not in _solved:
        case = random_set(seed).case
        gears, material = planetary_set(case), material_of(case, "sun")
        bodies = make_bodies(make_sectors(gears, material, flank_elements=8), material)
        # force per face width and module [N/m^2]
        force = 3e7 * bodies.widths[0] * gears.sun.module * material.youngs_modulus / 206e9
        _solved[seed] = gears, bodies, force * gears.n_planets * gears.sun.base_radius
    return _solved[seed]


def both_ways(gears, bodies, torque, *, supports, pins=0.0, both_flanks=False, gap=0.0):
    """Loads, motions and stiffness (own, coupled) by the batch and by the single positions.

    Pins are off their places by up to `pins` deflections of a mesh under its share of the torque.
    """
    rng = np.random.default_rng(5)
    share = abs(torque) / gears.sun.base_radius / gears.n_planets
    approach = share / (10e9 * bodies.widths[0])
    places = pins * approach * rng.uniform(-1.0, 1.0, (gears.n_planets, 2))
    errors = replace(no_deviations(gears), pin_errors=places)
    solved, _, errors = loaded_image(gears, torque, errors)
    members = moving_members(solved, supports, both_flanks=both_flanks)
    setup = mesh_windows(
        solved,
        bodies,
        share=3 * share,
        nearest=4 * approach,
        positions=5,
        deviations=errors,
        both_flanks=both_flanks,
    ).with_planet_gaps(np.full(gears.n_planets, gap * approach))
    springs = bearing_springs(solved, supports, members)
    found = contact_candidates(setup, bodies, np.arange(5), members)
    load = np.zeros(found.approach.shape[1])
    load[gears.n_planets] = abs(torque) / gears.sun.base_radius
    state = solve_batch(found, load, springs)
    tangents, meshes = ContactTangents(found, state), len(setup.near)
    several = (
        [],
        state.motions,
        tangents.of_meshes(found.smooth),
        tangents.between_meshes(found.images, meshes)[0],
    )
    single = [], [], [], []
    for at in range(5):
        problem, candidate = found.problem(at), found.candidate[at]
        arrays, cells = (problem.compliance, problem.gap, problem.G), len(problem.gap)
        if springs is not None:
            arrays = springs.joined(*arrays)
        one = solve_contact(*arrays, load)
        one = replace(one, loads=one.loads[:cells], gaps=one.gaps[:cells], active=one.active[:cells])
        assert np.array_equal(one.active, state.active[at][candidate])
        window = problem.mesh * 1000 + problem.pair
        own = tangent_stiffness(problem.H, one, problem.mesh, window, problem.cell, meshes)
        coupled = mesh_tangent_matrix(problem.H, one.active, problem.mesh, meshes)
        several[0].append(state.loads[at][candidate])
        for values, value in zip(single, (one.loads, one.motions, own, coupled), strict=True):
            values.append(value)
    assert state.residual.max() < 1e-11
    return zip(several, single, strict=True)


def compare(pairs):
    for several, singles in pairs:
        for one, expected in zip(several, singles, strict=True):
            assert one == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("seed", "sign"),
    [
        pytest.param(seed, sign, marks=() if (seed, sign) in QUICK else pytest.mark.slow)
        for seed in SEEDS
        for sign in (1.0, -1.0)
    ],
)
def test_random_sets(seed, sign, monkeypatch):
    # no position is left to the other route
    monkeypatch.delattr("femgear.contact.batch.solve_contact")
    gears, bodies, torque = random_bodies(seed)
    compare(both_ways(gears, bodies, sign * torque, supports=SPRUNG, pins=0.3))


@pytest.mark.parametrize("seed", SEEDS[::4])
def test_light_torque_under_which_planets_open(seed):
    gears, bodies, torque = random_bodies(seed)
    results = list(both_ways(gears, bodies, 0.02 * torque, supports=Supports(), pins=30.0))
    stiffness = np.array(results[2][1])
    assert (stiffness == 0).any() and (stiffness > 0).any()
    compare(results)


@pytest.mark.parametrize("supports", [Supports(), Supports(sun=0.0), LOOSE], ids=["fixed", "floating", "loose"])
def test_supports(supports):
    gears = reference_set()
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)
    for torque in (100.0, -3.0):
        compare(both_ways(gears, bodies, torque, supports=supports, pins=0.5))


@pytest.mark.decisive
def test_planet_with_clearance_that_loses_all_load(monkeypatch):
    # its motions are restrained by nothing: most positions need no other route all the same
    alone = []
    one = batch.solve_contact
    monkeypatch.setattr(batch, "solve_contact", lambda *arrays, **start: alone.append(1) or one(*arrays, **start))
    gears = reference_set()
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)
    results = list(both_ways(gears, bodies, 1.0, supports=LOOSE, pins=60.0))
    assert (np.array(results[2][1]) == 0).any()
    assert len(alone) <= 1
    compare(results)


def test_teeth_wedged_between_both_flanks():
    gears = reference_set()
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)
    results = list(both_ways(gears, bodies, 5.0, supports=Supports(), both_flanks=True, gap=-400.0))
    assert (np.array(results[2][1])[:, 6:] > 0).any()
    compare(results)


def test_a_position_solved_alone_begins_with_what_touches_at_the_one_before(monkeypatch):
    gears, bodies, torque = random_bodies(SEEDS[1])
    together, alone, starts, solved = batch.solve_batch, batch.solve_contact, [], []

    def noting(*arrays, start, **options):
        starts.append(start)
        return alone(*arrays, start=start, **options)

    def keeping(found, load, springs):
        solved.append((found.candidate, together(found, load, springs)))
        return solved[-1][1]

    # no position is solved together with others
    monkeypatch.setattr(batch, "MOST_STEPS", 0)
    monkeypatch.setattr(batch, "solve_contact", noting)
    monkeypatch.setitem(globals(), "solve_batch", keeping)
    compare(both_ways(gears, bodies, torque, supports=Supports()))
    ((candidate, state),) = solved
    assert len(starts) == 5
    for at in range(1, 5):
        assert np.array_equal(starts[at], state.active[at - 1][candidate[at]])


def test_steps_of_a_position_solved_alone_count_with_those_before(monkeypatch):
    gears, bodies, torque = random_bodies(SEEDS[0])
    together, alone, states = batch.solve_batch, batch.solve_contact, []
    counted = []

    def counting(*arrays, **options):
        state = alone(*arrays, **options)
        counted.append(state.iterations)
        return state

    monkeypatch.setattr(batch, "MOST_STEPS", 2)
    monkeypatch.setattr(batch, "solve_contact", counting)
    monkeypatch.setitem(globals(), "solve_batch", lambda *given: states.append(together(*given)) or states[-1])
    compare(both_ways(gears, bodies, torque, supports=SPRUNG, pins=0.3))
    steps = states[0].iterations
    # the others: two steps and one that takes out the rounding
    rest = [3] * (len(steps) - len(counted))
    assert len(counted) > 0 and sorted(steps.tolist()) == sorted([2 + count for count in counted] + rest)


def both_routes(gears, images, monkeypatch, *given, **options):
    """A cycle from the planets of one sector, and from all of them."""
    sizes, together = [], batch.solve_batch

    def noting(found, *others):
        sizes.append(found.setup.n_planets)
        return together(found, *others)

    monkeypatch.setattr(batch, "solve_batch", noting)
    one = walk_mesh_cycle(gears, *given, **options)
    assert set(sizes) == {gears.n_planets // images}
    sizes.clear()
    with monkeypatch.context() as patch:
        patch.setattr(cycle, "planet_symmetry", lambda *_: 1)
        every = walk_mesh_cycle(gears, *given, **options)
    assert set(sizes) == {gears.n_planets}
    return one, every


def check_equal(one, every, rounding):
    """All arrays of two cycles agree to a share of their largest value."""
    for name in (field.name for field in fields(MeshCycle)):
        a, b = getattr(one, name), getattr(every, name)
        if name == "ripple_doubt":
            assert a == pytest.approx(b, rel=1e-6), name
        elif not isinstance(b, np.ndarray) or b.dtype.kind != "f":
            assert np.array_equal(a, b), name
        elif name != "residual":
            # cells at a corner are a thousandth of a window wide: they show the rounding of separations
            scale = 1e-9 if "pressure" in name else rounding
            size = np.abs(every.deflection if name == "member_motion" else b).max(initial=0.0)
            assert np.abs(a - b).max(initial=0.0) <= scale * size, name


# three, four (two pairs) and five planets in the same state, on springs or free
@pytest.mark.parametrize(
    "seed, images, supports",
    [(3, 3, SPRUNG), (6, 4, Supports(sun=0.0)), (7, 2, SPRUNG), (9, 5, Supports()), (4, 1, SPRUNG)],
)
def test_planets_in_the_same_state_are_solved_as_one(seed, images, supports, monkeypatch):
    gears, bodies, torque = random_bodies(seed)
    # a modification is the same on all planets, and so is a pin that is off its place
    same = replace(
        no_deviations(gears),
        sun=FlankForm((ProfileSlope(2e-6),)),
        pin_errors=np.full((gears.n_planets, 2), 3e-6),
    )
    for sign, errors in ((1.0, None), (-1.0, same)):
        kept = CycleOptions(held_bodies=bodies, pressures=True)
        given = dict(sun_torque=sign * torque, positions=6, deviations=errors, supports=supports, options=kept)
        check_equal(*both_routes(gears, images, monkeypatch, bodies, **given), 1e-11)


@pytest.mark.parametrize(
    "seed, images, supports, overlap",
    [
        pytest.param(3, 3, SPRUNG, None, marks=pytest.mark.slow),
        pytest.param(6, 4, Supports(sun=0.0), None, marks=pytest.mark.slow),
        pytest.param(7, 2, SPRUNG, None, marks=pytest.mark.slow),
        (3, 3, Supports(sun=0.0), 0.7),
        pytest.param(7, 2, SPRUNG, 1.2, marks=pytest.mark.slow),
    ],
)
def test_planets_in_the_same_state_are_solved_as_one_over_the_width(seed, images, supports, overlap, monkeypatch):
    """With leads, errors that all planets have alike, tangents of other bodies; spur and helical teeth."""
    (gears, bodies, torque), slices = random_bodies(seed), 7
    N, width, material = gears.n_planets, bodies.widths[0], material_of(random_set(seed).case, "sun")
    sectors = make_sectors(gears, material, flank_elements=6, refine=0.5)
    soft = replace(material, youngs_modulus=0.8 * material.youngs_modulus)
    waves, softer_waves = (width_waves(sectors, one, slices) for one in (material, soft))
    size = torque / (gears.sun.base_radius * N * 10e9 * width)
    errors = replace(
        no_deviations(gears),
        sun=FlankForm((LeadSlope(size),)),
        planet_sun_side=FlankForm((LeadCrowning(0.5 * size), FlankTwist(0.4 * size))),
        pin_errors=np.full((N, 2), 0.3 * size),
        planet_misalignment=np.full((N, 2), 0.3 * size / width),
    )
    softer = bodies.with_gear(2, replace(bodies.ring, regular=1.2 * bodies.ring.regular))
    ahead = None if overlap is None else overlap * ((np.arange(slices) + 0.5) / slices - 0.5)
    for sign in (1.0, -1.0):
        kept = CycleOptions(
            waves=waves,
            slices=slices,
            ahead=ahead,
            held_bodies=softer,
            held_waves=softer_waves,
            pressures=True,
        )
        given = dict(sun_torque=sign * torque, positions=4, deviations=errors, supports=supports, options=kept)
        one, every = both_routes(gears, images, monkeypatch, bodies, **given)
        check_equal(one, every, 1e-9)
        assert one.held_compliance is not None and one.mesh_misalignment.any() and one.lead_offset.any()


@pytest.mark.parametrize(
    "changed",
    [
        {"pin_errors": [[0.0, 3e-6]] + [[0.0, 0.0]] * 2},
        {"sun_pitch": [3e-6] + [0.0] * 32},
        {"ring_runout": Runout(3e-6, 0.2)},
    ],
)
def test_planets_with_different_errors_or_errors_that_pass_them_are_solved_each(changed, monkeypatch):
    gears, bodies, torque = random_bodies(3)
    sizes, together = [], batch.solve_batch
    monkeypatch.setattr(
        batch, "solve_batch", lambda found, *other: sizes.append(found.approach) or together(found, *other)
    )
    errors = replace(no_deviations(gears), **changed)
    walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=2, deviations=errors)
    assert len(sizes[0]) == 2 * gears.n_planets == 6


def test_first_cells_and_springs_are_those_that_equal_forces_would_press():
    """2 kN on each of two planets: pairs within 10 um of the nearest share; a half presses 0.281 um."""
    # two windows in each of the meshes with the sun and the ring, and on the back flanks
    smallest = np.array([0.0, 9.0, 0.0, 9.0, 1.0, 12.0, 1.0, 12.0, *np.zeros(8)])[None, :, None]
    gap = 1e-6 * (smallest + np.array([0.6, 0.27, 0.0, 0.29, 0.5]))
    candidate = np.ones(gap.shape, bool)
    candidate[0, 0, 1] = False
    bodies = SimpleNamespace(widths=(0.02, 0.02), contact_moduli=np.full(2, STEEL.contact_modulus(STEEL)))
    found = SimpleNamespace(
        setup=SimpleNamespace(n_planets=2, meshes=4, kind=lambda mesh: mesh // 2 % 2),
        bodies=bodies,
        gap=gap,
        candidate=candidate,
    )
    # equal forces on all drive flanks push along both motions alike, over their arms
    found.approach = np.array([[-4.0, 0.0], [1.0, 0.0], [1.0, -1.0], [0.0, 0.5], *np.full((4, 2), 5.0)])
    arms = np.array([[1.0, 0.0], [0.7, 0.7], [0.9, 0.4], [0.0, 1.0], [-1.0, 0.0]])
    load, arm = np.array([0.0, 4000.0]), np.array([4.0, 1.0])
    sets: Any = SimpleNamespace(candidates=found, total_load=load, arms=arms, arm=arm)
    active, springs = batch._ActiveSets._first(sets)
    assert springs.tolist() == [[False, True, True, False, False]]
    # where a pair is too far away the other one carries alone; back flanks carry nothing
    alone, expected = [1, 2, 3, 4], [[2], [1, 2], [1, 2], [1, 2]]
    expected += [alone, [], alone, [], *([[]] * 8)]
    assert [np.flatnonzero(row).tolist() for row in active[0]] == expected
    # without load what touches
    sets.total_load = np.zeros(2)
    assert np.array_equal(batch._ActiveSets._first(sets)[0], gap == 0.0)


@pytest.mark.parametrize("supports", [Supports(), SPRUNG], ids=["fixed", "sprung"])
def test_problems_that_differ_in_their_separations_alone_share_what_bodies_yield(supports):
    """As views of one position, and with what rounding leaves: the loads of a batch of copies."""
    gears, bodies, torque = random_bodies(3)
    members = moving_members(gears, supports)
    setup = mesh_windows(gears, bodies, share=4e3, nearest=20e-6, positions=4)
    single, count = contact_candidates(setup, bodies, [1], members), 7
    names = "position", "pair", "candidate", "polynomials", "local"
    pins = np.random.default_rng(2).normal(scale=1e-6, size=(count, len(single.mesh)))[..., None]
    gap = np.where(single.candidate, single.gap + pins, 0.0)
    load = np.zeros(single.approach.shape[1])
    load[setup.driver] = torque / gears.sun.base_radius

    def of(repeated):
        arrays = {name: repeated(getattr(single, name), 0) for name in names}
        return replace(single, **arrays, gap=gap, images=repeated(single.images, 1))

    def view(values, axis):
        shape = [*values.shape]
        shape[axis] = count
        return np.broadcast_to(values, shape)

    copies = solve_batch(of(lambda values, axis: np.repeat(values, count, axis=axis)), load)
    for refined in (True, False):
        views = solve_batch(of(view), load, refined=refined)
        assert (views.active == copies.active).all() and views.residual.max() < 1e-13
        assert views.loads == pytest.approx(copies.loads, abs=1e-11 * copies.loads.max())
        assert views.motions == pytest.approx(copies.motions, rel=1e-11, abs=1e-17)
