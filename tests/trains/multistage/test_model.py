"""Stages in series: exact fractions, an assembly from springs in one fixed frame, single sets."""

import math
from collections import Counter
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from published.multistage_example import four_stage_train, published_train
from published.planetary_sets import lin_parker_set
from scipy.linalg import eigh
from small_trains import closed_set, published_table, stage, two_stages

from femgear.errors import CaseError
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.rigid_bodies import CENTRAL
from femgear.trains.multistage.model import (
    Member,
    MultistageSet,
    PlanetaryStage,
    StageCoupling,
    in_series,
    joined_motions,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    speed_ratio,
    stage_slices,
    train_speeds,
    train_torques,
)
from femgear.trains.multistage.stages import multistage_modes, multistage_problem

# --- speeds and torques -------------------------------------------------------------------------------


# what a stage makes of the speed, by held, driving and driven member
RATIOS = {
    ("ring", "sun", "carrier"): lambda zs, zr: 1 + Fraction(zr, zs),
    ("carrier", "sun", "ring"): lambda zs, zr: -Fraction(zr, zs),
    ("sun", "ring", "carrier"): lambda zs, zr: 1 + Fraction(zs, zr),
    ("ring", "carrier", "sun"): lambda zs, zr: 1 / (1 + Fraction(zr, zs)),
    ("carrier", "ring", "sun"): lambda zs, zr: -Fraction(zs, zr),
}


@pytest.mark.parametrize(
    "ways",
    [
        [("ring", "sun", "carrier")] * 4,
        [("ring", "sun", "carrier"), ("carrier", "sun", "ring"), ("sun", "ring", "carrier")],
        [("carrier", "ring", "sun"), ("ring", "carrier", "sun"), ("ring", "sun", "carrier")],
    ],
)
def test_ratio_and_torques_are_those_of_exact_fractions(ways):
    teeth = [(21, 42, 105), (21, 33, 87), (22, 26, 74), (24, 24, 72)][: len(ways)]
    stages = [stage(z, fixed=way[0]) for z, way in zip(teeth, ways)]
    couplings = tuple(
        StageCoupling(Member(n + 1, ways[n][2]), Member(n + 2, ways[n + 1][1])) for n in range(len(ways) - 1)
    )
    ends = {"input": Member(1, ways[0][1]), "output": Member(len(ways), ways[-1][2])}
    train = MultistageSet(stages=tuple(stages), couplings=couplings, **ends)
    exact, speed, torque = Fraction(1), Fraction(157), Fraction(350)
    speeds, torques = train_speeds(train, float(speed)), train_torques(train, float(torque))
    for number, ((held, driving, driven), (zs, zp, zr)) in enumerate(zip(ways, teeth), 1):
        before, exact = exact, exact * RATIOS[held, driving, driven](zs, zr)
        w = {held: Fraction(0), driving: speed / before, driven: speed / exact}
        t = {driving: torque * before, driven: -torque * exact}
        t[held] = -sum(t.values())
        for name in CENTRAL:
            assert speeds.of(Member(number, name)) == pytest.approx(float(w[name]), rel=1e-12, abs=1e-12)
            assert getattr(torques, name)[number - 1] == pytest.approx(float(t[name]), rel=1e-12)
        relative = w["sun"] - w["carrier"]
        planet = w["carrier"] - relative * Fraction(zs, zp)
        assert speeds.planet[number - 1] == pytest.approx(float(planet), rel=1e-12)
        hertz = float(abs(relative) * zs) / (2.0 * math.pi)
        assert speeds.mesh_frequency[number - 1] == pytest.approx(hertz, rel=1e-12)
    assert speed_ratio(train) == pytest.approx(float(exact), rel=1e-12)
    assert torques.output == pytest.approx(float(-torque * exact), rel=1e-12)
    # base radii that belong to the teeth give the same balance
    assert train_torques(train, 350.0, radii=True).output == pytest.approx(torques.output, rel=1e-12)


