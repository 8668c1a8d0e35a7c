"""Root stresses as an xarray dataset, every variable with its units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.root_stress import BACK, LOADED, RootCycle, worst_history

if TYPE_CHECKING:
    import xarray as xr


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
