"""Planetary sets that papers print: the helical set of Kahraman (1994) and the spur set of Lin and Parker."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.gears.phasing import MeshPhasing, standard_lag
from femgear.system.rigid_bodies import (
    CENTRAL,
    HelicalBody,
    HelicalSupport,
    PlanarBody,
    PlanarSet,
)
from femgear.trains.helical.model import HelicalSet

# N/um in N/m
MICRO = 1e6

# Z_s, Z_r, Z_p and class of sun, ring and planet; masses, stiffnesses and errors are those of Table 3 for all
TABLE_2 = {
    "A": (28, 68, 20, "I-I-even"),
    "B": (28, 68, 19, "I-I-odd"),
    "C": (30, 70, 20, "III-III-even"),
    "D": (30, 70, 19, "III-III-odd"),
    "E": (29, 71, 20, "II-IV-even"),
    "F": (29, 71, 21, "II-IV-odd"),
    "G": (31, 69, 20, "IV-II-even"),
    "H": (31, 69, 19, "IV-II-odd"),
}


def reduced_body(
    radius: float, *, mass: float, polar: float, diametral: float, support: HelicalSupport | None = None
) -> HelicalBody:
    """Body from data on ``u = r theta`` and ``w = r phi``, as Kahraman (1994, Table 3) prints them.

    Parameters
    ----------
    radius : float
        r [m]: base radius of a gear, radius of the circle of planet centres for the carrier.
    mass, polar, diametral : float
        m, J / r^2 and I / r^2 [kg].
    support : HelicalSupport, optional
        In SI, see `reduced_support`.
    """
    support = HelicalSupport() if support is None else support
    return HelicalBody(mass, polar * radius**2, diametral * radius**2, support)


def reduced_support(
    radius: float, *, radial: float = 0.0, axial: float = 0.0, tilt: float = 0.0, torsional: float = 0.0
) -> HelicalSupport:
    """Support from stiffnesses on translations, ``w = r phi`` and ``u = r theta``, all [N/m]."""
    return HelicalSupport(radial, axial, tilt * radius**2, torsional * radius**2)


def kahraman_set(**changes) -> HelicalSet:
    """Example set of Kahraman (1994, Table 3): 30/20/70 teeth, four planets, helix angle 20 deg.

    The radius of the planet circle is not printed; it enters as r_c / r_p alone. Axial and tilt stiffnesses
    are 10 000 N/um: with the printed 1000 N/um the frequencies miss Table 4 by up to 46 %, and the text has
    them nearly a hundred times the radial ones. The helix angle stands for that of the tooth normals.
    """
    alpha, stiff = math.radians(21.34), 1e4 * MICRO
    sun, planet, ring = 0.024, 0.016, 0.056
    distance = 0.040 / math.cos(alpha)

    def support(radius, radial, torsional=0.0):
        return reduced_support(radius, radial=radial * MICRO, axial=stiff, tilt=stiff, torsional=torsional)

    given = {
        "sun": reduced_body(sun, mass=0.460, polar=0.272, diametral=0.136, support=support(sun, 1e-4)),
        "ring": reduced_body(ring, mass=0.588, polar=0.759, diametral=0.389, support=support(ring, 1e4, stiff)),
        "carrier": reduced_body(distance, mass=3.0, polar=1.5, diametral=0.75, support=support(distance, 100.0)),
        "planet": reduced_body(planet, mass=0.177, polar=0.100, diametral=0.050),
        "sun_radius": sun,
        "ring_radius": ring,
        "planet_radius": planet,
        "centre_distance": distance,
        "planet_angles": 0.5 * np.pi * np.arange(4),
        "pressure_angle_sun_planet": alpha,
        "pressure_angle_planet_ring": alpha,
        "base_helix_angle": math.radians(20.0),
        "stiffness_sun_planet": 200.0 * MICRO,
        "stiffness_planet_ring": 200.0 * MICRO,
        # the springs of the pins act on w_c - (r_c / r_p) w_p
        "planet_bearing": support(distance, 100.0),
        "contact_points": "base_circles",
    }
    return HelicalSet(**given | changes)


def cases(*, convention: str = "rotation") -> dict[str, MeshPhasing]:
    """Phasings A to H of Table 2, four equally spaced planets.

    The two meshes of a planet are (Z_p + 1) / 2 pitches apart: in step in harmonic l or against one another
    by the parity of Z_p and of l, which is `standard_lag`.
    """
    return {
        letter: MeshPhasing(
            sun,
            ring,
            tuple((sun + ring) // 4 * n for n in range(4)),
            convention=convention,
            lag=standard_lag(planet),
        )
        for letter, (sun, ring, planet, _) in TABLE_2.items()
    }


def torsional_set(data: PlanarSet) -> PlanarSet:
    """The same set with all axes held: N + 3 rotations (A. Kahraman, J. Sound Vib. 173, 1994, 125-130).

    The planets' axes are then fixed to the carrier, whose rotation carries their mass.
    """
    held = {name: replace(getattr(data, name), support=math.inf) for name in CENTRAL}
    return replace(data, planet_bearing=math.inf, **held)


def lin_parker_set(planets: int = 3, *, planet_bearing: float = 1e8, sun_support: float = 1e8) -> PlanarSet:
    """Example set of Lin and Parker (1999, Table 1), equally spaced.

    Inertias are given as I / r^2 and the torsional support of the ring as k_u, so that the radii do not
    enter its modes. The printed base diameters of sun, planet and ring do not close; 77.42 mm and 100.35 mm
    of sun and planet are kept, and ring and centre distance follow from them.
    """
    alpha = math.radians(24.6)
    sun, planet = 0.5 * 0.07742, 0.5 * 0.10035
    ring, distance = sun + 2.0 * planet, (sun + planet) / math.cos(alpha)

    def body(mass, reduced, radius, **supports):
        return PlanarBody(mass, reduced * radius**2, **supports)

    # k_u acts on u = r theta
    return PlanarSet(
        sun=body(0.4, 0.39, sun, support=sun_support),
        ring=body(2.35, 3.00, ring, support=1e8, torsional_support=1e9 * ring**2),
        carrier=body(5.43, 6.29, distance, support=1e8),
        planet=body(0.66, 0.61, planet),
        sun_radius=sun,
        ring_radius=ring,
        planet_radius=planet,
        centre_distance=distance,
        planet_angles=2.0 * np.pi * np.arange(planets) / planets,
        pressure_angle_sun_planet=alpha,
        pressure_angle_planet_ring=alpha,
        stiffness_sun_planet=5e8,
        stiffness_planet_ring=5e8,
        planet_bearing=planet_bearing,
    )
