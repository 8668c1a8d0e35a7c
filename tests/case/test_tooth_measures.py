"""Cases that give measures of a drawing in place of profile shifts and backlash."""

import math
import re
from typing import Any

import pytest

from femgear.case.gear_set import planetary_set
from femgear.case.tooth_measures import gear_allowances, shift_open
from femgear.errors import FemgearError
from femgear.gears.drawing import normal_thickness, over_balls, span
from femgear.stages.drawing_tables import drawn_gears
from femgear.trains.reading import parse_case

PAIR = """
format = 1
model = "pair"
title = "24/36"
[set]
module = "3 mm"
pressure_angle = "20 deg"
face_width = "20 mm"
centre_distance = "91.5 mm"
helix_angle = "HELIX deg"
[material]
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
density = "7850 kg/m^3"
[gear_1]
teeth = 24
bore_radius = "15 mm"
GEAR_1
[gear_2]
teeth = 36
bore_radius = "25 mm"
GEAR_2
[operation]
torque = "100 N m"
"""
SHIFTED = "profile_shift = 0.3"


def pair_case(gear_1=SHIFTED, gear_2="", helix=0.0, of_set=""):
    """Read a pair with entries of its gears."""
    text = PAIR.replace("GEAR_1", gear_1).replace("GEAR_2", gear_2).replace("HELIX", repr(helix))
    return parse_case(text.replace("[set]", f"[set]\n{of_set}"), name="pair.toml")


def made(gear_1=SHIFTED, gear_2="", helix=0.0, of_set="") -> Any:
    """Make the gears of that case."""
    return planetary_set(pair_case(gear_1, gear_2, helix, of_set))


def made_of(text) -> Any:
    """Make the gears of the text of a case."""
    return planetary_set(parse_case(text, name="pair.toml"))


def measures_of(gear, helix):
    """Write all measures of a gear as entries of a case."""
    return {
        "span": f'span = "{1e3 * span(gear, 4, helix)!r} mm"\nspan_teeth = 4',
        "over_balls": f'over_balls = "{1e3 * over_balls(gear, 5.5e-3, helix)!r} mm"\nball_diameter = "5.5 mm"',
        "tooth_thickness": f'tooth_thickness = "{1e3 * normal_thickness(gear, helix)!r} mm"',
    }


@pytest.mark.parametrize("helix", [0.0, 12.0])
@pytest.mark.parametrize("measure", ["span", "over_balls", "tooth_thickness"])
@pytest.mark.parametrize("backlash", ["", 'backlash = "0.08 mm"'])
def test_a_gear_by_its_measure_is_the_gear_by_its_shift(helix, measure, backlash):
    by_shift = made(helix=helix, of_set=backlash)
    measured = measures_of(by_shift.gear_1, math.radians(helix))[measure]
    by_measure = made(measured, helix=helix, of_set=backlash)
    for ours, reference in zip(by_measure.gears, by_shift.gears, strict=True):
        assert ours.profile_shift == pytest.approx(reference.profile_shift, abs=1e-12)
        assert ours.tip_radius == pytest.approx(reference.tip_radius, rel=1e-12)
        assert ours.thickness_allowance == pytest.approx(reference.thickness_allowance, abs=1e-15)


def test_all_measures_together_agree_and_one_that_does_not_is_refused_with_both_values():
    gear = made().gear_1
    all_of_them = measures_of(gear, 0.0)
    together = made("\n".join(all_of_them.values()))
    assert together.gear_1.profile_shift == pytest.approx(0.3, abs=1e-12)
    thick = f'tooth_thickness = "{1e3 * normal_thickness(gear) + 0.01!r} mm"'
    with pytest.raises(FemgearError, match="E-DUPLICATE") as refusal:
        made("\n".join([all_of_them["span"], thick]))
    assert refusal.value.key == "gear_1.tooth_thickness"
    assert {refusal.value.value, refusal.value.limit} == {"5.3775 mm", "5.3675 mm"}


