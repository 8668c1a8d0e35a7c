"""femgear.measured.turns: the angle from pulses, and signals over it, beside those that are known."""

import numpy as np
import pytest
from recorded_signals import HEALTHY, RATE, recording

from femgear.errors import CaseError
from femgear.measured.channels import Channel
from femgear.measured.lines import sharpened_lines
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.turns import constant_turns, curvature_penalty, resample_turns, turns_of_pulses

ORDER, VALUE = np.array(list(HEALTHY), float), np.array(list(HEALTHY.values()))
SIGNAL, PULSES, TURNS = recording(ORDER, VALUE)


def channel(values, name="a", rate=RATE, start=0.0):
    return Channel("file.csv", name, "V", rate, np.asarray(values, float), start)


def edges(values, where=None):
    """Pulses with the samples of one of them changed."""
    changed = np.array(values, float)
    rising = np.flatnonzero(np.diff(changed) > 1.0) + 1
    return changed, rising


@pytest.mark.parametrize("kind", ["sharp", "rounded", "noisy", "falling"])
def test_pulses_tell_the_angle(kind):
    pulses = PULSES
    if kind == "rounded":
        pulses = np.convolve(PULSES, np.hanning(21) / np.hanning(21).sum(), mode="same")
    elif kind == "noisy":
        pulses = PULSES + 0.2 * np.random.default_rng(3).normal(size=len(PULSES))
    elif kind == "falling":
        pulses = 5.0 - PULSES
    turns = turns_of_pulses(channel(pulses)).of_shaft(1 / 5)
    heard = np.interp(turns.time, np.arange(len(TURNS)) / RATE, TURNS)
    error = (heard - turns.turns) - (heard - turns.turns).mean()
    # a step is 3.7e-4 turns of the carrier, and 1.1e-4 the r.m.s. of what it hides
    assert np.sqrt(np.mean(error**2)) < (0.6 if kind != "noisy" else 1.0) * 1.1e-4


def missing(values, rising):
    values[rising[40] - 2 : rising[41] - 2] = values[rising[40] - 2]


def doubled(values, rising):
    values[rising[40] + 200 : rising[40] + 202] = 5.0


def few(values, rising):
    values[rising[1] + 90 :] = 0.0


def second_missing(values, rising):
    values[rising[1] - 2 : rising[2] - 2] = values[rising[1] - 2]


def last_missing(values, rising):
    values[rising[-2] - 2 : rising[-1] - 2] = values[rising[-2] - 2]


def every_other_missing(values, rising):
    for k in range(1, 30, 2):
        values[rising[k] - 2 : rising[k + 1] - 2] = values[rising[k] - 2]


def late(values, rising):
    at = rising[40] + (rising[41] - rising[40]) // 10
    values[rising[40] - 2 : rising[41] - 2] = values[rising[40] - 2]
    values[at : at + 20] = values.max()


@pytest.mark.parametrize("change", [second_missing, last_missing, every_other_missing, late])
def test_wrong_pulses_at_the_ends_and_regular_ones_are_refused(change):
    values, rising = edges(PULSES)
    change(values, rising)
    with pytest.raises(
        CaseError, match="a pulse is late at" if change is late else "a pulse|pulse too many"
    ) as refused:
        turns_of_pulses(channel(values))
    assert refused.value.code == "E-FILE"
    if change is late:
        stated = float(str(refused.value).partition("late at ")[2].split()[0])
        interval = (rising[41] - rising[40]) / RATE
        assert stated == pytest.approx(rising[40] / RATE + 0.1 * interval, abs=0.01 * interval)


@pytest.mark.parametrize(
    ("change", "words"), [(missing, "a pulse is missing at"), (doubled, "a pulse too many at"), (few, "2 pulses")]
)
def test_wrong_pulses_are_refused_with_their_time(change, words):
    values, rising = edges(PULSES)
    change(values, rising)
    with pytest.raises(CaseError, match=words) as refused:
        turns_of_pulses(channel(values))
    assert refused.value.code == "E-FILE" and refused.value.remedy and "channel a" in str(refused.value)


