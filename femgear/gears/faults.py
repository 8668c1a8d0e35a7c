"""Faults of a tooth: missing, broken off at its tip, pitted, worn, or cracked at its root.

A broken tip ends a flank, a crack makes its tooth softer. All others take material off a flank, and so add to the
separation of the flanks, over the roll length of the gear that has them. Teeth are numbered as in
`femgear.gears.deviations`; the left flank of a tooth is the one on its counter-clockwise side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np

if TYPE_CHECKING:
    from femgear.gears.gear import Gear
    from femgear.gears.pair import GearSet

LEFT, RIGHT = 0, 1
"""Flanks of a tooth."""
_ROUNDED = 1e-9
"""Share of the face width that is rounding."""


@dataclass(frozen=True)
class ToothFault:
    """A fault of one tooth of a gear of a set, or of all its teeth.

    Parameters
    ----------
    gear, copy : int
        Number of the gear in its set, and which of several equal ones, from 0.
    tooth : int or None
        Number of the tooth; None stands for all teeth.
    flank : int or None
        `LEFT` or `RIGHT`; None stands for both.
    separates : bool
        Whether it makes the flank stand back; a crack does not, and where a tip is broken off there is no flank.
    """

    gear: int
    copy: int
    tooth: int | None
    flank: int | None

    separates: ClassVar[bool] = True

    def removed(self, roll: np.ndarray) -> np.ndarray:
        """Compute what is missing along the flank normal (...) [m] at roll lengths (...) [m]."""
        raise NotImplementedError

    def in_mirror(self, first: int, teeth: int, copy: int) -> ToothFault:
        """Find the fault in the mirror image, where tooth ``first`` of the original is tooth 0."""
        tooth = None if self.tooth is None else (first - self.tooth) % teeth
        flank = None if self.flank is None else RIGHT - self.flank
        return replace(self, tooth=tooth, flank=flank, copy=copy)


Fault = TypeVar("Fault", bound=ToothFault)


@dataclass(frozen=True)
class MissingTooth(ToothFault):
    """A tooth that is broken off at its root: no point of its flanks can touch."""

    def removed(self, roll: np.ndarray) -> np.ndarray:
        return np.full(np.shape(roll), np.inf)


@dataclass(frozen=True)
class BrokenTip(ToothFault):
    """A tooth whose tip is broken off over the whole width.

    Parameters
    ----------
    roll : float
        Roll length at which the flank ends [m].
    internal : bool
        Whether the tip is at the smaller roll lengths.
    separates : bool
        False: the flank ends.
    """

    roll: float
    internal: bool

    separates: ClassVar[bool] = False


@dataclass(frozen=True)
class Spall(ToothFault):
    """A pit: a part of the flank that stands back.

    Parameters
    ----------
    low, high : float
        Roll lengths of its ends [m].
    depth : float
        Along the normal [m].
    across : (float, float), optional
        Where it begins and ends over the face width, from -0.5 to 0.5 of it along z; by default it goes across all.
    """

    low: float
    high: float
    depth: float
    across: tuple[float, float] | None = None

    def in_slices(self, count: int) -> np.ndarray:
        """Tell of equal slices (count,) of the width, along z, whether their middles lie in it."""
        low, high = self.across or (-0.5, 0.5)
        middle = (np.arange(count) + 0.5) / count - 0.5
        return (middle >= low - _ROUNDED) & (middle <= high + _ROUNDED)

    def removed(self, roll: np.ndarray) -> np.ndarray:
        return np.where((roll >= self.low) & (roll <= self.high), self.depth, 0.0)


@dataclass(frozen=True)
class Wear(ToothFault):
    """Material worn off a flank.

    Parameters
    ----------
    roll : tuple of float
        Roll lengths [m], ascending.
    depth : tuple of float
        Along the normal there [m]; between them linear, beyond them as at the ends.
    """

    roll: tuple[float, ...]
    depth: tuple[float, ...]

    def removed(self, roll: np.ndarray) -> np.ndarray:
        return np.interp(roll, self.roll, self.depth)


@dataclass(frozen=True)
class Crack(ToothFault):
    """A straight crack from the root of a flank into the tooth or its rim, across the whole width.

    Parameters
    ----------
    start : float or None
        Radius of its mouth [m]; None for the critical section.
    angle : float
        Between the crack and the centre line of the tooth, towards the body [rad].
    depth : float
        Its length [m].
    separates : bool
        False.
    """

    start: float | None
    angle: float
    depth: float

    separates: ClassVar[bool] = False

    @property
    def form(self) -> tuple[float | None, float, float]:
        """Start, angle and depth, whatever tooth has it."""
        return self.start, self.angle, self.depth


def removed(faults: Sequence[ToothFault], roll: np.ndarray) -> np.ndarray:
    """Compute what faults of one flank take off together (...) [m] at roll lengths (...) [m].

    A pit is as deep as its tooth is worn and its own depth; where pits lie over one another the deeper counts.
    """
    pits = [fault.removed(roll) for fault in faults if isinstance(fault, Spall)]
    apart = sum((fault.removed(roll) for fault in faults if not isinstance(fault, Spall)), np.zeros(np.shape(roll)))
    return apart + np.max(pits, axis=0) if pits else apart


def flank_beside(gear: Gear, roll: float) -> tuple[float, float]:
    """Find the lengths of a flank [m] from a roll length [m] on it to its ends: that of smaller ones first."""
    low, high = sorted((gear.form_roll, gear.tip_roll))
    return (roll**2 - low**2) / (2.0 * gear.base_radius), (high**2 - roll**2) / (2.0 * gear.base_radius)


def missing_length(faults: Sequence[ToothFault], gears: GearSet, gear: int, land: float) -> float:
    """Find the longest part amid a flank of a gear that stands back [m], along the flank; zero without pits.

    Pits of one flank with less than ``land`` [m] of it between them count as one.
    """
    pits = dict[tuple[int, int | None, int | None], list[Spall]]()
    for fault in faults:
        if isinstance(fault, Spall) and fault.gear == gear:
            pits.setdefault((fault.copy, fault.tooth, fault.flank), []).append(fault)
    of_gear, longest = gears.gears[gear], 0.0
    ends = sorted((of_gear.form_roll, of_gear.tip_roll))
    for of_flank in pits.values():
        low = high = -np.inf
        for pit in sorted(of_flank, key=lambda pit: pit.low):
            if (pit.low**2 - high**2) / (2.0 * of_gear.base_radius) > land or np.isinf(high):
                low, high = max(ends[0], pit.low), -np.inf
            high = max(high, min(ends[1], pit.high))
            longest = max(longest, (high**2 - low**2) / (2.0 * of_gear.base_radius))
    return float(longest)


def fault_periods(faults: Sequence[ToothFault], gear: int, teeth: int) -> int:
    """Count the mesh periods after which a gear of a set repeats with its faults: its teeth, or one."""
    return teeth if any(fault.gear == gear and fault.tooth is not None for fault in faults) else 1


def fault_form(
    faults: Sequence[ToothFault],
    gears: GearSet,
    kind: int,
    tooth: np.ndarray,
    sides: np.ndarray,
    slices: int = 1,
) -> Callable | None:
    """Separation [m] by the faults of teeth as a function of both roll lengths [m], or None.

    What both flanks lack adds up, and of each flank what `removed` says.

    Parameters
    ----------
    faults : sequence of ToothFault
        Of all gears.
    kind : int
        Kind of the meshes.
    tooth : (2, meshes, P, pairs) int array
        Numbers of the teeth on gear 1 and gear 2 of the meshes of this kind.
    sides : (2, meshes) int array
        Flanks with which both gears touch in these meshes.
    slices : int
        Of the face width: so many positions in succession are those of its slices, from -z to z.

    Returns
    -------
    callable
        Of roll lengths (meshes, P, pairs, n) on gear 1 and gear 2.
    """
    separating = [fault for fault in faults if fault.separates]
    acting = list(_acting(separating, gears, kind, tooth, sides, slices))
    if not acting:
        return None

    def separation(roll_1, roll_2):
        rolls = np.broadcast_arrays(roll_1, roll_2)
        apart = np.zeros(rolls[0].shape)
        pits = [apart.copy(), apart.copy()] if any(isinstance(fault, Spall) for fault, *_ in acting) else []
        for fault, place, on in acting:
            taken = fault.removed(rolls[place][on])
            if isinstance(fault, Spall):
                # of pits that lie over one another the deeper counts
                pits[place][on] = np.maximum(pits[place][on], taken)
            else:
                apart[on] += taken
        return sum(pits, apart)

    return separation


def flank_limits(
    faults: Sequence[ToothFault], gears: GearSet, kind: int, tooth: np.ndarray, sides: np.ndarray, whole: np.ndarray
) -> np.ndarray | None:
    """Find where the flanks of pairs end of which a tip may be broken off, as roll lengths [m].

    Parameters
    ----------
    faults, gears, kind, tooth, sides
        As of `fault_form`.
    whole : (2, 2) array
        Smallest and largest roll length [m] of whole flanks of gear 1 and gear 2.

    Returns
    -------
    (2, 2, meshes, P, pairs) array or None
        Smallest and largest roll length [m] of the flanks of gear 1 and gear 2; None where all are whole.
    """
    acting = list(_acting([fault for fault in faults if isinstance(fault, BrokenTip)], gears, kind, tooth, sides))
    if not acting:
        return None
    limits = np.broadcast_to(whole[:, :, None, None, None], (2, 2, *tooth.shape[1:])).copy()
    for fault, place, on in acting:
        end, inner = (0, np.maximum) if fault.internal else (1, np.minimum)
        limits[place, end][on] = inner(limits[place, end][on], fault.roll)
    return limits


def _acting(
    faults: Sequence[Fault], gears: GearSet, kind: int, tooth: np.ndarray, sides: np.ndarray, slices: int = 1
) -> Iterator[tuple[Fault, int, np.ndarray]]:
    """Faults that meet in meshes of a kind: on gear 1 (0) or gear 2 (1), and at which (meshes, P, pairs)."""
    meshes = [mesh for mesh in gears.meshes if mesh.kind == kind]
    for fault in faults:
        for place in (0, 1):
            on: np.ndarray = np.zeros(tooth.shape[1:], bool)
            for row, mesh in enumerate(meshes):
                body = gears.bodies[mesh.bodies[place]]
                same = body.gear == fault.gear and body.copy == fault.copy
                if same and fault.flank in (None, sides[place, row]):
                    teeth = gears.gears[body.gear].teeth
                    on[row] = fault.tooth is None or (tooth[place, row] - fault.tooth) % teeth == 0
            pit: ToothFault = fault
            covered = pit.in_slices(slices) if isinstance(pit, Spall) and pit.across and slices > 1 else None
            if covered is not None:
                on &= covered[np.arange(on.shape[1]) % slices, None]
            if on.any():
                yield fault, place, on
