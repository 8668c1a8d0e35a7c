"""Oil between teeth: viscosity, pressure coefficient, film thickness."""

import numpy as np
import pytest

from femgear.gears.micropitting import AT_38, OilState, film_thickness, kinematic_viscosity, oil_density, oil_state
from femgear.system.bearing_life import oil_viscosity


def test_viscosity_meets_both_given_ones_and_falls_between():
    kelvin = np.array([313.15, 373.15, 343.15])
    cold, hot, between = kinematic_viscosity(100e-6, 11e-6, kelvin)
    assert (cold, hot) == (pytest.approx(100e-6), pytest.approx(11e-6)) and hot < between < cold
    assert oil_viscosity(100e-6, 11e-6, 70.0) == pytest.approx(between)


def test_pressure_coefficient_is_that_of_its_kind_at_38_degrees():
    for kind, scale, power in (("mineral", 2.657e-8, 0.1348), ("PAO", 1.466e-8, 0.0507)):
        state = oil_state(100e-6, 11e-6, 880.0, kind, AT_38)
        dynamic = kinematic_viscosity(100e-6, 11e-6, AT_38) * oil_density(880.0, AT_38)
        assert state.viscosity == pytest.approx(dynamic)
        assert state.pressure_coefficient == pytest.approx(scale * dynamic**power, rel=1e-3)
    assert oil_density(880.0, 389.0) == pytest.approx(810.0)


def test_film_goes_by_its_powers():
    oil, hot = OilState(0.01, 1.5e-8), OilState(0.008, 1.4e-8)
    film = film_thickness(0.01, 2e11, 5.0, 1e9, oil, oil)
    assert 0.05e-6 < film < 0.5e-6
    assert film_thickness(0.01, 2e11, 10.0, 1e9, oil, oil) / film == pytest.approx(2.0**0.7)
    assert film_thickness(0.01, 2e11, 5.0, 2e9, oil, oil) / film == pytest.approx(4.0**-0.13)
    assert film_thickness(0.02, 2e11, 5.0, 1e9, oil, oil) / film == pytest.approx(2.0**0.3)
    assert film_thickness(0.01, 2e11, 5.0, 1e9, oil, hot) / film == pytest.approx((0.8 * 1.4 / 1.5) ** 0.22)
