"""Cases of planetary stages in series: the shipped trains, what is refused, and what is said."""

import math

import numpy as np
import pytest
from published.multistage_example import CASES, four_stage_case, published_case

from femgear import cli
from femgear.errors import CaseError
from femgear.fe.beam import RoundSection, joint_springs
from femgear.trains import registry
from femgear.trains.multistage.case_file import multistage_of, stage_gears
from femgear.trains.multistage.model import Member, in_series, train_speeds
from femgear.trains.multistage.stages import MULTISTAGE
from femgear.trains.reading import parse_case, read_case, to_toml, with_value, with_values


@pytest.fixture(scope="module")
def case():
    return four_stage_case()


@pytest.fixture(scope="module")
def printed():
    return published_case(planets=3)


def test_gears_phases_and_stiffness_follow_from_the_module(case):
    train = multistage_of(case)
    assert registry.train_of(case) is MULTISTAGE and case.geared
    for stage, section in zip(train.stages, case.stage):
        gears = stage_gears(section)
        assert stage.teeth == section.gears.teeth and stage.fixed == "ring"
        assert stage.data.sun_radius == gears.sun.base_radius
        assert stage.phases == pytest.approx(gears.mesh_phases)
    given = with_value(case, "stage[0].gears.mesh_stiffness", {"sun_planet": "3e8 N/m", "planet_ring": "5e8 N/m"})
    assert multistage_of(given).stages[0].data.mesh_stiffness.tolist() == [3e8] * 3 + [5e8] * 3


def test_stiffness_of_method_b_has_the_factor_of_the_own_rack(case):
    """c' and c_gamma of ISO 6336-1 written out; C_B = 1 + (1.2 - 1.25) / 2 of a dedendum of 1.25 modules."""
    section, data = case.stage[0], multistage_of(case).stages[0].data
    gears, given = stage_gears(section), section.gears
    (sun, planet, _), (x_s, x_p, x_r) = given.teeth, given.profile_shifts
    assert gears.sun.rack.dedendum == gears.planet.rack.dedendum == gears.ring.rack.dedendum == 1.25
    outer = 0.04723 + 0.15551 / sun + 0.25791 / planet - 0.00635 * x_s - 0.11654 * x_s / sun
    outer += -0.00193 * x_p - 0.24188 * x_p / planet + 0.00529 * x_s**2 + 0.00182 * x_p**2
    inner = 0.04723 + 0.15551 / planet - 0.00635 * x_p - 0.11654 * x_p / planet + 0.00193 * x_r
    inner += 0.00529 * x_p**2 + 0.00182 * x_r**2
    ratios = gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring
    for k, flexibility, ratio in zip(data.mesh_stiffness[[0, -1]], (outer, inner), ratios, strict=True):
        single = 0.8 * 0.975 * 1e9 / flexibility
        assert k == pytest.approx(given.face_width * single * (0.75 * ratio + 0.25), rel=1e-12)


def test_shafts_are_beams_whose_ends_do_not_tilt(case):
    train = multistage_of(case)
    for one, size in zip(train.couplings, ((0.045, 0.12), (0.08, 0.18), (0.13, 0.26))):
        joint = joint_springs(RoundSection(size[0]), size[1])
        assert (one.torsional, one.lateral) == pytest.approx((joint.torsion, joint.shear), rel=1e-14)
    rigid = with_value(case, "coupling[1].torsional", "rigid")
    assert multistage_of(rigid).couplings[1].torsional == math.inf
    assert multistage_of(rigid).couplings[1].lateral == train.couplings[1].lateral


def test_stages_without_couplings_are_joined_rigidly_in_series(printed):
    train = multistage_of(printed)
    assert train.couplings == in_series(train.stages).couplings and len(train.couplings) == 3
    assert (train.input, train.output) == (Member(1, "sun"), Member(4, "carrier"))
    assert train.stages[0].data.centre_distance == pytest.approx((0.013652 + 0.040254) / math.cos(math.radians(20.0)))
    assert train.stages[0].data.ring_radius == pytest.approx(0.013652 + 2 * 0.040254)


