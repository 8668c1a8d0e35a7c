"""Extremes between the positions of a mesh cycle, against 512 and 1024 equidistant ones."""

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set
from random_sets import random_set

from femgear.case.dependencies import Steps
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.peaks import TOLERANCE, open_places, peak_doubt, pitch_passages, tooth_pair_codes
from femgear.stages.static import solve_static, solve_stress
from femgear.study.objectives import transmission_error
from femgear.study.relief import design_basis, harris_map, sun_torque, with_tip_relief
from femgear.trains.drafts import new_case
from femgear.trains.live import Answer
from femgear.trains.reading import read_case, with_values

PEAKS = CycleOptions(peaks=True)


def settled(curve, count, codes=lambda tau: np.zeros(len(tau), int)):
    """Peak to peak of a curve by halving, from equidistant positions, and the doubt that is left."""
    tau, doubt = np.arange(count) / count, 0.0
    for _ in range(20):
        places, doubt = open_places(tau, curve(tau)[None], codes(tau)[None], np.array([1e-12]), 1)
        if not len(places):
            break
        tau = np.sort(np.append(tau, places))
    return np.ptp(curve(tau)), doubt, len(tau) - count


@pytest.mark.parametrize("count", [8, 16, 33, 64])
@pytest.mark.parametrize("place", [0.3, 0.41234, 0.999])
def test_a_cusp_between_positions_is_found(count, place):
    """The height of a ridge of two straight lines is one."""
    found, doubt, _ = settled(lambda tau: 1.0 - 2.0 * np.abs((tau - place + 0.5) % 1.0 - 0.5), count)
    assert found == pytest.approx(1.0, abs=TOLERANCE)
    assert doubt <= TOLERANCE


def test_smooth_curves_need_no_further_positions():
    found, doubt, added = settled(lambda tau: np.cos(2.0 * np.pi * tau), 32)
    assert (found, added) == (pytest.approx(2.0, abs=1e-12), 0) and doubt < TOLERANCE


def test_a_peak_that_slopes_do_not_show_lies_where_pairs_change():
    """A ridge over a sixteenth of the period, between two of 16 positions, where another pair carries."""

    def curve(tau):
        return np.maximum(1.0 - 32.0 * np.abs(tau - 0.5312), 0.0)

    assert settled(curve, 16)[0] < 0.01
    found = settled(curve, 16, lambda tau: (tau > 0.53).astype(int))[0]
    assert found == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("count", [8, 16, 64, 256])
def test_a_curve_that_jumps_is_enclosed_at_both_sides_of_each_jump(count):
    """A slope of one, three jumps up of two, then jumps down: 6 + 0.32 just before the first of these."""
    up, down = np.array([0.27, 0.29, 0.30]), np.array([0.32, 0.33])

    def states(tau):
        return (tau[:, None] > up).sum(axis=1), (tau[:, None] > down).sum(axis=1)

    def curve(tau):
        more, less = states(tau)
        return tau + 2.0 * more - 3.5 * less

    tau, least, jumps, doubt = np.arange(count) / count, np.array([1e-12]), np.array([True]), 1.0
    for _ in range(20):
        codes = 10 * states(tau)[0] + states(tau)[1]
        places, doubt = open_places(tau, curve(tau)[None], codes[None], least, 1, np.array([0]), jumps)
        if not len(places):
            break
        tau = np.sort(np.append(tau, places))
    assert doubt < 0.01 and curve(tau).max() == pytest.approx(6.32, abs=0.01 * 6.32)


@pytest.mark.slow
def test_stiffness_of_slices_that_begin_to_carry_one_after_the_other():
    """k of sun-planet rose from 28 to 49 N/um with the number of positions, at which slices jumped unseen."""
    case, found = read_case(new_case("planetary", torque="62.7 N m")), []
    slope = {"static.slices": 12, "sun.modifications": [{"kind": "lead slope", "amount": "20 um"}]}
    for count in (8, 64):
        coarse = {"static.positions": count, "static.flank_elements": 8, "static.stresses": False}
        cycle = solve_static(with_values(case, slope | coarse)).cycle
        assert cycle.between.doubt <= TOLERANCE
        found.append(np.ptp(np.append(cycle.stiffness[0], cycle.between.stiffness[0])))
    assert found[0] == pytest.approx(found[1], rel=0.01) and found[1] > 40e6


@pytest.mark.slow
def test_doubt_at_many_positions_is_that_at_few():
    """At 256 positions 3 % of planet-ring was left in an interval that was not halved; at 64 it was 0.2 %."""
    case = read_case(new_case("planetary", torque="0.5 N m"))
    modified = {"sun.modifications": [{"kind": "profile crowning", "amount": "8 um"}]}
    for count in (8, 64, 256):
        coarse = {"static.positions": count, "static.flank_elements": 12, "static.stresses": False}
        assert solve_static(with_values(case, modified | coarse)).cycle.between.doubt < 0.005


