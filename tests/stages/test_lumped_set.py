"""Mesh stiffness, play, clearance, weight and pins of the lumped set against statics and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.errors import CaseError
from femgear.stages.lumped_set import (
    Bearings,
    Gravity,
    MemberBearing,
    gear_set_problem,
    phased_series,
    pin_deflections,
)
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.mesh_directions import (
    dof_names,
    gear_set_system,
    mesh_directions,
    mesh_elements,
    pin_directions,
)
from femgear.system.rigid_bodies import CENTRAL, PlanarTorque, torque_shares
from femgear.system.system import MeshExcitation, element_forces, external_force
from validation import planar
from validation.planar import sharing_set, static_mesh_forces, sun_forces

ANGLES = np.array([0.3, 1.9, 4.1])


def supported(**changes):
    """Lin and Parker's set whose carrier cannot run away."""
    data = lin_parker_set(3)
    return replace(data, carrier=replace(data.carrier, torsional_support=1e6), **changes)


def unsupported(data):
    """The same set without radial supports of its central members."""
    return replace(data, **{name: replace(getattr(data, name), support=0.0) for name in CENTRAL})


def linear(problem, load, *, mesh_stiffness):
    system = problem.system
    return np.linalg.solve(system.K + (system.W * mesh_stiffness) @ system.W.T, load)


def test_validation_rows_of_static_sharing_and_balance_pass():
    rows = (*planar.load_sharing(), *planar.closed_form(), *planar.balance(), *planar.wind_turbine())
    assert len(rows) > 30 and [row for row in rows if row.verdict != "passes"] == []


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
def test_load_sharing_is_the_closed_form(planets):
    rng = np.random.default_rng(planets)
    for _ in range(3):
        data, errors = sharing_set(planets), rng.normal(scale=2e-5, size=planets)
        exact = planar.closed_form_sharing(data, 600.0, errors)
        assert sun_forces(data, 600.0, errors) == pytest.approx(exact, rel=1e-10, abs=1e-7)


def test_three_planets_share_alike_whatever_the_pins():
    forces = sun_forces(sharing_set(3), 100.0, np.array([3e-6, -8e-6, 1e-6]))
    assert forces == pytest.approx(np.full(3, 100.0 / 0.03871 / 3), rel=1e-11)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_pin_errors_act_as_forces_of_the_bearings(sign):
    """Other route: displaced springs, load k_p e on the planets and its reaction on the carrier."""
    data = supported(planet_angles=ANGLES, planet_bearing=[1e8, 2e8, 3e8])
    pins, torque = np.array([[3e-6, 5e-6], [-4e-6, 1e-6], [2e-6, -7e-6]]), PlanarTorque(sign * 900.0)
    problem = gear_set_problem(data, torque=torque, pin_errors=pins, meshes=mesh_elements(data, separates=False))
    system = gear_set_system(data, torque=torque)
    pushed = np.einsum("ina,n,na->i", pin_directions(data), data.planet_bearing, pins)
    q = np.linalg.solve(system.K + (system.W * 5e8) @ system.W.T, system.load + pushed)
    assert static_mesh_forces(problem) == pytest.approx(5e8 * system.W.T @ q, rel=1e-9)


def test_pin_errors_turn_with_the_carrier_as_masses_do():
    data, pins, speed = supported(), np.array([[1e-5, 0.0], [0.0, 2e-5], [0.0, 0.0]]), 200.0
    load = gear_set_problem(data, pin_errors=pins, carrier_speed=speed).system.load
    bare = gear_set_problem(data, carrier_speed=speed).system.load
    difference = np.zeros((6, 3))
    difference[3:, :2] = 0.66 * speed**2 * pins
    assert load - bare == pytest.approx(difference.ravel(), abs=1e-8)


