"""Points within and lines along curved six-node triangles, against closed forms of the same parabolas."""

import numpy as np
import pytest

from femgear.errors import GridError
from femgear.fe.compliance import interpolation
from femgear.fe.elasticity import Material, plane_modulus, tangential_stress
from femgear.fe.grid import Grid

STEEL = Material(206e9, 0.3, 7850.0)
CORNERS = np.array([[0.1, -0.2], [1.1, 0.3], [0.4, 0.9]])


def triangle(*bulges):
    """One element; a bulge displaces the middle of an edge outwards, as a share of the edge."""
    middles = []
    for k, bulge in enumerate(bulges):
        edge = CORNERS[(k + 1) % 3] - CORNERS[k]
        middles.append(CORNERS[k] + 0.5 * edge + bulge * np.array([edge[1], -edge[0]]))
    return Grid(np.vstack([CORNERS, middles]), np.arange(6)[None])


def shapes(b1, b2):
    """Shape functions (6, m) by barycentric coordinates: L (2 L - 1) of corners, 4 L L' between them."""
    L = np.array([1 - b1 - b2, b1, b2])
    return np.vstack([L * (2 * L - 1), 4 * L * L[[1, 2, 0]]])


def test_points_are_found_in_a_curved_element():
    grid = triangle(0.1, 0.12, 0.08)
    b1, b2 = np.random.default_rng(3).dirichlet([2.0, 2.0, 2.0], 40)[:, :2].T
    expected = shapes(b1, b2).T
    points = expected @ grid.points
    inside = np.linalg.solve(np.vstack([CORNERS.T, np.ones(3)]), np.vstack([points.T, np.ones(40)])).min(axis=0)
    assert np.count_nonzero(inside > 0) > 25
    rows = interpolation(grid, points[inside > 0]).toarray()
    assert np.abs(rows - expected[inside > 0]).max() < 1e-11


def test_nodes_of_a_straight_element_lie_within_it():
    grid = triangle(0.0, 0.0, 0.0)
    assert interpolation(grid, grid.points).toarray() == pytest.approx(np.eye(6), abs=1e-12)


@pytest.mark.parametrize("edge", range(3))
def test_a_point_cut_off_by_a_hollow_edge_is_refused(edge):
    """Within the three corners, but beyond the curved edge."""
    bulges = np.zeros(3)
    bulges[edge] = -0.2
    middle = 0.5 * (CORNERS[edge] + CORNERS[(edge + 1) % 3])
    point = 0.95 * middle + 0.05 * CORNERS.mean(axis=0)
    with pytest.raises(GridError, match="between curved elements"):
        interpolation(triangle(*bulges), point[None])


def parabola(edges):
    """Elements above ``y = x^2 / 2``, 0 <= x <= 1, whose edges are the parabola itself."""
    x = np.linspace(0.0, 1.0, 2 * edges + 1)
    below = np.column_stack([x, 0.5 * x**2])
    ends, peaks = below[::2], np.array([0.5, 3.0]) + 0.5 * below[1::2]
    points = np.vstack([below, peaks, 0.5 * (ends[1:] + peaks), 0.5 * (ends[:-1] + peaks)])
    k, first = np.arange(edges), 2 * edges + 1
    line = np.column_stack([2 * k, 2 * k + 2, 2 * k + 1])
    elements = np.column_stack([2 * k, 2 * k + 2, first + k, 2 * k + 1, first + edges + k, first + 2 * edges + k])
    return Grid(points, elements, {"edge": line})


def arc(x):
    return 0.5 * (x * np.sqrt(1 + x**2) + np.arcsinh(x))


def test_stress_along_a_parabola():
    """``u = (x^2/2, 0)`` strains it by ``x / (1 + x^2)``: exact where it is taken, a cubic in between."""
    edges = 5
    grid = parabola(edges)
    along = tangential_stress(grid, STEEL, "edge", state="plane strain")
    x = np.linspace(0.0, 1.0, edges + 1)
    assert along.points[:, 0] == pytest.approx(x, abs=1e-15)
    assert along.arc == pytest.approx(arc(x), rel=1e-9, abs=1e-15)
    slope = np.column_stack([np.ones_like(x), x]) / np.sqrt(1 + x**2)[:, None]
    assert along.tangents == pytest.approx(slope, abs=1e-12)
    u = np.column_stack([0.5 * grid.points[:, 0] ** 2, np.zeros(len(grid.points))]).ravel()
    gauss = (0.5 * (x[1:] + x[:-1])[:, None] + np.array([-1, 1]) * 0.5 / (edges * np.sqrt(3))).ravel()
    expected = []
    for place in x:
        first = np.clip(np.searchsorted(gauss, place) - 2, 0, len(gauss) - 4)
        near = gauss[first : first + 4]
        cubic = np.polynomial.Polynomial.fit(arc(near), near / (1 + near**2), 3)
        expected.append(cubic(arc(place)))
    strain = along.columns.T @ u / plane_modulus(STEEL, "plane strain")
    assert strain == pytest.approx(np.array(expected), abs=1e-9)
    assert strain == pytest.approx(x / (1 + x**2), abs=2e-3)
