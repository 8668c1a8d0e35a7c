"""Shafts of a REXS unit: which belong together, where they lie, what sections they have.

The axes x, y, z of a gearbox are v, w, u of the unit; a stage turns from w towards v by its angle around -u. That is
how coordinates and angles agree in the files that give both. Shafts lie where their coordinates are, else where the
stages put them: at their centre distances and angles, with middles of gears that face each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from femgear.case.quantities import DENSITY, LENGTH, MODULUS
from femgear.exchange.planetary_stage import with_unit
from femgear.exchange.rexs import Component, Model
from femgear.findings import NOTE

Place = tuple[float, float, float]
Way = tuple[str, str, Place]
"""Ids of two shafts, and the way from the zero of the first to that of the second [m]."""
TOLERANCE = 1e-5
"""By how much coordinates may miss the centre distance of a stage [m]."""
# Places that differ by less are one [m].
_SAME = 1e-8
_DEEPEST = 20


class NoGearbox(Exception):
    """Why a unit makes no gearbox, in words."""


@dataclass(frozen=True)
class Piece:
    """A section of a shaft between two places along z, with diameters at its left and right end [m].

    Parameters
    ----------
    start, end : float
        Along z [m].
    outer, inner : (2,) floats
        Outer and inner diameters, left and right [m].
    """

    start: float
    end: float
    outer: tuple[float, float]
    inner: tuple[float, float]

    def at(self, place: float) -> tuple[float, float]:
        """Outer and inner diameter at a place along z [m]."""
        share = (place - self.start) / (self.end - self.start)
        outer, inner = (ends[0] + share * (ends[1] - ends[0]) for ends in (self.outer, self.inner))
        return outer, inner

    @property
    def table(self) -> dict[str, Any]:
        """Its table in a case."""
        table: dict[str, Any] = {"length": with_unit(self.end - self.start, LENGTH)}
        table["outer_diameter"] = with_unit(self.outer[0], LENGTH)
        if self.inner[0]:
            table["inner_diameter"] = with_unit(self.inner[0], LENGTH)
        if abs(self.outer[1] - self.outer[0]) > _SAME:
            table["end_outer_diameter"] = with_unit(self.outer[1], LENGTH)
        if abs(self.inner[1] - self.inner[0]) > _SAME:
            table["end_inner_diameter"] = with_unit(self.inner[1], LENGTH)
        return table


def file_places(model: Model, shafts: Iterable[Component]) -> dict[str, Place] | None:
    """Find the zeros of shafts from their coordinates (x, y, z) [m]; None where one of them has none.

    NoGearbox: shafts that are not parallel to the u axis of the unit.
    """
    places: dict[str, Place] = {}
    for shaft in shafts:
        axis = model.vector(shaft, "u_axis_vector")
        if axis is not None and len(axis) == 3 and math.dist(axis, (1.0, 0.0, 0.0)) > 1e-6:
            raise NoGearbox(f"{shaft} does not lie along the u axis of the unit")
        place = _place(model, shaft)
        if place is None:
            return None
        u, v, w = place
        places[shaft.id] = (v, w, u)
    return places


def _place(model: Model, part: Component, depth: int = 0) -> Place | None:
    """Coordinates (u, v, w) of a part in the unit [m], by what its own are relative to."""
    offset = model.vector(part, "support_vector", LENGTH)
    if offset is None or len(offset) != 3 or depth > _DEEPEST:
        return None
    base = _reference(model, part)
    if base is None or base.type in ("gear_unit", "gear_casing") or base.id == part.id:
        return offset
    below, axes = _place(model, base, depth + 1), model.vector(base, "w_axis_vector")
    if below is None or (axes is not None and math.dist(axes, (0.0, 0.0, 1.0)) > 1e-6):
        return None
    return below[0] + offset[0], below[1] + offset[1], below[2] + offset[2]


def _reference(model: Model, part: Component) -> Component | None:
    text = model.text(part, "reference_component_for_position") or ""
    return model.components.get(text.removesuffix(".0"))


def stage_way(distance: float, angle: float, along: float) -> Place:
    """Way (x, y, z) [m] from the axis of gear 1 to that of gear 2 at an angle around -u [rad]."""
    return distance * math.sin(angle), distance * math.cos(angle), along


def walked_places(shafts: Sequence[str], ways: Sequence[Way]) -> dict[str, Place]:
    """Find the zeros of shafts (x, y, z) [m] from ways between them; every group of shafts starts at the origin."""
    place: dict[str, Place] = {}
    for start in shafts:
        if start in place:
            continue
        place[start] = (0.0, 0.0, 0.0)
        for _ in shafts:
            for first, second, way in ways:
                if first in place and second not in place:
                    place[second] = _moved(place[first], way, 1.0)
                elif second in place and first not in place:
                    place[first] = _moved(place[second], way, -1.0)
    return place


def _moved(place: Place, way: Place, sense: float) -> Place:
    x, y, z = (a + sense * b for a, b in zip(place, way, strict=True))
    return x, y, z


def misses(place: Mapping[str, Place], ways: Iterable[Way]) -> float:
    """Largest amount by which coordinates miss the centre distances of ways [m]."""
    return max(
        (
            abs(math.dist(place[first][:2], place[second][:2]) - math.hypot(*way[:2]))
            for first, second, way in ways
            if first in place and second in place
        ),
        default=0.0,
    )


def file_pieces(model: Model, shaft: Component, zero: float) -> list[Piece]:
    """List the sections of a shaft whose zero lies at z [m]; sections without sizes are left out."""
    pieces: list[Piece] = []
    end = zero
    for part in model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id):
        if part.type != "shaft_section":
            continue
        keys = ("u_coordinate_on_shaft", "length", "outer_diameter_begin", "outer_diameter_end")
        place, length, begin, outer_end = (model.number(part, key, LENGTH) for key in keys)
        inner, inner_end = (model.number(part, f"inner_diameter_{side}", LENGTH) for side in ("begin", "end"))
        if not length or not begin or min(length, begin) < _SAME:
            text = f"{part} of {shaft} has no length or no diameter: it is left out"
            model.remark(f"shaft {shaft.id}", text, severity=NOTE)
            continue
        start = end if place is None else zero + place
        end, bore = start + length, inner or 0.0
        pieces.append(Piece(start, end, (begin, outer_end or begin), (bore, bore if inner_end is None else inner_end)))
    return pieces


def joined_pieces(pieces: Sequence[Piece]) -> tuple[list[Piece], float]:
    """Put sections one behind the other, with the length of gaps between them [m].

    Where several lie on top of each other the largest outer and the smallest inner diameter count; a gap is closed by
    the thinner one of its neighbours.
    """
    ends: list[float] = []
    for place in sorted(end_place for piece in pieces for end_place in (piece.start, piece.end)):
        if not ends or place - ends[-1] > _SAME:
            ends.append(place)
    pieces_so_far: list[Piece] = []
    gaps = 0.0
    for start, end in pairwise(ends):
        here = [piece for piece in pieces if piece.start <= start + _SAME and piece.end >= end - _SAME]
        if not here:
            gaps += end - start
            after = min(piece.outer[0] for piece in pieces if abs(piece.start - end) <= _SAME)
            outer = min(pieces_so_far[-1].outer[1], after)
            pieces_so_far.append(Piece(start, end, (outer, outer), (0.0, 0.0)))
            continue
        sizes = [[piece.at(place) for piece in here] for place in (start, end)]
        left, right = ((max(outer for outer, _ in at), min(inner for _, inner in at)) for at in sizes)
        pieces_so_far.append(Piece(start, end, (left[0], right[0]), (left[1], right[1])))
    return pieces_so_far, gaps


def material_table(model: Model, shaft: Component) -> dict[str, Any]:
    """Table of the material that a shaft refers to; empty where it has none."""
    for made in model.related(("reference", "ordered_reference"), "referenced", origin=shaft.id):
        if made.type == "material":
            modulus, density = (
                model.number(made, key, of) for key, of in (("elastic_modulus", MODULUS), ("density", DENSITY))
            )
            table = {
                "youngs_modulus": with_unit(modulus, MODULUS) if modulus else None,
                "poisson_ratio": model.number(made, "poisson_ratio"),
                "density": with_unit(density, DENSITY) if density else None,
            }
            return {key: value for key, value in table.items() if value is not None}
    return {}
