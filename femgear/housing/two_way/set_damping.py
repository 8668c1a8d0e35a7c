"""Damping of a set as a whole, gears and ring together, in the two-way response.

Modal damping of the set (`femgear.solvers.linear.modal.modal_damping`) is a matrix C of gears and ring that
does not change in the frame of the carrier. Its blocks of the gears alone and of the ring alone differ from
modal damping of gears in a rigid ring and of the structure, and it couples both. The two-way equations
(`femgear.housing.two_way.response`) hold with modal damping of each part; what C does beyond it are forces

    -(C - C_0) v,   v = i L Omega (gears),   i (L - s n) Omega (wave n of the ring)

on gears and waves. Waves have the velocity of the ring's material, which stands still in space: what C takes
away is never given back. The forces follow the motion, so that they are iterated upon; the mean of C over the
turns of the ring acts on each order of the structure alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femgear.errors import CaseError
from femgear.housing.two_way.carrier_orders import CarrierOrders, LeadingMeshes, modal_receptance
from femgear.housing.two_way.harmonic_blocks import HarmonicBlocks, rows_times
from femgear.housing.two_way.structure import FixedStructure, ring_waves
from femgear.solvers.periodic.spectral import compliance
from femgear.system.system import Modes

_TOGETHER = 0.5e6
"""Size of forces that are answered together [bytes]: what lies between them and motion stays in the cache."""
_NOTHING = 1e-11
"""Part of the largest number that is nothing in single precision."""
_MOST_RATIO = 0.999
"""Damping ratio of a mode at most; what a set has beyond it is left to `SetDamping`."""


@dataclass(frozen=True)
class _Class:
    """Side bands of a block in which the same waves meet the gears, and the damping between both.

    Parameters
    ----------
    bands : int array
        Numbers of these side bands.
    matrix : (n_modes + waves,) * 2 complex array
        Damping of the modes of the gears and these waves.
    rows : (J, n_modes) array
        Deflections of the leading meshes by the modes of the gears [kg^-1/2].
    number : (waves,) int array
        Orders s n of the waves.
    place : (bands, waves) int array
        Place of L - s n of each wave among what sectors have of them.
    diameters : (path_waves,) int array
        Waves of the path, as places among the circumferential orders.
    path_place : (bands, path_waves) int array
        As ``place``, of the waves of the path.
    """

    bands: np.ndarray
    matrix: np.ndarray
    rows: np.ndarray
    number: np.ndarray
    place: np.ndarray
    diameters: np.ndarray
    path_place: np.ndarray


@dataclass(frozen=True)
class _Sector:
    """Orders of the structure at which the same of its modes and waves move, with the shapes of these.

    Parameters
    ----------
    orders, modes : int arrays
        Numbers of these orders and modes.
    shape : (modes, waves) complex array
        Waves of the ring in each mode.
    structure_damping : (modes, modes) array
        Damping between the modes at each order alone [1/s].
    place : (orders, waves) int array
        Place of K + s n of each wave among what classes have of them.
    path : (modes, path_waves) complex array
        Waves in each mode along the path of the meshes.
    diameters : (path_waves,) int array
        These waves, as places among the circumferential orders.
    bands : (orders, path_waves) int array
        Places of K + s n among the side bands.
    """

    orders: np.ndarray
    modes: np.ndarray
    shape: np.ndarray
    structure_damping: np.ndarray
    place: np.ndarray
    path: np.ndarray
    diameters: np.ndarray
    bands: np.ndarray

    def of_modes(self, values: np.ndarray) -> np.ndarray:
        """Of values (b, S, M) those at these orders."""
        return values[:, self.orders, : len(self.modes)]


@dataclass(frozen=True)
class _Residue:
    """Damping in the blocks of one ``residue``.

    ``blocks`` are their numbers, ``classes`` sort their side bands, ``sectors`` the orders of the structure. A place
    that does not exist is the number of those that do.
    """

    residue: int
    blocks: np.ndarray
    classes: tuple[_Class, ...]
    sectors: tuple[_Sector, ...]


@dataclass(frozen=True)
class DampingForces:
    """Modal forces of the damping, and what they move, in B blocks.

    Parameters
    ----------
    on_gears : (B, R, n_modes) complex array
        On the modes of the gears [N kg^-1/2].
    on_structure : (B, S, M) complex array
        On those modes of the structure, at most M, that move at each of its S orders [N kg^-1/2].
    still : (J, B, R) complex array
        Deflection of the leading meshes by these forces [m].
    way : (G, B, R) complex array
        Displacement of the ring at its meshes by them, along their lines of action [m].
    """

    on_gears: np.ndarray
    on_structure: np.ndarray
    still: np.ndarray
    way: np.ndarray

    @property
    def parts(self) -> tuple[np.ndarray, ...]:
        """The four arrays, in the order and shapes of the class."""
        return self.on_gears, self.on_structure, self.still, self.way

    def single(self) -> DampingForces:
        """The same in single precision."""
        return DampingForces(*(_single(part) for part in self.parts))


@dataclass(frozen=True)
class SetDamping:
    """Forces of the damping of a set beyond modal damping of gears and structure, see `set_damping`.

    ``orders`` are the blocks and side bands, ``residues`` the damping between what meets in them, ``structure`` ring
    and casing; ``rows`` (J, n_modes) are the deflections of the leading meshes by the modes of the gears.
    """

    orders: CarrierOrders
    residues: tuple[_Residue, ...]
    structure: FixedStructure
    rows: np.ndarray

    @cached_property
    def most_modes(self) -> int:
        """Modes M of the structure that move at one of its orders, at most."""
        return max((len(sector.modes) for residue in self.residues for sector in residue.sectors), default=0)

    def of(self, orders: CarrierOrders) -> SetDamping:
        """Take the same with other lines."""
        residues = tuple(replace(residue, blocks=orders.blocks(residue.residue)) for residue in self.residues)
        return replace(self, orders=orders, residues=residues)

    def none(self, leaders: int) -> DampingForces:
        """No forces yet, of a set with so many leading planets."""
        orders, (J, modes) = self.orders, self.rows.shape
        size, moved = (len(orders.base), len(orders.bands)), len(orders.structure_bands(0))
        shapes = (*size, modes), (size[0], moved, self.most_modes), (J, *size), (leaders, *size)
        return DampingForces(*(np.zeros(shape, complex) for shape in shapes))

    def on_all_modes(self, values: np.ndarray) -> np.ndarray:
        """Forces (B, S, m) on all modes of the structure by those (B, S, M) of `DampingForces`."""
        amplitudes = np.zeros((*values.shape[:2], len(self.structure.natural_frequency)), values.dtype)
        for residue in self.residues:
            for sector in residue.sectors:
                at = np.ix_(residue.blocks, sector.orders, sector.modes)
                amplitudes[at] = sector.of_modes(values[residue.blocks])
        return amplitudes

    def receptances(self, blocks: HarmonicBlocks) -> tuple[np.ndarray, np.ndarray]:
        """Receptances of the modes of gears (B, R, n_modes) and structure (B, S, M) at a speed [s^2]."""
        orders = self.orders.structure_order
        receptances = np.zeros((*orders.shape, self.most_modes), complex)
        for residue in self.residues:
            for sector in residue.sectors:
                modal_numbers = (
                    self.structure.natural_frequency[sector.modes],
                    self.structure.damping_ratio[sector.modes],
                )
                at = np.ix_(residue.blocks, sector.orders, np.arange(len(sector.modes)))
                omega = blocks.speed * orders[np.ix_(residue.blocks, sector.orders)]
                receptances[at] = modal_receptance(*modal_numbers, omega)
        return compliance(blocks.gears.modes, blocks.speed * self.orders.order), receptances

    def single(self) -> SetDamping:
        """The same in single precision."""
        names = "shape", "structure_damping", "path"
        residues = tuple(
            replace(
                residue,
                classes=tuple(
                    replace(part, matrix=_single(part.matrix), rows=_single(part.rows)) for part in residue.classes
                ),
                sectors=tuple(
                    replace(part, **{name: _single(getattr(part, name)) for name in names}) for part in residue.sectors
                ),
            )
            for residue in self.residues
        )
        return replace(self, residues=residues, rows=_single(self.rows))

    def answer(
        self,
        blocks: HarmonicBlocks,
        receptances,
        motion,
        before: DampingForces,
        forces: DampingForces,
        numbers: np.ndarray | None = None,
    ) -> None:
        """Compute the forces of the damping by the motion at a speed, part by part of the blocks.

        By the `receptances`, in its precision, and by the motion: forces e (J, B, R) beyond k0, u (G, B, R),
        forces f (J, B, R) of the meshes, and the forces of the damping in that motion. Into ``forces``, of
        all blocks or of some by their numbers.
        """
        extra, way, force = motion
        G = len(blocks.place)
        excess, ring = np.array(extra), force[G:]
        excess[G:] -= blocks.gears.mean[G:, None, None] * way
        turned = np.exp(1j * np.outer(self.orders.diameters, blocks.place))
        if self.rows.dtype == np.complex64:
            excess, ring, turned = _single(excess), _single(ring), _single(turned)
        size = sum(axis_forces[0].nbytes for axis_forces in forces.parts[:2])
        for residue in self.residues:
            here = residue.blocks if numbers is None else np.intersect1d(residue.blocks, numbers)
            parts = int(np.ceil(len(here) * size / _TOGETHER))
            for part in np.array_split(here, parts) if parts else ():
                loads = excess[:, part], ring[:, part], before.on_gears[part], before.on_structure[part]
                answers = receptances[0][part], receptances[1][part]
                self._answer_part(blocks, residue, part, (loads, answers), turned, forces)

    def _answer_part(
        self, blocks: HarmonicBlocks, residue: _Residue, numbers, loads, turned, forces: DampingForces
    ) -> None:
        """Write the answer of some blocks of a residue to loads on meshes, ring and modes into ``forces``."""
        (excess, ring, load, on_modes), (gears, structure) = loads
        orders, kind = self.orders, forces.still.dtype
        for class_ in residue.classes:
            load[:, class_.bands] -= rows_times(np.moveaxis(excess[:, :, class_.bands], 0, -1), class_.rows)
        ring, moved, waves = _padded(np.moveaxis(ring, 0, -1)), list[np.ndarray](), list[np.ndarray]()
        for class_ in residue.sectors:
            path = np.sum(ring[:, class_.bands] * turned[class_.diameters].conj(), axis=-1)
            motion = rows_times(orders.paths.symmetry * path, class_.path.conj().T) + class_.of_modes(on_modes)
            moved.append(motion * class_.of_modes(structure))
            waves.append(rows_times(moved[-1], class_.shape))
        on_gears, on_waves = self._on_waves(residue, blocks.speed, numbers, load * gears, _joined(waves))
        order = (1j * blocks.speed * orders.structure_order[numbers, :, None]).astype(kind)
        on_structure, waves = np.zeros_like(structure), list[np.ndarray]()
        for class_, motion in zip(residue.sectors, moved):
            made = rows_times(on_waves[:, class_.place], class_.shape.conj().T)
            made -= order[:, class_.orders] * rows_times(motion, class_.structure_damping)
            on_structure[:, class_.orders, : len(class_.modes)] = made
            waves.append(rows_times(made * class_.of_modes(structure), class_.path))
        path = _joined(waves)
        for class_ in residue.classes:
            moved = rows_times(path[:, class_.path_place], turned[class_.diameters])
            forces.way[:, numbers[:, None], class_.bands] = np.moveaxis(moved, -1, 0)
        forces.on_gears[numbers], forces.on_structure[numbers] = on_gears, on_structure
        forces.still[:, numbers] = np.moveaxis(rows_times(on_gears * gears, self.rows.T), -1, 0)

    def _on_waves(self, residue: _Residue, speed: float, numbers, gears: np.ndarray, waves: np.ndarray):
        """Forces on the modes of the gears (b, R, n_modes) and on waves (b, n + 1) by their motions.

        Of the waves those of all sectors follow one another, the forces of all classes.
        """
        modes, kind = gears.shape[2], gears.dtype
        order = -1j * speed * self.orders.order[numbers][..., None]
        on_gears, on_waves = np.empty_like(gears), list[np.ndarray]()
        for class_ in residue.classes:
            turning = order[:, class_.bands]
            motion = np.concatenate(
                [
                    turning.astype(kind) * gears[:, class_.bands],
                    (turning + 1j * speed * class_.number).astype(kind) * waves[:, class_.place],
                ],
                axis=2,
            )
            made = rows_times(motion, class_.matrix.T)
            on_gears[:, class_.bands] = made[..., :modes]
            on_waves.append(made[..., modes:])
        return on_gears, _joined(on_waves)


def _single(values: np.ndarray) -> np.ndarray:
    """Values in single precision, without what is far below its rounding.

    Lines that vanish but for rounding end in numbers that processors are slow with.
    """
    single = np.asarray(values).astype(np.complex64)
    size = np.abs(single)
    single[size < _NOTHING * size.max(initial=0.0)] = 0.0
    return single


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Values (b, n + 1) of parts (b, ...), one after the other, and a zero that stands for none."""
    none = np.zeros((len(parts[0]), 1), parts[0].dtype)
    return np.concatenate([*(part.reshape(len(part), -1) for part in parts), none], axis=1)


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


