"""Modifications of flanks in REXS and in a case, one way and the other.

Components of a modification are referenced by flanks (``cylindrical_gear_flank``, before version 1.4
``flank_geometry``). Amounts are material that is missing, as of reliefs and crownings of ISO 21771-1; slopes
and twist have the sign of ISO 1328-1, more material at the tip or at the non-datum face. REXS does not print
the signs of slopes. Names of attributes are those of the REXS specifications 1.2 to 2.0 (www.rexs.info).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from femgear.case.quantities import LENGTH
from femgear.case.teeth import flank_form
from femgear.exchange.rexs import Component, Model
from femgear.gears.gear import Gear
from femgear.gears.modifications import (
    EndRelief,
    FlankTwist,
    LeadCrowning,
    LeadSlope,
    ProfileCrowning,
    ProfileSlope,
    RootRelief,
    TipRelief,
)

RELIEFS = {"tip_relief": "tip relief", "root_relief": "root relief"}
READ = (
    *RELIEFS,
    "profile_slope",
    "profile_crowning",
    "profile_twist",
    "helix_slope",
    "helix_crowning",
    "end_relief_datum_face",
    "end_relief_non_datum_face",
)
"""Types of modifications that a case can have."""
NOT_READ = ("triangular_tip_relief", "triangular_root_relief", "topographical_modification")
"""Types that it cannot have."""
_POINTS = 41
"""Points of a relief of one end alone, which becomes a measured lead."""
_ALIKE = 1e-9


@dataclass(frozen=True)
class Flank:
    """Modifications of a flank: ``tables`` as a case has them, and ``left_out`` in words, those that no case can have.

    ``signs`` tells whether there are slopes or twists, whose signs REXS does not define.
    """

    tables: list[dict[str, Any]]
    left_out: list[str]
    signs: bool


def um(length: float) -> str:
    """Write an amount [m]."""
    return f"{float(f'{length * 1e6:.9g}')!r} um".replace(".0 ", " ")


def mm(length: float) -> str:
    """Write a diameter, length or place [m]."""
    return f"{float(f'{length * 1e3:.12g}')!r} mm".replace(".0 ", " ")


def flank_modifications(
    model: Model,
    flank: Component,
    *,
    width: float,
    base_radius: float,
    tip_diameter: float | None,
    internal: bool,
    up: bool,
) -> Flank:
    """Read the modifications of one flank.

    Parameters
    ----------
    width, base_radius, tip_diameter : float
        Of the gear [m]; lengths from the tip need the last one.
    internal : bool
        Whether the gear is.
    up : bool
        Whether the datum face is the end z < 0 of the teeth.
    """
    components = model.related(("reference", "ordered_reference"), "referenced", origin=flank.id)
    parts = [component for component in components if component.type in READ]
    outwards, upwards = -1.0 if internal else 1.0, 1.0 if up else -1.0
    reader = _Reader(model, width, base_radius, tip_diameter, outwards, upwards, [], [])
    reader.left_out += [f"{component}: no case has it" for component in components if component.type in NOT_READ]
    ends: dict[str, Component] = {}
    for part in parts:
        if part.type.startswith("end_relief"):
            ends[part.type] = part
        elif part.type in RELIEFS:
            reader.relief(part)
        else:
            getattr(reader, part.type)(part)
    if ends:
        reader.end_reliefs(ends)
    # a part that takes nothing off is none
    tables = [table for table in reader.tables if table.get("amount") not in ("0 um", "-0 um")]
    signs = any(table["kind"] in ("profile slope", "lead slope", "flank twist") for table in tables)
    return Flank(tables, reader.left_out, signs)


@dataclass
class _Reader:
    """Reader of the modifications of a flank, one after the other.

    Parameters
    ----------
    model : Model
        What the file holds.
    width, base_radius : float
        Of the gear [m].
    tip_diameter : float or None
        Of the gear [m]; lengths from the tip need it.
    outwards : {1.0, -1.0}
        Change of the roll length towards the tip; -1 for internal gears.
    up : {1.0, -1.0}
        1 where the datum face is the end z < 0 of the teeth.
    tables : list of dict
        Modifications read so far, as a case has them.
    left_out : list of str
        Those that no case can have, in words.
    """

    model: Model
    width: float
    base_radius: float
    tip_diameter: float | None
    outwards: float
    up: float
    tables: list[dict[str, Any]]
    left_out: list[str]

    def length(self, part: Component, *attributes: str) -> float | None:
        """First attribute of several that is given [m]."""
        values = (self.model.number(part, name, LENGTH) for name in attributes)
        return next((value for value in values if value is not None), None)

    def exponent(self, part: Component) -> str | None:
        """Shape of a relief as a case has it; None where no case has it, with the words for it."""
        shape = self.model.text(part, "shape_of_relief")
        if self.model.text(part, "specify_tangential_transition") == "true":
            self.left_out.append(f"{part}: its tangential transition; the relief begins with a kink")
        if shape in ("exponential", "logarithmic"):
            self.left_out.append(f"{part}: no case has a relief of the shape {shape}")
            return None
        # an arc that begins tangentially is a parabola, to the square of amount over length
        return "parabolic" if shape in ("parabolic", "circular") else "linear"

    def relief(self, part: Component) -> None:
        """Tip or root relief from its diameter or its length along the path of contact."""
        name, shape = part.type, self.exponent(part)
        amount, start = self.length(part, f"{name}_depth"), self.length(part, f"{name}_datum_diameter")
        if shape is None or not amount:
            return
        table: dict[str, Any] = {"kind": RELIEFS[name], "amount": um(amount)}
        end = self.length(part, f"{name}_evaluation_reference")
        if start is None:
            length = self.length(part, f"{name}_datum_length")
            last = end or (self.tip_diameter if name == "tip_relief" else None)
            if length is None or last is None or 0.5 * last <= self.base_radius:
                self.left_out.append(f"{part}: neither its diameter nor its length from a known end is given")
                return
            roll = math.sqrt(0.25 * last**2 - self.base_radius**2)
            away = -self.outwards if name == "tip_relief" else self.outwards
            table["start_roll_length"] = mm(roll + away * length)
        else:
            table["start_diameter"] = mm(start)
        if end is not None:
            table["end_diameter"] = mm(end)
        self.tables.append(table | {"shape": shape})

    def _profile(self, part: Component, kind: str, amount: float, root: float | None, tip: float | None):
        table: dict[str, Any] = {"kind": kind, "amount": um(amount)}
        table |= {} if root is None else {"start_diameter": mm(root)}
        self.tables.append(table | ({} if tip is None else {"end_diameter": mm(tip)}))

    def profile_slope(self, part: Component) -> None:
        """Slope of the evaluated part of the profile."""
        ends = [self.length(part, f"profile_evaluation_{end}") for end in ("start", "end")]
        if amount := self.length(part, "profile_slope"):
            self._profile(part, "profile slope", amount, *ends)

    def profile_crowning(self, part: Component) -> None:
        """Crowning, and where its ends differ a slope of the difference."""
        tip, root = (self.length(part, f"profile_crowning_at_{end}") or 0.0 for end in ("tip", "root"))
        at = [self.length(part, f"diameter_where_profile_crowning_{end}_is_specified") for end in ("root", "tip")]
        if self.length(part, "profile_highest_point") is not None:
            self.left_out.append(f"{part}: its highest point, which is taken half-way")
        self._profile(part, "profile crowning", 0.5 * (tip + root), at[0], at[1])
        if abs(tip - root) > _ALIKE * max(abs(tip), abs(root)):
            self._profile(part, "profile slope", root - tip, at[0], at[1])

    def profile_twist(self, part: Component) -> None:
        """Twist: profile slope at one end of the width less that at the other, or lead slope of the tip."""
        if amount := self.length(part, "profile_twist"):
            self.tables.append({"kind": "flank twist", "amount": um(self.up * amount)})

    def helix_slope(self, part: Component) -> None:
        """Lead slope of the whole width."""
        start, end = (self.length(part, f"helix_evaluation_{side}") for side in ("start", "end"))
        amount = self.length(part, "helix_slope") or 0.0
        if start is not None and end is not None and abs(end - start) > 0.0:
            amount *= self.width / abs(end - start)
        if amount:
            self.tables.append({"kind": "lead slope", "amount": um(self.up * amount)})

    def helix_crowning(self, part: Component) -> None:
        """Crowning of the lead, and where its ends differ a slope of the difference."""
        amounts = []
        for face in ("datum_face", "non_datum_face"):
            amount = self.length(part, f"helix_crowning_amount_{face}") or 0.0
            place = self.length(part, f"coordinate_where_helix_crowning_is_specified_{face}")
            # a parabola goes on to the ends of the width
            amounts.append(amount * ((0.5 * self.width / place) ** 2 if place else 1.0))
        self.model.text(part, "shape_of_helix_crowning")
        if self.length(part, "helix_highest_point"):
            self.left_out.append(f"{part}: its highest point, which is taken in the middle of the width")
        datum, other = amounts
        self.tables.append({"kind": "lead crowning", "amount": um(0.5 * (datum + other))})
        if abs(datum - other) > _ALIKE * max(map(abs, amounts)):
            self.tables.append({"kind": "lead slope", "amount": um(self.up * (datum - other))})

    def end_reliefs(self, parts: dict[str, Component]) -> None:
        """Reliefs of both ends; where they differ or are no parabolas, a measured lead of the same form."""
        ends: dict[str, tuple[float, float, float]] = {}
        for name, part in parts.items():
            face = name.removeprefix("end_relief_")
            shape = self.exponent(part)
            depth, length = (self.length(part, f"end_relief_{key}_{face}") for key in ("depth", "length"))
            if shape is not None and depth:
                if not length or length > self.width:
                    self.left_out.append(f"{part}: its length within the width is not given")
                    continue
                ends[face] = depth, length, 2.0 if shape == "parabolic" else 1.0
        both = list(ends.values())
        if len(both) == 2 and both[0] == both[1] and both[0][2] == 2.0 and 2.0 * both[0][1] <= self.width:
            self.tables.append({"kind": "end relief", "amount": um(both[0][0]), "length": mm(both[0][1])})
        elif ends:
            self.tables.append(self._measured(ends))

    def _measured(self, ends: dict[str, tuple[float, float, float]]) -> dict[str, Any]:
        half = 0.5 * self.width
        corners = {
            round(side * (half - length * step / (_POINTS - 1)), 12)
            for face, (_, length, _) in ends.items()
            for side in [self.up * (1.0 if face == "non_datum_face" else -1.0)]
            for step in range(_POINTS)
        }
        places = sorted(corners | {-half, half})
        removed = [0.0] * len(places)
        for face, (depth, length, power) in ends.items():
            side = self.up * (1.0 if face == "non_datum_face" else -1.0)
            for i, place in enumerate(places):
                removed[i] += depth * max(1.0 - (half - side * place) / length, 0.0) ** power
        deviations = [um(-removed_there if removed_there else 0.0) for removed_there in removed]
        return {"kind": "measured lead", "places": [mm(along) for along in places], "deviations": deviations}


def written_modifications(
    case: Any, gear: Gear, side: str
) -> tuple[list[tuple[str, dict[str, tuple[str, str]]]], list[str]]:
    """Make types and attributes of the components of a flank, and list the kinds that REXS cannot hold.

    The datum face is the end z < 0; ``side`` is "both" of sun or ring, or the side of a planet.
    """
    written, left_out = [], []
    for modification in flank_form(case, gear, side).modifications:
        parts = [
            (kind, {k: (f"{1e3 * v:.12g}", "mm") for k, v in values.items()})
            for kind, values in _parts(modification, gear)
        ]
        if parts and isinstance(modification, TipRelief | RootRelief):
            parts[0][1]["shape_of_relief"] = ("linear" if modification.power == 1.0 else "parabolic", "none")
        if isinstance(modification, EndRelief):
            for _, attributes in parts:
                attributes["shape_of_relief"] = ("parabolic", "none")
        written += parts
        if not parts:
            left_out.append(_words(modification))
    return written, left_out


def _words(modification: object) -> str:
    power = getattr(modification, "power", None)
    name = "".join(f" {c.lower()}" if c.isupper() else c for c in type(modification).__name__).strip()
    return name if power is None else f"{name} of the power {power:g}"


def _parts(modification: object, gear: Gear) -> Iterator[tuple[str, dict[str, float]]]:
    """Types and lengths [m] of a modification; none where REXS has no such form."""

    def diameter(roll: float | None, default: float) -> float:
        return 2.0 * math.hypot(default if roll is None else roll, gear.base_radius)

    root, tip = gear.form_roll, gear.tip_roll
    match modification:
        case TipRelief() | RootRelief() if modification.power in (1.0, 2.0):
            name, end = ("tip_relief", tip) if isinstance(modification, TipRelief) else ("root_relief", root)
            yield (
                name,
                {
                    f"{name}_depth": modification.amount,
                    f"{name}_datum_diameter": diameter(modification.start, root),
                    f"{name}_evaluation_reference": diameter(modification.end, end),
                },
            )
        case ProfileSlope():
            yield (
                "profile_slope",
                {
                    "profile_slope": modification.amount,
                    "profile_evaluation_start": diameter(modification.start, root),
                    "profile_evaluation_end": diameter(modification.end, tip),
                },
            )
        case ProfileCrowning():
            yield (
                "profile_crowning",
                {
                    "profile_crowning_at_tip": modification.amount,
                    "profile_crowning_at_root": modification.amount,
                    "diameter_where_profile_crowning_root_is_specified": diameter(modification.start, root),
                    "diameter_where_profile_crowning_tip_is_specified": diameter(modification.end, tip),
                },
            )
        case LeadSlope():
            yield "helix_slope", {"helix_slope": modification.amount}
        case LeadCrowning():
            faces = ("datum_face", "non_datum_face")
            yield "helix_crowning", {f"helix_crowning_amount_{face}": modification.amount for face in faces}
        case FlankTwist():
            yield "profile_twist", {"profile_twist": modification.amount}
        case EndRelief():
            for face in ("datum_face", "non_datum_face"):
                yield (
                    f"end_relief_{face}",
                    {f"end_relief_depth_{face}": modification.amount, f"end_relief_length_{face}": modification.length},
                )
