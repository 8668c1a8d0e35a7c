"""Spectra of recordings: over orders of the carrier, power spectral densities, and frequency responses to a force."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum
from femgear.measured.channels import Channel
from femgear.measured.turns import AngleSignal

_SEGMENTS = 16
"""Segments of a record without overlap, over which densities are averaged."""


def windowed_spectrum(signal: AngleSignal) -> OrderSpectrum:
    """Compute the order spectrum of a signal over whole turns through a Hann window, up to its highest order.

    Amplitudes are those of lines (the window's mean of a half is divided out), without the mean of the signal.
    """
    values = signal.values - signal.values.mean()
    window = 1.0 - np.cos(2 * np.pi * np.arange(len(values)) / len(values))
    value = np.fft.rfft(values * window) * (2 / len(values))
    order = np.arange(len(value)) / signal.turns
    kept = order <= min(signal.highest_order, 0.5 * signal.per_turn - 1.0)
    return OrderSpectrum(order[kept], value[kept], signal.turns)


def power_density(channel: Channel) -> tuple[np.ndarray, np.ndarray]:
    """Compute the one-sided power spectral density of a channel, (f,) frequencies [Hz] and (f,) in its unit^2/Hz.

    By P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. Audio
    Electroacoust. 15 (1967) 70-73: Hann windows that overlap by half, without the mean of each.
    """
    from scipy.signal import welch

    length = max(len(channel.values) // _SEGMENTS, 16)
    return welch(channel.values, channel.rate, "hann", nperseg=length, detrend="constant")


def frequency_response(response: Channel, force: Channel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the frequency response of a channel to another one, the estimate H1, and its coherence.

    H1 is the cross spectrum over the auto spectrum of the force, free of noise in the response; the coherence is the
    share of the response that is linear in the force: J. S. Bendat and A. G. Piersol, Random Data, 4th ed. (2010),
    chapter 6. CaseError: channels that are not sampled together (E-FILE).

    Returns
    -------
    frequency : (f,) array
        [Hz].
    response : (f,) complex array
        In the unit of the response over that of the force.
    coherence : (f,) array
        0 to 1.
    """
    from scipy.signal import coherence, csd, welch

    together = response.rate == force.rate and len(response.values) == len(force.values)
    if not together or response.start != force.start:
        raise CaseError(
            "response and force are not sampled together",
            code="E-FILE",
            file=response.file,
            value=f"{len(force.values)} samples at {force.rate:g} Hz of {force.name}",
            limit=f"{len(response.values)} samples at {response.rate:g} Hz, as {response.name}",
            remedy="export both with one rate and over the same time",
        )
    length = max(len(response.values) // _SEGMENTS, 16)
    options = {"fs": response.rate, "window": "hann", "nperseg": length, "detrend": "constant"}
    frequency, cross = csd(force.values, response.values, **options)
    _, auto = welch(force.values, **options)
    _, share = coherence(force.values, response.values, **options)
    return frequency, cross / np.maximum(auto, np.finfo(float).tiny), share
