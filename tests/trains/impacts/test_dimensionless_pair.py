"""The dimensionless pair: published describing functions, other coordinates, SI units, separation, folds."""

from dataclasses import replace

import numpy as np
import pytest
from published.multistage_example import CASES
from scipy.optimize import fsolve
from small_trains import example_pair, level_crossings

from femgear.solvers.continuation.branches import parameter_curve
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.stroboscopic import sweep_response
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, SummedSeries, constant, harmonic_lines
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from femgear.trains.impacts.case_file import scales_of
from femgear.trains.impacts.model import ImpactPair, PairBearings, range_states, separation_ratios
from femgear.trains.reading import read_case, with_values


def describing_functions(mean, amplitude):
    """Mean and first harmonic of the dead zone force (A. Kahraman and R. Singh 1990, one-term balance)."""

    def g(mu):
        inside = np.clip(mu, -1.0, 1.0)
        return np.where(
            np.abs(mu) < 1.0,
            2.0 / np.pi * (inside * np.arcsin(inside) + np.sqrt(1.0 - inside**2)),
            np.abs(mu),
        )

    def h(mu):
        inside = np.clip(mu, -1.0, 1.0)
        return 2.0 / np.pi * (np.arcsin(inside) + inside * np.sqrt(1.0 - inside**2))

    up, down = (1.0 - mean) / amplitude, (-1.0 - mean) / amplitude
    force = mean + 0.5 * amplitude * (g(up) - g(down))
    return force, amplitude * (1.0 - 0.5 * (h(up) - h(down)))


@pytest.mark.parametrize("mean, amplitude", [(1.5, 0.3), (1.2, 0.9), (0.4, 2.0), (0.1, 4.0)])
def test_describing_functions_are_those_of_the_dead_zone(mean, amplitude):
    phase = 2.0 * np.pi * np.arange(200_000) / 200_000
    x = mean + amplitude * np.cos(phase)
    f = np.where(x > 1.0, x - 1.0, np.where(x < -1.0, x + 1.0, 0.0))
    expected = f.mean(), 2.0 * (f * np.cos(phase)).mean()
    np.testing.assert_allclose(describing_functions(mean, amplitude), expected, atol=1e-8)


@pytest.mark.parametrize("ratio, start", [(1.5, (1.9, 1.2)), (0.8, (1.2, 3.5)), (0.5, (1.9, 0.3))])
def test_one_harmonic_is_the_published_balance(ratio, start):
    zeta, load, error = 0.09, 0.9, 0.72
    pair = ImpactPair(damping_ratio=zeta, load=load, tooth_error=(error,))

    def equations(unknown):
        mean_force, first = describing_functions(*unknown)
        push = (first - ratio**2 * unknown[1]) ** 2 + (2.0 * zeta * ratio * unknown[1]) ** 2
        return mean_force - load, push - (error * ratio**2) ** 2

    mean, amplitude = fsolve(equations, start, xtol=1e-13)
    found = solve_harmonic_balance(
        pair.problem(ratio), 1.0, harmonics=1, samples=32768, start=[[mean, amplitude]], stability=False
    ).deflection[0]
    assert found[0].real == pytest.approx(mean, abs=1e-6)
    assert abs(found[1]) == pytest.approx(amplitude, abs=1e-6)
    assert amplitude > 0.2


def test_relative_coordinates_against_displacements_and_moving_flanks():
    # q = (y_1, y_2, u): flanks touch at 1 + e, the damper acts on x' - e'
    bearings = PairBearings(mass=(2.0, 3.0), stiffness=(0.8, 1.5), damping_ratio=0.04)
    pair = ImpactPair(
        damping_ratio=0.08,
        load=0.3,
        stiffness=(0.15, 0.05j),
        tooth_error=(0.3, 0.05 - 0.02j),
        eccentricity=(2.0 + 1j, 0.0),
        teeth=(3, 4),
        bearings=bearings,
    )
    ratio, orders = 0.7, harmonic_lines(6, 2)
    options = {"orders": orders, "samples": (128, 128)}
    found = solve_harmonic_balance(pair.problem(ratio), pair.frequency, **options)
    c, k = 2.0 * 0.08, np.array([0.8, 1.5, 0.0])
    mass, along = np.array([2.0, 3.0, 1.0]), np.array([1.0, -1.0, 1.0])
    support = np.array([*(2.0 * 0.04 * np.sqrt(k[:2] * mass[:2])), 0.0])
    system = MechanicalSystem(
        ratio**2 * np.diag(mass),
        ratio * (np.diag(support) + c * np.outer(along, along)),
        np.diag(k),
        along[:, None],
        np.array([0.0, 0.0, 0.3]),
        ("y 1", "y 2", "u"),
    )
    error = SummedSeries((FourierSeries([[1.0, 0.3, 0.05 - 0.02j]], (1, 0)), FourierSeries([[0.0, 2.0 + 1j]], (0, 1))))
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.15, 0.05j]], (1, 0)), deflection=error, backlash=2.0)
    pushes = [(0.3j, (1, 0)), (2j * (0.05 - 0.02j), (2, 0)), (1j / 3.0 * (2.0 + 1j), (0, 1))]
    forces = tuple(HarmonicForce(ratio * c * rate * along, orders) for rate, orders in pushes)
    plain = NonlinearSystem(system, (mesh,), forces)
    other = solve_harmonic_balance(plain, pair.frequency, **options)
    expected = other.deflection[0].copy()
    for order, amplitude in (((1, 0), 0.3), ((2, 0), 0.05 - 0.02j), ((0, 1), 2.0 + 1j)):
        expected[np.all(orders == order, axis=1)] -= amplitude
    np.testing.assert_allclose(found.deflection[0], expected, atol=1e-8)
    bodies = displacements(pair.problem(ratio), found)[:2]
    np.testing.assert_allclose(bodies, displacements(plain, other)[:2], atol=1e-8)
    assert found.at(np.linspace(0, 20, 400)).min() < 1.0, "the flanks part"


