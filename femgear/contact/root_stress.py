"""Stress in the tooth roots over the mesh cycle, and the range of stress that a tooth goes through in a turn.

The finite-element sector of a gear gives once and for all the tangential stress along the root of a tooth
per unit force at any flank station of any tooth of the body. The loads of the contact solution then add up
to the stress at every position, loads on neighbouring teeth and on the other flank included.

Every tooth of a planet is bent one way by the sun and the other way by the ring. The stress field of a whole
body, all its teeth under all its loads, gives both in the right order: a tooth that moves on by one pitch a
mesh period takes the place of its neighbour, so the field of all places over one mesh period is the history
of one tooth over one turn. Which place is which is told by the tooth numbers of the cycle, and they carry the
phase between the mesh with the sun and that with the ring.

Loads that differ over the width b are sums of cosines ``cos(k_m z)``, ``k_m = m pi / b``, as displacements
``(U cos kz, V cos kz, W sin kz)`` are (`femgear.contact.slices`); the ends of the width are mirror planes.
The surface of the fillet is free, so that the stress along it follows from the strains in it, ``e_t`` along
the section and ``e_z = k W``, as in plane stress:

    sigma_t = E / (1 - nu^2) (e_t + nu e_z).

Every wave has a response ``s_m`` of its own, of the same sector; between N equal slices

    sigma = sum_m T_m^T s_m T_m p

with the orthonormal cosine transform T and loads p, each at its own place on the flank: s_0 is the plane
response, to which a uniform load leads back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.sparse import coo_array, csc_array

from femgear import second_process
from femgear.contact.bodies import (
    ObservedRoot,
    flank_load_columns,
    flank_stations,
    root_functionals,
    station_weights,
)
from femgear.contact.flank_pairs import LEFT, RIGHT, acting_flanks
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.tooth_loads import LoadedTeeth, loaded_teeth
from femgear.contact.width_waves import cosines
from femgear.curves import not_a_knot
from femgear.fe.compliance import condense_sector, tooth_compliance
from femgear.fe.elasticity import Material, plane_modulus, stiffness, wave_stiffness
from femgear.fe.grid import Grid
from femgear.gears.gear import Gear
from femgear.gears.pair import GearSet
from femgear.gears.tooth import root_notches

LOADED, BACK = 0, 1
"""Root of the loaded flank and of the back flank in `RootCycle.stress`."""
NOTCH_REACH = 0.05
"""Modules around a corner of the root within which stresses depend on the grid: its points are left out."""
_WAVES = 9
"""Wave numbers at which responses are computed; between them they are interpolated, within 0.1 %."""


@dataclass(frozen=True)
class _RootStress:
    """Tangential stress along the tooth roots of one gear per unit flank load.

    The root of a flank runs from the end of the flank along the fillet and the root arc to the middle of
    the gap, without what is nearer to a corner (`gears.tooth.root_notches`) than `NOTCH_REACH`.
    The critical section of ISO 6336-3 is where the slope is 30 deg (60 deg for internal gears).

    Parameters
    ----------
    roll : (n,) array
        Roll lengths of the flank stations [m].
    arc : (m,) array
        Arc length of the root points from the end of the flank [m].
    points : (m, 2) array
        Root points of the left flank in the tooth frame [m].
    slope : (m,) array
        Angle between the tangent of the root and the centreline of the tooth, 0 to pi/2 [rad].
    influence : (teeth, 2m, 2n) array
        ``influence[k, a, b]``: stress at root point ``a`` of tooth ``i`` per unit inward normal force at station
        ``b`` of tooth ``i - k`` [Pa/N], positive in tension; the left flank first, then the right.
    waves : (K, teeth, 2m, 2n) array, optional
        The same for loads that vary as cos(kz) across the width, one entry a wave number k [Pa/N].
    """

    roll: np.ndarray
    arc: np.ndarray
    points: np.ndarray
    slope: np.ndarray
    influence: np.ndarray
    waves: np.ndarray | None = None


@dataclass(frozen=True)
class RootStresses:
    """Root stress influences of the ``gears`` of a set, in its order; ``sun``, ``planet``, ``ring`` of a planetary one.

    The last ones may be left out: nothing is computed for them.
    ``ahead`` (slices,) are the places of slices before mid-width [mesh periods], zero for spur teeth, where
    loads differ over the width.
    """

    gears: tuple[_RootStress, ...]
    ahead: np.ndarray | None = None

    sun = property(lambda self: self.gears[0])
    planet = property(lambda self: self.gears[1])
    ring = property(lambda self: self.gears[2])

    def loads(self, planetary_set: GearSet, cycle: MeshCycle, *, reverse: bool) -> list[LoadedTeeth]:
        """Take the tooth loads of every slice from a cycle, each at its place on the path of contact."""
        if self.ahead is None or cycle.slice_load is None:
            return [loaded_teeth(cycle, reverse=reverse)]
        pitch, slices = planetary_set.base_pitch, zip(np.moveaxis(cycle.slice_load, 2, 0), self.ahead)
        return [
            loaded_teeth(replace(cycle, tooth_load=load, path=cycle.path + ahead * pitch), reverse=reverse)
            for load, ahead in slices
        ]

    def of_bodies(self, planetary_set: GearSet) -> list[tuple[int, _RootStress, list]]:
        """Number of the gear, influence and drive flanks (mesh, gear of the pair, side) of every body."""
        bodies = acting_flanks(planetary_set)
        return [(number, self.gears[number], acting) for number, acting in bodies if number < len(self.gears)]


@dataclass(frozen=True)
class _RootHistory:
    """One tooth at the S instants of its way through one mesh.

    ``path`` (S,) is the path coordinate of its tooth pair in base pitches, zero at the pitch point; ``load`` (S,) its
    load [N]; ``stress`` (S, 2, m) the tangential stress along the roots of the loaded and of the back flank [Pa];
    ``over_width`` (S, slices) the largest along the root of the loaded flank in every slice [Pa].
    """

    path: np.ndarray
    load: np.ndarray
    stress: np.ndarray
    over_width: np.ndarray


@dataclass(frozen=True)
class RootCycle:
    """Root stress of the teeth of one gear in one mesh.

    Slots are places along the path of contact one base pitch apart: those of `MeshCycle` with one more at
    either end, where a tooth without load of its own still feels its neighbours.

    Parameters
    ----------
    kind : str
        Name of the gear, such as ``"planet"``.
    mesh, gear : int
        Mesh, and 0 or 1 for its first or second gear.
    path : (T, P) array
        Path coordinate of the tooth pair of each slot in base pitches, 0 at the pitch point.
    load : (T, P) array
        On the drive flank [N].
    stress : (T, P, 2, m) array
        Tangential stress along the root of the loaded flank (0) and of the back flank (1) [Pa]; over the
        width where the largest of the one and the lowest of the other are.
    arc, slope : (m,) arrays
        Arc length from the end of the flank [m], and angle between root and centreline of the tooth [rad].
    periods : int
        Mesh periods in the P positions.
    over_width : (T, P, slices) array
        Largest stress along the root of the loaded flank in every slice of the width [Pa].
    """

    kind: str
    mesh: int
    gear: int
    path: np.ndarray
    load: np.ndarray
    stress: np.ndarray
    arc: np.ndarray
    slope: np.ndarray
    periods: int
    over_width: np.ndarray

    @property
    def face_load_factor(self) -> float:
        """K_F-beta: largest over mean of the stresses in all slices, each at its own largest."""
        largest = self.over_width.max(axis=(0, 1))
        return float(largest.max() / largest.mean()) if largest.any() else 1.0

    @property
    def tension(self) -> np.ndarray:
        """Largest stress along the root of the loaded flank, shape (T, P) [Pa]."""
        return self.stress[:, :, LOADED].max(axis=-1)

    @property
    def worst(self) -> tuple[int, int, int]:
        """Slot, position and root point of the largest stress in the root of the loaded flank."""
        loaded, tension = self.stress[:, :, LOADED], self.tension
        slot, position = np.nonzero(tension >= tension.max() - 1e-9 * abs(tension.max()))
        # of teeth that are loaded alike one that the record follows all the way, if there is one
        entered = position * self.periods // tension.shape[1] - slot
        k = int(((entered >= 0) & (entered + len(tension) <= self.periods)).argmax())
        slot, position = int(slot[k]), int(position[k])
        return slot, position, int(loaded[slot, position].argmax())

    def history(self, start: int | None = None) -> _RootHistory:
        """Follow one tooth from slot to slot through the mesh.

        It enters the first slot in the mesh period ``start`` of the record; by default it is the tooth with
        the largest stress in the root of its loaded flank. Records of one period serve all teeth.
        """
        slots, positions = self.path.shape
        if start is None:
            worst, at, _ = self.worst
            start = (at * self.periods // positions - worst) % self.periods
        each = positions // self.periods
        slot = np.repeat(np.arange(slots), each)
        position = (start + slot) % self.periods * each + np.tile(np.arange(each), slots)
        values = self.path, self.load, self.stress, self.over_width
        return _RootHistory(*(value[slot, position] for value in values))


@dataclass(frozen=True)
class RootRange:
    """Largest and smallest stress in the root of one flank during a turn of its gear against the carrier.

    Parameters
    ----------
    kind, mesh, gear
        As those of `RootCycle`: the flank is that which the gear has in the mesh.
    point, piece : int
        Root point with the largest difference of the two stresses, and its slice of the width.
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
    piece: int
    maximum: float
    minimum: float
    tooth_maximum: np.ndarray
    tooth_minimum: np.ndarray
    worst: tuple[int, int]
    history: np.ndarray | None


