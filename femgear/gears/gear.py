"""What a spur gear is: its data, its circles, the tools that cut it, and the numbers that no gear can have.

A gear is checked before anything is computed with it; the tool is matched to its flank and root circle.
"""

from __future__ import annotations

import math
import operator
import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from numbers import Integral
from typing import Any

import numpy as np

from femgear.errors import GeometryError
from femgear.findings import Finding
from femgear.gears.profile import (
    ISO_53_C,
    BasicRack,
    CutterTip,
    PinionCutter,
    RackTip,
    arcinv,
    cutter_rounding,
    inv,
    pressure_angle_at,
    roll,
)

TEETH_RANGE = (5, 5000)
MODULE_RANGE = (0.05e-3, 0.1)
PRESSURE_ANGLE_RANGE = (math.radians(5.0), math.radians(45.0))
CUTTER_RANGE = 20
"""Teeth that a pinion cutter may have more or fewer than the usual one, where that cannot make the gear."""
CUTTER_SHIFTS = (0.0, -0.5)
"""Profile shifts of new and worn pinion cutters that are tried in this order [modules]."""
ROOM_TOLERANCE = 1e-12
"""Part of a module, or angle [rad], by which the rounding of a tool may be too large for it."""
USUAL_LAND = 0.2
"""Tooth thickness at the tip [modules] below which there is a warning."""


@dataclass(frozen=True)
class GeometryWarning(Finding):
    """A finding on gears, with the ``limit`` within which there would be no warning."""

    limit: str = ""


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
        Whether the teeth point inwards, as those of a ring.
    rack : BasicRack
        Basic rack of the tool; its heights are in modules.
    cutter : PinionCutter, optional
        For internal gears; None takes the cutter of `cutter_of`.
    tip_diameter, root_diameter : float, optional
        [m]; None takes ``m (z +- 2 (h + x))`` of the basic rack, the tip less its shortening.
    thickness_allowance : float
        Reduction of the tooth thickness at the reference circle [m], >= 0; root and tip circles stay.
    name : str
        Used in messages only ("sun", "planet", "ring").
    tip_shortening : float
        What the tooth is shorter than that of the basic rack [m], where no tip diameter is given.
    tip_open : bool
        Whether the tip is still to be found with the mates, see `femgear.gears.tips.settled_tips`: what
        depends on it is checked once it is settled.

    Raises
    ------
    GeometryError
        A value that no gear can have (E-TEETH, E-GEOMETRY, E-SHIFT, E-RIM,
        E-ALLOWANCE, E-CUTTER, E-ROOT-RADIUS, E-TIP, E-POINTED).
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
    tip_shortening: float = 0.0
    tip_open: bool = field(default=False, repr=False)

    def __post_init__(self):
        _check_numbers(self)
        if self.tip_open:
            return
        _check_circles(self)
        if faults := [*_tool_faults(self), *_flank_faults(self)]:
            raise combined_fault(faults)

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
        addendum = self.module * self.rack.addendum - self.tip_shortening
        return self.reference_radius + sign * addendum + self.module * self.profile_shift

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
        return _generating_tool(self)

    @cached_property
    def found_cutter(self) -> PinionCutter:
        """Cutter of an internal gear that gives none, see `cutter_of`."""
        return _suitable_cutter(self) or usual_cutter(self)

    @cached_property
    def fillet_end(self) -> float:
        """Direction ``theta`` [rad], see `CutterTip.fillet_point`, where fillet and involute meet."""
        if self.undercut and isinstance(self.tool, RackTip):
            return self.tool.undercut_end(self.base_radius, self.base_half_angle)
        return self.tool.end_angle

    @cached_property
    def form_roll(self) -> float:
        """Roll length [m] of the flank's end at the fillet."""
        if self.undercut:
            return roll(self.tool.fillet_point(self.fillet_end)[0], self.base_radius)
        return self.tool.junction_roll

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
        return not self.internal and self.tool.junction_roll < 0.0

    @property
    def undercut_shift(self) -> float:
        """Least profile shift [modules] at which this gear's own tool would not undercut it."""
        sine = math.sin(self.pressure_angle)
        # of the normal section, in which the rounding is a circle
        normal_sine = math.sin(math.atan(math.tan(self.pressure_angle) / self.rack.stretch))
        rounding = self.rack.root_radius * (1.0 - normal_sine)
        root = (self.reference_radius - self.root_radius) / self.module + self.profile_shift
        return root - rounding - 0.5 * self.teeth * sine**2