def test_differential_stage_with_two_couplings():
    """Ring 1 turns the carrier of stage 2, the common sun shaft drives both: Simpson's first gear."""
    one, two = (30, 18, 66), (24, 24, 72)
    train = MultistageSet(
        stages=(stage(one, fixed=None), stage(two, fixed="carrier")),
        couplings=(
            StageCoupling(Member(1, "sun"), Member(2, "sun")),
            StageCoupling(Member(1, "carrier"), Member(2, "ring")),
        ),
        input=Member(1, "ring"),
        output=Member(1, "carrier"),
    )
    # w_s = -3 w_out in stage 2; 30 w_s + 66 w_in = 96 w_out in stage 1
    assert speed_ratio(train) == pytest.approx(float(Fraction(96 + 90, 66)), rel=1e-12)
    speeds, torques = train_speeds(train, 100.0), train_torques(train, 50.0)
    assert torques.output * speeds.of(train.output) == pytest.approx(-50.0 * 100.0, rel=1e-12)
    assert torques.sun.sum() == pytest.approx(0.0, abs=1e-10)
    # the housing holds carrier 2
    assert torques.carrier[1] + torques.output == pytest.approx(-50.0, rel=1e-12)


# --- matrices and modes -------------------------------------------------------------------------------


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_identical_uncoupled_stages_give_each_mode_twice(planets):
    data = lin_parker_set(planets)
    pair = (PlanetaryStage(data=data), PlanetaryStage(data=data))
    train = MultistageSet(stages=pair, couplings=(), input=Member(1, "sun"), output=Member(2, "carrier"))
    found, single = multistage_modes(train), gear_set_modes(data)
    expected = np.repeat(single.frequency, 2)
    assert found.modes.frequency == pytest.approx(expected, rel=1e-10, abs=1e-9)
    assert Counter(found.modes.kind) == {kind: 2 * n for kind, n in Counter(single.kind).items()}
    # every mode belongs to one stage alone, half of them to each
    assert np.sort(found.share, axis=0) == pytest.approx(np.tile([[0.0], [1.0]], len(expected)), abs=1e-9)
    assert Counter(found.stage.tolist()) == {1: len(single.kind), 2: len(single.kind)}
    assert np.sum(found.modes.frequency == 0.0) == 2


class Springs:
    """Stiffness and mass from single springs in one fixed frame.

    Coordinates x, y, theta of every body, planets in x and y too; joined coordinates share a number.
    """

    def __init__(self, joined):
        self.joined, self.numbers, self.springs, self.masses = joined, {}, [], []

    def place(self, body, axis):
        key = (body, axis)
        while key in self.joined:
            key = self.joined[key]
        return self.numbers.setdefault(key, len(self.numbers))

    def velocity(self, body, point=(0.0, 0.0)):
        """Terms (place, x, y) of the velocity of a point, given from the body's centre."""
        x, y, turn = (self.place(body, axis) for axis in "xyt")
        return [(x, 1.0, 0.0), (y, 0.0, 1.0), (turn, -point[1], point[0])]

    def mass(self, body, own):
        self.masses += [(self.place(body, axis), m) for axis, m in zip("xyt", (own.mass, own.mass, own.inertia))]

    def spring(self, k, direction, moving, other=()):
        terms = [(i, x * direction[0] + y * direction[1]) for i, x, y in moving]
        terms += [(i, -x * direction[0] - y * direction[1]) for i, x, y in other]
        self.springs.append((k, terms))

    def between(self, k, axis, first, second):
        self.springs.append((k, [(self.place(first, axis), 1.0), (self.place(second, axis), -1.0)]))

    def matrices(self):
        K, M = np.zeros((len(self.numbers),) * 2), np.zeros(len(self.numbers))
        for k, terms in self.springs:
            for i, one in terms:
                for j, two in terms:
                    K[i, j] += k * one * two
        for i, mass in self.masses:
            M[i] += mass
        return K, np.diag(M)


