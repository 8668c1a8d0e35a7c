"""What a helical case means for the helical set: bodies, supports, radii, helix, torque."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femgear.case import Case
from femgear.casefile.planar import output_member

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet
    from femgear.models.helical import HelicalSet, PlanarTorque


def helical_data(case: Case, gears: PlanetarySet, mesh_stiffness=None) -> HelicalSet:
    """Helical set of a case: bodies and supports of its entries, radii and angles of its gears.

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
        Of the transverse section.
    mesh_stiffness : (2N,) array, optional
        Mean stiffnesses along the tooth normals [N/m] where the case gives none.
    """
    from femgear.models.helical import HelicalBody, HelicalSupport, helical_from_set

    helical, N = case.helical, gears.n_planets
    polar = {"sun": case.sun, "ring": helical.ring, "carrier": case.carrier}
    bodies = {}
    for name, one in polar.items():
        space = getattr(helical, name)
        held = np.inf if name == case.operation.fixed else 0.0
        torsional = held if space.torsional_stiffness is None else space.torsional_stiffness
        support = HelicalSupport(
            one.support_stiffness, space.axial_stiffness, space.tilt_stiffness, torsional
        )
        bodies[name] = HelicalBody(one.mass, one.inertia, space.diametral_inertia, support)
    pin, given = helical.planet, helical.mesh_stiffness
    return helical_from_set(
        gears,
        helix_angle=helical.signed_helix_angle,
        **bodies,
        planet=HelicalBody(case.planet.mass, case.planet.inertia, pin.diametral_inertia),
        stiffness_sun_planet=mesh_stiffness[:N] if given is None else given.sun_planet,
        stiffness_planet_ring=mesh_stiffness[N:] if given is None else given.planet_ring,
        planet_bearing=HelicalSupport(
            case.planet.bearing_stiffness,
            pin.axial_stiffness,
            pin.tilt_stiffness,
            pin.torsional_stiffness or 0.0,
        ),
        contact_points=helical.contact_points,
        slices=helical.slices,
        face_width=case.set.face_width,
    )


def base_helix_angle(case: Case, gears: PlanetarySet) -> float:
    """beta_b [rad] without sign: ``tan beta_b = tan beta cos alpha_t`` (ISO 21771, section 4.2.6)."""
    return math.atan(math.tan(case.helical.helix_angle) * math.cos(gears.sun.pressure_angle))


def overlap_ratio(case: Case, gears: PlanetarySet) -> float:
    """eps_beta of both meshes."""
    from femgear.models.helical_data import contact_ratios

    found = contact_ratios(gears, helix_angle=case.helical.helix_angle, face_width=case.set.face_width)
    return float(found[0, 1])


def rotation_sense(case: Case, gears: PlanetarySet) -> int:
    """1 where the sun turns counter-clockwise against the carrier, else -1."""
    from femgear.gears import speeds

    found = speeds(gears, input=case.operation.input, fixed=case.operation.fixed, speed=1.0)
    return 1 if found.sun > found.carrier else -1


def torque_of(case: Case) -> PlanarTorque:
    """The driving torque, which the member that is neither driven nor held takes up."""
    from femgear.models.helical import PlanarTorque

    return PlanarTorque(case.operation.torque, case.operation.input, output_member(case))
