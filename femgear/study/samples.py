"""As-built sets: transmission error, load sharing and mesh stiffness over manufacturing tolerances.

Sample ``i`` of a seed adds errors to the deviations of the case, drawn by NumPy's default generator of
``[seed, i]``: it is the same whatever is drawn beside it. Errors of position separate flanks linearly, so one
matrix, made of unit errors, gives the separations of all samples. A profile slope tilts them within the
windows of the case, which it does not move. In slices of the face width (`static.slices`) leads and axes
askew part flanks by straight lines and parabolas, which are as linear.

The positions span one mesh period with the teeth that mesh in the first one, from one end to the other: where
teeth have errors of their own the record does not close. They are equidistant ones and those at which the set
without drawn errors has its extremes (`sample_positions`). Teeth drawn independently make
any mesh period as likely as any other, but the record of one period sees neither the slow part of pitch and
runout nor the worst tooth: `over_a_turn` says how much larger both are in some samples.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ValidationError, ValidationInfo, model_validator
from scipy.sparse import csr_array

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.flank_sections import LARGEST_SLOPE, Amplitude, Deviation, Slope
from femgear.case.gear_set import need_set, planetary_set
from femgear.case.messages import combine, translate
from femgear.case.planetary import Case
from femgear.case.quantities import ANGLE, Count, Quantity, Section
from femgear.contact.assembly import Candidates, contact_candidates
from femgear.contact.batch import ContactTangents, check_residual, solve_batch
from femgear.contact.cycle import CycleOptions
from femgear.contact.face_width import contacts_are_lines, curve_forces, lead_separations
from femgear.contact.flank_pairs import pair_separations
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.pair_laws import PairLaws, pair_laws
from femgear.contact.pair_springs import PairSprings, solve_laws
from femgear.contact.peaks import mean_weights
from femgear.contact.slice_springs import SliceSolutions, SliceSprings, solve_slice_springs
from femgear.contact.supports import MovingMembers, TiltingMembers, moving_members, tilting_members
from femgear.contact.windows import (
    MOST_ENLARGEMENTS,
    cycle_positions,
    first_windows,
    in_windows,
    mesh_windows,
    not_contained,
)
from femgear.errors import CaseError
from femgear.gears.deviations import (
    Runout,
    SetDeviations,
    lead_separation,
    mirrored_deviations,
    no_deviations,
    profile_separation,
)
from femgear.gears.gear import Gear
from femgear.gears.modifications import LARGEST_DEVIATION, FlankForm, LeadCrowning, LeadSlope, ProfileSlope
from femgear.gears.planetary import PlanetarySet
from femgear.gears.tolerances import CLASSES
from femgear.stages.protocol import one_blas_thread
from femgear.stages.static_results import SLICES
from femgear.study.quality import laws_of_class
from femgear.study.relief import DesignBasis, design_basis, sun_torque
from femgear.trains.reading import with_value, with_values

POSITIONS = 16
"""Of a mesh period."""
_FORCES, _LEAST, _FINER = 48, 1e-3, 6
"""Of the curves of tooth pairs: their number, the share of the torque at which they begin, and the steps in
one of theirs in which cells begin to touch."""
_STRAIGHT, _STRAIGHT_IN_SLICES = 0.005, 0.05
"""Share of a peak to peak that straight lines between positions may miss, of the set without drawn errors.

