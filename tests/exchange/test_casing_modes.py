"""Modes of a casing from matrices: closed forms of few masses, and coordinates without mass."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.exchange.casing_modes import modes_of_matrices, modes_of_universal_file
from femgear.exchange.node_tables import Node

ROW = {(1, 1): 0, (2, 1): 1}


def nodes(*roles: str) -> tuple[Node, ...]:
    """Nodes 1, 2, .. with these roles, a metre from one another along x."""
    return tuple(
        Node(n, *role.partition(" ")[::2], "radial", "123", np.array([float(n), 0.0, 0.0]))
        for n, role in enumerate(roles, 1)
    )


def chain(stiffness, mass):
    """Two masses between springs (3,): ground, first mass, second mass, ground."""
    a, b, c = stiffness
    return np.array([[a + b, -b], [-b, b + c]]), np.diag(mass)


def test_modes_of_two_masses_are_the_closed_form():
    """Equal masses m on equal springs k: k/m and 3 k/m (Rayleigh, Theory of Sound)."""
    modes = modes_of_matrices(chain((2.0, 2.0, 2.0), (0.5, 0.5)), ROW, {}, nodes("ring", "sensor A"), 1.0, 1.0)
    assert modes.frequency**2 == pytest.approx([4.0, 12.0])
    assert np.abs(modes.shape) == pytest.approx(np.ones((2, 2)))
    assert modes.compliance is None and modes.damping is None and modes.foot_force.shape == (2, 0)


def test_units_of_length_and_mass_are_those_of_the_file():
    """In mm, t and s the same numbers of stiffness over mass: frequencies stay, shapes are of kilograms."""
    modes = modes_of_matrices(chain((2.0, 2.0, 2.0), (0.5, 0.5)), ROW, {}, nodes("ring", "sensor A"), 1e-3, 1e3)
    assert modes.frequency**2 == pytest.approx([4.0, 12.0])
    assert np.abs(modes.shape) == pytest.approx(np.ones((2, 2)) / np.sqrt(1e3))
    assert modes.position[2] == pytest.approx([2e-3, 0.0, 0.0])


def test_a_coordinate_without_mass_follows_the_others_and_keeps_its_compliance():
    """Springs a and b, c in series to the ground: k = a + b c/(b + c), and 1/(b + c) of the coordinate alone."""
    a, b, c = 2.0, 3.0, 6.0
    modes = modes_of_matrices(chain((a, b, c), (0.5, 0.0)), ROW, {}, nodes("ring", "sensor A"), 1.0, 1.0)
    assert modes.frequency**2 == pytest.approx([(a + b * c / (b + c)) / 0.5])
    assert modes.shape[0, 1] / modes.shape[0, 0] == pytest.approx(b / (b + c))
    assert modes.compliance == pytest.approx(np.diag([0.0, 1.0 / (b + c)]))


def test_a_casing_that_nothing_holds_is_refused():
    with pytest.raises(CaseError) as error:
        modes_of_matrices(chain((0.0, 2.0, 0.0), (0.5, 0.5)), ROW, {}, nodes("ring", "sensor A"), 1.0, 1.0)
    assert error.value.code == "E-MECHANISM" and "hold the casing" in error.value.remedy


def test_a_binary_dataset_that_breaks_off_is_told_as_such(tmp_path):
    head = b"    -1\n    58b     1     2          11        4096     0     0           0           0\n"
    path = tmp_path / "a.uff"
    for data in (head + b"NONE\n" * 11 + b"\0" * 100, head + b"NONE\n" * 3):
        path.write_bytes(data)
        with pytest.raises(CaseError, match="it breaks off within a binary dataset") as refused:
            modes_of_universal_file(path, nodes("ring"), 1.0, 1.0)
        assert refused.value.code == "E-FILE"
