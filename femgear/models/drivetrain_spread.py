"""Natural frequencies of a drivetrain case that are too far apart for double precision."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.casefile.drivetrain import DrivetrainCase
from femgear.errors import CaseError
from femgear.models.drivetrain import DrivetrainModel, drivetrain_model
from femgear.models.drivetrain_data import Drivetrain


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
    # what femgear.solvers.modal takes for rigid: a share of a norm, which is up to sqrt(n) above the largest
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
