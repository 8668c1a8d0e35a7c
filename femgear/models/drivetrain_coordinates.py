"""Coordinates of a drivetrain: places, names, rigid constraints, kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_data import Drivetrain
from femgear.models.shaft import AXES, joint_deflections

# Row of a kinematic condition, relative to the largest, that counts as none.
_RANK = 1e-12


@dataclass(frozen=True)
class Coordinates:
    """Places of everything among all coordinates, before constraints.

    ``names`` (n,); ``body`` name -> first of five places; ``planets`` per planetary stage (N, 3), radial,
    tangential and rotation; ``inner`` per shaft, first places of the stations inside it.
    """

    names: tuple[str, ...]
    body: dict[str, int]
    planets: tuple[np.ndarray, ...]
    inner: tuple[tuple[int, ...], ...]

    @property
    def count(self) -> int:
        return len(self.names)


def coordinates_of(train: Drivetrain) -> Coordinates:
    """Five coordinates a body and a station of a shaft, three a planet; planets follow their carrier."""
    names, body, planets, inner = [], {}, {}, {}
    for one in train.bodies:
        body[one.name] = len(names)
        names += [f"{one.name}: {axis}" for axis in AXES]
        for number, stage in enumerate(train.planetary):
            if stage.carrier == one.name:
                prefix = "planet" if len(train.planetary) == 1 else f"planet of {one.name}"
                n = len(stage.planet_angles)
                planets[number] = len(names) + np.arange(3 * n).reshape(n, 3)
                names += [
                    f"{prefix} {p + 1}: {axis}"
                    for p in range(n)
                    for axis in ("radial", "tangential", "rotation")
                ]
    for number, shaft in enumerate(train.shafts):
        inner[number] = tuple(len(names) + 5 * i for i in range(max(shaft.elements - 1, 0)))
        for i in range(len(inner[number])):
            names += [f"shaft {shaft.first}-{shaft.second} {i + 1}: {axis}" for axis in AXES]
    return Coordinates(
        tuple(names), body, tuple(planets[n] for n in range(len(planets))),
        tuple(inner[n] for n in range(len(inner))),
    )  # fmt: skip


def bearing_place(train: Drivetrain, place: Coordinates, bearing) -> int:
    """First of the five places that a bearing holds.

    Raises
    ------
    CaseError
        There is no such station (E-DRIVETRAIN).
    """
    if not bearing.station:
        return place.body[bearing.body]
    for shaft, inner in zip(train.shafts, place.inner):
        if (shaft.first, shaft.second) == (bearing.body, bearing.other) and bearing.station <= len(inner):
            return inner[bearing.station - 1]
    raise CaseError(
        f"no station {bearing.station} inside a shaft from {bearing.body} to {bearing.other}",
        code="E-DRIVETRAIN", limit="1 to the number of elements less one", key="station",
    )  # fmt: skip


def free_coordinates(train: Drivetrain, place: Coordinates) -> tuple[np.ndarray, tuple[str, ...]]:
    """All coordinates per unit of the free ones (n, n_free), and the names of those.

    Infinitely stiff bearings and joints, bodies that do not tilt and planets fixed to their pins leave
    fewer.
    """
    held = np.zeros(place.count, bool)
    for one in train.bodies:
        if not one.tilts:
            held[place.body[one.name] + np.array([2, 3])] = True
    for bearing in train.bearings:
        first = bearing_place(train, place, bearing)
        held[first : first + 2] |= math.isinf(bearing.radial)
        held[first + 2 : first + 4] |= math.isinf(bearing.tilt)
    for stage, own in zip(train.planetary, place.planets):
        held[own[:, :2]] |= math.isinf(stage.planet_bearing)
    free = np.flatnonzero(~held)
    rows = [np.zeros((0, place.count))]
    for shaft in train.shafts:
        if not shaft.elements:
            s = shaft.springs
            stiff = np.isinf([s.shear, s.shear, s.bending, s.bending, s.torsion])
            rows.append(joint_rows(place, shaft)[stiff])
    return _eliminated(np.vstack(rows), free, place)


def _eliminated(rows, free, place):
    """Solve the conditions ``rows q = 0`` for as many of the free coordinates, the last ones first."""
    from scipy import linalg

    backwards = free[::-1]
    size = np.abs(rows).max(initial=0.0)
    table = rows[:, backwards]
    table = table[np.abs(table).max(axis=1, initial=0.0) > _RANK * size]
    if not len(table):
        return np.eye(place.count)[:, free], tuple(place.names[i] for i in free)
    _, triangle, order = linalg.qr(table, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.count_nonzero(diagonal > _RANK * diagonal[0]))
    bound, rest = backwards[order[:rank]], np.sort(backwards[order[rank:]])
    column = {int(c): i for i, c in enumerate(backwards[order])}
    tied = -linalg.solve_triangular(triangle[:rank, :rank], triangle[:rank, [column[int(c)] for c in rest]])
    T = np.zeros((place.count, len(rest)))
    T[rest, np.arange(len(rest))] = 1.0
    T[bound] = tied
    return T, tuple(place.names[i] for i in rest)


def joint_rows(place: Coordinates, shaft) -> np.ndarray:
    """Deflections (5, n) of the joint of a shaft."""
    rows = np.zeros((5, place.count))
    local = joint_deflections(shaft.length)
    for name, part in ((shaft.first, local[:, :5]), (shaft.second, local[:, 5:])):
        rows[:, place.body[name] : place.body[name] + 5] += part
    return rows


def rigid_rotation(train: Drivetrain, place: Coordinates) -> np.ndarray:
    """Rotations (n,) of the free spin of the chain, that of the first body being one.

    Willis' equation for planetary stages: ``r_s (s - c) + r_p (p - c) = 0``, ``r_r c + r_p (p - c) = 0``.

    Raises
    ------
    CaseError
        The stages do not leave exactly one spin (E-KINEMATICS).
    """
    turn = {name: first + 4 for name, first in place.body.items()}
    rows = []

    def condition(*terms):
        row = np.zeros(place.count)
        for at, factor in terms:
            row[at] += factor
        rows.append(row / np.abs(row).max())

    for shaft, inner in zip(train.shafts, place.inner):
        for at in (turn[shaft.second], *(first + 4 for first in inner)):
            condition((turn[shaft.first], 1.0), (at, -1.0))
    for stage in train.parallel:
        condition((turn[stage.first], stage.first_radius), (turn[stage.second], stage.second_radius))
    for stage, planets in zip(train.planetary, place.planets):
        c, s = turn[stage.carrier], turn[stage.sun]
        for p in planets[:, 2]:
            condition((s, stage.sun_radius), (p, stage.planet_radius), (c, -stage.centre_distance))
            condition((c, stage.ring_radius - stage.planet_radius), (p, stage.planet_radius))
    rotations = sorted({*turn.values(), *(int(p) for own in place.planets for p in own[:, 2])})
    rotations += [first + 4 for inner in place.inner for first in inner]
    table = np.array(rows).reshape(-1, place.count)[:, rotations]
    _, values, vectors = np.linalg.svd(table)
    spins = len(rotations) - int(np.count_nonzero(values > 1e-10 * values.max(initial=1.0)))
    if spins != 1 or abs(vectors[-1, 0]) < 1e-12:
        raise CaseError(
            f"the stages leave {spins} independent rotations", code="E-KINEMATICS", limit="one",
            remedy="check the radii of stages that lie side by side, and what joins the bodies",
        )  # fmt: skip
    spin = np.zeros(place.count)
    spin[rotations] = vectors[-1] / vectors[-1, rotations.index(turn[train.bodies[0].name])]
    for stage, planets in zip(train.planetary, place.planets):
        if math.isfinite(stage.planet_bearing):
            # planets that are not fixed to their pins have tangential coordinates of their own
            spin[planets[:, 1]] = stage.centre_distance * spin[turn[stage.carrier]]
    return spin
