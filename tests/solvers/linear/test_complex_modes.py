"""Complex modes against closed forms, the equations themselves and real modes."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import complex_modes, undamped_modes, whirl
from femgear.system.mesh_directions import gear_set_system
from femgear.system.system import MechanicalSystem, damping_matrix
from validation.reference.mode_energy import motion_planes

NO_MESH = np.zeros(0)


def plain(M, K, C=None, G=None):
    n = len(M)
    C = np.zeros((n, n)) if C is None else np.asarray(C, float)
    names = tuple(f"q{i}" for i in range(n))
    return MechanicalSystem(np.asarray(M, float), C, np.asarray(K, float), np.zeros((n, 0)), np.zeros(n), names, G)


def rotating_mass(speed, *, m=2.0, k=800.0, damping=0.0):
    """Mass on isotropic springs in a frame that turns: m (x'' - 2 W y' - W^2 x) + k x = 0."""
    G = 2.0 * m * np.array([[0.0, -1.0], [1.0, 0.0]])
    return plain(m * np.eye(2), (k - m * speed**2) * np.eye(2), damping * np.eye(2), G)


def random_system(n=7, seed=4):
    """Damping that no real modes make diagonal, and gyroscopic terms."""
    draw = np.random.default_rng(seed)
    A, B, R = (draw.normal(size=(n, n)) for _ in range(3))
    M, K = A @ A.T + n * np.eye(n), 900.0 * (B @ B.T + 0.5 * np.eye(n))
    C = 0.3 * (R @ R.T)
    W, k = draw.normal(size=(n, 2)), np.array([4e3, 9e3])
    names = tuple(f"q{i}" for i in range(n))
    return MechanicalSystem(M, C, K, W, np.zeros(n), names, R - R.T), k


@pytest.mark.parametrize("speed", [0.0, 3.0, 19.0, 30.0])
def test_rotating_mass_is_shifted_by_the_speed(speed):
    """sqrt(k/m) -+ speed, also above the critical speed 20, where K is negative."""
    modes = complex_modes(rotating_mass(speed), NO_MESH, speed=speed)
    expected = np.sort([abs(20.0 - speed), 20.0 + speed])
    assert np.abs(modes.eigenvalue.imag) == pytest.approx(expected, rel=1e-12)
    assert np.abs(modes.eigenvalue.real).max() < 1e-10
    if speed:
        sense = whirl(modes.right, np.full(2, 2.0), [(0, 1)])
        # forward whirl at 20 rad/s is overtaken by a frame that turns faster
        assert sense == pytest.approx([1.0 if speed < 20.0 else -1.0, -1.0], abs=1e-9)


def test_whirl_of_known_orbits():
    shape = np.array([[1.0, 1.0, 1.0, 2.0], [-1j, 1j, 0.5, -1j]])
    assert whirl(shape, np.ones(2), [(0, 1)]) == pytest.approx([1.0, -1.0, 0.0, 0.8])
    assert whirl(np.array([[0.0], [0.0], [1.0]]), np.ones(3), [(0, 1)]) == pytest.approx([0.0])


def test_single_mass_with_damping_of_every_size():
    """m = 1, k = 100: lambda = 10 (-zeta +- sqrt(zeta^2 - 1))."""
    for zeta in (0.0, 0.3, 2.0):
        modes = complex_modes(plain([[1.0]], [[100.0]], [[20.0 * zeta]]), NO_MESH)
        root = np.sqrt(complex(zeta**2 - 1.0))
        expected = 10.0 * (-zeta + np.array([root, -root]))
        expected = expected[expected.imag >= 0.0]
        assert np.sort_complex(modes.eigenvalue) == pytest.approx(np.sort_complex(expected), rel=1e-12)
        if zeta < 1.0:
            assert modes.frequency == pytest.approx([10.0 / (2 * np.pi)])
            assert modes.damping_ratio == pytest.approx([zeta], abs=1e-13)
            assert modes.eigenvalue.imag / (2 * np.pi) == pytest.approx(modes.frequency * np.sqrt(1 - zeta**2))
    with pytest.raises(ConvergenceError, match="E-SOLVE"):
        complex_modes(plain([[1.0]], [[100.0]], [[20.0]]), NO_MESH)


def test_proportional_damping_gives_the_real_modes(geared_chain):
    k = np.array([1.0, 1.4])
    total = geared_chain.K + (geared_chain.W * k) @ geared_chain.W.T
    system = replace(geared_chain, C=0.02 * geared_chain.M + 0.05 * total)
    real, modes = undamped_modes(system, k), complex_modes(system, k)
    assert modes.frequency == pytest.approx(real.frequency, rel=1e-12)
    assert modes.damping_ratio == pytest.approx(real.damping_ratio, rel=1e-10)
    same = np.abs(np.einsum("ip,ij,jp->p", modes.right.conj(), system.M, real.shape))
    assert same == pytest.approx(np.ones(4), rel=1e-10)
    assert np.abs(modes.right.imag).max() < 1e-9


def test_vectors_solve_their_equations_and_are_biorthonormal():
    system, k = random_system()
    modes = complex_modes(system, k, speed=1.7)
    assert np.all(modes.paired) and len(modes.eigenvalue) == 7
    D, stiffness = damping_matrix(system, 1.7), system.K + (system.W * k) @ system.W.T
    poles = np.concatenate([modes.eigenvalue, modes.eigenvalue.conj()])
    x, y = np.hstack([modes.right, modes.right.conj()]), np.hstack([modes.left, modes.left.conj()])
    pencil = poles[:, None, None] ** 2 * system.M + poles[:, None, None] * D + stiffness
    size = np.linalg.norm(pencil, axis=(1, 2))
    assert np.abs(np.einsum("pij,jp->pi", pencil, x)).max(axis=1) == pytest.approx(0.0 * size, abs=1e-10 * size.max())
    left = np.abs(np.einsum("ip,pij->pj", y.conj(), pencil)).max(axis=1) / np.linalg.norm(y, axis=0)
    assert left.max() < 1e-10 * size.max()
    gram = (poles[:, None] + poles[None, :]) * (y.conj().T @ system.M @ x) + y.conj().T @ D @ x
    assert np.abs(gram - np.eye(14)).max() < 1e-10
    assert np.einsum("ip,ij,jp->p", modes.right.conj(), system.M, modes.right) == pytest.approx(np.ones(7))


def test_left_vectors_are_the_right_ones_of_the_reversed_rotation():
    """Transposing turns G into -G and leaves M, C and K as they are."""
    system, k = random_system(seed=8)
    modes, back = complex_modes(system, k, speed=2.0), complex_modes(system, k, speed=-2.0)
    assert modes.eigenvalue == pytest.approx(back.eigenvalue, rel=1e-11)
    left, right = modes.left.conj(), back.right
    cosine = np.abs((left.conj() * right).sum(axis=0)) / np.linalg.norm(left, axis=0) / np.linalg.norm(right, axis=0)
    assert cosine == pytest.approx(np.ones(7), rel=1e-10)


def test_eigenvalues_of_the_companion_form():
    system, k = random_system(seed=2)
    n, D = 7, damping_matrix(system, 3.0)
    stiffness = system.K + (system.W * k) @ system.W.T
    A = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(system.M, stiffness), -np.linalg.solve(system.M, D)],
        ]
    )
    expected = np.linalg.eigvals(A)
    expected = expected[expected.imag > 0]
    found = complex_modes(system, k, speed=3.0).eigenvalue
    assert found == pytest.approx(expected[np.argsort(np.abs(expected))], rel=1e-10)


