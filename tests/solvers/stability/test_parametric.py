from dataclasses import replace

import numpy as np
import pytest
from scipy.special import mathieu_a, mathieu_b

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.stability import parametric
from femgear.solvers.stability.parametric import stability, stability_chart
from femgear.system.fourier import FourierSeries, StepSeries
from femgear.system.system import MechanicalSystem, NonlinearSystem
from validation.parametric import NATURAL, RATIO, SOFT, rectangular_monodromy
from validation.reference.stability_boundary import stability_boundary

ONE = np.ones((1, 1))
RECTANGLE = StepSeries([[1.0, SOFT]], [0.0, RATIO])


def mass(damping=0.0):
    return NonlinearSystem(MechanicalSystem(ONE, damping * ONE, 0.0 * ONE, ONE, np.zeros(1), ("x",)), ())


@pytest.mark.parametrize(
    "between, value", [((2.0, 4.0), mathieu_b), ((1.3, 2.0), mathieu_a)], ids=["b1 side", "a1 side"]
)
def test_boundaries_of_mathieu_without_damping(between, value):
    # x'' + (1 - 0.6 cos w t) x = 0 is Mathieu's equation with a = 4 / w^2, q = 1.2 / w^2
    w = stability_boundary(mass(), FourierSeries([[1.0, -0.6]]), between, depth=1.0)
    assert 4.0 / w**2 == pytest.approx(value(1, 1.2 / w**2), rel=1e-10)


@pytest.mark.parametrize("damping, threshold", [(0.1, 0.1000546711), (0.2, 0.2004369763)])
def test_damped_thresholds_over_the_depth(damping, threshold):
    found = stability_boundary(mass(damping), FourierSeries([[1.0, -2.0]]), (0.02, 0.4), frequency=2.0)
    assert found == pytest.approx(threshold, abs=1e-10)


@pytest.mark.parametrize(
    "low, inside, high",
    [
        (1.884253, 2.0, 2.113835),
        (0.964393, 1.0, 1.026547),
        (0.660884, 0.6632, 0.665614),
        (0.491420, 0.498, 0.504073),
    ],
)
def test_bands_of_the_rectangular_stiffness(low, inside, high):
    for printed in (low, high):
        outside = printed + 0.004 * np.sign(printed - inside)
        found = stability_boundary(mass(), RECTANGLE, (outside * NATURAL, inside * NATURAL), depth=1.0)
        assert found / NATURAL == pytest.approx(printed, abs=5e-7)


def test_chart_of_the_rectangular_stiffness_equals_exponentials():
    decay, ratio = 0.02, np.array([0.5, 1.0, 1.7, 2.0])
    chart = stability_chart(mass(2 * decay), RECTANGLE, ratio * NATURAL, [0.0, 1.0])
    exact = [np.abs(np.linalg.eigvals(rectangular_monodromy(r, decay))).max() for r in ratio]
    np.testing.assert_allclose(np.abs(chart.multiplier[:, 1]), exact, rtol=1e-9)
    np.testing.assert_allclose(
        np.abs(chart.multiplier[:, 0]), np.exp(-decay * 2 * np.pi / (ratio * NATURAL)), rtol=1e-9
    )
    assert chart.loss[:, 1].tolist() == ["", "fold", "", "flip"]
    assert not np.any(chart.loss[:, 0] != "") and chart.stable[:, 0].all()
    assert chart.stable[:, 1].tolist() == [True, False, True, False]
    assert chart.error.max() < 1e-8


def test_chart_of_a_modal_basis_equals_the_linear_solver(geared_chain, chain_excitation):
    excitation = chain_excitation(0.6)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.005)
    frequency = np.array([0.2, 2 * modes.frequency[3], modes.frequency[2] + modes.frequency[3]])
    chart = stability_chart(modes, excitation, 2 * np.pi * frequency, [0.5, 1.0])
    for column, depth in enumerate((0.3, 0.6)):
        expected = stability(modes, chain_excitation(depth), frequency, frequency_ratio=1e3, steps=400).modulus
        np.testing.assert_allclose(np.abs(chart.multiplier[:, column]), expected, rtol=1e-7)


