"""Mesh, planet passing and hunting tooth frequencies of one stage from the speeds of its shafts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from femgear.errors import CaseError
from femgear.gears.shaft_graph import SpeedCondition, StageGears


@dataclass(frozen=True)
class StageFrequencies:
    """Frequencies of a stage; meshes are named after their gears, "sun-planet".

    Parameters
    ----------
    name : str
        Of the stage.
    mesh_frequency : mapping
        Of every mesh [Hz], of planets relative to their carrier.
    planet_speed : mapping
        Absolute speed of the planet gears whose teeth are given [rad/s].
    planet_spin : mapping
        Their speed relative to the carrier [rad/s], that of their bearings.
    passing_frequency : mapping
        How often a planet passes one place of the "sun", the "ring" and the "casing" [Hz]; empty without planets.
    hunting_turns : mapping
        Of every mesh whose teeth are known: turns of gear 1 and gear 2 relative to the carrier until the same teeth
        of one pair of gears meet again.
    hunting_time : mapping
        The same in seconds, infinite where nothing turns.
    """

    name: str
    mesh_frequency: Mapping[str, float]
    planet_speed: Mapping[str, float]
    planet_spin: Mapping[str, float]
    passing_frequency: Mapping[str, float]
    hunting_turns: Mapping[str, tuple[int, int]]
    hunting_time: Mapping[str, float]


def stage_frequencies(
    condition: SpeedCondition,
    speed: Mapping[str, float],
    *,
    planet_teeth: Mapping[str, int] | None = None,
    planets: int = 0,
) -> StageFrequencies:
    """Compute the frequencies of a stage.

    Parameters
    ----------
    condition : SpeedCondition
        As its maker returns it (`pair_condition`, `planetary_condition`, ...).
    speed : mapping
        Speeds by shaft [rad/s], as of a `PowerFlow`.
    planet_teeth : mapping, optional
        By "planet", or by "inner planet" and "outer planet" of double planets. Stepped planets have theirs already.
    planets : int
        Number of planets of one kind.

    Raises
    ------
    CaseError
        A condition without gears, or a planet that the stage does not have (E-CHOICE).
    """
    gears = condition.gears
    if gears is None:
        text = f"stage {condition.name!r} has weights alone, and no gears"
        raise CaseError(text, code="E-CHOICE", remedy="make the condition by pair_condition or planetary_condition")
    names = {gear for first, second, _ in gears.meshes for gear in (first, second)}
    for planet in planet_teeth or ():
        if planet not in names - {*gears.shafts}:
            choices = ", ".join(map(repr, sorted(names - {*gears.shafts}))) or "none"
            raise CaseError(f"stage {condition.name!r} has no {planet!r}", code="E-CHOICE", limit=choices)
    teeth = {**gears.teeth, **(planet_teeth or {})}

    def turns(gear: str) -> float:
        """Speed of a central gear or carrier; the casing stands still."""
        shaft = gears.shafts.get(gear)
        return 0.0 if shaft is None else float(speed[shaft])

    carrier = turns("carrier")
    rates = _tooth_rates(gears, teeth, {gear: turns(gear) - carrier for gear in gears.shafts if gear != "carrier"})
    mesh = {f"{first}-{second}": abs(rates[first]) for first, second, _ in gears.meshes}
    spin = {gear: 2.0 * math.pi * rates[gear] / teeth[gear] for gear in rates if _is_planet(gears, gear, teeth)}
    meshing = [(f"{a}-{b}", teeth[a], teeth[b]) for a, b, _ in gears.meshes if a in teeth and b in teeth]
    passing = {"casing": carrier, "sun": turns("sun") - carrier, "ring": turns("ring") - carrier} if planets else {}
    return StageFrequencies(
        condition.name,
        mesh,
        {gear: carrier + value for gear, value in spin.items()},
        spin,
        {place: planets * abs(value) / (2.0 * math.pi) for place, value in passing.items()},
        {name: (b // math.gcd(a, b), a // math.gcd(a, b)) for name, a, b in meshing},
        {name: math.lcm(a, b) / mesh[name] if mesh[name] else math.inf for name, a, b in meshing},
    )


def _is_planet(gears: StageGears, gear: str, teeth: Mapping[str, int]) -> bool:
    return gear not in gears.shafts and gear in teeth


def _tooth_rates(gears: StageGears, teeth: Mapping[str, int], relative: Mapping[str, float]) -> dict[str, float]:
    """Teeth of every gear that pass a place of the carrier per second, positive counter-clockwise."""
    rates = {gear: teeth[gear] * value / (2.0 * math.pi) for gear, value in relative.items()}
    for first, second, sense in gears.meshes:
        if first not in rates:  # a second gear on a body that turns already
            partner = next(body for pair in gears.bodies if first in pair for body in pair if body != first)
            rates[first] = rates[partner] * teeth[first] / teeth[partner]
        rates.setdefault(second, sense * rates[first])
    return rates
