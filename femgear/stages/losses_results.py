"""Stage "losses": losses.nc, its tables and its row of the verdict, for pairs, sets and gearboxes alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM, Dimension
from femgear.findings import DOUBT, Finding
from femgear.gears.power_losses import LossyFlow, basic_efficiency
from femgear.report.tables import Block, Marks, tabulate
from femgear.stages.key_figures import NUMBER, KeyFigure, Stored
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import as_written, declared

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.lubrication import LossesSection

POWER = Dimension("a power", "W", "W", 1.0)
LOSS_FIGURES = (
    KeyFigure("efficiency", NUMBER, "losses", Stored("efficiency", pick="smallest"), whole=True),
    KeyFigure("losses", POWER, "losses", Stored("loss"), whole=True),
)
"""Key figures of all trains with losses: the worst of all operating points."""
_SHOWN = 12
"""Operating points in a table, at most."""
LOSS_VARIABLES = {
    "friction_coefficient": ("{} mesh", "1", "coefficient of friction of the teeth"),
    "loss_factor": ("{} mesh", "1", "loss factor H_V of the computed tooth loads"),
    "rigid_loss_factor": ("mesh", "1", "loss factor H_V with equal loads on all lines of contact"),
    "closed_loss_factor": ("mesh", "1", "that of the closed form of ISO/TR 14179-2; NaN where it does not hold"),
    "mesh_loss": ("{} mesh", "W", "loss of the mesh by friction of its teeth"),
    "mesh_power": ("{} stage", "W", "power that rolls through the teeth of the stage, against its carrier"),
    "stage_efficiency": ("{} stage", "1", "efficiency of the stage with its carrier held, the product of its meshes"),
    "seal_loss": ("{} seal", "W", "loss of the shaft seal"),
    "bearing_loss": ("{} bearing", "W", "loss of the bearing; NaN where nothing tells its friction"),
    "input_power": ("{}", "W", "power that enters"),
    "output_power": ("{}", "W", "power that leaves"),
    "loss": ("{}", "W", "all losses"),
    "efficiency": (
        "{}",
        "1",
        "power that leaves over power that enters; NaN where given meshes pass it on",
    ),
    "power_imbalance": ("{}", "1", "power that enters less output and losses, over what enters"),
    "lossy_torque": ("{} shaft", "N m", "torque from outside on the shaft with losses"),
    "efficiency_map": ("torque_share speed_share", "1", "efficiency over shares of torque and speed of operation"),
}
"""Variables of losses.nc: dimensions, of which {} is that of the operating points, unit and text."""


@dataclass(frozen=True)
class MeshFriction:
    """Friction and loss factors of the M meshes of a stage.

    Parameters
    ----------
    coefficient : (M,) array
        Coefficient of friction.
    factor, rigid, closed : (M,) arrays
        Loss factor H_V of the computed loads, of equal loads on all lines of contact, and of the closed form.
    force : (M,) array
        Mean force along the line of action in the transverse section [N].
    passed : tuple of float
        Efficiency of every kind of mesh, the meshes of a kind in proportion to their forces.
    """

    coefficient: np.ndarray
    factor: np.ndarray
    rigid: np.ndarray
    closed: np.ndarray
    force: np.ndarray
    passed: tuple[float, ...]


@dataclass(frozen=True)
class LossPoint:
    """Losses at one operating point.

    Parameters
    ----------
    flow : LossyFlow
        Torques and powers.
    friction : mapping
        By stage.
    mesh_loss : mapping
        By stage: losses of its meshes (M,) [W].
    bearing_loss : mapping
        By bearing [W]; NaN where nothing tells its friction.
    seal_loss : mapping
        By seal [W].
    unknown : tuple of str
        Stages that pass power on through meshes of given stiffness, whose losses nothing tells.
    """

    flow: LossyFlow
    friction: Mapping[str, MeshFriction]
    mesh_loss: Mapping[str, np.ndarray]
    bearing_loss: Mapping[str, float]
    seal_loss: Mapping[str, float] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()

    @property
    def efficiency(self) -> float:
        """Power that leaves over power that enters; NaN where none enters, or losses of meshes are unknown."""
        return math.nan if self.unknown else self.flow.efficiency

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages whose teeth are computed."""
        return tuple(self.friction)


