"""Profile shifts and centre distance that close a set or a pair of given teeth, shared between its gears.

A grid of centre distances and shifts is judged in closed form (`_judged`); what comes out best is closed with
exact teeth and checked. Lengths here are in modules of the transverse section.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.checks import check_meshes
from femgear.gears.gear import Gear
from femgear.gears.pair import GearPair
from femgear.gears.planetary import PlanetarySet
from femgear.gears.profile import BasicRack, inv
from femgear.gears.tips import settled_tips

LEAST_LAND, LEAST_RATIO = 0.25, 1.22
"""Tooth thickness at the tips [modules] and transverse contact ratio that are aimed at."""
LARGEST_RING_SHIFT = 0.6
"""Beyond it [modules] the gaps of rings have little room for the rounded tips of their cutters."""
RING_ROUNDINGS = (0.2, 0.15, 0.1, 0.05)
"""Tip roundings of the ring's cutter [modules] that are tried where that of the rack finds no room."""
_UNIT = 1e-3
"""Module of the gears that are tried [m]."""
_TRIED = 30
"""Choices that are closed with exact teeth, and what lies between two of them [modules]."""
_APART = 0.04
_WEIGHTS = 1e3, 2.0
"""Of what teeth lack and of the centre distance, in the cost of a choice."""
_LOST_RATIO, _LOST_WEIGHT = 1.02, 4.0
"""Contact ratio below which contact may be lost, and what that weighs beside a contact ratio that is low."""


@dataclass(frozen=True)
class SharedShifts:
    """Profile shifts that close a set (sun, planet, ring) or a pair (gears 1 and 2).

    Parameters
    ----------
    gears : PlanetarySet or GearPair
        Of module 1 mm in the transverse section, tips as long as run free of their mates.
    rule : str
        How the shift is shared, in words; empty where there is none to share.
    lacks : tuple of str
        Codes of what the meshes and gears are still warned of.
    """

    gears: PlanetarySet | GearPair
    rule: str
    lacks: tuple[str, ...] = ()

    @property
    def shifts(self) -> tuple[float, ...]:
        """Profile shifts of all gears [transverse modules]."""
        return tuple(gear.profile_shift for gear in self.gears.gears)

    @property
    def centre_distance(self) -> float:
        """Centre distance [transverse modules]."""
        return self.gears.centre_distance / _UNIT


def share_shifts(
    teeth: Sequence[int],
    pressure_angle: float,
    rack: BasicRack,
    *,
    backlash: float = 0.0,
    centre_distance: float | None = None,
    step: float = 1e-9,
) -> SharedShifts:
    """Choose centre distance and profile shifts of the teeth of sun, planet and ring, or of two gears.

    Teeth that close without shifts stay without, unless they would be undercut or lose contact. Else the
    centre distance is the larger one of the two meshes without shifts, if that goes, and sun and planet share
    their sum so that the specific sliding at both ends of the path of contact is equal (DIN 3992; G. Niemann
    and H. Winter, Maschinenelemente, vol. 2, section 22.1.7), as far as undercut, tips and contact ratios
    allow.

    Parameters
    ----------
    pressure_angle : float
        Of the transverse section [rad], as the rack.
    backlash : float
        On the reference circles [modules], half from either gear.
    centre_distance : float, optional
        [modules] None chooses it, in multiples of `step`.

    Raises
    ------
    GeometryError
        The first fault of the best choice, where none closes.
    """
    best, fault, fewest = None, None, None
    roundings = [rack.root_radius, *(r for r in RING_ROUNDINGS if r < rack.root_radius)][: 4 * len(teeth) - 7]
    for rounding in roundings:
        ring_rack, no_room = replace(rack, root_radius=rounding), math.inf
        for a, shift in _candidates(teeth, pressure_angle, rack, centre_distance, step):
            # what has no room in the gaps of a ring has less in those of one that is shifted further
            shifts = _closing_shifts(teeth, pressure_angle, np.array(a), np.array(shift))
            if len(teeth) == 3 and shifts[2] >= no_room:
                continue
            try:
                gears = _closed(teeth, pressure_angle, (rack, rack, ring_rack), a, shift, backlash)
                codes = [finding.code for finding in check_meshes(gears) if finding.code not in ("W-TIP", "W-RIM")]
            except GeometryError as error:
                fault = fault or error
                if error.code == "E-ROOT-RADIUS" and error.gear == "ring":
                    no_room = float(shifts[2])
                continue
            if fewest is None or len(codes) < len(fewest):
                best, fewest = gears, codes
            if not codes:
                return _shared(gears)
    if best is not None and fewest is not None:
        return _shared(best, tuple(dict.fromkeys(fewest)))
    if fault is not None:
        raise fault
    raise GeometryError(
        "no profile shifts close these teeth" + ("" if centre_distance is None else " at this distance"),
        code="E-GEOMETRY",
        key="--teeth" if centre_distance is None else "--centre-distance",
        value=" ".join(map(str, teeth)),
        limit=f"a centre distance of about {0.5 * (teeth[0] + teeth[1]):g} transverse modules",
        remedy="give another centre distance, module or teeth, or leave the centre distance out",
    )


