"""Bodies and meshes of gears (`GearSet`), and two gears on one centre distance: a pair, and each kind of mesh of a set.

All that walks over teeth walks over the meshes of a set, each of two bodies, and over the bodies, each a gear in its
place: the contact, phases, errors, root stresses. What a set is beside that, a pair or a planetary set, they need not
know.

Frame of a pair: gear 1 at the origin, pitch point on the x axis, so that an external gear 2 stands to the
right and an internal one to the left. Positive torque turns gear 1 counter-clockwise; gear 2 is held.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, Self, TypeVar

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, working_half_angles
from femgear.gears.profile import arcinv, inv, pressure_angle_at

BRANCH = 1
"""Number of the gear that the driving one meshes with: the planets, among which its torque branches, or gear 2."""


@dataclass(frozen=True)
class Body:
    """A gear in its place.

    Parameters
    ----------
    gear : int
        Number of the gear in the set.
    copy : int
        Which of the equal gears of this number, from 0.
    name : str
        That of the gear, with the number of the copy from 1 where there are several.
    """

    gear: int
    copy: int
    name: str


@dataclass(frozen=True)
class Mesh:
    """Two bodies whose teeth mesh.

    Parameters
    ----------
    kind : int
        Number of the pair of gears among the kinds of mesh of the set.
    copy : int
        Which of the meshes of this kind, from 0: the branch of a planet.
    bodies : tuple of int
        Numbers of gear 1, which drives, and gear 2 among the bodies of the set.
    angle : float
        Direction in which gear 1 of an external, gear 2 of an internal pair sees the pitch point [rad].
    """

    kind: int
    copy: int
    bodies: tuple[int, int]
    angle: float


class GearSet:
    """Bodies and meshes of gears, for which the contact of teeth is solved.

    Attributes
    ----------
    gears : tuple of Gear
        The driving one first, the one that is held last, the one numbered `BRANCH` between or held itself.
    senses : tuple of int
        How they turn while the first one drives, +1 counter-clockwise.
    repeated : tuple of bool
        Whether there is one of the gear at every one of the ``planet_angles``, else one in all.
    kinds : tuple of GearPair
        Both gears of every kind of mesh, ``mates`` their numbers; meshes are in the order of their kinds.
    planet_angles : (N,) tuple of float
        Directions of the branches [rad], of a pair alone one.
    centre_distance : float
        [m]
    centres : tuple
        Of the bodies of every gear as x + iy [m].
    rotations : int
        Number of rotations that map the branches onto one another.
    members : dict
        Names of what may move on supports, with the numbers of the gears that it takes along.
    mesh_names : tuple of str
        Of all M meshes.
    mesh_phases : (M,) array
        Phases in [0, 1) [mesh periods].
    """

    gears: tuple[Gear, ...]
    senses: tuple[int, ...]
    repeated: tuple[bool, ...]
    kinds: tuple[GearPair, ...]
    mates: tuple[tuple[int, int], ...]
    planet_angles: tuple[float, ...]
    centre_distance: float
    centres: tuple[tuple[complex, ...], ...]
    rotations: int
    members: ClassVar[dict[str, tuple[int, ...]]]
    mesh_names: tuple[str, ...]
    mesh_phases: np.ndarray

    @property
    def n_planets(self) -> int:
        """Number N of branches: of planets, or 1 of a pair."""
        return len(self.planet_angles)

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, in the order of the gears."""
        bodies = list[Body]()
        for number, (gear, repeated) in enumerate(zip(self.gears, self.repeated, strict=True)):
            copies = range(self.n_planets if repeated else 1)
            bodies += [Body(number, copy, f"{gear.name} {copy + 1}" if repeated else gear.name) for copy in copies]
        return tuple(bodies)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """All M meshes, in the order of the kinds and, in each of them, of the branches."""
        place = {(body.gear, body.copy): number for number, body in enumerate(self.bodies)}
        return tuple(
            Mesh(
                kind,
                copy,
                (place[gear_1, copy * self.repeated[gear_1]], place[gear_2, copy * self.repeated[gear_2]]),
                angle,
            )
            for kind, (gear_1, gear_2) in enumerate(self.mates)
            for copy, angle in enumerate(self.planet_angles)
        )

    @cached_property
    def mesh_kind(self) -> np.ndarray:
        """Kind of every mesh (M,)."""
        return np.array([mesh.kind for mesh in self.meshes])

    @property
    def kind_rows(self) -> tuple[slice, ...]:
        """Meshes of every kind, which follow one another."""
        ends = np.cumsum([0, *np.bincount(self.mesh_kind)]).tolist()
        return tuple(slice(*ends_of_kind) for ends_of_kind in pairwise(ends))

    @property
    def mesh_angles(self) -> np.ndarray:
        """Directions of the pitch points (M,) [rad], see `Mesh`."""
        return np.array([mesh.angle for mesh in self.meshes])

    @property
    def rotation_approach(self) -> np.ndarray:
        """Approach of the drive flanks per base-circle arc of every body that turns, (M, bodies), the driver last.

        Arcs are positive in the direction in which the driver drives; the last gear is held.
        """
        turning = [number for number, body in enumerate(self.bodies) if 0 < body.gear < len(self.gears) - 1]
        turning += [number for number, body in enumerate(self.bodies) if body.gear == 0]
        approach = np.zeros((len(self.meshes), len(turning)))
        for row, mesh in zip(approach, self.meshes, strict=True):
            for number, push in zip(mesh.bodies, (1.0, -1.0), strict=True):
                if number in turning:
                    row[turning.index(number)] = push
        return approach

    def moved_meshes(self, planets: Sequence[int] | np.ndarray) -> np.ndarray:
        """List the meshes (M,) of planets (N,) that stand in the places of planets 0 to N - 1."""
        place = {(mesh.kind, mesh.copy): number for number, mesh in enumerate(self.meshes)}
        return np.array([place[mesh.kind, int(planets[mesh.copy])] for mesh in self.meshes])

    def of_kinds(self, values: Sequence[object] | np.ndarray) -> np.ndarray:
        """Give every mesh (M, ...) the value of its kind (kinds, ...)."""
        return np.asarray(values)[self.mesh_kind]

    @abstractmethod
    def with_gears(self, gears: Sequence[Gear]) -> Self:
        """Make the set of other gears, in the same order."""

    @abstractmethod
    def with_planet_angles(self, angles: tuple[float, ...]) -> Self:
        """Make the set with branches at other angles [rad]."""

    @abstractmethod
    def equal_positions(self, wanted: int) -> int:
        """Find the number of positions of a mesh period, the wanted one or more, that meet all branches alike."""

    @property
    def base_pitch(self) -> float:
        """Pitch along the line of action [m], common to all gears."""
        return self.gears[0].base_pitch

    @property
    def mesh_widths(self) -> tuple[float, ...]:
        """Common face width of the gears of every kind of mesh [m]."""
        return tuple(pair.face_width for pair in self.kinds)


