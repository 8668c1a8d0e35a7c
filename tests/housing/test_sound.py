"""Signals and run-ups of lines, and what a cylinder radiates, against sums and forms written out by hand."""

import math
import sys

import numpy as np
import pytest

from femgear.errors import CaseError, FemgearError, nvh_library
from femgear.housing.sensor import component_lines, lines_in_form
from femgear.housing.sound import (
    Cylinder,
    Microphone,
    a_weighting,
    acceleration_level,
    levels_of,
    microphone_lines,
    nodal_diameters,
    power_level,
    pressure_level,
    pressure_transfer,
    radiation_efficiency,
    run_up_signal,
    sampled_signal,
    sound_power,
    sound_pressure,
    sound_quality,
    whole_turns,
)
from validation.sound import axial_waves, outgoing

RING, ENDLESS = Cylinder(0.1, 0.025), Cylinder(0.1, np.inf)
TURN = 2 * np.pi


def ring_lines(direction=1.0, angle=0.3, seed=1):
    rng = np.random.default_rng(seed)
    field = rng.normal(size=(5, 25)) + 1j * rng.normal(size=(5, 25))
    return component_lines(1e-6 * field, 108, direction * 60.0, angle)


# --- radiation -------------------------------------------------------------------------------------


def test_pressure_transfer_solves_the_wave_equation():
    for n, ka, kr in ((0, 0.3, 2.0), (3, 1.1, 1.1), (5, 4.0, 30.0)):
        frequency = ka * 343.0 / (TURN * 0.1)
        expected = -1j * 1.204 * 343.0 * outgoing(n, ka, kr)
        assert pressure_transfer(n, frequency, ENDLESS, 0.1 * (kr / ka - 1)) == pytest.approx(expected, rel=1e-8)


def test_air_is_a_resistance_to_short_waves_and_a_mass_to_long_ones():
    fast = pressure_transfer(0, 1e6, ENDLESS)
    assert fast == pytest.approx(1.204 * 343.0, rel=1e-3)
    # rho omega a/n of a wave of n nodal diameters on an incompressible fluid
    slow = pressure_transfer(4, 1.0, ENDLESS)
    assert slow == pytest.approx(1j * TURN * 1.204 * 0.1 / 4, rel=1e-4)


@pytest.mark.decisive
@pytest.mark.parametrize(("n", "frequency", "distance"), [(0, 60.0, 0.9), (3, 1116.0, 0.4), (12, 9000.0, 0.1)])
def test_a_ring_in_a_rigid_cylinder_is_the_sum_of_its_axial_waves(n, frequency, distance):
    expected = axial_waves(n, frequency, RING, distance)
    assert pressure_transfer(n, frequency, RING, distance) == pytest.approx(expected, rel=1e-6)


def test_many_frequencies_are_interpolated_between_fewer():
    """Nodal diameters 0 to 40, 4 Hz to 20 kHz, wide and narrow rings near and far."""
    n, frequency = np.arange(0, 41, 8)[:, None], np.geomspace(4.0, 20e3, 601)
    for ring, distance in ((RING, 0.9), (Cylinder(0.1, 0.2), 0.05), (Cylinder(0.3, 1.0), 1.0)):
        many = pressure_transfer(n, frequency, ring, distance)
        few = np.stack([pressure_transfer(n[:, 0], one, ring, distance) for one in frequency[::40]], axis=1)
        assert np.abs(many[:, ::40] / few - 1).max() < 1e-3
        ka, slender = TURN * frequency * ring.radius / 343.0, ring.length / ring.radius
        many = radiation_efficiency(n, ka, slender)
        few = np.stack([radiation_efficiency(n[:, 0], one, slender) for one in ka[::40]], axis=1)
        assert np.abs(many[:, ::40] - few).max() < 1e-4 * np.abs(few).max()


