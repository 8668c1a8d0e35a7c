"""femgear.measured.aligned_speed: lines at orders of a set tell its speed, whatever else is loud."""

import numpy as np
import pytest
from recorded_signals import HEALTHY, RATE, recording

from femgear.errors import CaseError
from femgear.measured.aligned_speed import aligned_speed
from femgear.measured.channels import Channel
from femgear.measured.heard_set import HeardSet
from femgear.measured.lines import sharpened_lines
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.turns import constant_turns, resample_turns

ORDER, VALUE = np.array(list(HEALTHY), float), np.array(list(HEALTHY.values()))
REFERENCE = HeardSet(108, 27, 40, np.radians([0, 120, 240]), "sun", {"sun": 0.2, "carrier": 1.0})
WITHIN, SECONDS = 0.003, 5.0


def channel(values):
    return Channel("file.csv", "a", "V", RATE, np.asarray(values, float))


def test_a_nominal_speed_is_aligned_with_the_lines():
    signal, _, _ = recording(ORDER, VALUE, wander=0.0, carrier=3.0085)
    speed = aligned_speed(channel(signal), 3.0, ORDER, 0.0035)
    assert speed == pytest.approx(3.0085, rel=2e-5)
    over_angle = resample_turns(channel(signal), constant_turns(channel(signal), speed))
    order, height = sharpened_lines(windowed_spectrum(over_angle), -40.0)
    assert np.abs(order - ORDER).max() < 0.01
    assert np.abs(20 * np.log10(height / np.abs(VALUE))).max() < 0.2


def test_a_range_within_which_other_lines_fit_is_refused():
    signal, _, _ = recording(ORDER, VALUE, seconds=4.0)
    with pytest.raises(CaseError, match="would fit as well"):
        aligned_speed(channel(signal), 3.0, ORDER, 0.004)


@pytest.mark.parametrize("lines", [1, 4])
@pytest.mark.parametrize("louder", [0.0, 20.0, 40.0])
def test_loud_lines_from_elsewhere_do_not_shift_a_speed(louder, lines):
    """Of 50 recordings each is right within half a step of orders at the highest one."""
    orders = REFERENCE.symmetric_orders(3)
    further = REFERENCE.whole_orders(RATE / 9)
    time = np.arange(int(SECONDS * RATE)) / RATE
    for seed in range(50):
        draws = np.random.default_rng(seed)
        speed = 3.0 * (1.0 + 0.7 * WITHIN * draws.uniform(-1, 1))
        signal, *_ = recording(ORDER, VALUE, carrier=speed, wander=0.0, seconds=SECONDS, noise=0.05, seed=seed)
        for frequency, phase in zip(draws.uniform(20, RATE / 3, lines), draws.uniform(0, 6.28, lines)):
            signal += 10 ** (louder / 20) * np.cos(2 * np.pi * frequency * time + phase)
        found = aligned_speed(channel(signal), 3.0, orders, WITHIN, further=further)
        assert abs(found / speed - 1.0) * ORDER.max() < 0.5 / (SECONDS * speed)


def test_noise_alone_gives_a_speed_within_the_range():
    signal = np.random.default_rng(2).normal(size=20_000)
    found = aligned_speed(channel(signal), 3.0, REFERENCE.symmetric_orders(3), WITHIN)
    assert abs(found / 3.0 - 1.0) <= 1.0001 * WITHIN
