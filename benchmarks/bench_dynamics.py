"""Nonlinear and linear dynamics of the 18-coordinate planetary set: harmonic balance beside integration."""

from functools import cache
from time import process_time

import numpy as np
import planet_train as train
import pytest
from table import growth

# time of one process on one core: what else the machine does must not count
pytestmark = pytest.mark.benchmark(timer=process_time)

SETTLED = "Settled motion of the 18-dof set with contact loss, damping {:.0%}"
GROWTH = "One harmonic balance after one reduction, over the degrees of freedom"
SPEEDS = "Dynamics and housing of the reference set, over the number of speeds from 100 to 3000 rpm"
DIAMETERS = "Modal stage of the reference set, over the nodal diameters of the ring"
QUESTIONS = "Questions to the 18-dof set"
FASTER = 30.0
"""By how much harmonic balance must be faster than integration in time of the same accuracy."""

# harmonics and samples of harmonic balance, by tolerance
BALANCE = {1e-3: (4, 128), 1e-5: (16, 2048)}
# steps a period of average acceleration, tolerance and periods of LSODA: the cheapest that get there
NEWMARK = {(0.05, 1e-3): 200, (0.03, 1e-3): 200, (0.05, 1e-5): 1600, (0.03, 1e-5): 1600}
MODAL = {(0.05, 1e-3): 200, (0.03, 1e-3): 50, (0.05, 1e-5): 1600, (0.03, 1e-5): 800}
ADAPTIVE = {
    (0.05, 1e-3): (1e-7, 40),  # with 1e-6 rounding alone moves its error by half
    (0.03, 1e-3): (1e-6, 142),
    (0.05, 1e-5): (1e-8, 160),
    (0.03, 1e-5): (1e-8, 320),
}
CASES = [(ratio, tolerance) for ratio in (0.05, 0.03) for tolerance in (1e-3, 1e-5)]
case_of = pytest.mark.parametrize(("ratio", "tolerance"), CASES)


@cache
def problem(ratio):
    return train.planet_train(ratio)


@cache
def target(ratio):
    return train.shot(problem(ratio))


@pytest.fixture(scope="module")
def medians():
    """Times that others are compared with."""
    return {}


def record(benchmark, title, note="", limit=None):
    """Notes of a row; a promised time is also a test."""
    benchmark.extra_info.update(title=title, note=note, limit=limit)
    if limit is not None and benchmark.stats is not None:
        assert benchmark.stats.stats.median < limit, f"{title}: {benchmark.stats.stats.median:.2f} s"


def beside_balance(benchmark, medians, case, title, note):
    """A row of an integration in time: how many times the time of harmonic balance."""
    if benchmark.stats is not None and case in medians:
        times = benchmark.stats.stats.median / medians[case]
        note += f"; {times:.0f} times harmonic balance"
        assert times > FASTER, f"{title}: {note}"
    record(benchmark, title, note)


@case_of
def test_harmonic_balance(benchmark, medians, ratio, tolerance):
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance

    benchmark.group = SETTLED.format(ratio)
    harmonics, samples = BALANCE[tolerance]
    options = {"harmonics": harmonics, "samples": samples, "stability": False}
    found = benchmark.pedantic(
        solve_harmonic_balance, args=(problem(ratio), train.OMEGA), kwargs=options, rounds=21, warmup_rounds=2
    )
    error = target(ratio).error(found.deflection)
    assert found.converged and error <= tolerance
    if benchmark.stats is not None:
        medians[ratio, tolerance] = benchmark.stats.stats.median
    note = f"error {error:.0e}; {harmonics} harmonics, {samples} samples, reduction included"
    record(benchmark, f"harmonic balance (femgear), lines to {tolerance:g}", note)


def step_through(benchmark, medians, case, steps, method):
    ratio, tolerance = case
    benchmark.group = SETTLED.format(ratio)
    options = {"steps": steps, "most": 600, "method": method}
    error, periods = benchmark.pedantic(
        train.settle_by_steps,
        args=(problem(ratio), target(ratio), tolerance),
        kwargs=options,
        rounds=3 if tolerance > 1e-4 else 1,
    )
    assert error <= tolerance, f"error {error:.2e} after {periods} periods"
    note = f"error {error:.0e}; {periods} periods of {steps} steps"
    beside_balance(benchmark, medians, case, f"{method}, lines to {tolerance:g}", note)


