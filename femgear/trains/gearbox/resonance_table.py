"""Resonances of a run-up: which mesh harmonic of which stage meets which mode at which speed, and how loud it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM
from femgear.report.tables import Block, tabulate
from femgear.trains.gearbox.mode_words import nearest_mode
from femgear.trains.gearbox.response import GearboxResponse
from femgear.trains.gearbox.run_up_speeds import GearboxResonances

if TYPE_CHECKING:
    import xarray as xr

MOST_RESONANCES = 100
"""Resonances in the file, at most: those that are expected to be the loudest."""
RESONANCES_SHOWN = 12
"""Of them in the table."""


def resonance_variables(
    response: GearboxResponse, resonances: GearboxResonances, moved: Mapping[str, np.ndarray]
) -> dict[str, tuple]:
    """Collect the variables of runup.nc on the resonances between its speeds; none without any.

    Parameters
    ----------
    response : GearboxResponse
        At the speeds of the run-up.
    resonances : GearboxResonances
    moved : mapping of str to (v, s, L) array
        Accelerations of the sensors by stage [m/s^2].
    """
    first = np.argsort(-resonances.expected, kind="stable")[:MOST_RESONANCES]
    kept = first[np.argsort(resonances.speed[first], kind="stable")]
    if not len(kept):
        return {}
    places = np.abs(response.speed - resonances.speed[kept, None]).argmin(axis=1)
    at, stages = "resonance", {stage.name: stage for stage in response.stages}
    variables = {
        "resonance_speed": (at, resonances.speed[kept] / RPM, "rpm", f"speed of {response.reference} at the resonance"),
        "resonance_stage": (at, [resonances.stage[i] for i in kept], "1", "stage whose mesh harmonic meets the mode"),
        "resonance_harmonic": (at, resonances.harmonic[kept], "1", "mesh harmonic that meets the mode"),
        "resonance_frequency": (at, resonances.frequency[kept], "Hz", "natural frequency of the mode"),
        "resonance_nearest": (at, response.speed[places] / RPM, "rpm", "speed of the run-up that is nearest"),
    }
    if any(part.shape[1] for part in moved.values()):
        levels = []
        for i, place in zip(kept, places, strict=True):
            stage = stages[resonances.stage[i]]
            lines = moved[stage.name][place][:, stage.harmonic == resonances.harmonic[i]]
            levels.append(np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=-1)))
        text = "root mean square of the acceleration by this mesh harmonic, at the nearest speed of the run-up"
        variables["resonance_level"] = (f"{at} sensor", np.array(levels), "m/s^2", text)
    return variables


def describe_resonances(runup: xr.Dataset, modes: Any = None) -> Iterator[Block]:
    """Tabulate the loudest resonances of runup.nc at any sensor, with the nearest mode of modes.nc if there is one."""
    if "resonance_level" not in runup:
        return
    level = runup["resonance_level"].values
    loudest = level.max(axis=1)
    order = np.argsort(-loudest, kind="stable")[:RESONANCES_SHOWN].tolist()
    hertz = runup["resonance_frequency"].values
    columns = {
        "speed [rpm]": lambda i: f"{float(runup['resonance_speed'].values[i]):.5g}",
        "stage": lambda i: str(runup["resonance_stage"].values[i]),
        "mesh harmonic": lambda i: str(int(runup["resonance_harmonic"].values[i])),
        "mode": lambda i: f"{hertz[i]:.0f} Hz" if modes is None else nearest_mode(modes, float(hertz[i])),
        "level of the harmonic [m/s^2]": lambda i: f"{loudest[i]:.4g}",
        "at": lambda i: str(runup["sensor"].values[int(level[i].argmax())]),
    }
    count = runup.sizes["resonance"]
    notes = (f"the loudest {len(order)} of {count}",) if len(order) < count else ()
    yield tabulate("Resonances of the run-up", order, columns, notes)


def loudest_resonance(labels: tuple[str, ...], data: Any) -> float:
    """Find the speed of the loudest resonance of some stages, of all where none is named, in runup.nc [rad/s]."""
    if "resonance_level" not in data:
        return float("nan")
    loudest = data["resonance_level"].values.max(axis=1)
    of_stage = np.array([not labels or str(name) in labels for name in data["resonance_stage"].values])
    if not of_stage.any():
        return float("nan")
    return RPM * float(data["resonance_speed"].values[int(np.where(of_stage, loudest, -1.0).argmax())])
