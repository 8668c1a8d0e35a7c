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

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import ValidationError, model_validator

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
        from scipy.special import ndtr, ndtri

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
        sizes = [math.prod(shape) for _, _, shape in self.errors]
        total, found = sum(sizes), []
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
            size = math.prod(shape)
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
        for one in np.eye(sum(math.prod(shape) for _, _, shape in self.errors)):
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
    position = cycle_positions(gears.equal_positions(positions) if isinstance(positions, int) else positions)
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
        numbers, missed, unsolved = _springs(model, level, some)
        left = missed | unsolved
        if left.any():
            for name, values in exact_numbers(model, some[left]).items():
                numbers[name][left] = values
        parts.append(numbers)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _springs(
    model: SampleModel, level: _Level, errors
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Numbers of samples, in which of them (n,) other pairs touch, and which are not solved."""
    shifts, separations, tilts = _separations(level, errors)
    force, motions, stiffness, solved = solve_laws(level.laws, model.load, separations, tilts)
    unsolved = np.asarray(~solved.all(axis=1))
    missed = ~unsolved & _missed(model, level, shifts, force, motions)
    return _numbers(model, force, motions, stiffness), missed, unsolved


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
        gap = gap + (tiles[n].polynomials @ tilts.reshape(-1, W, 3, 1))[..., 0]
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


def sample_case(case: Case, model: SampleModel, seed: int, index: int) -> Case:
    """Make a sample a case, which `femgear.run` solves at the positions of the model, in one mesh period."""
    gears, d = model.basis.gears, model.deviations(model.draw(seed, index, 1)[0])
    base = model.basis.deviations or no_deviations(gears)
    written = case_text.parse(case.source, case.name)

    def lengths(values) -> list[str]:
        return [f"{1e6 * value:.12g} um" for value in values]

    def errors(runout: Runout, pitch=None, thickness: float = 0.0) -> dict[str, object]:
        found: dict[str, object] = {"runout_amplitude": lengths([runout.amplitude])[0]}
        found["runout_phase"] = f"{runout.phase:.12g} rad"
        if pitch is not None:
            found |= {"cumulative_pitch": lengths(pitch), "thickness_reduction": lengths([thickness])[0]}
        return found

    def along(gear, pitch):
        return pitch * (gear.reference_radius / gear.base_radius)

    places = along(gears.planet, d.planet_ring_side_pitch)
    parts = zip(d.planet_runout, places, d.planet_thickness, strict=True)
    tables = {
        "sun": errors(d.sun_runout, -along(gears.sun, d.sun_pitch), d.sun_thickness),
        "ring": errors(d.ring_runout, -along(gears.ring, d.ring_pitch), d.ring_thickness),
        "carrier": errors(d.carrier_runout),
    }
    values: dict[str, object] = {
        f"{name}.errors.{key}": value for name, table in tables.items() for key, value in table.items()
    }
    values |= {f"{name}.errors.pitch": None for name in ("sun", "ring")}
    values["planet.individual"] = [{"planet": n + 1, **errors(*part)} for n, part in enumerate(parts)]
    ways = ("radial", "tangential")
    values["set.pin_errors"] = [
        {"planet": n + 1, **dict(zip(ways, lengths(pin), strict=True))} for n, pin in enumerate(d.pin_errors)
    ]
    slopes: dict[str, list] = {}
    for name in _SLOPES:
        gear, _, side = name.partition("_")
        key, known = f"{gear}.modifications", len(getattr(base, name).modifications)
        tables = slopes.setdefault(key, list(written[gear].get("modifications", [])))
        for slope in getattr(d, name).modifications[known:]:
            table = {"kind": "profile slope", "amount": lengths([slope.amount])[0]}
            table |= {"flank": side.replace("_", " ")} if side else {}
            tables.append(table)
    values |= {key: tables for key, tables in slopes.items() if tables}
    values |= {"static.positions": len(model.position), "static.longest_record": 1}
    values["title"] = f"{case.title[:150]}: sample {index} of seed {seed}"
    return with_values(case, values)


def over_a_turn(model: SampleModel, errors: np.ndarray) -> tuple[float, float]:
    """Compute the transmission error [m] and the largest share of a sample over a turn of the carrier.

    Against the ring: as many mesh periods as it has teeth, by the springs of tooth pairs.

    ``errors`` (K,) are those of the sample [m].
    """
    s, level, P = model.solved, model.level(*model.windows), len(model.position)
    setup, periods = level.found.setup, np.arange(s.gears.ring.teeth)
    turns = np.repeat(-periods if s.gears is not model.basis.gears else periods, P)
    tau = np.tile(model.position, len(periods)) + turns
    where = setup.tooth, np.tile(setup.turns, len(periods)) + turns, tau
    own = pair_separations(s.gears, model.image(model.deviations(errors)), *where, back=False)
    case = pair_separations(s.gears, s.deviations, setup.tooth, setup.turns, model.position, back=False)
    own = np.moveaxis(own.reshape(len(own), len(periods), P, -1) - case[:, None], 1, 0)
    found = level.found
    separations = own[:, found.mesh, found.position[:, None], found.pair]
    tilts = None if level.tilts is None else np.tensordot(errors, level.tilts, 1)[None]
    force, motions, _, _ = solve_laws(level.laws, model.load, separations, tilts)
    N = s.gears.n_planets
    share = force.reshape(*force.shape[:2], 2, N, -1).sum(axis=-1)[:, :, 0].max() / model.load[N]
    return float(np.ptp(motions[..., N])), float(share)


@one_blas_thread()
def samples_into(
    case: Case,
    folder: Path,
    *,
    tolerances: Path,
    count: int = 1000,
    seed: int = 1,
    positions: int = POSITIONS,
    exact: bool = False,
    cache: Path | None = None,
    progress: Progress = silent,
) -> tuple[list[Block], list[str]]:
    """Compute samples of a case; write their numbers, a figure and the worst of them as a case file.

    The worst has the largest transmission error. Some samples are solved again exactly.

    Parameters
    ----------
    case, folder : Case, path
    tolerances : path
        File of the tolerances.
    count, seed : int
        Samples 0 to ``count - 1`` of a seed.
    positions, exact
        As of `sample_model` and `sample_block`.
    cache, progress
        As for `femgear.study.sweep.sweep_into`.

    Returns
    -------
    blocks : list of Block
        What there is to say.
    names : list of str
        Of the files.

    Raises
    ------
    CaseError
        E-RANGE: a number of samples, positions or a seed that cannot be; what `prepared` raises.
    StorageError
    """
    checked(count, "--number", 1)
    checked(seed, "--seed", 0, 2**32)
    model, text = prepared(case, tolerances, positions=positions, cache=cache)
    own_files(folder, FILES)
    items = [(first, min(_BLOCK, count - first)) for first in range(0, count, _BLOCK)]
    work, found = partial(_block, model, seed, exact), {}
    for index, outcome in ((i, work(item)) for i, item in enumerate(items)):
        found[index] = outcome
        progress("samples", index + 1, len(items))
    values = {name: np.concatenate([found[i][name] for i in range(len(items))]) for name in found[0]}
    order = np.argsort(values["transmission_error"], kind="stable")
    worst, largest = int(order[-1]), values["planet_share"].max(axis=1)
    chosen = order[np.linspace(0, count - 1, min(_CHECKED, count)).astype(int)]
    chosen = np.unique(np.append(chosen, largest.argmax()))
    errors = np.concatenate([model.draw(seed, int(i), 1) for i in chosen])
    again = exact_numbers(model, errors)
    turn = np.array([over_a_turn(model, one) for one in errors])
    ideal = exact_numbers(model, np.zeros((1, errors.shape[1])))
    attrs = {"seed": seed, "tolerances": text, "case": to_toml(case), "worst": worst}
    data = _dataset(model, values, chosen, again, turn, attrs | {"method": "exact" if exact else "spring"})
    write_dataset(data, folder / FILES[0])
    save_figure(figure(data), folder / FILES[1])
    write_text(to_toml(sample_case(case, model, seed, worst)), folder / FILES[2])
    return [_described(data, ideal)], list(FILES)


def _block(model: SampleModel, seed: int, exact: bool, item: tuple[int, int]) -> dict[str, np.ndarray]:
    return sample_block(model, seed, *item, exact=exact)


def prepared(
    case: Case, tolerances: Path, *, positions: int = POSITIONS, cache: Path | None = None
) -> tuple[SampleModel, str]:
    """Prepare the samples of a case for a file of tolerances, whose text comes with the model.

    Raises
    ------
    CaseError
        What `read_tolerances` and `sample_model` refuse; E-SUPPORT: a record with back flanks; E-RANGE.
    """
    need_set(case)
    found, text = read_tolerances(tolerances, case.sun.module)
    checked(positions, "--positions", 8, 4096)
    if case.static.back_flanks:
        raise CaseError(
            "samples are solved on their drive flanks alone", code="E-SUPPORT", key="static.back_flanks",
            value=True, limit="false", remedy="set it to false, or solve single samples by femgear run",
            file=case.location("static.back_flanks"),
        )  # fmt: skip
    basis = design_basis(case, cache=cache)
    torque = sun_torque(case, basis.gears)
    return sample_model(basis, found, sun_torque=torque, positions=positions), text


def checked(value: int, key: str, least: int, most: int = _MOST) -> None:
    """Refuse (E-RANGE) a number under the least or over the most."""
    if not least <= value <= most:
        message = "the number is out of range"
        raise CaseError(message, code="E-RANGE", key=key, value=value, limit=f"{least} to {most}")


_NUMBERS = {
    "transmission_error": ("m", "static transmission error from sun to ring, peak to peak"),
    "largest_share": ("1", "largest share of a planet in the torque"),
    "stiffness_sun_planet": ("N/m", "mean tangent stiffness of the sun-planet meshes"),
    "stiffness_planet_ring": ("N/m", "mean tangent stiffness of the planet-ring meshes"),
}
"""Numbers of a sample, with their units."""


def sample_numbers(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Choose the single numbers (n,) of every sample from what `sample_block` gives, by name."""
    columns = values["transmission_error"], values["planet_share"].max(axis=1), *values["mesh_stiffness"].T
    return dict(zip(_NUMBERS, columns, strict=True))


def _dataset(model: SampleModel, values, chosen, again, turn, attrs) -> xr.Dataset:
    """Numbers of all samples, of those solved `again`, and of those over a `turn` of the carrier."""
    numbers, exact = sample_numbers(values), sample_numbers(again)
    entries: dict[str, tuple] = {
        "planet_share": ("sample planet", values["planet_share"], "1", "largest share of the planet"),
        "opens": ("sample planet", values["opens"], "1", "whether the planet loses its load at a position"),
    }
    for name, (unit, words) in _NUMBERS.items():
        entries[name] = ("sample", numbers[name], unit, words)
        quantiles = np.quantile(numbers[name], QUANTILES)
        entries[f"{name}_quantile"] = ("quantile", quantiles, unit, f"{words}, quantiles")
        entries[f"{name}_exact"] = ("check", exact[name], unit, f"{words}, whole contact problem")
        error = np.abs(numbers[name][chosen] - exact[name]).max() / np.abs(exact[name]).max()
        entries[f"{name}_error"] = ("", error, "1", f"{words}: largest error of the checked samples")
    for name, row in zip(("transmission_error", "largest_share"), turn.T, strict=True):
        unit, words = _NUMBERS[name]
        entries[f"{name}_turn"] = ("check", row, unit, f"{words}, over a turn of the carrier")
    coords = {
        "sample": ("sample", np.arange(len(numbers["largest_share"])), "1", "sample of the seed"),
        "planet": ("planet", np.arange(len(values["opens"][0])) + 1, "1", "planet"),
        "quantile": ("quantile", QUANTILES, "1", "share of the samples below"),
        "check": ("check", chosen, "1", "sample of the seed that was solved again"),
    }
    attrs |= {"positions": len(model.position), "mesh_periods": 1}
    return dataset(entries, coords, attrs | {"turn": model.basis.gears.ring.teeth})


def figure(data: xr.Dataset):
    """Draw transmission error against largest share of all samples, and the distributions of both."""
    ste, share = 1e6 * data.transmission_error.values, data.largest_share.values
    found, axes = new_figure(columns=3, width=12.0, height=4.2)
    names = "transmission error, peak to peak [µm]", "largest share of a planet [1]"
    axes[0].plot(share, ste, ".", markersize=3, alpha=0.3, color=BLUE, rasterized=True)
    worst = int(data.attrs["worst"])
    axes[0].plot(share[worst], ste[worst], "D", color=VERMILION, label=f"worst: sample {worst}")
    label(axes[0], names[1], names[0], f"{len(ste)} samples, seed {data.attrs['seed']}")
    for ax, name, values in zip(axes[1:], names, (ste, share), strict=True):
        ax.hist(values, 80, weights=np.full(len(values), 100.0 / len(values)), color=BLUE)
        for part, dash in ((0.5, "-"), (0.95, "--"), (0.99, ":")):
            at = np.quantile(values, part)
            ax.axvline(at, color=VERMILION, linestyle=dash, label=f"{part:.0%} of the samples below")
        label(ax, name, "samples [%]")
    legend_below(found, columns=4)
    return found


def _described(data: xr.Dataset, ideal: dict[str, np.ndarray]) -> Block:
    """Quantiles of all numbers, and how far to trust them."""
    scales = {"m": (1e6, "um"), "N/m": (1e-6, "N/um"), "1": (1.0, "")}
    rows, errors = [], []
    for name, (unit, words) in _NUMBERS.items():
        scale, shown = scales[unit]
        values = [sample_numbers(ideal)[name][0], *data[f"{name}_quantile"].values, data[name].values.max()]
        rows.append((f"{words} [{shown}]".replace(" []", ""), *(f"{scale * value:.5g}" for value in values)))
        errors.append(f"{float(data[f'{name}_error']):.1e} ({name.replace('_', ' ')})")
    worst, at, check = int(data.attrs["worst"]), int(data.largest_share.values.argmax()), data.check.values
    exact = 1e6 * float(data.transmission_error_exact.values[check == worst][0])
    ratios = [
        np.quantile(data[f"{name}_turn"].values / data[f"{name}_exact"].values, (0.0, 1.0))
        for name in ("transmission_error", "largest_share")
    ]
    (low, high), (least, most) = ratios
    notes = (
        f"method {data.attrs['method']}; {len(check)} samples solved again exactly differ by at most "
        f"{', '.join(errors)} of the largest",
        f"{data.attrs['positions']} positions of one mesh period; over the {data.attrs['turn']} of a turn of "
        f"the carrier these samples have {low:.2f} to {high:.2f} times the transmission error and "
        f"{least:.2f} to {most:.2f} times the largest share",
        f"a planet loses its load in {float(data.opens.any('planet').mean()):.2%} of the samples",
        f"worst.toml: sample {worst}, transmission error {exact:.6g} um exactly; largest share: sample {at}",
    )
    header = ("number", "ideal", *(f"{q:.0%}" for q in QUANTILES), "largest")
    return Block(f"{len(data.sample)} samples, seed {data.attrs['seed']}", header, tuple(rows), notes)
