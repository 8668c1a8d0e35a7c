"""Helical planetary set of rigid bodies that move in space: data, matrices, meshes, modes, forced response.

Carrier, ring, sun and N planets have three translations and three rotations each, 6 (N + 3) coordinates.
A. Kahraman, Planetary Gear Train Dynamics, J. Mech. Des. 116, 1994, 713-720: rigid bodies, gear meshes as
springs along the tooth normals, supports and planet pins in all directions, without terms of the carrier's
speed. Here all matrices follow from kinematics: every spring is a column of deflections ``w^T q`` and adds
``k w w^T``; the meshes stay columns of W. As elements, `helical_problem`, they have a stiffness that changes,
play and contact loss.

Coordinates: x, y and z of the central members, planets radially outwards, tangentially and along z; tilts
``w = r phi`` about the same two axes in the plane and ``u = r theta`` about z, all right-handed. r is the
base radius of the gears and the radius of the circle of planet centres for the carrier.

The mesh stiffness follows from that of spur teeth. A helical gear is cut across its axis into thin slices,
each of them a spur gear that is turned by the helix against its neighbour, and the slices carry side by side
without any coupling between them (thin-slice approximation, J. D. Smith, Gear Noise and Vibration, 2nd ed.,
2003). It leaves out that loaded slices draw unloaded neighbours along, and that teeth are softer at their
ends. Each slice has the stiffness of the spur gear of its normal section, per length of the contact line.

The forced response to transmission errors is a modal summation, which also gives the loads of meshes, pins
and bearings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.gears import involute
from femgear.solvers.linear.modal import residual_output, solve_modes, viscous_damping
from femgear.system.assembler import mesh_elements
from femgear.system.elements import GearMeshes
from femgear.system.fourier import FourierSeries, StepSeries
from femgear.system.mode_kinds import SetMotions, body_motions, energy_shares, named_kinds, phase_basis
from femgear.system.rigid_bodies import (
    CENTRAL,
    HelicalBody,
    HelicalSupport,
    PlanarTorque,
    RigidSet,
    check_angles,
    check_helical_body,
    check_support,
    flank_sign,
    gear_geometry,
    member_radius,
    numbers,
    refuse_helical,
    torque_load,
)
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes, NonlinearSystem

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

CONTACT_POINTS = ("pitch_point", "base_circles")
# Rounded numbers miss each other by less than 1 %, other distances or angles than those of the gears by more.
LARGEST_CLOSURE = 0.1

CENTRAL_AXES = ("x", "y", "z", "tilt x", "tilt y", "u")
PLANET_AXES = ("radial", "tangential", "z", "tilt radial", "tilt tangential", "u")

KINDS = {"rotational": "rotational-axial", "translational": "translational-tilting", "planet": "planet"}
SPRINGS = ("radial", "axial", "tilt", "torsional")
# Relative distance of frequencies that rounding alone makes.
_ONE_FREQUENCY = 1e-9

# Distance to an undamped pole, relative to it, below which the response is infinite.
_RESONANT = 1e-12


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
            check_helical_body(name, getattr(self, name))
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


def check_set(data: HelicalSet) -> None:
    """Refuse radii, angles, stiffnesses, slices and contact points (E-HELICAL)."""
    for name in ("sun_radius", "ring_radius", "planet_radius", "centre_distance"):
        value = numbers(name, getattr(data, name), 0)
        if not (math.isfinite(value) and value > 0.0):
            refuse_helical(name, value, "m", "finite and above 0")
    if data.ring_radius <= data.planet_radius:
        refuse_helical(
            "ring_radius", data.ring_radius, "m", f"above the {data.planet_radius} m of the planets"
        )
    for name in ("pressure_angle_sun_planet", "pressure_angle_planet_ring"):
        value = numbers(name, getattr(data, name), 0)
        if not 0.0 < value < 0.5 * math.pi:
            refuse_helical(name, value, "rad", "between 0 and pi/2", remedy="give radians")
    if not abs(numbers("base_helix_angle", data.base_helix_angle, 0)) < 0.5 * math.pi:
        allowed = "between -pi/2 and pi/2"
        refuse_helical("base_helix_angle", data.base_helix_angle, "rad", allowed, remedy="give radians")
    for name in ("stiffness_sun_planet", "stiffness_planet_ring"):
        values = getattr(data, name)
        if values.shape != (data.n_planets,):
            refuse_helical(name, f"{values.size} values", "", f"one number, or {data.n_planets}")
        wrong = ~np.isfinite(values) | (values < 0.0)
        if np.any(wrong):
            refuse_helical(name, values[wrong][0], "N/m", "finite, 0 or more")
    check_support("planet_bearing", data.planet_bearing, count=data.n_planets)
    check_angles(data.planet_angles, code="E-HELICAL")
    _check_contact(data)
    _check_closure(data)


def _check_contact(data: HelicalSet) -> None:
    if data.contact_points not in CONTACT_POINTS:
        refuse_helical("contact_points", repr(data.contact_points), "", " or ".join(CONTACT_POINTS))
    if isinstance(data.slices, bool) or int(data.slices) != data.slices or data.slices < 1:
        refuse_helical("slices", data.slices, "", "a whole number of 1 or more")
    if not (math.isfinite(data.face_width) and data.face_width >= 0.0):
        refuse_helical("face_width", data.face_width, "m", "finite, 0 or more")
    if data.slices > 1 and not data.face_width:
        refuse_helical("face_width", data.face_width, "m", "above 0 for several slices")


def _check_closure(data: HelicalSet) -> None:
    worst = max(data.closure, key=abs)
    if abs(worst) > LARGEST_CLOSURE:
        refuse_helical(
            "centre_distance", data.centre_distance, "m",
            f"(r_s + r_p) / cos alpha_sp and (r_r - r_p) / cos alpha_pr, within {LARGEST_CLOSURE:.0%}",
            remedy=f"radii, centre distance and pressure angles miss each other by {abs(worst):.3g}",
        )  # fmt: skip


def helical_dofs(n_planets: int) -> tuple[str, ...]:
    """Names of all 6 (N + 3) coordinates."""
    central = [f"{body}: {axis}" for body in CENTRAL for axis in CENTRAL_AXES]
    return (*central, *(f"planet {n + 1}: {axis}" for n in range(n_planets) for axis in PLANET_AXES))


def helical_system(data: HelicalSet, *, torque: PlanarTorque | None = None) -> MechanicalSystem:
    """Matrices of the set at standstill; the meshes are columns of ``W`` and not in ``K``.

    Parameters
    ----------
    data : HelicalSet
        Coordinates with an infinite stiffness are left out.
    torque : PlanarTorque, optional
        Its sign chooses the flanks of the mesh columns; without it those of a sun that drives
        counter-clockwise. Mesh deflections are positive in compression.

    Returns
    -------
    MechanicalSystem
        ``C`` is zero. Columns of ``W``: the slices of mesh 1, of mesh 2 and so on.

    Raises
    ------
    CaseError
        A torque on a held member, or a set that cannot move at all (E-MECHANISM).
    """
    T, kept = free_motions(data), _kept(data)
    if not T.shape[1]:
        raise CaseError(
            "infinite stiffnesses hold every motion of the set", code="E-MECHANISM",
            remedy="give the support or the bearing of a body finite stiffnesses",
        )  # fmt: skip
    names = np.array(helical_dofs(data.n_planets))[kept]
    return MechanicalSystem(
        M=(T.T * body_masses(data).ravel()) @ T,
        C=np.zeros((T.shape[1], T.shape[1])),
        K=T.T @ _linear_stiffness(data) @ T,
        W=T.T @ mesh_directions(data, flank_sign(data, torque)),
        load=T.T @ torque_load(data, torque, kept),
        dofs=tuple(str(name) for name in names),
    )


def mesh_directions(data: HelicalSet, flank: int = 1) -> np.ndarray:
    """Mesh columns (6 (N + 3), 2N S): approach of the flanks along their common normal.

    A rigid body whose centre moves by v and which rotates by phi moves its point c by ``v + phi x c``, so
    that the flanks of gears 1 and 2 approach by ``n . (v_1 + phi_1 x c_1) - n . (v_2 + phi_2 x c_2)`` with
    the normal n into gear 2. Seen from the planet's centre n is ``(sin alpha cos beta_b, +- cos alpha cos
    beta_b, - sin beta_b)`` radially, tangentially and axially for the flanks of a sun that drives
    counter-clockwise (`flank` = 1). The rotation about the own axis gives ``+- u cos beta_b``. With
    ``contact_points = "base_circles"`` a sun and one planet have the mesh deflection of the helical pair of
    M. Kubur et al., J. Mech. Des. 126, 2004, 398-406.

    Parameters
    ----------
    data : HelicalSet
    flank : {1, -1}
    """
    N, S = data.n_planets, data.slices
    W = np.zeros((data.n_planets + 3, 6, 2 * N, S))
    n = np.arange(N)
    for mesh, gear in enumerate(("sun", "ring")):
        central, planet = _local_columns(data, gear, flank)
        W[CENTRAL.index(gear), :, mesh * N + n] = _turned(data, central)
        W[3 + n, :, mesh * N + n] = planet
    return W.reshape(6 * (N + 3), 2 * N * S)


def pin_directions(data: HelicalSet) -> np.ndarray:
    """Bearing columns (6 (N + 3), N, 6): motion of each planet less that of its pin.

    Radial, tangential and axial [m], tilt about the radial and the tangential axis and rotation [rad].
    A carrier that tilts by phi moves the pin along z by ``phi x a e_n``.
    """
    N, n = data.n_planets, np.arange(data.n_planets)
    own = np.diag([1.0] * 3 + [1.0 / data.planet_radius] * 3)
    # motion of the pin (6,) per local coordinate of the carrier (6,)
    pin = np.diag([1.0] * 3 + [1.0 / data.centre_distance] * 3)
    pin[1, 5], pin[2, 4] = 1.0, -1.0
    W = np.zeros((N + 3, 6, N, 6))
    W[3 + n, :, n] = own.T
    W[CENTRAL.index("carrier")] = -_turned(data, pin.T).transpose(1, 0, 2)
    return W.reshape(6 * (N + 3), N, 6)


def free_motions(data: HelicalSet) -> np.ndarray:
    """All coordinates (6 (N + 3), n) per unit of those that infinite stiffnesses leave free."""
    N = data.n_planets
    T, pins = np.eye(6 * (N + 3)), pin_directions(data)
    for n, axis in zip(*np.nonzero(np.isinf(data.pin_stiffness))):
        row = 18 + 6 * n + axis
        T[row, :18] = -pins[:18, n, axis] / pins[row, n, axis]
    return T[:, _kept(data)]


def _local_columns(data: HelicalSet, gear: str, flank: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns (6, S) of the central gear and of a planet in one mesh, in the planet's directions.

    Gear 1 is the sun or, in the ring mesh, the planet.
    """
    external = gear == "sun"
    alpha = data.pressure_angle_sun_planet if external else data.pressure_angle_planet_ring
    side = flank if external else -flank
    along = np.array([math.sin(alpha), side * math.cos(alpha)])
    beta = data.base_helix_angle
    normal = np.array([*(along * math.cos(beta)), -flank * math.sin(beta)])
    r, r_p, a = getattr(data, f"{gear}_radius"), data.planet_radius, data.centre_distance
    # speed of the point of each gear along the line of action per unit of its u
    turn, turn_p = side, -flank
    if data.contact_points == "base_circles":
        foot = np.array([along[1], -along[0]])
        point, point_p = turn * r * foot, turn_p * r_p * foot
    else:
        point = np.array([a * r / (r + r_p if external else r - r_p), 0.0])
        point_p = point - (a, 0.0)
    sign = 1.0 if external else -1.0
    heights, around = data.slice_heights, math.cos(beta)
    central = sign * _point_column(normal, point, heights, r, turn * around)
    return central, -sign * _point_column(normal, point_p, heights, r_p, turn_p * around)


