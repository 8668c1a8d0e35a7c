"""The elastic set against exact kinematics, equilibrium, and a whole toothed ring of finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from femgear.contact.assembly import mesh_pairs
from femgear.contact.bodies import active_flank_load, make_sectors
from femgear.contact.candidates import separation
from femgear.errors import CaseError, ContactError
from femgear.fe.elasticity import Material, foundation, mass, stiffness
from femgear.fe.grid import copy_nodes, rotated_copies
from femgear.gears import Gear, PlanetarySet, equal_planet_angles
from femgear.gears.checks import feasible_angles
from femgear.models.elastic import (
    BodyData,
    ShaftData,
    elastic_set,
    mesh_excitation,
    ring_displacement,
    ring_field,
    ring_mesh_compliance,
)
from femgear.models.ring import RADIAL, TANGENTIAL, ring_model
from femgear.solvers.modal import solve_modes

STEEL = Material(206e9, 0.3, 7850.0)
SUN, CARRIER = BodyData(0.22, 1e-4, 5e7), BodyData(3.0, 6e-3, 2e8)
PLANET = BodyData(0.355, 2.17e-4, 3e8)
MOTOR, BRAKE = ShaftData(0.02, 400.0), ShaftData(0.2, 5000.0)
TORQUE = 100.0


def gear_set(planets=3):
    common = dict(module=1.5e-3, pressure_angle=np.deg2rad(20), face_width=0.025)
    return PlanetarySet(
        Gear(teeth=27, profile_shift=0.52681, rim_radius=0.009, **common),
        Gear(teeth=40, profile_shift=0.0, rim_radius=0.018, **common),
        Gear(teeth=108, profile_shift=0.0, rim_radius=0.1, internal=True, **common),
        centre_distance=0.051,
        planet_angles=feasible_angles(135, equal_planet_angles(planets)),
    )


@pytest.fixture(scope="module")
def sector():
    return make_sectors(gear_set(), STEEL, flank_elements=6).ring


def make_ring(sector, gears, side=1.0, foundation_stiffness=1e10, max_diameter=26):
    width = gears.ring.face_width
    k = foundation_stiffness
    return ring_model(
        gears,
        sector.grid,
        sector.stiffness,
        mass(sector.grid, STEEL, width),
        foundation(sector.grid, "rim", k, k, thickness=width),
        active_flank_load(sector.grid, gears, side),
        max_diameter=max_diameter,
        max_frequency=15e3,
        side=side,
    )


@pytest.fixture(scope="module")
def ring(sector):
    return make_ring(sector, gear_set())


def make(gears, ring, *, motor=MOTOR, brake=BRAKE, torque=TORQUE):
    return elastic_set(
        gears, ring, sun=SUN, carrier=CARRIER, planet=PLANET, motor=motor, brake=brake, sun_torque=torque
    )


def place(model, name):
    return model.system.dofs.index(name)


def rotation(gears, model):
    """Small motion of the whole set with the ring fixed, 1 rad of the sun, by Willis."""
    q = np.zeros(len(model.system.dofs))
    carrier = gears.sun.teeth / (gears.sun.teeth + gears.ring.teeth)
    planet = carrier * (1 - gears.ring.teeth / gears.planet.teeth)
    turned = {"sun": 1.0, "motor": 1.0, "carrier": carrier, "brake": carrier}
    for body, angle in turned.items():
        if f"{body}: rotation" in model.system.dofs:
            q[place(model, f"{body}: rotation")] = angle
    for n, psi in enumerate(gears.planet_angles):
        arm = gears.centre_distance * carrier
        q[place(model, f"planet {n + 1}: x")] = -arm * np.sin(psi)
        q[place(model, f"planet {n + 1}: y")] = arm * np.cos(psi)
        q[place(model, f"planet {n + 1}: rotation")] = planet
    return q


@pytest.mark.parametrize("planets", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_rotation_of_the_mechanism_is_the_zero_mode(sector, ring, planets, torque):
    gears = gear_set(planets)
    model = make(gears, ring if torque > 0 else make_ring(sector, gears, -1.0), torque=torque)
    q = rotation(gears, model)
    system = model.system
    assert np.abs(system.W.T @ q).max() < 1e-12 * gears.sun.base_radius
    assert np.abs(system.K @ q).max() < 1e-12 * np.abs(system.K).max()
    assert abs(system.load @ q) < 1e-12 * np.abs(system.load) @ np.abs(q)
    modes = solve_modes(system, np.full(2 * planets, 5e8), damping_ratio=0.0, count=4)
    assert list(modes.frequency[:4] == 0) == [True, False, False, False]
    found = modes.shape[:, 0]
    assert found == pytest.approx(q * found[place(model, "sun: rotation")], abs=1e-8 * np.abs(found).max())


@pytest.mark.parametrize(
    ("motor", "brake"), [(None, None), (MOTOR, None), (None, BRAKE)], ids=["neither", "motor", "brake"]
)
def test_sets_without_motor_or_brake_keep_one_zero_mode_and_a_balanced_load(ring, motor, brake):
    gears = gear_set()
    model = make(gears, ring, motor=motor, brake=brake)
    assert len(model.system.dofs) == len(model.system.M) == len(model.system.load)
    assert ("motor: rotation" in model.system.dofs) == (motor is not None)
    assert ("brake: rotation" in model.system.dofs) == (brake is not None)
    modes = solve_modes(model.system, np.full(6, 5e8), damping_ratio=0.0, count=3)
    assert np.count_nonzero(modes.frequency == 0) == 1
    # constant load alone presses every mesh with the torque's force over the base radius
    force = 5e8 * modes.load_deflection
    assert force == pytest.approx(TORQUE / gears.sun.base_radius / 3, rel=1e-8)


def test_load_is_the_torque_of_the_mechanism(ring):
    gears, model = gear_set(), make(gear_set(), ring)
    load = model.system.load
    assert load[place(model, "motor: rotation")] == TORQUE
    assert load[place(model, "brake: rotation")] == pytest.approx(-TORQUE * 135 / 27, rel=1e-14)
    assert np.count_nonzero(load) == 2
    assert gears.ring.teeth == 108


def test_masses_add_up(ring):
    M = make(gear_set(), ring).system.M
    rigid = 2 * 0.22 + 1e-4 + 2 * 3.0 + 6e-3 + 3 * (2 * 0.355 + 2.17e-4) + 0.02 + 0.2
    names = make(gear_set(), ring).system.dofs
    own = [i for i, name in enumerate(names) if not name.startswith("ring")]
    assert np.trace(M[np.ix_(own, own)]) == pytest.approx(rigid, rel=1e-14)
    assert np.array_equal(M[len(own) :, len(own) :], np.eye(len(names) - len(own)))
    assert not M[: len(own), len(own) :].any()


def test_translation_of_the_set_strains_supports_and_ring_meshes_alone(ring):
    gears, model = gear_set(), make(gear_set(), ring)
    q = np.zeros(len(model.system.dofs))
    shift = np.array([0.6, -0.8])
    for body in ("sun", "carrier", "planet 1", "planet 2", "planet 3"):
        q[place(model, f"{body}: x")], q[place(model, f"{body}: y")] = shift
    deflection = model.system.W.T @ q
    assert np.abs(deflection[:3]).max() < 1e-15
    angle = np.asarray(gears.planet_angles) - np.pi / 2 + gears.working_pressure_angle_planet_ring
    assert deflection[3:] == pytest.approx(shift @ [np.cos(angle), np.sin(angle)], rel=1e-12)
    reaction = model.system.K @ q
    assert reaction[place(model, "sun: x")] == pytest.approx(5e7 * 0.6, rel=1e-12)
    assert reaction[place(model, "carrier: y")] == pytest.approx(-2e8 * 0.8, rel=1e-12)
    held = [place(model, f"{body}: {axis}") for body in ("sun", "carrier") for axis in ("x", "y")]
    assert np.abs(np.delete(reaction, held)).max() < 1e-6


def base_tangent_gap(rb, centres, angles, *, internal, side):
    """Separation of two involutes along their common base tangent, from elementary geometry.

    The string of gear 1 unwinds in the direction of motion; `angles` are those of the involutes' origins.
    """
    line = centres[1] - centres[0]
    distance = np.hypot(*line)
    if not internal:
        direction = np.arctan2(line[1], line[0])
        working = np.arccos((rb[0] + rb[1]) / distance)
        first = side * (angles[0] - (direction - side * working))
        second = side * (angles[1] - (direction - side * working + np.pi))
        return distance * np.sin(working) - rb[0] * first - rb[1] * second
    # gear 2 is internal and gear 1 lies on the other side of its centre
    working = np.arccos((rb[1] - rb[0]) / distance)
    tangent = np.arctan2(-line[1], -line[0]) + side * working
    first, second = (-side * (angle - tangent) for angle in angles)
    return rb[1] * second - rb[0] * first - distance * np.sin(working)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_mesh_directions_are_derivatives_of_the_separation(sector, ring, side):
    """Central differences of exact involute kinematics, every coordinate of every body."""
    gears = gear_set()
    model = make(gears, ring if side > 0 else make_ring(sector, gears, -1.0), torque=side * TORQUE)
    psi = np.asarray(gears.planet_angles)

    def gaps(q):
        def position(body, x=0.0, y=0.0):
            return np.array([x + q[place(model, f"{body}: x")], y + q[place(model, f"{body}: y")]])

        out = np.zeros(6)
        for n in range(3):
            name = f"planet {n + 1}"
            centre = position(name, *(gears.centre_distance * np.array([np.cos(psi[n]), np.sin(psi[n])])))
            turn = q[place(model, f"{name}: rotation")]
            sun = q[place(model, "sun: rotation")]
            rb = gears.sun.base_radius, gears.planet.base_radius, gears.ring.base_radius
            # origins of the involutes: any angles, the derivative does not depend on them
            out[n] = base_tangent_gap(
                rb[:2], (position("sun"), centre), (psi[n] + sun, psi[n] + turn), internal=False, side=side
            )
            out[3 + n] = base_tangent_gap(
                rb[1:], (centre, np.zeros(2)), (psi[n] + turn, psi[n]), internal=True, side=side
            )
        return out

    step = 1e-6
    rigid = [i for i, name in enumerate(model.system.dofs) if name.split(":")[0][:6] in ("sun", "planet")]
    for i in rigid:
        q = np.zeros(len(model.system.dofs))
        q[i] = step
        derivative = (gaps(q) - gaps(-q)) / (2 * step)
        assert -derivative == pytest.approx(model.rigid_directions[i], abs=1e-8)
    others = np.delete(model.rigid_directions, rigid, axis=0)
    assert not others.any()


def test_mesh_directions_fit_the_separations_of_the_contact_problem():
    """Moving the planet outwards changes the candidates' separations as W says."""
    gears = gear_set()
    for pair, sign in zip(mesh_pairs(gears), (1.0, -1.0)):
        step = 1e-7
        assert abs(separation(pair, 0.0, pair.pitch_roll_1)[0]) < 1e-12
        # the centres move apart: W has the sine of the working angle along the line of centres
        apart = replace(pair, centre_distance=pair.centre_distance + step)
        moved = separation(apart, 0.0, np.linspace(0.99, 1.01, 2001) * pair.pitch_roll_1)[0]
        assert moved.min() / step == pytest.approx(sign * np.sin(pair.pressure_angle), rel=1e-4)


