"""Plane elastostatics: NAFEMS LE1, MacNeal-Harder, Lame, Golovin, rings, patches, invariances."""

import numpy as np
import pytest

from femgear.fe.elasticity import Material, basis, mass, node_of_dof, stiffness
from femgear.fe.grid import Grid
from femgear.fe.meshing import Outline, mesh_outline
from validation.reference.plane_elasticity import checked_solve, edge_load, stress


def curve(function, k, *, start=0.0, end=1.0):
    """2 k + 1 points of a curve between two parameters."""
    return np.stack(function(np.linspace(start, end, 2 * k + 1)), axis=1)


def arc(radius, start, end, k):
    return curve(lambda t: (radius * np.cos(t), radius * np.sin(t)), k, start=start, end=end)


def line(p, q, k):
    return curve(lambda t: (p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])), k)


def graded_line(p, q, k, *, ratio):
    """Line whose last element is `ratio` times as long as its first."""
    step = np.geomspace(1.0, ratio, k)
    ends = np.append(0.0, np.cumsum(step)) / step.sum()
    t = np.insert(ends, np.arange(1, k + 1), 0.5 * (ends[1:] + ends[:-1]))[:, None]
    return (1 - t) * np.array(p) + t * np.array(q)


def ring_sector(inner, outer, angle, *, across, along):
    """Names: bottom (y = 0), outer, end (at the angle), inner."""
    c, s = np.cos(angle), np.sin(angle)
    return Outline(
        (
            ("bottom", line((inner, 0.0), (outer, 0.0), across)),
            ("outer", arc(outer, 0.0, angle, along)),
            ("end", line((outer * c, outer * s), (inner * c, inner * s), across)),
            ("inner", arc(inner, angle, 0.0, along)),
        )
    )


