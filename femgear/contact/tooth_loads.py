"""Loads of the teeth over the mesh cycle: on which flank of which tooth they act, and what they make of it.

The displacement fields of all gears of a set under the tooth loads of one position (`deformed_set`), and the
load spectrum of a tooth (`load_spectrum`). Tooth numbers tell which place of a body is which tooth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from femgear.contact.bodies import Sector, Sectors, flank_load_columns, flank_stations
from femgear.contact.flank_pairs import acting_flanks, mesh_pairs, tooth_steps
from femgear.contact.mesh_cycle import MeshCycle
from femgear.fe.compliance import cyclic_displacement, mirror_nodes, mirrored_columns
from femgear.gears.kinematics import orientations
from femgear.gears.pair import GearSet

LOAD_BINS = 20


@dataclass(frozen=True)
class _ToothLoad:
    """Load of one tooth pair on one of its gears over P positions.

    ``tooth`` is the number of the tooth in the first mesh period, ``step`` the change of that number from one mesh
    period to the next, ``flank`` LEFT or RIGHT. ``roll`` (P,) is the roll length of the contact on this gear [m],
    ``load`` (P,) the force at its point on the line of action [N].
    """

    tooth: int
    step: int
    flank: int
    roll: np.ndarray
    load: np.ndarray


@dataclass(frozen=True)
class LoadedTeeth:
    """Tooth loads of a cycle with slots, paths and tooth numbers as those of a positive torque.

    Parameters
    ----------
    load, path, back_load, back_path : (M, T, P) arrays
        As ``tooth_load``, ``path`` ... of `MeshCycle` [N], [m]; positions in the order of the cycle.
    tooth, back_tooth : (2, M, T) int arrays
        Numbers of the teeth of gear 1 and gear 2 in every slot, as of `MeshCycle`.
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

    def on_body(self, planetary_set: GearSet, acting) -> Iterator[_ToothLoad]:
        """Tooth pairs that load one body with the drive flanks `acting`, see `acting_flanks`."""
        pairs, kind = mesh_pairs(planetary_set), planetary_set.mesh_kind
        for mesh, gear, side in acting:
            for flank, loads, paths, numbers in (
                (side, self.load, self.path, self.tooth),
                # the other flanks in the same meshes are its back flanks
                (1 - side, self.back_load, self.back_path, self.back_tooth),
            ):
                for load, path, tooth in zip(loads[mesh], paths[mesh], numbers[gear, mesh], strict=True):
                    if load.any():
                        roll = pairs[kind[mesh]].roll_on(gear, path)
                        step = int(tooth_steps(planetary_set, mesh, gear))
                        yield _ToothLoad(int(tooth), step, flank, roll, load)

    @property
    def each(self) -> int:
        """Positions in one mesh period."""
        return len(self.turn) // self.periods


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
    time, engagements : (meshes, B) arrays
        Share of the time under load that a tooth spends in each class, and of the engagements whose largest
        load lies in it [1].
    cycles : (meshes, 2) array
        Load cycles of the flank that gear 1 or gear 2 has in this mesh, per turn of the gear against the
        carrier [1]: of the sun and the ring those with all planets.
    duration : (meshes,) array
        Mesh periods for which a tooth pair carries load, on average [1]: the contact ratio under load.
    """

    edges: np.ndarray
    time: np.ndarray
    engagements: np.ndarray
    cycles: np.ndarray
    duration: np.ndarray


@dataclass(frozen=True)
class DeformedBody:
    """One gear in the frame of the set: where its sector 0 is turned to and how every sector moves.

    Parameters
    ----------
    name : str
        Of the body, such as ``"planet 2"``.
    kind : str
        Of the gear, such as ``"planet"``.
    centre : (2,) array
        Centre of the gear [m].
    angle : float
        Angle of the centreline of sector 0 [rad].
    displacement : (count, n, 2) array
        Of every node of every sector, in the frame of that sector [m].
    """

    name: str
    kind: str
    centre: np.ndarray
    angle: float
    displacement: np.ndarray


def loaded_teeth(cycle: MeshCycle, *, reverse: bool) -> LoadedTeeth:
    """Take the tooth loads from a cycle; `reverse` says that the torque on the sun is negative."""
    sense, order = (-1, slice(None, None, -1)) if reverse else (1, slice(None))
    return LoadedTeeth(
        load=cycle.tooth_load[:, order],
        path=sense * cycle.path[:, order],
        tooth=sense * cycle.tooth[:, :, order],
        back_load=cycle.back_tooth_load,
        back_path=sense * cycle.back_path,
        back_tooth=sense * cycle.back_tooth,
        turn=sense * np.floor(cycle.position + 1e-9).astype(int),
        periods=cycle.periods,
        reverse=reverse,
    )


def load_spectrum(gears: GearSet, teeth: LoadedTeeth, *, closes: bool = True) -> LoadSpectrum:
    """Count the load spectrum of the teeth of every mesh.

    Parameters
    ----------
    gears : GearSet
        Whose teeth they are.
    closes : bool
        Whether the record repeats after its end; otherwise engagements that its ends cut off do not count,
        unless the record is too short to hold another.
    """
    meshes, _, positions = teeth.load.shape
    edges = np.linspace(0.0, teeth.load.max(initial=0.0), LOAD_BINS + 1)
    peaks = _engagement_peaks(teeth, closes)
    loaded = (peaks > 0.0).mean(axis=-1)
    cycles = np.empty((meshes, 2))
    for pair, rows in zip(gears.mates, gears.kind_rows, strict=True):
        for place, number in enumerate(pair):
            cycles[rows, place] = loaded[rows] if gears.repeated[number] else loaded[rows].sum()
    return LoadSpectrum(
        edges=edges,
        time=_shares(teeth.load.reshape(meshes, -1), edges),
        engagements=_shares(peaks, edges),
        cycles=cycles,
        duration=(teeth.load > 0.0).sum(axis=(1, 2)) / positions,
    )


def deformed_set(
    planetary_set: GearSet, sectors: Sectors, cycle: MeshCycle, *, position: int = 0
) -> tuple[DeformedBody, ...]:
    """Compute the elastic displacement of sun, planets and ring, each held as in the static problem.

    The load of each tooth pair acts at its point on the line of action; the half-plane indentation, a few
    tenths of a micrometre deep, is not part of the field. The torque is on the left flanks of the sun (mirror
    the set otherwise); ``position`` is an index into ``cycle.position``.
    """
    s, deformed = planetary_set, []
    at = orientations(s, float(cycle.position[position]))
    teeth, bodies = loaded_teeth(cycle, reverse=False), acting_flanks(s)
    for body, (number, acting) in zip(s.bodies, bodies, strict=True):
        moved = _displacement(teeth, s, sectors.gears[number], acting, position)
        centre, angle = s.centres[number][body.copy], at.gears[number][body.copy]
        place = np.array([centre.real, centre.imag])
        deformed.append(DeformedBody(body.name, s.gears[number].name, place, float(angle), moved))
    return tuple(deformed)


def _engagement_peaks(teeth: LoadedTeeth, closes: bool) -> np.ndarray:
    """Largest load of every engagement, shape (meshes, engagements) [N]."""
    meshes, slots, _ = teeth.load.shape
    # the tooth that enters the first slot in one period is in the next slot a period later
    entered = teeth.turn[None, :] - np.arange(slots)[:, None]
    number = entered % teeth.periods if closes else entered - entered.min()
    peaks = np.zeros((meshes, number.max() + 1))
    np.maximum.at(peaks.T, number, np.moveaxis(teeth.load, 0, -1))
    whole = np.bincount(number.ravel()) == slots * teeth.each
    return peaks[:, whole] if whole.any() else peaks


def _shares(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Share of the positive values of every row in each class; zero for a row without any."""
    if not edges[-1] > 0.0:
        return np.zeros((len(values), len(edges) - 1))
    counts = np.array([np.histogram(row[row > 0.0], edges)[0] for row in values], float)
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)


