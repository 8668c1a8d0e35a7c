"""Running planets in time: the structure of a stage and its planets in axes at rest, over a turn of the carrier."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from casings import casing_tables
from running_twin import TURN, running, twin
from small_gearbox import planetary_tables

from femgear.housing.two_way.running_planets import RunningResponse, RunningStage, solve_running
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.stage_structure import running_stage, structure_without
from femgear.trains.reading import read_case
from validation.gearbox_response import synthetic_excitation
from validation.reference.running_in_time import TurningSystem, motion_over_a_turn, turning_twin
from validation.rows import Row, at_most

IN_TIME = "time integration, validation.reference.running_in_time"
SAMPLES = 1024
"""Angles of the carrier in a turn."""
ANGLE = 0.3
"""Of the first planet of the helical stage [rad]."""
BY_MASS, BY_STIFFNESS = 40.0, 2e-6
"""Damping of its structure over mass [1/s] and stiffness [s]."""
PIN_DAMPING = (200.0, 200.0, 100.0, 0.05, 0.05)
"""Of its pins across, along the axis [N s/m] and against tilting [N m s]."""
TWINS = {
    "three planets in sequence": ((3, 13, 1), {}),
    "three planets in sequence, backwards": ((3, 13, -1), {}),
    "five planets": ((5, 12, 1), {}),
    "three unequal planets": ((3, 13, 1), {"uneven": [1.0, 1.1, 0.9]}),
}
"""Planets, teeth of the ring and sense of the carrier, and what is out of the ordinary."""


def orders_of(response: RunningResponse, shape: np.ndarray, count: int) -> np.ndarray:
    """Amplitudes (k, count) at orders 0, 1, 2, ... of the carrier of places that the modes (m, k) move.

    The mesh frequency is a multiple of the speed of the carrier; lines of one order add.
    """
    coefficients = np.zeros((shape.shape[1], count), complex)
    order = np.rint(response.frequency / response.carrier_speed).astype(int)
    amplitude = response.lines(shape)
    for (line, band), number in np.ndenumerate(order):
        if abs(number) < count:
            value = amplitude[line, band]
            coefficients[:, abs(number)] += value if number >= 0 else value.conj()
    return coefficients


def apart_in_time(turning: TurningSystem, stage: RunningStage, shape: np.ndarray) -> float:
    """Largest difference of the lines of the structure from time integration, over the largest line.

    The structure has the first coordinates of all, which the modes (m, k) of the stage move.
    """
    motion = motion_over_a_turn(turning, SAMPLES)[: shape.shape[1]]
    wanted = 2.0 * np.fft.rfft(motion, axis=1)[:, : SAMPLES // 2] / SAMPLES
    options = {"harmonics": (turning.harmonics, 14), "side_bands": 6, "tolerance": 1e-13}
    response = solve_running(stage, turning.teeth * turning.speed, turning.speed, **options)
    lines = orders_of(response, shape, SAMPLES // 2)
    return float(np.abs(lines - wanted)[:, 1:].max() / np.abs(wanted[:, 1:]).max())


def in_time() -> tuple[Row, ...]:
    """Planets on uneven supports, as side bands of mesh harmonics and in axes at rest over one turn."""
    rows = list[Row]()
    for name, (sizes, options) in TWINS.items():
        system = twin(*sizes, **options)
        stage = running(system, symmetry=1 if options else sizes[0])
        apart = apart_in_time(turning_twin(system, TURN, 2), stage, system.modes()[1].T)
        text = "lines of sun, carrier, ring and casing, largest difference over the largest line"
        rows.append(at_most(name, IN_TIME, text, 1e-6, apart))
    return tuple(rows)


def helical_stage(angle: float, *, back: bool) -> Deflection:
    """Helical stage whose bodies move in all six motions, in a casing on uneven feet, at an angle of its carrier [rad].

    Bearings hold rotations too, so that nothing drifts in time.
    """
    tables: dict[str, Any] = planetary_tables() | {"deflection": {"slices": 1}, "casing": casing_tables()}
    teeth = {"teeth": [11, 13, 37], "module": "2 mm", "centre_distance": "24 mm", "face_width": "20 mm"}
    tables["planetary"][0] |= {"gears": teeth | {"helix_angle": "15 deg"}, "angle": f"{angle!r} rad"}
    bearing = {"radial": "2e8 N/m", "axial": "5e7 N/m", "tilt": "3e4 N m/rad"}
    tables["planetary"][0]["planet"] |= {"transverse_inertia": "7e-5 kg m^2", "bearing": bearing}
    for mass, transverse in zip(tables["mass"], ("2e-3 kg m^2", "3e-2 kg m^2"), strict=True):
        mass["transverse_inertia"] = transverse
    for bearing in tables["bearing"]:
        bearing["torsional"] = "2e5 N m/rad"
    tables["operation"]["load_case"][0]["speed"] = {"sun": "-12000 rpm" if back else "12000 rpm"}
    return solve_deflection(read_case(tables))


def turning_stage(*, back: bool) -> tuple[TurningSystem, RunningStage, np.ndarray]:
    """Helical stage in axes at rest, as the response takes it, and the modes (m, 18) of sun, carrier and casing."""
    state = helical_stage(ANGLE, back=back)
    box, assembly = state.model.stages[0], state.model.assembly
    structured = running_stage(state, box, synthetic_excitation(state, box))
    single, motion = structured.running, structured.motion
    frequency = single.natural_frequency
    ratio = 0.5 * (BY_MASS / frequency + BY_STIFFNESS * frequency)
    viscous = np.append(np.zeros(single.kinds), PIN_DAMPING)
    undamped = {"loss": 0.0 * single.loss, "structure_loss": 0.0}
    single = replace(single, damping_ratio=ratio, viscous=viscous, **undamped)
    _, structure, _ = structure_without(state, box)
    size, count = len(structure.M), len(box.planets)
    damping, stiffness = np.zeros((2, assembly.count, assembly.count))
    stiffness[:size, :size] = structure.K
    damping[:size, :size] = BY_MASS * structure.M + BY_STIFFNESS * structure.K
    for inertia in assembly.inertias:
        if inertia.stations[0] in box.planets:
            at = 6 * inertia.stations[0] + np.arange(6)
            damping[np.ix_(at, at)] += inertia.gyroscopic

    def rows(turn: float) -> np.ndarray:
        """Approaches of meshes and pins where the carrier has turned."""
        there = helical_stage(ANGLE + single.sense * turn, back=back).model.assembly
        pins = [np.zeros((0, there.count))]
        for springs in there.springs:
            if springs.name.startswith("pins"):
                pins.append(np.zeros((len(springs.rows), there.count)))
                for number, station in enumerate(springs.stations):
                    pins[-1][:, 6 * station : 6 * station + 6] += springs.rows[:, 6 * number : 6 * number + 6]
        return np.vstack([there.columns.T, *pins])

    springs = np.tile(single.stiffness[single.kinds :], count), np.tile(PIN_DAMPING, count)
    speed, teeth = abs(state.model.flow.speed["carrier"]), single.paths.z_ring
    drive = single.excitation
    turning = TurningSystem(rows, assembly.mass, damping, stiffness, *springs, drive, teeth, speed, 2)
    return turning, single, motion[:size].T


def six_motions() -> tuple[Row, ...]:
    """A helical stage with tilts and gyroscopic planets, whose casing has its centre beside the axis."""
    rows = list[Row]()
    for name, back in (("helical stage in a casing", False), ("helical stage in a casing, backwards", True)):
        turning, stage, shape = turning_stage(back=back)
        text = "lines of six motions of sun, carrier and casing, largest difference over the largest line"
        rows.append(at_most(name, IN_TIME, text, 1e-6, apart_in_time(turning, stage, shape)))
    return tuple(rows)
