"""Loaded states of other trains beside the same trains written as gearboxes: motions, mesh forces, bearing forces.

The other trains are linear under a torque that keeps all teeth in touch: ``(K + W k W^T) q = load`` with the
matrices of their own models, the rotation held whose speed the gearbox is given.
"""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from gearbox_equivalents import (
    elastic_set_tables,
    pair_of_rigid_gears_tables,
    set_tables,
)
from published.planetary_sets import kahraman_set, lin_parker_set
from small_gearbox import split_pair_tables

from femgear.run import solve
from femgear.stages.lumped_set import Gravity, gear_set_problem
from femgear.system.assembly import MOTIONS
from femgear.system.mesh_directions import free_motions, gear_set_system
from femgear.system.rigid_bodies import CENTRAL, ROTATIONS, PlanarTorque, RigidSet
from femgear.trains.elastic.model import gears_alone
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.pair.model import pair_model
from femgear.trains.reading import read_case, with_values
from validation.reference import drivetrain_train
from validation.reference.multistage_train import stored
from validation.rows import Row, at_most, counted, within

LARGEST = 1e-9
DOWN = {"direction": [0.0, -1.0, 0.0]}


@dataclass(frozen=True)
class LoadedState:
    """What a train does under a load.

    Parameters
    ----------
    motion : mapping of str to (6,) array
        Of every body [m, rad].
    mesh_force : (M,) array
        [N]
    bearing_force : mapping of str to (6,) array
        On every body by what holds it in the casing [N, N m].
    """

    motion: Mapping[str, np.ndarray]
    mesh_force: np.ndarray
    bearing_force: Mapping[str, np.ndarray]


