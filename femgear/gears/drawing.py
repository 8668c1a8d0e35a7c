"""What a drawing of a gear carries: tooth thickness, chord, span, dimension over balls; and the play of a mesh.

Gears are those of the transverse section; ``helix`` is the helix angle at the reference circle [rad], of either sign, 0
of spur teeth. All measures are told by the half-thickness angle eta_b of a tooth at the base circle, and lead back to
it: from a measure follow the profile shift, or what a tooth is thinner than its profile shift has it. Formulas are
those of ISO 21771 and DIN 3960 (DIN 21773); of a ball in a gap only the normals of the flanks count, which touch the
base cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, half_thickness_angle
from femgear.gears.pair import GearPair
from femgear.gears.profile import arcinv, base_helix_angle, inv, pressure_angle_at, roll

BALL_STEPS = (0.25e-3, 0.05e-3, 0.01e-3)
"""Ball diameters that are chosen are multiples of the first of these that suits the gear [m]."""
_LARGEST_ANGLE = math.radians(85.0)
"""Pressure angle at the centre of a ball up to which balls are looked for."""
_ROOM = 1e-12
"""Part of a radius by which a measure may miss the end of the flank."""


@dataclass(frozen=True)
class MeshPlay:
    """Play of a mesh.

    Parameters
    ----------
    normal : float
        j_bn, along the normal of the flanks, which a feeler gauge measures [m].
    circumferential : float
        j_wt, the arc of the working pitch circle [m].
    radial : float
        j_r, what the centre distance may shrink [m].
    """

    normal: float
    circumferential: float
    radial: float


def base_helix(gear: Gear, helix: float) -> float:
    """Compute the helix angle on the base cylinder [rad], without its sign."""
    normal = math.atan(math.tan(gear.pressure_angle) * math.cos(helix))
    return base_helix_angle(normal, abs(helix))


def normal_thickness(gear: Gear, helix: float = 0.0) -> float:
    """Compute the tooth thickness s_n, the arc of the reference circle in the normal section [m]."""
    half = float(half_thickness_angle(gear, gear.reference_radius))
    return 2.0 * gear.reference_radius * half * math.cos(helix)


def chord(gear: Gear, helix: float = 0.0) -> tuple[float, float]:
    """Compute the chordal tooth thickness at the reference circle and its height under the tip [m].

    ``s_c = d_n sin(s_n/d_n)``, ``h_c = h_a +- d_n/2 (1 - cos(s_n/d_n))`` with the diameter ``d_n = d/cos^2(beta)`` of
    the circle that osculates the ellipse of the normal section (DIN 3960, section 4.4); minus of internal gears.
    """
    diameter = 2.0 * gear.reference_radius / math.cos(helix) ** 2
    angle = normal_thickness(gear, helix) / diameter
    rise = 0.5 * diameter * (1.0 - math.cos(angle)) * (-1.0 if gear.internal else 1.0)
    return diameter * math.sin(angle), abs(gear.tip_radius - gear.reference_radius) + rise


def span(gear: Gear, teeth: int, helix: float = 0.0) -> float:
    """Compute the span W_k over so many teeth [m], ``((k - 1) p_bt + s_bt) cos(beta_b)`` (ISO 21771)."""
    transverse = (teeth - 1) * gear.base_pitch + 2.0 * gear.base_radius * gear.base_half_angle
    return transverse * math.cos(base_helix(gear, helix))


def half_angle_of_span(gear: Gear, teeth: int, length: float, helix: float = 0.0) -> float:
    """Find the half-thickness angle at the base circle [rad] of teeth with a span [m], inverse of `span`."""
    transverse = length / math.cos(base_helix(gear, helix))
    return 0.5 * (transverse - (teeth - 1) * gear.base_pitch) / gear.base_radius


def span_radius(gear: Gear, teeth: int, helix: float = 0.0) -> float:
    """Compute the radius [m] on which measuring planes touch the flanks, ``2 r = sqrt(d_b^2 + (W_k cos beta_b)^2)``."""
    return math.hypot(gear.base_radius, 0.5 * span(gear, teeth, helix) * math.cos(base_helix(gear, helix)))


def span_teeth_range(gear: Gear, helix: float = 0.0) -> tuple[int, int] | None:
    """Find the fewest and the most teeth whose span touches the flanks; None of gears that have no span.

    The planes touch between the end of the fillet and the tip. Of helical teeth the face holds both ends of the line
    between the flanks, ``b >= W_k sin(beta_b)``.
    """
    if gear.internal:
        return None
    low, high = gear.form_radius * (1.0 - _ROOM), gear.tip_radius * (1.0 + _ROOM)
    sine = math.sin(base_helix(gear, helix))
    counts = [
        teeth
        for teeth in range(1, gear.teeth // 2 + 1)
        if low <= span_radius(gear, teeth, helix) <= high and span(gear, teeth, helix) * sine <= gear.face_width
    ]
    return (counts[0], counts[-1]) if counts else None


def usual_span_teeth(gear: Gear, helix: float = 0.0) -> int | None:
    """Choose the teeth k whose span touches nearest to the circle ``d + 2 x m``; None where no span can be measured."""
    counts = span_teeth_range(gear, helix)
    if counts is None:
        return None
    middle = _middle_radius(gear)
    return min(range(counts[0], counts[1] + 1), key=lambda teeth: abs(span_radius(gear, teeth, helix) - middle))


def check_span(gear: Gear, teeth: int, helix: float = 0.0) -> None:
    """Refuse a span that cannot be measured: of an internal gear (E-CHOICE), over teeth out of range (E-RANGE)."""
    if gear.internal:
        raise GeometryError(
            f"{gear.name}: an internal gear has no span that two planes could measure",
            code="E-CHOICE",
            key=f"{gear.name}.span",
            limit="over_balls with ball_diameter, or tooth_thickness",
            remedy="give over_balls, which is measured between balls",
        )
    counts = span_teeth_range(gear, helix)
    if counts is None or not counts[0] <= teeth <= counts[1]:
        raise GeometryError(
            f"{gear.name}: planes around {teeth} teeth touch no flanks: they would at the radius "
            f"{1e3 * span_radius(gear, teeth, helix):.4f} mm, the involute goes from {1e3 * gear.form_radius:.4f} mm "
            f"to {1e3 * gear.tip_radius:.4f} mm" + (f", face width {1e3 * gear.face_width:.6g} mm" if helix else ""),
            code="E-RANGE",
            key=f"{gear.name}.span_teeth",
            value=teeth,
            limit=None if counts is None else f"{counts[0]} to {counts[1]}",
            remedy="check span and span_teeth, or give over_balls with ball_diameter"
            if counts is None
            else "take that many teeth",
        )


def over_balls(gear: Gear, ball: float, helix: float = 0.0) -> float:
    """Compute the dimension M_dK over two balls of a diameter [m], of internal gears between them.

    ``d_K +- D_M``, with an odd number of teeth ``d_K cos(pi/(2z)) +- D_M`` (ISO 21771; DIN 3960, section 4.6).
    """
    centre = 2.0 * gear.base_radius / math.cos(ball_angle(gear, ball, helix))
    across = math.cos(0.5 * math.pi / gear.teeth) if gear.teeth % 2 else 1.0
    return centre * across + (-ball if gear.internal else ball)


def over_pins(gear: Gear, pin: float, helix: float = 0.0) -> float:
    """Compute the dimension over two pins [m], which reach along the teeth; spur teeth measure as over balls.

    Pins of an odd number of helical external teeth lie opposite one another where they are measured: ``d_K + D_M``.
    """
    if not helix or gear.internal:
        return over_balls(gear, pin, helix)
    return 2.0 * gear.base_radius / math.cos(ball_angle(gear, pin, helix)) + pin


def ball_angle(gear: Gear, ball: float, helix: float = 0.0) -> float:
    """Compute the transverse pressure angle alpha_Kt [rad] on the circle of the centre of a ball in a gap.

    External ``inv(alpha_Kt) = D_M/(d_b cos(beta_b)) + eta_b - pi/z``, internal the other sign on the right (ISO 21771).

    Raises
    ------
    GeometryError
        Such a ball finds no place between the flanks (E-RANGE).
    """
    involute = _ball_involute(gear, ball, helix)
    if involute < 0.0:
        raise _ball_fault(gear, ball, helix, "small" if not gear.internal else "large")
    return float(arcinv(involute))


def half_angle_of_balls(gear: Gear, ball: float, dimension: float, helix: float = 0.0) -> float:
    """Find the half-thickness angle at the base circle [rad] of a dimension over balls [m], inverse of `over_balls`.

    Raises
    ------
    GeometryError
        The balls would lie inside the base circle (E-RANGE).
    """
    across = math.cos(0.5 * math.pi / gear.teeth) if gear.teeth % 2 else 1.0
    radius = 0.5 * (dimension + (ball if gear.internal else -ball)) / across
    if radius < gear.base_radius:
        least = 2.0 * gear.base_radius * across + (-ball if gear.internal else ball)
        raise GeometryError(
            f"{gear.name}: balls of {1e3 * ball:.6g} mm at this dimension lie inside the base circle",
            code="E-RANGE",
            key=f"{gear.name}.over_balls",
            value=dimension,
            limit=f"above {1e3 * least:.4f} mm",
            remedy="check the dimension, the ball diameter and their units",
        )
    angle = float(inv(pressure_angle_at(radius, gear.base_radius)))
    half_gap = 0.5 * ball / (gear.base_radius * math.cos(base_helix(gear, helix)))
    return math.pi / gear.teeth - half_gap + (-angle if gear.internal else angle)


def ball_contact_radius(gear: Gear, ball: float, helix: float = 0.0) -> float:
    """Compute the radius [m] on which a ball touches the flanks."""
    return math.hypot(gear.base_radius, _contact_roll(gear, ball_angle(gear, ball, helix), helix))


def ball_range(gear: Gear, helix: float = 0.0) -> tuple[float, float] | None:
    """Find the smallest and the largest ball [m] that touches both flanks of a gap and can be measured, if any."""
    faults, of_ends = _ball_faults(gear, helix), []
    for size in ("small", "large"):
        below, above = 0.0, _LARGEST_ANGLE
        for _ in range(60):
            middle = 0.5 * (below + above)
            # balls grow with the angle of their centre in external, and shrink in internal gears
            wrong = faults(middle) == size
            towards_ends = wrong == ((size == "small") != gear.internal)
            below, above = (middle, above) if towards_ends else (below, middle)
        of_ends.append(above if (size == "small") != gear.internal else below)
    low, high = (_ball_at(gear, angle, helix) for angle in of_ends)
    return (low, high) if 0.0 < low < high else None


@lru_cache(maxsize=64)
def usual_ball(gear: Gear, helix: float = 0.0) -> float | None:
    """Choose a ball [m] that touches near the circle ``d + 2 x m``, in steps; None where none can be measured."""
    ends = ball_range(gear, helix)
    if ends is None:
        return None
    wanted, below, above = roll(_middle_radius(gear), gear.base_radius), 0.0, _LARGEST_ANGLE
    for _ in range(60):
        middle = 0.5 * (below + above)
        below, above = (middle, above) if _contact_roll(gear, middle, helix) < wanted else (below, middle)
    touching = min(max(_ball_at(gear, below, helix), ends[0]), ends[1])
    for step in BALL_STEPS:
        ball = round(round(touching / step) * step, 9)
        if ends[0] <= ball <= ends[1]:
            return ball
    return touching


def check_ball(gear: Gear, ball: float, helix: float = 0.0) -> None:
    """Refuse a ball that touches the root, lies below the tips or falls out of the gap (E-RANGE)."""
    if size := _ball_faults(gear, helix)(ball_angle(gear, ball, helix)):
        raise _ball_fault(gear, ball, helix, size)


def shift_of_half_angle(gear: Gear, half_angle: float) -> float:
    """Find the profile shift [modules] of a gear whose half-thickness angle at the base circle [rad] is given.

    Its thickness allowance stays.
    """
    sign = -1.0 if gear.internal else 1.0
    thinner = 0.5 * gear.thickness_allowance / gear.reference_radius
    rest = half_angle + thinner - 0.5 * math.pi / gear.teeth
    return (sign * rest - inv(gear.pressure_angle)) * 0.5 * gear.teeth / math.tan(gear.pressure_angle)


def allowance_of_half_angle(gear: Gear, half_angle: float) -> float:
    """Find what the teeth of a gear are thinner than its profile shift has them [m], see `Gear.thickness_allowance`."""
    nominal = gear.base_half_angle + 0.5 * gear.thickness_allowance / gear.reference_radius
    return 2.0 * gear.reference_radius * (nominal - half_angle)


def half_angle_of_thickness(gear: Gear, thickness: float, helix: float = 0.0) -> float:
    """Find the half-thickness angle at the base circle [rad] of a thickness s_n [m], inverse of `normal_thickness`."""
    involute = inv(gear.pressure_angle)
    half = 0.5 * thickness / (gear.reference_radius * math.cos(helix))
    return half - involute if gear.internal else half + involute


def gear_at_allowance(gear: Gear, allowance: float, helix: float = 0.0) -> Gear:
    """Make a gear, unchecked, whose teeth have an allowance in the normal section [m], negative where thinner."""
    return replace(gear, thickness_allowance=-allowance / math.cos(helix), tip_open=True)


def mesh_play(pair: GearPair, helix: float = 0.0) -> MeshPlay:
    """Compute the play of two gears: ``j_wt = j_bn/(cos(alpha_wt) cos(beta_b))``, ``j_r = j_wt/(2 tan(alpha_wt))``."""
    working, along_path = pair.working_pressure_angle, pair.backlash
    arc = along_path / math.cos(working)
    return MeshPlay(along_path * math.cos(base_helix(pair.gear_1, helix)), arc, 0.5 * arc / math.tan(working))


def _middle_radius(gear: Gear) -> float:
    """Radius ``r + x m`` [m], within the flank."""
    low, high = sorted((gear.form_radius, gear.tip_radius))
    return min(max(gear.reference_radius + gear.profile_shift * gear.module, low), high)


def _ball_involute(gear: Gear, ball: float, helix: float) -> float:
    """Involute of the pressure angle at the centre of a ball; negative where there is none."""
    half_gap = math.pi / gear.teeth - gear.base_half_angle
    half_ball = 0.5 * ball / (gear.base_radius * math.cos(base_helix(gear, helix)))
    return half_gap - half_ball if gear.internal else half_ball - half_gap


def _ball_at(gear: Gear, angle: float, helix: float) -> float:
    """Diameter [m] of the ball whose centre lies at a pressure angle [rad], inverse of `ball_angle`."""
    half_gap, involute = math.pi / gear.teeth - gear.base_half_angle, math.tan(angle) - angle
    half_ball = half_gap - involute if gear.internal else half_gap + involute
    return 2.0 * half_ball * gear.base_radius * math.cos(base_helix(gear, helix))


def _contact_roll(gear: Gear, angle: float, helix: float) -> float:
    """Roll length [m] where the ball touches whose centre lies at a pressure angle [rad]."""
    reach = 0.5 * _ball_at(gear, angle, helix) * math.cos(base_helix(gear, helix))
    return gear.base_radius * math.tan(angle) + (reach if gear.internal else -reach)


def _ball_faults(gear: Gear, helix: float) -> Callable[[float], str]:
    """Make the function that tells of the ball with its centre at a pressure angle [rad] what is wrong.

    It is too ``"small"``, and sinks in, or too ``"large"``, and falls out; empty where it fits.
    """
    sign, slack = -1.0 if gear.internal else 1.0, _ROOM * gear.base_radius
    tip, form = gear.tip_roll, gear.form_roll

    def fault(angle: float) -> str:
        ball, touching = _ball_at(gear, angle, helix), _contact_roll(gear, angle, helix)
        if sign * (touching - tip) > slack:
            return "large"
        centre = gear.base_radius / math.cos(angle)
        sunk = sign * (touching - form) < -slack
        at_root = sign * (centre - gear.root_radius) < 0.5 * ball
        below_tip = sign * (gear.tip_radius - centre) > 0.5 * ball
        return "small" if sunk or at_root or below_tip else ""

    return fault


def _ball_fault(gear: Gear, ball: float, helix: float, size: str) -> GeometryError:
    """Make the refusal of a ball that is too small or too large."""
    ends = ball_range(gear, helix)
    what = "touches the root, or lies below the tips or beside the involute" if size == "small" else "falls out"
    low, high = (None, None) if ends is None else (math.ceil(1e6 * ends[0]), math.floor(1e6 * ends[1]))
    return GeometryError(
        f"{gear.name}: a ball of {1e3 * ball:.6g} mm is too {size} for its gaps: it {what}",
        code="E-RANGE",
        key=f"{gear.name}.ball_diameter",
        value=ball,
        limit=None if low is None or high is None else f"{1e-3 * low:.3f} to {1e-3 * high:.3f} mm",
        remedy="check ball_diameter and over_balls, or give tooth_thickness"
        if ends is None
        else "take a ball of that size",
    )
