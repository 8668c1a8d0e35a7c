"""Passes of teeth and system: the secant of one mesh, planes of several, kinks, and when they have settled."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.trains.gearbox.contact import unequal_separation
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.gearbox.passes import ContactPass, MeshPositions, forces_agree, next_start, slopes_agree
from femgear.trains.reading import read_case

SET = {
    "name": "set",
    "sun": "input",
    "carrier": "output",
    "ring": "casing",
    "gears": {"teeth": [36, 24, 84], "module": "1.5 mm", "helix_angle": "10 deg", "face_width": "20 mm"},
    "sun_mesh": {"stiffness": "3e8 N/m"},
    "ring_mesh": {"stiffness": "3e8 N/m"},
    "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2"},
}


@pytest.fixture(scope="module")
def pair():
    return gearbox_model(read_case(pair_tables(helix="15 deg")))


@pytest.fixture(scope="module")
def planets():
    bearing = {"radial": "2e8 N/m", "axial": "1e8 N/m", "tilt": "3e4 N m/rad"}
    tables = {
        "model": "gearbox",
        "title": "a set",
        "shaft": [{"name": "input"}, {"name": "output"}],
        "bearing": [{"shaft": name} | bearing for name in ("input", "output")],
        "mass": [{"shaft": name, "mass": "3 kg", "inertia": "4e-3 kg m^2"} for name in ("input", "output")],
        "planetary": [SET],
        "operation": {
            "output": ["output"],
            "load_case": [{"torque": {"input": "100 N m"}, "speed": {"input": "1000 rpm"}}],
        },
    }
    return gearbox_model(read_case(tables))


def taken(function, start: MeshPositions) -> ContactPass:
    return ContactPass(start, MeshPositions(*function(start.slopes, start.separations)))


def test_the_first_pass_is_followed_by_its_end(pair):
    one = ContactPass(MeshPositions(np.array([1e-4]), np.zeros(1)), MeshPositions(np.array([2e-4]), np.zeros(1)))
    assert next_start(pair, [one]) == one.end


@pytest.mark.parametrize("factor", [-0.07, 0.6, -3.0])
def test_two_passes_of_one_mesh_give_the_end_of_a_straight_line(pair, factor):
    """Those that would never settle in turn, too."""

    def line(slopes, separations):
        return factor * slopes + 3e-5, separations

    first = taken(line, MeshPositions(np.array([1e-4]), np.array([-2e-6])))
    found = next_start(pair, [first, taken(line, first.end)])
    assert found.slopes == pytest.approx(3e-5 / (1.0 - factor), rel=1e-9)


def test_a_change_that_hardly_falls_is_not_extrapolated(pair):
    def slow(slopes, separations):
        return 0.95 * slopes + 1e-6, separations

    first = taken(slow, MeshPositions(np.array([1e-4]), np.zeros(1)))
    second = taken(slow, first.end)
    assert next_start(pair, [first, second]) == second.end


def test_passes_of_many_meshes_settle_sooner_than_in_turn(planets):
    """Meshes that answer alike, by 5 to 12 % of a change and the other way, as contacts of teeth do."""
    rng = np.random.default_rng(3)
    count = len(planets.assembly.contacts)
    assert count == 6
    coupling = np.diag(rng.uniform(-0.12, -0.05, count)) + 0.005 * rng.normal(size=(count, count))
    offset = 1e-6 * rng.normal(size=count)

    def coupled(slopes, separations):
        # separations over the width of 20 mm are like slopes; rotations take up some of them
        both = coupling @ (slopes * 0.02 + unequal_separation(separations)) + offset
        return both / 0.02, both

    def size(which: ContactPass) -> float:
        return float(np.abs(which.end.slopes - which.start.slopes).max())

    start = MeshPositions(np.zeros(count), np.zeros(count))
    plain, ahead = [taken(coupled, start)], [taken(coupled, start)]
    for _ in range(3):
        plain.append(taken(coupled, plain[-1].end))
        ahead.append(taken(coupled, next_start(planets, ahead)))
    assert size(ahead[-1]) < 0.3 * size(plain[-1])


def test_separations_that_rotations_take_up_do_not_count(planets):
    """The sun turns, and takes up equal separations: a change of these alone is none."""
    flat = MeshPositions(np.zeros(6), np.zeros(6))
    passes = [
        ContactPass(flat, MeshPositions(np.full(6, 1e-5), np.full(6, 1e-3))),
        ContactPass(MeshPositions(np.full(6, 1e-5), np.zeros(6)), MeshPositions(np.full(6, 9e-6), np.full(6, -5e-3))),
    ]
    found = next_start(planets, passes)
    assert found.separations == pytest.approx(np.zeros(6), abs=1e-18)
    assert found.slopes == pytest.approx(np.full(6, 1e-5 / 1.1), rel=1e-9)


def test_slopes_agree_over_the_width_or_below_a_least_misalignment(pair):
    width = pair.stages[0].width
    assert slopes_agree(pair, np.array([1e-4]), np.array([1.0001e-4]), 2e-4, 1e-12)
    assert not slopes_agree(pair, np.array([1e-4]), np.array([1.001e-4]), 2e-4, 1e-12)
    assert slopes_agree(pair, np.array([0.0]), np.array([1e-12 / width]), 1e-4, 1e-7)


def test_forces_agree_against_the_largest_of_their_stage(planets):
    force = np.array([100.0, 90.0, 1.0, 100.0, 90.0, 1.0])
    contacts = {"set": SimpleNamespace(normal_force=force)}
    assert forces_agree(planets, force + 0.009, contacts, 1e-4)
    assert not forces_agree(planets, force + 0.02 * np.eye(6)[2], contacts, 1e-4)
    assert forces_agree(planets, force + 1.0, {}, 1e-4)
