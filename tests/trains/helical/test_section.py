"""Helical cases: the shipped train, its gears, what is refused, and what is said."""

import math
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from published.planetary_sets import kahraman_set

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, GeometryError
from femgear.gears.checks import check_set
from femgear.stages.lumped_set import rotation_sense
from femgear.trains.helical.model import HelicalSet, check_helical_case, contact_ratios, helical_data
from femgear.trains.helical.stages import HELICAL
from femgear.trains.reading import parse_case, read_case, to_toml, with_value

ROOT = Path(__file__).parents[3]
GIVEN = {"sun_planet": "200e6 N/m", "planet_ring": "200 N/um"}


@pytest.fixture(scope="module")
def case():
    return read_case(ROOT / "cases" / "helical_30_20_70.toml")


@pytest.fixture(scope="module")
def given(case):
    return with_value(case, "helical.mesh_stiffness", GIVEN)


def refused(case, key, value):
    with pytest.raises(CaseError) as info:
        with_value(case, key, value)
    return info.value


def test_the_shipped_case_is_the_train_of_the_paper(given):
    found, expected = helical_data(given, planetary_set(given)), kahraman_set()
    # the paper rounds its pressure angle to 21.34 deg
    for name in (field.name for field in fields(HelicalSet)):
        one, other = getattr(found, name), getattr(expected, name)
        if isinstance(other, str):
            # the file has the points that keep the set in equilibrium
            assert (one, other) == ("pitch_point", "base_circles")
        elif hasattr(other, "mass"):
            for entry in ("mass", "inertia", "diametral_inertia"):
                assert getattr(one, entry) == pytest.approx(getattr(other, entry), rel=1e-4)
            np.testing.assert_allclose(one.support.stiffness, other.support.stiffness, rtol=1e-4)
        elif name == "planet_bearing":
            np.testing.assert_allclose(one.stiffness, other.stiffness, rtol=1e-4)
        elif name != "face_width":
            np.testing.assert_allclose(one, other, rtol=2e-4, err_msg=name)
    assert tuple(map(str, given.notices)) == (
        "[W-UNUSED] static, dynamics have no effect while helical.mesh_stiffness is given: it leaves nothing "
        "that excites, and modes are all that is computed",
    )


def test_normal_gears_of_the_shipped_case_have_the_printed_base_radii(case):
    gears = planetary_set(case)
    assert check_set(gears) == () and case.notices == ()
    radii = [gear.base_radius for gear in (gears.sun, gears.planet, gears.ring)]
    np.testing.assert_allclose(radii, [0.024, 0.016, 0.056], rtol=1e-9)
    data = helical_data(case, gears, np.full(8, 1e8))
    assert math.degrees(data.base_helix_angle) == pytest.approx(20.0, abs=1e-7)
    ratios = contact_ratios(gears, helix_angle=case.helical.helix_angle)
    assert ratios[:, 1] == pytest.approx(25 * math.tan(math.radians(20)) / (math.pi * 1.6))


def test_gears_are_those_of_the_transverse_section(case):
    wide = with_value(case, "sun.profile_shift", 0.2)
    wide = with_value(wide, "ring.profile_shift", None)
    gears, cosine = planetary_set(wide), math.cos(case.helical.helix_angle)
    assert gears.sun.module == pytest.approx(1.6e-3 / cosine)
    assert math.tan(gears.sun.pressure_angle) == pytest.approx(math.tan(math.radians(20.0)) / cosine)
    assert gears.sun.profile_shift == pytest.approx(0.2 * cosine)
    # addendum and shift are the same lengths in both sections
    assert gears.sun.root_radius == pytest.approx(gears.sun.reference_radius - 1.05 * 1.6e-3)
    free = planetary_set(with_value(wide, "sun.tip_diameter", None)).sun
    assert free.tip_radius + free.tip_shortening == pytest.approx(free.reference_radius + 1.2 * 1.6e-3)
    cutter = with_value(with_value(case, "ring.cutter_teeth", 30), "ring.cutter_profile_shift", 0.1)
    assert planetary_set(cutter).ring.cutter.profile_shift == pytest.approx(0.1 * cosine)


