"""Planets that run around in a structure, against all harmonics of all coordinates in one linear system.

The reference knows neither side bands nor modes: structure and planets in axes at rest, whose meshes and pins turn,
every coordinate at every order of the carrier as unknowns, products in time as convolutions.
"""

from dataclasses import replace

import numpy as np
import pytest
from running_twin import TURN, Twin, running, twin

from femgear.errors import CaseError, ConvergenceError
from femgear.housing.two_way.running_planets import RunningStage, solve_running


def direct(system: Twin, harmonics: int, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Orders up to a reach, and two-sided motions (orders, 11) of the structure at them, in one linear system."""
    count, size = len(system.angles), len(system.mass)
    total, orders = size + 3 * count, np.arange(-reach, reach + 1)
    samples = 8
    theta = 2.0 * np.pi * np.arange(samples) / samples
    rows = np.array([system.whole_rows(turn) for turn in theta])
    turning = np.fft.fft(rows, axis=0) / samples
    n, width = total, len(orders)

    def spectra(values: np.ndarray) -> np.ndarray:
        """Two-sided harmonics (.., -h .. h) of mesh signals, cut at ``harmonics``."""
        lines = np.fft.fft(values, axis=1) / values.shape[1]
        return np.stack([lines[:, h] for h in range(-harmonics, harmonics + 1)], axis=1)

    stiffness, deflection, force = (
        spectra(getattr(system.excitation, name)) for name in ("stiffness", "deflection", "force")
    )
    deflection[:, harmonics] = force[:, harmonics] = 0.0
    # approaches of all orders by motions of all orders: rows of one turn have orders -1, 0, 1
    approach = np.zeros((width, 4 * count, width, n), complex)
    for wave in (-1, 0, 1):
        for i in range(width):
            if 0 <= i - wave < width:
                approach[i, :, i - wave] = turning[wave]
    springs = np.zeros((width, width, 4 * count), complex)
    for i in range(width):
        springs[i, i, 2 * count :] = np.repeat(system.springs[2:], count) + 1j * orders[i] * TURN * np.repeat(
            system.viscous[2:], count
        )
        for h in range(-harmonics, harmonics + 1):
            if 0 <= i - h * system.teeth < width:
                springs[i, i - h * system.teeth, : 2 * count] += stiffness[:, h + harmonics]
    given = np.zeros((width, 4 * count), complex)
    for h in range(-harmonics, harmonics + 1):
        if abs(h * system.teeth) <= reach:
            given[reach + h * system.teeth, : 2 * count] = force[:, h + harmonics]
    still = np.zeros((width, 2 * count), complex)
    for h in range(-harmonics, harmonics + 1):
        if abs(h * system.teeth) <= reach:
            still[reach + h * system.teeth] = deflection[:, h + harmonics]
    given[:, : 2 * count] -= np.einsum("ijm,jm->im", springs[:, :, : 2 * count], still)
    flat = approach.reshape(width * 4 * count, width * n)
    pressed = np.einsum("ijm,jmkq->imkq", springs, approach).reshape(flat.shape)
    matrix = flat.conj().T @ pressed
    load = -flat.conj().T @ given.ravel()
    for i, order in enumerate(orders):
        own = slice(i * n, i * n + n)
        matrix[own, own] -= np.diag((order * TURN) ** 2 * system.whole_mass)
        matrix[i * n : i * n + size, i * n : i * n + size] += system.stiffness + 1j * order * TURN * system.damping
    # free motions at rest may be any; loads in balance leave them where springs of any stiffness hold them
    rest = reach * n + np.array([2, 5])
    matrix[rest, rest] += 1e5
    return orders, np.linalg.solve(matrix, load).reshape(width, n)[:, :size]


def of_orders(system: Twin, stage: RunningStage, orders: np.ndarray, harmonics: int, bands: int) -> np.ndarray:
    """Two-sided motions (orders, 11) of the structure by `solve_running`."""
    most = int(orders[-1]) // system.teeth
    response = solve_running(
        stage, system.teeth * TURN, TURN, harmonics=(harmonics, most), side_bands=bands, tolerance=1e-13
    )
    assert response.residual < 1e-12
    found = np.zeros((len(orders), len(system.mass)), complex)
    shape = system.modes()[1]
    for order, modal in zip(np.rint(response.frequency / TURN).astype(int).ravel(), response.modal.reshape(-1, 11)):
        for sign, value in ((1, modal), (-1, modal.conj())):
            at = int(sign * order + orders[-1])
            if 0 <= at < len(orders) and (order or sign > 0):
                found[at] = value @ shape.T if not found[at].any() else found[at]
    return found


CASES = {
    "three planets in sequence": (3, 10, 1, {}),
    "three planets the other way round": (3, 10, -1, {}),
    "three planets in phase": (3, 9, 1, {}),
    "five planets": (5, 9, 1, {}),
    "free sun and carrier": (3, 10, 1, {"free": True}),
    "opposed pairs of planets": (4, 10, 1, {"angles": np.array([0.0, 1.4, np.pi, np.pi + 1.4])}),
}


LONG = ("five planets", "opposed pairs of planets")


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in CASES])
def test_lines_are_those_of_one_linear_system(name):
    count, teeth, sense, options = CASES[name]
    system = twin(count, teeth, sense, **options)
    symmetry = 2 if "angles" in options else count
    orders, wanted = direct(system, 1, 3 * teeth + 4)
    stage = running(system, symmetry=symmetry)
    met = of_orders(system, stage, orders, 1, 4)
    moving = (np.abs(orders) <= teeth + 4) & (orders != 0)
    size = np.abs(wanted[moving]).max()
    print(name, np.abs(met - wanted)[moving].max() / size)
    # the reference is cut at an order, the solution at a harmonic with its side bands
    assert np.abs(met - wanted)[moving].max() < 1e-5 * size
    laterals = [0, 1, 3, 4, 6, 7, 9, 10]
    assert np.abs(met - wanted)[np.abs(orders) < teeth // 2][:, laterals].max() < 1e-5 * size


def test_equal_planets_move_nothing_at_orders_that_are_no_multiples():
    system = twin(3, 13)
    response = solve_running(running(system, symmetry=1), 13 * TURN, TURN, harmonics=(2, 4), side_bands=5)
    order = np.rint(response.frequency / TURN).astype(int)
    size = np.abs(response.modal).max()
    assert np.abs(response.modal[order % 3 != 0]).max() < 1e-10 * size
    assert np.abs(response.modal[order % 3 == 0]).max() > 0.1 * size


def test_one_planet_of_n_is_solved_as_all_of_them():
    system = twin(3, 13)
    known = {"harmonics": (2, 4), "side_bands": 5, "tolerance": 1e-13}
    few = solve_running(running(system), 13 * TURN, TURN, **known)
    all_of_them = solve_running(running(system, symmetry=1), 13 * TURN, TURN, **known)
    size = np.abs(few.modal).max()
    assert np.abs(few.modal - all_of_them.modal).max() < 1e-10 * size


def test_unequal_planets_are_refused_as_equal_ones():
    system = twin(3, 13, uneven=[1.0, 1.1, 0.9])
    with pytest.raises(CaseError) as caught:
        solve_running(running(system), 13 * TURN, TURN, harmonics=(2, 2))
    assert caught.value.code == "E-SYMMETRY"


def test_unequal_planets_make_lines_beside_multiples():
    system = twin(3, 10, uneven=[1.0, 1.1, 0.9])
    orders, wanted = direct(system, 1, 3 * 10 + 4)
    met = of_orders(system, running(system, symmetry=1), orders, 1, 4)
    heard = (np.abs(orders) <= 14) & (orders != 0)
    assert np.abs(met - wanted)[heard].max() < 1e-5 * np.abs(wanted[heard]).max()
    beside = heard & (orders % 3 != 0)
    assert np.abs(wanted[beside]).max() > 1e-2 * np.abs(wanted[heard]).max()


def test_bodies_in_common_are_springs_in_series():
    system = twin(3, 13)
    stage = running(system)
    soft = np.zeros((3, 4, 3, 4))
    for planet in range(3):
        soft[planet, 3, planet, 3] = 1.0 / 3e7
    halved = replace(stage, viscous=np.zeros(4), stiffness=np.array([3e7, 4e7, 2e7, 1.5e7]))
    both = [
        solve_running(one, 13 * TURN, TURN, harmonics=(2, 4), tolerance=1e-13)
        for one in (halved, replace(stage, viscous=np.zeros(4), flexibility=soft))
    ]
    assert np.abs(both[0].modal - both[1].modal).max() < 1e-9 * np.abs(both[0].modal).max()


def test_an_undamped_resonance_is_refused():
    system = twin(3, 13)
    stage = replace(running(system), damping_ratio=np.zeros(11), viscous=np.zeros(4))
    speeds = TURN * np.linspace(0.5, 3.0, 400)
    radius = [solve_running(stage, 13 * s, s, harmonics=(1, 2), cycles=6).radius for s in speeds[::80]]
    assert np.isfinite(radius).all()
    with pytest.raises(ConvergenceError) as caught:
        solve_running(stage, 13 * TURN, TURN, harmonics=(1, 2), cycles=0)
    assert caught.value.code == "E-RESONANCE"
