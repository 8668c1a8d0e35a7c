"""Refusals of data that no lumped planetary set can have."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.models.planar import PlanarBody, PlanarSet


def check_body(name: str, body: PlanarBody) -> None:
    """Refuse a mass, inertia or support (E-PLANAR)."""
    for entry, unit in (("mass", "kg"), ("inertia", "kg m^2")):
        value = getattr(body, entry)
        if not (math.isfinite(value) and value > 0.0):
            _refuse(f"{name}.{entry}", value, unit, "finite and above 0")
    for entry, unit in (("support", "N/m"), ("torsional_support", "N m/rad")):
        value = getattr(body, entry)
        if not value >= 0.0:
            _refuse(f"{name}.{entry}", value, unit, "0 or more, or infinite")
        if name == "planet" and value:
            _refuse(f"planet.{entry}", value, unit, "0", remedy="give planet_bearing of the set")


def check_set(data: PlanarSet) -> None:
    """Refuse radii, angles and stiffnesses (E-PLANAR)."""
    for name in ("sun_radius", "ring_radius", "planet_radius", "centre_distance"):
        value = getattr(data, name)
        if not (math.isfinite(value) and value > 0.0):
            _refuse(name, value, "m", "finite and above 0")
    for name in ("pressure_angle_sun_planet", "pressure_angle_planet_ring"):
        value = getattr(data, name)
        if not 0.0 < value < 0.5 * math.pi:
            _refuse(name, value, "rad", "between 0 and pi/2", remedy="give radians")
    for name in ("stiffness_sun_planet", "stiffness_planet_ring", "planet_bearing"):
        values, allowed = getattr(data, name), "finite and above 0"
        wrong = ~np.isfinite(values) | ~(values > 0.0)
        if name == "planet_bearing":
            allowed, wrong = "above 0, or infinite", ~(values > 0.0)
        if len(values) != data.n_planets:
            _refuse(name, f"{len(values)} values", "", f"one number, or {data.n_planets}")
        if np.any(wrong):
            _refuse(name, values[wrong][0], "N/m", allowed)
    check_angles(data.planet_angles, code="E-PLANAR")


def check_angles(angles: np.ndarray, *, code: str) -> None:
    """Refuse planet angles that are none, unordered or span more than a turn."""
    allowed = "one or more, finite, ascending, within one turn"
    if not angles.size or angles.ndim != 1 or not np.all(np.isfinite(angles)):
        refuse("planet_angles", angles.tolist(), "rad", allowed, code=code)
    if np.any(np.diff(angles) < 1e-9) or np.ptp(angles) > 2.0 * math.pi - 1e-9:
        remedy = "give radians, in ascending order"
        refuse("planet_angles", angles.tolist(), "rad", allowed, code=code, remedy=remedy)


def refuse(key: str, value, unit: str, limit: str, *, code: str, remedy: str | None = None):
    """Refuse an entry of a set, such as ``planet.mass``, with its value and what is allowed."""
    raise CaseError(
        f"{key.replace('_', ' ').replace('.', ': ')} of {value} {unit}".rstrip(),
        code=code, key=key, value=value, limit=limit, remedy=remedy,
    )  # fmt: skip


_refuse = partial(refuse, code="E-PLANAR")
