"""Pressure distributions of the mesh cycle against Hertz's line contact."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
WIDTH = 0.02
LINE_LOAD = 1e5


@pytest.fixture(scope="module")
def standard():
    """z 20/40/100 of module 2 mm without shifts, one planet: rho 6.8404, 13.6808 mm at the pitch point."""
    common = dict(module=2e-3, pressure_angle=np.deg2rad(20), profile_shift=0.0, face_width=WIDTH)
    gears = PlanetarySet(
        Gear(teeth=20, rim_radius=0.012, **common),
        Gear(teeth=40, rim_radius=0.03, **common),
        Gear(teeth=100, rim_radius=0.115, internal=True, **common),
        centre_distance=0.06,
        planet_angles=(0.0,),
    )
    return gears, make_bodies(make_sectors(gears, STEEL, flank_elements=16), STEEL)


@pytest.fixture(scope="module")
def reference():
    gears = reference_set()
    return gears, make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


def areas(cycle, width):
    """Area of a cell of every mesh (2N, 1, 1) [m^2]."""
    return (np.diff(cycle.pressure_offset[:, :2], axis=1) * width)[:, :, None]


def test_pressure_at_the_pitch_point_is_that_of_hertz(standard):
    """p0 = 888.848552 MPa, b = 71.62297 um under 100 N/mm (closed form, E = 206 GPa, nu = 0.3)."""
    gears, bodies = standard
    torque = LINE_LOAD * WIDTH * gears.sun.base_radius
    cycle = walk_mesh_cycle(
        gears, bodies, sun_torque=torque, positions=4, options=CycleOptions(cells=72, pressures=True)
    )
    (pair,) = np.flatnonzero(cycle.tooth_load[0, :, 0])
    assert cycle.path[0, pair, 0] == pytest.approx(0.0, abs=1e-12)
    assert cycle.tooth_load[0, pair, 0] == pytest.approx(LINE_LOAD * WIDTH, rel=1e-9)
    pressure, place = cycle.pressure[0, pair, :, 0], cycle.pressure_offset[0]
    p0, b = 888.848552e6, 71.62297e-6
    assert pressure.max() == pytest.approx(p0, rel=0.01)
    expected = p0 * np.sqrt(np.maximum(1 - (place / b) ** 2, 0.0))
    assert np.abs(pressure - expected)[np.abs(place) < 0.9 * b].max() < 0.02 * p0
    assert not pressure[np.abs(place) > 1.1 * b].any()
    assert cycle.pressure_centre[0, pair, 0] == pytest.approx(0.0, abs=1e-9)
    assert (pressure * place).sum() / pressure.sum() == pytest.approx(0.0, abs=0.02 * b)


@pytest.mark.parametrize("torque", [100.0, -100.0])
@pytest.mark.parametrize("both", [False, True])
def test_pressures_carry_the_tooth_loads(reference, torque, both):
    gears, bodies = reference
    cycle = walk_mesh_cycle(
        gears, bodies, sun_torque=torque, positions=8, options=CycleOptions(pressures=True, both_flanks=both)
    )
    carried = cycle.pressure.sum(axis=2) * areas(cycle, gears.sun.face_width)
    assert np.abs(carried - cycle.tooth_load).max() < 1e-12 * cycle.tooth_load.max()
    assert cycle.pressure.shape == (*cycle.tooth_load.shape[:2], 36, 8)
    assert cycle.pressure_offset.shape == (6, 36)
    inner = ~cycle.edge_contact
    assert cycle.pressure.max(axis=(1, 2))[inner] == pytest.approx(cycle.max_pressure[inner])
    assert (np.diff(cycle.pressure_offset, axis=1) > 0).all()


def test_pressures_are_kept_only_when_asked_for(reference):
    gears, bodies = reference
    plain = walk_mesh_cycle(gears, bodies, sun_torque=100.0, positions=2)
    assert plain.pressure is None and plain.pressure_offset is None and plain.pressure_centre is None
    empty = walk_mesh_cycle(gears, bodies, sun_torque=0.0, positions=2, options=CycleOptions(pressures=True))
    assert empty.pressure.shape == (6, 1, 36, 2) and not empty.pressure.any()


def test_windows_at_the_ends_of_flanks_say_where_they_are(reference):
    """Every window lies on the flank of the sun: centre and offset give its arc length there."""
    gears, bodies = reference
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=100.0, positions=16, options=CycleOptions(pressures=True))
    sun, alpha = gears.sun, gears.working_pressure_angle_sun_planet
    roll = sun.base_radius * np.tan(alpha) + cycle.path[:3]
    arc = roll**2 / (2 * sun.base_radius) + cycle.pressure_centre[:3]
    cells = arc[:, :, None] + cycle.pressure_offset[:3, None, :, None]
    tip = (sun.tip_radius**2 - sun.base_radius**2) / (2 * sun.base_radius)
    form = (sun.form_radius**2 - sun.base_radius**2) / (2 * sun.base_radius)
    loaded = cycle.pressure[:3] > 0
    assert cells[loaded].min() > form and cells[loaded].max() < tip
    # some windows end at the tip and are not centred
    assert np.abs(cycle.pressure_centre[:3][cycle.tooth_load[:3] > 0]).max() > 1e-6


def test_reversed_pressures_are_mirrored(reference):
    """-T with mirrored pin errors: pressures against the path coordinate run the other way."""
    gears, bodies = reference
    pins = np.array([[2e-6, 5e-6], [-1e-6, 0.0], [3e-6, -2e-6]])
    errors = replace(no_deviations(gears), pin_errors=pins)
    mirrored = replace(no_deviations(gears), pin_errors=pins[[0, 2, 1]] * np.array([1.0, -1.0]))
    options = {"positions": 4, "options": CycleOptions(pressures=True)}
    one = walk_mesh_cycle(gears, bodies, sun_torque=100.0, deviations=errors, **options)
    two = walk_mesh_cycle(gears, bodies, sun_torque=-100.0, deviations=mirrored, **options)
    pitch, largest = gears.sun.base_pitch, one.pressure.max()
    for mesh, other in enumerate([0, 2, 1, 3, 5, 4]):
        for p, q in enumerate(-np.arange(4) % 4):
            for slot in np.flatnonzero(one.tooth_load[mesh, :, p]):
                # the pair that stands at the opposite path coordinate
                apart = np.abs(two.path[other, :, q] + one.path[mesh, slot, p])
                image = int(apart.argmin())
                assert apart[image] < 1e-9 * pitch
                turned = two.pressure[other, image, ::-1, q]
                assert turned == pytest.approx(one.pressure[mesh, slot, :, p], rel=1e-6, abs=1e-6 * largest)
                centre = -two.pressure_centre[other, image, q]
                assert centre == pytest.approx(one.pressure_centre[mesh, slot, p], abs=1e-12)
    assert two.tooth_load.sum() == pytest.approx(one.tooth_load.sum(), rel=1e-9)
