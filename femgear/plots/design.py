"""Figures of the design maps; functions take the results of `femgear.design`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import BLACK, COLOURS, VERMILION, label, legend_below, line_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("sun-planet", "planet-ring")
QUARTER, LINE = 0.25, COLOURS[4]


def harris_curves(torques, peak_to_peak, names, *, design: float | None = None) -> Figure:
    """Transmission error peak to peak over torque, one curve a relief.

    Parameters
    ----------
    torques : (T,) array
        Of the input [N m].
    peak_to_peak : (variants, 2, T) array
        Of sun-planet and planet-ring meshes [m].
    names : sequence of str
        Legend text of each variant.
    design : float, optional
        Torque to be marked [N m].
    """
    figure, axes = new_figure(columns=2, width=10.0, height=4.6, sharex=True)
    # one torque is no line
    marker = {"marker": "o"} if len(torques) == 1 else {}
    for kind, ax in enumerate(axes):
        curves = 1e6 * peak_to_peak[:, kind]
        # a relief of the sun side hardly changes the other meshes
        if len(curves) > 1 and np.ptp(curves, axis=0).max() < 0.01 * curves.max():
            ax.plot(torques, curves[0], label="all reliefs (within 1 %)", color=BLACK, **marker)
        else:
            for v, name in enumerate(names):
                ax.plot(torques, curves[v], label=name, **line_style(v), **marker)
        if design is not None:
            ax.axvline(design, color="0.5", linewidth=1.0, label=f"{design:g} N m")
        ax.set_ylim(bottom=0)
        label(ax, "torque of the input [N m]", title=f"{KINDS[kind]} meshes")
    label(axes[0], y="transmission error peak to peak [µm]")
    legend_below(figure)
    return figure


def relief_contours(amounts, lengths, ratios, torques, *, optimum=None, design=None) -> Figure:
    """Transmission error peak to peak over that without relief, over amount and length of the relief.

    Parameters
    ----------
    amounts : (A,) array
        [m]
    lengths : (L,) array
        In lengths of two-pair contact.
    ratios : (T, A, L) array
    torques : (T,) array
        Of the input [N m].
    optimum : (float, float), optional
        Amount [m] and length to be marked.
    design : float, optional
        Torque [N m] the optimum was found at; under the others it is marked as chosen.
    """
    figure, axes = new_figure(
        columns=len(torques), width=max(3.9 * len(torques), 6.0), height=4.4, sharex=True, sharey=True
    )
    levels = np.linspace(0.0, 1.5, 13)
    for ax, ratio, torque in zip(axes, ratios, torques):
        filled = ax.contourf(lengths, 1e6 * amounts, ratio, levels=levels, cmap="viridis", extend="max")
        if ratio.min() < QUARTER < ratio.max():
            ax.contour(lengths, 1e6 * amounts, ratio, levels=[QUARTER], colors=[LINE], linewidths=2.0)
            # a contour has no legend entry of its own
            ax.plot([], [], color=LINE, linewidth=2.0, label=f"{QUARTER:.0%} of unmodified")
        if optimum is not None:
            _mark(ax, optimum, own=design is None or np.isclose(torque, design), design=design)
        label(ax, "length [two-pair contact]", title=f"{torque:g} N m")
    label(axes[0], y="amount at the tips [µm]")
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label("STE peak to peak over unmodified [1]")
    legend_below(figure)
    return figure


def _mark(ax, optimum, *, own: bool, design) -> None:
    """A full circle under the torque of the optimum, an open one under others."""
    amount, length = optimum
    name = "optimum" if own else f"chosen for {design:g} N m"
    name = f"optimum at {design:g} N m" if own and design is not None else name
    face = VERMILION if own else "white"
    style = {"color": VERMILION, "markerfacecolor": face, "markersize": 9, "markeredgewidth": 2.0}
    ax.plot(length, 1e6 * amount, "o", label=name, clip_on=False, **style)


def sharing_histogram(factors, names, n_planets: int) -> Figure:
    """Distribution of the load sharing factor, one step curve a support.

    Parameters
    ----------
    factors : sequence of (S,) arrays
        K_gamma of every sample.
    names : sequence of str
    n_planets : int
        The largest factor there can be.
    """
    figure, (left, right) = new_figure(columns=2, width=10.0, height=4.4)
    top = min(max(float(np.max(f)) for f in factors) * 1.02 + 0.02, float(n_planets) + 0.02)
    edges = np.linspace(0.99, max(top, 1.05), 80)
    for i, (factor, name) in enumerate(zip(factors, names)):
        share = 100.0 / len(factor)
        left.hist(
            factor, edges, weights=np.full(len(factor), share), histtype="step", label=name, **line_style(i)
        )
        ordered = np.sort(factor)
        beyond = 100.0 * (1.0 - np.arange(1, len(ordered) + 1) / len(ordered))
        right.step(ordered, beyond, where="post", label=name, **line_style(i))
    label(left, "load sharing factor K_gamma [1]", "samples [%]", "distribution")
    label(right, "load sharing factor K_gamma [1]", "samples beyond [%]", "probability to exceed")
    for ax in (left, right):
        ax.set_xlim(edges[0], edges[-1])
    # narrow and wide distributions side by side
    left.set_yscale("log")
    right.set_ylim(bottom=0)
    legend_below(figure)
    return figure