def _point_column(normal, point, heights, radius: float, around: float) -> np.ndarray:
    """``n . (v + phi x c)`` (6, S) for points at all heights; `around` is the factor of u."""
    column = np.zeros((6, len(heights)))
    column[:3], column[5] = normal[:, None], around
    column[3] = (normal[2] * point[1] - normal[1] * heights) / radius
    column[4] = (normal[0] * heights - normal[2] * point[0]) / radius
    return column


def _turned(data: HelicalSet, local: np.ndarray) -> np.ndarray:
    """Coordinates (N, 6, k) of a central member of columns (6, k) in every planet's directions."""
    cosine, sine = np.cos(data.planet_angles), np.sin(data.planet_angles)
    turned = np.repeat(np.asarray(local, float)[None], data.n_planets, axis=0)
    for first in (0, 3):
        one, two = local[first], local[first + 1]
        turned[:, first] = cosine[:, None] * one - sine[:, None] * two
        turned[:, first + 1] = sine[:, None] * one + cosine[:, None] * two
    return turned


def _kept(data: HelicalSet) -> np.ndarray:
    kept = [np.isfinite(getattr(data, name).support.stiffness) for name in CENTRAL]
    return np.concatenate([*kept, np.isfinite(data.pin_stiffness).ravel()])


def _linear_stiffness(data: HelicalSet) -> np.ndarray:
    """Finite supports and planet bearings."""
    diagonal = np.zeros((data.n_planets + 3, 6))
    for row, name in enumerate(CENTRAL):
        scale = np.array([1.0] * 3 + [member_radius(data, name)] * 3)
        diagonal[row] = getattr(data, name).support.stiffness / scale**2
    pins = pin_directions(data)
    k = np.where(np.isfinite(data.pin_stiffness), data.pin_stiffness, 0.0)
    K = np.einsum("ina,na,jna->ij", pins, k, pins, optimize=True)
    return K + np.diag(np.where(np.isfinite(diagonal), diagonal, 0.0).ravel())


