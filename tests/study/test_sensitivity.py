"""Derivatives of transmission error and load sharing: kinematics, whole solutions, Monte Carlo."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError
from femgear.gears.deviations import no_deviations
from femgear.gears.modifications import FlankForm, MeasuredProfile
from femgear.study.relief import design_basis, two_pair_length, with_tip_relief
from femgear.study.samples import Tolerances, sample_model, spring_numbers
from femgear.study.sensitivity import linearise, pin_differences, pin_sensitivities, sensitivity
from femgear.trains.reading import read_case, with_value

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
TORQUE = 100.0
SPRUNG = Supports(sun=5e7, carrier=2e8, planet=3e8)


@pytest.fixture(scope="module")
def basis():
    return design_basis(with_value(read_case(CASE), "static.flank_elements", 8))


def linear_contact(basis, *, positions=64, **options):
    return linearise(replace(basis, positions=positions), **options)


def relief_amount(gears, *, length, back=False):
    """Deviations with a tip relief, for its amount [m]."""
    return lambda value: with_tip_relief(None, gears, amount=value, length=length, back=back)


def pin_error(deviations, *, planet, direction):
    """Deviations with one planet's axis displaced [m]: radial outwards, tangential counter-clockwise."""
    unit = np.zeros((len(deviations.pin_errors), 2))
    unit[planet - 1, ("radial", "tangential").index(direction)] = 1.0
    return lambda value: replace(deviations, pin_errors=deviations.pin_errors + value * unit)


def tooth_pitch_error(deviations, gears, *, gear, tooth, planet=1):
    """Deviations with one tooth displaced [m] along the reference circle, counter-clockwise.

    The tooth moves as a whole: its left flank towards its mate, its right flank away from it; along the line
    of action by r_b/r of that.
    """
    found = getattr(gears, gear)
    along = found.base_radius / found.reference_radius
    place = (planet - 1, tooth) if gear == "planet" else tooth
    signs = {f"{gear}_pitch": -1.0} | ({"planet_ring_side_pitch": 1.0} if gear == "planet" else {})

    def variant(value):
        arrays = {name: np.array(getattr(deviations, name)) for name in signs}
        for name, sign in signs.items():
            arrays[name][place] += sign * along * value
        return replace(deviations, **arrays)

    return variant


def parameter(name, gears, back):
    """A parameter, its value and a step that leaves the touching cells the same."""
    base = with_tip_relief(None, gears, amount=4e-6, length=0.9, back=back)
    return {
        "amount": (relief_amount(gears, length=0.9, back=back), 4e-6, 1e-10),
        "length": (
            lambda value: with_tip_relief(None, gears, amount=4e-6, length=value, back=back),
            0.9,
            1e-5,
        ),
        "tangential": (pin_error(base, planet=2, direction="tangential"), 0.0, 1e-10),
        "radial": (pin_error(base, planet=3, direction="radial"), 0.0, 1e-10),
    }[name]


def differences(gears, bodies, variant, value, step, **options):
    """Central differences of whole solutions: sun_arc, deflection, share."""
    low, high = (walk_mesh_cycle(gears, bodies, deviations=variant(value + h), **options) for h in (-step, step))
    names = "sun_arc", "deflection", "load_share"
    return [(getattr(high, name) - getattr(low, name)) / (2 * step) for name in names]


def agree(found, expected, scale):
    assert np.abs(found - expected).max() < 1e-5 * scale


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
@pytest.mark.parametrize("supports", [RIGID, Supports(sun=0.0), SPRUNG], ids=["fixed", "floating", "sprung"])
@pytest.mark.parametrize("name", ["amount", "length", "tangential", "radial"])
def test_derivatives_are_those_of_whole_solutions(basis, name, supports, torque):
    gears = basis.gears
    variant, value, step = parameter(name, gears, torque < 0)
    options = {"sun_torque": torque, "positions": 3}
    linear = linear_contact(replace(basis, deviations=variant(value), supports=supports), **options)
    found = sensitivity(linear, variant, value, step=step)
    options["supports"] = supports
    arc, deflection, share = differences(gears, basis.bodies, variant, value, step, **options)
    assert np.abs(arc).max() > 0
    agree(found.sun_arc, arc, np.abs(arc).max())
    agree(found.deflection, deflection, np.abs(deflection).max())
    # what a parameter does to shares is at most what the same separation at one planet does
    unit = np.abs(deflection).max() * linear.force.max() / linear.deflection.max() / linear.load
    agree(found.share, share, unit)


