"""Files of the former model "multistage" are gearbox cases when they are read, and are refused by their own entries."""

import tomllib

import numpy as np
import pytest
from published.multistage_example import CASES, published_case

from femgear.errors import CaseError
from femgear.system.fourier import harmonics_of
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.reading import read_case, to_toml, with_values

FORMER = """\
model = "multistage"
title = "Two stages"

[[stage]]
planets = 3
[stage.gears]
teeth = [21, 42, 105]
module = "2.5 mm"
face_width = "40 mm"
addendum = [1.0, 1.0, 0.9]
[stage.sun]
mass = "0.679732657989364 kg"
inertia = "0.35023418914232285 kg m^2"
support_stiffness = "1e8 N/m"
[stage.planet]
mass = "2.0391979739680917 kg"
inertia = "0.00351283713484347 kg m^2"
bearing_stiffness = "3e8 N/m"
[stage.ring]
mass = "2.6881037540441115 kg"
inertia = "0.049969328690410625 kg m^2"
support_stiffness = "2e9 N/m"
torsional_stiffness = "30422874.977166776 N m/rad"
[stage.carrier]
mass = "8.700578022263862 kg"
inertia = "0.04796193634772955 kg m^2"
support_stiffness = "3e8 N/m"

[[stage]]
[stage.gears]
teeth = [21, 33, 87]
module = "5 mm"
face_width = "70 mm"
addendum = [1.0, 1.0, 0.9]
[stage.sun]
mass = "4.758128605925548 kg"
inertia = "0.006557295985041145 kg m^2"
[stage.planet]
mass = "8.812248387504972 kg"
inertia = "0.03748647849215983 kg m^2"
bearing_stiffness = "8e8 N/m"
[stage.ring]
mass = "15.709376984643077 kg"
inertia = "0.8146293802598975 kg m^2"
support_stiffness = "4e9 N/m"
torsional_stiffness = "167089879.8745943 N m/rad"
[stage.carrier]
mass = "42.90084118567161 kg"
inertia = "0.6663372059471389 kg m^2"
support_stiffness = "6e8 N/m"

[[coupling]]
between = ["stage 1 carrier", "stage 2 sun"]
diameter = "45 mm"
length = "120 mm"

[operation]
speed = "1500 rpm"
torque = "350 N m"

[response]
lowest = "300 rpm"
highest = "2000 rpm"
points = 5
harmonics = 4
damping_ratio = 0.02
"""


def changed(**entries) -> dict:
    """Tables of the file with other entries: of its stages, keys such as ``stage_2``, or of its tables."""
    tables = tomllib.loads(FORMER)
    for key, values in entries.items():
        name, _, number = key.partition("_")
        table = tables[name][int(number) - 1] if number else tables[name]
        for entry, value in values.items():
            if value is None:
                del table[entry]
            else:
                table[entry] = table[entry] | value if isinstance(table.get(entry), dict) else value
    return tables


def shipped() -> dict:
    """Tables of the first two stages of the shipped reducer."""
    tables = tomllib.loads((CASES / "four_stage_reducer.toml").read_text(encoding="utf-8"))
    kept = ("stage 1", "stage 2")
    for kind, key in (("shaft", "name"), ("planetary", "name"), ("mass", "shaft"), ("bearing", "shaft")):
        tables[kind] = [entry for entry in tables[kind] if entry[key].startswith(kept)]
    tables["coupling"] = [
        one for one in tables["coupling"] if all(end.startswith((*kept, "cas")) for end in one["between"])
    ]
    tables["operation"]["output"] = ["stage 2 carrier"]
    return tables


def test_a_former_file_is_the_gearbox_that_says_the_same(tmp_path):
    path = tmp_path / "former.toml"
    path.write_text(FORMER)
    former, today = read_case(path), read_case(shipped())
    assert former.train == "gearbox" and former.title == "Two stages"
    states = [solve_deflection(case) for case in (former, today)]
    frequency = [np.sort(solve_gearbox_modes(state).modes.frequency) for state in states]
    assert frequency[0] == pytest.approx(frequency[1], rel=1e-9, abs=1e-3)
    for number in (0, 1):
        lines = [harmonics_of(excitation_of(state, state.model.stages[number]).stiffness, 6) for state in states]
        assert lines[0] == pytest.approx(lines[1], rel=1e-9, abs=1.0)
    assert former.runup.count == 5 and former.dynamics.mesh_harmonics == 4 and former.modes.damping_ratio == 0.02
    assert [(one.code, one.key) for one in former.notices] == [("W-FORMER", "model")]
    # what is written and changed is the gearbox
    assert read_case(to_toml(former)) == former and not read_case(to_toml(former)).notices
    assert with_values(former, {"runup.count": 7}).runup.count == 7


