"""The contact problem of a planetary set at one position: cells, separations, compliance, motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.candidates import (
    FlankPair,
    Windows,
    cell_centres,
    cell_edges,
    flank_pair,
    pair_separations,
    profile_form,
    window_polynomials,
    windows,
)
from femgear.contact.flanks import LEFT, RIGHT, FlankCompliance, station_weights
from femgear.contact.halfplane import hertz_line, surface_displacement
from femgear.contact.sides import BACK, DRIVE, flank_side, side_teeth

if TYPE_CHECKING:
    from femgear.contact.supports import MovingMembers
    from femgear.fe.elasticity import Material
    from femgear.gears.deviations import SetDeviations
    from femgear.gears.planetary import PlanetarySet


@dataclass(frozen=True)
class Bodies:
    """Flank compliances of the three kinds of gears and their common material."""

    sun: FlankCompliance
    planet: FlankCompliance
    ring: FlankCompliance
    material: Material
    face_width: float


@dataclass(frozen=True)
class MeshWindows:
    """Contact windows of all meshes and positions; arrays lead with (meshes, P, pairs).

    There are 2N meshes, or 4N with the back flanks.

    Parameters
    ----------
    zeta : array
        Path coordinates [m].
    near : bool array
        Candidate pairs.
    smallest_gap : array
        Smallest separation in the window [m].
    gap : array (..., cells)
        Separation at the cells [m].
    roll : tuple of two arrays (..., 3)
        Roll lengths of the window nodes on gear 1 and gear 2 [m].
    edge : tuple of two bool arrays
        Whether the low and the high end of the window are ends of a flank.
    tooth : tuple of two integer arrays (2N, pairs)
        Tooth numbers on gear 1 and gear 2 during the first mesh period.
    turns : (P,) int array
        Mesh periods passed at each position; one of the record's periods has one number.
    layout : int array
        Division of the window into cells, see `candidates.cell_edges`.
    local : (2, 4, cells, cells) array
        Half-plane compliance of both bodies within a window [m/N], for the two kinds of mesh and all layouts.
    cell : (2N,) array
        Mean width of a pressure cell along the profile [m].
    cell_area : (2N, 4, cells) array
        Areas of the pressure cells [m^2].
    centre : array
        From the point on the path of contact to the middle of the window, along flank 1 [m].
    """

    n_planets: int
    positions: int
    pairs: int
    zeta: np.ndarray
    near: np.ndarray
    smallest_gap: np.ndarray
    gap: np.ndarray
    roll: tuple[np.ndarray, np.ndarray]
    edge: tuple[np.ndarray, np.ndarray]
    tooth: tuple[np.ndarray, np.ndarray]
    turns: np.ndarray
    layout: np.ndarray
    local: np.ndarray
    cell: np.ndarray
    cell_area: np.ndarray
    centre: np.ndarray


@dataclass(frozen=True)
class ContactProblem:
    """``gap + H p - G q >= 0, p >= 0``, with the place of every candidate.

    ``H`` is the compliance of the gears; ``supports`` (2N, 2N) that of sprung members between the meshes,
    which `compliance` adds to every pair of candidates.
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
        """Compliance of gears and supports between all candidates [m/N]."""
        if not self.supports.any():
            return self.H
        return self.H + self.supports[np.ix_(self.mesh, self.mesh)]

    def warm_start(self, other: ContactProblem, active: np.ndarray) -> np.ndarray:
        """Active candidates of another position, matched by mesh, pair and cell."""
        key = (self.mesh * 1000 + self.pair) * 1000 + self.cell
        other_key = (other.mesh * 1000 + other.pair) * 1000 + other.cell
        return np.isin(key, other_key[active])

    def touches_window_end(self, active: np.ndarray, setup: MeshWindows) -> bool:
        """Whether a contact ends where its window ends, other than at an end of a flank."""
        low, high = (edge[self.mesh, self.position, self.pair] for edge in setup.edge)
        last = setup.gap.shape[-1] - 1
        return bool(np.any(active & (((self.cell == 0) & ~low) | ((self.cell == last) & ~high))))

    def at_flank_end(self, active: np.ndarray, setup: MeshWindows) -> np.ndarray:
        """Whether each candidate belongs to a contact that reaches the end of a flank, shape (n,)."""
        low, high = (edge[self.mesh, self.position, self.pair] for edge in setup.edge)
        window = self.mesh * setup.pairs + self.pair
        last = np.zeros(int(window.max()) + 1, int)
        np.maximum.at(last, window, self.cell)
        ends = active & (((self.cell == 0) & low) | ((self.cell == last[window]) & high))
        reached = np.zeros(len(last), bool)
        reached[window[ends]] = True
        return reached[window]


