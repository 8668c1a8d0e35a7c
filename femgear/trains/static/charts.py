"""Charts of the gears themselves: deviations as measuring machines draw them, and the phasing of the meshes.

Profiles stand over the roll angle, pitches over the teeth; phases stand round the carrier, with what they
cancel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.gears.deviations import SetDeviations
from femgear.gears.gear import Gear
from femgear.gears.modifications import FlankForm, form_deviation
from femgear.gears.phasing import MeshPhasing, PhasingTable, phase_factors, phasing_table
from femgear.gears.planetary import PlanetarySet
from femgear.report.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SIZE,
    label,
    legend_below,
    line_style,
    new_figure,
    xy,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 121))


def four_panels(draw: Callable[[int, Any], str], y: str, *, columns: int, sharex: bool = False) -> Figure:
    """Draw sun, planets (on either side) and ring in panels of one scale.

    Parameters
    ----------
    draw : callable
        ``(number of the panel, axes) -> title``.
    y : str
        Label with unit.
    columns : int
        Of the legend.
    sharex : bool
        Whether the panels share the horizontal scale, too.
    """
    figure, axes = new_figure(rows=2, columns=2, width=9.5, height=6.6, sharex=sharex, sharey=True)
    for number, ax in enumerate(axes):
        label(ax, title=draw(number, ax))
    for ax in axes[::2]:
        label(ax, y=y)
    legend_below(figure, columns=columns)
    return figure


def has_profiles(deviations: SetDeviations, planetary_set: PlanetarySet) -> bool:
    """Tell whether any loaded flank differs from its involute, so that `profile_chart` shows something."""
    flanks = _flanks(deviations, planetary_set)
    return any(form_deviation(form, gear, _stations(form, gear)).any() for _, form, gear in flanks)


def has_pitches(deviations: SetDeviations) -> bool:
    """Tell whether any tooth stands off its place, so that `pitch_chart` shows something."""
    d = deviations
    return any(p.any() for p in (d.sun_pitch, d.planet_pitch, d.planet_ring_side_pitch, d.ring_pitch))


def profile_chart(deviations: SetDeviations, planetary_set: PlanetarySet) -> Figure:
    """Draw the profiles of the loaded flanks over the roll angle, positive with more material.

    The involute is the zero line; the part that meets the mate is marked.
    """
    active, flanks = active_rolls(planetary_set), _flanks(deviations, planetary_set)

    def draw(number: int, ax) -> str:
        name, form, gear = flanks[number]
        roll = _stations(form, gear)
        ax.plot(_degrees(gear, roll), -1e6 * form_deviation(form, gear, roll), color=BLUE, label="profile")
        ax.axhline(0.0, color=BLACK, linewidth=0.8, label="involute")
        ax.axvspan(*_degrees(gear, np.array(active[number])), color="0.93", label="meets the mate")
        for place, end, dash in (("form circle", gear.form_roll, ":"), ("tip circle", gear.tip_roll, "--")):
            ax.axvline(float(_degrees(gear, end)), color=GREY, linestyle=dash, label=place)
        label(ax, "roll angle [deg]")
        return name

    return _deviation_panels(draw)


def pitch_chart(deviations: SetDeviations, planetary_set: PlanetarySet) -> Figure:
    """Draw the cumulative pitch deviations of the loaded flanks over the teeth, positive with more material.

    Along the line of action; a line for each planet and flank that has any.
    """
    d, N = deviations, planetary_set.n_planets
    rows = (
        ("sun", [("sun", d.sun_pitch)]),
        ("planets, sun side", [(f"planet {n + 1}", d.planet_pitch[n]) for n in range(N)]),
        ("planets, ring side", [(f"planet {n + 1}", d.planet_ring_side_pitch[n]) for n in range(N)]),
        ("ring", [("ring", d.ring_pitch)]),
    )

    def draw(number: int, ax) -> str:
        title, lines = rows[number]
        for i, (name, values) in enumerate(lines):
            # sun, ring and planets differ in the common legend
            style = line_style(i if len(lines) > 1 else N + (title == "ring"))
            ax.step(np.arange(len(values)), -1e6 * values, where="mid", label=name, **style)
        label(ax, "tooth number [1]")
        return title

    return _deviation_panels(draw)


def _deviation_panels(draw: Callable[[int, Any], str]) -> Figure:
    """Draw deviations of the four kinds of flanks on a scale of at least one micrometre up and down."""
    figure = four_panels(draw, "deviation [µm], material positive", columns=5)
    low, high = figure.axes[0].get_ylim()
    figure.axes[0].set_ylim(min(low, -1.0), max(high, 1.0))
    return figure


def _flanks(d: SetDeviations, s: PlanetarySet) -> tuple[tuple[str, FlankForm, Gear], ...]:
    """Name the four kinds of loaded flanks, with their forms and gears."""
    return (
        ("sun", d.sun, s.sun),
        ("planet, sun side", d.planet_sun_side, s.planet),
        ("planet, ring side", d.planet_ring_side, s.planet),
        ("ring", d.ring, s.ring),
    )


def active_rolls(planetary_set: PlanetarySet) -> tuple[tuple[float, float], ...]:
    """Find the roll lengths [m] of the parts of the flanks that rigid gears use: sun, planet twice, ring.

    From the path of contact: ``r_b tan(alpha_w)`` and the path coordinate, which runs down the flank of a
    driven external gear.
    """
    s = planetary_set
    sun_side = math.tan(s.working_pressure_angle_sun_planet)
    ring_side = math.tan(s.working_pressure_angle_planet_ring)
    (a, b), (c, e) = s.path_sun_planet, s.path_planet_ring
    planet = s.planet.base_radius
    return (
        (s.sun.base_radius * sun_side + a, s.sun.base_radius * sun_side + b),
        (planet * sun_side - b, planet * sun_side - a),
        (planet * ring_side + c, planet * ring_side + e),
        (s.ring.base_radius * ring_side + c, s.ring.base_radius * ring_side + e),
    )


def _stations(form, gear: Gear) -> np.ndarray:
    """Choose roll lengths [m] for curves, the corners of all laws and the measured points among them."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    corners = [getattr(m, "roll", None) or (m.start, m.end) for m in form.modifications]
    extra = [roll for pair in corners for roll in pair if roll is not None and low < roll < high]
    return np.unique(np.concatenate([np.linspace(low, high, 301), extra]))