@case_of
def test_average_acceleration(benchmark, medians, ratio, tolerance):
    step_through(benchmark, medians, (ratio, tolerance), NEWMARK[ratio, tolerance], "average acceleration")


@case_of
def test_modal_steps(benchmark, medians, ratio, tolerance):
    step_through(benchmark, medians, (ratio, tolerance), MODAL[ratio, tolerance], "modal")


@case_of
def test_adaptive_integration(benchmark, medians, ratio, tolerance):
    benchmark.group = SETTLED.format(ratio)
    local, periods = ADAPTIVE[ratio, tolerance]
    options = {"method": "LSODA", "tolerance": local, "periods": periods}
    error, change = benchmark.pedantic(
        train.settle_adaptively,
        args=(problem(ratio), target(ratio)),
        kwargs=options,
        rounds=3 if tolerance > 1e-4 else 1,
    )
    assert max(error, change) <= tolerance, f"error {error:.2e}, change {change:.2e}"
    note = f"error {error:.0e}; {periods} periods, local tolerance {local:g}"
    beside_balance(benchmark, medians, (ratio, tolerance), f"SciPy's LSODA, lines to {tolerance:g}", note)


@pytest.mark.benchmark(group=GROWTH, timer=process_time)
@pytest.mark.parametrize("links", [0, 9, 99])
def test_growth_over_degrees_of_freedom(benchmark, medians, links):
    from femgear.solvers.linear.receptance import reduce_problem
    from femgear.solvers.periodic.equations import harmonic_balance
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance

    longer = train.with_chains(problem(0.05), links, damping=0.05)
    begin = process_time()
    reduction = reduce_problem(longer)
    spent = process_time() - begin
    options = {"harmonics": 8, "reduction": reduction, "stability": False}
    found = benchmark.pedantic(
        solve_harmonic_balance, args=(longer, train.OMEGA), kwargs=options, rounds=21, warmup_rounds=2
    )
    assert found.converged and found.at(np.linspace(0, 1 / train.MESH_FREQUENCY, 100)).min() < 0.0
    unknowns = harmonic_balance(longer, harmonics=8, reduction=reduction).size
    dofs, grown = len(longer.system.M), ""
    if benchmark.stats is not None:
        start = medians.setdefault("growth", benchmark.stats.stats.median)
        times = benchmark.stats.stats.median / start
        grown = f"; {times:.2f} times the shortest"
        assert times < 2.0, f"{dofs} degrees of freedom: {grown}"
    note = f"{unknowns} unknowns, {found.iterations} iterations; all modes, reduction {spent:.2g} s{grown}"
    record(benchmark, f"{dofs} degrees of freedom", note)


@pytest.mark.benchmark(group=SPEEDS, timer=process_time)
@pytest.mark.parametrize("count", [250, 1000, 4000])
def test_growth_over_speeds(benchmark, reference, medians, count):
    from dataclasses import replace

    from femgear.case.dependencies import modal_entries, static_entries
    from femgear.case.quantities import RPM
    from femgear.trains.elastic.stages import dynamics_parts, solve_housing

    speeds = tuple((np.linspace(100.0, 3000.0, count) * RPM).tolist())
    operation = reference.case.operation.model_copy(update={"speeds": speeds})
    case = reference.case.model_copy(update={"operation": operation})
    modes = replace(reference.modes, entries=modal_entries(case))
    static = replace(reference.static, entries=static_entries(case))

    def heard():
        parts = dynamics_parts(case, static, modes)
        return [solve_housing(part, found).dataset() for part, found in parts]

    found = benchmark.pedantic(heard, rounds=3 if count < 4000 else 1, warmup_rounds=1 if count < 4000 else 0)
    assert sum(one.sizes["speed"] for one in found) == count
    parts = f"in {len(found)} parts, with Floquet verdicts, without files"
    record(benchmark, f"{count} speeds", parts + growth(benchmark, medians, SPEEDS, count))


