"""The gear pair against closed forms and against its reduction to one coordinate."""

import numpy as np
import pytest
from small_trains import equivalent_mass, gear_pair

from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries
from femgear.system.system import MechanicalSystem, NonlinearSystem

INERTIA, RADIUS = (1.2e-3, 4.5e-3), (0.04, 0.07)
STIFFNESS, TORQUE = 3e8, 120.0
MASS = equivalent_mass(INERTIA, RADIUS)
NATURAL = np.sqrt(STIFFNESS / MASS)
DAMPING = 2 * 0.04 * MASS * NATURAL


def pair(mesh):
    return NonlinearSystem(gear_pair(INERTIA, RADIUS, torque=TORQUE, mesh_damping=DAMPING), (mesh,))


def test_natural_frequency_and_damping_ratio_are_the_closed_form():
    system = gear_pair(INERTIA, RADIUS, mesh_damping=DAMPING)
    modes = undamped_modes(system, [STIFFNESS])
    assert modes.kind == ("rigid", "elastic")
    # both gears as point masses on the line of action: 1 / m_e = r_1^2 / I_1 + r_2^2 / I_2
    flexible = np.sqrt(STIFFNESS * (RADIUS[0] ** 2 / INERTIA[0] + RADIUS[1] ** 2 / INERTIA[1]))
    assert 2 * np.pi * modes.frequency[1] == pytest.approx(flexible, rel=1e-12)
    assert modes.damping_ratio[1] == pytest.approx(0.04, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.4, 0.98, 1.7])
def test_response_to_transmission_error_is_the_closed_form(ratio):
    """``X (k - m_e w^2 + i c w) = k E`` beside the static ``T_1 / (r_1 k)``."""
    omega, error = ratio * NATURAL, 3e-6
    mesh = GearMeshes([0], FourierSeries([[STIFFNESS]]), deflection=FourierSeries([[0.0, error]]), separates=False)
    found = solve_harmonic_balance(pair(mesh), omega, harmonics=3)
    expected = STIFFNESS * error / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    static = TORQUE / RADIUS[0] / STIFFNESS
    np.testing.assert_allclose(found.deflection[0, :2], [static, expected], rtol=1e-10)
    np.testing.assert_allclose(found.deflection[0, 2:], 0.0, atol=1e-12 * static)
    decay = np.exp(-DAMPING / MASS * 2 * np.pi / omega / 2)
    np.testing.assert_allclose(np.abs(found.verdict.multipliers), decay, rtol=1e-9)


def test_contact_loss_is_that_of_one_mass_and_shooting_confirms_it():
    """k(t) and backlash at resonance; the free rotation takes no part."""
    omega = 0.95 * NATURAL
    mesh = GearMeshes([0], FourierSeries([[STIFFNESS, 0.2 * STIFFNESS]]), backlash=40e-6)
    found = solve_harmonic_balance(pair(mesh), omega, harmonics=16)
    one = np.ones((1, 1))
    single = MechanicalSystem(MASS * one, DAMPING * one, 0 * one, one, [TORQUE / RADIUS[0]], ("x",))
    alone = solve_harmonic_balance(NonlinearSystem(single, (mesh,)), omega, harmonics=16)
    assert found.converged and found.at(np.linspace(0, 2 * np.pi / omega, 200)).min() < 0.0
    np.testing.assert_allclose(found.deflection, alone.deflection, atol=1e-9 * np.abs(alone.deflection).max())
    np.testing.assert_allclose(
        np.sort_complex(found.verdict.multipliers), np.sort_complex(alone.verdict.multipliers), atol=1e-7
    )
    assert found.spectral_radius == pytest.approx(alone.spectral_radius, rel=1e-7)
    shot = solve_shooting(pair(mesh), omega, harmonics=16, settle=60)
    assert shot.solution.converged and shot.stable is found.stable is True
    largest = np.abs(found.deflection[:, 1:]).max()
    np.testing.assert_allclose(shot.solution.deflection, found.deflection, atol=1e-4 * largest)
    assert len(shot.multipliers) == 4 and len(shot.verdict.multipliers) == 2
    np.testing.assert_allclose(np.abs(shot.verdict.multipliers), np.abs(found.verdict.multipliers), atol=1e-4)
