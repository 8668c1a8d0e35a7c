"""Pictures of the vibration of a pair: levels over the speed, with the branch on which flanks part."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.response import (
    RESPONSE_CAPTIONS,
    mesh_force_period,
    response_figures,
    transmission_error_period,
)
from femgear.report.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    Drawings,
    label,
    legend_below,
    new_figure,
    runs,
)
from femgear.report.waterfall import RUNUP_CAPTIONS, campbell_diagram
from femgear.stages.protocol import Drawn, Figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

_OF = ("", "gear 2: ")
_RAYS = 10, 24
"""Fewest and most mesh harmonics of the Campbell diagram."""
_PANELS = (
    ("dte_rms", 1e6, "transmission error,\nr.m.s. about its mean [µm]"),
    ("dynamic_factor", 1.0, "dynamic factor K_v [1]"),
    ("bearing_rms", 1.0, "bearing force,\nr.m.s. about its mean [N]"),
)


def pair_levels(runup: xr.Dataset) -> Figure:
    """Draw transmission error, dynamic factor and bearing forces of runup.nc over the speed.

    The linear response is thin where it pulls; the branch with play is dashed where it is not stable.
    """
    figure, axes = new_figure(rows=3, height=8.2, sharex=True)
    speed, pulls = runup["speed"].values, runup["lowest_force"].values < 0.0
    thin = " (thin: it pulls)" if pulls.any() else ""
    for ax, (name, unit, words) in zip(axes, _PANELS, strict=True):
        curves = _curves(unit * runup[name].values)
        for number, curve in enumerate(curves):
            dash, colour = ("-", BLUE) if not number else ("-.", GREY)
            ax.plot(speed, np.where(pulls, np.nan, curve), dash, color=colour, linewidth=1.7)
            ax.plot(speed, curve, dash, color=colour, linewidth=0.7)
            ax.plot([], [], dash, color=colour, label=f"{_OF[number]}flanks held together{thin}")
        if "branch_speed" in runup:
            _draw_branch(ax, runup, f"branch_{name}", unit)
        for operating in np.atleast_1d(runup.attrs["operating_speeds"])[:8]:
            ax.axvline(operating, color=GREY, linewidth=0.9, linestyle=":", label="operating speed")
        ax.set_ylim(bottom=float(name == "dynamic_factor"))
        label(ax, y=words)
    axes[0].set_xlim(speed[0], speed[-1])
    label(axes[-1], "speed of gear 1 [rpm]")
    legend_below(figure, columns=2)
    return figure


def _draw_branch(ax, runup: xr.Dataset, name: str, unit: float) -> None:
    along, sound = runup["branch_speed"].values, runup["branch_stable"].values.astype(bool)
    for number, curve in enumerate(_curves(unit * runup[name].values)):
        colour = VERMILION if not number else BLACK
        for stable, dash in ((True, "-"), (False, "--")):
            for part in runs((sound[:-1] & sound[1:]) == stable):
                ax.plot(along[part], curve[part], dash, color=colour, linewidth=1.4)
        ax.plot([], [], color=colour, label=f"{_OF[number]}flanks that part (dashed: not stable)")


def _curves(values: np.ndarray) -> np.ndarray:
    """Rows that can be told apart, of one curve (s,) or those of both gears (s, 2)."""
    rows = values.reshape(len(values), -1).T
    return rows[:1] if np.allclose(rows[-1], rows[0], rtol=1e-3) else rows


def _dynamics(drawn: Drawn) -> Drawings:
    dynamics, static = drawn.data["dynamics"], drawn.data.get("static")
    curve = None if static is None else (static["position"].values, static["mesh_force"].values)
    return response_figures(
        dynamics,
        dynamic_transmission_error=partial(transmission_error_period, dynamics, static),
        mesh_forces=partial(mesh_force_period, dynamics, curve),
    )


def _campbell(runup: xr.Dataset, modes: xr.Dataset) -> Figure:
    """Draw the Campbell diagram up to a quarter above the highest mode, with the harmonics that meet it."""
    most, mesh = 1.25 * float(modes["frequency"].max()), runup["mesh_frequency"].values
    rays = int(np.clip(np.ceil(most / mesh.mean()), *_RAYS))
    limited = runup.assign(excitation_limit=runup["excitation_limit"].clip(max=most))
    return campbell_diagram(limited, modes, rays=rays)


DYNAMICS = Figures(RESPONSE_CAPTIONS, _dynamics)
RUNUP = Figures(
    {
        "run_up_levels": (
            "Over the speed of gear 1: transmission error, dynamic factor K_v (largest over mean mesh force) "
            "and bearing forces, one curve where those of both gears are equal. Where the linear response "
            "pulls it is thin: teeth part there, and the branch of the motions with play holds."
        ),
        "campbell": RUNUP_CAPTIONS["campbell"],
    },
    lambda drawn: Drawings(
        {
            "run_up_levels": partial(pair_levels, drawn.data["runup"]),
            "campbell": lambda: _campbell(drawn.data["runup"], drawn.data["modes"]),
        }
    ),
)
