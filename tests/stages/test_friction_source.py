"""Friction as a load that excites: equilibrium at rest, time integration, orders of equal planets, efficiency."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

from femgear.findings import Finding
from femgear.gears.friction import sliding_per_path
from femgear.housing.orders import order_level
from femgear.report.tables import Marks
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.friction_source import friction_rows
from femgear.stages.losses import solve_losses
from femgear.stages.static import solve_static
from femgear.system.fourier import harmonics_of, sample
from femgear.system.system import mesh_harmonics, source_harmonics
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.helical.stages import solve_helical_dynamics, solve_helical_modes, solve_helical_static
from femgear.trains.pair.stages import solve_pair_dynamics, solve_pair_modes
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
ACTS = {"losses": {"friction": "constant", "coefficient": 0.06, "excites": True}, "static.stresses": False}
COARSE = {"static.flank_elements": 8, "static.positions": 16, "dynamics.up_to": "8 kHz"}


UNEVEN = (0.0, 122.66666666666667, 240.0)


@cache
def pair(**more):
    held = {"gear_1.bearing_stiffness": "2e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}
    case = with_values(read_case(CASES / "spur_pair.toml"), ACTS | COARSE | held | more)
    static = solve_static(case)
    return case, static, solve_pair_modes(case, static)


@cache
def planetary(angles=None, **more):
    changed = ACTS | COARSE | {"operation.speeds": ["250 rpm"]} | more
    if angles is not None:
        changed |= {"set.planet_angles": [f"{angle} deg" for angle in angles]}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), changed)
    static = solve_static(case)
    modes = solve_modes(case, static)
    return case, static, modes


def test_a_pair_is_as_direct_integration_has_it():
    """The linear equations over one period from all unit states, whose periodic solution needs no settling."""
    _, _, modes = pair()
    basis, excitation, count = modes.modes, modes.excitation, 6
    frequency = 1.9e3
    stiffness, deflection, force = mesh_harmonics(excitation, count)
    source, omega = source_harmonics(excitation, count), 2.0 * np.pi * frequency
    elastic = basis.frequency > 0.0
    natural, shape = 2.0 * np.pi * basis.frequency[elastic], basis.shape[:, elastic]
    damping, m = 2.0 * basis.damping_ratio[elastic] * natural, int(elastic.sum())
    row, acting = modes.model.system.W[:, 0] @ shape, shape.T @ modes.model.system.sources
    constant, mean = shape.T @ modes.model.system.load, basis.mesh_stiffness[0]

    def at(lines, t):
        return np.real(lines @ np.exp(1j * omega * t * np.arange(count + 1)))

    def rates(t, y, forced):
        states = y.reshape(2 * m, -1)
        x, v = states[:m], states[m:]
        k = at(stiffness[0], t)
        pushed = (k - mean) * (row @ x)
        load = -(natural**2)[:, None] * x - damping[:, None] * v - np.outer(row, pushed)
        if forced:
            alone = at(force[0], t) - k * at(deflection[0], t)
            load += (constant + acting @ at(source, t) - row * alone)[:, None]
        return np.concatenate([v, load]).ravel()

    period, options = 1.0 / frequency, {"rtol": 1e-11, "atol": 1e-16, "method": "DOP853"}
    through = solve_ivp(rates, (0.0, period), np.eye(2 * m).ravel(), args=(False,), **options).y[:, -1]
    once = solve_ivp(rates, (0.0, period), np.zeros(2 * m), args=(True,), **options).y[:, -1]
    start = np.linalg.solve(np.eye(2 * m) - through.reshape(2 * m, 2 * m), once)
    instants = np.arange(256) / 256 * period
    integrated = solve_ivp(rates, (0.0, period), start, args=(True,), t_eval=instants, **options).y
    response = solve_spectral(
        basis, excitation, frequency, excitation_harmonics=count, response_harmonics=40, tolerance=1e-11
    )
    approach = sample(response.deflection[0], 256)[0]
    assert np.abs(approach - row @ integrated[:m]).max() < 1e-6 * np.ptp(approach)
    without = solve_spectral(
        basis, replace(excitation, source=0.0 * excitation.source), frequency, excitation_harmonics=count
    )
    assert np.abs(without.deflection[0, 0, 1]) != pytest.approx(np.abs(response.deflection[0, 0, 1]), rel=0.01)


def test_a_pair_at_rest_is_in_the_equilibrium_of_its_statics():
    case, _, modes = pair(**{"brake.inertia": "1e4 kg m^2", "brake.coupling_stiffness": "1e6 N m/rad"})
    response = solve_spectral(
        modes.modes, modes.excitation, 0.05, excitation_harmonics=30, response_harmonics=120, tolerance=1e-10
    )
    static = modes.excitation.every_harmonic[2][:, :20]
    assert np.abs(response.force[0, :, :20] - static).max() < 1e-3 * np.abs(static[:, 1]).max()
    assert np.abs(static[:, 1]).max() > 0.001 * static[0, 0].real
    assert case.losses.excites


@pytest.mark.slow
@pytest.mark.parametrize("torque", ["-200 N m", "200 N m"])
def test_bearings_carry_the_forces_of_teeth_and_friction_that_the_statics_have(torque):
    """Directions of the contact are those of the gears, those of the sources of their stations, on either flank."""
    _, static, modes = pair(**{"operation.torque": torque, "static.positions": 128})
    force, source = (modes.excitation.force[0].mean(), modes.excitation.source[0].mean())
    on_second = modes.model.normal * force - modes.model.tangent * source
    # equidistant positions place the step of friction by one of them
    step = np.ptp(modes.excitation.source[0]) / 128
    assert static.cycle.bearing_force[0].mean(axis=1) == pytest.approx(-on_second, abs=step)
    assert abs(source) > 4.0 * step


@pytest.mark.slow
def test_gears_driven_the_other_way_are_in_the_equilibrium_of_their_statics():
    heavy = {"brake.inertia": "1e4 kg m^2", "brake.coupling_stiffness": "1e6 N m/rad"}
    for modes in (
        pair(**heavy, **{"operation.torque": "-200 N m"})[2],
        planetary(**{"operation.torque": "-100 N m", "brake.inertia": "1e6 kg m^2"})[2],
    ):
        response = solve_spectral(
            modes.modes, modes.excitation, 0.05, excitation_harmonics=20, response_harmonics=60, tolerance=1e-9
        )
        static = modes.excitation.every_harmonic[2][:, :10]
        assert np.abs(response.force[0, :, :10] - static).max() < 2e-3 * np.abs(static[:, 1]).max()


def test_forces_on_rigid_bearings_are_those_of_teeth_and_friction():
    case, _, modes = pair(**{"gear_1.bearing_stiffness": None, "gear_2.bearing_stiffness": None})
    dynamics = solve_pair_dynamics(case, modes)
    force, source = dynamics.response.force[:, 0], dynamics.response.source
    normal, tangent = modes.model.normal, modes.model.tangent
    assert normal @ tangent == pytest.approx(0.0, abs=1e-12)
    on_first = dynamics.motion.bearing[:, 0]
    assert np.einsum("sah,a->sh", on_first, normal) == pytest.approx(-force, rel=1e-9, abs=1e-9)
    assert np.einsum("sah,a->sh", on_first, tangent) == pytest.approx(source[:, 0], rel=1e-9, abs=1e-9)
    assert on_first == pytest.approx(-dynamics.motion.bearing[:, 1])
    friction = modes.excitation.source[0]
    assert np.abs(friction).max() < 1.01 * 0.06 * modes.excitation.force.max()
    assert dynamics.friction_change.shape == (len(case.operation.speeds), 2)


def test_the_mean_of_what_is_lost_is_taken_at_the_other_end():
    _, _, modes = pair()
    rigid = modes.modes.frequency == 0.0
    assert rigid.sum() == 1
    work = modes.modes.source_load[rigid] @ modes.excitation.source
    assert abs(work.mean()) < 1e-9 * np.abs(work).max()


@pytest.mark.parametrize(
    ("angles", "foundation", "allowed"),
    [
        (None, "1e10 N/m^3", 2e-3),
        pytest.param(UNEVEN, "1e12 N/m^3", 4e-3, marks=pytest.mark.slow),
        pytest.param(UNEVEN, "1e10 N/m^3", 4e-2, marks=pytest.mark.slow),
    ],
)
def test_a_set_at_rest_is_in_the_equilibrium_of_its_statics(angles, foundation, allowed):
    """A heavy brake stands still, as the carrier does in the statics.

    These leave out what friction bends along the tangent: how a soft ring then shares the load of uneven planets.
    """
    soft = {f"ring.foundation_{way}": foundation for way in ("radial", "tangential")}
    _, _, modes = planetary(angles, **{"brake.inertia": "1e6 kg m^2"}, **soft)
    response = solve_spectral(
        modes.modes, modes.excitation, 0.1, excitation_harmonics=20, response_harmonics=60, tolerance=1e-9
    )
    static = modes.excitation.every_harmonic[2][:, :10]
    apart = np.abs(response.force[0, :, :10] - static)
    assert apart.max() < allowed * np.abs(static[:, 1]).max()


@pytest.mark.slow
def test_without_friction_all_is_as_before():
    case, _, modes = planetary()
    plain = with_values(case, {"losses": None})
    before = solve_modes(plain, solve_static(plain))
    for name in ("stiffness", "deflection", "force"):
        assert np.array_equal(getattr(modes.frictionless, name), getattr(before.excitation, name))
    assert before.frictionless is None
    assert before.excitation.source is None
    dynamics, other = solve_dynamics(case, *planetary()[1:]), solve_dynamics(plain, solve_static(plain), before)
    levels = [order_level(solve_housing(c, d).exact) for c, d in ((case, dynamics), (plain, other))]
    assert dynamics.friction_change == pytest.approx(20.0 * np.log10(levels[0] / levels[1]), abs=0.05)


OUT_OF_PHASE = {
    **{"sun.teeth": 26, "ring.teeth": 106, "set.centre_distance": "49.8 mm"},
    **{"sun.profile_shift": None, "ring.profile_shift": None, "sun.tip_diameter": None},
}


@pytest.mark.slow
@pytest.mark.parametrize("error", [{}, {"set.pin_errors": [{"planet": 1, "tangential": "5 um"}]}])
def test_equal_planets_out_of_phase_make_multiples_of_their_number_alone(error):
    """Carrier orders at the sensor, of which none is left out: 106, that of the mesh, needs planets that differ."""
    case = with_values(
        read_case(CASES / "planetary_27_40_108.toml"),
        ACTS | COARSE | {"operation.speeds": ["250 rpm"]} | OUT_OF_PHASE | error,
    )
    static = solve_static(case)
    modes = replace(solve_modes(case, static), symmetry=1)
    lines = solve_housing(case, solve_dynamics(case, static, modes)).exact
    strength = np.abs(lines.displacement[0]) / np.abs(lines.displacement[0]).max()
    other = np.mod(lines.order, 3) > 0.5
    assert other.sum() > 1000 and 106 in lines.order[other]
    if error:
        assert strength[other].max() > 1e-3 and strength[lines.order == 106] > 1e-6
    else:
        assert strength[other].max() < 1e-9


def test_the_statics_lose_what_the_losses_say_to_first_order():
    case, static, _ = pair()
    plain = with_values(case, {"losses.excites": False})
    cycle, gears, (kind,) = static.cycle, static.planetary_set, static.planetary_set.kinds
    levers = np.tan(kind.working_pressure_angle), gears.gears[1].base_radius
    arc = cycle.force + cycle.friction_force * levers[0] - cycle.friction_moment / levers[1]
    passed = arc.mean() * gears.gears[0].base_radius / abs(static.sun_torque)
    loss = 1.0 - solve_losses(plain, solve_static(plain)).points[0].flow.efficiency
    # of 0.9 % a few per cent are of the second order, or of the places between positions
    assert 1.0 - passed == pytest.approx(loss, rel=0.05)


@cache
def helical():
    changed = ACTS | {"static.flank_elements": 8, "carrier.inertia": "1e6 kg m^2", "helical.slices": 3}
    case = with_values(read_case(CASES / "helical_30_20_70.toml"), changed | {"operation.speeds": ["1000 rpm"]})
    return case, solve_helical_modes(case, solve_helical_static(case))


def test_helical_teeth_at_rest_are_in_the_equilibrium_of_their_statics():
    """A heavy carrier stands still; planets share as their pins let them, their sum is the load."""
    _, modes = helical()
    response = solve_spectral(modes.modes, modes.excitation, 0.01, excitation_harmonics=12, response_harmonics=60)
    static = modes.excitation.every_harmonic[2][:, :8].reshape(2, -1, 8).sum(axis=1)
    assert np.abs(static[:, 1:]).max() > 1e-3 * static[0, 0].real
    moving = response.force[0, :, :8].reshape(2, -1, 8).sum(axis=1)
    assert np.abs(moving - static).max() < 1e-4 * np.abs(static[:, 1:]).max()


def test_helical_teeth_without_friction_are_quieter():
    case, modes = helical()
    dynamics = solve_helical_dynamics(case, modes)
    plain = with_values(case, {"losses": None})
    before = solve_helical_modes(plain, solve_helical_static(plain))
    assert modes.frictionless.force == pytest.approx(before.excitation.force, rel=1e-12)
    levels = [
        (np.abs(loads["support"][0, :, :3, 1:]) ** 2).sum()
        for loads in (dynamics.loads, solve_helical_dynamics(plain, before).loads)
    ]
    assert dynamics.friction_change == pytest.approx(10.0 * np.log10(levels[0] / levels[1]), abs=1e-3)
    assert dynamics.friction_change[0] > 1.0


def test_friction_works_by_the_sliding_of_rigid_gears_alone():
    """Turning without strain slides at the pitch point by nothing, and beside it by the relative speed of the gears."""
    of_pair, of_set, of_helical = pair(), planetary(), helical()
    for gears, system, basis in (
        (of_pair[1].planetary_set, of_pair[2].model.system, of_pair[2].modes),
        (of_set[1].planetary_set, of_set[2].model.system, of_set[2].modes),
        (of_helical[1].planetary_set, of_helical[1].system, of_helical[1].modes),
    ):
        (turning,) = basis.shape[:, basis.frequency == 0.0].T
        columns, scale = system.W.shape[1], np.abs(turning).max()
        slid, turned = np.split((system.sources.T @ turning)[:-1].reshape(2, columns), 2)
        assert max(np.abs(slid).max(), np.abs(system.W.T @ turning).max()) < 1e-8 * scale
        relative = [sliding_per_path(kind) / kind.gear_1.base_radius for kind in gears.kinds]
        rolling = turned.reshape(len(relative), -1) / np.array(relative)[:, None]
        assert rolling == pytest.approx(np.full(rolling.shape, rolling[0, 0]))


def test_the_verdict_says_what_friction_adds():
    speeds = np.array([250.0, 3100.0])
    change = xr.DataArray([24.2, 2.94], dims="speed", coords={"speed": speeds}, attrs={"long_name": "added"})
    run = SimpleNamespace(stages=("dynamics",), dynamics=xr.Dataset({"friction_change": change}))
    assert friction_rows(run, Marks([])) == [("added", "+24.2 dB at 250 rpm, +2.9 dB at 3100 rpm")]
    assert friction_rows(SimpleNamespace(stages=("dynamics",), dynamics=xr.Dataset()), Marks([])) == []
    assert friction_rows(SimpleNamespace(stages=()), Marks([])) == []
    marks = Marks([Finding("W-FRICTION", "losses.friction", "coefficient of the first speed")])
    ((_, marked),) = friction_rows(run, marks)
    assert marked.count("†") == 2, "every figure carries the mark of the finding"


def test_files_have_friction_where_it_acts_alone():
    case, static, _ = planetary()
    data = static.dataset()
    assert data["friction_force"].dims == data["friction_moment"].dims == ("mesh", "position")
    assert np.array_equal(data["friction_force"], static.cycle.friction_force)
    assert data["friction_moment"].attrs["units"] == "N m"
    assert case.losses.excites


def test_sources_are_those_of_the_loaded_state():
    _, _, modes = planetary()
    state, source = modes.state, modes.excitation.source
    count = source.shape[1]
    assert np.array_equal(source[:6], -state.resampled("friction_force", count))
    assert np.array_equal(source[6:12], -state.resampled("friction_moment", count))
    assert np.ptp(source[12]) == 0.0
    assert harmonics_of(source[:6], 3)[:, 1] == pytest.approx(source_harmonics(modes.excitation, 1)[:6, 1])
