"""Where the bodies of a drivetrain stand in space, for drawings of mode shapes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_coordinates import coordinates_of, free_coordinates
from femgear.models.drivetrain_data import Drivetrain

# Radius of bodies that carry no gear, and distance of wheels side by side, over the largest gear radius.
_PLAIN, _BESIDE = 0.9, 0.45
# Phi of a shaft that shears and hardly bends: more does not show.
_SHEAR_ALONE = 1e6


@dataclass(frozen=True)
class Wheel:
    """A disc: name, centre (3,), radius and width [m]; index of the body's centre in `Layout.centre`."""

    name: str
    centre: np.ndarray
    radius: float
    width: float
    body: int


@dataclass(frozen=True)
class Layout:
    """Discs, shafts between body centres, and places of all bodies.

    ``centre`` (n_bodies, 3) [m], planets after the bodies; ``shafts`` pairs of body numbers. The drawing is a
    scheme: bodies without gears get a radius, and two wheels of one body stand side by side.
    """

    names: tuple[str, ...]
    centre: np.ndarray
    wheels: tuple[Wheel, ...]
    shafts: tuple[tuple[int, int], ...]


def drivetrain_layout(train: Drivetrain) -> Layout:
    """Places along z by shaft lengths, across it by centre distances."""
    names = [body.name for body in train.bodies]
    gears = [r for s in train.parallel for r in (s.first_radius, s.second_radius)]
    gears += [stage.centre_distance for stage in train.planetary]
    size = max(gears, default=0.3)
    places = {names[0]: np.zeros(3)}
    links = [(s.first, s.second, np.array([0.0, 0.0, s.length])) for s in train.shafts]
    for s in train.parallel:
        apart = s.first_radius + s.second_radius
        beside = _BESIDE * size if any(s.first == other.second for other in train.parallel) else 0.0
        arm = [
            apart * math.cos(s.direction),
            apart * math.sin(s.direction),
            s.first_offset - s.second_offset + beside,
        ]
        links.append((s.first, s.second, np.array(arm)))
    links += [(s.carrier, s.sun, np.zeros(3)) for s in train.planetary]
    for _ in names:
        for first, second, arm in links:
            if first in places:
                places.setdefault(second, places[first] + arm)
            elif second in places:
                places[first] = places[second] - arm
    centre = [places[name] for name in names]
    wheels = _wheels(train, places, size)
    for stage in train.planetary:
        for p, angle in enumerate(stage.planet_angles):
            arm = stage.centre_distance * np.array([math.cos(angle), math.sin(angle), 0.0])
            wheels.append(
                Wheel(
                    f"planet {p + 1}",
                    places[stage.carrier] + arm,
                    stage.planet_radius,
                    0.2 * size,
                    len(names),
                )
            )
            names.append(
                f"planet {p + 1}" if len(train.planetary) == 1 else f"planet of {stage.carrier} {p + 1}"
            )
            centre.append(places[stage.carrier] + arm)
    shafts = tuple((names.index(s.first), names.index(s.second)) for s in train.shafts)
    return Layout(tuple(names), np.array(centre), tuple(wheels), shafts)


def _wheels(train: Drivetrain, places, size: float) -> list[Wheel]:
    order = [body.name for body in train.bodies]
    found = []
    for stage in train.planetary:
        plate = places[stage.carrier] - np.array([0.0, 0.0, 0.2 * size])
        found.append((stage.carrier, plate, stage.centre_distance, 0.06 * size))
        found.append((stage.sun, places[stage.sun], stage.sun_radius, 0.2 * size))
    for stage in train.parallel:
        other = places[stage.second] * np.array([0.0, 0.0, 1.0])
        first = places[stage.first] * np.array([1.0, 1.0, 0.0]) + other
        found.append((stage.first, first, stage.first_radius, 0.2 * size))
        found.append((stage.second, places[stage.second], stage.second_radius, 0.2 * size))
    geared = {name for name, *_ in found}
    found += [(n, places[n], _PLAIN * size, 0.3 * size) for n in order if n not in geared]
    return [Wheel(name, centre, radius, width, order.index(name)) for name, centre, radius, width in found]


