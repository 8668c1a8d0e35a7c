"""Half-plane influence functions against equilibrium, quadrature and limits known in closed form."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import toeplitz

from femgear.contact import local_compliance
from femgear.contact.local_compliance import depth_displacement, surface_displacement
from femgear.contact.windows import _window_compliance
from validation.reference.hertz import (
    cell_influence,
    contact_modulus,
    hertz_line,
    point_surface_relative_to_depth,
    relative_radius,
    surface_relative_to_depth,
    weber_banaschek,
)

E, NU = 206e9, 0.3
MU = E / (2 * (1 + NU))


@pytest.mark.parametrize("x", [0.0, 0.3e-3, -2e-3])
def test_flamant_field_obeys_hooke(x):
    """dw/dz equals the plane-strain strain of Flamant's stresses, sigma_r = -2 P cos(theta) / (pi r)."""
    z, step, nu = 0.4e-3, 1e-8, 0.27
    shear = E / (2 * (1 + nu))
    upper, lower = (depth_displacement(x, depth, shear, nu) for depth in (z + step, z - step))
    r4 = (x**2 + z**2) ** 2
    stress_z, stress_x = -2 * z**3 / (np.pi * r4), -2 * x**2 * z / (np.pi * r4)
    strain = ((1 - nu**2) * stress_z - nu * (1 + nu) * stress_x) / E
    assert (upper - lower) / (2 * step) == pytest.approx(strain, rel=1e-7)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("x", [0.0, 1.5e-5, 2e-5, 7e-5, 9e-4])
def test_cell_is_the_mean_of_line_loads(x, nu):
    h, d = 2e-5, 5e-4
    breaks = [x] if abs(x) < h else None
    # compliances in m/N are far below the absolute tolerance that quad has by itself
    options = dict(points=breaks, limit=200, epsabs=0.0, epsrel=1e-11)
    mean = quad(lambda s: point_surface_relative_to_depth(x - s, d, MU, nu), -h, h, **options)
    got = surface_relative_to_depth(x, h, d, MU, nu)
    assert float(got) == pytest.approx(mean[0] / (2 * h), rel=1e-9)
    assert float(surface_relative_to_depth(-x, h, d, MU, nu)) == pytest.approx(float(got), rel=1e-12)


def test_cell_relative_to_depth_is_the_difference_of_the_two_displacements():
    h, d = 2e-5, 5e-4
    for x in (0.0, 3e-5, 4e-4):
        below = quad(lambda s, x=x: depth_displacement(x - s, d, MU, NU), -h, h)[0] / (2 * h)
        difference = float(surface_displacement(x, h, MU, NU)) - below
        assert float(surface_relative_to_depth(x, h, d, MU, NU)) == pytest.approx(difference, rel=1e-9)


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_surface_displacement_is_the_mean_of_flamants_logarithm(nu):
    """``-(1 - nu) / (pi mu)`` times the mean of ln |x - s|: in closed form at the middle and at the edge."""
    h = 2e-5
    factor = -(1 - nu) / (np.pi * MU)
    x = np.array([0.0, h, -h])
    exact = factor * np.array([np.log(h) - 1.0, np.log(2 * h) - 1.0, np.log(2 * h) - 1.0])
    np.testing.assert_allclose(surface_displacement(x, h, MU, nu), exact, rtol=1e-13)
    for x in (1.1e-5, 3e-5, -4e-4):
        breaks = [x] if abs(x) < h else None
        mean = quad(lambda s, x=x: np.log(abs(x - s)), -h, h, points=breaks, epsabs=0.0, epsrel=1e-12)[0]
        exact = factor * mean / (2 * h)
        assert float(surface_displacement(x, h, MU, nu)) == pytest.approx(exact, rel=1e-9)


def test_windows_yield_on_both_flanks_as_their_material_and_width_say():
    """Equal cells inside the flanks: Flamant's mean logarithm of both, over the mesh width, by distance."""
    cells, width = 4, 3e-4
    materials = (MU, NU), (0.5 * MU, 0.27)
    found = _window_compliance(width, cells, materials, 12.5e-3)[0]
    h, factor = width / cells / 2, -((1 - NU) / MU + (1 - 0.27) / (0.5 * MU)) / (np.pi * 12.5e-3)

    def mean_log(x):
        # of ln |x - s| over |s| < h, by the antiderivative t ln t - t
        return ((x + h) * np.log(x + h) - (x - h) * np.log(x - h)) / (2 * h) - 1.0

    row = factor * np.array([np.log(h) - 1.0, *(mean_log(2 * h * k) for k in (1, 2, 3))])
    np.testing.assert_allclose(found, toeplitz(row), rtol=1e-10)


def test_far_from_the_cell_it_is_a_line_load():
    h, d = 1e-6, 1e-4
    x = np.array([1e-3, 1e-2, 0.1])
    point = point_surface_relative_to_depth(x, d, MU, NU)
    scale = float(surface_relative_to_depth(0.0, h, d, MU, NU))
    assert np.abs(surface_relative_to_depth(x, h, d, MU, NU) - point).max() < 1e-8 * scale


