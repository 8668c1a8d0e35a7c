"""Teeth that part in a gearbox, by harmonic balance at the speed of the load case, and the results of it.

Stage by stage, as the response is solved: flanks of one stage part, and touch their back flanks, while meshes of all
others are springs about the loaded state (`femgear.trains.gearbox.nonlinear`). With ``together`` flanks of all stages
part and all carriers turn, while the stiffness of the one stage fluctuates. A pair has the mesh frequency alone, a
set whose carrier turns that of the carrier too, by which weight and uneven supports act on its planets. Of planets that
are shafts all meshes of one frequency excite at once; those of another one go round with them at their mean stiffness,
and part too. Bearings with play that are given by their stiffness keep it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.errors import CaseError, several
from femgear.findings import Finding, percent
from femgear.report.tables import Block, merged_names, tabulate
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.stages.protocol import Progress, StageResult, silent
from femgear.storage.contents import Contents
from femgear.system.force_laws import Element, GearMeshes, positive_part
from femgear.system.fourier import harmonic_lines, side_bands
from femgear.system.system import MeshExcitation, NonlinearSystem
from femgear.system.turning_meshes import TurningMeshes, planet_wave_generator
from femgear.trains.gearbox.case_file import CASING, BoxBalanceSection, GearboxCase, PairSection
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.excitation import constant_excitation, excitation_of, exciting_stages
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.model import StageModel
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, nonlinear_gearbox
from femgear.trains.gearbox.planet_branches import running_sets
from femgear.trains.gearbox.planet_shafts import unlike_planets
from femgear.trains.gearbox.play import loose_notes
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.running_branches import kinds_together
from femgear.trains.gearbox.sensors import sensor_rows
from femgear.trains.gearbox.silence import exciting_sections, weighed_sections

if TYPE_CHECKING:
    import xarray as xr

_INSTANTS, _TURNS = 512, 48
"""Instants of a mesh period, and angles of the carrier, at which forces are looked at."""
_ANGLES = 8
"""Angles of all other carriers for each of these, spread evenly by steps of `_STEP` of their turn."""
_STEP = 0.5 * (math.sqrt(5.0) - 1.0)
_SAMPLES = (4, 16), (8, 64)
"""Samples for an order, and at least, of carriers and of the mesh that excites, of several stages together."""
_EMBEDDED = 4000
"""Unknowns up to which a balance that fails is followed from its linear springs on."""
_SHOWN, _BY_STAGE = 1e-9, 6
"""Amplitude over the largest from which lines are tabled, and lines of a stage at most."""
_TAIL = 0.05
"""Share of the amplitude in the upper half of the lines that is told."""


@dataclass(frozen=True)
class StageBalance:
    """Periodic motion of a gearbox with one stage whose flanks part.

    Parameters
    ----------
    name : str
        Of the stage.
    meshes : tuple of str
        Names of its M meshes.
    solution : PeriodicSolution
        Of the harmonic balance.
    drive, back : (T, I, M) arrays
        Forces of drive flanks and back flanks [N] at I instants of the mesh period, or of the period of the
        excitation, at T angles of the carrier.
    bearings : tuple of str
        Names of the b bearings with play.
    bearing_force : (T, I, b) array
        Sizes of their forces [N].
    acceleration : (s, L) complex array
        Of the lines of the solution at all sensors [m/s^2].
    harmonic : (L,) array
        Multiple of the mesh frequency of every line; none where the stage does not excite.
    turns : mapping of str to (L,) array
        By stage turns of its carrier in every line.
    """

    name: str
    meshes: tuple[str, ...]
    solution: PeriodicSolution
    drive: np.ndarray
    back: np.ndarray
    bearings: tuple[str, ...] = ()
    bearing_force: np.ndarray = field(default_factory=lambda: np.zeros((1, _INSTANTS, 0)))
    acceleration: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), complex))
    harmonic: np.ndarray = field(default_factory=lambda: np.zeros(0))
    turns: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def uneven(self) -> np.ndarray:
        """Force (M,) of every mesh at the worst angle of the carrier over its mean, both over a mesh period."""
        mean = (self.drive - self.back).mean(axis=1)
        whole = mean.mean(axis=0)
        return np.divide(mean.max(axis=0), whole, out=np.full(len(whole), np.nan), where=whole != 0.0)

    def share(self, force: np.ndarray) -> np.ndarray:
        """Share (M,) of the time in which flanks with a force (T, I, M) [N] touch."""
        return (force > 0.0).mean(axis=(0, 1))


def solve_balance(state: Deflection, *, steps: Steps | None = None, progress: Progress = silent) -> list[StageBalance]:
    """Solve for the periodic motion with flanks that part, of all stages that excite the gearbox, one after the other.

    Without any of those that weight lets rattle, at constant stiffness.

    CaseError: planets that are not equally spaced on a carrier that turns (E-TURNING). ConvergenceError: an undamped
    resonance (E-RESONANCE).

    Parameters
    ----------
    state : Deflection
        Loaded state.
    steps : Steps, optional
        What other computations have left: excitations are kept in it.
    progress : callable
        Called with ("balance", done, total).
    """
    wanted, solved = state.model.case.balance, list[StageBalance]()
    weighed = [stage.name for stage in weighed_sections(state.model.case)]
    stages = [stage for stage in state.model.stages if stage.name in weighed] or exciting_stages(state)
    sets = _at_once(state, stages)
    for number, names in enumerate(sets):
        progress("balance", number, len(sets))
        exciting = [stage for stage in stages if stage.name in names]
        drives = {stage.name: _drive(state, stage, weighed=bool(weighed), steps=steps) for stage in exciting}
        beside = _around_with(state, names)
        for stage in state.model.stages:
            if stage.name not in drives and (wanted.together or stage.name in beside):
                drives[stage.name] = constant_excitation(state, stage, steps=steps)
        options: dict[str, Any] = {"harmonics": wanted.harmonics, "back_flanks": wanted.back_flanks}
        together = [group for group in (names, beside) if len(group) > 1]
        box = nonlinear_gearbox(state, drives, **options, together=together)
        moving = [stage.name for stage in box.stages]
        place = moving.index(merged_names(names))
        solution = _solved(box, wanted, place)
        solved.append(_moving(box, solution, place))
        if not number:
            excited = {merged_names(group) for group in sets} | {merged_names(beside)}
            silent_stages = [name for name in moving if name not in excited]
            solved += [_moving(box, solution, moving.index(name), excites=False) for name in silent_stages]
    return solved


def _drive(state: Deflection, stage: StageModel, *, weighed: bool, steps: Steps | None) -> MeshExcitation:
    """What a stage excites with; friction of pairs whose directions stand still is in it."""
    if weighed:
        return constant_excitation(state, stage)
    carrier = stage.section.carrier
    turns = carrier is not None and carrier != CASING and state.model.flow.speed[carrier] != 0.0
    rubs = isinstance(stage.section, PairSection) and not turns
    drive = excitation_of(state, stage, steps=steps, friction=rubs)
    if drive.source is None:
        return drive
    # friction acts about its mean, which the torques of the gearbox do not know
    mean = state.contacts[stage.name].normal_force[:, None]
    return replace(drive, force=drive.force - drive.force.mean(axis=1, keepdims=True) + mean)


def _at_once(state: Deflection, stages: Sequence[StageModel]) -> list[tuple[str, ...]]:
    """Names of the stages that excite at once: one, or all meshes of one frequency among branches of planets."""
    left, sets = [stage.name for stage in stages], list[tuple[str, ...]]()
    for running in running_sets(state.model.case):
        for kind, names in enumerate(running.kinds):
            if not {*left}.isdisjoint(names):
                alike = kinds_together(state.model, running, kind)
                at_once = {name for number in alike for name in running.kinds[number]}
                sets.append(tuple(name for name in left if name in at_once))
                left = [name for name in left if name not in at_once]
    return [*sets, *((name,) for name in left)]


def _around_with(state: Deflection, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the other meshes of branches of planets, which go round with those of these names."""
    for running in running_sets(state.model.case):
        every = {name for kind in running.kinds for name in kind}
        if not every.isdisjoint(names):
            return tuple(stage.name for stage in state.model.stages if stage.name in every.difference(names))
    return ()


