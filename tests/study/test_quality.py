"""Errors by a flank tolerance class of ISO 1328-1: what is drawn keeps to what is measured."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.errors import FemgearError
from femgear.gears.tolerances import flank_tolerances, tolerances_of_gear
from femgear.study.entry_tolerances import read_entry_tolerances
from femgear.study.quality import KUIPER, laws_of_class, limit_of_entry, pitch_sigma
from femgear.study.relief import design_basis
from femgear.study.samples import Tolerances, prepared, sample_model, with_classes
from femgear.trains.reading import read_case, with_value

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"


@pytest.fixture(scope="module")
def case():
    return read_case(CASE)


def test_tolerances_are_those_of_the_size_of_the_gear(case):
    sun = planetary_set(case).sun
    ours = tolerances_of_gear(sun, 6)
    assert ours == flank_tolerances(6, diameter=40.5e-3, normal_module=1.5e-3, face_width=25e-3)
    helical = planetary_set(read_case(CASE.with_name("helical_30_20_70.toml"))).sun
    by_hand = flank_tolerances(6, diameter=2.0 * helical.reference_radius, normal_module=1.6e-3, face_width=0.03)
    assert tolerances_of_gear(helical, 6).pitch == by_hand.pitch


def test_the_range_of_a_bridge_is_that_of_kuiper():
    """P(V > v) = 2 sum (4 k^2 v^2 - 1) exp(-2 k^2 v^2), 0.27 % at three standard deviations."""
    k = np.arange(1, 20)
    beyond = 2.0 * np.sum((4.0 * k**2 * KUIPER**2 - 1.0) * np.exp(-2.0 * k**2 * KUIPER**2))
    assert beyond == pytest.approx(2.7e-3, rel=0.02)


@pytest.mark.parametrize("gear", ["sun", "planet", "ring"])
@pytest.mark.parametrize("tolerance_class", [4, 8])
def test_what_is_drawn_measures_within_its_tolerances(case, gear, tolerance_class):
    """Single pitch, cumulative pitch and runout of ten thousand gears, as a measuring machine reads them."""
    made, count = getattr(planetary_set(case), gear), 10_000
    tolerances, rng = tolerances_of_gear(made, tolerance_class), np.random.default_rng(1)
    sigma = {key: float(law["sigma"].split()[0]) * 1e-6 for key, law in laws(made, tolerance_class).items()}
    steps = sigma["pitch"] * rng.standard_normal((count, made.teeth))
    places = np.cumsum(steps - steps.mean(axis=1, keepdims=True), axis=1)
    eccentricity = np.abs(sigma["runout_amplitude"] * rng.standard_normal(count))
    turned = 2.0 * np.pi * (np.arange(made.teeth) / made.teeth + rng.random((count, 1)))
    places += (eccentricity[:, None] / math.cos(made.pressure_angle)) * np.cos(turned)
    pitch = np.abs(places - np.roll(places, 1, axis=1)).max(axis=1)
    assert np.mean(2.0 * eccentricity <= tolerances.runout) > 0.995
    assert np.mean(np.ptp(places, axis=1) <= tolerances.cumulative_pitch) > 0.99
    assert np.mean(pitch <= tolerances.pitch) > 0.99
    # and they use it up
    assert np.quantile(np.ptp(places, axis=1), 0.99) > 0.8 * tolerances.cumulative_pitch


def laws(gear, tolerance_class, over_width=True):
    return laws_of_class(gear, tolerance_class, over_width=over_width)


def test_slopes_fill_their_tolerances_and_helices_need_slices(case):
    sun = planetary_set(case).sun
    tolerances, drawn = tolerances_of_gear(sun, 6), laws(sun, 6)
    for key, value in (("profile_slope", tolerances.profile_slope), ("lead_slope", tolerances.helix_slope)):
        assert drawn[key]["limit"] == f"{1e6 * value!r} um"
        assert float(drawn[key]["sigma"].split()[0]) == pytest.approx(1e6 * value / 3.0, rel=1e-12)
    assert "lead_slope" not in laws(sun, 6, over_width=False)
    assert pitch_sigma(sun, tolerances) < tolerances.pitch / 3.0


def test_a_class_gives_the_laws_that_a_file_leaves_out(case):
    law = {"distribution": "uniform", "limit": "2 um"}
    given = Tolerances.model_validate({"quality": 6, "sun": {"profile_slope": law}, "ring": {"quality": 8}})
    made = with_classes(given, case)
    keys = [key for key, _ in made.laws()]
    assert keys.count("sun.profile_slope") == 1 and made.sun.profile_slope == given.sun.profile_slope
    assert {"sun.pitch", "planet.runout_amplitude", "ring.profile_slope"} <= {*keys}
    assert not any("lead" in key for key in keys)
    ring = tolerances_of_gear(planetary_set(case).ring, 8)
    assert made.ring.profile_slope is not None
    assert made.ring.profile_slope.limit == pytest.approx(ring.profile_slope, rel=1e-12)
    sliced = with_classes(given, with_value(case, "static.slices", 25))
    assert sliced.planet.lead_slope is not None
    placed = Tolerances.model_validate({"sun": {"quality": 6, "cumulative_pitch": law}})
    assert with_classes(placed, case).sun.pitch is None and with_classes(placed, case).planet.runout_amplitude is None


@pytest.mark.slow
def test_samples_are_drawn_by_class(case, tmp_path):
    path = tmp_path / "class.toml"
    path.write_text("quality = 6\n", encoding="utf-8")
    model, text = prepared(case, path, positions=8)
    assert text == "quality = 6\n"
    limits = {key: law.limit for key, law, _ in model.errors}
    assert limits["sun.pitch"] == tolerances_of_gear(planetary_set(case).sun, 6).pitch
    assert model.size == 27 + 3 * 40 + 108 + 2 * (1 + 3 + 1) + (1 + 2 + 1)
    # one model of the same laws written out draws the same
    written = with_classes(Tolerances.model_validate({"quality": 6}), case)
    other = sample_model(design_basis(with_value(case, "static.positions", 8)), written, sun_torque=100.0, positions=8)
    assert np.array_equal(model.draw(1, 0, 3), other.draw(1, 0, 3))


@pytest.mark.parametrize(
    ("text", "code"), [("quality = 12\n", "E-RANGE"), ("quality = 0\n", "E-RANGE"), ("# none\n", "E-KEY-MISSING")]
)
def test_classes_that_the_standard_does_not_have_are_refused(case, tmp_path, text, code):
    path = tmp_path / "class.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FemgearError, match=code):
        prepared(case, path)


def test_a_gear_beyond_the_standard_is_refused_by_its_key(case):
    narrow = with_value(case, "set.face_width", "3 mm")
    with pytest.raises(FemgearError, match="E-ISO1328") as refusal:
        with_classes(Tolerances.model_validate({"quality": 6}), narrow)
    assert (refusal.value.key, refusal.value.limit) == ("sun.quality", "0.004 .. 1.2 m")


def test_entries_of_a_gearbox_have_the_tolerances_of_their_gears():
    box = read_case(CASE.with_name("e_axle.toml"))
    gear = flank_tolerances(
        7, diameter=25 * 1.5e-3 / math.cos(math.radians(20.0)), normal_module=1.5e-3, face_width=0.022
    )
    assert limit_of_entry(box, "pair[0].teeth.gear_1.errors.runout_amplitude", 7) == pytest.approx(0.5 * gear.runout)
    with pytest.raises(FemgearError, match="E-CHOICE"):
        limit_of_entry(box, "bearing[0].clearance", 7)


def test_slopes_of_a_case_have_those_of_profile_and_helix(case):
    slopes = [{"kind": kind, "amount": "0 um"} for kind in ("profile slope", "lead slope", "lead crowning")]
    sloped = with_value(with_value(case, "static.slices", 25), "sun.modifications", slopes)
    tolerances = tolerances_of_gear(planetary_set(case).sun, 5)
    limits = [limit_of_entry(sloped, f"sun.modifications[{i}].amount", 5) for i in range(2)]
    assert limits == [tolerances.profile_slope, tolerances.helix_slope]
    with pytest.raises(FemgearError, match="E-CHOICE"):
        limit_of_entry(sloped, "sun.modifications[2].amount", 5)


def test_a_tolerance_of_an_entry_by_class_is_a_third_and_the_whole_of_it(case, tmp_path):
    sloped = with_value(case, "sun.modifications", [{"kind": "profile slope", "amount": "1 um"}])
    path, key = tmp_path / "entries.toml", "sun.modifications[0].amount"
    path.write_text(f'[[tolerance]]\nkey = "{key}"\nquality = 6\n', encoding="utf-8")
    ((entry,), _) = read_entry_tolerances(path, sloped)
    limit = 1e6 * tolerances_of_gear(planetary_set(case).sun, 6).profile_slope
    assert entry.errors(np.array([0.5, 1.0])).ravel() == pytest.approx([0.0, limit], abs=1e-6)
    assert entry.errors(np.array([0.8413447])).item() == pytest.approx(limit / 3.0, rel=0.01)
    path.write_text(f'[[tolerance]]\nkey = "{key}"\nquality = 6\nsigma = "1 um"\n', encoding="utf-8")
    with pytest.raises(FemgearError, match="E-CHOICE"):
        read_entry_tolerances(path, sloped)
