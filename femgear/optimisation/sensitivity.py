"""What an optimum loses when its variables are off by their tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.optimisation.designs import Failure
from femgear.optimisation.objectives import Quantity

if TYPE_CHECKING:
    from femgear.optimisation.problem import Evaluations
    from femgear.optimisation.variables import Variable


@dataclass(frozen=True)
class Tolerance:
    """Quantities with one variable off by its tolerance.

    Parameters
    ----------
    variable : Variable
    tolerance : float
        In the unit of the variable.
    less, more : dict
        Value of every quantity by name [SI] with the variable lower and higher; NaN where that cannot be
        computed.
    """

    variable: Variable
    tolerance: float
    less: dict[str, float]
    more: dict[str, float]

    def slope(self, name: str, value: float) -> tuple[float, float]:
        """Rise of a quantity per unit of the variable towards less and towards more.

        Both are positive at a corner, where a derivative does not exist.
        """
        return (self.less[name] - value) / self.tolerance, (self.more[name] - value) / self.tolerance


def tolerances(
    evaluations: Evaluations, x: Sequence[float], quantities: Sequence[Quantity]
) -> tuple[tuple[Tolerance, ...], dict[str, float]]:
    """Every variable off by its tolerance, alone; and all of them at once, each to its worse side.

    Parameters
    ----------
    evaluations : Evaluations
    x : (n,) sequence
        The optimum, in the units of the variables. Points may lie outside the bounds.
    quantities : sequence of Quantity
        The first says which side is the worse one.

    Returns
    -------
    tuple of Tolerance
    dict
        Quantities by name, all variables off at once; NaN where that cannot be computed.
    """
    x, found = np.array(x, float), []
    worse = x.copy()
    for i, variable in enumerate(evaluations.problem.variables):
        tolerance = variable.tolerance_at(float(x[i]))
        sides = []
        for sign in (-1.0, 1.0):
            off = x.copy()
            off[i] += sign * tolerance
            sides.append(_values(evaluations, off, quantities))
        found.append(Tolerance(variable, tolerance, *sides))
        objective = [side[quantities[0].name] for side in sides]
        # a side that cannot be computed is no place to go
        if np.isfinite(objective).any():
            worse[i] += (-tolerance, tolerance)[int(np.nanargmax(objective))]
    return tuple(found), _values(evaluations, worse, quantities)


def _values(evaluations: Evaluations, x, quantities) -> dict[str, float]:
    try:
        return evaluations.values(x, quantities)
    except Failure:
        return {quantity.name: np.nan for quantity in quantities}