def test_another_input_and_a_free_ring(case):
    """The first ring driven beside a held sun: Willis with the sun at rest."""
    turned = with_values(
        case,
        {"stage[0].fixed": "sun", "stage[0].sun.torsional_stiffness": "1e8 N m/rad", "operation.input": "stage 1 ring"},
    )
    speeds = train_speeds(multistage_of(turned), 100.0)
    assert speeds.carrier[0] == pytest.approx(100.0 * 105 / 126) and speeds.sun[0] == 0.0


def test_text_of_a_case_gives_it_again(case, printed):
    for one in (case, printed):
        assert parse_case(to_toml(one)) == one


@pytest.mark.parametrize(("addendum", "code"), [(1.0, "W-FILLET"), (1.2, "W-TIP"), (0.9, "")])
def test_findings_of_the_gears_name_the_stage(case, addendum, code):
    """Tips of the ring that overlap fillets by 1.5 um are warned about, longer ones shortened."""
    assert not list(registry.train_of(case).case_warnings(case))
    changed = with_value(case, "stage[1].gears.addendum", [1.0, 1.0, addendum])
    found = [(one.code, one.key) for one in registry.train_of(case).case_warnings(changed)]
    assert found == [(code, "stage[1].gears.addendum")][: len(code)]


@pytest.mark.parametrize(
    ("key", "value", "code", "named"),
    [
        ("stage", [], "E-RANGE", "stage"),
        ("stage[0].planets", 0, "E-RANGE", "stage[0].planets"),
        ("stage[1].gears.teeth", [21, 33], "E-RANGE", "stage[1].gears.teeth"),
        ("stage[1].gears.teeth", None, "E-KEY-MISSING", "stage[1].gears.teeth"),
        ("stage[1].gears.face_width", None, "E-KEY-MISSING", "stage[1].gears.face_width"),
        ("stage[1].gears.module", 5, "E-UNIT", "stage[1].gears.module"),
        ("stage[1].gears", None, "E-CHOICE", "stage[1].gears"),
        (
            "stage[1].radii",
            {"sun": "20 mm", "planet": "30 mm"},
            "E-KEY-MISSING",
            "stage[1].radii.mesh_stiffness",
        ),
        ("stage[1].gears.teeth", [21, 33, 86], "E-COAXIAL", "stage[1].gears.profile_shifts"),
        ("stage[1].planets", 7, "E-NEIGHBOURS", "stage[1].planets"),
        ("stage[1].gears.addendum", [0.3, 0.3, 0.3], "E-CONTACT-RATIO", "stage[1].gears.profile_shifts"),
        ("stage[1].gears.profile_shifts", [3.0, 0.0, 0.0], "E-COAXIAL", "stage[1].gears.profile_shifts"),
        ("stage[1].fixed", "planet", "E-CHOICE", "stage[1].fixed"),
        ("stage[1].fixed", "carrier", "E-MECHANISM", "stage[1].carrier.torsional_stiffness"),
        ("stage[1].planet_angles", ["0 deg", "0 deg"], "E-RANGE", "stage[1].planet_angles"),
        ("stage[2].sun.mass", "0 kg", "E-RANGE", "stage[2].sun.mass"),
        ("stage[2].ring.support_stiffness", "stiff", "E-UNIT", "stage[2].ring.support_stiffness"),
        ("stage[2].planet.bearing_stiffness", None, "E-KEY-MISSING", "stage[2].planet.bearing_stiffness"),
        ("stage[2].planet.support_stiffness", "1 N/m", "E-KEY-UNKNOWN", "stage[2].planet.support_stiffness"),
        ("coupling[0].between", ["stage 1 carrier", "stage 5 sun"], "E-RANGE", "coupling[0].between"),
        ("coupling[0].between", ["stage 1 carrier", "stage 1 sun"], "E-RANGE", "coupling[0]"),
        ("coupling[0].between", ["stage 1 carrier", "sun"], "E-CHOICE", "coupling[0].between[1]"),
        ("coupling[0].length", None, "E-CHOICE", "coupling[0].between"),
        ("coupling[0].torsional", "1e13 N m/rad", "E-RANGE", "coupling[0].torsional"),
        ("operation.speed", "0 rpm", "E-RANGE", "operation.speed"),
        ("operation.input", "stage 1 planet", "E-CHOICE", "operation.input"),
        ("operation.input", "stage 1 ring", "E-MECHANISM", "operation"),
        ("operation.output", "stage 9 sun", "E-RANGE", "operation.output"),
        ("response.highest", "200 rpm", "E-RANGE", "response.highest"),
        ("response.damping_ratio", 0.0, "E-RANGE", "response.damping_ratio"),
        ("response.points", 1, "E-RANGE", "response.points"),
        ("responce.points", 100, "E-KEY-UNKNOWN", "responce"),
    ],
)
def test_what_is_refused(case, key, value, code, named):
    with pytest.raises(CaseError) as info:
        with_value(case, key, value)
    assert (code, named) in {(problem.code, problem.key) for problem in info.value.problems}


