"""Run-up of a case with an elastic ring: sensor, mesh forces and resonances over the speed, runup.nc.

The speeds of the case's section `runup` are equally spaced; operating speeds stand among them, and resonances
whose peaks are narrower than the steps get speeds of their own (`refined_speeds`). Lines of the sensor are
those of the exact circumferential components, whatever form the housing has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.housing.orders import order_level
from femgear.report.tables import Block, tabulate
from femgear.storage.results import complex_entries, coordinates, dataset
from femgear.system.fourier import fluctuation, sample

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.dependencies import Entries
    from femgear.housing.sensor import SensorLines
    from femgear.solvers.linear.resonances import Crossings, ModalForces
    from femgear.system.system import Modes, Response

KINDS = ("sun-planet", "planet-ring")
REFERENCE = 1e-6
"""Acceleration of 0 dB [m/s^2] (ISO 1683)."""
_SILENT = 1e-6
"""Lines below this share of the largest one of all speeds are left out."""
_REFINED = 40
"""Resonances that get speeds of their own, at most."""
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


def heard_speeds(response: Response, lines: SensorLines) -> HeardSpeeds:
    """Compute levels, mesh forces and lines of some speeds from their response and lines of the sensor."""
    force, N = response.force, response.force.shape[1] // 2
    peak = sample(force, 4 * force.shape[-1]).max(axis=-1)

    def largest(values: np.ndarray) -> np.ndarray:
        return np.stack([values[:, :N].max(axis=1), values[:, N:].max(axis=1)], axis=1)

    return HeardSpeeds(
        level=order_level(lines),
        force_rms=largest(fluctuation(force)),
        force_peak=largest(peak),
        dynamic_factor=largest(peak / np.real(force[..., 0])),
        lowest_force=response.lowest_force,
        order=lines.order,
        lines=lines.acceleration.astype(np.complex64),
    )


def joined(parts: Sequence[HeardSpeeds]) -> HeardSpeeds:
    """Join what is kept of speeds one after the other, without the orders that are silent at all of them."""
    order = np.unique(np.concatenate([one.order for one in parts]))
    lines = np.zeros((sum(len(one.level) for one in parts), len(order)), np.complex64)
    first = 0
    for one in parts:
        lines[first : first + len(one.level), np.searchsorted(order, one.order)] = one.lines
        first += len(one.level)
    largest = np.abs(lines).max(axis=0)
    heard = largest > _SILENT * largest.max(initial=0.0)
    names = {one.name for one in fields(HeardSpeeds)} - {"order", "lines"}
    rest = {name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
    return HeardSpeeds(order=order[heard], lines=lines[:, heard], **rest)


def refined_speeds(speeds: np.ndarray, resonance: np.ndarray, alone: np.ndarray, damping: np.ndarray):
    """Add speeds at resonances whose peaks are narrower than the steps between the speeds (s,), ascending.

    A peak of damping ratio z at speed w falls to half its power at ``w (1 - z)`` and ``w (1 + z)``. Of
    resonances (c,), strongest first by their levels ``alone``, some get these three speeds; undamped ones,
    which have no largest level, none.
    """
    step = np.diff(speeds).max(initial=0.0) if len(speeds) > 1 else np.inf
    narrow = np.flatnonzero((damping > 0.0) & (damping * resonance < step))
    strongest = narrow[np.argsort(-alone[narrow], kind="stable")[:_REFINED]]
    around = resonance[strongest, None] * (1.0 + damping[strongest, None] * np.array([-1.0, 0.0, 1.0]))
    inside = (around >= speeds[0]) & (around <= speeds[-1])
    return np.unique(np.concatenate([speeds, around[inside]]))


@dataclass(frozen=True)
class Resonances:
    """Meetings of a mode with a mesh harmonic that excites it, (c,) each, by speed.

    Parameters
    ----------
    mode, nodal_diameter, harmonic : int arrays
        Mode from 0 and its dominant nodal diameter, mesh harmonic.
    kind : tuple of str
    frequency, speed : arrays
        Natural frequency [Hz] and speed of the input [rad/s].
    share : array
        Modal force over the largest of the harmonic.
    alone : array
        Level by this mode and harmonic alone [m/s^2].
    operating_speed, distance : arrays
        Operating speed next to it [rad/s], and its own over that, less one.
    """

    mode: np.ndarray
    nodal_diameter: np.ndarray
    harmonic: np.ndarray
    kind: tuple[str, ...]
    frequency: np.ndarray
    speed: np.ndarray
    share: np.ndarray
    alone: np.ndarray
    operating_speed: np.ndarray
    distance: np.ndarray


def resonances(
    modes: Modes, forces: ModalForces, found: Crossings, teeth_per_speed: float, operating
) -> Resonances:
    """Collect what is known of crossings; mesh frequency over speed of the input [1/rad], speeds [rad/s]."""
    mode, cell = forces.mode[found.row], (found.row, found.harmonic - 1)
    speed, operating = found.mesh_frequency / teeth_per_speed, np.asarray(operating)
    nearest = operating[np.abs(np.log(speed[:, None] / operating)).argmin(axis=1)]
    return Resonances(
        mode=mode,
        nodal_diameter=modes.nodal_diameter[mode],
        harmonic=found.harmonic,
        kind=tuple(modes.kind[i] for i in mode),
        frequency=forces.frequency[found.row],
        speed=speed,
        share=forces.share[cell],
        alone=forces.acceleration[cell],
        operating_speed=nearest,
        distance=speed / nearest - 1.0,
    )


@dataclass(frozen=True)
class RunupResult:
    """Levels, mesh forces and lines over ``input_speed`` (s,) [rad/s], and the resonances between its ends.

    Mesh frequency and end of the excitation (s,) [Hz], speed of the carrier (s,) [rad/s].
    """

    input_speed: np.ndarray
    mesh_frequency: np.ndarray
    excitation_limit: np.ndarray
    carrier_speed: np.ndarray
    heard: HeardSpeeds
    resonances: Resonances
    ring_teeth: int
    sensor_angle: float
    entries: Entries

    def at(self, values: np.ndarray) -> np.ndarray:
        """Interpolate values (s, ...) to the speeds of the resonances, (c, ...)."""
        speed = self.resonances.speed
        after = np.clip(np.searchsorted(self.input_speed, speed), 1, len(self.input_speed) - 1)
        low, high = self.input_speed[after - 1], self.input_speed[after]
        part = ((speed - low) / (high - low)).reshape(-1, *[1] * (values.ndim - 1))
        return (1.0 - part) * values[after - 1] + part * values[after]

    def harmonic_levels(self) -> np.ndarray:
        """Compute the levels (s, H + 1) of the orders around every mesh harmonic [m/s^2]."""
        power, order = 0.5 * np.abs(self.heard.lines) ** 2, self.heard.order
        harmonic = np.rint(order / self.ring_teeth).astype(int)
        found = np.zeros(
            (len(power), max(harmonic.max(initial=0), self.resonances.harmonic.max(initial=0)) + 1)
        )
        np.add.at(found.T, harmonic, power.T)
        return np.sqrt(found)

    def dataset(self) -> xr.Dataset:
        """Collect the contents of runup.nc."""
        heard, own, kinds = self.heard, self.resonances, "speed mesh_kind"
        words = "acceleration at the sensor, single-sided amplitude"
        rows = np.arange(len(own.speed))
        there = self.at(self.harmonic_levels())[rows, own.harmonic]
        variables = {
            "mesh_frequency": ("speed", self.mesh_frequency, "Hz", "mesh frequency"),
            "carrier_speed": ("speed", self.carrier_speed, "rad/s", "speed of the carrier"),
            "excitation_limit": ("speed", self.excitation_limit, "Hz", "highest frequency of the excitation"),
            "level": ("speed", heard.level, "m/s^2", "root mean square of the acceleration at the sensor"),
            "force_rms": (kinds, heard.force_rms, "N", "root mean square of the mesh force about its mean"),
            "force_peak": (kinds, heard.force_peak, "N", "largest mesh force"),
            "dynamic_factor": (kinds, heard.dynamic_factor, "1", "largest mesh force over its mean, K_v"),
            "lowest_force": ("speed", heard.lowest_force, "N", "smallest mesh force; teeth cannot pull"),
            **complex_entries((("lines", "speed order", heard.lines, "m/s^2", words),), single=True),
            "mode": ("resonance", own.mode + 1, "1", "mode, from 1"),
            "kind": ("resonance", list(own.kind), "1", "kind of mode"),
            "nodal_diameter": ("resonance", own.nodal_diameter, "1", "dominant nodal diameter of the ring"),
            "mesh_harmonic": ("resonance", own.harmonic, "1", "harmonic of the mesh frequency"),
            "frequency": ("resonance", own.frequency, "Hz", "natural frequency"),
            "resonance_speed": ("resonance", own.speed / RPM, "rpm", "speed of the input where both meet"),
            "share": ("resonance", own.share, "1", "modal force over the largest of the harmonic"),
            "resonance_alone": ("resonance", own.alone, "m/s^2", "level by this mode and harmonic alone"),
            "resonance_level": ("resonance", self.at(heard.level), "m/s^2", "level at that speed"),
            "harmonic_level": ("resonance", there, "m/s^2", "of it orders around the mesh harmonic"),
            "resonance_factor": (
                "resonance mesh_kind", self.at(heard.dynamic_factor), "1", "dynamic factor K_v at that speed"
            ),
            "operating_speed": ("resonance", own.operating_speed / RPM, "rpm", "nearest operating speed"),
            "distance": ("resonance", 100.0 * own.distance, "%", "distance of the resonance from that speed"),
        }  # fmt: skip
        return dataset(
            variables,
            coords=coordinates(speed=self.input_speed / RPM)
            | {
                "mesh_kind": ("mesh_kind", list(KINDS), "1", "kind of mesh"),
                "order": ("order", heard.order, "1", "carrier order"),
            },
            attrs={
                "title": "run-up: sensor, mesh forces and resonances over the speed",
                "sensor_angle": self.sensor_angle,
                "ring_teeth": self.ring_teeth,
                "reference_acceleration": REFERENCE,
            },
        )


def describe_runup(data: xr.Dataset) -> Block:
    """Tabulate the strongest resonances of runup.nc, by the level that they make."""
    strongest = np.argsort(-data["harmonic_level"].values, kind="stable")[:_SHOWN]
    speed, level = data["speed"].values, data["level"].values
    worst = int(level.argmax())
    notes = (
        f"{len(speed)} speeds from {speed[0]:.6g} to {speed[-1]:.6g} rpm; largest level "
        f"{level[worst]:.4g} m/s² at {speed[worst]:.6g} rpm",
    )
    return tabulate("Run-up", sorted(strongest), resonance_columns(data), notes)


def resonance_columns(data: xr.Dataset):
    """Columns of a table of resonances, by their number in runup.nc."""

    def value(name, i):
        return data[name].values[i]

    return {
        "speed [rpm]": lambda i: f"{value('resonance_speed', i):.1f}",
        "mode": lambda i: str(value("mode", i)),
        "kind": lambda i: str(value("kind", i)),
        "[Hz]": lambda i: f"{value('frequency', i):.1f}",
        "mesh harmonic": lambda i: str(value("mesh_harmonic", i)),
        "share": lambda i: f"{value('share', i):.3f}",
        "level [m/s²]": lambda i: f"{value('resonance_level', i):.4g}",
        "of it harmonic": lambda i: f"{value('harmonic_level', i):.4g}",
        "K_v": lambda i: f"{value('resonance_factor', i).max():.3f}",
        "from operating": lambda i: f"{value('distance', i):+.1f} %",
    }
