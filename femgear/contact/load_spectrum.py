"""What a tooth goes through in service: its load spectrum, and the range of stress in its root.

Every tooth of a planet is bent one way by the sun and the other way by the ring. The stress field of a whole
body, all its teeth under all its loads, gives both in the right order: a tooth that moves on by one pitch a
mesh period takes the place of its neighbour, so the field of all places over one mesh period is the history
of one tooth over one turn. Which place is which is told by the tooth numbers of the cycle, and they carry the
phase between the mesh with the sun and that with the ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import mesh_pairs
from femgear.contact.root_stress import station_forces

if TYPE_CHECKING:
    from femgear.contact.cycle import MeshCycle
    from femgear.contact.root_stress import RootStress, RootStresses
    from femgear.gears.planetary import PlanetarySet

LOAD_BINS = 20


@dataclass(frozen=True)
class LoadSpectrum:
    """Loads of the teeth of every mesh while they roll through it.

    One engagement of a tooth is one load cycle from zero to its largest load and back: peak counting where
    only the largest peak between two crossings of the reference level, here zero, counts (ASTM E1049, section
    5.2). Its range is that peak.

    Parameters
    ----------
    edges : (B + 1,) array
        Limits of the load classes [N].
    time : (2N, B) array
        Share of the time under load that a tooth spends in each class [1].
    engagements : (2N, B) array
        Share of the engagements whose largest load lies in each class [1].
    cycles : (2N, 2) array
        Load cycles of the flank that gear 1 or gear 2 has in this mesh, per turn of the gear against the
        carrier [1]: of the sun and the ring those with all planets.
    duration : (2N,) array
        Mesh periods for which a tooth pair carries load, on average [1]: the contact ratio under load.
    """

    edges: np.ndarray
    time: np.ndarray
    engagements: np.ndarray
    cycles: np.ndarray
    duration: np.ndarray


@dataclass(frozen=True)
class RootRange:
    """Largest and smallest stress in the root of one flank during a turn of its gear against the carrier.

    Parameters
    ----------
    kind : str
        ``"sun"``, ``"planet"`` or ``"ring"``.
    mesh, gear : int
        The flank is that which gear 1 (0) or gear 2 (1) has in the mesh.
    point : int
        Root point with the largest difference of the two stresses.
    maximum, minimum : float
        There [Pa].
    tooth_maximum, tooth_minimum : (z,) arrays
        The same of every tooth, each at the point where the two differ most [Pa].
    worst : tuple of int
        Slot and position of the cycle with the largest stress in this root.
    history : (z P,) array or None
        Stress at `point` in the order of time, from a quarter of a turn before the tooth is at the pitch
        point of this mesh, or in the case of planets of that with the sun [Pa]; None for records of several
        mesh periods.
    """

    kind: str
    mesh: int
    gear: int
    point: int
    maximum: float
    minimum: float
    tooth_maximum: np.ndarray
    tooth_minimum: np.ndarray
    worst: tuple[int, int]
    history: np.ndarray | None


@dataclass(frozen=True)
class LoadedTeeth:
    """Tooth loads of a cycle with slots, paths and tooth numbers as those of a positive torque.

    Parameters
    ----------
    load, path : (2N, T, P) arrays
        Of the drive flanks [N], [m]; positions in the order of the cycle.
    tooth : (2, 2N, T) int array
    back_load, back_path, back_tooth
        The same of the back flanks.
    turn : (P,) int array
        Whole mesh periods passed at every position.
    periods : int
        Mesh periods in the record.
    reverse : bool
        Whether this is the view from behind, in which a negative torque is positive; time then runs back.
    """

    load: np.ndarray
    path: np.ndarray
    tooth: np.ndarray
    back_load: np.ndarray
    back_path: np.ndarray
    back_tooth: np.ndarray
    turn: np.ndarray
    periods: int
    reverse: bool

    @property
    def each(self) -> int:
        """Positions in one mesh period."""
        return len(self.turn) // self.periods


def loaded_teeth(cycle: MeshCycle, *, reverse: bool) -> LoadedTeeth:
    """Tooth loads of a cycle; `reverse` says that the torque on the sun is negative."""
    each = len(cycle.position) // cycle.periods
    sense, order = (-1, slice(None, None, -1)) if reverse else (1, slice(None))
    return LoadedTeeth(
        load=cycle.tooth_load[:, order],
        path=sense * cycle.path[:, order],
        tooth=sense * cycle.tooth[:, :, order],
        back_load=cycle.back_tooth_load,
        back_path=sense * cycle.back_path,
        back_tooth=sense * cycle.back_tooth,
        turn=sense * (np.arange(len(cycle.position)) // each),
        periods=cycle.periods,
        reverse=reverse,
    )


def load_spectrum(teeth: LoadedTeeth, *, closes: bool = True) -> LoadSpectrum:
    """Load spectrum of the teeth of every mesh.

    Parameters
    ----------
    teeth : LoadedTeeth
    closes : bool
        Whether the record repeats after its end; otherwise engagements that its ends cut off do not count,
        unless the record is too short to hold another.
    """
    meshes, _, positions = teeth.load.shape
    N = meshes // 2
    edges = np.linspace(0.0, teeth.load.max(initial=0.0), LOAD_BINS + 1)
    peaks = _engagement_peaks(teeth, closes)
    loaded = (peaks > 0.0).mean(axis=-1)
    cycles = np.empty((meshes, 2))
    cycles[:N, 0], cycles[:N, 1] = loaded[:N].sum(), loaded[:N]
    cycles[N:, 0], cycles[N:, 1] = loaded[N:], loaded[N:].sum()
    return LoadSpectrum(
        edges=edges,
        time=_shares(teeth.load.reshape(meshes, -1), edges),
        engagements=_shares(peaks, edges),
        cycles=cycles,
        duration=(teeth.load > 0.0).sum(axis=(1, 2)) / positions,
    )


def root_ranges(
    planetary_set: PlanetarySet, roots: RootStresses, teeth: LoadedTeeth, *, closes: bool = True
) -> tuple[RootRange, ...]:
    """Stress range in the root of every loaded flank, from the field of whole bodies.

    Parameters
    ----------
    planetary_set : PlanetarySet
    roots : RootStresses
    teeth : LoadedTeeth
    closes : bool
        Whether the record repeats after its end: every tooth then meets every state that tooth numbers and
        periods without a common divisor allow. Otherwise each tooth has what the record shows of it.

    Returns
    -------
    tuple of RootRange
        Gear 1 and gear 2 of mesh 0, then of mesh 1, and so on.
    """
    N = planetary_set.n_planets
    found = {}
    for kind, root, acting in roots.of_bodies(N):
        for one in _body_ranges(planetary_set, kind, root, acting, teeth, closes):
            found[one.mesh, one.gear] = one
    return tuple(found[mesh, gear] for mesh in range(2 * N) for gear in (0, 1))


def body_stress(planetary_set, root: RootStress, acting, teeth: LoadedTeeth, samples) -> np.ndarray:
    """Root stress of all teeth of one body at some positions.

    Parameters
    ----------
    planetary_set : PlanetarySet
    root : RootStress
    acting : list of (mesh, gear, side)
        The drive flanks of the body; the other flanks in the same meshes are its back flanks.
    teeth : LoadedTeeth
    samples : (p,) int array
        Positions of the record.

    Returns
    -------
    (z, 2 m, p) array
        [Pa]; teeth by their numbers of the first mesh period, left root first.
    """
    z, n = len(root.influence), len(root.roll)
    total = np.zeros((*root.influence.shape[:2], len(samples)))
    for mesh, gear, side in acting:
        pair = mesh_pairs(planetary_set)[int(mesh >= planetary_set.n_planets)]
        for flank, loads, paths, numbers in (
            (side, teeth.load, teeth.path, teeth.tooth),
            (1 - side, teeth.back_load, teeth.back_path, teeth.back_tooth),
        ):
            columns = root.influence[:, :, flank * n : (flank + 1) * n].reshape(-1, n)
            for load, path, tooth in zip(loads[mesh], paths[mesh], numbers[gear, mesh], strict=True):
                if load[samples].any():
                    roll = pair.roll_on(gear, path[samples])
                    forces = station_forces(roll[None], load[None, samples], root.roll)
                    stress = columns @ forces[0]
                    total += np.roll(stress.reshape(total.shape), tooth % z, axis=0)
    return total


def _engagement_peaks(teeth: LoadedTeeth, closes: bool) -> np.ndarray:
    """Largest load of every engagement, shape (2N, engagements) [N]."""
    meshes, slots, _ = teeth.load.shape
    # the tooth that enters the first slot in one period is in the next slot a period later
    entered = teeth.turn[None, :] - np.arange(slots)[:, None]
    number = entered % teeth.periods if closes else entered - entered.min()
    peaks = np.zeros((meshes, number.max() + 1))
    np.maximum.at(peaks, (slice(None), number), teeth.load)
    whole = np.bincount(number.ravel()) == slots * teeth.each
    return peaks[:, whole] if whole.any() else peaks


def _shares(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Share of the positive values of every row in each class; zero for a row without any."""
    if not edges[-1] > 0.0:
        return np.zeros((len(values), len(edges) - 1))
    counts = np.array([np.histogram(row[row > 0.0], edges)[0] for row in values], float)
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)


