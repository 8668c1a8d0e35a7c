"""The purely torsional counterpart of a drivetrain: one rotation a body and a planet.

A. Kahraman, J. Sound Vib. 173, 1994, 125-130, for the planetary stage; W. Shi, C.-W. Chung and others, Int.
J. Precis.
Eng. Manuf. 14, 2013, model wind turbine drivetrains so. The matrices are written down here and do not come
from
those of `femgear.models.drivetrain`, which must turn into them when shafts cannot bend nor bodies move.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.models.drivetrain import DrivetrainModel, drivetrain_model
from femgear.models.drivetrain_data import ChainBearing, Drivetrain


def held_train(train: Drivetrain) -> Drivetrain:
    """The same data with every axis held: no translation, no tilt, shafts that only twist, no weight."""
    bodies = tuple(replace(one, tilts=False) for one in train.bodies)
    bearings = tuple(ChainBearing(one.name, math.inf) for one in train.bodies)
    planetary = tuple(replace(one, planet_bearing=math.inf) for one in train.planetary)
    twist = tuple(replace(b, radial=0.0, tilt=0.0, offset=0.0) for b in train.bearings if b.torsion)
    return replace(train, bodies=bodies, bearings=bearings + twist, planetary=planetary, gravity=0.0)


def torsional_model(train: Drivetrain, **options) -> DrivetrainModel:
    """Model of `held_train`, for the same solvers; options as for `drivetrain_model`."""
    return drivetrain_model(held_train(train), **options)


def torsional_matrices(train: Drivetrain) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Mass and shaft stiffness (n, n), mesh columns (n, n_meshes) [m], names of the coordinates.

    Shafts without elements. The approach of a mesh is the sum of base radius times rotation of its gears,
    with the signs of the loaded flanks.
    """
    names, at = [], {}
    for body in train.bodies:
        at[body.name] = len(names)
        names.append(f"{body.name}: rotation")
        for number, stage in enumerate(train.planetary):
            if stage.carrier == body.name:
                prefix = "planet" if len(train.planetary) == 1 else f"planet of {body.name}"
                at[number] = len(names) + np.arange(len(stage.planet_angles))
                names += [f"{prefix} {p + 1}: rotation" for p in range(len(stage.planet_angles))]
    M, K = np.zeros((2, len(names), len(names)))
    for body in train.bodies:
        M[at[body.name], at[body.name]] += body.inertia
    for shaft in train.shafts:
        ends = [at[shaft.first], at[shaft.second]]
        K[np.ix_(ends, ends)] += shaft.springs.torsion * np.array([[1.0, -1.0], [-1.0, 1.0]])
    for bearing in train.bearings:
        K[at[bearing.body], at[bearing.body]] += bearing.torsion
    spin = _senses(train)
    columns = []
    for number, stage in enumerate(train.planetary):
        cosine, sense = math.cos(stage.pressure_angle), stage.flank * spin[stage.carrier]
        c, s, planets = at[stage.carrier], at[stage.sun], at[number]
        M[c, c] += len(planets) * stage.planet_mass * stage.centre_distance**2
        sun, ring = np.zeros((2, len(planets), len(names)))
        for p, place in enumerate(planets):
            M[place, place] += stage.planet_inertia
            # the pin pushes the planet: its flanks approach sun and ring ahead of it
            sun[p, [c, s, place]] = stage.centre_distance, -stage.sun_radius, -stage.planet_radius
            ring[p, [c, place]] = stage.centre_distance, stage.planet_radius
        columns += list(sense * cosine * sun) + list(sense * cosine * ring)
    for stage in train.parallel:
        row = np.zeros(len(names))
        row[[at[stage.first], at[stage.second]]] = stage.first_radius, stage.second_radius
        lean = math.hypot(1.0, math.tan(stage.helix_angle) * math.cos(stage.pressure_angle))
        columns.append(stage.flank * spin[stage.first] * math.cos(stage.pressure_angle) / lean * row)
    return M, K, np.array(columns).reshape(-1, len(names)).T, tuple(names)


def _senses(train: Drivetrain) -> dict[str, float]:
    """Sense of rotation of every body, the first one positive: external gears turn it round."""
    sense = {train.bodies[0].name: 1.0}
    links = [(one.first, one.second, 1.0) for one in train.shafts]
    links += [(one.first, one.second, -1.0) for one in train.parallel]
    links += [(one.carrier, one.sun, 1.0) for one in train.planetary]
    for _ in train.bodies:
        for first, second, factor in links:
            if first in sense:
                sense.setdefault(second, factor * sense[first])
            elif second in sense:
                sense[first] = factor * sense[second]
    return sense
