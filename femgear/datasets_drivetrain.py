"""Results of a drivetrain case as xarray datasets: modes.nc, transient.nc, spectrum.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.datasets import RPM, dataset
from femgear.models.drivetrain_names import numbered

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis_drivetrain import DrivetrainModesResult, SpectrumResult, TransientResult

# Share of rotations in the kinetic energy above which a mode is torsional; bending below what is left.
_TORSION = 0.9


def _names(name: str, values, long_name: str) -> tuple:
    """A coordinate of names, those that come again with a number."""
    return (name,), numbered([str(value) for value in values]), "1", long_name


def drivetrain_modes_dataset(result: DrivetrainModesResult) -> xr.Dataset:
    """Contents of modes.nc of a drivetrain."""
    modes, model, found = result.modes, result.model, result.campbell
    members, energy, rotation = _energies(model, modes.shape)
    bases = np.unique(model.mesh_base)
    variables = {
        "frequency": (("mode",), modes.frequency, "Hz", "undamped natural frequency"),
        "damping_ratio": (("mode",), modes.damping_ratio, "1", "fraction of critical damping"),
        "kind": (("mode",), _kinds(modes.frequency, rotation), "1", "rigid, torsional, bending or mixed"),
        "rotation_share": (("mode",), rotation, "1", "share of rotations in the kinetic energy"),
        "energy": (("member", "mode"), energy, "1", "share of the member in the kinetic energy"),
        "shape": (("dof", "mode"), modes.shape, "kg^-1/2", "mass-normalised mode shape"),
        "mesh_stiffness": (("mesh",), model.mean_stiffness, "N/m", "mean mesh stiffness"),
        "mesh_deflection": (
            ("mesh", "mode"), modes.mesh_deflection, "kg^-1/2", "mesh deflection of the mode",
        ),
        "ratio": (("body",), list(model.ratio.values()), "1", "speed over that of the first body"),
        "base_order": (("base",), model.base_ratio[bases], "1", "mesh frequency over the first body's turn"),
        "mesh_frequency": (
            ("base",), model.base_ratio[bases] * result.speed / (2 * np.pi), "Hz",
            "mesh frequency at the speed of the operation",
        ),
        "campbell_frequency": (
            ("campbell_speed", "branch"), found.frequency, "Hz", "natural frequency over the speed",
        ),
        "critical_speed": (
            ("crossing",), [c.speed / RPM for c in found.critical], "rpm", "speed of a mesh line on a branch",
        ),
        "critical_frequency": (
            ("crossing",), [c.frequency for c in found.critical], "Hz", "frequency there",
        ),
    }  # fmt: skip
    coords = {
        "mode": (("mode",), np.arange(len(modes.frequency)), "1", "mode"),
        "dof": _names("dof", model.system.dofs, "degree of freedom"),
        "member": _names("member", members, "body, planet or shaft station"),
        "mesh": _names("mesh", model.meshes, "gear mesh"),
        "body": _names("body", model.ratio, "body"),
        "base": _names("base", [model.bases[b] for b in bases], "mesh of a stage"),
        "campbell_speed": (("campbell_speed",), found.speed / RPM, "rpm", "speed of the first body"),
    }
    attrs = {"title": "modes of the drivetrain, mean mesh stiffness", "unknowns": len(modes.shape)}
    return dataset(variables, coords, attrs)


def _energies(model, shape):
    """Members, their shares of the kinetic energy (members, modes), and the share of rotations (modes,)."""
    density = shape * (model.system.M @ shape)
    density = density / density.sum(axis=0)
    owner = [name.split(":")[0] for name in model.system.dofs]
    members = list(dict.fromkeys(owner))
    energy = np.zeros((len(members), shape.shape[1]))
    np.add.at(energy, [members.index(one) for one in owner], density)
    turning = [name.endswith(": rotation") for name in model.system.dofs]
    return members, energy, density[turning].sum(axis=0)


def _kinds(frequency, rotation) -> list[str]:
    rigid = frequency < 1e-7 * frequency.max(initial=1e-300)
    words = np.where(
        rotation > _TORSION, "torsional", np.where(rotation < 1.0 - _TORSION, "bending", "mixed")
    )
    return [str(word) for word in np.where(rigid, "rigid", words)]


def transient_dataset(result: TransientResult) -> xr.Dataset:
    """Contents of transient.nc."""
    runs = list(result.runs.values())
    first, model = runs[0], next(iter(result.models.values()))
    ratio = np.array(list(model.ratio.values()))
    bodies, tvb = list(model.ratio), ("variant", "time", "body")
    torque = np.zeros((len(first.time), len(bodies)))
    for history in result.torques:
        torque[:, bodies.index(history.body)] += history.at(first.time)
    speed = [run.spin_speed[:, None] * ratio + run.velocity for run in runs]
    negative = "on the back flank" if first.contact_loss else "where the linear mesh pulls"
    books = {
        "energy_error": ([run.ledger.error for run in runs], "error of the energy balance, relative"),
        "momentum_error": ([run.momentum for run in runs], "error of the angular momentum, relative"),
    }
    variables = {
        "spin": (
            ("variant", "time"), [run.spin for run in runs], "rad",
            "angle of the first body without its deviation",
        ),
        "speed": (tvb, speed, "rad/s", "speed of rotation"),
        "deviation": (
            tvb, [run.motion for run in runs], "rad", "rotation less that of the free spin, ratio times spin",
        ),
        "mesh_force": (
            ("variant", "time", "mesh"), [run.force for run in runs], "N",
            f"mesh force along the line of action; negative {negative}",
        ),
        "least_force": (
            ("variant", "mesh"), [run.extremes[0] for run in runs], "N", "least mesh force at any step",
        ),
        "largest_force": (
            ("variant", "mesh"), [run.extremes[1] for run in runs], "N", "largest mesh force at any step",
        ),
        "pulling": (
            ("variant", "mesh"), [run.pulling for run in runs], "1", "share of steps with a negative force",
        ),
        "lost": (
            ("variant", "mesh"), [run.lost for run in runs], "1", "share of steps in which no flank touches",
        ),
        "growth": (
            ("variant",), [run.growth for run in runs], "1/s",
            "mean rate of the logarithm of the free motion: above zero it grows",
        ),
        "gain": (
            ("variant",), [run.gain for run in runs], "1",
            "largest growth of the free motion between two instants of the run, as a factor",
        ),
        "torque": (("time", "body"), torque, "N m", "external torque"),
        "ratio": (("body",), ratio, "1", "speed over that of the first body"),
        **{name: (("variant",), values, "1", words) for name, (values, words) in books.items()},
    }  # fmt: skip
    coords = {
        "variant": _names("variant", result.runs, "model"),
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
        "filter": "linear-phase low pass, 0.8 to 1.0 of half the record rate, 80 dB" if every > 1 else "none",
    }
    return dataset(variables, coords, attrs)


def spectrum_dataset(result: SpectrumResult) -> xr.Dataset:
    """Contents of spectrum.nc."""
    from femgear.models.drivetrain_lines import resolved_lines

    transient = result.transient
    model, variants = next(iter(transient.models.values())), list(result.spectra)
    some, tracked = result.spectra[variants[0]], result.orders
    length = min(len(one.frequency) for one in tracked.values())
    order = tracked[variants[0]].frequency[:length]
    lines, distance = result.lines, result.order_distance
    variables = {
        "amplitude": (
            ("variant", "mesh", "frequency"), [result.spectra[v].amplitude for v in variants], "N",
            "amplitude spectrum of the mesh force, root of the mean square of the segments, peak values",
        ),
        "order_amplitude": (
            ("variant", "mesh", "order"), [tracked[v].amplitude[:, :length] for v in variants], "N",
            "amplitude of the mesh force over orders of the first body, one segment, peak values",
        ),
        "line_order": (("line",), [line.order for line in lines], "1", "order of the first body"),
        "line_frequency": (
            ("line",), [line.order * result.speed / (2 * np.pi) for line in lines], "Hz",
            "frequency at the mean speed",
        ),
        "line_amplitude": (
            ("variant", "line", "mesh"), [result.amplitudes[v] for v in variants], "N",
            "amplitude of the line, peak value; NaN beyond the pass band",
        ),
        "line_orders": (
            ("line", "base"), [line.orders for line in lines], "1", "multiples of the base frequencies",
        ),
        "mesh_base": (("mesh",), model.mesh_base, "1", "number of the base of the mesh stiffness"),
        "resolved": (
            ("line",), resolved_lines(model, lines, distance), "1",
            "whether the record parts the line from its neighbours",
        ),
    }  # fmt: skip
    coords = {
        "variant": _names("variant", variants, "model"),
        "mesh": _names("mesh", model.meshes, "gear mesh"),
        "frequency": (("frequency",), some.frequency, "Hz", "frequency"),
        "order": (("order",), order, "1", "order of the first body"),
        "line": _names("line", [line.name for line in lines], "line"),
        "base": _names("base", model.bases, "base frequency: turn of a carrier, or mesh"),
    }
    attrs = {
        "title": "spectra of the mesh forces",
        "window": some.window,
        "segments": some.segments,
        "overlap": 0.5,
        "resolution": some.resolution,
        "bandwidth": some.bandwidth,
        "order_resolution": distance,
        "settle": result.settle,
        "speed": result.speed,
        "planetary_stages": len(model.train.planetary),
    }
    return dataset(variables, coords, attrs)
