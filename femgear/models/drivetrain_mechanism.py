"""Motions of a drivetrain that nothing holds, whatever the sizes of its springs and inertias."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.models.drivetrain import DrivetrainModel, drivetrain_model
from femgear.models.drivetrain_data import ChainBearing, ChainShaft, Drivetrain, MeshWave

# Stiffness of a motion over that of its coordinates alone; a chain of 1500 coordinates keeps 1e-10.
_NOTHING = 1e-12
_MOVED, _NAMED = 1e-3, 6


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
    count = int(np.count_nonzero(linalg.eigvalsh(scaled) < _NOTHING))
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
