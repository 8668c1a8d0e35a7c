"""Planets that run around in a structure, against all harmonics of all coordinates in one linear system.

The reference knows neither side bands nor modes: structure and planets in axes at rest, whose meshes and pins turn,
every coordinate at every order of the carrier as unknowns, products in time as convolutions.
"""

from dataclasses import replace

import numpy as np
import pytest
from running_twin import POSITIONS, TURN, Twin, running, twin

from femgear.errors import CaseError, ConvergenceError
from femgear.housing.two_way.running_planets import RubbingPoints, RunningStage, solve_running

SLIDING = np.array([[0.9, -0.4, 0.1, 0.0], [-0.4, -0.9, 0.0, 0.2], [0.05, 0.03, 1.0, -1.0]])
"""Sliding of planets at points of friction: two tangents and two couples."""


def sliding_rows(phi: float) -> np.ndarray:
    """Sliding (4, 11) at the points of friction of a planet at an angle by the structure."""
    radial, around = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    found = np.zeros((4, 11))
    found[0, :2], found[0, 2] = np.cos(0.4) * radial - np.sin(0.4) * around, 0.3
    found[1, 6:8], found[1, 8] = np.cos(0.4) * radial + np.sin(0.4) * around, 0.5
    found[2, 2], found[3, 8] = 1.0, -1.0
    return found


def rubbing(system: Twin) -> tuple[Twin, RubbingPoints]:
    """Give a twin loads along the sliding of all its planets, which turn round within the period."""
    theta, count = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS, len(system.angles)
    source = np.zeros((4, count, POSITIONS))
    for planet, psi in enumerate(system.angles):
        at = theta + system.sense * system.teeth * psi
        source[:, planet] = 40.0 * np.cos(at + np.arange(4)[:, None]) + 15.0 * np.sin(2.0 * at) + 7.0
    samples = np.array([sliding_rows(phi) @ system.modes()[1] for phi in 2.0 * np.pi * np.arange(3) / 3])
    waves = np.fft.fft(samples, axis=0) / 3
    excitation = replace(system.excitation, source=source.reshape(4 * count, -1))
    return replace(system, excitation=excitation), RubbingPoints(
        np.stack([waves[2], waves[0], waves[1]], axis=1), SLIDING
    )


def whole_sliding(system: Twin, turn: float) -> np.ndarray:
    """Sliding (4 N, 11 + 3 N) at all points of friction by structure and planets, as `Twin.whole_rows`."""
    swapped = replace(system, points=SLIDING)
    count = len(system.angles)
    rows = swapped.whole_rows(turn).reshape(4, count, -1)
    for planet, psi in enumerate(system.angles):
        rows[:, planet, :11] = sliding_rows(psi + system.sense * turn)
    return rows.reshape(4 * count, -1)


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
    if system.excitation.source is not None:
        sliding = np.fft.fft([whole_sliding(system, turn) for turn in theta], axis=0) / samples
        lines = spectra(system.excitation.source)
        for h in set(range(-harmonics, harmonics + 1)) - {0}:
            for wave in (-1, 0, 1):
                at = reach + h * system.teeth - wave
                if abs(h * system.teeth) <= reach and 0 <= at < width:
                    load[at * n : at * n + n] += sliding[wave].conj().T @ lines[:, h + harmonics]
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


LONG = ("three planets in phase", "five planets", "opposed pairs of planets")


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


@pytest.mark.parametrize(
    ("count", "teeth", "sense", "symmetry", "angles"),
    [
        (3, 10, 1, 3, None),
        (3, 10, -1, 3, None),
        (3, 9, 1, 1, None),
        pytest.param(4, 10, 1, 2, (0.0, 1.4, np.pi, np.pi + 1.4), marks=pytest.mark.slow),
    ],
)
def test_friction_moves_what_it_moves_in_one_linear_system(count, teeth, sense, symmetry, angles):
    plain = twin(count, teeth, sense, angles=angles)
    system, points = rubbing(plain)
    orders, wanted = direct(system, 1, 3 * teeth + 4)
    stage = replace(running(system, symmetry=symmetry), rubbing=points)
    met = of_orders(system, stage, orders, 1, 4)
    moving = (np.abs(orders) <= teeth + 4) & (orders != 0)
    size = np.abs(wanted[moving]).max()
    assert np.abs(met - wanted)[moving].max() < 1e-5 * size
    without = of_orders(system, replace(stage, rubbing=None), orders, 1, 4)
    assert np.abs(met - without)[moving].max() > 0.01 * size


