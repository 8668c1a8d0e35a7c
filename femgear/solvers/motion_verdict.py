"""What a motion found by integration says about itself: fixed-point radius, and verdict of its monodromy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import FemgearError
from femgear.solvers.elements import Element
from femgear.solvers.harmonic_equations import harmonic_balance
from femgear.solvers.nonlinear import HarmonicForce, NonlinearSystem
from femgear.solvers.verdict import FloquetVerdict, verdict_of

# Stiffness and damping of a motion, relative to the largest, that count as none.
_FREE = 1e-11


@dataclass(frozen=True)
class _Turned:
    """An element whose base phases are multiples ``turns`` of a single one."""

    element: Element
    turns: tuple[int, ...]

    @property
    def columns(self) -> np.ndarray:
        return self.element.columns

    @property
    def reference(self) -> np.ndarray:
        return self.element.reference

    def evaluate(self, x, theta):
        return self.element.evaluate(x, np.asarray(theta, float) * np.array(self.turns, float))


def on_one_base(problem: NonlinearSystem, turns) -> NonlinearSystem:
    """The problem over one base frequency of which the given ones are multiples.

    Parameters
    ----------
    problem : NonlinearSystem
    turns : (n_bases,) int array
        The base frequencies over the single one.
    """
    turns = tuple(int(turn) for turn in turns)
    if turns == (1,):
        return problem
    forces = tuple(
        HarmonicForce(force.force, (sum(o * turn for o, turn in zip(force.orders, turns)),))
        for force in problem.forces
    )
    return replace(
        problem, elements=tuple(_Turned(element, turns) for element in problem.elements), forces=forces
    )


def radius_of_lines(problem: NonlinearSystem, turns, omega: float, lines: np.ndarray) -> tuple[float, str]:
    """Spectral radius of the fixed point at the lines of a periodic motion; nan and the reason without one.

    Parameters
    ----------
    problem : NonlinearSystem
    turns : (n_bases,) int array
        See `on_one_base`.
    omega : float
        Angular frequency of the motion [rad/s].
    lines : (n_columns, L) complex array
        Mean and harmonics of the deflections [m].
    """
    try:
        balance = harmonic_balance(on_one_base(problem, turns), orders=np.arange(lines.shape[1])[:, None])
        return balance.spectral_radius(balance.unknowns(lines), [omega]), ""
    except FemgearError as error:
        return np.nan, f"; no spectral radius of a fixed point: {error.message}"


def verdict_of_monodromy(
    problem: NonlinearSystem, monodromy: np.ndarray, period: float, *, error: float, trivial: int = 0
) -> FloquetVerdict:
    """Verdict of a monodromy matrix in (q, v / rate).

    Free motions that neither stiffness, damping nor a column feels have a double multiplier one, which
    rounding splits; they are left out (as `hill.floquet_verdicts` does). Of those that damping feels the
    position has the multiplier one and is left out, the velocity counts.

    Parameters
    ----------
    problem : NonlinearSystem
    monodromy : (2n, 2n) array
    period : float
        [s]
    error : float
        Relative error of the matrix.
    trivial : int
        Multipliers one of a free vibration, its phase and its amplitude, which are left out too.
    """
    matrix, positions = _without_free_motions(problem, monodromy)
    values = np.linalg.eigvals(matrix)
    found = verdict_of(
        values, period, "shooting", error, np.inf, positions=trivial + positions, velocities=positions
    )
    if trivial:
        note = f", without {trivial} of phase{' and amplitude' if trivial > 1 else ''} that are one"
        found = replace(found, message=found.message + note)
    return found


def _without_free_motions(problem: NonlinearSystem, monodromy: np.ndarray) -> tuple[np.ndarray, int]:
    """The monodromy matrix on the motions that are orthogonal in mass to those that nothing feels.

    With it the number of free motions left in it, whose velocities damping feels.
    """
    from scipy import linalg

    system, n = problem.system, len(problem.system.M)
    root = np.linalg.cholesky(system.M)

    def carried(rows):
        # in coordinates of unit mass, over its own size: stiffness, damping and columns count alike
        rows = linalg.solve_triangular(root, rows.T, lower=True).T
        return rows / (np.abs(rows).max(initial=0.0) or 1.0)

    held = np.vstack([carried(rows) for rows in (system.K, system.W.T)])
    damped = [carried(rows) for rows in (system.K.T, problem.damping, problem.damping.T)]
    _, size, right = np.linalg.svd(np.vstack([held, *damped]))
    rank = int(np.sum(size > _FREE * size[0])) if len(size) else 0
    size = np.linalg.svd(held, compute_uv=False)
    positions = rank - int(np.sum(size > _FREE * size.max(initial=0.0)))
    if rank == n:
        return monodromy, positions
    moving = right[:rank]
    # q = L^-T z and z = L^T q with M = L L^T; the moving part of z is closed in itself
    back = linalg.solve_triangular(root, moving.T, lower=True, trans="T")
    there, here = np.kron(np.eye(2), moving @ root.T), np.kron(np.eye(2), back)
    return there @ monodromy @ here, positions
