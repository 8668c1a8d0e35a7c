"""femgear.measured.verdict: recordings that femgear makes itself come back, healthy and unequal sets are told apart."""

import csv
import warnings

import numpy as np
import pytest
from recorded_signals import CASE, HEALTHY, RATE, recording, write_columns

from femgear import cli, read_case
from femgear.measured.heard_set import HeardSet
from femgear.measured.lines import VERDICTS
from femgear.measured.requests import Recording
from femgear.measured.verdict import draw_side_bands, measured_verdict
from femgear.report.style import png_bytes
from validation.recordings import FAULTS, come_back, computed_lines, read_back

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

NORMAL, UNEQUAL = VERDICTS[:2]


def written(folder, order, value, **options):
    signal, pulses, _ = recording(order, value, **options)
    columns = np.arange(len(signal)) / RATE, signal, pulses
    return write_columns(folder / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns, comma=True)


def test_the_command_prints_a_verdict_for_every_line_and_writes_files(tmp_path, capsys):
    lines = HEALTHY | {215: 0.2, 108 + 2.7: 0.1, 216.13: 0.05}
    path = written(tmp_path, lines, lines.values())
    assert cli.main(["measured", str(CASE), str(path), "--pulses", "tacho", "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "multiples of 3" in printed and "error or fault of a planet: strongest -20.0 dB at order 110.70" in printed
    assert "1 needs unequal turning parts, 1 error or fault of a planet, 1 not from this gearbox" in printed
    with open(tmp_path / "out" / "lines.csv", newline="", encoding="utf-8") as stream:
        rows = {round(float(row["order"]), 2): row for row in csv.DictReader(stream)}
    assert (
        rows.keys() == {round(order, 2) for order in lines if order != 216}
        and rows[110.7]["why"] == "108 + 1 turn of a planet"
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} > {"order_spectrum.csv", "lines.png"}
    assert cli.main(["measured", str(CASE), str(path)]) == 2
    assert "[E-FILE]" in capsys.readouterr().err


def test_averages_densities_and_responses_are_written(tmp_path, capsys):
    signal, pulses, _ = recording(HEALTHY, HEALTHY.values(), wander=0.0)
    force = np.random.default_rng(7).normal(size=len(signal))
    columns = np.arange(len(signal)) / RATE, signal + 3 * force, pulses, force
    path = write_columns(tmp_path / "a.csv", "time [s];acc [m/s^2];tacho [V];hammer [N]\n", columns)
    words = ["measured", str(CASE), str(path), "--channel", "acc", "--pulses", "tacho"]
    further = ["--average", "carrier", "--average", "planet 2", "--density", "--force", "hammer"]
    assert cli.main([*words, *further, "-o", str(tmp_path / "out")]) == 0

    def table(name):
        return np.genfromtxt(tmp_path / "out" / name, delimiter=",", skip_header=1).T

    turn, average = table("average_carrier.csv")
    exact = sum(np.real(height) * np.cos(2 * np.pi * order * turn) for order, height in HEALTHY.items())
    shift = np.fft.irfft(np.fft.rfft(average) * np.conj(np.fft.rfft(exact)))
    assert shift.max() / (exact @ exact) == pytest.approx(1.0, abs=0.05)  # but for where the record begins
    assert table("average_planet_2.csv")[0][-1] == pytest.approx(40.0, abs=0.05)
    frequency, response, _, coherence = table("frequency_response.csv")
    assert np.median(response) == pytest.approx(3.0, rel=0.02) and np.median(coherence) > 0.99
    assert table("density.csv").shape == (2, len(frequency))
    assert cli.main([*words, "--average", "sun"]) == 2 and "name one by -o" in capsys.readouterr().err
    assert cli.main([*words, "--average", "ring"]) == 2 and "no such average" in capsys.readouterr().err


def test_pulses_that_are_counted_as_half_of_them_are_told_with_the_factor(tmp_path, recwarn):
    path = written(tmp_path, HEALTHY, HEALTHY.values())
    measured_verdict(read_case(CASE), path, Recording(pulses="tacho"))
    assert not [one for one in recwarn if "W-UNSTEADY" in str(one.message)]
    measured_verdict(read_case(CASE), path, Recording(pulses="tacho", per_turn=2))
    (text,) = (str(one.message) for one in recwarn if "W-UNSTEADY" in str(one.message))
    assert (
        "near mesh harmonics, not" in text
        and "if the carrier made 2 times as many turns" in text
        and "--per-turn" in text
    )


def test_lines_that_fit_a_fault_alone_are_doubted(tmp_path, recwarn):
    """The gears of another set may have lines at turns of the sun; a faulty set has those of a healthy one too."""
    lines = {5 * turn + 1: 1.0 for turn in (19, 23, 29, 37, 41, 43, 52)}
    for more, doubted in (({}, True), ({324: 0.5}, False)):
        order = np.array([at for at in lines | more if at % 3 or at in more])
        recwarn.clear()
        measured_verdict(read_case(CASE), written(tmp_path, order, np.ones(len(order))), Recording(pulses="tacho"))
        texts = [str(warning.message) for warning in recwarn if "W-UNSTEADY" in str(warning.message)]
        assert any("no line lies where a healthy set has lines" in text for text in texts) == doubted


def test_silence_has_no_lines(tmp_path):
    verdict = measured_verdict(read_case(CASE), written(tmp_path, [3], [1e-6], noise=1e6), Recording(pulses="tacho"))
    assert verdict.lines == ()


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
def test_computed_signals_with_noise_and_a_wandering_speed_come_back(kind):
    """Orders within 0.01, levels within 0.2 dB where the noise beside them allows, else within what is stated."""
    assert {row.verdict for row in come_back((kind,))} == {"passes"}
    # logic levels tell the angle too coarsely for the weakest lines beside loud ones (W-RATE); a sensor does not
    found, _ = read_back(kind, logic=False)
    (order, value), verdicts = computed_lines(kind), {line.verdict for line in found.lines}
    # all that lie half a decibel above the threshold are there
    loud = order[np.abs(value) > 10 ** (-34.5 / 20) * np.abs(value).max()]
    assert np.abs(loud[:, None] - [line.order for line in found.lines]).min(axis=1).max() < 0.01
    assert (verdicts == {NORMAL}) if kind == "healthy" else (UNEQUAL in verdicts)


def test_every_line_states_by_how_much_it_may_be_wrong(tmp_path, capsys):
    path = written(tmp_path, HEALTHY, HEALTHY.values(), noise=0.05)
    assert cli.main(["measured", str(CASE), str(path), "--pulses", "tacho", "-o", str(tmp_path / "out")]) == 0
    assert "± [dB]" in capsys.readouterr().out
    with open(tmp_path / "out" / "lines.csv", newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            order, stated = round(float(row["order"])), float(row["uncertainty [dB]"])
            assert abs(20 * np.log10(float(row["amplitude [m/s^2]"]) / abs(HEALTHY[order]))) < stated < 6.0


@pytest.mark.parametrize("harmonics", [(1,), (1, 2, 3), (900, 1000, 1100)])
def test_many_lines_of_every_verdict_fit_the_figure(harmonics):
    """Matplotlib warns where axes collapse, which ends this test."""
    heard = HeardSet(108, 27, 40, np.radians([0, 120, 240]))
    lines = {
        verdict: [(108.0 * h + 2.0 * i, -3.0 * i) for h in harmonics for i in range(-6, 7)] for verdict in VERDICTS
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = draw_side_bands(heard, lines, threshold=-60.0, harmonics=harmonics, half_width=12)
        png_bytes(figure)
    assert min(ax.get_position().height * figure.get_figheight() for ax in figure.axes) > 1.0


def test_lines_of_every_verdict_are_drawn_at_their_orders():
    heard = HeardSet(108, 27, 40, np.radians([0, 120, 240]))
    lines = {"normal": [(108.0, 0.0), (219.0, -3.0)], "odd": [(109.0, -9.0)], "none": []}
    figure = draw_side_bands(heard, lines, threshold=-40.0, harmonics=(1, 2), half_width=12)
    first, second, over_first, over_second = figure.axes
    assert [len(ax.patches) for ax in (first, second)] == [25, 25]
    drawn = [[line.get_xydata().tolist() for line in ax.get_lines()] for ax in (over_first, over_second)]
    assert drawn == [[[[108.0, 0.0]], [[109.0, -9.0]]], [[[219.0, -3.0]]]]
    assert [line.get_label() for line in over_first.get_lines()] == ["measured: normal", "measured: odd"]
    assert over_first.get_ylim()[0] == -40.0 and first.get_title(loc="left") == "mesh harmonic 1 (order 108)"
