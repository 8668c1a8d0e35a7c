"""Gearboxes in time: mean forces of statics, computed teeth, free and held rotations, torques, refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_gearbox import loose_pair_tables, pair_tables, planetary_tables, set_on_shafts

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.time import flank_motion
from femgear.solvers.time.flank_steps import FlankScheme
from femgear.solvers.time.free_turn import FreeTurn
from femgear.solvers.time.transient import solve_transient
from femgear.trains.gearbox.balance import forces_of_flanks
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox
from femgear.trains.gearbox.transient import gearbox_in_time, integrate, torsional_state
from femgear.trains.reading import read_case
from validation import drivetrain

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[3] / "cases"
TIME = {"duration": "0.1 s", "rate": "40 kHz"}


def in_time(tables, **entries):
    """Loaded state, model and motion of the tables of a gearbox that are integrated in time."""
    case = read_case(tables | {"transient": TIME | entries})
    found = solve_deflection(case)
    model = gearbox_in_time(found, case.transient)
    return found, model, integrate(model, lowpass=False)


@pytest.mark.parametrize("teeth", [False, True])
def test_constant_meshes_stay_at_the_loaded_state(teeth):
    tables = (pair_tables(teeth=teeth) | {"deflection": {"slices": 5, "contact": False}}) if teeth else pair_tables()
    found, _, motion = in_time(tables | {"gravity": {}})
    assert motion.run.force == pytest.approx(found.mesh_force[0], rel=1e-6)
    # nothing moves but the common rotation
    assert np.abs(motion.run.velocity).max() < 1e-6 * motion.run.speed[0]


def test_planets_that_turn_share_the_torque_on_an_average():
    tables = planetary_tables(sun_mesh={"stiffness": "3e8 N/m"}) | {"gravity": {"acceleration": "100 m/s^2"}}
    tables["planetary"][0]["gears"] |= {"teeth": [20, 20, 61]}
    found, _, motion = in_time(tables, duration="0.3 s", rate="20 kHz")
    turn = 2.0 * np.pi / abs(found.model.flow.speed["carrier"])
    late = motion.run.time > motion.run.time[-1] - turn
    mean = motion.run.force[late, :3].mean(axis=0)
    assert mean == pytest.approx(mean.mean(), rel=1e-2)
    torque = found.model.flow.port_torque["sun"]
    base = found.model.stages[0].sizes.base_radii[0]
    assert mean.sum() == pytest.approx(abs(torque) / base, rel=1e-3)
    # the weight acts on every planet once a turn of the carrier
    assert np.ptp(motion.run.force[late, 0]) > 1.0


@pytest.mark.slow
def test_computed_teeth_have_the_settled_motion_of_harmonic_balance():
    tables = pair_tables(teeth=True) | {"motions": "plane"}
    tables["operation"]["load_case"][0]["speed"] = {"input": "2000 rpm"}
    found, model, motion = in_time(tables, duration="0.2 s", rate="200 kHz", harmonics=8)
    box = nonlinear_gearbox(found, {"stage": excitation_of(found, found.model.stages[0])}, harmonics=8)
    linear = replace(box.problem, elements=model.box.problem.elements)
    solution = solve_harmonic_balance(linear, box.frequency, harmonics=40, stability=False, radius=False)
    assert solution.converged
    period = 2.0 * np.pi / box.frequency[0]
    late = motion.run.time > motion.run.time[-1] - 3.0 * period
    wanted = forces_of_flanks(box, solution)[0]
    assert motion.run.force[late].max() == pytest.approx(wanted.max(), rel=5e-3)
    assert np.ptp(wanted) > 0.01 * wanted.mean()


def test_slopes_along_the_width_are_springs_beside_the_flanks():
    tables = set_on_shafts(slices=5)
    tables["planetary"][0]["teeth"]["static"] = {"positions": 12, "slices": 3}
    case = read_case(tables | {"deflection": {"slices": 5, "contact": False}, "transient": TIME | {"duration": "2 ms"}})
    found = solve_deflection(case)
    model = gearbox_in_time(found, case.transient)
    count = len(model.stages[0].meshes)
    assert np.count_nonzero(model.spun.side == 0) == count and len(model.spun.drives) == count
    run = integrate(model, lowpass=False).run
    assert run.force.mean() == pytest.approx(found.mesh_force.mean(), rel=0.05) and run.energy_balance.error < 1e-9


def test_a_gearbox_that_is_held_keeps_its_speed():
    tables = pair_tables() | {"motions": "plane"}
    tables["bearing"][0]["torsional"] = "1e6 N m/rad"
    _, model, motion = in_time(tables, torque=[{"load": "motor", "torque": "150 N m"}])
    assert not model.spun.spin.any() and np.isinf(model.spun.inertia)
    assert motion.run.speed == pytest.approx(motion.run.speed[0], rel=1e-12)
    assert motion.run.energy_balance.error < 1e-6


def test_torques_over_time_take_the_place_of_those_of_the_load_case():
    series = {"load": "motor", "times": ["0 s", "50 ms"], "torques": ["100 N m", "200 N m"]}
    _, model, motion = in_time(pair_tables(), torque=[series, {"load": "brake", "share": 1.0}])
    motor, brake = model.torques
    assert motor.body == "motor" and brake.at([0.0, 0.05]) == pytest.approx([150.0, 300.0])
    assert motion.run.speed == pytest.approx(motion.run.speed[0], rel=1e-9)
    _, model, motion = in_time(pair_tables(), torque=[series])
    # the brake keeps that of the load case: 150 N m
    inertia = model.spun.inertia
    gained = 0.5 * 0.05 * 100.0 + 0.05 * 100.0
    assert motion.run.speed[-1] - motion.run.speed[0] == pytest.approx(gained / inertia, rel=1e-6)


def test_a_chain_without_gears_turns():
    tables = pair_tables()
    tables["shaft"] = tables["shaft"][:1]
    tables["bearing"] = tables["bearing"][:2]
    tables["load"] = [tables["load"][0], {"name": "brake", "shaft": "input", "position": "90 mm"}]
    del tables["pair"]
    _, model, motion = in_time(tables, torque=[{"load": "brake", "torque": "-40 N m"}])
    assert motion.run.meshes == () and motion.run.speed[-1] > motion.run.speed[0]
    assert motion.run.speed[-1] - motion.run.speed[0] == pytest.approx(60.0 * 0.1 / model.spun.inertia, rel=1e-8)


def test_rotations_alone_are_stiffer():
    case = read_case(CASES / "own_chain.toml")
    found = torsional_state(solve_deflection(case))
    model = gearbox_in_time(found, case.transient)
    assert len(model.spun.spin) < len(gearbox_in_time(solve_deflection(case), case.transient).spun.spin)


def test_a_growing_motion_is_refused_with_its_entry():
    tables = pair_tables() | {"modes": {"damping_ratio": 0.0}, "motions": "rotation"}
    tables["pair"][0]["mesh"] |= {"contact_ratio": 1.5, "low_share": 0.3}
    frequencies = solve_gearbox_modes(solve_deflection(read_case(tables))).modes.frequency
    meshing = frequencies[frequencies > 500.0][0]
    tables["operation"]["load_case"][0]["speed"] = {"input": f"{60.0 * 2.0 * meshing / 24.0} rpm"}
    with pytest.raises(ConvergenceError) as refused:
        in_time(tables, duration="2 s", rate="200 kHz")
    assert (refused.value.code, refused.value.key) == ("E-DIVERGED", "modes.damping_ratio")


def test_two_planets_turn_with_no_carrier_but_stand_at_an_angle():
    gears = {"teeth": [20, 20, 60], "planets": 2, "module": "2 mm", "centre_distance": "40 mm"}
    with pytest.raises(CaseError) as refused:
        in_time(planetary_tables(gears=gears))
    assert refused.value.code == "E-TURNING"
    _, model, motion = in_time(planetary_tables(gears=gears), turning=False)
    assert not len(model.spun.turn_ratio) and np.isfinite(motion.run.force).all()


@pytest.mark.parametrize("rows", ["general_integrator", "balances"])
def test_the_general_integrator_and_balances_are_met(rows):
    for row in getattr(drivetrain, rows)():
        assert row.ours <= row.gate, row


def loose_in_time(**entries):
    """Model and motion of two rigid gears, one of them in a bearing with play, that start without deflection."""
    known = {"duration": "20 ms", "rate": "50 kHz", "harmonics": 4, "start": "zero"}
    return in_time(loose_pair_tables("20 um"), **known | entries)


@pytest.mark.parametrize("parts", [False, True])
def test_a_bearing_with_play_is_met_by_the_integrator_of_any_system(parts):
    """Weight sets in at once: the shaft falls through its play, and bounces."""
    _, model, motion = loose_in_time(contact_loss=parts, back_flanks=False)
    problem, run = model.box.problem, motion.run
    known = {"method": "average acceleration", "step": run.step, "tolerance": 1e-12}
    other = solve_transient(problem, model.box.frequency, run.time, **known)
    across = other.deflection[:, model.box.bearings["C"].columns[0]]
    assert 0.05 < (np.hypot(*across.T) < 10e-6).mean() < 0.95
    rows = np.array([model.rotation(shaft) for shaft in motion.shafts])
    wanted = other.displacement @ rows.T
    # deviations have no part of the common rotation
    turned = other.displacement @ model.spun.carried / model.spun.inertia
    wanted -= turned[:, None] * (rows @ model.spun.spin)
    np.testing.assert_allclose(run.motion, wanted, rtol=0.0, atol=1e-6 * np.abs(wanted).max())
    assert run.energy_balance.error < 1e-12 and run.momentum < 1e-12
    assert (run.lost.max() > 0.0) == parts


def test_a_static_start_rests_in_the_play_of_its_bearings():
    tables = loose_pair_tables("20 um")
    del tables["pair"][0]["mesh"]["contact_ratio"]
    found, model, motion = in_time(tables, duration="5 ms")
    state = flank_motion._start_state(model.spun, *_first_scheme(model), "static", contact_loss=False)
    bearing = model.box.bearings["C"]
    at_rest = state[: len(model.spun.spin)] @ model.spun.basic
    force = bearing.evaluate(at_rest[bearing.columns], None)[0][0]
    assert force == pytest.approx(-found.bearing_force[1, :2], rel=1e-9)
    assert np.abs(motion.run.velocity).max() < 1e-6 * motion.run.speed[0]
    assert motion.run.force == pytest.approx(found.mesh_force[0], rel=1e-9)


def _first_scheme(model):
    torques = [(torque, model.rotation(torque.body)) for torque in model.torques]
    turn = FreeTurn(model.spun, torques, 1e-5, model.speed)
    return FlankScheme.of(model.spun, 1e-5, turn.directions), turn
