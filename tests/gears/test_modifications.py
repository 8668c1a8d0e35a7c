"""Forms of single flanks: closed forms at points, continuity, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.modifications import (
    FlankForm,
    MeasuredLead,
    MeasuredProfile,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
    check_flank,
    check_form,
    form_deviation,
    roll_at,
)

ALPHA = math.radians(20.0)
SUN = Gear(27, 1.5e-3, ALPHA, 0.4, 0.025, 9e-3, name="sun")
RING = Gear(108, 1.5e-3, ALPHA, 0.0, 0.025, 0.1, internal=True, name="ring")


def at(modification, gear, fraction):
    """Deviation at fractions of the flank from the form circle (0) to the tip (1)."""
    roll = gear.form_roll + np.asarray(fraction, float) * (gear.tip_roll - gear.form_roll)
    return form_deviation(FlankForm((modification,)), gear, roll)


def place(gear, fraction):
    return gear.form_roll + fraction * (gear.tip_roll - gear.form_roll)


@pytest.mark.parametrize("gear", [SUN, RING], ids=["external", "internal"])
def test_values_at_points(gear):
    um = 1e-6
    linear = TipRelief(12 * um, place(gear, 0.6))
    assert at(linear, gear, [0, 0.6, 0.8, 1]) == pytest.approx([0, 0, 6 * um, 12 * um], abs=1e-18)
    parabolic = TipRelief(12 * um, place(gear, 0.6), power=2.0)
    assert at(parabolic, gear, [0.3, 0.7, 0.8, 1]) == pytest.approx([0, 0.75 * um, 3 * um, 12 * um], abs=1e-17)
    to_end = TipRelief(12 * um, place(gear, 0.6), place(gear, 0.8))
    assert at(to_end, gear, [0.7, 0.8, 1]) == pytest.approx([6 * um, 12 * um, 24 * um], abs=1e-17)
    root = RootRelief(8 * um, place(gear, 0.4))
    assert at(root, gear, [0, 0.2, 0.4, 1]) == pytest.approx([8 * um, 4 * um, 0, 0], abs=1e-17)
    root = RootRelief(8 * um, place(gear, 0.4), place(gear, 0.2), 2.0)
    assert at(root, gear, [0.2, 0.3, 0.4]) == pytest.approx([8 * um, 2 * um, 0], abs=1e-17)
    # more material at the tip is a negative separation there
    assert at(ProfileSlope(10 * um), gear, [0, 0.5, 1]) == pytest.approx([5 * um, 0, -5 * um], abs=1e-17)
    crowned = ProfileCrowning(6 * um)
    assert at(crowned, gear, [0, 0.25, 0.5, 1]) == pytest.approx([6 * um, 1.5 * um, 0, 6 * um], abs=1e-17)
    part = ProfileCrowning(6 * um, place(gear, 0.2), place(gear, 0.8))
    assert at(part, gear, [0.2, 0.5, 0.8]) == pytest.approx([6 * um, 0, 6 * um], abs=1e-17)


def test_measured_points_are_met_and_joined_by_straight_lines():
    roll = tuple(place(SUN, fraction) for fraction in (0.1, 0.5, 0.9))
    profile = MeasuredProfile(roll, (1e-6, -1e-6, 5e-6))
    got = at(profile, SUN, [0, 0.1, 0.3, 0.5, 0.8, 0.9, 1])
    assert got == pytest.approx([1e-6, 1e-6, 0, -1e-6, 3.5e-6, 5e-6, 5e-6], abs=1e-17)


@pytest.mark.parametrize("gear", [SUN, RING], ids=["external", "internal"])
def test_beyond_the_flank_its_end_holds(gear):
    relief = TipRelief(1e-5, place(gear, 0.5))
    assert at(relief, gear, [1.0, 1.2, 3.0]) == pytest.approx([1e-5] * 3, rel=1e-14)
    assert at(ProfileSlope(1e-5), gear, [-0.5, 0.0]) == pytest.approx([5e-6] * 2, rel=1e-14)


def test_modifications_add_up_and_keep_the_shape_of_the_points():
    one, two = TipRelief(1e-5, place(SUN, 0.5)), ProfileCrowning(4e-6)
    roll = np.linspace(SUN.form_roll, SUN.tip_roll, 12).reshape(3, 4)
    both = form_deviation(FlankForm((one, two)), SUN, roll)
    single = [form_deviation(FlankForm((m,)), SUN, roll) for m in (one, two)]
    assert both.shape == (3, 4)
    assert np.allclose(both, single[0] + single[1], rtol=0, atol=1e-18)
    assert not form_deviation(FlankForm(), SUN, roll).any()


@given(
    amount=st.floats(0.0, 2e-4),
    start=st.floats(0.05, 0.9),
    power=st.floats(1.0, 4.0),
    internal=st.booleans(),
    fraction=st.floats(-0.2, 1.2),
)
def test_reliefs_take_off_and_are_continuous(amount, start, power, internal, fraction):
    gear = RING if internal else SUN
    tip = TipRelief(amount, place(gear, start), power=power)
    root = RootRelief(amount, place(gear, start), power=power)
    for relief in (tip, root, ProfileCrowning(amount)):
        here, near = at(relief, gear, [fraction, fraction + 1e-7])
        assert 0.0 <= here <= amount * (1 + 1e-12)
        # the steepest slope: all of the amount over a twentieth of the flank
        assert abs(near - here) <= amount * 4.0 * power * 1e-7 / 0.05 + 1e-18
    assert at(tip, gear, fraction) * at(root, gear, fraction) == 0.0


def test_places_on_the_flank():
    rb = SUN.base_radius
    assert roll_at(SUN, diameter=2 * SUN.tip_radius) == pytest.approx(SUN.tip_roll, rel=1e-12)
    assert roll_at(SUN, roll_angle=0.5) == pytest.approx(0.5 * rb, rel=1e-15)
    assert roll_at(SUN, length=3e-3) == 3e-3
    assert roll_at(SUN) is None
    # at the reference circle the roll length is r_b tan(alpha)
    assert roll_at(SUN, diameter=2 * SUN.reference_radius) == pytest.approx(rb * math.tan(ALPHA), rel=1e-12)
    with pytest.raises(GeometryError, match="inside the base circle") as info:
        roll_at(SUN, diameter=1.99 * rb)
    assert info.value.code == "E-MODIFICATION"


@pytest.mark.parametrize(
    ("modification", "text"),
    [
        (TipRelief(1e-5, place(SUN, 1.1)), "starts outside"),
        (TipRelief(1e-5, place(SUN, -0.1)), "starts outside"),
        (TipRelief(1e-5, math.nan), "starts outside"),
        (RootRelief(1e-5, place(SUN, 0.5), place(SUN, -0.1)), "ends outside"),
        (TipRelief(1e-5, place(SUN, 1.0)), "coincide"),
        (TipRelief(1e-5, place(SUN, 0.8), place(SUN, 0.5)), "exchanged"),
        (RootRelief(1e-5, place(SUN, 0.3), place(SUN, 0.5)), "exchanged"),
        (MeasuredLead((-0.6 * SUN.face_width, 0.3 * SUN.face_width), (0.0, 1e-6)), "beside the face width"),
        (MeasuredLead((0.0, SUN.face_width), (0.0, 1e-6)), "beside the face width"),
    ],
)
def test_refusals(modification, text):
    with pytest.raises(GeometryError, match=text) as info:
        check_form(FlankForm((ProfileSlope(1e-6), modification)), SUN)
    assert info.value.code == "E-MODIFICATION" and info.value.key == "sun.modifications[1]"
    assert info.value.exit_code == 2


@pytest.mark.parametrize(
    ("ends", "share"), [((-0.504, 0.504), None), ((-0.46, 0.45), None), ((0.0, 0.5), 50), ((-0.44, 0.44), 88)]
)
def test_a_measured_lead_covers_the_width(ends, share):
    """Of a width b its places lie within b/2 of the middle; much of it beside them is a warning."""
    form = FlankForm((MeasuredLead(tuple(SUN.face_width * end for end in ends), (0.0, 1e-6)),))
    check_form(form, SUN)
    found = [str(one) for one in check_flank("sun", form, SUN)]
    assert len(found) == (share is not None)
    assert all(f"covers {share} % of the width" in one and one.startswith("[W-PROFILE]") for one in found)


def test_good_forms_pass():
    form = FlankForm((TipRelief(1e-5, place(SUN, 0.6)), RootRelief(1e-5, place(SUN, 0.4))))
    check_form(form, SUN)
    ring = FlankForm((TipRelief(1e-5, place(RING, 0.6)), RootRelief(1e-5, place(RING, 0.4))))
    check_form(ring, RING)
    # the ring's roll length falls towards its tip
    with pytest.raises(GeometryError, match="exchanged"):
        check_form(FlankForm((TipRelief(1e-5, RING.tip_roll, RING.form_roll),)), RING)
    check_form(form, replace(SUN, name="gear"))
