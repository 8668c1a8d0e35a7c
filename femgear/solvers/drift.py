"""Constant loads that nothing takes up: the free motion that they drive away."""

from __future__ import annotations

import numpy as np

from femgear.solvers.nonlinear import NonlinearSystem

# Inertia that holds free motions, over the mean stiffness, and the share of the load that counts as balanced.
_HELD, _BALANCED = 1e-12, 1e-6


def drift_note(problem: NonlinearSystem) -> str:
    """What to know of a constant load out of balance; empty where supports and elements take it up.

    Free motions are held by ``e M``: of ``(K' + e M) u = load`` the part ``e M u`` tends to the load on the
    free motions as e falls. Every column counts as held, by contact if need be.
    """
    system, load = problem.system, problem.system.load
    root = np.sqrt(np.abs(np.diag(system.M)))
    if not np.any(load) or not np.all(root > 0.0):
        return ""
    stiffness = (system.K / root).T / root
    columns = system.W / root[:, None]
    hold = np.abs(problem.reference)
    hold = np.where(hold > 0.0, hold, hold.max(initial=0.0) or 1.0)
    stiffness = stiffness + (columns * hold) @ columns.T
    inertia, force = (system.M / root).T / root, load / root
    size = np.trace(np.abs(stiffness)) / len(load) or 1.0
    held = []
    for share in (_HELD, 10.0 * _HELD):
        weight = share * size * inertia
        held.append(weight @ np.linalg.solve(stiffness + weight, force))
    free = (10.0 * held[0] - held[1]) / 9.0
    share = float(np.linalg.norm(free) / np.linalg.norm(force))
    if not share > _BALANCED:
        return ""
    dof = int(np.argmax(np.abs(np.linalg.solve(inertia, free))))
    name = system.dofs[dof] if system.dofs else f"degree of freedom {dof}"
    return (
        f"; the mean drifts: nothing takes up {share:.2g} of the constant load (it drives {name} away), "
        "balance it or add a support"
    )
