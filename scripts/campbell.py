#!/usr/bin/env python3
"""Natural frequencies of a published wind turbine set over the carrier speed, with critical speeds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter
from script_tools import print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

FILES = ("campbell.csv", "campbell.png")
RPM = np.pi / 30.0
RING_TEETH = {"A": 99, "B": 68}


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/campbell"),
    train: Literal["A", "B"] = "B",
    highest: float = 600.0,
    speeds: int = 41,
    modes: int = 6,
    harmonics: int = 2,
) -> None:
    """Follow the modes of set A or B (NREL/CP-5000-55355) over the speed: a table, a picture, a CSV file.

    Gyroscopic and centripetal terms of the carrier frame are in; mesh stiffnesses are constant.

    Parameters
    ----------
    output
        Folder of the results.
    train
        The 750 kW set A or the 550 kW set B.
    highest
        Largest carrier speed [rpm].
    speeds
        Number of speeds, 5 or more.
    modes
        Lowest modes to follow.
    harmonics
        Mesh harmonics drawn as lines of excitation.
    """
    from published.wind_turbine import wind_turbine_a, wind_turbine_b

    from femgear.report.style import save_figure
    from femgear.solvers.linear.tracking import campbell_data
    from femgear.system.mesh_directions import gear_set_system

    if not (np.isfinite(highest) and highest > 0.0) or speeds < 5 or modes < 1 or harmonics < 0:
        raise CaseError(
            f"{speeds} speeds up to {highest} rpm, {modes} modes, {harmonics} harmonics",
            code="E-RANGE",
            limit="5 speeds or more, above 0 rpm, one mode or more",
        )
    folder = ready_folder(output, FILES)
    data = wind_turbine_a() if train == "A" else wind_turbine_b()
    orders = [1.0, *(RING_TEETH[train] * h for h in range(1, harmonics + 1))]
    campbell = campbell_data(
        lambda speed: gear_set_system(data, carrier_speed=speed),
        np.linspace(0.0, highest * RPM, speeds),
        data.mesh_stiffness,
        orders=orders,
        count=modes,
    )
    header = ("carrier speed [rpm]", "mode", "frequency [Hz]")
    records = (
        (float(speed / RPM), number + 1, float(value))
        for speed, row in zip(campbell.speed, campbell.frequency)
        for number, value in enumerate(row)
    )
    write_csv(folder / "campbell.csv", header, records)
    save_figure(_figure(campbell, train), folder / "campbell.png")
    rows = [
        (f"{c.order:g}", str(c.branch + 1), f"{c.speed / RPM:.2f}", f"{c.frequency:.2f}") for c in campbell.critical
    ]
    print_table(f"Critical speeds of set {train}", ("order", "mode", "carrier [rpm]", "frequency [Hz]"), rows)
    say_files(folder, FILES)


def _figure(campbell, train):
    from femgear.report.style import BLACK, BLUE, GREY, SIZE, label, legend_below, new_figure

    figure, (ax,) = new_figure(width=8.5, height=5.6)
    speed = campbell.speed / RPM
    for values in campbell.frequency.T:
        ax.plot(speed, values, color=BLUE, label="mode")
        change = f"{values[0]:.3g} Hz"
        change += f" to {values[-1]:.3g} Hz" if abs(values[-1] / values[0] - 1.0) > 5e-3 else ""
        ax.annotate(
            change,
            (speed[-1], values[-1]),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=SIZE - 1,
        )
    top = 1.1 * campbell.frequency.max()
    for number, order in enumerate(campbell.orders):
        teeth = RING_TEETH[train]
        text = "weight, carrier speed" if order == 1.0 else f"mesh frequency × {order / teeth:g}"
        ax.plot(
            speed,
            order * campbell.speed / (2.0 * np.pi),
            color=GREY,
            linewidth=1.0,
            label=text,
            linestyle=(0, (6, 2) + (1, 2) * number),
        )
    named = []
    for crossing in campbell.critical:
        style = {"color": BLACK, "markerfacecolor": "none", "label": "critical speed [rpm]"}
        ax.plot(crossing.speed / RPM, crossing.frequency, "o", **style)
        place = np.array([crossing.speed / speed[-1] / RPM, crossing.frequency / top])
        if any(np.abs(place - other).max() < 0.05 for other in named):
            continue
        named.append(place)
        ax.annotate(
            f"{crossing.speed / RPM:.0f}",
            (crossing.speed / RPM, crossing.frequency),
            xytext=(6, 4),
            textcoords="offset points",
            fontsize=SIZE - 1,
        )
    ax.set_xlim(0.0, speed[-1])
    ax.set_ylim(0.0, top)
    label(ax, "carrier speed [rpm]", "frequency [Hz]", f"wind turbine set {train}")
    legend_below(figure, columns=4)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
