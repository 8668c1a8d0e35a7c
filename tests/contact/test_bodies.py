"""Gears of two materials and of two face widths: Hertz's pressure, symmetry, similarity, what is shared."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import (
    active_flank_friction,
    active_flank_load,
    flank_widths,
    make_bodies,
    make_sectors,
    station_weights,
)
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.width_waves import width_waves
from femgear.fe.elasticity import Material, stiffness
from femgear.gears.gear import Gear
from femgear.gears.iso6336 import elasticity_factor
from femgear.gears.iso6336_root import root_face_width
from femgear.gears.iso6336_stiffness import material_factor
from femgear.gears.pair import GearPair, close_pair
from validation.planetary import reference_set

STEEL, IRON = Material(206e9, 0.3, 7850.0), Material(110e9, 0.26, 7100.0)
WIDTH, TORQUE = 0.02, 100.0


def pair_of(*widths: float, teeth: tuple[int, int] = (24, 24)) -> GearPair:
    gears = (
        Gear(
            teeth=z,
            module=3e-3,
            pressure_angle=math.radians(20.0),
            profile_shift=0.0,
            face_width=width,
            rim_radius=r,
            name=f"gear_{i}",
        )
        for i, (z, width, r) in enumerate(zip(teeth, widths, (0.018, 0.018)), start=1)
    )
    return close_pair(*gears)


def walked(pair: GearPair, *materials: Material, torque: float = TORQUE, elements: int = 8):
    bodies = make_bodies(make_sectors(pair, materials, flank_elements=elements), materials)
    options = CycleOptions(pressures=True)
    return walk_mesh_cycle(pair, bodies, sun_torque=torque, positions=12, options=options)


def hertz(pair: GearPair, cycle, modulus: float) -> np.ndarray:
    """Pressure of Hertz's line contact under every load, ``sqrt(F' E* / (pi R))`` (Johnson, eq. 4.45)."""
    length = pair.gear_1.base_radius * math.tan(pair.working_pressure_angle)
    one, two = length + cycle.path[0], length - cycle.path[0]
    line = cycle.tooth_load[0] / pair.face_width
    return np.sqrt(line * modulus * (one + two) / (one * two) / math.pi)


@pytest.mark.parametrize("widths", [(WIDTH, WIDTH), (WIDTH, 1.5 * WIDTH)])
def test_pressure_is_that_of_hertz_with_both_materials_over_the_common_width(widths):
    pair = pair_of(*widths)
    cycle = walked(pair, STEEL, IRON, elements=12)
    compliance = (1 - 0.3**2) / 206e9 + (1 - 0.26**2) / 110e9
    alone = (cycle.tooth_load[0] > 0).sum(axis=0) == 1
    ours, theirs = cycle.max_pressure[0][alone], hertz(pair, cycle, 1 / compliance).max(axis=0)[alone]
    assert alone.any() and ours == pytest.approx(theirs, rel=0.01)


def test_gears_that_exchange_their_materials_are_the_mirrored_pair():
    pair = pair_of(WIDTH, WIDTH)
    one, two = walked(pair, STEEL, IRON), walked(pair, IRON, STEEL)
    # the mirror image passes the positions backwards, with cells laid on flank 1
    assert two.deflection[0] == pytest.approx(np.roll(one.deflection[0, ::-1], 1), rel=2e-4)
    assert two.stiffness.mean() == pytest.approx(one.stiffness.mean(), rel=2e-4)


def test_a_soft_gear_lies_between_two_stiff_and_two_soft_ones():
    """Springs in series: twice the compliance of the mixed pair is that of both uniform ones together."""
    pair = pair_of(WIDTH, WIDTH)
    soft = replace(STEEL, youngs_modulus=103e9)
    stiff, mixed, both = (
        1.0 / walked(pair, *of).stiffness.mean() for of in ((STEEL, STEEL), (STEEL, soft), (soft, soft))
    )
    assert stiff < mixed < both
    assert 2.0 * mixed == pytest.approx(stiff + both, rel=0.01)


def test_moduli_and_torque_together_leave_the_transmission_error():
    pair, factor = pair_of(WIDTH, 1.3 * WIDTH), 2.5
    grown = [replace(one, youngs_modulus=factor * one.youngs_modulus) for one in (STEEL, IRON)]
    one, two = walked(pair, STEEL, IRON), walked(pair, *grown, torque=factor * TORQUE)
    assert two.deflection == pytest.approx(one.deflection, rel=1e-8)
    assert two.stiffness == pytest.approx(factor * one.stiffness, rel=1e-6)


def test_widths_and_torque_together_leave_the_transmission_error():
    one = walked(pair_of(WIDTH, 1.3 * WIDTH), STEEL, IRON)
    two = walked(pair_of(2 * WIDTH, 2.6 * WIDTH), STEEL, IRON, torque=2 * TORQUE)
    assert two.deflection == pytest.approx(one.deflection, rel=1e-8)


def test_teeth_have_the_common_width_and_bodies_their_own():
    """The stiffness of a sector is the sum of its parts, each in proportion to its own width."""
    sectors = make_sectors(pair_of(WIDTH, 1.5 * WIDTH), STEEL, flank_elements=6)
    grid = sectors.planet.grid
    parts = [stiffness(grid, STEEL, thickness={"tooth": t, "body": b}) for t, b in ((WIDTH, 1e-12), (1e-12, WIDTH))]
    missed = sectors.planet.stiffness - (parts[0] + 1.5 * parts[1])
    assert abs(missed).max() < 1e-9 * abs(sectors.planet.stiffness).max()
    narrow = make_sectors(pair_of(WIDTH, WIDTH), STEEL, flank_elements=6)
    assert abs(sectors.sun.stiffness - narrow.sun.stiffness).max() == 0.0


def test_a_wider_body_yields_less_but_no_less_than_its_width():
    equal, wide = (
        make_bodies(make_sectors(pair, STEEL, flank_elements=8), STEEL)
        for pair in (pair_of(WIDTH, WIDTH), pair_of(WIDTH, 1.5 * WIDTH))
    )
    own, wider = (
        np.diagonal(bodies.planet.regular[0]) + np.diagonal(bodies.planet.local, axis1=1, axis2=2).ravel()
        for bodies in (equal, wide)
    )
    assert ((wider < own) & (wider > own / 1.5)).all()
    # from tooth to tooth loads go through the body, which teeth stiffen a little
    across = (bodies.planet.regular[8, 4, 4] for bodies in (wide, equal))
    assert next(across) * 1.5 == pytest.approx(next(across), rel=0.01)


def test_flanks_of_planets_share_other_widths_with_sun_and_ring():
    assert flank_widths([0.03, 0.025, 0.02]) == [(0.025, 0.025), (0.025, 0.02), (0.02, 0.02)]
    assert flank_widths([0.03, 0.02]) == [(0.02, 0.02), (0.02, 0.02)]


def test_factors_of_the_standards_for_two_materials():
    """Z_E of ISO 6336-2, table 1: steel with spheroidal and with grey cast iron; E of ISO 6336-1."""
    assert elasticity_factor(206e9, 0.3) == pytest.approx(189.8e3, rel=2e-4)
    assert elasticity_factor(206e9, 0.3, (173e9, 0.3)) == pytest.approx(181.4e3, rel=3e-4)
    assert elasticity_factor(206e9, 0.3, (126e9, 0.3)) == pytest.approx(165.4e3, rel=1e-3)
    assert material_factor(206e9, 206e9) == 1.0
    assert material_factor(206e9, 103e9) == pytest.approx(2 / 3)
    assert STEEL.contact_modulus(IRON) == pytest.approx(1 / (0.91 / 206e9 + (1 - 0.26**2) / 110e9))
    assert root_face_width(0.03, 0.02, 2e-3) == pytest.approx(0.024)
    assert root_face_width(0.022, 0.02, 2e-3) == 0.022


@pytest.mark.decisive
def test_waves_across_the_face_in_common_bend_no_more_than_that_part_of_a_wider_body():
    """Plane part and change together are the same for a wide and a narrow body; neither falls below zero."""
    found = []
    for pair in (pair_of(WIDTH, WIDTH), pair_of(WIDTH, 3 * WIDTH)):
        sectors = make_sectors(pair, STEEL, flank_elements=6, refine=0.5)
        waves, bodies = width_waves(sectors, STEEL, 5), make_bodies(sectors, STEEL)
        # of teeth half a gear apart nothing is local
        found.append([bodies.planet.regular[12, 3, 3] + one.planet.regular[12, 3, 3] for one in waves.bodies])
    assert found[0] == pytest.approx(found[1], abs=1e-9 * bodies.planet.regular[0].max())


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_friction_of_a_flank_is_across_its_load_and_a_turning_along_it(side):
    """At every node; all friction together is a unit force, and the turning has a unit moment."""
    gears = reference_set()
    grid = make_sectors(gears, STEEL, flank_elements=6).ring.grid
    load = active_flank_load(grid, gears, side).reshape(-1, 2)
    friction, couple = active_flank_friction(grid, gears, side).T.reshape(2, -1, 2)
    assert np.abs((load * friction).sum(axis=1)).max() < 1e-12
    assert np.linalg.norm(friction, axis=1) == pytest.approx(np.linalg.norm(load, axis=1), abs=1e-12)
    assert np.linalg.norm(friction, axis=1).sum() == pytest.approx(1.0)
    turning = load[:, 0] * couple[:, 1] - load[:, 1] * couple[:, 0]
    assert np.abs(turning).max() < 1e-9 * np.abs(couple).max()
    arm = grid.points - np.linalg.norm(load, axis=1) @ grid.points
    moment = (arm[:, 0] * couple[:, 1] - arm[:, 1] * couple[:, 0]).sum()
    # planets turn clockwise while the left flank of the ring carries
    assert moment == pytest.approx(-side)


def test_cubics_are_interpolated_exactly_and_continued_by_half_a_spacing():
    def cubic(x):
        return 1.0 - 2.0 * x + 0.5 * x**2 - 0.25 * x**3

    index, weight = station_weights(np.array([-3.0, -0.4, 0.3, 2.6, 5.4, 9.0]), np.arange(6.0))
    assert (weight * cubic(index)).sum(axis=-1) == pytest.approx(cubic(np.array([-0.5, -0.4, 0.3, 2.6, 5.4, 5.5])))