def test_a_spur_case_keeps_its_gears_to_the_last_digit():
    gears = planetary_set(read_case(ROOT / "cases" / "planetary_27_40_108.toml"))
    assert gears.sun.module == 1.5e-3 and gears.sun.profile_shift == 0.52681
    assert gears.sun.pressure_angle == math.radians(20.0) or gears.sun.pressure_angle == pytest.approx(
        math.radians(20.0), rel=1e-15
    )


def test_text_of_a_case_gives_it_again(given):
    assert parse_case(to_toml(given)) == given


BODIES, STIFFNESS = ("sun", "ring", "carrier", "planet"), "helical.mesh_stiffness"


@pytest.mark.parametrize(
    ("key", "value", "code", "named"),
    [
        ("helical.helix_angle", "0 deg", "E-RANGE", "helical.helix_angle"),
        ("helical.helix_angle", "-20 deg", "E-RANGE", "helical.helix_angle"),
        ("helical.helix_angle", "46 deg", "E-RANGE", "helical.helix_angle"),
        ("helical.helix_angle", 20, "E-UNIT", "helical.helix_angle"),
        ("helical.helix_angle", None, "E-KEY-MISSING", "helical.helix_angle"),
        ("helical.hand", "up", "E-CHOICE", "helical.hand"),
        ("helical.slices", 0, "E-RANGE", "helical.slices"),
        ("helical.slices", 31, "E-RANGE", "helical.slices"),
        ("helical.slices", 2.5, "E-TYPE", "helical.slices"),
        ("helical.contact_points", "tips", "E-CHOICE", "helical.contact_points"),
        ("helical.section", "axial", "E-CHOICE", "helical.section"),
        ("helical.helix", "20 deg", "E-KEY-UNKNOWN", "helical.helix"),
        (STIFFNESS, {"sun_planet": "2e8 N/m"}, "E-KEY-MISSING", f"{STIFFNESS}.planet_ring"),
        (STIFFNESS, GIVEN | {"sun_planet": "1 N/m"}, "E-RANGE", f"{STIFFNESS}.sun_planet"),
        *(
            (f"helical.{body}.diametral_inertia", "0 kg m^2", "E-RANGE", f"helical.{body}.diametral_inertia")
            for body in BODIES
        ),
        ("helical.sun.axial_stiffness", "-1 N/m", "E-RANGE", "helical.sun.axial_stiffness"),
        ("helical.planet.tilt_stiffness", "1e7 N/m", "E-UNIT", "helical.planet.tilt_stiffness"),
        ("helical.planet.torsional_stiffness", "nan N m/rad", "E-UNIT", "helical.planet.torsional_stiffness"),
        ("helical.ring.torsional_stiffness", "0 N m/rad", "E-MECHANISM", "helical.ring.torsional_stiffness"),
        ("helical.ring.mass", "0 kg", "E-RANGE", "helical.ring.mass"),
        ("helical.sun.axial_stiffness", "1e15 N/m", "E-RANGE", "helical.sun.axial_stiffness"),
        ("helical.planet.tilt_stiffness", "1e14 N m/rad", "E-RANGE", "helical.planet.tilt_stiffness"),
        ("helical.ring.support_stiffness", "1e16 N/m", "E-RANGE", "helical.ring.support_stiffness"),
        ("static.members", "elastic", "E-CHOICE", "static.members"),
        ("operation.torque", "0 N m", "E-NO-LOAD", "operation.torque"),
    ],
)
def test_what_is_refused(case, key, value, code, named):
    error = refused(case, key, value)
    assert code in {problem.code for problem in error.problems}
    assert named in {problem.key for problem in error.problems}


def test_planar_and_helical_exclude_each_other(case):
    ring = {"mass": "1 kg", "inertia": "1 kg m^2", "support_stiffness": "1e8 N/m"}
    error = refused(case, "planar", {"ring": ring})
    assert error.code == "E-CHOICE" and error.key == "helical" and "leave one" in error.remedy


def test_no_helix_is_told_to_leave_the_section_out(case):
    assert "leave the section helical out" in refused(case, "helical.helix_angle", "0 deg").remedy


def test_everything_wrong_is_reported_at_once_with_its_line(tmp_path, case):
    text = to_toml(case)
    for old, new in (('torque = "150 N m"', 'torque = "0 N m"'), ("21.344222898 deg", "0 deg")):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as info:
        read_case(path)
    lines = text.splitlines()
    for problem, start in zip(info.value.problems, ("helix_angle", "torque"), strict=True):
        assert lines[int(str(problem.file).rpartition(":")[2]) - 1].startswith(start)


