"""Refusals of a single gear: numbers that no gear can have, said before anything is computed with them."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.fillet import cutter_of, generating_tool
from femgear.gears.involute import inv, pressure_angle_at

if TYPE_CHECKING:
    from femgear.gears.gear import Gear

TEETH_RANGE = (5, 5000)
MODULE_RANGE = (0.05e-3, 0.1)
PRESSURE_ANGLE_RANGE = (math.radians(5.0), math.radians(45.0))


@dataclass(frozen=True)
class GeometryWarning:
    """Something that works but deserves a look.

    Parameters
    ----------
    code, key, message : str
        Stable identifier, entry of the case file, and a sentence with the numbers.
    value : float
        The number that drew the warning.
    limit : str
        What would not be warned about.
    """

    code: str
    key: str
    message: str
    value: float
    limit: str

    def __str__(self) -> str:
        return f"[{self.code}] {self.key}: {self.message} (usual: {self.limit})"


def check_gear(gear: Gear) -> None:
    """Refuse a gear that cannot be made; see the errors of `gear.Gear`."""
    _check_numbers(gear)
    _check_rack(gear)
    _check_circles(gear)
    _check_tool(gear)
    _check_flank(gear)


def _refuse(gear: Gear, entry: str, message: str, *, code: str, value, limit: str, remedy: str):
    key = entry if entry.startswith("rack.") else f"{gear.name}.{entry}"
    raise GeometryError(
        f"{gear.name}: {message}", code=code, key=key, value=value, limit=limit, remedy=remedy
    )


def _is_whole(value) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool | np.bool_)


def _check_numbers(gear: Gear) -> None:
    """Types and ranges of the plain entries."""
    if not _is_whole(gear.teeth):
        _refuse(
            gear,
            "teeth",
            f"the number of teeth is {gear.teeth!r}, not a whole number",
            code="E-TEETH",
            value=gear.teeth,
            limit=f"whole number {TEETH_RANGE[0]} .. {TEETH_RANGE[1]}",
            remedy="give a whole number of teeth",
        )
    object.__setattr__(gear, "teeth", operator.index(gear.teeth))
    unit_hint = "lengths are in m and angles in rad here: check the unit of the value"
    limits = (
        ("teeth", "E-TEETH", *TEETH_RANGE, "", "larger gears would take hours: use fewer teeth"),
        ("module", "E-MODULE", *MODULE_RANGE, " m", unit_hint),
        ("pressure_angle", "E-PRESSURE-ANGLE", *PRESSURE_ANGLE_RANGE, " rad", unit_hint),
        ("profile_shift", "E-SHIFT", -5.0, 5.0, " modules", "profile shifts are in modules, not in mm"),
        ("face_width", "E-FACE-WIDTH", 1e-6, 10.0, " m", unit_hint),
        ("rim_radius", "E-RIM", 1e-6, 1000.0, " m", unit_hint),
        ("thickness_allowance", "E-ALLOWANCE", 0.0, gear.module, " m", "an allowance thins the tooth"),
    )
    for entry, code, low, high, unit, remedy in limits:
        value = getattr(gear, entry)
        if not _within(value, low, high):
            name = {"rim_radius": "outer_radius" if gear.internal else "bore_radius"}.get(entry, entry)
            _refuse(
                gear,
                name,
                f"{name.replace('_', ' ')} {value}{unit} is outside {low:.6g} .. {high:.6g}{unit}",
                code=code,
                value=value,
                limit=f"{low:.6g} .. {high:.6g}{unit}",
                remedy=remedy,
            )


def _within(value, low: float, high: float) -> bool:
    return isinstance(value, float | int | np.floating) and low <= value <= high


def _check_rack(gear: Gear) -> None:
    for entry, low in (("addendum", 0.05), ("dedendum", 0.05), ("root_radius", 0.0)):
        value = getattr(gear.rack, entry)
        if not _within(value, low, 3.0):
            _refuse(
                gear,
                f"rack.{entry}",
                f"basic rack with {entry.replace('_', ' ')} {value} modules",
                code="E-RACK",
                value=value,
                limit=f"{low:g} .. 3 modules",
                remedy="ISO 53 profile C has addendum 1, dedendum 1.25 and root_radius 0.25",
            )
    for entry in ("tip_diameter", "root_diameter"):
        value = getattr(gear, entry)
        if value is not None and not _within(value, 1e-6, 2000.0):
            _refuse(
                gear,
                entry,
                f"{entry.replace('_', ' ')} {value} m",
                code="E-TIP",
                value=value,
                limit="a positive length",
                remedy="leave it out to take that of the basic rack",
            )


def _check_circles(gear: Gear) -> None:
    """Order of the circles from the rim to the tip."""
    tip, root, rim = gear.tip_radius, gear.root_radius, gear.rim_radius
    sign = -1.0 if gear.internal else 1.0
    if not (sign * (tip - root) > 0.0 and tip > 0.0):
        _refuse(
            gear,
            "tip_diameter",
            f"tip radius {tip * 1e3:.4f} mm and root radius {root * 1e3:.4f} mm leave no tooth",
            code="E-TIP",
            value=2.0 * tip,
            limit=f"tip diameter {'<' if gear.internal else '>'} {2e3 * root:.4f} mm",
            remedy="correct the tip or root diameter",
        )
    if not sign * (root - rim) > 0.0:
        _refuse(
            gear,
            "outer_radius" if gear.internal else "bore_radius",
            f"the rim is {sign * (root - rim) * 1e3:.4f} mm thick: root radius {root * 1e3:.4f} mm, "
            f"{'outer' if gear.internal else 'bore'} radius {rim * 1e3:.4f} mm",
            code="E-RIM",
            value=rim,
            limit=f"{'>' if gear.internal else '<'} {root * 1e3:.4f} mm",
            remedy="enlarge the outer radius" if gear.internal else "reduce the bore radius",
        )
    if not tip > gear.base_radius:
        _refuse(
            gear,
            "tip_diameter",
            f"the tip circle (radius {tip * 1e3:.4f} mm) lies inside the base circle "
            f"({gear.base_radius * 1e3:.4f} mm), where there is no involute",
            code="E-TIP",
            value=2.0 * tip,
            limit=f"tip diameter > {2e3 * gear.base_radius:.4f} mm",
            remedy="give a larger tip_diameter, more teeth or a larger profile shift",
        )


def _check_tool(gear: Gear) -> None:
    """Room for the tool's rounding."""
    if gear.internal:
        _check_cutter(gear)
    room = _room(gear, None)
    if room < -1e-12:
        largest, rounding = _largest_rounding(gear), round(gear.tool.rounding / gear.module, 9)
        _refuse(
            gear,
            "rack.root_radius",
            f"a tool tip rounding of {rounding:.4f} modules does not fit between the flanks of the tool"
            + ("" if largest > 0.0 else ", nor does any other"),
            code="E-ROOT-RADIUS",
            value=rounding,
            limit=f"<= {largest:.4f} modules" if largest > 0.0 else None,
            remedy="reduce root_radius" if largest > 0.0 else "reduce the dedendum",
        )