def helical_meshes(
    data: HelicalSet,
    *,
    stiffness: FourierSeries | StepSeries | MeshExcitation | None = None,
    harmonics: int | None = None,
    orders: tuple[int, ...] = (1,),
    backlash: float | np.ndarray | None = None,
    separates: bool = True,
    smoothing: float = 0.0,
) -> GearMeshes:
    """The slices of the 2N meshes as elements, each of them separating by itself.

    Parameters
    ----------
    data : HelicalSet
    stiffness : FourierSeries, StepSeries or MeshExcitation, optional
        Of the 2N S columns [N/m], or their record as from
        `helical_excitation`; the constant stiffnesses of the set when not
        given.
    harmonics, orders
        Of a record, see `femgear.system.system.gear_meshes`.
    backlash : float or (2N S,) array, optional
        Play along the tooth normal [m]. None takes that of the record; without one, or where it is zero
        there, the meshes have no back side.
    separates, smoothing
        See `femgear.system.elements.GearMeshes`.

    Raises
    ------
    CaseError
        A record without the number of its harmonics (E-HARMONICS), values for another number of columns
        (E-SHAPE).
    """
    made = mesh_elements(stiffness, data.column_stiffness, harmonics, orders, record="record")
    backlash = made.backlash if backlash is None else backlash
    return replace(made, backlash=backlash, separates=separates, smoothing=smoothing)


