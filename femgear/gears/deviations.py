"""Deviations of a planetary set from its ideal gears, as separations of the loaded flanks.

All separations are in metres along the flank normal, positive where material is missing or flanks stand
further apart; they add to the gap of the contact problem. Loaded flanks are those of a positive sun torque:
left of the sun on left of the planet ("sun side"), right of the planet ("ring side") on left of the ring; a
negative torque loads the flanks that the mirror image of the set has there (`mirrored_deviations`).

Teeth are numbered counter-clockwise; tooth 0 of a gear is the one whose centre `kinematics.orientations`
gives: of the sun and of every planet a tooth that touches at the pitch point of its mesh "sun-planet" at the
position ``-phi``, of the ring one that touches at the pitch point of "planet 1-ring" there. A displacement
``u`` of a body changes the separation by its component along the line of action: involute flanks are parallel
curves, so this is exact to first order (the next term is ``u^2`` over the centre distance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np

from femgear.gears.faults import ToothFault, fault_periods
from femgear.gears.gear import Gear, GeometryWarning
from femgear.gears.kinematics import across, body_approach, mesh_normals, orientations, unit_vectors
from femgear.gears.modifications import FlankForm, check_flank, form_deviation, lead_deviation, profile_height
from femgear.gears.pair import BRANCH, GearSet

_MISALIGNMENTS = ("sun_misalignment", "carrier_misalignment", "planet_misalignment")
LONGEST_RECORD = 256
"""Mesh periods that a record spans at most unless told otherwise."""
LONGEST_SEARCH = 4096
"""Mesh periods that are searched for the least play."""


@dataclass(frozen=True)
class Runout:
    """Eccentricity of a gear: the centre of its teeth lies off its axis of rotation.

    Parameters
    ----------
    amplitude : float
        Distance of the two centres [m], half of the total reading F_r of ISO 1328-2.
    phase : float
        Direction of the teeth's centre in the body [rad], counter-clockwise from the centre of tooth 0; of
        the carrier from the x axis of its frame.
    """

    amplitude: float = 0.0
    phase: float = 0.0

    def moved(self, x: float, y: float) -> Runout:
        """Move the centre of the teeth by x and y in the body [m], x towards the centre of tooth 0."""
        centre = self.amplitude * np.exp(1j * self.phase) + complex(x, y)
        return Runout(float(abs(centre)), float(np.angle(centre))) if x or y else self


@dataclass(frozen=True)
class Ovality:
    """Out-of-roundness of the ring: ``u_r = amplitude cos(n (phi - phase))``, outwards positive.

    Parameters
    ----------
    nodal_diameter : int
        n, at least 1.
    amplitude : float
        [m]
    phase : float
        Angle of a crest on the ring from the centre of its tooth 0 [rad].
    inextensional : bool
        Whether the teeth also shift along the circle as those of a ring that was bent without being
        stretched do, ``u_t = -(amplitude/n) sin(n (phi - phase))``; otherwise they keep their angles.
    """

    nodal_diameter: int = 2
    amplitude: float = 0.0
    phase: float = 0.0
    inextensional: bool = False


@dataclass(frozen=True, eq=False)
class SetDeviations:
    """All deviations of a set with N planets; the module tells numbering and signs.

    Parameters
    ----------
    sun, planet_sun_side, planet_ring_side, ring : FlankForm
        Modifications of the loaded flanks; those of sun and ring stand for both flanks of a tooth.
    sun_pitch, ring_pitch : (z,) array
        Separation of each tooth's loaded flank from its cumulative pitch deviation [m].
    planet_pitch, planet_ring_side_pitch : (N, z_p) array
        The same of the sun-side (left) and ring-side (right) flanks of every planet [m].
    planet_runout : tuple of Runout
        Eccentricity of every planet.
    pin_errors : (N, 2) array
        Radial (outwards) and tangential (counter-clockwise) displacement of the planet axes [m].
    sun_thickness, ring_thickness : float
        Reduction of the tooth thickness at the reference circle [m]; it only adds backlash.
    planet_thickness : (N,) array
        The same of every planet [m]. Only its differences separate loaded flanks: they stay in touch on the
        planet with the thickest teeth, as they do for the set's own allowances.
    planet_misalignment : (N, 2) array
        Radial and tangential slope of the planet axes [rad]: rise of `pin_errors` per width towards z > 0.
    sun_misalignment, carrier_misalignment : (2,) arrays
        Slopes of their axes along x and y of the carrier frame [rad], in which they stand still; the carrier
        takes its planets along.
    sun_runout, ring_runout, carrier_runout : Runout
        Eccentricity of sun, ring and carrier; that of the carrier moves all planets.
    ovality : Ovality
        Out-of-roundness of the ring.
    faults : tuple of ToothFault
        Of single teeth.
    """

    sun: FlankForm
    planet_sun_side: FlankForm
    planet_ring_side: FlankForm
    ring: FlankForm
    sun_pitch: np.ndarray
    planet_pitch: np.ndarray
    planet_ring_side_pitch: np.ndarray
    ring_pitch: np.ndarray
    planet_runout: tuple[Runout, ...]
    pin_errors: np.ndarray
    planet_thickness: np.ndarray
    planet_misalignment: np.ndarray
    sun_misalignment: np.ndarray = field(default_factory=lambda: np.zeros(2))
    carrier_misalignment: np.ndarray = field(default_factory=lambda: np.zeros(2))
    sun_runout: Runout = Runout()
    ring_runout: Runout = Runout()
    carrier_runout: Runout = Runout()
    ovality: Ovality = Ovality()
    sun_thickness: float = 0.0
    ring_thickness: float = 0.0
    faults: tuple[ToothFault, ...] = ()

    def __post_init__(self):
        pitches = ("sun_pitch", "planet_pitch", "planet_ring_side_pitch", "ring_pitch")
        for name in (*pitches, "pin_errors", "planet_thickness", *_MISALIGNMENTS):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def mesh_forms(self, kind: int, back: bool) -> tuple[FlankForm, FlankForm]:
        """Find the modifications of gear 1 and gear 2 in the sun-planet (0) or planet-ring (1) meshes.

        On the back side a planet meets sun and ring with its other flanks.
        """
        planet = self.planet_sun_side if (kind == 0) != back else self.planet_ring_side
        return (self.sun, planet) if kind == 0 else (planet, self.ring)

    @property
    def ideal(self) -> bool:
        """Whether nothing here separates a loaded flank."""
        forms = (self.sun, self.planet_sun_side, self.planet_ring_side, self.ring)
        pitches = (self.sun_pitch, self.planet_pitch, self.planet_ring_side_pitch, self.ring_pitch)
        runouts = (self.sun_runout, self.ring_runout, self.carrier_runout, *self.planet_runout)
        return not (
            any(form.modifications for form in forms)
            or any(pitch.any() for pitch in pitches)
            or any(runout.amplitude for runout in runouts)
            or self.pin_errors.any()
            or self.ovality.amplitude
            or np.ptp(self.planet_thickness)
            or self.misaligned
            or self.faults
        )

    @property
    def misaligned(self) -> bool:
        """Whether any axis is askew."""
        return any(getattr(self, name).any() for name in _MISALIGNMENTS)


def rotational_symmetry(d: SetDeviations, s: GearSet) -> int:
    """Find the largest g for which a turn by ``2 pi/g`` takes every planet to the place of one like it."""
    even, places = no_deviations(s), np.exp(1j * np.asarray(s.planet_angles))
    forms = {name: getattr(even, name) for name in ("sun", "planet_sun_side", "planet_ring_side", "ring")}
    most = s.n_planets if replace(d, **forms).ideal else 1
    turned = {g: places[:, None] * np.exp(2j * np.pi / g) for g in range(1, most + 1)}
    return max(g for g, turned_places in turned.items() if np.abs(turned_places - places).min(axis=1).max() < 1e-6)


def no_deviations(planetary_set: GearSet) -> SetDeviations:
    """Make the deviations of ideal gears: none. `dataclasses.replace` puts in what there is."""
    s, N = planetary_set, planetary_set.n_planets
    return SetDeviations(
        sun=FlankForm(),
        planet_sun_side=FlankForm(),
        planet_ring_side=FlankForm(),
        ring=FlankForm(),
        sun_pitch=np.zeros(s.gears[0].teeth),
        planet_pitch=np.zeros((N, s.gears[BRANCH].teeth)),
        planet_ring_side_pitch=np.zeros((N, s.gears[BRANCH].teeth)),
        ring_pitch=np.zeros(s.gears[-1].teeth),
        planet_runout=(Runout(),) * N,
        pin_errors=np.zeros((N, 2)),
        planet_thickness=np.zeros(N),
        planet_misalignment=np.zeros((N, 2)),
    )


def tooth_displacements(gear: Gear, *, cumulative=None, single=None) -> np.ndarray:
    """Compute the displacement (z,) of every tooth along the base circle [m], counter-clockwise positive.

    Parameters
    ----------
    cumulative : (z,) sequence, optional
        Cumulative pitch deviations on the reference circle [m].
    single : (z,) sequence, optional
        Deviations of the pitches from tooth i - 1 to tooth i [m] where no cumulative ones are given; what
        their sum misses zero by is spread over all pitches, and tooth 0 stays in place.
    """
    along = np.zeros(gear.teeth)
    if cumulative is not None:
        along = np.array(cumulative, float)
    elif single is not None:
        steps = np.asarray(single, float) - np.mean(single)
        along = np.cumsum(steps) - steps[0]
    return along * (gear.base_radius / gear.reference_radius)


def profile_separation(
    deviations: SetDeviations, planetary_set: GearSet, kind: int, roll_1, roll_2, *, back: bool = False
):
    """Compute the separation [m] of two flanks by their modifications, of the shape of both roll lengths [m].

    The roll lengths (...) [m] of the facing points on gear 1 and gear 2 broadcast; ``kind`` is 0 for sun-planet (gear 1
    is the sun), 1 for planet-ring (gear 1 is the planet). With ``back`` the other flanks of the teeth; those
    of a planet are its ring side in the mesh with the sun.
    """
    form_1, form_2 = deviations.mesh_forms(kind, back)
    gear_1, gear_2 = planetary_set.kinds[kind].gears
    return form_deviation(form_1, gear_1, roll_1) + form_deviation(form_2, gear_2, roll_2)


def lead_separation(
    deviations: SetDeviations,
    planetary_set: GearSet,
    slices: int,
    rolls: np.ndarray | None = None,
    *,
    back: bool = False,
) -> np.ndarray:
    """Compute the separation (2N, ..., slices) [m] of the flanks of every mesh over the width.

    Means over equal slices of the common width of both gears, by the modifications of both flanks along the
    lead and by axes askew, which displace a section as a motion of the member by slope times z would. The
    roll lengths (2, 2N, ...) [m] on gear 1 and 2 of every mesh are those halfway along the profiles when left
    out.
    """
    d, s, fine = deviations, planetary_set, 16
    place_over_width = (np.arange(slices * fine) + 0.5) / (slices * fine) - 0.5
    apart = -misaligned_approach(d, s, back=back)
    per_form = []
    for mesh, kind in enumerate(s.mesh_kind.tolist()):
        place = s.mesh_widths[kind] * place_over_width
        removed = apart[mesh] * place
        for i, form in enumerate(d.mesh_forms(kind, back=back)):
            gear = s.kinds[kind].gears[i]
            height = 0.0 if rolls is None else profile_height(gear, rolls[i][mesh])[..., None]
            removed = removed + lead_deviation(form, gear.face_width, place, height)
        per_form.append(removed)
    per_form = np.array(per_form)
    return per_form.reshape(*per_form.shape[:-1], slices, fine).mean(axis=-1)


def misaligned_approach(d: SetDeviations, s: GearSet, *, back: bool = False) -> np.ndarray:
    """Compute the approach (2N,) of the flanks of every mesh by axes askew, per place over the width [1]."""
    if not any(
        np.any(misalignment) for misalignment in (d.planet_misalignment, d.sun_misalignment, d.carrier_misalignment)
    ):
        return np.zeros(len(s.mesh_names))
    effect, radial = body_approach(s, back=back)[..., :2], unit_vectors(np.asarray(s.planet_angles))
    number = np.array([body.gear for body in s.bodies])
    sun, branch = (effect[:, number == gear].sum(axis=1) for gear in (0, BRANCH))
    outwards, along = d.planet_misalignment.T[..., None]
    planets = outwards * radial + along * across(radial) + d.carrier_misalignment
    planets = planets[[mesh.copy for mesh in s.meshes]]
    return sun @ d.sun_misalignment + (branch * planets).sum(axis=1)


def tooth_separation(deviations: SetDeviations, mesh: int, tooth_1, tooth_2, *, back: bool = False):
    """Compute the separation [m] of the loaded flanks of teeth by pitch deviations, of the teeth's shape.

    The numbers (...) of the teeth on gear 1 and gear 2 broadcast, and are taken modulo the tooth numbers; the mesh
    is 0 .. N-1 for sun-planet, N .. 2N-1 for planet-ring. With ``back`` the other flanks of the teeth: a
    tooth of sun or ring moves as a whole.
    """
    d, N = deviations, len(deviations.planet_pitch)
    planets = d.planet_pitch if (mesh < N) != back else d.planet_ring_side_pitch
    planet, whole = planets[mesh % N], -1.0 if back else 1.0
    errors_1, errors_2 = (whole * d.sun_pitch, planet) if mesh < N else (planet, whole * d.ring_pitch)
    return errors_1[np.asarray(tooth_1) % len(errors_1)] + errors_2[np.asarray(tooth_2) % len(errors_2)]


def body_separation(deviations: SetDeviations, planetary_set: GearSet, position, *, back: bool = False) -> np.ndarray:
    """Compute the separation (2N, P) [m] of every mesh by runouts, pin errors, ovality and planet thickness.

    ``n . (u_2 - u_1)`` at positions tau (P,), in mesh periods and beyond 1 too, with the normals of
    `mesh_normals` and the displacements of both bodies, and the part of the reduced tooth thickness on that
    side. Of the other flanks, with ``back``, it is what adds to the backlash of the set, thickness of all
    gears too.
    """
    d, s = deviations, planetary_set
    moved = _relative_displacements(d, s, np.atleast_1d(np.asarray(position, float)))
    normals = mesh_normals(s, back=back) @ np.array([1.0, 1.0j])
    copies = [mesh.copy for mesh in s.meshes]
    thinner = 0.5 * (d.planet_thickness - d.planet_thickness.min())[copies]
    if back:
        others = np.array([d.sun_thickness, d.ring_thickness])[s.mesh_kind]
        thinner = others + d.planet_thickness[copies] - thinner
    return np.real(normals.conj()[:, None] * moved) + thinner[:, None] * math.cos(s.gears[0].pressure_angle)


def _relative_displacements(d: SetDeviations, s: GearSet, position: np.ndarray) -> np.ndarray:
    """Displacement of gear 2 less that of gear 1 of every mesh, (meshes, P), as x + iy."""
    psi, runouts = np.asarray(s.planet_angles), ((d.sun_runout,), d.planet_runout, (d.ring_runout,))
    angles = [
        [angle + sense * (position * gear.pitch_angle) for angle in start]
        for gear, sense, start in zip(s.gears, s.senses, orientations(s).gears, strict=True)
    ]
    moved = [
        np.array([_turning(*motion) for motion in zip(runout, turned, strict=True)])
        for runout, turned in zip(runouts, angles, strict=False)
    ]
    # pin errors and the eccentric pin circle
    pins = d.pin_errors @ np.array([1.0, 1.0j]) * np.exp(1j * psi)
    moved[BRANCH] = (pins + _turning(d.carrier_runout, 0.0))[:, None] + moved[BRANCH]
    moved[-1] = moved[-1] + _oval(d.ovality, psi, angles[-1][0])
    return np.concatenate([moved[body_2] - moved[body_1] for body_1, body_2 in s.mates])


def _turning(runout: Runout, tooth_zero) -> np.ndarray:
    """Displacement, as x + iy, of a body whose tooth 0 stands at the angles `tooth_zero` (P,)."""
    return runout.amplitude * np.exp(1j * (tooth_zero + runout.phase))


def _oval(ovality: Ovality, psi: np.ndarray, ring_angle: np.ndarray) -> np.ndarray:
    """Displacement (N, P), as x + iy, of the ring at the planets' angles."""
    n = ovality.nodal_diameter
    wave = n * (psi[:, None] - ring_angle - ovality.phase)
    along = -np.sin(wave) / n if ovality.inextensional else 0.0
    return ovality.amplitude * (np.cos(wave) + 1j * along) * np.exp(1j * psi[:, None])


