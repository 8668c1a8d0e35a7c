"""The contact problem of a set or a pair at one position: candidates, separations, compliance.

The cells of all windows (`femgear.contact.windows`) at one position are the candidates of the contact problem
(`assemble_contact`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from femgear.contact.bodies import Bodies, FlankCompliance, station_weights
from femgear.contact.cracked_flanks import WindowCrack, window_cracks
from femgear.contact.flank_friction import WindowFriction, window_friction
from femgear.contact.flank_pairs import (
    acting_flanks,
)
from femgear.contact.supports import MovingMembers
from femgear.contact.windows import MeshWindows, cell_centres, equal_cells
from femgear.gears.pair import GearSet

_SAME_ROLL = 1e-13
"""Distance of roll lengths that count as one [m]."""


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
    cracks : tuple of WindowCrack
        Of teeth, with what of their faces touches; part of `images`.
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
    cracks: tuple[WindowCrack, ...] = ()

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
        """Compute `images` (I, P, W, 3, W, 3) [m/N] of other bodies with the same flanks: what differs, anew."""
        parts = [
            None if compliance is other else replace(other, regular=other.regular - compliance.regular)
            for compliance, other in zip(self.bodies.gears, bodies.gears, strict=True)
        ]
        differing = replace(bodies, gears=tuple(parts))
        images = self.images + body_compliance(self.setup, differing, self.position, self.mesh, self.pair)
        others = window_cracks(self.setup, bodies, *self._places) if self.cracks else ()
        for crack, other in zip(self.cracks, others, strict=True):
            if other.flanks is not crack.flanks:
                crack.soften(images[0], replace(other, closed=crack.closed).yielding() - crack.yielding())
        return images

    @property
    def _places(self) -> tuple:
        """Arguments of `window_cracks`."""
        return self.position, self.mesh, self.pair, windows_of_bodies(self.setup.gears, self.mesh)

    def with_closed(self, closed: list[np.ndarray]) -> Candidates:
        """Close pairs of nodes (P, k) on the faces of every crack, and open the others."""
        images, cracks = self.images.copy(), []
        for crack, pairs in zip(self.cracks, closed, strict=True):
            cracks.append(replace(crack, closed=pairs))
            rows = np.flatnonzero((pairs != crack.closed).any(axis=1))
            before, after = (at.at(rows).yielding() for at in (crack, cracks[-1]))
            there = images[0, rows]
            crack.soften(there, after - before)
            images[0, rows] = there
        return replace(self, images=images, cracks=tuple(cracks))

    def without_cracks(self) -> Candidates:
        """Leave out what cracks yield."""
        images = self.images.copy()
        for crack in self.cracks:
            crack.soften(images[0], -crack.yielding())
        return replace(self, images=images, cracks=())

    def at(self, rows: np.ndarray) -> Candidates:
        """Take some of the positions, by their places (n,) among these."""
        names = ("position", "pair", "gap", "candidate", "polynomials", "local")
        of_rows = {name: getattr(self, name)[rows] for name in names}
        friction = None if self.friction is None else self.friction.at(rows)
        cracks = tuple(crack.at(rows) for crack in self.cracks)
        return replace(self, **of_rows, images=self.images[:, rows], friction=friction, cracks=cracks)

    def touches_window_end(self, active: np.ndarray) -> bool:
        """Whether a contact (P, W, C) ends where its window ends, other than at an end of a flank."""
        return bool((active[..., [0, -1]] & ~np.moveaxis(self.at_edge, 0, -1)).any())

    def at_flank_end(self, active: np.ndarray) -> np.ndarray:
        """Whether the contact (P, W, C) in every window reaches an end of a flank, (P, W)."""
        last = self.candidate.shape[-1] - 1 - self.candidate[..., ::-1].argmax(axis=-1)
        at_last = np.take_along_axis(active, last[..., None], axis=-1)[..., 0]
        return (active[..., 0] & self.at_edge[0]) | (at_last & self.at_edge[1])

    def equal_cell_pressure(self, loads: np.ndarray) -> np.ndarray:
        """Compute mean pressures (P, W, C) [Pa] of equal cells under loads (P, W, C) [N], in any layout of windows."""
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
    for kind in range(len(setup.gears.mates)):
        of_kind = setup.kind(at[0]) == kind
        values, again = _within_windows(setup, bodies, kind, *(part[of_kind] for part in at))
        local[filled[0][of_kind], filled[1][of_kind]] = values[again]
    approach, supports = _motions_and_supports(setup, members, meshes)
    rubbing = None
    if friction is not None and members is not None:
        image = setup.places[1] if setup.images > 1 else None
        rubbing = window_friction(setup.gears, setup.zeta[place], mesh, friction, members, images=image)
    images = body_compliance(setup, bodies, positions, mesh, pair)
    cracks = window_cracks(setup, bodies, positions, mesh, pair, windows_of_bodies(setup.gears, mesh))
    for crack in cracks:
        crack.soften(images[0], crack.yielding())
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
        images=images,
        approach=approach,
        supports=supports,
        friction=rubbing,
        cracks=cracks,
    )


def _motions_and_supports(
    setup: MeshWindows, members: MovingMembers | None, meshes: int
) -> tuple[np.ndarray, np.ndarray]:
    """Approach (M, m) of the meshes by all motions, and compliance of sprung members between them (M, M) [m/N]."""
    turns = setup.gears.rotation_approach
    approach = np.vstack([turns, -turns])[:meshes]
    if members is None:
        return approach, np.zeros((meshes, meshes))
    if setup.images == 1:
        return np.hstack([approach, members.approach[:, members.free]]), members.compliance
    image = setup.places[1]
    of_images = [members.compliance[image == 0][:, image == number] for number in range(setup.images)]
    return approach, np.sum(of_images, axis=0)


def assemble_contact(
    setup: MeshWindows, bodies: Bodies, position: int, members: MovingMembers | None = None
) -> ContactProblem:
    """Assemble the complementarity problem of all meshes at one position; see `contact_candidates`."""
    return contact_candidates(setup, bodies, [position], members).problem(0)


def body_compliance(setup: MeshWindows, bodies: Bodies, positions, mesh, pair) -> np.ndarray:
    """Regular compliance (I, P, W, 3, W, 3) between the nodes of all windows, as of `Candidates.images` [m/N].

    At positions (P,), of meshes (W,) and pairs (P, W).
    """
    first, again = _different_positions(setup, positions, mesh, pair)
    positions, pair = np.asarray(positions)[first], pair[first]
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
    smooth /= root[:, None, None, None] * root[:, None]
    return smooth if first is again else smooth[:, again]


def _different_positions(setup: MeshWindows, positions, mesh, pair) -> tuple[np.ndarray, np.ndarray]:
    """Find those of some positions (P,) whose windows lie at different places of their flanks, and which all repeat.

    Records of one mesh period have no others.
    """
    every, turns = np.arange(len(positions)), setup.turns[positions]
    if (turns == turns[:1]).all():
        return every, every
    rolls = np.rint(setup.roll[:, mesh, np.asarray(positions)[:, None], pair] / _SAME_ROLL)
    places = np.hstack([pair, np.moveaxis(rolls, 1, 0).reshape(len(pair), -1)])
    _, first, again = np.unique(places.astype(np.int64), axis=0, return_index=True, return_inverse=True)
    return (every, every) if len(first) == len(every) else (first, again.ravel())


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


def _within_windows(setup: MeshWindows, bodies: Bodies, kind: int, mesh, position, pair) -> tuple[np.ndarray, Any]:
    """Compliance within windows (n,) of a kind of mesh over its softness, and which of these (u, cells, cells) all are.

    That of half planes, and what tip corners of both flanks add [m/N].
    """
    pairing, width, softness = setup.gears.mates[kind], bodies.widths[kind], float(bodies.of_kinds(np.array([kind]))[0])
    first, again = _different_windows(setup, mesh, position, pair)
    place = mesh[first], position[first], pair[first]
    layout = setup.layout[place]
    polynomials, parts = _window_polynomials(setup.cells)[layout], []
    for roll, flank in zip(setup.roll, [bodies.gears[number] for number in pairing], strict=True):
        arc = roll[place] ** 2 / (2 * flank.base_radius)
        away = (polynomials @ np.abs(arc - flank.corner.arc)[..., None])[..., 0]
        # cells beyond the end of a flank are no candidates
        away = np.maximum(away, 1e-12)
        parts.append(flank.corner.surface(away[:, :, None], away[:, None, :]))
    return (setup.local[kind, layout] + (parts[0] + parts[1]) / width) / softness, again


def _different_windows(setup: MeshWindows, mesh, position, pair) -> tuple[np.ndarray, Any]:
    """Find those of some windows (n,) of a kind that lie at different places of their flanks, and which all are.

    Records of one mesh period have no others.
    """
    every, turns = np.arange(len(mesh)), setup.turns[position]
    if (turns == turns[:1]).all():
        return every, every
    place = mesh, position, pair
    where = np.vstack([setup.layout[place], *np.rint(setup.roll[:, *place] / _SAME_ROLL).transpose(0, 2, 1)])
    _, first, again = np.unique(where.astype(np.int64), axis=1, return_index=True, return_inverse=True)
    return first, again.ravel()


def _window_polynomials(cells: int) -> np.ndarray:
    """Quadratic Lagrange polynomials of the window nodes at the cell centres, shape (4, cells, 3)."""
    t = cell_centres(cells)
    return np.stack([(2 * t - 1) * (t - 1), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)