In slices, which come into contact one after the other where leads are drawn, kinks of all slices at once are
none of the samples'.
"""
_TOGETHER, _SLICED_TOGETHER, _EXACT_TOGETHER, _TRIED = 128, 256, 64, 32
"""Samples as springs and positions of the whole problem solved at once; those
of seed 0 that windows are tried with."""
MOST_SAMPLES = 10_000_000
_MARGIN = 1.5
"""Approaches, and forces of slices, that windows hold, over the largest of the samples that are tried."""
_REACH = 5.0
"""Standard deviations within which all values of a normal law count as lying."""
_FLANKS = {"sun": ("sun",), "planet": ("planet_sun_side", "planet_ring_side"), "ring": ("ring",)}
"""Of the gears, those with slopes and leads of their own, as `SetDeviations` names them."""
_FORMS: dict[str, tuple[str, type[Any]]] = {
    "profile_slope": ("profile slope", ProfileSlope),
    "lead_slope": ("lead slope", LeadSlope),
    "lead_crowning": ("lead crowning", LeadCrowning),
}
"""Modifications that are drawn, by key: as the case file names them, and as flanks have them."""
NUMBERS = {
    "transmission_error": ("sample", "m", "static transmission error from sun to ring, peak to peak"),
    "largest_share": ("sample", "1", "largest share of a planet in the torque"),
    "stiffness_sun_planet": ("sample", "N/m", "mean tangent stiffness of the sun-planet meshes"),
    "stiffness_planet_ring": ("sample", "N/m", "mean tangent stiffness of the planet-ring meshes"),
    "planet_share": ("sample planet", "1", "largest share of the planet"),
    "opens": ("sample planet", "1", "whether the planet loses its load at a position"),
}
"""What is computed of a sample: dimensions, unit and words."""


def share_quantiles(
    share: np.ndarray, *, distribution: str, mean: float, sigma: float | None, limit: float | None
) -> np.ndarray:
    """Find the values of a law (...) below which the given shares (...) of all lie.

    Uniform between mean -+ limit, or normal, there cut off at mean -+ limit where one is given.
    """
    if distribution == "uniform":
        return mean + (limit or 0.0) * (2.0 * share - 1.0)
    from scipy.special import ndtr, ndtri

    below = 0.0 if limit is None or not sigma else float(ndtr(-limit / sigma))
    return mean + (sigma or 0.0) * ndtri(np.maximum(below + share * (1.0 - 2.0 * below), 1e-17))


SlopeAmplitude = Annotated[float, Quantity(ANGLE, 0.0, LARGEST_SLOPE)]


class Law(Section):
    """Distribution of an error: normal, cut off at mean -+ limit where one is given, or uniform there."""

    _shown: ClassVar[tuple[float, str]] = (1e6, "um")
    distribution: Literal["normal", "uniform"]
    mean: Deviation = 0.0
    sigma: Amplitude | None = None
    limit: Amplitude | None = None

    @classmethod
    def _largest(cls, module: float) -> tuple[float, str]:
        """Largest plausible error, and how it is written."""
        most = LARGEST_DEVIATION * module
        return most, f"{LARGEST_DEVIATION} modules, {most * 1e6:.6g} um"

    @model_validator(mode="after")
    def _possible(self, info: ValidationInfo):
        needed = "sigma" if self.distribution == "normal" else "limit"
        if getattr(self, needed) is None:
            raise CaseError(
                f"a {self.distribution} distribution needs its {needed}",
                code="E-KEY-MISSING",
                remedy=f'add {needed} = "3 um"',
            )
        if self.distribution == "uniform" and self.sigma is not None:
            message = "a uniform distribution has no sigma"
            raise CaseError(message, code="E-CHOICE", limit="mean and limit", remedy="leave sigma out")
        reach = abs(self.mean) + (_REACH * (self.sigma or 0.0) if self.limit is None else self.limit)
        if info.context and reach > (most := self._largest(info.context["module"]))[0]:
            raise CaseError(
                f"errors of {reach * self._shown[0]:.6g} {self._shown[1]} are not plausible",
                code="E-RANGE",
                limit=f"mean and limit, or {_REACH:g} sigma, within {most[1]}",
                remedy="check the unit",
            )
        return self

    def at(self, share: np.ndarray) -> np.ndarray:
        """Find the errors (...) [m] below which the given shares (...) of all lie."""
        kind = self.distribution
        return share_quantiles(share, distribution=kind, mean=self.mean, sigma=self.sigma, limit=self.limit)


class SlopeLaw(Law):
    """Distribution of the slope of an axis."""

    _shown: ClassVar[tuple[float, str]] = (1e3, "mrad")
    mean: Slope = 0.0
    sigma: SlopeAmplitude | None = None
    limit: SlopeAmplitude | None = None

    @classmethod
    def _largest(cls, module: float) -> tuple[float, str]:
        """Largest plausible slope, and how it is written."""
        return LARGEST_SLOPE, f"{1e3 * LARGEST_SLOPE:g} mrad"


class AxisTolerances(Section):
    """Slopes of the axis of sun or carrier along x and y of the carrier frame."""

    x: SlopeLaw | None = None
    y: SlopeLaw | None = None


class PinTiltTolerances(Section):
    """Slopes of the axis of every planet: radial outwards, tangential counter-clockwise, towards z > 0."""

    radial: SlopeLaw | None = None
    tangential: SlopeLaw | None = None


class RunoutTolerances(Section):
    """Of what turns with a member: eccentricity, in a direction that is uniformly distributed."""

    runout_amplitude: Law | None = None


class CarrierTolerances(RunoutTolerances):
    """Of the circle of the planet pins, and of the axis of the carrier."""

    misalignment: AxisTolerances = AxisTolerances()


Quality = Annotated[int, Count(*CLASSES)]


class GearTolerances(RunoutTolerances):
    """Of a gear, as the case file has its errors; every tooth and every planet has a draw of its own.

    Slopes and crowning are one draw for all teeth of sun or ring, and one for each flank of all planets. Errors that
    have no law of their own follow from a flank tolerance class of ISO 1328-1, the ``quality``.
    """

    quality: Quality | None = None

    pitch: Law | None = None
    cumulative_pitch: Law | None = None
    thickness_reduction: Law | None = None
    profile_slope: Law | None = None
    lead_slope: Law | None = None
    lead_crowning: Law | None = None

    @model_validator(mode="after")
    def _pitch_once(self):
        if self.pitch is not None and self.cumulative_pitch is not None:
            raise CaseError("pitch and cumulative_pitch say the same", code="E-DUPLICATE", remedy="keep one")
        return self


class SunTolerances(GearTolerances):
    """Of the sun, whose axis may stand askew."""

    misalignment: AxisTolerances = AxisTolerances()


class PlanetTolerances(GearTolerances):
    """Of the planets, each of whose axes may stand askew."""

    misalignment: PinTiltTolerances = PinTiltTolerances()


class PinTolerances(Section):
    """Of the place of every pin: radial outwards, tangential counter-clockwise positive."""

    radial: Law | None = None
    tangential: Law | None = None


class Tolerances(Section):
    """Distributions of manufacturing errors, some of them given; ``quality`` is that of gears without their own."""

    quality: Quality | None = None

    sun: SunTolerances = SunTolerances()
    planet: PlanetTolerances = PlanetTolerances()
    ring: GearTolerances = GearTolerances()
    carrier: CarrierTolerances = CarrierTolerances()
    pin_errors: PinTolerances = PinTolerances()

    @model_validator(mode="after")
    def _some(self):
        if not any(True for _ in self.laws()) and not any(self.classes().values()):
            raise CaseError(
                "no error has a tolerance",
                code="E-KEY-MISSING",
                remedy="give some, such as sun.pitch, pin_errors.tangential, or quality = 6",
            )
        return self

    def classes(self) -> dict[str, int | None]:
        """Find the flank tolerance class of every gear, None of one that has none."""
        return {name: getattr(self, name).quality or self.quality for name in _FLANKS}

    def laws(self) -> Iterator[tuple[str, Law]]:
        """Give the keys of the errors that are drawn, and their laws."""

        def of(name: str, section: Section) -> Iterator[tuple[str, Law]]:
            for key, value in section:
                if isinstance(value, Law):
                    yield f"{name}.{key}", value
                elif isinstance(value, Section):
                    yield from of(f"{name}.{key}", value)

        for name, section in self:
            if isinstance(section, Section):
                yield from of(name, section)


def with_classes(tolerances: Tolerances, case: Case) -> Tolerances:
    """Give the gears of a case the laws that their flank tolerance classes make of the errors without a law.

    CaseError: a class or a size that ISO 1328-1 does not cover (E-ISO1328).
    """
    sections = dict[str, Section]()
    for gear in planetary_set(case).gears:
        section, tolerance_class = getattr(tolerances, gear.name), tolerances.classes()[gear.name]
        if tolerance_class is None:
            continue
        laws = laws_of_class(gear, tolerance_class, over_width=case.static.slices > 0)
        if section.cumulative_pitch is not None:
            laws.pop("pitch")
        made = {key: Law.model_validate(law) for key, law in laws.items() if getattr(section, key) is None}
        sections[gear.name] = section.model_copy(update=made)
    return tolerances.model_copy(update=sections)


def read_tolerances(path: str | os.PathLike, module: float) -> tuple[Tolerances, str]:
    """Read the tolerances of a TOML file, for gears of a module [m]; the text comes with them.

    CaseError: everything that is wrong with the file, as `femgear.trains.reading.read_case`.
    """
    text, name = case_text.read_text(path), os.fsdecode(path)
    try:
        read = Tolerances.model_validate(case_text.parse(text, name), context={"module": module})
    except ValidationError as error:
        problems = translate(error, Tolerances)
        for problem in problems:
            # entries of a table in one line stand where its key does
            key = problem.key or ""
            line = case_text.line_of(text, key) or case_text.line_of(text, key.rpartition(".")[0])
            problem.file = f"{name}:{line}" if line else name
        raise combine(problems, text, name) from None
    return read, text


@dataclass(frozen=True, eq=False)
class _OverWidth:
    """What samples in S slices of the face width share besides, in windows of one size.

    Parameters
    ----------
    springs : SliceSprings
        Compliance of bodies and contacts between slices.
    tilting : TiltingMembers, optional
        Tilts of members, which approach the flanks by a different amount in every slice.
    apart : (P, W, S) array
        Separations of the windows of the case by leads and axes askew [m].
    lead : (2N, S) array
        The same of the meshes [m].
    shifts : (2N S, K) sparse array
        Separation of every slice of the meshes per unit of each error [m/m].
    """

    springs: SliceSprings
    tilting: TiltingMembers | None
    apart: np.ndarray
    lead: np.ndarray
    shifts: csr_array


@dataclass(frozen=True, eq=False)
class _Level:
    """All that samples share in windows of one size, P positions with W windows of C cells.

    Parameters
    ----------
    candidates : Candidates
        Cells that may touch.
    springs : PairSprings
        Compliance of the tooth pairs.
    touching : (P, W, C) array
        Force under which every cell begins to touch [N], as `PairLaws` has it.
    shifts : (P W, K) sparse array
        Separation of the windows per unit of each of K errors [m/m].
    tilts : (P W 3, K) sparse array, optional
        The same at the three nodes of every window; None where no error changes along a window.
    overflows : bool
        Whether a contact of the case without errors reaches the end of its window.
    other_gap : (n,) array
        Separations of the pairs that are no candidates [m].
    other_shifts : (n, K) sparse array
        The same per unit of each error [m/m].
    other_place : tuple of two (n,) int arrays
        Position and mesh of each of these pairs.
    over : _OverWidth, optional
        Of contact in slices of the width.
    """

    candidates: Candidates
    springs: PairSprings
    touching: np.ndarray
    shifts: csr_array
    tilts: csr_array | None
    overflows: bool
    other_gap: np.ndarray
    other_shifts: csr_array
    other_place: tuple[np.ndarray, np.ndarray]
    over: _OverWidth | None


@dataclass(frozen=True, eq=False)
class SampleModel:
    """What all samples of a set share; see `sample_model`.

    Parameters
    ----------
    basis, solved : DesignBasis
        The set, and its mirror image where the torque is negative.
    order : (N,) int array
        Solved planet ``i`` is planet ``order[i]`` of the set.
    errors : tuple of (str, Law, (int, int))
        Key, distribution, and number of bodies and of values on each.
    members : MovingMembers
        Motions that the contact solves for.
    load : (m,) array
        Load on these motions [N].
    position : (P,) array
        In the solved set [mesh periods].
    equidistant : int
        Number of equidistant positions in a mesh period that a run is asked for; the others lie between them.
    windows : (float, float)
        Load share [N] and smallest distance [m] from which the first windows follow.
    walked : bool
        Whether no springs stand for the tooth pairs and every sample is a walk through the mesh cycle, as
        ``femgear run`` solves it: of helical teeth, back flanks and bearings with clearance.
    _levels : dict
        What was prepared for windows of a size, by these two numbers.
    """

    basis: DesignBasis
    solved: DesignBasis
    order: np.ndarray
    errors: tuple[tuple[str, Law, tuple[int, int]], ...]
    members: MovingMembers
    load: np.ndarray
    position: np.ndarray
    equidistant: int
    windows: tuple[float, float] = (0.0, 0.0)
    walked: bool = False
    _levels: dict[tuple[float, float], _Level] = field(default_factory=dict)

    @property
    def sun_torque(self) -> float:
        """Torque on the sun [N m]."""
        torque = float(self.load[self.basis.gears.n_planets]) * self.basis.gears.sun.base_radius
        return torque if self.solved.gears is self.basis.gears else -torque

    @property
    def size(self) -> int:
        """K: number of errors of a sample."""
        return sum(math.prod(shape) for *_, shape in self.errors)

    def _by_key(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Cut values (..., K) into those of every key, (..., bodies, values of each)."""
        ends = np.cumsum([math.prod(shape) for *_, shape in self.errors])[:-1]
        parts = zip(self.errors, np.split(values, ends, axis=-1), strict=True)
        return {key: part.reshape(*values.shape[:-1], *shape) for (key, _, shape), part in parts}

    def draw(self, seed: int, first: int, count: int) -> np.ndarray:
        """Draw the errors (count, K) of samples in the order of `errors` [m].

        Pitch errors are the places of the teeth along the reference circle, runouts are x and y.
        """
        checked(seed, "--seed", 0, 2**32)
        generators = [np.random.default_rng([seed, first + i]) for i in range(count)]
        uniform = self._by_key(np.stack([generator.random(self.size) for generator in generators]))
        for key, law, _ in self.errors:
            part = law.at(uniform[key])
            if key.endswith("runout_amplitude"):
                angle = 2.0 * np.pi * uniform[key][..., 1:]
                part = part[..., :1] * np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
            if key.endswith(".pitch"):
                steps = part - part.mean(axis=-1, keepdims=True)
                part = np.cumsum(steps, axis=-1) - steps[..., :1]
            uniform[key] = part.reshape(count, -1)
        return np.concatenate([*uniform.values()], axis=1)

    def deviations(self, errors: np.ndarray, base: SetDeviations | None = None) -> SetDeviations:
        """Add the errors (K,) of a sample to deviations, by default those of the case."""
        gears, d = self.basis.gears, base or self.basis.deviations or no_deviations(self.basis.gears)
        errors_by_key = {key.replace(".pitch", ".cumulative_pitch"): part for key, part in self._by_key(errors).items()}

        def of(key: str) -> np.ndarray:
            return errors_by_key.get(key, np.zeros((1, 1)))

        def moved(name: str, *runouts: Runout) -> tuple[Runout, ...]:
            away = np.broadcast_to(of(f"{name}.runout_amplitude"), (len(runouts), 2))
            return tuple(old.moved(*by) for old, by in zip(runouts, away, strict=True))

        sun, planet, ring = (
            of(f"{g.name}.cumulative_pitch") * (g.base_radius / g.reference_radius)
            for g in (gears.sun, gears.planet, gears.ring)
        )
        forms = {
            flank: FlankForm((*getattr(d, flank).modifications, *drawn))
            for gear, flanks in _FLANKS.items()
            for i, flank in enumerate(flanks)
            if (
                drawn := [
                    kind(float(amount))
                    for key, (_, kind) in _FORMS.items()
                    if (amount := np.append(of(f"{gear}.{key}")[0], 0.0)[i])
                ]
            )
        }
        askew = {
            name: getattr(d, f"{name}_misalignment")
            + np.concatenate([of(f"{name}.misalignment.{along}")[0] for along in "xy"])
            for name in ("sun", "carrier")
        }
        return replace(
            d,
            **forms,
            sun_pitch=d.sun_pitch - sun[0],
            planet_pitch=d.planet_pitch - planet,
            planet_ring_side_pitch=d.planet_ring_side_pitch + planet,
            ring_pitch=d.ring_pitch - ring[0],
            sun_runout=moved("sun", d.sun_runout)[0],
            planet_runout=moved("planet", *d.planet_runout),
            ring_runout=moved("ring", d.ring_runout)[0],
            carrier_runout=moved("carrier", d.carrier_runout)[0],
            pin_errors=d.pin_errors + of("pin_errors.radial") * [1, 0] + of("pin_errors.tangential") * [0, 1],
            planet_misalignment=d.planet_misalignment
            + of("planet.misalignment.radial") * [1, 0]
            + of("planet.misalignment.tangential") * [0, 1],
            sun_misalignment=askew["sun"],
            carrier_misalignment=askew["carrier"],
            sun_thickness=d.sun_thickness + float(of("sun.thickness_reduction")[0, 0]),
            planet_thickness=d.planet_thickness + of("planet.thickness_reduction")[:, 0],
            ring_thickness=d.ring_thickness + float(of("ring.thickness_reduction")[0, 0]),
        )

    def image(self, deviations: SetDeviations) -> SetDeviations:
        """Find deviations as the solved set has them."""
        sets = self.basis.gears, self.solved.gears
        return deviations if sets[0] is sets[1] else mirrored_deviations(deviations, *sets, self.order)

    def level(self, share: float, nearest: float) -> _Level:
        """Find what samples share in windows of a size, see `mesh_windows`; it is kept."""
        if (share, nearest) in self._levels:
            return self._levels[share, nearest]
        s, N = self.solved, self.solved.gears.n_planets
        sizes = {"share": share, "nearest": nearest, "positions": self.position, "contact": s.contact}
        setup = mesh_windows(s.gears, s.bodies, **sizes, deviations=s.deviations)
        candidates = contact_candidates(setup, s.bodies, np.arange(len(self.position)), self.members)
        state = solve_batch(candidates, self.load)
        curves = np.geomspace(_LEAST * self.load[N] / N, self.load[N], _FORCES)
        if s.over:
            curves = curve_forces(self.load[N], N, self.load[N])
        laws = pair_laws(candidates, state, curves)
        # where contacts end decides how soon their cells are found
        finer = np.geomspace(curves[0], curves[-1], _FINER * (len(curves) - 1) + 1)
        touching = laws.touching if s.over else pair_laws(candidates, state, finer).touching
        rolls = setup.roll[:, candidates.mesh, candidates.position[:, None], candidates.pair]
        tilted = any(key.endswith("profile_slope") for key, *_ in self.errors)
        shifts, tilts, leads, unit, ideal = [], [], [], 1e-6, no_deviations(self.basis.gears)
        for unit_error in np.eye(self.size):
            separations = self.image(self.deviations(unit * unit_error, ideal))
            where = setup.listed.tooth, setup.turns, self.position
            shifts.append(pair_separations(s.gears, separations, *where, back=False) / unit)
            if s.over:
                leads.append(lead_separation(separations, s.gears, s.over["slices"]) / unit)
            if tilted:
                kinds = [profile_separation(separations, s.gears, kind, *rolls) / unit for kind in (0, 1)]
                tilts.append(np.where((candidates.mesh < N)[:, None], *kinds))
        overflows, listed = candidates.touches_window_end(state.active), setup.listed
        of_windows = candidates.mesh, candidates.position[:, None], candidates.pair + listed.first[candidates.mesh]
        # errors move few pairs each
        mesh, at, pair = np.nonzero(np.isfinite(listed.gap) & ~listed.near & (s.contact == "profile"))
        by_pairs = np.moveaxis(np.array(shifts), 0, -1)
        at_nodes = _sparse(np.moveaxis(np.array(tilts), 0, -1)) if tilted else None
        over = _over_width(s, candidates, laws, np.moveaxis(np.array(leads), 0, -1)) if s.over else None
        made = _Level(
            candidates,
            PairSprings(laws),
            touching,
            _sparse(by_pairs[of_windows]),
            at_nodes,
            overflows,
            listed.gap[mesh, at, pair],
            _sparse(by_pairs[mesh, at, pair]),
            (at, mesh),
            over,
        )
        self._levels[share, nearest] = made
        return made


