"""Refusals of a single gear: numbers that no gear can have, said before anything is computed with them."""

from __future__ import annotations

import math
import operator
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


def check_gear(gear: Gear) -> None:
    """Refuse a gear that cannot be made; see the errors of `gear.Gear`."""
    _check_numbers(gear)
    _check_rack(gear)
    _check_circles(gear)
    _check_tool(gear)
    _check_flank(gear)


def _refuse(gear: Gear, entry: str, message: str, *, code: str, value, limit: str, remedy: str):
    raise GeometryError(
        message, code=code, key=f"{gear.name}.{entry}", value=value, limit=limit, remedy=remedy
    )


def _check_numbers(gear: Gear) -> None:
    """Types and ranges of the plain entries."""
    if isinstance(gear.teeth, bool) or not isinstance(gear.teeth, int | np.integer):
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
    limits = (
        ("teeth", "E-TEETH", *TEETH_RANGE, ""),
        ("module", "E-MODULE", *MODULE_RANGE, " m"),
        ("pressure_angle", "E-PRESSURE-ANGLE", *PRESSURE_ANGLE_RANGE, " rad"),
        ("profile_shift", "E-SHIFT", -5.0, 5.0, " modules"),
        ("face_width", "E-FACE-WIDTH", 1e-6, 10.0, " m"),
        ("rim_radius", "E-RIM", 1e-6, 1000.0, " m"),
        ("thickness_allowance", "E-ALLOWANCE", 0.0, gear.module, " m"),
    )
    for entry, code, low, high, unit in limits:
        value = getattr(gear, entry)
        if not (math.isfinite(value) and low <= value <= high):
            _refuse(
                gear,
                entry,
                f"{entry.replace('_', ' ')} {value:.6g}{unit} is outside {low:.6g} .. {high:.6g}{unit}",
                code=code,
                value=value,
                limit=f"{low:.6g} .. {high:.6g}{unit}",
                remedy="inside femgear lengths are in m and angles in rad: check the unit of the value",
            )
    for entry in ("addendum", "dedendum", "root_radius"):
        value = getattr(gear.rack, entry)
        if not (
            math.isfinite(value) and (0.0 <= value if entry == "root_radius" else 0.0 < value) and value <= 3
        ):
            _refuse(
                gear,
                f"rack.{entry}",
                f"basic rack {entry.replace('_', ' ')} {value:.6g} modules",
                code="E-RACK",
                value=value,
                limit="0 .. 3 modules",
                remedy="ISO 53 profile C has 1.0, 1.25 and 0.25 modules",
            )


def _check_circles(gear: Gear) -> None:
    """Order of the circles from the rim to the tip."""
    tip, root, rim = gear.tip_radius, gear.root_radius, gear.rim_radius
    sign = -1.0 if gear.internal else 1.0
    if not sign * (tip - root) > 0.0 or not tip > 0.0:
        _refuse(
            gear,
            "tip_diameter",
            f"the tip radius {tip * 1e3:.4f} mm and the root radius {root * 1e3:.4f} mm leave no tooth",
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
    if gear.internal and not tip > gear.base_radius:
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
    tool = gear.tool
    offset = tool.centre_angle if gear.internal else tool.centre_offset / gear.module
    if offset < -1e-12:
        largest = _largest_rounding(gear)
        _refuse(
            gear,
            "rack.root_radius",
            f"a tool tip rounding of {tool.rounding / gear.module:.4f} modules does not fit between the flanks of "
            f"the tool; the largest is {largest:.4f}",
            code="E-ROOT-RADIUS",
            value=tool.rounding / gear.module,
            limit=f"<= {largest:.4f} modules",
            remedy="reduce root_radius (or the dedendum)",
        )


def _check_cutter(gear: Gear) -> None:
    cutter = cutter_of(gear)
    whole = isinstance(cutter.teeth, int | np.integer) and not isinstance(cutter.teeth, bool)
    if not whole or not 5 <= cutter.teeth <= gear.teeth - 5:
        _refuse(
            gear,
            "cutter_teeth",
            f"a cutter of {cutter.teeth!r} teeth cannot generate an internal gear of {gear.teeth} teeth",
            code="E-CUTTER",
            value=cutter.teeth,
            limit=f"whole number 5 .. {gear.teeth - 5}",
            remedy="choose a smaller cutter, about a third of the gear's teeth",
        )
    tool = gear.tool
    if not tool.centre_radius > tool.cutter_base_radius:
        _refuse(
            gear,
            "cutter_teeth",
            f"the rounding of the cutter's tip begins at {tool.centre_radius * 1e3:.4f} mm, inside the cutter's "
            f"base circle of {tool.cutter_base_radius * 1e3:.4f} mm",
            code="E-CUTTER",
            value=cutter.teeth,
            limit="tip radius - rounding > base radius of the cutter",
            remedy="choose a cutter with more teeth, or a smaller root_radius",
        )


def _largest_rounding(gear: Gear) -> float:
    """Largest tool tip rounding [modules] with the same root circle, by bisection."""
    cutter = cutter_of(gear) if gear.internal else None

    def room(value):
        common = {
            "teeth": gear.teeth,
            "module": gear.module,
            "pressure_angle": gear.pressure_angle,
            "profile_shift": gear.profile_shift,
            "root_radius": gear.root_radius,
            "allowance": gear.thickness_allowance,
            "rounding": value * gear.module,
        }
        if cutter is None:
            return rack_tip(**common).centre_offset
        tool = cutter_tip(cutter_teeth=cutter.teeth, cutter_shift=cutter.profile_shift, **common)
        return tool.centre_angle if tool.centre_radius > tool.cutter_base_radius else -1.0

    low, high = 0.0, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if room(middle) >= 0.0 else (low, middle)
    return low


def _check_flank(gear: Gear) -> None:
    """A tooth with a flank and a top land."""
    if gear.tip_radius > gear.base_radius:
        half = float(half_thickness_angle(gear, gear.tip_radius))
        if half <= 0.0:
            _refuse(
                gear,
                "profile_shift",
                f"the tooth is pointed below its tip circle: thickness {2e3 * half * gear.tip_radius:.4f} mm at the "
                f"tip radius {gear.tip_radius * 1e3:.4f} mm",
                code="E-POINTED",
                value=gear.profile_shift,
                limit="tip thickness > 0",
                remedy="reduce the profile shift or give a smaller tip_diameter",
            )
    sign = -1.0 if gear.internal else 1.0
    if not (gear.tip_radius > gear.base_radius and sign * (gear.tip_roll - gear.form_roll) > 0.0):
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