@pytest.mark.benchmark(group=DIAMETERS, timer=process_time)
@pytest.mark.parametrize("most", [13, 26, 52])
def test_growth_over_nodal_diameters(benchmark, reference, medians, most, monkeypatch):
    from femgear.trains.elastic import stages

    monkeypatch.setattr(stages, "max_nodal_diameter", lambda case: most)
    args = (reference.case, reference.static)
    found = benchmark.pedantic(stages.solve_modes, args=args, rounds=5, warmup_rounds=1)
    assert found.max_diameter == most
    note = f"{len(found.model.system.M)} degrees of freedom" + growth(benchmark, medians, DIAMETERS, most)
    record(benchmark, f"up to {most} nodal diameters", note)


def ask(benchmark, title, question, note, *, rounds=3, limit=None):
    """One row of the questions; ``note`` is given the answer."""
    found = benchmark.pedantic(question, rounds=rounds, warmup_rounds=1 if rounds > 1 else 0)
    record(benchmark, title, note(found), limit)
    return found


question_group = pytest.mark.benchmark(group=QUESTIONS, timer=process_time)


@question_group
def test_branch(benchmark):
    from femgear.solvers.continuation.branches import frequency_response_curve
    from femgear.solvers.continuation.corrector import StepOptions

    # the default step needs 70 points for this range
    options = StepOptions(largest=0.0135)
    limits = tuple(2.0 * np.pi * np.array([7800.0, 6200.0]))

    def follow():
        return frequency_response_curve(problem(0.05), limits, harmonics=8, options=options)

    found = ask(
        benchmark,
        "branch, 6.2 to 7.8 kHz, 8 harmonics, with stability and radius",
        follow,
        lambda b: f"{len(b.parameter)} points, {len(b.folds)} folds, {np.mean(b.stable):.0%} stable",
        rounds=1,
        limit=20.0,
    )
    assert len(found.parameter) >= 500 and found.complete and found.converged.all() and all(found.verdicts)


@question_group
def test_solution_with_verdict(benchmark):
    from femgear.solvers.periodic.harmonic_balance import periodic_response

    found = ask(
        benchmark,
        "one periodic solution, 8 harmonics, with fixed-point radius and stability",
        lambda: periodic_response(problem(0.05), train.OMEGA, harmonics=8),
        lambda r: f"radius {r.spectral_radius:.3f}, largest multiplier {abs(r.verdict.multipliers[0]):.4f}",
        rounds=5,
    )
    assert found.stable


@question_group
def test_two_base_frequencies(benchmark):
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.system.fourier import side_bands

    set_, orders = train.two_base_train(0.05), side_bands(2, 8, 2)
    omega = [train.OMEGA / 108.0, train.OMEGA]
    found = ask(
        benchmark,
        "two base frequencies: weight on the turning carrier",
        lambda: solve_harmonic_balance(set_, omega, orders=orders, stability=False),
        lambda s: f"{len(s.orders)} lines, {s.iterations} iterations",
    )
    assert found.converged


@question_group
def test_shooting(benchmark):
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.solvers.periodic.shooting import solve_shooting

    start = train.state_at_zero(problem(0.05), solve_harmonic_balance(problem(0.05), train.OMEGA, harmonics=8))
    found = ask(
        benchmark,
        "shooting from the solution of harmonic balance",
        lambda: solve_shooting(problem(0.05), train.OMEGA, start=start),
        lambda s: f"start and end differ by {s.solution.residual:.0e}; multipliers included",
    )
    assert found.solution.converged and found.stable


@question_group
def test_transient(benchmark):
    from femgear.solvers.time.transient import solve_transient

    times, start = np.linspace(0.0, 100 / train.MESH_FREQUENCY, 2001), train.static_start(problem(0.05))
    found = ask(
        benchmark,
        "transient of 100 mesh periods, average acceleration",
        lambda: solve_transient(problem(0.05), train.OMEGA, times, start=start, step=1 / train.MESH_FREQUENCY / 200),
        lambda r: f"{r.steps} steps",
    )
    assert found.converged