def half_thickness_angle(gear: Gear, radius):
    """Compute the angle [rad] between tooth centreline and flank at a radius [m] (float or array).

    External ``eta_b - inv(alpha_r)``, internal ``eta_b + inv(alpha_r)``, ``cos(alpha_r) = r_b / r``
    (ISO 21771, eq. 42); ``radius`` must lie on the involute, at or outside the base circle.
    """
    involute = inv(pressure_angle_at(radius, gear.base_radius))
    return gear.base_half_angle + involute if gear.internal else gear.base_half_angle - involute


def tooth_thickness(gear: Gear, radius):
    """Compute the arc (...) [m] of the tooth at radii (...) [m], ``2 r eta(r)``."""
    return 2.0 * radius * half_thickness_angle(gear, radius)


def largest_allowance(gear: Gear) -> float:
    """Compute the thickness allowance [m] at which the tooth would be pointed at its tip circle.

    The allowance is an arc of the reference circle: the tooth is thinner by the same angle at every radius.
    """
    return gear.thickness_allowance + 2.0 * gear.reference_radius * float(half_thickness_angle(gear, gear.tip_radius))


def working_half_angles(gear_1: Gear, gear_2: Gear, angle: float) -> tuple[float, float]:
    """Compute the half-thickness angles [rad] of two gears on their working pitch circles.

    The circles have the radii ``r_b / cos(angle)``, with the working pressure angle [rad].
    """
    cosine = math.cos(angle)
    return (
        float(half_thickness_angle(gear_1, gear_1.base_radius / cosine)),
        float(half_thickness_angle(gear_2, gear_2.base_radius / cosine)),
    )


def flank_points(gear: Gear, roll_lengths) -> np.ndarray:
    """Compute points (n, 2) [m] of the left flank (y > 0, tooth on the x axis) at roll lengths (n,) [m]."""
    s = np.asarray(roll_lengths, dtype=float)
    radius = np.hypot(gear.base_radius, s)
    involute = inv(np.arctan2(s, gear.base_radius))
    angle = gear.base_half_angle + (involute if gear.internal else -involute)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def cutter_of(gear: Gear) -> PinionCutter:
    """Choose the cutter of an internal gear: its own, else the usual one or the nearest that can make it."""
    return gear.cutter or gear.found_cutter


def usual_cutter(gear: Gear) -> PinionCutter:
    """Make the cutter that internal gears have by default: 30 unshifted teeth, or 12 fewer than the gear."""
    return PinionCutter(teeth=max(5, min(30, gear.teeth - 12)))


def _suitable_cutter(gear: Gear) -> PinionCutter | None:
    """Cutter that can make the gear, with the teeth nearest to those of the usual one.

    It is unshifted where any such cutter can, else a worn one, with a negative shift.
    """
    usual = usual_cutter(gear).teeth
    near = range(max(5, usual - CUTTER_RANGE), min(gear.teeth - 5, usual + CUTTER_RANGE) + 1)
    for shift in CUTTER_SHIFTS:
        for teeth in sorted(near, key=lambda z: (abs(z - usual), -z)):
            cutter = PinionCutter(teeth=teeth, profile_shift=shift)
            if any(_cutter_faults(gear, cutter)):
                continue
            if generating_cutter_tip(gear, cutter).room >= -ROOM_TOLERANCE:
                return cutter
    return None


def _generating_tool(gear: Gear, rounding: float | None = None) -> RackTip | CutterTip:
    """Tool tip that cuts flank and root circle of a gear; its rounding [modules] is by default the gear's."""
    return generating_cutter_tip(gear, cutter_of(gear), rounding) if gear.internal else _rack_tip(gear, rounding)


