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
from femgear.housing.carrier_orders import CarrierOrders, LeadingMeshes, ring_load
from femgear.housing.harmonic_blocks import HarmonicBlocks
from femgear.housing.structure import FixedStructure, ring_waves
from femgear.system.system import Modes

_TOGETHER = 16
"""Blocks that are answered together: what lies between forces and motion stays in the cache."""
_NOTHING = 1e-11
"""Part of the largest number that is nothing in single precision."""
_MOST_RATIO = 0.999
"""Damping ratio of a mode at most; what a set has beyond it is left to `SetDamping`."""


@dataclass(frozen=True)
class _Class:
    """Side bands of a block in which the same waves meet the gears, and the damping between both."""

    bands: np.ndarray
    waves: np.ndarray
    place: np.ndarray  # (bands, waves) of L - s n among the orders of the structure
    matrix: np.ndarray  # of modes of the gears and these waves
    rows: np.ndarray  # (J, n_modes) deflections of the leading meshes by the modes of the gears


@dataclass(frozen=True)
class _Residue:
    """Blocks of one residue: classes of their side bands, and places of K + s n among these."""

    blocks: np.ndarray
    classes: tuple[_Class, ...]
    path_back: np.ndarray  # (S, W) for the circumferential orders of the path
    wave_back: np.ndarray  # (S, n_waves)
    path_to: np.ndarray  # (R, W) of L - s n among the orders of the structure


@dataclass(frozen=True)
class DampingForces:
    """Modal forces of the damping on gears (B, R, n_modes) and structure (B, S, m), and what they move.

    Deflections of the meshes ``still`` (J, B, R) and of the ring ``way`` (G, B, R) by them [m].
    """

    on_gears: np.ndarray
    on_structure: np.ndarray
    still: np.ndarray
    way: np.ndarray

    @property
    def parts(self) -> tuple[np.ndarray, ...]:
        """The four arrays, in their order."""
        return self.on_gears, self.on_structure, self.still, self.way


