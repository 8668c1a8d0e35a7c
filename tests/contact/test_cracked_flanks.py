"""Cracked teeth in the contact problem: openings and closings, mirror images, and all conditions at once."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.assembly import contact_candidates
from femgear.contact.batch import solve_with_cracks
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cracked_flanks import cracked_flanks
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.solve import solve_contact
from femgear.contact.windows import first_windows, mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.faults import LEFT, RIGHT, Crack
from validation import faults
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
CRACK = Crack(0, 0, 3, LEFT, None, math.radians(70.0), 1.5e-3)
TORQUE, PER_PERIOD, ELEMENTS = 100.0, 4, 6


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    sectors = make_sectors(gears, STEEL, flank_elements=ELEMENTS)
    crack = cracked_flanks(sectors.sun, STEEL, CRACK, flank_elements=ELEMENTS)
    healthy = make_bodies(sectors, STEEL)
    return healthy.with_gear(0, replace(healthy.sun, cracks=(crack,)))


def walk(gears, bodies, fault=None, torque=TORQUE, periods=27):
    deviations = None if fault is None else replace(no_deviations(gears), faults=(fault,))
    options = {"sun_torque": torque, "positions": PER_PERIOD, "deviations": deviations, "periods": periods}
    return walk_mesh_cycle(gears, bodies, **options)


@pytest.fixture(scope="module")
def whole(gears, bodies):
    return walk(gears, bodies, periods=1)


@pytest.fixture(scope="module")
def opened(gears, bodies):
    return walk(gears, bodies, CRACK)


def test_a_grid_that_parts_nowhere_changes_not_one_bit():
    """Compliance of all flanks, and loads, gaps and motions of the contact, beside those of the healthy gear."""
    assert [row.ours for row in faults.no_crack_of(0)] == [0.0, 0]


def test_a_cracked_tooth_softens_its_mesh_where_it_carries_and_no_other(opened, whole):
    change = opened.stiffness[0].reshape(27, -1) / whole.stiffness[0] - 1.0
    carries = opened.tooth_load[0].reshape(-1, 27, PER_PERIOD) > 0.0
    first = opened.tooth[0, 0, :, None] - np.arange(27)
    mine = (carries & ((first - 3) % 27 == 0)[..., None]).any(axis=0)
    assert change[mine].min() < -0.1
    assert np.abs(change[~mine.any(axis=1)]).max() < 0.01


def test_load_on_the_other_flank_shuts_the_crack(gears, bodies, opened, whole):
    """A tenth of the change that an open crack makes is left, from faces that slide."""
    shut = walk(gears, bodies, replace(CRACK, flank=RIGHT))
    most = np.abs(opened.sun_arc.reshape(27, -1) - whole.sun_arc).max()
    least = np.abs(shut.sun_arc.reshape(27, -1) - whole.sun_arc).max()
    assert 0.0 < least < 0.2 * most


def test_the_other_torque_opens_the_crack_on_the_other_flank(gears, bodies, opened):
    turned = walk(gears, bodies, replace(CRACK, flank=RIGHT), torque=-TORQUE)
    assert np.sort(turned.sun_arc) == pytest.approx(np.sort(opened.sun_arc), rel=1e-9)


def test_positions_of_several_mesh_periods_know_nothing_of_one_another(gears, bodies):
    """Compliance that positions share, and starts from gears without the crack, change none of them."""
    share, nearest = first_windows(gears, bodies, TORQUE)
    deviations = replace(no_deviations(gears), faults=(CRACK,))
    options = {"positions": np.arange(0, 27, 0.5), "deviations": deviations}
    setup = mesh_windows(gears, bodies, share=share, nearest=nearest, **options)
    several = contact_candidates(setup, bodies, np.arange(54))
    load = np.zeros(several.approach.shape[1])
    load[setup.driver] = TORQUE / gears.sun.base_radius
    closed, together = solve_with_cracks(several, load)
    assert np.array_equal(closed.images, closed.at(np.arange(54)).images)
    for at in (0, 3, 20, 21):
        alone = contact_candidates(setup, bodies, [at])
        settled, state = solve_with_cracks(alone, load)
        assert np.array_equal(settled.cracks[0].closed[0], closed.cracks[0].closed[at])
        assert state.motions[0] == pytest.approx(together.motions[at], rel=1e-9)


@pytest.mark.parametrize("flank", [LEFT, RIGHT])
def test_flanks_and_faces_are_one_complementarity_problem(gears, bodies, flank):
    """The solution of all candidates together, those of the faces behind those of the flanks."""
    deviations = replace(no_deviations(gears), faults=(replace(CRACK, flank=flank),))
    share, nearest = first_windows(gears, bodies, TORQUE)
    setup = mesh_windows(
        gears, bodies, share=share, nearest=nearest, positions=np.arange(0, 27, 0.5), deviations=deviations
    )
    open_candidates = contact_candidates(setup, bodies, np.arange(54))
    load = np.zeros(open_candidates.approach.shape[1])
    load[setup.driver] = TORQUE / gears.sun.base_radius
    candidates, state = solve_with_cracks(open_candidates, load)
    (crack,), ring = candidates.cracks, bodies.sun.cracks[0].ring
    assert crack.closed.any() and not crack.closed.all(axis=1).all()
    coordinates = np.zeros((len(crack.closed), len(candidates.mesh), *crack.coordinates.shape[2:]))
    coordinates[:, crack.windows] = crack.coordinates
    for at in (int(crack.closed.sum(axis=1).argmax()), int((~crack.closed).sum(axis=1).argmax())):
        problem = open_candidates.problem(at)
        window, cell = np.nonzero(open_candidates.candidate[at])
        values = open_candidates.polynomials[at, window, cell]
        across = ring.crossing @ np.einsum("cn,cnr->cr", values, coordinates[at, window]).T
        H = np.block([[problem.compliance, across.T], [across, ring.faces]])
        faces = len(ring.faces)
        together = solve_contact(
            H, np.append(problem.gap, np.zeros(faces)), np.vstack([problem.G, np.zeros((faces, len(load)))]), load
        )
        loads = state.loads[at][open_candidates.candidate[at]]
        assert together.loads[: len(loads)] == pytest.approx(loads, abs=1e-6 * loads.max())
        assert np.array_equal(together.loads[len(loads) :] > 1e-9 * loads.max(), crack.closed[at])
