"""Run-up of a case with an elastic ring: sensor, mesh forces and resonances over the speed, runup.nc.

The speeds of the case's section `runup` are equally spaced; operating speeds stand among them, and resonances
whose peaks are narrower than the steps get speeds of their own
(`femgear.solvers.linear.resonances.refined_speeds`). Lines of the sensor are those of the exact
circumferential components, whatever form the housing has; in a housing that stands still those of its sensor,
by the forces of the set in it. Modes and what one does alone are always those of the set on its foundation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import Finding, findings_in
from femgear.housing.orders import order_level
from femgear.housing.sound import REFERENCE_ACCELERATION
from femgear.report.tables import (
    Block,
    Marks,
    doubtful_excitation,
    level_change_at,
    shown_level,
    tabulate,
)
from femgear.solvers.linear.resonances import EXCITED
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import as_written, complex_entries, coordinates, declared
from femgear.system.fourier import fluctuation, sample
from femgear.trains.elastic.checks import missing_level

if TYPE_CHECKING:
    import xarray as xr

    from femgear.housing.sensor import SensorLines
    from femgear.solvers.linear.resonances import Crossings, ModalForces
    from femgear.system.system import Modes, Response

KINDS = ("sun-planet", "planet-ring")
_SILENT = 1e-6
"""Lines below this share of the largest one of all speeds are left out."""
LEVEL_CHANGE = "change of the housing level with excitation up to the frequency compared_to"
_RUN_UP_DOUBTS = "W-PULL", "W-DAMPING", "W-FRICTION"
"""Findings that concern every number of a run-up."""
_SHOWN = 12
"""Rows of the table of resonances."""


@dataclass(frozen=True)
class HeardSpeeds:
    """What is kept of the response at some speeds, (s,) or (s, 2) for both kinds of mesh.

    Parameters
    ----------
    level : (s,) array
        Root mean square of the acceleration at the sensor [m/s^2].
    force_rms, force_peak, dynamic_factor : (s, 2) arrays
        Of the meshes of a kind the largest: root mean square about the mean and peak of the force [N], and
        peak over mean, the dynamic factor K_v of ISO 6336-1.
    lowest_force : (s,) array
        [N]
    order : (n_orders,) int array
        Carrier orders.
    lines : (s, n_orders) complex array
        Acceleration at the sensor [m/s^2].
    """

    level: np.ndarray
    force_rms: np.ndarray
    force_peak: np.ndarray
    dynamic_factor: np.ndarray
    lowest_force: np.ndarray
    order: np.ndarray
    lines: np.ndarray


def heard_speeds(force: np.ndarray, lines: SensorLines, lowest_force=None) -> HeardSpeeds:
    """Compute levels, mesh forces and lines of some speeds from mesh forces and lines of the sensor.

    Harmonics (s, 2N, H + 1) of sun-planet, then planet-ring forces [N]; the lowest of all meshes (s,) [N]
    where it is known better than by samples.
    """
    sampled = sample(force, 4 * force.shape[-1])
    peak = sampled.max(axis=-1)
    return HeardSpeeds(
        level=order_level(lines),
        force_rms=_largest_of_kinds(fluctuation(force)),
        force_peak=_largest_of_kinds(peak),
        dynamic_factor=_largest_of_kinds(peak / np.real(force[..., 0])),
        lowest_force=sampled.min(axis=(1, 2)) if lowest_force is None else lowest_force,
        order=lines.order,
        lines=lines.acceleration.astype(np.complex64),
    )


def _largest_of_kinds(values: np.ndarray) -> np.ndarray:
    """Largest values (s, 2) of the sun-planet and of the planet-ring meshes, of those of all meshes (s, 2N)."""
    N = values.shape[1] // 2
    return np.stack([values[:, :N].max(axis=1), values[:, N:].max(axis=1)], axis=1)


def mesh_factors(force: np.ndarray) -> np.ndarray:
    """Compute K_v (s, 2) of sun-planet and planet-ring meshes from harmonics (s, 2N, H + 1) of their forces [N]."""
    return _largest_of_kinds(sample(force, 4 * force.shape[-1]).max(axis=-1) / np.real(force[..., 0]))


def joined_speeds(parts: Sequence[HeardSpeeds]) -> HeardSpeeds:
    """Join what is kept of speeds one after the other, without the orders that are silent at all of them."""
    order = np.unique(np.concatenate([part.order for part in parts]))
    lines = np.zeros((sum(len(part.level) for part in parts), len(order)), np.complex64)
    first = 0
    for part in parts:
        lines[first : first + len(part.level), np.searchsorted(order, part.order)] = part.lines
        first += len(part.level)
    largest = np.abs(lines).max(axis=0)
    audible = largest > _SILENT * largest.max(initial=0.0)
    names = {field_.name for field_ in fields(HeardSpeeds)} - {"order", "lines"}
    rest = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return HeardSpeeds(order=order[audible], lines=lines[:, audible], **rest)


def mode_levels(response: Response, field: np.ndarray, alike, harmonic, heard_speed: np.ndarray, at):
    """Compute the levels (c,) of the modes and harmonics of resonances, each alone, in a response [m/s^2].

    Parameters
    ----------
    field : (n_modes, L) complex array
        Components of the modes that are heard apart, see `femgear.trains.elastic.model.ring_field`.
    alike : (n_modes, c) bool array
        Modes of every resonance, of which several may have one frequency.
    harmonic, at : (c,) int arrays
        Mesh harmonics, and speeds of the response; the level is zero where these are negative, and beyond
        the harmonics of the response.
    heard_speed : (n_speeds, H + 1, L) array
        Angular frequency at which each component is heard [rad/s].
    """
    levels = np.zeros(len(at))
    for i in np.flatnonzero((at >= 0) & (harmonic < response.modal.shape[-1])):
        lines_of_order, h = np.flatnonzero(alike[:, i]), harmonic[i]
        lines = response.modal[at[i], lines_of_order, h] @ field[lines_of_order] * heard_speed[at[i], h] ** 2
        levels[i] = np.sqrt(0.5 * (np.abs(lines) ** 2).sum())
    return levels


_ROW = "resonance"
_RESONANCE = {
    "mode": (_ROW, "1", "mode, from 1"),
    "kind": (_ROW, "1", "kind of mode"),
    "nodal_diameter": (_ROW, "1", "dominant nodal diameter of the ring"),
    "mesh_harmonic": (_ROW, "1", "harmonic of the mesh frequency"),
    "frequency": (_ROW, "Hz", "natural frequency"),
    "resonance_speed": (_ROW, "rpm", "speed of the input where both meet"),
    "share": (_ROW, "1", "modal force over the largest of the harmonic"),
    "resonance_level": (_ROW, "m/s^2", "level at that speed"),
    "resonance_alone": (_ROW, "m/s^2", "level there by mode and harmonic alone"),
    "resonance_factor": (f"{_ROW} mesh_kind", "1", "dynamic factor K_v at that speed"),
    "operating_speed": (_ROW, "rpm", "nearest operating speed"),
    "operating_alone": (_ROW, "m/s^2", "level there by mode and harmonic alone"),
    "distance": (_ROW, "%", "distance of the resonance from that speed"),
}


def resonances(modes: Modes, forces: ModalForces, crossed: Crossings, speed, operating) -> dict[str, Any]:
    """Collect what is known of crossings before the run-up.

    Of their speeds (c,) and the speeds ``operating`` (c,) of operation next to them, both [rad/s].
    """
    mode = forces.mode[crossed.row]
    return {
        "mode": mode + 1,
        "kind": [modes.kind[i] for i in mode],
        "nodal_diameter": modes.nodal_diameter[mode],
        "mesh_harmonic": crossed.harmonic,
        "frequency": forces.frequency[crossed.row],
        "resonance_speed": speed / RPM,
        "share": forces.share[crossed.row, crossed.harmonic - 1],
        "operating_speed": as_written(operating / RPM),
        "distance": 100.0 * (speed / operating - 1.0),
    }


@dataclass(frozen=True)
class RunupResult(StageResult):
    """Levels, mesh forces and lines over the speed of the input, and the resonances between its ends.

    Parameters
    ----------
    input_speed, carrier_speed : (s,) arrays
        Speeds of the input and of the carrier [rad/s].
    mesh_frequency, excitation_limit : (s,) arrays
        Mesh frequency, and frequency at which the excitation ends [Hz].
    level_change : (s,) array
        What the level changes when the excitation ends at ``compared_to`` instead [dB]; nan at speeds that were not
        looked at.
    compared_to : float
        [Hz]
    response : HeardSpeeds
        Levels, forces and lines at these speeds.
    resonances : mapping
        Variables of runup.nc of the resonances, (c,) each.
    ring_teeth : int
        Teeth of the ring: the carrier order of the mesh frequency.
    sensor_angle : float
        Place of the sensor on the housing [rad].
    operating_speeds : (n,) array
        Speeds of the input in operation [rad/s].
    unresolved : int
        Resonances whose peaks are too narrow for the steps of the speed.
    method : str
        As in `SensorLines`.
    """

    input_speed: np.ndarray
    mesh_frequency: np.ndarray
    excitation_limit: np.ndarray
    level_change: np.ndarray
    compared_to: float
    carrier_speed: np.ndarray
    response: HeardSpeeds
    resonances: Mapping[str, Any]
    ring_teeth: int
    sensor_angle: float
    operating_speeds: np.ndarray
    unresolved: int
    method: str = "exact"

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "spectral method; a speed without a solution is refused"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what runup.nc says against itself, see `runup_warnings`."""
        return runup_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of runup.nc."""
        computed, kinds = self.response, "speed mesh_kind"
        words = "acceleration at the sensor, single-sided amplitude"
        at = partial(np.interp, self.resonances["resonance_speed"] * RPM, self.input_speed)
        there = {
            "resonance_level": at(computed.level),
            "resonance_factor": np.stack([at(factor) for factor in computed.dynamic_factor.T], axis=1),
        }
        variables = {
            "mesh_frequency": ("speed", self.mesh_frequency, "Hz", "mesh frequency"),
            "carrier_speed": ("speed", self.carrier_speed, "rad/s", "speed of the carrier"),
            "excitation_limit": ("speed", self.excitation_limit, "Hz", "highest frequency of the excitation"),
            "level_change": ("speed", self.level_change, "dB", LEVEL_CHANGE),
            "level": ("speed", computed.level, "m/s^2", "root mean square of the acceleration at the sensor"),
            "force_rms": (kinds, computed.force_rms, "N", "root mean square of the mesh force about its mean"),
            "force_peak": (kinds, computed.force_peak, "N", "largest mesh force"),
            "dynamic_factor": (kinds, computed.dynamic_factor, "1", "largest mesh force over its mean, K_v"),
            "lowest_force": ("speed", computed.lowest_force, "N", "smallest mesh force; teeth cannot pull"),
            **complex_entries((("lines", "speed order", computed.lines, "m/s^2", words),), single=True),
            **declared(_RESONANCE, {**self.resonances, **there}),
        }
        return Contents(
            variables,
            coords=coordinates(speed=self.input_speed / RPM)
            | {
                "mesh_kind": ("mesh_kind", list(KINDS), "1", "kind of mesh"),
                "order": ("order", computed.order, "1", "carrier order"),
            },
            attrs={
                "title": "run-up: sensor, mesh forces and resonances over the speed",
                "sensor_angle": self.sensor_angle,
                "method": self.method,
                "ring_teeth": self.ring_teeth,
                "compared_to": self.compared_to,
                "reference_acceleration": REFERENCE_ACCELERATION,
                "unresolved_resonances": self.unresolved,
                "operating_speeds": as_written(self.operating_speeds / RPM),
            },
        )


def meeting_columns(value: Mapping[str, np.ndarray]) -> dict[str, Callable[[int], str]]:
    """Name the columns of tables that tell which mode [Hz] meets which mesh harmonic, (c,) each."""
    return {
        "mode": lambda i: str(value["mode"][i]),
        "kind": lambda i: str(value["kind"][i]),
        "[Hz]": lambda i: f"{value['frequency'][i]:.1f}",
        "mesh harmonic": lambda i: str(value["mesh_harmonic"][i]),
    }


def loudest(data: xr.Dataset, marks: Marks, *, digits: int = 4) -> str:
    """Write the largest level of runup.nc in so many digits, its speed, and whether the level may rise beyond that.

    More excitation may also lift another speed above it.
    """
    speed, level = data["speed"].values, data["level"].values
    worst = int(level.argmax())
    end = ", the end of its range" if worst in (0, len(speed) - 1) else ""
    changes = level_change_at(data, speed)
    with np.errstate(divide="ignore"):
        raised = 20.0 * np.log10(level / level[worst]) + changes
    change = float(changes[worst] if np.isnan(raised).any() else max(raised.max(), changes[worst]))
    text = shown_level(level[worst], change, marks, "W-STEPS", *_RUN_UP_DOUBTS, of=("runup",), digits=digits)
    return f"{text} m/s² at {speed[worst]:,.4g} rpm{end}"


def largest_factors(data: xr.Dataset, marks: Marks) -> str:
    """Write the largest dynamic factors K_v of runup.nc for either kind of mesh, with their speeds."""
    speed, factors = data["speed"].values, data["dynamic_factor"].values
    texts, change = list[str](), level_change_at(data, speed)
    for kind, factor in zip(KINDS, factors.T):
        worst = int(factor.argmax())
        codes = *doubtful_excitation(float(change[worst])), "W-STEPS", *_RUN_UP_DOUBTS
        text = marks(f"{factor[worst]:.3f}", *codes, of=("runup",))
        texts.append(f"{kind} {text} at {speed[worst]:,.4g} rpm")
    return ", ".join(texts)


def describe_runup(data: xr.Dataset, run: Iterable[Finding] = ()) -> Block:
    """Tabulate the strongest resonances of runup.nc by speed.

    The findings of the whole ``run`` give the order of the marks.
    """
    speed = data["speed"].values
    strongest = np.argsort(-data["resonance_alone"].values, kind="stable")[:_SHOWN]
    marks = Marks(findings_in(data.attrs), run)
    change = level_change_at(data, data["resonance_speed"].values)
    codes = "W-STEPS", *_RUN_UP_DOUBTS
    value = {str(name): variable.values for name, variable in data.items() if variable.dims[:1] == ("resonance",)}
    columns = {
        "speed [rpm]": lambda i: f"{value['resonance_speed'][i]:.1f}",
        "from operating": lambda i: f"{np.round(value['distance'][i], 1) + 0.0:+.1f} %",
        **meeting_columns(value),
        "force share": lambda i: f"{value['share'][i]:.3f}",
        "alone [m/s²]": lambda i: marks(f"{value['resonance_alone'][i]:.4g}", "W-DAMPING"),
        "level [m/s²]": lambda i: shown_level(float(value["resonance_level"][i]), float(change[i]), marks, *codes),
        "K_v": lambda i: marks(
            f"{value['resonance_factor'][i].max():.3f}", *doubtful_excitation(float(change[i])), *codes
        ),
    }
    notes = [
        f"{len(strongest)} of {data.sizes['resonance']} meetings of a mode with a mesh harmonic that excites "
        "it: those with the highest level by this mode at this harmonic alone; modes together may give less",
        f"excited: modal force of {EXCITED:g} or more of the largest of that harmonic (force share)",
        f"{len(speed)} speeds from {speed[0]:.6g} to {speed[-1]:.6g} rpm; largest level {loudest(data, marks)}",
    ]
    if data.attrs.get("method", "exact") != "exact":
        notes.append("levels and K_v in the housing that stands still; modes, and alone, on the foundation")
    return tabulate("Run-up", sorted(strongest), columns, notes, marks)


def runup_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """Say where the excitation of runup.nc ends too early, how many peaks it misses, and what pulls."""
    if "level_change" in data and "compared_to" in data.attrs:
        change, limit = data["level_change"].values, data["excitation_limit"].values
        beyond = float(data.attrs["compared_to"])
        yield from missing_level(data["speed"].values, change, limit, beyond, of="run-up: ")
    if missed := int(data.attrs.get("unresolved_resonances", 0)):
        text = f"run-up: peaks of {missed} resonances are too narrow for its speeds: levels there may be higher"
        yield Finding("W-STEPS", "runup.count", text, remedy="take more speeds, or a narrower range")
    lowest, speed = data["lowest_force"].values, data["speed"].values
    if (pulling := lowest < -1e-3 * data["force_peak"].values.max()).any():
        low, high = speed[pulling].min(), speed[pulling].max()
        text = (
            f"run-up: meshes pull at {pulling.sum()} of {len(speed)} speeds from {low:.6g} to {high:.6g} rpm "
            f"with up to {-1e-3 * lowest.min():.4g} kN: real teeth would part"
        )
        remedy = "raise the damping, or let meshes part in a section [planar]"
        yield Finding("W-PULL", "", text, remedy=remedy)
