"""The loaded state of a set over its period, resolved where tooth pairs begin and cease to carry.

The period is that of the mesh, or several of these where errors turn with a body.

The mesh stiffness jumps there, and equidistant positions give every harmonic an error of the size of the jump
over the number of positions, another one for each planet that meets its jump elsewhere between them. Here
the jumps are enclosed by bisection. Planets that a rotation of their arrangement maps onto one another go
through the same states at other times, so that a part of the period stands for the whole: its record is
computed once and the equal planets are equal to rounding.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from femgear.contact.bodies import Bodies
from femgear.contact.cycle import FRICTION, CycleOptions, loaded_image, planet_symmetry, walk_mesh_cycle
from femgear.contact.face_width import over_slices
from femgear.contact.flank_friction import path_sense
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.supports import RIGID, Supports
from femgear.curves import parabolas
from femgear.gears.deviations import SetDeviations, common_period, planet_shift, without_turning
from femgear.gears.pair import GearSet

SHORTEST = 2.0**-13
"""Mesh periods in which a jump is enclosed."""
SMOOTHEST = 2.0**-10
"""Mesh periods below which a smooth change is not resolved further."""
MISSED = 3e-4
"""Share of a mesh stiffness, and of the peak to peak of the deflections, that straight lines between the
positions may miss where the stiffness does not jump."""
_STILL = 1e-3  # peak to peak over the mean below which a deflection counts as constant
STEEP = 0.02
"""Change of a mesh stiffness between neighbouring positions above which there are more between them."""
_WALK = 2048
"""Positions of a walk, whose windows are in memory together."""


@dataclass(frozen=True)
class LoadedPeriod:
    """Loads and tangent stiffness of all meshes over one mesh period, or over several.

    Parameters
    ----------
    position : (P,) array
        In mesh periods, ascending from 0 and denser near jumps.
    deflection, force, stiffness, held_stiffness : (meshes, P) arrays
        As in `MeshCycle` [m], [N], [N/m].
    held_compliance : (meshes, meshes) array
        Mean over the period of the tangent compliance between the meshes through their common bodies, the
        ring held, supports left out [m/N].
    periods : int
        Mesh periods in the record.
    friction_force, friction_moment : (meshes, P) arrays, optional
        As in `MeshCycle` [N], [N m].
    """

    position: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    held_stiffness: np.ndarray
    held_compliance: np.ndarray
    periods: int = 1
    friction_force: np.ndarray | None = None
    friction_moment: np.ndarray | None = None

    def resampled(self, name: str, count: int) -> np.ndarray:
        """Values (meshes, count) of one of the arrays (meshes, P) at equidistant positions, made once.

        Between jumps by cubics with the slopes of parabolas through three positions: straight lines would
        make harmonics of their own, images of the low ones beside the number of positions. They are linear in
        the values: deflections remain those by the forces, and a response at rest is the static solution.
        """
        cache = self._resampled
        if (name, count) not in cache:
            cache[name, count] = self._curves(name, count)
            cache[name, count].setflags(write=False)
        return cache[name, count]

    @cached_property
    def _resampled(self) -> dict[tuple[str, int], np.ndarray]:
        """What was resampled: variants of a set take the same arrays."""
        return {}

    def _curves(self, name: str, count: int) -> np.ndarray:
        whole = self.periods
        at, values, tau = np.arange(count) / count * whole, getattr(self, name), self.position
        curves = np.array([np.interp(at, tau, row, period=whole) for row in values])
        for piece, place, ends in self._smooth_pieces():
            for turn in (-whole, 0, whole):
                first, last = np.searchsorted(at, np.subtract(ends, turn), side="left")
                inside = slice(first, last + (last < count and at[last % count] + turn == ends[1]))
                if inside.stop > inside.start:
                    curves[:, inside] = parabolas(place, values[:, piece].T, at[inside] + turn).T
        return curves

    def _smooth_pieces(self):
        """Positions without a jump between them: their numbers, and their places counted on past the end.

        With the first and the last place (2,) between which a curve through them holds.
        """
        tau, P, whole = self.position, len(self.position), self.periods
        jumps = np.flatnonzero(np.diff(np.append(tau, tau[0] + whole)) <= SHORTEST)
        if not len(jumps):
            # the slopes of a cubic are those of two neighbours on either side; further out they are made up
            around = np.arange(-3, P + 3)
            yield around % P, tau[around % P] + around // P * whole, (tau[0], tau[0] + whole)
            return
        for last, jump in zip(np.append(jumps[1:], jumps[0] + P), jumps, strict=True):
            piece = np.arange(jump + 1, last + 1)
            if len(piece) > 2:
                place = tau[piece % P] + piece // P * whole
                yield piece % P, place, place[[0, -1]]


def loaded_period(
    planetary_set: GearSet,
    bodies: Bodies,
    held_bodies: Bodies,
    *,
    sun_torque: float,
    positions: int = 64,
    contact: str = "profile",
    deviations: SetDeviations | None = None,
    supports: Supports = RIGID,
    options: CycleOptions | None = None,
) -> LoadedPeriod:
    """Compute the loaded state over one mesh period, or over as many as errors that turn need.

    Parameters
    ----------
    planetary_set, bodies, sun_torque, contact, deviations, supports
        As for `walk_mesh_cycle`.
    held_bodies
        See `CycleOptions`.
    positions : int
        Positions over a mesh period at least; more come where the stiffness jumps or is steep.
    options : CycleOptions, optional
        Slices over the width, and who is told of the progress.
    """
    options = replace(options or CycleOptions(), held_bodies=held_bodies)
    periods = common_period(deviations, planetary_set, limit=sys.maxsize)[0] if deviations else 1
    symmetry, shift = _repetition(planetary_set, sun_torque, deviations, periods)
    parts = (shift / periods).denominator
    first = -(-positions * periods // parts)
    # the end of the part is there to see jumps before it, and then left out; slices of helical teeth have none
    looked = first + (not options.helical)
    wanted, record, helical = np.arange(looked) / (first * parts) * periods, {}, False
    while len(wanted):
        if periods > 1:
            # what repeats later mesh periods is solved once, within a walk
            wanted = wanted[np.argsort(np.mod(wanted + SHORTEST**2, 1.0), kind="stable")]
        for positions_of_block in np.array_split(wanted, -(-len(wanted) // _WALK)):
            cycle = walk_mesh_cycle(
                planetary_set,
                bodies,
                sun_torque=sun_torque,
                positions=positions_of_block,
                contact=contact,
                deviations=deviations,
                supports=supports,
                periods=periods,
                options=options,
            )
            added = _record(cycle, planetary_set.base_pitch)
            if record:
                added = {name: np.concatenate([record[name], added[name]], axis=-1) for name in added}
            record, helical = added, cycle.helical
        order = np.argsort(record["position"], kind="stable")
        record = {name: values[..., order] for name, values in record.items()}
        if helical:
            # slices of helical teeth come into contact one after the other, with steps of their own size
            break
        smooth, jumps = _unresolved(record)
        tau, gap = record["position"], np.diff(record["position"])
        # jumps in quarters: half as many walks to enclose them
        shares = (smooth, 0.5), (jumps, 0.25), (jumps, 0.5), (jumps, 0.75)
        wanted = np.concatenate([tau[gaps_there] + share * gap[gaps_there] for gaps_there, share in shares])
    added = _whole_period(planetary_set, record, symmetry, shift, periods)
    if options.ahead is None or not options.helical:
        return added
    return replace(added, **over_slices(added, options.ahead, periods=periods))


def _repetition(
    planetary_set: GearSet, sun_torque: float, deviations: SetDeviations | None, periods: int
) -> tuple[int, Fraction]:
    """Rotations that map planets on one another, and mesh periods until they repeat one another.

    A planet that is ahead by the angle psi goes through the same states ``z_sun psi / 2 pi`` mesh periods
    later (R. G. Parker and J. Lin, J. Mech. Des. 126, 2004, 365-370); where errors turn, when these repeat.
    """
    if periods == 1 or deviations is None:
        symmetry = planet_symmetry(planetary_set, deviations)
        return symmetry, Fraction(planetary_set.gears[0].teeth, symmetry) % 1
    solved, _, turning = loaded_image(planetary_set, sun_torque, deviations)
    assert turning is not None
    most = planet_symmetry(solved, without_turning(turning, solved))
    for symmetry in (g for g in range(most, 1, -1) if most % g == 0):
        shift = planet_shift(turning, solved, symmetry, periods)
        if shift is not None:
            return symmetry, shift
    return 1, Fraction(0)


_OVER_POSITIONS = ("position", "deflection", "force", "stiffness", "held_stiffness", "held_compliance")


def _record(cycle: MeshCycle, base_pitch: float) -> dict[str, np.ndarray]:
    """What is wanted of a walk, and the tooth pairs ``loaded``; all arrays end with the positions.

    A tooth pair is known by its place on the path at position zero.
    """
    place = np.rint((cycle.path / base_pitch - cycle.position) * 1e6)
    rubbing = {name: values for name in FRICTION if (values := getattr(cycle, name)) is not None}
    if rubbing:
        # a pair that has passed the pitch point is another one
        place = 4.0 * place + path_sense(cycle.path, base_pitch)
    loaded = np.empty(len(cycle.position), object)
    for p in range(len(cycle.position)):
        mesh, pair = np.nonzero(cycle.tooth_load[..., p] > 0)
        loaded[p] = frozenset(zip(mesh.tolist(), place[mesh, pair, p].tolist(), strict=True))
    return {name: np.asarray(getattr(cycle, name)) for name in _OVER_POSITIONS} | rubbing | {"loaded": loaded}


def _unresolved(record: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the intervals that need a position in their middle, and of those that hold a jump."""
    stiffness, deflection, loaded = record["stiffness"], record["deflection"], record["loaded"]
    largest = stiffness.max(axis=1, initial=0.0)[:, None]
    k = stiffness / np.where(largest > 0.0, largest, 1.0)
    gap = np.diff(record["position"])
    steep = (np.abs(np.diff(k)) > STEEP).any(axis=0)
    other = loaded[1:] != loaded[:-1]
    moving = max(np.ptp(deflection, axis=1).max(), _STILL * np.abs(deflection).max())
    shown = np.concatenate([k, deflection / (moving or 1.0)])
    # what a straight line misses in the middle of a gap, from the curvature at its ends; none across jumps
    slope = np.diff(shown) / gap
    bend = np.zeros(shown.shape)
    bend[:, 1:-1] = np.abs(2.0 * np.diff(slope) / (gap[1:] + gap[:-1]))
    jump = np.flatnonzero(steep | other)
    bend[:, np.concatenate([jump, jump + 1])] = 0.0
    missed = (gap**2 / 8.0 * np.maximum(bend[:, 1:], bend[:, :-1])).max(axis=0)
    jumping = (steep | other) & (gap > SHORTEST)
    return np.flatnonzero((missed > MISSED) & (gap > SMOOTHEST) & ~jumping), np.flatnonzero(jumping)