def _over_width(s: DesignBasis, candidates: Candidates, laws: PairLaws, leads: np.ndarray) -> _OverWidth:
    """What samples of a solved set share over its width; ``leads`` (2N, S, K) are separations per error."""
    slices, waves = s.over["slices"], s.over["waves"]
    tilting = tilting_members(s.gears, s.over["width_supports"], slices)
    lead, apart, _ = lead_separations(candidates, s.deviations, slices, len(candidates.position))
    springs = SliceSprings(candidates, laws, waves, slices, tilting)
    return _OverWidth(springs, tilting, apart, lead, _sparse(leads))


def _sparse(values: np.ndarray) -> csr_array:
    """Matrix of values (..., K), a row for each of the first ones."""
    return csr_array(values.reshape(-1, values.shape[-1]))


@one_blas_thread()
def sample_model(
    basis: DesignBasis, tolerances: Tolerances, *, sun_torque: float, positions: int | np.ndarray = POSITIONS
) -> SampleModel:
    """Prepare samples: curves of all tooth pairs, and the separations [m] that every error gives.

    The deviations of the basis belong to every sample; the torque [N m] has either sign. ``positions`` is the
    number of equidistant ones in one mesh period, more where planets would be met unequally, or the positions
    themselves (P,) [mesh periods].

    CaseError: E-TORQUE: no torque; E-SLICES: leads and axes askew without slices, axes askew of helical teeth.
    ContactError.
    """
    _check_over_width(basis, tolerances)
    walked = is_walked(basis)
    solved, order = basis.loaded(sun_torque, clearance=walked)
    gears, members = solved.gears, moving_members(solved.gears, solved.supports)
    N, errors = gears.n_planets, drawn_laws(gears, tolerances)
    load = np.zeros(N + 1 + int(members.free.sum()))
    load[N] = abs(sun_torque) / gears.sun.base_radius
    position = cycle_positions(gears.equal_positions(positions) if isinstance(positions, int) else positions)
    position = -position[::-1] if sun_torque < 0 else position
    model = SampleModel(basis, solved, order, errors, members, load, position, len(position))
    if walked:
        return replace(model, basis=replace(basis, positions=positions), walked=True)

    def attempt(share: float, nearest: float):
        """Windows that hold the contact of the case, and no pair that some samples miss."""
        level = model.level(share, nearest)
        if level.overflows:
            return None, 4.0 * share, nearest
        tried = model.draw(0, 0, _TRIED)
        if level.over is None:
            _, unsolved, missed = _solved(model, level, tried, False, _MARGIN)
        else:
            state = _in_slices(model, level, tried)
            if _overflows(level, _MARGIN * state.largest).any():
                return None, 4.0 * share, nearest
            _, unsolved, missed = _of_slices(model, level, tried, state, _MARGIN)
        return (share, nearest), share, nearest * (2.0 if (missed & ~unsolved).any() else 1.0)

    windows = in_windows(attempt, *first_windows(gears, solved.bodies, abs(sun_torque)))
    return replace(model, windows=windows)


