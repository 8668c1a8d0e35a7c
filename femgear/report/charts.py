"""Read the curves of a Matplotlib figure, as the data of a chart that a browser draws.

Every figure is drawn once, by Matplotlib; the page shows the same curves so that they can be read off and
enlarged. What a browser's chart cannot hold stays a picture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.report.style import thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DIGITS = 6
"""Digits of a coordinate, counted from the largest of its curve: a pixel of one enlarged a hundredfold."""
_MOST_CORNERS = 4000
"""Corners of a filled area, at most."""
_PIXELS_OF_A_POINT = 1.2
"""Size of a marker on the page [pixels] over that in print [pt]."""
_DASHES = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}
_MARKERS = {
    "o": "circle",
    "s": "square",
    "D": "diamond",
    "^": "triangle-up",
    "v": "triangle-down",
    "P": "cross",
}
_MARKERS |= {"X": "x", "x": "x-thin", "*": "star", "<": "triangle-left", ">": "triangle-right", ".": "circle"}
_MARKERS |= {
    "+": "cross-thin",
    "d": "diamond-tall",
    "p": "pentagon",
    "h": "hexagon",
    "|": "line-ns",
    "_": "line-ew",
}


class _PictureOnly(Exception):
    """The figure has something that the chart has no words for."""


def chart(figure: Figure) -> dict[str, Any] | None:
    """Read the panels, curves, areas, fields and words of a figure.

    Parameters
    ----------
    figure : Figure
        Of `femgear.report.style.new_figure`; its axes may be polar, which come back as plane curves.

    Returns
    -------
    dict or None
        What JSON can hold: ``title``, ``size`` [in], ``rows``, ``columns``, and for every panel its place,
        axes and traces, named as plotly.js names them, and ``over``, the panel on which it lies with an ordinate
        at the right; None where a part of the figure is neither a line, an area, a bar, a field nor a text.
    """
    bars = {id(coloured.colorbar.ax) for coloured in _fields(figure)}
    panels = [ax for ax in figure.axes if id(ax) not in bars]
    try:
        drawn = [_panel(ax, number, panels) for number, ax in enumerate(panels)]
    except _PictureOnly:
        return None
    grids: list[Any] = [ax.get_gridspec() for ax in panels if ax.get_subplotspec() is not None]
    if len(grids) != len(panels) or not drawn:
        return None
    title = figure.get_suptitle()
    width, height = figure.get_size_inches()
    return {
        "title": title,
        "size": [float(width), float(height)],
        "rows": grids[0].nrows,
        "columns": grids[0].ncols,
        "panels": drawn,
    }


def _fields(figure: Figure) -> list[Any]:
    """List what has a colour bar."""
    return [
        collection
        for ax in figure.axes
        for collection in ax.collections
        if getattr(collection, "colorbar", None) is not None
    ]


def _panel(ax: Any, number: int, panels: list[Any]) -> dict[str, Any]:
    """Read one pair of axes."""
    spec = ax.get_subplotspec()
    polar = ax.name == "polar"
    titles = (ax.get_title(loc) for loc in ("left", "center", "right"))
    plane = {"x": {"hidden": True}, "y": {"hidden": True}} if polar or not ax.axison else {}
    shared = next((i for i, other in enumerate(panels) if ax.get_shared_x_axes().joined(ax, other)), number)
    traces = [*_areas(ax), *_lines(ax), *_patches(ax)]
    over = next((i for i, other in enumerate(panels[:number]) if _twins(ax, other)), None)
    return (
        {
            "place": [spec.rowspan.start, spec.rowspan.stop, spec.colspan.start, spec.colspan.stop] if spec else [],
            "title": next((text for text in titles if text), ""),
            "x": _axis(ax.xaxis, ax.get_xlim()),
            "y": _axis(ax.yaxis, ax.get_ylim()),
            "shared": shared,
            "square": polar or ax.get_aspect() == 1.0,
            "traces": (_circles(ax) if polar else []) + traces,
            "words": _words(ax),
        }
        | ({} if over is None else {"over": over})
        | plane
        | (_polar_limits(ax) if polar else {})
    )


def _twins(ax: Any, other: Any) -> bool:
    """Tell whether axes lie over others, with the same abscissa."""
    same = ax.get_subplotspec() is not None and ax.get_subplotspec() == other.get_subplotspec()
    return same and ax.get_shared_x_axes().joined(ax, other)


def _polar_limits(ax: Any) -> dict[str, Any]:
    """Limits of the plane that a polar diagram is drawn in."""
    reach = float(ax.get_rmax() - ax.get_rorigin()) * 1.12
    return {name: {"hidden": True, "range": [-reach, reach], "title": ""} for name in ("x", "y")}


def _circles(ax: Any) -> list[dict[str, Any]]:
    """Circles and rays of a polar diagram, with their numbers."""
    turn = np.linspace(0.0, 2 * np.pi, 181)
    origin, outer = float(ax.get_rorigin()), float(ax.get_rmax())
    low = float(ax.get_rmin())
    radii = [r for r in ax.get_yticks() if low < r <= outer]
    label_at = np.radians(ax.get_rlabel_position())
    grid = {"mode": "lines", "line": {"color": "#d0d0d0", "width": 1}, "hoverinfo": "skip"}
    circles = [{**grid, **_plane(turn, np.full_like(turn, r), origin)} for r in (*radii, outer)]
    angles = np.arange(8) * np.pi / 4
    circles += [{**grid, **_plane(np.array([a, a]), np.array([low, outer]), origin)} for a in angles]
    text = {"mode": "text", "hoverinfo": "skip", "line": {"color": "#606060"}}
    rim = outer + 0.07 * (outer - origin)
    degrees = {"text": [f"{np.degrees(a):.0f}°" for a in angles]}
    circles.append({**text, **degrees, **_plane(angles, np.full(8, rim), origin)})
    numbers = {"text": [f"{r:g}".replace("-", "−") for r in radii]}
    return [*circles, {**text, **numbers, **_plane(np.full(len(radii), label_at), np.array(radii), origin)}]


def _plane(angle: np.ndarray, radius: np.ndarray, origin: float) -> dict[str, Any]:
    """Turn angles [rad] and radii into coordinates of the plane."""
    length = np.asarray(radius, float) - origin
    return {"x": _numbers(length * np.cos(angle)), "y": _numbers(length * np.sin(angle))}


def _axis(axis, limits) -> dict[str, Any]:
    """Read title, scale, limits and the ticks that are words."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    scale = axis.get_scale()
    if scale not in ("linear", "log"):
        raise _PictureOnly
    described = {"title": axis.get_label_text(), "log": scale == "log", "range": [float(end) for end in limits]}
    if isinstance(axis.get_major_locator(), FixedLocator) and isinstance(axis.get_major_formatter(), FuncFormatter):
        labels = axis.get_ticklabels()
        described |= {
            "ticks": _numbers(axis.get_majorticklocs()),
            "texts": [text.get_text() for text in labels],
            "angle": -float(labels[0].get_rotation()) if labels else 0.0,
        }
    return described


