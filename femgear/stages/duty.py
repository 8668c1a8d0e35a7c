"""What a gear train does, in one sentence: torque, speed and power at its ends, its ratio and mesh frequency."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.case.planetary import Case, output_member
from femgear.case.quantities import RPM
from femgear.gears.kinematics import planet_motion, torque_ratios

_POWERS = ("MW", 1e6), ("kW", 1e3), ("W", 1.0)
"""Units of power, from the largest, with their sizes [W]."""
_IDLE = 1e-9
"""Share of the largest torque, or of the largest power, that counts as none."""


_LARGE = 1e4
"""Torque [N m] and force [N] from which on they are written in kilonewtons."""


@dataclass(frozen=True)
class ShaftEnd:
    """An end of a gear train at which a torque acts from outside.

    Parameters
    ----------
    name : str
        Of its body or load.
    torque : float
        From outside [N m].
    speeds : tuple of float
        Speeds of operation [rad/s]; none of a train that is held.
    """

    name: str
    torque: float
    speeds: tuple[float, ...]

    @property
    def fastest(self) -> float:
        """Speed of the largest size [rad/s]; zero without any."""
        return max(self.speeds, key=abs, default=0.0)

    @property
    def power(self) -> float:
        """Power that goes in at the fastest speed [W], negative of what comes out."""
        return self.torque * self.fastest

    @property
    def words(self) -> str:
        """Torque and speeds in words: ``60 N m at 250 to 3,100 rpm (sun)``."""
        sizes = sorted({abs(speed) / RPM for speed in self.speeds})
        between = " to ".join(map(in_digits, sizes[:: max(len(sizes) - 1, 1)]))
        return f"{_torque(abs(self.torque))}{f' at {between} rpm' if between else ''} ({self.name})"


def duty_sentence(ends: Sequence[ShaftEnd], beside: str = "") -> str:
    """Write what a train does: ``60 N m at 3,100 rpm (sun) make 300 N m at 620 rpm (carrier): 19.5 kW, ratio 5.``

    Parameters
    ----------
    ends : sequence of ShaftEnd
        Those without a torque are left out. Without power the first end drives.
    beside : str
        What else to say, at the end.
    """
    least = _IDLE * max((abs(end.torque) for end in ends), default=0.0)
    loaded = [end for end in ends if abs(end.torque) > least]
    most = max((abs(end.power) for end in loaded), default=0.0)
    if most:
        # what only holds against a torque does nothing
        loaded = [end for end in loaded if abs(end.power) > _IDLE * most]
    driving = [end for end in loaded if end.power > 0.0] if most else loaded[:1]
    driven = [end for end in loaded if end not in driving]
    if not driving:
        return ""
    text = _and(driving) + (f" make {_and(driven)}" if driven else "")
    up_to = "up to " if any(len({*end.speeds}) > 1 for end in driving) else ""
    facts = [up_to + _power(sum(end.power for end in driving))] if most else []
    if most and len(driving) == len(driven) == 1 and driven[0].fastest:
        ratio = abs(driving[0].fastest / driven[0].fastest)
        facts.append(f"ratio {ratio:.4g}" if ratio >= 1.0 else f"ratio 1:{1.0 / ratio:.4g}")
    facts += [beside] if beside else []
    return f"{text}: {', '.join(facts)}." if facts else f"{text}."


def set_duty(case: Case) -> str:
    """Write what a planetary set does."""
    driving, driven, operation = case.operation.input, output_member(case), case.operation
    share = torque_ratios(case.sun.teeth, case.ring.teeth)
    # the weights of the torques are those of the speeds, too
    ratio = -share[driving] / share[driven]
    ends = (
        ShaftEnd(driving, operation.torque, operation.speeds),
        ShaftEnd(driven, -operation.torque / ratio, tuple(ratio * speed for speed in operation.speeds)),
    )
    of_members = {member: np.zeros(len(operation.speeds)) for member in share}
    of_members |= {end.name: np.array(end.speeds) for end in ends}
    sun, planet = case.sun.teeth, case.planet.teeth
    hertz = planet_motion(of_members["sun"], of_members["carrier"], sun, planet)[1]
    return duty_sentence(ends, _mesh_words(hertz, teeth_words([case.helix_angle])))


def _mesh_words(hertz: Iterable[float], teeth: str) -> str:
    """Write how often teeth come into mesh [Hz], from the least to the most often, or of what kind they are."""
    often = sorted({float(f"{abs(value):.6g}") for value in hertz} - {0.0})
    return f"{teeth} mesh at {' to '.join(map(in_digits, often[:: max(len(often) - 1, 1)]))} Hz" if often else teeth


def teeth_words(helix_angles: Iterable[float | None]) -> str:
    """Say whether teeth are spur or helical, by the helix angles of all stages [rad]; None and zero of spur gears."""
    kinds = {bool(angle) for angle in helix_angles}
    return "teeth" if len(kinds) != 1 else "helical teeth" if kinds.pop() else "spur teeth"


def pair_duty(case: Any) -> str:
    """Write what a pair does."""
    ratio, operation = case.gear_1.teeth / case.gear_2.teeth, case.operation
    speeds = tuple(ratio * speed for speed in operation.speeds)
    first = ShaftEnd("gear 1", operation.torque, operation.speeds)
    hertz = [case.gear_1.teeth * speed / (2.0 * math.pi) for speed in operation.speeds]
    ends = first, ShaftEnd("gear 2", -operation.torque / ratio, speeds)
    return duty_sentence(ends, _mesh_words(hertz, teeth_words([case.helix_angle])))


def force_words(newtons: float) -> str:
    """Write a force [N] with four digits, a large one in kilonewtons."""
    return f"{newtons:.4g} N" if newtons < _LARGE else f"{1e-3 * newtons:.4g} kN"


def in_digits(value: float) -> str:
    """Write a number with at least three digits and separators of thousands."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if abs(value) >= 1000.0:
        return f"{round(value, 3 - math.floor(math.log10(abs(value)))):,.0f}"
    return f"{value:.3g}"


def _and(ends: Sequence[ShaftEnd]) -> str:
    return " and ".join(end.words for end in ends)


def _torque(torque: float) -> str:
    """Write a torque, large ones in kilonewtons."""
    return f"{in_digits(1e-3 * torque)} kN m" if torque >= _LARGE else f"{in_digits(torque)} N m"


def _power(power: float) -> str:
    """Write a power with the unit that suits its size."""
    unit, size = next(((unit, size) for unit, size in _POWERS if power >= size), _POWERS[-1])
    return f"{in_digits(power / size)} {unit}"
