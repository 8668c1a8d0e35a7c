"""What is heard of a response of the elastic set: transmission errors, field of the ring, sensors on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import linalg

from femgear.case.gear_set import planetary_set
from femgear.exchange.dynamic_model import DynamicModel, RingSensor
from femgear.findings import Finding, tell
from femgear.gears.planetary import mesh_names
from femgear.housing.sensor import SensorLines, component_lines
from femgear.solvers.linear.modal import output_load, output_response, residual_output, source_output
from femgear.solvers.linear.state_space import Port, modal_model
from femgear.stages.lumped_set import member_speeds
from femgear.trains.elastic.model import RADIAL, ring_field

if TYPE_CHECKING:
    from collections.abc import Mapping

    from femgear.case.planetary import Case
    from femgear.system.system import Response
    from femgear.trains.elastic.results import DynamicsResult, ModesResult


def sensor_lines(case: Case, modes: ModesResult, response: Response, carrier: np.ndarray) -> SensorLines:
    """Lines of the fixed sensor at speeds (S,) of the carrier [rad/s]."""
    return lines_of_field(case, modes, mesh_and_ring_outputs(modes, response)[1], carrier)


def lines_of_field(case: Case, modes: ModesResult, field: np.ndarray, carrier: np.ndarray) -> SensorLines:
    """Compute lines of the fixed sensor by the radial field of the ring (speeds, harmonics, diameters) [m].

    See `mesh_and_ring_outputs`; at speeds (n,) of the carrier [rad/s].
    """
    options = {"symmetry": modes.symmetry, "periods": modes.excitation.periods}
    return component_lines(field, case.ring.teeth, carrier, case.housing.sensor_angle, **options)


def mesh_and_ring_outputs(
    result: ModesResult, response: Response, output: int = RADIAL
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the dynamic transmission error of every mesh, and the radial or tangential field of the ring.

    Both complex [m], (S, 2N, H + 1), and (S, H + 1, 2 n_max + 1) of the outer surface, see
    `femgear.trains.elastic.model.ring_field`, of a response at S speeds with H harmonics.
    """
    model, basis, n_max = result.model, result.modes, result.max_diameter
    ring_rows = np.eye(len(model.system.M))[model.ring_slice]
    field = ring_field(result.ring.modes, np.eye(len(ring_rows)), output, n_max).T
    kept_waves, n_meshes = np.ones(2 * n_max + 1, bool), model.rigid_directions.shape[1]
    if result.ring.modes.count % result.symmetry == 0:
        # planets in phase, of which one follows the other after a turn
        kept_waves = np.arange(-n_max, n_max + 1) % result.symmetry == 0
    rows: Any = linalg.block_diag(np.eye(n_meshes), field[kept_waves])
    outputs = np.vstack([model.rigid_directions.T, ring_rows])
    values = output_response(
        basis,
        response,
        rows @ (outputs @ basis.shape),
        residual=rows @ residual_output(model.system, basis, outputs),
        load=rows @ output_load(model.system, basis, outputs),
        source=None if (source := source_output(model.system, basis, outputs)) is None else rows @ source,
    )
    ring = np.zeros((len(values), values.shape[-1], len(kept_waves)), complex)
    ring[..., kept_waves] = np.swapaxes(values[:, n_meshes:], 1, 2)
    return values[:, :n_meshes], ring