def mesh_pairs(planetary_set: PlanetarySet) -> tuple[FlankPair, FlankPair]:
    """The flank pairs sun-planet and planet-ring."""
    s = planetary_set
    return (
        flank_pair(s.sun, s.planet, s.centre_distance, s.working_pressure_angle_sun_planet),
        flank_pair(s.planet, s.ring, s.centre_distance, s.working_pressure_angle_planet_ring),
    )


def acting_flanks(n_planets: int) -> tuple[list, list, list]:
    """Drive flanks (mesh, gear of the pair, side) of the sun, of every planet and of the ring."""
    N = n_planets
    # gear 2 of the sun mesh and gear 1 of the ring mesh are the same planet, on its two flanks
    planets = [[(n, 1, LEFT), (N + n, 0, RIGHT)] for n in range(N)]
    return [(j, 0, LEFT) for j in range(N)], planets, [(N + j, 1, LEFT) for j in range(N)]


def contact_half_width(pair: FlankPair, line_load: float, material: Material) -> float:
    """Largest Hertzian half width on the path of contact [m] of one tooth pair under `line_load` [N/m]."""
    begin, end = pair.path
    zeta = np.linspace(begin, end, 51)[1:-1]
    rho_1, rho_2 = pair.pitch_roll_1 + zeta, pair.pitch_roll_2 - pair.sign * zeta
    radius = (rho_1 * rho_2 / (rho_2 + pair.sign * rho_1)).max()
    modulus = material.youngs_modulus / (2 * (1 - material.poisson_ratio**2))
    return hertz_line(line_load, radius, modulus).half_width


def mesh_windows(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    share: float,
    positions: int | np.ndarray,
    cells: int,
    nearest: float,
    contact: str,
    periods: int = 1,
    deviations: SetDeviations | None = None,
    planet_gaps=None,
    both_flanks: bool = False,
) -> MeshWindows:
    """Windows of every mesh at every position.

    Parameters
    ----------
    planetary_set : PlanetarySet
    bodies : Bodies
    share : float
        Mesh force that sizes the windows [N].
    positions : int or (P,) array
        Number of equidistant positions in one mesh period, or the positions themselves [mesh periods].
    cells : int
        Pressure cells in a window.
    nearest : float
        Pairs are candidates whose separation exceeds that of the nearest pair of their mesh by less [m].
    contact : {"profile", "line_of_action"}
    periods : int
        Number of mesh periods.
    deviations : SetDeviations, optional
    planet_gaps : (N,) array, optional
        Extra separation of the sun-side flanks of each planet [m].
    both_flanks : bool
        Back flanks as well, as meshes 2N .. 4N - 1.
    """
    pitch = planetary_set.sun.base_pitch
    pairs = mesh_pairs(planetary_set)
    tau = cycle_positions(positions, periods=periods)
    # mesh periods are those of the record: one that ends at zero has its seams just after whole positions
    turns = (np.ceil(tau) if tau[-1] <= 0.0 else np.floor(tau)).astype(int)
    begin = min(p.path[0] for p in pairs) / pitch
    end = max(p.path[1] for p in pairs) / pitch
    count = int(np.ceil(end - begin)) + 4
    found, teeth = [], []
    for direction in (DRIVE, BACK) if both_flanks else (DRIVE,):
        side = flank_side(planetary_set, direction)
        passed = direction * (tau - turns)
        lowest = np.floor(begin - side.phase - np.ceil(passed.max())).astype(int) - 1
        index = lowest[:, None] + np.arange(count)
        zeta = pitch * (passed[None, :, None] + side.phase[:, None, None] + index[:, None, :])
        tooth = side_teeth(planetary_set, index, direction)
        shift = pair_separations(planetary_set, deviations, tooth, turns, tau, back=direction < 0)
        shift += side.clearance[:, None, None]
        if direction > 0 and planet_gaps is not None:
            shift[: planetary_set.n_planets] += np.asarray(planet_gaps, float)[:, None, None]
        form = [profile_form(planetary_set, deviations, kind, direction < 0) for kind in (0, 1)]
        found += _side_windows(
            planetary_set, bodies, pairs, zeta, shift, form, share, cells, nearest, contact
        )
        teeth.append(tooth)
    tooth = tuple(np.concatenate([t[gear] for t in teeth]) for gear in (0, 1))
    return _gather(found, tooth, turns, planetary_set.n_planets, bodies, cells)