@dataclass(frozen=True)
class SetDamping:
    """Forces of the damping of a set beyond modal damping of gears and structure, see `set_damping`."""

    orders: CarrierOrders
    residues: tuple[_Residue, ...]
    wave: np.ndarray  # (n_waves,) place of each wave among the circumferential orders
    shape: np.ndarray  # (m, n_waves) modes of the structure in these waves
    own: np.ndarray  # (m, m) what acts on each order alone
    path: np.ndarray  # (m, W) modes of the structure on the path of the meshes
    rows: np.ndarray  # (J, n_modes) deflections of the leading meshes by the modes of the gears

    def none(self, leaders: int) -> DampingForces:
        """No forces yet, of a set with so many leading planets."""
        orders, (J, modes) = self.orders, self.rows.shape
        size = len(orders.base), len(orders.bands)
        shapes = (*size, modes), (size[0], len(orders.structure_bands(0)), len(self.own)), (J, *size)
        return DampingForces(*(np.zeros(shape, complex) for shape in (*shapes, (leaders, *size))))

    def single(self) -> SetDamping:
        """The same in single precision."""
        residues = tuple(
            replace(one, classes=tuple(
                replace(part, matrix=_single(part.matrix), rows=_single(part.rows)) for part in one.classes
            ))
            for one in self.residues
        )  # fmt: skip
        given = {name: _single(getattr(self, name)) for name in ("shape", "own", "path", "rows")}
        return replace(self, residues=residues, **given)

    def answer(self, blocks: HarmonicBlocks, extra, way, force, before: DampingForces) -> DampingForces:
        """Compute the forces of the damping by the motion at a speed, part by part of the blocks.

        By forces e (J, B, R) beyond k0, u (G, B, R), forces f (J, B, R) of the meshes, and the forces of the
        damping in that motion.
        """
        G = len(blocks.place)
        excess, ring = np.array(extra), force[G:]
        excess[G:] -= blocks.gears.mean[G:, None, None] * way
        turned = np.exp(1j * np.outer(self.orders.diameters, blocks.place))
        if self.path.dtype == np.complex64:
            excess, ring, turned = _single(excess), _single(ring), _single(turned)
            before = DampingForces(*(_single(part) for part in before.parts))
        found = DampingForces(*(np.empty_like(part) for part in before.parts))
        for residue in self.residues:
            for some in np.array_split(residue.blocks, -(-len(residue.blocks) // _TOGETHER)):
                loads = excess[:, some], ring[:, some], before.on_gears[some], before.on_structure[some]
                self._answer_part(blocks, residue, some, loads, turned, found)
        return found

    def _answer_part(
        self, blocks: HarmonicBlocks, residue: _Residue, some, loads, turned, found: DampingForces
    ) -> None:  # fmt: skip
        """Write the answer of some blocks of a residue to loads on meshes, ring and modes into ``found``."""
        orders, kind, (excess, ring, load, on_modes) = self.orders, self.path.dtype, loads
        gears, structure = blocks.on_gears[some].astype(kind), blocks.on_structure[some].astype(kind)
        for one in residue.classes:
            load[:, one.bands] -= np.moveaxis(excess[:, :, one.bands], 0, -1) @ one.rows
        waves = ring_load(orders.paths.symmetry, ring, blocks.place, orders.diameters, residue.path_back)
        moved = (waves.astype(kind) @ self.path.conj().T + on_modes) * structure
        on_gears, on_waves = self._on_waves(residue, blocks.speed, some, load * gears, moved @ self.shape)
        order = (1j * blocks.speed * orders.structure_order[some, :, None]).astype(kind)
        on_structure = on_waves @ self.shape.conj().T - order * (moved @ self.own)
        found.on_gears[some], found.on_structure[some] = on_gears, on_structure
        found.still[:, some] = np.moveaxis((on_gears * gears) @ self.rows.T, -1, 0)
        waves = _padded((on_structure * structure) @ self.path)
        waves = waves[:, residue.path_to, np.arange(self.path.shape[1])]
        found.way[:, some] = np.moveaxis(waves @ turned, -1, 0)

    def _on_waves(self, residue: _Residue, speed: float, some, gears: np.ndarray, waves: np.ndarray):
        """Forces on the modes of the gears (b, R, n_modes) and on waves (b, S, n_waves) by their motions."""
        modes, kind = gears.shape[2], gears.dtype
        number = self.orders.sense * self.orders.diameters[self.wave]
        order = -1j * speed * self.orders.order[some][..., None]
        on_gears, moved = np.empty_like(gears), _padded(waves)
        on_waves = np.zeros((len(gears), gears.shape[1] + 1, waves.shape[2]), kind)
        for one in residue.classes:
            turning = order[:, one.bands]
            of_waves = (turning + 1j * speed * number[one.waves]).astype(kind)
            motion = np.concatenate([
                turning.astype(kind) * gears[:, one.bands], of_waves * moved[:, one.place, one.waves],
            ], axis=2)  # fmt: skip
            made = motion @ one.matrix.T
            on_gears[:, one.bands] = made[..., :modes]
            on_waves[:, one.bands[:, None], one.waves] = made[..., modes:]
        return on_gears, on_waves[:, residue.wave_back, np.arange(waves.shape[2])]


def _single(values: np.ndarray) -> np.ndarray:
    """Values in single precision, without what is far below its rounding.

    Lines that vanish but for rounding end in numbers that processors are slow with.
    """
    found = np.asarray(values).astype(np.complex64)
    size = np.abs(found)
    found[size < _NOTHING * size.max(initial=0.0)] = 0.0
    return found


def _padded(values: np.ndarray) -> np.ndarray:
    """Values (B, n, k) with zeros at the place n, which stands for none."""
    return np.concatenate([values, np.zeros((len(values), 1, values.shape[2]), values.dtype)], axis=1)


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


def set_damping(
    matrix, leading: LeadingMeshes, structure: FixedStructure, orders: CarrierOrders
) -> SetDamping:  # fmt: skip
    """Take the damping of a set apart for the orders of the two-way response.

    CaseError: a matrix that does not fit, or a structure without waves (E-SHAPE).

    Parameters
    ----------
    matrix : (n_gears + n_waves,) * 2 array
        Damping of the gears' coordinates, then those of the ring, cosine and sine of its modes in turn, in
        the frame of the carrier [N s/m, ...]. Waves beyond the circumferential orders of the structure must
        be damped alone.
    leading : LeadingMeshes
        Of the modes of gears and carrier.
    structure
        As for `femgear.housing.two_way.solve_two_way`; it knows its waves.
    orders : CarrierOrders
    """
    gears = leading.modes
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
    kept = np.append(np.arange(modes), modes + near)
    whole, number = whole[np.ix_(kept, kept)], n[near]
    residues = tuple(_residue(orders, residue, leading, whole, number) for residue in range(N))
    return SetDamping(
        orders, tuple(one for one in residues if len(one.blocks)), number + top, shape[:, near], own,
        structure.ring_shape, leading.rows,
    )  # fmt: skip


def _residue(orders: CarrierOrders, residue: int, leading: LeadingMeshes, whole, number) -> _Residue:
    """Sort the side bands in blocks of a residue by the waves of orders ``number`` (n_waves,) that meet them.

    ``whole`` is the damping of the modes of the gears and these waves.
    """
    N, modes, wave = orders.paths.symmetry, leading.rows.shape[1], number + orders.max_diameter
    to, back = orders.meeting(residue)
    classes = list[_Class]()
    for c in range(N):
        bands = np.flatnonzero((residue + orders.bands) % N == c)
        met = np.flatnonzero((c - orders.sense * number) % N == 0)
        kept = np.append(np.arange(modes), modes + met)
        place = to[np.ix_(bands, wave[met])]
        classes.append(_Class(bands, met, place, whole[np.ix_(kept, kept)], leading.folded[c]))
    return _Residue(orders.blocks(residue), tuple(classes), back, back[:, wave], to)