def test_keys_without_effect_are_said(case):
    more = with_value(with_value(case, "housing.points", 60), "planet.bearing_clearance", "5 um")
    more = with_value(with_value(more, "static.stresses", True), "ring.foundation_radial", "1e10 N/m^3")
    more = with_value(more, "material.contact_stress_limit", "1400 MPa")
    unused = "housing, ring.foundation_radial, static.stresses, "
    unused += "planet.bearing_clearance"
    assert tuple(map(str, more.notices)) == (f"[W-UNUSED] {unused} have no effect in this helical case",)


def test_thrust_that_nothing_takes_up_is_refused(given):
    check_helical_case(given, planetary_set(given))
    for key in ("helical.sun.axial_stiffness", "helical.ring.axial_stiffness"):
        loose = with_value(given, key, "0 N/m")
        with pytest.raises(CaseError, match="E-MECHANISM") as info:
            check_helical_case(loose, planetary_set(loose))
        assert "axial_stiffness" in info.value.remedy


def test_moments_that_nothing_takes_up_are_refused_by_their_support(given):
    for body, entry in (("planet", "tilt_stiffness"), ("sun", "axial_stiffness")):
        key = f"helical.{body}.{entry}"
        loose = with_value(given, key, "0 N m/rad" if entry == "tilt_stiffness" else "0 N/m")
        with pytest.raises(CaseError, match="E-MECHANISM") as info:
            check_helical_case(loose, planetary_set(loose))
        assert info.value.key == key and info.value.limit == f"above 0: {key}"
        assert ("tilting" in info.value.message) == (entry == "tilt_stiffness")


def test_stiffest_supports_that_are_allowed_pass_the_check(given):
    stiff = given
    for body in BODIES:
        stiff = with_value(stiff, f"helical.{body}.axial_stiffness", "1e14 N/m")
        stiff = with_value(stiff, f"helical.{body}.tilt_stiffness", "1e13 N m/rad")
    check_helical_case(stiff, planetary_set(stiff))
    # past the bounds of the file the reason is that of the stiffness, not of a mesh
    helical = stiff.helical
    bodies = {body: getattr(helical, body).model_copy(update={"tilt_stiffness": 1e26}) for body in BODIES}
    beyond = stiff.model_copy(update={"helical": helical.model_copy(update=bodies)})
    with pytest.raises(CaseError, match="E-RANGE") as info:
        check_helical_case(beyond, planetary_set(beyond))
    assert "too stiff" in info.value.message


@pytest.mark.parametrize("soft", ["1e-99 N m/rad", "1e-30 N m/rad", "1e-15 N m/rad"])
def test_a_support_that_rounding_hides_is_refused(given, soft):
    loose = with_value(given, "helical.planet.tilt_stiffness", soft)
    with pytest.raises(CaseError, match="E-RANGE") as info:
        check_helical_case(loose, planetary_set(loose))
    assert "rounding hides the soft ones" in info.value.message and "closer together" in info.value.remedy


def test_a_torque_that_no_teeth_carry_is_refused(case):
    large = with_value(case, "operation.torque", "1e9 N m")
    with pytest.raises(CaseError, match="E-RANGE") as info:
        check_helical_case(large, planetary_set(large))
    assert info.value.key == "operation.torque"
    # c' = 14 N/(mm um) at a quarter of the transverse module over four planets
    module = 1.6 / math.cos(case.helical.helix_angle)
    limit = 4 * 0.024 * 25 * 14e3 * 0.25 * module
    assert info.value.limit.startswith(f"{limit:.3g} N m")
    high = with_value(case, "operation.torque", f"{0.99 * limit} N m")
    check_helical_case(high, planetary_set(high))


def test_contact_points_of_the_paper_and_many_slices_are_warned_of(case):
    (said,) = map(str, with_value(case, "helical.contact_points", "base_circles").notices)
    assert said.startswith("[W-CONTACT-POINTS] helical.contact_points:") and "13 %" in said
    assert with_value(case, "helical.slices", 10).notices == ()
    many = with_value(case, "helical.slices", 30)
    assert many.notices == ()
    many = with_value(many, "operation.speeds", {"from": "100 rpm", "to": "3000 rpm", "count": 1000})
    (said,) = map(str, many.notices)
    assert said.startswith("[W-SLICES] helical.slices: 30 slices of 8 meshes at 1000 speeds") and "2 min" in said


