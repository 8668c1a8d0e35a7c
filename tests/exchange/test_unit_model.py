"""Gearbox cases as REXS units: what of a case comes back, and what is told that does not."""

import math
import tomllib
from pathlib import Path

import pytest
from casings import casing_tables
from rexs_stage import ParallelUnit
from rexs_units import IndustrialUnit, ThreeStageUnit
from small_gearbox import pair_tables

from femgear import cli
from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import LENGTH
from femgear.errors import CaseError
from femgear.exchange.rexs import Model, model_text, read_model
from femgear.trains.imports import case_drafts, rexs_model
from femgear.trains.reading import parse_case, read_case, with_values

CASES = Path(__file__).parents[2] / "cases"


def written(case, tmp_path) -> tuple[Model, list]:
    """The REXS file of a case, read again, and the findings of writing it."""
    model = rexs_model(case, "box.rexs")
    path = tmp_path / "box.rexs"
    path.write_text(model_text(model, "femgear", "0"), encoding="utf-8")
    return read_model(path), model.findings


def of_type(model: Model, kind: str) -> list:
    return [one for one in model.components.values() if one.type == kind]


@pytest.fixture
def unit(tmp_path):
    """Two spur stages with a conical part, a bore, a bearing of one sense that is stiff against tilt, and a force."""
    model = read_model(ParallelUnit().write(tmp_path / "unit.rexs"))
    tables = tomllib.loads(case_drafts(model, "unit.toml")[0].text)
    tables["shaft"][0]["part"][0] |= {"end_outer_diameter": "34 mm", "inner_diameter": "8 mm"}
    tables["bearing"][0] |= {"axial": "1e8 N/m", "axial_sense": "negative", "tilt": "3e4 N m/rad"}
    tables["load"][0] |= {"force": ["10 N", "20 N", "30 N"]}
    case = tables["operation"]["load_case"][0]
    name = tables["load"][0]["name"]
    second = case | {
        "name": "second",
        "share": 0.25,
        "torque": {name: "-40 N m"},
        "force": {name: ["1 N", "0 N", "0 N"]},
    }
    tables["operation"]["load_case"] = [case | {"share": 0.75}, second]
    tables["gravity"] = {"direction": [0.0, 0.0, 1.0]}
    return parse_case(case_text.write(tables))


def test_a_unit_of_pairs_comes_back(unit, tmp_path):
    model, findings = written(unit, tmp_path)
    assert not findings
    back = parse_case(case_drafts(model, "unit.toml")[0].text)
    for shaft, same in zip(unit.shaft, back.shaft, strict=True):
        assert shaft.part == same.part and unit.material_of(shaft) == back.material_of(same)
    stages = zip(unit.pair, back.pair, strict=True)
    for stage, same in stages:
        assert stage.positions == pytest.approx(same.positions, abs=1e-12)
        first, second = (planetary_set(parse_case(case_text.write(one.teeth))) for one in (stage, same))
        for gear, other in zip(first.gears, second.gears, strict=True):
            for key in ("teeth", "module", "profile_shift", "tip_radius", "root_radius", "rim_radius", "face_width"):
                assert getattr(gear, key) == pytest.approx(getattr(other, key), rel=1e-12, abs=1e-14), key
    for bearing, same in zip(unit.bearing, back.bearing, strict=True):
        assert (bearing.position, bearing.radial) == pytest.approx((same.position, same.radial))
        assert (bearing.axial, bearing.axial_sense, bearing.tilt) == (same.axial, same.axial_sense, same.tilt)
    assert [one.share for one in back.operation.load_case] == [0.75, 0.25]
    torques = [[*one.torque.values()] for one in back.operation.load_case]
    assert torques == [[100.0], [-40.0]]
    # forces of a place and of a load case add
    forces = [next(iter(one.force.values())) for one in back.operation.load_case]
    assert forces == [pytest.approx((10.0, 20.0, 30.0)), pytest.approx((11.0, 20.0, 30.0))]
    for case in back.operation.load_case:
        assert next(iter(case.speed.values())) == pytest.approx(1500.0 * math.pi / 30.0)


