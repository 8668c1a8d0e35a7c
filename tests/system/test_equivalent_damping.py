"""Dampers spring by spring: one spring has the ratio asked for, and the whole matrix is their sum."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set, torsional_set
from published.transmission_errors import (
    equivalent_damping,
    mesh_dampers,
    planar_mesh_dampers,
    support_dampers,
)
from scipy import linalg

from femgear.errors import CaseError
from femgear.system.mesh_directions import gear_set_system


def ratios(M, C, K):
    """Damping ratios of the oscillating modes from the eigenvalues of the first-order form."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values = linalg.eigvals(A)
    values = values[values.imag > 1e-6 * np.abs(values).max()]
    return np.sort(-values.real / np.abs(values))


def test_two_free_gears_have_the_ratio_of_their_mesh():
    k, m1, m2, xi = 3e8, 0.7, 1.9, 0.06
    w = np.array([[1.0], [1.0]])
    c = mesh_dampers(k, m1, m2, xi)
    np.testing.assert_allclose(ratios(np.diag([m1, m2]), c * w @ w.T, k * w @ w.T), [xi], rtol=1e-9)
    assert mesh_dampers(k, m1, np.inf, xi) == pytest.approx(2 * xi * np.sqrt(k * m1))


def test_one_body_has_the_ratio_of_its_support():
    np.testing.assert_allclose(ratios(np.eye(1) * 2.0, support_dampers(8.0, 2.0, 0.1) * np.eye(1), [[8.0]]), [0.1])


def test_supports_alone_damp_the_members_of_a_set():
    # without meshes and planet bearings every member is alone with its supports
    data = replace(lin_parker_set(3), stiffness_sun_planet=1e-6, stiffness_planet_ring=1e-6, planet_bearing=1e-6)
    system = gear_set_system(data)
    C = equivalent_damping(data, mesh_ratio=0.0, support_ratio=0.07)
    K = system.K + (system.W * data.mesh_stiffness) @ system.W.T
    found = ratios(system.M, C, K)
    # carrier, ring and sun in x and y, the ring in torsion
    np.testing.assert_allclose(found, np.full(7, 0.07), rtol=1e-4)


def test_whole_matrix_is_the_sum_of_its_dampers():
    data, rng = lin_parker_set(3), np.random.default_rng(4)
    C = equivalent_damping(data, mesh_ratio=0.05, support_ratio=0.02)
    assert np.abs(C - C.T).max() < 1e-12 * np.abs(C).max() and np.linalg.eigvalsh(C).min() > -1e-9 * np.abs(C).max()
    velocity, system = rng.standard_normal(len(C)), gear_set_system(data)
    turning = {
        name: body.inertia / radius**2
        for name, body, radius in (
            ("sun", data.sun, data.sun_radius),
            ("ring", data.ring, data.ring_radius),
            ("planet", data.planet, data.planet_radius),
        )
    }
    power, rates = 0.0, system.W.T @ velocity
    for mesh, rate in enumerate(rates):
        one, two = turning["sun" if mesh < 3 else "ring"], turning["planet"]
        power += 2 * 0.05 * np.sqrt(5e8 * one * two / (one + two)) * rate**2
    for first, name in ((0, "carrier"), (3, "ring"), (6, "sun")):
        body = getattr(data, name)
        power += 2 * 0.02 * np.sqrt(1e8 * body.mass) * np.sum(velocity[first : first + 2] ** 2)
    ring = data.ring
    power += 2 * 0.02 * np.sqrt(ring.torsional_support * ring.inertia) * (velocity[5] / data.ring_radius) ** 2
    for n, psi in enumerate(data.planet_angles):
        x, y, u = velocity[:3]
        radial = velocity[9 + 3 * n] - (x * np.cos(psi) + y * np.sin(psi))
        tangential = velocity[10 + 3 * n] - (-x * np.sin(psi) + y * np.cos(psi) + u)
        power += 2 * 0.02 * np.sqrt(1e8 * data.planet.mass) * (radial**2 + tangential**2)
    assert velocity @ C @ velocity == pytest.approx(power, rel=1e-12)


def test_held_members_have_no_dampers():
    data = torsional_set(lin_parker_set(3))
    C = equivalent_damping(data, mesh_ratio=0.05, support_ratio=0.02)
    assert C.shape == gear_set_system(data).M.shape
    fixed = replace(data, ring=replace(data.ring, torsional_support=np.inf))
    dampers = planar_mesh_dampers(fixed, 0.05)[3:]
    planet = data.planet.inertia / data.planet_radius**2
    np.testing.assert_allclose(dampers, 2 * 0.05 * np.sqrt(5e8 * planet))


@pytest.mark.parametrize("values", [(-1.0, 1, 1, 0.1), (1, 0.0, 1, 0.1), (1, 1, 1, -0.1), (1, np.inf, np.inf, 0)])
def test_wrong_springs_are_refused(values):
    with pytest.raises(CaseError, match="E-DAMPING"):
        mesh_dampers(*values)
    if values[3] < 0:
        with pytest.raises(CaseError, match="E-DAMPING"):
            support_dampers(1.0, 1.0, values[3])


@pytest.mark.parametrize(
    "options",
    [
        {"mesh_ratio": 0.05, "support_ratio": 0.03, "flank": 2},
        {"mesh_ratio": [0.05, 0.05], "support_ratio": 0.03},
        {"mesh_ratio": "a", "support_ratio": 0.03},
        {"mesh_ratio": 0.05, "support_ratio": [0.03, 0.03]},
    ],
)
def test_ratios_and_flanks_that_do_not_fit_are_refused(options):
    with pytest.raises(CaseError, match="E-DAMPING"):
        equivalent_damping(lin_parker_set(3), **options)
