"""Harmonic balance against closed forms, published numbers, manufactured solutions and the linear solver."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, root
from scipy.special import ellipk

from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.solvers.periodic import harmonic_balance as newton
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.phase_grid import sample_counts
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.force_laws import GearMeshes, PolynomialSprings, RadialBearings
from femgear.system.fourier import FourierSeries, harmonic_lines, harmonics_of, side_bands
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem, gear_meshes
from validation.reference.adapted_harmonics import adapt_harmonics
from validation.reference.cornered_springs import PiecewiseSprings


def oscillator(*elements, damping=0.0, stiffness=0.0, load=0.0, forces=()):
    system = MechanicalSystem(
        np.eye(1), np.array([[damping]]), np.array([[stiffness]]), np.eye(1), np.array([load]), ("x",)
    )
    return NonlinearSystem(system, elements, tuple(HarmonicForce([f], o) for f, o in forces))


def duffing(force=0.18, damping=0.05, cubic=0.1):
    """``x'' + zeta x' + x + gamma x^3 = P cos Omega t``: example 1 of NLvib (Krack and Gross, 2019)."""
    return oscillator(PolynomialSprings([0], [[1.0, 0.0, cubic]]), damping=damping, forces=[(force, (1,))])


def first_line(amplitude, phase, count):
    lines = np.zeros((1, count + 1), complex)
    lines[0, 1] = amplitude * np.exp(1j * phase)
    return lines


@pytest.mark.parametrize(
    ("start", "amplitude"),
    [((2.5, -1.0), 2.5091975811), ((2.26, -2.0), 2.2605488905), ((0.4, 0.0), 0.4175204536)],
)
def test_three_solutions_of_duffing(start, amplitude):
    """First harmonics at Omega = 1.2 of 15, confirmed by time integration that closes to 2e-14."""
    found = solve_harmonic_balance(duffing(), 1.2, harmonics=15, start=first_line(*start, 15))
    assert found.converged
    assert abs(found.deflection[0, 1]) == pytest.approx(amplitude, abs=1e-9)
    assert found.tail < 1e-6
    assert found.factorisations == found.iterations > 0
    assert found.history[-1] == found.residual < 1e-10


@pytest.mark.parametrize(
    ("phases", "frequency", "amplitude"),
    [((-1.9, -1.58), 1.2696019555, 2.8250167129), ((-2.95, -2.5), 1.1157002518, 1.0818703234)],
)
def test_folds_of_duffing(phases, frequency, amplitude):
    """The frequency over the phase of the first harmonic has its extrema where it is published, H = 11."""
    balance = harmonic_balance(duffing(), harmonics=11)

    def point(phase):
        # one harmonic: zeta Omega a = -P sin phase, 1 - Omega^2 + 0.075 a^2 = P cos phase / a
        omega = frequency
        y = balance.unknowns(first_line(-0.18 * np.sin(phase) / (0.05 * omega), phase, 11))
        for _ in range(12):
            error, jacobian, slope = balance.evaluate(y, [omega])
            first = balance.lines(y)[0, 1] * np.exp(-1j * phase)
            row = np.zeros(balance.size)
            row[1:3] = -np.sin(phase), np.cos(phase)
            matrix = np.block([[jacobian, slope], [row[None], np.zeros((1, 1))]])
            step = np.linalg.solve(matrix, -np.append(error, first.imag))
            y, omega = y + step[:-1], omega + step[-1]
        assert np.abs(step).max() < 1e-12
        turning = np.linalg.solve(matrix, np.append(np.zeros(balance.size), first.real))[-1]
        return turning, omega, first.real

    _, omega, found = point(brentq(lambda phase: point(phase)[0], *phases, xtol=1e-13))
    assert omega == pytest.approx(frequency, abs=2e-10)
    assert found == pytest.approx(amplitude, abs=2e-9)