def _room(gear: Gear, rounding: float | None) -> float:
    """Space left between the two rounded corners of the tool's tip, relative (negative: none)."""
    tool = generating_tool(gear, rounding=rounding)
    if not gear.internal:
        return tool.centre_offset / gear.module
    return tool.centre_angle if tool.centre_radius > tool.cutter_base_radius else -1.0


def _largest_rounding(gear: Gear) -> float:
    """Largest tool tip rounding [modules] that fits with the same root circle, rounded down to 1e-4."""
    low, high = 0.0, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _room(gear, middle) >= 0.0 else (low, middle)
    return math.floor(1e4 * low) / 1e4


def _check_cutter(gear: Gear) -> None:
    cutter = cutter_of(gear)
    if not (_is_whole(cutter.teeth) and 5 <= cutter.teeth <= gear.teeth - 5):
        _refuse(
            gear,
            "cutter_teeth",
            f"a cutter of {cutter.teeth!r} teeth cannot generate an internal gear of {gear.teeth} teeth",
            code="E-CUTTER",
            value=cutter.teeth,
            limit=f"whole number 5 .. {gear.teeth - 5}",
            remedy="choose a smaller cutter; 30 teeth, or 12 fewer than the gear, is the default",
        )
    try:
        tool = gear.tool
    except GeometryError:
        _refuse(
            gear,
            "profile_shift",
            f"a cutter of {cutter.teeth} teeth with shift {cutter.profile_shift:.4f} finds no working "
            f"pressure angle for a flank shifted by {gear.profile_shift:.4f}",
            code="E-CUTTER",
            value=gear.profile_shift,
            limit="inv(alpha_w0) >= 0 between cutter and gear",
            remedy="increase the profile shift, or take a cutter with fewer teeth or a smaller shift",
        )
    if not tool.centre_radius > tool.cutter_base_radius:
        _refuse(
            gear,
            "cutter_teeth",
            f"the rounding of the cutter's tip is centred at {tool.centre_radius * 1e3:.4f} mm, inside the "
            f"cutter's base circle of {tool.cutter_base_radius * 1e3:.4f} mm",
            code="E-CUTTER",
            value=cutter.teeth,
            limit="tip radius - rounding > base radius of the cutter",
            remedy="choose a cutter with more teeth, or a smaller root_radius",
        )
    start = tool.centre_distance * math.cos(tool.end_angle)  # gear roll at the cutter's base tangent point
    if gear.tip_roll < start:
        least = math.hypot(gear.base_radius, start)
        _refuse(
            gear,
            "cutter_teeth",
            f"a cutter of {cutter.teeth} teeth has no involute for the flank below {least * 1e3:.4f} mm; the "
            f"tip circle is at {gear.tip_radius * 1e3:.4f} mm",
            code="E-CUTTER",
            value=cutter.teeth,
            limit=f"tip radius >= {least * 1e3:.4f} mm",
            remedy="choose a cutter with more teeth or enlarge the tip diameter",
        )


def _check_flank(gear: Gear) -> None:
    """A tooth with a top land and a flank."""
    involute = inv(pressure_angle_at(gear.tip_radius, gear.base_radius))
    half = gear.base_half_angle + (involute if gear.internal else -involute)
    if half <= 0.0:
        _refuse(
            gear,
            "profile_shift",
            f"the tooth is pointed below its tip circle: thickness {2e3 * half * gear.tip_radius:.4f} mm at "
            f"the tip radius {gear.tip_radius * 1e3:.4f} mm",
            code="E-POINTED",
            value=gear.profile_shift,
            limit="tip thickness > 0",
            remedy="change the profile shift or give a tip_diameter that cuts the point off",
        )
    sign = -1.0 if gear.internal else 1.0
    if not sign * (gear.tip_roll - gear.form_roll) > 0.0:
        _refuse(
            gear,
            "tip_diameter",
            f"no involute is left between the fillet (radius {gear.form_radius * 1e3:.4f} mm) and the tip "
            f"(radius {gear.tip_radius * 1e3:.4f} mm)",
            code="E-TIP",
            value=2.0 * gear.tip_radius,
            limit=f"tip radius {'<' if gear.internal else '>'} {gear.form_radius * 1e3:.4f} mm",
            remedy="correct the tip or root diameter, the dedendum or the profile shift",
        )