def _shared(gears: PlanetarySet | GearPair, lacks: tuple[str, ...] = ()) -> SharedShifts:
    shifted = any(abs(gear.profile_shift) > 1e-9 for gear in gears.gears)
    return SharedShifts(gears, "equal sliding" if shifted else "", lacks)


def _closed(teeth, pressure_angle, racks, a: float, shift: float, backlash: float) -> PlanetarySet | GearPair:
    """Gears with the shift of the first one at a centre distance, tips free."""
    shifts = _closing_shifts(teeth, pressure_angle, np.array(a), np.array(shift))
    names = ("sun", "planet", "ring") if len(teeth) == 3 else ("gear_1", "gear_2")
    gears = [
        Gear(
            z,
            _UNIT,
            pressure_angle,
            float(x),
            10 * _UNIT,
            _rim(z, float(x), name),
            internal=name == "ring",
            rack=rack,
            thickness_allowance=0.5 * backlash * _UNIT,
            name=name,
            tip_open=True,
        )
        for z, x, rack, name in zip(teeth, shifts, racks, names)
    ]
    if len(gears) == 2:
        return settled_tips(GearPair(gears[0], gears[1], a * _UNIT), free=names)
    sun, planet, ring = gears
    return settled_tips(PlanetarySet(sun, planet, ring, a * _UNIT, (0.0,)), free=names)


def _rim(teeth: int, shift: float, name: str) -> float:
    """Rim that is thick enough."""
    return _UNIT * (0.5 * teeth + shift + 8.0) if name == "ring" else _UNIT * 0.05 * teeth


def _candidates(
    teeth, alpha: float, rack: BasicRack, centre_distance: float | None, step: float
) -> Iterator[tuple[float, float]]:
    """Centre distances and shifts of the first gear, from the best on, apart from each other."""
    usual = [0.5 * (teeth[0] + teeth[1])]
    if len(teeth) == 3:
        usual += [0.5 * (teeth[2] - teeth[1])]
    least, low, high = max(usual) * math.cos(alpha), min(usual), max(usual)
    preferred = high if len(usual) == 1 or abs(low - high) < 1e-9 else _stepped(high, step)
    if centre_distance is not None:
        distances = np.array([centre_distance])
        preferred = centre_distance
    else:
        grid = [_stepped(shift_1, step) for shift_1 in np.arange(low - 0.3, high + 1.5, 0.05)]
        distances = np.array(sorted({preferred, *grid}))
    distances = distances[distances >= least * (1.0 + 1e-9)]
    shifts = np.round(np.arange(-0.7, 1.41, 0.02), 9)
    a, x = (grid.ravel() for grid in np.meshgrid(distances, shifts, indexing="ij"))
    if not len(a):
        return
    cost = _judged(teeth, alpha, rack, a, x, preferred)
    taken: list[tuple[float, float]] = []
    for i in np.argsort(cost, kind="stable"):
        place = float(a[i]), float(x[i])
        if all(abs(place[0] - b) + abs(place[1] - y) > _APART for b, y in taken):
            taken.append(place)
            yield place
        if len(taken) == _TRIED:
            return


def _stepped(distance: float, step: float) -> float:
    return round(distance / step) * step


def _closing_shifts(teeth, alpha: float, a, shift) -> list[np.ndarray]:
    """Shifts of all gears without play at centre distances, from that of the first gear (ISO 21771)."""
    total = teeth[0] + teeth[1]
    shifts = [shift, _total_shift(total, alpha, a) - shift]
    if len(teeth) == 3:
        shifts += [_total_shift(teeth[2] - teeth[1], alpha, a) + shifts[1]]
    return shifts


def _total_shift(teeth: int, alpha: float, a):
    return teeth * (inv(_working(teeth, alpha, a)) - inv(alpha)) / (2.0 * math.tan(alpha))


def _working(teeth: int, alpha: float, a):
    return np.arccos(np.minimum(0.5 * teeth * math.cos(alpha) / a, 1.0))


