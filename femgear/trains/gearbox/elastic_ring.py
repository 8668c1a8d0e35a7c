"""Elastic rings of planetary stages in the modes and in the response of a gearbox.

The ring is that of the train of its teeth: cyclic modes on the foundation, with the springs of its meshes and the
compliance of the bodies between them at the loaded state. In modes its coordinates join those of the gearbox; in the
response planets run around in its waves (`femgear.housing.two_way.running_ring`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.fe.beam import rigid_link
from femgear.housing.two_way.running_ring import RunningRing
from femgear.system.assembly import GROUND, Assembly, with_modal_body
from femgear.system.system import MechanicalSystem, MeshExcitation
from femgear.trains.gearbox.case_file import BoxPlanetarySection, stage_case_of
from femgear.trains.gearbox.contact import loaded_tables
from femgear.trains.gearbox.friction import rubbing_tables
from femgear.trains.gearbox.model import GearboxModel, StageModel
from femgear.trains.gearbox.sensors import BoxSensor
from femgear.trains.registry import train_of


@dataclass(frozen=True)
class ElasticRing:
    """The ring of a stage as modal coordinates, a cosine and a sine for each nodal diameter n above zero.

    Parameters
    ----------
    name : str
        Of the ring.
    stage : StageModel
        Whose ring it is.
    stiffness : (m,) array
        Squares of the natural circular frequencies of its modes [1/s^2].
    diameter : (m,) int array
        Nodal diameter n of every coordinate.
    approach : (m, 2N) array
        Approach of the flanks of every mesh per unit of a mode, planets at the standing carrier [kg^-1/2].
    wave : (m,) complex array
        V of the approach ``Re V exp(i n phi)`` of the flanks at a planet at angle phi [kg^-1/2].
    sliding : (m, 2) complex array
        The same of sliding along the tangent, and of turning, on which friction works [kg^-1/2, rad m^-1 kg^-1/2]; zero
        without friction.
    surface : (m, 2) complex array
        The same of radial (outwards) and tangential displacement of the outer surface at an angle phi [kg^-1/2].
    participation : (m, 3) array
        Mass times displacement along x and y [kg^1/2], and about z [m kg^1/2]: what pushes the modes where the seat
        of the ring is accelerated.
    excitation : MeshExcitation
        Of the meshes without what ring and bodies give way.
    flexibility : (2N, 2N) array
        Compliance of the bodies between the meshes [m/N].
    """

    name: str
    stage: StageModel
    stiffness: np.ndarray
    diameter: np.ndarray
    approach: np.ndarray
    wave: np.ndarray
    sliding: np.ndarray
    surface: np.ndarray
    participation: np.ndarray
    excitation: MeshExcitation
    flexibility: np.ndarray

    @property
    def springs(self) -> np.ndarray:
        """Mean stiffness (2N,) of the meshes [N/m]."""
        return self.excitation.stiffness.mean(axis=1)

    @property
    def moves(self) -> bool:
        """Whether its seat moves, with the casing."""
        return self.stage.members[2] != GROUND

    def part(self, chosen: np.ndarray) -> ElasticRing:
        """Take some of the coordinates (m,)."""
        arrays = "stiffness", "diameter", "approach", "wave", "sliding", "surface", "participation"
        return replace(self, **{name: getattr(self, name)[chosen] for name in arrays})

    @property
    def with_structure(self) -> ElasticRing:
        """Coordinates that the motion of the seat pushes: those of no and one nodal diameter of a ring that moves."""
        return self.part((self.diameter <= 1) & self.moves)

    def running(self, loss: float) -> RunningRing:
        """Waves of the coordinates that are not with the structure, one for a cosine and its sine; loss factor [1]."""
        alone = self.part((self.diameter > 1) | (not self.moves))
        first = np.append(True, (np.diff(alone.stiffness) != 0.0) | (np.diff(alone.diameter) != 0))
        scale = np.where(alone.diameter > 0, np.sqrt(0.5), 1.0)[first]
        return RunningRing(
            np.sqrt(alone.stiffness[first]),
            alone.diameter[first],
            scale * alone.wave[first],
            scale[:, None] * alone.surface[first],
            loss,
            (scale[:, None] * alone.sliding[first]).T,
        )

    def mass_coupling(self, assembly: Assembly) -> np.ndarray:
        """Mass (m, 6n) between the coordinates and all motions, of which those of its seat count [kg^1/2, m kg^1/2]."""
        station, rows = self.stage.members[2], np.zeros((3, assembly.count))
        if self.moves:
            offset = stage_centre(self.stage, assembly.places) - assembly.places[station]
            rows[:, 6 * station : 6 * station + 6] = rigid_link(offset)[[0, 1, 5]]
        return self.participation @ rows

    def sensor_rows(self, sensors: Sequence[BoxSensor]) -> np.ndarray:
        """Displacements (s, m) of sensors beyond those of the seat by the coordinates; zero of those elsewhere."""
        rows = np.zeros((len(sensors), len(self.stiffness)))
        for row, sensor in zip(rows, sensors, strict=True):
            if sensor.ring == self.stage.name:
                row[:] = np.real(self.surface @ sensor.on_ring * np.exp(1j * self.diameter * sensor.angle))
        return rows


def elastic_rings(model: GearboxModel, *, steps: Steps | None = None, friction: bool = True) -> tuple[ElasticRing, ...]:
    """Compute the elastic rings of all stages that have one, at the torque of the load case.

    Without ``friction`` that of their teeth excites nothing. FemgearError: what the modes of the set of their teeth are
    refused for.
    """
    steps, stages = steps or Steps(), [stage for stage in model.stages if has_elastic_ring(stage)]
    return tuple(elastic_ring(model, stage, steps=steps, friction=friction) for stage in stages)


def has_elastic_ring(stage: StageModel) -> bool:
    """Tell whether the ring of a stage is elastic."""
    return isinstance(stage.section, BoxPlanetarySection) and stage.section.elastic_ring


def elastic_ring(
    model: GearboxModel, stage: StageModel, *, steps: Steps | None = None, friction: bool = True
) -> ElasticRing:
    """Compute the elastic ring of a stage, as `elastic_rings`.

    Its modes reach as far as the excitation of its teeth does, or of the gearbox where the teeth say nothing.
    """
    section, steps = stage.section, steps or Steps()
    assert isinstance(section, BoxPlanetarySection)
    tables = loaded_tables(section, -model.flow.first_torque(section), 0)
    tables.setdefault("dynamics", {}).setdefault("up_to", f"{model.case.dynamics.up_to:.15g} Hz")
    tables = rubbing_tables(model, stage, tables)
    solved = _set_modes(stage_case_of(case_text.write(tables)), steps)
    model_of_set, springs = solved.model, (len(stage.meshes),) * 2
    excitation = solved.excitation if friction or solved.frictionless is None else solved.frictionless
    flexibility = model_of_set.system.flexibility
    mode, sine = model_of_set.ring_mode, model_of_set.ring_phase == 1
    ring, modes = solved.ring, solved.ring.modes
    diameter = modes.nodal_diameter[mode]
    # angles of the teeth count from their own axis
    turned = np.exp(-1j * diameter * (stage.angles[0] - stage.sizes.planet_angles[0]))
    factor = modes.norm[mode] * np.where(sine, -1j, 1.0) * turned
    # along the normal the approach is cos(beta_b) of that in the transverse section, the force 1/cos(beta_b) of it
    cosine = math.cos(stage.sizes.base_helix)
    # flanks approach where the ring does not give way
    pushed = -factor[:, None] * modes.load[mode] * np.exp(1j * diameter * ring.load_angle)[:, None]
    sliding = pushed[:, 1:] if pushed.shape[1] > 1 else np.zeros((len(diameter), 2), complex)
    return ElasticRing(
        f"ring of {stage.name}",
        stage,
        np.diag(model_of_set.system.K)[model_of_set.ring_slice],
        diameter,
        cosine * model_of_set.system.W[model_of_set.ring_slice],
        cosine * pushed[:, 0],
        sliding,
        factor[:, None] * modes.output[mode],
        _participation(diameter, factor.conj() * ring.participation[mode], modes.count),
        _on_meshes(excitation).along_normal(cosine),
        np.zeros(springs) if flexibility is None else cosine**2 * flexibility,
    )


def _on_meshes(excitation: MeshExcitation) -> MeshExcitation:
    """Leave out the last source, which takes the mean of what friction loses: means are those of the statics."""
    return excitation if excitation.source is None else replace(excitation, source=excitation.source[:-1])


def _set_modes(case: Any, steps: Steps) -> Any:
    """Modes of the set that teeth alone make, solved once for modes, response and run-up of the gearbox."""
    options = {"teeth": case.source}
    if (kept := steps.kept("set of an elastic ring", options)) is not None:
        return kept
    train = train_of(case)
    static, modes = train.stage("static"), train.stage("modes")
    assert static is not None and modes is not None
    solved = modes.solve(case, static.solve(case, steps=steps), steps=steps)
    return steps.keep("set of an elastic ring", options, solved)


def _participation(diameter: np.ndarray, moved: np.ndarray, sectors: int) -> np.ndarray:
    """Participation (m, 3) of coordinates from what `RingModel` has of a sector (m,)."""
    participation = np.zeros((len(diameter), 3))
    participation[:, 2] = np.where(diameter == 0, sectors * np.real(moved), 0.0)
    participation[:, :2] = np.where(diameter == 1, 0.5 * sectors * np.array([np.real(moved), np.imag(moved)]), 0.0).T
    return participation


def with_rings(
    system: MechanicalSystem,
    stiffness: np.ndarray,
    assembly: Assembly,
    slices: Mapping[int, slice],
    rings: Sequence[ElasticRing],
) -> tuple[MechanicalSystem, np.ndarray]:
    """Join the coordinates of elastic rings to a system, and their springs to the stiffness (g,) of all slices [N/m].

    The slices of a mesh share what its ring and the bodies give way. A ring whose seat moves with the casing has
    coordinates relative to it: its mass, which belongs to the casing, couples both.

    Parameters
    ----------
    system : MechanicalSystem
        Of the assembly.
    stiffness : (g,) array
        Of all slices of the meshes that it has [N/m].
    assembly : Assembly
        Stations of the system.
    slices : mapping of int to slice
        Of these slices those of every mesh, by its number in the model; none of meshes that the system has not.
    rings : sequence of ElasticRing
    """
    if not rings:
        return system, stiffness
    stiffness, count = stiffness.copy(), len(system.dofs)
    flexibility = np.zeros((len(stiffness), len(stiffness)))
    rows, coupling = [], []
    for ring in rings:
        approach = np.zeros((len(ring.stiffness), len(stiffness)))
        for place, mesh in enumerate(ring.stage.meshes):
            if mesh not in slices:
                continue
            part = slices[mesh]
            approach[:, part] = ring.approach[:, [place]]
            share = stiffness[part] / stiffness[part].sum()
            stiffness[part] = ring.springs[place] * share
            for other, mate in enumerate(ring.stage.meshes):
                flexibility[part, slices[mate]] = ring.flexibility[place, other]
        rows.append(approach)
        coupling.append(ring.mass_coupling(assembly) @ assembly.motions)
    names = [f"{ring.name}: mode {i + 1}" for ring in rings for i in range(len(ring.stiffness))]
    squares = np.concatenate([ring.stiffness for ring in rings])
    joined = with_modal_body(system, squares, np.vstack(rows), names)
    mass = joined.M.copy()
    mass[count:, :count] = np.vstack(coupling)
    mass[:count, count:] = mass[count:, :count].T
    return replace(joined, M=mass, flexibility=flexibility if flexibility.any() else None), stiffness


def stage_centre(stage: StageModel, places: np.ndarray) -> np.ndarray:
    """Find the middle (3,) of a planetary set among the places (n, 3) of all stations [m]."""
    angle = stage.angles[0]
    out = np.array([math.cos(angle), math.sin(angle), 0.0])
    return places[stage.planets[0]] - stage.sizes.centre_distance * out
