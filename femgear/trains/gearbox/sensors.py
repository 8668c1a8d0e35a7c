"""Sensors on a gearbox: their motion, what files are refused for, and what results have of it.

A sensor is a point and a direction. On a rigid casing the point moves as u + phi x r, by the rigid link from the
station of the casing; on one from a file as its node, by the rigid body and all elastic motions. On the outer surface
of an elastic ring it moves as the seat of the ring does, and as the ring does beyond that.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.messages import no_such
from femgear.errors import CaseError, several
from femgear.fe.beam import rigid_link
from femgear.findings import Finding
from femgear.report.tables import Block, tabulate
from femgear.system.assembly import GROUND
from femgear.trains.gearbox.case_file import CASING, DIRECTION_VECTORS, BoxSensorSection, GearboxCase, teeth_of
from femgear.trains.gearbox.casing_file import casing_at_hand, casing_element, casing_file_paths, elastic_casing
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.model import GearboxModel, gearbox_model

if TYPE_CHECKING:
    import xarray as xr

    from femgear.exchange.superelement import Superelement

MODES_SHOWN = 3
"""Modes that move a sensor most, in the table."""
# Largest motion of a sensor per unit of any motion of the gearbox up to which it stands still: rounding.
_STILL = 1e-9


@dataclass(frozen=True)
class BoxSensor:
    """A sensor in the model.

    Parameters
    ----------
    name : str
        As the case or the table of nodes has it.
    place : (3,) array
        [m]
    direction : (3,) array
        Unit vector along which it feels.
    node : int or None
        Its node in the file of the casing; None on a rigid one.
    ring : str
        Stage on whose elastic ring it is; empty of those on the casing.
    angle : float
        Of its place around the ring, from x [rad].
    """

    name: str
    place: np.ndarray
    direction: np.ndarray
    node: int | None = None
    ring: str = ""
    angle: float = 0.0

    @property
    def on_ring(self) -> np.ndarray:
        """Shares (2,) of its direction along the radius, outwards, and along the circumference of the ring."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.array([[cosine, sine], [-sine, cosine]]) @ self.direction[:2]


def sensor_node_problems(case: GearboxCase, element: Superelement) -> Iterator[CaseError]:
    """List sensors without a node, rows of one name, and nodes that do not move as their sensor feels."""
    names = [node.name for node in element.nodes if node.role == "sensor"]
    for number, sensor in enumerate(case.sensor):
        if sensor.ring is None and sensor.name not in names:
            limit = ", ".join(names[:20]) or "none: the table has no nodes of the role sensor NAME"
            what, key = "name a sensor of the table of nodes", f"sensor[{number}].name"
            yield no_such("sensor", key, sensor.name, names, what, limit=limit)
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        yield CaseError(
            "sensors of one name",
            code="E-DUPLICATE",
            key="casing.nodes",
            value=", ".join(twice[:20]),
            limit="one row of the role sensor NAME for each name",
            remedy=f'name each for its direction, as "{twice[0]} x" and "{twice[0]} y"',
        )
    for sensor, node in _sensors_of_nodes(case, element):
        lost = [way for way in np.flatnonzero(sensor.direction) if (node, int(way) + 1) not in element.row]
        if lost:
            yield CaseError(
                f"the node of the sensor {sensor.name} does not move as it feels",
                code="E-SHAPE",
                key="casing.nodes",
                value=f"node {node}, without {', '.join('xyz'[way] for way in lost)}",
                limit="components 1, 2 and 3 in the matrices, as far as its direction has them",
                remedy="keep them in the reduction, or choose another direction",
            )


def _sensors_of_nodes(case: GearboxCase, element: Superelement) -> Iterator[tuple[BoxSensor, int]]:
    """Sensors of a table of nodes that have a direction, of the case or of the table, with their nodes."""
    given = {sensor.name: sensor.direction for sensor in case.sensor if sensor.ring is None}
    for node in element.nodes:
        vector = given.get(node.name) or DIRECTION_VECTORS.get(node.direction)
        if node.role == "sensor" and vector is not None:
            yield BoxSensor(node.name, element.place[node.number], _unit(vector), node.number), node.number


def _unit(vector: Sequence[float]) -> np.ndarray:
    """Vector (3,) of length 1."""
    return np.asarray(vector, float) / np.linalg.norm(vector)