def helical_problem(
    data: HelicalSet,
    *,
    meshes: GearMeshes | None = None,
    torque: PlanarTorque | None = None,
    damping: float | np.ndarray | None = None,
) -> NonlinearSystem:
    """Helical set with its meshes as elements, for harmonic balance and time integration.

    Back flanks act on the line of the drive flanks: there is no wedging.

    Parameters
    ----------
    data : HelicalSet
    meshes : GearMeshes, optional
        From `helical_meshes`; constant stiffnesses without back side when not given.
    torque : PlanarTorque, optional
    damping : float, (n_modes,) array or (n, n) array, optional
        Damping ratio of all modes, or one a mode, with mean stiffnesses; or the matrix ``C``.

    Raises
    ------
    CaseError
        A load that accelerates the set (E-LOAD-BALANCE), arrays that do not fit (E-SHAPE).
    """
    meshes = helical_meshes(data) if meshes is None else meshes
    columns = np.arange(2 * data.n_planets * data.slices)
    if not np.array_equal(meshes.columns[:, 0], columns):
        raise CaseError(
            f"meshes on columns {meshes.columns[:, 0].tolist()}", code="E-SHAPE", key="meshes",
            limit=f"columns 0 to {len(columns) - 1} in order", remedy="make them with helical_meshes",
        )  # fmt: skip
    system = helical_system(data, torque=torque)
    reference = NonlinearSystem(system, (meshes,)).reference
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(system, reference)
    return NonlinearSystem(replace(system, C=viscous_damping(system, reference, damping)), (meshes,))


def contact_line_width(face_width: float, base_helix_angle: float) -> float:
    """``b / cos beta_b`` [m]: face width of the spur gear of the normal section whose record is sliced.

    Its teeth are as long as the contact lines of the helical gear. With the stiffness c' per length along
    the tooth normals, the mesh has ``c' b / cos beta_b`` along the normal, hence ``c' b cos beta_b`` in the
    transverse section, as ISO 6336-1, method B, has it.
    """
    return face_width / math.cos(base_helix_angle)


