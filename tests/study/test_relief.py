"""Design maps: starts of reliefs, minimum of the Harris map, tables for the case file."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.contact.supports import Supports
from femgear.errors import CaseError
from femgear.study.relief import (
    ReliefGrid,
    _frame,
    design_basis,
    harris_map,
    optimise_relief,
    relief_grid,
    relief_starts,
    sun_torque,
    with_tip_relief,
)
from femgear.trains.reading import read_case

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
TORQUE = 100.0


@pytest.fixture(scope="module")
def basis():
    from femgear.trains.reading import with_value

    return replace(design_basis(with_value(read_case(CASE), "static.flank_elements", 12)), positions=8)


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


def test_a_map_of_negative_torques_is_that_of_positive_ones(basis):
    gears = basis.gears
    peaks = []
    for sign in (1, -1):
        variant = with_tip_relief(None, gears, amount=4e-6, length=0.9, back=sign < 0)
        found = harris_map(basis, torques=[sign * TORQUE], deviations=[variant])
        peaks.append(found.peak_to_peak)
    np.testing.assert_allclose(peaks[0], peaks[1], rtol=1e-9)


def test_supports_are_those_of_the_static_stage():
    from femgear.stages.static import case_supports
    from femgear.trains.reading import with_value

    case = with_value(read_case(CASE), "planet.bearing_clearance", "3 um")
    assert case_supports(case) == Supports(sun=5e7, carrier=2e8, planet=3e8, planet_clearance=3e-6)


def test_refusals(basis):
    gears = basis.gears
    with pytest.raises(CaseError, match="differ from zero"):
        harris_map(basis, torques=[10.0, 0.0], deviations=[None])
    with pytest.raises(CaseError, match="both signs"):
        relief_grid(basis, amounts=[1e-6], lengths=[1.0], torques=[1.0, -1.0])
    with pytest.raises(CaseError, match="path of contact"):
        relief_starts(gears, length=3.0)
    with pytest.raises(CaseError, match="no tooth bends"):
        sun_torque(read_case(CASE), gears, 0.0)


def test_valleys_of_the_grid_are_all_tried():
    """The deepest one first; a plain slope has one, at its end."""
    amounts, lengths = np.array([1e-6, 2e-6, 3e-6]), np.array([0.4, 0.8, 1.2])
    peaks = np.array([[[3.0, 5.0, 1.0], [5.0, 5.0, 5.0], [2.0, 5.0, 4.0]]])
    starts, *_ = _frame(ReliefGrid(amounts, lengths, np.ones(1), peaks, np.ones(1)), 0)
    np.testing.assert_allclose(starts, [[1.0, 1.2], [3.0, 0.4], [1.0, 0.4]])
    slope = np.arange(9.0).reshape(1, 3, 3)
    starts, *_ = _frame(ReliefGrid(amounts, lengths, np.ones(1), slope, np.ones(1)), 0)
    np.testing.assert_allclose(starts, [[1.0, 0.4]])
