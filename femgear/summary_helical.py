"""What a helical case is, as tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears import involute
from femgear.gears.helix import virtual_teeth
from femgear.models.helical_data import contact_ratios
from femgear.summary_block import Block

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case import Case
    from femgear.gears import PlanetarySet


def describe_helical(case: Case, planetary: PlanetarySet) -> tuple[Block, ...]:
    """Helix, contact ratios, bodies and supports of a helical case.

    Parameters
    ----------
    case : Case
        With a section helical.
    planetary : PlanetarySet
        Of its transverse section.
    """
    return _teeth(case, planetary), Block(
        "Helical model", _BODIES, tuple(_bodies(case)), _model(case, planetary)
    )


_BODIES = (
    "", "mass [kg]", "polar, diametral inertia [kg m^2]", "radial, axial [N/m]", "tilt, torsional [N m/rad]",
)  # fmt: skip


def _teeth(case: Case, s: PlanetarySet) -> Block:
    helical, normal = case.helical, case.sun
    beta = helical.helix_angle
    base = involute.base_helix_angle(normal.pressure_angle, beta)
    ratios = contact_ratios(s, helix_angle=beta, face_width=case.set.face_width)
    rows = [
        (name, *(f"{value:.4f}" for value in values))
        for name, values in (
            ("transverse contact ratio", ratios[:, 0]),
            ("overlap ratio", ratios[:, 1]),
            ("total contact ratio", ratios.sum(axis=1)),
        )
    ]
    other = "left" if helical.hand == "right" else "right"
    notes = (
        f"helix angle {math.degrees(beta):.6g} deg, on the base cylinder {math.degrees(base):.6g} deg; sun "
        f"{helical.hand}-handed, planets and ring {other}-handed",
        f"normal module {normal.module * 1e3:.6g} mm, normal pressure angle "
        f"{math.degrees(normal.pressure_angle):.6g} deg; gears, meshes and static solution are those of the "
        f"transverse section: module {s.sun.module * 1e3:.6g} mm, pressure angle "
        f"{math.degrees(s.sun.pressure_angle):.6g} deg, profile shifts and racks in transverse modules",
    )
    return Block("Helix", ("", "sun-planet", "planet-ring"), tuple(rows), notes)


def _bodies(case: Case) -> Iterator[tuple[str, ...]]:
    helical, planet = case.helical, case.planet
    for name, one, radial in (
        ("sun", case.sun, case.sun.support_stiffness),
        ("ring", helical.ring, helical.ring.support_stiffness),
        ("carrier", case.carrier, case.carrier.support_stiffness),
        ("planet (pin)", planet, planet.bearing_stiffness),
    ):
        space = getattr(helical, name.partition(" ")[0])
        torsional = space.torsional_stiffness
        held = "held" if name == case.operation.fixed else "0"
        yield (
            name,
            f"{one.mass:.6g}",
            f"{one.inertia:.6g}, {space.diametral_inertia:.6g}",
            f"{radial:.6g}, {space.axial_stiffness:.6g}",
            f"{space.tilt_stiffness:.6g}, {held if torsional is None else f'{torsional:.6g}'}",
        )


def _model(case: Case, s: PlanetarySet) -> tuple[str, ...]:
    helical, given = case.helical, case.helical.mesh_stiffness
    if given is not None:
        text = (
            f"mesh stiffness along the tooth normals: sun-planet {given.sun_planet:.6g}, planet-ring "
            f"{given.planet_ring:.6g} N/m, as given"
        )
    elif helical.section == "normal":
        teeth = "/".join(str(z) for z in virtual_teeth(s, helical.helix_angle))
        text = f"mesh stiffness: of the static solution, teeth as stiff as those of virtual gears {teeth}"
    else:
        text = "mesh stiffness: of the static solution, teeth of the transverse section"
    slices = "one slice" if helical.slices == 1 else f"{helical.slices} slices"
    points = helical.contact_points.replace("_", " ")
    return text, f"{slices} over the face width; forces act at the {points}"


def describe_helical_static(static: xr.Dataset, modes: xr.Dataset | None = None) -> Block:
    """Numbers of static.nc, which holds spur gears, and beside them those of the helical meshes.

    Parameters
    ----------
    static : xarray.Dataset
        Contents of static.nc of a helical case.
    modes : xarray.Dataset, optional
        Contents of modes.nc, which has stiffness and transmission error of the helical meshes.
    """
    sources = [("spur", static["ste"], static["mesh_stiffness"])]
    if modes is not None and "helical_ste" in modes:
        sources.insert(0, ("helical", modes["helical_ste"], modes["helical_stiffness"]))
    header, columns = ["mesh"], [[str(name) for name in static["mesh"].values]]
    for name, *pair in sources:
        for values, short, factor, unit in zip(pair, ("STE", "k"), (1e6, 1e-6), ("um", "N/um")):
            values = factor * values.values
            header += [f"{name} {short} mean [{unit}]", "p-p"]
            columns += [
                [f"{v:.4g}" for v in values.mean(axis=1)],
                [f"{v:.4g}" for v in np.ptp(values, axis=1)],
            ]
    header.append("spur force [N]")
    columns.append([f"{v:.3f}" for v in static["mesh_force"].values.mean(axis=1)])
    share = static["load_share"].values
    notes = [
        "spur: transverse spur section, whose gears the slices come from; all along its line of action",
        f"load share of a planet in the transverse spur section {share.min():.4f} to {share.max():.4f} "
        f"(equal: {1 / static.sizes['planet']:.4f}); contact: {static.attrs.get('contact', 'unknown')}",
    ]
    if static.attrs.get("mesh_periods", 1) > 1:
        notes.append(str(static.attrs["period"]))
    notes += [f"[{text.strip()}" for text in str(static.attrs.get("warnings", "")).split("[") if text]
    return Block("Static", tuple(header), tuple(zip(*columns)), tuple(notes))
