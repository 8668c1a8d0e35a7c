"""Stress in the tooth roots over the mesh cycle, by superposition of the loads of all tooth pairs.

The finite-element sector of a gear gives once and for all the tangential stress along the root of a tooth
per unit force at any flank station of any tooth of the body. The loads of the contact solution then add up
to the stress at every position, loads on neighbouring teeth and on the other flank included.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import acting_flanks, mesh_pairs
from femgear.contact.flanks import (
    LEFT,
    RIGHT,
    ObservedRoot,
    flank_load_columns,
    flank_stations,
    root_functionals,
    station_weights,
    with_cut,
)

if TYPE_CHECKING:
    from femgear.contact.bodies import Sectors
    from femgear.contact.cycle import MeshCycle
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import Grid
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

LOADED, BACK = 0, 1


@dataclass(frozen=True)
class RootStress:
    """Tangential stress along the tooth roots of one gear per unit flank load.

    The root of a flank runs from the end of the flank along the fillet and the root arc to the middle of
    the gap.

    Parameters
    ----------
    roll : (n,) array
        Roll lengths of the flank stations [m].
    arc : (m,) array
        Arc length of the root points from the end of the flank [m].
    points : (m, 2) array
        Root points of the left flank in the tooth frame [m].
    slope : (m,) array
        Angle between the tangent of the root and the centreline of the tooth [rad], 0 to pi/2; the
        critical section of ISO 6336-3 is where it is 30 deg (60 deg for internal gears).
    influence : (teeth, 2 m, 2 n) array
        ``influence[k, a, b]``: stress at root point ``a`` of tooth ``i`` per unit inward normal force at
        station ``b`` of tooth ``i - k`` [Pa/N], positive in tension; the left flank first, then the right.
    """

    roll: np.ndarray
    arc: np.ndarray
    points: np.ndarray
    slope: np.ndarray
    influence: np.ndarray


@dataclass(frozen=True)
class RootStresses:
    """Root stress influences of the three kinds of gears."""

    sun: RootStress
    planet: RootStress
    ring: RootStress

    def of_bodies(self, n_planets: int) -> list[tuple[str, RootStress, list]]:
        """Kind, influence and drive flanks (mesh, gear of the pair, side) of every body of a set."""
        sun, planets, ring = acting_flanks(n_planets)
        on_planets = [("planet", self.planet, acting) for acting in planets]
        return [("sun", self.sun, sun), *on_planets, ("ring", self.ring, ring)]


@dataclass(frozen=True)
class RootCycle:
    """Root stress of the teeth of one gear in one mesh.

    Slots are places along the path of contact one base pitch apart: those of `MeshCycle` with one more at
    either end, where a tooth without load of its own still feels its neighbours.

    Parameters
    ----------
    kind : str
        ``"sun"``, ``"planet"`` or ``"ring"``.
    mesh : int
    gear : int
        0 or 1: first or second gear of the mesh.
    path : (T, P) array
        Path coordinate of the tooth pair of each slot in base pitches, 0 at the pitch point.
    load : (T, P) array
        On the drive flank [N].
    stress : (T, P, 2, m) array
        Tangential stress along the root of the loaded flank (0) and of the back flank (1) [Pa].
    arc : (m,) array
        Arc length from the end of the flank [m].
    slope : (m,) array
        See `RootStress`.
    periods : int
        Mesh periods in the P positions.
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

    @property
    def tension(self) -> np.ndarray:
        """Largest stress along the root of the loaded flank, shape (T, P) [Pa]."""
        return self.stress[:, :, LOADED].max(axis=-1)

    @property
    def compression(self) -> np.ndarray:
        """Lowest stress along the root of the back flank, shape (T, P) [Pa]."""
        return self.stress[:, :, BACK].min(axis=-1)

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


@dataclass(frozen=True)
class RootHistory:
    """One tooth on its way through one mesh.

    Parameters
    ----------
    path : (S,) array
        Path coordinate of its tooth pair in base pitches, 0 at the pitch point.
    load : (S,) array
        [N]
    stress : (S, 2, m) array
        Along the roots of the loaded and of the back flank [Pa].
    """

    path: np.ndarray
    load: np.ndarray
    stress: np.ndarray


