"""An optimum in words and rows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.optimisation.search import Optimum


def describe(found: Optimum) -> str:
    """Before and after, values of the variables, what their tolerances cost, and how it was found."""
    lines = [
        f"{name}: {before} -> {after} ({change})" for name, before, after, change in comparison_rows(found)
    ]
    lines += [f"{key} = {value}" for key, value in found.values.items()]
    lines += [f"at a bound: {name}" for name in found.at_bounds]
    for name, tolerance, less, more in tolerance_rows(found):
        lines.append(f"{name} off by {tolerance}: {less} less, {more} more")
    return "\n".join([*lines, verdict(found)])


def comparison_rows(found: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Name, before, after and change of every reported quantity."""
    for quantity in found.problem.reported:
        before, after = found.before[quantity.name], found.after[quantity.name]
        change = f"{after / before - 1.0:+.1%}" if before else ""
        yield quantity.name, quantity.show(before), quantity.show(after), change


def tolerance_rows(found: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Variable, tolerance, and the objective with the variable lower and higher."""
    objective = found.problem.objective

    def show(value: float) -> str:
        return "cannot be computed" if math.isnan(value) else objective.show(value)

    for one in found.tolerances:
        sides = (show(one.less[objective.name]), show(one.more[objective.name]))
        yield one.variable.name, f"{one.tolerance:.4g} {one.variable.unit}".strip(), *sides
    if found.all_off:
        worst = show(found.all_off[objective.name])
        yield "all at once, each to its worse side", "", worst, worst


def verdict(found: Optimum) -> str:
    """How the optimum was found, and what to think of it."""
    each = f" ({found.seconds:.2g} s each)" if found.computed else ""
    text = (
        f"method {found.method}: {found.designs} designs, {found.computed} computed now{each}, "
        f"{found.failures} cannot be computed; {found.message}"
    )
    return text if found.converged else f"{text}; NOT CONVERGED"
