"""Drivetrain cases: the shipped files, one way to the model, what is refused with its line, torque series."""

import math
from pathlib import Path

import numpy as np
import pytest
from published.wind_turbine_drivetrain import paper_torques, ratio_of_radii, wind_turbine_drivetrain

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.trains.drivetrain.case_file import DrivetrainCase, drivetrain_of, torque_histories
from femgear.trains.drivetrain.checks import check_drivetrain
from femgear.trains.drivetrain.model import case_model
from femgear.trains.drivetrain.stages import DRIVETRAIN
from femgear.trains.reading import case_schema, parse_case, read_case, to_toml, with_value

CASES = Path(__file__).parents[3] / "cases"
PAPER, GRC = (CASES / f"{name}.toml" for name in ("wind_turbine_drivetrain", "grc_like_drivetrain"))


def same(one, other) -> bool:
    """Whether nested data hold the same names, and numbers to the last digits."""
    if fields := getattr(one, "__dataclass_fields__", None) or getattr(type(one), "model_fields", None):
        return all(same(getattr(one, name), getattr(other, name)) for name in fields)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float):
        return one == other or abs(one - other) <= 1e-13 * abs(other)
    return one == other


def test_the_file_of_the_paper_is_its_set(paper):
    assert same(drivetrain_of(paper), wind_turbine_drivetrain())
    model = case_model(paper)
    assert len(model.rigid) == 36
    found = {one.body: one.values for one in torque_histories(paper, model.ratio)}
    assert {name: value[0] for name, value in found.items()} == pytest.approx(paper_torques())
    assert model.ratio["generator"] == pytest.approx(ratio_of_radii())


def test_the_grc_like_file_has_the_ratio_of_the_gearbox():
    case = read_case(GRC)
    model = check_drivetrain(case)
    teeth = (1 + 99 / 21) * (82 / 23) * (88 / 22)
    assert model.ratio["generator"] == pytest.approx(teeth, rel=1e-12) and round(teeth, 3) == 81.491
    torque = {one.body: one.values[0] for one in torque_histories(case, model.ratio)}
    assert torque["generator"] == pytest.approx(-322610 / teeth)
    assert case.notices == ()


def test_texts_give_the_same_case_again(paper, own):
    for case in (paper, own, read_case(GRC)):
        assert parse_case(to_toml(case)) == case
    assert own.profile_files == {"operation.torque[0]": "own_chain_motor.csv"}
    assert own.operation.torque[0].torques == (60.0, 60.0, 120.0, 120.0)
    assert own.operation.torque[0].times == (0.0, 0.5, 0.8, 1.0)
    changed = with_value(own, "body[3].inertia", "20 kg m^2")
    assert isinstance(changed, DrivetrainCase) and changed.body[3].inertia == 20.0
    assert changed.profile_files == own.profile_files


def test_share_balances_a_series(own):
    model = case_model(own)
    motor, fan = torque_histories(own, model.ratio)
    times = np.linspace(0.0, 1.2, 49)
    power = motor.at(times) * model.ratio["motor"] + fan.at(times) * model.ratio["fan"]
    assert np.abs(power).max() < 1e-9 and np.ptp(fan.values) > 100.0


def test_sizes_by_module_and_base_radii(own):
    wanted = drivetrain_of(own).parallel[0]
    assert wanted.pitch_radii == pytest.approx((34.5e-3, 106.5e-3))
    base = [f"{r * math.cos(math.radians(20.0))!r} m" for r in (34.5e-3, 106.5e-3)]
    text = to_toml(own).replace('module = "3 mm"', f"base_radii = {base}".replace("'", '"'))
    found = drivetrain_of(parse_case(text)).parallel[0]
    assert found.pitch_radii == pytest.approx((34.5e-3, 106.5e-3))
    grc = drivetrain_of(read_case(GRC)).planetary[0]
    assert (*grc.pitch_radii, grc.ring_radius) == pytest.approx((0.1078, 0.2002, 0.5082))


def refused(case, **changes):
    with pytest.raises(CaseError) as info:
        for key, value in changes.items():
            case = with_value(case, key, value)
    return info.value


