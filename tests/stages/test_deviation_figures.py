"""Charts of deviations: the curves are the deviations with material positive, axes say their units."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from femgear.gears.deviations import no_deviations
from femgear.gears.gear import Gear
from femgear.gears.modifications import FlankForm, MeasuredProfile, ProfileSlope, TipRelief
from femgear.gears.planetary import close_set, equal_planet_angles
from femgear.report.style import png_bytes
from femgear.stages import static_figures as static_figures
from femgear.stages.protocol import Drawn
from femgear.stages.static_figures import active_rolls, has_pitches, has_profiles, pitch_chart, profile_chart

ALPHA = math.radians(20.0)
UM = 1e-6


@pytest.fixture(scope="module")
def gears():
    return close_set(
        Gear(27, 1.5e-3, ALPHA, 0.0, 0.025, 9e-3),
        Gear(40, 1.5e-3, ALPHA, 0.0, 0.025, 18e-3),
        Gear(108, 1.5e-3, ALPHA, 0.0, 0.025, 0.1, internal=True),
        planet_angles=equal_planet_angles(3),
        centre_distance=51e-3,
        find=("sun", "ring"),
    )


@pytest.fixture(scope="module")
def deviations(gears):
    middle = 0.5 * (gears.sun.form_roll + gears.sun.tip_roll)
    d = no_deviations(gears)
    return replace(
        d,
        sun=FlankForm((TipRelief(12 * UM, middle, power=2.0),)),
        planet_ring_side=FlankForm((ProfileSlope(4 * UM),)),
        ring=FlankForm((MeasuredProfile((0.025, 0.030), (1 * UM, 5 * UM)),)),
        sun_pitch=3 * UM * np.sin(2 * np.pi * np.arange(27) / 27),
    )


def line(ax, name):
    return next(one for one in ax.get_lines() if one.get_label() == name)


def test_profiles_are_drawn_with_material_positive(gears, deviations):
    figure = profile_chart(deviations, gears)
    sun, _, ring_side, ring = figure.axes
    angle, height = line(sun, "profile").get_data()
    tip = math.degrees(gears.sun.tip_roll / gears.sun.base_radius)
    assert angle.max() == pytest.approx(tip, rel=1e-12)
    assert height[angle.argmax()] == pytest.approx(-12.0, rel=1e-12) and height[angle.argmin()] == 0.0
    angle, height = line(ring_side, "profile").get_data()
    assert [height[0], height[-1]] == pytest.approx([-2.0, 2.0], rel=1e-12)
    # a measured point is drawn where it was measured, and tip and root of the ring lie the other way round
    angle, height = line(ring, "profile").get_data()
    point = math.degrees(0.030 / gears.ring.base_radius)
    assert height[np.abs(angle - point).argmin()] == pytest.approx(-5.0, rel=1e-12)
    assert line(ring, "tip circle").get_xdata()[0] < line(ring, "form circle").get_xdata()[0]


def test_active_parts_lie_on_the_flanks_and_cover_the_path(gears):
    rolls = active_rolls(gears)
    flanks = (gears.sun, gears.planet, gears.planet, gears.ring)
    for (start, end), gear in zip(rolls, flanks, strict=True):
        low, high = sorted((gear.form_roll, gear.tip_roll))
        assert low < start + 1e-9 and start < end and end < high + 1e-9
    ratios = [(end - start) / gears.base_pitch for start, end in rolls]
    one, two = gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring
    assert ratios == pytest.approx([one, one, two, two], rel=1e-12)
    # on the line of action roll lengths of both flanks add up to the distance of the tangent points
    length = gears.centre_distance * math.sin(gears.working_pressure_angle_sun_planet)
    assert rolls[0][0] + rolls[1][1] == pytest.approx(length, rel=1e-12)
    length = gears.centre_distance * math.sin(gears.working_pressure_angle_planet_ring)
    assert rolls[3][0] - rolls[2][0] == pytest.approx(length, rel=1e-12)


def test_pitches_are_drawn_with_material_positive(gears, deviations):
    figure = pitch_chart(deviations, gears)
    tooth, height = line(figure.axes[0], "sun").get_data()
    assert height == pytest.approx(-3 * np.sin(2 * np.pi * tooth / 27), abs=1e-12)
    assert len(figure.axes[1].get_lines()) == 3


@pytest.mark.parametrize("chart", [profile_chart, pitch_chart])
def test_axes_say_their_units_and_nothing_is_drawn_twice(gears, deviations, chart):
    for d in (deviations, no_deviations(gears)):
        figure = chart(d, gears)
        FigureCanvasAgg(figure).draw()
        assert all("[" in ax.get_xlabel() for ax in figure.axes)
        assert all("[µm]" in ax.get_ylabel() for ax in figure.axes[::2])
        assert len(figure.legends) == 1
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert len(texts) == len(set(texts))
    assert png_bytes(chart(deviations, gears))[:4] == b"\x89PNG"


def test_charts_are_left_out_where_there_is_nothing_of_their_kind(gears, deviations, monkeypatch):
    ideal = no_deviations(gears)
    pins = replace(ideal, pin_errors=np.full((3, 2), 5 * UM))
    forms = replace(deviations, sun_pitch=np.zeros(27))
    pitches = replace(pins, ring_pitch=deviations.sun_pitch[0] + UM * np.arange(108))
    none = replace(ideal, sun=FlankForm((ProfileSlope(0.0),)))
    both = ["profile_deviations", "pitch_deviations"]
    for d, names in ((pins, []), (none, []), (forms, both[:1]), (pitches, both[1:]), (deviations, both)):
        monkeypatch.setattr(static_figures, "planetary_set", lambda _: gears)
        monkeypatch.setattr(static_figures, "set_deviations", lambda _, d=d: d)
        assert list(static_figures.FIGURES[""].draw(Drawn(None, {}))) == names
        assert [has_profiles(d, gears), has_pitches(d)] == [name in names for name in both]
