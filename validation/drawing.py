"""What drawings carry: closed forms of textbooks, planes and balls on the generated profile, round trips."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import root, root_scalar

from femgear.gears.allowances import thickness_allowances
from femgear.gears.checks import tip_clearances
from femgear.gears.drawing import (
    ball_contact_radius,
    chord,
    gear_at_allowance,
    half_angle_of_balls,
    half_angle_of_span,
    half_angle_of_thickness,
    normal_thickness,
    over_balls,
    shift_of_half_angle,
    span,
    span_radius,
    usual_ball,
    usual_span_teeth,
)
from femgear.gears.gear import Gear, flank_points
from femgear.gears.pair import close_pair
from femgear.gears.profile import BasicRack, roll, transverse_rack, transverse_tool
from femgear.gears.tips import settled_tips
from validation.rows import Row, at_most, printed, within

ALPHA = math.radians(20.0)
HAND = "closed form of textbooks (Niemann and Winter, vol. 2; DIN 3960), evaluated by hand"
PROFILE = "points of the flanks that femgear generates, on a helix of their lead"
BACK = "from the measure back to the profile shift"
PROGRAM = "STplus report of a pair 51/52, as tests of a public program of gear geometry print it"
TIPS = "DIN 3960, by hand; a clearance of 0.25 modules"
FITS = "DIN 3967:1978, example of section 3.1 and rows of both tables as two public programs have them"
ROUNDING = 1e-12
TOUCHING = 1e-9
_SHAPES = ((24, 0.3, 0.0, False), (31, -0.2, 0.0, False), (23, 0.2, 20.0, False), (28, 0.4, 12.0, False))
_RINGS = ((80, 0.1, 0.0, True), (81, 0.0, 0.0, True), (72, -0.1, 15.0, True))


def drawn_gear(teeth: int, shift: float, degrees: float, internal: bool) -> tuple[Gear, float]:
    """Make a gear of a normal module of 3 mm, and its helix angle [rad]."""
    helix = math.radians(degrees)
    module, angle = transverse_tool(3e-3, ALPHA, helix)
    rim = 0.5 * module * teeth + (0.018 if internal else -0.018)
    rack = transverse_rack(BasicRack(), helix)
    return Gear(teeth, module, angle, shift * math.cos(helix), 0.04, rim, internal=internal, rack=rack), helix


def _flank_point(gear: Gear, helix: float, roll: float, place: float, turn: float) -> np.ndarray:
    """Point (3,) [m] of the left flank of a tooth turned by an angle [rad], at a roll length and a place in z [m]."""
    point = complex(*flank_points(gear, [roll])[0])
    point *= np.exp(1j * (turn + place * math.tan(helix) / gear.reference_radius))
    return np.array([point.real, point.imag, place])


def _slopes(function: Callable[[float, float], float], at: np.ndarray) -> list[float]:
    """Slopes of a function of two lengths [m] by central differences."""
    steps = 1e-7 * np.eye(2)
    return [(function(*(at + step)) - function(*(at - step))) / 2e-7 for step in steps]


def planes_on_the_profile(gear: Gear, teeth: int, helix: float) -> tuple[float, float]:
    """Measure the span over teeth [m] and the radius [m] on which its planes touch, without its formula.

    Half a turn about the x axis maps the flank of the first tooth on that of the last: the line between both that is
    normal to them joins a point with its image, and its length is stationary.
    """
    turn = 0.5 * (teeth - 1) * gear.pitch_angle

    def half(roll: float, place: float) -> float:
        return float(np.linalg.norm(_flank_point(gear, helix, roll, place, turn)[1:]))

    # in the transverse section first, where only the point furthest out counts
    ends = 0.5 * gear.form_roll, 1.25 * gear.tip_roll
    start = 1e3 * root_scalar(lambda roll: _slopes(half, np.array([roll, 0.0]))[0], bracket=ends).root
    stationary = root(lambda at: _slopes(half, 1e-3 * at), [start, 0.0], tol=1e-12)
    roll, place = 1e-3 * stationary.x
    return 2.0 * half(roll, place), math.hypot(gear.base_radius, roll)


def ball_between_flanks(gear: Gear, ball: float, helix: float) -> tuple[float, float]:
    """Measure the dimension over balls [m] and the radius [m] on which they touch, without its formula.

    The centre of the ball lies in the middle of a gap, half its diameter from the nearest point of a flank.
    """
    turn = -0.5 * gear.pitch_angle

    def distance(roll: float, place: float, centre: float) -> float:
        return float(np.linalg.norm(_flank_point(gear, helix, roll, place, turn) - [centre, 0.0, 0.0]))

    def missing(at: np.ndarray) -> list[float]:
        roll, place, centre = 1e-3 * at
        slopes = _slopes(lambda s, z: distance(s, z, centre), np.array([roll, place]))
        return [*slopes, 1e3 * (distance(roll, place, centre) - 0.5 * ball)]

    middle = gear.reference_radius + gear.module * gear.profile_shift
    outside = 0.3 * gear.module * (-1.0 if gear.internal else 1.0)
    start = [0.5 * (gear.form_roll + gear.tip_roll), 0.0, middle + outside]
    roll, _, centre = 1e-3 * root(missing, 1e3 * np.array(start), tol=1e-12).x
    across = abs(1.0 - np.exp(2j * math.pi * (gear.teeth // 2) / gear.teeth)) * centre
    return across + (-ball if gear.internal else ball), math.hypot(gear.base_radius, roll)


def textbook() -> tuple[Row, ...]:
    """Span, dimension over balls and chord of spur gears by their printed formulas."""
    rows, involute = [], math.tan(ALPHA) - ALPHA
    for teeth, shift, degrees, internal in (*_SHAPES[:2], *_RINGS[:2]):
        gear, _ = drawn_gear(teeth, shift, degrees, internal)
        case, sign = f"{'-' * internal}{teeth}, x {shift:g}", -1.0 if internal else 1.0
        if (k := usual_span_teeth(gear)) is not None:
            by_hand = 3.0 * math.cos(ALPHA) * ((k - 0.5) * math.pi + teeth * involute) + 6.0 * shift * math.sin(ALPHA)
            rows.append(within(case, HAND, f"W_{k} [mm]", by_hand, 1e3 * span(gear, k), ROUNDING))
        ball = usual_ball(gear) or 0.0
        half_gap = 0.5 * math.pi / teeth - 2.0 * shift * math.tan(ALPHA) / teeth * sign
        wanted = involute + sign * (1e3 * ball / (3.0 * teeth * math.cos(ALPHA)) - half_gap)
        angle = root_scalar(lambda a, wanted=wanted: math.tan(a) - a - wanted, bracket=(0.01, 1.4), xtol=1e-15).root
        across = 3.0 * teeth * math.cos(ALPHA) / math.cos(angle) * (math.cos(math.pi / 2 / teeth) if teeth % 2 else 1)
        reference = across + sign * 1e3 * ball
        quantity = f"M_dK, ball {1e3 * ball:g} mm [mm]"
        rows.append(within(case, HAND, quantity, reference, 1e3 * over_balls(gear, ball), ROUNDING))
        thickness = 3.0 * (0.5 * math.pi + 2.0 * sign * shift * math.tan(ALPHA))
        rows.append(within(case, HAND, "s [mm]", thickness, 1e3 * normal_thickness(gear), ROUNDING))
        chordal = 3.0 * teeth * math.sin(thickness / (3.0 * teeth))
        rows.append(within(case, HAND, "chord [mm]", chordal, 1e3 * chord(gear)[0], ROUNDING))
    return tuple(rows)


def another_program() -> tuple[Row, ...]:
    """Two gears of module 1 mm by a program of gear designers; their shifts follow from its printed spans."""
    rows = []
    for teeth, length, thickness, balls, allowance, of_span, of_balls in (
        (51, 17.090, "1.719", "53.846", -0.296, "50.788", "50.779"),
        (52, 17.180, "1.800", "55.064", -0.220, "51.728", "52.146"),
    ):
        plain = Gear(teeth, 1e-3, ALPHA, 0.0, 0.01, 0.01)
        gear = replace(plain, profile_shift=shift_of_half_angle(plain, half_angle_of_span(plain, 6, 1e-3 * length)))
        thin = gear_at_allowance(gear, 1e-3 * allowance)
        # three decimals of the span leave the thickness open by 0.5 um over cos(alpha), M_dK by 2.5 times 0.5 um
        for quantity, reference, value, digits in (
            ("s_n from W_6 [mm]", thickness, normal_thickness(gear), 2.1),
            ("M_dK from W_6, ball 1.75 mm [mm]", balls, over_balls(gear, 1.75e-3), 3.5),
            (f"diameter where W_6 touches, A_sn {1e3 * allowance:g} um [mm]", of_span, 2.0 * span_radius(thin, 6), 2.1),
            (
                f"diameter where the ball touches, A_sn {1e3 * allowance:g} um [mm]",
                of_balls,
                2.0 * ball_contact_radius(thin, 1.75e-3),
                3.5,
            ),
        ):
            rows.append(printed(f"{teeth}, m 1", PROGRAM, quantity, reference, 1e3 * value, digits=digits))
    return tuple(rows)


def helical_by_section() -> tuple[Row, ...]:
    """Span of helical teeth by both sections: ``m_n cos(a_n) ((k - 1/2) pi + z inv(a_t)) + 2 x m_n sin(a_n)``."""
    rows = []
    for teeth, shift, degrees, internal in _SHAPES[2:]:
        gear, helix = drawn_gear(teeth, shift, degrees, internal)
        transverse, k = math.atan(math.tan(ALPHA) / math.cos(helix)), usual_span_teeth(gear, helix) or 0
        involute = math.tan(transverse) - transverse
        by_hand = 3.0 * math.cos(ALPHA) * ((k - 0.5) * math.pi + teeth * involute) + 6.0 * shift * math.sin(ALPHA)
        case = f"{teeth}, x {shift:g}, {degrees:g} deg"
        rows.append(within(case, HAND, f"W_{k} [mm]", by_hand, 1e3 * span(gear, k, helix), ROUNDING))
    return tuple(rows)


def on_the_profile() -> tuple[Row, ...]:
    """Planes and balls that touch the flanks as they are generated."""
    rows = []
    for shape in (*_SHAPES, *_RINGS):
        gear, helix = drawn_gear(*shape)
        gear = gear_at_allowance(gear, -60e-6, helix)
        case = f"{'-' * gear.internal}{gear.teeth}, x {shape[1]:g}, {shape[2]:g} deg, A_sn -60 um"
        if (k := usual_span_teeth(gear, helix)) is not None:
            reference, _ = planes_on_the_profile(gear, k, helix)
            rows.append(within(case, PROFILE, f"W_{k} [mm]", 1e3 * reference, 1e3 * span(gear, k, helix), TOUCHING))
        if not helix:
            points = flank_points(gear, [roll(gear.reference_radius, gear.base_radius)])
            reference, ours = 2.0 * points[0, 1], chord(gear)[0]
            rows.append(within(case, PROFILE, "chord [mm]", 1e3 * reference, 1e3 * ours, TOUCHING))
            reference, ours = abs(gear.tip_radius - points[0, 0]), chord(gear)[1]
            rows.append(within(case, PROFILE, "height of the chord [mm]", 1e3 * reference, 1e3 * ours, TOUCHING))
        ball = usual_ball(gear, helix) or 0.0
        reference, _ = ball_between_flanks(gear, ball, helix)
        ours, quantity = over_balls(gear, ball, helix), f"M_dK, ball {1e3 * ball:g} mm [mm]"
        rows.append(within(case, PROFILE, quantity, 1e3 * reference, 1e3 * ours, TOUCHING))
    return tuple(rows)


def shortened_tips() -> tuple[Row, ...]:
    """Tips of a shifted pair that keep the clearance of the rack, ``k = a/m - (z1 + z2)/2 - x1 - x2`` (DIN 3960)."""
    gears = [Gear(z, 3e-3, ALPHA, 0.0, 0.02, 0.008, name=n, tip_open=True) for z, n in ((12, "pinion"), (24, "wheel"))]
    closed = close_pair(replace(gears[0], profile_shift=0.6), gears[1], centre_distance=56.5e-3, find=("wheel",))
    pair = settled_tips(closed)
    case = "12/24, x_1 0.6, a 56.5"
    rows = [
        printed(case, TIPS, f"tip diameter of the {gear.name} [mm]", reference, 2e3 * gear.tip_radius)
        for gear, reference in zip(pair.gears, ("44.84", "79.40"), strict=True)
    ]
    k = 56.5 / 3.0 - 18.0 - sum(gear.profile_shift for gear in pair.gears)
    rows += [
        within(case, TIPS, f"shortening of the {gear.name} [mm]", -3.0 * k, 1e3 * gear.tip_shortening, ROUNDING)
        for gear in pair.gears
    ]
    clearance = tip_clearances(pair)
    rows += [within(case, TIPS, f"{name} [mm]", 0.75, 1e3 * value, ROUNDING) for name, value in clearance.items()]
    return (*rows, printed(case, TIPS, "contact ratio", "1.202", pair.contact_ratio))


def there_and_back() -> tuple[Row, ...]:
    """Profile shifts that follow from the measures of a gear, less its own."""
    rows = []
    for shape in (*_SHAPES, *_RINGS):
        gear, helix = drawn_gear(*shape)
        ball = usual_ball(gear, helix) or 0.0
        angles = {
            "M_dK": half_angle_of_balls(gear, ball, over_balls(gear, ball, helix), helix),
            "s_n": half_angle_of_thickness(gear, normal_thickness(gear, helix), helix),
        }
        if (k := usual_span_teeth(gear, helix)) is not None:
            angles["W_k"] = half_angle_of_span(gear, k, span(gear, k, helix), helix)
        for measure, angle in angles.items():
            case = f"{'-' * gear.internal}{gear.teeth}, x {shape[1]:g}, {shape[2]:g} deg"
            error = shift_of_half_angle(gear, angle) - gear.profile_shift
            rows.append(at_most(case, BACK, f"x from {measure}, less x", ROUNDING, error))
    return tuple(rows)


def fits() -> tuple[Row, ...]:
    """Allowances of DIN 3967 by their names."""
    return tuple(
        printed(name, FITS, f"{symbol}, d {diameter:g} mm [um]", reference, 1e6 * value)
        for name, diameter, references in (
            ("27cd", 100, ("-70", "-170")),
            ("cd 25", 40, ("-54", "-84")),
            ("cd 25", 82, ("-70", "-110")),
            ("a 30", 10, ("-100", "-300")),
            ("bc 26", 2500, ("-460", "-660")),
        )
        for symbol, reference, value in zip(
            ("A_sne", "A_sni"), references, thickness_allowances(name, 1e-3 * diameter), strict=True
        )
    )