def test_free_rotation_is_one_rigid_mode_and_a_damped_one_is_not():
    """Two inertias J on a shaft: free, then with a damper c on the first."""
    J, k, c = 2.0, 50.0, 0.4
    K = k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    free = complex_modes(plain(J * np.eye(2), K), NO_MESH)
    assert free.eigenvalue == pytest.approx([0.0, 1j * np.sqrt(2 * k / J)], rel=1e-12)
    assert free.rigid.tolist() == [True, False] and free.damping_ratio[0] == 0.0
    assert np.abs(free.right[:, 0]) == pytest.approx([0.5, 0.5])
    held = complex_modes(plain(J * np.eye(2), K, [[c, 0.0], [0.0, 0.0]]), NO_MESH)
    # the third root of J^2 s^3 + c J s^2 + 2 k J s + c k = 0 besides the position, which stays free
    roots = np.roots([J**2, c * J, 2 * k * J, c * k])
    assert held.eigenvalue[0].real == pytest.approx(roots[np.abs(roots.imag) < 1e-9].real[0], rel=1e-10)
    assert not np.any(held.rigid) and held.paired.tolist() == [False, True]


def test_planar_set_at_rest_and_with_small_speed():
    """Standstill gives the real modes; a speed shifts frequencies by no more than itself."""
    data = lin_parker_set(4)
    k, speed = data.mesh_stiffness, 20.0
    rest = complex_modes(gear_set_system(data), k)
    real = undamped_modes(gear_set_system(data), k, damping_ratio=0.0)
    assert rest.frequency == pytest.approx(real.frequency, rel=1e-9, abs=1e-6)
    system = gear_set_system(data, carrier_speed=speed)
    turning = complex_modes(system, k, speed=speed)
    assert np.abs(turning.eigenvalue[turning.paired].imag - 2 * np.pi * real.frequency[1:]).max() <= 1.01 * speed
    sense = whirl(turning.right[:, turning.paired], np.diag(system.M), motion_planes(system.dofs))
    # central members on round supports: each pair has a forward and a backward mode
    pair = np.flatnonzero(np.abs(real.frequency[1:] - 727.2673) < 0.01)
    assert sense[pair].prod() < 0.0


def test_wrong_matrices_are_refused():
    system = plain(np.eye(2), np.eye(2), G=np.eye(2))
    with pytest.raises(CaseError, match="E-SYMMETRY"):
        complex_modes(system, NO_MESH, speed=1.0)
    with pytest.raises(CaseError, match="E-SPEED"):
        complex_modes(system, NO_MESH, speed=np.inf)
    with pytest.raises(ConvergenceError, match="E-MASS"):
        complex_modes(plain(np.diag([1.0, 0.0]), np.eye(2)), NO_MESH)
