"""What holds the shafts: every fault at the terminal, all of one file at once, and the rules by themselves."""

import copy

import numpy as np
import pytest
from random_gearboxes import random_gearbox
from small_gearbox import pair_tables, planetary_tables, set_on_shafts

from femgear.case import text as case_text
from femgear.cli import main
from femgear.errors import CaseError
from femgear.trains.gearbox.deflection import check_held, solve_deflection
from femgear.trains.gearbox.holding import senses, shaft_thrusts, without_balance
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.reading import read_case

BALL = {"kind": "ball", "rolling_elements": 9, "element_diameter": "9.5 mm", "pitch_diameter": "46 mm"}
IDLE = {"name": "idle", "axis": ["0 mm", "100 mm"], "part": [{"length": "50 mm", "outer_diameter": "20 mm"}]}
ON_IDLE = [
    {"shaft": "idle", "position": "5 mm", "radial": "1e8 N/m", "axial": "1e8 N/m"},
    {"shaft": "idle", "position": "45 mm", "radial": "1e8 N/m"},
]


def rolling(tables, number: int, **entries) -> None:
    """Put a ball bearing in the place of another one."""
    old = tables["bearing"][number]
    tables["bearing"][number] = {key: old[key] for key in ("name", "shaft", "position")} | BALL | entries


def helical(tables) -> None:
    tables["pair"][0]["gears"]["helix_angle"] = "15 deg"


def one_sided(tables) -> None:
    helical(tables)
    tables["bearing"][0]["axial_sense"], tables["bearing"][2]["axial_sense"] = "negative", "positive"


def same_way(tables) -> None:
    helical(tables)
    for number in range(4):
        rolling(tables, number, contact_angle="25 deg")


def idle(tables) -> None:
    tables["shaft"].append(copy.deepcopy(IDLE))
    tables["bearing"] += copy.deepcopy(ON_IDLE)


def loop(tables) -> None:
    gears = {"teeth": [25, 35], "module": "3 mm", "face_width": "10 mm"}
    second = {"name": "again", "positions": ["60 mm", "60 mm"], "gears": gears}
    tables["pair"].append(copy.deepcopy(tables["pair"][0]) | second)


