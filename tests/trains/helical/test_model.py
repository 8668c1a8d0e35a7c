"""The helical set against exact helicoids, published pairs, the planar set and Kahraman's table."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from published.planetary_sets import kahraman_set, lin_parker_set
from scipy.linalg import eigh, null_space
from scipy.optimize import root
from uneven_set import ANGLES, UNEVEN

from femgear.errors import CaseError
from femgear.findings import DOUBT
from femgear.solvers.linear.modal import undamped_modes
from femgear.system.mesh_directions import (
    dof_names,
    free_motions,
    gear_set_system,
    mesh_directions,
    pin_directions,
)
from femgear.system.rigid_bodies import HelicalBody, HelicalSupport, PlanarTorque, body_masses, gear_geometry
from femgear.trains.helical.model import HelicalSet, contact_ratios, helical_warnings
from femgear.trains.reading import read_case, with_values
from validation import helical
from validation.helical import rigid_motions
from validation.planetary import nrel_set

CASES = Path(__file__).parents[3] / "cases"


def uneven(**changes):
    """The uneven set with unequal pins as well."""
    return kahraman_set(
        **UNEVEN,
        base_helix_angle=math.radians(14.0),
        planet_bearing=HelicalSupport(np.array([1e8, 2e8, 3e8]), 4e8, 1e5, 2e3),
        contact_points="pitch_point",
        **changes,
    )


@pytest.mark.parametrize("part", [helical.table_4, helical.rigid, helical.leakage, helical.response])
def test_validation_rows_pass(part):
    rows = part()
    judged = [row for row in rows if row.verdict != "information"]
    assert len(judged) >= 4 and [row for row in judged if row.verdict != "passes"] == []


def helicoid(base, pitch, start, side, roll, height):
    """Point of an involute helicoid: an involute of the base circle that turns with the height."""
    turn = start + pitch * height + side * roll
    radial, along = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    return base * radial - side * base * roll * along + np.array([0.0, 0.0, height])


def rotation(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def reach(base, pitch, side, centre, contact, normal, body, moved):
    """Where the line through the contact point along the normal cuts the flank of a body that has moved."""
    arm = contact - centre
    radius = np.hypot(*arm[:2])
    roll = math.sqrt((radius / base) ** 2 - 1.0)
    start = math.atan2(arm[1], arm[0]) - side * (roll - math.atan(roll)) - pitch * arm[2]
    assert helicoid(base, pitch, start, side, roll, arm[2]) == pytest.approx(arm, abs=1e-14)

    def gap(unknown):
        u, height, s = unknown
        point = helicoid(base, pitch, start, side, u, height)
        shift, axis, angle = moved
        turned = point if not angle else rotation(axis, angle) @ point
        return (centre + shift + turned - contact - s * normal) / base

    return root(gap, [roll, arm[2], 0.0], tol=1e-13).x[2]


@pytest.mark.parametrize("flank", [1, -1])
@pytest.mark.parametrize("gear", ["sun", "ring"])
@pytest.mark.parametrize("hand", [1, -1])
def test_mesh_columns_are_the_approach_of_exact_helicoids(flank, gear, hand):
    """Both flanks are moved as rigid surfaces; what changes along their normal is the approach."""
    data = uneven(slices=3, face_width=0.04)
    data = replace(data, base_helix_angle=hand * data.base_helix_angle)
    planet, slice_ = 1, 2
    height, beta, psi = data.slice_heights[slice_], data.base_helix_angle, ANGLES[planet]
    out = np.array([math.cos(psi), math.sin(psi), 0.0])
    side_way = np.array([-out[1], out[0], 0.0])
    alpha = data.pressure_angle_sun_planet if gear == "sun" else data.pressure_angle_planet_ring
    base, base_p = getattr(data, f"{gear}_radius"), data.planet_radius
    contact = base / math.cos(alpha) * out + (0.0, 0.0, height)
    centres = {gear: np.zeros(3), "planet": data.centre_distance * out}
    # handedness: twist of the flanks per height; a left-handed planet runs in a left-handed ring
    twist = math.tan(beta) / np.array([base, base_p]) * ((1, -1) if gear == "sun" else (-1, -1))
    # the side of the tooth: its involute unwinds against the way in which it pushes
    sun_side = -flank
    sides = (sun_side, sun_side) if gear == "sun" else (flank, flank)
    tangent = [
        helicoid_normal(*args, contact - c)
        for args, c in zip(((base, twist[0], sides[0]), (base_p, twist[1], sides[1])), centres.values())
    ]
    normal = tangent[0] if tangent[0] @ out > 0 else -tangent[0]
    assert abs(normal @ tangent[1]) == pytest.approx(1.0, abs=1e-12)

    def approach(body, moved):
        args = (base, twist[0], sides[0]) if body == gear else (base_p, twist[1], sides[1])
        first = (body == "sun") or (gear == "ring" and body == "planet")
        cut = reach(*args, centres[body], contact, normal, body, moved)
        return cut if first else -cut

    directions = {gear: np.eye(3), "planet": np.array([out, side_way, (0, 0, 1)])}
    radius = {gear: base, "planet": base_p}
    rows = {gear: 6 * ("carrier", "ring", "sun").index(gear), "planet": 18 + 6 * planet}
    column = mesh_directions(data, flank)[:, ((gear == "ring") * 3 + planet) * 3 + slice_]
    step = 1e-6
    for body, first in rows.items():
        for i, axis in enumerate(directions[body]):
            moved = [approach(body, (s * step * axis, axis, 0.0)) for s in (1, -1)]
            assert (moved[0] - moved[1]) / (2 * step) == pytest.approx(column[first + i], abs=1e-6)
            turned = [approach(body, (np.zeros(3), axis, s * step / radius[body])) for s in (1, -1)]
            assert (turned[0] - turned[1]) / (2 * step) == pytest.approx(column[first + 3 + i], abs=1e-6)
    rest = np.ones(len(column), bool)
    for first in rows.values():
        rest[first : first + 6] = False
    assert not column[rest].any()


def helicoid_normal(base, pitch, side, arm):
    """Unit normal of the helicoid through a point, by differences."""
    roll = math.sqrt((np.hypot(*arm[:2]) / base) ** 2 - 1.0)
    start = math.atan2(arm[1], arm[0]) - side * (roll - math.atan(roll)) - pitch * arm[2]
    step = 1e-6
    one, two = (
        helicoid(base, pitch, start, side, roll + a, arm[2] + b)
        - helicoid(base, pitch, start, side, roll - a, arm[2] - b)
        for a, b in ((step, 0.0), (0.0, step))
    )
    normal = np.cross(one, two)
    return normal / np.linalg.norm(normal)


@pytest.mark.parametrize("hand", [1, -1])
def test_forces_at_the_base_circles_make_the_published_helical_pair(hand):
    """Mesh deflection of Kubur, Kahraman, Zini and Kienzle (2004) in the twelve motions of the two gears."""
    data = replace(uneven(), contact_points="base_circles")
    data = replace(data, base_helix_angle=hand * data.base_helix_angle)
    W, beta = mesh_directions(data), data.base_helix_angle
    c, s = math.cos(beta), math.sin(beta)
    for n, phi in enumerate(ANGLES):
        psi = data.pressure_angle_sun_planet - phi
        along = np.array([math.sin(psi), math.cos(psi)])
        first = np.array([*(c * along), -s, *(s * along), c])  # tilts and rotation as r theta
        second = np.array([*(-c * along), s, *(s * along), c])
        found = W[18 + 6 * n : 24 + 6 * n, n].copy()
        for row in (0, 3):  # from radial and tangential to x and y
            found[row : row + 2] = (
                np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]]) @ (found[row : row + 2])
            )
        assert W[12:18, n] == pytest.approx(first, abs=1e-15)
        assert found == pytest.approx(second, abs=1e-15)


def test_modes_of_a_pair_are_those_of_its_published_matrices():
    """Sun and one planet on springs, everything else held: twelve motions."""
    held = HelicalSupport(*[math.inf] * 4)
    data = kahraman_set(planet_angles=[0.7], stiffness_planet_ring=0.0)
    data = replace(
        data,
        carrier=replace(data.carrier, support=held),
        ring=replace(data.ring, support=held),
        sun=replace(data.sun, support=HelicalSupport(1e8, 3e7, 2e4, 5e3)),
        planet_bearing=HelicalSupport(2e8, 4e7, 1e4, 6e3),
    )
    system = gear_set_system(data)
    assert len(system.M) == 12
    psi, beta = data.pressure_angle_sun_planet - 0.7, data.base_helix_angle
    c, s, sp, cp = math.cos(beta), math.sin(beta), math.sin(psi), math.cos(psi)
    r1, r2 = data.sun_radius, data.planet_radius
    one = [sp * c, cp * c, -s, r1 * sp * s, r1 * cp * s, r1 * c]  # on true angles
    two = [-sp * c, -cp * c, s, r2 * sp * s, r2 * cp * s, r2 * c]
    h = np.array(one + two)
    K = np.diag([1e8, 1e8, 3e7, 2e4, 2e4, 5e3, 2e8, 2e8, 4e7, 1e4, 1e4, 6e3]) + 2e8 * np.outer(h, h)
    inertias = [[b.mass] * 3 + [b.diametral_inertia] * 2 + [b.inertia] for b in (data.sun, data.planet)]
    expected = np.sqrt(eigh(K, np.diag(np.ravel(inertias)), eigvals_only=True)) / (2 * math.pi)
    modes = undamped_modes(system, data.column_stiffness, damping_ratio=0.0)
    assert modes.frequency == pytest.approx(expected, rel=1e-10)


def spur_pair(**changes):
    """Lin and Parker's set, and the same set without helix on supports in all directions."""
    planar = replace(
        lin_parker_set(3),
        planet_angles=ANGLES,
        stiffness_sun_planet=[4e8, 5e8, 6e8],
        planet_bearing=[1e8, 2e8, 3e8],
        **changes,
    )

    def body(name, **supports):
        b = getattr(planar, name)
        support = HelicalSupport(b.support, 1e8, 1e5, b.torsional_support)
        return HelicalBody(b.mass, b.inertia, 0.6 * b.inertia, HelicalSupport() if name == "planet" else support)

    names = ("sun_radius", "ring_radius", "planet_radius", "centre_distance", "planet_angles")
    names += ("stiffness_sun_planet", "stiffness_planet_ring")
    names += ("pressure_angle_sun_planet", "pressure_angle_planet_ring")
    data = HelicalSet(
        **{name: body(name) for name in ("sun", "ring", "carrier", "planet")},
        **{name: getattr(planar, name) for name in names},
        base_helix_angle=0.0,
        planet_bearing=HelicalSupport(planar.planet_bearing, 1e8, 1e5, 0.0),
    )
    return planar, data


