"""The published wind turbine sets: frequencies, weight, wedging, clearance, weight with mesh stiffness."""

from dataclasses import replace

import numpy as np
import pytest
from published.wind_turbine import (
    bearing_problem_a,
    drive_reduction,
    gravity_problem_b,
    wind_turbine_a,
    wind_turbine_b,
)
from published.wind_turbine_response import (
    bearing_history,
    contact_shares,
    member_rms,
    resonance,
    sweep_rms,
    wedging_map,
    wedging_onset,
    weight_branch,
)

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.stroboscopic import sweep_response
from femgear.stages.lumped_set import gear_set_modes
from validation import nrel


def solved(problem, hertz, harmonics=9, **options):
    """Balanced motion at a frequency of the weight; no test here asks for its stability."""
    found = solve_harmonic_balance(
        problem,
        2 * np.pi * hertz,
        harmonics=harmonics,
        reduction=drive_reduction(problem),
        stability=False,
        **options,
    )
    assert found.converged, found.message
    return found


@pytest.mark.slow
def test_quick_validation_rows_pass():
    rows = (*nrel.frequencies(), *nrel.linear_peak())
    assert [row for row in rows if row.verdict not in ("passes", "information")] == []
    assert sum(row.verdict == "passes" for row in rows) == 8


def test_set_b_is_the_one_of_the_mode_table():
    found = gear_set_modes(wind_turbine_b()).frequency
    np.testing.assert_allclose(found[[0, 2, 3, 5]], [40.761, 69.563, 156.869, 302.710], rtol=1e-5)
    # exchanged supports: nothing but the reading differs
    printed = wind_turbine_b(as_printed=True)
    assert (printed.ring.support, printed.carrier.support) == (126e6, 4e9)


def test_readings_of_set_a_differ_in_inertia_only():
    ours, other = wind_turbine_a(), wind_turbine_a(reduced_inertia=False)
    assert ours.planet.inertia == pytest.approx(3.2 * (0.2002 * np.cos(np.radians(24.6))) ** 2)
    assert other.planet.inertia == 3.2 and other.ring.mass == ours.ring.mass
    assert max(map(abs, ours.closure)) < 1e-12
    with pytest.raises(CaseError, match="pressure angle"):
        wind_turbine_a(pressure_angle=24.6)


@pytest.mark.parametrize(("clearance", "reference"), [(0.0, 134.7), (None, 28.2)])
def test_ring_resonance_without_clearance(clearance, reference):
    problem = bearing_problem_a(clearance)
    limits = (reference - 8.0, reference + 8.0)
    branch = weight_branch(problem, limits, harmonics=1, largest=0.05)
    hertz, _ = resonance(branch, member_rms(problem, branch.solutions, "ring")[:, 0])
    assert hertz == pytest.approx(reference, rel=5e-3)


def test_teeth_wedge_only_on_their_own_lines():
    frequency, shares = 48.0, []
    for own in (True, False):
        problem = gravity_problem_b(own_lines=own)
        near = solved(problem, 36.0, harmonics=3)
        for hertz in np.arange(37.0, frequency + 0.5, 1.0):
            near = solved(problem, hertz, harmonics=3, start=near)
        shares.append(contact_shares(problem, near))
        rms = member_rms(problem, [near], "carrier")[0]
        # equal planets: the orbit looks the same from every planet
        assert rms[0] == pytest.approx(rms[1], rel=1e-4)
    assert shares[0][6:].max() > 0.0 and np.all(shares[0][:6] == 1.0)
    assert np.all(shares[1][:6] == 1.0) and len(shares[1]) == 6


def test_other_sense_of_turning_is_the_mirror_image_of_the_other_torque():
    rms = []
    for problem in (gravity_problem_b(driven=False), gravity_problem_b(torque=-180e3)):
        # 36.5 Hz: wedging has begun
        found = solved(problem, 36.5, harmonics=5)
        assert contact_shares(problem, found)[6:].max() > 0.0
        rms.append(member_rms(problem, [found], "carrier")[0, 0])
    assert rms[0] == pytest.approx(rms[1], rel=1e-6)
    other = gravity_problem_b()
    away = member_rms(other, [solved(other, 36.5, harmonics=5)], "carrier")[0, 0]
    assert abs(away / rms[0] - 1.0) > 1e-5