def _moving(box: NonlinearGearbox, solution: PeriodicSolution, place: int, *, excites: bool = True) -> StageBalance:
    """Take the stage at a place out of a solution; lines at the sensors are those of stages that excite."""
    stage = box.stages[place]
    orders = solution.orders[: len(solution.orders) * excites]
    forces = *forces_of_flanks(box, solution, place), tuple(box.bearings), forces_of_bearings(box, solution, place)
    lines = accelerations_at_sensors(box, solution)[:, : len(orders)]
    harmonic = orders[:, stage.mesh_base] / stage.excitation.periods
    turns = {stage.name: orders[:, stage.turn_base] for stage in box.stages if stage.turns}
    return StageBalance(stage.name, stage.meshes, solution, *forces, lines, harmonic, turns)


def _solved(box: NonlinearGearbox, wanted: BoxBalanceSection, place: int) -> PeriodicSolution:
    """Solve for the motion with the excitation of the stage at a place: flanks that may pull first."""
    highest = wanted.harmonics * box.stages[place].excitation.periods
    options: dict[str, Any] = {"stability": False, "radius": False}
    if len(box.stages) > 1:
        orders = options["orders"] = lines_together(box, place, highest, wanted.side_bands)
        options["samples"] = _samples(orders, box.stages[place].mesh_base)
    elif len(box.frequency) > 1:
        orders = options["orders"] = side_bands(wanted.side_bands, highest, wanted.side_bands)
    else:
        orders = options["orders"] = harmonic_lines(highest)
    loaded = loaded_lines(box, len(orders)) if box.bearings else None
    held = solve_harmonic_balance(held_together(box), box.frequency, start=loaded, **options)
    solution = solve_harmonic_balance(box.problem, box.frequency, start=held, **options)
    if not solution.converged and solution.deflection.shape[0] * (2 * len(orders) - 1) <= _EMBEDDED:
        solution = solve_harmonic_balance(box.problem, box.frequency, **options)
    return solution


