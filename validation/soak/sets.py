"""Random valid planetary sets beyond those of the tests: what must hold for any of them."""

from __future__ import annotations

from pathlib import Path

import test_random_sets as properties

from validation.soak.trials import Outcome

PIECE = 4
STILL = (
    properties.test_every_number_is_finite,
    properties.test_static_solution_is_in_equilibrium,
    properties.test_equal_planets_are_equal,
)
MOVING = (
    properties.test_equal_planets_move_equally,
    properties.test_housing_has_only_the_orders_of_the_symmetry,
    properties.test_dynamic_transmission_error_at_rest_is_the_static_one,
    properties.test_dynamics_start_from_the_static_solution_with_elastic_members,
)
# the first numbers are seeds of the tests
_FIRST = properties.SLOW.stop


def trial(number: int, folder: Path) -> Outcome:
    """Solve the set of a seed and check every property, and the invariant that is its turn."""
    seed = _FIRST + number
    solved = properties.solve_set(seed, folder / "grids")
    checks = [*STILL, *properties.invariants_of(seed)]
    if solved.still:
        checks = [check for check in checks if check is not properties.converged_in_excitation]
    else:
        checks += MOVING
    for check in checks:
        try:
            check(solved)
        except AssertionError as error:
            return Outcome(solved.drawn.kind, f"seed {seed}: {check.__name__}: {str(error)[:300]}")
    return Outcome(f"{solved.drawn.kind}, {len(solved.angles)} planets")
