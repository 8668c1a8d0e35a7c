"""The model of a pair: its frequencies in closed form, its flanks that part."""

import math
from dataclasses import replace

import numpy as np
import pytest
from trains.pair.test_stages import BEARINGS, gears, pair_case, solved

from femgear.case.gear_set import line_play
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.solvers.time.transient import solve_transient
from femgear.system.system import MeshExcitation
from femgear.trains.impacts.model import ImpactPair
from femgear.trains.pair.model import pair_dynamic_model, pair_model, separating_pair

pytestmark = pytest.mark.usefixtures("coarse_states")

STIFFNESS, TAU = 4e8, np.arange(512) / 512


def one_mass(wave, load=200.0, play=0.0):
    """Torsional pair, its equivalent mass [kg], modes and an excitation whose unloaded flanks are ideal."""
    case = pair_case(**{"operation.torque": f"{load} N m"})
    model, radii = pair_model(case, gears()), [gear.base_radius for gear in gears().gears]
    mass = 1.0 / sum(r * r / one.inertia for r, one in zip(radii, (case.gear_1, case.gear_2)))
    k = STIFFNESS * (1.0 + wave * np.cos(2.0 * np.pi * TAU))[None]
    force = np.full_like(k, load / radii[0])
    excitation = MeshExcitation(k, force / k, force, backlash=np.array([play]))
    return model, mass, undamped_modes(model.system, [STIFFNESS], damping_ratio=0.05), excitation


def test_natural_frequency_in_closed_form():
    _, mass, modes, _ = one_mass(0.0)
    assert modes.frequency[0] == 0.0
    assert modes.frequency[1] == pytest.approx(math.sqrt(STIFFNESS / mass) / (2.0 * math.pi), rel=1e-9)


def test_bearings_that_hardly_give_way_leave_the_torsional_mode():
    stiff = {key: "1e14 N/m" for key in BEARINGS}
    found = [
        undamped_modes(pair_model(c, gears()).system, [STIFFNESS], damping_ratio=0.05)
        for c in (pair_case(), pair_case(**stiff))
    ]
    assert found[1].frequency[1] == pytest.approx(found[0].frequency[1], rel=1e-4)


def test_one_degree_of_freedom_under_a_small_error():
    """``m x'' + 2 zeta sqrt(k m) x' + k (x - e) = F``: the transfer function in closed form."""
    _, _, modes, excitation = one_mass(0.0)
    error = 1e-9 * np.cos(2.0 * np.pi * TAU)
    excitation = replace(excitation, deflection=excitation.deflection + error)
    hertz = modes.frequency[1] * np.array([0.3, 0.95, 1.0, 2.0])
    response = solve_spectral(modes, excitation, hertz, excitation_harmonics=2, response_harmonics=4)
    ratio = hertz / modes.frequency[1]
    expected = 1e-9 / (1.0 - ratio**2 + 0.1j * ratio)
    np.testing.assert_allclose(response.deflection[:, 0, 1], expected, rtol=1e-9)


@pytest.mark.parametrize("ratio", [0.5, 0.95, 1.1])
def test_flanks_that_part_as_in_the_dimensionless_pair(ratio):
    """Stiffness waves alone: both models damp the same velocity."""
    model, _, modes, excitation = one_mass(0.15, play=60e-6)
    problem = separating_pair(model, modes, excitation, 60)
    options = {"harmonics": 20, "samples": 1024, "stability": False}
    unit = 30e-6 * STIFFNESS
    there = ImpactPair(damping_ratio=0.05, load=excitation.force[0, 0] / unit, stiffness=(0.15,))
    known = solve_harmonic_balance(there.problem(ratio), 1.0, **options)
    # a length of zero is the end of the play here, its middle there
    start = known.deflection * 30e-6
    start = start - 30e-6 * np.eye(1, start.shape[1])
    omega = ratio * 2.0 * math.pi * modes.frequency[1]
    found = solve_harmonic_balance(problem, omega, start=start, **options)
    assert found.converged and known.converged
    np.testing.assert_allclose(found.force / unit, known.force, atol=1e-6 * abs(known.force).max())
    np.testing.assert_allclose(found.deflection, start, atol=1e-6 * abs(start).max())
    assert (known.at(2 * np.pi * TAU).min() < 1.0) == (ratio == 0.95)


@pytest.mark.slow
def test_contact_loss_against_integration_in_time():
    _, modes, dynamics = solved()
    s = 2
    assert dynamics.response.method[s] == "harmonic balance" and 0.5 < dynamics.motion.drive[s] < 0.9
    count = 8
    problem = separating_pair(modes.model, modes.modes, modes.excitation, count)
    hertz = float(dynamics.response.mesh_frequency[s])
    start = np.zeros((1, 61), complex)
    start[:, :21] = dynamics.motion.deflection[s, :, :21]
    found = solve_harmonic_balance(problem, 2 * np.pi * hertz, harmonics=60, start=start)
    times = np.arange(0, 40 * 64 + 1) / (64 * hertz)
    q = np.zeros((2, 2))
    q[0] = modes.model.system.W[:, 0] * found.at(0.0)[0] / (modes.model.system.W[:, 0] ** 2).sum()
    motion = solve_transient(problem, 2 * np.pi * hertz, times, start=(q[0], q[1]), method="DOP853")
    x = motion.displacement[-65:] @ modes.model.system.W[:, 0]
    expected = found.at(times[-65:])[:, 0]
    assert found.stable
    np.testing.assert_allclose(x, expected, atol=2e-3 * np.ptp(expected))


def test_the_model_for_other_programs_has_torques_at_its_ends_and_flanks_that_part():
    case, modes, _ = solved()
    model = pair_dynamic_model(case, modes.gears, modes.model, modes.modes, modes.excitation)
    torque = case.operation.torque
    assert [port.name for port in model.modal.inputs] == ["torque on gear 1", "torque on gear 2"]
    assert model.modal.nominal == pytest.approx([torque, torque * 36 / 24], rel=1e-9)
    assert model.ratios[:2] == pytest.approx([1.0, -24 / 36], rel=1e-9) and model.separates
    assert model.mesh_rate == pytest.approx(24 / (2.0 * np.pi), rel=1e-15)
    # of held gears the transmission error is the deflection
    seen = [port.name for port in model.modal.outputs].index("transmission error")
    np.testing.assert_allclose(model.modal.output_rows[seen, 1:], model.modal.mesh_rows[0, 1:], rtol=1e-9)
    assert model.excitation.backlash == pytest.approx([line_play(case)], rel=1e-12)
