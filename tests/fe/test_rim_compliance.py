"""Compliance of the rim under waves of traction."""

from pathlib import Path

import numpy as np
import pytest

from femgear.fe.compliance import rim_compliance
from femgear.housing.two_way.structure import Support, supported_ring
from femgear.stages.static import solve_static
from femgear.trains.elastic.stages import solve_modes
from femgear.trains.reading import read_case, with_values

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
SMALL = {"static.positions": 8, "static.flank_elements": 6, "static.stresses": False, "runup.count": 0}


@pytest.fixture(scope="module")
def ring():
    case = with_values(read_case(CASE), SMALL)
    return solve_modes(case, solve_static(case)).ring


def test_short_waves_are_those_of_a_half_plane(ring):
    """Pressure p cos(k x) moves a half plane by 2 p/(E k): K. L. Johnson, Contact Mechanics, 1985, 13.2."""
    orders = np.array([60, 90])
    found = rim_compliance(*ring.sector, count=108, orders=orders)
    # a force a radian on the width of 25 mm; the compliance is a 2 pi-th of that of the amplitude
    expected = 1.0 / (np.pi * 206e9 * 0.025 * orders)
    assert np.real(found[:, 0, 0]) == pytest.approx(expected, rel=0.02)
    assert np.real(found[:, 1, 1]) == pytest.approx(expected, rel=0.02)


def test_long_waves_are_those_of_the_modes(ring):
    """On the foundation a rigid translation or rotation, and a little more."""
    found = ring.rim_compliance
    assert np.abs(found - found.conj().swapaxes(1, 2)).max() < 1e-9 * np.abs(found).max()
    around = 2 * np.pi * 0.1 * 0.025 * 1e10
    assert 1.0 < np.real(found[1, 0, 0]) / (0.5 / around) < 1.05
    assert np.real(found[0, 1, 1]) == pytest.approx(1.0 / around, rel=0.01)


def test_feet_press_into_the_rim(ring):
    """CalculiX: plane ring on four feet of 4e9 N/m, 20 mm wide, without mass."""
    held = [Support(np.radians(a), 4e9, 4e9, 0.0, 0.2) for a in (35, 145, 215, 325)]
    known = {"max_diameter": 14, "max_frequency": np.inf, "damping_ratio": 0.05}
    found = supported_ring(ring.modes, held, rim=ring.rim_compliance, **known).natural_frequency[:7]
    expected = np.array([4751.1, 4848.4, 5556.7, 5805.2, 6758.2, 7757.8, 9931.1])
    assert found / (2 * np.pi) == pytest.approx(expected, rel=0.002)