AnySet = TypeVar("AnySet", bound=GearSet)


@dataclass(frozen=True)
class GearPair(GearSet):
    """Two gears on one centre distance.

    Parameters
    ----------
    gear_1, gear_2 : Gear
        Of one module and pressure angle; gear 2 may be internal.
    centre_distance : float
        [m]
    members : dict
        None moves on supports of its own.

    Raises
    ------
    GeometryError
        E-CENTRE-DISTANCE: base circles that overlap, or an internal gear 2 with too few teeth (E-RANGE);
        whether the pair can run is told by `checks.check_meshes`.
    """

    gear_1: Gear
    gear_2: Gear
    centre_distance: float

    mates = ((0, 1),)
    repeated = (False, False)
    planet_angles = (0.0,)
    rotations = 1
    members: ClassVar[dict[str, tuple[int, ...]]] = {}

    def __post_init__(self):
        _ = self.working_pressure_angle  # refuses base circles that would overlap

    @property
    def gears(self) -> tuple[Gear, Gear]:
        """Gear 1 and gear 2."""
        return self.gear_1, self.gear_2

    @property
    def kinds(self) -> tuple[GearPair, ...]:
        """The only kind of mesh: this pair."""
        return (self,)

    @property
    def senses(self) -> tuple[int, int]:
        """Sense of rotation of both gears; an internal gear turns as its pinion does."""
        return 1, 1 if self.gear_2.internal else -1

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Name of the only mesh."""
        return ("-".join(gear.name.replace("_", " ") for gear in self.gears),)

    @property
    def mesh_phases(self) -> np.ndarray:
        """Phase (1,) of the mesh, zero: it touches at the pitch point at position zero."""
        return np.zeros(1)

    @property
    def centres(self) -> tuple[tuple[complex, ...], ...]:
        """Centres of gear 1 and gear 2 as x + iy [m]."""
        return (0j,), (complex(-self.centre_distance if self.gear_2.internal else self.centre_distance),)

    def with_gears(self, gears: Sequence[Gear]) -> GearPair:
        """Make the pair of two other gears."""
        return replace(self, gear_1=gears[0], gear_2=gears[1])

    def with_planet_angles(self, angles: tuple[float, ...]) -> GearPair:
        """Give this pair, which has one place alone."""
        return self

    def equal_positions(self, wanted: int) -> int:
        """Give the wanted number of positions: there is one mesh to be met."""
        return wanted

    @cached_property
    def working_pressure_angle(self) -> float:
        """Working pressure angle [rad]."""
        return working_pressure_angle(self.gear_1, self.gear_2, self.centre_distance)

    @property
    def path(self) -> tuple[float, float]:
        """Path coordinates [m] of first (gear 2's tip) and last (gear 1's tip) contact, 0 at the pitch point.

        The path ends where an involute ends: undercut shortens it, and so does a tip that reaches into the
        fillet of its mate.
        """
        length_1, length_2 = (gear.base_radius * math.tan(self.working_pressure_angle) for gear in self.gears)
        start, end = self.gear_1.form_roll - length_1, self.gear_1.tip_roll - length_1
        if self.gear_2.internal:
            return max(self.gear_2.tip_roll - length_2, start), min(end, self.gear_2.form_roll - length_2)
        return max(length_2 - self.gear_2.tip_roll, start), min(end, length_2 - self.gear_2.form_roll)

    @property
    def face_width(self) -> float:
        """Face width that both gears have in common [m]: the smaller one, in the middle of the wider."""
        return min(gear.face_width for gear in self.gears)

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio from the tip circles, on the involutes alone, see `path`."""
        start, end = self.path
        return (end - start) / self.base_pitch

    @property
    def single_contact(self) -> tuple[tuple[float, float], ...]:
        """Diameters [m] where one tooth pair alone carries, from root to tip, of both gears; () without any.

        A base pitch before the end and after the start of the path: inner and outer points of single pair
        contact (ISO 6336-2, B and D), LPSTC and HPSTC.
        """
        if not 1.0 <= self.contact_ratio < 2.0:
            return ()
        (start, end), pitch = self.path, self.base_pitch
        sense = 1.0 if self.gear_2.internal else -1.0
        length_1, length_2 = (gear.base_radius * math.tan(self.working_pressure_angle) for gear in self.gears)
        rolls = (
            (length_1 + end - pitch, length_1 + start + pitch),
            (length_2 + sense * (start + pitch), length_2 + sense * (end - pitch)),
        )
        return tuple(
            (2.0 * math.hypot(gear.base_radius, low), 2.0 * math.hypot(gear.base_radius, high))
            for gear, (low, high) in zip(self.gears, rolls, strict=True)
        )

    @cached_property
    def half_angles(self) -> tuple[float, float]:
        """Half-thickness angles [rad] of gear 1 and gear 2 on the working pitch circles."""
        return working_half_angles(self.gear_1, self.gear_2, self.working_pressure_angle)

    @property
    def backlash(self) -> float:
        """Normal play [m] along the line of action: pitch less both thicknesses on the pitch circles."""
        angle, (eta_1, eta_2) = self.working_pressure_angle, self.half_angles
        r_1, r_2 = (gear.base_radius / math.cos(angle) for gear in self.gears)
        return (self.gear_1.pitch_angle * r_1 - 2.0 * (r_1 * eta_1 + r_2 * eta_2)) * math.cos(angle)