@pytest.mark.parametrize("amplitude", [0.1, 1.0, 5.0])
def test_free_duffing_has_the_frequency_of_the_elliptic_integral(amplitude):
    """``omega = pi sqrt(1 + A^2) / (2 K(m))``, ``m = A^2 / (2 (1 + A^2))`` for ``x'' + x + x^3 = 0``."""
    exact = np.pi * np.sqrt(1.0 + amplitude**2) / (2.0 * ellipk(0.5 * amplitude**2 / (1.0 + amplitude**2)))
    balance = harmonic_balance(oscillator(PolynomialSprings([0], [[1.0, 0.0, 1.0]])), harmonics=25)
    y, omega = balance.unknowns(first_line(amplitude, 0.0, 25)), np.sqrt(1.0 + 0.75 * amplitude**2)
    cosines = np.zeros(balance.size, bool)
    cosines[0], cosines[1::2] = True, True
    for _ in range(12):
        # even motions: sines stay zero, the displacement at t = 0 is the amplitude
        error, jacobian, slope = balance.evaluate(y, [omega])
        inner = jacobian[np.ix_(cosines, cosines)]
        matrix = np.block([[inner, slope[cosines]], [np.ones((1, cosines.sum())), np.zeros((1, 1))]])
        step = np.linalg.solve(matrix, np.append(-error[cosines], amplitude - y[cosines].sum()))
        y[cosines] += step[:-1]
        omega += step[-1]
    assert omega == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("kind", ["smooth", "piecewise"])
def test_error_against_a_manufactured_solution(kind):
    """Exponential decay with the harmonics for a smooth law, algebraic for one with corners."""
    omega, samples = 0.7, 4096
    tau = 2.0 * np.pi * np.arange(samples) / samples
    if kind == "smooth":
        law = PolynomialSprings([0], [[1.0, 0.5, 0.8]])
        x = 1.0 / (1.5 - np.cos(tau))
    else:
        law = PiecewiseSprings([0], [-0.5, 0.5], [2.0, 0.3, 2.0])
        # the acceleration that balances the corners of the force has corners too
        x = np.cos(tau) + 0.05 * np.abs(np.sin(1.5 * tau)) ** 3
    lines = harmonics_of(x, 1000)
    order = 1j * omega * np.arange(1001)
    rate = np.fft.irfft(np.append(lines * (order**2 + 0.1 * order), np.zeros(1048)) * samples / 2, n=samples)
    load = harmonics_of(rate + law.evaluate(x[:, None, None], tau[:, None])[0][:, 0, 0], 1000)
    counts, errors = (4, 8, 16, 32), []
    for count in counts:
        forces = [(load[h], (h,)) for h in range(1, count + 1)]
        problem = oscillator(law, damping=0.1, load=load[0].real, forces=forces)
        start = lines[None, : count + 1]
        found = solve_harmonic_balance(problem, omega, harmonics=count, start=start, samples=4096)
        assert found.converged
        errors.append(np.abs(found.at(tau / omega)[:, 0] - x).max())
    ratios = np.array(errors[:-1]) / errors[1:]
    if kind == "smooth":
        # the lines of 1 / (1.5 - cos) fall by 0.382 a harmonic
        rates = np.log(ratios) / np.diff(counts)
        np.testing.assert_allclose(rates, np.log(2.618), rtol=0.1)
    else:
        # lines fall with the fourth power where the third derivative jumps, their sum with the third
        slopes = np.log2(ratios)
        assert np.all((slopes > 2.0) & (slopes < 4.5)), slopes


