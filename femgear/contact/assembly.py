"""The contact problem of a planetary set at one position: windows of pressure cells, separations, compliance.

Tooth pairs that may touch have a window of pressure cells around the point of their smallest separation
(`mesh_windows`); the cells of all windows at one position are the candidates of the contact problem
(`assemble_contact`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np

from femgear.contact.bodies import Bodies, FlankCompliance, station_weights
from femgear.contact.flank_friction import WindowFriction, window_friction
from femgear.contact.flank_pairs import (
    BACK_SIDE,
    DRIVE_SIDE,
    FlankPair,
    acting_flanks,
    admissible_arcs,
    flank_side,
    mesh_pairs,
    pair_separations,
    profile_form,
    separation,
    side_teeth,
)
from femgear.contact.local_compliance import hertz_half_width, surface_displacement
from femgear.contact.supports import MovingMembers
from femgear.errors import LESS_TORQUE, ContactError
from femgear.gears.deviations import SetDeviations
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
    """

    gears: GearSet
    tooth: np.ndarray
    turns: np.ndarray
    local: np.ndarray
    cell_area: np.ndarray
    listed: ListedPairs
    images: int = 1

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


@dataclass(frozen=True)
class ContactProblem:
    """``gap + H p - G q >= 0, p >= 0`` of n candidates and m motions, with the place of every candidate.

    Parameters
    ----------
    n_planets : int
        Planets whose meshes the candidates lie in.
    H : (n, n) array
        Compliance of the gears [m/N].
    gap, area : (n,) arrays
        Separations [m], and areas of the pressure cells [m^2].
    G : (n, m) array
        Approach of the flanks per unit motion [1].
    supports : (meshes, meshes) array
        Compliance of sprung members between the meshes [m/N], part of `compliance`.
    mesh, pair, cell : (n,) int arrays
        Mesh, tooth pair and pressure cell of every candidate.
    position : int
        Index of the position among those of `MeshWindows`.
    """

    n_planets: int
    H: np.ndarray
    gap: np.ndarray
    G: np.ndarray
    supports: np.ndarray
    mesh: np.ndarray
    pair: np.ndarray
    cell: np.ndarray
    area: np.ndarray
    position: int

    @property
    def compliance(self) -> np.ndarray:
        """Compliance (n, n) of gears and supports between all candidates [m/N]."""
        if not self.supports.any():
            return self.H
        return self.H + self.supports[np.ix_(self.mesh, self.mesh)]

    def warm_start(self, other: ContactProblem, active: np.ndarray) -> np.ndarray:
        """Active candidates (n + k,), matched by mesh, pair and cell with those (n' + k,) of another position.

        The last k, which are no candidates, stay.
        """
        key = (self.mesh * 1000 + self.pair) * 1000 + self.cell
        other_key = (other.mesh * 1000 + other.pair) * 1000 + other.cell
        cells = len(other_key)
        return np.concatenate([np.isin(key, other_key[active[:cells]]), active[cells:]])

    def touches_window_end(self, active: np.ndarray, setup: MeshWindows) -> bool:
        """Whether a contact, active candidates (n,), ends where its window ends, other than at an end of a flank."""
        low, high = setup.at_edge[:, self.mesh, self.position, self.pair]
        last = setup.cells - 1
        return bool(np.any(active & (((self.cell == 0) & ~low) | ((self.cell == last) & ~high))))


