"""Mesh stiffness by the number of tooth pairs in contact."""

import math

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.system.fourier import harmonics_of
from femgear.system.stiffness_waves import pair_count_wave
from femgear.trains.drivetrain.model import rectangular_series
from femgear.trains.drivetrain.parts import MeshSection

POSITIONS = 20_000


def counted(start: float, end: float, overlap: float = 0.0) -> np.ndarray:
    """Length of contact at equal steps of the period, pairs at all transverse sections counted one by one."""
    tau = (np.arange(POSITIONS) + 0.5) / POSITIONS
    sections = overlap * (np.arange(50) - 24.5) / 50.0
    pairs = np.arange(-25, 26)
    place = tau[:, None, None] + sections[:, None] + pairs
    return ((place > start) & (place < end)).sum(axis=2).mean(axis=1)


@pytest.mark.parametrize(("start", "end", "overlap"), [(-0.9, 0.7, 0.0), (-1.3, 1.9, 0.0), (-0.9, 0.7, 1.37)])
def test_harmonics_are_those_of_pairs_that_are_counted(start, end, overlap):
    length = counted(start, end, overlap)
    assert length.mean() == pytest.approx(end - start, rel=1e-3)
    wanted = harmonics_of(length / length.mean(), 8)[1:] * np.exp(-1j * np.pi * np.arange(1, 9) / POSITIONS)
    assert pair_count_wave(start, end, 8, overlap=overlap) == pytest.approx(wanted, abs=2e-3)


def test_whole_contact_or_overlap_ratios_keep_the_stiffness_constant():
    assert np.abs(pair_count_wave(-0.8, 1.2, 9)).max() < 1e-14
    assert np.abs(pair_count_wave(-0.9, 0.7, 9, overlap=1.0)).max() < 1e-14


@pytest.mark.parametrize(("ratio", "low_share"), [(1.6, None), (2.3, 0.55), (1.6, 1.0)])
def test_two_levels_have_the_wave_of_the_pairs(ratio, low_share):
    wave = MeshSection.in_si(stiffness=4e8, contact_ratio=ratio, low_share=low_share, phase=0.2)
    low, high, share = wave.levels
    tau = (np.arange(POSITIONS) + 0.5) / POSITIONS + 0.2
    levels = np.where(np.abs((tau + 0.5) % 1.0 - 0.5) < 0.5 * share, high, low)
    shift = np.exp(-1j * np.pi * np.arange(1, 7) / POSITIONS)
    found = rectangular_series(wave, 6)
    assert found[0] == 4e8 and found[1:] == pytest.approx(harmonics_of(levels, 6)[1:] * shift, abs=2e-4 * 4e8)
    assert math.isclose(levels.mean(), 4e8, rel_tol=1e-3)


def test_a_path_has_a_length():
    with pytest.raises(CaseError, match="ends before"):
        pair_count_wave(0.5, 0.5, 3)
