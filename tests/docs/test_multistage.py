"""docs/multistage.md: its examples print what it says, the names in it exist."""

import importlib
import re

import pytest
from page_examples import read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("multistage.md")


@pytest.fixture(scope="module")
def outputs():
    return run_examples("multistage.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 4


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def test_named_modules_exist():
    named = re.findall(r"`(?:scripts/|tests/)?(\w+/\w+)\.py`", PAGE)
    assert {"published/multistage_example", "validation/multistage"} <= set(named)
    for name in named:
        importlib.import_module(name.replace("/", "."))


def test_range_of_mesh_stiffness_is_that_of_the_example():
    from published.multistage_example import four_stage_train

    stiffness = [k for stage in four_stage_train().stages for k in stage.data.mesh_stiffness]
    low, high = (float(one) * 1e3 for one in re.findall(r"example have (\S+) to (\S+) N/mm", PAGE)[0])
    assert min(stiffness) == pytest.approx(low, rel=0.1) and max(stiffness) == pytest.approx(high, rel=0.1)


def test_table_of_readings_is_what_the_published_data_give():
    import numpy as np
    from published.multistage_example import published_train

    from femgear.trains.multistage.stages import multistage_modes

    rows = re.findall(r"^\|[^|]*\| ([34]) \| (free|held) \| (\d) \| (\S+) \| (\S+) \|", PAGE, flags=re.MULTILINE)
    assert len(rows) == 8
    for number, (planets, end, rigid, low, high) in enumerate(rows):
        unit = 1e3 if number < 4 else 1.0
        train = published_train(planets=int(planets), stiffness_unit=unit, held=end == "held")
        frequency = multistage_modes(train).modes.frequency
        assert np.count_nonzero(frequency == 0.0) == int(rigid)
        elastic = frequency[frequency > 0.0]
        assert (f"{elastic[0]:.1f}", f"{elastic[-1]:.1f}") == (low, high)


def test_page_prints_the_published_table():
    from small_trains import published_table

    table = PAGE[PAGE.index("## A published table") : PAGE.index("The case takes what")]
    columns = published_table()
    rows = {
        "sun, planet, carrier mass": ("sun mass", "planet mass", "carrier mass"),
        "sun, planet base radius": ("sun base radius", "planet base radius"),
        "sun inertia": ("sun inertia",),
        "planet inertia": ("planet inertia",),
        "carrier inertia": ("carrier inertia",),
        "external mesh": ("external mesh stiffness",),
        "internal mesh": ("internal mesh stiffness",),
    }
    for start, names in rows.items():
        row = next(line for line in table.splitlines() if line.startswith(f"| {start}"))
        printed = [[float(one) for one in cell.split(",")] for cell in row.split("|")[2:6]]
        assert printed == [[column[name] for name in names] for column in columns]
