"""Figures of housing.nc: what a sensor fixed to the housing hears during one carrier revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.housing.orders import BandAnalysis, analyse_band
from femgear.housing.orders import order_spectrum as _spectrum
from femgear.plots.style import (
    BLACK,
    BLUE,
    COLOURS,
    ORANGE,
    SIZE,
    VERMILION,
    excited_to,
    label,
    legend_below,
    new_figure,
    rpm,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# share of the height below the strongest line that a letter above it takes
_ROOM = 0.068
# numbers along an axis, and lines of a spectrum that can be told apart, at most
_TICKS, _STEMS = 20, 4000
_LINEAR, _EXACT = "Heaviside, linear interpolation", "exact circumferential Fourier"
ACCELERATION = "acceleration [m/s²]"


def strongest_harmonic(housing: xr.Dataset, *, speed_index: int, ring_teeth: int) -> int:
    """Mesh harmonic whose band holds the strongest line at one speed."""
    order, amplitude = housing["order"].values, housing["order_amplitude"].values[speed_index]
    audible = order > ring_teeth / 2
    return max(1, round(float(order[audible][np.argmax(amplitude[audible])]) / ring_teeth))


def band(housing: xr.Dataset, *, speed_index: int, ring_teeth: int, harmonic: int) -> BandAnalysis:
    """Lines, signal, envelope and lobes around one mesh harmonic; see `housing.orders.analyse_band`."""
    spectrum = _spectrum(housing["acceleration"].values[speed_index])
    return analyse_band(spectrum, ring_teeth, harmonic)


def shown_harmonics(housing: xr.Dataset, *, speed_index: int, ring_teeth: int) -> tuple[int, ...]:
    """The first mesh harmonic, and the one with the strongest line where that is another one."""
    strongest = strongest_harmonic(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    return tuple(sorted({1, strongest}))


def housing_signal(
    housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, harmonics: Sequence[int] | None = None
) -> Figure:
    """Acceleration over one carrier revolution: whole, and around mesh harmonics with its envelope.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``acceleration`` (speed, time) [m/s^2].
    speed_index : int
    ring_teeth : int
    harmonics : sequence of int, optional
        Mesh harmonics of the bands; the first and the one with the strongest line when omitted.

    Returns
    -------
    Figure
    """
    if harmonics is None:
        harmonics = shown_harmonics(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    speed = rpm(housing["speed"].values[speed_index])
    figure, axes = new_figure(
        rows=1 + len(harmonics), width=9.5, height=1.0 + 2.5 * (1 + len(harmonics)), sharex=True
    )
    signal = housing["acceleration"].values[speed_index]
    text = "largest and smallest within a mesh period"
    around = _extremes(signal, ring_teeth)
    title = f"{speed}{excited_to(housing, speed_index)}: all orders"
    _draw_signal(axes[0], signal, around, title, text=text, colour=ORANGE)
    for ax, harmonic in zip(axes[1:], harmonics):
        found = band(housing, speed_index=speed_index, ring_teeth=ring_teeth, harmonic=harmonic)
        around = found.envelope, -found.envelope
        _draw_signal(ax, found.signal, around, _band_title(speed, found))
        lobes = found.lobes
        # an empty set of markers that are not clipped would upset the layout
        if len(lobes.position):
            ax.plot(lobes.position, lobes.height, "v", color=BLACK, markersize=7, label="lobe", clip_on=False)
    axes[-1].set_xlim(0, 1)
    label(axes[-1], "carrier revolutions [1]")
    legend_below(figure)
    return figure


def _draw_signal(ax, signal, around, title, *, text="envelope", colour=VERMILION):
    at = np.arange(len(signal)) / len(signal)
    ax.plot(at, signal, color=BLUE, linewidth=0.5, label="acceleration of the fixed point")
    for side in around:
        at = np.append(np.arange(len(side)) / len(side), 1.0)
        ax.plot(at, np.append(side, side[0]), color=colour, linewidth=1.3, label=text)
    label(ax, y=ACCELERATION, title=title)


def _extremes(signal, ring_teeth):
    """Largest and smallest value within one mesh period around every sample: signals may lack symmetry."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    size = max(len(signal) // ring_teeth, 1)
    return maximum_filter1d(signal, size, mode="wrap"), minimum_filter1d(signal, size, mode="wrap")


def _band_title(speed: str, found: BandAnalysis) -> str:
    count, threshold = len(found.lobes.position), found.lobes.threshold
    return (
        f"{speed}: orders {found.low} to {found.high}, mesh harmonic {found.harmonic}: {count} lobes "
        f"(prominence above {threshold:.0%} of the largest)"
    )


