from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic import spectral
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.fourier import Product, harmonics_of, pad, sample
from femgear.system.system import MechanicalSystem, MeshExcitation


def series(amplitudes, angle):
    """Value of one-sided harmonics (n, H + 1) at one angle."""
    return (amplitudes @ np.exp(1j * np.arange(amplitudes.shape[-1]) * angle)).real


def integrate(system, excitation, modes, frequency, harmonics, instants=64):
    """Periodic mesh deflections by DOP853 and linear shooting in physical coordinates."""
    k, s, f = (harmonics_of(a, harmonics) for a in (excitation.stiffness, excitation.deflection, excitation.force))
    n, omega = len(system.M), 2 * np.pi * frequency
    damping = system.M @ (modes.shape * (4 * np.pi * modes.frequency * modes.damping_ratio)) @ modes.shape.T @ system.M
    inverse = np.linalg.inv(system.M)

    def rate(t, y, forced):
        x = y.reshape(2, n, -1)
        stiffness = series(k, omega * t)[:, None]
        force = stiffness * (system.W.T @ x[0])
        outside = np.zeros((n, 1))
        if forced:
            force = force + series(f, omega * t)[:, None] - stiffness * series(s, omega * t)[:, None]
            outside = system.load[:, None]
        acceleration = inverse @ (outside - damping @ x[1] - system.K @ x[0] - system.W @ force)
        return np.stack([x[1], acceleration]).ravel()

    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
    period = 1 / frequency
    free = solve_ivp(rate, (0, period), np.eye(2 * n).ravel(), args=(False,), **options).y[:, -1]
    forced = solve_ivp(rate, (0, period), np.zeros(2 * n), args=(True,), **options).y[:, -1]
    start = np.linalg.solve(np.eye(2 * n) - free.reshape(2 * n, 2 * n), forced)
    times = np.arange(instants) * period / instants
    motion = solve_ivp(rate, (0, period), start, args=(True,), t_eval=times, **options).y[:n]
    return system.W.T @ motion


@pytest.mark.parametrize("each", [False, True], ids=["one factor", "one a speed"])
def test_product_of_harmonics_is_the_product_of_signals(each):
    rng = np.random.default_rng(0)
    factor, b = rng.standard_normal((2, 3, 64) if each else (2, 1, 64)), rng.standard_normal((2, 3, 64))
    a, b = harmonics_of(factor, 4), harmonics_of(b, 6)
    product = Product(pad(a, 6) if each else pad(a, 6)[:, 0])
    expected = harmonics_of(sample(a, 64) * sample(b, 64), 6)
    np.testing.assert_allclose(product(b), expected, atol=1e-14)


def test_harmonics_need_enough_positions():
    signal = np.cos(2 * np.pi * np.arange(13) / 13 * 6 + 0.4)
    np.testing.assert_allclose(np.abs(harmonics_of(signal, 6)), [0, 0, 0, 0, 0, 0, 1], atol=1e-12)
    with pytest.raises(CaseError, match="12 positions"):
        harmonics_of(signal[:12], 6)


def test_quasi_static_response_is_the_static_state(geared_chain, chain_excitation):
    excitation = chain_excitation(0.2)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.05, count=2)
    for method in ("direct", "fixed point"):
        response = solve_spectral(modes, excitation, [0.0, 1e-7], method=method, tolerance=1e-12)
        for h in range(7):
            expected = harmonics_of(excitation.deflection, 6)[:, h]
            np.testing.assert_allclose(response.deflection[:, :, h], [expected] * 2, atol=1e-6 * abs(expected).max())
            expected = harmonics_of(excitation.force, 6)[:, h]
            np.testing.assert_allclose(response.force[:, :, h], [expected] * 2, atol=2e-6)
        assert np.abs(response.deflection[:, :, 7:]).max() < 1e-6


