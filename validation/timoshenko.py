"""Timoshenko shafts: exact natural frequencies, and beam elements with discs and bearings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.fe.beam import AXES, BeamShaft, RoundSection, body_matrices
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
    """Bearing on a station: stiffness across and along the axis [N/m], against tilt and rotation [N m/rad]."""

    station: int
    radial: float
    tilt: float = 0.0
    axial: float = 0.0
    twist: float = 0.0


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


def hinged_whirl(section: RoundSection, length: float, number: int, speed: float) -> float:
    """Whirl frequency [Hz] of a turning shaft on two hinges, by the number of its half waves.

    The speed of rotation [rad/s] is positive for whirl in its sense. With ``x + i y = W sin(k z) exp(i w t)`` and
    tilts as ``cos(k z)``: ``(kappa G A k^2 - rho A w^2) (E I k^2 + kappa G A + 2 rho I Omega w - rho I w^2) =
    (kappa G A k)^2``, the lowest positive root (Timoshenko's beam with the angular momentum of its sections).
    """
    s, k = section, number * math.pi / length
    shear, rotary = s.shear_coefficient * s.shear_modulus * s.area, s.density * s.second_moment
    across = np.poly1d([-s.density * s.area, 0.0, shear * k**2])
    tilt = np.poly1d([-rotary, 2.0 * rotary * speed, s.young * s.second_moment * k**2 + shear])
    roots = np.roots((across * tilt - (shear * k) ** 2).coeffs).real
    return float(roots[roots > 0.0].min()) / (2.0 * math.pi)


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


def shaft_system(shaft: BeamShaft, *, discs: Sequence[Disc] = (), supports: Sequence[Support] = ()) -> MechanicalSystem:
    """One shaft with discs and bearings.

    Parameters
    ----------
    shaft : BeamShaft
    discs, supports : sequences
        An infinite stiffness holds the coordinate, which is then left out.

    Returns
    -------
    MechanicalSystem
        ``W`` has no columns; ``gyroscopic`` multiplies the speed of the shaft.
    """
    count = len(shaft.stations)
    M, K, G = shaft.mass.copy(), shaft.stiffness.copy(), shaft.gyroscopic.copy()
    for disc in discs:
        place = _place(disc.station, count)
        mass, gyroscopic = body_matrices(disc.mass, disc.polar, disc.transverse)
        M[place, place] += mass
        G[place, place] += gyroscopic
    held = np.zeros(6 * count, bool)
    for support in supports:
        place = _place(support.station, count)
        stiffness = np.array([support.radial] * 2 + [support.axial] + [support.tilt] * 2 + [support.twist])
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
    return slice(6 * station, 6 * station + 6)


def natural_frequencies(system: MechanicalSystem, *, axes: Sequence[str] = AXES) -> np.ndarray:
    """Compute the frequencies (n,) [Hz] of a shaft at rest, ascending, by its motions of these names alone."""
    from scipy.linalg import eigh

    kept = [i for i, name in enumerate(system.dofs) if name.split(": ")[1] in axes]
    cut = np.ix_(kept, kept)
    return np.sqrt(np.abs(eigh(system.K[cut], system.M[cut], eigvals_only=True))) / (2.0 * math.pi)


def whirl_frequencies(system: MechanicalSystem, speed: float) -> np.ndarray:
    """Compute frequency [Hz] and sense (n, 2) of all modes of a shaft that turns at a speed [rad/s], ascending.

    Sense 1 whirls with the rotation about z, -1 against it, 0 is torsion or stretch.
    """
    from scipy.linalg import eig

    M, n = system.M, len(system.M)
    zero, identity = np.zeros((n, n)), np.eye(n)
    assert system.gyroscopic is not None
    state = np.block([[zero, identity], [-system.K, -speed * system.gyroscopic]])
    poles, states = eig(state, np.block([[identity, zero], [zero, M]]))  # type: ignore[misc]
    axes = np.array([name.split(": ")[1] for name in system.dofs])
    lateral = ~np.isin(axes, ("z", "rotation"))
    result = []
    for pole, shape in zip(poles, states[:n].T):
        if pole.imag <= 0.0:
            continue
        weight = (shape.conj() * (M @ shape)).real
        tilts = shape[axes == "tilt x"].conj() @ shape[axes == "tilt y"]
        # y follows x by a quarter of a turn where the shaft whirls about z
        sense = np.sign(tilts.imag) * -1.0 if weight[lateral].sum() > 0.5 * weight.sum() else 0.0
        result.append((pole.imag / (2.0 * math.pi), sense))
    return np.array(sorted(result))