def _lines(ax: Axes) -> list[dict[str, Any]]:
    """Read curves, markers and lines across the panel."""
    return [_curve(line, ax) for line in ax.get_lines() if line.get_visible()]


def _curve(line, ax: Axes) -> dict[str, Any]:
    """Read one curve."""
    from matplotlib.colors import to_hex

    x, y = (np.ma.filled(np.ma.asarray(values, float), np.nan) for values in line.get_data(orig=False))
    style, marker = line.get_linestyle(), line.get_marker()
    drawn, marked = style not in ("None", "none", " ", ""), marker not in ("None", "none", None, " ", "")
    colour = to_hex(line.get_color())
    trace: dict[str, Any] = {
        "mode": "+".join(["lines"] * drawn + ["markers"] * marked) or "none",
        "line": {"color": colour, "width": _width(line.get_linewidth()), "dash": _DASHES.get(style, "dash")},
        "opacity": float(line.get_alpha() or 1.0),
    }
    if line.get_drawstyle().startswith("steps"):
        trace["line"]["shape"] = {"steps-mid": "hvh", "steps-post": "hv"}.get(line.get_drawstyle(), "vh")
    if marked:
        open_face = str(line.get_markerfacecolor()).lower() in ("none", "white")
        symbol = _MARKERS.get(marker, "circle") + "-open" * open_face
        edge = to_hex(line.get_markeredgecolor()) if open_face else to_hex(line.get_markerfacecolor())
        trace["marker"] = {
            "symbol": symbol,
            "size": _PIXELS_OF_A_POINT * line.get_markersize(),
            "color": edge,
        }
    across = _across(line.get_transform(), ax)
    if across:
        return {**trace, **_spread(x, y, across, ax), **_name(line), "hoverinfo": "skip"}
    if not len(x):
        # plotly.js leaves a curve without points out of the legend, which it may be drawn for
        x = y = np.array([np.nan])
    return {**trace, **_coordinates(x, y, ax), **_name(line)}


