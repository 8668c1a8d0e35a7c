"""What a drawing carries of the gears of a case, with its allowances: tables, and attributes of static.nc.

Every figure is that of the computed gear, in the middle of its allowances, with those of the thinnest and the thickest
tooth beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.messages import in_terms_of_the_case
from femgear.case.tooth_measures import gear_limits
from femgear.errors import GeometryError
from femgear.gears.drawing import (
    MeshPlay,
    check_ball,
    check_span,
    chord,
    gear_at_allowance,
    mesh_play,
    normal_thickness,
    over_balls,
    over_pins,
    span,
    span_radius,
    span_teeth_range,
    usual_ball,
    usual_span_teeth,
)
from femgear.gears.gear import Gear
from femgear.gears.tolerances import FlankTolerances, tolerances_of_gear
from femgear.remembered import remembered
from femgear.report.tables import Block

if TYPE_CHECKING:
    from femgear.case.teeth import GearCase
    from femgear.gears.pair import GearPair

_NOTHING = "-"
_TOLERANCES = {
    "f_pT": "pitch",
    "F_pT": "cumulative_pitch",
    "F_alphaT": "profile",
    "f_falphaT": "profile_form",
    "f_HalphaT": "profile_slope",
    "F_betaT": "helix",
    "f_fbetaT": "helix_form",
    "f_HbetaT": "helix_slope",
    "F_rT": "runout",
}
"""Symbols of the flank tolerances by their names."""
_NONE = math.nan, math.nan, math.nan


@dataclass(frozen=True)
class DrawnGear:
    """A gear of a case with its limits.

    Parameters
    ----------
    gear : Gear
        As it is computed, in the middle of its allowances.
    thinnest, thickest : Gear
        At its lower and upper allowance; the gear itself where it has none.
    allowances : (float, float) or None
        Upper and lower allowance of the thickness in the normal section [m].
    helix : float
        Helix angle at the reference circle [rad].
    span_teeth : int or None
        Teeth k of the span, those of the case or the usual ones; None where no span can be measured.
    ball : float or None
        Diameter of balls [m], that of the case or the usual one; None where no ball can be measured.
    """

    gear: Gear
    thinnest: Gear
    thickest: Gear
    allowances: tuple[float, float] | None
    helix: float
    span_teeth: int | None
    ball: float | None

    def limits(self, measure: Callable[[Gear], float]) -> tuple[float, float, float]:
        """Take a measure of the computed gear, the thinnest and the thickest."""
        return measure(self.gear), measure(self.thinnest), measure(self.thickest)

    @property
    def thickness(self) -> tuple[float, float, float]:
        """s_n on the reference circle [m]."""
        return self.limits(lambda gear: normal_thickness(gear, self.helix))

    @property
    def span(self) -> tuple[float, float, float]:
        """W_k [m]; NaN without a span."""
        teeth = self.span_teeth
        return _NONE if teeth is None else self.limits(lambda gear: span(gear, teeth, self.helix))

    @property
    def over_balls(self) -> tuple[float, float, float]:
        """M_dK [m]; NaN without a ball."""
        ball = self.ball
        return _NONE if ball is None else self.limits(lambda gear: over_balls(gear, ball, self.helix))

    @property
    def over_pins(self) -> tuple[float, float, float]:
        """M_dR [m], of pins as thick as the balls; NaN without a ball."""
        ball = self.ball
        return _NONE if ball is None else self.limits(lambda gear: over_pins(gear, ball, self.helix))


@remembered(latest=16)
def drawn_gears(case: Any) -> tuple[DrawnGear, ...]:
    """Collect the gears of a case with their limits.

    GeometryError: a span or a ball that the case gives and that its gear cannot have (E-RANGE, E-CHOICE), with file
    and line.
    """
    helix = case.helix_angle or 0.0
    try:
        return tuple(_drawn(case, gear, helix) for gear in planetary_set(case).gears)
    except GeometryError as error:
        in_terms_of_the_case(error, case)
        raise


def _drawn(case: Any, gear: Gear, helix: float) -> DrawnGear:
    section, allowances = getattr(case, gear.name), gear_limits(case, gear)
    teeth, ball = section.span_teeth, section.ball_diameter
    if teeth is not None:
        check_span(gear, teeth, helix)
    if ball is not None:
        check_ball(gear, ball, helix)
    upper, lower = (gear_at_allowance(gear, value, helix) for value in allowances) if allowances else (gear, gear)
    return DrawnGear(
        gear,
        lower,
        upper,
        allowances,
        helix,
        usual_span_teeth(gear, helix) if teeth is None else teeth,
        usual_ball(gear, helix) if ball is None else ball,
    )


def mesh_plays(case: GearCase) -> tuple[tuple[MeshPlay, MeshPlay, MeshPlay], ...]:
    """Compute the play of every kind of mesh: of the computed gears, the least and the largest of their allowances."""
    drawn, gears, helix = drawn_gears(case), planetary_set(case), case.helix_angle or 0.0

    def play(pair: GearPair, numbers: tuple[int, int], which: str) -> MeshPlay:
        return mesh_play(pair.with_gears([getattr(drawn[number], which) for number in numbers]), helix)

    return tuple(
        (play(pair, mates, "gear"), play(pair, mates, "thickest"), play(pair, mates, "thinnest"))
        for pair, mates in zip(gears.kinds, gears.mates, strict=True)
    )


def drawing_attributes(case: GearCase) -> dict[str, Any]:
    """Collect the attributes of static.nc that tell what a drawing carries, gears or limits in their order."""
    drawn, kinds = drawn_gears(case), planetary_set(case).kinds
    names = [f"{pair.gear_1.name}_{pair.gear_2.name}" for pair in kinds]
    plays = dict(zip(names, mesh_plays(case), strict=True))
    # (gears, 3): as computed, least, largest
    measures = {name: np.array([getattr(d, name) for d in drawn]) for name in ("thickness", "span", "over_balls")}
    return {
        "drawing_gears": ", ".join(drawn_gear.gear.name for drawn_gear in drawn),
        "profile_shift": np.array([d.gear.profile_shift / math.cos(d.helix) for d in drawn]),
        "tip_diameter": np.array([2.0 * d.gear.tip_radius for d in drawn]),
        "span_teeth": np.array([d.span_teeth or 0 for d in drawn]),
        "ball_diameter": np.array([math.nan if d.ball is None else d.ball for d in drawn]),
        **{
            f"{'tooth_' * (name == 'thickness')}{name}{limit}": limits[:, number]
            for name, limits in measures.items()
            for number, limit in enumerate(("", "_least", "_largest"))
        },
        **{f"normal_play_{name}": np.array([play.normal for play in limits]) for name, limits in plays.items()},
    }


def describe_drawing(case: Any) -> Iterator[Block]:
    """Tabulate thickness, chord, span and dimension over balls of all gears, and the play of their meshes.

    With ``strength.quality`` the flank tolerances of this class come beside them.
    """
    drawn, helix = drawn_gears(case), case.helix_angle or 0.0
    rows: dict[str, Callable[[DrawnGear], str]] = {
        "tooth thickness s_n [mm]": lambda d: _length(d.thickness),
        "allowances A_sne, A_sni [um]": lambda d: _allowances(d.allowances),
        "chordal thickness [mm]": lambda d: _length(d.limits(lambda gear: chord(gear, helix)[0])),
        "chordal height [mm]": lambda d: f"{1e3 * chord(d.gear, helix)[1]:.4f}",
        "span over teeth k": _span_teeth,
        "span W_k [mm]": lambda d: _length(d.span),
        "span touches at diameter [mm]": lambda d: (
            _NOTHING if d.span_teeth is None else f"{2e3 * span_radius(d.gear, d.span_teeth, helix):.3f}"
        ),
        "ball diameter D_M [mm]": lambda d: _NOTHING if d.ball is None else f"{1e3 * d.ball:.5g}",
        "over balls M_dK, internal between [mm]": lambda d: _length(d.over_balls),
    }
    if helix and any(d.gear.teeth % 2 and not d.gear.internal for d in drawn):
        rows["over pins M_dR [mm]"] = lambda d: _length(d.over_pins)
    notes = [f"thickness and chord at the reference circle{' in the normal section' if helix else ''}"]
    if any(d.allowances for d in drawn):
        notes.append("computed teeth lie in the middle of their allowances; in brackets the thinnest and the thickest")
    names = (d.gear.name.replace("_", " ") for d in drawn)
    yield Block("Drawing", ("", *names), tuple((name, *map(text, drawn)) for name, text in rows.items()), tuple(notes))
    yield _play_block(case)
    if (tolerance_class := case.strength.quality) is not None:
        yield _class_block(drawn, tolerance_class)


def _class_block(drawn: tuple[DrawnGear, ...], tolerance_class: int) -> Block:
    """Tabulate the flank tolerances of all gears in a class; what the standard does not cover is a note."""
    tolerances, notes = list[FlankTolerances | None](), list[str]()
    for gear in (d.gear for d in drawn):
        try:
            tolerances.append(tolerances_of_gear(gear, tolerance_class))
        except GeometryError as error:
            tolerances.append(None)
            notes.append(f"{gear.name.replace('_', ' ')}: {error.message}")
    rows = tuple(
        (f"{symbol} [um]", *(_NOTHING if t is None else f"{1e6 * getattr(t, name):.6g}" for t in tolerances))
        for symbol, name in _TOLERANCES.items()
    )
    names = (d.gear.name.replace("_", " ") for d in drawn)
    return Block(f"Flank tolerances, ISO 1328-1, class {tolerance_class}", ("", *names), rows, tuple(notes))


def _play_block(case: GearCase) -> Block:
    """Tabulate the play of every kind of mesh, with its least and largest where gears have allowances."""
    plays, kinds = mesh_plays(case), planetary_set(case).kinds
    rows = {
        "normal j_bn [um]": lambda play: play.normal,
        "circumferential j_wt, on the pitch circle [um]": lambda play: play.circumferential,
        "radial j_r [um]": lambda play: play.radial,
    }
    names = [f"{pair.gear_1.name}-{pair.gear_2.name}".replace("_", " ") for pair in kinds]
    cells = tuple(
        (name, *(_length([value(p) for p in play], 1e6, 2) for play in plays)) for name, value in rows.items()
    )
    notes = ["deviations of the teeth, of the centre distance and of axes, and heat, come beside it"]
    if any(d.allowances for d in drawn_gears(case)):
        notes.insert(0, "in brackets the least and the largest by the allowances")
    return Block("Play of the meshes", ("", *names), cells, tuple(notes))


def _length(limits: Any, factor: float = 1e3, digits: int = 4) -> str:
    """Write a length with its limits in brackets, where they differ; in mm by default."""
    computed, *ends = (round(factor * value, digits) + 0.0 for value in limits)
    if math.isnan(computed):
        return _NOTHING
    text = f"{computed:.{digits}f}"
    return text if ends == [computed, computed] else f"{text} ({ends[0]:.{digits}f} to {ends[1]:.{digits}f})"


def _allowances(allowances: tuple[float, float] | None) -> str:
    return _NOTHING if allowances is None else ", ".join(f"{1e6 * value:.6g}" for value in allowances)


def _span_teeth(drawn: DrawnGear) -> str:
    """Write k, and between what it may lie."""
    ends = span_teeth_range(drawn.gear, drawn.helix)
    if drawn.span_teeth is None or ends is None:
        return _NOTHING
    return f"{drawn.span_teeth} ({ends[0]} to {ends[1]})" if ends[0] < ends[1] else f"{drawn.span_teeth}"
