"""femgear.rigs: cases, predicted lines, and the rule by which a recording is judged, fixed before any was looked at."""

import numpy as np
import pytest
from recorded_signals import RATE, recording, write_columns
from scipy.io import wavfile

from femgear import cli, solve
from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum
from femgear.rigs import PRETORIA, RIGS, SDUST, SNU, check_rig, find_rig
from femgear.trains.reading import with_values

TURNS = 50


def spectrum(lines):
    """Lines through a Hann window, over 50 turns."""
    order = np.arange(400 * TURNS) / TURNS
    value = np.full(len(order), 1e-9, complex)
    for at, height in lines.items():
        bins = (order - at) * TURNS
        value += height * (np.sinc(bins) + 0.5 * np.sinc(bins - 1) + 0.5 * np.sinc(bins + 1))
    return OrderSpectrum(order, value, TURNS)


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_what_is_predicted_passes(rig):
    check = check_rig(rig, spectrum({order: height for order, height in rig.predicted.items() if height}))
    assert check.passed(rig) == (True, True) and check.share == 1.0
    assert rig.case().ring.teeth == rig.teeth[2] and rig.case().set.planets == rig.planets


@pytest.mark.parametrize(
    ("rig", "lines", "passed"),
    [
        (SDUST, SDUST.predicted | {73: 0.2}, (False, True)),
        (SDUST, SDUST.predicted | {73: 0.09}, (True, True)),  # below -20 dB
        (SDUST, SDUST.predicted | {80: 0.5}, (True, True)),  # eight orders beside
        (SDUST, SDUST.predicted | {72: 0.6}, (True, False)),
        (SDUST, SDUST.predicted | {147.04: 0.5}, (True, True)),
        (SDUST, SDUST.predicted | {147.08: 0.5}, (False, True)),
        (SNU, SNU.predicted | {95: 0.95}, (False, False)),
        (PRETORIA, {57: 1.0, 60: 0.9, 63: 0.8}, (True, False)),
        (PRETORIA, {}, (None, None)),
    ],
)
def test_the_rule(rig, lines, passed):
    assert check_rig(rig, spectrum({order: height for order, height in lines.items() if height})).passed(rig) == passed


