"""docs/bolts.md: its table is that of its cases."""

import re
from pathlib import Path

import numpy as np
import pytest

from femgear.housing.sensor import stored_lines
from femgear.stages.static import solve_static
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "bolts.md").read_text(encoding="utf-8")


def supports(angles, width, mass):
    size = {"radial_stiffness": "4e8 N/m", "tangential_stiffness": "4e8 N/m", "width": width, "mass": mass}
    return {"housing.support": [{"angle": f"{angle} deg"} | size for angle in angles]}


ROWS = {
    "foundation alone": {},
    "six bolts": supports(range(15, 375, 60), "12 mm", "20 g"),
    "four feet": supports((35, 145, 215, 325), "20 mm", "50 g"),
}


@pytest.fixture(scope="module")
def before():
    """Case of the foundation alone, its static solution and modes, which supports do not change."""
    changes = {"operation.speeds": ["1500 rpm", "3100 rpm"], "runup.count": 0}
    changes |= {"static.stresses": False, "housing.published": []}
    case = with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), changes)
    static = solve_static(case)
    return case, static, solve_modes(case, static)


@pytest.mark.parametrize(
    "name", ["foundation alone", *(pytest.param(name, marks=pytest.mark.slow) for name in ("six bolts", "four feet"))]
)
def test_rows_of_the_table(before, name):
    case = with_values(before[0], ROWS[name])
    data = solve_housing(case, solve_dynamics(case, *before[1:])).dataset()
    lines = stored_lines(data.isel(speed=1))
    cells = [f"{value:.1f}" for value in data["level"].values]
    cells.append(f"{data['one_way_level'].values[1]:.1f}" if ROWS[name] else "")
    (printed,) = re.findall(rf"^\| {name} \| (.*) \|$", PAGE, flags=re.MULTILINE)
    *levels, orders = (cell.strip() for cell in printed.split("|"))
    assert levels == cells
    wanted = [int(order) for order in orders.split(",")]
    strongest = lines.order[np.argsort(-np.abs(lines.acceleration))[: len(wanted)]]
    assert strongest.tolist() == wanted
    assert not (lines.order % 3).any()
    if name == "four feet":
        above = (data["equivalent_power_level"] - data["power_level"]).values
        words = f"{above[0]:.1f} dB above the sound power at 1500 rpm and {above[1]:.1f} dB at 3100 rpm"
        assert words in (ROOT / "docs" / "casings.md").read_text(encoding="utf-8")


def test_the_snippet_is_that_of_the_first_bolt():
    (snippet,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    first = ROWS["six bolts"]["housing.support"][0]
    assert all(f'{key} = "{value}"' in snippet for key, value in first.items())