def gearbox_sensors(case: GearboxCase) -> tuple[BoxSensor, ...]:
    """List the sensors of a case: on the casing those of the case or of the table of nodes of a file, then on rings.

    CaseError: see `femgear.trains.gearbox.casing_file.casing_element`.
    """
    on_casing, on_rings = list[BoxSensor](), list[BoxSensor]()
    if case.casing is not None and case.casing.file is not None:
        on_casing = [sensor for sensor, _ in _sensors_of_nodes(case, casing_element(case))]
    for sensor in case.sensor:
        if sensor.ring is not None:
            on_rings.append(_ring_sensor(case, sensor))
        elif case.casing is not None and case.casing.file is None:
            on_casing.append(BoxSensor(sensor.name, np.array(sensor.position), _unit(sensor.direction or ())))
    return (*on_casing, *on_rings)


def _ring_sensor(case: GearboxCase, section: BoxSensorSection) -> BoxSensor:
    """Sensor on the outer surface of a ring, in the middle of its width, by default along the radius."""
    stage = next(stage for stage in case.planetary if stage.name == section.ring)
    angle = section.angle or 0.0
    out = np.array([math.cos(angle), math.sin(angle), 0.0])
    shaft = case.shaft_named(stage.sun if stage.sun != CASING else stage.carrier)
    position = stage.member_position("sun" if stage.sun != CASING else "carrier") or 0.0
    centre = np.array([*shaft.axis, shaft.start + position])
    place = centre + planetary_set(teeth_of(stage)).ring.rim_radius * out
    return BoxSensor(section.name, place, _unit(section.direction or tuple(out)), None, stage.name, angle)


def sensor_rows(model: GearboxModel) -> np.ndarray:
    """Compute the displacement (s, 6n) [m] of all sensors along their directions per unit of all motions.

    Rows are those of `gearbox_sensors`. A motion of the gearbox moves the sensors by ``sensor_rows(model) @ motion``, a
    mode in all motions likewise.

    Parameters
    ----------
    model : GearboxModel
        With n stations.
    """
    case, casing, sensors = model.case, model.casing, gearbox_sensors(model.case)
    rows = np.zeros((len(sensors), model.assembly.count))
    body = None if case.casing is None or case.casing.file is None else elastic_casing(case)[1]
    seats = {stage.name: stage.members[-1] for stage in model.stages}
    for row, sensor in zip(rows, sensors, strict=True):
        if sensor.ring:
            _on_seat(row, sensor, seats[sensor.ring], model.assembly.places)
        elif casing is not None:
            _on_seat(row, sensor, casing.station, model.assembly.places)
        if casing is None:
            continue
        if body is not None and sensor.node is not None and casing.elastic:
            shape, first = body.shape[sensor.node], 6 * casing.elastic[0]
            row[first : first + shape.shape[1]] = sensor.direction @ shape[:3]
    return rows


def _on_seat(row: np.ndarray, sensor: BoxSensor, station: int, places: np.ndarray) -> None:
    """Put into the row (6n,) of a sensor that it moves as a rigid part of a station."""
    if station != GROUND:
        row[6 * station : 6 * station + 6] = sensor.direction @ rigid_link(sensor.place - places[station])[:3]


def check_sensors(case: GearboxCase) -> None:
    """Refuse, before a run, sensors that are none of the casing, and those that nothing moves.

    CaseError: see `sensor_node_problems`; E-CHOICE: a direction in which the casing is held.
    """
    if case.casing is not None and case.casing.file is not None:
        problems = [*sensor_node_problems(case, casing_element(case))]
        for problem in problems:
            problem.file = str(casing_file_paths(case)[1]) if problem.key == "casing.nodes" else problem.file
        if problems:
            raise several(problems)
    sensors = gearbox_sensors(case)
    if not sensors:
        return
    model = gearbox_model(case)
    motions = model.assembly.motions
    largest = np.abs(sensor_rows(model) @ motions).max(axis=1, initial=0.0)
    still = largest <= _STILL * np.abs(motions).max(initial=1.0)
    still &= np.array([not np.any(sensor.on_ring) if sensor.ring else True for sensor in sensors])
    if still.any():
        names = ", ".join(sensor.name for sensor, held in zip(sensors, still, strict=True) if held)
        raise CaseError(
            "sensors that nothing moves",
            code="E-CHOICE",
            key="sensor" if case.sensor else "casing.nodes",
            value=names,
            limit="a direction in which the casing moves, or the ring, in its plane",
            remedy='choose another direction, feet that give way, or motions = "space"',
        )


