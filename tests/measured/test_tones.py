"""femgear.measured.tones: hum is taken off where the speed changes, and lines of the set stay as they were."""

from dataclasses import replace

import numpy as np
import pytest
from recorded_signals import CASE, HEALTHY, RATE, recording, write_columns

from femgear.measured.channels import Channel
from femgear.measured.lines import VERDICTS, sharpened_lines
from femgear.measured.requests import LineSearch, Recording
from femgear.measured.spectra import windowed_spectrum
from femgear.measured.tones import without_tones
from femgear.measured.turns import resample_turns, turns_of_pulses
from femgear.measured.verdict import describe_verdict, measured_verdict
from femgear.trains.reading import read_case


def channels(lines, tones, **options):
    """Signal and turns of the carrier of a recording of lines with tones {frequency: amplitude} added."""
    signal, pulses, _ = recording(lines, lines.values(), **options)
    time = np.arange(len(signal)) / RATE
    for number, (frequency, amplitude) in enumerate(tones.items()):
        signal = signal + amplitude * np.cos(2 * np.pi * frequency * time + number)
    turns = turns_of_pulses(Channel("a", "tacho", "V", RATE, pulses)).of_shaft(1 / 5)
    return Channel("a", "acc", "m/s^2", RATE, signal), turns


@pytest.mark.parametrize(("amplitude", "wander"), [(100.0, 0.01), (0.1, 0.05)])
def test_tones_are_found_with_their_frequencies_and_heights_and_leave_the_lines(amplitude, wander):
    tones = {50.0: amplitude, 150.03: 0.3 * amplitude}
    signal, found = without_tones(*channels(HEALTHY, tones, wander=wander))
    assert {round(tone.frequency, 2): pytest.approx(tone.amplitude, rel=0.01) for tone in found} == tones
    clean = windowed_spectrum(resample_turns(*channels(HEALTHY, {}, wander=wander)))
    left = windowed_spectrum(signal)
    # what is left of the hum, at the orders over which it would be smeared, is at most -80 dB of it or noise
    assert np.abs(left.value - clean.value).max() < 1e-4 * amplitude + 1e-4
    order, height = sharpened_lines(left, -35.0)
    expected = np.array([(at, abs(value)) for at, value in HEALTHY.items() if abs(value) > 0.02])
    assert order == pytest.approx(expected[:, 0], abs=0.01) and height == pytest.approx(expected[:, 1], rel=0.02)


def test_hum_that_drifts_as_the_mains_do_is_taken_off_with_what_lies_beside_it():
    drift = 0.02
    signal, turns = channels(HEALTHY, {}, wander=0.01)
    time = signal.time
    hum = 100.0 * np.cos(2 * np.pi * (50.0 * time + drift * 17.0 / (2 * np.pi) * np.sin(2 * np.pi * time / 17.0)))
    left, (tone,) = without_tones(replace(signal, values=signal.values + hum), turns)
    assert tone.frequency == pytest.approx(50.0, abs=0.05) and 0.1 <= tone.width < 0.3
    order, _ = sharpened_lines(windowed_spectrum(left), -35.0)
    expected = [at for at, value in HEALTHY.items() if abs(value) > 0.02]
    assert order == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("wander", [0.0, 0.002, 0.1])
def test_lines_of_turning_parts_are_no_tones(wander):
    """Nor are the many of a faulty planet tooth, a tenth of an order apart."""
    dense = HEALTHY | {108 + 2.7 * turn + q: 0.3 for turn in range(-6, 7) for q in (-2, -1, 0, 1, 2) if turn}
    signal, turns = channels(dense, {}, wander=wander)
    left, found = without_tones(signal, turns)
    assert found == () and np.array_equal(left.values, resample_turns(signal, turns).values)


def test_a_verdict_names_the_hum_and_is_that_without_it(tmp_path, recwarn):
    verdicts = []
    for amplitude in (0.0, 100.0):
        signal, pulses, _ = recording(HEALTHY, HEALTHY.values(), wander=0.01, seconds=10.0)
        time = np.arange(len(signal)) / RATE
        columns = time, signal + amplitude * np.cos(2 * np.pi * 50.0 * time), pulses
        path = write_columns(tmp_path / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns, comma=True)
        recwarn.clear()
        verdicts.append(measured_verdict(read_case(CASE), path, Recording(pulses="tacho")))
        told = [str(warning.message) for warning in recwarn if "W-TONE" in str(warning.message)]
        assert len(told) == (amplitude > 0) and all("50 Hz (100 m/s^2)" in text for text in told)
    without, with_hum = (verdict.lines for verdict in verdicts)
    assert [line.verdict for line in with_hum] == [line.verdict for line in without]
    assert [line.level for line in with_hum] == pytest.approx([line.level for line in without], abs=0.05)


def test_at_a_constant_speed_hum_is_a_line_from_elsewhere_that_hides_none(tmp_path, recwarn):
    lines = HEALTHY | {17.37: 100.0}
    signal, pulses, _ = recording(lines, lines.values(), wander=0.0, noise=1e-6)
    columns = np.arange(len(signal)) / RATE, signal, pulses
    path = write_columns(tmp_path / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns, comma=True)
    verdict = measured_verdict(read_case(CASE), path, Recording(pulses="tacho"))
    assert not [warning for warning in recwarn if "W-UNSTEADY" in str(warning.message)]
    assert not any("mains" in note for block in describe_verdict(verdict, LineSearch()) for note in block.notes)
    foreign = [line for line in verdict.lines if line.verdict == VERDICTS[-1]]
    assert [round(line.level) for line in foreign] == [40]
    normal = [round(line.order) for line in verdict.lines if line.verdict == VERDICTS[0]]
    assert normal == [at for at, value in HEALTHY.items() if abs(value) > 10 ** (-30 / 20)]


def test_a_line_where_hum_of_the_mains_would_be_is_named(tmp_path):
    """At a constant speed it may be a line from elsewhere, or fit turns of a part by chance."""
    lines = HEALTHY | {100.0 / 3.0: 10.0}
    signal, pulses, _ = recording(lines, lines.values(), wander=0.0, noise=1e-6)
    columns = np.arange(len(signal)) / RATE, signal, pulses
    path = write_columns(tmp_path / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns)
    verdict = measured_verdict(read_case(CASE), path, Recording(pulses="tacho"))
    notes = [note for block in describe_verdict(verdict, LineSearch()) for note in block.notes]
    assert "the line at order 33.33 is at 100.00 Hz, where hum of the mains would be" in notes
