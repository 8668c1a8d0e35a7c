"""Tip corners: the wedge beside the half plane, cells at the ends of flanks, and a resolved contact."""

import math

import numpy as np
import pytest

from femgear.contact.bodies import station_weights
from femgear.contact.local_compliance import TipCorner, _excess, apex_excess, surface_displacement, tip_corner
from femgear.contact.windows import cell_centres, cell_edges, equal_cells
from femgear.fe.compliance import symmetric_factor
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import mirror, ordered_nodes
from femgear.fe.meshing import mesh_outline
from femgear.gears.tooth import half_sector
from validation.planetary import reference_set
from validation.reference.graded_teeth import graded_sector
from validation.reference.held_sector import held_sector_compliance
from validation.torque_rotation import (
    PLANET_RING,
    corner_bodies,
    corner_by_rotation,
    corner_differences,
    corner_set,
    mesh_alone,
)

STEEL = Material(206e9, 0.3, 7850.0)
SET = reference_set()
# the ring's tip corner begins, carries more, and is left alone by the planet's; the planet's alone
CORNERS = (54, 55, 56, 58, 61, 62)


@pytest.fixture(scope="module")
def bodies():
    return corner_bodies()


def contact(bodies, **options):
    s = corner_set()
    return mesh_alone(s.gears, bodies, s.force, PLANET_RING, CORNERS, **options)


def test_apex_of_a_half_plane_and_of_a_quarter_plane():
    assert apex_excess(math.pi) == pytest.approx(0.0, abs=1e-14)
    # half of the force along the bisector and half across it: pi (1 / (pi + 2) + 1 / (pi - 2)) - 1
    exact = math.pi * (1 / (math.pi + 2) + 1 / (math.pi - 2)) - 1
    assert apex_excess(0.5 * math.pi) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize("degrees", [95, 108, 120, 150])
def test_wedge_is_reciprocal_and_logarithmic_at_the_apex(degrees):
    angle, nu, t = math.radians(degrees), 0.3, np.linspace(0.5, 9.0, 18)
    one, other = (_excess(angle, np.exp(s * t), 0.0 * t, nu) for s in (1, -1))
    # the apex, at rest, moves against infinity by the logarithm of the load's distance
    logarithm = (1 - nu) / math.pi * apex_excess(angle)
    np.testing.assert_allclose(one + logarithm * t, other, atol=1e-9)


def test_wedge_turns_about_its_apex():
    """Near the apex, at rest, nothing is left but a rotation: a displacement that grows with the distance."""
    t = np.array([9.0, 12.0, 15.0, 18.0])
    for degrees in (95, 120, 150):
        found = _excess(math.radians(degrees), np.exp(-t), 0.0 * t, 0.3) * np.exp(t)
        assert found == pytest.approx(found[1], rel=0.1)


@pytest.mark.parametrize("gear", [SET.sun, SET.planet, SET.ring])
def test_surface_of_the_wedge_in_closed_form(gear):
    corner = tip_corner(gear, STEEL)
    y = np.geomspace(1e-6, 1e-2, 41)
    exact = corner.depth(1e-4, 0.0, y)
    half_plane = (1 - corner.poisson_ratio) / (math.pi * corner.shear_modulus)
    assert np.abs(corner.surface(1e-4, y) - exact).max() < 6e-3 * half_plane
    assert corner.surface(1e-4, 1e-4) == pytest.approx(float(corner.depth(1e-4, 0.0, np.array(1e-4))), rel=1e-9)


def test_no_wedge_no_excess():
    flat = TipCorner(0.0, math.pi, 80e9, 0.3, 0.0, 0.0)
    assert np.abs(flat.depth(np.array([0.0, 1e-3]), 1e-4, 1e-4)).max() < 1e-20


def test_cells_of_windows():
    edges, centres, shares = cell_edges(36), cell_centres(36), equal_cells(36)
    np.testing.assert_allclose(edges[:, [0, -1]], np.tile([0.0, 1.0], (4, 1)), atol=1e-15)
    assert (np.diff(edges) > 0).all()
    np.testing.assert_allclose(edges[1], 1.0 - edges[2, ::-1], atol=1e-15)
    np.testing.assert_allclose(edges[[0, 3]], 1.0 - edges[[0, 3], ::-1], atol=1e-15)
    assert edges[1, 1] == pytest.approx(36.0**-2) and np.diff(edges).max() < 2.0 / 36
    # equal cells carry what the cells of a window carry, at the same place
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-13)
    np.testing.assert_allclose(shares[0], np.eye(36), atol=1e-13)
    np.testing.assert_allclose(np.einsum("e,lec->lc", centres[0], shares), centres, atol=0.5 / 36)


