"""As-built sets: transmission error, load sharing and mesh stiffness over manufacturing tolerances.

Sample ``i`` of a seed adds errors to the deviations of the case, drawn by NumPy's default generator of
``[seed, i]``: it is the same whatever is drawn beside it. Errors of position separate flanks linearly, so one
matrix, made of unit errors in `femgear.gears.deviations`, gives the separations of all samples. A profile
slope tilts them within the windows of the case, which it does not move. Two methods solve a sample: tooth
pairs as springs (`femgear.contact.batch.solve_laws`), and the whole contact problem at all positions.

The positions span one mesh period with the teeth that mesh in the first one. Teeth drawn independently make
any mesh period as likely as any other, but the record of one period sees neither the slow part of pitch and
runout nor the worst tooth: `over_a_turn` says how much larger both are in some samples.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import ValidationError, model_validator
from scipy.special import ndtr, ndtri

from femgear.case import text as case_text
from femgear.case.gear_set import need_set
from femgear.case.mistakes import combine, translate
from femgear.case.quantities import Section
from femgear.case.sections import LARGEST_DEVIATION, Amplitude, Case, Deviation
from femgear.contact.assembly import Candidates, contact_candidates, cycle_positions, in_windows, mesh_windows
from femgear.contact.batch import ContactTangents, PairLaws, pair_laws, solve_batch, solve_laws
from femgear.contact.cycle import check_residual, first_windows
from femgear.contact.flank_pairs import pair_separations
from femgear.contact.supports import MovingMembers, moving_members
from femgear.errors import CaseError
from femgear.gears.deviations import (
    Runout,
    SetDeviations,
    mirrored_deviations,
    no_deviations,
    profile_separation,
)
from femgear.gears.modifications import FlankForm, ProfileSlope
from femgear.gears.planetary import PlanetarySet
from femgear.report.style import BLUE, VERMILION, label, legend_below, new_figure, save_figure
from femgear.report.tables import Block
from femgear.storage.files import own_files, write_dataset, write_text
from femgear.storage.results import dataset
from femgear.study.relief import DesignBasis, design_basis, sun_torque
from femgear.trains.protocol import Progress, one_blas_thread, silent
from femgear.trains.reading import to_toml, with_values

if TYPE_CHECKING:
    import xarray as xr

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
POSITIONS = 16
"""Of a mesh period."""
_FORCES = 48
"""Of the curves of tooth pairs, from `_LEAST` shares to all of the torque."""
_LEAST = 1e-3
_TOGETHER, _EXACT_TOGETHER = 32, 64
"""Samples as springs, and positions of the whole contact problem, that are solved at once."""
_BLOCK = 256
_CHECKED = 8
"""Samples that are solved again exactly."""
_MOST = 10_000_000
_REACH = 5.0
"""Standard deviations within which all values of a normal law count as lying."""
_SLOPES = ("sun", "planet_sun_side", "planet_ring_side", "ring")
FILES = ("samples.nc", "samples.png", "worst.toml")


class Law(Section):
    """Distribution of an error: normal, cut off at mean -+ limit where one is given, or uniform there."""

    distribution: Literal["normal", "uniform"]
    mean: Deviation = 0.0
    sigma: Amplitude | None = None
    limit: Amplitude | None = None

    @model_validator(mode="after")
    def _complete(self):
        needed = "sigma" if self.distribution == "normal" else "limit"
        if getattr(self, needed) is None:
            raise CaseError(
                f"a {self.distribution} distribution needs its {needed}", code="E-KEY-MISSING",
                remedy=f'add {needed} = "3 um"',
            )  # fmt: skip
        if self.distribution == "uniform" and self.sigma is not None:
            message = "a uniform distribution has no sigma"
            raise CaseError(message, code="E-CHOICE", limit="mean and limit", remedy="leave sigma out")
        return self

    @property
    def reach(self) -> float:
        """Largest error that counts as possible [m]."""
        return abs(self.mean) + (_REACH * (self.sigma or 0.0) if self.limit is None else self.limit)

    def at(self, share: np.ndarray) -> np.ndarray:
        """Errors [m] below which the given shares of all lie, an array of the same shape."""
        if self.distribution == "uniform":
            return self.mean + (self.limit or 0.0) * (2.0 * share - 1.0)
        below = 0.0 if self.limit is None or not self.sigma else float(ndtr(-self.limit / self.sigma))
        return self.mean + (self.sigma or 0.0) * ndtri(np.maximum(below + share * (1.0 - 2.0 * below), 1e-17))


class CarrierTolerances(Section):
    """Of the circle of the planet pins: eccentricity, in a direction that is uniformly distributed."""

    runout_amplitude: Law | None = None


class GearTolerances(CarrierTolerances):
    """Of a gear, as the case file has its errors; every tooth and every planet has a draw of its own.

    The profile slope is one draw for all teeth of sun or ring, and one for each flank of all planets.
    """

    pitch: Law | None = None
    cumulative_pitch: Law | None = None
    thickness_reduction: Law | None = None
    profile_slope: Law | None = None

    @model_validator(mode="after")
    def _pitch_once(self):
        if self.pitch is not None and self.cumulative_pitch is not None:
            raise CaseError("pitch and cumulative_pitch say the same", code="E-DUPLICATE", remedy="keep one")
        return self


class PinTolerances(Section):
    """Of the place of every pin: radial outwards, tangential counter-clockwise positive."""

    radial: Law | None = None
    tangential: Law | None = None


class Tolerances(Section):
    """Distributions of manufacturing errors."""

    sun: GearTolerances = GearTolerances()
    planet: GearTolerances = GearTolerances()
    ring: GearTolerances = GearTolerances()
    carrier: CarrierTolerances = CarrierTolerances()
    pin_errors: PinTolerances = PinTolerances()

    def laws(self) -> Iterator[tuple[str, Law]]:
        """Keys of the errors that are drawn, and their laws."""
        sections = ((name, getattr(self, name)) for name in type(self).model_fields)
        for name, section in sections:
            yield from ((f"{name}.{key}", law) for key, law in section if law is not None)


def read_tolerances(path: str | os.PathLike, module: float) -> tuple[Tolerances, str]:
    """Read the tolerances of a TOML file, for gears of a module [m]; the text comes with them.

    Raises
    ------
    CaseError
        Everything that is wrong with the file, as `femgear.trains.reading.read_case`.
    """
    text, name = case_text.read_text(path), os.fsdecode(path)
    try:
        found = Tolerances.model_validate(case_text.parse(text, name))
        problems = list(_implausible(found, module))
    except ValidationError as error:
        problems = translate(error, Tolerances)
    for problem in problems:
        # entries of a table in one line stand where its key does
        line = case_text.line_of(text, problem.key or "") or case_text.line_of(
            text, (problem.key or "").rpartition(".")[0]
        )
        problem.file = f"{name}:{line}" if line else name
    if problems:
        raise combine(problems, text, name)
    return found, text


def _implausible(tolerances: Tolerances, module: float) -> Iterator[CaseError]:
    """Refusals of errors over what a case file takes, and of no errors at all."""
    most, none = LARGEST_DEVIATION * module, True
    for key, law in tolerances.laws():
        none = False
        if law.reach > most:
            yield CaseError(
                f"errors of {law.reach * 1e6:.6g} um are not plausible", code="E-RANGE", key=key,
                limit=f"mean and limit, or {_REACH:g} sigma, within {LARGEST_DEVIATION} modules, "
                f"{most * 1e6:.6g} um", remedy="check the unit",
            )  # fmt: skip
    if none:
        keys = ", ".join(f"{name}.{key}" for name, key in (("sun", "pitch"), ("pin_errors", "tangential")))
        yield CaseError("no error has a tolerance", code="E-KEY-MISSING", remedy=f"give some, such as {keys}")


@dataclass(frozen=True, eq=False)
class _Level:
    """All that samples share in windows of one size."""

    found: Candidates
    laws: PairLaws
    # separations of all pairs per error (K, meshes, P, pairs); at the nodes of windows (K, P, W, 3), or None
    shifts: np.ndarray
    tilts: np.ndarray | None
    overflows: bool


@dataclass(frozen=True, eq=False)
class SampleModel:
    """What all samples of a set share; see `sample_model`.

    Parameters
    ----------
    basis, solved : DesignBasis
        The set, and its mirror image where the torque is negative.
    order : (N,) int array
        Solved planet ``i`` is original planet ``order[i]``.
    errors : tuple of (str, Law, (int, int))
        Key, distribution, and number of bodies and of values on each.
    load : (m,) array
        On the motions [N].
    position : (P,) array
        In the solved set [mesh periods].
    windows : tuple of float
        Share [N] and nearest [m] of the first windows.
    """

    basis: DesignBasis
    solved: DesignBasis
    order: np.ndarray
    errors: tuple[tuple[str, Law, tuple[int, int]], ...]
    members: MovingMembers
    load: np.ndarray
    position: np.ndarray
    windows: tuple[float, float] = (0.0, 0.0)
    _levels: dict[tuple[float, float], _Level] = field(default_factory=dict)

    def draw(self, seed: int, first: int, count: int) -> np.ndarray:
        """Draw the errors (count, K) of samples in the order of `errors` [m].

        Pitch errors are the places of the teeth along the reference circle, runouts are x and y.
        """
        sizes = [np.prod(shape) for _, _, shape in self.errors]
        total, found = int(sum(sizes)), []
        numbers = np.stack([np.random.default_rng([seed, first + i]).random(total) for i in range(count)])
        for (key, law, shape), part in zip(self.errors, np.split(numbers, np.cumsum(sizes[:-1]), axis=1)):
            part = part.reshape(count, *shape)
            if key.endswith("runout_amplitude"):
                angle = 2.0 * np.pi * part[..., 1:]
                part = law.at(part[..., :1]) * np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)
            else:
                part = law.at(part)
            if key.endswith(".pitch"):
                steps = part - part.mean(axis=-1, keepdims=True)
                part = np.cumsum(steps, axis=-1) - steps[..., :1]
            found.append(part.reshape(count, -1))
        return np.concatenate(found, axis=1)

    def deviations(self, errors: np.ndarray, base: SetDeviations | None = None) -> SetDeviations:
        """Add the errors (K,) of a sample to deviations, by default those of the case."""
        gears, d = self.basis.gears, base or self.basis.deviations or no_deviations(self.basis.gears)
        N, place, found = gears.n_planets, 0, {}
        for key, _, shape in self.errors:
            size = int(np.prod(shape))
            found[key.replace(".pitch", ".cumulative_pitch")] = errors[place : place + size].reshape(shape)
            place += size

        def of(key: str) -> np.ndarray:
            return found.get(key, np.zeros((1, 1)))

        def moved(name: str, runouts: Sequence[Runout]) -> tuple[Runout, ...]:
            away = found.get(f"{name}.runout_amplitude", np.zeros((len(runouts), 2))) @ [1.0, 1.0j]
            centres = [old.amplitude * np.exp(1j * old.phase) + by for old, by in zip(runouts, away)]
            return tuple(
                Runout(float(abs(to)), float(np.angle(to))) if by else old
                for to, by, old in zip(centres, away, runouts)
            )

        sun, planet, ring = (
            of(f"{g.name}.cumulative_pitch") * (g.base_radius / g.reference_radius)
            for g in (gears.sun, gears.planet, gears.ring)
        )
        slopes = np.concatenate([np.resize(of(f"{g}.profile_slope"), n) for g, n in _SLOPED.items()])
        forms = {
            name: FlankForm((*getattr(d, name).modifications, ProfileSlope(float(slope))))
            for name, slope in zip(_SLOPES, slopes, strict=True)
            if slope
        }
        pins = np.stack([np.resize(of(f"pin_errors.{way}"), N) for way in ("radial", "tangential")], axis=1)
        return replace(
            d,
            **forms,
            sun_pitch=d.sun_pitch - sun[0],
            planet_pitch=d.planet_pitch - planet,
            planet_ring_side_pitch=d.planet_ring_side_pitch + planet,
            ring_pitch=d.ring_pitch - ring[0],
            sun_runout=moved("sun", [d.sun_runout])[0],
            planet_runout=moved("planet", d.planet_runout),
            ring_runout=moved("ring", [d.ring_runout])[0],
            carrier_runout=moved("carrier", [d.carrier_runout])[0],
            pin_errors=d.pin_errors + pins,
            sun_thickness=d.sun_thickness + float(of("sun.thickness_reduction")[0, 0]),
            planet_thickness=d.planet_thickness + of("planet.thickness_reduction")[:, 0],
            ring_thickness=d.ring_thickness + float(of("ring.thickness_reduction")[0, 0]),
        )

    def image(self, deviations: SetDeviations) -> SetDeviations:
        """Deviations as the solved set has them."""
        original, solved = self.basis.gears, self.solved.gears
        same = solved is original
        return deviations if same else mirrored_deviations(deviations, original, solved, self.order)

    def level(self, share: float, nearest: float) -> _Level:
        """What samples share in windows of a size, see `mesh_windows`; kept."""
        if (share, nearest) not in self._levels:
            self._levels[share, nearest] = self._made_level(share, nearest)
        return self._levels[share, nearest]

    def _made_level(self, share: float, nearest: float) -> _Level:
        s, N = self.solved, self.solved.gears.n_planets
        sizes = {"share": share, "nearest": nearest, "positions": self.position, "contact": s.contact}
        setup = mesh_windows(s.gears, s.bodies, **sizes, deviations=s.deviations)
        found = contact_candidates(setup, s.bodies, np.arange(len(self.position)), self.members)
        state = solve_batch(found, self.load)
        force = np.geomspace(_LEAST * self.load[N] / N, self.load[N], _FORCES)
        shifts, tilts, place, tilted = [], [], (found.mesh, found.position[:, None], found.pair), False
        unit, ideal = 1e-6, no_deviations(self.basis.gears)
        for one in np.eye(sum(np.prod(shape) for _, _, shape in self.errors)):
            own = self.image(self.deviations(unit * one, ideal))
            where = setup.tooth, setup.turns, self.position
            shifts.append(pair_separations(s.gears, own, *where, back=False) / unit)
            nodes = np.zeros((*place[2].shape, 3))
            if any(getattr(own, name).modifications for name in _SLOPES):
                rolls = setup.roll[:, *place]
                for kind in (0, 1):
                    rows = found.mesh // N == kind
                    nodes[:, rows] = profile_separation(own, s.gears, kind, *rolls[:, :, rows]) / unit
                tilted = True
            tilts.append(nodes)
        laws, overflows = pair_laws(found, state, force), found.touches_window_end(state.active)
        return _Level(found, laws, np.array(shifts), np.array(tilts) if tilted else None, overflows)


_SLOPED = {"sun": 1, "planet": 2, "ring": 1}
"""Flanks of the gears with a profile slope of their own, in the order of `_SLOPES`."""


@one_blas_thread()
def sample_model(
    basis: DesignBasis, tolerances: Tolerances, *, sun_torque: float, positions: int | np.ndarray = POSITIONS
) -> SampleModel:
    """Prepare samples: curves of all tooth pairs, and the separations [m] that every error gives.

    Parameters
    ----------
    basis : DesignBasis
        Its deviations belong to every sample.
    sun_torque : float
        [N m], of either sign but not zero.
    positions : int or (P,) array
        Number of equidistant positions in one mesh period, more where planets would be met unequally; or the
        positions themselves [mesh periods].

    Raises
    ------
    CaseError
        E-TORQUE: no torque; E-SUPPORT: bearings with clearance.
    ContactError
    """
    solved, order = basis.loaded(sun_torque)
    gears, members = solved.gears, moving_members(solved.gears, solved.supports)
    N, bodies = gears.n_planets, {"planet": gears.n_planets, "pin_errors": gears.n_planets}
    errors = []
    for key, law in tolerances.laws():
        name, _, kind = key.partition(".")
        values = getattr(gears, name).teeth if "pitch" in kind else 2 if "runout" in kind else 1
        shape = (1, _SLOPED[name]) if "slope" in kind else (bodies.get(name, 1), values)
        errors.append((key, law, shape))
    load = np.zeros(N + 1 + int(members.free.sum()))
    load[N] = abs(sun_torque) / gears.sun.base_radius
    position = cycle_positions(gears.equal_positions(positions) if np.ndim(positions) == 0 else positions)
    position = -position[::-1] if sun_torque < 0 else position
    model = SampleModel(basis, solved, order, tuple(errors), members, load, position)

    def attempt(share: float, nearest: float):
        """Windows that hold the contact of the case, and no pair that some samples miss."""
        level = model.level(share, nearest)
        if level.overflows:
            return None, 4.0 * share, nearest
        missed = _springs(model, level, model.draw(0, 0, _TOGETHER))[1].any()
        return (share, nearest), share, nearest * (2.0 if missed else 1.0)

    windows = in_windows(attempt, *first_windows(gears, solved.bodies, abs(sun_torque)))
    return replace(model, windows=windows)


@one_blas_thread()
def sample_block(
    model: SampleModel, seed: int, first: int, count: int, *, exact: bool = False
) -> dict[str, np.ndarray]:
    """Compute transmission error, load sharing and mesh stiffness of samples; a pure function.

    Parameters
    ----------
    seed, first, count : int
        Samples ``first`` to ``first + count - 1`` of the seed.
    exact : bool
        By the whole contact problem of every position, else by the springs of tooth pairs.

    Returns
    -------
    dict
        ``transmission_error`` (count,): from sun to ring, peak to peak over the positions [m].
        ``planet_share`` (count, N): largest share of every planet in the torque. ``opens`` (count, N):
        whether it loses its load at a position. ``mesh_stiffness`` (count, 2): mean of the sun-planet and of
        the planet-ring meshes [N/m].
    """
    errors = model.draw(seed, first, count)
    return exact_numbers(model, errors) if exact else spring_numbers(model, errors)


def spring_numbers(model: SampleModel, errors: np.ndarray) -> dict[str, np.ndarray]:
    """Compute what `sample_block` gives for errors (n, K) [m] by the springs of tooth pairs.

    Samples whose iteration does not end, or in which a pair touches that is no candidate, are solved exactly.
    """
    parts, level = [], model.level(*model.windows)
    for some in np.split(errors, range(_TOGETHER, len(errors), _TOGETHER)):
        numbers, left = _springs(model, level, some)
        if left.any():
            for name, values in exact_numbers(model, some[left]).items():
                numbers[name][left] = values
        parts.append(numbers)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _springs(model: SampleModel, level: _Level, errors) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Numbers of samples, and which of them (n,) have to be solved exactly."""
    shifts, separations, tilts = _separations(level, errors)
    force, motions, stiffness, solved = solve_laws(level.laws, model.load, separations, tilts)
    left = ~solved.all(axis=1) | _missed(model, level, shifts, force, motions)
    return _numbers(model, force, motions, stiffness), left


