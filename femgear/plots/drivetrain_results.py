"""Figures of a drivetrain run, from modes.nc, transient.nc and spectrum.nc."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from femgear.plots.drivetrain import over_time, spectra, stiffness_series
from femgear.plots.frequency import campbell

if TYPE_CHECKING:
    import xarray as xr

    from femgear.models.drivetrain import DrivetrainModel

RPM = np.pi / 30.0
_MOST_PANELS = 6
# Reach of spectra over the highest mesh line, of side bands in turns or planetary mesh lines.
_REACH, _TURNS, _BESIDE = 2.4, 8.0, 1.3
# Fewer lines are no picture of side bands.
_LEAST_LINES = 24
_PLANET = re.compile(r"(?:^|-)planet (\d+)(?:-ring of |$)")


def stiffness_figure(model: DrivetrainModel):
    """Series of the mesh stiffness of every stage, and the rectangular wave.

    Returns
    -------
    Figure
    """
    from femgear.models.drivetrain_meshes import stiffness_levels
    from femgear.solvers.series import FourierSeries

    train, phase = model.train, np.linspace(0.0, 2.0, 1601)
    waves = []
    for stage in train.planetary:
        waves.append((f"{stage.sun}-planet 1", stage.sun_mesh))
        waves.append((f"planet 1-ring of {stage.carrier}", stage.ring_mesh))
    waves += [(stage.name, stage.mesh) for stage in train.parallel]
    curves, steps = [], []
    for text, wave in waves[:_MOST_PANELS]:
        row = model.meshes.index(text)
        curves.append((text, FourierSeries(model.stiffness[row]).at(2.0 * np.pi * phase[:, None])[:, 0]))
        low, high, share = stiffness_levels(wave)
        inside = (phase + wave.phase + 0.5 * share) % 1.0 < share
        steps.append((text, np.where(inside, high, low)))
    return stiffness_series(phase, curves, steps, title=f"{model.stiffness.shape[1] - 1} terms")


def campbell_figure(modes: xr.Dataset):
    """Campbell diagram with the mesh lines of modes.nc.

    Returns
    -------
    Figure
    """
    frequency = modes["campbell_frequency"].values
    top = frequency.max()
    critical = zip(modes["critical_speed"].values, modes["critical_frequency"].values)
    return campbell(
        modes["campbell_speed"].values, frequency, orders=modes["base_order"].values / 60.0,
        order_names=[str(name) for name in modes["base"].values],
        critical=[pair for pair in critical if pair[1] < top], speed_unit="rpm of the first body",
    )  # fmt: skip


def chosen_meshes(data: xr.Dataset) -> list[int]:
    """One mesh of every kind: of planet 1 of every planetary stage, and of every parallel stage."""
    numbers = [_PLANET.search(str(name)) for name in data["mesh"].values]
    return [i for i, found in enumerate(numbers) if found is None or found[1] == "1"][:_MOST_PANELS]


def transient_figures(data: xr.Dataset) -> dict:
    """Speeds, deviations and mesh forces over time, by name."""
    time = data["time"].values
    variants = [str(name) for name in data["variant"].values]
    bodies = [str(name) for name in data["body"].values]
    ends = sorted({0, len(bodies) - 1})

    def panels(name: str, places, titles):
        values = data[name].values
        return [
            (title, [(text, values[v, :, i]) for v, text in enumerate(variants)])
            for i, title in zip(places, titles)
        ]

    shown = [i for i in range(len(bodies)) if i][-_MOST_PANELS:] or [0]
    meshes = chosen_meshes(data)
    figures = {
        "transient_speeds": over_time(
            time, panels("speed", ends, [bodies[i] for i in ends]), unit="speed [rpm]", factor=1.0 / RPM
        ),
        "transient_deviations": over_time(
            time, panels("deviation", shown, [f"{bodies[i]}: rotation less the free spin" for i in shown]),
            unit="deviation [mrad]", factor=1e3,
        ),
    }  # fmt: skip
    if meshes:
        names = [str(data["mesh"].values[i]) for i in meshes]
        figures["transient_forces"] = over_time(
            time, panels("mesh_force", meshes, names), unit="force [kN]", factor=1e-3
        )
    return figures


def symbols(data: xr.Dataset) -> list[str]:
    """Short names of the base frequencies of spectrum.nc: t, or t1 .., turns of carriers; f1 .. meshes."""
    stages, found, meshes = int(data.attrs["planetary_stages"]), [], 0
    for base in range(data.sizes["base"]):
        if base < 2 * stages and base % 2 == 0:
            found.append("t" if stages == 1 else f"t{base // 2 + 1}")
        else:
            meshes += 1
            found.append(f"f{meshes}")
    return found


def spectrum_figures(data: xr.Dataset) -> dict:
    """Spectra over frequency, and side bands over orders, by name; none without meshes."""
    meshes = chosen_meshes(data)
    if not meshes:
        return {}
    lines = _mesh_lines(data)
    frequency, hertz = data["frequency"].values, data["line_frequency"].values
    top = min(frequency[-1], _REACH * max(hertz[line] for line in lines.values()))
    low = frequency <= top
    bases, short = [str(name).removesuffix(" mesh") for name in data["base"].values], symbols(data)
    marks = [(short[base], hertz[line]) for base, line in lines.items()]
    (title, curves), *others = _panels(data, "amplitude", meshes, low)
    title += f"      ({', '.join(f'{short[base]}: {bases[base]}' for base in lines)})"
    figures = {
        "mesh_force_spectrum": spectra(
            frequency[low], [(title, curves), *others], lines=_apart(marks, top),
            unit="force [kN]", factor=1e-3,
        )
    }  # fmt: skip
    for base in lines:
        if (figure := _side_bands(data, base, lines)) is not None:
            figures[f"side_bands_{bases[base].replace(' ', '_')}"] = figure
    return figures


def _mesh_lines(data) -> dict[int, int]:
    """Line of the mesh frequency, by the number of its base."""
    orders = data["line_orders"].values
    simple = np.flatnonzero(np.abs(orders).sum(axis=1) == 1)
    meshes = set(data["mesh_base"].values.tolist())
    pairs = [(int(np.flatnonzero(orders[line])[0]), line) for line in simple.tolist()]
    return {base: line for base, line in pairs if base in meshes and orders[line, base] == 1}


def _panels(data, name: str, meshes, kept):
    values = data[name].values
    variants = [str(text) for text in data["variant"].values]
    return [
        (str(data["mesh"].values[i]), [(text, values[v, i, kept]) for v, text in enumerate(variants)])
        for i in meshes
    ]


def _side_bands(data, base: int, lines):
    """Orders around a mesh line: turns of its own carrier, or mesh lines of the first planetary stage."""
    planetary = int(data.attrs["planetary_stages"])
    if not planetary:
        return None
    orders, order = data["line_orders"].values, data["line_order"].values
    own = base < 2 * planetary
    if own:
        turn = np.flatnonzero((np.abs(orders).sum(axis=1) == 1) & (orders[:, base - 1] == 1))[0]
        shift, text, width = order[turn], "turn", _TURNS * order[turn]
    else:
        shift, text = order[lines[1]], "f1"
        width = _BESIDE * shift
    centre, all_orders = order[lines[base]], data["order"].values
    near = np.abs(all_orders - centre) <= width
    if np.count_nonzero(near) < _LEAST_LINES:
        return None
    marks = [(f"{k:+d} {text}" if k else "mesh", centre + k * shift) for k in range(-3, 4)]
    mesh = data["mesh_base"].values.tolist().index(base)
    return spectra(
        all_orders[near], _panels(data, "order_amplitude", [mesh], near),
        lines=[mark for mark in marks if abs(mark[1] - centre) <= width], unit="force [kN]", factor=1e-3,
        x="order of the first body [1]",
    )  # fmt: skip


def _apart(marks, top: float):
    """Marks whose names do not cover one another."""
    found = []
    for text, at in sorted(marks, key=lambda mark: mark[1]):
        if at <= top and (not found or at - found[-1][1] > 0.02 * top):
            found.append((text, at))
    return found