def resolved_compliance(gear, x):
    """Displacement between patches at distances `x` from the tip, half plane taken out, by small elements."""
    size, side = 0.025 * x[0], "right" if gear.internal else "left"
    tip, way = gear.tip_roll**2 / (2 * gear.base_radius), 1.0 if gear.internal else -1.0
    roll = math.sqrt(2 * gear.base_radius * (tip + way * x[0]))
    outline = graded_sector(gear, side, roll, 16 * 12 * size, edges=12, refine=1.2, corner=gear.tip_roll)
    grid = mesh_outline(outline)
    nodes = ordered_nodes(grid, "contact")
    points = grid.points[nodes]
    radius = np.hypot(*points.T)
    arc = (radius**2 - gear.base_radius**2) / (2 * gear.base_radius)
    slope = np.gradient(points, axis=0) / np.hypot(*np.gradient(points, axis=0).T)[:, None]
    inward = np.column_stack([-slope[:, 1], slope[:, 0]])
    place, weight = np.polynomial.legendre.leggauss(40)
    q = tip + way * x[:, None] * (1 + 0.1 * place)
    # consistent loads of uniform patches of a tenth of their distance either side
    loads = np.zeros((2 * grid.n_nodes, len(x)))
    corner = way * (arc[0::2] - tip)
    order = 1 if corner[-1] > corner[0] else -1
    for j in range(len(x)):
        away = way * (q[j] - tip)
        edge = np.searchsorted(corner[::order], away) - 1
        edge = edge if order > 0 else len(corner) - 2 - edge
        ends = corner[edge], corner[edge + 1]
        t = (away - ends[0]) / (ends[1] - ends[0])
        shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
        for i in range(3):
            for c in range(2):
                at = 2 * edge + i
                np.add.at(loads[:, j], 2 * nodes[at] + c, 0.5 * weight * shape[i] * inward[at, c])
    held = np.concatenate([np.ravel(grid.boundaries[name]) for name in ("rim", "cut_left", "cut_right")])
    free = np.setdiff1d(np.arange(2 * grid.n_nodes), np.concatenate([2 * held, 2 * held + 1]))
    K = stiffness(grid, STEEL, thickness=1.0).tocsr()[free][:, free]
    compliance = loads[free].T @ symmetric_factor(K).solve(loads[free])
    distance = q[:, :, None] - (tip + way * x)
    local = surface_displacement(distance, 0.1 * x, STEEL.shear_modulus, STEEL.poisson_ratio)
    return compliance - np.einsum("q,iqj->ij", 0.5 * weight, local)


@pytest.mark.parametrize("gear", [SET.sun, SET.planet, SET.ring], ids=["sun", "planet", "ring"])
def test_compliance_at_the_tip_is_that_of_small_elements(gear):
    """Loads 10 um to 0.4 mm from the corner; without the wedge the ring's error is 0.7 to 1.1."""
    x = np.array([10.0, 20.0, 50.0, 100.0, 200.0, 400.0]) * 1e-6
    grid = mirror(mesh_outline(half_sector(gear)))
    K = stiffness(grid, STEEL, thickness=gear.face_width)
    flank = held_sector_compliance(grid, gear, STEEL, K, held="rim")
    tip, way = gear.tip_roll**2 / (2 * gear.base_radius), 1.0 if gear.internal else -1.0
    index, weight = station_weights(np.sqrt(2 * gear.base_radius * (tip + way * x)), flank.roll)
    n, at = len(flank.roll), np.zeros((len(x), len(flank.roll)))
    np.add.at(at, (np.arange(len(x))[:, None], index), weight)
    ours = at @ flank.regular[0, :n, :n] @ at.T * gear.face_width
    ours = ours + flank.corner.surface(x[:, None], x)
    # in the half plane's displacement when the distance grows e times
    unit = (1 - STEEL.poisson_ratio) / (math.pi * STEEL.shear_modulus)
    error = (ours - resolved_compliance(gear, x)) / unit
    # some elements a patch do not resolve its own singularity, which the diagonal sees
    assert np.abs(error).max() < 0.25
    assert np.abs(error[~np.eye(len(x), dtype=bool)]).max() < 0.1


@pytest.mark.slow
def test_contact_at_tip_corners_is_that_of_resolved_bodies(bodies):
    """Equal cells without the wedge: deflection 0.9 % off, a load 1.3 % of the mesh force."""
    s, positions = corner_set(), (54, 55, 58)
    ours = mesh_alone(s.gears, bodies, s.force, PLANET_RING, positions)
    deflection, load = corner_differences(ours, corner_by_rotation(positions, edges=8, refine=0.5), s.force)
    assert deflection < 5e-3
    assert load < 1e-2


def test_corner_contact_does_not_depend_on_cells(bodies):
    few, many = contact(bodies), contact(bodies, cells=108)
    np.testing.assert_allclose(few.secant, many.secant, rtol=5e-4)
    np.testing.assert_allclose(few.tangent, many.tangent, rtol=5e-3)


@pytest.mark.decisive
@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"depth": 0.33e-3}, marks=pytest.mark.slow),
        pytest.param({"depth": 3e-3}, marks=pytest.mark.slow),
        {"flank_elements": 12},
        pytest.param({"flank_elements": 48}, marks=pytest.mark.slow),
    ],
)
def test_corner_contact_does_not_depend_on_depth_and_elements(bodies, options):
    """A third and three times the depth (or what the teeth allow), half and twice the elements."""
    plain, other = contact(bodies), contact(corner_bodies(**options))
    np.testing.assert_allclose(other.secant, plain.secant, rtol=3e-3)
    swing = [np.ptp(1 / found.secant) for found in (plain, other)]
    assert swing[1] == pytest.approx(swing[0], rel=0.03)