def _separations(level: _Level, errors: np.ndarray):
    """Separations (n, meshes, P, pairs) of all pairs, those of the windows (n, P, W), and their tilts [m]."""
    found = level.found
    shifts = np.tensordot(errors, level.shifts, 1)
    tilts = None if level.tilts is None else np.tensordot(errors, level.tilts, 1)
    return shifts, shifts[:, found.mesh, found.position[:, None], found.pair], tilts


def _missed(model: SampleModel, level: _Level, shifts, force, motions) -> np.ndarray:
    """Samples (n,) in which a pair that is no candidate would overlap."""
    found, setup = level.found, level.found.setup
    if model.solved.contact != "profile":
        return np.zeros(len(shifts), bool)
    of_mesh = force.reshape(*force.shape[:2], len(found.approach), -1).sum(axis=-1)
    approach = motions @ found.approach.T - of_mesh @ found.supports
    inside = setup.smallest_gap + shifts < np.moveaxis(approach, 1, 2)[..., None]
    return (inside & ~setup.near).any(axis=(1, 2, 3))


def _numbers(model: SampleModel, force, motions, stiffness) -> dict[str, np.ndarray]:
    """What `sample_block` gives, from forces (n, P, W), motions (n, P, m) and stiffness (n, P, meshes)."""
    (n, P), N = force.shape[:2], model.solved.gears.n_planets
    back = np.argsort(model.order)
    share = force.reshape(n, P, 2, N, -1).sum(axis=-1)[:, :, 0, back] / model.load[N]
    return {
        "transmission_error": np.ptp(motions[..., N], axis=1),
        "planet_share": share.max(axis=1),
        "opens": (share <= 0.0).any(axis=1),
        "mesh_stiffness": stiffness.reshape(n, P, 2, N).mean(axis=(1, 3)),
    }


