"""Directions of meshes and springs of planetary sets of rigid bodies, and the matrices assembled from them.

Carrier, ring, sun and N planets move along x, y and z, tilt by ``w = r phi`` and turn by ``u = r theta``, in
the order and with the signs of J. Lin and R. G. Parker, J. Vib. Acoust. 121, 1999, 316-321: x and y of the
central members in a frame that turns with the carrier, planets radially outwards and tangentially (their zeta
and eta), all rotations right-handed; r is the base radius of the gears and the radius of the circle of planet
centres for the carrier. A kind of set has the motions `RigidSet.axes` of these: three in the plane, or all
six as in A. Kahraman, J. Mech. Des. 116, 1994, 713-720. The equation of motion in the plane is

``M q'' + Omega G q' + [K_b + K_m - Omega^2 K_Omega] q = T + F``

with the matrices printed in the appendix of Lin and Parker. Here K_b and K_m follow from kinematics: every
spring is a column of deflections, ``w^T q``, and adds ``k w w^T``; the meshes stay columns of W. `assemble`
reduces the matrices of any bodies, springs and meshes to the motions that are free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import Series, constant
from femgear.system.rigid_bodies import (
    CENTRAL,
    ROTATIONS,
    PlanarTorque,
    RigidSet,
    body_masses,
    flank_sign,
    refuse,
    torque_load,
)
from femgear.system.system import MechanicalSystem, MeshExcitation, gear_meshes

CENTRAL_AXES = ("x", "y", "z", "tilt x", "tilt y", "u")
PLANET_AXES = ("radial", "tangential", "z", "tilt radial", "tilt tangential", "u")


def assemble(
    mass: np.ndarray,
    stiffness: np.ndarray,
    columns: np.ndarray,
    load: np.ndarray,
    *,
    motions: np.ndarray,
    dofs: Sequence[str],
    gyroscopic: np.ndarray | None = None,
) -> MechanicalSystem:
    """Reduce the matrices of bodies, springs and meshes to the motions that are free; ``C`` is zero.

    Parameters
    ----------
    mass : (n,) or (n, n) array
        In all coordinates [kg, kg m^2].
    stiffness : (n, n) array
        Of springs that are not columns of ``W``, see `stiffness_matrix` [N/m, N m/rad].
    columns : (n, g) array
        Deflections of meshes, and of bearings that are elements, per unit of the coordinates.
    load : (n,) array
        [N, N m]
    motions : (n, m) array
        All coordinates per unit of the free ones: unit columns, and what follows them.
    dofs : (m,) sequence of str
        Names of the free coordinates.
    gyroscopic : (n, n) array, optional
        [kg]
    """
    T = motions
    return MechanicalSystem(
        M=(T.T * mass) @ T if mass.ndim == 1 else T.T @ mass @ T,
        C=np.zeros((T.shape[1], T.shape[1])),
        K=T.T @ stiffness @ T,
        W=T.T @ columns,
        load=T.T @ load,
        dofs=tuple(str(name) for name in dofs),
        gyroscopic=None if gyroscopic is None else T.T @ gyroscopic @ T,
    )


def stiffness_matrix(columns: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Sum ``k w w^T`` (n, n) [N/m, ...] over springs with columns w (n, g) and stiffnesses k (g,) [N/m].

    Infinite ones hold motions and are not in it.
    """
    k = np.where(np.isfinite(stiffness), stiffness, 0.0)
    return np.einsum("ig,g,jg->ij", columns, k, columns)