def drawn_laws(gears: PlanetarySet, tolerances: Tolerances) -> tuple[tuple[str, Law, tuple[int, int]], ...]:
    """List the errors of a set that are drawn, as `SampleModel` has them."""
    errors = []
    for key, law in tolerances.laws():
        name, _, kind = key.partition(".")
        values = getattr(gears, name).teeth if "pitch" in kind else 2 if "runout" in kind else 1
        each = (gears.n_planets if name in ("planet", "pin_errors") else 1, values)
        errors.append((key, law, (1, len(_FLANKS[name])) if kind in _FORMS else each))
    return tuple(errors)


def drawn_alone(case: Case, tolerances: Path, *, cache: Path | None = None, steps: Steps | None = None) -> SampleModel:
    """Prepare samples of a case that are drawn and written as cases, and solved by others.

    Refused is (CaseError) what `read_tolerances` and `design_basis` refuse.
    """
    law, _ = read_tolerances(tolerances, case.sun.module)
    basis = design_basis(case, cache=cache, steps=steps)
    law = with_classes(law, case)
    _check_over_width(basis, law)
    members, order = moving_members(basis.gears, basis.supports), np.arange(basis.gears.n_planets)
    parts = basis, basis, order, drawn_laws(basis.gears, law), members
    return SampleModel(*parts, np.zeros(0), np.zeros(1), case.static.positions)


