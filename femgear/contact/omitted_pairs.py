"""Tooth pairs that a contact solution left out: whether they would touch.

A pair whose separation exceeds that of the nearest pair of its mesh by more than a limit is no candidate.
That is right where it stays apart in the state that was found: its separation ``gap + S z - G q``, with what
the bodies yield there under the loads of all candidates, is not negative. Loads beside it mostly move a flank
away; where it comes nearer, as on a soft ring whose other planets carry more, that counts.
"""

from __future__ import annotations

import numpy as np

from femgear.contact.assembly import Candidates, windows_of_bodies
from femgear.contact.bodies import station_weights


def needed_nearest(candidates: Candidates, approach, force) -> np.ndarray:
    """Find the limit ``nearest`` (P,) [m] with which pairs that penetrate are candidates; zero without any.

    Parameters
    ----------
    candidates : Candidates
        Solved at P positions.
    approach : (meshes, P) or (meshes, P, pairs) array
        Of the drive flanks by the motions, of meshes or of all listed pairs [m]; back flanks part by it.
    force : (P, W) array
        Loads of the windows [N].
    """
    listed, approach = candidates.setup.listed, np.asarray(approach, float)
    approach = approach if approach.ndim == 3 else approach[..., None]
    gap, near = listed.gap[:, candidates.position], listed.near[:, candidates.position]
    limit = np.concatenate([approach, -approach])[: len(gap)]
    closing = _largest_closing(candidates) * candidates.setup.images * force.sum(axis=1)
    mesh, row, pair = np.nonzero(~near & np.isfinite(gap) & (gap < limit + closing[:, None]))
    limit = np.broadcast_to(limit, gap.shape)[mesh, row, pair]
    limit = limit - np.minimum(yielding(candidates, force, mesh, row, pair), 0.0)
    needed, smallest = np.zeros(len(force)), gap.min(axis=-1)
    penetrates = gap[mesh, row, pair] < limit
    np.maximum.at(needed, row[penetrates], (limit - smallest[mesh, row])[penetrates])
    return needed


def _largest_closing(candidates: Candidates) -> float:
    """How far flanks of both gears of a mesh come nearer to one another at most, per load elsewhere [m/N]."""
    return -2.0 * min(body.least for body in candidates.bodies.gears)


def yielding(pairs_there: Candidates, force: np.ndarray, mesh, row, pair) -> np.ndarray:
    """Compute by how much bodies part the flanks of listed pairs (n,) under the loads of all windows [m].

    Of meshes, rows of positions and pairs (n,); loads are (P, W) [N], taken at the middle of their windows.
    """
    setup, listed = pairs_there.setup, pairs_there.setup.listed
    total, softness = np.zeros(len(mesh)), np.sqrt(pairs_there.bodies.of_kinds(setup.kind(pairs_there.mesh)))
    loads, position = (force / softness)[row], pairs_there.position[row]
    candidates = windows_of_bodies(setup.gears, pairs_there.mesh)
    for (number, windows_there, gear, side), (_, these, gear_of, side_of) in zip(
        candidates, windows_of_bodies(setup.gears, mesh), strict=True
    ):
        body = pairs_there.bodies.gears[number]
        if not len(these):
            continue
        j, i, at = pairs_there.mesh[windows_there], pairs_there.pair[row[these]][:, windows_there], position[these]
        index, weight = station_weights(setup.roll[gear, j, at[:, None], i, 1], body.roll)
        index = index + (side * len(body.roll))[:, None]
        place, share = station_weights(listed.roll[gear_of, mesh[these], at, pair[these]], body.roll)
        place = place + (side_of * len(body.roll))[:, None]
        away = listed.tooth[gear_of, mesh[these], pair[these]][:, None] - setup.tooth[gear, j, i]
        count, images = len(body.regular), 1 if setup.gears.repeated[number] else setup.images
        for image in range(images):
            lag = (away - image * count // images) % count
            values = body.regular[lag[..., None, None], place[:, None, :, None], index[:, :, None, :]]
            moved = (share[:, None, None] @ values @ weight[..., None])[..., 0, 0]
            total[these] += (moved * loads[these][:, windows_there]).sum(axis=1)
    return total / np.sqrt(pairs_there.bodies.of_kinds(setup.kind(mesh)))
