"""What must hold between the entries of a drivetrain case: names, chain, teeth and radii, torques, times."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from itertools import pairwise

from femgear.casefile.drivetrain import DrivetrainCase, PlanetarySection, ShaftSection
from femgear.casefile.drivetrain_sizes import check_sizes, given_of
from femgear.casefile.units import FREQUENCY, LENGTH, TIME
from femgear.errors import CaseError

MOST_STEPS = 1e8
MOST_VALUES = 2.5e8
LEAST_RECORDS = 64
MOST_COORDINATES = 1500


def cross_check(case: DrivetrainCase) -> list[CaseError]:
    """What no entry shows alone."""
    names = list(_names(case))
    found = [*names, *(problem for check in _CHECKS for problem in check(case))]
    return found if names else [*found, *_chain(case)]


def joints(case: DrivetrainCase) -> list[tuple[str, str, str]]:
    """Key, and the two bodies, of every shaft and gear stage."""
    found = [(f"shaft[{i}].between", *one.between) for i, one in enumerate(case.shaft)]
    found += [(f"parallel[{i}].between", *one.between) for i, one in enumerate(case.parallel)]
    return found + [(f"planetary[{i}].sun", one.carrier, one.sun) for i, one in enumerate(case.planetary)]


def _names(case: DrivetrainCase) -> Iterator[CaseError]:
    names = [body.name for body in case.body]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield CaseError("two bodies have one name", code="E-DUPLICATE", key=f"body[{i}].name", value=name)
    used = [(key, name) for key, *ends in joints(case) if ".between" in key for name in ends]
    for i, stage in enumerate(case.planetary):
        used += [(f"planetary[{i}].carrier", stage.carrier), (f"planetary[{i}].sun", stage.sun)]
    used += [(f"bearing[{i}].body", one.body) for i, one in enumerate(case.bearing) if one.body is not None]
    used += [(f"operation.torque[{i}].body", one.body) for i, one in enumerate(case.operation.torque)]
    for key, name in used:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
            yield CaseError(
                "there is no such body",
                code="E-BODY",
                key=key,
                value=name,
                limit=", ".join(names[:20]),
                remedy=f"did you mean {near[0]}?" if near else "name a body of a [[body]] table",
            )
    for key, first, second in joints(case):
        if first == second:
            yield CaseError("a body is joined to itself", code="E-BODY", key=key, value=first)


def _chain(case: DrivetrainCase) -> Iterator[CaseError]:
    """Everything hangs together, and shafts alone close no loop."""
    group = {body.name: body.name for body in case.body}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    for key, first, second in joints(case):
        one, two = root(first), root(second)
        if one == two and key.startswith("shaft"):
            yield CaseError(
                f"the shaft closes a loop: {first} and {second} are joined already",
                code="E-LOOP",
                key=key,
                limit="one way by shafts from body to body",
                remedy="leave one of the shafts out",
            )
        group[two] = one
    start = root(case.body[0].name)
    apart = [(i, body.name) for i, body in enumerate(case.body) if root(body.name) != start]
    if apart:
        i, name = apart[0]
        yield CaseError(
            f"nothing joins {', '.join(name for _, name in apart)} to {case.body[0].name}",
            code="E-DISCONNECTED",
            key=f"body[{i}].name",
            value=name,
            remedy="add a [[shaft]], a [[parallel]] or a [[planetary]]",
        )


def _bodies(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, body in enumerate(case.body):
        if body.tilts and body.transverse_inertia == 0.0:
            yield CaseError(
                "a body that tilts needs an inertia about a diameter", code="E-KEY-MISSING",
                key=f"body[{i}].transverse_inertia",
                remedy="give it (a flat disc has half its inertia about the axis), or tilts = false",
            )  # fmt: skip
    elements = {shaft.between: shaft.elements for shaft in case.shaft}
    for i, one in enumerate(case.bearing):
        inside = (one.shaft is not None, one.station is not None)
        if inside != (one.body is None,) * 2:
            yield CaseError(
                "a bearing sits on one body, or on one station inside a shaft",
                code="E-CHOICE",
                key=f"bearing[{i}].{'body' if one.body else 'shaft'}",
                limit="body, or shaft with station",
            )
        elif one.shaft is not None and not one.station < elements.get(one.shaft, 0):
            stations = elements.get(one.shaft, 0) - 1
            yield CaseError(
                "there is no such station",
                code="E-BODY",
                key=f"bearing[{i}].station",
                value=one.station,
                limit=f"1 to {stations}"
                if stations > 0
                else "a [[shaft]] with this between and 2 elements or more",
            )
        if one.radial == one.tilt == 0.0:
            yield CaseError(
                "a bearing without stiffness", code="E-RANGE", key=f"bearing[{i}].radial", value="0 N/m",
                limit="one of radial and tilt above 0", remedy="give it, or leave the [[bearing]] out",
            )  # fmt: skip
        if math.isinf(one.radial) and one.offset:
            yield CaseError(
                "a rigid bearing beside the centre of its body", code="E-CHOICE", key=f"bearing[{i}].offset",
                value=LENGTH.show(one.offset), limit="0 mm where radial is rigid",
                remedy="give a finite stiffness",
            )  # fmt: skip


def _shafts(case: DrivetrainCase) -> Iterator[CaseError]:
    for i, shaft in enumerate(case.shaft):
        springs = [name for name in ("bending", "torsion", "shear") if getattr(shaft, name) is not None]
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
                "a shaft that is rigid in torsion makes one body of two", code="E-CHOICE",
                key=f"shaft[{i}].torsion", value="rigid", limit="a finite spring",
                remedy="give a spring, or one body with the inertia of both",
            )  # fmt: skip
        if shaft.elements > 1 and shaft.density == 0.0:
            yield CaseError(
                "stations inside a shaft without mass", code="E-RANGE", key=f"shaft[{i}].density",
                value="0 kg/m^3", limit="above 0 kg/m^3 with 2 elements or more",
                remedy="give its density, or elements = 0",
            )  # fmt: skip


def _shaft_problem(shaft: ShaftSection, springs: list[str]) -> str:
    if shaft.outer_diameter is None:
        if not {"bending", "torsion"} <= set(springs):
            return "the shaft has neither a section nor both springs"
        return "elements need a section" if shaft.elements else ""
    return f"the shaft has a section and {' and '.join(springs)}" if springs else ""


def _torques(case: DrivetrainCase) -> Iterator[CaseError]:
    shares, bodies = [], []
    for i, one in enumerate(case.operation.torque):
        key = f"operation.torque[{i}]"
        series = len(given_of(one, ("times", "torques")))
        given = given_of(one, ("torque", "file", "share")) + ["times"] * bool(series)
        if len(given) != 1 or series == 1:
            yield CaseError(
                "the torque on a body is given in one way",
                code="E-CHOICE",
                key=f"{key}.{given[0] if given else 'torque'}",
                limit="torque, file, times with torques, or share",
            )
        elif series:
            if len(one.times) != len(one.torques) or any(b <= a for a, b in pairwise(one.times)):
                yield CaseError(
                    "the series needs ascending times, and as many torques",
                    code="E-TORQUE",
                    key=f"{key}.times",
                    value=f"{len(one.times)} times, {len(one.torques)} torques",
                )
        if one.body in bodies:
            yield CaseError("a second torque on one body", code="E-DUPLICATE", key=f"{key}.body")
        bodies.append(one.body)
        shares += [key] if one.share is not None else []
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
    if steps > MOST_STEPS:
        yield CaseError(
            f"{steps:.3g} steps are too many", code="E-RANGE", key="simulation.duration",
            value=TIME.show(s.duration), limit=f"{MOST_STEPS:g} steps: {TIME.show(MOST_STEPS / s.rate)}",
            remedy="take a shorter duration or a lower simulation.rate",
        )  # fmt: skip
    if s.settle is not None and not s.settle < s.duration:
        yield CaseError(
            "the spectra would leave out the whole run", code="E-RANGE", key="simulation.settle",
            value=TIME.show(s.settle), limit=f"below {TIME.show(s.duration)} (simulation.duration)",
        )  # fmt: skip
    elif s.record is not None:
        yield from record_problems(case, s.record)


def record_problems(case: DrivetrainCase, record: float) -> Iterator[CaseError]:
    """What the records of a run cannot hold.

    Parameters
    ----------
    case : DrivetrainCase
    record : float
        Records a second [Hz]: as given, or what `femgear.models.drivetrain_rates` takes for it.
    """
    s, ratio = case.simulation, case.simulation.rate / record
    if ratio < 1.0 - 1e-9 or abs(ratio - round(ratio)) > 1e-6 * ratio:
        yield CaseError(
            "a record is kept after a whole number of steps", code="E-RANGE", key="simulation.record",
            value=FREQUENCY.show(record),
            limit=f"{FREQUENCY.show(s.rate)} (simulation.rate) over a whole number",
            remedy=f"take {FREQUENCY.show(s.rate / max(1, round(ratio)))}",
        )  # fmt: skip
    # motion, velocity and torque of a body, a force and an approach of a mesh
    meshes = len(case.parallel) + sum(2 * _planets(stage) for stage in case.planetary)
    size = s.duration * record * (2 * len(case.body) + 2 * meshes + 2)
    if size > MOST_VALUES:
        yield CaseError(
            f"{size:.3g} kept numbers are too many", code="E-RANGE", key="simulation.record",
            value=FREQUENCY.show(record), limit=f"{MOST_VALUES:g} numbers",
            remedy=f"take {FREQUENCY.show(record * MOST_VALUES / size)} or less, or a shorter duration",
        )  # fmt: skip


def spectrum_problems(case: DrivetrainCase, record: float) -> Iterator[CaseError]:
    """Why the records of a run have no spectra; parameters as of `record_problems`."""
    s = case.simulation
    late, key = s.duration - settle_time(case), "settle" if s.settle is not None else "duration"
    if late * record < LEAST_RECORDS:
        yield CaseError(
            f"{late * record:.3g} records are too few for the spectra", code="E-RANGE",
            key=f"simulation.{key}", value=TIME.show(getattr(s, key)),
            limit=f"{LEAST_RECORDS} records or more after simulation.settle",
            remedy="take a longer duration, a shorter settle or more records, or write --only transient",
        )  # fmt: skip
    elif s.resolution is not None and not 1.0 / late <= s.resolution <= record / 16.0:
        yield CaseError(
            "the record has no such resolution", code="E-RANGE", key="simulation.resolution",
            value=FREQUENCY.show(s.resolution),
            limit=f"{FREQUENCY.show(1.0 / late)} to {FREQUENCY.show(record / 16.0)}",
        )  # fmt: skip


def _planets(stage: PlanetarySection) -> int:
    return stage.planets if stage.planet_angles is None else len(stage.planet_angles)


def _size(case: DrivetrainCase) -> Iterator[CaseError]:
    """The matrices are dense."""
    stations = [max(shaft.elements - 1, 0) for shaft in case.shaft]
    planets = sum(_planets(stage) for stage in case.planetary)
    count = 5 * len(case.body) + 5 * sum(stations) + 3 * planets
    if count > MOST_COORDINATES:
        longest = stations.index(max(stations)) if any(stations) else None
        yield CaseError(
            f"{count} coordinates are too many", code="E-RANGE",
            key="body" if longest is None else f"shaft[{longest}].elements",
            limit=f"{MOST_COORDINATES}: 5 a body and a station inside a shaft, 3 a planet",
            remedy="take fewer elements",
        )  # fmt: skip


def settle_time(case: DrivetrainCase) -> float:
    """Start that the spectra leave out [s]: as given, or three tenths."""
    s = case.simulation
    return 0.3 * s.duration if s.settle is None else s.settle


_CHECKS = (_bodies, _shafts, check_sizes, _torques, _simulation, _size)
