"""Planar cases: the shipped sets, what is refused, and what is said."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from published.wind_turbine import gravity_problem_b, wind_turbine_a, wind_turbine_b

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.gears.checks import check_set
from femgear.system.rigid_bodies import PlanarSet
from femgear.trains.planar.model import planar_data, planar_model
from femgear.trains.planar.stages import PLANAR, check_planar_case, check_smoothing, mean_compression
from femgear.trains.reading import parse_case, read_case, to_toml, with_value

CASES = Path(__file__).parents[3] / "cases"
PGA, PGB, PGB_STATIC = (CASES / f"nrel_{name}.toml" for name in ("pga", "pgb", "pgb_static"))


@pytest.fixture(scope="module")
def pgb():
    return read_case(PGB)


def refused(case, key, value):
    with pytest.raises(CaseError) as info:
        with_value(case, key, value)
    return info.value


@pytest.mark.parametrize(("path", "published"), [(PGA, wind_turbine_a), (PGB, wind_turbine_b)])
def test_shipped_cases_are_the_sets_of_the_paper(path, published):
    case, expected = read_case(path), published()
    gears = planetary_set(case)
    assert check_set(gears) == ()
    found = planar_data(case, gears)
    for name in (field.name for field in fields(PlanarSet)):
        one, other = getattr(found, name), getattr(expected, name)
        for a, b in zip(*((vars(x).values() if hasattr(x, "mass") else [x]) for x in (one, other))):
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-14, err_msg=name)


def test_the_problem_of_set_b_is_the_one_of_the_script(pgb):
    gears = planetary_set(pgb)
    ours, other = planar_model(pgb, gears).problem, gravity_problem_b()
    for name in ("M", "C", "K", "W", "load"):
        scale = np.abs(getattr(other.system, name)).max()
        np.testing.assert_allclose(getattr(ours.system, name), getattr(other.system, name), rtol=0, atol=1e-6 * scale)
    np.testing.assert_allclose(ours.forces[0].force, other.forces[0].force, atol=1e-9)
    assert ours.forces[0].orders == other.forces[0].orders
    for one, two in zip(ours.elements, other.elements):
        np.testing.assert_allclose(one.deflection.mean, two.deflection.mean, rtol=1e-6)


def test_the_two_files_of_set_b_differ_in_title_and_mesh_stiffness_alone(pgb):
    static = read_case(PGB_STATIC)
    assert static.notices == ()
    assert with_value(with_value(pgb, "planar.mesh_stiffness", None), "title", static.title) == static


def test_a_planar_case_can_be_written_and_read_again(pgb):
    again = parse_case(to_toml(with_value(pgb, "planar.branch.from", "30 Hz")))
    assert again.planar.branch.start == 30.0 and again.planar.gravity.acceleration == 9.80665
    assert not hasattr(read_case(CASES / "planetary_27_40_108.toml"), "planar")


def test_a_planar_case_has_no_foundation_of_the_ring(pgb):
    assert pgb.ring.foundation_radial == pgb.ring.foundation_tangential == 0.0
    elastic = with_value(pgb, "planar", None)
    (said,) = [one for one in elastic.notices if one.code == "W-ESTIMATED"]
    assert "ring.foundation_radial = " in said.text and elastic.ring.foundation_tangential > 0.0


@pytest.mark.parametrize(
    ("key", "value", "code", "named"),
    [
        ("planar.mesh_stiffness.sun_planet", None, "E-KEY-MISSING", "planar.mesh_stiffness.sun_planet"),
        ("planar.mesh_stiffness.sun_planet", "4 N/um", "", ""),
        ("planar.mesh_stiffness.sun_planet", "4 N", "E-UNIT", "planar.mesh_stiffness.sun_planet"),
        ("planar.mesh_stiffness.planet_ring", "0 N/m", "E-RANGE", "planar.mesh_stiffness.planet_ring"),
        ("planar.line_backlash", "-1 um", "E-RANGE", "planar.line_backlash"),
        ("planar.line_backlash", "0 um", "E-BACKLASH", "planar.line_backlash"),
        ("planar.damping_ratios", [], "E-RANGE", "planar.damping_ratios"),
        ("planar.damping_ratios", [0.05, 1.0], "E-RANGE", "planar.damping_ratios[1]"),
        ("planar.damping_ratio", 0.05, "E-KEY-UNKNOWN", "planar.damping_ratio"),
        ("planar.back_flanks", 1, "E-TYPE", "planar.back_flanks"),
        ("planar.reaction", "ground", "E-CHOICE", "planar.reaction"),
        ("planar.ring.mass", "0 kg", "E-RANGE", "planar.ring.mass"),
        ("planar.torsion.ring", "0 N m/rad", "E-MECHANISM", "planar.torsion.ring"),
        ("planar.torsion.sun", "0 N m/rad", "E-MECHANISM", "planar.torsion.sun"),
        ("planar.torsion.sun", None, "E-MECHANISM", "planar.reaction"),
        (
            "planar.carrier_bearing",
            {"clearance": "1 mm"},
            "E-KEY-MISSING",
            "planar.carrier_bearing.stiffness",
        ),
        ("planar.gravity", None, "E-KEY-MISSING", "planar.gravity"),
        ("planar.gravity.acceleration", "9.81 m/s", "E-UNIT", "planar.gravity.acceleration"),
        ("planar.branch.to", "20 Hz", "E-RANGE", "planar.branch.to"),
        ("planar.branch.from", "1500 rpm", "E-UNIT", "planar.branch.from"),
        ("planar.branch.from", "0 Hz", "E-RANGE", "planar.branch.from"),
        ("planar.branch.harmonics", 0, "E-RANGE", "planar.branch.harmonics"),
        ("planar.gyroscopic", True, "E-CHOICE", "planar.gyroscopic"),
        ("planar.response.side_bands", -1, "E-RANGE", "planar.response.side_bands"),
        ("planar.published[0].frequency", None, "E-CHOICE", "planar.published[0]"),
        ("planar.published[4].figure", "photo", "E-CHOICE", "planar.published[4].figure"),
        ("static.members", "elastic", "E-CHOICE", "static.members"),
        ("operation.torque", "0 N m", "E-NO-LOAD", "operation.torque"),
    ],
)
def test_what_is_refused(pgb, key, value, code, named):
    if not code:
        assert with_value(pgb, key, value).planar.mesh_stiffness.sun_planet == pytest.approx(4e6)
        return
    error = refused(pgb, key, value)
    assert code in {problem.code for problem in error.problems}
    assert named in {problem.key for problem in error.problems}


def test_a_carrier_that_stands_has_no_branch(pgb):
    still = with_value(with_value(pgb, "planar.branch", None), "planar.reaction", "output")
    still = with_value(with_value(still, "operation.input", "sun"), "operation.fixed", "carrier")
    assert refused(still, "planar.branch", {"from": "1 Hz", "to": "2 Hz"}).code == "E-MECHANISM"
    assert planar_model(still, planetary_set(still)).problem.forces == ()


def test_everything_wrong_is_reported_at_once_with_its_line(tmp_path):
    text = PGB.read_text(encoding="utf-8")
    wrong = {
        'from = "25 Hz"': 'from = "95 Hz"',
        'sun = "12e6 N m/rad"': 'sun = "0 N m/rad"',
        "speeds = [": "# speeds = [",
    }
    for old, new in wrong.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "wrong.toml"
    path.write_text(text.replace("# speeds = [", "speeds = ["), encoding="utf-8")
    with pytest.raises(CaseError) as info:
        read_case(path)
    lines = text.splitlines()
    for problem, start in zip(info.value.problems, ("sun = ", "to = "), strict=True):
        number = int(str(problem.file).rpartition(":")[2])
        assert lines[number - 1].startswith(start)


def test_keys_without_effect_are_said(pgb):
    assert tuple(map(str, pgb.notices)) == (
        "[W-UNUSED] static, dynamics.mesh_harmonics, planar.response.side_bands have no effect while "
        "planar.mesh_stiffness is given",
    )
    more = with_value(pgb, "housing.points", 60)
    more = with_value(more, "ring.foundation_radial", "1e10 N/m^3")
    more = with_value(more, "motor", {"inertia": "1 kg m^2", "coupling_stiffness": "1e6 N m/rad"})
    more = with_value(more, "material.root_stress_limit", "430 MPa")
    unused = "motor, housing, ring.foundation_radial"  # limits give safeties
    assert f"[W-UNUSED] {unused} have no effect in this planar case" in map(str, more.notices)
    plain = with_value(with_value(pgb, "planar.branch", None), "planar.response", None)
    play = with_value(plain, "planet.bearing_clearance", "50 um")
    assert any((note.code, note.key) == ("W-UNUSED", "planet.bearing_clearance") for note in play.notices)


def test_back_flanks_need_play_of_the_gears_or_of_the_case(pgb):
    none = with_value(pgb, "set.backlash", None)
    with pytest.raises(CaseError, match="E-BACKLASH"):
        check_planar_case(none, planetary_set(none))
    given = with_value(none, "planar.line_backlash", "482 um")
    check_planar_case(given, planetary_set(given))


def test_errors_of_several_mesh_periods_are_refused_with_the_static_solution():
    case = with_value(read_case(PGB_STATIC), "sun.errors", {"runout_amplitude": "5 um"})
    with pytest.raises(CaseError, match="E-PERIODS"):
        check_planar_case(case, planetary_set(case))


@pytest.mark.parametrize(
    ("input_", "torque", "words"),
    [("carrier", 1.0, "with"), ("carrier", -1.0, "against"), ("sun", 1.0, "against"), ("sun", -1.0, "with")],
)
def test_the_sense_of_torque_and_turning_is_that_of_the_operation(pgb, input_, torque, words):
    case = with_value(with_value(pgb, "planar.reaction", "output"), "planar.torsion", None)
    case = with_value(with_value(case, "operation.torque", f"{torque * 1e5} N m"), "operation.input", input_)
    gears = planetary_set(case)
    block = next(one for one in PLANAR.describe(case) if one.title == "Planar model")
    assert any(f"acts {words} its turning" in note for note in block.notes)
    # power: torque on the carrier times its turning, from the load vector and the order of the weight
    problem = planar_model(case, gears).problem
    load = problem.system.load[problem.system.dofs.index("carrier: u")]
    turning = problem.forces[0].orders[0]
    assert np.sign(load * turning) == (1 if words == "with" else -1)


def test_one_wrong_damping_ratio_is_one_problem(pgb):
    error = refused(pgb, "planar.damping_ratios", [1.0])
    assert [problem.key for problem in error.problems] == ["planar.damping_ratios[0]"]


def test_a_response_in_which_nothing_varies_is_said(pgb):
    plain = with_value(with_value(pgb, "planar.branch", None), "planar.gravity", None)
    assert any("nothing varies in time" in note.text and "no weight" in note.text for note in plain.notices)
    assert not any("nothing varies" in note.text for note in pgb.notices)
    still = with_value(with_value(pgb, "planar.branch", None), "planar.reaction", "output")
    still = with_value(with_value(still, "operation.input", "sun"), "operation.fixed", "carrier")
    assert any("nothing varies in time" in note.text and "stands" in note.text for note in still.notices)
    # with the stiffness of teeth the meshing itself excites
    teeth = with_value(with_value(plain, "planar.mesh_stiffness", None), "planar.gravity", None)
    assert not any("nothing varies" in note.text for note in teeth.notices)


def test_smoothing_is_bound_by_play_and_compression(pgb):
    gears = planetary_set(pgb)
    model = planar_model(pgb, gears)
    # rigid gears share the torque of the sun: force / stiffness of the stiffer mesh
    force = 180e3 / (1 + 68 / 16) / 3 / gears.sun.base_radius
    assert mean_compression(model) == pytest.approx(force / 5.29e9, rel=1e-3)
    check_smoothing(pgb, gears, model)
    narrow = with_value(pgb, "planar.line_backlash", "4 um")
    for base, value, words in ((pgb, "22 um", "mean compression"), (narrow, "3 um", "half the play")):
        case = with_value(base, "planar.smoothing", value)
        with pytest.raises(CaseError, match=words) as info:
            check_smoothing(case, gears, planar_model(case, gears))
        assert info.value.code == "E-RANGE"
    found = PLANAR.case_warnings(with_value(pgb, "planar.smoothing", "2 um"))
    assert ("W-SMOOTHING", "planar.smoothing") in [(one.code, one.key) for one in found]
    assert not any("[W-SMOOTHING]" in note for block in PLANAR.describe(pgb) for note in block.notes)
