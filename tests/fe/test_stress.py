"""Boundary stress functionals against closed forms: Lame's cylinder, Kirsch's hole, Golovin's bar."""

import numpy as np
import pytest

from femgear.fe.elasticity import Material, plane_modulus, stiffness, tangential_stress
from femgear.fe.meshing import Outline, mesh_outline
from validation.mapped import mapped_grid
from validation.reference.plane_elasticity import checked_solve, edge_load

STEEL = Material(206e9, 0.3, 7850.0)


def quarter(inner, outer, cells):
    """Quarter of an annulus; "u=0" is the inner arc, "v=0" and "v=1" lie on the axes."""

    def mapping(u, v):
        r, phi = inner + (outer - inner) * u, 0.5 * np.pi * v
        return r * np.cos(phi), r * np.sin(phi)

    return mapped_grid(mapping, cells, cells)


def on_axes(grid, x_axis, y_axis):
    """Degrees of freedom held by symmetry."""
    return np.concatenate([2 * np.unique(grid.boundaries[y_axis]), 2 * np.unique(grid.boundaries[x_axis]) + 1])


def test_hoop_stress_of_a_cylinder_under_outer_pressure():
    """Lame: at the free bore of a cylinder with radii a, b under outer pressure p, -2 p b^2/(b^2 - a^2)."""
    a, b, p = 0.02, 0.03, 50e6
    grid = quarter(a, b, 4)
    for state in ("plane strain", "plane stress"):
        K = stiffness(grid, STEEL, state=state)
        load = edge_load(grid, "u=1", lambda x, n: -p * n)
        u = checked_solve(grid, K, load, fixed=on_axes(grid, "v=0", "v=1"))
        along = tangential_stress(grid, STEEL, "u=0", state=state)
        exact = -2 * p * b**2 / (b**2 - a**2)
        assert along.columns.T @ u == pytest.approx(exact, rel=5e-3)
        assert (along.columns.T @ u)[1:-1] == pytest.approx(exact, rel=2e-4)
        assert along.arc[-1] == pytest.approx(0.5 * np.pi * a, rel=1e-4)


def kirsch_error(elements):
    """Largest errors over the largest stress at a hole in a plate: within the quarter, and at its ends.

    The plate is cut at four radii and loaded there by the tractions of the exact field (Timoshenko and
    Goodier, "Theory of Elasticity", 3rd ed., section 35).
    """
    grid = mesh_outline(hole_outline(1.0, 4.0, elements))
    K = stiffness(grid, STEEL, state="plane strain")
    load = edge_load(grid, "outer", lambda x, n: kirsch_traction(x))
    u = checked_solve(grid, K, load, fixed=on_axes(grid, "x axis", "y axis"))
    along = tangential_stress(grid, STEEL, "hole", state="plane strain")
    exact = 1 - 2 * np.cos(2 * np.arctan2(along.points[:, 1], along.points[:, 0]))
    error = np.abs(along.columns.T @ u - exact) / 3
    return error[1:-1].max(), error[[0, -1]].max()


def kirsch_traction(x):
    r, t = np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])
    q = 1 / r**2
    radial = 0.5 * (1 - q) + 0.5 * (1 - 4 * q + 3 * q**2) * np.cos(2 * t)
    shear = -0.5 * (1 + 2 * q - 3 * q**2) * np.sin(2 * t)
    return np.stack([radial * np.cos(t) - shear * np.sin(t), radial * np.sin(t) + shear * np.cos(t)], axis=-1)


def hole_outline(a, b, n):
    def arc(r, first, last):
        t = np.linspace(first, last, 2 * n + 1)
        return np.column_stack([r * np.cos(t), r * np.sin(t)])

    radii = np.geomspace(a, b, n + 1)
    line = np.empty(2 * n + 1)
    line[::2], line[1::2] = radii, 0.5 * (radii[1:] + radii[:-1])
    zero = np.zeros_like(line)
    curves = [
        ("x axis", np.column_stack([line, zero])),
        ("outer", arc(b, 0, 0.5 * np.pi)),
        ("y axis", np.column_stack([zero, line[::-1]])),
        ("hole", arc(a, 0.5 * np.pi, 0)),
    ]
    for i, (_, points) in enumerate(curves):
        points[0] = curves[i - 1][1][-1]
    return Outline(tuple(curves))


def test_stress_concentration_at_a_hole_converges():
    """Kirsch: 3 and -1 times the tension; eight edges along the quarter circle give 1 %, second order."""
    inner, ends = np.array([kirsch_error(n) for n in (8, 16, 32)]).T
    assert inner[0] < 0.01
    assert ends[1] < 0.01
    for error in (inner, ends):
        assert error[2] < 0.002
        assert np.log2(error[0] / error[2]) > 3.4


def test_bending_of_a_curved_bar():
    """Golovin: a = 1, b = 2, M = 1 that bends further: hoop stress -7.7552436 inside, 4.9170168 outside.

    The moment acts as the tractions of the exact field on the end (Timoshenko and Goodier, section 29).
    """
    a, b = 1.0, 2.0
    N = (b**2 - a**2) ** 2 - 4 * a**2 * b**2 * np.log(b / a) ** 2

    def hoop(x, normal):
        r = np.hypot(x[..., 0], x[..., 1])
        swell = a**2 * b**2 / r**2 * np.log(b / a)
        value = 4 / N * (-swell + b**2 * np.log(r / b) + a**2 * np.log(a / r) + b**2 - a**2)
        return value[..., None] * normal

    grid = quarter(a, b, 12)
    held = 2 * grid.boundaries["v=1"][0, :1]
    fixed = np.concatenate([2 * np.unique(grid.boundaries["v=1"]), held + 1])
    load = edge_load(grid, "v=0", hoop)
    u = checked_solve(grid, stiffness(grid, STEEL, state="plane stress"), load, fixed=fixed)
    values = {}
    for name in ("u=0", "u=1"):
        along = tangential_stress(grid, STEEL, name, state="plane stress")
        values[name] = (along.columns.T @ u)[len(along.arc) // 2]
    assert values["u=0"] == pytest.approx(-7.7552436, rel=3e-3)
    assert values["u=1"] == pytest.approx(4.9170168, rel=3e-3)


def test_a_linear_field_is_exact():
    """Uniaxial stretch of a bar: ``E eps`` in plane stress to rounding, along bent and straight edges."""
    grid = quarter(0.5, 1.0, 3)
    along = tangential_stress(grid, STEEL, "v=0", state="plane stress")
    u = (grid.points * np.array([1e-4, -3e-5])).ravel()
    assert along.columns.T @ u == pytest.approx(206e9 * 1e-4, rel=1e-11)
    rigid = np.column_stack([-grid.points[:, 1], grid.points[:, 0]]).ravel()
    curved = tangential_stress(grid, STEEL, "u=0", state="plane stress")
    assert np.abs(curved.columns.T @ rigid).max() < 1e-10 * STEEL.youngs_modulus


def test_consecutive_boundaries_are_one_line():
    grid = quarter(0.5, 1.0, 3)
    names = ("v=0", "u=1")
    line = tangential_stress(grid, STEEL, names, state="plane stress")
    assert len(line.arc) == 7
    assert line.arc[3] == pytest.approx(0.5)
    assert np.linalg.norm(line.tangents, axis=1) == pytest.approx(1.0)
    assert line.tangents[0] == pytest.approx([1.0, 0.0])


def test_modulus_of_an_edge():
    assert plane_modulus(STEEL, "plane stress") == pytest.approx(206e9)
    assert plane_modulus(STEEL, "plane strain") == pytest.approx(206e9 / (1 - 0.3**2))
