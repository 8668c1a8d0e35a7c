"""Results of a multistage case: modes.nc, response.nc, balance.nc, and the tables of case and numbers.

Every variable of a file carries its units; complex amplitudes are stored as real and imaginary parts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import Finding
from femgear.gears.planetary import mesh_names
from femgear.report.tables import Block, describe_modes, first_speeds, tabulate
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import FOURIER, complex_entries, coordinates, mode_entries
from femgear.trains.multistage.case_file import MultistageCase, multistage_of, stage_warnings
from femgear.trains.multistage.model import (
    MultistageSet,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    speed_ratio,
    train_speeds,
    train_torques,
)

if TYPE_CHECKING:
    import xarray as xr

    from femgear.solvers.linear.receptance import MeshErrorResponse
    from femgear.system.system import Modes


@dataclass(frozen=True, eq=False)
class MultistageModes(StageResult):
    """Modes of the whole train.

    Parameters
    ----------
    data : MultistageSet
        The train.
    modes : Modes
        ``kind``: ``rigid``; ``rotational``, ``translational`` or ``planet`` where at least 99 % of the
        kinetic energy belongs to that class in all stages together; else ``mixed``. With equally spaced
        planets every mode is pure: rotational and translational modes reach over all stages, a planet mode
        stays in one (Kiracofe and Parker, J. Vib. Acoust. 129, 2007).
    share : (S, m) array
        Of every stage in the kinetic energy.
    strain : (S + 1, m) array
        Of every stage's meshes in the strain energy, and of everything else (supports, bearings, couplings)
        in the last row; zero for rigid motions.
    """

    data: MultistageSet
    modes: Modes
    share: np.ndarray
    strain: np.ndarray

    @property
    def stage(self) -> np.ndarray:
        """Stage (m,) with most of the kinetic energy, from 1."""
        return self.share.argmax(axis=0) + 1

    @property
    def labels(self) -> tuple[str, ...]:
        """Kind and stage of every mode, such as ``"planet, stage 2 (100 %)"``."""
        return tuple(
            f"{kind}, stage {stage} ({100.0 * share[stage - 1]:.0f} %)"
            for kind, stage, share in zip(self.modes.kind, self.stage.tolist(), self.share.T)
        )

    def contents(self) -> Contents:
        """Collect the contents of modes.nc."""
        modes = self.modes
        parts = [
            *(f"meshes of stage {n}" for n in range(1, len(self.share) + 1)),
            "supports, bearings and couplings",
        ]
        dofs, numbers = multistage_system(self.data).dofs, np.arange(1, len(modes.frequency) + 1)
        variables = mode_entries(modes) | {
            "main_stage": ("mode", self.stage, "1", "stage with most of the kinetic energy"),
            "energy": ("stage mode", self.share, "1", "share of the stage in the kinetic energy"),
            "strain": ("part mode", self.strain, "1", "share in the strain energy"),
            "shape": (
                "dof mode",
                modes.shape,
                "kg^-1/2",
                "mode shape of unit mass; rotations in kg^-1/2 m^-1",
            ),
            "mesh_deflection": ("mesh mode", modes.mesh_deflection, "kg^-1/2", "mesh deflection of the mode"),
            "mesh_stiffness": ("mesh", mean_mesh_stiffness(self.data), "N/m", "mean mesh stiffness"),
        }
        coords = _coordinates(self.data) | coordinates(mode=numbers, dof=dofs)
        coords["part"] = ("part", parts, "1", "part of the train")
        attrs = {"title": "modes of the train at rest, mean mesh stiffness", "unknowns": len(modes.shape)}
        return Contents(variables, coords, attrs)


@dataclass(frozen=True, eq=False)
class StagesResponseResult(StageResult):
    """Response of all meshes to the transmission errors of every stage.

    ``data`` is the train, ``speed`` (F,) that of its input [rad/s], ``answers`` are the responses by the number of the
    stage that excites.
    """

    data: MultistageSet
    speed: np.ndarray
    answers: dict[int, MeshErrorResponse]

    @property
    def forces(self) -> dict[str, np.ndarray]:
        """R.m.s. force (F, S) in sun-planet 1 of every stage [N], by the stage that excites."""
        first, squares = _first_meshes(self.data), {}
        for n, answer in self.answers.items():
            squares[f"meshes of stage {n}"] = 0.5 * (np.abs(answer.force[..., first]) ** 2).sum(axis=1)
        total = {"all stages": np.sqrt(sum(squares.values()))}
        return total | {text: np.sqrt(square) for text, square in squares.items()}

    def contents(self) -> Contents:
        """Collect the contents of response.nc."""
        answers, along = list(self.answers.values()), ("excited_by", "speed")
        total, *single = self.forces.values()
        words = "r.m.s. of the force in sun-planet 1 of every stage"
        hertz = [answer.mesh_frequency for answer in answers]
        variables = {
            "mesh_frequency": (along, hertz, "Hz", "mesh frequency of the stage that excites"),
            "first_force": ((*along, "stage"), single, "N", words),
            "total_force": (("speed", "stage"), total, "N", f"{words}, meshes of all stages"),
        }
        force = np.array([answer.force for answer in answers])
        lines = [("mesh_force", (*along, "harmonic", "mesh"), force, "N", "dynamic mesh force")]
        coords = _coordinates(self.data, self.speed) | {
            "excited_by": (("excited_by",), list(self.answers), "1", "stage whose meshes excite"),
            "harmonic": (("harmonic",), answers[0].harmonics, "1", "of the mesh frequency"),
        }
        attrs = {"title": "response to the transmission errors by modal summation"}
        attrs["fourier_convention"] = FOURIER
        return Contents(variables | complex_entries(lines), coords, attrs)


@dataclass(frozen=True, eq=False)
class BalanceResult(StageResult):
    """Mesh forces by harmonic balance with k(t) of all meshes.

    Parameters
    ----------
    data : MultistageSet
        The train.
    speed : (F,) array
        Speeds of its input [rad/s].
    orders : (lines, S) int array
        Multiples of the mesh frequencies; the first line is the mean.
    force : (F, meshes, lines) complex array
        [N]
    found : (F,) bool array
        Whether the balance converged.
    """

    data: MultistageSet
    speed: np.ndarray
    orders: np.ndarray
    force: np.ndarray
    found: np.ndarray

    @property
    def forces(self) -> np.ndarray:
        """R.m.s. force (F, S) in sun-planet 1 of every stage [N]; NaN where not converged."""
        squares = np.abs(self.force[:, _first_meshes(self.data), 1:]) ** 2
        return np.where(self.found[:, None], np.sqrt(0.5 * squares.sum(axis=2)), np.nan)

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.found))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return f"harmonic balance, {int(self.found.sum())} of {len(self.found)} speeds converged"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what balance.nc says against itself, see `balance_warnings`."""
        return balance_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of balance.nc."""
        words = "r.m.s. of the force in sun-planet 1 of every stage"
        variables = {
            "orders": (("line", "stage"), self.orders, "1", "multiples of the mesh frequency of the stage"),
            "converged": (("speed",), self.found, "1", "whether harmonic balance found a solution"),
            "total_force": (("speed", "stage"), self.forces, "N", words),
        }
        lines = [("mesh_force", ("speed", "mesh", "line"), self.force, "N", "mesh force")]
        attrs = {"title": "response with the mesh stiffnesses k(t) by harmonic balance"}
        return Contents(variables | complex_entries(lines), _coordinates(self.data, self.speed), attrs)


def _first_meshes(data: MultistageSet) -> list[int]:
    """Columns of sun-planet 1 of every stage."""
    return [int(columns[0]) for columns in mesh_columns(data)]


def _coordinates(data: MultistageSet, speed=None) -> dict[str, tuple]:
    """Stages, meshes, and speeds of the input where there are some."""
    names = [f"stage {n} {name}" for n, stage in enumerate(data.stages, 1) for name in mesh_names(stage.data.n_planets)]
    coordinates_ = {**coordinates(mesh=names), "stage": ("stage", range(1, len(data.stages) + 1), "1", "stage")}
    return coordinates_ if speed is None else coordinates_ | coordinates(speed=speed / RPM)


def describe_multistage(case: MultistageCase) -> tuple[Block, ...]:
    """Tabulate stages with speeds and torques, and couplings of a case."""
    train = multistage_of(case)
    header = ["stage", "teeth", "planets", "fixed", "sun-planet [N/m]", "planet-ring [N/m]"]
    rows = []
    for n, stage in enumerate(train.stages, 1):
        teeth, k = "/".join(map(str, stage.teeth or ())), stage.data.mesh_stiffness[[0, -1]]
        fixed = stage.fixed or "none"
        rows.append([str(n), teeth or "-", str(stage.data.n_planets), fixed, f"{k[0]:.4g}", f"{k[1]:.4g}"])
    notes: tuple[str, ...] = ()
    if case.operation is not None:
        speeds = train_speeds(train, case.operation.speed)
        torques = train_torques(train, case.operation.torque)
        header += ["sun [rpm]", "carrier [rpm]", "mesh [Hz]", "sun [N m]", "carrier [N m]"]
        numbers = speeds.sun / RPM, speeds.carrier / RPM, speeds.mesh_frequency, torques.sun, torques.carrier
        for row, values in zip(rows, zip(*numbers)):
            row += [f"{value:.3f}" for value in values[:3]] + [f"{value:.6g}" for value in values[3:]]
        power = 1e-3 * case.operation.torque * case.operation.speed
        notes = (
            f"from {train.input} to {train.output}: ratio {speed_ratio(train):.6g}, {power:.4g} kW, output "
            f"torque {torques.output:.6g} N m",
        )
    couplings = {
        "from": lambda coupling: str(coupling.first),
        "to": lambda coupling: str(coupling.second),
        "torsional [N m/rad]": lambda coupling: f"{coupling.torsional:.4g}",
        "lateral [N/m]": lambda coupling: f"{coupling.lateral:.4g}",
    }
    return (
        Block("Stages", tuple(header), tuple(map(tuple, rows)), notes),
        tabulate("Couplings", train.couplings, couplings),
    )


def multistage_warnings(case: MultistageCase) -> Iterator[Finding]:
    """List what is allowed but deserves a look."""
    yield from stage_warnings(case)
    response = case.response
    if response is not None and (case.operation is None or not case.geared):
        text = "without operation, or gears of every stage, there are modes alone"
        yield Finding("W-RESPONSE", "response", text)


def describe_stage_modes(data: xr.Dataset) -> Block:
    """Tabulate the first modes of modes.nc, with the stage in which each one lives."""
    columns = {
        "stage": lambda mode: str(int(mode.main_stage)),
        "its energy [%]": lambda mode: f"{100.0 * float(mode.energy.max()):.0f}",
    }
    return describe_modes(data, columns, note="; stage: with most of the kinetic energy")


def describe_forces(data: xr.Dataset, title: str) -> Block:
    """Tabulate the largest r.m.s. force in sun-planet 1 of every stage, of response.nc or balance.nc."""
    force = np.nan_to_num(data["total_force"].values)
    largest = data["speed"].values[force.argmax(axis=0)]
    columns = {
        "stage": lambda n: str(data["stage"].values[n]),
        "largest force in sun-planet 1 [N r.m.s.]": lambda n: f"{force[:, n].max():.4g}",
        "at [rpm]": lambda n: f"{largest[n]:.6g}",
    }
    count = f"{data.sizes['speed']} speeds of the input"
    if "converged" in data:
        count += f", {int(data['converged'].sum())} converged"
    return tabulate(title, range(data.sizes["stage"]), columns, (count,))


def balance_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what harmonic balance says against balance.nc."""
    lost = data["speed"].values[~data["converged"].values.astype(bool)]
    if len(lost):
        text = f"harmonic balance did not converge at {len(lost)} speeds: {first_speeds(lost)}"
        yield Finding("W-BALANCE", "", text)