def test_a_ring_radiates_less_than_an_endless_cylinder_and_filters_the_same():
    """27 dB less at 1116 Hz, 25 mm and 1 m: b/sqrt(wavelength r), of all nodal diameters within 1 dB."""
    n = np.arange(4)
    ratio = np.abs(pressure_transfer(n, 1116.0, RING, 0.9) / pressure_transfer(n, 1116.0, ENDLESS, 0.9))
    level = 20 * np.log10(ratio)
    assert np.abs(level + 27.0).max() < 1.0


def test_waves_beyond_the_largest_number_have_their_limit():
    """At 0.1 Hz Hankel functions of order 100 overflow; (a/r)^n is left of the pressure."""
    near = pressure_transfer(100, 0.1, ENDLESS)
    assert near == pytest.approx(1j * TURN * 0.1 * 1.204 * 0.1 / 100, rel=1e-6)
    ratio = pressure_transfer(100, 0.1, ENDLESS, 0.1) / near
    assert ratio == pytest.approx(0.5**100, rel=1e-6)
    assert pressure_transfer(3, 0.0, ENDLESS) == 0.0 and radiation_efficiency(100, 1e-4) == 0.0


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_microphone_hears_the_wave_where_it_stands(direction):
    """Lines of a sensor at the angle of the microphone, times the transfer of their nodal diameter."""
    lines, beside = ring_lines(direction), ring_lines(direction, angle=1.7)
    found = sound_pressure(lines, RING, Microphone(1.0, 1.7))
    transfer = pressure_transfer(nodal_diameters(beside), beside.frequency, RING, 1.0)
    expected = transfer * 1j * beside.order * 60.0 * beside.displacement
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    # the sign of n tells: a wrong one turns the phase the other way
    wrong = found * np.exp(-2j * nodal_diameters(lines) * 1.4)
    assert np.abs(wrong - expected).max() > 0.1 * np.abs(expected).max()


def test_nodal_diameters_follow_the_turning_carrier():
    for direction in (1, -1):
        field = np.zeros((3, 9), complex)
        field[2, 4 + 3] = 1e-6
        lines = component_lines(field, 108, direction * 60.0, 0.0)
        (k,) = np.flatnonzero(lines.displacement)
        assert lines.order[k] == 216 - direction * 3 and nodal_diameters(lines)[k] == 3


def test_interpolated_lines_tell_no_nodal_diameter():
    with pytest.raises(CaseError) as caught:
        nodal_diameters(lines_in_form(ring_lines(), "linear", 54, 4))
    assert caught.value.code == "E-SHAPE"


def test_power_is_the_equivalent_one_times_the_efficiency():
    lines = ring_lines()
    equivalent, power = (sound_power(lines, RING, equivalent=one) for one in (True, False))
    velocity = np.abs(lines.order * 60.0 * lines.displacement)
    assert equivalent == pytest.approx(0.5 * 1.204 * 343.0 * velocity**2 * TURN * 0.1 * 0.025)
    some = lines.order > 0
    ka = TURN * lines.frequency[some] * 0.1 / 343.0
    assert power[some] / equivalent[some] == pytest.approx(radiation_efficiency(nodal_diameters(lines)[some], ka, 0.25))
    assert not power[~some].any()


def test_levels_add_powers_and_weigh_frequencies():
    """1 Pa r.m.s. is 94 dB; at 100 Hz A-weighting takes 19.1 dB off; 1 mW are 90 dB."""
    tone = np.array([0.0, np.sqrt(2)])
    assert pressure_level(tone, np.array([0.0, 1000.0])) == pytest.approx(93.979, abs=1e-3)
    assert pressure_level(tone, np.array([0.0, 100.0])) == pytest.approx(93.979 - 19.1, abs=0.05)
    twice = pressure_level(np.sqrt(2) * np.ones(2), np.array([1000.0, 1000.0]))
    assert twice == pytest.approx(93.979 + 3.010, abs=1e-3)
    assert power_level(np.array([1e-3]), np.array([1000.0])) == pytest.approx(90.0, abs=1e-3)
    assert acceleration_level(np.sqrt(2) * np.ones(1), np.array([1000.0])) == pytest.approx(120.0, abs=1e-3)
    assert a_weighting(0.0) == 0.0 and pressure_level(np.zeros(2), np.zeros(2)) == -np.inf


