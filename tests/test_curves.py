"""Cubic curves against those of SciPy."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from femgear.curves import not_a_knot, parabolas


@pytest.mark.parametrize("count", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("shape", [(), (3,), (2, 2)])
@pytest.mark.parametrize("kind", [float, complex])
def test_splines_are_those_of_scipy(count, shape, kind):
    rng = np.random.default_rng(count)
    x, y = np.cumsum(rng.uniform(0.1, 2.0, count)), rng.standard_normal((count, *shape)).astype(kind)
    y = y + (1j * rng.standard_normal(y.shape) if kind is complex else 0.0)
    at = np.concatenate([np.linspace(x[0] - 0.3, x[-1] + 0.3, 57), x])
    wanted = CubicSpline(x, y)(at)
    np.testing.assert_allclose(not_a_knot(x, y, at), wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize("count", [2, 3, 4, 40])
def test_slopes_are_those_of_parabolas(count):
    rng = np.random.default_rng(count)
    x, y = np.cumsum(rng.uniform(0.1, 2.0, count)), rng.standard_normal((count, 3))
    slopes = np.empty_like(y)
    for i in range(count):
        near = np.unique(np.clip(np.arange(3) + i - 1 + (i == 0) - (i == count - 1), 0, count - 1))
        for k in range(3):
            curve = np.polynomial.Polynomial.fit(x[near], y[near, k], len(near) - 1)
            slopes[i, k] = curve.deriv()(x[i])
    at = np.concatenate([np.linspace(x[0], x[-1], 57), x])
    wanted = CubicHermiteSpline(x, y, slopes, axis=0)(at)
    np.testing.assert_allclose(parabolas(x, y, at), wanted, rtol=0, atol=1e-9 * np.abs(y).max())


def test_parabolas_are_linear_in_the_values():
    x, y = np.array([0.0, 1.0, 1.5, 4.0, 4.2]), np.random.default_rng(1).standard_normal((2, 5))
    at = np.linspace(0.0, 4.2, 13)
    both = 2.0 * parabolas(x, y[0], at) - 3.0 * parabolas(x, y[1], at)
    np.testing.assert_allclose(parabolas(x, 2.0 * y[0] - 3.0 * y[1], at), both, atol=1e-13)


def test_a_cubic_is_met_by_its_spline():
    x = np.array([0.0, 1.0, 1.5, 4.0, 4.2])
    at = np.linspace(-1.0, 5.0, 13)
    np.testing.assert_allclose(not_a_knot(x, x**3 - x, at), at**3 - at, atol=1e-12)