def sensor_notices(case: GearboxCase) -> Iterator[Finding]:
    """Tell sensors of a table of nodes that are not heard, since no direction says along what (W-UNUSED)."""
    if case.casing is None or case.casing.file is None or (element := casing_at_hand(case)) is None:
        return
    with_nodes = {sensor.name for sensor, _ in _sensors_of_nodes(case, element)}
    lost = [node.name for node in element.nodes if node.role == "sensor" and node.name not in with_nodes]
    if lost:
        text = f"{len(lost)} sensors have no direction along x, y or z, and are not heard: {', '.join(lost[:5])}"
        remedy = "give it in the table, or by [[sensor]] with name and direction"
        yield Finding("W-UNUSED", "casing.nodes", text, remedy=remedy)


def sensor_coordinates(model: GearboxModel) -> dict[str, tuple]:
    """Collect the names of the sensors, by their dimension; none without sensors."""
    names = [sensor.name for sensor in gearbox_sensors(model.case)]
    return {"sensor": (("sensor",), names, "1", "sensor")} if names else {}


def _places(model: GearboxModel) -> dict[str, tuple]:
    """Variables of place and direction of all sensors."""
    sensors = gearbox_sensors(model.case)
    return {
        "sensor_place": ("sensor axis", [sensor.place for sensor in sensors], "m", "place of the sensor"),
        "sensor_direction": (
            "sensor axis",
            [sensor.direction for sensor in sensors],
            "1",
            "unit vector along which the sensor feels",
        ),
    }


def static_sensor_variables(states: Sequence[Deflection]) -> dict[str, tuple]:
    """Collect the displacements of all sensors in all load cases; none without sensors."""
    rows = sensor_rows(states[0].model)
    if not len(rows):
        return {}
    return {
        "sensor_displacement": (
            "load_case sensor",
            [rows @ state.motion for state in states],
            "m",
            "static displacement along the direction of the sensor",
        ),
        **_places(states[0].model),
    }


def modal_sensor_variables(model: GearboxModel, at_sensors: np.ndarray) -> dict[str, tuple]:
    """Collect the shapes (s, m) of modes at all sensors; none without sensors."""
    if not len(at_sensors):
        return {}
    text = "mode shape of unit mass along the direction of the sensor"
    return {"sensor_shape": ("sensor mode", at_sensors, "kg^-1/2", text), **_places(model)}


def describe_sensors(data: xr.Dataset, at: int, name: str) -> Iterator[Block]:
    """Tabulate the static displacements of deflection.nc in a load case, whose ``name`` the title has."""
    if "sensor_displacement" not in data:
        return
    columns = _columns(data) | {
        "displacement [um]": lambda i: f"{1e6 * float(data['sensor_displacement'].values[at, i]):+.4g}"
    }
    yield tabulate(f"Sensors{name}", range(data.sizes["sensor"]), columns)


def describe_modes_at_sensors(data: xr.Dataset) -> Iterator[Block]:
    """Tabulate which modes of modes.nc move every sensor most."""
    if "sensor_shape" not in data:
        return
    shape, hertz = np.abs(data["sensor_shape"].values), data["frequency"].values
    elastic = np.flatnonzero(hertz > 0.0)

    def strongest(sensor: int) -> str:
        modes = elastic[np.argsort(-shape[sensor, elastic], kind="stable")][:MODES_SHOWN]
        return ", ".join(f"{mode + 1} ({hertz[mode]:.0f} Hz, {shape[sensor, mode]:.3g})" for mode in modes)

    columns = _columns(data) | {"moved most by mode (frequency, shape [kg^-1/2])": strongest}
    yield tabulate("Modes at the sensors", range(data.sizes["sensor"]), columns)


def _columns(data: Any) -> dict[str, Any]:
    """Columns of name, place and direction of a sensor."""

    def numbers(values: Iterable[float]) -> str:
        return ", ".join(f"{value:.5g}" for value in values)

    return {
        "sensor": lambda i: str(data["sensor"].values[i]),
        "place [mm]": lambda i: numbers(1e3 * data["sensor_place"].values[i]),
        "direction": lambda i: numbers(data["sensor_direction"].values[i]),
    }