def test_what_is_zero_throughout_has_no_peaks():
    assert settled(np.zeros_like, 8) == (0.0, 0.0, 0)
    places, doubt = open_places(np.arange(4) / 4, np.zeros((1, 4)), np.zeros((1, 4), int), np.zeros(1), 1)
    assert not len(places) and doubt == 0.0


def test_codes_tell_which_pairs_carry():
    path = np.array([[[0.1, 0.2, 0.3], [1.1, 1.2, 1.3]]])
    load = np.array([[[1.0, 1.0, 0.0], [0.0, 2.0, 2.0]]])
    codes = tooth_pair_codes(path, load, np.array([0.1, 0.2, 0.3]), 1.0)[0]
    assert len(set(codes.tolist())) == 3
    assert tooth_pair_codes(path, np.ones((1, 2, 3)), np.array([0.1, 0.2, 0.3]), 1.0).min() == codes[1]


def test_pairs_that_have_passed_the_pitch_point_are_counted_from_the_first_path():
    """Pairs 0.4 pitches before it and 0.6 behind it: the first one passes 0.4 mesh periods later."""
    position = np.array([0.0, 0.3, 0.5, 1.5])
    path = 2e-3 * (np.array([[-0.4], [0.6]]) + position)[None]
    assert pitch_passages(path, position, 2e-3).tolist() == [[0, 0, 1, 2]]


@pytest.fixture(scope="module")
def reference():
    gears = reference_set()
    return gears, make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


def against_many(walk, count, deviations=None):
    """Largest relative difference of peaks to peaks from those of 512 positions, and of shares."""
    many, few = walk(512, None), walk(count, PEAKS)
    apart = []
    for name in ("deflection", "stiffness", "sun_arc"):
        values = getattr(many, name)
        apart.append(few.peak_to_peak(name) / np.ptp(values, axis=-1) - 1.0)
    share = few.extremes("load_share")[1] / many.load_share.max(axis=1) - 1.0
    for name in ("stiffness", "deflection"):
        # those of equidistant positions are up to 4 % off at 8, 0.4 % at 64
        assert few.mean(name) == pytest.approx(many.mean(name), rel=5e-3)
    pressure = few.extremes("max_pressure")[1], many.max_pressure.max(axis=1)
    assert deviations is not None or pressure[0] == pytest.approx(pressure[1], rel=0.02)
    return np.abs(np.hstack(apart)).max(), np.abs(share).max(), few


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE, 0.05 * TORQUE])
@pytest.mark.parametrize("count", [8, *(pytest.param(count, marks=pytest.mark.slow) for count in (16, 32, 64))])
def test_equal_planets_in_phase(reference, count, torque):
    """64 equidistant positions cut off 0.5 %, 8 nearly half of the planet-ring meshes' peak to peak."""
    gears, bodies = reference

    def walk(positions, options):
        return walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=positions, options=options)

    apart, share, few = against_many(walk, count)
    assert apart < 0.02 and share < 1e-9 and few.between.doubt < 0.03
    assert len(few.position) == count and (np.diff(few.between.position) > 0.0).all()
    assert ((few.between.position >= 0.0) & (few.between.position < 1.0)).all()


def test_rounds_of_halving_are_counted_and_their_places_mirrored_with_the_torque(reference, monkeypatch):
    """Quarters of a record of four positions, and one round: the state at -x is the image of that at x."""
    monkeypatch.setattr("femgear.contact.cycle.MOST_ROUNDS", 1)
    gears, bodies = reference
    between, image = (
        walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=4, options=PEAKS).between
        for torque in (TORQUE, -TORQUE)
    )
    assert len(between.records) == len(image.records) == 2
    assert image.position == pytest.approx(1.0 - between.position[::-1], abs=1e-12)


@pytest.mark.parametrize(
    ("seed", "count"),
    [
        (7, 8),
        *(
            pytest.param(*both, marks=pytest.mark.slow)
            for both in ((13, 8), (4, 8), (10, 8), (4, 64), (7, 64), (10, 64), (13, 64))
        ),
    ],
)
def test_random_sets_out_of_phase(seed, count, tmp_path):
    """Three to six planets, in sequence or not equally spaced, of either torque."""
    case = random_set(seed).case
    basis = design_basis(case, cache=tmp_path)
    torque = sun_torque(case, basis.gears)

    def walk(positions, options):
        options = {"sun_torque": torque, "positions": positions, "options": options}
        return walk_mesh_cycle(basis.gears, basis.bodies, supports=basis.supports, **options)

    apart, share, few = against_many(walk, count)
    assert apart < 0.02 and share < 0.005 and few.between.doubt < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_tip_relief_that_makes_the_error_small(reference, power):
    gears, bodies = reference
    relief = with_tip_relief(None, gears, amount=5e-6, length=0.9, power=power)

    def walk(positions, options):
        options = {"sun_torque": TORQUE, "positions": positions, "options": options}
        return walk_mesh_cycle(gears, bodies, deviations=relief, **options)

    for count in (8, 32):
        # under the kink of a linear relief the pressure has no limit
        apart, _, _ = against_many(walk, count, relief)
        assert apart < 0.03


