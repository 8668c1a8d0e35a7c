"""A system on one rotation: tables over the phase, directions that turn, motions that nothing holds."""

from dataclasses import replace

import numpy as np
import pytest
from two_wheels import INERTIAS, RADII, TEETH, two_wheels

from femgear.errors import CaseError
from femgear.solvers.time.spun_system import DRIVE, SPRING, ContactGroup, spun_system
from femgear.system.force_laws import GearMeshes, PolynomialSprings, turning_wave
from femgear.system.fourier import FourierSeries
from femgear.system.system import MechanicalSystem
from femgear.system.turning_meshes import TurningMeshes


def test_tables_are_those_of_the_series_at_the_phase_of_the_mesh():
    gap = np.array([2e-6, 1e-6 - 2e-6j])
    wheels = two_wheels(harmonics=4, gap=gap, backlash=1e-4)
    angle = np.array([0.0, 0.013, -0.4, 7.7])
    phase = np.abs(TEETH * angle)[:, None]
    k, found = FourierSeries(wheels.wave[None]).at(phase), wheels.spun.at_phases(wheels.spun.stiffness, angle)
    assert np.abs(found[:, :1] / k - 1.0).max() < 1e-5 and np.array_equal(found[:, 0], found[:, 1])
    gaps = wheels.spun.at_phases(wheels.spun.gap, angle)
    assert gaps[:, 0] == pytest.approx(FourierSeries(gap[None]).at(phase)[:, 0], abs=1e-11)
    assert gaps[:, 1] == pytest.approx(1e-4)
    assert wheels.spun.inertia == pytest.approx(INERTIAS[0] + INERTIAS[1] * (RADII[0] / RADII[1]) ** 2, rel=1e-12)


def turning(**changes):
    """A mass on springs, pushed by a flank whose direction turns, and a spring beside it."""
    K = np.diag([1e6, 1e6, 0.0])
    system = MechanicalSystem(np.eye(3), np.zeros((3, 3)), K, np.eye(3), np.zeros(3), tuple("xya"))
    columns, series = np.array([[0, 1]]), FourierSeries(np.array([[1e5]]))
    odd, even = np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]])
    wave = turning_wave((2,))
    flank = TurningMeshes(columns, 0.0 * even, even, odd, wave, series, **changes)
    beside = ContactGroup(GearMeshes(np.array([1]), series), SPRING, np.zeros(1, int))
    groups = [ContactGroup(flank, DRIVE, np.array([0])), beside]
    return spun_system(system, groups, ("mesh",), base_ratio=[1.5], shaft=np.eye(3)[2])


def test_directions_turn_with_their_carrier():
    spun = turning()
    angle = np.array([0.0, 0.4, -1.1])
    S = spun.selection(angle)
    assert S[:, 0, 0] == pytest.approx(np.cos(3.0 * angle)) and S[:, 1, 0] == pytest.approx(np.sin(3.0 * angle))
    assert np.all(S[:, :, 1] == [0.0, 1.0, 0.0]) and spun.closed == 2 and spun.drives.tolist() == [0]
    assert spun.spin == pytest.approx([0.0, 0.0, 1.0])


def test_static_flexibility_holds_laws_that_are_springs():
    """Contacts closed and a spring of a law beside one another; the rotation that is driven stays out of it."""
    spun = replace(turning(), laws=(PolynomialSprings(np.array([1]), np.array([[2e5]])),))
    W, k = np.array([[1.0], [0.0], [0.0]]), np.array([3e5])
    assert spun.law_springs[1] == pytest.approx(2e5)
    held = spun.static_flexibility(W, k)[:2, :2]
    wanted = np.diag([1e6, 1e6]) + np.diag([3e5, 0.0]) + np.diag([0.0, 2e5])
    assert np.linalg.inv(held) == pytest.approx(wanted, rel=1e-9, abs=1e-3)


def test_springs_beside_flanks_are_no_mesh_force():
    spun = turning()
    approach, k, gap = np.array([[2e-6, -5e-6], [-1e-6, 3e-6]]), np.full((1, 2), 1e5), np.zeros((1, 2))
    assert spun.mesh_forces(approach, k, gap, parts=False)[:, 0] == pytest.approx([0.2, -0.1])
    assert spun.mesh_forces(approach, k, gap, parts=True)[:, 0] == pytest.approx([0.2, 0.0])
    assert spun.touching(approach, gap)[:, 0].tolist() == [True, False]


def test_stiffness_below_zero_and_two_free_motions_are_refused():
    with pytest.raises(CaseError) as refused:
        two_wheels(harmonics=1, wave=np.array([2e8, 2.1e8]))
    assert refused.value.code == "E-STIFFNESS" and refused.value.remedy
    system = MechanicalSystem(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 1)), np.zeros(2), ("a", "b"))
    group = ContactGroup(GearMeshes(np.array([0]), FourierSeries(np.array([[1e8]]))), DRIVE, np.array([0]))
    with pytest.raises(CaseError) as refused:
        spun_system(system, [group], ("mesh",), base_ratio=[1.0], shaft=np.eye(2)[0])
    assert refused.value.code == "E-MECHANISM" and refused.value.remedy
