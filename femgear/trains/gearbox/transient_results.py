"""Results of a gearbox in time: transient.nc and spectrum.nc, their tables and warnings.

Every variable of a file carries its units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.quantities import RPM
from femgear.findings import NOTE, Finding
from femgear.report.tables import Block, pull
from femgear.solvers.time.flank_motion import BALANCE, MarchedRun
from femgear.solvers.time.low_pass import PASS_BAND
from femgear.stages.protocol import StageResult
from femgear.storage.contents import Contents
from femgear.trains.gearbox.transient import GearboxInTime, GearboxMotion
from femgear.trains.gearbox.transient_checks import slow_steps

if TYPE_CHECKING:
    import xarray as xr

LOW_PASS = "linear-phase low pass, 0.8 to 1.0 of half the record rate, 80 dB"
MOST_PANELS = 6
"""Panels of a figure."""
WINDOW = "hann"
"""Of the segments of spectra."""
_PLANET = re.compile(r" (?:sun-planet (\d+)|planet (\d+)-ring)$")
# Linear meshes: a free motion that grows by more than this over a run is no longer small.
_GROWN = 10.0
# The same between any two instants of it.
_GAINED = 1e3
# A force that is rounding [N].
_NOTHING = 1e-6


@dataclass(frozen=True)
class TransientResult(StageResult):
    """Motion in time, by variant: ``motions`` of the gearbox, and of its rotations alone where that is asked for.

    ``mesh_mode`` is the highest mode that the meshes drive noticeably [Hz].
    """

    motions: dict[str, GearboxMotion]
    mesh_mode: float

    @property
    def first(self) -> GearboxMotion:
        """Motion of the gearbox as its case describes it."""
        return next(iter(self.motions.values()))

    @property
    def converged(self) -> bool:
        """Whether energy and angular momentum balance."""
        return self.residual <= BALANCE

    @property
    def residual(self) -> float:
        """Largest error of the balances of energy and angular momentum, relative."""
        runs = [motion.run for motion in self.motions.values()]
        return float(max(max(run.energy_balance.error, run.momentum) for run in runs))

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
        runs, model = [motion.run for motion in self.motions.values()], self.first.model
        first, shafts, case = runs[0], list(self.first.shafts), model.box.deflection.model.case
        ratio = np.array([model.ratio[name] for name in shafts])
        torques = model.torques
        torque = np.column_stack([history.at(first.time) for history in torques] or [np.zeros((len(first.time), 0))])
        negative = "on the back flank" if first.contact_loss else "where the linear mesh pulls"
        variables = {
            name: (("variant", *dims), [value(run) for run in runs], unit, text)
            for name, dims, value, unit, text in _of_runs(negative, ratio)
        }
        energy, momentum = [run.energy_balance.error for run in runs], [run.momentum for run in runs]
        variables |= {
            "torque": ("time load", torque, "N m", "external torque"),
            "ratio": (("shaft",), ratio, "1", "speed over that of the reference shaft"),
            "energy_error": (("variant",), energy, "1", "error of the energy balance, relative"),
            "momentum_error": (("variant",), momentum, "1", "error of the angular momentum, relative"),
        }
        coords = {
            "variant": _names("variant", self.motions, "motions of the gearbox"),
            "time": (("time",), first.time, "s", "time"),
            "shaft": _names("shaft", shafts, "shaft"),
            "mesh": _names("mesh", first.meshes, "gear mesh"),
            "load": _names("load", [history.body for history in torques], "where torque acts"),
        }
        every = 1 if len(first.time) < 2 else round((first.time[1] - first.time[0]) / first.step)
        attrs = {
            "title": "motion of the gearbox in time",
            "step": first.step,
            "steps": first.steps,
            "every": every,
            "contact": "separating" if first.contact_loss else "linear",
            "damping_ratio": case.modes.damping_ratio,
            "filter": LOW_PASS if every > 1 else "none",
            "shaft_of_speed": model.shaft,
            "mesh_mode": self.mesh_mode,
            "settle": 0.0 if case.transient is None else case.transient.settled,
        }
        return Contents(variables, coords, attrs)


def _of_runs(
    negative: str, ratio: np.ndarray
) -> tuple[tuple[str, tuple[str, ...], Callable[[MarchedRun], Any], str, str], ...]:
    """List the variables of every motion in time: name, dimensions, value of a `MarchedRun`, unit, words.

    ``negative`` says where forces are negative, ``ratio`` (n_shafts,) are speeds over that of the reference shaft.
    """
    time, mesh, moving = ("time",), ("mesh",), ("time", "shaft")
    return (
        ("spin", time, lambda r: r.angle, "rad", "angle of the reference shaft without its deviation"),
        ("speed", moving, lambda r: r.speed[:, None] * ratio + r.velocity, "rad/s", "speed of rotation"),
        ("deviation", moving, lambda r: r.motion, "rad", "rotation less that of the rigid gearbox"),
        (
            "mesh_force",
            ("time", "mesh"),
            lambda r: r.force,
            "N",
            f"mesh force along the normal; negative {negative}",
        ),
        ("least_force", mesh, lambda r: r.extremes[0], "N", "least mesh force at any step"),
        (
            "settled_force",
            mesh,
            lambda r: r.settled_least,
            "N",
            "least mesh force at any step after the settling time",
        ),
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
        Mean speed of the shaft that gives it after that [rad/s].
    spectra, orders : dict of AveragedSpectrum
        By variant, amplitudes of the mesh forces [N] over the frequency [Hz], and over the order, multiples of the
        turn of this shaft [1].
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
        model, variants = self.transient.first.model, list(self.spectra)
        spectrum, tracked = self.spectra[variants[0]], self.orders
        length = min(len(order_spectrum.frequency) for order_spectrum in tracked.values())
        order = tracked[variants[0]].frequency[:length]
        lines, distance = self.lines, self.order_distance
        amplitude = [self.spectra[v].amplitude for v in variants]
        by_order = [tracked[v].amplitude[:, :length] for v in variants]
        averaged = "amplitude spectrum of the mesh force, root of the mean square of the segments, peak values"
        single = "amplitude of the mesh force over orders, one segment, peak values"
        line, orders = [self.amplitudes[v] for v in variants], np.array([mesh_line.order for mesh_line in lines])
        hertz, multiples = orders * self.speed / (2 * np.pi), [mesh_line.orders for mesh_line in lines]
        of_line = "amplitude of the line, peak value; NaN beyond the pass band"
        variables = {
            "amplitude": ("variant mesh frequency", amplitude, "N", averaged),
            "order_amplitude": ("variant mesh order", by_order, "N", single),
            "line_order": ("line", orders, "1", "order of the reference shaft"),
            "line_frequency": ("line", hertz, "Hz", "frequency at the mean speed"),
            "line_amplitude": ("variant line mesh", line, "N", of_line),
            "line_orders": ("line base", multiples, "1", "multiples of the base frequencies"),
            "mesh_base": ("mesh", bases_of_meshes(model), "1", "number of the base of the mesh stiffness"),
            "turns": (
                "base",
                [any(base == stage.turn_base for stage in model.stages) for base in range(len(model.box.bases))],
                "1",
                "whether the base frequency is the turn of a carrier",
            ),
            "resolved": ("line", self.resolved, "1", "whether the record parts the line from its neighbours"),
        }
        coords = {
            "variant": _names("variant", variants, "model"),
            "mesh": _names("mesh", model.spun.meshes, "gear mesh"),
            "frequency": (("frequency",), spectrum.frequency, "Hz", "frequency"),
            "order": (("order",), order, "1", "order of the reference shaft"),
            "line": _names("line", [line.name for line in lines], "line"),
            "base": _names("base", model.box.bases, "base frequency: turn of a carrier, or mesh"),
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
            "shaft_of_speed": model.shaft,
        }
        return Contents(variables, coords, attrs)


def _names(name: str, values, long_name: str) -> tuple:
    """A coordinate of names."""
    return (name,), [str(value) for value in values], "1", long_name


def bases_of_meshes(model: GearboxInTime) -> list[int]:
    """Number of the base frequency of every mesh."""
    return [stage.mesh_base for stage in model.stages for _ in stage.meshes]


def transient_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what transient.nc says against itself; a pull before the settling time alone is a note."""
    pulling, least = data["pulling"].values, data["least_force"].values
    # files of former versions do not tell what is before the settling time
    settled = data["settled_force"].values if "settled_force" in data else least
    for v, variant in enumerate(data["variant"].values):
        if pulling[v].any() and least[v].min() < -_NOTHING and not separating(data):
            remedy, settles = "transient.contact_loss = true lets them", settled[v].min() >= -_NOTHING
            more = f", but only before {data.attrs['settle']:g} s (transient.settle)" if settles else ""
            warning = pull(str(variant), data["mesh"].values, least[v], pulling[v], more=more, remedy=remedy)
            yield replace(warning, severity=NOTE) if settles else warning
    for variant, lost in zip(data["variant"].values, data["lost"].values):
        if names := [str(mesh) for mesh, share in zip(data["mesh"].values, lost) if share >= 1.0]:
            text = f"{variant}: the teeth of {', '.join(names)} never touch and transmit nothing"
            yield Finding("W-PARTED", "", text, remedy="give torques or a start that close the flanks")
    yield from slow_steps(float(data.attrs["mesh_mode"]), 1.0 / float(data.attrs["step"]))
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
            yield Finding("W-CHAOS", "", text, remedy="compare two values of transient.rate")
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
        remedy = "give more damping or another speed, or transient.contact_loss = true"
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
    body = str(data.attrs["shaft_of_speed"])
    speed = data["speed"].sel(shaft=body).values[0]
    recorded = [
        f"recorded: what is left of them in files and pictures, every {data.attrs['every']}th step "
        f"behind a low pass that ends at {pass_band(data):.4g} Hz"
    ] * thinned
    notes = [
        f"{data.attrs['steps']} steps, at any of which least and largest force may be; {body} from "
        f"{speed[0] / RPM:.4f} to {speed[-1] / RPM:.4f} rpm",
        *recorded,
        _damping(float(data.attrs["damping_ratio"])),
        f"energy balance {float(data['energy_error'].max()):.1e}, angular momentum "
        f"{float(data['momentum_error'].max()):.1e}",
        *_growth_notes(data),
    ]
    if pulling.any() and not parts:
        notes.append("these meshes are linear and keep contact: where they pull, real teeth part")
    return Block("Transient", header, tuple(rows), tuple(notes))


def _damping(ratio: float) -> str:
    return f"damping {100.0 * ratio:g} % of critical in all modes" if ratio else "no damping"


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
    """Choose a mesh of every kind: of planet 1 of every planetary stage, and of every pair."""
    numbers = [_PLANET.search(str(name)) for name in data["mesh"].values]
    return [i for i, match in enumerate(numbers) if match is None or "1" in match.groups()][:MOST_PANELS]


def symbols(data: xr.Dataset) -> list[str]:
    """Name the base frequencies of spectrum.nc shortly: t, or t1 .., turns of carriers; f1 .. meshes."""
    turns, names, meshes = np.flatnonzero(data["turns"].values).tolist(), [], 0
    for base in range(data.sizes["base"]):
        if base in turns:
            names.append("t" if len(turns) == 1 else f"t{turns.index(base) + 1}")
        else:
            meshes += 1
            names.append(f"f{meshes}")
    return names
