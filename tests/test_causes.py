"""femgear.causes: an error that made a recording is found again, with its size."""

import numpy as np
import pytest
from recorded_signals import CASE, COARSE, HEALTHY, RATE, computed_lines, recording, write_columns

from femgear import causes, read_case, solve
from femgear.causes import CAUSES, describe_causes, rank_causes
from femgear.errors import CaseError
from femgear.measured.requests import LineSearch, Recording
from femgear.measured.verdict import measured_verdict
from femgear.trains.reading import with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

UM = 1e-6


def verdict_of(folder, order, value, threshold=-40.0):
    signal, pulses, _ = recording(order, value)
    columns = np.arange(len(signal)) / RATE, signal, pulses
    path = write_columns(folder / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns)
    return measured_verdict(read_case(CASE), path, Recording(pulses="tacho"), LineSearch(threshold=threshold))


@pytest.fixture
def known_lines(monkeypatch):
    """Lines of errors that are made up: those of a pin beside the second harmonic, of the carrier beside the third."""
    healthy = {float(order): complex(height) for order, height in HEALTHY.items()}
    made = {
        "tangential": {215.0: 0.02, 217.0: 0.03},
        "radial": {215.0: 0.0002, 217.0: 0.0003},
        "thickness_reduction": {215.0: 0.01, 217.0: 0.015},
    }

    def heights(case, progress):
        pins, planets = case.set.pin_errors, case.planet.individual
        names = [name for name in ("tangential", "radial") if any(getattr(pin, name) for pin in pins)]
        names += ["thickness_reduction"] * bool(planets)
        lines = made[names[0]] if names else {323.0: 0.04} if case.carrier.errors or case.sun.errors else {}
        return healthy | lines

    monkeypatch.setattr(causes, "_heights", heights)


def test_the_error_whose_lines_are_spread_so_comes_first_with_its_size(tmp_path, known_lines, known_faults):
    # ten times the lines of a micrometre of the pin; the recording is twice as loud, which drops out
    lines = HEALTHY | {215: 0.2, 217: 0.3, 110.13: 0.2}
    ranked = rank_causes(read_case(CASE), verdict_of(tmp_path, lines, [2 * height for height in lines.values()]))
    found = {entry.cause.name: entry for entry in ranked}
    assert [entry.cause.entry for entry in ranked][:3] == ["set.pin_errors", "planet.individual", "set.pin_errors"]
    assert ranked[0].size == pytest.approx(10 * UM, rel=0.01) and ranked[0].explained == pytest.approx(1.0, abs=1e-3)
    assert ranked[1].size == pytest.approx(20 * UM, rel=0.01) and ranked[2].size == pytest.approx(1000 * UM, rel=0.01)
    assert found["runout of the sun"].explained == 0.0 and np.isnan(found["runout of the sun"].size)
    assert "runout of one planet" not in found  # no line has its turns
    rows, notes = describe_causes(ranked).rows, describe_causes(ranked).notes
    assert "told apart by this recording, but by their sizes: a planet's pin, along its circle; thinner" in notes[-1]
    assert rows[0] == ("a planet's pin, along its circle", "set.pin_errors", "10", "1.00", "217, 215")


def test_a_healthy_recording_asks_for_no_cause(tmp_path, known_lines):
    ranked = rank_causes(read_case(CASE), verdict_of(tmp_path, HEALTHY, HEALTHY.values()))
    assert ranked == () and describe_causes(ranked).rows == ()


def test_what_is_refused(tmp_path, known_lines):
    verdict = verdict_of(tmp_path, HEALTHY | {215: 0.2}, [*HEALTHY.values(), 0.2])
    case = with_values(read_case(CASE), {CAUSES[0].entry: CAUSES[0].value("3 um")})
    with pytest.raises(CaseError, match="errors already"):
        rank_causes(case, verdict)
    with pytest.raises(CaseError, match="no mesh harmonic has a normal line"):
        rank_causes(read_case(CASE), verdict_of(tmp_path, [215, 3], [1.0, 0.5]))


@pytest.fixture
def known_faults(monkeypatch):
    """Lines of faults of a planet that are made up: a crack's grow with its square, and spread otherwise."""

    def heights(case, steps):
        (fault,) = case.planet.fault or case.sun.fault
        size = 0.0 if fault.kind == "missing" else (fault.depth if fault.kind == "crack" else fault.length) / 1.5e-3
        height = {"crack": 0.1 * size**2, "spall": 0.001 * size, "missing": 5.0}[fault.kind]
        spread = {326.7: 2.0, 321.3: 1.0} if fault.kind == "crack" else {326.7: 0.5, 321.3: 2.0}
        if case.sun.fault:
            height = {"crack": 0.01 * size**2, "spall": 0.001 * size, "missing": 0.1}[fault.kind]
            spread = {214.0: 2.0, 220.0: 1.0} if fault.kind == "missing" else {218.0: 2.0, 220.0: 1.0}
        healthy = {float(order): complex(value) for order, value in HEALTHY.items()}
        return healthy | {order: height * share for order, share in spread.items()}

    monkeypatch.setattr(causes, "_fault_heights", heights)


