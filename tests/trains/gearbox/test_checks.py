"""What a gearbox is refused for: every fault with its key, all at once."""

import pytest
from small_gearbox import pair_tables, set_on_shafts

from femgear.errors import CaseError
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.reading import read_case

BALL = {"kind": "ball", "rolling_elements": 9, "element_diameter": "9.5 mm", "pitch_diameter": "46 mm"}


def problems(tables) -> dict[str, CaseError]:
    """Refusals of a case by their keys."""
    with pytest.raises(CaseError) as error:
        read_case(tables)
    found = error.value.problems or (error.value,)
    return {one.key: one for one in found}


def _replaced(number: int, **entries):
    """Change of a case: another bearing in the place of one."""

    def change(tables):
        old = tables["bearing"][number]
        tables["bearing"][number] = {"shaft": old["shaft"], "position": old["position"]} | entries

    return change


def _set(tables, **entries) -> None:
    """Put a set of sun and carrier shafts of their own beside the pair."""
    stage = {"name": "set", "sun": "sun", "carrier": "carrier", "gears": {"teeth": [36, 24, 84], "module": "1.5 mm"}}
    stage |= {"sun_mesh": {"stiffness": "3e8 N/m"}, "ring_mesh": {"stiffness": "3e8 N/m"}}
    stage["gears"] |= entries
    tables["shaft"] += [{"name": "sun"}, {"name": "carrier"}]
    tables["planetary"] = [stage]


CHANGES = {
    "shaft[1].name": (lambda t: t["shaft"][1].update(name="input"), "E-DUPLICATE"),
    "bearing[1].name": (lambda t: t["bearing"][1].update(name="A"), "E-DUPLICATE"),
    "bearing[0].shaft": (lambda t: t["bearing"][0].update(shaft="inptu"), "E-CHOICE"),
    "bearing[0].position": (lambda t: t["bearing"][0].pop("position"), "E-KEY-MISSING"),
    "bearing[1].position": (lambda t: t["bearing"][1].update(position="95 mm"), "E-RANGE"),
    "bearing[2].radial": (lambda t: (t["bearing"][2].pop("radial"), t["bearing"][2].pop("axial")), "E-KEY-MISSING"),
    "bearing[0].radial": (lambda t: t["bearing"][0].update(BALL), "E-CHOICE"),
    "bearing[3].pitch_diameter": (
        _replaced(3, kind="ball", rolling_elements=9, element_diameter="9 mm"),
        "E-KEY-MISSING",
    ),
    "bearing[1].rolling_elements": (_replaced(1, **BALL | {"rolling_elements": 40}), "E-RANGE"),
    "bearing[1].outer_position": (
        lambda t: t["bearing"][1].update(outer_shaft="output", outer_position="85 mm"),
        "E-RANGE",
    ),
    "bearing[1].outer_shaft": (
        lambda t: t["bearing"][1].update(outer_shaft="input", outer_position="5 mm"),
        "E-CHOICE",
    ),
    "shaft[0].part[0].inner_diameter": (
        lambda t: t["shaft"][0]["part"][0].update(inner_diameter="30 mm"),
        "E-RANGE",
    ),
    "shaft[0].part[1].outer_diameter": (
        lambda t: t["shaft"][0].update(
            part=[
                {"length": "45 mm", "outer_diameter": "30 mm", "inner_diameter": "20 mm"},
                {"length": "45 mm", "outer_diameter": "18 mm"},
            ]
        ),
        "E-SHAFT",
    ),
    "pair[0].shafts": (lambda t: t["shaft"][1].update(axis=["91 mm", "0 mm"]), "E-CENTRE-DISTANCE"),
    "pair[0].positions": (lambda t: t["pair"][0].update(positions=["30 mm", "60 mm"]), "E-RANGE"),
    "pair[0].teeth": (lambda t: [t["pair"][0].pop(key) for key in ("gears", "mesh")], "E-KEY-MISSING"),
    "pair[0].mesh": (lambda t: t["pair"][0].pop("mesh"), "E-KEY-MISSING"),
    "pair[0].gears.module": (lambda t: t["pair"][0]["gears"].update(radii=["36 mm", "54 mm"]), "E-CHOICE"),
    "operation.output": (lambda t: t["operation"].update(output=["brakes"]), "E-CHOICE"),
    "operation.load_case[0].torque": (
        lambda t: t["operation"]["load_case"][0]["torque"].update(brake="1 N m"),
        "E-CHOICE",
    ),
    "operation.load_case[0].speed": (
        lambda t: t["operation"]["load_case"][0].update(speed={"inputs": "10 rpm"}),
        "E-CHOICE",
    ),
    "gravity.direction": (lambda t: t.update(gravity={"direction": [0.0, 0.0, 0.0]}), "E-RANGE"),
    "bearing[3].clearance": (_replaced(3, **BALL | {"clearance": "2 mm"}), "E-BEARING"),
    "planetary[0].gears.planet_angles": (
        lambda t: _set(t, planets=3, planet_angles=["0 deg", "180 deg"]),
        "E-COUNT",
    ),
    "pair[0].gears.teeth": (
        lambda t: t["pair"][0]["gears"].update(teeth=[36, 24], internal=True),
        "E-TEETH",
    ),
    "operation.first": (lambda t: t["operation"].update(first=2), "E-RANGE"),
}


