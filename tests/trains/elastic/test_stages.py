"""The pipeline as a whole: limits that join its stages, mirrored torque, refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum, order_level
from femgear.housing.sensor import fixed_sensor_lines, heaviside_linear_lines, stored_lines
from femgear.solvers.linear.state_space import state_space
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.lumped_set import member_speeds
from femgear.stages.static import solve_static
from femgear.system.fourier import harmonics_of, sample
from femgear.trains.elastic.checks import max_nodal_diameter
from femgear.trains.elastic.outputs import elastic_dynamic_model, mesh_and_ring_outputs
from femgear.trains.elastic.results import _passing
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import parse_case, read_case, with_value, with_values
from validation.cases import reference_case
from validation.reference.sensor_in_time import symmetry_leakage

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def case():
    coarse = with_value(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), "static.positions", 32)
    return with_value(coarse, "static.flank_elements", 12)


@pytest.fixture(scope="module")
def steps():
    """Grids, compliances and ring models, which the cases of this file share."""
    return Steps()


@pytest.fixture(scope="module")
def static(case, steps):
    return solve_static(case, steps=steps)


@pytest.fixture(scope="module")
def modes(case, static, steps):
    return solve_modes(case, static, steps=steps)


@pytest.fixture(scope="module")
def dynamics(case, static, modes):
    return solve_dynamics(case, static, modes)


def test_the_validation_tables_take_the_case_of_the_repository():
    file = read_case(ROOT / "cases" / "modulation_paper.toml").model_dump()
    table = reference_case().model_dump()
    # what the paper published is compared by the tables themselves
    file["housing"]["published"], file["title"] = (), table["title"]
    assert table == file


def test_the_paper_and_the_reference_set_are_one_set_with_another_excitation_and_sensor():
    one, two = (read_case(ROOT / "cases" / f"{n}.toml") for n in ("modulation_paper", "planetary_27_40_108"))
    differ = {name for name, value in one if value != getattr(two, name)}
    assert differ == {"title", "dynamics", "housing"}


@pytest.mark.slow
@pytest.mark.parametrize("torque", ["100 N m", "-60 N m"])
def test_at_standstill_the_dynamic_transmission_error_is_that_of_the_set_on_its_supports(case, torque, steps):
    """0.01 rpm, whatever static.members shows: mean and fluctuation of all meshes, and the forces."""
    case = with_value(with_value(case, "operation.speeds", ["0.01 rpm"]), "operation.torque", torque)
    static = solve_static(case, steps=steps)
    modes = solve_modes(case, static, steps=steps)
    result = solve_dynamics(case, static, modes)
    # the kinks of the static curve have harmonics beyond the 512 of the excitation
    ste = sample(harmonics_of(modes.state.resampled("deflection", 8192), 512), 2048)
    dte = sample(result.dte[0], 2048)
    assert np.abs(dte - ste).max(axis=1) == pytest.approx(0, abs=2e-4 * np.ptp(ste, axis=1).min())
    assert dte.mean(axis=1) == pytest.approx(ste.mean(axis=1), rel=1e-4)
    # gears that are held deflect by less than those on their supports
    assert static.cycle.deflection[3:].mean() < 0.5 * ste[3:].mean()
    moving = solve_static(with_value(case, "static.members", "elastic"), steps=steps).cycle.deflection
    assert modes.state.resampled("deflection", 32) == pytest.approx(moving, rel=1e-7)
    force = sample(result.response.force[0], 2048)
    assert force == pytest.approx(abs(static.sun_torque) / static.planetary_set.sun.base_radius / 3, rel=1e-3)


@pytest.mark.slow
def test_at_standstill_errors_that_turn_are_those_of_the_static_record(case, steps):
    """0.01 rpm, the harmonics that excite: of deflections and forces, a thousandth of their fluctuation."""
    errors = {
        "sun.errors": {"cumulative_pitch": ["4 um", "-2 um", "0 um"] * 9},
        "set.pin_errors": [{"planet": 1, "tangential": "2 um"}],
    }
    slow = {"operation.speeds": ["0.01 rpm"], "dynamics.mesh_harmonics": 40, "dynamics.tolerance": 1e-9}
    case = with_values(case, {**errors, **slow})
    static = solve_static(case, steps=steps)
    modes = solve_modes(case, static, steps=steps)
    result = solve_dynamics(case, static, modes)
    assert modes.state.periods == 3
    for name, lines in (("deflection", result.dte[0]), ("force", result.response.force[0])):
        wanted = sample(harmonics_of(modes.state.resampled(name, 3 * 8192), 3 * 40), 2048)
        found = sample(lines[:, : 3 * 40 + 1], 2048)
        assert np.abs(found - wanted).max() < 1e-3 * np.ptp(wanted, axis=1).max(), name


def every_diameter(modes, response):
    """Radial field of the ring at all nodal diameters."""
    return mesh_and_ring_outputs(replace(modes, symmetry=1), response)[1]


def test_planets_in_phase_leave_only_multiples_of_three(case, modes, dynamics):
    """Which alone are kept: of the whole field the others are rounding, without them levels are the same."""
    carrier = np.array([one.carrier for one in dynamics.speeds])
    field = every_diameter(modes, dynamics.response)
    assert np.abs(field - dynamics.ring_radial).max() < 1e-9 * np.abs(field).max()
    lines, kept = fixed_sensor_lines(field, 108, carrier, 0.0), solve_housing(case, dynamics).exact
    assert not (kept.order % 3).any() and len(kept.order) < 0.2 * len(lines.order)
    for one in lines.acceleration:
        assert symmetry_leakage(OrderSpectrum(lines.order, one), 3) < 1e-7
    assert order_level(kept) == pytest.approx(order_level(lines), rel=1e-9)
    for s, acceleration in enumerate(lines.acceleration):
        for h in (1, 5, 12):
            levels = [
                np.linalg.norm(values[np.abs(order - 108 * h) < 54])
                for order, values in ((lines.order, acceleration), (kept.order, kept.acceleration[s]))
            ]
            assert levels[1] == pytest.approx(levels[0], rel=1e-9)


@pytest.mark.slow
def test_planets_out_of_phase_are_equal_and_leave_only_multiples_of_three(case):
    """28/41/110 at the default 64 positions, which three planets would meet unequally: 66 are taken."""
    data = case_text.parse(case.source, "")
    data["sun"] |= {"teeth": 28}
    data["planet"] |= {"teeth": 41, "profile_shift": 0.2}
    data["ring"] |= {"teeth": 110}
    data["static"] |= {"positions": 64}
    for entry in (
        (data["set"], "centre_distance"),
        (data["sun"], "profile_shift"),
        (data["sun"], "tip_diameter"),
        (data["planet"], "tip_diameter"),
        (data["housing"], "published"),
    ):
        entry[0].pop(entry[1])
    other = parse_case(case_text.write(data))
    static = solve_static(other)
    assert len(static.cycle.position) == 66
    means = static.cycle.stiffness.mean(axis=1)
    assert np.ptp(means[:3]) < 1e-9 * means[0] and np.ptp(means[3:]) < 1e-9 * means[3]
    dynamics = solve_dynamics(other, static, solve_modes(other, static))
    carrier = np.array([one.carrier for one in dynamics.speeds])
    lines, kept = (
        fixed_sensor_lines(dynamics.ring_radial, 110, carrier, 0.0),
        solve_housing(other, dynamics).exact,
    )
    for one in lines.acceleration:
        assert symmetry_leakage(OrderSpectrum(lines.order, one), 3) < 1e-8
    assert dynamics.symmetry == 3 and not (kept.order % 3).any()
    assert order_level(kept) == pytest.approx(order_level(lines), rel=1e-9)


def test_the_default_signal_has_only_lines_of_the_ring(case, dynamics):
    """No images of an interpolation: components (h, n) at orders 108 h - n, h up to 26 nodal diameters."""
    housing = solve_housing(case, dynamics)
    assert housing.form == "exact" and housing.lines is housing.exact
    order, n_max = housing.lines.order, dynamics.ring_radial.shape[-1] // 2
    far = np.abs(order / 108 - np.rint(order / 108)) * 108 > n_max + 0.5
    assert not far.any()
    linear = solve_housing(with_value(case, "housing.form", "linear"), dynamics)
    away = np.abs(linear.lines.order / 108 - np.rint(linear.lines.order / 108)) * 108 > n_max + 0.5
    assert linear.lines.method == "linear, 54 points" and linear.lines.acceleration[:, away].any()
    assert np.array_equal(linear.exact.displacement, housing.lines.displacement)
    # the linear form of the exact lines is that of the field, its static part as it is
    carrier = np.array([one.carrier for one in dynamics.speeds])
    static = np.where(np.arange(dynamics.ring_radial.shape[1])[:, None] == 0, dynamics.ring_radial, 0.0)
    moving = heaviside_linear_lines(dynamics.ring_radial - static, 108, carrier, 0.0, points=54)
    expected = moving.displacement + fixed_sensor_lines(static, 108, carrier, 0.0).displacement
    assert np.abs(linear.lines.displacement - expected).max() < 1e-12 * np.abs(expected).max()
    # and so are those of the file, but for its single precision
    data = linear.dataset().isel(speed=1)
    stored, heard = stored_lines(data), linear.lines
    assert np.abs(stored.acceleration - heard.acceleration[1]).max() < 1e-6 * np.abs(heard.acceleration[1]).max()
    assert np.allclose(order_level(stored_lines(data, form="exact")), order_level(housing.exact)[1], rtol=1e-7)


def test_the_verdict_tells_how_far_the_ring_moves_past_the_sensor(case, dynamics):
    """Peak to peak over a turn of the carrier, from the field of the ring at rest with the gears."""
    data = solve_housing(case, dynamics).dataset()
    n, turn = np.arange(-(dynamics.ring_radial.shape[-1] // 2), dynamics.ring_radial.shape[-1] // 2 + 1), []
    for angle in np.linspace(0.0, 2.0 * np.pi, 1000):
        turn.append(np.real(dynamics.ring_radial[:, 0] @ np.exp(-1j * n * angle)))
    assert _passing(data) == pytest.approx(np.ptp(turn, axis=0).max(), rel=0.02)


def test_mesh_harmonics_of_the_force_balance_the_torque(dynamics, static):
    force = dynamics.response.force[:, :, 0].real
    share = static.sun_torque / static.planetary_set.sun.base_radius / 3
    assert force == pytest.approx(share, rel=1e-6)
    assert np.all(np.abs(dynamics.stability.multiplier) < 1)


def test_the_ring_turns_against_the_sun_at_rest(case, dynamics):
    """T z_r / z_s over k R 2 pi R b: clockwise under a positive torque of the sun, and outwards."""
    zero = dynamics.ring_radial.shape[-1] // 2
    turned = -case.operation.torque * 4.0 / (case.ring.foundation_tangential * 2 * np.pi * 0.1**2 * 0.025)
    assert dynamics.ring_tangential[-1, 0, zero] == pytest.approx(turned, rel=1e-5)
    assert np.all(dynamics.ring_radial[:, 0, zero].real > 0.0)


def test_negative_torque_runs_the_cycle_backwards(case, static, modes, steps):
    """The back flanks of a symmetric set are its mirror image."""
    back_case = with_value(case, "operation.torque", "-100 N m")
    back = solve_static(back_case, steps=steps)
    turned = -np.arange(32) % 32
    assert back.cycle.deflection == pytest.approx(static.cycle.deflection[:, turned], abs=1e-11)
    turned_modes = solve_modes(back_case, back, steps=steps)
    assert turned_modes.modes.frequency == pytest.approx(modes.modes.frequency, rel=1e-6, abs=1e-3)
    assert np.isfinite(solve_dynamics(back_case, back, turned_modes).dte).all()


def test_modes_need_a_fixed_ring(case, steps):
    freed = with_value(case, "operation.fixed", "carrier")
    freed = with_value(freed, "static.positions", 13)
    static = solve_static(freed, steps=steps)
    with pytest.raises(CaseError, match="fixed ring") as caught:
        solve_modes(freed, static)
    assert caught.value.code == "E-FIXED-MEMBER" and "[planar]" in caught.value.remedy


def test_without_torque_static_is_defined_and_modes_are_refused(case, steps):
    empty = with_value(with_value(case, "operation.torque", "0 N m"), "static.positions", 13)
    static = solve_static(empty, steps=steps)
    assert not static.cycle.force.any()
    with pytest.raises(CaseError) as caught:
        solve_modes(empty, static)
    assert caught.value.code == "E-NO-LOAD"


def test_progress_counts_the_positions(case, steps):
    seen = []
    short = with_value(case, "static.positions", 13)
    solve_static(short, progress=lambda *step: seen.append(step), steps=steps)
    assert seen[-1] == ("contact", 13, 13)


def test_progress_of_modes_counts_on_from_round_to_round(case, static, steps):
    """Positions come in rounds where the stiffness is steep: none of them begins again at one."""
    seen = []
    solve_modes(case, static, progress=lambda *step: seen.append(step), steps=Steps())
    done, total = ([step[place] for step in seen] for place in (1, 2))
    assert {step[0] for step in seen} == {"modes"} and len(set(total)) > 1
    assert done == sorted(done) and total == sorted(total) and done[-1] == total[-1]


@pytest.mark.parametrize(("points", "teeth", "expected"), [(7, 108, 26), (1000, 108, 26), (54, 40, 19)])
def test_nodal_diameters_do_not_depend_on_the_points_of_the_housing(case, points, teeth, expected):
    changed = case.model_copy(
        update={
            "housing": case.housing.model_copy(update={"points": points}),
            "ring": case.ring.model_copy(update={"teeth": teeth}),
        }
    )
    assert max_nodal_diameter(changed) == expected


def test_what_the_dynamics_cannot_represent_is_refused_before_computing(case):
    from femgear.case.gear_set import planetary_set
    from femgear.errors import CaseError
    from femgear.trains.elastic.checks import check_dynamic_case

    for key, value, code in (
        ("operation.fixed", "carrier", "E-FIXED-MEMBER"),
        ("operation.torque", "0 N m", "E-NO-LOAD"),
        ("operation.speeds", ["1e6 rpm"], "E-RANGE"),
    ):
        changed = with_value(case, key, value)
        with pytest.raises(CaseError, match=code):
            check_dynamic_case(changed, planetary_set(changed))
    cut = with_value(with_value(case, "sun.errors", {"runout_amplitude": "5 um"}), "static.longest_record", 1)
    with pytest.raises(CaseError, match="E-PERIODS"):
        check_dynamic_case(cut, planetary_set(cut))
    check_dynamic_case(case, planetary_set(case))


def test_slow_sets_keep_their_modes(case, static, steps):
    slow = solve_modes(with_value(case, "operation.speeds", ["0.1 rpm"]), static, steps=steps)
    assert len(slow.modes.frequency) > 15


def test_overload_is_said(case, steps):
    overload = solve_static(
        with_value(with_value(case, "operation.torque", "20000 N m"), "static.positions", 16),
        steps=steps,
    )
    words = " ".join(map(str, overload.findings))
    assert "W-PRESSURE" in words and "W-DEFLECTION] the teeth deflect by" in words


def test_motion_of_the_ring_on_its_foundation_is_not_called_deflection_of_teeth(case, steps):
    """The foundation of 4e9 N/m^3 yields by more than 5 % of the module, the meshes of the sun do not."""
    soft = with_values(
        case,
        {
            "static.members": "elastic",
            "static.positions": 16,
            "ring.foundation_radial": "1e9 N/m^3",
            "ring.foundation_tangential": "1e9 N/m^3",
        },
    )
    static = solve_static(soft, steps=steps)
    (words,) = [str(one) for one in static.findings if one.code == "W-DEFLECTION"]
    sun, ring = (np.abs(half).max() * 1e6 for half in np.split(static.cycle.deflection, 2))
    assert sun < 20.0 and ring > 75.0
    assert f"{sun:.0f} um between sun and planets and by {ring:.0f} um between planets and ring" in words
    assert "teeth deflect" not in words and "ring on its foundation" in words


def test_motions_beyond_small_displacements_are_refused(case, steps):
    from femgear.errors import ContactError

    coarse = with_value(case, "static.positions", 16)
    with pytest.raises(ContactError, match="E-MOTION"):
        solve_static(with_value(coarse, "operation.torque", "1e6 N m"), steps=steps)
    soft = with_value(coarse, "static.members", "elastic")
    with pytest.raises(ContactError, match="E-MOTION"):
        solve_static(with_value(soft, "planet.bearing_stiffness", "1 N/m"), steps=steps)
    loose = solve_static(with_value(soft, "planet.bearing_clearance", "0.5 mm"), steps=steps)
    assert "W-MOTION" in [one.code for one in loose.findings]


@pytest.mark.slow
def test_thick_teeth_wedge_without_any_other_error(case, steps):
    """Teeth thicker than the play allow load both flanks: errors of thickness alone reach the contact."""
    coarse = with_value(with_value(case, "static.positions", 16), "static.back_flanks", True)
    thick = with_value(coarse, "sun.errors", {"thickness_reduction": "-300 um"})
    found = solve_static(thick, steps=steps)
    assert found.cycle.wedged[:3].all()
    assert found.cycle.force[:3].min() > 2 * solve_static(coarse, steps=steps).cycle.force.max()


@pytest.mark.slow
def test_with_elastic_members_standstill_is_the_static_state_even_with_pin_errors(case, steps):
    """Unequal loads, every spring of the dynamic model in the static one: forces agree at 1 rpm."""
    for key, value in {
        "static.positions": 16,
        "static.members": "elastic",
        "operation.speeds": ["1 rpm"],
        "dynamics": {"mesh_harmonics": 7, "response_harmonics": 14},
        "set.pin_errors": [{"planet": 1, "tangential": "12 um"}, {"planet": 2, "radial": "6 um"}],
    }.items():
        case = with_value(case, key, value)
    static = solve_static(case, steps=steps)
    result = solve_dynamics(case, static, solve_modes(case, static, steps=steps))
    assert np.ptp(static.cycle.load_share.mean(axis=1)) > 0.02
    mean = static.cycle.force.mean(axis=1)
    assert result.response.force[0, :, 0].real == pytest.approx(mean, rel=1e-4)
    force = sample(result.response.force[0], 32)[:, ::2]
    spectrum = np.fft.rfft(static.cycle.force, axis=1)
    spectrum[:, 8] = 0.0
    assert force == pytest.approx(np.fft.irfft(spectrum, 16, axis=1), rel=2e-3)


@pytest.mark.slow
def test_shares_with_half_and_twice_the_bearing_stiffness_are_those_of_the_other_cases(case, modes, steps):
    """One pin 10 um ahead: the range beside K_gamma is that of runs with these bearings."""
    assert modes.bearing_share is None and "bearing_share" not in modes.dataset()
    pin = {"set.pin_errors": [{"planet": 1, "tangential": "10 um"}], "static.positions": 8}
    shares = {}
    for bearing in ("3e8 N/m", "6e8 N/m"):
        one = with_values(case, pin | {"planet.bearing_stiffness": bearing})
        shares[bearing] = solve_modes(one, solve_static(one, steps=steps), steps=steps)
    own = {name: result.state.resampled("force", 64).mean(axis=1) for name, result in shares.items()}
    own = {name: force[:3] / force[:3].mean() for name, force in own.items()}
    assert shares["3e8 N/m"].bearing_share[:3, 1] == pytest.approx(own["6e8 N/m"], abs=1e-3)
    assert shares["6e8 N/m"].bearing_share[:3, 0] == pytest.approx(own["3e8 N/m"], abs=1e-3)
    assert own["6e8 N/m"].max() > own["3e8 N/m"].max() + 2e-3
    data = shares["3e8 N/m"].dataset()
    assert data.bearing_factor.values.tolist() == [0.5, 2.0]


def test_the_model_for_other_programs_has_the_receptance_of_the_response(case, static, modes):
    """Deflections, forces, transmission errors and waves of the ring, of all harmonics of a response."""
    model = elastic_dynamic_model(case, {"static": static, "modes": modes})
    space, M = state_space(model.modal), 6
    assert [name.split()[0] for name in space.inputs] == ["displacement"] * M + ["torque"] * 2
    hertz = model.mesh_rate * 300.0
    response = solve_spectral(modes.modes, modes.excitation, [hertz], excitation_harmonics=4, tolerance=1e-12)
    error, field = mesh_and_ring_outputs(modes, response)
    x, force = response.deflection[0], response.force[0]
    waves = np.zeros((2 * modes.max_diameter + 1, field.shape[1]), complex)
    forward, backward = field[0, :, modes.max_diameter + 1 :].T, field[0, :, modes.max_diameter - 1 :: -1].T
    waves[0], waves[1::2], waves[2::2] = field[0, :, modes.max_diameter], forward + backward, 1j * (forward - backward)
    expected = np.concatenate([x, force, error[0], waves])
    names = [name for name in space.outputs if not name.startswith(("sun", "carrier", "planet ", "motor", "brake"))]
    rows = [space.outputs.index(name) for name in names]
    assert len(rows) == len(expected)
    displacement = x - force / modes.modes.mesh_stiffness[:, None]
    for h in range(x.shape[1]):
        inputs = np.concatenate([displacement[:, h], space.nominal[M:] * (h == 0)])
        states = 2j * np.pi * hertz * h * np.eye(len(space.A)) - space.A
        # the rotation of the whole, which strains nothing, has no mean
        states[len(states) // 2, 0] += h == 0
        moved = np.linalg.solve(states, space.B @ inputs)
        found = (space.C @ moved + space.D @ inputs)[rows]
        for part in (slice(M), slice(M, 2 * M), slice(2 * M, 3 * M), slice(3 * M, None)):
            size = np.abs(expected[part]).max()
            assert np.abs(found[part] - expected[part, h]).max() <= 1e-9 * size, (h, part)


def test_the_model_for_other_programs_turns_as_the_gears_do(case, modes):
    model = elastic_dynamic_model(case, {"modes": modes})
    named = dict(zip([port.name for port in model.modal.outputs], model.ratios, strict=True))
    turning = member_speeds(case, planetary_set(case))
    assert named["sun: rotation"] == pytest.approx(1.0, rel=1e-9)
    assert named["carrier: rotation"] == pytest.approx(turning.carrier, rel=1e-9)
    assert named["planet 2: rotation"] == pytest.approx(turning.planet, rel=1e-9)
    assert model.sensor.carrier == turning.carrier and model.mesh_rate == turning.mesh_frequency
