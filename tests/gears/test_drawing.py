"""Measures of drawings: closed forms by hand, the generated profile, and back from a measure to the gear."""

import math
from dataclasses import replace

import pytest

from femgear.errors import GeometryError
from femgear.gears.drawing import (
    allowance_of_half_angle,
    ball_contact_radius,
    ball_range,
    check_ball,
    check_span,
    chord,
    gear_at_allowance,
    half_angle_of_balls,
    half_angle_of_span,
    half_angle_of_thickness,
    mesh_play,
    normal_thickness,
    over_balls,
    over_pins,
    shift_of_half_angle,
    span,
    span_radius,
    span_teeth_range,
    usual_ball,
    usual_span_teeth,
)
from femgear.gears.gear import Gear
from femgear.gears.pair import close_pair
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool
from validation.drawing import ball_between_flanks, planes_on_the_profile

ALPHA = math.radians(20.0)


def gear_of(
    teeth: int, shift: float = 0.0, *, helix: float = 0.0, internal: bool = False, allowance: float = 0.0
) -> Gear:
    """Make a gear of a normal module of 2 mm."""
    module, angle = transverse_tool(2e-3, ALPHA, helix)
    rim = 0.5 * module * teeth + (0.012 if internal else -0.012)
    return Gear(
        teeth,
        module,
        angle,
        shift * math.cos(helix),
        0.03,
        rim,
        internal=internal,
        rack=transverse_rack(BasicRack(), helix),
        thickness_allowance=allowance,
    )


GEARS = [
    (gear_of(24, 0.3), 0.0),
    (gear_of(31, -0.2, allowance=80e-6), 0.0),
    (gear_of(23, 0.2, helix=0.35), 0.35),
    (gear_of(28, 0.1, helix=-0.2, allowance=50e-6), -0.2),
    (gear_of(81, 0.1, internal=True), 0.0),
    (gear_of(72, -0.1, helix=0.3, internal=True, allowance=60e-6), 0.3),
]
EXTERNAL = [(gear, helix) for gear, helix in GEARS if not gear.internal]


def spans_of(gear: Gear, helix: float) -> tuple[int, int]:
    """Fewest and most teeth of a span, which there is."""
    ends = span_teeth_range(gear, helix)
    assert ends is not None
    return ends


def balls_of(gear: Gear, helix: float) -> tuple[float, float, float]:
    """Smallest, usual and largest ball, which there are."""
    ends, usual = ball_range(gear, helix), usual_ball(gear, helix)
    assert ends is not None and usual is not None
    return ends[0], usual, ends[1]


def test_span_and_balls_of_a_spur_gear_are_those_of_the_textbook():
    gear, teeth, ball = gear_of(24, 0.3), 4, 3.5e-3
    involute = math.tan(ALPHA) - ALPHA
    by_hand = 2e-3 * math.cos(ALPHA) * (3.5 * math.pi + 24 * involute) + 2 * 0.3 * 2e-3 * math.sin(ALPHA)
    assert span(gear, teeth) == pytest.approx(by_hand, rel=1e-12)
    at_ball = involute + ball / (2e-3 * 24 * math.cos(ALPHA)) + (2 * 0.3 * math.tan(ALPHA) - math.pi / 2) / 24
    low, high = 0.0, 1.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if math.tan(middle) - middle < at_ball else (low, middle)
    assert over_balls(gear, ball) == pytest.approx(24 * 2e-3 * math.cos(ALPHA) / math.cos(low) + ball, rel=1e-12)


@pytest.mark.parametrize(("gear", "helix"), EXTERNAL)
def test_two_planes_that_touch_the_generated_profile_are_a_span_apart(gear, helix):
    low, high = spans_of(gear, helix)
    for teeth in range(low, high + 1):
        measured, radius = planes_on_the_profile(gear, teeth, helix)
        assert measured == pytest.approx(span(gear, teeth, helix), rel=1e-9)
        assert radius == pytest.approx(span_radius(gear, teeth, helix), rel=1e-6)


@pytest.mark.parametrize(("gear", "helix"), GEARS)
def test_a_ball_that_touches_the_generated_profile_is_at_its_place(gear, helix):
    smallest, usual, _ = balls_of(gear, helix)
    for ball in (usual, 1.01 * smallest):
        measured, radius = ball_between_flanks(gear, ball, helix)
        assert measured == pytest.approx(over_balls(gear, ball, helix), rel=1e-9)
        assert radius == pytest.approx(ball_contact_radius(gear, ball, helix), rel=1e-6)


