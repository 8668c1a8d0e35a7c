"""What a spur gear is: its data, its tools and its circles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from femgear.gears.fillet import (
    ISO_53_C,
    BasicRack,
    CutterTip,
    PinionCutter,
    RackTip,
    fillet_point,
    generating_tool,
    junction_roll,
    undercut_end,
)
from femgear.gears.involute import inv, pressure_angle_at, roll
from femgear.gears.limits import check_gear

__all__ = [
    "BasicRack",
    "Gear",
    "PinionCutter",
    "flank_points",
    "half_thickness_angle",
    "roll_length",
    "tooth_thickness",
    "working_half_angles",
]


@dataclass(frozen=True)
class Gear:
    """An involute spur gear, external or internal.

    Parameters
    ----------
    teeth : int
        Positive also for an internal gear.
    module, pressure_angle : float
        Module [m] and pressure angle [rad] of the tool.
    profile_shift : float
        In modules; positive moves the flank to larger radii, for internal gears too (ISO 21771 prints the
        opposite sign there).
    face_width : float
        [m]
    rim_radius : float
        Bore radius of an external, outer radius of an internal gear [m].
    internal : bool
    rack : BasicRack
    cutter : PinionCutter, optional
        For internal gears; None takes the cutter of `fillet.default_cutter`.
    tip_diameter, root_diameter : float, optional
        [m]; None takes ``m (z +- 2 (h + x))`` of the basic rack.
    thickness_allowance : float
        Reduction of the tooth thickness at the reference circle [m], >= 0; root and tip circles stay.
    name : str
        Used in messages only ("sun", "planet", "ring").

    Raises
    ------
    GeometryError
        A value that no gear can have (E-TEETH, E-MODULE, E-PRESSURE-ANGLE, E-SHIFT, E-FACE-WIDTH, E-RIM,
        E-ALLOWANCE, E-RACK, E-ROOT-RADIUS, E-CUTTER, E-TIP, E-POINTED).
    """

    teeth: int
    module: float
    pressure_angle: float
    profile_shift: float
    face_width: float
    rim_radius: float
    internal: bool = False
    rack: BasicRack = ISO_53_C
    cutter: PinionCutter | None = None
    tip_diameter: float | None = None
    root_diameter: float | None = None
    thickness_allowance: float = 0.0
    name: str = field(default="gear", compare=False)

    def __post_init__(self):
        check_gear(self)

    @property
    def reference_radius(self) -> float:
        """``m z / 2`` [m]."""
        return 0.5 * self.module * self.teeth

    @property
    def base_radius(self) -> float:
        """``m z cos(alpha) / 2`` [m]."""
        return self.reference_radius * math.cos(self.pressure_angle)

    @property
    def tip_radius(self) -> float:
        """Tip circle [m], the inner one of an internal gear."""
        if self.tip_diameter is not None:
            return 0.5 * self.tip_diameter
        sign = -1.0 if self.internal else 1.0
        return self.reference_radius + self.module * (sign * self.rack.addendum + self.profile_shift)

    @property
    def root_radius(self) -> float:
        """Root circle [m], the outer one of an internal gear."""
        if self.root_diameter is not None:
            return 0.5 * self.root_diameter
        sign = 1.0 if self.internal else -1.0
        return self.reference_radius + self.module * (sign * self.rack.dedendum + self.profile_shift)

    @property
    def pitch_angle(self) -> float:
        """Angle between neighbouring teeth [rad]."""
        return 2.0 * math.pi / self.teeth

    @property
    def base_pitch(self) -> float:
        """Pitch along the line of action, ``pi m cos(alpha)`` [m]."""
        return math.pi * self.module * math.cos(self.pressure_angle)

    @property
    def base_half_angle(self) -> float:
        """Half-thickness angle of the tooth at its base circle [rad] (ISO 21771, eq. 42)."""
        sign = -1.0 if self.internal else 1.0
        shift = 2.0 * self.profile_shift * math.tan(self.pressure_angle) / self.teeth
        thinner = 0.5 * self.thickness_allowance / self.reference_radius
        return 0.5 * math.pi / self.teeth + sign * (shift + inv(self.pressure_angle)) - thinner

    @cached_property
    def tool(self) -> RackTip | CutterTip:
        """Rounded tip of the generating tool, matched to this flank and root circle."""
        return generating_tool(self)

    @cached_property
    def fillet_end(self) -> float:
        """Parameter ``theta`` [rad] of `fillet.fillet_point` where fillet and involute meet."""
        if self.undercut:
            return undercut_end(self.tool, self.base_radius, self.base_half_angle)
        return self.tool.end_angle

    @cached_property
    def form_roll(self) -> float:
        """Roll length [m] of the flank's end at the fillet."""
        if self.undercut:
            radius, _ = fillet_point(self.tool, self.fillet_end)
            return roll(radius, self.base_radius)
        return junction_roll(self.tool, self.base_radius)

    @property
    def form_radius(self) -> float:
        """Radius [m] where the true involute ends and the fillet begins."""
        return math.hypot(self.base_radius, self.form_roll)

    @property
    def tip_roll(self) -> float:
        """Roll length [m] of the flank's end at the tip circle."""
        return roll(self.tip_radius, self.base_radius)

    @property
    def undercut(self) -> bool:
        """Whether the rack cuts away part of the involute (external gears only)."""
        return not self.internal and junction_roll(self.tool, self.base_radius) < 0.0

    @property
    def undercut_shift(self) -> float:
        """Least profile shift [modules] at which this gear's own tool would not undercut it."""
        sine = math.sin(self.pressure_angle)
        rounding = self.rack.root_radius * (1.0 - sine)
        root = (self.reference_radius - self.root_radius) / self.module + self.profile_shift
        return root - rounding - 0.5 * self.teeth * sine**2


def half_thickness_angle(gear: Gear, radius):
    """Angle [rad] between tooth centreline and flank at a radius [m] (float or array).

    External ``eta_b - inv(alpha_r)``, internal ``eta_b + inv(alpha_r)``, ``cos(alpha_r) = r_b / r``
    (ISO 21771, eq. 42); ``radius`` must lie on the involute, at or outside the base circle.
    """
    involute = inv(pressure_angle_at(radius, gear.base_radius))
    return gear.base_half_angle + involute if gear.internal else gear.base_half_angle - involute


def tooth_thickness(gear: Gear, radius):
    """Arc [m] of the tooth at a radius [m] (float or array), ``2 r eta(r)``."""
    return 2.0 * radius * half_thickness_angle(gear, radius)


def roll_length(gear: Gear, radius):
    """Roll length ``sqrt(r^2 - r_b^2)`` [m] of flank points at a radius [m] (float or array)."""
    return roll(radius, gear.base_radius)


def working_half_angles(one: Gear, two: Gear, angle: float) -> tuple[float, float]:
    """Half-thickness angles [rad] of two gears on their working pitch circles, ``r_w = r_b / cos(angle)``."""
    cosine = math.cos(angle)
    return (
        float(half_thickness_angle(one, one.base_radius / cosine)),
        float(half_thickness_angle(two, two.base_radius / cosine)),
    )


def flank_points(gear: Gear, roll_lengths) -> np.ndarray:
    """Points (n, 2) [m] of the left flank (y > 0, tooth on the x axis) at roll lengths (n,) [m]."""
    s = np.asarray(roll_lengths, dtype=float)
    radius = np.hypot(gear.base_radius, s)
    involute = inv(np.arctan2(s, gear.base_radius))
    angle = gear.base_half_angle + (involute if gear.internal else -involute)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
