"""Contents of the files of a gearbox, and what they say against themselves."""

import math
import re

import numpy as np
import pytest
from casings import casing_tables
from gearbox_equivalents import elastic_set_tables
from small_gearbox import pair_tables, planetary_tables

from femgear.case.gear_set import planetary_set
from femgear.findings import Finding
from femgear.trains.gearbox.case_file import teeth_of
from femgear.trains.gearbox.results import (
    deflection_warnings,
    describe_deflection,
    gearbox_modes_warnings,
    gearbox_warnings,
)
from femgear.trains.gearbox.stages import solve_box_modes, solve_deflections
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

BALL = {"kind": "ball", "rolling_elements": 9, "element_diameter": "9.5 mm", "pitch_diameter": "46 mm"}


def codes(findings) -> list[str]:
    return [one.code for one in findings]


def test_lives_are_those_of_bearings_with_a_rating():
    tables = pair_tables()
    tables["bearing"][0] = {"name": "A", "shaft": "input", "position": "5 mm", "dynamic_rating": "19.5 kN"} | BALL
    data = solve_deflections(read_case(tables)).contents()
    lives = data["rating_life"].values[0]
    radial = data["radial_force"].values[0, 0]
    # L10 = (C/P)^3 million turns
    assert lives[0] == pytest.approx((19500.0 / radial) ** 3 * 1e6 / (1000.0 * 60.0), rel=1e-6)
    assert np.isnan(lives[1:]).all()


def test_a_mesh_that_carries_on_a_part_of_its_width_is_told():
    tables = pair_tables()
    tables["shaft"][0]["part"][0]["outer_diameter"] = "12 mm"
    tables["pair"][0]["positions"] = ["12 mm", "12 mm"]
    tables["load"][0]["force"] = ["0 N", "900 N", "0 N"]  # a belt that bends the shaft
    tables["operation"]["load_case"][0]["torque"]["motor"] = "5 N m"
    result = solve_deflections(read_case(tables))
    found = list(deflection_warnings(result.contents()))
    assert codes(found) == ["W-FACE-LOAD"]


def test_passes_that_do_not_suffice_are_told():
    tables = pair_tables(teeth=True)
    tables["deflection"] = {"passes": 1, "tolerance": 1e-9}
    result = solve_deflections(read_case(tables))
    assert not result.converged
    assert "W-PASSES" in codes(deflection_warnings(result.contents()))


def test_supports_of_the_teeth_have_no_effect():
    tables = pair_tables(teeth=True)
    tables["pair"][0]["teeth"]["gear_1"]["bearing_stiffness"] = "1e8 N/m"
    (finding,) = gearbox_warnings(read_case(tables))
    assert isinstance(finding, Finding)
    assert finding.code == "W-UNUSED"
    assert "gear_1.bearing_stiffness" in finding.text


def test_an_elastic_ring_needs_its_foundation():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    stage = tables["planetary"][0]
    stage["teeth"]["ring"]["foundation_radial"] = "1e10 N/m^3"
    for elastic in (True, False):
        stage["elastic_ring"] = elastic
        unused = [one.text for one in gearbox_warnings(read_case(tables)) if one.code == "W-UNUSED"]
        assert any("ring.foundation_radial" in text for text in unused) != elastic


def test_thin_rims_of_teeth_are_told():
    tables = pair_tables(teeth=True)
    tables["pair"][0]["teeth"]["gear_1"]["bore_radius"] = "30 mm"
    (finding,) = gearbox_warnings(read_case(tables))
    assert (finding.code, finding.key) == ("W-RIM", "pair[0].teeth.gear_1.bore_radius")


def test_an_overlap_that_alone_keeps_teeth_in_contact_is_a_doubt_and_no_refusal():
    """A transverse contact ratio below one of helical teeth, whose overlap ratio makes the whole larger than one."""
    tips = {"pair[0].teeth.gear_1.tip_diameter": "41.3 mm", "pair[0].teeth.gear_2.tip_diameter": "116.3 mm"}
    short = with_values(read_case("cases/e_axle.toml"), tips)
    gears = planetary_set(teeth_of(short.pair[0]))
    assert gears.kinds[0].contact_ratio < 1.0
    (finding,) = [finding for finding in gearbox_warnings(short) if finding.code == "W-CONTACT-RATIO"]
    assert (finding.severity, finding.key) == ("doubt", "pair[0].teeth.set.centre_distance")


def test_modes_and_their_parts_are_in_the_file():
    case = read_case(pair_tables())
    solved = solve_box_modes(case, solve_deflections(case))
    with pytest.warns(DeprecationWarning, match="gearbox_modes"):
        assert solved.found is solved.gearbox_modes
    data = solved.contents()
    assert data["strain"].dims == ("part", "mode")
    assert data.attrs["reference"] == "input"
    assert data["order"].values[list(data["line"].values).index("stage mesh")] == pytest.approx(24.0)


def test_modes_below_the_rounding_of_the_stiffest_part_are_told():
    tables = pair_tables() | {"casing": casing_tables()}
    case = read_case(tables)
    assert not list(gearbox_modes_warnings(solve_box_modes(case, solve_deflections(case)).contents()))
    tables["casing"]["mass"] = "1e8 kg"  # swings at 0.3 Hz
    case = read_case(tables)
    (finding,) = gearbox_modes_warnings(solve_box_modes(case, solve_deflections(case)).contents())
    assert finding.code == "W-FREE"
    assert "casing" in finding.text


def test_teeth_without_contact_have_the_stiffness_of_the_standard():
    tables = pair_tables(teeth=True)
    tables["deflection"] = {"contact": False}
    (finding,) = gearbox_warnings(read_case(tables))
    assert finding.code == "W-STIFFNESS"