def test_torque_of_the_mirrored_set():
    """A set mirrored about the x axis under the opposite torque carries the same forces."""
    pins = np.array([[3e-6, 5e-6], [-4e-6, 1e-6], [2e-6, -7e-6]])
    one = supported(planet_angles=ANGLES)
    two = replace(one, planet_angles=2 * np.pi - ANGLES[::-1])
    forces = [
        static_mesh_forces(
            gear_set_problem(data, torque=PlanarTorque(t), pin_errors=p, meshes=mesh_elements(data, separates=False))
        )
        for data, t, p in ((one, 400.0, pins), (two, -400.0, pins[::-1] * [1.0, -1.0]))
    ]
    assert forces[1].reshape(2, 3)[:, ::-1] == pytest.approx(forces[0].reshape(2, 3), rel=1e-9)


@pytest.mark.parametrize("theta", [0.0, 1.1, 3.9])
def test_slow_weight_is_the_static_one_of_the_turned_set(theta):
    data, gravity = supported(planet_angles=ANGLES), Gravity(orders=(0, 1))
    problem = gear_set_problem(data, gravity=gravity)
    force = external_force(problem, np.array([0.7, theta]))
    q = linear(problem, force, mesh_stiffness=5e8)
    standing = replace(data, planet_angles=ANGLES + theta)
    still = gear_set_problem(standing, gravity=Gravity(orders=None))
    assert still.forces == () and still.system.load.any()
    other = linear(still, still.system.load, mesh_stiffness=5e8)
    c, s = math.cos(theta), math.sin(theta)
    for first in (0, 3, 6):
        x, y = q[first], q[first + 1]
        assert (c * x - s * y, s * x + c * y) == pytest.approx(tuple(other[first : first + 2]), rel=1e-9)
    rest = [2, 5, *range(8, 18)]
    assert q[rest] == pytest.approx(other[rest], rel=1e-8, abs=1e-16)


def test_weight_of_all_bodies_points_down_at_every_phase():
    data = supported(planet_angles=ANGLES)
    problem = gear_set_problem(data, gravity=Gravity(9.81, direction=-0.5 * math.pi, orders=(1,)))
    shift = np.zeros((18, 2))
    shift[[0, 3, 6], 0] = shift[[1, 4, 7], 1] = 1.0
    shift[9::3] = np.array([np.cos(ANGLES), np.sin(ANGLES)]).T
    shift[10::3] = np.array([-np.sin(ANGLES), np.cos(ANGLES)]).T
    total = 5.43 + 2.35 + 0.4 + 3 * 0.66
    for theta in np.linspace(0.0, 6.0, 7):
        x, y = shift.T @ external_force(problem, np.array([theta]))
        turned = (x + 1j * y) * np.exp(1j * theta)
        assert turned == pytest.approx(-9.81j * total, abs=1e-11)


def test_bearings_with_no_clearance_are_the_linear_ones():
    data = supported(planet_angles=ANGLES)
    torque, gravity = PlanarTorque(300.0), Gravity(orders=None)
    members = tuple(MemberBearing(getattr(data, name).support, 0.0, name) for name in CENTRAL)
    plain = gear_set_problem(data, torque=torque, gravity=gravity)
    loose = gear_set_problem(
        unsupported(data),
        torque=torque,
        gravity=gravity,
        bearings=Bearings(0.0, members),
    )
    q = np.random.default_rng(3).normal(scale=1e-6, size=18)
    parts = []
    for problem in (plain, loose):
        W, K = problem.system.W, problem.system.K
        force, tangent = element_forces(problem, W.T @ q, np.zeros(1))
        parts.append((K @ q + W @ force, K + W @ tangent @ W.T, problem.system.C))
    for one, two in zip(*parts):
        assert two == pytest.approx(one, rel=1e-12, abs=1e-12 * np.abs(one).max())


