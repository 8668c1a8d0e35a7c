"""A planetary set: closure at one centre distance, meshes, phases, speeds and torques.

Frame: the carrier's, planets at angles psi_n counter-clockwise from the x axis. Positive torque on the sun turns
it counter-clockwise; relative to the carrier the planets and the ring then turn clockwise. Loaded flanks:
left (counter-clockwise) of the sun on left of the planet, right of the planet on left of the ring.
Meshes j: "sun-planet 1" .. "sun-planet N", "planet 1-ring" .. "planet N-ring".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import GeometryError
from femgear.gears import involute
from femgear.gears.gear import Gear, half_thickness_angle

MEMBERS = ("sun", "carrier", "ring")
BACKLASH_TOLERANCE = 1e-5
"""Normal backlash, in modules, that counts as none: what five decimals of a profile shift leave open."""


@dataclass(frozen=True)
class PlanetarySet:
    """Sun, equal planets and ring on one centre distance.

    Parameters
    ----------
    sun, planet, ring : Gear
    centre_distance : float
        Sun (and ring) to planet [m].
    planet_angles : tuple of float
        psi_n [rad], ascending, within one turn.

    Raises
    ------
    GeometryError
        Numbers that describe no set (E-PLANETS, E-ANGLES, E-ROLE, E-MODULE, E-CENTRE-DISTANCE); what can be made
        and run is checked by `checks.check_set`.
    """

    sun: Gear
    planet: Gear
    ring: Gear
    centre_distance: float
    planet_angles: tuple[float, ...]

    def __post_init__(self):
        object.__setattr__(self, "planet_angles", tuple(float(a) for a in self.planet_angles))
        for name in ("sun", "planet", "ring"):
            gear = getattr(self, name)
            if gear.name != name:
                object.__setattr__(self, name, replace(gear, name=name))
        _check_roles(self)
        _check_angles(self.planet_angles)
        # both raise when the base circles would overlap
        _ = self.working_pressure_angle_sun_planet, self.working_pressure_angle_planet_ring

    @property
    def n_planets(self) -> int:
        return len(self.planet_angles)

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Labels of the 2N meshes in order."""
        numbers = range(1, self.n_planets + 1)
        return tuple(f"sun-planet {n}" for n in numbers) + tuple(f"planet {n}-ring" for n in numbers)

    @property
    def working_pressure_angle_sun_planet(self) -> float:
        """[rad]"""
        return _working_angle(self.sun, self.planet, self.centre_distance)

    @property
    def working_pressure_angle_planet_ring(self) -> float:
        """[rad]"""
        return _working_angle(self.planet, self.ring, self.centre_distance)

    @property
    def contact_ratio_sun_planet(self) -> float:
        """Transverse contact ratio from the tip circles."""
        start, end = self.path_sun_planet
        return (end - start) / self.base_pitch

    @property
    def contact_ratio_planet_ring(self) -> float:
        """Transverse contact ratio from the tip circles."""
        start, end = self.path_planet_ring
        return (end - start) / self.base_pitch

    @property
    def base_pitch(self) -> float:
        """[m], common to all gears."""
        return self.sun.base_pitch

    @property
    def path_sun_planet(self) -> tuple[float, float]:
        """Path coordinates [m] of first (planet tip) and last (sun tip) contact, 0 at the pitch point."""
        tangent = math.tan(self.working_pressure_angle_sun_planet)
        start = self.planet.base_radius * tangent - self.planet.tip_roll
        return start, self.sun.tip_roll - self.sun.base_radius * tangent

    @property
    def path_planet_ring(self) -> tuple[float, float]:
        """Path coordinates [m] of first (ring tip) and last (planet tip) contact, 0 at the pitch point."""
        tangent = math.tan(self.working_pressure_angle_planet_ring)
        start = self.ring.tip_roll - self.ring.base_radius * tangent
        return start, self.planet.tip_roll - self.planet.base_radius * tangent

    @property
    def circumferential_backlash_sun_planet(self) -> float:
        """Play [m] on the working pitch circles, pitch minus both tooth thicknesses."""
        return _backlash(self.sun, self.planet, self.working_pressure_angle_sun_planet)

    @property
    def circumferential_backlash_planet_ring(self) -> float:
        """Play [m] on the working pitch circles, pitch minus both tooth thicknesses."""
        return _backlash(self.planet, self.ring, self.working_pressure_angle_planet_ring)

    @property
    def backlash_sun_planet(self) -> float:
        """Normal play [m] along the line of action."""
        angle = self.working_pressure_angle_sun_planet
        return self.circumferential_backlash_sun_planet * math.cos(angle)

    @property
    def backlash_planet_ring(self) -> float:
        """Normal play [m] along the line of action."""
        angle = self.working_pressure_angle_planet_ring
        return self.circumferential_backlash_planet_ring * math.cos(angle)

    @property
    def mesh_phases(self) -> np.ndarray:
        """Phases phi_j in [0, 1) of the 2N meshes, (2N,).

        A tooth pair of mesh j touches at its pitch point when ``tau + phi_j`` is an integer, with tau the
        position as a fraction of the mesh period; phi of "sun-planet 1" is 0. From the tooth thicknesses at
        the working pitch circles, for any planet angles at which the set assembles (Parker and Lin, 2004,
        treat the equally spaced special case).
        """
        psi = np.asarray(self.planet_angles)
        sun_planet = -(psi - psi[0]) * self.sun.teeth / (2.0 * math.pi)
        planet_ring = sun_planet - _planet_lag(self)
        return _fraction(np.concatenate([sun_planet, planet_ring]))


