"""Results of a planar case: modes.nc, branch.nc, response.nc, their tables, and remarks on pictures.

Lines of motions and forces belong to the real signals ``x(t) = Re sum_l x_l exp(i (order_l . theta(t)))``;
every variable of a file carries its units. The tables say what the case is and what was found;
`branch_warnings` and `planar_response_warnings` say what speaks against it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.gear_set import planetary_set, support_text
from femgear.case.planetary import output_member
from femgear.case.quantities import RPM
from femgear.findings import NOTE, Finding, findings_in, percent
from femgear.gears.kinematics import torques
from femgear.report.response import stored_harmonics
from femgear.report.tables import Block, Marks, chosen, first_speeds, significant, tabulate
from femgear.stages.lumped_set import modes_dataset, needed, stiffness_text, torsion_text
from femgear.stages.protocol import StageResult
from femgear.stages.static_results import set_warnings
from femgear.storage.contents import Contents
from femgear.storage.results import complex_entries, coordinates
from femgear.system.fourier import fluctuation
from femgear.system.rigid_bodies import CENTRAL
from femgear.trains.planar.model import (
    MOTIONS,
    TAIL_LIMIT,
    MotionLines,
    flank_forces,
    merged_folds,
    shown_points,
)

if TYPE_CHECKING:
    import xarray as xr

    from femgear.gears.kinematics import Speeds
    from femgear.gears.planetary import PlanetarySet
    from femgear.solvers.continuation.branches import Branch
    from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
    from femgear.storage.results import Results
    from femgear.system.rigid_bodies import PlanarSet
    from femgear.system.system import Modes
    from femgear.trains.planar.model import PlanarModel
    from femgear.trains.planar.section import PlanarCase

FOURIER = "x(t) = Re sum_l (x_real + i x_imag)_l exp(i (order_l . theta(t)))"

# instants of a turn of the weight at which forces are stored
_PHASES = 721

# distance of a multiplier from 1 at a limit point beyond which harmonics are missing
_TRUNCATED = 0.2
# share of the energy in the upper half of the lines beyond which it is said, as in the spectral stage
_ENERGY = 1e-6
# smoothing over mean compression that is said: the force is then wrong by (0.05 / 2)^2, 0.06 %
_SMOOTH = 0.05
_STABLE = {1: "yes", 0: "no", -1: "not known"}

_BODIES = ("", "mass [kg]", "inertia [kg m^2]", "support [N/m]", "torsional support [N m/rad]")

# what is known of a solution at every speed
_OF_SOLUTIONS = {
    "converged": "whether the solution satisfies its tolerance",
    "iterations": "iterations of Newton's method",
    "residual": "relative residual of the harmonic equations",
    "tail": "share of the amplitude in the upper half of the lines",
    "spectral_radius": "spectral radius of the fixed point",
}

# pictures drawn by stability, of the stage "response", of the branch, and of displacements without forces
_BY_STABILITY = ("weight_response", "tooth_contact")
_OF_RESPONSE = ("response_", "contact_over_speed")
_OF_BRANCH = ("weight_response", "carrier_orbit", "planet_bearing_forces", "wedged_teeth", "tooth_contact")
_OF_MOTION = ("weight_response", "carrier_orbit", "response_orbit")


@dataclass(frozen=True)
class PlanarModesResult(StageResult):
    """Modes of the set at standstill: mean mesh stiffness, bearings closed, back flanks open.

    ``planetary_set`` is the geometry of the gears, ``data`` the rigid bodies and stiffnesses, ``modes`` what they give.
    """

    planetary_set: PlanetarySet
    data: PlanarSet
    modes: Modes

    def contents(self) -> Contents:
        """Collect the contents of modes.nc: translations and rotations of all bodies, no elastic ring."""
        attrs = {
            "title": "modes of the planar set at standstill, bearings closed, back flanks open",
            "planet_angles": np.asarray(self.planetary_set.planet_angles),
        }
        return modes_dataset(self.data, self.planetary_set, self.modes, attrs=attrs)


@dataclass(frozen=True)
class BranchResult(StageResult):
    """Periodic responses to the weight over its frequency in the carrier frame.

    ``planetary_set`` is the geometry of the gears, ``model`` the lumped set; ``branch`` are the solutions,
    ``lines`` has one entry a point of the branch; ``sense`` is 1 where the carrier turns counter-clockwise,
    else -1; ``ending`` says where the branch ended and why.
    """

    planetary_set: PlanetarySet
    model: PlanarModel
    branch: Branch
    lines: tuple[MotionLines, ...]
    sense: int
    ending: str

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.branch.converged))

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(np.max(self.branch.residual))

    @property
    def message(self) -> str:
        """Where the branch ended, and why."""
        return self.ending

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what branch.nc says against itself, see `branch_warnings`."""
        return branch_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of branch.nc."""
        branch, verdicts = self.branch, self.branch.verdicts
        count = len(branch.parameter)
        point, hertz = ("point",), branch.parameter / (2.0 * np.pi)
        folds, crossings = np.zeros((2, count), bool)
        folds[branch.folds], crossings[branch.branch_points] = True, True
        carrier = self.sense * branch.parameter
        # without verdicts everything is open
        nothing, unsaid = np.full(count, np.nan), [""] * count
        stable = np.array(
            [-1 if verdict.stable is None else verdict.stable for verdict in verdicts] or [-1] * count, int
        )
        notes = [verdict.message if verdict.stable is None else "" for verdict in verdicts] or unsaid
        largest, loss = (branch.largest_multiplier, list(branch.loss)) if verdicts else (nothing, unsaid)
        variables = {
            "weight_frequency": (point, hertz, "Hz", "frequency of the weight in the carrier frame"),
            "carrier_speed": (point, carrier, "rad/s", "speed of the carrier, counter-clockwise positive"),
            "fold": (point, folds, "1", "whether the point is a limit point"),
            "branch_point": (point, crossings, "1", "whether another branch crosses"),
            "tail": (point, branch.tail, "1", "share of the amplitude in the upper half of the harmonics"),
            "spectral_radius": (point, branch.spectral_radius, "1", "spectral radius of the fixed point"),
            "residual": (point, branch.residual, "1", "relative residual of the harmonic equations"),
            "converged": (point, branch.converged, "1", "whether the solution satisfies its tolerance"),
            "stable": (point, stable, "1", "stability: 1 stable, 0 not stable, -1 not known"),
            "stability_note": (point, notes, "1", "why stability is not known"),
            "largest_multiplier": (point, largest, "1", "largest Floquet multiplier"),
            "multiplier_distance": (
                point,
                [_nearest(verdict) for verdict in verdicts] or nothing,
                "1",
                "distance of the nearest Floquet multiplier from 1, which is zero at a limit point of the motion",
            ),
            "loss": (point, loss, "1", "how stability is lost"),
        }
        variables |= _flank_forces(self, stable) | _motions(self.lines, "point", "harmonic")
        coords = _coordinates(self.planetary_set) | {
            "point": (point, np.arange(count), "1", "point along the branch"),
            "harmonic": (("harmonic",), branch.orders[:, 0], "1", "harmonic of the weight's frequency"),
            "phase": (("phase",), np.linspace(0.0, 2.0 * np.pi, _PHASES), "rad", "phase of the weight"),
        }
        data = Contents(
            variables,
            coords=coords,
            attrs={
                "title": "periodic responses to the weight",
                "message": self.ending,
                "complete": int(branch.complete),
                "stability": "Floquet multipliers" if verdicts else "not computed",
                "fourier_convention": FOURIER,
            },
        )
        data["stable"].attrs |= {"flag_values": [1, 0, -1], "flag_meanings": "stable not_stable not_known"}
        return data


@dataclass(frozen=True)
class PlanarResponseResult(StageResult):
    """Responses of the ``planetary_set`` to weight and mesh frequency together.

    ``input_speed`` (speeds,) is that of every response [rad/s], ``speeds`` are those of the members, ``solutions`` the
    lines of the deflections, ``lines`` the motions and forces that follow from them, all of length (speeds,).
    """

    planetary_set: PlanetarySet
    input_speed: np.ndarray
    speeds: tuple[Speeds, ...]
    solutions: tuple[PeriodicSolution, ...]
    lines: tuple[MotionLines, ...]

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return all(solution.converged for solution in self.solutions)

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(max(solution.residual for solution in self.solutions))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "; ".join(dict.fromkeys(solution.message for solution in self.solutions))

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what response.nc says against itself, see `planar_response_warnings`."""
        return planar_response_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of response.nc."""
        solutions, speed = self.solutions, ("speed",)
        mesh = [speeds_there.mesh_frequency for speeds_there in self.speeds]
        variables = {
            "carrier_speed": (
                speed,
                [speeds_there.carrier for speeds_there in self.speeds],
                "rad/s",
                "speed of the carrier, counter-clockwise positive",
            ),
            "mesh_frequency": (speed, mesh, "Hz", "mesh frequency"),
            "frequency": (
                ("speed", "line"),
                [solution.line_frequency / (2 * np.pi) for solution in solutions],
                "Hz",
                "frequency of the line in the carrier frame",
            ),
        }
        variables |= {
            name: (speed, [getattr(solution, name) for solution in solutions], "1", text)
            for name, text in _OF_SOLUTIONS.items()
        }
        variables |= _motions(self.lines, "speed", "line")
        orders, line = solutions[0].orders, ("line",)
        coords = _coordinates(self.planetary_set) | coordinates(speed=self.input_speed / RPM)
        coords |= {
            "carrier_order": (line, orders[:, 0], "1", "multiple of the carrier's frequency"),
            "mesh_order": (line, orders[:, 1], "1", "multiple of the mesh frequency"),
        }
        return Contents(
            variables,
            coords=coords,
            attrs={
                "title": "responses to weight and mesh frequency together",
                "message": " ".join(dict.fromkeys(solution.message for solution in solutions)),
                "mesh_lines": int(np.any(orders[:, 1] != 0)),
                "fourier_convention": FOURIER,
            },
        )


def _nearest(verdict: FloquetVerdict) -> float:
    """Distance of the nearest multiplier from 1."""
    return float(np.abs(verdict.multipliers - 1.0).min()) if len(verdict.multipliers) else np.nan


def _flank_forces(result: BranchResult, stable: np.ndarray) -> dict[str, tuple]:
    """Forces in time at the points that are drawn, from the laws of the contacts."""
    rms = np.array([line.rms[0, 0] for line in result.lines])
    back = np.array([line.back_contact.max() for line in result.lines])
    points = shown_points(rms, back, stable)
    theta = np.linspace(0.0, 2.0 * np.pi, _PHASES)[:, None]
    forces = [flank_forces(result.model, result.branch.solutions[point], theta) for point, _ in points]
    drive, behind = (np.array([force[side].T for force in forces]) for side in (0, 1))
    shown, dims = ("shown",), ("shown", "mesh", "phase")
    return {
        "shown_point": (shown, [point for point, _ in points], "1", "point whose forces are given in time"),
        "shown_as": (shown, [words for _, words in points], "1", "what the point is"),
        "drive_force": (dims, drive, "N", "force of the drive flanks in time, from the law of the contact"),
        "flank_force": (dims, behind, "N", "force of back flanks on their own line in time, from its law"),
    }


def _motions(lines: Sequence[MotionLines], along: str, line: str) -> dict[str, tuple]:
    """Displacements, forces and contact of all solutions, which stand along the first axis."""
    entries = {}
    for name, (dims, unit, words) in MOTIONS.items():
        values = np.array([getattr(of_speed, name) for of_speed in lines])
        axes = (along, *(line if axis == "line" else axis for axis in dims.split()))
        entry = (axes, values, unit, words)
        entries |= complex_entries([(name, *entry)]) if "line" in dims else {name: entry}
    return entries


def _coordinates(gears: PlanetarySet) -> dict[str, tuple]:
    return coordinates(
        mesh=gears.mesh_names,
        planet=np.arange(1, gears.n_planets + 1),
        member=CENTRAL,
        axis=["x", "y"],
        direction=["radial", "tangential"],
    )


def describe_planar(case: PlanarCase, planetary: PlanetarySet) -> Block:
    """Tabulate bodies and supports of a planar case, with mesh stiffness, play and weight as notes."""
    planar = case.planar
    stiffness = stiffness_text(planar.mesh_stiffness) if planar.mesh_stiffness else "of the static solution"
    notes = [f"mesh stiffness: {stiffness}", _play(case, planetary)]
    if planar.carrier_bearing is not None:
        bearing = planar.carrier_bearing
        notes.append(
            f"bearing between carrier and {bearing.on}: {bearing.stiffness:.6g} N/m, radial clearance "
            f"{bearing.clearance * 1e6:.6g} um"
        )
    held = "torsional supports" if planar.reaction == "supports" else f"the {output_member(case)}"
    notes.append(f"the torque on the {case.operation.input} is taken up by {held}")
    if planar.gravity is not None:
        notes.append(f"weight {planar.gravity.acceleration:.6g} m/s^2; {_sense(case)}")
    notes.append(_smoothing(case, planetary))
    return Block("Planar model", _BODIES, tuple(_bodies(case)), tuple(notes))


def _bodies(case: PlanarCase) -> Iterator[tuple[str, ...]]:
    planar = case.planar
    for name, section in (("sun", case.sun), ("ring", planar.ring), ("carrier", case.carrier)):
        torsion = torsion_text(case, name, getattr(planar.torsion, name))
        yield name, f"{section.mass:.6g}", f"{section.inertia:.6g}", support_text(case, name, section), torsion
    planet = case.planet
    bearing = f"{planet.bearing_stiffness:.6g} (bearing)"
    yield "planet", f"{planet.mass:.6g}", f"{planet.inertia:.6g}", bearing, "0"


def _play(case: PlanarCase, planetary: PlanetarySet) -> str:
    play = case.planar.line_backlash
    values = (planetary.backlash_sun_planet, planetary.backlash_planet_ring) if play is None else (play,)
    text = " and ".join(dict.fromkeys(f"{max(0.0, round(value * 1e6, 6)):.6g}" for value in values))
    lines_of_back_flanks = (
        "on lines of action of their own" if case.planar.back_flanks else "on those of the drive flanks"
    )
    return f"play along the line of action {text} um, back flanks {lines_of_back_flanks}"


def _smoothing(case: PlanarCase, planetary: PlanetarySet) -> str:
    """Length over which contact sets in, beside the mean compression where the stiffness is given."""
    given, smoothing = case.planar.mesh_stiffness, case.planar.smoothing
    text = f"contact sets in over {smoothing * 1e6:.6g} um"
    if given is None:
        return text
    compression = _mean_compression(case, planetary)
    text += f", {smoothing / compression:.2g} of the mean compression {compression * 1e6:.4g} um"
    return text


def _mean_compression(case: PlanarCase, planetary: PlanetarySet) -> float:
    """Compression of the stiffer mesh of a case that gives its stiffnesses, under the mean load [m]."""
    given = needed(case.planar.mesh_stiffness, "planar.mesh_stiffness")
    torque = torques(planetary, member=case.operation.input, torque=case.operation.torque).sun
    force = abs(torque) / (planetary.n_planets * planetary.sun.base_radius)
    return force / max(given.sun_planet, given.planet_ring)


def planar_warnings(case: PlanarCase) -> Iterator[Finding]:
    """List what deserves a look in a planar case: that of its set, and contact that sets in over too much."""
    yield from set_warnings(case)
    smoothing = case.planar.smoothing
    if case.planar.mesh_stiffness is None:
        return
    compression = _mean_compression(case, planetary_set(case))
    if smoothing > _SMOOTH * compression:
        text = (
            f"contact sets in over {smoothing * 1e6:.6g} um, {smoothing / compression:.2g} of the mean "
            f"compression {compression * 1e6:.4g} um"
        )
        remedy = "lower it where teeth part or wedge"
        yield Finding("W-SMOOTHING", "planar.smoothing", text, remedy=remedy)


def _sense(case: PlanarCase) -> str:
    """How torque and turning of the carrier belong together."""
    operation = case.operation
    if operation.fixed == "carrier":
        return "the carrier stands"
    # the output works against its turning, unless the torque itself brakes
    driven = (operation.input == "carrier") == (operation.torque > 0.0)
    return f"the torque on the carrier acts {'with' if driven else 'against'} its turning"


def describe_branch(data: xr.Dataset, run: Iterable[Finding] = ()) -> Block:
    """Tabulate branch.nc: ends, folds and the largest responses [um], by frequency of the weight [Hz].

    The findings of the whole ``run`` give the order of the marks.
    """
    hertz, rms = data["weight_frequency"].values, data["rms"].values
    judged, marks = data.attrs["stability"] != "not computed", Marks(findings_in(data.attrs), run)
    doubtful = _tail_codes(data)
    stable = data["stable"].values
    named = {0: "start", len(hertz) - 1: "end"}
    named |= {int(point): "fold" for point in merged_folds(hertz, data["fold"].values)}
    named[int(np.argmax(rms[:, 0, 0]))] = "largest carrier x"
    named[int(np.argmax(rms[:, 1, 0]))] = "largest ring x"
    columns = {
        "weight [Hz]": lambda point: f"{hertz[point]:.4f}",
        "": lambda point: named[point],
        "carrier x rms [um]": lambda point: marks(significant(1e6 * rms[point, 0, 0], 3), *doubtful(point)),
        "ring x rms [um]": lambda point: marks(significant(1e6 * rms[point, 1, 0], 3), *doubtful(point)),
        "sun x rms [um]": lambda point: marks(significant(1e6 * rms[point, 2, 0], 3), *doubtful(point)),
        "back contact": lambda point: marks(f"{float(data['back_contact'].values[point].max()):.3f}", *doubtful(point)),
        "stable": lambda point: _STABLE[int(stable[point])] if judged else "-",
    }
    notes = [
        f"{len(hertz)} points; {data.attrs['message']!s}",
        "back contact: largest share of the cycle in which back flanks touch",
    ]
    notes += _verdicts(data) if judged else ["stability was not computed"]
    notes += _truncation(data) if judged else []
    tail, force = (float(data[name].max()) for name in ("tail", "force_tail"))
    notes.append(
        f"tail, share of the amplitude in the upper half of the lines: up to {tail:.2g} of the deflections, "
        f"{force:.2g} of the mesh forces"
    )
    return tabulate("Response to the weight", sorted(named), columns, notes, marks)


def _tail_codes(data: xr.Dataset) -> Callable[[int], tuple[str, ...]]:
    """Tell which points or speeds the warning of too few lines (W-TAIL) is about."""
    wrong = np.maximum(data["tail"].values, data["force_tail"].values) > TAIL_LIMIT
    return lambda i: ("W-TAIL",) * bool(wrong[i])


def tail_warnings(data: xr.Dataset, key: str) -> tuple[Finding, ...]:
    """Tell what truncation of the lines does to branch.nc or response.nc; ``key`` is the entry to raise."""
    tail, force = data["tail"].values, data["force_tail"].values
    worst = np.maximum(tail, force)
    if (wrong := worst > TAIL_LIMIT).any():
        text = (
            f"{_where(data, wrong)}: {worst.max():.2g} of the amplitude lies in the upper half of "
            f"the lines ({tail.max():.2g} of the deflections, {force.max():.2g} of the mesh forces): forces "
            f"and contact shares of this response are not to be trusted, raise {key}"
        )
        return (Finding("W-TAIL", "", text),)
    if (cut := worst**2 > _ENERGY).any():
        text = (
            f"{_where(data, cut)}: {worst.max() ** 2:.2g} of the energy of deflections or mesh forces lies "
            f"in the upper half of the lines; {key} says how many there are"
        )
        return (Finding("W-TAIL", "", text, severity=NOTE),)
    return ()


def _where(data: xr.Dataset, bad: np.ndarray) -> str:
    """Points or speeds, in words."""
    if "weight_frequency" in data:
        hertz = data["weight_frequency"].values[bad]
        return f"{len(hertz)} of {len(bad)} points, {hertz.min():.4g} to {hertz.max():.4g} Hz"
    return f"{np.count_nonzero(bad)} of {len(bad)} speeds, {first_speeds(data['speed'].values[bad])}"


def branch_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what speaks against branch.nc: an early end, and truncation of its lines."""
    if not bool(data.attrs["complete"]):
        yield Finding("W-BRANCH", "planar.branch", str(data.attrs["message"]))
    yield from tail_warnings(data, "planar.branch.harmonics")


