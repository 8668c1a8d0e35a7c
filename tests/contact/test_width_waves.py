"""Helical teeth in the contact itself: slices that run ahead of one another."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set

from femgear.contact.bodies import helical_stiffness, make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.supports import pin_forces
from femgear.contact.width_waves import _beside, condensed_waves, width_waves
from femgear.gears.deviations import no_deviations
from femgear.gears.modifications import FlankForm, LeadCrowning, LeadSlope

SLICES = 12
HEIGHT = (np.arange(SLICES) + 0.5) / SLICES - 0.5


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


@pytest.fixture(scope="module")
def waves(gears):
    return width_waves(make_sectors(gears, STEEL, flank_elements=6, refine=0.5), STEEL, SLICES)


def walk(gears, bodies, waves, overlap, *lead, **options):
    """A walk with slices ahead by an overlap ratio, None for spur teeth; the lead is that of the sun."""
    options = {"sun_torque": TORQUE, "positions": 24} | options
    ahead = None if overlap is None else overlap * HEIGHT
    return walk_mesh_cycle(
        gears,
        bodies,
        deviations=replace(no_deviations(gears), sun=FlankForm(lead)),
        options=CycleOptions(waves=waves, slices=SLICES, ahead=ahead),
        **options,
    )


@pytest.fixture(scope="module")
def whole_overlap(gears, bodies, waves):
    return walk(gears, bodies, waves, 1.0)


def test_waves_reach_from_one_half_wave_to_the_finest_of_the_slices(gears, waves):
    """N slices have half waves 1 to N - 1; few of them are computed as they are, none for nothing."""
    sun = make_sectors(gears, STEEL, flank_elements=4, refine=1.0).gears[0]
    few = condensed_waves(sun, STEEL, 4, gears.sun.face_width)
    for computed, slices in ((waves, SLICES), (few, 4)):
        half_waves = computed.wave_number * gears.sun.face_width / np.pi
        assert half_waves[[0, -1]] == pytest.approx([1.0, slices - 1.0], rel=1e-12)
    assert len(few.waves) == len(few.wave_number) == 3


@pytest.mark.parametrize("lead", [(), (LeadSlope(10e-6), LeadCrowning(3e-6))])
def test_slices_at_one_position_are_those_of_spur_teeth(gears, bodies, waves, lead):
    """The general solution with laws and compliances of every slice, where they are all the same."""
    spur, found = (walk(gears, bodies, waves, one, *lead, positions=[0.0, 0.4]) for one in (None, 0.0))
    for name in ("deflection", "force", "slice_load", "path"):
        values = getattr(spur, name)
        assert np.abs(getattr(found, name) - values).max() < 1e-10 * np.abs(values).max(), name
    # springs in place of cells: what curves between few forces miss
    assert np.abs(found.stiffness / spur.stiffness - 1).max() < 5e-3


def test_meshes_that_only_an_end_of_the_width_loads_are_coupled(gears, bodies, waves):
    """A pin off its place by more than the teeth bend: without the lead its planet carries nothing."""
    pins = np.array([[0.0, 5e-6], [0.0, 0.0], [0.0, 0.0]])
    errors = replace(no_deviations(gears), pin_errors=pins)
    options = {"sun_torque": TORQUE, "positions": [0.0, 0.4], "deviations": errors}
    assert walk_mesh_cycle(gears, bodies, **options).open_planets.any()
    options["deviations"] = replace(errors, sun=FlankForm((LeadSlope(8e-6), LeadCrowning(3e-6))))
    spur, found = (
        walk_mesh_cycle(
            gears,
            bodies,
            **options,
            options=CycleOptions(waves=waves, slices=SLICES, ahead=ahead, held_bodies=bodies, held_waves=waves),
        ).held_compliance
        for ahead in (None, np.zeros(SLICES))
    )
    assert np.abs(spur).min() > 0.0
    assert np.abs(found - spur).max() < 5e-3 * np.abs(spur).max()


@pytest.mark.slow
def test_a_whole_overlap_ratio_leaves_little_of_the_transmission_error(gears, bodies, waves, whole_overlap):
    ripple = {one: np.ptp(walk(gears, bodies, waves, one).sun_arc) for one in (None, 0.5, 2.0)}
    ripple[1.0] = np.ptp(whole_overlap.sun_arc)
    assert ripple[1.0] < 0.05 * ripple[None] and ripple[2.0] < 0.05 * ripple[None]
    assert 0.3 * ripple[None] < ripple[0.5] < 0.8 * ripple[None]


@pytest.mark.parametrize("overlap", [0.6, 1.0])
def test_other_hand_mirrors_the_width(gears, bodies, waves, overlap):
    right, left = (walk(gears, bodies, waves, one, positions=6) for one in (overlap, -overlap))
    assert np.abs(right.sun_arc - left.sun_arc).max() < 1e-9 * right.sun_arc.max()
    assert np.abs(right.slice_load - left.slice_load[:, :, ::-1]).max() < 1e-9 * right.slice_load.max()


def test_other_torque_is_the_mirror_image(gears, bodies, waves):
    """A right-handed set under a negative torque is a left-handed one under a positive torque, backwards."""
    right = walk(gears, bodies, waves, 0.7, positions=8)
    other = walk(gears, bodies, waves, -0.7, positions=8, sun_torque=-TORQUE)
    backwards = -np.arange(8) % 8
    assert other.sun_arc == pytest.approx(right.sun_arc[backwards], rel=1e-9)
    assert other.slice_load.sum(axis=1)[0] == pytest.approx(
        right.slice_load.sum(axis=1)[0][:, backwards], rel=1e-9, abs=1e-9 * right.slice_load.max()
    )


def test_loads_balance_the_torque_and_go_over_the_width(gears, whole_overlap):
    """Forces of all slices at every position, and of every slice over a mesh period."""
    found = whole_overlap
    force = found.slice_load.sum(axis=1).mean(axis=1)[:3].sum(axis=0)
    assert force == pytest.approx(TORQUE / gears.sun.base_radius, rel=1e-9)
    # tooth pairs are in equilibrium with the means of the mesh forces at every position, and so are the pins
    assert found.tooth_load.sum(axis=1) == pytest.approx(found.force, rel=1e-9)
    assert found.slice_load.mean(axis=2) == pytest.approx(found.tooth_load, rel=1e-9)
    assert found.bearing_force == pytest.approx(pin_forces(gears, found.force, found.back_force), rel=1e-9)
    assert found.face_load_factor == pytest.approx(1.0, abs=0.02)
    assert found.helical and found.residual.max() < 1e-12


@pytest.mark.slow
def test_softer_teeth_are_those_of_a_softer_material(gears, bodies, waves):
    """Young's modulus and section factor scale all separations of one load alike."""
    soft = helical_stiffness(np.radians(18.75), internal=False)
    helical = replace(waves, bodies=tuple(replace(one, helical=(soft, soft)) for one in waves.bodies))
    found = walk(gears, replace(bodies, helical=(soft, soft)), helical, 1.0, positions=6)
    steel = replace(STEEL, youngs_modulus=soft * STEEL.youngs_modulus)
    other = make_bodies(make_sectors(gears, steel, flank_elements=12), steel)
    across = width_waves(make_sectors(gears, steel, flank_elements=6, refine=0.5), steel, SLICES)
    expected = walk(gears, other, across, 1.0, positions=6)
    # windows are wider where the material is softer
    assert found.deflection == pytest.approx(expected.deflection, rel=1e-3)
    assert found.stiffness.mean() == pytest.approx(expected.stiffness.mean(), rel=1e-3)


def test_waves_beside_their_line():
    """Beside the line the limit, far from it nothing but the uniform load's logarithm."""
    k = np.array([[200.0], [3000.0]])
    near = _beside(np.array([0.0, 1e-9]), k)
    assert near[:, 0] == pytest.approx(near[:, 1], abs=1e-8)
    assert _beside(np.array([0.05]), k[1:]) == pytest.approx(np.log(0.05))
