"""Results of a drivetrain case: modes.nc, transient.nc, spectrum.nc, their tables and warnings.

Every variable of a file carries its units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import Finding
from femgear.report.tables import Block, describe_modes, pull, tabulate
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.storage.results import coordinates, mode_entries, shape_entries
from femgear.trains.drivetrain.case_file import DrivetrainCase, torque_histories
from femgear.trains.drivetrain.checks import case_speeds, check_drivetrain, record_rate
from femgear.trains.drivetrain.model import DrivetrainModel
from femgear.trains.drivetrain.parts import PlanetarySection, TorqueHistory, numbered
from femgear.trains.drivetrain.simulation import BALANCE, PASS_BAND, DrivetrainRun

if TYPE_CHECKING:
    import xarray as xr

    from femgear.solvers.linear.tracking import CampbellData
    from femgear.system.system import Modes

_LOW_PASS = "linear-phase low pass, 0.8 to 1.0 of half the record rate, 80 dB"

# Panels of a figure.
MOST_PANELS = 6
# Of the segments of spectra.
WINDOW = "hann"

_PLANET = re.compile(r"(?:^|-)planet (\d+)(?: \d+)?(?:-ring of |$)")

# Share of rotations in the kinetic energy above which a mode is torsional; bending below what is left.
_TORSION = 0.9

# Linear meshes: a free motion that grows by more than this over a run is no longer small.
_GROWN = 10.0
# The same between any two instants of it.
_GAINED = 1e3
# A force that is rounding [N].
_NOTHING = 1e-6


@dataclass(frozen=True)
class DrivetrainModesResult(StageResult):
    """Modes at standstill with mean mesh stiffnesses, and over the speed with gyroscopic terms.

    Parameters
    ----------
    model : DrivetrainModel
        The train as it is solved.
    modes : Modes
        At standstill.
    campbell : CampbellData
        Modes and critical speeds over the speed of the first body.
    speed : float
        Speed of the first body in operation [rad/s].
    """

    model: DrivetrainModel
    modes: Modes
    campbell: CampbellData
    speed: float

    def contents(self) -> Contents:
        """Collect the contents of modes.nc."""
        modes, model, campbell = self.modes, self.model, self.campbell
        members, energy, rotation = _energies(model, modes.shape)
        bases = np.unique(model.mesh_base)
        orders = model.base_ratio[bases]
        critical, over_speed = campbell.critical, "natural frequency over the speed"
        at = [critical_speed.speed / RPM for critical_speed in critical]
        line = orders * self.speed / (2 * np.pi)
        variables = mode_entries(modes) | {
            "kind": ("mode", _kinds(modes.frequency, rotation), "1", "rigid, torsional, bending or mixed"),
            "rotation_share": ("mode", rotation, "1", "share of rotations in the kinetic energy"),
            "energy": ("member mode", energy, "1", "share of the member in the kinetic energy"),
            **shape_entries(modes.shape, model.mean_stiffness, modes.mesh_deflection),
            "ratio": ("body", list(model.ratio.values()), "1", "speed over that of the first body"),
            "base_order": ("base", orders, "1", "mesh frequency over the first body's turn"),
            "mesh_frequency": ("base", line, "Hz", "mesh frequency at the speed of the operation"),
            "campbell_frequency": ("campbell_speed branch", campbell.frequency, "Hz", over_speed),
            "critical_speed": ("crossing", at, "rpm", "speed of a mesh line on a branch"),
            "critical_frequency": ("crossing", [c.frequency for c in critical], "Hz", "frequency there"),
        }
        coords = {
            **coordinates(mode=np.arange(len(modes.frequency)), dof=numbered(model.system.dofs)),
            "member": _names("member", members, "body, planet or shaft station"),
            "mesh": _names("mesh", model.meshes, "gear mesh"),
            "body": _names("body", model.ratio, "body"),
            "base": _names("base", [model.bases[b] for b in bases], "mesh of a stage"),
            "campbell_speed": (("campbell_speed",), campbell.speed / RPM, "rpm", "speed of the first body"),
        }
        attrs = {"title": "modes of the drivetrain, mean mesh stiffness", "unknowns": len(modes.shape)}
        return Contents(variables, coords, attrs)


@dataclass(frozen=True)
class TransientResult(StageResult):
    """Motion in time, by variant: with bending of the shafts, and with their torsion alone where that is asked for.

    ``models`` are the trains as they are solved, ``runs`` their motions, ``torques`` the external torques.
    """

    models: dict[str, DrivetrainModel]
    runs: dict[str, DrivetrainRun]
    torques: tuple[TorqueHistory, ...]

    @property
    def converged(self) -> bool:
        """Whether energy and angular momentum balance."""
        return self.residual <= BALANCE

    @property
    def residual(self) -> float:
        """Largest error of the balances of energy and angular momentum, relative."""
        return float(max(max(run.energy_balance.error, run.momentum) for run in self.runs.values()))

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "integrated in time; residual: balances of energy and angular momentum"

    @staticmethod
    def warnings(data: xr.Dataset) -> Iterable[Finding]:
        """List what transient.nc says against itself, see `transient_warnings`."""
        return transient_warnings(data)

    def contents(self) -> Contents:
        """Collect the contents of transient.nc."""
        runs = list(self.runs.values())
        first, model = runs[0], next(iter(self.models.values()))
        ratio, bodies = np.array(list(model.ratio.values())), list(model.ratio)
        torque = np.zeros((len(first.time), len(bodies)))
        for history in self.torques:
            torque[:, bodies.index(history.body)] += history.at(first.time)
        negative = "on the back flank" if first.contact_loss else "where the linear mesh pulls"
        time, mesh, moving = ("time",), ("mesh",), ("time", "body")
        of_runs = (
            ("spin", time, lambda r: r.spin, "rad", "angle of the first body without its deviation"),
            ("speed", moving, lambda r: r.spin_speed[:, None] * ratio + r.velocity, "rad/s", "speed of rotation"),
            ("deviation", moving, lambda r: r.motion, "rad", "rotation less that of the free spin, ratio times spin"),
            (
                "mesh_force",
                ("time", "mesh"),
                lambda r: r.force,
                "N",
                f"mesh force along the line of action; negative {negative}",
            ),
            ("least_force", mesh, lambda r: r.extremes[0], "N", "least mesh force at any step"),
            ("largest_force", mesh, lambda r: r.extremes[1], "N", "largest mesh force at any step"),
            ("pulling", mesh, lambda r: r.pulling, "1", "share of steps with a negative force"),
            ("lost", mesh, lambda r: r.lost, "1", "share of steps in which no flank touches"),
            (
                "growth",
                (),
                lambda r: r.growth,
                "1/s",
                "mean rate of the logarithm of the free motion: above zero it grows",
            ),
            (
                "gain",
                (),
                lambda r: r.gain,
                "1",
                "largest growth of the free motion between two instants of the run, as a factor",
            ),
        )
        variables = {
            name: (("variant", *dims), [value(run) for run in runs], unit, text)
            for name, dims, value, unit, text in of_runs
        }
        energy, momentum = [run.energy_balance.error for run in runs], [run.momentum for run in runs]
        variables |= {
            "torque": (moving, torque, "N m", "external torque"),
            "ratio": (("body",), ratio, "1", "speed over that of the first body"),
            "energy_error": (("variant",), energy, "1", "error of the energy balance, relative"),
            "momentum_error": (("variant",), momentum, "1", "error of the angular momentum, relative"),
        }
        coords = {
            "variant": _names("variant", self.runs, "model"),
            "time": (("time",), first.time, "s", "time"),
            "body": _names("body", bodies, "body"),
            "mesh": _names("mesh", first.meshes, "gear mesh"),
        }
        every = 1 if len(first.time) < 2 else round((first.time[1] - first.time[0]) / first.step)
        attrs = {
            "title": "motion of the drivetrain in time",
            "step": first.step,
            "steps": first.steps,
            "every": every,
            "contact": "separating" if first.contact_loss else "linear",
            "damping_ratio": model.train.damping_ratio,
            "filter": _LOW_PASS if every > 1 else "none",
        }
        return Contents(variables, coords, attrs)


@dataclass(frozen=True)
class MeshLine:
    """A line of a spectrum: its ``name``, and its frequency in two ways.

    ``orders`` are the whole multiples of the base frequencies, ``order`` is the multiple of the turn of the first body.
    """

    name: str
    orders: tuple[int, ...]
    order: float


@dataclass(frozen=True)
class AveragedSpectrum:
    """Single-sided amplitude spectrum, the root of the mean of squared segments.

    Parameters
    ----------
    frequency : (F,) array
        [Hz], or orders.
    amplitude : (..., F) array
        Peak values in the unit of the signal: a sine that falls on a line shows its amplitude.
    resolution : float
        Distance of lines [Hz], or in orders.
    bandwidth : float
        Equivalent noise bandwidth [Hz], or in orders.
    segments : int
        Number of segments that are averaged.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    resolution: float
    bandwidth: float
    segments: int