def close_pair(
    gear_1: Gear, gear_2: Gear, *, centre_distance: float | None = None, find: Sequence[str] = ()
) -> GearPair:
    """Make the gear pair at a centre distance [m], or at that at which the shifts run without play.

    ``find`` names the gear whose profile shift is found so that the mesh has no play before thickness
    allowances. GeometryError as `GearPair` and `zero_backlash_distance`.
    """
    if centre_distance is None:
        centre_distance = zero_backlash_distance(gear_1, gear_2)
    shift = zero_backlash_shift(gear_1, gear_2, centre_distance)
    if gear_1.name in find:
        shift_found = gear_2.profile_shift - shift if gear_2.internal else shift - gear_2.profile_shift
        gear_1 = replace(gear_1, profile_shift=shift_found)
    elif gear_2.name in find:
        shift_found = shift + gear_1.profile_shift if gear_2.internal else shift - gear_1.profile_shift
        gear_2 = replace(gear_2, profile_shift=shift_found)
    return GearPair(gear_1, gear_2, centre_distance)


def _tooth_sum(gear_1: Gear, gear_2: Gear) -> int:
    """Sum of the teeth of an external pair, difference of an internal one (gear 2)."""
    if gear_2.internal and gear_2.teeth <= gear_1.teeth:
        raise GeometryError(
            f"{gear_1.teeth} teeth do not turn in an internal gear of {gear_2.teeth}",
            code="E-RANGE",
            key=f"{gear_2.name}.teeth",
            value=gear_2.teeth,
            limit=f"more than {gear_1.teeth} teeth",
            remedy="give the internal gear more teeth than its pinion",
        )
    return gear_2.teeth - gear_1.teeth if gear_2.internal else gear_1.teeth + gear_2.teeth


