"""No tooth pair that a contact solution leaves out of its candidates would penetrate."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set
from random_sets import random_set

from femgear.contact import cycle
from femgear.contact.assembly import body_compliance, contact_candidates
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.omitted_pairs import needed_nearest, yielding
from femgear.contact.windows import mesh_windows
from femgear.stages.static import solve_static
from femgear.trains.reading import parse_case, with_values

TWISTED = """title = "twisted"
[set]
planets = 3
centre_distance = "122.81253598242603 mm"
face_width = "42.97308978469128 mm"
[rack]
addendum = 0.95
dedendum = 1.25
root_radius = 0.25
[material]
youngs_modulus = "75 GPa"
poisson_ratio = 0.3
density = "7850 kg/m^3"
[sun]
teeth = 42
module = "3 mm"
pressure_angle = "20 deg"
bore_radius = "29.52181951294124 mm"
mass = "3.3 kg"
inertia = "0.0079 kg m^2"
support_stiffness = "1.26e8 N/m"
tilt_stiffness = "28490 N m/rad"
[planet]
teeth = 39
profile_shift = 0.19
bore_radius = "32.96287513883708 mm"
mass = "2.5 kg"
inertia = "0.0056 kg m^2"
bearing_stiffness = "7.9e7 N/m"
tilt_stiffness = "47474 N m/rad"
modifications = [{ kind = "lead crowning", amount = "12.781188587467742 um" }]
misalignment = [{ planet = 1, radial = "-0.028768759483780132 mrad", tangential = "-0.0896422333 mrad" }]
[ring]
teeth = 120
outer_radius = "194.06940292549316 mm"
foundation_radial = "2e11 N/m^3"
foundation_tangential = "2.8e10 N/m^3"
modifications = [{ kind = "flank twist", amount = "10.987685465479913 um" }]
[carrier]
mass = "15 kg"
inertia = "0.13 kg m^2"
support_stiffness = "8.9e8 N/m"
[operation]
input = "sun"
fixed = "ring"
torque = "-43.79396793252687 N m"
speeds = ["243 rpm"]
[static]
positions = 12
flank_elements = 6
stresses = false
slices = 10
[dynamics]
damping_ratio = 0.04
[housing]
sensor_angle = "0 deg"
"""
"""Under crowning and twist a pair that is never near at any of 12 positions carries 17 % of a mesh."""


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


@pytest.fixture(scope="module")
def grids(tmp_path_factory):
    return tmp_path_factory.mktemp("grids")


def windows(gears, bodies, nearest, images=1):
    setup = mesh_windows(gears, bodies, share=TORQUE, nearest=nearest, positions=5)
    return replace(setup, images=images)


@pytest.mark.parametrize("images", [1, 3])
def test_bodies_yield_at_a_listed_pair_as_at_a_candidate(gears, bodies, images):
    """With all pairs as candidates the compliance between windows says the same."""
    first = gears if images == 1 else replace(gears, planet_angles=gears.planet_angles[:1])
    found = contact_candidates(windows(first, bodies, 1.0, images), bodies, np.arange(5))
    middle = replace(found.setup, roll=found.setup.roll[..., 1:2])
    smooth = body_compliance(middle, bodies, found.position, found.mesh, found.pair)[..., 0, :, 0].sum(axis=0)
    force = np.where(found.candidate.any(axis=-1), np.random.default_rng(1).random(found.pair.shape), 0.0)
    row, window = np.nonzero(found.candidate.any(axis=-1))
    mesh = found.mesh[window]
    pair = found.pair[row, window] + found.setup.listed.first[mesh]
    expected = (smooth @ force[..., None])[row, window, 0]
    assert yielding(found, force, mesh, row, pair) == pytest.approx(expected, rel=1e-12)


def test_a_loaded_flank_lets_pairs_in_that_it_draws_nearer(gears, bodies):
    """What lies apart by more than the approach is needed where bodies close the gap."""
    found = contact_candidates(windows(gears, bodies, 1e-9), bodies, np.arange(5))
    gap = np.where(found.setup.listed.near, np.inf, found.setup.listed.gap)
    still, none = np.zeros((len(gap), 5)), np.zeros(found.pair.shape)
    assert not needed_nearest(found, still, none).any()
    deep = np.where(np.arange(5) == 2, gap.min() + 1e-6, 0.0) * np.ones((len(gap), 1))
    assert (needed_nearest(found, deep, none) > 0.0).sum() <= 1
    at = np.unravel_index(gap.argmin(), gap.shape)
    deep = np.zeros((len(gap), 5))
    deep[at[0], at[1]] = gap.min() + 1e-9
    expected = gap.min() + 1e-9 - found.setup.listed.gap[at[:2]].min()
    assert needed_nearest(found, deep, none)[at[1]] == pytest.approx(expected, rel=1e-9)


def test_a_gap_that_bodies_close_by_a_micrometre_more_than_it_is_needs_its_pair(gears, bodies):
    """Flanks at rest, one window loaded until it draws a pair beside it nearer by its gap and 1 um."""
    found = contact_candidates(windows(gears, bodies, 1e-9), bodies, np.arange(5))
    listed = found.setup.listed
    mesh, row, pair = np.nonzero(~listed.near & np.isfinite(listed.gap))
    window = int(np.flatnonzero(found.candidate.any(axis=-1)[2])[0])
    one = np.zeros(found.pair.shape)
    one[2, window] = 1.0
    nearer = -yielding(found, one, mesh, row, pair)
    at = int(np.argmax(nearer))
    assert nearer[at] > 0.0 and row[at] == 2
    load = (listed.gap[mesh[at], 2, pair[at]] + 1e-6) / nearer[at]
    still = np.zeros((len(listed.gap), 5))
    smallest = listed.gap[mesh, row].min(axis=-1)
    expected = (load * nearer - smallest)[load * nearer > listed.gap[mesh, row, pair]].max()
    assert needed_nearest(found, still, load * one)[2] == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("factors", [(1.05, 1.0), (1.05, 0.5, 1.0, 1.0001, 2.0)])
def test_candidates_decide_nothing_of_a_twisted_set(grids, factors):
    """Young's modulus, torque and tilt stiffnesses times one factor: the same shares and k over it."""
    case, found = parse_case(TWISTED), []
    for factor in factors:
        scaled = {
            "material.youngs_modulus": f"{75e9 * factor!r} Pa",
            "operation.torque": f"{-43.79396793252687 * factor!r} N m",
            "sun.tilt_stiffness": f"{28490 * factor!r} N m/rad",
            "planet.tilt_stiffness": f"{47474 * factor!r} N m/rad",
        }
        solved = solve_static(with_values(case, scaled), cache=grids).cycle
        found.append((solved.stiffness / factor, solved.load_share, solved.deflection))
    for stiffness, share, deflection in found[1:]:
        assert stiffness == pytest.approx(found[0][0], rel=1e-6)
        assert share == pytest.approx(found[0][1], rel=1e-6)
        assert deflection == pytest.approx(found[0][2], rel=1e-6)
    # planet 3-ring at position 0; without the third pair it was 140.1 N/um
    assert found[0][0][5, 0] == pytest.approx(178.5e6, rel=2e-3)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (3, 8, 11, 16, 23))])
def test_no_omitted_pair_of_random_sets_would_carry(seed, grids, monkeypatch):
    """All pairs as candidates give the same solution, on held and on soft members, of either torque."""
    case = with_values(random_set(seed).case, {"static.positions": 8})
    found = solve_static(case, cache=grids).cycle
    first = cycle.first_windows
    monkeypatch.setattr(cycle, "first_windows", lambda *given: (first(*given)[0], 1.0))
    every = solve_static(case, cache=grids).cycle
    assert every.tooth_load.shape[1] > found.tooth_load.shape[1]
    assert found.force == pytest.approx(every.force, rel=1e-9, abs=1e-9 * every.force.max())
    assert found.deflection == pytest.approx(every.deflection, rel=1e-9)
    assert found.stiffness == pytest.approx(every.stiffness, rel=1e-7)