@pytest.mark.parametrize(
    ("key", "value", "code", "named"),
    [
        ("body[1].inertia", "-1 kg m^2", "E-RANGE", "body[1].inertia"),
        ("body[1].inertia", 3.0, "E-UNIT", "body[1].inertia"),
        ("body[1].transverse_inertia", None, "E-KEY-MISSING", "body[1].transverse_inertia"),
        ("body[1].name", "planet 1", "E-CHOICE", "body[1].name"),
        ("body[1].inertai", "1 kg m^2", "E-KEY-UNKNOWN", "body[1].inertai"),
        ("shaft[0].between", ["motor", "pinon"], "E-CHOICE", "shaft[0].between"),
        ("shaft[0].between", ["motor", "motor"], "E-CHOICE", "shaft[0].between"),
        ("shaft[0].between", ["motor"], "E-COUNT", "shaft[0].between"),
        ("shaft[0].torsion", "0 N m/rad", "E-RANGE", "shaft[0].torsion"),
        ("shaft[0].torsion", None, "E-CHOICE", "shaft[0].bending"),
        ("shaft[0].elements", 3, "E-CHOICE", "shaft[0].bending"),
        ("shaft[1].torsion", "1 N m/rad", "E-CHOICE", "shaft[1].torsion"),
        ("shaft[1].inner_diameter", "70 mm", "E-RANGE", "shaft[1].inner_diameter"),
        ("parallel[0].mesh.stiffness", "0 N/m", "E-RANGE", "parallel[0].mesh.stiffness"),
        ("parallel[0].mesh.contact_ratio", 0.9, "E-RANGE", "parallel[0].mesh.contact_ratio"),
        ("parallel[0].mesh.low_share", 0.0, "E-RANGE", "parallel[0].mesh.low_share"),
        ("parallel[0].driver", "fan", "E-CHOICE", "parallel[0].driver"),
        ("body[1].name", "motor", "E-CASE", "body[1].name"),
        ("parallel[0].radii", ["30 mm", "90 mm"], "E-CHOICE", "parallel[0].radii"),
        ("parallel[0].module", None, "E-CHOICE", "parallel[0].radii"),
        ("bearing[0].body", "engine", "E-CHOICE", "bearing[0].body"),
        ("bearing[0]", None, "E-TYPE", "bearing[0]"),
        ("bearing[0].body", None, "E-CHOICE", "bearing[0].shaft"),
        ("bearing[0].station", 1, "E-CHOICE", "bearing[0].body"),
        ("bearing[0].radial", "rigit", "E-UNIT", "bearing[0].radial"),
        # a spring against the rotation of a chain that turns
        ("bearing[0].torsion", "1e3 N m/rad", "E-KEY-UNKNOWN", "bearing[0].torsion"),
        ("shaft[1].density", "0 kg/m^3", "E-RANGE", "shaft[1].density"),
        ("shaft[0].torsion", "rigid", "E-CHOICE", "shaft[0].torsion"),
        ("operation.torque[0].body", "mtor", "E-CHOICE", "operation.torque[0].body"),
        ("operation.torque[0].torque", "5 N m", "E-CHOICE", "operation.torque[0].torque"),
        ("operation.torque[1].body", "motor", "E-DUPLICATE", "operation.torque[1].body"),
        ("operation.torque[0].times", ["0 s", "2 s", "1 s", "3 s"], "E-TORQUE", "operation.torque[0].times"),
        ("operation.speed", "0 rpm", "E-RANGE", "operation.speed"),
        ("simulation.record", "7 kHz", "E-RANGE", "simulation.record"),
        ("simulation.settle", "3 s", "E-RANGE", "simulation.settle"),
        ("simulation.duration", "9e4 s", "E-RANGE", "simulation.duration"),
        ("simulation.contact_loss", "yes", "E-TYPE", "simulation.contact_loss"),
        ("model", 3, "E-TYPE", "model"),
    ],
)
def test_refusals(own, key, value, code, named):
    error = refused(own, **{key: value})
    assert error.code == code
    keys = [problem.key for problem in getattr(error, "problems", (error,))]
    assert named in keys


def test_chain_in_a_ring_and_in_pieces(own):
    """A second shaft between two bodies closes a loop; a shaft less leaves two pieces."""
    data = case_text.parse(to_toml(own), "")
    more = {"between": ["pinion", "motor"], "length": "1 m", "outer_diameter": "50 mm"}
    with pytest.raises(CaseError, match="closes a loop") as info:
        parse_case(case_text.write(data | {"shaft": [*data["shaft"], more]}))
    assert info.value.code == "E-DRIVETRAIN" and info.value.key == "shaft[2].between"
    with pytest.raises(CaseError, match="nothing joins fan to motor") as info:
        parse_case(case_text.write(data | {"shaft": data["shaft"][:1]}))
    assert info.value.code == "E-DRIVETRAIN" and info.value.key == "body[3].name"


def test_bearings_inside_a_shaft(own):
    """A stiff bearing in the middle of the shaft holds its station; there are three of them."""
    place = {"shaft": ["wheel", "fan"], "station": 2, "radial": "1e12 N/m"}
    data = case_text.parse(to_toml(own), "")
    case = parse_case(case_text.write(data | {"bearing": [*data["bearing"], place]}))
    free, held = case_model(own), case_model(case)
    rows = [held.index(f"shaft wheel-fan 2: {axis}") for axis in "xy"]
    assert held.system.K[rows, rows] - free.system.K[rows, rows] == pytest.approx([1e12, 1e12], rel=1e-6)
    rigid = data | {"bearing": [*data["bearing"], place | {"radial": "rigid"}]}
    assert len(case_model(parse_case(case_text.write(rigid))).rigid) == len(free.rigid) - 2
    for wrong in ({"station": 4}, {"shaft": ["fan", "wheel"]}, {"shaft": ["motor", "pinion"]}):
        with pytest.raises(CaseError, match="no such station"):
            parse_case(case_text.write(data | {"bearing": [*data["bearing"], place | wrong]}))


