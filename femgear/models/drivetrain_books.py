"""Energy, momentum and drift of a drivetrain that is stepped through time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import ConvergenceError

# Errors of the balances, relative, beyond which a run is refused.
BALANCE = 1e-6
# Share of the energy below which works are rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Ledger:
    """Energies [J] of a run: what was there at the ends, and the work in between.

    Over the largest of its terms, `error` is what the balance ``kinetic + strain = work of the torques and
    weight - damping - meshes`` misses. The step rule "average acceleration" keeps it exactly.
    """

    before: float
    after: float
    loads: float
    damping: float
    meshes: float
    error: float


class Books:
    """Energy and momentum of the deviations and of the spin."""

    def __init__(self, model, scheme, track, state):
        self.model, self.scheme, self.track = model, scheme, track
        self.carried = model.system.M @ model.rigid
        self.loads = self.damping = self.meshes = self.drift = self.impulse = 0.0
        self.effort = self.swing = self.missed = 0.0
        self.first_speed = track.speed
        self.before = self.energy(state, track.speed)
        self.momentum = self.first_momentum = self._momentum(state, track.speed)
        self.after = self.before
        self.largest = abs(self.momentum)

    def energy(self, state, speed) -> float:
        n, system = self.scheme.n, self.model.system
        q, v = state[:n], state[n : 2 * n]
        spin = 0.5 * self.track.inertia * speed**2 if self.track.separate else 0.0
        return float(0.5 * v @ system.M @ v + 0.5 * q @ system.K @ q + spin)

    def _momentum(self, state, speed) -> float:
        spin = self.track.inertia * (speed if self.track.separate else self.first_speed)
        return float(self.carried @ state[self.scheme.n : 2 * self.scheme.n]) + spin

    def add(self, states, block):
        n, h, track = self.scheme.n, self.track.step, self.track
        moved = np.diff(states[:, :n], axis=0)
        mean = 0.5 * (block.loads[1:] + block.loads[:-1])
        self.loads += float(np.sum((moved @ track.directions) * mean))
        half = 0.5 * (block.torque[1:] + block.torque[:-1])
        if track.separate:
            # exact for a torque that is linear in the step
            self.loads += float(h * half @ (0.5 * (block.speed[1:] + block.speed[:-1])))
        self.damping += float(np.sum((moved @ self.model.system.C) * moved)) / h
        forces = 0.5 * (states[1:, 2 * n :] + states[:-1, 2 * n :])
        self.meshes += float(np.sum((moved @ self.scheme.basic) * forces))
        self.impulse += float(h * half.sum())
        self.effort += float(h * block.effort.sum())
        self.after = self.energy(states[-1], block.speed[-1])
        self.momentum = self._momentum(states[-1], block.speed[-1])
        self.largest = max(self.largest, abs(self.impulse), abs(self.momentum))
        self.swing = max(self.swing, float(np.abs(self.carried) @ np.abs(states[-1, n : 2 * n])))
        # what is missed by then goes out with the drift; NaN stays
        missed = abs(self.momentum - self.first_momentum - self.impulse)
        self.missed = missed if not missed <= self.missed else self.missed

    def without_drift(self, state):
        """The state less the spin that rounding has put into the deviations."""
        n, rigid = self.scheme.n, self.model.rigid
        angle, rate = (
            float(self.carried @ part) / self.track.inertia for part in (state[:n], state[n : 2 * n])
        )
        self.drift = max(self.drift, abs(angle))
        state = state.copy()
        state[:n] -= angle * rigid
        state[n : 2 * n] -= rate * rigid
        return state

    def ledger(self) -> Ledger:
        rest = self.after - self.before - self.loads + self.damping + self.meshes
        terms = [self.after - self.before, self.loads, self.damping, self.meshes]
        size = max(*map(abs, terms), _ROUNDING * self.before, _ROUNDING * self.after) or 1.0
        return Ledger(self.before, self.after, self.loads, self.damping, self.meshes, abs(rest) / size)

    def momentum_error(self) -> float:
        """Largest error after any block, over the largest momentum or impulse of the torques."""
        size = max(self.largest, self.effort) or self.swing
        return self.missed / size if self.missed else 0.0

    def check(self, states, block, *, first: int, exact: bool, free, contact_loss: bool) -> None:
        """Refuse a motion that has outgrown the numbers.

        Parameters
        ----------
        states : (t, 2 n + m) array
            Of the block that begins with step `first`.
        block : Block
        exact : bool
            Whether the step rule keeps energy and impulse.
        free : FreeMotion
            Tells its growth.

        Raises
        ------
        ConvergenceError
            Momentum or energy are lost, or the motion is beyond all numbers (E-DIVERGED).
        """
        finite = np.isfinite(states).all(axis=1)
        energy = self.ledger().error if exact else 0.0
        momentum = self.momentum_error() if exact or self.track.separate else 0.0
        if finite.all() and energy <= BALANCE and momentum <= BALANCE:
            return
        last = len(states) - 1 if finite.all() else max(int(np.argmin(finite)) - 1, 0)
        missed = f"energy missed by {energy:.2g}, momentum by {momentum:.2g}" if finite.all() else "overflow"
        remedy = "give more damping, or another speed"
        if not contact_loss:
            remedy += ", or write contact_loss = true: real meshes separate"
        raise ConvergenceError(
            f"the motion has outgrown the numbers by t = {self.track.step * (first + last):.4g} s ({missed})"
            f"{self._mesh(states[last], block, last)}; the free motion {_rate(free.growth())}",
            code="E-DIVERGED",
            limit=f"balances of energy and momentum to {BALANCE:g}",
            remedy=remedy,
        )

    def _mesh(self, state, block, last) -> str:
        """The mesh with the most strain energy."""
        n = self.scheme.n
        if not self.model.meshes:
            return ""
        # of size one, so that its square is finite
        approach = (state[:n] @ self.scheme.basic) @ block.selection[last]
        strain = block.stiffness[last] * (approach / max(np.abs(approach).max(), 1e-300)) ** 2
        return f", most in mesh {self.model.meshes[int(np.argmax(strain))]}"


def _rate(growth: float) -> str:
    if not np.isfinite(growth):
        return "is not known"
    if growth <= 0.0:
        return f"decays with {-growth:.4g} 1/s: the loads are too large"
    return f"grows with {growth:.4g} 1/s: a parametric resonance"
