"""Errors that turn with gears, from the record over several mesh periods to the lines of a fixed sensor."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.housing.orders import OrderSpectrum, analytic_signal
from femgear.housing.sensor import component_lines, fixed_sensor_signal, stored_lines
from femgear.housing.sound import component_sound, sound_power, sound_pressure
from femgear.report import response
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.static import solve_static
from femgear.system.fourier import harmonics_of, sample
from femgear.trains.elastic import figures
from femgear.trains.elastic.checks import check_dynamic_case, no_runup
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import read_case, with_values
from validation.turning import FOUR_PLANETS, in_time, off_the_rule, pitch

pytestmark = pytest.mark.usefixtures("coarse_states")
ROOT = Path(__file__).parents[3]
COARSE = {
    "static.positions": 16,
    "static.flank_elements": 8,
    "dynamics.up_to": "6 kHz",
    "operation.speeds": ["600 rpm", "2000 rpm"],
    "housing.published": [],
}


@pytest.fixture(scope="module")
def steps():
    """Grids, compliances and ring models, which the cases of this file share."""
    return Steps()


@pytest.fixture(scope="module")
def solved(steps):
    """A function: modes, dynamics and housing of the reference set, or of four planets, with changes."""

    def solve(changes):
        case = with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), {**COARSE, **changes})
        static = solve_static(case, steps=steps)
        modes = solve_modes(case, static, steps=steps)
        dynamics = solve_dynamics(case, static, modes)
        return case, modes, dynamics, solve_housing(case, dynamics)

    return solve


@pytest.fixture(scope="module")
def three(solved):
    """A pin error, a planet with an error of every fifth tooth, a sun with one of every third."""
    return solved(
        {
            "set.pin_errors": [{"planet": 1, "tangential": "1 um"}],
            "sun.errors": {"cumulative_pitch": pitch(2, -1, 0, teeth=27)},
            "planet.individual": [{"planet": 2, "cumulative_pitch": pitch(2, 0, 0, -1, 0, teeth=40)}],
        }
    )


@pytest.mark.slow
def test_every_line_is_that_of_time_integration_over_the_whole_record(three):
    """As a record of one long period, by an integrator of its own; multipliers of that period too."""
    modes = three[1]
    assert modes.state.periods == modes.excitation.periods == 15
    error, ours, reference = in_time(modes.modes, modes.excitation, 900.0)
    assert error < 1e-4 and ours == pytest.approx(reference, rel=1e-3)


@pytest.mark.slow
def test_a_record_over_more_periods_than_it_needs_changes_nothing(three):
    """Three times over: every third line, and in the housing the same lines, levels and sound."""
    case, modes, dynamics, housing = three
    one = modes.excitation
    tiled = {name: np.tile(getattr(one, name), (1, 3)) for name in ("stiffness", "deflection", "force")}
    longer = replace(modes, excitation=replace(one, **tiled, periods=3 * one.periods))
    options = {"excitation_harmonics": 3, "response_harmonics": 6, "method": "direct"}
    short, long = (solve_spectral(m.modes, m.excitation, [300.0, 900.0], **options) for m in (modes, longer))
    size = np.abs(short.deflection).max()
    assert np.abs(long.deflection[..., ::3] - short.deflection).max() < 1e-10 * size
    others = np.arange(long.deflection.shape[-1]) % 3 > 0
    assert np.abs(long.deflection[..., others]).max() < 1e-10 * size
    field = dynamics.ring_radial
    spread = np.zeros((len(field), 3 * field.shape[1] - 2, field.shape[2]), complex)
    spread[:, ::3] = field
    place = case.ring.teeth, housing.exact.carrier_speed
    again = component_lines(spread, *place, 0.0, periods=45)
    assert again.turns == housing.exact.turns == 5
    some = np.searchsorted(again.number, housing.exact.number)
    assert np.abs(again.displacement[:, some] - housing.exact.displacement).max() < 1e-10 * size
    heard = housing.cylinder, housing.microphone
    sound = component_sound(spread, *place, *heard, periods=45)
    for ours, other in zip(sound, housing.sound):
        assert np.abs(ours[:, some] - other).max() < 1e-10 * np.abs(other).max()


def test_one_component_a_line_sounds_as_the_lines_do(three):
    case, _, dynamics, housing = three
    field = dynamics.ring_radial[:, ::15]  # whole mesh harmonics alone
    place = case.ring.teeth, housing.exact.carrier_speed
    lines = component_lines(field, *place, 0.0)
    pressure, power, equivalent = component_sound(field, *place, housing.cylinder, housing.microphone, periods=1)
    expected = sound_pressure(lines, housing.cylinder, housing.microphone)
    assert np.abs(pressure - expected).max() < 1e-12 * np.abs(expected).max()
    for ours, same in ((power, False), (equivalent, True)):
        expected = sound_power(lines, housing.cylinder, equivalent=same)
        # the static field, which is hardly heard, has two components a line
        assert ours[:, 30:] == pytest.approx(expected[:, 30:], rel=1e-9, abs=1e-15 * expected.max())


def test_signals_over_several_turns_are_the_sum_of_their_lines(three):
    *_, housing = three
    lines = replace(
        housing.exact,
        displacement=housing.exact.displacement[0],
        carrier_speed=housing.exact.carrier_speed[0],
    )
    signal = fixed_sensor_signal(lines)
    assert lines.turns == 5 and signal.revolution[-1] < 5.0
    some = np.arange(len(signal.revolution))[:: len(signal.revolution) // 40]
    wave = np.exp(2j * np.pi * np.outer(signal.revolution[some], lines.order))
    assert signal.acceleration[some] == pytest.approx(
        np.real(wave @ lines.acceleration), abs=1e-9 * np.abs(signal.acceleration).max()
    )
    spectrum = OrderSpectrum(lines.order, lines.acceleration, lines.turns)
    analytic = analytic_signal(spectrum)
    at = np.arange(len(analytic))[:: len(analytic) // 40]
    wave = np.exp(2j * np.pi * np.outer(5.0 * at / len(analytic), lines.order))
    assert analytic[at].real == pytest.approx(
        np.real(wave @ lines.acceleration), abs=1e-9 * np.abs(signal.acceleration).max()
    )
    stored = stored_lines(housing.dataset().isel(speed=0))
    assert stored.turns == 5 and np.array_equal(stored.order, lines.order[: len(stored.order)])


def test_pictures_span_what_repeats(three):
    """Fifteen mesh periods, five turns; the thin static curve is the record up to the excitation."""
    _, modes, dynamics, housing = three
    data, heard = dynamics.dataset(), housing.dataset().isel(speed=[1])
    assert data.attrs["periods"] == 15 and heard.attrs["turns"] == 5
    assert data["harmonic"].values[[1, 15]] == pytest.approx([1 / 15, 1.0])
    rest = modes.dataset()
    static = rest[["supported_ste"]].rename(supported_ste="ste", supported_position="position")
    figure = response.transmission_error_period(data, static)
    thin = next(one for one in figure.axes[0].get_lines() if one.get_linewidth() == 0.9)
    count = len(thin.get_xdata()) - 1
    assert figure.axes[0].get_xlim() == (0.0, 15.0) and thin.get_xdata()[-1] == 15.0
    excited = 15 * round(dynamics.excitation_limit[0] / dynamics.response.mesh_frequency[0])
    dense = np.arange(15 * 2**13) / 2**13
    record = np.interp(dense, modes.state.position, modes.state.deflection[0], period=15.0)
    wanted = 1e6 * (sample(harmonics_of(record, excited), count) - record.mean())
    assert thin.get_ydata()[:-1] == pytest.approx(wanted, abs=2e-3 * np.ptp(wanted))
    signal = figures.housing_signal(heard)
    assert signal.axes[0].get_xlim() == (0.0, 5.0)
    lobes = figures.modulation_polar(heard, [0.0, 2.1, 4.2])
    angle = lobes.axes[0].get_lines()[0].get_xdata()
    assert np.ptp(angle) == pytest.approx(10 * np.pi) and "lobes/turn" in lobes.axes[0].get_title()
    figures.draw_order_spectrum(heard), figures.microphone_spectrum(heard)
    response.transmission_error_spectrum(data), response.mesh_force_period(data)


@pytest.mark.slow
def test_orders_obey_the_rule_of_turns_in_space(solved):
    """``L = N q + m S``: four planets, a sun that turns 80/21 times, its error seven waves in a turn."""
    errors = {"sun.errors": {"cumulative_pitch": pitch(3, -1, 0, teeth=21)}}
    *_, housing = solved({**FOUR_PLANETS, **errors})
    lines = housing.exact
    assert lines.turns == 3 and not (lines.number != np.rint(3 * lines.order)).any()
    # 4 q + 80 m/3: multiples of 4/3
    assert (lines.number % 4 != 0).mean() > 0.7 and off_the_rule(lines, 4) < 1e-10
    amplitude = np.abs(lines.acceleration)
    third = (lines.number % 4 == 0) & (lines.number % 3 != 0)
    assert (amplitude[:, third].max(axis=1) > 1e-3 * amplitude.max(axis=1)).all()


def test_errors_of_a_ring_that_stands_still_leave_multiples_of_the_planets(solved):
    """Its teeth turn in the frame of the carrier, not in space."""
    *_, housing = solved({"ring.errors": {"cumulative_pitch": pitch(3, -1, 0, teeth=108)}})
    lines = housing.exact
    assert lines.turns == 1 and lines.method == "exact, 3 mesh periods"
    assert len(lines.order) > 1000 and off_the_rule(lines, 3) < 1e-10


FEW = {
    "dynamics.mesh_harmonics": 2,
    "dynamics.response_harmonics": 4,
    "dynamics.up_to": None,
    "housing.nodal_diameters": 6,
    "operation.speeds": ["400 rpm", "2000 rpm"],
}


def support(angle: int, stiffness: str) -> dict[str, str]:
    return {
        "angle": f"{angle} deg",
        "radial_stiffness": f"{stiffness} N/m",
        "tangential_stiffness": f"{stiffness} N/m",
    }


@pytest.mark.slow
def test_a_ring_on_next_to_no_support_is_heard_as_on_its_foundation(solved):
    """Hardly damped, at low speed, the convective terms of the ring are all that differs."""
    errors = {"sun.errors": {"cumulative_pitch": pitch(2, -1, 0, teeth=27)}, "dynamics.damping_ratio": 1e-4}
    few = {**FEW, "operation.speeds": ["250 rpm"], **errors, "housing.form": "exact"}
    present, held = (solved({**few, **more})[3].exact for more in ({}, {"housing.support": [support(0, "1")]}))
    assert held.turns == present.turns == 1
    middle = present.order - 36 * np.rint(present.order / 36)
    # thirds of mesh harmonics, waves up to the sixth
    kept = np.isin(present.order, held.order) & (np.abs(middle) <= 6) & (present.order < 4.5 * 108)
    lines = present.acceleration[0, kept]
    found = held.acceleration[0, np.isin(held.order, present.order[kept])]
    assert np.abs(lines).size > 50 and np.abs(found - lines).max() < 0.01 * np.abs(lines).max()
    third = np.abs(lines)[np.isin(present.order[kept] % 108, (33, 36, 39, 69, 72, 75))]
    assert third.max() > 1e-3 * np.abs(lines).max()


@pytest.mark.slow
def test_orders_on_feet_obey_the_rule(solved):
    """``L = N q + m S`` in a housing that is the same nowhere; a pin error takes N away."""
    feet = [support(angle, "2e8") for angle in (200, 235, 340)]
    sun = {"sun.errors": {"cumulative_pitch": pitch(3, -1, 0, teeth=21)}, "housing.support": feet}
    sun |= {"operation.speeds": ["2000 rpm"], "housing.nodal_diameters": 4}
    *_, dynamics, housing = solved({**FOUR_PLANETS, **FEW, **sun})
    lines, two_way = housing.exact, dynamics.fixed.two_way
    assert lines.turns == two_way.turns == 3 and lines.method == "supports"
    assert off_the_rule(lines, 4) < 1e-8 and two_way.residual.max() < 1e-6
    amplitude = np.abs(lines.acceleration)
    third = (lines.number % 4 == 0) & (lines.number % 3 != 0)
    assert (amplitude[:, third].max(axis=1) > 1e-3 * amplitude.max(axis=1)).all()
    assert np.isfinite(dynamics.level_change).all() and np.isfinite(housing.judged.multiplier).all()
    *_, unequal = solved(
        {
            **FOUR_PLANETS,
            **FEW,
            **sun,
            "sun.errors": {},
            "set.pin_errors": [{"planet": 1, "tangential": "2 um"}],
        }
    )
    other = np.abs(unequal.exact.acceleration[0, unequal.exact.order % 4 > 0])
    assert unequal.exact.turns == 1 and other.max() > 1e-4 * np.abs(unequal.exact.acceleration).max()


def test_what_takes_one_mesh_period_says_so(three):
    case = three[0]
    gears = planetary_set(case)
    for changes, words in (
        ({"housing.form": "linear"}, 'housing.form = "linear" takes one'),
        ({"static.longest_record": 14}, "15 mesh periods, after which all repeats .sun 3, planets 5."),
    ):
        changed = with_values(case, changes)
        with pytest.raises(CaseError, match="E-PERIODS") as refused:
            check_dynamic_case(changed, gears)
        assert re.search(words, str(refused.value))
    assert "turn" in no_runup(case)
    assert no_runup(with_values(case, {"sun.errors": {}, "planet.individual": []})) == ""