@pytest.mark.slow
def test_errors_over_torque_have_no_steps(reference):
    """41 torques within 0.5 %: second differences are those of smooth curves, not of cells that move."""
    gears, bodies = reference
    relief, torques = with_tip_relief(None, gears, amount=5e-6, length=0.9), np.linspace(0.995, 1.005, 41)
    errors = np.array(
        [
            walk_mesh_cycle(gears, bodies, sun_torque=TORQUE * x, positions=8, deviations=relief).deflection
            for x in torques
        ]
    )
    # a curve over the 0.6th power of the torque bends by 0.24 of the square of its steps: 2e-8
    assert np.abs(np.diff(errors, 2, axis=0)).max() < 2e-6 * errors.mean()
    assert np.diff(errors, axis=0).min() > 0.0


@pytest.mark.slow
def test_maps_have_the_numbers_of_a_run(tmp_path):
    """Harris map, objective and static.nc of one design: the same peaks to peaks, whatever the positions."""
    case = with_values(random_set(4).case, {"static.positions": 12})
    data, basis = solve_static(case, cache=tmp_path).dataset(), design_basis(case, cache=tmp_path)
    found = harris_map(basis, torques=[sun_torque(case, basis.gears)], deviations=[basis.deviations])
    stored = data["ste_peak_to_peak"].values.reshape(2, -1).max(axis=1)
    assert found.peak_to_peak[0, :, 0] == pytest.approx(stored, rel=1e-9)
    assert found.overall[0, 0] == pytest.approx(data["ste_overall_peak_to_peak"].values[0], rel=1e-9)
    variant = Answer(case, Steps(), cache=tmp_path)
    assert transmission_error("sun-planet").compute(variant) == pytest.approx(stored[0], rel=1e-9)
    assert 0.05 < data.attrs["peaks_cut_off"] < 0.6
    assert (stored > np.ptp(data["ste"].values, axis=1).reshape(2, -1).max(axis=1)).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 13])
def test_root_stresses_and_pressures_of_few_positions(seed, tmp_path):
    """At 9 positions root stresses were up to 6 % low; all planets that are alike have the largest."""
    case = random_set(seed).case
    plain = {f"{gear}.modifications": [] for gear in ("sun", "planet", "ring")}
    few, many = (
        solve_stress(one, solve_static(one, cache=tmp_path)).dataset()
        for one in (with_values(case, plain | {"static.positions": count}) for count in (8, 256))
    )
    for name, least in (("root_worst", 0.985), ("root_range_maximum", 0.98), ("largest_pressure", 0.98)):
        assert (few[name] > least * many[name]).all() and (few[name] < many[name] / 0.985).all()
    assert (few.root_range_maximum <= few.root_worst.max() * (1.0 + 1e-9)).all()
    assert np.ptp(few.root_worst.values.reshape(2, -1, 2), axis=1).max() == 0.0
    assert few.largest_pressure.values.max() >= few.contact_pressure.values.max()
    nominal = few.iso_contact_stress / few.iso_contact_ratio_factor
    hertz = nominal * np.sqrt(few.contact_worst_load / few.nominal_load * few.contact_worst_curvature)
    # the place and load of the pair that are said make the pressure that is said
    assert few.largest_pressure.values == pytest.approx(hertz.values, rel=0.1)


def test_what_is_zero_goes_on_no_lower():
    """Of a mesh that opens the stiffness falls to zero, and not below."""
    tau = np.arange(8) / 8
    stiffness = np.array([3.0, 2.9, 1.5, 0.0, 0.0, 1.5, 2.9, 3.0])
    assert peak_doubt(tau, stiffness[None], np.array([1e-3]), 1) < 0.05
    assert peak_doubt(tau, stiffness[None] + 1.0, np.array([1e-3]), 1) > 0.2


def test_a_record_that_does_not_close_has_its_end():
    """A ramp that starts anew: what lies beyond the last position is no way back to the first."""
    tau, ramp = np.arange(9) / 8, np.arange(9.0)
    places, doubt = open_places(tau, ramp[None], np.zeros((1, 9), int), np.zeros(1), 1)
    assert not len(places) and doubt == 0.0


def test_where_pairs_change_a_curve_may_rise_by_its_steepest_slope_nearby():
    """Half of the rise that the slope before it, of 5 a period, makes over an interval of 0.2 periods."""
    position, curve = np.arange(5) / 5.0, np.array([[0.0, 0.0, 1.0, 1.0, 1.0]])
    other = np.arange(5) == 2
    assert peak_doubt(position, curve, np.array([1e-3]), 1, other) == pytest.approx(0.5, rel=1e-12)
    assert peak_doubt(position, curve, np.array([1e-3]), 1) == 0.0
