"""Micro-geometry of one flank: what is taken off the involute, as a function of the roll length.

Amounts are lengths along the flank normal, positive where material is missing. A law that starts or ends
nowhere in particular spans the involute from the form circle ("root") to the tip circle ("tip"), for internal
gears too. Terms and sign of relief, crowning and slope are those of ISO 21771-1 and ISO 1328-1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import Gear, GeometryWarning

LARGEST_DEVIATION = 0.2
"""Largest plausible amount of any modification or error, in modules."""
LEAST_COVERAGE = 0.5
"""Part of a flank that a measured profile should cover; beyond its ends it is constant."""
LEAST_OF_WIDTH, OVER_ENDS = 0.9, 1.01
"""Part of the width that a measured lead should cover, and over which it may at most reach."""


@dataclass(frozen=True)
class ModificationProblem:
    """What is wrong with a modification on a gear.

    ``message`` names it, ``value`` is what the modification has, ``limit`` what is allowed, ``remedy`` what to do.
    """

    message: str
    value: str
    limit: str
    remedy: str


class Modification:
    """One change of a flank; ``kinds`` has every class by the name that case files give it.

    A new one derives from `ProfileModification` or `LeadModification`, with its ``kind``. Its fields are entries of the
    case file: ``start``, ``end``, ``power``, points of measured flanks, and others by their names.
    """

    kinds: ClassVar[dict[str, type[Modification]]] = {}
    measured: ClassVar[bool] = False
    """Whether it is given by points."""

    def __init_subclass__(cls, kind: str | None = None, **options):
        super().__init_subclass__(**options)
        if kind is not None:
            Modification.kinds[kind] = cls

    def problem(self, gear: Gear) -> ModificationProblem | None:
        """Tell what makes it impossible on a gear, if anything does."""
        return None


class ProfileModification(Modification):
    """A change of the profile, the same over the width."""

    def removed_at(self, gear: Gear, roll: np.ndarray) -> np.ndarray:
        """Compute the material removed (...) [m] at roll lengths (...) on the flank [m]."""
        raise NotImplementedError

    def knots(self, gear: Gear) -> tuple[float, ...]:
        """Roll lengths [m] between which it is monotonic or a parabola."""
        raise NotImplementedError


class LeadModification(Modification):
    """A change over the width, the same all over the profile but where it ``varies_along_profile``."""

    varies_along_profile: ClassVar[bool] = False

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places (...) from the middle of a width [m].

        Heights on the profile that broadcast with the places are -0.5 at the form circle and 0.5 at the tip.
        """
        raise NotImplementedError


class _Law(ProfileModification):
    """A formula between two roll lengths, by default those of form and tip circle."""

    start: float | None
    end: float | None
    towards: ClassVar[str] = "tip"
    """Circle that the law leads to."""

    def knots(self, gear: Gear) -> tuple[float, float]:
        """Roll lengths [m] of start and end."""
        default_end = gear.tip_roll if self.towards == "tip" else gear.form_roll
        start = gear.form_roll if self.start is None else self.start
        return start, default_end if self.end is None else self.end

    def removed_at(self, gear: Gear, roll: np.ndarray) -> np.ndarray:
        """Compute the material removed (...) [m] at roll lengths (...) on the flank [m]."""
        start, end = self.knots(gear)
        return self._removed((roll - start) / (end - start))

    def _removed(self, along: np.ndarray) -> np.ndarray:
        """Material removed [m] at places from 0 at the start to 1 at the end."""
        raise NotImplementedError

    def problem(self, gear: Gear) -> ModificationProblem | None:
        """Tell whether the law starts or ends beside the flank, or runs the wrong way."""
        start, end = self.knots(gear)
        low, high = sorted((gear.form_roll, gear.tip_roll))
        tolerance = 1e-6 * gear.module
        remedy = "diameters, roll angles and roll lengths are those of the involute of this gear"
        for name, value in (("start", start), ("end", end)):
            if not low - tolerance <= value <= high + tolerance:
                flank = f"{_place(gear, gear.form_roll)} (form circle) to {_place(gear, gear.tip_roll)} (tip circle)"
                message = f"the modification {name}s outside the involute flank"
                return ModificationProblem(message, _place(gear, value), flank, remedy)
        outwards = (end > start) == (gear.tip_roll > gear.form_roll)
        if abs(end - start) < 1e-3 * (high - low) or outwards != (self.towards == "tip"):
            return ModificationProblem(
                "start and end coincide or are exchanged",
                f"from {_place(gear, start)} to {_place(gear, end)}",
                f"from the start towards the {self.towards}",
                remedy,
            )
        return None


