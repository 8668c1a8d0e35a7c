"""What casings are refused for: every fault with its key, all at once."""

import pytest
from casings import casing_tables
from small_gearbox import pair_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.casing_checks import check_casing
from femgear.trains.reading import read_case

INERTIA = {"casing.inertia": "E-RANGE"}
CHANGES = {
    "a plate that is more than flat": (lambda c: c.update(inertia=["0.6 kg m^2", "0.4 kg m^2", "1.1 kg m^2"]), INERTIA),
    "products larger than inertias": (lambda c: c.update(products=["2 kg m^2", "0 kg m^2", "0 kg m^2"]), INERTIA),
    "feet of one name": (lambda c: c["foot"][2].update(name="left front"), {"casing.foot[2].name": "E-DUPLICATE"}),
    "a number that is a name": (
        lambda c: (c["foot"][0].pop("name"), c["foot"][1].update(name="1")),
        {"casing.foot[1].name": "E-DUPLICATE"},
    ),
    "no such bearing": (lambda c: c.update(stands_still=["A", "E"]), {"casing.stands_still[1]": "E-CHOICE"}),
    "no feet": (lambda c: c.update(foot=[]), {"casing.foot": "E-KEY-MISSING"}),
    "no place": (lambda c: c["foot"][1].pop("position"), {"casing.foot[1].position": "E-KEY-MISSING"}),
    "no mass": (lambda c: c.pop("mass"), {"casing.mass": "E-KEY-MISSING"}),
    "two faults": (
        lambda c: c.update(stands_still=["E"], products=["2 kg m^2", "0 kg m^2", "0 kg m^2"]),
        INERTIA | {"casing.stands_still[0]": "E-CHOICE"},
    ),
}


def problems(tables) -> dict[str | None, str]:
    """Codes of the refusals of a case by their keys."""
    with pytest.raises(CaseError) as error:
        read_case(tables)
    return {one.key: one.code for one in error.value.problems or (error.value,)}


@pytest.mark.parametrize("name", CHANGES)
def test_faults_are_refused_where_they_stand(name):
    tables = pair_tables() | {"casing": casing_tables()}
    change, expected = CHANGES[name]
    change(tables["casing"])
    assert problems(tables) == expected


def test_a_casing_does_not_move_where_shafts_only_rotate():
    assert problems(pair_tables() | {"casing": casing_tables(), "motions": "rotation"}) == {"casing": "E-CHOICE"}


def test_a_sensor_on_a_ring_needs_an_elastic_ring_and_an_angle():
    tables = pair_tables()
    tables["sensor"] = [{"name": "top", "ring": "set"}, {"name": "side", "angle": "20 deg"}]
    assert problems(tables) == {
        "casing": "E-KEY-MISSING",
        "sensor[0].ring": "E-CHOICE",
        "sensor[0].angle": "E-KEY-MISSING",
        "sensor[1].angle": "E-CHOICE",
    }


def test_bearings_are_not_called_as_other_seats():
    tables = pair_tables() | {"casing": casing_tables()}
    tables["bearing"][3]["name"] = "output held"
    tables["operation"] = tables["operation"] | {"fixed": ["output"]}
    assert problems(tables) == {"operation.fixed": "E-DUPLICATE"}


def test_a_sensor_far_from_the_casing_is_refused():
    tables = pair_tables() | {"casing": casing_tables()}
    tables["sensor"] = [{"name": "top", "position": ["0 mm", "80 m", "0 mm"], "direction": "y"}]
    assert problems(tables) == {"sensor[0].position": "E-RANGE"}


def test_no_casing_is_no_fault():
    assert list(check_casing(read_case(pair_tables()))) == []
