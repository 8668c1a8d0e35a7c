"""The table of docs/misaligned.md is what the package computes."""

import re
from pathlib import Path

import numpy as np
import pytest

from femgear.stages.static import solve_static, solve_stress
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "misaligned.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in re.findall(r"(?m)^\| \d.*$", PAGE)]


@pytest.mark.slow
@pytest.mark.parametrize("row", [ROWS[1], ROWS[3]], ids=["slope", "crowned"])
def test_rows_of_the_table(row):
    slope, crowning, *printed = map(float, row)
    modifications = [{"kind": "lead slope", "amount": f"{slope} um"}]
    modifications += [{"kind": "lead crowning", "amount": f"{crowning} um"}] if crowning else []
    changes = {"static.slices": 25, "static.positions": 32, "sun.modifications": modifications}
    case = with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), changes)
    cycle = (static := solve_static(case)).cycle
    stress = solve_stress(case, static).dataset()
    assert cycle.face_load_factor is not None
    found = (
        cycle.face_load_factor[0],
        np.ptp(cycle.sun_arc) * 1e6,
        cycle.stiffness[0].mean() / 1e6,
        cycle.max_pressure[0].max() / 1e6,
        float(stress["root_worst"][0, 0]) / 1e6,
        float(stress["root_face_factor"][0, 0]),
    )
    assert found == pytest.approx(printed, rel=3e-3)


@pytest.mark.slow
def test_planets_that_tilt():
    row = re.search(r"(?m)^\| 1e4 N m/rad \|(.*)\|$", PAGE)
    numbers = [float(one) for one in re.findall(r"-?[\d.]+", row[1].replace("−", "-"))]
    changes = {"static.slices": 25, "static.positions": 32, "sun.misalignment": {"x": "0.4 mrad"}}
    changes["planet.tilt_stiffness"] = "1e4 N m/rad"
    cycle = solve_static(with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), changes)).cycle
    found = np.append(cycle.face_load_factor, cycle.mesh_misalignment.mean(axis=1) * 1e6)
    assert np.abs(found - numbers).max() < 0.006
