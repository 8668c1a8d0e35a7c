"""Transfer paths: how much of what a sensor on the casing hears comes by each bearing, ring and coupling.

The casing alone on its feet has the dynamic stiffness D. All that sits in it pushes with forces F_p, and ``u = sum_p
r D^-1 F_p`` at a sensor of row r, at every line. The share of a path is that of ``Re(u_p conj(u))`` in the power of
the acceleration: shares add up to one, and are negative where a path quietens another one (transfer path
analysis by matrix inversion, M. V. van der Seijs, D. de Klerk, D. J. Rixen, Mech. Syst. Signal Process. 68-69, 2016).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.housing.two_way.running_planets import RunningResponse, forces_on_structure
from femgear.system.assembly import Assembly, solved_conditions
from femgear.trains.gearbox.casing import CasingModel, called, rigid_foot_rows
from femgear.trains.gearbox.deflection import Deflection, spread_rows
from femgear.trains.gearbox.model import GearboxModel
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.sensors import sensor_rows
from femgear.trains.gearbox.stage_structure import StructuredStage, row_waves

RIGID = "parts fixed without springs"
"""Path of what the casing holds without springs, such as a ring that stands: the rest of the force on it."""


@dataclass(frozen=True)
class CasingPaths:
    """Ways into a casing, and the casing alone.

    Parameters
    ----------
    names : tuple of str
        Of the P paths: bearings, joints, meshes of the stages; `RIGID` last where some are rigid.
    forces : (P, c, 6n) complex array
        Forces of springs and meshes of mean stiffness on the c motions of the casing by all motions [N/m, N].
    places : (c,) int array
        These motions among all.
    mass, stiffness : (c, c) arrays
        Of the casing on its feet, the latter complex with its damping.
    free : (c, f) array
        Motions of the casing by those that rigid feet leave.
    sensors : (s, c) array
        Displacements of the sensors by the motions of the casing.
    rigid : bool
        Whether something rigid sits in the casing.
    """

    names: tuple[str, ...]
    forces: np.ndarray
    places: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    free: np.ndarray
    sensors: np.ndarray
    rigid: bool

    def heard(self, forces: np.ndarray, motion: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Displacements (P, s, L) of the sensors by forces (P, c, L) at angular frequencies (L,).

        The forces of what is rigid are those that the motions (c, L) of the casing leave.
        """
        dynamic = self.stiffness - omega[:, None, None] ** 2 * self.mass
        if self.rigid:
            forces = forces.copy()
            forces[-1] = np.einsum("lcd,dl->cl", dynamic, motion) - forces[:-1].sum(axis=0)
        reduced = self.free.T @ dynamic @ self.free
        right = (self.free.T @ forces).transpose(2, 1, 0)
        answer = self.free @ np.linalg.solve(reduced, right)
        return (self.sensors @ answer).transpose(2, 1, 0)


def casing_paths(state: Deflection) -> CasingPaths | None:
    """List the ways into the casing of a gearbox; None where it stands still or has no sensor.

    Parameters
    ----------
    state : Deflection
        Loaded state, whose stiffnesses count.
    """
    model, casing = state.model, state.model.casing
    sensors = sensor_rows(model)
    if casing is None or not len(sensors):
        return None
    assembly, _, slices = linear_system(state)
    loss = 1.0 + 2j * model.case.modes.damping_ratio
    stations = {*casing.stations, *casing.seat_stations.values()}
    places = np.array([6 * station + way for station in casing.stations for way in range(6)])
    parts = [part for part in _parts(state, assembly, slices) if not stations.isdisjoint(part[1])]
    onto = assembly.led[:, places].T
    forces = {name: np.zeros((len(places), assembly.count), complex) for name, *_ in parts}
    rigid = False
    for name, _, matrix, holds in parts:
        forces[name] -= loss * (onto @ matrix)
        rigid |= holds
    kept = [*forces, *([RIGID] if rigid else [])]
    blank = np.zeros((len(places), assembly.count), complex)
    mass, stiffness = _casing_alone(model, casing, assembly, places)
    still = np.isin(places, np.flatnonzero(assembly.held))
    free, _ = solved_conditions(rigid_foot_rows(casing, assembly.count)[:, places], still)
    return CasingPaths(
        tuple(kept),
        np.array([forces.get(name, blank) for name in kept]),
        places,
        mass,
        loss * stiffness,
        free,
        sensors[:, places],
        rigid,
    )


