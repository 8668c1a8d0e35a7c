"""Both flanks of the teeth: phases and tooth numbers of the drive side, and of the back side in its mirror.

The back flanks of a set are the drive flanks of its mirror image (`mirrored_set`). Mesh ``2N + j`` is the
back side of mesh ``j``: its path coordinate runs backwards, and its flanks approach when those of mesh ``j``
part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.candidates import tooth_numbers, tooth_zero_angles

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

DRIVE, BACK = 1.0, -1.0


@dataclass(frozen=True)
class FlankSide:
    """One side of all 2N meshes.

    Parameters
    ----------
    direction : float
        +1 where the path coordinate grows with the position, -1 on the back side.
    phase : (2N,) array
        Mesh phases of this side.
    clearance : (2N,) array
        Separation of this side when the drive flanks just touch: zero, or the backlash [m].
    """

    direction: float
    phase: np.ndarray
    clearance: np.ndarray


def flank_side(planetary_set: PlanetarySet, direction: float) -> FlankSide:
    """Phases and clearances of the drive (+1) or back (-1) side."""
    s, N = planetary_set, planetary_set.n_planets
    if direction > 0:
        return FlankSide(direction, np.asarray(s.mesh_phases), np.zeros(2 * N))
    mirrored, order = mirrored_set(s)
    phase = np.empty(2 * N)
    phase[np.concatenate([order, order + N])] = mirrored.mesh_phases
    phase += _mirrored_position(s, mirrored)
    return FlankSide(direction, phase, np.repeat([s.backlash_sun_planet, s.backlash_planet_ring], N))


def side_teeth(planetary_set: PlanetarySet, index: np.ndarray, direction: float):
    """Tooth numbers (2N, pairs) on gear 1 and gear 2 of the pairs `index`, in the count of the drive side."""
    if direction > 0:
        return tooth_numbers(planetary_set, index)
    s, N = planetary_set, planetary_set.n_planets
    mirrored, order = mirrored_set(s)
    rows = np.concatenate([order, order + N])
    teeth = [np.empty_like(index), np.empty_like(index)]
    for gear, numbers in enumerate(tooth_numbers(mirrored, index[rows])):
        teeth[gear][rows] = -numbers
    # the tooth that the mirror image counts as zero stands here, counted in the original
    sun, planets, ring = tooth_zero_angles(s)
    sun_m, planets_m, ring_m = tooth_zero_angles(mirrored, _mirrored_position(s, mirrored))
    axis = 2 * s.planet_angles[0]
    opposite = np.empty(N)
    opposite[order] = planets_m

    def offset(image, original, gear):
        return np.rint((axis - image - original) / gear.pitch_angle).astype(int)

    planet_offset = offset(opposite, planets, s.planet)
    teeth[0][:N] += offset(sun_m, sun, s.sun)
    teeth[1][:N] += planet_offset[:, None]
    teeth[0][N:] += planet_offset[:, None]
    teeth[1][N:] += offset(ring_m, ring, s.ring)
    return teeth[0], teeth[1]


def mirrored_set(planetary_set):
    """The set seen from behind, and the place of each of its planets in the original one.

    Returns
    -------
    PlanetarySet
        Planet angles counted the other way round, ascending from the first planet.
    order : (N,) int array
        Mirrored planet ``i`` is original planet ``order[i]``.
    """
    angles = np.asarray(planetary_set.planet_angles)
    turned = np.mod(angles[0] - angles, 2 * np.pi)
    order = np.argsort(turned, kind="stable")
    return replace(planetary_set, planet_angles=tuple(angles[0] + turned[order])), order


def _mirrored_position(planetary_set, mirrored) -> float:
    """Position of the mirror image, in [0, 1), at which its sun stands like the original at zero."""
    image, original = tooth_zero_angles(mirrored)[0], tooth_zero_angles(planetary_set)[0]
    turns = (2 * planetary_set.planet_angles[0] - image - original) / planetary_set.sun.pitch_angle
    return float(turns - np.floor(turns))
