"""Bearings between planets and pins: their lives over load cases, ISO 281, and their friction.

The load of a bearing is the force of its pin: the mesh forces of the static solution with its sharing of the planets,
and what holds the planet on its circle, mass times radius times the square of the speed of the carrier, inwards. Over
a mesh period it counts by its mean to the power p, 3 of balls and 10/3 of rollers. Bearings turn with the planet
against the carrier. The couple of the axial forces of helical teeth is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.findings import Finding, percent
from femgear.gears.pair import BRANCH, GearSet
from femgear.report.tables import Block, Marks, tabulate
from femgear.system.bearing_friction import OIL_BATH, FrictionFactors, Kind, friction_load, load_factor

EXPONENTS = {"ball": 3.0, "roller": 10.0 / 3.0, "needle": 10.0 / 3.0}
"""Exponents p of the life by the kind of bearing."""
_FRICTION: dict[str, Kind] = {"roller": "cylindrical", "needle": "needle"}
"""Kinds whose friction goes without a static rating."""
_MILLION, _HOUR = 1e6, 3600.0


@dataclass(frozen=True)
class PlanetBearings:
    """Loads and lives of the bearings of all planets over load cases.

    Parameters
    ----------
    names : tuple of str
        Of the planets.
    load : (c, N) array
        Equivalent load of every load case [N].
    turns : (c,) array
        Of the planets against the carrier in an hour of all load cases: those of the load case times its share.
    rating : float
        Basic dynamic radial load rating C of the bearing of one planet [N].
    exponent : float
        p
    """

    names: tuple[str, ...]
    load: np.ndarray
    turns: np.ndarray
    rating: float
    exponent: float

    @property
    def damage(self) -> np.ndarray:
        """Damage (c, N) of the load cases in an hour: turns over those of L10."""
        return self.turns[:, None] / _MILLION * (self.load / self.rating) ** self.exponent

    @property
    def hours(self) -> np.ndarray:
        """L10 (N,) over all load cases [h]; infinite without load."""
        with np.errstate(divide="ignore"):
            return 1.0 / self.damage.sum(axis=0)

    @property
    def damage_share(self) -> np.ndarray:
        """Share (c, N) of every load case in the damage; zero without load."""
        damage = self.damage
        total = damage.sum(axis=0)
        return np.divide(damage, total, out=np.zeros_like(damage), where=total > 0.0)


def equivalent_pin_load(
    cycle: Any, gears: GearSet, *, mass: float, carrier_speed: float, exponent: float
) -> np.ndarray:
    """Compute the equivalent loads (N,) of the bearings of planets over a mesh period [N].

    Parameters
    ----------
    cycle : MeshCycle or None
        Static solution; None without load.
    gears : PlanetarySet
        With the angles of its planets.
    mass : float
        Of one planet [kg].
    carrier_speed : float
        [rad/s]
    exponent : float
        p of the life.
    """
    angle = np.array(gears.planet_angles)  # type: ignore[attr-defined]
    inwards = -np.array([np.cos(angle), np.sin(angle)]).T
    held = mass * gears.centre_distance * carrier_speed**2 * inwards  # type: ignore[attr-defined]
    force = held[:, :, None] + (0.0 if cycle is None else cycle.bearing_force)
    size = np.hypot(force[:, 0], force[:, 1])
    largest = size.max()
    return largest * ((size / largest) ** exponent).mean(axis=1) ** (1.0 / exponent) if largest else size[:, 0]


def has_planet_friction(case: Any) -> bool:
    """Tell whether a case gives what the friction of its planets' bearings needs."""
    planet = getattr(case, "planet", None)
    return planet is not None and planet.bearing_pitch_diameter is not None and planet.bearing_kind in _FRICTION


def planet_friction(
    case: Any, gears: GearSet, cycle: Any, *, carrier_speed: float, mesh_frequency: float, viscosity: float | None
) -> float:
    """Compute the friction of all planets' bearings as a torque between sun and carrier [N m].

    Planets turn on their pins ``z_s/z_p`` times as fast as the sun against the carrier: that torque takes the power
    of M_0 + M_1 of `femgear.system.bearing_friction`, with the mean force of every pin. The load of a planet counts as
    that of one bearing.

    Parameters
    ----------
    case : case of gears
        With `has_planet_friction`.
    gears, cycle, carrier_speed
        As for `equivalent_pin_load`.
    mesh_frequency : float
        [Hz]
    viscosity : float or None
        Kinematic [m^2/s]; without it M_1 alone.
    """
    kind, diameter = _FRICTION[case.planet.bearing_kind], case.planet.bearing_pitch_diameter
    force = equivalent_pin_load(cycle, gears, mass=case.planet.mass, carrier_speed=carrier_speed, exponent=1.0)
    turning = 2.0 * math.pi * abs(mesh_frequency) / gears.gears[BRANCH].teeth
    torques = [
        FrictionFactors(load_factor(kind, 0.0, load, 0.0, None), OIL_BATH[kind]).torque(
            friction_load(kind, 0.0, load, 0.0), diameter, turning, viscosity
        )
        for load in force.tolist()
    ]
    return math.fsum(torques) * gears.gears[0].teeth / gears.gears[BRANCH].teeth