def _judged(teeth, alpha: float, rack: BasicRack, a, shift, preferred: float) -> np.ndarray:
    """Cost of centre distances and shifts: what teeth lack, then the distance, then unequal sliding."""
    x = _closing_shifts(teeth, alpha, a, shift)
    base = [0.5 * z * math.cos(alpha) for z in teeth]
    length = a * np.sin(_working(teeth[0] + teeth[1], alpha, a))
    shortened = np.maximum(0.5 * (teeth[0] + teeth[1]) + x[0] + x[1] - a, 0.0)
    form = [_form_roll(z, shift_here, alpha, rack) for z, shift_here in zip(teeth[:2], x[:2], strict=True)]
    tip = [
        np.sqrt(np.maximum((0.5 * z + rack.addendum + shift_here - shortened) ** 2 - rb**2, 1e-12))
        for z, shift_here, rb in zip(teeth[:2], x[:2], base, strict=False)
    ]
    tip = [np.minimum(roll, length - other) for roll, other in zip(tip, form[::-1], strict=True)]
    pitch = math.pi * math.cos(alpha)
    lacking = [np.maximum(-roll, 0.0) for roll in form]
    lacking += [_short_contact((tip[0] + tip[1] - length) / pitch)]
    lacking += [
        np.maximum(LEAST_LAND - _land(z, shift_here, alpha, roll, rb, 1.0), 0.0)
        for z, shift_here, roll, rb in zip(teeth[:2], x[:2], tip, base, strict=False)
    ]
    if len(teeth) == 3:
        lacking += _ring_lacks(teeth, alpha, rack, a, x, form[1], tip[1])
    sliding = _sliding(teeth, length, tip)
    unequal = np.where(np.abs(x[0] + x[1]) < 1e-6, np.abs(x[0]), np.abs(sliding[0] - sliding[1]))
    return _WEIGHTS[0] * sum(lacking) + _WEIGHTS[1] * np.abs(a - preferred) + 0.1 * unequal


def _ring_lacks(teeth, alpha: float, rack: BasicRack, a, x, form, tip) -> list[np.ndarray]:
    """What the mesh of planet and ring lacks, with the ring's tips as low as the planets allow."""
    base = 0.5 * teeth[2] * math.cos(alpha)
    length = a * np.sin(_working(teeth[2] - teeth[1], alpha, a))
    rack_tip = np.sqrt(np.maximum((0.5 * teeth[2] - rack.addendum + x[2]) ** 2 - base**2, 0.0))
    ring = np.maximum(rack_tip, length + np.maximum(form, 0.0))
    ratio = (tip - ring + length) / (math.pi * math.cos(alpha))
    return [
        _short_contact(ratio),
        np.maximum(LEAST_LAND - _land(teeth[2], x[2], alpha, ring, base, -1.0), 0.0),
        np.maximum(np.abs(x[2]) - LARGEST_RING_SHIFT, 0.0),
    ]


def _short_contact(ratio) -> np.ndarray:
    """What contact ratios lack, more where contact may be lost."""
    return np.maximum(LEAST_RATIO - ratio, 0.0) + _LOST_WEIGHT * np.maximum(_LOST_RATIO - ratio, 0.0)


def _form_roll(teeth: int, shift, alpha: float, rack: BasicRack):
    """Roll length where the involute of a rack begins, as `RackTip.junction_roll`; negative with undercut."""
    depth, sine = rack.dedendum - shift - rack.root_radius, math.sin(alpha)
    return 0.5 * teeth * sine - depth / sine - rack.root_radius


def _land(teeth: int, shift, alpha: float, roll, base: float, sense: float):
    """Tooth thickness at a roll length; sense -1 of internal gears."""
    radius, angle = np.hypot(base, roll), np.arctan2(roll, base)
    half = 0.5 * math.pi / teeth
    half = half + sense * (2.0 * shift * math.tan(alpha) / teeth + inv(alpha) - inv(angle))
    return 2.0 * radius * half


def _sliding(teeth, length, tip) -> tuple[np.ndarray, np.ndarray]:
    """Specific sliding, its size, at the roots of gear 1 and gear 2: ``z_1 rho_2 / (z_2 rho_1) - 1``."""
    ratio = teeth[0] / teeth[1]
    root_1, root_2 = np.maximum(length - tip[1], 1e-3), np.maximum(length - tip[0], 1e-3)
    roll_1, roll_2 = (np.maximum(roll, 1e-3) for roll in tip)
    return np.log(ratio * roll_2 / root_1), np.log(roll_1 / (ratio * root_2))
