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

from femgear.contact.active_set import Problem, Step, factor, forward, pivot, solve_step
from femgear.errors import ContactError


@dataclass(frozen=True)
class ContactState:
    """Solution of the contact problem at one position.

    Parameters
    ----------
    loads : (n,) array
        Contact loads ``p``, never negative, exactly zero where not `active`.
    motions : (m,) array
        Motions ``q``.
    gaps : (n,) array
        Remaining separations ``w``, never negative, exactly zero where `active`.
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

    Raises
    ------
    ContactError
        E-SHAPE for wrong shapes or values that are not finite, E-CONTACT-COMPLIANCE for a matrix
        that is not symmetric positive definite, E-CONTACT-OPEN when no contact can balance the
        load, E-CONTACT when no method solves the problem.
    """
    problem = _scaled(*_checked(H, gap, G, load))
    n = len(problem.gap)
    if not problem.load.any():
        step = solve_step(problem, np.zeros(n, bool))
        if not len(step.flips):
            return _state(problem, step, 1, "no load")
    step, iterations, method = _search(problem, start, max_steps)
    return _state(problem, _without_idle(problem, step), iterations, method)


def tangent_stiffness(H, state: ContactState, mesh, window, cell, n_meshes) -> np.ndarray:
    """Tangent stiffness of every mesh at constant loads of the other meshes.

    ``K_A = 1^T (H_jj,AA)^-1 1`` over the loaded candidates A of mesh j, which all approach by the same small
    amount. The load over approach of cells is piecewise linear: ``K_A`` jumps by about a per cent whenever a
    cell is added at an end of a contact. Between the load at which the last cell ``a`` of an end began to
    carry and that at which the next one, ``b``, will, the slope goes from the mean of ``K_A-a`` and ``K_A``
    to the mean of ``K_A`` and ``K_A+b``, in proportion to how far the load has come. The first cell of a
    tooth pair comes all at once.

    Parameters
    ----------
    H, state : (n, n) array, ContactState
        Compliance between the candidates [m/N], and their solution.
    mesh, window, cell : (n,) integer arrays
        Mesh, 0 to ``n_meshes - 1``, of every candidate, number of its contact window and place in it, both
        ascending.

    Returns
    -------
    (n_meshes,) array
        [N/m]; zero where no candidate of the mesh carries load.

    Raises
    ------
    ContactError
        E-CONTACT-COMPLIANCE when the compliance of the touching candidates is not positive definite.
    """
    H, mesh, window, cell = (np.asarray(a) for a in (H, mesh, window, cell))
    stiffness = np.zeros(n_meshes)
    for j in range(n_meshes):
        index = np.flatnonzero(state.active & (mesh == j))
        if len(index):
            stiffness[j] = _smooth_tangent(H, state, index, _ends_of_contacts(state, index, window, cell))
    return stiffness


def mesh_tangent_matrix(H, active, mesh_of_candidate, n_meshes) -> np.ndarray:
    """Tangent stiffness of all meshes together, with the coupling through their common bodies.

    ``g^T (H_AA)^-1 g`` with one indicator column of ``g`` a mesh: the increments of the mesh forces per
    unit approach of each mesh while the others hold theirs.

    Arguments and errors are those of `tangent_stiffness`. The (n_meshes, n_meshes) array [N/m] is symmetric;
    rows and columns of meshes without load are zero.
    """
    index = np.flatnonzero(active)
    if not len(index):
        return np.zeros((n_meshes, n_meshes))
    columns = (np.asarray(mesh_of_candidate)[index, None] == np.arange(n_meshes)).astype(float)
    half = forward(factor(np.asarray(H, float)[np.ix_(index, index)]), columns)
    return half.T @ half


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


def _scaled(H, gap, G, load) -> Problem:
    """The problem over its mean compliance and the largest arms of its motions."""
    compliance = float(np.trace(H)) / len(gap) if len(gap) else 1.0
    arm = np.abs(G).max(axis=0, initial=0.0)
    arm[arm == 0] = 1.0
    return Problem(H / compliance, gap / compliance, G / arm, load / arm, compliance, arm)


def _search(problem: Problem, start, max_steps) -> tuple[Step, int, str]:
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


def _by_daqp(problem: Problem) -> tuple[Step, int]:
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


def _without_idle(problem: Problem, step: Step) -> Step:
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


def _state(problem: Problem, step: Step, iterations: int, method: str) -> ContactState:
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


def _ends_of_contacts(state: ContactState, index, window, cell) -> np.ndarray:
    """Places in `index` of the last loaded cells of every end, and the open candidates next to them.

    A row of the second kind is -1 where the window or the flank ends, shape (2, ends).
    """
    edge = np.flatnonzero(np.diff(window[index]))
    first, last = np.append(0, edge + 1), np.append(edge, len(index) - 1)
    loaded = np.concatenate([first, last])
    beside = index[loaded] + np.repeat([-1, 1], len(first))
    inside = (beside >= 0) & (beside < len(cell))
    beside = np.where(inside, beside, index[loaded])
    same = window[beside] == window[index[loaded]]
    next_cell = np.abs(cell[beside] - cell[index[loaded]]) == 1
    return np.stack([loaded, np.where(same & next_cell & ~state.active[beside], beside, -1)])


def _smooth_tangent(H, state: ContactState, index, ends) -> float:
    """Slope of the load over the common approach of the candidates `index` [N/m]."""
    first, last = np.split(ends[0], 2)
    alone = np.tile(first == last, 2)[ends[1] >= 0]
    loaded, beside = ends[:, ends[1] >= 0]
    lower = factor(H[np.ix_(index, index)])
    columns = np.zeros((len(index), 1 + 2 * len(loaded)))
    columns[:, 0] = 1.0
    columns[loaded, 1 + np.arange(len(loaded))] = 1.0
    columns[:, 1 + len(loaded) :] = H[np.ix_(index, beside)]
    half = forward(lower, columns)
    one, unit, reach = half[:, 0], half[:, 1 : 1 + len(loaded)], half[:, 1 + len(loaded) :]
    rate, closing = one @ unit, 1.0 - one @ reach
    # what the slope loses without the last cell, and gains with the next one
    lost = np.where(alone, 0.0, rate**2 / (unit**2).sum(axis=0))
    gained = closing**2 / (H[beside, beside] - (reach**2).sum(axis=0))
    come, left = state.loads[index[loaded]] * closing, state.gaps[beside] * rate
    usable = (closing > 0) & (rate > 0) & (come + left > 0)
    share = np.divide(come, come + left, out=np.full(len(come), 0.5), where=usable)
    change = 0.5 * (share * gained - (1.0 - share) * lost)
    return float(one @ one + change[usable].sum())
