"""Relief, errors and moving members of the reference set against closed forms and against one another."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.supports import Supports
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.kinematics import mesh_normals
from femgear.gears.modifications import FlankForm, TipRelief
from validation.cases import reference_static
from validation.rows import Row, at_most, within

TORQUE = 100.0
STATICS = "elementary statics"


def _walk(*, torque=TORQUE, positions=16, pins=None, forms=None, supports=None):
    """Mesh cycle of the reference set with pin errors (N, 2) [m] and other flank forms."""
    static = reference_static()
    deviations = forms or no_deviations(static.planetary_set)
    if pins is not None:
        deviations = replace(deviations, pin_errors=np.asarray(pins, float))
    return walk_mesh_cycle(
        static.planetary_set,
        static.bodies,
        sun_torque=torque,
        positions=positions,
        deviations=deviations,
        supports=supports or Supports(),
    )


@cache
def _plain():
    return _walk()


def sharing() -> tuple[Row, ...]:
    """Floating sun, common errors, bearings: closed forms of the statics."""
    gears = reference_static().planetary_set
    pins = [[3e-6, 6e-6], [-2e-6, 0.0], [0.0, -4e-6]]
    floating = _walk(pins=pins, supports=Supports(sun=0.0))
    common, error = _walk(pins=[[0.0, 7e-6]] * 3), 7e-6
    alpha = gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring
    bearing = 3e8
    soft = _walk(supports=Supports(planet=bearing))
    on_planet, on_ring = np.split(mesh_normals(gears), 2)
    given_way = _plain().force[0].mean() * ((on_planet[0] - on_ring[0]) ** 2).sum() / bearing
    name = "floating sun, three planets, unequal pin errors: largest departure from 1/3"
    return (
        at_most("L", STATICS, name, 1e-9, np.abs(floating.load_share - 1 / 3).max()),
        within(
            "pins",
            STATICS,
            "7 um tangential error of every pin: rotation of the sun [um]",
            1e6 * error * (np.cos(alpha[0]) + np.cos(alpha[1])),
            1e6 * (common.sun_arc - _plain().sun_arc).mean(),
            1e-6,
        ),
        within(
            "bearings",
            STATICS,
            "planet bearings of 3e8 N/m: further rotation of the sun [um]",
            1e6 * given_way,
            1e6 * (soft.sun_arc - _plain().sun_arc).mean(),
            1e-6,
        ),
    )


def relief() -> tuple[Row, ...]:
    """Tip relief made for one torque; reversal of torque and errors."""
    gears = reference_static().planetary_set
    begin, end = mesh_pairs(gears)[0].path
    forms = _tip_relief(gears, 3.9e-6, 0.9 * (end - begin - gears.base_pitch))
    rows = []
    ratio = {
        t: np.ptp(_walk(torque=t, positions=64, forms=forms).deflection[0])
        / np.ptp(_walk(torque=t, positions=64).deflection[0])
        for t in (50.0, 100.0, 200.0)
    }
    name = "tip relief of 3.9 um made for 100 N m: STE peak to peak over that without relief"
    rows.append(at_most("relief", "Harris map", f"{name}, 100 N m", 0.25, ratio[100.0]))
    for torque in (50.0, 200.0):
        rows.append(at_most("relief", "Harris map", f"100 N m over {torque:g} N m", 1.0, ratio[100.0] / ratio[torque]))
    pins = np.array([[2e-6, 5e-6], [-1e-6, 0.0], [3e-6, -2e-6]])
    record = _walk(pins=pins)
    two = _walk(torque=-TORQUE, pins=pins[[0, 2, 1]] * np.array([1.0, -1.0]))
    turned = two.force[[0, 2, 1, 3, 5, 4]][:, -np.arange(16) % 16]
    error = np.abs(turned - record.force).max() / record.force.max()
    rows.append(at_most("reversal", "mirror image", "-100 N m with mirrored errors: forces, relative", 1e-9, error))
    return tuple(rows)


def rigid_relief() -> tuple[Row, ...]:
    """Linear tip relief of gears of 1e5 times the modulus of steel: their transmission error."""
    gears = reference_static().planetary_set
    stiff, amount = Material(206e14, 0.3, 7850.0), 8e-6
    bodies = make_bodies(make_sectors(gears, stiff, flank_elements=12), stiff)
    begin, end = mesh_pairs(gears)[0].path
    double = end - begin - gears.base_pitch
    forms = _tip_relief(gears, amount, double)
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=1.0, positions=32, deviations=forms)
    expected = _rigid_error(gears, cycle.position, amount, double)
    name = "linear tip relief of 8 um, gears 1e5 times as stiff as steel: "
    source = "flanks of rigid gears to second order"
    worst = np.abs(cycle.deflection[0] - expected).max() / amount
    ours, exact = (1e6 * np.ptp(value) for value in (cycle.deflection[0], expected))
    return (
        at_most("relief", source, name + "largest error of the STE over the relief", 5e-4, worst),
        within("relief", source, name + "STE peak to peak [um]", exact, ours, 5e-4),
    )


def _rigid_error(gears, position, amount: float, length: float) -> np.ndarray:
    """Smallest separation of all pairs of rigid flanks with linear tip relief [m].

    A relief with the slope s over the arc of a flank moves the contact by ``x = s R`` off the line of action
    (R the relative radius of curvature), at most to where the relief begins: it gains ``s x - x^2/(2 R)``.
    """
    pair = mesh_pairs(gears)[0]
    begin, end = pair.path
    zeta = gears.base_pitch * (position[:, None] + np.arange(-3, 4))
    rho = np.stack([pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - zeta])
    base = np.array([pair.base_radius_1, pair.base_radius_2])[:, None, None]
    depth = np.maximum(np.stack([zeta - (end - length), begin + length - zeta]), 0.0)
    radius = rho[0] * rho[1] / rho.sum(axis=0)
    slope = amount / length * base / rho
    x = np.minimum(slope * radius, depth * rho / base)
    separation = (amount / length * depth - slope * x + 0.5 * x**2 / radius).sum(axis=0)
    return np.where((zeta > begin) & (zeta < end), separation, np.inf).min(axis=1)


def _tip_relief(gears, amount: float, length: float):
    """Linear tip relief of sun and planets over a stretch of the path of contact [m]."""
    pair = mesh_pairs(gears)[0]
    begin, end = pair.path
    return replace(
        no_deviations(gears),
        sun=FlankForm((TipRelief(amount, pair.pitch_roll_1 + end - length),)),
        planet_sun_side=FlankForm((TipRelief(amount, pair.pitch_roll_2 - begin - length),)),
    )
