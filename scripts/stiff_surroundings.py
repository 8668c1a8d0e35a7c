#!/usr/bin/env python3
"""What bearings, shafts, pins, casing and feet of the electric axle do to its noise: each made stiff in turn."""

from __future__ import annotations

import copy
import math
import sys
import tomllib
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from script_tools import Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

AXLE = Path(__file__).resolve().parents[1] / "cases" / "e_axle_in_a_casing.toml"
FILES = ("stiff_surroundings.csv", "stiff_surroundings.png")
ROLLING = ("rolling_elements", "element_diameter", "pitch_diameter", "effective_length", "dynamic_rating")
STIFF = "1e10 N/m"
FEET = ["1e9 N/m", "2e9 N/m", "1e9 N/m"]


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/stiff_surroundings"),
    lowest: str = "3000 rpm",
    highest: str = "12000 rpm",
    speeds: int = 91,
) -> None:
    """Run the axle of cases/e_axle_in_a_casing.toml up with each of its surroundings made stiff in turn.

    Prints the levels at the sensors over all speeds and what each change makes of them, draws them over the speed.

    Parameters
    ----------
    output
        Folder of the results.
    lowest, highest
        Speeds of the rotor with their unit.
    speeds
        Their number, 2 or more.
    """
    from femgear.case.dependencies import Steps
    from femgear.case.quantities import RPM, SPEED, to_si
    from femgear.report.style import save_figure

    first, last = to_si(lowest, SPEED), to_si(highest, SPEED)
    if not 0.0 < first < last or speeds < 2:
        limit = "2 speeds or more, the lowest above 0, the highest above that"
        raise CaseError(f"{speeds} speeds from {lowest} to {highest}", code="E-RANGE", limit=limit)
    folder, turning, levels = ready_folder(output, FILES), np.linspace(first, last, speeds), dict[str, np.ndarray]()
    with Progress() as progress, TemporaryDirectory() as place:
        copytree(AXLE.parent / "casings", Path(place) / "casings")
        steps = Steps()
        changed = variants(AXLE, Path(place))
        for done, (name, tables) in enumerate(changed.items()):
            progress("run-ups", done, len(changed))
            sensors, levels[name] = sensor_levels(tables, turning, Path(place), steps)
        progress("run-ups", len(changed), len(changed))
    whole = {name: np.sqrt((values**2).mean(axis=0)) for name, values in levels.items()}
    plain = next(iter(whole.values()))
    rows = [
        (
            name,
            *(
                f"{value:.1f} ({20.0 * math.log10(value / reference):+.1f} dB)"
                for value, reference in zip(values, plain)
            ),
        )
        for name, values in whole.items()
    ]
    print_table("Root mean square over all speeds [m/s^2]", ("variant", *sensors), rows)
    header = ["variant", "speed [rpm]", *(f"{sensor} [m/s^2]" for sensor in sensors)]
    lines = [
        [name, speed / RPM, *row] for name, values in levels.items() for speed, row in zip(turning, values, strict=True)
    ]
    write_csv(folder / FILES[0], header, lines)
    save_figure(draw_levels(turning / RPM, levels, sensors), folder / FILES[1])
    say_files(folder, FILES)


def variants(path: Path, folder: Path) -> dict[str, dict[str, Any]]:
    """Tables of the axle as it is, and with one part of what is around its teeth made stiff, by name.

    The ``folder`` has the files of its casing.
    """
    axle = tomllib.loads(path.read_text(encoding="utf-8"))
    changed = {name: copy.deepcopy(axle) for name in ("as it is", "bearings", "shafts", "planets", "feet")}
    for bearing in changed["bearings"]["bearing"]:
        thrust = bearing.pop("kind") == "ball"
        for entry in (*ROLLING, "static_rating"):
            bearing.pop(entry, None)
        bearing |= {"radial": STIFF} | ({"axial": STIFF} if thrust else {})
    changed["shafts"]["material"] = {"youngs_modulus": "1e12 Pa"}
    stage = changed["planets"]["planetary"][0]
    del stage["pins"], stage["planet"]
    for foot in changed["feet"]["casing"]["foot"]:
        foot["stiffness"] = FEET
    return {
        "as it is": axle,
        "bearings at 1e10 N/m": changed["bearings"],
        "shafts of five times the modulus": changed["shafts"],
        "pins and planet bearings rigid": changed["planets"],
        "rigid casing": _rigid_casing(axle, folder),
        "feet ten times as stiff": changed["feet"],
    }


