"""Figures of deviations as measuring machines draw them: profiles over roll angle, pitches over teeth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.modifications import form_deviation
from femgear.plots.style import BLACK, BLUE, GREY, label, legend_below, line_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from femgear.gears import Gear, PlanetarySet
    from femgear.gears.deviations import SetDeviations


def has_profiles(deviations: SetDeviations, planetary_set: PlanetarySet) -> bool:
    """Whether any loaded flank differs from its involute, so that `profile_chart` shows something."""
    d, s = deviations, planetary_set
    forms = ((d.sun, s.sun), (d.planet_sun_side, s.planet), (d.planet_ring_side, s.planet), (d.ring, s.ring))
    return any(form_deviation(form, gear, _stations(form, gear)).any() for form, gear in forms)


def has_pitches(deviations: SetDeviations) -> bool:
    """Whether any tooth stands off its place, so that `pitch_chart` shows something."""
    d = deviations
    return any(p.any() for p in (d.sun_pitch, d.planet_pitch, d.planet_ring_side_pitch, d.ring_pitch))


def profile_chart(deviations: SetDeviations, planetary_set: PlanetarySet) -> Figure:
    """Profiles of the four kinds of loaded flanks over the roll angle, positive with more material.

    Parameters
    ----------
    deviations : SetDeviations
    planetary_set : PlanetarySet

    Returns
    -------
    Figure
        The involute is the zero line; the part that meets the mate is marked.
    """
    d, s = deviations, planetary_set
    active = active_rolls(s)
    flanks = (
        ("sun", d.sun, s.sun),
        ("planet, sun side", d.planet_sun_side, s.planet),
        ("planet, ring side", d.planet_ring_side, s.planet),
        ("ring", d.ring, s.ring),
    )
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6, sharey=True)
    for ax, (name, form, gear), ends in zip(axes, flanks, active):
        roll = _stations(form, gear)
        ax.plot(_degrees(gear, roll), -1e6 * form_deviation(form, gear, roll), color=BLUE, label="profile")
        ax.axhline(0.0, color=BLACK, linewidth=0.8, label="involute")
        ax.axvspan(*_degrees(gear, np.array(ends)), color="0.93", label="meets the mate")
        for place, roll_length, dash in (
            ("form circle", gear.form_roll, ":"),
            ("tip circle", gear.tip_roll, "--"),
        ):
            ax.axvline(float(_degrees(gear, roll_length)), color=GREY, linestyle=dash, label=place)
        label(ax, "roll angle [deg]", title=name)
    for ax in axes[::2]:
        label(ax, y="deviation [µm], material positive")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(min(low, -1.0), max(high, 1.0))
    legend_below(figure, columns=5)
    return figure


def pitch_chart(deviations: SetDeviations, planetary_set: PlanetarySet) -> Figure:
    """Cumulative pitch deviations of the loaded flanks over the tooth number, positive with more material.

    Parameters
    ----------
    deviations : SetDeviations
    planetary_set : PlanetarySet

    Returns
    -------
    Figure
        Along the line of action; a line for each planet and flank that has any.
    """
    d, N = deviations, planetary_set.n_planets
    rows = (
        ("sun", [("sun", d.sun_pitch)]),
        ("planets, sun side", [(f"planet {n + 1}", d.planet_pitch[n]) for n in range(N)]),
        ("planets, ring side", [(f"planet {n + 1}", d.planet_ring_side_pitch[n]) for n in range(N)]),
        ("ring", [("ring", d.ring_pitch)]),
    )
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6, sharey=True)
    for ax, (title, lines) in zip(axes, rows):
        for i, (name, values) in enumerate(lines):
            # sun, ring and planets differ in the common legend
            style = line_style(i if len(lines) > 1 else N + (title == "ring"))
            ax.step(np.arange(len(values)), -1e6 * values, where="mid", label=name, **style)
        label(ax, "tooth number [1]", title=title)
    for ax in axes[::2]:
        label(ax, y="deviation [µm], material positive")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(min(low, -1.0), max(high, 1.0))
    legend_below(figure, columns=5)
    return figure


def active_rolls(planetary_set: PlanetarySet) -> tuple[tuple[float, float], ...]:
    """Roll lengths [m] of the parts of the flanks that rigid gears use: sun, planet twice, ring.

    From the path of contact: ``r_b tan(alpha_w)`` and the path coordinate, which runs down the flank of a
    driven external gear.
    """
    s = planetary_set
    sun_side, ring_side = (
        math.tan(s.working_pressure_angle_sun_planet),
        math.tan(s.working_pressure_angle_planet_ring),
    )
    (a, b), (c, e) = s.path_sun_planet, s.path_planet_ring
    planet = s.planet.base_radius
    return (
        (s.sun.base_radius * sun_side + a, s.sun.base_radius * sun_side + b),
        (planet * sun_side - b, planet * sun_side - a),
        (planet * ring_side + c, planet * ring_side + e),
        (s.ring.base_radius * ring_side + c, s.ring.base_radius * ring_side + e),
    )


def _stations(form, gear: Gear) -> np.ndarray:
    """Roll lengths close enough for curves, the corners of all laws and the measured points among them."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    corners = [getattr(m, "roll", None) or (m.start, m.end) for m in form.modifications]
    extra = [roll for pair in corners for roll in pair if roll is not None and low < roll < high]
    return np.unique(np.concatenate([np.linspace(low, high, 301), extra]))


def _degrees(gear: Gear, roll):
    return np.degrees(np.asarray(roll) / gear.base_radius)