def test_attributes_of_a_file_give_the_same_microphone():
    lines, known = ring_lines(), {"microphone_distance": 0.5, "microphone_angle": 1.0, "outer_radius": 0.1}
    known |= {"face_width": 0.025, "air_density": 1.1, "sound_speed": 340.0}
    expected = sound_pressure(lines, Cylinder(0.1, 0.025, 1.1, 340.0), Microphone(0.5, 1.0))
    assert np.array_equal(microphone_lines(lines, known), expected)


# --- signals ---------------------------------------------------------------------------------------


def test_samples_are_the_sum_of_the_lines():
    """Over the blocks in memory, of orders that are no neighbours, at a speed that fits no sample."""
    order, speed = np.array([0, 3, 7, 500, 1201]), 2 * np.pi * 3.217
    values = np.array([0.3, 1.0, 0.2 - 1j, 0.1j, 0.4 + 0.1j])
    found = sampled_signal(order, values, speed, samples=150_000)
    time = np.arange(150_000) / 48e3
    direct = sum((v * np.exp(1j * k * speed * time)).real for k, v in zip(order, values))
    assert found.shape == direct.shape and np.abs(found - direct).max() < 1e-9


def test_whole_turns_have_the_power_of_the_lines():
    order, speed = np.array([0, 105, 111, 108]), 2 * np.pi * 50 / 60
    values = np.array([0.5, 1.0, 2.0 - 1j, 1j])
    samples = whole_turns(speed, 10.0)
    assert samples == 8 * 57_600
    power = 0.25 + 0.5 * (np.abs(values[1:]) ** 2).sum()
    signal = sampled_signal(order, values, speed, samples=samples)
    assert np.sqrt(np.mean(signal**2)) == pytest.approx(np.sqrt(power), rel=1e-12)
    # turns that end between two samples
    odd = 2 * np.pi * 1.2345
    signal = sampled_signal(order, values, odd, samples=whole_turns(odd, 10.0))
    assert np.sqrt(np.mean(signal**2)) == pytest.approx(np.sqrt(power), rel=1e-6)
    assert whole_turns(speed, 1e-3) == 57_600


def test_lines_beyond_half_the_rate_are_left_out():
    order, speed = np.array([100, 23_999, 24_000, 30_000]), 2 * np.pi
    signal = sampled_signal(order, np.array([0.0, 0.0, 1.0, 1.0]), speed, samples=100)
    assert not signal.any()
    assert sampled_signal(order, np.array([0.0, 1.0, 0.0, 0.0]), speed, samples=100).any()


def test_a_run_up_is_the_chirp_in_closed_form():
    order, nodes = np.array([2, 5]), 2 * np.pi * np.linspace(1.0, 9.0, 5)
    values = np.tile([1.0, 0.5j], (5, 1))
    found = run_up_signal(order, values, nodes, duration=4.0, rate=1000.0)
    time = np.arange(4000) / 1000.0
    angle = 2 * np.pi * (1.0 * time + 8.0 * time**2 / 8.0)
    direct = np.cos(2 * angle) + (0.5j * np.exp(5j * angle)).real
    assert np.abs(found - direct).max() < 1e-9


def test_a_coast_down_over_a_part_of_the_speeds_follows_the_lines():
    order, nodes = np.array([3]), 2 * np.pi * np.array([1.0, 2.0, 4.0, 8.0])
    values = np.array([[1.0], [3.0], [2j], [5.0]])
    start, stop = 2 * np.pi * 7.0, 2 * np.pi * 1.5
    found = run_up_signal(order, values, nodes, duration=2.0, start=start, stop=stop, rate=2000.0)
    time = np.arange(4000) / 2000.0
    speed = start + (stop - start) * time / 2.0
    line = np.interp(speed, nodes, values[:, 0].real) + 1j * np.interp(speed, nodes, values[:, 0].imag)
    angle = start * time + (stop - start) * time**2 / 4.0
    assert np.abs(found - (line * np.exp(3j * angle)).real).max() < 1e-9


