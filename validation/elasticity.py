"""Plane elasticity against closed forms, on structured second-order triangle grids."""

from __future__ import annotations

import math

import numpy as np

from femgear.fe.elasticity import Material, basis, node_of_dof, stiffness
from femgear.fe.grid import Grid
from validation.mapped import boundary_nodes, mapped_grid, ring_mapping
from validation.reference.plane_elasticity import checked_solve, edge_load, stress
from validation.rows import REPEATED, Row, at_most, printed, within

LAME = "Lame (Timoshenko and Goodier, art. 28)"
CURVED_BEAM = "Golovin (Timoshenko and Goodier, art. 29)"


def _square(u, v):
    return u, v


def _all_boundary_dofs(grid):
    nodes = np.unique(np.concatenate([edges.ravel() for edges in grid.boundaries.values()]))
    return nodes, (2 * nodes[:, None] + [0, 1]).ravel()


def patch_test() -> tuple[Row, ...]:
    """A1: a linear displacement field is reproduced on a distorted grid."""
    straight = mapped_grid(_square, 4, 4)
    shift = np.random.default_rng(1).uniform(-0.06, 0.06, (straight.n_nodes, 2))
    points = straight.points.copy()
    corners = np.setdiff1d(straight.triangles[:, :3], _all_boundary_dofs(straight)[0])
    points[corners] += shift[corners]
    ends = straight.triangles[:, [[0, 1], [1, 2], [2, 0]]]
    points[straight.triangles[:, 3:]] = points[ends].mean(axis=2)
    grid = Grid(points, straight.triangles, straight.boundaries, straight.regions)
    x, y = points.T
    exact = 1e-3 * np.column_stack([1 + 2 * x + 0.5 * y, -0.3 + 0.25 * x - 1.5 * y]).ravel()
    fixed = _all_boundary_dofs(grid)[1]
    rows = []
    for nu in (0.3, 0.499):
        for state in ("plane strain", "plane stress"):
            K = stiffness(grid, Material(210e9, nu, 7850.0), state=state)
            u = checked_solve(grid, K, np.zeros(2 * grid.n_nodes), fixed=fixed, values=exact[fixed])
            error = np.abs(u - exact).max() / np.abs(exact).max()
            rows.append(at_most("A1", "exact", f"patch test, {state}, nu {nu}: relative error", 1e-11, error))
    return tuple(rows)


def _manufactured(x, y):
    """Displacement, gradient and body force of A2 for E = 1, nu = 0.3, plane strain."""
    lam, mu = Material(1.0, 0.3, 1.0).lame("plane strain")
    pi, sx, sy, cx, cy = (
        math.pi,
        np.sin(math.pi * x),
        np.sin(math.pi * y),
        np.cos(math.pi * x),
        np.cos(math.pi * y),
    )
    p, q, dp, dq = x * (1 - x), y * (1 - y), 1 - 2 * x, 1 - 2 * y
    value = np.array([sx * sy, p * q])
    gradient = np.array([[pi * cx * sy, pi * sx * cy], [dp * q, p * dq]])
    u_xx, u_xy, v_xx, v_yy, v_xy = -pi * pi * sx * sy, pi * pi * cx * cy, -2 * q, -2 * p, dp * dq
    force = -np.array(
        [
            (lam + 2 * mu) * u_xx + mu * u_xx + (lam + mu) * v_xy,
            (lam + 2 * mu) * v_yy + mu * v_xx + (lam + mu) * u_xy,
        ]
    )
    return value, gradient, force


def manufactured_errors(cells: int) -> tuple[float, float]:
    """L2 error and H1 seminorm error of the manufactured solution of A2 on `cells` x `cells`."""
    from skfem import LinearForm

    grid = mapped_grid(_square, cells, cells)
    scalar = basis(grid, order=8)
    nodes = node_of_dof(grid, scalar)
    value, gradient, force = _manufactured(*np.asarray(scalar.global_coordinates()))
    load = np.zeros((grid.n_nodes, 2))
    for component in (0, 1):
        form = LinearForm(lambda v, w: w.force * v)
        load[nodes, component] = form.assemble(scalar, force=force[component])
    K = stiffness(grid, Material(1.0, 0.3, 1.0), state="plane strain")
    u = checked_solve(grid, K, load.ravel(), fixed=_all_boundary_dofs(grid)[1]).reshape(-1, 2)
    l2 = h1 = 0.0
    for component in (0, 1):
        field = scalar.interpolate(u[nodes, component])
        l2 += np.sum((np.asarray(field) - value[component]) ** 2 * scalar.dx)
        h1 += np.sum((field.grad - gradient[component]) ** 2 * scalar.dx)
    return math.sqrt(l2), math.sqrt(h1)


def manufactured_solution() -> tuple[Row, ...]:
    """A2: convergence rates of second-order triangles."""
    coarse, fine = manufactured_errors(16), manufactured_errors(32)
    return tuple(
        within("A2", "theory", f"convergence rate of P2 in {name}", rate, math.log2(c / f), 0.05, relative=False)
        for name, rate, c, f in zip(("L2", "H1"), (3.0, 2.0), coarse, fine, strict=True)
    )