def gear_set_system(
    data: RigidSet,
    *,
    torque: PlanarTorque | None = None,
    carrier_speed: float = 0.0,
    back_flanks: bool = False,
    planet_bearings: bool = False,
) -> MechanicalSystem:
    """Assemble the matrices of a planetary set; the meshes are columns of ``W`` and not in ``K``.

    CaseError: a torque on a held member, a set that cannot move at all (E-MECHANISM), a carrier speed or
    planet bearings of bodies that move in space (E-RANGE).

    Parameters
    ----------
    data : RigidSet
        Coordinates with an infinite stiffness are left out.
    torque : PlanarTorque, optional
        Its sign chooses the flanks of the mesh columns; without it those of a sun that drives
        counter-clockwise. Mesh deflections are positive in compression.
    carrier_speed : float
        Mean speed of the carrier [rad/s] for the gyroscopic matrix, the centripetal stiffness and the
        centrifugal load of planets that move in their plane; ``gyroscopic`` is None for zero.
    back_flanks : bool
        Adds the columns of the other flanks, positive in their compression, on their own lines of action
        (Y. Guo and R. G. Parker, Eur. J. Mech. A 29, 2010, 1022-1033: tooth wedging).
    planet_bearings : bool
        They become columns of ``W``, radial and tangential, planet less pin; their stiffness is not in ``K``.

    Returns
    -------
    MechanicalSystem
        ``C`` is zero. Columns of ``W``: the slices of mesh 1, of mesh 2 and so on, back flanks, bearings.
    """
    if len(data.axes) > 3 and carrier_speed:
        refuse("carrier_speed", carrier_speed, "rad/s", "0 of bodies that move in space")
    if len(data.axes) > 3 and planet_bearings:
        refuse("planet_bearings", planet_bearings, "", "none of bodies that move in space")
    T, flank, kept = free_motions(data), flank_sign(data, torque), _kept(data)
    if not T.shape[1]:
        raise CaseError(
            "infinite stiffnesses hold every motion of the set",
            code="E-MECHANISM",
            remedy="give the support or the bearing of a body finite stiffnesses",
        )
    masses = body_masses(data)
    columns = [mesh_directions(data, flank)]
    if back_flanks:
        columns.append(mesh_directions(data, -flank))
    if planet_bearings:
        columns.append(pin_directions(data)[..., :2].reshape(kept.size, -1))
    stiffness, load = np.diag(support_diagonal(data).ravel()), torque_load(data, torque, kept)
    if not planet_bearings:
        pins = pin_directions(data)
        stiffness += stiffness_matrix(pins.reshape(len(pins), -1), data.pin_stiffness.ravel())
    gyroscopic = None
    if carrier_speed:
        # the translational part is the K_Omega of Lin and Parker
        along = (masses * ~_turning(data)).ravel()
        stiffness -= carrier_speed**2 * np.diag(along)
        load[9::3] += carrier_speed**2 * data.planet.mass * data.centre_distance
        gyroscopic = _gyroscopic(along)
    return assemble(
        masses.ravel(),
        stiffness,
        np.hstack(columns),
        load,
        motions=T,
        dofs=np.array(dof_names(data))[kept].tolist(),
        gyroscopic=gyroscopic,
    )


def dof_names(data: RigidSet) -> tuple[str, ...]:
    """Name all coordinates, held ones included, in the order of Lin and Parker, Eq. (2)."""
    bodies = [(body, CENTRAL_AXES) for body in CENTRAL]
    bodies += [(f"planet {n + 1}", PLANET_AXES) for n in range(data.n_planets)]
    return tuple(f"{body}: {names[axis]}" for body, names in bodies for axis in data.axes)


def mesh_elements(
    data: RigidSet,
    *,
    stiffness: Series | MeshExcitation | None = None,
    harmonics: int | None = None,
    orders: tuple[int, ...] = (1,),
    backlash: float | np.ndarray | None = None,
    separates: bool = True,
    smoothing: float = 0.0,
) -> GearMeshes:
    """Make elements of the 2N meshes, or of their slices, each of which separates by itself.

    Parameters
    ----------
    stiffness : FourierSeries, StepSeries or MeshExcitation, optional
        Of the mesh columns [N/m], or their static record; the constant stiffnesses of the set when not given.
    harmonics, orders
        Of a static record, see `femgear.system.system.gear_meshes`.
    backlash : float or (n_columns,) array, optional
        Play along the line of action [m]. None takes that of the static record; without one, or where it
        is zero there, the meshes have no back side.
    separates, smoothing
        See `femgear.system.force_laws.GearMeshes`.

    Raises
    ------
    CaseError
        A static record without the number of its harmonics (E-HARMONICS), values for another number of
        meshes (E-SHAPE).
    """
    mean = data.column_stiffness
    columns = np.arange(len(mean))
    if not isinstance(stiffness, MeshExcitation):
        series = constant(mean) if stiffness is None else stiffness
        made = GearMeshes(columns, series, separates=separates, smoothing=smoothing)
    elif harmonics is None:
        raise CaseError(
            "the mesh harmonics of the static record are not said",
            code="E-HARMONICS",
            key="harmonics",
            limit="a whole number of 1 or more",
        )
    else:
        made = gear_meshes(
            stiffness,
            harmonics=harmonics,
            columns=columns,
            separates=separates,
            smoothing=smoothing,
            orders=orders,
        )
    return made if backlash is None else replace(made, backlash=backlash)