def test_the_linearised_solution_is_that_of_the_walk(basis):
    variant, value, _ = parameter("amount", basis.gears, False)
    options = {"sun_torque": TORQUE, "positions": 8}
    held = {"supports": SPRUNG, "deviations": variant(value)}
    linear = linear_contact(replace(basis, **held), **options)
    cycle = walk_mesh_cycle(basis.gears, basis.bodies, **held, **options)
    for name in ("position", "sun_arc", "deflection", "force"):
        np.testing.assert_allclose(getattr(linear, name), getattr(cycle, name), rtol=1e-11)
    some = linear_contact(replace(basis, **held), only=[5, 2], **options)
    np.testing.assert_allclose(some.sun_arc, cycle.sun_arc[[5, 2]], rtol=1e-11)


@pytest.mark.parametrize(
    ("gear", "torque"), [("sun", TORQUE), ("sun", -TORQUE), ("planet", TORQUE), ("planet", -TORQUE)]
)
def test_pitch_error_of_one_tooth(basis, gear, torque):
    """Over a whole turn; under the negative torque over a record that does not close."""
    gears, teeth = basis.gears, {"sun": 27, "planet": 40}[gear]
    variant = tooth_pitch_error(no_deviations(gears), gears, gear=gear, tooth=teeth - 3, planet=2)
    options = {"sun_torque": torque, "positions": 1, "periods": teeth if torque > 0 else teeth - 5}
    linear = linear_contact(basis, **options)
    found = sensitivity(linear, variant, 0.0, step=1e-10)
    arc, deflection, _ = differences(gears, basis.bodies, variant, 0.0, 1e-10, **options)
    assert 0 < np.count_nonzero(np.abs(arc) > 1e-6) < teeth / 3
    agree(found.sun_arc, arc, np.abs(arc).max())
    agree(found.deflection, deflection, np.abs(deflection).max())


