"""The contact problem: one complementarity problem for all meshes at one position.

Find contact loads ``p`` (n candidates) and motions ``q`` (m bodies) with

    w = gap + H p - G q >= 0,    p >= 0,    p_i w_i = 0,    G^T p = load.

These are the optimality conditions of ``min p^T H p / 2 + gap^T p`` under ``p >= 0`` and ``G^T p = load``
(the motions are its multipliers), so ``p`` is unique when ``H`` is positive definite.

The steps are in `femgear.contact.active_set`; daqp is the last resort.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.contact.active_set import ComplementarityProblem, Step, factor, pivot, solve_step
from femgear.errors import ContactError


@dataclass(frozen=True)
class ContactState:
    """Solution of the contact problem at one position.

    Parameters
    ----------
    loads : (n,) array
        Contact loads ``p`` [N], never negative, exactly zero where not `active`.
    motions : (m,) array
        Motions ``q`` [m].
    gaps : (n,) array
        Remaining separations ``w`` [m], never negative, exactly zero where `active`.
    active : (n,) bool array
        Candidates that carry load.
    iterations : int
        Number of linear solutions.
    residual : float
        Largest violation, before the clean-up of rounding errors: separation at touching candidates and
        penetration relative to the largest elastic displacement (at least 1e-6 of the largest gap), pull
        and imbalance relative to the largest load.
    method : str
        ``"active set"``, ``"active set, single pivots"``, ``"daqp"`` or ``"no load"``.
    open_motions : (m,) bool array
        Motions that no loaded candidate restrains (such as that of a planet that carries nothing). They
        have the smallest value at which nothing penetrates.
    """

    loads: np.ndarray
    motions: np.ndarray
    gaps: np.ndarray
    active: np.ndarray
    iterations: int
    residual: float
    method: str
    open_motions: np.ndarray

    def __post_init__(self):
        for array in (self.loads, self.motions, self.gaps, self.active, self.open_motions):
            array.setflags(write=False)


def solve_contact(H, gap, G, load, *, start=None, max_steps=200) -> ContactState:
    """Contact loads and motions of bodies that touch without pulling or penetrating.

    ContactError: E-SHAPE for wrong shapes or values that are not finite, E-CONTACT-COMPLIANCE for a matrix
    that is not symmetric positive definite, E-CONTACT-OPEN when no contact can balance the load, E-CONTACT
    when no method solves the problem.

    Parameters
    ----------
    H : (n, n) array
        Compliance between the candidates, symmetric positive definite [m/N].
    gap : (n,) array
        Separations without load and motion [m]; negative where the undeformed surfaces overlap.
    G : (n, m) array
        Approach at each candidate per unit motion [1, or m/rad].
    load : (m,) array
        External load that the contacts balance, ``G^T p = load`` [N, or N m].
    start : (n,) bool array, optional
        Candidates thought to touch, such as those of the neighbouring position; all when not given.
    max_steps : int, optional
        Bound on the steps of each stage, after the last of which the general solver daqp takes over.
    """
    problem = _scaled(*_checked(H, gap, G, load))
    n = len(problem.gap)
    if not problem.load.any():
        step = solve_step(problem, np.zeros(n, bool))
        if not len(step.flips):
            return _state(problem, step, 1, "no load")
    step, iterations, method = _search(problem, start, max_steps)
    return _state(problem, _without_idle(problem, step), iterations, method)


def _checked(H, gap, G, load):
    """The four arrays, refused when they cannot be a contact problem."""
    H, gap, G, load = (np.asarray(a, float) for a in (H, gap, G, load))
    n, m = G.shape if G.ndim == 2 else (-1, -1)
    if H.shape != (n, n) or gap.shape != (n,) or load.shape != (m,):
        raise ContactError(
            f"shapes do not fit: H {H.shape}, gap {gap.shape}, G {G.shape}, load {load.shape}",
            code="E-SHAPE",
            limit="(n, n), (n,), (n, m), (m,)",
        )
    for name, array in (("compliance H", H), ("gap", gap), ("arms G", G), ("load", load)):
        if not np.isfinite(array).all():
            bad = int(array.size - np.isfinite(array).sum())
            raise ContactError(f"{bad} of {array.size} values of the {name} are not finite", code="E-SHAPE")
    if n and (lack := np.abs(H - H.T).max()) > 1e-9 * np.abs(H).max():
        raise ContactError(
            f"the compliance is not symmetric: largest difference {lack:.3g} of {np.abs(H).max():.3g} m/N",
            code="E-CONTACT-COMPLIANCE",
            remedy="reciprocity is violated; check the loads and observations of the bodies",
        )
    if n:
        factor(H)
    return H, gap, G, load


def _scaled(H, gap, G, load) -> ComplementarityProblem:
    """The problem over its mean compliance and the largest arms of its motions."""
    compliance = float(np.trace(H)) / len(gap) if len(gap) else 1.0
    arm = np.abs(G).max(axis=0, initial=0.0)
    arm[arm == 0] = 1.0
    return ComplementarityProblem(H / compliance, gap / compliance, G / arm, load / arm, compliance, arm)


def _search(problem: ComplementarityProblem, start, max_steps) -> tuple[Step, int, str]:
    """Block steps from the start, then from all candidates, then single pivots, then daqp."""
    everything = np.ones(len(problem.gap), bool)
    starts = [everything]
    if start is not None:
        start = np.array(start, bool)
        if start.shape != everything.shape:
            raise ContactError(
                f"the start has shape {start.shape}, the problem {len(everything)} candidates",
                code="E-SHAPE",
            )
        starts = [start, everything] if start.any() else starts
    iterations = 0
    for first in starts:
        step, more = pivot(problem, first, max_steps=max_steps, single=False)
        iterations += more
        if not len(step.flips):
            return step, iterations, "active set"
    step, more = pivot(problem, step.active, max_steps=max_steps, single=True)
    iterations += more
    if not len(step.flips):
        return step, iterations, "active set, single pivots"
    step, more = _by_daqp(problem)
    return step, iterations + more, "daqp"


def _by_daqp(problem: ComplementarityProblem) -> tuple[Step, int]:
    """The general quadratic program gives the active set; the linear conditions then give the digits."""
    import daqp

    n, m = problem.G.shape
    unit = np.abs(problem.load).max() or np.abs(problem.gap).max()
    upper = np.concatenate([np.full(n, 1e30), problem.load / unit])
    lower = np.concatenate([np.zeros(n), problem.load / unit])
    sense = np.concatenate([np.zeros(n), np.full(m, 5)]).astype(np.int32)
    cost, arms = np.ascontiguousarray(problem.H), np.ascontiguousarray(problem.G.T)
    loads, _, flag, info = daqp.solve(
        cost, problem.gap / unit, arms, upper, lower, sense, primal_tol=1e-12, dual_tol=1e-12
    )
    # whatever daqp thinks of its digits, only an active set without violations is accepted
    if flag > 0:
        step, more = pivot(problem, loads > 1e-10 * np.abs(loads).max(), max_steps=50, single=True)
        if not len(step.flips):
            return step, int(info["iterations"]) + more
    raise ContactError(
        f"no method solves the contact of {n} candidates and {m} motions (daqp ends with flag {flag})",
        code="E-CONTACT",
        remedy="look for separations or compliances of very different size",
    )


def _without_idle(problem: ComplementarityProblem, step: Step) -> Step:
    """Release touching candidates whose load is rounding, so that only loaded ones count as active.

    A planet that carries nothing may touch on one side with a load of rounding size. Small loads that
    something really presses on would penetrate when released, and stay.
    """
    largest = np.abs(step.loads).max(initial=0.0)
    for share in (1e-9, 1e-10, 1e-11, 1e-12):
        idle = step.active & (step.loads <= share * largest)
        if idle.any():
            released = solve_step(problem, step.active & ~idle)
            if not len(released.flips):
                return released
    return step


def _state(problem: ComplementarityProblem, step: Step, iterations: int, method: str) -> ContactState:
    """Back to the caller's units, with exact complementarity."""
    loads = np.where(step.active & (step.loads > step.tolerance), step.loads, 0.0)
    active = loads > 0
    gaps = np.where(active, 0.0, np.maximum(step.gaps, 0.0)) * problem.compliance
    return ContactState(
        loads=loads,
        motions=step.motions * problem.compliance / problem.arm,
        gaps=gaps,
        active=active,
        iterations=iterations,
        residual=step.residual,
        method=method,
        open_motions=np.abs(step.null).max(axis=1, initial=0.0) > 1e-8,
    )