def test_units_of_a_pair_in_si():
    inertia, radius, k, play, zeta = (2e-3, 5e-3), (0.04, 0.06), 3e8, 80e-6, 0.09
    values = {
        "gears.inertia": [f"{one} kg m^2" for one in inertia],
        "mesh.stiffness": f"{k} N/m",
        "gears.base_radii": [f"{one} m" for one in radius],
        "mesh.backlash": f"{play} m",
    }
    scales = scales_of(with_values(read_case(CASES / "gear_pair.toml"), values))
    mass = 1.0 / (0.04**2 / 2e-3 + 0.06**2 / 5e-3)
    assert scales.frequency == pytest.approx(np.sqrt(k / mass))
    load, error, omega = 0.9 * scales.force, 0.72 * scales.length, 1.2 * scales.frequency
    system = MechanicalSystem(
        np.array([[mass]]),
        np.array([[2.0 * zeta * np.sqrt(k * mass)]]),
        np.zeros((1, 1)),
        np.eye(1),
        np.array([load]),
        ("x",),
    )
    mesh = GearMeshes([0], constant([k]), deflection=constant([play / 2]), backlash=play)
    problem = NonlinearSystem(system, (mesh,), (HarmonicForce([mass * omega**2 * error]),))
    found = solve_harmonic_balance(problem, omega, harmonics=8)
    pair = replace(example_pair(zeta), stiffness=())
    scaled = solve_harmonic_balance(pair.problem(1.2), 1.0, harmonics=8)
    np.testing.assert_allclose(found.deflection / scales.length, scaled.deflection, atol=1e-9)


def test_flanks_part_where_the_closed_form_says():
    pair = ImpactPair(damping_ratio=0.15, load=0.9, tooth_error=(0.72,))
    first, last = separation_ratios(damping_ratio=0.15, load=0.9, error=0.72)
    for ratio in (first, last):
        amplitude = 0.72 * ratio**2 / abs(1.0 - ratio**2 + 0.3j * ratio)
        assert amplitude == pytest.approx(0.9)
        inside, outside = (0.999, 1.001) if ratio == last else (1.001, 0.999)
        lowest = [
            sweep_response(lambda r: (pair.problem(r), 1.0), [f * ratio], most=120).lowest[0, 0]
            for f in (inside, outside)
        ]
        assert lowest[0] < 1.0 < lowest[1]
    assert separation_ratios(damping_ratio=0.5, load=1.0, error=0.1) == ()


def lowest_deflection(branch):
    times = 2.0 * np.pi * np.arange(1024) / 1024
    return np.array([solution.at(times)[:, 0].min() for solution in branch.solutions])


@pytest.mark.slow
def test_damping_of_fifteen_per_cent_leaves_one_answer_and_nine_per_cent_does_not():
    found = {}
    for zeta in (0.15, 0.09):
        branch = parameter_curve(
            example_pair(zeta).problem, (1.1, 0.62), 1.0, harmonics=6, samples=512, stability=False
        )
        assert branch.complete
        found[zeta] = branch, lowest_deflection(branch)
    (calm, calm_lowest), (lively, lively_lowest) = found[0.15], found[0.09]
    assert len(calm.folds) == 0 and np.all(np.diff(calm.parameter) < 0.0) and calm_lowest.min() > -1.0
    assert len(lively.folds) == 2 and lively_lowest.min() < -2.0
    begin, earlier = (b.parameter[low < 1.0].min() for b, low in ((calm, calm_lowest), (lively, lively_lowest)))
    assert earlier < begin - 0.02
    # the border of two-sided impacts on the upper branch, and the jump, by integration
    border = level_crossings(lively.parameter, lively_lowest, -1.0).max()
    ratios = [border + 0.02, border - 0.02, lively.parameter[lively.folds].min() - 0.01]
    run = sweep_response(lambda r: (example_pair(0.09).problem(r), 1.0), ratios, steps=100, most=250)
    states = range_states(run.lowest[:, 0], run.highest[:, 0])
    assert states.tolist() == [1, 2, 0]
