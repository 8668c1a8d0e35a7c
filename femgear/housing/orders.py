"""Carrier orders: spectra, bands around a mesh harmonic, envelopes, lobes and the lines that dominate."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from femgear.errors import CaseError, checked_count
from femgear.gears.kinematics import sun_ratio
from femgear.housing.sensor import ReadOnlyArrays, SensorLines

_FLOOR = -60.0
"""Level [dB] under the strongest line below which lines are left out."""


@dataclass(frozen=True)
class OrderSpectrum(ReadOnlyArrays):
    """Single-sided spectrum over carrier orders: ``x = Re sum_k value[k] exp(i order[k] theta)``.

    Parameters
    ----------
    order : (n_orders,) array
        Carrier orders from 0 upwards, ascending, multiples of 1/turns; others are silent.
    value : (..., n_orders) complex array
        Complex amplitudes in the unit of the signal (peak values, not r.m.s.).
    turns : int
        Turns of the carrier after which all repeats.
    """

    order: np.ndarray
    value: np.ndarray
    turns: int = 1

    @property
    def amplitude(self) -> np.ndarray:
        """Absolute values, shape (..., n_orders)."""
        return np.abs(self.value)


@dataclass(frozen=True)
class Line:
    """One line of a spectrum.

    ``order`` of the carrier, ``amplitude`` in the unit of the spectrum, ``level`` [dB] over the strongest line.
    """

    order: float
    amplitude: float
    level: float


@dataclass(frozen=True)
class Lobes(ReadOnlyArrays):
    """Lobes of an envelope over one carrier revolution, or the revolutions after which it repeats.

    Parameters
    ----------
    position : (n_lobes,) array
        Places of the maxima as fractions of the record, ascending.
    height : (n_lobes,) array
        Envelope there, in its unit.
    threshold : float
        Prominence from which a maximum was counted, as a share of the largest envelope value.
    """

    position: np.ndarray
    height: np.ndarray
    threshold: float


@dataclass(frozen=True)
class BandAnalysis(ReadOnlyArrays):
    """What is heard around one mesh harmonic at one speed.

    Parameters
    ----------
    harmonic : int
        Mesh harmonic, 1 upwards.
    low, high : int
        Carrier orders of the band, both included.
    lines : tuple of Line
        Strongest lines of the band, strongest first.
    signal, envelope : (n_samples,) arrays
        Band-passed signal and its envelope over the record, in the unit of the spectrum.
    lobes : Lobes
        Of the envelope.
    """

    harmonic: int
    low: int
    high: int
    lines: tuple[Line, ...]
    signal: np.ndarray
    envelope: np.ndarray
    lobes: Lobes


def order_spectrum(signal) -> OrderSpectrum:
    """Compute the order spectrum of a signal that spans one carrier revolution (no window, no leakage).

    The samples (..., n_samples), of any unit, are equidistant, the end point excluded. CaseError: less than
    two, or not finite (E-SHAPE).
    """
    signal = np.asarray(signal, dtype=float)
    n = signal.shape[-1] if signal.ndim else 0
    if n < 2 or not np.all(np.isfinite(signal)):
        message = f"a signal of {n} samples has no order spectrum"
        raise CaseError(message, code="E-SHAPE", limit="two or more finite samples over a carrier revolution")
    value = np.fft.rfft(signal, axis=-1) * (2 / n)
    value[..., 0] /= 2
    if n % 2 == 0:
        value[..., -1] /= 2
    return OrderSpectrum(np.arange(float(value.shape[-1])), value)


def array_factor(planet_angles, order) -> np.ndarray:
    """Compute the planet array factor ``|sum_j exp(i L psi_j)|/N`` of carrier orders L, 0 to 1.

    The mesh of a planet ahead by psi_j does what the first one does, earlier by that angle of the carrier:
    the lines of N identical planets that know nothing of each other are those of one times N times this
    factor, on any fixed housing and around every mesh harmonic. Where it vanishes because of a symmetry of
    the spacing (equal: L no multiple of N; opposite pairs: L odd) the line does not exist at all, whatever
    planets and housing do to each other. It contains the five groups of M. Inalpolat and A. Kahraman, J.
    Sound Vib. 323 (2009) 677-696.

    Parameters
    ----------
    planet_angles : (N,) array
        In the frame of the carrier [rad].
    order : (...) int array
        Carrier orders.
    """
    angles = np.asarray(planet_angles, float)
    return np.abs(np.exp(1j * np.multiply.outer(np.asarray(order), angles)).mean(axis=-1))


NORMAL, UNEQUAL, FOREIGN = "normal", "needs unequal turning parts", "not from this stage"
"""Verdicts on a line."""
MOST_TURNS = 2
"""Turns of a part in a line, unless it is heard: a planet that hits sun and ring meets one of them twice a turn."""
_NO_TURNS = ", nor at one or two turns of sun or planet"
_CLEARLY_NEARER = 0.3
"""Distance between places of turns over the tolerance from which on the nearer one counts, else the fewer turns."""
_ZERO = 5e-4
"""Array factor that angles given to a thousandth of a degree may leave where there is none."""


@dataclass(frozen=True)
class LineVerdict:
    """What a carrier order of a spectrum says about the set: see `classify_line`.

    Parameters
    ----------
    nearest : int
        Whole carrier order next to the line.
    factor : float
        Array factor there.
    verdict : str
        `NORMAL`, `UNEQUAL` or `FOREIGN`.
    reason : str
        Why, and the turns of sun or planets that give this order.
    part : str
        ``"sun"`` or ``"planet"`` where the turns of that part alone give the order, which is no whole one.
    """

    nearest: int
    factor: float
    verdict: str
    reason: str
    part: str = ""


def spacing_symmetry(planet_angles) -> int:
    """Find the largest g for which turns by ``2 pi/g`` map the planet angles (N,) [rad] on one another."""
    place = np.exp(1j * np.asarray(planet_angles, float))
    turned = (place[:, None] * np.exp(2j * np.pi / g) - place for g in range(len(place), 0, -1))
    return next(len(place) - i for i, difference in enumerate(turned) if np.abs(difference).min(axis=1).max() < 1e-5)


def classify_lines(
    orders, planet_angles, teeth: tuple[int, int | None, int | None], *, tolerance: float
) -> tuple[LineVerdict, ...]:
    """Classify all lines (k,) of a record as `classify_line`; of a part that is heard at more of its turns too.

    A tooth that hits once a turn makes lines at all turns of its gear. They are counted where lines at one or two of
    them stand in the record: else the many turns would explain almost any line. Where several parts are heard, a line
    at turns of one is compared with all turns of the others, which may lie nearer.
    """
    first = [classify_line(order, planet_angles, teeth, tolerance=tolerance) for order in orders]
    heard_parts = frozenset(place.part for place in first if place.part)
    if not heard_parts:
        return tuple(first)
    return tuple(
        classify_line(order, planet_angles, teeth, tolerance=tolerance, heard_parts=heard_parts)
        if place.verdict == FOREIGN or place.part
        else place
        for order, place in zip(orders, first, strict=True)
    )


def classify_line(
    order: float,
    planet_angles,
    teeth: tuple[int, int | None, int | None],
    *,
    tolerance: float,
    heard_parts: Collection[str] = (),
) -> LineVerdict:
    """Tell whether a healthy set makes a line that is heard on its housing, and what else would.

    A function of the angle of the carrier that is the same after its turns by ``2 pi/g``, g of
    `spacing_symmetry`, has orders that are multiples of g: on any housing, whatever equal planets do to each
    other. An error of the sun turns with it, by ``1 + z_ring/z_sun`` a turn of the carrier, and adds
    multiples of that to those orders; one of a single planet turns by ``z_ring/z_planet`` against the carrier
    and may stand beside any whole order.

    CaseError: E-RANGE: an order or a tolerance out of range.

    Parameters
    ----------
    order : float
        Carrier order, above zero.
    planet_angles : (N,) array
        In the frame of the carrier [rad].
    teeth : (ring, sun, planet)
        Of the ring, which stands still; of sun and planet None where they are not known.
    tolerance : float
        Distance of orders that are taken as one, below a half: about half the resolution of the spectrum. An
        order without meaning fits one of four turns of a part by chance in ``8 tolerance`` of all cases.
    heard_parts : collection of str
        Parts, "sun" or "planet", whose lines at one or two turns the record has: they count at all turns, unless these
        lie closer than four tolerances and would explain most orders.
    """
    if not (0 < order < np.inf and 0 < tolerance < 0.5):
        message, limit = "no such line", "a finite order above 0, 0 < tolerance < 0.5"
        raise CaseError(message, code="E-RANGE", value=(order, tolerance), limit=limit)
    g, nearest = spacing_symmetry(planet_angles), round(order)
    factor, whole = float(array_factor(planet_angles, nearest)), abs(order - nearest) <= tolerance
    if whole and nearest % g == 0:
        shared = "factor zero: by sun and ring, which unequally spaced planets share"
        return LineVerdict(nearest, factor, NORMAL, "" if factor > _ZERO else shared)
    turns = [turn for turn in _turns(order, teeth, g, tolerance) if not (whole and turn[2])]
    if heard_parts and not whole and (not turns or len(heard_parts) > 1):
        turns = list(_turns(order, teeth, g, tolerance, heard_parts))
    nearest_turns = sorted(turns, key=lambda turn: (round(turn[0] / (_CLEARLY_NEARER * tolerance)), turn[1] + turn[2]))
    *_, turned, part = nearest_turns[0] if turns else ("", "")
    if whole:
        words = f"no multiple of {g}" + (f"; {turned}" if turned else "")
        return LineVerdict(nearest, factor, UNEQUAL, words)
    if turned:
        return LineVerdict(nearest, factor, UNEQUAL, turned, part)
    return LineVerdict(nearest, factor, FOREIGN, "no whole carrier order" + (_NO_TURNS if any(teeth[1:]) else ""))


def _turns(
    order: float, teeth, symmetry: int, tolerance: float, heard_parts: Collection[str] = ()
) -> Iterator[tuple[float, int, int, str, str]]:
    """Turns of sun and planet that give an order.

    How far it is from theirs, how many turns, carrier orders beside a mesh harmonic, words, part.
    """
    ring, sun, planet = teeth
    parts = (("the sun", sun and sun_ratio(sun, ring), symmetry), ("a planet", planet and ring / planet, 1))
    for name, rate, step in parts:
        if not rate:
            continue
        part = name.split()[-1]
        most = counted_turns(part, teeth, symmetry, tolerance) if part in heard_parts else MOST_TURNS
        for k in (turn for n in range(1, most + 1) for turn in (n, -n)):
            rest = order - k * rate
            whole, harmonic = round(rest), max(round(rest / ring), 0) * ring
            if abs(rest - whole) <= tolerance and whole % step == 0:
                n, beside = abs(k), whole - harmonic
                words = f"{harmonic} {'+' if k > 0 else '-'} {n} turn{'s' * (n > 1)} of {name}"
                words += f" {'+' if beside > 0 else '-'} {abs(beside)}" if beside else ""
                yield abs(rest - whole), n, abs(beside), words, part


def counted_turns(part: str, teeth, symmetry: int, tolerance: float) -> int:
    """Most turns of a part that count where it is heard: all that give other orders than fewer do, but two at least.

    Orders of healthy sets are multiples of a step, ``symmetry`` for errors of the sun and 1 for those of one planet. A
    turn over that step is a fraction; after as many turns as its denominator the orders repeat. ``q + 2.7 m`` of all m
    has ten places from one whole order to the next. Where places lie within four tolerances, two turns count.
    """
    ring, sun, planet = teeth
    step = symmetry if part == "sun" else 1
    places = (Fraction(ring + sun, sun * step) if part == "sun" else Fraction(ring, planet)).denominator
    return max(places // 2, MOST_TURNS) if step > 4 * tolerance * places else MOST_TURNS


def part_orders(
    teeth: tuple[int, int | None, int | None], symmetry: int, tolerance: float
) -> Iterator[tuple[int, np.ndarray]]:
    """Find where a fault of the sun, and one of a planet, has lines: an order (m,) from zero to a step, and that step.

    They repeat after the step, which is the symmetry of the spacing for the sun and 1 for one planet; zero is among
    them, and turns are those of `counted_turns`. Parts that make whole turns have no others and are left out.

    Parameters
    ----------
    teeth : (ring, sun, planet)
        Of sun and planet None where they are not known.
    symmetry : int
        Of `spacing_symmetry`.
    tolerance : float
        Distance of orders that count as one.
    """
    ring, sun, planet = teeth
    rates = ("sun", sun and Fraction(ring + sun, sun), symmetry), ("planet", planet and Fraction(ring, planet), 1)
    for part, rate, step in rates:
        if not rate or (Fraction(rate) / step).denominator == 1:
            continue
        turns = range(counted_turns(part, teeth, symmetry, tolerance) + 1)
        yield step, np.array(sorted({float(sign * turn * rate % step) for turn in turns for sign in (1, -1)}))


def find_lines(order, amplitude, *, threshold: float) -> np.ndarray:
    """Find the lines of a spectrum that reach a threshold [dB] over its largest value, by number, ascending.

    Of orders (n,), ascending, and amplitudes (n,). Where they are closer than half an order, a line is a
    value above its neighbours; else, as in lists of lines, every value is one.
    """
    order, amplitude = np.asarray(order, float), np.asarray(amplitude, float)
    top = amplitude[order > 0].max(initial=0.0)
    high = (amplitude >= top * 10 ** (threshold / 20)) & (order > 0) & (amplitude > 0)
    if np.median(np.diff(order)) < 0.5:
        around = np.pad(amplitude, 1, constant_values=-np.inf)
        high &= (amplitude > around[:-2]) & (amplitude >= around[2:])
    return np.flatnonzero(high)


def order_level(lines: SensorLines) -> np.ndarray:
    """Compute the root mean square acceleration of a fixed sensor [m/s^2], shape (...), without its mean."""
    return np.sqrt(0.5 * (np.abs(lines.acceleration[..., lines.order > 0]) ** 2).sum(axis=-1))


def band_pass(spectrum: OrderSpectrum, low: float, high: float) -> OrderSpectrum:
    """Take the carrier orders low..high out of a spectrum: a brick wall, exact for periodic signals.

    Both ends are included; values (..., n_orders) are zero outside. CaseError: limits that hold no order of
    the spectrum above zero (E-RANGE).
    """
    inside = (spectrum.order >= low) & (spectrum.order <= high)
    if low <= 0 or not inside.any():
        raise CaseError(
            f"no carrier orders from {low} to {high} in a spectrum that ends at {spectrum.order[-1]}",
            code="E-RANGE",
            value=(low, high),
            limit=f"0 < low <= high, low <= {spectrum.order[-1]}",
            remedy="choose a mesh harmonic that the response contains",
        )
    return OrderSpectrum(spectrum.order, np.where(inside, spectrum.value, 0), spectrum.turns)


def analytic_signal(spectrum: OrderSpectrum) -> np.ndarray:
    """Compute the analytic signal sum_k value[k] exp(i order[k] theta), (..., 4 K + 4) complex samples.

    K is the highest order times the turns of the carrier that the samples span. Its modulus is the envelope.
    """
    order = np.rint(spectrum.order * spectrum.turns).astype(int)
    every = np.zeros((*spectrum.value.shape[:-1], 4 * int(order[-1]) + 4), dtype=complex)
    every[..., order] = spectrum.value
    return np.fft.ifft(every, axis=-1, norm="forward")


def count_lobes(periodic_envelope, *, threshold: float = 0.1) -> Lobes:
    """Count the maxima of a periodic envelope that stand out by at least `threshold` times its largest value.

    The envelope (n_samples,) spans one carrier revolution or several. It is turned until it begins and ends
    at its lowest value, so that its seam is no edge and the prominences are those of the endless signal.

    CaseError: no envelope of one signal, finite and not negative, or a threshold that is not between 0 and 1
    (E-SHAPE).
    """
    values = np.asarray(periodic_envelope, dtype=float)
    usable = values.ndim == 1 and values.size > 2 and np.all(np.isfinite(values)) and np.all(values >= 0)
    if not usable or not 0 < threshold < 1:
        raise CaseError(
            f"no lobes can be counted on values of shape {values.shape} with the threshold {threshold}",
            code="E-SHAPE",
            limit="one envelope, finite and not negative, 0 < threshold < 1",
            remedy="pass the envelope of one speed",
        )
    largest = values.max()
    if largest == 0:
        return Lobes(np.empty(0), np.empty(0), threshold)
    start = int(values.argmin())
    turned = np.append(np.roll(values, -start), values[start])
    peaks = _prominent(turned, threshold * largest)
    place = (peaks + start) % values.size
    by_place = np.argsort(place)
    return Lobes(place[by_place] / values.size, turned[peaks][by_place], threshold)


def _prominent(values: np.ndarray, least: float) -> np.ndarray:
    """Places of prominent maxima, as SciPy's `find_peaks`, whose package takes long to load."""
    first = np.flatnonzero(np.diff(values, prepend=np.nan))  # of equal values
    level, last = values[first], np.append(first[1:], len(values)) - 1
    top = 1 + np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:]))
    height, valley = level[top], np.minimum.reduceat(level, np.append(0, top))
    places = []
    for k, high in enumerate(height):
        before, after = np.flatnonzero(height[:k] > high), np.flatnonzero(height[k + 1 :] > high)
        left = valley[before[-1] + 1 if len(before) else 0 : k + 1].min()
        right = valley[k + 1 : k + 2 + after[0] if len(after) else None].min()
        if high - max(left, right) >= least:
            places.append((first[top[k]] + last[top[k]]) // 2)
    return np.array(places, int)


def dominant_lines(spectrum: OrderSpectrum, *, low: float, high: float, count: int = 6) -> tuple[Line, ...]:
    """List the strongest lines of one spectrum (n_orders,), strongest first, down to -60 dB.

    Of the carrier orders low..high, both included, at most ``count``, none where the band is silent.
    CaseError: E-RANGE as `band_pass`; a spectrum of several signals (E-SHAPE).
    """
    amplitude = band_pass(spectrum, low, high).amplitude
    if amplitude.ndim != 1:
        raise CaseError(
            f"lines are listed for one signal, not for values of shape {amplitude.shape}",
            code="E-SHAPE",
            limit="a spectrum of shape (n_orders,)",
            remedy="pick one speed first",
        )
    strongest = amplitude.max()
    # stable, so that equal lines come in ascending order
    ranking = np.argsort(-amplitude, kind="stable")[:count]
    keep = [k for k in ranking if strongest > 0 and amplitude[k] >= strongest * 10 ** (_FLOOR / 20)]
    return tuple(
        Line(float(spectrum.order[k]), float(amplitude[k]), float(20 * np.log10(amplitude[k] / strongest)))
        for k in keep
    )


def analyse_band(
    spectrum: OrderSpectrum, z_ring: int, harmonic: int, *, half_width: int | None = None, count: int = 6
) -> BandAnalysis:
    """Analyse the band around a mesh harmonic: dominant lines, envelope and lobes of the signal.

    Parameters
    ----------
    spectrum : OrderSpectrum
        Of one signal.
    z_ring, harmonic : int
        The band is centred on order ``harmonic z_ring``.
    half_width : int, optional
        Orders on either side; default (z_ring - 1) // 2, so that bands do not overlap.
    count : int
        Largest number of lines listed.

    Raises
    ------
    CaseError
        ``E-TEETH``, ``E-RANGE``, ``E-SHAPE``.
    """
    checked_count(z_ring, "ring teeth", code="E-TEETH")
    half_width = (z_ring - 1) // 2 if half_width is None else half_width
    low, high = harmonic * z_ring - half_width, harmonic * z_ring + half_width
    lines = dominant_lines(spectrum, low=low, high=high, count=count)
    analytic = analytic_signal(band_pass(spectrum, low, high))
    envelope = np.abs(analytic)
    lobes = count_lobes(envelope)
    return BandAnalysis(harmonic, low, high, lines, np.real(analytic), envelope, lobes)
