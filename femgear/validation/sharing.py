"""Load sharing under pin errors with linear meshes: closed form and lumped models.

The meshes are springs of constant stiffness, one candidate each; separations, supports and the solution
are those of the contact problem of a set.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.contact.assembly import rotation_approach
from femgear.contact.solve import solve_contact
from femgear.contact.supports import Supports, moving_members
from femgear.gears import BasicRack, Gear, PlanetarySet, equal_planet_angles
from femgear.gears.deviations import body_separation, no_deviations
from femgear.validation.rows import Row, printed, within

ALPHA = math.radians(24.6)
MESH = 5e8
LUMPED = "independent static solution with 3 (N + 3) coordinates"
CLOSED = "F = W/N - 2 k_path cos(alpha) (e - fit of e by 1, cos psi, sin psi)"
PARKER = "Lin and Parker 1999 gears, independent static solution"


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
    state = solve_contact(compliance, gap, np.hstack([rotation_approach(N), free]), load)
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
    shown = {
        (3, True): ("0.3333", "0.3333"),
        (3, False): ("0.366", "0.317"),
        (4, True): ("0.2623", "0.2377"),
        (4, False): (None, None),
    }
    for (planets, floating), values in shown.items():
        errors = np.zeros(planets)
        errors[0] = error
        ours = linear_forces(
            errors, total=total, supports=Supports(sun=0.0 if floating else None, planet=bearing)
        )
        expected = closed_form(errors, total=total, bearing=bearing, floating=floating)
        name = f"{planets} planets, {'floating' if floating else 'fixed'} sun, pin 1 ahead by 20 um: "
        for n in (0, 1):
            quantity = f"{name}share of planet {n + 1}"
            rows.append(within("L", CLOSED, quantity, expected[n] / total, ours[n] / total, 1e-6))
            if values[n] is not None:
                rows.append(printed("L", LUMPED, quantity, values[n], ours[n] / total))
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
    cases = (
        (3, 0.0, ("861.1039", "861.1039")),
        (3, 1e9, ("585.99", "998.66")),
        (4, 1e9, ("326.18", "770.26", "716.60")),
        (4, 0.0, ("521.39", "770.26", "521.39")),
    )
    for planets, sun, values in cases:
        errors = np.zeros(planets)
        errors[0] = 2e-6
        held = Supports(sun=sun, planet=bearing, carrier=1e12, ring=1e12)
        ours = linear_forces(errors, total=total, supports=held)
        support = "sun on 1e9 N/m" if sun else "floating sun"
        for n, value in enumerate(values):
            quantity = f"{planets} planets, {support}, pin 1 behind by 2 um: force of planet {n + 1} [N]"
            rows.append(printed("F6", PARKER, quantity, value, ours[n], note=note))
    for planets, value in ((4, "1.192677"), (5, "1.311758")):
        errors = np.zeros(planets)
        errors[0] = 2e-6
        ours = linear_forces(errors, total=total, supports=Supports(sun=0.0, planet=bearing))
        quantity = f"{planets} planets, floating sun, pin 1 behind by 2 um: load sharing factor"
        rows.append(printed("F6", PARKER, quantity, value, planets * ours.max() / total))
    return tuple(rows)