def test_trains_that_cannot_turn_are_refused(case):
    loop = [one for one in _couplings(case)] + [
        {"between": ["stage 4 carrier", "stage 1 sun"], "torsional": "1e6 N m/rad"}
    ]
    with pytest.raises(CaseError, match="E-MECHANISM") as info:
        with_value(case, "coupling", loop)
    assert info.value.key == "coupling" and "loop" in info.value.limit
    with pytest.raises(CaseError, match="do not determine all speeds"):
        with_value(case, "coupling", _couplings(case)[:2])


def _couplings(case):
    return [
        {"between": list(one.between), "diameter": f"{one.diameter!r} m", "length": f"{one.length!r} m"}
        for one in case.coupling
    ]


def test_mistakes_name_file_line_and_key(tmp_path, capsys):
    text = (CASES / "four_stage_reducer.toml").read_text(encoding="utf-8")
    path = tmp_path / "wrong.toml"
    path.write_text(text.replace('module = "5 mm"', 'modul = "5 mm"'), encoding="utf-8")
    assert cli.main(["check", str(path)]) == 2
    said, line = capsys.readouterr().err, text[: text.index('module = "5 mm"')].count("\n") + 1
    assert f"wrong.toml:{line}: stage[1].gears.modul" in said and "did you mean module?" in said
    path.write_text(text.replace('model = "multistage"', 'model = "multistages"'), encoding="utf-8")
    assert cli.main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert "wrong.toml:4: model" in said and "did you mean multistage?" in said and "gear_pair" in said


def test_check_tells_speeds_torques_and_what_is_left_out(case, printed, capsys):
    stages = {block.title: block for block in MULTISTAGE.describe(case)}["Stages"]
    assert "ratio 538.597" in stages.notes[0] and "54.98 kW" in stages.notes[0]
    row = dict(zip(stages.header, stages.rows[3]))
    assert row["mesh [Hz]"] == "3.342" and row["sun [N m]"] == "47127.3"
    assert cli.main(["check", str(CASES / "published_four_stages.toml")]) == 0
    assert "torsion" in capsys.readouterr().out
    without = read_case(CASES / "published_four_stages.toml")
    assert tuple(MULTISTAGE.warnings(without)) == ()
    asked = with_value(without, "response", {"lowest": "1 rpm", "highest": "2 rpm"})
    assert [warning.code for warning in MULTISTAGE.warnings(asked)] == ["W-RESPONSE"]
    assert np.isfinite(multistage_of(printed).stages[3].data.planet.mass)