@dataclass(frozen=True, eq=False)
class LossesResult(StageResult):
    """Losses of all operating points.

    Parameters
    ----------
    points : tuple of LossPoint
        Losses.
    meshes : mapping of str to sequence of str
        Names of the meshes by stage, in the order of their losses.
    dim : str
        ``"speed"`` or ``"load_case"``.
    labels : array or sequence of str
        Speeds of the input [rad/s], or names of the load cases.
    section : LossesSection
        How losses were found, with the shares of the map.
    efficiency_map : (torques, speeds) array
        Of the map.
    missing : tuple of str
        What was left out, in words.
    """

    points: tuple[LossPoint, ...]
    meshes: Mapping[str, Sequence[str]]
    dim: str
    labels: Any
    section: LossesSection
    efficiency_map: np.ndarray
    missing: tuple[str, ...]

    @property
    def parts(self) -> tuple[str, ...]:
        """What losses are of: teeth, and bearings and seals as far as something tells theirs."""
        first = self.points[0]
        bearings = any(math.isfinite(loss) for loss in first.bearing_loss.values())
        teeth = ("teeth",) if self.points[0].friction else ()
        return (*teeth, *(("bearings",) if bearings else ()), *(("seals",) if first.seal_loss else ()))

    @property
    def residual(self) -> float:
        """Largest power out of balance, relative."""
        return max((abs(point.flow.imbalance) for point in self.points), default=math.nan)

    @property
    def message(self) -> str:
        """How torques with losses were found."""
        return "balance of all shafts with losses, directions of power found in turn; loads of the teeth without them"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what losses.nc says against itself."""
        return loss_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of losses.nc."""
        points, first, stages = self.points, self.points[0], self.points[0].stages
        each = {
            name: [_joined(getattr(point.friction[stage], name) for stage in stages) for point in points]
            for name in ("coefficient", "factor", "rigid", "closed")
        }
        shafts = [*first.flow.torque]
        flows = [point.flow for point in points]
        values: dict[str, Any] = {
            "friction_coefficient": each["coefficient"],
            "loss_factor": each["factor"],
            "rigid_loss_factor": each["rigid"][0],
            "closed_loss_factor": each["closed"][0],
            "mesh_loss": [_joined(point.mesh_loss[stage] for stage in stages) for point in points],
            "mesh_power": [[flow.rolling_power[stage] for stage in stages] for flow in flows],
            "stage_efficiency": [
                [basic_efficiency(point.friction[stage].passed) for stage in stages] for point in points
            ],
            "power_imbalance": [flow.imbalance for flow in flows],
            "input_power": [flow.input_power for flow in flows],
            "efficiency": [point.efficiency for point in points],
        }
        unknown_is_nan = np.array([math.nan if point.unknown else 1.0 for point in points])
        values["lossy_torque"] = unknown_is_nan[:, None] * [[flow.torque[shaft] for shaft in shafts] for flow in flows]
        values |= {name: unknown_is_nan * [getattr(flow, name) for flow in flows] for name in ("output_power", "loss")}
        bearings = [*first.bearing_loss]
        coords: dict[str, tuple] = {
            "mesh": ("mesh", [name for stage in stages for name in self.meshes[stage]], "1", "gear mesh"),
            "stage": ("stage", list(stages), "1", "stage"),
            "shaft": ("shaft", shafts, "1", "shaft"),
        }
        if self.dim == "speed":
            coords["speed"] = ("speed", as_written(np.asarray(self.labels) / RPM), "rpm", "speed of the input")
        else:
            coords[self.dim] = (self.dim, list(self.labels), "1", "load case")
        if bearings:
            values["bearing_loss"] = [[point.bearing_loss[name] for name in bearings] for point in points]
            coords["bearing"] = ("bearing", bearings, "1", "bearing")
        if seals := [*first.seal_loss]:
            values["seal_loss"] = [[point.seal_loss[name] for name in seals] for point in points]
            coords["seal"] = ("seal", seals, "1", "shaft seal")
        if self.efficiency_map.size:
            values["efficiency_map"] = self.efficiency_map
            for name in ("torque", "speed"):
                shares = list(getattr(self.section, f"{name}_shares"))
                coords[f"{name}_share"] = (f"{name}_share", shares, "1", f"share of the {name} of operation")
        texts = {name: (dims.format(self.dim), unit, text) for name, (dims, unit, text) in LOSS_VARIABLES.items()}
        attrs = {
            "title": "losses and efficiency",
            "friction": self.section.friction,
            "missing": " | ".join(self.missing),
            "contains": ", ".join(self.parts),
            "unknown": ", ".join(dict.fromkeys(name for point in points for name in point.unknown)),
        }
        return Contents(declared(texts, {name: np.asarray(value) for name, value in values.items()}), coords, attrs)


