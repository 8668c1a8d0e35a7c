"""Contact benchmarks: Hertz (NAFEMS roller, Johnson), half plane, springs, planetary load sharing."""

import math

import numpy as np
import pytest

from femgear.contact.solve import solve_contact
from validation.reference.hertz import cell_influence, contact_modulus, hertz_line, relative_radius

STEEL = contact_modulus(206e9, 0.3, 206e9, 0.3)


def test_c1_nafems_roller():
    """NAFEMS advanced contact benchmark 1: roller of 50 mm on a plane, 35 kN on 1 mm."""
    modulus = contact_modulus(210e9, 0.3, 70e9, 0.3)
    assert modulus == pytest.approx(57692.3077e6, rel=1e-9)
    hertz = hertz_line(35e6, 0.05, modulus)
    assert hertz.half_width == pytest.approx(6.2146279e-3, rel=1e-8)
    assert hertz.peak_pressure == pytest.approx(3585.36223e6, rel=1e-9)
    tau, depth = hertz.max_shear()
    assert tau / hertz.peak_pressure == pytest.approx(0.3002831, abs=1e-7)
    assert depth / hertz.half_width == pytest.approx(0.7861514, abs=1e-7)
    assert tau == pytest.approx(1076.61e6, rel=2e-5)
    assert depth == pytest.approx(4.8856e-3, rel=1e-5)


def test_c2_spur_pair_at_the_pitch_point():
    """z = 20/40, m = 2 mm, alpha = 20 deg, 100 N/mm: Hertz with the radii of curvature z m sin(alpha) / 2."""
    radii = [1e-3 * z * np.sin(np.radians(20)) for z in (20, 40)]
    radius = relative_radius(*radii)
    assert radius == pytest.approx(4.5602686e-3, rel=1e-7)
    hertz = hertz_line(100e3, radius, STEEL)
    assert hertz.half_width == pytest.approx(0.07162297e-3, rel=1e-7)
    assert hertz.peak_pressure == pytest.approx(888.848552e6, rel=1e-8)


def test_c3_cylinder_in_a_bore():
    """Cylinder of 50 mm in a bore of 75 mm, 500 N/mm, and its approach with the datum 40 b."""
    radius = relative_radius(0.05, -0.075)
    assert radius == pytest.approx(0.15, rel=1e-14)
    hertz = hertz_line(500e3, radius, STEEL)
    assert hertz.half_width == pytest.approx(0.9185182e-3, rel=1e-7)
    assert hertz.peak_pressure == pytest.approx(346.547167e6, rel=1e-9)
    # 2 P / (pi E*) (ln(2 D / b) + 1/2), with E* = 206 / (2 (1 - 0.3^2)) GPa
    approach = 2 * 500e3 / (math.pi * 206e9 / (2 * 0.91)) * (math.log(80.0) + 0.5)
    assert hertz.approach(40 * hertz.half_width) == pytest.approx(approach, rel=1e-12)


def half_plane_contact(cells):
    """The cylinder of C3 on +-2 b of a half plane, uniform cells, free approach."""
    hertz = hertz_line(500e3, 0.15, STEEL)
    width = 4 * hertz.half_width / cells
    x = (np.arange(cells) + 0.5) * width - 2 * hertz.half_width
    H = cell_influence(x[:, None] - x, width / 2, 40 * hertz.half_width, STEEL)
    gap = x**2 / (2 * hertz.radius)
    return hertz, x, width, H, gap, solve_contact(H, gap, np.ones((cells, 1)), [hertz.line_load])


def test_c4_contact_found_on_a_half_plane():
    """Peak pressure with order 2 and an independent program's errors; pressure in the mean with order 1."""
    published = [-1.286e-3, -3.234e-4, -8.116e-5, -2.034e-5, -5.09e-6, -1.27e-6]
    peak, mean, approach = [], [], []
    for cells in (40, 80, 160, 320, 640, 1280):
        hertz, x, width, H, gap, state = half_plane_contact(cells)
        pressure = state.loads / width
        peak.append(pressure.max() / hertz.peak_pressure - 1)
        difference = pressure - hertz.pressure(x)
        mean.append(np.linalg.norm(difference) / np.linalg.norm(hertz.pressure(x)))
        approach.append(state.motions[0] / hertz.approach(40 * hertz.half_width) - 1)
        assert state.iterations <= 12 and state.method == "active set"
        assert state.loads.sum() == pytest.approx(hertz.line_load, rel=1e-13)
        assert (state.loads >= 0).all() and (state.gaps >= 0).all()
        assert not (state.loads * state.gaps).any()
        np.testing.assert_allclose(gap + H @ state.loads - state.motions[0], state.gaps, atol=1e-15)
    np.testing.assert_allclose(peak, published, rtol=4e-3)
    np.testing.assert_allclose(peak[:4], published[:4], rtol=5e-4)
    orders = np.log2(np.abs(peak[:-1]) / np.abs(peak[1:]))
    assert (np.abs(orders - 2) < 0.03).all()
    np.testing.assert_allclose(np.log2(np.array(mean[:-1]) / mean[1:]), 1, atol=0.05)
    np.testing.assert_allclose(np.log2(np.array(approach[:-1]) / approach[1:]), 2, atol=0.05)
    assert mean[0] < 1.27e-2 and abs(approach[-1]) < 1e-6


