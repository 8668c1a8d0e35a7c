"""How fast a drivetrain turns under its torques, and the steps and records that this asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_record import PASS_BAND
from femgear.models.drivetrain_torque import TorqueHistory

# Steps a period that can follow a mesh at all, and well: average acceleration lowers its frequency by
# (2 pi / steps)^2 / 12, 21 % for four, 0.4 % for thirty.
LEAST_STEPS, GOOD_STEPS = 4, 30
# Records that nobody chose keep this multiple of the highest mesh frequency, and come this often [Hz].
KEPT_HARMONIC, LEAST_RECORD_RATE = 3, 1000.0


@dataclass(frozen=True)
class SpeedRange:
    """Speeds of the free spin over a run: first, last, lowest and highest [rad/s]."""

    first: float
    last: float
    lowest: float
    highest: float

    @property
    def fastest(self) -> float:
        """Largest speed in either sense [rad/s]."""
        return max(abs(self.lowest), abs(self.highest))


def speed_range(
    model: DrivetrainModel, torques: Sequence[TorqueHistory], *, duration: float, speed: float
) -> SpeedRange:
    """Speeds of the first body as the rigid chain turns under its torques.

    Newton's law of the rigid chain, d omega / dt = sum(ratio_b T_b(t)) / I with its inertia I about the axis
    of the first body. Torques are linear between their instants, so that the speed there is a sum of
    trapezoids, and a parabola in between with its vertex where the sum is zero.

    Parameters
    ----------
    model : DrivetrainModel
    torques : sequence of TorqueHistory
    duration : float
        [s]
    speed : float
        Of the first body at the start [rad/s].

    Returns
    -------
    SpeedRange
    """
    instants = np.concatenate([[0.0, duration], *(one.times for one in torques)])
    times = np.unique(np.clip(instants, 0.0, duration))
    power = sum((model.ratio[one.body] * one.at(times) for one in torques), np.zeros(len(times)))
    rate, step = power / model.inertia, np.diff(times)
    speeds = speed + np.append(0.0, np.cumsum(0.5 * step * (rate[1:] + rate[:-1])))
    turning = np.flatnonzero(rate[1:] * rate[:-1] < 0.0)
    vertex = rate[turning] ** 2 / (rate[turning] - rate[turning + 1]) * step[turning]
    every = np.append(speeds, speeds[turning] + 0.5 * vertex)
    return SpeedRange(float(speed), float(speeds[-1]), float(every.min()), float(every.max()))


def highest_mesh(model: DrivetrainModel, speed: float) -> tuple[str, float]:
    """Name and frequency [Hz] of the fastest mesh at a speed of the first body; none, 0 without gears."""
    bases = np.unique(model.mesh_base)
    if not len(bases):
        return "none", 0.0
    hertz = model.frequencies(abs(speed))[bases] / (2.0 * math.pi)
    return model.bases[bases[np.argmax(hertz)]], float(hertz.max())


def default_record_rate(rate: float, highest: float) -> float:
    """Records a second where none are given: few, but with the third harmonic of the highest mesh.

    Parameters
    ----------
    rate : float
        Steps a second [Hz].
    highest : float
        Highest mesh frequency of the run [Hz].

    Returns
    -------
    float
        The rate over the largest whole number for which the pass band of the records holds that harmonic and
        there are 1000 a second; at most the rate.
    """
    # a hair more, so that rounding of the speed does not push the harmonic out
    needed = max(LEAST_RECORD_RATE, 2.0 * KEPT_HARMONIC * highest * (1.0 + 1e-6) / PASS_BAND)
    return rate / max(1, math.floor(rate / needed * (1.0 + 1e-12)))