def test_carrier_orbit_agrees_with_integration_while_teeth_wedge():
    problem = gravity_problem_b()
    near = solved(problem, 36.0, harmonics=9)
    for hertz in (37.5, 39.0, 41.0):
        near = solved(problem, hertz, start=near)
    lines = displacements(problem, near, reduction=drive_reduction(problem))
    omega = 2 * np.pi * 41.0
    state = lines.sum(axis=1).real, (lines @ (1j * near.line_frequency)).real
    sweep = sweep_response(problem, [omega], start=state, steps=500, most=25, tolerance=2e-4)
    assert contact_shares(problem, near)[6:].max() > 0.0
    rms = sweep_rms(problem, sweep, steps=500)[0]
    assert member_rms(problem, [near], "carrier")[0, 0] == pytest.approx(rms, rel=5e-3)


def test_planet_bearings_balance_the_torque():
    problem, phase = gravity_problem_b(), np.linspace(0, 2 * np.pi, 360, endpoint=False)
    force = bearing_history(problem, solved(problem, 1.0, harmonics=3), phase)
    # mean of the tangential forces: torque over 3 a, forwards from the carrier that is driven
    assert force[:, 1].mean(axis=1) == pytest.approx(180e3 / (3 * 0.294), rel=1e-6)


def test_play_left_follows_the_geometry():
    left, closed = nrel.play_left(150e-6, 150e-6)
    assert left == pytest.approx(closed, rel=1e-2)


def test_wedging_begins_at_the_same_clearance_at_any_speed():
    backlash, ratio = 150e-6, np.array([1.1, 1.15, 1.2, 1.25, 1.3])
    found = wedging_map((0.37, 10.0), ratio * backlash, backlash=backlash)
    assert np.all(found.drive == 1.0)
    np.testing.assert_allclose(wedging_onset(found), 1.25 * backlash)
    np.testing.assert_array_equal(found.back[:, :3], 0.0)


@pytest.mark.slow
def test_weight_and_mesh_stiffness_together_agree_with_integration():
    coarse = nrel.extended_errors(((3, 8, 3),), speed=36.0, steps=100)
    fine = nrel.extended_errors(((3, 8, 3), (3, 3, 3)), speed=36.0, steps=200)
    # what is left is the integration's, of second order; three mesh harmonics cannot show load over k(t)
    assert fine[0] < 0.3 * coarse[0] and fine[0] < 0.012 < 0.03 < fine[1]


@pytest.mark.slow
def test_small_plays_fold_below_the_resonance_too_and_keep_the_drive_flanks_closed():
    branch = weight_branch(problem := gravity_problem_b(backlash=161e-6, driven=False), (20.0, 95.0))
    folds = np.sort(branch.parameter[branch.folds]) / (2 * np.pi)
    assert folds == pytest.approx([37.06, 37.93, 40.75, 42.0, 52.19, 76.2], abs=0.1)
    shares = np.array([contact_shares(problem, one) for one in branch.solutions[::5]])
    assert shares[:, :6].min() == 1.0 and shares[:, 6:].max() > 0.2


def test_supported_suns_do_not_wedge_where_a_floating_one_does():
    """The sun's support takes the weight over, and the ring moves less than the play allows."""
    data, moved, touching = wind_turbine_a(), [], []
    for support in (100.0, 1e8):
        held = replace(data, sun=replace(data.sun, support=support))
        problem = bearing_problem_a(200e-6, backlash=150e-6, data=held)
        found = solved(problem, 0.37, harmonics=20, samples=1024)
        moved.append(np.sqrt(2) * member_rms(problem, [found], "ring")[0, 0])
        touching.append(contact_shares(problem, found)[6:12].max())
    assert moved == pytest.approx([205e-6, 131e-6], rel=0.01)
    assert touching[0] == pytest.approx(0.09, abs=0.01) and touching[1] == 0.0
