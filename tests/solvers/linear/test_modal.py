from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import output_load, output_response, residual_output, undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.mesh_directions import gear_set_system
from femgear.system.system import MechanicalSystem


def pair(m1=2.0, m2=3.0, load=(5.0, 5.0)):
    """Two free masses pressed together through one mesh."""
    return MechanicalSystem(
        np.diag([m1, m2]), np.zeros((2, 2)), np.zeros((2, 2)), np.ones((2, 1)), np.array(load), ("a", "b")
    )


def test_free_pair_closed_form():
    modes = undamped_modes(pair(), [30.0], damping_ratio=0.05)
    assert modes.kind == ("rigid", "elastic")
    assert modes.frequency[0] == 0.0 and modes.damping_ratio[0] == 0.0
    assert modes.frequency[1] == pytest.approx(np.sqrt(30.0 * (1 / 2 + 1 / 3)) / (2 * np.pi), rel=1e-12)
    assert modes.mesh_deflection[0, 0] == 0.0
    assert modes.load_deflection[0] == pytest.approx(5.0 / 30.0, rel=1e-12)
    assert abs(modes.residual[0, 0]) < 1e-15


def test_modes_left_out_leave_their_flexibility():
    only_rigid = undamped_modes(pair(), [30.0], damping_ratio=0.05, count=1)
    assert only_rigid.residual[0, 0] == pytest.approx(1 / 30.0, rel=1e-12)
    assert only_rigid.load_deflection[0] == pytest.approx(5.0 / 30.0, rel=1e-12)


def test_shapes_are_mass_normalised(geared_chain):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.0)
    stiffness = geared_chain.K + (geared_chain.W * [1.0, 1.4]) @ geared_chain.W.T
    omega = 2 * np.pi * modes.frequency
    np.testing.assert_allclose(modes.shape.T @ geared_chain.M @ modes.shape, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(modes.shape.T @ stiffness @ modes.shape, np.diag(omega**2), atol=1e-12)
    np.testing.assert_allclose(modes.modal_load, modes.shape.T @ geared_chain.load)
    expected = geared_chain.W.T @ np.linalg.solve(stiffness, geared_chain.load)
    np.testing.assert_allclose(modes.load_deflection, expected, rtol=1e-12)


@pytest.mark.parametrize("kept", [1, 2, 3])
def test_static_flexibility_is_the_same_for_any_number_of_modes(geared_chain, kept):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.0, count=kept)
    omega = 2 * np.pi * modes.frequency
    total = modes.residual + (modes.mesh_deflection / omega**2) @ modes.mesh_deflection.T
    stiffness = geared_chain.K + (geared_chain.W * [1.0, 1.4]) @ geared_chain.W.T
    np.testing.assert_allclose(total, geared_chain.W.T @ np.linalg.solve(stiffness, geared_chain.W))


