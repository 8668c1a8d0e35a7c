"""The settled motion as equations for the lines of the mesh forces.

Where shafts are soft the mesh forces follow from the torques and hardly alternate, whatever the stiffness k
does: the motion gives way, by very many lines whose forces cancel. With the mean stiffness k_0, ``r = k_0 / k
- 1``, the directions S and the receptance G of the chain with k_0 the approaches are ``S^T x = (1 + r) f /
k_0``, the motions ``x = x_static + G S (r * f)``, and the forces obey ``f + D (r * f) = k_0 S^T x_static``
with ``D = 1 - k_0 S^T G S``. D is small where the chain gives way, one where its bodies stay at rest, large
at its resonances; few lines carry forces.
GMRES is preconditioned with every mesh by itself, its stiffness varying: blocks of lines that the harmonics
of this mesh connect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain_coupling import (
    FamilyCoupling,
    LineProblem,
    MeshFamily,
    force_couplings,
    pairs,
    with_nothing,
)
from femgear.models.drivetrain_lattice import beside, mirrored, mirrored_codes, places
from femgear.models.drivetrain_line_solver import Chain, constant_chain, krylov


@dataclass(frozen=True)
class ForceTable:
    """From mesh forces on lines to those that the chain answers with, on rows.

    Parameters
    ----------
    problem : LineProblem
    lines : (R,) int array
        Codes of the rows.
    families : tuple of FamilyCoupling
    at : (R,) int array
        Place of the rows among the lines of the motions.
    chain : Chain
        On these.
    """

    problem: LineProblem
    lines: np.ndarray
    families: tuple[FamilyCoupling, ...]
    at: np.ndarray
    chain: Chain

    def changed(self, forces) -> np.ndarray:
        """``r * f`` (R, n_meshes) [N] of the forces (L, n_meshes)."""
        out = np.empty((len(self.lines), forces.shape[1]), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.times(forces[:, one.family.meshes])
        return out

    def on_motions(self, forces) -> np.ndarray:
        """Forces (M, m) of the meshes (R, n_meshes) on the simple motions, ``S f``."""
        return sum(one.pushed(forces[:, one.family.meshes]) for one in self.families)

    def through(self, x) -> np.ndarray:
        """Forces (R, n_meshes) of motions (M, m) with the mean stiffness, ``k_0 S^T x``."""
        motion, k = with_nothing(mirrored(x)), self.problem.stiffness
        out = np.empty((len(self.lines), len(k)), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.approach(motion)
        return out * k

    def answered(self, forces) -> np.ndarray:
        """``D (r * f)`` (R, n_meshes)."""
        changed = self.changed(forces)
        return changed - self.through(self.chain.pushed(self.on_motions(changed)))

    def still(self) -> np.ndarray:
        """Motions (M, m) with the mean stiffness; the first row is the mean."""
        right = np.zeros(self.chain.receptance.shape[:2], complex)
        right[0] = self.problem.static
        return self.chain.solve(right)

    def motions(self, forces) -> np.ndarray:
        """Motions (M, m) under the forces and the loads."""
        return self.still() + self.chain.pushed(self.on_motions(self.changed(forces)))


def force_table(problem: LineProblem, lines, rows, motions) -> ForceTable:
    """Tables from forces on lines to forces on rows by motions: ascending codes that begin with the mean."""
    families = force_couplings(problem, lines, rows, motions)
    return ForceTable(problem, rows, families, places(motions, rows), constant_chain(problem, motions))


@dataclass(frozen=True)
class ForceEquations:
    """The equations on one set of lines, ready to be solved.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    table : ForceTable
        From these lines to themselves.
    blocks : tuple
        Factors of every mesh by itself.
    motions : (M,) int array
        Lines of the motions: the turn of a carrier reaches some that the forces do without.
    """

    problem: LineProblem
    lines: np.ndarray
    table: ForceTable
    blocks: tuple
    motions: np.ndarray

    def left_side(self, forces) -> np.ndarray:
        """``f + D (r * f)`` (L, n_meshes)."""
        return forces + self.table.answered(forces)

    def prepared(self, forces) -> np.ndarray:
        """Solution (L, n_meshes) with every mesh by itself."""
        both, out = mirrored(forces), np.empty_like(forces)
        for mesh, chosen, at, turned, factors in self.blocks:
            found = factors.solve(np.ascontiguousarray(both[chosen, mesh]))[at]
            out[:, mesh] = np.where(turned, found.conj(), found)
        return out

    def solve(self, right, start, unit, accuracy: float) -> tuple[np.ndarray, float]:
        """Forces (L, n_meshes) and their residual in units (n_meshes,) [N]."""
        return krylov(self.left_side, self.prepared, right, start, unit, accuracy)


def force_equations(problem: LineProblem, lines, strong=slice(None)) -> ForceEquations:
    """Tables and factors for the codes of lines (L,); the turn of a carrier is seen beside strong ones."""
    motions = lines
    for one in problem.families:
        motions = np.union1d(motions, beside(lines[strong], one.turn))
    table = force_table(problem, lines, lines, motions)
    own = _own_answer(problem, table.chain.receptance[table.at])
    blocks = tuple(b for one in problem.families for b in _mesh_blocks(problem, one, lines, own))
    return ForceEquations(problem, lines, table, blocks, motions)


def _own_answer(problem: LineProblem, receptance) -> np.ndarray:
    """D of every mesh to itself (L, n_meshes), the turn left out."""
    out = np.empty((len(receptance), len(problem.stiffness)), complex)
    for one in problem.families:
        x = sum(((receptance @ v) * v.conj()).sum(axis=1) for v in one.directions.values())
        out[:, one.meshes] = 1.0 - one.stiffness * x
    return out


def _mesh_blocks(problem: LineProblem, family: MeshFamily, lines, own):
    """Factors of ``1 + D r`` of single meshes: of two mirror images of a block of lines one is enough."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    both = mirrored_codes(lines)
    base = int(np.flatnonzero(problem.codes.stride == family.step)[0])
    chosen = np.flatnonzero(both - problem.codes.orders(both)[:, base] * family.step >= 0)
    codes, n = both[chosen], len(chosen)
    at = places(codes, lines)
    turned = at < 0
    at = np.where(turned, places(codes, -lines), at)
    row, column, number = pairs(family, codes, codes, family.compliance_orders)
    place = np.concatenate([np.arange(n), row]), np.concatenate([np.arange(n), column])
    for j, mesh in enumerate(family.meshes):
        value = mirrored(own[:, mesh])[chosen][row] * family.compliance[j][number]
        block = sparse.coo_array((np.append(np.ones(n), value), place), shape=(n, n))
        yield mesh, chosen, at, turned, splu(block.tocsc())
