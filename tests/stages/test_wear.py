"""Wear by Archard's law: closed forms where one tooth pair carries, either torque, planets, records and slices."""

from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.stages.static import loaded_set
from femgear.stages.wear import MeshingTeeth, speed_of_wear, wear_entries, with_more_wear, worn_flanks
from femgear.trains.pair.stages import loaded_pair
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
COARSE = {"static.flank_elements": 4, "static.positions": 16, "static.stresses": False, "static.peaks": False}
GIVEN = {"hours": 100.0, "coefficient": 1e-17}


@pytest.fixture(scope="module")
def pair():
    return with_values(read_case(CASES / "spur_pair.toml"), COARSE)


@pytest.fixture(scope="module")
def whole(pair):
    return worn_flanks(loaded_pair(pair, 100.0)[0], **GIVEN)


def closed_form(case, radius, place):
    """``k F/b |1 - w_2 r_2/(w_1 r_1)|`` and passages of 100 h at 100 rad/s: radii of curvature by the triangle of r."""
    teeth = np.array([case.gear_1.teeth, case.gear_2.teeth])
    base = 0.5 * case.module * teeth * np.cos(case.pressure_angle)
    line = np.sqrt(case.set.centre_distance**2 - base.sum() ** 2)
    curvature = np.sqrt(radius**2 - base[place] ** 2)
    ratio = (line - curvature) / curvature * teeth[place] / teeth[1 - place]
    turns = 100.0 * teeth[0] / teeth[place] / (2 * np.pi) * 3600 * 100
    force = case.operation.torque / base[0] / case.set.face_width
    return 1e-17 * force * abs(1.0 - ratio) * turns


def test_wear_where_one_pair_carries_is_archards_closed_form(pair, whole):
    """Within the single contact the load is that of the torque; there the depths are exact."""
    assert [flank.place for flank in whole] == [("gear_1.fault", 0, "left"), ("gear_2.fault", 0, "left")]
    for place, flank in enumerate(whole):
        expected = np.array([closed_form(pair, radius, place) for radius in flank.radius])
        alone = np.abs(flank.depth / expected - 1.0) < 1e-9
        assert 5 <= alone.sum() < len(alone) and np.diff(np.flatnonzero(alone)).tolist() == [1] * (alone.sum() - 1)
        assert (flank.depth < expected * (1 + 1e-9)).all()


def test_the_other_torque_wears_the_other_flanks_alike(pair, whole):
    case = with_values(pair, {"operation.torque": f"-{pair.operation.torque} N m"})
    other = worn_flanks(loaded_pair(case, -100.0)[0], **GIVEN)
    assert [flank.flank for flank in other] == ["right", "right"]
    for flank, mirrored in zip(whole, other, strict=True):
        assert mirrored.depth == pytest.approx(flank.depth, rel=1e-6, abs=1e-12 * flank.depth.max())


def test_wear_grows_with_hours_and_coefficient_and_adds_up(pair):
    (teeth,) = loaded_pair(pair, 100.0)
    once, twice, softer = (
        worn_flanks(teeth, hours=hours, coefficient=k)[0] for hours, k in ((10.0, 1e-17), (20.0, 1e-17), (10.0, 3e-17))
    )
    assert twice.depth == pytest.approx(2.0 * once.depth) and softer.depth == pytest.approx(3.0 * once.depth)
    assert with_more_wear(once, once.depth).depth == pytest.approx(twice.depth)
    assert (np.diff(once.radius) > 0).all() and set(wear_entries([once])) == {"gear_1.fault"}


def test_sun_and_ring_wear_under_every_planet(monkeypatch):
    """Three planets of unequal load: sun and ring lose what all of them take off, each planet its own."""
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), COARSE)
    pins = {"set.pin_errors": [{"planet": 2, "tangential": "4 um"}], "static.members": "fixed"}
    (teeth,) = loaded_set(with_values(case, pins), 100.0)
    flanks = {flank.place: flank for flank in worn_flanks(teeth, **GIVEN)}
    gears, sun = teeth.static.planetary_set, flanks["sun.fault", 0, "left"]
    planets = [flanks["planet.fault", number, "sun side"] for number in (1, 2, 3)]
    # the sum of the loads is that of the torque where one pair carries: the sun knows nothing of the sharing
    (equal,) = loaded_set(with_values(case, {"static.members": "fixed"}), 100.0)
    even = {flank.place: flank for flank in worn_flanks(equal, **GIVEN)}
    middle = len(sun.depth) // 2
    assert sun.depth[middle] == pytest.approx(even["sun.fault", 0, "left"].depth[middle], rel=1e-6)
    carried = np.array([planet.depth[middle] for planet in planets])
    assert np.ptp(carried) > 0.05 * carried.mean()
    assert carried.sum() == pytest.approx(3 * even["planet.fault", 1, "sun side"].depth[middle], rel=1e-6)
    assert ("ring.fault", 0, "left") in flanks and gears.n_planets == 3


def test_without_torque_or_speed_nothing_wears(pair):
    with pytest.raises(CaseError) as refused:
        worn_flanks(loaded_pair(with_values(pair, {"operation.torque": "0 N m"}), 100.0)[0], **GIVEN)
    assert refused.value.code == "E-NO-LOAD"
    with pytest.raises(CaseError) as refused:
        speed_of_wear(with_values(pair, {"operation.speeds": None}), None)
    assert refused.value.code == "E-KEY-MISSING" and "--speed" in refused.value.remedy


def test_slices_wear_by_their_mean_load(pair, whole):
    (teeth,) = loaded_pair(with_values(pair, {"static.slices": 5}), 100.0)
    assert isinstance(teeth, MeshingTeeth) and teeth.prefix == ""
    for flank, sliced in zip(whole, worn_flanks(teeth, **GIVEN), strict=True):
        assert sliced.depth == pytest.approx(flank.depth, abs=0.02 * flank.depth.max())


@pytest.mark.slow
def test_helical_teeth_wear_as_their_slices_pass(pair):
    """A helical pair of little helix angle wears as the spur one does; its slices stand at other places."""
    free = {"set.centre_distance": None, "gear_1.tip_diameter": None, "gear_2.tip_diameter": None}
    free |= {"gear_1.profile_shift": 0.0, "gear_2.profile_shift": 0.0}
    spur, helical = with_values(pair, free), with_values(pair, free | {"set.helix_angle": "3 deg", "static.slices": 9})
    depths = [worn_flanks(loaded_pair(case, 100.0)[0], **GIVEN)[0].depth for case in (spur, helical)]
    assert depths[1].max() == pytest.approx(depths[0].max(), rel=0.15)
    assert depths[1].mean() == pytest.approx(depths[0].mean(), rel=0.05)
    back = with_values(helical, {"operation.torque": f"-{pair.operation.torque} N m"})
    assert worn_flanks(loaded_pair(back, 100.0)[0], **GIVEN)[0].depth == pytest.approx(depths[1], rel=1e-3)
