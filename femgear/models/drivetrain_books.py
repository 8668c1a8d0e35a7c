"""Energy, momentum and drift of a drivetrain that is stepped through time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Ledger:
    """Energies [J] of a run: what was there at the ends, and the work in between.

    Over the largest of its terms, `error` is what the balance ``kinetic + strain = work of the torques and
    weight -
    damping - meshes`` misses. The step rule "average acceleration" keeps it exactly.
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
        self.first_speed = track.speed
        self.before = self.energy(state, track.speed)
        self.momentum = self.first_momentum = self._momentum(state, track.speed)
        self.after = self.before
        self.largest = max(abs(self.momentum), 1e-300)

    def energy(self, state, speed) -> float:
        n, system = self.scheme.n, self.model.system
        q, v = state[:n], state[n : 2 * n]
        spin = 0.5 * self.track.inertia * speed**2 if self.track.separate else 0.0
        return float(0.5 * v @ system.M @ v + 0.5 * q @ system.K @ q) + spin

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
            self.loads += float(half @ np.diff(block.angle))
        self.damping += float(np.einsum("ti,ij,tj->", moved, self.model.system.C, moved, optimize=True)) / h
        forces = 0.5 * (states[1:, 2 * n :] + states[:-1, 2 * n :])
        self.meshes += float(np.sum((moved @ self.scheme.basic) * forces))
        self.impulse += float(h * half.sum())
        self.after = self.energy(states[-1], block.speed[-1])
        self.momentum = self._momentum(states[-1], block.speed[-1])
        self.largest = max(self.largest, abs(self.impulse), abs(self.momentum))

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
        size = max(map(abs, terms)) or 1.0
        return Ledger(self.before, self.after, self.loads, self.damping, self.meshes, abs(rest) / size)

    def momentum_error(self) -> float:
        return abs(self.momentum - self.first_momentum - self.impulse) / self.largest