def test_steady_speed_is_a_run_up_of_no_slope():
    order, nodes = np.array([3, 40]), 2 * np.pi * np.array([1.0, 2.0])
    values = np.array([[1.0, 0.2], [3.0, 0.1j]])
    found = run_up_signal(order, values, nodes, duration=1.0, start=nodes[1], stop=nodes[1], rate=1000.0)
    assert np.abs(found - sampled_signal(order, values[1], nodes[1], samples=1000, rate=1000.0)).max() < 1e-11


def test_orders_that_are_not_whole_keep_their_frequencies():
    rng = np.random.default_rng(3)
    order = np.array([0.0, 25 / 72, 25.0, 6.0666, 1000.0 / 7.0])
    values = rng.normal(size=5) + 1j * rng.normal(size=5)
    found = sampled_signal(order, values, 2 * np.pi * 150.0, samples=200_000)
    turns = 150.0 * np.arange(200_000) / 48e3
    direct = (values @ np.exp(2j * np.pi * np.outer(order, turns))).real
    assert np.abs(found - direct).max() < 5e-9


def test_a_run_up_of_orders_that_are_not_whole_is_the_chirp_in_closed_form():
    order, nodes = np.array([0.3, 2.0, 5.25]), 2 * np.pi * np.linspace(1.0, 9.0, 5)
    values = np.tile([2.0, 1.0, 0.5j], (5, 1))
    found = run_up_signal(order, values, nodes, duration=4.0, rate=1000.0)
    time = np.arange(4000) / 1000.0
    turns = 1.0 * time + 8.0 * time**2 / 8.0
    direct = (values[0] @ np.exp(2j * np.pi * np.outer(order, turns))).real
    assert np.abs(found - direct).max() < 1e-9


@pytest.mark.slow
def test_a_run_up_of_a_minute_has_no_click():
    """The second difference of every sample is that of its lines at the highest speed, at most."""
    rng = np.random.default_rng(5)
    order, nodes = 108 + np.arange(-6, 7, 3), 2 * np.pi * np.linspace(0.5, 9.0, 400)
    values = rng.normal(size=(400, 5)) + 1j * rng.normal(size=(400, 5))
    values = 0.5 * (values[np.r_[1:400, 399]] + values)
    found = run_up_signal(order, values, nodes, duration=60.0)
    assert found.shape == (2_880_000,)
    highest = np.outer(nodes, order) / 48e3
    # amplitudes change by a share of a sample's turn, besides
    slope = np.abs(np.diff(values, axis=0)).max() * 399 / found.size
    bound = (np.abs(values).max(axis=0) * highest.max(axis=0) ** 2).sum()
    bound += 2 * slope * (highest.max(axis=0) + 1).sum()
    second = np.abs(np.diff(found, 2))
    assert 0.2 * bound < second.max() < bound < 0.25
    # a click: one phase of the largest line starts anew in the middle
    broken = found.copy()
    broken[1_440_000:] *= -1
    assert np.abs(np.diff(broken, 2)).max() > bound


def test_lines_fade_out_before_half_the_rate():
    order, nodes = np.array([10]), 2 * np.pi * np.arange(1.0, 7.0)
    found = run_up_signal(order, np.ones((6, 1)), nodes, duration=1.0, rate=80.0)
    # order 10 reaches 40 Hz at 4 turns a second: nothing is left from 3 on
    assert found[:10].any() and np.abs(found[32:]).max() < 1e-12 and np.abs(found[16:32]).max() < 1.0