def common_period(deviations: SetDeviations, planetary_set: GearSet, *, limit: int = LONGEST_RECORD) -> tuple[int, str]:
    """Find the number of mesh periods after which a set with deviations repeats.

    A member whose teeth or whose axis deviate repeats after the mesh periods of its own turn against the
    carrier, one a tooth, or after an integer part of it if the deviations repeat earlier; all together after
    their least common multiple (the hunting period). Modifications, pin errors and an eccentric carrier
    stand still in the carrier frame.

    Parameters
    ----------
    limit : int
        Most mesh periods wanted. Beyond it the record is one turn of the carrier against the ring, z_r mesh
        periods, or the limit when even that is too long; it then does not close.

    Returns
    -------
    periods : int
        Mesh periods after which all repeats, or that the record spans.
    message : str
        What decided it, in one sentence.
    """
    parts = {name: count for name, count in _own_periods(deviations, planetary_set) if count > 1}
    if not parts:
        return 1, "one mesh period: no deviation turns with a body"
    periods = math.lcm(*parts.values())
    causes = ", ".join(f"{name} {count}" for name, count in parts.items())
    if periods <= limit:
        return periods, f"{periods} mesh periods, after which all repeats ({causes})"
    teeth = planetary_set.gears[-1].teeth
    if teeth <= limit:
        kept, what = teeth, "one turn of the carrier against the ring"
    else:
        kept, what = limit, "the most allowed"
    return kept, (
        f"{kept} mesh periods, {what}: all repeats only after {periods} ({causes}), more than the limit of "
        f"{limit}; the record does not close"
    )


