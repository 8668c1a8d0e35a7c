"""Trains that the tests of stages in series share."""

import math
from dataclasses import replace

import numpy as np

from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from femgear.trains.multistage.model import Stage, in_series

EVEN = 2.0 * np.pi * np.arange(3) / 3


def closed_set(teeth, module=4e-3, *, angles=EVEN, **changes):
    """Set whose radii belong to its teeth."""
    alpha = math.radians(20.0)
    sun, planet, ring = (0.5 * module * z * math.cos(alpha) for z in teeth)
    distance = 0.5 * module * (teeth[0] + teeth[1])
    values = {
        "sun": PlanarBody(2.0, 1.5 * sun**2, support=1e7),
        "ring": PlanarBody(9.0, 9.0 * ring**2, support=3e8, torsional_support=4e8 * ring**2),
        "carrier": PlanarBody(12.0, 8.0 * distance**2, support=2e8),
        "planet": PlanarBody(1.7, 1.1 * planet**2),
        "stiffness_sun_planet": 4e8,
        "stiffness_planet_ring": 6e8,
        "planet_bearing": 2e8,
    }
    return PlanarSet(
        sun_radius=sun, ring_radius=ring, planet_radius=planet,
        centre_distance=distance, planet_angles=angles,
        pressure_angle_sun_planet=alpha, pressure_angle_planet_ring=alpha, **values | changes,
    )  # fmt: skip


def stage(teeth, module=4e-3, *, fixed="ring", phases=None, angle=0.0, **changes):
    """With torsional supports moved to the fixed member."""
    data = closed_set(teeth, module, **changes)
    if fixed != "ring":
        held = {"ring": replace(data.ring, torsional_support=0.0)}
        if fixed is not None:
            held[fixed] = replace(getattr(data, fixed), torsional_support=1e7)
        data = replace(data, **held)
    return Stage(data=data, teeth=teeth, fixed=fixed, phases=phases, angle=angle)


def two_stages(*, torsional=3e5, lateral=1e8, **options):
    """20/20/60 (mesh frequency four times that of the second) and 20/20/60, of two modules."""
    one = stage((20, 20, 60), 3e-3, phases=np.arange(6) / 3.0 % 1.0, **options)
    other = stage((20, 20, 60), 5e-3, phases=(0.0, 2 / 3, 1 / 3, 0.5, 1 / 6, 5 / 6), angle=0.4)
    return in_series([one, other], torsional=torsional, lateral=lateral)
