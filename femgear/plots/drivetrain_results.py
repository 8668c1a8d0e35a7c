"""Figures of a drivetrain run, from modes.nc, transient.nc and spectrum.nc."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from femgear.models.drivetrain_names import numbered
from femgear.models.drivetrain_record import PASS_BAND
from femgear.plots.drivetrain import over_time, spectra, stiffness_series
from femgear.plots.frequency import campbell

if TYPE_CHECKING:
    import xarray as xr

    from femgear.models.drivetrain import DrivetrainModel

RPM = np.pi / 30.0
_MOST_PANELS = 6
# Harmonics of the mesh lines that are marked, and how far beyond the last of the highest line spectra reach.
_HARMONICS = 3
_REACH = 1.04 * _HARMONICS
# Reach of side bands in turns or planetary mesh lines.
_TURNS, _BESIDE = 8.0, 1.3
# Fewer lines are no picture of side bands.
_LEAST_LINES = 24
_PLANET = re.compile(r"(?:^|-)planet (\d+)(?: \d+)?(?:-ring of |$)")


def stiffness_figure(model: DrivetrainModel):
    """Series of the mesh stiffness of every stage, and the rectangular wave.

    Returns
    -------
    Figure
    """
    from femgear.models.drivetrain_meshes import stiffness_levels
    from femgear.solvers.series import FourierSeries

    train, phase = model.train, np.linspace(0.0, 2.0, 1601)
    names, row, waves = numbered(model.meshes), 0, []
    # by position: the planetary stages come first, with all suns' meshes before the rings'
    for stage in train.planetary:
        planets = len(stage.planet_angles)
        waves += [(row, stage.sun_mesh), (row + planets, stage.ring_mesh)]
        row += 2 * planets
    waves += [(row + i, stage.mesh) for i, stage in enumerate(train.parallel)]
    curves, steps = [], []
    for row, wave in waves[:_MOST_PANELS]:
        text = names[row]
        curves.append((text, FourierSeries(model.stiffness[row]).at(2.0 * np.pi * phase[:, None])[:, 0]))
        low, high, share = stiffness_levels(wave)
        inside = (phase + wave.phase + 0.5 * share) % 1.0 < share
        steps.append((text, np.where(inside, high, low)))
    return stiffness_series(phase, curves, steps, title=f"series of {model.stiffness.shape[1] - 1} terms")


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
    bodies, names = ([str(name) for name in data[key].values] for key in ("body", "mesh"))
    ends, meshes = sorted({0, len(bodies) - 1}), chosen_meshes(data)
    shown = [i for i in range(len(bodies)) if i][-_MOST_PANELS:] or [0]
    passed = _pass_band(data)
    turned = [f"{bodies[i]}: rotation less the free spin" for i in shown]
    figures = {
        "transient_speeds": _signals(
            data,
            "speed",
            ends,
            [bodies[i] for i in ends],
            unit="speed [rpm]",
            factor=1.0 / RPM,
            title=passed,
            zero=False,
        ),
        "transient_deviations": _signals(
            data, "deviation", shown, turned, unit="deviation [mrad]", factor=1e3, title=passed
        ),
    }
    if meshes:
        contact = "linear meshes keep contact"
        if separates(data):
            contact = f"meshes part, for up to {float(data['lost'].max()):.2%} of the time"
        notes = (contact, passed, passed and "least and largest force of all steps in the table")
        figures["transient_forces"] = _signals(
            data, "mesh_force", meshes, [names[i] for i in meshes], unit="force [kN]", factor=1e-3,
            title="; ".join(filter(None, notes)),
        )  # fmt: skip
    return figures


def _signals(data: xr.Dataset, name: str, columns, titles, **options):
    """Columns of a variable over time, those of all variants in one panel."""
    values, variants = data[name].values, [str(text) for text in data["variant"].values]
    panels = [
        (title, [(text, values[v, :, i]) for v, text in enumerate(variants)])
        for i, title in zip(columns, titles)
    ]
    return over_time(data["time"].values, panels, **options)


def _pass_band(data: xr.Dataset) -> str:
    """What the low pass of the records of transient.nc leaves."""
    attrs = data.attrs
    if attrs["filter"] == "none":
        return ""
    return f"low-passed to {0.5 * PASS_BAND / (attrs['step'] * attrs['every']):.4g} Hz"


def separates(data: xr.Dataset) -> bool:
    """Whether the meshes of transient.nc part and meet their back flanks."""
    return data.attrs.get("contact") == "separating"


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


def spectrum_figures(data: xr.Dataset, transient: xr.Dataset | None = None) -> dict:
    """Spectra over frequency, and side bands over orders, by name; none without meshes.

    Parameters
    ----------
    data : Dataset
        spectrum.nc
    transient : Dataset, optional
        transient.nc, for the speeds between which the spectra were taken.
    """
    meshes = chosen_meshes(data)
    if not meshes:
        return {}
    lines = _mesh_lines(data)
    frequency, hertz = data["frequency"].values, data["line_frequency"].values
    top = min(PASS_BAND * frequency[-1], _REACH * max(hertz[line] for line in lines.values()))
    low = frequency <= top
    bases, short = [str(name).removesuffix(" mesh") for name in data["base"].values], symbols(data)
    marks = [
        (short[base] if h == 1 else f"{h} {short[base]}", h * hertz[line])
        for base, line in lines.items()
        for h in range(1, _HARMONICS + 1)
    ]
    (title, curves), *others = _panels(data, "amplitude", meshes, low)
    title += f"      ({', '.join(f'{short[base]}: {bases[base]}' for base in lines)})"
    from_to, changes = _speeds(data, transient)
    figures = {
        "mesh_force_spectrum": spectra(
            frequency[low], [(title, curves), *others], lines=marks, unit="force [kN]", factor=1e-3,
            title=f"{from_to}: lines smear over frequency, not over orders" if changes else from_to,
        )
    }  # fmt: skip
    for base in lines:
        if (figure := _side_bands(data, base, lines, from_to)) is not None:
            figures[f"side_bands_{bases[base].replace(' ', '_')}"] = figure
    return figures


def _speeds(data: xr.Dataset, transient: xr.Dataset | None) -> tuple[str, bool]:
    """Speeds of the first body in the spectra, and whether its change shifts a mesh line by a line."""
    settle, mean = float(data.attrs["settle"]), float(data.attrs["speed"])
    if transient is None or "spin" not in transient:
        return f"after {settle:g} s, mean speed {mean / RPM:.4g} rpm", False
    time, spin = transient["time"].values, transient["spin"].values[0]
    speed = np.gradient(spin, time, edge_order=2)[time >= settle]
    body, low, high = str(transient["body"].values[0]), speed.min(), speed.max()
    hertz = data["line_frequency"].values[list(_mesh_lines(data).values())].max(initial=0.0)
    if hertz * (high - low) / mean < float(data.attrs["resolution"]):
        return f"after {settle:g} s, {body} at {mean / RPM:.4g} rpm", False
    return f"after {settle:g} s, {body} from {low / RPM:.4g} to {high / RPM:.4g} rpm", True


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


def _side_bands(data, base: int, lines, title: str):
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
        x="order of the first body [1]", title=title,
    )  # fmt: skip
