"""For tests of drivetrains: torsional matrices written down by hand, small models, meshes on held axes."""

import math

import numpy as np
from published.wind_turbine_drivetrain import wind_turbine_drivetrain

from femgear.system.force_laws import positive_part
from femgear.trains.drivetrain.model import DrivetrainModel, drivetrain_model
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    MeshSection,
    ParallelSection,
)

PAIR_RADII, PAIR_INERTIAS = (0.05, 0.1), (0.2, 0.9)


def held_pair(*, stiffness=2e8, damping=0.0, backlash=math.inf, harmonics=0, teeth=20) -> DrivetrainModel:
    """Two wheels on held axes: one mesh of mean stiffness [N/m], one elastic coordinate."""
    mesh = MeshSection.in_si(stiffness=stiffness, contact_ratio=1.5, low_share=0.8, phase=0.0, backlash=backlash)
    train = Drivetrain(
        tuple(
            BodySection.in_si(name=name, mass=10.0, inertia=inertia, tilts=False)
            for name, inertia in zip("ab", PAIR_INERTIAS)
        ),
        parallel=(ParallelSection.in_si(between=("a", "b"), teeth=(teeth, teeth), radii=PAIR_RADII, mesh=mesh),),
        bearings=tuple(BearingSection.in_si(body=name, radial=math.inf) for name in "ab"),
        gravity=0.0,
        damping_ratio=damping,
    )
    return drivetrain_model(train, harmonics=harmonics)


def planetary_stage(**changes) -> Drivetrain:
    """The planetary stage of the published drivetrain alone, in bearings."""
    train = wind_turbine_drivetrain()
    bodies = tuple(b.changed(tilts=False) for b in train.bodies if b.name in ("carrier", "sun"))
    bearings = (
        BearingSection.in_si(body="carrier", radial=2e8),
        BearingSection.in_si(body="sun", radial=3e7),
    )
    return Drivetrain(bodies, planetary=(train.planetary[0].changed(**changes),), bearings=bearings, gravity=0.0)


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
                at[number] = len(names) + np.arange(len(stage.angles))
                names += [f"{prefix} {p + 1}: rotation" for p in range(len(stage.angles))]
    M, K = np.zeros((2, len(names), len(names)))
    for body in train.bodies:
        M[at[body.name], at[body.name]] += body.inertia
    for shaft in train.shafts:
        ends = [at[name] for name in shaft.between]
        K[np.ix_(ends, ends)] += shaft.springs.torsion * np.array([[1.0, -1.0], [-1.0, 1.0]])
    spin = _senses(train)
    columns = []
    for number, stage in enumerate(train.planetary):
        (radius, planet), cosine = stage.pitch_radii, math.cos(stage.pressure_angle)
        sense = stage.flank * spin[stage.carrier]
        c, s, planets = at[stage.carrier], at[stage.sun], at[number]
        M[c, c] += len(planets) * stage.planet_mass * stage.axis_distance**2
        sun, ring = np.zeros((2, len(planets), len(names)))
        for p, place in enumerate(planets):
            M[place, place] += stage.planet_inertia
            # the pin pushes the planet: its flanks approach sun and ring ahead of it
            sun[p, [c, s, place]] = stage.axis_distance, -radius, -planet
            ring[p, [c, place]] = stage.axis_distance, planet
        columns += list(sense * cosine * sun) + list(sense * cosine * ring)
    for stage in train.parallel:
        row = np.zeros(len(names))
        row[[at[name] for name in stage.between]] = stage.pitch_radii
        lean = math.hypot(1.0, math.tan(stage.helix_angle) * math.cos(stage.pressure_angle))
        columns.append(stage.flank * spin[stage.between[0]] * math.cos(stage.pressure_angle) / lean * row)
    return M, K, np.array(columns).reshape(-1, len(names)).T, tuple(names)


def _senses(train: Drivetrain) -> dict[str, float]:
    """Sense of rotation of every body, the first one positive: external gears turn it round."""
    sense = {train.bodies[0].name: 1.0}
    links = [(*one.between, 1.0) for one in train.shafts]
    links += [(*one.between, -1.0) for one in train.parallel]
    links += [(one.carrier, one.sun, 1.0) for one in train.planetary]
    for _ in train.bodies:
        for first, second, factor in links:
            if first in sense:
                sense.setdefault(second, factor * sense[first])
            elif second in sense:
                sense[first] = factor * sense[second]
    return sense


def mesh_force(x, k, backlash, *, separates: bool) -> tuple[np.ndarray, np.ndarray]:
    """Force and tangent of meshes with the stiffness k at the approach x; drive side from ``x = 0`` on.

    The back side is that of gears whose axes keep their distance: its approach is -x.
    """
    if not separates:
        return k * x, np.broadcast_to(k, np.shape(x))
    drive, closed = positive_part(x)
    back, behind = positive_part(-x - backlash)
    return k * (drive - back), k * (closed + behind)