def test_angles_turn_from_w_towards_v(unit, tmp_path):
    model, _ = written(unit, tmp_path)
    first, second = (unit.shaft_named(name).axis for name in unit.pair[0].shafts)
    angle = math.radians(
        float(of_type(model, "cylindrical_stage")[0].attributes["rotating_angle_around_neg_u_axis"][0])
    )
    distance = 0.075
    assert (second[0] - first[0], second[1] - first[1]) == pytest.approx(
        (distance * math.sin(angle), distance * math.cos(angle)), abs=1e-12
    )


def test_weight_acts_in_the_axes_of_the_unit(unit, tmp_path):
    (gear_unit,) = of_type(written(unit, tmp_path)[0], "gear_unit")
    given = {key: value for key, (value, _) in gear_unit.attributes.items()}
    assert given["account_for_gravity"] == "true" and float(given["gravitational_acceleration"]) == 9.80665
    assert [float(given[f"direction_vector_gravity_{way}"]) for way in "uvw"] == [1.0, 0.0, 0.0]


def test_an_axle_with_a_planetary_set_is_written_whole(tmp_path):
    case = read_case(CASES / "e_axle.toml")
    model, findings = written(case, tmp_path)
    counts = {
        "shaft": 3 + 1 + 3 + 3,  # with those of the ring, of planets and of pins
        "rolling_bearing_with_detailed_geometry": 6,
        "rolling_element": 6,
        "cylindrical_stage": 1 + 6,
        "ring_gear": 1,
        "external_load": 2,
        "coupling": 1 + 2 * 3,
    }
    assert {kind: len(of_type(model, kind)) for kind in counts} == counts
    ball = of_type(model, "rolling_element")[0]
    assert model.number(ball, "diameter_of_rolling_element", LENGTH) == pytest.approx(9.5e-3)
    (planetary,) = of_type(model, "planetary_stage")
    (carrier,) = model.related("planet_carrier_shaft", "shaft", planetary_stage=planetary.id)
    assert carrier.name == "output"
    told = " ".join(f"{one.key} {one.text}" for one in findings)
    assert "mass[0]" in told and "pins" not in told


def test_feet_of_a_casing_are_left_out_and_told(tmp_path):
    case = read_case(pair_tables(teeth=True) | {"casing": casing_tables()})
    model, findings = written(case, tmp_path)
    assert [one.key for one in findings] == ["casing"]
    assert "stands still" in findings[0].text
    assert len(of_type(model, "gear_casing")) == 1


def test_stages_without_teeth_are_refused():
    tables = tomllib.loads((CASES / "e_axle.toml").read_text(encoding="utf-8"))
    del tables["pair"][0]["teeth"]
    tables["pair"][0] |= {
        "gears": {"teeth": [25, 72], "module": "1.59627 mm"},
        "mesh": {"stiffness": "3e8 N/m"},
    }
    case = parse_case(case_text.write(tables))
    with pytest.raises(CaseError, match="E-KEY-MISSING") as caught:
        rexs_model(case, "box.rexs")
    assert caught.value.key == "pair[0].teeth"


def test_the_command_writes_gearboxes(tmp_path, capsys):
    assert cli.main(["rexs", str(CASES / "e_axle.toml"), "-o", str(tmp_path / "axle.rexs")]) == 0
    assert "mass[0]" in capsys.readouterr().err
    assert read_model(tmp_path / "axle.rexs").version == "1.4"
    assert cli.main(["rexs", str(CASES / "gear_pair.toml"), "-o", str(tmp_path / "pair.rexs")]) == 2
    assert "E-MODEL" in capsys.readouterr().err