def _own_periods(d: SetDeviations, s: GearSet):
    """Name and number of mesh periods after which the deviations of every kind of body repeat."""
    first, each, last = s.gears[0], s.gears[BRANCH], s.gears[-1]
    faulty = [fault_periods(d.faults, number, gear.teeth) for number, gear in enumerate(s.gears)]
    yield first.name, math.lcm(_repeat(d.sun_pitch), first.teeth if d.sun_runout.amplitude else 1, faulty[0])
    planets = [
        math.lcm(_repeat(sun_side), _repeat(two), each.teeth if runout.amplitude else 1)
        for sun_side, two, runout in zip(d.planet_pitch, d.planet_ring_side_pitch, d.planet_runout, strict=True)
    ]
    yield "planets" if s.repeated[BRANCH] else each.name, math.lcm(*planets, faulty[BRANCH])
    oval = last.teeth // math.gcd(last.teeth, d.ovality.nodal_diameter) if d.ovality.amplitude else 1
    yield last.name, math.lcm(_repeat(d.ring_pitch), last.teeth if d.ring_runout.amplitude else 1, oval, faulty[-1])


def _repeat(values: np.ndarray) -> int:
    """Smallest divisor of the number of teeth by which the values may be shifted without a change."""
    count = len(values)
    return next(
        step for step in range(1, count + 1) if count % step == 0 and np.array_equal(values, np.roll(values, step))
    )


