"""Windows of pressure cells around the points where tooth pairs come nearest to one another.

Tooth pairs that may touch at a position have a window each (`mesh_windows`), which is enlarged until it contains the
contact (`in_windows`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from femgear.contact.bodies import Bodies
from femgear.contact.flank_pairs import (
    BACK_SIDE,
    DRIVE_SIDE,
    FlankPair,
    admissible_arcs,
    flank_side,
    mesh_pairs,
    pair_limits,
    pair_separations,
    profile_form,
    separation,
    side_teeth,
)
from femgear.contact.local_compliance import hertz_half_width, surface_displacement
from femgear.errors import LESS_TORQUE, ContactError
from femgear.gears.deviations import SetDeviations
from femgear.gears.faults import Crack, MissingTooth, Spall, missing_length
from femgear.gears.pair import GearSet

WINDOW_NODES = np.array([0.0, 0.5, 1.0])
WIDTH = 3.2
"""Of a window, in Hertzian half widths under the force that sizes it."""
HELD = 2.56
"""A window holds the contact of this many times that force: the square of half its width."""
ROUGH_STIFFNESS = 10e9
"""Stiffness of a mesh per face width, to size windows [N/m^2]."""
MOST_ENLARGEMENTS = 11
"""Of windows that do not contain the contact."""
_SAME = 1e-9
"""Part of a mesh period that is none."""

Found = TypeVar("Found")


@dataclass(frozen=True)
class Windows:
    """Windows of pressure cells of one kind of mesh; ``...`` stands for (meshes, P, pairs).

    Parameters
    ----------
    zeta : (...) array
        Path coordinate of the tooth pair [m].
    near : (...) bool array
        Whether the pair comes near enough to be a candidate.
    gap : (..., cells) array
        Separation at the cell centres [m]; infinite outside the flanks.
    roll : (2, ..., nodes) array
        Roll lengths of the window nodes on gear 1 and gear 2 [m].
    at_edge : (2, ...) bool array
        Whether the low and the high end of the window are ends of a flank (a tip corner or the start of the
        involute).
    layout : (...) int array
        How the window is divided into cells, see `cell_edges`.
    centre : (...) array
        From the point on the path of contact to the middle of the window, along flank 1 [m].
    cell : (meshes,) array
        Mean width of a pressure cell along the profile [m].
    """

    zeta: np.ndarray
    near: np.ndarray
    gap: np.ndarray
    roll: np.ndarray
    at_edge: np.ndarray
    layout: np.ndarray
    centre: np.ndarray
    cell: np.ndarray


@dataclass(frozen=True)
class ListedPairs:
    """All tooth pairs that may come near, candidates or not; ``...`` stands for (meshes, P, pairs).

    Parameters
    ----------
    near : (...) bool array
        Whether the pair comes near enough to be a candidate.
    gap : (...) array
        Smallest separation [m]; infinite where the flanks have no points in common.
    roll : (2, ...) array
        Roll lengths of the middle of the window on gear 1 and gear 2 [m].
    centre : (...) array
        As of `Windows` [m].
    tooth : (2, meshes, pairs) int array
        Tooth numbers in the first mesh period.
    first : (meshes,) int array
        Number of the first one with a window.
    """

    near: np.ndarray
    gap: np.ndarray
    roll: np.ndarray
    centre: np.ndarray
    tooth: np.ndarray
    first: np.ndarray


@dataclass(frozen=True)
class MeshWindows(Windows):
    """Contact windows of all meshes and positions, or of twice as many with the back flanks.

    Parameters
    ----------
    gears : PlanetarySet or GearPair
        With the N planets that have windows.
    tooth : (2, meshes, pairs) int array
        Tooth numbers on gear 1 and gear 2 in the first mesh period.
    turns : (P,) int array
        Mesh periods passed at each position; one of the record's periods has one number.
    local : (kinds, 4, cells, cells) array
        Half-plane compliance of both bodies within a window [m/N], for all kinds of mesh and layouts.
    cell_area : (meshes, 4, cells) array
        Areas of the pressure cells in all layouts [m^2].
    listed : ListedPairs
        Those without windows among them, see `femgear.contact.omitted_pairs`.
    images : int
        Sectors of the set that are all in the same state: the planets are those of the first.
    cracks : tuple of Crack
        Of teeth.
    """

    gears: GearSet
    tooth: np.ndarray
    turns: np.ndarray
    local: np.ndarray
    cell_area: np.ndarray
    listed: ListedPairs
    images: int = 1
    cracks: tuple[Crack, ...] = ()

    @property
    def n_planets(self) -> int:
        """Number N of planets that have windows."""
        return self.gears.n_planets

    @property
    def driver(self) -> int:
        """Number of the motion on which the torque acts, the last of the rotations."""
        return self.gears.rotation_approach.shape[1] - 1

    @property
    def meshes(self) -> int:
        """Number of meshes, back sides not counted."""
        return len(self.gears.meshes)

    @property
    def cells(self) -> int:
        """Pressure cells in a window."""
        return self.gap.shape[-1]

    @property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Mesh with windows that stands for each mesh of the set (M,), and which image of it that is (M,)."""
        rows = [np.arange(self.meshes)[of_kind] for of_kind in self.gears.kind_rows]
        mesh = [np.tile(of_kind, self.images) for of_kind in rows]
        image = [np.repeat(np.arange(self.images), len(of_kind)) for of_kind in rows]
        return np.concatenate(mesh), np.concatenate(image)

    def kind(self, mesh: np.ndarray) -> np.ndarray:
        """Kinds (...) of meshes with the numbers (...), those on the back side included."""
        return self.gears.mesh_kind[mesh % self.meshes]

    def with_planet_gaps(self, planet_gaps) -> MeshWindows:
        """Add separations (N,) [m] of the sun-side drive flanks of the planets."""
        gap = self.gap.copy()
        further, driven = np.asarray(planet_gaps, float)[:, None, None], self.gears.kind_rows[0]
        gap[driven] += further[..., None]
        listed = self.listed.gap.copy()
        listed[driven] += further
        return replace(self, gap=gap, listed=replace(self.listed, gap=listed))