@dataclass(frozen=True)
class Orientations:
    """Angle [rad] of one tooth centreline of every body, about its own centre, in the carrier frame."""

    sun: float
    planets: tuple[float, ...]
    ring: float


@dataclass(frozen=True)
class Speeds:
    """Absolute speeds [rad/s] (planet: its own axis too) and mesh frequency [Hz]."""

    sun: float
    planet: float
    ring: float
    carrier: float
    mesh_frequency: float


@dataclass(frozen=True)
class Torques:
    """External torques [N m] on the three members; they add up to zero (no losses)."""

    sun: float
    ring: float
    carrier: float


def equal_planet_angles(planets: int) -> tuple[float, ...]:
    """Angles ``2 pi n / N`` [rad] of N equally spaced planets.

    Raises
    ------
    GeometryError
        Not a whole number of at least one planet (E-PLANETS).
    """
    whole = isinstance(planets, int | np.integer) and not isinstance(planets, bool)
    if not whole or not 1 <= planets <= 1000:
        raise GeometryError(
            f"a planetary set with {planets!r} planets",
            code="E-PLANETS",
            key="set.planets",
            value=planets,
            limit="a whole number, 1 to 1000",
            remedy="three planets share the load of a set best",
        )
    return tuple(2.0 * math.pi * n / int(planets) for n in range(int(planets)))


def close_set(
    sun: Gear,
    planet: Gear,
    ring: Gear,
    *,
    planet_angles: tuple[float, ...],
    centre_distance: float | None = None,
    find: tuple[str, ...] = (),
) -> PlanetarySet:
    """Planetary set whose two meshes run at one centre distance.

    Parameters
    ----------
    sun, planet, ring : Gear
    planet_angles : tuple of float
        [rad]
    centre_distance : float, optional
        [m]; None takes the distance at which the given shifts run without play.
    find : tuple of str
        Gears whose profile shift is to be found so that the mesh has no play before thickness allowances: one of
        ("sun",), ("ring",), ("sun", "ring"), ("sun", "planet"), ("planet", "ring"), or () for none. Without a
        centre distance one gear may be found; the mesh without it sets the distance.

    Returns
    -------
    PlanetarySet

    Raises
    ------
    GeometryError
        Meshes that ask for different centre distances (E-COAXIAL), a choice of shifts that is not determined
        (E-FIND), an impossible centre distance (E-CENTRE-DISTANCE), or a gear that the shift found spoils.
    """
    _check_find(find, centre_distance)
    if centre_distance is None:
        centre_distance = _free_distance(sun, planet, ring, find)
    alpha = sun.pressure_angle
    total = _required_shift(sun, planet, centre_distance)  # x_sun + x_planet
    difference = _required_shift(planet, ring, centre_distance)  # x_ring - x_planet
    x_sun, x_planet, x_ring = sun.profile_shift, planet.profile_shift, ring.profile_shift
    if "planet" in find:
        x_planet = x_ring - difference if "sun" in find else total - x_sun
    if "sun" in find:
        x_sun = total - x_planet
    if "ring" in find:
        x_ring = difference + x_planet
    return PlanetarySet(
        sun=_shifted(sun, x_sun),
        planet=_shifted(planet, x_planet),
        ring=_shifted(ring, x_ring),
        centre_distance=centre_distance,
        planet_angles=planet_angles,
    )


