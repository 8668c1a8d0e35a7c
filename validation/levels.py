"""The dynamic model at rest beside the static one, and levels beside excitation that reaches further."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from femgear.system.fourier import harmonics_of, sample
from validation.cases import CASE
from validation.rows import Row, at_most, information, within

if TYPE_CHECKING:
    from femgear.case.planetary import Case

REST = "static state of the set on its supports"
SAME = "the same with excitation up to twice the frequency"
POSITIONS = "the same with 128 positions at least"
SPEEDS = ["250 rpm", "1000 rpm", "2000 rpm", "3100 rpm"]
OTHER = """
format = 1
title = "other set"
set = {{ planets = {planets}, face_width = "20 mm" {more} }}
material = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }}
carrier = {{ mass = "3 kg", inertia = "6e-3 kg m^2", support_stiffness = "2e8 N/m" }}
operation = {{ input = "sun", fixed = "ring", torque = "120 N m", speeds = ["250 rpm"] }}

[sun]
teeth = {teeth[0]}
module = "2 mm"
pressure_angle = "20 deg"
bore_radius = "{bores[0]} mm"
mass = "0.2 kg"
inertia = "4e-5 kg m^2"
support_stiffness = "5e7 N/m"

[planet]
teeth = {teeth[1]}
profile_shift = {shift}
bore_radius = "{bores[1]} mm"
mass = "0.15 kg"
inertia = "3e-5 kg m^2"
bearing_stiffness = "3e8 N/m"

