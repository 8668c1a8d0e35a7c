"""Whole cases whose errors exceed their play, separate a planet, or have no load: computed and reported."""

import numpy as np
import pytest

from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_value

TANGENTIAL = [{"planet": 1, "tangential": "0.12 mm"}]


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("grids")


@pytest.fixture(scope="module")
def solved(cache):
    """Function that solves the reference case with some entries changed."""
    base = read_case("cases/planetary_27_40_108.toml")
    few = {
        "dynamics.mesh_harmonics": 3,
        "dynamics.response_harmonics": 6,
        "static.positions": 8,
        "static.flank_elements": 8,
        "set.backlash": "60 um",
    }
    known = {}

    def solve(**changed):
        if str(changed) not in known:
            case = base
            for key, value in (few | {k.replace("__", "."): v for k, v in changed.items()}).items():
                case = with_value(case, key, value)
            known[str(changed)] = solve_static(case, cache=cache)
        return known[str(changed)]

    return solve


def check_equilibrium(result, torque):
    """Of the sun and of every planet, both flanks together."""
    cycle, radius = result.cycle, result.planetary_set.sun.base_radius
    net = cycle.force - cycle.back_force
    scale = max(cycle.force.max(), cycle.back_force.max())
    assert np.abs(net[:3].sum(axis=0) - torque / radius).max() < 1e-9 * scale
    assert np.abs(net[:3] - net[3:]).max() < 1e-9 * scale
    assert cycle.residual.max() < 1e-9


@pytest.mark.slow
def test_pin_error_beyond_the_play_unloads_its_planet(solved):
    """120 um move planet 1 back by 224 um along both lines of action: deflections do not reach that far."""
    result = solved(set__pin_errors=TANGENTIAL)
    cycle = result.cycle
    check_equilibrium(result, 100.0)
    assert cycle.open_planets[0].all() and not cycle.open_planets[1:].any()
    assert "lose all load" in cycle.message
    assert any("W-OPEN" in str(one) and "planet 1 carries nothing at all" in str(one) for one in result.findings)


def test_pin_error_beyond_the_play_presses_on_the_back_flanks(solved):
    """Seen from both sides of the teeth the same set is preloaded: planet 1 drives backwards."""
    result = solved(set__pin_errors=TANGENTIAL, static__back_flanks=True)
    cycle, gears = result.cycle, result.planetary_set
    check_equilibrium(result, 100.0)
    angles = gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring
    taken_up = 120e-6 * np.cos(angles).sum() - gears.backlash_sun_planet - gears.backlash_planet_ring
    assert taken_up > 100e-6
    assert (cycle.back_force[[0, 3]] > 1e3).all() and not cycle.force[[0, 3]].any()
    assert not cycle.back_force[[1, 2, 4, 5]].any()
    assert (cycle.load_share[0] < 0).all()
    assert "back flanks" in cycle.message
    # what play and sun leave of the error, planet 1 takes up as a planet alone does under the same force, but
    # for the torsion of the sun between its teeth, where the others turn it back by some 2 %
    taken_up = taken_up - cycle.sun_arc.mean()
    torque = cycle.back_force[0].mean() * gears.sun.base_radius
    alone = solved(operation__torque=f"{torque} N m", set__planets=1)
    assert alone.cycle.sun_arc.mean() == pytest.approx(taken_up, rel=0.03)


@pytest.mark.slow
def test_planet_pushed_into_the_sun_is_wedged(solved):
    result = solved(
        set__pin_errors=[{"planet": 1, "radial": "-0.12 mm"}],
        static__back_flanks=True,
        operation__torque="-100 N m",
    )
    check_equilibrium(result, 100.0)
    assert result.cycle.wedged[0].all() and "wedged" in result.cycle.message
    assert any("W-WEDGED" in str(warning) for warning in result.findings)


@pytest.mark.slow
def test_pitch_error_that_separates_one_planet(solved):
    """Three teeth of planet 2 stand 80 um back: while they mesh with the sun, it carries nothing."""
    pitch = ["0 um"] * 40
    pitch[2:5] = ["-80 um"] * 3
    changed = {
        "planet__individual": [{"planet": 2, "cumulative_pitch": pitch}],
        "static__longest_record": 10,
    }
    result = solved(**changed)
    cycle = result.cycle
    check_equilibrium(result, 100.0)
    assert cycle.periods == 10 and "does not close" in result.period_message
    separated = cycle.open_planets[1]
    assert 4 < separated.sum() < separated.size and not cycle.open_planets[[0, 2]].any()
    assert not cycle.force[[1, 4]][:, separated].any()
    assert cycle.load_share[[0, 2]][:, separated] == pytest.approx(0.5, abs=2e-3)
    assert cycle.load_share[1][~separated].max() == pytest.approx(1 / 3, abs=2e-3)
    assert any("W-OPEN" in str(one) and "planet 2 carries nothing at some" in str(one) for one in result.findings)


@pytest.mark.parametrize("back", [False, True])
def test_no_torque_and_enough_play_leave_everything_open(solved, back):
    result = solved(operation__torque="0 N m", static__back_flanks=back)
    cycle = result.cycle
    assert not cycle.force.any() and not cycle.back_force.any() and not cycle.stiffness.any()
    assert cycle.open_planets.all() and "no torque" in cycle.message
    for name in (
        "deflection",
        "tooth_load",
        "bearing_force",
        "load_share",
        "secant_stiffness",
        "max_pressure",
    ):
        assert np.isfinite(getattr(cycle, name)).all() and not getattr(cycle, name).any()
    assert result.findings == ()
    dataset = result.dataset()
    assert all(np.isfinite(dataset[name]).all() for name in dataset if dataset[name].dtype.kind == "f")


def test_no_torque_but_wedged_is_loaded(solved):
    """Without torque the preload is all there is, and it balances itself."""
    result = solved(
        operation__torque="0 N m",
        set__pin_errors=TANGENTIAL,
        static__back_flanks=True,
    )
    check_equilibrium(result, 0.0)
    cycle = result.cycle
    assert (cycle.back_force[[0, 3]] > 1e3).all() and (cycle.force[[1, 2, 4, 5]] > 1e3).all()
    assert not cycle.load_share.any() and "back flanks" in cycle.message


def test_clearance_of_the_case_reaches_the_bearings(solved):
    """A planet with clearance moves further than its stiffness alone lets it, by nearly the clearance."""
    held = {"static__members": "elastic"}
    plain, loose = solved(**held), solved(**held, planet__bearing_clearance="20 um")
    rows = [plain.cycle.member_names.index(f"planet 1: {axis}") for axis in "xy"]
    moved = [np.hypot(*result.cycle.member_motion[rows]) for result in (plain, loose)]
    assert (moved[1] - moved[0] > 20e-6).all() and (moved[1] - moved[0] < 40e-6).all()
    size = np.hypot(*loose.cycle.bearing_force[0])
    assert size == pytest.approx(np.hypot(*plain.cycle.bearing_force[0]), rel=1e-6)
