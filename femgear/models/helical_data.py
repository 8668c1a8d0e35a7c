"""Data of the helical planetary set: bodies with six motions, supports, radii, helix, contact points."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears import involute
from femgear.models.helical_checks import check_body, check_set, check_support, numbers
from femgear.models.planar_data import CENTRAL, RigidSet, gear_geometry, member_radius

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet


@dataclass(frozen=True, eq=False)
class HelicalSupport:
    """Isotropic support of a body in all six directions; infinite holds a motion, zero leaves it free.

    Parameters
    ----------
    radial, axial : float
        [N/m]
    tilt, torsional : float
        Against rotation about the two axes in the plane, and about the axis of the body [N m/rad].

    Notes
    -----
    As `HelicalSet.planet_bearing` the values may be (N,) arrays, one a planet.

    Raises
    ------
    CaseError
        Stiffnesses that are no numbers, negative or NaN (E-HELICAL).
    """

    radial: float | np.ndarray = 0.0
    axial: float | np.ndarray = 0.0
    tilt: float | np.ndarray = 0.0
    torsional: float | np.ndarray = 0.0

    def __post_init__(self):
        check_support("support", self)

    @property
    def stiffness(self) -> np.ndarray:
        """Of the six directions, (6,) or (N, 6): two radial, axial, two tilts, torsional."""
        r, z, w, u = np.broadcast_arrays(self.radial, self.axial, self.tilt, self.torsional)
        return np.stack([r, r, z, w, w, u], axis=-1).astype(float)


@dataclass(frozen=True)
class HelicalBody:
    """A rigid body.

    Parameters
    ----------
    mass : float
        [kg]
    inertia : float
        Polar inertia about its axis [kg m^2].
    diametral_inertia : float
        About the axes in the plane through its centre [kg m^2].
    support : HelicalSupport
        To the housing.

    Raises
    ------
    CaseError
        Mass or inertias that are not finite and above 0 (E-HELICAL).
    """

    mass: float
    inertia: float
    diametral_inertia: float
    support: HelicalSupport = field(default_factory=HelicalSupport)

    def __post_init__(self):
        check_body("body", self)


@dataclass(frozen=True, kw_only=True, eq=False)
class HelicalSet(RigidSet):
    """Data of the helical set; the centres of all bodies lie in one plane.

    Bodies, radii, angles and mesh stiffnesses as in `RigidSet`; a stiffness of zero leaves a mesh out.

    Parameters
    ----------
    base_helix_angle : float
        Angle of the tooth normals to the transverse section [rad], beta_b with ``sin beta_b = sin beta cos
        alpha_n``; positive for a right-handed sun, whose planets and ring are then left-handed.
    planet_bearing : HelicalSupport
        Between planet and carrier, of numbers or (N,) arrays; infinite ties the planet to its pin.
    contact_points : {"pitch_point", "base_circles"}
        Where the mesh force acts in the transverse section. ``pitch_point``: on both gears at the pitch
        point. ``base_circles``: on each gear where the line of action touches its own base circle, as in
        A. Kahraman, J. Mech. Des. 116, 1994, 713-720 (Eqs. 7a, 7b: arms of base radii); the two points
        differ, so that a common tilt of both gears strains the mesh.
    slices : int
        Number S of equal slices of the face width, each of them one column of ``W`` with ``1/S`` of the
        stiffness, at mid-height of the slice.
    face_width : float
        [m], needed for more than one slice.

    Raises
    ------
    CaseError
        Numbers that no set can have, planet angles that are none, unordered or span more than a turn, or
        radii, centre distance and pressure angles that miss each other by more than 10 % (E-HELICAL).
        `closure` tells by how much they do.
    """

    base_helix_angle: float
    planet_bearing: HelicalSupport
    contact_points: str = "pitch_point"
    slices: int = 1
    face_width: float = 0.0

    def __post_init__(self):
        angles = np.atleast_1d(numbers("planet_angles", self.planet_angles))
        arrays = {"planet_angles": angles}
        for name in ("stiffness_sun_planet", "stiffness_planet_ring"):
            value = numbers(name, getattr(self, name))
            arrays[name] = np.full(len(angles), value) if value.ndim == 0 else value
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        for name in (*CENTRAL, "planet"):
            check_body(name, getattr(self, name))
        check_set(self)

    @property
    def column_stiffness(self) -> np.ndarray:
        """Mean stiffness of the 2N S columns of ``W`` [N/m], the slices of a mesh side by side."""
        return self.per_column(self.mesh_stiffness) / self.slices

    @property
    def slice_heights(self) -> np.ndarray:
        """Height (S,) of the slices above mid-face [m]."""
        return self.face_width * ((np.arange(self.slices) + 0.5) / self.slices - 0.5)

    @property
    def pin_stiffness(self) -> np.ndarray:
        """Of the planet bearings, (N, 6): radial, tangential, axial [N/m], two tilts, torsional [N m/rad]."""
        return np.broadcast_to(self.planet_bearing.stiffness, (self.n_planets, 6))

    def per_column(self, values) -> np.ndarray:
        """Values (2N, ...) of the meshes repeated for their slices, (2N S, ...)."""
        return np.repeat(np.asarray(values), self.slices, axis=0)


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


def helical_from_set(
    planetary_set: PlanetarySet,
    *,
    helix_angle: float,
    sun: HelicalBody,
    ring: HelicalBody,
    carrier: HelicalBody,
    planet: HelicalBody,
    stiffness_sun_planet,
    stiffness_planet_ring,
    planet_bearing: HelicalSupport,
    contact_points: str = "pitch_point",
    slices: int = 1,
    face_width: float = 0.0,
) -> HelicalSet:
    """Helical set with the radii and angles of a geared one.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Its gears in the transverse section: transverse module and pressure angle.
    helix_angle : float
        beta at the reference circle [rad], positive for a right-handed sun; ``tan beta_b = tan beta cos
        alpha_t`` (ISO 21771, section 4.2.6).
    sun, ring, carrier, planet, stiffness_sun_planet, stiffness_planet_ring, planet_bearing
        See `HelicalSet`.
    contact_points, slices, face_width
        See `HelicalSet`.
    """
    return HelicalSet(
        sun=sun,
        ring=ring,
        carrier=carrier,
        planet=planet,
        base_helix_angle=math.atan(math.tan(helix_angle) * math.cos(planetary_set.sun.pressure_angle)),
        stiffness_sun_planet=stiffness_sun_planet,
        stiffness_planet_ring=stiffness_planet_ring,
        planet_bearing=planet_bearing,
        contact_points=contact_points,
        slices=slices,
        face_width=face_width,
        **gear_geometry(planetary_set),
    )


def contact_ratios(planetary_set: PlanetarySet, *, helix_angle: float, face_width: float) -> np.ndarray:
    """Transverse and overlap contact ratio (2, 2) of the sun-planet and the planet-ring mesh.

    ``eps_gamma = eps_alpha + eps_beta``, ``eps_beta = b sin|beta| / (pi m_n)`` (ISO 21771, sections 5.4.2.3
    and 5.4.4); a row is one mesh.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Its gears in the transverse section.
    helix_angle : float
        [rad]
    face_width : float
        That both gears of a mesh have in common [m].
    """
    s = planetary_set
    normal_module = s.sun.module * math.cos(helix_angle)
    overlap = involute.overlap_ratio(face_width, normal_module, helix_angle)
    return np.array([[s.contact_ratio_sun_planet, overlap], [s.contact_ratio_planet_ring, overlap]])


def body_masses(data: HelicalSet) -> np.ndarray:
    """Generalised masses (N + 3, 6) [kg]: m three times, I / r^2 twice, J / r^2."""
    bodies = [(getattr(data, name), member_radius(data, name)) for name in CENTRAL]
    bodies += [(data.planet, data.planet_radius)] * data.n_planets
    return np.array([[b.mass] * 3 + [b.diametral_inertia / r**2] * 2 + [b.inertia / r**2] for b, r in bodies])
