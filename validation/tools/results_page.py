#!/usr/bin/env python3
"""Write the tables of docs/results.md: every variable of every results file with dimensions, unit and text.

They are read from the datasets of small runs and, of static.nc and stress.nc, from the declarations. The last
column and what stands between the tables are written by hand and stay::

    python validation/tools/results_page.py -o docs/results.md
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping
from pathlib import Path

import femgear
from femgear.stages.static_results import (
    HELIX_VARIABLES,
    PEAK_VARIABLES,
    SLICE_VARIABLES,
    STATIC_VARIABLES,
    STRESS_VARIABLES,
)
from femgear.trains.reading import with_values

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results.md"
# a train, its case file, and the entries that make it short
RUNS = {
    "elastic": (
        "planetary_27_40_108",
        {
            "static.positions": 8,
            "static.flank_elements": 6,
            "static.stresses": False,
            "dynamics.mesh_harmonics": 2,
            "operation.speeds": ["250 rpm"],
            "runup.count": 2,
            "housing": {"assumptions": True},
        },
    ),
    "planar": (
        "nrel_pgb",
        {"planar.branch": {"from": "36 Hz", "to": "36.2 Hz", "harmonics": 2, "points": 10}},
    ),
    "helical": (
        "helical_30_20_70",
        {
            "static.positions": 8,
            "static.flank_elements": 6,
            "dynamics.mesh_harmonics": 2,
            "operation.speeds": ["3000 rpm"],
        },
    ),
    "in_time": (
        "own_chain",
        {"transient.settle": "0.01 s", "transient.duration": "0.05 s", "transient.rate": "20 kHz"},
    ),
    "pair": (
        "spur_pair",
        {
            "static.positions": 16,
            "static.stresses": False,
            "set.backlash": "0.1 mm",
            "losses": {
                "friction": "constant",
                "coefficient": 0.05,
                "roughness": "0.4 um",
                "torque_shares": [1.0],
                "speed_shares": [1.0],
            },
            "lubricant": {"viscosity": "20 mm^2/s", "temperature": "80 degC"},
            "operation.speeds": ["15200 rpm"],
            "runup": {"from": "14000 rpm", "to": "16000 rpm", "count": 3},
            "material.treatment": "case hardened steel",
            "material.hardness": 720,
            "operation.load_case": [{"torque": "200 N m", "speed": "1500 rpm"}],
        },
    ),
    "gearbox": ("e_axle", {"deflection.contact": False}),
    "gear_pair": (
        "gear_pair",
        {
            "response.from": 1.1,
            "response.to": 1.0,
            "response.harmonics": 3,
            "response.largest_step": 0.3,
            "sweep": {"ranges": [{"from": 0.9, "to": 1.0, "count": 2}], "steps": 40, "most_periods": 20},
            "chaos": {
                "from": 2.2,
                "to": 1.8,
                "count": 2,
                "points": 8,
                "skip": 10,
                "steps": 40,
                "sections": [2.2],
            },
        },
    ),
}
SHOWN = {"in_time": ("transient", "spectrum")}
"""Stages of runs of which the others are shown elsewhere."""
TABLE = re.compile(r"(?s)(<!-- table (\w+) (\w+) -->\n).*?(<!-- end -->\n)")
ROW = "| {} | {} | {} | {} | {} |\n"
HEAD = ROW.format("variable", "dimensions", "unit", "meaning", "remark") + "|---|---|---|---|---|\n"


Variables = Mapping[str, tuple[str, str, str]]
"""Dimensions, unit and text of variables, texts without a unit."""


def variables() -> dict[tuple[str, str], Variables]:
    """Variables of every file by train and stage."""
    static = STATIC_VARIABLES | PEAK_VARIABLES | SLICE_VARIABLES | HELIX_VARIABLES
    declared = {"static": static, "stress": STRESS_VARIABLES}
    variables_of: dict[tuple[str, str], Variables] = {
        ("elastic", stage): of_stage for stage, of_stage in declared.items()
    }
    for train, (name, changes) in RUNS.items():
        case = with_values(femgear.read_case(ROOT / "cases" / f"{name}.toml"), changes)
        for stage, result in femgear.solve(case).items():
            if stage not in declared and stage in SHOWN.get(train, (stage,)):
                variables_of[train, stage] = {
                    name: (
                        " ".join(variable.dims),
                        "" if variable.dtype.kind in "OUS" else variable.attrs["units"],
                        variable.attrs["long_name"],
                    )
                    for name, variable in result.dataset().data_vars.items()
                }
    return variables_of


def table(entries: Variables, remarks: Mapping[str, str]) -> str:
    """Rows of a table, real and imaginary part in one; remarks by the first name of a row."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for name, (dims, unit, text) in entries.items():
        whole = re.sub("_(real|imag)$", "", name)
        if f"{whole}_real" in entries:
            text = re.sub(", (real|imaginary) part$", "", text)
        rows.setdefault((whole, dims, unit, text), []).append(name)
    lines = (
        ROW.format(
            ", ".join(f"`{name}`" for name in names),
            dims.replace(" ", ", "),
            unit,
            text.replace("|", "\\|").replace("<", "&lt;"),
            remarks.get(names[0], ""),
        )
        for (_, dims, unit, text), names in rows.items()
    )
    return HEAD + "".join(line.replace("|  |", "| |") for line in lines)


def page(text: str, variables_of: Mapping[tuple[str, str], Variables]) -> str:
    """Text of the page with its tables written anew; each of them must be there, once."""
    places = [match[1:3] for match in TABLE.findall(text)]
    if sorted(places) != sorted(variables_of):
        wrong = sorted(set(variables_of) ^ set(places)) or places
        raise SystemExit(f"tables that are missing, unknown or given twice: {wrong}")

    def written(match: re.Match) -> str:
        rows = re.findall(r"(?m)^\| `(\w+)`.*\|(?: (.*))? \|$", match[0])
        return f"{match[1]}{table(variables_of[match[2], match[3]], dict(rows))}{match[4]}"

    return TABLE.sub(written, text)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    output = parser.parse_args().output
    output.write_text(page(PAGE.read_text(encoding="utf-8"), variables()), encoding="utf-8")


if __name__ == "__main__":
    main()