def set_damping(matrix, leading: LeadingMeshes, structure: FixedStructure, orders: CarrierOrders) -> SetDamping:
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
        As for `femgear.housing.two_way.response.solve_two_way`; it knows its waves.
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
    in_modes = np.real((shape.conj() * mean) @ shape.T) - np.diag(modal)
    kept = np.append(np.arange(modes), modes + near)
    waves = _Waves(orders, structure, near, whole[np.ix_(kept, kept)], in_modes)
    residues = tuple(_residue(waves, leading, residue) for residue in range(N))
    return SetDamping(orders, residues, structure, leading.rows)


@dataclass(frozen=True)
class _Waves:
    """Waves of the ring on its path, and the damping between them, the gears and the modes of the structure.

    ``orders`` and ``structure`` as in `SetDamping`, ``near`` numbers those of its waves that the path has. ``whole`` is
    the damping matrix of the modes of the gears and these waves, ``structure_damping`` (m, m) that of the modes of the
    structure.
    """

    orders: CarrierOrders
    structure: FixedStructure
    near: np.ndarray
    whole: np.ndarray
    structure_damping: np.ndarray

    @cached_property
    def number(self) -> np.ndarray:
        """Orders s n (w,) of the waves."""
        return self.orders.sense * self.structure.wave_order[self.near]

    @cached_property
    def path_number(self) -> np.ndarray:
        """Orders s n (W,) of the path."""
        return self.orders.sense * self.orders.diameters


