"""The rule of a step and the equations of its columns, each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.solvers.time import steps
from femgear.solvers.time.steps import generalised_alpha, stability_limit


@pytest.mark.parametrize("radius", [0.0, 0.4, 0.8, 1.0])
def test_a_generalised_alpha_rule_is_stable_down_to_its_smallest_beta(radius):
    """Chung and Hulbert (1993), Eq. 15: a_m <= a_f <= 1/2 and beta >= 1/4 + (a_f - a_m)/2."""
    rule = generalised_alpha(radius)
    assert stability_limit(rule) == np.inf
    least = 0.25 + 0.5 * (rule.force - rule.mass)
    assert stability_limit(replace(rule, beta=least)) == np.inf
    assert np.isnan(stability_limit(replace(rule, beta=least - 1e-6)))


def test_newton_steps_are_halved_until_the_columns_fit_better():
    """``x + 100 max(x, 0) = 0.1`` from 0, tried at 1: 1/512 is the first half that leaves less than 0.1."""
    aim, nothing = np.array([0.1]), np.zeros(1)

    def law(i, x):
        return 100.0 * np.maximum(x, 0.0), 100.0 * (x > 0.0)

    x, g, slope = steps._shortened(law, 0, np.eye(1), aim, np.ones(1), nothing, 0.1**2)
    assert (x.tolist(), g.tolist(), slope.tolist()) == ([1.0 / 512.0], [100.0 / 512.0], [100.0])
