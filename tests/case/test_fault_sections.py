"""Faults of teeth in a case file: what belongs together, and places that a tooth has not."""

import re
from pathlib import Path

import numpy as np
import pytest

from femgear.case.fault_sections import FaultSection, PlanetFaultSection, keyed_faults, no_faults
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import CaseError, GeometryError
from femgear.gears.faults import LEFT, RIGHT, BrokenTip, MissingTooth, Spall, Wear, missing_length
from femgear.gears.gear import tooth_thickness
from femgear.stages.static import check_slices
from femgear.study.relief import design_basis
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import check_case

CASES = Path(__file__).parents[2] / "cases"
SPALL = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "42 mm", "length": "0.5 mm", "depth": "40 um"}
CRACK = {"kind": "crack", "tooth": 3, "flank": "left", "depth": "1 mm"}
WEAR = {"kind": "wear", "flank": "left", "depth": "5 um"}


@pytest.fixture(scope="module")
def healthy():
    return read_case(CASES / "planetary_27_40_108.toml")


@pytest.mark.parametrize(
    ("entries", "code", "words"),
    [
        ({"kind": "missing", "tooth": 1, "depth": "1 mm"}, "E-FAULT", "'missing' has no depth"),
        ({"kind": "missing"}, "E-KEY-MISSING", "'missing' needs tooth"),
        ({"kind": "spall", "tooth": 1, "flank": "left"}, "E-KEY-MISSING", "needs diameter and length and depth"),
        ({"kind": "wear", "flank": "left"}, "E-FAULT", "one depth, or as many depths as diameters"),
        (WEAR | {"depths": ["1 um"], "diameters": ["42 mm"]}, "E-FAULT", "one depth"),
        (
            {"kind": "wear", "flank": "left", "depths": ["1 um", "2 um"], "diameters": ["43 mm", "42 mm"]},
            "E-RANGE",
            "ascending",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(entries, code, words):
    with pytest.raises(ValueError) as error:
        FaultSection.model_validate(entries)
    (problem,) = error.value.errors()
    assert problem["ctx"]["error"].code == code and words in str(problem["ctx"]["error"])


def test_flanks_of_a_planet_are_named_by_their_mates():
    with pytest.raises(ValueError, match="sun side"):
        PlanetFaultSection.model_validate(WEAR)


def test_faults_that_leave_no_tooth_are_refused(healthy):
    tip = tooth_thickness(planetary_set(healthy).sun, planetary_set(healthy).sun.tip_radius)
    allowed = with_values(healthy, {"sun.fault": [WEAR | {"depth": f"{0.99e3 * tip:.6f} mm"}]})
    assert len(list(keyed_faults(allowed, planetary_set(healthy)))) == 1
    for depths in ({"depth": f"{1.01e3 * tip:.6f} mm"}, {"depths": ["0 um", "8 mm"], "diameters": ["41 mm", "42 mm"]}):
        worn = with_values(healthy, {"sun.fault": [{"kind": "wear", "flank": "left"} | depths]})
        with pytest.raises(GeometryError, match="the wear leaves no tooth") as caught:
            list(keyed_faults(worn, planetary_set(healthy)))
        assert caught.value.code == "E-FAULT" and "as thick as the tooth is" in (caught.value.limit or "")
    gaps = [{"kind": "missing", "tooth": tooth} for tooth in range(27)]
    some, none = (with_values(healthy, {"sun.fault": gaps[:count]}) for count in (26, 27))
    assert len(list(keyed_faults(some, planetary_set(healthy)))) == 26
    with pytest.raises(GeometryError, match="sun misses all its teeth"):
        list(keyed_faults(none, planetary_set(healthy)))


def test_faults_are_made_of_their_gears(healthy):
    planet = SPALL | {"planet": 2, "flank": "ring side", "diameter": "60 mm"}
    case = with_values(
        healthy,
        {
            "sun.fault": [SPALL, {"kind": "missing", "tooth": 26}],
            "planet.fault": [planet],
            "ring.fault": [{"kind": "broken corner", "tooth": 107, "length": "1 mm"}],
        },
    )
    spall, missing, of_planet, tip = set_deviations(case).faults
    gears = planetary_set(case)
    assert isinstance(spall, Spall) and (spall.gear, spall.tooth, spall.flank) == (0, 3, LEFT)
    assert missing_length([spall], gears, 0, 0.0) == pytest.approx(0.5e-3, rel=1e-12)
    assert isinstance(missing, MissingTooth) and missing.flank is None
    assert (of_planet.gear, of_planet.copy, of_planet.flank) == (1, 1, RIGHT)
    assert isinstance(tip, BrokenTip)
    assert np.hypot(tip.roll, gears.ring.base_radius) == pytest.approx(gears.ring.tip_radius + 1e-3, rel=1e-12)


def test_wear_is_given_over_diameters_or_is_even(healthy):
    worn = {"kind": "wear", "tooth": 2, "flank": "right"}
    points = {"depths": ["0 um", "8 um"], "diameters": ["41 mm", "43 mm"]}
    case = with_values(healthy, {"sun.fault": [worn | points, WEAR]})
    over, even = set_deviations(case).faults
    sun = planetary_set(case).sun
    assert isinstance(over, Wear) and over.flank == RIGHT and even.tooth is None
    middle = np.sqrt(0.0210**2 - sun.base_radius**2)
    low, high = (np.sqrt(r**2 - sun.base_radius**2) for r in (0.0205, 0.0215))
    assert over.removed(middle) == pytest.approx(8e-6 * (middle - low) / (high - low))
    assert even.removed(np.array([0.0, 1.0])) == pytest.approx(5e-6)


@pytest.mark.parametrize(
    ("change", "key", "code"),
    [
        ({"sun.fault": [CRACK | {"depth": "4 mm"}]}, "sun.fault[0].depth", "E-FAULT"),
        ({"sun.fault": [CRACK, CRACK | {"tooth": 4}]}, "sun.fault[1].kind", "E-FAULT"),
        ({"sun.fault": [{"kind": "missing", "tooth": 27}]}, "sun.fault[0].tooth", "E-RANGE"),
        ({"planet.fault": [{"kind": "missing", "tooth": 3, "planet": 4}]}, "planet.fault[0].planet", "E-RANGE"),
        ({"sun.fault": [SPALL | {"diameter": "60 mm"}]}, "sun.fault[0].diameter", "E-FAULT"),
        ({"sun.fault": [{"kind": "broken corner", "tooth": 3, "length": "4 mm"}]}, "sun.fault[0].length", "E-FAULT"),
    ],
)
def test_places_that_no_tooth_has_are_refused_where_they_stand(healthy, change, key, code):
    with pytest.raises(GeometryError) as refused:
        set_deviations(with_values(healthy, change))
    assert (refused.value.code, refused.value.key) == (code, key)


def test_a_fault_without_depth_is_none_and_slices_know_no_cracks(healthy):
    none = with_values(healthy, {"sun.fault": [CRACK | {"depth": "0 mm"}]})
    assert set_deviations(none).faults == () and set_deviations(none).ideal
    sliced = with_values(healthy, {"sun.fault": [CRACK], "static.slices": 9})
    with pytest.raises(CaseError, match="know no cracks"):
        check_slices(sliced, planetary_set(sliced))


def test_studies_of_designs_refuse_faults(healthy):
    case = with_values(healthy, {"sun.fault": [WEAR]})
    with pytest.raises(CaseError, match="no faults of single teeth") as refused:
        design_basis(case)
    assert refused.value.key == "sun.fault[0]"
    no_faults(healthy, "nothing to refuse")


@pytest.mark.parametrize("name", ["nrel_pga", "helical_30_20_70"])
def test_given_mesh_stiffnesses_and_bodies_of_one_period_refuse_faults_of_a_tooth(name):
    case = with_values(read_case(CASES / f"{name}.toml"), {"sun.fault": [{"kind": "missing", "tooth": 3}]})
    with pytest.raises(CaseError) as refused:
        check_case(case)
    assert refused.value.code in ("E-FAULT", "E-PERIODS")


CORNER = {"kind": "broken corner", "tooth": 3, "length": "1 mm"}
GAP = {"kind": "missing", "tooth": 3}


def refusals(healthy, *faults, gear="sun"):
    case = with_values(healthy, {f"{gear}.fault": list(faults)})
    with pytest.raises(GeometryError) as refused:
        set_deviations(case)
    return refused.value.problems


@pytest.mark.parametrize(
    ("changed", "key", "words", "limit"),
    [
        # over the tip by a fifth of a millimetre, and as far below the flank
        ({"diameter": "44.4 mm", "length": "1 mm"}, "length", "over the tip", "up to 0."),
        ({"diameter": "39.6 mm", "length": "1 mm"}, "length", "below the flank", "up to 0."),
        ({"length": "20 mm"}, "length", "below the flank", "the flank is 3.3091 mm long"),
        ({"depth": "40 mm"}, "depth", "leaves no tooth", "as thick as the tooth is"),
    ],
)
def test_pits_that_no_flank_has_room_for_are_refused(healthy, changed, key, words, limit):
    (problem,) = refusals(healthy, SPALL | changed)
    assert (problem.code, problem.key) == ("E-FAULT", f"sun.fault[0].{key}")
    assert words in problem.message and limit in problem.limit and problem.value and problem.remedy and problem.file


def test_a_pit_may_reach_the_ends_of_its_flank(healthy):
    sun = planetary_set(healthy).sun
    arc = (sun.tip_roll**2 - sun.form_roll**2) / (2 * sun.base_radius)
    amid = 2e3 * np.hypot(sun.base_radius, np.sqrt(0.5 * (sun.tip_roll**2 + sun.form_roll**2)))
    whole = SPALL | {"diameter": f"{amid:.12g} mm", "length": f"{1e3 * arc:.12g} mm"}
    (spall,) = set_deviations(with_values(healthy, {"sun.fault": [whole]})).faults
    assert isinstance(spall, Spall)
    assert (spall.low, spall.high) == pytest.approx((sun.form_roll, sun.tip_roll), rel=1e-9)


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        ((GAP, CRACK), "tooth 3 is missing, and has no other fault"),
        ((CORNER, GAP), "tooth 3 is missing, and has no other fault"),
        ((GAP, GAP), "tooth 3 is missing twice"),
        ((CORNER, CORNER | {"length": "0.5 mm"}), "broken off twice"),
        ((CRACK, CRACK | {"flank": "right"}), "a body has one crack"),
        ((WEAR | {"tooth": 3}, GAP), "tooth 3 is missing, and has no other fault"),
        ((CORNER, SPALL | {"diameter": "43 mm", "length": "0.6 mm"}), "where the corner of tooth 3 is broken off"),
        ((SPALL | {"depth": "1.9 mm"}, SPALL | {"flank": "right", "depth": "1.9 mm"}), "leave nothing of tooth 3"),
        ((WEAR | {"depth": "0.5 mm"}, WEAR | {"flank": "right", "depth": "0.5 mm"}), "leave nothing of all its teeth"),
    ],
)
def test_faults_of_one_tooth_that_contradict_are_refused_at_the_later_one(healthy, faults, words):
    (problem,) = refusals(healthy, *faults)
    assert problem.code == "E-FAULT" and words in problem.message
    assert problem.key.startswith("sun.fault[1].") and problem.limit and problem.remedy and problem.file


@pytest.mark.parametrize(
    "faults",
    [
        (SPALL, SPALL | {"diameter": "41 mm"}),
        (SPALL, SPALL | {"depth": "60 um"}),
        (WEAR, SPALL),
        (GAP, WEAR),
        (GAP, GAP | {"tooth": 4}, CRACK | {"tooth": 9}),
        (CORNER, SPALL | {"diameter": "41 mm"}, CRACK),
    ],
)
def test_faults_that_can_be_at_once_are_allowed(healthy, faults):
    assert len(set_deviations(with_values(healthy, {"sun.fault": list(faults)})).faults) == len(faults)


def test_pits_of_internal_teeth_end_at_their_smaller_tip_circle(healthy):
    ring = planetary_set(healthy).ring
    spall = SPALL | {"diameter": f"{2e3 * ring.tip_radius + 0.6:.6f} mm"}
    (over,) = refusals(healthy, spall | {"length": "1.5 mm"}, gear="ring")
    assert "over the tip" in over.message
    (broken,) = refusals(healthy, spall | {"length": "0.2 mm"}, CORNER, gear="ring")
    assert "broken off" in broken.message and "down to" in broken.limit


def test_all_faults_that_cannot_be_are_told_at_once(healthy):
    faults = {
        "sun.fault": [SPALL | {"depth": "40 mm"}, GAP | {"tooth": 40}, CORNER, CORNER],
        "ring.fault": [CORNER | {"length": "4 mm"}],
    }
    with pytest.raises(GeometryError) as refused:
        set_deviations(with_values(healthy, faults))
    keys = [problem.key for problem in refused.value.problems]
    assert keys == ["sun.fault[0].depth", "sun.fault[1].tooth", "sun.fault[3].kind", "ring.fault[0].length"]
    assert "4 problems" in str(refused.value) and str(refused.value).count("remedy") == 4


def test_a_fault_that_cannot_be_still_contradicts_a_missing_tooth(healthy):
    problems = refusals(healthy, SPALL | {"length": "9 mm"}, GAP, CORNER | {"tooth": 5})
    assert [problem.code for problem in problems] == ["E-FAULT"] * 2
    length, both = problems
    assert length.key == "sun.fault[0].length" and "tooth 3 is missing" in both.message
    assert "sun.fault[0]" in both.remedy and "sun.fault[1]" in both.remedy


def test_wear_of_no_depth_anywhere_is_none(healthy):
    points = {"depths": ["0 um", "0 um"], "diameters": ["41 mm", "43 mm"]}
    none = {"kind": "wear", "flank": "left", "tooth": 3} | points
    assert set_deviations(with_values(healthy, {"sun.fault": [none]})).ideal


@pytest.mark.parametrize(
    ("fault", "key"),
    [
        (CRACK | {"depth": "9 mm"}, "depth"),
        (CRACK | {"depth": "0.01 mm"}, "depth"),
        (SPALL | {"length": "9 mm"}, "length"),
        (SPALL | {"diameter": "44.8 mm", "length": "9 mm"}, "length"),
        (SPALL | {"depth": "9 mm"}, "depth"),
        (CORNER | {"length": "9 mm"}, "length"),
    ],
)
@pytest.mark.parametrize("gear", ["sun", "ring"])
def test_the_limit_that_a_refusal_names_may_be_typed(healthy, fault, key, gear):
    ring = (
        {"diameter": f"{float(fault['diameter'][:-3]) + 119.4:g} mm"} if gear == "ring" and "diameter" in fault else {}
    )
    (problem,) = refusals(healthy, fault | ring, gear=gear)
    (limit,) = re.findall(r"([\d.]+) mm(?: or more| at this| about this|, as thick|$)", problem.limit)
    at_most = with_values(healthy, {f"{gear}.fault": [fault | ring | {key: f"{limit} mm"}]})
    if "less than" in problem.limit:
        below = f"{0.9999 * float(limit):.9g} mm"
        at_most = with_values(healthy, {f"{gear}.fault": [fault | ring | {key: below}]})
    assert len(set_deviations(at_most).faults) == 1
