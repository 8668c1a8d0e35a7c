"""Flanks of a gear with a cracked tooth: what the crack changes in the compliance between all flanks, and its faces.

The grid of the sector is made once more with a crack, as a whole and split; the difference of the two goes into the
compliance of the healthy gear (`femgear.fe.cracks`). Faces of the crack touch without friction and do not pull: they
are candidates of the contact too. Pairs of nodes that touch are found with the loads of the flanks, until both agree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.contact.bodies import RING_STATE, TEETH_STATE, Sector, flank_load_columns, flank_stations, station_weights
from femgear.contact.flank_pairs import RIGHT, tooth_steps
from femgear.fe.compliance import condense_sector
from femgear.fe.cracks import CrackedRing, SplitGrid, both_cuts, condense_whole, cracked_ring, split_grid
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import Grid
from femgear.fe.meshing import mesh_outline
from femgear.gears.cracked_tooth import BESIDE, SECTION, cracked_sector
from femgear.gears.faults import Crack
from femgear.gears.gear import Gear
from femgear.gears.tooth import half_sector

if TYPE_CHECKING:
    from femgear.contact.windows import MeshWindows

Support = Callable[[Grid], Any]
"""Stiffness of the foundation of a rim on a grid."""


@dataclass(frozen=True)
class CrackedFlanks:
    """Crack at the root of the left flank of tooth 0 of a gear.

    Parameters
    ----------
    form : tuple
        Start, angle and depth of the crack, as `femgear.gears.faults.Crack.form`.
    roll : (n,) array
        Roll lengths of the stations of a flank [m].
    ring : CrackedRing
        What it changes between the stations of all teeth, those of the left flank first.
    split : SplitGrid
        Grid of the cracked sector.
    """

    form: tuple[float | None, float, float]
    roll: np.ndarray
    ring: CrackedRing
    split: SplitGrid


def cracked_flanks(
    sector: Sector,
    material: Material,
    crack: Crack,
    *,
    flank_elements: int,
    teeth: tuple[float, float] | None = None,
    support: Support | None = None,
    cache: Path | None = None,
) -> CrackedFlanks:
    """Compute what a crack changes in the compliance between all flanks of a gear.

    GeometryError (E-FAULT): a crack that the tooth cannot have.

    Parameters
    ----------
    sector : Sector
        Of the healthy gear.
    flank_elements : int
        Of its grid.
    teeth : (float, float), optional
        Widths over which its flanks carry [m]; the face width without them.
    support : callable, optional
        Foundation of the rim, which is held without it.
    cache : path, optional
        Folder of generated grids.
    """
    whole, split = cracked_grids(sector.gear, crack, flank_elements=flank_elements, cache=cache)
    return flanks_of_grids(sector, material, crack.form, whole, split, teeth=teeth, support=support)


def flanks_of_grids(
    sector: Sector,
    material: Material,
    form: tuple[float | None, float, float],
    whole: Grid,
    split: SplitGrid,
    *,
    teeth: tuple[float, float] | None = None,
    support: Support | None = None,
) -> CrackedFlanks:
    """Compute what the split of a grid changes, as `cracked_flanks`; one that parts nowhere changes nothing.

    Parameters
    ----------
    form : tuple
        Start, angle and depth of the crack, by which it is known.
    whole, split : Grid, SplitGrid
        One grid without the crack and with it.
    """
    gear = sector.gear
    matrices = [crack_stiffness(grid, gear, material, teeth) for grid in (whole, split.grid)]
    healthy, held = sector.stiffness, None if support else "rim"
    if support is not None:
        healthy = healthy + support(sector.grid)
        matrices = [matrix + support(grid) for matrix, grid in zip(matrices, (whole, split.grid), strict=True)]
    stations = flank_stations(sector.grid, gear)
    loads = flank_load_columns(sector.grid, stations)
    options = {"count": gear.teeth, "rim": held, "loads": loads, "observations": loads}
    free = condense_sector(sector.grid, healthy, **options)
    mirrored = both_cuts(free.supported(None))
    of_flanks = [both_flank_loads(grid, gear) for grid in (whole, split.grid)]
    opening = np.zeros((2 * split.grid.n_nodes, len(split.normals)))
    for sign, nodes in zip((1.0, -1.0), split.faces, strict=True):
        for axis in (0, 1):
            opening[2 * nodes + axis, np.arange(len(nodes))] = sign * split.normals[:, axis]
    before = condense_whole(whole, matrices[0], of_flanks[0], held=held)
    after = condense_whole(split.grid, matrices[1], np.hstack([of_flanks[1], opening]), held=held)
    return CrackedFlanks(form, stations.roll, cracked_ring(mirrored, before, after, gear.teeth), split)


def cracked_grids(
    gear: Gear, crack: Crack, *, flank_elements: int, cache: Path | None = None
) -> tuple[Grid, SplitGrid]:
    """Make the grid of a sector with the line of a crack, and the same split along it."""
    start, angle, depth = crack.form
    outline = cracked_sector(gear, angle=angle, depth=depth, start=start, flank_elements=flank_elements)
    grid = mesh_outline(outline, cache=cache)
    edges = dict(grid.boundaries)
    edges["rim"] = np.vstack([edges["rim_right"], edges["rim_left"]])
    grid = replace(grid, boundaries=edges)
    return grid, split_grid(grid, SECTION, len(outline.crack), BESIDE[0])


def crack_stiffness(grid: Grid, gear: Gear, material: Material, teeth: tuple[float, float] | None) -> Any:
    """Assemble the stiffness of a cracked sector with the states and widths of tooth and body [N/m].

    The tooth is what lies beyond the base of the teeth of the healthy grid.
    """
    middle = np.hypot(*grid.points[grid.triangles[:, :3]].mean(axis=1).T)
    base = float(np.hypot(*half_sector(gear).interfaces[0][1][0]))
    tooth = middle < base if gear.internal else middle > base
    regions = {"tooth": np.flatnonzero(tooth), "body": np.flatnonzero(~tooth)}
    state: Any = RING_STATE if gear.internal else TEETH_STATE
    width = max(teeth) if teeth else gear.face_width
    thickness: Any = gear.face_width if width >= gear.face_width else {"tooth": width, "body": gear.face_width}
    return stiffness(replace(grid, regions=regions), material, state=state, thickness=thickness)


def both_flank_loads(grid: Grid, gear: Gear) -> np.ndarray:
    """Unit inward normal forces at the stations of the left flank, then of the right one, (2 nodes, 2n)."""
    right = flank_stations(_reflected(grid), gear)
    loads = np.hstack([flank_load_columns(grid, flank_stations(grid, gear)), flank_load_columns(grid, right)])
    loads[1::2, len(right.roll) :] *= -1.0
    return loads


def _reflected(grid: Grid) -> Grid:
    """A grid in the mirror, with its right flank where the left one was; nodes keep their numbers."""
    return Grid(grid.points * np.array([1.0, -1.0]), grid.triangles, {"flank_left": grid.boundaries["flank_right"]})


@dataclass(frozen=True)
class WindowCrack:
    """A crack as the windows of P positions see it.

    Parameters
    ----------
    flanks : CrackedFlanks
        Of the gear that has it.
    fault : Crack
        Which body it is in.
    windows : (w,) int array
        Those of all windows that lie on this body.
    coordinates : (P, w, 3, R) array
        Basis of `CrackedRing` at the nodes of these windows.
    closed : (P, k) bool array
        Pairs of nodes on its faces that touch.
    """

    flanks: CrackedFlanks
    fault: Crack
    windows: np.ndarray
    coordinates: np.ndarray
    closed: np.ndarray

    def at(self, rows: np.ndarray) -> WindowCrack:
        """Take some of the positions, by their numbers (P',)."""
        return replace(self, coordinates=self.coordinates[rows], closed=self.closed[rows])

    def yielding(self) -> np.ndarray:
        """Compute what the crack adds to the compliance between its windows, (P, w, 3, w, 3) [m/N]."""
        ring, (P, w, nodes, R) = self.flanks.ring, self.coordinates.shape
        B = self.coordinates.reshape(P, w * nodes, R)
        added = B @ ring.core @ B.swapaxes(1, 2)
        for p in np.flatnonzero(self.closed.any(axis=1)):
            on = self.closed[p]
            opened = ring.crossing[on] @ B[p].T
            added[p] -= opened.T @ np.linalg.solve(ring.faces[np.ix_(on, on)], opened)
        return added.reshape(P, w, nodes, w, nodes)

    def soften(self, compliance: np.ndarray, added: np.ndarray) -> None:
        """Add some compliance between its windows (P, w, 3, w, 3) to that between all (P, W, 3, W, 3) [m/N]."""
        # two lists of windows, apart from one another, put their axes first
        compliance[:, self.windows[:, None], :, self.windows] += added.transpose(1, 3, 0, 2, 4)

    def closing(self, moments: np.ndarray) -> np.ndarray:
        """Find the pairs of nodes (P, k) that touch under moments (P, W, 3) of the loads of all windows [N].

        Openings under forces on the faces are ``w = w_0 + F f``, where neither is negative and one of both is zero.
        F is positive definite, so that these forces are those of a non-negative least-squares problem.
        """
        from scipy.optimize import nnls

        ring = self.flanks.ring
        opened = np.einsum("pwnr,pwn->pr", self.coordinates, moments[:, self.windows]) @ ring.crossing.T
        lower = np.linalg.cholesky(ring.faces)
        closed = np.zeros(opened.shape, bool)
        for p in np.flatnonzero((opened < 0.0).any(axis=1)):
            scale = np.abs(opened[p]).max()
            forces, _ = nnls(lower.T, -np.linalg.solve(lower, opened[p] / scale))
            closed[p] = forces > 0.0
        return closed


def window_cracks(setup: MeshWindows, bodies, positions, mesh, pair, windows_of) -> tuple[WindowCrack, ...]:
    """Find the cracks of the bodies as windows at positions (P,) see them, all open.

    ``mesh`` (W,) and ``pair`` (P, W) as of `femgear.contact.assembly.Candidates`; ``windows_of`` lists the windows on
    every body as `femgear.contact.assembly.windows_of_bodies`.
    """
    cracks = []
    for fault in setup.cracks:
        flanks = {crack.form: crack for crack in bodies.gears[fault.gear].cracks}[fault.form]
        (basis, n), faces = (flanks.ring.basis, len(flanks.roll)), len(flanks.ring.faces)
        (body,) = (
            number
            for number, body in enumerate(setup.gears.bodies)
            if body.gear == fault.gear and body.copy == fault.copy
        )
        _, members, place, side = windows_of[body]
        j, i = mesh[members], pair[:, members]
        step = np.array([tooth_steps(setup.gears, m % setup.meshes, p) for m, p in zip(j, place, strict=True)])
        tooth = setup.tooth[place, j, i] + step * setup.turns[positions][:, None]
        away, flank = tooth - (fault.tooth or 0), side
        if fault.flank == RIGHT:
            # the image has its crack on the left
            away, flank = -away, RIGHT - side
        index, weight = station_weights(setup.roll[place, j, positions[:, None], i], flanks.roll)
        index = index + (flank * n)[:, None, None]
        coordinates = (weight[..., None] * basis[(away % len(basis))[..., None, None], index]).sum(axis=-2)
        coordinates /= np.sqrt(bodies.of_kinds(setup.kind(j)))[:, None, None]
        cracks.append(WindowCrack(flanks, fault, members, coordinates, np.zeros((len(positions), faces), bool)))
    return tuple(cracks)
