"""Errors that turn, in a housing that stands still; against time integration in validation."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.two_way.carrier_orders import MeshPaths
from femgear.housing.two_way.response import solve_two_way, structure_lines
from femgear.solvers.linear.modal import undamped_modes
from femgear.stages.protocol import one_blas_thread
from validation.fixed_housing import EQUAL, excitation, feet, gears, rigid_modes, shaken
from validation.reference.two_way_direct import direct_forces, farthest_apart

SPEEDS = np.array([-40.0, -70.0])
STRUCTURE = feet(6)
FEW = {"harmonics": (2, 4)}


def paths(symmetry: int) -> MeshPaths:
    return MeshPaths(97, EQUAL, 0.1, symmetry)


def tiled(drive, periods: int):
    arrays = {name: getattr(drive, name) for name in ("stiffness", "deflection", "force")}
    return replace(drive, periods=periods, **{name: np.tile(one, (1, periods)) for name, one in arrays.items()})


@one_blas_thread()
def lines(drive, symmetry: int):
    found = solve_two_way(rigid_modes(paths(1), drive), drive, STRUCTURE, paths(symmetry), SPEEDS, **FEW)
    return found, *structure_lines(STRUCTURE, found)


@pytest.mark.parametrize("symmetry", [3, 1])
def test_a_record_over_more_periods_than_it_needs_changes_nothing(symmetry):
    drive = excitation(paths(1), -1)
    (once, order, expected), (thrice, more, found) = (lines(one, symmetry) for one in (drive, tiled(drive, 3)))
    assert (once.turns, thrice.turns) == (1, 3)
    at = np.searchsorted(more, order)
    size = np.abs(expected).max()
    assert np.abs(found[..., at] - expected).max() < 1e-12 * size
    assert np.abs(np.delete(found, at, axis=-1)).max(initial=0.0) < 1e-12 * size
    assert thrice.tail == pytest.approx(once.tail, rel=1e-10)


def test_refusals():
    drive = shaken(paths(1), 3, planet=1, sense=-1)
    unequal = undamped_modes(gears(EQUAL), [5e6, 5.1e6, *[5e6] * 4], damping_ratio=0.04)
    with pytest.raises(CaseError, match=r"E-SYMMETRY.*mean stiffness"):
        solve_two_way(unequal, drive, STRUCTURE, paths(3), SPEEDS, **FEW)


@pytest.mark.slow
def test_errors_that_are_not_small_are_solved():
    """A mesh that is gone for a third of the turns of a gear, hardly damped: the same equations."""
    drive, half = shaken(paths(1), 3, planet=1, sense=-1), np.repeat([1.9, 0.1, 1.0], 64)
    wild = replace(drive, stiffness=5e6 * np.tile(half, (6, 1)))
    modes = undamped_modes(gears(EQUAL), np.full(6, 5e6), damping_ratio=1e-3)
    found = solve_two_way(modes, wild, STRUCTURE, paths(3), SPEEDS[:1], **FEW, tolerance=1e-7)
    assert found.residual.max() < 1e-6 and found.spectral_radius[0] > 1.0 and found.products[0] > 100


@pytest.mark.parametrize("coupled", [4, 2])
@pytest.mark.parametrize(("sense", "symmetry"), [(1, 3), (-1, 1)])
def test_one_linear_system_of_all_harmonics_gives_the_same_forces(sense, symmetry, coupled):
    drive, structure, speed = excitation(paths(symmetry), sense), feet(4), 20.0 * sense
    data = rigid_modes(paths(symmetry), drive), drive, structure, paths(symmetry)
    found = solve_two_way(*data, [speed], harmonics=(2, 4), coupled_diameters=coupled, tolerance=1e-13)
    direct = direct_forces(*data, speed, harmonics=(2, 4), coupled=coupled)
    assert farthest_apart(found, 0, *direct) < 1e-9


def test_errors_that_turn_give_the_forces_of_one_linear_system():
    """Over three mesh periods, of which 97 teeth are no multiple: most orders are no whole numbers."""
    drive, structure = shaken(paths(1), 3), feet(2)
    data = rigid_modes(paths(1), drive), drive, structure, paths(1)
    found = solve_two_way(*data, [40.0], harmonics=(1, 2), tolerance=1e-13)
    direct = direct_forces(*data, 40.0, harmonics=(1, 2), coupled=2)
    assert farthest_apart(found, 0, *direct) < 1e-9
