"""Passes of teeth and system in turn: what the next one starts from, and when they have settled.

A pass begins with slopes and separations of the meshes, for which the contact of the teeth is solved, and ends with
those that the system then has. With changes f_k = end_k - start_k of the passes so far the next one starts from

    end_k - sum_j gamma_j (end_{j+1} - end_j),  gamma: least |f_k - sum_j gamma_j (f_{j+1} - f_j)|

(D. G. Anderson, J. ACM 12 (1965) 547-560), where a pass of one mesh alone is the secant method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femgear.trains.gearbox.contact import StageContact, unequal_separation
from femgear.trains.gearbox.model import GearboxModel

# Passes before the last one whose changes count, and the largest gamma: beyond it changes are no straight line.
_MEMORY, _FARTHEST = 2, 4.0
# Part of the largest change below which a direction is rounding.
_RANK = 1e-3


@dataclass(frozen=True)
class MeshPositions:
    """How the flanks of all meshes lie to one another.

    Parameters
    ----------
    slopes : (M,) array
        Slope of the approach along the width [rad], closer at z > 0 positive.
    separations : (M,) array
        How far the flanks are taken apart along the normal [m].
    """

    slopes: np.ndarray
    separations: np.ndarray


@dataclass(frozen=True)
class ContactPass:
    """One pass: the positions for which the contact was solved, ``start``, and those of the system then, ``end``."""

    start: MeshPositions
    end: MeshPositions


def next_start(model: GearboxModel, passes: Sequence[ContactPass]) -> MeshPositions:
    """Extrapolate from passes to the positions that a pass would not change; from one pass to its end."""
    end = passes[-1].end
    latest = passes[-1 - _MEMORY :]
    starts, ends = (np.array([_lengths(model, state) for state in which]) for which in _both(latest))
    changes = ends - starts
    shares = np.linalg.lstsq(np.diff(changes, axis=0).T, changes[-1], rcond=_RANK)[0]
    if not len(shares) or np.abs(shares).max() > _FARTHEST:
        return end
    wanted = ends[-1] - np.diff(ends, axis=0).T @ shares
    slopes, separations = np.split(wanted, 2)
    return MeshPositions(slopes / _widths(model), separations)


def _both(passes: Sequence[ContactPass]) -> tuple[list[MeshPositions], list[MeshPositions]]:
    """Starts and ends of passes."""
    return [pass_.start for pass_ in passes], [pass_.end for pass_ in passes]


def _widths(model: GearboxModel) -> np.ndarray:
    """Common face width of every mesh (M,) [m]; 1 m where none is given, and nothing slopes."""
    widths = np.ones(len(model.assembly.contacts))
    for stage in model.stages:
        widths[list(stage.meshes)] = stage.width or 1.0
    return widths


def _lengths(model: GearboxModel, positions: MeshPositions) -> np.ndarray:
    """Slopes over the widths and separations that rotations do not take up, (2M,) [m]."""
    apart = np.zeros(len(positions.separations))
    for stage in model.stages:
        meshes = list(stage.meshes)
        apart[meshes] = unequal_separation(positions.separations[meshes])
    return np.append(positions.slopes * _widths(model), apart)


def slopes_agree(model: GearboxModel, new: np.ndarray, old: np.ndarray, tolerance: float, least: float) -> bool:
    """Tell whether slopes ``new`` (M,) and ``old`` (M,) [rad] agree.

    Their difference over the width counts against the misalignment, or the ``least`` one [m] where that is more.
    """
    for stage in model.stages:
        for mesh in stage.meshes:
            size = max(abs(new[mesh]) * stage.width, least)
            sloping = len(model.assembly.contacts[mesh].heights) > 1
            if sloping and abs(new[mesh] - old[mesh]) * stage.width > tolerance * size:
                return False
    return True


def forces_agree(
    model: GearboxModel, mesh_force: np.ndarray, contacts: Mapping[str, StageContact], tolerance: float
) -> bool:
    """Whether mesh forces (M,) [N] are those of the contact of the teeth, against the largest one of their stage."""
    for stage in model.stages:
        if stage.name in contacts:
            force = contacts[stage.name].normal_force
            apart = np.abs(mesh_force[list(stage.meshes)] - force)
            if apart.max() > tolerance * force.max():
                return False
    return True
