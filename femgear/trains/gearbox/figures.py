"""Pictures of a gearbox: deflected shafts with bearing forces and load patterns, modes, Campbell diagram.

Those of its response are in `femgear.trains.gearbox.response_figures`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import BLACK, COLOURS, GREY, SIZE, label, legend_below, new_figure
from femgear.stages.heat_figures import HEAT_FIGURES, LOSSES_FIGURES
from femgear.stages.life_figures import LIFE_CAPTION, draw_damage
from femgear.stages.protocol import Drawn, Figures
from femgear.trains.gearbox.casing_results import seat_curve
from femgear.trains.gearbox.response_figures import RESPONSE_FIGURES
from femgear.trains.gearbox.solid_bodies import write_space
from femgear.trains.gearbox.stage_figures import draw_stage_energy
from femgear.trains.gearbox.transient_figures import TRANSIENT_FIGURES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.backend_bases import RendererBase
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

_ARROW = 46.0  # length of the longest arrow [points]
_HEAD = 9.0  # length of its head [points]
_BESIDE = 6.0  # distance of a name beside its arrow [points]
_ABOVE_LINES = 1.3
"""Height of a Campbell diagram over the highest frequency that a line of excitation has in it."""
_NAME_HEIGHT = 0.035  # of the names of lines of excitation, over that of the picture
_STEP, _MOST_STEPS = 4.0, 60  # by which names are pushed on [points], and how often
_NEAR = 16  # first places of a name, which are near enough to its arrow to leave a curve for
_MOST_NAMED = 8  # bearings that are named in a plane: of many planets no more names find room
_LEAST = 0.04  # force that is drawn, over the largest
_WIDE_NAME = 40  # letters of which two names have room beside one another
_STILL = 1e-12  # motion aside that is rounding [m]
_MOST_MODES = 24
_EQUAL = 1e-6  # difference of two frequencies of one pair, over them
_KIND_COLOURS: dict[str, str] = dict(
    zip(("torsional", "bending", "axial", "mixed", "ring", "casing", "carrier"), COLOURS, strict=False)
)
_DASHES = ("-", "--", "-.", ":")
_PLANES = ((0, "x"), (1, "y"))


def deflected_shafts(deflection: xr.Dataset) -> Figure | None:
    """Draw the deflection of all shafts along their axes in both planes, with the forces of the bearings.

    Of deflection.nc at its chosen load case; nothing where no shaft has a length or none moves aside.
    """
    load_case = deflection.isel(load_case=int(deflection.attrs["load_case"]))
    place, moved = load_case["place"].values, load_case["displacement"].values[:, :3]
    member, shafts = load_case["member"].values, load_case["shaft"].values
    if all(np.ptp(place[member == shaft, 2]) == 0.0 for shaft in shafts) or np.abs(moved[:, :2]).max() < _STILL:
        return None
    figure, axes = new_figure(columns=2, width=12.0, height=5.4)
    for ax, (way, axis) in zip(axes, _PLANES, strict=True):
        for number, shaft in enumerate(shafts):
            stations = np.flatnonzero(member == shaft)
            stations = stations[np.argsort(place[stations, 2])]
            style = {"color": COLOURS[number % len(COLOURS)], "marker": "o" if len(stations) == 1 else "."}
            style["linestyle"] = _DASHES[number // len(COLOURS) % len(_DASHES)]
            ax.plot(1e3 * place[stations, 2], 1e6 * moved[stations, way], linewidth=2.2, label=str(shaft), **style)
        ax.axhline(0.0, color=GREY, linewidth=0.8)
        if seats := seat_curve(load_case, way):
            z, casing, inner = seats
            style = {"color": BLACK, "linestyle": "none", "marker": "s", "markerfacecolor": "none"}
            ax.plot(z, casing, label="casing at its bearings", **style)
            ax.vlines(z, casing, inner, color=GREY, linewidth=1.0, linestyle=":")
        ax.margins(0.08, 0.34)
        _arrows(ax, load_case, way)
        label(ax, "z [mm]", f"deflection along {axis} [µm]")
    legend_below(figure, axes[0], columns=6)
    _part_names(figure)
    return figure


def _part_names(figure: Figure) -> None:
    """Move names of bearings off one another and off arrows, and off curves where there is room."""
    from matplotlib.text import Annotation

    figure.draw_without_rendering()
    # one for all names: each of them would make its own
    renderer = figure._get_renderer()  # type: ignore[attr-defined]
    for ax in figure.axes:
        notes = [text for text in ax.texts if isinstance(text, Annotation)]
        arrows = [text.arrow_patch.get_window_extent().padded(1.0) for text in notes if text.arrow_patch is not None]
        curves = [line.get_transform().transform_path(line.get_path()) for line in ax.lines]
        placed: list[Bbox] = []
        for text in sorted((text for text in notes if text.get_text()), key=lambda text: text.xy[0]):
            spots = [*_spots(text.xyann[1], text.get_verticalalignment())]
            boxes = [_moved(text, spot, renderer) for spot in spots]
            clear = [i for i, box in enumerate(boxes) if not any(box.overlaps(other) for other in (*arrows, *placed))]
            inside = [
                i
                for i in clear
                if ax.bbox.x0 <= boxes[i].x0 and boxes[i].x1 <= ax.bbox.x1 and boxes[i].y1 <= figure.bbox.y1
            ]
            free = [i for i in inside if not any(curve.intersects_bbox(boxes[i], filled=False) for curve in curves)]
            near = [i for i in free if i < _NEAR]
            chosen = next(iter((*near, *inside, *clear)), 0)
            placed.append(_moved(text, spots[chosen], renderer))


def _moved(text: Annotation, spot: tuple[tuple[float, float], str, str], renderer: RendererBase) -> Bbox:
    """Move a name to an offset with alignments, and give its place in the picture."""
    text.xyann, ha, va = spot
    text.set(ha=ha, va=va)
    return text.get_window_extent(renderer)


def _spots(behind: float, va: str) -> Iterator[tuple[tuple[float, float], str, str]]:
    """Offsets of a name from the tip of its arrow [points], with alignments: behind it, beside it, farther on."""
    way = -1.0 if va == "top" else 1.0
    yield (0.0, behind), "center", va
    for side, ha in ((_BESIDE, "left"), (-_BESIDE, "right")):
        yield (side, 0.5 * behind), ha, "center"
        yield (side, behind), ha, va
    for step in range(1, _MOST_STEPS):
        yield (0.0, behind + way * step * _STEP), "center", va


def _arrows(ax, load_case: xr.Dataset, way: int) -> None:
    """Draw the forces of the bearings on their shafts, the longest one `_ARROW` points long, and name the largest."""
    force, place, moved = (
        load_case[name].values for name in ("bearing_force", "bearing_place", "bearing_displacement")
    )
    largest = float(np.abs(force[:, :2]).max(initial=0.0))
    named = np.sort(np.abs(force[:, way]))[::-1][:_MOST_NAMED].min(initial=np.inf)
    for name, vector, at, motion in zip(load_case["bearing"].values, force, place, moved, strict=True):
        if not largest or abs(vector[way]) < _LEAST * largest:
            continue
        length = _ARROW * vector[way] / largest
        tip = (1e3 * at[2], 1e6 * motion[way])
        style = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tip, (0.0, -length), textcoords="offset points", arrowprops=style)
        if abs(vector[way]) < named:
            continue
        ax.annotate(
            f"{name}\n{_force_text(abs(vector[way]))}",
            tip,
            (0.0, -np.sign(length) * (max(abs(length), _HEAD) + 3.0)),
            textcoords="offset points",
            ha="center",
            va="top" if length > 0.0 else "bottom",
            fontsize=SIZE - 3,
        )


def _force_text(force: float) -> str:
    return f"{force:.0f} N" if force < 1e4 else f"{1e-3 * force:.0f} kN"


def load_patterns(deflection: xr.Dataset) -> Figure | None:
    """Draw the load of every mesh over its width, of deflection.nc at its chosen load case."""
    if "line_load" not in deflection:
        return None
    load, height = deflection["line_load"].values, deflection["slice_height"].values
    shown = [i for i in range(len(load)) if np.isfinite(load[i]).any()]
    figure, (ax,) = new_figure(width=8.0, height=4.6)
    drawn: dict[bytes, list[str]] = {}
    for i in shown:
        drawn.setdefault(np.round(load[i], 1).tobytes() + np.round(height[i], 9).tobytes(), []).append(
            str(deflection["mesh"].values[i])
        )
    for number, names in enumerate(drawn.values()):
        i = list(deflection["mesh"].values).index(names[0])
        text = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more alike"
        factor = float(deflection["face_load_factor"].values[int(deflection.attrs["load_case"]), i])
        text += "" if np.isnan(factor) else f", K_Hβ {factor:.3f}"
        style = {
            "color": COLOURS[number % len(COLOURS)],
            "linestyle": ("-", "--", "-.", ":")[number // len(COLOURS) % 4],
        }
        ax.plot(1e3 * height[i], 1e-3 * load[i], linewidth=2.0, label=text, **style)
    ax.set_ylim(bottom=0.0)
    label(ax, "place on the width, from its middle [mm]", "load per width [N/mm]")
    longest = max((len(str(line.get_label())) for line in ax.lines), default=0)
    legend_below(figure, ax, columns=2 if longest <= _WIDE_NAME else 1)
    return figure


def mode_energy(modes: xr.Dataset) -> Figure:
    """Draw which part holds the strain energy of the elastic modes of modes.nc, one of each pair of equal ones."""
    hertz = modes["frequency"].values
    chosen = np.flatnonzero(hertz > 0.0)
    chosen = chosen[np.diff(hertz[chosen], prepend=0.0) > _EQUAL * hertz[chosen]][:_MOST_MODES]
    strain, parts = modes["strain"].values[:, chosen], modes["part"].values
    figure, (ax,) = new_figure(width=10.0, height=5.0)
    order = np.argsort(-strain.sum(axis=1))
    bottom, place = np.zeros(len(chosen)), np.arange(len(chosen))
    kept = order[: len(COLOURS) - 1]
    for number, part in enumerate(kept):
        ax.bar(place, strain[part], 0.8, bottom=bottom, color=COLOURS[number], label=str(parts[part]))
        bottom += strain[part]
    if len(order) > len(kept):
        rest = strain[order[len(kept) :]].sum(axis=0)
        ax.bar(place, rest, 0.8, bottom=bottom, color=GREY, label="all others")
    names = [f"{hertz[i]:.0f} Hz\n{modes['kind'].values[i]}" for i in chosen]
    ax.set_xticks(place, names, rotation=90, fontsize=SIZE - 2)
    ax.set_ylim(0.0, 1.0)
    ax.grid(False, axis="x")
    label(ax, "", "share of the strain energy [1]")
    legend_below(figure, ax, columns=3)
    return figure


def gearbox_campbell(modes: xr.Dataset) -> Figure:
    """Draw natural frequencies over the speed with turns and mesh lines of all stages, from modes.nc.

    Branches have the colour of the kind of their mode at rest; lines of excitation have their names at their ends.
    Modes that no line of excitation comes near are left out, and counted in the title.
    """
    speed, frequency = modes["campbell_speed"].values, modes["campbell_frequency"].values
    kinds, hertz = modes["kind"].values, modes["frequency"].values
    figure, (ax,) = new_figure(width=9.5, height=6.0)
    reached = _ABOVE_LINES * float(modes["order"].values.max(initial=0.0)) / 60.0 * float(speed.max())
    top = 1.05 * float(np.nanmax(frequency, initial=1.0))
    beyond = int((hertz > reached).sum())
    if beyond and (hertz[hertz > 0.0] <= reached).any():
        top = min(top, reached)
    words = f"{beyond} mode{'s' * (beyond > 1)} above, which no line comes near" if beyond and top == reached else ""
    for branch in frequency.T:
        start = branch[np.isfinite(branch)][:1]
        if not len(start) or start[0] <= 0.0:
            continue
        kind = str(kinds[np.abs(hertz - start[0]).argmin()])
        ax.plot(speed, branch, linewidth=1.5, color=_KIND_COLOURS.get(kind, BLACK), label=kind)
    named = 0.0
    for order, name in sorted(zip(modes["order"].values.tolist(), modes["line"].values.tolist(), strict=True)):
        named = _excitation_line(ax, str(name), order / 60.0, float(speed.max()), top, named)
    ax.plot(
        modes["critical_speed"].values,
        modes["critical_frequency"].values,
        "o",
        color=BLACK,
        markerfacecolor="white",
        markersize=4,
        label="critical speed",
    )
    at = float(modes.attrs["speed"])
    if 0.0 < at < speed.max():
        ax.axvline(at, color=BLACK, linewidth=1.4, linestyle=":", label="speed of operation")
    ax.set_xlim(0.0, float(speed.max()))
    ax.set_ylim(0.0, top)
    label(ax, f"speed of {modes.attrs['reference']} [rpm]", "natural frequency [Hz]", words)
    legend_below(figure, ax, columns=4)
    return figure


def _excitation_line(ax, name: str, slope: float, fastest: float, top: float, named: float) -> float:
    """Draw a line of excitation [Hz per rpm] with its name where it leaves the picture; flat ones are left out.

    At the right end it stands above the names of flatter lines, the last of which is at ``named`` [Hz]; gives where
    the last one is now.
    """
    if slope * fastest < 0.02 * top:
        return named
    end = min(fastest, top / slope)
    ax.plot([0.0, end], [0.0, slope * end], color=GREY, linewidth=1.0, linestyle="--", zorder=1.0)
    inside = end < fastest
    height = slope * end if inside else max(slope * end, named + _NAME_HEIGHT * top)
    ax.annotate(
        name,
        (end, height),
        (0, 4) if inside else (4, 0),
        textcoords="offset points",
        rotation=45 if inside else 0,
        ha="left",
        va="bottom" if inside else "center",
        fontsize=SIZE - 3,
        annotation_clip=False,
    )
    return named if inside else height


def _draw_deflection(drawn: Drawn) -> dict[str, Figure]:
    data = drawn.data["deflection"]
    pictures = {"deflected_shafts": deflected_shafts(data), "load_patterns": load_patterns(data)}
    pictures["damage"] = draw_damage(data)
    return {name: picture for name, picture in pictures.items() if picture is not None}


def _draw_modes(drawn: Drawn) -> dict[str, Figure]:
    data = drawn.data["modes"]
    drawings = {"campbell": gearbox_campbell(data)}
    drawings |= {"mode_energy": mode_energy(data)} if np.any(data["frequency"].values > 0.0) else {}
    by_stage = draw_stage_energy(data)
    return drawings if by_stage is None else drawings | {"stage_energy": by_stage}


FIGURES = {
    "heat": HEAT_FIGURES,
    "losses": LOSSES_FIGURES,
    "deflection": Figures(
        {
            "deflected_shafts": "Deflection of the shafts in both planes along their axes; arrows are the forces of "
            "the bearings on the shafts.",
            "load_patterns": "Load per width of the meshes under the misalignment that shafts and bearings give them.",
            "damage": LIFE_CAPTION,
        },
        _draw_deflection,
        (write_space,),
    ),
    "modes": Figures(
        {
            "campbell": "Natural frequencies over the speed, with turns of the shafts and mesh lines of the stages.",
            "mode_energy": "Where the strain energy of every mode lies.",
            "stage_energy": "Share of every stage in the kinetic energy of the modes; modes of one frequency "
            "stand once, with their mean share.",
        },
        _draw_modes,
    ),
    **RESPONSE_FIGURES,
    **TRANSIENT_FIGURES,
}
