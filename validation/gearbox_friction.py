"""Friction of the teeth that excites gearboxes: beside the trains of a pair and a set, and the power that it takes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set
from femgear.gears.friction import sliding_per_path
from femgear.housing.two_way.running_planets import solve_running
from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.friction_source import balanced_source
from femgear.stages.static import solve_static
from femgear.system.fourier import harmonics_of
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.elastic_ring import elastic_ring
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.friction import first_speed
from femgear.trains.gearbox.losses import loss_point
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.planar.model import planar_model
from femgear.trains.reading import read_case, with_values
from validation.gearbox_response import without_loss
from validation.rows import Row, at_most, within

ACTS = {"friction": "constant", "coefficient": 0.06, "excites": True}
FEW: dict[str, Any] = {"static.positions": 16, "static.flank_elements": 8, "dynamics.up_to": "4 kHz"}
OWN_TRAIN = "solution of its own train, femgear.solvers.periodic.spectral"


def friction_of_stages() -> tuple[Row, ...]:
    """A pair and a set with an elastic ring as gearboxes, with friction; planets of a planar set at rest."""
    return (*_pair(), *_set(), *_planets())


def _pair() -> tuple[Row, ...]:
    held = {"gear_1.bearing_stiffness": "2e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}
    rows, steps = list[Row](), Steps()
    for torque in ("200 N m", "-150 N m"):
        case = with_values(read_case("cases/spur_pair.toml"), FEW | held | {"operation.torque": torque, "losses": ACTS})
        modes, name = solve(case, only="modes")["modes"], f"pair 24/36 with friction, {torque}"
        state = solve_deflection(read_case(gearbox_of_case(case).tables), steps=steps)
        (stage,) = state.model.stages
        excitation = excitation_of(state, stage, steps=steps, friction=True)
        assert excitation.source is not None
        source = modes.excitation.source[:-1]
        apart = np.abs(excitation.source - source).max() / np.abs(source).max()
        rows.append(at_most(name, OWN_TRAIN, "source of friction, over the largest", 1e-8, apart))
        running = without_loss(running_stage(state, stage, excitation).running)
        basis = replace(modes.modes, damping_ratio=0.0 * modes.modes.damping_ratio)
        for hertz in (300.0, 1900.0, 3000.0):
            wanted = solve_spectral(
                basis, modes.excitation, hertz, excitation_harmonics=6, response_harmonics=18, tolerance=1e-12
            ).force[0, 0, 1:]
            response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(6, 18), tolerance=1e-13)
            apart = np.abs(2.0 * response.force[0, 0, 1:, 0] - wanted).max() / np.abs(wanted).max()
            rows.append(
                at_most(name, OWN_TRAIN, f"mesh force, mesh frequency {hertz:g} Hz, over the largest", 1e-8, apart)
            )
        couple = -excitation.source[1].mean()
        (kind,) = state.contacts["pair"].result.planetary_set.kinds
        # couples count in the sense in which gear 1 is pushed
        pushed = -np.sign(state.model.flow.first_torque(stage.section))
        power = pushed * first_speed(state.model, stage.section) * sliding_per_path(kind) * couple
        loss = float(np.sum(loss_point(state, state.model.case.load_case).mesh_loss["pair"]))
        text = "mean power that friction takes [W], loads with it"
        rows.append(within(name, 'stage "losses", loads without friction', text, loss, float(power), 0.05))
    return tuple(rows)


def _set() -> tuple[Row, ...]:
    case = with_values(read_case("cases/planetary_27_40_108.toml"), FEW | {"losses": ACTS})
    reference = solve(case, only="modes")["modes"]
    state = solve_deflection(read_case(gearbox_of_case(case).tables))
    stage, ring = state.model.stages[0], elastic_ring(state.model, state.model.stages[0])
    running = without_loss(running_stage(state, stage, ring.excitation, [ring]).running)
    modes = undamped_modes(reference.model.system, reference.excitation.stiffness.mean(axis=1), damping_ratio=0.0)
    excitation, rows = balanced_source(reference.excitation, modes), list[Row]()
    for hertz in (300.0, 1500.0, 2300.0):
        options = {"excitation_harmonics": 8, "response_harmonics": 12, "method": "direct"}
        wanted = solve_spectral(modes, excitation, np.array([hertz]), **options).force[0][[0, len(stage.planets)], 1:]
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=(8, 12), side_bands=0, tolerance=1e-13)
        apart = np.abs(2.0 * response.force[0, :2, 1:, 0] - wanted).max() / np.abs(wanted).max()
        text = f"mesh forces, mesh frequency {hertz:g} Hz, over the largest"
        rows.append(at_most("set 27/40/108 with friction", OWN_TRAIN, text, 1e-8, apart))
    return tuple(rows)


def _planets() -> tuple[Row, ...]:
    left_out = {"planar.gravity": None, "planar.branch": None, "static.stresses": False, "static.flank_elements": 8}
    case: Any = with_values(read_case("cases/nrel_pgb_static.toml"), {"losses": ACTS} | left_out)
    static, gears, count = solve_static(case), planetary_set(case), case.mesh_harmonics
    model, orders = planar_model(case, gears, static, mesh_frequency=True), np.arange(count + 1)
    slow = solve_harmonic_balance(
        model.problem,
        np.array([1e-3, 2.0 * np.pi * 0.05]),
        orders=np.stack([0 * orders, orders], axis=1),
        reduction=model.reduction,
        radius=False,
    ).force[model.groups["meshes"]]
    halves = (np.split(values, 2) for values in (slow, harmonics_of(static.cycle.force, count)))
    moving, still = (first - second for first, second in halves)
    text = "difference of the forces of both meshes of a planet, over the largest"
    apart = np.abs(moving - still).max() / np.abs(still).max()
    return (at_most("planar set of NREL with friction, slow", "statics with friction", text, 1e-3, apart),)