FAULTS = {
    # the fault: change, code, key, then parts of the message that name value, limit and remedy
    "bearing off its shaft": (
        lambda t: t["bearing"][1].update(position="95 mm"),
        ("E-RANGE", "bearing[1].position", "'95 mm'", "0 mm to 90 mm", "lengthen the shaft"),
    ),
    "bearing of no shaft": (
        lambda t: t["bearing"][1].update(shaft="wheel"),
        ("E-CHOICE", "bearing[1].shaft", "'wheel'", "input, output", "name a [[shaft]]"),
    ),
    "bearing in no shaft": (
        lambda t: t["bearing"][1].update(outer_shaft="hollow", outer_position="1 mm"),
        ("E-CHOICE", "bearing[1].outer_shaft", "'hollow'", "input, output", "name a [[shaft]]"),
    ),
    "shaft that floats along its axis": (
        lambda t: t["bearing"][2].pop("axial"),
        ("E-MECHANISM", "shaft[1].name", "'C, D without axial stiffness'", "along its axis", "a bearing of output"),
    ),
    "load off its shaft": (
        lambda t: t["load"][1].update(position="91 mm"),
        ("E-RANGE", "load[1].position", "'91 mm'", "0 mm to 90 mm", "correct the position"),
    ),
    "gear off its shaft": (
        lambda t: t["pair"][0].update(positions=["-3 mm", "1 mm"]),
        ("E-RANGE", "pair[0].positions", "'-3 mm'", "0 mm to 90 mm", "correct the position"),
    ),
    "gears that do not reach each other": (
        lambda t: t["shaft"][1].update(axis=["95 mm", "0 mm"]),
        ("E-CENTRE-DISTANCE", "pair[0].shafts", "'95 mm apart'", "90 mm", "correct the axes"),
    ),
    "gears beside each other": (
        lambda t: t["pair"][0].update(positions=["30 mm", "80 mm"]),
        ("E-RANGE", "pair[0].positions", "30 mm and 80 mm", "less than 20 mm", "correct the positions"),
    ),
    "clearance that swallows the load": (
        lambda t: rolling(t, 3, clearance="0.5 mm"),
        ("E-BEARING", "bearing[3].clearance", "'0.5 mm'", "at most 0.3 mm", "of the catalogue"),
    ),
    "thrust that springs of one sense do not take": (
        one_sided,
        (
            "E-MECHANISM",
            "bearing[0].axial_sense",
            "744.303 N towards +z",
            "takes thrust towards +z",
            "turn the bearing",
        ),
    ),
    "thrust that angular bearings do not take": (
        same_way,
        (
            "E-MECHANISM",
            "bearing[2].contact_angle",
            "744.303 N towards -z",
            "takes thrust towards -z",
            "turn the bearing",
        ),
    ),
    "locked loop": (
        loop,
        ("E-MECHANISM", "operation.load_case[0].speed", "lock", "multiply to one", "leave out a stage of the loop"),
    ),
    "free shaft": (
        idle,
        ("E-MECHANISM", "operation.load_case[0].speed", "'idle' turns freely", "one given speed", "hold 'idle'"),
    ),
    "speeds that contradict one another": (
        lambda t: t["operation"]["load_case"][0]["speed"].update(output="700 rpm"),
        ("E-SPEED", "operation.load_case[0].speed", "700 rpm", "-666.667 rpm", "leave the speed of 'output' out"),
    ),
    "torque that nothing takes": (
        lambda t: t["operation"].update(output=[]),
        ("E-LOAD-BALANCE", "operation.output", "100", "0 N m", "as an output"),
    ),
    "shaft on one bearing": (
        lambda t: t["bearing"].pop(3),
        ("E-MECHANISM", "shaft[1].name", "'bearings C'", "against tilting", "two bearings across"),
    ),
}


def terminal(tables, folder, capsys, command: str) -> tuple[int, str]:
    """Exit code and standard error of a command on a case."""
    path = folder / "box.toml"
    path.write_text(case_text.write(tables), encoding="utf-8")
    more = ["-o", str(folder / "out"), "--no-pictures"] if command == "run" else []
    return main([command, str(path), *more]), capsys.readouterr().err


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_user_is_told_file_entry_value_limit_and_remedy(fault, command, tmp_path, capsys):
    change, (code, key, found, allowed, remedy) = FAULTS[fault]
    tables = pair_tables()
    change(tables)
    status, error = terminal(tables, tmp_path, capsys, command)
    assert status == 2
    assert "Traceback" not in error and not (tmp_path / "out").exists()
    (told,) = [part for part in error.split("\n[") if f"{key}: " in part and found in part]
    assert f"{code}] {tmp_path / 'box.toml'}:" in told
    assert allowed in told.split("allowed:")[1].split("remedy:")[0]
    assert remedy in told.split("remedy:")[1]


def test_one_file_with_many_faults_names_all_that_can_be_judged(tmp_path, capsys):
    tables = pair_tables()
    faults = (
        "bearing off its shaft",
        "bearing in no shaft",
        "shaft that floats along its axis",
        "load off its shaft",
        "gears that do not reach each other",
        "clearance that swallows the load",
        "free shaft",
        "speeds that contradict one another",
    )
    for fault in faults:
        if "clearance" not in fault:
            FAULTS[fault][0](tables)
    rolling(tables, 0, clearance="0.5 mm")
    tables["bearing"].append({"shaft": "wheel", "position": "1 mm", "radial": "1e8 N/m"})
    status, error = terminal(tables, tmp_path, capsys, "check")
    assert status == 2 and "Traceback" not in error
    for fault in faults:
        code, key, *_ = FAULTS[fault][1]
        key = "bearing[0].clearance" if "clearance" in fault else key
        assert any(f"[{code}]" in line and f"{key}: " in line for line in error.splitlines()), fault
    assert "bearing[6].shaft: " in error
    assert "9 problems" in error