@dataclass(frozen=True)
class _Relief(_Law):
    """Material taken off: ``amount ((s - start)/(end - start))^power`` beyond the start.

    Parameters
    ----------
    amount : float
        At the end [m]; the law goes on to the end of the flank when its own lies before it.
    start : float
        Roll length where it starts [m].
    end : float, optional
        Roll length where the amount is reached [m]; the end of the flank when omitted.
    power : float
        1 linear, 2 parabolic.
    """

    amount: float
    start: float
    end: float | None = None
    power: float = 1.0

    def _removed(self, along: np.ndarray) -> np.ndarray:
        return self.amount * np.maximum(along, 0.0) ** self.power


@dataclass(frozen=True)
class TipRelief(_Relief, kind="tip relief"):
    """Material taken off towards the tip; the end is the tip circle or given."""


@dataclass(frozen=True)
class RootRelief(_Relief, kind="root relief"):
    """Material taken off towards the root; the end is the form circle or given.

    An end at the start of active profile gives the amount there.
    """

    towards = "root"


@dataclass(frozen=True)
class _WholeProfile(_Law):
    """A change of the evaluated part of a profile by an ``amount`` [m].

    ``start`` and ``end`` are roll lengths [m] at the root end and the tip end of that part, by default those
    of form and tip circle.
    """

    amount: float
    start: float | None = None
    end: float | None = None


@dataclass(frozen=True)
class ProfileSlope(_WholeProfile, kind="profile slope"):
    """Straight profile turned about its middle.

    The amount is the rise of the profile from start to end, positive where the tip has more material (the
    sign of f_H-alpha in ISO 1328-1), zero halfway.
    """

    def _removed(self, along: np.ndarray) -> np.ndarray:
        return self.amount * (0.5 - along)


@dataclass(frozen=True)
class ProfileCrowning(_WholeProfile, kind="profile crowning"):
    """Barrelling: a parabola that takes the amount C_alpha (ISO 21771-1) off at both ends, none halfway."""

    def _removed(self, along: np.ndarray) -> np.ndarray:
        return self.amount * (2.0 * along - 1.0) ** 2


@dataclass(frozen=True)
class MeasuredProfile(ProfileModification, kind="measured profile"):
    """Any profile from its points, straight between them and constant beyond the first and the last.

    ``roll`` are ascending roll lengths [m], ``removed`` is the material missing there [m]; measuring machines
    draw the opposite sign.
    """

    roll: tuple[float, ...]
    removed: tuple[float, ...]

    measured = True

    def removed_at(self, gear: Gear, roll: np.ndarray) -> np.ndarray:
        """Compute the material removed (...) [m] at roll lengths (...) on the flank [m]."""
        return np.interp(roll, self.roll, self.removed)

    def knots(self, gear: Gear) -> tuple[float, ...]:
        """Roll lengths [m] of the points."""
        return self.roll


@dataclass(frozen=True)
class LeadSlope(LeadModification, kind="lead slope"):
    """Flank turned about the middle of its width.

    The ``amount`` [m] is the rise from one end to the other, positive where the end z > 0 has more material (the
    sign of f_H-beta in ISO 1328-1).
    """

    amount: float

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places (...) from the middle of a width [m]."""
        return -0.5 * self.amount * (2.0 * place / width)


@dataclass(frozen=True)
class LeadCrowning(LeadModification, kind="lead crowning"):
    """Barrelling over the width: a parabola that takes the ``amount`` [m], C_beta of ISO 21771-1, off at both ends."""

    amount: float

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places (...) from the middle of a width [m]."""
        return self.amount * (2.0 * place / width) ** 2


@dataclass(frozen=True)
class EndRelief(LeadModification, kind="end relief"):
    """Material taken off at both ends of the width: ``amount (1 - e/length)^2`` at a distance e from them.

    Amount at the ends [m], and length of either relief [m] (ISO 21771-1).
    """

    amount: float
    length: float

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places (...) from the middle of a width [m]."""
        inside = (0.5 * width - np.abs(place)) / self.length
        return self.amount * np.maximum(1.0 - inside, 0.0) ** 2

    def problem(self, gear: Gear) -> ModificationProblem | None:
        """Tell whether the reliefs of both ends overlap."""
        if 2 * self.length <= gear.face_width:
            return None
        limit = f"at most half the face width, {gear.face_width * 500:.4g} mm"
        remedy = "a crowning takes off more than that over the whole width"
        return ModificationProblem("both end reliefs overlap", f"{self.length * 1e3:.4g} mm", limit, remedy)


@dataclass(frozen=True)
class FlankTwist(LeadModification, kind="flank twist"):
    """Lead slope that varies along the profile, linearly in the roll length.

    The ``amount`` [m] is the lead slope (see `LeadSlope`) at the tip circle less that at the form circle, zero
    halfway: the twist of a flank S_beta (ISO 21771-1).
    """

    amount: float

    varies_along_profile = True

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places and heights (...) [m], [1] of a width [m]."""
        return -0.5 * self.amount * (2.0 * place / width) * height


