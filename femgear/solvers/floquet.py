"""Stability of the periodically varying gear meshes: Floquet multipliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.harmonics import mesh_harmonics, sample
from femgear.system import MeshExcitation, Modes

# Multipliers beyond the unit circle by less than this are taken as on it (undamped systems).
_CIRCLE = 1e-6
# Angle [rad] that the fastest mode turns in one step, and steps in a period of the highest harmonic.
_STEP_ANGLE = 1.0
_STEPS_PER_HARMONIC = 8
# Modes that exchange less than this share of their stiffness move independently.
_UNCOUPLED = 1e-9
# Speeds treated together.
_BATCH = 64


@dataclass(frozen=True)
class Stability:
    """Floquet verdict beside a periodic response; it does not depend on the load, only on k(t).

    Parameters
    ----------
    mesh_frequency : (n_speeds,) array
        [Hz].
    multiplier : (n_speeds,) complex array
        Multiplier of largest modulus over one period of the excitation record, rigid modes left out.
    modes_kept : (n_speeds,) int array
        Modes that were followed in time; the others counted as static flexibility.
    steps : (n_speeds,) int array
        Time steps a period.
    """

    mesh_frequency: np.ndarray
    multiplier: np.ndarray
    modes_kept: np.ndarray
    steps: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """(n_speeds,) bool: no perturbation grows (largest modulus at most 1 within 1e-6)."""
        return np.abs(self.multiplier) <= 1.0 + _CIRCLE


def floquet_multipliers(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int = 6,
    steps: int | None = None,
    frequency_ratio: float = 2.0,
) -> np.ndarray:
    """Largest modulus (n_speeds,) of the Floquet multipliers; see :func:`stability`."""
    verdict = stability(
        modes,
        excitation,
        mesh_frequency,
        excitation_harmonics=excitation_harmonics,
        steps=steps,
        frequency_ratio=frequency_ratio,
    )
    return np.abs(verdict.multiplier)


def stability(
    modes: Modes,
    excitation: MeshExcitation,
    mesh_frequency,
    *,
    excitation_harmonics: int = 6,
    steps: int | None = None,
    frequency_ratio: float = 2.0,
) -> Stability:
    """Floquet multipliers of the linear system with the truncated mesh stiffnesses.

    Parameters
    ----------
    modes, excitation
        As given to ``solve_spectral``.
    mesh_frequency : float or (n_speeds,) array
        [Hz], positive.
    excitation_harmonics : int
        Mesh harmonics of the stiffness that are kept.
    steps : int, optional
        Time steps a period. By default 8 in a period of the highest harmonic and one for every radian of
        the fastest mode that is followed.
    frequency_ratio : float
        Modes above this many times the highest excitation frequency are counted as static flexibility:
        parametric resonances need ``h f = f_i + f_j``, their first order a ratio of one, their second order
        two. Their own multipliers ``exp(-zeta omega T)`` still count. The static flexibility costs up to
        1e-3 of a modulus below one and less of a growing one; a ratio of 5 or 20 follows nearly every mode.

    Returns
    -------
    Stability

    Raises
    ------
    CaseError
        Frequencies that are not positive, data that cannot be used, too few steps.
    ConvergenceError
        A mesh stiffness so negative that the static flexibility cannot carry it.

    Notes
    -----
    ``q'' + 2 zeta w q' + w^2 q + R^T kappa(t) R q = 0`` with ``kappa = k~ (I + T_res k~)^-1``. Between
    the kicks that the meshes give, a matrix of rank n_meshes, the damped modes move exactly: algorithm 4A of
    Chin (Phys. Lett. A 226, 1997), fourth order with positive steps; its corrected kick
    ``kappa - dt^2/24 kappa R R^T kappa`` holds with damping too, because ``[B, [A, B]]`` does not contain the
    damping. Modes that no stiffness couples are separate eigenvalue problems.
    """
    frequency = np.atleast_1d(np.array(mesh_frequency, dtype=float))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)) or np.any(frequency <= 0.0):
        raise CaseError(
            "a period needs finite, positive mesh frequencies", code="E-FREQUENCY", key="mesh_frequency",
            value=frequency.tolist(), limit="> 0 Hz",
        )  # fmt: skip
    if not frequency_ratio >= 1.0:
        raise CaseError(
            "modes up to the highest excitation frequency must be followed", code="E-MODES",
            key="frequency_ratio", value=frequency_ratio, limit=">= 1",
        )  # fmt: skip
    stiffness = mesh_harmonics(excitation, excitation_harmonics)[0]
    stiffness[:, 0] -= modes.mesh_stiffness
    lines = excitation_harmonics * excitation.periods
    cut = frequency * excitation_harmonics * frequency_ratio
    kept = np.searchsorted(modes.frequency, cut, side="right")
    multiplier = np.empty(len(frequency), dtype=complex)
    taken = np.empty(len(frequency), dtype=int)
    for number in np.unique(kept):
        chosen = np.flatnonzero(kept == number)
        for part in np.array_split(chosen, -(-len(chosen) // _BATCH)):
            period = excitation.periods / frequency[part]
            fastest = 2.0 * np.pi * modes.frequency[:number].max(initial=0.0) * period.max()
            taken[part] = steps or int(np.ceil(max(fastest / _STEP_ANGLE, _STEPS_PER_HARMONIC * lines)))
            multiplier[part] = _largest(modes, stiffness, number, period, int(taken[part[0]]))
    moving = kept - np.searchsorted(modes.frequency, 0.0, side="right")
    return Stability(frequency, multiplier, np.maximum(moving, 0), taken)


def decisive_harmonics(modes: Modes, excitation: MeshExcitation, kept: int, *, least: int = 6) -> int:
    """Highest mesh harmonic of the stiffness that could by itself make the response unstable.

    ``q'' + 2 zeta w q' + w^2 (1 + eps cos 2 w t) q = 0`` is stable below ``eps = 4 zeta`` (Nayfeh and Mook,
    Nonlinear Oscillations, 1979, section 5.3), and a mode whose strain is all in the mesh has
    ``eps = |k_h|/k_0``; half of that is taken.

    Parameters
    ----------
    modes, excitation
        As given to `stability`.
    kept : int
        Mesh harmonics of the response.
    least : int
        Smallest number, as far as there are so many.

    Returns
    -------
    int
        At most 64: the amplitudes fall as one over the harmonic.
    """
    most = min(kept, 64)
    stiffness = np.abs(mesh_harmonics(excitation, most)[0])
    damped = modes.damping_ratio[modes.frequency > 0.0].min(initial=1.0)
    large = np.flatnonzero((stiffness[:, 1:] > 2.0 * damped * stiffness[:, :1]).any(axis=0))
    # lines of a record of several periods
    highest = 0 if not len(large) else -(-(int(large[-1]) + 1) // excitation.periods)
    return min(most, max(least, highest))


def monodromy(matrices, durations) -> np.ndarray:
    """Transition matrix over one period of ``x' = A x`` with A constant in pieces, by matrix exponentials.

    Parameters
    ----------
    matrices : (n_pieces, n, n) array
        ``A`` in order of time.
    durations : (n_pieces,) array
        [s], positive.

    Returns
    -------
    (n, n) array
        ``expm(A_last dt_last) ... expm(A_0 dt_0)``; its eigenvalues are the Floquet multipliers.
    """
    from scipy.linalg import expm

    matrices, durations = np.asarray(matrices, dtype=float), np.asarray(durations, dtype=float)
    if matrices.ndim != 3 or durations.shape != matrices.shape[:1] or np.any(durations <= 0.0):
        raise CaseError("every matrix needs one positive duration", code="E-SHAPE", key="durations")
    out = np.eye(matrices.shape[-1])
    for step in expm(matrices * durations[:, None, None]):
        out = step @ out
    return out


def _largest(modes: Modes, stiffness, number: int, period: np.ndarray, steps: int) -> np.ndarray:
    """Multiplier of largest modulus for speeds that follow the first `number` modes."""
    natural = 2.0 * np.pi * modes.frequency
    static = natural > 0.0
    static[:number] = False
    rows = modes.mesh_deflection
    flexibility = modes.residual + (rows[:, static] / natural[static] ** 2) @ rows[:, static].T
    kicks = _kicks(stiffness, flexibility, steps)
    moving = np.flatnonzero(natural[:number] > 0.0)
    best = np.zeros(len(period), dtype=complex)
    for group in _coupled(rows[:, moving] / natural[moving], kicks):
        index = moving[group]
        found = _multipliers(natural[index], modes.damping_ratio[index], rows[:, index], kicks, period)
        best = np.where(np.abs(found) > np.abs(best), found, best)
    if np.any(static):
        slowest = np.exp(-np.min(modes.damping_ratio[static] * natural[static]) * period)
        best = np.where(slowest > np.abs(best), slowest, best)
    return best


def _kicks(stiffness: np.ndarray, flexibility: np.ndarray, steps: int) -> np.ndarray:
    """``kappa = k~ (I + T_res k~)^-1`` (2 steps, n, n) at the ends and middles of the steps [N/m]."""
    lines = stiffness.shape[-1] - 1
    if steps <= lines:
        raise CaseError(
            f"{steps} steps cannot follow {lines} harmonics", code="E-HARMONICS", key="steps",
            value=steps, limit=f">= {lines + 1}", remedy="take more steps",
        )  # fmt: skip
    change = sample(stiffness, 2 * steps).T
    carried = np.eye(len(stiffness)) + flexibility * change[:, None, :]
    if np.linalg.eigvals(carried).real.min() <= 0.0:
        raise ConvergenceError(
            "the modes left out are more flexible than the meshes themselves at their lowest stiffness",
            code="E-RESIDUAL", remedy="keep more modes",
        )  # fmt: skip
    return change[:, :, None] * np.linalg.inv(carried)


def _coupled(rows: np.ndarray, kicks: np.ndarray) -> list[np.ndarray]:
    """Groups of modes that the kicks couple, from the rows (n_meshes, m) divided by the frequencies."""
    from scipy.sparse.csgraph import connected_components

    if not rows.shape[1]:
        return []
    strength = np.abs(rows.T @ kicks @ rows).max(axis=0)
    number, label = connected_components(strength > _UNCOUPLED, directed=False)
    return [np.flatnonzero(label == g) for g in range(number)]


def _multipliers(natural, damping_ratio, rows, kicks, period) -> np.ndarray:
    """Largest multiplier (n_speeds,) of one group of modes, followed through one period."""
    speeds, m, steps = len(period), len(natural), len(kicks) // 2
    dt = (period / steps)[:, None, None]
    stay, turn, back, keep = _half_step(natural, damping_ratio, 0.5 * dt)
    gyration = rows @ rows.T
    velocity_rows = (rows / natural).T
    q = np.zeros((speeds, m, 2 * m))
    q[:, range(m), range(m)] = 1.0
    u = np.roll(q, m, axis=-1)
    for step in range(steps):
        first, middle = kicks[2 * step], kicks[2 * step + 1]
        corrected = middle - dt**2 / 24.0 * (middle @ gyration @ middle)
        for kick in (first * (dt / 3.0), corrected * (2.0 * dt / 3.0)):
            u -= velocity_rows @ (kick @ (rows @ q))
            q, u = stay * q + turn * u, back * q + keep * u
    values = np.linalg.eigvals(np.concatenate([q, u], axis=1))
    return values[np.arange(speeds), np.abs(values).argmax(axis=1)]


def _half_step(natural, damping_ratio, duration):
    """Exact motion of damped modes, ``u = q' / w``: ``q <- stay q + turn u``, ``u <- back q + keep u``."""
    w, zeta = natural[:, None], damping_ratio[:, None]
    angle = np.sqrt((1.0 - zeta**2).astype(complex)) * w * duration
    sine = (np.sinc(angle / np.pi) * (w * duration)).real
    cosine, decay = np.cos(angle).real, np.exp(-zeta * w * duration)
    return decay * (cosine + zeta * sine), decay * sine, -decay * sine, decay * (cosine - zeta * sine)
