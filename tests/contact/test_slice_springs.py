"""Slices of many sets as springs at once: against slices of one set, solved by an active set."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set
from contact.test_misalignment import set_of

from femgear.contact.assembly import contact_candidates
from femgear.contact.batch import solve_batch
from femgear.contact.face_width import curve_forces
from femgear.contact.pair_laws import pair_laws
from femgear.contact.slice_springs import SliceSprings, solve_slice_springs
from femgear.contact.slices import solve_slices
from femgear.contact.supports import RIGID, WidthSupports, moving_members, tilting_members
from femgear.contact.windows import first_windows, mesh_windows
from femgear.gears.deviations import lead_separation, no_deviations

SLICES, SETS = 9, 6


@pytest.fixture(scope="module")
def parts():
    """Windows and curves of the reference set at four positions, and what bodies yield to waves."""
    gears, bodies, waves = set_of(STEEL)
    share, nearest = first_windows(gears, bodies, TORQUE)
    setup = mesh_windows(gears, bodies, share=16 * share, nearest=nearest, positions=4)
    found = contact_candidates(setup, bodies, np.arange(4), moving_members(gears, RIGID))
    load = np.zeros(gears.n_planets + 1)
    load[-1] = TORQUE / gears.sun.base_radius
    laws = pair_laws(found, solve_batch(found, load), curve_forces(load[-1], gears.n_planets, load[-1]))
    return found, laws, waves, load


def leads(seed, sets=SETS):
    """Leads of axes askew (2N, S, n), and pins that are off (2N, n) [m]: planet 2 of the last one by far."""
    gears, rng = reference_set(), np.random.default_rng(seed)
    drawn = [
        replace(
            no_deviations(gears),
            sun_misalignment=2e-4 * rng.normal(size=2),
            planet_misalignment=1e-4 * rng.normal(size=(3, 2)),
        )
        for _ in range(sets)
    ]
    pins = 2e-6 * rng.normal(size=(6, sets))
    pins[[1, 4], -1] = 40e-6
    return np.stack([lead_separation(d, gears, SLICES) for d in drawn], axis=-1), pins


YIELDING = WidthSupports(sun=5e4, planet=2e4, wind_up=3e5, sun_rigidity=4e3)


@pytest.mark.parametrize("supports", [None, YIELDING], ids=["upright", "yielding"])
def test_many_sets_at_once_are_those_that_slices_give_one_by_one(parts, supports):
    found, laws, waves, load = parts
    tilting = None if supports is None else tilting_members(reference_set(), supports, SLICES)
    lead, pins = leads(1)
    springs = SliceSprings(found, laws, waves, SLICES, tilting)
    separations = np.broadcast_to(pins[found.mesh], (4, len(found.mesh), SETS))
    state = solve_slice_springs(springs, load, separations, lead[found.mesh][None])
    assert state.solved.all()
    meshes = (found.mesh[:, None] == np.arange(6)).astype(float)
    for number in range(SETS):
        apart = lead[found.mesh, :, number].T + pins[found.mesh, number]
        apart = np.broadcast_to(apart, (4, *apart.shape))
        alone = solve_slices(found, laws, load, waves, apart, None, tilting)
        forces = state.force[..., number] @ meshes
        assert forces == pytest.approx(alone.of_meshes().mean(axis=1), abs=2e-3 * load[-1])
        arc = alone.motions[:, 3]
        assert state.motions[:, 3, number] == pytest.approx(arc, abs=2e-3 * np.ptp(arc) + 1e-9)
        largest = alone.force.max(axis=1)
        assert state.largest[..., number] == pytest.approx(largest, abs=1e-2 * largest.max())


def test_a_planet_that_carries_nothing_stays_open(parts):
    found, laws, waves, load = parts
    lead, pins = leads(2)
    springs = SliceSprings(found, laws, waves, SLICES)
    separations = np.broadcast_to(pins[found.mesh], (4, len(found.mesh), SETS))
    state = solve_slice_springs(springs, load, separations, lead[found.mesh][None])
    of_last = state.force[..., -1]
    assert not of_last[:, np.isin(found.mesh, [1, 4])].any() and (state.stiffness[:, [1, 4], -1] == 0.0).all()
    assert of_last.sum(axis=1) == pytest.approx(2 * load[-1], rel=2e-3)


def test_a_set_comes_out_the_same_beside_any_others(parts):
    found, laws, waves, load = parts
    lead, pins = leads(3)
    springs = SliceSprings(found, laws, waves, SLICES)
    separations = np.broadcast_to(pins[found.mesh], (4, len(found.mesh), SETS))
    together = solve_slice_springs(springs, load, separations, lead[found.mesh][None])
    alone = solve_slice_springs(springs, load, separations[..., :1], lead[found.mesh][None, ..., :1])
    assert alone.motions[:, 3, 0] == pytest.approx(together.motions[:, 3, 0], rel=1e-9)
