"""Planetary set of rigid bodies that move in their plane: the lumped model of Lin and Parker.

Carrier, ring, sun and N planets have two translations and ``u = r theta`` each, 3 (N + 3) coordinates in the
order and with the signs of J. Lin and R. G. Parker, J. Vib. Acoust. 121, 1999, 316-321: x and y of the
central members in a frame that turns with the carrier, planets radially outwards and tangentially (their
zeta and eta), all rotations counter-clockwise; r is the base radius of the gears and the radius of the
circle of planet centres for the carrier. Their equation of motion is

``M q'' + Omega G q' + [K_b + K_m - Omega^2 K_Omega] q = T + F``

with the matrices printed in their appendix. Here K_b and K_m follow from kinematics: every spring is a
column of deflections, ``w^T q``, and adds ``k w w^T``; the meshes stay columns of W.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.system.elements import GearMeshes
from femgear.system.fourier import FourierSeries, StepSeries, constant
from femgear.system.rigid_bodies import (
    CENTRAL,
    PlanarSet,
    PlanarTorque,
    body_masses,
    flank_sign,
    member_radius,
    torque_load,
)
from femgear.system.system import MechanicalSystem, MeshExcitation, gear_meshes


def planar_dofs(n_planets: int) -> tuple[str, ...]:
    """Names of all 3 (N + 3) coordinates, in the order of Lin and Parker, Eq. (2)."""
    central = [f"{body}: {axis}" for body in CENTRAL for axis in ("x", "y", "u")]
    axes = ("radial", "tangential", "u")
    return (*central, *(f"planet {n + 1}: {axis}" for n in range(n_planets) for axis in axes))


def planar_system(
    data: PlanarSet,
    *,
    torque: PlanarTorque | None = None,
    carrier_speed: float = 0.0,
    back_flanks: bool = False,
    bearings: Sequence[str] = (),
) -> MechanicalSystem:
    """Matrices of the lumped set; the meshes are columns of ``W`` and not in ``K``.

    Parameters
    ----------
    data : PlanarSet
        Coordinates with an infinite stiffness are left out.
    torque : PlanarTorque, optional
        Its sign chooses the flanks of the mesh columns; without it those of a sun that drives
        counter-clockwise. Mesh deflections are positive in compression.
    carrier_speed : float
        Mean speed of the carrier [rad/s] for the gyroscopic matrix, the centripetal stiffness and the
        centrifugal load of the planets; ``gyroscopic`` is None for zero.
    back_flanks : bool
        Adds the 2N columns of the other flanks, positive in their compression, on their own lines of action
        (Y. Guo and R. G. Parker, Eur. J. Mech. A 29, 2010, 1022-1033: tooth wedging).
    bearings : sequence of {"carrier", "ring", "sun", "planets"}
        Supports that become columns of ``W``, x and y (planets: radial and tangential, planet less pin);
        their stiffness is then not in ``K``. `column_groups` tells the places.

    Returns
    -------
    MechanicalSystem
        ``C`` is zero.

    Raises
    ------
    CaseError
        A torque on a held member (E-MECHANISM), an unknown or infinitely stiff bearing (E-BEARING).
    """
    T, flank = free_motions(data), flank_sign(data, torque)
    masses = body_masses(data)
    # the translational part is the K_Omega of Lin and Parker
    M, along = masses.ravel(), (masses * (1.0, 1.0, 0.0)).ravel()
    columns = [mesh_directions(data, flank)]
    if back_flanks:
        columns.append(mesh_directions(data, -flank))
    columns += [_bearing_columns(data, name) for name in bearings]
    K = _linear_stiffness(data, bearings)
    kept = _kept(data)
    load = torque_load(data, torque, kept)
    gyroscopic = None
    if carrier_speed:
        K -= carrier_speed**2 * np.diag(along)
        load[9::3] += carrier_speed**2 * data.planet.mass * data.centre_distance
        gyroscopic = T.T @ _gyroscopic(along) @ T
    names = np.array(planar_dofs(data.n_planets))[kept]
    return MechanicalSystem(
        M=(T.T * M) @ T,
        C=np.zeros((T.shape[1], T.shape[1])),
        K=T.T @ K @ T,
        W=T.T @ np.hstack(columns),
        load=T.T @ load,
        dofs=tuple(str(name) for name in names),
        gyroscopic=gyroscopic,
    )


def column_groups(
    data: PlanarSet, *, back_flanks: bool = False, bearings: Sequence[str] = ()
) -> dict[str, np.ndarray]:
    """Places of the columns of W: ``meshes`` (2N,), ``back flanks`` (2N,), and (g, 2) of every bearing.

    Parameters
    ----------
    data : PlanarSet
    back_flanks : bool
    bearings : sequence of {"carrier", "ring", "sun", "planets"}
        In the order in which their columns follow.
    """
    n = 2 * data.n_planets
    groups = {"meshes": np.arange(n)}
    if back_flanks:
        groups["back flanks"] = np.arange(n, 2 * n)
    start = n * len(groups)
    for name in bearings:
        count = data.n_planets if name == "planets" else 1
        groups[name] = np.arange(start, start + 2 * count).reshape(count, 2)
        start += 2 * count
    return groups


def planar_meshes(
    data: PlanarSet,
    *,
    stiffness: FourierSeries | StepSeries | MeshExcitation | None = None,
    harmonics: int | None = None,
    orders: tuple[int, ...] = (1,),
    backlash: float | np.ndarray | None = None,
    separates: bool = True,
    smoothing: float = 0.0,
) -> GearMeshes:
    """The 2N meshes as elements.

    Parameters
    ----------
    data : PlanarSet
    stiffness : FourierSeries, StepSeries or MeshExcitation, optional
        Of the meshes [N/m], or their static record; the constant stiffnesses of the set when not given.
    harmonics, orders
        Of a static record, see `femgear.system.system.gear_meshes`.
    backlash : float or (2N,) array, optional
        Play along the line of action [m]. None takes that of the static record; without one, or where it
        is zero there, the meshes have no back side.
    separates, smoothing
        See `elements.GearMeshes`.

    Raises
    ------
    CaseError
        A static record without the number of its harmonics (E-HARMONICS), values for another number of
        meshes (E-SHAPE).
    """
    made = mesh_elements(stiffness, data.mesh_stiffness, harmonics, orders, record="static record")
    backlash = made.backlash if backlash is None else backlash
    return replace(made, backlash=backlash, separates=separates, smoothing=smoothing)


def mesh_elements(stiffness, mean: np.ndarray, harmonics, orders, *, record: str) -> GearMeshes:
    """Elements on the first columns of ``W``, of mean stiffness where none is given; see `planar_meshes`."""
    columns = np.arange(len(mean))
    if not isinstance(stiffness, MeshExcitation):
        return GearMeshes(columns, constant(mean) if stiffness is None else stiffness)
    if harmonics is None:
        raise CaseError(
            f"the mesh harmonics of the {record} are not said", code="E-HARMONICS", key="harmonics",
            limit="a whole number of 1 or more",
        )  # fmt: skip
    return gear_meshes(stiffness, harmonics=harmonics, columns=columns, orders=orders)


def mesh_directions(data: PlanarSet, flank: int = 1) -> np.ndarray:
    """Mesh columns (3 (N + 3), 2N): approach of the flanks along their line of action.

    Seen from the planet's centre the normal into gear 2 is ``(sin alpha, +- cos alpha)`` radially and
    tangentially, so that with ``flank = 1`` (Lin and Parker's mesh deflections, psi_sn = psi_n - alpha_s and
    psi_rn = psi_n + alpha_r)

    ``delta_sn = y_s cos psi_sn - x_s sin psi_sn - zeta_n sin alpha_s - eta_n cos alpha_s + u_s + u_n``
    ``delta_rn = y_r cos psi_rn - x_r sin psi_rn + zeta_n sin alpha_r - eta_n cos alpha_r + u_r - u_n``
    """
    N, n = data.n_planets, np.arange(data.n_planets)
    W = np.zeros((3 * (N + 3), 2 * N))
    alpha, beta = data.pressure_angle_sun_planet, data.pressure_angle_planet_ring
    sun_normal = np.array([math.sin(alpha), flank * math.cos(alpha)])
    ring_normal = np.array([math.sin(beta), -flank * math.cos(beta)])
    W[6:8, n], W[8, n] = _turned(data, sun_normal), flank
    W[9 + 3 * n, n], W[10 + 3 * n, n], W[11 + 3 * n, n] = *-sun_normal, flank
    W[9 + 3 * n, N + n], W[10 + 3 * n, N + n], W[11 + 3 * n, N + n] = *ring_normal, -flank
    W[3:5, N + n], W[5, N + n] = -_turned(data, ring_normal), flank
    return W


def pin_directions(data: PlanarSet) -> np.ndarray:
    """Bearing columns (3 (N + 3), N, 2): radial and tangential motion of each planet less its pin."""
    N, n = data.n_planets, np.arange(data.n_planets)
    W = np.zeros((3 * (N + 3), N, 2))
    W[:2, :, 0], W[:2, :, 1] = -_turned(data, (1.0, 0.0)), -_turned(data, (0.0, 1.0))
    W[2, :, 1] = -1.0
    W[9 + 3 * n, n, 0] = W[10 + 3 * n, n, 1] = 1.0
    return W


def free_motions(data: PlanarSet) -> np.ndarray:
    """All coordinates (3 (N + 3), n) per unit of those that infinite stiffnesses leave free."""
    N = data.n_planets
    T, pins = np.eye(3 * (N + 3)), pin_directions(data)
    for n in np.flatnonzero(np.isinf(data.planet_bearing)):
        T[9 + 3 * n : 11 + 3 * n, :9] = -pins[:9, n].T
    return T[:, _kept(data)]


def _kept(data: PlanarSet) -> np.ndarray:
    kept = np.ones((data.n_planets + 3, 3), bool)
    for row, name in enumerate(CENTRAL):
        body = getattr(data, name)
        kept[row] = [math.isfinite(body.support)] * 2 + [math.isfinite(body.torsional_support)]
    kept[3:, :2] = np.isfinite(data.planet_bearing)[:, None]
    return kept.ravel()


def _turned(data: PlanarSet, local) -> np.ndarray:
    """x and y (2, N) of a vector given radially and tangentially at every planet."""
    cosine, sine = np.cos(data.planet_angles), np.sin(data.planet_angles)
    return np.array([local[0] * cosine - local[1] * sine, local[0] * sine + local[1] * cosine])


def _gyroscopic(along: np.ndarray) -> np.ndarray:
    """``G`` with ``m (x'' - 2 Omega y' - Omega^2 x)`` and ``m (y'' + 2 Omega x' - Omega^2 y)``."""
    G = np.zeros((len(along), len(along)))
    first = np.arange(0, len(along), 3)
    G[first, first + 1], G[first + 1, first] = -2.0 * along[first], 2.0 * along[first]
    return G


def _linear_stiffness(data: PlanarSet, bearings: Sequence[str]) -> np.ndarray:
    """Supports and planet bearings that are finite and not columns."""
    diagonal = np.zeros((data.n_planets + 3, 3))
    for row, name in enumerate(CENTRAL):
        body, radius = getattr(data, name), member_radius(data, name)
        support = 0.0 if name in bearings else body.support
        diagonal[row] = support, support, body.torsional_support / radius**2
    K = np.diag(np.where(np.isfinite(diagonal), diagonal, 0.0).ravel())
    if "planets" not in bearings:
        pins = pin_directions(data)
        k = np.where(np.isfinite(data.planet_bearing), data.planet_bearing, 0.0)
        K += np.einsum("ina,n,jna->ij", pins, k, pins)
    return K


def _bearing_columns(data: PlanarSet, name: str) -> np.ndarray:
    if name not in (*CENTRAL, "planets"):
        raise CaseError(f"a bearing of {name!r}", code="E-BEARING", limit="carrier, ring, sun, planets")
    stiffness = data.planet_bearing if name == "planets" else getattr(data, name).support
    if np.any(np.isinf(stiffness)):
        raise CaseError(
            f"the bearing of the {name} is infinitely stiff, so it has no deflection", code="E-BEARING",
            remedy="give it a finite stiffness",
        )  # fmt: skip
    if name == "planets":
        return pin_directions(data).reshape(-1, 2 * data.n_planets)
    first = 3 * CENTRAL.index(name)
    return np.eye(3 * (data.n_planets + 3))[:, first : first + 2]


def planar_springs(data: PlanarSet, *, mesh_stiffness=None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the set by name, for `femgear.solvers.linear.tracking.strain_shares`.

    Parameters
    ----------
    data : PlanarSet
    mesh_stiffness : (2N,) array, optional
        [N/m]; that of the set when not given.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Meshes one by one, planet bearings one by one, supports and torsional supports of the central members;
        what is held or free has no spring.
    """
    T, N = free_motions(data), data.n_planets
    k = np.asarray(data.mesh_stiffness if mesh_stiffness is None else mesh_stiffness, float)
    meshes, pins = T.T @ mesh_directions(data), pin_directions(data)
    names = [f"sun-planet {n + 1}" for n in range(N)] + [f"planet {n + 1}-ring" for n in range(N)]
    springs = {name: (meshes[:, [j]], k[[j]]) for j, name in enumerate(names)}
    for n, bearing in enumerate(data.planet_bearing):
        if np.isfinite(bearing):
            springs[f"bearing of planet {n + 1}"] = (T.T @ pins[:, n], np.full(2, bearing))
    for row, name in enumerate(CENTRAL):
        body = getattr(data, name)
        torsion = body.torsional_support / member_radius(data, name) ** 2
        for text, first, stiffness in (
            (f"support of the {name}", 3 * row, np.full(2, body.support)),
            (f"torsional support of the {name}", 3 * row + 2, np.array([torsion])),
        ):
            if np.all(np.isfinite(stiffness)) and np.any(stiffness):
                springs[text] = (T[first : first + len(stiffness)].T, stiffness)
    return springs