def lines_together(box: NonlinearGearbox, place: int, harmonics: int, side_bands: int) -> np.ndarray:
    """List the lines (L, n_bases) of all stages: so many harmonics of one mesh, so many turns of all carriers together.

    The mean comes first; of a line and its conjugate one is listed.
    """
    turning = [*dict.fromkeys(stage.turn_base for stage in box.stages if stage.turns)]
    highest = np.zeros(len(box.frequency), int)
    highest[turning], highest[box.stages[place].mesh_base] = side_bands, harmonics
    ranges = [range(-top, top + 1) for top in highest.tolist()]
    orders = np.array([order for order in product(*ranges) if order >= tuple(-value for value in order)])
    orders = orders[np.abs(orders[:, turning]).sum(axis=1) <= side_bands]
    return orders[np.argsort(orders.any(axis=1), kind="stable")]


def _samples(orders: np.ndarray, mesh: int) -> tuple[int, ...]:
    """Points along every base for lines of several stages together."""
    counts = []
    for base, top in enumerate(np.abs(orders).max(axis=0).tolist()):
        times, least = _SAMPLES[base == mesh]
        counts.append(max(times * top, least) if top else 1)
    return tuple(counts)


def accelerations_at_sensors(box: NonlinearGearbox, solution: PeriodicSolution) -> np.ndarray:
    """Compute the lines (s, L) of the accelerations at all sensors [m/s^2]."""
    rows = sensor_rows(box.deflection.model)
    if not len(rows):
        return np.zeros((0, len(solution.orders)), complex)
    return -(solution.line_frequency**2) * displacements(box.problem, solution, rows @ box.motion)


def loaded_lines(box: NonlinearGearbox, count: int) -> np.ndarray:
    """Take the loaded state as so many lines (n_columns, L) to start from, all but the mean zero [m]."""
    coordinates = np.linalg.lstsq(box.motion, box.deflection.motion, rcond=None)[0]
    columns = box.problem.system.W.T
    lines = np.zeros((len(columns), count), complex)
    lines[:, 0] = columns @ coordinates
    return lines