def test_back_flanks_have_the_same_frequencies(sector, ring):
    gears = gear_set()
    front = make(gears, ring)
    back = make(gears, make_ring(sector, gears, -1.0), torque=-TORQUE)
    spring = np.repeat([5e8, 7e8], 3)
    one, other = (solve_modes(m.system, spring, damping_ratio=0.0, max_frequency=12e3) for m in (front, back))
    assert other.frequency == pytest.approx(one.frequency, rel=1e-7, abs=1e-3)
    assert other.load_deflection == pytest.approx(one.load_deflection, rel=1e-8)


def test_ring_on_its_foundation_is_the_whole_ring_of_finite_elements():
    """Static deflection under unit mesh forces, all nodal diameters, against a sparse solve of all teeth."""
    common = dict(module=2e-3, pressure_angle=np.deg2rad(20), face_width=0.02)
    gears = PlanetarySet(
        Gear(teeth=18, profile_shift=0.0, rim_radius=0.009, **common),
        Gear(teeth=18, profile_shift=0.0, rim_radius=0.009, **common),
        Gear(teeth=54, profile_shift=0.0, rim_radius=0.066, internal=True, **common),
        centre_distance=0.036,
        planet_angles=equal_planet_angles(3),
    )
    sector = make_sectors(gears, STEEL, flank_elements=4, refine=0.6).ring
    ring = make_ring(sector, gears, foundation_stiffness=1e11, max_diameter=27)
    model = make(gears, ring)
    whole = rotated_copies(sector.grid, 54)
    width, state = 0.02, {"tooth": "plane strain", "body": "plane stress"}
    K = stiffness(whole, STEEL, state=state, thickness=width)
    K = K + foundation(whole, "rim", 1e11, 1e11, thickness=width)
    load = active_flank_load(sector.grid, gears, 1.0).reshape(-1, 2)
    nodes = copy_nodes(sector.grid, 54)
    columns = np.zeros((2 * whole.n_nodes, 3))
    for n in range(3):
        angle = 2 * np.pi * n / 3
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        for axis in range(2):
            np.add.at(columns[:, n], 2 * nodes[18 * n] + axis, (load @ turn.T)[:, axis])
    direct = columns.T @ splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(
        columns
    )
    teeth = 2 * np.pi * np.arange(3) / 3
    R = ring_displacement(ring.modes, model.ring_mode, model.ring_phase, teeth)
    omega2 = np.diag(model.system.K)[model.ring_slice]
    assert (R / omega2[:, None]).T @ R == pytest.approx(direct, rel=1e-7, abs=1e-9 * direct.max())