def is_walked(basis: DesignBasis) -> bool:
    """Tell whether samples of a set have no springs: helical teeth, back flanks, bearings with clearance."""
    return "ahead" in basis.over or basis.both_flanks or bool(basis.supports.planet_clearance)


def _check_over_width(basis: DesignBasis, tolerances: Tolerances) -> None:
    """Refuse (CaseError, E-SLICES) tolerances that only slices of the face width can show, of spur teeth alone."""
    for key, _ in tolerances.laws():
        if "misalignment" in key and "ahead" in basis.over:
            raise CaseError(
                "tilts of axes are those of spur teeth: helical ones press the axes in their direction, too",
                code="E-SLICES",
                key=key,
                limit="lead_slope, lead_crowning and errors of position",
                remedy="leave the tolerance out, or give a lead_slope",
            )
        if ("lead" in key or "misalignment" in key) and not basis.over:
            raise CaseError(
                "leads and axes askew need slices over the width",
                code="E-SLICES",
                key=key,
                remedy=f"give static.slices = {SLICES} in the case file, or leave the tolerance out",
            )


def sample_positions(basis: DesignBasis, sun_torque: float, positions: int) -> np.ndarray:
    """Choose positions (P,) of samples of a basis under a torque [N m] in a mesh period, its end included.

    Equidistant ones, at least so many; of those between, at which the basis has extremes, as many as leave
    `_STRAIGHT` of its curves beside straight lines; and the end, where teeth with other errors follow.
    """
    equidistant = basis.gears.equal_positions(positions)
    cycle = replace(basis, positions=equidistant).walk(sun_torque)
    position, curves = cycle.position, np.vstack([cycle.sun_arc, cycle.load_share])
    if cycle.between is not None:
        position = np.append(position, cycle.between.position)
        between = np.vstack([cycle.between.sun_arc, cycle.between.load_share])
        curves = np.concatenate([curves, between], axis=1)
    order = np.argsort(position)
    kept, position, curves = order < equidistant, position[order], curves[:, order]
    # shares that are equal but for rounding have no shape
    size = np.maximum(np.ptp(curves, axis=1), 1e-3 * np.abs(curves).max(axis=1))[:, None]
    while True:
        straight = np.array([np.interp(position, position[kept], row[kept], period=1.0) for row in curves])
        apart = np.where(kept, 0.0, np.abs(straight - curves) / size).max(axis=0)
        if apart.max() <= (_STRAIGHT_IN_SLICES if basis.over else _STRAIGHT):
            return np.append(position[kept & (position < 1.0)], 1.0)
        kept[apart.argmax()] = True