def check_balance(case: GearboxCase) -> None:
    """Refuse planets that are not equally spaced, or two, on a carrier that turns, and unlike ones that are shafts.

    CaseError: one for every such set that excites the gearbox (E-TURNING).
    """
    flow, problems = gearbox_flow(case), list[CaseError]()
    exciting = (weighed_sections(case) or exciting_sections(case)) if case.balance.harmonics else ()
    around = [
        (f"planetary[{case.planetary.index(stage)}]", set_sizes(stage).planet_angles)
        for stage in (case.planetary if exciting and case.balance.together else exciting)
        if not isinstance(stage, PairSection) and flow.carries(stage)
        if stage.carrier != CASING and flow.speed[stage.carrier]
    ]
    if any(isinstance(stage, PairSection) for stage in exciting):
        remedy = "make them equal, or leave balance out: the response has such planets"
        problems += unlike_planets(case, flow, "balance.harmonics", remedy)
        turning = [running for running in running_sets(case) if flow.speed[running.branches[0].carrier]]
        around += [("balance.harmonics", running.angles) for running in turning]
    for key, angles in around:
        try:
            planet_wave_generator(angles)
        except CaseError as error:
            error.key = key
            problems.append(error)
    for problem in problems:
        problem.file = problem.file or case.location(problem.key or "")
    if problems:
        raise several(problems)


def held_together(box: NonlinearGearbox) -> NonlinearSystem:
    """Take a gearbox with drive flanks that may pull and no back flanks, in the same columns."""
    behind = [id(back) for _, back in box.flanks if back is not None]
    kept = (element for element in box.problem.elements if id(element) not in behind)
    linear = (
        replace(element, separates=False) if isinstance(element, GearMeshes | TurningMeshes) else element
        for element in kept
    )
    return replace(box.problem, elements=tuple(linear))