def test_linear_limit_is_the_spectral_solution(planet_set, planet_excitation):
    phases = np.array([0.0, 1 / 3, 2 / 3, 0.1, 0.1 + 1 / 3, 0.1 + 2 / 3])
    system, excitation = planet_set(3), planet_excitation(phases)
    mean = excitation.stiffness.mean(axis=1)
    frequency = np.array([0.0, 0.05, 0.2, 0.35])
    wanted = solve_spectral(
        undamped_modes(system, mean, damping_ratio=0.03),
        excitation,
        frequency,
        excitation_harmonics=4,
        response_harmonics=10,
        method="direct",
        tolerance=1e-12,
    )
    system = replace(system, C=modal_damping(system, mean, 0.03))
    problem = NonlinearSystem(system, (gear_meshes(excitation, harmonics=4, separates=False),))
    for number, f in enumerate(frequency):
        found = solve_harmonic_balance(problem, 2.0 * np.pi * f, harmonics=10)
        assert found.converged
        for name in ("deflection", "force"):
            error = np.abs(getattr(found, name) - getattr(wanted, name)[number]).max()
            assert error < 1e-10 * np.abs(getattr(wanted, name)[number]).max()
        # teeth that stay together do not know whether they could part
        parting = replace(problem, elements=(gear_meshes(excitation, harmonics=4),))
        same = solve_harmonic_balance(parting, 2.0 * np.pi * f, harmonics=10)
        assert same.at(np.linspace(0.0, 20.0, 500)).min() > 0.0
        np.testing.assert_allclose(same.deflection, found.deflection, atol=1e-9)


def test_displacements_satisfy_the_equations_of_motion(planet_set, planet_excitation):
    """``(K + i w C - w^2 M) Q + W F = load`` line by line, in physical coordinates."""
    system, excitation = planet_set(3), planet_excitation(np.array([0.0, 1 / 3, 2 / 3] * 2), depth=0.3)
    system = replace(system, C=0.05 * np.eye(15))
    problem = NonlinearSystem(
        system, (gear_meshes(excitation, harmonics=4),), (HarmonicForce(0.1 * np.ones(15), (1,)),)
    )
    found = solve_harmonic_balance(problem, 1.4, harmonics=6)
    assert found.converged and found.at(np.linspace(0.0, 4.5, 100)).min() < 0.0
    lines = displacements(problem, found)
    np.testing.assert_allclose(system.W.T @ lines, found.deflection, atol=1e-10)
    omega = found.line_frequency
    inertia = system.K @ lines + (1j * omega * (system.C @ lines)) - omega**2 * (system.M @ lines)
    outside = np.zeros((15, 7), complex)
    outside[:, 0], outside[:, 1] = system.load, 0.1
    np.testing.assert_allclose(inertia + system.W @ found.force, outside, atol=1e-8)
    np.testing.assert_allclose(displacements(problem, found, np.eye(15)[3]), lines[3:4], atol=1e-14)


def mixed_problem():
    """A rotor with a bearing with clearance, a mesh with backlash and a cubic spring on a shared column."""
    rng = np.random.default_rng(3)
    K = np.diag([1.0, 1.2, 0.6, 0.9])
    W = np.column_stack([np.eye(4)[0], np.eye(4)[1], [0.3, 0.5, 1.0, -1.0]])
    C = np.diag([0.1, 0.2, 0.15, 0.1])
    system = MechanicalSystem(np.eye(4), C, K, W, rng.standard_normal(4), tuple("abcd"))
    elements = (
        RadialBearings([[0, 1]], 2.0, clearance=0.3),
        GearMeshes([2], FourierSeries([[1.0, 0.3, 0.1j]], (0, 1)), backlash=0.4),
        PolynomialSprings([2, 0], [[0.2, 0.1, 0.3], [0.1, 0.0, 0.2]]),
    )
    forces = (HarmonicForce([0.5, -0.5j, 0, 0], (-1,)), HarmonicForce([0, 0, 1.0, 0], (0, 1)))
    return NonlinearSystem(system, elements, forces)