def _degrees(gear: Gear, roll):
    """Convert roll lengths [m] to roll angles [deg]."""
    return np.degrees(np.asarray(roll) / gear.base_radius)


def phase_diagram(phasing: MeshPhasing, *, harmonics: Sequence[int] = (1, 2, 3, 4)) -> Figure:
    """Draw the phases of sun and ring meshes as hands of a dial at every planet, one picture a harmonic.

    Parameters
    ----------
    phasing : MeshPhasing
    harmonics : sequence of int
        A hand upwards has phase zero; phase grows counter-clockwise.
    """
    table, factors = phasing_table(phasing, list(harmonics)), phase_factors(phasing, list(harmonics))
    columns = min(4, len(harmonics))
    rows = -(-len(harmonics) // columns)
    figure, axes = new_figure(rows=rows, columns=columns, width=2.9 * columns, height=3.4 * rows + 0.5)
    centres = np.exp(1j * phasing.planet_angles)
    nearest = np.abs(np.diff([*centres, centres[0]])).min() if phasing.n_planets > 1 else 1.0
    dial = min(0.44 * nearest, 0.42)
    for ax in axes:
        ax.set_axis_off()
        ax.set_aspect("equal")
    for h, (ax, row) in enumerate(zip(axes, factors)):
        ax.plot(*xy(_CIRCLE), color="0.85", linewidth=1.0)
        for n, centre in enumerate(centres):
            ax.plot(*xy(centre + dial * _CIRCLE), color=GREY, linewidth=1.0)
            number = centre * (1.0 + 1.35 * dial)
            ax.text(*xy(number), str(n + 1), ha="center", va="center", fontsize=SIZE - 2)
            ends = centre + 0.9j * dial * row[[n, phasing.n_planets + n]]
            ax.plot(*xy(np.array([centre, ends[0]])), color=BLUE, linewidth=3.6, label="sun mesh")
            ax.plot(*xy(np.array([centre, ends[1]])), color=ORANGE, linewidth=1.6, label="ring mesh")
        ax.text(0.0, 0.0, _what_is_left(table, h), ha="center", va="center", fontsize=SIZE - 2)
        ax.set_title(f"harmonic {table.harmonics[h]}: {table.kind[h]}", fontsize=SIZE - 1)
        ax.set_xlim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
        ax.set_ylim(-1.05 - 1.6 * dial, 1.05 + 1.6 * dial)
    legend_below(figure, columns=2)
    return figure


def _what_is_left(table: PhasingTable, row: int) -> str:
    """Tell what is left of the mesh forces on sun and ring."""
    torque, lateral = table.members[row, :2, :2].max(axis=0)
    left = [
        f"{name} {100 * size:.0f} %"
        for name, size in (("torque", torque), ("lateral", lateral))
        if size > 1e-9
    ]
    return "\n".join(left) or "nothing on\nsun and ring"
