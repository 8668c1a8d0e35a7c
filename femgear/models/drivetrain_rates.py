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
# Not enough where modes lie far above the mesh lines: see `mesh_mode`.
LEAST_STEPS, GOOD_STEPS = 4, 30
# Records that nobody chose keep this multiple of the highest mesh frequency, and come this often [Hz].
KEPT_HARMONIC, LEAST_RECORD_RATE = 3, 1000.0
# Share of its strain energy that a mode has in the meshes where they drive it noticeably.
MESH_SHARE = 0.1


@dataclass(frozen=True)
class SpeedRange:
    """Speeds of the free spin over a run: first, last, lowest, highest and mean over time [rad/s]."""

    first: float
    last: float
    lowest: float
    highest: float
    mean: float

    @property
    def fastest(self) -> float:
        """Largest speed in either sense [rad/s]."""
        return max(abs(self.lowest), abs(self.highest))


def speed_range(
    model: DrivetrainModel,
    torques: Sequence[TorqueHistory],
    *,
    duration: float,
    speed: float,
    start: float = 0.0,
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
        Of the first body at time zero [rad/s].
    start : float
        The range is that from here to the end [s].

    Returns
    -------
    SpeedRange
    """
    instants = np.concatenate([[0.0, start, duration], *(one.times for one in torques)])
    times = np.unique(np.clip(instants, 0.0, duration))
    power = sum((model.ratio[one.body] * one.at(times) for one in torques), np.zeros(len(times)))
    rate, step = power / model.inertia, np.diff(times)
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


def highest_mesh(model: DrivetrainModel, speed: float) -> tuple[str, float]:
    """Name and frequency [Hz] of the fastest mesh at a speed of the first body; none, 0 without gears."""
    bases = np.unique(model.mesh_base)
    if not len(bases):
        return "none", 0.0
    hertz = model.frequencies(abs(speed))[bases] / (2.0 * math.pi)
    return model.bases[bases[np.argmax(hertz)]], float(hertz.max())


def mesh_mode(model: DrivetrainModel, limit: float) -> float:
    """Frequency of the highest mode that the meshes drive noticeably [Hz]; 0 where there is none.

    Modes at standstill with mean mesh stiffnesses; the share of the meshes in the strain energy of a mode
    ``phi`` is ``sum(k (w^T phi)^2) / omega^2`` (R. G. Parker and J. Lin, J. Vib. Acoust. 126, 2004, 68-76).

    Parameters
    ----------
    model : DrivetrainModel
    limit : float
        The highest line of the mesh stiffness [Hz]; modes above answer it as springs do, without resonance.
    """
    from scipy import linalg

    if not len(model.meshes):
        return 0.0
    rows, stiffness = model.system.W, model.mean_stiffness
    total = model.system.K + (rows * stiffness) @ rows.T
    values, shapes = linalg.eigh(total, model.system.M)
    # the free spin is the first
    values, shapes = np.maximum(values[1:], 0.0), shapes[:, 1:]
    hertz = np.sqrt(values) / (2.0 * math.pi)
    driven = stiffness @ (rows.T @ shapes) ** 2 > MESH_SHARE * values
    return float(hertz[driven & (hertz <= limit)].max(initial=0.0))


def frequency_shift(hertz: float, rate: float) -> float:
    """Share by which average acceleration lowers a natural frequency [Hz] at so many steps a second [Hz].

    ``tan(Omega h / 2) = omega h / 2`` for the frequency Omega that the steps have, so that the share is
    ``(omega h)^2 / 12`` for short steps (T. J. R. Hughes, The Finite Element Method, 1987, section 9.3).
    """
    half = math.pi * hertz / rate
    return 1.0 - math.atan(half) / half if half > 0.0 else 0.0


def shift_rate(hertz: float, share: float) -> float:
    """Steps a second [Hz] that lower a natural frequency [Hz] by this small share or a little less."""
    return math.pi * hertz / math.sqrt(3.0 * share)


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
