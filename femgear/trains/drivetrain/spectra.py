"""Spectra of drivetrain signals, over frequency and over orders, and their named lines.

Spectra are windowed and averaged. Lines are named for what makes them: mesh harmonics, side bands of the
turning carriers, sums and differences of two meshes.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.trains.drivetrain.model import DrivetrainModel
from femgear.trains.drivetrain.time import PASS_BAND

HARMONICS, SIDE_BANDS = 3, 3
# Half width of the main lobe of Hann's window in lines.
_LOBE = 2.0

# F. J. Harris, Proc. IEEE 66, 1978, 51-83.
WINDOWS = ("hann", "flattop", "boxcar")


@dataclass(frozen=True)
class MeshLine:
    """A line: its name, the integer orders of the bases, and the order of the first body."""

    name: str
    orders: tuple[int, ...]
    order: float


def mesh_lines(model: DrivetrainModel) -> tuple[MeshLine, ...]:
    """Mesh harmonics, side bands of the carrier's turn, sums and differences of two meshes."""
    count, planets = len(model.bases), len(model.geometry.even)
    meshes = [base for base in range(count) if base % 2 or base >= 2 * planets]
    found = []

    def add(name: str, orders: dict[int, int]) -> None:
        vector = np.zeros(count, int)
        vector[list(orders)] = list(orders.values())
        order = float(vector @ model.base_ratio)
        if order:
            found.append(MeshLine(name, tuple(int(o) for o in vector), abs(order)))

    for base in meshes:
        text = model.bases[base]
        if base < 2 * planets:
            add(model.bases[base - 1], {base - 1: 1})
        for h in range(1, HARMONICS + 1):
            add(text if h == 1 else f"{h} x {text}", {base: h})
        for k in (*range(-SIDE_BANDS, 0), *range(1, SIDE_BANDS + 1)) if base < 2 * planets else ():
            words = f"{'+' if k > 0 else '-'} {abs(k)} turn{'s' if abs(k) > 1 else ''}"
            add(f"{text} {words}", {base: 1, base - 1: k})
    for one, two in itertools.combinations(meshes, 2):
        for sign, word in ((1, "+"), (-1, "-")):
            add(f"{model.bases[two]} {word} {model.bases[one]}", {two: 1, one: sign})
    return tuple(found)


def resolved_lines(model: DrivetrainModel, lines, distance: float) -> np.ndarray:
    """Whether (L,) Hann's window parts a line from others and mesh harmonics; distance of orders."""
    order = np.array([line.order for line in lines])
    harmonics = np.outer(np.arange(1, 11), model.base_ratio[np.unique(model.mesh_base)]).ravel()
    apart = np.abs(order[:, None] - np.concatenate([order, harmonics]))
    # the line itself, twice where it is a mesh harmonic
    apart[apart < 1e-9 * order.max(initial=1.0)] = np.inf
    return apart.min(axis=1, initial=np.inf) >= _LOBE * distance


def line_amplitudes(signal, angle, speed, lines, *, record_rate: float) -> np.ndarray:
    """Amplitudes (L, c) of lines in signals (n, c), by projection on them at their exact orders.

    Hann's window over the angle; the mean is taken off. NaN beyond the pass band of the records.

    Parameters
    ----------
    signal : (n, c) array
        Records of equal distance in time.
    angle, speed : (n,) arrays
        Of the first body [rad], [rad/s].
    lines : sequence of MeshLine
    record_rate : float
        [Hz]
    """
    part = (angle - angle[0]) / (angle[-1] - angle[0])
    weight = (0.5 - 0.5 * np.cos(2.0 * np.pi * part)) * speed
    weight = weight / weight.sum()
    signal = np.asarray(signal, float)
    signal = signal - weight @ signal
    found = np.full((len(lines), signal.shape[1]), np.nan)
    for row, line in enumerate(lines):
        if line.order * np.abs(speed).max() / (2.0 * np.pi) <= 0.5 * PASS_BAND * record_rate:
            found[row] = 2.0 * np.abs((weight * np.exp(-1j * line.order * angle)) @ signal)
    return found


