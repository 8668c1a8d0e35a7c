"""Forced response to phased transmission errors against the direct solution, symmetry and equilibrium."""

import numpy as np
import pytest
from phase_patterns import phased_errors
from published.planetary_sets import TABLE_2, cases, kahraman_set

from femgear.errors import CaseError, ConvergenceError
from femgear.gears.phasing import MeshPhasing
from femgear.solvers.linear.receptance import modal_error_response
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import free_motions, gear_set_system
from femgear.system.mode_kinds import gear_set_motions
from femgear.system.rigid_bodies import body_masses
from validation.reference.frequency_response import mesh_error_response
from validation.reference.mode_energy import gear_set_springs, signed_phase_shares

HERTZ = np.linspace(60.0, 15e3, 150)
AMPLITUDES = np.array([1.0, 0.5j, -0.25, 0.1 + 0.1j]) * 1e-6


def direct(data, error, outputs=None, hertz=HERTZ):
    return mesh_error_response(
        gear_set_system(data),
        hertz,
        error,
        mesh_stiffness=data.column_stiffness,
        outputs=outputs,
        damping_ratio=0.05,
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact_points": "pitch_point", "slices": 3, "face_width": 0.03},
        {"planet_angles": [0.0, 1.3, 3.0, 4.9]},
        {"planet_angles": 2 * np.pi * np.arange(5) / 5},
    ],
)
def test_sum_of_modes_is_the_direct_solution(changes):
    data = kahraman_set(**changes)
    modes = gear_set_modes(data, damping_ratio=0.05)
    rng = np.random.default_rng(1)
    phases = rng.uniform(size=(2, len(data.column_stiffness)))
    error = np.array([phased_errors(AMPLITUDES, p) for p in phases])
    found = modal_error_response(modes, HERTZ, error)
    for case in range(2):
        expected = direct(data, error[case])
        for name in ("deflection", "force"):
            ours, theirs = getattr(found, name)[case], getattr(expected, name)
            assert np.abs(ours - theirs).max() < 1e-10 * np.abs(theirs).max()


def test_modes_left_out_leave_their_static_part():
    data = kahraman_set()
    error = phased_errors(AMPLITUDES, cases()["F"].phases)
    whole, cut = (
        modal_error_response(modes, [50.0, 100.0], error).force[0]
        for modes in (
            gear_set_modes(data, damping_ratio=0.05),
            gear_set_modes(data, damping_ratio=0.05, max_frequency=20e3),
        )
    )
    away = np.abs(cut - whole).max(axis=(1, 2)) / np.abs(whole).max()
    # what is left is damping and inertia of the modes above: small at low frequency
    assert away[1] < 1e-2 and away[0] < 0.6 * away[1]


@pytest.mark.parametrize("letter", "ACEFGH")
@pytest.mark.parametrize("planets", [3, 4, 5])
def test_each_harmonic_moves_the_planets_in_its_own_phasing(letter, planets):
    """Cyclic harmonic mod(h z_s, N) of the planets' motion, from the direct solution, without modes."""
    sun = cases()[letter].sun_teeth
    ring = planets * 25 - sun
    data = kahraman_set(planet_angles=2 * np.pi * np.arange(planets) / planets)
    case = MeshPhasing(sun, ring, tuple(25 * n for n in range(planets)), lag=0.3)
    error = phased_errors(AMPLITUDES, case.phases)
    n = len(gear_set_system(data).M)
    found = direct(data, error, np.eye(n), hertz=np.array([400.0, 1300.0, 2500.0]))
    for h in range(4):
        motions = gear_set_motions(data, found.output[:, h].T)
        share = signed_phase_shares(motions)
        own = (-(h + 1) * sun) % planets
        others = np.delete(share, own, axis=0)
        # shares of energy: squares of the leakage
        assert share[own] == pytest.approx(1.0) and others.max() < 1e-18
        central = np.abs(motions.central).max(axis=(1, 2)) if own not in (0, 1, planets - 1) else [0.0]
        assert np.max(central) < 1e-9 * np.abs(motions.planets).max()


@pytest.mark.parametrize("letter", "EFGH")
def test_printed_phases_pair_opposite_planets_and_turning_teeth_make_all_equal(letter):
    data = kahraman_set()
    for convention, alike in (("rotation", True), ("printed", False)):
        case = cases(convention=convention)[letter]
        size = np.abs(direct(data, phased_errors(np.full(3, 1e-6), case.phases)).force[:, [0, 2]])
        for meshes in (size[..., :4], size[..., 4:]):
            assert np.abs(meshes[..., [0, 1]] - meshes[..., [2, 3]]).max() < 1e-10 * size.max()
            assert (np.ptp(meshes, axis=-1).max() < 1e-10 * size.max()) == alike