def test_rigid_mode_is_found_beside_very_stiff_parts():
    """A free chain whose couplings span eight decades still has exactly one clean rigid mode."""
    n, springs = 6, np.array([1e2, 1e10, 1e10, 1e9])
    K, W = np.zeros((n, n)), np.zeros((n, 1))
    for i, k in zip((0, 2, 3, 4), springs):
        K[np.ix_([i, i + 1], [i, i + 1])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    W[1, 0], W[2, 0] = 1.0, 2.0
    load = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    system = MechanicalSystem(np.eye(n), np.zeros((n, n)), K, W, load, tuple("abcdef"))
    modes = undamped_modes(system, [1e6], damping_ratio=0.02)
    assert modes.kind.count("rigid") == 1
    np.testing.assert_allclose(modes.load_deflection, [1e-6], rtol=1e-8)


def test_multiple_eigenvalue_is_not_cut(planet_set):
    system = planet_set()
    everything = undamped_modes(system, np.ones(6), damping_ratio=0.0).frequency
    first = int(np.argmax(np.diff(everything) < 1e-9 * everything[1:]))
    kept = undamped_modes(system, np.ones(6), damping_ratio=0.0, count=first + 1)
    assert len(kept.frequency) == first + 2
    kept = undamped_modes(system, np.ones(6), damping_ratio=0.0, max_frequency=everything[first + 1])
    assert len(kept.frequency) == first + 2


def test_damping_from_a_proportional_matrix(geared_chain):
    stiffness = geared_chain.K + (geared_chain.W * [1.0, 1.4]) @ geared_chain.W.T
    system = MechanicalSystem(
        geared_chain.M,
        0.01 * geared_chain.M + 0.02 * stiffness,
        geared_chain.K,
        geared_chain.W,
        geared_chain.load,
        geared_chain.dofs,
    )
    modes = undamped_modes(system, [1.0, 1.4])
    omega = 2 * np.pi * modes.frequency
    np.testing.assert_allclose(modes.damping_ratio, 0.005 / omega + 0.01 * omega, rtol=1e-10)
    with pytest.raises(CaseError, match="damping matrix"):
        undamped_modes(system, [1.0, 1.4], damping_ratio=0.05)


def test_outputs_of_few_modes_follow_those_of_all(planet_set, planet_excitation):
    """At low speed a displacement of the ring body does not depend on the number of modes kept."""
    system, excitation = planet_set(), planet_excitation(np.zeros(6))
    rows = np.random.default_rng(1).standard_normal((3, len(system.M)))
    outputs = []
    for count in (None, 8):
        modes = undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=0.05, count=count)
        response = solve_spectral(modes, excitation, 1e-4, method="direct")
        residual, load = residual_output(system, modes, rows), output_load(system, modes, rows)
        outputs.append(output_response(modes, response, rows @ modes.shape, residual=residual, load=load))
        if count is None:
            assert np.abs(residual).max() < 1e-10
            np.testing.assert_allclose(np.einsum("om,smh->soh", rows @ modes.shape, response.modal), outputs[0])
    assert np.abs(outputs[0] - outputs[1]).max() < 1e-5 * np.abs(outputs[0]).max()


def test_load_that_nothing_holds_is_refused():
    with pytest.raises(CaseError, match="rigid-body") as caught:
        undamped_modes(pair(load=(5.0, 4.0)), [30.0], damping_ratio=0.05)
    assert caught.value.code == "E-LOAD-BALANCE"


def test_open_mesh_is_refused():
    system = pair()
    with pytest.raises(ConvergenceError, match="strains column 1 of W"):
        undamped_modes(system, [0.0], damping_ratio=0.05)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"K": np.array([[1.0, 0.5], [0.0, 1.0]])}, "not symmetric"),
        ({"K": np.array([[np.nan, 0.0], [0.0, 1.0]])}, "not finite"),
        ({"K": -100.0 * np.eye(2)}, "negative"),
        ({"M": np.diag([1.0, 0.0])}, "positive definite"),
        ({"load": np.zeros(3)}, "shape"),
        ({"gyroscopic": np.array([[0.0, 1.0], [-1.0, 0.0]])}, "gyroscopic"),
    ],
)
def test_bad_systems_are_refused(change, match):
    with pytest.raises((CaseError, ConvergenceError), match=match):
        undamped_modes(replace(pair(), **change), [30.0], damping_ratio=0.05)


@pytest.mark.parametrize("damping", [-0.1, np.nan, [0.1, 0.1, 0.1]])
def test_bad_damping_is_refused(damping):
    with pytest.raises(CaseError, match="damping"):
        undamped_modes(pair(), [30.0], damping_ratio=damping)


@pytest.mark.parametrize(
    ("stiffness", "options"),
    [
        ([-1.0], {}),
        ([np.inf], {}),
        ([30.0], {"count": 0}),
        ([30.0], {"max_frequency": -1.0}),
        ([30.0], {"max_frequency": 1.0, "count": 1}),
    ],
)
def test_bad_requests_are_refused(stiffness, options):
    with pytest.raises(CaseError):
        undamped_modes(pair(), stiffness, damping_ratio=0.05, **options)


def test_load_on_a_part_that_the_rigid_mode_leaves_at_rest():
    """Free rotation moves no centre but by rounding: a weight on the sun is held by its bearing."""
    system = gear_set_system(lin_parker_set(3))
    sun = system.dofs.index("sun: x")
    load = np.zeros(len(system.M))
    load[sun] = 50.0
    stiffness = lin_parker_set(3).mesh_stiffness
    modes = undamped_modes(replace(system, load=load), stiffness, damping_ratio=0.0)
    assert modes.kind.count("rigid") == 1
    # reactions of the supports carry the weight: least squares of the singular equations
    total = system.K + (system.W * stiffness) @ system.W.T
    size = np.sqrt(np.diag(total))
    exact = np.linalg.lstsq(total / np.outer(size, size), load / size, rcond=1e-12)[0] / size
    np.testing.assert_allclose(modes.load_deflection, system.W.T @ exact, rtol=1e-7, atol=1e-16)
    load[system.dofs.index("sun: u")] = 1e-3
    with pytest.raises(CaseError, match="E-LOAD-BALANCE"):
        undamped_modes(replace(system, load=load), stiffness, damping_ratio=0.0)


