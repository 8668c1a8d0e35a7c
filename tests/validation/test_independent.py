"""The references that the validation computes by itself: closed forms, conserved motions, printed values."""

import math

import numpy as np
import pytest

from validation import independent
from validation.independent import PLANAR, half_unit, kahraman, lin_parker, sun_forces
from validation.independent_weight import DAMPING_B, Balance, branch, peak_without_wedging, weighed


def test_only_femgear_names_of_its_own():
    # a reference that takes a model of femgear would be none
    for name in ("independent", "independent_weight"):
        path = independent.__file__.replace("independent.py", f"{name}.py")
        with open(path, encoding="utf-8") as file:
            imports = [line for line in file if line.lstrip().startswith(("import femgear", "from femgear"))]
        assert all("validation.independent " in line for line in imports)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_set_alone_in_space_moves_freely(planets):
    net = lin_parker(planets, sun_support=0.0, others=0.0, ring_turn=0.0)
    _, K, _ = net.matrices(PLANAR)
    places = np.array(list(net.places.values()))[:, :2]
    moved = np.zeros((4, planets + 3, 3))
    moved[0, :, 0] = moved[1, :, 1] = 1.0
    moved[2] = np.column_stack([-places[:, 1], places[:, 0], np.ones(planets + 3)])
    # Willis: the carrier stands, base circles roll
    sun, planet = 0.5 * 0.07742, 0.5 * 0.10035
    moved[3, :, 2] = [1.0 / sun, -1.0 / (sun + 2.0 * planet), 0.0] + planets * [-1.0 / planet]
    for motion in moved.reshape(4, -1):
        assert np.abs(K @ motion).max() < 1e-12 * np.abs(K).max() * np.abs(motion).max()


def test_printed_frequencies_of_lin_and_parker():
    found = lin_parker(5).frequencies(PLANAR)
    for printed in (710.0, 1072.0, 1567.4, 1888.1, 2006.1, 14253.1):
        assert np.abs(found - printed).min() < 0.05


def test_printed_frequencies_of_kahraman():
    found = kahraman().frequencies()
    for printed in (3627.0, 7625.0, 9840.0):
        assert np.abs(found - printed).min() < 0.5


def test_torsional_set_has_the_closed_form_of_its_planets():
    found = lin_parker(4).torsional_frequencies()
    planet = math.sqrt(1e9 / 0.61) / (2.0 * math.pi)
    np.testing.assert_allclose(found[2:-1], planet, rtol=1e-9)
    assert found[0] < 1e-3


def test_three_planets_on_a_floating_sun_share_equally():
    forces = sun_forces(lin_parker(3, sun_support=0.0), 100.0, [2e-6, 0.0, -1e-6])
    np.testing.assert_allclose(forces, 100.0 / (3 * 0.5 * 0.07742), rtol=1e-9)


def test_half_units():
    assert half_unit("24.4e6") == pytest.approx(0.05e6)
    assert half_unit("4e9") == pytest.approx(0.5e9)
    assert half_unit("4000") == pytest.approx(0.5)


def test_derivatives_of_the_balance():
    model = weighed(
        independent.wind_turbine_a(flank=-1.0),
        torque=3e5,
        turning=1.0,
        ratios=(0.05,),
        play=1e-4,
        back=independent.wind_turbine_a(),
        bearing=(3.2e9, 2e-5),
    )
    balance, rng = Balance(model, 2, 64), np.random.default_rng(1)
    c, way = 1e-4 * rng.normal(size=(5, len(model.M))), rng.normal(size=(5, len(model.M)))
    _, J, by_omega = balance.residual(c, 200.0)
    ahead, behind = (balance.residual(c + s * 1e-9 * way, 200.0)[0] for s in (1, -1))
    np.testing.assert_allclose((ahead - behind) / 2e-9, J @ way.ravel(), rtol=1e-3, atol=1e-5 * np.abs(J).max())
    ahead, behind = (balance.residual(c, 200.0 + s * 1e-3)[0] for s in (1, -1))
    np.testing.assert_allclose((ahead - behind) / 2e-3, by_omega, rtol=1e-5, atol=1e-6 * np.abs(by_omega).max())


def test_response_of_a_set_that_keeps_contact_is_linear():
    model = weighed(independent.wind_turbine_b(flank=-1.0), torque=1.8e5, turning=1.0, ratios=DAMPING_B, play=5e-4)
    _, c = branch(model, (20.0, 20.1), harmonics=3, most=1)
    omega, drive = 2.0 * math.pi * 20.0, model.play == 0.0
    K = model.K + (model.W[drive].T * model.k[drive]) @ model.W[drive]
    Z = K - omega**2 * np.diag(model.M) + 1j * omega * model.C
    line = np.linalg.solve(Z, model.swing[0] - 1j * model.swing[1])
    x = 3 * model.names.index("carrier")
    assert np.hypot(c[0, 1, x], c[0, 4, x]) == pytest.approx(abs(line[x]), rel=1e-3)


def test_peak_of_the_weight_lies_at_the_damped_mode():
    hertz, size = peak_without_wedging(482e-6)
    # one mode at 40.761 Hz with 5.48 % damping: its displacement peaks at f sqrt(1 - 2 zeta^2)
    assert hertz == pytest.approx(40.761 * math.sqrt(1.0 - 2.0 * 0.0548**2), rel=1e-3)
    assert 800e-6 < size < 950e-6
