"""Refusals of data that no helical planetary set can have."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femgear.models.planar_checks import check_angles, refuse

if TYPE_CHECKING:
    from femgear.models.helical_data import HelicalBody, HelicalSet, HelicalSupport

CONTACT_POINTS = ("pitch_point", "base_circles")
# Rounded numbers miss each other by less than 1 %, other distances or angles than those of the gears by more.
LARGEST_CLOSURE = 0.1
DIRECTIONS = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "torsional": "N m/rad"}
_refuse = partial(refuse, code="E-HELICAL")


def check_body(name: str, body: HelicalBody) -> None:
    """Refuse a mass, inertia or support (E-HELICAL)."""
    for entry, unit in (("mass", "kg"), ("inertia", "kg m^2"), ("diametral_inertia", "kg m^2")):
        value = numbers(f"{name}.{entry}", getattr(body, entry), 0)
        if not (math.isfinite(value) and value > 0.0):
            _refuse(f"{name}.{entry}", value, unit, "finite and above 0")
    check_support(f"{name}.support", body.support, count=0)
    if name == "planet" and np.any(body.support.stiffness):
        _refuse("planet.support", "a planet", "", "none", remedy="give planet_bearing of the set")


def check_set(data: HelicalSet) -> None:
    """Refuse radii, angles, stiffnesses, slices and contact points (E-HELICAL)."""
    for name in ("sun_radius", "ring_radius", "planet_radius", "centre_distance"):
        value = numbers(name, getattr(data, name), 0)
        if not (math.isfinite(value) and value > 0.0):
            _refuse(name, value, "m", "finite and above 0")
    if data.ring_radius <= data.planet_radius:
        _refuse("ring_radius", data.ring_radius, "m", f"above the {data.planet_radius} m of the planets")
    for name in ("pressure_angle_sun_planet", "pressure_angle_planet_ring"):
        value = numbers(name, getattr(data, name), 0)
        if not 0.0 < value < 0.5 * math.pi:
            _refuse(name, value, "rad", "between 0 and pi/2", remedy="give radians")
    if not abs(numbers("base_helix_angle", data.base_helix_angle, 0)) < 0.5 * math.pi:
        allowed = "between -pi/2 and pi/2"
        _refuse("base_helix_angle", data.base_helix_angle, "rad", allowed, remedy="give radians")
    for name in ("stiffness_sun_planet", "stiffness_planet_ring"):
        values = getattr(data, name)
        if values.shape != (data.n_planets,):
            _refuse(name, f"{values.size} values", "", f"one number, or {data.n_planets}")
        wrong = ~np.isfinite(values) | (values < 0.0)
        if np.any(wrong):
            _refuse(name, values[wrong][0], "N/m", "finite, 0 or more")
    check_support("planet_bearing", data.planet_bearing, count=data.n_planets)
    check_angles(data.planet_angles, code="E-HELICAL")
    _check_contact(data)
    _check_closure(data)


def numbers(key: str, values, dimensions: int | None = None) -> np.ndarray:
    """Values as an array of floats, of so many dimensions where they are given (E-HELICAL)."""
    try:
        found = np.array(values, float)
    except (TypeError, ValueError):
        _refuse(key, repr(values), "", "a number" if dimensions == 0 else "numbers")
    if dimensions is not None and found.ndim != dimensions:
        _refuse(key, f"{found.size} values", "", "one number")
    return found


def check_support(key: str, support: HelicalSupport, *, count: int | None = None) -> None:
    """Refuse stiffnesses of a support (E-HELICAL): of `count` planets, of one body (0), of either (None)."""
    allowed = f"one number, or {count}" if count else "one number"
    # what is no support has none of its stiffnesses
    if not all(hasattr(support, entry) for entry in DIRECTIONS):
        _refuse(key, repr(support), "", "a HelicalSupport")
    for entry, unit in DIRECTIONS.items():
        values = numbers(f"{key}.{entry}", getattr(support, entry))
        if count is not None and values.ndim and values.shape != (count,):
            _refuse(f"{key}.{entry}", f"{values.size} values", "", allowed)
        if not np.all(values >= 0.0):
            _refuse(f"{key}.{entry}", values.min(), unit, "0 or more, or infinite")


def _check_contact(data: HelicalSet) -> None:
    if data.contact_points not in CONTACT_POINTS:
        _refuse("contact_points", repr(data.contact_points), "", " or ".join(CONTACT_POINTS))
    if isinstance(data.slices, bool) or int(data.slices) != data.slices or data.slices < 1:
        _refuse("slices", data.slices, "", "a whole number of 1 or more")
    if not (math.isfinite(data.face_width) and data.face_width >= 0.0):
        _refuse("face_width", data.face_width, "m", "finite, 0 or more")
    if data.slices > 1 and not data.face_width:
        _refuse("face_width", data.face_width, "m", "above 0 for several slices")


def _check_closure(data: HelicalSet) -> None:
    worst = max(data.closure, key=abs)
    if abs(worst) > LARGEST_CLOSURE:
        _refuse(
            "centre_distance", data.centre_distance, "m",
            f"(r_s + r_p) / cos alpha_sp and (r_r - r_p) / cos alpha_pr, within {LARGEST_CLOSURE:.0%}",
            remedy=f"radii, centre distance and pressure angles miss each other by {abs(worst):.3g}",
        )  # fmt: skip
