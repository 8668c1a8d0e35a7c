"""Planetary stages of a gearbox as recordings tell them: teeth, planets, turns of carriers in one of the shafts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.measured.heard_set import HeardSet
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.power import gearbox_flow

if TYPE_CHECKING:
    from femgear.trains.gearbox.case_file import GearboxCase

_STILL = 1e-9
"""Speed over the largest one of the gearbox that is none."""


def heard_stages(case: GearboxCase) -> dict[str, HeardSet]:
    """List the planetary stages whose ring stands still while their carrier turns, by name.

    Speeds are those of the first load case; the input is the first shaft whose speed is given. FemgearError: shafts
    whose speeds contradict one another, as of `gearbox_flow`.
    """
    flow, stages = gearbox_flow(case), dict[str, HeardSet]()
    fastest = max(map(abs, flow.speed.values()), default=0.0)
    turning = {name: abs(speed) for name, speed in flow.speed.items() if abs(speed) > _STILL * fastest}
    given = next((name for name in case.load_case.speed if name in turning), "carrier")
    for stage in case.planetary:
        if stage.ring in turning or stage.carrier not in turning:
            continue
        (sun, planet, ring), angles = set_sizes(stage).teeth, set_sizes(stage).planet_angles
        carrier = turning[stage.carrier]
        per_turn = {name: carrier / speed for name, speed in turning.items()}
        members = {"carrier": 1.0} | ({"sun": carrier / turning[stage.sun]} if stage.sun in turning else {})
        stages[stage.name] = HeardSet(ring, sun, planet, np.asarray(angles), given, {**per_turn, **members})
    return stages