def forces_of_flanks(
    box: NonlinearGearbox, solution: PeriodicSolution, place: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the forces (T, I, M) of drive flanks and back flanks of the stage at a place [N].

    At equal instants of the mesh period that excites and equal angles of its own carrier, see `StageBalance`.
    """
    stage, (front, behind) = box.stages[place], box.flanks[place]
    drive, back = list[np.ndarray](), list[np.ndarray]()
    for x, theta in _deflections(box, solution, place):
        drive.append(_forces(front, x, theta))
        back.append(np.zeros_like(drive[-1]))
        if behind is not None:
            back[-1][:, stage.back_flanks] = _forces(behind, x, theta)
    return np.array(drive), np.array(back)


def forces_of_bearings(box: NonlinearGearbox, solution: PeriodicSolution, place: int = 0) -> np.ndarray:
    """Compute the sizes (T, I, b) of the forces of bearings with play, at the instants of `forces_of_flanks` [N]."""
    rings, table = list(box.bearings.values()), list[np.ndarray]()
    for x, theta in _deflections(box, solution, place) if rings else ():
        sizes = [np.hypot(*ring.evaluate(x[:, ring.columns], theta)[0][:, 0].T) for ring in rings]
        table.append(np.stack(sizes, axis=-1))
    return np.array(table) if rings else np.zeros((1, _INSTANTS, 0))


def _deflections(
    box: NonlinearGearbox, solution: PeriodicSolution, place: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Deflections (I, n_columns) [m] and phases (I, n_bases) [rad] at one angle of the carrier after the other."""
    stage_of_place, turns = box.stages[place], np.zeros((1, len(box.frequency)))
    turning = [stage.turn_base for stage in box.stages if stage.turns]
    others = [*dict.fromkeys(turning_base for turning_base in turning if turning_base != stage_of_place.turn_base)]
    if stage_of_place.turns or others:
        angles = np.arange(_TURNS * (_ANGLES if others else 1))
        turns = np.zeros((len(angles), len(box.frequency)))
        if stage_of_place.turns:
            turns[:, stage_of_place.turn_base] = angles / _TURNS
        for number, base in enumerate(others, 1):
            turns[:, base] = angles * _STEP**number
    # instants are those of the mesh that excites
    exciting = [stage.mesh_base for stage in box.stages if solution.orders[:, stage.mesh_base].any()]
    for turn in turns:
        theta = np.tile(2.0 * np.pi * (turn % 1.0), (_INSTANTS, 1))
        theta[:, exciting or [stage_of_place.mesh_base]] = 2.0 * np.pi * np.arange(_INSTANTS)[:, None] / _INSTANTS
        yield np.real(np.exp(1j * theta @ solution.orders.T) @ solution.deflection.T), theta


def _forces(element: Element, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Forces (points, flanks) of an element whose flanks part, at deflections of all columns [N]."""
    x = x[:, element.columns]
    if isinstance(element, TurningMeshes):
        return element.forces(x, theta)
    assert isinstance(element, GearMeshes)
    return positive_part(element.flank_forces(x, theta)[1])[0]


@dataclass(frozen=True, eq=False)
class GearboxBalanceResult(StageResult):
    """Motions with flanks that part at the speed of the load case, stage by stage: ``stages``.

    ``rigid`` names the rings that modes and response have elastic, ``sensors`` those whose accelerations there are,
    ``together`` tells whether all carriers turn at once.
    """

    stages: tuple[StageBalance, ...]
    rigid: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    together: bool = False

    @property
    def converged(self) -> bool:
        """Whether the balance of every stage converged."""
        return all(stage.solution.converged for stage in self.stages)

    @property
    def residual(self) -> float:
        """Largest relative residual of all stages."""
        return max((float(stage.solution.residual) for stage in self.stages), default=math.nan)

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "; ".join(f"{stage.name}: {stage.solution.message}" for stage in self.stages)

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterator[Finding]:
        """List what the file says against itself, see `balance_warnings`."""
        return balance_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of balance.nc."""
        stages = self.stages
        drive = np.concatenate([np.moveaxis(stage.drive[0], 0, -1) for stage in stages])
        back = np.concatenate([np.moveaxis(stage.back[0], 0, -1) for stage in stages])

        def joined(values) -> np.ndarray:
            return np.concatenate([values(stage) for stage in stages])

        def of_stages(name: str) -> np.ndarray:
            return np.array([float(getattr(stage.solution, name)) for stage in stages])

        start = "over the period of the excitation, the carrier where it stood at its beginning"
        variables = {
            "stage_of_mesh": ("mesh", [stage.name for stage in stages for _ in stage.meshes], "1", "stage of the mesh"),
            "mean_force": ("mesh", joined(lambda s: (s.drive - s.back).mean(axis=(0, 1))), "N", "mean mesh force"),
            "uneven": (
                "mesh",
                joined(lambda s: s.uneven),
                "1",
                "largest over mean, of forces meant over a mesh period",
            ),
            "largest_force": ("mesh", joined(lambda s: s.drive.max(axis=(0, 1))), "N", "largest force of drive flanks"),
            "lowest_force": ("mesh", joined(lambda s: s.drive.min(axis=(0, 1))), "N", "smallest force of drive flanks"),
            "largest_back_force": (
                "mesh",
                joined(lambda s: s.back.max(axis=(0, 1))),
                "N",
                "largest force of back flanks",
            ),
            "parted_share": (
                "mesh",
                joined(lambda s: 1.0 - s.share(s.drive)),
                "1",
                "share of the time in which drive flanks are apart",
            ),
            "back_share": (
                "mesh",
                joined(lambda s: s.share(s.back)),
                "1",
                "share of the time in which back flanks touch",
            ),
            "wedged_share": (
                "mesh",
                joined(lambda s: s.share(np.minimum(s.drive, s.back))),
                "1",
                "share of the time in which both flanks touch",
            ),
            "drive_force": ("mesh instant", drive, "N", f"force of drive flanks {start}"),
            "back_force": ("mesh instant", back, "N", f"force of back flanks {start}"),
            "converged": ("stage", of_stages("converged"), "1", "1 where the harmonic balance converged, else 0"),
            "residual": ("stage", of_stages("residual"), "1", "relative residual of the equations"),
            "tail": ("stage", of_stages("tail"), "1", "share of the amplitude in the upper half of the lines"),
        }
        coords: dict[str, Any] = {
            "mesh": (("mesh",), [name for stage in stages for name in stage.meshes], "1", "gear mesh"),
            "stage": (("stage",), [stage.name for stage in stages], "1", "stage whose flanks part"),
            "instant": (("instant",), np.arange(_INSTANTS) / _INSTANTS, "1", "share of the period of the excitation"),
        }
        if stages and stages[0].bearings:
            variables |= _of_bearings(stages)
            coords["bearing"] = (("bearing",), list(stages[0].bearings), "1", "bearing with play")
        if stages and len(stages[0].acceleration):
            variables |= _at_sensors(stages)
            coords["sensor"] = (("sensor",), list(self.sensors), "1", "sensor")
            if carriers := carriers_that_turn(stages):
                coords["carrier"] = (("carrier",), carriers, "1", "stage whose carrier turns")
        attrs: dict[str, Any] = {"title": "teeth that part, by harmonic balance", "rigid": ", ".join(self.rigid)}
        attrs["together"] = int(self.together)
        return Contents(variables, coords, attrs)


def _at_sensors(stages: tuple[StageBalance, ...]) -> dict[str, Any]:
    """Lines at the sensors, one stage after the other, and their levels; frequencies are positive."""
    lines = np.concatenate([stage.acceleration for stage in stages], axis=1)
    level = [np.sqrt(0.5 * (np.abs(stage.acceleration) ** 2).sum(axis=1)) for stage in stages]
    harmonic = np.concatenate([stage.harmonic for stage in stages])
    omega = np.concatenate([stage.solution.line_frequency[: len(stage.harmonic)] for stage in stages])
    sense = np.where(omega < 0.0, -1.0, 1.0)
    origin = [stage.name for stage in stages for _ in stage.harmonic]
    variables = {
        "level_of_stage": ("sensor stage", np.transpose(level), "m/s^2", "root mean square of the acceleration"),
        "lines_real": ("sensor line", np.real(lines), "m/s^2", "acceleration, amplitude of the line"),
        "lines_imag": ("sensor line", sense * np.imag(lines), "m/s^2", "acceleration, amplitude of the line"),
        "line_frequency": ("line", np.abs(omega) / (2.0 * np.pi), "Hz", "frequency of the line"),
        "origin": ("line", origin, "1", "stage that excites"),
        "harmonic": ("line", sense * harmonic, "1", "multiple of the mesh frequency"),
    }
    if carriers := carriers_that_turn(stages):
        none = {stage.name: np.zeros(len(stage.harmonic)) for stage in stages}
        turns = [np.concatenate([stage.turns.get(name, none[stage.name]) for stage in stages]) for name in carriers]
        variables["turns"] = ("line carrier", (sense * turns).T, "1", "turns of the carrier of a stage in the line")
    return variables


def carriers_that_turn(stages: tuple[StageBalance, ...]) -> list[str]:
    """Name the stages whose carriers turn while any of the stages excites."""
    return list(dict.fromkeys(name for stage in stages if len(stage.harmonic) for name in stage.turns))


def _of_bearings(stages: tuple[StageBalance, ...]) -> dict[str, Any]:
    """Variables of the bearings with play, while each of the stages excites."""
    force = [stage.bearing_force.reshape(-1, len(stage.bearings)) for stage in stages]
    values = {
        "bearing_mean": ("N", "mean size of the force", [of_case.mean(axis=0) for of_case in force]),
        "bearing_largest": ("N", "largest size of the force", [of_case.max(axis=0) for of_case in force]),
        "bearing_lowest": ("N", "smallest size of the force", [of_case.min(axis=0) for of_case in force]),
        "bearing_loose": ("1", "share of the time in its play", [(of_case == 0.0).mean(axis=0) for of_case in force]),
    }
    return {name: ("stage bearing", np.array(table), unit, words) for name, (unit, words, table) in values.items()}


def balance_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what balance.nc says against itself."""
    for number, name in enumerate(data["stage"].values.tolist()):
        if not data["converged"].values[number]:
            residual = float(data["residual"].values[number])
            text = f"the harmonic balance of {name} did not converge: relative residual {residual:.2g}"
            yield Finding("W-BALANCE", "balance.harmonics", text, remedy="take fewer harmonics, or more damping")
        tail = float(data["tail"].values[number])
        if tail > _TAIL:
            text = f"{tail:.2g} of the amplitude of {name} is in the upper half of the lines"
            yield Finding("W-TAIL", "balance.harmonics", text, remedy="take more harmonics")
    if data.attrs["rigid"]:
        text = (
            f"{data.attrs['rigid']}: elastic in modes and response, rigid where teeth part: sensors on it are left out"
        )
        yield Finding("W-RIGID", "balance.harmonics", text, remedy="compare forces of the response before teeth part")
    for name, code, words in (
        ("parted_share", "W-SEPARATION", "part for"),
        ("wedged_share", "W-WEDGED", "are loaded on both flanks for"),
    ):
        share = data[name].values
        if share.max(initial=0.0) > 0.0:
            mesh = data["mesh"].values[int(share.argmax())]
            count = f"{int((share > 0.0).sum())} of {len(share)} meshes"
            text = f"{count} {words} a part of the time, {mesh} for {percent(share.max(), 1)}"
            yield Finding(code, "operation.load_case", text)


def describe_balance(data: xr.Dataset) -> Block:
    """Tabulate forces and contact of all meshes."""
    columns = {
        "mesh": lambda i: str(data["mesh"].values[i]),
        "mean force [N]": lambda i: f"{float(data['mean_force'].values[i]):.5g}",
        "uneven": lambda i: f"{float(data['uneven'].values[i]):.4f}",
        "largest [N]": lambda i: f"{float(data['largest_force'].values[i]):.5g}",
        "smallest [N]": lambda i: f"{float(data['lowest_force'].values[i]):.5g}",
        "back flank [N]": lambda i: f"{float(data['largest_back_force'].values[i]):.5g}",
        "apart": lambda i: percent(float(data["parted_share"].values[i]), 1),
        "on the back": lambda i: percent(float(data["back_share"].values[i]), 1),
    }
    others = "all carriers turning" if data.attrs["together"] else "the meshes of the others as springs"
    note = f"each stage with {others}; uneven: largest over mean of the mean mesh force"
    notes = [note, *(loose_notes(data) if "bearing" in data.sizes else ())]
    if "sensor" in data.sizes:
        level = np.sqrt((data["level_of_stage"].values ** 2).sum(axis=1))
        notes += [f"sensor {name}: {value:.4g} m/s^2" for name, value in zip(data["sensor"].values, level, strict=True)]
    return tabulate("Teeth that part, harmonic balance", range(data.sizes["mesh"]), columns, tuple(notes))


def balance_tables(data: xr.Dataset) -> Iterator[Block]:
    """Tabulate the largest lines of every sensor that each stage makes, and what stands still, with their origin."""
    if "sensor" not in data.sizes:
        return
    size, hertz = np.hypot(data["lines_real"].values, data["lines_imag"].values), data["line_frequency"].values
    makers = np.where(data["harmonic"].values == 0.0, "", data["origin"].values)
    for sensor, lines in zip(data["sensor"].values, size, strict=True):
        ordered = np.argsort(-lines, kind="stable")
        shown = [ordered[makers[ordered] == maker][:_BY_STAGE] for maker in dict.fromkeys(makers)]
        chosen = [i for i in ordered.tolist() if i in np.concatenate(shown) and lines[i] > _SHOWN * lines.max()]
        columns = {
            "frequency [Hz]": lambda i: f"{hertz[i]:.2f}",
            "amplitude [m/s^2]": lambda i, lines=lines: f"{lines[i]:.4g}",
            "origin": lambda i: balance_line_origin(data, i),
        }
        yield tabulate(f"Largest lines at {sensor} while teeth part", chosen, columns)


def balance_line_origin(data: xr.Dataset, line: int) -> str:
    """Write where a line comes from: stage and mesh harmonic, or what stands still, and turns of carriers beside it."""
    harmonic, words = float(data["harmonic"].values[line]), []
    words.append(f"{data['origin'].values[line]}, mesh harmonic {harmonic:g}" if harmonic else "weight, torque:")
    if "turns" in data:
        turns = zip(data["carrier"].values, data["turns"].values[line], strict=True)
        form = ", side band {:+g} of {}" if harmonic else " {:g} x carrier of {}"
        words += [form.format(turn, name) for name, turn in turns if turn]
    return "".join(words)
