"""Checks of a drivetrain: loose motions, frequencies that lie too far apart, and which body drives a stage.

A motion that nothing holds is found whatever the sizes of springs and inertias; natural frequencies may not
lie further apart than double precision resolves beside the free spin. The driver of every gear stage, and
with it the loaded flanks, follows from statics under the given torques.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.trains.drivetrain.data import ChainBearing, ChainShaft, Drivetrain, MeshWave, TorqueHistory
from femgear.trains.drivetrain.model import (
    DrivetrainModel,
    coordinates_of,
    drivetrain_model,
    rigid_rotation,
    torsional_model,
)
from femgear.trains.drivetrain.section import DrivetrainCase
from femgear.trains.drivetrain.time import static_deviations

# Stiffness of a motion over that of its coordinates alone; a chain of 1500 coordinates keeps 1e-10.
_NOT_RESISTED = 1e-12
# Share of the largest motion that counts as moved, and coordinates that are named.
_MOVED, _NAMED = 1e-3, 6

# Force of a mesh, over the sum of what the single torques would give, that is rounding.
_NO_FORCE = 1e-6
# Torsional stiffness that stands for a rigid shaft, over that of the stiffest mesh.
_RIGID = 1e3


def loose_motions(train: Drivetrain, *, turning: bool = True) -> tuple[int, tuple[str, ...]]:
    """Number of motions besides the free spin that no spring resists, and what moves most in them.

    Whether a motion is resisted does not depend on how stiff the springs are. Therefore all of them get like
    stiffnesses, 1 N/m across and 1 N/m times a length squared against rotation; the coordinates are scaled by
    their own stiffness, ``D K D`` with ones on the diagonal, and what is left is a matter of rank (null space
    of the stiffness: M. Geradin and D. J. Rixen, Mechanical Vibrations, 3rd ed., section 2.9).

    Parameters
    ----------
    train : Drivetrain
    turning : bool
        As of `drivetrain_model`.

    Returns
    -------
    count : int
    names : tuple of str
        Coordinates of those motions, the largest first, rotations last.

    Raises
    ------
    CaseError
        As `drivetrain_model`.
    """
    from scipy import linalg

    model = drivetrain_model(_like_springs(train), harmonics=1, turning=turning)
    system = model.system
    stiffness = system.K + (system.W * model.mean_stiffness) @ system.W.T
    own = np.diag(stiffness)
    size = np.sqrt(np.where(own > 0.0, own, 1.0))
    # the spin is known, and held
    spin = model.rigid * size
    scaled = stiffness / np.outer(size, size) + np.outer(spin, spin) / (spin @ spin)
    count = int(np.count_nonzero(linalg.eigvalsh(scaled) < _NOT_RESISTED))
    if not count:
        return 0, ()
    return count, _names(train, model, linalg.eigh(scaled, subset_by_index=(0, count - 1))[1])


def _names(train: Drivetrain, model: DrivetrainModel, motions) -> tuple[str, ...]:
    """Coordinates of bodies before those of planets and shaft stations, rotations last."""
    size, bodies = np.abs(motions).max(axis=1), {body.name for body in train.bodies}
    order = [i for i in np.argsort(-size, kind="stable") if size[i] > _MOVED * size.max()]
    names = [model.system.dofs[i] for i in order]
    return tuple(
        sorted(names, key=lambda n: (n.endswith("rotation"), n.split(":")[0] not in bodies))[:_NAMED]
    )


def _like_springs(train: Drivetrain) -> Drivetrain:
    """The chain with springs that are all alike, without weight and damping."""
    lengths = [one.length for one in train.shafts]
    lengths += [one.first_radius for one in train.parallel] + [one.sun_radius for one in train.planetary]
    arm = math.exp(np.mean(np.log(lengths))) if lengths else 1.0
    return replace(
        train,
        shafts=tuple(_shaft(one, arm) for one in train.shafts),
        parallel=tuple(replace(one, mesh=_mesh(one.mesh)) for one in train.parallel),
        planetary=tuple(
            replace(
                one,
                sun_mesh=_mesh(one.sun_mesh),
                ring_mesh=_mesh(one.ring_mesh),
                planet_bearing=_unit(one.planet_bearing),
            )
            for one in train.planetary
        ),
        bearings=tuple(_bearing(one, arm) for one in train.bearings),
        gravity=0.0,
        damping_ratio=0.0,
    )


def _unit(stiffness: float, unit: float = 1.0) -> float:
    """The unit in place of a spring that is there and not rigid."""
    return stiffness if stiffness == 0.0 or math.isinf(stiffness) else unit


def _mesh(wave: MeshWave) -> MeshWave:
    return replace(wave, stiffness=1.0)


def _bearing(one: ChainBearing, arm: float) -> ChainBearing:
    return replace(
        one, radial=_unit(one.radial), tilt=_unit(one.tilt, arm**2), torsion=_unit(one.torsion, arm**2)
    )


def _shaft(one: ChainShaft, arm: float) -> ChainShaft:
    if not one.elements:
        springs = one.springs
        return replace(
            one, section=None, bending=_unit(springs.bending, arm**2), torsion=_unit(springs.torsion, arm**2),
            shear=_unit(springs.shear),
        )  # fmt: skip
    # a slender shaft of 12 E I / l^3 = 1 N/m
    diameter = 0.1 * one.length
    modulus = one.length**3 / (12.0 * math.pi * diameter**4 / 64.0)
    section = replace(one.section, outer_diameter=diameter, inner_diameter=0.0, young=modulus)
    return replace(one, section=section)


def check_spread(case: DrivetrainCase, train: Drivetrain) -> None:
    """Refuse slow motions that rounding hides beside the free spin.

    Raises
    ------
    CaseError
        E-SPREAD, with the softest support where that is the cause, else with the fastest and the slowest
        coordinate.
    """
    from scipy import linalg

    model = drivetrain_model(replace(train, damping_ratio=0.0), turning=case.simulation.turning)
    n, mass = len(model.rigid), model.system.M
    stiffness = model.system.K + (model.system.W * model.mean_stiffness) @ model.system.W.T
    values = linalg.eigvalsh(stiffness, mass)
    # what the modes take for rigid: a share of a norm, which is up to sqrt(n) above the largest
    share = math.sqrt(n) * max(1e-12, 10.0 * n * np.finfo(float).eps)
    if n == 1 or values[1] > share * values[-1]:
        return
    own = np.sqrt(np.diag(stiffness) / np.diag(mass)) / (2.0 * math.pi)
    fast = int(np.argmax(own))
    factor = f"a factor of {1.0 / math.sqrt(share):.1g}"
    shown = {"code": "E-SPREAD", "limit": f"frequencies within {factor}"}
    words = "natural frequencies are too far apart for double precision: "
    words += f"{model.system.dofs[fast]} by itself has {own[fast]:.3g} Hz, and "
    soft, (place, name), value = _softest(train)
    # a support is the cause where it lies further from the middle than the fastest coordinate does
    if soft * 2.0 * math.pi * own[fast] < (2.0 * math.pi * np.median(own)) ** 2:
        raise CaseError(
            f"{words}{name} on its bearings alone has {soft / (2.0 * math.pi):.3g} Hz, slower by more than "
            f"{factor}",
            key=place, value=value, file=case.location(place), **shown,
            remedy=f"stiffen the bearings of {name}: theirs are the softest",
        )  # fmt: skip
    second = _slowest(model, stiffness)
    names = [body.name for body in case.body]
    members = [name.split(":")[0] for name in (model.system.dofs[fast], second)]
    key = f"body[{names.index(members[0])}]" if members[0] in names else "shaft"
    raise CaseError(
        f"{words}{second} moves slower by more than {factor}", key=key, file=case.location(key), **shown,
        remedy=f"give {members[0]} more mass or inertia or rigid springs, or stiffen what holds {members[1]}",
    )  # fmt: skip


def _slowest(model: DrivetrainModel, stiffness) -> str:
    """Coordinate with most of the kinetic energy of the slowest motion besides the free spin."""
    from scipy import linalg

    mass = model.system.M
    slow = linalg.eigh(stiffness, mass, subset_by_index=(0, 1))[1]
    slow = slow - np.outer(model.rigid, model.rigid @ mass @ slow) / model.inertia
    energy = np.abs(slow * (mass @ slow)).max(axis=1)
    return model.system.dofs[int(np.argmax(energy))]


def _softest(train: Drivetrain) -> tuple[float, tuple[str, str], str]:
    """Slowest body on its own bearings: frequency [rad/s], key and body, stiffness; infinite without any."""
    found = [(math.inf, ("", ""), "")]
    for body in train.bodies:
        places = [i for i, one in enumerate(train.bearings) if one.body == body.name and not one.station]
        inertias = ("radial", body.mass, "N/m"), ("tilt", body.transverse_inertia, "N m/rad")
        for kind, inertia, unit in inertias if body.tilts else inertias[:1]:
            springs = [getattr(train.bearings[i], kind) for i in places]
            if sum(springs) > 0.0:
                first = places[int(np.argmax(springs))]
                speed = math.sqrt(sum(springs) / inertia)
                found.append((speed, (f"bearing[{first}].{kind}", body.name), f"{max(springs):g} {unit}"))
    return min(found)


def with_drivers(train: Drivetrain, torques: Sequence[TorqueHistory], *, duration: float) -> Drivetrain:
    """The drivetrain with the driver of every stage that the torques make drive.

    The torques, as means over the run, and the inertia forces of the acceleration of the free spin that they
    give (d'Alembert's principle) act on the chain with held axes and mean mesh stiffnesses: statics, so that
    the load of parallel paths follows their stiffness. Weight does not count.

    Parameters
    ----------
    train : Drivetrain
        Stages whose driver is given keep it.
    torques : sequence of TorqueHistory
    duration : float
        Of the run [s].

    Returns
    -------
    Drivetrain
        A stage without load on its flanks, and one that its first body (the carrier) drives, stay as they
        are.

    Raises
    ------
    CaseError
        A duration that is not above zero (E-RANGE), a torque on no body (E-DRIVETRAIN), stages that leave no
        single spin (E-KINEMATICS).
    """
    if not (np.isfinite(duration) and duration > 0.0):
        raise CaseError(f"a run of {duration} s", code="E-RANGE", key="duration", limit="above 0 s, finite")
    stages = (*train.planetary, *train.parallel)
    if not torques or all(one.driver is not None for one in stages):
        return train
    force = _stage_forces(train, torques, duration)
    found = [
        replace(one, driver=one.ends[1]) if one.driver is None and value < 0.0 else one
        for one, value in zip(stages, force)
    ]
    planets = len(train.planetary)
    return replace(train, planetary=tuple(found[:planets]), parallel=tuple(found[planets:]))


def speed_ratios(train: Drivetrain) -> dict[str, float]:
    """Speed of every body over that of the first one.

    Raises
    ------
    CaseError
        Stages that leave no single spin (E-KINEMATICS).
    """
    place = coordinates_of(train)
    spin = rigid_rotation(train, place)
    return {name: float(spin[first + 4]) for name, first in place.body.items()}


def mean_torque(history: TorqueHistory, duration: float) -> float:
    """Mean of a torque from 0 to `duration` [N m], exact."""
    inside = history.times[(history.times > 0.0) & (history.times < duration)]
    times = np.concatenate([[0.0], inside, [duration]])
    return float(np.trapezoid(history.at(times), times) / duration)


def _stage_forces(train: Drivetrain, torques: Sequence[TorqueHistory], duration: float) -> np.ndarray:
    """Sum of the mean mesh forces of every stage [N]; zero where they are rounding."""
    model = torsional_model(_elastic(train), harmonics=0, turning=False)
    W, k, carried = model.system.W, model.mean_stiffness, model.system.M @ model.rigid
    force = np.zeros((len(k), len(torques)))
    for column, one in enumerate(torques):
        load = np.zeros(len(carried))
        load[model.index(f"{one.body}: rotation")] = mean_torque(one, duration)
        load -= carried * (model.rigid @ load) / model.inertia
        force[:, column] = k * (W.T @ static_deviations(model, W, k, load))
    sums = np.zeros((len(train.planetary) + len(train.parallel), len(torques)))
    np.add.at(sums, model.geometry.stage, force)
    total = sums.sum(axis=1)
    # the model's flanks are those of the drivers that are given
    default = [one.flank for one in (*train.planetary, *train.parallel)]
    return np.where(np.abs(total) > _NO_FORCE * np.abs(sums).sum(axis=1), total * default, 0.0)


def _elastic(train: Drivetrain) -> Drivetrain:
    """The chain without damping, shafts that do not twist made stiff: a torque may act on either end."""
    meshes = [one.mesh.stiffness * one.first_radius**2 for one in train.parallel]
    meshes += [one.ring_mesh.stiffness * one.ring_radius**2 for one in train.planetary]
    torsion = _RIGID * max(meshes, default=1.0)
    shafts = tuple(
        replace(one, torsion=torsion) if not one.elements and math.isinf(one.springs.torsion) else one
        for one in train.shafts
    )
    return replace(train, shafts=shafts, damping_ratio=0.0)
