#!/usr/bin/env python3
"""Natural frequencies of a published table of four planetary stages, for every reading that it allows."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import print_table, ready_folder, run_script, say_files, write_csv

FILES = ["published.csv", "published.png"]


def main(*, output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/multistage_published")) -> None:
    """Solve for the modes of the table of "Optimized design of dynamic characteristics of planetary gear train".

    Its units and missing entries allow several readings: the stiffness unit, the number of planets, the last
    carrier held or free.

    Parameters
    ----------
    output
        Folder of the results.
    """
    from published.multistage_example import PUBLISHED_FREQUENCIES, published_case

    from femgear.report.style import BLUE, GREY, label, new_figure, save_figure
    from femgear.run import solve

    folder = ready_folder(output, FILES)
    low, high = PUBLISHED_FREQUENCIES
    rows, records, ladders = [], [], []
    for unit, factor in (("N/mm", 1e3), ("N/m", 1.0)):
        for planets in (3, 4):
            for held in (False, True):
                case = published_case(planets=planets, stiffness_unit=factor, held=held)
                frequencies = solve(case, only="modes")["modes"].modes.frequency
                elastic, reading = frequencies[frequencies > 0.0], f"{unit}, {planets} planets"
                end = "last carrier held" if held else "last carrier free"
                inside = int(np.sum((elastic > low) & (elastic < high)))
                rows.append(
                    (
                        reading,
                        end,
                        str(len(frequencies) - len(elastic)),
                        f"{elastic[0]:.1f}",
                        f"{elastic[-1]:.1f}",
                        f"{inside} of {len(elastic)}",
                    )
                )
                records += [(unit, planets, end, number + 1, float(f)) for number, f in enumerate(frequencies)]
                ladders.append((f"{reading}\n{end}", elastic))
    write_csv(folder / "published.csv", ("unit", "planets", "end", "mode", "frequency [Hz]"), records)
    figure, (ax,) = new_figure(width=8.5, height=4.8)
    for place, (_, elastic) in enumerate(ladders):
        ax.hlines(elastic, place - 0.35, place + 0.35, color=BLUE, linewidth=1.2)
    ax.axhspan(low, high, color=GREY, alpha=0.3, linewidth=0.0)
    ax.text(-0.35, 1.1 * low, "printed range", va="bottom")
    ax.set_yscale("log")
    ax.set_xticks(range(len(ladders)), [name.replace(", ", "\n") for name, _ in ladders], fontsize=8)
    label(ax, y="natural frequency [Hz]", title="published four-stage table, torsion, rigid shafts")
    save_figure(figure, folder / "published.png")
    header = ("reading", "end", "modes at 0 Hz", "lowest [Hz]", "highest [Hz]", f"within {low} to {high} Hz")
    print_table("Published four-stage table: torsion, rings at rest, rigid shafts", header, rows)
    say_files(folder, FILES)


if __name__ == "__main__":
    sys.exit(run_script(main))
