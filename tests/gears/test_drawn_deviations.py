"""Signs and sizes of separations from exact flanks, drawn where displaced and turned bodies stand."""

from dataclasses import replace

import numpy as np
import pytest
from deviation_sets import PLAY, SET, UM
from scipy.optimize import brentq

from femgear.gears.deviations import (
    Runout,
    body_separation,
    no_deviations,
    tooth_displacements,
    tooth_separation,
)
from femgear.gears.gear import flank_points
from femgear.gears.kinematics import orientations


def curve(gear, angle, centre, side):
    """Points x + iy of one flank (1 left, -1 right) of the tooth whose centre stands at an angle."""
    points = flank_points(gear, np.linspace(gear.form_roll, gear.tip_roll, 4001))
    return centre + (points[:, 0] + 1j * side * points[:, 1]) * np.exp(1j * angle)


def smallest_arc(tooth, mate, side, psi):
    """Smallest signed arc from a flank of sun or ring to points of a planet's flank, about their centre."""
    turn = np.exp(-1j * psi)
    radius, angle = np.abs(mate), np.angle(mate * turn)
    order = np.argsort(radius)
    r = np.abs(tooth)
    inside = (r >= radius.min()) & (r <= radius.max())
    if not inside.any():
        return np.inf
    arc = side * r * (np.angle(tooth * turn) - np.interp(r, radius[order], angle[order]))
    smallest = arc[inside].min()
    return smallest if abs(smallest) < 1e-3 else np.inf  # another tooth space


def drawn_separation(s, mesh, position, moved_1=0.0, moved_2=0.0, *, back=False, turned=(0.0, 0.0)):
    """Arc on its base circle by which a planet must be turned until the flanks touch [m].

    The gears stand displaced by `moved_1`, `moved_2` (x + iy) and turned by small angles.
    """
    n, at_sun, psi = mesh % s.n_planets, mesh < s.n_planets, s.planet_angles[mesh % s.n_planets]
    state = orientations(s, position)
    other, angle = (s.sun, state.sun) if at_sun else (s.ring, state.ring)
    planet, facing = state.planets[n], psi + np.pi if at_sun else psi
    centre_o, centre_p = (moved_1, moved_2) if at_sun else (moved_2, moved_1)
    turned_o, turned_p = turned if at_sun else turned[::-1]
    side = -1.0 if back else 1.0
    side_p = side if at_sun else -side
    first = round((psi - angle) / other.pitch_angle), round((facing - planet) / s.planet.pitch_angle)
    centre_p = s.centre_distance * np.exp(1j * psi) + centre_p
    mates = [curve(other, angle + turned_o + (first[0] + i) * other.pitch_angle, 0.0, side) for i in (-1, 0, 1)]

    def gap(turn):
        teeth = [
            curve(
                s.planet,
                planet + turned_p + turn + (first[1] + i) * s.planet.pitch_angle,
                centre_p - centre_o,
                side_p,
            )
            for i in (-1, 0, 1)
        ]
        return min(smallest_arc(tooth, mate, side, psi) for tooth in teeth for mate in mates)

    # a left flank of the planet nears its mate when it turns counter-clockwise, a right flank clockwise
    reach = 150e-6 / s.planet.base_radius
    return side_p * brentq(gap, -reach, reach, xtol=1e-13) * s.planet.base_radius


def turning(runout, tooth_zero):
    return runout.amplitude * np.exp(1j * (tooth_zero + runout.phase))


@pytest.mark.parametrize("mesh", range(6))
def test_ideal_gears_touch(mesh):
    assert drawn_separation(SET, mesh, 0.3) == pytest.approx(0.0, abs=2e-9)
    play = PLAY.backlash_sun_planet if mesh < 3 else PLAY.backlash_planet_ring
    assert drawn_separation(PLAY, mesh, 0.3, back=True) == pytest.approx(play, abs=2e-9)


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("mesh", range(6))
def test_displaced_bodies_against_drawn_ones(mesh, back):
    s, position, n, N = PLAY, 3.4, mesh % 3, 3
    d = replace(
        no_deviations(s),
        sun_runout=Runout(4 * UM, 0.7),
        planet_runout=(Runout(3 * UM, 0.2), Runout(5 * UM, -2.0), Runout(4 * UM, 2.2)),
        ring_runout=Runout(6 * UM, 1.1),
        carrier_runout=Runout(3 * UM, 2.5),
        pin_errors=np.array([[5.0, -3.0], [-4.0, 6.0], [2.0, 7.0]]) * UM,
    )
    state, psi = orientations(s, position), s.planet_angles[n]
    pin = complex(*d.pin_errors[n]) * np.exp(1j * psi) + turning(d.carrier_runout, 0.0)
    planet = pin + turning(d.planet_runout[n], state.planets[n])
    if mesh < N:
        moved = turning(d.sun_runout, state.sun), planet
    else:
        moved = planet, turning(d.ring_runout, state.ring)
    drawn = drawn_separation(s, mesh, position, *moved, back=back)
    play = (s.backlash_sun_planet if mesh < N else s.backlash_planet_ring) if back else 0.0
    got = body_separation(d, s, [position], back=back)[mesh, 0]
    assert abs(got) > 1e-7
    # of second order: displacement squared over the centre distance
    assert got + play == pytest.approx(drawn, abs=6e-9)


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("mesh", [0, 2, 4])
def test_displaced_teeth_against_drawn_ones(mesh, back):
    s, n = PLAY, mesh % 3
    along = 8 * UM, -5 * UM  # counter-clockwise on the reference circles
    one, two = (s.sun, s.planet) if mesh < 3 else (s.planet, s.ring)
    displaced = [
        np.full(g.teeth, tooth_displacements(g, cumulative=np.full(g.teeth, a))[0]) for g, a in zip((one, two), along)
    ]
    d, planets = no_deviations(s), np.zeros((3, s.planet.teeth))
    if mesh < 3:
        planets[n] = displaced[1]
        d = replace(d, sun_pitch=-displaced[0])
    else:
        planets[n] = displaced[0]
        d = replace(d, ring_pitch=-displaced[1])
    d = replace(d, planet_pitch=-planets, planet_ring_side_pitch=planets)
    turned = tuple(a / g.reference_radius for a, g in zip(along, (one, two)))
    drawn = drawn_separation(s, mesh, 0.35, back=back, turned=turned)
    play = (s.backlash_sun_planet if mesh < 3 else s.backlash_planet_ring) if back else 0.0
    got = tooth_separation(d, mesh, np.array([5]), np.array([-3]), back=back)
    assert got + play == pytest.approx(drawn, abs=2e-9)
