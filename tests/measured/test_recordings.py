"""femgear.measured.recordings: files of all formats by the end of their names, and what tells their angle."""

import re
from functools import cache

import numpy as np
import pytest
from recorded_signals import HEALTHY, RATE, recording, write_columns
from scipy.io import wavfile

from femgear.errors import CaseError
from femgear.measured.heard_set import HeardSet
from femgear.measured.lines import sharpened_lines
from femgear.measured.recordings import read_by_turns, read_channels
from femgear.measured.requests import Recording
from femgear.measured.spectra import windowed_spectrum
from validation.recordings import written as write_recording

HEARD = HeardSet(108, 27, 40, np.radians([0, 120, 240]), "sun", {"sun": 0.2, "carrier": 1.0})
SIGNAL, PULSES, TURNS = recording(HEALTHY, HEALTHY.values(), seconds=4.0)


def written(folder, kind):
    return write_recording(folder, kind, SIGNAL, PULSES, RATE)


@pytest.mark.parametrize("kind", ["csv", "wav", "mat", "uff"])
def test_formats_give_the_same_signal_over_the_angle(kind, tmp_path):
    path = written(tmp_path, kind)
    assert [len(channel.values) for channel in read_channels(path)] == [len(SIGNAL)] * 2
    over_angle = read_by_turns(path, Recording(channel="1", pulses="2"), HEARD)
    assert over_angle.turns == 11 and over_angle.speed == pytest.approx(3.0, rel=0.02)
    alone = read_by_turns(path, Recording(pulses="2"), HEARD)  # the other channel is the signal
    assert np.array_equal(alone.values, over_angle.values)


def test_a_speed_that_is_searched_holds_for_high_orders_too(tmp_path):
    seconds, rate, carrier = 6.0, 48000.0, 10.331
    time = np.arange(int(seconds * rate)) / rate
    orders = (321, 327, 429, 435, 1074, 1086, 1506, 1518)
    signal = sum(np.sin(2 * np.pi * order * carrier * time + order) for order in orders)
    wavfile.write(tmp_path / "a.wav", int(rate), signal.astype(np.float32))
    searched = Recording(speed="3100 rpm", within=0.002)
    found, _ = sharpened_lines(windowed_spectrum(read_by_turns(tmp_path / "a.wav", searched, HEARD)), -30.0)
    assert found == pytest.approx(orders, abs=5e-3)


def test_a_constant_speed_is_that_of_the_input(tmp_path):
    path = written(tmp_path, "wav")
    over_angle = read_by_turns(path, Recording(channel="1", speed="900 rpm"), HEARD)
    assert over_angle.turns == 11 and over_angle.speed == pytest.approx(3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("speed", "within", "wander", "words"),
    [
        (3.0, None, 0.0, None),
        (3.006, None, 0.0, "stand best on orders of the set at 901."),
        (3.006, 0.0035, 0.0, None),
        (3.0, 0.0035, 0.004, "from the first half to the second the speed changes"),
    ],
)
def test_a_constant_speed_that_is_none_is_told(speed, within, wander, words, tmp_path, recwarn):
    signal, _, _ = recording(HEALTHY, HEALTHY.values(), seconds=6.0, carrier=speed, wander=wander)
    path = write_columns(tmp_path / "a.csv", "time [s];acc\n", (np.arange(len(signal)) / RATE, signal))
    over_angle = read_by_turns(path, Recording(speed="900 rpm", within=within), HEARD)
    told = [str(warning.message) for warning in recwarn]
    assert (told == []) if words is None else (words in told[0] and "W-UNSTEADY" in told[0])
    if not wander:
        assert over_angle.speed == pytest.approx(speed if within else 3.0, rel=1e-3)


def test_a_start_from_rest_is_left_out_as_the_refusal_says(tmp_path):
    """At rest up to 2 s, then faster and faster up to 4 s."""
    time = np.arange(int(10 * RATE)) / RATE
    turns = 3.0 * np.cumsum(np.clip(0.5 * (time - 2.0), 0.0, 1.0)) / RATE
    signal = sum(height * np.cos(2 * np.pi * order * turns) for order, height in HEALTHY.items())
    signal = np.real(signal) + 1e-3 * np.random.default_rng(4).normal(size=len(time))
    path = write_recording(tmp_path, "wav", signal, 5.0 * (np.mod(5.0 * turns, 1.0) < 0.1) * (turns > 0), RATE)
    with pytest.raises(CaseError, match="--begin or --end") as refused:
        read_by_turns(path, Recording(channel="1", pulses="2"), HEARD)
    assert refused.value.code == "E-FILE"
    over_angle = read_by_turns(path, Recording(channel="1", pulses="2", begin=4.0, end=9.0), HEARD)
    assert over_angle.speed == pytest.approx(3.0, rel=1e-3)
    order, height = sharpened_lines(windowed_spectrum(over_angle), -19.0)
    assert order == pytest.approx([3, 213, 219, 321, 327], abs=0.02)
    assert height == pytest.approx([abs(HEALTHY[round(at)]) for at in order], rel=0.05)