def order_spectrum(housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, zooms: int = 2) -> Figure:
    """Order spectrum with the mesh harmonics marked, and the strongest bands with their lines labelled.

    A line of harmonic ``h`` and nodal diameter ``n`` stands at order ``h z_ring - n``.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``order_amplitude`` and ``order_amplitude_exact`` (speed, order) [m/s^2].
    speed_index : int
    ring_teeth : int
    zooms : int
        Number of bands shown enlarged.

    Returns
    -------
    Figure
    """
    order = housing["order"].values
    linear, exact = (
        housing[name].values[speed_index] for name in ("order_amplitude", "order_amplitude_exact")
    )
    bands = _strongest_bands(order, linear, ring_teeth, zooms)
    figure, axes = new_figure(rows=1 + len(bands), width=9.5, height=3.2 + 3.8 * len(bands))
    largest = max(linear.max(initial=0.0), exact.max(initial=0.0)) or 1.0
    floor = 1e-4 * largest
    # what stands for the ring between its points is said where it is not the ring itself
    form = _EXACT if np.array_equal(linear, exact) else _LINEAR
    _stems(axes[0], order, linear, floor, text=form)
    # the record may reach further than the excitation at this speed
    end = order[np.maximum(linear, exact) > floor].max(initial=ring_teeth)
    axes[0].set_xlim(0, end + 0.5 * ring_teeth)
    last = int(end + 0.5 * ring_teeth) // ring_teeth
    # at most twenty numbers, that none covers another
    multiples = np.arange(1, last + 1) if last <= _TICKS else np.arange(0, last + 1, _whole_step(last))[1:]
    top = axes[0].secondary_xaxis("top")
    top.set_xticks(multiples * ring_teeth, [str(h) for h in multiples])
    top.tick_params(labelsize=SIZE - 2)
    top.set_xlabel("harmonic of the mesh frequency [1]", fontsize=SIZE - 1)
    label(axes[0], "carrier order [1]", ACCELERATION)
    axes[0].set_ylim(floor, 2.5 * largest)
    for ax, harmonic in zip(axes[1:], bands):
        _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form)
    speed = rpm(housing["speed"].values[speed_index]) + excited_to(housing, speed_index)
    figure.suptitle(f"Order spectrum of the fixed sensor, {speed}", fontsize=12)
    legend_below(figure)
    return figure


def _strongest_bands(order, amplitude, ring_teeth, count):
    """Mesh harmonics whose bands hold the strongest lines, ascending."""
    harmonics = np.rint(order / ring_teeth).astype(int)
    peaks = {int(h): amplitude[harmonics == h].max() for h in np.unique(harmonics) if h > 0}
    ranked = sorted((h for h in peaks if peaks[h] > 0), key=lambda h: (-peaks[h], h))
    return sorted(ranked[:count])


def _stems(ax, order, amplitude, floor, *, text, colour=BLUE, width=1.0):
    shown = _highest(order, amplitude, amplitude > floor)
    ax.vlines(order[shown], floor, amplitude[shown], color=colour, linewidth=width, label=text)
    ax.set_yscale("log")


def _highest(order, amplitude, shown) -> np.ndarray:
    """Numbers of the lines to draw: of more than there are pixels, the highest one of every column."""
    numbers = np.flatnonzero(shown)
    if len(numbers) <= _STEMS:
        return numbers
    column = ((order[numbers] - order[0]) * (_STEMS / np.ptp(order))).astype(int)
    # the last of a column in ascending order is its highest
    ranked = np.lexsort((amplitude[numbers], column))
    last = np.append(np.diff(column[ranked]) > 0, True)
    return numbers[ranked[last]]