@question_group
def test_sweep_with_jumps(benchmark):
    from femgear.solvers.time.stroboscopic import sweep_up_and_down

    speeds = 2.0 * np.pi * np.linspace(6200.0, 7000.0, 9)
    options = {"steps": 100, "tolerance": 1e-4, "most": 300}
    up, down = ask(
        benchmark,
        "sweep up and down, 9 frequencies each way, 100 steps a period",
        lambda: sweep_up_and_down(problem(0.05), speeds, **options),
        lambda r: (
            f"{r[0].periods.sum() + r[1].periods.sum()} periods, {np.sum(~r[0].settled)} and "
            f"{np.sum(~r[1].settled)} frequencies where nothing settles"
        ),
        rounds=1,
    )
    # downwards the motion stays on the upper part of the branch, which then becomes quasi-periodic
    assert up.settled.all() and 0 < np.sum(~down.settled) < 4 and len(up.jumps()) == 1


@question_group
def test_poincare_section(benchmark):
    from validation.reference.sections import stroboscopic_section

    found = ask(
        benchmark,
        "stroboscopic section: 100 points after 100 periods of 100 steps",
        lambda: stroboscopic_section(problem(0.05), train.OMEGA, steps=100, start=train.static_start(problem(0.05))),
        lambda s: f"repeats after {s.repeats_after()} period",
    )
    assert found.repeats_after() == 1


@question_group
@pytest.mark.parametrize("route", ["direct", "modal"])
def test_frequency_response(benchmark, route):
    from femgear.solvers.linear.modal import undamped_modes
    from femgear.solvers.linear.receptance import modal_response
    from validation.reference.frequency_response import direct_response

    system, k = problem(0.05).system, problem(0.05).reference
    frequency, W = np.linspace(50.0, 12000.0, 2000), system.W
    modes = undamped_modes(system, k)
    routes = {
        "direct": lambda: direct_response(system, frequency, W, W.T, mesh_stiffness=k),
        "modal": lambda: modal_response(system, modes, frequency, W, W.T),
    }
    note = "6 inputs, 6 outputs"
    found = ask(benchmark, f"linear frequency response at 2000 frequencies, {route}", routes[route], lambda _: note)
    np.testing.assert_allclose(found, routes["direct"](), atol=1e-9 * np.abs(found).max())


@question_group
def test_campbell_diagram(benchmark):
    from published.planetary_sets import lin_parker_set

    from femgear.solvers.linear.tracking import campbell_data
    from femgear.system.mesh_directions import gear_set_system

    data = lin_parker_set(3)
    found = ask(
        benchmark,
        "Campbell diagram of 31 carrier speeds",
        lambda: campbell_data(
            lambda speed: gear_set_system(data, carrier_speed=speed),
            np.linspace(0.0, 1000.0, 31),
            data.mesh_stiffness,
            orders=(108.0, 216.0),
        ),
        lambda c: f"{c.frequency.shape[1]} branches, {len(c.critical)} critical speeds",
    )
    assert found.frequency.shape == (31, 17)


@question_group
def test_stability_chart(benchmark):
    from femgear.solvers.stability.parametric import stability_chart

    frequency = 2.0 * np.pi * np.linspace(6000.0, 16000.0, 100)
    found = ask(
        benchmark,
        "stability chart of 100 x 100 cells over frequency and depth of k(t)",
        lambda: stability_chart(
            problem(0.05), train.mesh_stiffness(), frequency, np.linspace(0.0, 4.0, 100), tolerance=1e-4
        ),
        lambda c: f"{np.mean(~c.stable):.0%} unstable; monodromy to {c.error.max():.0e}",
        rounds=1,
    )
    assert 0.0 < np.mean(found.stable) < 1.0


@question_group
def test_spectral_speeds(benchmark):
    from femgear.solvers.linear.modal import undamped_modes
    from femgear.solvers.periodic.spectral import solve_spectral
    from femgear.system.system import MeshExcitation

    system, k = problem(0.05).system, problem(0.05).reference
    modes = undamped_modes(system, k)
    phase = 2.0 * np.pi * np.arange(64)[:, None] / 64
    stiffness = train.mesh_stiffness().at(phase).T
    none = np.zeros_like(stiffness)
    excitation = MeshExcitation(stiffness, none, none, np.full(6, 20e-6))
    found = ask(
        benchmark,
        "1000 speeds without contact loss, spectral",
        lambda: solve_spectral(
            modes, excitation, np.linspace(500.0, 6000.0, 1000), excitation_harmonics=3, response_harmonics=8
        ),
        lambda r: f"largest fixed-point radius {r.spectral_radius.max():.2f}",
    )
    assert found.converged.all()
