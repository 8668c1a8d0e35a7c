"""Cases of gear pairs: the shipped pairs without dimensions, what is refused, and what is said."""

import json
import math

import numpy as np
import pytest
from published.multistage_example import CASES
from small_trains import example_pair, lightly_loaded_pair

from femgear import cli
from femgear.errors import CaseError
from femgear.trains import registry
from femgear.trains.impacts.case_file import pair_of, scales_of
from femgear.trains.impacts.model import separation_ratios
from femgear.trains.impacts.stages import GEAR_PAIR
from femgear.trains.reading import parse_case, read_case, to_toml, with_value, with_values


@pytest.fixture(scope="module")
def case():
    return read_case(CASES / "gear_pair.toml")


def same(one, other):
    return all(getattr(one, name) == getattr(other, name) for name in other.__dataclass_fields__)


def test_shipped_pairs_are_those_of_the_page(case):
    """To the last digit: chaotic motions remember it."""
    assert registry.train_of(case) is GEAR_PAIR
    assert same(pair_of(case), example_pair(0.09))
    assert same(pair_of(read_case(CASES / "gear_pair_light.toml")), lightly_loaded_pair())


def test_units_of_the_pair(case):
    scales = scales_of(case)
    mass = 1.0 / (0.04**2 / 1.2e-3 + 0.06**2 / 6e-3)
    assert scales.frequency == pytest.approx(math.sqrt(4e8 / mass))
    assert (scales.length, scales.force) == pytest.approx((30e-6, 12e3))


def test_waves_bearings_and_eccentricities_in_their_units(case):
    made = pair_of(
        with_values(
            case,
            {
                "mesh.error": ["15 um", "3 um"],
                "mesh.error_angles": ["90 deg", "0 deg"],
                "gears.eccentricity": ["6 um", "0 um"],
                "gears.eccentricity_angles": ["180 deg", "0 deg"],
                "gears.mass": ["2 kg", "4 kg"],
                "gears.bearing_stiffness": ["2e8 N/m", "8e8 N/m"],
            },
        )
    )
    assert made.tooth_error == pytest.approx((0.5j, 0.1)) and made.eccentricity == pytest.approx((-0.2, 0.0))
    equivalent = 4e8 / scales_of(case).frequency ** 2
    assert made.bearings.mass == pytest.approx((2.0 / equivalent, 4.0 / equivalent))
    assert made.bearings.stiffness == (0.5, 2.0) and made.periods == 20


def test_text_of_a_case_gives_it_again(case):
    for one in (case, read_case(CASES / "gear_pair_light.toml")):
        assert parse_case(to_toml(one)) == one


@pytest.mark.parametrize(
    ("key", "value", "code", "named"),
    [
        ("gears.teeth", [20], "E-RANGE", "gears.teeth"),
        ("gears.teeth", [20, 2], "E-RANGE", "gears.teeth[1]"),
        ("gears.inertia", ["1 kg", "1 kg m^2"], "E-UNIT", "gears.inertia[0]"),
        ("gears.base_radii", None, "E-KEY-MISSING", "gears.base_radii"),
        ("gears.mass", ["1 kg", "1 kg"], "E-KEY-MISSING", "gears.bearing_stiffness"),
        ("gears.eccentricity", ["-1 um", "0 um"], "E-RANGE", "gears.eccentricity[0]"),
        ("mesh.stiffness", "0 N/m", "E-RANGE", "mesh.stiffness"),
        ("mesh.stiffness_waves", [0.6, -0.5], "E-RANGE", "mesh.stiffness_waves"),
        ("mesh.stiffness_angles", ["0 deg", "0 deg"], "E-COUNT", "mesh.stiffness_angles"),
        ("mesh.backlash", "0 um", "E-RANGE", "mesh.backlash"),
        ("mesh.backlash", 60, "E-UNIT", "mesh.backlash"),
        ("mesh.damping_ratio", 1.0, "E-RANGE", "mesh.damping_ratio"),
        ("mesh.error", "21 um", "E-TYPE", "mesh.error"),
        ("mesh.errors", ["21 um"], "E-KEY-UNKNOWN", "mesh.errors"),
        ("operation.torque", "1 N", "E-UNIT", "operation.torque"),
        ("response.harmonics", 0, "E-RANGE", "response.harmonics"),
        ("response.to", 3.5, "E-RANGE", "response.to"),
        ("response.to", 0, "E-RANGE", "response.to"),
        ("sweep.ranges", [], "E-RANGE", "sweep.ranges"),
        ("sweep.ranges", [{"from": 0.6, "to": 1.0}], "E-KEY-MISSING", "sweep.ranges[0].count"),
        ("chaos", {"from": 1.0, "to": 2.0, "count": 3, "points": 7}, "E-RANGE", "chaos.points"),
        ("chaos", {"from": 1.0, "to": 1.0, "count": 3}, "E-RANGE", "chaos.to"),
    ],
)
def test_what_is_refused(case, key, value, code, named):
    with pytest.raises(CaseError) as info:
        with_value(case, key, value)
    assert (code, named) in {(problem.code, problem.key) for problem in info.value.problems}


def test_two_eccentric_gears_of_one_speed_are_refused(case):
    with pytest.raises(CaseError, match="E-RANGE"):
        with_values(case, {"gears.teeth": [20, 20], "gears.eccentricity": ["1 um", "1 um"]})


def test_an_eccentric_gear_needs_a_stage_in_time():
    light = read_case(CASES / "gear_pair_light.toml")
    eccentric = with_value(light, "gears.eccentricity", ["1 um", "0 um"])
    with pytest.raises(CaseError, match="E-KEY-MISSING") as info:
        with_value(eccentric, "chaos", None)
    assert info.value.key == "sweep"


def test_mistakes_name_file_line_and_key(tmp_path, capsys):
    text = (CASES / "gear_pair.toml").read_text(encoding="utf-8")
    path = tmp_path / "wrong.toml"
    wrong = text.replace('backlash = "60 um"', 'backlash = "60 mm"').replace("harmonics = 12", "harmonic = 12")
    path.write_text(wrong, encoding="utf-8")
    assert cli.main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    for start, key in (("backlash", "mesh.backlash"), ("harmonic ", "response.harmonic")):
        line = next(n for n, one in enumerate(wrong.splitlines(), 1) if one.startswith(start))
        assert f"wrong.toml:{line}: {key}" in said
    assert "a factor of 0.001" in said and "did you mean harmonics?" in said


def test_check_tells_units_and_where_flanks_part(case, capsys):
    assert cli.main(["check", str(CASES / "gear_pair.toml")]) == 0
    said = capsys.readouterr().out
    first, last = separation_ratios(damping_ratio=0.09, load=0.9, error=0.72)
    assert f"begin to part at {first:.4f} and {last:.4f}" in said and "4425.92" in said
    assert tuple(GEAR_PAIR.warnings(case)) == ()
    bare = with_values(case, {"operation.torque": "0 N m", "mesh.error": [], "mesh.stiffness_waves": []})
    assert [warning.code for warning in GEAR_PAIR.warnings(bare)] == ["W-LOAD", "W-EXCITATION"]
    assert cli.main(["schema", "--model", "gear_pair"]) == 0
    assert "ImpactMeshSection" in json.loads(capsys.readouterr().out)["$defs"]
    assert np.isfinite(scales_of(bare).frequency)
