"""Exact natural frequencies of Timoshenko shafts, without finite elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femgear.system.shaft import Disc, ShaftSection


def free_bending(
    section: ShaftSection,
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
    section : ShaftSection
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
