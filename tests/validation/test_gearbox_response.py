"""Rows of the response of gearboxes see what they are about: wrong senses, wrong shares, missing forces."""

from dataclasses import replace

import numpy as np
import pytest
from running_twin import TURN, running, twin

from femgear.housing.two_way.running_planets import solve_running
from femgear.trains.gearbox.stage_structure import running_stage
from validation.gearbox_cross import rms
from validation.gearbox_in_time import orders_of, turning_stage
from validation.gearbox_power import Grid, out_of_balance, planets_in_a_casing, powers
from validation.gearbox_response import (
    apart_from_gear_set,
    stage_in_casing,
    synthetic_excitation,
    without_loss,
)

KNOWN = {"harmonics": (2, 4), "side_bands": 4, "tolerance": 1e-13}


def test_lines_of_one_order_add():
    system = twin(3, 4)
    response = solve_running(running(system), 4 * TURN, TURN, **KNOWN)
    shape = system.modes()[1].T
    met, every = orders_of(response, shape, 40), response.lines(shape)
    order = np.rint(response.frequency / TURN).astype(int)
    assert met[:, 6] == pytest.approx(every[order == 6].sum(axis=0) + every[order == -6].sum(axis=0).conj())


def test_a_field_is_the_sum_of_its_lines():
    lines = np.zeros((3, 3), complex)
    lines[0, 1], lines[1, 2], lines[0, 2] = 0.3, 0.5 - 0.2j, 0.1j
    lines[0, 0] = lines[0, 2].conj()
    grid = Grid(8, 6, 50.0, 7.0)
    theta, phi = 2.0 * np.pi * np.arange(8)[:, None] / 8, grid.turn
    wanted = 0.3 - 0.2 * np.sin(phi) + np.cos(theta + phi) + 0.4 * np.sin(theta + phi)
    assert grid.field(lines) == pytest.approx(wanted)
    wanted = -0.2 * 7.0 * np.cos(phi) + 57.0 * (-np.sin(theta + phi) + 0.4 * np.cos(theta + phi))
    assert grid.field(lines, derivative=True) == pytest.approx(wanted)


def test_the_drive_of_the_carrier_has_its_share_of_the_power():
    stage = replace(running(twin(3, 13)), structure_loss=0.04)
    power = powers(stage, solve_running(stage, 13 * TURN, TURN, **KNOWN), 2)
    losses = power["springs"] + power["structure"]
    assert power["excitation"] == pytest.approx(losses + power["drive"], rel=1e-9)
    assert power["springs"] > 0.0 and power["structure"] > 0.0
    assert abs(power["drive"]) > 1e-4 * losses
    # and less loss than there is would be seen
    less = replace(stage, structure_loss=0.0399)
    power = powers(less, solve_running(stage, 13 * TURN, TURN, **KNOWN), 2)
    assert power["excitation"] != pytest.approx(power["springs"] + power["structure"] + power["drive"], rel=1e-5)


def test_another_mass_shows_in_the_motions():
    found = stage_in_casing()
    structured = running_stage(found, found.model.stages[0], synthetic_excitation(found, found.model.stages[0]))
    stage, motion = structured.running, structured.motion
    stage = without_loss(stage)
    assert apart_from_gear_set(found, stage, motion, 400.0) < 1e-9
    assert apart_from_gear_set(found, replace(stage, mass=1.0001 * stage.mass), motion, 400.0) > 1e-7
    # the stiffness that is taken out of k(t) is free: the solution does not know it
    split = replace(stage, stiffness=stage.stiffness * np.where(np.isfinite(stage.stiffness), 1.01, 1.0))
    assert apart_from_gear_set(found, split, motion, 400.0) < 1e-9


def test_the_casing_is_out_of_balance_without_its_ring(monkeypatch):
    found = planets_in_a_casing()
    drive = synthetic_excitation(found, found.model.stages[0])
    assert out_of_balance(found, drive, 1.0) < 1e-9
    monkeypatch.setattr("validation.gearbox_power.ring_force", lambda *parts: np.zeros((3, 1, 1)))
    assert out_of_balance(found, drive, 1.0) > 0.1


def test_rms_leaves_out_the_mean():
    assert rms(np.array([0.5 + 0.5j, 7.0, 0.5 - 0.5j])) == pytest.approx(1.0)


def test_rows_of_a_stage_turn_with_its_carrier():
    turning, stage, shape = turning_stage(back=False)
    # the first mesh and pin of the structure, from waves and from the assembly at an angle
    modal = np.tensordot(np.exp(1j * stage.waves * (0.3 + 1.1)), stage.shape, axes=(0, 1)).real
    rows = turning.rows(1.1)[:, :18] @ shape.T
    places = [0, 3, 8, 10]
    assert rows[places] == pytest.approx(modal[[0, 1, 4, 6]], abs=1e-9 * np.abs(rows).max())