@one_blas_thread()
def exact_numbers(model: SampleModel, errors: np.ndarray) -> dict[str, np.ndarray]:
    """Compute what `sample_block` gives for errors (n, K) [m] by the whole contact problem.

    Active sets start from the springs of tooth pairs. Samples whose contact the windows do not contain are
    solved in larger ones, as `femgear.contact.cycle.walk_mesh_cycle` does.
    """
    parts, together = [], max(1, _EXACT_TOGETHER // len(model.position))
    tiles: dict[int, Candidates] = {}
    for some in np.split(errors, range(together, len(errors), together)):
        numbers, overflows, missed = _contacts(model, model.level(*model.windows), some, tiles)
        for i in np.flatnonzero(overflows | missed):

            def attempt(share: float, nearest: float, one=some[i : i + 1]):
                found, over, away = _contacts(model, model.level(share, nearest), one, {})
                return found, share * (4.0 if over[0] else 1.0), nearest * (2.0 if away[0] else 1.0)

            for name, values in in_windows(attempt, *model.windows).items():
                numbers[name][i] = values[0]
        parts.append(numbers)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _contacts(model: SampleModel, level: _Level, errors, tiles):
    """Numbers of samples, and which (n,) need wider windows or more pairs; `tiles` keeps repeated arrays."""
    n, (P, W, _) = len(errors), level.found.gap.shape
    shifts, separations, tilts = _separations(level, errors)
    force = solve_laws(level.laws, model.load, separations, tilts)[0][..., None]
    if n not in tiles:
        names = "position", "pair", "gap", "candidate", "polynomials", "local", "smooth"
        tiles[n] = replace(level.found, **{k: np.concatenate([getattr(level.found, k)] * n) for k in names})
    gap = separations.reshape(-1, W, 1)
    if tilts is not None:
        gap = gap + tiles[n].polynomials @ tilts.reshape(-1, W, 3, 1)[..., 0][..., None]
    found = replace(tiles[n], gap=np.where(tiles[n].candidate, tiles[n].gap + gap, 0.0))
    start = (force > 0.0) & (force >= level.laws.touching)
    state = solve_batch(found, model.load, start=start.reshape(found.gap.shape))
    check_residual(found, state)
    stiffness = ContactTangents(found, state).of_meshes(found.smooth)
    force, motions, stiffness = (
        a.reshape(n, P, -1) for a in (state.loads.sum(axis=-1), state.motions, stiffness)
    )
    overflows = (state.active[..., [0, -1]] & ~np.moveaxis(found.at_edge, 0, -1)).reshape(n, -1).any(axis=1)
    missed = _missed(model, level, shifts, force, motions)
    return _numbers(model, force, motions, stiffness), overflows, missed