def _whole_period(planetary_set: GearSet, record: dict, symmetry: int, shift: Fraction, periods: int) -> LoadedPeriod:
    """The period from one of its parts: later parts are the first one with the planets moved on.

    Those of ``symmetry`` repeat one another after ``shift`` mesh periods, see `_repetition`.
    """
    N, turn = planetary_set.n_planets, shift / periods
    ahead, parts = N // symmetry, turn.denominator
    step = pow(turn.numerator, -1, parts) if parts > 1 else 0
    shown = record["position"] < (1.0 - 1e-12) / parts * periods
    tau: np.ndarray = record["position"][shown]
    gap = np.diff(np.append(tau, tau[0] + periods / parts))
    # the mean of what is linear between the positions
    weights = (gap + np.roll(gap, 1)) / (2 * (periods / parts))
    compliance = record["held_compliance"][..., shown] @ weights
    names, mean = ["deflection", "force", "stiffness", "held_stiffness"], np.zeros(compliance.shape[:2])
    names += [name for name in FRICTION if name in record]
    values: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for part in range(parts):
        moved = (np.arange(N) - ahead * (step * part % parts)) % N
        meshes, rows = (
            planetary_set.moved_meshes(planets)
            # planets that are alike at all times are one
            for planets in (moved, moved % (ahead * parts))
        )
        for name in names:
            values[name].append(record[name][rows][:, shown])
        mean += compliance[np.ix_(meshes, meshes)] / parts
    return LoadedPeriod(
        position=np.concatenate([tau + part / parts * periods for part in range(parts)]),
        held_compliance=mean,
        periods=periods,
        **{name: np.concatenate(parts_of, axis=1) for name, parts_of in values.items()},
    )