@dataclass(frozen=True)
class Candidates:
    """All candidates at P positions in W windows of C cells: separations, and compliance in two parts.

    The compliance is ``H = L + Pi S Pi^T`` and that of the supports: ``L`` is block-diagonal, half plane and
    tip corners within a window, and ``S`` what the bodies yield between the three nodes of every window,
    smooth along the flanks. Every mesh has the same number of windows, some of which may be empty. Of sets
    that rotations map onto themselves in the same state there are the planets of the first sector alone, with
    what they and their images yield together; free members stay where they are.

    Parameters
    ----------
    setup : MeshWindows
        Windows of all meshes at all positions.
    bodies : Bodies
        Flank compliances of the gears.
    position : (P,) int array
        Indices of the positions in `setup`.
    mesh : (W,) int array
        Ascending.
    pair : (P, W) int array
        Tooth pair of every window.
    gap : (P, W, C) array
        Separations [m], zero where `candidate` is false.
    candidate : (P, W, C) bool array
        Whether the cell is on both flanks and its pair near enough.
    polynomials : (P, W, C, 3) array
        ``Pi``: values of the windows' quadratic polynomials in the cells; they add up to one.
    local : (P, W, C, C) array
        ``L`` [m/N].
    images : (I, P, W, 3, W, 3) array
        Yielding under loads on the windows in every one of the sectors, their own first [m/N].
    approach, supports : (meshes, m) and (meshes, meshes) arrays
        Approach of the flanks of every mesh per unit motion, and compliance of sprung members between the
        meshes [m/N].
    friction : WindowFriction, optional
        Of the flanks, in the equilibrium.
    """

    setup: MeshWindows
    bodies: Bodies
    position: np.ndarray
    mesh: np.ndarray
    pair: np.ndarray
    gap: np.ndarray
    candidate: np.ndarray
    polynomials: np.ndarray
    local: np.ndarray
    images: np.ndarray
    approach: np.ndarray
    supports: np.ndarray
    friction: WindowFriction | None = None

    @cached_property
    def smooth(self) -> np.ndarray:
        """``S``, (P, W, 3, W, 3) [m/N]."""
        return self.images.sum(axis=0)

    @property
    def layout(self) -> np.ndarray:
        """How every window is divided into cells, (P, W)."""
        return self.setup.layout[self.mesh, self.position[:, None], self.pair]

    @property
    def at_edge(self) -> np.ndarray:
        """Whether the low and the high end of every window are ends of a flank, (2, P, W)."""
        return self.setup.at_edge[:, self.mesh, self.position[:, None], self.pair]

    def by_pairs(self, values: np.ndarray) -> np.ndarray:
        """Values (P, W, ...) of the windows as (meshes, pairs, ..., P), zero where there is no window."""
        P, (meshes, _, pairs) = len(self.position), self.setup.near.shape
        values_of_pairs = np.zeros((P, meshes, pairs, *values.shape[2:]), values.dtype)
        values_of_pairs[np.arange(P)[:, None], self.mesh, self.pair] = values
        return np.moveaxis(values_of_pairs, 0, -1)

    def images_of(self, bodies: Bodies) -> np.ndarray:
        """`images`, of the same shape, of other bodies with the same flanks: what differs is computed anew."""
        parts = [
            None if compliance is other else replace(other, regular=other.regular - compliance.regular)
            for compliance, other in zip(self.bodies.gears, bodies.gears, strict=True)
        ]
        differing = replace(bodies, gears=tuple(parts))
        return self.images + body_compliance(self.setup, differing, self.position, self.mesh, self.pair)

    def touches_window_end(self, active: np.ndarray) -> bool:
        """Whether a contact (P, W, C) ends where its window ends, other than at an end of a flank."""
        return bool((active[..., [0, -1]] & ~np.moveaxis(self.at_edge, 0, -1)).any())

    def at_flank_end(self, active: np.ndarray) -> np.ndarray:
        """Whether the contact (P, W, C) in every window reaches an end of a flank, (P, W)."""
        last = self.candidate.shape[-1] - 1 - self.candidate[..., ::-1].argmax(axis=-1)
        at_last = np.take_along_axis(active, last[..., None], axis=-1)[..., 0]
        return (active[..., 0] & self.at_edge[0]) | (at_last & self.at_edge[1])

    def equal_cell_pressure(self, loads: np.ndarray) -> np.ndarray:
        """Mean pressures of equal cells under loads (P, W, C) [N], however windows are divided [Pa]."""
        pressure, area = np.zeros(loads.shape), self.setup.cell_area[self.mesh].mean(axis=(1, 2))
        for layout, of_cells in enumerate(equal_cells(self.setup.cells)):
            rows = self.layout == layout
            pressure[rows] = loads[rows] @ of_cells.T
        return pressure / area[:, None]

    def problem(self, at: int) -> ContactProblem:
        """The contact problem at one of the positions."""
        window, cell = np.nonzero(self.candidate[at])
        filled = np.flatnonzero(self.candidate[at].any(axis=1))
        values = self.polynomials[at, filled]
        smooth = self.smooth[at, filled][:, :, filled].transpose(0, 2, 1, 3)
        H = values[:, None] @ smooth @ values.transpose(0, 2, 1)
        H[range(len(filled)), range(len(filled))] += self.local[at, filled]
        keep, size = self.candidate[at, filled].ravel(), len(filled) * self.setup.cells
        mesh, pair = self.mesh[window], self.pair[at, window]
        return ContactProblem(
            n_planets=self.setup.n_planets,
            H=H.transpose(0, 2, 1, 3).reshape(size, size)[np.ix_(keep, keep)],
            gap=self.gap[at, window, cell],
            G=self.approach[mesh],
            supports=self.supports,
            mesh=mesh,
            pair=pair,
            cell=cell,
            area=self.setup.cell_area[mesh, self.layout[at, window], cell],
            position=int(self.position[at]),
        )


