"""Causes of a measured spectrum: errors of a set that would make its abnormal lines, with the size of each.

A small error changes the lines in proportion to its size. So the lines of the set with an error of a micrometre, less
those without, over a micrometre, are the derivative of the spectrum; the size of the error is that at which they come
nearest to the measured ones. How the lines are spread tells the causes apart, as the modal assurance criterion does
with modes (R. J. Allemang and D. L. Brown, A correlation coefficient for modal vector analysis, 1982).

Around every mesh harmonic heights are taken over those of the normal lines there, measured and computed alike: so the
path to the sensor, its calibration and the strength of that harmonic drop out. Harmonics without a normal line that was
measured are left aside.

Faults of teeth do not answer in proportion: lines of two sizes are computed, and the size is that at which the heights
are the measured ones, between both by a power of the size. Where it would lie beyond them, or a tooth is missing, the
likeness is less by the square of how far the heights are off.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.housing.orders import FOREIGN, NORMAL, UNEQUAL, spacing_symmetry
from femgear.measured.heard_set import HeardSet
from femgear.measured.verdict import MeasuredVerdict
from femgear.report.tables import Block
from femgear.run import grid_cache, solve
from femgear.stages.protocol import Progress
from femgear.study.fault_records import solved_lines
from femgear.study.fault_sizes import FaultPlace, carrying_flanks, fault_entries
from femgear.trains.reading import with_values

_STEP = 1e-6
"""Error of which lines are computed [m]: contacts answer to it in proportion."""
_COARSE = {"static.flank_elements": 8, "static.positions": 16, "static.stresses": False, "housing.published": None}
_ONE = {"planet": 1}
_OLD = ("set.pin_errors", "planet.individual", "carrier.errors", "sun.errors", "planet.errors", "ring.errors")
_OLD += ("sun.fault", "planet.fault", "ring.fault")


@dataclass(frozen=True)
class Cause:
    """An error that would make lines.

    Parameters
    ----------
    name : str
        In words.
    entry : str
        Of the case file.
    value : callable
        ``(size) -> value`` of the entry, the size as text with its unit.
    turns : str
        Part whose turns the lines show: ``"sun"``, ``"planet"``, or empty for the carrier.
    """

    name: str
    entry: str
    value: Callable[[str], Any]
    turns: str = ""


CAUSES = (
    Cause("a planet's pin, along its circle", "set.pin_errors", lambda size: [_ONE | {"tangential": size}]),
    Cause("a planet's pin, outwards", "set.pin_errors", lambda size: [_ONE | {"radial": size}]),
    Cause("thinner teeth of one planet", "planet.individual", lambda size: [_ONE | {"thickness_reduction": size}]),
    Cause("runout of the carrier's pin circle", "carrier.errors", lambda size: {"runout_amplitude": size}),
    Cause("runout of the sun", "sun.errors", lambda size: {"runout_amplitude": size}, "sun"),
    Cause("runout of one planet", "planet.individual", lambda size: [_ONE | {"runout_amplitude": size}], "planet"),
)
"""Errors that are tried."""
_FAULT_SIZES = {"crack": (0.4, 1.0), "spall": (0.2, 0.5), "missing": (0.0,)}
"""Sizes of faults whose lines are computed [modules]; a missing tooth has none."""
_FAULT_WORDS = {
    "crack": "crack in a tooth of the {}",
    "spall": "spall on a tooth of the {}",
    "missing": "missing tooth of the {}",
}


_ALIKE, _EXPLAINS = 0.02, 0.5
"""Difference of likeness below which causes cannot be told apart, and likeness from which on that is said."""


@dataclass(frozen=True)
class RankedCause:
    """A cause with the size that comes nearest to the measured lines.

    Parameters
    ----------
    cause : Cause
        What it is.
    size : float
        Of the error [m].
    explained : float
        Likeness of its lines and the measured abnormal ones, 0 to 1: the squared cosine of their heights.
    strongest : tuple of int or float
        Orders of its strongest lines.
    """

    cause: Cause
    size: float
    explained: float
    strongest: tuple[float, ...]


def rank_causes(case: Any, verdict: MeasuredVerdict, *, progress: Progress | None = None) -> tuple[RankedCause, ...]:
    """Rank the errors that would make the abnormal lines of a recording, best first, of like ones the smallest.

    Lines that are not from this gearbox are left aside. CaseError: errors that the case has already (E-CHOICE), no mesh
    harmonic with a normal line (E-RANGE).
    """
    for entry in _OLD:
        section, _, name = entry.partition(".")
        if getattr(getattr(case, section), name):
            remedy = "take the errors out: they are what is asked for"
            raise CaseError("the case has errors already", code="E-CHOICE", key=entry, remedy=remedy)
    abnormal = {line.order: line.amplitude for line in verdict.lines if line.place.verdict not in (NORMAL, FOREIGN)}
    if not abnormal:
        return ()
    speed = verdict.signal.speed * 60.0 / verdict.gear_set.carrier_per_turn[verdict.gear_set.input]
    case = with_values(case, _COARSE | {"operation.speeds": [f"{speed:.6g} rpm"], "housing.measured": None})
    healthy = _heights(case, progress)
    scales = _scales(verdict, healthy)
    abnormal = {order: height * scales.get(_harmonic(order, verdict), 0.0) for order, height in abnormal.items()}
    causes = [cause for cause in CAUSES if _fits(cause, verdict.gear_set, abnormal)]
    derivatives = [_derivative(case, cause, healthy, verdict, scales, progress) for cause in causes]
    ranked = [
        _fitted(cause, derivative, abnormal, verdict.tolerance)
        for cause, derivative in zip(causes, derivatives, strict=True)
    ]
    ranked += _ranked_faults(case, verdict, abnormal, scales, progress)
    smallest_first = sorted(ranked, key=lambda entry: math.inf if math.isnan(entry.size) else entry.size)
    return tuple(sorted(smallest_first, key=lambda entry: -round(entry.explained, 2)))


def _ranked_faults(
    case: Any,
    verdict: MeasuredVerdict,
    abnormal: Mapping[float, float],
    scales: Mapping[int, float],
    progress: Progress | None,
) -> Iterator[RankedCause]:
    """Rank faults of teeth of the parts whose turns lines have."""
    gears, steps = planetary_set(case), Steps()
    for gear, kind in product(_heard_parts(verdict), _FAULT_SIZES):
        sizes = [share * gears.sun.module for share in _FAULT_SIZES[kind]]
        flank = carrying_flanks(gears, gear, back=case.torque_on_first_gear() < 0.0)[0]
        fitted = []
        for number, size in enumerate(sizes):
            if progress is not None:
                progress(f"{kind} of the {gear}", float(number), float(len(sizes)))
            place = FaultPlace(kind, gear, int(gear == "planet"), 0, "" if kind == "missing" else flank, size)
            lines = _fault_heights(with_values(case, fault_entries(place, gears)), steps)
            made = _over_normal(lines, {}, lines, verdict, scales)
            cause = Cause(_FAULT_WORDS[kind].format(gear), f"{gear}.fault", lambda size: size, gear)
            fitted.append(_fitted(cause, made, abnormal, verdict.tolerance))
        yield _between_sizes(fitted, sizes)


def _heard_parts(verdict: MeasuredVerdict) -> list[str]:
    """Name sun and planet where lines have their turns, or may have: turns that are whole give whole orders."""
    parts = {line.place.part for line in verdict.lines if line.place.part}
    if any(line.verdict == UNEQUAL for line in verdict.lines):
        parts |= {part for part in ("sun", "planet") if _turns_whole(verdict.gear_set, part)}
    return sorted(parts)


def _turns_whole(gears: HeardSet, part: str) -> bool:
    """Whether a part makes whole turns in one of the carrier."""
    teeth = gears.sun if part == "sun" else gears.planet
    return teeth is not None and gears.ring % teeth == 0


def _between_sizes(fitted: Sequence[RankedCause], sizes: Sequence[float]) -> RankedCause:
    """Find the size of a fault at which its heights are the measured ones, of fits at some sizes [m], ascending.

    The ``size`` of a fit is the factor by which its heights would have to grow.
    """
    factors = [fit.size for fit in fitted]
    if not all(factor > 0.0 for factor in factors):
        return replace(fitted[-1], size=math.nan, explained=0.0)
    if len(sizes) == 1:
        return replace(fitted[0], size=math.nan, explained=fitted[0].explained * min(factors[0], 1.0 / factors[0]) ** 2)
    at = np.interp(0.0, -np.log(factors), np.log(sizes))
    nearest = int(np.abs(np.log(sizes) - at).argmin())
    off = factors[0] if factors[0] < 1.0 else 1.0 / factors[-1] if factors[-1] > 1.0 else 1.0
    return replace(fitted[nearest], size=float(np.exp(at)), explained=fitted[nearest].explained * off**2)


def _fault_heights(case: Any, steps: Steps) -> dict[float, complex]:
    """Lines of the sensor [m/s^2] of a set with a fault by their orders, at the only speed."""
    lines = solved_lines(case, cache=grid_cache(), steps=steps)
    return dict(zip(np.round(lines.order, 6).tolist(), lines.acceleration[0].tolist(), strict=True))


def _harmonic(order: float, verdict: MeasuredVerdict) -> int:
    """Mesh harmonic that an order lies next to."""
    return round(order / verdict.gear_set.ring)


def _heights(case: Any, progress: Progress | None) -> dict[float, complex]:
    """Lines of the sensor [m/s^2] by their orders, at the only speed."""
    lines = solve(case, "housing", **({} if progress is None else {"progress": progress}))["housing"].exact
    return dict(zip(np.round(lines.order, 6).tolist(), lines.acceleration[0].tolist(), strict=True))


def _scales(verdict: MeasuredVerdict, healthy: Mapping[float, complex]) -> dict[int, float]:
    """One over the root of the squares of the normal lines [1/(m/s^2)], measured, by their mesh harmonics.

    Of harmonics alone of which lines are computed at the same orders.
    """
    squares = dict[int, float]()
    for line in verdict.lines:
        if line.verdict == NORMAL and abs(healthy.get(float(round(line.order)), 0.0)) > 0.0:
            harmonic = _harmonic(line.order, verdict)
            squares[harmonic] = squares.get(harmonic, 0.0) + line.amplitude**2
    squares.pop(0, None)
    if not squares:
        message, remedy = "no mesh harmonic has a normal line", "lower --threshold, or record more turns"
        raise CaseError(message, code="E-RANGE", key="--causes", limit="one or more", remedy=remedy)
    return {harmonic: square**-0.5 for harmonic, square in squares.items()}


def _fits(cause: Cause, gears: HeardSet, abnormal: Mapping[float, float]) -> bool:
    """Whether a cause can make any of the lines: errors of planets alone cost long computations."""
    if cause.turns != "planet" or gears.planet is None:
        return True
    return any(abs(order - round(order)) > 0.01 for order in abnormal) or _turns_whole(gears, "planet")


def _derivative(
    case: Any,
    cause: Cause,
    healthy: Mapping[float, complex],
    verdict: MeasuredVerdict,
    scales: Mapping[int, float],
    progress: Progress | None,
) -> dict[float, float]:
    """Abnormal lines over the normal ones of their harmonic [1/m] that a cause makes, by their orders."""
    lines = _heights(with_values(case, {cause.entry: cause.value(f"{_STEP * 1e6:g} um")}), progress)
    made = _over_normal(lines, healthy, healthy, verdict, scales)
    return {order: height / _STEP for order, height in made.items()}


def _over_normal(
    lines: Mapping[float, complex],
    less: Mapping[float, complex],
    normal: Mapping[float, complex],
    verdict: MeasuredVerdict,
    scales: Mapping[int, float],
) -> dict[float, float]:
    """Abnormal lines, less others, over the normal ones of their harmonic among some lines, by their orders."""
    symmetry = spacing_symmetry(verdict.gear_set.angles)
    squares = dict.fromkeys(scales, 0.0)
    for line in verdict.lines:
        if line.verdict == NORMAL and _harmonic(line.order, verdict) in squares:
            squares[_harmonic(line.order, verdict)] += abs(normal.get(float(round(line.order)), 0.0)) ** 2
    return {
        order: abs(height - less.get(order, 0.0)) * squares[_harmonic(order, verdict)] ** -0.5
        for order, height in lines.items()
        if squares.get(_harmonic(order, verdict), 0.0) > 0.0 and (order != round(order) or round(order) % symmetry)
    }


def _fitted(
    cause: Cause, derivative: Mapping[float, float], abnormal: Mapping[float, float], tolerance: float
) -> RankedCause:
    """Size of a cause by least squares, and how far its lines are those that were measured."""
    orders = np.array([*derivative])
    made = np.array([*derivative.values()])
    measured = np.zeros(len(orders))
    others = 0.0
    for order, height in abnormal.items():
        near = int(np.abs(orders - order).argmin()) if len(orders) else 0
        if len(orders) and abs(orders[near] - order) <= tolerance:
            measured[near] = height
        else:
            others += height**2
    both, all_made, all_measured = measured @ made, made @ made, measured @ measured + others
    strongest = tuple(orders[np.argsort(-made, kind="stable")[:3]].tolist())
    if not both > 0.0:
        return RankedCause(cause, math.nan, 0.0, strongest)
    return RankedCause(cause, float(both / all_made), float(both**2 / (all_made * all_measured)), strongest)


def describe_causes(ranked: tuple[RankedCause, ...]) -> Block:
    """Tabulate causes, best first, with their sizes."""
    if not ranked:
        return Block("No abnormal line asks for a cause")
    notes = (
        "size: of the error that comes nearest to the measured lines, each over the normal lines of its mesh harmonic",
        f"by lines of errors of {_STEP * 1e6:g} µm, coarsely computed, in proportion; likeness 1: heights spread alike",
        "faults of teeth by lines of two sizes: depth of a crack, length of a spall; a missing tooth has none",
    )
    alike = [entry.cause.name for entry in ranked if ranked[0].explained - entry.explained < _ALIKE]
    if len(alike) > 1 and ranked[0].explained >= _EXPLAINS:
        notes += (f"cannot be told apart by this recording, but by their sizes: {'; '.join(alike)}",)
    header = ("cause", "entry", "size [µm]", "likeness", "its strongest orders")
    return Block("What would make the abnormal lines", header, tuple(_rows(ranked)), notes)


def _rows(ranked: tuple[RankedCause, ...]) -> Iterator[tuple[str, ...]]:
    for entry in ranked:
        orders = ", ".join(f"{order:.6g}" for order in entry.strongest)
        size = "-" if math.isnan(entry.size) else f"{float(f'{entry.size * 1e6:.3g}'):g}"
        yield entry.cause.name, entry.cause.entry, size, f"{entry.explained:.2f}", orders