def test_columns_of_a_bearing_are_the_inner_less_the_outer_member():
    data, names = supported(planet_angles=ANGLES), dof_names(supported())
    members = (MemberBearing(1e8, None, "carrier"), MemberBearing(1e8, None, "sun", "ring"))
    bearings = Bearings(members=members)
    system = bearings.join(data, gear_set_system(data))
    columns = bearings.columns(data, back_flanks=False)["members"]
    q = np.zeros(len(names))
    moved = {"carrier: x": 1.0, "carrier: y": 2.0, "ring: x": 30.0, "ring: y": 40.0, "sun: x": 500.0}
    for name, value in moved.items():
        q[names.index(name)] = value
    assert (system.W.T @ q)[columns].tolist() == [[1.0, 2.0], [500.0 - 30.0, -40.0]]


def test_carrier_drops_through_its_clearance():
    """The weight of a set whose carrier has play is carried at c + F / k' of the closed bearing law."""
    data, clearance = supported(), 1e-3
    bearings = Bearings(members=(MemberBearing(data.carrier.support, clearance, "carrier"),))
    problem = gear_set_problem(unsupported(data), bearings=bearings, gravity=Gravity(orders=None))
    columns = bearings.columns(data, back_flanks=False)["members"]
    x = np.zeros(8)
    x[columns] = [[0.0, 0.999 * clearance]]
    assert not element_forces(problem, x, np.zeros(1))[0][columns].any()
    x[columns] = [[0.0, 3.0 * clearance]]
    p = math.acos(1.0 / 3.0)
    expected = 2e8 / math.pi * clearance * (3 * (p + math.sin(p) / 3) - 2 * math.sin(p))
    assert element_forces(problem, x, np.zeros(1))[0][columns] == pytest.approx(np.array([[0.0, expected]]), rel=1e-12)


def test_static_record_is_the_quasi_static_solution():
    data = supported(planet_angles=ANGLES)
    torque, tau = PlanarTorque(500.0), np.arange(32) / 32
    phases = np.array([0.0, 0.3, 0.7, 0.1, 0.4, 0.8])
    k = 5e8 * (1 + 0.2 * np.cos(2 * np.pi * (tau + phases[:, None])))
    system = gear_set_system(data, torque=torque)
    states = np.array([np.linalg.solve(system.K + (system.W * row) @ system.W.T, system.load) for row in k.T])
    deflection = (states @ system.W).T
    record = MeshExcitation(k, deflection, k * deflection, np.full(6, 5e-5))
    problem = gear_set_problem(data, torque=torque, meshes=mesh_elements(data, stiffness=record, harmonics=15))
    assert np.array_equal(problem.elements[0].backlash, np.full(6, 5e-5))
    for i in (0, 5, 17):
        force = element_forces(problem, states[i] @ problem.system.W, np.array([2 * np.pi * tau[i]]))[0]
        rest = problem.system.K @ states[i] + problem.system.W @ force - problem.system.load
        assert np.abs(rest).max() < 1e-9 * np.abs(system.load).max()


def test_mesh_phases_shift_the_wave():
    phases = np.array([0.0, 0.25, 0.6, 0.9])
    series = phased_series([0.3, 0.1j], [0.2], phases, mean=[1.0, 2.0, 3.0, 4.0], orders=(0, 2))
    tau = 0.37
    t = 2 * np.pi * (tau + phases)
    waves = [1 + 0.3 * np.cos(t) - 0.1 * np.sin(2 * t), 1 + 0.2 * np.cos(t)]
    expected = np.array([1.0, 2.0, 3.0, 4.0]) * np.concatenate([waves[0][:2], waves[1][2:]])
    assert series.at(np.array([9.9, np.pi * tau])) == pytest.approx(expected, rel=1e-13)
    with pytest.raises(CaseError, match="E-SHAPE"):
        phased_series([0.1], [0.1], phases, mean=[1.0])


