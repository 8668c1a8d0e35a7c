"""Rows of recordings that femgear makes itself, with noise and a speed that wanders, read back through its loaders."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from femgear.measured.requests import LineSearch, Recording
from femgear.measured.verdict import MeasuredVerdict, measured_verdict
from femgear.run import solve
from femgear.trains.reading import read_case, with_values
from validation.rows import Row, at_most

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
RATE, PULSE_RATE = 8192.0, 16384.0
"""Samples a second [Hz]: of coarse recordings, and of those of the rows."""
COARSE = {
    "static.flank_elements": 6,
    "static.positions": 8,
    "dynamics.mesh_harmonics": 3,
    "operation.speeds": ["900 rpm"],
}
_PLACE = {"diameter": "61.5 mm", "flank": "sun side"}
FAULTS: Mapping[str, dict[str, Any]] = {
    "healthy": {},
    "unequal pins": {"set.pin_errors": [{"planet": 1, "tangential": "20 um"}]},
    "missing tooth": {"planet.fault": [{"kind": "missing", "tooth": 3}]},
    "broken corner": {"planet.fault": [{"kind": "broken corner", "tooth": 3, "length": "0.5 mm"}]},
    "spall": {"planet.fault": [{"kind": "spall", "tooth": 3, "length": "0.6 mm", "depth": "40 um"} | _PLACE]},
    "wear": {"planet.fault": [{"kind": "wear", "flank": "sun side", "depth": "10 um", "tooth": 3}]},
    "crack": {"planet.fault": [{"kind": "crack", "tooth": 3, "flank": "sun side", "depth": "1.5 mm"}]},
}
"""Entries of the sets that are recorded."""
FORMATS = {
    "healthy": "csv",
    "unequal pins": "uff",
    "missing tooth": "wav",
    "broken corner": "mat",
    "spall": "uff",
    "wear": "csv",
    "crack": "wav",
}
"""Format of the file of each."""
_LEFT_OUT = 5e-3
"""Lines over the largest that are not recorded."""
ORDER_LIMIT, LEVEL_LIMIT = 0.01, 0.2
"""Largest error of an order, and of a level whose noise allows it [dB]."""


@cache
def computed_lines(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Orders (k,) of the carrier and complex accelerations (k,) [m/s^2] of the sensor at 900 rpm of the sun."""
    lines = solve(with_values(read_case(CASE), {**COARSE, **FAULTS[kind]}), "housing")["housing"].exact
    value = lines.acceleration[0]
    kept = (lines.order > 0) & (np.abs(value) > 1e-4 * np.abs(value).max())
    return lines.order[kept], value[kept]