def test_thrust_is_told_once_of_all_load_cases():
    tables = pair_tables()
    one_sided(tables)
    case = tables["operation"]["load_case"][0]
    tables["operation"]["load_case"] = [case | {"name": name, "share": 1.0 / 3.0} for name in ("a", "b", "c")]
    with pytest.raises(CaseError) as caught:
        read_case(tables)
    assert [one.key for one in caught.value.problems] == ["bearing[0].axial_sense", "bearing[2].axial_sense"]
    assert all("load case a" in one.message for one in caught.value.problems)


def test_a_wrong_name_near_a_right_one_is_one_fault():
    tables = pair_tables()
    tables["bearing"][0]["shaft"] = "inptu"
    with pytest.raises(CaseError) as caught:
        read_case(tables)
    assert [one.key for one in caught.value.problems] == ["bearing[0].shaft"]


def test_what_bearings_take():
    def of(**entries):
        tables = pair_tables()
        tables["bearing"][3] = {"name": "D", "shaft": "output", "position": "85 mm"} | entries
        return senses(read_case(tables).bearing[3])

    roller = BALL | {"effective_length": "9 mm"}
    assert of(radial="1e8 N/m") == (False, False)
    assert of(axial="1e8 N/m") == (True, True)
    assert of(axial="rigid", axial_sense="positive") == (True, False)
    assert of(**BALL) == (True, True)
    assert of(**BALL, axial_sense="none") == (False, False)
    assert of(**BALL, contact_angle="-25 deg") == (False, True)
    assert of(**BALL, contact_angle="25 deg", rows=2, row_distance="20 mm") == (True, True)
    assert of(**roller | {"kind": "cylindrical"}) == (False, False)
    assert of(**roller | {"kind": "tapered", "contact_angle": "15 deg"}) == (True, False)


@pytest.mark.parametrize("seed", range(8))
def test_thrusts_are_those_that_bearings_carry(seed):
    """Of gearboxes without weight along z, also by planets and loads: bearings, tied shafts together."""
    tables = random_gearbox(seed, 3)
    tables.pop("gravity", None)
    case = read_case(tables)
    found = solve_deflection(case)
    thrust = shaft_thrusts(case, gearbox_flow(case), 0)
    for number, shaft in enumerate(case.shaft):
        carried = sum(f[2] for one, f in zip(case.bearing, found.bearing_force, strict=True) if one.shaft == shaft.name)
        assert carried == pytest.approx(-thrust[number], abs=1e-7 * np.abs(found.mesh_force).max())


def test_a_hollow_shaft_takes_thrust_on_for_the_one_inside():
    tables = pair_tables(helix="15 deg")
    hollow = {"length": "90 mm", "outer_diameter": "90 mm", "inner_diameter": "60 mm"}
    tables["shaft"].append({"name": "hollow", "part": [hollow]})
    tables["bearing"][0] |= {"outer_shaft": "hollow", "outer_position": "5 mm"}
    tables["bearing"] += [
        {"name": name, "shaft": "hollow", "position": place, "radial": "2e8 N/m"}
        for name, place in (("E", "5 mm"), ("F", "80 mm"))
    ]
    tables["bearing"][4] |= {"axial": "1e8 N/m", "axial_sense": "positive"}
    tables["operation"]["load_case"][0]["speed"]["hollow"] = "0 rpm"
    assert read_case(tables)
    tables["bearing"][4]["axial_sense"] = "negative"
    with pytest.raises(CaseError, match="nothing takes the thrust"):
        read_case(tables)


def test_a_bearing_for_thrust_alone_carries_it():
    tables = pair_tables(helix="15 deg")
    thrust = solve_deflection(read_case(tables)).bearing_force[0, 2]
    tables["bearing"][0].pop("axial")
    sense = "positive" if thrust < 0.0 else "negative"
    alone = {"name": "E", "shaft": "input", "position": "2 mm", "axial": "1e8 N/m", "axial_sense": sense}
    tables["bearing"].append(alone)
    found = solve_deflection(read_case(tables))
    assert found.bearing_force[[0, 4], 2] == pytest.approx([0.0, thrust], rel=1e-9, abs=1e-6)


