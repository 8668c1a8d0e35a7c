"""Where branches of planets fit: against closed forms, marks against a known set, refusals with places that fit."""

import json
import math
import re
import tomllib

import pytest
from planet_gearboxes import stepped_set

from femgear.errors import CaseError
from femgear.gears.planet_assembly import assembly_step, double_gears, ravigneaux_gears, stepped_gears
from femgear.trains.drafts import new_case
from femgear.trains.gearbox.planet_branches import alike_branches, describe_branches, misplaced_branches
from femgear.trains.reading import parse_case, read_case

UNEVEN = (23, 41, 17, 81)


@pytest.mark.parametrize(
    ("kind", "gears"),
    [
        ("stepped", stepped_gears(24, 57, 27, 108)),
        ("double", double_gears(24, 18, 20, 84)),
        ("ravigneaux", ravigneaux_gears(30, 36, 18, 18, 72)),
        ("wolfrom", stepped_gears(18, 27, 26, 71, first_ring=72)),
    ],
)
def test_branches_of_a_case_fit_where_their_teeth_say(kind, gears):
    case = parse_case(new_case(kind))
    (alike,) = alike_branches(case)
    assert len(alike) == 3 and assembly_step(alike[0].gears) == assembly_step(gears)
    assert not [*misplaced_branches(case)]
    assert sum(len(branch.planets) for branch in alike) == sum("planet" in shaft.name for shaft in case.shaft)


def test_equal_stepped_planets_at_thirds_are_refused_with_places_that_fit():
    tables = stepped_set(teeth=UNEVEN)
    with pytest.raises(CaseError, match="do not assemble") as refusal:
        read_case(tables)
    first, second = refusal.value.problems
    assert first.code == "E-ASSEMBLY" and "1/3712 of a turn" in first.limit
    for number, problem in ((1, first), (2, second)):
        place = re.search(r"axis = (\[.*?\])", problem.remedies[0]).group(1)
        assert "gears_timed" in problem.remedies[1]
        tables["shaft"][2 + number + 1]["axis"] = json.loads(place)
    assert [shaft["name"] for shaft in tables["shaft"][3:]] == ["p0", "p1", "p2"]
    assert read_case(tables)
    apart = [math.atan2(*(float(x.split()[0]) for x in shaft["axis"][::-1])) for shaft in tables["shaft"][4:]]
    assert [angle % (2 * math.pi) * 3712 / (2 * math.pi) for angle in apart] == pytest.approx([1237, 2475], abs=1e-4)


@pytest.mark.parametrize(("kind", "step"), [("double", 60), ("ravigneaux", 6), ("wolfrom", 45)])
def test_a_branch_of_any_kind_that_is_turned_has_its_place_back_by_the_remedy(kind, step):
    tables = tomllib.loads(new_case(kind))
    shafts = {shaft["name"]: shaft for shaft in tables["shaft"]}
    turn = complex(math.cos(math.radians(1.0)), math.sin(math.radians(1.0)))
    stood = {name: complex(*_mm(shaft["axis"])) for name, shaft in shafts.items() if name.endswith("planet 2")}
    for name, place in stood.items():
        shafts[name]["axis"] = [f"{(place * turn).real!r} mm", f"{(place * turn).imag!r} mm"]
    with pytest.raises(CaseError, match="do not assemble") as refusal:
        read_case(tables)
    (problem,) = refusal.value.problems
    assert problem.code == "E-ASSEMBLY" and f"1/{step} of a turn" in problem.limit
    for name, place in stood.items():
        axis = json.loads(re.search(rf"{name}: axis = (\[.*?\])", problem.remedies[0]).group(1))
        assert complex(*_mm(axis)) == pytest.approx(place, abs=1e-5)


def _mm(axis):
    return [float(text.split()[0]) for text in axis]


def test_planets_whose_gears_are_timed_fit_anywhere():
    tables = stepped_set(teeth=UNEVEN)
    for shaft in tables["shaft"][3:]:
        shaft["gears_timed"] = True
    case = read_case(tables)
    (block,) = describe_branches(case)
    assert [row[0] for row in block.rows[:2]] == ["p0, 41 teeth", "p0, 17 teeth"]
    assert {row[2] for row in block.rows} == {"-"}


def test_one_planet_that_is_timed_is_not_equal_to_the_others():
    tables = stepped_set(teeth=UNEVEN, turns=(0.0, 1237 / 3712, 2 / 3))
    tables["shaft"][5]["gears_timed"] = True
    assert [len(alike) for alike in alike_branches(read_case(tables))] == [2, 1]


def test_marks_are_those_of_the_known_set():
    case = read_case(stepped_set(teeth=(24, 40, 16, 80), turns=(0.0, 149 / 448, 299 / 448)))
    (block,) = describe_branches(case)
    assert block.rows == (
        ("p0", "0.0000", "0 of 448", "0.0000"),
        ("p1", "119.7321", "149 of 448", "8.8393"),
        ("p2", "240.2679", "299 of 448", "36.1607"),
    )
