"""Timoshenko shafts: exact natural frequencies, and beam elements with discs and bearings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.fe.shaft import AXES, RoundSection, beam_element, disc_matrices
from femgear.system.system import MechanicalSystem


@dataclass(frozen=True)
class Disc:
    """Rigid disc on a station: mass [kg], polar and transverse inertia [kg m^2]."""

    station: int
    mass: float
    polar: float
    transverse: float


@dataclass(frozen=True)
class Support:
    """Bearing on a station: stiffness across the axis [N/m] and against tilt [N m/rad]."""

    station: int
    radial: float
    tilt: float = 0.0


def simply_supported(section: RoundSection, length: float, number: int) -> float:
    """Bending frequency [Hz] of a shaft on two hinges, by the number of its half waves, from 1.

    The lower root of ``rho^2 I / (kappa G) w^4 - (rho A + rho I (1 + E / (kappa G)) k^2) w^2 + E I k^4 = 0``.
    """
    s, k = section, number * math.pi / length
    slide = s.shear_coefficient * s.shear_modulus
    a = s.density**2 * s.second_moment / slide
    b = s.density * (s.area + s.second_moment * (1.0 + s.young / slide) * k**2)
    square = (b - math.sqrt(b * b - 4.0 * a * s.young * s.second_moment * k**4)) / (2.0 * a)
    return math.sqrt(square) / (2.0 * math.pi)


def free_bending(
    section: RoundSection,
    length: float,
    low: float,
    high: float,
    *,
    discs: Sequence[tuple[float, Disc]] = (),
    count: int = 400,
) -> list[float]:
    """Bending frequencies [Hz] of a free shaft at rest between two bounds: zeros of its transfer matrix.

    ``w' = psi + V / (kappa G A)``, ``psi' = M / (E I)``, ``M' = -V - rho I omega^2 psi``, ``V' = -rho A
    omega^2 w`` (S. Timoshenko, Phil. Mag. 41, 1921, 744-746); a disc adds ``-I_t omega^2 psi`` to M and
    ``-m omega^2 w`` to V.

    Parameters
    ----------
    section : RoundSection
    length, low, high : float
        [m], [Hz]
    discs : sequence of (place [m], Disc)
        Ascending; the station of the disc is not used.
    count : int
        Points of the grid on which changes of sign are looked for.
    """
    from scipy.linalg import expm
    from scipy.optimize import brentq

    shear = section.shear_coefficient * section.shear_modulus * section.area
    bend = section.young * section.second_moment
    stops = [*discs, (length, None)]

    def residue(hertz):
        square = (2.0 * np.pi * hertz) ** 2
        field = np.zeros((4, 4))
        field[0, 1], field[0, 3], field[1, 2] = 1.0, 1.0 / shear, 1.0 / bend
        field[2, 1], field[2, 3] = -section.density * section.second_moment * square, -1.0
        field[3, 0] = -section.density * section.area * square
        total, here = np.eye(4), 0.0
        for place, disc in stops:
            total = expm(field * (place - here)) @ total
            here = place
            if disc is not None:
                point = np.eye(4)
                point[2, 1], point[3, 0] = -disc.transverse * square, -disc.mass * square
                total = point @ total
        # no moment and no force at both ends
        return np.linalg.det(total[2:, :2])

    grid = np.linspace(low, high, count)
    values = [residue(hertz) for hertz in grid]
    return [brentq(residue, a, b) for a, b, u, v in zip(grid, grid[1:], values, values[1:]) if u * v < 0.0]


def shaft_system(
    sections: Sequence[RoundSection],
    lengths: Sequence[float],
    *,
    discs: Sequence[Disc] = (),
    supports: Sequence[Support] = (),
) -> MechanicalSystem:
    """One shaft of any number of elements with discs and bearings.

    Parameters
    ----------
    sections, lengths : (n,) sequences
        Of the elements, from the first station to the last.
    discs, supports : sequences
        An infinite stiffness holds the coordinate, which is then left out.

    Returns
    -------
    MechanicalSystem
        ``W`` has no columns; ``gyroscopic`` multiplies the speed of the shaft.
    """
    count = len(lengths) + 1
    if len(sections) != len(lengths) or count < 2:
        raise CaseError(
            f"{len(sections)} sections and {len(lengths)} lengths",
            code="E-SHAPE",
            limit="one of each an element, one element or more",
        )
    M, K, G = (np.zeros((5 * count, 5 * count)) for _ in range(3))
    for number, (section, length) in enumerate(zip(sections, lengths)):
        place = slice(5 * number, 5 * number + 10)
        for total, part in zip((M, K, G), beam_element(section, length)):
            total[place, place] += part
    for disc in discs:
        own = disc_matrices(disc.mass, disc.polar, disc.transverse)
        place = _place(disc.station, count)
        M[place, place] += own[0]
        G[place, place] += own[1]
    held = np.zeros(5 * count, bool)
    for support in supports:
        place = _place(support.station, count)
        stiffness = np.array([support.radial, support.radial, support.tilt, support.tilt, 0.0])
        held[place] |= np.isinf(stiffness)
        K[place, place] += np.diag(np.where(np.isinf(stiffness), 0.0, stiffness))
    free = np.flatnonzero(~held)
    names = [f"station {n + 1}: {axis}" for n in range(count) for axis in AXES]
    cut = np.ix_(free, free)
    return MechanicalSystem(
        M[cut],
        np.zeros((len(free), len(free))),
        K[cut],
        np.zeros((len(free), 0)),
        np.zeros(len(free)),
        tuple(names[i] for i in free),
        G[cut],
    )


def _place(station: int, count: int) -> slice:
    if not 0 <= station < count:
        raise CaseError(f"station {station} of {count}", code="E-SHAFT", limit=f"0 to {count - 1}")
    return slice(5 * station, 5 * station + 5)