def _body_ranges(planetary_set, kind, root: RootStress, acting, teeth: LoadedTeeth, closes):
    """Ranges of the roots of the acting flanks of one body."""
    z, m = len(root.influence), len(root.arc)
    # with every period the sun's teeth go on to the next higher place, those of planets and ring back
    step = 1 if kind == "sun" else -1
    alike = math.gcd(z, teeth.periods) if closes else z
    high, low = np.full((alike, 2 * m), -np.inf), np.full((alike, 2 * m), np.inf)
    worst = {}
    one = closes and teeth.periods == 1
    for samples in [_one_turn(teeth)] if one else _by_turn(teeth):
        field = body_stress(planetary_set, root, acting, teeth, samples)
        of_tooth = (np.arange(z) - step * teeth.turn[samples[0]]) % alike
        np.maximum.at(high, of_tooth, field.max(axis=-1))
        np.minimum.at(low, of_tooth, field.min(axis=-1))
        for target in acting:
            found = _largest_tension(field, teeth, target, m, samples)
            worst[target] = max(worst.get(target, found), found)
    for target in acting:
        start = acting[0] if kind == "planet" else target
        rows = slice(target[2] * m, (target[2] + 1) * m)
        found = _range(kind, target, (high[:, rows], low[:, rows]), teeth, z)
        history = _history(field[:, rows][:, found.point], teeth, start[:2], step) if one else None
        yield replace(found, worst=worst[target][1:], history=history)


