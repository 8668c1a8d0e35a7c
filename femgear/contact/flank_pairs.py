"""Mating flanks: their separation, which teeth meet, and the drive and the back side of all meshes.

Both flanks are exact involutes. The separation of a point ``P`` of flank 1 from flank 2 is measured along
the normal of flank 2 through ``P``, which is tangent to the base circle of gear 2: involutes of one base
circle are parallel curves, so the distance is the base radius times the angle between their origins. The
formula holds off the line of action and at tip corners as well. Deviations add separations of profiles along
the flanks (`profile_form`) and of whole tooth pairs (`pair_separations`).

Gear 1 drives. Its flank is drawn as a left flank; roll lengths on gear 1 grow with the path coordinate. Which
teeth a pair consists of is told by `tooth_numbers`; tooth number zero of every gear stands where
`femgear.gears.kinematics.orientations` has its centreline.

The back flanks of a set are the drive flanks of its mirror image (`femgear.gears.planetary.mirrored_set`),
and so are the flanks that a negative torque loads (`femgear.contact.cycle.loaded_image`). Of M meshes mesh
``M + j`` is the back side of mesh ``j``: its path coordinate runs backwards, and its flanks approach when
those of mesh ``j`` part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import ContactError
from femgear.gears.deviations import (
    SetDeviations,
    body_separation,
    profile_separation,
    tooth_separation,
)
from femgear.gears.faults import LEFT, RIGHT, fault_form, flank_limits
from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations, pitch_tooth
from femgear.gears.pair import GearSet
from femgear.gears.planetary import mirrored_set

DRIVE_SIDE, BACK_SIDE = 1.0, -1.0
"""Sides of a mesh: whether the path coordinate grows or falls with the position."""


@dataclass(frozen=True)
class FlankPair:
    """Geometry of two mating flanks at a fixed centre distance.

    Parameters
    ----------
    base_radius_1, base_radius_2 : float
        [m].
    centre_distance, pressure_angle : float
        Working values [m], [rad].
    sign : float
        +1 for two external gears, -1 when gear 2 is internal.
    limits_1, limits_2 : tuple of float
        Smallest and largest roll length of the two flanks [m].
    """

    base_radius_1: float
    base_radius_2: float
    centre_distance: float
    pressure_angle: float
    sign: float
    limits_1: tuple[float, float]
    limits_2: tuple[float, float]

    @property
    def pitch_roll_1(self) -> float:
        """Roll length of flank 1 at the pitch point [m]."""
        return self.base_radius_1 * np.tan(self.pressure_angle)

    @property
    def pitch_roll_2(self) -> float:
        """Roll length of flank 2 at the pitch point [m]."""
        return self.base_radius_2 * np.tan(self.pressure_angle)

    @property
    def path(self) -> tuple[float, float]:
        """Ends of the path of contact, measured from the pitch point in the direction of motion [m]."""
        begin, end = self.path_between(np.array([self.limits_1, self.limits_2]))
        return float(begin), float(end)

    def path_between(self, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends (...) [m] of the path of contact of flanks between roll lengths (2, 2, ...) [m], as of `path`."""
        roll_2 = np.sort(self.sign * (self.pitch_roll_2 - limits[1]), axis=0)
        start = np.maximum(limits[0, 0] - self.pitch_roll_1, roll_2[0])
        return start, np.minimum(limits[0, 1] - self.pitch_roll_1, roll_2[1])

    def roll_on(self, gear: int, zeta):
        """Roll length [m] on gear 1 (0) or gear 2 (1) at path coordinates, kept on the path of contact."""
        zeta = np.clip(zeta, *self.path)
        return self.pitch_roll_1 + zeta if gear == 0 else self.pitch_roll_2 - self.sign * zeta


def flank_pair(gear_1: Gear, gear_2: Gear, centre_distance: float, pressure_angle: float) -> FlankPair:
    """Pair the flanks of two gears at a centre distance [m] and working pressure angle [rad].

    Gear 2 may be internal.
    """
    ends_1 = sorted((_roll(gear_1, gear_1.form_radius), _roll(gear_1, gear_1.tip_radius)))
    ends_2 = sorted((_roll(gear_2, gear_2.form_radius), _roll(gear_2, gear_2.tip_radius)))
    return FlankPair(
        base_radius_1=gear_1.base_radius,
        base_radius_2=gear_2.base_radius,
        centre_distance=centre_distance,
        pressure_angle=pressure_angle,
        sign=-1.0 if gear_2.internal else 1.0,
        limits_1=(ends_1[0], ends_1[1]),
        limits_2=(ends_2[0], ends_2[1]),
    )


