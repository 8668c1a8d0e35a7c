"""Waves of load across the face width: what bodies yield to each, and between slices of the width.

Load and displacement are sums of cosines over the width b, ``cos(k_m z)``, ``k_m = m pi / b``; its ends are
mirror planes. A body answers each with a compliance ``h_m`` of its own, a plane problem of three
displacements (`femgear.fe.elasticity.wave_stiffness`). Between N equal slices, for forces over the whole
width,

    H = H_plane delta + T^T diag(h_m - h_0) T,    T_ms = sqrt(eps_m / N) cos(k_m z_s),  eps_0 = 1, eps_m = 2,

``T`` being the orthonormal cosine transform. The singular field beside a load is the same in all ``h_m``, so
that ``h_m - h_0`` is smooth and may come from a coarse grid. Without it every slice were a gear of its own.
A load ``cos(k z)`` along a line on the half space moves the point at depth d and distance x into it by

    w = (1 + nu)/(pi E) (2 (1 - nu) K0(k r) + d^2 k K1(k r)/r),    r^2 = x^2 + d^2,

the Fourier transform of Boussinesq's point load (K. L. Johnson, "Contact Mechanics", 1985, section 3.2). Its
limit for long waves is Flamant's line load. As in `femgear.contact.bodies` this part is taken out at depth
and put back at the surface; there waves yield less than a uniform load by ``-K0(k x) - ln x``, beside the
load by ``ln(k/2) + gamma``.

The slices of helical teeth are each at a position of its own, ahead of the one before; their contacts are not
beside one another on the flanks, and ``h_m`` holds between the places where they are.

The width b is the one that all meshes have in common; what wider gears have beyond its ends is left out of
``h_m - h_0``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.sparse import coo_array, csc_array

from femgear.contact.assembly import Candidates, windows_of_bodies
from femgear.contact.bodies import (
    RING_STATE,
    TEETH_STATE,
    Bodies,
    FlankCompliance,
    Sector,
    Sectors,
    observed_flanks,
    regular_compliance,
    station_weights,
)
from femgear.contact.local_compliance import depth_displacement, tip_corner
from femgear.curves import not_a_knot
from femgear.fe.compliance import FreeSector, condense_sector, condense_sums, tooth_compliance
from femgear.fe.elasticity import Material, material_of_each, stiffness, wave_stiffness
from femgear.gears.gear import Gear

_WAVES = 9
"""Wave numbers at which bodies are computed; between them their compliance is interpolated."""


@dataclass(frozen=True)
class WidthWaves:
    """Compliance to waves of load across the width, less that to a uniform load.

    Parameters
    ----------
    wave_number : (M,) array
        [1/m], ascending.
    bodies : tuple of Bodies
        One for every wave number: what bodies yield beyond the half space.
    ring : CondensedWaves, optional
        Whatever holds the ring.
    """

    wave_number: np.ndarray
    bodies: tuple[Bodies, ...]
    ring: CondensedWaves | None = None

    @property
    def width(self) -> float:
        """Face width that all meshes have in common [m]."""
        return self.bodies[0].widths[0]

    @property
    def local(self) -> np.ndarray:
        """What the half spaces of both flanks of every kind of mesh yield beside the load [m/N], (M, kinds).

        Of spur teeth.
        """
        factor = 2.0 / (np.pi * self.bodies[0].contact_moduli * self.width)
        return -factor * (np.log(self.wave_number / 2) + np.euler_gamma)[:, None]


def wave_displacement(x, depth, wave_number: float, material: Material) -> np.ndarray:
    """Compute the displacement into the half space under a line load ``cos(k z)`` [m per N/m].

    At distances and depths (...) [m], which broadcast, for a wave number over 0 [1/m]; see the head of the module.
    """
    from scipy.special import k0, k1

    r, nu = np.hypot(x, depth), material.poisson_ratio
    wave = 2 * (1 - nu) * k0(wave_number * r) + depth**2 * wave_number * k1(wave_number * r) / r
    return (1 + nu) / (np.pi * material.youngs_modulus) * wave


@dataclass(frozen=True)
class CondensedWaves:
    """A gear condensed for waves of load across the width, whatever holds its rim.

    Parameters
    ----------
    sector : Sector
        Its grid may be coarse.
    material : Material
        Of the gear.
    wave_number : (M,) array
        [1/m], ascending.
    width : float
        Face width that all meshes have in common [m].
    uniform : FreeSector
        Under a load that is the same over this width.
    waves : tuple of FreeSector
        Of one metre of the width, under each wave.
    """

    sector: Sector
    material: Material
    wave_number: np.ndarray
    width: float
    uniform: FreeSector
    waves: tuple[FreeSector, ...]

    @cached_property
    def held(self) -> list[FlankCompliance]:
        """Flank compliance to every wave with the rim held, see `supported`."""
        return self.supported(None)

    def supported(self, foundation) -> list[FlankCompliance]:
        """Compute the flank compliance to every wave, less that to a uniform load, beyond the half space.

        ``foundation`` (2n, 2n) [N/m] supports the rim over the face width of the gear; held where it is None.
        Loads are those over the common width.
        """
        gear, grid, material = self.sector.gear, self.sector.grid, self.material
        stations, depths, *_ = observed_flanks(grid, gear)
        uniform = tooth_compliance(self.uniform.supported(None if foundation is None else foundation / self.width))
        support = None
        if foundation is not None:
            entries = coo_array(foundation / gear.face_width)
            place = tuple(3 * (coord // 2) + coord % 2 for coord in entries.coords)
            support = csc_array((entries.data, place), shape=(3 * grid.n_nodes,) * 2)
        corner = tip_corner(gear, material)
        arc = stations.roll**2 / (2 * gear.base_radius)
        offset, compliances = arc[:, None] - arc[None, :], []
        for k, free in zip(self.wave_number, self.waves, strict=True):
            change = tooth_compliance(free.supported(support)) - uniform
            once, twice = (
                wave_displacement(offset, depth, k, material)
                - depth_displacement(offset, depth, material.shear_modulus, material.poisson_ratio)
                for depth in (depths, 2 * depths)
            )
            local = np.tile((2 * once - twice) / self.width, (2, 1, 1))
            regular = regular_compliance(change / self.width, local)
            compliances.append(
                FlankCompliance(stations.roll, gear.base_radius, regular, depths[:, 0], corner, local, 0)
            )
        return compliances


def condensed_waves(sector: Sector, material: Material, slices: int, width: float) -> CondensedWaves:
    """Condense a gear for the waves of as many slices of a face width that all meshes have in common [m]."""
    gear, grid = sector.gear, sector.grid
    _, _, loads, observations = observed_flanks(grid, gear)
    options: Any = {"count": gear.teeth, "rim": "rim"}
    state: Any = RING_STATE if gear.internal else TEETH_STATE
    # a uniform load bends the body of a wider gear over all its width, waves that of the common width
    thickness: Any = {"tooth": 1.0, "body": gear.face_width / width} if gear.face_width > width else 1.0
    plane = stiffness(grid, material, state=state, thickness=thickness)
    uniform = condense_sector(grid, plane, loads=loads, observations=observations, **options)
    loads, observations = (
        np.insert(columns, range(2, len(columns) + 1, 2), 0.0, axis=0) for columns in (loads, observations)
    )
    k = np.pi / width * np.geomspace(1.0, max(slices - 1, 2), min(_WAVES, max(slices - 1, 2)))
    parts, powers = wave_stiffness(grid, material), k[:, None] ** np.arange(3)
    waves = condense_sums(grid, parts, powers, loads=loads, observations=observations, **options)
    condensed = CondensedWaves(sector, material, k, width, uniform, tuple(waves))
    _ = condensed.held  # every set needs it, if only beside that on a foundation
    return condensed


def common_width(gears: Sequence[Gear]) -> tuple[float, ...]:
    """Find the face width that both gears of every kind of mesh have in common [m]."""
    return tuple(min(pair) for pair in pairwise(gear.face_width for gear in gears))


def width_waves(
    sectors: Sectors,
    material: Material | Sequence[Material],
    slices: int,
    ring_foundation=None,
    helical=(1.0, 1.0),
) -> WidthWaves:
    """Compute the compliance to the waves of as many slices, from sector grids that may be coarse.

    ``material`` is that of the sectors, or one for each; ``ring_foundation`` and ``helical`` as in
    `waves_of_gears`.
    """
    width, gears = common_width([sector.gear for sector in sectors.gears])[0], sectors.gears
    materials = material_of_each(material, len(gears))
    condensed = [condensed_waves(sector, of, slices, width) for sector, of in zip(gears, materials, strict=True)]
    return waves_of_gears(condensed, ring_foundation, helical)


def waves_of_gears(gears: Sequence[CondensedWaves], ring_foundation=None, helical=(1.0, 1.0)) -> WidthWaves:
    """Compute the compliance of a set to waves across the width, sun and planets held at their bores.

    ``ring_foundation`` (2n, 2n) [N/m] is that of the ring over its face width, which otherwise is held;
    ``helical`` as in `Bodies`.
    """
    common, ring = common_width([gear_waves.sector.gear for gear_waves in gears]), gears[-1] if len(gears) > 2 else None
    bodies = zip(*(gear_waves.held for gear_waves in gears), strict=True)
    waves = WidthWaves(
        gears[0].wave_number, tuple(Bodies(gear_bodies, common, helical) for gear_bodies in bodies), ring
    )
    return waves if ring_foundation is None else with_ring_waves(waves, ring_foundation)


def with_ring_waves(waves: WidthWaves, foundation=None) -> WidthWaves:
    """Exchange the ring: held at its outer surface, or on a foundation (2n, 2n) [N/m]."""
    ring = waves.ring
    assert ring is not None
    rings = ring.held if foundation is None else ring.supported(foundation)
    bodies = (
        bodies_of_wave.with_gear(-1, of_wave) for bodies_of_wave, of_wave in zip(waves.bodies, rings, strict=True)
    )
    return replace(waves, bodies=tuple(bodies))


def cosines(slices: int) -> np.ndarray:
    """Make the orthonormal cosine transform over the middles of equal slices, (waves, slices)."""
    m, z = np.arange(slices)[:, None], (np.arange(slices) + 0.5) / slices
    return np.sqrt(np.where(m == 0, 1.0, 2.0) / slices) * np.cos(np.pi * m * z)


def slice_compliance(
    candidates: Candidates, rows: np.ndarray, waves: Sequence[WidthWaves], slices: int
) -> list[np.ndarray]:
    """Compute the compliance between the slices of all windows beyond the plane one [m/N].

    For each of several ``waves`` of the same material, whose gears may be the same ones. (I, P, N, W, N, W),
    images as of `Candidates`; ``rows`` are positions (P, 1), of helical teeth (P, N).
    """
    setup, W, (P, each) = candidates.setup, len(candidates.mesh), rows.shape
    if slices == 1:
        return [np.zeros((setup.images, P, 1, W, 1, W)) for _ in waves]
    wave_number = waves[0].wave_number
    wanted = np.pi / waves[0].width * np.arange(1, slices)
    # weights of the waves that were computed in those of the slices, which are cubics between them
    between = not_a_knot(np.log(wave_number), np.eye(len(wave_number)), np.log(wanted))
    if each > 1:
        return _along_helix(candidates, rows, waves, wanted, between)
    place, kind = rows[:, 0], setup.kind(candidates.mesh)
    there = np.asarray(candidates.candidate.any(axis=-1))
    windows = candidates.mesh, candidates.pair[place], there[place], candidates.position[place]
    T = cosines(slices)[1:]
    alone = T[:, :, None] * T[:, None, :]
    shapes = np.tensordot(between, alone, (0, 0)).reshape(len(wave_number), -1)
    softer = waves[0].bodies[0].of_kinds(kind)
    local = np.tensordot(replace(waves[0], wave_number=wanted).local[:, kind] / softer, alone, (0, 0))

    def add(across, bodies: list[FlankCompliance], *on_body) -> None:
        """Add one body under every wave that was computed."""
        table = np.stack([body.regular for body in bodies], axis=1)
        _add_between(across, setup, bodies[0], table, windows, *on_body)

    result = []
    for change in _over_bodies(candidates, windows, waves, add, (len(wave_number),)):
        change = change / np.sqrt(softer[:, None] * softer)[..., None]
        across = (change @ shapes).reshape(*change.shape[:-1], slices, slices)
        across[0][:, range(W), range(W)] += local
        result.append(np.ascontiguousarray(across.transpose(0, 1, 4, 2, 5, 3)))
    return result


def _over_bodies(candidates: Candidates, windows, waves: Sequence[WidthWaves], add, further=()) -> list[np.ndarray]:
    """Sum up what all bodies yield between windows and their images under each waves, (I, P, W, W, *further).

    ``add(across, bodies, members, gear, side)`` adds one gear by its compliances under all waves. Gears that
    are the same in all are added once.
    """
    setup, count = candidates.setup, windows[1].shape[1]
    shape = setup.images, len(windows[1]), count, count, *further
    shared, per_set = np.zeros(shape), [np.zeros(shape) for _ in waves[1:]]
    per_set = [np.zeros(shape if per_set else 1), *per_set]
    for number, *on_body in windows_of_bodies(setup.gears, windows[0]):
        of_waves = [[set_bodies.gears[number] for set_bodies in of_set.bodies] for of_set in waves]
        if of_waves[0][0] is None:
            continue
        sectors = slice(1) if setup.gears.repeated[number] else slice(None)
        if all(bodies[0] is of_waves[0][0] for bodies in of_waves):
            add(shared[sectors], of_waves[0], *on_body)
            continue
        for across, bodies in zip(per_set, of_waves, strict=True):
            add(across[sectors], bodies, *on_body)
    return [shared + part for part in per_set]


def _along_helix(candidates: Candidates, rows, waves: Sequence[WidthWaves], wave_number, between) -> list[np.ndarray]:
    """`slice_compliance` of helical teeth, whose slices are at positions of their own.

    ``between`` (N - 1, K) are the weights of the waves that were computed in those of ``wave_number``.
    """
    setup, W, (P, N) = candidates.setup, len(candidates.mesh), rows.shape
    windows = (
        np.tile(candidates.mesh, N),
        candidates.pair[rows].reshape(P, N * W),
        np.asarray(candidates.candidate.any(axis=-1))[rows].reshape(P, N * W),
        np.repeat(candidates.position[rows], W, axis=1),
        np.repeat(np.arange(N), W),
    )
    # 2 cos(a z) cos(a z') = cos(a (z - z')) + cos(a (z + z')): of the distance of slices, and of images
    over = np.cos(np.pi / N * np.arange(1, N)[:, None] * np.arange(2 * N)) / N
    number = np.arange(N)
    apart, images = np.abs(number[:, None] - number), number[:, None] + number + 1
    tables: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def add(across, bodies: list[FlankCompliance], *on_body) -> None:
        """Add one body, by its compliance between slices; of sun and ring one flank carries."""
        (members, gear, side), n = on_body, len(bodies[0].roll)
        body_key = id(bodies[0])
        if body_key not in tables:
            first = side[0] * n if (side == side[0]).all() else 0
            part = slice(first, first + n if (side == side[0]).all() else None)
            regular = np.array([body.regular[:, part, part] for body in bodies])
            table = ((between.T @ over).T @ regular.reshape(len(bodies), -1)).reshape(-1, *regular.shape[1:])
            tables[body_key] = table[apart] + table[images], side - first // n
        table, side = tables[body_key]
        _add_between(across, setup, bodies[0], table, windows, members, gear, side)

    beside = np.zeros((P, N * W, N * W))
    _add_beside(beside, setup, waves[0], windows, wave_number, over)
    root, result = np.sqrt(waves[0].bodies[0].of_kinds(setup.kind(windows[0]))), []
    for across in _over_bodies(candidates, windows, waves, add):
        across[0] += beside
        across /= root[:, None] * root
        result.append(across.reshape(-1, P, N, W, N, W))
    return result


def _add_between(across, setup, body: FlankCompliance, table, windows, members, gear, side) -> None:
    """Add what one body yields between its windows and to their images, (I, P, W, W, ...).

    ``windows`` are mesh (W,), pair (P, W), whether it is there (P, W), and position (P,); ``table`` (teeth,
    K, 2n, 2n) are K compliances. Of helical teeth the positions are (P, W), with the slice (W,) behind them,
    and the one compliance is a ``table`` (N, N, teeth, 2n, 2n) between slices.
    """
    mesh, pair, there, position, *piece = windows
    count, stations = len(body.regular), len(body.roll)
    j, i = mesh[members], pair[:, members]
    position = position[:, members] if position.ndim > 1 else position[:, None]
    index, weight = station_weights(setup.roll[gear, j, position, i, 1], body.roll)
    # the four stations of a place follow one another
    first, tooth = index[..., 0] + side * stations, setup.tooth[gear, j, i]
    blocks = sliding_window_view(table, (4, 4), axis=(-2, -1))
    there = there[:, members]
    for image in range(len(across) // 2 + 1):
        # what an image does to its original, the original does to the image on the other side
        alone = 2 * image % len(across) == 0
        for p in range(len(pair)):
            windows_here = np.flatnonzero(there[p])
            every = np.triu_indices(len(windows_here)) if alone else np.indices((len(windows_here),) * 2).reshape(2, -1)
            window_1, window_2 = windows_here[every[0]], windows_here[every[1]]
            lag = (tooth[p, window_1] - tooth[p, window_2] - image * count // len(across)) % count
            places = first[p, window_1], first[p, window_2]
            weights = weight[p, window_1][:, :, None] * weight[p, window_2][:, None, :]
            if piece:
                slices = piece[0][members[window_1]], piece[0][members[window_2]]
                values = np.einsum("nab,nab->n", blocks[*slices, lag, *places], weights)
            else:
                values = np.einsum("nkab,nab->nk", blocks[lag, :, *places], weights)
            other = window_1 != window_2 if alone else slice(None)
            across[image, p, members[window_1], members[window_2]] += values
            across[-image, p, members[window_2[other]], members[window_1[other]]] += values[other]


def _add_beside(across, setup, waves: WidthWaves, windows, wave_number, over) -> None:
    """Add what the half spaces of both flanks yield between the contacts of one tooth pair in all slices."""
    mesh, pair, there, position, piece = windows
    for number in np.unique(mesh):
        members = np.flatnonzero(mesh == number)
        window_1, window_2 = (members[rows] for rows in np.triu_indices(len(members)))
        p, same = np.nonzero((pair[:, window_1] == pair[:, window_2]) & there[:, window_1] & there[:, window_2])
        window_1, window_2, local = window_1[same], window_2[same], np.zeros(len(p))
        shape = over[:, np.abs(piece[window_1] - piece[window_2])] + over[:, piece[window_1] + piece[window_2] + 1]
        for gear, body in enumerate(setup.gears.mates[setup.kind(number)]):
            flank = waves.bodies[0].gears[body]
            rolls = (setup.roll[gear, number, position[p, w], pair[p, w], 1] for w in (window_1, window_2))
            arcs = [roll**2 / (2 * flank.base_radius) for roll in rolls]
            factor = (1 - flank.corner.poisson_ratio) / (np.pi * flank.corner.shear_modulus * waves.width)
            beside = _beside(np.abs(arcs[0] - arcs[1]), wave_number[:, None])
            local += factor * (shape * beside).sum(axis=0)
        across[p, window_1, window_2] += local
        off = window_1 != window_2
        across[p[off], window_2[off], window_1[off]] += local[off]


def _beside(distance, wave_number) -> np.ndarray:
    """``K0(k x) + ln x`` at distances [m]: what a wave yields on the surface, less a uniform load."""
    from scipy.special import k0

    near = wave_number * distance < 1e-6
    regular_distance = np.where(near, 1.0, distance)
    return np.where(
        near, -np.log(wave_number / 2) - np.euler_gamma, k0(wave_number * regular_distance) + np.log(regular_distance)
    )
