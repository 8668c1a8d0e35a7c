"""Answer of gears and structure to forces of the meshes at one speed, a small system for each harmonic.

With the mean stiffness k0 of the meshes, which the modes of the gears contain, and forces e beyond it the
harmonics of the meshes know nothing of one another (`femgear.housing.two_way.response`). In a block, of the orders
``h z_ring + r`` of one harmonic h, the gears answer every side band r alone, the structure couples them:

    d = d_0 - T e + T[:, ring] k0 u          (deflection of the meshes against a rigid ring)
    u = u_0 + R f_ring                       (what the ring gives way),   f_ring = e_ring + k0 (d_ring - u)
    (1 + R A) u = u_0 + R (e_ring + k0 (d_0 - T e)_ring),   A = k0 - k0 T_ring,ring k0.

Waves of the structure up to a nodal diameter act on one another. Of those beyond, as of an axisymmetric ring,
each acts on itself alone: u at a side band by the force at the same one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.housing.two_way.carrier_orders import CarrierOrders, LeadingMeshes, receptance
from femgear.housing.two_way.structure import FixedStructure
from femgear.solvers.periodic.spectral import compliance

_TOGETHER = 20e6
"""Size of the receptances of a structure that are in memory together [bytes]."""


@dataclass(frozen=True)
class HarmonicBlocks:
    """Blocks of one speed of the carrier [rad/s], see `blocks_of_speed`; G leaders, J = 2 G meshes.

    Parameters
    ----------
    gears : LeadingMeshes
        Modes of gears and carrier, and the leading meshes.
    structure : FixedStructure
        Ring and casing that stand still.
    orders : CarrierOrders
        Lines and side bands of the blocks.
    place : (G,) array
        Angles of the leaders' forces on the ring [rad].
    speed : float
        Of the carrier [rad/s].
    compliance : (J, J, B, R) complex array
        T [m/N].
    spring : (G, G, B, R) complex array
        A [N/m].
    yielding : (B, G R, G R) complex array
        ``(1 + R A)^-1 R`` [m/N].
    """

    gears: LeadingMeshes
    structure: FixedStructure
    orders: CarrierOrders
    place: np.ndarray
    speed: float
    compliance: np.ndarray
    spring: np.ndarray
    yielding: np.ndarray

    def deflections(self, extra: np.ndarray, moved: Any = 0.0, given: Any = None) -> tuple[np.ndarray, Any]:
        """Compute deflections d (J, B, R) and what the ring gives way u (G, B, R), by forces e (J, B, R).

        And by ``d_0`` and ``u_0`` of the same shapes [m].
        """
        G, mean = len(self.place), self.gears.mean[:, None, None]
        still = moved - _times(self.compliance, extra)
        force = extra[G:] + mean[G:] * still[G:]
        if given is not None:
            force -= _times(self.spring, given)
        rows = force.transpose(1, 0, 2).reshape(len(self.yielding), -1, 1)
        way = (self.yielding @ rows).reshape(-1, *force.shape[::2]).transpose(1, 0, 2)
        if given is not None:
            way = way + given
        return still + _times(self.compliance[:, G:], mean[G:] * way), way

    def part(self, numbers: np.ndarray) -> HarmonicBlocks:
        """Some of the blocks by their numbers (b,), for deflections and forces."""
        compliance, spring = self.compliance[:, :, numbers], self.spring[:, :, numbers]
        return replace(self, compliance=compliance, spring=spring, yielding=self.yielding[numbers])

    def forces(self, extra: np.ndarray, deflection: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Compute the forces f (J, B, R) [N] of the meshes.

        ``extra`` (J, B, R) are the forces e beyond k0 [N], ``deflection`` (J, B, R) [m] those of the meshes, ``way``
        (G, B, R) [m] the displacements u of the ring.
        """
        force = extra + self.gears.mean[:, None, None] * deflection
        force[len(way) :] -= self.gears.mean[len(way) :, None, None] * way
        return force

    def load(self) -> np.ndarray:
        """Deflections (J, B, R) by the constant load [m]."""
        load = np.zeros(self.compliance.shape[1:], complex)
        load[:, 0, self.orders.middle] = self.gears.load
        return load


def blocks_of_speed(
    gears: LeadingMeshes,
    structure: FixedStructure,
    orders: CarrierOrders,
    place: np.ndarray,
    speed: float,
    coupled: int,
) -> HarmonicBlocks:
    """Make the blocks of a speed of the carrier [rad/s], positive, by leaders at places (G,) [rad].

    Waves up to ``coupled`` nodal diameters act on one another.
    """
    T, G, mean = _gears_compliance(gears, orders, speed), len(place), gears.mean[len(place) :]
    residual = T[G:, G:]
    spring = np.eye(G)[..., None, None] * mean[:, None, None, None]
    spring = spring - (mean[:, None] * mean)[..., None, None] * residual
    yielding = np.empty((len(orders.base), G * len(orders.bands), G * len(orders.bands)), complex)
    for residue in range(orders.paths.symmetry):
        size = 16 * len(orders.structure_bands(residue)) * (len(structure.natural_frequency) + 4 * (coupled + 1) ** 2)
        for part in _parts(orders.blocks(residue), size):
            R = _ring(structure, orders, place, speed, residue, part, coupled)
            nb, _, n_r = R.shape[:3]
            RA = np.zeros_like(R)
            for g in range(G):
                for k in range(G):
                    RA[:, :, :, k] += R[:, :, :, g] * spring[g, k, part][:, None, None]
            RA = RA.reshape(nb, G * n_r, G * n_r)
            RA[:, range(G * n_r), range(G * n_r)] += 1.0
            yielding[part] = np.linalg.solve(RA, R.reshape(RA.shape))
    return HarmonicBlocks(gears, structure, orders, place, speed, T, spring, yielding)


