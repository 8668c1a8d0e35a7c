"""What a test bench would record of a gearbox: accelerations of its sensors as signals, modes at all stations.

Lines of all stages have orders over the turn of the reference shaft, which are seldom whole
(`femgear.trains.gearbox.response`). Speeds are in proportion to one another, so that they stay the same in a run-up.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.exchange.formats import Shapes, Signal, Spectrum, line_extent
from femgear.exchange.sampling import Sampling
from femgear.findings import Finding, tell
from femgear.housing.sound import run_up_signal, sampled_signal, whole_turns
from femgear.stages.key_figures import REFERENCE_ACCELERATION
from femgear.stages.protocol import Recorded

if TYPE_CHECKING:
    import xarray as xr

    from femgear.storage.results import Results

RESPONSE_STAGES = "dynamics", "runup"
"""Stages that have lines at the sensors."""
ORDER_HEADER = (
    "sensor",
    "speed [rpm]",
    "frequency [Hz]",
    "order [1]",
    "stage",
    "mesh harmonic [1]",
    "turns of the carrier beside it [1]",
    "amplitude [m/s^2]",
    "level, r.m.s. re 1e-6 m/s^2 [dB]",
    "share of the power [1]",
    "nearest mode [Hz]",
)
"""Columns of the table of all lines."""
_DIGITS = 9
"""Decimal places of a frequency [Hz] in which lines of one agree."""
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


def gearbox_spectra(results: Results) -> Iterator[Spectrum]:
    """Give the lines of every sensor at the speed of the load case; those of one frequency add with their phase."""
    if "dynamics" not in results.stages:
        return
    for name, order, speed, values in _lines_of_sensors(results, "dynamics"):
        hertz = order * speed[0] / (2.0 * np.pi)
        frequencies, place = np.unique(np.round(hertz, _DIGITS), return_inverse=True)
        lines = np.zeros(len(frequencies), complex)
        np.add.at(lines, place.ravel(), values[0])
        kept = np.abs(lines) > 0.0
        yield Spectrum(f"{name}_lines", "m/s^2", 0.0, lines[kept], frequencies[kept])


def gearbox_order_tables(results: Results) -> Iterator[tuple[str, Sequence[str], Iterator[Sequence[object]]]]:
    """Give the table of all lines at the sensors at the speed of the load case, each with its origin."""
    if "dynamics" in results.stages and "lines_real" in results["dynamics"]:
        modes = results["modes"] if "modes" in results.stages else None
        yield "order_table", ORDER_HEADER, _order_rows(results["dynamics"], modes)


def _order_rows(data: xr.Dataset, modes: xr.Dataset | None) -> Iterator[Sequence[object]]:
    """Rows of `ORDER_HEADER`, the largest line of a sensor first."""
    speed = float(data["speed"].values[0])
    size = np.hypot(data["lines_real"].values[0], data["lines_imag"].values[0])
    columns_of_orders = ("order", "origin", "harmonic", "side_band")
    orders, stages, harmonics, bands = (data[name].values for name in columns_of_orders)
    elastic = np.zeros(0) if modes is None else modes["frequency"].values[modes["frequency"].values > 0.0]
    for number, sensor in enumerate(data["sensor"].values):
        whole = float(data["level"].values[0, number])
        for line in np.argsort(-size[number], kind="stable").tolist():
            amplitude, hertz = float(size[number, line]), float(orders[line]) * speed / 60.0
            if not amplitude > 0.0:
                break
            level = 20.0 * np.log10(amplitude / np.sqrt(2.0) / REFERENCE_ACCELERATION)
            near = float(elastic[np.abs(np.log(elastic / hertz)).argmin()]) if len(elastic) else float("nan")
            origin = float(orders[line]), str(stages[line]), harmonics[line].item(), int(bands[line])
            yield (str(sensor), speed, hertz, *origin, amplitude, float(level), 0.5 * (amplitude / whole) ** 2, near)


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
    spectra=gearbox_spectra,
    shapes=gearbox_shapes,
    tables=gearbox_order_tables,
)
