"""Friction that acts in a gearbox: the sources and the response of the pair and the set that its stage is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.gears.friction import sliding_per_path
from femgear.housing.two_way.running_planets import ring_lines, solve_running
from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.friction_source import balanced_source
from femgear.system.assembly import ROTATION
from femgear.trains.elastic.outputs import mesh_and_ring_outputs
from femgear.trains.gearbox.balance import solve_balance
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.elastic_ring import elastic_ring, with_rings
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.friction import (
    box_friction_findings,
    first_speed,
    friction_excites,
    rubbing_tables,
    stage_friction,
)
from femgear.trains.gearbox.losses import loss_point
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.response import level, solve_gearbox_response
from femgear.trains.gearbox.sensors import gearbox_sensors, sensor_rows
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

ACTS = {"friction": "constant", "coefficient": 0.06, "excites": True}
FEW = {"static.positions": 16, "static.flank_elements": 8, "static.stresses": False, "dynamics.up_to": "4 kHz"}
HELD = {"gear_1.bearing_stiffness": "2e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}


def without_loss(stage):
    none = replace(stage, loss=0.0 * stage.loss, structure_loss=0.0, gyroscopic=0.0 * stage.gyroscopic)
    return none if stage.ring is None else replace(none, ring=replace(stage.ring, loss=0.0))


@cache
def pair(torque="200 N m"):
    case = with_values(read_case("cases/spur_pair.toml"), FEW | HELD | {"operation.torque": torque, "losses": ACTS})
    steps = Steps()
    box = solve_deflection(read_case(gearbox_of_case(case).tables | {"deflection": {"slices": 1}}), steps=steps)
    return box, solve(case, only="modes")["modes"], steps


@pytest.mark.parametrize("torque", ["200 N m", "-150 N m"])
def test_the_response_of_a_pair_is_that_of_its_own_train(torque):
    found, reference, steps = pair(torque)
    (stage,) = found.model.stages
    excitation = excitation_of(found, stage, steps=steps, friction=True)
    assert excitation.source is not None and np.array_equal(excitation.source, reference.excitation.source[:-1])
    assert np.array_equal(excitation.force, reference.excitation.force)
    running = without_loss(running_stage(found, stage, excitation).running)
    basis = replace(reference.modes, damping_ratio=0.0 * reference.modes.damping_ratio)
    for hertz in (300.0, 1900.0, 3000.0):
        wanted = solve_spectral(
            basis, reference.excitation, hertz, excitation_harmonics=6, response_harmonics=18, tolerance=1e-12
        )
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 18), tolerance=1e-13)
        expected = wanted.force[0, 0, 1:]
        assert np.abs(2.0 * response.force[0, 0, 1:, 0] - expected).max() < 1e-8 * np.abs(expected).max()
        without = replace(running, rubbing=None)
        quiet = solve_running(without, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 18), tolerance=1e-13)
        assert np.abs(quiet.force[0, 0, 1:, 0] - response.force[0, 0, 1:, 0]).max() > 1e-4 * np.abs(expected).max()


SENSORS = [
    {"name": "top", "ring": "set", "angle": "90 deg"},
    {"name": "beside", "ring": "set", "angle": "20 deg", "direction": [-0.34202014332566871, 0.93969262078590843, 0.0]},
]


def of_the_set(more, changes=()):
    case = with_values(read_case("cases/planetary_27_40_108.toml"), FEW | {"losses": ACTS} | dict(changes))
    return case, solve_deflection(read_case(gearbox_of_case(case).tables | more))


@pytest.mark.slow
def test_the_response_of_a_set_with_an_elastic_ring_is_that_of_its_own_train():
    """At a carrier that stands still: the set leaves out the terms of the turning frame."""
    case, found = of_the_set({"sensor": SENSORS})
    reference = solve(case, only="modes")["modes"]
    stage = found.model.stages[0]
    ring = elastic_ring(found.model, stage)
    running = without_loss(running_stage(found, stage, ring.excitation, [ring]).running)
    modes = undamped_modes(reference.model.system, reference.excitation.stiffness.mean(axis=1), damping_ratio=0.0)
    whole, excitation = replace(reference, modes=modes), balanced_source(reference.excitation, modes)
    sensors, n = gearbox_sensors(found.model.case), np.arange(-26, 27)
    theta, directions = (np.array([getattr(sensor, name) for sensor in sensors]) for name in ("angle", "on_ring"))
    for hertz in (300.0, 1500.0, 2300.0):
        known = {"excitation_harmonics": 8, "response_harmonics": 12, "method": "direct"}
        wanted = solve_spectral(modes, excitation, np.array([hertz]), **known)
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(8, 12), side_bands=0, tolerance=1e-13)
        forces = wanted.force[0][[0, len(stage.planets)], 1:]
        assert np.abs(2.0 * response.force[0, :2, 1:, 0] - forces).max() < 1e-8 * np.abs(forces).max()
        heard = ring_lines(running, response, theta, directions).sum(axis=1)[1:]
        fields = (mesh_and_ring_outputs(whole, wanted, output)[1][0, 1:] for output in (0, 1))
        expected = np.stack([field @ np.exp(1j * n * at) for field, at in zip(fields, theta, strict=True)], axis=1)
        assert np.abs(heard - expected).max() < 1e-8 * np.abs(expected).max()


CASING = {
    "mass": "30 kg",
    "centre": ["10 mm", "-20 mm", "0 mm"],
    "inertia": ["0.5 kg m^2", "0.5 kg m^2", "0.6 kg m^2"],
    "foot": [
        {"position": ["-150 mm", "-120 mm", "0 mm"], "stiffness": ["2e7 N/m", "5e7 N/m", "3e7 N/m"]},
        {"position": ["150 mm", "-120 mm", "0 mm"], "stiffness": ["2e7 N/m", "9e7 N/m", "3e7 N/m"]},
    ],
}


def assembled(found, ring, drive, running):
    """All coordinates of a gearbox at rest, its meshes with their mean stiffness and friction as sources."""
    assembly, system, stiffness = linear_system(found)
    system, _ = with_rings(system, stiffness, assembly, dict(enumerate(assembly.slices)), [ring] if ring else [])
    share = [stiffness[part] / stiffness[part].sum() for part in assembly.slices]
    columns = np.split(assembly.sliding_columns, 2, axis=1)
    means = [kind[:, part] @ weight for kind in columns for part, weight in zip(assembly.slices, share, strict=True)]
    sources, count = assembly.motions.T @ np.array(means).T, assembly.motions.shape[1]
    if ring is not None:
        around = np.exp(1j * np.outer(ring.diameter, ring.stage.angles))
        none = np.zeros(around.shape)
        on_ring = np.hstack([block for wave in ring.sliding.T for block in (none, np.real(wave[:, None] * around))])
        sources = np.vstack([sources, on_ring])
    modes = undamped_modes(
        replace(system, gyroscopic=None, sources=sources), drive.stiffness.mean(axis=1), damping_ratio=0.0
    )
    about = {name: getattr(drive, name) for name in ("deflection", "force", "source")}
    about = {name: signal - signal.mean(axis=1, keepdims=True) for name, signal in about.items()}
    return modes, replace(drive, **about), assembly.motions @ modes.shape[:count], modes.shape[count:]


@pytest.mark.slow
def test_friction_on_a_ring_in_a_casing_is_that_on_all_coordinates_of_both():
    """Planets that run around at speed zero, and the assembled gearbox with all coordinates of the ring."""
    _, found = of_the_set({"sensor": SENSORS, "casing": CASING})
    ring = elastic_ring(found.model, found.model.stages[0])
    structured = running_stage(found, found.model.stages[0], ring.excitation, [ring])
    running = without_loss(structured.running)
    modes, drive, motion, waves = assembled(found, ring, ring.excitation, running)
    sensors = gearbox_sensors(found.model.case)
    rows = sensor_rows(found.model) @ motion + ring.sensor_rows(sensors) @ waves
    places = np.array([sensor.angle for sensor in sensors]), np.array([sensor.on_ring for sensor in sensors])
    outputs = structured.at_sensors(sensor_rows(found.model), sensors)
    for hertz in (350.0, 700.0, 1700.0):
        known = {"excitation_harmonics": 6, "response_harmonics": 9, "method": "direct"}
        modal = solve_spectral(modes, drive, hertz, **known).modal[0]
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 9), side_bands=14, tolerance=1e-13)
        heard = (response.lines(outputs.T) + ring_lines(running, response, *places)).sum(axis=1)
        expected = (rows @ modal).T
        assert np.abs(heard - expected)[1:].max() < 1e-8 * np.abs(expected[1:]).max()


@pytest.mark.slow
def test_friction_in_space_is_that_on_all_coordinates():
    case = with_values(read_case("cases/helical_30_20_70.toml"), {"static.flank_elements": 8, "losses": ACTS})
    found = solve_deflection(read_case(gearbox_of_case(case).tables | {"deflection": {"slices": 1}}))
    stage = found.model.stages[0]
    excitation = excitation_of(found, stage, friction=True)
    structured = running_stage(found, stage, excitation)
    running = without_loss(structured.running)
    modes, drive, motion, _ = assembled(found, None, structured.running.excitation, running)
    # planets run in a frame of their own; the spectral solver leaves out how friction turns the whole set
    turning = [6 * at + ROTATION for at in stage.members[:2]]
    own = [6 * at + way for at in stage.planets for way in range(6)]
    kept = np.setdiff1d(np.arange(len(motion)), [*own, *turning])
    for hertz in (300.0, 700.0, 1700.0):
        known = {"excitation_harmonics": 6, "response_harmonics": 9, "method": "direct"}
        modal = solve_spectral(modes, drive, hertz, **known).modal[0]
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 9), side_bands=14, tolerance=1e-13)
        heard = response.lines(structured.motion[kept].T).sum(axis=1)
        expected = (motion[kept] @ modal).T
        assert np.abs(heard - expected)[1:].max() < 1e-8 * np.abs(expected[1:]).max()


OUT_OF_PHASE = {
    **{"sun.teeth": 26, "ring.teeth": 106, "set.centre_distance": "49.8 mm"},
    **{"sun.profile_shift": None, "ring.profile_shift": None, "sun.tip_diameter": None},
}


def rigid_set(torque, speed, *, losses=ACTS, **more):
    """The set out of phase with a rigid ring in a casing on feet, with torque and speed of the sun."""
    case = with_values(
        read_case("cases/planetary_27_40_108.toml"), FEW | OUT_OF_PHASE | {"losses": losses, **more, "motor": None}
    )
    tables = gearbox_of_case(case).tables
    tables["planetary"][0].pop("elastic_ring")
    tables["sensor"] = [{"name": "foot", "position": ["150 mm", "-120 mm", "0 mm"], "direction": "y"}]
    tables["operation"]["load_case"] = [{"torque": {"sun": torque}, "speed": {"sun": speed}}]
    return solve_deflection(read_case(tables | {"casing": CASING}))


def levels(found, **options):
    response = solve_gearbox_response(found, [26.0, 110.0], **options)
    return response, level(response, {stage.name: stage.motion[:, :1] for stage in response.stages})[:, 0]


def test_gears_that_turn_the_other_way_round_are_the_mirrored_ones():
    found, steps = pair()[0], Steps()
    tables = case_text.parse(found.model.case.source, "")

    def fluctuation(torque, speed):
        tables["operation"]["load_case"] = [{"torque": {"gear 1": torque}, "speed": {"gear 1": speed}}]
        response = solve_gearbox_response(solve_deflection(read_case(tables), steps=steps), [30.0, 210.0], steps=steps)
        return level(response, {stage.name: stage.motion for stage in response.stages})[:, :2]

    driving, mirrored = fluctuation("200 N m", "1000 rpm"), fluctuation("-200 N m", "-1000 rpm")
    driven, other = fluctuation("-200 N m", "1000 rpm"), fluctuation("200 N m", "-1000 rpm")
    sizes = [np.linalg.norm(size, axis=1) for size in (driving, mirrored, driven, other)]
    # friction turns round at the first of 8192 positions, which counts after the pitch point either way
    assert sizes[0] == pytest.approx(sizes[1], rel=2e-3)
    assert sizes[2] == pytest.approx(sizes[3], rel=2e-3)
    assert np.abs(sizes[2] / sizes[0] - 1.0).max() > 1e-3


@pytest.mark.slow
def test_a_set_out_of_phase_has_a_line_at_the_mesh_order_where_its_planets_differ():
    """Order 106 of the carrier, which equal planets do not have, with friction or without."""
    lines = {}
    for error in ((), ((1, "5 um"),)):
        more = {"set.pin_errors": [{"planet": planet, "tangential": size} for planet, size in error]}
        found = rigid_set("100 N m", "1000 rpm", **(more if error else {}))
        for acts in (True, False):
            (stage,) = solve_gearbox_response(found, [26.0], friction=acts).stages
            chosen = (stage.harmonic == 1) & (stage.side_band == 0)
            lines[bool(error), acts] = np.abs(stage.motion[0, 0, chosen]).sum() / np.abs(stage.motion[0, 0]).max()
    assert lines[False, True] < 1e-9 and lines[False, False] < 1e-9
    assert lines[True, True] > 1e-3 > lines[True, False]


@pytest.mark.slow
def test_friction_takes_of_the_power_what_the_losses_say():
    """Mean of friction times sliding in the loaded period, and the stage "losses" by the loads without it."""
    found = rigid_set("100 N m", "1000 rpm")
    stage = found.model.stages[0]
    source = excitation_of(found, stage, friction=True).source
    assert source is not None
    couple = -source[len(source) // 2 :].reshape(2, -1, source.shape[1])
    gears = found.contacts["set"].result.planetary_set
    sliding = [sliding_per_path(kind) / kind.gear_1.base_radius for kind in gears.kinds]
    turning = first_speed(found.model, stage.section) * gears.sun.base_radius
    power = sum(turning * slides * of_kind.mean(axis=1).sum() for slides, of_kind in zip(sliding, couple, strict=True))
    case = found.model.case
    point = loss_point(found, case.load_case)
    assert power == pytest.approx(np.sum(point.mesh_loss["set"]), rel=0.05)


def test_no_coefficient_is_no_friction_bit_for_bit():
    found, _, steps = pair()
    stage = found.model.stages[0]
    assert stage_friction(found.model, stage, found.contacts["pair"].result.planetary_set) == pytest.approx((0.06,))
    quiet = read_case(case_text.parse(found.model.case.source, "") | {"losses": ACTS | {"excites": False}})
    model = replace(found.model, case=quiet)
    assert stage_friction(model, stage, found.contacts["pair"].result.planetary_set) is None
    responses = [
        solve_gearbox_response(state, [110.0], steps=steps, friction=acts)
        for state, acts in ((replace(found, model=model), True), (found, False))
    ]
    assert np.array_equal(responses[0].stages[0].motion, responses[1].stages[0].motion)


def test_a_ring_that_is_elastic_has_friction_in_one_sense_of_turning():
    _, found = of_the_set({})
    model, stage = found.model, found.model.stages[0]
    assert rubbing_tables(replace(model, case=read_case("cases/e_axle.toml")), stage, {"a": 1}) == {"a": 1}
    tables = rubbing_tables(model, stage, {"operation": {"input": "sun"}})
    assert tables["losses"]["excites"] and tables["operation"]["speeds"]
    speed = {name: -value for name, value in model.flow.speed.items()}
    with pytest.raises(CaseError) as caught:
        rubbing_tables(replace(model, flow=replace(model.flow, speed=speed)), stage, {"operation": {}})
    assert caught.value.code == "E-FRICTION" and caught.value.key == "planetary[0].elastic_ring"


def test_findings_tell_where_friction_is_another_or_none():
    tables = case_text.parse(pair()[0].model.case.source, "")
    oil = {"viscosity_40": "100 mm^2/s", "viscosity_100": "11 mm^2/s", "temperature": "70 degC"}
    schlenk = {"friction": "schlenk", "roughness": "0.4 um", "excites": True}
    case = read_case(tables | {"lubricant": oil, "losses": schlenk, "runup": {"count": 3}, "balance": {"harmonics": 4}})
    (finding,) = box_friction_findings(case)
    assert finding.code == "W-FRICTION" and "pair" in finding.text
    planets = with_values(read_case("cases/planetary_27_40_108.toml"), {"losses": ACTS})
    tables_of_set = gearbox_of_case(planets).tables | {"balance": {"harmonics": 4}}
    (idle,) = box_friction_findings(read_case(tables_of_set))
    assert (idle.code, idle.key) == ("W-UNUSED", "losses.excites") and "[balance]" in idle.text
    assert not [*box_friction_findings(read_case(tables))]
    (idle,) = box_friction_findings(read_case(tables | {"deflection": {"contact": False}}))
    assert idle.code == "W-UNUSED"
    without = read_case(tables | {"deflection": {"contact": False}})
    assert friction_excites(read_case(tables)) and not friction_excites(without)


def test_a_run_tells_what_friction_adds():
    tables = case_text.parse(pair()[0].model.case.source, "")
    results = solve(read_case(tables), only="dynamics")["dynamics"].dataset()
    change = results["friction_change"]
    assert change.dims == ("speed", "bearing") and (change.values > 1.0).all()
    for bearing in tables["bearing"]:
        bearing["radial"] = "rigid"
    change = solve(read_case(tables), only="dynamics")["dynamics"].dataset()["friction_change"]
    assert change.dims == ("speed", "stage") and (change.values > 1.0).all()


def test_teeth_that_might_part_have_the_friction_of_the_response():
    """A pair that stays in contact: harmonic balance with viscous damping that is next to none, and the response."""
    tables = case_text.parse(pair()[0].model.case.source, "")
    tables |= {"balance": {"harmonics": 6}, "modes": {"damping_ratio": 1e-7}}
    tables["operation"]["load_case"][0]["speed"] = {"gear 1": "450 rpm"}
    found = solve_deflection(read_case(tables))
    (solved,) = solve_balance(found)
    stage = found.model.stages[0]
    running = running_stage(found, stage, excitation_of(found, stage, friction=True)).running
    omega = 2.0 * np.pi * found.model.flow.mesh_frequency["pair"]
    forces = solve_running(without_loss(running), omega, 0.0, harmonics=(6, 6), tolerance=1e-13).force[0, 0, 1:, 0]
    assert (solved.drive > 0.0).all() and solved.solution.converged
    lines = np.fft.rfft(solved.drive[0, :, 0])[1:7] / solved.drive.shape[1]
    assert np.abs(lines - forces).max() < 1e-5 * np.abs(forces).max()
    quiet = solve_running(replace(without_loss(running), rubbing=None), omega, 0.0, harmonics=(6, 6)).force[0, 0, 1:, 0]
    assert np.abs(quiet - forces).max() > 0.01 * np.abs(forces).max()