def test_a_measure_beside_a_shift_thins_the_teeth():
    thick = made().gear_1
    wanted = span(thick, 4) - 30e-6
    pair = made(f'{SHIFTED}\nspan = "{1e3 * wanted!r} mm"\nspan_teeth = 4')
    assert pair.gear_1.profile_shift == 0.3
    assert span(pair.gear_1, 4) == pytest.approx(wanted, rel=1e-12)
    assert pair.backlash == pytest.approx(30e-6, rel=1e-6), "the span is along the line of action, as the play"
    with pytest.raises(FemgearError, match="E-DUPLICATE") as refusal:
        made(f'{SHIFTED}\nspan = "{1e3 * span(thick, 4) + 0.02!r} mm"\nspan_teeth = 4')
    assert refusal.value.value == "32.6414 mm"
    assert refusal.value.limit is not None and refusal.value.limit.endswith(" to 32.6214 mm")
    with pytest.raises(FemgearError, match="E-DUPLICATE"):  # no play: another profile shift
        made(f'{SHIFTED}\nspan = "{1e3 * span(thick, 4) - 0.7!r} mm"\nspan_teeth = 4')


def test_a_measure_within_allowances_is_taken_and_one_beyond_is_refused():
    allowances = 'tooth_thickness_allowance = ["-70 um", "-110 um"]'
    nominal = normal_thickness(made().gear_1)
    entry = f'{SHIFTED}\n{allowances}\ntooth_thickness = "{{}} mm"'
    assert normal_thickness(made(entry.format(1e3 * nominal - 0.1)).gear_1) == pytest.approx(nominal - 1e-4, rel=1e-12)
    with pytest.raises(FemgearError, match="E-DUPLICATE"):
        made(entry.format(1e3 * nominal - 0.12))


@pytest.mark.parametrize(("helix", "named"), [(0.0, '"25cd"'), (12.0, '["-70 um", "-110 um"]')])
def test_allowances_thin_the_teeth_of_the_normal_section_by_their_mean(helix, named):
    entry = f"{SHIFTED}\ntooth_thickness_allowance = {named}"
    case = pair_case(entry, helix=helix)
    nominal, thin = made(helix=helix).gear_1, made(entry, helix=helix).gear_1
    assert gear_allowances(case, "gear_1") == pytest.approx((-70e-6, -110e-6), rel=1e-12)
    assert gear_allowances(case, "gear_2") is None
    beta = math.radians(helix)
    assert normal_thickness(nominal, beta) - normal_thickness(thin, beta) == pytest.approx(90e-6, rel=1e-9)


@pytest.mark.parametrize(
    ("entries", "code", "key", "limit"),
    [
        ('span = "32.6 mm"', "E-KEY-MISSING", "gear_1", None),
        ('over_balls = "81 mm"', "E-KEY-MISSING", "gear_1", None),
        (f'{SHIFTED}\nspan = "77 mm"\nspan_teeth = 9', "E-RANGE", "gear_1.span_teeth", "2 to 5"),
        ('over_balls = "60 mm"\nball_diameter = "5.5 mm"', "E-RANGE", "gear_1.over_balls", "above 73.1579 mm"),
        (f'{SHIFTED}\nover_balls = "81 mm"\nball_diameter = "1 mm"', "E-RANGE", "gear_1.ball_diameter", None),
        (f'{SHIFTED}\ntooth_thickness_allowance = ["-0.11 mm", "-0.07 mm"]', "E-RANGE", None, None),
        (f'{SHIFTED}\ntooth_thickness_allowance = ["10 um", "-70 um"]', "E-RANGE", None, "-10 mm to 0 mm"),
        (f'{SHIFTED}\ntooth_thickness_allowance = ["10 um"]', "E-TYPE", None, None),
        ('tooth_thickness = ["5.3 mm"]', "E-COUNT", None, None),
        (f'{SHIFTED}\nover_balls = "81.6 mm"\nball_diameter = "20 mm"', "E-RANGE", "gear_1.ball_diameter", None),
        (
            f'{SHIFTED}\ntooth_thickness_allowance = ["-5 mm", "-6 mm"]',
            "E-ALLOWANCE",
            "gear_1.tooth_thickness_allowance",
            "less than a module, 3 mm, in their middle",
        ),
        (f'{SHIFTED}\ntooth_thickness_allowance = "cq 25"', "E-CHOICE", None, None),
    ],
)
def test_what_no_drawing_gives_is_refused_by_its_key(entries, code, key, limit):
    with pytest.raises(FemgearError, match=code) as refusal:
        made(entries)
    assert re.search(r"gear_1", str(refusal.value))
    assert refusal.value.remedy
    assert key is None or refusal.value.key == key
    assert limit is None or refusal.value.limit == limit


