"""Relief, errors and moving members of the reference set against closed forms and against one another."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from femgear.contact.assembly import mesh_pairs
from femgear.contact.mirrored import walk_either_flank
from femgear.contact.supports import Supports, force_directions
from femgear.gears.deviations import no_deviations
from femgear.gears.iso6336_stress import nominal_contact_stress
from femgear.gears.modifications import FlankForm, TipRelief
from femgear.validation.planetary import nrel_set
from femgear.validation.reference import reference_static
from femgear.validation.rows import Row, at_most, printed, within

TORQUE = 100.0
STATICS = "elementary statics"


def _walk(*, torque=TORQUE, positions=16, pins=None, forms=None, supports=None):
    """Mesh cycle of the reference set with pin errors (N, 2) [m] and other flank forms."""
    static = reference_static()
    deviations = forms or no_deviations(static.planetary_set)
    if pins is not None:
        deviations = replace(deviations, pin_errors=np.asarray(pins, float))
    return walk_either_flank(
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
    on_planet, on_ring = force_directions(gears)
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
    pair = mesh_pairs(gears)[0]
    begin, end = pair.path
    double = 0.9 * (end - begin - gears.base_pitch)
    forms = replace(
        no_deviations(gears),
        sun=FlankForm((TipRelief(3.9e-6, pair.pitch_roll_1 + end - double),)),
        planet_sun_side=FlankForm((TipRelief(3.9e-6, pair.pitch_roll_2 - begin - double),)),
    )
    rows = []
    ratio = {
        t: np.ptp(_walk(torque=t, positions=64, forms=forms).deflection[0])
        / np.ptp(_walk(torque=t, positions=64).deflection[0])
        for t in (50.0, 100.0, 200.0)
    }
    name = "tip relief of 3.9 um made for 100 N m: STE peak to peak over that without relief"
    rows.append(at_most("relief", "Harris map", f"{name}, 100 N m", 0.25, ratio[100.0]))
    for torque in (50.0, 200.0):
        rows.append(
            at_most("relief", "Harris map", f"100 N m over {torque:g} N m", 1.0, ratio[100.0] / ratio[torque])
        )
    pins = np.array([[2e-6, 5e-6], [-1e-6, 0.0], [3e-6, -2e-6]])
    one = _walk(pins=pins)
    two = _walk(torque=-TORQUE, pins=pins[[0, 2, 1]] * np.array([1.0, -1.0]))
    turned = two.force[[0, 2, 1, 3, 5, 4]][:, -np.arange(16) % 16]
    error = np.abs(turned - one.force).max() / one.force.max()
    rows.append(
        at_most("reversal", "mirror image", "-100 N m with mirrored errors: forces, relative", 1e-9, error)
    )
    return tuple(rows)


def nominal_stress() -> tuple[Row, ...]:
    """Nominal flank stress of a published gear report."""
    s, force = nrel_set(), 285900.438
    rows = []
    for name, pair, angle, ratio, reference in (
        (
            "sun-planet",
            (s.sun, s.planet),
            s.working_pressure_angle_sun_planet,
            s.contact_ratio_sun_planet,
            "573.40",
        ),
        (
            "planet-ring",
            (s.planet, s.ring),
            s.working_pressure_angle_planet_ring,
            s.contact_ratio_planet_ring,
            "312.44",
        ),
    ):
        ours = nominal_contact_stress(
            *pair,
            working_angle=angle,
            contact_ratio=ratio,
            tangential_force=force,
            youngs_modulus=206e9,
            poisson_ratio=0.3,
        )
        words = f"nominal contact stress sigma_H0 of {name} [MPa]"
        rows.append(
            printed(
                "D6",
                "KISSsoft report of the NREL 5 MW gearbox",
                words,
                reference,
                ours.stress * 1e-6,
                digits=6.0,
            )
        )
    return tuple(rows)
