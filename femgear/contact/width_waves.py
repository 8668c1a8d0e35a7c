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
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array

from femgear.contact.assembly import Candidates, body_compliance, windows_of_bodies
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
from femgear.fe.compliance import condense_sector, tooth_compliance
from femgear.fe.elasticity import Material, material_of_each, stiffness, wave_stiffness
from femgear.gears.pair import EACH

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
    """

    wave_number: np.ndarray
    bodies: tuple[Bodies, ...]

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

    At distances and depths (arrays that broadcast) [m], for a wave number over 0 [1/m]; see the head of the
    module.
    """
    from scipy.special import k0, k1

    r, nu = np.hypot(x, depth), material.poisson_ratio
    wave = 2 * (1 - nu) * k0(wave_number * r) + depth**2 * wave_number * k1(wave_number * r) / r
    return (1 + nu) / (np.pi * material.youngs_modulus) * wave


def width_waves(
    sectors: Sectors,
    material: Material | Sequence[Material],
    slices: int,
    ring_foundation=None,
    helical=(1.0, 1.0),
) -> WidthWaves:
    """Compute the compliance to the waves of as many slices, from sector grids that may be coarse.

    ``material`` is that of the sectors, or one for each; ``ring_foundation`` (2n, 2n) [N/m] that of the ring
    over its face width, which otherwise is held; ``helical`` as in `Bodies`.
    """
    common = tuple(min(pair) for pair in pairwise(one.gear.face_width for one in sectors.gears))
    width, ring = min(common), sectors.ring
    sun_material, planet_material, *ring_material = material_of_each(material, len(sectors.gears))
    wave_number = np.pi / width * np.geomspace(1.0, max(slices - 1, 2), min(_WAVES, max(slices - 1, 2)))
    of_gears = [
        _wave_compliance(one, None, of, wave_number, width)
        for one, of in ((sectors.sun, sun_material), (sectors.planet, planet_material))
    ]
    of_ring: Any = [None] * len(wave_number)
    if ring is not None:
        of_ring = _wave_compliance(ring, ring_foundation, ring_material[0], wave_number, width)
    return WidthWaves(
        wave_number,
        tuple(
            Bodies(sun, planet, ring, common, helical)
            for sun, planet, ring in zip(*of_gears, of_ring, strict=True)
        ),
    )


def with_held_ring(waves: WidthWaves, sectors: Sectors, material: Material) -> WidthWaves:
    """Exchange the ring, of this material, for that which is held at its outer surface."""
    rings = _wave_compliance(sectors.ring, None, material, waves.wave_number, waves.width)
    bodies = (replace(one, ring=ring) for one, ring in zip(waves.bodies, rings, strict=True))
    return replace(waves, bodies=tuple(bodies))