@dataclass(frozen=True)
class MeasuredLead(LeadModification, kind="measured lead"):
    """Any lead from its points, straight between them and constant beyond the first and the last.

    ``place`` are ascending places from the middle of the width [m], ``removed`` is the material missing there
    [m], of all teeth alike.
    """

    place: tuple[float, ...]
    removed: tuple[float, ...]

    measured = True

    def removed_over(self, width: float, place: np.ndarray, height: Any) -> np.ndarray:
        """Compute the material removed (...) [m] at places (...) from the middle of a width [m]."""
        return np.interp(place, self.place, self.removed)

    def problem(self, gear: Gear) -> ModificationProblem | None:
        """Tell whether points lie beside the width."""
        half, furthest = 0.5 * gear.face_width, max(self.place, key=abs)
        if abs(furthest) <= OVER_ENDS * half:
            return None
        return ModificationProblem(
            "places of a measured lead lie beside the face width",
            f"{furthest * 1e3:.6g} mm",
            f"-{half * 1e3:.6g} to {half * 1e3:.6g} mm, half the face width to either side",
            "count places from the middle of the width, not from an end of it",
        )


@dataclass(frozen=True)
class FlankForm:
    """All ``modifications`` of one flank; they add up."""

    modifications: tuple[Modification, ...] = ()

    @property
    def profile(self) -> tuple[ProfileModification, ...]:
        """Modifications of the profile, the same over the width."""
        return tuple(
            modification for modification in self.modifications if isinstance(modification, ProfileModification)
        )

    @property
    def lead(self) -> tuple[LeadModification, ...]:
        """Modifications over the width; but for a twist the same all over the profile."""
        return tuple(modification for modification in self.modifications if isinstance(modification, LeadModification))


def lead_deviation(form: FlankForm, width: float, place, height: Any = 0.0) -> np.ndarray:
    """Compute the material (...) removed from a flank [m] at places (...) from the middle of its width [m].

    And at heights on the profile that broadcast with them, from -0.5 at the form circle to 0.5 at the tip.
    """
    place = np.asarray(place, float)
    total = np.zeros(np.broadcast(place, height).shape)
    for modification in form.lead:
        total = total + modification.removed_over(width, place, height)
    return total


def profile_height(gear: Gear, roll) -> np.ndarray:
    """Find heights (...) on the profile from -0.5 at the form circle to 0.5 at the tip, of roll lengths (...) [m]."""
    return np.clip((np.asarray(roll) - gear.form_roll) / (gear.tip_roll - gear.form_roll), 0.0, 1.0) - 0.5


def form_deviation(form: FlankForm, gear: Gear, roll):
    """Compute the material removed from a flank [m] at roll lengths [m], arrays of any one shape.

    It is the separation along the flank normal, positive where material is missing; beyond the ends of
    the involute flank the value of that end holds.
    """
    low, high = sorted((gear.form_roll, gear.tip_roll))
    roll = np.clip(np.asarray(roll, float), low, high)
    total = np.zeros(roll.shape)
    for modification in form.profile:
        total = total + modification.removed_at(gear, roll)
    return total


def roll_at(
    gear: Gear, *, diameter: float | None = None, roll_angle: float | None = None, length: float | None = None
) -> float | None:
    """Find the roll length [m] of a place on the flank by its diameter [m], roll angle [rad] or itself [m].

    ``r_b xi`` and ``sqrt(d^2/4 - r_b^2)`` (ISO 21771-1); None when nothing is given.

    Raises
    ------
    GeometryError
        E-MODIFICATION: a diameter inside the base circle.
    """
    if roll_angle is not None:
        return roll_angle * gear.base_radius
    if diameter is None:
        return length
    if diameter < 2.0 * gear.base_radius:
        raise GeometryError(
            f"{gear.name}: a diameter of {diameter * 1e3:.6g} mm lies inside the base circle",
            code="E-MODIFICATION",
            key=f"{gear.name}.modifications",
            limit=f"at least {2e3 * gear.base_radius:.6g} mm",
        )
    return math.sqrt((0.5 * diameter - gear.base_radius) * (0.5 * diameter + gear.base_radius))


