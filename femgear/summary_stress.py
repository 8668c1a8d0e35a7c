"""The table of stresses: finite elements beside ISO 6336."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.summary_block import Block

if TYPE_CHECKING:
    import xarray as xr


def describe_stress(data: xr.Dataset) -> Block:
    """Largest stresses of all meshes beside the nominal ones, with place and range.

    Parameters
    ----------
    data : Dataset
        Contents of stress.nc.

    Returns
    -------
    Block
        One row for the contact and one for the root of every kind of gear, each of its worst mesh.
    """
    names = [str(name) for name in data["mesh"].values]
    kinds = {"sun-planet": ("sun", "planet, sun side"), "planet-ring": ("planet, ring side", "ring")}
    contact, roots = [], []
    for kind, titles in kinds.items():
        meshes = [i for i, name in enumerate(names) if ("ring" in name) == (kind == "planet-ring")]
        contact.append(_contact_row(kind, data.isel(mesh=meshes)))
        roots += [_root_row(title, data.isel(mesh=meshes, gear=g)) for g, title in enumerate(titles)]
    header = (
        "[MPa]",
        "FE",
        "ISO 6336",
        "FE/ISO",
        "position",
        "arc [mm]",
        "tangent [°]",
        "range",
        "cycles",
    )
    return Block("Stresses", header, (*contact, *roots), _notes(data))


def _notes(data: xr.Dataset) -> tuple[str, ...]:
    notes = [
        "ISO 6336: nominal stresses sigma_H0 and sigma_F0 (method B) with equal load on all planets and no "
        "load factors; FE: largest contact pressure away from flank ends, and largest tension in the root",
        "position in mesh periods; arc from the end of the flank, tangent to the centreline of the tooth; "
        "range: smallest to largest stress at the root point where they differ most, while the gear turns "
        "once against the carrier; cycles: load cycles of the flank in that turn",
    ]
    if data.attrs.get("iso"):
        notes.append(f"outside the range of ISO 6336: {data.attrs['iso']}")
    if not data.attrs.get("repeats", 1):
        notes.append("the record does not repeat: stress ranges are those that it shows")
    return tuple(notes)


def _contact_row(kind: str, data: xr.Dataset) -> tuple[str, ...]:
    pressure = data["contact_pressure"].values
    mesh, position = np.unravel_index(pressure.argmax(), pressure.shape)
    found, nominal = float(pressure[mesh, position]), float(data["iso_contact_stress"][mesh])
    place = f"{float(data['position'][position]):.3f}" if found else "-"
    return (f"contact {kind}", *_compared(found, nominal), place, *["-"] * 4)


def _root_row(title: str, data: xr.Dataset) -> tuple[str, ...]:
    mesh = int(data["root_worst"].values.argmax())
    one = data.isel(mesh=mesh)
    found = float(one["root_worst"])
    low, high = (float(one[f"root_range_{name}"]) for name in ("minimum", "maximum"))
    place = ["-"] * 3
    if found:
        place = [
            f"{float(one['root_worst_position']):.3f}",
            f"{float(one['root_worst_arc']) * 1e3:.3f}",
            f"{np.degrees(float(one['root_worst_slope'])):.1f}",
        ]
    return (
        f"root {title}",
        *_compared(found, float(one["iso_root_stress"])),
        *place,
        f"{low * 1e-6:.1f} to {high * 1e-6:.1f}",
        f"{float(one['load_cycles']):g}",
    )


def _compared(found: float, nominal: float) -> tuple[str, str, str]:
    """Both values in MPa and their ratio; a dash where there is none."""
    known = np.isfinite(nominal)
    ratio = f"{found / nominal:.2f}" if known and nominal else "-"
    return f"{found * 1e-6:.1f}", f"{nominal * 1e-6:.1f}" if known else "-", ratio