def root_stress(
    grid: Grid,
    gear: Gear,
    material: Material,
    *,
    held: str | None = "rim",
    support=None,
    state: str = "plane strain",
) -> RootStress:
    """Root stress influence of a whole gear from the grid of one sector.

    The whole sector has one plane state: the stresses of a plane body under given forces do not depend on
    its elastic constants (Michell's theorem; Timoshenko and Goodier, "Theory of Elasticity", 3rd ed.,
    section 43), and a change of state within the fillet would make a jump that no gear has.

    Parameters
    ----------
    grid : Grid
        Mirror-symmetric sector with boundaries ``flank_left``, ``fillet_left``, ``cut_left``, ``cut_right``
        and `held`.
    gear : Gear
    material : Material
    held : str, optional
        Boundary that cannot move; None when `support` holds the body.
    support : (2n, 2n) sparse matrix, optional
        Stiffness between the sector and the ground [N/m], as of `fe.elasticity.foundation`.
    state : str
        ``"plane strain"`` or ``"plane stress"``.

    Raises
    ------
    GridError
        When the body can move freely or the root is not one chain of edges.
    """
    from femgear.fe.compliance import condense_sector
    from femgear.fe.elasticity import stiffness

    along = root_functionals(grid, gear, material, state=state)
    matrix = stiffness(grid, material, state=state, thickness=gear.face_width)
    stations = flank_stations(grid, gear)
    schur = condense_sector(
        grid,
        matrix if support is None else matrix + support,
        count=gear.teeth,
        held=held,
        loads=flank_load_columns(grid, stations),
        observations=along.columns,
    )
    return observed_root_stress(gear, ObservedRoot(along, stations, with_cut(schur, grid, held, along)))


def observed_root_stress(gear: Gear, root: ObservedRoot) -> RootStress:
    """Root stress influence of a whole gear from what was observed with its flank compliance.

    Parameters
    ----------
    gear : Gear
    root : ObservedRoot
        Of one sector of that gear, `flanks.flank_compliance` with ``root_state``.
    """
    from femgear.fe.compliance import tooth_compliance

    along, stations = root.along, root.stations
    order = slice(None, None, -1 if gear.internal else 1)
    m, n = len(along.arc), len(stations.roll)
    influence = tooth_compliance(root.schur).reshape(gear.teeth, 2, m, 2, n)[:, :, order].copy()
    # flank and root share one node: right under a nodal force there the stress has no limit
    end, beside = (n - 1, n - 2) if gear.internal else (0, 1)
    for side in (LEFT, RIGHT):
        influence[0, side, 0, side, end] = influence[0, side, 0, side, beside]
    return RootStress(
        roll=stations.roll,
        arc=np.abs(along.arc - along.arc[order][0])[order],
        points=along.points[order],
        slope=np.arccos(np.clip(np.abs(along.tangents[order, 0]), 0.0, 1.0)),
        influence=influence.reshape(gear.teeth, 2 * m, 2 * n),
    )


def set_root_stress(sectors: Sectors, material: Material) -> RootStresses:
    """Influences of sun, planet and ring, each held at its rim as in `bodies.make_bodies`."""
    return RootStresses(
        *(root_stress(s.grid, s.gear, material) for s in (sectors.sun, sectors.planet, sectors.ring))
    )


def root_stress_cycle(
    planetary_set: PlanetarySet, roots: RootStresses, cycle: MeshCycle, *, reverse: bool = False
) -> tuple[RootCycle, ...]:
    """Root stress of both gears of every mesh at every position of the cycle.

    Parameters
    ----------
    planetary_set : PlanetarySet
    roots : RootStresses
    cycle : MeshCycle
        Of that set. The load of a tooth pair acts at its point on the line of action.
    reverse : bool
        Whether the cycle is that of a negative torque on the sun, `cycle.walk_either_flank`; the stress
        field is then the mirror image of that on the other flanks.

    Returns
    -------
    tuple of RootCycle
        Gear 1 and gear 2 of mesh 0, then of mesh 1, and so on. Loads on back flanks press on the other flank
        of the same teeth and add to both roots.
    """
    N = planetary_set.n_planets
    found = {}
    for kind, root, acting in roots.of_bodies(N):
        loads = _tooth_loads(planetary_set, root, cycle, acting, reverse)
        for target in acting:
            found[target[:2]] = _one_mesh(planetary_set, kind, root, cycle, target, loads, reverse)
    return tuple(found[mesh, gear] for mesh in range(2 * N) for gear in (0, 1))


