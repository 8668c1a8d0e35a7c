import numpy as np
import pytest
from published.transmission_errors import series_spectrum

from femgear.errors import CaseError
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import (
    FourierSeries,
    StepSeries,
    SummedSeries,
    checked_lines,
    coincidence_note,
    constant,
    distinct_lines,
    harmonic_lines,
    harmonics_of,
    line_tail,
    phase_of,
    sample,
    series_of,
    side_bands,
)

THETA = np.random.default_rng(0).uniform(-20.0, 20.0, (7, 2))


def test_fourier_series_is_its_sum_of_cosines():
    series = FourierSeries([[2.0, 0.5, -0.3j], [1.0, 0.2j, 0.0]], (0, 1))
    tau = THETA[:, 1]
    wanted = np.stack([2.0 + 0.5 * np.cos(tau) + 0.3 * np.sin(2.0 * tau), 1.0 - 0.2 * np.sin(tau)], axis=1)
    np.testing.assert_allclose(series.at(THETA), wanted, atol=1e-14)
    np.testing.assert_array_equal(series.mean, [2.0, 1.0])


def test_orders_combine_the_phases():
    series = FourierSeries([[0.0, 1.0]], (-1, 2))
    np.testing.assert_allclose(series.at(THETA)[:, 0], np.cos(2.0 * THETA[:, 1] - THETA[:, 0]), atol=1e-14)
    assert series.at(THETA.reshape(7, 1, 2)).shape == (7, 1, 1)


def test_series_of_samples_passes_through_them():
    samples = np.random.default_rng(1).standard_normal((3, 9))
    theta = 2.0 * np.pi * np.arange(9)[:, None] / 9
    np.testing.assert_allclose(series_of(samples, 4).at(theta).T, samples, atol=1e-14)


def test_constants_do_not_change():
    np.testing.assert_array_equal(constant([1.0, 2.0]).at(THETA), np.tile([1.0, 2.0], (7, 1)))


def test_steps_hold_their_values_between_the_breaks():
    series = StepSeries([[3.0, 1.0, 2.0]], [0.0, 0.25, 0.5])
    turn = np.array([0.0, 0.2, 0.26, 0.5, 0.99, 1.1, -0.1])
    np.testing.assert_array_equal(series.at(2.0 * np.pi * turn[:, None])[:, 0], [3, 3, 1, 2, 2, 3, 2])
    assert series.mean[0] == pytest.approx(0.25 * 3.0 + 0.25 * 1.0 + 0.5 * 2.0)


def test_mean_of_steps_is_that_of_many_values():
    series = StepSeries([[3.0, 1.0]], [0.0, 0.3])
    theta = 2.0 * np.pi * (np.arange(1000)[:, None] + 0.5) / 1000
    assert series.at(theta).mean() == pytest.approx(series.mean[0])


def test_a_base_that_is_not_given_needs_order_zero():
    assert phase_of([1.5], (2, 0)) == 3.0
    with pytest.raises(CaseError) as error:
        phase_of([1.5], (0, 1))
    assert error.value.code == "E-HARMONICS"


@pytest.mark.parametrize(
    ("values", "breaks"),
    [
        ([[1.0, 2.0]], [0.0]),
        ([[1.0, 2.0]], [0.1, 0.5]),
        ([[1.0, 2.0]], [0.0, 1.0]),
        ([[1.0, 2.0]], [0.0, 0.0]),
    ],
)
def test_breaks_that_do_not_divide_a_period_are_refused(values, breaks):
    with pytest.raises(CaseError) as error:
        StepSeries(values, breaks)
    assert error.value.code == "E-SHAPE"


def test_numbers_that_are_not_finite_are_refused():
    with pytest.raises(CaseError) as error:
        FourierSeries([[1.0, np.nan]])
    assert error.value.code == "E-FINITE"


# Sums of series with orders of their own: values, orders, lines at given frequencies.


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


# Harmonics and instants at the fewest samples that tell them apart, and lines of two base frequencies.