def assembled(train):
    """Stiffness and mass of a train, spring by spring."""
    joined = {}
    for one in train.couplings:
        axes = [(one.torsional, "t"), (one.lateral, "x"), (one.lateral, "y")]
        joined |= {(one.second, axis): (one.first, axis) for k, axis in axes if math.isinf(k)}
    made = Springs(joined)
    for number, one in enumerate(train.stages, 1):
        add_stage(made, one, {name: Member(number, name) for name in CENTRAL}, number)
    for one in train.couplings:
        for k, axis in ((one.torsional, "t"), (one.lateral, "x"), (one.lateral, "y")):
            if math.isfinite(k):
                made.between(k, axis, one.first, one.second)
    return made.matrices()


def add_stage(made, one, members, number):
    data, a = one.data, one.data.centre_distance
    alpha, beta = data.pressure_angle_sun_planet, data.pressure_angle_planet_ring
    for name, body in members.items():
        own = getattr(data, name)
        made.mass(body, own)
        for axis in np.eye(2):
            made.spring(own.support, axis, made.velocity(body))
        made.springs.append((own.torsional_support, [(made.place(body, "t"), 1.0)]))
    for n, psi in enumerate(data.planet_angles + one.angle):
        planet, out = (number, n), np.array([math.cos(psi), math.sin(psi)])
        along = np.array([-out[1], out[0]])
        made.mass(planet, data.planet)
        for axis in np.eye(2):
            made.spring(
                data.planet_bearing[n],
                axis,
                made.velocity(planet),
                made.velocity(members["carrier"], a * out),
            )
        # through the pitch points, along the normals of the flanks
        pitch = data.sun_radius / math.cos(alpha) * out
        normal = math.sin(alpha) * out + math.cos(alpha) * along
        ends = made.velocity(members["sun"], pitch), made.velocity(planet, pitch - a * out)
        made.spring(data.stiffness_sun_planet[n], normal, *ends)
        pitch = data.ring_radius / math.cos(beta) * out
        normal = math.sin(beta) * out - math.cos(beta) * along
        ends = made.velocity(planet, pitch - a * out), made.velocity(members["ring"], pitch)
        made.spring(data.stiffness_planet_ring[n], normal, *ends)


@pytest.mark.parametrize(
    ("torsional", "lateral"),
    [
        (3e5, 0.0),
        (3e5, 1e8),
        (math.inf, 1e8),
        (3e5, math.inf),
        (math.inf, math.inf),
        ([2e5, math.inf], [5e7, 0.0]),
    ],
)
def test_direct_assembly_of_springs_has_the_same_frequencies(torsional, lateral):
    stages = [
        stage((20, 20, 60), 3e-3, angles=(0.3, 1.9, 4.1), stiffness_sun_planet=[3e8, 5e8, 4e8]),
        stage((21, 33, 87), 4e-3, angle=0.7, fixed="carrier", planet_bearing=[1e8, 2e8, 3e8]),
        stage((24, 24, 72), 5e-3, angles=(0.0, 1.5, 3.2, 4.6), angle=-1.1),
    ]
    first, last = ((np.atleast_1d(torsional)[n], np.atleast_1d(lateral)[n]) for n in (0, -1))
    couplings = (
        StageCoupling(Member(1, "carrier"), Member(2, "sun"), *first),
        StageCoupling(Member(2, "ring"), Member(3, "sun"), *last),
    )
    ends = {"input": Member(1, "sun"), "output": Member(3, "carrier")}
    train = MultistageSet(stages=tuple(stages), couplings=couplings, **ends)
    reference = np.sqrt(np.maximum(eigh(*assembled(train), eigvals_only=True), 0.0)) / (2.0 * np.pi)
    found = multistage_modes(train)
    assert len(reference) == len(found.modes.frequency)
    assert found.modes.frequency[1:] == pytest.approx(reference[1:], rel=1e-9)
    assert found.modes.frequency[0] == 0.0 and reference[0] < 1e-3