def mesh_windows(
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
    """
    tau, turns = _in_periods(cycle_positions(positions))
    pairs = mesh_pairs(planetary_set)
    widths = [
        WIDTH * _contact_half_width(pair, share / width, modulus)
        for pair, width, modulus in zip(pairs, bodies.widths, bodies.contact_moduli, strict=True)
    ]
    windows_of_meshes, teeth = [], []
    for direction in (DRIVE_SIDE, BACK_SIDE) if both_flanks else (DRIVE_SIDE,):
        phase, clearance = flank_side(planetary_set, direction)
        zeta, tooth = _tooth_pairs(planetary_set, pairs, phase, direction, tau - turns)
        shift = pair_separations(planetary_set, deviations, tooth, turns, tau, back=direction < 0)
        shift += clearance[:, None, None]
        for kind, (contact_pair, rows) in enumerate(zip(pairs, planetary_set.kind_rows, strict=True)):
            options = {
                "width": widths[kind],
                "cells": cells,
                "nearest": nearest,
                "line_of_action": contact == "line_of_action",
                "form": profile_form(planetary_set, deviations, kind, direction < 0),
            }
            windows_of_meshes.append(windows(contact_pair, zeta[rows], shift=shift[rows], **options))
        teeth.append(tooth)
    return _gathered(windows_of_meshes, planetary_set, np.concatenate(teeth, axis=1), turns, bodies, cells)


def pair_paths(planetary_set: GearSet, positions, *, both_flanks: bool) -> tuple[np.ndarray, np.ndarray]:
    """Compute path coordinates (meshes, P, pairs) [m] and teeth (2, meshes, pairs) of `mesh_windows`."""
    tau, turns = _in_periods(cycle_positions(positions))
    paths = list[tuple[np.ndarray, np.ndarray]]()
    for direction in (DRIVE_SIDE, BACK_SIDE) if both_flanks else (DRIVE_SIDE,):
        phase = flank_side(planetary_set, direction)[0]
        paths.append(_tooth_pairs(planetary_set, mesh_pairs(planetary_set), phase, direction, tau - turns))
    zeta, tooth = zip(*paths)
    return np.concatenate(zeta), np.concatenate(tooth, axis=1)


def _in_periods(tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (P,), of slices one after the other, by (P,) or (P, S), and the mesh periods passed."""
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


def windows(
    pair: FlankPair,
    zeta,
    *,
    width: float,
    cells: int,
    nearest: float,
    line_of_action: bool,
    form: Callable | None = None,
    shift: float | np.ndarray = 0.0,
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
    shift : float or (...) array, broadcast with `zeta`
        Separation that errors of position add to a whole pair [m].
    """
    zeta = np.asarray(zeta, float)
    low, high = admissible_arcs(pair, zeta)
    nominal = np.maximum(pair.pitch_roll_1 + zeta, 0.0) ** 2 / (2 * pair.base_radius_1)
    centre = np.clip(nominal, low, np.maximum(low, high))
    if form is not None:
        centre = _nearest_arc(pair, zeta, centre, low, high, 6.0 * width, form)
    start = np.clip(centre - 0.5 * width, low, np.maximum(low, high - width))
    tiny = 1e-9 * width
    at_edge = np.stack([start <= low + tiny, start + width >= high - tiny])
    layout = at_edge[0] + 2 * at_edge[1]
    arc = start[..., None] + width * cell_centres(cells)[layout]
    gap = _separation_at(pair, zeta[..., None], arc, form) + np.asarray(shift)[..., None]
    gap = np.where((arc < high[..., None]) & (low < high)[..., None], gap, np.inf)
    node_arc = np.minimum(start[..., None] + WINDOW_NODES * width, np.maximum(high, low + width)[..., None])
    roll_1 = np.sqrt(2 * pair.base_radius_1 * node_arc)
    roll_2 = separation(pair, zeta[..., None], roll_1)[1]
    begin, end = pair.path
    smallest = gap.min(axis=-1)
    on_path = (zeta >= begin) & (zeta <= end)
    return Windows(
        zeta=zeta,
        near=on_path if line_of_action else smallest - smallest.min(axis=-1, keepdims=True) < nearest,
        gap=gap,
        roll=np.stack([roll_1, roll_2]),
        at_edge=at_edge,
        layout=layout,
        centre=start + 0.5 * width - nominal,
        cell=np.full(len(zeta), width / cells),
    )


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


def contact_candidates(
    setup: MeshWindows,
    bodies: Bodies,
    positions,
    members: MovingMembers | None = None,
    friction: tuple[float, ...] | None = None,
) -> Candidates:
    """Assemble separations and compliance of all candidates at some positions.

    The motions are those of the planets and of the sun (gear 1 of a pair alone), as arcs on their base
    circles [m], positive in the direction in which the sun drives, and then the free motions of `members`.

    Parameters
    ----------
    positions : (P,) int array
        Indices of the positions in `setup`.
    members : MovingMembers, optional
        Without them all axes are fixed.
    friction : tuple of float, optional
        Coefficient of every kind of mesh, see `femgear.contact.flank_friction.window_friction`; with members alone.
    """
    positions = np.asarray(positions)
    near = np.moveaxis(setup.near[:, positions], 1, 0)
    meshes, slots = near.shape[1], max(int(near.sum(axis=-1).max(initial=0)), 1)
    pair = np.argsort(~near, axis=-1, kind="stable")[..., :slots].reshape(len(positions), -1)
    mesh = np.repeat(np.arange(meshes), slots)
    place = mesh, positions[:, None], pair
    layout, gap = setup.layout[place], setup.gap[place]
    candidate = np.isfinite(gap) & setup.near[place][..., None]
    filled = np.nonzero(candidate.any(axis=-1))
    at = mesh[filled[1]], positions[filled[0]], pair[filled]
    polynomials = _window_polynomials(setup.cells)[layout]
    local = np.zeros((*layout.shape, setup.cells, setup.cells))
    local[filled] = setup.local[setup.kind(at[0]), layout[filled]]
    local[filled] += _corner_part(setup, bodies, *at, polynomials[filled])
    local /= bodies.of_kinds(setup.kind(mesh))[:, None, None]
    turns = setup.gears.rotation_approach
    approach = np.vstack([turns, -turns])[:meshes]
    supports = np.zeros((meshes, meshes))
    if members is not None:
        if setup.images == 1:
            approach = np.hstack([approach, members.approach[:, members.free]])
        supports = members.compliance
    if setup.images > 1 and members is not None:
        image = setup.places[1]
        supports = np.sum([supports[image == 0][:, image == i] for i in range(setup.images)], axis=0)
    rubbing = None
    if friction is not None and members is not None:
        image = setup.places[1] if setup.images > 1 else None
        rubbing = window_friction(setup.gears, setup.zeta[place], mesh, friction, members, images=image)
    return Candidates(
        setup=setup,
        bodies=bodies,
        position=positions,
        mesh=mesh,
        pair=pair,
        gap=np.where(candidate, gap, 0.0),
        candidate=candidate,
        polynomials=polynomials,
        local=local,
        images=body_compliance(setup, bodies, positions, mesh, pair),
        approach=approach,
        supports=supports,
        friction=rubbing,
    )


def assemble_contact(
    setup: MeshWindows, bodies: Bodies, position: int, members: MovingMembers | None = None
) -> ContactProblem:
    """Assemble the complementarity problem of all meshes at one position; see `contact_candidates`."""
    return contact_candidates(setup, bodies, [position], members).problem(0)


def body_compliance(setup: MeshWindows, bodies: Bodies, positions, mesh, pair) -> np.ndarray:
    """Regular compliance (I, P, W, 3, W, 3) between the nodes of all windows, as of `Candidates.images` [m/N].

    At positions (P,), of meshes (W,) and pairs (P, W).
    """
    (P, W), nodes = pair.shape, setup.roll.shape[-1]
    smooth = np.zeros((setup.images, P, W, nodes, W, nodes))
    for number, members, gear, side in windows_of_bodies(setup.gears, mesh):
        body = bodies.gears[number]
        if body is None:
            continue
        j, i = mesh[members], pair[:, members]
        roll = setup.roll[gear, j, positions[:, None], i]
        sectors = smooth[:1] if setup.gears.repeated[number] else smooth
        _add_body(sectors, body, members, roll, setup.tooth[gear, j, i], side)
    root = np.sqrt(bodies.of_kinds(setup.kind(mesh)))
    return smooth / (root[:, None, None, None] * root[:, None])


def windows_of_bodies(gears: GearSet, mesh: np.ndarray) -> list[tuple]:
    """List all bodies of a set with the windows on them, by the meshes (W,) of all windows.

    Number of the gear, windows (w,), which gear of its mesh the body is in each (w,), and the flanks (w,).
    """
    # on the back side every gear carries on its other flank
    windows_of, (back, front) = [], np.divmod(mesh, len(gears.meshes))
    for number, acting in acting_flanks(gears):
        place, side = np.full((2, len(gears.meshes)), -1)
        for mesh_number, gear, flank in acting:
            place[mesh_number], side[mesh_number] = gear, flank
        on = np.flatnonzero(place[front] >= 0)
        windows_of.append((number, on, place[front[on]], np.abs(side[front[on]] - back[on])))
    return windows_of


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
    begin, end = pair.path
    zeta = np.linspace(begin, end, 51)[1:-1]
    rho_1, rho_2 = pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - pair.sign * zeta
    radius = (rho_1 * rho_2 / (rho_2 + pair.sign * rho_1)).max()
    return hertz_half_width(line_load, radius, modulus)


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
    windows_of_meshes: list[Windows], gears: GearSet, tooth, turns, bodies: Bodies, cells: int
) -> MeshWindows:
    """Join all meshes; leading and trailing pairs that never come near are listed, but have no windows."""
    take = kept_pairs(np.concatenate([w.near.any(axis=1) for w in windows_of_meshes]))
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


def _add_body(smooth, body: FlankCompliance, members, roll, tooth, side):
    """Add the compliance of one body between its windows `members` (w,) and their images.

    From roll lengths of their nodes (P, w, n) [m], tooth numbers (P, w) and flanks (w,).
    """
    count, stations = body.regular.shape[:2]
    index, weight = station_weights(roll, body.roll)
    index = index + side[:, None, None] * len(body.roll)
    for image, sector in enumerate(smooth[: len(smooth) // 2 + 1]):
        # what an image does to its original, the original does to the image on the other side
        alone = 2 * image % len(smooth) == 0
        first, second = np.triu_indices(len(members)) if alone else np.indices((len(members),) * 2).reshape(2, -1)
        lag = (tooth[:, first] - tooth[:, second] - image * count // len(smooth)) % count
        row = (lag[..., None, None] * stations + index[:, first]) * stations
        values = body.regular.reshape(-1)[row[..., None, None] + index[:, second][:, :, None, None]]
        half = weight[:, first][..., None, :] @ values.reshape(*row.shape, -1)
        half = half.reshape(*row.shape[:3], *weight.shape[2:])
        block = np.einsum("pwabq,pwbq->pwab", half, weight[:, second])
        sector[:, members[first], :, members[second]] += np.moveaxis(block, 1, 0)
        other = first != second if alone else first >= 0
        images = members[second[other]], slice(None), members[first[other]]
        smooth[-image][:, *images] += block[:, other].transpose(1, 0, 3, 2)


def _corner_part(setup: MeshWindows, bodies: Bodies, mesh, position, pair, polynomials) -> np.ndarray:
    """What tip corners of both flanks add within each window, shape (windows, cells, cells) [m/N]."""
    total = np.zeros((len(mesh), polynomials.shape[1], polynomials.shape[1]))
    of_kind = setup.kind(mesh)
    for kind, pairing in enumerate(setup.gears.mates):
        rows, flanks = of_kind == kind, [bodies.gears[number] for number in pairing]
        place, values = (mesh[rows], position[rows], pair[rows]), polynomials[rows]
        parts = []
        for roll, flank in zip(setup.roll, flanks, strict=True):
            arc = roll[place] ** 2 / (2 * flank.base_radius)
            away = (values @ np.abs(arc - flank.corner.arc)[..., None])[..., 0]
            # cells beyond the end of a flank are no candidates
            away = np.maximum(away, 1e-12)
            parts.append(flank.corner.surface(away[:, :, None], away[:, None, :]))
        total[rows] = (parts[0] + parts[1]) / bodies.widths[kind]
    return total


def _window_polynomials(cells: int) -> np.ndarray:
    """Quadratic Lagrange polynomials of the window nodes at the cell centres, shape (4, cells, 3)."""
    t = cell_centres(cells)
    return np.stack([(2 * t - 1) * (t - 1), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


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