def _rack_tip(gear: Gear, rounding: float | None) -> RackTip:
    """Rack of ISO 53, thickened by the allowance and as deep as the root circle asks; lengths in m."""
    rounding = gear.module * (gear.rack.root_radius if rounding is None else rounding)
    reference = gear.reference_radius
    # depth of the rounding's centre under the tool's datum line
    depth = reference + gear.profile_shift * gear.module - gear.root_radius - rounding
    half_thickness = 0.25 * math.pi * gear.module + 0.5 * gear.thickness_allowance
    alpha, stretch = gear.pressure_angle, gear.rack.stretch
    normal_cosine = math.cos(math.atan(math.tan(alpha) / stretch))
    return RackTip(
        pitch_radius=reference,
        centre_depth=reference - gear.root_radius - rounding,
        centre_offset=half_thickness - depth * math.tan(alpha) - stretch * rounding / normal_cosine,
        rounding=rounding,
        gap_angle=math.pi / gear.teeth,
        end_angle=0.5 * math.pi - alpha,
        stretch=stretch,
    )


@lru_cache(maxsize=1024)
def _working_angle(involute: float) -> float:
    """Find the pressure angle [rad] of an involute [rad], kept: searches ask for the same ones again."""
    return arcinv(involute)


def generating_cutter_tip(
    gear: Any, cutter: PinionCutter, rounding: float | None = None, *, teeth: float | None = None
) -> CutterTip:
    """Make the tip of a pinion cutter [m] at the centre distance that leaves it no play in the finished gap.

    Its shift and that distance give the flank its thickness; its tip radius follows from the root circle.

    Parameters
    ----------
    gear : Gear
        Or the numbers of a virtual gear, whose teeth are no whole number, under the names of `Gear`.
    cutter : PinionCutter
        With the shift and the rounding that count.
    rounding : float, optional
        Of its tip [modules], in place of the cutter's or the rack's.
    teeth : float, optional
        Of the virtual cutter, in place of the cutter's.
    """
    teeth = cutter.teeth if teeth is None else teeth
    alpha, module = gear.pressure_angle, gear.module
    of_tool = gear.rack.root_radius if cutter.tip_radius is None else cutter.tip_radius
    rounding = float(module * (of_tool if rounding is None else rounding))
    tangent = math.tan(alpha)
    # a thinner tooth is a wider gap: the cutter is fed in as if the flank were shifted further out
    flank_shift = gear.profile_shift + 0.5 * gear.thickness_allowance / (module * tangent)
    shift = flank_shift - cutter.profile_shift
    working = _working_angle(inv(alpha) + 2.0 * tangent * shift / (gear.teeth - teeth))
    base = 0.5 * module * teeth * math.cos(alpha)
    pitch, cutter_pitch = gear.base_radius / math.cos(working), base / math.cos(working)
    centre_radius = gear.root_radius - (pitch - cutter_pitch) - rounding
    base_half = (0.5 * math.pi + 2.0 * cutter.profile_shift * tangent) / teeth + inv(alpha)
    stretch = gear.rack.stretch
    # where the rounding passes into the involute, whose normals touch the base circle
    _, cutter_roll, end = cutter_rounding(base, centre_radius, rounding, stretch)
    centre_angle = base_half - inv(math.atan2(float(cutter_roll), base)) - float(end)
    return CutterTip(
        pitch_radius=pitch,
        cutter_pitch_radius=cutter_pitch,
        cutter_base_radius=base,
        centre_distance=pitch - cutter_pitch,
        centre_radius=centre_radius,
        centre_angle=centre_angle,
        rounding=rounding,
        gap_angle=math.pi / gear.teeth,
        end_angle=0.5 * math.pi - working,
        stretch=stretch,
    )


