#!/usr/bin/env python3
"""Mesh phasing of a planetary set, neighbouring tooth numbers, and spectra of a published helical train."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from cyclopts import Parameter
from script_tools import print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.gears.phasing import PhasingTable

MOST_HARMONICS = 100
# cases of Table 2 of the paper, four equal planets
TYPES = {"in-phase": "A", "counter-phased": "C", "sequentially phased": "F"}

FILES = (
    "phasing.csv",
    "neighbours.csv",
    "mesh_forces.csv",
    "phases.png",
    "resultants.png",
    "mesh_forces.png",
)


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/planet_phasing"),
    sun: int = 30,
    planet: int = 20,
    ring: int = 70,
    planets: int = 4,
    angle: Annotated[tuple[float, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    convention: Literal["rotation", "printed"] = "rotation",
    harmonics: int = 6,
    distance: int = 3,
    tolerance: float = 0.03,
    points: int = 2000,
) -> None:
    """Phasing of every harmonic, tooth numbers near the given ones, and figures after Kahraman (1994).

    Parameters
    ----------
    output
        Folder of the results.
    sun, planet, ring
        Teeth.
    planets
        Number of planets without --angle; they stand at the assembly positions nearest to equal spacing.
    angle
        Planet angles [deg] instead, ascending, once for every planet.
    convention
        Phases of turning teeth, or as printed in Eq. (6) of the paper.
    harmonics
        Harmonics of the mesh frequency, up to 100.
    distance
        Largest change of each tooth number.
    tolerance
        Largest relative change of the ratio.
    points
        Frequencies of the mesh-force spectra, 2 or more.
    """
    from femgear.gears.phasing import (
        check_teeth,
        mesh_phasing,
        neighbouring_teeth,
        phasing_table,
        standard_lag,
    )
    from femgear.gears.planetary import equal_planet_angles, feasible_angles
    from femgear.report.style import save_figure
    from femgear.trains.helical.figures import phase_diagram

    if points < 2 or not 1 <= harmonics <= MOST_HARMONICS:
        raise CaseError(
            f"{points} frequencies, {harmonics} harmonics",
            code="E-RANGE",
            limit=f"2 frequencies or more, 1 to {MOST_HARMONICS} harmonics",
        )
    planets = len(angle) or planets
    psi = tuple(np.radians(angle)) or feasible_angles(sun + ring, equal_planet_angles(planets))
    phasing = mesh_phasing(sun, ring, psi, convention=convention, lag=standard_lag(planet))
    for remark in check_teeth(phasing, planet):
        print(f"remark: {remark}")
    choices = neighbouring_teeth(sun, planet, ring, planets, distance=distance, ratio_tolerance=tolerance)
    table = phasing_table(phasing, range(1, harmonics + 1))
    folder = ready_folder(output, FILES)
    header, rows = _phasing_rows(table)
    print_table(f"{sun}/{planet}/{ring}, {len(psi)} planets at {_degrees(psi)} deg, {convention}", header, rows)
    write_csv(folder / "phasing.csv", header, rows)
    header, rows = _choice_rows(choices)
    title = f"Tooth numbers near {sun}/{planet}/{ring} for {planets} planets; what is left in harmonics 1 to 4"
    print_table(title, header[:8], [row[:8] for row in rows[:15]])
    write_csv(folder / "neighbours.csv", header, rows)
    save_figure(phase_diagram(phasing, harmonics=range(1, min(harmonics, 4) + 1)), folder / "phases.png")
    save_figure(resultant_chart(_types(convention, harmonics)), folder / "resultants.png")
    frequency, forces, modes = _spectra(points)
    meshes = ("sun-planet 1", "sun-planet 2")
    save_figure(mesh_force_spectra(frequency, forces, modes=modes, meshes=meshes), folder / "mesh_forces.png")
    write_csv(folder / "mesh_forces.csv", *_force_rows(frequency, forces, meshes))
    say_files(folder, FILES)


def _phasing_rows(table):
    header = (
        "harmonic",
        "phasing",
        "k = mod(h z_s, N)",
        "torque, thrust",
        "lateral force, tilting",
        "excites modes",
    )
    rows = [
        (
            int(h),
            kind,
            "-" if k < 0 else int(k),
            f"{size[:, 0].max():.4f}",
            f"{size[:, 1].max():.4f}",
            " + ".join(modes),
        )
        for h, kind, k, size, modes in zip(table.harmonics, table.kind, table.cyclic, table.members, table.excited)
    ]
    return header, [tuple(str(value) for value in row) for row in rows]


def _choice_rows(choices):
    header = (
        "teeth",
        "ratio",
        "change [%]",
        "spacing",
        "torque left [%]",
        "lateral left [%]",
        "hunting",
        "room [modules]",
        "z_r - z_s - 2 z_p",
        "phasing",
    )
    short, rows = np.array(["in", "counter", "sequential", "unequal"]), []
    for i, teeth in enumerate(choices.teeth.tolist()):
        off = f"{np.degrees(choices.spacing_error[i]):.2f} deg off"
        kinds = dict.fromkeys(short[choices.kind[i]])
        left = [", ".join(f"{100 * value:.0f}" for value in values) for values in choices.sums[i].T]
        rows.append(
            (
                "/".join(map(str, teeth)),
                f"{choices.ratio[i]:.4f}",
                f"{100 * choices.ratio_change[i]:.2f}",
                "equal" if choices.equally_spaced[i] else off,
                *left,
                "yes" if choices.hunting[i] else "no",
                f"{choices.room[i]:.2f}",
                str(choices.closure[i]),
                ", ".join(kinds if len(kinds) == 1 else short[choices.kind[i]]),
            )
        )
    return header, rows


def _types(convention, harmonics):
    """Tables of the three types of four equal planets, and of two pairs that stand unequally."""
    from published.planetary_sets import cases

    from femgear.gears.phasing import MeshPhasing, phasing_table

    phasing_by_case = cases(convention=convention)
    sets = {_title(name, letter): phasing_by_case[letter] for name, letter in TYPES.items()}
    sets["unequal pairs: 30/21/72"] = MeshPhasing(30, 72, (0, 21, 51, 72), convention=convention)
    return {title: phasing_table(phasing, range(1, harmonics + 1)) for title, phasing in sets.items()}


def _title(name: str, letter: str) -> str:
    """Phasing, case of Table 2, teeth of sun, planet and ring."""
    from published.planetary_sets import TABLE_2

    sun, ring, planet, _ = TABLE_2[letter]
    return f"{name}: {letter}, {sun}/{planet}/{ring}"


def _spectra(points):
    """Forces of two sun meshes of the published helical train, four harmonics of 1 um, 5 % damping."""
    from published.planetary_sets import cases, kahraman_set

    from femgear.gears.phasing import phase_factors
    from femgear.solvers.linear.receptance import modal_error_response
    from femgear.stages.lumped_set import gear_set_modes

    modes, frequency = gear_set_modes(kahraman_set(), damping_ratio=0.05), np.linspace(100.0, 15e3, points)
    last, turning = TYPES["sequentially phased"], cases()
    sets = {_title(name, letter): turning[letter] for name, letter in TYPES.items()}
    sets[f"{_title('sequentially phased', last)}, phases as printed"] = cases(convention="printed")[last]
    force_by_harmonic = []
    for h in (1, 2, 3, 4):
        error = 1e-6 * np.array([phase_factors(phasing, [h]).T for phasing in sets.values()])
        response = modal_error_response(modes, frequency / h, error, harmonics=[h])
        force_by_harmonic.append(np.abs(response.force[:, :, 0, :2]))
    forces = {title: np.array([force[c] for force in force_by_harmonic]) for c, title in enumerate(sets)}
    kinds, inside = np.array(modes.kind), (modes.frequency > 0.0) & (modes.frequency < frequency[-1])
    names = {"rotational": "rotational-axial", "translational": "translational-tilting", "planet": "planet"}
    marks = {short: modes.frequency[inside & (kinds == kind)] for short, kind in names.items()}
    return frequency, forces, marks


def _force_rows(frequency, forces, meshes):
    header = ("set", "mesh", "frequency [Hz]", *(f"harmonic {h} [N]" for h in (1, 2, 3, 4)))
    rows = (
        (title, mesh, float(f), *map(float, values))
        for title, force in forces.items()
        for j, mesh in enumerate(meshes)
        for f, values in zip(frequency, force[:, :, j].T)
    )
    return header, rows


def _degrees(psi) -> str:
    return ", ".join(f"{a:.6g}" for a in np.degrees(psi))


def resultant_chart(tables: Mapping[str, PhasingTable]):
    """Resultants that are left and kinds of modes excited, harmonic by harmonic, one picture a set.

    The counterpart of Fig. 4 of A. Kahraman (J. Mech. Des. 116, 1994, 713-720); the area of a mark is the
    share of the mesh forces.

    Parameters
    ----------
    tables : mapping of str to PhasingTable
        Titles and sets.
    """
    from femgear.gears.phasing import MODES
    from femgear.report.style import GREY, SIZE, label, legend_below, new_figure

    count = len(tables)
    columns = min(4, count)
    rows = -(-count // columns)
    tall = max(len(table.harmonics) for table in tables.values())
    figure, axes = new_figure(rows=rows, columns=columns, width=3.0 * columns, height=(0.42 * tall + 1.9) * rows + 0.4)
    names = ("torque, thrust", "lateral force, tilting", *(f"{name} modes" for name in MODES))
    for ax in axes[count:]:
        ax.set_visible(False)
    for ax, (title, table) in zip(axes, tables.items()):
        shares = np.column_stack([table.members[..., 0].max(axis=1), table.members[..., 1].max(axis=1), table.modes])
        for column, values in enumerate(shares.T):
            marker, colour = ("D", GREY) if column < 2 else _kind_marks()[MODES[column - 2]]
            there = np.flatnonzero(values > 1e-9)
            place = np.full(len(there), column)
            ax.scatter(place, table.harmonics[there], s=130 * values[there], color=colour, marker=marker, zorder=3)
            text = "resultant" if column < 2 else names[column]
            ax.plot([], [], marker, color=colour, label=text)
        ax.axvline(1.5, color="0.6", linewidth=1.0)
        ax.set_xticks(range(5), names, rotation=40, ha="right", fontsize=SIZE - 2)
        ax.set_yticks(table.harmonics)
        ax.set_xlim(-0.6, 4.6)
        ax.set_ylim(table.harmonics[-1] + 0.6, table.harmonics[0] - 0.6)
        label(ax, y="harmonic of the mesh frequency [1]", title=title)
    legend_below(figure, columns=4)
    return figure


def mesh_force_spectra(
    frequency,
    forces: Mapping[str, np.ndarray],
    *,
    modes: Mapping[str, np.ndarray] | None = None,
    meshes: Sequence[str] = ("sun-planet 1",),
):
    """Mesh forces over the frequency of each harmonic, one picture a set.

    The counterpart of Fig. 6 of A. Kahraman (J. Mech. Des. 116, 1994, 713-720).

    Parameters
    ----------
    frequency : (F,) array
        Of the harmonic itself, h times the mesh frequency [Hz].
    forces : mapping of str to (H, F, n) array
        Titles, and amplitudes [N] of harmonics 1 to H at the meshes drawn.
    modes : mapping of str to (m,) array, optional
        Natural frequencies [Hz] by kind, for marks along the axis.
    meshes : sequence of str
        Names of the n meshes; the second and further ones are drawn where they differ from the first.
    """
    from femgear.report.style import COLOURS, DASHES, GREY, label, legend_below, new_figure

    columns = 2 if len(forces) > 1 else 1
    rows = -(-len(forces) // columns)
    figure, axes = new_figure(
        rows=rows, columns=columns, width=5.4 * columns, height=3.3 * rows + 0.8, sharex=True, sharey=True
    )
    hertz, top = np.asarray(frequency) * 1e-3, max(np.abs(f).max() for f in forces.values())
    for ax in axes[len(forces) :]:
        ax.set_visible(False)
    for ax, (title, force) in zip(axes, forces.items()):
        size = np.abs(force)
        for h in range(len(size)):
            for j, name in enumerate(meshes):
                if j and np.abs(size[h, :, j] - size[h, :, 0]).max() < 1e-6 * top:
                    continue
                # wide below narrow: lines that coincide are all seen
                text = f"harmonic {h + 1}, {name}"
                ax.plot(
                    hertz,
                    size[h, :, j],
                    DASHES[j % 4],
                    color=COLOURS[h % 7],
                    label=text,
                    linewidth=4.5 - 1.2 * min(h, 3),
                    zorder=2 + h,
                )
        for kind, values in (modes or {}).items():
            marker, colour = _kind_marks().get(kind, ("x", GREY))
            ax.plot(
                np.asarray(values) * 1e-3,
                np.full(len(values), -0.05 * top),
                marker,
                color=colour,
                markersize=5,
                label=f"{kind} modes",
                clip_on=False,
            )
        ax.set_ylim(-0.09 * top, 1.05 * top)
        label(ax, title=title)
    for ax in axes[-columns:]:
        label(ax, x="frequency of the harmonic [kHz]")
    for ax in axes[::columns]:
        label(ax, y="mesh force [N]")
    legend_below(figure, columns=4)
    return figure


def _kind_marks() -> dict[str, tuple[str, str]]:
    """Marker and colour of every kind of mode."""
    from femgear.report.style import BLACK, BLUE, VERMILION

    return {"rotational": ("o", BLUE), "translational": ("^", VERMILION), "planet": ("s", BLACK)}


if __name__ == "__main__":
    sys.exit(run_script(main))
