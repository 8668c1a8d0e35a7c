"""Materials and face widths of single gears in case files: what they decide, and what they do not go with."""

from pathlib import Path

import pytest
from steels import NO_STEELS

from femgear.case.estimates import estimates
from femgear.case.gear_set import materials_of, planetary_set, set_deviations
from femgear.case.sections import face_width, gear_material
from femgear.errors import CaseError
from femgear.gears.deviations import lead_separation
from femgear.report.tables import Marks
from femgear.stages.static_results import describe_set, width_warnings
from femgear.stages.strength import nominal_stresses
from femgear.trains.elastic.results import _safeties
from femgear.trains.reading import read_case, with_value, with_values

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(scope="module")
def case():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), NO_STEELS)


@pytest.fixture(scope="module")
def pair():
    return read_case(CASES / "spur_pair.toml")


def test_a_gear_has_what_it_gives_and_else_what_all_have(case):
    other = with_values(case, {"ring.material.youngs_modulus": "110 GPa", "material.root_stress_limit": "461 MPa"})
    assert [one.youngs_modulus for one in materials_of(other)] == [206e9, 206e9, 110e9]
    ring = gear_material(other, "ring")
    assert (ring.poisson_ratio, ring.root_stress_limit) == (0.3, 461e6)
    assert materials_of(case) == (materials_of(case)[0],) * 3


def test_widths_of_all_gears_are_that_of_the_set(case, pair):
    own = {f"{name}.face_width": "25 mm" for name in case.gear_names}
    assert planetary_set(with_values(case, own | {"set.face_width": None})) == planetary_set(case)
    wider = with_value(pair, "gear_2.face_width", f"{1.25 * pair.set.face_width!r} m")
    assert face_width(wider, "gear_2") == pytest.approx(1.25 * pair.set.face_width)
    assert planetary_set(wider).face_width == pair.set.face_width
    for broken in (case, pair):
        with pytest.raises(CaseError) as refused:
            with_value(broken, "set.face_width", None)
        assert (refused.value.code, refused.value.key) == ("E-KEY-MISSING", "set.face_width")


@pytest.mark.parametrize("key", ["static.slices", "static.back_flanks"])
def test_one_width_of_both_meshes_where_contact_takes_one(case, key):
    value = 25 if key.endswith("slices") else True
    different = {"planet.face_width": "30 mm", "sun.face_width": "28 mm", key: value}
    with pytest.raises(CaseError) as refused:
        with_values(case, different)
    assert (refused.value.code, refused.value.key) == ("E-CHOICE", key)
    assert 'planet.face_width = "25 mm"' in refused.value.remedy
    with_values(case, different | {"planet.face_width": "25 mm"})


def test_estimates_follow_density_modulus_and_width(case):
    other = with_values(
        case,
        {
            "planet.material.density": "3925 kg/m^3",
            "ring.material.youngs_modulus": "103 GPa",
            "sun.face_width": "50 mm",
        },
    )
    one, two = estimates(case), estimates(other)
    ratio = {key: two[key].value / one[key].value for key in one}
    assert ratio["planet.mass"] == pytest.approx(0.5) and ratio["sun.inertia"] == pytest.approx(2.0)
    assert ratio["carrier.mass"] == pytest.approx(1.0)
    # E = 2 E1 E2 / (E1 + E2): two thirds of steel with one gear half as stiff
    assert ratio["ring.foundation_radial"] == pytest.approx(2 / 3)
    assert ratio["sun.support_stiffness"] == pytest.approx(1.0)
    assert ratio["planet.bearing_stiffness"] == pytest.approx(5 / 6)


def test_safeties_are_those_of_every_gear(case):
    """sigma_Flim/sigma_Hlim of a case-hardened sun and planets, and of a quenched ring, ISO 6336-5."""
    strong = {"material.root_stress_limit": "461 MPa", "material.contact_stress_limit": "1500 MPa"}
    weak = {"ring.material.root_stress_limit": "306 MPa", "ring.material.contact_stress_limit": "740 MPa"}
    tips = {"sun.tip_diameter": "45.08043 mm", "planet.tip_diameter": "63 mm"}
    other = with_values(case, strong | weak | tips)
    stresses = nominal_stresses(planetary_set(other), 100.0, materials_of(other))
    notes: list[str] = []
    rows = dict(_safeties(other, {}, notes, Marks(()), ()))
    sun_root = 2 * 461e6 / stresses.root[0, 0]
    assert rows["safety S_F, ISO 6336-3:2019"].startswith(f"sun {sun_root:.2f}, planet, sun side")
    sun, sun_side, ring_side, ring = (
        float(one.split()[-1]) for one in rows["safety S_H, ISO 6336-2:2019"].split(", ") if one[-1].isdigit()
    )
    single = (1500e6 / (value * stresses.contact[0]) for value in (sun, sun_side))
    assert max(single) == pytest.approx(1500e6 / (2.25 * stresses.contact[0]), rel=0.007)
    assert ring == pytest.approx(740e6 / stresses.contact[1], abs=0.005)
    assert ring_side < 1500.0 / 740.0 * ring  # Z_B of the planet; Z_D of an internal gear is 1
    assert any("306 MPa (ring)" in note for note in notes)
    alike = dict(_safeties(with_values(case, strong | tips), {}, notes, Marks(()), ()))
    assert alike["safety S_H, ISO 6336-2:2019"].startswith(f"sun-planet {min(sun, sun_side):.2f}, planet-ring")


