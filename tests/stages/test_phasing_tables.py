"""Tables of phasing and of neighbouring teeth for the terminal and the report."""

from pathlib import Path

import pytest

from femgear.stages.static_results import describe_set
from femgear.trains.reading import read_case, with_value

CASES = Path(__file__).resolve().parents[2] / "cases"


def tables(case):
    _, _, harmonics, neighbours, _ = describe_set(case)
    return harmonics, neighbours


def test_reference_set_is_in_phase():
    harmonics, neighbours = tables(read_case(CASES / "planetary_27_40_108.toml"))
    assert [row[:3] for row in harmonics.rows] == [(str(h), "in-phase", "0") for h in range(1, 7)]
    assert {row[3:] for row in harmonics.rows} == {("100.0 %", "cancelled", "rotational")}
    assert "planet and ring 4" in harmonics.notes[-1]
    teeth = [row[0] for row in neighbours.rows]
    assert teeth[:3] == ["27/41/108", "28/41/110", "26/40/106"] and "27/40/108" not in teeth
    assert neighbours.rows[1][4] == "sequential, sequential, in, sequential"


@pytest.mark.parametrize("planets", [1, 2])
def test_few_planets(planets):
    case = read_case(CASES / "planetary_27_40_108.toml")
    case = with_value(case, "set.planets", planets)
    if planets == 2:
        case = with_value(case, "set.planet_angles", ["0 deg", "181.333333333 deg"])
    harmonics, neighbours = tables(case)
    assert len(harmonics.rows) == 6 and neighbours.rows
    assert harmonics.rows[0][1] == ("in-phase" if planets == 1 else "unequally phased")
    assert harmonics.rows[0][5] == "rotational-translational"


def test_lead_of_the_ring_meshes_is_that_of_the_phases():
    _, meshes, harmonics, _, _ = describe_set(read_case(CASES / "planetary_27_40_108.toml"))
    phase = dict((row[0], row[1:]) for row in meshes.rows)["mesh phases [periods]"][1].split(", ")[0]
    assert phase == "0.4636" and f"a planet's ring mesh is {phase} periods ahead" in harmonics.notes[1]


def test_published_gearbox():
    harmonics, _ = tables(read_case(CASES / "nrel_pgb.toml"))
    assert len(harmonics.rows) == 6
    assert {len(row) for row in harmonics.rows} == {len(harmonics.header)}


def test_neighbours_with_equal_spacing_come_first():
    _, neighbours = tables(read_case(CASES / "helical_30_20_70.toml"))
    assert [row[0] for row in neighbours.rows[:2]] == ["31/21/73", "29/19/67"]
    spacing = [row[3] for row in neighbours.rows]
    assert spacing[:2] == ["equal", "equal"] and "equal" not in spacing[2:] and len(spacing) == 8