def test_base_radii_without_teeth_and_operation_have_modes_alone():
    stage = {
        "radii": {"sun": "13.652 mm", "planet": "40.254 mm"}
        | {"mesh_stiffness": {"sun_planet": "9.271e6 N/mm", "planet_ring": "1.642e7 N/mm"}},
        "sun": {"mass": "0.241 kg", "inertia": "19.375 kg mm^2", "support_stiffness": "rigid"},
        "planet": {"mass": "0.575 kg", "inertia": "571.163 kg mm^2", "bearing_stiffness": "rigid"},
        "carrier": {"mass": "1.893 kg", "inertia": "6082.317 kg mm^2", "support_stiffness": "rigid"},
        "ring": {"mass": "1 kg", "inertia": "1 kg m^2", "support_stiffness": "rigid", "torsional_stiffness": "rigid"},
    }
    case = read_case({"model": "multistage", "title": "one stage", "stage": [stage]})
    sizes, today = case.planetary[0].gears, published_case(planets=3).planetary[0].gears
    assert sizes.base_radii == pytest.approx(today.base_radii) and sizes.teeth == today.teeth
    assert set(gearbox_flow(case).speed.values()) == {0.0}
    found = solve_gearbox_modes(solve_deflection(case))
    assert [*found.stages.kinds].count("rigid") == 1


def test_stages_may_be_held_elsewhere_and_joined_by_their_rings():
    tables = changed(
        stage_1={"fixed": "none", "ring": {"torsional_stiffness": "0 N m/rad"}},
        stage_2={"fixed": "carrier", "carrier": {"torsional_stiffness": "1e8 N m/rad"}, "angle": "20 deg"},
    )
    tables["operation"]["output"] = "stage 2 sun"
    tables["stage"][1]["ring"]["torsional_stiffness"] = "0 N m/rad"
    tables["coupling"] = [
        {"between": ["stage 1 carrier", "stage 2 ring"], "torsional": "1e6 N m/rad", "lateral": "1e7 N/m"},
        {"between": ["stage 1 ring", "stage 2 sun"], "torsional": "rigid"},
    ]
    case = read_case(tables)
    speed = gearbox_flow(case).speed
    w1, w2 = speed["stage 1 carrier"], speed["stage 2 sun"]
    # Willis in both stages: 21 (w_s - w_c) = -105 (w_r - w_c), and 21 w_s = -87 w_r with the carrier held
    assert 21.0 * (speed["stage 1 sun"] - w1) == pytest.approx(-105.0 * (w2 - w1))
    assert 21.0 * w2 == pytest.approx(-87.0 * w1)
    assert solve_gearbox_modes(solve_deflection(case)).modes.frequency.min() == 0.0


def test_what_a_gearbox_has_no_place_for_is_told():
    told = read_case(changed(response={"balance_points": 3})).notices
    assert [(one.code, one.key) for one in told[1:]] == [("W-UNUSED", "response.balance_points")]


@pytest.mark.parametrize(
    ("change", "code", "key"),
    [
        ({"stage_1": {"gears": {"teeth": [21, 42, 108]}}}, "E-COAXIAL", "stage[0].gears.profile_shifts"),
        ({"stage_2": {"gears": None}}, "E-CHOICE", "stage[1].gears"),
        (
            {"stage_1": {"ring": {"torsional_stiffness": "0 N m/rad"}}},
            "E-MECHANISM",
            "stage[0].ring.torsional_stiffness",
        ),
        ({"stage_1": {"sun": {"mas": "1 kg"}}}, "E-KEY-UNKNOWN", "stage[0].sun.mas"),
        ({"coupling_1": {"length": None}}, "E-CHOICE", "coupling[0].between"),
        ({"coupling_1": {"between": ["stage 1 carrier", "stage 3 sun"]}}, "E-CHOICE", "coupling[0].between"),
    ],
)
def test_refusals_name_the_entry(change, code, key):
    with pytest.raises(CaseError) as found:
        read_case(changed(**change))
    assert (code, key) in [(one.code, one.key) for one in found.value.problems]


def test_refusals_name_the_line(tmp_path):
    path = tmp_path / "former.toml"
    path.write_text(FORMER.replace("points = 5", 'points = "five"'))
    with pytest.raises(CaseError, match=r"former\.toml:64: response\.points"):
        read_case(path)