def free_centre_distances(sun: Gear, planet: Gear, ring: Gear) -> tuple[float, float]:
    """Centre distances [m] without play of sun-planet and planet-ring, from the shifts, without allowances."""
    alpha = sun.pressure_angle
    out = []
    for one, two in ((sun, planet), (planet, ring)):
        angle = involute.working_pressure_angle(
            one.teeth, two.teeth, one.profile_shift, two.profile_shift, alpha, internal=two.internal
        )
        reference = involute.reference_centre_distance(
            one.teeth, two.teeth, one.module, internal=two.internal
        )
        out.append(reference * math.cos(alpha) / math.cos(angle))
    return out[0], out[1]


def orientations(planetary: PlanetarySet, position: float = 0.0) -> Orientations:
    """Rotations of all bodies at a position, loaded flanks touching.

    Parameters
    ----------
    planetary : PlanetarySet
    position : float
        tau, fraction of one mesh period (may exceed 1): the sun turns by ``+2 pi tau / z_s``, a planet by
        ``-2 pi tau / z_p`` and the ring by ``-2 pi tau / z_r``.

    Returns
    -------
    Orientations
    """
    s = planetary
    psi, phase = s.planet_angles, s.mesh_phases
    eta_s, eta_p = _half_angles(s.sun, s.planet, s.working_pressure_angle_sun_planet)
    _, eta_r = _half_angles(s.planet, s.ring, s.working_pressure_angle_planet_ring)
    planets = tuple(
        psi[n] + math.pi - eta_p - (position + phase[n]) * s.planet.pitch_angle for n in range(s.n_planets)
    )
    return Orientations(
        sun=psi[0] - eta_s + position * s.sun.pitch_angle,
        planets=planets,
        ring=psi[0] - eta_r - (position + phase[s.n_planets]) * s.ring.pitch_angle,
    )


def speeds(planetary: PlanetarySet, *, input: str, fixed: str, speed: float) -> Speeds:
    """Speeds of every body from one driven and one held member (Willis).

    Parameters
    ----------
    planetary : PlanetarySet
    input, fixed : {"sun", "carrier", "ring"}
        Driven and held member; they differ.
    speed : float
        Absolute speed of the driven member [rad/s].

    Returns
    -------
    Speeds
        ``z_s (w_s - w_c) = -z_r (w_r - w_c) = -z_p (w_p - w_c)``; the mesh frequency is
        ``|w_s - w_c| z_s / (2 pi)``.

    Raises
    ------
    GeometryError
        Not one input and one fixed member (E-MECHANISM), or a speed that is not finite.
    """
    _check_mechanism(input, fixed)
    if not math.isfinite(speed):
        raise GeometryError(
            f"a speed of {speed} rad/s", code="E-VALUE", key="operation.speeds", value=speed, limit="finite"
        )
    zs, zp, zr = planetary.sun.teeth, planetary.planet.teeth, planetary.ring.teeth
    known = {input: speed, fixed: 0.0}
    # z_s w_s + z_r w_r - (z_s + z_r) w_c = 0
    weight = {"sun": zs, "ring": zr, "carrier": -(zs + zr)}
    (free,) = (member for member in MEMBERS if member not in known)
    known[free] = -sum(weight[member] * value for member, value in known.items()) / weight[free]
    relative = known["sun"] - known["carrier"]
    return Speeds(
        sun=known["sun"],
        planet=known["carrier"] - relative * zs / zp,
        ring=known["ring"],
        carrier=known["carrier"],
        mesh_frequency=abs(relative) * zs / (2.0 * math.pi),
    )


