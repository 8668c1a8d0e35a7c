"""K = F/X against the annulus with a rigid core, rubber bushes and beams."""

import numpy as np
import pytest

from femgear.errors import GeometryError, GridError
from femgear.fe.elasticity import Material, foundation, stiffness
from femgear.fe.shaft import (
    RoundSection,
    ShaftStep,
    shaft_flexibility,
    shaft_support_stiffness,
    timoshenko_flexibility,
)
from validation.mapped import mapped_grid, ring_mapping
from validation.reference.support_stiffness import (
    annulus_support_stiffness,
    centre_node_stiffness,
    cyclic_support_stiffness,
)
from validation.support_stiffness import annulus_sector

STEEL = Material(206e9, 0.3, 7850.0)
STATES = ("plane stress", "plane strain")


def test_closed_form_is_the_long_bush_when_incompressible():
    soft = Material(3e6, 0.4999999, 1000.0)
    inner, outer = 0.01, 0.02
    ratio = (outer**2 - inner**2) / (outer**2 + inner**2)
    bush = 4 * np.pi * soft.shear_modulus / (np.log(outer / inner) - ratio)
    ours = annulus_support_stiffness(inner, outer, soft, state="plane strain", thickness=1.0)
    assert ours == pytest.approx(bush, rel=1e-5)


@pytest.mark.parametrize("state", STATES)
def test_annulus_with_a_rigid_core(state):
    inner, outer, width = 0.04, 0.06, 0.01
    grid = mapped_grid(ring_mapping(inner, outer), 6, 40, closed=True)
    K = centre_node_stiffness(grid, stiffness(grid, STEEL, state=state, thickness=width), ("u=0",), ("u=1",))
    exact = annulus_support_stiffness(inner, outer, STEEL, state=state, thickness=width)
    np.testing.assert_allclose(np.diag(K)[:2], exact, rtol=1e-4)
    twist = 4 * np.pi * STEEL.shear_modulus * width / (1 / inner**2 - 1 / outer**2)
    assert K[2, 2] == pytest.approx(twist, rel=1e-4)
    assert np.abs(K - np.diag(np.diag(K))).max() < 1e-9 * exact


@pytest.mark.parametrize("held", [("rim",), ()])
def test_one_sector_as_the_whole_body(held):
    count, inner, outer = 9, 0.04, 0.06
    sector = annulus_sector(inner, outer, count, across=4, along=4)
    whole = mapped_grid(ring_mapping(inner, outer), 4, 4 * count, closed=True)
    springs = (1e11, 3e10)
    results = []
    for grid, rim in ((sector, "rim"), (whole, "u=1")):
        K = stiffness(grid, STEEL, thickness=1.0)
        results.append(K if held else K + foundation(grid, rim, *springs, thickness=1.0))
    one = cyclic_support_stiffness(sector, results[0], count, ("bore",), held)
    other = centre_node_stiffness(whole, results[1], ("u=0",), ("u=1",) if held else ())[0, 0]
    assert one == pytest.approx(other, rel=1e-9)


def test_bodies_that_nothing_holds_and_wrong_boundaries_are_refused():
    sector = annulus_sector(0.04, 0.06, 9, across=2, along=2)
    K = stiffness(sector, STEEL, thickness=1.0)
    with pytest.raises(GridError) as error:
        cyclic_support_stiffness(sector, K, 9, ("bore",))
    assert error.value.code == "E-GRID-FREE"
    with pytest.raises(GridError) as error:
        centre_node_stiffness(sector, K, ("bore",))
    assert error.value.code == "E-GRID-FREE"
    with pytest.raises(GridError) as error:
        cyclic_support_stiffness(sector, K, 9, ("bore",), ("bore",))
    assert error.value.code == "E-GRID"
    with pytest.raises(GeometryError):
        annulus_support_stiffness(0.06, 0.04, STEEL, state=STATES[0], thickness=1.0)


def test_pure_bending_without_poissons_ratio_is_the_beam():
    material = Material(206e9, 0.0, 7850.0)
    steps = (ShaftStep(0.06, 0.02, 0.008),)
    ours, beam = shaft_flexibility(steps, material, refine=0.5), timoshenko_flexibility(steps, material)
    # plane sections stay plane: tilt and deflection under a moment are exact
    np.testing.assert_allclose(ours[:, 1], beam[:, 1], rtol=1e-7)
    assert ours[0, 0] == pytest.approx(beam[0, 0], rel=2e-3)


def test_slender_steel_shaft():
    steps = (ShaftStep(0.15, 0.02),)
    beam = 1 / timoshenko_flexibility(steps, STEEL)[0, 0]
    assert shaft_support_stiffness(steps, STEEL, refine=0.5) == pytest.approx(beam, rel=0.012)


def test_beam_of_two_parts_against_integration():
    steps = (ShaftStep(0.05, 0.03), ShaftStep(0.08, 0.02, 0.01))
    found = timoshenko_flexibility(steps, STEEL)
    z, weight = np.polynomial.legendre.leggauss(8)
    total, start = np.zeros((2, 2)), 0.0
    for step in steps:
        arm = 0.13 - (start + 0.5 * step.length * (1 + z))
        w = 0.5 * step.length * weight
        bending = 206e9 * np.pi / 64 * (step.outer_diameter**4 - step.inner_diameter**4)
        moments = np.stack([arm, np.ones_like(arm)])
        total += (moments * w) @ moments.T / bending
        section = RoundSection(step.outer_diameter, step.inner_diameter, poisson=0.3)
        shear = STEEL.shear_modulus * section.shear_coefficient * section.area
        total[0, 0] += step.length / shear
        start += step.length
    np.testing.assert_allclose(found, total, rtol=1e-12)


@pytest.mark.parametrize("numbers", [(0.0, 0.02, 0.0), (0.1, 0.02, 0.02), (0.1, 0.02, -1.0), (np.nan, 0.02, 0)])
def test_impossible_parts_are_refused(numbers):
    with pytest.raises(GeometryError) as error:
        ShaftStep(*numbers)
    assert error.value.code == "E-SHAFT"


def test_parts_that_do_not_touch_are_refused():
    with pytest.raises(GeometryError):
        shaft_flexibility((ShaftStep(0.1, 0.02), ShaftStep(0.1, 0.05, 0.03)), STEEL)
    with pytest.raises(GeometryError):
        shaft_flexibility((), STEEL)
