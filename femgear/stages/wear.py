"""Wear of loaded flanks by Archard's law: what a contact under load takes off every flank that carries.

Loads come as `MeshingTeeth`, which every kind of case makes of its own contact. What they take off over some hours is a
`WornFlank` a flank, with its entry of the case file.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.contact.face_width import slices_ahead
from femgear.contact.flank_pairs import RIGHT, FlankPair, acting_flanks, mesh_pairs
from femgear.errors import CaseError

POINTS = 41
"""Points of the curve of a flank."""
_SAME_PATH = 1e-9
"""Distance of places on the path of contact that count as one [m]."""


@dataclass(frozen=True)
class MeshingTeeth:
    """Contact of teeth under load, and how often they mesh.

    Parameters
    ----------
    prefix : str
        What stands before the names of the gears in keys of the case, as "pair[0].teeth."; empty of cases that are
        their own teeth.
    static : StaticResult
        Their contact (`femgear.stages.static_results`), of either sign of the torque.
    mesh_frequency : float
        [Hz]
    """

    prefix: str
    static: Any
    mesh_frequency: float


@dataclass(frozen=True, eq=False)
class WornFlank:
    """What a flank of all teeth of a gear has lost.

    Parameters
    ----------
    key : str
        Entry of the case that takes it, as "sun.fault".
    planet : int
        Number of the planet from 1; 0 of other gears.
    flank : str
        As the case file names it.
    radius, depth : (n,) arrays
        Ascending, and what is lost along the normal there [m].
    """

    key: str
    planet: int
    flank: str
    radius: np.ndarray
    depth: np.ndarray

    @property
    def place(self) -> tuple[str, int, str]:
        """Tell the flank from others."""
        return self.key, self.planet, self.flank

    @property
    def entry(self) -> dict[str, object]:
        """Table of the case file: wear of all teeth over diameters."""
        planet = {"planet": self.planet} if self.planet else {}
        diameters = [f"{2e3 * radius:.9g} mm" for radius in self.radius.tolist()]
        depths = [f"{1e6 * depth:.9g} um" for depth in self.depth.tolist()]
        return {"kind": "wear", "flank": self.flank, **planet, "diameters": diameters, "depths": depths}


def worn_flanks(teeth: MeshingTeeth, *, hours: float, coefficient: float, points: int = POINTS) -> list[WornFlank]:
    """Compute what all loaded flanks lose in some hours under the loads that they have.

    Under a contact that passes with the pressure p a point of a flank slides over s, the width of the contact times
    ``|1 - v_2/v_1|`` of the rolling speeds, and loses ``k p s``: of the mean pressure ``k (F/b) |1 - v_2/v_1|``,
    whatever the width is (A. Flodin, S. Andersson, Wear 207, 1997, 16-23). Sun and ring lose it under every planet.
    Of records of several mesh periods, and of slices of the width, loads are those in the mean.

    Parameters
    ----------
    teeth : MeshingTeeth
        Contact and mesh frequency.
    hours : float
        Of running [h].
    coefficient : float
        Wear coefficient k [m^2/N].
    points : int
        Of the curve of every flank.

    Raises
    ------
    CaseError
        E-NO-LOAD: no torque.
    """
    static, gears = teeth.static, teeth.static.planetary_set
    if not static.sun_torque:
        message, remedy = "without torque no flank wears", 'give a torque, as in operation.torque = "100 N m"'
        raise CaseError(message, code="E-NO-LOAD", key=f"{teeth.prefix}operation.torque", value=0.0, remedy=remedy)
    back = static.sun_torque < 0.0
    sides = {(mesh, place): side for _, acting in acting_flanks(gears) for mesh, place, side in acting}
    flanks = dict[tuple[str, int, str], WornFlank]()
    for number, mesh in enumerate(gears.meshes):
        pair = mesh_pairs(gears)[mesh.kind]
        start, end = pair.path
        zeta = np.linspace(start, end, points)
        line_load = _mean_load(static, number, zeta) / gears.mesh_widths[mesh.kind]
        rolls = [pair.roll_on(place, zeta) for place in (0, 1)]
        for place, body in enumerate(mesh.bodies):
            gear = gears.gears[gears.bodies[body].gear]
            passages = 3600.0 * hours * teeth.mesh_frequency / gear.teeth
            depth = coefficient * line_load * specific_sliding(pair, rolls, place) * passages
            radius = np.hypot(gear.base_radius, rolls[place])
            side = RIGHT - sides[number, place] if back else sides[number, place]
            planet = gear.name == "planet"
            words = ("sun side", "ring side") if planet else ("left", "right")
            rising, key = np.argsort(radius), f"{teeth.prefix}{gear.name}.fault"
            flank = WornFlank(key, mesh.copy + 1 if planet else 0, words[side], radius[rising], depth[rising])
            before = flanks.get(flank.place)
            flanks[flank.place] = flank if before is None else with_more_wear(before, flank.depth)
    return list(flanks.values())


def with_more_wear(flank: WornFlank, depth: np.ndarray) -> WornFlank:
    """Add depths (n,) [m] to those of a flank."""
    return WornFlank(flank.key, flank.planet, flank.flank, flank.radius, flank.depth + depth)


def specific_sliding(pair: FlankPair, rolls: list[np.ndarray], place: int) -> np.ndarray:
    """Compute ``|1 - v_2/v_1|`` (n,) of gear 1 (0) or gear 2 (1) of a pair at roll lengths (n,) of both [m]."""
    speed = [rolls[0] / pair.base_radius_1, rolls[1] / pair.base_radius_2]
    return np.abs(1.0 - speed[1 - place] / speed[place])


def _mean_load(static: Any, mesh: int, zeta: np.ndarray) -> np.ndarray:
    """Mean load (n,) [N] of a tooth pair of a mesh at places (n,) of its path, over mesh periods and slices."""
    cycle, gears = static.cycle, static.planetary_set
    # flanks that a negative torque presses are those of the mirror image, whose path runs the other way
    path = cycle.path[mesh] if static.sun_torque > 0.0 else -cycle.path[mesh]
    if not cycle.helical or cycle.slice_load is None:
        return _load_at(path, cycle.tooth_load[mesh], zeta)
    load = cycle.slice_load[mesh]
    ahead = slices_ahead(static.overlap_ratio, load.shape[1]) * np.sign(static.sun_torque) * gears.base_pitch
    of_slices = [_load_at(path + apart, load[:, number], zeta) for number, apart in enumerate(ahead)]
    return np.mean(of_slices, axis=0)


def _load_at(path: np.ndarray, load: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Load (n,) [N] at places (n,) between those of pairs (T, P), the mean of all loads at one place."""
    places, number = np.unique(np.rint(path.ravel() / _SAME_PATH), return_inverse=True)
    mean = np.bincount(number, load.ravel()) / np.bincount(number)
    return np.interp(zeta, places * _SAME_PATH, mean)


def wear_entries(flanks: Iterable[WornFlank]) -> dict[str, list[dict[str, object]]]:
    """Gather the tables of worn flanks by their keys, for `femgear.with_values`."""
    entries: dict[str, list[dict[str, object]]] = {}
    for flank in flanks:
        entries.setdefault(flank.key, []).append(flank.entry)
    return entries


def speed_of_wear(case: Any, speed: float | None) -> float:
    """Find the speed of the input [rad/s]: as given, or the first of the case; CaseError (E-KEY-MISSING): none."""
    if speed is not None:
        return speed
    if not case.operation.speeds:
        message, remedy = "wear needs a speed", 'give --speed, as in --speed "3000 rpm", or operation.speeds'
        raise CaseError(message, code="E-KEY-MISSING", key="operation.speeds", remedy=remedy)
    return float(case.operation.speeds[0])
