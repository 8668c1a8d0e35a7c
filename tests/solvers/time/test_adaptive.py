"""Parts of the adaptive integrator: samples of its steps, size of a motion, a contact just before the end."""

import numpy as np
import pytest

from femgear.errors import ConvergenceError
from femgear.solvers.time.adaptive import _contacts, flow, motion_scale, sampled, trajectory
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

ONE = np.eye(1)


def one_mass(mass=1.0, load=0.0, force=None, **mesh):
    system = MechanicalSystem(mass * ONE, 0.0 * ONE, 0.0 * ONE, ONE, np.array([load]), ("x",))
    forces = () if force is None else (HarmonicForce([force]),)
    return NonlinearSystem(system, (GearMeshes([0], constant([4.0]), **mesh),), forces)


def test_samples_come_from_the_step_that_holds_them():
    pieces = [(float(k), k + 1.0, lambda t, k=k: np.array([t, 0.0 * t + k])) for k in range(3)]
    times = np.array([-0.5, 0.0, 0.25, 1.0, 1.5, 2.5, 3.0, 3.0 + 1e-13])
    found, steps = sampled(iter(pieces), times, np.array([-1.0, -1.0]))
    assert steps == 3
    assert found[:2].tolist() == [[-1.0, -1.0]] * 2
    assert found[2:, 0] == pytest.approx(times[2:], abs=1e-15)
    # a border belongs to the step that ends there
    assert found[2:, 1].tolist() == [0, 0, 1, 2, 2, 2]


def test_without_a_step_everything_rests_at_the_start():
    found, steps = sampled(iter(()), np.array([0.0, 0.0]), np.array([2.0]))
    assert (found.tolist(), steps) == ([[2.0], [2.0]], 0)


def test_size_of_a_motion_is_its_start_or_its_answer_to_the_loads():
    """Held by k + rate^2 m with rate^2 = k/m, so by twice k = 4."""
    moving = flow(one_mass(mass=0.25, load=0.8, force=2.4j), np.array([1.0]))
    assert moving.rate == pytest.approx(4.0)
    assert motion_scale(moving, (np.zeros(1), np.zeros(1))) == pytest.approx(0.3)
    assert motion_scale(moving, (np.array([-0.5]), np.zeros(1))) == pytest.approx(0.5)
    assert motion_scale(moving, (np.zeros(1), np.array([-8.0]))) == pytest.approx(2.0)


@pytest.mark.parametrize("beyond", [1e-3, 1e-7])
def test_a_contact_just_before_the_end_is_taken(beyond):
    """A mass flies freely into a spring, x = t - 1; after that x = sin(2 (t - 1)) / 2."""
    found = solve_transient(
        one_mass(), 1.0, [0.0, 0.5, 1.0 + beyond], start=([-1.0], [1.0]), method="DOP853", events=True
    )
    assert found.displacement[:, 0] == pytest.approx([-1.0, -0.5, 0.5 * np.sin(2.0 * beyond)], abs=1e-12)
    assert found.velocity[:, 0] == pytest.approx([1.0, 1.0, np.cos(2.0 * beyond)], abs=1e-10)


def test_too_many_steps_are_refused():
    moving = flow(one_mass(force=1.0), np.array([1.0]))
    start = moving.state([0.0], [0.0])
    taken = len(list(trajectory(moving, start, 0.0, 20.0)))
    assert taken > 4
    assert len(list(trajectory(moving, start, 0.0, 20.0, max_steps=taken))) == taken
    with pytest.raises(ConvergenceError, match=f"more than {taken - 1} steps"):
        list(trajectory(moving, start, 0.0, 20.0, max_steps=taken - 1))


