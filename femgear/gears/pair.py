"""Two gears on one centre distance: a gear pair, and each kind of mesh of a planetary set.

A set tells the contact solution its ``gears``, which of them mesh as gear 1 and gear 2 of each kind
(``mates``), how they turn while the first one drives (``senses``, +1 counter-clockwise), and how rotations
close the meshes (``rotation_approach``). Of the gear with the number `EACH` there is one at every one of the
``planet_angles``, of the others one in all.

Frame of a pair: gear 1 at the origin, pitch point on the x axis, so that an external gear 2 stands to the
right and an internal one to the left. Positive torque turns gear 1 counter-clockwise; gear 2 is held.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, working_half_angles
from femgear.gears.profile import arcinv, inv, pressure_angle_at

EACH = 1
"""Number of the gear of which there is one at every angle: the planet, or gear 2 of a pair."""


@dataclass(frozen=True)
class GearPair:
    """Two gears on one centre distance.

    Parameters
    ----------
    gear_1, gear_2 : Gear
        Of one module and pressure angle; gear 2 may be internal.
    centre_distance : float
        [m]

    Raises
    ------
    GeometryError
        E-CENTRE-DISTANCE: base circles that overlap, or an internal gear 2 with too few teeth (E-RANGE);
        whether the pair can run is told by `checks.check_meshes`.
    """

    gear_1: Gear
    gear_2: Gear
    centre_distance: float

    mates = ((0, EACH),)
    planet_angles = (0.0,)
    n_planets = rotations = 1

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
    def rotation_approach(self) -> np.ndarray:
        """Approach of the drive flanks per base-circle arc of gear 1, (1, 1)."""
        return np.ones((1, 1))

    @property
    def centres(self) -> tuple[tuple[complex, ...], ...]:
        """Centres of gear 1 and gear 2 as x + iy [m]."""
        return (0j,), (complex(-self.centre_distance if self.gear_2.internal else self.centre_distance),)

    def equal_positions(self, wanted: int) -> int:
        """Give the wanted number of positions: there is one mesh to be met."""
        return wanted

    @property
    def base_pitch(self) -> float:
        """Pitch along the line of action [m], common to both gears."""
        return self.gear_1.base_pitch

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
        one, two = (gear.base_radius * math.tan(self.working_pressure_angle) for gear in self.gears)
        start, end = self.gear_1.form_roll - one, self.gear_1.tip_roll - one
        if self.gear_2.internal:
            return max(self.gear_2.tip_roll - two, start), min(end, self.gear_2.form_roll - two)
        return max(two - self.gear_2.tip_roll, start), min(end, two - self.gear_2.form_roll)

    @property
    def face_width(self) -> float:
        """Face width that both gears have in common [m]: the smaller one, in the middle of the wider."""
        return min(gear.face_width for gear in self.gears)

    @property
    def mesh_widths(self) -> tuple[float]:
        """Common face width of the only kind of mesh [m]."""
        return (self.face_width,)

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
        one, two = (gear.base_radius * math.tan(self.working_pressure_angle) for gear in self.gears)
        rolls = (
            (one + end - pitch, one + start + pitch),
            (two + sense * (start + pitch), two + sense * (end - pitch)),
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
        own = gear_2.profile_shift - shift if gear_2.internal else shift - gear_2.profile_shift
        gear_1 = replace(gear_1, profile_shift=own)
    elif gear_2.name in find:
        own = shift + gear_1.profile_shift if gear_2.internal else shift - gear_1.profile_shift
        gear_2 = replace(gear_2, profile_shift=own)
    return GearPair(gear_1, gear_2, centre_distance)


def _tooth_sum(one: Gear, two: Gear) -> int:
    """Sum of the teeth of an external pair, difference of an internal one (gear 2)."""
    if two.internal and two.teeth <= one.teeth:
        raise GeometryError(
            f"{one.teeth} teeth do not turn in an internal gear of {two.teeth}",
            code="E-RANGE",
            key=f"{two.name}.teeth",
            value=two.teeth,
            limit=f"more than {one.teeth} teeth",
            remedy="give the internal gear more teeth than its pinion",
        )
    return two.teeth - one.teeth if two.internal else one.teeth + two.teeth


def working_pressure_angle(one: Gear, two: Gear, centre_distance: float) -> float:
    """Compute the working pressure angle [rad] of two gears at a centre distance [m].

    ``cos(aw) = a0 cos(alpha) / a``

    Raises
    ------
    GeometryError
        E-CENTRE-DISTANCE: the base circles would overlap (``cos(aw) > 1``).
    """
    base = 0.5 * one.module * _tooth_sum(one, two) * math.cos(one.pressure_angle)
    if not centre_distance >= base:
        raise GeometryError(
            f"at a centre distance of {centre_distance * 1e3:.6g} mm the base circles of {one.teeth} and "
            f"{two.teeth} teeth leave no line of action (cos(alpha_w) > 1 below {base * 1e3:.6g} mm)",
            code="E-CENTRE-DISTANCE",
            key="set.centre_distance",
            value=centre_distance,
            limit=f">= {math.ceil(base * 1e7) / 1e4:.4f} mm",
            remedy="increase the centre distance or reduce the tooth numbers or the module",
        )
    return pressure_angle_at(centre_distance, base)


def zero_backlash_distance(one: Gear, two: Gear) -> float:
    """Compute the centre distance [m] at which two gears run without play, allowances left aside.

    External: ``inv(aw) = inv(a) + 2 tan(a) (x1 + x2)/(z1 + z2)`` (ISO 21771, eq. 60); internal (gear 2):
    ``inv(aw) = inv(a) + 2 tan(a) (x2 - x1)/(z2 - z1)``, shifts positive outwards.

    Raises
    ------
    GeometryError
        E-GEOMETRY: ``inv(aw)`` would be negative.
    """
    alpha, total = one.pressure_angle, _tooth_sum(one, two)
    x_1, x_2 = one.profile_shift, two.profile_shift
    shift = x_2 - x_1 if two.internal else x_1 + x_2
    try:
        angle = arcinv(inv(alpha) + 2.0 * math.tan(alpha) * shift / total)
    except GeometryError as error:
        raise GeometryError(
            f"no centre distance suits profile shifts {x_1:.4f} ({one.name}) and {x_2:.4f} "
            f"({two.name}): {error.message}",
            code=error.code,
            key=f"{two.name}.profile_shift",
            value=x_2,
            limit=error.limit,
            remedy=error.remedy,
        ) from None
    return 0.5 * one.module * total * math.cos(alpha) / math.cos(angle)


def zero_backlash_shift(one: Gear, two: Gear, centre_distance: float) -> float:
    """Compute the sum or difference of profile shifts [modules] without play at a centre distance [m].

    The sum of external gears, ``x2 - x1`` where gear 2 is internal: inverse of `zero_backlash_distance`
    (ISO 21771, eq. 60).
    """
    alpha, working = one.pressure_angle, working_pressure_angle(one, two, centre_distance)
    return _tooth_sum(one, two) * (inv(working) - inv(alpha)) / (2.0 * math.tan(alpha))