def mesh_windows(  # noqa: PLR0913
    planetary_set: GearSet,
    bodies: Bodies,
    *,
    share: float,
    nearest: float,
    positions: int | np.ndarray,
    contact: str = "profile",
    cells: int = 36,
    deviations: SetDeviations | None = None,
    both_flanks: bool = False,
    turned: np.ndarray | None = None,
    all_pairs: bool = False,
) -> MeshWindows:
    """Place the contact windows of every mesh at every position.

    Parameters
    ----------
    share, nearest : float
        Mesh force that sizes the windows [N]; pairs are candidates whose separation exceeds that of the
        nearest pair of their mesh by less than `nearest` [m].
    positions : int or (P,) or (P, S) array
        Number of equidistant positions in one mesh period, or the positions themselves [mesh periods]; those
        of S slices of helical teeth have windows one after the other.
    contact : {"profile", "line_of_action"}
        Where candidates lie: on the profiles, or on the line of action alone.
    cells : int
        Pressure cells in a window.
    both_flanks : bool
        Back flanks as well, as the second half of the meshes.
    turned : (meshes, P) array, optional
        Arcs by which gear 1 of every mesh has turned on its base circle [m], positive as it drives: separations are
        those of flanks there, to which approaches by all motions still come. Approaches of gear 2 are exact anyway.
    """
    tau, turns = in_mesh_periods(cycle_positions(positions))
    slices = np.shape(positions)[1] if np.ndim(positions) > 1 else 1
    pairs = mesh_pairs(planetary_set)
    widths = [
        WIDTH * _contact_half_width(pair, share / width, modulus)
        for pair, width, modulus in zip(pairs, bodies.widths, bodies.contact_moduli, strict=True)
    ]
    widths, cells = _over_gaps(planetary_set, deviations, pairs, widths, cells, nearest)
    whole = deviations
    if deviations is not None and deviations.faults:
        # nor does a tooth that is missing say where others come nearest
        faults = [fault for fault in deviations.faults if not isinstance(fault, MissingTooth | Spall)]
        whole = replace(deviations, faults=tuple(faults))
    windows_of_meshes, teeth = [], []
    for direction in (DRIVE_SIDE, BACK_SIDE) if both_flanks else (DRIVE_SIDE,):
        phase, clearance = flank_side(planetary_set, direction)
        zeta, tooth = _tooth_pairs(planetary_set, pairs, phase, direction, tau - turns)
        shift = pair_separations(planetary_set, deviations, tooth, turns, tau, back=direction < 0)
        shift += clearance[:, None, None]
        moved = None if turned is None else direction * turned[:, :, None]
        for kind, (contact_pair, rows) in enumerate(zip(pairs, planetary_set.kind_rows, strict=True)):
            options = {
                "width": widths[kind],
                "cells": cells,
                "nearest": nearest,
                "line_of_action": contact == "line_of_action",
                "form": profile_form(planetary_set, deviations, kind, direction < 0, tooth, turns, slices),
                "whole": profile_form(planetary_set, whole, kind, direction < 0, tooth, turns),
                "limits": pair_limits(planetary_set, deviations, contact_pair, kind, direction < 0, tooth, turns),
                "moved": 0.0 if moved is None else moved[rows],
            }
            windows_of_meshes.append(windows(contact_pair, zeta[rows], shift=shift[rows], **options))
        teeth.append(tooth)
    setup = _gathered(windows_of_meshes, planetary_set, np.concatenate(teeth, axis=1), turns, bodies, cells, all_pairs)
    faults = () if deviations is None else deviations.faults
    return replace(setup, cracks=tuple(fault for fault in faults if isinstance(fault, Crack)))


