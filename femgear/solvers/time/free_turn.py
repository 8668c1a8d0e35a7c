"""The rigid-body rotation of a chain of gears under torques over time, exact for torques that are linear in a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.solvers.time.spun_system import SpunSystem


@dataclass(frozen=True)
class TorqueHistory:
    """Torque on one ``body``, linear between the instants and constant outside them.

    ``times`` (m,) ascend [s]; ``values`` (m,) [N m] are positive about z.
    """

    body: str
    times: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "times", np.array(self.times, float))
        object.__setattr__(self, "values", np.array(self.values, float))

    def at(self, times) -> np.ndarray:
        """Compute the torque (n,) [N m] at any instants (n,) [s]."""
        return np.interp(times, self.times, self.values)

    def mean(self, duration: float) -> float:
        """Compute the mean torque from 0 to `duration` [s], exact [N m]."""
        inside = self.times[(self.times > 0.0) & (self.times < duration)]
        times = np.concatenate([[0.0], inside, [duration]])
        return float(np.trapezoid(self.at(times), times) / duration)


@dataclass(frozen=True)
class SpeedRange:
    """Speeds of the rigid-body rotation over a run [rad/s].

    ``first`` and ``last`` are those at its ends; ``lowest``, ``highest`` and ``mean`` those over time.
    """

    first: float
    last: float
    lowest: float
    highest: float
    mean: float

    @property
    def fastest(self) -> float:
        """Largest speed in either sense [rad/s]."""
        return max(abs(self.lowest), abs(self.highest))


def reached_speeds(
    torques: Sequence[TorqueHistory],
    ratios: Sequence[float],
    inertia: float,
    *,
    duration: float,
    speed: float,
    start: float = 0.0,
) -> SpeedRange:
    """Compute the speeds of a shaft as the rigid chain turns under torques, from start to end [s].

    Newton's law of the rigid chain, d omega / dt = sum(ratio_b T_b(t)) / I with its ``inertia`` I about the axis of
    the shaft [kg m^2], whose ``speed`` is that at time zero [rad/s]; ``ratios`` are the speeds where the torques act
    over it. Torques are linear between their instants, so that the speed there is a sum of trapezoids, and a parabola
    in between with its vertex where the sum is zero.
    """
    instants = np.concatenate([[0.0, start, duration], *(torque.times for torque in torques)])
    times = np.unique(np.clip(instants, 0.0, duration))
    power = np.zeros(len(times))
    for torque, ratio in zip(torques, ratios, strict=True):
        power += ratio * torque.at(times)
    rate, step = power / inertia, np.diff(times)
    speeds = speed + np.append(0.0, np.cumsum(0.5 * step * (rate[1:] + rate[:-1])))
    begin = int(np.searchsorted(times, start))
    rate, step, speeds = rate[begin:], step[begin:], speeds[begin:]
    middle = speeds[:-1] + step * (3.0 * rate[:-1] + rate[1:]) / 8.0
    # simpson's rule, exact for parabolas
    mean = step @ (speeds[:-1] + 4.0 * middle + speeds[1:]) / (6.0 * step.sum())
    turning = np.flatnonzero(rate[1:] * rate[:-1] < 0.0)
    vertex = rate[turning] ** 2 / (rate[turning] - rate[turning + 1]) * step[turning]
    every = np.append(speeds, speeds[turning] + 0.5 * vertex)
    return SpeedRange(*map(float, (speeds[0], speeds[-1], every.min(), every.max(), mean)))


@dataclass(frozen=True)
class StepBlock:
    """Loads and meshes at the instants (t,) of a block of steps, its start included.

    ``loads`` (t, d): one for the constant load, then the torques [N m]; ``selection`` (t, m, c): ``S`` of the
    contacts; ``stiffness`` and ``gap`` (t, c) [N/m], [m]. Of the rotation are ``angle`` (t,) [rad], ``speed`` (t,)
    [rad/s], ``torque`` (t,) and, without regard to signs, ``effort`` (t,) [N m].
    """

    loads: np.ndarray
    selection: np.ndarray
    stiffness: np.ndarray
    gap: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    effort: np.ndarray


class FreeTurn:
    """The rigid-body rotation from a ``speed`` of the shaft [rad/s] on, and the loads that are left.

    In steps of ``step`` [s]; each of the ``torques`` with its direction, a row (n,) of the coordinates.
    """

    def __init__(
        self,
        spun: SpunSystem,
        torques: Sequence[tuple[TorqueHistory, np.ndarray]],
        step: float,
        speed: float,
    ):
        self.spun, self.step = spun, step
        self.torques, directions = tuple(torque for torque, _ in torques), [direction for _, direction in torques]
        self.angle, self.speed = 0.0, float(speed)
        self.share = np.array([spun.share(direction) for direction in directions])
        loads = [spun.without_drive(load) for load in (spun.system.load, *directions)]
        self.directions = np.column_stack(loads)

    @property
    def energy_inertia(self) -> float:
        """Inertia [kg m^2]; zero where nothing turns freely and the speed stays."""
        return self.spun.inertia if np.isfinite(self.spun.inertia) else 0.0

    def block(self, first: int, count: int) -> StepBlock:
        """Take the next `count` steps, which begin with step `first`; the rotation moves on to their end."""
        times = self.step * np.arange(first, first + count + 1)
        values = np.zeros((count + 1, len(self.torques)))
        for column, acting in enumerate(self.torques):
            values[:, column] = acting.at(times)
        torque, h = values @ self.share, self.step
        rate = torque / self.spun.inertia
        speed = self.speed + np.append(0.0, np.cumsum(0.5 * h * (rate[1:] + rate[:-1])))
        moved = h * speed[:-1] + h * h * (2.0 * rate[:-1] + rate[1:]) / 6.0
        angle = self.angle + np.append(0.0, np.cumsum(moved))
        self.angle, self.speed = angle[-1], speed[-1]
        loads = np.hstack([np.ones((count + 1, 1)), values])
        effort, spun = np.abs(values) @ np.abs(self.share), self.spun
        stiffness, gap = (spun.at_phases(table, angle) for table in (spun.stiffness, spun.gap))
        return StepBlock(loads, spun.selection(angle), stiffness, gap, angle, speed, torque, effort)
