"""Matrices between inputs and outputs against dynamic stiffness, modes and the spectral solver."""

from dataclasses import replace

import numpy as np
import pytest
from chain_model import DAMPING, RADII, chain_excitation, chain_model, chain_modes, chain_system
from scipy.linalg import eigvals

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.linear.state_space import Port, modal_model, state_space
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.system import MeshExcitation

HERTZ = np.array([37.0, 410.0, 1900.0])


def receptance(space, hertz):
    """Outputs per input at a frequency [Hz]."""
    states = 2j * np.pi * hertz * np.eye(len(space.A)) - space.A
    return space.C @ np.linalg.solve(states, space.B) + space.D


@pytest.mark.parametrize("hertz", HERTZ)
def test_the_receptance_is_that_of_the_dynamic_stiffness(hertz):
    system, excitation = chain_system(), chain_excitation()
    k = excitation.stiffness.mean(axis=1)
    C = modal_damping(system, k, DAMPING)
    omega = 2.0 * np.pi * hertz
    dynamic = system.K + (system.W * k) @ system.W.T + 1j * omega * C - omega**2 * system.M
    loads = np.column_stack([system.W * k, np.eye(4)[:, [0, 3]]])
    moved = np.linalg.solve(dynamic, loads)
    force = k[:, None] * (system.W.T @ moved - np.eye(1, 3))
    space = state_space(chain_model().modal)
    expected = np.vstack([system.W.T @ moved, force, moved, 1j * omega * moved])
    np.testing.assert_allclose(receptance(space, hertz), expected, rtol=1e-9)
    assert space.inputs == ("displacement of gear 1-gear 2", "torque on motor", "torque on load")
    assert (
        space.outputs[1:3] == ("force of gear 1-gear 2", "motor: rotation")
        and space.outputs[-1] == "load: rotation rate"
    )
    assert (space.input_units, space.output_units[:3]) == (("m", "N m", "N m"), ("m", "N", "rad"))


def test_poles_are_the_modes():
    model = chain_model()
    omega, zeta = model.modal.omega[1:], model.modal.damping_ratio[1:]
    poles = eigvals(state_space(model.modal).A)
    upper = np.sort_complex(poles[poles.imag > 1.0])
    expected = np.sort_complex(omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2)))
    np.testing.assert_allclose(upper, expected, rtol=1e-9)


def test_modes_that_are_left_out_leave_their_static_flexibility(geared_chain):
    """Of a set on supports the static outputs are those of all modes, with two of four."""
    k = np.array([1.0, 1.4])
    flexibility = np.array([[0.02, 0.01], [0.01, 0.05]])
    system = replace(geared_chain, flexibility=flexibility)
    inputs = [Port("a", "N", np.eye(4)[0], 1.0)]
    outputs = [Port("d", "m", np.eye(4)[3])]
    found = []
    for count in (2, 4):
        modes = undamped_modes(system, k, damping_ratio=0.03, count=count)
        model = modal_model(system, modes, meshes=["1", "2"], inputs=inputs, outputs=outputs)
        space = state_space(model)
        found.append(receptance(space, 0.0))
        assert [port.name for port in model.inputs] == ["a", "other loads"]
        constant = space.nominal
        np.testing.assert_allclose(np.real(found[-1] @ constant)[:2], modes.load_deflection, rtol=1e-9)
        # f = k (x - e) with x = W^T q - flexibility f
        moved = np.linalg.solve(
            np.block([[system.K, system.W], [system.W.T, -np.diag(1.0 / k) - flexibility]]),
            np.concatenate([np.zeros(4), [1.0, 0.0]]),
        )
        np.testing.assert_allclose(found[-1][2:4, 0], moved[4:], rtol=1e-9)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_the_receptance_in_few_modes_is_that_of_the_spectral_solver():
    """Of a mesh that does not vary, displaced in one harmonic."""
    excitation, system = chain_excitation(depth=0.0), chain_system()
    modes = chain_modes(system, excitation, count=3)
    theta = 2.0 * np.pi * np.arange(256) / 256
    wave = MeshExcitation(excitation.stiffness, 1e-6 * np.cos(theta)[None], 0.0 * theta[None], np.zeros(1))
    space = state_space(chain_model(excitation, count=3).modal)
    for hertz in HERTZ:
        response = solve_spectral(modes, wave, [hertz], excitation_harmonics=1, tolerance=1e-12)
        found = 1e-6 * receptance(space, hertz)[:2, 0]
        np.testing.assert_allclose(found, [response.deflection[0, 0, 1], response.force[0, 0, 1]], rtol=1e-9)


def test_torques_turn_the_whole_without_strain():
    model = chain_model()
    together = model.modal.output_rows[:, 0] * model.modal.input_rows[0, 0]
    # the inertia that the motor turns: the mesh turns gear 2 the other way
    ratio = np.array([1.0, 1.0, -RADII[0] / RADII[1], -RADII[0] / RADII[1]])
    inertia = (np.diag(chain_system().M) * ratio**2).sum()
    np.testing.assert_allclose(together, ratio / inertia, rtol=1e-9)
    np.testing.assert_allclose(model.ratios, ratio, rtol=1e-9)


def test_names_and_directions_fit_the_system():
    system = chain_system()
    modes = chain_modes(system, chain_excitation())
    with pytest.raises(CaseError, match="do not fit"):
        modal_model(system, modes, meshes=["one", "two"], inputs=[])
    with pytest.raises(CaseError, match="do not fit"):
        modal_model(system, modes, meshes=["one"], inputs=[Port("torque", "N m", np.ones(3))])
    sources = replace(system, sources=np.zeros((4, 2)))
    with pytest.raises(CaseError, match="not those of friction"):
        modal_model(sources, modes, meshes=["one"], inputs=[])