def _by_turn(teeth: LoadedTeeth):
    """Positions of the record, one array a mesh period."""
    return (np.flatnonzero(teeth.turn == turn) for turn in np.unique(teeth.turn))


def _one_turn(teeth: LoadedTeeth) -> np.ndarray:
    """Positions of a record of one period in the order of the turning seen in `teeth`."""
    return np.arange(teeth.each)[:: -1 if teeth.reverse else 1]


def _largest_tension(field, teeth: LoadedTeeth, target, m, samples) -> tuple[float, int, int]:
    """Largest stress in the loaded roots of the teeth in one mesh, its slot and its position."""
    mesh, gear, side = target
    loaded = field[teeth.tooth[gear, mesh] % len(field), side * m : (side + 1) * m].max(axis=1)
    slot, sample = np.unravel_index(loaded.argmax(), loaded.shape)
    slot_of_cycle = len(loaded) - 1 - slot if teeth.reverse else slot
    return float(loaded[slot, sample]), int(slot_of_cycle), int(samples[sample])


def _range(kind, target, extremes, teeth: LoadedTeeth, z) -> RootRange:
    """Range of one flank's root from the largest and the smallest stress of teeth not alike, (alike, m)."""
    high, low = extremes
    widest = (high - low).argmax(axis=1)
    own = np.arange(len(high)), widest
    tooth = int((high - low)[own].argmax())
    point = int(widest[tooth])
    # seen from behind the teeth are counted the other way round
    number = (-1 if teeth.reverse else 1) * np.arange(z) % len(high)
    return RootRange(
        kind=kind,
        mesh=target[0],
        gear=target[1],
        point=point,
        maximum=float(high[tooth, point]),
        minimum=float(low[tooth, point]),
        tooth_maximum=high[own][number],
        tooth_minimum=low[own][number],
        worst=(0, 0),
        history=None,
    )


def _history(places: np.ndarray, teeth: LoadedTeeth, start, step: int) -> np.ndarray:
    """Stress of one tooth over a turn from that at all places (z, P), the pitch point after a quarter."""
    mesh, gear = start
    z, positions = places.shape
    path = teeth.path[mesh, :, _one_turn(teeth)[0]]
    slot = int(np.abs(path).argmin())
    turn = places[(teeth.tooth[gear, mesh, slot] + step * np.arange(z)) % z].ravel()
    if len(path) > 1:
        turn = np.roll(turn, round(path[slot] / (path[1] - path[0]) * positions))
    if teeth.reverse:
        turn = np.roll(turn[::-1], 1)  # the first sample stays the first
    return np.roll(turn, len(turn) // 4)
