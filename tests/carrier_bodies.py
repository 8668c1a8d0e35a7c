"""Carriers made of beams: pins between two rigid cheeks, of which the far one turns against the seat on the shaft."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag, eigh

from femgear.fe.beam import RoundSection, beam_element, rigid_link
from femgear.trains.gearbox.modes import linear_system

RADIUS, HALF, SEAT = 0.04, 0.018, 0.03
"""Of the pins' circle, of the span of a pin, and z of the seat on the shaft above the planets [m]."""
SECTION = RoundSection(0.02)
ANGLES = tuple(2.0 * math.pi / 3.0 * n for n in range(3))


def beam_carrier(
    *, wind_up: float = 3e5, elements: int = 1, angles=ANGLES, stiffer: float = 1.0
) -> dict[str, np.ndarray]:
    """Arrays of a carrier file: the back cheek is the seat, the front one turns; elements a half pin."""
    nodes = 2 * elements + 1
    size = 6 + 6 * len(angles) + 1 + 6 * len(angles) * (2 * elements - 2)
    psi, inner = 6 + 6 * len(angles), 7 + 6 * len(angles)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    M, K, _ = beam_element(SECTION, HALF / elements)
    for number, angle in enumerate(angles):
        place = np.array([RADIUS * math.cos(angle), RADIUS * math.sin(angle), 0.0])
        rows = []
        for node in range(nodes):
            height = HALF * (node / elements - 1.0)
            row = np.zeros((6, size))
            if node == elements:
                row[:, 6 + 6 * number : 12 + 6 * number] = np.eye(6)
            elif node in (0, nodes - 1):
                row[:, :6] = rigid_link(place + np.array([0.0, 0.0, height - SEAT]))
                if node == 0:
                    row[:, psi] = rigid_link(place)[:, 5]
            else:
                row[:, inner : inner + 6] = np.eye(6)
                inner += 6
            rows.append(row)
        for first, second in pairwise(rows):
            ends = np.vstack([first, second])
            stiffness += ends.T @ K @ ends
            mass += ends.T @ M @ ends
    stiffness[psi, psi] += wind_up
    # cheeks: the back one moves with the seat, the front one turns besides
    for column in (None, psi):
        body = np.zeros((6, size))
        body[:, :6] = rigid_link((0.0, 0.0, HALF - SEAT if column is None else -HALF - SEAT))
        if column is not None:
            body[5, column] = 1.0
        mass += body.T @ np.diag([1.5, 1.5, 1.5, 1e-3, 1e-3, 2e-3]) @ body
    pins = [(RADIUS * math.cos(angle), RADIUS * math.sin(angle), 0.0) for angle in angles]
    return {
        "stiffness": stiffer * stiffness,
        "mass": mass,
        "role": np.array(["shaft", *(f"pin {n + 1}" for n in range(len(angles)))]),
        "position": np.array([(0.0, 0.0, SEAT), *pins]),
        "dofs": np.full(len(angles) + 1, "123456"),
    }


def without_tilts(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same with pins of three components: their rotations are inner coordinates."""
    count = len(arrays["role"])
    kept = [*range(6), *(6 * n + c for n in range(1, count) for c in range(3))]
    order = kept + [i for i in range(len(arrays["mass"])) if i not in kept]
    return arrays | {
        "stiffness": arrays["stiffness"][np.ix_(order, order)],
        "mass": arrays["mass"][np.ix_(order, order)],
        "dofs": np.array(["123456", *["123"] * (count - 1)]),
    }


def written(folder: Path, arrays: dict[str, np.ndarray], name: str = "carrier.npz") -> str:
    """Path of a file of these arrays."""
    np.savez(folder / name, **arrays)
    return str(folder / name)


def unreduced_frequencies(found, arrays):
    """Natural frequencies of the gearbox with all coordinates of the carrier's file in place of its superelement."""
    assembly, _, stiffness = linear_system(found)
    carrier = found.model.stages[0].elastic_carrier
    springs = tuple(one for one in assembly.springs if one.name != carrier.name)
    inertias = tuple(one for one in assembly.inertias if one.stations != carrier.stations)
    rest = replace(assembly, springs=springs, inertias=inertias)
    inner = len(arrays["mass"]) - 24
    link = np.zeros((len(arrays["mass"]), assembly.count + inner))
    link[:6, 6 * carrier.stations[0] : 6 * carrier.stations[0] + 6] = rigid_link((0.0, 0.0, SEAT))
    for number, station in enumerate(carrier.stations[1:], 1):
        link[6 * number : 6 * number + 6, 6 * station : 6 * station + 6] = np.eye(6)
    link[24:, assembly.count :] = np.eye(inner)
    T = block_diag(rest.motions, np.eye(inner))
    W = np.vstack([rest.columns, np.zeros((inner, len(stiffness)))])
    K = block_diag(rest.stiffness, np.zeros((inner, inner))) + link.T @ arrays["stiffness"] @ link
    M = block_diag(rest.mass, np.zeros((inner, inner))) + link.T @ arrays["mass"] @ link
    K = K + (W * stiffness) @ W.T
    squares = eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi)
