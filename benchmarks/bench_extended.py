"""Weight and mesh frequency together: extended harmonic balance beside integration in time."""

from time import process_time

import numpy as np
import pytest

GROUP = "Wind turbine set B at 36 rpm, weight and k(t): one answer"
SPEED, TEETH = 36.0, 68
# carrier harmonics, mesh harmonics, side bands: those of NREL/CP-5000-55355, and those that k(t) asks for
LINES = {"the paper's lines": (100, 3, 8), "8 mesh harmonics": (3, 8, 3), "3 mesh harmonics": (3, 3, 3)}
STEPS = (100, 400)
"""Steps a mesh period: the first gives forces to 5 %, the second to 0.2 %."""


def frequency():
    return 2.0 * np.pi * SPEED / 60.0 * np.array([1.0, TEETH])


@pytest.fixture(scope="module")
def problem():
    from published.wind_turbine import extended_problem_b

    return extended_problem_b()


@pytest.fixture(scope="module")
def medians():
    return {}


@pytest.mark.benchmark(group=GROUP, timer=process_time)
@pytest.mark.parametrize("name", LINES)
def test_extended_harmonic_balance(benchmark, medians, problem, name):
    from published.wind_turbine import drive_reduction

    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.system.fourier import side_bands

    orders = side_bands(*LINES[name])
    options = {"orders": orders, "reduction": drive_reduction(problem), "stability": False}
    found = benchmark.pedantic(
        solve_harmonic_balance, args=(problem, frequency()), kwargs=options, rounds=5, warmup_rounds=1
    )
    assert found.converged
    if benchmark.stats is not None:
        medians[name] = benchmark.stats.stats.median
    benchmark.extra_info.update(title=f"harmonic balance, {name} {LINES[name]}", note=f"{len(orders)} lines")


@pytest.mark.benchmark(group=GROUP, timer=process_time)
@pytest.mark.parametrize("steps", STEPS)
def test_integration_of_two_turns(benchmark, medians, problem, steps):
    from femgear.solvers.time.transient import solve_transient

    turn = 60.0 / SPEED
    times = np.append(0.0, np.linspace(turn, 2.0 * turn, TEETH * 32, endpoint=False))
    options = {"method": "modal", "step": turn / (TEETH * steps)}
    found = benchmark.pedantic(solve_transient, args=(problem, frequency(), times), kwargs=options, rounds=3)
    assert np.all(np.isfinite(found.force))
    note = f"two turns of the carrier, {steps} steps a mesh period"
    if benchmark.stats is not None:
        ratios = [f"{benchmark.stats.stats.median / medians[name]:.0f}" for name in LINES if name in medians]
        note += f"; {', '.join(ratios)} times harmonic balance"
    benchmark.extra_info.update(title="integration in modal steps", note=note)
