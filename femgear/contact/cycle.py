"""The walk through the mesh cycle: all meshes of a planetary set or a pair solved together at each position.

It gives loads, motions and stiffness of the meshes (`MeshCycle`). A negative torque loads the other flanks:
it is the mirror image of a set under a positive one (`femgear.contact.flank_pairs`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from femgear import second_process
from femgear.contact.assembly import Candidates, contact_candidates
from femgear.contact.batch import BatchState, ContactTangents, check_definite, check_residual, solve_with_cracks
from femgear.contact.bodies import Bodies
from femgear.contact.face_width import FaceWidth, contact_over_width, over_slices, ripple_doubt
from femgear.contact.flank_friction import friction_of_record
from femgear.contact.mapped_cycle import (
    AXES,
    BETWEEN,
    FRICTION,
    PRESSED,
    PRESSURES,
    SLICED,
    in_slots,
    mapped_members,
    repeated_record,
    rotation_matrix,
    same_pairs,
    seen_from_front,
)
from femgear.contact.mesh_cycle import Between, MeshCycle
from femgear.contact.omitted_pairs import needed_nearest
from femgear.contact.peaks import (
    FEWEST,
    MOST_PLACES,
    MOST_ROUNDS,
    open_places,
    pitch_passages,
    tooth_pair_codes,
)
from femgear.contact.repeated_positions import different_positions
from femgear.contact.supports import (
    RIGID,
    UPRIGHT,
    BearingSprings,
    MovingMembers,
    Supports,
    WidthSupports,
    bearing_springs,
    moving_members,
    pin_forces,
    tilting_members,
)
from femgear.contact.width_waves import WidthWaves
from femgear.contact.windows import (
    MeshWindows,
    cycle_positions,
    enlarged,
    first_windows,
    in_windows,
    kept_pairs,
    mesh_windows,
    pair_paths,
)
from femgear.errors import LESS_TORQUE, ContactError
from femgear.gears.deviations import SetDeviations, mirrored_deviations
from femgear.gears.faults import BrokenTip, MissingTooth
from femgear.gears.pair import GearSet
from femgear.gears.planetary import mirrored_set

_TOGETHER, _ROWS, _SAME_PLACE = 64, 50, 1e-6
"""Positions that are solved at once, and slices of helical teeth; distance of two that count as one [mesh periods]."""
_PASSAGE = np.int64(1 << 40)
"""What passages of the pitch point add to the numbers of tooth pairs that carry."""
_MOST_TURNS, _TURNED = 30, 1e-5
"""Solutions with gears that have turned, and the change of the largest arc that ends them."""
_MANY_PARTS = 3
"""Parts of a walk above which two processes share them."""


@dataclass(frozen=True)
class CycleOptions:
    """What a walk through the mesh cycle looks at and keeps besides.

    Parameters
    ----------
    cells : int
        Pressure cells in a contact window.
    planet_gaps : (N,) array, optional
        Extra separation of the sun-side flanks of each planet [m].
    both_flanks : bool
        Look for contact on the back flanks as well. Without torque, only these can be loaded: both flanks
        of teeth that are wedged.
    pressures : bool
        Keep the pressure distributions of the drive flanks.
    held_bodies : Bodies, optional
        The bodies with the ring held at its outer surface: keep stiffness and compliance between all meshes
        of the same contact with these bodies.
    waves, held_waves : WidthWaves, optional
        Solve the contact in slices over the width, whose bodies these are, and `held_bodies`; drive flanks
        alone, and no clearance in the bearings of planets.
    slices : int
        Their number.
    ahead : (slices,) array, optional
        By how much the slices of helical teeth run ahead of mid-width [mesh periods]; zeros of spur teeth whose
        flanks are not alike in all slices, each of which has windows of its own then.
    width_supports : WidthSupports
        What holds members against tilting and twisting in slices.
    peaks : bool
        Solve further positions where the extremes between equidistant ones lie (`MeshCycle.between`), see
        `femgear.contact.peaks`; not of helical teeth.
    friction : tuple of float, optional
        Coefficient of friction of every kind of mesh, over the force in the transverse section; negative where gear
        2 drives. See `femgear.contact.flank_friction`; none of back flanks, nor of members that tilt.
    progress : callable, optional
        Called with (positions done, positions); with 0 where positions are solved anew, in other windows.
    """

    cells: int = 36
    planet_gaps: np.ndarray | list[float] | None = None
    both_flanks: bool = False
    pressures: bool = False
    held_bodies: Bodies | None = None
    waves: WidthWaves | None = None
    held_waves: WidthWaves | None = None
    slices: int = 1
    ahead: np.ndarray | None = None
    width_supports: WidthSupports = UPRIGHT
    peaks: bool = False
    friction: tuple[float, ...] | None = None
    progress: Callable[[int, int], None] | None = None

    @property
    def helical(self) -> bool:
        """Whether slices stand at other places of the mesh period than mid-width."""
        return self.ahead is not None and bool(np.any(self.ahead))

    def mirrored(self, order: np.ndarray) -> CycleOptions:
        """The options of the mirror image, whose planets have this order (N,) in the original."""
        gaps = None if self.planet_gaps is None else np.asarray(self.planet_gaps, float)[order]
        return replace(self, planet_gaps=gaps, ahead=None if self.ahead is None else -self.ahead)


def loaded_image(
    planetary_set: GearSet, sun_torque: float, deviations: SetDeviations | None = None
) -> tuple[GearSet, np.ndarray, SetDeviations | None]:
    """Find the set whose drive flanks a torque loads: the set itself, or its mirror image.

    The mirror image turns the other way: position ``tau`` of the set is position ``-tau`` of the image.

    A negative torque [N m] loads the right flanks of the sun. With the set come its ``order`` (N,), see
    `femgear.gears.planetary.mirrored_set`, and the deviations as it has them.
    """
    if sun_torque >= 0:
        return planetary_set, np.arange(planetary_set.n_planets), deviations
    mirrored, order = mirrored_set(planetary_set)
    if deviations is not None:
        deviations = mirrored_deviations(deviations, planetary_set, mirrored, order)
    return mirrored, order, deviations


def walk_mesh_cycle(
    planetary_set: GearSet,
    bodies: Bodies,
    *,
    sun_torque: float,
    positions: int | np.ndarray = 64,
    contact: str = "profile",
    deviations: SetDeviations | None = None,
    supports: Supports = RIGID,
    periods: int = 1,
    options: CycleOptions | None = None,
) -> MeshCycle:
    """Compute static transmission error, load sharing and mesh stiffness over the mesh cycle.

    Sun and planets are held at their bores, the ring at its outer surface. At every position one
    complementarity problem holds for the pressures of all meshes: no penetration, no tension, equilibrium
    of every planet and of every floating member, and the sun's torque.

    For a negative torque the right flanks of the sun carry. Position zero is then where the right flanks of
    "sun-planet 1" touch at the pitch point, and positions still run with the rotation of the sun. The
    mirror image, which is solved, turns the other way: its record ends at position zero, so that records
    which do not close hold the same configurations too.

    ContactError where the contact problem cannot be solved or no window size contains the contact.

    Parameters
    ----------
    bodies : Bodies
        Flank compliances and material.
    sun_torque : float
        Torque on the sun, of either sign [N m].
    positions : int or (P,) array
        Number of equidistant positions in one mesh period, or the positions themselves [mesh periods].
    contact : {"profile", "line_of_action"}
        Candidates on the whole profiles, or only on the theoretical path of contact.
    deviations : SetDeviations, optional
        Micro-geometry and errors.
    supports : Supports
        Members whose axes move; by default all are fixed.
    periods : int
        Mesh periods in the record; errors that belong to teeth or turn with a member need
        `gears.deviations.common_period` of them.
    """
    options = options or CycleOptions()
    position = cycle_positions(positions, periods=periods)
    solved, order, deviations = loaded_image(planetary_set, sun_torque, deviations)
    mirrored = sun_torque < 0
    if mirrored:
        position, options = -position[::-1], options.mirrored(order)
    record = cycle_without_load(solved, position, periods=periods, contact=contact, options=options)
    if sun_torque or options.both_flanks:
        loaded = _under_load(
            solved, bodies, abs(sun_torque), deviations, supports, record, options, not np.ndim(positions)
        )
        record = loaded if loaded.force.any() else record
    if options.helical and options.ahead is not None and not np.ndim(positions):
        doubt = ripple_doubt(record, options.ahead, periods=periods)
        record = replace(record, **over_slices(record, options.ahead, periods=periods), ripple_doubt=doubt)
        pins = pin_forces(solved, record.force, record.back_force, record.friction_force)
        record = replace(record, bearing_force=pins)
    return seen_from_front(record, planetary_set, order) if mirrored else record


def _under_load(
    gears: GearSet,
    bodies: Bodies,
    torque: float,
    deviations: SetDeviations | None,
    supports: Supports,
    empty: MeshCycle,
    options: CycleOptions,
    equidistant: bool,
) -> MeshCycle:
    """Solve the positions of a record without load under a torque on the sun that is not negative [N m]."""
    members = moving_members(gears, supports, both_flanks=options.both_flanks)
    springs, width = bearing_springs(gears, supports, members), _face_width(gears, options)
    each = springs or options.both_flanks or options.planet_gaps is not None
    tilting, one_period = bool(width and width.tilting), empty.periods == 1
    turns = 1 if each else planet_symmetry(gears, deviations)
    in_phase = math.gcd(turns, gears.gears[0].teeth)
    # tilting members are unknowns of the whole set
    images, repeats = 1 if tilting else in_phase, turns // in_phase
    if not equidistant or not one_period or len(empty.position) % repeats:
        repeats = 1
    sector, deviations = _first_planets(gears, gears.n_planets // images, deviations)
    walk = _Walk(
        gears,
        sector,
        bodies,
        torque,
        deviations,
        members,
        springs,
        empty,
        options,
        width,
        alike=turns if one_period and not tilting else 1,
        repeats=repeats,
        turns=turns,
    )
    peaks = options.peaks and not options.helical and equidistant
    attempt = walk.attempt_with_peaks if peaks else walk.attempt
    return in_windows(attempt, *first_windows(gears, bodies, torque))


def cycle_without_load(
    gears: GearSet,
    position: np.ndarray,
    *,
    periods: int,
    contact: str,
    options: CycleOptions | None = None,
) -> MeshCycle:
    """Make the defined result without load: nothing touches, nothing is stiff, no pressure has a place.

    ``position`` (P,), ``periods`` and ``contact`` are those of `MeshCycle`; the options say whether there are
    pressures, and in how many cells.
    """
    options, N, P = options or CycleOptions(), gears.n_planets, len(position)
    size = {"g": 2, "m": len(gears.meshes), "n": N, "s": 1, "c": options.cells, "w": options.slices, "t": P}
    kinds = {"tooth": int, "back_tooth": int, "iterations": int, "edge_contact": bool}
    values: dict[str, Any] = {
        name: np.zeros([size[axis] for axis in axes], kinds.get(name, float))
        for axes, names in AXES.items()
        for name in names
        if not name.startswith("held")
        and (options.friction is not None or name not in FRICTION)
        and (options.pressures or name not in PRESSURES)
        and (options.waves is not None or name not in SLICED)
    }
    values["open_planets"] = np.ones((N, P), bool)
    values["member_tilt"] = None if options.waves is None else np.zeros((0, P))
    return MeshCycle(
        position=position,
        bearing_force=np.zeros((N, 2, P)),
        member_motion=np.zeros((0, P)),
        member_names=(),
        periods=periods,
        contact=contact,
        unknowns=0,
        message="no torque: no tooth carries load and the mesh stiffness is zero",
        helical=options.helical,
        **values,
    )


def planet_symmetry(planetary_set: GearSet, deviations: SetDeviations | None = None) -> int:
    """Count the rotations that map the planets, with their errors, onto one another."""
    symmetry, N, d = planetary_set.rotations, planetary_set.n_planets, deviations
    if d is None:
        return symmetry
    turning = (d.sun_runout, d.ring_runout, d.carrier_runout, d.ovality)
    if d.sun_misalignment.any() or d.carrier_misalignment.any():
        return 1
    if d.faults or d.sun_pitch.any() or d.ring_pitch.any() or any(runout.amplitude for runout in turning):
        return 1
    runouts = np.array([[r.amplitude, r.phase if r.amplitude else 0.0] for r in d.planet_runout])
    pitches = d.planet_pitch, d.planet_ring_side_pitch
    errors = np.column_stack((d.pin_errors, d.planet_thickness, d.planet_misalignment, *pitches, runouts))
    same = (n for n in range(symmetry, 0, -1) if symmetry % n == 0)
    return next(n for n in same if (np.roll(errors, N // n, axis=0) == errors).all())


def _face_width(planetary_set: GearSet, options: CycleOptions) -> FaceWidth | None:
    """What the contact over the face width takes of the options; None without slices."""
    if options.waves is None:
        return None
    held = (options.held_bodies, options.held_waves) if options.held_bodies and options.held_waves else None
    tilting = tilting_members(planetary_set, options.width_supports, options.slices)
    return FaceWidth(options.waves, options.slices, tilting, held, options.ahead is not None)


def _first_planets(
    planetary_set: GearSet, count: int, deviations: SetDeviations | None
) -> tuple[GearSet, SetDeviations | None]:
    """Take the first planets of a set, and their deviations."""
    if count == planetary_set.n_planets:
        return planetary_set, deviations
    names = (
        "planet_misalignment",
        "planet_pitch",
        "planet_ring_side_pitch",
        "planet_runout",
        "pin_errors",
        "planet_thickness",
    )
    if deviations is not None:
        deviations = replace(deviations, **{name: getattr(deviations, name)[:count] for name in names})
    return planetary_set.with_planet_angles(planetary_set.planet_angles[:count]), deviations


@dataclass(frozen=True)
class _Solved:
    """Contact at some positions of a walk.

    Parameters
    ----------
    values : dict
        What `MeshCycle` keeps of them, by the names of its fields.
    overflow : (n,) bool array
        Whether a contact near the position leaves its window.
    nearest : float
        What pairs must come within to be listed in windows that hold the contact [m]; zero where these do.
    candidates : int
        Most pressure cells at a position that may touch.
    """

    values: dict[str, Any]
    overflow: np.ndarray
    nearest: float
    candidates: int


def _joined(blocks: list[_Solved], rows: np.ndarray, before: _Solved | None) -> _Solved:
    """Join blocks of solved positions (n,), and put them in place of those in those ``before``, if there are any."""
    values = {name: np.concatenate([block.values[name] for block in blocks], axis=-1) for name in blocks[0].values}
    overflow = np.concatenate([block.overflow for block in blocks])
    nearest, most = max(block.nearest for block in blocks), max(block.candidates for block in blocks)
    if before is None or len(rows) == len(before.overflow):
        return _Solved(values, overflow, nearest, most)
    joined, overflowing = (
        {name: values_before.copy() for name, values_before in before.values.items()},
        before.overflow.copy(),
    )
    for name, of_rows in values.items():
        joined[name][..., rows] = of_rows
    overflowing[rows] = overflow
    return _Solved(joined, overflowing, nearest, max(most, before.candidates))


def shorter_steps(step: np.ndarray, missed: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Halve steps of a fixed point at the positions where what is missed turns round and does not shrink by half.

    Gears whose teeth touch at the edges of pits and of what is left of a tooth would swing between two arcs for ever.

    Parameters
    ----------
    step : (P,) array
        Shares of what is missed that are taken at every position.
    missed, before : (M, P) arrays
        What is missed by the solution, and by the one before [m].

    Returns
    -------
    (P,) array
        The steps to take.
    """
    swings = np.sum(missed * before, axis=0) < -0.5 * np.sum(before**2, axis=0)
    return np.where(swings, 0.5 * step, step)


