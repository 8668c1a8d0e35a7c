"""Lives of the bearings of planets, against closed forms."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.contact.supports import pin_forces
from femgear.report.tables import Marks
from femgear.stages.life import LIFE, carrier_speed_at, mesh_frequency_at, solve_life
from femgear.stages.planet_bearings import (
    EXPONENTS,
    PlanetBearings,
    describe_planet_bearings,
    equivalent_pin_load,
    planet_bearing_findings,
    planet_bearing_rows,
    planet_bearing_variables,
    planet_bearings,
)
from femgear.stages.static import solve_static
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
RATED = {"planet.dynamic_rating": "20 kN", "planet.bearing_kind": "ball"}


@pytest.fixture(scope="module")
def case():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), RATED)


def test_without_speed_the_pin_carries_twice_the_tangential_force(case):
    """2 T/(N a) z_r/(z_s + z_r) (1 + z_s/z_r) of a spur set: T_carrier over N a, the same at all positions."""
    gears = planetary_set(case)
    force = np.ones((6, 5)) * 100.0 / (3 * gears.gears[0].base_radius)
    cycle = SimpleNamespace(bearing_force=pin_forces(gears, force, np.zeros((6, 5))))
    load = equivalent_pin_load(cycle, gears, mass=1.0, carrier_speed=0.0, exponent=3.0)
    torque = 100.0 * (1.0 + 108 / 27)
    # normals of both meshes are inclined alike only without shifts: the tangential part is exact
    tangential = np.array([[-math.sin(angle), math.cos(angle)] for angle in gears.planet_angles])
    along = np.abs(np.einsum("ni,nip->np", tangential, cycle.bearing_force))
    assert along == pytest.approx(np.full((3, 5), torque / (3 * gears.centre_distance)), rel=1e-9)
    assert load == pytest.approx(np.linalg.norm(cycle.bearing_force[:, :, 0], axis=1), rel=1e-12)


def test_planets_are_held_on_their_circle(case):
    gears = planetary_set(case)
    load = equivalent_pin_load(None, gears, mass=2.0, carrier_speed=100.0, exponent=3.0)
    assert load == pytest.approx([2.0 * gears.centre_distance * 1e4] * 3)
    assert not equivalent_pin_load(None, gears, mass=2.0, carrier_speed=0.0, exponent=3.0).any()


def test_life_is_that_of_the_equivalent_load(case):
    load, turns = np.array([[1000.0, 1200.0], [500.0, 600.0]]), np.array([1000.0, 9000.0])
    bearings = PlanetBearings(("planet 1", "planet 2"), load, turns, 20e3, 3.0)
    mean = ((turns @ load**3) / turns.sum()) ** (1.0 / 3.0)
    assert bearings.hours == pytest.approx((20e3 / mean) ** 3 * 1e6 / turns.sum())
    assert bearings.damage_share.sum(axis=0) == pytest.approx([1.0, 1.0])
    assert math.isinf(PlanetBearings(("a",), np.zeros((1, 1)), np.ones(1), 1.0, 3.0).hours[0])
    assert EXPONENTS["roller"] == pytest.approx(10 / 3)


def test_a_set_has_lives_of_its_planets_alone_without_a_treatment(case):
    loads = [{"torque": f"{torque} N m", "speed": "543 rpm", "share": 0.5} for torque in (60, -120)]
    untreated = dict.fromkeys(("material.treatment", "material.hardness", "ring.material"))
    loaded = with_values(case, {"operation.load_case": loads, "operation.required_hours": 1e5} | untreated)
    assert not LIFE.unavailable(loaded) and LIFE.unavailable(with_values(loaded, {"planet.dynamic_rating": None}))
    result = solve_life(loaded, solve_static(loaded))
    data = result.contents()
    assert not result.spectra and result.bearings is not None
    turns = 3600.0 * mesh_frequency_at(loaded, 543 * math.pi / 30) / 40 * 0.5
    assert result.bearings.turns == pytest.approx([turns, turns])
    life = data["planet_bearing_life"].values
    expected = 1e6 / turns / ((data["planet_bearing_load"].values / 20e3) ** 3).sum(axis=0)
    assert life == pytest.approx(expected) and life == pytest.approx(life[0], rel=1e-3)
    assert carrier_speed_at(loaded, 10.0) == pytest.approx(10.0 * 27 / (27 + 108))
    ((name, text),) = planet_bearing_rows(data, Marks(result.findings))
    assert "planets' bearings" in name and f"{life.min():.4g} h" in text and "in load case 2" in text
    (block,) = describe_planet_bearings(data)
    assert len(block.rows) == 3
    assert bool(list(planet_bearing_findings(data))) == (life.min() < 1e5)


def test_pairs_and_planets_without_a_rating_have_none(case):
    plain = with_values(case, {"planet.dynamic_rating": None})
    none = {"carrier_speed": [0.0], "mesh_frequency": [1.0], "shares": [1.0]}
    assert planet_bearings(plain, planetary_set(plain), [None], **none) is None
    pair = read_case(CASES / "spur_pair.toml")
    assert planet_bearings(pair, planetary_set(pair), [None], **none) is None
    assert planet_bearing_variables([]) == ({}, {})