def test_backlash_and_allowances_are_refused_together_with_both_values():
    allowance = f'{SHIFTED}\ntooth_thickness_allowance = "c 25"'
    with pytest.raises(FemgearError, match="E-DUPLICATE") as refusal:
        pair_case(allowance, of_set='backlash = "0.1 mm"')
    assert refusal.value.value == "c 25; set.backlash = 100 um"


@pytest.mark.parametrize("measure", ["span", "over_balls", "tooth_thickness"])
@pytest.mark.parametrize("given", [SHIFTED, ""])
def test_limits_of_a_measure_are_those_of_its_allowances(measure, given):
    """The limits that `check` prints of "cd 25" give the same gears back, with and without the profile shift."""
    drawn = drawn_gears(pair_case(f'{SHIFTED}\ntooth_thickness_allowance = "cd 25"'))[0]
    of = {"span": drawn.span, "over_balls": drawn.over_balls, "tooth_thickness": drawn.thickness}
    with_it = {"span": "span_teeth = 4", "over_balls": 'ball_diameter = "5.5 mm"', "tooth_thickness": ""}[measure]
    _, low, high = of[measure]
    entry = f'{given}\n{measure} = ["{1e3 * high!r} mm", "{1e3 * low!r} mm"]\n{with_it}'
    (again, _) = drawn_gears(pair_case(entry))
    assert normal_thickness(again.gear) == pytest.approx(normal_thickness(drawn.gear), rel=1e-12)
    assert again.thickness == pytest.approx(drawn.thickness, rel=1e-12)
    # without a shift the thickest tooth has no allowance
    upper = -70e-6 if given else 0.0
    assert again.allowances == pytest.approx((upper, upper - 40e-6), abs=1e-12)


@pytest.mark.parametrize(
    ("entries", "of_set"),
    [('tooth_thickness_allowance = "c 25"', ""), ("", 'backlash = "0.1 mm"')],
)
def test_limits_and_allowances_or_backlash_are_refused_together(entries, of_set):
    limits = 'tooth_thickness = ["5.30 mm", "5.34 mm"]'
    with pytest.raises(FemgearError, match="E-DUPLICATE") as refusal:
        pair_case(f"{SHIFTED}\n{limits}\n{entries}", of_set=of_set)
    assert "5.3 mm, 5.34 mm" in str(refusal.value.value)


def test_rings_have_no_span_and_are_measured_between_balls():
    text = PAIR.replace('teeth = 36\nbore_radius = "25 mm"', 'teeth = 72\nouter_radius = "125 mm"')
    text = text.replace("91.5 mm", "72 mm").replace("HELIX", "0").replace("GEAR_1", "profile_shift = 0.1")
    plain = made_of(text.replace("GEAR_2", ""))
    assert plain.gear_2.profile_shift == pytest.approx(0.1, abs=1e-12)
    balls = f'over_balls = "{1e3 * over_balls(plain.gear_2, 5e-3)!r} mm"\nball_diameter = "5 mm"'
    assert made_of(text.replace("GEAR_2", balls)).gear_2.profile_shift == pytest.approx(0.1, abs=1e-12)
    with pytest.raises(FemgearError, match="E-CHOICE") as refusal:
        made_of(text.replace("GEAR_2", 'span = "50 mm"\nspan_teeth = 5'))
    assert refusal.value.key == "gear_2.span"


def test_a_measure_counts_as_a_profile_shift_that_is_given():
    case = pair_case(measures_of(made().gear_1, 0.0)["span"])
    assert not shift_open(case.gear_1)
    assert shift_open(case.gear_2)