def test_the_command_lists_writes_and_judges(tmp_path, capsys):
    assert cli.main(["rigs"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in RIGS)
    path = tmp_path / "sdust.toml"
    assert cli.main(["rigs", "sdust", "-o", str(path)]) == 0 and "checksums" in capsys.readouterr().out
    assert 'module = "2 mm"' in path.read_text()
    carrier = 5.0
    signal, _, _ = recording(SDUST.predicted, SDUST.predicted.values(), carrier=carrier, wander=0.0, seconds=12.0)
    columns = np.arange(len(signal)) / RATE, signal
    file = write_columns(tmp_path / "a.csv", "time [s];acc [g]\n", columns)
    assert cli.main(["rigs", "SDUST", str(file), "--speed", f"{carrier * 60 * 5.001} rpm", "--within", "0.005"]) == 0
    printed = capsys.readouterr().out
    assert printed.count(" passed") == 2 and "100 % of 3" in printed
    assert cli.main(["rigs", "none"]) == 2 and "E-CHOICE" in capsys.readouterr().err
    with pytest.raises(CaseError, match="no such rig"):
        find_rig("none")


def written(folder, rig, lines, *, noise=1e-3):
    """Record lines at the speed of the sun for which they are predicted: the file and that speed [rpm]."""
    rpm, (sun, _, ring) = float(rig.speed.split()[0]), rig.teeth
    carrier = rpm / 60 * sun / (sun + ring)
    rate = float(round(12.0 * ring * carrier))
    heights = np.array([*lines.values()]) if lines else np.zeros(1)
    options = {"carrier": carrier, "wander": 0.0, "seconds": 30 / carrier, "rate": rate, "noise": noise}
    signal, _, _ = recording([*lines] or [1.0], heights, **options)
    signal += 1e-3 * (not lines) * np.random.default_rng(1).normal(size=len(signal))
    wavfile.write(folder / "a.wav", round(rate), signal.astype(np.float32))
    return str(folder / "a.wav"), rpm


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_recordings_by_which_nothing_can_be_said_are_refused(rig, tmp_path, capsys, recwarn):
    """Noise, another speed, another set; a healthy rig passes, and one with unequal pins does not."""

    def judged(lines, factor=1.0):
        file, rpm = written(tmp_path, rig, lines)
        code = cli.main(["rigs", rig.name, file, "--speed", f"{factor * rpm} rpm"])
        printed = capsys.readouterr()
        return code, printed.out + printed.err

    healthy = {order: height for order, height in rig.predicted.items() if height}
    healthy |= {order + rig.teeth[2] - rig.teeth[2] % rig.planets: height for order, height in healthy.items()}
    code, printed = judged(healthy)
    assert (code, printed.count(" passed"), printed.count("not passed")) == (0, 2, 0)
    between = [at for at in range(rig.teeth[2] - 4, rig.teeth[2] + 5) if at % rig.planets and at != rig.teeth[2]]
    code, printed = judged(healthy | dict.fromkeys(between, 0.2))
    assert code == 0
    assert "not passed" in printed
    others = {0.83 * order: height for order, height in healthy.items()}
    for lines, factor in (({}, 1.0), (healthy, 1.004), (healthy, 2.0), (others, 1.0)):
        code, printed = judged(lines, factor)
        assert code == 2
        assert "[E-FILE]" in printed
        assert "cannot be judged" in printed


@pytest.mark.slow
@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_predicted_lines_are_those_of_the_case(rig):
    lines = solve(rig.case(), "housing")["housing"].exact
    height, ring = np.abs(lines.acceleration[0]), rig.teeth[2]
    height = height / height[np.abs(lines.order - ring) <= 12].max()
    for order, predicted in rig.predicted.items():
        assert height[lines.order == order].sum() == pytest.approx(predicted, abs=0.015)


FRICTION = {"losses": {"friction": "constant", "coefficient": 0.05, "excites": True}}


def pin(size):
    return {"set.pin_errors": [{"planet": 1, "tangential": size}]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "heights"),
    [
        (FRICTION, {93: 0.697, 94: 0.0, 95: 0.0, 97: 0.0}),
        (pin("10 um"), {93: 0.941, 94: 0.045, 95: 0.0, 97: 0.048}),
        ({"planet.individual": [{"planet": 1, "thickness_reduction": "10 um"}]}, {94: 0.023, 95: 0.0, 97: 0.024}),
        ({"carrier.errors": {"runout_amplitude": "5 um"}}, {94: 0.034, 95: 0.0, 97: 0.036}),
        (pin("5 um") | FRICTION, {93: 0.697, 94: 0.023, 95: 0.001, 97: 0.021}),
    ],
    ids=["friction", "pin", "thickness", "carrier", "friction and pin"],
)
def test_what_makes_the_mesh_line_of_planets_out_of_phase(changes, heights):
    """The table of docs/measured.md; all that keeps equal planets makes multiples of three alone."""
    lines = solve(with_values(SNU.case(), {"static.stresses": False} | changes), "housing")["housing"].exact
    height = np.abs(lines.acceleration[0])
    for order, expected in heights.items():
        ratio = height[np.abs(lines.order - order) < 1e-6].sum() / height[lines.order == 96.0].sum()
        assert ratio == pytest.approx(expected, abs=6e-4)


@pytest.mark.slow
def test_on_feet_the_mesh_line_stays_small_too():
    """A pin by 40 um: lines over the largest, on four feet and a soft foundation."""
    stiff = {"radial_stiffness": "4e8 N/m", "tangential_stiffness": "4e8 N/m"}
    changes = {
        "static.stresses": False,
        "housing.support": [{"angle": f"{angle} deg", **stiff} for angle in (35, 145, 215, 325)],
        "housing.nodal_diameters": 8,
        "ring.foundation_radial": "1e8 N/m^3",
        "ring.foundation_tangential": "1e8 N/m^3",
        "dynamics.up_to": None,
        "dynamics.mesh_harmonics": 3,
        "runup.count": 0,
    }
    lines = solve(with_values(SNU.case(), changes | pin("40 um")), "housing")["housing"].exact
    height = np.abs(lines.acceleration[0])
    largest = height[np.abs(lines.order - 95) <= 11].max()
    for order, expected in {94: 0.098, 95: 0.002, 97: 0.236}.items():
        assert height[np.abs(lines.order - order) < 1e-6].sum() / largest == pytest.approx(expected, abs=2e-3)
