"""Side bands at the casing of the five-megawatt chain: where equal planets have theirs, and what weight does."""

from __future__ import annotations

import numpy as np

from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.system.fourier import side_bands
from femgear.trains.gearbox.balance import held_together, loaded_lines
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, nonlinear_gearbox
from femgear.trains.gearbox.sensors import sensor_rows
from femgear.trains.reading import read_case
from validation.drivetrain import CHAIN_TIME, chain_balance, chain_in_time, chain_tables, marched_from
from validation.rows import Row, at_most, information

NAME = "five-megawatt chain in its casing"
SYMMETRY = "N equal planets come round N times a turn, whatever stands still"
_SET = {"first stage": (4, 19), "second stage": (3, 18)}
"""Planets, and teeth of the sun, after which their phases go."""


def _box(stage: str, play: str, *, weight: bool) -> NonlinearGearbox:
    tables = chain_tables(play, [stage])
    if not weight:
        del tables["gravity"]
    state = solve_deflection(read_case(tables))
    drive = excitation_of(
        state, next(running_stage for running_stage in state.model.stages if running_stage.name == stage)
    )
    return nonlinear_gearbox(state, {stage: drive}, harmonics=3)


def sensor_lines(stage: str, play: str, *, weight: bool) -> tuple[np.ndarray, np.ndarray]:
    """Orders (L, 2) of carrier and mesh, and displacements (s, L) of both sensors [m] while a stage excites."""
    box = _box(stage, play, weight=weight)
    orders = side_bands(6, 3, 6)
    options = {"orders": orders, "stability": False, "radius": False, "tolerance": 1e-13}
    start = loaded_lines(box, len(orders)) if box.bearings else None
    held = solve_harmonic_balance(held_together(box), box.frequency, start=start, **options)
    solution = solve_harmonic_balance(box.problem, box.frequency, start=held, **options)
    return orders, displacements(box.problem, solution, sensor_rows(box.deflection.model) @ box.motion)


def off_the_planets() -> tuple[Row, ...]:
    """Lines that equal planets cannot make, with and without weight and play."""
    rows = list[Row]()
    for stage, (planets, sun) in _SET.items():
        for weight, play in ((False, "0 um"), (True, "0 um"), (True, "100 um")):
            orders, lines = sensor_lines(stage, play, weight=weight)
            # planet j is like planet 1, by j of N mesh periods of the sun later
            apart = (orders[:, 0] - orders[:, 1] * sun) % planets != 0
            size = np.abs(lines).max(axis=0)
            words = f"{'weight' if weight else 'no weight'}, {'play' if play != '0 um' else 'no play'}, {stage} excites"
            text = f"motion of the sensors off the places of equal planets over the largest, mean included, {words}"
            rows.append(at_most(NAME, SYMMETRY, text, 1e-10, float(size[apart].max() / size.max())))
    return tuple(rows)


def lines_of_weight() -> tuple[Row, ...]:
    """What weight and play make of the side bands at the casing: balance and integration in time."""
    sizes = []
    for weight, play in ((False, "0 um"), (True, "0 um"), (True, "100 um")):
        orders, lines = sensor_lines("first stage", play, weight=weight)
        sizes.append(np.abs(lines[0, (orders == [-2, 2]).all(axis=1)]).item())
    text = "line at mesh harmonic 2 - 2 x carrier of the first stage, its ring [m]; reference:"
    rows = [
        information(NAME, CHAIN_TIME, f"{text} no weight", sizes[0], sizes[1]),
        information(NAME, CHAIN_TIME, f"{text} no play", sizes[1], sizes[2]),
    ]
    for stage, duration, rate, harmonics in (("first stage", 0.09, 3.2e4, 14), ("second stage", 0.02, 6.4e4, 12)):
        model = chain_in_time(chain_tables("0 um", [stage]), duration, rate)
        carriers = {"first stage carrier": 3, "second stage carrier": 3}
        solution = chain_balance(model, carriers, {f"{stage} mesh": harmonics})
        sensed = sensor_rows(model.box.deflection.model) @ model.box.motion
        moved = marched_from(model, solution, sensed)
        lines, omega = displacements(model.box.problem, solution, sensed), solution.line_frequency
        expected = np.real(np.exp(1j * np.outer(moved.time, omega)) @ lines.T)
        apart = np.abs(moved.motion - expected).max(axis=0) / np.ptp(moved.motion, axis=0)
        text = f"motion of both sensors over a mesh period, weight, {stage} excites, largest difference over its range"
        rows.append(at_most(NAME, CHAIN_TIME, text, 1e-4, float(apart.max())))
    return tuple(rows)