@pytest.mark.parametrize("torque", [None, PlanarTorque(-700.0, "carrier", "sun")])
@pytest.mark.parametrize("contact_points", ["pitch_point", "base_circles"])
@pytest.mark.parametrize("sun_support", [1e8, math.inf])
def test_without_helix_the_plane_motions_are_those_of_the_planar_set(torque, contact_points, sun_support):
    planar, data = spur_pair()
    planar = replace(planar, sun=replace(planar.sun, support=sun_support))
    support = replace(data.sun.support, radial=sun_support)
    data = replace(data, contact_points=contact_points, sun=replace(data.sun, support=support))
    flat, system = gear_set_system(planar, torque=torque), gear_set_system(data, torque=torque)
    plane = [system.dofs.index(name) for name in flat.dofs]
    rest = np.setdiff1d(np.arange(len(system.M)), plane)
    size = np.abs(flat.K).max()
    for name in ("M", "K"):
        ours, theirs = getattr(system, name), getattr(flat, name)
        assert ours[np.ix_(plane, plane)] == pytest.approx(theirs, rel=1e-12, abs=1e-12 * np.abs(theirs).max())
        assert np.abs(ours[np.ix_(plane, rest)]).max() <= 1e-12 * size
    assert system.W[plane] == pytest.approx(flat.W, abs=1e-15)
    assert np.abs(system.W[rest]).max() == 0.0
    assert system.load[plane] == pytest.approx(flat.load, rel=1e-12)
    k = planar.mesh_stiffness
    one, two = (undamped_modes(s, k, damping_ratio=0.0).frequency for s in (flat, system))
    missing = [np.abs(two / f - 1.0).min() for f in one[one > 0.0]]
    assert max(missing) < 1e-9