def without_turning(d: SetDeviations, s: GearSet) -> SetDeviations:
    """Leave out what belongs to teeth or turns with a gear; the rest stands still in the carrier's frame."""
    even = no_deviations(s)
    pitches = ("sun_pitch", "planet_pitch", "planet_ring_side_pitch", "ring_pitch")
    names = (*pitches, "sun_runout", "planet_runout", "ring_runout", "ovality", "faults")
    return replace(d, **{name: getattr(even, name) for name in names})


def planet_shift(d: SetDeviations, s: GearSet, symmetry: int, periods: int) -> Fraction | None:
    """Find the mesh periods after which every planet does what the one behind it did, with all errors.

    The planet behind is that at the angle ``2 pi/symmetry``, whose turn maps the planets on one another. Sun
    and ring come with the same tooth after ``z_sun/symmetry`` and ``-z_ring/symmetry`` mesh periods; planets
    must bring errors of their own. None: no such time within the common ``periods`` of the errors.
    """
    if any(fault.gear == BRANCH for fault in d.faults):
        return None
    sun_repeat, ring_repeat = (
        math.lcm(_repeat(pitch), fault_periods(d.faults, number, len(pitch)))
        for number, pitch in ((0, d.sun_pitch), (len(s.gears) - 1, d.ring_pitch))
    )
    ahead, N = s.n_planets // symmetry, s.n_planets
    behind, phases = (np.arange(N) - ahead) % N, np.asarray(s.mesh_phases[:N])
    meshes = s.moved_meshes(behind)
    position, step = np.arange(periods) + 0.25, -s.senses[BRANCH]
    there = body_separation(d, s, position)
    close = 1e-9 * np.abs(there).max(initial=0.0)
    first, last = Fraction(s.gears[0].teeth, symmetry), Fraction(s.gears[-1].teeth, symmetry)
    for count in range(periods):
        shift = first % 1 + count
        if (shift - first) % sun_repeat or (shift + last) % ring_repeat:
            continue
        turned = step * np.rint(float(shift) + phases - phases[behind]).astype(int)
        pitches = d.planet_pitch, d.planet_ring_side_pitch
        alike = (np.array_equal(np.roll(pitch[n], -turned[n]), pitch[behind[n]]) for pitch in pitches for n in range(N))
        if all(alike):
            here = body_separation(d, s, position + float(shift))
            if np.abs(here - there[meshes]).max() <= close:
                return shift
    return None