def root_stress_influence(
    grid: Grid,
    gear: Gear,
    material: Material,
    *,
    foundation=None,
    state: str = "plane strain",
) -> _RootStress:
    """Compute the root stress influence of a whole gear from the grid of one sector.

    The whole sector has one plane state: the stresses of a plane body under given forces do not depend on
    its elastic constants (Michell's theorem; Timoshenko and Goodier, "Theory of Elasticity", 3rd ed.,
    section 43), and a change of state within the fillet would make a jump that no gear has.

    GridError: E-GRID-FREE: the body can move freely.

    Parameters
    ----------
    grid : Grid
        Mirror-symmetric sector with boundaries ``flank_left``, ``fillet_left``, ``cut_left``, ``cut_right``
        and ``rim``.
    foundation : (2n, 2n) sparse matrix, optional
        Stiffness that supports the rim [N/m], as of `fe.elasticity.foundation`; held without it.
    state : str
        ``"plane strain"`` or ``"plane stress"``.
    """
    along = root_functionals(grid, gear, material, state=state)
    matrix = stiffness(grid, material, state=state, thickness=gear.face_width)
    stations = flank_stations(grid, gear)
    sector = condense_sector(
        grid,
        matrix,
        count=gear.teeth,
        rim="rim",
        loads=flank_load_columns(grid, stations),
        observations=along.columns,
    )
    return observed_root_stress(gear, ObservedRoot(along, stations, sector.supported(foundation)))