def test_counter_phased_harmonics_peak_at_the_counter_phased_mode():
    """Case C: harmonics 1 and 3 peak near 9840 Hz, harmonics 2 and 4 at in-phase modes."""
    data = kahraman_set()
    modes = gear_set_modes(data, damping_ratio=0.05)
    error = phased_errors(np.full(4, 1e-6), cases()["C"].phases)
    for h, expected in ((1, 9840.2), (2, 12032.9), (3, 9840.2), (4, 12032.9)):
        hertz = np.arange(9e3, 14e3, 10.0)
        response = modal_error_response(modes, hertz / h, error)
        peak = hertz[np.abs(response.force[0, :, h - 1, 0]).argmax()]
        assert peak == pytest.approx(expected, rel=0.01)


def test_parity_of_the_planets_chooses_the_counter_phased_mode():
    """Same sun and ring: even planets (C) answer at 9840 Hz, odd ones (D) at 7625 Hz."""
    data = kahraman_set()
    modes = gear_set_modes(data, damping_ratio=0.05)
    hertz = np.arange(5e3, 14e3, 10.0)
    for letter, expected in (("C", 9840.2), ("D", 7625.0)):
        error = phased_errors(np.full(1, 1e-6), cases()[letter].phases)
        force = np.abs(modal_error_response(modes, hertz, error).force[0, :, 0, 0])
        assert hertz[force.argmax()] == pytest.approx(expected, rel=0.005)


def test_cases_have_the_printed_tooth_numbers_and_fit():
    assert "".join(cases()) == "ABCDEFGH"
    for letter, (sun, ring, planet, _) in TABLE_2.items():
        case = cases()[letter]
        assert (case.sun_teeth, case.ring_teeth, case.n_planets) == (sun, ring, 4)
        assert case.equally_spaced and case.lag == (planet % 2 == 0) / 2
    # the other four need profile shifts
    closed = [letter for letter, (sun, ring, planet, _) in TABLE_2.items() if ring - sun == 2 * planet]
    assert closed == ["A", "C", "F", "H"]


@pytest.mark.parametrize("uneven", [False, True])
def test_loads_of_springs_move_the_masses(uneven):
    """Newton on every body: spring loads along their directions against -omega^2 m q, undamped."""
    angles = 0.5 * np.pi * np.arange(4) + 0.2 * np.array([0, 1, 0, -1]) * uneven
    data = kahraman_set(planet_angles=angles)
    system = gear_set_system(data)
    springs = {k: v for k, v in gear_set_springs(data).items() if k.startswith(("bearing", "support"))}
    columns = np.hstack([one for one, _ in springs.values()])
    rows = np.vstack([(one * stiffness).T for one, stiffness in springs.values()])
    hertz, error = np.array([333.3]), phased_errors(AMPLITUDES, [0, 0.3, 0.1, 0.7, 0.2, 0.9, 0.4, 0.6])
    motion = np.eye(len(system.M))
    found = mesh_error_response(
        system, hertz, error, mesh_stiffness=data.column_stiffness, outputs=np.vstack([rows, motion])
    )
    assert springs["bearing of planet 1, radial"][0].shape == (42, 2)
    for h in range(4):
        out = found.output[0, h]
        load, q = out[: len(rows)], out[len(rows) :]
        inertia = -((2 * np.pi * 333.3 * (h + 1)) ** 2) * body_masses(data).ravel() * q
        rest = inertia + columns @ load + system.W @ found.force[0, h]
        assert np.abs(rest).max() < 1e-8 * np.abs(system.W @ found.force[0, h]).max()
    assert free_motions(data).shape == (42, 42)


def test_what_does_not_fit_is_refused():
    data = kahraman_set()
    modes = gear_set_modes(data)
    error = phased_errors(AMPLITUDES, np.zeros(8))
    with pytest.raises(CaseError, match="E-SHAPE"):
        modal_error_response(modes, [100.0], error[:7])
    with pytest.raises(CaseError, match="E-RANGE"):
        modal_error_response(modes, [-1.0], error)
    with pytest.raises(ConvergenceError, match="E-RESONANCE"):
        modal_error_response(modes, modes.frequency[5:6], error)
    still = modal_error_response(modes, [0.0], error)
    assert np.all(np.isfinite(still.force))


@pytest.mark.parametrize("harmonics", [[0], [1.5], [-1], ["a"], [[1]]])
def test_harmonics_that_are_none_are_refused(harmonics):
    data = kahraman_set()
    error = np.full((8, 1), 1e-6)
    with pytest.raises(CaseError, match="E-HARMONICS"):
        modal_error_response(gear_set_modes(data), HERTZ, error, harmonics=harmonics)