def torques(planetary: PlanetarySet, *, member: str, torque: float) -> Torques:
    """External torques [N m] on sun, ring and carrier from that on one of them, without losses.

    ``T_s : T_r : T_c = 1 : z_r/z_s : -(1 + z_r/z_s)``.

    Raises
    ------
    GeometryError
        Unknown member (E-MECHANISM) or a torque that is not finite (E-VALUE).
    """
    if member not in MEMBERS:
        _mechanism_error(f"the torque acts on {member!r}", member)
    if not math.isfinite(torque):
        raise GeometryError(
            f"a torque of {torque} N m", code="E-VALUE", key="operation.torque", value=torque, limit="finite"
        )
    ratio = planetary.ring.teeth / planetary.sun.teeth
    share = {"sun": 1.0, "ring": ratio, "carrier": -(1.0 + ratio)}
    sun = torque / share[member]
    return Torques(sun=sun, ring=sun * share["ring"], carrier=sun * share["carrier"])


def _fraction(value: np.ndarray) -> np.ndarray:
    """Part after the decimal point, with values a rounding error under one taken as zero."""
    part = np.mod(value, 1.0)
    return np.where(part > 1.0 - 1e-9, 0.0, np.where(part < 1e-9, 0.0, part))


def _working_angle(one: Gear, two: Gear, distance: float) -> float:
    return involute.angle_at_centre_distance(
        one.teeth, two.teeth, one.module, one.pressure_angle, distance, internal=two.internal
    )


def _half_angles(one: Gear, two: Gear, angle: float) -> tuple[float, float]:
    """Half-thickness angles [rad] of both gears at their working pitch circles."""
    cosine = math.cos(angle)
    return (
        float(half_thickness_angle(one, one.base_radius / cosine)),
        float(half_thickness_angle(two, two.base_radius / cosine)),
    )


def _backlash(one: Gear, two: Gear, angle: float) -> float:
    eta_1, eta_2 = _half_angles(one, two, angle)
    r_1, r_2 = one.base_radius / math.cos(angle), two.base_radius / math.cos(angle)
    return one.pitch_angle * r_1 - 2.0 * (r_1 * eta_1 + r_2 * eta_2)


def _planet_lag(planetary: PlanetarySet) -> float:
    """Mesh periods from pitch-point contact of a planet with the sun to that with the ring.

    The planet tooth that touches the sun is centred at psi + pi - eta_ps, the one that touches the ring at
    psi + eta_pr; the planet turns by one pitch a period.
    """
    _, eta_ps = _half_angles(planetary.sun, planetary.planet, planetary.working_pressure_angle_sun_planet)
    eta_pr, _ = _half_angles(planetary.planet, planetary.ring, planetary.working_pressure_angle_planet_ring)
    return (math.pi - eta_ps - eta_pr) / planetary.planet.pitch_angle


def _required_shift(one: Gear, two: Gear, distance: float) -> float:
    return involute.shift_for_angle(
        one.teeth, two.teeth, one.pressure_angle, _working_angle(one, two, distance), internal=two.internal
    )


def _shifted(gear: Gear, shift: float) -> Gear:
    return gear if shift == gear.profile_shift else replace(gear, profile_shift=shift)


