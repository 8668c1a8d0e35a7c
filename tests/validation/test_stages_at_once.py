"""All meshes at once: one mass in closed form, a fluctuating stiffness in time, lines of a common period."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation.reference.stages_at_once import (
    MeshedStructure,
    MeshSignals,
    approaches_at_once,
    common_lines,
    convolution,
)

MASS, SPRING, MESH = 2.0, 3e6, 5e6


def one_mass(loss: float) -> MeshedStructure:
    return MeshedStructure(np.array([[MASS]]), np.array([[SPRING]]), np.array([[1.0]]), loss)


def signals(stiffness, deflection, force, highest: int = 16) -> MeshSignals:
    records = (np.asarray(record)[None] for record in (stiffness, deflection, force))
    return MeshSignals(*(common_lines(record, highest, 1, highest) for record in records))


def test_one_mass_on_constant_springs_has_a_closed_form():
    theta = 2.0 * np.pi * np.arange(64) / 64
    still = signals(np.full(64, MESH), 1e-6 * np.cos(theta), np.full(64, 100.0))
    omega, loss = 900.0, 0.04
    approach, pressed = approaches_at_once(one_mass(loss), still, omega)
    wanted = MESH * 0.5e-6 / ((SPRING + MESH) * (1.0 + 1j * loss) - MASS * omega**2)
    assert approach[0, 17] == pytest.approx(wanted)
    assert approach[0, 15] == pytest.approx(np.conj(wanted))
    assert pressed[0, 17] == pytest.approx(-MESH * 0.5e-6)
    assert np.abs(approach[0, [16, 18, 19]]).max() < 1e-12 * abs(wanted)


def test_a_fluctuating_stiffness_acts_as_in_time():
    theta = 2.0 * np.pi * np.arange(64) / 64
    stiffness = MESH * (1.0 + 0.2 * np.cos(theta))
    omega = 900.0
    approach, _ = approaches_at_once(one_mass(0.0), signals(stiffness, 1e-6 * np.cos(theta), np.full(64, 100.0)), omega)

    def rate(time, state):
        k = MESH * (1.0 + 0.2 * np.cos(omega * time))
        force = k * (state[0] - 1e-6 * np.cos(omega * time))
        return [state[1], -(SPRING * state[0] + force) / MASS]

    order = np.arange(-16, 17)
    start = [approach[0].sum().real, (1j * omega * order * approach[0]).sum().real]
    times = np.array([0.3, 0.7, 1.0]) * 2.0 * np.pi / omega
    solution = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-18)
    wanted = (approach[0] * np.exp(1j * omega * np.outer(times, order))).sum(axis=1).real
    assert solution.y[0] == pytest.approx(wanted, rel=1e-7, abs=1e-14)


def test_lines_of_a_mesh_are_multiples_in_a_common_period():
    theta = 2.0 * np.pi * np.arange(32) / 32
    lines = common_lines((3.0 + np.cos(theta) + 0.5 * np.sin(2.0 * theta))[None], 2, 3, 7)
    assert lines[0, 7 + np.array([0, 3, 6])] == pytest.approx([3.0, 0.5, -0.25j])
    assert np.count_nonzero(np.abs(lines) > 1e-12) == 5


def test_convolution_is_the_product():
    a, b = np.zeros(9, complex), np.zeros(9, complex)
    a[[3, 4, 5]], b[[2, 4, 6]] = [1.0, 2.0, 1.0], [0.5, 3.0, 0.5]
    # (2 + 2 cos t)(3 + cos 2t)
    assert convolution(a) @ b == pytest.approx([0.0, 0.5, 1.0, 3.5, 6.0, 3.5, 1.0, 0.5, 0.0])


def test_meshes_without_fluctuation_keep_their_mean():
    record = np.stack([MESH * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(16) / 16))] * 2)
    both = MeshSignals(*(common_lines(record, 3, 1, 3) for _ in range(3)))
    first = both.without([1])
    assert first.stiffness[0] == pytest.approx(both.stiffness[0])
    assert np.flatnonzero(first.stiffness[1]).tolist() == [3]
    assert first.stiffness[1, 3] == pytest.approx(MESH)
