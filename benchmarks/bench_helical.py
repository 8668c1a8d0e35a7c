"""Forced response of the helical set to phased transmission errors: sum of modes beside direct solution."""

from functools import cache
from time import process_time

import numpy as np
import pytest
from stages import ROOT
from table import growth

GROUP = "Helical set of 42 dof: 2000 frequencies, 8 phasing cases, 4 harmonics"
SLICES = "Dynamics at two speeds of a helical set, over the slices of the face width"
LIMIT = 2.0
"""Seconds that the sum of modes may take."""
HERTZ = np.linspace(10.0, 15e3, 2000)


@cache
def inputs():
    """System, modes and errors (8, 8, 4): four tooth sums, two lags of the planets."""
    from published.planetary_sets import kahraman_set

    from femgear.gears.phasing import MeshPhasing, phase_factors
    from femgear.stages.lumped_set import gear_set_modes
    from femgear.system.mesh_directions import gear_set_system

    data = kahraman_set()
    cases = [MeshPhasing(z, 100 - z, (0, 25, 50, 75), lag=lag) for z in (28, 29, 30, 31) for lag in (0.0, 0.5)]
    error = 1e-6 * np.array([phase_factors(case, range(1, 5)).T for case in cases])
    return gear_set_system(data), gear_set_modes(data, damping_ratio=0.05), error


@pytest.fixture(scope="module")
def medians():
    return {}


@pytest.mark.benchmark(group=GROUP, timer=process_time)
def test_sum_of_modes(benchmark, medians):
    from femgear.solvers.linear.receptance import modal_error_response

    _, modes, error = inputs()
    found = benchmark.pedantic(modal_error_response, args=(modes, HERTZ, error), rounds=5, warmup_rounds=1)
    assert found.force.shape == (8, 2000, 4, 8)
    text = f"sum of {len(modes.frequency)} modes (femgear), mesh forces"
    benchmark.extra_info.update(title=text, limit=LIMIT)
    if benchmark.stats is not None:
        medians["modes"] = benchmark.stats.stats.median
        assert medians["modes"] < LIMIT


@pytest.mark.benchmark(group=GROUP, timer=process_time)
def test_direct(benchmark, medians):
    """One receptance from all meshes serves the eight cases."""
    from femgear.solvers.linear.receptance import modal_error_response
    from validation.reference.frequency_response import direct_response

    system, modes, error = inputs()
    k = modes.mesh_stiffness

    def solve():
        hertz = np.outer(HERTZ, np.arange(1, 5)).ravel()
        transfer = direct_response(
            system, hertz, system.W * k, system.W.T, mesh_stiffness=k, damping_ratio=0.05
        ).reshape(len(HERTZ), 4, len(k), len(k))
        deflection = np.einsum("fhoj,cjh->cfho", transfer, error, optimize=True)
        return k * (deflection - error.transpose(0, 2, 1)[:, None])

    force = benchmark.pedantic(solve, rounds=3, warmup_rounds=1)
    other = modal_error_response(modes, HERTZ, error).force
    away = np.abs(force - other).max() / np.abs(force).max()
    assert away < 1e-10
    note = f"forces differ by {away:.0e} of the largest"
    if benchmark.stats is not None and medians:
        ratio = benchmark.stats.stats.median / medians["modes"]
        note += f"; {ratio:.0f} times the sum of modes"
    benchmark.extra_info.update(title="dense solution at every frequency, mesh forces", note=note)


@pytest.mark.benchmark(group="Modes of the helical set of 42 dof", timer=process_time)
def test_modes(benchmark):
    from published.planetary_sets import kahraman_set

    from femgear.stages.lumped_set import gear_set_modes

    data = kahraman_set()
    found = benchmark.pedantic(gear_set_modes, args=(data,), rounds=9, warmup_rounds=1)
    kinds = {kind: found.kind.count(kind) for kind in sorted(set(found.kind))}
    note = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    benchmark.extra_info.update(title="matrices, modes and their kinds (femgear)", note=note)


@pytest.fixture(scope="module")
def helical():
    """Kahraman's train at two speeds, and its static solution, which slices do not change."""
    from femgear.trains.helical.stages import solve_helical_static
    from femgear.trains.reading import read_case, with_value

    case = read_case(ROOT / "cases" / "helical_30_20_70.toml")
    case = with_value(case, "operation.speeds", ["1000 rpm", "3000 rpm"])
    return case, solve_helical_static(case)


@pytest.mark.benchmark(group=SLICES, timer=process_time)
@pytest.mark.parametrize("slices", [5, 10, 20, 30])
def test_growth_over_slices(benchmark, helical, medians, slices):
    from femgear.trains.helical.stages import solve_helical_dynamics, solve_helical_modes
    from femgear.trains.reading import with_value

    case = with_value(helical[0], "helical.slices", slices)
    modes = solve_helical_modes(case, helical[1])
    found = benchmark.pedantic(solve_helical_dynamics, args=(case, modes), rounds=3, warmup_rounds=1)
    columns = found.response.deflection.shape[1]
    assert columns == 2 * found.modes.data.n_planets * slices
    note = f"{columns} springs, with Floquet verdicts" + growth(benchmark, medians, SLICES, slices)
    benchmark.extra_info.update(title=f"{slices} slices", note=note)
