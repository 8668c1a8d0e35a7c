"""Sliced mesh stiffness against integrals over the face width, exact overlaps and springs side by side."""

import math

import numpy as np
import pytest
from contact.test_cycle import reference_set
from published.planetary_sets import kahraman_set
from scipy.integrate import quad

from femgear.contact.cycle import cycle_without_load
from femgear.errors import CaseError
from femgear.gears import profile
from femgear.system.system import MeshExcitation
from femgear.trains.helical.model import helical_excitation, slice_phases

TAU = np.arange(128) / 128
MEAN, LINES = 4e8, np.array([0.2, 0.1j, 0.05 - 0.03j, 0.02])


def stiffness_at(tau):
    h = np.arange(1, 5)
    return MEAN * (1 + (np.exp(2j * np.pi * np.multiply.outer(tau, h)) @ LINES).real)


def record(phases=(0.0, 0.3), force=1000.0):
    k = stiffness_at(TAU + np.array(phases)[:, None])
    return MeshExcitation(k, force / k, np.full_like(k, force), np.full(len(k), 1e-4))


@pytest.mark.parametrize("overlap", [0.0, 0.37, 1.0, 1.61])
def test_mean_over_the_face_width(overlap):
    found = helical_excitation(record(), overlap)
    for j, phase in enumerate((0.0, 0.3)):
        for i in (0, 17, 90):
            middle = TAU[i] + phase
            if overlap:
                span = middle - overlap / 2, middle + overlap / 2
                expected = quad(stiffness_at, *span, epsabs=0, epsrel=1e-12)[0] / overlap
            else:
                expected = stiffness_at(middle)
            assert found.stiffness[j, i] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("overlap", [1, 2, 3])
def test_whole_overlap_ratios_make_the_mesh_constant(overlap):
    """Closed form: every part of the mesh cycle is in contact somewhere, always."""
    rough = record()
    # a step as well, not only smooth lines
    k = np.where(TAU < 0.4, 3e8, 5e8) * np.ones((2, 1))
    for one in (rough, MeshExcitation(k, 1e3 / k, np.full_like(k, 1e3), np.zeros(2))):
        found = helical_excitation(one, overlap)
        assert np.ptp(found.stiffness, axis=1).max() < 1e-12 * MEAN
        assert found.stiffness.mean(axis=1) == pytest.approx(one.stiffness.mean(axis=1), rel=1e-12)
        assert np.ptp(found.deflection, axis=1).max() < 1e-12 * found.deflection.max()
        # constant force, spread over the width as the stiffness is
        assert found.force == pytest.approx(np.full((2, 128), 1e3), rel=1e-12)


def test_shorter_overlap_leaves_the_sinc_of_every_harmonic():
    found = np.fft.rfft(helical_excitation(record(), 0.8).stiffness[0])[1:5] / 64
    assert found == pytest.approx(MEAN * LINES * np.sinc(0.8 * np.arange(1, 5)), rel=1e-9)


@pytest.mark.parametrize("hand", [1, -1])
def test_slices_follow_each_other_and_make_the_whole(hand):
    overlap, slices = np.array([0.9, 1.7]), 5
    whole = helical_excitation(record(), overlap)
    parts = helical_excitation(record(), overlap, slices=slices, hand=hand)
    k = parts.stiffness.reshape(2, slices, -1)
    assert k.sum(axis=1) == pytest.approx(whole.stiffness, rel=1e-12)
    assert parts.force.reshape(2, slices, -1).sum(axis=1) == pytest.approx(whole.force, rel=1e-12)
    # springs side by side at the deflection of the whole carry its force
    tangent = parts.force + parts.stiffness * (np.repeat(whole.deflection, slices, axis=0) - parts.deflection)
    assert tangent.reshape(2, slices, -1).sum(axis=1) == pytest.approx(whole.force, rel=1e-11)
    phases = slice_phases([0.0, 0.3], overlap, slices=slices, hand=hand).reshape(2, slices)
    for j in range(2):
        for s in range(slices):
            half = overlap[j] / slices / 2
            middle = TAU[33] + phases[j, s]
            expected = quad(stiffness_at, middle - half, middle + half, epsrel=1e-12)[0] / (2 * half) / slices
            assert k[j, s, 33] == pytest.approx(expected, rel=1e-10)
    assert np.sign(np.diff(phases)).flatten() == pytest.approx(hand)
    assert parts.backlash == pytest.approx(np.full(10, 1e-4))


def test_records_of_several_periods_keep_their_orders():
    """Three mesh periods with a wave of two thirds of an order."""
    tau = 3.0 * np.arange(96) / 96
    k = MEAN * (1 + 0.1 * np.cos(2 * np.pi * tau) + 0.2 * np.cos(2 * np.pi * tau * 2 / 3))[None]
    found = helical_excitation(MeshExcitation(k, 0 * k, 0 * k, np.zeros(1), periods=3), 0.6)
    expected = MEAN * (
        1 + 0.1 * np.sinc(0.6) * np.cos(2 * np.pi * tau) + 0.2 * np.sinc(0.4) * np.cos(4 * np.pi * tau / 3)
    )
    assert found.stiffness[0] == pytest.approx(expected, rel=1e-12) and found.periods == 3


@pytest.mark.parametrize("helix", [20.0, -12.0])
def test_height_runs_ahead_by_the_twist_of_the_flanks(helix):
    """A flank at height z stands z tan(beta_b) / r_b ahead of the one at mid-face, over the pitch angle."""
    beta, normal_angle, module, teeth, width = math.radians(helix), math.radians(20.0), 2e-3, 30, 0.04
    transverse = profile.transverse_angle(normal_angle, beta)
    base = 0.5 * teeth * module / math.cos(beta) * math.cos(transverse)
    twist = math.tan(profile.base_helix_angle(normal_angle, beta)) / base
    height = kahraman_set(slices=4, face_width=width).slice_heights
    ahead = slice_phases([0.2], profile.overlap_ratio(width, module, beta), slices=4, hand=int(np.sign(helix)))
    assert ahead == pytest.approx(0.2 + height * twist * teeth / (2 * math.pi), rel=1e-12)


def test_a_record_without_stiffness_is_refused():
    empty = cycle_without_load(reference_set(), TAU, periods=1, contact="profile")
    with pytest.raises(CaseError, match="E-STIFFNESS"):
        helical_excitation(empty, 1.0)
