"""femgear.measured.spectra: densities and frequency responses beside those that are known."""

import numpy as np
import pytest
from scipy.signal import lfilter

from femgear.errors import CaseError
from femgear.measured.channels import Channel
from femgear.measured.spectra import frequency_response, power_density, windowed_spectrum
from femgear.measured.turns import AngleSignal

RATE = 2000.0
NOISE = np.random.default_rng(5).normal(size=200_000)


def channel(values, name="a", **changes):
    return Channel(**{"file": "a.csv", "name": name, "unit": "N", "rate": RATE, "values": values} | changes)


def test_a_line_has_its_amplitude_in_the_order_spectrum():
    values = 3.0 + 2.0 * np.cos(2 * np.pi * 7 * np.arange(10 * 256) / 256)
    spectrum = windowed_spectrum(AngleSignal("a", "g", values, 10, 256, 50.0, 1.0))
    assert spectrum.amplitude[70] == pytest.approx(2.0) and spectrum.amplitude[0] == pytest.approx(0.0, abs=1e-12)
    assert spectrum.order[-1] == 50.0 and spectrum.turns == 10


def test_the_density_of_white_noise_is_its_variance_over_half_the_rate():
    frequency, density = power_density(channel(3.0 * NOISE + 5.0))
    inner = (frequency > 10) & (frequency < 990)
    assert density[inner].mean() == pytest.approx(9.0 / 1000.0, rel=0.02)
    assert np.trapezoid(density, frequency) == pytest.approx(9.0, rel=0.02)  # Parseval


def test_the_response_is_that_of_the_filter_and_noise_lowers_the_coherence():
    b, a = [1.0, 0.5], [1.0, -1.2, 0.8]
    response = lfilter(b, a, NOISE) + 0.5 * np.random.default_rng(6).normal(size=len(NOISE))
    frequency, ratio, coherence = frequency_response(channel(response), channel(NOISE, "force"))
    z = np.exp(-2j * np.pi * frequency / RATE)
    exact = np.polyval(b[::-1], z) / np.polyval(a[::-1], z)
    inner = (frequency > 50) & (frequency < 950)
    assert np.median(np.abs(ratio / exact - 1)[inner]) < 0.1
    share = np.abs(exact) ** 2 / (np.abs(exact) ** 2 + 0.25)
    assert np.abs(coherence - share)[inner].mean() < 0.05


@pytest.mark.parametrize("changes", [{"rate": 1000.0}, {"values": NOISE[:-1]}, {"start": 1.0}])
def test_channels_that_are_not_sampled_together(changes):
    with pytest.raises(CaseError, match="not sampled together"):
        frequency_response(channel(NOISE), channel(NOISE) if not changes else channel(**{"values": NOISE} | changes))
