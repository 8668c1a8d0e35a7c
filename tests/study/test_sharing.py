"""Design maps: closed forms of load sharing, the whole contact problem, minimum of the Harris map."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError, ContactError
from femgear.gears.modifications import form_deviation
from femgear.study.relief import (
    design_basis,
    harris_map,
    optimise_relief,
    relief_grid,
    relief_starts,
    sun_torque,
    with_tip_relief,
)
from femgear.study.sharing import SharingModel, pin_samples, sharing_model, sharing_of_samples, walked_shares
from femgear.trains.reading import read_case

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
TORQUE = 100.0
ALPHA = math.radians(24.6)
"""Lin and Parker, J. Vib. Acoust. 121 (1999): pressure angle, mesh stiffness 5e8 N/m, bearings."""


@pytest.fixture(scope="module")
def basis():
    from femgear.trains.reading import with_value

    return replace(design_basis(with_value(read_case(CASE), "static.flank_elements", 12)), positions=8)


def linear_model(n_planets, load, *, bearing, sun=None, others=math.inf, mesh=5e8):
    """Linear meshes, both under the angle ALPHA; the sun fixed (None), floating (0) or sprung.

    Carrier and ring rest on springs `others`.
    """
    psi = 2 * np.pi * np.arange(n_planets) / n_planets
    force = np.linspace(0.0, load, 12)
    path = 2 / mesh + (2 * math.cos(ALPHA)) ** 2 / bearing
    axis = psi + np.pi / 2 - ALPHA
    normals = np.column_stack([np.cos(axis), np.sin(axis)])
    on_ring = np.column_stack([np.cos(psi - np.pi / 2 + ALPHA), np.sin(psi - np.pi / 2 + ALPHA)])
    of_carrier = on_ring - normals
    coupling = (on_ring @ on_ring.T + of_carrier @ of_carrier.T) / others
    if sun:
        coupling += normals @ normals.T / sun
    free = normals if sun == 0 else np.zeros((n_planets, 0))
    return SharingModel(
        load=load,
        force=force,
        deflection=np.tile(force * path, (n_planets, 1)),
        coupling=coupling,
        approach=np.column_stack([np.ones(n_planets), free]),
        pin=np.tile([0.0, 2 * math.cos(ALPHA)], (n_planets, 1)),
    )


def tangential(n_planets, errors):
    pins = np.zeros((len(errors), n_planets, 2))
    pins[:, :, 1] = errors
    return pins


@pytest.mark.parametrize("floating", [True, False])
@pytest.mark.parametrize("n_planets", [3, 4])
def test_linear_meshes_share_as_the_closed_form_says(n_planets, floating):
    """F_i = W/N - k_path 2 cos(alpha) res_i: least-squares residual by {1, cos psi, sin psi} or by {1}."""
    load, bearing = 20e3, 1e8
    model = linear_model(n_planets, load, bearing=bearing, sun=0.0 if floating else None)
    errors = np.random.default_rng(3).normal(0.0, 8e-6, (50, n_planets))
    shares = sharing_of_samples(model, tangential(n_planets, errors)).share
    psi = 2 * np.pi * np.arange(n_planets) / n_planets
    columns = [np.ones(n_planets)] + ([np.cos(psi), np.sin(psi)] if floating else [])
    basis = np.linalg.qr(np.column_stack(columns))[0]
    rest = errors - errors @ basis @ basis.T
    k_path = 1 / (1 / 5e8 + 1 / 5e8 + 4 * math.cos(ALPHA) ** 2 / bearing)
    expected = 1 / n_planets - k_path * 2 * math.cos(ALPHA) * rest / load
    assert expected.min() > 0
    np.testing.assert_allclose(shares, expected, rtol=1e-6)


def test_published_shares():
    """A pin 20 um early at 20 kN: shares to the printed digits, bearings 1e8 N/m."""
    four = sharing_of_samples(linear_model(4, 20e3, bearing=1e8, sun=0.0), tangential(4, [[-20e-6, 0, 0, 0]]))
    assert four.share[0] == pytest.approx([0.2623, 0.2377, 0.2623, 0.2377], abs=5e-5)
    three = sharing_of_samples(linear_model(3, 20e3, bearing=1e8), tangential(3, [[-20e-6, 0, 0]]))
    assert three.share[0] == pytest.approx([0.366, 0.317, 0.317], abs=5e-4)


@pytest.mark.parametrize(
    ("n_planets", "sun", "forces"),
    [
        (3, 0.0, [861.1039] * 3),
        (3, 1e9, [585.99, 998.66, 998.66]),
        (4, 1e9, [326.18, 770.26, 716.60, 770.26]),
        (4, 0.0, [521.39, 770.26, 521.39, 770.26]),
    ],
)
def test_sharing_with_a_sprung_sun(n_planets, sun, forces):
    """A pin 2 um late under 2583.3118 N: an independent static solution with 3 (N + 3) coordinates.

    Its carrier and ring are held by 1e12 N/m.
    """
    load = 2583.3118
    model = linear_model(n_planets, load, bearing=1e9, sun=sun, others=1e12)
    found = sharing_of_samples(model, tangential(n_planets, [[2e-6] + [0.0] * (n_planets - 1)]))
    assert found.share[0] * load == pytest.approx(forces, abs=6e-3)


def test_a_planet_opens_under_a_large_error():
    model = linear_model(3, 1000.0, bearing=1e9)
    found = sharing_of_samples(model, tangential(3, [[1e-3, 0, 0], [0, -1e-3, 0], [0, 0, 0]]))
    np.testing.assert_allclose(found.share, [[0, 0.5, 0.5], [0, 1, 0], [1 / 3] * 3], atol=1e-9)
    assert found.open_planets.tolist() == [[True, False, False], [True, False, True], [False] * 3]
    assert found.factor == pytest.approx([1.5, 3.0, 1.0])


def test_four_planets_on_a_floating_sun_open_in_opposite_pairs():
    """Statics: the forces of opposite planets are equal, so both of a pair lose their load together."""
    model = linear_model(4, 1000.0, bearing=1e9, sun=0.0)
    found = sharing_of_samples(model, tangential(4, [[1e-3, 0, 0, 0], [0, 0, 0, -1e-3]]))
    np.testing.assert_allclose(found.share, [[0, 0.5, 0, 0.5]] * 2, atol=1e-8)


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
@pytest.mark.parametrize(
    "supports", [RIGID, Supports(sun=5e7, carrier=2e8, planet=3e8)], ids=["fixed", "sprung"]
)
def test_samples_agree_with_the_whole_contact_problem(basis, torque, supports):
    pins = pin_samples(3, samples=300, radial=3e-6, tangential=5e-6, seed=2)
    basis, options = replace(basis, supports=supports), {"sun_torque": torque, "position": 3}
    model = sharing_model(basis, **options)
    found = sharing_of_samples(model, pins)
    order = np.argsort(found.factor)
    chosen = order[[0, 100, 200, 299]]
    whole = walked_shares(basis, pins[chosen], **options)
    np.testing.assert_allclose(found.share[chosen], whole, atol=1e-3)
    assert found.residual < 1e-8 and model.coupling_change < 1e-2
    assert found.open_planets.any() == (supports == RIGID)


def test_a_floating_sun_shares_equally_among_three_planets(basis):
    model = sharing_model(replace(basis, supports=Supports(sun=0.0)), sun_torque=TORQUE)
    found = sharing_of_samples(model, pin_samples(3, samples=500, radial=5e-6, tangential=9e-6, seed=4))
    np.testing.assert_allclose(found.share, 1 / 3, rtol=1e-8)


def test_samples_are_normal_and_repeat_with_their_seed():
    pins = pin_samples(4, samples=20000, radial=2e-6, tangential=5e-6, seed=7)
    np.testing.assert_array_equal(pins, pin_samples(4, samples=20000, radial=2e-6, tangential=5e-6, seed=7))
    assert pins.std(axis=(0, 1)) == pytest.approx([2e-6, 5e-6], rel=0.02)
    assert np.abs(pins).max() > 1.5e-5
    assert np.abs(pins.mean(axis=(0, 1))).max() < 1e-7


def test_relief_starts_at_the_ends_of_single_pair_contact(basis):
    """Points B and D of the path: one base pitch from its ends, on sun and planet."""
    gears = basis.gears
    sun, planet = relief_starts(gears)
    angle = gears.working_pressure_angle_sun_planet
    line = gears.centre_distance * math.sin(angle)
    tips = [math.sqrt(g.tip_radius**2 - g.base_radius**2) for g in (gears.sun, gears.planet)]
    # the sun's single-pair contact ends a base pitch after its contact began at the planet's tip
    assert sun == pytest.approx(line - tips[1] + gears.sun.base_pitch, rel=1e-9)
    assert planet == pytest.approx(line - tips[0] + gears.sun.base_pitch, rel=1e-9)


@pytest.mark.slow
def test_the_optimum_is_far_under_the_unmodified_pair_and_the_map_has_its_minimum_there(basis):
    gears, coarse = basis.gears, replace(basis, positions=16)
    grid = relief_grid(coarse, amounts=[3e-6, 4e-6, 5e-6], lengths=[0.8, 0.9, 1.0], torques=[TORQUE])
    best = optimise_relief(coarse, grid, torque=TORQUE, max_evaluations=25)
    assert best.peak_to_peak <= grid.peak_to_peak.min() + 1e-12
    variants = [None, with_tip_relief(None, gears, amount=best.amount, length=best.length)]
    torques = [25.0, 50.0, 75.0, 100.0, 125.0, 150.0, 200.0]
    found = harris_map(replace(basis, positions=64), torques=torques, deviations=variants)
    plain, relieved = found.peak_to_peak[:, 0]
    assert relieved[3] < 0.25 * plain[3]
    assert relieved.argmin() == 3
    assert np.all(np.diff(plain) > 0)
    # the other meshes have no relief: they change by no more than the elasticity of the planet carries over
    np.testing.assert_allclose(found.peak_to_peak[1, 1], found.peak_to_peak[0, 1], rtol=0.01)


@pytest.mark.slow
def test_the_slopes_of_the_optimum_are_those_of_single_mesh_cycles(basis):
    """Same peaks as mesh cycles with the reliefs beside it; a search cut short says it is no minimum."""
    from femgear.study.relief import two_pair_length

    gears, basis = basis.gears, replace(basis, positions=16)
    grid = relief_grid(basis, amounts=[2.7e-6, 5.3e-6], lengths=[0.8, 1.2], torques=[TORQUE])
    best = optimise_relief(basis, grid, torque=TORQUE)
    assert best.minimum and best.at_end == ()
    assert min(*best.amount_slopes, *best.length_slopes) >= 0
    short = optimise_relief(basis, grid, torque=TORQUE, max_evaluations=3)
    assert not short.minimum and short.peak_to_peak > best.peak_to_peak
    away = 0.05e-3 / two_pair_length(gears)
    places = [(best.amount + d, best.length) for d in (-0.1e-6, 0.1e-6)]
    places += [(best.amount, best.length + d) for d in (-away, away)]
    variants = [with_tip_relief(None, gears, amount=a, length=length) for a, length in places]
    found = harris_map(basis, torques=[TORQUE], deviations=variants)
    rises = found.peak_to_peak[:, 0, 0] - best.peak_to_peak
    np.testing.assert_allclose(rises[:2], 0.1e-6 * np.array(best.amount_slopes), atol=1e-13)
    np.testing.assert_allclose(rises[2:], 0.05e-3 * np.array(best.length_slopes), atol=1e-13)


def test_the_optimum_is_marked_under_its_torque_alone():
    from tip_relief_design import relief_contours

    amounts, lengths = np.array([2e-6, 4e-6, 6e-6]), np.array([0.4, 0.8, 1.2])
    ratios = np.array([np.full((3, 3), 0.8), [[0.9, 0.6, 0.1], [0.7, 0.5, 0.4], [0.9, 0.8, 0.7]]])
    figure = relief_contours(amounts, lengths, ratios, [50.0, 100.0], optimum=(3e-6, 1.1), design=100.0)
    names = [ax.get_legend_handles_labels()[1] for ax in figure.axes[:2]]
    assert names == [["chosen for 100 N m"], ["25% of unmodified", "optimum at 100 N m"]]
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == {name for one in names for name in one}
    faces = [ax.lines[-1].get_markerfacecolor() for ax in figure.axes[:2]]
    assert faces[0] == "white" and faces[1] == figure.axes[1].lines[-1].get_color()


def test_a_map_of_negative_torques_is_that_of_positive_ones(basis):
    gears = basis.gears
    peaks = []
    for sign in (1, -1):
        variant = with_tip_relief(None, gears, amount=4e-6, length=0.9, back=sign < 0)
        found = harris_map(basis, torques=[sign * TORQUE], deviations=[variant])
        peaks.append(found.peak_to_peak)
    np.testing.assert_allclose(peaks[0], peaks[1], rtol=1e-9)


def test_the_tables_for_the_case_file_mean_the_same_relief(basis, tmp_path):
    from tip_relief_design import relief_tables

    from femgear.case.gear_set import set_deviations

    gears = basis.gears
    text = relief_tables(gears, amount=4e-6, length=0.9, power=2.0, back=False)
    path = tmp_path / "case.toml"
    path.write_text(CASE.read_text(encoding="utf-8") + "\n" + text, encoding="utf-8")
    case = read_case(path)
    read, made = set_deviations(case), with_tip_relief(None, gears, amount=4e-6, length=0.9, power=2.0)
    for name, gear in (("sun", gears.sun), ("planet_sun_side", gears.planet)):
        roll = np.linspace(gear.form_roll, gear.tip_roll, 50)
        removed = [form_deviation(getattr(d, name), gear, roll) for d in (read, made)]
        np.testing.assert_allclose(*removed, atol=1e-10)
        assert removed[0].max() == pytest.approx(4e-6, rel=1e-6)
    assert not read.planet_ring_side.modifications
    assert planetary_set(case) == gears


def test_supports_are_those_of_the_static_stage():
    from femgear.trains.reading import with_value
    from femgear.trains.static.stages import case_supports

    case = with_value(read_case(CASE), "planet.bearing_clearance", "3 um")
    assert case_supports(case) == Supports(sun=5e7, carrier=2e8, planet=3e8, planet_clearance=3e-6)


def test_refusals(basis):
    gears = basis.gears
    with pytest.raises(CaseError, match="differ from zero"):
        harris_map(basis, torques=[10.0, 0.0], deviations=[None])
    with pytest.raises(CaseError, match="both signs"):
        relief_grid(basis, amounts=[1e-6], lengths=[1.0], torques=[1.0, -1.0])
    with pytest.raises(CaseError, match="not plausible"):
        relief_starts(gears, length=2.0)
    with pytest.raises(CaseError, match="nothing touches"):
        sharing_model(basis, sun_torque=0.0)
    with pytest.raises(CaseError, match="no such position"):
        sharing_model(basis, sun_torque=1.0, position=8)
    loose = Supports(planet=1e8, planet_clearance=1e-6)
    with pytest.raises(CaseError, match="no clearance"):
        sharing_model(replace(basis, supports=loose), sun_torque=1.0)
    with pytest.raises(CaseError, match="number of samples"):
        pin_samples(3, samples=0, radial=1e-6, tangential=1e-6, seed=1)
    with pytest.raises(CaseError, match="negative"):
        pin_samples(3, samples=1, radial=-1e-6, tangential=1e-6, seed=1)
    model = linear_model(3, 100.0, bearing=1e9)
    with pytest.raises(CaseError, match="shape"):
        sharing_of_samples(model, np.zeros((5, 4, 2)))
    with pytest.raises(ContactError, match="falls with its load"):
        sharing_of_samples(replace(model, deflection=-model.deflection), np.zeros((1, 3, 2)))
    with pytest.raises(CaseError, match="no tooth bends"):
        sun_torque(read_case(CASE), gears, 0.0)


@pytest.mark.parametrize("sun", [None, 0.0, 1e8])
def test_newton_agrees_with_the_general_contact_solver(sun):
    """Five planets, many open; without steps of Newton every sample is a contact problem of its own."""
    model = linear_model(5, 4000.0, bearing=1e9, sun=sun)
    # paths that stiffen under load, as line contacts do
    model = replace(model, deflection=4e-6 * (model.deflection / model.deflection.max()) ** 0.7)
    pins = pin_samples(5, samples=60, radial=1e-6, tangential=3e-6, seed=9)
    fast, slow = sharing_of_samples(model, pins), sharing_of_samples(model, pins, max_steps=0)
    assert fast.open_planets.any()
    np.testing.assert_allclose(fast.share, slow.share, atol=1e-7)
