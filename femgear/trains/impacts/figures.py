"""Figures of impacts: amplitude and mean over frequency, contact states, sections and exponents."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    label,
    legend_below,
    new_figure,
    runs,
    show_changes,
)
from femgear.stages.protocol import Drawn, Figures
from femgear.trains.impacts.model import STATE_NAMES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# colours of no impact, one-sided and two-sided impact, and of states that are not known
STATE_COLOURS = (GREEN, ORANGE, VERMILION, GREY)
# parameters of a row up to which each is marked
_SPARSE = 80


def amplitude_and_mean(
    curves: Sequence[tuple],
    sweeps: Sequence[tuple] = (),
    *,
    x: str = "frequency ratio [1]",
    unit: str = "half backlash",
    title: str = "",
) -> Figure:
    """Draw amplitude and mean of a deflection over frequency, dashed where it is not known to be stable.

    Curves are (text, ratio (p,), amplitude (p,), mean (p,), stable (p,) bool); sweeps, drawn as markers, are
    (text, ratio (f,), amplitude (f,), mean (f,)).
    """
    figure, (top, bottom) = new_figure(rows=2, width=8.5, height=7.0, sharex=True)
    for number, (text, ratio, amplitude, mean, stable) in enumerate(curves):
        colour, sound = COLOURS[number % len(COLOURS)], np.asarray(stable, bool)
        segment = sound[:-1] & sound[1:]
        for ax, value in ((top, amplitude), (bottom, mean)):
            for wanted, dash in ((True, "-"), (False, "--")):
                for part in runs(segment == wanted):
                    ax.plot(ratio[part], value[part], dash, color=colour, linewidth=1.6)
        top.plot([], [], "-", color=colour, label=text)
    for marker, (text, ratio, amplitude, mean) in zip("^vso", sweeps):
        style = {"color": BLACK, "markersize": 4.5, "fillstyle": "none", "linestyle": ""}
        top.plot(ratio, amplitude, marker, label=text, **style)
        bottom.plot(ratio, mean, marker, **style)
    if not all(np.all(stable) for *_, stable in curves):
        top.plot([], [], "--", color=GREY, label="not stable")
    top.set_ylim(bottom=0.0)
    show_changes(bottom, 0.1)
    label(top, y=f"amplitude\n[{unit}]", title=title)
    label(bottom, x, f"mean [{unit}]")
    legend_below(figure, columns=3)
    return figure


def state_bands(rows: Sequence[tuple]) -> Figure:
    """Draw the contact state over the frequency ratio, one band a row.

    A border is drawn halfway between two ratios; sparse rows show these as dots. Rows are (text, ratio (p,),
    state (p,) int) of sweeps, or of pieces of a curve between limit points; states count as in `STATE_NAMES`.
    """
    figure, (ax,) = new_figure(width=8.5, height=1.6 + 0.5 * len(rows))
    marked = False
    for place, (_, parameter, state) in enumerate(rows):
        order = np.argsort(parameter)
        at, value = np.asarray(parameter, float)[order], np.asarray(state)[order]
        edges = np.concatenate([at[:1], 0.5 * (at[1:] + at[:-1]), at[-1:]])
        colours = [STATE_COLOURS[number] for number in value]
        ax.barh(np.full(len(at), place), np.diff(edges), left=edges[:-1], height=0.7, color=colours, linewidth=0)
        if len(at) <= _SPARSE:
            mark = {"marker": ".", "color": BLACK, "markersize": 2.5, "linestyle": "none"}
            ax.plot(at, np.full(len(at), place), **mark, label=None if marked else "computed ratios")
            marked = True
    present = {int(state_number) for _, _, state in rows for state_number in np.unique(state)}
    for number, (colour, name) in enumerate(zip(STATE_COLOURS, STATE_NAMES)):
        if number < 3 or number in present:
            ax.barh([0], [0.0], color=colour, label=name)
    ax.set_yticks(range(len(rows)), [text for text, _, _ in rows])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    label(ax, "frequency ratio [1]")
    legend_below(figure, columns=3)
    return figure


def bifurcation_and_exponent(chaos: xr.Dataset) -> Figure:
    """Draw deflections once a period of chaos.nc over the ratio, the largest exponent with its error below.

    Thin lines are the extremes of the motion.
    """
    ratio, points = chaos["ratio"].values, chaos["point"].values
    figure, (top, bottom) = new_figure(rows=2, width=8.5, height=7.0, sharex=True)
    top.plot(np.repeat(ratio, points.shape[1]), points.ravel(), ".", color=BLUE, markersize=1.6)
    for name, text in (("lowest", "smallest and largest x"), ("highest", None)):
        top.plot(ratio, chaos[name].values, color=GREY, linewidth=0.9, label=text)
    for level, text in ((1.0, "flanks close"), (-1.0, None)):
        top.axhline(level, color=ORANGE, linestyle="--", linewidth=1.1, label=text)
    bottom.axhline(0.0, color=BLACK, linewidth=0.9)
    style = {"color": VERMILION, "linewidth": 1.1, "elinewidth": 0.8, "marker": "o", "markersize": 3.0}
    bottom.errorbar(ratio, chaos["exponent"].values, yerr=chaos["error"].values, **style)
    label(top, y="x once a period [half backlash]")
    label(bottom, "frequency ratio [1]", "largest exponent [$\\omega_n$]")
    legend_below(figure)
    return figure


def phase_sections(chaos: xr.Dataset) -> Figure:
    """Draw the stroboscopic sections of chaos.nc side by side, with the exponent of each."""
    names = ("ratio", "exponent", "error", "deflection", "velocity")
    panels = list(zip(*(chaos[f"section_{name}"].values for name in names)))
    figure, axes = new_figure(columns=len(panels), width=4.0 * len(panels), height=4.2)
    for ax, (ratio, exponent, error, displacement, velocity) in zip(axes, panels):
        # points that repeat lie on one another: draw each place large enough to be seen
        spread = max(np.ptp(displacement), np.ptp(velocity))
        size = 2.0 if spread > 1e-2 and len(np.unique(np.round(displacement, 3))) > 8 else 8.0
        ax.plot(displacement, velocity, "o", color=BLUE, markersize=size, markeredgewidth=0)
        if spread <= 1e-2:
            ax.set_xlim(np.mean(displacement) + np.array([-1.0, 1.0]))
            ax.set_ylim(np.mean(velocity) + np.array([-1.0, 1.0]))
        label(ax, "x [half backlash]", title=f"Ω = {ratio:.2f}, λ = {exponent:.3f} ± {error:.3f}")
    label(axes[0], y="velocity [b $\\omega_n$]")
    return figure


def contact_rows(response: xr.Dataset | None, sweep: xr.Dataset | None) -> list[tuple]:
    """Make the rows of `state_bands`: the branch from limit point to limit point, the sweeps as they ran."""
    rows = []
    if response is not None:
        ratio, state = response["ratio"].values, _state_numbers(response)
        cuts = [0, *response["fold"].values, len(ratio) - 1]
        pieces = [slice(a, b + 1) for a, b in pairwise(cuts)]
        names = ["upper branch", "between the limit points, unstable", "lower branch"]
        if len(pieces) != len(names):
            names = [f"piece {number + 1}" for number in range(len(pieces))]
        rows += [(f"balance: {name}", ratio[part], state[part]) for name, part in zip(names, pieces)]
    if sweep is not None:
        ratio, (up, down) = sweep["ratio"].values, _state_numbers(sweep)
        rows += [("integration: sweep up", ratio, up), ("integration: sweep down", ratio[::-1], down[::-1])]
    return rows


def _state_numbers(data: xr.Dataset) -> np.ndarray:
    return np.vectorize(STATE_NAMES.index, otypes=[int])(data["state"].values)


def _draw_response(drawn: Drawn) -> dict[str, Figure]:
    """Amplitude and mean of the branch, with the sweeps as markers."""
    data, names = drawn.data["response"], ("ratio", "amplitude", "mean")
    curve = ("harmonic balance", *(data[name].values for name in names), data["stable"].values)
    sweeps = []
    if (sweep := drawn.data.get("sweep")) is not None:
        for n, direction in enumerate(sweep["direction"].values):
            amplitude, mean = (sweep[name].values[n] for name in names[1:])
            sweeps.append((f"sweep {direction}", sweep["ratio"].values, amplitude, mean))
    top = int(np.nanargmax(curve[2]))
    title = f"largest amplitude {curve[2][top]:.3g} half backlash at {curve[1][top]:.3g}"
    if len(folds := np.sort(data["ratio"].values[data["fold"].values])):
        title += f", limit points at {', '.join(f'{fold:.3g}' for fold in folds)}"
    return {"amplitude_and_mean": amplitude_and_mean([curve], sweeps, title=title)}


def _draw_chaos(drawn: Drawn) -> dict[str, Figure]:
    """Bifurcation diagram with the exponents, and the long sections."""
    data = drawn.data["chaos"]
    figures = {"chaos": bifurcation_and_exponent(data)}
    if "section_ratio" in data:
        figures["sections"] = phase_sections(data)
    return figures


FIGURES = {
    "response": Figures(
        {
            "amplitude_and_mean": "Amplitude and mean of the relative deflection over the frequency ratio: "
            "harmonic balance, dashed where the motion is not known to be stable; triangles: settled motions "
            "of the sweeps in time, without those that do not repeat every tooth period."
        },
        _draw_response,
    ),
    "sweep": Figures(
        {
            "contact_states": "Contact over the frequency ratio: drive flanks closed, impacts on one side, "
            "impacts on both; a border is drawn halfway between two computed ratios."
        },
        lambda drawn: {"contact_states": state_bands(contact_rows(drawn.data.get("response"), drawn.data["sweep"]))},
    ),
    "chaos": Figures(
        {
            "chaos": "Deflection once a tooth period over the frequency ratio, and the largest Lyapunov "
            "exponent with its error: above zero neighbouring motions part.",
            "sections": "Deflection and velocity once a tooth period at some ratios Ω, with the largest exponent λ.",
        },
        _draw_chaos,
    ),
}
