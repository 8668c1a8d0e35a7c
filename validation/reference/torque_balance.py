"""Contact loads that balance a force, by a library's quadratic program and the linear conditions it finds."""

from __future__ import annotations

import numpy as np

from femgear.errors import ContactError

LARGEST_RESIDUAL = 1e-9


def balanced_loads(H, gap, arm, force: float) -> tuple[np.ndarray, float, float]:
    """``gap + H p - arm q >= 0, p >= 0``, complementary, ``arm^T p = force``.

    daqp (D. Arnström, A. Bemporad, D. Axehill, IEEE Trans. Autom. Control 67, 2022) finds which contacts
    carry, a linear solution gives the digits.

    Parameters
    ----------
    H : (n, n) array
        Compliance [m/N].
    gap, arm : (n,) arrays
        Separations [m] and approach per unit motion.
    force : float
        [N]

    Returns
    -------
    loads : (n,) array
        [N]
    motion : float
        [m]
    residual : float
        Largest violation relative to the largest load or displacement.

    Raises
    ------
    ContactError
        When the program is not solved or its active set does not satisfy the conditions.
    """
    import daqp

    n = len(gap)
    size = np.trace(H) / n
    upper, lower = np.append(np.full(n, 1e30), 1.0), np.append(np.zeros(n), 1.0)
    sense = np.append(np.zeros(n), 5).astype(np.int32)
    cost, row = np.ascontiguousarray(H / size), np.ascontiguousarray(arm[None])
    guess, _, flag, _ = daqp.solve(
        cost, gap / (size * force), row, upper, lower, sense, primal_tol=1e-11, dual_tol=1e-11
    )
    active = guess > 1e-9 * np.abs(guess).max()
    for _ in range(20):
        loads, motion = _linear(H, gap, arm, force, active)
        rest = gap + H @ loads - arm * motion
        scale = np.abs(H @ loads).max()
        wrong = np.where(active, loads < 0, rest < -LARGEST_RESIDUAL * scale)
        if not wrong.any():
            residual = max(np.abs(rest[active]).max() / scale, -rest.min() / scale, abs(arm @ loads / force - 1))
            return loads, motion, float(residual)
        active = active ^ wrong
    raise ContactError(f"the contact loads do not settle (daqp ends with flag {flag})", code="E-CONTACT")


def _linear(H, gap, arm, force, active):
    """Loads (n,) and motion with the active contacts closed."""
    H, arm_on = H[np.ix_(active, active)], arm[active]
    solved = np.linalg.solve(H, np.column_stack([arm_on, gap[active]]))
    motion = (force + arm_on @ solved[:, 1]) / (arm_on @ solved[:, 0])
    loads = np.zeros(len(gap))
    loads[active] = solved[:, 0] * motion - solved[:, 1]
    return loads, float(motion)
