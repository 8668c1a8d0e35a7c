"""Answers of a handle after changes against answers computed from nothing, and what is kept."""

import random
from pathlib import Path
from types import UnionType
from typing import get_args

import numpy as np
import pytest
from pydantic import BaseModel

import femgear
from femgear.case import dependencies
from femgear.case.dependencies import Steps
from femgear.case.planetary import Case
from femgear.errors import CaseError, GeometryError
from femgear.trains.live import Answer, Live
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
STAGES = ("static", "stress", "modes", "dynamics", "housing")
COARSE = {
    "static.flank_elements": 4,
    "static.positions": 8,
    "dynamics.up_to": "12 kHz",
    "operation.speeds": ["1000 rpm", "3100 rpm"],
    "housing.published": None,
}
SUPPORT = {"angle": "30 deg", "radial_stiffness": "2e8 N/m", "tangential_stiffness": "0 N/m"}
RELIEF = {"kind": "tip relief", "amount": "6 um", "start_diameter": "43 mm"}
SHAFT = [{"length": "40 mm", "outer_diameter": "20 mm"}]
# by what belongs together, a value of every entry that is not the reference set's
CHANGES: tuple[dict[str, object], ...] = (
    {"title": "another set"},
    {"set.planets": 2, "set.planet_angles": ["0 deg", "178.6666666666667 deg"], "planet.individual": None},
    {"sun.profile_shift": None, "ring.profile_shift": None, "set.centre_distance": "51.02 mm"},
    {"set.face_width": "24 mm"},
    {"set.planet_angles": ["0 deg", "120 deg", "242.6666666666667 deg"]},
    {"set.backlash": "0.08 mm"},
    {"set.pin_errors": [{"planet": 2, "radial": "3 um", "tangential": "5 um"}]},
    {"rack.dedendum": 1.27},
    {"rack.addendum": 0.99},
    {"rack.root_radius": 0.24},
    {"material.youngs_modulus": "200 GPa"},
    {"material.poisson_ratio": 0.29},
    {"material.density": "7700 kg/m^3"},
    {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"},
    {"planet.dynamic_rating": "20 kN", "planet.bearing_kind": "ball"},
    {"planet.bearing_pitch_diameter": "27 mm"},
    {"operation.load_case": [{"name": "run", "torque": "30 N m", "speed": "500 rpm", "share": 1.0}]},
    {
        "operation.load_case": [{"torque": "30 N m", "speed": "500 rpm", "hours": 100}],
        "operation.required_hours": 200,
    },
    {
        "material.treatment": "case hardened steel",
        "material.grade": "ME",
        "material.hardness": 720,
        "material.estimated": True,
    },
    {
        "strength.edition": 2006,
        "strength.application_factor": 1.25,
        "strength.quality": 6,
        "strength.modification": "proven",
        "strength.pitting": "limited",
        "strength.reversal_factor": 0.8,
        "strength.required_root_safety": 1.4,
        "strength.required_flank_safety": 1.1,
    },
    {
        "lubricant": {
            "kind": "PAO",
            "viscosity_40": "100 mm^2/s",
            "viscosity_100": "15 mm^2/s",
            "viscosity": "30 mm^2/s",
            "temperature": "80 degC",
            "density": "840 kg/m^3",
            "friction_factor": 0.75,
            "supply": "spray",
            "fzg_stage": 11,
            "permissible_film": 0.2,
        },
        "losses": {
            "friction": "table",
            "coefficient": 0.05,
            "table": {"line_loads": ["100 N/mm"], "speeds": ["1 m/s", "10 m/s"], "coefficients": [[0.06, 0.04]]},
            "roughness": "0.5 um",
            "bearings": False,
            "seal": [{"shaft": "sun", "diameter": "20 mm"}],
            "torque_shares": [1.0],
            "speed_shares": [0.5],
        },
    },
    {"losses": {"friction": "constant", "coefficient": 0.05, "excites": True}},
    {"sun.pressure_angle": "20.1 deg", "sun.profile_shift": None},
    {"sun.bore_radius": "9.5 mm"},
    {"sun.face_width": "26 mm"},
    {"sun.material": {"youngs_modulus": "204 GPa", "poisson_ratio": 0.31, "density": "7800 kg/m^3"}},
    {"sun.mass": "0.3 kg"},
    {"sun.inertia": "2e-4 kg m^2"},
    {"sun.support_stiffness": "3e7 N/m"},
    {"sun.support_stiffness": None, "sun.support_shaft": SHAFT},
    {"sun.tip_diameter": "45 mm"},
    {"sun.root_diameter": "37.9 mm"},
    {"sun.rack": {"root_radius": 0.22}},
    {"sun.modifications": [RELIEF]},
    {"sun.modifications": [RELIEF | {"shape": "parabolic"}]},
    {"sun.modifications": [{"kind": "profile slope", "amount": "4 um"}]},
    {"sun.errors": {"thickness_reduction": "10 um"}},
    {"planet.bore_radius": "17.5 mm"},
    {"planet.face_width": "24 mm"},
    {"planet.material": {"youngs_modulus": "204 GPa", "density": "7800 kg/m^3"}},
    {"planet.mass": "0.4 kg"},
    {"planet.inertia": "3e-4 kg m^2"},
    {"planet.bearing_stiffness": "2e8 N/m"},
    {"planet.bearing_clearance": "5 um"},
    {"planet.tip_diameter": "62.9 mm"},
    {"planet.root_diameter": "56.2 mm"},
    {"planet.rack": {"dedendum": 1.26}},
    {"planet.modifications": [{"kind": "profile crowning", "amount": "5 um", "flank": "ring side"}]},
    {"planet.individual": [{"planet": 2, "thickness_reduction": "8 um"}]},
    {"ring.outer_radius": "99 mm"},
    {"ring.face_width": "26 mm"},
    {"ring.material": {"youngs_modulus": "204 GPa", "density": "7800 kg/m^3"}},
    {"ring.cutter_teeth": 32},
    {"ring.cutter_profile_shift": 0.05},
    {"ring.foundation_radial": "2e10 N/m^3"},
    {"ring.foundation_tangential": "8e9 N/m^3"},
    {"ring.tip_diameter": "159.2 mm"},
    {"ring.modifications": [{"kind": "profile slope", "amount": "3 um"}]},
    {"ring.errors": {"thickness_reduction": "10 um"}},
    {"sun.fault": [{"kind": "wear", "flank": "left", "depth": "5 um"}]},
    {"planet.fault": [{"kind": "wear", "flank": "sun side", "depth": "4 um"}]},
    {"ring.fault": [{"kind": "wear", "flank": "left", "depth": "3 um"}]},
    {"carrier.mass": "2 kg"},
    {"carrier.inertia": "7e-3 kg m^2"},
    {"carrier.support_stiffness": "1e8 N/m"},
    {"carrier.support_stiffness": None, "carrier.support_shaft": SHAFT},
    {"motor.inertia": "0.03 kg m^2"},
    {"motor.coupling_stiffness": "500 N m/rad"},
    {"motor": None},
    {"brake.inertia": "0.3 kg m^2"},
    {"brake.coupling_stiffness": "4000 N m/rad"},
    {"operation.input": "carrier", "operation.torque": "480 N m"},
    {"operation.torque": "110 N m"},
    {"operation.torque": "-110 N m"},
    {
        "operation.load_case": [
            {"name": "often", "torque": "60 N m", "speed": "900 rpm", "share": 0.9},
            {"name": "seldom", "torque": "120 N m", "speed": "600 rpm", "share": 0.1},
        ],
        "operation.required_hours": 20000.0,
        "planet.dynamic_rating": "20 kN",
        "planet.bearing_kind": "ball",
    },
    {
        "operation.load_case": [{"name": "always", "torque": "60 N m", "speed": "900 rpm", "hours": 3000.0}],
        "strength.pitting": "limited",
        "strength.reversal_factor": 0.8,
        "strength.required_root_safety": 1.4,
        "strength.required_flank_safety": 1.1,
    },
    {"operation.speeds": ["900 rpm", "2000 rpm"]},
    {"operation.speeds": ["900 rpm", "9000 rpm"], "dynamics.up_to": "40 kHz"},
    {"static.positions": 9, "static.longest_record": 50},
    {"static.peaks": False},
    {"static.contact": "line_of_action"},
    {"static.flank_elements": 5},
    {"static.members": "elastic"},
    {"static.members": "elastic", "planet.bearing_clearance": "5 um"},
    {"static.back_flanks": True},
    {"static.stresses": False},
    {"static.depth": "0.8 mm"},
    {"static.slices": 5},
    {"dynamics.damping_ratio": 0.03},
    {"dynamics.up_to": "14 kHz"},
    {"dynamics.up_to": None, "dynamics.mesh_harmonics": 6, "dynamics.response_harmonics": 16},
    {"dynamics.tolerance": 1e-8},
    {"housing.form": "linear", "housing.points": 60},
    {"housing.sensor_angle": "11 deg"},
    {
        "housing.level_limit": [{"speed": "1000 rpm", "level": "100 m/s^2"}],
        "housing.microphone": {"level_limit": [{"speed": "1000 rpm", "level": 60.0}]},
    },
    {"housing.microphone": {"distance": "2 m", "angle": "40 deg"}},
    {"housing.sensor": [{"name": "foot", "angle": "5 deg", "direction": "30 deg", "width": "9 mm"}]},
    {"housing.support": [SUPPORT], "housing.nodal_diameters": 4},
    {"housing.support": [SUPPORT | {"tangential_stiffness": "1e8 N/m"}], "housing.nodal_diameters": 5},
    {"housing.support": [SUPPORT | {"mass": "0.5 kg", "width": "10 mm"}], "housing.nodal_diameters": 4},
    {"runup": {"from": "500 rpm", "to": "3000 rpm", "count": 20}},
)
# entries of files, of slices, or without which no set is: others of their tables decide the same
ELSEWHERE = (
    "housing.assumptions",
    ".span",
    ".over_balls",
    ".ball_diameter",
    ".tooth_thickness",
    "format",
    "set.helix_angle",
    "teeth",
    "sun.module",
    "operation.fixed",
    "tilt_stiffness",
    "misalignment",
    "torque_end",
    "torsion_diameter",
    "wind_up_stiffness",
    "housing.structure",
    "housing.published",
    "housing.measured",
    ".errors",
    ".fault",
    "modifications",
    "individual",
    ".material",
    ".rack",
    "planet.profile_shift",
    "ring.profile_shift",
    "ring.root_diameter",
    "material.root_stress_limit",
    "inner_diameter",
    "support.angle",
    "pin_errors",
)


@pytest.fixture(scope="module")
def coarse(coarse_states):
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), COARSE)


