"""Figures of static.nc: what the gears themselves do over one mesh period."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.style import (
    BLACK,
    COLOURS,
    distinct_lines,
    family,
    label,
    legend_below,
    line_style,
    new_figure,
    periodic,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

POSITION = "position in the mesh period [1]"


def static_transmission_error(static: xr.Dataset) -> Figure:
    """Static transmission error of every mesh, and of sun to ring over every planet.

    Parameters
    ----------
    static : xarray.Dataset
        With ``ste`` (mesh, position) and ``ste_overall`` (planet, position) [m].

    Returns
    -------
    Figure
    """
    figure, (left, right) = new_figure(columns=2, width=9.5, sharex=True)
    names = static["mesh"].values
    drawn = distinct_lines(names, static["ste"])
    for i, (text, row) in enumerate(drawn):
        left.plot(*periodic(static["position"], static["ste"][row] * 1e6), label=text, **line_style(i))
    label(left, POSITION, "transmission error [µm]", "each mesh, along its line of action")
    planets = [f"sun to ring over planet {p}" for p in static["planet"].values]
    position, overall = periodic(static["position"], static["ste_overall"] * 1e6)
    rows = list(zip(planets, range(len(planets))))
    if _equal(overall):
        rows = [("sun to ring over every planet (identical)", 0)]
    for i, (text, row) in enumerate(rows):
        right.plot(position, overall[row], label=text, **line_style(i + len(drawn)))
    label(right, POSITION, "sum of both meshes [µm]", "sun to ring")
    right.set_xlim(0, position[-1])
    legend_below(figure, columns=2)
    return figure


def mesh_stiffness(static: xr.Dataset, *, face_width: float | None = None) -> Figure:
    """Tangent and secant stiffness of every mesh.

    Parameters
    ----------
    static : xarray.Dataset
        With ``mesh_stiffness`` and ``mesh_stiffness_secant`` (mesh, position) [N/m].
    face_width : float, optional
        [m]; adds an axis with the stiffness per face width in N/(mm µm), as standards print it.

    Returns
    -------
    Figure
    """
    lines = distinct_lines(static["mesh"].values, static["mesh_stiffness"])
    # two families of curves that differ from planet to planet would cover one another
    kinds = list(dict.fromkeys(family(text) for text, _ in lines)) if len(lines) > 2 else [""]
    figure, axes = new_figure(rows=len(kinds), height=1.6 + 3.2 * len(kinds), sharex=True)
    for i, (text, row) in enumerate(lines):
        ax = axes[kinds.index(family(text)) if len(kinds) > 1 else 0]
        for name, width, kind in (("mesh_stiffness", 2.2, ""), ("mesh_stiffness_secant", 0.9, "secant")):
            position, value = periodic(static["position"], static[name][row] * 1e-6)
            # the legend tells meshes by colour and dash, the two kinds of stiffness by width
            ax.plot(position, value, linewidth=width, label="_" * bool(kind) + text, **line_style(i))
    for kind, width in (("tangent (thick)", 2.2), ("secant (thin)", 0.9)):
        axes[-1].plot([], [], color=BLACK, linewidth=width, label=kind)
    axes[-1].set_xlim(0, position[-1])
    label(axes[-1], POSITION)
    # N/m over m of width is 1e-9 N/(mm µm)
    factor = 1e-3 / face_width if face_width else 0.0
    for ax, kind in zip(axes, kinds):
        label(ax, y="mesh stiffness [N/µm]", title=f"{kind} meshes" if kind else "")
        if factor:
            second = ax.secondary_yaxis("right", functions=(lambda k: k * factor, lambda c: c / factor))
            second.set_ylabel("per face width [N/(mm µm)]", fontsize=11)
            second.tick_params(labelsize=10)
    legend_below(figure, columns=2 if len(lines) < 4 else 4)
    return figure


def load_sharing(static: xr.Dataset) -> Figure:
    """Share of every planet in the sun's torque over the mesh period.

    Parameters
    ----------
    static : xarray.Dataset
        With ``load_share`` (planet, position) [1].

    Returns
    -------
    Figure
    """
    figure, (ax,) = new_figure(height=3.8)
    position, share = periodic(static["position"], static["load_share"] * 100)
    identical = _equal(share)
    for i, planet in enumerate(static["planet"].values[:1] if identical else static["planet"].values):
        text = "every planet (identical)" if identical else f"planet {planet}"
        ax.plot(position, share[i], label=text, linewidth=2.0, **line_style(i))
    equal = 100.0 / len(share)
    ax.axhline(equal, color="0.4", linewidth=0.8, linestyle=(0, (1, 3)), label=f"equal share {equal:.4g} %")
    spread = np.abs(share - equal).max()
    if spread < 0.05 * equal:
        ax.set_ylim(0.94 * equal, 1.06 * equal)
    ax.set_xlim(0, position[-1])
    title = f"largest departure from equal shares: {spread:.3g} %" if spread > 1e-6 else "equal shares"
    label(ax, POSITION, "share of the torque [%]", title)
    legend_below(figure, columns=4)
    return figure


def tooth_loads(static: xr.Dataset) -> Figure:
    """Load of one tooth pair from its first to its last contact, in a sun-planet and a planet-ring mesh.

    The simultaneous pairs of the dataset are one base pitch apart on the path of contact, and a pair goes on
    to the next place with every mesh period: from period to period and place to place the loads are the
    history of one pair. The meshes are those of the first planet.

    Parameters
    ----------
    static : xarray.Dataset
        With ``tooth_load`` (mesh, tooth, position) and ``mesh_force`` (mesh, position) [N].

    Returns
    -------
    Figure
    """
    figure, axes = new_figure(columns=2, width=9.5, sharey=True)
    names = [str(name) for name in static["mesh"].values]
    position, largest = static["position"].values, 0.0
    periods = int(static.attrs.get("mesh_periods", 1))
    for ax, kind in zip(axes, ("sun-planet", "planet-ring")):
        row = next(i for i, name in enumerate(names) if family(name) == kind)
        load, force = static["tooth_load"].values[row], static["mesh_force"].values[row]
        place = np.arange(len(load))[:, None]
        each = np.arange(len(position)).reshape(periods, -1)[place.ravel() % periods]
        path, load = (place + position[each] % 1.0).ravel(), load[place, each].ravel()
        carried = np.flatnonzero(load > 1e-9 * force.max(initial=0.0))
        first, last = (carried[0], carried[-1]) if len(carried) else (0, load.size - 1)
        shown = slice(max(first - 1, 0), last + 2)
        ax.plot(path[shown] - path[first], load[shown], label="one tooth pair", color=COLOURS[0])
        largest = max(largest, load.max(initial=0.0), force.mean())
        ax.axhline(force.mean(), color="0.45", linewidth=1.0, linestyle=(0, (1, 2)), label="whole mesh, mean")
        label(ax, "path since the first contact [base pitches]", title=names[row])
    # the axes share one scale, which holds what both of them show
    axes[0].set_ylim(0, 1.05 * largest or 1.0)
    label(axes[0], y="load along the line of action [N]")
    legend_below(figure, columns=3)
    return figure


def _equal(rows) -> bool:
    return bool(np.abs(rows - rows[0]).max() <= 1e-6 * np.abs(rows).max(initial=0.0))