def test_modes_left_out_keep_their_own_decay(geared_chain, chain_excitation):
    """Constant stiffness: the largest multiplier is exp(-zeta omega T) of the slowest decay."""
    excitation = chain_excitation(0.0)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.1)
    frequency = 1.5 * modes.frequency[1] * np.array([1.0, 1.01])
    natural = 2 * np.pi * modes.frequency
    options = {"frequency_ratio": 1.0, "excitation_harmonics": 1}
    for ratio in ([0.1, 0.1, 1e-3, 1e-2], [0.1, 0.1, 1e-2, 1e-3], [1e-3, 0.1, 0.1, 0.1]):
        damped = replace(modes, damping_ratio=np.array(ratio))
        found = stability(damped, excitation, frequency, **options)
        assert found.modes_kept.tolist() == [2, 2]
        exact = np.exp(-np.min(natural * ratio) / frequency)
        np.testing.assert_allclose(found.modulus, exact, rtol=1e-9)


@pytest.mark.parametrize("slowest", [0, 2], ids=["first", "third"])
def test_a_mode_that_deflects_no_mesh_keeps_its_own_motion(geared_chain, chain_excitation, slowest):
    """As a gear on equal bearings that moves across the line of action: exp((-zeta omega + i omega_d) T)."""
    excitation = chain_excitation(0.02)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.1)
    ratio, deflection = modes.damping_ratio.copy(), modes.mesh_deflection.copy()
    chosen = np.flatnonzero(modes.frequency > 0.0)[slowest]
    ratio[chosen], deflection[:, chosen] = 1e-3, 0.0
    frequency = modes.frequency.max() * np.array([1.0, 1.3])
    found = stability(replace(modes, damping_ratio=ratio, mesh_deflection=deflection), excitation, frequency)
    root = 2.0 * np.pi * modes.frequency[chosen] * (-1e-3 + 1j * np.sqrt(1.0 - 1e-6))
    np.testing.assert_allclose(found.multiplier, np.exp(root / frequency), rtol=1e-12)


def test_slow_speeds_of_a_batch_get_the_steps_that_they_need(geared_chain, chain_excitation):
    excitation = chain_excitation(0.6)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.005)
    frequency = np.array([0.01, 0.5])
    found = stability(modes, excitation, frequency, excitation_harmonics=3, frequency_ratio=1e3)
    assert found.steps[0] == found.steps[1] >= 2 * np.pi * modes.frequency.max() / 0.01
    exact = np.abs(stability_chart(modes, excitation, 2 * np.pi * frequency, [1.0]).multiplier[:, 0])
    np.testing.assert_allclose(found.modulus, exact, rtol=1e-3)


def test_refusals():
    wave = FourierSeries([[1.0, -0.6]])
    with pytest.raises(CaseError, match="E-RANGE"):
        stability_chart(mass(), wave, [0.0], [1.0])
    with pytest.raises(CaseError, match="E-SHAPE"):
        stability_chart(mass(), FourierSeries([[1.0], [1.0]]), [1.0], [1.0])
    with pytest.raises(CaseError, match="exactly one"):
        stability_boundary(mass(), wave, (1.0, 2.0))
    with pytest.raises(CaseError, match="one end stable"):
        stability_boundary(mass(0.1), wave, (5.0, 6.0), depth=0.1)


@pytest.mark.parametrize("bad", [0, 3])
def test_one_cell_of_a_chart_that_is_wrong_refuses_all(bad, monkeypatch):
    right = parametric.passage

    def passage(*given, **options):
        matrix, error = right(*given, **options)
        error[bad] = 2e3 * options["tolerance"]
        return matrix, error

    wave = FourierSeries([[1.0, -0.6]])
    stability_chart(mass(0.1), wave, [1.0, 3.0], [0.5, 1.0])
    monkeypatch.setattr(parametric, "passage", passage)
    with pytest.raises(ConvergenceError, match="the monodromy matrix has an error of"):
        stability_chart(mass(0.1), wave, [1.0, 3.0], [0.5, 1.0])