def test_a_planet_pushed_outwards_wedges_in_the_ring():
    """Both flanks of a mesh approach by d sin(alpha) when the centres approach by d."""
    data, b, d = supported(), 2e-5, 1e-4
    meshes = mesh_elements(data, backlash=b)
    problem = gear_set_problem(data, meshes=meshes, back_flanks=True)
    q = np.zeros(18)
    q[9] = d
    W = problem.system.W
    force = element_forces(problem, W.T @ q, np.zeros(1))[0].reshape(4, 3)
    approach = d * math.sin(data.pressure_angle_planet_ring)
    expected = np.zeros((4, 3))
    expected[1, 0], expected[3, 0] = 5e8 * approach, 5e8 * (approach - b)
    assert force == pytest.approx(expected, rel=1e-12)
    on_one_line = gear_set_problem(data, meshes=meshes)
    single = element_forces(on_one_line, on_one_line.system.W.T @ q, np.zeros(1))[0]
    assert single[3] == pytest.approx(5e8 * approach)


@pytest.mark.parametrize("turn", [3e-5, -5e-6, -3e-5])
def test_back_flanks_in_rotation_are_those_of_one_line(turn):
    """When bodies only turn, both ways to model the back flanks give the same forces on the bodies."""
    data, pins = supported(), np.array([[0.0, 1e-6], [0.0, -2e-6], [0.0, 0.0]])
    meshes = mesh_elements(data, backlash=2e-5)
    q = np.zeros(18)
    q[8] = turn
    moments = []
    for own in (False, True):
        problem = gear_set_problem(data, meshes=meshes, back_flanks=own, pin_errors=pins)
        force = element_forces(problem, problem.system.W.T @ q, np.zeros(1))[0]
        moments.append((problem.system.W @ force)[[2, 5, 8, 11, 14, 17]])
    assert moments[1] == pytest.approx(moments[0], rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("theta", [0.0, 2.0])
def test_back_flanks_of_a_record_touch_beyond_its_unloaded_deflection(theta):
    data, phase = supported(), np.array([theta])
    k = phased_series([0.2], [0.1], np.zeros(6), mean=data.mesh_stiffness)
    waves = FourierSeries(np.tile([[2e-6, 5e-7j]], (6, 1))), FourierSeries(np.tile([[800.0, 100.0]], (6, 1)))
    meshes = replace(mesh_elements(data, stiffness=k, backlash=3e-5), deflection=waves[0], force=waves[1])
    problem = gear_set_problem(data, meshes=meshes, back_flanks=True)
    start = (waves[0].at(phase) - waves[1].at(phase) / k.at(phase))[0]
    for x in (start + 1e-6, start - 1.5e-5, start - 3.1e-5):
        deflection = np.concatenate([np.full(6, x), np.full(6, -x)])
        force = element_forces(problem, deflection, phase)[0]
        line = meshes.evaluate(np.full((6, 1), x), phase)[0][:, 0]
        assert force[:6] - force[6:] == pytest.approx(line, rel=1e-6, abs=1e-4)


def test_damping_is_modal_at_standstill_with_closed_meshes():
    data = supported()
    problem = gear_set_problem(
        data,
        damping=0.03,
        carrier_speed=50.0,
        back_flanks=True,
        meshes=mesh_elements(data, backlash=1e-5),
        bearings=Bearings(1e-4),
    )
    plain = gear_set_system(data)
    value, shape = np.linalg.eigh(
        np.linalg.solve(np.sqrt(plain.M), np.linalg.solve(np.sqrt(plain.M), plain.K + (plain.W * 5e8) @ plain.W.T).T)
    )
    modes = np.linalg.solve(np.sqrt(plain.M), shape)
    expected = np.diag(2 * 0.03 * np.sqrt(value))
    found = modes.T @ problem.system.C @ modes
    assert found == pytest.approx(expected, abs=1e-8 * expected.max())
    assert problem.speed == 50.0 and problem.system.gyroscopic is not None
    given = gear_set_problem(data, damping=np.diag(np.arange(18.0)))
    assert np.array_equal(given.system.C, np.diag(np.arange(18.0)))
    assert not gear_set_problem(data).system.C.any()


def test_constant_meshes_are_the_default():
    data = supported(stiffness_sun_planet=[4e8, 5e8, 6e8])
    problem = gear_set_problem(data)
    assert problem.reference == pytest.approx(data.mesh_stiffness)
    assert np.isinf(problem.elements[0].backlash).all() and problem.bases == 1
    assert gear_set_problem(data, gravity=Gravity()).bases == 2


def test_output_torque_balances_and_a_missing_one_is_refused():
    data = lin_parker_set(3)
    problem = gear_set_problem(data, torque=PlanarTorque(80.0))
    forces = static_mesh_forces(
        gear_set_problem(supported(), torque=PlanarTorque(80.0), meshes=mesh_elements(data, separates=False))
    )
    assert forces == pytest.approx(np.full(6, 80.0 / data.sun_radius / 3), rel=1e-9)
    assert problem.system.load[2] == pytest.approx(torque_shares(data)["carrier"] * 80.0 / data.sun_radius)
    with pytest.raises(CaseError, match="E-LOAD-BALANCE"):
        gear_set_problem(data, torque=PlanarTorque(80.0, output=None))


def test_pin_deflections_are_the_approach_of_the_flanks():
    data = supported(planet_angles=ANGLES)
    found = pin_deflections(data, [[1e-6, 0.0], [0.0, 1e-6], [0.0, 0.0]])
    alpha, beta = data.pressure_angle_sun_planet, data.pressure_angle_planet_ring
    expected = [-math.sin(alpha), -math.cos(alpha), 0, math.sin(beta), -math.cos(beta), 0]
    assert found == pytest.approx(1e-6 * np.array(expected), abs=1e-20)
    assert found == pytest.approx(
        mesh_directions(data).T @ np.eye(18)[:, 9] * 1e-6 + mesh_directions(data).T @ np.eye(18)[:, 13] * 1e-6
    )


def test_only_meshes_that_part_must_press_at_every_instant():
    wave = FourierSeries(np.tile([5e8, 6e8], (6, 1)))
    sampled = np.tile(5e8 + 6e8 * np.cos(2.0 * np.pi * np.arange(8) / 8), (6, 1))
    record = MeshExcitation(sampled, np.zeros((6, 8)), np.zeros((6, 8)), np.zeros(6))
    for stiffness in (wave, record):
        made = mesh_elements(supported(), stiffness=stiffness, harmonics=1, separates=False)
        assert made.stiffness.at(np.array([np.pi])) == pytest.approx(np.full(6, -1e8))
        with pytest.raises(CaseError, match="E-STIFFNESS"):
            mesh_elements(supported(), stiffness=stiffness, harmonics=1)


def test_impossible_requests_are_refused():
    data = supported()
    steps = StepSeries(np.full((6, 2), 5e8), [0.0, 0.5])
    for error, call in (
        ("E-BACKLASH", lambda: gear_set_problem(data, back_flanks=True)),
        (
            "E-BACKLASH",
            lambda: gear_set_problem(
                data,
                back_flanks=True,
                meshes=replace(mesh_elements(data, stiffness=steps, backlash=1e-5), force=constant(np.ones(6))),
            ),
        ),
        ("E-BEARING", lambda: gear_set_problem(replace(data, planet_bearing=np.inf), bearings=Bearings(1e-5))),
        ("E-SHAPE", lambda: gear_set_problem(data, pin_errors=np.zeros((3, 3)))),
        ("E-SHAPE", lambda: gear_set_problem(data, damping=np.zeros((4, 4)))),
        ("E-SHAPE", lambda: gear_set_problem(data, meshes=replace(mesh_elements(data), columns=np.arange(1, 7)))),
        ("E-SHAPE", lambda: mesh_elements(data, stiffness=constant(np.ones(4)))),
        (
            "E-HARMONICS",
            lambda: mesh_elements(
                data, stiffness=MeshExcitation(np.ones((6, 4)), np.ones((6, 4)), np.ones((6, 4)), np.zeros(6))
            ),
        ),
    ):
        with pytest.raises(CaseError, match=error):
            call()