def mirrored_deviations(deviations: SetDeviations, planetary_set: GearSet, mirrored: GearSet, order) -> SetDeviations:
    """Find the deviations that the mirror image of the set has, for a torque that loads the other flanks.

    The image is taken at the line through the first planet, with the sun where it was and the play of all
    meshes taken up the other way. The sun then drives the right flanks of the planets, here the ring side;
    a tooth of sun or ring has the same form on both flanks and its pitch deviation moves it as a whole. The
    mirrored set has the planet angles ``2 psi_1 - psi``, ascending from the first planet; its planet ``i`` is
    original planet ``order[i]``, (N,) whole numbers.
    """
    d, s, order = deviations, planetary_set, [int(n) for n in order]
    axis = 2.0 * s.planet_angles[0]
    image = orientations(mirrored)
    # at this position the right flank of tooth 0 of the sun is where its left flank is at position 0
    oriented = orientations(s, 2.0 * (s.planet_angles[0] - orientations(s).sun) / s.gears[0].pitch_angle)
    last = s.gears[-1].pitch_angle
    ring = round((axis - image.gears[-1][0] - oriented.gears[-1][0]) / last)
    planets = [
        round((axis - angle - oriented.planets[n]) / s.gears[BRANCH].pitch_angle)
        for n, angle in zip(order, image.planets, strict=True)
    ]
    runouts = [_reflected(d.planet_runout[n], k * s.gears[BRANCH].pitch_angle) for n, k in zip(order, planets)]
    first = {(number, 0): (0, 0 if number == 0 else ring) for number in (0, len(s.gears) - 1)}
    first |= {(BRANCH, n): (copy, k) for copy, (n, k) in enumerate(zip(order, planets))}
    faults = []
    for fault in d.faults:
        copy, tooth = first[fault.gear, fault.copy]
        faults.append(fault.in_mirror(tooth, s.gears[fault.gear].teeth, copy))
    return replace(
        d,
        planet_sun_side=d.planet_ring_side,
        planet_ring_side=d.planet_sun_side,
        sun_pitch=-_turned(d.sun_pitch, 0),
        ring_pitch=-_turned(d.ring_pitch, ring),
        planet_pitch=[_turned(d.planet_ring_side_pitch[n], k) for n, k in zip(order, planets)],
        planet_ring_side_pitch=[_turned(d.planet_pitch[n], k) for n, k in zip(order, planets)],
        planet_runout=tuple(runouts),
        sun_runout=_reflected(d.sun_runout, 0.0),
        ring_runout=_reflected(d.ring_runout, ring * last),
        carrier_runout=_reflected(d.carrier_runout, axis),
        ovality=replace(d.ovality, phase=ring * last - d.ovality.phase),
        pin_errors=d.pin_errors[order] * [1.0, -1.0],
        planet_thickness=d.planet_thickness[order],
        faults=tuple(faults),
        planet_misalignment=d.planet_misalignment[order] * [1.0, -1.0],
        sun_misalignment=_in_mirror(d.sun_misalignment, axis),
        carrier_misalignment=_in_mirror(d.carrier_misalignment, axis),
    )


