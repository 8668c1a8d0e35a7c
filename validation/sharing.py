"""Load sharing under pin errors with linear meshes: closed form and lumped models.

The meshes are springs of constant stiffness, one candidate each; separations, supports and the solution
are those of the contact problem of a set.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.contact.solve import solve_contact
from femgear.contact.supports import Supports, moving_members
from femgear.gears.deviations import body_separation, no_deviations
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, equal_planet_angles
from femgear.gears.profile import BasicRack
from validation import independent
from validation.rows import Row, within

ALPHA = math.radians(24.6)
MESH = 5e8
CLOSED = "F = W/N - 2 k_path cos(alpha) (e - fit of e by 1, cos psi, sin psi)"
PARKER = f"gears of Lin and Parker 1999, {independent.SOURCE}"
# rounding of two linear systems
ROUNDING = 1e-9


def linear_set(planets: int) -> PlanetarySet:
    """Unshifted gears whose two meshes have the working pressure angle 24.6 degrees."""
    # the tooth numbers matter in no force: every planet sits at an assembly position
    teeth = 6 * planets

    rack = BasicRack(root_radius=0.2)

    def gear(z, rim, internal=False):
        return Gear(z, 1e-3, ALPHA, 0.0, 0.02, rim, internal=internal, rack=rack)

    outer = 1e-3 * (1.5 * teeth + 5)
    return PlanetarySet(
        gear(teeth, 1e-3),
        gear(teeth, 1e-3),
        gear(3 * teeth, outer, internal=True),
        centre_distance=1e-3 * teeth,
        planet_angles=equal_planet_angles(planets),
    )


def linear_forces(errors, *, total: float, supports: Supports) -> np.ndarray:
    """Force of every planet [N] with meshes of 5e8 N/m.

    Parameters
    ----------
    errors : (N,) array
        Tangential pin errors, positive where the planet lags behind the load [m].
    total : float
        Sum of the sun's mesh forces [N].
    supports : Supports
    """
    N = len(errors)
    gears = linear_set(N)
    pins = np.column_stack([np.zeros(N), errors])
    gap = body_separation(replace(no_deviations(gears), pin_errors=pins), gears, np.zeros(1))[:, 0]
    members = moving_members(gears, supports)
    free = members.approach[:, members.free]
    compliance = np.eye(2 * N) / MESH + members.compliance
    load = np.zeros(N + 1 + free.shape[1])
    load[N] = total
    state = solve_contact(compliance, gap, np.hstack([gears.rotation_approach, free]), load)
    return state.loads[:N]


def closed_form(errors, *, total: float, bearing: float, floating: bool) -> np.ndarray:
    """The same in closed form, all planets loaded, ring and carrier rigid.

    In a path of three springs, ``1/k_path = 2/k_mesh + 4 cos^2(alpha)/k_bearing``, a tangential error e is a
    gap ``2 e cos(alpha)``. A fixed sun turns with the mean of the errors; a floating one also moves with
    their first harmonics around the set, and only what is left changes the forces.
    """
    errors = np.asarray(errors, float)
    psi = 2.0 * np.pi * np.arange(len(errors)) / len(errors)
    basis = np.column_stack([np.ones_like(psi), np.cos(psi), np.sin(psi)])[:, : 3 if floating else 1]
    left = errors - basis @ np.linalg.lstsq(basis, errors, rcond=None)[0]
    cosine = math.cos(ALPHA)
    path = 1.0 / (2.0 / MESH + 4.0 * cosine**2 / bearing)
    return total / len(errors) - 2.0 * path * cosine * left


def pin_errors() -> tuple[Row, ...]:
    """L: shares of three and four planets on a fixed or floating sun."""
    total, bearing, error, rows = 20e3, 1e8, -20e-6, []
    for planets, floating in ((3, True), (3, False), (4, True), (4, False)):
        errors = np.zeros(planets)
        errors[0] = error
        ours = linear_forces(errors, total=total, supports=Supports(sun=0.0 if floating else None, planet=bearing))
        expected = closed_form(errors, total=total, bearing=bearing, floating=floating)
        net = independent.lin_parker(planets, pin=bearing, sun_support=0.0)
        held = ("ring", "carrier") + (() if floating else (("sun", 0), ("sun", 1)))
        other = independent.sun_forces(net, total * 0.5 * 0.07742, errors, held=held)
        name = f"{planets} planets, {'floating' if floating else 'fixed'} sun, pin 1 ahead by 20 um: "
        for n in (0, 1):
            quantity = f"{name}share of planet {n + 1}"
            rows.append(within("L", CLOSED, quantity, expected[n] / total, ours[n] / total, 1e-6))
            rows.append(within("L", PARKER, quantity, other[n] / total, ours[n] / total, ROUNDING))
    several = np.array([-20e-6, 5e-6, 0.0, 12e-6])
    ours = linear_forces(several, total=total, supports=Supports(sun=0.0, planet=bearing))
    expected = closed_form(several, total=total, bearing=bearing, floating=True)
    error = np.abs(ours / expected - 1).max()
    name = "4 planets, floating sun, errors of -20, 5, 0, 12 um: largest difference of a force, relative"
    rows.append(within("L", CLOSED, name, 0.0, error, 1e-6))
    return tuple(rows)


def lumped_sets() -> tuple[Row, ...]:
    """F6: 2 um tangential error on planet 1, pin bearings of 1e9 N/m, 2583.3118 N on the sun."""
    total, bearing, rows = 2583.3118, 1e9, []
    note = "what is rigid there stands on 1e12 N/m"
    for planets, sun in ((3, 0.0), (3, 1e9), (4, 1e9), (4, 0.0)):
        errors = np.zeros(planets)
        errors[0] = 2e-6
        held = Supports(sun=sun, planet=bearing, carrier=1e12, ring=1e12)
        ours = linear_forces(errors, total=total, supports=held)
        stiff = {"others": 1e12, "ring_turn": 1e12, "carrier_turn": 1e12}
        net = independent.lin_parker(planets, pin=bearing, sun_support=sun, **stiff)
        other = independent.sun_forces(net, total * 0.5 * 0.07742, errors, held=())
        support = "sun on 1e9 N/m" if sun else "floating sun"
        for n in range(2 if planets == 3 else 3):
            quantity = f"{planets} planets, {support}, pin 1 behind by 2 um: force of planet {n + 1} [N]"
            rows.append(within("F6", PARKER, quantity, other[n], ours[n], ROUNDING, note=note))
    for planets in (4, 5):
        errors = np.zeros(planets)
        errors[0] = 2e-6
        ours = linear_forces(errors, total=total, supports=Supports(sun=0.0, planet=bearing))
        net = independent.lin_parker(planets, pin=bearing, sun_support=0.0)
        other = independent.sun_forces(net, total * 0.5 * 0.07742, errors)
        quantity = f"{planets} planets, floating sun, pin 1 behind by 2 um: load sharing factor"
        factor, reference = (planets * forces.max() / total for forces in (ours, other))
        rows.append(within("F6", PARKER, quantity, reference, factor, ROUNDING))
    return tuple(rows)
