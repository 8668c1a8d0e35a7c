"""Exact annulus frequencies against the Bessel determinant and its limits."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv, jvp, yv, yvp

from femgear.errors import GeometryError
from femgear.fe.elasticity import Material
from validation.reference.annulus import annulus_frequencies

STEEL = Material(200e9, 0.3, 8000.0)


def bessel_determinant(frequency, inner, outer, material, n, state):
    """Free edges of u = grad(phi) + curl(psi), phi ~ cos(n t), psi ~ sin(n t): stresses rr and r-theta."""
    lam, mu = material.lame(state)
    w = 2 * np.pi * frequency
    p, s = w * np.sqrt(material.density / (lam + 2 * mu)), w * np.sqrt(material.density / mu)
    rows = []
    for r in (inner, outer):
        rr, rt = [], []
        for f, fp in ((jv, jvp), (yv, yvp)):
            # phi: e_r = f'', and the Laplacian is -p^2 f
            rr.append(-lam * p**2 * f(n, p * r) + 2 * mu * p**2 * fp(n, p * r, 2))
            rt.append(2 * mu * (-n * p * fp(n, p * r) / r + n * f(n, p * r) / r**2))
        for f, fp in ((jv, jvp), (yv, yvp)):
            rr.append(2 * mu * (n * s * fp(n, s * r) / r - n * f(n, s * r) / r**2))
            rt.append(mu * (-(s**2) * fp(n, s * r, 2) + s * fp(n, s * r) / r - n**2 * f(n, s * r) / r**2))
        rows += [rr, rt]
    rows = np.array(rows)
    return np.linalg.det(rows / np.abs(rows).max(axis=0))


@pytest.mark.parametrize("state", ["plane stress", "plane strain"])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 7])
def test_frequencies_are_zeros_of_the_bessel_determinant(n, state):
    inner, outer = 1.8, 6.0
    for f in annulus_frequencies(inner, outer, STEEL, nodal_diameters=[n], count=4, state=state)[0]:
        exact = brentq(bessel_determinant, f * 0.9999, f * 1.0001, args=(inner, outer, STEEL, n, state), xtol=1e-12 * f)
        assert f == pytest.approx(exact, rel=1e-9)


@pytest.mark.slow
def test_no_zero_is_missed():
    inner, outer = 1.8, 6.0
    f = np.linspace(50, 700, 4000)
    for n in (1, 2, 3):
        value = [bessel_determinant(x, inner, outer, STEEL, n, "plane stress") for x in f]
        zeros = np.count_nonzero(np.diff(np.sign(value)))
        ours = annulus_frequencies(inner, outer, STEEL, nodal_diameters=[n], count=8)[0]
        assert np.count_nonzero(ours < 700) == zeros


def test_units_and_scale():
    ratio = annulus_frequencies(0.9, 3.0, STEEL, nodal_diameters=[0, 2, 5], count=2)
    np.testing.assert_allclose(
        ratio, 2 * annulus_frequencies(1.8, 6.0, STEEL, nodal_diameters=[0, 2, 5], count=2), rtol=1e-12
    )


@pytest.mark.parametrize("inner, outer", [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (1.0, np.inf), (np.nan, 1.0)])
def test_impossible_radii(inner, outer):
    with pytest.raises(GeometryError):
        annulus_frequencies(inner, outer, STEEL, nodal_diameters=[2])


def test_impossible_counts():
    with pytest.raises(GeometryError):
        annulus_frequencies(1.0, 2.0, STEEL, nodal_diameters=[-1])
    with pytest.raises(GeometryError):
        annulus_frequencies(1.0, 2.0, STEEL, nodal_diameters=[2], count=0)


@pytest.mark.slow
def test_small_hole_approaches_the_solid_disc():
    """Fundamental n = 2 of a solid disc, plane stress, from the 2 x 2 Bessel determinant without Y."""

    def solid(frequency):
        lam, mu = STEEL.lame("plane stress")
        w = 2 * np.pi * frequency
        p, s = w * np.sqrt(STEEL.density / (lam + 2 * mu)), w * np.sqrt(STEEL.density / mu)
        n = 2
        a = [-lam * p**2 * jv(n, p) + 2 * mu * p**2 * jvp(n, p, 2), 2 * mu * n * (-p * jvp(n, p) + jv(n, p))]
        b = [
            2 * mu * n * (s * jvp(n, s) - jv(n, s)),
            mu * (-(s**2) * jvp(n, s, 2) + s * jvp(n, s) - n**2 * jv(n, s)),
        ]
        return a[0] * b[1] - a[1] * b[0]

    f = annulus_frequencies(1e-3, 1.0, STEEL, nodal_diameters=[2])[0, 0]
    assert f == pytest.approx(brentq(solid, 0.9 * f, 1.1 * f), rel=1e-4)