def test_what_makes_no_signal_is_refused():
    order, values, nodes = np.array([1, 2]), np.ones((3, 2)), np.array([1.0, 2.0, 3.0])
    for changed, code in (
        ({"order": np.array([1, np.nan])}, "E-SHAPE"),
        ({"order": np.array([-1, 2])}, "E-SHAPE"),
        ({"order": np.array([1, 2, 3])}, "E-SHAPE"),
        ({"values": values * np.nan}, "E-SHAPE"),
        ({"speeds": nodes[::-1]}, "E-RANGE"),
        ({"speeds": -nodes}, "E-RANGE"),
        ({"rate": 0.0}, "E-RANGE"),
        ({"duration": 0.0}, "E-RANGE"),
        ({"duration": np.nan}, "E-RANGE"),
        ({"start": 0.5}, "E-RANGE"),
        ({"stop": 3.5}, "E-RANGE"),
        ({"values": values[:1], "speeds": nodes[:1]}, "E-RANGE"),
    ):
        options = {"order": order, "values": values, "speeds": nodes, "duration": 0.1} | changed
        with pytest.raises(CaseError) as caught:
            run_up_signal(**options)
        assert caught.value.code == code, changed


# --- what is heard ---------------------------------------------------------------------------------


def test_a_tone_above_noise_is_found():
    rng, time = np.random.default_rng(0), np.arange(96_000) / 48e3
    noise = 2e-3 * rng.normal(size=time.size)
    found = sound_quality(noise + 0.05 * np.sin(2 * np.pi * 1000.0 * time))
    assert found.tones == pytest.approx([1000.0], abs=1.0)
    # 1.25e-3 Pa^2 of the tone over the noise in 162 Hz of 24 kHz, the critical band (ECMA-418-1)
    expected = 10 * np.log10(1.25e-3 / (4e-6 * 162 / 24e3))
    assert found.tone_to_noise == pytest.approx(expected, abs=1.0)
    assert found.prominence == pytest.approx(expected, abs=1.5)
    alone = sound_quality(noise)
    assert np.isnan(alone.tone_to_noise) and not alone.tones.size and alone.loudness < found.loudness


def test_an_absent_library_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "mosqito", None)
    with pytest.raises(FemgearError) as caught:
        sound_quality(np.zeros(48_000))
    assert caught.value.code == "E-LIBRARY"
    assert caught.value.remedy.endswith(' -m pip install "femgear[nvh]"')


@pytest.mark.parametrize(
    ("place", "shown"),
    [("here/.venv/bin/python", ".venv/bin/python"), ("my env/bin/python", '"{}/my env/bin/python"')],
)
def test_libraries_are_installed_for_the_python_that_lacks_them(tmp_path, monkeypatch, place, shown):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(sys, "executable", str(tmp_path / place))
    with pytest.raises(FemgearError) as caught, nvh_library("sounds"):
        raise ImportError("no mosqito")
    assert caught.value.remedy == f'{shown.format(tmp_path)} -m pip install "femgear[nvh]"'


def test_loudness_needs_all_that_is_heard():
    for rate in (44_100.0, np.nan):
        with pytest.raises(CaseError) as caught:
            sound_quality(np.zeros(48_000), rate)
        assert caught.value.code == "E-RANGE" and "48 kHz" in caught.value.limit


@pytest.mark.parametrize(
    ("form", "expected"),
    [
        ("m/s^2 rms", lambda a, w: a / math.sqrt(2)),
        ("m/s^2 peak", lambda a, w: a),
        ("g peak", lambda a, w: a / 9.80665),
        ("mm/s rms", lambda a, w: 1e3 * a / (w * math.sqrt(2))),
        ("mm/s peak", lambda a, w: 1e3 * a / w),
        ("um peak", lambda a, w: 1e6 * a / w**2),
        ("dB rms", lambda a, w: 20 * math.log10(a / math.sqrt(2) / 1e-6)),
    ],
)
def test_levels_of_sines(form, expected):
    """A sine of amplitude a at f has a/sqrt(2) r.m.s. and the velocity a/(2 pi f); two add their powers."""
    a, f = np.array([[3.0, 4.0j]]), np.array([50.0, 80.0])
    found = levels_of(a, f, form)[0]
    assert found[0] == pytest.approx(expected(3.0, 100 * math.pi), rel=1e-12)
    assert found[1] == pytest.approx(expected(4.0, 160 * math.pi), rel=1e-12)
    together = 10 * np.log10(np.sum(10 ** (found[:2] / 10))) if "dB" in form else np.hypot(*found[:2])
    assert found[2] == pytest.approx(together, rel=1e-12)