@pytest.mark.slow
def test_estimated_bearings_show_the_range_that_they_make():
    tables = pair_tables(teeth=True)
    tables["bearing"][0]["estimated"] = True
    result = solve_deflections(read_case(tables))
    data = result.contents()
    assert data["estimate_factor"].values.tolist() == [0.5, 2.0]
    soft, stiff = data["estimate_misalignment"].values[:, 0]
    own = data["mesh_misalignment"].values[0, 0]
    # a softer bearing beside the gear moves its misalignment one way, a stiffer one the other way
    assert (soft - own) * (stiff - own) < 0.0
    assert describe_deflection(data)[0].rows[0][2].endswith(")")


def test_load_cases_of_which_none_has_a_torque_are_told():
    tables = pair_tables(teeth=True)
    for load_case in tables["operation"]["load_case"]:
        load_case["torque"] = {}
    assert codes(gearbox_warnings(read_case(tables))) == ["W-LOAD"]


def test_motions_that_are_not_small_are_told():
    tables = pair_tables()
    tables["operation"]["load_case"][0]["torque"]["motor"] = "1e8 N m"
    found = list(deflection_warnings(solve_deflections(read_case(tables)).contents()))
    # the flanks, and the shafts
    assert codes(found) == ["W-DEFLECTION", "W-DEFLECTION"]
    assert {one.severity for one in found} == {"fault"}
    assert re.match(r"(input|output), [\d.]+ mm from its left end( \(.+\))? tilts by", found[1].text)


def test_flanks_that_approach_too_far_are_told_where_nothing_tilts():
    tables = pair_tables() | {"motions": "rotation"}
    tables["operation"]["load_case"][0]["torque"]["motor"] = "2e4 N m"
    data = solve_deflections(read_case(tables)).contents()
    (found,) = deflection_warnings(data)
    assert (found.code, found.severity) == ("W-DEFLECTION", "doubt") and "base pitch" in found.text
    pitch = math.pi * 3e-3 * math.cos(math.radians(20.0))
    approach = 2e4 / (0.036 * math.cos(math.radians(20.0))) / 4e8
    assert data["relative_approach"].values[0, 0] == pytest.approx(approach / pitch, rel=1e-9)


def test_a_mesh_without_load_carries_on_no_part_of_its_width():
    tables = pair_tables()
    tables["operation"]["load_case"][0]["torque"]["motor"] = "0 N m"
    assert not list(deflection_warnings(solve_deflections(read_case(tables)).contents()))


def test_planets_that_do_not_assemble_are_told():
    tables = pair_tables()
    tables["motions"] = "plane"
    tables["shaft"] += [{"name": "sun"}, {"name": "carrier"}]
    tables["mass"] = [{"shaft": name, "mass": "1 kg", "inertia": "1e-3 kg m^2"} for name in ("sun", "carrier")]
    tables["operation"]["load_case"][0]["speed"]["sun"] = "0 rpm"
    tables["planetary"] = [
        {
            "name": "set",
            "sun": "sun",
            "carrier": "carrier",
            "gears": {"teeth": [36, 24, 84], "module": "1.5 mm", "planets": 7},
            "sun_mesh": {"stiffness": "3e8 N/m"},
            "ring_mesh": {"stiffness": "3e8 N/m"},
        }
    ]
    findings = list(gearbox_warnings(read_case(tables)))
    # 120 teeth over 7 planets; and 2 x 45 mm sin(180 deg / 7) less two tip radii of 19.5 mm
    assert [one.code for one in findings] == ["W-TEETH", "W-NEIGHBOURS"]
    assert "(z_s + z_r)/N = 17.1429" in findings[0].text and "nearest that fit" in findings[0].remedy
    # 120 teeth over 3 to 6 planets are whole, and 8 of them have no room
    assert findings[0].remedy.startswith("take planets = 3 or 4 or 5 or 6, which")
    assert 'planet_angles = ["0 deg", "51 deg", "102 deg", "153 deg", ' in findings[0].remedy
    assert "0.04954 mm apart" in findings[1].text
    tables["planetary"][0]["gears"]["planets"] = 4
    assert not list(gearbox_warnings(read_case(tables)))
    tables["planetary"][0]["gears"]["planets"] = 8
    (overlap,) = gearbox_warnings(read_case(tables))
    assert (overlap.code, overlap.severity) == ("W-NEIGHBOURS", "fault") and "pitch circles" in overlap.text


def test_planets_that_carry_nothing_are_named():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml") | {"deflection": {}}
    tables["planetary"][0] |= {"elastic_ring": False}
    teeth = tables["planetary"][0]["teeth"]
    teeth["set"]["pin_errors"] = [{"planet": 2, "tangential": "-60 um"}]
    teeth["static"] = {"positions": 12}
    tables["operation"]["load_case"][0]["torque"] = {"motor": "10 N m"}
    data = solve_deflections(read_case(tables)).contents()
    assert data["planet_load_factor"].values == pytest.approx(np.array([[3.0]]), rel=1e-9)
    (text,) = (one.text for one in deflection_warnings(data) if one.code == "W-OPEN")
    assert text == "set sun-planet 1, set sun-planet 3 carry nothing in load case nominal"


def test_no_damping_is_a_doubt():
    assert codes(gearbox_warnings(read_case(pair_tables() | {"modes": {"damping_ratio": 0.0}}))) == ["W-DAMPING"]


def test_weight_alone_shares_no_load():
    tables = planetary_tables() | {"gravity": {}}
    tables["operation"]["load_case"][0]["torque"] = dict.fromkeys(
        tables["operation"]["load_case"][0]["torque"], "0 N m"
    )
    assert np.isnan(solve_deflections(read_case(tables)).dataset()["planet_load_factor"]).all()