@cache
def unequal_sun() -> np.ndarray:
    """Eight seconds of all whole orders that a sun of unequal teeth makes at three turns a second."""
    time, order = np.arange(8 * 6400) / 6400.0, np.arange(90, 700)
    height = np.choose(order % 3, [0.1, 1.0, 0.3]) * (order / 330) ** 2
    return sum(a * np.cos(2 * np.pi * n * 3.0 * time + n * n) for n, a in zip(order.tolist(), height.tolist()))


@pytest.mark.parametrize("within", [None, 0.003])
@pytest.mark.parametrize("nominal", [900.0, 899.0])
def test_loud_lines_of_a_fault_do_not_shift_a_speed(nominal, within, tmp_path, recwarn):
    """A sun of unequal teeth makes all whole orders, two thirds of them no multiples of three and louder than those."""
    wavfile.write(tmp_path / "a.wav", 6400, unequal_sun().astype(np.float32))
    over_angle = read_by_turns(tmp_path / "a.wav", Recording(speed=f"{nominal} rpm", within=within), HEARD)
    # the mean speed is that over whole turns less a sample
    assert over_angle.speed == pytest.approx(3.0 if within else nominal / 300, rel=5e-5)
    stated = [str(warning.message) for warning in recwarn]
    if within or nominal == 900.0:
        assert stated == []
    else:
        found = re.search(r"stand best on orders of the set at ([\d.]+) rpm", stated[0])
        assert found and float(found[1]) == pytest.approx(900.0, rel=5e-5)


@pytest.mark.parametrize("carrier", [3.006, 3.0126])
def test_a_range_that_is_advised_is_allowed(carrier, tmp_path, recwarn):
    signal, _, _ = recording(HEALTHY, HEALTHY.values(), seconds=6.0, carrier=carrier, wander=0.0)
    path = write_columns(tmp_path / "a.csv", "time [s];acc\n", (np.arange(len(signal)) / RATE, signal))
    read_by_turns(path, Recording(speed="900 rpm"), HEARD)
    (text,) = (str(warning.message) for warning in recwarn)
    if advised := re.search(r"give --within ([\d.]+)", text):
        read_by_turns(path, Recording(speed="900 rpm", within=float(advised[1])), HEARD)
    assert bool(advised) == (carrier == 3.006)
    assert advised or "record pulses of a turn" in text


def test_pulses_of_few_samples_tell_from_which_order_on_they_make_false_lines(tmp_path, recwarn):
    """At a speed that hardly changes a step of the samples is a slow wave in the times of the pulses."""
    signal, pulses, _ = recording(HEALTHY, HEALTHY.values(), rate=3000.0, wander=3e-4, noise=1e-4)
    path = write_recording(tmp_path, "wav", signal, pulses, 3000.0)
    spectrum = windowed_spectrum(read_by_turns(path, Recording(channel="1", pulses="2"), HEARD))
    (text,) = (str(warning.message) for warning in recwarn)
    assert "W-RATE" in text and "pulses tell the angle to" in text
    from_order = float(re.search(r"from order (\d+) on", text)[1])
    order, height = sharpened_lines(spectrum, -30.0)
    false = np.array([np.abs(np.array(list(HEALTHY)) - at).min() > 0.05 for at in order])
    # they are there, above the order and below the size that is told
    assert false.any() and order[false].min() > from_order
    assert height[false].max() < 10 ** (-30.0 / 20) * order[false].max() / from_order


def test_accelerations_come_in_si_units(tmp_path):
    path = written(tmp_path, "wav")
    plain, scaled = (
        read_by_turns(path, Recording(channel="1", speed="900 rpm", unit=unit), HEARD) for unit in (None, "2 g")
    )
    assert plain.unit == "" and scaled.unit == "m/s^2"
    assert np.allclose(scaled.values, 2 * 9.80665 * plain.values)


@pytest.mark.parametrize(
    ("recorded", "code", "words"),
    [
        (Recording(channel="1"), "E-SPEED", "neither"),
        (Recording(channel="1", pulses="2", speed="900 rpm"), "E-SPEED", "both"),
        (Recording(channel="1", speed="0 rpm"), "E-SPEED", "at rest nothing is heard"),
        (Recording(channel="1", pulses="2", pulses_of="ring"), "E-SPEED", "a turn of the ring"),
        (Recording(channel="1", pulses="2", per_turn=0), "E-SPEED", "0 a turn"),
        (Recording(channel="1", speed="900 rpm", unit="2 V"), "E-UNIT", "m/s^2, m/s2"),
        (Recording(channel="1", speed="900 rpm", unit="g"), "E-UNIT", "a number above zero"),
        (Recording(pulses="9"), "E-FILE", "choose one by --pulses"),
        (Recording(speed="900 rpm"), "E-FILE", "choose one by --channel"),
        (Recording(channel="1", speed="900 rpm", rate=1e3), "E-FILE", "another one than --rate"),
    ],
)
def test_what_is_refused(recorded, code, words, tmp_path):
    with pytest.raises(CaseError) as refused:
        read_by_turns(written(tmp_path, "wav"), recorded, HEARD)
    assert refused.value.code == code and words in str(refused.value)
