"""Low-passed records at the ends of a run: what is kept, what does not fold back."""

import numpy as np
import pytest

from femgear.solvers.time.low_pass import Decimator

EVERY, COUNT = 20, 6000


def records(columns, *, every=EVERY, block=700):
    table = np.stack(columns, axis=1)
    decimator = Decimator(every, len(table) - 1)
    return np.vstack([decimator.push(table[i : i + block]) for i in range(0, len(table), block)])


def tones(share):
    """Tones of eight phases at a share of half the record rate, (steps, 8)."""
    angle = np.pi * share / EVERY * np.arange(COUNT + 1)
    return [np.cos(angle + phase) for phase in np.linspace(0.0, np.pi, 9)[:-1]]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize(("share", "kept"), [(2.0, 0.37), (6.0, 0.12), (12.0, 0.07)])
def test_ends_do_not_fold_back(share, kept):
    """The raw step has 0.71 of a tone of amplitude one."""
    wave = tones(share)
    found, raw = records(wave), np.stack(wave, axis=1)[::EVERY]
    ends = [0, -1]
    assert rms(raw[ends]) == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert rms(found[ends]) < kept and rms(found[[1, 2, 3, -2, -3, -4]]) < 0.05 and rms(found[30:-30]) < 1e-4


@pytest.mark.parametrize(("share", "missed"), [(0.1, 3e-3), (0.3, 0.06), (0.5, 0.21)])
def test_ends_keep_slow_motion(share, missed):
    wave = tones(share)
    error = records(wave) - np.stack(wave, axis=1)[::EVERY]
    assert rms(error[[0, -1]]) < missed and rms(error[[1, -2]]) < 0.25 * missed and rms(error[30:-30]) < 1e-4


@pytest.mark.parametrize("count", [1, 2, 3, 19, 20, 21, 40, 250, 1201])
def test_constants_and_ramps_pass_in_short_runs(count):
    steps = np.arange(count + 1.0)
    columns = [np.full(count + 1, 7.0), 3.0 - 0.5 * steps]
    found = records(columns, block=17)
    assert found.shape == (count // EVERY + 1, 2)
    assert np.abs(found - np.stack(columns, axis=1)[::EVERY]).max() < 1e-11 * count