@pytest.mark.parametrize("pace", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("size", [0.0, 1e-6, 5.0])
def test_a_switch_at_zero_is_where_its_rate_takes_it(size, pace):
    """Two meshes with backlash touch a flank each, of a motion of any size and pace: they close, or part."""
    system = MechanicalSystem(np.eye(3), np.eye(3), np.eye(3), np.eye(3), np.zeros(3), tuple("abc"))
    mesh = GearMeshes([0, 1], constant([4.0, 4.0]), backlash=[size + 1.0, 0.3 * size])
    problem = NonlinearSystem(system, (mesh,))
    x = np.array([0.0, -0.3 * size, size])
    for rate in np.array([[2.0, -3.0, 0.0], [-2.0, 3.0, 0.0], [-2.0, -3.0, 0.0]]):
        (closed,) = _contacts(problem, x, np.zeros(1), pace * rate, events=True).closed
        now, later = (mesh.switches((x + t * (size or 1.0) * rate)[mesh.columns], np.zeros(1)) for t in (0.0, 0.01))
        touching = np.abs(now) < 1e-15
        assert touching.sum() >= 2
        assert closed.tolist() == np.where(touching, later > 0.0, now > 0.0).tolist()


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_force_is_that_of_the_phases_at_the_instants(method):
    system = MechanicalSystem(ONE, 0.2 * ONE, ONE, ONE, np.ones(1), ("x",))
    mesh = GearMeshes([0], FourierSeries([[3.0, 1.0 - 0.5j]]), separates=False)
    times = np.array([0.0, 0.3, 1.1, 1.6])
    found = solve_transient(NonlinearSystem(system, (mesh,)), 2.5, times, start=([0.4], [0.0]), method=method)
    stiffness = 3.0 + np.cos(2.5 * times) + 0.5 * np.sin(2.5 * times)
    assert found.deflection[:, 0] == pytest.approx(found.displacement[:, 0], abs=1e-15)
    assert found.force[:, 0] == pytest.approx(stiffness * found.displacement[:, 0], abs=1e-12)


def flights():
    """Two masses that fly with speed one into springs of stiffness 4, one element each; and their start."""
    two, none = np.eye(2), np.zeros((2, 2))
    system = MechanicalSystem(two, none, none, two, np.zeros(2), ("x", "y"))
    meshes = tuple(GearMeshes([i], constant([4.0])) for i in range(2))
    return flow(NonlinearSystem(system, meshes), np.array([1.0])), np.array([-1.0, -1.5, 1.0, 1.0])


def flown(times, at):
    """Free up to x = 0, half a period of sin 2 t, and free again."""
    t = times - at
    return np.where(t < 0.0, t, np.where(t < 0.5 * np.pi, 0.5 * np.sin(2.0 * t), 0.5 * np.pi - t))


def test_contacts_of_several_elements_change_one_by_one():
    times = np.linspace(0.0, 4.0, 17)
    moving, start = flights()
    pieces = trajectory(moving, moving.state(start[:2], start[2:]), 0.0, 4.0, events=True)
    found, _ = sampled(pieces, times, start)
    assert found[:, 0] == pytest.approx(flown(times, 1.0), abs=1e-9)
    assert found[:, 1] == pytest.approx(flown(times, 1.5), abs=1e-9)


def test_a_motion_before_time_zero_is_the_same_motion_earlier():
    """Nothing depends on time: begun at -6, the contacts close at -5 and -4.5."""
    times = np.linspace(-6.0, -2.0, 17)
    moving, start = flights()
    pieces = trajectory(moving, moving.state(start[:2], start[2:]), -6.0, -2.0, events=True)
    found, steps = sampled(pieces, times, start)
    assert steps > 4
    assert found[:, 0] == pytest.approx(flown(times, -5.0), abs=1e-9)
    assert found[:, 1] == pytest.approx(flown(times, -4.5), abs=1e-9)


def test_a_motion_without_end_stops_where_it_runs_away():
    """``x'' = x^3`` has ``x = sqrt 2 / (1 - t)``."""
    system = MechanicalSystem(ONE, 0.0 * ONE, 0.0 * ONE, ONE, np.zeros(1), ("x",))
    problem = NonlinearSystem(system, (PolynomialSprings([0], [[0.0, 0.0, -1.0]]),))
    moving = flow(problem, np.array([1.0]))
    start = moving.state([2.0**0.5], [2.0**0.5])
    with pytest.raises(ConvergenceError, match="DOP853 stopped at") as caught:
        list(trajectory(moving, start, 0.0, 2.0, tolerance=1e-7, max_steps=2000))
    assert caught.value.code == "E-INTEGRATION"
    assert float(caught.value.message.split()[3]) == pytest.approx(1.0, abs=1e-5)


def test_steps_of_a_stiffness_are_borders_in_every_period():
    """Stiffness 9 for 0.3 of every second, 1 after that: products of exact motions, begun late or not."""
    system = MechanicalSystem(ONE, 0.0 * ONE, 0.0 * ONE, ONE, np.zeros(1), ("x",))
    mesh = GearMeshes([0], StepSeries([[9.0, 1.0]], [0.0, 0.3]), separates=False)
    moving = flow(NonlinearSystem(system, (mesh,)), np.array([2.0 * np.pi]))

    def free(omega, t):
        turn = omega * t
        return np.array([[np.cos(turn), np.sin(turn) / omega], [-omega * np.sin(turn), np.cos(turn)]])

    for begin, parts in (
        (0.0, [(3, 0.3), (1, 0.7), (3, 0.3), (1, 0.7), (3, 0.25)]),
        (3.1, [(3, 0.2), (1, 0.7), (3, 0.3), (1, 0.45)]),
    ):
        borders = begin + np.cumsum([duration for _, duration in parts])
        pieces = list(trajectory(moving, moving.state([0.4], [0.1]), begin, borders[-1], events=True, max_steps=400))
        ends = np.array([end for _, end, _ in pieces])
        assert np.abs(ends[:, None] - borders).min(axis=0).max() < 1e-12
        exact = np.array([0.4, 0.1])
        for omega, duration in parts:
            exact = free(omega, duration) @ exact
        q, v, _ = moving.split(pieces[-1][2](borders[-1]))
        assert [q[0], v[0]] == pytest.approx(exact, abs=1e-9)
