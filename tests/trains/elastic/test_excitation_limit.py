"""How far the excitation reaches, and what is said where it ends too early."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.housing.orders import order_level
from femgear.housing.sensor import fixed_sensor_lines
from femgear.report.tables import pulling_meshes, pulls_of
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.static import solve_static
from femgear.trains.elastic.checks import dynamics_warnings
from femgear.trains.elastic.excitation_limit import HARMONICS, highest_excitation, limited
from femgear.trains.elastic.outputs import mesh_and_ring_outputs
from femgear.trains.elastic.stages import (
    solve_dynamics,
    solve_housing,
    solve_modes,
    solve_response,
    solve_runup,
)
from femgear.trains.reading import read_case, with_value, with_values

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def case():
    return with_value(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), "static.flank_elements", 8)


@pytest.fixture(scope="module")
def static(case):
    return solve_static(case)


@pytest.fixture(scope="module")
def steps():
    """Loaded state and ring models, which cases with other frequency limits share."""
    return Steps()


@pytest.fixture(scope="module")
def modes(case, static, steps):
    return solve_modes(case, static, steps=steps)


@pytest.fixture(scope="module")
def reference(case, static, modes):
    """Response and level of the case as it stands."""
    return levels(case, static, modes)


def levels(case, static, modes):
    dynamics = solve_dynamics(case, static, modes)
    return dynamics, order_level(solve_housing(case, dynamics).lines)


@pytest.mark.slow
def test_default_reaches_the_modes_of_the_meshes_and_the_level_has_converged(case, static, modes, reference, steps):
    """Also by hand: the level with a limit of twice the frequency that is found."""
    dynamics, found = reference
    meshes = modes.modes.frequency[modes.modes.frequency < 16e3].max()
    assert 14e3 < meshes < dynamics.excitation_limit.min() <= dynamics.excitation_limit.max() <= modes.reach
    assert np.abs(dynamics.level_change).max() < 1.0 and dynamics.findings == ()
    twice = with_value(case, "dynamics.up_to", f"{2 * modes.reach} Hz")
    _, wider = levels(twice, static, solve_modes(twice, static, steps=steps))
    # the basis of the second run reaches further, too
    change = 20 * np.log10(wider / found)
    assert np.abs(change).max() < 1.0
    assert change == pytest.approx(dynamics.level_change, abs=0.05)


def test_six_harmonics_are_warned_of_with_what_is_missing(case, static, modes, reference):
    six = with_value(case, "dynamics.mesh_harmonics", 6)
    dynamics, found = levels(six, static, modes)
    assert dynamics.excitation_limit == pytest.approx([540.0, 6696.0])
    _, full = reference
    missing = 20 * np.log10(full / found)
    assert missing[0] > 40.0 and missing[1] > 2.0
    # compared with the default reach, or with twice the harmonics where that is more
    assert dynamics.level_change == pytest.approx(missing, abs=0.05)
    (text,) = map(str, dynamics.findings)
    assert text.startswith("[W-EXCITATION] at 250 rpm the excitation ends at 540 Hz")
    assert f"{missing[0]:+.0f}" in text and "2 of the 2 speeds" in text


def test_a_limit_below_the_modes_of_the_meshes_is_warned_of(case, static, modes, steps):
    low = with_value(case, "dynamics.up_to", "8 kHz")
    basis = solve_modes(low, static, steps=steps)
    dynamics = solve_dynamics(low, static, basis)
    # what a study takes is what a run computes
    assert np.array_equal(solve_response(low, basis).deflection, dynamics.response.deflection)
    assert dynamics.excitation_limit == pytest.approx([88 * 90.0, 7 * 1116.0])
    # compared with the default, which reaches the modes of the meshes
    assert dynamics.compared_to == modes.reach > 16e3
    assert len(dynamics.findings) == 1 and np.nanmax(dynamics.level_change) > 1.0


def test_lines_end_at_the_frequency_and_at_what_the_record_carries(case):
    few = limited(case, [90.0, 1116.0, 30e3], 20e3)
    assert few.excitation.tolist() == [222, 17, 1]
    assert few.response.tolist() == [234, 29, 3]
    assert few.frequency == pytest.approx([222 * 90.0, 17 * 1116.0, 30e3])
    assert limited(case, [0.1], 20e3).excitation.tolist() == [HARMONICS]
    # however many speeds there are
    assert limited(case, np.linspace(90.0, 1116.0, 2000), 20e3).excitation[0] == 222
    given = limited(case, [90.0, 1116.0], 20e3, given=6)
    assert given.excitation.tolist() == [6, 6] and given.response.tolist() == [18, 18]


def test_speeds_too_slow_for_the_record_are_estimated_from_faster_ones(case, static, modes):
    """At 60 rpm 512 harmonics end at 11 kHz, below the modes of the meshes; twice as many by hand."""
    slow = with_value(case, "operation.speeds", ["60 rpm", "250 rpm"])
    dynamics, found = levels(slow, static, modes)
    assert dynamics.excitation_limit[0] == pytest.approx(512 * 21.6) and "at 60 rpm" in dynamics.findings[0].text
    assert np.abs(dynamics.level_change[1]) < 1.0
    wide = solve_spectral(modes.modes, modes.excitation, [21.6], excitation_harmonics=1041, response_harmonics=1053)
    field = mesh_and_ring_outputs(modes, wide)[1]
    lines = fixed_sensor_lines(field, 108, np.array([dynamics.speeds[0].carrier]), 0.0)
    missing = 20 * np.log10(order_level(lines)[0] / found[0])
    assert missing > 3.0 and dynamics.level_change[0] == pytest.approx(missing, abs=1.0)


def test_a_limit_that_excites_nothing_is_refused(case, static):
    with pytest.raises(CaseError) as caught:
        solve_modes(with_value(case, "dynamics.up_to", "1000 Hz"), static)
    assert caught.value.code == "E-RANGE" and "1116" in caught.value.limit


def test_the_reach_follows_meshes_speeds_and_the_case(case):
    assert highest_excitation(case, 5e3, 100.0) == 20e3
    assert highest_excitation(case, 16e3, 100.0) == 22.5e3
    assert highest_excitation(case, 5e3, 12e3) == 37.5e3
    assert highest_excitation(case, 90e3, 100.0) == 100e3
    # the basis reaches the default all the same, for the comparison
    assert highest_excitation(with_value(case, "dynamics.up_to", "3 kHz"), 16e3, 100.0) == 22.5e3
    assert highest_excitation(with_value(case, "dynamics.up_to", "30 kHz"), 16e3, 100.0) == 30e3


def test_results_of_another_case_are_refused_with_the_entries_that_differ(case, static, modes, reference, steps):
    """Every stage; entries on which a result does not depend may change."""
    dynamics, _ = reference
    for changes, stage, named in (
        ({"planet.bore_radius": "16 mm"}, lambda c: solve_modes(c, static), "planet.bore_radius (0.018)"),
        ({"operation.torque": "60 N m"}, lambda c: solve_modes(c, static), "operation.torque"),
        ({"set.pin_errors": [{"planet": 1, "radial": "3 um"}]}, lambda c: solve_modes(c, static), "set.pin"),
        ({"sun.mass": "0.3 kg"}, lambda c: solve_dynamics(c, static, modes), "sun.mass (0.22)"),
        ({"dynamics.up_to": "10 kHz"}, lambda c: solve_dynamics(c, static, modes), "dynamics.up_to"),
        ({"planet.bearing_stiffness": "1e8 N/m"}, lambda c: solve_dynamics(c, static, modes), "planet.bear"),
        ({"operation.speeds": ["90000 rpm"]}, lambda c: solve_dynamics(c, static, modes), "excitation up to"),
        ({"dynamics.damping_ratio": 0.02}, lambda c: solve_housing(c, dynamics), "dynamics.damping_ratio"),
        ({"operation.speeds": ["251 rpm"]}, lambda c: solve_housing(c, dynamics), "operation.speeds"),
    ):
        other = with_values(case, changes)
        with pytest.raises(CaseError) as caught:
            stage(other)
        assert caught.value.code == "E-OTHER-CASE" and named in str(caught.value)
        assert caught.value.remedy
    held = with_values(
        case, {"planet.bearing_stiffness": "1e8 N/m", "sun.mass": "0.3 kg", "housing.sensor_angle": "9 deg"}
    )
    solve_dynamics(held, static, solve_modes(held, static, steps=steps))
    solve_housing(with_value(case, "housing.sensor_angle", "9 deg"), dynamics)


def test_datasets_and_results_of_other_stages_are_refused(case, static, modes):
    for stage in (
        lambda: solve_modes(case, static.dataset()),
        lambda: solve_dynamics(case, static, static),
        lambda: solve_housing(case, modes),
    ):
        with pytest.raises(CaseError, match="is needed, not a") as caught:
            stage()
        assert caught.value.code == "E-TYPE" and "compute the stage" in caught.value.remedy


def test_a_pull_is_told_with_its_share_of_the_time():
    """1 + 2 cos(theta) kN is below zero for a third of the period; a mesh that just opens does not pull."""
    force = np.zeros((3, 2, 2), complex)
    force[..., 0], force[1, 1, 1], force[2, 0, 1] = 1e3, 2e3, 1.0005e3
    rpm, names = np.array([100.0, 200.0, 300.0]), ["one", "two"]
    (found,) = pulling_meshes(rpm, names, [pulls_of(force)])
    assert (found,) == tuple(pulling_meshes(rpm, names, [pulls_of(force[:2]), pulls_of(force[2:])]))
    assert found.code == "W-PULL" and "two pulls for" in found.text and "at 200 rpm" in found.text
    assert "up to 1 kN" in found.text and found.text.endswith("1 of the 3 speeds: 200 rpm")
    share = float(found.text.split("pulls for ")[1].split("%")[0])
    assert abs(share - 100 / 3) < 100 / 8 + 0.01  # samples a period: four times the harmonics and one
    assert list(pulling_meshes(rpm, names, [pulls_of(force[:1])])) == []


@pytest.mark.parametrize("torque", ["50 N m", pytest.param("-50 N m", marks=pytest.mark.slow)])
def test_meshes_that_pull_are_warned_of_by_result_and_file(case, torque):
    """At a resonance without much damping, whatever flanks carry."""
    changes = {"dynamics.damping_ratio": 0.002, "dynamics.mesh_harmonics": 6, "static.positions": 16}
    changes |= {"operation.torque": torque, "operation.speeds": ["250 rpm", "10025.641 rpm"]}
    case = with_values(case, changes)
    static = solve_static(case)
    dynamics = solve_dynamics(case, static, solve_modes(case, static))
    said = [one for one in dynamics.findings if one.code == "W-PULL"]
    assert len(said) == 1 and "1 of the 2 speeds: 10025.6 rpm" in str(said[0])
    assert said == [one for one in dynamics_warnings(dynamics.dataset()) if one.code == "W-PULL"]


SUPPORT = {"angle": "35 deg", "radial_stiffness": "4e8 N/m", "tangential_stiffness": "2e8 N/m", "width": "20 mm"}


def held(case, **entries):
    """The ring on a support too, at one speed."""
    return with_values(case, {"housing.support": [SUPPORT], "housing.published": [], "runup.count": 0} | entries)


@pytest.mark.slow
def test_a_ring_on_a_support_is_excited_as_far_as_on_its_foundation(case, static, modes):
    """The level at 1500 rpm is 30 m/s^2 with 12 mesh harmonics: most is of the modes of the meshes."""
    dynamics, found = levels(held(case, **{"operation.speeds": ["1500 rpm"]}), static, modes)
    assert dynamics.excitation_limit[0] == pytest.approx(modes.reach, rel=0.03)
    assert (
        found[0] == pytest.approx(42.7, rel=0.02)
        and not list(dynamics_warnings(dynamics.dataset()))
        and abs(dynamics.level_change[0]) < 1.0
    )
    assert dynamics.fixed.two_way.harmonics[0] == dynamics.response.force.shape[-1] - 1


@pytest.mark.slow
def test_what_a_ring_on_a_support_loses_is_warned_of(case, static, modes):
    """What the comparison found is what the case without the limit has."""
    few = held(case, **{"operation.speeds": ["1500 rpm"], "dynamics.mesh_harmonics": 12})
    dynamics, found = levels(few, static, modes)
    findings = dynamics_warnings(dynamics.dataset())
    (finding,) = (one for one in findings if one.code == "W-EXCITATION")
    change = dynamics.level_change[0]
    assert f"{change:+.1f} dB" in finding.text and change > 2.0
    full = levels(held(case, **{"operation.speeds": ["1500 rpm"]}), static, modes)[1]
    assert 20 * np.log10(full / found) == pytest.approx(change, abs=0.05)


def test_run_up_and_operating_speeds_have_one_excitation(case, modes):
    ends = {"runup.from": "1500 rpm", "runup.to": "1520 rpm", "runup.count": 2}
    entries = held(case, **{"operation.speeds": ["1500 rpm"]} | ends)
    runup = solve_runup(entries, modes)
    assert runup.response.level[0] == pytest.approx(42.7, rel=0.02)
    assert runup.excitation_limit == pytest.approx(modes.reach, rel=0.03)
