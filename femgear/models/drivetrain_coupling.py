"""The linear equations of the settled motion on any set of lines: receptance, mesh forces as convolutions.

With the directions ``S``, constant but for shifts by one turn of the carrier, the mesh forces on the simple
motions are ``S * (k * (S^T * x))``, * the convolution over the lattice of orders: three steps, each sparse,
in place of one with the harmonics of ``S k S^T``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
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
from femgear.solvers.series import FourierSeries

# Points of a mesh period for the compliance, and harmonics of it that are none.
_POINTS, _NONE = 8192, 1e-7
# Stiffness of a mesh over its mean below which its compliance has no series.
_SOFTEST = 1e-3


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
    compliance : (g, N) complex array
        Two-sided harmonics of ``mean / k - 1``.
    compliance_orders : (N,) int array
    mean : (m, m) array
        Of ``S k S^T``.
    """

    meshes: np.ndarray
    step: int
    turn: int
    directions: dict[int, np.ndarray]
    waves: np.ndarray
    compliance: np.ndarray
    compliance_orders: np.ndarray
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
    def stiffness(self) -> np.ndarray:
        """(n_meshes,) mean stiffness [N/m]."""
        out = np.empty(sum(len(one.meshes) for one in self.families))
        for one in self.families:
            out[one.meshes] = one.stiffness
        return out

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
    return MeshFamily(own, int(codes.stride[base]), turn, directions, waves, *_compliance(model, own), mean)


def _compliance(model: DrivetrainModel, own) -> tuple[np.ndarray, np.ndarray]:
    """Two-sided harmonics (g, N) of mean / k - 1 and their orders (N,)."""
    phase = 2.0 * np.pi * np.arange(_POINTS)[:, None] / _POINTS
    k = np.array(FourierSeries(model.stiffness[own]).at(phase))
    mean = model.mean_stiffness[own]
    low = k.min(axis=0) / mean
    if low.min() < _SOFTEST:
        raise CaseError(
            f"the stiffness of {model.meshes[own[np.argmin(low)]]} falls to {low.min():.3g} of its mean",
            code="E-STIFFNESS", limit=f"{_SOFTEST:g} of the mean or more at any time",
            remedy="take a larger low_share, or more harmonics",
        )  # fmt: skip
    waves = np.fft.fft(mean / k - 1.0, axis=0).T / _POINTS
    half = int(np.flatnonzero(np.abs(waves[:, : _POINTS // 2]).max(axis=0) > _NONE).max(initial=0))
    orders = np.arange(-half, half + 1)
    return waves[:, orders], orders


@dataclass(frozen=True)
class FamilyCoupling:
    """Tables of one family from motions on some lines to forces on others.

    Parameters
    ----------
    family : MeshFamily
    outer : (E',) int array
        Lines of the mesh forces.
    gather, scatter : dict
        {shift: rows of the motions for every approach}, {shift: rows of the mesh forces for every row}.
    varying : tuple of sparse arrays
        One a mesh: convolution with what varies, from all lines to those of the mesh forces.
    """

    family: MeshFamily
    outer: np.ndarray
    gather: dict[int, np.ndarray]
    scatter: dict[int, np.ndarray]
    varying: tuple

    def approach(self, motion) -> np.ndarray:
        """(E, g) of the two-sided motions with a row of zeros behind them."""
        return sum((motion @ v)[self.gather[a]] for a, v in self.family.directions.items())

    def times(self, values) -> np.ndarray:
        """Convolution (E', g) of the lines (E, g): approaches by the stiffness, forces by the compliance."""
        both = np.asfortranarray(mirrored(values))
        return np.stack([k @ both[:, j] for j, k in enumerate(self.varying)], axis=1)

    def pushed(self, force) -> np.ndarray:
        """Forces on the simple motions (rows, m)."""
        both = with_nothing(mirrored(force))
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
        motion = with_nothing(mirrored(x))
        total = -motion[self.own] @ self.mean
        for one in self.families:
            total += one.pushed(one.times(one.approach(motion)))
        return total

    def mesh_forces(self, x, lines) -> np.ndarray:
        """(L, n_meshes) [N], of these lines."""
        motion = with_nothing(mirrored(x))
        out = np.empty((len(lines), sum(len(one.family.meshes) for one in self.families)), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.times(one.approach(motion))[places(one.outer, lines)]
        return out


def coupling(problem: LineProblem, lines) -> Coupling:
    """Tables from the lines, ascending codes, to themselves."""
    both = mirrored_codes(lines)
    mean, parts = sum(one.mean for one in problem.families), []
    for family in problem.families:
        wide = beside(lines, family.turn)
        table = convolution(family, wide, wide, family.harmonics, family.waves)
        parts.append(FamilyCoupling(family, wide, *_turned(family, lines, wide), table))
    return Coupling(places(both, lines), mean, tuple(parts))


def _turned(family: MeshFamily, lines, wide) -> tuple[dict, dict]:
    """Rows of the two-sided lines for every wide one, and the reverse, a turn apart."""
    both, widened = mirrored_codes(lines), mirrored_codes(wide)
    gather = {a: places(both, wide - a * family.turn) for a in family.directions}
    return gather, {a: places(widened, lines - a * family.turn) for a in family.directions}


def force_couplings(problem: LineProblem, lines, rows, motions) -> tuple[FamilyCoupling, ...]:
    """Tables from mesh forces on lines to what they change on rows, and from there to motions and back."""
    return tuple(
        FamilyCoupling(
            one, rows, *_turned(one, motions, rows),
            convolution(one, lines, rows, one.compliance_orders, one.compliance),
        )
        for one in problem.families
    )  # fmt: skip


def pairs(family: MeshFamily, codes, rows, orders) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns among the codes and numbers of the orders that lead from one to the other."""
    found = []
    for number, order in enumerate(orders):
        column = places(codes, rows - order * family.step)
        row = np.flatnonzero(column >= 0)
        found.append((row, column[row], np.full(len(row), number)))
    return tuple(np.concatenate(part) for part in zip(*found))


def convolution(family: MeshFamily, lines, rows, orders, waves) -> tuple:
    """Sparse arrays (R, 2 L - 1), one a mesh, of the waves (g, N)."""
    from scipy import sparse

    codes = mirrored_codes(lines)
    used = np.flatnonzero(np.any(waves != 0.0, axis=0))
    used = used if len(used) else np.array([0])
    row, column, number = pairs(family, codes, rows, orders[used])
    table = sparse.csr_array((number + 1, (row, column)), shape=(len(rows), len(codes)))
    return tuple(
        sparse.csr_array((wave[used][table.data - 1], table.indices, table.indptr), shape=table.shape)
        for wave in waves
    )


def with_nothing(values: np.ndarray) -> np.ndarray:
    """With a last row of zeros, which the place -1 takes."""
    return np.concatenate([values, np.zeros_like(values[:1])])