def tooth_history(root: RootCycle, *, start: int = 0) -> RootHistory:
    """Follow one tooth from slot to slot through the mesh.

    Parameters
    ----------
    root : RootCycle
    start : int
        Mesh period of the record in which the tooth enters the first slot; records of one period serve all
        teeth.
    """
    slots, positions = root.path.shape
    each = positions // root.periods
    slot = np.repeat(np.arange(slots), each)
    position = (start + slot) % root.periods * each + np.tile(np.arange(each), slots)
    return RootHistory(root.path[slot, position], root.load[slot, position], root.stress[slot, position])


def worst_history(root: RootCycle) -> RootHistory:
    """History of the tooth with the largest stress in the root of its loaded flank."""
    slot, position, _ = root.worst
    period = position * root.periods // root.path.shape[1]
    return tooth_history(root, start=(period - slot) % root.periods)


def station_forces(roll, load, stations) -> np.ndarray:
    """Forces at the flank stations (T, n, P) [N] under loads (T, P) of teeth at roll lengths (T, P)."""
    index, weight = station_weights(roll, stations)
    forces = np.zeros((len(roll), len(stations), roll.shape[1]))
    t, p = np.indices(roll.shape)
    np.add.at(forces, (t[..., None], index, p[..., None]), weight * load[..., None])
    return forces


def _tooth_loads(planetary_set, root: RootStress, cycle, acting, reverse) -> list:
    """Loaded teeth of one body, each with its forces at the stations of both flanks (2 n, P) [N].

    `acting` lists (mesh, gear of the pair, drive flank) of its meshes; back flanks are the opposite ones.
    """
    sides = [(cycle.tooth, cycle.path, cycle.tooth_load, False)]
    if cycle.back_tooth_load.any():
        sides.append((cycle.back_tooth, cycle.back_path, cycle.back_tooth_load, True))
    loaded = []
    for tooth, path, load, back in sides:
        for mesh, gear, drive in acting:
            flank = drive if not back else RIGHT if drive == LEFT else LEFT
            pair = mesh_pairs(planetary_set)[int(mesh >= planetary_set.n_planets)]
            roll = pair.roll_on(gear, -path[mesh] if reverse else path[mesh])
            n, one_flank = len(root.roll), station_forces(roll, load[mesh], root.roll)
            forces = np.zeros((len(roll), 2 * n, roll.shape[1]))
            forces[:, flank * n : (flank + 1) * n] = one_flank
            loaded += [one for one in zip(tooth[gear, mesh], forces, strict=True) if one[1].any()]
    return loaded


def _one_mesh(planetary_set, kind, root: RootStress, cycle, target, loads, reverse) -> RootCycle:
    """Stress on the teeth of one mesh (mesh, gear, side) under the loads of all teeth of the body."""
    mesh, gear, side = target
    count = len(root.influence)
    teeth = _slots(cycle.tooth[gear, mesh], kind)
    # seen from behind the teeth are counted the other way round
    sense = -1 if reverse else 1
    total = np.zeros((len(teeth), root.influence.shape[1], len(cycle.position)))
    for tooth, force in loads:
        total += root.influence[sense * (teeth - tooth) % count] @ force
    stress = total.reshape(len(teeth), 2, -1, len(cycle.position)).transpose(0, 3, 1, 2)
    path = cycle.path[mesh] / planetary_set.sun.base_pitch
    load = np.zeros((len(teeth), len(cycle.position)))
    load[1:-1] = cycle.tooth_load[mesh]
    return RootCycle(
        kind=kind,
        mesh=mesh,
        gear=gear,
        path=np.vstack([path[:1] - 1.0, path, path[-1:] + 1.0]),
        load=load,
        stress=stress if side == LEFT else stress[:, :, ::-1],
        arc=root.arc,
        slope=root.slope,
        periods=cycle.periods,
    )


def _slots(teeth, kind) -> np.ndarray:
    """Tooth numbers of the slots of a mesh with one more at either end."""
    # the sun's teeth come one after another, those of planets and ring the other way round
    step = 1 if kind == "sun" else -1
    return np.concatenate([teeth[:1] - step, teeth, teeth[-1:] + step])
