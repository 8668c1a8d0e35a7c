"""Modes of modes.nc beside lines of the excitation: which is nearest, how far it is, and what moves in it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

NEAR = 0.2
"""Distance over the frequency of a line up to which a mode is near it."""
MESH_LINES = 3
"""Harmonics of every mesh frequency in the Campbell diagram, which are compared with modes; higher ones crowd."""


def mode_distance(data: Any) -> float:
    """Compute how far the mesh line nearest to a mode is from it, over the frequency of the mode; of modes.nc."""
    _, line, mode = nearest_mesh_line(data)
    return abs(line / mode - 1.0)


def nearest_mesh_line(data: Any) -> tuple[str, float, float]:
    """Find the mesh line of modes.nc that is nearest to a mode: its name, its frequency and that of the mode [Hz].

    Up to harmonic `MESH_LINES`; without lines or modes the name is empty, the frequencies are NaN.
    """
    apart, lines, modes = mesh_lines_and_modes(data)
    if not apart.size:
        return "", math.nan, math.nan
    line, mode = np.unravel_index(int(apart.argmin()), apart.shape)
    return *lines[line], float(modes[mode])


def nearest_mesh_words(data: Any) -> str:
    """Write the mesh line of modes.nc that is nearest to a mode, how far it is from it, and the mode; empty without."""
    name, line, mode = nearest_mesh_line(data)
    if not name:
        return ""
    apart = f"{100.0 * abs(line / mode - 1.0):.3g} % {'below' if line < mode else 'above'}"
    return f"{name}, {line:,.0f} Hz, {apart} {nearest_mode(data, mode)}"


def mesh_lines_and_modes(data: Any) -> tuple[np.ndarray, list[tuple[str, float]], np.ndarray]:
    """Find how far mesh lines are from modes of modes.nc: |ln f/f_m| (L, m), lines with names [Hz], modes [Hz].

    Modes without stiffness are left out.
    """
    speed, hertz = float(data.attrs["speed"]), data["frequency"].values
    orders = zip(data["line"].values, data["order"].values, strict=True)
    lines = [(str(name), float(order) * speed / 60.0) for name, order in orders if "mesh" in str(name)]
    modes = hertz[hertz > 0.0]
    if not lines or not len(modes):
        return np.zeros((0, 0)), [], modes
    return np.abs(np.log(np.array([line for _, line in lines])[:, None] / modes)), lines, modes


def near_mode(data: Any, frequency: float, within: float = NEAR) -> str:
    """Write the mode of modes.nc that a frequency [Hz] is near, see `nearest_mode`; empty where none is."""
    hertz = data["frequency"].values
    near = (hertz > 0.0) & (np.abs(hertz - frequency) <= within * frequency)
    return nearest_mode(data, frequency) if near.any() else ""


def nearest_mode(data: Any, frequency: float) -> str:
    """Write which mode of modes.nc is nearest to a frequency [Hz], with its kind and what moves most in it."""
    hertz = data["frequency"].values
    elastic = np.flatnonzero(hertz > 0.0)
    if not len(elastic) or not frequency > 0.0:
        return "no mode"
    number = int(elastic[np.abs(np.log(hertz[elastic] / frequency)).argmin()])
    kind, member = data["kind"].values[number], data["main_member"].values[number]
    return f"mode {number + 1} at {hertz[number]:,.0f} Hz ({kind if kind == member else f'{kind}, {member}'})"
