#!/usr/bin/env python3
"""Write the tables of docs/results.md: every variable of every results file with dimensions, unit and text.

They are read from the datasets of small runs and, of static.nc and stress.nc, from the declarations. What
stands between the tables is written by hand and stays::

    python tests/tools/results_page.py -o docs/results.md
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import femgear
from femgear.trains.reading import with_values
from femgear.trains.static.results import STATIC_VARIABLES, STRESS_VARIABLES

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
        },
    ),
    "planar": (
        "nrel_pgb",
        {"planar.branch": {"from": "36 Hz", "to": "36.2 Hz", "harmonics": 2}},
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
    "drivetrain": (
        "own_chain",
        {
            "simulation.settle": "0.01 s",
            "simulation.duration": "0.05 s",
            "simulation.rate": "20 kHz",
            "simulation.modes": 1,
        },
    ),
    "multistage": ("four_stage_reducer", {"response.points": 3, "response.balance_points": 1}),
    "gear_pair": (
        "gear_pair",
        {
            "response.from": 1.1,
            "response.to": 1.0,
            "response.harmonics": 3,
            "sweep": {"ranges": [{"from": 0.9, "to": 1.0, "count": 2}], "steps": 40, "most_periods": 20},
            "chaos": {"from": 2.2, "to": 1.8, "count": 2, "points": 8, "skip": 10, "steps": 40, "sections": [2.2]},
        },
    ),
}
TABLE = re.compile(r"(?s)(<!-- table (\w+) (\w+) -->\n).*?(<!-- end -->\n)")
ROW = "| {} | {} | {} | {} |\n"
HEAD = ROW.format("variable", "dimensions", "unit", "meaning") + "|---|---|---|---|\n"
PARTS = (("_real", ", real part"), ("_imag", ", imaginary part"))


def tables() -> dict[tuple[str, str], str]:
    """Table of every file by train and stage."""
    declared = {"static": STATIC_VARIABLES, "stress": STRESS_VARIABLES}
    found = {("elastic", stage): table(texts) for stage, texts in declared.items()}
    for train, (name, changes) in RUNS.items():
        case = with_values(femgear.read_case(ROOT / "cases" / f"{name}.toml"), changes)
        for stage, result in femgear.solve(case).items():
            if stage not in declared:
                found[train, stage] = table(dict(_variables(result.dataset())))
    return found


def _variables(data) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Dimensions, unit and text of the variables of a dataset; texts have no unit."""
    for name, one in data.data_vars.items():
        unit = "" if one.dtype.kind in "OUS" else one.attrs["units"]
        yield name, (" ".join(one.dims), unit, one.attrs["long_name"])


def table(variables: Mapping[str, tuple[str, str, str]]) -> str:
    """Rows of a table; real and imaginary part share one."""
    rows = {}
    for name, (dims, unit, text) in variables.items():
        for suffix, words in PARTS:
            if name.endswith(suffix) and f"{name.removesuffix(suffix)}_real" in variables:
                text = text.removesuffix(words)
        rows.setdefault((re.sub("_(real|imag)$", "", name), dims, unit, text), []).append(f"`{name}`")
    return HEAD + "".join(
        ROW.format(", ".join(names), dims.replace(" ", ", "), unit, _cell(text))
        for (_, dims, unit, text), names in rows.items()
    )


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split()).replace("<", "&lt;")


def page(text: str, found: Mapping[tuple[str, str], str]) -> str:
    """Text of the page with its tables written anew; each of them must be there, once."""
    places = [match[1:3] for match in re.findall(TABLE, text)]
    missing = set(found) ^ set(places)
    if missing or len(places) != len(found):
        raise SystemExit(f"tables that are missing, unknown or given twice: {sorted(missing) or places}")
    return TABLE.sub(lambda match: f"{match[1]}{found[match[2], match[3]]}{match[4]}", text)


def main() -> int:
    """Write the page, or print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path)
    output = parser.parse_args().output
    text = page(PAGE.read_text(encoding="utf-8"), tables())
    if output is None:
        print(text)
    else:
        output.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