def test_two_pulses_at_one_sample_and_too_slow_a_rate_are_refused():
    values = np.zeros(4000)
    values[50::100] = 5.0
    values[1051] = 5.0  # and the next sample again, after one at rest
    values[1052:1054] = 0.0, 5.0
    with pytest.raises(CaseError, match="too many"):
        turns_of_pulses(channel(values))
    with pytest.raises(CaseError, match="too few samples between pulses"):
        turns_of_pulses(channel(np.arange(4000) % 3 == 0))


@pytest.mark.parametrize("noise", [0.01, 0.5, 5.0])
@pytest.mark.parametrize(("count", "spacing"), [(12, 1.0), (59, 2.0), (200, 1.0)])
def test_smoothing_is_that_of_scipy(count, spacing, noise):
    """Which solves banded equations for every penalty that it tries."""
    from scipy.interpolate import make_smoothing_spline

    place = spacing * np.arange(count)
    values = np.sin(place / 7.0) + noise * np.random.default_rng(count).uniform(-0.5, 0.5, count)
    own = make_smoothing_spline(place, values, lam=curvature_penalty(values, spacing))
    assert own(place) == pytest.approx(make_smoothing_spline(place, values)(place), abs=1e-6)


@pytest.mark.parametrize("wander", [0.0, 0.01, 0.05])
def test_lines_come_back_at_their_orders_with_their_heights(wander):
    signal, pulses, _ = recording(ORDER, VALUE, wander=wander)
    over_angle = resample_turns(channel(signal), turns_of_pulses(channel(pulses)).of_shaft(1 / 5))
    order, height = sharpened_lines(windowed_spectrum(over_angle), -40.0)
    assert np.abs(order - ORDER).max() < 0.01
    assert np.abs(20 * np.log10(height / np.abs(VALUE))).max() < 0.2


def test_a_pulse_a_turn_of_the_carrier_and_another_rate_suffice():
    _, _, turns = recording(ORDER, VALUE, wander=0.01, rate=50000.0)
    pulse = channel(np.mod(turns, 1.0) < 0.05, rate=50000.0)
    over_angle = resample_turns(channel(SIGNAL), turns_of_pulses(pulse))
    order, height = sharpened_lines(windowed_spectrum(over_angle), -30.0)
    strong = np.abs(VALUE) > 0.04
    assert np.abs(order - ORDER[strong]).max() < 0.01
    assert np.abs(20 * np.log10(height / np.abs(VALUE[strong]))).max() < 0.2


def test_records_that_do_not_fit_are_refused():
    turns = turns_of_pulses(channel(PULSES)).of_shaft(1 / 5)
    with pytest.raises(CaseError, match="3 whole turns of the carrier"):
        resample_turns(channel(SIGNAL[: int(1.2 * RATE)]), turns)
    with pytest.raises(CaseError, match="pulses cover a part of the signal alone"):
        resample_turns(channel(SIGNAL, rate=RATE / 4), turns)
    with pytest.raises(CaseError, match="whole turns"):
        resample_turns(channel(SIGNAL, start=100.0), turns)


def test_orders_end_where_the_interpolation_does():
    slow = resample_turns(channel(SIGNAL), constant_turns(channel(SIGNAL), 3.0))
    assert slow.highest_order == pytest.approx(RATE / 9.0, rel=1e-3)
    time = np.arange(len(SIGNAL)) / RATE
    signal = np.cos(2 * np.pi * 0.33 * RATE * time)
    _, height = sharpened_lines(
        windowed_spectrum(resample_turns(channel(signal), constant_turns(channel(signal), 3.1))), -40
    )
    assert 20 * np.log10(height[0]) == pytest.approx(-0.15, abs=0.05)
