"""Sums of series with orders of their own: values, orders, lines at given frequencies."""

import numpy as np
import pytest
from published.transmission_errors import series_spectrum

from femgear.errors import CaseError
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, SummedSeries, constant

ONE = FourierSeries([[1.0, 2.0 - 1j, 0.5]], (1,))
OTHER = FourierSeries([[0.5, 3j]], (0, 1))


def test_values_mean_and_orders():
    both = SummedSeries((ONE, OTHER, constant([4.0])))
    theta = np.random.default_rng(1).uniform(0, 7, (5, 2))
    np.testing.assert_allclose(both.at(theta), ONE.at(theta) + OTHER.at(theta) + 4.0)
    assert both.orders == (1, 1) and both.mean == pytest.approx(5.5)
    assert SummedSeries((constant([1.0]),)).orders == (0,)
    assert both.at(theta[0]).shape == (1,)


def test_spectrum_adds_lines_that_coincide():
    backwards = FourierSeries([[0.0, 1j]], (-2,))
    line, value = series_spectrum(SummedSeries((ONE, OTHER, backwards)), [3.0, 5.0])
    np.testing.assert_allclose(line, [0.0, 3.0, 5.0, 6.0])
    np.testing.assert_allclose(value[0], [1.5, 2.0 - 1j, 3j, 0.5 - 1j])
    time = np.linspace(0.0, 2.0, 7)
    signal = (np.exp(1j * time[:, None] * line) @ value.T).real
    theta = time[:, None] * np.array([3.0, 5.0])
    np.testing.assert_allclose(signal, SummedSeries((ONE, OTHER, backwards)).at(theta))


def test_an_element_takes_it():
    mesh = GearMeshes([0], constant([2.0]), deflection=SummedSeries((ONE, OTHER)))
    theta = np.array([[0.3, 0.7]])
    force, _ = mesh.evaluate(np.array([[[9.0]]]), theta)
    assert force.item() == pytest.approx(2.0 * (9.0 - (ONE.at(theta) + OTHER.at(theta)).item()))


@pytest.mark.parametrize("parts", [(), (ONE, constant([1.0, 2.0])), (ONE, 3.0)])
def test_parts_that_do_not_add_up_are_refused(parts):
    with pytest.raises(CaseError, match="E-SHAPE"):
        SummedSeries(parts)
