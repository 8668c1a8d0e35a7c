"""The elastic set against exact kinematics, equilibrium, and a whole toothed ring of finite elements."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gyroscopic import ring_wave_shares, turning_system
from scipy.sparse.linalg import splu

from femgear.contact.bodies import active_flank_load, flank_compliance, make_sectors
from femgear.contact.flank_pairs import mesh_pairs, separation
from femgear.errors import ContactError
from femgear.fe.elasticity import Material, foundation, mass, stiffness
from femgear.fe.grid import copy_nodes, rotated_copies
from femgear.fe.reduction import CyclicModes
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, equal_planet_angles, feasible_angles
from femgear.solvers.linear.modal import complex_modes, undamped_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.rigid_bodies import PlanarBody, planar_from_set
from femgear.trains.elastic.model import (
    RADIAL,
    TANGENTIAL,
    RingModel,
    elastic_set,
    highest_mesh_mode,
    mesh_excitation,
    ring_displacement,
    ring_field,
    ring_mesh_compliance,
    ring_model,
)

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)
SUN = SimpleNamespace(mass=0.22, inertia=1e-4, support_stiffness=5e7)
CARRIER = SimpleNamespace(mass=3.0, inertia=6e-3, support_stiffness=2e8)
PLANET = SimpleNamespace(mass=0.355, inertia=2.17e-4, bearing_stiffness=3e8)
MOTOR = SimpleNamespace(inertia=0.02, coupling_stiffness=400.0)
BRAKE = SimpleNamespace(inertia=0.2, coupling_stiffness=5000.0)
TORQUE = 100.0
SPRING = np.repeat([5e8, 7e8], 3)


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
    springs = foundation(sector.grid, "rim", k, k, thickness=width)
    flanks = tuple(
        flank_compliance(sector.grid, gears.ring, STEEL, sector.stiffness, foundation=support)
        for support in (springs, None)
    )
    return ring_model(
        gears,
        sector,
        mass(sector.grid, STEEL, width),
        springs,
        flanks,
        max_diameter=max_diameter,
        max_frequency=15e3,
        side=side,
    )


@pytest.fixture(scope="module")
def ring(sector):
    return make_ring(sector, gear_set())


@pytest.fixture(scope="module")
def back_ring(sector):
    """For a torque that loads the other flanks."""
    return make_ring(sector, gear_set(), -1.0)


def bodies(*, motor=MOTOR, brake=BRAKE, bearing=PLANET.bearing_stiffness):
    """What `elastic_set` reads of a case."""
    planet = SimpleNamespace(mass=PLANET.mass, inertia=PLANET.inertia, bearing_stiffness=bearing)
    operation = SimpleNamespace(input="sun")
    return SimpleNamespace(sun=SUN, carrier=CARRIER, planet=planet, motor=motor, brake=brake, operation=operation)


def make(gears, ring, *, motor=MOTOR, brake=BRAKE, torque=TORQUE):
    return elastic_set(bodies(motor=motor, brake=brake), gears, ring, sun_torque=torque)


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
def test_rotation_of_the_mechanism_is_the_zero_mode(ring, back_ring, planets, torque):
    gears = gear_set(planets)
    model = make(gears, ring if torque > 0 else back_ring, torque=torque)
    q = rotation(gears, model)
    system = model.system
    assert np.abs(system.W.T @ q).max() < 1e-12 * gears.sun.base_radius
    assert np.abs(system.K @ q).max() < 1e-12 * np.abs(system.K).max()
    assert abs(system.load @ q) < 1e-12 * np.abs(system.load) @ np.abs(q)
    modes = undamped_modes(system, np.full(2 * planets, 5e8), damping_ratio=0.0, count=4)
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
    modes = undamped_modes(model.system, np.full(6, 5e8), damping_ratio=0.0, count=3)
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
def test_mesh_directions_are_derivatives_of_the_separation(ring, back_ring, side):
    """Central differences of exact involute kinematics, every coordinate of every body."""
    gears = gear_set()
    model = make(gears, ring if side > 0 else back_ring, torque=side * TORQUE)
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


def test_back_flanks_have_the_same_frequencies(ring, back_ring):
    gears = gear_set()
    front = make(gears, ring)
    back = make(gears, back_ring, torque=-TORQUE)
    spring = np.repeat([5e8, 7e8], 3)
    one, other = (undamped_modes(m.system, spring, damping_ratio=0.0, max_frequency=12e3) for m in (front, back))
    assert other.frequency == pytest.approx(one.frequency, rel=1e-7, abs=1e-3)
    assert other.load_deflection == pytest.approx(one.load_deflection, rel=1e-8)


@pytest.mark.slow
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
    direct = columns.T @ splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(columns)
    teeth = 2 * np.pi * np.arange(3) / 3
    R = ring_displacement(ring.modes, model.ring_mode, model.ring_phase, teeth)
    omega2 = np.diag(model.system.K)[model.ring_slice]
    assert (R / omega2[:, None]).T @ R == pytest.approx(direct, rel=1e-7, abs=1e-9 * direct.max())


def test_compliance_between_meshes_is_that_of_the_ring_modes_with_their_static_parts(sector, ring):
    """All nodal diameters together give the compliance of the ring; symmetric, positive definite."""
    gears = gear_set()
    for own in (ring, make_ring(sector, gears, foundation_stiffness=1e17)):
        C = ring_mesh_compliance(own.compliance, 108, gears.planet_angles)
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
    field = ring_field(ring.modes, q, output, 26)
    k = np.arange(108)
    ours = field @ np.exp(2j * np.pi * np.outer(np.arange(-26, 27), k) / 108)
    modes = ring.modes
    expected = np.zeros(108, complex)
    for value, m, sine in zip(q, model.ring_mode, model.ring_phase):
        wave = modes.output[m, output] * np.exp(2j * np.pi * modes.nodal_diameter[m] * k / 108)
        expected += value * modes.norm[m] * (wave.imag if sine else wave.real)
    assert ours == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_ring_turns_and_widens_the_way_its_teeth_are_pushed(ring, back_ring, side):
    """Planets push the ring by z_r / z_s of the sun's torque against its sense, and outwards, at rest."""
    gears = gear_set()
    own = ring if side > 0 else back_ring
    model = make(gears, own, torque=side * TORQUE)
    system = model.system
    # the free rotation of the mechanism moves no ring
    K = system.K + (system.W * SPRING) @ system.W.T
    q = np.linalg.lstsq(K, system.load)[0][model.ring_slice]
    radial, around = (ring_field(own.modes, q, output, 26)[26] for output in (RADIAL, TANGENTIAL))
    # foundation of 1e10 N/m^3 on the outer surface
    turned = -side * 4 * TORQUE / (1e10 * 2 * np.pi * 0.1**2 * gears.ring.face_width)
    assert around == pytest.approx(turned, rel=1e-6)
    # Lame's tube from the roots to the outer surface under the radial forces; the teeth count as none
    outer, inner, angle = 0.1, gears.ring.root_radius, gears.working_pressure_angle_planet_ring
    line = 4 * TORQUE / gears.ring.base_radius * np.sin(angle) / (2 * np.pi * gears.ring.face_width)
    apart = outer**2 - inner**2
    free = 2 * line * inner * outer / (206e9 * apart)
    softer = 1 + 1e10 * outer / 206e9 * ((outer**2 + inner**2) / apart - 0.3)
    assert radial == pytest.approx(free / softer, rel=0.02)


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
    opened = k.copy()
    opened[[1, 4], 2] = 0.0
    with pytest.raises(ContactError, match="planet 2 carries nothing") as caught:
        mesh_excitation(opened, still, force, C, backlash=0.0)
    assert caught.value.code == "E-CONTACT-OPEN"
    with pytest.raises(ContactError) as caught:
        mesh_excitation(k, still, force, 30 * C, backlash=0.0)
    assert caught.value.code == "E-CONTACT-COMPLIANCE"