def layout_motion(model: DrivetrainModel, layout: Layout, shape) -> tuple[np.ndarray, np.ndarray]:
    """Translation and rotation vector (n, 3) of every place of the layout under a motion (n_free,).

    Planets fixed to their pins follow the carrier, at its angle zero.
    """
    train = model.train
    place, full = _all_coordinates(model, shape)
    move, turn = np.zeros((2, len(layout.names), 3))
    for row, body in enumerate(train.bodies):
        x, y, *turns = full[place.body[body.name] : place.body[body.name] + 5]
        move[row], turn[row] = (x, y, 0.0), turns
    row = len(train.bodies)
    for stage, planets in zip(train.planetary, place.planets):
        at = [body.name for body in train.bodies].index(stage.carrier)
        for planet in planets:
            arm = layout.centre[row] - layout.centre[at]
            move[row] = move[at] + np.cross(turn[at], arm)
            turn[row] = *turn[at][:2], full[planet[2]]
            row += 1
    return move, turn


def shaft_lines(
    model: DrivetrainModel, layout: Layout, shape, *, points: int = 8
) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Centre lines of the shafts under a motion: places at rest and displacements, (k, 3) each.

    A shaft passes through its stations, between them by the shape functions of its elements; one that is
    modelled as a joint is drawn as the one element whose static stiffness the joint stands for.

    Parameters
    ----------
    model : DrivetrainModel
    layout : Layout
        Of ``model.train``.
    shape : (n_free,) array
        Motion of the free coordinates.
    points : int
        Pieces of an element of a beam.

    Returns
    -------
    tuple of (rest, displacement)
        In the order of the shafts of the chain [m].
    """
    place, full = _all_coordinates(model, shape)
    found = []
    for shaft, inner, ends in zip(model.train.shafts, place.inner, layout.shafts):
        first = np.array([place.body[shaft.first], *inner, place.body[shaft.second]])
        stations = full[first[:, None] + np.arange(5)]
        share, across = _beam_line(shaft, stations, points if shaft.elements else 3 * points)
        one, two = layout.centre[list(ends)]
        rest = one + share[:, None] * (two - one)
        found.append((rest, np.column_stack([across, np.zeros(len(share))])))
    return tuple(found)


def _all_coordinates(model: DrivetrainModel, shape):
    """Places of all coordinates, and their values (n,) under a motion of the free ones."""
    place = coordinates_of(model.train)
    T, _ = free_coordinates(model.train, place)
    return place, T @ np.asarray(shape, float)


def _beam_line(shaft, stations, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the length (k,) and displacements (k, 2) of a beam through its stations (n + 1, 5)."""
    count = max(shaft.elements, 1)
    length = shaft.length / count
    share = np.linspace(0.0, 1.0, count * points + 1)
    element = np.minimum(np.arange(len(share)) // points, count - 1)
    ratio = shaft.section.shear_ratio(length) if shaft.elements else _joint_shear_ratio(shaft)
    N = beam_shape(share * count - element, length, ratio)
    # a tilt about y is the slope of x, one about x minus that of y
    ends = np.stack([stations[element], stations[element + 1]], axis=1)
    x = np.einsum("kn,kn->k", N, ends[:, :, [0, 3]].reshape(-1, 4))
    y = np.einsum("kn,kn->k", N, (ends[:, :, [1, 2]] * np.array([1.0, -1.0])).reshape(-1, 4))
    return share, np.column_stack([x, y])


def _joint_shear_ratio(shaft) -> float:
    """Phi of the Timoshenko shaft whose static stiffness is that of a joint's springs.

    Bending ``E I / l`` and shear ``12 E I / ((1 + Phi) l^3)``, `femgear.models.shaft.joint_springs`. Under a
    spherical joint no force crosses the shaft, which then bends to a parabola whatever Phi is.
    """
    springs = shaft.springs
    if math.isinf(springs.shear):
        return 0.0
    return float(np.clip(12.0 * springs.bending / (springs.shear * shaft.length**2) - 1.0, 0.0, _SHEAR_ALONE))


def beam_shape(xi, length: float, shear_ratio: float) -> np.ndarray:
    """Deflection (k, 4) of a Timoshenko element per unit of (w, slope) at its first and second end.

    Exact for an element without load; ``xi`` (k,) runs from 0 to 1, ``slope`` is the turn of the section.
    These are the functions behind the consistent mass of `femgear.models.shaft.beam_element`
    (J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968, section 11.3; Z. Friedman and
    J. B. Kosmatka, Comput. Struct. 47, 1993, 473-481).
    """
    xi, phi = np.asarray(xi, float), shear_ratio
    rest = 1.0 - xi
    return np.stack([
        1.0 - 3.0 * xi**2 + 2.0 * xi**3 + phi * rest,
        length * (xi * rest**2 + 0.5 * phi * xi * rest),
        3.0 * xi**2 - 2.0 * xi**3 + phi * xi,
        -length * (xi**2 * rest + 0.5 * phi * xi * rest),
    ], axis=-1) / (1.0 + phi)  # fmt: skip