def _check_numbers(gear: Gear) -> None:
    """Types and ranges of the plain entries."""
    unit_hint = "lengths are in m and angles in rad here: check the unit of the value"
    shift_hint = "profile shifts are in modules, not in mm"
    rack_hint = "ISO 53 profile C has addendum 1, dedendum 1.25 and root_radius 0.25"
    circle_hint = "leave it out to take that of the basic rack"
    limits = (
        ("teeth", "E-TEETH", *TEETH_RANGE, "", "larger gears would take hours: use fewer teeth"),
        ("module", "E-GEOMETRY", *MODULE_RANGE, " m", unit_hint),
        ("pressure_angle", "E-GEOMETRY", *PRESSURE_ANGLE_RANGE, " rad", unit_hint),
        ("profile_shift", "E-SHIFT", -5.0, 5.0, " modules", shift_hint),
        ("face_width", "E-GEOMETRY", 1e-6, 10.0, " m", unit_hint),
        ("rim_radius", "E-RIM", 1e-6, 1000.0, " m", unit_hint),
        ("thickness_allowance", "E-ALLOWANCE", 0.0, gear.module, " m", "an allowance thins the tooth"),
        ("rack.addendum", "E-CUTTER", 0.05, 3.0, " modules", rack_hint),
        ("rack.dedendum", "E-CUTTER", 0.05, 3.0, " modules", rack_hint),
        ("rack.root_radius", "E-CUTTER", 0.0, 3.0, " modules", rack_hint),
        ("tip_diameter", "E-TIP", 1e-6, 2000.0, " m", circle_hint),
        ("root_diameter", "E-TIP", 1e-6, 2000.0, " m", circle_hint),
        ("tip_shortening", "E-TIP", 0.0, 3.0 * gear.module, " m", circle_hint),
    )
    for entry, code, low, high, unit, remedy in limits:
        value = operator.attrgetter(entry)(gear)
        broken = entry == "teeth" and not is_whole(value)
        if value is None or (_within(value, low, high) and not broken):
            continue
        name = {"rim_radius": "outer_radius" if gear.internal else "bore_radius"}.get(entry, entry)
        limit = f"{low:.6g} .. {high:.6g}{unit}"
        message = f"{re.sub('[._]', ' ', name)} {value!r}{unit} is "
        message += f"no whole number in {limit}" if broken else f"outside {limit}"
        raise _fault(gear, name, message, code=code, value=value, limit=limit, remedy=remedy)
    object.__setattr__(gear, "teeth", operator.index(gear.teeth))