def test_bearings_keep_their_geometry(tmp_path):
    values = {
        "bearing[0].contact_angle": "15 deg",
        "bearing[0].clearance": "10 um",
        "bearing[0].preload": "2 um",
        "bearing[0].inner_osculation": 0.515,
        # in the sense of thrust that the angle takes
        "operation.load_case": [{"torque": {"motor": "35 N m"}, "speed": {"rotor": "9000 rpm"}}],
    }
    model, _ = written(with_values(read_case(CASES / "e_axle.toml"), values), tmp_path)
    bearing = of_type(model, "rolling_bearing_with_detailed_geometry")[0]
    row = model.related("assembly", "part", assembly=bearing.id)[0]
    got = {key: float(value) for key, (value, _) in row.attributes.items()}
    assert got["pressure_angle"] == pytest.approx(15.0) and got["number_of_rolling_elements"] == 9
    assert got["raceway_radius_of_inner_ring"] == pytest.approx(0.515 * 9.5)
    assert float(bearing.attributes["radial_bearing_clearance"][0]) == pytest.approx(10.0)
    assert float(bearing.attributes["preload_distance"][0]) == pytest.approx(2.0)


def _same(one, other, where: str = "") -> None:
    """Both values are equal, numbers to rounding."""
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            _same(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, list | tuple):
        assert len(one) == len(other), where
        for number, pair in enumerate(zip(one, other, strict=True)):
            _same(*pair, f"{where}[{number}]")
    elif isinstance(one, float) and math.isfinite(one):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-12), where
    else:
        assert one == other, where


@pytest.mark.parametrize("unit", ["e_axle", IndustrialUnit, ThreeStageUnit])
def test_what_is_written_is_read_again(unit, tmp_path):
    """Shafts, bearings, places of stages, pins, loads and load cases of an axle and of two published units."""
    if isinstance(unit, str):
        case = read_case(CASES / f"{unit}.toml")
    else:
        case = parse_case(case_drafts(read_model(unit().write(tmp_path / "unit.rexs")), "unit.toml")[0].text)
    back = parse_case(case_drafts(written(case, tmp_path)[0], "unit.toml")[0].text)
    assert [case.material_of(shaft) for shaft in case.shaft] == [back.material_of(shaft) for shaft in back.shaft]
    # REXS cannot say what is estimated, and writes the bearing of a planet at its gear
    left_out = {"shaft": {"material"}, "bearing": {"estimated"}, "pair": {"teeth"}, "planetary": {"teeth", "planet"}}
    for kind in ("shaft", "bearing", "coupling", "pair", "planetary", "load"):
        for one, other in zip(getattr(case, kind), getattr(back, kind), strict=True):
            without = left_out.get(kind, set())
            _same(one.model_dump(exclude=without), other.model_dump(exclude=without), kind)
    for one, other in zip(case.operation.load_case, back.operation.load_case, strict=True):
        _same(one.model_dump(exclude={"name"}), other.model_dump(exclude={"name"}), one.name)
    assert case.operation.output == back.operation.output
    for stage, same in zip((*case.pair, *case.planetary), (*back.pair, *back.planetary), strict=True):
        first, second = (planetary_set(parse_case(case_text.write(one.teeth))) for one in (stage, same))
        for gear, other in zip(first.gears, second.gears, strict=True):
            for key in ("teeth", "module", "profile_shift", "tip_radius", "root_radius", "rim_radius", "face_width"):
                assert getattr(gear, key) == pytest.approx(getattr(other, key), rel=1e-9, abs=1e-12), key


def test_hours_of_load_cases_are_durations(unit, tmp_path):
    """They come back as shares of the time, not as the whole time for each."""
    changes = {"operation.load_case[0].hours": 30.0, "operation.load_case[1].hours": 10.0}
    shares = {f"operation.load_case[{number}].share": None for number in (0, 1)}
    model, findings = written(with_values(unit, changes | shares), tmp_path)
    assert [finding.key for finding in findings] == ["operation.load_case"]
    back = parse_case(case_drafts(model, "unit.toml")[0].text)
    assert [load_case.share for load_case in back.operation.load_case] == pytest.approx([0.75, 0.25])