def _table(parts, shape: tuple[int, int]) -> np.ndarray:
    """Places (r + 1, n) of pairs of rows and columns in parts of (rows, columns) that follow one another.

    In the last row, and of pairs that no part has, the number of those that there are.
    """
    table, count = np.full((shape[0] + 1, shape[1]), -1), 0
    for rows, columns in parts:
        size = len(rows) * len(columns)
        table[np.ix_(rows, columns)] = count + np.arange(size).reshape(len(rows), len(columns))
        count += size
    return np.where(table < 0, count, table)


def _residue(waves: _Waves, leading: LeadingMeshes, residue: int) -> _Residue:
    """Sort the side bands in blocks of a residue by the waves that meet them, the orders by those there."""
    orders, structure, N, modes = (
        waves.orders,
        waves.structure,
        waves.orders.paths.symmetry,
        leading.rows.shape[1],
    )
    in_structure, bands, spacing = orders.structure_bands(residue), orders.bands, orders.spacing
    number, path = waves.number, waves.path_number
    meeting_bands = [
        [np.flatnonzero(there) for there in ((residue + bands) % N == c, (c - number) % N == 0, (c - path) % N == 0)]
        for c in range(N)
    ]
    here = [
        [
            np.flatnonzero((in_structure - first) % spacing == 0),
            *(np.flatnonzero((first + offsets) % spacing == 0) for offsets in (number, path)),
            first,
        ]
        for first in range(spacing)
    ]
    here = [met_ for met_ in here if len(met_[0]) and len(met_[2])]
    to, back = orders.meeting(residue)
    place = np.searchsorted(orders.diameters, structure.wave_order[waves.near])
    S, R, W, n = len(in_structure), len(bands), len(number), len(path)
    at_orders = _table([met_[:2] for met_ in here], (S, W))
    path_at_orders = _table([(met_[0], met_[2]) for met_ in here], (S, n))
    at_bands = _table([met_[:2] for met_ in meeting_bands], (R, W))
    classes, sectors = list[_Class](), list[_Sector]()
    for c, (rows, waves_there, on_path) in enumerate(meeting_bands):
        kept = np.append(np.arange(modes), modes + waves_there)
        classes.append(
            _Class(
                rows,
                waves.whole[np.ix_(kept, kept)],
                leading.folded[c],
                number[waves_there],
                at_orders[to[np.ix_(rows, place[waves_there])], waves_there],
                on_path,
                path_at_orders[to[np.ix_(rows, on_path)], on_path],
            )
        )
    for rows, waves_there, on_path, first in here:
        moved = structure.moved_by((first + path) % spacing == 0)
        shape = structure.wave_shape[np.ix_(moved, waves.near[waves_there])]
        sectors.append(
            _Sector(
                rows,
                moved,
                shape,
                waves.structure_damping[np.ix_(moved, moved)],
                at_bands[back[np.ix_(rows, place[waves_there])], waves_there],
                structure.ring_shape[np.ix_(moved, on_path)],
                on_path,
                back[np.ix_(rows, on_path)],
            )
        )
    return _Residue(residue, orders.blocks(residue), tuple(classes), tuple(sectors))