def sample_block(
    model: SampleModel, seed: int, first: int, count: int, *, exact: bool = False
) -> dict[str, np.ndarray]:
    """Compute what `solve_samples` gives (count, ...) for samples ``first`` to ``first + count - 1`` of a seed."""
    return solve_samples(model, model.draw(seed, first, count), exact=exact)


@one_blas_thread()
def solve_samples(model: SampleModel, errors: np.ndarray, *, exact: bool) -> dict[str, np.ndarray]:
    """Compute transmission error, load sharing and mesh stiffness for errors (n, K) [m].

    By the springs of tooth pairs, or exactly: by the whole contact problem of every position, whose active
    sets start from the springs. Samples that springs do not solve, or whose contact the windows do not
    contain, are solved exactly by themselves, in larger windows as in `femgear.contact.cycle`.

    The results are those of `NUMBERS`, (n,) or (n, N) of planets, over the positions.
    """
    return _in_windows(model, errors, model.windows, exact)


def _in_windows(
    model: SampleModel, errors: np.ndarray, size: tuple[float, float], exact: bool, enlargements: int = 0
) -> dict[str, np.ndarray]:
    """Numbers of samples in windows of a size; of those that these do not hold in larger ones, exactly."""
    if model.walked or (exact and model.solved.over):
        return joined([_walked(model, sample) for sample in errors])
    level, (share, nearest) = model.level(*size), size
    together = _EXACT_TOGETHER if exact else _TOGETHER
    together = together if level.over is None else _SLICED_TOGETHER
    blocks = np.split(errors, range(together, len(errors), together))
    parts, unsolved, missed = zip(
        *(
            _solved(model, level, block, exact)
            if level.over is None
            else _of_slices(model, level, block, _in_slices(model, level, block))
            for block in blocks
        )
    )
    numbers, unsolved, missed = joined(parts), np.concatenate(unsolved), np.concatenate(missed)
    if (unsolved | missed).any() and enlargements == MOST_ENLARGEMENTS:
        raise not_contained()
    for over, away in ((True, False), (False, True), (True, True)):
        these = np.flatnonzero((unsolved == over) & (missed == away))
        if len(these):
            # springs that do not end say nothing of the windows
            wider = share * (4.0 if over and exact else 1.0), nearest * (2.0 if away else 1.0)
            solved = _in_windows(model, errors[these], wider, True, enlargements + 1)
            for name, values in solved.items():
                numbers[name][these] = values
    return numbers


spring_numbers, exact_numbers = partial(solve_samples, exact=False), partial(solve_samples, exact=True)