def helical_excitation(
    record: MeshExcitation, overlap_ratio, *, slices: int = 1, hand: int = 1
) -> MeshExcitation:
    """Record of helical meshes, or of their slices, from that of spur meshes with the same mesh period.

    Height z above mid-face runs ahead of it by ``eps_beta z / b`` mesh periods, so that

    ``k(tau) = 1 / eps_beta int k_spur(tau + s) ds``, s from ``-eps_beta / 2`` to ``eps_beta / 2``,

    which multiplies harmonic h by ``sin(pi h eps_beta) / (pi h eps_beta)``: nothing is left of it where
    ``h eps_beta`` is a whole number. Tangent lines add up: the mesh force is the mean of the forces of the
    slices, and the deflection at which their tangents together carry it is the mean weighted by stiffness.

    Parameters
    ----------
    record : MeshExcitation or MeshCycle
        Of the spur gears of the normal section with the face width `contact_line_width`, all of it loaded as
        the whole helical mesh; stiffnesses and deflections along the tooth normals. Mesh phases are those at
        mid-face. A `femgear.contact.cycle.MeshCycle` knows no backlash, which is then zero.
    overlap_ratio : float or (n_meshes,) array
        eps_beta, 0 or more.
    slices : int
        Number S of equal slices of the face width; each has a row of its own with its part of stiffness and
        force, in the order of the columns of `mesh_directions`.
    hand : {1, -1}
        1 where height +z runs ahead: a right-handed sun that turns counter-clockwise against the carrier, or
        a left-handed one that turns clockwise. Only slices see it.

    Returns
    -------
    MeshExcitation
        (n_meshes S) rows.

    Raises
    ------
    CaseError
        Overlap ratios, slices or a hand that cannot be (E-HELICAL), a slice that loses its stiffness
        (E-MESH-STIFFNESS).
    """
    count = len(record.stiffness)
    ahead = slice_phases(np.zeros(count), overlap_ratio, slices=slices, hand=hand).reshape(count, slices)
    overlap = _overlap(overlap_ratio, count)
    backlash = np.broadcast_to(getattr(record, "backlash", 0.0), count)
    filtered = [
        _sliced(values, record.periods, ahead, overlap / slices) / slices
        for values in (record.stiffness, record.force, record.stiffness * record.deflection)
    ]
    stiffness, force, weighted = (values.reshape(-1, values.shape[-1]) for values in filtered)
    if np.any(stiffness <= 0.0):
        raise CaseError(
            "the spur record has positions without stiffness for a whole slice", code="E-MESH-STIFFNESS",
            remedy="give a record whose meshes stay closed",
        )  # fmt: skip
    return MeshExcitation(
        stiffness=stiffness,
        deflection=weighted / stiffness,
        force=force,
        backlash=np.repeat(backlash, slices),
        periods=record.periods,
    )


def slice_phases(phases, overlap_ratio, *, slices: int, hand: int = 1) -> np.ndarray:
    """Phases (n_meshes S,) of the slices of meshes, as fractions of the mesh period.

    Parameters
    ----------
    phases : (n_meshes,) array
        At mid-face.
    overlap_ratio, slices, hand
        See `helical_excitation`.
    """
    phases = np.asarray(phases, float)
    overlap = _overlap(overlap_ratio, len(phases))
    if isinstance(slices, bool) or int(slices) != slices or slices < 1:
        raise CaseError(f"{slices} slices of the face width", code="E-HELICAL", limit="1 or more")
    if hand not in (1, -1):
        raise CaseError(f"a hand of {hand}", code="E-HELICAL", limit="1 or -1")
    height = (np.arange(slices) + 0.5) / slices - 0.5
    return (phases[:, None] + hand * overlap[:, None] * height).ravel()


