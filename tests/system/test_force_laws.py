"""Laws of the elements against closed forms and integrals, tangents against differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from femgear.errors import CaseError
from femgear.system.force_laws import (
    GearMeshes,
    PolynomialSprings,
    RadialBearings,
    positive_part,
)
from femgear.system.fourier import FourierSeries, StepSeries, constant, harmonics_of
from femgear.system.system import MeshExcitation, gear_meshes
from validation.reference.cornered_springs import BearingSprings, PiecewiseSprings

RNG = np.random.default_rng(4)
THETA = RNG.uniform(0.0, 6.0, (200, 1))
STIFFNESS = FourierSeries([[2.0, 0.5], [3.0, 0.3j]])

ELEMENTS = {
    "meshes": GearMeshes([0, 2], STIFFNESS, deflection=constant([0.1, 0.0]), backlash=[0.5, np.inf]),
    "loaded meshes": GearMeshes([0, 1], STIFFNESS, force=constant([0.2, 0.4]), backlash=0.3),
    "smooth meshes": GearMeshes([0, 1], STIFFNESS, backlash=0.3, smoothing=0.05),
    "smooth meshes with and without back side": GearMeshes([0, 2], STIFFNESS, backlash=[0.3, np.inf], smoothing=0.05),
    "meshes that hold": GearMeshes([0, 1], STIFFNESS, force=constant([0.2, 0.4]), separates=False),
    "stepped meshes": GearMeshes([0], StepSeries([[1.0, 2.0]], [0.0, 0.4])),
    "bearings": RadialBearings([[0, 1], [2, 3]], [2.0, 3.0], clearance=[0.4, 0.0]),
    "bearings of springs": BearingSprings([[0, 1]], 2.0, clearance=0.3, springs=7),
    "smooth bearings": BearingSprings([[0, 1]], 2.0, clearance=0.3, springs=7, smoothing=0.1),
    "polynomials": PolynomialSprings([0, 1], [[1.0, -0.3, 0.2], [0.0, 0.0, 2.0]]),
    "piecewise": PiecewiseSprings([1], [-0.4, 0.3], [2.0, 0.5, 1.0]),
    "smooth piecewise": PiecewiseSprings([1], [-0.4, 0.3], [2.0, 0.5, 1.0], smoothing=0.1),
}


@pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS.keys())
def test_tangents_are_the_derivatives_of_the_forces(element):
    g, d = element.columns.shape
    x = RNG.uniform(-1.0, 1.0, (200, g, d))
    force, tangent = element.evaluate(x, THETA)
    assert force.shape == (200, g, d) and tangent.shape == (200, g, d, d)
    step = 1e-6
    for j in range(d):
        move = np.zeros(d)
        move[j] = step
        ahead, behind = element.evaluate(x + move, THETA)[0], element.evaluate(x - move, THETA)[0]
        change = (ahead - behind) / (2.0 * step)
        # the instants within a step of a corner have no single tangent
        close = np.abs(change - tangent[..., j]) < 1e-6
        assert close.mean() > 0.99
        assert np.abs(change - tangent[..., j])[close].max() < 1e-6


@pytest.mark.parametrize("element", ELEMENTS.values(), ids=ELEMENTS.keys())
def test_reference_is_one_stiffness_a_column(element):
    assert element.reference.shape == element.columns.shape
    assert np.all(element.reference >= 0.0)


def test_mesh_pushes_hangs_free_and_pushes_back():
    mesh = GearMeshes([0], constant([2.0]), deflection=constant([0.1]), backlash=0.5)
    x = np.array([0.6, 0.1, -0.2, -0.4, -0.9])[:, None, None]
    # teeth touch above 0.1 and, on the back side, below 0.1 - 0.5
    np.testing.assert_allclose(mesh.evaluate(x, np.zeros((5, 1)))[0].ravel(), [1.0, 0, 0, 0, -1.0], atol=1e-14)


def test_loaded_mesh_is_the_tangent_of_its_static_state():
    mesh = GearMeshes([0], constant([2.0]), deflection=constant([0.3]), force=constant([0.4]))
    x = np.array([0.3, 0.5, 0.1, 0.0])[:, None, None]
    np.testing.assert_allclose(mesh.evaluate(x, np.zeros((4, 1)))[0].ravel(), [0.4, 0.8, 0.0, 0.0], atol=1e-15)
    held = replace(mesh, separates=False)
    np.testing.assert_allclose(held.evaluate(x, np.zeros((4, 1)))[0].ravel(), [0.4, 0.8, 0, -0.2], atol=1e-15)


def test_smooth_contact_differs_by_half_the_length_at_the_corner():
    x = np.linspace(-1.0, 1.0, 401)
    smooth, slope = positive_part(x, 0.1)
    sharp, _ = positive_part(x)
    assert np.abs(smooth - sharp).max() == pytest.approx(0.05)
    assert np.all((slope > 0.0) & (slope < 1.0))
    # the difference falls like s^2 / (4 |x|)
    assert np.abs(smooth - sharp)[0] == pytest.approx(0.1**2 / 4.0, rel=0.01)


def test_meshes_of_a_static_record():
    positions = 32
    tau = 2.0 * np.pi * np.arange(positions) / positions
    stiffness = np.array([5.0 + np.cos(tau) + 0.2 * np.sin(3 * tau), 4.0 + 0.5 * np.sin(tau)])
    record = MeshExcitation(stiffness, 1.0 / stiffness, np.ones((2, positions)), np.array([0.0, 0.2]))
    meshes = gear_meshes(record, harmonics=3, orders=(0, 1))
    np.testing.assert_array_equal(meshes.backlash, [np.inf, 0.2])
    np.testing.assert_allclose(meshes.stiffness.amplitudes, harmonics_of(stiffness, 3))
    assert meshes.stiffness.orders == meshes.force.orders == (0, 1)
    x = (1.0 / stiffness).T[:, :, None]
    theta = np.stack([np.zeros(positions), tau], axis=1)
    full = gear_meshes(record, harmonics=15, orders=(0, 1))
    np.testing.assert_allclose(full.evaluate(x, theta)[0][..., 0], 1.0, atol=1e-9)


@pytest.mark.parametrize(("radius", "clearance"), [(0.5, 0.3), (0.31, 0.3), (2.0, 0.3), (1.0, 0.0)])
def test_continuous_bearing_is_the_integral_over_its_arc(radius, clearance):
    """``2 k / pi`` times the one-sided springs over the circumference."""
    bearing = RadialBearings([[0, 1]], 3.0, clearance=clearance)
    angle = 0.7
    x = radius * np.array([[[np.cos(angle), np.sin(angle)]]])
    force = bearing.evaluate(x, np.zeros((1, 1)))[0][0, 0]
    half = np.arccos(clearance / radius)
    wanted = quad(lambda p: (radius * np.cos(p) - clearance) * np.cos(p), -half, half, epsabs=1e-13)[0]
    np.testing.assert_allclose(force, 2.0 * 3.0 / np.pi * wanted * np.array([np.cos(angle), np.sin(angle)]), rtol=1e-9)


def test_bearing_is_free_within_its_clearance_and_linear_without():
    x = np.array([[[0.1, -0.2]]])
    force, tangent = RadialBearings([[0, 1]], 3.0, clearance=0.3).evaluate(x, np.zeros((1, 1)))
    assert not force.any() and not tangent.any()
    for place in (x, 0.0 * x):
        force, tangent = RadialBearings([[0, 1]], 3.0).evaluate(place, np.zeros((1, 1)))
        np.testing.assert_allclose(force, 3.0 * place, atol=1e-14)
        np.testing.assert_allclose(tangent[0, 0], 3.0 * np.eye(2), atol=1e-12)


def test_many_springs_make_the_continuous_bearing():
    x = RNG.uniform(-1.0, 1.0, (50, 1, 2))
    theta = np.zeros((50, 1))
    limit = RadialBearings([[0, 1]], 2.0, clearance=0.3).evaluate(x, theta)[0]
    errors = [
        np.abs(BearingSprings([[0, 1]], 2.0, clearance=0.3, springs=n).evaluate(x, theta)[0] - limit).max()
        for n in (20, 80, 320)
    ]
    assert errors[2] < 1e-4 and errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


def test_polynomial_and_piecewise_laws():
    x = np.linspace(-1.0, 1.0, 21)[:, None, None]
    cubic = PolynomialSprings([0], [[1.0, -0.3, 0.2]]).evaluate(x, None)[0]
    np.testing.assert_allclose(cubic, x - 0.3 * x**2 + 0.2 * x**3, atol=1e-15)
    law = PiecewiseSprings([0], [-0.4, 0.3], [2.0, 0.5, 1.0])
    knots = np.array([-1.0, -0.4, 0.0, 0.3, 1.0])
    wanted = np.interp(x, knots, [-0.2 - 1.2, -0.2, 0.0, 0.15, 0.15 + 0.7])
    np.testing.assert_allclose(law.evaluate(x, None)[0], wanted, atol=1e-14)
    smooth = replace(law, smoothing=0.2)
    assert smooth.evaluate(np.zeros((1, 1, 1)), None)[0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: GearMeshes([0.5], constant([1.0])), "E-SHAPE"),
        (lambda: GearMeshes([-1], constant([1.0])), "E-SHAPE"),
        (lambda: GearMeshes([0, 1], constant([1.0])), "E-SHAPE"),
        (lambda: GearMeshes([0], constant([1.0]), backlash=-1e-6), "E-BACKLASH"),
        (lambda: GearMeshes([0], constant([1.0]), smoothing=-1.0), "E-RANGE"),
        (lambda: RadialBearings([[0, 1]], -1.0), "E-BEARING"),
        (lambda: RadialBearings([[0, 1]], 1.0, clearance=np.nan), "E-BEARING"),
        (lambda: BearingSprings([[0, 1]], 1.0, springs=2), "E-BEARING"),
        (lambda: RadialBearings([[0, 1, 2]], 1.0), "E-SHAPE"),
        (lambda: PolynomialSprings([0], [[1.0], [2.0]]), "E-SHAPE"),
        (lambda: PiecewiseSprings([0], [0.1, 0.0], [1.0, 2.0, 3.0]), "E-SHAPE"),
    ],
)
def test_elements_that_cannot_be_are_refused(make, code):
    with pytest.raises(CaseError) as error:
        make()
    assert error.value.code == code
