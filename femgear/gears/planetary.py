"""A planetary set: closure at one centre distance, meshes and phases, usual angles, data that make no set.

Frame: the carrier's, planets at angles psi_n counter-clockwise from the x axis. Positive torque on the sun
turns it counter-clockwise; relative to the carrier the planets and the ring then turn clockwise. Loaded
flanks: left (counter-clockwise) of the sun on left of the planet, right of the planet on left of the ring.
Meshes j: "sun-planet 1" .. "sun-planet N", "planet 1-ring" .. "planet N-ring".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from femgear.errors import GeometryError, one_line
from femgear.gears.gear import Gear, is_whole, with_room
from femgear.gears.pair import AnySet, GearPair, GearSet, zero_backlash_distance, zero_backlash_shift
from femgear.gears.profile import BasicRack

BACKLASH_TOLERANCE = 1e-4
"""Normal backlash, in modules, that counts as none: what four decimals of profile shifts leave open."""
SIGN_TOLERANCE = 2e-3
"""Profile shift, or part of a module, by which sets may fail to close with the other sign of the shift."""
ASSEMBLY_TOLERANCE = 1e-6
"""Part of a tooth pitch by which planet angles may miss an assembly position."""


@dataclass(frozen=True)
class PlanetarySet(GearSet):
    """Sun, equal planets and ring on one centre distance.

    Parameters
    ----------
    sun, planet, ring : Gear
        Of one module and pressure angle; the ring is internal.
    centre_distance : float
        Sun (and ring) to planet [m].
    planet_angles : tuple of float
        psi_n [rad], ascending, within one turn.
    members : dict
        Sun, carrier with the planets, and ring.

    Raises
    ------
    GeometryError
        Numbers that describe no set (E-RANGE, E-CENTRE-DISTANCE); whether it can be assembled and run is
        told by `checks.check_set`.
    """

    sun: Gear
    planet: Gear
    ring: Gear
    centre_distance: float
    planet_angles: tuple[float, ...]

    mates = ((0, 1), (1, 2))
    repeated = (False, True, False)
    senses = (1, -1, -1)
    members: ClassVar[dict[str, tuple[int, ...]]] = {"sun": (0,), "carrier": (1,), "ring": (2,)}

    def __post_init__(self):
        object.__setattr__(self, "planet_angles", tuple(float(a) for a in self.planet_angles))
        for name in ("sun", "planet", "ring"):
            gear = getattr(self, name)
            if gear.name != name:
                object.__setattr__(self, name, replace(gear, name=name))
        check_angles(self.planet_angles)
        _ = self.kinds  # refuses base circles that would overlap

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Names of the 2N meshes in order."""
        return mesh_names(self.n_planets)

    @property
    def gears(self) -> tuple[Gear, Gear, Gear]:
        """Sun, planet and ring."""
        return self.sun, self.planet, self.ring

    @cached_property
    def kinds(self) -> tuple[GearPair, GearPair]:
        """Sun with planet, and planet with ring."""
        a = self.centre_distance
        return GearPair(self.sun, self.planet, a), GearPair(self.planet, self.ring, a)

    @property
    def centres(self) -> tuple[tuple[complex, ...], ...]:
        """Centres of sun, planets and ring as x + iy [m]."""
        planets = self.centre_distance * np.exp(1j * np.asarray(self.planet_angles))
        return (0j,), tuple(planets.tolist()), (0j,)

    @property
    def working_pressure_angle_sun_planet(self) -> float:
        """Working pressure angle of the meshes with the sun [rad]."""
        return self.kinds[0].working_pressure_angle

    @property
    def working_pressure_angle_planet_ring(self) -> float:
        """Working pressure angle of the meshes with the ring [rad]."""
        return self.kinds[1].working_pressure_angle

    @property
    def contact_ratio_sun_planet(self) -> float:
        """Transverse contact ratio from the tip circles, on the involutes alone, see `GearPair.path`."""
        return self.kinds[0].contact_ratio

    @property
    def contact_ratio_planet_ring(self) -> float:
        """Transverse contact ratio from the tip circles, on the involutes alone, see `GearPair.path`."""
        return self.kinds[1].contact_ratio

    @property
    def path_sun_planet(self) -> tuple[float, float]:
        """Path coordinates [m] of first (planet tip) and last (sun tip) contact, see `GearPair.path`."""
        return self.kinds[0].path

    @property
    def path_planet_ring(self) -> tuple[float, float]:
        """As `path_sun_planet`, of first (ring tip) and last (planet tip) contact [m]."""
        return self.kinds[1].path

    @property
    def half_angles(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Half-thickness angles [rad] on the working pitch circles: of sun and planet, of planet and ring."""
        return self.kinds[0].half_angles, self.kinds[1].half_angles

    @property
    def backlash_sun_planet(self) -> float:
        """Normal play [m] along the line of action."""
        return self.kinds[0].backlash

    @property
    def backlash_planet_ring(self) -> float:
        """Normal play [m] along the line of action."""
        return self.kinds[1].backlash

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

    def with_gears(self, gears: Sequence[Gear]) -> PlanetarySet:
        """Make the set of another sun, planet and ring."""
        sun, planet, ring = gears
        return replace(self, sun=sun, planet=planet, ring=ring)

    def with_planet_angles(self, angles: tuple[float, ...]) -> PlanetarySet:
        """Make the set with planets at other angles [rad]."""
        return replace(self, planet_angles=angles)

    def equal_positions(self, wanted: int) -> int:
        """Find the number of equidistant positions of a mesh period that meet all planets alike.

        At least `wanted`, and a multiple of the common denominator of their phases: every planet then passes
        the same places of its own mesh period. Where that would be more than four times `wanted`, planets
        that a rotation maps onto one another alone are met alike.
        """
        teeth = self.sun.teeth + self.ring.teeth
        away = np.asarray(self.planet_angles) - self.planet_angles[0]
        steps = np.rint(away * teeth / (2.0 * math.pi)).astype(int).tolist()
        common = math.lcm(*(Fraction(step * self.sun.teeth, teeth).denominator for step in steps))
        if common > 4 * wanted:
            symmetry = self.rotations
            common = symmetry // math.gcd(symmetry, self.sun.teeth)
        return common * -(-wanted // common)

    @property
    def rotations(self) -> int:
        """Number of rotations that map the planets onto one another: N where they are equally spaced."""
        psi, N = np.asarray(self.planet_angles), self.n_planets
        for turns in range(N, 1, -1):
            if N % turns == 0:
                away = np.roll(psi, -(N // turns)) - psi - 2.0 * math.pi / turns
                if np.abs(np.mod(away + math.pi, 2.0 * math.pi) - math.pi).max() < 1e-9:
                    return turns
        return 1


def mesh_names(n_planets: int) -> tuple[str, ...]:
    """Name the 2N meshes of N planets, in the order of all their arrays."""
    planets = range(1, n_planets + 1)
    return (*(f"sun-planet {n}" for n in planets), *(f"planet {n}-ring" for n in planets))


def close_set(
    sun: Gear,
    planet: Gear,
    ring: Gear,
    *,
    planet_angles: tuple[float, ...],
    centre_distance: float | None = None,
    find: tuple[str, ...] = (),
) -> PlanetarySet:
    """Make the planetary set whose two meshes run at one centre distance.

    Parameters
    ----------
    planet_angles : tuple of float
        [rad]
    centre_distance : float, optional
        [m]; None takes the distance at which the given shifts run without play.
    find : tuple of str
        Gears whose profile shift is found so that the mesh has no play before thickness allowances: "sun",
        "ring", or with a centre distance both. Without a distance the other mesh sets it.

    Raises
    ------
    GeometryError
        Meshes that ask for different centre distances (E-COAXIAL), an impossible centre distance
        (E-CENTRE-DISTANCE, E-GEOMETRY), or a gear that the shift found spoils.
    """
    sun, planet, ring = (replace(g, name=n) for g, n in ((sun, "sun"), (planet, "planet"), (ring, "ring")))
    if centre_distance is None:
        centre_distance = _free_distance(sun, planet, ring, find)
    total = zero_backlash_shift(sun, planet, centre_distance)  # x_sun + x_planet
    difference = zero_backlash_shift(planet, ring, centre_distance)  # x_ring - x_planet
    shift_of = {"sun": total - planet.profile_shift, "ring": difference + planet.profile_shift}
    sun, ring = (replace(g, profile_shift=shift_of[g.name]) if g.name in find else g for g in (sun, ring))
    return PlanetarySet(sun, planet, ring, centre_distance, planet_angles)


def mirrored_set(planetary_set: AnySet) -> tuple[AnySet, np.ndarray]:
    """Mirror a set, as it is seen from behind, and tell the places ``order`` (N,) of its planets.

    Planet angles are counted the other way round, ascending from the first planet; mirrored planet ``i`` is
    original planet ``order[i]``.
    """
    if planetary_set.n_planets == 1:
        return planetary_set, np.zeros(1, int)
    angles = np.asarray(planetary_set.planet_angles)
    turned = np.mod(angles[0] - angles, 2 * np.pi)
    order = np.argsort(turned, kind="stable")
    return planetary_set.with_planet_angles(tuple(angles[0] + turned[order])), order


def virtual_teeth(gears: PlanetarySet, helix_angle: float) -> tuple[int, int, int]:
    """Find whole tooth numbers next to ``z / cos^3(beta)`` of sun, planet and ring, helix angle in rad."""
    cube = math.cos(helix_angle) ** 3
    return round(gears.sun.teeth / cube), round(gears.planet.teeth / cube), round(gears.ring.teeth / cube)


def virtual_set(gears: PlanetarySet, helix_angle: float) -> PlanetarySet:
    """Make spur gears of the normal section: one planet, whole tooth numbers next to ``z / cos^3(beta)``.

    The normal section cuts the reference cylinder in an ellipse with the radius of curvature
    ``r / cos^2(beta)`` at the tooth (G. Niemann and H. Winter, Maschinenelemente, vol. 2, section 21.3).
    Rims keep their thickness beside the roots. The ring's profile shift is found, which takes up that the
    tooth numbers were rounded; roundings of tools that then have no room are reduced.

    ``gears`` are those of the transverse section, the helix angle is in rad. GeometryError where virtual
    gears cannot be made.
    """
    teeth = virtual_teeth(gears, helix_angle)
    closed = close_set(
        _virtual(gears.sun, teeth[0], helix_angle),
        _virtual(gears.planet, teeth[1], helix_angle),
        _virtual(gears.ring, teeth[2], helix_angle),
        planet_angles=(0.0,),
        find=("ring",),
    )
    sun, planet, ring = (replace(with_room(gear), tip_open=False) for gear in closed.gears)
    return replace(closed, sun=sun, planet=planet, ring=ring)


def _virtual(gear: Gear, teeth: int, helix_angle: float) -> Gear:
    """Virtual gear of some teeth in the normal section, see `virtual_set`."""
    factor = math.cos(helix_angle)
    rack, module = gear.rack, gear.module * factor
    radius = 0.5 * module * teeth

    def moved(diameter: float | None) -> float | None:
        """A given diameter as far from the virtual reference circle as it was from the true one."""
        return None if diameter is None else diameter + 2.0 * (radius - gear.reference_radius)

    made = Gear(
        teeth=teeth,
        module=module,
        pressure_angle=math.atan(math.tan(gear.pressure_angle) * factor),
        profile_shift=gear.profile_shift / factor,
        face_width=gear.face_width,
        # replaced below, once the root circle is known
        rim_radius=2.0 * radius if gear.internal else 0.2 * radius,
        internal=gear.internal,
        rack=BasicRack(rack.addendum / factor, rack.dedendum / factor, rack.root_radius / factor),
        tip_diameter=moved(gear.tip_diameter),
        root_diameter=moved(gear.root_diameter),
        thickness_allowance=gear.thickness_allowance * factor,
        tip_shortening=gear.tip_shortening,
        tip_open=True,
        name=gear.name,
    )
    return replace(made, rim_radius=made.root_radius + gear.rim_radius - gear.root_radius)


def equal_planet_angles(planets: int) -> tuple[float, ...]:
    """List the angles ``2 pi n / N`` (N,) [rad] of equally spaced ``planets``.

    GeometryError: no whole number of planets, 1 to 1000 (E-RANGE).
    """
    check_planets(planets)
    return tuple(2.0 * math.pi * n / int(planets) for n in range(int(planets)))


def check_planets(planets: int) -> None:
    """Refuse what is no whole number of at least one planet (E-RANGE)."""
    if not is_whole(planets) or not 1 <= planets <= 1000:
        raise GeometryError(
            f"a planetary set with {one_line(planets, 40)} planets",
            code="E-RANGE",
            key="set.planets",
            value=planets,
            limit="a whole number, 1 to 1000",
            remedy="three planets share the load of a set best",
        )


def check_angles(angles: tuple[float, ...]) -> None:
    """Refuse planet angles (N,) [rad] that are none, unordered or in the wrong unit (E-RANGE)."""
    check_planets(len(angles))
    problem = None
    if not all(math.isfinite(a) for a in angles):
        problem = "contain a value that is not finite"
    elif any(b - a < 1e-9 for a, b in pairwise(angles)):
        problem = "are not in ascending order, or two of them are equal"
    elif angles[-1] - angles[0] > 2.0 * math.pi - 1e-9:
        problem = f"span {angles[-1] - angles[0]:.6g} rad, more than one turn (degrees taken for radians?)"
    if problem:
        listing = ", ".join(f"{a:.6g}" for a in angles[:12])
        raise GeometryError(
            f"the planet angles [{listing}] rad {problem}",
            code="E-RANGE",
            key="set.planet_angles",
            value=listing,
            limit="ascending, different, within one turn",
            remedy="sort the angles; the case file takes them with a unit, such as '120 deg'",
        )


def feasible_angles(teeth_sum: int, angles: tuple[float, ...]) -> tuple[float, ...]:
    """Find the assembly positions [rad] nearest to wanted planet angles [rad], from the first planet on.

    Planets fit at multiples of ``2 pi / (z_s + z_r)`` from each other (Mueller, Epicyclic Drive Trains);
    ``teeth_sum`` is z_s + z_r.
    """
    step = 2.0 * math.pi / teeth_sum
    return tuple(angles[0] + math.floor((a - angles[0]) / step + 0.5 + 1e-9) * step for a in angles)


def assembly_positions(sun_teeth: int, ring_teeth: int, angles: tuple[float, ...]) -> tuple[int, ...]:
    """Find the assembly positions of planets at angles [rad], whole multiples of ``2 pi / (z_s + z_r)``.

    Raises
    ------
    GeometryError
        A planet that misses its position by more than `ASSEMBLY_TOLERANCE` (E-ASSEMBLY).
    """
    total = sun_teeth + ring_teeth
    turns = [(a - angles[0]) * total / (2.0 * math.pi) for a in angles]
    worst = max(abs(t - round(t)) for t in turns)
    if worst > ASSEMBLY_TOLERANCE:
        listing = ", ".join(f"{math.degrees(a):.6f}" for a in feasible_angles(total, angles)[:24])
        each = f"{total / len(angles):.6g}"
        raise GeometryError(
            f"{len(angles)} planets do not assemble at these angles: {sun_teeth} + {ring_teeth} teeth times "
            f"the angle over one turn must be whole, one planet misses by {worst:.3g} teeth "
            f"((z_s + z_r)/N = {each})",
            code="E-ASSEMBLY",
            key="set.planet_angles",
            value=f"{each} teeth a planet",
            limit=f"multiples of {360.0 / total:.6f} deg from the first planet",
            remedy=f"nearest planet_angles that assemble: {listing} deg",
        )
    return tuple(round(t) for t in turns)


def _fraction(value: np.ndarray) -> np.ndarray:
    """Part after the decimal point, with values a rounding error under one taken as zero."""
    part = np.mod(value, 1.0)
    return np.where(part > 1.0 - 1e-9, 0.0, np.where(part < 1e-9, 0.0, part))


def _planet_lag(planetary: PlanetarySet) -> float:
    """Mesh periods from pitch-point contact of a planet with the sun to that with the ring.

    The planet tooth that touches the sun is centred at psi + pi - eta_ps, the one that touches the ring at
    psi + eta_pr; the planet turns by one pitch a period.
    """
    (_, eta_ps), (eta_pr, _) = planetary.half_angles
    return (math.pi - eta_ps - eta_pr) / planetary.planet.pitch_angle


def _free_distance(sun: Gear, planet: Gear, ring: Gear, find: tuple[str, ...]) -> float:
    """Centre distance [m] at which the given shifts run without play, see `close_set`."""
    first, second = zero_backlash_distance(sun, planet), zero_backlash_distance(planet, ring)
    if find:
        return second if find == ("sun",) else first
    # what BACKLASH_TOLERANCE leaves open, as a change of the centre distance
    if abs(first - second) > 2.0 * BACKLASH_TOLERANCE * sun.module:
        raise GeometryError(
            f"sun and planet run at a centre distance of {first * 1e3:.5f} mm, planet and ring at "
            f"{second * 1e3:.5f} mm (tooth numbers {sun.teeth} + 2 x {planet.teeth} = "
            f"{sun.teeth + 2 * planet.teeth}, ring {ring.teeth}){_other_sign(first, planet, ring)}",
            code="E-COAXIAL",
            key="set.centre_distance",
            limit="one centre distance for both meshes",
            remedy="give centre_distance and let the profile shifts of sun or ring be found",
        )
    return first


def _other_sign(distance: float, planet: Gear, ring: Gear) -> str:
    """Remark that the meshes run at one centre distance [m] with the other sign of the ring's shift."""
    turned = replace(ring, profile_shift=-ring.profile_shift, tip_open=True)
    try:
        other = zero_backlash_distance(planet, turned)
    except GeometryError:
        return ""
    closes = ring.profile_shift != 0.0 and abs(other - distance) < SIGN_TOLERANCE * ring.module
    return sign_remark(ring) if closes else ""


def sign_remark(ring: Gear) -> str:
    """Say that the profile shift of an internal gear has the opposite sign, which would close the set."""
    return (
        f"; the set closes with {ring.name}.profile_shift = {0.0 - ring.profile_shift:g}: femgear counts the "
        "shift positive outwards, the opposite of ISO 21771"
    )
