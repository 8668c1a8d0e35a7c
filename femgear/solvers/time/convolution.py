"""Linear systems under given force histories: exact steps for forces that are linear between the instants.

N. C. Nigam and P. C. Jennings, Bull. Seism. Soc. Am. 59 (1969) 909-922; A. K. Chopra, Dynamics of Structures,
section 5.2. Their coefficients are taken from one matrix exponential (C. F. Van Loan, IEEE Trans. Autom.
Control 23 (1978) 395-404), which also covers rigid, critically and overdamped modes without cancellation.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError


def step_matrices(natural, damping_ratio, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Exact step of ``y'' + 2 zeta w y' + w^2 y = p`` with p linear in the step, state ``(y, v)``.

    Parameters
    ----------
    natural, damping_ratio : (m,) arrays
        ``w`` [rad/s], zero for rigid modes, and ``zeta``, above one too.
    step : float
        [s].

    Returns
    -------
    (m, 2, 2), (m, 2), (m, 2) arrays
        ``state_1 = P state_0 + start p_0 + end p_1``.
    """
    from scipy.linalg import expm

    natural = np.asarray(natural, float)
    turn, scale = natural * step, np.array([1.0, 1.0 / step])
    matrix = np.zeros((len(natural), 4, 4))
    matrix[:, 0, 1] = matrix[:, 1, 2] = matrix[:, 2, 3] = 1.0
    matrix[:, 1, 0], matrix[:, 1, 1] = -turn * turn, -2.0 * np.asarray(damping_ratio) * turn
    # in (y, h v, h^2 p, h^2 change of p) and the time t / h
    exact = expm(matrix)[:, :2]
    transition = scale[:, None] * exact[:, :, :2] / scale
    constant, ramp = exact[:, :, 2] * scale * step**2, exact[:, :, 3] * scale * step**2
    return transition, constant - ramp, ramp


def modal_history(natural, damping_ratio, step, force, *, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Motion of uncoupled modes under forces that are linear between equidistant instants, exact there.

    Parameters
    ----------
    natural, damping_ratio : (m,) arrays
        As for `step_matrices`.
    step : float
        Distance of the instants [s].
    force : (n_times, m) array
        Modal forces ``phi^T p`` of mass-normalised modes.
    start : pair of (m,) arrays, optional
        Modal displacement and velocity at the first instant; at rest when not given.

    Returns
    -------
    two (n_times, m) arrays
        Modal displacements and velocities.
    """
    force = np.asarray(force, float)
    transition, first, last = step_matrices(natural, damping_ratio, step)
    states = np.zeros((len(force), force.shape[1], 2))
    if start is not None:
        states[0] = np.stack(start, axis=1)
    push = force[:-1, :, None] * first + force[1:, :, None] * last
    _scan(transition, states, push)
    return states[..., 0], states[..., 1]


def _scan(transition, states, push) -> None:
    """``states[i + 1] = P states[i] + push[i]``, in blocks that advance side by side.

    Blocks of about sqrt(n) steps start from zero together; then the state at the start of every block is
    added with the powers of P. Twice sqrt(n) array operations replace n.
    """
    count = len(push)
    if not count:
        return
    length = int(np.ceil(np.sqrt(count)))
    blocks = -(-count // length)
    padded = np.zeros((blocks * length, *push.shape[1:]))
    padded[:count] = push
    padded = padded.reshape(blocks, length, *push.shape[1:])
    powers = np.empty((length, *transition.shape))
    power, state = transition, np.zeros((blocks, *push.shape[1:]))
    for j in range(length):
        powers[j] = power
        power = transition @ power
        state = np.einsum("mij,bmj->bmi", transition, state) + padded[:, j]
        padded[:, j] = state
    carry = states[0]
    for block in padded:
        block += np.einsum("kmij,mj->kmi", powers, carry)
        carry = block[-1].copy()
    states[1:] = padded.reshape(-1, *push.shape[1:])[:count]


def state_step(mass, damping, stiffness, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Exact step of ``M q'' + C q' + K q = p`` with p linear in the step, any C: state ``(q, h v)``.

    Returns
    -------
    (2n, 2n), (2n, n), (2n, n) arrays
        ``state_1 = P state_0 + start p_0 + end p_1``.
    """
    from scipy import linalg

    n = len(mass)
    solved = linalg.solve(mass, np.hstack([stiffness, damping, np.eye(n)]), assume_a="pos")
    matrix = np.zeros((4 * n, 4 * n))
    one = np.eye(n)
    matrix[:n, n : 2 * n], matrix[2 * n : 3 * n, 3 * n :] = one, one
    matrix[n : 2 * n, :n] = -step * step * solved[:, :n]
    matrix[n : 2 * n, n : 2 * n] = -step * solved[:, n : 2 * n]
    matrix[n : 2 * n, 2 * n : 3 * n] = step * step * solved[:, 2 * n :]
    exact = linalg.expm(matrix)[: 2 * n]
    constant, ramp = exact[:, 2 * n : 3 * n], exact[:, 3 * n :]
    return exact[:, : 2 * n], constant - ramp, ramp


def state_history(mass, damping, stiffness, step, force, *, start=None) -> tuple[np.ndarray, np.ndarray]:
    """Motion (n_times, n) and velocity of a system with any damping; arguments as for `modal_history`."""
    force = np.asarray(force, float)
    transition, first, last = state_step(mass, damping, stiffness, step)
    n = len(mass)
    states = np.zeros((len(force), 2 * n))
    if start is not None:
        states[0] = np.concatenate([start[0], step * np.asarray(start[1], float)])
    push = force[:-1] @ first.T + force[1:] @ last.T
    for i, row in enumerate(push):
        states[i + 1] = transition @ states[i] + row
    return states[:, :n], states[:, n:] / step


def equidistant(times) -> float:
    """Distance of ascending instants that must be equidistant [s]."""
    times = np.asarray(times, float)
    distance = np.diff(times)
    if times.ndim != 1 or len(times) < 2 or not np.all(np.isfinite(times)) or np.any(distance <= 0.0):
        raise CaseError("two ascending instants or more are needed", code="E-TIMES", key="times")
    step = (times[-1] - times[0]) / (len(times) - 1)
    error = np.abs(distance - step).max()
    if error > 1e-6 * step:
        raise CaseError(
            f"instants {error:.3g} s off an equidistant grid of {step:.6g} s", code="E-TIMES", key="times",
            limit="equidistant instants", remedy="interpolate the forces on a grid first",
        )  # fmt: skip
    return float(step)