@dataclass(frozen=True)
class SpectrumResult(StageResult):
    """Spectra of the mesh forces by variant, over frequency and order, and the named lines.

    Parameters
    ----------
    transient : TransientResult
        The motion from which they are made.
    settle : float
        Time that is left out at the start [s].
    speed : float
        Mean speed of the first body after that [rad/s].
    spectra, orders : dict of AveragedSpectrum
        By variant, amplitudes of the mesh forces [N] over the frequency [Hz], and over the order, multiples of the
        turn of the first body [1].
    lines : tuple of MeshLine
        Mesh harmonics, their side bands, and sums and differences of meshes.
    amplitudes : dict of (L, n_meshes) array
        By variant, amplitudes of these lines [N].
    order_distance : float
        Smallest distance of orders that the record parts [1].
    resolved : (L,) bool array
        Whether it parts a line from its neighbours.
    """

    transient: TransientResult
    settle: float
    speed: float
    spectra: dict[str, AveragedSpectrum]
    orders: dict[str, AveragedSpectrum]
    lines: tuple[MeshLine, ...]
    amplitudes: dict[str, np.ndarray]
    order_distance: float
    resolved: np.ndarray

    @property
    def message(self) -> str:
        """How the solutions were found."""
        return "spectra of the record in time"

    def contents(self) -> Contents:
        """Collect the contents of spectrum.nc."""
        transient = self.transient
        model, variants = next(iter(transient.models.values())), list(self.spectra)
        spectrum, tracked = self.spectra[variants[0]], self.orders
        length = min(len(order_spectrum.frequency) for order_spectrum in tracked.values())
        order = tracked[variants[0]].frequency[:length]
        lines, distance = self.lines, self.order_distance
        amplitude = [self.spectra[v].amplitude for v in variants]
        by_order = [tracked[v].amplitude[:, :length] for v in variants]
        averaged = "amplitude spectrum of the mesh force, root of the mean square of the segments, peak values"
        single = "amplitude of the mesh force over orders of the first body, one segment, peak values"
        line, orders = [self.amplitudes[v] for v in variants], np.array([mesh_line.order for mesh_line in lines])
        hertz, multiples = orders * self.speed / (2 * np.pi), [mesh_line.orders for mesh_line in lines]
        of_line = "amplitude of the line, peak value; NaN beyond the pass band"
        variables = {
            "amplitude": ("variant mesh frequency", amplitude, "N", averaged),
            "order_amplitude": ("variant mesh order", by_order, "N", single),
            "line_order": ("line", orders, "1", "order of the first body"),
            "line_frequency": ("line", hertz, "Hz", "frequency at the mean speed"),
            "line_amplitude": ("variant line mesh", line, "N", of_line),
            "line_orders": ("line base", multiples, "1", "multiples of the base frequencies"),
            "mesh_base": ("mesh", model.mesh_base, "1", "number of the base of the mesh stiffness"),
            "resolved": ("line", self.resolved, "1", "whether the record parts the line from its neighbours"),
        }
        coords = {
            "variant": _names("variant", variants, "model"),
            "mesh": _names("mesh", model.meshes, "gear mesh"),
            "frequency": (("frequency",), spectrum.frequency, "Hz", "frequency"),
            "order": (("order",), order, "1", "order of the first body"),
            "line": _names("line", [line.name for line in lines], "line"),
            "base": _names("base", model.bases, "base frequency: turn of a carrier, or mesh"),
        }
        attrs = {
            "title": "spectra of the mesh forces",
            "window": WINDOW,
            "segments": spectrum.segments,
            "overlap": 0.5,
            "resolution": spectrum.resolution,
            "bandwidth": spectrum.bandwidth,
            "order_resolution": distance,
            "settle": self.settle,
            "speed": self.speed,
            "planetary_stages": len(model.train.planetary),
        }
        return Contents(variables, coords, attrs)