def _across(transform, ax: Axes) -> str:
    """Tell whether x or y of an artist is a share of the panel's side."""
    if transform == ax.get_yaxis_transform():
        return "x"
    return "y" if transform == ax.get_xaxis_transform() else ""


def _spread(x, y, across: str, ax: Axes) -> dict[str, Any]:
    """Spread shares of the side of a panel over its limits."""
    low, high = ax.get_xlim() if across == "x" else ax.get_ylim()
    if (ax.get_xscale() if across == "x" else ax.get_yscale()) == "log":
        ends = low * (high / low) ** np.asarray(x if across == "x" else y, float)
    else:
        ends = low + (high - low) * np.asarray(x if across == "x" else y, float)
    x, y = (ends, y) if across == "x" else (x, ends)
    return {"x": _numbers(x), "y": _numbers(y)}


def _name(artist) -> dict[str, Any]:
    """Name a curve as the legend does."""
    text = str(artist.get_label())
    return {"name": "" if text.startswith("_") else text}


def _coordinates(x, y, ax: Any) -> dict[str, Any]:
    """Coordinates of points as they are drawn."""
    x, y = thinned(x, y)
    if ax.name == "polar":
        return _plane(x, y, float(ax.get_rorigin()))
    steps = np.diff(x)
    if len(x) > 8 and np.all(np.isfinite(steps)) and np.ptp(steps) <= 1e-9 * np.abs(x).max() and steps[0]:
        return {
            "x0": float(x[0]),
            "dx": float((x[-1] - x[0]) / (len(x) - 1)),
            "y": _numbers(y, ax.get_yscale()),
        }
    return {"x": _numbers(x, ax.get_xscale()), "y": _numbers(y, ax.get_yscale())}


def _areas(ax: Axes) -> list[dict[str, Any]]:
    """Read filled areas, bundles of lines, and fields."""
    from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh

    traces = []
    for collection in ax.collections:
        if isinstance(collection, QuadMesh):
            traces.append(_field(collection))
        elif isinstance(collection, LineCollection):
            traces.append(_bundle(collection.get_segments(), collection, ax))
        elif isinstance(collection, PolyCollection):
            traces += [_area(path.vertices, collection, ax) for path in collection.get_paths()]
        elif isinstance(collection, PathCollection):
            traces += [_points(collection, ax)] if np.size(collection.get_offsets()) else []
        else:
            raise _PictureOnly
    return traces


