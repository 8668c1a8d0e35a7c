"""Parametric stability against classical results: Mathieu, Meissner, rectangular mesh stiffness."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.stability.floquet import monodromy
from femgear.solvers.stability.parametric import stability
from femgear.system.system import MechanicalSystem, MeshExcitation

# Gauss nodes of the fourth-order Magnus integrator (Iserles et al., Acta Numerica 9, 2000, Eq. 5.6)
GAUSS = 0.5 + np.array([-1.0, 1.0]) * np.sqrt(3) / 6


def mathieu_matrix(a, q, damping=0.0, steps=600):
    """Transition over pi of x'' + c x' + (a - 2 q cos 2t) x = 0 as constant Magnus pieces."""
    dt = np.pi / steps
    t = (np.arange(steps)[:, None] + GAUSS) * dt
    pieces = np.zeros((steps, 2, 2, 2))
    pieces[..., 0, 1], pieces[..., 1, 1] = 1.0, -damping
    pieces[..., 1, 0] = -(a - 2 * q * np.cos(2 * t))
    first, second = pieces[:, 0], pieces[:, 1]
    magnus = 0.5 * (first + second) + np.sqrt(3) / 12 * dt * (second @ first - first @ second)
    return monodromy(magnus, np.full(steps, dt))


@pytest.mark.parametrize(
    ("q", "value", "trace"),
    [
        (1.0, -0.4551386041, 2.0),
        (1.0, 1.8591080725, -2.0),
        (1.0, 4.3713009827, 2.0),
        (1.0, -0.1102488170, -2.0),
        (1.0, 3.9170247730, 2.0),
        (5.0, -5.8000460209, 2.0),
        (5.0, 1.8581875415, -2.0),
        (5.0, -5.7900805986, -2.0),
        (5.0, 2.0994604455, 2.0),
    ],
)
def test_mathieu_characteristic_values(q, value, trace):
    """Abramowitz and Stegun 20; the digits also from scipy.special."""
    known = [mathieu_a(n, q) for n in range(3)] + [mathieu_b(n, q) for n in (1, 2)]
    assert min(abs(np.array(known) - value)) < 1e-9
    assert np.trace(mathieu_matrix(value, q)) == pytest.approx(trace, abs=1e-6)


def test_mathieu_multipliers():
    values = np.sort(np.linalg.eigvals(mathieu_matrix(1.0, 1.0)).real)
    np.testing.assert_allclose(values, [-4.15605494, -0.2406128], rtol=1e-7)
    assert np.abs(np.linalg.eigvals(mathieu_matrix(2.5, 1.0))).max() == pytest.approx(1.0, abs=1e-10)
    assert np.linalg.det(mathieu_matrix(1.0, 1.0, damping=0.3)) == pytest.approx(np.exp(-0.3 * np.pi), rel=1e-10)


@pytest.mark.parametrize(("damping", "threshold"), [(0.1, 0.1000546711), (0.2, 0.2004369763)])
def test_damped_mathieu_threshold(damping, threshold):
    def excess(q):
        return np.abs(np.linalg.eigvals(mathieu_matrix(1.0, q, damping, steps=200))).max() - 1.0

    assert brentq(excess, 0.5 * damping, 2 * damping, xtol=1e-12) == pytest.approx(threshold, rel=1e-8)


def meissner(d, e):
    """Transition over 2 pi of x'' + (d + e sgn cos t) x = 0."""
    stiff, soft = (np.array([[0.0, 1.0], [-(d + s * e), 0.0]]) for s in (1, -1))
    return monodromy([stiff, soft, stiff], [np.pi / 2, np.pi, np.pi / 2])


