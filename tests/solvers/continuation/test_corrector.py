"""Steps of a branch and what their acceptance test can stand."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.continuation.arclength import continue_curve
from femgear.solvers.continuation.corrector import StepOptions


@pytest.mark.parametrize(("name", "value"), [("angle", 1.5), ("contraction", 0.5), ("angle", np.nan)])
def test_options_that_the_acceptance_test_cannot_stand_are_refused(name, value):
    with pytest.raises(CaseError, match="E-RANGE") as caught:
        StepOptions(**{name: value})
    assert caught.value.key == name and caught.value.remedy


def test_corner_of_a_piecewise_linear_curve_is_passed():
    def bent(u, p):
        return u - 0.06 * abs(p), np.eye(1), np.array([-0.06 * np.sign(p)])

    found = continue_curve(bent, [0.045], -0.75, limits=(-0.75, 1.0), unit=2.0)
    assert found.complete and not len(found.folds)
    np.testing.assert_allclose(found.points[:, 0], 0.06 * np.abs(found.parameter), atol=1e-12)
