"""Printed references of the validation page computed again with NumPy, SciPy and plain scikit-fem alone.

Rows whose source says "independently" or "independent" and names this file are repeated here: the numbers
below are those of the rows, the equations stand in the tests, and nothing of femgear is imported.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq


def involute(angle):
    return math.tan(angle) - angle


def contact_ratio(z1, z2, alpha, *, tips, distance=None, internal=False):
    """Path of contact over base pitch (ISO 21771), lengths in modules."""
    sign = -1.0 if internal else 1.0
    standard = 0.5 * (z2 + sign * z1)
    distance = standard if distance is None else distance
    working = math.acos(standard * math.cos(alpha) / distance)
    bases = [0.5 * z * math.cos(alpha) for z in (z1, z2)]
    ends = [math.sqrt(tip**2 - base**2) for tip, base in zip(tips, bases, strict=True)]
    path = ends[0] + sign * ends[1] - sign * distance * math.sin(working)
    return path / (math.pi * math.cos(alpha))


@pytest.mark.parametrize(
    ("z1", "z2", "degrees", "printed"),
    [(20, 40, 20, 1.6351859635714576), (17, 17, 20, 1.5148004453923), (20, 20, 25, 1.4102352118360)],
)
def test_contact_ratio_of_external_pairs(z1, z2, degrees, printed):
    found = contact_ratio(z1, z2, math.radians(degrees), tips=(0.5 * z1 + 1, 0.5 * z2 + 1))
    assert found == pytest.approx(printed, rel=1e-12)


@pytest.mark.parametrize(
    ("z1", "z2", "degrees", "x", "printed"),
    [(20, 80, 20, 0.0, 1.88968133), (40, 100, 25, 0.0, 1.62987813), (17, 81, 20, 0.2, 1.74362843)],
)
def test_contact_ratio_of_internal_pairs(z1, z2, degrees, x, printed):
    # equal shifts of both leave the centre distance
    found = contact_ratio(z1, z2, math.radians(degrees), tips=(0.5 * z1 + 1 + x, 0.5 * z2 - 1 + x), internal=True)
    assert found == pytest.approx(printed, abs=5e-9)


def test_reference_set():
    alpha = math.radians(20)
    assert math.degrees(math.acos(33.5 * math.cos(alpha) / 34)) == pytest.approx(22.1995, abs=5e-5)
    tips = (13.5 + 1 + 0.52681, 21.0)
    assert contact_ratio(27, 40, alpha, tips=tips, distance=34) == pytest.approx(1.5507, abs=5e-5)
    assert contact_ratio(40, 108, alpha, tips=(21, 53), internal=True) == pytest.approx(1.9301, abs=5e-5)


def test_helical_pair():
    # m_n 3, beta 15 deg, 20/40, b 40
    beta, alpha = math.radians(15), math.radians(20)
    transverse = math.atan(math.tan(alpha) / math.cos(beta))
    assert math.degrees(transverse) == pytest.approx(20.6468965, abs=5e-8)
    base = math.asin(math.sin(beta) * math.cos(alpha))
    assert math.degrees(base) == pytest.approx(14.0760954, abs=5e-8)
    tips = (10 + math.cos(beta), 20 + math.cos(beta))
    assert contact_ratio(20, 40, transverse, tips=tips) == pytest.approx(1.5609328, abs=5e-8)
    assert 40 * math.sin(beta) / (3 * math.pi) == pytest.approx(1.0984621, abs=5e-8)


def test_root_form_diameters_of_a_helical_pair():
    # ISO 21771, rack-shaped tool: m_n 14, beta 10 deg, 24/95, x 0.48/0.6691, h_fP 1.25, rho 0.38
    beta, alpha = math.radians(10), math.radians(20)
    transverse = math.atan(math.tan(alpha) / math.cos(beta))
    for z, x, printed in ((24, 0.48, 328.991), (95, 0.6691, 1341.487)):
        d = 14 * z / math.cos(beta)
        height = 14 * (1.25 - x - 0.38 * (1 - math.sin(alpha)))
        root = math.hypot(d * math.sin(transverse) - 2 * height / math.sin(transverse), d * math.cos(transverse))
        assert root == pytest.approx(printed, abs=5e-4)


def test_shifted_pair_and_limits():
    alpha = math.radians(20)
    target = involute(alpha) + 2 * 0.5 * math.tan(alpha) / 60
    working = brentq(lambda angle: involute(angle) - target, 0.1, 0.8, xtol=1e-14)
    assert math.degrees(working) == pytest.approx(22.3167069, abs=5e-8)
    assert 3 * 30 * math.cos(alpha) / math.cos(working) == pytest.approx(91.4197646, abs=5e-8)
    assert 2 / math.sin(alpha) ** 2 == pytest.approx(17.0972643, abs=5e-8)
    for z, x in ((10, 0.4151111), (12, 0.2981333)):
        assert 1 - 0.5 * z * math.sin(alpha) ** 2 == pytest.approx(x, abs=5e-8)
    for z, x in ((12, 0.8202039), (20, 1.2223485)):
        tip = math.acos(0.5 * z * math.cos(alpha) / (0.5 * z + 1 + x))
        half = (0.5 * math.pi + 2 * x * math.tan(alpha)) / z + involute(alpha) - involute(tip)
        assert half == pytest.approx(0.0, abs=5e-8)


@pytest.mark.parametrize(("z1", "z2", "printed"), [(20, 40, 13.0180259), (17, 17, 11.1811762), (50, 50, 14.41483)])
def test_single_stiffness_of_iso_6336(z1, z2, printed):
    # q' of method B without shifts, C_M = 0.8
    assert 13.0180259 * (0.75 * 1.6351859636 + 0.25) == pytest.approx(19.2196764, abs=5e-8)
    assert 0.8 / (0.04723 + 0.15551 / z1 + 0.25791 / z2) == pytest.approx(printed, abs=5e-8)


def mathieu(a, q, damping=0.0):
    """Monodromy of x'' + c x' + (a - 2 q cos 2t) x = 0 over pi by DOP853."""

    def rate(t, y):
        return [y[1], -damping * y[1] - (a - 2 * q * math.cos(2 * t)) * y[0]]

    columns = [
        solve_ivp(rate, (0, math.pi), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        for start in ([1.0, 0.0], [0.0, 1.0])
    ]
    return np.linalg.eigvals(np.array(columns).T)


def test_multipliers_of_mathieu():
    low, high = np.sort(mathieu(1.0, 1.0).real)
    assert low == pytest.approx(-4.15605494, abs=5e-9)
    assert high == pytest.approx(-0.2406128, abs=5e-8)


@pytest.mark.parametrize(("damping", "printed"), [(0.1, 0.1000546711), (0.2, 0.2004369763)])
def test_threshold_of_damped_mathieu(damping, printed):
    found = brentq(lambda q: np.abs(mathieu(1.0, q, damping)).max() - 1.0, 0.9 * printed, 1.1 * printed, xtol=1e-12)
    assert found == pytest.approx(printed, abs=5e-11)


MEAN = 0.635 + 0.365 * 0.65


@pytest.mark.parametrize(
    ("ratio", "radius", "multiplier"), [(2.0, 0.096, 1.090), (1.0, 1.022, 1.005), (0.5, 0.579, None)]
)
def test_fixed_point_and_multipliers_of_a_rectangular_stiffness(ratio, radius, multiplier):
    natural = math.sqrt(MEAN)
    omega, damping = ratio * natural, 2 * 0.03 * natural
    period = 2 * math.pi / omega
    parts = [
        expm(np.array([[0.0, 1.0], [-k, -damping]]) * share * period) for k, share in ((1.0, 0.635), (0.65, 0.365))
    ]
    if multiplier is not None:
        found = np.abs(np.linalg.eigvals(parts[1] @ parts[0])).max()
        assert found == pytest.approx(multiplier, abs=5e-4)
    # x_h <- -H(h omega) sum_n k_(h - n) x_n, fluctuations k_n of the rectangular wave without its mean
    H = 200
    h = np.arange(-H, H + 1)
    n = np.arange(-2 * H, 2 * H + 1)
    with np.errstate(invalid="ignore"):
        wave = 0.35 * np.where(n == 0, 0.0, np.sin(math.pi * n * 0.635) / (math.pi * n))
    receptance = 1.0 / (MEAN - (h * omega) ** 2 + 1j * h * omega * damping)
    operator = receptance[:, None] * np.nan_to_num(wave)[h[:, None] - h + 2 * H]
    assert np.abs(np.linalg.eigvals(operator)).max() == pytest.approx(radius, abs=5e-4)


def test_damped_step_of_newmark():
    # gamma 0.6, beta 0.3025, h/T 0.1: eigenvalues of one step of free motion
    gamma, beta, w = 0.6, 0.3025, 2 * math.pi * 0.1
    ahead = np.array([[1 + beta * w**2, 0.0], [gamma * w**2, 1.0]])
    # displacement and h times velocity; the acceleration -w^2 x of either end
    now = np.array([[1 - (0.5 - beta) * w**2, 1.0], [-(1 - gamma) * w**2, 1.0]])
    found = np.log(np.linalg.eigvals(np.linalg.solve(ahead, now))[0])
    angle, decay = abs(found.imag), -found.real
    assert w / angle - 1 == pytest.approx(0.0329459, abs=5e-8)
    assert decay / angle == pytest.approx(0.0295125, abs=5e-8)


@pytest.mark.parametrize(("cells", "printed"), [(40, -1.286e-3), (80, -3.234e-4), (160, -8.116e-5)])
def test_peak_pressure_of_uniform_cells(cells, printed):
    """Cylinder in a bore on a half plane: strips of uniform pressure (Johnson, Eq. 2.30d), an active set."""
    modulus, radius, load = 206e9 / (2 * (1 - 0.3**2)), 0.15, 500e3
    half = math.sqrt(4 * load * radius / (math.pi * modulus))
    width = 4 * half / cells
    x = (np.arange(cells) + 0.5) * width - 2 * half

    def primitive(s):
        return s * np.log(s * s)

    apart = x[:, None] - x
    push = -(primitive(apart + width / 2) - primitive(apart - width / 2)) / (math.pi * modulus)
    push += 100.0 * width / modulus  # any datum: it moves the approach alone
    active = np.ones(cells, bool)
    for _ in range(100):
        A = np.block(
            [
                [push[np.ix_(active, active)], -np.ones((active.sum(), 1))],
                [np.full((1, active.sum()), width), 0],
            ]
        )
        found = np.linalg.solve(A, np.append(-(x[active] ** 2) / (2 * radius), load))
        if found[:-1].min() >= 0:
            break
        active[np.flatnonzero(active)[found[:-1] < 0]] = False
    error = found[:-1].max() / (2 * load / (math.pi * half)) - 1
    assert error == pytest.approx(printed, abs=0.5 * 10.0 ** (math.floor(math.log10(-printed)) - 3))


def quadrilaterals(corners, across, along):
    """Second-order quadrilaterals on the image of the unit square, and the blocks of plane stress."""
    from skfem import MeshQuad, MeshQuad2

    mesh = MeshQuad2.from_mesh(MeshQuad.init_tensor(np.linspace(0, 1, across + 1), np.linspace(0, 1, along + 1)))
    names = {
        "left": lambda x: x[0] == 0,
        "bottom": lambda x: x[1] == 0,
        "right": lambda x: x[0] == 1,
        "top": lambda x: x[1] == 1,
    }
    mesh = mesh.with_boundaries(names)
    return MeshQuad2(np.array(corners(*mesh.doflocs)), mesh.t, _boundaries=mesh.boundaries)


def plane_stress(mesh, youngs, nu, density=0.0):
    from skfem import Basis, BilinearForm, ElementQuad2, ElementVector
    from skfem.helpers import ddot, dot, sym_grad, trace

    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
    mu, lam = youngs / (2 * (1 + nu)), youngs * nu / (1 - nu**2)

    @BilinearForm
    def elastic(u, v, w):
        return lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v))

    mass = BilinearForm(lambda u, v, w: density * dot(u, v)).assemble(basis)
    return basis, elastic.assemble(basis), mass