def elliptic_membrane() -> tuple[Row, ...]:
    """A3: NAFEMS LE1."""

    def mapping(u, v):
        angle = 0.5 * np.pi * v
        return (2 + 1.25 * u) * np.cos(angle), (1 + 1.75 * u) * np.sin(angle)

    # cells crowd at D, where the stress is read
    u_lines, v_lines = (np.linspace(0.0, 1.0, cells + 1) ** 2 for cells in (32, 48))
    grid = mapped_grid(mapping, u_lines, v_lines)
    material = Material(210e9, 0.3, 7850.0)
    fixed = np.concatenate([2 * boundary_nodes(grid, "v=0") + 1, 2 * boundary_nodes(grid, "v=1")])
    load = edge_load(grid, "u=1", lambda x, n: 10e6 * n)
    K = stiffness(grid, material, state="plane stress")
    u = checked_solve(grid, K, load, fixed=fixed)
    corner = int(np.argmin(np.hypot(*(grid.points - [2.0, 0.0]).T)))
    s_yy = stress(grid, material, u, state="plane stress")[..., 1][grid.triangles == corner].mean()
    name = "NAFEMS LE1, elliptic membrane: "
    converged = f"converged independent solutions ({REPEATED})"
    return (
        printed("A3", "NAFEMS", name + "stress yy at D [MPa]", "92.7", s_yy * 1e-6),
        within("A3", converged, name + "stress yy at D [MPa]", 92.658, s_yy * 1e-6, 2e-4),
        within("A3", converged, name + "displacement x of D [m]", -1.022085e-4, u[2 * corner], 1e-5),
        within("A3", converged, name + "strain energy [J per m]", 6083.736, 0.5 * u @ load, 1e-5),
    )


def _pressurised_ring(inner, outer, material, pressure, state, cells):
    """Grid, displacements and radial displacements at both radii of a quarter ring."""
    grid = mapped_grid(ring_mapping(inner, outer, 0.5 * np.pi), *cells)
    fixed = np.concatenate([2 * boundary_nodes(grid, "v=0") + 1, 2 * boundary_nodes(grid, "v=1")])
    load = edge_load(grid, "u=0", lambda x, n: -pressure * n)
    u = checked_solve(grid, stiffness(grid, material, state=state), load, fixed=fixed)
    ends = [int(np.argmin(np.hypot(*(grid.points - [radius, 0.0]).T))) for radius in (inner, outer)]
    return grid, u, [u[2 * node] for node in ends], ends


def thick_cylinder() -> tuple[Row, ...]:
    """A4: thick cylinder up to the incompressible limit."""
    rows = []
    for nu, value in (
        (0.3, "4.5825e-3"),
        (0.49, "5.039925e-3"),
        (0.499, "5.06024925e-3"),
        (0.4999, "5.0622749925e-3"),
    ):
        material = Material(1000.0, nu, 1.0)
        radial = _pressurised_ring(3.0, 9.0, material, 1.0, "plane strain", (48, 72))[2][0]
        name = f"thick cylinder 3/9, nu {nu}: inner radial displacement"
        gate = 2e-5 if nu == 0.3 else 5e-4
        note = "" if nu == 0.3 else "P2 triangles lose an order towards the incompressible limit but do not lock"
        rows.append(within("A4", LAME, name, float(value), radial, gate, note=note))
    return tuple(rows)


def ring_under_pressure() -> tuple[Row, ...]:
    """A5: thin ring under internal pressure, plane stress."""
    a, b, p = 0.10, 0.12, 50e6
    material = Material(210e9, 0.3, 7850.0)
    grid, u, radial, ends = _pressurised_ring(a, b, material, p, "plane stress", (16, 80))
    field = stress(grid, material, u, state="plane stress")[..., 1]
    hoop = [field[grid.triangles == node].mean() * 1e-6 for node in ends]
    values = (
        ("inner radial displacement [m]", 1.3917749e-4, radial[0], 1e-6),
        ("outer radial displacement [m]", 1.2987013e-4, radial[1], 1e-6),
        ("inner hoop stress [MPa]", 277.272727, hoop[0], 1e-3),
        ("outer hoop stress [MPa]", 227.272727, hoop[1], 1e-3),
    )
    return tuple(
        within("A5", LAME, f"ring 100/120 mm, 50 MPa: {name}", value, ours, gate) for name, value, ours, gate in values
    )


