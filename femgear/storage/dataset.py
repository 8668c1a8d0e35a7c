"""Results as xarray datasets: what goes to disk, every variable with its units; the same as CSV files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.storage.files import write_text

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

    from femgear.system.rigid_bodies import RigidSet

RPM = np.pi / 30.0
FOURIER = "x(t) = Re sum_h X_h exp(i h omega t)"
MEMBERS = ("carrier", "ring", "sun")


def dataset(variables: dict, coords: dict, attrs: dict) -> xr.Dataset:
    """Make a dataset of entries ``(dims, values, units, long_name)``; dims as names or one text."""
    import xarray as xr

    def made(entries):
        return {
            name: (
                dims.split() if isinstance(dims, str) else dims,
                np.asarray(values),
                {"units": units, "long_name": words},
            )
            for name, (dims, values, units, words) in entries.items()
        }

    return xr.Dataset(made(variables), coords=made(coords), attrs=attrs)


def declared(texts: Mapping[str, tuple[str, str, str]], values: Mapping[str, Any]) -> dict[str, tuple]:
    """Join declarations ``(dims, units, long_name)`` with values by name; what has no value is left out."""
    return {
        name: (dims, values[name], units, words)
        for name, (dims, units, words) in texts.items()
        if name in values
    }


def write_csv_tables(data: xr.Dataset, folder: Path, stage: str) -> list[str]:
    """Write the variables of a stage as CSV files, one for each set of dimensions; headers carry the units.

    ``modes_dof_mode.csv`` holds the variables over degrees of freedom and modes, a line for each pair;
    ``modes.csv`` holds single numbers and the attributes of the file, a line for each.

    Returns
    -------
    list of str
        File names.
    """
    import pandas as pd

    flat, tables = data.reset_coords(), {}
    single = [
        *((str(name), one.item(), _unit(one)) for name, one in flat.items() if not one.dims),
        *((str(name), str(value), "") for name, value in data.attrs.items()),
    ]
    if single:
        tables[()] = pd.DataFrame(single, columns=["name", "value", "unit"])
    for dims in dict.fromkeys(one.dims for one in flat.values() if one.dims):
        chosen = [name for name, one in flat.items() if one.dims == dims]
        frame = flat[chosen].to_dataframe(dim_order=list(dims)).reset_index()
        tables[dims] = frame.rename(columns={name: _header(flat, str(name)) for name in frame})
    names = []
    for dims, frame in tables.items():
        names.append("_".join((stage, *dims)) + ".csv")
        write_text(frame.to_csv(index=False, lineterminator="\n"), folder / names[-1])
    return names


def _unit(one: xr.DataArray) -> str:
    """Tell the unit of a number, nothing for text."""
    return "" if one.dtype.kind in "OUSb" else str(one.attrs.get("units", "1"))


def _header(data: xr.Dataset, name: str) -> str:
    """Write a name with its unit; dimensions without values of their own are numbers."""
    unit = _unit(data[name]) if name in data.variables else "1"
    return f"{name} [{unit}]" if unit else name


def complex_entries(entries) -> dict[str, tuple]:
    """Split entries into real and imaginary parts, from ``(name, dims, values, units, long_name)``."""
    found = {}
    for name, dims, values, units, words in entries:
        found[f"{name}_real"] = (dims, values.real, units, f"{words}, real part")
        found[f"{name}_imag"] = (dims, values.imag, units, f"{words}, imaginary part")
    return found


def response_entries(result: Any) -> dict[str, tuple]:
    """List what is known of the periodic response at every speed: frequency, convergence, stability.

    Of any result with a response, its stability and the speeds of the members.
    """
    response, stability, speed = result.response, result.stability, ("speed",)
    return {
        "mesh_frequency": (speed, response.mesh_frequency, "Hz", "mesh frequency"),
        "carrier_speed": (speed, [s.carrier for s in result.speeds], "rad/s", "speed of the carrier"),
        "converged": (speed, response.converged, "1", "whether the solution satisfies its tolerance"),
        "iterations": (speed, response.iterations, "1", "iterations of the fixed point"),
        "residual": (speed, response.residual, "1", "relative residual of the harmonic equations"),
        "spectral_radius": (speed, response.spectral_radius, "1", "spectral radius of the fixed point"),
        "tail": (speed, response.tail, "1", "share of the amplitude in the upper half of the harmonics"),
        "method": (speed, list(response.method), "1", "method of solution"),
        "floquet_multiplier": (speed, np.abs(stability.multiplier), "1", "largest Floquet multiplier"),
        "stable": (speed, stability.stable, "1", "whether no perturbation grows"),
    }


def _mesh_names(n: int) -> list[str]:
    return [f"sun-planet {i + 1}" for i in range(n)] + [f"planet {i + 1}-ring" for i in range(n)]


def in_space(data: RigidSet, motions: np.ndarray, axes: tuple[str, ...]) -> tuple[np.ndarray, list[str]]:
    """Motions of every body along and about x, y (and z) with their names, held ones included.

    Parameters
    ----------
    data : RigidSet
    motions : (n, m) array
        In all coordinates: two in the plane and ``u``; or three translations, two tilts and ``u``.
    axes : tuple of str
        Names of the motions of a body.
    """
    from femgear.system.rigid_bodies import member_radius

    N = data.n_planets
    full = motions.reshape(N + 3, len(axes), -1).copy()
    cosine, sine = np.cos(data.planet_angles)[:, None], np.sin(data.planet_angles)[:, None]
    for first in range(0, len(axes), 3):
        radial, tangential = full[3:, first].copy(), full[3:, first + 1].copy()
        full[3:, first] = radial * cosine - tangential * sine
        full[3:, first + 1] = radial * sine + tangential * cosine
    radii = np.array([member_radius(data, name) for name in MEMBERS] + [data.planet_radius] * N)
    full[:, -(len(axes) // 2) :] /= radii[:, None, None]
    bodies = [*MEMBERS, *(f"planet {n + 1}" for n in range(N))]
    return full.reshape(len(motions), -1), [f"{body}: {axis}" for body in bodies for axis in axes]