def test_mistakes_are_reported_at_once_with_their_lines(tmp_path):
    lines = PAPER.read_text(encoding="utf-8").splitlines()
    text = "\n".join(lines)
    text = text.replace('between = ["rotor", "carrier"]', 'between = ["roter", "carrier"]')
    text = text.replace("teeth = [128, 42]", "teeth = [128, 40]").replace("sun_teeth = 47", "sun_teeth = 43")
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as info:
        read_case(path)
    found = {problem.key: problem for problem in info.value.problems}
    assert set(found) == {
        "shaft[0].between",
        "parallel[0].teeth",
        "planetary[0].ring_teeth",
        "planetary[0].planets",
    }
    for key, word in (("shaft[0].between", "roter"), ("parallel[0].teeth", "[128, 40]")):
        line = int(found[key].file.rpartition(":")[2])
        assert word in text.splitlines()[line - 1]
    assert found["shaft[0].between"].remedy == "did you mean rotor?"
    assert "0.3125" in found["parallel[0].teeth"].message and found["parallel[0].teeth"].code == "E-TEETH"
    assert found["planetary[0].planets"].code == "E-ASSEMBLY"


@pytest.mark.parametrize(
    ("old", "new", "code", "key"),
    [
        ("planets = 3 ", "planets = 7 ", "E-NEIGHBOURS", "planetary[0].planets"),
        ("planets = 3 ", "planets = 4 ", "E-ASSEMBLY", "planetary[0].planets"),
        ('model = "drivetrain"\n', "", "E-KEY-MISSING", "model"),
        ('carrier = "carrier"', 'carrier = "sun"', "E-CHOICE", "planetary[0].sun"),
        ("contact_ratio = 1.78", "contact_ratio = nan", "E-FINITE", "parallel[0].mesh.contact_ratio"),
        ('torque = "15 kN m"', "share = 0.5", "E-TORQUE", "operation.torque[1].share"),
        ("[gravity]", "[gravitation]", "E-KEY-UNKNOWN", "gravitation"),
        ('"rotor", "carrier"]', '"rotor", "carrier", "sun"]', "E-COUNT", "shaft[0].between"),
    ],
)
def test_wrong_texts(old, new, code, key):
    text = PAPER.read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(CaseError) as info:
        parse_case(text.replace(old, new), name="wrong.toml")
    assert (info.value.code, info.value.key) == (code, key)
    # what is missing has no line
    assert "wrong.toml:" in info.value.file or code == "E-KEY-MISSING"


def test_what_only_the_model_can_tell(paper, own):
    error = refused_model(with_value(paper, "planetary[0].planet_bearing", "1e9 N/m"))
    assert error.code == "E-TURNING" and error.key == "simulation.turning"
    assert case_model(
        with_value(with_value(paper, "planetary[0].planet_bearing", "1e9 N/m"), "simulation.turning", False)
    )
    loose = with_value(own, "bearing", [{"body": "motor", "radial": "1e8 N/m", "tilt": "1e6 N m/rad"}])
    error = refused_model(loose)
    assert error.code == "E-MECHANISM" and ("wheel" in error.message or "fan" in error.message)
    data = case_text.parse(to_toml(paper), "")
    more = data["parallel"][0] | {"between": ["gear 1", "gear 3"]}
    error = refused_model(parse_case(case_text.write(data | {"parallel": [*data["parallel"], more]})))
    assert error.code == "E-DRIVETRAIN"


def refused_model(case):
    with pytest.raises(CaseError) as info:
        check_drivetrain(case)
    return info.value


def test_other_cases_are_read_as_before(own):
    assert not isinstance(read_case(CASES / "planetary_27_40_108.toml"), DrivetrainCase)
    assert "shaft" in case_schema("drivetrain")["properties"] and "sun" in case_schema()["properties"]
    with pytest.raises(CaseError, match="no planetary set") as info:
        planetary_set(own)
    assert info.value.code == "E-MODEL"


def test_check_prints_the_chain(paper):
    blocks = {block.title: block for block in DRIVETRAIN.describe_case(paper)}
    assert set(blocks) >= {"Bodies", "Shafts", "Gear stages", "Operation", "Warnings"}
    stages = {row[0]: row for row in blocks["Gear stages"].rows}
    assert stages["carrier-sun"][-1] == "18.4000" and stages["gear 2-gear 3"][-1] == "128.8766"
    assert any("W-TEETH" in note for note in blocks["Warnings"].notes)