def working_pressure_angle(gear_1: Gear, gear_2: Gear, centre_distance: float) -> float:
    """Compute the working pressure angle [rad] of two gears at a centre distance [m].

    ``cos(aw) = a0 cos(alpha) / a``

    Raises
    ------
    GeometryError
        E-CENTRE-DISTANCE: the base circles would overlap (``cos(aw) > 1``).
    """
    base = 0.5 * gear_1.module * _tooth_sum(gear_1, gear_2) * math.cos(gear_1.pressure_angle)
    if not centre_distance >= base:
        raise GeometryError(
            f"at a centre distance of {centre_distance * 1e3:.6g} mm the base circles of {gear_1.teeth} and "
            f"{gear_2.teeth} teeth leave no line of action (cos(alpha_w) > 1 below {base * 1e3:.6g} mm)",
            code="E-CENTRE-DISTANCE",
            key="set.centre_distance",
            value=centre_distance,
            limit=f">= {math.ceil(base * 1e7) / 1e4:.4f} mm",
            remedy="increase the centre distance or reduce the tooth numbers or the module",
        )
    return pressure_angle_at(centre_distance, base)


def zero_backlash_distance(gear_1: Gear, gear_2: Gear) -> float:
    """Compute the centre distance [m] at which two gears run without play, allowances left aside.

    External: ``inv(aw) = inv(a) + 2 tan(a) (x1 + x2)/(z1 + z2)`` (ISO 21771, eq. 60); internal (gear 2):
    ``inv(aw) = inv(a) + 2 tan(a) (x2 - x1)/(z2 - z1)``, shifts positive outwards.

    Raises
    ------
    GeometryError
        E-GEOMETRY: ``inv(aw)`` would be negative.
    """
    alpha, total = gear_1.pressure_angle, _tooth_sum(gear_1, gear_2)
    x_1, x_2 = gear_1.profile_shift, gear_2.profile_shift
    shift = x_2 - x_1 if gear_2.internal else x_1 + x_2
    try:
        angle = arcinv(inv(alpha) + 2.0 * math.tan(alpha) * shift / total)
    except GeometryError as error:
        raise GeometryError(
            f"no centre distance suits profile shifts {x_1:.4f} ({gear_1.name}) and {x_2:.4f} "
            f"({gear_2.name}): {error.message}",
            code=error.code,
            key=f"{gear_2.name}.profile_shift",
            value=x_2,
            limit=error.limit,
            remedy=error.remedy,
        ) from None
    return 0.5 * gear_1.module * total * math.cos(alpha) / math.cos(angle)


def zero_backlash_shift(gear_1: Gear, gear_2: Gear, centre_distance: float) -> float:
    """Compute the sum or difference of profile shifts [modules] without play at a centre distance [m].

    The sum of external gears, ``x2 - x1`` where gear 2 is internal: inverse of `zero_backlash_distance`
    (ISO 21771, eq. 60).
    """
    alpha, working = gear_1.pressure_angle, working_pressure_angle(gear_1, gear_2, centre_distance)
    return _tooth_sum(gear_1, gear_2) * (inv(working) - inv(alpha)) / (2.0 * math.tan(alpha))
