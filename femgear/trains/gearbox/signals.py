"""What a test bench would record of a gearbox: accelerations of its sensors as signals, modes at all stations.

Lines of all stages have orders over the turn of the reference shaft, which are seldom whole
(`femgear.trains.gearbox.response`). Speeds are in proportion to one another, so that they stay the same in a run-up.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.exchange.formats import Sampling, Shapes, Signal, line_extent
from femgear.findings import Finding, tell
from femgear.housing.sound import run_up_signal, sampled_signal, whole_turns
from femgear.stages.protocol import Recorded

if TYPE_CHECKING:
    import xarray as xr

    from femgear.storage.results import Results

RESPONSE_STAGES = "dynamics", "runup"
"""Stages that have lines at the sensors."""
_NAME = 60
"""Characters of the name of a sensor in that of a file, at most."""


def sensor_file_names(sensors: list[str]) -> list[str]:
    """Make names of files for sensors: letters and digits, no name twice, whether letters are large or small."""
    names = list[str]()
    for sensor in sensors:
        letters = re.sub(r"[^\w-]+", "_", unicodedata.normalize("NFC", sensor)).strip("_")[:_NAME]
        plain = f"sensor_{letters or 'unnamed'}"
        like_it = re.compile(rf"{re.escape(plain)}(_no_\d+)?", re.IGNORECASE)
        same = sum(like_it.fullmatch(name) is not None for name in names)
        names.append(f"{plain}_no_{same + 1}" if same else plain)
    return names


def gearbox_signals(results: Results, sampling: Sampling) -> Iterator[Signal]:
    """Sample the acceleration of every sensor at the speed of the load case, and over the run-up.

    At one speed they last whole turns of the reference shaft.
    """
    rate = sampling.rate
    for stage in _stages(results):
        speeds = results[stage]["speed"].values
        for name, order, speed, values in _lines_of_sensors(results, stage):
            if stage == "runup":
                recorded = run_up_signal(order, values, speed, duration=sampling.run_up, rate=rate)
                yield Signal(f"{name}_run_up", "m/s^2", rate, recorded, steady=False)
                continue
            for turning_speed, lines, rpm in zip(speed, values, speeds, strict=True):
                samples = whole_turns(turning_speed, sampling.duration, rate=rate)
                recorded = sampled_signal(order, lines, turning_speed, samples=samples, rate=rate)
                text = np.format_float_positional(rpm, 9, fractional=False, trim="-")
                yield Signal(f"{name}_{text}_rpm", "m/s^2", rate, recorded)
    if any((results[stage]["lowest_force"] < 0.0).any() for stage in _stages(results)):
        text = "signals are those of flanks held together, which pull at some of the speeds"
        tell(Finding("W-PULL", "operation.load_case", text, remedy="more torque, smaller errors, more damping"))


def gearbox_signal_extent(results: Results, rate: float) -> dict[str, tuple[float, float, float]]:
    """Find the extent of the lines of all signals, see `femgear.exchange.formats.line_extent`.

    CaseError: the run has no sensors (E-STAGE).
    """
    if not any("lines_real" in results[stage] for stage in _stages(results)):
        raise CaseError(
            "the gearbox has no sensors, whose signals these formats hold",
            code="E-STAGE",
            key="sensor",
            limit="sensors on a casing that stands on feet",
            remedy="give [casing] with feet, or a file, and [[sensor]], then run the case again",
        )
    recordings = (recording[1:] for stage in _stages(results) for recording in _lines_of_sensors(results, stage))
    return line_extent((("m/s^2", *recording) for recording in recordings), rate)


def gearbox_shapes(results: Results) -> Shapes:
    """Read the modes of modes.nc at the stations of shafts and planets."""
    modes = results["modes"]
    motion = np.moveaxis(modes["motion"].values[:, :3], -1, 0)
    place, words = modes["place"].values, "stations of shafts and planets"
    return Shapes(place, modes["frequency"].values, modes["damping_ratio"].values, motion, words)


def _stages(results: Results) -> list[str]:
    return [stage for stage in RESPONSE_STAGES if stage in results.stages]


def _lines_of_sensors(results: Results, stage: str) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Name, orders of the reference shaft (n,), its speeds (s,) [rad/s] and amplitudes (s, n) of every sensor."""
    data: xr.Dataset = results[stage]
    if "lines_real" not in data:
        return
    order, lines = data["order"].values, data["lines_real"].values + 1j * data["lines_imag"].values
    for number, name in enumerate(sensor_file_names([str(sensor) for sensor in data["sensor"].values])):
        yield name, order, data["speed"].values * RPM, lines[:, number]


GEARBOX_RECORDED = Recorded(
    gearbox_signals,
    gearbox_signal_extent,
    {"wav": ("dynamics",), "uff": ("dynamics", "modes")},
    lambda results: results["dynamics"].sizes.get("sensor", 0),
    shapes=gearbox_shapes,
)
