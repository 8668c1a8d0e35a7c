"""Stability of a set in a housing that stands still: Floquet multipliers over a turn of the carrier.

The equations of `femgear.housing.two_way.response` in time, with the modal coordinates p of the gears and q of the
structure: everything repeats after a turn, or after several where errors turn with gears. Between the kicks
of meshes and damping the modes move exactly; kicks and motion alternate symmetrically (G. Strang, SIAM J.
Numer. Anal. 5, 1968, 506-517), so that errors have even powers of the step alone, which halved steps take
away one by one (W. Romberg, 1955).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femgear.errors import ConvergenceError
from femgear.housing.sensor import carrier_turns
from femgear.housing.two_way.response import MeshPaths
from femgear.housing.two_way.structure import FixedStructure, ring_waves
from femgear.solvers.stability.parametric import Stability
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_STEP_ANGLE, _STEPS_PER_HARMONIC, _HALVED = 2.0, 4, 5
"""Angle [rad] that the fastest mode turns in a first step at most, first steps in a period of the highest
harmonic, and how often steps are halved at most."""
_FAR = 10.0
"""Times the largest multiplier of halved steps, beyond which that of the steps before is no approximation."""
_TOGETHER = 256
"""Steps whose matrices are in memory at a time."""


def turn_stability(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    carrier_speed,
    *,
    harmonics: int = 6,
    damping=None,
    frequency_ratio: float = 2.0,
    tolerance: float = 1e-3,
) -> Stability:
    """Judge small motions of the set at some speeds of the carrier (n_speeds,) [rad/s], by their multipliers.

    ConvergenceError: steps that were halved so often that they do not get finer (E-CONVERGENCE).

    Parameters
    ----------
    gears, excitation, structure, paths, damping
        As for `femgear.housing.two_way.response.solve_two_way`.
    harmonics : int
        Mesh harmonics of the stiffness.
    frequency_ratio : float
        Modes above this many times the highest excitation frequency are static flexibility, as in
        `femgear.solvers.stability.parametric.stability`; they count by ``exp(-zeta omega T)``.
    tolerance : float
        Error of the largest modulus, over itself where it is above 0.01.

    Returns
    -------
    Stability
        Its multipliers and the finest steps are those of the turns of the carrier after which all repeats.
    """
    speeds, turns = (
        np.atleast_1d(np.asarray(carrier_speed, float)),
        carrier_turns(paths.z_ring, excitation.periods),
    )
    largest, kept, taken = np.empty(len(speeds), complex), *np.empty((2, len(speeds)), int)
    for i, speed in enumerate(speeds):
        reach = harmonics * frequency_ratio
        turn = _Turn(gears, structure, paths, excitation, damping, speed, harmonics, reach)
        fastest = 2 * np.pi * turn.natural.max(initial=0.0) / abs(speed)
        least = max(fastest / _STEP_ANGLE, _STEPS_PER_HARMONIC * harmonics * paths.z_ring)
        matrix, taken[i] = _extrapolated(turn, int(np.ceil(least * turns)), tolerance)
        values, kept[i] = np.append(np.linalg.eigvals(matrix), turn.static), len(turn.natural)
        largest[i] = values[np.abs(values).argmax()]
    return Stability(np.abs(speeds) * paths.z_ring / (2 * np.pi), largest, kept, taken)


def _extrapolated(turn: _Turn, steps: int, tolerance: float) -> tuple[np.ndarray, int]:
    """Transition matrix over a turn whose largest multiplier has an error, and the steps that it takes."""
    row, change = [turn.monodromy(steps)], np.inf
    for _ in range(_HALVED):
        before, steps = row, 2 * steps
        row = [turn.monodromy(steps)]
        if not _largest(before[0]) < _FAR * max(_largest(row[0]), 1.0):
            continue  # kicks so far apart that the scheme itself grows tell nothing
        for k, coarse in enumerate(before):
            row.append(row[k] + (row[k] - coarse) / (4.0 ** (k + 1) - 1.0))
        best, other = _largest(row[-1]), _largest(row[-2])
        change = abs(best - other) / max(best, 0.01)
        if change <= tolerance:
            return row[-1], steps
    raise ConvergenceError(
        f"the multipliers of a turn in {steps} steps change by {change:.1e}",
        code="E-CONVERGENCE",
        limit=f"{tolerance:g}",
        remedy="take a looser tolerance or fewer harmonics",
    )


def _largest(matrix: np.ndarray) -> float:
    """Modulus of the largest eigenvalue, infinite where the numbers have overflowed."""
    if not np.isfinite(matrix).all():
        return np.inf
    return float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))


class _Turn:
    """Equations of one speed of the carrier [rad/s], the modes up to so many mesh frequencies in time."""

    def __init__(self, gears, structure, paths: MeshPaths, excitation, damping, speed: float, harmonics: int, reach):
        sense, speed, teeth = int(np.sign(speed)), abs(speed), paths.z_ring / excitation.periods
        self.angle = 2 * np.pi * carrier_turns(paths.z_ring, excitation.periods)
        cut = reach * paths.z_ring * speed
        frequencies = 2 * np.pi * gears.frequency, structure.natural_frequency
        ratios = gears.damping_ratio, structure.damping_ratio
        moving = [(frequency > 0.0) & (frequency <= cut) for frequency in frequencies]
        left = [frequency > cut for frequency in frequencies]
        self.natural, self.ratio = (
            np.concatenate([values[followed] for values, followed in zip(both, moving)])
            for both in (frequencies, ratios)
        )
        slowest = min([(z[o] * w[o]).min() for z, w, o in zip(ratios, frequencies, left) if o.any()] or [np.inf])
        self.speed = speed
        self.static = np.exp(-slowest * self.angle / speed)
        self.place, self.sense = np.array(paths.planet_angles) + paths.load_angle, sense
        self.n = np.arange(-structure.max_diameter, structure.max_diameter + 1)
        self.stiffness, self.mean = mesh_harmonics(excitation, harmonics)[0], gears.mesh_stiffness
        self.base = teeth
        rows, P, (static_modes, others) = gears.mesh_deflection, structure.ring_shape, left
        self.rows, self.path = rows[:, moving[0]], P[moving[1]]
        self.flexibility = (
            gears.residual + (rows[:, static_modes] / frequencies[0][static_modes] ** 2) @ rows[:, static_modes].T
        )
        self.residual = structure.residual + (P[others] / frequencies[1][others, None] ** 2).T @ P[others].conj()
        # damping matrix of the modes over the angle: real lines, twice the reach of the waves high
        self.drag: Any = None
        if damping is not None:
            order, dofs, G = structure.wave_order, len(gears.shape), self.rows.shape[1]
            to = np.zeros((dofs + len(order),) * 2, complex)
            to[:dofs, :dofs], to[dofs:, dofs:] = np.eye(dofs), ring_waves(order)
            whole, count = to @ damping @ to.conj().T, 2 * int(np.ptp(np.append(order, 0))) + 1
            motion = np.zeros((count, len(whole), len(self.natural)), complex)
            motion[:, :dofs, :G] = gears.shape[:, moving[0]]
            turned = np.exp(2j * np.pi * sense * np.outer(np.arange(count), order) / count)
            motion[:, dofs:, G:] = turned[..., None] * structure.wave_shape[moving[1]].T
            drag = np.real(motion.conj().swapaxes(1, 2) @ (whole @ motion))
            self.drag = np.fft.rfft(drag, axis=0, norm="forward")
            self.drag[1:] *= 2.0

    def monodromy(self, steps: int) -> np.ndarray:
        """Transition matrix (2 m, 2 m) until all repeats, of displacements and velocities over frequencies."""
        m, dt = len(self.natural), self.angle / (self.speed * steps)
        move, half, back = (self._free(part * dt) for part in (1.0, 0.5, -0.5))
        state = _moved(np.eye(2 * m), *half)
        for first in range(0, steps, _TOGETHER):
            theta = self.angle * (np.arange(first, min(first + _TOGETHER, steps)) + 0.5) / steps
            with np.errstate(over="ignore", invalid="ignore"):
                for kick, brake in zip(*self._kicks(theta, dt)):
                    state[m:] = brake @ state[m:] + kick @ state[:m]
                    state = _moved(state, *move)
            if not np.isfinite(state).all():
                return state
        return _moved(state, *back)

    def _free(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Free motion ``q'' + 2 zeta w q' + w^2 q = 0`` of all modes, velocities as ``q'/w``."""
        w, z = self.natural, self.ratio
        damped = np.sqrt(1.0 - z**2)
        c, s, decay = np.cos(damped * w * dt), np.sin(damped * w * dt) / damped, np.exp(-z * w * dt)
        same = np.concatenate([decay * (c + z * s), decay * (c - z * s)])
        return same[:, None], np.concatenate([decay * s, -decay * s])[:, None]

    def _kicks(self, theta: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity over frequency after a step by displacement and by velocity before, (n, m, m) each."""
        k = np.real(np.exp(1j * self.base * np.outer(theta, np.arange(self.stiffness.shape[1]))) @ self.stiffness.T)
        wave = np.exp(1j * self.n * (self.place + self.sense * theta[:, None])[..., None])
        path = np.real(wave @ self.path.T)
        soft = np.real(wave @ self.residual @ wave.conj().swapaxes(1, 2))
        (count, N), G, T = path.shape[:2], self.rows.shape[1], self.flexibility
        # excess forces e on the gears and forces f on the ring by deflections of the modes that move
        left, right = np.zeros((2, count, 3 * N, 3 * N))
        change, ring = (k - self.mean)[..., None], np.arange(N)
        left[:, : 2 * N, : 2 * N] = np.eye(2 * N) + change * T
        left[:, N : 2 * N, 2 * N :] = k[:, N:, None] * soft
        left[:, 2 * N :, : 2 * N] = self.mean[N:, None] * T[N:] - np.eye(2 * N)[N:]
        left[:, 2 * N + ring, 2 * N + ring] = 1.0
        right[:, : 2 * N, : 2 * N] = change * np.eye(2 * N)
        right[:, N + ring, 2 * N + ring] = -k[:, N:]
        right[:, 2 * N + ring, N + ring] = self.mean[N:]
        law = np.linalg.solve(left, right)
        shape = np.zeros((count, 3 * N, len(self.natural)))
        shape[:, : 2 * N, :G], shape[:, 2 * N :, G:] = self.rows, path
        force = shape.swapaxes(1, 2) @ (np.repeat([-1.0, 1.0], [2 * N, N])[:, None] * law) @ shape
        scaled, eye = force * dt / self.natural[:, None], np.eye(len(self.natural))
        if self.drag is None:
            return scaled, np.broadcast_to(eye, scaled.shape)
        turned = np.exp(1j * np.outer(theta, np.arange(len(self.drag))))
        drag = np.real(np.tensordot(turned, self.drag, 1))
        drag = 0.5 * dt * (drag - np.diag(2.0 * self.ratio * self.natural))
        drag *= self.natural / self.natural[:, None]
        both = np.linalg.solve(eye + drag, np.concatenate([scaled, eye - drag], axis=-1))
        return both[..., : len(eye)], both[..., len(eye) :]


def _moved(state: np.ndarray, same: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Displacements and velocities over frequencies (2 m, n) after a free motion."""
    return same * state + other * np.roll(state, len(state) // 2, axis=0)