def test_a_fault_has_the_size_at_which_its_lines_are_as_high(known_faults):
    fits = [causes._fitted(CAUSES[4], {1.0: 0.1 * size**2}, {1.0: 0.1 * 0.6**2}, 0.02) for size in (0.4, 1.0)]
    found = causes._between_sizes(fits, [0.4, 1.0])
    assert found.size == pytest.approx(0.6, rel=1e-9)
    assert found.explained == pytest.approx(1.0)
    # beyond the largest size the heights tell against it
    fits = [causes._fitted(CAUSES[4], {1.0: 0.1 * size**2}, {1.0: 0.4}, 0.02) for size in (0.4, 1.0)]
    found = causes._between_sizes(fits, [0.4, 1.0])
    assert found.size == pytest.approx(1.0)
    assert found.explained == pytest.approx(1.0 / 16.0)
    single = causes._between_sizes(fits[1:], [0.0])
    assert np.isnan(single.size)
    assert single.explained == pytest.approx(1.0 / 16.0)


def test_faults_of_the_part_whose_turns_are_heard_are_tried(tmp_path, known_lines, known_faults):
    height = 0.1 * 0.6**2
    lines = HEALTHY | {326.7: 2.0 * height, 321.3: height}
    ranked = rank_causes(read_case(CASE), verdict_of(tmp_path, lines, lines.values()))
    assert ranked[0].cause.name == "crack in a tooth of the planet"
    assert ranked[0].size == pytest.approx(0.6 * 1.5e-3, rel=0.02)
    assert ranked[0].explained == pytest.approx(1.0, abs=0.01)
    likeness = {entry.cause.name: entry.explained for entry in ranked}
    assert likeness["missing tooth of the planet"] < 0.01
    assert likeness["spall on a tooth of the planet"] < 0.7
    assert not any(name.endswith("the sun") and "tooth" in name for name in likeness)


def test_faults_of_a_sun_of_whole_turns_are_tried_on_whole_orders(tmp_path, known_lines, known_faults):
    """A sun of 27 teeth in a ring of 108 makes five turns in one of the carrier: no line shows its turns alone."""
    lines = HEALTHY | {214: 0.2, 220: 0.1}
    ranked = rank_causes(read_case(CASE), verdict_of(tmp_path, lines, lines.values()))
    assert ranked[0].cause.name == "missing tooth of the sun"
    assert ranked[0].explained == pytest.approx(1.0, abs=0.02)
    likeness = {entry.cause.name: entry.explained for entry in ranked}
    assert max(likeness.pop("spall on a tooth of the sun"), likeness.pop("crack in a tooth of the sun")) < 0.3
    assert likeness["a planet's pin, along its circle"] == 0.0
    assert not any(name.endswith("the planet") for name in likeness)


@pytest.mark.slow
def test_a_crack_that_made_a_recording_is_found_with_its_depth(tmp_path, monkeypatch):
    """In another planet, tooth and grid than those with which causes are computed; of these the crack alone."""
    monkeypatch.setattr(causes, "CAUSES", ())
    monkeypatch.setattr(causes, "_FAULT_SIZES", {"crack": causes._FAULT_SIZES["crack"]})
    crack = {"kind": "crack", "planet": 2, "tooth": 5, "flank": "sun side", "depth": "1 mm"}
    lines = solve(with_values(read_case(CASE), COARSE | {"planet.fault": [crack]}), "housing")["housing"].exact
    value = lines.acceleration[0]
    kept = (lines.order > 0) & (np.abs(value) > 1e-3 * np.abs(value).max())
    signal, pulses, _ = recording(lines.order[kept], value[kept], seconds=30.0, noise=3e-4)
    columns = np.arange(len(signal)) / RATE, signal, pulses
    path = write_columns(tmp_path / "a.csv", "time [s];acc [m/s^2];tacho [V]\n", columns)
    verdict = measured_verdict(read_case(CASE), path, Recording(pulses="tacho"), LineSearch(threshold=-50.0))
    ranked, of_sun = rank_causes(read_case(CASE), verdict)
    assert ranked.cause.entry == "planet.fault"
    assert ranked.size == pytest.approx(1e-3, rel=0.05)
    assert ranked.explained > 0.98
    assert of_sun.cause.entry == "sun.fault"
    assert of_sun.explained < 0.2


@pytest.mark.slow
def test_a_pin_that_stands_wrong_by_20_um_is_found_with_its_size(tmp_path):
    case = with_values(read_case(CASE), COARSE)
    ranked = rank_causes(case, verdict_of(tmp_path, *computed_lines("unequal pins")))
    sizes = {entry.cause.name: entry.size for entry in ranked if entry.explained > 0.99}
    # what shares the load so makes the same lines; only the sizes differ
    assert sizes["a planet's pin, along its circle"] == pytest.approx(20 * UM, rel=0.05)
    assert sizes["runout of the carrier's pin circle"] == pytest.approx(13.1 * UM, rel=0.05)
    assert sizes["thinner teeth of one planet"] == pytest.approx(39 * UM, rel=0.05)
    assert sizes["a planet's pin, outwards"] > 500 * UM and "runout of the sun" not in sizes