def test_shares_of_the_energies_add_up_to_one():
    found = multistage_modes(replace_couplings(four_stage_train(), 1, torsional=math.inf))
    assert found.share.sum(axis=0) == pytest.approx(1.0)
    assert found.strain[:, 1:].sum(axis=0) == pytest.approx(1.0) and not found.strain[:, 0].any()
    # k delta^2 = omega^2 of mass-normalised modes: meshes first, then everything else
    squares = (2.0 * np.pi * found.modes.frequency[1:]) ** 2
    for columns, part in zip(mesh_columns(found.data), found.strain):
        k, deflection = found.modes.mesh_stiffness[columns], found.modes.mesh_deflection[columns, 1:]
        assert part[1:] == pytest.approx(k @ deflection**2 / squares, abs=1e-9)


def replace_couplings(train, number, **changes):
    couplings = list(train.couplings)
    couplings[number] = replace(couplings[number], **changes)
    return replace(train, couplings=tuple(couplings))


def test_example_train_has_the_structure_of_coupled_stages():
    train = four_stage_train()
    found = multistage_modes(train)
    assert Counter(found.modes.kind) == {"rigid": 1, "rotational": 23, "translational": 48, "planet": 6}
    planet = np.array(found.modes.kind) == "planet"
    assert found.share[:, planet].max(axis=0) == pytest.approx(1.0, abs=1e-9)
    assert sorted(found.stage[planet].tolist()) == [3, 3, 3, 4, 4, 4]
    # planet modes are those of the stage alone; lateral springs move translational modes only
    for number in (3, 4):
        alone = gear_set_modes(train.stages[number - 1].data)
        own = alone.frequency[np.array(alone.kind) == "planet"]
        assert found.modes.frequency[planet & (found.stage == number)] == pytest.approx(own, rel=1e-9)
    soft = multistage_modes(four_stage_train(lateral=False)).modes
    for kind, same in (("rotational", True), ("translational", False)):
        pair = [m.frequency[np.array(m.kind) == kind] for m in (found.modes, soft)]
        assert np.allclose(*pair, rtol=1e-9) == same
    # the angle between the stages does not matter at equal spacing
    turned = replace(train, stages=(train.stages[0], replace(train.stages[1], angle=0.9), *train.stages[2:]))
    assert multistage_modes(turned).modes.frequency == pytest.approx(found.modes.frequency, rel=1e-9, abs=1e-9)
    assert "planet, stage 4 (100 %)" in found.labels


def test_rigid_coupling_is_the_limit_of_a_stiff_one():
    rigid = multistage_modes(two_stages(torsional=math.inf, lateral=math.inf)).modes.frequency
    stiff = multistage_modes(two_stages(torsional=1e12, lateral=1e15)).modes.frequency
    assert len(rigid) == len(stiff) - 3
    assert stiff[: len(rigid)] == pytest.approx(rigid, rel=1e-4, abs=1e-3)
    train = two_stages(torsional=math.inf, lateral=math.inf)
    Z = joined_motions(train)
    one, other = (Z[rows] for rows in stage_slices(train))
    data = [s.data for s in train.stages]
    turn = np.array([[math.cos(0.4), -math.sin(0.4)], [math.sin(0.4), math.cos(0.4)]])
    assert one[2] / data[0].centre_distance == pytest.approx(other[8] / data[1].sun_radius)
    assert one[:2] == pytest.approx(turn @ other[6:8], abs=1e-15)
    assert "stage 2 sun: u" not in multistage_system(train).dofs


def test_turning_stages_are_planar_sets_at_their_own_speeds():
    train, speed = two_stages(lateral=0.0), 120.0
    system = multistage_system(train, speed=speed)
    carrier = train_speeds(train, speed).carrier
    for one, w, rows in zip(train.stages, carrier, stage_slices(train)):
        alone = gear_set_system(one.data, carrier_speed=float(w))
        assert speed * system.gyroscopic[rows, rows] == pytest.approx(w * alone.gyroscopic)
        assert system.load[rows] == pytest.approx(alone.load)
        # the coupling and the free rotation touch rotations and tangential motions only
        tangential = [2, 8, *range(10, len(alone.K), 3)]
        away = ~np.isin(np.arange(len(alone.K)), tangential)
        assert system.K[rows, rows][np.ix_(away, away)] == pytest.approx(alone.K[np.ix_(away, away)])
        assert np.abs(system.K[rows, rows] - alone.K).max() > 1.0
    # the train as a whole turns freely at any speed
    k = mean_mesh_stiffness(train)
    whole = system.K + (system.W * k) @ system.W.T
    rigid = multistage_modes(train).modes.shape[:, 0]
    assert np.abs(whole @ rigid).max() < 1e-9 * np.abs(np.abs(whole) @ np.abs(rigid)).max()


