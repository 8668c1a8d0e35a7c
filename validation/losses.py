"""Losses: loss factors, coefficients of friction, efficiencies of sets, balance of powers."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from femgear.gears.friction import (
    closed_loss_factor,
    loss_factor,
    partial_contact_ratios,
    path_speeds,
    schlenk_friction,
    sliding_per_path,
)
from femgear.gears.gear import Gear
from femgear.gears.pair import GearPair
from femgear.gears.power_losses import basic_efficiency, planetary_efficiency
from femgear.gears.profile import base_helix_angle, overlap_ratio
from femgear.stages.losses import computed_loss_factor, solve_losses
from femgear.stages.static import solve_static
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.losses import loss_point
from femgear.trains.reading import read_case, with_values
from validation.rows import Row, at_most, information, printed, within
from validation.strength import ALPHA, helical_test_gear

GEARPIE = "GEARpie (C. M. C. G. Fernandes), report of FZG gear C14: 200 N m, 1500 rpm, oil M32 at 60 degC"
GEARPIE_H = "GEARpie, report of FZG gear H501"
INTEGRAL = "integral over the path of contact, half of the load in double contact"
CLOSED = "closed form, H. Ohlendorf 1958"
MULLER = "eta = (1 + i_0 eta_0)/(1 + i_0), J. Müller, Die Umlaufgetriebe"
C14_TORQUE, C14_SPEED, C14_WIDTH = 200.0, 50.0 * math.pi, 14e-3
SPUR = """
format = 1
model = "pair"
title = "FZG C14"
set = {{ module = "4.5 mm", pressure_angle = "20 deg", face_width = "14 mm", centre_distance = "91.5 mm" }}
material = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7830 kg/m^3" }}
gear_1 = {{ teeth = 16, profile_shift = 0.1817, tip_diameter = "82.636 mm", bore_radius = "15 mm" }}
gear_2 = {{ teeth = 24, tip_diameter = "118.544 mm", bore_radius = "15 mm" }}
operation = {{ torque = "200 N m", speeds = ["1500 rpm"] }}
static = {{ positions = {positions}, stresses = false }}
losses = {{ friction = "schlenk", roughness = "0.355 um" }}
lubricant = {{ viscosity = "15.12 mm^2/s", density = "878.3 kg/m^3", friction_factor = 0.846 }}
"""


def spur_test_gear(shifts: tuple[float, float], tips: tuple[float, float]) -> GearPair:
    """Make a spur FZG test gear, 16/24 with module 4.5 mm; tip diameters in mm."""
    gears = (
        Gear(teeth, 4.5e-3, ALPHA, shift, C14_WIDTH, 15e-3, tip_diameter=1e-3 * tip)
        for teeth, shift, tip in zip((16, 24), shifts, tips, strict=True)
    )
    return GearPair(*gears, 91.5e-3)


def unshifted_set() -> tuple[GearPair, GearPair]:
    """Make both meshes of 27/40/108 without profile shifts, each on its own centre distance."""
    sun, planet = (Gear(teeth, 1.5e-3, ALPHA, 0.0, 25e-3, 9e-3) for teeth in (27, 40))
    ring = Gear(108, 1.5e-3, ALPHA, 0.0, 25e-3, 100e-3, internal=True)
    return GearPair(sun, planet, 50.25e-3), GearPair(planet, ring, 51e-3)


@lru_cache(maxsize=4)
def computed_case(positions: int = 64, contact: str = "profile"):
    """Solve losses of the FZG gear C14 by the loads of its teeth."""
    case = with_values(read_case(SPUR.format(positions=positions)), {"static.contact": contact})
    static = solve_static(case)
    return solve_losses(case, static), computed_loss_factor(static.cycle, static.planetary_set)[0]


def fzg_gears() -> tuple[Row, ...]:
    """Loss factors, friction and losses of the FZG test gears."""
    c = spur_test_gear((0.1817, 0.1715), (82.636, 118.544))
    a = spur_test_gear((0.8532, -0.5), (88.77, 112.5))
    speeds = path_speeds(c, 0.0, C14_SPEED / (2.0 * math.pi) * 16)
    friction = schlenk_friction(
        C14_TORQUE / c.gear_1.base_radius / C14_WIDTH,
        speeds.sum_speed,
        speeds.radius,
        viscosity=13.28e-3,
        roughness=0.355e-6,
        lubricant=0.846,
    )
    power, factor = C14_TORQUE * C14_SPEED, loss_factor(c)
    after, before = partial_contact_ratios(a)
    beyond = math.pi / 16 * sliding_per_path(a) * (1.0 - after - before + after**2 + before**2)
    helical, beta = helical_test_gear(0.38), math.radians(15.0)
    base, overlap = base_helix_angle(ALPHA, beta), overlap_ratio(23e-3, 3.5e-3, beta)
    return (
        printed("C14", GEARPIE, "loss factor H_V, closed form", "0.1986", closed_loss_factor(c)),
        within("C14", CLOSED, "loss factor H_V, integral", closed_loss_factor(c), factor, 1e-12),
        printed("C14", GEARPIE, "coefficient of friction, Schlenk", "0.0449", friction),
        within("C14", GEARPIE, "loss with its factor 0.1946 [W]", 274.37, power * 0.1946 * friction, 1e-3),
        within("C14", INTEGRAL, "loss with H_V 0.19863 and mu 0.04487 [W]", 280.0, power * factor * friction, 1e-3),
        printed("A", CLOSED, "H_V of the closed form beyond its range, eps_1 1.111", "0.3064", beyond),
        within("A", INTEGRAL, "loss factor H_V", 0.3023, factor_of_a := loss_factor(a), 5e-4),
        at_most("A", CLOSED, "H_V less the closed form: the integral is smaller", 0.0, max(factor_of_a - beyond, 0.0)),
        printed("H501", GEARPIE_H, "loss factor H_V, closed form", "0.1639", closed_loss_factor(helical, base)),
        within("H501", GEARPIE_H, "H_V, equal loads on lines", 0.1869, loss_factor(helical, overlap, base), 5e-3),
        within("H501", "sum over 4000 x 2000 points", "the same", _summed(helical, overlap, base),
               loss_factor(helical, overlap, base), 1e-6),
    )  # fmt: skip


def _summed(pair: GearPair, overlap: float, base_helix: float) -> float:
    """H_V of equal loads on all lines, as a plain sum over phases and slices."""
    start, end = (place / pair.base_pitch for place in pair.path)
    phase, lean = (np.arange(4000) + 0.5) / 4000, overlap * ((np.arange(2000) + 0.5) / 2000 - 0.5)
    count, distance = np.zeros(4000), np.zeros(4000)
    for number in range(-4, 5):
        place = phase[:, None] + number + lean
        touches = (place >= start) & (place <= end)
        count += touches.sum(axis=1)
        distance += (touches * np.abs(place)).sum(axis=1)
    pitch = 2.0 * math.pi / pair.gear_1.teeth
    return pitch * sliding_per_path(pair) * float(np.mean(distance / count)) / math.cos(base_helix)


def computed_loads() -> tuple[Row, ...]:
    """Losses by computed loads of the teeth."""
    result, factor = computed_case()
    data = result.dataset()
    _, finer = computed_case(256)
    rigid = float(data["rigid_loss_factor"][0])
    _, on_path = computed_case(contact="line_of_action")
    beyond = "under load teeth touch 0.7 mm before and 0.8 mm after the path, where they slide most"
    return (
        within("C14", GEARPIE, "H_V of loads by the stiffness of teeth, on the path alone", 0.1946, on_path, 5e-3),
        information("C14", INTEGRAL, "H_V of the computed loads", rigid, factor, note=beyond),
        within("C14", "256 positions", "H_V of the computed loads, 64 positions", finer, factor, 2e-3),
        printed("C14", GEARPIE, "coefficient of friction of the case", "0.0449", data["friction_coefficient"][0, 0]),
        at_most("C14", "power that enters", "balance of powers, relative", 1e-9, float(data["power_imbalance"][0])),
    )


def gearbox() -> tuple[Row, ...]:
    """Balance and efficiency of a gearbox of two stages with bearings."""
    losses = {"friction": "constant", "coefficient": 0.05}
    oil = {"viscosity": "20 mm^2/s"}
    case = with_values(read_case("cases/e_axle.toml"), {"losses": losses, "lubricant": oil, "deflection.slices": 11})
    state = solve_deflection(case)
    whole = loss_point(state, case.load_case)
    teeth = with_values(case, {"losses": losses | {"bearings": False}})
    alone = loss_point(replace(state, model=replace(state.model, case=teeth)), teeth.load_case)
    pair, planetary = (alone.friction[name].passed for name in ("first stage", "second stage"))
    expected = pair[0] * planetary_efficiency(basic_efficiency(planetary), 73 / 23)
    bearings = sum(whole.bearing_loss.values())
    name = "electric axle"
    return (
        at_most(name, "power that enters", "balance of powers, relative", 1e-9, abs(whole.flow.imbalance)),
        within(name, MULLER, "efficiency of both stages without bearings", expected, alone.flow.efficiency, 1e-12),
        at_most(name, "meshes and bearings", "losses less their sum [W]", 1e-9,
                abs(whole.flow.loss - bearings - sum(map(np.sum, whole.mesh_loss.values())))),
    )  # fmt: skip


def sets() -> tuple[Row, ...]:
    """Loss factors and efficiencies of planetary sets with mu 0.05."""
    first, second = unshifted_set()
    factors = [loss_factor(pair) for pair in (first, second)]
    basic = basic_efficiency([1.0 - 0.05 * factor for factor in factors])
    after, before = partial_contact_ratios(second)
    beyond = math.pi / 40 * sliding_per_path(second) * (1.0 - after - before + after**2 + before**2)
    case = with_values(
        read_case("cases/planetary_27_40_108.toml"),
        {"losses": {"friction": "constant", "coefficient": 0.05}, "static.stresses": False},
    )
    static = solve_static(case)
    data = solve_losses(case, static).dataset()
    eta = float(data["stage_efficiency"][0, 0])
    back = with_values(case, {"operation.torque": "-100 N m"})
    reverse = solve_losses(back, solve_static(back)).dataset()
    name, source = "27/40/108 without shifts", "closed forms and integral, mu 0.05"
    carrier = planetary_efficiency(float(reverse["stage_efficiency"][0, 0]), 4.0, sun_drives=False)
    return (
        printed(name, source, "H_V sun-planet", "0.14157", factors[0]),
        printed(name, source, "H_V planet-ring", "0.04701", factors[1], note="partial contact ratio 1.073"),
        printed(name, source, "H_V planet-ring of the closed form beyond its range", "0.04727", beyond),
        printed(name, source, "efficiency with the carrier held, eta_0", "0.990588", basic),
        printed(name, source, "efficiency with the ring held", "0.992470", planetary_efficiency(basic, 4.0)),
        within("27/40/108", MULLER, "efficiency by torques, sun drives", planetary_efficiency(eta, 4.0),
               float(data["efficiency"][0]), 1e-12),
        within("27/40/108", MULLER, "efficiency by torques, carrier drives", carrier,
               float(reverse["efficiency"][0]), 1e-12),
        at_most("27/40/108", "power that enters", "balance of powers, relative", 1e-9,
                float(np.abs(data["power_imbalance"]).max())),
    )  # fmt: skip