@pytest.mark.parametrize("orders", [harmonic_lines(3, 2), side_bands(3, 2, 2)], ids=["diamond", "side bands"])
def test_derivatives_of_the_residual(orders):
    balance = harmonic_balance(mixed_problem(), orders=orders)
    frequency, step = np.array([0.37, 1.3]), 1e-6
    y = 0.6 * np.random.default_rng(5).standard_normal(balance.size)
    _, jacobian, slope = balance.evaluate(y, frequency)

    def difference(change_y, change_w):
        ahead = balance.evaluate(y + step * change_y, frequency + step * change_w)[0]
        return (ahead - balance.evaluate(y - step * change_y, frequency - step * change_w)[0]) / (2 * step)

    for base in np.eye(2):
        wanted = difference(0.0, base)
        assert np.abs(slope @ base - wanted).max() < 1e-7 * np.abs(wanted).max()
    for _ in range(6):
        direction = np.random.default_rng(7).standard_normal(balance.size)
        wanted = difference(direction, np.zeros(2))
        # samples that cross a corner within the step limit what a difference can see
        assert np.abs(jacobian @ direction - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_derivative_of_a_polynomial_law_to_rounding():
    """The residual of a cubic law is a cubic, whose derivative the five-point difference gives exactly."""
    balance = harmonic_balance(duffing(), harmonics=4)
    y = np.random.default_rng(1).standard_normal(balance.size)
    jacobian = balance.evaluate(y, [0.8])[1]
    for direction in np.eye(balance.size):
        far, near, back, behind = (balance.evaluate(y + step * direction, [0.8])[0] for step in (1.0, 0.5, -0.5, -1.0))
        wanted = (8.0 * (near - back) - (far - behind)) / 6.0
        np.testing.assert_allclose(jacobian @ direction, wanted, atol=1e-12 * np.abs(jacobian).max())


@pytest.mark.parametrize(
    ("orders", "place"), [(harmonic_lines(4), (1,)), (side_bands(5, 2, 2), (0, 1))], ids=["one", "two"]
)
def test_default_samples_keep_aliasing_out(orders, place):
    """Polynomials and series with more harmonics than the lines: more samples change nothing."""
    rng = np.random.default_rng(8)
    series = [FourierSeries(rng.standard_normal((1, 8)), place) for _ in range(2)]
    mesh = GearMeshes([0], series[0], deflection=series[1], separates=False)
    problem = oscillator(mesh, PolynomialSprings([0], [[1.0, 0.3, 0.2]]), stiffness=9.0, damping=0.3)
    balance = harmonic_balance(problem, orders=orders)
    fine = harmonic_balance(problem, orders=orders, samples=tuple(8 * n for n in balance.grid.samples))
    y, frequency = rng.standard_normal(balance.size), [0.8, 2.1][: orders.shape[1]]
    for coarse, exact in zip(balance.evaluate(y, frequency), fine.evaluate(y, frequency)):
        np.testing.assert_allclose(coarse, exact, atol=1e-12 * np.abs(exact).max())


def test_start_from_a_solution_on_other_lines():
    """Lines are found by their orders, mirror images conjugated, and the rest starts at zero."""
    found = solve_harmonic_balance(duffing(), 1.2, harmonics=7)
    mirrored = np.array([[0], [-1], [2], [-3], [4], [-5], [6], [-7]])
    again = solve_harmonic_balance(duffing(), 1.2, orders=mirrored, start=found)
    assert again.converged and again.iterations == 0
    np.testing.assert_allclose(again.at(np.arange(5.0)), found.at(np.arange(5.0)), atol=1e-14)
    np.testing.assert_array_equal(again.deflection[0, 1], found.deflection[0, 1].conj())


def test_unknowns_and_lines_are_inverse():
    balance = harmonic_balance(mixed_problem(), orders=side_bands(4, 1, 2))
    y = np.random.default_rng(2).standard_normal(balance.size)
    assert balance.size == 3 * (2 * len(balance.orders) - 1)
    np.testing.assert_array_equal(balance.unknowns(balance.lines(y)), y)
    assert np.all(balance.lines(y)[:, 0].imag == 0.0)


def test_parametric_duffing_of_another_package():
    """``x'' + 2 z x' + (1 + e cos wt) x + a x^3 = F cos wt`` solved with harmonicbalance 0.2.0 (PyPI)."""
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.2]]), separates=False)
    problem = oscillator(mesh, PolynomialSprings([0], [[0.0, 0.0, 0.3]]), damping=0.1, forces=[(0.2, (1,))])
    start = first_line(1.0, 0.0, 12)
    found = solve_harmonic_balance(problem, 1.1, harmonics=12, start=start)
    assert found.converged
    np.testing.assert_allclose(np.abs(found.deflection[0, 1:4]), [1.22096098, 0.02960864, 0.01465221], atol=1e-8)
    assert found.deflection[0, 0].real == pytest.approx(-0.0598195866, abs=1e-9)


