"""Which harmonics excite which modes, against the rule of mesh phasing and against solved responses."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.resonances import EXCITED, crossings, merged_speeds, modal_forces, refined_speeds
from femgear.solvers.periodic.spectral import solve_spectral

HARMONICS = 12


def phases(n: int, sun_teeth: int, lag: float = 0.1) -> np.ndarray:
    """Delays of sun and ring meshes of equally spaced planets in mesh periods (Parker and Lin, 2004)."""
    sun = np.arange(n) * sun_teeth / n % 1.0
    return np.concatenate([sun, sun + lag])


def basis(system, excitation, damping=0.02):
    return undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=damping)


def at_rest(system, excitation):
    """Deflections and forces of the meshes in equilibrium with the load at every position."""
    deflection = []
    for stiffness in excitation.stiffness.T:
        K = system.K + (system.W * stiffness) @ system.W.T
        deflection.append(system.W.T @ np.linalg.solve(K, system.load))
    deflection = np.array(deflection).T
    return replace(excitation, deflection=deflection, force=excitation.stiffness * deflection)


def planet_waves(modes, first: int, count: int) -> int:
    """Class c of the modes of one frequency: their meshes follow the planets as exp(2 pi i c p / N)."""
    n = len(modes.mesh_stiffness) // 2
    motion = modes.mesh_deflection[:, first : first + count].reshape(2, n, count)
    power = (np.abs(np.fft.fft(motion, axis=1)) ** 2).sum(axis=(0, 2))
    folded = [power[c] + (power[n - c] if 0 < 2 * c < n else 0.0) for c in range(n // 2 + 1)]
    assert max(folded) > (1 - 1e-9) * sum(folded)
    return int(np.argmax(folded))


@pytest.mark.parametrize(
    ("n", "sun_teeth"), [(3, 27), (3, 28), (3, 29), (4, 28), (4, 29), (4, 30), (5, 25), (5, 26), (5, 27)]
)
def test_equal_planets_follow_the_rule_of_mesh_phasing(planet_set, planet_excitation, n, sun_teeth):
    """Harmonic h excites the modes of class c = h z_s or -h z_s mod N: in phase, or in sequence."""
    excitation = planet_excitation(phases(n, sun_teeth), positions=240)
    modes = basis(planet_set(n), excitation)
    forces = modal_forces(modes, excitation, HARMONICS)
    counts = np.diff(np.append(forces.mode, len(modes.frequency)))
    classes = {planet_waves(modes, first, count) for first, count in zip(forces.mode, counts)}
    assert classes == set(range(n // 2 + 1))
    for g, (first, count) in enumerate(zip(forces.mode, counts)):
        c = planet_waves(modes, first, count)
        for h in range(1, HARMONICS + 1):
            follows = h * sun_teeth % n in (c, (n - c) % n)
            assert forces.excited[g, h - 1] == follows, (g, h, forces.share[g, h - 1])
            # far from the limit on both sides
            assert forces.share[g, h - 1] < 1e-9 or forces.share[g, h - 1] > 3 * EXCITED


def test_a_planet_out_of_phase_excites_all_classes(planet_set, planet_excitation):
    uneven = phases(4, 28) + np.array([0.0, 0.02, 0.0, 0.0] * 2)
    excitation = planet_excitation(uneven, positions=240)
    forces = modal_forces(basis(planet_set(4), excitation), excitation, HARMONICS)
    assert forces.excited[:, :3].all()


@pytest.mark.parametrize("h", [1, 2, 3])
def test_a_mode_in_resonance_moves_as_its_force_says(planet_set, planet_excitation, h):
    """Whatever the spectral solution of small fluctuations says of it."""
    system = planet_set(3)
    excitation = at_rest(system, planet_excitation(phases(3, 28), depth=1e-3, positions=240))
    modes = basis(system, excitation, damping=0.02)
    outputs = np.diag(np.arange(1.0, len(modes.frequency) + 1))
    forces = modal_forces(modes, excitation, 3, output=outputs)
    for g in np.flatnonzero(forces.share[:, h - 1] > 0.05):
        frequency, first = forces.frequency[g], forces.mode[g]
        found = solve_spectral(modes, excitation, [frequency / h], excitation_harmonics=3)
        own = slice(first, np.append(forces.mode, len(modes.frequency))[g + 1])
        acceleration = (2 * np.pi * frequency) ** 2 * found.modal[0, own, h]
        force = np.linalg.norm(acceleration) * 2 * modes.damping_ratio[first]
        assert force == pytest.approx(forces.force[g, h - 1], rel=0.01)
        heard = np.linalg.norm(acceleration * np.diag(outputs)[own]) / np.sqrt(2)
        assert heard == pytest.approx(forces.output_level[g, h - 1] / (2 * modes.damping_ratio[first]), rel=0.01)


def test_crossings_are_those_between_two_frequencies(planet_set, planet_excitation):
    excitation = planet_excitation(phases(3, 27), positions=240)
    forces = modal_forces(basis(planet_set(3), excitation), excitation, HARMONICS)
    low, high, end = 0.02, 0.2, forces.frequency[-2]
    found = crossings(forces, low, high, end)
    expected = sorted(
        (f / h, g, h)
        for g, f in enumerate(forces.frequency)
        for h in range(1, HARMONICS + 1)
        if forces.excited[g, h - 1] and low <= f / h <= high and f <= end
    )
    assert len(expected) > 5
    assert [(g, h) for _, g, h in expected] == list(zip(found.row, found.harmonic))
    assert found.mesh_frequency == pytest.approx([f for f, _, _ in expected], rel=1e-14)


def test_a_mixture_of_modes_of_one_frequency_has_the_same_force(planet_set, planet_excitation):
    excitation = planet_excitation(phases(3, 28), positions=240)
    modes = basis(planet_set(3), excitation)
    forces = modal_forces(modes, excitation, 4)
    pair = next(m for m, n in zip(forces.mode, np.diff(forces.mode)) if n == 2)
    turn = np.eye(len(modes.frequency))
    turn[pair : pair + 2, pair : pair + 2] = [[0.6, 0.8], [-0.8, 0.6]]
    turned = replace(modes, shape=modes.shape @ turn, mesh_deflection=modes.mesh_deflection @ turn)
    mixed = modal_forces(turned, excitation, 4)
    assert mixed.force == pytest.approx(forces.force, rel=1e-12, abs=1e-12 * forces.force.max())
    assert mixed.force[:, 0].max() > 0


def test_other_meshes_are_refused(planet_set, planet_excitation):
    modes = basis(planet_set(3), planet_excitation(phases(3, 27)))
    with pytest.raises(CaseError, match="modes of 6 meshes, excitation of 8"):
        modal_forces(modes, planet_excitation(phases(4, 28)), 3)


def test_speeds_that_differ_by_rounding_are_one():
    speeds = np.linspace(10.0, 20.0, 5)
    # a mode at 30 meets harmonic 2 at 15, and one at 45 harmonic 3, in other digits
    resonance = np.array([15.0 * (1.0 + 3e-16), 45.0 / 3.0 * (1.0 - 2e-12), 13.3])
    refined = refined_speeds(speeds, resonance, np.ones(3), np.full(3, 0.01))
    assert np.diff(refined).min() > 1e-3 and len(refined) == 5 + 2 + 3
    assert set(speeds) <= set(refined)
    operating = np.array([17.5 * (1.0 + 1e-12), 18.0])
    merged = merged_speeds(operating, refined)
    assert len(merged) == len(refined) + 1 and set(operating) <= set(merged)
    np.testing.assert_array_equal(merged_speeds(np.empty(0), speeds), speeds)