def check_mesh_columns(data: RigidSet, meshes: GearMeshes) -> None:
    """Refuse meshes that do not act on the first columns of ``W``, one a column (E-SHAPE)."""
    count = len(data.column_stiffness)
    if not np.array_equal(meshes.columns[:, 0], np.arange(count)):
        raise CaseError(
            f"meshes on columns {meshes.columns[:, 0].tolist()}",
            code="E-SHAPE",
            key="meshes",
            limit=f"columns 0 to {count - 1} in order",
            remedy="make them with mesh_elements",
        )


def mesh_directions(data: RigidSet, flank: int = 1) -> np.ndarray:
    """Make the mesh columns (n, 2N S): approach of the flanks [m] per unit of the coordinates.

    Along the common normal, of S slices each, n in all coordinates.

    A rigid body whose centre moves by v and which rotates by phi moves its point c by ``v + phi x c``, so
    that the flanks of gears 1 and 2 approach by ``n . (v_1 + phi_1 x c_1) - n . (v_2 + phi_2 x c_2)`` with
    the normal n into gear 2. Seen from the planet's centre n is ``(sin alpha cos beta_b, +- cos alpha cos
    beta_b, - sin beta_b)`` radially, tangentially and axially for the flanks of a sun that drives
    counter-clockwise (`flank` = 1, else -1). The rotation about the own axis gives ``+- u cos beta_b``.
    Forces on base circles give a sun and one planet the mesh deflection of the helical pair of M. Kubur et
    al., J. Mech. Des. 126, 2004, 398-406. In the plane these are Lin and Parker's mesh deflections, psi_sn =
    psi_n - alpha_s and psi_rn = psi_n + alpha_r:

    ``delta_sn = y_s cos psi_sn - x_s sin psi_sn - zeta_n sin alpha_s - eta_n cos alpha_s + u_s + u_n``
    ``delta_rn = y_r cos psi_rn - x_r sin psi_rn + zeta_n sin alpha_r - eta_n cos alpha_r + u_r - u_n``
    """
    N, S = data.n_planets, len(data.contact_lines.heights)
    W = np.zeros((N + 3, 6, 2 * N, S))
    n = np.arange(N)
    for mesh, gear in enumerate(("sun", "ring")):
        central, planet = _local_columns(data, gear, flank)
        W[CENTRAL.index(gear), :, mesh * N + n] = _turned(data, central)
        W[3 + n, :, mesh * N + n] = planet
    return W[:, list(data.axes)].reshape(-1, 2 * N * S)


def pin_directions(data: RigidSet) -> np.ndarray:
    """Make the bearing columns (n, N, d): motion of each planet less that of its pin, as `pin_stiffness`.

    Radial and tangential, of bodies in space also axial [m], tilt about the radial and the tangential axis
    and rotation [rad]. A carrier that tilts by phi moves the pin along z by ``phi x a e_n``.
    """
    N, n = data.n_planets, np.arange(data.n_planets)
    own = np.diag([1.0] * 3 + [1.0 / data.planet_radius] * 3)
    # motion of the pin (6,) per local coordinate of the carrier (6,)
    pin = np.diag([1.0] * 3 + [1.0 / data.centre_distance] * 3)
    pin[1, 5], pin[2, 4] = 1.0, -1.0
    W = np.zeros((N + 3, 6, N, 6))
    W[3 + n, :, n] = own.T
    W[CENTRAL.index("carrier")] = -_turned(data, pin.T).transpose(1, 0, 2)
    axes = list(data.axes)
    return W[:, axes][..., axes[: data.pin_stiffness.shape[1]]].reshape(len(axes) * (N + 3), N, -1)


def free_motions(data: RigidSet) -> np.ndarray:
    """Make all coordinates (n_all, n) per unit of those that infinite stiffnesses leave free."""
    pins, axes = pin_directions(data), len(data.axes)
    T, central = np.eye(len(pins)), 3 * axes
    for n, axis in zip(*np.nonzero(np.isinf(data.pin_stiffness))):
        row = central + axes * n + axis
        T[row, :central] = -pins[:central, n, axis] / pins[row, n, axis]
    return T[:, _kept(data)]