def test_planets_that_nothing_holds_are_named():
    tables = planetary_tables()
    tables["planetary"][0]["planet"]["bearing"] = {"radial": "1e8 N/m", "axial": "0 N/m"}
    with pytest.raises(CaseError) as caught:
        check_held(read_case(tables))
    assert {one.key for one in caught.value.problems} == {"planetary[0].planet.bearing"}


@pytest.mark.slow
def test_weight_along_the_axis_that_nothing_takes_is_told_at_the_terminal(tmp_path, capsys):
    tables = pair_tables(helix="15 deg")
    tables["bearing"][0]["axial_sense"], tables["bearing"][2]["axial_sense"] = "positive", "negative"
    tables["gravity"] = {"direction": [0.0, 0.0, -1.0]}
    tables["mass"] = [{"shaft": "input", "position": "10 mm", "mass": "200 kg", "inertia": "1 kg m^2"}]
    assert terminal(tables, tmp_path, capsys, "check")[0] == 0
    status, error = terminal(tables, tmp_path, capsys, "run")
    assert status == 3 and "Traceback" not in error
    assert f"[E-CONVERGENCE] {tmp_path / 'box.toml'}:" in error and "bearing[0].axial_sense: " in error
    assert "along its axis" in error and "remedy:" in error


def test_a_load_without_balance_names_a_bearing():
    tables = pair_tables()
    rolling(tables, 2, clearance="40 um")
    rolling(tables, 3, clearance="80 um")
    error = without_balance(read_case(tables), "output", 0, 12.5)
    assert (error.key, error.value) == ("bearing[3].clearance", "0.08 mm")
    assert "12.5 N" in error.message and error.limit and error.remedy
    assert without_balance(read_case(tables), "input", 2, 12.5).key == "bearing"
    soft = without_balance(read_case(tables), "input", 5, 12.5)
    assert soft.key == "shaft[0]" and "less torque" in soft.remedy and "clearance" not in str(soft)


def _references(value, path=()):
    """Places of all texts in tables that name a shaft, a load, or the casing."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _references(part, (*path, key))
    elif isinstance(value, list):
        for number, part in enumerate(value):
            yield from _references(part, (*path, number))
    elif isinstance(value, str) and path[-1] != "name" and path[0] not in ("model", "title", "motions"):
        yield path


@pytest.mark.parametrize(
    "tables", [pair_tables(), set_on_shafts(), random_gearbox(7, 4)], ids=["pair", "set", "random"]
)
def test_no_wrong_name_breaks_the_checks(tables):
    names = {shaft["name"] for shaft in tables["shaft"]} | {load["name"] for load in tables["load"]} | {"casing"}
    count = 0
    for path in _references(tables):
        new = copy.deepcopy(tables)
        place = new
        for key in path[:-1]:
            place = place[key]
        if place[path[-1]] not in names:
            continue
        place[path[-1]], count = "nowhere", count + 1
        with pytest.raises(CaseError) as caught:
            read_case(new)
        assert any(problem.value == "nowhere" for problem in caught.value.problems), path
    assert count > 8


def test_a_floating_shaft_and_one_that_tilts_are_told_together():
    tables = pair_tables()
    del tables["bearing"][0]["axial"], tables["bearing"][3]
    with pytest.raises(CaseError) as error:
        read_case(tables)
    floating, tilting = error.value.problems
    assert floating.key == "shaft[0].name" and "input floats along the axis" in floating.message
    assert tilting.key == "shaft[1].name" and "output against tilting" in tilting.message
    # a bearing that takes tilts holds it
    tables["bearing"][2]["tilt"] = "1e6 N m/rad"
    with pytest.raises(CaseError) as error:
        read_case(tables)
    assert error.value.key == "shaft[0].name"
