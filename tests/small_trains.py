"""Trains that tests share: stages in series, gear pairs."""

import math
import tomllib
from dataclasses import replace

import numpy as np
from published.multistage_example import CASES

from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from femgear.system.system import MechanicalSystem
from femgear.trains.impacts.model import ImpactPair
from femgear.trains.multistage.model import PlanetaryStage, in_series

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
        sun_radius=sun,
        ring_radius=ring,
        planet_radius=planet,
        centre_distance=distance,
        planet_angles=angles,
        pressure_angle_sun_planet=alpha,
        pressure_angle_planet_ring=alpha,
        **values | changes,
    )


def stage(teeth, module=4e-3, *, fixed="ring", phases=None, angle=0.0, **changes):
    """With torsional supports moved to the fixed member."""
    data = closed_set(teeth, module, **changes)
    if fixed != "ring":
        held = {"ring": replace(data.ring, torsional_support=0.0)}
        if fixed is not None:
            held[fixed] = replace(getattr(data, fixed), torsional_support=1e7)
        data = replace(data, **held)
    return PlanetaryStage(data=data, teeth=teeth, fixed=fixed, phases=phases, angle=angle)


def two_stages(*, torsional=3e5, lateral=1e8, **options):
    """20/20/60 (mesh frequency four times that of the second) and 20/20/60, of two modules."""
    one = stage((20, 20, 60), 3e-3, phases=np.arange(6) / 3.0 % 1.0, **options)
    other = stage((20, 20, 60), 5e-3, phases=(0.0, 2 / 3, 1 / 3, 0.5, 1 / 6, 5 / 6), angle=0.4)
    return in_series([one, other], torsional=torsional, lateral=lateral)


def published_table():
    """Rows of the published four-stage table by stage, in its units: kg, mm, kg mm^2, N/mm."""
    rows = []
    for one in tomllib.loads((CASES / "published_four_stages.toml").read_text(encoding="utf-8"))["stage"]:
        texts = {
            f"{name} {entry}": one[name][entry]
            for name in ("sun", "planet", "carrier")
            for entry in ("mass", "inertia")
        }
        texts |= dict(zip(("sun base radius", "planet base radius"), (one["radii"]["sun"], one["radii"]["planet"])))
        stiffness = one["radii"]["mesh_stiffness"]
        texts["external mesh stiffness"] = stiffness["sun_planet"]
        texts["internal mesh stiffness"] = stiffness["planet_ring"]
        rows.append({name: float(text.split()[0]) for name, text in texts.items()})
    return rows


def equivalent_mass(inertia, base_radius):
    """Mass [kg] of two gears that moves along their line of action."""
    (one, other), (first, second) = inertia, base_radius
    return one * other / (first**2 * other + second**2 * one)


def gear_pair(inertia, base_radius, *, torque=0.0, mesh_damping=0.0):
    """Two gears on rigid shafts (Kahraman and Singh 1990); the rotation in their ratio is free."""
    column = np.array([[base_radius[0]], [-base_radius[1]]])
    return MechanicalSystem(
        M=np.diag(inertia),
        C=mesh_damping * (column @ column.T),
        K=np.zeros((2, 2)),
        W=column,
        load=torque / base_radius[0] * column[:, 0],
        dofs=("theta_1", "theta_2"),
    )


def example_pair(damping_ratio):
    """The pair of cases/gear_pair.toml without dimensions."""
    return ImpactPair(damping_ratio=damping_ratio, load=0.9, tooth_error=(0.72,), stiffness=(-0.1,))


def lightly_loaded_pair(damping_ratio=0.05):
    """The pair of cases/gear_pair_light.toml without dimensions."""
    return ImpactPair(damping_ratio=damping_ratio, load=0.1, tooth_error=(0.2,))


def level_crossings(parameter, value, level):
    """Parameters at which a quantity along a curve passes a level, by linear interpolation."""
    parameter, away = np.asarray(parameter, float), np.asarray(value, float) - level
    i = np.flatnonzero(np.signbit(away[:-1]) != np.signbit(away[1:]))
    share = away[i] / (away[i] - away[i + 1])
    return parameter[i] + share * (parameter[i + 1] - parameter[i])
