"""A run-up that the page lets one walk through: modes, mesh orders, spectrum, lobes and sound at a speed."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.report.style import GREY, NOTICEABLE
from femgear.report.tables import level_change_at
from femgear.report.waterfall import KIND_COLOURS

if TYPE_CHECKING:
    import xarray as xr

EXPLORER = "runup.json"
"""File of what the page walks through."""
DRAWN = ("waterfall", "order_cuts")
"""Figures that the page draws of it, in any unit."""
_ORDERS, _SPEEDS = 160, 240
"""Lines and speeds that are kept, at most."""
_HARMONICS = 8
"""Mesh orders that are drawn."""


def explorer(
    runup: xr.Dataset, modes: xr.Dataset, pressure: np.ndarray | None = None, limit: np.ndarray | None = None
) -> dict[str, Any]:
    """Collect what the browser shows of a run-up.

    Parameters
    ----------
    runup : xarray.Dataset
        Of runup.nc: lines of the acceleration over speed and carrier order, resonances.
    modes : xarray.Dataset
        Of modes.nc.
    pressure : (speed, order) complex array, optional
        Lines of the sound pressure at the microphone [Pa], peak values.
    limit : (speed,) array, optional
        Largest level allowed [m/s^2].

    Returns
    -------
    dict
        What JSON can hold: speeds in rpm, frequencies in Hz, accelerations in m/s^2, pressures in Pa, and
        ``short``, whether the excitation ends too early. Of the lines those with the largest amplitudes, and
        the share of the power that they leave out at most.
    """
    lines = np.asarray(runup["lines_real"].values) + 1j * np.asarray(runup["lines_imag"].values)
    speeds = _chosen_speeds(runup)
    strength = np.abs(lines).max(axis=0)
    if pressure is not None:
        strength = strength / strength.max() + np.abs(pressure).max(axis=0) / np.abs(pressure).max()
    kept = np.sort(np.argsort(-strength, kind="stable")[:_ORDERS])
    power, part = (np.sum(np.abs(spectrum) ** 2, axis=1) for spectrum in (lines, lines[:, kept]))
    top = float(runup["mesh_frequency"].values.max()) * (_HARMONICS + 0.5)
    kinds = [str(kind) for kind in modes["kind"].values]
    colours = {kind: KIND_COLOURS.get(kind.removeprefix("ring, "), GREY) for kind in kinds}
    frequency = modes["frequency"].values
    shown = [i for i in range(len(frequency)) if 1.0 < frequency[i] < top]
    series = {"acceleration": lines} | ({} if pressure is None else {"pressure": pressure})
    return {
        "speed": runup["speed"].values[speeds].tolist(),
        "carrier": (np.abs(runup["carrier_speed"].values[speeds]) / (2 * np.pi)).tolist(),
        "mesh": runup["mesh_frequency"].values[speeds].tolist(),
        "level": runup["level"].values[speeds].tolist(),
        **({} if limit is None else {"limit": np.asarray(limit)[speeds].tolist()}),
        "short": (np.abs(level_change_at(runup, runup["speed"].values[speeds])) >= NOTICEABLE).tolist(),
        "teeth": int(runup.attrs["ring_teeth"]),
        "harmonics": _HARMONICS,
        "order": runup["order"].values[kept].tolist(),
        "left_out": float(np.max(1.0 - part / np.maximum(power, 1e-300))),
        "lines": {name: _packed(values[speeds][:, kept]) for name, values in series.items()},
        "modes": [[i + 1, float(frequency[i]), kinds[i], colours[kinds[i]]] for i in shown],
        "resonances": _resonances(runup, top),
    }


def _chosen_speeds(runup: xr.Dataset) -> np.ndarray:
    """Choose speeds spread evenly, the loudest among them."""
    count = runup.sizes["speed"]
    even = np.linspace(0, count - 1, min(count, _SPEEDS)).round().astype(int)
    level = runup["level"].values
    inner = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    peaks = inner[np.argsort(-level[inner], kind="stable")[:20]]
    return np.unique(np.concatenate([even, peaks]))


def _resonances(runup: xr.Dataset, top: float) -> list[list[Any]]:
    """Speed [rpm], frequency [Hz], mode, kind, mesh harmonic, level [m/s^2] of the resonances in the picture.

    The level is that of the mode at the harmonic alone, r.m.s.
    """
    if "resonance_speed" not in runup:
        return []
    names = ("resonance_speed", "frequency", "mode", "kind", "mesh_harmonic", "resonance_alone")
    rows = zip(*(runup[name].values.tolist() for name in names))
    return [list(row) for row in rows if row[1] < top]


def _packed(values: np.ndarray) -> dict[str, Any]:
    """Real and imaginary parts (speed, order, 2) as whole numbers of sixteen bits, a unit for each order."""
    parts = np.stack([np.real(values), np.imag(values)], axis=-1).astype(float)
    unit = np.abs(parts).max(axis=(0, 2)) / 32767
    unit[unit == 0] = 1.0
    whole = np.round(parts / unit[None, :, None]).astype("<i2")
    return {"unit": unit.tolist(), "values": base64.b64encode(whole.tobytes()).decode("ascii")}
