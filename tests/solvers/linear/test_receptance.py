"""What a response to transmission errors refuses."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.receptance import modal_error_response
from femgear.system.system import MechanicalSystem


def test_one_number_of_an_error_that_is_not_finite_is_refused():
    one = np.eye(1)
    modes = undamped_modes(MechanicalSystem(one, 0.0 * one, one, one, np.zeros(1), ("x",)), [3.0])
    for value in (np.nan, np.inf, 1j * np.inf):
        with pytest.raises(CaseError, match="E-SHAPE"):
            modal_error_response(modes, [0.1], [[1e-6, value, 1e-7]])
    # k (d - e) of one mass: 3 (3 / (4 - w^2) - 1) e
    found = modal_error_response(modes, [0.1], [[1e-6]]).force.item()
    assert found == pytest.approx(3e-6 * (3.0 / (4.0 - (0.2 * np.pi) ** 2) - 1.0), rel=1e-12)