def joined(parts: Sequence[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Join the numbers (n, ...) of samples that follow one another, by their names."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _solved(
    model: SampleModel, level: _Level, errors: np.ndarray, exact: bool, margin: float = 1.0
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Numbers of samples, which (n,) are not solved, and in which pairs overlap that are no candidates.

    Springs do not solve those whose iteration does not end, windows those whose contact they do not contain.
    Pairs overlap under so many times the approach of the flanks.
    """
    candidates, N = level.candidates, model.solved.gears.n_planets
    (n, P), back, by_error = (len(errors), len(model.position)), np.argsort(model.order), errors.T.copy()
    separations, tilts = _separations(model, level, by_error)
    force, motions, stiffness, ended = solve_laws(level.springs, model.load, separations, tilts)
    unsolved = ~ended.all(axis=0)
    if exact:
        force, motions, stiffness, unsolved = _contacts(model, level, separations, tilts, force)
    of_mesh = force.reshape(P, 2 * N, -1, n).sum(axis=2)
    approach = candidates.approach @ motions - candidates.supports.T @ of_mesh
    others = level.other_gap[:, None] + level.other_shifts @ by_error
    missed = (others < margin * approach[level.other_place]).any(axis=0)
    share = of_mesh[:, :N][:, back] / model.load[N]
    numbers = _numbers(model.position, motions[:, N], share, stiffness)
    return numbers, np.asarray(unsolved), missed


def _numbers(position: np.ndarray, arc: np.ndarray, share: np.ndarray, stiffness: np.ndarray) -> dict[str, np.ndarray]:
    """`NUMBERS` of n samples at P positions.

    By arcs of the sun (P, n) [m], shares of planets (P, N, n) and stiffnesses of meshes (P, 2N, n) [N/m].
    """
    (P, N, n), weights = share.shape, mean_weights(position, 1)
    of_kinds = np.einsum("p,pkn->kn", weights, stiffness.reshape(P, 2, N, n).mean(axis=2))
    numbers = np.ptp(arc, axis=0), share.max(axis=(0, 1)), *of_kinds
    planets = share.max(axis=0).T, np.any(share <= 0.0, axis=0).T
    return {name: np.array(values) for name, values in zip(NUMBERS, (*numbers, *planets), strict=True)}


def _in_slices(model: SampleModel, level: _Level, errors: np.ndarray) -> SliceSolutions:
    """Solve samples in slices as springs."""
    over, N = level.over, model.solved.gears.n_planets
    assert over is not None
    by_error, mesh = errors.T.copy(), level.candidates.mesh
    separations, tilts = _separations(model, level, by_error)
    leads = (over.shifts @ by_error).reshape(2 * N, over.springs.slices, -1)
    of_windows = over.apart.swapaxes(1, 2)[..., None] + leads[mesh]
    return solve_slice_springs(over.springs, model.load, separations, of_windows, tilts)


def _overflows(level: _Level, force: np.ndarray) -> np.ndarray:
    """Tell (n,) whether slices with such largest forces (P, W, n) press the end of a window amid a flank."""
    reached = level.touching[:, :, [0, -1], None] <= force[:, :, None]
    amid = ~np.moveaxis(level.candidates.at_edge, 0, -1)[..., None]
    return np.asarray((reached & amid).any(axis=(0, 1, 2)))


def _of_slices(
    model: SampleModel, level: _Level, errors: np.ndarray, state: SliceSolutions, margin: float = 1.0
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Numbers of samples in slices, as `_solved` gives them.

    Not solved are those whose iteration does not end, that windows do not hold, and whose contacts are
    points. Pairs overlap under so many times the approach of the flanks.
    """
    over, candidates, N = level.over, level.candidates, model.solved.gears.n_planets
    assert over is not None
    width, slices, shared = candidates.bodies.widths[0], over.springs.slices, len(model.load)
    contact = (level.touching[..., None] <= state.largest[:, :, None]).sum(axis=2)
    contact = contact * candidates.setup.cell[candidates.mesh][:, None]
    lines = contacts_are_lines(state.force, width * state.length, state.at_end, contact, width / slices)
    holds = (lines & (contact <= width / slices)).all(axis=(0, 1)) & ~_overflows(level, state.largest)
    of_mesh = state.force.reshape(*state.force.shape[:1], 2 * N, -1, len(errors)).sum(axis=2)
    # of the slice that comes nearest
    closer = -over.lead[..., None] - (over.shifts @ errors.T).reshape(2 * N, slices, -1)
    if over.tilting is not None:
        tilts = state.motions[:, shared:]
        closer = closer + np.einsum("jsk,pkn->pjsn", over.tilting.approach, tilts)
    approach = candidates.approach @ state.motions[:, :shared] - candidates.supports.T @ of_mesh
    approach = margin * (approach + closer.max(axis=-2))
    others = level.other_gap[:, None] + level.other_shifts @ errors.T
    missed = (others < approach[level.other_place]).any(axis=0)
    share = of_mesh[:, :N][:, np.argsort(model.order)] / model.load[N]
    numbers = _numbers(model.position, state.motions[:, N], share, state.stiffness)
    return numbers, ~(state.solved.all(axis=0) & holds), missed


def _walked(model: SampleModel, errors: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers of a sample (K,) as ``femgear run`` solves it, in slices at the positions of the samples."""
    if model.walked:
        return _of_run(replace(model.basis, deviations=model.deviations(errors)).walk(model.sun_torque))
    basis, mirrored = model.basis, model.solved.gears is not model.basis.gears
    position = -model.position[::-1] if mirrored else model.position
    sample = replace(basis, deviations=model.deviations(errors), positions=position)
    cycle = sample.walk(model.sun_torque, options=CycleOptions())
    arc, share, stiffness = (
        np.moveaxis(values, -1, 0)[..., None] for values in (cycle.sun_arc, cycle.load_share, cycle.stiffness)
    )
    return _numbers(position, arc, share, stiffness)


def _of_run(cycle: MeshCycle) -> dict[str, np.ndarray]:
    """`NUMBERS` of one sample from its mesh cycle, with the positions between."""
    low, high = cycle.extremes("load_share")
    stiffness = cycle.mean("stiffness").reshape(2, -1).mean(axis=1)
    numbers = cycle.peak_to_peak("sun_arc"), high.max(), *stiffness, high, low <= 0.0
    return {name: np.array([value]) for name, value in zip(NUMBERS, numbers, strict=True)}


def _separations(model: SampleModel, level: _Level, by_error: np.ndarray) -> tuple[np.ndarray, Any]:
    """Separations of windows (P, W, n) by errors (K, n), and those at their nodes (P, W, 3, n) or None."""
    P, n = len(model.position), by_error.shape[1]
    tilts = None if level.tilts is None else (level.tilts @ by_error).reshape(P, -1, 3, n)
    return (level.shifts @ by_error).reshape(P, -1, n), tilts


def _contacts(model: SampleModel, level: _Level, separations: np.ndarray, tilts, force):
    """Forces, motions and stiffness of samples from those of springs; whether (n,) windows are too small.

    Samples are the last axis, as of `femgear.contact.pair_springs.solve_laws`. Those at one position, which
    differ in their separations alone, are solved together.
    """
    (P, W, n), N = separations.shape, model.solved.gears.n_planets
    forces, motions = np.zeros((P, W, n)), np.zeros((P, len(model.load), n))
    stiffness, overflows = np.zeros((P, 2 * N, n)), np.zeros(n, bool)
    for at in range(P):
        candidates, gap = _at_position(level, at, n), separations[at].T[..., None]
        if tilts is not None:
            gap = gap + (candidates.polynomials[0] @ tilts[at].transpose(2, 0, 1)[..., None])[..., 0]
        candidates = replace(candidates, gap=np.where(candidates.candidate, candidates.gap + gap, 0.0))
        pressed = force[at].T[..., None]
        start = (pressed > 0.0) & (pressed >= level.touching[at])
        state = solve_batch(candidates, model.load, start=start, refined=False)
        check_residual(candidates, state)
        forces[at], motions[at] = state.loads.sum(axis=-1).T, state.motions.T
        stiffness[at] = ContactTangents(candidates, state).of_meshes(candidates.smooth).T
        ends = state.active[..., [0, -1]] & ~np.moveaxis(candidates.at_edge, 0, -1)
        overflows |= ends.any(axis=(1, 2))
    return forces, motions, stiffness, overflows


@lru_cache(maxsize=64)
def _at_position(level: _Level, at: int, times: int) -> Candidates:
    """Candidates at one position of so many samples without errors; the last samples are often fewer."""

    def repeated(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values, (times, *values.shape))

    names = "position", "pair", "gap", "candidate", "polynomials", "local"
    arrays = {name: repeated(getattr(level.candidates, name)[at]) for name in names}
    return replace(level.candidates, **arrays, images=np.moveaxis(repeated(level.candidates.images[:, at]), 0, 1))


def sample_case(case: Case, model: SampleModel, seed: int, index: int) -> Case:
    """Make a sample a case, which `femgear.run` solves over one mesh period."""
    s, d = model.basis.gears, model.deviations(model.draw(seed, index, 1)[0])
    base, written = model.basis.deviations or no_deviations(s), case_text.parse(case.source, case.name)

    def length(value: float) -> str:
        return f"{1e6 * value:.12g} um"

    def turning(runout: Runout) -> dict[str, object]:
        return {"runout_amplitude": length(runout.amplitude), "runout_phase": f"{runout.phase:.12g} rad"}

    def of_gear(gear: Gear, runout: Runout, displaced: np.ndarray, thickness: float) -> dict[str, object]:
        pitch = [length(value) for value in displaced * (gear.reference_radius / gear.base_radius)]
        return {**turning(runout), "cumulative_pitch": pitch, "thickness_reduction": length(thickness)}

    tables = {
        "sun": of_gear(s.sun, d.sun_runout, -d.sun_pitch, d.sun_thickness),
        "ring": of_gear(s.ring, d.ring_runout, -d.ring_pitch, d.ring_thickness),
        "carrier": turning(d.carrier_runout),
    }
    values: dict[str, object] = {}
    for name, table in tables.items():
        kept = {key: value for key, value in written[name].get("errors", {}).items() if key != "pitch"}
        values[f"{name}.errors"] = kept | table
    planets = zip(d.planet_runout, d.planet_ring_side_pitch, d.planet_thickness, strict=True)
    values["planet.individual"] = [{"planet": n, **of_gear(s.planet, *planet)} for n, planet in enumerate(planets, 1)]
    values["set.pin_errors"] = [
        {"planet": n, "radial": length(radial), "tangential": length(tangential)}
        for n, (radial, tangential) in enumerate(d.pin_errors, 1)
    ]
    kinds = {kind: name for name, kind in _FORMS.values()}
    for gear, flanks in _FLANKS.items():
        drawn = [
            {"kind": kinds[type(form)], "amount": length(form.amount)}
            | ({"flank": flank[len("planet_") :].replace("_", " ")} if gear == "planet" else {})
            for flank in flanks
            for form in getattr(d, flank).modifications[len(getattr(base, flank).modifications) :]
        ]
        if drawn:
            values[f"{gear}.modifications"] = [*written[gear].get("modifications", []), *drawn]
    if d.misaligned:
        values |= {
            f"{name}.misalignment": {along: f"{slope:.12g} rad" for along, slope in zip("xy", slopes)}
            for name, slopes in (("sun", d.sun_misalignment), ("carrier", d.carrier_misalignment))
        }
        values["planet.misalignment"] = [
            {"planet": n, "radial": f"{radial:.12g} rad", "tangential": f"{tangential:.12g} rad"}
            for n, (radial, tangential) in enumerate(d.planet_misalignment, 1)
        ]
    values |= {"static.positions": model.equidistant, "static.longest_record": 1}
    values["title"] = f"{case.title[:150]}: sample {index} of seed {seed}"
    return with_values(case, values)


def over_a_turn(model: SampleModel, errors: np.ndarray) -> tuple[float, float]:
    """Compute the transmission error [m] and the largest share of a sample over a turn of the carrier.

    Against the ring: as many mesh periods as it has teeth, by the springs of tooth pairs where there are any.

    ``errors`` (K,) are those of the sample [m].
    """
    if model.walked:
        sample = replace(model.basis, deviations=model.deviations(errors))
        cycle = sample.walk(model.sun_torque, periods=model.basis.gears.ring.teeth)
        return float(cycle.peak_to_peak("sun_arc")), float(cycle.extremes("load_share")[1].max())
    s, level, P = model.solved, model.level(*model.windows), len(model.position)
    setup, periods = level.candidates.setup, np.arange(s.gears.ring.teeth)
    turns = np.repeat(-periods if s.gears is not model.basis.gears else periods, P)
    tau = np.tile(model.position, len(periods)) + turns
    where = setup.tooth, np.tile(setup.turns, len(periods)) + turns, tau
    apart = pair_separations(s.gears, model.image(model.deviations(errors)), *where, back=False)
    case = pair_separations(s.gears, s.deviations, setup.tooth, setup.turns, model.position, back=False)
    apart = np.moveaxis(apart.reshape(len(apart), len(periods), P, -1) - case[:, None], 1, -1)
    candidates, N = level.candidates, s.gears.n_planets
    separations = apart[candidates.mesh, candidates.position[:, None], candidates.pair]
    tilts = None
    if level.tilts is not None:
        of_nodes = (level.tilts @ errors).reshape(P, -1, 3, 1)
        tilts = np.repeat(of_nodes, len(periods), axis=-1)
    if level.over is None:
        force, motions, _, _ = solve_laws(level.springs, model.load, separations, tilts)
    else:
        over = level.over
        leads = over.apart.swapaxes(1, 2) + (over.shifts @ errors).reshape(2 * N, -1)[candidates.mesh]
        leads = np.repeat(leads[..., None], len(periods), axis=-1)
        state = solve_slice_springs(over.springs, model.load, separations, leads, tilts)
        force, motions = state.force, state.motions
    share = force.reshape(P, 2, N, -1, len(periods)).sum(axis=3)[:, 0].max() / model.load[N]
    return float(np.ptp(motions[:, N])), float(share)


def between_positions(model: SampleModel, errors: np.ndarray) -> tuple[float, float]:
    """Compute the transmission error [m] and the largest share of a sample with the positions between.

    As ``femgear run`` does of the case that `sample_case` makes of it: exactly, at the peaks of the sample.
    ``errors`` (K,) are those of the sample [m].
    """
    positions = model.basis.positions if model.walked else model.equidistant
    sample = replace(model.basis, deviations=model.deviations(errors), positions=positions)
    cycle = sample.walk(model.sun_torque)
    return float(cycle.peak_to_peak("sun_arc")), float(cycle.extremes("load_share")[1].max())


def prepared(
    case: Case, tolerances: Path, *, positions: int = POSITIONS, cache: Path | None = None, steps: Steps | None = None
) -> tuple[SampleModel, str]:
    """Prepare the samples of a case for a file of tolerances, whose text comes with the model.

    Refused is (CaseError) what `read_tolerances` and `sample_model` refuse.
    """
    need_set(case)
    law, text = read_tolerances(tolerances, case.sun.module)
    law = with_classes(law, case)
    checked(positions, "--positions", 8, 4096)
    # of helical teeth more than those asked for, so that slices are met alike
    basis = design_basis(with_value(case, "static.positions", positions), cache=cache, steps=steps)
    torque = sun_torque(case, basis.gears)
    if is_walked(basis):
        model = sample_model(basis, law, sun_torque=torque, positions=basis.positions)
        return replace(model, equidistant=positions), text
    places = sample_positions(basis, torque, positions)
    model = sample_model(basis, law, sun_torque=torque, positions=places)
    return replace(model, equidistant=basis.gears.equal_positions(positions)), text


def checked(value: int, key: str, least: int, most: int = MOST_SAMPLES) -> None:
    """Refuse (E-RANGE) a number under the least or over the most."""
    if not least <= value <= most:
        message = "the number is out of range"
        raise CaseError(message, code="E-RANGE", key=key, value=value, limit=f"{least} to {most}")
