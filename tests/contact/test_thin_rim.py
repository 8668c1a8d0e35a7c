"""Thin rims: the compliance of one sector against whole gears, equilibrium of the foundation, sharing."""

import math

import numpy as np
import pytest

from femgear.contact.flank_pairs import LEFT
from femgear.fe.grid import ordered_nodes
from validation import rims
from validation.cases import reference_case
from validation.whole_gear import Held, by_sector, loads_of

# of the whole gears in cubic elements; the rows of validation and the slow test take finer ones
SIZES = {"flank_elements": 8, "refine": 0.35}


@pytest.fixture(scope="module")
def thin():
    return rims.static_with(thin=True)


@pytest.mark.slow
def test_the_rim_is_one_module_thick(thin):
    ring = thin.planetary_set.ring
    assert ring.rim_radius - ring.root_radius == pytest.approx(ring.module, rel=1e-6)
    # it bends: under the mesh forces it moves by more than half of what its foundation lets it turn
    assert rims.ring_comparison(**SIZES).largest > 50e-6


@pytest.mark.slow
def test_sector_and_108_sectors_in_one_solution_agree():
    assert rims.ring_comparison(**SIZES).same_grid < 1e-9
    assert rims.planet_comparison(**SIZES).same_grid < 1e-9


@pytest.mark.slow
def test_displacement_all_around_against_cubic_elements_on_another_grid():
    """0.6 % with these coarse cubic elements, 0.2 % and 0.07 % with finer ones (see the slow test)."""
    found = rims.ring_comparison(**SIZES)
    assert max(found.field, found.rim) < 0.01


@pytest.mark.slow
def test_flanks_at_the_meshes_against_cubic_elements():
    """The compliance of the contact solution, half plane included, along all loaded flanks."""
    assert rims.ring_comparison(**SIZES).flanks < 0.01


@pytest.mark.slow
def test_sun_side_load_moves_the_ring_side_flanks_of_the_planet():
    found = rims.planet_comparison(**SIZES)
    assert found.flanks < 0.01
    assert 1e-4 < found.opposite / found.largest < 1e-2


@pytest.mark.slow
def test_the_difference_falls_with_a_finer_reference():
    for compare in (rims.ring_comparison, rims.planet_comparison):
        coarse, fine = compare(), compare(flank_elements=12, refine=0.7)
        assert fine.field < 0.5 * coarse.field
        assert fine.flanks < 0.5 * coarse.flanks


def test_the_foundation_carries_the_torque_of_the_ring(thin):
    """Statics: the mean tangential displacement of the rim is T / (2 pi R^2 b k_t)."""
    s, sector, section = thin.planetary_set, thin.sectors.ring, reference_case().ring
    acting = [(s.n_planets + n, 1, LEFT) for n in range(s.n_planets)]
    loads = loads_of(s, thin.cycle, rims.POSITION, acting)
    torque = loads.force.sum() * s.ring.base_radius
    assert torque == pytest.approx(thin.sun_torque * 108 / 27, rel=1e-9)
    held = Held(section.foundation_radial, section.foundation_tangential)
    field = by_sector(sector, loads, held)
    nodes = ordered_nodes(sector.grid, "rim")
    angle = np.arctan2(*sector.grid.points[nodes].T[::-1]) + s.ring.pitch_angle * np.arange(108)[:, None]
    tangential = field[:, nodes, 1] * np.cos(angle) - field[:, nodes, 0] * np.sin(angle)
    mean = np.trapezoid(tangential, angle, axis=1).sum() / (2 * math.pi)
    expected = torque / (2 * math.pi * s.ring.rim_radius**2 * 0.025 * section.foundation_tangential)
    # forces of a planet's mesh push the ring forwards, which is clockwise in its own frame
    assert mean == pytest.approx(-expected, rel=1e-3)


def test_a_thin_rim_evens_out_the_sharing(thin):
    thick = rims.static_with(thin=False)
    uneven = [np.abs(one.cycle.load_share - 1 / 3).max() for one in (thin, thick)]
    assert 0.005 < uneven[0] < 0.95 * uneven[1]
    # the ring yields more, the meshes of sun and planets as before
    ratio = thin.cycle.stiffness.mean(axis=1) / thick.cycle.stiffness.mean(axis=1)
    assert ratio[:3] == pytest.approx(1.0, abs=2e-3)
    assert (ratio[3:] < 0.5).all()
