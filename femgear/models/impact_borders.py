"""Frequency ratios at which a branch of the dimensionless pair begins or ends to have impacts."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.models.impact_pair import ImpactPair
from femgear.solvers.branches import Branch
from femgear.solvers.entries import checked_numbers
from femgear.solvers.harmonic_balance import solve_harmonic_balance

# instants of a period, and a step of the ratio within which interpolation along the branch will do
_SAMPLES = 2048
_SHORT = 1e-3


def lowest_deflection(solution) -> float:
    """Smallest deflection of a solution in scaled time, over 2048 phases."""
    return float(solution.at(2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES).min())


def impact_borders(pair: ImpactPair, branch: Branch, level: float) -> np.ndarray:
    """Ratios (n,) along the branch at which the smallest deflection passes a level, to 1e-6.

    The harmonic balance equations are solved again between two points of the branch; at limit points, where
    two points lie within 1e-3 of the ratio, the border is interpolated.

    Parameters
    ----------
    pair : ImpactPair
    branch : Branch
        Over the frequency ratio, from ``parameter_curve(pair.problem, ..., 1.0)``.
    level : float
        `DRIVE` for the first impacts, `BACK` for impacts on both flanks.

    Raises
    ------
    CaseError
        A level that is no finite number (E-VALUE).
    """
    from scipy.optimize import brentq

    number = checked_numbers(level, "level", code="E-VALUE", unit="")
    if number.ndim or not np.isfinite(number):
        raise CaseError(f"a level of {number.tolist()}", code="E-VALUE", key="level", limit="a finite number")
    away = np.array([lowest_deflection(one) for one in branch.solutions]) - level
    borders = []
    for i in np.flatnonzero(np.signbit(away[:-1]) != np.signbit(away[1:])):
        ends, near = branch.parameter[i : i + 2], branch.solutions[i]
        if abs(ends[1] - ends[0]) <= _SHORT:
            borders.append(ends[0] + away[i] / (away[i] - away[i + 1]) * (ends[1] - ends[0]))
            continue

        def lowest(ratio, near=near):
            found = solve_harmonic_balance(
                pair.problem(ratio), 1.0, orders=near.orders, start=near, samples=1024, stability=False
            )
            return lowest_deflection(found) - level

        borders.append(brentq(lowest, *ends, xtol=1e-6))
    return np.array(borders)
