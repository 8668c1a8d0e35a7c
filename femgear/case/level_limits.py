"""The largest level that a case allows at a sensor: one for all speeds, or a target curve over the speed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from femgear.case.quantities import ACCELERATION, RPM, SPEED, Number, Quantity, Section
from femgear.errors import CaseError

_SpeedOfPoint = Annotated[float, Quantity(SPEED, 0.0, 1e6 * RPM)]


class LevelPoint(Section):
    """A point of the largest acceleration allowed, r.m.s.; without a speed it holds for all."""

    level: Annotated[float, Quantity(ACCELERATION, 1e-9, 1e9)]
    speed: _SpeedOfPoint | None = None


class SoundPoint(Section):
    """A point of the largest sound pressure level allowed [dB(A)]; without a speed it holds for all."""

    level: Annotated[float, Number(-50.0, 250.0)]
    speed: _SpeedOfPoint | None = None


def _as_points(value: object) -> object:
    """Make one level a curve of one point."""
    return ({"level": value},) if isinstance(value, str | float | int) else value


def _rising(points: tuple[Any, ...]) -> tuple[Any, ...]:
    """Refuse points whose speeds do not rise (CaseError)."""
    speeds = [point.speed for point in points if point.speed is not None]
    if len(points) > 1 and len(speeds) < len(points):
        message, remedy = "a point of the curve has no speed", "give every point a speed, or one level for all speeds"
        raise CaseError(message, code="E-KEY-MISSING", remedy=remedy)
    if any(later <= earlier for earlier, later in pairwise(speeds)):
        message, remedy = "speeds of the curve do not rise", "give the points in the order of their speeds, each once"
        value = [speed / RPM for speed in speeds]
        raise CaseError(message, code="E-SPEED", value=value, limit="every speed above the one before", remedy=remedy)
    return points


LevelLimit = Annotated[
    tuple[LevelPoint, ...], Field(max_length=1000), BeforeValidator(_as_points), AfterValidator(_rising)
]
"""A level for all speeds, or points with straight lines between them."""
SoundLimit = Annotated[
    tuple[SoundPoint, ...], Field(max_length=1000), BeforeValidator(_as_points), AfterValidator(_rising)
]


def limit_at(points: Sequence[LevelPoint] | Sequence[SoundPoint], speed: np.ndarray) -> np.ndarray:
    """Compute the largest level (n,) allowed at speeds (n,) [rpm]: straight lines between points, level beyond them."""
    if points[0].speed is None:
        return np.full(len(speed), points[0].level)
    return np.interp(RPM * np.asarray(speed), [point.speed or 0.0 for point in points], [p.level for p in points])
