"""Damping of a set as a whole, gears and ring together, in the two-way response.

Modal damping of the set (`femgear.solvers.linear.modal.modal_damping`) is a matrix C of gears and ring that
does not change in the frame of the carrier. Its blocks of the gears alone and of the ring alone differ from
modal damping of gears in a rigid ring and of the structure, and it couples both. The two-way equations
(`femgear.housing.two_way`) hold with modal damping of each part; what C does beyond it are forces

    -(C - C_0) v,   v = i L Omega (gears),   i (L - s n) Omega (wave n of the ring)

on gears and waves. Waves have the velocity of the ring's material, which stands still in space: what C takes
away is never given back. The forces follow the motion, so that they are iterated upon; the mean of C over the
turns of the ring acts on each order of the structure alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.housing.carrier_orders import CarrierOrders
from femgear.housing.structure import FixedStructure, ring_waves
from femgear.system.system import Modes

_MOST_RATIO = 0.999
"""Damping ratio of a mode at most; what a set has beyond it is left to `SetDamping`."""


@dataclass(frozen=True)
class _Residue:
    """Side bands of one residue in blocks of one, the waves that meet them, and the damping between both."""

    blocks: np.ndarray
    bands: np.ndarray
    waves: np.ndarray
    place: np.ndarray  # (bands, waves) of L - s n among the orders of the structure
    matrix: np.ndarray  # of modes of the gears and these waves


@dataclass(frozen=True)
class SetDamping:
    """Forces of the damping of a set beyond modal damping of gears and structure, see `set_damping`."""

    orders: CarrierOrders
    residues: tuple[_Residue, ...]
    first: np.ndarray  # cosines among the coordinates of waves, each before its sine
    wave: np.ndarray  # (n_waves,) place of each wave among the circumferential orders
    shape: np.ndarray  # (m, n_waves + m) modes in these coordinates, and what acts on each order alone

    def forces(self, speed: float, gears: np.ndarray, structure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the modal forces of modal motions of gears (B, R, n_modes) and structure (B, S, m).

        At a speed of the carrier [rad/s]; of the same shapes [N kg^-1/2].
        """
        count, orders, modes = len(self.wave), self.orders, gears.shape[2]
        turning, s = -1j * speed * orders.order[..., None], -1j * speed * orders.sense
        both = complex_times(structure, self.shape)
        moved = _padded(self._mixed(both[..., :count], -1j))
        on_gears, on_waves = np.empty_like(gears), np.zeros((*gears.shape[:2], count), complex)
        for one in self.residues:
            at = np.ix_(one.blocks, one.bands)
            waves = moved[one.blocks][:, one.place, one.waves]
            waves *= turning[at] - s * orders.diameters[self.wave[one.waves]]
            motion = np.concatenate([turning[at] * gears[at], waves], axis=2)
            force = motion @ one.matrix.T
            on_gears[at] = force[..., :modes]
            on_waves[one.blocks[:, None, None], one.bands[:, None], one.waves] = force[..., modes:]
        gathered, on_waves = np.empty((*structure.shape[:2], count), complex), _padded(on_waves)
        for residue in range(orders.paths.symmetry):
            own, back = orders.blocks(residue), orders.meeting(residue)[1][:, self.wave]
            gathered[own] = on_waves[own][:, back, np.arange(count)]
        alone = -1j * speed * orders.structure_order[..., None] * both[..., count:]
        return on_gears, complex_times(self._mixed(gathered, 1.0), self.shape[:, :count].T) + alone

    def _mixed(self, values: np.ndarray, turn: complex) -> np.ndarray:
        """Coordinates (..., n_waves) as waves, with -i, or waves as coordinates, with 1, as `ring_waves`."""
        one, other = values[..., self.first], values[..., self.first + 1]
        found, half = values.copy(), np.sqrt(0.5)
        if turn == 1.0:
            found[..., self.first], found[..., self.first + 1] = (
                half * (one + other),
                1j * half * (one - other),
            )
        else:
            found[..., self.first], found[..., self.first + 1] = (
                half * (one - 1j * other),
                half * (one + 1j * other),
            )
        return found


def _padded(values: np.ndarray) -> np.ndarray:
    """Values (B, n, k) with zeros at the place n, which stands for none."""
    return np.concatenate([values, np.zeros((len(values), 1, values.shape[2]))], axis=1)


