"""What must hold for any valid gearbox: balance, power, and the same answer however it is put down.

``pytest tests/trains/gearbox/test_random_gearboxes.py -m "" -k seed117`` repeats one gearbox, that of
``random_gearbox(117)``.
"""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from random_gearboxes import IMAGES, MODES, largest_load, loosened, random_gearbox, unlike

from femgear.solvers.linear.modal import undamped_modes
from femgear.system.assembly import GROUND
from femgear.trains.gearbox.case_file import CASING
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.model import bearing_places
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.play import slack_bearings, unheld_motions
from femgear.trains.gearbox.power import port_shafts
from femgear.trains.reading import read_case

QUICK, ALL = 20, 1000
# of the first ones
OTHERS = (1, 5, 6, 7, 8, 10, 12, 14, 16, 17, 19)
BALANCED, ALIKE = 1e-8, 1e-7


def seeds(count: int) -> list:
    slow = [[], [pytest.mark.slow]]
    return [pytest.param(seed, id=f"seed{seed}", marks=slow[seed in OTHERS]) for seed in range(count)]


def solved(tables) -> Deflection:
    return solve_deflection(read_case(tables))


def moments(points: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Moments about the origin of forces at points."""
    return np.cross(points, forces)


def outside(found: Deflection) -> np.ndarray:
    """Wrenches (w, 6) about the origin of all that acts from outside.

    Loads and weight, and the feet of a casing, or a casing that stands still and the shafts that it holds.
    """
    model, assembly = found.model, found.model.assembly
    load = model.load.reshape(-1, 6)
    places = np.asarray(assembly.places)
    wrenches = [np.hstack([load[:, :3], load[:, 3:] + moments(places, load[:, :3])])]
    force, at = found.bearing_force, bearing_places(model)
    casing = model.case.casing
    standing = {*model.bearing_names} if casing is None else {*casing.stands_still}
    mine = [
        bearing.outer_shaft is None and name in standing
        for bearing, name in zip(model.case.bearing, model.bearing_names, strict=True)
    ]
    if model.casing is not None:
        wrenches.append(np.hstack([found.foot_force, moments(model.casing.foot_places, found.foot_force)]))
    wrenches.append(np.hstack([force[:, :3], force[:, 3:] + moments(at, force[:, :3])])[mine])
    for contact, part in zip(assembly.contacts, assembly.slices, strict=True):
        if GROUND in contact.stations:
            side = contact.stations.index(GROUND)
            back = (1.0 if side else -1.0) * -found.slice_force[part][:, None] * contact.normals[side]
            wrenches.append(np.hstack([back, moments(contact.points[side], back)]))
    shafts = port_shafts(model.case)
    for name in model.case.operation.fixed if casing is None else ():
        own = sum(torques.get(name, 0.0) for torques in model.flow.stage_torque.values())
        own += sum(torque for port, torque in model.flow.port_torque.items() if shafts[port] == name)
        wrenches.append(np.array([[0.0, 0.0, 0.0, 0.0, 0.0, -own]]))
    return np.vstack(wrenches)


def check_balance(found: Deflection) -> None:
    wrenches = outside(found)
    total, size = wrenches.sum(axis=0), largest_load(found)
    assert np.abs(total[:3]).max() <= BALANCED * size
    # levers of a metre at most
    assert np.abs(total[3:]).max() <= BALANCED * size


def check_power(found: Deflection) -> None:
    flow, shafts = found.model.flow, port_shafts(found.model.case)
    power = np.array([torque * flow.speed[shafts[port]] for port, torque in flow.port_torque.items()])
    assert abs(power.sum()) <= BALANCED * np.abs(power).max()
    for torques in flow.stage_torque.values():
        own = np.array([torque * flow.speed[shaft or CASING] for shaft, torque in torques.items()])
        assert abs(own.sum()) <= BALANCED * np.abs(power).max()


def check_meshes(found: Deflection) -> None:
    force = found.mesh_force
    for stage in found.model.stages:
        torque = abs(found.model.flow.first_torque(stage.section))
        lever = math.cos(stage.sizes.base_helix) * np.array(stage.sizes.base_radii)
        if not stage.planets:
            assert force[list(stage.meshes)] == pytest.approx([torque / lever[0]], rel=BALANCED)
            continue
        sun, ring = np.split(force[list(stage.meshes)], 2)
        assert sun.sum() * lever[0] == pytest.approx(torque, rel=BALANCED)
        assert ring.sum() * lever[2] == pytest.approx(
            torque * stage.sizes.teeth[2] / stage.sizes.teeth[0], rel=BALANCED
        )


def check_image(tables, found: Deflection, name: str, seed: int) -> None:
    for what, apart in unlike(tables, found, name, seed).items():
        assert apart <= ALIKE, f"{name}: {what}"


def check_gearbox(seed: int, stages: int) -> None:
    tables = random_gearbox(seed, stages)
    found = solved(tables)
    check_balance(found)
    check_power(found)
    check_meshes(found)
    check_image(tables, found, IMAGES[seed % len(IMAGES)], seed)


@pytest.mark.parametrize("seed", seeds(QUICK))
def test_a_random_gearbox_balances_and_is_the_same_however_it_is_put_down(seed):
    check_gearbox(seed, stages=2)


@pytest.mark.parametrize("seed", seeds(QUICK))
def test_bearings_that_are_named_are_those_of_the_rigid_modes(seed):
    """Modes at 0 Hz beyond the rotations that are given are told, and nothing else is."""
    tables = loosened(random_gearbox(seed, 2), np.random.default_rng(seed))
    found = solved(tables)
    check_balance(found)
    check_meshes(found)
    _, system, stiffness = linear_system(found)
    still = replace(system, gyroscopic=None, load=np.zeros(len(system.dofs)))
    modes = undamped_modes(still, stiffness, damping_ratio=0.03, count=min(MODES, len(system.dofs)))
    rigid = sum(kind == "rigid" for kind in modes.kind)
    assert rigid == len(found.model.turns) + unheld_motions(found).shape[1]
    assert slack_bearings(found).any() == (rigid > len(found.model.turns))


@pytest.mark.parametrize("seed", [pytest.param(55, marks=pytest.mark.slow), 380])
def test_a_mesh_that_carries_nothing_has_the_same_modes_however_the_gearbox_is_turned(seed):
    check_gearbox(seed, stages=4)


def test_pins_in_one_cheek_of_a_carrier_amid_its_shaft_have_a_mirror_image():
    check_gearbox(48, stages=4)


@pytest.mark.slow
@pytest.mark.parametrize("seed", seeds(ALL))
def test_a_thousand_gearboxes_of_up_to_four_stages(seed):
    check_gearbox(seed, stages=4)


@pytest.mark.parametrize("member", ["sun", "carrier", "ring"])
def test_any_member_of_a_set_may_stand_in_the_casing(member):
    tables = next(t for t in map(one_set, range(100)) if t["planetary"][0][member].startswith("held"))
    alone, stage = copy.deepcopy(tables), tables["planetary"][0]
    alone["operation"]["fixed"] = []
    for kind, entry in (("shaft", "name"), ("bearing", "shaft")):
        alone[kind] = [one for one in alone[kind] if one[entry] != stage[member]]
    alone["planetary"][0][member] = "casing"
    del alone["planetary"][0][f"{member}_position"]
    on_shaft, in_casing = solved(tables), solved(alone)
    check_power(in_casing)
    check_meshes(in_casing)
    assert in_casing.mesh_force.sum() == pytest.approx(on_shaft.mesh_force.sum(), rel=BALANCED)


def one_set(seed: int):
    """Draw gearboxes until one has a single set with a shaft that is held."""
    while len((tables := random_gearbox(seed, 1))["planetary"]) != 1 or not tables["operation"]["fixed"]:
        seed += 100
    return tables


def unequal_set(seed: int):
    """A set whose planets stand unequally in a rigid casing, with its weight across the axis."""
    tables = random_gearbox(seed, 1)
    tables.pop("casing", None)
    tables["gravity"] = {"direction": [0.6, -0.8, 0.0]}
    return tables


def planet_weight_moment(found: Deflection) -> float:
    """Moment of the weight of all planets about the axis of their set [N m]."""
    (stage,) = found.model.stages
    gravity, mass = found.model.case.gravity, stage.section.planet.mass
    field = gravity.acceleration * np.asarray(gravity.direction) / np.linalg.norm(gravity.direction)
    arms = np.array([[math.cos(psi), math.sin(psi), 0.0] for psi in stage.angles]) * stage.sizes.centre_distance
    return float(moments(arms, np.tile(mass * field, (len(arms), 1))).sum(axis=0)[2])


@pytest.mark.parametrize("seed", [26, 53, 60])
def test_what_is_held_takes_the_weight_of_unequal_planets(seed):
    """A held carrier takes their moment alone; a turning one shares it between the held and the driven shaft."""
    found = solved(unequal_set(seed))
    assert found.model.case.operation.fixed
    total, moment = outside(found).sum(axis=0), planet_weight_moment(found)
    assert abs(moment) > 1e-3
    assert total[:5] == pytest.approx(0.0, abs=BALANCED * largest_load(found))
    # the torques of the power flow know no weight
    assert total[5] == pytest.approx(moment, rel=1e-5)


@pytest.mark.parametrize("seed", [2, 8, 22, 49])
def test_a_driven_shaft_takes_its_share_of_the_weight_of_unequal_planets(seed):
    """With the ring in the casing the driven shaft has the moment times the ratio of the carrier's speed to its own."""
    found = solved(unequal_set(seed))
    (stage,), flow = found.model.stages, found.model.flow
    assert stage.section.ring == CASING
    ratio = flow.speed[stage.section.carrier] / flow.speed[flow.independent[0]]
    share = ratio * planet_weight_moment(found)
    assert outside(found).sum(axis=0)[5] == pytest.approx(share, rel=1e-5)