def held_state(K: np.ndarray, load: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Solve ``K q = load`` (n,) with the combination ``held @ q`` of the coordinates at zero."""
    size = np.abs(K).max() / np.abs(held).max()
    whole = np.block([[K, size * held[:, None]], [size * held[None], np.zeros((1, 1))]])
    right = np.append(load, 0.0)
    q = np.linalg.solve(whole, right)
    # one step of refinement: stiff and soft springs stand side by side
    return (q + np.linalg.solve(whole, right - whole @ q))[:-1]


def body_motions(data: RigidSet, full: np.ndarray) -> dict[str, np.ndarray]:
    """Motions (6,) of the bodies of a set along and about x, y, z from its coordinates, arcs and all."""
    table, axes = full.reshape(data.n_planets + 3, -1), list(data.axes)
    motion = {}
    names = [*CENTRAL, *(f"planet {n + 1}" for n in range(data.n_planets))]
    for name, row, radius, psi in zip(names, table, data.radii, [0.0] * 3 + data.angles.tolist(), strict=True):
        values = np.zeros(6)
        values[axes] = row
        values[list(ROTATIONS)] /= radius
        c, s = math.cos(psi), math.sin(psi)
        for first in (0, 3):
            a, b = values[first : first + 2]
            values[first : first + 2] = c * a - s * b, s * a + c * b
        motion[name] = values
    return motion


def of_gearbox(state: Deflection) -> LoadedState:
    """Motions, mesh forces and bearing forces of a gearbox whose shafts are single bodies, of its names."""
    model = state.model
    motion = dict(zip(model.assembly.names, state.motion.reshape(-1, 6), strict=True))
    held: dict[str, np.ndarray] = {}
    for section, force in zip(model.case.bearing, state.bearing_force, strict=True):
        held[section.shaft] = held.get(section.shaft, 0.0) + force
    return LoadedState(motion, state.mesh_force, held)


def set_state(data: RigidSet, state: Deflection, weight: bool) -> LoadedState:
    """The same of a set of rigid bodies by its own matrices, under the torques of the gearbox."""
    flow = state.model.flow.port_torque
    drive = PlanarTorque(flow["set sun"])
    system = gear_set_system(data, torque=drive)
    if weight:
        system = gear_set_problem(data, torque=drive, gravity=Gravity(orders=None), damping=None).system
    T, axes = free_motions(data), len(data.axes)
    full = np.zeros(len(T))
    for name, radius in zip(CENTRAL, data.radii, strict=False):
        full[axes * CENTRAL.index(name) + axes - 1] = flow.get(f"set {name}", 0.0) / radius
    load = system.load - gear_set_system(data, torque=drive).load + T.T @ full
    k = data.column_stiffness
    held = T[axes * CENTRAL.index("sun") + axes - 1]
    q = held_state(system.K + (system.W * k) @ system.W.T, load, held)
    bodies = body_motions(data, T @ q)
    names = {name: f"set {name}" for name in CENTRAL} | {
        f"planet {n + 1}": f"set planet {n + 1}" for n in range(data.n_planets)
    }
    springs = {f"set {name}": -_support(data, name) * bodies[name] for name in CENTRAL}
    return LoadedState({names[name]: value for name, value in bodies.items()}, k * (system.W.T @ q), springs)


def _support(data: RigidSet, name: str) -> np.ndarray:
    """Stiffnesses (6,) of the bearings of a member, without that against its rotation."""
    given = np.zeros(6)
    given[list(data.axes)] = data.support_stiffness[CENTRAL.index(name)]
    given[5] = 0.0
    return given


def standing(tables: dict[str, Any]) -> dict[str, Any]:
    """Let members with a torsional support stand: on a spring of that stiffness in the casing, or held."""
    new = copy.deepcopy(tables)
    operation = new["operation"]
    for bearing in new["bearing"]:
        stiffness = bearing.pop("torsional", None)
        if stiffness == "rigid":
            operation.setdefault("fixed", []).append(bearing["shaft"])
        elif stiffness is not None:
            new.setdefault("coupling", []).append({"between": [bearing["shaft"], "casing"], "torsion": stiffness})
        if stiffness is not None:
            operation["output"] = [name for name in operation["output"] if name != bearing["shaft"]]
            for case in operation["load_case"]:
                case["speed"].pop(bearing["shaft"], None)
    new["bearing"] = [bearing for bearing in new["bearing"] if len(bearing) > 1]
    return new


def differences(ours: LoadedState, other: LoadedState) -> dict[str, float]:
    """Largest differences over the largest values: displacements, rotations, forces of meshes, of bearings."""
    bodies = list(other.motion)
    a, b = (np.array([state.motion[name] for name in bodies]) for state in (ours, other))

    def apart(computed, two):
        return float(np.abs(computed - two).max(initial=0.0) / max(np.abs(two).max(initial=0.0), 1e-300))

    result = {
        "displacements of all bodies": apart(a[:, :3], b[:, :3]),
        "rotations and tilts of all bodies": apart(a[:, 3:], b[:, 3:]),
        "mesh forces": apart(ours.mesh_force, other.mesh_force),
    }
    largest = np.abs(other.mesh_force).max()
    names = [name for name in other.bearing_force if name in ours.bearing_force]
    if names:
        forces = [np.abs(ours.bearing_force[n][:3] - other.bearing_force[n][:3]).max() for n in names]
        result["bearing forces, over the largest mesh force"] = float(max(forces) / largest)
    return result


def compared(name: str, source: str, ours: LoadedState, other: LoadedState) -> list[Row]:
    """Rows of all differences, beside the number of bearings."""
    common = len(set(other.bearing_force) & set(ours.bearing_force))
    rows = []
    if other.bearing_force:
        rows.append(counted(name, source, "bearings whose forces are compared", len(other.bearing_force), common))
    text = "loaded state, largest difference of the "
    return rows + [
        at_most(name, source, text + what, LARGEST, value) for what, value in differences(ours, other).items()
    ]


def stages_state(name: str, state: Deflection) -> LoadedState:
    """The same of stages in series in the plane, by the train that had them before, at the same output torque.

    Of sets without teeth that train had the output torque by base radii, the gearbox has it by the nearest teeth.
    """
    former, motion, springs = stored()["statics"][name], {}, {}
    force, last = np.array(former["mesh_force"]), state.model.stages[-1]
    sun, _, ring = last.sizes.base_radii
    torque = -0.5 * force[list(last.meshes)].sum() * (sun + ring)
    scale = state.model.flow.port_torque[last.section.carrier] / torque
    for body, (x, y, turn) in former["motion"].items():
        motion[body] = scale * np.array([x, y, 0.0, 0.0, 0.0, turn])
    for bearing in state.model.case.bearing:
        if 0.0 < bearing.stiffness[0] < math.inf:
            springs[bearing.shaft] = -np.array(bearing.stiffness) * motion[bearing.shaft]
    return LoadedState(motion, scale * force, springs)


def chain_state() -> LoadedState:
    """The same of the wind turbine drivetrain under its weight, as the former train had it."""
    stored = drivetrain_train.numbers()["loaded"]
    motion, held = (
        {name: np.array(values) for name, values in stored[key].items()} for key in ("motion", "bearing_force")
    )
    return LoadedState(motion, np.array(stored["mesh_force"]), held)


def rigid_sets(weight: bool = True) -> tuple[tuple[str, str, LoadedState, LoadedState], ...]:
    """Loaded states of the sets of Kahraman and of Lin and Parker, each as a gearbox and by its own model."""
    helical, planar = kahraman_set(contact_points="pitch_point"), lin_parker_set()
    radii = np.array([planar.sun_radius, planar.planet_radius, planar.ring_radius])
    teeth = np.rint(1000 * radii / radii[0]).astype(int).tolist()
    states = []
    for name, source, data, numbers in (
        ("helical set of Kahraman", "femgear, helical", helical, (30, 20, 70)),
        ("spur set of Lin and Parker", "femgear, planar", planar, teeth),
    ):
        tables = standing(set_tables(data, numbers)) | ({"gravity": DOWN} if weight else {})
        state = solve_deflection(read_case(tables))
        states.append((name, source, of_gearbox(state), set_state(data, state, weight)))
    return tuple(states)


def chains() -> tuple[tuple[str, str, LoadedState, LoadedState], ...]:
    """Loaded states of stages in series and of the drivetrain of 36 coordinates."""
    states = []
    torque = {"operation.load_case[0].torque": {"stage 1 sun": "350 N m"}}
    for name in ("published_four_stages", "four_stage_reducer"):
        state = solve_deflection(with_values(read_case(f"cases/{name}.toml"), torque))
        states.append((name, "femgear, multistage", of_gearbox(state), stages_state(name, state)))
    torques = {"operation.load_case[0].torque": {"rotor": "15 kN m"}, "gravity": DOWN}
    state = solve_deflection(with_values(read_case("cases/wind_turbine_drivetrain.toml"), torques))
    states.append(("36 coordinates", "femgear, drivetrain", of_gearbox(state), chain_state()))
    return tuple(states)


@dataclass(frozen=True)
class ToothState:
    """A train with elastic tooth contact as a gearbox and by its own stages.

    Parameters
    ----------
    ours, other : LoadedState
        Motions with the mean transmission error of the contact, bearings and couplings of the train itself.
    apart : mapping of str to float
        Largest difference of the contact over one mesh period over the largest value, by what it is.
    """

    ours: LoadedState
    other: LoadedState
    apart: Mapping[str, float]


def _with_teeth(system, cycle, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motions (n,) and mesh forces (M,) of a train whose teeth give way by the means of their contact."""
    k, force = cycle.stiffness.mean(axis=1), cycle.force.mean(axis=1)
    gap = cycle.deflection.mean(axis=1) - force / k
    q = held_state(system.K + (system.W * k) @ system.W.T, system.load + system.W @ (k * gap), held)
    return q, k * (system.W.T @ q - gap)


def _contact_apart(ours, other) -> dict[str, float]:
    words = {"force": "mesh forces", "deflection": "transmission errors", "stiffness": "mesh stiffnesses"}
    return {
        text: float(np.abs(getattr(ours, name) - getattr(other, name)).max() / np.abs(getattr(other, name)).max())
        for name, text in words.items()
    }


def pair_with_teeth() -> ToothState:
    """The pair of cases/spur_pair.toml on a bearing of 1e8 N/m, in the plane."""
    case = with_values(read_case("cases/spur_pair.toml"), {"gear_1.bearing_stiffness": "1e8 N/m"})
    tables = pair_of_rigid_gears_tables(case, 1.0)
    stage = tables["pair"][0]
    del stage["gears"], stage["mesh"], tables["mass"]
    stage["teeth"] = tomllib.loads(case.source)
    state = solve_deflection(read_case(tables))
    static = solve(case, only="static")["static"]
    model = pair_model(case, static.planetary_set)
    system = model.system
    held = np.array([float(name == "gear 1: rotation") for name in system.dofs])
    q, force = _with_teeth(system, static.cycle, held)
    motion = {name: np.zeros(6) for name in ("one", "two")}
    for name, value in zip(system.dofs, q, strict=True):
        gear, axis = name.split(": ")
        motion["one" if gear == "gear 1" else "two"][MOTIONS.index(axis)] = value
    supported = np.where(np.isinf(model.bearing_stiffness), 0.0, model.bearing_stiffness) * (model.supported @ q)
    reaction = np.where(np.isinf(model.bearing_stiffness), np.concatenate([-model.normal, model.normal]) * force, 0.0)
    springs = {
        name: np.append(-part, np.zeros(4))
        for name, part in zip(motion, np.split(supported + reaction, 2), strict=True)
    }
    other = LoadedState(motion, force, springs)
    return ToothState(of_gearbox(state), other, _contact_apart(state.contacts["pair"].result.cycle, static.cycle))


def reference_set() -> ToothState:
    """The reference set with motor and brake, its teeth on the ring's foundation, in the plane."""
    path = "cases/planetary_27_40_108.toml"
    case = read_case(path)
    tables = elastic_set_tables(path) | {"deflection": {"contact": True}}
    state = solve_deflection(read_case(tables))
    results = solve(case, only="modes")
    static, system = results["static"], gears_alone(results["modes"].model, None)
    held = np.array([float(name == "sun: rotation") for name in system.dofs])
    q, force = _with_teeth(system, static.cycle, held)
    motion: dict[str, np.ndarray] = {}
    for name, value in zip(system.dofs, q, strict=True):
        body, axis = name.split(": ")
        body = f"set {body}" if body.startswith("planet") else body
        motion.setdefault(body, np.zeros(6))[MOTIONS.index(axis)] = value
    springs = {
        name: -np.append(getattr(case, name).support_stiffness * motion[name][:2], np.zeros(4))
        for name in ("sun", "carrier")
    }
    other = LoadedState(motion, force, springs)
    return ToothState(of_gearbox(state), other, _contact_apart(state.contacts["set"].result.cycle, static.cycle))


def loaded_states() -> tuple[Row, ...]:
    """Sets, stages in series, a drivetrain, a pair and the reference set under load, each as a gearbox."""
    rows = [row for state in (*rigid_sets(), *chains()) for row in compared(*state)]
    for name, source, state in (
        ("spur pair", "femgear, pair", pair_with_teeth()),
        ("reference set on its foundation", "femgear, elastic", reference_set()),
    ):
        text = "contact over a mesh period, largest difference of the "
        rows += [at_most(name, source, text + what, LARGEST, value) for what, value in state.apart.items()]
        rows += compared(name, source, state.ours, state.other)
    return tuple(rows)


def stages_side_by_side() -> tuple[Row, ...]:
    """Two pairs between the same two shafts: torque goes with the springs of both ways, in closed form."""
    modulus, radius, ratio = 206e9 / 2.6, 0.036 * math.cos(math.radians(20.0)), 36.0 / 24.0
    rows = []
    for second, gap in ((1e8, 0.0), (4e8, 0.03), (1e8, 0.03)):
        tables = split_pair_tables(f"{second} N/m", position=f"{0.03 + gap} m") | {"motions": "rotation"}
        state = solve_deflection(read_case(tables))
        # torque enters before the pairs and leaves behind them: each way has the shaft of the other's gap
        of_input, of_output = (gap * 32.0 / (math.pi * modulus * diameter**4) for diameter in (0.03, 0.04))
        first = 1.0 / (4e8 * radius**2) + ratio**2 * of_output
        other = 1.0 / (second * radius**2) + of_input
        case = f"two pairs, {1e-6 * second:g} and 400 N/um, {1e3 * gap:g} mm apart"
        share = state.mesh_force[1] / state.mesh_force.sum()
        rows.append(within(case, "closed form", "share of the second pair", first / (first + other), share, 1e-6))
        balance = state.mesh_force.sum() * radius / 100.0 - 1.0
        rows.append(at_most(case, "equilibrium", "torques of both less the input, relative", LARGEST, balance))
    return tuple(rows)