def test_tapered_membrane():
    """NAFEMS FV32: 10 m long, 5 m to 1 m deep, clamped at the root."""
    from skfem import condense, solve, solver_eigen_scipy_sym

    mesh = quadrilaterals(lambda u, v: (10 * u, (v - 0.5) * (5 - 4 * u)), 64, 32)
    basis, K, M = plane_stress(mesh, 200e9, 0.3, 8000.0)
    values, _ = solve(*condense(K, M, D=basis.get_dofs("left")), solver=solver_eigen_scipy_sym(k=6, sigma=0.0))
    printed = (44.617, 130.010, 162.689, 245.986, 379.718, 391.405)
    np.testing.assert_allclose(np.sqrt(np.sort(values)) / (2 * math.pi), printed, rtol=2e-5)


@pytest.mark.slow
def test_elliptic_membrane():
    """NAFEMS LE1: quarter between ellipses (2, 1) and (3.25, 2.75) m, 10 MPa outwards on the outer one."""
    from skfem import FacetBasis, LinearForm, condense, solve

    def quarter(u, v):
        angle = 0.5 * math.pi * v
        return (2 + 1.25 * u) * np.cos(angle), (1 + 1.75 * u) * np.sin(angle)

    mesh = quadrilaterals(quarter, 48, 64)
    basis, K, _ = plane_stress(mesh, 210e9, 0.3)
    edge = FacetBasis(mesh, basis.elem, facets="right", intorder=6)
    load = LinearForm(lambda v, w: 10e6 * (w.n[0] * v[0] + w.n[1] * v[1])).assemble(edge)
    held = np.concatenate([basis.get_dofs("bottom").all("u^2"), basis.get_dofs("top").all("u^1")])
    u = solve(*condense(K, load, D=held))
    assert 0.5 * load @ u == pytest.approx(6083.736, rel=1e-6)
    at = np.flatnonzero(np.hypot(basis.doflocs[0] - 2.0, basis.doflocs[1]) < 1e-9)
    assert u[at[0]] == pytest.approx(-1.022085e-4, rel=2e-6)