@pytest.mark.parametrize(("gear", "helix"), GEARS)
def test_every_measure_leads_back_to_shift_and_allowance(gear, helix):
    _, ball, _ = balls_of(gear, helix)
    angles = [
        half_angle_of_balls(gear, ball, over_balls(gear, ball, helix), helix),
        half_angle_of_thickness(gear, normal_thickness(gear, helix), helix),
    ]
    if not gear.internal:
        teeth = usual_span_teeth(gear, helix)
        assert teeth is not None
        angles.append(half_angle_of_span(gear, teeth, span(gear, teeth, helix), helix))
    for angle in angles:
        unshifted = replace(gear, profile_shift=0.0, tip_open=True)
        assert shift_of_half_angle(unshifted, angle) == pytest.approx(gear.profile_shift, abs=1e-12)
        assert allowance_of_half_angle(gear, angle) == pytest.approx(gear.thickness_allowance, abs=1e-15)


@pytest.mark.parametrize(("gear", "helix"), GEARS)
def test_ends_of_the_ball_range_touch_ends_of_flanks_roots_or_tips(gear, helix):
    low, _, high = balls_of(gear, helix)
    for ball in (low * (1.0 + 1e-9), high * (1.0 - 1e-9)):
        check_ball(gear, ball, helix)
    for ball in (0.999 * low, 1.001 * high):
        with pytest.raises(GeometryError, match="E-RANGE") as refusal:
            check_ball(gear, ball, helix)
        assert "mm" in (refusal.value.limit or "")
    assert ball_contact_radius(gear, high, helix) == pytest.approx(gear.tip_radius, rel=1e-9)


def test_thinner_teeth_have_a_smaller_span_and_a_larger_gap():
    external, internal = gear_of(24, 0.3), gear_of(81, 0.1, internal=True)
    assert span(external, 4) - span(gear_at_allowance(external, -1e-4), 4) == pytest.approx(
        1e-4 * math.cos(ALPHA), rel=1e-9
    )
    assert over_balls(gear_at_allowance(external, -1e-4), 3.5e-3) < over_balls(external, 3.5e-3)
    assert over_balls(gear_at_allowance(internal, -1e-4), 3.5e-3) > over_balls(internal, 3.5e-3)
    helical = gear_of(23, 0.2, helix=0.35)
    thin = gear_at_allowance(helical, -1e-4, 0.35)
    assert normal_thickness(helical, 0.35) - normal_thickness(thin, 0.35) == pytest.approx(1e-4, rel=1e-9)


def test_the_chord_is_that_between_the_flanks_on_the_reference_circle():
    gear = gear_of(24)
    half = 0.5 * normal_thickness(gear) / gear.reference_radius
    thickness, height = chord(gear)
    assert thickness == pytest.approx(2.0 * gear.reference_radius * math.sin(half), rel=1e-12)
    assert height == pytest.approx(gear.tip_radius - gear.reference_radius * math.cos(half), rel=1e-12)
    ring = gear_of(81, 0.1, internal=True)
    half = 0.5 * normal_thickness(ring) / ring.reference_radius
    assert chord(ring)[1] == pytest.approx(ring.reference_radius * math.cos(half) - ring.tip_radius, rel=1e-12)


def test_pins_of_odd_helical_teeth_lie_opposite_one_another():
    odd, even, spur = gear_of(23, 0.2, helix=0.35), gear_of(24, 0.2, helix=0.35), gear_of(23)
    assert over_pins(even, 4e-3, 0.35) == pytest.approx(over_balls(even, 4e-3, 0.35), rel=1e-12)
    assert over_pins(spur, 4e-3) == over_balls(spur, 4e-3)
    across = (over_balls(odd, 4e-3, 0.35) - 4e-3) / (over_pins(odd, 4e-3, 0.35) - 4e-3)
    assert across == pytest.approx(math.cos(math.pi / 46), rel=1e-12)


def test_spans_that_cannot_be_measured_are_refused_with_what_can():
    with pytest.raises(GeometryError, match="E-CHOICE"):
        check_span(gear_of(81, internal=True), 5)
    with pytest.raises(GeometryError, match="E-RANGE") as refusal:
        check_span(gear_of(24), 9)
    assert refusal.value.limit == "2 to 4"
    narrow = replace(gear_of(60, helix=0.5), face_width=5e-3)
    assert span_teeth_range(narrow, 0.5) is None
    assert usual_span_teeth(narrow, 0.5) is None


def test_balls_inside_the_base_circle_are_refused():
    with pytest.raises(GeometryError, match="E-RANGE"):
        half_angle_of_balls(gear_of(24), 3.5e-3, 0.04)


def test_the_play_of_a_mesh_is_what_its_teeth_are_thinner():
    pair = close_pair(gear_of(24, 0.3), gear_of(31, -0.2))
    loose = pair.with_gears([gear_at_allowance(gear, -1e-6) for gear in pair.gears])
    play = mesh_play(loose)
    assert play.normal == pytest.approx(2e-6 * math.cos(ALPHA), rel=1e-6)
    assert play.circumferential == pytest.approx(play.normal / math.cos(pair.working_pressure_angle), rel=1e-12)
    # teeth touch on both flanks where the centre distance shrinks so far, to the first order
    closer = close_pair(*loose.gears, centre_distance=loose.centre_distance - play.radial)
    assert abs(closer.backlash) < 1e-3 * play.normal