def _draw_band(ax, order, linear, exact, ring_teeth, harmonic, form):
    centre = harmonic * ring_teeth
    own = np.rint(order / ring_teeth) == harmonic
    largest = max(linear[own].max(initial=0.0), exact[own].max(initial=0.0)) or 1.0
    floor = 3e-4 * largest
    # the images that the interpolation makes far from the centre are left to the upper diagram
    reach = int(np.abs(order[own & (exact > floor)] - centre).max(initial=4.0)) + 2
    inside = np.abs(order - centre) <= reach
    _stems(ax, order[inside], linear[inside], floor, text=form, width=2.5)
    if form != _EXACT:
        shown = inside & (exact > floor)
        ax.plot(order[shown], exact[shown], "o", markerfacecolor="none", color=VERMILION, label=_EXACT)
    peak = np.maximum(linear, exact)
    limit, longest = peak[inside].max(initial=floor), 0
    for k in _labelled(order, peak, inside & (peak > floor), spacing=reach / 22):
        offset = round(order[k]) - centre
        text = (
            f"{order[k]:g}"
            if offset == 0
            else f"{order[k]:g} = {_multiple(harmonic, ring_teeth)} {offset:+d}"
        )
        longest = max(longest, len(text))
        ax.annotate(
            text.replace("-", "−"),
            (order[k], peak[k]),
            xytext=(0, 7),
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=SIZE - 2.5,
        )
    decades = np.arange(np.ceil(np.log10(floor)), np.floor(np.log10(2 * limit)) + 1)
    ax.set_yticks(10.0**decades)
    ax.minorticks_off()
    # room above the strongest line for its label on the logarithmic axis
    ax.set_ylim(floor, limit * (limit / floor) ** (_ROOM * longest) if limit > floor else 10 * floor)
    ax.set_xlim(centre - reach, centre + reach)
    label(ax, "carrier order [1]", ACCELERATION, f"around mesh harmonic {harmonic} (order {centre})")


def _multiple(harmonic, ring_teeth):
    return str(ring_teeth) if harmonic == 1 else f"{harmonic}·{ring_teeth}"


def _labelled(order, amplitude, candidates, *, spacing, limit=12):
    """Strongest lines whose labels do not run into each other."""
    chosen = []
    for k in np.flatnonzero(candidates)[np.argsort(-amplitude[candidates], kind="stable")]:
        if all(abs(order[k] - order[other]) >= spacing for other in chosen):
            chosen.append(k)
        if len(chosen) == limit:
            break
    return chosen


def modulation_polar(
    housing: xr.Dataset, *, speed_index: int = 0, ring_teeth: int, harmonics: Sequence[int] | None = None
) -> Figure:
    """Envelope around mesh harmonics over the angle of the carrier, one polar diagram for each.

    Parameters
    ----------
    housing : xarray.Dataset
        With ``acceleration`` (speed, time) [m/s^2].
    speed_index : int
    ring_teeth : int
    harmonics : sequence of int, optional
        Mesh harmonics; the first and the one with the strongest line when omitted.

    Returns
    -------
    Figure
    """
    if harmonics is None:
        harmonics = shown_harmonics(housing, speed_index=speed_index, ring_teeth=ring_teeth)
    speed = rpm(housing["speed"].values[speed_index])
    figure, axes = new_figure(columns=len(harmonics), width=5.2 * len(harmonics), height=6.2, polar=True)
    for i, (ax, harmonic) in enumerate(zip(axes, harmonics)):
        found = band(housing, speed_index=speed_index, ring_teeth=ring_teeth, harmonic=harmonic)
        lobes, angle = found.lobes, np.linspace(0.0, 2 * np.pi, len(found.envelope) + 1)
        value = np.append(found.envelope, found.envelope[0])
        ax.plot(angle, value, color=COLOURS[i % len(COLOURS)], linewidth=2.0)
        # a polygon would search the extremes of every one of its sides
        ax.fill_between(angle, 0.0, value, color=COLOURS[i % len(COLOURS)], alpha=0.15, linewidth=0)
        ax.plot(2 * np.pi * lobes.position, lobes.height, "v", color=BLACK, markersize=6, label="lobe")
        ax.set_yticks(np.arange(1, 5) * _round_step(value.max(initial=0.0) / 4))
        ax.set_ylim(0, 1.12 * value.max(initial=0.0) or 1.0)
        for text in ax.get_yticklabels():
            text.set_bbox({"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0})
        # the scale stands where the curve is lowest, so that it hides nothing
        ax.set_rlabel_position(float(np.degrees(angle[np.argmin(_around(found.envelope))])))
        ax.set_title(
            f"{speed}, mesh harmonic {harmonic}: {len(lobes.position)} lobes\n"
            "envelope of the acceleration [m/s²] over the carrier angle",
            fontsize=SIZE,
            pad=14,
        )
    legend_below(figure)
    return figure


def _around(values):
    """Mean over the fifteenth of a turn around every value."""
    from scipy.ndimage import uniform_filter1d

    return uniform_filter1d(values, max(len(values) // 15, 1), mode="wrap")


def _whole_step(last: int) -> int:
    """Whole step of at most `_TICKS` ticks up to `last`."""
    return max(round(_round_step(last / _TICKS)), 1)


def _round_step(step: float) -> float:
    """The next larger of 1, 2, 2.5, 5, 10 times a power of ten."""
    if step <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(step))
    return min(f * power for f in (1.0, 2.0, 2.5, 5.0, 10.0) if f * power >= step * (1 - 1e-12))
