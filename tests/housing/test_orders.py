"""Order spectra, bands, envelopes, lobes and lines of signals known in closed form."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.orders import (
    FOREIGN,
    NORMAL,
    UNEQUAL,
    OrderSpectrum,
    analyse_band,
    analytic_signal,
    band_pass,
    classify_line,
    classify_lines,
    count_lobes,
    counted_turns,
    dominant_lines,
    find_lines,
    order_spectrum,
    spacing_symmetry,
)
from femgear.housing.sensor import fixed_sensor_lines
from validation.reference.sensor_in_time import mean_square, symmetry_leakage

THETA = 2 * np.pi * np.arange(2048) / 2048


def spectrum_of(lines, top=400):
    value = np.zeros(top + 1, dtype=complex)
    for order, amplitude in lines.items():
        value[order] = amplitude
    return OrderSpectrum(np.arange(top + 1), value)


@pytest.mark.parametrize("samples", [64, 65])
def test_amplitudes_are_peak_values_of_the_cosines(samples):
    theta = 2 * np.pi * np.arange(samples) / samples
    spectrum = order_spectrum(0.5 + 2 * np.cos(3 * theta + 0.4) - 0.1 * np.sin(20 * theta))
    assert spectrum.value[0] == pytest.approx(0.5)
    assert spectrum.value[3] == pytest.approx(2 * np.exp(0.4j))
    assert spectrum.value[20] == pytest.approx(0.1j)
    others = np.delete(spectrum.amplitude, [0, 3, 20])
    assert others.max() < 1e-14


@pytest.mark.parametrize("samples", [64, 65])
def test_parseval_with_the_highest_line(samples):
    signal = np.random.default_rng(3).normal(size=samples)
    spectrum = order_spectrum(signal)
    last = spectrum.amplitude[-1] ** 2 / 2 if samples % 2 == 0 else 0  # the Nyquist line is no cosine pair
    assert mean_square(spectrum) + last == pytest.approx(np.mean(signal**2), rel=1e-13)


def test_band_pass_and_envelope_of_two_carriers():
    modulated = (1 + 0.6 * np.cos(3 * THETA)) * np.cos(108 * THETA) + 0.7 * np.cos(216 * THETA)
    band = band_pass(order_spectrum(modulated), 54, 162)
    heard = np.abs(analytic_signal(band))
    assert heard.size == 4 * band.order[-1] + 4
    t = 2 * np.pi * np.arange(heard.size) / heard.size
    assert np.allclose(heard, 1 + 0.6 * np.cos(3 * t), atol=1e-12)
    signal = analytic_signal(band).real
    assert np.allclose(signal, (1 + 0.6 * np.cos(3 * t)) * np.cos(108 * t), atol=1e-12)


def test_two_equal_side_lines_make_six_lobes():
    # the sensor on a node line crosses a standing pattern of three nodal diameters
    field = np.zeros((2, 7), dtype=complex)
    field[1, 0] = field[1, 6] = 1e-6
    lines = fixed_sensor_lines(field, 108, 5.2, 0.0)
    spectrum = OrderSpectrum(lines.order, lines.displacement)
    band = analyse_band(spectrum, 108, 1)
    assert sorted(line.order for line in band.lines) == [105, 111]
    assert [line.level for line in band.lines] == pytest.approx([0, 0], abs=1e-12)
    assert (band.low, band.high) == (55, 161)
    assert len(band.lobes.position) == 6
    assert np.allclose(band.lobes.position, np.arange(6) / 6, atol=1 / band.envelope.size)
    assert band.lobes.height == pytest.approx(np.full(6, 2e-6), rel=1e-3)
    t = 2 * np.pi * np.arange(band.envelope.size) / band.envelope.size
    assert np.allclose(band.envelope, 2e-6 * np.abs(np.cos(3 * t)), atol=1e-18)
    assert np.all(np.abs(band.signal) <= band.envelope + 1e-20)


def test_lobes_survive_the_weight_of_the_acceleration():
    field = np.zeros((2, 7), dtype=complex)
    field[1, 0] = field[1, 6] = 1e-6
    lines = fixed_sensor_lines(field, 108, 5.2, 0.3)
    band = analyse_band(OrderSpectrum(lines.order, lines.acceleration), 108, 1)
    assert [line.order for line in band.lines] == [111, 105]
    assert band.lines[1].level == pytest.approx(40 * np.log10(105 / 111), abs=1e-9)
    assert len(band.lobes.position) == 6


@pytest.mark.parametrize("shift", [0, 1, 170, 1023])
def test_seam_of_the_revolution_is_no_edge(shift):
    lobes = count_lobes(np.roll(1 + 0.5 * np.cos(6 * THETA), shift))
    assert len(lobes.position) == 6
    assert lobes.height == pytest.approx(np.full(6, 1.5), rel=1e-4)
    expected = np.sort((np.arange(6) / 6 + shift / 2048) % 1)
    assert np.allclose(lobes.position, expected, atol=1 / 2048)


def test_prominence_threshold_decides_on_small_lobes():
    # maxima of 1 + cos(3x)/2 + a cos(6x): small ones between the large ones, 2a - 1/2 + 1/(32 a) prominent
    ripple = 1 + 0.5 * np.cos(3 * THETA) + 0.2 * np.cos(6 * THETA)
    prominence = 2 * 0.2 - 0.5 + 1 / (32 * 0.2)
    share = prominence / 1.7
    assert len(count_lobes(ripple, threshold=0.98 * share).position) == 6
    assert len(count_lobes(ripple, threshold=1.02 * share).position) == 3


def test_constant_and_silent_envelopes_have_no_lobes():
    assert len(count_lobes(np.ones(100)).position) == 0
    assert len(count_lobes(np.zeros(100)).position) == 0
    noisy = 1 + 1e-13 * np.random.default_rng(0).normal(size=500)
    assert len(count_lobes(noisy).position) == 0


def test_flat_topped_lobe_is_one_lobe():
    assert len(count_lobes(np.repeat([0.0, 1.0, 0.2, 1.0], 25)).position) == 2


def test_dominant_lines_are_sorted_and_cut_at_the_floor():
    spectrum = spectrum_of({108: 1.0, 105: 3.0, 111: 2.0j, 120: 1e-4, 216: 50.0})
    lines = dominant_lines(spectrum, low=54, high=162)
    assert [(line.order, line.amplitude) for line in lines] == [(105, 3.0), (111, 2.0), (108, 1.0)]
    assert lines[1].level == pytest.approx(20 * np.log10(2 / 3))
    assert len(dominant_lines(spectrum, low=54, high=162, count=2)) == 2
    assert dominant_lines(spectrum, low=300, high=310) == ()


def test_symmetry_leakage_is_a_ratio_to_the_largest_line():
    assert symmetry_leakage(spectrum_of({108: 2.0, 109: 0.5}), 3) == pytest.approx(0.25)
    assert symmetry_leakage(spectrum_of({108: 2.0, 111: 0.5}), 3) == 0
    assert symmetry_leakage(spectrum_of({}), 3) == 0


@pytest.mark.parametrize("direction", [1, -1])
def test_sources_of_a_line_are_the_components_that_sound_there(direction):
    n_max, harmonics, z_ring = 9, 2, 12
    for order in (0, 5, 9, 15, 30):
        found = []
        for h in range(harmonics + 1):
            for n in range(-n_max, n_max + 1):
                field = np.zeros((harmonics + 1, 2 * n_max + 1), dtype=complex)
                field[h, n + n_max] = 1.0
                lines = fixed_sensor_lines(field, z_ring, direction * 2.0, 0.0)
                if abs(lines.displacement[order]) > 0.5:
                    found.append((h, n))
        orders = {(h, n): abs(h * z_ring - direction * n) for h in range(3) for n in range(-n_max, n_max + 1)}
        assert set(found) == {source for source, heard in orders.items() if heard == order}


def test_unusable_requests_are_refused():
    spectrum = spectrum_of({108: 1.0})
    several = OrderSpectrum(np.arange(10), np.ones((2, 10), dtype=complex))
    refused = [
        (lambda: order_spectrum([1.0]), "E-SHAPE"),
        (lambda: order_spectrum([1.0, np.nan]), "E-SHAPE"),
        (lambda: band_pass(spectrum, 0, 10), "E-RANGE"),
        (lambda: band_pass(spectrum, 500, 600), "E-RANGE"),
        (lambda: analyse_band(spectrum, 108, 9), "E-RANGE"),
        (lambda: analyse_band(spectrum, 0, 1), "E-TEETH"),
        (lambda: dominant_lines(several, low=1, high=5), "E-SHAPE"),
        (lambda: count_lobes(np.ones((2, 9))), "E-SHAPE"),
        (lambda: count_lobes(-np.ones(9)), "E-SHAPE"),
        (lambda: count_lobes(np.ones(9), threshold=1.5), "E-SHAPE"),
    ]
    for call, code in refused:
        with pytest.raises(CaseError) as caught:
            call()
        assert caught.value.code == code


def test_lobes_of_a_tenth_of_the_largest_count():
    """Six dips of a share of the largest value: that is how far the six maxima stand out."""
    for share, count in ((0.11, 6), (0.19, 6), (0.09, 0)):
        lobes = count_lobes(1.0 - share * np.sin(3 * THETA) ** 2)
        assert (len(lobes.position), lobes.threshold) == (count, 0.1)


PLACES = {
    "equal": (0, 25, 50, 75),
    "pairs": (0, 24, 50, 74),
    "silent pairs": (0, 15, 50, 65),
    "none": (0, 24, 51, 74),
}


@pytest.mark.parametrize(("name", "symmetry"), [("equal", 4), ("pairs", 2), ("silent pairs", 2), ("none", 1)])
def test_symmetry_of_the_spacing(name, symmetry):
    angles = 2 * np.pi * np.array(PLACES[name]) / 100
    assert spacing_symmetry(angles) == spacing_symmetry(angles + 0.7) == symmetry
    assert spacing_symmetry([0.3]) == 1 and spacing_symmetry(np.radians([0, 120, 240])) == 3


@pytest.mark.parametrize(
    ("name", "order", "verdict", "reason"),
    [
        ("equal", 72, NORMAL, ""),
        ("equal", 72.04, NORMAL, ""),
        ("equal", 70, UNEQUAL, "no multiple of 4"),
        ("pairs", 70, NORMAL, ""),
        ("silent pairs", 70, NORMAL, "factor zero"),
        ("pairs", 71, UNEQUAL, "no multiple of 2"),
        ("none", 71, NORMAL, ""),
        ("pairs", 70 + 10 / 3, UNEQUAL, "70 + 1 turn of the sun"),
        ("pairs", 70 - 20 / 3, UNEQUAL, "70 - 2 turns of the sun"),
        # orders of an error of the sun are multiples of the symmetry beside its turns
        ("equal", 70 + 10 / 3, UNEQUAL, "70 - 2 turns of the sun + 10"),
        ("equal", 71 + 10 / 3, FOREIGN, "no whole carrier order"),
        ("equal", 72 + 10 / 3, UNEQUAL, "70 + 1 turn of the sun + 2"),
        ("pairs", 71 + 10 / 3, FOREIGN, "no whole carrier order"),
        ("equal", 140 - 3.5, UNEQUAL, "140 - 1 turn of a planet"),
        ("equal", 141 - 3.5, UNEQUAL, "140 - 1 turn of a planet + 1"),
        ("equal", 70.2, FOREIGN, "no whole carrier order"),
    ],
)
def test_verdicts_on_lines(name, order, verdict, reason):
    angles = 2 * np.pi * np.array(PLACES[name]) / 100
    found = classify_line(order, angles, (70, 30, 20), tolerance=0.05)
    assert found.verdict == verdict and found.reason.startswith(reason) and (found.reason == "") == (reason == "")
    assert found.nearest == round(order)
    without = classify_line(order, angles, (70, None, None), tolerance=0.05)
    assert without.verdict == (FOREIGN if "turn" in reason else verdict)


def test_a_part_that_is_heard_has_lines_at_all_its_turns():
    """27/40/108: a planet turns 2.7 times, so a tooth that hits once a turn makes lines at all tenths of an order."""
    angles, teeth = np.radians([0.0, 120.0, 240.0]), (108, 27, 40)
    orders = 108 + 2.7 * np.array([1, 3, 4, 6, 9])
    first, *others = classify_lines(orders, angles, teeth, tolerance=0.02)
    assert (first.reason, first.part) == ("108 + 1 turn of a planet", "planet")
    assert {(one.verdict, one.part) for one in others} == {(UNEQUAL, "planet")}
    assert others[0].reason.startswith("108 + 3 turns of a planet")
    # without a line at one or two turns, off all turns, and where they lie as close as the tolerance
    for alone in classify_lines(orders[[1, 2, 3]], angles, teeth, tolerance=0.02):
        assert alone.verdict == FOREIGN and "nor at one or two turns" in alone.reason
    assert classify_lines([110.7, 108.25], angles, teeth, tolerance=0.02)[1].verdict == FOREIGN
    assert [counted_turns("planet", teeth, 3, tolerance) for tolerance in (0.02, 0.025, 0.03)] == [5, 2, 2]
    assert counted_turns("planet", (95, 31, 31), 3, 0.02) == 2
    assert counted_turns("planet", (95, 31, 31), 3, 0.005) == 15


def test_lines_of_two_parts_that_nearly_meet_are_those_of_the_nearer():
    """22/20/62: places of the sun are elevenths of an order, those of a planet tenths."""
    angles, teeth = np.radians([0.0, 120.0 + 360.0 / 84.0, 240.0]), (62, 22, 20)
    of_sun = 62 + 42 / 11 * np.arange(1, 11)
    places = classify_lines(of_sun, angles, teeth, tolerance=0.02)
    assert {place.part for place in places} == {"sun"}
    both = classify_lines([*of_sun, *(62 + 3.1 * np.array([1, 2, 4, 7]))], angles, teeth, tolerance=0.02)
    assert [place.part for place in both] == ["sun"] * 10 + ["planet"] * 4


def test_whole_turns_of_the_sun_are_named_where_they_stand_beside_a_mesh_harmonic():
    """27/108: a turn of the sun is five of the carrier."""
    angles = np.radians([0.0, 120.0, 240.0])
    known = {653: "no multiple of 3; 648 + 1 turn of the sun", 649: "no multiple of 3"}
    known |= {638: "no multiple of 3; 648 - 2 turns of the sun"}
    for order, reason in known.items():
        found = classify_line(order, angles, (108, 27, 40), tolerance=0.02)
        assert (found.verdict, found.reason) == (UNEQUAL, reason)
    assert classify_line(648, angles, (108, 27, 40), tolerance=0.02).verdict == NORMAL


def test_lines_of_fine_and_of_coarse_spectra():
    fine = np.arange(0.0, 20.0, 0.1)
    peaks = np.exp(-(((fine - 6) / 0.1) ** 2)) + 0.05 * np.exp(-(((fine - 9.5) / 0.1) ** 2))
    peaks[0] = 50.0  # the mean is no line
    assert fine[find_lines(fine, peaks, threshold=-30)] == pytest.approx([6.0, 9.5])
    assert fine[find_lines(fine, peaks, threshold=-20)] == pytest.approx([6.0])
    whole = np.arange(20.0)
    assert find_lines(whole, np.exp(-np.abs(whole - 6)), threshold=-20).tolist() == [4, 5, 6, 7, 8]


@pytest.mark.parametrize(("order", "tolerance"), [(0.0, 0.1), (np.nan, 0.1), (5.0, 0.0), (5.0, 0.5)])
def test_no_lines(order, tolerance):
    with pytest.raises(CaseError, match="no such line") as error:
        classify_line(order, [0.0, np.pi], (70, 30, 20), tolerance=tolerance)
    assert error.value.code == "E-RANGE"