def test_quasi_static_state_does_not_depend_on_the_stiffness_in_the_modes(geared_chain, chain_excitation):
    excitation = chain_excitation(0.2)
    modes = undamped_modes(geared_chain, [1.2, 1.1], damping_ratio=0.05)
    response = solve_spectral(modes, excitation, 0.0, tolerance=1e-12)
    np.testing.assert_allclose(response.deflection[0, :, :7], harmonics_of(excitation.deflection, 6), atol=1e-9)


@pytest.mark.parametrize(
    ("lines", "share"),
    [
        # energies 9, 16, 4, 1 of harmonics 1 to 4: 3 and 4 are above 2
        ([[90, 3, 0, 0, 1], [0, 0, 4, 2j, 0]], 5 / 30),
        # energies 9, 16, 4, 1, 4 of harmonics 1 to 5: 3, 4 and 5 are above 2.5
        ([[90, 3, 0, 0, 1, 0], [0, 0, 4, 2j, 0, -2]], 9 / 34),
        # one harmonic is the whole fluctuation
        ([[90, 3], [0, 4j]], 1.0),
        # no fluctuation, or rounding of the mean
        ([[90, 0, 0], [1, 0, 0]], 0.0),
        ([[90, 0, 3e-11], [1, 0, 0]], 0.0),
    ],
)
def test_tail_is_the_amplitude_above_half_of_the_harmonics(lines, share):
    both = np.array([lines, np.roll(lines, 1, axis=0)], complex)
    found = spectral._tail(pad(both, 9), np.full(2, len(lines[0]) - 1))
    np.testing.assert_allclose(found, np.sqrt([share, share]), rtol=1e-14)


@pytest.mark.parametrize("depth", [0.1, 0.3])
def test_fixed_point_equals_direct_solution_where_it_contracts(geared_chain, chain_excitation, depth):
    excitation = chain_excitation(depth)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    frequency = np.linspace(0.01, 0.6, 60)
    direct = solve_spectral(modes, excitation, frequency, method="direct")
    fixed = solve_spectral(modes, excitation, frequency, method="fixed point", tolerance=1e-11, max_iterations=3000)
    contracts = direct.spectral_radius < 0.98
    np.testing.assert_array_equal(fixed.converged[contracts], True)
    scale = np.abs(direct.deflection).max(axis=(1, 2))[contracts]
    error = np.abs(fixed.deflection - direct.deflection).max(axis=(1, 2))[contracts]
    assert contracts.sum() > 30 and np.all(error < 1e-8 * scale)


def test_response_equals_time_integration(geared_chain, chain_excitation):
    """Three speeds: a low one, one at a resonance, one where the fixed point diverges."""
    excitation = chain_excitation(0.35)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.02, count=4)
    frequency = np.array([0.03, modes.frequency[3], modes.frequency[3] / 2])
    response = solve_spectral(modes, excitation, frequency, response_harmonics=30, tolerance=1e-9)
    assert response.spectral_radius[1:].max() > 1.0 and "direct" in response.method
    waves = sample(response.deflection, 64)
    for i, f in enumerate(frequency):
        exact = integrate(geared_chain, excitation, modes, f, 6)
        assert np.abs(waves[i] - exact).max() < 1e-4 * np.ptp(exact, axis=1).min()


def test_single_mass_equals_time_integration():
    system = MechanicalSystem(np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)), np.ones(1), ("x",))
    stiffness = (1.0 + 0.3 * np.cos(2 * np.pi * np.arange(32) / 32))[None]
    excitation = MeshExcitation(stiffness, 1 / stiffness, np.ones_like(stiffness), np.zeros(1))
    modes = undamped_modes(system, [1.0], damping_ratio=0.1)
    frequency = np.array([0.03, 0.155, 0.3])
    response = solve_spectral(modes, excitation, frequency, response_harmonics=16, tolerance=1e-10)
    for i, f in enumerate(frequency):
        exact = integrate(system, excitation, modes, f, 6)
        assert np.abs(sample(response.deflection, 64)[i] - exact).max() < 1e-4 * np.ptp(exact)