def check_form(form: FlankForm, gear: Gear) -> None:
    """Refuse (E-MODIFICATION) modifications that are impossible on the gear."""
    for number, modification in enumerate(form.modifications):
        if (problem := modification.problem(gear)) is not None:
            raise GeometryError(
                f"{gear.name}: {problem.message}",
                code="E-MODIFICATION",
                key=f"{gear.name}.modifications[{number}]",
                value=problem.value,
                limit=problem.limit,
                remedy=problem.remedy,
            )


def _place(gear: Gear, roll: float) -> str:
    """Diameter and roll angle of a roll length [m]."""
    diameter, angle = 2e3 * math.hypot(roll, gear.base_radius), math.degrees(roll / gear.base_radius)
    return f"diameter {diameter:.4f} mm, roll angle {angle:.4f} deg"


def check_flank(flank: str, form: FlankForm, gear: Gear) -> Iterator[GeometryWarning]:
    """Check the modifications of a named flank together, and warn of short profiles.

    E-MODIFICATION: together they exceed `LARGEST_DEVIATION` modules; W-PROFILE: a measured profile covers
    less than `LEAST_COVERAGE` of its flank, a measured lead less than `LEAST_OF_WIDTH` of the width.
    """
    _check_sum(flank, form, gear)
    for modification in form.modifications:
        if isinstance(modification, MeasuredProfile):
            (low, high), least = sorted((gear.form_roll, gear.tip_roll)), LEAST_COVERAGE
            points, shown = modification.roll, math.degrees(1.0 / gear.base_radius)
            words = "profile over roll angles {:.4g} to {:.4g} deg covers {:.0f} % of the flank,"
            words += " {:.4g} to {:.4g} deg"
        elif isinstance(modification, MeasuredLead):
            low, high, least = -0.5 * gear.face_width, 0.5 * gear.face_width, LEAST_OF_WIDTH
            points, shown = modification.place, 1e3
            words = "lead over places {:.4g} to {:.4g} mm covers {:.0f} % of the width, {:.4g} to {:.4g} mm"
        else:
            continue
        ends = points[0], points[-1]
        covered = max(min(ends[1], high) - max(ends[0], low), 0.0) / (high - low)
        if covered < least:
            first, last, *whole = (shown * end for end in (*ends, low, high))
            text = words.format(first, last, 100 * covered, *whole)
            yield GeometryWarning(
                "W-PROFILE",
                f"{gear.name}.modifications",
                f"{flank}: a measured {text}; beyond its ends it is constant",
                f"{100 * least:.0f} % or more",
            )


def _check_sum(flank: str, form: FlankForm, gear: Gear) -> None:
    """Refuse modifications, each of them plausible, that together are not."""
    most = LARGEST_DEVIATION * gear.module
    rolls = [np.linspace(gear.form_roll, gear.tip_roll, 1001)]
    # laws are monotonic or parabolas between their ends, profiles straight between their points
    rolls += [modification.knots(gear) for modification in form.profile]
    roll = np.concatenate(rolls)
    removed = form_deviation(form, gear, roll)
    i = int(np.abs(removed).argmax())
    if abs(removed[i]) <= most * (1.0 + 1e-9):
        return
    low, high = sorted((gear.form_roll, gear.tip_roll))
    angle = math.degrees(min(max(roll[i], low), high) / gear.base_radius)
    amount_there = f"{abs(removed[i]) * 1e6:.6g} um at a roll angle of {angle:.4g} deg"
    count, verb = len(form.modifications), "take off" if removed[i] > 0 else "add"
    message = f"{count} modifications together {verb} {amount_there}"
    remedy = "check the units, and whether a section stands there twice"
    if count == 1:
        message = f"the modification goes on beyond its end and reaches {amount_there}"
        remedy = "let it end nearer to the end of the flank"
    raise GeometryError(
        f"{flank}: {message}",
        code="E-MODIFICATION",
        key=f"{gear.name}.modifications",
        value=f"{removed[i] * 1e6:.6g} um",
        limit=f"at most {LARGEST_DEVIATION} modules, {most * 1e6:.6g} um, at every place of the flank",
        remedy=remedy,
    )