def is_whole(value) -> bool:
    """Whether a value is a whole number, and no truth value."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def _within(value, low: float, high: float) -> bool:
    """Whether a value is a number between two limits."""
    return isinstance(value, float | int | np.integer | np.floating) and bool(low <= value <= high)


def _check_circles(gear: Gear) -> None:
    """Order of the circles from the rim to the tip."""
    tip, root, rim = gear.tip_radius, gear.root_radius, gear.rim_radius
    sign = -1.0 if gear.internal else 1.0
    if not (sign * (tip - root) > 0.0 and tip > 0.0):
        raise _fault(
            gear,
            "tip_diameter",
            f"tip radius {tip * 1e3:.4f} mm and root radius {root * 1e3:.4f} mm leave no tooth",
            code="E-TIP",
            limit=f"tip diameter {'<' if gear.internal else '>'} {2e3 * root:.4f} mm",
            remedy="correct the tip or root diameter",
        )
    if not sign * (root - rim) > 0.0:
        raise _fault(
            gear,
            "outer_radius" if gear.internal else "bore_radius",
            f"the rim is {sign * (root - rim) * 1e3:.4f} mm thick: root radius {root * 1e3:.4f} mm, "
            f"{'outer' if gear.internal else 'bore'} radius {rim * 1e3:.4f} mm",
            code="E-RIM",
            limit=f"{'>' if gear.internal else '<'} {root * 1e3:.4f} mm",
            remedy="enlarge the outer radius" if gear.internal else "reduce the bore radius",
        )
    if not tip > gear.base_radius:
        raise _fault(
            gear,
            "tip_diameter",
            f"the tip circle (radius {tip * 1e3:.4f} mm) lies inside the base circle "
            f"({gear.base_radius * 1e3:.4f} mm), where there is no involute",
            code="E-TIP",
            limit=f"tip diameter > {2e3 * gear.base_radius:.4f} mm",
            remedy="give a larger tip_diameter, more teeth or a larger profile shift",
        )


def combined_fault(faults: Sequence[GeometryError]) -> GeometryError:
    """Make one refusal of all faults: code, key and values of the first, messages and remedies of all."""
    first, *others = faults
    if not others:
        return first
    also = "; ".join(f"[{fault.code}] {fault.message}" for fault in others)
    *ways, last = first.remedies or ("",)
    beside = dict.fromkeys(fault.remedy for fault in others if fault.remedy not in (None, first.remedy))
    return GeometryError(
        f"{first.message}; also {also}",
        code=first.code,
        key=first.key,
        value=first.value,
        limit=first.limit,
        remedy=(*ways, "; ".join(filter(None, (last, *beside)))),
        gear=first.gear,
    )


def _tool_faults(gear: Gear) -> Iterator[GeometryError]:
    """Faults of the tool: one that cannot make the flank, and no room for its rounding."""
    if gear.internal and (faults := list(_cutter_faults(gear, cutter_of(gear)))):
        yield from faults
        return
    # a length of the rack is taken in modules; an angle of the cutter is one already
    if gear.tool.room / (1.0 if gear.internal else gear.module) < -ROOM_TOLERANCE:
        largest, rounding = _largest_rounding(gear), round(gear.tool.rounding / gear.module, 9)
        yield _fault(
            gear,
            "rack.root_radius",
            f"a tool tip rounding of {rounding:.4f} modules does not fit between the flanks of the tool",
            code="E-ROOT-RADIUS",
            value=rounding,
            limit=f"<= {largest:.4f} modules" if largest > 0.0 else None,
            remedy="reduce root_radius" if largest > 0.0 else "reduce the dedendum: no root_radius fits",
        )


def _cutter_faults(gear: Gear, cutter: PinionCutter) -> Iterator[GeometryError]:
    """Faults of a pinion cutter."""
    if not (is_whole(cutter.teeth) and 5 <= cutter.teeth <= gear.teeth - 5):
        yield _fault(
            gear,
            "cutter_teeth",
            f"a cutter of {cutter.teeth!r} teeth cannot generate an internal gear of {gear.teeth} teeth",
            code="E-CUTTER",
            value=cutter.teeth,
            limit=f"whole number 5 .. {gear.teeth - 5}",
            remedy="choose a smaller cutter; 30 teeth, or 12 fewer than the gear, is the default",
        )
        return
    try:
        tool = generating_cutter_tip(gear, cutter)
    except GeometryError:
        yield _fault(
            gear,
            "profile_shift",
            f"a cutter of {cutter.teeth} teeth with shift {cutter.profile_shift:.4f} finds no working "
            f"pressure angle for a flank shifted by {gear.profile_shift:.4f}",
            code="E-CUTTER",
            limit="inv(alpha_w0) >= 0 between cutter and gear",
            remedy="increase the profile shift, or take a cutter with fewer teeth or a smaller shift",
        )
        return
    if not tool.centre_radius > tool.cutter_base_radius:
        yield _fault(
            gear,
            "cutter_teeth",
            f"the rounding of the cutter's tip is centred at {tool.centre_radius * 1e3:.4f} mm, inside the "
            f"cutter's base circle of {tool.cutter_base_radius * 1e3:.4f} mm",
            code="E-CUTTER",
            value=cutter.teeth,
            limit="tip radius - rounding > base radius of the cutter",
            remedy=f"{_better_cutter(gear)}, or give a smaller root_radius",
        )
    start = tool.centre_distance * math.cos(tool.end_angle)  # gear roll at the cutter's base tangent point
    if gear.tip_roll < start:
        least = math.hypot(gear.base_radius, start)
        yield _fault(
            gear,
            "cutter_teeth",
            f"a cutter of {cutter.teeth} teeth has no involute for the flank below {least * 1e3:.4f} mm; the "
            f"tip circle is at {gear.tip_radius * 1e3:.4f} mm",
            code="E-CUTTER",
            value=cutter.teeth,
            limit=f"tip radius >= {least * 1e3:.4f} mm",
            remedy=f"{_better_cutter(gear)}, or give a tip_diameter of {_up(2e3 * least)} mm or more",
        )


def _better_cutter(gear: Gear) -> str:
    """What to do about the teeth of a given cutter: the nearest number that would do."""
    if gear.cutter is not None and (other := _suitable_cutter(replace(gear, cutter=None, tip_open=True))):
        return f"choose a cutter with {other.teeth} teeth"
    return "choose a cutter with more teeth"


def _up(millimetres: float) -> str:
    """Length in mm with four decimals, rounded up so that it can be typed as it stands."""
    return f"{math.ceil(1e4 * millimetres) / 1e4:.4f}"


def _largest_rounding(gear: Gear) -> float:
    """Largest tool tip rounding [modules] that fits with the same root circle, rounded down to 1e-4."""
    first = bisect_left(range(30_001), True, key=lambda n: not _generating_tool(gear, n / 1e4).room >= 0.0)
    return max(first - 1, 0) / 1e4


def with_room(gear: Gear) -> Gear:
    """Reduce the rounding of a gear's tool to what has room between its flanks, where it has none."""
    if gear.tool.room / (1.0 if gear.internal else gear.module) >= -ROOM_TOLERANCE:
        return gear
    return replace(gear, rack=replace(gear.rack, root_radius=_largest_rounding(gear)))


