"""Damping of gears and ring as a whole in a structure, and the stability of a turn."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.two_way.response import MeshPaths, solve_two_way, structure_lines
from femgear.housing.two_way.structure import Support, circumferential, equal_sectors, ring_waves, supported_ring
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from validation.fixed_housing import EQUAL, FEET, excitation, gears, joined, thin_ring
from validation.reference.two_way_direct import direct_damped_forces, farthest_apart

pytestmark = pytest.mark.usefixtures("coarse_states")

RING = thin_ring(4, foundation=2e10)
STRUCTURE = supported_ring(RING, FEET, max_diameter=4, max_frequency=1e6, damping_ratio=0.04, sensor_angles=(0.3, 2.0))


def solved(symmetry, *, damped=True, structure=STRUCTURE, speeds=(8.0, 30.0), **changed):
    paths = MeshPaths(97, EQUAL, 0.1, symmetry)
    drive = excitation(paths)
    mean = drive.stiffness.mean(axis=1)
    damping = modal_damping(joined(paths, RING, 4), mean, 0.04) if damped else None
    modes = undamped_modes(gears(EQUAL), mean, damping_ratio=0.04)
    known = {"harmonics": (2, 4), "damping": damping} | changed
    return solve_two_way(modes, drive, structure, paths, np.array(speeds), **known)


def test_waves_are_those_of_the_circumferential_components():
    """A wave n has the component n alone."""
    waves = ring_waves(STRUCTURE.wave_order)
    np.testing.assert_allclose(waves @ waves.conj().T, np.eye(len(waves)), atol=1e-15)
    component = waves.conj() @ circumferential(RING, RING.output[:, 1], 4)
    own = STRUCTURE.wave_order[:, None] == np.arange(-4, 5)
    assert np.abs(component[own]).min() > 1e-3
    np.testing.assert_allclose(component[~own], 0.0, atol=1e-15)


def test_one_linear_system_of_all_harmonics_gives_the_same_forces():
    paths, ring = MeshPaths(37, EQUAL, 0.1, 1), thin_ring(2, foundation=2e10)
    structure = supported_ring(ring, FEET, max_diameter=2, max_frequency=1e6, damping_ratio=0.03)
    drive = excitation(paths, -1)
    mean = drive.stiffness.mean(axis=1)
    matrix = modal_damping(joined(paths, ring, 2), mean, 0.04)
    modes = undamped_modes(gears(EQUAL), mean, damping_ratio=0.04)
    data = modes, drive, structure, paths
    found = solve_two_way(*data, [-20.0], harmonics=(1, 3), damping=matrix, tolerance=1e-13)
    direct = direct_damped_forces(*data, -20.0, matrix, harmonics=(1, 3))
    assert farthest_apart(found, 0, *direct) < 1e-9


def test_one_planet_stands_for_three():
    (order, all_lines), (kept, lines) = (structure_lines(STRUCTURE, solved(n)) for n in (1, 3))
    size = np.abs(lines).max()
    np.testing.assert_allclose(all_lines[..., np.isin(order, kept)], lines, rtol=0, atol=1e-9 * size)
    assert np.abs(all_lines[..., ~np.isin(order, kept)]).max() < 1e-10 * size


@pytest.mark.parametrize(("sectors", "symmetry"), [(2, 3), (4, 3), (6, 3), (6, 1), (3, 1)])
def test_equal_sectors_couple_waves_of_their_number_alone(sectors, symmetry):
    """Every other side band is found to be nothing where all of them are solved for."""
    bolts = [Support(0.4 + 2 * np.pi * i / sectors, 4e8, 1e8, 0.1, 0.2) for i in range(sectors)]
    structure = supported_ring(
        RING, bolts[::-1], max_diameter=4, max_frequency=1e6, damping_ratio=0.04, sensor_angles=(0.3, 2.0)
    )
    assert structure.sectors == sectors
    few, every = (solved(symmetry, structure=replace(structure, sectors=count)) for count in (sectors, 1))
    size = np.abs(every.force).max(axis=(1, 2), keepdims=True)
    kept = np.isin(every.order, few.order)
    assert 0.1 < kept.mean() < 0.7
    np.testing.assert_allclose(few.force / size, (every.force / size)[..., kept], rtol=0, atol=1e-10)
    assert (np.abs(every.force)[..., ~kept] < 1e-10 * size).all()
    (order, lines), (all_orders, all_lines) = (structure_lines(structure, one) for one in (few, every))
    size = np.abs(all_lines).max()
    kept = np.isin(all_orders, order)
    np.testing.assert_allclose(lines, all_lines[..., kept], rtol=0, atol=1e-9 * size)
    assert np.abs(all_lines[..., ~kept]).max(initial=0.0) < 1e-9 * size


def test_sectors_of_supports():
    """Supports of different kinds, at places that do not fit, or none."""
    bolts = [Support(2 * np.pi * i / 6, 4e8, 4e8) for i in range(6)]
    assert equal_sectors(bolts, 29) == 6
    assert equal_sectors([replace(one, mass=0.1 * (i % 2)) for i, one in enumerate(bolts)], 29) == 3
    assert equal_sectors([replace(bolts[0], angle=1e-6), *bolts[1:]], 29) == 1
    assert equal_sectors([replace(bolts[0], angle=-2 * np.pi), *bolts[1:]], 29) == 6
    assert equal_sectors(bolts[:5], 29) == 1 and equal_sectors([], 29) == 29


def test_it_is_not_that_of_gears_and_ring_apart():
    whole, apart = (structure_lines(STRUCTURE, solved(3, damped=one))[1] for one in (True, False))
    assert np.abs(whole - apart).max() > 1e-3 * np.abs(apart).max()


def test_speeds_do_not_depend_on_one_another():
    both, alone = solved(3), solved(3, speeds=(30.0,))
    np.testing.assert_allclose(both.force[1], alone.force[0], atol=1e-11 * np.abs(alone.force).max())
    assert both.residual.max() < 1e-10


@pytest.mark.parametrize(
    "changed",
    [
        {"damping": np.eye(3)},
        {"structure": replace(STRUCTURE, wave_shape=np.zeros((0, 0)), wave_order=np.zeros(0, int))},
    ],
)
def test_refused(changed):
    with pytest.raises(CaseError) as error:
        solved(3, **changed)
    assert error.value.code == "E-SHAPE"
