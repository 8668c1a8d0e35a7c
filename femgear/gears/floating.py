"""Members without a support: whether the flanks of the planets alone keep them in place.

Statics of contacts that only push: forces of the loaded flanks, none below zero, must balance the torque and
leave no force on a member that floats. By Farkas' lemma (1902) there are such forces, or there is a motion
that the load drives and no flank stops. A member that floats alone must not slide past all flanks either.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.deviations import mesh_normals

if TYPE_CHECKING:
    from collections.abc import Sequence

    from femgear.gears.planetary import PlanetarySet

TOLERANCE = 1e-9
"""Of forces for a unit load, and of singular values of matrices whose columns are near one."""


def unheld_members(
    planetary_set: PlanetarySet, floating: Sequence[str], *, both_flanks: bool = False
) -> tuple[str, ...]:
    """Members that float without being held by the planets.

    Parameters
    ----------
    planetary_set : PlanetarySet
    floating : sequence of str
        Members without a radial support: any of "sun", "carrier" and "ring".
    both_flanks : bool
        The back flanks carry too.

    Returns
    -------
    tuple of str
        The first member that the planets cannot hold though the others stand still; all of `floating` when
        they can hold each but not all at once; empty when everything is held.
    """
    if not floating:
        return ()
    for name in floating:
        if not _held(planetary_set, (name,), both_flanks):
            return (name,)
    # sun and carrier may slide together at constant loads: these are known, their common place is free
    if len(floating) < 2 or _held(planetary_set, tuple(floating), both_flanks):
        return ()
    return tuple(floating)


def _held(s: PlanetarySet, floating: tuple[str, ...], both_flanks: bool) -> bool:
    """Whether forces of the flanks keep the members in equilibrium, and a single one from sliding."""
    from scipy.optimize import nnls

    approach = np.vstack([_approach(s, floating, back) for back in (False, True)[: 1 + both_flanks]])
    slides = np.linalg.matrix_rank(approach, tol=TOLERANCE) < approach.shape[1]
    if len(floating) == 1 and slides:
        return False
    load = np.zeros(approach.shape[1])
    load[s.n_planets] = 1.0  # the torque of the sun, which everything else must pass on
    return bool(nnls(approach.T, load)[1] < TOLERANCE)


def _approach(s: PlanetarySet, floating: tuple[str, ...], back: bool) -> np.ndarray:
    """Approach (2N, N + 1 + 2m) of the flanks per rotation of planets and sun and motion of the members."""
    N, side = s.n_planets, -1.0 if back else 1.0
    normals, zero = mesh_normals(s, back=back), np.zeros((N, 2))
    on_planet, on_ring = normals[:N], normals[N:]
    turns = np.block([[-np.eye(N), np.ones((N, 1))], [np.eye(N), np.zeros((N, 1))]])
    motions = {
        "sun": np.vstack([on_planet, zero]),
        "carrier": np.vstack([-on_planet, on_ring]),
        "ring": np.vstack([zero, -on_ring]),
    }
    return np.hstack([side * turns, *(motions[name] for name in floating)])