def _in_mirror(vector: np.ndarray, axis: float) -> tuple[float, float]:
    """Vector (2,) in the mirror image at half the angle `axis` [rad]."""
    image = np.exp(1j * axis) * complex(vector[0], -vector[1])
    return image.real, image.imag


def _turned(values: np.ndarray, first: int) -> np.ndarray:
    """Values of the teeth ``first``, ``first - 1``, ..."""
    return values[(first - np.arange(len(values))) % len(values)]


def _reflected(runout: Runout, axis: float) -> Runout:
    """Runout in the mirror image at half the angle `axis` [rad]."""
    return replace(runout, phase=axis - runout.phase)


def loaded_flanks(d: SetDeviations, s: GearSet) -> tuple[tuple[str, FlankForm, Gear], ...]:
    """Name the kinds of loaded flanks, with their forms and gears: gear 1 and 2 of every kind of mesh."""
    flanks = []
    for kind, pair in enumerate(s.kinds):
        forms = zip(s.mates[kind], pair.gears, pair.gears[::-1], d.mesh_forms(kind, back=False), strict=True)
        for number, gear, mate, form in forms:
            flanks.append((f"{gear.name}, {mate.name} side" if s.repeated[number] else gear.name, form, gear))
    return tuple(flanks)


def check_deviations(deviations: SetDeviations, planetary_set: GearSet) -> tuple[GeometryWarning, ...]:
    """Check the deviations of a planetary set, and list what deserves a warning.

    Returns
    -------
    tuple of GeometryWarning
        W-WEDGING: the deviations may use up the play, so that both flanks carry. W-PROFILE: a measured
        profile covers less than half of its flank, a measured lead less than 90 % of the width.

    Raises
    ------
    GeometryError
        E-MODIFICATION: modifications of a flank that together exceed 0.2 modules.
    """
    problems: list[GeometryWarning] = []
    for flank, form, gear in loaded_flanks(deviations, planetary_set):
        problems += check_flank(flank, form, gear)
    return (*problems, *_wedging(deviations, planetary_set))


