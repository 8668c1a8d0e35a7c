"""Which mode is nearest to a line, and how far it is."""

import math

import pytest

from femgear.storage.contents import Contents
from femgear.trains.gearbox.mode_words import (
    mesh_lines_and_modes,
    mode_distance,
    near_mode,
    nearest_mesh_line,
    nearest_mode,
)


@pytest.fixture(scope="module")
def modes():
    """Contents of modes.nc as far as they are read: lines of 10 and 20 Hz, one of a shaft, a rigid motion."""
    values = {
        "frequency": [0.0, 5.0, 10.4, 19.9, 80.0],
        "kind": ["rigid", "axial", "casing", "bending", "mixed"],
        "main_member": ["rotor", "rotor", "casing", "rotor", "output"],
        "line": ["stage mesh", "harmonic 2 of stage mesh", "shaft rotor"],
        "order": [10.0, 20.0, 5.0],
    }

    dims = {"frequency": "mode", "kind": "mode", "main_member": "mode", "line": "line", "order": "line"}
    variables = {name: (dims[name], entries, "1", name) for name, entries in values.items()}
    return Contents(variables, {}, {"speed": 60.0})


def test_the_nearest_mode_is_the_nearest_in_octaves(modes):
    assert nearest_mode(modes, 10.0) == "mode 3 at 10 Hz (casing)"
    assert nearest_mode(modes, 40.0) == "mode 5 at 80 Hz (mixed, output)"
    assert nearest_mode(modes, 39.8) == "mode 4 at 20 Hz (bending, rotor)"
    assert nearest_mode(modes, 0.0) == "no mode"


def test_a_mode_is_near_within_a_fifth_of_the_line(modes):
    assert near_mode(modes, 10.0) == nearest_mode(modes, 10.0)
    assert near_mode(modes, 66.8) == nearest_mode(modes, 66.8) and near_mode(modes, 66.5) == ""
    assert near_mode(modes, 40.0) == near_mode(modes, 0.0) == ""


def test_distance_is_that_of_the_mesh_line_nearest_to_an_elastic_mode(modes):
    _, lines, elastic = mesh_lines_and_modes(modes)
    assert [hertz for _, hertz in lines] == [10.0, 20.0] and len(elastic) == 4
    assert mode_distance(modes) == pytest.approx(20.0 / 19.9 - 1.0)
    assert nearest_mesh_line(modes) == ("harmonic 2 of stage mesh", 20.0, 19.9)


def test_without_an_elastic_mode_no_mesh_line_is_nearest():
    entries = {"frequency": ("mode", [0.0]), "line": ("line", ["stage mesh"]), "order": ("line", [10.0])}
    still = Contents({name: (*entry, "1", name) for name, entry in entries.items()}, {}, {"speed": 60.0})
    assert nearest_mesh_line(still)[0] == "" and math.isnan(mode_distance(still))
