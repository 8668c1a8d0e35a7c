"""Contents of stress.nc: root stresses, pressures and load spectra, every variable with its units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.root_stress import BACK, LOADED, RootCycle, worst_history

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis_spectrum import LoadSpectrum
    from femgear.analysis_stress import StressResult

COUNTING = (
    "one load cycle an engagement, from zero to the largest load of the tooth (peak counting between "
    "crossings of zero, ASTM E1049)"
)


def stress_dataset(result: StressResult) -> xr.Dataset:
    """Contents of stress.nc: `root_stress_dataset`, and the rest of a `StressResult`."""
    cycle, edges = result.cycle, result.spectrum.edges
    entries = {
        **_worst_entries(result),
        **_range_entries(result),
        **_pressure_entries(cycle),
        **_load_entries(result.spectrum),
        **_nominal_entries(result),
    }
    data = root_stress_dataset(result.roots, result.planetary_set.mesh_names)
    data = data.assign({name: _variable(*entry) for name, entry in entries.items()})
    middle = 0.5 * (edges[1:] + edges[:-1])
    coordinates = {
        "position": _variable(("position",), cycle.position, "1", "position in mesh periods"),
        "load_bin": _variable(("load_bin",), middle, "N", "middle of the load class"),
    }
    if "turn" in data.dims:
        n = data.sizes["turn"]
        words = "turns of the planet against the carrier since the pitch point with the sun"
        coordinates["turn"] = _variable(("turn",), (np.arange(n) - n // 4) / n, "1", words)
    attributes = {
        "title": "root stresses, contact pressures and load spectra",
        "sun_torque": result.sun_torque,
        "mesh_periods": cycle.periods,
        "repeats": int(result.closes),
        "load_counting": COUNTING,
        "iso": result.nominal.message,
    }
    return data.assign_coords(coordinates).assign_attrs(attributes)


def _load_entries(spectrum: LoadSpectrum) -> dict:
    """Load classes, and how often the teeth of every mesh are in them."""
    by_class = ("mesh", "load_bin")
    words = {
        "time": "share of the time under load that a tooth spends in the load class",
        "cycle": "share of the load cycles whose largest load lies in the load class",
        "cycles": "load cycles of this flank of a tooth per turn of the gear against the carrier",
    }
    return {
        "load_bin_low": (("load_bin",), spectrum.edges[:-1], "N", "lower limit of the load class"),
        "load_bin_high": (("load_bin",), spectrum.edges[1:], "N", "upper limit of the load class"),
        "load_time_share": (by_class, spectrum.time, "1", words["time"]),
        "load_cycle_share": (by_class, spectrum.engagements, "1", words["cycle"]),
        "load_cycles": (("mesh", "gear"), spectrum.cycles, "1", words["cycles"]),
        "loaded_contact_ratio": (("mesh",), spectrum.duration, "1", "mesh periods a tooth pair is loaded"),
    }


def _nominal_entries(result: StressResult) -> dict:
    """Nominal stresses of both kinds of mesh, repeated for every planet."""
    nominal, N = result.nominal, result.planetary_set.n_planets
    contact, root = np.repeat(nominal.contact, N), np.repeat(nominal.root, N, axis=0)
    return {
        "iso_contact_stress": (("mesh",), contact, "Pa", "nominal contact stress sigma_H0, ISO 6336-2"),
        "iso_root_stress": (
            ("mesh", "gear"),
            root,
            "Pa",
            "nominal root stress sigma_F0, ISO 6336-3 method B",
        ),
    }


def _variable(dims, values, units, long_name):
    return dims, np.asarray(values), {"units": units, "long_name": long_name}


def _worst_entries(result: StressResult) -> dict:
    """Largest stress in the root of the loaded flank of every gear in every mesh, and where it is."""
    rows = []
    each = len(result.cycle.position) // result.cycle.periods
    for root, first in zip(result.roots, result.first_period, strict=True):
        slot, position, point = root.worst
        record = (first * each + position) % len(result.cycle.position)
        place = root.arc[point], root.slope[point]
        rows.append(
            (root.tension[slot, position], *place, result.cycle.position[record], root.path[slot, position])
        )
    values = np.array(rows).reshape(-1, 2, 5)
    words = {
        "root_worst": ("Pa", "largest stress in the root of the loaded flank"),
        "root_worst_arc": ("m", "its arc length from the end of the flank"),
        "root_worst_slope": ("rad", "its angle of the root to the centreline of the tooth"),
        "root_worst_position": ("1", "its position in mesh periods"),
        "root_worst_path": ("1", "its path from the pitch point in base pitches"),
    }
    return {name: (("mesh", "gear"), values[..., i], *words[name]) for i, name in enumerate(words)}


def _range_entries(result: StressResult) -> dict:
    """Stress ranges over a turn, of single teeth where they differ, and the history of the planets' roots."""
    ranges, by_gear = result.ranges, ("mesh", "gear")

    def table(values):
        values = np.array(values)
        return values.reshape(-1, 2, *values.shape[1:])

    arcs = [root.arc[one.point] for root, one in zip(result.roots, ranges, strict=True)]
    entries = {
        "root_range_maximum": (
            by_gear,
            table([one.maximum for one in ranges]),
            "Pa",
            "largest stress over a turn at the point of the root with the widest range",
        ),
        "root_range_minimum": (
            by_gear,
            table([one.minimum for one in ranges]),
            "Pa",
            "smallest stress there",
        ),
        "root_range_arc": (by_gear, table(arcs), "m", "arc length of that point from the end of the flank"),
    }
    planets = [one.history for one in ranges if one.kind == "planet"]
    if planets[0] is not None:
        words = "stress over a turn at the point of the planet's root with the widest range"
        entries["planet_root_stress"] = (("mesh", "turn"), np.array(planets), "Pa", words)
    if result.cycle.periods > 1:
        longest = max(len(one.tooth_maximum) for one in ranges)
        for name, words in (("maximum", "largest"), ("minimum", "smallest")):
            rows = [getattr(one, f"tooth_{name}") for one in ranges]
            padded = [np.pad(row, (0, longest - len(row)), constant_values=np.nan) for row in rows]
            long_name = f"{words} stress of every tooth at the point of its root with the widest range"
            entries[f"tooth_root_{name}"] = (("mesh", "gear", "tooth"), table(padded), "Pa", long_name)
    return entries