def test_some_limits_give_some_safeties(case):
    other, notes = with_value(case, "ring.material.root_stress_limit", "306 MPa"), list[str]()
    rows = dict(_safeties(other, {}, notes, Marks(()), ()))
    root = nominal_stresses(planetary_set(other), 100.0, materials_of(other)).root[1, 1]
    found = f"sun -, planet, sun side -, planet, ring side -, ring {2 * 306e6 / root:.2f}"
    assert rows["safety S_F, ISO 6336-3:2019"] == found and "S_H" not in " ".join(rows)
    lacking = "sun.material.root_stress_limit, planet.material.root_stress_limit, material.contact_stress_limit"
    assert f"give {lacking} to get all safeties" in notes


def test_check_shows_materials_and_widths_where_they_differ(case):
    assert not [block for block in describe_set(case) if block.title == "Materials"]
    other = with_values(case, {"ring.material.youngs_modulus": "110 GPa", "planet.face_width": "27 mm"})
    (block,) = [block for block in describe_set(other) if block.title == "Materials"]
    assert [row[:3] for row in block.rows] == [
        ("sun", "25", "206"),
        ("planet", "27", "206"),
        ("ring", "25", "110"),
    ]


def test_gears_wider_than_their_mates_are_said(case):
    assert not list(width_warnings(case))
    (found,) = width_warnings(with_value(case, "planet.face_width", "27 mm"))
    assert (found.code, found.key, found.severity) == ("W-WIDTHS", "planet.face_width", "note")
    assert "planet (2 mm)" in found.text and "mirror planes" not in found.text
    sliced = {"planet.face_width": "27 mm", "static.slices": 25}
    assert "mirror planes" in next(width_warnings(with_values(case, sliced))).text


def test_leads_are_taken_over_the_common_width(case):
    """A slope over a face twice as wide opens half as far over the part that both gears have."""
    slope = {"sun.modifications": [{"kind": "lead slope", "amount": "10 um"}], "static.slices": 25}
    one, two = (with_values(case, slope | {"sun.face_width": width}) for width in ("25 mm", "50 mm"))
    found = [lead_separation(set_deviations(of), planetary_set(of), 25)[0] for of in (one, two)]
    assert found[1] == pytest.approx(0.5 * found[0])


def test_limits_follow_from_treatment_grade_and_hardness(case):
    """Case hardened sun and planets of MQ, a quenched ring; limits that are given go before them."""
    treated = {"material.treatment": "case hardened steel", "material.hardness": 720}
    ring = {"ring.material.treatment": "through hardened alloy steel", "ring.material.hardness": 300}
    other = with_values(case, treated | ring | {"sun.material.root_stress_limit": "500 MPa"})
    sun, planet, quenched = (gear_material(other, gear) for gear in other.gear_names)
    assert (sun.root_stress_limit, sun.contact_stress_limit) == (500e6, 1500e6)
    assert (planet.root_stress_limit, planet.contact_stress_limit) == (425e6, 1500e6)
    assert quenched.contact_stress_limit == pytest.approx((1.313 * 300 + 373) * 1e6)
    better = with_values(other, {"material.root_stress_limit": "461 MPa", "ring.material.grade": "ME"})
    assert gear_material(better, "planet").root_stress_limit == 461e6
    assert gear_material(better, "ring").contact_stress_limit == pytest.approx((2.213 * 300 + 260) * 1e6)


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"material.treatment": "case hardened steel"}, "E-KEY-MISSING", "material.hardness"),
        ({"material.treatment": "case hardened steel", "material.hardness": 62}, "E-RANGE", "material.hardness"),
        (
            {"ring.material.treatment": "grey iron", "ring.material.hardness": 500},
            "E-RANGE",
            "ring.material.hardness",
        ),
        ({"material.treatment": "unobtainium", "material.hardness": 700}, "E-CHOICE", "material.treatment"),
        ({"material.treatment": "grey iron", "material.grade": "MX"}, "E-CHOICE", "material.grade"),
    ],
)
def test_materials_that_the_standard_does_not_have_are_refused(case, changes, code, key):
    with pytest.raises(CaseError) as caught:
        with_values(case, changes)
    problems = caught.value.problems or (caught.value,)
    assert (code, key) in {(problem.code, problem.key) for problem in problems}
