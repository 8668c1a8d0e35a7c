"""femgear.measured.wrong_turns: faults make no false alarm, wrong counts of pulses and wrong shafts are told."""

from pathlib import Path

import numpy as np
import pytest
from recorded_signals import computed_lines

from femgear import read_case
from femgear.measured.heard_set import HeardSet, heard_set
from femgear.measured.wrong_turns import lines_near_mesh
from validation.recordings import FAULTS

REFERENCE = heard_set(read_case(Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"))
COUNTS = (2, 3, 4, 5, 6, 8, 10, 12)
FACTORS = [*map(float, COUNTS), *(1.0 / count for count in COUNTS)]


def side_bands(gear_set, planets):
    """Healthy lines: three mesh harmonics, of each the nearest two that N planets allow, and the passing planets."""
    ring = gear_set.ring
    order = [planets, 2 * planets]
    for harmonic in (1, 2, 3):
        below = (harmonic * ring - 1) // planets * planets
        order += [below, (harmonic * ring // planets + 1) * planets]
    return np.array(order, float), np.array([0.3, 0.1, 0.2, 0.15, 0.8, 0.7, 1.0, 0.9])


def equal_planets(ring, sun, planet, number):
    angles = 2 * np.pi * np.arange(number) / number
    return HeardSet(ring, sun, planet, angles, "sun", {"sun": sun / (sun + ring), "carrier": 1.0})


SETS = {3: REFERENCE, 4: equal_planets(100, 28, 36, 4), 5: equal_planets(100, 40, 30, 5)}


@pytest.mark.parametrize("planets", SETS)
@pytest.mark.parametrize("factor", [*FACTORS, "sun", "carrier"])
def test_a_factor_of_the_turns_is_told_of_a_healthy_set(planets, factor):
    gear_set = SETS[planets]
    ratio = gear_set.carrier_per_turn["sun"]
    factor = {"sun": ratio, "carrier": 1 / ratio}.get(factor, factor)
    order, height = side_bands(gear_set, planets)
    mesh = lines_near_mesh(gear_set, factor * order, height, 0.02, 900.0 * factor)
    assert mesh.factor == pytest.approx(factor)
    assert mesh.share_then == pytest.approx(np.sqrt(height[2:]).sum() / np.sqrt(height).sum())


@pytest.mark.parametrize("planets", SETS)
def test_right_turns_are_let_be(planets):
    order, height = side_bands(SETS[planets], planets)
    mesh = lines_near_mesh(SETS[planets], order, height, 0.02, 900.0)
    assert mesh.factor == 1.0
    assert mesh.fits


def test_lines_from_elsewhere_do_not_fit():
    order = 0.7123 * np.array([105.0, 111.0, 213.0, 219.0, 321.0, 327.0])
    mesh = lines_near_mesh(REFERENCE, order, np.array([0.3, 0.2, 0.5, 0.4, 1.0, 0.9]), 0.02, 900.0)
    assert mesh.factor == 1.0
    assert not mesh.fits
    assert lines_near_mesh(REFERENCE, np.zeros(0), np.zeros(0), 0.02, 900.0).fits


@pytest.mark.parametrize("beside", [1, 2])
def test_loud_lines_beside_mesh_harmonics_are_no_third_of_the_turns(beside):
    """Orders that the spacing forbids lie where a third of the turns would have healthy ones."""
    order = np.concatenate([np.array([108, 216, 324, 432]) + side for side in (-3, -beside, beside, 3)]).astype(float)
    height = np.repeat([0.1, 1.0, 0.9, 0.1], 4)
    mesh = lines_near_mesh(REFERENCE, order, height, 0.02, 900.0)
    assert mesh.factor == 1.0
    assert mesh.fits


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
@pytest.mark.parametrize("threshold", [-30.0, -45.0])
def test_faults_make_no_false_alarm(kind, threshold):
    order, value = computed_lines(kind)
    loud = np.abs(value) > 10 ** (threshold / 20) * np.abs(value).max()
    mesh = lines_near_mesh(REFERENCE, order[loud], np.abs(value[loud]), 0.02, float(order.max()))
    assert mesh.factor == 1.0
    assert mesh.fits