def test_modal_coordinates_give_back_the_deflection(geared_chain, chain_excitation):
    excitation = chain_excitation(0.3)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    response = solve_spectral(modes, excitation, [0.1, 0.2, 0.3], method="direct")
    rebuilt = np.einsum("jk,skh->sjh", modes.mesh_deflection, response.modal)
    np.testing.assert_allclose(rebuilt, response.deflection, atol=1e-12 * np.abs(rebuilt).max())


def test_few_modes_with_residual_flexibility_follow_all_modes(geared_chain, chain_excitation):
    excitation = chain_excitation(0.2)
    mean = excitation.stiffness.mean(axis=1)
    responses = []
    for count in (4, 3):
        modes = undamped_modes(geared_chain, mean, damping_ratio=0.05, count=count)
        responses.append(solve_spectral(modes, excitation, 0.0002, method="direct").deflection)
    error = np.abs(responses[1] - responses[0])[..., 1:].max() / np.abs(responses[0])[..., 1:].max()
    assert error < 1e-4
    poor = replace(modes, residual=np.zeros((2, 2)))
    wrong = solve_spectral(poor, excitation, 0.0002, method="direct").deflection
    assert np.abs(wrong - responses[0])[..., 1:].max() > 0.05 * np.abs(responses[0])[..., 1:].max()


@pytest.mark.parametrize("step", [0.0, 1 / 3, 2 / 3])
def test_identical_planets_repeat_each_other_in_time(planet_set, planet_excitation, step):
    system = planet_set()
    phase = step * np.arange(3)
    excitation = planet_excitation(np.concatenate([phase, phase + 0.25]))
    modes = undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    response = solve_spectral(modes, excitation, np.linspace(0.05, 0.5, 7), method="direct")
    shift = np.exp(-2j * np.pi * np.arange(13) * phase[:, None])
    scale = np.abs(response.deflection).max()
    for first in (0, 3):
        expected = response.deflection[:, first : first + 1] * shift
        np.testing.assert_allclose(response.deflection[:, first : first + 3], expected, atol=1e-12 * scale)


def full_problem(modes, excitation, frequency):
    """The unreduced equations, built by hand from samples and the modal sum."""
    k, s, f = (harmonics_of(a, 6) for a in (excitation.stiffness, excitation.deflection, excitation.force))
    k, s, f = (np.pad(a, ((0, 0), (0, 6))) for a in (k, s, f))
    forcing = f - Product(k)(s[:, None])[:, 0]
    k[:, 0] -= modes.mesh_stiffness
    omega, w = 2 * np.pi * np.outer(frequency, np.arange(13)), 2 * np.pi * modes.frequency
    modal = 1 / (w**2 - omega[..., None] ** 2 + 2j * modes.damping_ratio * w * omega[..., None])
    r = modes.mesh_deflection
    receptance = np.einsum("ik,jk,shk->ijsh", r, r, modal) + modes.residual[:, :, None, None]
    source = -np.einsum("ijsh,jh->ish", receptance, forcing)
    source[..., 0] += modes.load_deflection[:, None]
    return spectral.HarmonicProblem(receptance, Product(k), source)


def dense(problem):
    """Matrices (n_speeds, d, d) of ``T G`` on real rows, column by column, without those of Im X_0."""
    n, speeds, size = problem.source.shape
    units = np.eye(2 * n * size)[np.arange(2 * n * size) % (2 * size) != 1]
    columns = [
        spectral._rows(spectral._apply(problem, spectral._lines(np.tile(unit, (speeds, 1)), n))) for unit in units
    ]
    return np.stack(columns, axis=-1)[:, np.arange(2 * n * size) % (2 * size) != 1]