def test_slices_carry_tilts_as_a_spread_spring_does():
    """Tilting against the line of action by phi: moment k b^2 / 12 phi of a spring spread over the width."""
    for slices in (1, 2, 40):
        data = replace(spur_pair()[1], slices=slices, face_width=0.05)
        W, k = mesh_directions(data), data.column_stiffness
        tilt = np.zeros(len(W))
        psi, alpha = ANGLES[0], data.pressure_angle_sun_planet
        # about the axis across the line of action, so that heights move along it
        heading = psi + 0.5 * math.pi - alpha
        tilt[15:17] = data.sun_radius * np.array([-math.sin(heading), math.cos(heading)])
        strain = W[:, :slices].T @ tilt
        energy = k[:slices] @ strain**2
        assert energy == pytest.approx(4e8 * 0.05**2 / 12 * (1 - 1 / slices**2), rel=1e-12, abs=1e-20)
    assert data.slice_heights.sum() == pytest.approx(0.0, abs=1e-15)


def test_infinite_supports_and_pins_are_constraints():
    """The same from the free set, on the null space of what is held."""
    data = uneven()
    held, free = (
        replace(
            data,
            planet_bearing=HelicalSupport(v, 4e8, v, 2e3),
            ring=replace(data.ring, support=replace(data.ring.support, torsional=v)),
        )
        for v in (math.inf, 0.0)
    )
    system, loose = gear_set_system(held), gear_set_system(free)
    assert len(system.M) == 36 - 1 - 12
    assert "planet 1: radial" not in system.dofs and "planet 1: z" in system.dofs
    rows = [pin_directions(data)[:, n, axis] for n in range(3) for axis in (0, 1, 3, 4)] + [np.eye(36)[11]]
    basis = null_space(np.array(rows) / np.linalg.norm(rows, axis=1)[:, None])
    K = loose.K + (loose.W * data.column_stiffness) @ loose.W.T
    expected = np.sqrt(np.abs(eigh(basis.T @ K @ basis, basis.T @ loose.M @ basis, eigvals_only=True)))
    found = undamped_modes(system, data.column_stiffness, damping_ratio=0.0).frequency
    assert found[1:] == pytest.approx(expected[1:] / (2 * math.pi), rel=1e-8)
    assert np.abs(np.array(rows) @ free_motions(held)).max() < 1e-12