def _over_gaps(
    planetary_set: GearSet,
    deviations: SetDeviations | None,
    pairs: tuple[FlankPair, ...],
    widths: list[float],
    cells: int,
    nearest: float,
) -> tuple[list[float], int]:
    """Widen the windows [m] of kinds of mesh whose teeth lack a part of their flank, with more cells.

    A pair may touch on both sides of the part that is missing: as far from the place of the whole flanks as it is long,
    but no further than where these have come apart by ``nearest`` [m].
    """
    faults, wide = () if deviations is None else deviations.faults, list(widths)
    for kind, (pair, mates) in enumerate(zip(pairs, planetary_set.mates, strict=True)):
        length = sum(missing_length(faults, planetary_set, number, widths[kind]) for number in mates)
        if length:
            wide[kind] += 2.0 * min(length, 0.5 * length + _largest_radius(pair) * nearest / length)
    most = max(wider / width for wider, width in zip(wide, widths, strict=True))
    return wide, cells if most == 1.0 else int(np.ceil(cells * np.sqrt(most)))


def pair_paths(planetary_set: GearSet, positions, *, both_flanks: bool) -> tuple[np.ndarray, np.ndarray]:
    """Compute path coordinates (meshes, P, pairs) [m] and teeth (2, meshes, pairs) of `mesh_windows`."""
    tau, turns = in_mesh_periods(cycle_positions(positions))
    paths = list[tuple[np.ndarray, np.ndarray]]()
    for direction in (DRIVE_SIDE, BACK_SIDE) if both_flanks else (DRIVE_SIDE,):
        phase = flank_side(planetary_set, direction)[0]
        paths.append(_tooth_pairs(planetary_set, mesh_pairs(planetary_set), phase, direction, tau - turns))
    zeta, tooth = zip(*paths)
    return np.concatenate(zeta), np.concatenate(tooth, axis=1)


