"""Damage sum, safety of a spectrum and equivalent torque, against closed forms and published figures."""

import math

import numpy as np
import pytest

from femgear.gears.gear_steels import GEAR_STEELS, LIMITED_PITTING
from femgear.gears.iso6336_life import (
    PITTING,
    ToothSpectrum,
    equivalent_torque,
    life_line,
    miner_damage,
    spectrum_safety,
)

ROOT = GEAR_STEELS["case hardened steel"].root_life


@pytest.mark.parametrize("exponent, ratio", [(3, 0.472620), (10 / 3, 0.480575), (6.61, 0.574189), (13.22, 0.715709)])
def test_equivalent_torque_of_three(exponent, ratio):
    assert equivalent_torque([200.0, -150.0, 80.0], [1, 9, 90], exponent) / 200.0 == pytest.approx(ratio, abs=5e-7)
    assert equivalent_torque([0.0], [1.0], exponent) == 0.0


@pytest.mark.parametrize("line", [ROOT, GEAR_STEELS["nitrided steel"].contact_life, LIMITED_PITTING])
def test_cycles_of_a_stress_are_those_of_its_factor(line):
    """The inverse of `LifeLine.at`, endless below it and none above."""
    cycles = np.geomspace(1.01 * line.cycles[0], 0.99e10, 9)
    factors = [line.at(number) for number in cycles]
    assert line.cycles_at(factors) == pytest.approx(cycles, rel=1e-9)
    assert line.cycles_at(np.array([0.0, 0.849, line.factors[0] * 1.001])).tolist() == [math.inf, math.inf, 0.0]


@pytest.mark.parametrize("cycles", [1e2, 1e5, 1e7, 1e12])
def test_one_load_case_has_the_life_factor_at_its_cycles(cycles):
    """S = Y_NT / ratio, on the static part, on both lines, and beyond 1e10."""
    assert spectrum_safety(np.array([0.7]), np.array([cycles]), ROOT) == pytest.approx(ROOT.at(cycles) / 0.7, rel=1e-12)


def test_two_halves_are_the_whole():
    ratio, cycles = np.array([1.2, 0.95, 0.9]), np.array([2e3, 5e6, 3e8])
    halves = np.repeat(ratio, 2), np.repeat(0.5 * cycles, 2)
    whole, parts = miner_damage(ratio, cycles, ROOT).sum(), miner_damage(*halves, ROOT).sum()
    assert parts == pytest.approx(whole, rel=1e-12)
    safety = spectrum_safety(ratio, cycles, ROOT)
    assert spectrum_safety(*halves, ROOT) == pytest.approx(safety, rel=1e-12)
    assert miner_damage(safety * ratio, cycles, ROOT).sum() == pytest.approx(1.0, rel=1e-9)


def test_damage_of_a_slope_is_that_of_the_equivalent_stress():
    """Between the static strength and long life all is one line of exponent p."""
    ratio, cycles = np.array([1.6, 1.3, 1.1]), np.array([1e3, 1e4, 2e5])
    mean = ((cycles @ ratio**ROOT.slope) / cycles.sum()) ** (1.0 / ROOT.slope)
    alone = miner_damage([mean], [cycles.sum()], ROOT)[0]
    assert miner_damage(ratio, cycles, ROOT).sum() == pytest.approx(alone, rel=1e-9)


def test_a_spectrum_tells_hours_and_shares():
    spectrum = ToothSpectrum(np.array([1.5, 0.9, 0.0]), np.array([10.0, 1e4, 1e5]), ROOT)
    damage = [10.0 / ROOT.cycles_at(1.5), 1e4 / ROOT.cycles_at(0.9), 0.0]
    assert spectrum.damage == pytest.approx(damage, rel=1e-12) and spectrum.hours == pytest.approx(1.0 / sum(damage))
    assert spectrum.damage_share == pytest.approx(np.array(damage) / sum(damage))
    # a stress beyond the static strength breaks at once, whatever the others do
    broken = ToothSpectrum(np.array([3.0, 0.9]), np.array([1.0, 1e4]), ROOT)
    assert broken.hours == 0.0 and broken.damage_share.tolist() == [1.0, 0.0]
    assert broken.safety(100.0) == pytest.approx(2.5 / 3.0, rel=1e-12)
    # load cases that never run do not count
    assert ToothSpectrum(np.array([3.0, 0.8]), np.array([0.0, 1.0]), ROOT).hours == math.inf
    assert math.isinf(ToothSpectrum(np.zeros(2), np.ones(2), ROOT).safety(1.0))


def test_lines_of_flanks_that_may_pit():
    assert life_line("case hardened steel", "flank", pitting=True) is LIMITED_PITTING
    assert life_line("case hardened steel", "flank") is GEAR_STEELS["case hardened steel"].contact_life
    assert life_line("nitrided steel", "root", pitting=True) is GEAR_STEELS["nitrided steel"].root_life
    # those whose line without pitting begins with 1.6, all steels and irons but the grey and the nitrided ones
    with_line = {name for name, steel in GEAR_STEELS.items() if steel.contact_life.factors[0] == 1.6}
    assert with_line == set(PITTING)