@pytest.fixture(scope="module")
def grids(tmp_path_factory):
    return tmp_path_factory.mktemp("grids")


def leaves(model, prefix=""):
    """Dotted keys of all entries of a case file, without the numbers of tables in lists."""
    for name, entry in model.model_fields.items():
        kinds, inside = [entry.annotation], []
        while kinds:
            kind = kinds.pop()
            if isinstance(kind, type) and not isinstance(kind, UnionType) and issubclass(kind, BaseModel):
                inside.append(kind)
            kinds += get_args(kind)
        if inside:
            yield from leaves(inside[0], f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"


def assert_equal(answer, fresh, stages=STAGES):
    """Whether all numbers of the stages agree to 1e-12 of the largest of their variable."""
    for stage in stages:
        here, there = answer[stage].dataset(), fresh[stage].dataset()
        assert here.attrs.keys() == there.attrs.keys(), stage
        for name, value in there.attrs.items():
            assert here.attrs[name] == (
                value if isinstance(value, str) else pytest.approx(value, rel=1e-12, nan_ok=True)
            )
        assert here.variables.keys() == there.variables.keys(), stage
        for name, values in there.variables.items():
            if values.dtype.kind not in "fc":
                np.testing.assert_array_equal(here[name].values, values.values, err_msg=f"{stage}: {name}")
                continue
            scale = np.abs(values.values[np.isfinite(values.values)]).max(initial=1e-300)
            np.testing.assert_allclose(
                here[name].values, values.values, rtol=0.0, atol=1e-12 * scale, err_msg=f"{stage}: {name}"
            )


def fresh_answer(case, grids):
    return Answer(case, Steps(), cache=grids)


def test_every_entry_is_changed():
    def keys(key, value):
        if isinstance(value, list) and value and isinstance(value[0], dict):
            return {inner for one in value for inner in keys(key, one)}
        if isinstance(value, dict):
            return {inner for name, one in value.items() for inner in keys(f"{key}.{name}", one)}
        return {key.replace("runup.from", "runup.start")}

    given = {inner for changes in CHANGES for key, value in changes.items() for inner in keys(key, value)}
    assert [key for key in leaves(Case) if key not in given and not any(one in key for one in ELSEWHERE)] == []


def apply(handle, changes, coarse):
    """Change the case as it stands, or where the changes do not go with it, the coarse set alone."""
    try:
        return handle.change(changes)
    except (CaseError, GeometryError):
        handle.back_to(handle.answer.of(coarse))
        return handle.change(changes)


@pytest.mark.slow
def test_answers_are_those_of_a_fresh_computation(coarse, grids):
    """Every entry changed once in a random order; some of the changes stay, as far as they go together."""
    draw, handle = random.Random(0), Live(coarse, cache=grids)
    for changes in draw.sample(CHANGES, len(CHANGES)):
        before, answer = handle.answer, apply(handle, changes, coarse)
        stages = [stage for stage in STAGES if stage != "stress" or "stress" in answer]
        assert_equal(answer, Answer(answer.case, Steps(), cache=grids), stages)
        # the response on supports takes minutes in all
        if draw.random() < 0.7 or "housing.support" in changes:
            handle.back_to(before)


def test_what_a_change_does_not_concern_is_kept(coarse, grids):
    """And the rest is what a fresh computation gives, also after a way back."""
    handle = Live(coarse, cache=grids)
    first = {stage: handle.answer[stage] for stage in STAGES}
    for changes, concerned in (
        ({"title": "x", "material.root_stress_limit": "430 MPa"}, set()),
        ({"housing.microphone.distance": "3 m"}, {"housing"}),
        ({"operation.speeds": ["900 rpm"]}, {"dynamics", "housing"}),
        ({"carrier.mass": "2 kg"}, {"modes", "dynamics", "housing"}),
    ):
        handle.change(changes)
        assert {stage for stage, changed in handle.changed.items() if changed} - {"runup"} == concerned
        for stage in STAGES:
            assert (handle.answer[stage] is first[stage]) == (stage not in concerned)
    answer = handle.change({"operation.torque": "110 N m"})
    assert all(handle.changed[stage] for stage in STAGES)
    assert answer.static.bodies is first["static"].bodies
    assert_equal(answer, Answer(answer.case, Steps(), cache=grids), ("modes", "dynamics", "housing"))
    back = handle.change({"operation.torque": "100 N m", "carrier.mass": "3 kg"})
    assert back.modes is first["modes"] and not handle.changed["modes"]
    assert handle.back_to(answer) is handle.answer and not any(handle.changed[stage] for stage in STAGES[2:])
    assert answer.case.operation.torque == 110.0


def test_a_refused_change_leaves_the_case_as_it_was(coarse, grids):
    handle = Live(coarse, cache=grids)
    before = handle.answer
    with pytest.raises(CaseError) as refused:
        handle.change({"operation.torqe": "90 N m", "sun.teeth": "many", "dynamics.damping_ratio": -1})
    assert {one.key for one in refused.value.problems} == {
        "operation.torqe",
        "sun.teeth",
        "dynamics.damping_ratio",
    }
    with pytest.raises(CaseError) as refused:
        handle.change({"operation.torque.more": 1, "sun.modifications[4].amount": "1 um"})
    assert len(refused.value.problems) == 2
    with pytest.raises(CaseError, match="no tooth carries load"):
        handle.change({"operation.torque": "0 N m"})
    with pytest.raises(GeometryError, match="overlap"):
        handle.change({"set.planets": 9})
    with pytest.raises(CaseError, match="a key is a text"):
        handle.change({1: 2})
    with pytest.raises(CaseError, match="by a mapping"):
        handle.change("operation.torque")
    assert handle.answer is before
    assert handle.case == coarse


def test_large_results_leave_when_others_come(monkeypatch):
    monkeypatch.setattr(dependencies, "_ROOM", 2.5 * 8000)
    steps, large = Steps(), [(np.zeros(1000), number) for number in range(6)]
    for number, result in enumerate(large):
        assert steps.keep("large", {"number": number}, result) is result
        steps.keep("small", {"number": number}, (np.zeros(1), number))
    assert [steps.kept("large", {"number": i}) is not None for i in range(6)] == [False] * 4 + [True] * 2
    assert [steps.kept("small", {"number": i}) is not None for i in range(6)] == [False] * 2 + [True] * 4
    monkeypatch.setattr(dependencies, "_ROOM", 1.0)
    steps.keep("large", {"number": 7}, large[0])
    assert steps.kept("large", {"number": 7}) is large[0] and steps.kept("large", {"number": 5}) is None


def test_answers_are_mappings_of_the_stages(coarse):
    answer = Answer(coarse, Steps())
    assert list(answer) == ["static", "stress", "modes", "runup", "dynamics", "housing"]
    assert len(answer) == 6
    assert "static" in dir(answer) and "static" in answer and "transient" not in answer
    assert repr(answer).endswith("computed: nothing yet>")
    with pytest.raises(AttributeError, match="statics"):
        answer.statics  # noqa: B018
    with pytest.raises(CaseError, match="no stage transient"):
        answer["transient"]


@pytest.mark.parametrize(
    ("name", "kept", "anew"),
    [
        pytest.param(
            "helical_30_20_70",
            {"helical.hand": "left"},
            {"helical.helix_angle": "21 deg"},
            marks=pytest.mark.slow,
        ),
        ("nrel_pgb_static", {"planar.torsion.sun": "3e6 N m/rad"}, {"operation.torque": "170000 N m"}),
        ("spur_pair", {"dynamics.damping_ratio": 0.03}, {"operation.torque": "150 N m"}),
    ],
)
def test_handles_of_other_trains_keep_their_static_solution(name, kept, anew, grids):
    coarse = {"static.flank_elements": 4, "static.positions": 12}
    handle = Live(with_values(read_case(CASES / f"{name}.toml"), coarse), cache=grids)
    first = handle.answer.static
    assert handle.change(kept).static is first and not handle.changed["static"]
    answer = handle.change(anew)
    assert handle.changed["static"]
    assert_equal(answer, Answer(answer.case, Steps(), cache=grids), ("static",))


def test_handles_of_other_trains_answer_too():
    """A train that names no entries computes its stages anew after every change."""
    handle = femgear.live(CASES / "gear_pair_light.toml")
    handle.change({"response.harmonics": 4, "response.largest_step": 0.3})
    last = next(iter(handle.answer))
    first = handle.answer[last]
    assert handle.change({"title": "another"}).case.title == "another"
    assert handle.answer[last] is not first
    assert handle.answer[last].dataset().equals(first.dataset())
