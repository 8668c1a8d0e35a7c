"""Titled tables for the terminal and the page, and those of modes and periodic responses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import Finding, remark

if TYPE_CHECKING:
    import xarray as xr

MANY = 8
"""Rows of a table that shows the speeds."""
_MODES = 16
"""Rows of the table of modes."""
_NAMED = 8
"""Speeds that a warning names."""


@dataclass(frozen=True)
class Block:
    """A titled table with notes under it.

    Parameters
    ----------
    title : str
    header : tuple of str
        Names of the columns, or empty.
    rows : tuple of tuple of str
    notes : tuple of str
    """

    title: str
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()


def describe_modes(data: xr.Dataset) -> Block:
    """Natural frequencies, kinds and nodal diameters of the first modes of modes.nc."""
    shown = min(data.sizes["mode"], _MODES)
    rows = tuple(
        (
            str(i + 1),
            f"{float(data.frequency[i]):.2f}",
            str(data.kind.values[i]),
            "-" if data.nodal_diameter[i] < 0 else str(int(data.nodal_diameter[i])),
        )
        for i in range(shown)
    )
    notes = (
        f"{data.sizes['mode']} modes up to {float(data.frequency.max()):.0f} Hz, the first {shown} shown",
    )
    return Block("Modes", ("mode", "frequency [Hz]", "kind", "nodal diameters"), rows, notes)


def describe_response(data: xr.Dataset) -> Block:
    """Transmission error, convergence and stability at every speed of dynamics.nc."""
    dte = np.hypot(data.dte_real.values, data.dte_imag.values)  # speed, mesh, harmonic
    rms = np.sqrt(0.5 * (dte[:, :, 1:] ** 2).sum(axis=2)).max(axis=1)
    largest = np.abs(data.floquet_multiplier.values)
    stable = data.stable.values.astype(bool) if "stable" in data else largest < 1.0
    # helical cases are excited by a number of harmonics
    reach = [()] * data.sizes["speed"]
    if "excitation_limit" in data:
        reach = [(f"{value / 1e3:.2f}",) for value in data.excitation_limit.values]
    rows = tuple(
        (
            f"{float(data.speed[i]):.2f}",
            f"{float(data.mesh_frequency[i]):.2f}",
            *reach[i],
            f"{rms[i] * 1e6:.4f}",
            str(data.method.values[i]),
            str(int(data.iterations[i])),
            f"{float(data.spectral_radius[i]):.4f}",
            f"{largest[i]:.4f}",
            "yes" if bool(data.converged[i]) else "NO",
        )
        for i in chosen(data.sizes["speed"])
    )
    header = (
        "speed [rpm]",
        "mesh [Hz]",
        *(("excited up to [kHz]",) if reach[0] else ()),
        "DTE rms [um]",
        "method",
        "iterations",
        "radius",
        "Floquet",
        "converged",
    )
    notes = (
        "DTE rms: the largest of all meshes, without its mean; iterations, radius: of the fixed point,",
        "which contracts below 1; Floquet: largest multiplier, stable up to 1 (exactly 1 without damping)",
        f"{int(data.converged.sum())} of {len(stable)} speeds converged, {int(stable.sum())} stable",
    )
    if "level_change" in data:
        change = np.abs(data.level_change.values)
        notes += (
            f"level of the housing with excitation up to {data.attrs['compared_to'] / 1e3:.4g} kHz: "
            f"{np.nanmax(change):.2g} dB away at most, at {int(np.isfinite(change).sum())} speeds looked at",
        )
    return Block("Dynamics", header, rows, notes)


def chosen(count: int) -> Iterator[int]:
    """All indices of a short list, the first and last of a long one."""
    return (i for i in range(count) if count <= MANY or i < MANY // 2 or i >= count - MANY // 2)


def response_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """What the solver says against the periodic responses of dynamics.nc."""
    speed = data["speed"].values
    for bad, text in (
        (~data["converged"].values.astype(bool), "the periodic solution did not converge at"),
        (~data["stable"].values.astype(bool), "the periodic solution is unstable at"),
    ):
        if bad.any():
            shown = ", ".join(f"{value:.6g}" for value in speed[bad][:_NAMED])
            rest = np.count_nonzero(bad) - _NAMED
            yield remark(f"{text} {shown} rpm{f' and {rest} more speeds' if rest > 0 else ''}")