def test_pitch_error_of_a_tooth_of_the_ring(basis):
    """Planet 1 passes tooth 2 of the ring in the third mesh period, counted against the ring's numbers."""
    gears, options = basis.gears, {"sun_torque": TORQUE, "positions": 1, "periods": 108}
    variant = tooth_pitch_error(no_deviations(gears), gears, gear="ring", tooth=2)
    linear = linear_contact(basis, **options)
    found = sensitivity(linear, variant, 0.0, step=1e-10)
    touched = np.flatnonzero(np.abs(found.sun_arc) > 1e-6)
    # three planets pass it a third of a turn apart
    assert 3 <= len(touched) <= 9 and len(np.unique(touched // 36)) == 3
    np.testing.assert_allclose(found.sun_arc[:36], found.sun_arc[36:72], atol=1e-9)


def test_a_pitch_error_is_that_of_the_case_file(basis):
    from femgear.case.gear_set import set_deviations

    gears = basis.gears
    for gear, teeth, attributes in (
        ("sun", 27, ["sun_pitch"]),
        ("planet", 40, ["planet_pitch", "planet_ring_side_pitch"]),
    ):
        errors = {"cumulative_pitch": [f"{4 if i == 5 else 0} um" for i in range(teeth)]}
        key, entry = ("sun.errors", errors) if gear == "sun" else ("planet.individual", [{"planet": 3, **errors}])
        read = set_deviations(with_value(read_case(CASE), key, entry))
        made = tooth_pitch_error(no_deviations(gears), gears, gear=gear, tooth=5, planet=3)(4e-6)
        for name in attributes:
            assert np.abs(getattr(read, name)).max() > 3e-6
            np.testing.assert_allclose(getattr(made, name), getattr(read, name), atol=1e-15)


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_pins_that_all_move_alike_turn_or_widen_the_set(basis, torque):
    """Willis: the carrier turned by e/a turns the sun by (1 + z_r/z_s) e/a against the fixed ring."""
    gears, sign = basis.gears, math.copysign(1.0, torque)
    linear = linear_contact(basis, sun_torque=torque, positions=4)

    def arc(direction):
        def variant(value):
            errors = np.zeros((3, 2))
            errors[:, ("radial", "tangential").index(direction)] = value
            return replace(no_deviations(gears), pin_errors=errors)

        return sensitivity(linear, variant, 0.0, step=1e-7)

    turned = arc("tangential")
    expected = gears.sun.base_radius * (1 + 108 / 27) / gears.centre_distance
    np.testing.assert_allclose(turned.sun_arc, sign * expected, rtol=1e-9)
    # a larger centre distance opens sun-planet flanks and closes those of planet and ring
    widened = arc("radial")
    angles = gears.working_pressure_angle_sun_planet, gears.working_pressure_angle_planet_ring
    np.testing.assert_allclose(widened.sun_arc, math.sin(angles[0]) - math.sin(angles[1]), rtol=1e-6)
    for found in (turned, widened):
        np.testing.assert_allclose(found.share, 0.0, atol=1e-4)


def test_material_off_a_whole_flank_turns_the_sun_by_as_much(basis):
    gears = basis.gears
    ends = tuple(sorted((gears.sun.form_roll, gears.sun.tip_roll)))

    def variant(value):
        return replace(no_deviations(gears), sun=FlankForm((MeasuredProfile(ends, (value, value)),)))

    linear = linear_contact(replace(basis, deviations=variant(1e-6)), sun_torque=TORQUE, positions=4)
    found = sensitivity(linear, variant, 1e-6, step=1e-7)
    np.testing.assert_allclose(found.sun_arc, 1.0, rtol=1e-9)
    np.testing.assert_allclose(found.deflection[:3], 1.0, rtol=1e-9)
    np.testing.assert_allclose(found.deflection[3:], 0.0, atol=1e-9)


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_a_floating_sun_makes_the_shares_of_three_planets_insensitive_to_pins(basis, torque):
    """Statics: three forces through known lines balance without any elasticity."""
    options = {"sun_torque": torque, "positions": 4, "only": [1]}
    floating = linear_contact(replace(basis, supports=Supports(sun=0.0)), **options)
    fixed = linear_contact(basis, **options)
    largest = np.abs(pin_sensitivities(fixed)).max()
    assert np.abs(pin_sensitivities(floating)).max() < 1e-9 * largest


@pytest.mark.parametrize("supports", [RIGID, SPRUNG], ids=["fixed", "sprung"])
def test_linear_shares_are_those_of_monte_carlo_for_small_errors(basis, supports):
    """Sample by sample and in their spread; the springs of tooth pairs are another method."""
    basis = replace(basis, supports=supports, positions=8)
    law = {"distribution": "normal", "sigma": "0.05 um"}
    tolerances = Tolerances.model_validate({"pin_errors": {"radial": law, "tangential": law}})
    model = sample_model(basis, tolerances, sun_torque=TORQUE, positions=np.array([3 / 8]))
    errors = model.draw(6, 0, 2000)
    sampled = spring_numbers(model, errors)["planet_share"]
    pins = np.moveaxis(errors.reshape(2000, 2, 3), 1, 2)
    linear = linearise(basis, sun_torque=TORQUE, only=[3])
    slopes = pin_sensitivities(linear)[..., 0]
    shares = linear.share[:, 0] + np.einsum("nmw,smw->sn", slopes, pins)
    spread = sampled.std(axis=0)
    np.testing.assert_allclose(shares.std(axis=0), spread, rtol=0.02)
    assert np.abs(shares - sampled).max() < 0.1 * spread.max()
    # the variance that the sensitivities propagate: sigma^2 sum of squares
    np.testing.assert_allclose(0.05e-6 * np.sqrt((slopes**2).sum(axis=(1, 2))), spread, rtol=0.06)


def test_a_planet_without_load_has_no_derivative_of_its_own(basis):
    base = replace(no_deviations(basis.gears), pin_errors=[[0, 0], [0, 60e-6], [0, 0]])
    variant = pin_error(base, planet=1, direction="tangential")
    options = {"sun_torque": TORQUE, "positions": 4}
    linear = linear_contact(replace(basis, deviations=base), **options)
    assert np.all(linear.force[[1, 4]] == 0)
    found = sensitivity(linear, variant, 0.0, step=1e-10)
    arc, _, share = differences(basis.gears, basis.bodies, variant, 0.0, 1e-10, **options)
    np.testing.assert_allclose(found.sun_arc, arc, rtol=1e-5)
    np.testing.assert_allclose(found.share, share, atol=1e-5 * np.abs(share).max())
    assert np.isnan(found.deflection[[1, 4]]).all() and np.isfinite(found.deflection[[0, 2, 3, 5]]).all()


def slopes_of_extremes(signals, changes, *, step):
    """Secants of the largest peak to peak to the left and to the right, convex in the parameter.

    One-sided slopes are those of the positions that hold the extremes (J. M. Danskin, SIAM J. Appl. Math. 14,
    1966).
    """
    low, here, high = (np.ptp(signals + h * changes, axis=1).max() for h in (-step, 0.0, step))
    return (here - low) / step, (high - here) / step


def test_slopes_of_the_peak_to_peak_are_those_of_whole_solutions(basis):
    """Off the optimum from both sides, and a kink between: less relief than best falls, more rises."""
    gears, options = basis.gears, {"sun_torque": TORQUE, "positions": 8}
    variant = relief_amount(gears, length=0.9)
    for amount, sign in ((2e-6, -1), (7e-6, 1)):
        linear = linear_contact(replace(basis, deviations=variant(amount)), **options)
        found = sensitivity(linear, variant, amount, step=1e-9)
        left, right = slopes_of_extremes(linear.deflection[:3], found.deflection[:3], step=1e-10)
        peaks = [
            np.ptp(
                walk_mesh_cycle(gears, basis.bodies, deviations=variant(amount + h), **options).deflection[:3],
                axis=1,
            ).max()
            for h in (-1e-10, 0.0, 1e-10)
        ]
        assert left <= right + 1e-9 and np.sign(left) == np.sign(right) == sign
        assert (left, right) == pytest.approx(np.diff(peaks) / 1e-10, rel=1e-4)


def test_length_of_two_pair_contact(basis):
    gears = basis.gears
    # contact ratio of the reference set with its published working angle: 1.5507
    assert two_pair_length(gears) == pytest.approx(0.5507 * gears.sun.base_pitch, rel=1e-4)


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_differences_of_shares_are_their_derivatives(basis, torque):
    few = replace(basis, positions=4)
    linear = linearise(few, sun_torque=torque, only=[1])
    exact = pin_sensitivities(linear)[..., 0]
    found = pin_differences(few, sun_torque=torque, position=0.25)
    np.testing.assert_allclose(found, exact, atol=2e-3 * np.abs(exact).max())


def test_refusals(basis):
    ideal = no_deviations(basis.gears)
    loose = Supports(planet=1e8, planet_clearance=1e-6)
    with pytest.raises(CaseError, match="without torque"):
        linear_contact(basis, sun_torque=0.0)
    with pytest.raises(CaseError, match="no such position"):
        linear_contact(basis, sun_torque=1.0, positions=8, only=[8])
    with pytest.raises(CaseError, match="clearance"):
        linear_contact(replace(basis, supports=loose), sun_torque=1.0)
    linear = linear_contact(basis, sun_torque=-TORQUE, positions=1)
    with pytest.raises(CaseError, match="needs a step"):
        sensitivity(linear, pin_error(ideal, planet=1, direction="radial"), 0.0, step=0.0)
