"""Micro-geometry and errors in the contact problem: closed forms, reversal, invariances."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.flank_pairs import mesh_pairs
from femgear.contact.supports import Supports
from femgear.fe.elasticity import Material
from femgear.gears.deviations import Runout, common_period, no_deviations
from femgear.gears.modifications import FlankForm, TipRelief
from validation.planetary import reference_set

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


def relieved(gears, amount, *, length=1.0):
    """Linear tip relief of sun and planet over a share of the double-contact length."""
    pair = mesh_pairs(gears)[0]
    begin, end = pair.path
    double = end - begin - gears.base_pitch
    sun = TipRelief(amount, pair.pitch_roll_1 + end - length * double)
    planet = TipRelief(amount, pair.pitch_roll_2 - begin - length * double)
    return replace(no_deviations(gears), sun=FlankForm((sun,)), planet_sun_side=FlankForm((planet,)))


def test_rigid_gears_follow_their_relief(gears):
    """With 1e5 times the modulus of steel the transmission error is the smallest relief of all pairs."""
    stiff = Material(206e14, 0.3, 7850.0)
    rigid = make_bodies(make_sectors(gears, stiff, flank_elements=12), stiff)
    amount = 8e-6
    form = relieved(gears, amount)
    cycle = walk_mesh_cycle(gears, rigid, sun_torque=1.0, positions=64, deviations=form)
    pair = mesh_pairs(gears)[0]
    begin, end = pair.path
    double = end - begin - gears.base_pitch
    expected = []
    for tau in cycle.position:
        zeta = gears.base_pitch * (tau + np.arange(-3, 4))
        zeta = zeta[(zeta > begin) & (zeta < end)]
        late = np.clip((zeta - (end - double)) / double, 0, None)
        early = np.clip((begin + double - zeta) / double, 0, None)
        expected.append(amount * (late + early).min())
    inside = np.array(expected) < 1e-12
    assert 10 < inside.sum() < 60
    assert cycle.deflection[0][inside] == pytest.approx(0.0, abs=2e-9)
    # where two relieved pairs share, the flanks' slope lets them touch a little beside the line of action
    assert cycle.deflection[0] == pytest.approx(expected, abs=0.05 * amount)


def test_relief_made_for_a_torque_quietens_the_mesh_there(gears, bodies):
    """Harris map: peak-to-peak under 25 % of the unmodified mesh at the design torque, least there."""
    torques = (50.0, 100.0, 200.0)
    plain = [np.ptp(walk_mesh_cycle(gears, bodies, sun_torque=t, positions=32).deflection[0]) for t in torques]
    made = relieved(gears, 3.9e-6, length=0.9)
    quiet = [
        np.ptp(walk_mesh_cycle(gears, bodies, sun_torque=t, positions=32, deviations=made).deflection[0])
        for t in torques
    ]
    assert quiet[1] < 0.25 * plain[1]
    assert quiet[1] < min(quiet[0], quiet[2])


def test_pin_errors_do_not_unbalance_three_planets_on_a_floating_sun(gears, bodies):
    errors = replace(no_deviations(gears), pin_errors=np.array([[3e-6, 6e-6], [-2e-6, 0.0], [0.0, -4e-6]]))
    fixed, floating = (
        walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4, deviations=errors, supports=s)
        for s in (Supports(), Supports(sun=0.0))
    )
    assert np.abs(floating.load_share - 1 / 3).max() < 1e-9
    assert np.abs(fixed.load_share - 1 / 3).max() > 0.1


def test_pin_error_that_unloads_a_planet_is_reported(gears, bodies):
    errors = replace(no_deviations(gears), pin_errors=np.array([[0.0, 30e-6], [0.0, 0.0], [0.0, 0.0]]))
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4, deviations=errors)
    assert cycle.open_planets[0].all() and "lose all load" in cycle.message
    assert cycle.residual.max() < 1e-9


def test_common_displacement_of_all_pins_only_turns_the_sun(gears, bodies):
    """The same tangential error on every pin shifts the origin of the transmission error, nothing else."""
    e = 7e-6
    errors = replace(no_deviations(gears), pin_errors=np.array([[0.0, e]] * 3))
    plain = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8)
    shifted = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8, deviations=errors)
    alpha = gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring
    assert shifted.force == pytest.approx(plain.force, rel=1e-9)
    assert shifted.stiffness == pytest.approx(plain.stiffness, rel=1e-6)
    turned = shifted.sun_arc - plain.sun_arc
    assert turned == pytest.approx(e * (np.cos(alpha[0]) + np.cos(alpha[1])), rel=1e-6)


def test_reversal_is_the_mirror_image_with_mirrored_errors(gears, bodies):
    """-T with errors mirrored in the line through planet 1 gives the mirrored loads."""
    pins = np.array([[2e-6, 5e-6], [-1e-6, 0.0], [3e-6, -2e-6]])
    errors = replace(no_deviations(gears), pin_errors=pins)
    # the mirror image swaps planets 2 and 3 and turns tangential errors round
    mirrored = replace(no_deviations(gears), pin_errors=pins[[0, 2, 1]] * np.array([1.0, -1.0]))
    one = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8, deviations=errors)
    two = walk_mesh_cycle(gears, bodies, sun_torque=-TORQUE, positions=8, deviations=mirrored)
    order, back = [0, 2, 1, 3, 5, 4], -np.arange(8) % 8
    assert two.force[order][:, back] == pytest.approx(one.force, rel=1e-9)
    assert two.deflection[order][:, back] == pytest.approx(one.deflection, rel=1e-9)


def test_runout_of_the_sun_repeats_with_its_turn(gears, bodies):
    """27 mesh periods; the load of a planet follows the eccentricity once a turn of the sun."""
    errors = replace(no_deviations(gears), sun_runout=Runout(2e-6, 0.3))
    periods, message = common_period(errors, gears)
    assert periods == 27 and "27" in message
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4, deviations=errors, periods=periods)
    assert cycle.position[-1] == 26.75
    order = np.abs(np.fft.rfft(cycle.load_share[0][::4]))
    assert order[1:].argmax() == 0
    # three planets see the same, a third of a turn later
    assert cycle.load_share[1] == pytest.approx(np.roll(cycle.load_share[0], 36), abs=2e-3)


def test_single_pitch_error_passes_every_planet_once(gears, bodies):
    """A sun tooth 3 um forward of its place carries more in each of the three meshes, once a turn."""
    pitch = np.zeros(27)
    pitch[5] = -3e-6
    errors = replace(no_deviations(gears), sun_pitch=pitch)
    periods, _ = common_period(errors, gears)
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=2, deviations=errors, periods=periods)
    share = cycle.load_share.reshape(3, 27, 2).max(axis=2)
    peaks = share.argmax(axis=1)
    assert (share.max(axis=1) > 0.4).all()
    assert sorted(np.diff(np.sort(peaks))) == [9, 9]
