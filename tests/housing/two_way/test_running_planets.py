"""Planets that run around in a structure, against all harmonics of all coordinates in one linear system.

The reference knows neither side bands nor modes: structure and planets in axes at rest, whose meshes and pins turn,
every coordinate at every order of the carrier as unknowns, products in time as convolutions.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from femgear.errors import CaseError, ConvergenceError
from femgear.housing.two_way.carrier_orders import MeshPaths
from femgear.housing.two_way.running_planets import RunningStage, solve_running
from femgear.system.system import MeshExcitation

TURN = 20.0 * 2.0 * np.pi
"""Speed of the carrier [rad/s]."""
POSITIONS = 64


@dataclass(frozen=True)
class Twin:
    """Sun, carrier, ring and casing on uneven springs, and equal planets between them.

    Coordinates are x, y and rotation of sun, carrier and ring, x and y of the casing.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    planet: np.ndarray
    points: np.ndarray
    springs: np.ndarray
    viscous: np.ndarray
    angles: np.ndarray
    teeth: int
    sense: int
    excitation: MeshExcitation

    def rows(self, phi: float) -> np.ndarray:
        """Approach (4, 11) of both meshes and the pin of a planet at an angle by the structure."""
        radial, around = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        found = np.zeros((4, len(self.mass)))
        found[0, :2], found[0, 2] = np.sin(0.4) * radial + np.cos(0.4) * around, 1.0
        found[1, 6:8], found[1, 8] = np.sin(0.4) * radial - np.cos(0.4) * around, -1.0
        found[2, 3:5], found[3, 3:5], found[3, 5] = -radial, -around, -1.0
        return found

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural frequencies [rad/s], zero of free motions, and mass-normalised shapes."""
        root = np.sqrt(np.diag(self.mass))
        values, vectors = np.linalg.eigh(self.stiffness / np.outer(root, root))
        values = np.where(values < 1e-9 * values[-1], 0.0, values)
        return np.sqrt(values), vectors / root[:, None]


def twin(count: int, teeth: int, sense: int = 1, *, free: bool = False, uneven=None, angles=None) -> Twin:
    """Make a twin; ``free``: sun and carrier turn freely; ``uneven``: torques of the planets, relative."""
    mass = np.diag([1.0, 1.0, 0.6, 2.0, 2.0, 1.5, 3.0, 3.0, 2.0, 5.0, 5.0])
    stiffness = np.zeros((11, 11))

    def spring(value: float, **parts: float) -> None:
        row = np.zeros(11)
        for name, part in parts.items():
            row[int(name[1:])] = part
        stiffness[:] += value * np.outer(row, row)

    for first, value in ((0, 2e6), (3, 5e6), (6, 3e7)):
        spring(value, **{f"q{first}": 1.0, "q9": -1.0})
        spring(1.7 * value, **{f"q{first + 1}": 1.0, "q10": -1.0})
    spring(3e5, q0=1.0, q1=0.5, q9=-0.3)
    for rotation, value in ((2, 4e6), (5, 3e6), (8, 5e7)):
        spring(0.0 if free and rotation < 8 else value, **{f"q{rotation}": 1.0})
    spring(2e7, q9=1.0)
    spring(4e7, q10=1.0)
    angles = 2.0 * np.pi * np.arange(count) / count if angles is None else np.asarray(angles)
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    share = np.ones(count) if uneven is None else np.asarray(uneven)
    signals = np.zeros((3, 2 * count, POSITIONS))
    for planet, psi in enumerate(angles):
        at = theta + sense * teeth * psi
        waves = 1.0 + 0.08 * np.cos(at) + 0.03 * np.sin(2.0 * at), 1.0 + 0.06 * np.cos(at + 1.0)
        for mesh, mean, wave in ((planet, 3e7, waves[0]), (count + planet, 4e7, waves[1])):
            force = 1000.0 * share[planet] * (1.0 + 0.05 * np.cos(at + 0.3))
            signals[:, mesh] = mean * wave, force / (mean * wave) + 1e-6 * np.cos(2.0 * at), force
    points = np.zeros((3, 4))
    points[:, 0], points[:, 1] = [-np.sin(0.4), -np.cos(0.4), 0.9], [-np.sin(0.4), np.cos(0.4), 0.9]
    points[0, 2] = points[1, 3] = 1.0
    return Twin(
        mass,
        20.0 * mass + 3e-5 * stiffness,
        stiffness,
        np.diag([0.5, 0.5, 0.2]),
        points,
        np.array([3e7, 4e7, 2e7, 3e7]),
        np.array([0.0, 0.0, 300.0, 200.0]),
        angles,
        teeth,
        sense,
        MeshExcitation(*signals, np.zeros(2 * count)),
    )


def running(system: Twin, *, symmetry: int | None = None) -> RunningStage:
    """Take the twin as `solve_running` does."""
    frequency, shape = system.modes()
    samples = np.array([system.rows(phi) @ shape for phi in 2.0 * np.pi * np.arange(3) / 3])
    waves = np.fft.fft(samples, axis=0) / 3
    still = np.where(frequency > 0.0, frequency, 1.0)
    turning = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    count = len(system.angles) if symmetry is None else symmetry
    return RunningStage(
        frequency,
        np.where(frequency > 0.0, (20.0 + 3e-5 * frequency**2) / (2.0 * still), 0.0),
        np.stack([waves[2], waves[0], waves[1]], axis=1),
        np.zeros((4, 3, 4, 3)),
        system.planet,
        np.zeros((3, 3)),
        turning,
        system.points,
        system.springs,
        np.zeros(4),
        system.excitation,
        MeshPaths(system.teeth, tuple(system.angles), 0.0, count),
        system.sense,
        viscous=system.viscous,
    )


def direct(system: Twin, harmonics: int, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Orders up to a reach, and two-sided motions (orders, 11) of the structure at them, in one linear system."""
    count, size = len(system.angles), len(system.mass)
    total, orders = size + 3 * count, np.arange(-reach, reach + 1)
    samples = 8
    theta = 2.0 * np.pi * np.arange(samples) / samples
    rows = np.zeros((samples, 4 * count, total))
    for number, at in enumerate(theta):
        for planet, psi in enumerate(system.angles):
            phi = psi + system.sense * at
            turned = np.array([[np.cos(phi), -np.sin(phi), 0.0], [np.sin(phi), np.cos(phi), 0.0], [0.0, 0.0, 1.0]])
            meshes = [planet, count + planet, 2 * count + planet, 3 * count + planet]
            rows[number][meshes, :size] = system.rows(phi)
            rows[number][meshes, size + 3 * planet : size + 3 * planet + 3] = (turned @ system.points).T
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
    mass = np.concatenate([np.diag(system.mass), np.tile(np.diag(system.planet), count)])
    for i, order in enumerate(orders):
        own = slice(i * n, i * n + n)
        matrix[own, own] -= np.diag((order * TURN) ** 2 * mass)
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


@pytest.mark.parametrize("name", CASES)
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