@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_fewest_samples_hold_their_harmonics(count):
    rng = np.random.default_rng(count)
    amplitudes = rng.normal(size=(2, count + 1)) + 1j * rng.normal(size=(2, count + 1))
    amplitudes[:, 0] = amplitudes[:, 0].real
    positions = 2 * count + 1
    turn = 2j * np.pi * np.arange(positions)[:, None] * np.arange(count + 1) / positions
    values = sample(amplitudes, positions)
    assert np.allclose(values, (amplitudes[:, None] * np.exp(turn)).sum(axis=-1).real, rtol=0, atol=1e-13)
    assert np.allclose(harmonics_of(values, count), amplitudes, rtol=0, atol=1e-13)
    with pytest.raises(CaseError, match=f"{positions - 1} positions in a period cannot hold {count}"):
        harmonics_of(values[:, :-1], count)
    with pytest.raises(CaseError, match=f"{positions - 1} instants cannot show {count} harmonics"):
        sample(amplitudes, positions - 1)


def test_side_bands_of_one_carrier_and_two_mesh_harmonics():
    """m w1 (m <= 2), n w2 +- q w1 (n <= 2, q <= 1), each once, the mean first."""
    wanted = {(0, 0), (1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (-1, 2), (0, 2), (1, 2)}
    orders = side_bands(2, 2, 1)
    assert {tuple(one) for one in orders.tolist()} == wanted and len(orders) == len(wanted)
    assert orders[0].tolist() == [0, 0]


def test_coinciding_lines_are_named():
    """At a mesh frequency of three times that of the carrier its side band is the carrier's second line."""
    orders = np.array([[0, 0], [1, 0], [2, 0], [-1, 1], [0, 1]])
    assert "Lines [2, 0] and [-1, 1] have one frequency" in coincidence_note(orders, [1.0, 3.0])
    assert coincidence_note(orders, [1.0, 3.1]) == ""


# Lines


def test_lines_of_one_base_are_its_harmonics():
    np.testing.assert_array_equal(harmonic_lines(4)[:, 0], range(5))


@pytest.mark.parametrize("top", [1, 3, 6])
def test_combinations_of_two_bases_fill_half_a_diamond(top):
    orders = harmonic_lines(top, 2)
    # a diamond of radius h holds 2 h (h + 1) + 1 points
    assert len(orders) == top * (top + 1) + 1
    both = np.vstack([orders, -orders[1:]])
    assert len(np.unique(both, axis=0)) == 2 * top * (top + 1) + 1
    assert np.abs(both).sum(axis=1).max() == top


def test_side_bands_are_those_of_the_extended_harmonic_balance():
    orders = side_bands(100, 3, 8)
    # mean, 100 carrier harmonics, 3 mesh harmonics with 16 side bands each
    assert len(orders) == 1 + 100 + 3 * 17
    lines = set(map(tuple, orders.tolist()))
    assert {(0, 0), (100, 0), (0, 3), (8, 3), (-8, 1)} <= lines
    assert not {(9, 1), (-1, 0), (8, -3), (1, 4)} & lines
    assert len(lines | {(-a, -b) for a, b in lines}) == 2 * len(orders) - 1
    checked_lines(orders)


def test_distinct_lines_drop_mirror_images_and_repetitions():
    found = distinct_lines([[1, 0], [-1, 0], [2, -1], [-2, 1], [2, -1], [0, 0]])
    assert set(map(tuple, found.tolist())) == {(0, 0), (1, 0), (-2, 1)}
    assert not found[0].any()


@pytest.mark.parametrize(
    ("orders", "word"),
    [
        ([[1], [0]], "first line"),
        ([[0, 0], [1, 0], [-1, 0]], "twice"),
        ([[0, 0], [0.5, 1]], "whole"),
        (np.zeros((0, 2)), "whole"),
    ],
)
def test_lines_that_cannot_be_used_are_refused(orders, word):
    with pytest.raises(CaseError, match=word) as error:
        checked_lines(orders)
    assert error.value.code == "E-HARMONICS"


@pytest.mark.parametrize("call", [lambda: harmonic_lines(-1), lambda: side_bands(3, 2.5, 1)])
def test_numbers_of_harmonics_are_whole(call):
    with pytest.raises(CaseError) as error:
        call()
    assert error.value.code == "E-HARMONICS"


def test_tail_is_the_share_of_the_upper_half():
    lines = np.array([[7.0, 3.0, 0.0, 0.0, 4.0j]])
    assert line_tail(lines, harmonic_lines(4)) == pytest.approx(0.8)
    # three quarters of the largest size count as the upper half, one half as the lower
    orders = np.array([[0, 0], [1, 1], [-1, 2], [0, 4], [4, 0]])
    assert line_tail(np.array([[1.0, 3.0, 4.0, 0, 0]]), orders) == pytest.approx(0.8)
    assert line_tail(np.zeros((2, 5)), harmonic_lines(4)) == 0.0