@pytest.mark.parametrize("nu", [0.1, 0.3])
def test_semi_elliptic_pressure_gives_weber_and_banaschek(nu):
    """At the middle of a Hertzian pressure, d >> a; the cells converge to it with an order above one."""
    load, a, d = 1e5, 7e-5, 70e-3
    shear = E / (2 * (1 + nu))
    errors = []
    for n in (40, 80, 160, 320, 640):
        edges = np.linspace(-1, 1, n + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        # exact load on every cell of the semi-ellipse
        primitive = (edges * np.sqrt(1 - edges**2) + np.arcsin(edges)) / np.pi
        cells = load * np.diff(primitive)
        approach = cells @ surface_relative_to_depth(a * middle, a / n, d, shear, nu)
        errors.append(approach / weber_banaschek(load, a, d, E, nu) - 1)
    errors = np.abs(errors)
    assert errors[-1] < 1e-5
    assert np.all(np.log2(errors[:-2] / errors[1:-1]) > 1.4)


def test_the_sum_of_local_and_deep_part_does_not_depend_on_the_depth():
    x, h = np.linspace(-2e-4, 2e-4, 9), 1e-7
    sums = [surface_relative_to_depth(x, h, d, MU, NU) + depth_displacement(x, d, MU, NU) for d in (1e-4, 4e-4, 2e-3)]
    np.testing.assert_allclose(sums[1], sums[0], rtol=1e-6)
    np.testing.assert_allclose(sums[2], sums[0], rtol=1e-6)


def test_cell_influence_of_a_hertzian_pressure_is_the_approach_less_the_shape():
    """Displacement under the semi-ellipse: approach - x^2 / (2 R) inside the contact (Johnson, 4.2)."""
    hertz = hertz_line(5e5, 0.15, contact_modulus(E, NU, E, NU))
    a, n = hertz.half_width, 2000
    edges = np.linspace(-1, 1, n + 1)
    loads = hertz.line_load * np.diff((edges * np.sqrt(1 - edges**2) + np.arcsin(edges)) / np.pi)
    middle = 0.5 * (edges[1:] + edges[:-1]) * a
    datum = 40 * a
    x = np.array([0.0, 0.3, 0.7]) * a
    moved = cell_influence(x[:, None] - middle, a / n, datum, hertz.modulus) @ loads
    np.testing.assert_allclose(moved, hertz.approach(datum) - x**2 / (2 * hertz.radius), rtol=2e-5)


def test_influence_matrix_is_symmetric_positive_definite():
    x = (np.arange(60) + 0.5) * 1e-5
    for matrix in (
        surface_relative_to_depth(x[:, None] - x, 0.5e-5, 4e-4, MU, NU),
        cell_influence(x[:, None] - x, 0.5e-5, 0.05, 1e11),
    ):
        np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12)
        assert np.linalg.eigvalsh(matrix)[0] > 0


def test_hertz_load_is_the_integral_of_its_pressure():
    hertz = hertz_line(3e5, 0.02, 1.1e11)
    total = quad(hertz.pressure, -hertz.half_width, hertz.half_width)[0]
    assert total == pytest.approx(3e5, rel=1e-7)
    assert hertz.pressure(2 * hertz.half_width) == 0


def test_largest_shear_by_search_along_the_axis():
    hertz = hertz_line(3e5, 0.02, 1.1e11)
    z = np.linspace(0, 3, 300_001) * hertz.half_width
    root = np.sqrt(hertz.half_width**2 + z**2)
    stress_x = -hertz.peak_pressure / hertz.half_width * ((hertz.half_width**2 + 2 * z**2) / root - 2 * z)
    stress_z = -hertz.peak_pressure * hertz.half_width / root
    shear = 0.5 * np.abs(stress_x - stress_z)
    tau, depth = hertz.max_shear()
    assert tau == pytest.approx(shear.max(), rel=1e-9)
    assert depth == pytest.approx(z[shear.argmax()], rel=1e-4)


def test_no_load_no_contact():
    hertz = hertz_line(0.0, 0.02, 1.1e11)
    assert hertz.half_width == hertz.peak_pressure == hertz.approach(1.0) == hertz.max_shear()[0] == 0
    assert hertz.pressure(np.zeros(2)).tolist() == [0, 0]


def test_relative_radius_of_a_hollow_surface():
    assert relative_radius(0.05, -0.075) == pytest.approx(0.15)
    assert relative_radius(0.05, np.float64(1e9)) == pytest.approx(0.05)


@pytest.mark.parametrize(("r", "theta"), [(0.7, 0.5), (1.6, 1.2), (0.3, 1.8)])
def test_displacements_beneath_a_corner_have_the_strain_of_their_stresses(r, theta):
    """Stresses of Airy's function ``r^(p + 1) f(theta)`` in polar coordinates (Timoshenko and Goodier, section 27)."""
    angle, step = 2.0, 1e-5
    omega = np.arange(0.0, local_compliance._LAST + 0.5 * local_compliance._STEP, local_compliance._STEP)
    power = local_compliance._REAL_PART + 1j * omega
    up, down = power + 1, power - 1
    wedge, plane = (local_compliance._stress_function(one, power) for one in (angle, np.pi))
    A, B, C, D = (wedge - plane) * np.where(omega == 0, 0.5, 1.0) * local_compliance._STEP / np.pi
    f = A * np.cos(up * theta) + B * np.sin(up * theta) + C * np.cos(down * theta) + D * np.sin(down * theta)
    first = up * (B * np.cos(up * theta) - A * np.sin(up * theta))
    first = first + down * (D * np.cos(down * theta) - C * np.sin(down * theta))
    second = -(up**2) * (A * np.cos(up * theta) + B * np.sin(up * theta))
    second = second - down**2 * (C * np.cos(down * theta) + D * np.sin(down * theta))
    radial, hoop, shear = (
        float(np.real(part * r**down).sum()) for part in (up * f + second, power * up * f, -power * first)
    )
    sine, cosine = np.sin(theta), np.cos(theta)
    along = radial * sine**2 + hoop * cosine**2 + 2.0 * shear * sine * cosine
    x, y = r * cosine, r * sine
    upper, lower = (
        float(local_compliance._excess(angle, np.hypot(x, at), np.arctan2(at, x), NU)) for at in (y + step, y - step)
    )
    assert (upper - lower) / (2.0 * step) == pytest.approx(0.5 * (along - NU * (radial + hoop)), rel=1e-5)
