"""Results of the vibration of a pair: modes.nc, dynamics.nc, runup.nc, and their tables and warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Entries
from femgear.case.quantities import RPM
from femgear.exchange.formats import Signal, line_extent
from femgear.exchange.sampling import Sampling
from femgear.findings import Finding, tell
from femgear.gears.pair import GearPair
from femgear.housing.sound import run_up_signal, sampled_signal, whole_turns
from femgear.report.tables import Block, chosen, first_speeds, response_warnings, tabulate
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import (
    FOURIER,
    as_written,
    complex_entries,
    coordinates,
    declared,
    mode_entries,
    response_variables,
    shape_entries,
)
from femgear.system.fourier import fluctuation
from femgear.trains.pair.model import PairModel

if TYPE_CHECKING:
    import xarray as xr

    from femgear.solvers.stability.parametric import Stability
    from femgear.storage.results import Results
    from femgear.system.system import MeshExcitation, Modes, Response

_SHOWN = 12
"""Rows of the table of resonances."""
_LEVELS = {
    "dte_rms": ("m", "root mean square of the dynamic transmission error about its mean"),
    "dynamic_factor": ("1", "largest mesh force over its mean, K_v"),
    "lowest_force": ("N", "smallest mesh force"),
    "bearing_rms": ("N", "root mean square of the bearing force about its mean"),
    "drive_contact": ("1", "share of the time with drive flanks in contact"),
    "back_contact": ("1", "share of the time with back flanks in contact"),
}
_RESONANCE = {
    "mode": ("1", "mode, from 1"),
    "kind": ("1", "kind of mode"),
    "mesh_harmonic": ("1", "harmonic of the mesh frequency"),
    "frequency": ("Hz", "natural frequency"),
    "resonance_speed": ("rpm", "speed of gear 1 where both meet"),
    "share": ("1", "modal force over the largest of the harmonic"),
    "resonance_alone": ("m", "r.m.s. transmission error there by mode and harmonic alone"),
    "resonance_dte": ("m", "r.m.s. transmission error at that speed"),
    "resonance_factor": ("1", "dynamic factor K_v at that speed"),
    "operating_speed": ("rpm", "nearest operating speed"),
    "distance": ("%", "distance of the resonance from that speed"),
}
_PLAY = "m", "play along the line of action, 0: no back side"


@dataclass(frozen=True)
class PairModesResult(StageResult):
    """Modes of a pair with the mean mesh stiffness, and what excites them.

    Parameters
    ----------
    gears : GearPair
        The pair in its transverse section.
    model : PairModel
        Its equations of motion.
    excitation : MeshExcitation
        Mesh stiffness [N/m], deflection [m] and force [N] over one mesh period.
    modes : Modes
        With the mean mesh stiffness.
    entries : Entries
        Entries of the case that the result depends on.
    frictionless : MeshExcitation, optional
        The excitation without friction, where friction acts.
    """

    gears: GearPair
    model: PairModel
    excitation: MeshExcitation
    modes: Modes
    entries: Entries
    frictionless: MeshExcitation | None = None

    def contents(self) -> Contents:
        """Collect the contents of modes.nc."""
        modes, play = self.modes, self.excitation.backlash
        shapes = shape_entries(modes.shape, modes.mesh_stiffness, modes.mesh_deflection)
        variables = mode_entries(modes) | shapes | {"backlash": ("mesh", play, *_PLAY)}
        axes = {"mode": np.arange(1, len(modes.frequency) + 1), "dof": modes.dofs, "mesh": self.gears.mesh_names}
        title = "modes of the pair with its mean mesh stiffness"
        return Contents(variables, coordinates(**axes), {"title": title})


@dataclass(frozen=True)
class PairMotion:
    """What a pair does at some speeds (s,), complex lines as far as they have an axis of harmonics.

    Parameters
    ----------
    deflection, force, dte : (s, 1, H + 1) arrays
        Approach of the flanks [m], mesh force [N], transmission error of the rotations [m].
    bearing : (s, 2, 2, H + 1) array
        Forces of gear 1 and gear 2 on their bearings, x and y [N].
    peak, lowest : (s,) arrays
        Largest and smallest mesh force [N]; back flanks press with a negative one.
    drive, back : (s,) arrays
        Shares of the time in which drive and back flanks touch.
    """

    deflection: np.ndarray
    force: np.ndarray
    dte: np.ndarray
    bearing: np.ndarray
    peak: np.ndarray
    lowest: np.ndarray
    drive: np.ndarray
    back: np.ndarray

    @property
    def bearing_rms(self) -> np.ndarray:
        """Root mean square (s, 2) of the force of either gear on its bearing about its mean [N]."""
        return np.sqrt(0.5 * (np.abs(self.bearing[..., 1:]) ** 2).sum(axis=(-2, -1)))

    def levels(self, along: str, prefix: str = "") -> dict[str, tuple]:
        """Make the entries of a dataset that tell the motion at every speed, over a dimension."""
        factor = self.peak / np.real(self.force[:, 0, 0])
        values = fluctuation(self.dte)[:, 0], factor, self.lowest, self.bearing_rms, self.drive, self.back
        return {
            f"{prefix}{name}": (f"{along} gear" if value.ndim > 1 else along, value, *_LEVELS[name])
            for name, value in zip(_LEVELS, values, strict=True)
        }


@dataclass(frozen=True)
class PairDynamicsResult(StageResult):
    """Motion of a pair at all speeds of gear 1, and its stability.

    Where the linear response pulls, all are those of the harmonic balance with play.

    Parameters
    ----------
    gears : GearPair
        The pair.
    input_speed : (s,) array
        [rad/s]
    motion : PairMotion
        Approach, forces and shares of contact.
    response : Response
        Harmonics of the mesh.
    stability : Stability
        Floquet verdict.
    excitation_limit : (s,) array
        Frequency at which the excitation ends [Hz].
    backlash : (1,) array
        Play along the line of action [m].
    friction_change : (s, 2) array, optional
        What friction adds to the fluctuation of the force on either bearing with flanks in contact, where it acts [dB].
    """

    gears: GearPair
    input_speed: np.ndarray
    motion: PairMotion
    response: Response
    stability: Stability
    excitation_limit: np.ndarray
    backlash: np.ndarray
    friction_change: np.ndarray | None = None

    @property
    def converged(self) -> bool:
        """Whether all solutions satisfy their tolerance."""
        return bool(np.all(self.response.converged))

    @property
    def residual(self) -> float:
        """Largest relative residual of the solutions."""
        return float(np.max(self.response.residual))

    @property
    def message(self) -> str:
        """How the solutions were found, and at how many speeds flanks part."""
        apart = int((self.motion.drive < 1.0).sum())
        return self.response.message + (f" Flanks part at {apart} speeds." if apart else "")

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what dynamics.nc says against itself, see `pair_dynamics_warnings`."""
        return pair_dynamics_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of dynamics.nc."""
        motion, lines = self.motion, "speed mesh harmonic"
        entries = (
            *_lines(motion),
            ("mesh_deflection", lines, motion.deflection, "m", "approach of the flanks"),
            ("mesh_force", lines, motion.force, "N", "dynamic mesh force"),
        )
        reach = ("speed", self.excitation_limit, "Hz", "highest frequency of the excitation")
        variables = response_variables(self) | {"excitation_limit": reach} | motion.levels("speed")
        variables["backlash"] = ("mesh", self.backlash, *_PLAY)
        if self.friction_change is not None:
            words = "added by friction to the fluctuation of the bearing force"
            variables["friction_change"] = ("speed gear", self.friction_change, "dB", words)
        title = {"title": "periodic response of the pair", "message": self.response.message}
        return Contents(
            variables | complex_entries(entries),
            _coordinates(self, axis=["x", "y"], harmonic=np.arange(motion.dte.shape[-1])),
            title | {"fourier_convention": FOURIER},
        )

    @property
    def verdict(self) -> dict:
        """Tell for the manifest whether it is stable, and at how many speeds flanks part."""
        apart = int((self.motion.drive < 1.0).sum())
        return {"stable": bool(np.all(self.stability.stable)), "separated": apart}


@dataclass(frozen=True)
class PairRunupResult(StageResult):
    """Linear motion of a pair over the speed, its resonances, and the branch on which flanks part.

    Parameters
    ----------
    gears : GearPair
        The pair.
    input_speed : (s,) array
        Speeds of gear 1 [rad/s].
    mesh_frequency, excitation_limit : (s,) arrays
        Mesh frequency, and frequency at which the excitation ends [Hz].
    motion : PairMotion
        Linear, over these speeds.
    resonances : mapping
        Variables of runup.nc of the resonances.
    operating_speeds : (n,) array
        Speeds of gear 1 in operation [rad/s].
    unresolved : int
        Resonances whose peaks are too narrow for the steps of the speed.
    branch : ((p,) array, PairMotion, (p,) bool array) or None
        Speeds [rad/s], motions and stability along the branch; None where the flanks stay in contact.
    complete : bool
        Whether the branch was followed to the end of its range.
    ending : str
        Where flanks part along it, and how it ended.
    """

    gears: GearPair
    input_speed: np.ndarray
    mesh_frequency: np.ndarray
    motion: PairMotion
    excitation_limit: np.ndarray
    resonances: Mapping[str, Any]
    operating_speeds: np.ndarray
    unresolved: int
    branch: tuple[np.ndarray, PairMotion, np.ndarray] | None
    complete: bool
    ending: str

    @property
    def message(self) -> str:
        """How the branch ended."""
        return self.ending

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what runup.nc says against itself, see `pair_runup_warnings`."""
        return pair_runup_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of runup.nc."""
        levels, resonances = self.motion.levels("speed"), dict(self.resonances)
        for name, of in (("resonance_dte", "dte_rms"), ("resonance_factor", "dynamic_factor")):
            resonances[name] = np.interp(resonances["resonance_speed"] * RPM, self.input_speed, levels[of][1])
        variables = {
            "mesh_frequency": ("speed", self.mesh_frequency, "Hz", "mesh frequency"),
            "excitation_limit": ("speed", self.excitation_limit, "Hz", "highest frequency of the excitation"),
            **levels,
            **complex_entries(_lines(self.motion), single=True),
            **declared({name: ("resonance", *words) for name, words in _RESONANCE.items()}, resonances),
        }
        if self.branch is not None:
            speed, motion, stable = self.branch
            words = "whether the motion is known to be stable"
            variables |= motion.levels("point", "branch_") | {
                "branch_speed": ("point", speed / RPM, "rpm", "speed of gear 1 along the branch with play"),
                "branch_stable": ("point", stable, "1", words),
            }
        attrs = {
            "title": "run-up of the pair, linear and with play",
            "operating_speeds": as_written(self.operating_speeds / RPM),
            "unresolved_resonances": self.unresolved,
            "message": self.ending,
            **self.verdict,
        }
        axes = {"axis": ["x", "y"], "harmonic": np.arange(self.motion.dte.shape[-1])}
        return Contents(variables, _coordinates(self, **axes), attrs | {"fourier_convention": FOURIER})

    @property
    def verdict(self) -> dict:
        """Tell for the manifest at how many speeds the linear response pulls, whether the branch ended."""
        apart = int((self.motion.lowest < 0.0).sum())
        return {"separated": apart, "complete": int(self.complete)}


def _lines(motion: PairMotion) -> tuple[tuple, tuple]:
    """What signals are made of."""
    dte = "speed mesh harmonic", motion.dte, "m", "dynamic transmission error of the rotations"
    bearing = "speed gear axis harmonic", motion.bearing, "N", "force of the gear on its bearing"
    return ("dte", *dte), ("bearing_force", *bearing)


def pair_signals(results: Results, sampling: Sampling) -> Iterator[Signal]:
    """Sample acceleration of the transmission error and bearing forces at every speed, and over the run-up.

    At one speed they last whole turns of gear 1. The run-up has flanks held together.
    """
    rate = sampling.rate
    for stage in ("dynamics", *({"runup"} & {*results.stages})):
        for name, unit, order, speed, values in _recordings(results, stage):
            if stage == "runup":
                recorded = run_up_signal(order, values, speed, duration=sampling.run_up, rate=rate)
                yield Signal(f"{name}_run_up", unit, rate, recorded, steady=False)
                continue
            for turning_speed, lines, rpm in zip(speed, values, results[stage]["speed"].values, strict=True):
                samples = whole_turns(turning_speed, sampling.duration, rate=rate)
                recorded = sampled_signal(order, lines, turning_speed, samples=samples, rate=rate)
                text = np.format_float_positional(rpm, 9, fractional=False, trim="-")
                yield Signal(f"{name}_{text}_rpm", unit, rate, recorded)
    if "runup" in results.stages and results.runup.attrs["separated"]:
        text = "the sound of the run-up is that of flanks held together, which pull at some of its speeds"
        tell(Finding("W-PULL", "runup", text, remedy="listen to the speeds"))


def pair_signal_extent(results: Results, rate: float) -> dict[str, tuple[float, float, float]]:
    """Find the extent of the lines of all signals by unit, see `femgear.exchange.formats.line_extent`."""
    stages = ("dynamics", *({"runup"} & {*results.stages}))
    return line_extent((recording[1:] for stage in stages for recording in _recordings(results, stage)), rate)


def _recordings(results: Results, stage: str) -> Iterator[tuple[str, str, np.ndarray, np.ndarray, Any]]:
    """Name, unit, orders of gear 1 (n,), its speeds (s,) [rad/s] and amplitudes (s, n) of every signal.

    Bearing forces are their fluctuations along the mean force, which is the line of action.
    """
    data = results[stage]
    order, speed = data["harmonic"].values * results.case.gear_1.teeth, data["speed"].values * RPM
    dte, force = (data[f"{name}_real"].values + 1j * data[f"{name}_imag"].values for name in ("dte", "bearing_force"))
    yield "transmission_error", "m/s^2", order, speed, -(np.outer(speed, order) ** 2) * dte[:, 0]
    mean = np.real(force[..., :1])
    along = (mean / np.linalg.norm(mean, axis=2, keepdims=True) * force).sum(axis=2)
    along[..., 0] = 0.0
    for gear in range(2):
        yield f"bearing_force_gear_{gear + 1}", "N", order, speed, along[:, gear]


def _coordinates(result: PairDynamicsResult | PairRunupResult, **axes: object) -> dict[str, tuple]:
    names = result.gears.mesh_names
    gear = {"gear": ("gear", ["gear 1", "gear 2"], "1", "gear")}
    return gear | coordinates(speed=result.input_speed / RPM, mesh=names, **axes)


def describe_dynamics(data: xr.Dataset) -> Block:
    """Tabulate transmission error, mesh and bearing forces, contact and stability of dynamics.nc by speed."""
    columns = {
        "speed [rpm]": lambda row: f"{float(row.speed):.2f}",
        "mesh [Hz]": lambda row: f"{float(row.mesh_frequency):.2f}",
        "DTE rms [um]": lambda row: f"{1e6 * float(row.dte_rms):.4f}",
        "K_v": lambda row: f"{float(row.dynamic_factor):.4f}",
        "lowest force [N]": lambda row: f"{float(row.lowest_force):.5g}",
        "bearings rms [N]": lambda row: ", ".join(f"{value:.4g}" for value in row.bearing_rms.values),
        "contact": lambda row: f"{float(row.drive_contact):.4f}",
        "method": lambda row: str(row.method.values),
        "Floquet": lambda row: f"{float(row.floquet_multiplier):.4f}",
    }
    notes = (
        "K_v: largest over mean mesh force; contact: share of the time with drive flanks closed; Floquet: "
        "largest multiplier, stable up to 1",
    )
    return tabulate("Dynamics", (data.isel(speed=i) for i in chosen(data.sizes["speed"])), columns, notes)


def pair_dynamics_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """Name the speeds of dynamics.nc that are not stable, and those at which flanks part (W-SEPARATION)."""
    yield from (response_warning for response_warning in response_warnings(data) if response_warning.code != "W-PULL")
    speed, apart, back = data["speed"].values, data["drive_contact"] < 1.0, data["back_contact"] > 0.0
    if apart.any():
        text = f"flanks part at {first_speeds(speed[apart])}"
        text += f", back flanks are struck at {first_speeds(speed[back])}" if back.any() else ""
        remedy = "look at the branch of the run-up for other motions there"
        if not data["backlash"].item() > 0.0:
            text += "; without backlash the pair has no back flanks to strike, as if its play had no end"
            remedy = f"give set.backlash or smaller profile shifts; {remedy}"
        yield Finding("W-SEPARATION", "operation.speeds", text, remedy=remedy)


def describe_pair_runup(data: xr.Dataset) -> Block:
    """Tabulate the strongest resonances of runup.nc by speed."""
    value = {str(name): variable.values for name, variable in data.items() if variable.dims == ("resonance",)}
    columns = {
        "speed [rpm]": lambda i: f"{value['resonance_speed'][i]:.1f}",
        "from operating": lambda i: f"{np.round(value['distance'][i], 1) + 0.0:+.1f} %",
        "mode": lambda i: f"{value['mode'][i]} {value['kind'][i]}",
        "[Hz]": lambda i: f"{value['frequency'][i]:.1f}",
        "mesh harmonic": lambda i: str(value["mesh_harmonic"][i]),
        "alone [um]": lambda i: f"{1e6 * value['resonance_alone'][i]:.4g}",
        "DTE rms [um]": lambda i: f"{1e6 * value['resonance_dte'][i]:.4g}",
        "K_v": lambda i: f"{value['resonance_factor'][i]:.3f}",
    }
    strongest = np.sort(np.argsort(-value["resonance_alone"], kind="stable")[:_SHOWN])
    notes = (
        f"{len(strongest)} of {data.sizes['resonance']} meetings of a mode with a mesh harmonic that excites "
        "it, flanks held together; alone: r.m.s. transmission error by this mode at this harmonic",
        str(data.attrs["message"]),
    )
    return tabulate("Run-up", strongest, columns, notes)


def pair_runup_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """Tell of peaks between the speeds of runup.nc (W-STEPS), and of a branch that ended early (W-BRANCH)."""
    if missed := int(data.attrs["unresolved_resonances"]):
        text = f"run-up: peaks of {missed} resonances are too narrow for its speeds: levels may be higher"
        yield Finding("W-STEPS", "runup.count", text, remedy="take more speeds, or a narrower range")
    if not data.attrs["complete"]:
        yield Finding("W-BRANCH", "runup", str(data.attrs["message"]))
