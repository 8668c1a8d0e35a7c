"""Which body of every gear stage drives under given torques, and with it the loaded flanks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_coordinates import coordinates_of, rigid_rotation
from femgear.models.drivetrain_data import Drivetrain
from femgear.models.drivetrain_start import static_deviations
from femgear.models.drivetrain_torque import TorqueHistory
from femgear.models.drivetrain_torsional import torsional_model

# Force of a mesh, over the sum of what the single torques would give, that is rounding.
_NOTHING = 1e-6
# Torsional stiffness that stands for a rigid shaft, over that of the stiffest mesh.
_RIGID = 1e3


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
    return np.where(np.abs(total) > _NOTHING * np.abs(sums).sum(axis=1), total * default, 0.0)


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
