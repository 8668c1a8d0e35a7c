"""Directions of meshes and springs of planetary sets of rigid bodies, and the matrices assembled from them.

Carrier, ring, sun and N planets move along x, y and z, tilt by ``w = r phi`` and turn by ``u = r theta``, in
the order and with the signs of J. Lin and R. G. Parker, J. Vib. Acoust. 121, 1999, 316-321: x and y of the
central members in a frame that turns with the carrier, planets radially outwards and tangentially (their zeta
and eta), all rotations right-handed; r is the base radius of the gears and the radius of the circle of planet
centres for the carrier. A kind of set has the motions `RigidSet.axes` of these: three in the plane, or all
six as in A. Kahraman, J. Mech. Des. 116, 1994, 713-720. The equation of motion in the plane is

``M q'' + Omega G q' + [K_b + K_m - Omega^2 K_Omega] q = T + F``

with the matrices printed in the appendix of Lin and Parker. Here bodies, supports, pins and meshes are those of
`femgear.system.assembly` (`set_assembly`), in these coordinates (`station_motions`); the meshes stay columns of W.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.fe.beam import body_matrices
from femgear.gears.kinematics import across, unit_vectors
from femgear.system.assembly import (
    GROUND,
    Assembly,
    Inertia,
    StationSprings,
    assemble,
    held_motions,
    joint,
    planetary_contacts,
)
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


def gear_set_system(
    data: RigidSet,
    *,
    torque: PlanarTorque | None = None,
    carrier_speed: float = 0.0,
    back_flanks: bool = False,
    planet_bearings: bool = False,
    friction: bool = False,
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

    friction : bool
        Gives sources for the friction of the flanks, `friction_directions`, and for what is lost at the output.

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
    masses, whole, motions = body_masses(data), set_assembly(data, flank), station_motions(data)
    columns = [motions.T @ whole.columns]
    if back_flanks:
        columns.append(mesh_directions(data, -flank))
    if planet_bearings:
        columns.append(pin_directions(data)[..., :2].reshape(kept.size, -1))
        whole = replace(whole, springs=tuple(spring for spring in whole.springs if GROUND in spring.stations))
    stiffness, load = motions.T @ whole.stiffness @ motions, torque_load(data, torque, kept)
    gyroscopic = None
    if carrier_speed:
        # the translational part is the K_Omega of Lin and Parker
        along = (masses * ~_turning(data)).ravel()
        stiffness -= carrier_speed**2 * np.diag(along)
        load[9::3] += carrier_speed**2 * data.planet.mass * data.centre_distance
        gyroscopic = _gyroscopic(along)
    system = assemble(
        masses.ravel(),
        stiffness,
        np.hstack(columns),
        load,
        motions=T,
        dofs=np.array(dof_names(data))[kept].tolist(),
        gyroscopic=gyroscopic,
    )
    if not friction:
        return system
    taken = np.zeros(kept.size)
    if torque is not None and torque.output is not None:
        taken[len(data.axes) * (CENTRAL.index(torque.output) + 1) - 1] = 1.0
    return replace(system, sources=T.T @ np.column_stack([friction_directions(data, flank), taken]))


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


def set_assembly(data: RigidSet, flank: int = 1) -> Assembly:
    """Make the stations of carrier, ring, sun and planets, their supports, pins and meshes.

    A flank of 1 is that of a sun that drives counter-clockwise, else -1. Motions that are none of ``data.axes`` are
    held; infinite stiffnesses are conditions. Planets move along their own axes: radial, tangential, axial.
    """
    N, directions = data.n_planets, planet_directions(data)
    bodies = [*((name, getattr(data, name)) for name in CENTRAL), *((f"planet {n + 1}", data.planet) for n in range(N))]
    places = np.zeros((N + 3, 3))
    places[3:] = data.centre_distance * directions[:, 0]
    inertias, springs = list[Inertia](), list[StationSprings]()
    for station, (_, body) in enumerate(bodies):
        across = getattr(body, "diametral_inertia", 0.5 * body.inertia)
        inertias.append(Inertia((station,), *body_matrices(body.mass, body.inertia, across)))
    axes = list(data.axes)
    for station, (name, support) in enumerate(zip(CENTRAL, data.support_stiffness, strict=True)):
        stiffness = np.zeros(6)
        stiffness[axes] = support
        springs.append(joint(f"support of {name}", (GROUND, station), (np.zeros(3), np.zeros(3)), stiffness))
    springs += [_pin(data, n, stiffness, directions[n]) for n, stiffness in enumerate(data.pin_stiffness)]
    lines, of_planet = data.contact_lines, np.tile([1.0, 0.0], (N, 1))
    contacts = planetary_contacts(
        (CENTRAL.index("sun"), range(3, N + 3), CENTRAL.index("ring")),
        np.stack([directions[:, 0, :2], of_planet], axis=1),
        (data.sun_radius, data.planet_radius, data.ring_radius),
        (data.pressure_angle_sun_planet, data.pressure_angle_planet_ring),
        flank=flank,
        base_helix=lines.base_helix_angle,
        heights=lines.heights,
        stiffness=(np.asarray(data.stiffness_sun_planet).tolist(), np.asarray(data.stiffness_planet_ring).tolist()),
        on_base_circles=lines.on_base_circles,
    )
    names = tuple(name for name, _ in bodies)
    return Assembly(names, places, held_motions(N + 3, axes), tuple(inertias), (), tuple(springs), tuple(contacts))


def planet_directions(data: RigidSet) -> np.ndarray:
    """Compute the radial, tangential and axial unit vectors (N, 3, 3) of every planet, one a row."""
    directions = np.zeros((data.n_planets, 3, 3))
    directions[:, 0, :2] = unit_vectors(data.angles)
    directions[:, 1, :2] = across(directions[:, 0, :2])
    directions[:, 2, 2] = 1.0
    return directions


def _pin(data: RigidSet, planet: int, stiffness, directions: np.ndarray) -> StationSprings:
    """Springs of a planet bearing along the axes of its planet, rows of ``directions`` (3, 3), planet less pin."""
    wanted = np.zeros(6)
    wanted[: len(stiffness)] = stiffness
    offsets, axes = (data.centre_distance * directions[0], np.zeros(3)), np.stack([directions, np.eye(3)])
    return joint(f"pin {planet + 1}", (CENTRAL.index("carrier"), 3 + planet), offsets, wanted, axes=axes)


def station_motions(data: RigidSet) -> np.ndarray:
    """Compute the motions (6 (N + 3), n) of all stations [m, rad] per unit of the coordinates of a set.

    Each of the n columns has the motions x, y, z and rotations of every station, (N + 3, 6). Arcs ``w`` and ``u``
    are on the radius of the body.
    """
    scale = np.ones((data.n_planets + 3, 6))
    scale[:, 3:] = 1.0 / data.radii[:, None]
    return np.diag(scale.ravel())[:, np.tile(np.isin(np.arange(6), data.axes), data.n_planets + 3)]


def mesh_directions(data: RigidSet, flank: int = 1) -> np.ndarray:
    """Make the mesh columns (n, 2N S): approach of the flanks [m] per unit of the coordinates.

    Along the common normal, of S slices each, n in all coordinates; see `femgear.system.assembly.Contact`.

    Seen from the planet's centre the normal is ``(sin alpha cos beta_b, +- cos alpha cos beta_b, - sin beta_b)``
    radially, tangentially and axially for the flanks of a sun that drives counter-clockwise (`flank` = 1, else -1).
    The rotation about the own axis gives ``+- u cos beta_b``. Forces on base circles give a sun and one planet the
    mesh deflection of the helical pair of M. Kubur et al., J. Mech. Des. 126, 2004, 398-406. In the plane these
    are Lin and Parker's mesh deflections, psi_sn = psi_n - alpha_s and psi_rn = psi_n + alpha_r:

    ``delta_sn = y_s cos psi_sn - x_s sin psi_sn - zeta_n sin alpha_s - eta_n cos alpha_s + u_s + u_n``
    ``delta_rn = y_r cos psi_rn - x_r sin psi_rn + zeta_n sin alpha_r - eta_n cos alpha_r + u_r - u_n``
    """
    return station_motions(data).T @ set_assembly(data, flank).columns


def friction_directions(data: RigidSet, flank: int = 1) -> np.ndarray:
    """Make the directions (n, 4N S) of friction along the flanks of all slices, then of its moments.

    In all coordinates, see `femgear.system.assembly.Assembly.sliding_columns`.
    """
    return station_motions(data).T @ set_assembly(data, flank).sliding_columns


def pin_directions(data: RigidSet) -> np.ndarray:
    """Make the bearing columns (n, N, d): motion of each planet less that of its pin, as `pin_stiffness`.

    Radial and tangential, of bodies in space also axial [m], tilt about the radial and the tangential axis
    and rotation [rad]. A carrier that tilts by phi moves the pin along z by ``phi x a e_n``.
    """
    N, d = data.pin_stiffness.shape
    columns = np.zeros((6 * (N + 3), N, d))
    for n, directions in enumerate(planet_directions(data)):
        pin = _pin(data, n, np.ones(d), directions)
        at = np.concatenate([6 * station + np.arange(6) for station in pin.stations])
        columns[at, n] = pin.rows.T
    return np.tensordot(station_motions(data), columns, axes=(0, 0))


def free_motions(data: RigidSet) -> np.ndarray:
    """Make all coordinates (n_all, n) per unit of those that infinite stiffnesses leave free."""
    axes, rigid = len(data.axes), np.isinf(data.pin_stiffness)
    T, central = np.eye(axes * (data.n_planets + 3)), 3 * axes
    pins = pin_directions(data) if rigid.any() else np.zeros(0)
    for n, axis in zip(*np.nonzero(rigid)):
        row = central + axes * n + axis
        T[row, :central] = -pins[:central, n, axis] / pins[row, n, axis]
    return T[:, _kept(data)]


def support_diagonal(data: RigidSet) -> np.ndarray:
    """Collect the finite stiffnesses (N + 3, axes) [N/m] of the supports in all coordinates."""
    whole = set_assembly(data)
    supports = replace(whole, springs=tuple(spring for spring in whole.springs if GROUND in spring.stations))
    motions = station_motions(data)
    return np.diag(motions.T @ supports.stiffness @ motions).reshape(data.n_planets + 3, -1)


def _turning(data: RigidSet) -> np.ndarray:
    """Whether the motions (axes,) of a body are rotations."""
    return np.isin(data.axes, ROTATIONS)


def _kept(data: RigidSet) -> np.ndarray:
    """Whether every coordinate is free of infinite stiffnesses."""
    planets = np.ones((data.n_planets, len(data.axes)), bool)
    planets[:, : data.pin_stiffness.shape[1]] = np.isfinite(data.pin_stiffness)
    return np.concatenate([np.isfinite(data.support_stiffness), planets]).ravel()


def _gyroscopic(along: np.ndarray) -> np.ndarray:
    """``G`` with ``m (x'' - 2 Omega y' - Omega^2 x)`` and ``m (y'' + 2 Omega x' - Omega^2 y)``."""
    G = np.zeros((len(along), len(along)))
    first = np.arange(0, len(along), 3)
    G[first, first + 1], G[first + 1, first] = -2.0 * along[first], 2.0 * along[first]
    return G
