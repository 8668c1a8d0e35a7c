"""Tooth numbers near wanted ones: ratio, assembly, phasing, hunting teeth and room between the planets."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.gear import TEETH_RANGE, is_whole
from femgear.gears.phasing import KINDS, MeshPhasing, phase_kinds, planet_sums, standard_lag
from femgear.gears.planetary import equal_planet_angles

DISTANCE_LIMIT = 30
# Share of the centre distance that profile shifts cannot bridge, and overlap of tips [modules] that no
# shortened tooth removes.
_CLOSURE, _OVERLAP = 0.05, 1.0


@dataclass(frozen=True, eq=False)
class ToothChoices:
    """Sets of equal planets, nearest ratio first; C choices, N planets, H harmonics.

    Parameters
    ----------
    teeth : (C, 3) int array
        Sun, planet, ring.
    ratio, ratio_change : (C,) arrays
        ``1 + z_r / z_s``, sun over carrier with the ring held; relative change against the wanted teeth.
    closure : (C,) int array
        ``z_r - z_s - 2 z_p``; what is not zero is left to profile shifts.
    positions : (C, N) int array
        Assembly positions nearest to equal spacing, multiples of ``2 pi / (z_s + z_r)``.
    equally_spaced : (C,) bool array
        Whether ``(z_s + z_r) / N`` is whole.
    kind, cyclic : (C, H) int arrays
        Indices of `phasing.KINDS` for the harmonics 1 to H, and mod(h z_s, N), -1 for unequal spacing.
    sums : (C, H, 2) array
        Shares of the mesh forces that add up to torque (and thrust), and to lateral force (and tilting
        moment), 0 to 1.
    hunting : (C,) bool array
        Whether every tooth meets every tooth of the other gear in both meshes: no common divisors.
    room : (C,) array
        Between the tip circles of the two nearest planets [modules], negative where they overlap.
    """

    teeth: np.ndarray
    ratio: np.ndarray
    ratio_change: np.ndarray
    closure: np.ndarray
    positions: np.ndarray
    equally_spaced: np.ndarray
    kind: np.ndarray
    cyclic: np.ndarray
    sums: np.ndarray
    hunting: np.ndarray
    room: np.ndarray

    def __len__(self) -> int:
        return len(self.teeth)

    @property
    def spacing_error(self) -> np.ndarray:
        """Largest angle [rad] by which a planet misses equal spacing, (C,)."""
        equal = np.arange(self.positions.shape[1]) / self.positions.shape[1]
        turns = self.positions / (self.teeth[:, 0] + self.teeth[:, 2])[:, None]
        return 2.0 * math.pi * np.abs(turns - equal).max(axis=1)

    @property
    def kind_names(self) -> np.ndarray:
        """Names of the phasing, (C, H)."""
        return np.array(KINDS)[self.kind]

    def only(self, chosen) -> ToothChoices:
        """The choices of a mask (C,) or of indices, in their order."""
        return ToothChoices(**{field.name: getattr(self, field.name)[chosen] for field in fields(self)})


def neighbouring_teeth(
    sun_teeth: int,
    planet_teeth: int,
    ring_teeth: int,
    planets: int,
    *,
    distance: int = 3,
    ratio_tolerance: float = 0.03,
    closure: int = 1,
    harmonics: int = 4,
    fitting: bool = True,
) -> ToothChoices:
    """Find all tooth numbers within a distance of the wanted ones, the wanted ones among them.

    Conditions of assembly, coaxial gears and neighbouring planets: H. W. Mueller, Epicyclic Drive Trains
    (Wayne State University Press, 1982). Unshifted teeth are taken for the room between planets, at the
    smaller of the reference centre distances of both meshes.

    Parameters
    ----------
    sun_teeth, planet_teeth, ring_teeth, planets : int
    distance : int
        Largest change of each tooth number, up to 30.
    ratio_tolerance : float
        Largest relative change of ``1 + z_r / z_s``.
    closure : int
        Largest ``|z_r - z_s - 2 z_p|``; each tooth asks for about half a module of profile shift.
    harmonics : int
        H
    fitting : bool
        Leaves out sets whose neighbouring planets overlap.

    Raises
    ------
    GeometryError
        Numbers out of range (E-CHOICE, E-RANGE).
    """
    equal_planet_angles(planets)
    wanted = (sun_teeth, planet_teeth, ring_teeth)
    _check(wanted, distance, ratio_tolerance, closure, harmonics)
    steps = np.arange(-distance, distance + 1)
    teeth = np.stack(np.meshgrid(*(z + steps for z in wanted), indexing="ij"), axis=-1).reshape(-1, 3)
    misfit = teeth[:, 2] - teeth[:, 0] - 2 * teeth[:, 1]
    teeth = teeth[(np.abs(misfit) <= closure) & np.all(teeth >= TEETH_RANGE[0], axis=1)]
    ratio = 1.0 + teeth[:, 2] / teeth[:, 0]
    change = ratio / (1.0 + ring_teeth / sun_teeth) - 1.0
    near = np.abs(change) <= ratio_tolerance + 1e-12
    teeth, ratio, change = teeth[near], ratio[near], change[near]
    order = np.lexsort((*teeth.T[::-1], np.abs(teeth - wanted).sum(axis=1), np.round(np.abs(change), 12)))
    found = _described(teeth[order], ratio[order], change[order], planets, np.arange(1, harmonics + 1))
    return found.only(found.room > 0.0) if fitting else found


def check_teeth(phasing: MeshPhasing, planet_teeth: int) -> tuple[str, ...]:
    """Refuse tooth numbers that make no set, and remark on those that shifts must help to one.

    Raises
    ------
    GeometryError
        Centre distances of both meshes that profile shifts cannot make equal (E-CHOICE), planets that
        overlap (E-NEIGHBOURS).
    """
    standard_lag(planet_teeth)
    sun, ring, found = phasing.sun_teeth, phasing.ring_teeth, []
    teeth, misfit = f"{sun}/{planet_teeth}/{ring}", ring - sun - 2 * planet_teeth
    if abs(misfit) > _CLOSURE * (sun + planet_teeth):
        message = f"{teeth}: z_r - z_s - 2 z_p = {misfit}, more than profile shifts can take up"
        limit, remedy = f"{_CLOSURE:.0%} of z_s + z_p", f"{(ring - sun) // 2} teeth close this set"
        raise GeometryError(message, code="E-CHOICE", key="planet teeth", limit=limit, remedy=remedy)
    if abs(misfit) > 1:
        found.append(
            f"z_r - z_s - 2 z_p = {misfit}: profile shifts of about {abs(misfit) / 2:g} times the module"
        )
    places = np.array([phasing.positions])
    room = float(_room(np.array([[sun, planet_teeth, ring]]), places, np.array([sun + ring]))[0])
    if room < -_OVERLAP:
        message = f"{phasing.n_planets} planets of {teeth} overlap by {-room:.4g} modules"
        remedy = "use fewer planets, or fewer teeth on the planets"
        raise GeometryError(message, code="E-NEIGHBOURS", remedy=remedy)
    if room <= 0.0:
        found.append(f"unshifted planets overlap by {-room:.3g} modules")
    return tuple(found)


def _described(teeth, ratio, change, planets: int, harmonics) -> ToothChoices:
    """What `ToothChoices` tells of some teeth (C, 3) and their ratios (C,)."""
    sun, planet, ring = teeth.T
    total = sun + ring
    n = np.arange(planets)
    # the assembly position nearest to n / N of a turn
    positions = (2 * n * total[:, None] + planets) // (2 * planets)
    even = total % planets == 0
    sums = np.abs(planet_sums(-sun, positions, total, harmonics, (0, 1, -1)))
    cyclic = np.mod(np.outer(sun, harmonics), planets)
    return ToothChoices(
        teeth=teeth,
        ratio=ratio,
        ratio_change=change,
        closure=ring - sun - 2 * planet,
        positions=positions,
        equally_spaced=even,
        kind=phase_kinds(-sun, positions, total, harmonics),
        cyclic=np.where(even[:, None], cyclic, -1),
        sums=np.stack([sums[..., 0], sums[..., 1:].max(axis=-1)], axis=-1),
        hunting=(np.gcd(sun, planet) == 1) & (np.gcd(planet, ring) == 1),
        room=_room(teeth, positions, total),
    )


def _room(teeth, positions, total) -> np.ndarray:
    """Between the tip circles of unshifted neighbouring planets [modules]; infinite for one planet."""
    sun, planet, ring = teeth.T
    if positions.shape[1] == 1:
        return np.full(len(teeth), math.inf)
    around = np.concatenate([positions, total[:, None]], axis=1)
    # beyond half a turn the planets stand nearer on the other side
    gap = np.diff(around, axis=1).min(axis=1) * 2.0 * math.pi / total
    distance = 0.5 * np.minimum(sun + planet, ring - planet)
    return 2.0 * distance * np.sin(0.5 * np.minimum(gap, math.pi)) - (planet + 2)


def _check(wanted, distance, ratio_tolerance, closure, harmonics) -> None:
    """Refuse arguments of `neighbouring_teeth` that are out of range (E-CHOICE)."""
    numbers = {"distance": (distance, 0, DISTANCE_LIMIT), "closure": (closure, 0, 10)}
    numbers["harmonics"] = (harmonics, 1, 100)
    numbers |= {f"{name} teeth": (z, *TEETH_RANGE) for name, z in zip(("sun", "planet", "ring"), wanted)}
    for name, (value, least, most) in numbers.items():
        if not is_whole(value) or not least <= value <= most:
            message, limit = (
                f"neighbouring tooth numbers with {name} {value!r}",
                f"a whole number, {least} to {most}",
            )
            raise GeometryError(message, code="E-CHOICE", key=name, limit=limit)
    if not (math.isfinite(ratio_tolerance) and ratio_tolerance >= 0.0):
        raise GeometryError(f"a ratio tolerance of {ratio_tolerance}", code="E-CHOICE", limit=">= 0")
    if wanted[2] <= wanted[1]:
        message = f"a ring of {wanted[2]} teeth around planets of {wanted[1]}"
        raise GeometryError(message, code="E-CHOICE", limit="more ring than planet teeth")