def least_play(deviations: SetDeviations, planetary_set: GearSet) -> tuple[float, float]:
    """Find lower bounds of the play that the deviations leave, along the line of action [m].

    Positions are sampled over the common period; pitch deviations and profiles enter with their extremes, as
    if the worst teeth met.

    Returns
    -------
    single : float
        Of any one mesh, between the flanks of the two gears alone.
    whole : float
        Of the sun against the held ring: the loaded flanks of one planet and the back flanks of another
        stop it.
    """
    d, s = deviations, planetary_set
    N = s.n_planets
    periods, _ = common_period(d, s, limit=LONGEST_SEARCH)
    position = np.arange(4 * periods) / 4.0
    bodies = [body_separation(d, s, position, back=back) for back in (False, True)]
    drive = bodies[0] + _worst(d, s, back=False)[:, None]
    back = bodies[1] + _worst(d, s, back=True)[:, None]
    back = back + s.of_kinds([kind.backlash for kind in s.kinds])[:, None]
    single = float((drive + back).min())
    drive, back = (side.reshape(-1, N, len(position)).sum(axis=0) for side in (drive, back))
    whole = float((drive.min(axis=0) + back.min(axis=0)).min())
    return single, whole


def _worst(d: SetDeviations, s: GearSet, *, back: bool) -> np.ndarray:
    """Smallest separation (2N,) of any teeth and any points of the flanks of every mesh."""
    side = -1.0 if back else 1.0
    first, second = d.planet_pitch.min(axis=1), d.planet_ring_side_pitch.min(axis=1)
    sun_side, ring_side = (second, first) if back else (first, second)
    pitch = [(side * d.sun_pitch).min() + sun_side, ring_side + (side * d.ring_pitch).min()]
    rolls = [np.linspace(g.form_roll, g.tip_roll, 101) for g in s.gears]
    profile = [
        profile_separation(d, s, kind, rolls[body_1][:, None], rolls[body_2], back=back).min()
        for kind, (body_1, body_2) in enumerate(s.mates)
    ]
    # of leads the ends of profiles, between which a twist is linear
    corners = [[g.form_roll, g.tip_roll] for g in s.gears]
    ends = [(np.tile(corners[body_1], 2), np.repeat(corners[body_2], 2)) for body_1, body_2 in s.mates]
    lead = lead_separation(d, s, 64, s.of_kinds(ends).swapaxes(0, 1), back=back).min(axis=(1, 2))
    return np.concatenate(pitch[: len(profile)]) + s.of_kinds(profile) + lead