def test_compliance_between_meshes_is_that_of_the_ring_modes_with_their_static_parts(sector, ring):
    """All nodal diameters together give the compliance of the ring; symmetric, positive definite."""
    gears = gear_set()
    for own in (ring, make_ring(sector, gears, foundation_stiffness=1e17)):
        C = ring_mesh_compliance(own.compliance, np.arange(27), 108, gears.planet_angles)
        assert np.array_equal(C, C.T) or np.abs(C - C.T).max() < 1e-18
        assert np.linalg.eigvalsh(C).min() > 0
        model = make(gears, own)
        angles = np.asarray(gears.planet_angles)
        R = ring_displacement(own.modes, model.ring_mode, model.ring_phase, angles)
        omega2 = np.diag(model.system.K)[model.ring_slice]
        assert (R / omega2[:, None]).T @ R == pytest.approx(C, rel=1e-5)


@pytest.mark.parametrize("output", [RADIAL, TANGENTIAL])
def test_ring_field_is_the_displacement_of_the_sectors(ring, output):
    """Circumferential components summed at the teeth against the definition of the cyclic modes."""
    model = make(gear_set(), ring)
    rng = np.random.default_rng(5)
    count = model.ring_slice.stop - model.ring_slice.start
    q = rng.normal(size=count) + 1j * rng.normal(size=count)
    field = ring_field(model, ring.modes, q, output, 26)
    k = np.arange(108)
    ours = field @ np.exp(2j * np.pi * np.outer(np.arange(-26, 27), k) / 108)
    modes = ring.modes
    expected = np.zeros(108, complex)
    for value, m, sine in zip(q, model.ring_mode, model.ring_phase):
        wave = modes.output[m, output] * np.exp(2j * np.pi * modes.nodal_diameter[m] * k / 108)
        expected += value * modes.norm[m] * (wave.imag if sine else wave.real)
    assert ours == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def test_spring_and_ring_in_series_are_the_static_mesh():
    rng = np.random.default_rng(2)
    k, force = rng.uniform(4e8, 6e8, (6, 8)), rng.uniform(1e3, 2e3, (6, 8))
    still = rng.uniform(1e-6, 2e-6, (6, 8))
    C = np.diag(np.full(3, 2e-10)) + 1e-11
    excitation = mesh_excitation(k, still, force, C, backlash=1e-5)
    assert 1 / excitation.stiffness[3:] + np.diag(C)[:, None] == pytest.approx(1 / k[3:], rel=1e-12)
    assert excitation.stiffness[:3] == pytest.approx(k[:3], rel=1e-14)
    assert excitation.deflection[3:] + C @ force[3:] == pytest.approx(still[3:], rel=1e-12)
    assert np.array_equal(excitation.backlash, np.full(6, 1e-5))