def tip_radius_at_land(gear: Gear, land: float) -> float:
    """Find the tip radius [m] at which a tooth is ``land`` thick [m], by bisection.

    Teeth of external gears get thinner from the base circle outwards, those of internal gears from the root
    circle inwards; the end of that range stands where they are thinner even there.
    """
    thin, thick = gear.tip_radius, gear.root_radius if gear.internal else gear.base_radius
    if gear.internal:
        thin = max(thin, gear.base_radius)
    for _ in range(60):
        middle = 0.5 * (thin + thick)
        thin, thick = (middle, thick) if tooth_thickness(gear, middle) < land else (thin, middle)
    return thick


def _flank_faults(gear: Gear) -> Iterator[GeometryError]:
    """Faults of the tooth: no top land, no flank."""
    half = half_thickness_angle(gear, gear.tip_radius)
    if half <= 0.0:
        free = tip_radius_at_land(gear, USUAL_LAND * gear.module)
        word = "least" if gear.internal else "most"
        yield _fault(
            gear,
            "profile_shift",
            f"the tooth is pointed below its tip circle: thickness {2e3 * half * gear.tip_radius:.4f} mm at "
            f"the tip radius {gear.tip_radius * 1e3:.4f} mm",
            code="E-POINTED",
            limit="tip thickness > 0",
            remedy=f"change the profile shift or give a tip_diameter of at {word} {2e3 * free:.4f} mm, which "
            f"leaves {USUAL_LAND:g} modules at the tip",
        )
    if gear.internal and any(_cutter_faults(gear, cutter_of(gear))):
        return  # no tool, no fillet
    sign = -1.0 if gear.internal else 1.0
    if not sign * (gear.tip_roll - gear.form_roll) > 0.0:
        yield _fault(
            gear,
            "tip_diameter",
            f"no involute is left between the fillet (radius {gear.form_radius * 1e3:.4f} mm) and the tip "
            f"(radius {gear.tip_radius * 1e3:.4f} mm)",
            code="E-TIP",
            limit=f"tip radius {'<' if gear.internal else '>'} {gear.form_radius * 1e3:.4f} mm",
            remedy="correct the tip or root diameter, the dedendum or the profile shift",
        )


def _fault(
    gear: Gear, entry: str, message: str, *, code: str, value=None, limit: str | None, remedy: str
) -> GeometryError:
    """Make the refusal of a gear for an entry of the case, whose value is by default that of the gear."""
    if value is None:
        values = {"tip_diameter": 2.0 * gear.tip_radius, "profile_shift": gear.profile_shift}
        value = values.get(entry, gear.rim_radius)
    key = entry if entry.startswith("rack.") else f"{gear.name}.{entry}"
    return GeometryError(
        f"{gear.name}: {message}", code=code, key=key, value=value, limit=limit, remedy=remedy, gear=gear.name
    )
