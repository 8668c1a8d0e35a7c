"""Pivoting steps of the contact solution: linear solutions of one active set, and how it changes.

For a set ``A`` of touching candidates the conditions are linear: ``H_AA p_A - G_A q = -gap_A`` and
``G_A^T p_A = load``, solved by one Cholesky factor of ``H_AA`` and the Schur complement
``G_A^T H_AA^-1 G_A``. All candidates that pull or penetrate change sides at once; when their number does
not fall, one at a time does, the one with the largest index (block principal pivoting with Murty's rule:
J. J. Judice, F. M. Pires, Computers Oper. Res. 21, 1994). Motions that no touching candidate restrains are
treated explicitly: they are moved until something touches if they carry load, and stay as close to zero as
the gaps allow if they do not (least distance problem: C. L. Lawson, R. J. Hanson, Solving Least Squares
Problems, 1974, chapter 23).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import get_lapack_funcs

from femgear.errors import ContactError

PATIENCE = 3  # block steps without progress before single pivots
ROUNDING = 1e-13  # gaps and loads below this share of their terms are rounding
RIGID = 1e-6  # elastic displacements below this share of the gaps are those of rigid bodies
NULL = 1e-10  # relative eigenvalue below which a motion is not restrained

dpotrf, dtrtrs = get_lapack_funcs(("potrf", "trtrs"), dtype=np.float64)


@dataclass(frozen=True)
class ComplementarityProblem:
    """The contact problem scaled to unit mean compliance and unit largest arm of every motion.

    Parameters
    ----------
    H : (n, n) array
        Compliance over its mean diagonal entry [1].
    gap : (n,) array
        Separations over the same [N].
    G : (n, m) array
        Approach per motion [1], largest entry of every column one.
    load : (m,) array
        External load over the arm [N].
    compliance : float
        Mean diagonal entry that was taken out [m/N].
    arm : (m,) array
        Largest arms that were taken out.
    """

    H: np.ndarray
    gap: np.ndarray
    G: np.ndarray
    load: np.ndarray
    compliance: float
    arm: np.ndarray


@dataclass(frozen=True)
class Step:
    """Solution of the linear conditions of one active set, and what they violate; scaled as `ComplementarityProblem`.

    Parameters
    ----------
    active : (n,) bool array
        Candidates that are taken to touch.
    loads, gaps : (n,) arrays
        Contact loads, and separations that remain, over the mean compliance [N].
    motions : (m,) array
        Over the mean compliance as well [N].
    flips : (f,) int array
        Candidates that pull, penetrate or must touch; empty when the problem is solved.
    forced : (g,) int array
        Those of `flips` that must touch to restrain a motion.
    null : (m, k) array
        Motions that no touching candidate restrains.
    residual : float
        See `femgear.contact.solve.ContactState`.
    tolerance : float
        Load that counts as rounding [N].
    """

    active: np.ndarray
    loads: np.ndarray
    motions: np.ndarray
    gaps: np.ndarray
    flips: np.ndarray
    forced: np.ndarray
    null: np.ndarray
    residual: float
    tolerance: float


def factor(H):
    """Compute the lower Cholesky factor (n, n) of a symmetric matrix (n, n), whose strict upper triangle is not used.

    ContactError: E-CONTACT-COMPLIANCE when the matrix is not positive definite.
    """
    lower, info = dpotrf(H, lower=1, clean=0)
    if info:
        lowest = np.linalg.eigvalsh(H)[0]
        raise ContactError(
            f"the contact compliance matrix is not positive definite: lowest eigenvalue {lowest:.3g}, "
            f"largest diagonal entry {np.diag(H).max():.3g}",
            code="E-CONTACT-COMPLIANCE",
            value=float(lowest),
            limit="above zero",
            remedy="check that no candidate appears twice and that the local part is on the diagonal",
        )
    return lower


def forward(lower, columns):
    """``L^-1 columns`` for a lower factor (n, n) and columns (n,) or (n, k)."""
    return dtrtrs(lower, columns, lower=1)[0]


def solve_step(problem: ComplementarityProblem, active: np.ndarray) -> Step:
    """Solve the linear conditions of one active set and list the candidates that violate the others.

    ``active`` (n,) tells the candidates that carry; pressures are forces [N], motions and gaps [m].

    ContactError: E-CONTACT-OPEN when no candidate can balance the load.
    """
    loads, motions, null = _solve_bordered(problem, np.flatnonzero(active))
    elastic, approach = problem.H @ loads, problem.G @ motions
    gaps = problem.gap + elastic - approach
    scale = np.abs(elastic).max(initial=0.0)
    blocked = forced = np.zeros(0, int)
    if null.shape[1]:
        shift, blocked, forced = settle(problem.G, problem.load, null, gaps, active)
        motions = motions + null @ shift
        # the multipliers of the least distance problem carry the rounding of its largest row
        scale += 10 * np.abs(problem.G @ (null @ shift)).max(initial=0.0)
        approach = problem.G @ motions
        gaps = problem.gap + elastic - approach
    rounding = ROUNDING * (np.abs(problem.gap) + scale + np.abs(approach))
    tolerance = 10 * ROUNDING * np.abs(loads).max(initial=0.0)
    wrong = np.where(active, loads < -tolerance, gaps < -rounding)
    wrong[blocked] = False
    wrong[forced] = True
    return Step(
        active=active,
        loads=loads,
        motions=motions,
        gaps=gaps,
        flips=np.flatnonzero(wrong),
        forced=forced,
        null=null,
        residual=_residual(problem, active, loads, gaps),
        tolerance=tolerance,
    )


def _solve_bordered(problem: ComplementarityProblem, index: np.ndarray):
    """Loads, motions and unrestrained motions when exactly the candidates `index` touch.

    The second round removes what rounding leaves when the separations are large against the elastic
    displacements.
    """
    n, m = problem.G.shape
    loads, motions = np.zeros(n), np.zeros(m)
    if not len(index):
        return loads, motions, np.eye(m)
    H, G, gap = problem.H[np.ix_(index, index)], problem.G[index], problem.gap[index]
    lower = factor(H)
    half = forward(lower, G)
    values, vectors = np.linalg.eigh(half.T @ half)
    free = values <= NULL * values.max(initial=0.0)
    null, held = vectors[:, free], vectors[:, ~free]
    touching = np.zeros(len(index))
    for _ in range(2):
        offset = forward(lower, gap + H @ touching - G @ motions)
        balance = problem.load - G.T @ touching + half.T @ offset
        change = held @ ((held.T @ balance) / values[~free])
        touching += dtrtrs(lower, half @ change - offset, lower=1, trans=1)[0]
        motions += change
    loads[index] = touching
    return loads, motions, null


def _residual(problem: ComplementarityProblem, active, loads, gaps) -> float:
    """Largest relative violation of the conditions; see `ContactState`."""
    elastic, gap = (np.abs(values).max(initial=0.0) for values in (problem.H @ loads, problem.gap))
    # the separations of nearly rigid bodies are differences of far larger numbers
    length = max(elastic, RIGID * gap) or 1.0
    force = max(np.abs(loads).max(initial=0.0), np.abs(problem.load).max(initial=0.0)) or 1.0
    imbalance = np.abs(problem.G.T @ loads - problem.load).max(initial=0.0)
    touching = np.abs(gaps[active]).max(initial=0.0)
    penetration, pull = -gaps.min(initial=0.0), -loads.min(initial=0.0)
    return float(max(touching / length, penetration / length, pull / force, imbalance / force))


def settle(G, load, null, gaps, active):
    """Move what no touching candidate restrains: the shift, who cannot be judged, who must touch.

    ContactError: E-CONTACT-OPEN when no candidate can balance the load.

    Parameters
    ----------
    G, load : (n, m), (m,) arrays
        Of a `ComplementarityProblem`.
    null : (m, k) array
        Motions that no touching candidate restrains.
    gaps : (n,) array
        Separations before these motions.
    active : (n,) bool array
        Candidates that are taken to touch.

    Returns
    -------
    tuple
        Amounts (k,) along the columns of `null`, the smallest that end all penetration; numbers of the
        candidates whose gaps mean nothing because no shift settles these motions, and of those that must
        touch.
    """
    arms = G @ null
    moved = np.flatnonzero(~active & (np.abs(arms).max(axis=1) > 1e-9))
    pull = null.T @ load
    if np.abs(pull).max() > 1e-9 * np.abs(load).max(initial=0.0):
        speed = arms[moved] @ pull
        meets = speed > 1e-9 * np.abs(speed).max(initial=0.0)
        if not meets.any():
            raise ContactError(
                "no candidate can balance the load: the contacts cannot push in its direction",
                code="E-CONTACT-OPEN",
                remedy="check the sign of the load, and that the faults leave teeth that can carry it",
            )
        first = moved[meets][np.argmin(gaps[moved[meets]] / speed[meets])]
        return np.zeros(len(pull)), moved, np.array([first])
    shift, support = _least_motion(arms[moved], gaps[moved])
    if shift is None:
        return np.zeros(len(pull)), moved, moved[support]
    return shift, moved[:0], moved[:0]


def _least_motion(arms, gaps):
    """Smallest ``z`` with ``arms z <= gaps``, or the constraints that contradict one another.

    Least distance programming by non-negative least squares (Lawson and Hanson, chapter 23): when there
    is no solution, the positive multipliers combine the constraints to ``0 <= negative``.
    """
    from scipy.optimize import nnls

    k = arms.shape[1]
    deepest = -gaps.min(initial=0.0)
    if deepest <= 0:
        return np.zeros(k), None
    rows = np.column_stack([-arms, -gaps / deepest])
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    target = np.append(np.zeros(k), 1.0)
    multipliers, _ = nnls(rows.T, target)
    rest = rows.T @ multipliers - target
    if np.linalg.norm(rest) < 1e-8:
        return None, np.flatnonzero(multipliers > 0)
    return -rest[:k] / rest[k] * deepest, None


def pivot(problem: ComplementarityProblem, active, *, max_steps, single) -> tuple[Step, int]:
    """Flip all violations while their number falls; then, if `single`, one at a time until it falls again.

    From the first active set (n,); gives the last step, solved when its `flips` are empty, and the number of
    steps.
    """
    fewest, patience = np.inf, PATIENCE
    for iteration in range(1, max_steps + 1):
        step = solve_step(problem, active)
        flips = step.flips
        if not len(flips) or iteration == max_steps:
            break
        if len(flips) < fewest:
            fewest, patience = len(flips), PATIENCE
        elif patience:
            patience -= 1
        elif not single:
            break
        else:
            flips = step.forced if len(step.forced) else flips[-1:]
        active = active.copy()
        active[flips] ^= True
    return step, iteration
