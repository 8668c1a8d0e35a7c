"""femgear.measured.averages: waveforms of carrier, sun and planets that are put into a signal come out of it."""

import math

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.measured.averages import carrier_average, gear_average, passing_angle
from femgear.measured.heard_set import HeardSet
from femgear.measured.turns import AngleSignal

ANGLES = np.radians([0.0, 120.0, 240.0])
SAMPLES = 16


def heard_signal(heard, waves, *, turns, passing=0.2, noise=0.0, width=1.0):
    """Meshes of planets with the ring, each heard through a Hann window of a share of a turn as it passes.

    ``waves`` are those of sun and planets by their teeth; each is heard with every passage.
    """
    per_turn = heard.ring * SAMPLES
    position = np.arange(turns * per_turn)
    values = noise * np.random.default_rng(1).normal(size=len(position))
    for n, angle in enumerate(heard.angles):
        at = passing - angle / (2 * np.pi)
        away = np.mod(position / per_turn - at + 0.5, 1.0) - 0.5
        window = np.where(np.abs(away) < 0.5 * width, 0.5 + 0.5 * np.cos(2 * np.pi * away / width), 0.0)
        for gear, wave in waves.items():
            if gear != "sun" and gear != n + 1:
                continue
            # tooth 0 meshes at the first passage of this planet
            tooth = position - round((at % 1.0) * per_turn)
            values += window * wave[np.mod(tooth, len(wave))]
    return AngleSignal("a", "g", values, turns, per_turn, 1e4, 1.0)


def wave(teeth, fault=None):
    x = np.arange(teeth * SAMPLES) / SAMPLES
    values = np.cos(2 * np.pi * x)
    if fault is not None:
        values += 2.0 * np.exp(-(((np.mod(x - fault + teeth / 2, teeth) - teeth / 2) / 0.2) ** 2))
    return values - values.mean()


def test_the_carrier_average_keeps_what_is_the_same_in_every_turn():
    wave_of_turn = np.random.default_rng(2).normal(size=960)
    noise = np.random.default_rng(3).normal(size=(100, 960))
    signal = AngleSignal("a", "g", (wave_of_turn + noise).ravel(), 100, 960, 1e4, 1.0)
    error = carrier_average(signal) - (wave_of_turn - wave_of_turn.mean())
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.1, rel=0.1)  # one over the root of the turns


@pytest.mark.parametrize(("teeth", "turns"), [((30, 20, 71), 90), ((27, 40, 108), 60), ((28, 20, 68), 60)])
@pytest.mark.parametrize("number", [1, 2])
def test_a_faulty_tooth_of_a_planet_is_found_in_its_average(teeth, turns, number):
    sun, planet, ring = teeth
    heard = HeardSet(ring, sun, planet, ANGLES)
    waves = {n: wave(planet, 7 if n == number else None) for n in (1, 2, 3)}
    signal = heard_signal(heard, waves, turns=turns, noise=0.3, width=1 / 3)
    average = gear_average(signal, heard, "planet", planet=number, passing=0.2)
    step = math.gcd(planet, ring)
    if step <= 2:  # windows as short as the passing
        assert np.corrcoef(average, waves[number])[0, 1] > 0.95
    rest = average - np.tile(average.reshape(planet, -1).mean(axis=0), planet)
    assert abs(rest.argmax() / SAMPLES - 7.0) < 0.2
    other = gear_average(signal, heard, "planet", planet=number % 3 + 1, passing=0.2)
    left = other - np.tile(other.reshape(planet, -1).mean(axis=0), planet)
    assert left.max() < 0.3 * rest.max()


def test_a_faulty_tooth_of_the_sun_is_found_in_its_average():
    heard = HeardSet(71, 30, 20, ANGLES[:1])
    waves = {"sun": wave(30, 4)}
    signal = heard_signal(heard, waves, turns=90, noise=0.3)
    average = gear_average(signal, heard, "sun", passing=0.2)
    assert np.corrcoef(average, waves["sun"])[0, 1] > 0.95


def test_the_passing_is_found_where_the_planets_are_heard():
    heard = HeardSet(71, 30, 20, ANGLES)
    for passing in (0.05, 0.2, 0.3):
        signal = heard_signal(heard, {n: wave(20) for n in (1, 2, 3)}, turns=20, passing=passing, noise=0.2, width=0.5)
        assert abs(np.mod(passing_angle(signal, heard) - passing + 1 / 6, 1 / 3) - 1 / 6) < 0.02


def test_what_is_refused():
    heard = HeardSet(71, 30, 20, ANGLES)
    signal = heard_signal(heard, {1: wave(20)}, turns=10)
    for words, options in (("has passed the sensor", {}), ("no such planet", {"planet": 4})):
        with pytest.raises(CaseError, match=words):
            gear_average(signal, heard, "planet", **options)
    with pytest.raises(CaseError, match="not known"):
        gear_average(signal, HeardSet(71, None, 20, ANGLES), "sun")
