"""Friction that acts: closed forms, balances of moments and powers, time integration, orders of equal planets."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.flank_friction import path_sense, rolls_over_radii
from femgear.contact.supports import Supports
from femgear.gears.friction import path_speeds
from femgear.gears.kinematics import speeds
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.losses import solve_losses
from femgear.stages.static import solve_static
from femgear.system.fourier import sample
from femgear.system.system import mesh_harmonics, source_harmonics
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.pair.stages import solve_pair_modes
from femgear.trains.reading import read_case, with_values
from validation.rows import Row, at_most, within

MU = 0.06
ACTS = {
    "losses": {"friction": "constant", "coefficient": MU, "excites": True},
    "static.stresses": False,
    "static.flank_elements": 8,
    "dynamics.up_to": "8 kHz",
}
_PLACES = np.linspace(0.0, 1.0, 65)[:-1] + 0.0013


@lru_cache(maxsize=1)
def _pair() -> Any:
    bearings = {"gear_1.bearing_stiffness": "2e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}
    case = with_values(read_case("cases/spur_pair.toml"), ACTS | bearings | {"static.positions": 16})
    static = solve_static(case)
    return case, static, solve_pair_modes(case, static)


def friction_of_a_pair() -> tuple[Row, ...]:
    """Force of one tooth pair in contact, efficiency, and the periodic response against time integration."""
    case, static, modes = _pair()
    gears, torque = static.planetary_set, case.operation.torque
    (kind,), gear = gears.kinds, gears.gears[0]
    cycle = walk_mesh_cycle(
        gears, static.bodies, sun_torque=torque, positions=_PLACES, options=CycleOptions(friction=(MU,))
    )
    load = cycle.tooth_load[0]
    alone = (load > 0.0).sum(axis=0) == 1
    path = np.where(load > 0.0, cycle.path[0], 0.0).sum(axis=0)[alone]
    roll = gear.base_radius * np.tan(kind.working_pressure_angle) + path
    closed = torque / (gear.base_radius + MU * np.sign(path) * roll)
    second = gears.gears[1].base_radius
    arc = cycle.force + cycle.friction_force * np.tan(kind.working_pressure_angle) - cycle.friction_moment / second
    plain = with_values(case, {"losses.excites": False})
    efficiency = solve_losses(plain, solve_static(plain)).points[0].flow.efficiency
    name, low = "spur pair 24/36, mu 0.06", float(arc.mean() * gear.base_radius / torque)
    return (
        at_most(name, "closed form T/(r_b1 +- mu rho_1)", "force of one tooth pair in contact, relative", 1e-12,
                float(np.abs(cycle.force[0, alone] / closed - 1.0).max())),
        within(name, "loss factor of the loads without friction", "power lost over power in, of the first order in mu",
               1.0 - efficiency, 1.0 - low, 0.05),
        at_most(name, "time integration over a period from all unit states (DOP853)",
                "approach of the flanks over its peak to peak", 1e-6, _integrated(modes)),
    )  # fmt: skip


def _integrated(modes: Any, frequency: float = 1.9e3, count: int = 6) -> float:
    """How far the spectral response is from the linear equations in time, over its peak to peak."""
    basis, excitation, system = modes.modes, modes.excitation, modes.model.system
    stiffness, deflection, force = mesh_harmonics(excitation, count)
    source, omega = source_harmonics(excitation, count), 2.0 * np.pi * frequency
    elastic = basis.frequency > 0.0
    natural, shape, m = 2.0 * np.pi * basis.frequency[elastic], basis.shape[:, elastic], int(elastic.sum())
    damping = 2.0 * basis.damping_ratio[elastic] * natural
    row, acting, constant = system.W[:, 0] @ shape, shape.T @ system.sources, shape.T @ system.load

    def at(lines, t):
        return np.real(lines @ np.exp(1j * omega * t * np.arange(count + 1)))

    def rates(t, y, forced):
        x, v = np.split(y.reshape(2 * m, -1), 2)
        k = at(stiffness[0], t)
        load = -(natural**2)[:, None] * x - damping[:, None] * v
        load -= np.outer(row, (k - basis.mesh_stiffness[0]) * (row @ x))
        if forced:
            load += (constant + acting @ at(source, t) - row * (at(force[0], t) - k * at(deflection[0], t)))[:, None]
        return np.concatenate([v, load]).ravel()

    options = {"rtol": 1e-11, "atol": 1e-16, "method": "DOP853"}
    through = solve_ivp(rates, (0.0, 1.0 / frequency), np.eye(2 * m).ravel(), args=(False,), **options).y[:, -1]
    once = solve_ivp(rates, (0.0, 1.0 / frequency), np.zeros(2 * m), args=(True,), **options).y[:, -1]
    start = np.linalg.solve(np.eye(2 * m) - through.reshape(2 * m, 2 * m), once)
    instants = np.arange(256) / 256 / frequency
    moved = solve_ivp(rates, (0.0, 1.0 / frequency), start, args=(True,), t_eval=instants, **options).y
    response = solve_spectral(
        basis, excitation, frequency, excitation_harmonics=count, response_harmonics=40, tolerance=1e-11
    )
    approach = sample(response.deflection[0], 256)[0]
    return float(np.abs(approach - row @ moved[:m]).max() / np.ptp(approach))


def _order_of_the_mesh() -> tuple[np.ndarray, np.ndarray]:
    """Lines of a set with three planets out of phase, and all carrier orders, of which none is left out."""
    teeth = {"sun.teeth": 26, "ring.teeth": 106, "set.centre_distance": "49.8 mm"}
    left_open = dict.fromkeys(("sun.profile_shift", "ring.profile_shift", "sun.tip_diameter"))
    shape = {"static.positions": 16, "operation.speeds": ["250 rpm"], **teeth, **left_open}
    case = with_values(read_case("cases/planetary_27_40_108.toml"), ACTS | shape)
    static = solve_static(case)
    modes = replace(solve_modes(case, static), symmetry=1)
    lines = solve_housing(case, solve_dynamics(case, static, modes)).exact
    return np.abs(lines.displacement[0]), lines.order


def friction_of_sets() -> tuple[Row, ...]:
    """Balances of all bodies and of powers of an uneven set whose sun floats, and orders of equal planets."""
    case = with_values(read_case("cases/planetary_27_40_108.toml"), ACTS | {"static.positions": 16})
    static = solve_static(case)
    torque, gears = case.operation.torque, static.planetary_set
    step = 2.0 * np.pi / 135
    uneven = gears.with_planet_angles((0.0, 44 * step, 91 * step))
    cycle = walk_mesh_cycle(
        uneven,
        static.bodies,
        sun_torque=torque,
        positions=_PLACES,
        supports=Supports(sun=0.0),
        options=CycleOptions(friction=(MU, MU)),
    )
    mesh = np.broadcast_to(np.arange(6)[:, None, None], cycle.path.shape)
    slip = MU * path_sense(cycle.path, uneven.base_pitch)
    levers = rolls_over_radii(uneven, cycle.path, mesh)
    arcs = [(cycle.tooth_load * (1.0 + slip * lever)).sum(axis=1) for lever in levers]
    turning = speeds(uneven, input="sun", fixed="ring", speed=1.0)
    sliding = [
        np.abs(path_speeds(uneven.kinds[kind], path, turning.mesh_frequency).sliding)
        for kind, path in zip(uneven.mesh_kind, cycle.path, strict=True)
    ]
    lost = (MU * cycle.tooth_load * sliding).sum(axis=(0, 1))
    out = (torque + arcs[1][3:].sum(axis=0) * uneven.ring.base_radius) * turning.carrier
    strength, order = _order_of_the_mesh()
    name, equilibrium = "27/40/108, uneven planets, floating sun, mu 0.06", "equilibrium"
    return (
        at_most(name, equilibrium, "torque of the sun less that of its teeth, relative", 1e-9,
                float(np.abs(arcs[0][:3].sum(axis=0) * uneven.sun.base_radius / torque - 1.0).max())),
        at_most(name, equilibrium, "moments on the planets, over the torque of the sun", 1e-9,
                float(np.abs(arcs[1][:3] - arcs[0][3:]).max() * uneven.planet.base_radius / torque)),
        at_most(name, "sum of mu F |v_s| over all tooth pairs", "power in less power out, less losses, relative", 1e-9,
                float(np.abs(torque * turning.sun - out - lost).max() / (torque * turning.sun))),
        at_most("26/40/106, equal planets out of phase, mu 0.06", "planets that repeat one another",
                "largest carrier order that is no multiple of 3, 106 among them, over the largest one", 1e-9,
                float(strength[np.mod(order, 3) > 0.5].max() / strength.max())),
    )  # fmt: skip