def in_mesh_periods(tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give positions (P,), of slices one after the other, by (P,) or (P, S), and the mesh periods passed."""
    # a tooth pair has one number in all slices; what is rounded off their mean belongs to the same period
    middle = tau.reshape(len(tau), -1).mean(axis=1)
    # mesh periods are those of the record: one that ends at zero has its seams just after whole positions
    ends = middle[-1] <= _SAME
    turns = (np.ceil(middle - _SAME) if ends else np.floor(middle + _SAME)).astype(int)
    return tau.ravel(), np.repeat(turns, tau.size // len(tau))


def first_windows(planetary_set: GearSet, bodies: Bodies, sun_torque: float) -> tuple[float, float]:
    """Share [N] and nearest [m] of the first windows under a torque [N m], as `mesh_windows` takes them."""
    s, width = planetary_set, min(bodies.widths)
    # without torque what one micrometre of wedging may carry
    share = sun_torque / (s.gears[0].base_radius * s.n_planets) or 1e-6 * ROUGH_STIFFNESS * width
    rough = share / (ROUGH_STIFFNESS * width)
    # a ring on a soft foundation lets flanks come nearer than teeth alone do
    yields = max(body.regular[0].diagonal().max() for body in bodies.gears)
    return share, max(3.0 * rough, rough + share * yields)


def in_windows(
    attempt: Callable[[float, float], tuple[Found | None, float, float]], share: float, nearest: float
) -> Found:
    """Find something in windows that contain the contact; they are enlarged until they do.

    ContactError: E-CONTACT: no windows contain the contact.

    Parameters
    ----------
    attempt : callable
        ``(share, nearest) -> found, share, nearest``: what is found in these windows, or None, and the
        windows to try next; the same ones where they contain the contact.
    share, nearest : float
        Of the first windows, as `mesh_windows` takes them [N], [m].
    """
    for _ in range(MOST_ENLARGEMENTS + 1):
        contacts, *wider = attempt(share, nearest)
        if contacts is not None and wider == [share, nearest]:
            return contacts
        share, nearest = wider
    raise not_contained()


def not_contained() -> ContactError:
    """Make the refusal (E-CONTACT) of windows that do not contain the contact, however large."""
    return ContactError(
        "the contact windows do not contain the contact after eleven enlargements",
        code="E-CONTACT",
        remedy=(LESS_TORQUE, "smaller errors of the teeth"),
    )


def enlarged(share: float, force: float) -> float:
    """Load [N] that sizes windows twice as wide, and twice again until they hold a mesh force [N]."""
    share *= 4.0
    while share < force / HELD:
        share *= 4.0
    return share


def cycle_positions(positions, *, periods: int = 1) -> np.ndarray:
    """Positions in mesh periods, (P,): as given, or equidistant ones from the pitch point on."""
    if np.ndim(positions):
        return np.asarray(positions, float)
    return np.arange(positions * periods) / positions


def windows(  # noqa: PLR0913
    pair: FlankPair,
    zeta,
    *,
    width: float,
    cells: int,
    nearest: float,
    line_of_action: bool,
    form: Callable | None = None,
    whole: Callable | None = None,
    shift: float | np.ndarray = 0.0,
    limits: np.ndarray | None = None,
    moved: float | np.ndarray = 0.0,
) -> Windows:
    """Place pressure cells around the point of smallest separation of every tooth pair.

    Parameters
    ----------
    zeta : (...) array
        Path coordinates [m].
    width : float
        Width of a window [m].
    cells : int
        Number of pressure cells in it.
    nearest : float
        Pairs (last axis) whose smallest separation exceeds that of the nearest pair by more than this [m]
        are no candidates.
    line_of_action : bool
        Only pairs on the theoretical path of contact, as for rigid gears.
    form : callable, optional
        Separation that deviations of both profiles add, from the roll lengths on flank 1 and 2 [m].
    whole : callable, optional
        The same of flanks of which no part is missing: windows lie around the place where these come nearest.
    shift : float or (...) array, broadcast with `zeta`
        Separation that errors of position add to a whole pair [m].
    limits : (2, 2, ...) array, optional
        Smallest and largest roll length of the flanks of gear 1 and gear 2 [m] where not all are whole.
    moved : float or (...) array, broadcast with `zeta`
        Path coordinates at which flanks stand beyond those that count the pairs [m].
    """
    counted = np.asarray(zeta, float)
    zeta = counted + moved
    low, high = admissible_arcs(pair, zeta, limits)
    nominal = np.maximum(pair.pitch_roll_1 + zeta, 0.0) ** 2 / (2 * pair.base_radius_1)
    centre = np.clip(nominal, low, np.maximum(low, high))
    if whole is not None:
        centre = _nearest_arc(pair, zeta, centre, low, high, 6.0 * width, whole)
    start = np.clip(centre - 0.5 * width, low, np.maximum(low, high - width))
    tiny = 1e-9 * width
    at_edge = np.stack([start <= low + tiny, start + width >= high - tiny])
    layout = at_edge[0] + 2 * at_edge[1]
    arc = start[..., None] + width * cell_centres(cells)[layout]
    gap = _separation_at(pair, zeta[..., None], arc, form) + np.asarray(shift)[..., None]
    gap = np.where((arc < high[..., None]) & (low < high)[..., None], gap, np.inf)
    begin, end = pair.path if limits is None else pair.path_between(limits)
    smallest = gap.min(axis=-1)
    on_path = (zeta >= begin) & (zeta <= end)
    with np.errstate(invalid="ignore"):  # of pairs whose teeth are missing
        near = smallest - smallest.min(axis=-1, keepdims=True) < nearest
    return Windows(
        zeta=counted,
        near=on_path & np.isfinite(smallest) if line_of_action else near,
        gap=gap,
        roll=_node_rolls(pair, zeta, start, width, np.maximum(high, low + width)),
        at_edge=at_edge,
        layout=layout,
        centre=start + 0.5 * width - nominal,
        cell=np.full(len(zeta), width / cells),
    )


def _node_rolls(pair: FlankPair, zeta, start, width: float, end) -> np.ndarray:
    """Roll lengths (2, ..., 3) [m] of the nodes of windows on both flanks, from arcs (...) of start and end [m]."""
    node_arc = np.minimum(start[..., None] + WINDOW_NODES * width, end[..., None])
    roll_1 = np.sqrt(2 * pair.base_radius_1 * node_arc)
    return np.stack([roll_1, separation(pair, zeta[..., None], roll_1)[1]])


def cell_edges(cells: int) -> np.ndarray:
    """Cell edges (4, cells + 1) as parts of a window: inside a flank, at its low end, its high end, both.

    Where flanks end they meet at an angle: a light load is carried within some micrometres of the corner, so
    that the cells there shrink to ``1 / cells^2`` of the window.
    """
    t = np.linspace(0.0, 1.0, cells + 1)
    return np.stack([t, t**2, 1.0 - (1.0 - t) ** 2, np.sin(0.5 * np.pi * t) ** 2])


def cell_centres(cells: int) -> np.ndarray:
    """Middles of the cells as fractions of a window, shape (4, cells)."""
    edges = cell_edges(cells)
    return 0.5 * (edges[:, 1:] + edges[:, :-1])


def equal_cells(cells: int) -> np.ndarray:
    """Share of every cell (last axis) of the layouts that lies in each of equal cells, (4, cells, cells)."""
    edges, equal = cell_edges(cells), np.linspace(0.0, 1.0, cells + 1)
    low, high = edges[:, None, :-1], edges[:, None, 1:]
    overlap = np.minimum(high, equal[1:, None]) - np.maximum(low, equal[:-1, None])
    return np.maximum(overlap, 0.0) / (high - low)


def _tooth_pairs(planetary_set, pairs, phase, direction, passed) -> tuple[np.ndarray, np.ndarray]:
    """Path coordinates (meshes, P, pairs) [m] and teeth (2, meshes, pairs) of all pairs that may come near.

    `passed` (P,) are the positions less the mesh periods passed.
    """
    pitch = planetary_set.base_pitch
    begin = min(p.path[0] for p in pairs) / pitch
    end = max(p.path[1] for p in pairs) / pitch
    passed = direction * passed
    lowest = np.floor(begin - phase - np.ceil(passed.max())).astype(int) - 1
    # slices of helical teeth reach beyond a mesh period
    further = int(np.ceil(max(passed.max() - passed.min() - 1.0, 0.0)))
    index = lowest[:, None] + np.arange(int(np.ceil(end - begin)) + 5 + further)
    zeta = pitch * (passed[None, :, None] + phase[:, None, None] + index[:, None, :])
    return zeta, side_teeth(planetary_set, index, direction)


def _contact_half_width(pair: FlankPair, line_load: float, modulus: float) -> float:
    """Largest Hertzian half width on the path of contact [m] of one tooth pair under `line_load` [N/m].

    ``modulus`` is the contact modulus of both flanks [Pa].
    """
    return hertz_half_width(line_load, _largest_radius(pair), modulus)


def _largest_radius(pair: FlankPair) -> float:
    """Largest relative radius of curvature on the path of contact [m]."""
    begin, end = pair.path
    zeta = np.linspace(begin, end, 51)[1:-1]
    rho_1, rho_2 = pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - pair.sign * zeta
    return float((rho_1 * rho_2 / (rho_2 + pair.sign * rho_1)).max())


@lru_cache(maxsize=64)
def _window_compliance(
    width: float, cells: int, materials: tuple[tuple[float, float], ...], common: float
) -> np.ndarray:
    """Half-plane compliance of both flanks between the cells of a window, shape (4, cells, cells) [m/N].

    Of shear modulus [Pa] and Poisson's ratio of each, and their face width in common [m]. All walks of a set
    under one torque have windows of one width.
    """
    centre, half = width * cell_centres(cells), 0.5 * width * np.diff(cell_edges(cells))
    distance, yielding = centre[:, :, None] - centre[:, None, :], []
    for constants in materials:
        # of both cells of a pair: reciprocal between cells of different widths
        loaded = surface_displacement(distance, half[:, :, None], *constants)
        yielding.append(0.5 * (loaded + surface_displacement(distance, half[:, None, :], *constants)))
    compliance = (yielding[0] + yielding[1]) / common
    compliance.setflags(write=False)
    return compliance


def _gathered(
    windows_of_meshes: list[Windows], gears: GearSet, tooth, turns, bodies: Bodies, cells: int, all_pairs: bool
) -> MeshWindows:
    """Join all meshes; leading and trailing pairs that never come near are listed, but have no windows.

    Unless ``all_pairs`` have.
    """
    take = kept_pairs(np.concatenate([w.near.any(axis=1) | all_pairs for w in windows_of_meshes]))
    first, mesh = take[:, 0], np.arange(len(take))
    places = mesh[:, None, None], np.arange(len(turns))[:, None], take[:, None, :]
    parts = {}
    for name in (f.name for f in fields(Windows)):
        of_gears = name in ("roll", "at_edge")
        whole = np.concatenate([getattr(w, name) for w in windows_of_meshes], axis=int(of_gears))
        parts[name] = whole if name == "cell" else whole[:, *places] if of_gears else whole[places]
    area = parts["cell"] * cells * np.array(bodies.widths)[gears.mesh_kind[mesh % len(gears.meshes)]]
    listed = ListedPairs(
        near=np.concatenate([w.near for w in windows_of_meshes]),
        gap=np.concatenate([w.gap.min(axis=-1) for w in windows_of_meshes]),
        roll=np.concatenate([w.roll[..., 1] for w in windows_of_meshes], axis=1),
        centre=np.concatenate([w.centre for w in windows_of_meshes]),
        tooth=tooth,
        first=first,
    )
    return MeshWindows(
        **parts,
        gears=gears,
        tooth=tooth[:, mesh[:, None], take],
        turns=turns,
        local=np.stack(
            [
                _window_compliance(
                    float(w.cell[0] * cells),
                    cells,
                    tuple((flank.corner.shear_modulus, flank.corner.poisson_ratio) for flank in flanks),
                    common,
                )
                for w, flanks, common in zip(windows_of_meshes, bodies.mates, bodies.widths, strict=False)
            ]
        ),
        cell_area=area[:, None, None] * np.diff(cell_edges(cells)),
        listed=listed,
    )


def kept_pairs(used: np.ndarray) -> np.ndarray:
    """Numbers (meshes, kept) of the pairs that have windows, by which of all (meshes, pairs) are used.

    Every mesh keeps the same number of pairs, starting at its own first candidate.
    """
    first = used.argmax(axis=1)
    count = int((used.shape[1] - used[:, ::-1].argmax(axis=1) - first).max())
    return np.minimum(first, used.shape[1] - count)[:, None] + np.arange(count)


def _separation_at(pair: FlankPair, zeta, arc, form):
    """Separation at arc lengths on flank 1, deviations of the profiles included."""
    roll_1 = np.sqrt(2 * pair.base_radius_1 * np.maximum(arc, 0.0))
    gap, roll_2 = separation(pair, zeta, roll_1)
    return gap if form is None else gap + form(roll_1, roll_2)


def _nearest_arc(pair: FlankPair, zeta, centre, low, high, reach, form):
    """Arc length of the smallest separation within `reach` or more of the contact of the unmodified flanks.

    The places looked at lie as far apart under all loads between two powers of two, so that windows do not
    step from one to the next where a load changes by little.
    """
    # of a scale of its own, as all lengths of a set may be
    step = pair.base_radius_1 * 2.0 ** np.floor(np.log2(reach / (48.0 * pair.base_radius_1)))
    away = step * np.arange(-96, 97)
    arc = np.clip(centre[..., None] + away, low[..., None], np.maximum(low, high)[..., None])
    best = _separation_at(pair, zeta[..., None], arc, form).argmin(axis=-1)
    return np.take_along_axis(arc, best[..., None], axis=-1)[..., 0]