def _names(name: str, values, long_name: str) -> tuple:
    """A coordinate of names, those that come again with a number."""
    return (name,), numbered([str(value) for value in values]), "1", long_name


def _energies(model, shape):
    """Members, their shares of the kinetic energy (members, modes), and the share of rotations (modes,)."""
    density = shape * (model.system.M @ shape)
    density = density / density.sum(axis=0)
    owner = [name.split(":")[0] for name in model.system.dofs]
    members = list(dict.fromkeys(owner))
    energy = np.zeros((len(members), shape.shape[1]))
    np.add.at(energy, [members.index(body) for body in owner], density)
    turning = [name.endswith(": rotation") for name in model.system.dofs]
    return members, energy, density[turning].sum(axis=0)


def _kinds(frequency, rotation) -> list[str]:
    rigid = frequency < 1e-7 * frequency.max(initial=1e-300)
    words = np.where(rotation > _TORSION, "torsional", np.where(rotation < 1.0 - _TORSION, "bending", "mixed"))
    return [str(word) for word in np.where(rigid, "rigid", words)]


def transient_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what transient.nc says against itself."""
    pulling, least = data["pulling"].values, data["least_force"].values
    for v, variant in enumerate(data["variant"].values):
        if pulling[v].any() and least[v].min() < -_NOTHING and not separating(data):
            remedy = "simulation.contact_loss = true lets them"
            yield pull(str(variant), data["mesh"].values, least[v], pulling[v], remedy=remedy)
    for variant, lost in zip(data["variant"].values, data["lost"].values):
        if names := [str(mesh) for mesh, share in zip(data["mesh"].values, lost) if share >= 1.0]:
            text = f"{variant}: the teeth of {', '.join(names)} never touch and transmit nothing"
            yield Finding("W-PARTED", "", text, remedy="give torques or a start that close the flanks")
    yield from _growth_warnings(data)
    for name, words in (("energy_error", "energy"), ("momentum_error", "angular momentum")):
        if not (error := float(data[name].max())) <= BALANCE:
            text = f"the balance of {words} misses {error:.1e} of its largest term"
            yield Finding("W-BALANCE", "", text)


def _growth_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """Parametric resonances; with contact loss motions that depend on every detail, steps included."""
    duration, parts = float(data.attrs["steps"]) * float(data.attrs["step"]), separating(data)
    pulls = data["least_force"].values.min(axis=1, initial=0.0) < -_NOTHING
    for (variant, rate, gain), pulled in zip(_growth(data), pulls):
        grows = rate * duration > math.log(_GROWN)
        if grows and parts:
            text = (
                f"{variant}: neighbouring motions move apart with {rate:.4g} 1/s: times of contact "
                "and peaks depend on every detail, the steps included"
            )
            yield Finding("W-CHAOS", "", text, remedy="compare two values of simulation.rate")
        if parts or not (grows or gain > _GAINED):
            continue
        if grows:
            times = _shown_factor(rate * duration / math.log(10.0))
            growing = f"grows with {rate:.4g} 1/s, {times} times over the run"
        else:
            way = "grows slowly" if rate > 0.0 else "decays"
            growing = f"{way} in the mean, but grows {_shown_factor(math.log10(gain))} times on the way"
        senseless = gain > _GAINED and pulled
        text = (
            f"{variant}: the free motion {growing}: a parametric resonance"
            f"{'; these forces mean nothing: real teeth part long before' if senseless else ''}"
        )
        remedy = "give more damping or another speed, or contact_loss = true"
        yield Finding("W-GROWTH", "", text, remedy=remedy)


def separating(data: xr.Dataset) -> bool:
    """Tell whether the meshes of transient.nc lose contact."""
    return data.attrs["contact"] == "separating"


def _growth(data: xr.Dataset) -> Iterator[tuple[str, float, float]]:
    """Variants, rates [1/s] and largest growths of their free motions."""
    growth_and_gain = (data[name].values.tolist() for name in ("growth", "gain"))
    yield from zip(map(str, data["variant"].values), *growth_and_gain)


def _shown_factor(power: float) -> str:
    """Ten to a power that may be beyond all numbers."""
    return f"{10.0**power:.3g}" if power < 300.0 else f"1e{power:.0f}" if math.isfinite(power) else "1e308"


def describe_drivetrain(case: DrivetrainCase) -> tuple[Block, ...]:
    """Tabulate bodies, shafts, gear stages and operation of a case; refuses what `check_drivetrain` does."""
    model = check_drivetrain(case)
    return _bodies(case, model), _shafts(model), _stages(case, model), _operation(case, model)


def _bodies(case: DrivetrainCase, model: DrivetrainModel) -> Block:

    def bearings(body) -> str:
        # a bearing inside a shaft counts with its first body
        held = [bearing for bearing in model.train.bearings if body.name in (bearing.body, *(bearing.shaft or ())[:1])]
        return _spring(sum(bearing.radial for bearing in held), 3) if held else "-"

    columns = {
        "": lambda body: body.name,
        "inertia [kg m^2]": lambda body: f"{body.inertia:.6g}",
        "mass [kg]": lambda body: f"{body.mass:.6g}",
        "about a diameter": lambda body: f"{body.transverse_inertia:.6g}" if body.tilts else "-",
        "bearings [N/m]": bearings,
        "ratio": lambda body: f"{model.ratio[body.name]:.6g}",
        "speed [rpm]": lambda body: f"{model.ratio[body.name] * case.operation.speed / RPM:.4f}",
    }
    notes = (
        f"{len(model.rigid)} degrees of freedom, {len(model.meshes)} meshes; inertia of the chain about the "
        f"axis of {model.train.bodies[0].name} {model.inertia:.6g} kg m^2",
    )
    return tabulate("Bodies", model.train.bodies, columns, notes)


def _shafts(model: DrivetrainModel) -> Block:
    columns = {
        "": lambda shaft: " - ".join(shaft.between),
        "length [m]": lambda shaft: f"{shaft.length:.4g}",
        "bending [N m/rad]": lambda shaft: _spring(shaft.springs.bending, 4),
        "torsion [N m/rad]": lambda shaft: _spring(shaft.springs.torsion, 4),
        "shear [N/m]": lambda shaft: _spring(shaft.springs.shear, 4),
        "model": lambda shaft: f"beam, {shaft.elements} elements" if shaft.elements else "joint",
    }
    return tabulate("Shafts", model.train.shafts, columns)


def _spring(stiffness: float, digits: int) -> str:
    return "rigid" if math.isinf(stiffness) else f"{stiffness:.{digits}g}"


def _stages(case: DrivetrainCase, model: DrivetrainModel) -> Block:
    train, hertz = model.train, model.frequencies(case.operation.speed) / (2.0 * np.pi)
    rows = []
    for number, stage in enumerate(train.stages):
        meshes = [i for i, mesh in enumerate(train.meshes) if mesh.stage == number and not mesh.planet]
        waves, radii, (first, second) = [train.meshes[i].section for i in meshes], stage.pitch_radii, stage.ends
        if isinstance(stage, PlanetarySection):
            n = len(stage.angles)
            planet, sized = stage.planet_teeth_or_half, stage.planet_teeth or stage.module
            of_planet = f"{planet:g} / " if sized else ""
            teeth = f"{stage.sun_teeth} / {of_planet}{stage.ring_teeth}, {n} planet{'s' * (n > 1)}"
            radii = (*radii, stage.ring_radius)
        else:
            teeth = f"{stage.teeth[0]} / {stage.teeth[1]}"
        rows.append(
            (
                stage.name,
                stage.driver or first,
                teeth,
                ", ".join(f"{1e3 * radius:.4f}" for radius in radii),
                f"{model.ratio[second] / model.ratio[first]:.5g}",
                ", ".join(f"{wave.contact_ratio:.4g}" for wave in waves),
                ", ".join(f"{wave.stiffness:.4g}" for wave in waves),
                f"{hertz[model.mesh_base[meshes[0]]]:.4f}",
            )
        )
    header = (
        "stage",
        "driver",
        "teeth",
        "pitch radii [mm]",
        "ratio",
        "contact ratio",
        "stiffness [N/m]",
        "mesh [Hz]",
    )
    return Block("Gear stages", header, tuple(rows))


def _operation(case: DrivetrainCase, model: DrivetrainModel) -> Block:
    rows, drive = [], 0.0
    for torque_history in torque_histories(case, model.ratio):
        low, high = torque_history.values.min(), torque_history.values.max()
        text = f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}, {len(torque_history.times)} points"
        rows.append((torque_history.body, text))
        drive += float(torque_history.values[0]) * model.ratio[torque_history.body]
    s = case.simulation
    contact = "meshes part" if s.contact_loss else "meshes keep contact"
    change, last = drive / model.inertia / RPM, case_speeds(case, model).last / RPM
    notes = (
        f"first body {case.operation.speed / RPM:.6g} rpm at the start, where the torques change it by "
        f"{round(change, 6) + 0.0:.4g} rpm a second; {last:.6g} rpm at the end",
        f"{s.duration:g} s at {s.rate:g} steps a second, {record_rate(case, model):g} records a second; {contact}",
        _damping(s.damping_ratio),
    )
    return Block("Operation", ("torque on", "[N m]"), tuple(rows), notes)


def _damping(ratio: float) -> str:
    return f"damping {100.0 * ratio:g} % of critical in all modes" if ratio else "no damping"


def describe_drivetrain_modes(data: xr.Dataset) -> Block:
    """Tabulate frequencies, kinds and kinetic energies of the first modes of modes.nc."""

    def where(mode: xr.Dataset) -> str:
        energy, members = mode["energy"].values, mode["member"].values
        return ", ".join(f"{members[m]} {energy[m]:.0%}" for m in np.argsort(-energy)[:2])

    columns = {"rotation": lambda mode: f"{float(mode.rotation_share):.1%}", "kinetic energy in": where}
    block = describe_modes(data, columns, digits=3)
    if not data.sizes["base"]:
        return block
    lines = zip(data["base"].values, data["mesh_frequency"].values)
    text = ", ".join(f"{name} {float(value):.3f} Hz" for name, value in lines)
    return replace(block, notes=(*block.notes, f"mesh lines: {text}"))


def describe_transient(data: xr.Dataset) -> Block:
    """Tabulate transient.nc: mesh forces [kN] of all steps beside the recorded ones, speeds, balances."""
    rows, recorded = [], data["mesh_force"].values
    mean, low, high = (getattr(recorded, name)(axis=1) for name in ("mean", "min", "max"))
    least, largest, pulling = (data[name].values for name in ("least_force", "largest_force", "pulling"))
    parts, thinned = separating(data), int(data.attrs["every"]) > 1
    for v, variant in enumerate(data["variant"].values):
        for m, mesh in enumerate(data["mesh"].values):
            shown = (mean, least, largest, *((low, high) if thinned else ()))
            forces = [f"{1e-3 * values[v, m]:.4f}" for values in shown]
            shares = [f"{100.0 * pulling[v, m]:.2f}"]
            if parts:
                shares.insert(0, f"{100.0 * float(data['lost'][v, m]):.2f}")
            rows.append((str(variant), str(mesh), *forces, *shares))
    shares = ("no contact [% of time]", "back flank [% of time]") if parts else ("pulling [% of time]",)
    records = ("least recorded [kN]", "largest recorded [kN]") if thinned else ()
    header = ("model", "mesh", "mean [kN]", "least [kN]", "largest [kN]", *records, *shares)
    speed, body = data["speed"].values[0], str(data["body"].values[0])
    recorded = [
        f"recorded: what is left of them in files and pictures, every {data.attrs['every']}th step "
        f"behind a low pass that ends at {pass_band(data):.4g} Hz"
    ] * thinned
    notes = [
        f"{data.attrs['steps']} steps, at any of which least and largest force may be; {body} from "
        f"{speed[0, 0] / RPM:.4f} to {speed[-1, 0] / RPM:.4f} rpm",
        *recorded,
        _damping(float(data.attrs["damping_ratio"])),
        f"energy balance {float(data['energy_error'].max()):.1e}, angular momentum "
        f"{float(data['momentum_error'].max()):.1e}",
        *_growth_notes(data),
    ]
    if pulling.any() and not parts:
        notes.append("these meshes are linear and keep contact: where they pull, real teeth part")
    return Block("Transient", header, tuple(rows), tuple(notes))


def pass_band(data: xr.Dataset) -> float:
    """Compute the end of the pass band of the records of transient.nc [Hz]."""
    return 0.5 * PASS_BAND / (float(data.attrs["step"]) * int(data.attrs["every"]))


def _growth_notes(data: xr.Dataset) -> Iterator[str]:
    for variant, rate, gain in _growth(data):
        if not math.isfinite(rate):
            continue
        if separating(data):
            words = "move apart: the motion is chaotic or unstable" if rate > 0.0 else "draw together"
            yield f"{variant}: neighbouring motions {words} (Lyapunov exponent {rate:.4g} 1/s)"
        else:
            way = "grows" if rate > 0.0 else "decays"
            text = f"{variant}: the free motion {way} with {abs(rate):.4g} 1/s in the mean"
            yield f"{text}, at most {_shown_factor(math.log10(gain))} times" if gain > _GROWN else text


def describe_spectrum(data: xr.Dataset) -> Block:
    """Tabulate spectrum.nc: amplitudes of the named lines [N], of one mesh of every kind."""
    meshes, amplitude = chosen_meshes(data), data["line_amplitude"].values
    names, variants = symbols(data), [str(name) for name in data["variant"].values]
    rows = []
    for i, orders in enumerate(data["line_orders"].values):
        mark = "" if bool(data["resolved"][i]) else " *"
        cells = (" / ".join(_newtons(value) for value in amplitude[:, i, m]) for m in meshes)
        rows.append((_combination(orders, names) + mark, f"{float(data['line_frequency'][i]):.3f}", *cells))
    header = ("line", "[Hz]", *(f"{data['mesh'].values[m]} [N]" for m in meshes))
    notes = [
        ", ".join(f"{names[b]}: {name}" for b, name in enumerate(data["base"].values)),
        f"amplitudes of the mesh forces after {float(data.attrs['settle']):g} s, peak values; frequencies at "
        "the mean speed",
    ]
    if len(variants) > 1:
        notes.append(f"in every cell: {' / '.join(variants)}")
    if not data["resolved"].values.all():
        notes.append("*: the record is too short to part this line from a neighbour")
    return Block("Spectrum", header, tuple(rows), tuple(notes))


def _newtons(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}" if value >= 0.1 else "< 0.1"


def _combination(orders, names) -> str:
    """A line as the sum of base frequencies, the largest first: ``f1 - 2 t``."""
    terms = ""
    for base in sorted(np.flatnonzero(orders), key=lambda base: (orders[base] < 0, names[base][0] == "t", -base)):
        count, name = int(orders[base]), names[base]
        size = name if abs(count) == 1 else f"{abs(count)} {name}"
        terms += f" {'-' if count < 0 else '+'} {size}" if terms else size
    return terms


def chosen_meshes(data: xr.Dataset) -> list[int]:
    """Choose a mesh of every kind: of planet 1 of every planetary stage, and of every parallel stage."""
    numbers = [_PLANET.search(str(name)) for name in data["mesh"].values]
    return [i for i, match in enumerate(numbers) if match is None or match[1] == "1"][:MOST_PANELS]


def symbols(data: xr.Dataset) -> list[str]:
    """Name the base frequencies of spectrum.nc shortly: t, or t1 .., turns of carriers; f1 .. meshes."""
    stages, symbols_, meshes = int(data.attrs["planetary_stages"]), [], 0
    for base in range(data.sizes["base"]):
        if base < 2 * stages and base % 2 == 0:
            symbols_.append("t" if stages == 1 else f"t{base // 2 + 1}")
        else:
            meshes += 1
            symbols_.append(f"f{meshes}")
    return symbols_