@pytest.mark.parametrize(
    ("d", "e", "trace"), [(0.25, 0.1, -2.15946099), (1.0, 0.3, 2.01491540), (0.5, 0.2, -0.79900962)]
)
def test_meissner_trace(d, e, trace):
    w = np.sqrt([d + e, d - e])
    closed = 2 * np.cos(np.pi * w).prod() - (w[0] / w[1] + w[1] / w[0]) * np.sin(np.pi * w).prod()
    assert np.trace(meissner(d, e)) == pytest.approx(closed, abs=1e-12)
    assert closed == pytest.approx(trace, abs=1e-8)


@pytest.mark.parametrize(("d", "trace"), [(0.3678177281, -2.0), (0.9900288140, 2.0), (1.0290305698, 2.0)])
def test_meissner_boundaries(d, trace):
    assert np.trace(meissner(d, 0.2)) == pytest.approx(trace, abs=2e-9)


# Rectangular mesh stiffness of contact ratio 1.635: 1 with two pairs in contact, 0.65 with one; unit mass.
SHARE, LOW = 0.635, 0.65
NATURAL = np.sqrt(SHARE + (1 - SHARE) * LOW)


def rectangular_multiplier(ratio, decay):
    """Largest modulus for mesh frequency over mean natural frequency and zeta omega_n."""
    period = 2 * np.pi / (ratio * NATURAL)
    pieces = [np.array([[0.0, 1.0], [-k, -2 * decay]]) for k in (1.0, LOW)]
    return np.abs(np.linalg.eigvals(monodromy(pieces, [SHARE * period, (1 - SHARE) * period]))).max()


@pytest.mark.parametrize(
    ("low", "high"), [(1.884253, 2.113835), (0.964393, 1.026547), (0.660884, 0.665614), (0.491420, 0.504073)]
)
def test_rectangular_stiffness_unstable_bands(low, high):
    for edge, inward in ((low, 1), (high, -1)):
        assert rectangular_multiplier(edge + inward * 2e-6, 0.0) > 1 + 1e-5
        assert rectangular_multiplier(edge - inward * 2e-6, 0.0) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("ratio", "decay", "value"),
    [
        (2, 0.02, 1.1198031),
        (1, 0.02, 1.0608524),
        (0.5, 0.02, 0.8858646),
        (2, 0.05, 1.0124401),
        (1, 0.05, 0.8660985),
    ],
)
def test_rectangular_stiffness_multipliers(ratio, decay, value):
    assert rectangular_multiplier(ratio, decay) == pytest.approx(value, abs=1e-7)


def rectangular_case(damping_ratio, positions=2000):
    """Modes and excitation of the same oscillator, its stiffness sampled."""
    one = np.ones((1, 1))
    stiffness = np.where((np.arange(positions) + 0.5) / positions < SHARE, 1.0, LOW)[None]
    system = MechanicalSystem(one, 0 * one, 0 * one, one, np.ones(1), ("x",))
    modes = undamped_modes(system, [NATURAL**2], damping_ratio=damping_ratio)
    return modes, MeshExcitation(stiffness, 1 / stiffness, np.ones_like(stiffness), np.zeros(1))


def test_rectangular_stiffness_fixed_point_radius():
    """The fixed point contracts (.096) where the oscillator is unstable (1.090)."""
    modes, excitation = rectangular_case(0.03)
    frequency = np.array([2.0, 1.0, 0.5]) * NATURAL / (2 * np.pi)
    response = solve_spectral(modes, excitation, frequency, excitation_harmonics=40, response_harmonics=80)
    np.testing.assert_allclose(response.spectral_radius, [0.096, 1.022, 0.579], atol=5e-4)
    assert response.method == ("fixed point", "direct", "fixed point") and np.all(response.converged)
    multiplier = stability(modes, excitation, frequency, excitation_harmonics=40).modulus
    np.testing.assert_allclose(multiplier[:2], [1.090, 1.005], atol=5e-4)
    exact = [rectangular_multiplier(ratio, 0.03 * NATURAL) for ratio in (2, 1, 0.5)]
    np.testing.assert_allclose(multiplier, exact, atol=1e-4)