def test_weak_strain_of_a_rigid_mode_is_still_refused():
    """A column that takes a millionth of the free motion is strained, and without stiffness it is refused."""
    system = replace(pair(), W=np.array([[1.0, 1e-6], [1.0, 0.0]]))
    with pytest.raises(ConvergenceError, match="strains column 2 of W"):
        undamped_modes(system, [30.0, 0.0], damping_ratio=0.05)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("apart, kept", [(0.0, 3), (1e-7, 3), (1e-5, 2)])
def test_no_multiple_frequency_is_cut(size, apart, kept):
    """Squares 1, 2, 2 (1 + apart) and 5 times a size: two modes are asked for."""
    stiffness = size * np.diag([5.0, 2.0, 1.0, 2.0 * (1.0 + apart)])
    system = MechanicalSystem(np.eye(4), np.zeros((4, 4)), stiffness, np.eye(4, 1), np.zeros(4), ("a", "b", "c", "d"))
    modes = undamped_modes(system, [0.0], damping_ratio=0.0, count=2)
    wanted = size * np.array([1.0, 2.0, 2.0])[:kept]
    np.testing.assert_allclose((2.0 * np.pi * modes.frequency) ** 2, wanted, rtol=2e-6)


def test_rounding_chooses_neither_sign_nor_pair():
    """Two equal frequencies: the first mode alone moves the coordinate that moves most, forwards."""
    rng = np.random.default_rng(5)
    n, values = 7, np.array([1.0, 4.0, 4.0, 9.0, 25.0, 25.0, 25.0])
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    K = turn @ np.diag(values) @ turn.T
    for noise in (0.0, 1e-15):
        stiffness = 0.5 * (K + K.T) * (1.0 + noise * rng.normal(size=(n, n)))
        system = MechanicalSystem(
            M=np.eye(n),
            C=np.zeros((n, n)),
            K=0.5 * (stiffness + stiffness.T),
            W=np.zeros((n, 1)),
            load=np.zeros(n),
            dofs=tuple(map(str, range(n))),
        )
        shape = undamped_modes(system, np.ones(1), damping_ratio=0.0).shape
        for pair in ([0], [1, 2], [3], [4, 5, 6]):
            # the projector on the space of the modes knows nothing of their choice
            projector = turn[:, pair] @ turn[:, pair].T
            row = int(np.argmax(np.diag(projector)))
            expected = projector[:, row] / np.sqrt(projector[row, row])
            np.testing.assert_allclose(shape[:, pair[0]], expected, atol=1e-9)
            np.testing.assert_allclose(shape[row, pair[1:]], 0.0, atol=1e-9)
            largest = shape[np.abs(shape[:, pair]).argmax(axis=0), pair]
            assert np.all(largest > 0.0) or len(pair) > 1


def test_soft_modes_are_told_from_rigid_ones_beside_very_light_parts():
    """A free pair on a soft spring, with a part so light that rounding of its frequency hides both lowest modes."""
    light, stiff, soft = 1e-9, 1e9, 1e3
    mass = np.diag([1.0, 1.0, light])
    columns = np.array([[1.0, 0.0], [-1.0, 1.0], [0.0, -1.0]])
    system = MechanicalSystem(mass, np.zeros((3, 3)), np.zeros((3, 3)), columns, np.zeros(3), ("a", "b", "c"))
    modes = undamped_modes(system, [soft, stiff], damping_ratio=0.0)
    assert modes.kind == ("rigid", "elastic", "elastic")
    expected = np.sqrt(2.0 * soft), np.sqrt(stiff / light)
    np.testing.assert_allclose(2.0 * np.pi * modes.frequency[1:], expected, rtol=1e-6)
    # both heavy ones against each other
    np.testing.assert_allclose(np.abs(modes.shape[:2, 1]), np.sqrt(0.5), rtol=1e-6)
    with pytest.raises(ConvergenceError, match="strains column 1 of W"):
        undamped_modes(system, [0.0, stiff], damping_ratio=0.0)
