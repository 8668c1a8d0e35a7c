"""Pictures of losses and temperatures: efficiency over torque and speed, curves over the path of contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.report.style import GREY, label, legend_below, line_style, new_figure
from femgear.stages.heat_results import hottest_point
from femgear.stages.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_DRAWN = 6
"""Kinds of mesh in a picture, at most."""


def draw_contact_path(heat: xr.Dataset) -> Figure:
    """Draw load, temperature, film and specific sliding over the path, at the hottest operating point of heat.nc."""
    point, where = hottest_point(heat)
    figure, ((load, hot), (film, sliding)) = _axes()
    for kind, name in enumerate(heat["mesh_kind"].values[:_DRAWN]):
        place, style = 1e3 * heat["path_place"].values[kind], line_style(kind)
        bulk = float(heat["bulk_temperature"].values[point, kind, 0])
        carried = np.where(heat["path_load"].values[point, kind] > 0.0, 1.0, np.nan)
        load.plot(place, 1e-3 * heat["path_load"].values[point, kind], label=str(name), **style)
        hot.plot(place, carried * (bulk + heat["flash_temperature"].values[point, kind]), **style)
        shared = bulk + heat["shared_flash_temperature"].values[point, kind]
        hot.plot(place, shared, color=style["color"], linewidth=0.8, linestyle=":")
        film.plot(place, heat["film_ratio"].values[point, kind], **style)
        for gear in (0, 1):
            values = heat["specific_sliding"].values[kind, gear]
            sliding.plot(place, np.where(values > -5.0, values, np.nan), linewidth=1.6 - 0.8 * gear, **style)
    hot.plot([], [], color=GREY, linewidth=0.8, linestyle=":", label="load shared by X_Γ")
    sliding.plot([], [], color=GREY, linewidth=0.8, label="second gear")
    label(load, y="line load [N/mm]", title=where)
    label(hot, y="contact temperature [°C]")
    label(film, "path from the pitch point [mm]", "film over roughness")
    label(sliding, "path from the pitch point [mm]", "specific sliding")
    for axes in (load, hot, film, sliding):
        axes.axvline(0.0, color="0.6", linewidth=0.8)
    film.set_ylim(bottom=0.0)
    load.set_ylim(bottom=0.0)
    legend_below(figure)
    return figure


def _axes():
    figure, axes = new_figure(rows=2, columns=2, height=5.6, sharex=True)
    return figure, (axes[:2], axes[2:])


def _heat_figures(drawn: Drawn) -> dict[str, Figure]:
    heat = drawn.data["heat"]
    return {"contact_path": draw_contact_path(heat)} if heat["path_load"].values.any() else {}


HEAT_FIGURES = Figures(
    {
        "contact_path": (
            "Along the path of contact at the operating point with the hottest contact: the largest load over width "
            "that a tooth pair has there, the contact temperature with that load and, dotted, with the load sharing "
            "factor X_Γ of ISO/TS 6336-20, the oil film over the roughness (ISO/TS 6336-22), and the specific sliding "
            "of the first (thick) and the second gear (thin)."
        ),
    },
    draw=_heat_figures,
)


def draw_efficiency_map(losses: xr.Dataset) -> Figure:
    """Draw the efficiency over the share of the speed, a curve for every share of the torque, from losses.nc."""
    figure, (axes,) = new_figure(height=3.8)
    for number, share in enumerate(losses["torque_share"].values):
        values = 100.0 * losses["efficiency_map"].values[number]
        axes.plot(
            losses["speed_share"].values, values, marker="o", label=f"torque {float(share):g}", **line_style(number)
        )
    label(axes, "share of the speed of operation", "efficiency [%]")
    legend_below(figure)
    return figure


def _loss_figures(drawn: Drawn) -> dict[str, Figure]:
    losses = drawn.data["losses"]
    return {"efficiency_map": draw_efficiency_map(losses)} if "efficiency_map" in losses else {}


LOSSES_FIGURES = Figures(
    {"efficiency_map": "Efficiency over shares of torque and speed of operation, the contact solved at every torque."},
    draw=_loss_figures,
)