def test_motor_and_brake_follow_the_driven_member():
    """With the carrier driven the motor hangs on the carrier and the brake on the sun."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_modes
    from femgear.trains.reading import with_value
    from validation.cases import reference_case

    case = with_value(reference_case(), "operation.input", "carrier")
    case = with_value(with_value(case, "static.positions", 13), "static.flank_elements", 6)
    model = solve_modes(case, solve_static(case)).model
    system = model.system
    place = {name: i for i, name in enumerate(system.dofs)}
    motor, brake = place["motor: rotation"], place["brake: rotation"]
    assert system.K[motor, place["carrier: rotation"]] == -400.0
    assert system.K[brake, place["sun: rotation"]] == -5000.0
    assert system.load[motor] == pytest.approx(100.0)
    assert system.load[brake] == pytest.approx(-20.0)


def turning(model, speed):
    return turning_system(model, centre_distance=0.051, carrier_speed=speed)


def test_bare_ring_splits_by_its_nodal_diameters_in_the_turning_frame(ring):
    """In its own frame the ring keeps f: seen from the carrier its waves have f +- n Omega / 2 pi."""
    model, speed = make(gear_set(), ring), 300.0
    system = turning(model, speed)
    assert np.array_equal(system.gyroscopic, -system.gyroscopic.T)
    own = np.arange(model.ring_slice.start, model.ring_slice.stop)
    K, G = system.K[np.ix_(own, own)], system.gyroscopic[np.ix_(own, own)]
    zero, one = np.zeros_like(K), np.eye(len(K))
    found = np.linalg.eigvals(np.block([[zero, one], [-K, -speed * G]]))
    n = ring.modes.nodal_diameter[model.ring_mode]
    sign = np.where(model.ring_phase == 1, -1.0, 1.0) * (n > 0)
    expected = 2 * np.pi * ring.modes.frequency[model.ring_mode] + sign * n * speed
    positive = np.sort(found.imag)[len(own) :]
    assert np.abs(found.real).max() < 1e-9 * expected.max()
    assert positive == pytest.approx(np.sort(expected), rel=1e-9)


def kinetic_energy(model, ring, sector, q, v, speed):
    """Of all teeth of the ring and all bodies, from positions in the housing a moment apart."""
    modes, density = ring.modes, mass(sector.grid, STEEL, gear_set().ring.face_width)
    names, M = model.system.dofs, np.diag(model.system.M)
    pairs = [i for i, name in enumerate(names) if name.endswith(": x")]
    alone = [i for i, name in enumerate(names) if name.endswith("rotation")]

    def positions(t):
        x, now = q + t * v, speed * t
        c, s = np.cos(now), np.sin(now)
        flat = [np.array([c * x[i] - s * x[i + 1], s * x[i] + c * x[i + 1]]) for i in pairs]
        wave = np.zeros((len(modes.frequency), 108), complex)
        for value, m, sine in zip(x[model.ring_slice], model.ring_mode, model.ring_phase):
            wave[m] += value * (-1j if sine else 1.0)
        # the ring stands still: a tooth that was at phi is at phi - Omega t in the frame of the carrier
        tooth = 2 * np.pi * np.arange(108) / 108 - now
        wave = modes.norm[:, None] * wave * np.exp(1j * modes.nodal_diameter[:, None] * tooth)
        return np.array(flat), x[alone], (modes.shape @ wave).real

    step = 1e-7
    flat, turn, teeth = ((a - b) / (2 * step) for a, b in zip(positions(step), positions(-step)))
    bodies = M[pairs] @ (flat**2).sum(axis=1) + M[alone] @ turn**2
    return 0.5 * (bodies + np.einsum("ik,ik->", teeth, density @ teeth))


def test_turning_terms_are_those_of_the_kinetic_energy(sector, ring):
    """Lagrange: T = v M v / 2 + Omega v B q + Omega^2 q C q / 2 gives G = B - B^T and -Omega^2 C."""
    model, speed = make(gear_set(), ring), 700.0
    system = turning(model, speed)
    rng = np.random.default_rng(8)
    shown = np.ones(len(system.M))
    # high modes would hide the terms of the low ones
    shown[model.ring_slice] = ring.modes.frequency[model.ring_mode] < 12e3

    def energy(q, v):
        return kinetic_energy(model, ring, sector, q, v, speed)

    def cross(q, v):
        return 0.5 * (energy(q, v) - energy(q, -v)) / speed

    for _ in range(3):
        a, b = shown * rng.normal(size=(2, len(shown)))
        still = b @ system.M @ b / 2
        assert energy(0 * b, b) == pytest.approx(still, rel=1e-7)
        assert cross(b, a) - cross(a, b) == pytest.approx(a @ system.gyroscopic @ b, rel=1e-6, abs=1e-7 * still)
        planets = 3 * 0.355 * 0.051**2 * speed**2 * b[place(model, "carrier: rotation")] ** 2
        centripetal = b @ (model.system.K - system.K) @ b + planets
        assert 2 * energy(b, 0 * b) == pytest.approx(centripetal, rel=1e-6)


def test_centrifugal_preload_of_the_pins_is_that_of_their_potential(ring):
    """Bearing and centrifugal potential with pins on their circle, differentiated numerically."""
    gears, speed, k, m, a = gear_set(), 200.0, PLANET.bearing_stiffness, PLANET.mass, 0.051
    model = make(gears, ring)
    system = turning(model, speed)
    names = ["carrier: rotation", *(f"planet {n}: {axis}" for n in (1, 2, 3) for axis in "xy")]
    rows = [place(model, name) for name in names]
    psi = np.asarray(gears.planet_angles)

    def potential(q):
        total = 0.0
        for n, angle in enumerate(psi):
            rest, pin = a * np.exp(1j * angle), a * np.exp(1j * (angle + q[0]))
            planet = rest + q[1 + 2 * n] + 1j * q[2 + 2 * n]
            total += 0.5 * k * abs(planet - pin) ** 2 - 0.5 * m * speed**2 * abs(planet) ** 2
        return total

    # planets sit where the bearing carries the centrifugal force
    out = m * speed**2 * a / (k - m * speed**2)
    still = np.concatenate([[0.0], *([out * np.cos(p), out * np.sin(p)] for p in psi)])
    load = np.zeros(7)
    load[1:] = system.load[rows[1:]]
    assert load[1:].reshape(3, 2) == pytest.approx((k - m * speed**2) * still[1:].reshape(3, 2), rel=1e-12)
    size = np.array([1e-3, *[1e-4] * 6])

    def second(i, j):
        e, f = np.eye(7)[i] * size, np.eye(7)[j] * size
        corners = [potential(still + s * e + t * f) * s * t for s in (1, -1) for t in (1, -1)]
        return sum(corners) / (4 * size[i] * size[j])

    found = np.array([[second(i, j) for j in range(7)] for i in range(7)])
    # without the brake's shaft and with the planets' own motion alone
    expected = system.K[np.ix_(rows, rows)] - np.diag([BRAKE.coupling_stiffness, *[0.0] * 6])
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert found / scale == pytest.approx(expected / scale, abs=3e-5)
    # the rotation of all together meets nothing
    turned = np.concatenate([[1.0], *([-a * np.sin(p), a * np.cos(p)] for p in psi)])
    assert abs(turned @ expected @ turned) < 1e-9 * 3 * m * (speed * a) ** 2


def test_turning_modes_fulfil_the_equations_of_the_housing(ring):
    """Modes of the carrier frame, seen from the housing: planets on their way round a ring at rest."""
    gears, speed = gear_set(), 1500.0
    model = make(gears, ring)
    modes = complex_modes(turning(model, speed), SPRING, speed=speed)
    names = model.system.dofs
    x = [i for i, name in enumerate(names) if name.endswith(": x")]
    sine = model.ring_slice.start + np.flatnonzero(model.ring_phase == 1)
    pairs = [(i, i + 1, 1) for i in x]
    pairs += [(i - 1, i, model.ring_diameter[i - model.ring_slice.start]) for i in sine]
    chosen = np.flatnonzero((modes.frequency > 100.0) & (modes.frequency < 4000.0))
    assert len(chosen) > 8

    def seen(t, mode):
        q = (modes.right[:, mode] * np.exp(modes.eigenvalue[mode] * t)).copy()
        for i, j, n in pairs:
            c, s = np.cos(n * speed * t), np.sin(n * speed * t)
            q[i], q[j] = c * q[i] - s * q[j], s * q[i] + c * q[j]
        return q

    for t in (0.0, 2e-4, 1.3e-3):
        moved = replace(gears, planet_angles=np.asarray(gears.planet_angles) + speed * t)
        system = make(moved, ring).system
        K = system.K + (system.W * SPRING) @ system.W.T
        i = place(model, "carrier: rotation")
        K[i, i] += 3 * PLANET.mass * (0.051 * speed) ** 2
        for mode in chosen:
            h = 0.01 / np.abs(modes.eigenvalue[mode])
            five = [seen(t + s * h, mode) for s in (-2, -1, 0, 1, 2)]
            rate = np.array([-1, 16, -30, 16, -1]) @ five / (12 * h**2)
            rest = system.M @ rate + K @ five[2]
            assert np.abs(rest).max() < 1e-6 * np.abs(system.M @ rate).max()


def test_turning_set_with_a_rigid_ring_is_the_planar_set():
    gears, speed = gear_set(), 900.0
    # one mode that no mesh moves, above all others
    rigid = CyclicModes(
        count=108,
        nodal_diameter=np.zeros(1, int),
        frequency=np.array([1e5]),
        load=np.zeros((1, 1)),
        output=np.zeros((1, 2)),
        reduced=np.zeros((1, 1)),
        recovery=np.zeros((2, 1)),
    )
    model = make(gears, RingModel(rigid, 0.0, np.zeros(1), np.zeros(1)), motor=None, brake=None)
    system = turning(model, speed)
    K = np.array(system.K)
    # the preload of the pins, which the published model leaves out
    i = place(model, "carrier: rotation")
    K[i, i] -= 3 * PLANET.mass * (0.051 * speed) ** 2
    ours = complex_modes(replace(system, K=K), SPRING, speed=speed)
    planar = gear_set_system(
        planar_from_set(
            gears,
            sun=PlanarBody(SUN.mass, SUN.inertia, SUN.support_stiffness),
            carrier=PlanarBody(CARRIER.mass, CARRIER.inertia, CARRIER.support_stiffness),
            planet=PlanarBody(PLANET.mass, PLANET.inertia),
            ring=PlanarBody(1.0, 1.0, np.inf, np.inf),
            stiffness_sun_planet=5e8,
            stiffness_planet_ring=7e8,
            planet_bearing=PLANET.bearing_stiffness,
        ),
        carrier_speed=speed,
    )
    reference = complex_modes(planar, SPRING, speed=speed)
    # a motion that grows and one that fades as fast have no order
    ours, expected = (
        found[np.lexsort((found.real, found.imag))] for found in (ours.eigenvalue[:-1], reference.eigenvalue)
    )
    assert ours == pytest.approx(expected, rel=1e-9, abs=1e-5)
    still = complex_modes(replace(planar, gyroscopic=None), SPRING)
    assert not np.allclose(still.frequency[-10:], reference.frequency[-10:], rtol=1e-3)


def test_rotation_of_the_mechanism_stays_free_in_the_turning_frame(ring):
    model = make(gear_set(), ring)
    modes = complex_modes(turning(model, 120.0), SPRING, speed=120.0)
    assert np.count_nonzero(modes.rigid) == 1
    assert np.abs(modes.eigenvalue.real).max() < 1e-6 * np.abs(modes.eigenvalue).max()


def test_wave_shares_tell_standing_from_travelling_waves(ring):
    model = make(gear_set(), ring)
    shape = np.zeros((len(model.system.dofs), 4), complex)
    first = model.ring_slice.start + int(np.flatnonzero(model.ring_diameter == 2)[0])
    # cos(2 phi) cos(wt) + sin(2 phi) sin(wt) = cos(2 phi - wt): the wave n = -2
    shape[first, 0], shape[first + 1, 0] = 1.0, -1j
    shape[first, 1], shape[first + 1, 1] = 1.0, 1j
    shape[first, 2] = 1.0
    shape[model.ring_slice.start, 3] = shape[place(model, "sun: x"), 3] = 1.0
    shares = ring_wave_shares(model, shape)
    assert shares.shape == (53, 4)
    assert shares[26 - 2, 0] == shares[26 + 2, 1] == pytest.approx(1.0)
    assert shares[[24, 28], 2] == pytest.approx([0.5, 0.5])
    assert shares[26, 3] == pytest.approx(1.0 / 1.22)
    assert shares.sum(axis=0) == pytest.approx([1.0, 1.0, 1.0, 1.0 / 1.22])


def test_highest_mesh_mode_is_not_that_of_a_stiff_bearing():
    """Sun and planets in torsion: the reference set's 14 to 17 kHz, whatever the bearings are."""
    gears, stiffness = gear_set(), np.repeat([5e8, 6.8e8], 3)
    found = [
        highest_mesh_mode(bodies(bearing=bearing), gears, stiffness, sun_torque=100.0)
        for bearing in (1e7, 3e8, 1e12, 1e15)
    ]
    assert found == pytest.approx(found[0] * np.ones(4), rel=0.1) and 12e3 < found[0] < 18e3