def cycle_positions(positions, *, periods: int = 1) -> np.ndarray:
    """Positions in mesh periods, (P,): as given, or equidistant ones from the pitch point on."""
    if np.ndim(positions):
        return np.asarray(positions, float)
    return np.arange(positions * periods) / positions


def assemble_contact(
    setup: MeshWindows, bodies: Bodies, position: int, members: MovingMembers | None = None
) -> ContactProblem:
    """The complementarity problem of all meshes at one position.

    The motions are those of the planets and of the sun, as arcs on their base circles [m], positive in the
    direction in which the sun drives, and then the free motions of `members`.
    """
    N = setup.n_planets
    mesh, pair = np.nonzero(setup.near[:, position])
    cells = setup.gap.shape[-1]
    H = _regular_part(setup, bodies, position, mesh, pair)
    layout, n = setup.layout[mesh, position, pair], len(mesh)
    polynomials = window_polynomials(cells)[layout]
    H = polynomials[:, None] @ H.transpose(0, 2, 1, 3) @ polynomials.transpose(0, 2, 1)
    H[np.arange(n), np.arange(n)] += setup.local[mesh // N % 2, layout]
    H[np.arange(n), np.arange(n)] += _corner_part(setup, bodies, position, mesh, pair, polynomials)
    H = H.transpose(0, 2, 1, 3)
    gap = setup.gap[mesh, position, pair].ravel()
    keep = np.isfinite(gap)
    H = H.reshape(n * cells, n * cells)[np.ix_(keep, keep)]
    of_cell = np.repeat(mesh, cells)[keep]
    sides = setup.near.shape[0] // (2 * N)
    approach = np.vstack([rotation_approach(N), -rotation_approach(N)])[: 2 * N * sides]
    supports = np.zeros((len(approach), len(approach)))
    if members is not None:
        approach = np.hstack([approach, members.approach[:, members.free]])
        supports = members.compliance
    return ContactProblem(
        n_planets=N,
        H=H,
        gap=gap[keep],
        G=approach[of_cell],
        supports=supports,
        mesh=of_cell,
        pair=np.repeat(pair, cells)[keep],
        cell=np.tile(np.arange(cells), n)[keep],
        area=setup.cell_area[mesh, layout].ravel()[keep],
        position=position,
    )


def rotation_approach(n_planets: int) -> np.ndarray:
    """Approach of the flanks per unit base-circle arc of each planet and of the sun, shape (2N, N + 1)."""
    N = n_planets
    approach = np.zeros((2 * N, N + 1))
    approach[:N, :N] = -np.eye(N)
    approach[N:, :N] = np.eye(N)
    approach[:N, N] = 1.0
    return approach


def local_compliance(width: float, cells: int, bodies: Bodies) -> np.ndarray:
    """Half-plane compliance of both flanks between the cells of a window, shape (4, cells, cells) [m/N]."""
    material, centre = bodies.material, width * cell_centres(cells)
    half = 0.5 * width * np.diff(cell_edges(cells))
    distance = centre[:, :, None] - centre[:, None, :]
    # reciprocal between cells of different widths
    return (
        sum(
            surface_displacement(distance, h, material.shear_modulus, material.poisson_ratio)
            for h in (half[:, :, None], half[:, None, :])
        )
        / bodies.face_width
    )


def _side_windows(planetary_set, bodies, pairs, zeta, shift, form, share, cells, nearest, contact):
    """Windows of both kinds of mesh on one side of the teeth."""
    N = planetary_set.n_planets
    found = []
    for kind, pair in enumerate(pairs):
        half_width = contact_half_width(pair, share / bodies.face_width, bodies.material)
        rows = slice(kind * N, (kind + 1) * N)
        found.append(
            windows(
                pair,
                zeta[rows],
                width=3.2 * half_width,
                cells=cells,
                nearest=nearest,
                line_of_action=contact == "line_of_action",
                form=form[kind],
                shift=shift[rows],
            )
        )
    return found


def _gather(found: list[Windows], tooth, turns, N, bodies, cells) -> MeshWindows:
    """Join all meshes and drop the leading and trailing pairs that never come near."""
    used = np.concatenate([w.near.any(axis=1) for w in found])
    # every mesh keeps the same number of pairs, starting at its own first candidate
    first = used.argmax(axis=1)
    count = int((used.shape[1] - used[:, ::-1].argmax(axis=1) - first).max())
    first = np.minimum(first, used.shape[1] - count)
    take = first[:, None] + np.arange(count)
    row = np.arange(len(used))[:, None]

    def join(name):
        joined = np.concatenate([getattr(w, name) for w in found])
        return np.moveaxis(np.moveaxis(joined, 2, 1)[row, take], 1, 2)

    gap = join("gap")
    shares = np.diff(cell_edges(cells))
    return MeshWindows(
        n_planets=N,
        positions=len(turns),
        pairs=count,
        zeta=join("zeta"),
        near=join("near"),
        smallest_gap=gap.min(axis=-1),
        gap=gap,
        roll=(join("roll_1"), join("roll_2")),
        edge=(join("at_low_edge"), join("at_high_edge")),
        tooth=(tooth[0][row, take], tooth[1][row, take]),
        turns=turns,
        layout=join("layout"),
        local=np.stack([local_compliance(w.cell * cells, cells, bodies) for w in found[:2]]),
        cell=np.repeat([w.cell for w in found], N),
        cell_area=np.repeat([w.cell * cells * bodies.face_width * shares for w in found], N, axis=0),
        centre=join("centre"),
    )


def _regular_part(setup: MeshWindows, bodies: Bodies, position, mesh, pair) -> np.ndarray:
    """Regular compliance between the window nodes, shape (windows, 3, windows, 3) [m/N]."""
    N = setup.n_planets
    n = len(mesh)
    S = np.zeros((n, 3, n, 3))
    # on the back side every gear carries on its other flank
    back = mesh >= 2 * N
    sun_side = mesh % (2 * N) < N
    left, right = np.where(back, RIGHT, LEFT), np.where(back, LEFT, RIGHT)
    everything = np.arange(n)
    sun = everything[sun_side]
    _add_body(S, bodies.sun, setup, position, mesh, pair, sun, np.zeros(len(sun), int), left[sun])
    for planet in range(N):
        members = everything[mesh % N == planet]
        is_ring = ~sun_side[members]
        # gear 2 of the sun mesh and gear 1 of the ring mesh are the same planet, on its two flanks
        gear, side = np.where(is_ring, 0, 1), np.where(is_ring, right[members], left[members])
        _add_body(S, bodies.planet, setup, position, mesh, pair, members, gear, side)
    ring = everything[~sun_side]
    _add_body(S, bodies.ring, setup, position, mesh, pair, ring, np.ones(len(ring), int), left[ring])
    return S


def _add_body(S, body: FlankCompliance, setup, position, mesh, pair, members, gear, side):
    """Add the compliance of one body between the windows `members` that lie on it."""
    if not len(members):
        return
    j, i = mesh[members], pair[members]
    roll = np.where(gear[:, None] == 0, setup.roll[0][j, position, i], setup.roll[1][j, position, i])
    tooth = np.where(gear == 0, setup.tooth[0][j, i], setup.tooth[1][j, i])
    index, weight = station_weights(roll, body.roll)
    index = index + side[:, None, None] * len(body.roll)
    lag = (tooth[:, None] - tooth[None, :]) % len(body.regular)
    values = body.regular[
        lag[:, None, None, :, None, None],
        index[:, :, :, None, None, None],
        index[None, None, None, :, :, :],
    ]
    block = np.einsum("wapvbq,wap,vbq->wavb", values, weight, weight, optimize=True)
    S[np.ix_(members, range(3), members, range(3))] += block


def _corner_part(setup: MeshWindows, bodies: Bodies, position, mesh, pair, polynomials) -> np.ndarray:
    """What tip corners of both flanks add within each window, shape (windows, cells, cells) [m/N]."""
    total = np.zeros((len(mesh), polynomials.shape[1], polynomials.shape[1]))
    sun_side = mesh // setup.n_planets % 2 == 0
    of_gear = ((bodies.sun, bodies.planet), (bodies.planet, bodies.ring))
    for rows, flanks in zip((sun_side, ~sun_side), of_gear, strict=True):
        for roll, flank in zip(setup.roll, flanks, strict=True):
            arc = roll[mesh[rows], position, pair[rows]] ** 2 / (2 * flank.base_radius)
            away = np.einsum("wcn,wn->wc", polynomials[rows], np.abs(arc - flank.corner.arc))
            # cells beyond the end of a flank are no candidates
            away = np.maximum(away, 1e-12)
            total[rows] += flank.corner.surface(away[:, :, None], away[:, None, :])
    return total / bodies.face_width
