"""Results as xarray datasets: what goes to disk, every variable with its units; the same as CSV files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    import xarray as xr

RPM = np.pi / 30.0
FOURIER = "x(t) = Re sum_h X_h exp(i h omega t)"
MEMBERS = ("carrier", "ring", "sun")


def dataset(variables: dict, coords: dict, attrs: dict) -> xr.Dataset:
    """Dataset of entries ``(dims, values, units, long_name)``; dims are names, or one text with spaces."""
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


def write_csv_tables(data: xr.Dataset, folder: Path, stage: str) -> list[str]:
    """Write the variables of a stage as CSV files, one for each set of dimensions; returns the file names.

    ``modes_dof_mode.csv`` holds the variables over degrees of freedom and modes, a line for each pair;
    ``modes.csv`` holds single numbers and the attributes of the file.
    """
    from femgear.storage.files import write_text

    names = []
    for dims, frame in csv_tables(data).items():
        names.append("_".join((stage, *dims)) + ".csv")
        write_text(frame.to_csv(index=False, lineterminator="\n"), folder / names[-1])
    return names


def csv_tables(data: xr.Dataset) -> dict[tuple[str, ...], pd.DataFrame]:
    """Tables of the variables of a stage by their dimensions; headers carry the units.

    Returns
    -------
    dict of tuple of str to DataFrame
        Under ``()`` single numbers and attributes, in rows of name, value and unit.
    """
    import pandas as pd

    flat = data.reset_coords()
    single = [
        *((str(name), one.item(), _unit(one)) for name, one in flat.items() if not one.dims),
        *((str(name), str(value), "") for name, value in data.attrs.items()),
    ]
    tables: dict[tuple[str, ...], pd.DataFrame] = {}
    if single:
        tables[()] = pd.DataFrame(single, columns=["name", "value", "unit"])
    for dims in dict.fromkeys(one.dims for one in flat.values() if one.dims):
        chosen = [name for name, one in flat.items() if one.dims == dims]
        frame = flat[chosen].to_dataframe(dim_order=list(dims)).reset_index()
        headers = {str(name): _header(flat, str(name)) for name in frame}
        tables[tuple(map(str, dims))] = frame.rename(columns=headers)
    return tables


def _unit(one: xr.DataArray) -> str:
    """Unit of a number, nothing for text."""
    return "" if one.dtype.kind in "OUSb" else str(one.attrs.get("units", "1"))


def _header(data: xr.Dataset, name: str) -> str:
    unit = _unit(data[name]) if name in data.variables else "1"
    return f"{name} [{unit}]" if unit else name


def complex_entries(entries) -> dict[str, tuple]:
    """Real and imaginary parts of entries ``(name, dims, values, units, long_name)``."""
    found = {}
    for name, dims, values, units, words in entries:
        found[f"{name}_real"] = (dims, values.real, units, f"{words}, real part")
        found[f"{name}_imag"] = (dims, values.imag, units, f"{words}, imaginary part")
    return found


def response_entries(result: Any) -> dict[str, tuple]:
    """What is known of the periodic response at every speed: frequency, convergence, stability.

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
