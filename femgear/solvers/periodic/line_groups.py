"""Groups of lines that directions turning with carriers couple, solved together: a preconditioner of the equations.

Lines of one group differ in the orders of carriers alone. With the mean tangents of the elements over the phases of
all other bases, ``1 + T dF/dX`` falls into the groups, whose factors cost one small matrix each, however many groups
there are. Lines whose other orders are not zero have no part in conjugate ones, and complex factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg

from femgear.solvers.periodic.phase_grid import PhaseGrid


@dataclass(frozen=True)
class LineGroups:
    """Factors of ``1 + T_l K`` of groups of lines.

    Parameters
    ----------
    members : tuple of (k,) int arrays
        Lines of every group.
    factors : tuple
        LU factors of every group, line by line; of real and imaginary parts where these are real.
    """

    members: tuple[np.ndarray, ...]
    factors: tuple[Any, ...]

    def solve(self, lines: np.ndarray) -> np.ndarray:
        """Solve for lines (n, L) of a right side of that shape."""
        solved = np.empty_like(lines)
        for members, factor in zip(self.members, self.factors, strict=True):
            right = lines[:, members].T.ravel()
            if np.iscomplexobj(factor[0]):
                solution = linalg.lu_solve(factor, right)
            else:
                solution = linalg.lu_solve(factor, np.concatenate([np.real(right), np.imag(right)]))
                solution = solution[: len(right)] + 1j * solution[len(right) :]
            solved[:, members] = solution.reshape(len(members), -1).T
        return solved


def line_groups(
    grid: PhaseGrid, turning: Sequence[int], pairs: np.ndarray, receptance: np.ndarray, stiffness: np.ndarray
) -> LineGroups:
    """Factorise the groups of lines of a grid.

    Parameters
    ----------
    grid : PhaseGrid
        Of L lines, line 0 the mean, and N instants.
    turning : sequence of int
        Bases by which directions turn.
    pairs : (p, 2) int array
        Columns that elements couple.
    receptance : (L, n, n) array
        ``T_l`` [m/N].
    stiffness : (N, p) array
        Tangents of the pairs [N/m].
    """
    others = tuple(1 + base for base in range(len(grid.samples)) if base not in turning)
    signals = np.reshape(stiffness.T, (-1, *grid.samples))
    mean = np.broadcast_to(signals.mean(axis=others, keepdims=True), signals.shape).reshape(len(signals), -1)
    coefficients = grid.transform(mean.T)
    kept = np.delete(grid.orders, list(turning), axis=1)
    groups: dict[tuple[int, ...], list[int]] = {}
    for line, order in enumerate(kept.tolist()):
        groups.setdefault(max(tuple(order), tuple(-value for value in order)), []).append(line)
    factors = []
    for key, members in groups.items():
        alike = any(key) and all(tuple(kept[line].tolist()) == key for line in members)
        parts = [grid.differences] if alike else [grid.differences, grid.sums]
        yielded = [_yielded(coefficients, pairs, receptance[members], members, places) for places in parts]
        matrix = yielded[0] if alike else _in_real_parts(*yielded)
        matrix[np.diag_indices(len(matrix))] += 1.0
        factors.append(linalg.lu_factor(matrix, overwrite_a=True))
    return LineGroups(tuple(np.array(members) for members in groups.values()), tuple(factors))


def _yielded(
    coefficients: np.ndarray, pairs: np.ndarray, receptance: np.ndarray, members: list[int], places: Any
) -> np.ndarray:
    """``T K`` of the k lines of a group, line by line, with tangents at places of the transform."""
    k, n, _ = receptance.shape
    at = np.ix_(members, members)
    values = coefficients[:, places[0][at]]
    np.conjugate(values, out=values, where=places[1][at])
    tangents = np.zeros((n, n, k, k), complex)
    tangents[pairs[:, 0], pairs[:, 1]] = values
    # a mean is not counted twice
    tangents[:, :, np.array(members) == 0] *= 0.5
    tangents = np.ascontiguousarray(tangents.transpose(2, 0, 3, 1)).reshape(k, n, k * n)
    return (receptance @ tangents).reshape(k * n, k * n)


def _in_real_parts(straight: np.ndarray, conjugate: np.ndarray) -> np.ndarray:
    """Real matrix of ``Y = A X + B conj(X)``."""
    of_real, of_imaginary = straight + conjugate, 1j * (straight - conjugate)
    parts = np.hstack([of_real, of_imaginary])
    return np.vstack([np.real(parts), np.imag(parts)])