def _pressure_entries(cycle) -> dict:
    """Largest pressures, and the distributions where the cycle has them."""
    largest = "largest contact pressure away from flank ends"
    entries = {"contact_pressure": (("mesh", "position"), cycle.max_pressure, "Pa", largest)}
    if cycle.pressure is None:
        return entries
    by_pair = ("mesh", "pair", "position")
    return entries | {
        "pressure_distribution": (
            ("mesh", "pair", "cell", "position"),
            cycle.pressure,
            "Pa",
            "contact pressure in the cells of a tooth pair",
        ),
        "pressure_offset": (
            ("mesh", "cell"),
            cycle.pressure_offset,
            "m",
            "place of a cell along the common tangent from the middle of its window",
        ),
        "pressure_centre": (by_pair, cycle.pressure_centre, "m", "middle of the window from the path point"),
        "pressure_path": (by_pair, cycle.path, "m", "path of the tooth pair from the pitch point"),
    }


def root_stress_dataset(roots: tuple[RootCycle, ...], mesh_names) -> xr.Dataset:
    """Root stresses as they are stored and drawn.

    Parameters
    ----------
    roots : tuple of RootCycle
        As `root_stress_cycle` gives them.
    mesh_names : sequence of str
        Label of each mesh.

    Returns
    -------
    xarray.Dataset
        ``root_tension`` and ``root_compression`` (mesh, gear, step) [Pa]: extremes along the root of the
        loaded and of the back flank of one tooth on its way through the mesh, with ``root_path`` [1] and
        ``root_load`` [N]; ``root_profile`` (mesh, gear, root, point) [Pa] along both roots when the tension
        is largest, with ``root_arc`` [m] and ``root_slope`` [rad] (mesh, gear, point). The tooth is the one
        with the largest stress. Points that a root does not have are NaN.
    """
    import xarray as xr

    variables = {
        "root_tension": ("mesh gear step", "Pa", "largest stress in the root of the loaded flank"),
        "root_compression": ("mesh gear step", "Pa", "lowest stress in the root of the back flank"),
        "root_path": ("mesh gear step", "1", "path from the pitch point in base pitches"),
        "root_load": ("mesh gear step", "N", "load of the tooth pair"),
        "root_profile": ("mesh gear root point", "Pa", "stress along the root at the largest tension"),
        "root_arc": ("mesh gear point", "m", "arc length from the end of the flank"),
        "root_slope": ("mesh gear point", "rad", "angle of the root to the centreline of the tooth"),
    }
    points = max(len(root.arc) for root in roots)
    rows = [_row(root, points) for root in roots]
    data = {}
    for name, (dims, units, words) in variables.items():
        values = np.array([row[name] for row in rows])
        values = values.reshape(len(mesh_names), 2, *values.shape[1:])
        data[name] = (tuple(dims.split()), values, {"units": units, "long_name": words})
    return xr.Dataset(
        data,
        coords={
            "mesh": ("mesh", list(mesh_names), {"units": "1", "long_name": "gear mesh"}),
            "gear": ("gear", ["first", "second"], {"units": "1", "long_name": "gear of the mesh"}),
            "root": ("root", ["loaded", "back"], {"units": "1", "long_name": "flank above the root"}),
        },
        attrs={"title": "root stresses over the mesh cycle"},
    )


def _row(root: RootCycle, points: int) -> dict[str, np.ndarray]:
    """Variables of one gear of one mesh, points padded with NaN."""
    slot, position, _ = root.worst
    history = worst_history(root)

    def padded(values):
        missing = [(0, 0)] * (values.ndim - 1) + [(0, points - values.shape[-1])]
        return np.pad(values, missing, constant_values=np.nan)

    return {
        "root_tension": history.stress[:, LOADED].max(axis=-1),
        "root_compression": history.stress[:, BACK].min(axis=-1),
        "root_path": history.path,
        "root_load": history.load,
        "root_profile": padded(root.stress[slot, position]),
        "root_arc": padded(root.arc),
        "root_slope": padded(root.slope),
    }
