"""The mirror image of a planetary set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np


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