def complex_times(values: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Multiply a complex matrix (..., n, k) by a real one (k, m), half the work of a complex one."""
    found = np.empty((*values.shape[:-1], real.shape[1]), complex)
    found.real, found.imag = np.real(values) @ real, np.imag(values) @ real
    return found


def with_set_damping(matrix, gears: Modes, structure: FixedStructure) -> tuple[Modes, FixedStructure]:
    """Give the modes of gears and structure the ratios that the damping of a set gives each of them alone.

    The mean of the matrix over turns of the ring acts on the structure. Less is left for `set_damping`, whose
    forces are iterated upon. Arguments as there; below a ratio of one.
    """
    matrix, dofs = _checked_matrix(matrix, gears, structure), len(gears.shape)
    natural, kept = 2 * np.pi * gears.frequency, np.sum(gears.shape * (matrix[:dofs, :dofs] @ gears.shape), 0)
    ratio = np.where(natural > 0.0, 0.5 * kept / np.where(natural > 0.0, natural, 1.0), gears.damping_ratio)
    waves = ring_waves(structure.wave_order)
    mean = np.real(np.sum(waves * (waves.conj() @ matrix[dofs:, dofs:]), axis=1))
    of_modes = 0.5 * (np.abs(structure.wave_shape) ** 2 @ mean) / structure.natural_frequency
    return (
        replace(gears, damping_ratio=np.clip(ratio, 0.0, _MOST_RATIO)),
        replace(structure, damping_ratio=np.clip(of_modes, 0.0, _MOST_RATIO)),
    )


def _checked_matrix(matrix, gears: Modes, structure: FixedStructure) -> np.ndarray:
    """Refuse a damping matrix that does not fit, or a structure without waves (E-SHAPE)."""
    matrix, waves, dofs = np.asarray(matrix, float), len(structure.wave_order), len(gears.shape)
    if not waves or matrix.shape != (dofs + waves,) * 2:
        message = f"damping of shape {matrix.shape} for {dofs} coordinates of gears and {waves} of a ring"
        raise CaseError(message, code="E-SHAPE", key="damping", limit="one row and column for each of them")
    return matrix


def set_damping(matrix, gears: Modes, structure: FixedStructure, orders: CarrierOrders) -> SetDamping:
    """Take the damping of a set apart for the orders of the two-way response.

    CaseError: a matrix that does not fit, or a structure without waves (E-SHAPE).

    Parameters
    ----------
    matrix : (n_gears + n_waves,) * 2 array
        Damping of the gears' coordinates, then those of the ring, cosine and sine of its modes in turn, in
        the frame of the carrier [N s/m, ...]. Waves beyond the circumferential orders of the structure must
        be damped alone.
    gears, structure
        As for `femgear.housing.two_way.solve_two_way`; the structure knows its waves.
    orders : CarrierOrders
    """
    matrix, n = _checked_matrix(matrix, gears, structure), structure.wave_order
    dofs, modes = gears.shape.shape
    to_waves = np.zeros((len(matrix), modes + len(n)), complex)
    to_waves[:dofs, :modes] = gears.shape
    to_waves[dofs:, modes:] = ring_waves(n).conj().T
    whole = to_waves.conj().T @ matrix @ to_waves
    mean = np.real(np.diag(whole)[modes:])
    base = 2.0 * gears.damping_ratio * 2.0 * np.pi * gears.frequency
    whole = whole - np.diag(np.concatenate([base, mean]))
    shape, top, N = structure.wave_shape, orders.max_diameter, orders.paths.symmetry
    modal = 2.0 * structure.damping_ratio * structure.natural_frequency
    near = np.flatnonzero(np.abs(n) <= top)
    own = np.real((shape.conj() * mean) @ shape.T) - np.diag(modal)
    coordinates = np.real(shape[:, near] @ ring_waves(n[near]).conj())
    kept = np.append(np.arange(modes), modes + near)
    whole, n = whole[np.ix_(kept, kept)], n[near]
    residues = list[_Residue]()
    for residue in range(N):
        blocks, to = orders.blocks(residue), orders.meeting(residue)[0][:, n + top]
        for c in range(N if len(blocks) else 0):
            bands = np.flatnonzero((residue + orders.bands) % N == c)
            met = np.flatnonzero((c - orders.sense * n) % N == 0)
            kept = np.append(np.arange(modes), modes + met)
            residues.append(_Residue(blocks, bands, met, to[np.ix_(bands, met)], whole[np.ix_(kept, kept)]))
    first = np.flatnonzero(n < 0) - 1
    return SetDamping(orders, tuple(residues), first, n + top, np.hstack([coordinates, own]))
