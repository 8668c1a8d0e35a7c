"""Whole gearboxes: the modes of other trains, lever rules, thrust, settling of teeth and system, symmetry."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from gearbox_equivalents import (
    elastic_set_tables,
    pair_of_rigid_gears_tables,
    set_tables,
)
from published.planetary_sets import kahraman_set, lin_parker_set
from small_gearbox import pair_tables

from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.lumped_set import gear_set_modes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import linear_system, solve_gearbox_modes
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_values
from validation.drivetrain import chain_tables
from validation.reference.multistage_train import stored
from validation.rows import Row, at_most, counted, within

CLOSED = "closed form"
SELF = "the same gearbox"
LARGEST = 1e-9


def frequencies(tables: dict[str, Any]) -> np.ndarray:
    """Natural frequencies of a gearbox [Hz], ascending, with all slices of its meshes in touch."""
    assembly, system, _ = linear_system(solve_deflection(read_case(tables)))
    still = type(system)(system.M, system.C, system.K, system.W, 0.0 * system.load, system.dofs)
    return np.sort(undamped_modes(still, assembly.slice_stiffness, damping_ratio=0.0).frequency)


def _alike(name: str, source: str, tables: dict[str, Any], expected) -> list[Row]:
    """Number of modes, and the largest difference of their frequencies."""
    computed, expected = frequencies(tables), np.sort(expected)
    rows = [counted(name, source, "modes", len(expected), len(computed))]
    elastic = expected > 1e-3
    apart = np.abs(computed - expected)[elastic] / expected[elastic] if len(computed) == len(expected) else [math.inf]
    rows.append(at_most(name, source, "largest difference of natural frequencies, relative", LARGEST, np.max(apart)))
    return rows


def other_trains() -> tuple[Row, ...]:
    """Sets and stages in series written as gearboxes."""
    helical, planar = kahraman_set(contact_points="pitch_point"), lin_parker_set()
    radii = np.array([planar.sun_radius, planar.planet_radius, planar.ring_radius])
    teeth = np.rint(1000 * radii / radii[0]).astype(int).tolist()
    rows = _alike(
        "helical set of Kahraman",
        "femgear, helical",
        set_tables(helical, (30, 20, 70)),
        gear_set_modes(helical).frequency,
    )
    rows += _alike(
        "spur set of Lin and Parker", "femgear, planar", set_tables(planar, teeth), gear_set_modes(planar).frequency
    )
    for case, key in (("published_four_stages", "published"), ("four_stage_reducer", "modes")):
        tables = tomllib.loads(Path(f"cases/{case}.toml").read_text(encoding="utf-8"))
        rows += _alike(case, "femgear, multistage", tables, stored()[key]["frequency"])
    pair = with_values(read_case("cases/spur_pair.toml"), {"gear_1.bearing_stiffness": "1e8 N/m"})
    modes = solve(pair, only="modes")["modes"].modes
    tables = pair_of_rigid_gears_tables(pair, float(modes.mesh_stiffness[0]))
    return (*rows, *_alike("spur pair", "femgear, pair", tables, modes.frequency))


def elastic_ring() -> tuple[Row, ...]:
    """The reference set on its foundation, with motor and brake, written as a gearbox in the plane."""
    path, name = "cases/planetary_27_40_108.toml", "reference set on its foundation"
    expected = np.sort(solve(read_case(path), only="modes")["modes"].modes.frequency)
    tables = elastic_set_tables(path) | {"modes": {"up_to": "500 kHz"}}
    computed = np.sort(solve_gearbox_modes(solve_deflection(read_case(tables))).modes.frequency)[: len(expected)]
    high = expected > 1e3
    source = "femgear, elastic"
    apart = np.abs(computed[high] / expected[high] - 1.0).max()
    rows = [at_most(name, source, "largest difference of natural frequencies above 1 kHz, relative", LARGEST, apart)]
    low = (expected > 1.0) & ~high
    text = "the same below 1 kHz, where rounding of the highest modes shows"
    rows.append(at_most(name, source, text, 1e-7, np.abs(computed[low] / expected[low] - 1.0).max()))
    case, name = read_case("cases/helical_23_24_73.toml"), "helical set on its foundation"
    expected = np.sort(solve(case, only="modes")["modes"].modes.frequency)
    box = read_case(gearbox_of_case(case).tables | {"modes": {"up_to": "500 kHz"}})
    computed = np.sort(solve_gearbox_modes(solve_deflection(box)).modes.frequency)[: len(expected)]
    text = "largest difference of natural frequencies above 1 Hz, relative"
    elastic = expected > 1.0
    apart = np.abs(computed[elastic] / expected[elastic] - 1.0).max()
    return (*rows, at_most(name, source, text, 1e-7, apart))


def wind_turbine() -> tuple[Row, ...]:
    """The chain of a five-megawatt turbine: ratio, stiffness of the whole, free-free torsion."""
    tables = chain_tables("0 um", ())
    # the values of the reference are those of a gearbox that stands
    del tables["casing"], tables["sensor"]
    case = read_case(tables)
    state = solve_deflection(case)
    model, name = state.model, "five-megawatt chain"
    ratio = model.flow.speed["high speed"] / model.flow.speed["main shaft"]
    station = model.seat("high speed", 1.4).station
    twist = -state.motion[6 * station + 5] / ratio
    stiffness = case.load_case.torque["wind"] / twist
    modes = solve_gearbox_modes(state).modes
    torsion = next(hertz for hertz, kind in zip(modes.frequency, modes.kind, strict=True) if kind == "torsional")
    source = "NREL/TP-500-38060, Table 5-1"
    exact = (1 + 56 / 19) * (1 + 93 / 18) * 95 / 24
    return (
        within(name, "tooth numbers", "gear ratio", exact, -ratio, 1e-9),
        within(name, source, "torsional stiffness of the chain [N m/rad]", 867.637e6, stiffness, 5e-3),
        within(
            name,
            "2.18 Hz, free-free, of rotor and generator on that spring",
            "first torsional mode [Hz]",
            2.18,
            torsion,
            0.03,
            note="with the inertia of the gears, and a ratio of 96.35 where that has 97",
        ),
    )


def statics() -> tuple[Row, ...]:
    """Bearing forces by the lever rule, and thrust of helical teeth by textbooks."""
    tables = pair_tables(helix="15 deg")
    tables["deflection"] = {"slices": 1}
    state = solve_deflection(read_case(tables))
    alpha, beta, tangential = math.radians(20.0), math.radians(15.0), 100.0 / 0.036
    on_input = state.bearing_force[:2]
    rows = [
        within(
            "pair, 15 deg",
            CLOSED,
            "radial force on the input shaft [N]",
            tangential * math.tan(alpha),
            on_input[:, 0].sum(),
            1e-9,
        ),
        within("pair, 15 deg", CLOSED, "tangential force [N]", tangential, on_input[:, 1].sum(), 1e-9),
        within("pair, 15 deg", CLOSED, "thrust [N]", tangential * math.tan(beta), -on_input[:, 2].sum(), 1e-9),
    ]
    # in the plane of the tangential force: levers of 25 and 55 mm; the thrust tilts in the other plane
    rows.append(
        within(
            "pair, 15 deg", CLOSED, "tangential force of bearing A [N]", tangential * 55.0 / 80.0, on_input[0, 1], 1e-9
        )
    )
    moment = tangential * math.tan(beta) * 0.036
    # moments about bearing B: thrust along +z at the tooth on the side of the wheel turns the shaft against the load
    lever = tangential * math.tan(alpha) * 55.0 / 80.0
    rows.append(
        within(
            "pair, 15 deg",
            CLOSED,
            "radial force of bearing A [N], with the couple of the thrust",
            lever - moment / 0.08,
            on_input[0, 0],
            1e-9,
        )
    )
    return tuple(rows)


def passes() -> tuple[Row, ...]:
    """Teeth and system settle within five passes, and where they start does not matter."""
    rows = []
    for torque in ("100 N m", "-100 N m"):
        tables = pair_tables(teeth=True)
        tables["operation"]["load_case"][0]["torque"]["motor"] = torque
        case = read_case(tables)
        state, far = solve_deflection(case), solve_deflection(case, slopes=[3e-4])
        rows.append(at_most(f"pair, {torque}", SELF, "passes until slopes agree to 1e-4", 5, len(state.slopes) - 1))
        apart = np.abs(far.mesh_slope / state.mesh_slope - 1.0).max()
        rows.append(at_most(f"pair, {torque}", SELF, "slope from a start of 0.3 mrad, relative", 2e-4, apart))
        rows.append(_seen(state, f"pair, {torque}"))
    axle = solve_deflection(read_case("cases/e_axle.toml"))
    count = len(axle.slopes) - 1
    rows.append(at_most("electric axle", SELF, "passes until slopes agree to 1e-4", 5, count))
    rows.append(at_most("electric axle", "equilibrium", "force out of balance over the largest", 1e-9, axle.residual))
    rows.append(_seen(axle, "electric axle"))
    return tuple(rows)


def _seen(state: Deflection, name: str) -> Row:
    """Largest difference of the misalignment that contact and system have, over the load's own approach."""
    worst = 0.0
    for stage in state.model.stages:
        if stage.name in state.contacts:
            rise = state.contacts[stage.name].result.cycle.mesh_misalignment.mean(axis=1)
            slope = state.slopes[-2][list(stage.meshes)] * stage.width / math.cos(stage.sizes.base_helix)
            worst = max(worst, float(np.abs(rise - slope).max() / max(np.abs(slope).max(), 1e-9)))
    return at_most(name, SELF, "misalignment of contact and of system, relative", 1e-3, worst)