def unit_square(n, *, shift=None, rising=False):
    """n x n squares cut in two, along falling diagonals or rising ones.

    Corners of the inner part are moved by `shift` (n - 1, n - 1, 2).
    """
    line_ = np.linspace(0, 1, n + 1)
    x, y = np.meshgrid(line_, line_)
    corner = np.stack([x, y], axis=-1)
    if shift is not None:
        corner[1:-1, 1:-1] += shift
    corner = corner.reshape(-1, 2)
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    right, above, across = i + 1, i + n + 1, i + n + 2
    halves = ((i, right, across), (i, across, above)) if rising else ((i, right, above), (right, across, above))
    t = np.vstack([np.stack(half, 1) for half in halves])
    pairs = np.sort(t[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    edges, where = np.unique(pairs, axis=0, return_inverse=True)
    points = np.vstack([corner, corner[edges].mean(axis=1)])
    return Grid(points, np.hstack([t, len(corner) + where.reshape(-1, 3)]))


def border(grid):
    nodes = np.flatnonzero((grid.points == 0).any(axis=1) | (grid.points == 1).any(axis=1))
    return np.ravel([2 * nodes, 2 * nodes + 1], order="F")


def symmetry_dofs(grid, *, bottom="bottom", end="end"):
    """y held on the x axis, x held on the y axis."""
    return np.append(2 * np.unique(grid.boundaries[bottom]) + 1, 2 * np.unique(grid.boundaries[end]))


def test_rates_of_a_manufactured_solution():
    """u = sin(pi x) sin(pi y), v = x (1-x) y (1-y), plane strain E = 1, nu = 0.3: L2 third, H1 second order.

    Errors at n = 32 from an independent P2 computation: 8.6285e-6 and 2.11476e-3.
    """
    material = Material(1.0, 0.3, 1.0)
    lam, mu = material.lame("plane strain")
    pi = np.pi
    errors = []
    for n in (16, 32):
        grid = unit_square(n, rising=True)
        scalar = basis(grid, order=8)
        nodes = node_of_dof(grid, scalar)
        x, y = scalar.mapping.F(scalar.X)
        sx, sy, cx, cy = np.sin(pi * x), np.sin(pi * y), np.cos(pi * x), np.cos(pi * y)
        q = (1 - 2 * x) * (1 - 2 * y)
        body = (
            -((lam + 2 * mu) * -(pi**2) * sx * sy + lam * q + mu * (-(pi**2) * sx * sy + q)),
            -((lam + 2 * mu) * -2 * x * (1 - x) + (lam + mu) * pi**2 * cx * cy - 2 * mu * y * (1 - y)),
        )
        f = np.zeros(2 * grid.n_nodes)
        for component in range(2):
            for i in range(6):
                value = scalar.basis[i][0]
                np.add.at(
                    f,
                    2 * nodes[scalar.element_dofs[i]] + component,
                    (body[component] * value * scalar.dx).sum(1),
                )
        u = checked_solve(grid, stiffness(grid, material), f, fixed=border(grid)).reshape(-1, 2)
        fields = [scalar.interpolate(u[nodes, c]) for c in range(2)]
        exact = (sx * sy, x * (1 - x) * y * (1 - y))
        slopes = (
            (pi * cx * sy, pi * sx * cy),
            ((1 - 2 * x) * y * (1 - y), x * (1 - x) * (1 - 2 * y)),
        )
        l2 = sum((((fields[c] - exact[c]) ** 2) * scalar.dx).sum() for c in range(2))
        h1 = sum((((fields[c].grad[d] - slopes[c][d]) ** 2) * scalar.dx).sum() for c in range(2) for d in range(2))
        errors.append(np.sqrt([l2, h1]))
    rates = np.log2(errors[0] / errors[1])
    assert np.allclose(rates, [3.0, 2.0], atol=0.05)
    np.testing.assert_allclose(errors[1], [8.6285e-6, 2.11476e-3], rtol=1e-5)


@pytest.mark.parametrize("state", ["plane strain", "plane stress"])
@pytest.mark.parametrize("nu", [0.3, 0.499])
def test_patch(nu, state):
    """Linear displacements on a distorted 4 x 4 patch are reproduced to rounding."""
    shift = np.random.default_rng(1).uniform(-0.06, 0.06, (3, 3, 2))
    grid = unit_square(4, shift=shift)
    x, y = grid.points.T
    exact = 1e-3 * np.stack([1 + 2 * x + 0.5 * y, -0.3 + 0.25 * x - 1.5 * y], axis=1)
    fixed = border(grid)
    K = stiffness(grid, Material(206e9, nu, 7850.0), state=state)
    u = checked_solve(grid, K, np.zeros(2 * grid.n_nodes), fixed=fixed, values=exact.ravel()[fixed])
    assert np.abs(u.reshape(-1, 2) - exact).max() < 1e-11 * np.abs(exact).max()


def test_nafems_le1():
    """NAFEMS LE1, elliptic membrane: sigma_yy at D 92.7 MPa (converged 92.658), u_x and strain energy."""
    quarter = np.pi / 2
    k, across = 64, 32
    outline = Outline(
        (
            ("bottom", graded_line((2.0, 0.0), (3.25, 0.0), across, ratio=6.0)),
            ("outer", curve(lambda t: (3.25 * np.cos(t), 2.75 * np.sin(t)), k, end=quarter)),
            ("end", line((0.0, 2.75), (0.0, 1.0), across)),
            ("inner", curve(lambda t: (2.0 * np.cos(t), np.sin(t)), k, start=quarter, end=0.0)),
        )
    )
    outline = Outline(tuple((n, np.where(np.abs(p) < 1e-12, 0.0, p)) for n, p in outline.curves))
    grid = mesh_outline(outline)
    steel = Material(210e9, 0.3, 7800.0)
    K = stiffness(grid, steel, state="plane stress", thickness=0.1)
    load = edge_load(grid, "outer", lambda x, n: 10e6 * n, thickness=0.1)
    u = checked_solve(grid, K, load, fixed=symmetry_dofs(grid))
    corner = int(np.flatnonzero((grid.points == [2.0, 0.0]).all(axis=1))[0])
    sigma = stress(grid, steel, u, state="plane stress")
    at = sigma[grid.triangles == corner][:, 1]
    assert at.mean() == pytest.approx(92.7e6, rel=2e-3)
    assert at.mean() == pytest.approx(92.658e6, rel=1e-3)
    assert u[2 * corner] == pytest.approx(-1.022085e-4, rel=5e-5)
    assert 0.5 * u @ load / 0.1 == pytest.approx(6083.736, rel=1e-6)


@pytest.mark.parametrize(
    "nu, target", [(0.3, 4.5825e-3), (0.49, 5.039925e-3), (0.499, 5.06024925e-3), (0.4999, 5.0622749925e-3)]
)
def test_thick_cylinder_does_not_lock(nu, target):
    """MacNeal and Harder (1985): u_r(3) of a cylinder 3/9, E = 1000, p = 1, plane strain."""
    grid = mesh_outline(ring_sector(3.0, 9.0, np.pi / 2, across=16, along=24))
    material = Material(1000.0, nu, 1.0)
    K = stiffness(grid, material)
    u = checked_solve(grid, K, edge_load(grid, "inner", lambda x, n: -n), fixed=symmetry_dofs(grid))
    inner = np.unique(grid.boundaries["inner"])
    radial = np.sum(u.reshape(-1, 2)[inner] * grid.points[inner], axis=1) / 3.0
    np.testing.assert_allclose(radial, target, rtol=1e-3)
    assert radial.mean() == pytest.approx(target, rel=2e-4)
    if nu == 0.3:
        corner = int(np.flatnonzero((grid.points == [3.0, 0.0]).all(axis=1))[0])
        at = stress(grid, material, u, state="plane strain")[grid.triangles == corner].mean(axis=0)
        assert at[0] == pytest.approx(-1.0, rel=0.02) and at[1] == pytest.approx(1.25, rel=0.02)


def test_ring_under_internal_pressure():
    """Lame, plane stress, radii 0.10/0.12 m, p = 50 MPa: displacements and hoop stresses at both radii."""
    grid = mesh_outline(ring_sector(0.10, 0.12, np.pi / 2, across=6, along=48))
    steel = Material(210e9, 0.3, 7850.0)
    K = stiffness(grid, steel, state="plane stress")
    u = checked_solve(grid, K, edge_load(grid, "inner", lambda x, n: -50e6 * n), fixed=symmetry_dofs(grid))
    sigma = stress(grid, steel, u, state="plane stress")
    for radius, displacement, hoop in (
        (0.10, 1.3917749e-4, 277.272727e6),
        (0.12, 1.2987013e-4, 227.272727e6),
    ):
        at = int(np.flatnonzero((grid.points == [radius, 0.0]).all(axis=1))[0])
        assert u[2 * at] == pytest.approx(displacement, rel=1e-6)
        assert sigma[grid.triangles == at][:, 1].mean() == pytest.approx(hoop, rel=5e-4)


def test_curved_bar_in_pure_bending():
    """Golovin: a = 1, b = 2, M = 1: hoop stress 7.7552436 inside, -4.9170168 outside, radial 1.0698572.

    The moment enters as a linear traction on the far end; at the middle of a half ring only the exact
    distribution is left (Saint-Venant).
    """
    grid = mesh_outline(ring_sector(1.0, 2.0, np.pi / 2, across=28, along=48))
    material = Material(1.0, 0.3, 1.0)
    K = stiffness(grid, material, state="plane stress")
    load = edge_load(grid, "end", lambda x, n: 12 * (x[..., 1:] - 1.5) * np.array([-1.0, 0.0]))
    bottom = np.unique(grid.boundaries["bottom"])
    corner = int(np.flatnonzero((grid.points == [1.0, 0.0]).all(axis=1))[0])
    u = checked_solve(grid, K, load, fixed=np.append(2 * bottom + 1, 2 * corner))
    sigma = stress(grid, material, u, state="plane stress")
    far = int(np.flatnonzero((grid.points == [2.0, 0.0]).all(axis=1))[0])
    inside = sigma[grid.triangles == corner][:, 1].mean()
    outside = sigma[grid.triangles == far][:, 1].mean()
    # the outside is pulled: the moment bends the bar further
    assert inside == pytest.approx(-7.7552436, rel=3e-3)
    assert outside / inside == pytest.approx(-4.9170168 / 7.7552436, rel=3e-3)
    radial = [sigma[grid.triangles == node][:, 0].mean() for node in bottom]
    peak = int(np.argmin(radial))
    assert radial[peak] == pytest.approx(-1.0698572, rel=3e-3)
    assert grid.points[bottom[peak], 0] == pytest.approx(1.35956, abs=0.04)


@pytest.mark.parametrize(
    "slenderness, along, target, gate",
    [
        (0.01, 320, (0.148741, 0.136574), 1e-3),
        (0.02, 160, (0.148861, 0.136632), 1e-3),
        (0.1, 40, (0.151332, 0.137276), 5e-3),
    ],
)
def test_ring_with_two_opposite_point_loads(slenderness, along, target, gate):
    """Diametral changes in F R^3 / (E I); thin ring pi/4 - 2/pi and 2/pi - 1/2, other values plane stress FE.

    A quarter ring with the load on the mean circle. The point load adds a local indentation that grows
    slowly with refinement, hence the wider gate for the thick ring.
    """
    h = slenderness
    grid = mesh_outline(ring_sector(1 - h / 2, 1 + h / 2, np.pi / 2, across=2, along=along))
    K = stiffness(grid, Material(1.0, 0.3, 1.0), state="plane stress")
    loaded = int(np.hypot(*(grid.points - [1.0, 0.0]).T).argmin())
    across = int(np.hypot(*(grid.points - [0.0, 1.0]).T).argmin())
    load = np.zeros(2 * grid.n_nodes)
    load[2 * loaded] = -0.5
    u = checked_solve(grid, K, load, fixed=symmetry_dofs(grid)) * h**3 / 12
    assert -2 * u[2 * loaded] == pytest.approx(target[0], rel=gate)
    assert 2 * u[2 * across + 1] == pytest.approx(target[1], rel=gate)
    if h == 0.01:
        assert -2 * u[2 * loaded] == pytest.approx(np.pi / 4 - 2 / np.pi, rel=1e-3)
        assert 2 * u[2 * across + 1] == pytest.approx(2 / np.pi - 0.5, rel=1e-3)


def compliance(grid, material, *, thickness=1.0):
    """Displacements at the outer nodes of a sector under unit forces there, inner arc held."""
    K = stiffness(grid, material, thickness=thickness)
    inner, outer = np.unique(grid.boundaries["inner"]), grid.boundaries["outer"][:, 0]
    dofs = np.ravel([2 * outer, 2 * outer + 1], order="F")
    loads = np.zeros((2 * grid.n_nodes, len(dofs)))
    loads[dofs, np.arange(len(dofs))] = 1.0
    return checked_solve(grid, K, loads, fixed=np.append(2 * inner, 2 * inner + 1))[dofs]


def test_invariances():
    """Rotation, scale, units, reciprocity, positive definiteness: no reference needed."""
    steel = Material(206e9, 0.3, 7850.0)
    grid = mesh_outline(ring_sector(0.5, 1.0, 0.6, across=6, along=6))
    C = compliance(grid, steel)
    assert np.abs(C - C.T).max() < 1e-12 * np.abs(C).max()
    assert np.linalg.eigvalsh(0.5 * (C + C.T)).min() > 0
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, s], [-s, c]])
    turned = compliance(Grid(grid.points @ turn, grid.triangles, grid.boundaries), steel)
    block = np.kron(np.eye(len(C) // 2), turn)
    assert np.abs(block.T @ C @ block - turned).max() < 1e-11 * np.abs(C).max()
    scaled = compliance(Grid(37.5 * grid.points, grid.triangles, grid.boundaries), steel)
    assert np.abs(scaled - C).max() < 1e-11 * np.abs(C).max()
    # mm, N, MPa
    other = compliance(
        Grid(1e3 * grid.points, grid.triangles, grid.boundaries), Material(206e3, 0.3, 7.85e-9), thickness=1e3
    )
    assert np.abs(other * 1e-3 - C).max() < 1e-12 * np.abs(C).max()
    total = mass(grid, steel).sum() / 2
    assert total == pytest.approx(7850 * 0.3 * (1.0 - 0.25), rel=1e-6)
