"""Rigid bodies without mass, couplings and run-ups that are refused, and those that are not."""

import pytest
from small_gearbox import pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.entry_checks import check_shafts_have_mass
from femgear.trains.reading import read_case
from femgear.trains.registry import check_case


def problems(tables) -> dict[str, CaseError]:
    """Refusals of a case by their keys; none of one that is read."""
    try:
        read_case(tables)
    except CaseError as error:
        return {one.key: one for one in error.problems or (error,)}
    return {}


def _body(tables, **entries) -> None:
    """Make the input shaft one rigid body whose seats are at its centre, in the plane of the gears."""
    tables["shaft"][0] = {"name": "input", "start": "30 mm"}
    tables["bearing"][:2] = [
        {"name": "A", "shaft": "input", "radial": "2e8 N/m", "axial": "1e8 N/m", "tilt": "1e6 N m/rad"}
    ]
    tables["pair"][0]["positions"] = ["0 mm", "30 mm"]
    del tables["load"][0]["position"]
    tables |= entries


def test_a_rigid_body_needs_a_mass():
    tables = pair_tables()
    _body(tables)
    (error,) = problems(tables).values()
    assert (error.code, error.key) == ("E-KEY-MISSING", "shaft[0].part")
    assert "input" in error.message and "[[mass]]" in error.remedy
    # beside what is wrong elsewhere
    tables["gravity"] = {"direction": [0.0, 0.0, 0.0]}
    assert {"shaft[0].part", "gravity.direction"} <= problems(tables).keys()


@pytest.mark.parametrize(
    "entries",
    [
        {"mass": [{"shaft": "input", "mass": "2 kg", "inertia": "1e-3 kg m^2"}]},
        # at a place of the body beside its centre
        {"mass": [{"shaft": "input", "position": "5 mm", "mass": "2 kg", "inertia": "1e-3 kg m^2"}]},
    ],
)
def test_a_mass_makes_it_one(entries):
    tables = pair_tables()
    _body(tables, **entries)
    assert not problems(tables)


def test_gears_with_teeth_are_its_mass():
    tables = pair_tables(teeth=True)
    _body(tables)
    assert not problems(tables)


@pytest.mark.parametrize(
    ("bearing", "refused"), [(None, False), ({"radial": "3e8 N/m"}, True), ({"tilt": "1e6 N m/rad"}, True)]
)
def test_planets_on_stiff_pins_are_the_mass_of_their_carrier(bearing, refused):
    tables = planetary_tables()
    del tables["mass"][1]
    if bearing:
        tables["planetary"][0]["planet"]["bearing"] = bearing
    assert ("shaft[1].part" in problems(tables)) is refused


@pytest.mark.parametrize(
    ("motions", "entries", "refused"),
    [
        ("rotation", {}, False),
        ("space", {}, True),
        ("plane", {"radial": "rigid"}, False),
        ("space", {"radial": "rigid", "axial": "rigid", "bending": "rigid"}, False),
    ],
)
def test_a_rigid_coupling_shares_the_mass(motions, entries, refused):
    tables = pair_tables() | {"motions": motions}
    tables["shaft"].append({"name": "flange"})
    tables["bearing"].append({"shaft": "flange", "radial": "1e8 N/m", "axial": "1e8 N/m", "tilt": "1e6 N m/rad"})
    tables["coupling"] = [{"between": ["flange", "input"], "positions": ["0 mm", "0 mm"]} | entries]
    assert ("shaft[2].part" in problems(tables)) is refused


def test_couplings_join_two_shafts_on_one_axis():
    tables = pair_tables()
    tables["coupling"] = [{"name": "loop", "between": ["input", "input"], "positions": ["1 mm", "2 mm"]}]
    (error,) = problems(tables).values()
    assert (error.code, error.key, error.value) == ("E-CHOICE", "coupling[0].between", "input")
    tables["coupling"][0] |= {"between": ["input", "output"], "transmits": False, "torsion": "10 N m/rad"}
    (error,) = problems(tables).values()
    assert (error.code, error.key) == ("E-CENTRE-DISTANCE", "coupling[0].between")
    assert "coupling loop" in error.message and "90 mm apart" in error.value
    # axes that stand still are no matter
    assert not problems(tables | {"motions": "rotation"})


def test_a_run_up_has_several_speeds():
    tables = pair_tables() | {"runup": {"from": "900 rpm", "to": "900 rpm", "count": 4}}
    (error,) = problems(tables).values()
    assert (error.code, error.key, error.value) == ("E-RANGE", "runup.to", "900 rpm, 4 times")
    tables["runup"]["count"] = 1
    assert not problems(tables)


def test_shafts_of_no_density_have_no_modes():
    tables = pair_tables()
    check_shafts_have_mass(read_case(tables))
    tables["material"] = {"density": "0 kg/m^3"}
    with pytest.raises(CaseError) as refused:
        check_case(read_case(tables), only="modes")
    assert (refused.value.code, refused.value.key) == ("E-MASS", "material.density")
    check_case(read_case(tables), only="deflection")