def separation(pair: FlankPair, zeta, roll_1):
    """Compute the separation of flank 1 from flank 2 and the roll length of the foot point on flank 2.

    From arrays (...) that broadcast: path coordinates ``zeta`` of the tooth pair and roll lengths ``roll_1`` on flank
    1, all in m. The separation is along the normal of flank 2.
    """
    rb1, rb2, sign = pair.base_radius_1, pair.base_radius_2, pair.sign
    # polar angle of an involute point: origin angle less the involute function of its pressure angle
    origin = (pair.pitch_roll_1 + zeta) / rb1 - pair.pressure_angle
    angle = origin - (roll_1 / rb1 - np.arctan2(roll_1, rb1))
    radius = np.hypot(rb1, roll_1)
    x = sign * (sign * pair.centre_distance - radius * np.cos(angle))
    y = -sign * radius * np.sin(angle)
    length = np.sqrt(np.maximum(x**2 + y**2 - rb2**2, 0.0))
    involute = length / rb2 - np.arctan2(length, rb2)
    origin_2 = (pair.pitch_roll_2 - sign * zeta) / rb2 - pair.pressure_angle
    gap = sign * rb2 * (np.arctan2(y, x) + involute - origin_2)
    return gap, length - sign * gap


def admissible_arcs(pair: FlankPair, zeta, limits: np.ndarray | None = None):
    """Find the range of arc length on flank 1 whose points and foot points both lie on the flanks.

    At path coordinates ``zeta`` [m]; ``low`` and ``high``, of the same shape, are arc lengths from the base
    circle along flank 1 [m]. Flanks that are not whole have ``limits`` (2, 2, ...) of their own: smallest and largest
    roll length of gear 1 and gear 2 [m].
    """
    zeta = np.asarray(zeta, float)
    rb1 = pair.base_radius_1
    limits_1, limits_2 = (pair.limits_1, pair.limits_2) if limits is None else limits
    low = np.full(zeta.shape, np.asarray(limits_1[0]) ** 2 / (2 * rb1))
    high = np.full(zeta.shape, np.asarray(limits_1[1]) ** 2 / (2 * rb1))
    for bound in range(2):
        arc = _arc_of_foot(pair, zeta, limits_2[bound])
        # along flank 1 the foot point moves down an external flank 2 and up an internal one
        if (bound == 0) == (pair.sign > 0):
            high = np.minimum(high, arc)
        else:
            low = np.maximum(low, arc)
    return low, high


def mesh_pairs(planetary_set: GearSet) -> tuple[FlankPair, ...]:
    """Flank pairs of every kind of mesh of a set, such as sun-planet and planet-ring."""
    return tuple(
        flank_pair(kind.gear_1, kind.gear_2, kind.centre_distance, kind.working_pressure_angle)
        for kind in planetary_set.kinds
    )


def acting_flanks(planetary_set: GearSet) -> list[tuple[int, list[tuple[int, int, int]]]]:
    """List all bodies of a set: number of the gear, and drive flanks (mesh, gear of the pair, side)."""
    flanks = []
    for number, body in enumerate(planetary_set.bodies):
        ahead = planetary_set.senses[body.gear] > 0
        # gear 1 pushes with the flank that goes ahead, gear 2 is pushed on the one behind
        acting = [
            (j, place, LEFT if ahead == (place == 0) else RIGHT)
            for j, mesh in enumerate(planetary_set.meshes)
            for place in (0, 1)
            if mesh.bodies[place] == number
        ]
        flanks.append((body.gear, acting))
    return flanks


