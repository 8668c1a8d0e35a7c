"""docs/multistage.md: its examples print what it says, the names in it exist."""

import importlib
import re

import numpy as np
import pytest
from page_examples import read_page, run_examples
from published.multistage_example import four_stage_case, published_case

from femgear import solve

PAGE, EXAMPLES, PRINTED = read_page("multistage.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("multistage.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 3


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_named_modules_exist():
    named = re.findall(r"`(?:scripts/|tests/)?(\w+/\w+)\.py`", PAGE)
    assert {"published/multistage_example", "validation/multistage"} <= set(named)
    for name in named:
        importlib.import_module(name.replace("/", "."))


def test_range_of_mesh_stiffness_is_that_of_the_example():
    stages = four_stage_case().planetary
    stiffness = [mesh.stiffness for stage in stages for mesh in (stage.sun_mesh, stage.ring_mesh)]
    low, high = (float(one) * 1e3 for one in re.findall(r"example\s+have\s+(\S+)\s+to\s+(\S+)\s+N/mm", PAGE)[0])
    assert min(stiffness) == pytest.approx(low, rel=0.1) and max(stiffness) == pytest.approx(high, rel=0.1)


def test_table_of_readings_is_what_the_published_data_give():
    rows = re.findall(r"^\|[^|]*\| ([34]) \| (free|held) \| (\d) \| (\S+) \| (\S+) \|", PAGE, flags=re.MULTILINE)
    assert len(rows) == 8
    for number, (planets, end, rigid, low, high) in enumerate(rows):
        unit = 1e3 if number < 4 else 1.0
        case = published_case(planets=int(planets), stiffness_unit=unit, held=end == "held")
        frequency = solve(case, only="modes")["modes"].modes.frequency
        assert np.count_nonzero(frequency == 0.0) == int(rigid)
        elastic = frequency[frequency > 0.0]
        assert (f"{elastic[0]:.1f}", f"{elastic[-1]:.1f}") == (low, high)


def test_page_prints_the_published_table():
    table = PAGE[PAGE.index("## A published table") : PAGE.index("The table lacks")]
    case = published_case(planets=3)
    bodies = {mass.shaft: mass for mass in case.mass}
    columns = []
    for stage in case.planetary:
        members = [bodies[stage.sun], stage.planet, bodies[stage.carrier]]
        meshes = [stage.sun_mesh.stiffness / 1e3, stage.ring_mesh.stiffness / 1e3]
        radii = [1e3 * radius for radius in stage.gears.base_radii[:2]]
        inertias = [[1e6 * body.inertia] for body in members]
        columns.append([[body.mass for body in members], radii, *inertias, *([k] for k in meshes)])
    starts = ("sun, planet, carrier mass", "sun, planet base radius", "sun inertia", "planet inertia")
    for place, start in enumerate((*starts, "carrier inertia", "external mesh", "internal mesh")):
        row = next(line for line in table.splitlines() if line.startswith(f"| {start}"))
        printed = [[float(one) for one in cell.split(",")] for cell in row.split("|")[2:6]]
        for cell, column in zip(printed, columns, strict=True):
            assert cell == pytest.approx(column[place], rel=1e-12)