def test_errors_that_turn_are_refused(case):
    eccentric = with_value(case, "sun.errors", {"runout_amplitude": "5 um"})
    with pytest.raises(CaseError, match="E-PERIODS"):
        check_helical_case(eccentric, planetary_set(eccentric))


def test_virtual_gears_have_tools_with_room(case):
    """A round tool tip that fits between the flanks of the transverse section alone is less round there."""
    blunt = with_value(case, "rack", {"root_radius": 0.445, "addendum": 0.7})
    gears = planetary_set(blunt)
    check_helical_case(blunt, gears)
    from femgear.gears.planetary import virtual_set

    virtual = virtual_set(gears, blunt.helical.helix_angle)
    assert virtual.ring.rack.root_radius < 0.445 and virtual.ring.tool.room >= 0.0
    assert virtual.sun.rack.root_radius == pytest.approx(0.445)


def test_virtual_gears_that_cannot_be_made_are_refused(case, monkeypatch):
    def refuse(*_):
        raise GeometryError("no such gear", code="E-TIP", key="sun.tip_diameter")

    monkeypatch.setattr("femgear.trains.helical.model.virtual_set", refuse)
    gears = planetary_set(case)
    with pytest.raises(CaseError, match="E-GEOMETRY") as info:
        check_helical_case(case, gears)
    assert 'section = "transverse"' in info.value.remedy
    check_helical_case(with_value(case, "helical.section", "transverse"), gears)


def test_refusals_of_the_gears_say_that_they_are_of_the_transverse_section(case):
    with pytest.raises(GeometryError) as info:
        planetary_set(with_value(with_value(case, "sun.profile_shift", 2.5), "ring.profile_shift", None))
    assert "in the transverse section" in info.value.message
    with pytest.raises(GeometryError, match=r"0\.931411 times those of the file") as info:
        planetary_set(with_value(case, "rack.root_radius", 0.6))
    # found and allowed are coefficients of the file
    assert info.value.value == 0.6
    limit = float(info.value.limit.split()[1])
    planetary_set(with_value(case, "rack.root_radius", limit))
    with pytest.raises(GeometryError, match="E-ROOT-RADIUS") as info:
        planetary_set(with_value(case, "rack.root_radius", limit + 1e-4))
    assert info.value.value == pytest.approx(limit + 1e-4)


def test_check_tells_helix_and_contact_ratios(case):
    gears = planetary_set(case)
    blocks = {block.title: block for block in HELICAL.describe(case)}
    rows = {row[0]: row[1:] for row in blocks["Meshes"].rows}
    assert rows["overlap ratio"] == ("1.8102", "1.8102")
    assert rows["transverse contact ratio"] == (
        f"{gears.contact_ratio_sun_planet:.4f}",
        f"{gears.contact_ratio_planet_ring:.4f}",
    )
    total = float(rows["total contact ratio"][0])
    assert total == pytest.approx(gears.contact_ratio_sun_planet + 1.8102, abs=2e-4)
    assert "transverse working pressure angle [deg]" in rows
    notes = " ".join(blocks["Gears"].notes)
    assert "normal module 1.6 mm" in notes and "transverse module 1.71782 mm" in notes
    assert "helix angle 21.3442 deg, on the base cylinder 20 deg" in notes and "sun right-handed" in notes
    assert any("virtual gears 37/25/87" in note for note in blocks["Helical model"].notes)


@pytest.mark.parametrize(
    ("input_", "fixed", "sense"),
    [
        ("sun", "ring", 1),
        ("carrier", "ring", 1),
        ("ring", "sun", -1),
        ("sun", "carrier", 1),
        ("ring", "carrier", -1),
    ],
)
def test_sense_of_the_sun_against_the_carrier(case, input_, fixed, sense):
    from femgear.case import text as case_text

    data = case_text.parse(case.source, "")
    data["operation"] |= {"input": input_, "fixed": fixed}
    data["helical"][fixed].pop("torsional_stiffness", None)
    turned = parse_case(case_text.write(data))
    assert rotation_sense(turned, planetary_set(turned)) == sense