def support_diagonal(data: RigidSet) -> np.ndarray:
    """Collect the finite stiffnesses (N + 3, axes) [N/m] of the supports in all coordinates."""
    diagonal = np.zeros((data.n_planets + 3, len(data.axes)))
    # tilts and rotations are arcs on the radius of the body
    diagonal[:3] = data.support_stiffness / np.where(_turning(data), data.radii[:3, None], 1.0) ** 2
    return np.where(np.isfinite(diagonal), diagonal, 0.0)


def _turning(data: RigidSet) -> np.ndarray:
    """Whether the motions (axes,) of a body are rotations."""
    return np.isin(data.axes, ROTATIONS)


def _kept(data: RigidSet) -> np.ndarray:
    """Whether every coordinate is free of infinite stiffnesses."""
    planets = np.ones((data.n_planets, len(data.axes)), bool)
    planets[:, : data.pin_stiffness.shape[1]] = np.isfinite(data.pin_stiffness)
    return np.concatenate([np.isfinite(data.support_stiffness), planets]).ravel()


def _local_columns(data: RigidSet, gear: str, flank: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns (6, S) of the central gear and of a planet in one mesh, in the planet's directions.

    Gear 1 is the sun or, in the ring mesh, the planet.
    """
    external, lines = gear == "sun", data.contact_lines
    alpha = data.pressure_angle_sun_planet if external else data.pressure_angle_planet_ring
    side = flank if external else -flank
    along = np.array([math.sin(alpha), side * math.cos(alpha)])
    beta = lines.base_helix_angle
    normal = np.array([*(along * math.cos(beta)), -flank * math.sin(beta)])
    r, r_p, a = getattr(data, f"{gear}_radius"), data.planet_radius, data.centre_distance
    # speed of the point of each gear along the line of action per unit of its u
    turn, turn_p = side, -flank
    if lines.on_base_circles:
        foot = np.array([along[1], -along[0]])
        point, point_p = turn * r * foot, turn_p * r_p * foot
    else:
        point = np.array([a * r / (r + r_p if external else r - r_p), 0.0])
        point_p = point - (a, 0.0)
    sign = 1.0 if external else -1.0
    heights, around = np.array(lines.heights), math.cos(beta)
    central = sign * _point_column(normal, point, heights, r, turn * around)
    return central, -sign * _point_column(normal, point_p, heights, r_p, turn_p * around)


def point_approach(normal: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Compute ``n . (v + phi x c)`` per unit of v and phi of a rigid body (..., 6), ``n`` and ``c x n``.

    That is the motion along a normal (3,) of points (..., 3) [m] of the body, from its centre: per displacement
    along x, y and z [1], and per rotation about them [m/rad].
    """
    return np.concatenate([np.broadcast_to(normal, points.shape), np.cross(points, normal)], axis=-1)


def _point_column(normal, point, heights, radius: float, around: float) -> np.ndarray:
    """Column (6, S) of tilts ``w`` and rotation ``u`` on a radius, for points at all heights; `around` is that of u."""
    places = np.column_stack([np.broadcast_to(point, (len(heights), 2)), heights])
    column = point_approach(normal, places).T.copy()
    column[3:5] /= radius
    column[5] = around
    return column


def _turned(data: RigidSet, local: np.ndarray) -> np.ndarray:
    """Coordinates (N, 6, k) of a central member of columns (6, k) in every planet's directions."""
    cosine, sine = np.cos(data.angles), np.sin(data.angles)
    turned = np.repeat(np.asarray(local, float)[None], data.n_planets, axis=0)
    for first in (0, 3):
        one, two = local[first], local[first + 1]
        turned[:, first] = cosine[:, None] * one - sine[:, None] * two
        turned[:, first + 1] = sine[:, None] * one + cosine[:, None] * two
    return turned


def _gyroscopic(along: np.ndarray) -> np.ndarray:
    """``G`` with ``m (x'' - 2 Omega y' - Omega^2 x)`` and ``m (y'' + 2 Omega x' - Omega^2 y)``."""
    G = np.zeros((len(along), len(along)))
    first = np.arange(0, len(along), 3)
    G[first, first + 1], G[first + 1, first] = -2.0 * along[first], 2.0 * along[first]
    return G