def _displacement(teeth: LoadedTeeth, planetary_set, sector: Sector, acting, position: int) -> np.ndarray:
    """Displacement of one body under the loads at one position, (teeth, n, 2) [m]."""
    stations = flank_stations(sector.grid, sector.gear)
    left = flank_load_columns(sector.grid, stations)
    columns = (left, mirrored_columns(left, mirror_nodes(sector.grid)))
    loads = np.zeros((sector.gear.teeth, left.shape[0]))
    for tooth_load in teeth.on_body(planetary_set, acting):
        if tooth_load.load[position] > 0.0:
            number = (tooth_load.tooth + tooth_load.step * teeth.turn[position]) % sector.gear.teeth
            hat = _hat(tooth_load.roll[position], stations.roll)
            loads[number] += tooth_load.load[position] * (columns[tooth_load.flank] @ hat)
    return cyclic_displacement(sector.grid, sector.stiffness, loads, held="rim")


def _hat(roll: float, stations: np.ndarray) -> np.ndarray:
    """Linear interpolation weights of one roll length."""
    weight = np.zeros(len(stations))
    upper = int(np.clip(np.searchsorted(stations, roll), 1, len(stations) - 1))
    t = (roll - stations[upper - 1]) / (stations[upper] - stations[upper - 1])
    weight[upper - 1], weight[upper] = 1 - t, t
    return weight
