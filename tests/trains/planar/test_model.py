"""The lumped set against exact geometry, the printed matrices of Lin and Parker, and closed forms."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set, torsional_set
from scipy.linalg import eig, eigh
from uneven_set import ANGLES, UNEVEN

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.gears.kinematics import torques
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.lumped_set import Bearings, driving_torque
from femgear.stages.static import solve_static
from femgear.system.fourier import harmonics_of
from femgear.system.mesh_directions import (
    dof_names,
    free_motions,
    gear_set_system,
    mesh_directions,
    pin_directions,
)
from femgear.system.rigid_bodies import CENTRAL, PlanarBody, PlanarTorque, planar_from_set, torque_shares
from femgear.trains.planar.model import planar_data, planar_dynamic_model, planar_model
from femgear.trains.reading import read_case, with_values
from validation.planetary import nrel_set


def uneven(**changes):
    """The uneven set with unequal pins as well."""
    return replace(lin_parker_set(3), **UNEVEN | {"planet_bearing": [1e8, 2e8, 3e8]} | changes)


def belt(one, two, turn, radii, *, crossed, branch):
    """Length of a belt fixed to two base circles, straight along the line of action.

    Points of the belt trace the involutes. Flanks of an external pair touch between the tangent points and
    approach as the belt becomes shorter; those of an internal pair touch beyond, and approach as it grows.
    """
    apart = two - one
    distance, heading = np.hypot(*apart), math.atan2(apart[1], apart[0])
    reach = radii[0] + radii[1] if crossed else radii[0] - radii[1]
    normal = heading + branch * math.acos(reach / distance)
    straight = math.sqrt(distance**2 - reach**2)
    # the belt leaves circle 1 in the direction that goes from tangent point to tangent point
    towards = apart - reach * np.array([math.cos(normal), math.sin(normal)])
    side = 1.0 if math.cos(normal) * towards[1] - math.sin(normal) * towards[0] > 0 else -1.0
    wound = side * radii[0] * (normal - turn[0])
    other = -side if crossed else side
    return straight + wound - other * radii[1] * (normal - turn[1])


@pytest.mark.parametrize("flank", [1, -1])
@pytest.mark.parametrize("mesh", range(6))
def test_mesh_columns_are_the_gradient_of_exact_involute_kinematics(flank, mesh):
    data, planet = uneven(), mesh % 3
    first, second = (("sun", "planet"), ("planet", "ring"))[mesh // 3]
    radii = getattr(data, f"{first}_radius"), getattr(data, f"{second}_radius")
    psi = ANGLES[planet]
    out = np.array([math.cos(psi), math.sin(psi)])
    frame = np.array([out, [-out[1], out[0]]]).T

    def approach(q):
        q = dict(zip(dof_names(data), q))
        centre = {body: np.array([q[f"{body}: x"], q[f"{body}: y"]]) for body in ("sun", "ring")}
        name = f"planet {planet + 1}"
        centre["planet"] = data.centre_distance * out + frame @ [
            q[f"{name}: radial"],
            q[f"{name}: tangential"],
        ]
        angle = {body: q[f"{body}: u"] / getattr(data, f"{body}_radius") for body in ("sun", "ring")}
        angle["planet"] = q[f"{name}: u"] / data.planet_radius
        turned, crossed = (angle[first], angle[second]), first == "sun"
        length = belt(centre[first], centre[second], turned, radii, crossed=crossed, branch=-flank)
        return -length if crossed else length

    step, eye = 1e-6, np.eye(18)
    gradient = [(approach(step * e) - approach(-step * e)) / (2 * step) for e in eye]
    assert gradient == pytest.approx(mesh_directions(data, flank)[:, mesh], abs=1e-8)


def products(factors):
    """The printed 3 x 3 blocks of member, coupling and planet are products of two vectors."""
    member, planet = factors
    return (member, member), (member, planet), (planet, planet)


def printed_stiffness(data):
    """K_b + K_m as Lin and Parker print it in their appendix, block by block."""
    N = data.n_planets
    K = np.zeros((3 * (N + 3), 3 * (N + 3)))
    supports = [
        (data.carrier, data.centre_distance),
        (data.ring, data.ring_radius),
        (data.sun, data.sun_radius),
    ]
    for i, (body, r) in enumerate(supports):
        K[range(3 * i, 3 * i + 2), range(3 * i, 3 * i + 2)] = body.support
        K[3 * i + 2, 3 * i + 2] = body.torsional_support / r**2
    a, b = data.pressure_angle_sun_planet, data.pressure_angle_planet_ring
    sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
    for n, psi in enumerate(data.planet_angles):
        s, c = math.sin(psi), math.cos(psi)
        ss, cs, sr, cr = math.sin(psi - a), math.cos(psi - a), math.sin(psi + b), math.cos(psi + b)
        ring = np.array([-sr, cr, 1.0]), np.array([sb, -cb, -1.0])
        sun = np.array([-ss, cs, 1.0]), np.array([-sa, -ca, 1.0])
        bearing = (
            [[1, 0, -s], [0, 1, c], [-s, c, 1]],
            [[-c, s, 0], [-s, -c, 0], [0, -1, 0]],
            np.diag([1, 1, 0]),
        )
        blocks = (
            (0, data.planet_bearing[n], *bearing),
            (3, data.stiffness_planet_ring[n], *(np.outer(*pair) for pair in products(ring))),
            (6, data.stiffness_sun_planet[n], *(np.outer(*pair) for pair in products(sun))),
        )
        own = slice(9 + 3 * n, 12 + 3 * n)
        for first, k, diagonal, coupling, planet in blocks:
            member = slice(first, first + 3)
            K[member, member] += k * np.array(diagonal)
            K[member, own] += k * np.array(coupling)
            K[own, member] += k * np.array(coupling).T
            K[own, own] += k * np.array(planet)
    return K


@pytest.mark.parametrize("data", [uneven(), lin_parker_set(4), lin_parker_set(5)], ids=["uneven", "4", "5"])
def test_stiffness_and_mass_are_those_that_lin_and_parker_print(data):
    system = gear_set_system(data)
    total = system.K + (system.W * data.mesh_stiffness) @ system.W.T
    assert total == pytest.approx(printed_stiffness(data), abs=1e-14 * np.abs(total).max())
    bodies = [
        (data.carrier, data.centre_distance),
        (data.ring, data.ring_radius),
        (data.sun, data.sun_radius),
    ]
    bodies += [(data.planet, data.planet_radius)] * data.n_planets
    mass = np.concatenate([[b.mass, b.mass, b.inertia / r**2] for b, r in bodies])
    assert np.array_equal(system.M, np.diag(mass))
    assert system.dofs == dof_names(data) and not system.C.any() and system.gyroscopic is None


def rotation(data, *, sun, carrier):
    """Small rotations of the mechanism, angles [rad] of sun and carrier given."""
    q = dict.fromkeys(dof_names(data), 0.0)
    a = data.centre_distance
    planet = carrier - (sun - carrier) * data.sun_radius / data.planet_radius
    ring = carrier + (planet - carrier) * data.planet_radius / data.ring_radius
    for name, angle in (("sun", sun), ("carrier", carrier), ("ring", ring)):
        q[f"{name}: u"] = angle * (a if name == "carrier" else getattr(data, f"{name}_radius"))
    for n in range(1, data.n_planets + 1):
        q[f"planet {n}: tangential"] = a * carrier
        q[f"planet {n}: u"] = planet * data.planet_radius
    return np.array(list(q.values()))


@pytest.mark.parametrize("turn", [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 0.2)])
@pytest.mark.parametrize("flank", [1, -1])
def test_rotation_strains_neither_mesh_nor_bearing(turn, flank):
    data = uneven()
    assert np.abs(data.closure).max() < 1e-15
    q = rotation(data, sun=turn[0], carrier=turn[1])
    columns = np.hstack([mesh_directions(data, flank), pin_directions(data).reshape(18, -1)])
    assert np.abs(columns.T @ q).max() < 1e-12 * np.abs(q).max()


def test_common_translation_strains_no_mesh_and_no_planet_bearing():
    data = uneven()
    move = np.array([0.6, -0.8])
    q = np.zeros(18)
    q[[0, 1]] = q[[3, 4]] = q[[6, 7]] = move
    for n, psi in enumerate(ANGLES):
        q[9 + 3 * n : 11 + 3 * n] = np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]]) @ move
    columns = np.hstack([mesh_directions(data), pin_directions(data).reshape(18, -1)])
    assert np.abs(columns.T @ q).max() < 1e-15


def test_turning_all_planets_turns_nothing_else():
    modes = []
    for shift in (0.0, 0.7):
        data = uneven(planet_angles=ANGLES + shift)
        modes.append(undamped_modes(gear_set_system(data), data.mesh_stiffness).frequency)
    assert modes[1] == pytest.approx(modes[0], rel=1e-9, abs=1e-3)


def test_geared_set_gives_radii_angles_and_the_torques_of_willis():
    gears = nrel_set()
    body = PlanarBody(10.0, 1.0, 1e8)
    data = planar_from_set(
        gears,
        sun=body,
        ring=replace(body, torsional_support=1e9),
        carrier=body,
        planet=PlanarBody(5.0, 0.5),
        stiffness_sun_planet=1e9,
        stiffness_planet_ring=1e9,
        planet_bearing=2e9,
    )
    assert np.abs(data.closure).max() < 1e-12
    assert math.degrees(data.pressure_angle_sun_planet) == pytest.approx(24.169, abs=1e-3)
    system = gear_set_system(data, torque=PlanarTorque(100.0))
    expected = torques(gears, member="sun", torque=100.0)
    load = dict(zip(system.dofs, system.load))
    assert load["sun: u"] * data.sun_radius == pytest.approx(expected.sun, rel=1e-14)
    assert load["carrier: u"] * data.centre_distance == pytest.approx(expected.carrier, rel=1e-14)
    assert np.count_nonzero(system.load) == 2
    ring = torque_shares(data)["ring"] * load["sun: u"] * data.ring_radius
    assert ring == pytest.approx(expected.ring, rel=1e-14)
    assert np.array_equal(data.planet_angles, gears.planet_angles)


@pytest.mark.parametrize(
    ("torque", "compressed"),
    [
        (PlanarTorque(50.0), True),
        (PlanarTorque(-50.0), True),
        (PlanarTorque(50.0, "carrier", "sun"), True),
        (PlanarTorque(-50.0, "carrier", "sun"), True),
        (PlanarTorque(50.0, "sun", None), True),
    ],
)
def test_columns_follow_the_loaded_flanks(torque, compressed):
    data = uneven(carrier=replace(uneven().carrier, torsional_support=1e6))
    system = gear_set_system(data, torque=torque)
    q = np.linalg.solve(system.K + (system.W * data.mesh_stiffness) @ system.W.T, system.load)
    assert np.all(system.W.T @ q > 0) == compressed


def test_rotating_frame_shifts_whirl_by_the_carrier_speed():
    """A ring on isotropic supports whirls at sqrt(k/m) in the housing, -+ Omega seen from the carrier."""
    data, speed = lin_parker_set(3), 1500.0
    system = gear_set_system(data, carrier_speed=speed)
    G = system.gyroscopic
    assert np.array_equal(G, -G.T) and system.K == pytest.approx(system.K.T, abs=1e-15 * system.K.max())
    ring = [system.dofs.index(f"ring: {axis}") for axis in "xy"]
    M, K, D = (np.array(m)[np.ix_(ring, ring)] for m in (system.M, system.K, speed * G))
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    still = math.sqrt(1e8 / 2.35)
    assert np.sort(np.abs(eig(state)[0].imag)) == pytest.approx(np.repeat([still - speed, still + speed], 2))


def test_whole_set_whirls_as_one_body_seen_from_the_carrier():
    """Without ring, sun and carrier supports the set is one free body: it stands still in the housing."""
    free = {name: replace(getattr(uneven(), name), support=0.0) for name in CENTRAL}
    data, speed = uneven(**free), 200.0
    system = gear_set_system(data, carrier_speed=speed)
    total = system.K + (system.W * data.mesh_stiffness) @ system.W.T
    shift = np.zeros((18, 2))
    shift[[0, 3, 6], 0] = shift[[1, 4, 7], 1] = 1.0
    shift[9::3], shift[10::3] = (
        np.array([np.cos(ANGLES), np.sin(ANGLES)]).T,
        np.array([-np.sin(ANGLES), np.cos(ANGLES)]).T,
    )
    # x = cos(Omega t), y = -sin(Omega t): a point of the housing seen from the carrier
    q = shift @ [1.0, 1j]
    rest = (-(speed**2) * system.M + 1j * speed * speed * system.gyroscopic + total) @ q
    assert np.abs(rest).max() < 1e-10 * np.abs(total).max()


def test_centrifugal_load_pulls_planets_outwards():
    data, speed = lin_parker_set(3), 300.0
    system = gear_set_system(data, carrier_speed=speed)
    force = 0.66 * data.centre_distance * speed**2
    q = np.linalg.solve(system.K + 1e-3 * np.eye(18), system.load)
    radial = q[[system.dofs.index(f"planet {n}: radial") for n in (1, 2, 3)]]
    assert radial == pytest.approx(force / (1e8 - 0.66 * speed**2), rel=1e-9)
    still, tangential = gear_set_system(data).load, system.load[10::3]
    assert not still.any() and not tangential.any()


def test_infinite_supports_are_the_limit_of_stiff_ones():
    """Error of the stiff supports falls with their stiffness, towards the held coordinates."""
    rigid = torsional_set(lin_parker_set(3))
    exact = undamped_modes(gear_set_system(rigid), rigid.mesh_stiffness).frequency
    errors = []
    for stiff in (1e13, 1e14):
        held = {name: replace(getattr(rigid, name), support=stiff) for name in CENTRAL}
        data = replace(rigid, planet_bearing=stiff, **held)
        system = gear_set_system(data)
        total = system.K + (system.W * data.mesh_stiffness) @ system.W.T
        value = eigh(total, system.M, eigvals_only=True)[1 : len(exact)]
        errors.append(np.abs(np.sqrt(value) / (2 * np.pi) / exact[1:] - 1.0).max())
    assert errors[1] < 1e-5 and errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def test_held_planets_follow_their_pins():
    data = uneven(planet_bearing=[1e8, np.inf, 3e8])
    T, pins = free_motions(data), pin_directions(data)
    assert T.shape == (18, 16)
    q = T @ np.arange(1.0, 17.0)
    assert np.abs(pins[:, 1].T @ q).max() < 1e-14
    system = gear_set_system(data)
    assert "planet 2: radial" not in system.dofs and len(system.dofs) == 16
    assert np.trace(system.M) > np.trace(gear_set_system(uneven()).M) - 1e-9
    assert np.array_equal(system.W, T.T @ mesh_directions(data))


def test_bearing_columns_carry_what_left_the_stiffness():
    data = uneven()
    groups = Bearings(0.0).columns(data, back_flanks=True)
    system = gear_set_system(data, back_flanks=True, planet_bearings=True)
    assert system.W.shape[1] == 6 + 6 + 3 * 2 == 1 + groups["planets"].max()
    whole = gear_set_system(data)
    K = np.array(system.K)
    for stiffness, columns in zip(data.planet_bearing, groups["planets"], strict=True):
        K += stiffness * system.W[:, columns] @ system.W[:, columns].T
    assert K == pytest.approx(whole.K, abs=1e-6)
    assert np.array_equal(system.W[:, groups["meshes"]], whole.W)
    assert np.array_equal(system.W[:, groups["back flanks"]], mesh_directions(data, -1))


@pytest.mark.parametrize(
    ("changes", "code", "word"),
    [
        ({"sun": PlanarBody(0.0, 1.0)}, "E-RANGE", "sun: mass"),
        ({"ring": PlanarBody(1.0, math.nan)}, "E-RANGE", "ring: inertia"),
        ({"carrier": PlanarBody(1.0, 1.0, -1.0)}, "E-RANGE", "carrier: support"),
        ({"planet": PlanarBody(1.0, 1.0, 1e8)}, "E-RANGE", "planet_bearing"),
        ({"planet_angles": [0.0, 120.0, 240.0]}, "E-RANGE", "radians"),
        ({"planet_angles": [0.0, 0.0, 1.0]}, "E-RANGE", "ascending"),
        ({"pressure_angle_sun_planet": 24.6}, "E-RANGE", "radians"),
        ({"stiffness_planet_ring": [1e8, 1e8]}, "E-RANGE", "2 values"),
        ({"stiffness_sun_planet": 0.0}, "E-RANGE", "above 0"),
        # one wrong value among others is the one that is named
        ({"stiffness_planet_ring": [1e8, -2e8, 3e8]}, "E-RANGE", "stiffness planet ring of -2"),
        ({"planet_bearing": -1e8}, "E-RANGE", "above 0, or infinite"),
        ({"planet_bearing": [1e8, 2e8, -3e8]}, "E-RANGE", "planet bearing of -3"),
        ({"centre_distance": 0.0}, "E-RANGE", "centre distance"),
    ],
)
def test_impossible_data_are_refused(changes, code, word):
    with pytest.raises(CaseError, match=word) as error:
        uneven(**changes)
    assert error.value.code == code


def test_data_of_a_set_are_read_only():
    data = uneven()
    for name in ("planet_angles", "stiffness_sun_planet", "stiffness_planet_ring", "planet_bearing"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(data, name)[0] = 1.0


def test_impossible_requests_are_refused():
    for torque in (("motor", None), ("sun", "sun")):
        with pytest.raises(CaseError, match="E-MECHANISM"):
            PlanarTorque(1.0, *torque)
    with pytest.raises(CaseError, match="finite"):
        PlanarTorque(math.nan)
    held = uneven(sun=replace(uneven().sun, torsional_support=math.inf))
    with pytest.raises(CaseError, match="which is held"):
        gear_set_system(held, torque=PlanarTorque(1.0))


@pytest.mark.slow
def test_friction_loads_the_planets_as_the_statics_have_it():
    """A planet turns freely at rest: its meshes differ by the couple of its friction, harmonic by harmonic."""
    acts = {"friction": "constant", "coefficient": 0.06, "excites": True}
    left_out = {"planar.gravity": None, "planar.branch": None, "static.stresses": False, "static.flank_elements": 8}
    case: Any = with_values(read_case("cases/nrel_pgb_static.toml"), {"losses": acts} | left_out)
    static, gears = solve_static(case), planetary_set(case)
    model, count = planar_model(case, gears, static, mesh_frequency=True), case.mesh_harmonics
    orders = np.array([[0, harmonic] for harmonic in range(count + 1)])
    frequency = np.array([1e-3, 2.0 * np.pi * 0.05])
    slow = solve_harmonic_balance(
        model.problem, frequency, orders=orders, reduction=model.reduction, radius=False
    ).force[model.groups["meshes"]]
    moving, still = (
        first - second for first, second in (np.split(slow, 2), np.split(harmonics_of(static.cycle.force, count), 2))
    )
    assert slow.shape[0] == 2 * gears.n_planets
    assert np.abs(moving - still).max() < 1e-3 * np.abs(still).max()
    assert np.abs(still[:, 1:]).max() > 1000.0
    assert len(planar_model(case, gears, static).problem.forces) == 0


LINEAR: dict[str, Any] = {
    "planar.gravity": None,
    "planar.branch": None,
    "planar.response": None,
    "planar.published": None,
}
LINEAR |= {"planar.back_flanks": False, "static.stresses": False, "static.flank_elements": 8, "static.positions": 24}


def test_the_model_for_other_programs_runs_with_time():
    """Its meshes move as harmonic balance has them, whose contact is smoothed by 0.3 um."""
    case: Any = with_values(read_case("cases/nrel_pgb_static.toml"), LINEAR)
    static, gears = solve_static(case), planetary_set(case)
    whole, model = planar_model(case, gears, static, mesh_frequency=True), planar_dynamic_model(case, gears, static)
    count, hertz = case.mesh_harmonics, 40.0
    orders = np.array([[0, harmonic] for harmonic in range(2 * count + 1)])
    balance = solve_harmonic_balance(
        whole.problem, np.array([1e-3, 2.0 * np.pi * hertz]), orders=orders, reduction=whole.reduction, radius=False
    )
    modal, excitation = model.modal, model.excitation
    system = gear_set_system(planar_data(case, gears, static), torque=driving_torque(case, reacts=False))
    modes = replace(
        undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=0.0), damping_ratio=modal.damping_ratio
    )
    response = solve_spectral(modes, excitation, [hertz], excitation_harmonics=count, response_harmonics=2 * count)
    expected, found = balance.force[whole.groups["meshes"]], response.force[0]
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()
    assert np.abs(found - expected)[:, 1:].max() < 2e-2 * np.abs(expected)[:, 1:].max()
    # the other way round in time it would be another motion
    turned = np.conj(found)
    assert np.abs(turned - expected)[:, 1:].max() > 0.3 * np.abs(expected)[:, 1:].max()


@pytest.mark.parametrize("key", ["planar.gravity", "planar.back_flanks", "planet.bearing_clearance"])
def test_what_no_linear_model_has_is_refused_for_other_programs(key):
    plain = {"planar.gravity": None, "planar.branch": None, "planar.response": None, "planar.back_flanks": False}
    given = {"planar.gravity": {}, "planar.back_flanks": True, "planet.bearing_clearance": "20 um"}[key]
    case: Any = with_values(read_case("cases/nrel_pgb.toml"), plain | {key: given})
    with pytest.raises(CaseError, match="none of this") as refused:
        planar_dynamic_model(case, planetary_set(case), None)
    assert refused.value.key == key and refused.value.code == "E-MODEL"