def _parts(blocks: np.ndarray, size: float) -> list[np.ndarray]:
    """Split blocks, one of which takes a size [bytes], into parts that fit into memory."""
    return np.array_split(blocks, int(np.ceil(len(blocks) * size / _TOGETHER))) if len(blocks) else []


def _gears_compliance(gears: LeadingMeshes, orders: CarrierOrders, speed: float) -> np.ndarray:
    """Compliance T (J, J, B, R) of gears and carrier against a rigid ring [m/N]."""
    J, N = len(gears.rows), orders.paths.symmetry
    modal = compliance(gears.modes, speed * orders.order)
    T = np.empty((*modal.shape[:2], J, J), complex)
    for c in range(N):
        at = (orders.residue[:, None] + orders.bands) % N == c
        pairs = (gears.rows[:, None] * gears.folded[c]).reshape(J * J, -1)
        T[at] = (modal[at] @ pairs.T).reshape(-1, J, J) + gears.residual[c]
    return np.ascontiguousarray(T.transpose(2, 3, 0, 1))


def _ring(
    structure: FixedStructure, orders: CarrierOrders, place, speed: float, residue: int, blocks, coupled: int
) -> np.ndarray:
    """What the ring gives way at the leaders per force, in blocks of a residue: (b, G, R, G, R) [m/N]."""
    P, n, bands, G = structure.ring_shape, orders.diameters, len(orders.bands), len(place)
    in_structure, N = orders.structure_bands(residue), orders.paths.symmetry
    order = orders.base[blocks][:, None] + in_structure + orders.seed[blocks][:, None]
    modal = receptance(structure, speed * order)
    wave, near = np.exp(1j * np.outer(place, n)), np.abs(n) <= coupled
    ring = np.zeros((len(blocks), G, bands, G, bands), complex)

    def add(to, of, values) -> None:
        """Add receptances (b, ...) from waves ``of`` to waves ``to`` at side bands."""
        (r, i), (at, k) = to, of
        for g in range(G):
            for j in range(G):
                ring[:, g, r, j, at] += N * wave[g, i] * wave[j, k].conj() * values

    for sector in range(orders.spacing):  # at an order of the structure only every such wave
        here = (in_structure - sector) % orders.spacing == 0
        waves = (sector + orders.sense * n) % orders.spacing == 0
        if not here.any() or not waves.any():
            continue
        modes = structure.moved_by(waves)
        part = modal[:, here][..., modes]
        inside = np.abs(in_structure[here]) <= orders.bands[-1] + coupled
        both = modes, np.flatnonzero(waves & near)
        _add_coupled(add, structure, orders, in_structure[here][inside], part[:, inside], both)
        far = np.flatnonzero(waves & ~near)
        alone = complex_times(part, np.abs(P[np.ix_(modes, far)]) ** 2)
        alone += np.real(structure.residual[far, far])
        for i, wave_number in enumerate(far):
            r = orders.place(in_structure[here] + orders.sense * n[wave_number])
            within = np.flatnonzero(r < bands)
            add((r[within], wave_number), (r[within], wave_number), alone[:, within, i])
    return ring


def _add_coupled(add, structure: FixedStructure, orders: CarrierOrders, in_structure, modal, near) -> None:
    """Add receptances of waves that act on one another, at side bands ``in_structure`` (k,) of the structure.

    By receptances (b, k, m) of modes, and ``near``: the numbers of these and of the waves.
    """
    modes, waves = near
    if not len(waves):
        return
    shape, n = structure.ring_shape[np.ix_(modes, waves)], orders.diameters[waves]
    low, top = np.triu_indices(len(waves))  # of (n', n) the modes' product is conjugate
    pairs, count = shape[:, low] * shape[:, top].conj(), len(low)
    both = complex_times(modal, np.hstack([np.real(pairs), np.imag(pairs)]))
    every = np.empty((*both.shape[:2], len(waves), len(waves)), complex)
    every[..., top, low] = both[..., :count] - 1j * both[..., count:]
    every[..., low, top] = both[..., :count] + 1j * both[..., count:]
    every += structure.residual[np.ix_(waves, waves)]
    for k, band in enumerate(in_structure):
        r = orders.place(band + orders.sense * n)
        inside = np.flatnonzero(r < len(orders.bands))
        r, there = r[inside], waves[inside]
        add((r[:, None], there[:, None]), (r, there), every[:, k, inside[:, None], inside])


def _times(matrix: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Products (i, B, R) of matrices (i, j, B, R) and values (j, B, R)."""
    return np.einsum("ijbr,jbr->ibr", matrix, values)


def complex_times(values: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Multiply a complex matrix (..., k) by a real one (k, m), to (..., m): half the work of a complex one."""
    product = np.empty((*values.shape[:-1], real.shape[1]), complex)
    # BLAS does not take the parts of complex numbers as they lie
    product.real = rows_times(np.ascontiguousarray(np.real(values)), real)
    product.imag = rows_times(np.ascontiguousarray(np.imag(values)), real)
    return product


def rows_times(values: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Multiply rows (..., k) by a matrix (k, m) at once, to (..., m): faster than a stack of small matrices."""
    rows = values.reshape(math.prod(values.shape[:-1]), values.shape[-1])
    return (rows @ matrix).reshape(*values.shape[:-1], matrix.shape[1])
