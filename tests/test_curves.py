"""Cubic curves against those of SciPy."""

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, CubicSpline

from femgear.curves import makima, not_a_knot


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
@pytest.mark.parametrize("flat", [False, True])
def test_akimas_curves_are_those_of_scipy(count, flat):
    rng = np.random.default_rng(count)
    x, y = np.cumsum(rng.uniform(0.1, 2.0, count)), rng.standard_normal((count, 3))
    if flat:
        y[: count // 2] = 1.0
        y[:, 2] = 0.0
    at = np.concatenate([np.linspace(x[0], x[-1], 57), x])
    wanted = Akima1DInterpolator(x, y, axis=0, method="makima")(at)
    np.testing.assert_allclose(makima(x, y, at), wanted, rtol=0, atol=1e-13 * np.abs(y).max())


def test_a_cubic_is_met_by_its_spline():
    x = np.array([0.0, 1.0, 1.5, 4.0, 4.2])
    at = np.linspace(-1.0, 5.0, 13)
    np.testing.assert_allclose(not_a_knot(x, x**3 - x, at), at**3 - at, atol=1e-12)
