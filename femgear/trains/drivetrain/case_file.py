"""The case file with ``model = "drivetrain"``: its chain, operation and simulation, and what it refuses.

A torque series in a CSV file that the case names is read once and kept inside the case.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictBool

from femgear.case import text as case_text
from femgear.case.csv_columns import CsvColumns, embed_points, embed_profiles, embedded, read_columns
from femgear.case.gear_set import line_play, planetary_set, set_deviations
from femgear.case.messages import no_such
from femgear.case.quantities import (
    ACCELERATION,
    ANGLE,
    FREQUENCY,
    LENGTH,
    TIME,
    TORQUE,
    Count,
    Number,
    Quantity,
    Section,
    Title,
    Values,
)
from femgear.case.sections import FORMAT, DampingRatio, Speed
from femgear.case.teeth import GearCase
from femgear.case.text import CaseFile, ReadCase
from femgear.errors import CaseError, FemgearError
from femgear.findings import DOUBT, Finding
from femgear.gears.deviations import common_period
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    ParallelSection,
    PlanetarySection,
    ShaftSection,
    TorqueHistory,
)
from femgear.trains.reading import parse_case

FASTEST_RATE = 1e7
_MOST_PARTS = 200
_MOST_POINTS = 20_000
_POINTS = Values(min_length=1, max_length=_MOST_POINTS)
_LARGEST_TORQUE, _LATEST = 1e9, 1e6

# Ratios of radii and teeth that differ by more belong to no gears; rounded radii explain the rest.
_RATIO_TOLERANCE = 0.01
# Angles and radii of a stage and of the pair that gives its stiffness, of digits as printed.
_UNLIKE = 1e-3
# Ratios of radii and teeth that differ by more are worth a remark.
_REMARK = 1e-4
# Teeth of a planet that profile shifts may add or take.
_SHIFTED = 2
# Largest working pressure angle that is plausible.
_STEEPEST = math.radians(45.0)
# Entries that give the sizes of the gears of a stage, each way whole, and the same in words.
_WAYS = {
    "parallel": ((("radii",), ("base_radii",), ("module",)), "radii, base_radii or module"),
    "planetary": (
        (("sun_radius", "planet_radius"), ("sun_base_radius", "planet_base_radius"), ("module",)),
        "sun_radius and planet_radius, sun_base_radius and planet_base_radius, or module",
    ),
}

_MOST_STEPS = 1e8
_MOST_VALUES = 2.5e8
_MOST_COORDINATES = 1500
_MESHES = ("mesh", "sun_mesh", "ring_mesh")

_DIMENSIONS = {"time": TIME, "torque": TORQUE}
_LIMITS = {"time": (0.0, _LATEST), "torque": (-_LARGEST_TORQUE, _LARGEST_TORQUE)}
_COLUMNS = "the first line names two columns: time [s] and torque [N m] (or other units)"
# Times and torques are written into the case with so many digits.
_DIGITS = ".13g"

_Torque = Annotated[float, Quantity(TORQUE, -_LARGEST_TORQUE, _LARGEST_TORQUE)]
_Time = Annotated[float, Quantity(TIME, 0.0, _LATEST)]


class DrivetrainGravitySection(Section):
    """Weight of all bodies along -y."""

    acceleration: Annotated[float, Quantity(ACCELERATION, 0.0, 1e3)] = 9.80665


class TorqueSection(Section):
    """Torque on a body: constant, a series, or a share of what balances the others."""

    body: str
    torque: _Torque | None = None
    file: Title | None = None
    times: Annotated[tuple[_Time, ...], _POINTS] | None = None
    torques: Annotated[tuple[_Torque, ...], _POINTS] | None = None
    share: Annotated[float, Number(0.0, 10.0)] | None = None


class DrivetrainOperationSection(Section):
    """Speed of the first body at the start, and the torques."""

    speed: Speed
    torque: Annotated[tuple[TorqueSection, ...], Field(max_length=_MOST_PARTS)] = ()


class SimulationSection(Section):
    """Integration in time, what is kept of it, and its spectra."""

    duration: Annotated[float, Quantity(TIME, 1e-3, 1e5)]
    rate: Annotated[float, Quantity(FREQUENCY, 10.0, FASTEST_RATE)] = 20_000.0
    record: Annotated[float, Quantity(FREQUENCY, 1.0, FASTEST_RATE)] | None = None
    start: Literal["static", "zero"] = "static"
    harmonics: Annotated[int, Count(1, 200)] = 15
    damping_ratio: DampingRatio = 0.0
    turning: StrictBool = True
    torsional: StrictBool = False
    contact_loss: StrictBool = False
    modes: Annotated[int, Count(0, 24)] = 4
    settle: _Time | None = None
    resolution: Annotated[float, Quantity(FREQUENCY, 1e-3, 1e7)] | None = None


class DrivetrainCase(Section, ReadCase):
    """A chain of bodies, its operation and how to integrate it, in SI units.

    The fields carry the names of the case file; ``source`` is the text that gives this case, ``notices`` what
    deserves to be said.
    """

    format: Annotated[int, Count(1, FORMAT)] = FORMAT
    train: ClassVar[str] = "drivetrain"
    model: Literal["drivetrain"]
    title: Title
    body: Annotated[tuple[BodySection, ...], Field(min_length=1, max_length=_MOST_PARTS)]
    shaft: Annotated[tuple[ShaftSection, ...], Field(max_length=_MOST_PARTS)] = ()
    parallel: Annotated[tuple[ParallelSection, ...], Field(max_length=_MOST_PARTS)] = ()
    planetary: Annotated[tuple[PlanetarySection, ...], Field(max_length=20)] = ()
    bearing: Annotated[tuple[BearingSection, ...], Field(max_length=_MOST_PARTS)] = ()
    gravity: DrivetrainGravitySection | None = None
    operation: DrivetrainOperationSection
    simulation: SimulationSection


def drivetrain_of(case: DrivetrainCase) -> Drivetrain:
    """Make the chain of a case."""
    gravity = 0.0 if case.gravity is None else case.gravity.acceleration
    parts = case.body, case.shaft, case.parallel, case.planetary, case.bearing
    return Drivetrain(*parts, gravity, case.simulation.damping_ratio)


def torque_histories(case: DrivetrainCase, ratio: Mapping[str, float]) -> tuple[TorqueHistory, ...]:
    """Make the torques of a case over time [N m]; a share balances the others over the speed ratios.

    ``ratio`` holds the speeds of the bodies over that of the first one.
    """
    histories = [
        TorqueHistory(torque.body, np.array(torque.times or [0.0]), np.array(torque.torques or [torque.torque]))
        for torque in case.operation.torque
        if torque.share is None
    ]
    for torque in case.operation.torque:
        if torque.share is not None:
            times = np.unique(np.concatenate([history.times for history in histories]))
            power = np.sum([ratio[history.body] * history.at(times) for history in histories], axis=0)
            histories.append(TorqueHistory(torque.body, times, -torque.share * power / ratio[torque.body]))
    return tuple(histories)


def settle_time(case: DrivetrainCase) -> float:
    """Choose the start that the spectra leave out [s]: as given, or three tenths of the run."""
    s = case.simulation
    return 0.3 * s.duration if s.settle is None else s.settle


def check_entries_together(case: DrivetrainCase) -> list[CaseError]:
    """Refuse what no entry shows alone."""
    names = list(_names(case))
    checks = (_bodies, _bearings, _shafts, _sizes, _meshes, _torques, _simulation, _coordinates)
    problems = [*names, *(problem for check in checks for problem in check(case))]
    return problems if names else [*problems, *_chain(case)]


def _joints(case: DrivetrainCase) -> list[tuple[str, ...]]:
    """Key, and the two bodies, of every shaft and gear stage."""
    joints = [(f"shaft[{i}].between", *shaft.between) for i, shaft in enumerate(case.shaft)]
    joints += [(f"parallel[{i}].between", *stage.between) for i, stage in enumerate(case.parallel)]
    return joints + [(f"planetary[{i}].sun", stage.carrier, stage.sun) for i, stage in enumerate(case.planetary)]


def _names(case: DrivetrainCase) -> Iterator[CaseError]:
    names = [body.name for body in case.body]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield CaseError(
                "two bodies have one name",
                code="E-DUPLICATE",
                key=f"body[{i}].name",
                value=name,
                remedy="give every body a name of its own",
            )
    used = [(key, name) for key, *ends in _joints(case) if ".between" in key for name in ends]
    for i, stage in enumerate(case.planetary):
        used += [(f"planetary[{i}].carrier", stage.carrier), (f"planetary[{i}].sun", stage.sun)]
    used += [(f"bearing[{i}].body", bearing.body) for i, bearing in enumerate(case.bearing) if bearing.body is not None]
    used += [(f"operation.torque[{i}].body", torque.body) for i, torque in enumerate(case.operation.torque)]
    for key, name in used:
        if name not in names:
            yield no_such("body", key, name, names, "name a body of a [[body]] table", limit=", ".join(names[:20]))
    for key, first, second in _joints(case):
        if first == second:
            yield CaseError("a body is joined to itself", code="E-CHOICE", key=key, value=first, limit="two bodies")


def _chain(case: DrivetrainCase) -> Iterator[CaseError]:
    """Everything hangs together, and shafts alone close no loop."""
    groups = {body.name: {body.name} for body in case.body}
    for key, first, second in _joints(case):
        if groups[first] is groups[second]:
            if key.startswith("shaft"):
                yield CaseError(
                    f"the shaft closes a loop: {first} and {second} are joined already",
                    code="E-DRIVETRAIN",
                    key=key,
                    limit="one way by shafts from body to body",
                    remedy="leave one of the shafts out",
                )
            continue
        groups[first] |= groups[second]
        groups |= dict.fromkeys(groups[second], groups[first])
    start = case.body[0].name
    apart = [(i, body.name) for i, body in enumerate(case.body) if body.name not in groups[start]]
    if apart:
        i, name = apart[0]
        yield CaseError(
            f"nothing joins {', '.join(name for _, name in apart)} to {start}",
            code="E-DRIVETRAIN",
            key=f"body[{i}].name",
            value=name,
            remedy="add a [[shaft]], a [[parallel]] or a [[planetary]]",
        )


def _bodies(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, body in enumerate(case.body):
        if body.tilts and body.transverse_inertia == 0.0:
            yield CaseError(
                "a body that tilts needs an inertia about a diameter",
                code="E-KEY-MISSING",
                key=f"body[{i}].transverse_inertia",
                remedy="give it (a flat disc has half its inertia about the axis), or tilts = false",
            )


def _bearings(case: DrivetrainCase) -> Iterator[CaseError]:
    elements = {shaft.between: shaft.elements for shaft in case.shaft}
    for i, bearing in enumerate(case.bearing):
        inside = (bearing.shaft is not None, bearing.station is not None)
        if inside != (bearing.body is None,) * 2:
            yield CaseError(
                "a bearing sits on one body, or on one station inside a shaft",
                code="E-CHOICE",
                key=f"bearing[{i}].{'body' if bearing.body else 'shaft'}",
                limit="body, or shaft with station",
            )
        elif bearing.shaft and bearing.station and not bearing.station < elements.get(bearing.shaft, 0):
            stations = elements.get(bearing.shaft, 0) - 1
            yield CaseError(
                "there is no such station",
                code="E-CHOICE",
                key=f"bearing[{i}].station",
                value=bearing.station,
                limit=f"1 to {stations}" if stations > 0 else "a [[shaft]] with this between and 2 elements or more",
            )
        if bearing.radial == bearing.tilt == 0.0:
            yield CaseError(
                "a bearing without stiffness",
                code="E-RANGE",
                key=f"bearing[{i}].radial",
                value="0 N/m",
                limit="one of radial and tilt above 0",
                remedy="give it, or leave the [[bearing]] out",
            )
        if math.isinf(bearing.radial) and bearing.offset:
            yield CaseError(
                "a rigid bearing beside the centre of its body",
                code="E-CHOICE",
                key=f"bearing[{i}].offset",
                value=LENGTH.show(bearing.offset),
                limit="0 mm where radial is rigid",
                remedy="give a finite stiffness",
            )


def _shafts(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, shaft in enumerate(case.shaft):
        springs = shaft.given("bending", "torsion", "shear")
        if message := _shaft_problem(shaft, springs):
            yield CaseError(
                message,
                code="E-CHOICE",
                key=f"shaft[{i}].{springs[0] if springs else 'outer_diameter'}",
                limit="bending and torsion, or outer_diameter with what else the section needs",
            )
        if shaft.outer_diameter is not None and not shaft.inner_diameter < shaft.outer_diameter:
            yield CaseError(
                "the bore is as large as the shaft",
                code="E-RANGE",
                key=f"shaft[{i}].inner_diameter",
                value=LENGTH.show(shaft.inner_diameter),
                limit=f"below {LENGTH.show(shaft.outer_diameter)}",
            )
        if shaft.torsion is not None and math.isinf(shaft.torsion):
            yield CaseError(
                "a shaft that is rigid in torsion makes one body of two",
                code="E-CHOICE",
                key=f"shaft[{i}].torsion",
                value="rigid",
                limit="a finite spring",
                remedy="give a spring, or one body with the inertia of both",
            )
        if shaft.elements > 1 and shaft.density == 0.0:
            yield CaseError(
                "stations inside a shaft without mass",
                code="E-RANGE",
                key=f"shaft[{i}].density",
                value="0 kg/m^3",
                limit="above 0 kg/m^3 with 2 elements or more",
                remedy="give its density, or elements = 0",
            )


def _shaft_problem(shaft: ShaftSection, springs: list[str]) -> str:
    if shaft.outer_diameter is None:
        if not {"bending", "torsion"} <= set(springs):
            return "the shaft has neither a section nor both springs"
        return "elements need a section" if shaft.elements else ""
    return f"the shaft has a section and {' and '.join(springs)}" if springs else ""


def _torques(case: DrivetrainCase) -> Iterator[CaseError]:
    shares, bodies = [], []
    for i, torque in enumerate(case.operation.torque):
        key = f"operation.torque[{i}]"
        series = len(torque.given("times", "torques"))
        given = torque.given("torque", "file", "share") + ["times"] * bool(series)
        if len(given) != 1 or series == 1:
            yield CaseError(
                "the torque on a body is given in one way",
                code="E-CHOICE",
                key=f"{key}.{given[0] if given else 'torque'}",
                limit="torque, file, times with torques, or share",
            )
        elif torque.times is not None and torque.torques is not None:
            if len(torque.times) != len(torque.torques) or any(b <= a for a, b in pairwise(torque.times)):
                yield CaseError(
                    "the series needs ascending times, and as many torques",
                    code="E-TORQUE",
                    key=f"{key}.times",
                    value=f"{len(torque.times)} times, {len(torque.torques)} torques",
                    remedy="sort the points by time, and keep one of every instant",
                )
        if torque.body in bodies:
            yield CaseError(
                "a second torque on one body",
                code="E-DUPLICATE",
                key=f"{key}.body",
                value=torque.body,
                remedy="add the torques up in one table",
            )
        bodies.append(torque.body)
        shares += [key] if torque.share is not None else []
    if len(shares) > 1 or (shares and len(bodies) == 1):
        yield CaseError(
            "a share needs other torques that it balances, none of them a share",
            code="E-TORQUE",
            key=f"{shares[-1]}.share",
            limit="one share, beside torques that are given",
        )


def _simulation(case: DrivetrainCase) -> Iterator[CaseError]:
    s = case.simulation
    steps = s.duration * s.rate
    if steps > _MOST_STEPS:
        yield CaseError(
            f"{steps:.3g} steps are too many",
            code="E-RANGE",
            key="simulation.duration",
            value=TIME.show(s.duration),
            limit=f"{_MOST_STEPS:g} steps: {TIME.show(_MOST_STEPS / s.rate)}",
            remedy="take a shorter duration or a lower simulation.rate",
        )
    if s.settle is not None and not s.settle < s.duration:
        yield CaseError(
            "the spectra would leave out the whole run",
            code="E-RANGE",
            key="simulation.settle",
            value=TIME.show(s.settle),
            limit=f"below {TIME.show(s.duration)} (simulation.duration)",
        )
    elif s.record is not None:
        yield from record_problems(case, s.record)


def record_problems(case: DrivetrainCase, record: float) -> Iterator[CaseError]:
    """Refuse what so many records a second [Hz], as given or chosen for the run, cannot hold."""
    s, ratio = case.simulation, case.simulation.rate / record
    if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        yield CaseError(
            "a record is kept after a whole number of steps",
            code="E-RANGE",
            key="simulation.record",
            value=FREQUENCY.show(record),
            limit=f"{FREQUENCY.show(s.rate)} (simulation.rate) over a whole number",
            remedy=f"take {FREQUENCY.show(s.rate / max(1, round(ratio)))}",
        )
    # motion, velocity and torque of a body, a force and an approach of a mesh
    meshes = len(case.parallel) + sum(2 * len(stage.angles) for stage in case.planetary)
    size = s.duration * record * (2 * len(case.body) + 2 * meshes + 2)
    if size > _MOST_VALUES:
        yield CaseError(
            f"{size:.3g} kept numbers are too many",
            code="E-RANGE",
            key="simulation.record",
            value=FREQUENCY.show(record),
            limit=f"{_MOST_VALUES:g} numbers",
            remedy=f"take {FREQUENCY.show(record * _MOST_VALUES / size)} or less, or a shorter duration",
        )


def _coordinates(case: DrivetrainCase) -> Iterator[CaseError]:
    """The matrices are dense."""
    stations = [max(shaft.elements - 1, 0) for shaft in case.shaft]
    planets = sum(len(stage.angles) for stage in case.planetary)
    count = 5 * len(case.body) + 5 * sum(stations) + 3 * planets
    if count > _MOST_COORDINATES:
        longest = stations.index(max(stations)) if any(stations) else None
        yield CaseError(
            f"{count} coordinates are too many",
            code="E-RANGE",
            key="body" if longest is None else f"shaft[{longest}].elements",
            limit=f"{_MOST_COORDINATES}: 5 a body and a station inside a shaft, 3 a planet",
            remedy="take fewer elements",
        )


def _sizes(case: DrivetrainCase) -> Iterator[CaseError]:
    """Radii against teeth, and whether planets assemble beside one another."""
    for i, stage in enumerate(case.parallel):
        yield from _gear_sizes(stage, "parallel", f"parallel[{i}]")
    for i, stage in enumerate(case.planetary):
        key = f"planetary[{i}]"
        yield from _gear_sizes(stage, "planetary", key)
        if not stage.sun_teeth < stage.ring_teeth:
            yield CaseError(
                "the ring has no more teeth than the sun",
                code="E-TEETH",
                key=f"{key}.ring_teeth",
                value=stage.ring_teeth,
                limit=f"more than {stage.sun_teeth}",
            )
        yield from _assembly(stage, key)


def _meshes(case: DrivetrainCase) -> Iterator[CaseError]:
    """Parallel stages with a mesh, or with the teeth of a pair that are theirs."""
    for i, stage in enumerate(case.parallel):
        key = f"parallel[{i}]"
        if stage.mesh is None and stage.stiffness is None:
            remedy = 'add it, or stiffness = "pair.toml", the case file of a pair'
            yield CaseError("missing", code="E-KEY-MISSING", key=f"{key}.mesh", remedy=remedy)
        elif stage.mesh is not None and stage.stiffness is not None:
            yield CaseError(
                "the stiffness of the mesh is given twice",
                code="E-CHOICE",
                key=f"{key}.stiffness",
                limit="mesh, or stiffness with the case file of a pair",
                remedy="leave one of them out",
            )
        elif stage.stiffness is not None:
            try:
                pair = pair_case_of(case_text.write(stage.stiffness))
                problems = [*_unlike(pair, stage, key), *_unfit(pair, case.simulation.harmonics)]
            except FemgearError as error:
                problems = [
                    CaseError(problem.message, **_told(problem)) for problem in getattr(error, "problems", (error,))
                ]
            for problem in problems:
                if not (problem.key or "").startswith(key):
                    problem.key = f"{key}.stiffness.{problem.key}"
                yield problem


@lru_cache(maxsize=8)
def pair_case_of(text: str) -> Any:
    """Read the case of a pair from the text of its file.

    CaseError: as `femgear.trains.reading.parse_case`; another kind of case (E-CHOICE).
    """
    pair = parse_case(text, numbered=False)
    if pair.train != "pair":
        value = f"a case of the train {pair.train}"
        raise CaseError("not a case of two gears", code="E-CHOICE", key="model", value=value, limit="'pair'")
    return pair


def _told(error: FemgearError) -> dict[str, Any]:
    return {name: getattr(error, name) for name in ("code", "key", "value", "limit", "remedy")}


def _unlike(pair: GearCase, stage: ParallelSection, key: str) -> Iterator[CaseError]:
    """Entries of a stage that are not those of its pair: teeth, helix, pressure angle, base circles."""
    gears, helix = planetary_set(pair), abs(pair.helix_angle or 0.0)
    if gears.gear_2.internal:
        words = "the gears of a parallel stage are external"
        yield CaseError(words, code="E-CHOICE", key="gear_2.outer_radius", remedy="leave it out")
    angle = stage.pressure_angle
    nearest = min(
        gears.gear_1.pressure_angle, gears.working_pressure_angle, key=lambda candidate: abs(candidate - angle)
    )
    radii = [math.cos(angle) * radius for radius in stage.pitch_radii], [g.base_radius for g in gears.gears]
    teeth = list(stage.teeth), [gear.teeth for gear in gears.gears]
    words = tuple(f"base radii {' and '.join(map(LENGTH.show, radius))}" for radius in radii)
    size = next(iter(stage.given("radii", "base_radii", "module")), "module")
    for name, value, wanted, shown in (
        ("teeth", *teeth, tuple(map(str, teeth))),
        ("helix_angle", abs(stage.helix_angle), helix, tuple(map(ANGLE.show, (stage.helix_angle, helix)))),
        ("pressure_angle", angle, nearest, tuple(map(ANGLE.show, (angle, nearest)))),
        (size, radii[0] or radii[1], radii[1], words),
    ):
        if not np.allclose(value, wanted, rtol=_UNLIKE, atol=0.0):
            limit = f"{shown[1]}, transverse module {LENGTH.show(gears.gear_1.module)}"
            yield CaseError(
                "the stage has not the gears of the pair that gives its stiffness",
                code="E-TEETH",
                key=f"{key}.{name}",
                value=shown[0],
                limit=limit if name == size else shown[1],
                remedy="give the stage the gears of the pair, or name the case file of its own",
            )


def _unfit(pair: Any, harmonics: int) -> Iterator[CaseError]:
    """What leaves no stiffness over one mesh period: no torque, errors of several periods, few positions."""
    if not pair.operation.torque:
        yield CaseError(
            "without torque no flanks touch",
            code="E-RANGE",
            key="operation.torque",
            value="0 N m",
            remedy="give the torque that the stage carries",
        )
    periods, _ = common_period(set_deviations(pair), planetary_set(pair), limit=sys.maxsize)
    if periods > 1:
        yield CaseError(
            f"the errors of the pair span {periods} mesh periods",
            code="E-RANGE",
            key="gear_1.errors",
            limit="one mesh period",
            remedy="leave pitch errors and runout out",
        )
    if pair.static.positions <= 2 * harmonics:
        yield CaseError(
            f"so few positions hold no {harmonics} harmonics",
            code="E-RANGE",
            key="static.positions",
            value=pair.static.positions,
            limit=f"more than {2 * harmonics}",
            remedy="take more of them, or fewer simulation.harmonics",
        )


def _gear_sizes(stage: ParallelSection | PlanetarySection, kind: str, key: str) -> Iterator[CaseError]:
    """One way of giving the sizes of the gears, and teeth that fit it."""
    ways, words = _WAYS[kind]
    given = [name for way in ways for name in stage.given(*way)]
    if tuple(given) not in ways:
        yield CaseError(
            "the sizes of the gears are needed once",
            code="E-CHOICE",
            key=f"{key}.{given[0] if given else ways[0][0]}",
            limit=words,
        )
        return
    for name, radii, teeth in _ratios(stage):
        if abs(teeth / radii - 1.0) > _RATIO_TOLERANCE:
            yield CaseError(
                f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}",
                code="E-TEETH",
                key=f"{key}.{name}",
                limit=f"ratios within {_RATIO_TOLERANCE:.0%} of one another",
                remedy="correct the teeth or the radii, or give module in place of the radii",
            )
    if isinstance(stage, PlanetarySection):
        yield from _planet_teeth(stage, key)


def _planet_teeth(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    """Teeth of a planet that is one, and axes at which it meshes with sun and ring."""
    between, least = 0.5 * (stage.ring_teeth - stage.sun_teeth), math.cos(_STEEPEST)
    if stage.planet_teeth is None and stage.module is not None and between % 1.0:
        yield CaseError(
            f"no planet has {between:g} teeth",
            code="E-KEY-MISSING",
            key=f"{key}.planet_teeth",
            limit=f"a whole number near {between:g}",
            remedy=f"give planet_teeth (say {math.floor(between)}), and centre_distance of the shifted gears",
        )
        return
    if stage.planet_teeth is not None and abs(stage.planet_teeth - between) > _SHIFTED:
        yield CaseError(
            "the planet has other teeth than fit between sun and ring",
            code="E-TEETH",
            key=f"{key}.planet_teeth",
            value=stage.planet_teeth,
            limit=f"{between:g}, or up to {_SHIFTED} more or less with profile shift",
        )
    elif stage.centre_distance is not None and stage.sun_radius is not None:
        yield CaseError(
            "pitch radii give the centre distance already",
            code="E-CHOICE",
            key=f"{key}.centre_distance",
            limit="module or base radii beside it",
            remedy="leave it out",
        )
    elif not all(least <= share <= 1.0 + _REMARK**2 for share in stage.base_shares):
        sun, planet, ring = stage.base_radii
        low, high = max(sun + planet, ring - planet), min(sun + planet, ring - planet) / least
        near = f"{LENGTH.show(low)} to {LENGTH.show(high)}" if low < high else "gears that mesh at one"
        yield CaseError(
            "at this distance of the axes sun, planet and ring do not mesh",
            code="E-CENTRE-DISTANCE",
            key=f"{key}.{'centre_distance' if stage.sun_radius is None else 'sun_radius'}",
            value=LENGTH.show(stage.axis_distance),
            limit=near,
            remedy="give the centre distance of the gears, or correct teeth and sizes",
        )


def _ratios(stage: ParallelSection | PlanetarySection) -> list[tuple[str, float, float]]:
    """Entry, ratio of the radii and ratio of the teeth, where radii are given."""
    if stage.module is not None:
        return []
    if isinstance(stage, ParallelSection):
        first, second = stage.radii or stage.base_radii or (0.0, 0.0)
        return [("teeth", second / first, stage.teeth[1] / stage.teeth[0])]
    sun, planet = stage.sun_radius, stage.planet_radius
    if sun is None or planet is None:
        sun, planet = stage.sun_base_radius or 0.0, stage.planet_base_radius or 0.0
    if stage.planet_teeth is not None:
        return [("planet_teeth", planet / sun, stage.planet_teeth / stage.sun_teeth)]
    return [("ring_teeth", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)]


def _assembly(stage: PlanetarySection, key: str) -> Iterator[CaseError]:
    """Planets at ascending angles, in mesh with sun and ring, whose pitch circles do not overlap."""
    both, angles, equal = stage.ring_teeth + stage.sun_teeth, stage.angles, stage.planet_angles is None
    key = f"{key}.{'planets' if equal else 'planet_angles'}"
    if any(b <= a for a, b in pairwise(angles)) or angles[-1] - angles[0] >= 2.0 * math.pi - 1e-9:
        yield CaseError(
            "the planet angles do not ascend within one turn",
            code="E-RANGE",
            key=key,
            limit="ascending angles, the last less than 360 deg after the first",
        )
    # sizes by the teeth
    share = (stage.ring_teeth - stage.sun_teeth) / both
    apart = min(b - a for a, b in pairwise((*angles, angles[0] + 2.0 * math.pi)))
    if share > 0.0 and math.sin(0.5 * min(apart, math.pi)) <= share:
        yield CaseError(
            "neighbouring planets overlap",
            code="E-NEIGHBOURS",
            key=key,
            value=f"{math.degrees(apart):.4g} deg from one to the next",
            limit=f"more than {math.degrees(2.0 * math.asin(share)):.4g} deg",
            remedy="take fewer planets, or smaller ones",
        )
    steps = [(angle - angles[0]) * both / (2.0 * math.pi) for angle in angles]
    if any(abs(step - round(step)) > 1e-3 for step in steps):
        yield CaseError(
            f"{len(angles)} equally spaced planets do not assemble"
            if equal
            else "the planets do not assemble at these angles",
            code="E-ASSEMBLY",
            key=key,
            value=stage.planets if equal else None,
            limit=f"a divisor of ring_teeth + sun_teeth = {both}"
            if equal
            else f"whole multiples of 360 deg / {both} from one another",
        )


def drivetrain_notices(case: DrivetrainCase) -> Iterator[Finding]:
    """Remark what deserves a look in a case that was checked: teeth, bearings and backlash."""
    stages = [(f"parallel[{i}]", stage) for i, stage in enumerate(case.parallel)]
    stages += [(f"planetary[{i}]", stage) for i, stage in enumerate(case.planetary)]
    for key, stage in stages:
        yield from _teeth_notices(stage, key)
    if not case.bearing:
        yield Finding("W-BEARING", "", "there is no [[bearing]]")
    if not case.simulation.contact_loss:
        return
    if not stages:
        yield Finding("W-BACKLASH", "simulation.contact_loss", "there are no meshes that could part")
    meshes = [(f"{key}.{name}", getattr(stage, name, None)) for key, stage in stages for name in _MESHES]
    bare = [key for key, mesh in meshes if mesh is not None and mesh.backlash is None]
    pairs = [(i, stage.stiffness) for i, stage in enumerate(case.parallel) if stage.stiffness is not None]
    bare += [
        f"parallel[{i}].stiffness" for i, section in pairs if not line_play(pair_case_of(case_text.write(section)))
    ]
    if bare:
        yield Finding(
            "W-BACKLASH",
            ", ".join(bare),
            "without backlash given there is no back side: with "
            "simulation.contact_loss these teeth part and meet no back flank",
        )


def _teeth_notices(stage: ParallelSection | PlanetarySection, key: str) -> Iterator[Finding]:
    """Remark what of teeth and radii decides where they differ, and a distance of axes that nobody gave."""
    all_teeth = isinstance(stage, PlanetarySection) and stage.planet_teeth is not None
    for name, radii, teeth in _ratios(stage):
        if abs(teeth / radii - 1.0) > _REMARK:
            decides = (
                "the teeth decide, and the radii give the distance of the axes alone"
                if all_teeth
                else "speeds follow the radii, mesh frequencies the teeth of the first gear or of the ring"
            )
            text = f"the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}; {decides}"
            yield Finding("W-TEETH", f"{key}.{name}", text)
    if isinstance(stage, PlanetarySection) and stage.centre_distance is None and stage.sun_radius is None:
        sun, ring = stage.base_shares
        if abs(sun / ring - 1.0) > _REMARK:
            angles = " and ".join(f"{math.degrees(angle):.4g}" for angle in stage.working_angles)
            yield Finding(
                "W-TEETH",
                f"{key}.centre_distance",
                f"a planet of {stage.planet_teeth_or_half:g} teeth needs profile shifts, and the distance of "
                f"the axes is not given: {1e3 * stage.axis_distance:.6g} mm is taken, half-way between those "
                f"of both meshes without shift, with working pressure angles of {angles} deg",
                remedy="give centre_distance",
                severity=DOUBT,
            )


def embed_files(data: dict, name: str) -> dict[str, str]:
    """Put torques, and the tables of pairs that give stages their stiffness, in the place of their files."""
    files, stages = embed_torques(data, name), data.get("parallel")
    for i, table in enumerate(stages if isinstance(stages, list) else ()):
        if isinstance(table, dict) and isinstance(table.get("stiffness"), str):
            key, file = f"parallel[{i}].stiffness", table.pop("stiffness")
            table["stiffness"] = embedded(file, name, key, _pair_tables)
            files[key] = case_text.printable(file)
    return files


def _pair_tables(path: str) -> dict:
    """Read the tables of the case file of a pair, with the points of its measured profiles."""
    data = case_text.parse(case_text.read_text(path), path)
    embed_profiles(data, path)
    return data


def embed_torques(data: dict, name: str) -> dict[str, str]:
    """Put the points of every ``file`` of a torque in its place; see `embed_points`."""

    def plain(table: dict) -> bool:
        return not table.keys() & {"torque", "times", "torques", "share"}

    units = {"times": "s", "torques": "N m"}
    return embed_points(data, "operation.torque", name, read=read_torques, units=units, plain=plain)


def read_torques(path: str | os.PathLike) -> dict[str, list[float]]:
    """Read ``"times"`` [s] and ``"torques"`` [N m] of a CSV file.

    CaseError: E-FILE, E-FILE-ENC (see `femgear.case.text.read_text`), with the number of the line: unknown
    columns or units, numbers that are none, not finite or beyond the limits of a case file, decimal commas
    beside decimal points, times that do not ascend.

    Parameters
    ----------
    path : path-like
        Text in two columns, divided by comma, semicolon or tab (with semicolon or tab the numbers may have
        decimal commas); the first line names them with their units, such as ``time [s]`` and
        ``torque [kN m]``, in either order. Empty lines and those that begin with ``#`` are skipped.
    """
    columns = read_columns(path, _DIMENSIONS, least=1, most=_MOST_POINTS, remedy=_COLUMNS)
    times, torques = (_column(columns, key) for key in ("time", "torque"))
    for (before, after), line in zip(pairwise(times), columns.lines[1:], strict=True):
        if not after > before:
            raise columns.problem(
                "the times do not ascend",
                line,
                value=f"{after:g} s",
                limit=f"above {before:g} s",
                remedy="sort the lines by time, and keep one line of every instant",
            )
    return {"times": times, "torques": torques}


def _column(columns: CsvColumns, key: str) -> list[float]:
    """One column as the case will hold it, within the limits of a case file."""
    (low, high), dimension = _LIMITS[key], _DIMENSIONS[key]
    values = [float(f"{value:{_DIGITS}}") for value in columns.values[key]]
    for value, line in zip(values, columns.lines, strict=True):
        if not low <= value <= high:
            raise columns.problem(
                f"{dimension.name} of {dimension.show(value)} is not plausible",
                line,
                value=dimension.show(value),
                limit=f"{dimension.show(low)} to {dimension.show(high)}",
                remedy=f"check the number, and the unit of the column {key} in the heading",
            )
    return values


FILE = CaseFile(
    DrivetrainCase,
    check_entries_together,
    lambda tables, case: drivetrain_notices(case),
    claims=lambda tables: "bodies" if isinstance(tables.get("body"), list) else "",
    embed=embed_files,
)
