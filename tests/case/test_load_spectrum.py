"""Load cases of a life: shares, hours, treatments, and what is refused, all at once."""

import copy
import tomllib
from pathlib import Path

import pytest

from femgear.case.load_spectrum import (
    load_case_names,
    required_life,
    running_shares,
    spectrum_notices,
    without_line,
)
from femgear.errors import CaseError
from femgear.stages.life import no_load_cases
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[2] / "cases"
TABLES = tomllib.loads((CASES / "spur_pair.toml").read_text(encoding="utf-8"))
FIRST = {"torque": "300 N m", "speed": "1500 rpm"}
STEEL = {"treatment": "case hardened steel", "hardness": 720}


def tables(*load_cases, steel=STEEL, **operation):
    """Tables of a pair with load cases."""
    changed = copy.deepcopy(TABLES)
    for key in ("treatment", "hardness"):
        del changed["material"][key]
    changed["material"] |= steel
    changed["operation"] |= {"load_case": list(load_cases)} | operation
    return changed


def problems(changed) -> dict[str, CaseError]:
    with pytest.raises(CaseError) as caught:
        read_case(changed)
    assert all(problem.limit or problem.remedy for problem in caught.value.problems)
    return {problem.key: problem for problem in caught.value.problems}


def test_shares_count_by_their_sum_and_hours_ask_for_all_of_them():
    shares = read_case(tables(FIRST | {"share": 0.3333, "name": "a"}, *[FIRST | {"share": 0.3333}] * 2)).operation
    assert running_shares(shares.load_case) == pytest.approx([1 / 3] * 3, rel=1e-12)
    assert load_case_names(shares.load_case) == ["a", "load case 2", "load case 3"] and required_life(shares) is None
    hours = read_case(tables(FIRST | {"hours": 30}, FIRST | {"hours": 90.0})).operation
    assert running_shares(hours.load_case).tolist() == [0.25, 0.75] and required_life(hours) == 120.0
    assert required_life(read_case(tables(FIRST, required_hours=5)).operation) == 5.0


@pytest.mark.parametrize(
    "load_cases, entry",
    [
        ([{"share": 0.5}, {"share": 0.4}], "[0].share"),
        ([{"share": 0.5}, {}], "[1].share"),
        ([{"hours": 10}, {"share": 0.5}], "[1].hours"),
        ([{"hours": 10, "share": 0.5}, {"hours": 10}], "[0].hours"),
        ([{"hours": 0}], "[0].hours"),
        ([{"speed": "0 rpm"}], "[0].speed"),
        ([{"torque": "1e-9 N m"}], "[0].torque"),
        ([{"name": ""}], "[0].name"),
        ([{"name": "a" * 61}], "[0].name"),
        ([{"share": 0.5, "name": "a"}, {"share": 0.5, "name": "a"}], "[1].name"),
        ([{"share": 0.5}, {"share": 0.5, "torqe": "1 N m"}], "[1].torqe"),
    ],
)
def test_load_cases_that_are_none_are_refused_by_their_entries(load_cases, entry):
    assert f"operation.load_case{entry}" in problems(tables(*(FIRST | entries for entries in load_cases)))


def test_what_lives_need_is_refused_together():
    """Shares and pitting, a life of nothing, grades that there are not."""
    changed = tables(FIRST | {"share": 0.6}, FIRST | {"share": 0.6}, steel={})
    changed["strength"] = {"pitting": "limited"}
    changed["material"] |= {"treatment": "grey iron", "hardness": 200}
    assert problems(changed).keys() == {"operation.load_case[0].share", "strength.pitting"}
    assert problems(tables(required_hours=20)).keys() == {"operation.required_hours"}
    assert problems(tables(FIRST, required_hours=0)).keys() == {"operation.required_hours"}
    assert problems(tables(FIRST, steel=STEEL | {"grade": "MX"})).keys() == {"material.grade"}


def test_pitting_is_that_of_materials_that_have_its_line():
    changed = tables(FIRST, steel={"treatment": "nitrided steel", "hardness": 700}) | {
        "strength": {"pitting": "limited"}
    }
    assert problems(changed).keys() == {"strength.pitting"}
    changed["material"] |= STEEL
    assert read_case(changed).strength.pitting == "limited"


def test_gears_without_a_treatment_are_told():
    plain = tables(FIRST, steel={})
    (told,) = spectrum_notices(read_case(plain))
    assert told.code == "W-UNUSED" and "material.treatment" in told.remedy and no_load_cases(read_case(plain))
    plain["gear_1"]["material"] = STEEL
    (told,) = spectrum_notices(read_case(plain))
    assert "gear_2.material.treatment" in told.remedy and without_line(read_case(plain)) == ["gear_2"]
    assert not no_load_cases(read_case(plain)) and not list(spectrum_notices(read_case(tables(FIRST))))


def test_load_cases_of_which_none_has_a_torque_are_told():
    idle = FIRST | {"torque": "0 N m", "share": 0.5}
    (finding,) = spectrum_notices(read_case(tables(idle, idle | {"name": "b"})))
    assert (finding.code, finding.key) == ("W-UNUSED", "operation.load_case") and "torque" in finding.text
    assert not list(spectrum_notices(read_case(tables(idle, FIRST | {"share": 0.5, "name": "b"}))))
