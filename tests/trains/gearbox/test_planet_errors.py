"""Errors of pins and of the timing of planets: shares of stiff and of floating suns in closed form, and refusals."""

import math

import numpy as np
import pytest
from planet_gearboxes import STEPPED, held, planet_shaft, simple_set, stepped_forces, stepped_set

from femgear.errors import CaseError
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.planet_errors import error_gaps
from femgear.trains.gearbox.results import DeflectionResult, deflection_warnings
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

COSINE = math.cos(math.radians(20.0))
LEVER = STEPPED[1] / STEPPED[2]


def sun_forces(tables):
    found = solve_deflection(read_case(tables))
    return found.mesh_force[:3], found


@pytest.mark.parametrize("torque", [100.0, -100.0])
def test_a_planet_ahead_of_its_place_carries_less_between_stiff_members(torque):
    tables = held(stepped_set())
    tables["operation"]["load_case"][0]["torque"] = {"sun": f"{torque} N m"}
    error = math.copysign(3e-6, torque)
    planet_shaft(tables, 1)["pin_error"] = {"tangential": f"{error!r} m"}
    force, found = sun_forces(tables)
    np.testing.assert_allclose(force, stepped_forces([0.0, 3e-6 * COSINE * (1.0 + LEVER), 0.0]), rtol=1e-9)
    shares = found.model.flow.torque_shares
    assert shares["sun-1"] == pytest.approx(force[1] / force.sum())
    np.testing.assert_allclose(found.mesh_force[3:], LEVER * force, rtol=1e-9)


def test_a_radial_error_opens_one_mesh_by_what_it_closes_of_the_other():
    tables = held(stepped_set())
    planet_shaft(tables, 0)["pin_error"] = {"radial": "5 um"}
    opened = [5e-6 * math.sin(math.radians(20.0)) * (1.0 - LEVER), 0.0, 0.0]
    np.testing.assert_allclose(sun_forces(tables)[0], stepped_forces(opened), rtol=1e-9)


def test_a_floating_sun_shares_equally_whatever_one_pin_does():
    tables = held(stepped_set(), sun="1 N/m")
    planet_shaft(tables, 1)["pin_error"] = {"tangential": "30 um", "radial": "-10 um"}
    force, _ = sun_forces(tables)
    np.testing.assert_allclose(force, force.mean(), rtol=1e-6)


def test_two_gears_out_of_time_take_their_planet_ahead():
    """Gear b turned by theta opens the ring mesh by its base radius times theta, in the sense of the torque on it."""
    tables = held(stepped_set())
    tables["pair"][4]["timing_error"] = "1e-4 rad"
    force, found = sun_forces(tables)
    # the sun turns the planets clockwise: gear b turned the other way touches the ring later
    opened = [0.0, 1e-4 * 1e-3 * STEPPED[2] * COSINE * LEVER, 0.0]
    np.testing.assert_allclose(force, stepped_forces(opened), rtol=1e-9)
    assert np.count_nonzero(error_gaps(found.model)) == 1


def test_a_pin_far_off_its_place_leaves_its_planet_without_load():
    tables = held(stepped_set())
    planet_shaft(tables, 2)["pin_error"] = {"tangential": "60 um"}
    force, found = sun_forces(tables)
    assert force[2] == 0.0
    np.testing.assert_allclose(force[:2], 100.0 / (2.0 * 1e-3 * STEPPED[0] * COSINE), rtol=1e-9)
    assert found.model.flow.torque_shares["sun-2"] == 0.0
    data = DeflectionResult(found.model.case, (found,), 0).dataset()
    assert data["planet_load_factor"].values[0] == pytest.approx(1.5)
    assert [one.text for one in deflection_warnings(data) if one.code == "W-OPEN"] == [
        "sun-2, 2-ring carry nothing in load case nominal"
    ]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t["shaft"][0].update(pin_error={"radial": "1 um"}), "sun is no planet"),
        (lambda t: [t["pair"][0].pop("carrier"), t["pair"][0].update(timing_error="0.1 deg")], "has no planet"),
    ],
)
def test_errors_of_what_is_no_planet_are_refused(change, words):
    tables = simple_set()
    change(tables)
    with pytest.raises(CaseError, match=words):
        read_case(tables)
