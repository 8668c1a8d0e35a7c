"""A gearbox with a longer excitation: far below the resonance of its teeth a short one misses most of the force."""

import math

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.longer_excitation import longer_excitation, teeth_frequency
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.reading import read_case

INERTIA = 2e-4, 5e-4


def two_discs(**dynamics):
    """Loaded state of a spur pair of two rigid discs that turn alone."""
    tables = pair_tables() | {"motions": "rotation", "dynamics": dynamics}
    tables["shaft"] = [{"name": "input"}, {"name": "output", "axis": ["90 mm", "0 mm"]}]
    tables["mass"] = [
        {"shaft": shaft, "mass": "2 kg", "inertia": f"{inertia} kg m^2"}
        for shaft, inertia in zip(("input", "output"), INERTIA, strict=True)
    ]
    tables["load"] = [{"name": "motor", "shaft": "input"}, {"name": "brake", "shaft": "output"}]
    del tables["bearing"], tables["pair"][0]["positions"]
    tables["pair"][0]["mesh"] |= {"contact_ratio": 1.6}
    return solve_deflection(read_case(tables))


def frequency() -> float:
    """Frequency of the discs on the mesh of 4e8 N/m [Hz]."""
    radii = np.cos(math.radians(20.0)) * np.array([0.036, 0.054])
    return math.sqrt(4e8 * (radii**2 / INERTIA).sum()) / (2.0 * math.pi)


def factor(response) -> np.ndarray:
    """Largest force of the mesh over its mean at all speeds."""
    return response.stages[0].force[:, 0, 1] / response.stages[0].force[:, 0, 0]


def test_two_discs_have_the_frequency_of_their_mesh():
    assert teeth_frequency(two_discs()) == pytest.approx(frequency(), rel=1e-9)


def test_an_excitation_far_below_the_teeth_is_compared_with_one_beyond_them():
    speed = [0.05 * 2.0 * math.pi * frequency() / 24.0]
    short = solve_gearbox_response(two_discs(up_to=f"{0.06 * frequency()} Hz"), speed)
    longer, whole = longer_excitation(short), solve_gearbox_response(two_discs(up_to=f"{10 * frequency()} Hz"), speed)
    assert longer is not None and longer.up_to == pytest.approx(1.4 * frequency())
    # twice the excitation would still say nothing
    twice = solve_gearbox_response(two_discs(up_to=f"{0.12 * frequency()} Hz"), speed)
    assert factor(twice) == pytest.approx(factor(short), abs=0.003)
    assert factor(short) < 1.01 and factor(whole) > 2.0
    assert factor(longer) - 1.0 > 0.75 * (factor(whole) - 1.0)


def test_that_of_a_run_up_is_solved_where_its_force_is_largest():
    speeds = np.array([0.3, 0.5, 0.7]) * 2.0 * math.pi * frequency() / 24.0
    response = solve_gearbox_response(two_discs(up_to=f"{2 * frequency()} Hz"), speeds)
    longer = longer_excitation(response)
    assert longer is not None and longer.speed.tolist() == [speeds[factor(response).argmax()]]
    assert longer.up_to == pytest.approx(4.0 * frequency())


def test_an_excitation_of_few_harmonics_is_compared_with_one_of_twice_as_many():
    speed = [0.1 * 2.0 * math.pi * frequency() / 24.0]
    longer = longer_excitation(solve_gearbox_response(two_discs(mesh_harmonics=8, up_to="200 kHz"), speed))
    assert longer is not None and longer.stages[0].harmonics.tolist() == [16]
