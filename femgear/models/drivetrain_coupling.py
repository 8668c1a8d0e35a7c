"""The linear equations of the settled motion on any set of lines: receptance, mesh forces as convolutions.

With the directions ``S``, constant but for shifts by one turn of the carrier, the mesh forces on the simple
motions are ``S * (k * (S^T * x))``, * the convolution over the lattice of orders: three steps, each sparse,
in place of one with the harmonics of ``S k S^T``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_lattice import (
    LineCodes,
    beside,
    line_codes,
    mirrored,
    mirrored_codes,
    places,
)
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.receptance import Reduction, reduce_problem, respond


@dataclass(frozen=True)
class MeshFamily:
    """Meshes whose stiffness has the same base.

    Parameters
    ----------
    meshes : (g,) int array
    step, turn : int
        Codes of the base and of the carrier's turn; a turn of zero where directions stay.
    directions : dict
        {shift by turns: (m, g) complex array}, the lines of ``S``.
    waves : (g, 2 H + 1) complex array
        Two-sided harmonics of the stiffness [N/m].
    mean : (m, m) array
        Of ``S k S^T``.
    """

    meshes: np.ndarray
    step: int
    turn: int
    directions: dict[int, np.ndarray]
    waves: np.ndarray
    mean: np.ndarray

    @property
    def harmonics(self) -> np.ndarray:
        """(2 H + 1,) orders of the waves."""
        half = self.waves.shape[1] // 2
        return np.arange(-half, half + 1)

    @property
    def stiffness(self) -> np.ndarray:
        """(g,) mean stiffness [N/m]."""
        return self.waves[:, self.waves.shape[1] // 2].real

    @property
    def square(self) -> np.ndarray:
        """(g,) mean square of the stiffness [N^2/m^2]."""
        return (np.abs(self.waves) ** 2).sum(axis=1)


@dataclass(frozen=True)
class LineProblem:
    """``x + F(i omega) (rest * x) = x_static`` for the simple motions x.

    Parameters
    ----------
    codes : LineCodes
    frequency : (n_bases,) array
        [rad/s]
    families : tuple of MeshFamily
    reduction : Reduction
        Receptance F of the simple motions with the mean stiffness.
    basic : (n, m) array
        Simple motions.
    displaced : (n,) array
        Static displacement under the constant loads with the mean stiffness.
    scale : (m,) array
        Square roots of the stiffness of the simple motions: all motions in units of energy.
    """

    codes: LineCodes
    frequency: np.ndarray
    families: tuple[MeshFamily, ...]
    reduction: Reduction
    basic: np.ndarray
    displaced: np.ndarray
    scale: np.ndarray

    @property
    def static(self) -> np.ndarray:
        """(m,) simple motions of `displaced`."""
        return self.basic.T @ self.displaced

    def omega(self, lines) -> np.ndarray:
        """(L,) [rad/s]"""
        return self.codes.orders(lines) @ self.frequency

    def receptance(self, lines) -> np.ndarray:
        """``U^T Z^-1 U`` (L, m, m) [m/N]."""
        return self.reduction.at(self.omega(lines))[0][:, :, : self.basic.shape[1]]

    def response(self, lines, forces, outputs) -> np.ndarray:
        """Outputs (L, n_outputs) of forces (L, m) on the simple motions."""
        inputs = np.vstack([forces.T, np.zeros(len(forces))])
        return respond(self.reduction, outputs, self.omega(lines), inputs).T


def line_problem(model: DrivetrainModel, load, speed: float, *, gyroscopic: bool) -> LineProblem:
    """The equations at one speed of the first body [rad/s], with constant loads (n,) that balance."""
    U, codes = model.geometry.basic, line_codes(model)
    families = tuple(_family(model, codes, base) for base in np.unique(model.mesh_base))
    mean = sum((one.mean for one in families), np.zeros((U.shape[1],) * 2))
    K, carried = model.system.K + U @ mean @ U.T, model.system.M @ model.rigid
    # no force of a mesh acts on the spin: any stiffness that holds its mean does
    held = K + np.abs(K).max() / np.abs(carried).max() ** 2 * np.outer(carried, carried)
    system = replace(model.system, K=0.5 * (K + K.T), W=U, load=np.zeros(len(U)))
    reduction = reduce_problem(
        NonlinearSystem(system, (), speed=speed if gyroscopic else 0.0), reference=np.zeros(U.shape[1])
    )
    scale = np.sqrt(np.diag(mean))
    return LineProblem(
        codes, model.frequencies(speed), families, reduction, U, np.linalg.solve(held, load),
        np.where(scale > 0.0, scale, 1.0),
    )  # fmt: skip


def _family(model: DrivetrainModel, codes: LineCodes, base: int) -> MeshFamily:
    geometry, own = model.geometry, np.flatnonzero(model.mesh_base == base)
    stage, turn = geometry.stage[own[0]], 0
    # a simple motion that moves nothing, of held axes, has no direction
    moves = np.any(geometry.basic != 0.0, axis=0)[:, None]
    directions = {0: geometry.fixed[:, own] * moves}
    if stage < len(geometry.even):
        even, odd = geometry.even[stage][:, own] * moves, geometry.odd[stage][:, own] * moves
        if not model.turning:
            directions[0] = directions[0] + even
        elif even.any() or odd.any():
            turn = int(codes.stride[2 * stage])
            directions |= {1: 0.5 * (even - 1j * odd), -1: 0.5 * (even + 1j * odd)}
    k = model.stiffness[own]
    waves = np.hstack([0.5 * k[:, :0:-1].conj(), k[:, :1].real, 0.5 * k[:, 1:]])
    mean = sum((v.conj() * k[:, 0].real) @ v.T for v in directions.values()).real
    return MeshFamily(own, int(codes.stride[base]), turn, directions, waves, mean)


@dataclass(frozen=True)
class FamilyCoupling:
    """Tables of one family from motions on some lines to forces on others.

    Parameters
    ----------
    family : MeshFamily
    inner, outer : (E,), (E',) int arrays
        Lines of the approaches and of the mesh forces.
    gather, scatter : dict
        {shift: rows of the motions for every inner line}, {shift: rows of the mesh forces for every row}.
    stiffness : tuple of sparse arrays
        One a mesh: convolution from all approaches to the mesh forces (E', 2 E - 1).
    """

    family: MeshFamily
    inner: np.ndarray
    outer: np.ndarray
    gather: dict[int, np.ndarray]
    scatter: dict[int, np.ndarray]
    stiffness: tuple

    def approach(self, motion) -> np.ndarray:
        """(E, g) of the two-sided motions with a row of zeros behind them."""
        return sum((motion @ v)[self.gather[a]] for a, v in self.family.directions.items())

    def force(self, approach) -> np.ndarray:
        """(E', g) [N]"""
        both = np.asfortranarray(mirrored(approach))
        return np.stack([k @ both[:, j] for j, k in enumerate(self.stiffness)], axis=1)

    def pushed(self, force) -> np.ndarray:
        """Forces on the simple motions (rows, m)."""
        both = _with_nothing(mirrored(force))
        return sum(both[self.scatter[a]] @ v.T for a, v in self.family.directions.items())


@dataclass(frozen=True)
class Coupling:
    """``rest * x`` on rows, from the simple motions on lines.

    Parameters
    ----------
    own : (rows,) int array
        Place of every row among the two-sided lines, the place behind them for none.
    mean : (m, m) array
        Stiffness that the receptance holds.
    families : tuple of FamilyCoupling
    """

    own: np.ndarray
    mean: np.ndarray
    families: tuple[FamilyCoupling, ...]

    def forces(self, x) -> np.ndarray:
        """(rows, m) [N] of the motions (L, m)."""
        motion = _with_nothing(mirrored(x))
        total = -motion[self.own] @ self.mean
        for one in self.families:
            total += one.pushed(one.force(one.approach(motion)))
        return total

    def approaches(self, x) -> tuple[np.ndarray, ...]:
        """(E, g) of every family."""
        motion = _with_nothing(mirrored(x))
        return tuple(one.approach(motion) for one in self.families)


def coupling(problem: LineProblem, lines, rows) -> Coupling:
    """Tables from lines to rows, both ascending codes."""
    both = mirrored_codes(lines)
    mean = sum(one.mean for one in problem.families)
    parts = tuple(_family_coupling(one, both, lines, rows) for one in problem.families)
    return Coupling(places(both, rows), mean, parts)


def _family_coupling(family: MeshFamily, both, lines, rows) -> FamilyCoupling:
    turn = family.turn
    inner, outer = beside(lines, turn), beside(rows, turn)
    gather = {a: places(both, inner - a * turn) for a in family.directions}
    scatter = {a: places(mirrored_codes(outer), rows - a * turn) for a in family.directions}
    return FamilyCoupling(family, inner, outer, gather, scatter, _convolution(family, inner, outer))


def _convolution(family: MeshFamily, inner, outer) -> tuple:
    from scipy import sparse

    both, found = mirrored_codes(inner), []
    for number in np.flatnonzero(np.any(family.waves != 0.0, axis=0)):
        column = places(both, outer - family.harmonics[number] * family.step)
        row = np.flatnonzero(column >= 0)
        found.append((row, column[row], np.full(len(row), number + 1)))
    row, column, number = (np.concatenate(part) for part in zip(*found))
    table = sparse.csr_array((number, (row, column)), shape=(len(outer), len(both)))
    return tuple(
        sparse.csr_array((wave[table.data - 1], table.indices, table.indptr), shape=table.shape)
        for wave in family.waves
    )


def _with_nothing(values: np.ndarray) -> np.ndarray:
    """With a last row of zeros, which the place -1 takes."""
    return np.concatenate([values, np.zeros_like(values[:1])])
