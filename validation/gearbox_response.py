"""Response of gearboxes: equal planets, and stages against the solution for gear sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from casings import casing_tables
from gearbox_equivalents import pair_of_rigid_gears_tables
from running_twin import TURN, running, twin
from small_gearbox import planetary_tables

from femgear.case.gear_set import planetary_set
from femgear.housing.two_way.running_planets import RunningStage, solve_running
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.static import solve_static
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.model import StageModel
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.pair.model import pair_excitation, pair_model
from femgear.trains.reading import read_case, with_values
from validation.rows import Row, at_most

GEAR_SETS = "solution for gear sets, femgear.solvers.periodic.spectral"
POSITIONS = 64
"""Positions of an excitation in the mesh period."""


def equal_planets() -> tuple[Row, ...]:
    """Equal planets leave multiples of their number, though every one of them is solved and supports are uneven."""
    rows = list[Row]()
    for count in (3, 4, 5):
        response = solve_running(
            running(twin(count, 13), symmetry=1), 13 * TURN, TURN, harmonics=(2, 4), side_bands=6, tolerance=1e-13
        )
        order = np.rint(response.frequency / TURN).astype(int)
        beside = np.abs(response.modal[order % count != 0]).max() / np.abs(response.modal).max()
        text = f"lines at orders that are no multiples of {count}, over the largest"
        rows.append(at_most(f"{count} equal planets, uneven casing", "symmetry", text, 1e-10, beside))
    return tuple(rows)


def pair_on_bearings() -> tuple[Row, ...]:
    """Two rigid gears on bearings, k(t) from their teeth, without damping: a gearbox and a train of its own."""
    springs = {"gear_1.bearing_stiffness": "1e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}
    case = with_values(read_case("cases/spur_pair.toml"), springs)
    excitation = pair_excitation(case, solve_static(case), None)
    mean = excitation.stiffness.mean(axis=1)
    modes = undamped_modes(pair_model(case, planetary_set(case)).system, mean, damping_ratio=0.0)
    state = solve_deflection(read_case(pair_of_rigid_gears_tables(case, float(mean[0]))))
    stage = without_loss(running_stage(state, state.model.stages[0], excitation).running)
    rows = list[Row]()
    for hertz in (300.0, 900.0, 2500.0):
        options = {"excitation_harmonics": 6, "response_harmonics": 12, "method": "direct"}
        wanted = solve_spectral(modes, excitation, hertz, **options).force[0, 0, 1:]
        response = solve_running(stage, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 12), side_bands=0, tolerance=1e-13)
        apart = np.abs(2.0 * response.force[0, 0, 1:, 0] - wanted).max() / np.abs(wanted).max()
        text = f"harmonics of the mesh force at {hertz:g} Hz, largest difference over the largest"
        rows.append(at_most("spur pair on bearings", GEAR_SETS, text, 1e-9, apart))
    return tuple(rows)


def without_loss(stage: RunningStage) -> RunningStage:
    """Stage without damping and without the gyroscopic terms of its planets."""
    ring = None if stage.ring is None else replace(stage.ring, loss=0.0)
    return replace(stage, loss=0.0 * stage.loss, structure_loss=0.0, gyroscopic=0.0 * stage.gyroscopic, ring=ring)


def synthetic_excitation(state: Deflection, stage: StageModel) -> MeshExcitation:
    """Excitation of equal planets whose stiffness, deflection and force fluctuate, in phase with their places."""
    count = len(stage.angles)
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    signals = np.zeros((3, 2 * count, POSITIONS))
    for number, mesh in enumerate(stage.meshes):
        with_ring = number // count
        at = theta + stage.sizes.teeth[-1] * stage.angles[number % count]
        mean = state.model.assembly.contacts[mesh].stiffness.sum()
        signals[0, number] = mean * (1.0 + (0.15 + 0.05 * with_ring) * np.cos(at) + 0.05 * np.sin(2.0 * at))
        signals[1, number] = 1e-6 * (1.0 + with_ring) * np.cos(at + 0.4) + 2e-7 * np.cos(2.0 * at)
        signals[2, number] = 1000.0 * (1.0 + 0.1 * np.cos(at - 1.0))
    return MeshExcitation(*signals, np.zeros(2 * count))


def stage_in_casing(*, casing: bool = True) -> Deflection:
    """Planetary stage of rigid bodies, its ring in a casing on uneven feet or standing still."""
    tables = planetary_tables() | {"deflection": {"slices": 1}}
    return solve_deflection(read_case(tables | ({"casing": casing_tables()} if casing else {})))


def carrier_at_rest() -> tuple[Row, ...]:
    """A planetary stage whose carrier stands still, with k(t), and the modes of the gearbox with all its meshes."""
    rows = list[Row]()
    for name, casing in (("ring that stands still", False), ("casing on uneven feet", True)):
        state = stage_in_casing(casing=casing)
        stage = state.model.stages[0]
        structured = running_stage(state, stage, synthetic_excitation(state, stage))
        running_one, motion = structured.running, structured.motion
        running_one = without_loss(running_one)
        for hertz in (150.0, 400.0, 1100.0):
            apart = apart_from_gear_set(state, running_one, motion, hertz)
            text = f"motions of sun, carrier and casing, mesh frequency {hertz:g} Hz, over the largest of all"
            rows.append(at_most(f"planetary stage at rest, {name}", GEAR_SETS, text, 1e-9, apart))
    return tuple(rows)


def apart_from_gear_set(state: Deflection, stage: RunningStage, motion: np.ndarray, hertz: float) -> float:
    """Largest difference of the harmonics of all motions but those of planets, over the largest of all."""
    assembly, system, _ = linear_system(state)
    drive = stage.excitation
    mean = drive.stiffness.mean(axis=1)
    modes = undamped_modes(replace(system, gyroscopic=None), mean, damping_ratio=0.0)
    # about the mean state
    about = {name: getattr(drive, name) for name in ("deflection", "force")}
    about = {name: signal - signal.mean(axis=1, keepdims=True) for name, signal in about.items()}
    options = {"excitation_harmonics": 3, "response_harmonics": 8, "method": "direct"}
    wanted = assembly.motions @ modes.shape @ solve_spectral(modes, replace(drive, **about), hertz, **options).modal[0]
    response = solve_running(stage, 2.0 * np.pi * hertz, 0.0, harmonics=(3, 8), side_bands=6, tolerance=1e-13)
    deflection = 2.0 * motion @ response.modal.sum(axis=1).T
    planets = [6 * station + way for station in state.model.stages[0].planets for way in range(6)]
    others = np.setdiff1d(np.arange(assembly.count), planets)
    return float(np.abs(deflection - wanted)[others, 1:].max() / np.abs(wanted[:, 1:]).max())