def named_sensors(case: Case, dynamics: DynamicsResult) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and lines (speeds, n_sensors, n_orders) [m] of the sensors of a case on the ring.

    A sensor of width w feels the wave of n nodal diameters times ``sin(x)/x``, ``x = n w/(2 R)``, its mean over w.
    """
    carrier, lines = np.array([s.carrier for s in dynamics.speeds]), list[np.ndarray]()
    n = np.arange(dynamics.ring_radial.shape[-1]) - dynamics.ring_radial.shape[-1] // 2
    for sensor in case.housing.sensor:
        field = math.cos(sensor.direction) * dynamics.ring_radial
        if math.sin(sensor.direction):
            field = field + math.sin(sensor.direction) * dynamics.ring_tangential
        felt = field * np.sinc(n * sensor.width / case.ring.outer_radius / (2.0 * math.pi))
        place = dynamics.ring_teeth, carrier, sensor.angle
        options = {"symmetry": dynamics.symmetry, "periods": dynamics.response.periods}
        lines.append(component_lines(felt, *place, **options).displacement)
    return tuple(sensor.name for sensor in case.housing.sensor), np.stack(lines, axis=1)


def lines_method(case: Case) -> str:
    """Name how the lines of a sensor are found, see `SensorLines`."""
    return "casing" if case.housing.structure else "supports" if case.housing.support else "exact"


def elastic_dynamic_model(case: Case, results: Mapping[str, Any]) -> DynamicModel:
    """Make the model of the set on the foundation of its ring, with torques at its ends and the sensor of the level."""
    if case.housing.stands_still:
        key = "housing.support" if case.housing.support else "housing.structure"
        text = "the model for other programs has the ring on its foundation alone, as the modes"
        tell(Finding("W-FOUNDATION", key, text, remedy="take levels at sensors from a run"))
    result: ModesResult = results["modes"]
    model, system = result.model, result.model.system
    turning, meshes = member_speeds(case, planetary_set(case)), mesh_names(len(result.modes.mesh_stiffness) // 2)
    unit, rigid = np.eye(len(system.dofs)), slice(model.ring_slice.start)
    ends = [system.dofs.index(f"{_end_of(case, name)}: rotation") for name in ("input", "output")]
    inputs = [
        Port(f"torque on {system.dofs[end].split(':')[0]}", "N m", unit[end], float(system.load[end])) for end in ends
    ]
    outputs = [
        Port(name, "rad" if name.endswith("rotation") else "m", row)
        for name, row in zip(system.dofs[rigid], unit[rigid], strict=True)
    ]
    outputs += [
        Port(f"transmission error of {mesh}", "m", row)
        for mesh, row in zip(meshes, model.rigid_directions.T, strict=True)
    ]
    first, n_max = len(outputs), result.max_diameter
    for number, row in enumerate(_ring_waves(result)):
        name = f"ring radial {'sin' if number and number % 2 == 0 else 'cos'} {(number + 1) // 2}"
        outputs.append(Port(name, "m", row))
    return DynamicModel(
        title=case.title,
        modal=modal_model(system, result.modes, meshes=meshes, inputs=inputs, outputs=outputs),
        excitation=result.excitation,
        speed=float(max(case.operation.speeds)),
        mesh_rate=turning.mesh_frequency,
        driver=ends[0],
        sensor=RingSensor(case.housing.sensor_angle, first, n_max, turning.carrier),
    )


def _end_of(case: Case, side: str) -> str:
    """Name of the body at which the torque of the input or the output acts."""
    member = case.operation.input
    if side == "output":
        member = "carrier" if member == "sun" else "sun"
    machine = case.motor if side == "input" else case.brake
    return member if machine is None else {"input": "motor", "output": "brake"}[side]


def _ring_waves(result: ModesResult) -> np.ndarray:
    """Rows (2 n_max + 1, n) of the radial displacement of the ring: a_0, then a_n and b_n of every n."""
    n_max, columns = result.max_diameter, result.model.ring_slice
    size = columns.stop - columns.start
    field: Any = ring_field(result.ring.modes, np.eye(size), RADIAL, n_max).T
    forward, backward = field[n_max + 1 :], field[n_max - 1 :: -1] if n_max else field[:0]
    waves = np.zeros((2 * n_max + 1, len(result.model.system.dofs)))
    waves[0, columns] = field[n_max].real
    waves[1::2, columns], waves[2::2, columns] = (forward + backward).real, (backward - forward).imag
    return waves
