"""Positions of a record at which a set with faulty teeth is in the same state: only one of each is solved.

A faulty tooth meets its mates for some mesh periods, and is far from them in all others. There the set repeats itself
mesh period by mesh period, but for rounding; with errors that turn as well nothing repeats. Nor does anything with a
crack: it yields under loads on all teeth of its gear.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.contact.bodies import Bodies
from femgear.contact.flank_pairs import acting_flanks, mesh_pairs, pair_separations, tooth_steps
from femgear.contact.windows import in_mesh_periods, mesh_windows, pair_paths
from femgear.gears.deviations import SetDeviations
from femgear.gears.faults import BrokenTip, Crack, MissingTooth, ToothFault
from femgear.gears.pair import GearSet

_SAME_PLACE, _SAME_SEPARATION = 1e-9, 1e-15
"""Distance of positions [mesh periods] and of flanks [m] that count as one."""


def different_positions(
    gears: GearSet,
    bodies: Bodies,
    deviations: SetDeviations | None,
    positions: np.ndarray,
    *,
    share: float,
    nearest: float,
    contact: str,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the positions that differ, and of every position which of them it repeats.

    Parameters
    ----------
    gears, bodies, deviations
        As for `mesh_windows`; drive flanks alone.
    positions : (P,) array
        [mesh periods]
    share, nearest, contact
        Of the windows, as for `mesh_windows`.

    Returns
    -------
    first : (U,) int array
        Numbers of positions, ascending, no two of which are in the same state.
    again : (P,) int array
        Which of these has the state of every position.
    """
    every = np.arange(len(positions))
    if deviations is None or not any(fault.tooth is not None for fault in deviations.faults):
        return every, every
    if any(isinstance(fault, Crack) for fault in deviations.faults):
        return every, every
    tau, turns = in_mesh_periods(positions)
    places = np.rint((tau - turns) / _SAME_PLACE).astype(np.int64)
    _, first, place = np.unique(places, return_index=True, return_inverse=True)
    if len(first) == len(positions):
        return every, every
    within, whole = (tau - turns)[first], replace(deviations, faults=())
    options = {"share": share, "nearest": nearest, "positions": within, "contact": contact, "deviations": whole}
    setup = mesh_windows(gears, bodies, **options)
    shift = pair_separations(gears, deviations, setup.listed.tooth, turns, tau, back=False)
    near = _may_touch(gears, deviations, setup.listed.gap, nearest + 2.0 * float(np.ptp(shift)), within)[:, place]
    apart = np.rint(np.where(near, shift, 0.0) / _SAME_SEPARATION).astype(np.int64)
    states = [places[:, None], np.moveaxis(apart, 1, 0).reshape(len(tau), -1)]
    for fault in (fault for fault in deviations.faults if fault.tooth is not None):
        faulty = on_faulty_tooth(gears, fault, setup.listed.tooth, turns)
        states.append(np.moveaxis(faulty & near, 1, 0).reshape(len(tau), -1).astype(np.int64))
    _, first, again = np.unique(np.hstack(states), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[again.ravel()]


def _may_touch(
    gears: GearSet, deviations: SetDeviations, gap: np.ndarray, nearest: float, within: np.ndarray
) -> np.ndarray:
    """Which listed pairs (M, P, T) may be candidates, by their smallest separations without faults (M, P, T) [m].

    A fault takes the nearest pair away at most. Beside a tooth that is missing or short pairs carry off the path of
    contact, by less than a base pitch for every such tooth.
    """
    faults = deviations.faults
    number = min(len(faults), gap.shape[-1] - 1)
    near = gap <= np.sort(gap, axis=-1)[..., number : number + 1] + nearest
    short = sum(isinstance(fault, MissingTooth | BrokenTip) for fault in faults)
    if short:
        pitch = gears.base_pitch
        zeta = pair_paths(gears, within, both_flanks=False)[0]
        ends = gears.of_kinds([pair.path for pair in mesh_pairs(gears)])
        near = near | (
            (zeta > ends[:, 0, None, None] - short * pitch) & (zeta < ends[:, 1, None, None] + short * pitch)
        )
    return near


def on_faulty_tooth(gears: GearSet, fault: ToothFault, tooth: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Tell of every pair (M, P, T) whether it is one of the faulty flank.

    Of teeth (2, M, T) in the first mesh period, and the mesh periods passed (P,). Pairs of the other flank have no
    fault that takes material off.
    """
    meshes, (periods, pairs) = tooth.shape[1], (len(turns), tooth.shape[2])
    faulty = np.zeros((meshes, periods, pairs), bool)
    for body, (number, acting) in zip(gears.bodies, acting_flanks(gears), strict=True):
        if number != fault.gear or body.copy != fault.copy:
            continue
        for mesh, place, side in acting:
            if fault.flank in (None, side):
                numbers = tooth[place, mesh] + tooth_steps(gears, mesh, place) * turns[:, None]
                faulty[mesh] = (numbers - (fault.tooth or 0)) % gears.gears[number].teeth == 0
    return faulty
