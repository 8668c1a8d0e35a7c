"""Loaded states of other trains written as gearboxes, and that a spring of another stiffness is seen."""

from dataclasses import replace

import pytest
from gearbox_equivalents import set_tables
from published.planetary_sets import lin_parker_set

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.reading import read_case
from validation.gearbox_statics import (
    LARGEST,
    chains,
    differences,
    of_gearbox,
    pair_with_teeth,
    reference_set,
    rigid_sets,
    set_state,
    standing,
)

TEETH = (1000, 1292, 3592)


@pytest.mark.parametrize("trains", [lambda: rigid_sets(False), rigid_sets, chains], ids=["sets", "weight", "chains"])
def test_trains_of_rigid_bodies_bend_as_much_as_gearboxes(trains):
    for name, _, ours, other in trains():
        assert set(other.motion) <= set(ours.motion), name
        assert set(other.bearing_force) <= set(ours.bearing_force), name
        assert max(differences(ours, other).values()) <= LARGEST, name


@pytest.mark.parametrize("train", [pair_with_teeth, pytest.param(reference_set, marks=pytest.mark.slow)])
def test_teeth_in_a_gearbox_touch_as_alone(train):
    state = train()
    assert max(state.apart.values()) <= LARGEST
    assert max(differences(state.ours, state.other).values()) <= LARGEST


@pytest.mark.parametrize(("key", "value"), [("planet_bearing", 1.00001e8), ("stiffness_sun_planet", 5.00005e8)])
def test_a_spring_of_another_stiffness_shows(key, value):
    data = lin_parker_set()
    tables = standing(set_tables(data, TEETH)) | {"gravity": {"direction": [0.0, -1.0, 0.0]}}
    found = solve_deflection(read_case(tables))
    apart = differences(of_gearbox(found), set_state(replace(data, **{key: value}), found, True))
    assert max(apart.values()) > 1e-7
