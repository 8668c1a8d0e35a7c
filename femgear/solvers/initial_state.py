"""Where a motion starts, checked, and the size of the motion that follows."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.adaptive import Flow, typical_deflection
from femgear.solvers.nonlinear import NonlinearSystem


def checked_start(problem: NonlinearSystem, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity (n,) of a start; rest without deflection when none is given.

    Raises
    ------
    CaseError
        Not a pair of n finite numbers each (E-START).
    """
    n = len(problem.system.M)
    if start is None:
        return np.zeros(n), np.zeros(n)
    found = "no pair of lists of numbers"
    try:
        q, v = (np.array(part, float) for part in start)
    except (TypeError, ValueError):
        pass
    else:
        if q.shape == v.shape == (n,) and np.all(np.isfinite([q, v])):
            return q, v
        found = f"shapes {q.shape} and {v.shape}"
        found += ", not all finite" if not (np.all(np.isfinite(q)) and np.all(np.isfinite(v))) else ""
    raise CaseError(
        f"a start of {found} for {n} degrees of freedom", code="E-START", key="start",
        limit=f"finite displacements [m] and velocities [m/s], each of shape ({n},)",
        remedy="give start=(displacement, velocity), one number a degree of freedom in each",
    )  # fmt: skip


def motion_scale(motion: Flow, start) -> float | None:
    """Size of the motion [m] to which an integration tolerance refers; None leaves it to the integrator.

    `adaptive.typical_deflection` solves with the stiffness at rest plus inertia, which is singular at an
    unstable rest such as the top between two wells. Inertia alone holds the loads then.
    """
    q, v = start
    try:
        return typical_deflection(motion.problem, q, v, motion.rate) or None
    except np.linalg.LinAlgError:
        loads = np.abs(motion.loads).max() / motion.rate
        return float(max(np.abs(q).max(), np.abs(v).max() / motion.rate, loads)) or None
