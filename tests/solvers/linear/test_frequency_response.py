"""Frequency response: two routes against each other and closed forms; damping read from it."""

import time
from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import complex_modes, undamped_modes
from femgear.solvers.linear.receptance import modal_response
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.system import MechanicalSystem
from validation.reference.frequency_response import (
    complex_modal_response,
    direct_response,
    mesh_error_response,
    resonance_peaks,
    unit_force,
)

NO_MESH = np.zeros(0)


def single(m=2.0, k=3200.0, zeta=0.04):
    c = 2 * zeta * np.sqrt(k * m)
    one = np.ones((1, 1))
    return MechanicalSystem(m * one, c * one, k * one, np.zeros((1, 0)), np.zeros(1), ("x",))


def chain_with_damping(chain, k, C=None, G=None):
    return replace(chain, C=np.zeros((4, 4)) if C is None else C, gyroscopic=G), np.asarray(k)


def difference(a, b):
    """Largest error of each frequency relative to its largest entry."""
    return (np.abs(a - b).max(axis=(1, 2)) / np.abs(b).max(axis=(1, 2))).max()


def test_single_mass_in_closed_form():
    f = np.linspace(0.0, 20.0, 201)
    w = 2 * np.pi * f
    expected = 1.0 / (3200.0 - 2.0 * w**2 + 1j * w * 2 * 0.04 * 80.0)
    found = direct_response(single(), f, np.ones(1), np.ones((1, 1)), mesh_stiffness=NO_MESH)
    assert found.shape == (201, 1, 1)
    assert found[:, 0, 0] == pytest.approx(expected, rel=1e-12)


def test_superposition_agrees_with_the_direct_solution(geared_chain):
    k, f = np.array([1.0, 1.4]), np.linspace(0.0, 0.6, 400)
    modes = undamped_modes(geared_chain, k, damping_ratio=np.array([0.01, 0.02, 0.03, 0.05]))
    inputs = np.column_stack([geared_chain.W, unit_force(geared_chain, "a", "d")])
    outputs = np.vstack([np.eye(4), geared_chain.W.T])
    direct = direct_response(geared_chain, f, inputs, outputs, mesh_stiffness=k, damping_ratio=modes.damping_ratio)
    assert difference(modal_response(geared_chain, modes, f, inputs, outputs), direct) < 1e-10


def test_complex_modes_agree_with_the_direct_solution(geared_chain):
    draw = np.random.default_rng(3).normal(size=(4, 4))
    system, k = chain_with_damping(geared_chain, [1.0, 1.4], 0.02 * draw @ draw.T, draw - draw.T)
    f, outputs = np.linspace(0.0, 0.6, 300), np.eye(4)
    direct = direct_response(system, f, np.eye(4), outputs, mesh_stiffness=k, speed=0.3)
    modal = complex_modal_response(complex_modes(system, k, speed=0.3), f, np.eye(4), outputs)
    assert difference(modal, direct) < 1e-10
    # reciprocity: transposing reverses the rotation
    back = direct_response(system, f, np.eye(4), outputs, mesh_stiffness=k, speed=-0.3)
    assert difference(np.swapaxes(back, 1, 2), direct) < 1e-12


def test_planar_set_by_both_routes_in_time():
    """18 coordinates with a rigid rotation, 2000 frequencies, all six meshes as inputs and outputs."""
    data = lin_parker_set(3)
    system, k = gear_set_system(data), data.mesh_stiffness
    modes = undamped_modes(system, k, damping_ratio=0.02)
    f = np.linspace(20.0, 12000.0, 2000)
    began = time.perf_counter()
    modal = modal_response(system, modes, f, system.W, system.W.T)
    spent = time.perf_counter() - began
    direct = direct_response(system, f, system.W, system.W.T, mesh_stiffness=k, damping_ratio=0.02)
    assert difference(modal, direct) < 1e-10
    # alone on a core it takes 2 ms; the bound leaves room for a busy machine
    assert spent < 0.2


def test_turning_planar_set_with_damping_by_complex_modes():
    data, speed = lin_parker_set(3), 150.0
    system, k = gear_set_system(data, carrier_speed=speed), data.mesh_stiffness
    system = replace(system, C=2e-6 * system.K + 40.0 * system.M)
    # rounding of the stiff springs blurs the slow pair at 10 Hz by 1e-16 (12000 / 10)^2
    f = np.linspace(200.0, 12000.0, 500)
    direct = direct_response(system, f, system.W, np.eye(18), mesh_stiffness=k, speed=speed)
    modal = complex_modal_response(complex_modes(system, k, speed=speed), f, system.W, np.eye(18))
    assert difference(modal, direct) < 1e-10


