"""The same numbers by textbook routes, side by side."""

import conventional
import numpy as np
import pytest

HARMONICS = {"excitation_harmonics": 6, "harmonics": 12}


@pytest.mark.benchmark(group="Compliance of the planet's flanks")
def test_one_sector(benchmark, reference):
    from femgear.contact.bodies import flank_compliance

    sector = reference.sectors.planet
    arguments = (sector.grid, sector.gear, reference.material, sector.stiffness)
    benchmark.pedantic(flank_compliance, args=arguments, rounds=5, warmup_rounds=1)
    benchmark.extra_info.update(title="cyclic symmetry, one sector (femgear)", note="all flanks of all 40 teeth")


@pytest.mark.benchmark(group="Compliance of the planet's flanks")
def test_whole_gear(benchmark, reference):
    sector = reference.sectors.planet
    arguments = (sector.grid, reference.material, sector.gear.face_width, sector.gear.teeth, 49)
    rows, _ = benchmark.pedantic(conventional.whole_body_columns, args=arguments, rounds=1).shape
    note = f"49 load cases on one flank, {rows} unknowns"
    benchmark.extra_info.update(title="whole gear: assemble, factor, solve", note=note)


@pytest.fixture(scope="module")
def problems(reference):
    return conventional.contact_problems(
        reference.gears, reference.bodies, sun_torque=reference.sun_torque, positions=8
    )


@pytest.mark.benchmark(group="Contact of all meshes, 8 positions without start values")
def test_active_set(benchmark, problems):
    from femgear.contact.solve import solve_contact

    benchmark.pedantic(lambda: [solve_contact(*p) for p in problems], rounds=5, warmup_rounds=1)
    benchmark.extra_info.update(title="active set (femgear)", note=f"{len(problems[0][1])} pressure cells")


@pytest.mark.benchmark(group="Contact of all meshes, 8 positions without start values")
def test_daqp(benchmark, problems):
    from femgear.contact.solve import solve_contact

    loads = benchmark.pedantic(lambda: [conventional.contact_by_daqp(*p) for p in problems], rounds=3)
    difference = max(np.abs(solve_contact(*p).loads - other).max() / other.max() for p, other in zip(problems, loads))
    note = f"loads differ by {difference:.0e} of the largest"
    benchmark.extra_info.update(title="general quadratic program (daqp)", note=note)


@pytest.mark.benchmark(group="Periodic response at one speed (700 Hz)")
def test_mesh_unknowns(benchmark, reference):
    from femgear.solvers.periodic.spectral import solve_spectral

    result = reference.modes
    basis = conventional.without_residual(result.modes)
    options = {"excitation_harmonics": 6, "response_harmonics": 12, "method": "direct"}
    arguments = (basis, result.excitation, 700.0)
    benchmark.pedantic(solve_spectral, args=arguments, kwargs=options, rounds=9, warmup_rounds=1)
    benchmark.extra_info.update(
        title="unknowns on the meshes (femgear)",
        note="all harmonics of the 6 meshes, spectral radius included",
    )


@pytest.mark.benchmark(group="Periodic response at one speed (700 Hz)")
def test_modal_unknowns(benchmark, reference):
    from femgear.solvers.periodic.spectral import solve_spectral

    result = reference.modes
    basis = conventional.without_residual(result.modes)
    arguments = (basis, result.excitation, 700.0)
    found = benchmark.pedantic(
        conventional.modal_harmonic_balance, args=arguments, kwargs=HARMONICS, rounds=5, warmup_rounds=1
    )
    own = solve_spectral(*arguments, excitation_harmonics=6, response_harmonics=12, method="direct")
    difference = np.abs(own.deflection[0] - found).max() / np.abs(found).max()
    size = len(basis.frequency) * (2 * HARMONICS["harmonics"] + 1)
    note = f"{size} complex unknowns; deflections differ by {difference:.0e} of the largest"
    benchmark.extra_info.update(title="all modal coordinates and harmonics", note=note)
