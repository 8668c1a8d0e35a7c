"""Planets of any kind in gearboxes: places by trial, Willis' equation by teeth, modes and forces by hand, phases."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
from planet_gearboxes import (
    SET_KINDS,
    STEPPED,
    free_speeds,
    held,
    in_casing,
    known_set,
    lines_apart,
    outer_lines,
    pair_conditions,
    parting_set,
    places_by_trial,
    planet_shaft,
    random_set,
    responded,
    simple_set,
    springs_by_hand,
    stepped_forces,
    stepped_set,
)
from scipy.linalg import eigh

from femgear.gears.planet_assembly import assembly_step
from femgear.gears.power_flow import power_flow
from femgear.trains.gearbox.balance import solve_balance
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case
from validation.rows import Row, at_most, counted

STAGE = "the same set as a planetary stage"
SPRINGS = "lines of action by hand"
DIRECTLY = "The linear statics of both, solved at once: the product stops at a residual of 1e-11."


def places() -> list[Row]:
    """Places of planets in random sets, by trial of all teeth."""
    rows = []
    for kind in SET_KINDS:
        draw, agreed = random.Random(f"rows {kind}"), 0
        for _ in range(100):
            gears = random_set(draw, kind)
            step, places = assembly_step(gears), places_by_trial(gears)
            every = np.arange(step.denominator) / step.denominator
            agreed += len(places) == len(every) and bool(np.abs(places - every).max() < 1e-9)
        text = "random sets whose places are found"
        rows.append(counted(f"{kind} sets", "planets rolled around, all teeth tried", text, 100, agreed))
    return rows


def kinematics() -> list[Row]:
    """Speeds of all members of random sets, as pairs on a carrier, by the teeth that pass in every mesh."""
    rows = []
    for kind in SET_KINDS:
        draw, agreed = random.Random(f"speeds {kind}"), 0
        for _ in range(40):
            gears = random_set(draw, kind)
            central = [gear for gear in gears.shafts if gear != "carrier"]
            start = {"carrier": Fraction(draw.randint(-9, 9)), central[0]: Fraction(draw.randint(-9, 9))}
            shafts, conditions = pair_conditions(gears)
            given = {shaft: float(speed) for shaft, speed in start.items()}
            flow = power_flow(shafts, conditions, speeds=given, torques={}, outputs=central[1:])
            by_teeth = free_speeds(gears, start)
            ratios = [flow.speed_ratio[shaft] for shaft in central]
            turned = [sum(share * start[shaft] for shaft, share in ratio_of_shaft.items()) for ratio_of_shaft in ratios]
            agreed += turned == [by_teeth[shaft] for shaft in central]
        text = "random sets whose speeds agree, in fractions"
        rows.append(counted(f"{kind} sets", "teeth that pass in every mesh (Willis)", text, 40, agreed))
    return rows


def forces_at_once(state: Deflection) -> np.ndarray:
    """Mesh forces (M,) of the linear gearbox, whose equations are solved at once and improved once."""
    assembly = state.model.assembly
    held = assembly.held.copy()
    held[state.model.turns] = True
    motions, columns = replace(assembly, held=held).motions, assembly.columns
    inner = assembly.stiffness + (columns * assembly.slice_stiffness) @ columns.T
    reduced, load = motions.T @ inner @ motions, motions.T @ state.model.load
    moved = np.linalg.solve(reduced, load)
    moved += np.linalg.solve(reduced, load - reduced @ moved)
    force = assembly.slice_stiffness * (columns.T @ motions @ moved)
    return np.array([force[part].sum() for part in assembly.slices])


def simple_planets() -> list[Row]:
    """Planets as shafts against the planets of a planetary stage."""
    rows = []
    for motions in ("space", "plane", "rotation"):
        as_shafts, as_stage = (solve_deflection(read_case(make(motions=motions))) for make in (simple_set, known_set))
        force = np.abs(as_shafts.mesh_force / as_stage.mesh_force - 1.0).max()
        rows.append(at_most(f"27/39/105, {motions}", STAGE, "mesh forces, largest relative difference", 1e-9, force))
        force = np.abs(forces_at_once(as_shafts) / forces_at_once(as_stage) - 1.0).max()
        text = "mesh forces of linear statics, largest relative difference"
        rows.append(at_most(f"27/39/105, {motions}", STAGE, text, 1e-12, force, note=DIRECTLY))
        ours, other = (solve_gearbox_modes(state).modes.frequency for state in (as_shafts, as_stage))
        away = np.abs(ours - other).max() / other.max()
        rows.append(at_most(f"27/39/105, {motions}", STAGE, "frequencies over the highest", 1e-9, away))
    for fixed, torque in (("carrier", 100.0), ("carrier", -80.0), ("ring", 100.0), ("ring", -80.0), ("sun", 90.0)):
        as_shafts, as_stage = (
            outer_lines(make, fixed=fixed, torque=torque, motions="space") for make in (simple_set, known_set)
        )
        text = "lines of sensors, bearings and feet in a casing on uneven feet, k(t) of 30 %, over the largest of each"
        rows.append(
            at_most(f"28/38/104, {fixed} stands, {torque:g} N m", STAGE, text, 1e-9, lines_apart(as_shafts, as_stage))
        )
    return rows


def parting_planets() -> list[Row]:
    """Teeth that part by harmonic balance, planets as shafts against those of a planetary stage."""
    rows = []
    for fixed, torque in (("ring", 4.0), ("ring", -4.0), ("carrier", 4.0)):
        ((shafts,), (stage,)) = (
            solve_balance(parting_set(make, fixed=fixed, torque=torque)) for make in (simple_set, known_set)
        )
        forces = np.abs(shafts.drive - stage.drive).max() / stage.drive.max()
        difference = np.abs(shafts.acceleration - stage.acceleration).max() / np.abs(stage.acceleration).max()
        case, apart = f"28/38/104, {fixed} stands, {torque:g} N m", f"The least force is {stage.drive.min():.3g} N."
        for text, away in (("forces of drive flanks", forces), ("lines of sensors", difference)):
            rows.append(at_most(case, STAGE, f"harmonic balance: {text}, over the largest", 1e-9, away, note=apart))
    return rows


def stepped_planets() -> list[Row]:
    """Stepped planets of unequal meshes against springs set up by hand."""
    stiffness = (4e8, 4.4e8, 3.6e8, 3e8, 3.1e8, 2.8e8)
    state = solve_deflection(read_case(stepped_set(stiffness=stiffness)))
    mass, k, rows = springs_by_hand(stiffness)
    load, motion = np.zeros(18), np.zeros(18)
    load[2], load[5] = 100.0, -100.0 * (1.0 + 57 * 108 / (24 * 27))
    kept = [i for i in range(18) if i not in (2, 8)]
    motion[kept] = np.linalg.solve(k[np.ix_(kept, kept)], load[kept])
    by_hand = np.array(stiffness) * (rows @ motion)
    force, linear = (np.abs(forces / by_hand - 1.0).max() for forces in (state.mesh_force, forces_at_once(state)))
    free = np.ix_(*[[i for i in range(18) if i != 8]] * 2)
    hertz = np.sqrt(np.maximum(eigh(k[free], mass[free], eigvals_only=True), 0.0)) / (2.0 * math.pi)
    away = np.abs(solve_gearbox_modes(state).modes.frequency - hertz).max() / hertz.max()
    case = "stepped 24/57/27/108, three planets"
    return [
        at_most(case, SPRINGS, "mesh forces, largest relative difference", 1e-9, force),
        at_most(
            case, SPRINGS, "mesh forces of linear statics, largest relative difference", 1e-12, linear, note=DIRECTLY
        ),
        at_most(case, SPRINGS, "frequencies over the highest", 1e-9, away),
    ]


def planet_errors() -> list[Row]:
    """Load sharing of stepped planets with errors of a pin and of the timing of two gears."""
    cosine, lever, rows = math.cos(math.radians(20.0)), STEPPED[1] / STEPPED[2], []
    pin, timing = 3e-6 * cosine * (1.0 + lever), 1e-4 * 1e-3 * STEPPED[2] * cosine * lever
    for words, key, error, opened in (
        ("pin 3 um ahead", "shaft", {"pin_error": {"tangential": "3 um"}}, pin),
        ("gear on the ring turned by 0.1 mrad", "pair", {"timing_error": "1e-4 rad"}, timing),
    ):
        for held_by, sun, gate in (("stiff members", "rigid", 1e-9), ("a floating sun", "1 N/m", 1e-6)):
            tables = held(stepped_set(), sun=sun)
            (planet_shaft(tables, 1) if key == "shaft" else tables["pair"][4]).update(error)
            force = solve_deflection(read_case(tables)).mesh_force[:3]
            expected = stepped_forces([0.0, opened if sun == "rigid" else 0.0, 0.0])
            away = np.abs(force / expected - 1.0).max()
            source = "compliances of a branch in series" if sun == "rigid" else "equal shares of three planets"
            text = f"mesh forces, {words}, largest relative difference"
            rows.append(at_most(f"stepped 24/57/27/108, {held_by}", source, text, gate, away))
    return rows


def symmetric_lines() -> list[Row]:
    """Lines of equal stepped planets, each solved for, at orders that a turn by a third rules out."""
    tables = stepped_set(teeth=(25, 56, 28, 109))
    for stage in tables["pair"]:
        stage["mesh"] |= {"contact_ratio": 1.63, "low_share": 0.8}
    planet_shaft(tables, 0)["pin_error"] = {}
    rows, around = [], {"sun-0..2": 56 * 109 // 28, "0..2-ring": 109}
    for stage in responded(in_casing(tables)).stages:
        off = (stage.harmonic * around[stage.name] + stage.side_band) % 3 != 0
        size = np.abs(stage.motion[0, :2])
        text = f"sensors on a casing on uneven feet, {stage.name}: lines off multiples of three, over the largest"
        source = "a turn by a third maps equal planets on one another"
        rows.append(at_most("stepped 25/56/28/109", source, text, 1e-10, size[:, off].max() / size.max()))
    return rows