def eliminated(problem):
    """Harmonics of the deflections by Gaussian elimination."""
    kept = np.arange(2 * len(problem.source) * problem.source.shape[-1]) % (2 * problem.source.shape[-1]) != 1
    matrix, rows = dense(problem), spectral._rows(problem.source)
    rows[:, kept] = np.linalg.solve(np.eye(kept.sum()) + matrix, rows[:, kept, None])[..., 0]
    return spectral._lines(rows, len(problem.source))


def exact_radius(problem):
    return np.abs(np.linalg.eigvals(dense(problem))).max(axis=1)


@pytest.mark.parametrize("spoiled", [False, True])
def test_reduction_to_one_planet_equals_the_full_equations(planet_set, planet_excitation, spoiled):
    system = planet_set()
    if spoiled:
        mass = system.M.copy()
        mass[6, 6] *= 1.3
        system = replace(system, M=mass)
    phase = np.arange(3) / 3
    excitation = planet_excitation(np.concatenate([phase, phase + 0.25]))
    modes = undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    frequency = np.linspace(0.05, 0.5, 5)
    problem = full_problem(modes, excitation, frequency)
    twins = spectral.find_twins((pad(harmonics_of(excitation.stiffness, 6), 12),))
    assert len(twins.leaders) == 2
    assert spectral._alike(modes, twins, 2.0 * np.pi * 0.3) is not spoiled
    exact = eliminated(problem).transpose(1, 0, 2)
    for method in ("direct", "auto"):
        response = solve_spectral(modes, excitation, frequency, method=method, tolerance=1e-12)
        np.testing.assert_allclose(response.deflection, exact, atol=1e-10 * np.abs(exact).max())
        assert response.residual.max() < 1e-11