@pytest.mark.parametrize(
    ("force", "motion", "second"),
    [(10, 1.0, 0), (20, 2.0, 0), (21, 2.04, 0.6), (50, 3.2, 18.0), (100, 5.2, 48.0)],
)
def test_c6_two_springs_with_a_gap(force, motion, second):
    """Springs of 10 and 15, the second behind a gap of 2: elementary statics."""
    state = solve_contact(np.diag([1 / 10, 1 / 15]), np.array([0.0, 2.0]), np.ones((2, 1)), [force])
    assert state.motions[0] == pytest.approx(motion, rel=1e-14)
    assert state.loads[1] == pytest.approx(second, rel=1e-13, abs=0)
    assert state.loads.sum() == pytest.approx(force, rel=1e-14)


def planetary_springs(n_planets, total, errors, *, pin, sun, supports=0.0):
    """Shares of N planets with tangential pin errors; linear meshes of 5e8 N/m, pressure angle 24.6 deg.

    The pin's compliance belongs to both meshes of its planet; `sun` is the radial compliance of the sun,
    infinite for one that floats, and `supports` that of ring and carrier.
    """
    cosine = np.cos(np.radians(24.6))
    planet = np.tile(np.arange(n_planets), 2)
    sun_side = np.arange(2 * n_planets) < n_planets
    H = np.eye(2 * n_planets) / 5e8 + (planet[:, None] == planet) * cosine**2 / pin
    gap = cosine * np.asarray(errors)[planet]
    G = np.zeros((2 * n_planets, n_planets + 1))
    G[np.arange(2 * n_planets), planet] = np.where(sun_side, -1.0, 1.0)
    G[sun_side, n_planets] = 1.0
    angle = 2 * np.pi * planet / n_planets + 0.4
    lateral = np.column_stack([np.cos(angle), np.sin(angle)]) * sun_side[:, None]
    load = np.append(np.zeros(n_planets), total)
    # one path through sun, planet, ring and carrier: lateral compliances add up, the carrier's with its arm
    H += supports * (1 + 4 * cosine**2) * lateral @ lateral.T
    if np.isinf(sun):
        G, load = np.column_stack([G, lateral]), np.append(load, [0.0, 0.0])
    else:
        H = H + sun * lateral @ lateral.T
    state = solve_contact(H, gap, G, load)
    np.testing.assert_allclose(state.loads[:n_planets], state.loads[n_planets:], rtol=1e-12)
    return state.loads[:n_planets]


@pytest.mark.parametrize("n_planets", [3, 4, 5, 6])
def test_load_sharing_with_pin_errors_and_a_floating_sun(n_planets):
    """F_i = W/N - k_path 2 cos(alpha) res_i, res = e less its fit by {1, cos psi_i, sin psi_i}."""
    errors = np.zeros(n_planets)
    errors[0] = -20e-6
    psi = 2 * np.pi * np.arange(n_planets) / n_planets
    basis = np.column_stack([np.ones(n_planets), np.cos(psi), np.sin(psi)])
    rest = errors - basis @ np.linalg.lstsq(basis, errors, rcond=None)[0]
    cosine = np.cos(np.radians(24.6))
    path = 1 / (2 / 5e8 + 4 * cosine**2 / 1e8)
    force = planetary_springs(n_planets, 20e3, errors, pin=1e8, sun=np.inf)
    np.testing.assert_allclose(force, 20e3 / n_planets - path * 2 * cosine * rest, rtol=1e-9)
    if n_planets == 4:
        np.testing.assert_allclose(force / 20e3, [0.2623, 0.2377, 0.2623, 0.2377], atol=5e-5)


def test_load_sharing_with_pin_errors_and_a_fixed_sun():
    """Printed shares of three planets, pin error -20 um on the first."""
    force = planetary_springs(3, 20e3, [-20e-6, 0, 0], pin=1e8, sun=0.0)
    np.testing.assert_allclose(force / 20e3, [0.366, 0.317, 0.317], atol=5e-4)


@pytest.mark.parametrize(
    ("sun", "expected"),
    [
        (np.inf, [861.1039, 861.1039, 861.1039]),
        (1e-9, [585.99, 998.66, 998.66]),
        (np.inf, [521.39, 770.26, 521.39, 770.26]),
        (1e-9, [326.18, 770.26, 716.60, 770.26]),
    ],
)
def test_f6_static_load_sharing(sun, expected):
    """Lin and Parker's gears under 100 N m, pins of 1e9 N/m, 2 um tangential error on planet 1.

    The printed digits belong to ring and carrier supports of 1e12 N/m; truly rigid ones give 585.79 and
    326.00 N on planet 1 behind the elastic sun, and the same forces behind the floating one.
    """
    n_planets = len(expected)
    errors = np.zeros(n_planets)
    errors[0] = 2e-6
    force = planetary_springs(n_planets, 2583.3118, errors, pin=1e9, sun=sun, supports=1e-12)
    np.testing.assert_allclose(force, expected, rtol=1e-5)
