"""Data of planetary sets of rigid bodies: bodies, supports, radii, angles, torques, refusals.

Bodies have up to six motions: along x, y and z, two tilts ``w = r phi`` and the rotation ``u = r theta``.
Those of the planar set move in their plane, those of the helical set in all directions.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NoReturn

import numpy as np

from femgear.errors import CaseError
from femgear.gears.planetary import PlanetarySet

CENTRAL = ("carrier", "ring", "sun")
DIRECTIONS = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "torsional": "N m/rad"}
ROTATIONS = (3, 4, 5)
"""Places of tilts and rotation among the six motions of a body."""


@dataclass(frozen=True)
class PlanarBody:
    """A rigid body in its plane: mass, inertia and supports.

    Parameters
    ----------
    mass : float
        [kg]
    inertia : float
        Polar inertia I about its axis [kg m^2], r^2 times what data give as I / r^2.
    support : float
        Isotropic radial stiffness to the housing [N/m]; infinite holds the axis.
    torsional_support : float
        Against rotation relative to the housing [N m/rad]; infinite holds the body.
    """

    mass: float
    inertia: float
    support: float = 0.0
    torsional_support: float = 0.0

    @property
    def stiffness(self) -> np.ndarray:
        """Of its supports (3,): twice radial [N/m], torsional [N m/rad]."""
        return np.array([self.support, self.support, self.torsional_support], float)

    def masses(self, radius: float) -> list[float]:
        """List m, m and I / r^2 [kg] of x, y and ``u`` on a radius [m]."""
        return [self.mass, self.mass, self.inertia / radius**2]


@dataclass(frozen=True)
class ContactLines:
    """Where and along which lines the flanks of rigid gears touch.

    Parameters
    ----------
    base_helix_angle : float
        Angle of the tooth normals to the transverse section [rad].
    heights : tuple of float
        Of the slices above mid-face [m].
    on_base_circles : bool
        Forces act where the line of action touches the base circle of each gear, else at the pitch point.
    """

    base_helix_angle: float = 0.0
    heights: tuple[float, ...] = (0.0,)
    on_base_circles: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidSet(ABC):
    """Rigid bodies, the geometry of their gears and the stiffness of their meshes.

    A kind of set says which of the six motions its bodies have (``axes``); ``meshes_optional`` allows meshes
    without stiffness.

    CaseError: numbers that no set can have, planet angles that are none, unordered or span more than a turn
    (E-RANGE).

    Parameters
    ----------
    sun, ring, carrier : PlanarBody or HelicalBody
        Central bodies, with their supports.
    planet : PlanarBody or HelicalBody
        Each of the N equal planets; it has no supports but its bearing.
    sun_radius, ring_radius, planet_radius : float
        Base radii [m].
    centre_distance : float
        Radius of the circle of planet centres [m].
    planet_angles : (N,) array
        psi_n [rad], ascending within one turn, counter-clockwise from the x axis.
    pressure_angle_sun_planet, pressure_angle_planet_ring : float
        Working pressure angles in the transverse section [rad].
    stiffness_sun_planet, stiffness_planet_ring : float or (N,) array
        Mean stiffnesses of the whole meshes along the tooth normals [N/m].
    """

    axes: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4, 5)
    meshes_optional: ClassVar[bool] = True

    sun: PlanarBody | HelicalBody
    ring: PlanarBody | HelicalBody
    carrier: PlanarBody | HelicalBody
    planet: PlanarBody | HelicalBody
    sun_radius: float
    ring_radius: float
    planet_radius: float
    centre_distance: float
    planet_angles: Sequence[float] | np.ndarray
    pressure_angle_sun_planet: float
    pressure_angle_planet_ring: float
    stiffness_sun_planet: float | np.ndarray
    stiffness_planet_ring: float | np.ndarray

    def __post_init__(self):
        self._keep("planet_angles", np.atleast_1d(checked_array("planet_angles", self.planet_angles)))
        for name in ("stiffness_sun_planet", "stiffness_planet_ring"):
            self._keep(name, self._per_planet(name))
        for name in (*CENTRAL, "planet"):
            _check_body(name, getattr(self, name))
        check_rigid_set(self)

    @property
    def n_planets(self) -> int:
        """Number N of planets."""
        return len(self.planet_angles)

    @property
    def angles(self) -> np.ndarray:
        """psi_n (N,) [rad]."""
        return np.asarray(self.planet_angles)

    @property
    def radii(self) -> np.ndarray:
        """Radius r (N + 3,) of ``u = r theta`` of carrier, ring, sun and planets [m]."""
        return np.array([member_radius(self, name) for name in CENTRAL] + [self.planet_radius] * self.n_planets)

    @property
    def mesh_stiffness(self) -> np.ndarray:
        """Mean stiffnesses (2N,) of the meshes [N/m]."""
        return np.concatenate([np.asarray(self.stiffness_sun_planet), np.asarray(self.stiffness_planet_ring)])

    @property
    def column_stiffness(self) -> np.ndarray:
        """Mean stiffnesses (n_columns,) of the mesh columns of ``W`` [N/m]."""
        return self.mesh_stiffness

    @property
    def support_stiffness(self) -> np.ndarray:
        """Of carrier, ring and sun in all their motions (3, axes) [N/m, N m/rad]."""
        return np.stack([getattr(self, name).stiffness for name in CENTRAL])

    @property
    @abstractmethod
    def pin_stiffness(self) -> np.ndarray:
        """Of the planet bearings (N, d) in the first d motions of a planet [N/m, N m/rad]."""

    @property
    def contact_lines(self) -> ContactLines:
        """Where and along which lines the flanks touch."""
        return ContactLines()

    @property
    def closure(self) -> tuple[float, float]:
        """``(r_s + r_p) / (a cos alpha_sp) - 1`` and ``(r_r - r_p) / (a cos alpha_pr) - 1``.

        Zero where radii, centre distance and pressure angles belong to one set of gears.
        """
        a = self.centre_distance
        return (
            (self.sun_radius + self.planet_radius) / (a * math.cos(self.pressure_angle_sun_planet)) - 1.0,
            (self.ring_radius - self.planet_radius) / (a * math.cos(self.pressure_angle_planet_ring)) - 1.0,
        )

    def _keep(self, name: str, array: np.ndarray) -> None:
        array.setflags(write=False)
        object.__setattr__(self, name, array)

    def _per_planet(self, name: str) -> np.ndarray:
        """Values (N,) from one number or one a planet."""
        values = checked_array(name, getattr(self, name))
        values = np.full(self.n_planets, values.item()) if values.size == 1 else values
        if values.shape != (self.n_planets,):
            refuse(name, f"{values.size} values", "", f"one number, or {self.n_planets}")
        return values


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarSet(RigidSet):
    """Data of the lumped set; bodies, radii, angles and mesh stiffnesses as in `RigidSet`.

    ``planet_bearing`` is the isotropic stiffness between planet and carrier, a number or an (N,) array [N/m];
    infinite fixes the planet's axis to its pin. Published data are often rounded, or mix reference and
    working angles: radii that do not close are taken as they are, and `closure` tells by how much.
    """

    axes: ClassVar[tuple[int, ...]] = (0, 1, 5)
    meshes_optional: ClassVar[bool] = False

    planet_bearing: float | np.ndarray

    def __post_init__(self):
        super().__post_init__()
        self._keep("planet_bearing", self._per_planet("planet_bearing"))
        wrong = ~(self.pin_stiffness > 0.0)
        if np.any(wrong):
            refuse("planet_bearing", self.pin_stiffness[wrong][0], "N/m", "above 0, or infinite")

    @property
    def pin_stiffness(self) -> np.ndarray:
        """Of the planet bearings, (N, 2): radial and tangential [N/m]."""
        return np.repeat(np.asarray(self.planet_bearing)[:, None], 2, axis=1)


@dataclass(frozen=True)
class PlanarTorque:
    """External torque that drives the set.

    Parameters
    ----------
    torque : float
        On `member` [N m], positive counter-clockwise.
    member : {"sun", "carrier", "ring"}
        Member on which the torque acts.
    output : {"sun", "carrier", "ring"}, optional
        Member on which an external torque reacts, by the balance of `torque_shares`; with None the
        torsional supports carry everything.
    """

    torque: float
    member: str = "sun"
    output: str | None = "carrier"

    def __post_init__(self):
        if self.member not in CENTRAL or self.output not in (*CENTRAL, None) or self.member == self.output:
            raise CaseError(
                f"a torque on {self.member!r} that reacts on {self.output!r}",
                code="E-MECHANISM",
                limit="two of sun, carrier and ring",
            )
        if not math.isfinite(self.torque):
            raise CaseError(f"a torque of {self.torque} N m", code="E-RANGE", limit="finite")


@dataclass(frozen=True, eq=False)
class HelicalSupport:
    """Isotropic support of a body in all six directions; infinite holds a motion, zero leaves it free.

    Numbers or, as `HelicalSet.planet_bearing`, arrays of the planets: ``radial`` (N,) and ``axial`` (N,) [N/m],
    ``tilt`` (N,) about the two axes in the plane and ``torsional`` (N,) about the axis of the body [N m/rad].

    CaseError: stiffnesses that are no numbers, negative or NaN (E-RANGE).
    """

    radial: float | np.ndarray = 0.0
    axial: float | np.ndarray = 0.0
    tilt: float | np.ndarray = 0.0
    torsional: float | np.ndarray = 0.0

    def __post_init__(self):
        check_support("support", self)

    @property
    def stiffness(self) -> np.ndarray:
        """Of the directions, (6,) or (N, 6): two radial, axial [N/m], two tilts, torsional [N m/rad]."""
        r, z, w, u = np.broadcast_arrays(self.radial, self.axial, self.tilt, self.torsional)
        return np.stack([r, r, z, w, w, u], axis=-1).astype(float)


@dataclass(frozen=True)
class HelicalBody:
    """A rigid body in space: mass, inertias and supports.

    CaseError: mass or inertias that are not finite and above 0 (E-RANGE).

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
    """

    mass: float
    inertia: float
    diametral_inertia: float
    support: HelicalSupport = field(default_factory=HelicalSupport)

    def __post_init__(self):
        _check_body("body", self)

    @property
    def stiffness(self) -> np.ndarray:
        """Of its support (6,): twice radial, axial [N/m], two tilts, torsional [N m/rad]."""
        return self.support.stiffness

    def masses(self, radius: float) -> list[float]:
        """List m three times, I / r^2 twice and J / r^2 [kg] of the six motions on a radius [m]."""
        diametral, polar = self.diametral_inertia / radius**2, self.inertia / radius**2
        return [self.mass, self.mass, self.mass, diametral, diametral, polar]


def planar_from_set(planetary_set: PlanetarySet, **data: object) -> PlanarSet:
    """Make a planar set with the base radii, working pressure angles and planet angles of a geared one.

    ``data`` are the bodies, mesh stiffnesses and planet bearing of `PlanarSet`.
    """
    return PlanarSet(**data, **gear_geometry(planetary_set))


def gear_geometry(s: PlanetarySet) -> dict[str, Any]:
    """Collect base radii, centre distance [m], planet and working pressure angles [rad] for a `RigidSet`."""
    return {
        "sun_radius": s.sun.base_radius,
        "ring_radius": s.ring.base_radius,
        "planet_radius": s.planet.base_radius,
        "centre_distance": s.centre_distance,
        "planet_angles": s.planet_angles,
        "pressure_angle_sun_planet": s.working_pressure_angle_sun_planet,
        "pressure_angle_planet_ring": s.working_pressure_angle_planet_ring,
    }


def torque_shares(data: RigidSet) -> dict[str, float]:
    """Compute the forces on ``u`` of the members in static balance, over that on the sun.

    Power balance over the rotations that strain no mesh, ``u_s + u_r = (cos alpha_sp + cos alpha_pr) u_c``
    (add the deflections of both meshes of one planet). With radii that close these are the torques of
    Willis, ``T_s : T_r : T_c = 1 : z_r/z_s : -(1 + z_r/z_s)``.
    """
    both = math.cos(data.pressure_angle_sun_planet) + math.cos(data.pressure_angle_planet_ring)
    return {"sun": 1.0, "ring": 1.0, "carrier": -both}


def torque_load(data: RigidSet, torque: PlanarTorque | None, kept: np.ndarray) -> np.ndarray:
    """Compute the load (n,) [N] on ``u`` of the driven member and the output, balanced by `torque_shares`.

    ``kept`` (n,) are the coordinates that no infinite stiffness holds; as many a body, ``u`` being the last.
    A torque on a held member is refused (CaseError, E-MECHANISM).
    """
    load, kept = np.zeros(kept.size), kept.reshape(data.n_planets + 3, -1)
    if torque is None:
        return load
    if not kept[CENTRAL.index(torque.member), -1]:
        raise CaseError(
            f"the torque acts on the {torque.member}, which is held",
            code="E-MECHANISM",
            remedy="drive a member that can turn",
        )
    shares = torque_shares(data)
    on_sun = torque.torque / member_radius(data, torque.member) / shares[torque.member]
    for member in (torque.member, torque.output):
        if member is not None:
            load[kept.shape[1] * (CENTRAL.index(member) + 1) - 1] = on_sun * shares[member]
    return load


def flank_sign(data: RigidSet, torque: PlanarTorque | None) -> int:
    """Tell the loaded flanks: 1 for those of a sun that drives counter-clockwise, else -1."""
    if torque is None:
        return 1
    return -1 if torque.torque * torque_shares(data)[torque.member] < 0.0 else 1


def member_radius(data: RigidSet, member: str) -> float:
    """Return the radius [m] of ``u = r theta`` of the carrier, ring or sun."""
    return data.centre_distance if member == "carrier" else getattr(data, f"{member}_radius")


def body_masses(data: RigidSet) -> np.ndarray:
    """Collect masses and reduced inertias (N + 3, axes) [kg] of carrier, ring, sun and planets."""
    bodies = [getattr(data, name) for name in CENTRAL] + [data.planet] * data.n_planets
    return np.array([body.masses(radius) for body, radius in zip(bodies, data.radii.tolist())])


def check_rigid_set(data: RigidSet) -> None:
    """Refuse radii, pressure angles, mesh stiffnesses and planet angles."""
    for name in ("sun_radius", "ring_radius", "planet_radius", "centre_distance"):
        _check_positive(name, getattr(data, name), "m")
    for name in ("pressure_angle_sun_planet", "pressure_angle_planet_ring"):
        value = checked_array(name, getattr(data, name), 0)
        if not 0.0 < value < 0.5 * math.pi:
            refuse(name, value, "rad", "between 0 and pi/2", remedy="give radians")
    limit = "finite, 0 or more" if data.meshes_optional else "finite and above 0"
    for name in ("stiffness_sun_planet", "stiffness_planet_ring"):
        values = getattr(data, name)
        wrong = ~np.isfinite(values) | ~((values >= 0.0) if data.meshes_optional else (values > 0.0))
        if np.any(wrong):
            refuse(name, values[wrong][0], "N/m", limit)
    psi, allowed = data.angles, "one or more, finite, ascending, within one turn"
    if not psi.size or psi.ndim != 1 or not np.all(np.isfinite(psi)):
        refuse("planet_angles", psi.tolist(), "rad", allowed)
    if np.any(np.diff(psi) < 1e-9) or np.ptp(psi) > 2.0 * math.pi - 1e-9:
        remedy = "give radians, in ascending order"
        refuse("planet_angles", psi.tolist(), "rad", allowed, remedy=remedy)


def _check_body(name: str, body: PlanarBody | HelicalBody) -> None:
    """Refuse a mass, inertia or support."""
    for entry, unit in (("mass", "kg"), ("inertia", "kg m^2"), ("diametral_inertia", "kg m^2")):
        if hasattr(body, entry):
            _check_positive(f"{name}.{entry}", getattr(body, entry), unit)
    remedy = "give planet_bearing of the set"
    if isinstance(body, HelicalBody):
        check_support(f"{name}.support", body.support, count=0)
        if name == "planet" and np.any(body.support.stiffness):
            refuse("planet.support", "a planet", "", "none", remedy=remedy)
        return
    for entry, unit in (("support", "N/m"), ("torsional_support", "N m/rad")):
        value = checked_array(f"{name}.{entry}", getattr(body, entry), 0)
        if not value >= 0.0:
            refuse(f"{name}.{entry}", value, unit, "0 or more, or infinite")
        if name == "planet" and value:
            refuse(f"planet.{entry}", value, unit, "0", remedy=remedy)


def check_support(key: str, support: HelicalSupport, *, count: int | None = None) -> None:
    """Refuse stiffnesses of a support (E-RANGE): of `count` planets, of one body (0), of either (None)."""
    allowed = f"one number, or {count}" if count else "one number"
    # what is no support has none of its stiffnesses
    if not all(hasattr(support, entry) for entry in DIRECTIONS):
        refuse(key, repr(support), "", "a HelicalSupport")
    for entry, unit in DIRECTIONS.items():
        values = checked_array(f"{key}.{entry}", getattr(support, entry))
        if count is not None and values.ndim and values.shape != (count,):
            refuse(f"{key}.{entry}", f"{values.size} values", "", allowed)
        if not np.all(values >= 0.0):
            refuse(f"{key}.{entry}", values.min(), unit, "0 or more, or infinite")


def checked_array(key: str, values, dimensions: int | None = None) -> np.ndarray:
    """Make an array (...) of floats of the values, and check the number of its dimensions where it is given."""
    try:
        array = np.array(values, float)
    except (TypeError, ValueError):
        refuse(key, repr(values), "", "a number" if dimensions == 0 else "numbers")
    if dimensions is not None and array.ndim != dimensions:
        refuse(key, f"{array.size} values", "", "one number")
    return array


def refuse(key: str, value, unit: str, limit: str, *, remedy: str | None = None) -> NoReturn:
    """Refuse an entry of a set, such as ``planet.mass``, with its value and what is allowed."""
    raise CaseError(
        f"{key.replace('_', ' ').replace('.', ': ')} of {value} {unit}".rstrip(),
        code="E-RANGE",
        key=key,
        value=value,
        limit=limit,
        remedy=remedy,
    )


def _check_positive(key: str, value, unit: str) -> None:
    number = checked_array(key, value, 0)
    if not (math.isfinite(number) and number > 0.0):
        refuse(key, value, unit, "finite and above 0")