def test_friction_of_patterns_is_that_of_all_planets():
    """Three periods as one, of which each is another: only errors that turn make such, here all planets are alike."""
    system, points = rubbing(twin(3, 13))
    thrice = {
        name: np.tile(getattr(system.excitation, name), 3) for name in ("stiffness", "deflection", "force", "source")
    }
    # the first planet rubs more in the first period
    thrice["source"][::3, :POSITIONS] *= 1.5
    system = replace(system, excitation=replace(system.excitation, **thrice, periods=3))
    known = {"harmonics": (2, 3), "side_bands": 5, "tolerance": 1e-13}
    few, every = (
        solve_running(replace(running(system, symmetry=symmetry), rubbing=points), 13 * TURN, TURN, **known)
        for symmetry in (3, 1)
    )
    assert np.abs(few.modal - every.modal).max() < 1e-10 * np.abs(every.modal).max()


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


@pytest.mark.parametrize("symmetry", [3, 1])
def test_planets_that_bend_have_springs_between_their_own_motions(symmetry):
    """Springs of a planet against itself, which meet no structure, are contact points too."""
    stage = replace(running(twin(3, 13), symmetry=symmetry), viscous=np.zeros(4), loss=np.full(4, 0.04))
    stage = replace(stage, structure_loss=0.04)
    ways = np.array(
        [[1.0, 0.0, 0.3, 0.0, -0.2, 0.1], [0.0, 1.0, 0.0, 0.4, -1.0, 0.0], [0.2, 0.0, 1.0, -0.5, 0.0, -1.0]]
    )
    nothing = np.zeros((3, 3))
    parts = {
        "mass": np.block([[stage.mass, nothing], [nothing, 0.7 * stage.mass]]),
        "gyroscopic": np.zeros((6, 6)),
        "turning": np.block([[stage.turning, nothing], [nothing, stage.turning]]),
        "approach": np.vstack([stage.approach * [1, 0, 1, 0], stage.approach * [0, 1, 0, 1]]),
    }
    springs = np.array([2e7, 1e7, 3e7])
    bending = replace(stage, **parts, elastic=(ways.T * springs) @ ways)
    beside = parts | {"approach": np.hstack([parts["approach"], ways.T])}
    widened = np.concatenate([stage.shape, np.zeros((3, *stage.shape.shape[1:]))])
    joined = replace(
        stage,
        **beside,
        shape=widened,
        stiffness=np.append(stage.stiffness, springs),
        loss=np.full(7, 0.04),
        viscous=np.zeros(7),
    )
    known = {"harmonics": (2, 4), "side_bands": 5, "tolerance": 1e-13}
    # springs that are no round shaft's tie all motions together
    assert [motions.ways.shape for motions in bending.independent_motions] == [(6, 6)]
    bent, sprung = (solve_running(one, 13 * TURN, TURN, **known) for one in (bending, joined))
    assert np.abs(bent.modal - sprung.modal).max() < 1e-9 * np.abs(sprung.modal).max()
    assert np.abs(bent.force - sprung.force[:, :4]).max() < 1e-9 * np.abs(sprung.force).max()


def test_an_undamped_resonance_is_refused():
    system = twin(3, 13)
    stage = replace(running(system), damping_ratio=np.zeros(11), viscous=np.zeros(4))
    speeds = TURN * np.linspace(0.5, 3.0, 400)
    radius = [solve_running(stage, 13 * s, s, harmonics=(1, 2), cycles=6).radius for s in speeds[::80]]
    assert np.isfinite(radius).all()
    with pytest.raises(ConvergenceError) as caught:
        solve_running(stage, 13 * TURN, TURN, harmonics=(1, 2), cycles=0)
    assert caught.value.code == "E-RESONANCE"
