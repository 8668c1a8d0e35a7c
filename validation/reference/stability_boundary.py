"""Boundary of parametric stability along a line of a stability chart."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root_scalar

from femgear.errors import CaseError, checked_tolerance
from femgear.solvers.periodic.solution import CIRCLE
from femgear.solvers.stability.parametric import _largest_of_cells, _prepared
from femgear.system.fourier import FourierSeries, StepSeries
from femgear.system.system import MeshExcitation, Modes, NonlinearSystem


def stability_boundary(
    system: Modes | NonlinearSystem,
    stiffness: FourierSeries | StepSeries | MeshExcitation,
    between: tuple[float, float],
    *,
    frequency: float | None = None,
    depth: float | None = None,
    harmonics: int = 6,
    tolerance: float = 1e-11,
) -> float:
    """Find where the stability changes along a line of the chart.

    The root of ``log |multiplier|``. Without damping the stable side has the modulus one throughout, so there
    the line is halved to 1e-13 of its end; next to the boundary the modulus leaves one like a square root.

    Parameters
    ----------
    system, stiffness, harmonics, tolerance
        As for :func:`stability_chart`.
    between : (a, b)
        Frequencies [rad/s], or depths, one stable and the other not.
    frequency, depth : float
        The one that is held; the other one varies.

    Raises
    ------
    CaseError
        Not exactly one of frequency and depth, or no change between the two ends.
    """
    if (frequency is None) == (depth is None):
        raise CaseError("hold the frequency or the depth", code="E-RANGE", limit="exactly one of the two")
    tolerance = checked_tolerance(tolerance)
    frame, series, breaks = _prepared(system, stiffness, harmonics)

    def growth(value: float) -> float:
        f, d = (value, depth) if frequency is None else (frequency, value)
        largest, _ = _largest_of_cells(frame, series, breaks, np.array([f]), np.array([d]), tolerance)
        return float(np.log(np.abs(largest[0])))

    ends = np.array([growth(value) for value in between])
    if np.count_nonzero(ends > CIRCLE) != 1:
        raise CaseError(
            f"largest multipliers {np.exp(ends).tolist()} at {list(between)}",
            code="E-RANGE",
            key="between",
            limit="one end stable, the other one not",
        )
    if ends.min() < -CIRCLE:
        return root_scalar(growth, bracket=between, method="brentq", xtol=1e-14, rtol=1e-13).root
    low, high = between
    unstable_low = ends[0] > CIRCLE
    while abs(high - low) > 1e-13 * abs(high):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (growth(middle) > CIRCLE) == unstable_low else (low, middle)
    return 0.5 * (low + high)