def tooth_numbers(planetary_set: GearSet, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the teeth of gear 1 and gear 2, (meshes, pairs) each, that make up the pairs `index`.

    A pair of mesh j with index i touches at the pitch point when the position is ``-(phase_j + i)``; the
    tooth is then at the planet's angle, less its half thickness, which fixes its place on the body.
    """
    s, at = planetary_set, orientations(planetary_set).bodies
    exact = np.zeros((2, *index.shape))
    turns = np.asarray(s.mesh_phases)[:, None] + index
    for j, mesh in enumerate(s.meshes):
        for place, body in enumerate(mesh.bodies):
            number = s.bodies[body].gear
            away = mesh.angle + sum(pitch_tooth(s, mesh.kind, place)) - at[body]
            exact[place, j] = away / s.gears[number].pitch_angle + s.senses[number] * turns[j]
    whole = np.rint(exact).astype(int)
    if np.abs(exact - whole).max() > 1e-3:
        raise ContactError(
            "the phases of the meshes and the positions of the teeth contradict one another",
            code="E-CONTACT",
            remedy="planet angles must be whole multiples of 360/(z_sun + z_ring) degrees from one another",
        )
    return whole[0], whole[1]


def flank_side(planetary_set: GearSet, direction: float) -> tuple[np.ndarray, np.ndarray]:
    """Phases (meshes,) and clearances (meshes,) [m] of all meshes on the drive (+1) or back (-1) side.

    The clearance is the separation of that side when the drive flanks just touch: zero, or the backlash.
    """
    s = planetary_set
    if direction > 0:
        return np.asarray(s.mesh_phases), np.zeros(len(s.meshes))
    mirrored, order = mirrored_set(s)
    phase = np.empty(len(s.meshes))
    phase[s.moved_meshes(order)] = mirrored.mesh_phases
    phase += _mirrored_position(s, mirrored)
    return phase, s.of_kinds([kind.backlash for kind in s.kinds])


def side_teeth(planetary_set: GearSet, index: np.ndarray, direction: float):
    """Find the teeth (2, meshes, pairs) of the pairs `index` of a side, in the drive side's count."""
    if direction > 0:
        return np.stack(tooth_numbers(planetary_set, index))
    s = planetary_set
    mirrored, order = mirrored_set(s)
    rows = s.moved_meshes(order)
    teeth = np.empty((2, *index.shape), int)
    teeth[:, rows] = -np.stack(tooth_numbers(mirrored, index[rows]))
    # the tooth that the mirror image counts as zero stands here, counted in the original
    here, image = orientations(s), orientations(mirrored, _mirrored_position(s, mirrored))
    places = np.argsort(order)
    for j, mesh in enumerate(s.meshes):
        for place, body in enumerate(mesh.bodies):
            number, copy = s.bodies[body].gear, s.bodies[body].copy
            reflected = image.gears[number][places[copy] if s.repeated[number] else copy]
            away = 2 * s.planet_angles[0] - reflected - here.gears[number][copy]
            teeth[place, j] += np.rint(away / s.gears[number].pitch_angle).astype(int)
    return teeth


def profile_form(
    planetary_set: GearSet,
    deviations: SetDeviations | None,
    kind: int,
    back: bool,
    tooth: np.ndarray | None = None,
    turns: np.ndarray | None = None,
    slices: int = 1,
) -> Callable | None:
    """Separation [m] by deviations of the profiles as a function of both roll lengths [m], or None.

    `kind` is that of the mesh, 0 for sun-planet and 1 for planet-ring. With the teeth (2, meshes, pairs) of all
    meshes in the first mesh period and the periods passed (P,) faults of teeth count; roll lengths then are (meshes of
    the kind, P, pairs, n). So many ``slices`` of the width at a time have positions of their own.
    """
    if deviations is None:
        return None
    forms = []
    if any(form.profile for form in deviations.mesh_forms(kind, back)):
        forms.append(
            lambda roll_1, roll_2: profile_separation(deviations, planetary_set, kind, roll_1, roll_2, back=back)
        )
    if deviations.faults and tooth is not None and turns is not None:
        teeth_and_sides = _met(planetary_set, kind, back, tooth, turns)
        faulty = fault_form(deviations.faults, planetary_set, kind, *teeth_and_sides, slices)
        forms += [faulty] if faulty else []
    if len(forms) < 2:
        return forms[0] if forms else None
    return lambda roll_1, roll_2: forms[0](roll_1, roll_2) + forms[1](roll_1, roll_2)


def pair_limits(
    planetary_set: GearSet,
    deviations: SetDeviations | None,
    pair: FlankPair,
    kind: int,
    back: bool,
    tooth: np.ndarray,
    turns: np.ndarray,
) -> np.ndarray | None:
    """Find where the flanks of pairs (2, 2, meshes of the kind, P, pairs) end [m]; None where all are whole.

    As of `femgear.gears.faults.flank_limits`, from teeth (2, meshes, pairs) in the first mesh period and the mesh
    periods passed (P,).
    """
    if deviations is None or not deviations.faults:
        return None
    whole = np.array([pair.limits_1, pair.limits_2])
    return flank_limits(deviations.faults, planetary_set, kind, *_met(planetary_set, kind, back, tooth, turns), whole)


def _met(planetary_set: GearSet, kind: int, back: bool, tooth, turns) -> tuple[np.ndarray, np.ndarray]:
    """Teeth (2, meshes of the kind, P, pairs) that meet, and the flanks (2, meshes of the kind) with which."""
    rows, sides = np.flatnonzero(planetary_set.mesh_kind == kind), np.zeros((2, len(planetary_set.meshes)), int)
    for _, acting in acting_flanks(planetary_set):
        for mesh, place, side in acting:
            sides[place, mesh] = RIGHT - side if back else side
    steps = np.array([tooth_steps(planetary_set, rows, place) for place in (0, 1)])
    return tooth[:, rows, None] + steps[:, :, None, None] * turns[:, None], sides[:, rows]


def pair_separations(
    planetary_set: GearSet, deviations: SetDeviations | None, tooth, turns, tau, *, back: bool
) -> np.ndarray:
    """Compute the separations of whole tooth pairs by errors of pitch and position [m], (meshes, P, pairs).

    Parameters
    ----------
    tooth : (2, meshes, pairs) int array
        Tooth numbers during the first mesh period.
    turns, tau : (P,) int array, (P,) array
        Mesh periods passed, and positions [mesh periods].
    back : bool
        Whether it is the back side.
    """
    meshes = len(planetary_set.meshes)
    shift = np.zeros((meshes, len(tau), tooth.shape[2]))
    if deviations is None:
        return shift
    shift += body_separation(deviations, planetary_set, tau, back=back)[:, :, None]
    for mesh in range(meshes):
        first, second = (tooth[gear, mesh] + tooth_steps(planetary_set, mesh, gear) * turns[:, None] for gear in (0, 1))
        shift[mesh] += tooth_separation(deviations, mesh, first, second, back=back)
    return shift


def tooth_steps(planetary_set: GearSet, mesh, gear):
    """Change of the tooth numbers of a mesh from one mesh period to the next (arrays or numbers).

    The sun's teeth move on by one, -1 in its count; those of planets and ring back, +1.
    """
    kind = planetary_set.mesh_kind[mesh]
    return -np.array(planetary_set.senses)[np.array(planetary_set.mates)[kind, gear]]


def _roll(gear: Gear, radius: float) -> float:
    """Roll length [m] of a radius [m], zero inside the base circle."""
    return float(np.sqrt(max(radius**2 - gear.base_radius**2, 0.0)))


def _arc_of_foot(pair: FlankPair, zeta, roll_2):
    """Arc length on flank 1 of the point whose foot on flank 2 has the roll length `roll_2` (secant)."""
    rb1, rb2 = pair.base_radius_1, pair.base_radius_2
    target = roll_2**2 / (2 * rb2)
    contact_1 = np.maximum(pair.pitch_roll_1 + zeta, 0.0) ** 2 / (2 * rb1)
    contact_2 = np.maximum(pair.pitch_roll_2 - pair.sign * zeta, 0.0) ** 2 / (2 * rb2)
    arc = contact_1 + pair.sign * (contact_2 - target)
    for _ in range(12):
        roll_1 = np.sqrt(2 * rb1 * np.maximum(arc, 0.0))
        foot = separation(pair, zeta, roll_1)[1]
        error = foot * np.abs(foot) / (2 * rb2) - target
        arc = arc + pair.sign * error
        if np.abs(error).max(initial=0.0) < 1e-15:
            break
    return arc


def _mirrored_position(planetary_set, mirrored) -> float:
    """Position of the mirror image, in [0, 1), at which its sun stands like the original at zero."""
    image, original = orientations(mirrored).sun, orientations(planetary_set).sun
    turns = (2 * planetary_set.planet_angles[0] - image - original) / planetary_set.gears[0].pitch_angle
    return float(turns - np.floor(turns))