def _points(collection, ax: Axes) -> dict[str, Any]:
    """Read scattered points, each of its size, which is that of an area [pt^2]."""
    x, y = np.asarray(collection.get_offsets(), float).T
    if collection.get_array() is not None or len(collection.get_facecolors()) > 1:
        raise _PictureOnly
    filled = len(collection.get_facecolors()) > 0
    colours = collection.get_facecolors() if filled else collection.get_edgecolors()
    sizes = _PIXELS_OF_A_POINT * np.sqrt(np.resize(collection.get_sizes(), len(x)))
    marker: dict[str, Any] = {"size": _numbers(sizes), "color": _colour(colours)}
    marker["symbol"] = "circle" if filled else "circle-open"
    if not filled:
        marker["line"] = {"width": _width(collection.get_linewidths()[0])}
    return {"mode": "markers", "marker": marker, **_coordinates(x, y, ax), **_name(collection)}


def _bundle(segments, collection, ax: Axes) -> dict[str, Any]:
    """Read many straight lines as one curve with gaps."""
    gap = np.full((1, 2), np.nan)
    joined = np.concatenate([np.concatenate([np.reshape(segment, (-1, 2)), gap]) for segment in segments] or [gap])
    line = {"color": _colour(collection.get_colors()), "width": _width(collection.get_linewidths()[0])}
    return {"mode": "lines", "line": line, **_coordinates(joined[:, 0], joined[:, 1], ax), **_name(collection)}


