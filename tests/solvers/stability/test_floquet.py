from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.stability import floquet
from femgear.solvers.stability.floquet import frame_of_modes, monodromy, passage
from femgear.solvers.stability.parametric import stability
from femgear.system.fourier import harmonics_of
from femgear.system.system import MechanicalSystem, MeshExcitation


def reference_multipliers(modes, excitation, frequency, harmonics=6):
    """All multipliers by DOP853 on the modal equations of a basis with all modes."""
    k = harmonics_of(excitation.stiffness, harmonics)
    k[:, 0] -= modes.mesh_stiffness
    w, r, n = 2 * np.pi * modes.frequency, modes.mesh_deflection, len(modes.frequency)

    def rate(t, y):
        q, v = y.reshape(2, n, -1)
        change = (k @ np.exp(2j * np.pi * frequency * t * np.arange(harmonics + 1))).real[:, None]
        a = -2 * (modes.damping_ratio * w)[:, None] * v - (w**2)[:, None] * q - r.T @ (change * (r @ q))
        return np.stack([v, a]).ravel()

    end = solve_ivp(rate, (0, 1 / frequency), np.eye(2 * n).ravel(), method="DOP853", rtol=1e-11, atol=1e-13)
    return np.linalg.eigvals(end.y[:, -1].reshape(2 * n, 2 * n))


@pytest.mark.parametrize("damping", [0.0, 0.01, 0.05])
def test_multipliers_equal_time_integration(geared_chain, chain_excitation, damping):
    excitation = chain_excitation(0.4)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=damping)
    top = modes.frequency
    for frequency in (0.05, top[3], 2 * top[3], top[2] + top[3]):
        exact = np.abs(reference_multipliers(modes, excitation, frequency)).max()
        found = stability(modes, excitation, frequency, frequency_ratio=1e3).modulus[0]
        assert found == pytest.approx(exact, rel=2e-5)
        assert stability(modes, excitation, frequency).modulus[0] == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.998, 1.0, 1.7])
def test_modes_that_creep_back_equal_time_integration(geared_chain, chain_excitation, ratio):
    """Beyond critical damping a mode does not turn; just below it is followed as the others."""
    excitation, damping = chain_excitation(0.4), np.array([0.0, 0.02, ratio, 0.02])
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=damping)
    frequency = 2.0 * modes.frequency[1]
    exact = np.abs(reference_multipliers(modes, excitation, frequency)).max()
    found = stability(modes, excitation, frequency, frequency_ratio=1e3, steps=400).modulus[0]
    assert found == pytest.approx(exact, rel=1e-7)


def test_splitting_is_of_fourth_order(geared_chain, chain_excitation):
    excitation = chain_excitation(0.4)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.03)
    frequency = 2 * modes.frequency[3]
    exact = np.abs(reference_multipliers(modes, excitation, frequency)).max()
    error = [
        abs(stability(modes, excitation, frequency, steps=n, frequency_ratio=1e3).modulus[0] - exact)
        for n in (10, 20, 40)
    ]
    assert error[0] / error[1] > 13 and error[1] / error[2] > 13


@pytest.mark.parametrize("coupling", [0.0, 0.01])
def test_pieces_of_a_period_side_by_side_equal_one_after_the_other(geared_chain, coupling, monkeypatch):
    frame = frame_of_modes(undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.03))
    frame = replace(frame, damping=frame.damping + coupling)
    assert frame.diagonal == (coupling == 0.0)

    def tangents(fraction, states):
        wave = 0.3 * np.cos(2 * np.pi * (fraction + 0.1 * states[:, None])) + 0.1 * (fraction > 0.3)
        return np.diag([1.0, 1.4]) * (1.0 + wave)[..., None, None]

    matrices = []
    for rows in (256, 0):
        monkeypatch.setattr(floquet, "_ROWS_TOGETHER", rows)
        matrices.append(passage(frame, np.array([20.0, 33.0]), tangents, [np.array([0.3])] * 2)[0])
    np.testing.assert_allclose(*matrices, rtol=0.0, atol=1e-12 * np.abs(matrices[0]).max())
    assert np.any(matrices[0] != matrices[1])


def test_speeds_in_one_call_equal_single_calls(planet_set, planet_excitation):
    excitation = planet_excitation(np.array([0.0, 1 / 3, 2 / 3, 0.1, 0.1 + 1 / 3, 0.1 + 2 / 3]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.005)
    frequency = np.linspace(0.02, 1.0, 80)
    together = stability(modes, excitation, frequency)
    alone = [stability(modes, excitation, f).modulus[0] for f in frequency[::20]]
    np.testing.assert_allclose(np.abs(together.multiplier[::20]), alone, rtol=1e-5)
    assert together.stable.shape == (80,) and np.any(together.stable) and not np.all(together.stable)
    for i in (0, 30, 60):
        exact = np.abs(reference_multipliers(modes, excitation, frequency[i])).max()
        assert abs(together.multiplier[i]) == pytest.approx(exact, rel=1e-3)
        every_mode = stability(modes, excitation, frequency[i], frequency_ratio=20.0).modulus[0]
        assert every_mode == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("phase", "mass", "rank"), [(0.0, 1.0, 2), (1 / 3, 1.0, 6), (0.0, 1.3, 6)])