def test_modes_left_out_leave_their_static_flexibility():
    data = lin_parker_set(3)
    system, k = gear_set_system(data), data.mesh_stiffness
    f = np.array([50.0, 200.0])
    exact = direct_response(system, f, system.W, system.W.T, mesh_stiffness=k, damping_ratio=0.02)
    few = undamped_modes(system, k, damping_ratio=0.02, count=8)
    with_rest = modal_response(system, few, f, system.W, system.W.T)
    assert difference(with_rest, exact) < 0.02
    # the error of the static rest grows with the square of the frequency
    errors = [np.abs(with_rest[i] - exact[i]).max() for i in range(2)]
    assert errors[1] < 20 * errors[0] and errors[0] < 1e-3 * np.abs(exact[0]).max()


def test_slow_mesh_errors_are_followed_without_force_by_a_free_set():
    """At low frequency a free sun follows the errors of an alike set: W^T q = e, no force."""
    data = lin_parker_set(3)
    system, k = gear_set_system(data), data.mesh_stiffness
    error = np.ones((6, 1)) * 1e-6
    found = mesh_error_response(system, [0.01], error, mesh_stiffness=k)
    assert found.deflection[0, 0] == pytest.approx(error[:, 0], rel=1e-6)
    assert np.abs(found.force).max() < 1e-6 * k[0] * 1e-6


def test_mesh_error_response_is_the_solution_of_the_equations(geared_chain):
    system, k = chain_with_damping(geared_chain, [1.0, 1.4], 0.03 * np.eye(4))
    draw = np.random.default_rng(5)
    error = draw.normal(size=(2, 3)) + 1j * draw.normal(size=(2, 3))
    found = mesh_error_response(system, [0.07, 0.11], error, mesh_stiffness=k, harmonics=[1, 2, 5], outputs=np.eye(4))
    assert found.output.shape == (2, 3, 4)
    for i, f in enumerate((0.07, 0.11)):
        for j, h in enumerate((1, 2, 5)):
            w, q = 2 * np.pi * f * h, found.output[i, j]
            assert found.deflection[i, j] == pytest.approx(system.W.T @ q, rel=1e-12)
            rest = -(w**2) * system.M @ q + 1j * w * system.C @ q + system.K @ q + system.W @ found.force[i, j]
            assert np.abs(rest).max() < 1e-12
            assert found.force[i, j] == pytest.approx(k * (system.W.T @ q - error[:, j]), rel=1e-12)


@pytest.mark.parametrize("harmonic, kind", [(4, "rotational"), (1, "translational"), (2, "planet")])
def test_planet_phasing_selects_the_kind_of_mode(harmonic, kind):
    """R. G. Parker, J. Sound Vib. 236, 2000: with N = 4, h z_s mod 4 = 0, +-1 or 2 chooses the kind."""
    data = lin_parker_set(4)
    system, k, N = gear_set_system(data), data.mesh_stiffness, 4
    modes = gear_set_modes(data, damping_ratio=0.05)
    wave = np.exp(-1j * harmonic * data.planet_angles)
    error = np.concatenate([wave, 0.6 * wave * np.exp(0.4j)])[:, None] * 1e-6
    f = np.linspace(500.0, 9000.0, 40)
    found = mesh_error_response(
        system, f, error, mesh_stiffness=k, damping_ratio=0.05, outputs=modes.shape.T @ system.M
    )
    size = np.abs(found.output[:, 0]).max(axis=0)
    kinds = np.array(modes.kind)
    assert N == data.n_planets
    allowed = (kinds == kind) | ((kinds == "rigid") & (kind == "rotational"))
    assert size[~allowed].max() < 1e-9 * size[allowed].max()
    assert np.count_nonzero(size > 1e-3 * size.max()) >= 3


def test_undamped_resonance_is_refused():
    system = single(zeta=0.0)
    modes = undamped_modes(system, NO_MESH, damping_ratio=0.0)
    with pytest.raises(ConvergenceError, match="E-RESONANCE"):
        modal_response(system, modes, modes.frequency, np.ones(1), np.ones((1, 1)))
    data = lin_parker_set(3)
    free = gear_set_system(data)
    with pytest.raises(ConvergenceError, match="E-RESONANCE"):
        modes = undamped_modes(free, data.mesh_stiffness, damping_ratio=0.02)
        modal_response(free, modes, [0.0], np.eye(18), np.eye(18))