def _wave_compliance(
    sector: Sector, foundation, material: Material, wave_number: np.ndarray, width: float
) -> list[FlankCompliance]:
    """Flank compliance of a gear to every wave, less that to a uniform load, beyond the half space.

    Loads are those over a width [m].
    """
    gear, grid, mu = sector.gear, sector.grid, material.shear_modulus
    stations, depths, loads, observations = observed_flanks(grid, gear)

    def compliance(matrix, support, loads, observations) -> np.ndarray:
        options = {"count": gear.teeth, "rim": "rim", "loads": loads, "observations": observations}
        return tooth_compliance(condense_sector(grid, matrix, **options).supported(support))

    state: Any = RING_STATE if gear.internal else TEETH_STATE
    # a uniform load bends the body of a wider gear over all its width, waves that of the common width
    thickness: Any = {"tooth": 1.0, "body": gear.face_width / width} if gear.face_width > width else 1.0
    plane = stiffness(grid, material, state=state, thickness=thickness)
    support = None if foundation is None else foundation / width
    uniform = compliance(plane, support, loads, observations)
    support = None if foundation is None else foundation / gear.face_width
    loads, observations = (
        np.insert(one, range(2, len(one) + 1, 2), 0.0, axis=0) for one in (loads, observations)
    )
    if support is not None:
        support = coo_array(support)
        place = tuple(3 * (one // 2) + one % 2 for one in support.coords)
        support = csc_array((support.data, place), shape=(3 * grid.n_nodes,) * 2)
    parts, corner = wave_stiffness(grid, material), tip_corner(gear, material)
    arc = stations.roll**2 / (2 * gear.base_radius)
    offset, found = arc[:, None] - arc[None, :], []
    for k in wave_number:
        matrix = (parts[0] + k * parts[1] + k**2 * parts[2]).tocsc()
        change = compliance(matrix, support, loads, observations) - uniform
        once, twice = (
            wave_displacement(offset, depth, k, material)
            - depth_displacement(offset, depth, mu, material.poisson_ratio)
            for depth in (depths, 2 * depths)
        )
        local = np.tile((2 * once - twice) / width, (2, 1, 1))
        regular = regular_compliance(change / width, local)
        found.append(
            FlankCompliance(stations.roll, gear.base_radius, regular, depths[:, 0], corner, local, 0)
        )
    return found


def cosines(slices: int) -> np.ndarray:
    """Make the orthonormal cosine transform over the middles of equal slices, (waves, slices)."""
    m, z = np.arange(slices)[:, None], (np.arange(slices) + 0.5) / slices
    return np.sqrt(np.where(m == 0, 1.0, 2.0) / slices) * np.cos(np.pi * m * z)


def slice_compliance(found: Candidates, rows: np.ndarray, waves: WidthWaves, slices: int) -> np.ndarray:
    """Compute the compliance between the slices of all windows beyond the plane one [m/N].

    (I, P, N, W, N, W), images as of `Candidates`; ``rows`` are positions (P, 1), of helical teeth (P, N).
    """
    setup, W, (P, each) = found.setup, len(found.mesh), rows.shape
    if slices == 1:
        return np.zeros((setup.images, P, 1, W, 1, W))
    wanted = np.pi / waves.width * np.arange(1, slices)
    # weights of the waves that were computed in those of the slices, which are cubics between them
    between = not_a_knot(np.log(waves.wave_number), np.eye(len(waves.wave_number)), np.log(wanted))
    T = cosines(slices)[1:]
    if each > 1:
        return _along_helix(found, rows, waves, wanted, between)
    middle, place = replace(setup, roll=setup.roll[..., 1:2]), rows[:, 0]
    windows = found.position[place], found.mesh, found.pair[place]
    known = np.array([body_compliance(middle, one, *windows)[..., 0, :, 0] for one in waves.bodies])
    change = np.tensordot(between, known, 1)
    kind = setup.kind(found.mesh)
    local = replace(waves, wave_number=wanted).local[:, kind] / waves.bodies[0].of_kinds(kind)
    change[:, 0][..., range(W), range(W)] += local[:, None]
    return np.einsum("ms,mt,mipvw->ipsvtw", T, T, change, optimize=True)


def _along_helix(found: Candidates, rows, waves: WidthWaves, wave_number, between) -> np.ndarray:
    """`slice_compliance` of helical teeth, whose slices are at positions of their own.

    ``between`` (N - 1, K) are the weights of the waves that were computed in those of ``wave_number``.
    """
    setup, W, (P, N) = found.setup, len(found.mesh), rows.shape
    windows = (
        np.tile(found.mesh, N), found.pair[rows].reshape(P, N * W),
        np.repeat(found.position[rows], W, axis=1), np.repeat(np.arange(N), W),
    )  # fmt: skip
    # 2 cos(a z) cos(a z') = cos(a (z - z')) + cos(a (z + z')): of the distance of slices, and of images
    over = np.cos(np.pi / N * np.arange(1, N)[:, None] * np.arange(2 * N)) / N
    across = np.zeros((setup.images, P, N * W, N * W))
    for number, *on_body in windows_of_bodies(setup.gears, windows[0]):
        bodies = [one.gears[number] for one in waves.bodies]
        table = (between @ [one.regular.ravel() for one in bodies]).T @ over
        sectors = across[:1] if number == EACH else across
        _add_along(sectors, setup, bodies[0], table.T.copy(), windows, *on_body)
    _add_beside(across[0], setup, waves, windows, wave_number, over)
    root = np.sqrt(waves.bodies[0].of_kinds(setup.kind(windows[0])))
    return (across / (root[:, None] * root)).reshape(-1, P, N, W, N, W)


def _add_along(across, setup, body: FlankCompliance, table, windows, members, gear, side) -> None:
    """Add what one body yields between its windows and their images, (I, P, ...).

    By a table (2 N, ...) over distances of slices.
    """
    mesh, pair, position, piece = windows
    count, stations = body.regular.shape[:2]
    j, i = mesh[members], pair[:, members]
    index, weight = station_weights(setup.roll[gear, j, position[:, members], i, 1], body.roll)
    index, tooth = index + side[:, None] * len(body.roll), setup.tooth[gear, j, i]
    size, table = table.shape[1], table.ravel()
    for image in range(len(across) // 2 + 1):
        # what an image does to its original, the original does to the image on the other side
        alone = 2 * image % len(across) == 0
        one, two = np.triu_indices(len(members)) if alone else np.indices((len(members),) * 2).reshape(2, -1)
        lag = (tooth[:, one] - tooth[:, two] - image * count // len(across)) % count * stations
        slices = piece[members[one]], piece[members[two]]
        starts = [size * place for place in (np.abs(slices[0] - slices[1]), sum(slices) + 1)]
        values = np.zeros(lag.shape)
        for a, b in np.ndindex(4, 4):
            place = (lag + index[:, one, a]) * stations + index[:, two, b]
            values += weight[:, one, a] * weight[:, two, b] * sum(table[place + start] for start in starts)
        across[image][:, members[one], members[two]] += values
        other = one != two if alone else one >= 0
        across[-image][:, members[two[other]], members[one[other]]] += values[:, other]


def _add_beside(across, setup, waves: WidthWaves, windows, wave_number, over) -> None:
    """Add what the half spaces of both flanks yield between the contacts of one tooth pair in all slices."""
    mesh, pair, position, piece = windows
    for number in np.unique(mesh):
        members = np.flatnonzero(mesh == number)
        one, two = (members[rows] for rows in np.triu_indices(len(members)))
        p, same = np.nonzero(pair[:, one] == pair[:, two])
        one, two, local = one[same], two[same], np.zeros(len(p))
        shape = over[:, np.abs(piece[one] - piece[two])] + over[:, piece[one] + piece[two] + 1]
        for gear, body in enumerate(setup.gears.mates[setup.kind(number)]):
            flank = waves.bodies[0].gears[body]
            rolls = (setup.roll[gear, number, position[p, w], pair[p, w], 1] for w in (one, two))
            arcs = [roll**2 / (2 * flank.base_radius) for roll in rolls]
            factor = (1 - flank.corner.poisson_ratio) / (np.pi * flank.corner.shear_modulus * waves.width)
            beside = _beside(np.abs(arcs[0] - arcs[1]), wave_number[:, None])
            local += factor * (shape * beside).sum(axis=0)
        across[p, one, two] += local
        off = one != two
        across[p[off], two[off], one[off]] += local[off]


def _beside(distance, wave_number) -> np.ndarray:
    """``K0(k x) + ln x`` at distances [m]: what a wave yields on the surface, less a uniform load."""
    from scipy.special import k0

    near = wave_number * distance < 1e-6
    some = np.where(near, 1.0, distance)
    return np.where(near, -np.log(wave_number / 2) - np.euler_gamma, k0(wave_number * some) + np.log(some))
