"""Data of planetary sets of rigid bodies: bodies, supports, radii, angles, torques, refusals.

The planar set moves in its plane (E-PLANAR), helical bodies in all six directions (E-HELICAL).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

CENTRAL = ("carrier", "ring", "sun")
DIRECTIONS = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "torsional": "N m/rad"}


@dataclass(frozen=True)
class PlanarBody:
    """A rigid body.

    Parameters
    ----------
    mass : float
        [kg]
    inertia : float
        Polar inertia I about its axis [kg m^2]; `inertia_of_reduced` for data given as I / r^2.
    support : float
        Isotropic radial stiffness to the housing [N/m]; infinite holds the axis.
    torsional_support : float
        Against rotation relative to the housing [N m/rad]; infinite holds the body.
    """

    mass: float
    inertia: float
    support: float = 0.0
    torsional_support: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class RigidSet:
    """Rigid bodies, the geometry of their gears and the stiffness of their meshes.

    Parameters
    ----------
    sun, ring, carrier : PlanarBody or HelicalBody
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

    @property
    def n_planets(self) -> int:
        return len(self.planet_angles)

    @property
    def mesh_stiffness(self) -> np.ndarray:
        """Mean stiffness of the 2N meshes [N/m]."""
        return np.concatenate([self.stiffness_sun_planet, self.stiffness_planet_ring])

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


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarSet(RigidSet):
    """Data of the lumped set; bodies, radii, angles and mesh stiffnesses as in `RigidSet`.

    Parameters
    ----------
    planet_bearing : float or (N,) array
        Isotropic stiffness between planet and carrier [N/m]; infinite fixes the planet's axis to its pin.

    Raises
    ------
    CaseError
        Numbers that no set can have (E-PLANAR), planet angles that are none, unordered or span more than a
        turn (E-PLANAR).

    Notes
    -----
    Published data are often rounded, or mix reference and working angles: radii that do not close are
    taken as they are, and `closure` tells by how much.
    """

    planet_bearing: float | np.ndarray

    def __post_init__(self):
        angles = np.atleast_1d(np.array(self.planet_angles, float))
        per_planet = ("stiffness_sun_planet", "stiffness_planet_ring", "planet_bearing")
        arrays = {"planet_angles": angles} | {
            name: np.array(getattr(self, name), float) * np.ones(1) for name in per_planet
        }
        for name in per_planet:
            if len(arrays[name]) == 1:
                arrays[name] = np.full(len(angles), arrays[name][0])
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        for name in (*CENTRAL, "planet"):
            check_body(name, getattr(self, name))
        check_set(self)


