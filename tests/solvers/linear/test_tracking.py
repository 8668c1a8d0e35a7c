"""Modes over a parameter: veering and crossing in closed form, equal planets, Campbell diagrams, energies."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import complex_modes
from femgear.solvers.linear.tracking import (
    TrackedModes,
    _groups,
    _matched,
    campbell_data,
    oscillating,
    track_modes,
)
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.mode_kinds import gear_set_kinds
from femgear.system.system import MechanicalSystem
from validation.reference.mode_approaches import approaches, coupling_factor, mac
from validation.reference.mode_energy import (
    body_groups,
    gear_set_springs,
    kinetic_shares,
    motion_planes,
    stiffness_of,
    strain_shares,
)

# two masses 1 on springs 1 + p and 2 - p, joined by kc: eigenvalues 1.5 + kc -+ sqrt((p - 1/2)^2 + kc^2)
SPLIT = np.diag([1.0, -1.0])


def pair(p, kc):
    return np.diag([1.0 + p, 2.0 - p]) + kc * np.array([[1.0, -1.0], [-1.0, 1.0]])


def real_family(stiffness, mass):
    def family(p):
        square, shape = eigh(stiffness(p), mass)
        return 1j * np.sqrt(square), shape

    return family


@pytest.mark.parametrize("kc", [0.05, 1e-3, 1e-4])
@pytest.mark.parametrize("steps", [2, 4, 9])
def test_known_veering(kc, steps):
    """Even one step over the veering is not taken for a crossing."""
    tracked = track_modes(real_family(lambda p: pair(p, kc), np.eye(2)), np.linspace(0.1, 0.9, steps), np.eye(2))
    assert tracked.unresolved == () and tracked.agreement.min() >= 0.9
    low = tracked.frequency[:, 0]
    exact = np.sqrt(1.5 + kc - np.sqrt((tracked.value - 0.5) ** 2 + kc**2)) / (2 * np.pi)
    assert low == pytest.approx(exact, rel=1e-12)
    (found,) = approaches(tracked, np.eye(2), within=0.3)
    high, below = np.sqrt(1.5 + kc + kc), np.sqrt(1.5 + kc - kc)
    assert found.kind == "veering"
    assert found.gap == pytest.approx((high - below) / (2 * np.pi), rel=0.02)
    assert found.value == pytest.approx(0.5, abs=0.05)
    if kc < 0.05:
        assert found.exchange > 0.9


@pytest.mark.parametrize("steps", [2, 5, 8])
def test_known_crossing(steps):
    values = np.linspace(0.0, 0.9, steps)
    tracked = track_modes(real_family(lambda p: pair(p, 0.0), np.eye(2)), values, np.eye(2))
    assert tracked.frequency[:, 0] == pytest.approx(np.sqrt(1.0 + tracked.value) / (2 * np.pi), rel=1e-12)
    assert np.array_equal(tracked.value[tracked.given], values)
    assert tracked.unresolved == () and len(tracked.value) < steps + 8
    (found,) = approaches(tracked, np.eye(2), within=0.3)
    assert found.kind == "crossing" and found.gap == 0.0 and found.exchange < 1e-6
    assert found.value == pytest.approx(0.5, abs=1e-5)
    assert found.frequency == pytest.approx(np.sqrt(1.5) / (2 * np.pi), rel=1e-5)


def test_coupling_factor_predicts_the_smallest_distance():
    """The smallest distance of the squares is 2 kc whatever the point it is predicted from."""
    for kc, p in ((0.05, 0.2), (0.01, 0.45), (0.05, 0.5)):
        square, shape = eigh(pair(p, kc))
        factor = coupling_factor(shape[:, 0], shape[:, 1], np.eye(2), SPLIT, squared=square)
        assert factor * (square[1] - square[0]) == pytest.approx(2 * kc, rel=1e-12)
    square, shape = eigh(pair(0.2, 0.0))
    assert coupling_factor(shape[:, 0], shape[:, 1], np.eye(2), SPLIT, squared=square) == 0.0


def test_mac_weighs_with_the_mass():
    mass = np.diag([1.0, 4.0])
    a, b = np.array([[2.0], [1.0]]), np.array([[2.0], [-1.0]])
    assert mac(a, b, mass) == pytest.approx(np.zeros((1, 1)), abs=1e-30)
    assert mac(a, 3j * a, mass) == pytest.approx(np.ones((1, 1)))


def planet_veering(data, near):
    """Bearing stiffness and smallest distance [Hz] of the middle and upper mode of a planet on springs."""
    a, mass = data.pressure_angle_sun_planet, np.array([0.66, 0.66, 0.61])
    rows = np.array([[-np.sin(a), -np.cos(a), 1.0], [np.sin(a), -np.cos(a), -1.0]])
    meshes = rows.T @ (np.array([[5e8], [5.2e8]]) * rows)

    def distance(k):
        stiffness = meshes + np.diag([k, k, 0.0])
        return np.diff(np.sqrt(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))))[1] / (2 * np.pi)

    best = minimize_scalar(distance, bounds=(0.7 * near, 1.4 * near), method="bounded")
    return best.x, best.fun


def test_equal_planets_cross_and_keep_their_kinds():
    """Lin and Parker (2001): modes of different kinds cross, of the same kind veer; over the planet bearings.

    Sun and ring meshes of unlike stiffness: with the equal ones of the published data the tangential motion
    of a planet mode is free of the other two, and planet modes cross as well.
    """
    base = replace(lin_parker_set(4), stiffness_planet_ring=5.2e8)
    system = gear_set_system(base)

    def at(bearing):
        return replace(base, planet_bearing=bearing)

    def family(bearing):
        modes = complex_modes(gear_set_system(at(bearing)), base.mesh_stiffness)
        return oscillating(modes)

    tracked = track_modes(family, np.geomspace(1e7, 1e9, 9), system.M)
    assert tracked.unresolved == () and tracked.eigenvalue.shape[1] == 20
    ends = [gear_set_kinds(at(tracked.value[i]), tracked.shape[i], frequency=np.ones(20)) for i in (0, -1)]
    # double modes are followed as a space: any pair of shapes in it is translational
    assert ends[0] == ends[1] and "mixed" not in ends[0]
    found, kinds = approaches(tracked, system.M), np.array(ends[0])
    crossing = [one for one in found if one.kind == "crossing"]
    assert len(crossing) > 10 and all(kinds[one.first] != kinds[one.second] for one in crossing)
    veering = [one for one in found if one.kind == "veering"]
    assert veering and all(kinds[one.first] == kinds[one.second] for one in veering)
    # planet modes are those of one planet between springs: 3 x 3 by hand (tests/models/test_planar_modes.py)
    (planet,) = (one for one in veering if kinds[one.first] == "planet")
    where, gap = planet_veering(base, planet.value)
    assert planet.gap == pytest.approx(gap, rel=0.02) and planet.value == pytest.approx(where, rel=0.02)
    exact = gear_set_modes(at(1e9)).frequency[1:]
    assert np.sort(tracked.frequency[-1]) == pytest.approx(exact, rel=1e-9)


def test_pairs_that_split_later_are_followed():
    """Double at first; then a spring in a direction that the first basis does not know."""
    direction = np.array([np.cos(0.7), np.sin(0.7)])

    def stiffness(p):
        return np.diag([4.0, 4.0]) + max(p, 0.0) * np.outer(direction, direction)

    tracked = track_modes(real_family(stiffness, np.eye(2)), [-1.0, -0.5, 0.0, 0.5, 1.0], np.eye(2))
    assert tracked.unresolved == ()
    assert np.sort(tracked.frequency[-1]) * 2 * np.pi == pytest.approx([2.0, np.sqrt(5.0)])


def test_lost_modes_and_wrong_values_are_refused():
    def family(p):
        square, shape = eigh(pair(p, 0.01))
        return 1j * np.sqrt(square[: 1 + (p < 0.5)]), shape[:, : 1 + (p < 0.5)]

    with pytest.raises(ConvergenceError, match=r"E-MODES.*0\.6"):
        track_modes(family, [0.2, 0.6], np.eye(2))
    with pytest.raises(CaseError, match="E-RANGE"):
        track_modes(family, [0.2, 0.2], np.eye(2))


def rotating(m=2.0, k=800.0, gap=0.0):
    """A mass in a turning frame; `gap` makes the springs of the frame unlike."""

    def at(speed):
        K = np.diag([k, k + gap]) - m * speed**2 * np.eye(2)
        G = 2.0 * m * np.array([[0.0, -1.0], [1.0, 0.0]])
        return MechanicalSystem(
            m * np.eye(2), np.zeros((2, 2)), K, np.zeros((2, 0)), np.zeros(2), ("mass: x", "mass: y"), G
        )

    return at


def test_campbell_of_the_rotating_mass():
    """20 -+ speed, split from a double mode; the line of order 3 meets them at 20/4 and 20/2."""
    at = rotating()
    planes = motion_planes(at(0.0).dofs)
    data = campbell_data(at, np.linspace(0.0, 15.0, 7), np.zeros(0), orders=[3.0], planes=planes)
    forward = int(np.argmin(data.frequency[-1]))
    assert data.frequency[:, forward] * 2 * np.pi == pytest.approx(20.0 - data.speed, rel=1e-9)
    assert data.frequency[:, 1 - forward] * 2 * np.pi == pytest.approx(20.0 + data.speed, rel=1e-9)
    assert data.whirl[:, forward] == pytest.approx(np.ones(len(data.speed)), abs=1e-6)
    assert data.whirl[:, 1 - forward] == pytest.approx(-np.ones(len(data.speed)), abs=1e-6)
    assert [one.speed for one in data.critical] == pytest.approx([5.0, 10.0], rel=1e-9)
    assert [one.branch for one in data.critical] == [forward, 1 - forward]
    assert data.critical[0].frequency == pytest.approx(15.0 / (2 * np.pi))
    assert np.abs(data.damping_ratio).max() < 1e-9


def test_critical_speeds_converge():
    """Unlike springs: (k1 - m W^2 - m w^2)(k2 - ..) = 4 m^2 W^2 w^2 with w = 3 W has two roots in W."""
    errors = []
    for steps in (6, 11, 21):
        data = campbell_data(rotating(gap=400.0), np.linspace(0.5, 15.0, steps), np.zeros(0), orders=[3.0])
        found = np.array([one.speed for one in data.critical])
        roots = np.roots([100 * 4.0 - 36 * 4.0, 0, -10 * 2.0 * 2000.0, 0, 800.0 * 1200.0])
        exact = np.sort(roots.real[roots.real > 0])
        errors.append(np.abs(found - exact).max())
    assert errors[2] < 1e-3 and errors[2] < errors[0] / 8


def test_campbell_of_the_planar_set():
    data = lin_parker_set(3)
    found = campbell_data(
        lambda speed: gear_set_system(data, carrier_speed=speed),
        np.linspace(0.0, 300.0, 4),
        data.mesh_stiffness,
        orders=[73.0],
        count=17,
        planes=motion_planes(gear_set_system(data).dofs),
    )
    assert found.tracked.unresolved == ()
    # translational pairs split into one forward and one backward mode
    first = np.flatnonzero(np.abs(found.frequency[0] - 743.1639) < 0.01)
    assert len(first) == 2 and found.whirl[-1, first].prod() < 0.0
    line = 73.0 * found.speed[-1] / (2 * np.pi)
    below = np.count_nonzero(found.frequency[-1] < line)
    assert len(found.critical) >= below > 3
    for one in found.critical:
        system = gear_set_system(data, carrier_speed=one.speed)
        exact = complex_modes(system, data.mesh_stiffness, speed=one.speed).eigenvalue.imag / (2 * np.pi)
        assert np.abs(exact / one.frequency - 1.0).min() < 1e-4


def test_energy_shares():
    data = lin_parker_set(3)
    system, modes, springs = gear_set_system(data), gear_set_modes(data), gear_set_springs(data)
    total = system.K + (system.W * data.mesh_stiffness) @ system.W.T
    assert np.abs(stiffness_of(springs) - total).max() < 1e-12 * np.abs(total).max()
    kinetic = kinetic_shares(system.M, modes.shape, body_groups(system.dofs))
    strain = strain_shares(springs, modes.shape)
    assert list(kinetic) == ["carrier", "ring", "sun", "planet 1", "planet 2", "planet 3"]
    assert sum(kinetic.values()) == pytest.approx(np.ones(18), abs=1e-12)
    assert sum(strain.values())[0] == 0.0
    assert sum(strain.values())[1:] == pytest.approx(np.ones(17), abs=1e-12)
    # strain energy is the derivative of the frequency: Rayleigh, dw^2/dk = (w^T phi)^2
    rotational = list(modes.kind).index("rotational")
    for name, change in (
        ("sun-planet 1", "stiffness_sun_planet"),
        ("planet 2-ring", "stiffness_planet_ring"),
    ):
        k = np.array(getattr(data, change))
        k[int(name.split("planet ")[1][0]) - 1 if "ring" in name else 0] *= 1.0 + 1e-4
        stiffer = gear_set_modes(replace(data, **{change: k})).frequency[rotational]
        slope = 2.0 * (stiffer / modes.frequency[rotational] - 1.0) / 1e-4
        assert strain[name][rotational] == pytest.approx(slope, rel=1e-2)


def test_energy_of_two_masses_by_hand():
    """Equal masses on equal springs 1, joined by 4: modes 1 (joint at rest) and 9 (8/9 in the joint)."""
    shape = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
    parts = {
        "ground": (np.eye(2), np.ones(2)),
        "joint": (np.array([[1.0], [-1.0]]), np.array([4.0])),
    }
    strain = strain_shares(parts, shape)
    assert strain["joint"] == pytest.approx([0.0, 8.0 / 9.0])
    assert strain["ground"] == pytest.approx([1.0, 1.0 / 9.0])
    # complex shapes count with their mean over a period
    assert strain_shares(parts, shape * np.exp(0.3j))["joint"] == pytest.approx([0.0, 8.0 / 9.0])
    assert kinetic_shares(np.diag([3.0, 1.0]), shape, {"a": [0], "b": [1]})["a"] == pytest.approx([0.75, 0.75])
    with pytest.raises(CaseError, match="E-SHAPE"):
        kinetic_shares(np.eye(2), shape, {"a": [0]})


def test_of_modes_of_one_shape_the_nearer_eigenvalue_goes_on():
    """Order and sign of what the family gives change from value to value; shapes tell nothing."""

    def family(p):
        turn = round(10 * p) % 2
        value = 1j * np.array([1.0, 1.5]) * (1.0 + 0.1 * p)
        shape = np.array([[1.0, 1.0], [0.01, -0.01]])
        return value[::-1] if turn else value, -shape if turn else shape

    tracked = track_modes(family, np.linspace(0.0, 1.0, 11), np.eye(2))
    assert tracked.unresolved == ()
    assert tracked.eigenvalue == pytest.approx(1j * np.outer(1.0 + 0.1 * tracked.value, [1.0, 1.5]))


def test_a_jump_of_the_shapes_stays_unresolved():
    """At p = 1.37 both shapes turn by 45 degrees: no step is small enough, and the smallest one is told."""

    def family(p):
        angle = 0.0 if p < 1.37 else 0.25 * np.pi
        return np.array([1j, 2j]), np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    tracked = track_modes(family, [1.0, 2.0, 3.0], np.eye(2))
    ((start, end),) = tracked.unresolved
    assert start < 1.37 <= end and end - start == pytest.approx(2.0**-14)
    assert tracked.agreement.min() == pytest.approx(0.5)


def test_of_modes_of_one_shape_each_goes_on_at_its_own_rate():
    """They cross between two values: the nearer eigenvalue is that of the other one."""

    def family(p):
        value, shape = 1j * np.array([1.0 + p, 2.0 - p]), np.array([[1.0, 1.0], [1e-4, -1e-4]])
        order = np.argsort(value.imag)
        return value[order], shape

    tracked = track_modes(family, np.linspace(0.0, 0.9, 8), np.eye(2))
    assert tracked.eigenvalue[:, 0] == pytest.approx(1j * (1.0 + tracked.value))
    assert tracked.eigenvalue[:, 1] == pytest.approx(1j * (2.0 - tracked.value))


def test_damping_ratio_is_the_cosine_of_the_eigenvalue():
    value = np.array([[-0.6 + 0.8j, 3.0 + 4.0j], [-5.0, 0.0], [10.0j, -0.03 + 0.04j]])
    tracked = TrackedModes(np.arange(3.0), np.ones(3, bool), value, np.ones((3, 2, 2)), np.ones((2, 2)), ())
    assert tracked.damping_ratio == pytest.approx(np.array([[0.6, -0.6], [1.0, 0.0], [0.0, 0.6]]))
    assert tracked.frequency == pytest.approx(np.array([[1.0, 5.0], [5.0, 0.0], [10.0, 0.05]]) / (2.0 * np.pi))


def test_members_of_a_multiple_eigenvalue_are_found_whatever_their_rounding():
    """Damped alike: real parts differ by rounding only, and tell nothing of what belongs together."""
    value = np.array([1.0j, 2.0j, 1.0j, 3.0j, 2.0j, 1.0j]) - 0.01
    value += 1e-12 * np.array([0.0, 1.0, 2.0, 3.0, -1.0, 4.0])
    for order in (np.arange(6), np.arange(6)[::-1], np.array([3, 0, 5, 1, 4, 2])):
        found = [sorted(order[group].tolist()) for group in _groups(value[order])]
        assert sorted(found) == [[0, 2, 5], [1, 4]]
    assert _groups(np.array([1.0j, 1.0j * (1.0 + 1e-5), 2.0j])) == []


@pytest.mark.parametrize("size", [0.5, 2.0])
@pytest.mark.parametrize("value", [[1j, 2j], [1j, 1j]], ids=["single", "double"])
def test_vectors_take_the_phase_of_the_old_ones(value, size):
    old = np.linalg.qr(np.array([[1.0, 2.0j], [0.5, 1.0], [1j, 0.3]]))[0]
    new = size * old * np.exp([0.7j, -2.1j])
    # the members of a multiple one come back as a basis of unit vectors
    wanted = old if value[0] == value[1] else size * old
    np.testing.assert_allclose(_matched(old, new, np.array(value)), wanted, atol=1e-14)


def test_a_vector_without_anything_of_the_old_one_keeps_its_phase():
    new = 0.8j * np.eye(2)
    np.testing.assert_array_equal(_matched(np.eye(2)[::-1], new, np.array([1j, 2j])), new)
