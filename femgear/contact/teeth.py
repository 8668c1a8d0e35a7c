"""Which teeth a pair consists of, and where tooth number zero of every gear stands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet


def tooth_numbers(planetary_set: PlanetarySet, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tooth numbers on gear 1 and gear 2 of the pairs `index` (2N, pairs), counted in each body's frame.

    A pair of mesh j with index i touches at the pitch point when the position is ``-(phase_j + i)``; the
    tooth is then at the planet's angle, less its half thickness, which fixes its place on the body.
    """
    from femgear.gears import half_thickness_angle

    s, N = planetary_set, planetary_set.n_planets
    psi = np.asarray(s.planet_angles) - s.planet_angles[0]
    turns = np.asarray(s.mesh_phases)[:, None] + index
    sun = psi[:, None] / s.sun.pitch_angle + turns[:N] - s.mesh_phases[0]
    ring = psi[:, None] / s.ring.pitch_angle - (turns[N:] - s.mesh_phases[N])
    radius_s = s.planet.base_radius / np.cos(s.working_pressure_angle_sun_planet)
    radius_r = s.planet.base_radius / np.cos(s.working_pressure_angle_planet_ring)
    thickness = half_thickness_angle(s.planet, radius_s) + half_thickness_angle(s.planet, radius_r)
    first = np.asarray(s.mesh_phases)[:N, None]
    planet_sun = -(turns[:N] - first)
    planet_ring = (thickness - np.pi) / s.planet.pitch_angle - (turns[N:] - first)
    exact = np.concatenate([sun, planet_ring]), np.concatenate([planet_sun, ring])
    rounded = tuple(np.rint(e).astype(int) for e in exact)
    if max(np.abs(e - r).max() for e, r in zip(exact, rounded)) > 1e-3:
        raise ContactError(
            "the phases of the meshes and the positions of the teeth contradict one another",
            code="E-CONTACT-PHASE",
            remedy="planet angles must be whole multiples of 360/(z_sun + z_ring) degrees from one another",
        )
    return rounded


def tooth_zero_angles(planetary_set: PlanetarySet, position: float = 0.0):
    """Angles of the centre of tooth number 0 of every gear, as `tooth_numbers` counts them [rad].

    Parameters
    ----------
    planetary_set : PlanetarySet
    position : float
        Fraction of one mesh period.

    Returns
    -------
    sun : float
    planets : (N,) array
        In the frame of the set, about each planet's own centre.
    ring : float
    """
    from femgear.gears import half_thickness_angle

    s = planetary_set
    N, psi = s.n_planets, np.asarray(s.planet_angles)
    turned = position + np.asarray(s.mesh_phases)

    def half_angle(gear, pressure_angle):
        return float(half_thickness_angle(gear, gear.base_radius / np.cos(pressure_angle)))

    sun_angle, ring_angle = s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring
    sun = psi[0] - half_angle(s.sun, sun_angle) + turned[0] * s.sun.pitch_angle
    planets = psi + np.pi - half_angle(s.planet, sun_angle) - turned[:N] * s.planet.pitch_angle
    ring = psi[0] - half_angle(s.ring, ring_angle) - turned[N] * s.ring.pitch_angle
    return float(sun), planets, float(ring)