def recording(
    order: Sequence[float] | np.ndarray,
    value: Sequence[complex] | np.ndarray,
    *,
    carrier: float = 180 / 60,
    seconds: float = 20.0,
    rate: float = RATE,
    wander: float = 0.01,
    noise: float = 1e-3,
    seed: int = 1,
    logic: bool = True,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signal (n,), pulses of the sun (n,) and turns of the carrier (n,) at a speed [1/s] that wanders by a share.

    The noise is a share of the largest line. Pulses have a logic level, which jumps within a sample, or are those of a
    sensor, which rise over many.
    """
    time = np.arange(round(seconds * rate)) / rate
    # the speed is carrier (1 + wander sin(2 pi f t)), f = 0.23 Hz
    turns = carrier * (time + wander * (1 - np.cos(2 * np.pi * 0.23 * time)) / (2 * np.pi * 0.23))
    signal = np.zeros_like(time)
    for at, amplitude in zip(order, value, strict=True):
        # the real part of amplitude times exp(i phase): most amplitudes are real, and exp takes three times as long
        phase = 2.0 * np.pi * at * turns
        if np.real(amplitude):
            signal += np.real(amplitude) * np.cos(phase)
        if np.imag(amplitude):
            signal -= np.imag(amplitude) * np.sin(phase)
    signal += noise * np.abs(list(value)).max() * np.random.default_rng(seed).normal(size=len(time))
    sun = 5.0 * turns  # 1 + 108/27 turns in one of the carrier
    pulses = 5.0 * (np.mod(sun, 1.0) < 0.1) if logic else 5.0 * np.exp((np.cos(2.0 * np.pi * sun) - 1.0) / 0.1)
    return signal, pulses, turns


def written(folder: Path, form: str, signal: np.ndarray, pulses: np.ndarray, rate: float) -> Path:
    """Write a signal [m/s^2] and pulses [V] as csv, wav, mat or uff 58b, as other programs do."""
    path = folder / f"a.{form}"
    match form:
        case "csv":
            rows = zip(np.arange(len(signal)) / rate, signal, pulses, strict=True)
            text = "\n".join(f"{t:.9g};{a:.9g};{p:g}" for t, a, p in rows).replace(".", ",")
            path.write_text(f"time [s];acc [m/s^2];tacho [V]\n{text}\n", encoding="utf-8")
        case "wav":
            from scipy.io import wavfile

            wavfile.write(path, int(rate), np.stack([signal, pulses], 1).astype(np.float32))
        case "mat":
            from scipy.io import savemat

            savemat(path, {"acc": signal, "tacho": pulses, "fs": rate})
        case _:
            _write_universal(path, {"acc": signal, "tacho": pulses}, rate)
    return path


def _write_universal(path: Path, channels: Mapping[str, np.ndarray], rate: float) -> None:
    import pyuff

    for name, values in channels.items():
        scalar: dict[str, Any] = {
            "rsp_node": 1,
            "rsp_dir": 3,
            "ref_dir": 0,
            "ref_node": 0,
            "z_axis_value": 0.0,
            "binary": 1,
        }
        scalar |= {f"{part}_spec_data_type": 0 for part in ("orddenom", "z_axis", "ordinate")}
        data: dict[str, Any] = {"func_type": 1, "data": values, "x": np.arange(len(values)) / rate, "id1": name}
        times: dict[str, Any] = {"abscissa_spacing": 1, "abscissa_spec_data_type": 17}
        pyuff.UFF(str(path)).write_sets(pyuff.prepare_58(**data, **scalar, **times), mode="add")


def read_back(
    kind: str, *, noise: float = 1e-3, rate: float = PULSE_RATE, logic: bool = True
) -> tuple[MeasuredVerdict, np.ndarray]:
    """Record a set, read the file and find its lines; of each the error of order, of level [dB], and what is stated."""
    order, value = computed_lines(kind)
    loud = np.abs(value) > _LEFT_OUT * np.abs(value).max()
    order, value = order[loud], value[loud]
    # 120 turns: lines of a planet's tooth lie a tenth of an order apart, twelve bins
    signal, pulses, _ = recording(order, value, seconds=40.0, noise=noise, rate=rate, logic=logic)
    form = FORMATS[kind]
    with tempfile.TemporaryDirectory() as folder:
        path = written(Path(folder), form, signal, pulses, rate)
        chosen = Recording(channel="1", pulses="2") if form in ("wav", "mat") else Recording(pulses="tacho")
        verdict = measured_verdict(read_case(CASE), path, chosen, LineSearch(threshold=-35.0))
    errors = []
    for line in verdict.lines:
        at = int(np.abs(order - line.order).argmin())
        level = 20 * np.log10(line.amplitude / np.abs(value[at]))
        errors.append((line.order - order[at], level, line.uncertainty))
    return verdict, np.array(errors)


def come_back(kinds: Sequence[str] = tuple(FAULTS)) -> tuple[Row, ...]:
    """Orders and levels of all lines above -35 dB, 1 % of wander and noise of 0.1 % of the largest line per sample."""
    rows, source = list[Row](), "the lines of which the recording was made"
    for kind in kinds:
        _, errors = read_back(kind)
        off, level, stated = np.abs(errors).T
        exact = stated <= LEVEL_LIMIT
        words = f"{kind}, {FORMATS[kind]}, {len(errors)} lines"
        rows += [
            at_most("recordings", source, f"{words}: largest error of an order", ORDER_LIMIT, off.max()),
            at_most(
                "recordings",
                source,
                f"{words}: largest error of the {exact.sum()} levels whose noise allows 0.2 dB [dB]",
                LEVEL_LIMIT,
                level[exact].max(initial=0.0),
            ),
            at_most(
                "recordings",
                source,
                f"{words}: largest error of all levels over the one that is stated",
                1.0,
                (level / np.maximum(stated, LEVEL_LIMIT)).max(),
            ),
        ]
    return tuple(rows)