def planet_bearings(
    case: Any,
    gears: GearSet,
    cycles: Sequence[Any],
    *,
    carrier_speed: Sequence[float],
    mesh_frequency: Sequence[float],
    shares: Sequence[float] | np.ndarray,
) -> PlanetBearings | None:
    """Collect loads of the planets' bearings over load cases; None of pairs and of planets without a rating.

    Parameters
    ----------
    case : case of gears
        With the planets' section.
    gears : GearSet
        A planetary set, or a pair.
    cycles : sequence of MeshCycle or None
        Static solutions of the load cases.
    carrier_speed, mesh_frequency, shares : (n_cases,) sequences of float
        Of the load cases [rad/s, Hz, 1].
    """
    if not gears.repeated[BRANCH] or case.planet.dynamic_rating is None:
        return None
    exponent = EXPONENTS[case.planet.bearing_kind]
    given = {"mass": case.planet.mass, "exponent": exponent}
    load = [
        equivalent_pin_load(cycle, gears, carrier_speed=speed, **given)
        for cycle, speed in zip(cycles, carrier_speed, strict=True)
    ]
    turns = _HOUR * np.abs(mesh_frequency) / gears.gears[BRANCH].teeth * np.asarray(shares)
    names = tuple(f"planet {number}" for number in range(1, gears.n_planets + 1))
    return PlanetBearings(names, np.array(load), turns, case.planet.dynamic_rating, exponent)


def planet_bearing_variables(sets: Sequence[PlanetBearings]) -> tuple[dict[str, tuple], dict[str, tuple]]:
    """Collect variables and coordinates of a file on the bearings of planets, of several sets one after the other."""
    if not sets:
        return {}, {}
    at, names = "load_case planet_bearing", [name for bearings in sets for name in bearings.names]
    load, share = (
        np.concatenate([getattr(bearings, name) for bearings in sets], axis=1) for name in ("load", "damage_share")
    )
    hours = np.concatenate([bearings.hours for bearings in sets])
    variables = {
        "planet_bearing_life": ("planet_bearing", hours, "h", "L10 over all load cases"),
        "planet_bearing_load": (at, load, "N", "equivalent load of the bearing of the planet, ISO 281"),
        "planet_bearing_damage_share": (at, share, "1", "share of the load case in the damage of the bearing"),
    }
    return variables, {"planet_bearing": (("planet_bearing",), names, "1", "planet of the bearing")}


def planet_bearing_rows(data: Any, marks: Marks, of: tuple[str, ...] = ("life",)) -> Iterator[tuple[str, str]]:
    """Write a row of a verdict: the planet whose bearing fails first, and the load case that damages it most."""
    if "planet_bearing_life" not in data:
        return
    life = data["planet_bearing_life"].values
    at = int(life.argmin())
    if math.isfinite(life[at]):
        share = data["planet_bearing_damage_share"].values[:, at]
        most = int(share.argmax())
        hours, short = f"{life[at]:.4g} h", life[at] < float(data.attrs.get("required_hours", 0.0))
        text = f"{marks(hours, 'W-LIFE', of=of) if short else hours}, {data['planet_bearing'].values[at]}"
        case = data["load_case"].values[most]
        yield "shortest L10 of the planets' bearings", f"{text}: {percent(share[most])} of the damage in {case}"


def planet_bearing_findings(data: Any) -> Iterator[Finding]:
    """List bearings of planets whose L10 is shorter than the life that the case asks for (W-LIFE)."""
    if "planet_bearing_life" not in data or "required_hours" not in data.attrs:
        return
    life, required = data["planet_bearing_life"].values, float(data.attrs["required_hours"])
    if life.min() < required:
        which = data["planet_bearing"].values[int(life.argmin())]
        text = f"the bearing of {which} has an L10 of {life.min():.4g} h, of {required:g} h asked for"
        remedy = "a bearing with a larger planet.dynamic_rating, or less torque or time"
        yield Finding("W-LIFE", "operation.required_hours", text, remedy=remedy)


def describe_planet_bearings(data: Any) -> Iterator[Block]:
    """Tabulate the bearings of the planets: largest load, L10, and the load case with most of the damage."""
    if "planet_bearing_life" not in data:
        return

    def most(number: int) -> str:
        share = data["planet_bearing_damage_share"].values[:, number]
        at = int(share.argmax())
        return f"{data['load_case'].values[at]} ({percent(share[at])})" if share.any() else "-"

    columns = {
        "bearing of": lambda i: str(data["planet_bearing"].values[i]),
        "largest load [N]": lambda i: f"{data['planet_bearing_load'].values[:, i].max():.5g}",
        "L10 [h]": lambda i: f"{data['planet_bearing_life'].values[i]:.4g}",
        "most damage": most,
    }
    notes = ("mesh forces and what holds the planets on their circle; without couples of axial forces",)
    yield tabulate("Bearings of the planets", range(len(data["planet_bearing"].values)), columns, notes)