def curved_bar() -> tuple[Row, ...]:
    """A6: a curved bar in pure bending."""
    a, b = 1.0, 2.0
    log = math.log(b / a)
    norm = (b**2 - a**2) ** 2 - 4 * a**2 * b**2 * log**2

    def hoop(r):
        return -4 / norm * (-((a * b / r) ** 2) * log + b**2 * np.log(r / b) + a**2 * np.log(a / r) + b**2 - a**2)

    def traction(x, n):
        return hoop(np.hypot(x[..., 0], x[..., 1]))[..., None] * n

    grid = mapped_grid(ring_mapping(a, b, 0.5 * np.pi), 48, 80)
    material = Material(1000.0, 0.3, 1.0)
    base = boundary_nodes(grid, "v=0")
    fixed = np.concatenate([2 * base + 1, [2 * base[0]]])
    K = stiffness(grid, material, state="plane stress")
    u = checked_solve(grid, K, edge_load(grid, "v=1", traction), fixed=fixed)
    field = stress(grid, material, u, state="plane stress")
    inner, outer = (int(np.argmin(np.hypot(*(grid.points - [r, 0.0]).T))) for r in (a, b))
    on_base = np.isin(grid.triangles, base)
    values = (
        ("inner hoop stress", 7.7552436, abs(field[..., 1][grid.triangles == inner].mean())),
        ("outer hoop stress", 4.9170168, abs(field[..., 1][grid.triangles == outer].mean())),
        ("largest radial stress", 1.0698572, np.abs(field[..., 0][on_base]).max()),
    )
    return tuple(
        within("A6", CURVED_BEAM, f"curved bar 1/2, unit moment: {name}", value, ours, 1e-3)
        for name, value, ours in values
    )


def pinched_ring() -> tuple[Row, ...]:
    """A8: rings under two opposite point loads on their mean circle."""
    rows = []
    for thickness, across, transverse in ((0.02, 0.148861, 0.136632), (0.1, 0.151332, 0.137276)):
        grid = mapped_grid(ring_mapping(1 - thickness / 2, 1 + thickness / 2, 0.5 * np.pi), 4, 200)
        fixed = np.concatenate([2 * boundary_nodes(grid, "v=0") + 1, 2 * boundary_nodes(grid, "v=1")])
        side, top = (int(np.argmin(np.hypot(*(grid.points - at).T))) for at in ([1.0, 0.0], [0.0, 1.0]))
        load = np.zeros(2 * grid.n_nodes)
        load[2 * top + 1] = -0.5
        K = stiffness(grid, Material(1.0, 0.3, 1.0), state="plane stress")
        u = checked_solve(grid, K, load, fixed=fixed) * thickness**3 / 12
        name = f"pinched ring, h/R {thickness}, in F R^3/(E I): "
        note = "independent FE; thin ring (Timoshenko) 0.1487784, 0.1366198"
        rows.append(within("A8", note, name + "across the loads", across, -2 * u[2 * top + 1], 1e-3))
        rows.append(within("A8", note, name + "transverse", transverse, 2 * u[2 * side], 1e-3))
    return tuple(rows)


def _rim_compliance(points, grid, modulus=210e9, thickness=1.0):
    """Compliance of the outer rim of a ring sector held at its inner rim, both load directions."""
    moved = Grid(points, grid.triangles, grid.boundaries, grid.regions)
    nodes = boundary_nodes(grid, "u=1")[::4]
    dofs = (2 * nodes[:, None] + [0, 1]).ravel()
    load = np.zeros((2 * grid.n_nodes, len(dofs)))
    load[dofs, np.arange(len(dofs))] = 1.0
    held = boundary_nodes(grid, "u=0")
    fixed = (2 * held[:, None] + [0, 1]).ravel()
    K = stiffness(moved, Material(modulus, 0.3, 7850.0), state="plane strain", thickness=thickness)
    return checked_solve(moved, K, load, fixed=fixed)[dofs]


def invariances() -> tuple[Row, ...]:
    """A10: compliance does not depend on position, size per thickness, or units."""
    grid = mapped_grid(ring_mapping(0.02, 0.05, 1.0), 4, 8)
    compliance = _rim_compliance(grid.points, grid)
    angle = 0.7
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    turned = _rim_compliance(grid.points @ turn.T, grid)
    both = np.kron(np.eye(len(compliance) // 2), turn)
    larger = _rim_compliance(grid.points * 7.3, grid)
    millimetres = _rim_compliance(grid.points * 1e3, grid, modulus=210e3, thickness=1e3)
    size = np.abs(compliance).max()
    values = (
        ("turned by 0.7 rad", both.T @ turned @ both - compliance),
        ("scaled by 7.3", larger - compliance),
        ("in mm, N, MPa", millimetres * 1e-3 - compliance),
        ("reciprocity", compliance - compliance.T),
    )
    smallest = np.linalg.eigvalsh(0.5 * (compliance + compliance.T))[0] / size
    rows = [
        at_most(
            "A10",
            "invariance",
            f"compliance of a sector, {name}: relative error",
            1e-12,
            np.abs(d).max() / size,
        )
        for name, d in values
    ]
    negative = min(0.0, smallest)
    return (*rows, at_most("A10", "invariance", "compliance, negative part of its spectrum", 0.0, negative))