def _area(corners, collection, ax: Axes) -> dict[str, Any]:
    """Read one filled area."""
    if len(collection.get_facecolors()) > 1:
        raise _PictureOnly
    corners = np.asarray(corners, float)[:: 1 + len(corners) // _MOST_CORNERS]
    faces = collection.get_facecolors()
    fill = {"fill": "toself", "fillcolor": _colour(faces), "fillopacity": float(faces[0][3])} if len(faces) else {}
    return {
        "mode": "none" if fill else "lines",
        "hoverinfo": "skip",
        **fill,
        **_coordinates(corners[:, 0], corners[:, 1], ax),
        **_name(collection),
    }


def _field(mesh) -> dict[str, Any]:
    """Read a field of coloured cells on straight lines."""
    corners = mesh.get_coordinates()
    x, y = corners[0, :, 0], corners[:, 0, 1]
    straight = np.array_equal(corners[..., 0], np.broadcast_to(x, corners.shape[:2]))
    if not straight or not np.array_equal(corners[..., 1], np.broadcast_to(y[:, None], corners.shape[:2])):
        raise _PictureOnly
    values = np.ma.filled(np.ma.asarray(mesh.get_array(), float), np.nan).reshape(len(y) - 1, len(x) - 1)
    low, high = mesh.get_clim()
    colours = [[float(s), _colour([mesh.cmap(s)])] for s in np.linspace(0.0, 1.0, 17)]
    bar = mesh.colorbar
    return {
        "type": "heatmap",
        **{"x": _numbers(x), "y": _numbers(y), "z": [_numbers(row) for row in values]},
        **{"zmin": float(low), "zmax": float(high), "colorscale": colours, "showscale": bar is not None},
        "text": "" if bar is None else bar.ax.get_ylabel() or bar.ax.get_xlabel(),
    }


def _patches(ax: Axes) -> list[dict[str, Any]]:
    """Read bars, bands across the panel, stairs and polygons."""
    from matplotlib.patches import Polygon, Rectangle, StepPatch

    traces: list[dict[str, Any]] = []
    patch: Any
    for patch in ax.patches:
        if isinstance(patch, StepPatch):
            values, edges, _ = patch.get_data()
            x, y = np.repeat(edges, 2)[1:-1], np.repeat(values, 2)
            line = {"color": _colour([patch.get_edgecolor()]), "width": _width(patch.get_linewidth())}
            line["dash"] = _DASHES.get(str(patch.get_linestyle()), "solid")
            step = {"mode": "lines", "line": line, **_coordinates(x, y, ax), **_name(patch)}
            if patch.get_fill():
                x, y = [x[0], *x, x[-1]], [0.0, *y, 0.0]
                step |= {"fill": "toself", "fillcolor": _colour([patch.get_facecolor()]), "fillopacity": 1.0}
                step |= _coordinates(x, y, ax)
            traces.append(step)
            continue
        if isinstance(patch, Rectangle):
            corners = patch.get_patch_transform().transform(patch.get_path().vertices)
        elif isinstance(patch, Polygon):
            corners = patch.get_xy()
        else:
            raise _PictureOnly
        x, y = corners[:, 0], corners[:, 1]
        across = _across(patch.get_data_transform() if patch.is_transform_set() else ax.transData, ax)
        place = _spread(x, y, across, ax) if across else _coordinates(x, y, ax)
        face: Any = patch.get_facecolor()
        fill = {"fill": "toself", "fillcolor": _colour([face]), "fillopacity": float(face[3])}
        traces.append({"mode": "none", "hoverinfo": "skip", **fill, **place, **_bar_name(patch, ax)})
    return traces


def _bar_name(patch, ax: Axes) -> dict[str, Any]:
    """Name a bar as its group is named."""
    group = next((bars for bars in ax.containers if patch in list(bars)), patch)
    return _name(group)


def _words(ax: Axes) -> list[dict[str, Any]]:
    """Read texts within the panel."""
    texts_drawn = []
    text: Any
    for text in ax.texts:
        if not text.get_text():
            continue
        x, y = getattr(text, "xy", None) or text.get_position()
        place = _place_of(text, x, y, ax)
        shift = text.xyann if hasattr(text, "xyann") and getattr(text, "xycoords", "") == "data" else (0.0, 0.0)
        texts_drawn.append(
            place
            | {
                "text": text.get_text(),
                "angle": -float(text.get_rotation()),
                "align": [text.get_ha(), text.get_va()],
                "shift": [float(shift[0]), -float(shift[1])],
                "color": _colour([text.get_color()]),
                "ground": text.get_bbox_patch() is not None,
            }
        )
    return texts_drawn


def _place_of(text: Any, x, y, ax: Any) -> dict[str, Any]:
    """Place of a text in the coordinates of the panel, or as shares of its sides."""
    coordinates = getattr(text, "xycoords", "data")
    sides = coordinates if isinstance(coordinates, tuple) else ()
    across = "xy"[sides.index("axes fraction")] if sides.count("axes fraction") == 1 else ""
    across = across or _across(text.get_transform(), ax)
    if across:
        return {name: value[0] for name, value in _spread([x], [y], across, ax).items()}
    if text.get_transform() == ax.transAxes or coordinates == "axes fraction":
        return {"x": float(x), "y": float(y), "paper": True}
    if ax.name == "polar":
        plane = _plane(np.array([x]), np.array([y]), ax.get_rorigin())
        return {name: value[0] for name, value in plane.items()}
    return {name: _within(value, ends) for name, value, ends in (("x", x, ax.get_xlim()), ("y", y, ax.get_ylim()))}


def _within(value: float, ends: tuple[float, float]) -> float | None:
    """Round a coordinate of a word, not beyond the ends of its axis: a browser drops words that are outside."""
    rounded, (low, high) = _numbers([value])[0], sorted(map(float, ends))
    if rounded is None or not low <= value <= high:
        return rounded
    return min(max(rounded, low), high)


def _width(points: float) -> float:
    """Width of a line in pixels of a page."""
    return round(1.1 * float(points), 2)


def _colour(colours) -> str:
    """First of some colours as #rrggbb, black without any."""
    from matplotlib.colors import to_hex

    return to_hex(colours[0]) if len(colours) else "#000000"


def _numbers(values, scale: str = "linear") -> list[float | None]:
    """Round numbers for JSON, which has no NaN."""
    values = np.asarray(values, float)
    if scale == "log":
        return [float(f"{v:.{_DIGITS}g}") if np.isfinite(v) else None for v in values]
    largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    places = _DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0 else 0
    return [v if np.isfinite(v) else None for v in np.round(values, places).tolist()]