def test_same_lines_as_the_package_harmonicbalance():
    pytest.importorskip("harmonicbalance")
    from harmonicbalance.fourier import Fourier

    n, omega = 12, 1.1
    cosine = Fourier(0.0, np.eye(n)[0], np.zeros(n), omega=omega, n=n)

    def equations(coefficients):
        x = Fourier.from_coeffs(coefficients, omega)
        return (x.dt().dt() + 0.1 * x.dt() + x + 0.2 * cosine * x + 0.3 * x**3 - 0.2 * cosine).coeffs()

    begin = Fourier(0.0, np.eye(n)[0], 0.1 * np.eye(n)[0], omega=omega, n=n)
    theirs = Fourier.from_coeffs(root(equations, begin.coeffs(), tol=1e-12).x, omega)
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.2]]), separates=False)
    problem = oscillator(mesh, PolynomialSprings([0], [[0.0, 0.0, 0.3]]), damping=0.1, forces=[(0.2, (1,))])
    ours = solve_harmonic_balance(problem, omega, harmonics=n, start=first_line(1.0, 0.0, n))
    # its derivative turns (cos, sin) into (-omega sin, omega cos): the lines are cos + i sin
    wanted = np.append(theirs.coeff_dc, np.array(theirs.coeffs_cos) + 1j * np.array(theirs.coeffs_sin))
    assert np.abs(ours.deflection[0] - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_two_tones_reduce_to_one():
    """Without the second force the two-base equations give the one-base solution and nothing beside it."""
    one = solve_harmonic_balance(duffing(), 1.2, harmonics=7)
    problem = replace(duffing(), forces=(HarmonicForce([0.18], (1, 0)), HarmonicForce([0.0], (0, 1))))
    orders = harmonic_lines(7, 2)
    two = solve_harmonic_balance(problem, [1.2, 1.2 * np.sqrt(2.0)], orders=orders)
    assert two.converged
    alone = orders[:, 1] == 0
    np.testing.assert_allclose(two.deflection[0, alone], one.deflection[0], atol=1e-12)
    assert np.abs(two.deflection[0, ~alone]).max() < 1e-14
    # the same force on the second base is the same solution on the other axis
    swapped = replace(problem, forces=(HarmonicForce([0.18], (0, 1)),))
    other = solve_harmonic_balance(swapped, [0.5, 1.2], orders=orders)
    np.testing.assert_allclose(other.deflection[0, orders[:, 0] == 0], one.deflection[0], atol=1e-12)


def test_harmonics_are_raised_until_the_tail_is_short():
    problem = duffing(force=1.0, cubic=1.0)
    found = adapt_harmonics(problem, 0.4, tail=1e-8, harmonics=3)
    assert found.converged and found.tail <= 1e-8 and len(found.orders) > 4
    finer = solve_harmonic_balance(problem, 0.4, harmonics=2 * len(found.orders), start=found)
    assert np.abs(finer.deflection[:, : len(found.orders)] - found.deflection).max() < 1e-7
    short = adapt_harmonics(problem, 0.4, tail=1e-12, harmonics=3, max_harmonics=6)
    assert len(short.orders) == 7 and short.tail > 1e-12


def parting_pair(zeta=0.05, depth=0.5, load=0.1, backlash=1.0):
    stiffness = FourierSeries([[1.0, depth, 0.3 * depth]])
    return oscillator(GearMeshes([0], stiffness, backlash=backlash), damping=2.0 * zeta, load=load)


@pytest.mark.parametrize("frequency", np.linspace(0.7, 1.2, 6))
def test_a_start_is_found_where_teeth_part(frequency):
    found = solve_harmonic_balance(parting_pair(), frequency, harmonics=12)
    assert found.converged, found.message
    assert found.residual < 1e-10
    # mean of the equation of motion: the mesh carries the load
    assert found.force[0, 0].real == pytest.approx(0.1, abs=1e-10)


def test_embedding_is_reported():
    found = solve_harmonic_balance(parting_pair(depth=0.3), 0.9, harmonics=16)
    assert found.converged and "embedding" in found.message
    steps = int(re.search(r"started from (\d+) steps of embedding", found.message)[1])
    # one matrix for every iteration, and for every step of the embedding at least one more
    assert found.factorisations >= found.iterations + steps


def test_no_convergence_is_reported_with_a_remedy():
    start = first_line(2.5, -3.0, 15)
    found = solve_harmonic_balance(duffing(), 1.2, harmonics=15, start=start, max_iterations=2)
    assert not found.converged and found.residual > 1e-10
    assert "Not converged after 2 steps" in found.message and "continuation" in found.message
    assert np.all(np.isfinite(found.deflection))


def test_unknowns_do_not_grow_with_the_model(planet_set, planet_excitation):
    """The set with a row of masses behind every body has the unknowns of the set alone."""
    system, excitation = planet_set(3), planet_excitation(np.array([0.0, 1 / 3, 2 / 3] * 2))
    big = 15 * 12
    M, K, W, load = 0.01 * np.eye(big), np.zeros((big, big)), np.zeros((big, 6)), np.zeros(big)
    M[:15, :15], K[:15, :15], W[:15], load[:15] = system.M, system.K, system.W, system.load
    for i in range(15, big):
        K[np.ix_([i - 15, i], [i - 15, i])] += 9.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    grown = replace(system, M=M, K=K, C=0.02 * M, W=W, load=load, dofs=())
    meshes = gear_meshes(excitation, harmonics=4)
    small = harmonic_balance(NonlinearSystem(replace(system, C=0.02 * system.M), (meshes,)), harmonics=6)
    problem = NonlinearSystem(grown, (meshes,))
    large = harmonic_balance(problem, harmonics=6)
    assert large.size == small.size == 6 * 13


def test_newton_takes_five_steps_that_lower_nothing(monkeypatch):
    """Away from the solution of a linear system every step raises the residual: the sixth is not taken."""
    right = newton._newton_step
    monkeypatch.setattr(newton, "_newton_step", lambda *problem: -right(*problem))
    found = solve_harmonic_balance(duffing(cubic=0.0), 1.2, harmonics=3, start=first_line(0.4, 0.0, 3))
    assert not found.converged and "no step along Newton's direction" in found.message
    assert len(found.history) == found.iterations == 6


def test_embedding_starts_from_a_linear_system_at_rest():
    """Nothing but the errors of the flanks moves it, and only where the mesh is there."""
    error = FourierSeries([[0.0, 0.4]])
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.3]]), deflection=error, separates=False)
    problem = oscillator(mesh, damping=0.2, stiffness=0.5)
    balance = harmonic_balance(problem, harmonics=6)
    whole = solve_harmonic_balance(problem, 0.9, harmonics=6)
    frequency = np.array([0.9])
    found = newton._embed(balance, frequency, whole, tolerance=1e-10, max_iterations=20, radius=False)
    assert found.converged and "embedding" in found.message
    np.testing.assert_allclose(found.deflection, whole.deflection, atol=1e-9)


def test_samples_of_a_contact_along_one_two_and_three_bases():
    for bases, least in ((1, 2048), (2, 64), (3, 64)):
        lines = np.concatenate([np.zeros((1, bases), int), np.eye(bases, dtype=int)])
        for order, times in ((2, (256, 16, 16)[bases - 1]), (20, (2560, 160, 160)[bases - 1])):
            counts = sample_counts(parting_pair(), order * lines)
            # the stiffness has two harmonics along the first base
            wanted = np.maximum(times, least) + np.array([4, 0, 0])[:bases]
            assert all(one <= count <= 1.1 * one for one, count in zip(wanted, counts, strict=True))