def test_pins_feel_no_rigid_motion_and_all_relative_ones():
    data = uneven()
    strain = np.einsum("ina,ik->nak", pin_directions(data), rigid_motions(data))
    # the whole set turns about z: planets turn with the carrier
    assert np.abs(strain).max() < 1e-12
    r = data.planet_radius
    own = np.array([pin_directions(data)[18 + 6 * n : 24 + 6 * n, n] for n in range(3)])
    assert own == pytest.approx(np.broadcast_to(np.diag([1, 1, 1, 1 / r, 1 / r, 1 / r]), own.shape), rel=1e-15)


def test_torque_is_carried_by_meshes_and_pins_in_equilibrium():
    """Mesh forces from equilibrium of moments; axial forces on each planet cancel."""
    data = kahraman_set(contact_points="pitch_point")
    system = gear_set_system(data, torque=PlanarTorque(100.0))
    modes = undamped_modes(system, data.column_stiffness, damping_ratio=0.0)
    force = data.column_stiffness * modes.load_deflection
    around = 100.0 / 4 / 0.024 / math.cos(math.radians(20.0))
    assert force == pytest.approx(np.full(8, around), rel=1e-6)
    assert system.load @ (system.load != 0) == pytest.approx(100 / 0.024 * (1 - 2 * math.cos(math.radians(21.34))))
    axial = mesh_directions(data)[20::6] @ force
    assert np.abs(axial).max() < 1e-6 * force[0]
    with pytest.raises(CaseError, match="E-MECHANISM"):
        held = replace(data.sun, support=replace(data.sun.support, torsional=math.inf))
        gear_set_system(replace(data, sun=held), torque=PlanarTorque(1.0))


def test_data_of_a_geared_set():
    gears = nrel_set()
    body = HelicalBody(2.0, 0.3, 0.2)
    base = math.atan(math.tan(math.radians(8.0)) * math.cos(gears.sun.pressure_angle))
    data = HelicalSet(
        **gear_geometry(gears),
        base_helix_angle=base,
        sun=body,
        ring=body,
        carrier=body,
        planet=body,
        stiffness_sun_planet=1e9,
        stiffness_planet_ring=2e9,
        planet_bearing=HelicalSupport(1e9, 1e9, 1e6),
        slices=4,
        face_width=0.1,
    )
    assert np.abs(mesh_directions(data).T @ rigid_motions(data)).max() < 1e-12
    assert data.column_stiffness == pytest.approx(np.repeat([0.25e9, 0.5e9], 4 * gears.n_planets))
    ratios = contact_ratios(gears, helix_angle=math.radians(8.0))
    axial_pitch = math.pi * gears.sun.module / math.tan(math.radians(8.0))
    assert ratios[:, 1] == pytest.approx(gears.sun.face_width / axial_pitch, rel=1e-12)
    assert ratios[:, 0] == pytest.approx([gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring])


