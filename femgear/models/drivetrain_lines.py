"""Named lines of drivetrain spectra: mesh harmonics, side bands of the carriers, mixtures of two meshes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_record import PASS_BAND

HARMONICS, SIDE_BANDS = 3, 3
# Half width of the main lobe of Hann's window in lines.
_LOBE = 2.0


@dataclass(frozen=True)
class MeshLine:
    """A line: its name, the integer orders of the bases, and the order of the first body."""

    name: str
    orders: tuple[int, ...]
    order: float


def mesh_lines(model: DrivetrainModel) -> tuple[MeshLine, ...]:
    """Mesh harmonics, side bands of the carrier's turn, sums and differences of two meshes."""
    count, planets = len(model.bases), len(model.geometry.even)
    meshes = [base for base in range(count) if base % 2 or base >= 2 * planets]
    found = []

    def add(name: str, orders: dict[int, int]) -> None:
        vector = np.zeros(count, int)
        vector[list(orders)] = list(orders.values())
        order = float(vector @ model.base_ratio)
        if order:
            found.append(MeshLine(name, tuple(int(o) for o in vector), abs(order)))

    for base in meshes:
        text = model.bases[base]
        if base < 2 * planets:
            add(model.bases[base - 1], {base - 1: 1})
        for h in range(1, HARMONICS + 1):
            add(text if h == 1 else f"{h} x {text}", {base: h})
        for k in (*range(-SIDE_BANDS, 0), *range(1, SIDE_BANDS + 1)) if base < 2 * planets else ():
            words = f"{'+' if k > 0 else '-'} {abs(k)} turn{'s' if abs(k) > 1 else ''}"
            add(f"{text} {words}", {base: 1, base - 1: k})
    for one, two in itertools.combinations(meshes, 2):
        for sign, word in ((1, "+"), (-1, "-")):
            add(f"{model.bases[two]} {word} {model.bases[one]}", {two: 1, one: sign})
    return tuple(found)


def resolved_lines(model: DrivetrainModel, lines, distance: float) -> np.ndarray:
    """Whether (L,) Hann's window parts a line from others and mesh harmonics; distance of orders."""
    order = np.array([line.order for line in lines])
    harmonics = np.outer(np.arange(1, 11), model.base_ratio[np.unique(model.mesh_base)]).ravel()
    apart = np.abs(order[:, None] - np.concatenate([order, harmonics]))
    # the line itself, twice where it is a mesh harmonic
    apart[apart < 1e-9 * order.max(initial=1.0)] = np.inf
    return apart.min(axis=1, initial=np.inf) >= _LOBE * distance


def line_amplitudes(signal, angle, speed, lines, *, record_rate: float) -> np.ndarray:
    """Amplitudes (L, c) of lines in signals (n, c), by projection on them at their exact orders.

    Hann's window over the angle; the mean is taken off. NaN beyond the pass band of the records.

    Parameters
    ----------
    signal : (n, c) array
        Records of equal distance in time.
    angle, speed : (n,) arrays
        Of the first body [rad], [rad/s].
    lines : sequence of MeshLine
    record_rate : float
        [Hz]
    """
    part = (angle - angle[0]) / (angle[-1] - angle[0])
    weight = (0.5 - 0.5 * np.cos(2.0 * np.pi * part)) * speed
    weight = weight / weight.sum()
    signal = np.asarray(signal, float)
    signal = signal - weight @ signal
    found = np.full((len(lines), signal.shape[1]), np.nan)
    for row, line in enumerate(lines):
        if line.order * np.abs(speed).max() / (2.0 * np.pi) <= 0.5 * PASS_BAND * record_rate:
            found[row] = 2.0 * np.abs((weight * np.exp(-1j * line.order * angle)) @ signal)
    return found
