"""Outlines of all teeth of a set where `orientations` places its bodies: they mesh and do not cross."""

import numpy as np
import pytest
from matplotlib.path import Path as Polygon

from femgear.gears.gear import half_thickness_angle
from femgear.gears.kinematics import orientations
from femgear.gears.tooth import half_sector
from validation.planetary import reference_set


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def gear_outline(gear):
    """Draw the exact outline (n,) of all teeth, complex [m], the first centred on angle 0.

    Counter-clockwise: involutes with their generated fillets, tip and root circles.
    """
    half = half_sector(gear, flank_elements=10, refine=0.4)
    parts = [half.curve(name) for name, _ in half.curves if name in ("tip", "flank", "fillet", "root")]
    # curves of a sector run round it: those of an internal gear come towards its tooth
    points = np.concatenate(parts)[:: -1 if gear.internal else 1]
    points = points[:, 0] + 1j * points[:, 1]
    points = points[np.append(True, np.abs(np.diff(points)) > 1e-9 * gear.module)]
    # without the middles of tooth and gap, which belong to both halves
    tooth = np.concatenate([points[:0:-1].conj(), points[:-1]])
    return np.concatenate([tooth * np.exp(2j * np.pi * k / gear.teeth) for k in range(gear.teeth)])


def ring_outline(planetary_set):
    """Outline of the teeth of the ring, complex."""
    return gear_outline(planetary_set.ring) * np.exp(1j * orientations(planetary_set).ring)


def places(planetary_set, carrier_angle):
    """Find centre and rotation of the sun and of every planet when the carrier has turned, ring held."""
    s = planetary_set
    # against the carrier the ring turns back by a tooth in every mesh period
    at = orientations(s, s.ring.teeth * carrier_angle / (2.0 * np.pi))
    centres = s.centre_distance * np.exp(1j * (np.asarray(s.planet_angles, float) + carrier_angle))
    turns = (carrier_angle + angle for angle in at.planets)
    return [(0j, at.sun + carrier_angle), *zip(centres, turns)]


def test_teeth_are_the_exact_ones(gears):
    """Tip and root circles, and between them involute flanks of the right thickness."""
    for gear in (gears.sun, gears.planet, gears.ring):
        outline = gear_outline(gear)
        radius, angle = np.abs(outline), np.angle(outline)
        ends = sorted((gear.tip_radius, gear.root_radius))
        assert [radius.min(), radius.max()] == pytest.approx(ends, rel=1e-9)
        # half the tooth's angle at every radius of the involute, on the first tooth
        first = np.abs(angle) < np.pi / gear.teeth * (1.0 - 1e-9)
        low, high = sorted((gear.tip_radius, gear.form_radius))
        flank = first & (radius > low * (1 + 1e-9)) & (radius < high * (1 - 1e-9))
        assert np.count_nonzero(flank) >= 8
        half = half_thickness_angle(gear, radius[flank])
        assert np.abs(angle[flank]) == pytest.approx(np.abs(half), abs=1e-9)
        assert np.all(np.diff(np.unwrap(angle)) > -1e-3 * np.pi / gear.teeth)


@pytest.mark.parametrize("carrier", [0.0, 0.123, 2.9])
def test_teeth_mesh_and_do_not_cross(gears, carrier):
    (sun, sun_turn), *planets = places(gears, carrier)
    ring = ring_outline(gears)

    def inside(points, polygon):
        return Polygon(np.column_stack([polygon.real, polygon.imag])).contains_points(
            np.column_stack([points.real, points.imag]), radius=0.0
        )

    sun = sun + gear_outline(gears.sun) * np.exp(1j * sun_turn)
    assert len(planets) == 3
    for n, (centre, turn) in enumerate(planets):
        at = gears.planet_angles[n] + carrier
        assert centre == pytest.approx(gears.centre_distance * np.exp(1j * at), rel=1e-12)
        planet = centre + gear_outline(gears.planet) * np.exp(1j * turn)
        # smaller by 10 um, less than a hundredth of a module: chords between points cut into round flanks
        shrunk = centre + (planet - centre) * (1.0 - 10e-6 / gears.planet.tip_radius)
        smaller = sun * (1.0 - 10e-6 / gears.sun.tip_radius)
        assert not inside(smaller, shrunk).any() and not inside(shrunk, smaller).any()
        assert inside(shrunk, ring * (1.0 + 10e-6 / gears.ring.tip_radius)).all()
        # teeth reach into each other's gaps
        assert np.abs(planet).min() < gears.sun.tip_radius and np.abs(planet).max() > gears.ring.tip_radius