def _sliced(values: np.ndarray, periods: int, ahead: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Means (n, S, P) of (n, P) samples of `periods` mesh periods over windows of `width` around `ahead`.

    Exact for the trigonometric polynomial through the samples.
    """
    count = values.shape[-1]
    order = np.fft.rfftfreq(count, 1.0 / count) / periods  # in cycles a mesh period
    shift = np.exp(2j * np.pi * order * ahead[..., None]) * np.sinc(order * width[:, None, None])
    return np.fft.irfft(np.fft.rfft(values)[:, None] * shift, n=count)


def _overlap(overlap_ratio, meshes: int) -> np.ndarray:
    overlap = np.asarray(overlap_ratio, float)
    if overlap.shape not in ((), (meshes,)) or not np.all(np.isfinite(overlap)) or np.any(overlap < 0.0):
        raise CaseError(
            f"overlap ratios {overlap.tolist()}", code="E-HELICAL", key="overlap_ratio",
            limit=f"one number of 0 or more, or {meshes}", remedy="give b sin|beta| / (pi m_n)",
        )  # fmt: skip
    return np.broadcast_to(overlap, (meshes,))


def helical_modes(
    data: HelicalSet, *, mesh_stiffness=None, damping_ratio: float = 0.0, max_frequency: float | None = None
) -> Modes:
    """Modes of the set at standstill, with their kinds.

    Parameters
    ----------
    data : HelicalSet
    mesh_stiffness : (2N S,) array, optional
        Of the columns [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.
    max_frequency : float, optional
        Keep the modes up to this frequency [Hz]; all when not given.

    Returns
    -------
    Modes
        ``kind`` from `helical_kinds`; modes of one frequency have one phasing each.
    """
    stiffness = data.column_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = solve_modes(
        helical_system(data), stiffness, damping_ratio=damping_ratio, max_frequency=max_frequency
    )
    # tilts of the planets that no mesh feels have one frequency in several classes
    Q = phase_basis(helical_motions(data, modes.shape), modes.frequency, tolerance=_ONE_FREQUENCY)
    return replace(
        modes,
        shape=modes.shape @ Q,
        mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=Q.T @ modes.modal_load,
        kind=helical_kinds(data, modes.shape @ Q, frequency=modes.frequency),
    )


def helical_kinds(data: HelicalSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode from its shape.

    T. Eritenel and R. G. Parker (J. Sound Vib. 325, 2009, 397-420) for equal planets at equal angles: in a
    rotational-axial mode the central members rotate and move along z, and all planets move alike; in a
    translational-tilting mode they move and tilt in the plane; in a planet mode they rest. With four planets
    these are the modes that Kahraman (1994) calls in-phase, sequentially phased and counter-phased; the
    phasing itself comes from `femgear.system.mode_kinds.phasing` of `helical_motions`.

    Parameters
    ----------
    data : HelicalSet
    shape : (n, m) array
        In the coordinates of `helical_system`.
    frequency : (m,) array
        Zero for rigid-body modes.

    Returns
    -------
    tuple of str
        ``rigid``; ``rotational-axial``, ``translational-tilting`` or ``planet`` where at least 99 % of the
        kinetic energy belongs to that class; else ``mixed``.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    named = named_kinds(class_shares(data, shape), frequency)
    return tuple(KINDS.get(kind, kind) for kind in named)


def class_shares(data: HelicalSet, shape) -> np.ndarray:
    """Shares (3, m) of rotational-axial, translational-tilting and planet motion in the kinetic energy."""
    return energy_shares(helical_motions(data, shape))


def helical_motions(data: HelicalSet, shape) -> SetMotions:
    """Motions of all bodies, held ones and planets tied to their pins included.

    The central members stand twice: x, y and rotation, then tilt about x, tilt about y and z, which turn with
    the frame as those do. Planets have all six motions.

    Parameters
    ----------
    data : HelicalSet
    shape : (n, m) array
        In the coordinates of `helical_system`.

    Raises
    ------
    CaseError
        Shapes of another system (E-SHAPE).
    """
    full, mass = body_motions(data, free_motions(data), shape), body_masses(data)
    plane, space = [0, 1, 5], [3, 4, 2]
    central = np.concatenate([full[:3, plane], full[:3, space]])
    central_mass = np.concatenate([mass[:3, plane], mass[:3, space]])
    return SetMotions(central, central_mass, full[3:], mass[3:], data.planet_angles)


def helical_springs(data: HelicalSet, *, mesh_stiffness=None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the set by name, for `femgear.solvers.linear.tracking.strain_shares`.

    Parameters
    ----------
    data : HelicalSet
    mesh_stiffness : (2N S,) array, optional
        Of the columns [N/m]; that of the set when not given.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Meshes one by one (a column a slice); of planet bearings and of supports of the central members
        ``radial`` (two columns), ``axial``, ``tilt`` (two) and ``torsional``, in [m] and [rad]; what is held
        or free has no spring.
    """
    T, N = free_motions(data), data.n_planets
    k = np.asarray(data.column_stiffness if mesh_stiffness is None else mesh_stiffness, float)
    meshes = (T.T @ mesh_directions(data)).reshape(T.shape[1], 2 * N, data.slices)
    names = [f"sun-planet {n + 1}" for n in range(N)] + [f"planet {n + 1}-ring" for n in range(N)]
    k = k.reshape(2 * N, data.slices)
    springs = {name: (meshes[:, j], k[j]) for j, name in enumerate(names)}
    pins = pin_directions(data)
    for n in range(N):
        springs |= _by_direction(f"bearing of planet {n + 1}", T.T @ pins[:, n], data.pin_stiffness[n])
    for row, name in enumerate(CENTRAL):
        scale = np.array([1.0] * 3 + [member_radius(data, name)] * 3)
        columns = T[6 * row : 6 * row + 6].T / scale
        springs |= _by_direction(f"support of the {name}", columns, getattr(data, name).support.stiffness)
    return springs


def _by_direction(name: str, columns: np.ndarray, stiffness: np.ndarray) -> dict:
    """Springs (two radial, axial, two tilts, torsional) that are finite and not zero."""
    there = np.isfinite(stiffness) & (stiffness > 0.0)
    places = ([0, 1], [2], [3, 4], [5])
    return {
        f"{name}, {direction}": (columns[:, rows], stiffness[rows])
        for direction, rows in zip(SPRINGS, places)
        if there[rows[0]]
    }


@dataclass(frozen=True)
class ErrorResponse:
    """Response of several cases to transmission errors on harmonics of the mesh frequency.

    Parameters
    ----------
    mesh_frequency : (F,) array
        [Hz]
    harmonics : (H,) int array
    deflection : (n_cases, F, H, n_columns) complex array
        ``W^T q`` [m]: the dynamic transmission error of every mesh or slice.
    force : (n_cases, F, H, n_columns) complex array
        Dynamic mesh force ``k (W^T q - e)`` [N].
    output : (n_cases, F, H, n_outputs) complex array
    """

    mesh_frequency: np.ndarray
    harmonics: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    output: np.ndarray


def modal_error_response(
    system: MechanicalSystem, modes: Modes, mesh_frequency, error, *, harmonics=None, outputs=None
) -> ErrorResponse:
    """Response to transmission errors ``e_j(t) = Re sum_h error_jh exp(i h omega_m t)`` by summing modes.

    ``q = sum phi (phi^T W k e) / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)``, with the static
    flexibility of modes that were left out (Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 2.9;
    A. Kahraman, J. Mech. Des. 116, 1994, 713-720, sums all modes). Many cases share one gain. A transmission
    error does no work on rigid motions, so that these stay at rest.
    `femgear.solvers.linear.frequency_response.mesh_error_response` is the direct solution.

    Parameters
    ----------
    system : MechanicalSystem
    modes : Modes
        Of that system; ``modes.mesh_stiffness`` are the stiffnesses ``k`` of the columns of ``W``.
    mesh_frequency : (F,) array
        [Hz]
    error : (n_columns, H) or (n_cases, n_columns, H) complex array
        [m]; of one case the result has a first axis of length one. For phases phi_j as fractions of the mesh
        period, ``k_j(tau) = k(tau + phi_j)``, it is ``e_h exp(2 pi i h phi_j)``, see `phased_errors`.
    harmonics : (H,) int array, optional
        Whole numbers from 1; 1 to H when not given.
    outputs : (n_outputs, n) array, optional
        ``L``, such as the rows of `spring_loads`; none when not given.

    Raises
    ------
    CaseError
        Errors or harmonics that do not fit (E-SHAPE), harmonics or frequencies that are none (E-HARMONICS,
        E-FREQUENCY).
    ConvergenceError
        An undamped resonance (E-RESONANCE).
    """
    k, count = modes.mesh_stiffness, len(system.M)
    error, harmonics = _errors(error, harmonics, len(k))
    frequency = _frequencies(mesh_frequency)
    rows = np.empty((0, count)) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    elastic = modes.frequency > 0.0
    left = np.vstack([system.W.T, rows]) @ modes.shape[:, elastic]
    gain = _gain(modes, elastic, np.outer(frequency, harmonics))
    # forces k e of the errors on the meshes, and on the modes
    push = k[:, None] * error
    modal = np.einsum("jm,cjh->chm", modes.mesh_deflection[:, elastic], push)
    static = np.zeros((len(error), len(harmonics), len(left)))
    if modes.shape.shape[1] < count:
        rest = np.vstack([modes.residual, residual_output(system, modes, rows)])
        static = np.einsum("oj,cjh->cho", rest, push)
    answer = np.empty((len(error), len(frequency), len(harmonics), len(left)), complex)
    for h in range(len(harmonics)):
        answer[:, :, h] = (gain[:, h] * modal[:, None, h]) @ left.T + static[:, None, h]
    deflection, output = answer[..., : len(k)], answer[..., len(k) :]
    force = k * (deflection - error.transpose(0, 2, 1)[:, None])
    return ErrorResponse(frequency, harmonics, deflection, force, output)


def phased_errors(amplitudes, phases) -> np.ndarray:
    """Transmission errors (n_meshes, H) of meshes that follow each other.

    Parameters
    ----------
    amplitudes : (H,) or (n_meshes, H) complex array
        Harmonics 1 to H at phase zero [m].
    phases : (n_meshes,) array
        phi_j as fractions of the mesh period, ``e_j(tau) = e(tau + phi_j)``: `PlanetarySet.mesh_phases`.
    """
    amplitudes, phases = np.asarray(amplitudes, complex), np.asarray(phases, float)
    turns = phases[:, None] * np.arange(1, amplitudes.shape[-1] + 1)
    return amplitudes * np.exp(2j * np.pi * turns)


def spring_loads(springs: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and rows (n_outputs, n) that read the loads of springs from the coordinates.

    Parameters
    ----------
    springs : mapping of str to (columns (n, g), stiffness (g,))
        From `helical_springs` or `femgear.system.assembler.planar_springs`; those of meshes give ``k W^T q``
        without the transmission error, whose force is in `ErrorResponse.force`.

    Returns
    -------
    names : tuple of str
        The name of the spring, with ``1`` and ``2`` behind it where it has two columns or more.
    rows : (n_outputs, n) array
        [N/m, N m/rad and the like]
    """
    names, rows = [], []
    for name, (columns, stiffness) in springs.items():
        several = len(stiffness) > 1
        names += [f"{name} {i + 1}" if several else name for i in range(len(stiffness))]
        rows.append((columns * stiffness).T)
    return tuple(names), np.vstack(rows)


def _errors(error, harmonics, columns: int) -> tuple[np.ndarray, np.ndarray]:
    error = np.asarray(error, complex)
    error = error[None] if error.ndim == 2 else error
    harmonics = np.arange(1, error.shape[-1] + 1) if harmonics is None else np.atleast_1d(harmonics)
    if harmonics.ndim != 1 or harmonics.dtype.kind not in "iu" or np.any(harmonics < 1):
        raise CaseError(
            f"harmonics {harmonics.tolist()} of the mesh frequency", code="E-HARMONICS", key="harmonics",
            limit="whole numbers from 1", remedy="the mean of a transmission error is a static load",
        )  # fmt: skip
    if error.shape[1:] != (columns, len(harmonics)) or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape}", code="E-SHAPE",
            limit=f"(cases, {columns} meshes, {len(harmonics)} harmonics), finite",
        )  # fmt: skip
    return error, harmonics


def _frequencies(mesh_frequency) -> np.ndarray:
    frequency = np.atleast_1d(np.asarray(mesh_frequency, float))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(
            f"mesh frequencies of shape {frequency.shape}", code="E-FREQUENCY", key="mesh_frequency",
            limit="a list of numbers >= 0 Hz",
        )  # fmt: skip
    return frequency


def _gain(modes: Modes, elastic: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """``1 / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)`` (F, H, m)."""
    natural, w = 2.0 * np.pi * modes.frequency[elastic], 2.0 * np.pi * frequency[..., None]
    below = natural**2 - w**2 + 2j * modes.damping_ratio[elastic] * natural * w
    bad = np.abs(below) <= _RESONANT * np.maximum(natural**2, w**2)
    if np.any(bad):
        mode = int(np.argwhere(bad)[0, -1])
        raise ConvergenceError(
            f"undamped resonance at {natural[mode] / (2 * np.pi):.6g} Hz: infinite response",
            code="E-RESONANCE", remedy="give the motion some damping or move the frequency",
        )  # fmt: skip
    return 1.0 / below