def observed_root_stress(gear: Gear, root: ObservedRoot) -> _RootStress:
    """Compute the root stress influence of a whole gear from what `bodies.flank_compliance` observed."""
    along, stations = root.along, root.stations
    order = slice(None, None, -1 if gear.internal else 1)
    m, n = len(along.arc), len(stations.roll)
    influence = tooth_compliance(root.schur).reshape(gear.teeth, 2, m, 2, n)[:, :, order].copy()
    # flank and root share one node: right under a nodal force there the stress has no limit
    end, beside = (n - 1, n - 2) if gear.internal else (0, 1)
    for side in (LEFT, RIGHT):
        influence[0, side, 0, side, end] = influence[0, side, 0, side, beside]
    points, (notches, _) = along.points[order], root_notches(gear)
    away = np.linalg.norm(points[:, None] - notches, axis=-1).min(axis=1, initial=np.inf)
    kept = away > NOTCH_REACH * gear.module
    kept = kept if kept.any() else ~kept
    return _RootStress(
        roll=stations.roll,
        arc=np.abs(along.arc - along.arc[order][0])[order][kept],
        points=points[kept],
        slope=np.arccos(np.clip(np.abs(along.tangents[order, 0]), 0.0, 1.0))[kept],
        influence=influence[:, :, kept].reshape(gear.teeth, 2 * int(kept.sum()), 2 * n),
    )