@pytest.mark.parametrize("steps", [250, 12])
def test_krylov_steps_give_what_elimination_gives(planet_set, planet_excitation, monkeypatch, steps):
    """Also in several cycles; every speed as if it were alone."""
    excitation = planet_excitation(np.array([0.0, 0.3, 0.5, 0.1, 0.7, 0.2]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.02)
    problem = full_problem(modes, excitation, np.linspace(0.02, 0.6, 30))
    monkeypatch.setattr(spectral, "_KRYLOV", steps)
    monkeypatch.setattr(spectral, "_CYCLES", 100)
    expected, found = eliminated(problem), spectral.solve_direct(problem)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    rough = spectral.solve_direct(problem, 1e-4)
    alone = spectral.solve_direct(problem.take(np.array([7])), 1e-4)
    assert np.abs(rough - expected).max() > 1e-8 * np.abs(expected).max()
    np.testing.assert_allclose(rough[:, [7]], alone, atol=1e-12 * np.abs(alone).max())


@pytest.mark.parametrize("accuracy", [1e-4, 5e-7, 1e-7])
def test_krylov_steps_in_single_precision_are_as_exact_as_asked(planet_set, planet_excitation, accuracy):
    """The residual is that of the equations in double precision, near resonances too."""
    excitation = planet_excitation(np.array([0.0, 0.3, 0.5, 0.1, 0.7, 0.2]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.02)
    problem = full_problem(modes, excitation, np.linspace(0.02, 0.6, 30))
    found = spectral.solve_direct(problem, accuracy)
    rest = spectral._norm(problem.source - found - spectral._apply(problem, found))
    # relative to what fluctuates, and no finer than that asks for
    assert np.all(rest <= accuracy * spectral._moving(problem.source))
    assert rest.max() > 1e-3 * accuracy * spectral._moving(problem.source).max()


def test_nearly_identical_planets_meet_the_full_equations(planet_set, planet_excitation):
    """A difference too small to break the symmetry does not keep a tight tolerance from being met."""
    system = planet_set()
    mass = system.M.copy()
    mass[6, 6] *= 1.0 + 1e-9
    excitation = planet_excitation(np.zeros(6))
    modes = undamped_modes(replace(system, M=mass), excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    frequency = np.linspace(0.05, 0.5, 5)
    for method in ("auto", "direct"):
        response = solve_spectral(modes, excitation, frequency, method=method, tolerance=1e-12)
        assert np.all(response.converged) and response.residual.max() < 1e-12


@pytest.mark.parametrize(("ratio", "apart", "count"), [(0.001, 1e-10, 2), (0.001, 1e-6, 6), (0.05, 1e-6, 6)])
def test_rounding_of_natural_frequencies_keeps_planets_equal(planet_set, planet_excitation, ratio, apart, count):
    """At resonances with little damping it shows five hundred times as much; other planets stay others."""
    system = planet_set()
    mass = system.M.copy()
    mass[6, 6] *= 1.0 + apart
    excitation = planet_excitation(np.zeros(6))
    modes = undamped_modes(replace(system, M=mass), excitation.stiffness.mean(axis=1), damping_ratio=ratio)
    for frequency in modes.frequency[modes.frequency > 1e-3]:
        data = spectral._Data.build(modes, excitation, 4, 8, float(frequency))
        assert len(data.twins.leaders) == count


def test_arnoldi_finds_the_spectral_radius(planet_set, planet_excitation):
    excitation = planet_excitation(np.array([0.0, 0.3, 0.5, 0.1, 0.7, 0.2]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.02)
    problem = full_problem(modes, excitation, np.linspace(0.02, 0.6, 30))
    np.testing.assert_allclose(spectral.spectral_radius(problem), exact_radius(problem), rtol=0.02)


def test_a_fixed_point_without_promise_is_given_up(planet_set, planet_excitation):
    """The speeds at which it ends are those of all iterations; none that would have converged is far."""
    excitation = planet_excitation(np.array([0.0, 0.3, 0.5, 0.1, 0.7, 0.2]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.02)
    problem = full_problem(modes, excitation, np.linspace(0.02, 0.6, 30))
    radius = exact_radius(problem)
    _, long, converged = spectral._fixed_point(problem, 1e-10, 100, patient=True)
    value, steps, done = spectral._fixed_point(problem, 1e-10, 100, patient=False)
    assert radius.max() > 1.2 and not done[radius > 0.9].any() and done[radius < 0.6].all()
    assert np.all(steps[~done] < long[~done]) and np.array_equal(steps[done], long[done])
    assert converged[done].all() and done.sum() > 10
    expected = eliminated(problem)[:, done]
    np.testing.assert_allclose(value[:, done], expected, atol=1e-9 * np.abs(expected).max())


def test_many_speeds_equal_one_at_a_time(geared_chain, chain_excitation):
    excitation = chain_excitation(0.2)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    frequency = np.linspace(0.01, 0.5, 95)
    together = solve_spectral(modes, excitation, frequency, tolerance=1e-11)
    for i in (0, 39, 40, 94):
        alone = solve_spectral(modes, excitation, frequency[i], tolerance=1e-11)
        np.testing.assert_allclose(together.deflection[i], alone.deflection[0], atol=1e-9)


def test_record_of_two_periods_has_every_second_line(geared_chain, chain_excitation):
    single = chain_excitation(0.2)
    double = MeshExcitation(
        *(np.tile(a, (1, 2)) for a in (single.stiffness, single.deflection, single.force)),
        np.zeros(2),
        periods=2,
    )
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    one = solve_spectral(modes, single, [0.1, 0.2], method="direct")
    two = solve_spectral(modes, double, [0.1, 0.2], method="direct")
    assert two.periods == 2 and two.deflection.shape[-1] == 25
    np.testing.assert_allclose(two.deflection[..., ::2], one.deflection, atol=1e-12)
    assert np.abs(two.deflection[..., 1::2]).max() < 1e-12


def test_divergence_is_flagged_and_the_direct_solution_takes_over(geared_chain, chain_excitation):
    excitation = chain_excitation(0.35)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.005)
    at = modes.frequency[3]
    failed = solve_spectral(modes, excitation, at, method="fixed point")
    assert not failed.converged[0] and np.all(np.isnan(failed.deflection)) and failed.spectral_radius[0] > 1
    assert "did not converge" in failed.message
    rescued = solve_spectral(modes, excitation, at)
    assert rescued.converged[0] and rescued.method == ("direct",) and rescued.residual[0] < 1e-6


def test_truncation_is_reported(geared_chain, chain_excitation):
    excitation = chain_excitation(0.35)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.005)
    rough = solve_spectral(modes, excitation, modes.frequency[3] / 5, response_harmonics=6)
    fine = solve_spectral(modes, excitation, modes.frequency[3] / 5, response_harmonics=40)
    assert "Too few response harmonics" in rough.message and "Too few" not in fine.message
    assert fine.tail[0] < 1e-3 < rough.tail[0]


def test_undamped_resonance_is_refused_with_its_frequency(geared_chain, chain_excitation):
    excitation = chain_excitation(0.2)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.0)
    with pytest.raises(ConvergenceError, match=f"{modes.frequency[1]:.6g} Hz") as caught:
        solve_spectral(modes, excitation, [0.3, modes.frequency[1]])
    assert caught.value.code == "E-RESONANCE"


@pytest.mark.parametrize(
    ("frequency", "options"),
    [
        (-1.0, {}),
        (np.nan, {}),
        ([], {}),
        (0.1, {"method": "magic"}),
        (0.1, {"tolerance": 0.0}),
        (0.1, {"max_iterations": 0}),
        (0.1, {"response_harmonics": 3}),
        (0.1, {"excitation_harmonics": 0}),
        (0.1, {"excitation_harmonics": 40, "response_harmonics": 80}),
    ],
)
def test_bad_requests_are_refused(geared_chain, chain_excitation, frequency, options):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    with pytest.raises(CaseError):
        solve_spectral(modes, chain_excitation(0.2), frequency, **options)


def test_bad_excitation_is_refused(geared_chain, chain_excitation):
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    good = chain_excitation(0.2)
    stiffness = good.stiffness.copy()
    stiffness[0, 3] = np.nan
    for bad in (replace(good, stiffness=stiffness), replace(good, force=good.force[:, :-1])):
        with pytest.raises(CaseError):
            solve_spectral(modes, bad, 0.1)


def test_the_radius_is_left_out_where_it_is_not_wanted(geared_chain, chain_excitation):
    excitation = chain_excitation(0.3)
    modes = undamped_modes(geared_chain, excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    frequency = np.linspace(0.05, 0.5, 7)
    whole, without = (solve_spectral(modes, excitation, frequency, radius=radius) for radius in (True, False))
    np.testing.assert_array_equal(without.deflection, whole.deflection)
    assert np.isnan(without.spectral_radius).all() and "radius" not in without.message
    assert "largest spectral radius" in whole.message and without.converged.all()


def test_too_few_harmonics_are_told_of_converged_speeds_only():
    response = SimpleNamespace(
        mesh_frequency=np.array([10.0, 20.0, 30.0]),
        converged=np.array([False, True, True]),
        spectral_radius=np.array([1.2, 0.6, 0.4]),
        tail=np.array([0.9, 0.3, 0.2]),
        lowest_force=np.array([np.nan, 1.0, 0.5]),
        method=("fixed point",) * 3,
    )
    text = spectral.joint_message([response])
    assert "fixed point at 2, direct solution at 0; largest spectral radius 1.2 at 10 Hz" in text
    assert "did not converge at 1 speeds, first at 10 Hz with spectral radius 1.2" in text
    assert "at 2 speeds: the upper half holds 0.09 of the energy at 20 Hz" in text
    assert "negative" not in text


@pytest.mark.parametrize("count", [1, 2, 8])
def test_radius_of_few_unknowns_is_exact(geared_chain, chain_excitation, count):
    """As many steps as there are real unknowns: 2 (2 H + 1) of two meshes."""
    excitation = chain_excitation(0.3)
    modes = undamped_modes(geared_chain, [1.0, 1.4], damping_ratio=0.05)
    problem = full_problem(modes, excitation, np.linspace(0.02, 0.4, 25))
    few = spectral.HarmonicProblem(
        problem.receptance[..., : count + 1],
        Product(problem.product.factor[:, : count + 1]),
        problem.source[..., : count + 1],
    )
    np.testing.assert_allclose(spectral.spectral_radius(few), exact_radius(few), rtol=1e-6)


def test_a_mesh_later_in_time_repeats_the_first_one_whatever_its_phase():
    """``x(t - 0.37 T)`` of a signal with any phases, and of one whose first harmonic is missing."""
    h = np.arange(5)
    for signal in ([3.0, 1j, 0.4 - 0.3j, 0.0, 0.1], [2.0, 0.0, -0.7 + 0.2j, 0.0, 0.3j]):
        later = np.exp(-2j * np.pi * 0.37 * h) * signal
        twins = spectral.find_twins((np.array([signal, later]),))
        assert twins.leaders.tolist() == [0] and twins.group.tolist() == [0, 0]
        np.testing.assert_allclose(twins.shift[1] * signal, later, atol=1e-14)


def test_twins_differ_by_rounding_of_the_largest_receptance():
    """Not of that at a third mesh which they hardly move."""
    wave = np.array([0.1, 0.05, 0.02j])
    signals = np.array([wave, wave, 0.5 * wave])
    signals[2, 2] = 0.03
    twins = spectral.find_twins((signals,))
    for off, same in ((1e-10, True), (1e-7, False)):
        residual = np.array([[1.0 + off, 0.3, 1e-4], [0.3, 1.0, 1e-4], [1e-4, 1e-4, 2.0]])
        still = SimpleNamespace(
            frequency=np.zeros(1),
            damping_ratio=np.zeros(1),
            mesh_deflection=np.zeros((3, 1)),
            residual=residual,
        )
        assert spectral._alike(still, twins, 1.0) is same


@pytest.mark.parametrize("step", [0.0, 1 / 3])
def test_speeds_of_different_harmonics_together_equal_those_alone(planet_set, planet_excitation, step):
    """Excitation and response end at each speed's own harmonics; identical planets in phase or in turn."""
    phase = step * np.arange(3)
    excitation = planet_excitation(np.concatenate([phase, phase + 0.25]), depth=0.3)
    modes = undamped_modes(planet_set(), excitation.stiffness.mean(axis=1), damping_ratio=0.05)
    frequency, excited = np.linspace(0.05, 0.5, 7), np.array([9, 3, 5, 5, 2, 9, 4])
    options = {"tolerance": 1e-11}
    together = solve_spectral(
        modes, excitation, frequency, excitation_harmonics=excited, response_harmonics=3 * excited, **options
    )
    for i, (f, h) in enumerate(zip(frequency, excited)):
        alone = solve_spectral(modes, excitation, f, excitation_harmonics=h, response_harmonics=3 * h, **options)
        for name in ("deflection", "force", "modal"):
            found, expected = getattr(together, name)[i], getattr(alone, name)[0]
            assert not found[..., 3 * h + 1 :].any()
            size = np.abs(expected).max()
            np.testing.assert_allclose(found[..., : 3 * h + 1], expected, atol=1e-9 * size, err_msg=name)
        assert together.tail[i] == pytest.approx(alone.tail[0], abs=1e-9)


def test_batches_hold_speeds_of_similar_numbers_of_harmonics():
    random = np.random.default_rng(1)
    highest, frequency = random.integers(0, 600, 400), random.uniform(10.0, 1e3, 400)
    batches = spectral._batches(frequency, highest)
    np.testing.assert_array_equal(np.sort(np.concatenate(batches)), np.arange(400))
    sizes = [highest[batch] + 1 for batch in batches]
    assert all(size.max() <= 3 * size.min() and size.sum() <= 4000 for size in sizes)
    assert [len(batch) for batch in spectral._batches(np.ones(3), np.array([7, 7, 7]))] == [3]
