"""Mistakes and effects of entries in the case file of a pair."""

from pathlib import Path

import pytest

from femgear.errors import FemgearError
from femgear.stages.static import solve_static
from femgear.trains.pair.stages import PAIR
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import check_case

CASE = Path(__file__).parents[3] / "cases" / "spur_pair.toml"
INTERNAL = {
    "gear_2.teeth": 60,
    "gear_2.bore_radius": None,
    "gear_2.outer_radius": "100 mm",
    "gear_2.cutter_teeth": 30,
    "set.centre_distance": "54 mm",
    "gear_1.profile_shift": 0.0,
    "gear_1.tip_diameter": "78 mm",
    "gear_2.tip_diameter": "175 mm",
}
"""Twice those of the case [mm]."""


def pair_case(changes=None):
    return with_values(read_case(CASE), {"static.positions": 8, **(changes or {})})


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"set.centre_distance": "80 mm"}, "E-CENTRE-DISTANCE", "set.centre_distance"),
        ({**INTERNAL, "gear_1.teeth": 62, "gear_1.tip_diameter": None}, "E-RANGE", "gear_2.teeth"),
        (
            {**INTERNAL, "gear_1.teeth": 55, "gear_1.tip_diameter": None, "set.centre_distance": "7.5 mm"},
            "E-INTERFERENCE",
            "gear_2.teeth",
        ),
        ({"gear_1.bore_radius": "34 mm"}, "E-RIM", "gear_1.bore_radius"),
        ({"gear_2.profile_shift": 0.4}, "E-BACKLASH", "gear_1.profile_shift"),
        ({"gear_1.profile_shift": None}, "E-KEY-MISSING", "gear_1.profile_shift"),
        ({"gear_2.outer_radius": "70 mm"}, "E-CHOICE", "gear_2.bore_radius"),
        ({"gear_2.cutter_teeth": 30}, "E-CHOICE", "gear_2.cutter_teeth"),
        ({"static.members": "elastic"}, "E-CHOICE", "static.members"),
        ({"operation.torque": "1e-8 N m"}, "E-RANGE", "operation.torque"),
        (
            {"gear_1.modifications": [{"kind": "lead crowning", "amount": "5 um"}]},
            "E-SLICES",
            "gear_1.modifications[0]",
        ),
        ({"gear_2.errors": {"pitch": ["1 um", "-1 um"]}}, "E-COUNT", "gear_2.errors.pitch"),
    ],
)
def test_refusals_name_the_entries_of_the_file(changes, code, key):
    with pytest.raises(FemgearError) as found:
        check_case(pair_case(changes))
    problems = getattr(found.value, "problems", ()) or (found.value,)
    assert (code, key) in [(one.code, one.key) for one in problems]


def test_without_torque_nothing_touches():
    data = solve_static(pair_case({"operation.torque": "0 N m"})).dataset()
    assert not data.mesh_force.values.any() and data.sizes["mesh"] == 1


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"operation.torque": "0 N m"}, "without torque"),
        ({"gear_1.errors": {"runout_amplitude": "9 um"}}, "mesh periods"),
        ({}, None),
    ],
)
def test_speeds_without_effect_are_told(changes, why):
    found = PAIR.warnings(pair_case({**changes, "operation.speeds": ["100 rpm"]}))
    found = [one for one in found if one.key == "operation.speeds"]
    assert [one.code for one in found] == ["W-UNUSED"] * (why is not None)
    assert all(why in one.text for one in found)
