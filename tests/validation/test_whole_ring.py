"""The toothed ring meshed as a whole: its grid, its rigid motions, and that another outline is seen."""

import math
from dataclasses import replace

import numpy as np
import pytest

from validation.cases import reference_material, reference_static
from validation.ring import _sector_modes
from validation.whole_ring import free_modes, whole_grid

PLANE = {"tooth": "plane stress", "body": "plane stress"}
DIAMETERS = (2, 3, 4, 0, 5)


@pytest.fixture(scope="module")
def static():
    return reference_static()


@pytest.fixture(scope="module")
def grid(static):
    return whole_grid(static.planetary_set.ring)


def area(grid):
    """Area of quadratic triangles by their mid-side quadrature, exact for their curved edges [m^2]."""
    # Jacobian of (x, y)(s, t) at the three mid points of the reference triangle
    total = 0.0
    p = grid.points[grid.triangles]
    for s, t in ((0.5, 0.0), (0.5, 0.5), (0.0, 0.5)):
        r = 1.0 - s - t
        by_s = np.array([1 - 4 * r, 4 * s - 1, 0.0, 4 * (r - s), 4 * t, -4 * t])
        by_t = np.array([1 - 4 * r, 0.0, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)])
        a, b = np.einsum("i,kij->kj", by_s, p), np.einsum("i,kij->kj", by_t, p)
        total += (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 6.0
    return total


def test_grid_has_the_area_of_all_sectors(static, grid):
    sector = static.sectors.ring
    assert area(grid) == pytest.approx(sector.gear.teeth * area(sector.grid), rel=1e-5)
    radius = np.hypot(*grid.points[np.unique(grid.boundaries["rim"])].T)
    assert radius == pytest.approx(sector.gear.rim_radius, rel=1e-12)
    assert len(grid.regions) == sector.gear.teeth + 2


@pytest.mark.slow
def test_whole_ring_and_sector_agree_and_see_another_fillet(static, grid):
    gear = static.planetary_set.ring
    found, number = free_modes(grid, reference_material(), PLANE, count=14)
    assert list(number) == [2, 2, 3, 3, 4, 4, 0, 5, 5, 1, 1]
    whole = np.array([found[number == n].mean() for n in DIAMETERS])
    np.testing.assert_allclose(_sector_modes(gear, DIAMETERS, PLANE), whole, rtol=2e-4)
    sharp = replace(gear, rack=replace(gear.rack, root_radius=0.1))
    away = np.abs(_sector_modes(sharp, DIAMETERS, PLANE) / whole - 1.0)
    assert away.min() > 4e-4
    assert found.min() > 1000.0 and math.isfinite(found.max())
