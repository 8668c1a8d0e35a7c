#!/usr/bin/env python3
"""Mesh stiffness and static transmission error of any case over one mesh period, for several torques."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

FILES = ("mesh_stiffness.csv", "mesh_stiffness.png")
HEADER = (
    "torque [N m]",
    "mesh",
    "position [periods]",
    "transmission error [m]",
    "tangent stiffness [N/m]",
    "secant stiffness [N/m]",
    "force [N]",
)


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/mesh_stiffness"),
    torque: Annotated[tuple[str, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    contact: Literal["profile", "line_of_action"] | None = None,
    positions: int | None = None,
) -> None:
    """Compute k(theta) and the static transmission error of every mesh: a table, a picture and a CSV file.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out.
    output
        Folder of the results.
    torque
        Torque of the input with its unit, such as "50 N m"; may be repeated. Default: that of the case.
    contact
        Contact on the whole profiles, or only where rigid gears touch. Default: as the case says.
    positions
        Positions over one mesh period. Default: as the case says.
    """
    from femgear.case.gear_set import planetary_set
    from femgear.report.style import save_figure
    from femgear.run import grid_cache
    from femgear.stages.static import solve_static
    from femgear.trains.reading import read_case, with_value

    data = read_case(case)
    if contact is not None:
        data = with_value(data, "static.contact", contact)
    if positions is not None:
        data = with_value(data, "static.positions", positions)
    variants = [with_value(data, "operation.torque", value) for value in torque] or [data]
    planetary_set(data)  # refuse before the folder is touched
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        results = []
        for number, variant in enumerate(variants):
            progress("static", number, len(variants))
            results.append(solve_static(variant, cache=grid_cache(), progress=progress).dataset())
        progress("static", len(variants), len(variants))
    torques = [variant.operation.torque for variant in variants]
    write_csv(folder / "mesh_stiffness.csv", HEADER, _records(torques, results))
    save_figure(_figure(torques, results), folder / "mesh_stiffness.png")
    _print_summary(torques, results)
    print(f"contact: {results[0].attrs['contact']}; {results[0].sizes['position']} positions")
    say_files(folder, FILES)


def _records(torques, results):
    for torque, static in zip(torques, results):
        names = ("ste", "mesh_stiffness", "mesh_stiffness_secant", "mesh_force")
        columns = [static[name].values for name in names]
        for j, mesh in enumerate(static["mesh"].values):
            for p, position in enumerate(static["position"].values):
                yield (float(torque), str(mesh), float(position), *(float(c[j, p]) for c in columns))


def _print_summary(torques, results):
    from femgear.report.style import drawn_lines

    rows = []
    for torque, static in zip(torques, results):
        for name, j in drawn_lines(static["mesh"].values, static["mesh_stiffness"]):
            k_peak, ste_peak = (static[f"{variable}_peak_to_peak"].values[j] for variable in ("mesh_stiffness", "ste"))
            k, ste = (
                factor * float(static[f"{variable}_mean"][j])
                for variable, factor in (("mesh_stiffness", 1e-6), ("ste", 1e6))
            )
            values = (k, k_peak / 1e6, ste, ste_peak * 1e6)
            per_width = k / (1e3 * static.attrs["face_width"])
            rows.append((name, f"{torque:g}", *(f"{v:.4f}" for v in values), f"{per_width:.3f}"))
    header = ("mesh", "torque [N m]", "k mean [N/um]", "k p-p", "STE mean [um]", "STE p-p", "k/b [N/(mm um)]")
    print_table("Tangent mesh stiffness and static transmission error", header, rows)


def _figure(torques, results):
    """Transmission error above, stiffness below; every kind of mesh in a column."""
    from femgear.report.style import (
        drawn_lines,
        family,
        label,
        legend_below,
        line_style,
        new_figure,
        periodic,
    )

    kinds = list(dict.fromkeys(family(str(name)) for name in results[0]["mesh"].values))
    figure, axes = new_figure(rows=2, columns=len(kinds), width=5.0 * len(kinds), height=7.4, sharex=True)
    for column, kind in enumerate(kinds):
        number = 0
        for torque, static in zip(torques, results):
            for name, j in drawn_lines(static["mesh"].values, static["mesh_stiffness"]):
                if family(name) != kind:
                    continue
                text = f"{torque:g} N m" if "identical" in name else f"{torque:g} N m, {name}"
                position, ste = periodic(static["position"], static["ste"].values[j] * 1e6)
                axes[column].plot(position, ste, label=text, **line_style(number))
                position, k = periodic(static["position"], static["mesh_stiffness"].values[j] / 1e6)
                axes[len(kinds) + column].plot(position, k, label=text, **line_style(number))
                number += 1
        title, mean = f"{kind} meshes", ""
        if number == 1:
            # one curve needs no legend: its title says what it shows
            stored = results[0].isel(mesh=j)
            peak = 1e6 * float(stored["ste_peak_to_peak"])
            title += f", {torques[0]:g} N m: {peak:.3g} µm peak to peak"
            peak = 1e-6 * float(stored["mesh_stiffness_peak_to_peak"])
            mean = f"mean {1e-6 * float(stored['mesh_stiffness_mean']):.4g} N/µm, {peak:.4g} N/µm peak to peak"
        label(axes[column], y="transmission error [µm]", title=title)
        label(axes[len(kinds) + column], "position in the mesh period [1]", "tangent stiffness [N/µm]", mean)
    axes[0].set_xlim(0, 1)
    if number > 1:
        legend_below(figure, columns=4)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