def planar_response_warnings(data: xr.Dataset) -> tuple[Finding, ...]:
    """Tell what truncation of the lines does to response.nc."""
    more = ", side_bands or dynamics.response_harmonics" if data.attrs["mesh_lines"] else ""
    return tail_warnings(data, f"planar.response.carrier_harmonics{more}")


def _truncation(data: xr.Dataset) -> Iterator[str]:
    """Limit points that are none of the motion itself: there one multiplier would be 1."""
    hertz, distance = data["weight_frequency"].values, data["multiplier_distance"].values
    for point in merged_folds(hertz, data["fold"].values):
        if distance[point] > _TRUNCATED:
            yield (
                f"at the fold at {hertz[point]:.3f} Hz the nearest multiplier lies {distance[point]:.2g} "
                "from 1: too few harmonics there, raise planar.branch.harmonics"
            )


def _verdicts(data: xr.Dataset) -> Iterator[str]:
    """Parts of the branch that are not stable, or not known to be, in words."""
    stable, hertz = data["stable"].values, data["weight_frequency"].values
    edges = np.flatnonzero(np.diff(stable, prepend=stable[0] + 5, append=stable[-1] + 5))
    for first, last in pairwise(edges):
        state, what = stable[first], data["stability_note" if stable[first] < 0 else "loss"]
        if state == 1:
            continue
        reasons = ", ".join(dict.fromkeys(str(text) for text in what.values[first:last]))
        span = f"{hertz[first]:.3f} to {hertz[last - 1]:.3f} Hz along the branch"
        yield f"not stable: {span} ({reasons})" if state == 0 else f"not determined: {span} ({reasons})"