[ring]
teeth = {teeth[2]}
{ring}
outer_radius = "{outer} mm"
foundation_radial = "1e10 N/m^3"
foundation_tangential = "1e10 N/m^3"
"""
SMALL = {
    "teeth": (21, 19, 59),
    "shift": 0.0,
    "bores": (10, 10),
    "outer": 75,
    "planets": 4,
    "ring": 'tip_diameter = "114.4 mm"',
    "more": ', centre_distance = "40.1 mm"',
}


def _small(**changes) -> Case:
    """Set 21/19/59, in sequence with four or five planets, with other entries."""
    from femgear.trains.reading import parse_case

    return parse_case(OTHER.format(**SMALL | changes), name="other set")


@cache
def _sets() -> dict[str, Case]:
    """The reference set, one out of phase, and one with two opposite pairs of planets."""
    from femgear.trains.reading import parse_case, with_value

    reference = parse_case(CASE, name="reference set")
    for key in ("dynamics", "housing"):
        reference = with_value(reference, key, {})
    out_of_phase = _small(
        teeth=(28, 41, 110),
        shift=0.2,
        ring="profile_shift = 0.0",
        more="",
        planets=3,
        bores=(12, 25),
        outer=130,
    )
    pairs = _small(more=SMALL["more"] + ', planet_angles = ["0 deg", "81 deg", "180 deg", "261 deg"]')
    return {
        "27/40/108, three planets in phase": reference,
        "28/41/110, three planets in sequence": out_of_phase,
        "21/19/59, two opposite pairs": pairs,
    }


def _changed(case: Case, key: str, value) -> Case:
    from femgear.trains.reading import with_value

    return with_value(case, key, value)


def at_rest() -> tuple[Row, ...]:
    """At 0.01 rpm the dynamic transmission error is that of the set on its supports."""
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_dynamics, solve_modes

    rows = []
    for name, case in _sets().items():
        case = _changed(case, "operation.speeds", ["0.01 rpm"])
        static = solve_static(case)
        modes = solve_modes(case, static)
        dte = sample(solve_dynamics(case, static, modes).dte[0], 2048)
        # the kinks of the static curve have harmonics beyond those of the excitation
        ste = sample(harmonics_of(modes.state.resampled("deflection", 8192), 512), 2048)
        N = len(ste) // 2
        for kind, meshes in (("sun-planet", slice(0, N)), ("planet-ring", slice(N, 2 * N))):
            error = np.abs(dte - ste)[meshes].max(axis=1) / np.ptp(ste[meshes], axis=1)
            quantity = f"{name}, {kind}: largest difference of the transmission errors over peak to peak"
            rows.append(at_most("at rest", REST, quantity, 1e-3, error.max()))
            mean = ste[meshes].mean(axis=1), dte[meshes].mean(axis=1)
            error = np.abs(mean[1] / mean[0] - 1).max()
            rows.append(at_most("at rest", REST, f"{name}, {kind}: largest difference of the means", 1e-3, error))
    return tuple(rows)


def more_torque() -> tuple[Row, ...]:
    """Deflections under more torque, statically and by the dynamic model at rest."""
    from femgear.contact.loaded_period import loaded_period
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import linear_supports, solve_modes

    step, rows = 0.02, []
    thin = "rim of one module"
    for name, case in {
        "27/40/108, three planets": _sets()["27/40/108, three planets in phase"],
        "21/19/59, four planets": _small(),
        "21/19/59, five planets": _small(planets=5),
        f"21/19/59, four planets, sun with a {thin}": _small(bores=(16.5, 10)),
        f"21/19/59, four planets, planets with a {thin}": _small(bores=(10, 14.5)),
    }.items():
        case = _changed(case, "operation.speeds", ["0.01 rpm"])
        static = solve_static(case)
        modes = solve_modes(case, static)
        less, more = (
            loaded_period(
                static.planetary_set,
                *modes.bodies,
                sun_torque=static.sun_torque * (1 + sign * step),
                positions=case.static.positions,
                contact=case.static.contact,
                supports=linear_supports(case),
            )
            for sign in (-1, 1)
        )
        mean = [record.resampled("deflection", 8192).mean(axis=1) for record in (less, more)]
        force = [record.resampled("force", 8192).mean(axis=1) for record in (less, more)]
        motions = [_mean_motion(modes, 1 + sign * step) for sign in (-1, 1)]
        N = len(mean[0]) // 2
        for kind, mesh in (("sun-planet", 0), ("planet-ring", N)):
            statically = (force[1] - force[0])[mesh] / (mean[1] - mean[0])[mesh]
            dynamically = (motions[1][1] - motions[0][1])[mesh] / (motions[1][0] - motions[0][0])[mesh]
            quantity = f"{name}, {kind}: change of force over change of mean deflection [N/um]"
            rows.append(
                within(
                    "at rest",
                    "static states under 2 % more and less torque",
                    quantity,
                    1e-6 * statically,
                    1e-6 * dynamically,
                    5e-3,
                    note="half a per cent: the curvature of force over deflection between the two states, "
                    "and the mean of the coupling over the period",
                )
            )
    return tuple(rows)


def _mean_motion(modes, factor: float):
    """Mean transmission errors [m] and mesh forces [N] of the model at rest under a part of its load."""
    from femgear.solvers.periodic.spectral import solve_spectral
    from femgear.trains.elastic.outputs import mesh_and_ring_outputs

    basis, system = modes.modes, modes.model.system
    basis = replace(basis, load_deflection=factor * basis.load_deflection, modal_load=factor * basis.modal_load)
    model = replace(modes.model, system=replace(system, load=factor * system.load))
    response = solve_spectral(
        basis, modes.excitation, [1e-3], excitation_harmonics=40, response_harmonics=60, tolerance=1e-9
    )
    dte, _ = mesh_and_ring_outputs(replace(modes, modes=basis, model=model), response)
    return dte[0, :, 0].real, response.force[0, :, 0].real


def reach() -> tuple[Row, ...]:
    """Level of the housing beside excitation up to twice the frequency, and beside more positions."""
    from femgear.housing.orders import order_level
    from femgear.stages.static import solve_static
    from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes

    rows = []
    for name, case in _sets().items():
        case = _changed(case, "operation.speeds", SPEEDS)
        levels = []
        for positions in (64, 128):
            chosen = _changed(case, "static.positions", positions)
            static = solve_static(chosen)
            dynamics = solve_dynamics(chosen, static, solve_modes(chosen, static))
            levels.append(order_level(solve_housing(chosen, dynamics).lines))
            if positions == 64:
                change, limit = dynamics.level_change, dynamics.excitation_limit
        for i, speed in enumerate(SPEEDS):
            label = f"{name}, {speed}, excited up to {1e-3 * limit[i]:.1f} kHz: "
            words = label + "level of the housing [m/s^2]"
            rows.append(information("reach", "none", words, None, levels[0][i]))
            rows.append(at_most("reach", SAME, label + "change of the level [dB]", 1.0, change[i]))
            more = 20 * np.log10(levels[1][i] / levels[0][i])
            rows.append(at_most("reach", POSITIONS, label + "change of the level [dB]", 0.3, more))
    return tuple(rows)