@pytest.mark.parametrize("key", CHANGES)
def test_every_fault_names_its_entry(key):
    tables = pair_tables()
    change, code = CHANGES[key]
    change(tables)
    found = problems(tables)
    assert key in found
    assert found[key].code == code


def test_all_faults_come_at_once():
    tables = pair_tables()
    for key in ("bearing[1].position", "pair[0].shafts", "shaft[0].part[0].inner_diameter"):
        CHANGES[key][0](tables)
    assert {"bearing[1].position", "pair[0].shafts", "shaft[0].part[0].inner_diameter"} <= problems(tables).keys()


def test_near_names_are_offered():
    tables = pair_tables()
    tables["load"][0]["shaft"] = "imput"
    assert "did you mean input?" in str(problems(tables)["load[0].shaft"])


def test_the_right_outer_position_is_offered():
    tables = pair_tables()
    tables["shaft"].append(
        {"name": "hollow", "start": "20 mm", "part": [{"length": "80 mm", "outer_diameter": "90 mm"}]}
    )
    tables["bearing"][1] |= {"outer_shaft": "hollow", "outer_position": "10 mm"}
    assert '"65 mm"' in str(problems(tables)["bearing[1].outer_position"])
    # the inner ring sits before the hollow shaft begins, and nowhere beside one that begins behind
    tables["bearing"][1]["position"] = "5 mm"
    remedy = problems(tables)["bearing[1].outer_position"].remedy
    assert remedy == 'at z = 20 mm both are: position = "20 mm", outer_position = "0 mm"'
    tables["shaft"][2]["start"] = "200 mm"
    assert "nowhere beside one another" in problems(tables)["bearing[1].outer_position"].remedy
    tables["bearing"][1] |= {"outer_shaft": "output"}
    assert problems(tables)["bearing[1].outer_position"].remedy.endswith("give output the axis of input")


def test_refusals_speak_the_words_of_the_file():
    tables = pair_tables()
    CHANGES["bearing[3].clearance"][0](tables)
    tables["bearing"][3]["clearance"] = "1 mm"
    tables["load"][1]["name"] = "motor"
    with pytest.raises(CaseError) as error:
        read_case(tables)
    told = {(one.code, one.key): one for one in error.value.problems}
    twice = told["E-DUPLICATE", "load[1].name"]
    assert "load[0] already" in twice.message and "every load, bearing and mass" in twice.remedy
    assert told["E-BEARING", "bearing[3].clearance"].value == "1 mm"
    assert told["E-CHOICE", "operation.output"].limit == "motor"


def test_an_output_that_is_missing_is_told_in_newton_metres():
    tables = pair_tables()
    tables["operation"]["output"] = []
    assert problems(tables)["operation.output"].value == "100 N m"


def test_shares_are_the_running_time_in_all_and_limited_pitting_is_that_of_materials_that_have_it():
    tables = pair_tables(teeth=True)
    first = tables["operation"]["load_case"][0]
    tables["pair"][0]["teeth"]["material"] |= {"treatment": "nitrided steel", "hardness": 700}
    tables["strength"] = {"pitting": "limited"}
    for share in (0.2, 0.4):
        tables["operation"]["load_case"] = [first | {"name": "a", "share": 0.7}, first | {"name": "b", "share": share}]
        assert {"operation.load_case[0].share", "strength.pitting"} <= problems(tables).keys()


def test_planets_may_be_listed_in_any_order():
    tables = pair_tables()
    _set(tables, planet_angles=["0 deg", "240 deg", "120 deg"])
    # beside shafts that nothing holds or turns
    assert not any(key.startswith("planetary") for key in problems(tables))


