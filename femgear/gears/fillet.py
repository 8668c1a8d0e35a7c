"""Root fillets as tools generate them: the envelope of the rounded tip of a rack or of a pinion cutter.

Both have one description. A circle of radius ``rounding`` is fixed in the tool; gear and tool roll on their
pitch circles. The circle touches its envelope where the common normal passes through the pitch point (law of
gearing), so the direction ``theta`` of that normal, measured from the line of centres, is a parameter of the
fillet: 0 at the root circle and ``end_angle`` where the tool's flank takes over.

Gear frame: tooth centreline on the x axis; the fillet is that of the left flank (y > 0), its gap is centred
at ``gap_angle``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.gears.involute import inv, pressure_angle_at, roll


@dataclass(frozen=True)
class BasicRack:
    """Basic rack in modules; the defaults are profile C of ISO 53 (1.25 deep, rounding 0.25).

    Parameters
    ----------
    addendum, dedendum, root_radius : float
        Tooth addendum, tooth dedendum and fillet radius of the basic rack, divided by the module.
    """

    addendum: float = 1.0
    dedendum: float = 1.25
    root_radius: float = 0.25


ISO_53_C = BasicRack()


@dataclass(frozen=True)
class PinionCutter:
    """Pinion cutter that generates the gaps of an internal gear.

    Parameters
    ----------
    teeth : int
    profile_shift : float
        Shift of the cutter in modules (0 when half worn).
    tip_radius : float, optional
        Rounding of the cutter's tips in modules; None takes the basic rack's ``root_radius``.
    """

    teeth: int
    profile_shift: float = 0.0
    tip_radius: float | None = None


@dataclass(frozen=True)
class RackTip:
    """Rounded tip of a rack that generates an external gear (lengths in m, angles in rad).

    ``centre_depth`` and ``centre_offset`` place the rounding's centre under the rolling line and beside the
    centreline of the rack tooth.
    """

    pitch_radius: float
    centre_depth: float
    centre_offset: float
    rounding: float
    gap_angle: float
    end_angle: float


@dataclass(frozen=True)
class CutterTip:
    """Rounded tip of a pinion cutter that generates an internal gear (lengths in m, angles in rad).

    ``centre_radius`` and ``centre_angle`` place the rounding's centre in the frame of the cutter tooth.
    """

    cutter_teeth: int
    pitch_radius: float
    cutter_pitch_radius: float
    cutter_base_radius: float
    cutter_tip_radius: float
    centre_distance: float
    centre_radius: float
    centre_angle: float
    rounding: float
    gap_angle: float
    end_angle: float


def default_cutter(teeth: int) -> PinionCutter:
    """Cutter used when none is named: 30 unshifted teeth, or 12 fewer than the gear's if that is less."""
    return PinionCutter(teeth=max(5, min(30, teeth - 12)))


def fillet_point(tool: RackTip | CutterTip, theta):
    """Radius [m] and angle [rad] in the gear frame of fillet points.

    Parameters
    ----------
    tool : RackTip or CutterTip
    theta : float or array
        Direction of the normal [rad], 0 at the root circle .. ``tool.end_angle`` at the flank.

    Returns
    -------
    radius, angle : arrays of the shape of ``theta``
        From the law of gearing (Litvin, Gear Geometry and Applied Theory, ch. 6).
    """
    theta = np.asarray(theta, dtype=float)
    if isinstance(tool, RackTip):
        # tool centreline at tangential travel s from the pitch point; the gear has turned by s / r
        lateral = -tool.centre_depth * np.tan(theta)
        travel = (lateral + tool.centre_offset) / tool.pitch_radius
        x = tool.pitch_radius - tool.centre_depth - tool.rounding * np.cos(theta)
        y = lateral - tool.rounding * np.sin(theta)
    else:
        r = tool.cutter_pitch_radius
        sine, cosine = np.sin(theta), np.cos(theta)
        reach = np.sqrt(tool.centre_radius**2 - (r * sine) ** 2) - r * cosine  # pitch point to centre
        cutter_angle = np.arctan2(-reach * sine, r + reach * cosine) + tool.centre_angle
        travel = cutter_angle * r / tool.pitch_radius
        x = tool.pitch_radius + (reach + tool.rounding) * cosine
        y = -(reach + tool.rounding) * sine
    return np.hypot(x, y), np.arctan2(y, x) + tool.gap_angle - travel


def junction_roll(tool: RackTip | CutterTip, base_radius: float) -> float:
    """Roll length [m] of the gear's involute where the tool's flank ends and its rounding begins.

    Negative for a rack that reaches below the base circle's tangent point: the tooth is undercut.
    """
    sine = math.cos(tool.end_angle)  # of the working pressure angle of generation
    if isinstance(tool, RackTip):
        return tool.pitch_radius * sine - tool.centre_depth / sine - tool.rounding
    cutter_roll = roll(tool.centre_radius, tool.cutter_base_radius) + tool.rounding
    return cutter_roll + tool.centre_distance * sine


def undercut_end(tool: RackTip, base_radius: float, base_half_angle: float) -> float:
    """Direction ``theta`` [rad] where the fillet of an undercut tooth crosses the involute.

    The crossing is bracketed on the part of the fillet outside the base circle and refined by bisection to
    the last bit.
    """

    def excess(theta):
        radius, angle = fillet_point(tool, theta)
        return angle - (base_half_angle - inv(pressure_angle_at(radius, base_radius)))

    theta = np.linspace(0.0, tool.end_angle, 4001)
    radius, _ = fillet_point(tool, theta)
    value = np.where(radius >= base_radius, excess(theta), -np.inf)
    first = int(np.argmax(value >= 0.0))
    low, high = theta[max(first - 1, 0)], theta[first]
    for _ in range(100):
        middle = 0.5 * (low + high)
        inside = float(fillet_point(tool, middle)[0]) < base_radius or float(excess(middle)) < 0.0
        low, high = (middle, high) if inside else (low, middle)
    return float(high)