def read_tables(tables: dict[str, Any], folder: Path):
    """Read the case of tables whose files are in a folder."""
    from femgear.case import text
    from femgear.trains.reading import read_case

    path = folder / "axle.toml"
    path.write_text(text.write(tables), encoding="utf-8")
    return read_case(path)


def _rigid_casing(axle: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Tables of the axle in a rigid casing of the same mass, with sensors at the same places."""
    from femgear.trains.gearbox.casing_file import casing_element
    from femgear.trains.gearbox.sensors import gearbox_sensors

    case, tables = read_tables(axle, folder), copy.deepcopy(axle)
    element = casing_element(case)
    about = element.rigid_motions(np.zeros(3))
    mass = about.T @ element.mass @ about
    offset = mass[:3, 3:] / mass[0, 0]
    centre = np.array([offset[1, 2], offset[2, 0], offset[0, 1]])
    about = element.rigid_motions(centre)
    tensor = (about.T @ element.mass @ about)[3:, 3:]
    places = {node.name: element.place[node.number] for node in element.nodes if node.role == "foot"}
    tables["casing"] = {
        "mass": f"{float(mass[0, 0])!r} kg",
        "centre": [f"{value!r} m" for value in centre.tolist()],
        "inertia": [f"{value!r} kg m^2" for value in np.diag(tensor).tolist()],
        "products": [f"{-float(tensor[i, j])!r} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
        "foot": [
            foot | {"position": [f"{value!r} m" for value in places[foot["name"]].tolist()]}
            for foot in axle["casing"]["foot"]
        ],
    }
    tables["sensor"] = [
        {
            "name": sensor.name,
            "position": [f"{value!r} m" for value in sensor.place.tolist()],
            "direction": sensor.direction.tolist(),
        }
        for sensor in gearbox_sensors(case)
    ]
    return tables


def sensor_levels(tables: dict[str, Any], speed: np.ndarray, folder: Path, steps) -> tuple[list[str], np.ndarray]:
    """Names of the sensors, and their levels (v, s) [m/s^2] at speeds (v,) of the reference shaft [rad/s].

    ``steps`` keeps compliances of the teeth for the next variant.
    """
    from femgear.trains.gearbox.deflection import solve_deflection
    from femgear.trains.gearbox.response import accelerations, level, solve_gearbox_response
    from femgear.trains.gearbox.sensors import gearbox_sensors

    case = read_tables(tables, folder)
    response = solve_gearbox_response(solve_deflection(case, steps=steps), speed, steps=steps)
    names = [sensor.name for sensor in gearbox_sensors(case)]
    return names, level(response, accelerations(response, len(names)))


def draw_levels(speed, levels: dict[str, np.ndarray], sensors: list[str]):
    """Figure of the levels at every sensor over the speed [rpm], one curve a variant."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    from femgear.report.style import BLACK, COLOURS, DASHES, label, legend_below, new_figure

    figure, axes = new_figure(rows=len(sensors), height=0.9 + 2.7 * len(sensors), sharex=True)
    others = [colour for colour in COLOURS if colour != BLACK]
    for number, (ax, sensor) in enumerate(zip(axes, sensors, strict=True)):
        for place, (name, values) in enumerate(levels.items()):
            style = {"color": BLACK, "linewidth": 2.2} if place == 0 else {"color": others[place - 1], "linewidth": 1.3}
            ax.plot(speed, values[:, number], label=name, linestyle=DASHES[place % len(DASHES)], **style)
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set_xlim(speed[0], speed[-1])
        label(ax, y="level, r.m.s. [m/s²]", title=f"sensor {sensor}")
    label(axes[-1], "speed of the rotor [rpm]")
    legend_below(figure, axes[-1])
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
