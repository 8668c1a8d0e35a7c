"""What the casing of a gearbox case and the sensors on it are refused for before anything is computed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femgear.case.messages import no_such
from femgear.case.quantities import INERTIA, LENGTH
from femgear.errors import CaseError
from femgear.trains.gearbox.case_file import CASING, BoxCasingSection, BoxSensorSection, GearboxCase
from femgear.trains.gearbox.casing import inertia_tensor, named_seats

# By which the largest principal inertia may exceed the sum of both others, relative: rounding of a drawing.
_FLAT = 1e-3
_FAR = 3.0
"""Distance of a sensor from the nearest foot or seat, at most, over that of those farthest from one another."""
_DIRECTIONS = '"x", "y", "z", one of these after a minus sign, or three numbers'


def check_casing(case: GearboxCase) -> Iterator[CaseError]:
    """List what no entry of the casing and of its sensors shows alone."""
    section = case.casing
    yield from _sensors(case)
    if section is None:
        return
    yield from _motions(case)
    yield from _given(section)
    yield from _inertia(section)
    yield from _feet(section)
    yield from _standing(case, section)


def _motions(case: GearboxCase) -> Iterator[CaseError]:
    """A casing that moves where its axes may move."""
    if case.motions == "rotation":
        yield CaseError(
            "where shafts rotate alone their axes stand still, and the casing with them",
            code="E-CHOICE",
            key="casing",
            value="motions = rotation",
            limit="motions space or plane",
            remedy='write motions = "plane", or leave casing out',
        )


def _given(section: BoxCasingSection) -> Iterator[CaseError]:
    """A rigid body on feet, or a file."""
    rigid = ("mass", "inertia", "centre")
    given = section.given(*rigid)
    if section.file is not None and given:
        yield CaseError(
            "the casing is given twice",
            code="E-CHOICE",
            key=f"casing.{given[0]}",
            limit="file, or mass, inertia and centre",
            remedy=f"leave {', '.join(given)} out: the file has them",
        )
    if section.file is not None:
        yield from _nodes_and_feet(section)
        return
    for name in rigid:
        if name not in given:
            yield CaseError(
                "a rigid casing needs it",
                code="E-KEY-MISSING",
                key=f"casing.{name}",
                limit="mass, inertia and centre, or file",
                remedy="give that of the casing with all that is fixed in it, or the file of a superelement",
            )
    if not section.foot:
        yield CaseError(
            "the casing has no feet",
            code="E-KEY-MISSING",
            key="casing.foot",
            limit="one or more [[casing.foot]]",
            remedy="give its feet, or leave [casing] out: it then stands still",
        )
    for number, foot in enumerate(section.foot):
        if foot.position is None:
            yield CaseError(
                "the place of the foot is missing",
                code="E-KEY-MISSING",
                key=f"casing.foot[{number}].position",
                remedy='give x, y and z, as in ["-80 mm", "-100 mm", "0 mm"]',
            )


def _nodes_and_feet(section: BoxCasingSection) -> Iterator[CaseError]:
    """What a casing of a file needs, and what its nodes have already."""
    if section.nodes is None:
        yield CaseError(
            "matrices do not say which node is what",
            code="E-KEY-MISSING",
            key="casing.nodes",
            limit="a table of nodes (CSV): seat NAME, foot NAME",
            remedy='give nodes = "nodes.csv" beside file',
        )
    for number, foot in enumerate(section.foot):
        if foot.position is not None:
            yield CaseError(
                "the place of the foot is that of its node",
                code="E-CHOICE",
                key=f"casing.foot[{number}].position",
                limit="name and stiffness",
                remedy="leave it out",
            )


def _inertia(section: BoxCasingSection) -> Iterator[CaseError]:
    """Inertias that a body can have: positive, none larger than the sum of both others."""
    if section.inertia is None:
        return
    principal = np.linalg.eigvalsh(inertia_tensor(section))
    if principal[0] <= 0.0 or principal[2] > (1.0 + _FLAT) * (principal[0] + principal[1]):
        yield CaseError(
            "no body has these inertias",
            code="E-RANGE",
            key="casing.inertia",
            value=f"about its principal axes {', '.join(INERTIA.show(float(value)) for value in principal)}",
            limit="above 0, the largest at most the sum of both others",
            remedy="correct inertia; products are the integrals of x y, x z and y z over the mass",
        )


def _feet(section: BoxCasingSection) -> Iterator[CaseError]:
    """One name, one foot."""
    names = section.foot_names
    for number, name in enumerate(names):
        if name in names[:number]:
            yield CaseError(
                f"the name is that of casing.foot[{names.index(name)}] already",
                code="E-DUPLICATE",
                key=f"casing.foot[{number}].name",
                value=name,
                remedy="give every foot a name of its own",
            )


def _standing(case: GearboxCase, section: BoxCasingSection) -> Iterator[CaseError]:
    """Seats that there are, each of one name."""
    seats = named_seats(case)
    names = [name for _, name, _ in seats]
    for number, (key, name, _) in enumerate(seats):
        if name in names[:number]:
            yield CaseError(
                f"what sits in the {CASING} has the name of {seats[names.index(name)][0]} already",
                code="E-DUPLICATE",
                key=key,
                value=name,
                remedy="give one of them another name",
            )
    for number, name in enumerate(section.stands_still):
        if name not in names:
            what = f"name what sits in the {CASING}"
            limit = ", ".join(names[:20]) or f"none: nothing sits in the {CASING}"
            yield no_such("seat", f"casing.stands_still[{number}]", name, names, what, limit=limit)


def _sensors(case: GearboxCase) -> Iterator[CaseError]:
    """Sensors on a casing that moves or on an elastic ring, each with a name, a direction and a place."""
    if case.casing is None and any(sensor.ring is None for sensor in case.sensor):
        yield CaseError(
            "a casing that stands still has no motion for a sensor",
            code="E-KEY-MISSING",
            key="casing",
            limit="a casing on feet, rigid or from a file, or a sensor on an elastic ring",
            remedy="give [casing] with mass, centre, inertia and [[casing.foot]], or ring and angle of the sensor",
        )
    names = [sensor.name for sensor in case.sensor]
    for number, sensor in enumerate(case.sensor):
        key = f"sensor[{number}]"
        if sensor.name in names[:number]:
            yield CaseError(
                f"the name is that of sensor[{names.index(sensor.name)}] already",
                code="E-DUPLICATE",
                key=f"{key}.name",
                value=sensor.name,
                remedy="give every sensor a name of its own",
            )
        if sensor.direction is not None and not any(sensor.direction):
            yield CaseError(
                "the sensor has no direction",
                code="E-RANGE",
                key=f"{key}.direction",
                value=list(sensor.direction),
                limit="a vector that is not zero",
                remedy='write direction = "y"',
            )
        if sensor.ring is not None:
            yield from _ring_of_sensor(case, key, sensor)
        elif sensor.angle is not None:
            limit, remedy = "the angle of a sensor on a ring", 'name its stage, as in ring = "set"'
            yield CaseError("an angle without a ring", code="E-CHOICE", key=f"{key}.angle", limit=limit, remedy=remedy)
        elif case.casing is not None:
            yield from _place_of_sensor(key, sensor, case.casing)
            yield from _reach_of_sensor(case, key, sensor)


def _reach_of_sensor(case: GearboxCase, key: str, sensor: BoxSensorSection) -> Iterator[CaseError]:
    """A sensor on a rigid casing, near what sits in it: anywhere else its level is that of a lever."""
    section = case.casing
    if sensor.position is None or section is None or section.centre is None:
        return
    feet = [foot.position for foot in section.foot if foot.position is not None]
    places = np.array([section.centre, *feet, *(place for _, _, place in named_seats(case))])
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    away = float(np.linalg.norm(np.asarray(sensor.position) - places, axis=1).min())
    if away > _FAR * size > 0.0:
        yield CaseError(
            "the sensor is not on the casing",
            code="E-RANGE",
            key=f"{key}.position",
            value=f"{LENGTH.show(away)} from the nearest foot or seat",
            limit=f"at most {LENGTH.show(_FAR * size)}, {_FAR:g} times the size of the casing",
            remedy="give x, y and z of a place on it",
        )


def _ring_of_sensor(case: GearboxCase, key: str, sensor: BoxSensorSection) -> Iterator[CaseError]:
    """Ring and angle of a sensor on the elastic ring of a stage."""
    rings = [stage.name for stage in case.planetary if stage.elastic_ring]
    if sensor.ring not in rings:
        limit = ", ".join(rings) or "none: no stage has elastic_ring = true"
        what = "name a planetary stage whose ring is elastic, or give the position of the sensor on a casing"
        yield no_such("elastic ring", f"{key}.ring", sensor.ring or "", rings, what, limit=limit)
    if sensor.angle is None:
        message, limit = "the angle of the sensor is missing", "where it is around the ring, from x"
        yield CaseError(message, code="E-KEY-MISSING", key=f"{key}.angle", limit=limit, remedy='write angle = "90 deg"')
    if sensor.position is not None:
        message, limit = "a sensor on a ring is at an angle of it", "ring and angle, or a position on the casing"
        yield CaseError(message, code="E-CHOICE", key=f"{key}.position", limit=limit, remedy="leave it out")


def _place_of_sensor(key: str, sensor: BoxSensorSection, casing: BoxCasingSection) -> Iterator[CaseError]:
    """Place and direction that a rigid casing needs, and a place that one of a file has already."""
    if casing.file is not None:
        if sensor.position is not None:
            yield CaseError(
                "the place of the sensor is that of its node",
                code="E-CHOICE",
                key=f"{key}.position",
                limit="name and direction",
                remedy="leave it out",
            )
        return
    needed = {"position": 'give x, y and z, as in ["60 mm", "90 mm", "40 mm"]', "direction": f"give {_DIRECTIONS}"}
    for name, remedy in needed.items():
        if getattr(sensor, name) is None:
            what = "place" if name == "position" else name
            limit = "place and direction of every sensor on a rigid casing"
            message = f"the {what} of the sensor is missing"
            yield CaseError(message, code="E-KEY-MISSING", key=f"{key}.{name}", limit=limit, remedy=remedy)