def test_wrong_arguments_are_refused(geared_chain):
    k = np.ones(2)
    for call in (
        lambda: direct_response(geared_chain, [1.0], np.ones(3), np.eye(4), mesh_stiffness=k),
        lambda: mesh_error_response(geared_chain, [1.0], np.ones((3, 1)), mesh_stiffness=k),
    ):
        with pytest.raises(CaseError, match="E-SHAPE"):
            call()
    with pytest.raises(CaseError, match="E-RANGE"):
        direct_response(geared_chain, [-1.0], np.ones(4), np.eye(4), mesh_stiffness=k)
    with pytest.raises(CaseError, match=r"E-CHOICE.*\n.*a, b, c, d"):
        unit_force(geared_chain, "e")


@pytest.mark.parametrize("zeta", [0.003, 0.02, 0.2, 0.35])
def test_peak_of_a_single_mode_is_exact(zeta):
    natural = 40.0 / (2 * np.pi)
    f = np.linspace(0.05 * natural, 2.5 * natural, 4001)
    found = direct_response(single(zeta=zeta), f, np.ones(1), np.ones((1, 1)), mesh_stiffness=NO_MESH)
    (peak,) = resonance_peaks(f, found[:, 0, 0])
    assert peak.verdict == "separate"
    assert peak.damping_ratio == pytest.approx(zeta, rel=1e-8)
    assert peak.natural_frequency == pytest.approx(natural, rel=1e-9)
    assert peak.frequency == pytest.approx(natural * np.sqrt(1 - 2 * zeta**2), rel=1e-9)
    assert peak.amplitude == pytest.approx(1 / (3200 * 2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-9)


def two_modes(f1, f2, zeta, frequency):
    w, w1, w2 = (2 * np.pi * np.asarray(f) for f in (frequency, f1, f2))
    return sum(1.0 / (a**2 - w**2 + 2j * zeta * a * w) for a in (w1, w2))


def test_separate_modes_give_their_damping():
    f = np.linspace(20.0, 400.0, 20001)
    peaks = resonance_peaks(f, two_modes(100.0, 300.0, 0.01, f))
    assert [p.verdict for p in peaks] == ["separate", "separate"]
    for peak, natural in zip(peaks, (100.0, 300.0)):
        assert peak.damping_ratio == pytest.approx(0.01, rel=1e-3)
        assert peak.natural_frequency == pytest.approx(natural, rel=1e-3)


def test_overlapping_modes_are_named():
    f = np.linspace(60.0, 160.0, 5001)
    for second in (103.0, 106.0):
        peaks = resonance_peaks(f, two_modes(100.0, second, 0.02, f), prominence=0.0)
        assert peaks and all(p.verdict == "overlapping" for p in peaks)


def test_too_few_samples_are_named():
    f = np.linspace(60.0, 140.0, 81)
    (peak,) = resonance_peaks(f, two_modes(100.3, 900.0, 0.01, f))
    assert peak.verdict == "coarse"
    with pytest.raises(CaseError, match="E-RANGE"):
        resonance_peaks(f[::-1], np.ones(81))


def test_planar_set_resonances():
    """Driving-point response of the sun: where modes stand alone the given damping comes back."""
    data, zeta = lin_parker_set(3), 0.01
    system, k = gear_set_system(data), data.mesh_stiffness
    modes = undamped_modes(system, k, damping_ratio=zeta)
    f = np.linspace(300.0, 13000.0, 30000)
    force = unit_force(system, "sun: u")
    found = modal_response(system, modes, f, force, force.T)[:, 0, 0]
    alone = [p for p in resonance_peaks(f, found) if p.verdict == "separate"]
    assert len(alone) >= 2
    for peak in alone:
        assert np.abs(modes.frequency / peak.natural_frequency - 1).min() < 1e-3
        assert peak.damping_ratio == pytest.approx(zeta, rel=1e-2)


def test_heavy_damping_has_no_complete_band():
    """Above zeta = 0.383 the static response is more than half the power of the peak."""
    f = np.linspace(0.1, 16.0, 2001)
    found = direct_response(single(zeta=0.45), f, np.ones(1), np.ones((1, 1)), mesh_stiffness=NO_MESH)
    (peak,) = resonance_peaks(f, found[:, 0, 0])
    assert peak.verdict == "incomplete" and np.isnan(peak.damping_ratio)