def test_meshes_in_phase_sequential_and_uneven(planet_set, planet_excitation, phase, mass, rank, monkeypatch):
    """Fewer combinations of the six meshes move the modes of equal planets in phase, not those of others."""
    ranks, svd = [], np.linalg.svd
    phases = phase * np.arange(3)
    excitation = planet_excitation(np.concatenate([phases, phases + 0.1]), depth=0.3)
    system = planet_set()
    M = system.M.copy()
    M[[6, 9], [6, 9]] *= mass, 1.0 / mass
    modes = undamped_modes(replace(system, M=M), excitation.stiffness.mean(axis=1), damping_ratio=0.01)

    def counted(rows, **options):
        found = svd(rows, **options)
        ranks.append(int((found[1] > 1e-10 * found[1].max()).sum()))
        return found

    monkeypatch.setattr(np.linalg, "svd", counted)
    for frequency in (0.11, 0.27):
        found = stability(modes, excitation, frequency, frequency_ratio=1e3, steps=600).modulus[0]
        exact = np.abs(reference_multipliers(modes, excitation, frequency)).max()
        assert found == pytest.approx(exact, rel=1e-7)
    assert min(ranks) <= rank <= max(ranks)


def test_constant_stiffness_only_decays(geared_chain, chain_excitation):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.03)
    verdict = stability(modes, chain_excitation(0.0), [0.05, 0.3])
    slowest = 2 * np.pi * 0.03 * modes.frequency[0]
    np.testing.assert_allclose(np.abs(verdict.multiplier), np.exp(-slowest / verdict.mesh_frequency))
    assert np.all(verdict.stable)


def test_undamped_multipliers_stay_on_the_circle_outside_the_tongues(geared_chain, chain_excitation):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.0)
    verdict = stability(modes, chain_excitation(0.2), 5.0 * modes.frequency[3])
    assert verdict.stable[0] and abs(verdict.multiplier[0]) == pytest.approx(1.0, abs=1e-10)


def test_residual_flexibility_takes_part(geared_chain, chain_excitation):
    """Modes cut by the basis or by the frequency limit give the same verdict."""
    excitation = chain_excitation(0.3)
    everything = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.01)
    few = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.01, count=3)
    frequency = 0.02
    exact = np.abs(reference_multipliers(everything, excitation, frequency)).max()
    assert stability(few, excitation, frequency).modulus[0] == pytest.approx(exact, rel=1e-4)
    shift = replace(few, residual=np.zeros((2, 2)))
    tongue = 2 * few.frequency[2]
    good = [stability(m, excitation, tongue).modulus[0] for m in (few, shift)]
    assert abs(good[0] - good[1]) > 1e-4


def test_rigid_modes_are_left_out():
    system = MechanicalSystem(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), np.ones((2, 1)), np.ones(2), ())
    stiffness = np.full((1, 16), 2.0)
    excitation = MeshExcitation(stiffness, stiffness, stiffness, np.zeros(1))
    modes = undamped_modes(system, [2.0], damping_ratio=0.1)
    verdict = stability(modes, excitation, 0.5)
    assert verdict.modes_kept[0] == 1 and verdict.stable[0] and abs(verdict.multiplier[0]) < 0.9


def test_monodromy_multiplies_in_the_order_of_time():
    a, b = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(monodromy([a, b], [2.0, 3.0]), np.array([[1, 0], [3, 1]]) @ np.array([[1, 2], [0, 1]]))


@pytest.mark.parametrize("options", [{"steps": 3}, {"frequency_ratio": 0.5}, {"excitation_harmonics": 0}])
def test_bad_options_are_refused(geared_chain, chain_excitation, options):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    with pytest.raises(CaseError):
        stability(modes, chain_excitation(0.2), 0.1, **options)


@pytest.mark.parametrize("frequency", [0.0, -1.0, np.nan])
def test_bad_frequencies_are_refused(geared_chain, chain_excitation, frequency):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    with pytest.raises(CaseError, match="positive"):
        stability(modes, chain_excitation(0.2), frequency)


def test_unphysical_flexibility_is_refused(geared_chain, chain_excitation):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05, count=1)
    with pytest.raises(ConvergenceError, match="keep more modes"):
        stability(replace(modes, residual=20 * np.eye(2)), chain_excitation(0.4), 0.1)


def test_bad_monodromy_pieces_are_refused():
    with pytest.raises(CaseError):
        monodromy([np.eye(2)], [1.0, 2.0])
