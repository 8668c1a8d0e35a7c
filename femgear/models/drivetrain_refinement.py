"""Which lines the settled motion needs: those beside the present ones whose estimate matters.

On a line beyond those solved for, the motion is ``-F(i omega) (rest * x)`` to first order: one convolution
and one receptance. Adding what has the largest estimate is the adaptive Galerkin method of A. Cohen, W.
Dahmen and R. DeVore, Math. Comput. 70 (2001) 27-75: solve, estimate, mark, refine, coarsen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.models.drivetrain_coupling import Coupling, LineProblem, coupling
from femgear.models.drivetrain_lattice import beside, mirrored, mirrored_codes, places
from femgear.models.drivetrain_line_solver import LineEquations

# Root of the sum of squares of the neighbours that are not looked at, relative to what may be left out.
_OVERLOOKED = 0.02
# And of the lines that are left out on purpose.
_LEFT = 0.5
# Accuracy of the feedback of what is left out.
_FEEDBACK = 0.1
# Alternating force, relative to the largest mean force, below which there is none.
_STILL = 1e-9


@dataclass(frozen=True)
class Estimate:
    """What is known beside a solution on some lines.

    Parameters
    ----------
    effect : (L, n_meshes) array
        Squares of the forces that the lines make, over the mean square of the alternating force.
    beyond : (C,) int array
        Codes of the neighbours.
    motion : (C, m) complex array
        Their estimated motions.
    left : (C, n_meshes) array
        Effects of the neighbours.
    square : (n_meshes,) array
        Mean square of the alternating force [N^2].
    fed_back : (n_meshes,) array
        Effect of the neighbours by way of the lines solved for.
    """

    effect: np.ndarray
    beyond: np.ndarray
    motion: np.ndarray
    left: np.ndarray
    square: np.ndarray
    fed_back: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force of all neighbours over that of the alternating force."""
        return np.sqrt(self.left.sum(axis=0))

    def energy(self, problem: LineProblem) -> float:
        """Size of the alternating motion of the mesh where it is smallest [N^0.5 m^0.5]."""
        return float(min(np.sqrt(self.square[f.meshes] / f.stiffness).min() for f in problem.families))

    @property
    def feedback(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force that the neighbours make by way of the lines solved for, likewise."""
        return np.sqrt(self.fed_back)


def estimate(equations: LineEquations, x, tolerance: float) -> Estimate:
    """Effects of the lines and of their neighbours.

    Parameters
    ----------
    equations : LineEquations
    x : (L, m) complex array
        Two-sided lines of the simple motions, their solution.
    tolerance : float
        Neighbours whose mesh forces are a small share of this are not looked at.
    """
    problem, table = equations.problem, equations.table
    approaches = table.approaches(x)
    square = _alternating(problem, table, approaches)
    effect = _effects(problem, x) / square
    effect[0] = 0.0
    beyond = _neighbours(equations.lines, table, approaches, square, _OVERLOOKED * tolerance)
    forces = coupling(problem, equations.lines, beyond).forces(x) if len(beyond) else x[:0]
    motion = -problem.response(beyond, forces, problem.basic.T)
    left = _effects(problem, motion) / square
    return Estimate(effect, beyond, motion, left, square, np.zeros(len(square)))


def with_feedback(equations: LineEquations, found: Estimate) -> Estimate:
    """With what the neighbours do to the lines solved for: large where these are nearly in resonance.

    One more solution, to a tenth of the feedback.
    """
    problem = equations.problem
    if not len(found.beyond):
        return found
    # sets of lines begin with the mean
    beyond = np.append(0, found.beyond)
    motion = np.concatenate([np.zeros_like(found.motion[:1]), found.motion])
    forces = coupling(problem, beyond, equations.lines).forces(motion)
    right = -problem.response(equations.lines, forces, problem.basic.T)
    change, _ = equations.solve(right, np.zeros_like(right), _FEEDBACK)
    return replace(found, fed_back=_effects(problem, change)[1:].sum(axis=0) / found.square)


def refined(problem: LineProblem, lines, x, found: Estimate, tolerance: float, most: int):
    """The fewest lines that leave half the tolerance out, at most so many; their motions.

    Returns
    -------
    lines : (L,) int array
    x : (L, m) complex array
        Solved or estimated.
    """
    kept = problem.codes.admitted(found.beyond)
    codes = np.concatenate([lines, found.beyond[kept]])
    motion = np.concatenate([x, found.motion[kept]])
    effect = np.concatenate([found.effect, found.left[kept]])
    size = effect.max(axis=1)
    # the mean stays
    size[0] = np.inf
    order = np.argsort(size, kind="stable")
    left = np.cumsum(effect[order], axis=0).max(axis=1)
    first = min(np.searchsorted(left, (_LEFT * tolerance) ** 2), len(codes) - 1)
    chosen = order[max(first, len(codes) - most) :]
    chosen = chosen[np.argsort(codes[chosen])]
    return codes[chosen], motion[chosen]


def _alternating(problem: LineProblem, table: Coupling, approaches) -> np.ndarray:
    """Mean squares (n_meshes,) of the alternating mesh forces [N^2]."""
    square, mean = np.zeros((2, sum(len(one.meshes) for one in problem.families)))
    for one, approach in zip(table.families, approaches):
        force = one.force(approach)
        square[one.family.meshes] = 2.0 * (np.abs(force[1:]) ** 2).sum(axis=0)
        mean[one.family.meshes] = np.abs(force[0])
    return np.maximum(square, max((_STILL * mean.max()) ** 2, np.finfo(float).tiny))


def _effects(problem: LineProblem, x) -> np.ndarray:
    """Mean squares (L, n_meshes) of the forces that every line makes with the varying stiffness [N^2]."""
    out = np.zeros((len(x), sum(len(one.meshes) for one in problem.families)))
    for one in problem.families:
        for v in one.directions.values():
            out[:, one.meshes] += 2.0 * np.abs(x @ v) ** 2 * one.square
    return out


def _neighbours(lines, table, approaches, square, share) -> np.ndarray:
    """Codes of the lines outside that the mesh forces reach, but for a share of these."""
    found = []
    for one, approach in zip(table.families, approaches):
        family, both = one.family, mirrored_codes(one.inner)
        relative = family.waves.T / np.sqrt(square[family.meshes])
        size = (np.abs(mirrored(approach))[:, None, :] * np.abs(relative)).max(axis=2)
        ordered = np.sort(size, axis=None)
        small = np.searchsorted(np.cumsum(ordered**2), share**2)
        if small == len(ordered):
            continue
        at, number = np.nonzero(size >= ordered[small])
        reached = np.unique(np.abs(both[at] + family.harmonics[number] * family.step))
        found.append(beside(reached, family.turn))
    reached = np.unique(np.concatenate([lines[:0], *found]))
    return reached[places(lines, reached) < 0]