def _parts(
    state: Deflection, assembly: Assembly, stiffness: np.ndarray
) -> list[tuple[str, Sequence[int], np.ndarray, bool]]:
    """Springs and meshes: name, stations, stiffness matrix (6n, 6n), and whether some of it is rigid.

    ``stiffness`` (g,) is that of all slices of the meshes [N/m].
    """
    model, parts = state.model, []
    for springs, tangent in zip(model.bearings, state.bearing_stiffness, strict=True):
        rows = spread_rows(springs, assembly)
        finite = np.where(np.isfinite(tangent), tangent, 0.0)
        parts.append(
            (called("bearing", springs.name), springs.stations, rows.T @ finite @ rows, bool(np.isinf(tangent).any()))
        )
    for springs in model.joints:
        rows, holds = spread_rows(springs, assembly), np.isinf(springs.stiffness)
        matrix = (rows.T * np.where(holds, 0.0, springs.stiffness)) @ rows
        parts.append((springs.name, springs.stations, matrix, bool(holds.any())))
    for stage in model.stages:
        for mesh in stage.meshes:
            part = assembly.slices[mesh]
            columns = assembly.columns[:, part]
            matrix = (columns * stiffness[part]) @ columns.T
            parts.append((f"meshes of {stage.name}", assembly.contacts[mesh].stations, matrix, False))
    return parts


def _casing_alone(
    model: GearboxModel, casing: CasingModel, assembly: Assembly, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness (c, c) of the casing on the springs of its feet."""
    stations = {*casing.stations}
    alone = Assembly(
        assembly.names,
        assembly.places,
        assembly.held,
        tuple(inertia for inertia in assembly.inertias if stations.issuperset(inertia.stations)),
        tuple(beam for beam in model.assembly.beams if stations.issuperset(beam.stations)),
    )
    stiffness = alone.stiffness
    for springs, values in zip(casing.feet, casing.foot_stiffness, strict=True):
        rows = spread_rows(springs, assembly)
        stiffness = stiffness + (rows.T * np.where(np.isfinite(values), values, 0.0)) @ rows
    both = np.ix_(places, places)
    return alone.mass[both], stiffness[both]


def forces_on_casing(
    paths: CasingPaths, state: Deflection, stage: str, structured: StructuredStage, response: RunningResponse
) -> np.ndarray:
    """Two-sided forces (Q + 1, S, P, c) of all paths on the casing while a stage excites the gearbox [N, N m].

    Of what the stage is taken out of the structure with, its meshes and pins, the forces themselves count.
    """
    names, model = list(paths.names), state.model
    meshes, pins = f"meshes of {stage}", f"pins of {stage}"
    by_modes = np.einsum("pcn,nm->pcm", paths.forces, structured.motion)
    loss = 1.0 + 2j * model.case.modes.damping_ratio
    ringed = {f"meshes of {part.ring.stage.name}" for part in structured.rings}
    by_modes[[name in {meshes, pins, *ringed} for name in names]] = 0.0
    for part in structured.rings:
        if (name := f"meshes of {part.ring.stage.name}") in names:
            by_modes[names.index(name)] += loss * (model.assembly.led[:, paths.places].T @ part.force)
    size = len(names) * len(paths.places)
    forces = (response.modal @ by_modes.reshape(size, -1).T).reshape(*response.modal.shape[:2], len(names), -1)
    for part in structured.rings:
        # its coordinates are relative to the casing, whose acceleration its mass follows
        if (name := f"meshes of {part.ring.stage.name}") in names:
            coupling = (part.ring.mass_coupling(model.assembly) @ model.assembly.led)[:, paths.places]
            pushed = response.modal @ (coupling.T @ part.coordinates).T
            forces[:, :, names.index(name)] += response.frequency[..., None] ** 2 * pushed
    assembly, casing = model.assembly, model.casing
    assert casing is not None
    of_meshes = structured.of_meshes
    for station in {*casing.stations, *casing.seat_stations.values()}:
        waves = np.array([row_waves(row, structured.orbit, station, assembly.places) for row in structured.rows])
        if not waves.any():
            continue
        vectors = waves @ assembly.led[6 * station : 6 * station + 6][:, paths.places]
        for name, chosen in ((meshes, of_meshes), (pins, ~of_meshes)):
            if chosen.any() and name in names:
                part = np.where(chosen[:, None, None], vectors, 0.0)
                forces[:, :, names.index(name)] += forces_on_structure(structured.running, response, part)
    return forces