def describe_planar_response(data: xr.Dataset, run: Iterable[Finding] = ()) -> Block:
    """Tabulate displacements [um], mesh forces [kN] and contact of response.nc, a row a speed [rpm].

    The findings of the whole ``run`` give the order of the marks.
    """
    varying = fluctuation(stored_harmonics(data, "mesh_force")).max(axis=1)
    marks, doubtful = Marks(findings_in(data.attrs), run), _tail_codes(data)
    columns = {
        "speed [rpm]": lambda i: f"{float(data.speed[i]):.4g}",
        "mesh [Hz]": lambda i: f"{float(data.mesh_frequency[i]):.4f}",
        "carrier x rms [um]": lambda i: marks(f"{1e6 * data.rms.values[i, 0, 0]:.4f}", *doubtful(i)),
        "mesh force rms [kN]": lambda i: marks(f"{1e-3 * varying[i]:.4f}", *doubtful(i)),
        "drive contact": lambda i: marks(f"{float(data.drive_contact[i].min()):.3f}", *doubtful(i)),
        "back contact": lambda i: marks(f"{float(data.back_contact[i].max()):.3f}", *doubtful(i)),
        "tail": lambda i: f"{float(data['tail'][i]):.2g}",
        "force tail": lambda i: f"{float(data['force_tail'][i]):.2g}",
    }
    lines = "lines of the weight alone: a constant mesh stiffness leaves none of the mesh frequency"
    if data.attrs["mesh_lines"]:
        lines = "lines of weight and mesh frequency"
    notes = [
        f"{data.sizes['line']} {lines}; mesh force: the largest fluctuation of "
        "all meshes; contact: least share of the time of the drive flanks, largest of the back flanks",
        "the stability of these responses is not computed",
    ]
    hertz = np.sort(np.abs(data["frequency"].values), axis=1)
    if np.any(np.diff(hertz, axis=1) <= 1e-9 * hertz.max()):
        notes.append(
            "some lines have one frequency: planar.response.carrier_harmonics or side_bands reach from the "
            "weight to the mesh frequency; r.m.s. values count such lines apart"
        )
    return tabulate("Weight and mesh frequency", chosen(data.sizes["speed"]), columns, notes, marks)


