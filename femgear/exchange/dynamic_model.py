"""The vibration of a train as other programs take it: its modes, and what its meshes do over the angle.

A train makes a `DynamicModel` of its modes. `write_state_space` writes matrices and tables, `femgear.exchange.fmu` a
unit for co-simulation, `write_stiffness_table` the mesh stiffness alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.state_space import ModalModel, state_space
from femgear.storage.files import replaced_file, write_csv
from femgear.system.fourier import harmonics_of, sample
from femgear.system.system import MeshExcitation, freeze

HARMONICS = 100
"""Mesh harmonics in tables, unless another number is asked for."""
POINTS = 64
"""Points of a table for each of its harmonics: a cubic through four of them is right to 2e-6 of the highest one."""


ENDINGS = {"--state-space": (".npz", ".mat"), "--fmu": (".fmu",), "--stiffness-table": (".csv", ".mat", ".npz")}
"""Endings of files by the option of ``femgear export`` that names them."""


@dataclass(frozen=True)
class RingSensor:
    """A sensor on a ring that stands while the frame of the model turns with the carrier.

    Its displacement is ``sum_n a_n cos(n phi) + b_n sin(n phi)`` with ``phi`` its angle less that of the carrier.

    Parameters
    ----------
    angle : float
        On the ring, where the frame is at the beginning [rad].
    first : int
        Number of the output of the model that is a_0, before a_1, b_1, a_2 and so on, the last ones.
    diameters : int
        Largest n.
    carrier : float
        Angle of the carrier per radian of the input, negative where both turn in opposite senses.
    """

    angle: float
    first: int
    diameters: int
    carrier: float


@dataclass(frozen=True)
class DynamicModel:
    """Vibration of a train about its loaded state.

    Parameters
    ----------
    title : str
    modal : ModalModel
        Modes, inputs and outputs; the friction of flanks has the last inputs.
    excitation : MeshExcitation
        Stiffness, deflection and force of every mesh as time goes on.
    speed : float
        Of the input [rad/s], counter-clockwise.
    mesh_rate : float
        Mesh periods per radian of the input [1/rad].
    driver : int
        Number of the output of the model that is the rotation of the input.
    separates : bool
        Whether the model of the train lets flanks part.
    sensor : RingSensor, optional
    mesh_ratio, mesh_ahead : (M,) arrays, optional
        Mesh periods of every mesh over those of the first one, by default 1, and by how many of its own periods a mesh
        is ahead of these, by default none.
    """

    title: str
    modal: ModalModel
    excitation: MeshExcitation
    speed: float
    mesh_rate: float
    driver: int
    separates: bool = False
    sensor: RingSensor | None = None
    mesh_ratio: np.ndarray | None = None
    mesh_ahead: np.ndarray | None = None

    @property
    def phases(self) -> tuple[np.ndarray, np.ndarray]:
        """Ratio and lead (M,) of every mesh, see `mesh_ratio` and `mesh_ahead`."""
        count = len(self.modal.meshes)
        ratio = np.ones(count) if self.mesh_ratio is None else self.mesh_ratio
        return ratio, np.zeros(count) if self.mesh_ahead is None else self.mesh_ahead

    @property
    def ratios(self) -> np.ndarray:
        """Outputs (p,) per radian of the input as all turns without strain; zero of a train that is held."""
        rigid = self.modal.output_rows[:, self.modal.omega == 0.0]
        driver = rigid[self.driver]
        return rigid @ driver / (driver @ driver) if driver.any() else np.zeros(len(rigid))


@dataclass(frozen=True)
class MeshTables:
    """What meshes do over the period of the excitation, at equidistant positions (P,), the end left out.

    ``f = force + stiffness (x - deflection)`` is the force of a mesh with the deflection x.

    Parameters
    ----------
    phase : (P,) array
        [mesh periods]
    stiffness, deflection, force : (M, P) arrays
        [N/m], [m], [N]
    friction : (s, P) array
        Values of the last inputs of the model, those of friction [N, N m].
    """

    phase: np.ndarray
    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    friction: np.ndarray

    def __post_init__(self):
        freeze(self)


def mesh_tables(model: DynamicModel, harmonics: int = HARMONICS) -> MeshTables:
    """Tabulate the meshes by so many mesh harmonics, fewer where the record of the case has not as many.

    CaseError: not one harmonic or more (E-HARMONICS).
    """
    if harmonics < 1:
        raise CaseError("a table needs harmonics", code="E-HARMONICS", key="--harmonics", value=harmonics, limit=">= 1")
    excitation = model.excitation
    count = min(harmonics * excitation.periods, (excitation.stiffness.shape[1] - 1) // 2)
    friction = np.zeros((0, excitation.stiffness.shape[1])) if excitation.source is None else excitation.source
    values = (excitation.stiffness, excitation.deflection, excitation.force, friction)
    tables = (sample(harmonics_of(record, count), POINTS * count) for record in values)
    return MeshTables(np.arange(POINTS * count) * excitation.periods / (POINTS * count), *tables)


def table_harmonics(model: DynamicModel, harmonics: int) -> int:
    """Count the mesh harmonics of the tables of a model of which so many are wanted: no more than its record has."""
    excitation = model.excitation
    return min(harmonics, (excitation.stiffness.shape[1] - 1) // 2 // excitation.periods)


def write_state_space(model: DynamicModel, path: Path, *, harmonics: int = HARMONICS) -> None:
    """Write matrices and tables of a model as arrays of NumPy (.npz) or MATLAB (.mat), by the ending of the name.

    CaseError: another ending (E-CHOICE). StorageError: a file that cannot be written.
    """
    check_ending(path, "--state-space")
    space, tables, modal = state_space(model.modal), mesh_tables(model, harmonics), model.modal
    arrays: dict[str, Any] = {name: getattr(space, name) for name in "ABCD"}
    arrays |= {"state": space.states, "input": space.inputs, "output": space.outputs}
    arrays |= {"state_unit": space.state_units, "input_unit": space.input_units, "output_unit": space.output_units}
    arrays |= {"nominal": space.nominal, "mesh": modal.meshes, "mesh_stiffness": modal.mesh_stiffness}
    arrays |= {"phase": tables.phase, "angle": tables.phase / model.mesh_rate, "stiffness": tables.stiffness}
    arrays |= dict(zip(("mesh_ratio", "mesh_ahead"), model.phases, strict=True))
    arrays |= {"deflection": tables.deflection, "force": tables.force, "friction": tables.friction}
    arrays |= {"backlash": model.excitation.backlash, "natural_frequency": modal.omega / (2.0 * np.pi)}
    arrays |= {"damping_ratio": modal.damping_ratio, "speed": model.speed, "mesh_rate": model.mesh_rate}
    write_arrays({"title": model.title} | arrays, path)


def write_arrays(arrays: Mapping[str, Any], path: Path) -> None:
    """Write arrays, numbers and texts by name as .npz or .mat."""
    with replaced_file(path, size=sum(np.asarray(value).nbytes for value in arrays.values())) as temporary:
        if path.suffix == ".npz":
            named: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
            np.savez(temporary, **named)
        else:
            from scipy.io import savemat

            cells = {name: np.array(v, object) if isinstance(v, tuple) else v for name, v in arrays.items()}
            savemat(temporary, cells, appendmat=False, long_field_names=True, oned_as="column")


def check_ending(path: Path, option: str) -> None:
    """Refuse a file whose ending is none of the formats of an option of ``femgear export`` (E-CHOICE)."""
    if path.suffix not in ENDINGS[option]:
        limit = f"a name that ends in {', '.join(ENDINGS[option])}"
        raise CaseError("no such format", code="E-CHOICE", key=option, value=path.name, limit=limit)


@dataclass(frozen=True)
class StiffnessTable:
    """Mesh stiffness over the angle of the gear that drives, both ends of the period included.

    Parameters
    ----------
    angle : (P + 1,) array
        Of gear 1, or of the sun against the carrier [rad].
    meshes : tuple of str
    stiffness, deflection : (M, P + 1) arrays
        Along the line of action [N/m], and static transmission error [m].
    """

    angle: np.ndarray
    meshes: tuple[str, ...]
    stiffness: np.ndarray
    deflection: np.ndarray

    def __post_init__(self):
        freeze(self)


def write_stiffness_table(table: StiffnessTable, path: Path) -> None:
    """Write k(theta) of all meshes as text in columns (.csv), or as arrays for MATLAB (.mat) and NumPy (.npz).

    CaseError: another ending (E-CHOICE). StorageError: a file that cannot be written.
    """
    check_ending(path, "--stiffness-table")
    if path.suffix == ".csv":
        header = ["angle [rad]", *(f"stiffness of {mesh} [N/m]" for mesh in table.meshes)]
        header += [f"transmission error of {mesh} [m]" for mesh in table.meshes]
        rows = np.column_stack([table.angle, table.stiffness.T, table.deflection.T])
        write_csv(path, header, ([float(value) for value in row] for row in rows))
        return
    units = {"angle_unit": "rad", "stiffness_unit": "N/m", "transmission_error_unit": "m"}
    arrays = {"angle": table.angle, "mesh": table.meshes, "stiffness": table.stiffness}
    write_arrays(arrays | {"transmission_error": table.deflection} | units, path)