def _causes(d: SetDeviations) -> list[str]:
    """Name the kinds of deviations of a set that there are."""
    forms = d.sun, d.planet_sun_side, d.planet_ring_side, d.ring
    runouts = d.sun_runout, d.ring_runout, d.carrier_runout, *d.planet_runout
    pitches = d.sun_pitch, d.ring_pitch, d.planet_pitch, d.planet_ring_side_pitch
    slopes = d.planet_misalignment, d.sun_misalignment, d.carrier_misalignment
    causes = {
        "pin errors": d.pin_errors.any(),
        "pitch errors": any(pitch.any() for pitch in pitches),
        "runout": any(runout.amplitude for runout in runouts),
        "ovality": bool(d.ovality.amplitude),
        "misaligned axes": any(slope.any() for slope in slopes),
        "tooth thickness": bool(d.sun_thickness or d.ring_thickness or d.planet_thickness.any()),
        "profile modifications": any(form.profile for form in forms),
        "lead modifications such as crowning": any(form.lead for form in forms),
    }
    return [name for name, there in causes.items() if there]


def _wedging(d: SetDeviations, s: GearSet):
    """Warn where the deviations may use up the play (W-WEDGING)."""
    # faults take material off
    if replace(d, faults=()).ideal and not (d.planet_thickness.any() or d.sun_thickness or d.ring_thickness):
        return
    single, whole = least_play(d, s)
    least = min(single, whole)
    if least < -1e-12:
        nominal = min(kind.backlash for kind in s.kinds)
        where = "in one mesh" if single <= whole else "between different planets"
        which = " and ".join(_causes(d)) or "deviations"
        yield GeometryWarning(
            "W-WEDGING",
            "set.backlash",
            f"{which} may exceed the backlash by {-least * 1e6:.3f} um {where} "
            f"(ideal gears have {max(0.0, nominal * 1e6):.3f} um): loaded and back flanks may touch at once",
            "play of 0 um or more",
        )
