"""femgear.measured.lines: known lines of a spectrum, noise that makes none, and their verdicts."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.measured.lines import (
    VERDICTS,
    chance,
    judge_lines,
    level_uncertainty,
    order_tolerance,
    sharpened_lines,
)
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.turns import AngleSignal

NORMAL, UNEQUAL, SUN, PLANET, FOREIGN = VERDICTS
ANGLES = np.radians([0, 86.4, 180, 266.4])
LINES = {66.0: NORMAL, 70.0: NORMAL, 71.0: UNEQUAL, 73 + 1 / 3: SUN, 77.5: PLANET, 66.18: FOREIGN, 143.0: UNEQUAL}


def signal(lines, *, turns=60, noise=0.0, seed=1):
    angle = np.arange(turns * 1024) / 1024
    values = 3.0 + sum(a * np.cos(2 * np.pi * order * angle + order) for order, a in lines.items())
    values = values + noise * np.random.default_rng(seed).normal(size=len(angle))
    return AngleSignal("a", "g", values, turns, 1024, 400.0, 1.0)


def test_lines_between_the_bins_have_their_place_and_height():
    lines = {66.0: 1.0, 73 + 1 / 3: 0.5, 77.5074: 0.2, 120.0083: 0.3}
    order, height = sharpened_lines(windowed_spectrum(signal(lines)), -30.0)
    assert order == pytest.approx(list(lines), abs=2e-4)
    assert height == pytest.approx(list(lines.values()), rel=2e-3)


def test_noise_makes_no_lines():
    spectrum = windowed_spectrum(signal({66.0: 0.02}, noise=0.1))
    assert sharpened_lines(spectrum, -80.0)[0] == pytest.approx([66.0], abs=0.01)


def test_heights_err_by_three_standard_deviations_at_most():
    """Of lines on bins and between them, over many draws of the noise: 1 % beyond, and a third as much on average."""
    errors, stated = [], []
    for seed in range(40):
        lines = {66.0: 1.0, 73 + 1 / 120: 1.0, 90.2: 1.0}
        noisy = signal(lines, noise=4.0, seed=seed)
        spectrum = windowed_spectrum(noisy)
        order, height = sharpened_lines(spectrum, -20.0)
        near = [int(np.abs(order - at).argmin()) for at in lines]
        errors.append(20 * np.log10(height[near]))
        stated.append(level_uncertainty(spectrum, order, height)[near])
    share = np.abs(errors) / np.array(stated)
    assert (share > 1.0).mean() < 0.02
    assert np.sqrt((share**2).mean()) == pytest.approx(1 / 3, rel=0.2)
    late = level_uncertainty(spectrum, np.array([100.0]), np.array([1e9]), time_error=1e-4, speed=2.0)
    assert late == pytest.approx(20 * np.log10(1 + 0.5 * (2 * np.pi * 200.0 * 1e-4) ** 2), rel=1e-3)


def test_every_line_has_its_verdict():
    order, height = sharpened_lines(windowed_spectrum(signal(dict.fromkeys(LINES, 0.5), noise=1e-3)), -30.0)
    lines = judge_lines(order, height, np.zeros(len(order)), ANGLES, (70, 30, 20), 0.02)
    assert {round(line.order, 2): line.verdict for line in lines} == {
        round(at, 2): verdict for at, verdict in sorted(LINES.items())
    }
    assert max(line.level for line in lines) == 0.0 and lines[0].amplitude == pytest.approx(0.5, rel=0.01)


def test_tolerances_fit_the_record():
    assert order_tolerance(100) == 0.02 and order_tolerance(10) == 0.05 and order_tolerance(10, 0.1) == 0.1
    for turns, given in ((10, 0.04), (10, 0.25), (2, None)):
        with pytest.raises(CaseError, match="does not fit the record"):
            order_tolerance(turns, given)
    assert chance(0.02, (70, 30, 20), 1, ()) == pytest.approx(0.28, abs=0.01)
    # ten places, a tolerance on either side
    assert chance(0.02, (108, None, 40), 3, {"planet"}) == pytest.approx(1 - 0.96**10)


def test_noise_has_no_lines_at_the_ends_of_its_spectrum():
    """Seeds whose first or last bin is low, beside which noise would stand out."""
    for seed in (4, 19, 21, 33, 58):
        noise = np.random.default_rng(seed).normal(size=60 * 2700)
        spectrum = windowed_spectrum(AngleSignal("a", "", noise, 60, 2700, 901.0, 3.0))
        order, _ = sharpened_lines(spectrum, -30.0)
        assert not np.any((order < 2.0) | (order > 899.0))