def _free_distance(sun: Gear, planet: Gear, ring: Gear, find: tuple[str, ...]) -> float:
    first, second = free_centre_distances(sun, planet, ring)
    if find:
        return second if find == ("sun",) else first
    # what BACKLASH_TOLERANCE leaves open, as a change of the centre distance
    if abs(first - second) > 2.0 * BACKLASH_TOLERANCE * sun.module:
        raise GeometryError(
            f"sun and planet run at a centre distance of {first * 1e3:.5f} mm, planet and ring at "
            f"{second * 1e3:.5f} mm (tooth numbers {sun.teeth} + 2 x {planet.teeth} = "
            f"{sun.teeth + 2 * planet.teeth}, ring {ring.teeth})",
            code="E-COAXIAL",
            key="set.centre_distance",
            value=None,
            limit="one centre distance for both meshes",
            remedy="give centre_distance and let the profile shifts of sun or ring be found",
        )
    return first


def _check_find(find: tuple[str, ...], centre_distance: float | None) -> None:
    allowed = {frozenset(), frozenset(("sun",)), frozenset(("ring",))}
    if centre_distance is not None:
        allowed |= {frozenset(p) for p in (("sun", "ring"), ("sun", "planet"), ("planet", "ring"))}
    if frozenset(find) not in allowed or len(set(find)) != len(find):
        raise GeometryError(
            f"the profile shifts of {', '.join(find)} cannot be found "
            f"{'without' if centre_distance is None else 'from'} a centre distance: two meshes give two conditions",
            code="E-FIND",
            key="set.centre_distance",
            value=find,
            limit="sun, ring" + ("" if centre_distance is None else ", or two of sun, planet, ring"),
            remedy="fix the other profile shifts",
        )


def _check_roles(planetary: PlanetarySet) -> None:
    sun, planet, ring = planetary.sun, planetary.planet, planetary.ring
    for gear, internal in ((sun, False), (planet, False), (ring, True)):
        if gear.internal is not internal:
            raise GeometryError(
                f"the {gear.name} is {'an external' if internal else 'an internal'} gear",
                code="E-ROLE",
                key=f"{gear.name}.internal",
                value=gear.internal,
                limit="sun and planet external, ring internal",
            )
        for entry in ("module", "pressure_angle"):
            mine, suns = getattr(gear, entry), getattr(sun, entry)
            if abs(mine - suns) > 1e-12 * suns:
                raise GeometryError(
                    f"{entry.replace('_', ' ')} {mine:.6g} of the {gear.name} differs from {suns:.6g} of the sun",
                    code="E-MODULE",
                    key=f"{gear.name}.{entry}",
                    value=mine,
                    limit=f"{suns:.6g}",
                    remedy="gears that mesh share module and pressure angle",
                )


def _check_angles(angles: tuple[float, ...]) -> None:
    """Number, order and range of the planet angles."""
    if not 1 <= len(angles) <= 1000:
        equal_planet_angles(len(angles))
    problem = None
    if not all(math.isfinite(a) for a in angles):
        problem = "contain a value that is not finite"
    elif any(b - a < 1e-9 for a, b in zip(angles, angles[1:])):
        problem = "are not in ascending order, or two of them are equal"
    elif angles[-1] - angles[0] > 2.0 * math.pi - 1e-9:
        problem = f"span {angles[-1] - angles[0]:.6g} rad, more than one turn (degrees taken for radians?)"
    if problem:
        listing = ", ".join(f"{a:.6g}" for a in angles[:12])
        raise GeometryError(
            f"the planet angles [{listing}] rad {problem}",
            code="E-ANGLES",
            key="set.planet_angles",
            value=listing,
            limit="ascending, different, within one turn",
            remedy="sort the angles; the case file takes them with a unit, such as '120 deg'",
        )


def _check_mechanism(input: str, fixed: str) -> None:
    for member in (input, fixed):
        if member not in MEMBERS:
            _mechanism_error(f"{member!r} is no member that can be driven or held", member)
    if input == fixed:
        _mechanism_error(f"the {input} is both driven and held, which leaves two members free", input)


def _mechanism_error(message: str, value):
    raise GeometryError(
        message,
        code="E-MECHANISM",
        key="operation.fixed",
        value=value,
        limit="one driven, one held and one output member out of sun, carrier and ring",
        remedy='for example input = "sun", fixed = "ring"',
    )