@dataclass(frozen=True)
class AveragedSpectrum:
    """Single-sided amplitude spectrum, the root of the mean of squared segments.

    Parameters
    ----------
    frequency : (F,) array
        [Hz], or orders.
    amplitude : (..., F) array
        Peak values: a sine that falls on a line shows its amplitude.
    resolution : float
        Distance of lines.
    bandwidth : float
        Equivalent noise bandwidth.
    window : str
    segments : int
        Averaged.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    resolution: float
    bandwidth: float
    window: str
    segments: int

    def near(self, frequency: float, width: float) -> np.ndarray:
        """Largest amplitude (...) within ``frequency +- width``."""
        inside = np.abs(self.frequency - frequency) <= width
        return self.amplitude[..., inside].max(axis=-1, initial=0.0)


def averaged_spectrum(
    signal, step: float, *, resolution: float, window: str = "hann", overlap: float = 0.5
) -> AveragedSpectrum:
    """Spectrum of a signal (n, ...) sampled every ``step`` seconds.

    P. D. Welch, IEEE Trans. Audio Electroacoust. 15, 1967, 70-73, of amplitudes instead of densities; the
    mean of
    every segment is taken off.

    Parameters
    ----------
    signal : (n, ...) array
    step : float
        [s], or turns for orders.
    resolution : float
        Wanted distance of lines [Hz]; the segments take ``1 / resolution`` seconds.
    window : {"hann", "flattop", "boxcar"}
    overlap : float
        Of the segments, as a share.
    """
    from scipy.signal import get_window

    signal = np.asarray(signal, float)
    length = round(1.0 / (resolution * step)) if resolution > 0.0 and step > 0.0 else 0
    if window not in WINDOWS or not 0.0 <= overlap < 1.0 or not 8 <= length <= len(signal):
        raise CaseError(
            f"segments of {length} of {len(signal)} samples, window {window}, overlap {overlap}",
            code="E-SPECTRUM", limit=f"8 samples up to the whole signal, {', '.join(WINDOWS)}, below 1",
            remedy="take a coarser resolution or a longer signal",
        )  # fmt: skip
    weight = get_window(window, length)
    hop = max(1, round(length * (1.0 - overlap)))
    starts = range(0, len(signal) - length + 1, hop)
    power = 0.0
    for start in starts:
        part = signal[start : start + length]
        line = np.fft.rfft((part - part.mean(axis=0)).T * weight, axis=-1)
        power = power + np.abs(line) ** 2
    amplitude = 2.0 * np.sqrt(power / len(starts)) / weight.sum()
    bandwidth = np.sum(weight**2) / weight.sum() ** 2 / step
    return AveragedSpectrum(
        np.fft.rfftfreq(length, step), amplitude, 1.0 / (length * step), float(bandwidth), window, len(starts)
    )


def order_spectrum(
    signal, angle, *, resolution: float, per_turn: int, window: str = "hann"
) -> AveragedSpectrum:
    """Spectrum over orders of an angle that need not grow evenly.

    The signal is taken at equal steps of the angle by cubic splines (K. R. Fyfe and E. D. S. Munck, Mech.
    Syst.
    Signal Process. 11, 1997, 187-205), then as in `averaged_spectrum`.

    Parameters
    ----------
    signal : (n, ...) array
    angle : (n,) array
        Ascending [rad].
    resolution : float
        Distance of orders.
    per_turn : int
        Samples a turn, more than twice the highest order; orders above a half of it alias.
    """
    from scipy.interpolate import CubicSpline

    angle = np.asarray(angle, float)
    if len(angle) < 4 or np.any(np.diff(angle) <= 0.0):
        raise CaseError(
            "the angle of order tracking must ascend", code="E-SPECTRUM", limit="4 samples or more"
        )
    count = int((angle[-1] - angle[0]) / (2.0 * np.pi) * per_turn)
    even = angle[0] + 2.0 * np.pi / per_turn * np.arange(count)
    tracked = CubicSpline(angle, np.asarray(signal, float))(even)
    return averaged_spectrum(tracked, 1.0 / per_turn, resolution=resolution, window=window)