def root_waves(grid: Grid, gear: Gear, material: Material, wave_number: np.ndarray, *, foundation=None) -> np.ndarray:
    """Compute the root stress influences (K, teeth, 2 m, 2 n) of loads ``cos(kz)`` across the width [Pa/N].

    Loads are those over the face width of the gear; see the head of the module. Wave numbers (K,) [1/m];
    other arguments as in `root_stress_influence`.
    """
    along, stations = root_functionals(grid, gear, material, state="plane strain"), flank_stations(grid, gear)
    loads, columns = (
        np.insert(load_columns, range(2, len(load_columns) + 1, 2), 0.0, axis=0)
        for load_columns in (flank_load_columns(grid, stations), along.columns)
    )
    if foundation is not None:
        rests = coo_array(foundation)
        place = tuple(3 * (coord // 2) + coord % 2 for coord in rests.coords)
        foundation = csc_array((rests.data, place), shape=(3 * grid.n_nodes,) * 2)
    parts = [gear.face_width * width_matrix for width_matrix in wave_stiffness(grid, material)]
    axial = plane_modulus(material, "plane strain") * material.poisson_ratio

    def influence(k: float) -> np.ndarray:
        observed = columns.copy()
        observed[3 * along.nodes + 2, np.arange(len(along.nodes))] += axial * k
        matrix = (parts[0] + k * parts[1] + k**2 * parts[2]).tocsc()
        sector = condense_sector(grid, matrix, count=gear.teeth, rim="rim", loads=loads, observations=observed)
        return observed_root_stress(gear, ObservedRoot(along, stations, sector.supported(foundation))).influence

    return np.array(second_process.shared([partial(influence, k) for k in wave_number]))


def computed_waves(slices: int) -> np.ndarray:
    """Choose the waves that are computed for N slices, half waves over the width (K,); not all are whole."""
    last = max(slices - 1, 2)
    return np.geomspace(1.0, last, min(_WAVES, last))


def _between_slices(slices: int) -> np.ndarray:
    """Parts (1 + K, N, N) of a slice's load in the stress of a slice, of the plane response and of waves."""
    if slices == 1:
        return np.ones((1, 1, 1))
    T, wave_numbers = cosines(slices), computed_waves(slices)
    weights = not_a_knot(np.log(wave_numbers), np.eye(len(wave_numbers)), np.log(np.arange(1, slices)))
    waves = np.einsum("mk,ms,mt->kst", weights, T[1:], T[1:])
    return np.concatenate([np.full((1, slices, slices), 1.0 / slices), waves])


def root_stress_cycle(
    planetary_set: GearSet, roots: RootStresses, cycle: MeshCycle, *, reverse: bool = False
) -> tuple[RootCycle, ...]:
    """Compute the root stress of both gears of every mesh at every position of the cycle.

    Of gear 1 and gear 2 of mesh 0, then of mesh 1, and so on. The load of a tooth pair acts at its point on
    the line of action; loads on back flanks press on the other flank of the same teeth and add to both roots.
    With ``reverse`` the cycle is that of a negative torque on the sun: the stress field is then the mirror
    image of that on the other flanks.
    """
    s = planetary_set
    slices = roots.loads(s, cycle, reverse=reverse)
    samples = np.arange(len(cycle.position))
    cycle_of = {}
    for number, root, acting in roots.of_bodies(s):
        teeth, step = [cycle.tooth[gear, mesh] for mesh, gear, _ in acting], s.senses[number]
        # one slot more at either end: the sun's teeth come one after another, the others the other way round
        slots = [np.concatenate([history[:1] - step, history, history[-1:] + step]) for history in teeth]
        # seen from behind the teeth are counted the other way round
        numbers = np.concatenate(slots) * (-1 if reverse else 1)
        field = body_stress(planetary_set, root, acting, slices, samples, numbers)
        for target, stress in zip(acting, np.split(field, len(acting)), strict=True):
            cycle_of[target[:2]] = _root_cycle(s, s.gears[number].name, root, cycle, target, stress)
    return tuple(cycle_of[mesh, gear] for mesh in range(len(planetary_set.meshes)) for gear in (0, 1))


def root_ranges(
    planetary_set: GearSet,
    roots: RootStresses,
    slices: Sequence[LoadedTeeth],
    *,
    closes: bool = True,
    between: Sequence[Sequence[LoadedTeeth]] = (),
) -> tuple[RootRange, ...]:
    """Find the stress range in the root of every loaded flank, from the field of whole bodies.

    Of gear 1 and gear 2 of mesh 0, then of mesh 1, and so on, under the loads of all slices of the width, see
    `RootStresses.loads`. Where the record ``closes``, that is, repeats after its end, every tooth meets every
    state that tooth numbers and periods without a common divisor allow; otherwise each tooth has what the
    record shows of it. Largest and smallest stresses are those at the positions ``between`` too.
    """
    range_of = {}
    for number, root, acting in roots.of_bodies(planetary_set):
        for body_range in _body_ranges(planetary_set, number, root, acting, (slices, *between), closes):
            range_of[body_range.mesh, body_range.gear] = body_range
    return tuple(range_of[mesh, gear] for mesh in range(len(planetary_set.meshes)) for gear in (0, 1))


def body_stress(
    planetary_set: GearSet, root: _RootStress, acting, slices: Sequence[LoadedTeeth], samples, numbers
) -> np.ndarray:
    """Superpose the root stress (t, 2 m, slices, p) [Pa] of some teeth of a body, left root first.

    Parameters
    ----------
    root, acting
        Of the body, see `RootStresses.of_bodies`.
    slices : sequence of LoadedTeeth
        Loads of every slice of the width, see `RootStresses.loads`; one is the plane state.
    samples, numbers : (p,), (t,) int arrays
        Positions of the record, and teeth by their numbers in the first mesh period.
    """
    z, n, shape = len(root.influence), len(root.roll), (len(slices), len(samples))
    forces = {}
    for i, teeth in enumerate(slices):
        for tooth_load in teeth.on_body(planetary_set, acting):
            if tooth_load.load[samples].any():
                station_forces = forces.setdefault((tooth_load.tooth, tooth_load.flank), np.zeros((n, *shape)))
                station_forces[:, i] += _station_forces(tooth_load.roll[samples], tooth_load.load[samples], root.roll)
    between = _between_slices(len(slices))
    waves = root.influence[None] if root.waves is None else np.array([root.influence, *root.waves])
    total = np.zeros((len(numbers) * root.influence.shape[1], math.prod(shape)))
    for (tooth, flank), station_forces in forces.items():
        columns = waves[:, (numbers - tooth) % z, :, flank * n : (flank + 1) * n]
        columns = np.moveaxis(columns, 0, -2).reshape(len(total), -1)
        total += columns @ (between[:, None] @ station_forces).reshape(-1, total.shape[1])
    return total.reshape(len(numbers), -1, *shape)


def _station_forces(roll, load, stations) -> np.ndarray:
    """Forces at the flank stations (n, p) [N] under the loads (p,) of a tooth at roll lengths (p,)."""
    index, weight = station_weights(roll, stations)
    forces = np.zeros((len(stations), len(roll)))
    np.add.at(forces, (index, np.arange(len(roll))[:, None]), weight * load[:, None])
    return forces


def _root_cycle(planetary_set, kind, root: _RootStress, cycle: MeshCycle, target, stress) -> RootCycle:
    """Root cycle of one mesh (mesh, gear, side) from the stress (T, 2 m, slices, P) of its slots."""
    mesh, gear, side = target
    stress = stress.reshape(len(stress), 2, -1, *stress.shape[2:]).transpose(0, 4, 1, 2, 3)
    stress = stress if side == LEFT else stress[:, :, ::-1]
    over_width = stress[:, :, LOADED].max(axis=2)
    worst = over_width.argmax(axis=-1), stress[:, :, BACK].min(axis=2).argmin(axis=-1)
    worst = np.stack(worst, axis=-1)[..., None, None]
    path = cycle.path[mesh] / planetary_set.base_pitch
    load = np.zeros(stress.shape[:2])
    load[1:-1] = cycle.tooth_load[mesh]
    return RootCycle(
        kind=kind,
        mesh=mesh,
        gear=gear,
        path=np.vstack([path[:1] - 1.0, path, path[-1:] + 1.0]),
        load=load,
        stress=np.take_along_axis(stress, worst, axis=-1)[..., 0],
        arc=root.arc,
        slope=root.slope,
        periods=cycle.periods,
        over_width=over_width,
    )


def _body_ranges(planetary_set, number, root: _RootStress, acting, records, closes):
    """Ranges of the roots of the acting flanks of one body under the loads of all slices of some records."""
    slices, *between = records
    z, m, S = len(root.influence), len(root.arc), len(slices)
    teeth = replace(slices[0], path=np.mean([slice_teeth.path for slice_teeth in slices], axis=0))
    # with every period the sun's teeth go on to the next higher place, those of planets and ring back
    step = planetary_set.senses[number]
    alike = math.gcd(z, teeth.periods) if closes else z
    high, low = np.full((alike, 2 * m, S), -np.inf), np.full((alike, 2 * m, S), np.inf)
    worst = {}
    whole_turn = closes and teeth.periods == 1
    by_turn = (np.flatnonzero(teeth.turn == turn) for turn in np.unique(teeth.turn))
    for samples in [_one_turn(teeth)] if whole_turn else by_turn:
        field = body_stress(planetary_set, root, acting, slices, samples, np.arange(z))
        of_tooth = (np.arange(z) - step * teeth.turn[samples[0]]) % alike
        np.maximum.at(high, of_tooth, field.max(axis=-1))
        np.minimum.at(low, of_tooth, field.min(axis=-1))
        for target in acting:
            tension = _largest_tension(field, teeth, target, m, samples)
            worst[target] = max(worst.get(target, tension), tension)
    for more in between:
        for turn in np.unique(more[0].turn):
            samples = np.flatnonzero(more[0].turn == turn)
            others = body_stress(planetary_set, root, acting, more, samples, np.arange(z))
            of_tooth = (np.arange(z) - step * turn) % alike
            np.maximum.at(high, of_tooth, others.max(axis=-1))
            np.minimum.at(low, of_tooth, others.min(axis=-1))
    for target in acting:
        rows = slice(target[2] * m, (target[2] + 1) * m)
        top, bottom = (extreme[:, rows].reshape(alike, -1) for extreme in (high, low))
        widest = (top - bottom).argmax(axis=1)
        point_of = np.arange(alike), widest
        tooth = int((top - bottom)[point_of].argmax())
        point, piece = divmod(int(widest[tooth]), S)
        # seen from behind the teeth are counted the other way round
        counted = (-1 if teeth.reverse else 1) * np.arange(z) % alike
        start = acting[0] if planetary_set.repeated[number] else target
        yield RootRange(
            kind=planetary_set.gears[number].name,
            mesh=target[0],
            gear=target[1],
            point=point,
            piece=piece,
            maximum=float(top[tooth, widest[tooth]]),
            minimum=float(bottom[tooth, widest[tooth]]),
            tooth_maximum=top[point_of][counted],
            tooth_minimum=bottom[point_of][counted],
            worst=worst[target][1:],
            history=_history(field[:, rows][:, point, piece], teeth, start[:2], step) if whole_turn else None,
        )


def _one_turn(teeth: LoadedTeeth) -> np.ndarray:
    """Positions of a record of one period in the order of the turning seen in `teeth`."""
    return np.arange(teeth.each)[:: -1 if teeth.reverse else 1]


def _largest_tension(field, teeth: LoadedTeeth, target, m, samples) -> tuple[float, int, int]:
    """Largest stress in the loaded roots of the teeth in one mesh, its slot and its position."""
    mesh, gear, side = target
    loaded = field[teeth.tooth[gear, mesh] % len(field), side * m : (side + 1) * m].max(axis=(1, 2))
    slot, sample = np.unravel_index(loaded.argmax(), loaded.shape)
    slot_of_cycle = len(loaded) - 1 - slot if teeth.reverse else slot
    return float(loaded[slot, sample]), int(slot_of_cycle), int(samples[sample])


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