@dataclass(frozen=True)
class PlanarTorque:
    """External torque that drives the set.

    Parameters
    ----------
    torque : float
        On `member` [N m], positive counter-clockwise.
    member : {"sun", "carrier", "ring"}
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
                f"a torque on {self.member!r} that reacts on {self.output!r}", code="E-MECHANISM",
                limit="two of sun, carrier and ring",
            )  # fmt: skip
        if not math.isfinite(self.torque):
            raise CaseError(f"a torque of {self.torque} N m", code="E-VALUE", limit="finite")


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
        check_helical_body("body", self)


def planar_from_set(
    planetary_set: PlanetarySet,
    *,
    sun: PlanarBody,
    ring: PlanarBody,
    carrier: PlanarBody,
    planet: PlanarBody,
    stiffness_sun_planet,
    stiffness_planet_ring,
    planet_bearing,
) -> PlanarSet:
    """Lumped set with the base radii, working pressure angles and planet angles of a geared one.

    Parameters
    ----------
    planetary_set : PlanetarySet
    sun, ring, carrier, planet, stiffness_sun_planet, stiffness_planet_ring, planet_bearing
        See `PlanarSet`.
    """
    return PlanarSet(
        sun=sun,
        ring=ring,
        carrier=carrier,
        planet=planet,
        stiffness_sun_planet=stiffness_sun_planet,
        stiffness_planet_ring=stiffness_planet_ring,
        planet_bearing=planet_bearing,
        **gear_geometry(planetary_set),
    )


def gear_geometry(s: PlanetarySet) -> dict[str, float | np.ndarray]:
    """Base radii, centre distance, planet angles and working pressure angles of a `RigidSet`."""
    return {
        "sun_radius": s.sun.base_radius,
        "ring_radius": s.ring.base_radius,
        "planet_radius": s.planet.base_radius,
        "centre_distance": s.centre_distance,
        "planet_angles": s.planet_angles,
        "pressure_angle_sun_planet": s.working_pressure_angle_sun_planet,
        "pressure_angle_planet_ring": s.working_pressure_angle_planet_ring,
    }


def torsional_set(data: PlanarSet) -> PlanarSet:
    """The same set with all axes held: N + 3 rotations (A. Kahraman, J. Sound Vib. 173, 1994, 125-130).

    The planets' axes are then fixed to the carrier, whose rotation carries their mass.
    """
    held = {name: replace(getattr(data, name), support=math.inf) for name in CENTRAL}
    return replace(data, planet_bearing=math.inf, **held)


def torque_shares(data: RigidSet) -> dict[str, float]:
    """Forces on ``u`` of the members in static balance, that on the sun being one.

    Power balance over the rotations that strain no mesh, ``u_s + u_r = (cos alpha_sp + cos alpha_pr) u_c``
    (add the deflections of both meshes of one planet). With radii that close these are the torques of
    Willis, ``T_s : T_r : T_c = 1 : z_r/z_s : -(1 + z_r/z_s)``.
    """
    both = math.cos(data.pressure_angle_sun_planet) + math.cos(data.pressure_angle_planet_ring)
    return {"sun": 1.0, "ring": 1.0, "carrier": -both}


def torque_load(data: RigidSet, torque: PlanarTorque | None, kept: np.ndarray) -> np.ndarray:
    """Forces on ``u`` of the driven member and the output, in static balance by `torque_shares`.

    Parameters
    ----------
    data : RigidSet
    torque : PlanarTorque, optional
    kept : (n,) bool array
        Coordinates that no infinite stiffness holds; as many a body, ``u`` being the last.

    Raises
    ------
    CaseError
        A torque on a held member (E-MECHANISM).
    """
    load, kept = np.zeros(kept.size), kept.reshape(data.n_planets + 3, -1)
    if torque is None:
        return load
    if not kept[CENTRAL.index(torque.member), -1]:
        raise CaseError(
            f"the torque acts on the {torque.member}, which is held", code="E-MECHANISM",
            remedy="drive a member that can turn",
        )  # fmt: skip
    shares = torque_shares(data)
    on_sun = torque.torque / member_radius(data, torque.member) / shares[torque.member]
    for member in (torque.member, torque.output):
        if member is not None:
            load[kept.shape[1] * (CENTRAL.index(member) + 1) - 1] = on_sun * shares[member]
    return load


def flank_sign(data: RigidSet, torque: PlanarTorque | None) -> int:
    """1 where the loaded flanks are those of a sun that drives counter-clockwise, else -1."""
    if torque is None:
        return 1
    return -1 if torque.torque * torque_shares(data)[torque.member] < 0.0 else 1


def member_radius(data: RigidSet, member: str) -> float:
    """Radius [m] of ``u = r theta`` of the carrier, ring or sun."""
    return data.centre_distance if member == "carrier" else getattr(data, f"{member}_radius")


def body_masses(data: PlanarSet) -> np.ndarray:
    """Mass, mass and ``I / r^2`` (N + 3, 3) [kg] of carrier, ring, sun and planets."""
    bodies = [(getattr(data, name), member_radius(data, name)) for name in CENTRAL]
    bodies += [(data.planet, data.planet_radius)] * data.n_planets
    return np.array([(body.mass, body.mass, body.inertia / r**2) for body, r in bodies])


def inertia_of_reduced(reduced: float, radius: float) -> float:
    """Polar inertia [kg m^2] of ``I / r^2`` [kg] at the radius [m] of ``u = r theta``."""
    return reduced * radius**2


def torsional_of_reduced(stiffness: float, radius: float) -> float:
    """Torsional stiffness [N m/rad] of a stiffness ``k_u`` [N/m] that acts on ``u = r theta``."""
    return stiffness * radius**2


def check_set(data: PlanarSet) -> None:
    """Refuse radii, angles and stiffnesses (E-PLANAR)."""
    for name in ("sun_radius", "ring_radius", "planet_radius", "centre_distance"):
        value = getattr(data, name)
        if not (math.isfinite(value) and value > 0.0):
            _refuse_planar(name, value, "m", "finite and above 0")
    for name in ("pressure_angle_sun_planet", "pressure_angle_planet_ring"):
        value = getattr(data, name)
        if not 0.0 < value < 0.5 * math.pi:
            _refuse_planar(name, value, "rad", "between 0 and pi/2", remedy="give radians")
    for name in ("stiffness_sun_planet", "stiffness_planet_ring", "planet_bearing"):
        values, allowed = getattr(data, name), "finite and above 0"
        wrong = ~np.isfinite(values) | ~(values > 0.0)
        if name == "planet_bearing":
            allowed, wrong = "above 0, or infinite", ~(values > 0.0)
        if len(values) != data.n_planets:
            _refuse_planar(name, f"{len(values)} values", "", f"one number, or {data.n_planets}")
        if np.any(wrong):
            _refuse_planar(name, values[wrong][0], "N/m", allowed)
    check_angles(data.planet_angles, code="E-PLANAR")


def check_body(name: str, body: PlanarBody) -> None:
    """Refuse a mass, inertia or support (E-PLANAR)."""
    for entry, unit in (("mass", "kg"), ("inertia", "kg m^2")):
        value = getattr(body, entry)
        if not (math.isfinite(value) and value > 0.0):
            _refuse_planar(f"{name}.{entry}", value, unit, "finite and above 0")
    for entry, unit in (("support", "N/m"), ("torsional_support", "N m/rad")):
        value = getattr(body, entry)
        if not value >= 0.0:
            _refuse_planar(f"{name}.{entry}", value, unit, "0 or more, or infinite")
        if name == "planet" and value:
            _refuse_planar(f"planet.{entry}", value, unit, "0", remedy="give planet_bearing of the set")


def check_angles(angles: np.ndarray, *, code: str) -> None:
    """Refuse planet angles that are none, unordered or span more than a turn."""
    allowed = "one or more, finite, ascending, within one turn"
    if not angles.size or angles.ndim != 1 or not np.all(np.isfinite(angles)):
        refuse("planet_angles", angles.tolist(), "rad", allowed, code=code)
    if np.any(np.diff(angles) < 1e-9) or np.ptp(angles) > 2.0 * math.pi - 1e-9:
        remedy = "give radians, in ascending order"
        refuse("planet_angles", angles.tolist(), "rad", allowed, code=code, remedy=remedy)


def check_helical_body(name: str, body: HelicalBody) -> None:
    """Refuse a mass, inertia or support (E-HELICAL)."""
    for entry, unit in (("mass", "kg"), ("inertia", "kg m^2"), ("diametral_inertia", "kg m^2")):
        value = numbers(f"{name}.{entry}", getattr(body, entry), 0)
        if not (math.isfinite(value) and value > 0.0):
            refuse_helical(f"{name}.{entry}", value, unit, "finite and above 0")
    check_support(f"{name}.support", body.support, count=0)
    if name == "planet" and np.any(body.support.stiffness):
        refuse_helical("planet.support", "a planet", "", "none", remedy="give planet_bearing of the set")


def check_support(key: str, support: HelicalSupport, *, count: int | None = None) -> None:
    """Refuse stiffnesses of a support (E-HELICAL): of `count` planets, of one body (0), of either (None)."""
    allowed = f"one number, or {count}" if count else "one number"
    # what is no support has none of its stiffnesses
    if not all(hasattr(support, entry) for entry in DIRECTIONS):
        refuse_helical(key, repr(support), "", "a HelicalSupport")
    for entry, unit in DIRECTIONS.items():
        values = numbers(f"{key}.{entry}", getattr(support, entry))
        if count is not None and values.ndim and values.shape != (count,):
            refuse_helical(f"{key}.{entry}", f"{values.size} values", "", allowed)
        if not np.all(values >= 0.0):
            refuse_helical(f"{key}.{entry}", values.min(), unit, "0 or more, or infinite")


def numbers(key: str, values, dimensions: int | None = None) -> np.ndarray:
    """Values as an array of floats, of so many dimensions where they are given (E-HELICAL)."""
    try:
        found = np.array(values, float)
    except (TypeError, ValueError):
        refuse_helical(key, repr(values), "", "a number" if dimensions == 0 else "numbers")
    if dimensions is not None and found.ndim != dimensions:
        refuse_helical(key, f"{found.size} values", "", "one number")
    return found


def refuse(key: str, value, unit: str, limit: str, *, code: str, remedy: str | None = None):
    """Refuse an entry of a set, such as ``planet.mass``, with its value and what is allowed."""
    raise CaseError(
        f"{key.replace('_', ' ').replace('.', ': ')} of {value} {unit}".rstrip(),
        code=code, key=key, value=value, limit=limit, remedy=remedy,
    )  # fmt: skip


_refuse_planar = partial(refuse, code="E-PLANAR")
refuse_helical = partial(refuse, code="E-HELICAL")