def published_modes(case: PlanarCase, data: xr.Dataset) -> tuple[Block, ...]:
    """Tabulate natural frequencies [Hz] that the case calls published beside the nearest of the kind."""
    entries = [(mode, mode.frequency) for mode in case.planar.published if mode.frequency is not None]
    if not entries:
        return ()
    kinds, frequency = np.array([str(kind) for kind in data["kind"].values]), data["frequency"].values
    rows = []
    for entry, hertz in entries:
        same = frequency[kinds == entry.kind]
        near, difference = "none", "-"
        if len(same):
            nearest = same[np.argmin(np.abs(same - hertz))]
            near, difference = f"{nearest:.6g}", f"{100 * (nearest / hertz - 1):+.2f}"
        rows.append((entry.kind, f"{hertz:.6g}", near, difference, entry.source))
    header = ("kind", "published [Hz]", "nearest here [Hz]", "difference [%]", "source")
    return (Block("Published natural frequencies", header, tuple(rows)),)


def comparisons(case: PlanarCase, stem: str) -> Iterator[str]:
    """Tell how to read a picture of this case, and published ones beside it."""
    planar = case.planar
    if stem in _BY_STABILITY and planar.branch is not None:
        yield (
            "Drawn through: stable by Floquet's theory; dashed: not stable; dotted: not known."
            if planar.branch.stability
            else "Stability was not computed: everything is drawn through."
        )
    if planar.mesh_stiffness is not None and stem.startswith(_OF_RESPONSE):
        yield "The mesh stiffness of this case is constant: the weight alone varies, at no mesh frequency."
    for entry in planar.published:
        if entry.figure is not None and (stem == entry.figure or stem.startswith(f"{entry.figure}_")):
            yield f"Beside {entry.source}: {entry.comparison}"


def doubts(results: Results, stem: str) -> Iterator[str]:
    """Tell what the results say against a picture."""
    stage = "branch" if stem in _OF_BRANCH else "response" if stem.startswith(_OF_RESPONSE) else None
    if stage is None or stage not in results.stages:
        return
    data = results[stage]
    motion, force = (float(data[name].max()) for name in ("tail", "force_tail"))
    tail = motion if stem.startswith(_OF_MOTION) else max(motion, force)
    if tail > TAIL_LIMIT:
        yield (
            f"Marked where more than {percent(TAIL_LIMIT)} of the amplitude lies in the upper half of the "
            f"harmonics (up to {tail:.2g}): shapes and peaks there are not to be trusted (W-TAIL)."
        )