@dataclass(frozen=True)
class _Walk:
    """A set under a torque that is not negative, and the record without load at the positions to solve.

    Parameters
    ----------
    planetary_set : GearSet
        The whole set, mirrored where the torque of the case is negative.
    sector : GearSet
        The set with its first planets alone: those whose state all others repeat at the same time.
    bodies : Bodies
        Flank compliances of its gears.
    sun_torque : float
        Torque on the sun or gear 1 [N m], at least zero.
    deviations : SetDeviations, optional
        Deviations of the planets of the sector.
    members : MovingMembers
        Motions that the contact solves for.
    springs : BearingSprings, optional
        Bearings with clearance between members.
    empty : MeshCycle
        The record without load, which names the positions.
    options : CycleOptions
        How the contact is solved.
    width : FaceWidth, optional
        What contact in slices of the face width takes besides.
    alike : int
        Rotations that map the planets of the record onto one another, as in `MeshCycle`.
    repeats : int
        Parts of a mesh period in each of which the planets repeat the part before, one rotation further: the first
        part alone is solved.
    turns : int
        Rotations that map the planets of the set onto one another, at the same time or later.
    """

    planetary_set: GearSet
    sector: GearSet
    bodies: Bodies
    sun_torque: float
    deviations: SetDeviations | None
    members: MovingMembers
    springs: BearingSprings | None
    empty: MeshCycle
    options: CycleOptions
    width: FaceWidth | None = None
    alike: int = 1
    repeats: int = 1
    turns: int = 1

    @property
    def _tilt_names(self) -> tuple[str, ...]:
        """Names of what tilts."""
        tilting = None if self.width is None else self.width.tilting
        return () if tilting is None else tilting.names

    @property
    def images(self) -> int:
        """Sectors that are in the same state."""
        return self.planetary_set.n_planets // self.sector.n_planets

    def attempt(self, share: float, nearest: float) -> tuple[MeshCycle | None, float, float]:
        """Solve all positions in windows of one size, or up to one that needs more, see `in_windows`.

        Where a tooth is missing corners carry far off the path, and the arcs by which gears turn change where flanks
        are: separations are those of the flanks where the solution before has them, until that is where they stay.
        """
        first, again = self._different(share, nearest)
        if len(first) == len(again):
            return self._solved_in_place(share, nearest)
        record, wider, further = self._with(self.empty.position[first])._solved_in_place(share, nearest)
        return None if record is None else repeated_record(record, self.empty, again), wider, further

    def _different(self, share: float, nearest: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions in different states, and which of them all repeat, see `different_positions`."""
        every = np.arange(len(self.empty.position))
        if self.empty.periods == 1 or self.options.helical or self.options.both_flanks:
            return every, every
        windows = {"share": share, "nearest": nearest, "contact": self.empty.contact}
        return different_positions(self.sector, self.bodies, self.deviations, self.empty.position, **windows)

    def _solved_in_place(self, share: float, nearest: float) -> tuple[MeshCycle | None, float, float]:
        """Solve as `attempt`, at every position."""
        every = np.arange(len(self.empty.position) // self.repeats)
        setup, solved = self._solved_at(every, share, nearest, None, None)
        if not self._far_off:
            return self._outcome(setup, solved, share, nearest)
        turned = np.zeros((len(self.planetary_set.meshes), len(every)))
        step, missed_before = np.ones(len(every)), np.zeros_like(turned)
        for _ in range(_MOST_TURNS):
            if solved.nearest > 0.0:
                break
            goal = self._turned(solved.values)
            missed = goal - turned
            moved = np.abs(missed).max(axis=0) > _TURNED * np.abs(goal).max()
            step = shorter_steps(step, missed, missed_before)
            turned, missed_before = np.where(step < 1.0, turned + step * missed, goal), missed
            if not moved.any():
                break
            setup, solved = self._solved_at(np.flatnonzero(moved), share, nearest, turned, solved)
        else:
            raise ContactError(
                "the gears do not come to rest where a tooth is missing or short",
                code="E-CONTACT",
                limit=f"{_MOST_TURNS} solutions",
                remedy=LESS_TORQUE,
            )
        return self._outcome(setup, solved, share, nearest)

    def _outcome(
        self, setup: MeshWindows, solved: _Solved, share: float, nearest: float
    ) -> tuple[MeshCycle | None, float, float]:
        """The record of solved positions, and the windows to try next, as of `attempt`."""
        if solved.nearest > 0.0:
            return None, share, solved.nearest
        record = self._record(solved.values, setup, self._places(), self.images * solved.candidates)
        if solved.overflow.any():
            largest = 0.0 if record.slice_load is None else record.slice_load.max()
            share = enlarged(share, max(record.force.max(), record.back_force.max(), largest))
        return record, share, nearest

    @property
    def _far_off(self) -> bool:
        """Whether teeth may carry far off the path of contact."""
        faults = () if self.deviations is None else self.deviations.faults
        return any(isinstance(fault, MissingTooth | BrokenTip) for fault in faults)

    def _turned(self, values: dict[str, Any]) -> np.ndarray:
        """Arcs (M, P) [m] by which gear 1 of every mesh turns, with its motion along the line of action.

        Of the first kind of mesh it is the driver, of the next one the planets, whose flanks approach a gear that is
        held.
        """
        turned = values["deflection"].copy()
        turned[self.planetary_set.kind_rows[0]] = values["sun_arc"]
        return turned

    def _places(self) -> np.ndarray:
        """All positions (P,) [mesh periods], of slices of helical teeth (P, S)."""
        ahead = self.options.ahead
        return self.empty.position if ahead is None else self.empty.position[:, None] + ahead

    def _solved_at(
        self, rows: np.ndarray, share: float, nearest: float, turned: np.ndarray | None, before: _Solved | None
    ) -> tuple[MeshWindows, _Solved]:
        """Solve some positions (n,) with gears turned by arcs (M, P) [m]; others are taken from ``before``."""
        options = self.options
        if options.progress is not None:
            options.progress(0, len(self.empty.position) // self.repeats)
        tau, each = self._places(), 1 if options.ahead is None else len(options.ahead)
        setup = mesh_windows(
            self.sector,
            self.bodies,
            share=share,
            nearest=nearest,
            positions=tau[: len(tau) // self.repeats],
            contact=self.empty.contact,
            cells=options.cells,
            deviations=self.deviations,
            both_flanks=options.both_flanks,
            turned=None if turned is None else np.repeat(turned, each, axis=1),
            all_pairs=self._far_off,
        )
        setup = replace(setup, images=self.images)
        if options.planet_gaps is not None:
            setup = setup.with_planet_gaps(options.planet_gaps)
        together = _TOGETHER if each == 1 else max(_ROWS // each, 2)
        # windows that are too small show at the first position: slices of all others need not wait for it
        starts = [*range(0, len(rows), together)] if each == 1 else [0, *range(1, len(rows), together)]
        blocks = [rows[first:end] for first, end in pairwise([*starts, len(rows)])]
        parts = [partial(self._solve_positions, setup, block, each) for block in blocks]
        # many parts are worth another process, but for the first one, which shows whether windows hold the contact
        alone, solved = 1 if len(parts) > _MANY_PARTS else len(parts), list[_Solved]()
        for part in parts[:alone]:
            solved.append(part())
            if solved[-1].nearest > 0.0:
                return setup, solved[-1]
        solved += second_process.shared(parts[alone:])
        return setup, _joined(solved, rows, before)

    def _solve_positions(self, setup: MeshWindows, block: np.ndarray, each: int) -> _Solved:
        """Solve the contact at some positions (n,) of the windows, each of so many slices."""
        options, positions = self.options, len(self.empty.position) // self.repeats
        rows = (block[:, None] * each + np.arange(each)).ravel()
        candidates = contact_candidates(setup, self.bodies, rows, self.members, options.friction)
        if block[0] == 0:
            # bodies that are no elastic bodies are refused before anything rests on them
            check_definite(candidates)
        load = np.zeros(candidates.approach.shape[1])
        load[setup.driver] = self.sun_torque / self.planetary_set.gears[0].base_radius / self.images
        candidates, state = solve_with_cracks(candidates, load, self.springs)
        check_residual(candidates, state)
        values = {} if options.ahead is not None else self._at_positions(candidates, state)
        overflow, nearest = candidates.touches_window_end(state.active), 0.0
        if self.width is None:
            approach, force = values["deflection"], state.loads.sum(axis=-1)
        else:
            values |= contact_over_width(self.width, candidates, state, load, values, self.members, self.deviations)
            overflow |= values.pop("overflow")
            approach, force = values.pop("pair_approach"), values.pop("pair_force")
        if "held_tangents" in values:
            values["held_compliance"] = _between_meshes(setup, values.pop("held_tangents"), values["force"])
        if self.empty.contact == "profile":
            nearest = 1.2 * max(float(needed_nearest(candidates, approach, force).max()), 0.0)
        if options.progress is not None:
            options.progress(int(block[-1]) + 1, positions)  # to nobody from a second process
        most = int(candidates.candidate.sum(axis=(1, 2)).max())
        return _Solved(values, np.full(len(block), bool(overflow)), nearest, most)

    def attempt_with_peaks(self, share: float, nearest: float) -> tuple[MeshCycle | None, float, float]:
        """Solve all positions, and those between them at which extremes lie, in windows of one size."""
        record, wider, further = self.attempt(share, nearest)
        if record is None or (wider, further) != (share, nearest) or not record.force.any():
            return record, wider, further
        equidistant, doubt = len(record.position), 0.0
        records: list[MeshCycle] = []
        curves, places = self._curves(record), self._in_first_part(self._first_places(record.position))
        for _ in range(MOST_ROUNDS + 1):
            if not len(places):
                places, doubt = self._open_places(curves)
                places = self._in_first_part(places)
            added = (len(curves["position"]) - equidistant) // self.repeats
            if not len(places) or added + len(places) > MOST_PLACES:
                doubt = max(doubt, 1.0) if len(places) else doubt
                break
            between, wider, further = self._at(places).attempt(share, nearest)
            if between is None or (wider, further) != (share, nearest):
                return None, wider, further
            records.append(between)
            more = self._curves(between)
            curves = {name: np.concatenate([curves[name], more[name]], axis=-1) for name in curves}
            if len(records) == 1:
                curves = self._without_end(curves)
            places = np.zeros(0)
        order = equidistant + np.argsort(curves["position"][equidistant:])
        looked = np.arange(self.planetary_set.n_planets) < self.planetary_set.n_planets // self.alike
        between = Between(
            **{name: curves[name][..., order] for name in BETWEEN},
            looked=looked,
            records=tuple(records),
            doubt=doubt,
        )
        return replace(record, between=between, alike=self.alike), share, nearest

    def _first_places(self, position: np.ndarray) -> np.ndarray:
        """Positions that divide the intervals of a record of few positions, and the end of the record."""
        periods = self.empty.periods
        parts = -(-FEWEST * periods // len(position))
        between = np.arange(1, parts) / parts * (periods / len(position))
        sign = -1.0 if position[-1] <= 0.0 else 1.0
        return np.append((position[:, None] + sign * between).ravel(), sign * periods)

    def _without_end(self, curves: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Leave out the end of a record that closes: it is its beginning again."""
        position, deflection = curves["position"], curves["deflection"]
        end = np.abs(position) > self.empty.periods - 1e-9
        start = np.abs(position) < 1e-9
        if not np.allclose(deflection[:, end], deflection[:, start], rtol=1e-6, atol=0.0):
            return curves
        return {name: values[..., ~end] for name, values in curves.items()}

    def _in_first_part(self, places: np.ndarray) -> np.ndarray:
        """Positions in the first of the parts that repeat one another, with the same states of the set."""
        if self.repeats == 1:
            return places
        # the record of a mirror image ends at zero
        first, places = -1.0 if self.empty.position[-1] <= 0.0 else 0.0, places[np.abs(places) < 1.0 - 1e-9]
        inside = np.sort(first + np.mod(places - first, 1.0 / self.repeats))
        return inside[np.diff(inside, prepend=-np.inf) > _SAME_PLACE]

    def _at(self, places: np.ndarray) -> _Walk:
        """The same set at other positions (n,) of the first part, and of all parts; nobody is told."""
        parts = np.arange(self.repeats)[:, None] / self.repeats + places
        return replace(self, options=replace(self.options, progress=None, pressures=False))._with(parts.ravel())

    def _with(self, position: np.ndarray) -> _Walk:
        """The same set at other positions (P,)."""
        record = {"periods": self.empty.periods, "contact": self.empty.contact, "options": self.options}
        return replace(self, empty=cycle_without_load(self.planetary_set, position, **record))

    def _curves(self, record: MeshCycle) -> dict[str, np.ndarray]:
        """What has peaks over the positions, and the tooth pairs that carry as `tooth_pair_codes`."""
        pitch, curves = self.planetary_set.base_pitch, {n: np.asarray(getattr(record, n)) for n in BETWEEN}
        for name, after in (("codes", 0.0), ("later_codes", float(self.empty.periods))):
            place = record.path, record.position + after
            curves[name] = tooth_pair_codes(place[0], record.tooth_load, place[1], pitch)
            if record.slice_load is not None:
                curves[f"slice_{name}"] = tooth_pair_codes(place[0], record.slice_load, place[1], pitch)
        if record.friction_force is not None:
            curves["passages"] = pitch_passages(record.path, record.position, pitch)
        return curves

    def _open_places(self, known_curves: dict[str, np.ndarray]) -> tuple[np.ndarray, float]:
        """Find open peaks, see `open_places`; the first of planets that are alike stands for all."""
        order, N = np.argsort(known_curves["position"]), self.planetary_set.n_planets
        deflection, stiffness = known_curves["deflection"], known_curves["stiffness"]
        first = np.flatnonzero(np.arange(len(deflection)) % N < N // self.alike)
        arc, share = known_curves["sun_arc"][None], known_curves["load_share"][: N // self.alike]
        codes, later = (
            np.concatenate([numbers.sum(axis=0)[None], numbers[first]])
            for numbers in (known_curves["codes"], known_curves["later_codes"][:, order[:1]])
        )
        # which pairs carry bends deflections; stiffnesses jump there, and are equal on both sides
        # but for those of slices that begin to carry one after the other
        same = np.zeros((len(first) + len(share), len(order)), np.int64)
        later_same = np.zeros(len(same), np.int64)
        if "slice_codes" in known_curves:
            same[: len(first)] = known_curves["slice_codes"][first]
            later_same[: len(first)] = known_curves["slice_later_codes"][first, order[0]]
        curves = np.concatenate([arc, deflection[first], stiffness[first], share])
        still = [1e-3] * (1 + len(first)) + [0.1] * len(same)
        least = np.array(still) * np.abs(curves).max(axis=1)
        codes, later = np.concatenate([codes, same]), np.append(later[:, 0], later_same)
        position, curves, codes = known_curves["position"][order], curves[:, order], codes[:, order]
        jumps = np.arange(len(curves)) > len(first)
        if "passages" in known_curves:
            # friction turns round where a pair passes the pitch point: deflections and loads jump
            passed = known_curves["passages"].sum(axis=0)[order]
            at_end = passed[0] + len(known_curves["passages"]) * self.empty.periods
            jumps = jumps[:, None] | (np.diff(passed, append=at_end) != 0)
            codes, later = codes + _PASSAGE * passed, later + _PASSAGE * at_end
        return open_places(position, curves, codes, least, self.empty.periods, later, jumps)

    def _at_positions(self, candidates: Candidates, state: BatchState) -> dict[str, Any]:
        """What `MeshCycle` keeps of some positions, by the names of its fields; of the planets solved."""
        setup, P, members, options = candidates.setup, len(candidates.position), self.members, self.options
        meshes, turns = setup.meshes, setup.gears.rotation_approach
        driver, rotations = setup.driver, turns.shape[1]
        tooth_load = candidates.by_pairs(state.loads.sum(axis=-1))
        force = np.zeros((2 * meshes, P))
        force[: len(tooth_load)] = tooth_load.sum(axis=1)
        # sprung members yield under the mesh forces, free ones are unknowns of the problem
        motion, sprung = np.zeros((len(members.names), P)), ~members.free
        motion[members.free] = state.motions.T[rotations:] if self.images == 1 else 0.0
        whole = force if self.images == 1 else force[setup.places[0]]
        pulled = members.approach[:, sprung].T @ whole[: len(members.approach)]
        if candidates.friction is not None:
            rubbing = candidates.by_pairs(candidates.friction.factor * state.loads.sum(axis=-1)).sum(axis=1)
            pulled = pulled + members.sliding[:, sprung].T @ rubbing[setup.places[0]]
        motion[sprung] = -pulled / members.stiffness[sprung, None]
        at_edge = candidates.at_flank_end(state.active)
        pressure = candidates.equal_cell_pressure(state.loads)
        inner = np.where(at_edge, 0.0, pressure.max(axis=2))
        tangents = ContactTangents(candidates, state)
        values = {
            "deflection": turns @ state.motions.T[:rotations]
            + members.approach[: meshes * self.images][setup.places[1] == 0] @ motion,
            "sun_arc": state.motions[:, driver],
            "force": force[:meshes],
            "back_force": force[meshes:],
            "stiffness": _both_flanks(tangents, candidates.images, meshes),
            "tooth_load": tooth_load[:meshes],
            "member_motion": motion,
            "edge_contact": candidates.by_pairs(at_edge)[:meshes].any(axis=1),
            "max_pressure": candidates.by_pairs(inner).max(axis=1)[:meshes],
            "pressed": candidates.by_pairs(inner).argmax(axis=1)[:meshes],
            "residual": state.residual,
            "iterations": state.iterations,
        }
        looked = options.both_flanks
        values["back_tooth_load"] = tooth_load[meshes:] if looked else np.zeros(tooth_load.shape)
        if options.pressures:
            values["pressure"] = candidates.by_pairs(pressure)[:meshes]
        if options.held_bodies is not None:
            held = candidates.images_of(options.held_bodies)
            values["held_stiffness"] = _both_flanks(tangents, held, meshes)
            values["held_tangents"] = tangents.between_meshes(held, meshes)
        return values

    def _record(self, values: dict[str, Any], setup: MeshWindows, tau: np.ndarray, unknowns: int) -> MeshCycle:
        """The record from what was found at its positions: with places of the tooth pairs, pins, message.

        ``tau`` are all positions, of every slice.
        """
        cells, every, driven = setup.cells, setup.places[0], self.planetary_set.kind_rows[0]
        meshes = len(self.planetary_set.meshes)
        drive, back = slice(0, meshes), slice(meshes, 2 * meshes)
        values, path, tooth = dict(values), np.moveaxis(setup.zeta, 2, 1), setup.tooth
        if self.repeats > 1:
            values, path, tooth = self._with_all_pairs(values, setup, tau)
        path = path.reshape(*path.shape[:2], len(self.empty.position), -1).mean(axis=-1)
        if self.images > 1:
            s, turned = self.planetary_set, np.zeros((2, meshes), int)
            for rows, pair in zip(s.kind_rows, s.mates, strict=True):
                for place in (place for place in (0, 1) if not s.repeated[pair[place]]):
                    turned[place, rows] = setup.places[1][rows] * (s.gears[pair[place]].teeth // self.images)
            tooth = tooth[:, every] + turned[..., None]
        values |= {"path": path[drive], "tooth": tooth[:, drive]}
        values |= self._most_pressed(values)
        looked = self.options.both_flanks
        values["back_path"] = path[back] if looked else np.zeros_like(path)
        if self.options.ahead is not None:
            values["back_tooth_load"] = np.zeros_like(values["tooth_load"])
        values["back_tooth"] = tooth[:, back] if looked else np.zeros_like(tooth)
        if self.options.pressures:
            values["pressure_offset"] = (np.arange(cells) + 0.5 - 0.5 * cells) * setup.cell[drive, None]
            values.setdefault("pressure_centre", _over_positions(setup.centre[drive], tau[0].size))
        for axes, names in AXES.items():
            if axes[0] == "m" and axes[1] != "m":
                names = (*names, "near") if axes == "mst" else names
                values |= {name: values[name][every] for name in names if name in values}
        if self.repeats > 1:
            values |= self._repeated(values)
        elif self._far_off:
            values["near"] = _pairs_near(setup, meshes, tau[0].size)
        if "near" in values:
            values = self._with_near_pairs(values)
        record = replace(self.empty, **values)
        unloaded = record.force[driven] + record.back_force[driven] <= 0.0
        message = "all positions by the active set"
        if unloaded.any():
            message += "; some planets lose all load"
            if self.springs is not None:
                message += ", their places within the clearance of their bearings are not determined"
        if record.wedged.any():
            message += "; some teeth are wedged between both flanks"
        if (record.back_force[~record.wedged] > 0).any():
            message += "; some meshes carry on their back flanks alone"
        if (friction := self.options.friction) is not None:
            record = replace(record, **friction_of_record(self.planetary_set, friction, record, self.options.ahead))
        return replace(
            record,
            bearing_force=pin_forces(self.planetary_set, record.force, record.back_force, record.friction_force),
            open_planets=unloaded,
            unknowns=unknowns,
            member_names=self.members.names,
            tilt_names=self._tilt_names,
            message=message,
        )

    def _most_pressed(self, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Path and load (meshes, P) of the tooth pair with the largest pressure, in slices of the slice."""
        load, pressed = values["tooth_load"], values.pop("pressed", None)
        path = values["path"][..., : load.shape[-1]]
        if "slice_pressure" in values:
            load, slices = values["slice_load"], self.options.slices
            ahead = np.zeros(slices) if self.options.ahead is None else self.options.ahead
            path = path[:, :, None] + ahead[:, None] * self.planetary_set.base_pitch
            places = len(load), -1, load.shape[-1]
            path, load = np.broadcast_to(path, load.shape).reshape(places), load.reshape(places)
            pressed = values["slice_pressure"].reshape(places).argmax(axis=1)
        assert pressed is not None
        return {
            name: np.take_along_axis(of_pairs, pressed[:, None], axis=1)[:, 0]
            for name, of_pairs in zip(PRESSED, (path, load), strict=True)
        }

    def _with_all_pairs(self, values: dict, setup: MeshWindows, tau: np.ndarray) -> tuple[dict, Any, Any]:
        """Values of the first part with slots for the tooth pairs of all parts, their paths and teeth.

        And which of them had windows, as ``near`` (M, T, P).
        """
        zeta, tooth = pair_paths(self.sector, tau, both_flanks=False)
        pitch, (M, T), kept = self.planetary_set.base_pitch, zeta.shape[::2], setup.zeta.shape[2]
        first = np.rint((setup.zeta[:, 0, 0] - zeta[:, 0, 0]) / pitch).astype(int)
        near = np.moveaxis(setup.listed.near.reshape(M, -1, tau[0].size, setup.listed.near.shape[2]), 3, 1)
        slots = (
            first[:, None] + np.arange(kept),
            (first - setup.listed.first)[:, None] + np.arange(near.shape[1]),
        )
        values = dict(values)
        if "pressed" in values:
            values["pressed"] = values["pressed"] + first[:, None]
        wide: dict[str, tuple[np.ndarray, np.ndarray]] = {"near": (np.asarray(near.any(axis=-1)), slots[1])}
        if self.options.pressures:
            wide["pressure_centre"] = _over_positions(setup.listed.centre, tau[0].size), slots[1]
        wide |= {
            name: (values[name], slots[0])
            for axes, names in AXES.items()
            if axes[:2] == "ms"
            for name in names
            if name in values
        }
        for name, (windowed, places) in wide.items():
            values[name] = np.zeros((M, T, *windowed.shape[2:]), windowed.dtype)
            inside = (places >= 0) & (places < T)
            mesh, slot = np.nonzero(inside)
            values[name][mesh, places[inside]] = windowed[mesh, slot]
        return values, np.moveaxis(zeta, 2, 1), tooth

    def _with_near_pairs(self, values: dict[str, Any]) -> dict[str, Any]:
        """Values without the slots of pairs that never come near."""
        values = dict(values)
        take = kept_pairs(values.pop("near").any(axis=-1))
        mesh = np.arange(len(take))[:, None]
        for axes, names in AXES.items():
            for name in names if "s" in axes else ():
                if name in values:
                    values[name] = values[name][:, mesh, take] if axes == "gms" else values[name][mesh, take]
        return values

    def _repeated(self, values: dict[str, Any]) -> dict[str, Any]:
        """Go on from the first part of the positions to all of them, by fields of `MeshCycle`.

        A rotation that maps planets onto one another takes the set, at another position, into itself: planet
        and tooth pairs are then those of the planet that was there.
        """
        N, P = self.planetary_set.n_planets, len(self.empty.position)
        part, phase = P // self.repeats, np.asarray(self.planetary_set.mesh_phases)
        step = N // self.turns
        later = np.arange(self.turns) * (phase[step] - phase[0]) * self.repeats
        repeated = {name: list[np.ndarray]() for name in values}
        pitch = self.planetary_set.base_pitch
        for number in range(self.repeats):
            away = np.abs(np.mod(later - number + 0.5 * self.repeats, self.repeats) - 0.5 * self.repeats)
            turns = int(np.argmin(away))
            planet = (np.arange(N) + turns * step) % N
            mesh = self.planetary_set.moved_meshes(planet)
            index_of = {"m": mesh, "n": planet}
            slots = {back: same_pairs(values[f"{back}path"], mesh, number * part, pitch) for back in ("", "back_")}
            for axes, names in AXES.items():
                names = (*names, "near") if axes == "mst" else names
                over_positions = (name for name in names if axes[-1] == "t" and name in values)
                for name in (name for name in over_positions if values[name].shape[-1] == part):
                    here = values[name]
                    for place, axis in enumerate(axes[:2]):
                        here = here.take(index_of[axis], axis=place) if axis in index_of else here
                    if axes[:2] == "ms":
                        here = in_slots(here, slots["back_" if name.startswith("back_") else ""])
                    repeated[name].append(here)
            angle = -2.0 * math.pi * turns / self.turns
            moved = {"member_motion": self.members.names, "member_tilt": self._tilt_names}
            for name in (name for name in moved if name in values):
                repeated[name].append(
                    np.concatenate(mapped_members(moved[name], values[name], planet, rotation_matrix(angle)))
                )
        return {name: np.concatenate(parts, axis=-1) for name, parts in repeated.items() if parts}


def _pairs_near(setup: MeshWindows, meshes: int, slices: int) -> np.ndarray:
    """Which pairs of every mesh come near on either flank, in any of the slices, (M, T, P)."""
    listed = setup.listed.near
    listed = listed.reshape(-1, meshes, listed.shape[1] // slices, slices, listed.shape[2])
    near: np.ndarray = np.asarray(listed.any(axis=(0, 3)))
    return near.swapaxes(1, 2)


def _over_positions(values: np.ndarray, slices: int) -> np.ndarray:
    """Values (M, T, P), means over slices, by those (M, P slices, T) of all slices one after the other."""
    return np.moveaxis(values.reshape(len(values), -1, slices, values.shape[2]).mean(axis=2), 2, 1)


def _between_meshes(setup: MeshWindows, tangents: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Compliance between all meshes (M, M, P) [m/N], zero where a mesh carries nothing.

    From the tangents between those that are solved, (H, P, meshes, meshes) in the harmonics over images.
    """
    loaded, (every, sector) = (force > 0).all(axis=0), setup.places
    between = np.zeros(tangents.shape, tangents.dtype)
    between[:, loaded] = np.linalg.inv(tangents[:, loaded])
    away = (sector - sector[:, None]) % setup.images
    return np.fft.irfft(between, n=setup.images, axis=0)[away, :, every[:, None], every]


def _both_flanks(tangents: ContactTangents, images, meshes: int) -> np.ndarray:
    """Tangent stiffness of every mesh (M, P), both flanks together [N/m]."""
    of_images = tangents.of_meshes(images[0])
    return of_images.reshape(len(of_images), -1, meshes).sum(axis=1).T