def _joined(parts: Iterable[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *parts])


def loss_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what was left out of the losses, and where these lock."""
    for text in filter(None, str(data.attrs["missing"]).split(" | ")):
        yield Finding("W-LOSSES", "losses", text)
    values = np.asarray(data["efficiency"].values, float)
    if (locked := np.flatnonzero(values <= 0.0)).size:
        text = f"all power is lost at {_label(data, int(locked[0]))}: losses lock what the torque would turn"
        yield Finding("W-LOSSES", "losses.friction", text, severity=DOUBT, remedy="drive it from its other side")


def point_dim(data: Any) -> str:
    """Find the dimension of the operating points of losses.nc."""
    return data["efficiency"].dims[0]


def point_label(data: Any, dim: str, number: int) -> str:
    """Write an operating point, a speed or a load case, by its number along its dimension."""
    value = data[dim].values[number]
    return f"{float(value):.6g} rpm" if dim == "speed" else str(value)


def _label(data: Any, number: int) -> str:
    return point_label(data, point_dim(data), number)


def describe_losses(data: Any) -> Block:
    """Tabulate powers, losses and efficiency of the operating points of losses.nc."""
    dim, count = point_dim(data), len(data["efficiency"].values)

    def watts(name: str, number: int) -> str:
        values = np.asarray(data[name].values[number], float)
        finite = values[np.isfinite(values)]
        return f"{finite.sum():.5g}" if finite.size else "-"

    def bounded(number: int) -> str:
        unknown = not np.isfinite(data["loss"].values[number])
        return "> " if unknown and len(data["mesh"].values) else ""

    columns = {
        "speed" if dim == "speed" else "load case": lambda i: _label(data, i),
        "input [W]": lambda i: watts("input_power", i),
        "meshes [W]": lambda i: f"{bounded(i)}{watts('mesh_loss', i)}",
    }
    if "bearing_loss" in data:
        columns["bearings [W]"] = lambda i: watts("bearing_loss", i)
    if "seal_loss" in data:
        columns["seals [W]"] = lambda i: watts("seal_loss", i)
    columns |= {
        "losses [W]": lambda i: watts("loss", i),
        "output [W]": lambda i: watts("output_power", i),
        "efficiency": lambda i: _fraction(float(data["efficiency"].values[i])),
    }
    left = (f"the first {_SHOWN} of {count}; all in losses.nc",) if count > _SHOWN else ()
    missing = tuple(filter(None, str(data.attrs["missing"]).split(" | ")))
    notes = (*_friction_words(data), *left, *missing, f"not in it: {', '.join(_not_contained(data))}")
    return tabulate("Losses", range(min(count, _SHOWN)), columns, notes)


def _fraction(value: float) -> str:
    return f"{value:.6f}" if math.isfinite(value) else "-"


def _not_contained(data: Any) -> list[str]:
    """Losses that an efficiency has not."""
    contains = str(data.attrs.get("contains", "teeth")).split(", ")
    return [*(part for part in ("teeth", "bearings", "seals") if part not in contains), "churning and windage"]


_FORMULAS = {
    "constant": "given",
    "table": "by the table of the case",
    "schlenk": "by Schlenk, ISO/TR 14179-2",
    "niemann": "by Niemann and Winter, ISO/TS 6336-22",
    "iso": "by ISO/TS 6336-20",
}


def _friction_words(data: Any) -> Iterator[str]:
    """Say of the kinds of mesh their coefficients of friction and loss factors."""
    mu = np.asarray(data["friction_coefficient"].values)
    if not mu.size:
        return
    span = f"{mu.min():.4f}" if np.ptp(mu) < 5e-5 else f"{mu.min():.4f} to {mu.max():.4f}"
    yield f"coefficient of friction {span}, {_FORMULAS[str(data.attrs['friction'])]}"


def mesh_loss_block(data: Any) -> Block:
    """Tabulate loss factors and losses of all meshes at the operating point of losses.nc with the largest losses."""
    number = int(np.argmax(np.asarray(data["mesh_loss"].values).sum(axis=1)))

    def figure(name: str, form: str, mesh: int) -> str:
        values = np.asarray(data[name].values)
        value = float(values[mesh] if values.ndim == 1 else values[number, mesh])
        return f"{value:{form}}" if math.isfinite(value) else "-"

    columns = {
        "mesh": lambda i: str(data["mesh"].values[i]),
        "mu": lambda i: figure("friction_coefficient", ".4f", i),
        "H_V": lambda i: figure("loss_factor", ".5f", i),
        "H_V, equal loads": lambda i: figure("rigid_loss_factor", ".5f", i),
        "H_V, closed form": lambda i: figure("closed_loss_factor", ".5f", i),
        "loss [W]": lambda i: figure("mesh_loss", ".5g", i),
    }
    notes = (f"at {_label(data, number)}; H_V: of the computed tooth loads, by which the losses are",)
    return tabulate("Losses of the meshes", range(len(data["mesh"].values)), columns, notes)


def loss_tables(data: Any) -> Iterator[Block]:
    """Tabulate what losses.nc has beside `describe_losses`: meshes, and the map over torque and speed."""
    if len(data["mesh"].values):
        yield mesh_loss_block(data)
    if "efficiency_map" not in data:
        return
    values, speeds = data["efficiency_map"].values, data["speed_share"].values
    columns = {"torque": lambda i: f"{float(data['torque_share'].values[i]):g}"}
    for place, share in enumerate(speeds[:_SHOWN]):
        columns[f"speed {float(share):g}"] = lambda i, place=place: f"{_fraction(float(values[i, place]))}"
    note = "shares of the torque and of the last speed of operation"
    yield tabulate("Efficiency over torque and speed", range(len(values)), columns, (note,))


def efficiency_rows(results: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    """Write the row of a verdict on the efficiency; none where no losses were computed."""
    if "losses" not in results.stages:
        return
    data = results.losses
    values = np.asarray(data["efficiency"].values, float)
    if unknown := str(data.attrs.get("unknown", "")):
        yield "efficiency", f"{marks('not known', 'W-LOSSES')}: nothing tells what the meshes of {unknown} lose"
        return
    if not np.isfinite(values).any():
        return
    at = int(np.nanargmin(values))
    loss = float(data["loss"].values[at])
    text = marks(f"{100.0 * values[at]:.3f} %", "W-LOSSES", "W-OIL", of=("losses",))
    where = f" at {_label(data, at)}" if point_dim(data) == "speed" else f", {_label(data, at)}"
    least = "smallest " if len(values) > 1 else ""
    parts = str(data.attrs.get("contains", "teeth"))
    without = ", ".join(_not_contained(data))
    yield f"{least}efficiency", f"{text}{where}: {loss:.4g} W of losses of {parts}; without {without}"