def test_two_outputs_on_one_shaft_are_refused_where_they_stand():
    tables = pair_tables()
    tables["load"].append({"name": "brake 2", "shaft": "output", "position": "80 mm"})
    tables["operation"]["output"] = ["brake", "brake 2"]
    (error,) = problems(tables).values()
    assert (error.code, error.key, error.value) == ("E-DUPLICATE", "operation.output", "brake, brake 2")
    assert "brake 2" in error.remedy
    tables["operation"]["output"] = ["brake", "brake"]
    assert "twice" in problems(tables)["operation.output"].message
    # one of them as a load with a torque of its own
    tables["operation"]["output"] = ["brake"]
    tables["operation"]["load_case"][0]["torque"]["brake 2"] = "-20 N m"
    assert gearbox_flow(read_case(tables)).port_torque["brake"] == pytest.approx(100.0 * 36 / 24 + 20.0)


@pytest.mark.parametrize(
    ("planets", "code"),
    [(5, "E-ASSEMBLY"), (7, "E-NEIGHBOURS")],
)
def test_planets_with_teeth_that_do_not_assemble_or_touch_are_refused(planets, code):
    tables = set_on_shafts()
    tables["planetary"][0]["teeth"]["set"]["planets"] = planets
    (error,) = problems(tables).values()
    assert (error.code, error.key) == (code, "planetary[0].teeth.set.planets")
    assert error.remedy


def test_names_and_places_are_judged_beside_entries_that_cannot_be_read():
    tables = pair_tables()
    for key in ("bearing[0].shaft", "bearing[1].position", "pair[0].shafts", "operation.output"):
        CHANGES[key][0](tables)
    tables["operation"]["load_case"][0]["torque"]["motor"] = "50 N"
    tables["bearing"][2]["radail"] = "1 N/m"
    found = problems(tables)
    assert found["operation.load_case[0].torque.motor"].code == "E-UNIT"
    assert found["bearing[2].radail"].code == "E-KEY-UNKNOWN"
    assert found.keys() == {
        "operation.load_case[0].torque.motor",
        "bearing[2].radail",
        "bearing[0].shaft",
        "bearing[1].position",
        "pair[0].shafts",
        "operation.output",
    }


@pytest.mark.parametrize(
    "spoil",
    [
        lambda t: t["shaft"][1].update(axis=["90 N", "0 mm"]),
        lambda t: t["shaft"][1]["part"][0].pop("length"),
        lambda t: t["pair"][0].update(positions=["30 mm", "3 s"]),
        lambda t: t["pair"][0]["gears"].update(module="3 s"),
        lambda t: t["bearing"][0].update(position=5),
        lambda t: t["bearing"][2].update(radial="1 N", axial="1 N"),
        lambda t: t["operation"]["load_case"][0].pop("torque"),
        lambda t: t.update(shaft="two"),
    ],
)
def test_what_rests_on_an_entry_that_cannot_be_read_is_not_judged(spoil):
    tables = pair_tables()
    spoil(tables)
    with pytest.raises(CaseError) as error:
        read_case(tables)
    assert {one.code for one in error.value.problems or (error.value,)} <= {"E-UNIT", "E-KEY-MISSING", "E-TYPE"}
    assert len(error.value.problems) <= 2


def test_a_name_is_judged_beside_a_shaft_without_length():
    tables = pair_tables()
    del tables["shaft"][1]["part"][0]["length"]
    CHANGES["bearing[0].shaft"][0](tables)
    # its places are not
    CHANGES["bearing[1].position"][0](tables)
    assert problems(tables).keys() == {"shaft[1].part[0].length", "bearing[0].shaft"}


@pytest.mark.parametrize(
    ("entries", "key", "value"),
    [
        ({"clearance": "-5 um", "radial": "2e8 N/m"}, "bearing[1].clearance", "-0.005 mm"),
        ({"clearance": "5 um", "radial": "rigid"}, "bearing[1].radial", "rigid"),
        ({"clearance": "5 um", "tilt": "1e5 N m/rad"}, "bearing[1].radial", "none"),
    ],
)
def test_play_of_springs_needs_springs(entries, key, value):
    tables = pair_tables()
    _replaced(1, **entries)(tables)
    error = problems(tables)[key]
    assert (error.code, error.value) == ("E-BEARING", value) and error.remedy


@pytest.mark.parametrize(("place", "refused"), [("47 mm", False), ("48 mm", True)])
def test_planets_beside_their_sun_do_not_mesh(place, refused):
    tables = set_on_shafts()
    # sun at 0 mm, both 18 mm wide
    tables["planetary"][0]["carrier_position"] = place
    if refused:
        error = problems(tables)["planetary[0].sun_position"]
        assert (error.code, error.limit) == ("E-RANGE", "less than 18 mm apart")
    else:
        read_case(tables)
