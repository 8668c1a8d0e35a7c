"""Which lines the settled motion needs: those beside the present ones whose estimate matters.

On a line beyond those solved for, the mesh forces are ``-D (r * f)`` to first order: one convolution and one
pass through the chain. Adding what has the largest estimate is the adaptive Galerkin method of A. Cohen, W.
Dahmen and R. DeVore, Math. Comput. 70 (2001) 27-75: solve, estimate, mark, refine, coarsen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.models.drivetrain_coupling import LineProblem
from femgear.models.drivetrain_force_lines import ForceEquations, force_table
from femgear.models.drivetrain_lattice import beside, mirrored, mirrored_codes, places

# Root of the sum of squares of what the neighbours that are not looked at get, over the tolerance.
_OVERLOOKED = 0.1
# And of the lines that are left out on purpose.
_LEFT = 0.5
# And of the lines beside which no motion but their own is looked at.
_STRONG = 1.0
# Accuracy of the feedback of what is left out.
_FEEDBACK = 0.3
# Alternating force, relative to the largest mean force, below which there is none.
_STILL = 1e-9


@dataclass(frozen=True)
class Estimate:
    """What is known beside a solution on some lines.

    Parameters
    ----------
    alternating : (n_meshes,) array
        Root mean square of the alternating force [N].
    effect : (L, n_meshes) array
        Squares of the forces on the lines, over the mean square of the alternating force.
    beyond : (C,) int array
        Codes of the neighbours.
    force : (C, n_meshes) complex array
        Their estimated mesh forces.
    left : (C, n_meshes) array
        Effects of the neighbours.
    missed : (L, n_meshes) complex array
        Residual of the equations with all motions of the neighbours.
    fed_back : (n_meshes,) array
        Effect of the neighbours by way of the lines solved for.
    """

    alternating: np.ndarray
    effect: np.ndarray
    beyond: np.ndarray
    force: np.ndarray
    left: np.ndarray
    missed: np.ndarray
    fed_back: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force of all neighbours over that of the alternating force."""
        return np.sqrt(self.left.sum(axis=0))

    @property
    def feedback(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force that the neighbours make by way of the lines solved for, likewise."""
        return np.sqrt(self.fed_back)


def estimate(problem: LineProblem, lines, forces, tolerance: float) -> Estimate:
    """Effects of the lines and of their neighbours.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    forces : (L, n_meshes) complex array
        Two-sided lines of the mesh forces, their solution.
    tolerance : float
        Neighbours that get a small share of this are not looked at.
    """
    alternating = np.sqrt(2.0 * (np.abs(forces[1:]) ** 2).sum(axis=0))
    still = max(_STILL * np.abs(forces[0]).max(), np.finfo(float).tiny)
    alternating = np.maximum(alternating, still)
    effect = 2.0 * np.abs(forces / alternating) ** 2
    effect[0] = 0.0
    beyond = _neighbours(problem, lines, forces / alternating, _OVERLOOKED * tolerance)
    both = np.union1d(lines, beyond)
    table = force_table(problem, lines, both, both)
    answer = table.through(table.still()) - table.answered(forces)
    found, missed = answer[places(both, beyond)], answer[places(both, lines)] - forces
    left = 2.0 * np.abs(found / alternating) ** 2
    return Estimate(alternating, effect, beyond, found, left, missed, np.zeros(len(alternating)))


def with_feedback(equations: ForceEquations, found: Estimate) -> Estimate:
    """With what the neighbours do to the lines solved for: large where these are nearly in resonance.

    One more solution, to three tenths of the feedback.
    """
    lines = equations.lines
    both = np.union1d(lines, found.beyond)
    forces = np.zeros((len(both), len(found.alternating)), complex)
    forces[places(both, found.beyond)] = found.force
    right = found.missed - force_table(equations.problem, both, lines, equations.motions).answered(forces)
    unit = found.alternating * max(np.linalg.norm(right / found.alternating), np.finfo(float).tiny)
    change, _ = equations.solve(right, np.zeros_like(right), unit, _FEEDBACK)
    return replace(found, fed_back=2.0 * (np.abs(change[1:] / found.alternating) ** 2).sum(axis=0))


def refined(problem: LineProblem, lines, forces, found: Estimate, tolerance: float, most: int):
    """The fewest lines that leave half the tolerance out, at most so many; their forces.

    Returns
    -------
    lines : (L,) int array
    forces : (L, n_meshes) complex array
        Solved or estimated.
    """
    kept = problem.codes.admitted(found.beyond)
    codes = np.concatenate([lines, found.beyond[kept]])
    forces = np.concatenate([forces, found.force[kept]])
    effect = np.concatenate([found.effect, found.left[kept]])
    size = effect.max(axis=1)
    # the mean stays
    size[0] = np.inf
    order = np.argsort(size, kind="stable")
    left = np.cumsum(effect[order], axis=0).max(axis=1)
    first = min(np.searchsorted(left, (_LEFT * tolerance) ** 2), len(codes) - 1)
    chosen = order[max(first, len(codes) - most) :]
    chosen = chosen[np.argsort(codes[chosen])]
    return codes[chosen], forces[chosen]


def strong_lines(forces, alternating, tolerance: float) -> np.ndarray:
    """Whether lines (L,) are not among the small ones whose forces add up to some tolerances."""
    effect = 2.0 * (np.abs(forces / alternating) ** 2).max(axis=1)
    effect[0] = np.inf
    order = np.argsort(effect)
    strong = np.empty(len(effect), bool)
    strong[order] = np.cumsum(effect[order]) > (_STRONG * tolerance) ** 2
    return strong


def _neighbours(problem: LineProblem, lines, size, share) -> np.ndarray:
    """Codes of the lines outside that the relative forces (L, n_meshes) reach, but for a share of these."""
    both, size, found = mirrored_codes(lines), np.abs(mirrored(size)), []
    for one in problem.families:
        product = (size[:, None, one.meshes] * np.abs(one.compliance.T)).max(axis=2)
        ordered = np.sort(product, axis=None)
        small = np.searchsorted(np.cumsum(ordered**2), share**2)
        if small < len(ordered):
            at, number = np.nonzero(product >= ordered[small])
            found.append(both[at] + one.compliance_orders[number] * one.step)
    # what a turn of the carrier adds to lines that are not solved for is smaller still
    found += [beside(lines, one.turn) for one in problem.families]
    reached = np.unique(np.abs(np.concatenate(found)))
    return reached[places(lines, reached) < 0]
