"""Helical planetary set of rigid bodies that move in space: the model of Kahraman (1994).

Carrier, ring, sun and N planets have three translations and three rotations each, 6 (N + 3) coordinates.
A. Kahraman, Planetary Gear Train Dynamics, J. Mech. Des. 116, 1994, 713-720: rigid bodies, gear meshes as
springs along the tooth normals, supports and planet pins in all directions, without terms of the carrier's
speed. Here all matrices follow from kinematics: every spring is a column of deflections ``w^T q`` and adds
``k w w^T``; the meshes stay columns of W.

Coordinates: x, y and z of the central members, planets radially outwards, tangentially and along z; tilts
``w = r phi`` about the same two axes in the plane and ``u = r theta`` about z, all right-handed. r is the
base radius of the gears and the radius of the circle of planet centres for the carrier.
"""

from __future__ import annotations

import math

import numpy as np

from femgear.errors import CaseError
from femgear.models.helical_data import (
    HelicalBody,
    HelicalSet,
    HelicalSupport,
    body_masses,
    helical_from_set,
    reduced_body,
    reduced_support,
)
from femgear.models.planar_data import CENTRAL, PlanarTorque, flank_sign, member_radius, torque_load
from femgear.system import MechanicalSystem

__all__ = [
    "CENTRAL",
    "CENTRAL_AXES",
    "PLANET_AXES",
    "HelicalBody",
    "HelicalSet",
    "HelicalSupport",
    "PlanarTorque",
    "free_motions",
    "helical_dofs",
    "helical_from_set",
    "helical_system",
    "mesh_directions",
    "pin_directions",
    "reduced_body",
    "reduced_support",
]

CENTRAL_AXES = ("x", "y", "z", "tilt x", "tilt y", "u")
PLANET_AXES = ("radial", "tangential", "z", "tilt radial", "tilt tangential", "u")


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
