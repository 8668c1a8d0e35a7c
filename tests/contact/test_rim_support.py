"""The ring of the reference set between its teeth and its support."""

import numpy as np
import pytest

from femgear.contact.bodies import RING_STATE, Sector
from femgear.errors import GridError
from femgear.fe.elasticity import Material, foundation, stiffness
from femgear.fe.grid import mirror
from femgear.fe.meshing import mesh_outline
from femgear.gears.tooth import half_sector
from validation.planetary import reference_set
from validation.reference.rim_support import rim_support_stiffness
from validation.reference.support_stiffness import annulus_support_stiffness

STEEL = Material(206e9, 0.3, 7850.0)


@pytest.fixture(scope="module")
def ring():
    gear = reference_set().ring
    grid = mirror(mesh_outline(half_sector(gear, flank_elements=6, refine=0.5)))
    return Sector(gear, grid, stiffness(grid, STEEL, state=RING_STATE, thickness=gear.face_width))


def test_held_ring_is_softer_than_an_annulus_with_a_rigid_core(ring):
    gear = ring.gear
    annulus = annulus_support_stiffness(
        gear.root_radius, gear.rim_radius, STEEL, state="plane stress", thickness=gear.face_width
    )
    # an upper bound: there all of the teeth are rigid, here only their surfaces
    assert 0.9 * annulus < rim_support_stiffness(ring) < annulus


def test_ring_on_a_soft_foundation_moves_as_a_rigid_body(ring):
    gear, radial, tangential = ring.gear, 1e8, 3e7
    springs = foundation(ring.grid, "rim", radial, tangential, thickness=gear.face_width)
    rigid = np.pi * gear.rim_radius * gear.face_width * (radial + tangential)
    assert rim_support_stiffness(ring, foundation=springs) == pytest.approx(rigid, rel=1e-4)


def test_foundation_and_rim_act_in_series(ring):
    gear = ring.gear
    springs = foundation(ring.grid, "rim", 1e10, 1e10, thickness=gear.face_width)
    both = rim_support_stiffness(ring, foundation=springs)
    rigid = np.pi * gear.rim_radius * gear.face_width * 2e10
    # equal moduli press a rim that moves as one: the series of both is exact for no other field
    series = 1 / (1 / rigid + 1 / rim_support_stiffness(ring))
    assert both == pytest.approx(series, rel=1e-3)
    assert both < rigid


def test_ring_without_support_is_refused(ring):
    nothing = foundation(ring.grid, "rim", 0.0, 0.0, thickness=1.0)
    with pytest.raises(GridError) as error:
        rim_support_stiffness(ring, foundation=nothing)
    assert error.value.code == "E-GRID-FREE"