def test_reduced_data_are_the_masses_of_the_coordinates():
    data = kahraman_set()
    expected = [3.0, 3.0, 3.0, 0.75, 0.75, 1.5]
    assert body_masses(data)[0] == pytest.approx(expected, rel=1e-14)
    assert len(dof_names(kahraman_set())) == 42 and dof_names(kahraman_set())[41] == "planet 4: u"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"sun_radius": -1.0}, "sun radius"),
        ({"ring_radius": 0.01}, "centre distance"),
        ({"planet_angles": [0.0, 4.0, 3.0, 5.0]}, "planet angles"),
        ({"stiffness_sun_planet": [1e8, 1e8]}, "stiffness sun planet"),
        ({"stiffness_planet_ring": math.nan}, "stiffness planet ring"),
        ({"planet_bearing": 1e8}, "planet bearing"),
        ({"planet_bearing": HelicalSupport(np.ones(3))}, "planet bearing"),
        ({"planet_angles": None}, "planet angles"),
        ({"stiffness_sun_planet": "a"}, "stiffness sun planet"),
        ({"sun_radius": "a"}, "sun radius"),
        ({"centre_distance": 1.0}, "centre distance"),
        ({"planet": HelicalBody(1.0, 1.0, 1.0, HelicalSupport(1.0))}, "planet: support"),
        ({"pressure_angle_sun_planet": 21.0}, "pressure angle"),
    ],
)
def test_data_that_no_set_can_have_are_refused(changes, text):
    with pytest.raises(CaseError, match="E-RANGE") as caught:
        kahraman_set(**changes)
    assert text in caught.value.message


SOFT_PINS = {
    "material.treatment": "case hardened steel",
    "material.hardness": 700,
    "helical.planet.tilt_stiffness": "4608 N m/rad",
}
GIVEN_MESHES = {"sun_planet": "200e6 N/m", "planet_ring": "200e6 N/m"}


def thrust_findings(**changes):
    """W-THRUST of the reference case with safeties, on pins as soft as those of a draft, before changes."""
    changes = SOFT_PINS | {key.replace("__", "."): value for key, value in changes.items()}
    case = with_values(read_case(CASES / "helical_30_20_70.toml"), changes)
    return [finding for finding in helical_warnings(case) if finding.code == "W-THRUST"]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"helical__mesh_stiffness": GIVEN_MESHES},
        {"helical__mesh_stiffness": GIVEN_MESHES, "static__slices": 25},
        {"operation__torque": "-150 N m"},
    ],
)
def test_safeties_of_planets_that_tilt_are_doubted(changes):
    """19.54 N m are the moment of the pins by the rigid bodies (docs/helical.md)."""
    (doubt,) = thrust_findings(**changes)
    assert doubt.severity == DOUBT and doubt.key == "helical.planet.tilt_stiffness"
    assert "up to 19.5 N m" in doubt.text and "femgear gearbox CASE" in doubt.remedy


def test_tilt_under_thrust_makes_the_load_over_the_width_uneven():
    """By hand on pins of 1e5 N m/rad: 0.19 mrad, 1.73 um over 25 mm; a mesh of 14 N/(mm um) gives by 4.5 um."""
    stiff, soft = (thrust_findings(helical__planet__tilt_stiffness=f"{k} N m/rad")[0].text for k in ("1e5", "4608"))
    tilt, factor = (float(stiff.partition(word)[2].split(". ")[0].split()[0]) for word in (": by ", "K_Hbeta about "))
    assert tilt == pytest.approx(0.19, rel=0.1)
    # apart over twice the approach under the mean load
    assert factor == pytest.approx(1.0 + 0.5 * 1.73 / 4.5, abs=0.06)
    assert "about 3.2" in soft


@pytest.mark.parametrize(
    "changes",
    [
        {"helical__planet__tilt_stiffness": "1.844326e7 N m/rad"},  # as printed: 1 urad
        {"helical__helix_angle": "3 deg", "ring__outer_radius": "80 mm"},
        {"static__slices": 25},  # static.nc has K_Hbeta, and its own doubt
        {"material__treatment": None, "material__hardness": None},
    ],
)
def test_safeties_without_such_tilts_are_not_doubted_by_them(changes):
    assert not thrust_findings(**changes)