# --- refusals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: PlanetaryStage(data=closed_set((20, 20, 60)), fixed="planet"), "E-MECHANISM"),
        (lambda: PlanetaryStage(data=closed_set((20, 20, 60)), fixed="sun"), "E-MECHANISM"),
        (lambda: PlanetaryStage(data=closed_set((20, 20, 60)), teeth=(20, 20, 62)), "E-TEETH"),
        (lambda: PlanetaryStage(data=closed_set((20, 20, 60)), teeth=(20, 20.5, 61)), "E-TEETH"),
        (lambda: StageCoupling(Member(1, "sun"), Member(1, "ring")), "E-RANGE"),
        (lambda: replace(two_stages(), output=Member(2, "ring")), "E-MECHANISM"),
        (lambda: train_speeds(replace(two_stages(), couplings=()), 1.0), "E-MECHANISM"),
        (lambda: train_speeds(in_series([PlanetaryStage(data=lin_parker_set())] * 2), 1.0), "E-TEETH"),
        (lambda: multistage_system(two_stages(lateral=math.inf), speed=10.0), "E-RANGE"),
        (lambda: multistage_problem(two_stages(), damping=np.eye(3)), "E-SHAPE"),
    ],
)
def test_refusals(make, code):
    with pytest.raises(CaseError) as caught:
        make()
    assert caught.value.code == code


def test_a_locked_loop_has_neither_ratio_nor_modes():
    train = two_stages()
    loop = StageCoupling(Member(2, "carrier"), Member(1, "sun"), 1e6)
    locked = replace(train, couplings=(*train.couplings, loop))
    for solve in (speed_ratio, multistage_modes):
        with pytest.raises(CaseError, match="E-MECHANISM"):
            solve(locked)


@pytest.mark.parametrize(("planets", "held"), [(3, False), (3, True), (4, False)])
def test_published_train_is_the_chain_of_its_torques_and_inertias(planets, held):
    """Rotations of sun 1, the three joints, the last carrier and all planets, written out by hand."""
    unit, cosine, table = 1.0, np.cos(np.deg2rad(20.0)), published_table()
    shafts, count = 5, 5 + 4 * planets
    M, K = np.zeros((count, count)), np.zeros((count, count))
    for n in range(4):
        row = table[n]
        sun, planet = 1e-3 * row["sun base radius"], 1e-3 * row["planet base radius"]
        M[n, n] += 1e-6 * row["sun inertia"]
        M[n + 1, n + 1] += 1e-6 * row["carrier inertia"] + planets * row["planet mass"] * (
            ((sun + planet) / cosine) ** 2
        )
        for p in range(planets):
            i = shafts + n * planets + p
            M[i, i] = 1e-6 * row["planet inertia"]
            for stiffness, arms in (
                ("external mesh stiffness", ((n, sun), (i, planet), (n + 1, -sun - planet))),
                ("internal mesh stiffness", ((i, -planet), (n + 1, -sun - planet))),
            ):
                column = np.zeros(count)
                for place, arm in arms:
                    column[place] += arm
                K += unit * row[stiffness] * np.outer(column, column)
    if held:
        M, K = np.delete(np.delete(M, 4, 0), 4, 1), np.delete(np.delete(K, 4, 0), 4, 1)
    expected = np.sqrt(np.abs(eigh(K, M, eigvals_only=True))) / (2 * np.pi)
    found = multistage_modes(published_train(planets=planets, stiffness_unit=unit, held=held)).modes.frequency
    assert len(found) == len(expected)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-3)
