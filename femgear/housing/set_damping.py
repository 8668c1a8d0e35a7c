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

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.housing.structure import FixedStructure, ring_waves
from femgear.system.system import Modes


@dataclass(frozen=True)
class _Residue:
    """Orders L of one residue, the waves that meet them, and the damping of modes of the gears and these."""

    orders: np.ndarray
    waves: np.ndarray
    place: np.ndarray  # (orders, waves) of L - s n among the orders of the structure
    velocity: np.ndarray  # (orders, gear modes + waves) orders that the velocities have
    matrix: np.ndarray


@dataclass(frozen=True)
class SetDamping:
    """Forces of the damping of a set beyond modal damping of gears and structure, see `set_damping`."""

    residues: tuple[_Residue, ...]
    first: np.ndarray  # cosines among the coordinates of waves up to n_max, each before its sine
    back: np.ndarray  # (orders of the structure, n_waves) of K + s n among the orders of the meshes
    structure_order: np.ndarray
    shape: np.ndarray  # (m, n_waves + m) modes in these coordinates, and what acts on each order alone

    def forces(self, speed: float, gears: np.ndarray, structure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the modal forces (n_L, gear modes), (n_K, m) of modal motions of the same shapes.

        At a speed of the carrier [rad/s].
        """
        count = self.back.shape[1]
        both = complex_times(structure, self.shape)
        moved = np.zeros((len(structure) + 1, count), complex)
        moved[:-1] = self._mixed(both[:, :count], -1j)
        on_gears, on_waves = np.empty_like(gears), np.zeros((len(gears) + 1, count), complex)
        for one in self.residues:
            motion = np.concatenate([gears[one.orders], moved[one.place, one.waves]], axis=1)
            force = (-1j * speed * one.velocity * motion) @ one.matrix.T
            on_gears[one.orders] = force[:, : gears.shape[1]]
            on_waves[one.orders[:, None], one.waves] = force[:, gears.shape[1] :]
        gathered = self._mixed(on_waves[self.back, np.arange(count)], 1.0)
        alone = -1j * speed * self.structure_order[:, None] * both[:, count:]
        return on_gears, complex_times(gathered, self.shape[:, :count].T) + alone

    def _mixed(self, values: np.ndarray, turn: complex) -> np.ndarray:
        """Coordinates (..., n_waves) as waves, with -i, or waves as coordinates, with 1, as `ring_waves`."""
        one, other = values[:, self.first], values[:, self.first + 1]
        found, half = values.copy(), np.sqrt(0.5)
        if turn == 1.0:
            found[:, self.first], found[:, self.first + 1] = half * (one + other), 1j * half * (one - other)
        else:
            found[:, self.first], found[:, self.first + 1] = (
                half * (one - 1j * other),
                half * (one + 1j * other),
            )
        return found


def complex_times(values: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Multiply a complex matrix (..., n, k) by a real one (k, m), half the work of a complex one."""
    return np.real(values) @ real + 1j * (np.imag(values) @ real)


def set_damping(
    matrix, gears: Modes, structure: FixedStructure, order, meeting, *, symmetry: int, sense: int,
    offset: float = 0.0,
) -> SetDamping:  # fmt: skip
    """Take the damping of a set apart for the orders of the two-way response.

    CaseError: a matrix that does not fit, or a structure without waves (E-SHAPE).

    Parameters
    ----------
    matrix : (n_gears + n_waves,) * 2 array
        Damping of the gears' coordinates, then those of the ring, cosine and sine of its modes in turn, in
        the frame of the carrier [N s/m, ...]. Waves beyond n_max must be damped alone.
    gears, structure
        As for `femgear.housing.two_way.solve_two_way`; the structure knows its waves.
    order : (n_L,) int array
        Orders L of the meshes.
    meeting : tuple of (n_K,), (n_L, 2 n_max + 1), (n_K, 2 n_max + 1) int arrays
        Orders K of the structure, places of ``L - s n`` among them, and of ``K + s n`` among the L; their
        number where there are none.
    symmetry, sense : int
        Turns that repeat the set, and the sense of the carrier.
    offset : float
        What all orders lack: their residues count without it, velocities with it.
    """
    structure_order, to, back = meeting
    matrix, n, (dofs, modes) = np.asarray(matrix, float), structure.wave_order, gears.shape.shape
    if not len(n) or matrix.shape != (dofs + len(n),) * 2:
        message = f"damping of shape {matrix.shape} for {dofs} coordinates of gears and {len(n)} of a ring"
        raise CaseError(message, code="E-SHAPE", key="damping", limit="one row and column for each of them")
    to_waves = np.zeros((len(matrix), modes + len(n)), complex)
    to_waves[:dofs, :modes] = gears.shape
    to_waves[dofs:, modes:] = ring_waves(n).conj().T
    whole = to_waves.conj().T @ matrix @ to_waves
    mean = np.real(np.diag(whole)[modes:])
    base = 2.0 * gears.damping_ratio * 2.0 * np.pi * gears.frequency
    whole = whole - np.diag(np.concatenate([base, mean]))
    shape, top = structure.wave_shape, to.shape[1] // 2
    modal = 2.0 * structure.damping_ratio * structure.natural_frequency
    near = np.flatnonzero(np.abs(n) <= top)
    kept = np.append(np.arange(modes), modes + near)
    whole, n, column = whole[np.ix_(kept, kept)], n[near], n[near] + top
    residues = list[_Residue]()
    for c in range(symmetry):
        rows, met = np.flatnonzero(order % symmetry == c), np.flatnonzero((c - sense * n) % symmetry == 0)
        own = np.append(np.arange(modes), modes + met)
        turning = order[rows, None] + offset
        velocity = np.hstack([np.repeat(turning, modes, 1), turning - sense * n[met]])
        place = to[rows[:, None], column[met]]
        residues.append(_Residue(rows, met, place, velocity, whole[np.ix_(own, own)]))
    own = np.real((shape.conj() * mean) @ shape.T) - np.diag(modal)
    coordinates = np.real(shape[:, near] @ ring_waves(n).conj())
    first = np.flatnonzero(n < 0) - 1
    own = np.hstack([coordinates, own])
    return SetDamping(tuple(residues), first, back[:, column], structure_order + offset, own)