def test_meshes_that_cannot_be_linearised_are_refused():
    k, force, still = np.full((6, 4), 5e8), np.full((6, 4), 1e3), np.full((6, 4), 2e-6)
    C = np.diag(np.full(3, 1e-10))
    with pytest.raises(CaseError, match="without torque") as caught:
        mesh_excitation(0 * k, 0 * still, 0 * force, C, backlash=0.0)
    assert caught.value.code == "E-NO-LOAD"
    opened = k.copy()
    opened[[1, 4], 2] = 0.0
    with pytest.raises(ContactError, match="planet 2 carries nothing") as caught:
        mesh_excitation(opened, still, force, C, backlash=0.0)
    assert caught.value.code == "E-CONTACT-OPEN"
    with pytest.raises(ContactError) as caught:
        mesh_excitation(k, still, force, 30 * C, backlash=0.0)
    assert caught.value.code == "E-RING-COMPLIANCE"


def test_motor_and_brake_follow_the_driven_member():
    """With the carrier driven the motor hangs on the carrier and the brake on the sun."""
    from femgear.analysis import solve_modes, solve_static
    from femgear.case import with_value
    from femgear.validation.reference import reference_case

    case = with_value(reference_case(), "operation.input", "carrier")
    case = with_value(case, "static.positions", 16)
    model = solve_modes(case, solve_static(case)).model
    system = model.system
    place = {name: i for i, name in enumerate(system.dofs)}
    motor, brake = place["motor: rotation"], place["brake: rotation"]
    assert system.K[motor, place["carrier: rotation"]] == -400.0
    assert system.K[brake, place["sun: rotation"]] == -5000.0
    assert system.load[motor] == pytest.approx(100.0)
    assert system.load[brake] == pytest.approx(-20.0)
